/* Loops on their way onto a tree. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "describe.h"
#include "fixture.h"

#include "kinetree/mechanism.h"
#include "kinetree/model.h"

#include <math.h>
#include <string.h>

enum { ARM, PLATE, SHELF, BODIES };

/* An arm on the ground, a plate fixed to it and a shelf fixed to the ground, and one loop. */
typedef struct scene {
    kt_description description;
    kt_body body[BODIES];
    kt_loop loop;
} scene;

static void describe(scene *s, kt_loop_type type, const char *first, const char *second) {
    static const char *const names[] = {"arm", "plate", "shelf"};
    for (int i = 0; i < BODIES; i++) {
        s->body[i] = kt_body_default();
        s->body[i].name = names[i];
        s->body[i].mass = 1.0;
        s->body[i].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    }
    s->body[ARM].joint.type = KT_JOINT_SPHERICAL;
    s->body[PLATE].parent = "arm";
    s->loop = kt_loop_of("pin", type);
    s->loop.between[0] = s->loop.between[1] = kt_end_default();
    s->loop.between[0].body = first;
    s->loop.between[1].body = second;
    s->description = kt_description_of(s->body, BODIES, &s->loop, 1, NULL, 0);
}

static kt_status compile(const scene *s, kt_error *error) {
    kt_model *model = NULL;
    const kt_status status = kt_model_compile(&s->description, NULL, &model, error);
    kt_check_true("a model on success only", (status == KT_OK) == (model != NULL));
    kt_model_free(model);
    return status;
}

/* For any demand of the loop, the two bodies have no relative motion left that it could prevent or allow. */
KT_TEST(a_loop_within_one_rigid_part_is_rejected) {
    static const char *const ends[][2] = {{"arm", "plate"}, {"plate", "arm"}, {"world", "shelf"}, {"shelf", NULL}};
    static const kt_loop_type types[] = {KT_LOOP_SPHERICAL, KT_LOOP_WELD, KT_LOOP_INPLANE, KT_LOOP_UNIVERSAL};
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 4; k++) {
            scene s;
            kt_error error = {KT_OK, "", ""};
            describe(&s, types[k], ends[i][0], ends[i][1]);
            s.loop.axis2 = kt_vec3_make(1.0, 0.0, 0.0);
            kt_check_equal_int(kt_loop_type_name(types[k]), compile(&s, &error), KT_ERROR_MODEL);
            kt_check_text("where", error.where, "loop 'pin'");
            kt_check_contains("words", error.message, "both its ends are on the same rigid part");
        }
    scene s;
    kt_error error = {KT_OK, "", ""};
    describe(&s, KT_LOOP_INPLANE, "plate", "shelf");
    kt_check_equal_int("between two parts", compile(&s, &error), KT_OK);
}

/* A distance without a length has that of the given positions, of which zero is none. */
KT_TEST(distance_of_ends_that_coincide_is_rejected) {
    static const double apart[] = {0.0, 0.1 + 0.2 - 0.3, 1e-6};
    for (int i = 0; i < 3; i++) {
        scene s;
        kt_error error = {KT_OK, "", ""};
        describe(&s, KT_LOOP_DISTANCE, "plate", "shelf");
        s.loop.between[0].at = kt_vec3_make(1.0, 0.0, 0.0);
        s.loop.between[1].at = kt_vec3_make(1.0 + apart[i], 0.0, 0.0);
        kt_check_equal_int("status", compile(&s, &error), i < 2 ? KT_ERROR_MODEL : KT_OK);
        if (i == 2)
            continue;
        kt_check_text("where", error.where, "loop 'pin'");
        kt_check_contains("words", error.message, "its length would be 0; give a length");
    }
}

/* A quaternion of which one number alone is not zero is a rotation, and stays as it is given. */
KT_TEST(half_turns_are_initial_positions) {
    for (int k = 0; k < 4; k++) {
        scene s;
        kt_error error = {KT_OK, "", ""};
        kt_model *model = NULL;
        double q[4], v[3], expected[4] = {0.0, 0.0, 0.0, 0.0};
        describe(&s, KT_LOOP_SPHERICAL, NULL, NULL);
        s.description.loop_count = 0;
        s.body[ARM].joint.position[k] = expected[k] = 1.0;
        kt_need(kt_check_equal_int("status", kt_model_compile(&s.description, NULL, &model, &error), KT_OK));
        kt_model_initial(model, q, v);
        kt_check_equal_bits("position", q, expected, 4);
        kt_model_free(model);
    }
}

/* Two wheels in mesh outside of each other: r a = -r2 b for their angles about the loop's z. The joint of the second
 * wheel turns about -z, so that its coordinate is -b. Radii in the golden ratio fit no numbers of teeth, so that the
 * joints count the turns. */
KT_TEST(joints_against_the_axis_of_a_gear_count_its_turns_backwards) {
    const double radius2 = 0.5 + sqrt(1.25), q0[2] = {7.5, 0.0};
    kt_body body[2];
    kt_loop loop = kt_loop_of("mesh", KT_LOOP_GEAR);
    const char *hold[] = {"first"};
    double q[2], v[2];
    kt_error error = {0};
    for (int i = 0; i < 2; i++) {
        body[i] = kt_body_of(i == 0 ? "first" : "second", NULL, KT_JOINT_REVOLUTE, 1.0);
        body[i].joint.axis = kt_vec3_make(0.0, 0.0, i == 0 ? 1.0 : -1.0);
        body[i].joint.at.x = i * (1.0 + radius2);
        body[i].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
        loop.between[i].body = body[i].name;
    }
    loop.axis = loop.axis2 = kt_vec3_make(0.0, 0.0, 1.0);
    loop.radius = 1.0;
    loop.radius2 = radius2;
    kt_description description = kt_description_of(body, 2, &loop, 1, NULL, 0);
    description.hold = hold;
    description.hold_count = 1;
    kt_model *model = kt_test_model(&description, NULL);
    kt_data *data = kt_test_data(model);
    kt_model_initial(model, q, v);
    memcpy(q, q0, sizeof q);
    if (kt_fine("assemble", kt_state_assemble(model, data, 0.0, q, v, &error), &error)) {
        kt_check_near("first wheel", q[0], q0[0], 1e-12);
        kt_check_near("second wheel", q[1], q0[0] / radius2, 1e-12);
    }
}
