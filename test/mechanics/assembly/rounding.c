/* Rounding is not mistaken for a contradiction, nor a contradiction for rounding. Redundant hinges and pins have places
 * that are sums of numbers, near the world's origin and far from it. Their sizes range from 1e-9 to 1e9 m. The same
 * hinges and pins are also placed apart by more than rounding explains.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/closure.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <string.h>

static const double sizes[] = {1e-9, 1e-6, 1e-3, 1.0, 1e3, 1e6, 1e9};
enum { SIZES = 7, ONE = 3 };

static kt_vec3 random_vector(kt_random *r, double size) {
    const double x = kt_random_uniform(r, -size, size), y = kt_random_uniform(r, -size, size);
    return kt_vec3_make(x, y, kt_random_uniform(r, -size, size));
}

/* A door on a frame. The joint of the door is on the world, at the place `arm` of the frame up to rounding. A loop
 * holds the door a second time at `arm`, displaced across the axis by `apart`. */
typedef struct door {
    kt_loop_type type;
    double size;  /* of all lengths */
    double far;   /* of the frame from the world's origin, in sizes */
    double apart; /* m */
    bool window;  /* the door carries a parallelogram, whose loop is as long as it seems */
    bool aside;   /* the pin is not at the door's origin, but elsewhere on its axis */
    bool oblique; /* frame and axis; if false, places are tenths, and sums like 0.1 + 0.2 are rounded */
} door;

/* Some tenths of s, other tenths, and their sum, which the sum of the two may miss by its last bit. */
static void take_tenths(kt_random *r, double s, double *first, double *second, double *sum) {
    const double a = floor(kt_random_uniform(r, 1.0, 10.0)), b = floor(kt_random_uniform(r, 1.0, 10.0));
    *first = a / 10.0 * s;
    *second = b / 10.0 * s;
    *sum = (a + b) / 10.0 * s;
}

/* x as another way of computing it may have it. */
static double nudged(kt_random *r, double x) {
    return x * (1.0 + DBL_EPSILON * floor(kt_random_uniform(r, -2.0, 3.0)));
}

static void hang_door(linkage *l, kt_random *r, const door *d) {
    const double s = d->size, angle[3] = {kt_random_uniform(r, -3.0, 3.0), kt_random_uniform(r, -1.5, 1.5),
                                          kt_random_uniform(r, -3.0, 3.0)};
    const kt_rotation turned =
        d->oblique ? kt_rotation_rpy(angle[0], angle[1], angle[2]) : kt_rotation_rpy(0.0, 0.0, 0.0);
    const kt_mat3 rotation =
        d->oblique ? kt_mat3_from_rpy(kt_vec3_make(angle[0], angle[1], angle[2])) : kt_mat3_identity();
    kt_vec3 place = random_vector(r, s), arm = random_vector(r, s), axis = kt_vec3_normalize(random_vector(r, 1.0));
    place.x += d->far * s;
    kt_vec3 there = kt_vec3_add(place, kt_mat3_apply(rotation, arm));
    there = kt_vec3_make(nudged(r, there.x), nudged(r, there.y), nudged(r, there.z));
    if (!d->oblique) {
        take_tenths(r, s, &place.x, &arm.x, &there.x);
        take_tenths(r, s, &place.y, &arm.y, &there.y);
        take_tenths(r, s, &place.z, &arm.z, &there.z);
        axis = kt_vec3_make(0.0, 0.0, 1.0);
    }
    linkage_begin(l);
    l->description.gravity = kt_vec3_make(0.0, -9.81 * s, 0.3 * s);
    kt_body *frame = linkage_bar(l, "frame", NULL, place, arm, 0.0, 0.0);
    frame->joint.type = KT_JOINT_FIXED;
    frame->joint.rotation = turned;
    kt_body *leaf = linkage_bar(l, "leaf", NULL, there, random_vector(r, s), kt_random_uniform(r, -2.0, 2.0),
                                kt_random_uniform(r, -2.0, 2.0));
    leaf->joint.rotation = turned;
    leaf->joint.axis = axis;
    const double along = d->aside ? kt_random_uniform(r, -s, s) : 0.0;
    const double slide = d->type == KT_LOOP_INLINE && d->aside ? 0.3 * s : 0.0; /* free in an inline loop */
    const kt_vec3 across = kt_vec3_normalize(kt_vec3_cross(axis, kt_vec3_make(0.31, 0.2, -0.5)));
    kt_loop *hinge =
        linkage_close(l, "hinge", d->type, "frame",
                      kt_vec3_add(kt_vec3_add(arm, kt_vec3_scale(along, axis)), kt_vec3_scale(d->apart, across)),
                      "leaf", kt_vec3_scale(along + slide, axis));
    hinge->axis = axis;
    if (!d->window)
        return;
    const kt_vec3 none = {0.0, 0.0, 0.0}, side = {s, 0.0, 0.0}, up = {0.0, s, 0.0};
    linkage_bar(l, "left", "leaf", none, up, 0.0, 0.0);
    linkage_bar(l, "top", "left", up, side, 0.0, 0.0);
    linkage_bar(l, "right", "leaf", side, up, 0.0, 0.0);
    linkage_close(l, "window", KT_LOOP_REVOLUTE, "top", side, "right", up);
}

/* The angle after 20 steps; NaN if a call fails, or the assembly moves given coordinates. */
static double swing(linkage *l, double size) {
    linkage_run run;
    kt_error e = {0};
    const double q = l->q[0], v = l->v[0];
    const kt_status status = kt_state_assemble(l->model, l->data, 0.0, l->q, l->v, &e);
    if (status != KT_OK)
        kt_note("size %g: %s", size, e.message);
    if (status != KT_OK || l->q[0] != q || l->v[0] != v)
        return (double)NAN;
    linkage_run_start(&run, l, "rk4", 1e-3, 0.0, false, 0.0);
    linkage_run_to(&run, 0.02);
    return l->q[0];
}

/* Whether the door swings as it does without the second hinge. */
static bool swings(linkage *l, double size) {
    const double with = swing(l, size);
    l->description.loops++; /* the hinge is the first */
    l->description.loop_count--;
    linkage_compile(l);
    return fabs(swing(l, size) - with) <= 1e-14 * fabs(with);
}

static int rejected(kt_random *r, const door *d, int count) {
    static linkage l;
    int failed = 0;
    for (int i = 0; i < count; i++) {
        hang_door(&l, r, d);
        linkage_compile(&l);
        const kt_mobility m = kt_model_mobility(l.model);
        failed += !(m.rank == 2 * d->window && m.minimal == 1 + d->window && l.model->length > 1e-3 * d->size &&
                    swings(&l, d->size));
    }
    return failed;
}

KT_TEST(a_second_hinge_in_the_same_place_is_redundant_at_every_size) {
    kt_random r = kt_random_of_test();
    for (int k = 0; k < SIZES; k++) {
        door d = {.type = KT_LOOP_REVOLUTE, .size = sizes[k]};
        kt_note("%g m", sizes[k]);
        kt_check_equal_int("at sums of tenths", rejected(&r, &d, k == ONE ? 150 : 20), 0);
        d.oblique = true;
        kt_check_equal_int("oblique", rejected(&r, &d, k == ONE ? 150 : 20), 0);
        d.far = 1e6;
        kt_check_equal_int("oblique and far away", rejected(&r, &d, 20), 0);
        d.window = true;
        kt_check_equal_int("with a window, far away", rejected(&r, &d, 20), 0);
        d.far = 0.0;
        kt_check_equal_int("with a window", rejected(&r, &d, 20), 0);
    }
}

KT_TEST(pins_on_a_body_s_own_axis_are_redundant_at_every_size) {
    static const kt_loop_type types[] = {KT_LOOP_REVOLUTE, KT_LOOP_SPHERICAL, KT_LOOP_INLINE};
    kt_random r = kt_random_of_test();
    for (int type = 0; type < 3; type++)
        for (int k = 0; k < SIZES; k++)
            for (int aside = 0; aside < 2; aside++) {
                const door d = {.type = types[type], .size = sizes[k], .aside = aside, .oblique = true};
                kt_note("%s, %g m", kt_loop_type_name(types[type]), sizes[k]);
                kt_check_equal_int("rejected", rejected(&r, &d, k == ONE ? 60 : 10), 0);
            }
}

/* A gap of 1e-9 of the lengths is a million times the effect of rounding. With a tolerance it may be an effect of
 * rounded data (disagreement.c). */
KT_TEST(hinges_apart_by_more_than_rounding_are_rejected_at_every_size) {
    static const double parts[] = {1e-9, 1e-6, 1e-3, 0.1};
    static linkage l;
    kt_random r = kt_random_of_test();
    for (int k = 0; k < SIZES; k++)
        for (int part = 0; part < 4; part++) {
            int taken = 0, named = 0;
            for (int i = 0; i < 10; i++) {
                kt_error e = {0};
                const door d = {.type = KT_LOOP_REVOLUTE,
                                .size = sizes[k],
                                .apart = parts[part] * 4.0 * sizes[k],
                                .aside = i % 2,
                                .oblique = i % 3};
                hang_door(&l, &r, &d);
                l.description.tolerance = 0.0;
                linkage_compile(&l);
                taken += kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e) != KT_ERROR_CONSTRAINT;
                named += strstr(e.message, "'hinge' by ") != NULL;
            }
            kt_note("%g m, apart by %g of that", sizes[k], 4.0 * parts[part]);
            kt_check_equal_int("taken", taken, 0);
            kt_check_equal_int("named", named, 10);
        }
}

/* Two cranks on one shaft, driven by the same sine in two ways. At its crest the rate is A w cos(pi / 2). One way
 * computes this as 6e-17 A w, the other as zero. */
KT_TEST(drives_agree_at_the_crest_of_a_sine) {
    static linkage l;
    const kt_vec3 none = {0.0, 0.0, 0.0}, bar = {1.0, 0.0, 0.0};
    for (int k = 0; k < SIZES; k++) {
        kt_error e = {0};
        const double pi = 3.14159265358979323846, a = 0.3 * sizes[k];
        linkage_begin(&l);
        kt_body *b = linkage_bar(&l, "slide", NULL, none, kt_vec3_scale(sizes[k], bar), a, 0.0);
        b->joint.type = KT_JOINT_PRISMATIC;
        for (int i = 0; i < 2; i++) {
            kt_loop *drive = linkage_close(&l, i ? "second" : "first", KT_LOOP_MOTION, NULL, none, NULL, none);
            drive->joint = "slide";
            drive->function = i ? kt_function_constant(a) : kt_function_sine(a, 1.0, pi / 2.0, 0.0);
        }
        kt_note("%g m", sizes[k]);
        linkage_compile(&l);
        kt_check_equal_int("at the crest", kt_state_assemble(l.model, l.data, 0.0, l.q, l.v, &e), KT_OK);
        kt_check_equal_int("projected", kt_state_project(l.model, l.data, 0.0, l.q, l.v, NULL, &e), KT_OK);
        kt_check_equal_int("next to it", kt_state_project(l.model, l.data, 1e-3, l.q, l.v, NULL, &e),
                           KT_ERROR_CONSTRAINT);
    }
}

/* After 50,000 turns, rounding limits the angle of a crank to 6e-11 rad, and the loop closes to this accuracy. */
KT_TEST(crank_goes_on_after_many_turns) {
    static linkage l;
    const four_bar f = four_bar_default();
    const double turns = 2.0 * 3.14159265358979323846 * 5e4;
    double near = 0.0;
    for (int far = 0; far < 2; far++) {
        linkage_run run;
        linkage_four_bar(&l, &f);
        linkage_build(&l, 0.0);
        l.q[0] += far * turns;
        l.q[1] -= far * turns;
        linkage_run_start(&run, &l, "rk4", 1e-3, 0.0, false, 0.0);
        (void)linkage_run_to(&run, 0.5);
        if (far) /* 500 random roundings of 5.8e-11 in two angles; measured: 4.6e-10 */
            kt_check_near("rocker as without the turns", l.q[2], near, 1e-8);
        near = l.q[2];
    }
}
