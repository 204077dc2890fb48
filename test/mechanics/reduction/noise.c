/* Rounding errors are taken neither for an equation nor for a speed. The test has the thresholds of rank, closure and
 * singular positions, at literal values on either side.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "assembly/open_loops.h"
#include "kinetree/simulation.h"
#include "kinetree/study.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- equations of rounding alone --------------------------------------------------------------------------------- */

/* The support of a body that a rope pulls at a point on the body's own axis. */
typedef enum stand { ALONE, ON_ANOTHER, GEARED, STANDS } stand;

static const char *const stand_names[STANDS] = {"alone", "on a body that is free", "geared to another"};

/* Ties a rope to the arm's axis, up to a rounding. This point is at rest relative to the body that carries the arm. All
 * lengths are multiplied by `size`, and the rope's length grows by `rate`. In space the axis is oblique. */
static void string_up(linkage *l, stand how, bool oblique, double size, double rate) {
    static double length[2];
    static kt_term term[2];
    const kt_vec3 none = {0.0, 0.0, 0.0}, bar = {size, 0.0, 0.0}, far = {2.0 * size, 0.3 * size, 0.0};
    const kt_vec3 at = {0.3 * size, -0.2 * size, oblique ? 0.1 * size : 0.0};
    const kt_vec3 end = {4e-17 * size, 0.0, oblique ? 0.7 * size : 0.0};
    const char *base = NULL;
    linkage_begin(l);
    if (how == ON_ANOTHER)
        base = linkage_bar(l, "base", NULL, none, bar, 0.4, 0.0)->name;
    kt_body *arm = linkage_bar(l, "arm", base, at, bar, 0.7, 0.0);
    if (oblique)
        arm->joint.rotation = kt_rotation_rpy(0.3, -0.7, 1.1);
    const kt_vec3 turned = kt_mat3_apply(kt_mat3_from_rpy(kt_vec3_make(0.3, -0.7, 1.1)), end);
    const kt_vec3 point = kt_vec3_add(at, oblique ? turned : end);
    length[0] = kt_vec3_norm(kt_vec3_sub(far, point));
    length[1] = rate;
    linkage_close(l, "rope", KT_LOOP_DISTANCE, "arm", end, base, far)->function = kt_function_polynomial(length, 2);
    if (how != GEARED)
        return;
    linkage_bar(l, "other", NULL, far, bar, 0.35, 0.0);
    term[0] = (kt_term){.joint = "arm", .coefficient = 1.0};
    term[1] = (kt_term){.joint = "other", .coefficient = -2.0};
    kt_loop *gears = linkage_close(l, "gears", KT_LOOP_COUPLING, NULL, none, NULL, none);
    gears->terms = term;
    gears->term_count = 2;
}

static void check_rejection(const linkage *l, const char *call, kt_status status, const kt_error *e, double rate,
                            const double *q, const double *v) {
    char gap[64];
    (void)snprintf(gap, sizeof gap, "'rope' by %.3g", rate);
    kt_check_equal_int(call, status, KT_ERROR_CONSTRAINT);
    kt_check_contains(call, e->message, gap);
    kt_check_equal_bits("positions", q, l->q, (size_t)l->nq);
    kt_check_equal_bits("velocities", v, l->v, (size_t)l->nv);
}

/* A rope that requires no motion leaves its bodies to move as they do without it. */
static void check_motion(linkage *l, double rate) {
    double with[LINKAGE_NQ], without[LINKAGE_NQ], q[LINKAGE_NQ], v[LINKAGE_NQ];
    kt_error e = {0};
    kt_check_equal_int("accelerations",
                       kt_acceleration_evaluate(l->model, l->data, 0.0, l->q, l->v, NULL, NULL, with, &e), KT_OK);
    memcpy(q, l->q, sizeof q);
    memcpy(v, l->v, sizeof v);
    check_rejection(l, "assembly", kt_state_assemble(l->model, l->data, 0.0, q, v, &e), &e, rate, q, v);
    check_rejection(l, "projection", kt_state_project(l->model, l->data, 0.0, q, v, NULL, &e), &e, rate, q, v);
    l->description.loops++; /* the rope is the first */
    l->description.loop_count--;
    linkage_compile(l);
    kt_check_equal_int("without it",
                       kt_acceleration_evaluate(l->model, l->data, 0.0, l->q, l->v, NULL, NULL, without, &e), KT_OK);
    KT_WORST a = kt_worst_make("accelerations as without the rope");
    for (int i = 0; i < l->nv; i++)
        kt_worst_near(&a, with[i], without[i], 64.0 * DBL_EPSILON * fabs(without[i]), "%d", i);
}

KT_TEST(equations_of_rounding_alone_are_contradicted_and_not_solved) {
    static const kt_reduction ways[] = {KT_REDUCTION_QR, KT_REDUCTION_SVD, KT_REDUCTION_PARTITION};
    static const double sizes[] = {1e-6, 1.0, 1e6};
    static linkage l;
    for (int how = 0; how < STANDS; how++)
        for (int way = 0; way < 3; way++)
            for (int k = 0; k < 6; k++) {
                const double size = sizes[k % 3], rate = 0.1 * size;
                string_up(&l, (stand)how, k < 3, size, rate);
                l.options.reduction = kt_reduction_method_of(ways[way]);
                kt_note("%s, %s, %s, lengths of %g m", stand_names[how], kt_reduction_name(ways[way]),
                        k < 3 ? "in space" : "in a plane", size);
                linkage_compile(&l);
                kt_check_equal_int("rank", kt_model_mobility(l.model).rank, how == GEARED ? 1 : 0);
                check_motion(&l, rate);
            }
}

/* Nothing pulls at the rope until 0.2 s, and then nothing can follow it. */
KT_TEST(equation_that_time_moves_later_is_not_void) {
    static linkage l;
    for (int how = 0; how < STANDS; how++) {
        kt_error e = {0};
        string_up(&l, (stand)how, true, 1.0, 0.0);
        const double length = l.loop[0].function.numbers[0];
        l.loop[0].function = kt_function_ramp(length, length + 0.5, 0.2, 0.6);
        linkage_build(&l, 0.0);
        kt_check_equal_int("at 0.1 s", kt_state_project(l.model, l.data, 0.1, l.q, l.v, NULL, &e), KT_OK);
        kt_check_equal_int("at 0.4 s", kt_state_project(l.model, l.data, 0.4, l.q, l.v, NULL, &e), KT_ERROR_CONSTRAINT);
        kt_check_contains("the loop", e.message, "'rope' by 0.25");
    }
}

/* The rope's length is wrong, and nothing can change it. */
KT_TEST(assembly_tells_a_gap_that_rounding_alone_could_close) {
    static linkage l;
    for (int how = 0; how < STANDS; how++) {
        double q[LINKAGE_NQ], v[LINKAGE_NQ];
        kt_error e = {0};
        string_up(&l, (stand)how, true, 1.0, 0.0);
        l.loop[0].function = kt_function_constant(5.0);
        linkage_compile(&l);
        memcpy(q, l.q, sizeof q);
        memcpy(v, l.v, sizeof v);
        kt_check_equal_int(stand_names[how], kt_state_assemble(l.model, l.data, 0.0, q, v, &e), KT_ERROR_CONSTRAINT);
        kt_check_contains("the loop", e.message, "'rope' by ");
    }
}

/* ---- speeds of rounding alone ------------------------------------------------------------------------------------ */

/* A four-bar whose crank is held by a motion, with or without a pendulum on its coupler. Each projection leaves 1e-16
 * of the velocity that the last one left. */
KT_TEST(mechanisms_at_rest_are_projected_for_ever) {
    static const kt_reduction ways[] = {KT_REDUCTION_QR, KT_REDUCTION_SVD, KT_REDUCTION_PARTITION};
    static linkage l;
    const kt_vec3 none = {0.0, 0.0, 0.0};
    kt_random random = kt_random_of_test();
    for (int k = 0; k < 6; k++) {
        four_bar f = four_bar_default();
        int failed = 0;
        f.rate = 0.0;
        linkage_four_bar(&l, &f);
        l.options.reduction = kt_reduction_method_of(ways[k % 3]);
        if (k >= 3)
            linkage_bar(&l, "bob", "coupler", none, kt_vec3_make(0.0, -0.5, 0.0), 0.2, 0.0);
        kt_loop *drive = linkage_close(&l, "drive", KT_LOOP_MOTION, NULL, none, NULL, none);
        drive->joint = "crank";
        drive->function = kt_function_constant(f.angle[0]);
        linkage_build(&l, 0.0);
        for (int start = 0; start < 100; start++) {
            kt_status status = KT_OK;
            for (int i = 0; i < l.nv; i++)
                l.v[i] = kt_random_uniform(&random, -1.0, 1.0);
            for (int i = 0; i < 60 && status == KT_OK; i++)
                status = kt_state_project(l.model, l.data, 0.0, l.q, l.v, NULL, NULL);
            failed += status != KT_OK || fabs(l.v[0]) > 1e-100;
        }
        kt_note("%s%s", kt_reduction_name(ways[k % 3]), k < 3 ? "" : ", with a pendulum");
        kt_check_equal_int("starts that came to no rest, of 100", failed, 0);
    }
}

/* ---- thresholds -------------------------------------------------------------------------------------------------- */

/* One joint, held at 0 by two motions that are `apart`, and nothing is taken for rounded data. */
static void hold_twice(linkage *l, double apart) {
    const kt_vec3 none = {0.0, 0.0, 0.0};
    linkage_begin(l);
    l->description.tolerance = 0.0;
    linkage_bar(l, "arm", NULL, none, kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    for (int i = 0; i < 2; i++) {
        kt_loop *hold = linkage_close(l, i ? "second" : "first", KT_LOOP_MOTION, NULL, none, NULL, none);
        hold->joint = "arm";
        hold->function = kt_function_constant(i * apart);
    }
    linkage_compile(l);
}

/* If no loop has a gap to report, the message names the loops. */
KT_TEST(an_error_about_loops_always_names_one) {
    static linkage l;
    static const kt_open_equations violated[] = {KT_OPEN_POSITIONS, KT_OPEN_VELOCITIES};
    for (int k = 0; k < 2; k++) {
        hold_twice(&l, 0.0);
        const double q = 0.0, v = 0.0;
        kt_violation violation;
        kt_error e = {0};
        kt_check_true("filled", l.model->group_kernels->residuals(l.model, l.data, 0.0, &q, &v, NULL, &violation));
        kt_check_equal_int("error", kt_open_loops_error(l.model, l.data, 0.0, "open are", violated[k], &e),
                           KT_ERROR_CONSTRAINT);
        kt_check_contains("names", e.message, "open are: 'first' by 0 (");
    }
}

/* The rope pulls across a lever of so much of the mechanism's length, or where it is void of nothing: 1e-12 is between.
 */
KT_TEST(equations_are_void_below_a_trillionth_of_what_they_could_be) {
    static linkage l;
    static const double levers[] = {0.8e-12, 1.3e-12};
    const kt_vec3 none = {0.0, 0.0, 0.0}, along = {1.0, 0.0, 0.0}, across = {0.0, 2.0, 0.0};
    for (int k = 0; k < 2; k++) {
        linkage_begin(&l);
        linkage_bar(&l, "arm", NULL, none, along, 0.0, 0.0);
        kt_loop *rope = linkage_close(&l, "rope", KT_LOOP_DISTANCE, "arm", none, NULL, across);
        linkage_compile(&l);
        rope->between[0].at.x = levers[k] * l.model->length;
        linkage_compile(&l);
        kt_check_equal_int("equations that are not void", l.model->group[0].count[KT_ROWS_ALL], k);
    }
}

/* A residual of 2^-52 of a radian is closed, one more bit is not. */
KT_TEST(positions_closed_to_a_rounding_keep_their_bits) {
    static linkage l;
    static const double open[] = {2.2e-16, 2.3e-16};
    hold_twice(&l, 0.0);
    for (int k = 0; k < 2; k++) {
        double q = open[k], v = 0.0;
        bool changed = false;
        kt_error e = {0};
        kt_check_equal_int("projected", kt_state_project(l.model, l.data, 0.0, &q, &v, &changed, &e), KT_OK);
        kt_check_equal_int("changed", changed, k);
        kt_check_near("position", q, k ? 0.0 : 2.2e-16, 0.0);
    }
}

/* No position closes the gap. It counts as closed up to 1e-12 after a step, where the first motion is met. In assembly
 * the two motions share it, and it counts as closed up to 1e-9. */
KT_TEST(contradictions_are_told_from_their_bounds_on) {
    static linkage l;
    static const double apart[] = {0.9e-12, 1.1e-12, 1.9e-9, 2.1e-9};
    for (int k = 0; k < 4; k++) {
        hold_twice(&l, apart[k]);
        double q = 0.0, v = 0.0;
        kt_error e = {0};
        kt_note("%g rad apart", apart[k]);
        kt_check_equal_int("projection", kt_state_project(l.model, l.data, 0.0, &q, &v, NULL, &e),
                           k < 1 ? KT_OK : KT_ERROR_CONSTRAINT);
        q = v = 0.0;
        kt_check_equal_int("assembly", kt_state_assemble(l.model, l.data, 0.0, &q, &v, &e),
                           k < 3 ? KT_OK : KT_ERROR_CONSTRAINT);
    }
}

/* A direction is near to being lost below a hundredth of its usual size. */
KT_TEST(position_is_near_singular_below_a_hundredth_of_the_usual) {
    static linkage l;
    static const double usual[] = {99.0, 101.0};
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    const kt_reduction_kernels *kernels = l.model->group_kernels;
    kt_violation violation;
    kt_check_true("filled", kernels->residuals(l.model, l.data, 0.0, l.q, l.v, NULL, &violation));
    for (int k = 0; k < 2; k++) {
        (void)kernels->factor(l.model, l.data, KT_ROWS_ALL, false);
        l.model->group[0].usual[KT_ROWS_ALL] = usual[k] * l.data->last[0];
        (void)kernels->factor(l.model, l.data, KT_ROWS_ALL, false);
        kt_check_equal_int("near", l.data->near[0], k);
        kt_check_equal_int("rank", l.data->rank[0], 2);
        (void)kernels->factor(l.model, l.data, KT_ROWS_ALL, true);
        kt_check_equal_int("rank that counts there", l.data->rank[0], 2 - k);
    }
}

/* |p|^2 within four roundings of one is as near as scaling would bring it: those bits stay. */
KT_TEST(quaternions_within_four_roundings_keep_their_bits) {
    static linkage l;
    linkage_begin(&l);
    linkage_bar(&l, "ball", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0)->joint.type =
        KT_JOINT_SPHERICAL;
    l.body[0].joint.position[0] = 1.0;
    l.body[0].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    linkage_compile(&l);
    const double w = 1.0 + 2.0 * DBL_EPSILON, rounding = sqrt(DBL_EPSILON); /* |p|^2 - 1: 4 and 5 eps */
    const double given[2][4] = {{w, 0.0, 0.0, 0.0}, {w, rounding, 0.0, 0.0}};
    for (int k = 0; k < 2; k++) {
        double q[4], v[3] = {0.0, 0.0, 0.0};
        bool changed = false;
        kt_error e = {0};
        memcpy(q, given[k], sizeof q);
        kt_check_equal_int("projected", kt_state_project(l.model, l.data, 0.0, q, v, &changed, &e), KT_OK);
        kt_check_equal_int("changed", changed, k);
        if (k == 0)
            kt_check_equal_bits("quaternion", q, given[k], 4);
        else
            kt_check_near("w", q[0], 1.0, 0.0);
    }
}
