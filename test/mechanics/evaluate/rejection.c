/* Inputs that closed mechanisms reject, in every way of reduction, in the plane and in space. They are numbers that are
 * not finite or too large, freedoms without inertia, and states too far from closed. Rejected calls write nothing, and
 * their messages describe the fault.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/linkage.h"

#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

/* The three ways, in the plane first. */
enum { WAYS = 6 };
static kt_model_options way(int k) {
    static const kt_reduction reductions[3] = {KT_REDUCTION_QR, KT_REDUCTION_PARTITION, KT_REDUCTION_SVD};
    kt_model_options options = kt_model_options_default();
    options.reduction = kt_reduction_method_of(reductions[k % 3]);
    options.plan = k < 3 ? KT_PLAN_AUTO : KT_PLAN_SPATIAL;
    return options;
}

static void build_four_bar(linkage *l, int k) {
    const four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
    l->options = way(k);
    linkage_build(l, 0.0);
}

/* ---- calls that must reject -------------------------------------------------------------------------------------- */

enum { MOST = 8 };

typedef struct asked {
    linkage *l;
    double t, q[MOST], v[MOST], tau[MOST];
    const kt_wrench *external;
} asked;

static asked ask(linkage *l) {
    asked s = {.l = l};
    memcpy(s.q, l->q, (size_t)l->nq * sizeof *s.q);
    memcpy(s.v, l->v, (size_t)l->nv * sizeof *s.v);
    return s;
}

/* All numbers still the mark? */
static bool untouched(const double *x, int count) {
    for (int i = 0; i < count; i++)
        if (!(x[i] == 77.0))
            return false;
    return true;
}

static void mark(double *x, int count) {
    for (int i = 0; i < count; i++)
        x[i] = 77.0;
}

static void check_words(const char *call, kt_status status, const kt_error *e, kt_status expected, const char *where,
                        const char *message) {
    kt_check_equal_int(call, status, expected);
    if (where != NULL)
        kt_check_contains("where", e->where, where);
    kt_check_contains("message", e->message, message);
}

/* Accelerations, powers and reactions. */
static void reject_motion(const asked *s, kt_status expected, const char *where, const char *message) {
    const linkage *l = s->l;
    double a[MOST];
    kt_power power = {77.0, 77.0};
    kt_wrench joints[MOST];
    kt_error e = {KT_OK, "", ""};
    mark(a, MOST);
    mark((double *)(void *)joints, 6 * MOST);
    check_words("acceleration",
                kt_acceleration_evaluate(l->model, l->data, s->t, s->q, s->v, s->tau, s->external, a, &e), &e, expected,
                where, message);
    check_words("power", kt_power_evaluate(l->model, l->data, s->t, s->q, s->v, s->tau, s->external, a, &power, &e), &e,
                expected, where, message);
    check_words("reaction",
                kt_reaction_evaluate(l->model, l->data, s->t, s->q, s->v, s->tau, s->external, joints, NULL, &e), &e,
                expected, where, message);
    kt_check_true("nothing is written", untouched(a, MOST) && power.supplied == 77.0 && power.dissipated == 77.0 &&
                                            untouched((double *)(void *)joints, 6));
}

/* Projection, or assembly, of a state. */
typedef kt_status move(const kt_model *model, kt_data *data, double t, double *q, double *v, kt_error *error);

static kt_status project(const kt_model *model, kt_data *data, double t, double *q, double *v, kt_error *error) {
    bool changed = false;
    const kt_status status = kt_state_project(model, data, t, q, v, &changed, error);
    (void)kt_check_true("nothing is changed on failure", status == KT_OK || !changed);
    return status;
}

static void reject_move(const char *call, move *function, const asked *s, kt_status expected, const char *where,
                        const char *message) {
    const linkage *l = s->l;
    asked now = *s;
    kt_error e = {KT_OK, "", ""};
    check_words(call, function(l->model, l->data, s->t, now.q, now.v, &e), &e, expected, where, message);
    kt_check_equal_bits("q", now.q, s->q, (size_t)l->nq);
    kt_check_equal_bits("v", now.v, s->v, (size_t)l->nv);
}

/* Residuals and equations. */
static void reject_equations(const asked *s, kt_status expected, const char *where, const char *message) {
    const linkage *l = s->l;
    kt_residual residual = {77.0, 77.0};
    double drift[6 * LINKAGE_LOOPS];
    kt_error e = {KT_OK, "", ""};
    mark(drift, 6);
    check_words("residual", kt_loop_residual(l->model, l->data, s->t, s->q, s->v, &residual, &e), &e, expected, where,
                message);
    check_words("equations", kt_loop_equations(l->model, l->data, s->t, s->q, s->v, NULL, NULL, NULL, drift, &e), &e,
                expected, where, message);
    kt_check_true("nothing is written", residual.position == 77.0 && residual.velocity == 77.0 && untouched(drift, 6));
}

/* ---- numbers ------------------------------------------------------------------------------------------------------
 */

KT_TEST(numbers_that_are_not_finite_are_named_and_nothing_is_written) {
    for (int k = 0; k < WAYS; k++) {
        static linkage l;
        build_four_bar(&l, k);
        asked s = ask(&l);
        s.q[1] = (double)NAN;
        reject_motion(&s, KT_ERROR_NOT_FINITE, "'coupler'", "position");
        reject_move("project", project, &s, KT_ERROR_NOT_FINITE, "'coupler'", "position");
        reject_move("assemble", kt_state_assemble, &s, KT_ERROR_NOT_FINITE, "'coupler'", "position");
        reject_equations(&s, KT_ERROR_NOT_FINITE, "'coupler'", "position");
        s = ask(&l);
        s.v[2] = HUGE_VAL;
        reject_motion(&s, KT_ERROR_NOT_FINITE, "'rocker'", "velocity");
        reject_move("project", project, &s, KT_ERROR_NOT_FINITE, "'rocker'", "velocity");
        reject_move("assemble", kt_state_assemble, &s, KT_ERROR_NOT_FINITE, "'rocker'", "velocity");
        reject_equations(&s, KT_ERROR_NOT_FINITE, "'rocker'", "velocity");
        s = ask(&l);
        s.tau[0] = -HUGE_VAL;
        reject_motion(&s, KT_ERROR_NOT_FINITE, "'crank'", "force or torque");
    }
}

/* The numbers are finite, but their squares or the results are not. */
KT_TEST(numbers_that_overflow_are_rejected) {
    for (int k = 0; k < WAYS; k++) {
        static linkage l;
        build_four_bar(&l, k);
        asked s = ask(&l);
        s.v[0] = 1e200;
        reject_motion(&s, KT_ERROR_NOT_FINITE, "joint 'crank'",
                      "look for a position, velocity, force or torque that is not finite or is huge");
        s = ask(&l);
        s.v[0] = s.v[1] = s.v[2] = DBL_MAX;
        reject_move("project", project, &s, KT_ERROR_NOT_FINITE, "t = 0 s", "a position or velocity is huge");
        reject_move("assemble", kt_state_assemble, &s, KT_ERROR_NOT_FINITE, NULL,
                    "the initial velocities are too large");
    }
}

/* A bar that a loop holds: nothing moves, but at half a metre the loop would have to hold twice the largest number. */
KT_TEST(reactions_that_overflow_are_rejected) {
    for (int k = 0; k < WAYS; k++) {
        static linkage l;
        kt_wrench joints[MOST], loops[LINKAGE_LOOPS];
        double a = 77.0;
        kt_error e = {KT_OK, "", ""};
        linkage_begin(&l);
        l.options = way(k);
        (void)linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.5, 0.0, 0.0), 0.0, 0.0);
        (void)linkage_close(&l, "bolt", KT_LOOP_REVOLUTE, "bar", kt_vec3_make(0.5, 0.0, 0.0), NULL,
                            kt_vec3_make(0.5, 0.0, 0.0));
        linkage_build(&l, 0.0);
        asked s = ask(&l);
        s.tau[0] = DBL_MAX;
        mark((double *)(void *)joints, 6 * MOST);
        mark((double *)(void *)loops, 6 * LINKAGE_LOOPS);
        kt_check_equal_int("acceleration",
                           kt_acceleration_evaluate(l.model, l.data, s.t, s.q, s.v, s.tau, NULL, &a, &e), KT_OK);
        kt_check_near("it stays", a, 0.0, 1e-9);
        check_words("reaction", kt_reaction_evaluate(l.model, l.data, s.t, s.q, s.v, s.tau, NULL, joints, loops, &e),
                    &e, KT_ERROR_NOT_FINITE, "t = 0 s, loop 'bolt'", "the reaction overflows");
        check_words("in joints", kt_reaction_evaluate(l.model, l.data, s.t, s.q, s.v, s.tau, NULL, joints, NULL, &e),
                    &e, KT_ERROR_NOT_FINITE, "t = 0 s, body 'bar'", "the reaction overflows");
        kt_check_true("nothing is written", untouched((double *)(void *)joints, 6 * MOST) &&
                                                untouched((double *)(void *)loops, 6 * LINKAGE_LOOPS));
    }
}

/* ---- freedoms without inertia ------------------------------------------------------------------------------------ */

static void make_massless(kt_body *body) {
    body->mass = 0.0;
    body->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
}

static const char no_inertia[] =
    "the mechanism has no positive inertia along one of the degrees of freedom that its loops leave: give the "
    "bodies that move there mass or inertia";

/* A four-bar without mass. In the second case a slider carries it. In the third it carries a link without mass that no
 * loop holds. This case is rejected before anything moves. */
KT_TEST(freedoms_without_inertia_are_rejected) {
    for (int k = 0; k < WAYS; k++) {
        static linkage l;
        const four_bar f = four_bar_default();
        linkage_four_bar(&l, &f);
        l.options = way(k);
        for (int i = 0; i < 3; i++)
            make_massless(&l.body[i]);
        linkage_build(&l, 0.0);
        asked s = ask(&l);
        reject_motion(&s, KT_ERROR_SINGULAR, "joint '", no_inertia);
        s.v[0] += 1e-3;
        reject_move("project", project, &s, KT_ERROR_SINGULAR, "t = 0 s", no_inertia);

        linkage_four_bar(&l, &f);
        l.options = way(k);
        make_massless(
            linkage_bar(&l, "pointer", "rocker", kt_vec3_make(0.5, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.3, 0.0));
        kt_error e = {KT_OK, "", ""};
        kt_check_equal_int("pointer", kt_model_compile(&l.description, &l.options, &l.model, &e), KT_ERROR_MODEL);
        kt_check_text("where", e.where, "body 'pointer'");
        kt_check_contains("what is wrong", e.message,
                          "moves nothing that has inertia along one of its degrees of freedom");

        linkage_four_bar(&l, &f);
        l.options = way(k);
        for (int i = 0; i < 3; i++)
            make_massless(&l.body[i]);
        kt_body *sled =
            linkage_bar(&l, "sled", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
        sled->joint.type = KT_JOINT_PRISMATIC;
        sled->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        l.body[0].parent = l.body[2].parent = "sled";
        linkage_build(&l, 0.0);
        s = ask(&l);
        reject_motion(&s, KT_ERROR_SINGULAR, "joint '", no_inertia);
    }
}

KT_TEST(quaternion_that_is_no_rotation_is_rejected) {
    static linkage l;
    linkage_begin(&l);
    kt_body *ball = linkage_bar(&l, "ball", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    ball->joint.type = KT_JOINT_SPHERICAL;
    ball->joint.position[0] = 1.0;
    linkage_close(&l, "close", KT_LOOP_DISTANCE, "ball", kt_vec3_make(1.0, 0.0, 0.0), NULL,
                  kt_vec3_make(1.0, 2.0, 0.0));
    linkage_build(&l, 0.0);
    asked s = ask(&l);
    memset(s.q, 0, sizeof s.q);
    reject_move("project", project, &s, KT_ERROR_ARGUMENT, "'ball'", "its quaternion is zero");
    reject_move("assemble", kt_state_assemble, &s, KT_ERROR_ARGUMENT, "'ball'", "its quaternion is zero");
}

KT_TEST(what_is_not_finite_is_rejected_without_loops) {
    static linkage l;
    linkage_begin(&l);
    (void)linkage_bar(&l, "arm", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    linkage_build(&l, 0.0);
    asked s = ask(&l);
    s.v[0] = (double)NAN;
    reject_move("project", project, &s, KT_ERROR_NOT_FINITE, "'arm'", "velocity");
    s = ask(&l);
    s.q[0] = HUGE_VAL;
    reject_move("project", project, &s, KT_ERROR_NOT_FINITE, "'arm'", "position");
}

/* A rocker so short that it can hardly be reached. From far off, Newton's steps may go past it again and again, while
 * damped ones close it. The message then reports the distance of the two ends at the start, along the coupler or
 * across. */
KT_TEST(state_too_far_from_closed_is_told_apart_from_one_out_of_reach) {
    static linkage l;
    four_bar f = four_bar_default();
    int far = 0;
    f.ground = 1.95;
    f.rocker = 0.02;
    f.coupler = 1.36;
    linkage_four_bar(&l, &f);
    linkage_compile(&l);
    for (int i = 0; i < 200; i++) {
        kt_error e = {KT_OK, "", ""};
        char gap[64];
        asked s = ask(&l);
        for (int k = 0; k < 3; k++)
            s.q[k] = 3.14 * sin(1.0 + 12.9898 * (3 * i + k));
        asked now = s;
        if (kt_state_project(l.model, l.data, 0.0, now.q, now.v, NULL, &e) == KT_OK)
            continue;
        const double turn = s.q[0] + s.q[1], back = s.q[2] - turn;
        const double x = cos(s.q[1]) + f.coupler - f.ground * cos(turn) - f.rocker * cos(back);
        const double y = -sin(s.q[1]) + f.ground * sin(turn) - f.rocker * sin(back);
        snprintf(gap, sizeof gap, "these stay open: 'close' by %.3g m", fmax(fabs(x), fabs(y)));
        reject_move("project", project, &s, KT_ERROR_CONSTRAINT, "t = 0 s",
                    "the loops are too far open to be closed again in one step (smaller steps may help); ");
        kt_check_contains("the gap", e.message, gap);
        (void)kt_fine("assembly goes there", kt_state_assemble(l.model, l.data, 0.0, s.q, s.v, &e), &e);
        far++;
    }
    kt_check_above("states too far off", far, 3.0);
}
