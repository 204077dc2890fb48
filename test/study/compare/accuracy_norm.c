/* The norm in which errors are measured, coordinate by coordinate, against differences that are given beforehand. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "describe.h"

#include "compare/accuracy.h"

#include <float.h>
#include <math.h>

static const double turn = 6.28318530717958647692;

/* One body of 1 kg on a joint of this type. NULL after a failed check. */
static kt_model *make_model(kt_joint_type type) {
    kt_model *model = NULL;
    kt_error error;
    kt_body body = kt_body_of("body", NULL, type, 1.0);
    body.inertia = (kt_sym3){1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
    body.joint.pitch = 0.5;
    kt_description description = kt_description_of(&body, 1, NULL, 0, NULL, 0);
    kt_check_equal_int(kt_joint_type_name(type), kt_model_compile(&description, NULL, &model, &error), KT_OK);
    return model;
}

/* From a state of zeros (no rotation) to q. */
static kt_accuracy_norm measure(kt_model *model, double length, const double *q, const double *v) {
    double start[KT_JOINT_NQ_MAX], rest[KT_JOINT_NV_MAX] = {0.0}, dv[KT_JOINT_NV_MAX], initial[KT_JOINT_NV_MAX];
    const kt_accuracy study = {
        .model = model, .nv = (size_t)kt_model_nv(model), .results.length = length, .difference = dv};
    kt_model_initial(model, start, initial);
    return kt_accuracy_distance(&study, (kt_accuracy_state){start, rest}, (kt_accuracy_state){q, v});
}

static void expect(kt_joint_type type, const double *q, double length, double expected) {
    static const double rest[KT_JOINT_NV_MAX];
    kt_model *model = make_model(type);
    if (model != NULL)
        kt_check_near(kt_joint_type_name(type), measure(model, length, q, rest).position, expected,
                      16.0 * DBL_EPSILON * fmax(1.0, expected));
    kt_model_free(model);
}

KT_TEST(angles_lie_on_the_circle_but_for_screws) {
    const double almost = turn - 0.25, two[2] = {turn + 0.125, 3.0}, planar[3] = {0.0, 0.0, 2.0 * turn + 0.5};
    expect(KT_JOINT_REVOLUTE, &almost, 1.0, 0.25);
    expect(KT_JOINT_REVOLUTE, &turn, 1.0, 0.0);
    expect(KT_JOINT_CYLINDRICAL, two, 100.0, 0.125);
    expect(KT_JOINT_UNIVERSAL, two, 1.0, 3.0);
    expect(KT_JOINT_PLANAR, planar, 1.0, 0.5);
    expect(KT_JOINT_SCREW, &turn, 1.0, turn);
}

KT_TEST(lengths_are_held_against_the_length_scale) {
    const double slide = -0.75, cylindrical[2] = {0.0, 3.0}, planar[3] = {0.3, -0.4, 0.0};
    expect(KT_JOINT_PRISMATIC, &slide, 1.0, 0.75);
    expect(KT_JOINT_PRISMATIC, &slide, 3.0, 0.25);
    expect(KT_JOINT_CYLINDRICAL, cylindrical, 2.0, 1.5);
    expect(KT_JOINT_PLANAR, planar, 1.0, 0.5); /* as a vector */
}

KT_TEST(quaternions_count_by_the_rotation_between_them) {
    const double angle = 0.7, half = 0.5 * angle;
    double q[4] = {cos(half), sin(half) / 3.0, 2.0 * sin(half) / 3.0, -2.0 * sin(half) / 3.0};
    double free[7] = {0.0, 0.3, 0.4, q[0], q[1], q[2], q[3]};
    expect(KT_JOINT_SPHERICAL, q, 1.0, angle);
    expect(KT_JOINT_FREE, free, 1.0, angle);
    expect(KT_JOINT_FREE, free, 0.25, 2.0);
    for (int i = 0; i < 4; i++)
        q[i] = -q[i]; /* the same rotation */
    expect(KT_JOINT_SPHERICAL, q, 1.0, angle);
}

/* A rate of a whole turn a second is no rest. */
KT_TEST(rates_do_not_lie_on_the_circle) {
    kt_model *model = make_model(KT_JOINT_REVOLUTE);
    const double q = 0.0, v = turn;
    if (model != NULL)
        kt_check_near("rate", measure(model, 1.0, &q, &v).velocity, turn, 2.0 * DBL_EPSILON);
    kt_model_free(model);
}

KT_TEST(what_is_not_finite_is_not_small) {
    kt_model *model = make_model(KT_JOINT_UNIVERSAL);
    const double q[2] = {(double)NAN, 0.5}, swapped[2] = {0.5, (double)NAN}, v[2] = {0.0, 0.0};
    if (model != NULL) {
        kt_check_true("first", isnan(measure(model, 1.0, q, v).position));
        kt_check_true("second", isnan(measure(model, 1.0, swapped, v).position));
    }
    kt_model_free(model);
}

KT_TEST(unit_is_that_of_the_coordinates) {
    static const struct {
        kt_joint_type type;
        kt_accuracy_unit unit;
    } cases[] = {{KT_JOINT_REVOLUTE, KT_ACCURACY_RADIAN},
                 {KT_JOINT_SPHERICAL, KT_ACCURACY_RADIAN},
                 {KT_JOINT_PRISMATIC, KT_ACCURACY_METRE},
                 {KT_JOINT_CYLINDRICAL, KT_ACCURACY_MIXED},
                 {KT_JOINT_FREE, KT_ACCURACY_MIXED}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        kt_model *model = make_model(cases[i].type);
        if (model != NULL)
            kt_check_equal_int(kt_joint_type_name(cases[i].type), kt_accuracy_find_unit(model), cases[i].unit);
        kt_model_free(model);
    }
}
