/* The default structs of a description, and the names of types. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/describe.h"
#include "model/record.h"

#include <math.h>
#include <stddef.h>

static const kt_vec3 axis_z = {0.0, 0.0, 1.0};
static const double pi = 3.14159265358979323846;

kt_joint kt_joint_default(void) {
    const double none = (double)INFINITY;
    return (kt_joint){.type = KT_JOINT_FIXED, .axis = axis_z, .limits = {-none, none, none, none}};
}

kt_shape kt_shape_default(void) { return (kt_shape){.type = KT_SHAPE_NONE, .axis = axis_z}; }

kt_body kt_body_default(void) {
    return (kt_body){.name = NULL, .joint = kt_joint_default(), .shape = kt_shape_default()};
}

kt_end kt_end_default(void) { return (kt_end){.body = NULL}; }

kt_loop kt_loop_default(void) {
    return (kt_loop){.name = NULL,
                     .axis = axis_z,
                     .axis2 = axis_z,
                     .holonomic = true,
                     .pressure_angle = pi / 9.0,
                     .rest_velocity = 1e-6};
}

kt_effect kt_effect_default(void) {
    return (kt_effect){.name = NULL,
                       .stribeck = 0.01,
                       .smoothing = 1e-3,
                       .efficiency = 1.0,
                       .lower = -(double)INFINITY,
                       .upper = (double)INFINITY,
                       .limit = (double)INFINITY,
                       .exponent = 1.5,
                       .slip = 1e-3,
                       .turn = 1e-2,
                       .restitution = (double)INFINITY,
                       .rest_velocity = 1e-6,
                       .axis = axis_z};
}

kt_auxiliary_state kt_auxiliary_state_default(void) { return (kt_auxiliary_state){.name = NULL}; }

kt_description kt_description_default(void) { return (kt_description){.name = NULL, .tolerance = 1e-6}; }

#define JOINT_NAME(id, name, nq, nv) #name,

const char *kt_joint_type_name(kt_joint_type type) {
    static const char *const names[] = {KT_JOINT_LIST(JOINT_NAME)};
    return (unsigned)type < KT_JOINT_TYPE_COUNT ? names[type] : NULL;
}

const char *kt_shape_type_name(kt_shape_type type) {
    static const char *const names[] = {KT_SHAPE_LIST(KT_LISTED_NAME)};
    return (unsigned)type < KT_SHAPE_TYPE_COUNT ? names[type] : NULL;
}

const char *kt_loop_type_name(kt_loop_type type) {
    static const char *const names[] = {KT_LOOP_LIST(KT_LISTED_NAME)};
    return type == KT_LOOP_CUSTOM ? "custom" : (unsigned)type < KT_LOOP_TYPE_COUNT ? names[type] : NULL;
}

const char *kt_effect_type_name(kt_effect_type type) {
    static const char *const names[] = {KT_EFFECT_LIST(KT_LISTED_NAME)};
    return type == KT_EFFECT_CUSTOM ? "custom" : (unsigned)type < KT_EFFECT_TYPE_COUNT ? names[type] : NULL;
}
