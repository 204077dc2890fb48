/* The default structs of a description, and the names of types. */
#include "model/record.h"

#include <math.h>
#include <stddef.h>

static const kt_vec3 axis_z = {0.0, 0.0, 1.0};

kt_joint kt_joint_default(void) {
    const double none = (double)INFINITY;
    const kt_joint joint = {.type = KT_JOINT_FIXED, .axis = axis_z, .limits = {-none, none, none, none}};
    return joint;
}

kt_shape kt_shape_default(void) {
    const kt_shape shape = {.type = KT_SHAPE_NONE, .axis = axis_z};
    return shape;
}

kt_body kt_body_default(void) {
    const kt_body body = {.name = NULL, .joint = kt_joint_default(), .shape = kt_shape_default()};
    return body;
}

kt_end kt_end_default(void) {
    const kt_end end = {.body = NULL};
    return end;
}

kt_loop kt_loop_default(void) {
    const kt_loop loop = {
        .name = NULL,
        .axis = axis_z,
        .axis2 = axis_z,
        .holonomic = true,
#if KT_HAS_SWITCHES
        .rest_velocity = 1e-6
#endif
    };
    return loop;
}

kt_effect kt_effect_default(void) {
    const kt_effect effect = {.name = NULL,
                              .stribeck = 0.01,
                              .smoothing = 1e-3,
                              .lower = -(double)INFINITY,
                              .upper = (double)INFINITY,
                              .limit = (double)INFINITY,
                              .exponent = 1.5,
                              .slip = 1e-3,
                              .restitution = (double)INFINITY,
                              .rest_velocity = 1e-6,
                              .axis = axis_z};
    return effect;
}

kt_state kt_state_default(void) {
    const kt_state state = {.name = NULL};
    return state;
}

kt_description kt_description_default(void) {
    const kt_description description = {.name = NULL, .tolerance = 1e-6};
    return description;
}

#define JOINT_CASE(id, name, nq, nv)                                                                                   \
    case id:                                                                                                           \
        return #name;

const char *kt_joint_type_name(kt_joint_type type) {
    switch (type) {
        KT_JOINT_LIST(JOINT_CASE)
    case KT_JOINT_TYPE_COUNT:
        break;
    }
    return NULL;
}

#define NAME_CASE(id, name)                                                                                            \
    case id:                                                                                                           \
        return #name;

const char *kt_shape_type_name(kt_shape_type type) {
    switch (type) {
        KT_SHAPE_LIST(NAME_CASE)
    case KT_SHAPE_TYPE_COUNT:
        break;
    }
    return NULL;
}

const char *kt_loop_type_name(kt_loop_type type) {
    switch (type) {
        KT_LOOP_LIST(NAME_CASE)
    case KT_LOOP_CUSTOM:
        return "custom";
    case KT_LOOP_TYPE_COUNT:
        break;
    }
    return NULL;
}

const char *kt_effect_type_name(kt_effect_type type) {
    switch (type) {
        KT_EFFECT_LIST(NAME_CASE)
    case KT_EFFECT_CUSTOM:
        return "custom";
    case KT_EFFECT_TYPE_COUNT:
        break;
    }
    return NULL;
}
