/* Data serve the model for which they were made, its copies, and models of equal descriptions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fixture.h"

#include "kinetree/mechanism.h"

#include <math.h>
#include <stdlib.h>

/* Numbers of which each model but the first has another one. */
typedef struct constants {
    double length, mass, stiffness, rod, armature;
    bool across;
} constants;

/* A pendulum with a spring and a rod to the world. */
static kt_model *model_with(constants c) {
    kt_marker tip = {.name = "tip", .at = {0.0, 0.0, c.length}};
    kt_body body = kt_body_default();
    kt_loop loop = kt_loop_default();
    kt_effect spring = kt_effect_default();
    kt_description d = kt_description_default();
    kt_model *model = NULL;
    kt_error e = {0};
    body.name = "a";
    body.joint.type = KT_JOINT_REVOLUTE;
    body.joint.axis = c.across ? kt_vec3_make(1.0, 0.0, 0.0) : kt_vec3_make(0.0, 1.0, 0.0);
    body.joint.armature[0] = c.armature;
    body.com = kt_vec3_make(0.0, 0.0, 0.5);
    body.mass = c.mass;
    body.markers = &tip;
    body.marker_count = 1;
    loop.type = KT_LOOP_DISTANCE;
    loop.name = "rod";
    loop.between[0] = (kt_end){.body = "a", .marker = "tip"};
    loop.between[1] = (kt_end){.at = kt_vec3_make(0.6 * c.rod, 0.8 * c.rod, c.length)};
    loop.function = kt_function_constant(c.rod);
    spring.type = KT_EFFECT_JOINT_SPRING;
    spring.joint = "a";
    spring.stiffness = c.stiffness;
    d.bodies = &body;
    d.body_count = 1;
    d.loops = &loop;
    d.loop_count = 1;
    d.effects = &spring;
    d.effect_count = 1;
    kt_need_fine("model", kt_model_compile(&d, NULL, &model, &e), &e);
    return model;
}

static kt_data *data_of(const kt_model *model) {
    const double q = 0.0, v = 0.0;
    kt_data *data = NULL;
    kt_error e = {0};
    kt_need_fine("data", kt_data_create(model, &data, &e), &e);
    kt_need_fine("update", kt_kinematics_update(model, data, &q, &v, NULL, &e), &e);
    return data;
}

/* Two models of one layout differ in one number each. A second model of equal numbers takes the data of the first, and
 * so does a copy, also with a parameter of its own. */
KT_TEST(data_of_a_model_with_other_constants_are_rejected) {
    static const constants all[] = {{1.0, 1.0, 2.0, 1.0, 0.0, false}, {2.0, 1.0, 2.0, 1.0, 0.0, false},
                                    {1.0, 3.0, 2.0, 1.0, 0.0, false}, {1.0, 1.0, 2.1, 1.0, 0.0, false},
                                    {1.0, 1.0, 2.0, 1.5, 0.0, false}, {1.0, 1.0, 2.0, 1.0, 0.1, false},
                                    {1.0, 1.0, 2.0, 1.0, 0.0, true}};
    const kt_vec3 tip = kt_vec3_make(0.0, 0.0, 1.0);
    const double q = 0.0, v = 0.0, heavy = 5.0;
    double tau = 0.0;
    kt_error e = {0};
    kt_parameter mass;
    kt_model *model = model_with(all[0]), *equal = model_with(all[0]), *copy = NULL;
    kt_data *own = data_of(model);
    const size_t size = (kt_model_size(model) + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT;
    void *memory = aligned_alloc(KT_ALIGNMENT, size);
    kt_need_fine("copy", kt_model_copy(model, memory, size, &copy, &e), &e);
    kt_need_fine("find", kt_parameter_find(copy, "a.mass", &mass, &e), &e);
    kt_need_fine("set", kt_parameter_set(copy, &mass, &heavy, &e), &e);
    kt_check_equal_int("equal", kt_dynamics_inverse(equal, own, &q, &v, NULL, NULL, &tau, &e), KT_OK);
    kt_check_equal_int("copy", kt_dynamics_inverse(copy, own, &q, &v, NULL, NULL, &tau, &e), KT_OK);
    for (size_t k = 1; k < sizeof all / sizeof *all; k++) {
        kt_model *other = model_with(all[k]);
        kt_data *data = data_of(other);
        kt_check_equal_int("call", kt_dynamics_inverse(model, data, &q, &v, NULL, NULL, &tau, &e), KT_ERROR_ARGUMENT);
        kt_check_contains("message", e.message, "another model");
        kt_check_true("query", isnan(kt_point_position(model, data, 1, tip).z));
        kt_data_free(data);
        kt_model_free(other);
    }
    kt_data_free(own);
    kt_model_free(equal);
    kt_model_free(model);
    free(memory);
}
