/* Queries of kinematics return the state of the last kt_kinematics_update. Later computations with the same data do not
 * change it. The test makes every public call that takes data before every query, at the same state and at another. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "kinetree/effect.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = KT_TREE_NV * KT_TREE_NV };

/* ---- queries ----------------------------------------------------------------------------------------------------- */

/* The results of all queries. */
typedef struct answers {
    kt_pose pose[KT_TREE_SLOTS];
    kt_twist twist[KT_TREE_SLOTS], change[KT_TREE_SLOTS];
    kt_vec3 point[KT_TREE_SLOTS][3];
    double jacobian[KT_TREE_SLOTS][6 * KT_TREE_NV];
    double kinetic, potential, mass;
    kt_wrench momentum, reaction[KT_TREE_SLOTS];
    kt_vec3 center;
} answers;

static void ask(const tangle *g, answers *x) {
    const kt_model *m = g->tree.model;
    kt_data *d = g->tree.data;
    const kt_vec3 at = kt_vec3_make(0.3, -0.2, 0.5);
    memset(x, 0, sizeof *x);
    for (int b = 0; b < g->tree.count; b++) {
        x->pose[b] = kt_body_pose(m, d, b);
        x->twist[b] = kt_body_twist(m, d, b);
        x->change[b] = kt_body_acceleration(m, d, b);
        x->point[b][0] = kt_point_position(m, d, b, at);
        x->point[b][1] = kt_point_velocity(m, d, b, at);
        x->point[b][2] = kt_point_acceleration(m, d, b, at);
        kt_point_jacobian(m, d, b, at, x->jacobian[b]);
    }
    x->kinetic = kt_kinetic_energy(m, d);
    x->potential = kt_potential_energy(m, d);
    x->mass = kt_mass_center(m, d, &x->center);
    x->momentum = kt_momentum(m, d);
    kt_joint_reactions(m, d, g->external, x->reaction);
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

/* The inputs of a call; its results are of no interest here. */
typedef struct given {
    const tangle *g;
    double q[KT_TREE_NQ], v[KT_TREE_NV];
} given;

static double matrix[4][MOST];
static double rows[TANGLE_ROWS * KT_TREE_NV], residual[TANGLE_ROWS], rate[TANGLE_ROWS], drift[TANGLE_ROWS];
static double out[KT_TREE_NV];
static kt_wrench joints[KT_TREE_SLOTS], loops[TANGLE_LOOPS];

#define OF(x) (x)->g->tree.model, (x)->g->tree.data
#define ACTING(x) (x)->g->tau, (x)->g->external

static kt_status forward(const given *x, kt_error *e) {
    return kt_dynamics_forward(OF(x), x->q, x->v, ACTING(x), out, e);
}

static kt_status inverse(const given *x, kt_error *e) {
    return kt_dynamics_inverse(OF(x), x->q, x->v, ACTING(x), out, e);
}

static kt_status mass(const given *x, kt_error *e) { return kt_dynamics_mass(OF(x), x->q, matrix[0], e); }

static kt_status derive(const given *x, bool inverse_too, kt_error *e) {
    const size_t size = kt_dynamics_work_size(x->g->tree.model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    const kt_status status =
        inverse_too ? kt_dynamics_inverse_derivatives(OF(x), work, size, x->q, x->v, ACTING(x), matrix[0], matrix[1], e)
                    : kt_dynamics_forward_derivatives(OF(x), work, size, x->q, x->v, ACTING(x), matrix[0], matrix[1],
                                                      matrix[2], e);
    free(work);
    return status;
}

static kt_status forward_derivatives(const given *x, kt_error *e) { return derive(x, false, e); }
static kt_status inverse_derivatives(const given *x, kt_error *e) { return derive(x, true, e); }

static kt_status accelerate(const given *x, kt_error *e) {
    return kt_acceleration_evaluate(OF(x), x->g->t, x->q, x->v, ACTING(x), out, e);
}

static kt_status acceleration_derivatives(const given *x, kt_error *e) {
    const size_t size = kt_acceleration_work_size(x->g->tree.model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    const kt_status status = kt_acceleration_derivatives(OF(x), work, size, x->g->t, x->q, x->v, ACTING(x), matrix[0],
                                                         matrix[1], matrix[2], e);
    free(work);
    return status;
}

static kt_status stiffness(const given *x, kt_error *e) {
    const size_t size = kt_stiffness_work_size(x->g->tree.model);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    const kt_status status = kt_stiffness_evaluate(OF(x), work, size, x->g->t, x->q, x->v, ACTING(x), NULL, matrix[0],
                                                   matrix[1], matrix[2], matrix[3], e);
    free(work);
    return status;
}

static kt_status power(const given *x, kt_error *e) {
    kt_power sum;
    return kt_power_evaluate(OF(x), x->g->t, x->q, x->v, ACTING(x), out, &sum, e);
}

static kt_status measure(const given *x, kt_error *e) {
    kt_residual open;
    return kt_loop_residual(OF(x), x->g->t, x->q, x->v, &open, e);
}

static kt_status project(const given *x, kt_error *e) {
    given copy = *x;
    return kt_state_project(OF(x), x->g->t, copy.q, copy.v, NULL, e);
}

static kt_status assemble(const given *x, kt_error *e) {
    given copy = *x;
    return kt_state_assemble(OF(x), x->g->t, copy.q, copy.v, e);
}

static kt_status equations(const given *x, kt_error *e) {
    return kt_loop_equations(OF(x), x->g->t, x->q, x->v, rows, residual, rate, drift, e);
}

static kt_status react(const given *x, kt_error *e) {
    return kt_reaction_evaluate(OF(x), x->g->t, x->q, x->v, ACTING(x), joints, loops, e);
}

static kt_status store(const given *x, kt_error *e) {
    (void)e;
    (void)kt_effect_energy(OF(x), x->g->t, x->q, x->v);
    return KT_OK;
}

static kt_status rejected_update(const given *x, kt_error *e) {
    given broken = *x;
    broken.v[x->g->tree.nv - 1] = (double)NAN;
    return kt_kinematics_update(OF(x), broken.q, broken.v, NULL, e) == KT_ERROR_NOT_FINITE ? KT_OK : KT_ERROR_ARGUMENT;
}

/* Finite numbers that overflow on the way; KT_ERROR_UNSUPPORTED where all joints slide, and they do not. */
static kt_status overflowing_update(const given *x, kt_error *e) {
    given fast = *x;
    for (int i = 0; i < x->g->tree.nv; i++)
        fast.v[i] = 1e200;
    return kt_kinematics_update(OF(x), fast.q, fast.v, NULL, e) == KT_ERROR_NOT_FINITE ? KT_OK : KT_ERROR_UNSUPPORTED;
}

static const struct {
    const char *name;
    kt_status (*call)(const given *, kt_error *);
} calls[] = {
    {"kt_dynamics_forward", forward},
    {"kt_dynamics_inverse", inverse},
    {"kt_dynamics_mass", mass},
    {"kt_dynamics_forward_derivatives", forward_derivatives},
    {"kt_dynamics_inverse_derivatives", inverse_derivatives},
    {"kt_acceleration_evaluate", accelerate},
    {"kt_acceleration_derivatives", acceleration_derivatives},
    {"kt_stiffness_evaluate", stiffness},
    {"kt_power_evaluate", power},
    {"kt_loop_residual", measure},
    {"kt_state_project", project},
    {"kt_state_assemble", assemble},
    {"kt_loop_equations", equations},
    {"kt_reaction_evaluate", react},
    {"kt_effect_energy", store},
    {"kt_kinematics_update with a NaN", rejected_update},
    {"kt_kinematics_update that overflows", overflowing_update},
};
enum { CALLS = sizeof calls / sizeof calls[0] };

/* ---- every pair -------------------------------------------------------------------------------------------------- */

/* Kinematics with accelerations at g's state; then a call at a state that is `off` from it; then all queries. */
static bool stays(const tangle *g, int k, const double *a, double off, const answers *fresh, bool *done) {
    static answers later;
    static given x;
    double step[KT_TREE_NV];
    kt_error e = {0};
    for (int i = 0; i < g->tree.nv; i++)
        step[i] = off * sin(1.0 + i);
    x.g = g;
    kt_position_add(g->tree.model, g->q, step, x.q);
    for (int i = 0; i < g->tree.nv; i++)
        x.v[i] = g->v[i] + step[i];
    kt_need_fine("update", kt_kinematics_update(g->tree.model, g->tree.data, g->q, g->v, a, &e), &e);
    const kt_status status = calls[k].call(&x, &e);
    *done = status == KT_OK;
    ask(g, &later);
    return status == KT_ERROR_UNSUPPORTED || memcmp(fresh, &later, sizeof later) == 0;
}

typedef struct tally {
    int pairs, changed, done[CALLS];
} tally;

static void try_all(const tangle *g, tally *sum) {
    static answers fresh;
    double a[KT_TREE_NV];
    kt_error e = {0};
    kt_need_fine("acceleration",
                 kt_acceleration_evaluate(g->tree.model, g->tree.data, g->t, g->q, g->v, g->tau, g->external, a, &e),
                 &e);
    kt_need_fine("update", kt_kinematics_update(g->tree.model, g->tree.data, g->q, g->v, a, &e), &e);
    ask(g, &fresh);
    for (int k = 0; k < CALLS; k++)
        for (int near = 0; near < 2; near++) {
            bool done = false;
            const bool same = stays(g, k, a, near ? 0.0 : 0.1, &fresh, &done);
            sum->pairs++;
            sum->changed += !same;
            sum->done[k] += done;
            if (!same)
                kt_note("after %s at %s state the queries answer otherwise (%s)", calls[k].name,
                        near ? "the same" : "another", kt_model_plan(g->tree.model));
        }
}

/* The same mechanism with effects upon it. */
static void burden(tangle *g, kt_effect effects[KT_TREE_BURDENS]) {
    kt_tree_burden(effects);
    g->tree.description.effects = effects;
    g->tree.description.effect_count = KT_TREE_BURDENS;
    kt_tree_compile(&g->tree, NULL);
}

/* Spatial, planar and mixed; without loops and with; without effects and with. */
static tangle_plan draw_plan(int n) {
    tangle_plan plan = n % 3 == 0 ? tangle_plan_default() : tangle_plan_planar();
    plan.tree.bodies = 8;
    if (n % 3 == 2) {
        plan.tree.planar = 2;
        plan.tree.from_world = 0.4;
        plan.tree.one_plane = false;
    }
    plan.loops = n / 3 % 3;
    return plan;
}

KT_TEST(queries_answer_for_the_last_update_whatever_was_computed_since) {
    enum { MECHANISMS = 36 };
    kt_random random = kt_random_of_test();
    static tangle g;
    kt_effect effects[KT_TREE_BURDENS];
    tally sum = {0};
    int plans[3] = {0};
    for (int n = 0; n < MECHANISMS; n++) {
        const tangle_plan plan = draw_plan(n);
        tangle_grow(&g, &plan, &random);
        if (n / 9 % 2)
            burden(&g, effects);
        const char *name = kt_model_plan(g.tree.model);
        plans[strcmp(name, "spatial") == 0 ? 0 : strcmp(name, "planar") == 0 ? 1 : 2]++;
        try_all(&g, &sum);
    }
    kt_check_equal_int("pairs that changed an answer", sum.changed, 0);
    kt_note("%d spatial, %d planar, %d mixed mechanisms, %d pairs of calls", plans[0], plans[1], plans[2], sum.pairs);
    for (int k = 0; k < 3; k++)
        kt_check_above("mechanisms of a plan", plans[k], 3);
    for (int k = 0; k < CALLS; k++)
        kt_check_above(calls[k].name, sum.done[k], MECHANISMS); /* of twice as many: some states cannot be closed */
}
