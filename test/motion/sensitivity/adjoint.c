/* Adjoints of steps against the transposed matrices of the same steps, and gradients over many steps against products
 * of these. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "differences.h"
#include "grown.h"
#include "mechanics/constraint/linkage.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static void *take(size_t bytes) { return aligned_alloc(64, (bytes + 63) / 64 * 64); }

/* A'y and B'y of random y. The two round by themselves, by eps times the condition of inertia and loops. Without loops
 * the bound is 1e-10 of the largest term of a number. The largest error over forty seeds was 0.06 of this bound. With
 * loops the bound is 1e-10 of the largest number, and the largest error was 0.64 of it. The error comes from the
 * matrices. They change as much themselves if positions change by 1e-16. */
/* Explicit and implicit methods in turn. */
static const kt_method *any_method(int n) {
    const int at = n % (11 + IMPLICIT_METHODS);
    return at < 11 ? explicit_method(at) : implicit_method(at - 11);
}

/* Leaves the motion of another state in the data, which are scratch. */
static void spoil_data(const kt_model *model, kt_data *data) {
    const int nq = kt_model_nq(model), n = kt_model_nv(model);
    double *x = calloc((size_t)(nq + 3 * n + 1), sizeof *x), *v = x + nq, *a = v + n;
    kt_model_initial(model, x, v);
    for (int i = 0; i < n; i++)
        a[i] = 0.7;
    kt_position_add(model, x, a, x);
    if (kt_acceleration_evaluate(model, data, 0.0, x, v, NULL, NULL, a, NULL) != KT_OK)
        kt_note("there is no acceleration in the other state");
    free(x);
}

static bool compare(const step_case *c, bool closed, kt_random *random, kt_worst *worst, const char *name) {
    const int n = kt_model_nv(c->model), rows = 2 * n;
    const size_t size = kt_step_work_size(c->model, c->step.method);
    double *x = calloc((size_t)(rows * rows + rows * n + 5 * n + 1), sizeof *x), *A = x + 5 * n, *B = A + rows * rows;
    double *y = x, *by = x + rows;
    void *work = take(size);
    kt_error error = {0};
    for (int i = 0; i < rows; i++)
        y[i] = kt_random_normal(random);
    const kt_status status =
        kt_step_derivatives(c->model, c->data, work, size, &c->step, c->q, c->v, NULL, NULL, A, B, &error);
    spoil_data(c->model, c->data);
    const kt_status adjoint =
        kt_step_adjoint(c->model, c->data, work, size, &c->step, c->q, c->v, y, by, by + rows, &error);
    kt_check_equal_int("both take the step or reject it", adjoint, status);
    const double largest = kt_tree_largest(by, 3 * n);
    for (int j = 0; j < 3 * n && status == KT_OK && adjoint == KT_OK; j++) {
        const double *column = j < rows ? A + rows * j : B + rows * (j - rows);
        double sum = 0.0, size_of = 1e-3;
        for (int i = 0; i < rows; i++) {
            sum += column[i] * y[i];
            size_of = fmax(size_of, fabs(column[i] * y[i]));
        }
        kt_worst_near(worst, by[j], sum, closed ? 1e-10 * largest : 1e-10 * size_of, "%s number %d of %d", name, j,
                      3 * n);
    }
    free(work);
    free(x);
    return status == KT_OK && adjoint == KT_OK;
}

KT_TEST(adjoint_of_a_step_applies_the_transposed_matrices) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("A'y and B'y of trees");
    int taken = 0;
    for (int n = 0; n < 44; n++) {
        static grown g;
        const kt_method *method = any_method(n);
        grown_make(&g, n, &random);
        const kt_step step = {.method = method, .t = 0.1, .h = 0.01, .tau = g.state.tau, .external = g.state.external};
        const step_case c = {g.tree.model, g.tree.data, g.state.q, g.state.v, step, 0.0};
        taken += compare(&c, false, &random, &worst, method->name);
    }
    kt_check_equal_int("trees", taken, 44);
}

/* Effects in joints have their derivatives in the sweep that all links share, and not in matrices. */
KT_TEST(adjoint_of_a_step_has_the_effects_in_joints) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("A'y and B'y of springs, dampers and friction in joints");
    kt_body bodies[3];
    kt_effect effects[3];
    const char *const names[] = {"shoulder", "elbow", "slide"};
    const double q[3] = {0.3, -0.5, 0.2}, v[3] = {0.7, -0.4, 0.9}, tau[3] = {0.5, -0.2, 0.3};
    for (int i = 0; i < 3; i++) {
        bodies[i] = kt_body_of(names[i], i ? names[i - 1] : NULL, i < 2 ? KT_JOINT_REVOLUTE : KT_JOINT_PRISMATIC, 1.0);
        bodies[i].com = kt_vec3_make(0.3, 0.1, 0.2);
        bodies[i].inertia = kt_sym3_make(0.1, 0.2, 0.2, 0.0, 0.0, 0.0);
        effects[i] = kt_effect_of(i == 1 ? KT_EFFECT_JOINT_FRICTION : KT_EFFECT_JOINT_SPRING, names[i]);
        effects[i].stiffness = 20.0;
        effects[i].damping = 3.0;
        effects[i].coulomb = 0.4;
        effects[i].viscous = 0.6;
        effects[i].smoothing = 0.5;
    }
    effects[1].stiffness = effects[1].damping = 0.0;
    kt_description d = kt_description_of(bodies, 3, NULL, 0, effects, 3);
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    for (int n = 0; n < 11 + IMPLICIT_METHODS; n++) {
        const kt_step step = {.method = any_method(n), .t = 0.1, .h = 0.02, .tau = tau};
        const step_case c = {model, data, q, v, step, 0.0};
        kt_check_true("taken", compare(&c, false, &random, &worst, step.method->name));
    }
}

KT_TEST(adjoint_of_a_step_goes_back_through_the_projection) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("A'y and B'y of closed mechanisms");
    int taken = 0;
    for (int n = 0; n < 24; n++) {
        static tangle g;
        tangle_plan plan = closed_plan(n, 3);
        plan.tree.with_armature = n % 3 == 1 ? 0.5 : 0.0;
        tangle_grow(&g, &plan, &random);
        const kt_step step = {.method = any_method(n), .t = g.t, .h = 0.02, .tau = g.tau, .external = g.external};
        const step_case c = {g.tree.model, g.tree.data, g.q, g.v, step, 0.0};
        taken += compare(&c, true, &random, &worst, step.method->name);
    }
    kt_check_above("mechanisms", taken, 12.0);
}

/* A skate moves in the plane. Its equation reads poses in space, which the recursions in the plane do not compute. */
KT_TEST(adjoint_of_a_skate_does_not_depend_on_the_data) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("A'y and B'y of a skate");
    kt_description d = kt_description_default();
    const double q[3] = {0.1, -0.2, 0.4}, tau[3] = {1.0, 2.0, -0.5};
    double v[3] = {cos(0.4), sin(0.4), 1.2};
    kt_body skate = kt_body_of("skate", NULL, KT_JOINT_PLANAR, 2.0);
    skate.com = kt_vec3_make(0.3, 0.1, 0.0);
    skate.inertia = kt_sym3_make(0.1, 0.1, 0.2, 0.0, 0.0, 0.0);
    kt_loop edge = kt_loop_of("edge", KT_LOOP_KNIFE_EDGE);
    edge.between[1].body = "skate";
    edge.axis = kt_vec3_make(0.0, 1.0, 0.0);
    d.bodies = &skate;
    d.loops = &edge;
    d.body_count = d.loop_count = 1;
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    kt_check_text("plan", kt_model_plan(model), "planar");
    for (int n = 0; n < 11 + IMPLICIT_METHODS; n++) {
        const kt_step step = {.method = any_method(n), .t = 0.1, .h = 0.02, .tau = tau};
        const step_case c = {model, data, q, v, step, 0.0};
        kt_check_true("taken", compare(&c, true, &random, &worst, step.method->name));
    }
}

/* ---- many steps -------------------------------------------------------------------------------------------------- */

enum { STEPS = 37 };

typedef struct weights {
    int nq, nv;
    double weight[3 * KT_TREE_NV]; /* of the state's tangent coordinates and tau */
} weights;

/* Half the sum of weights times squares of v and tau, at all points, and of plain positions at the last one. */
static int cost_of(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const weights *c = user;
    for (int i = 0; i < c->nv; i++) {
        const double tau = at->tau ? at->tau[i] : 0.0;
        *value += 0.5 * c->weight[i] * at->v[i] * at->v[i] + 0.5 * c->weight[c->nv + i] * tau * tau;
        if (by_state)
            by_state[c->nv + i] = c->weight[i] * at->v[i];
        if (by_tau)
            by_tau[i] = c->weight[c->nv + i] * tau;
    }
    return 0;
}

typedef struct rollout_case {
    const kt_model *model;
    kt_data *data;
    const double *q, *v;
    kt_rollout rollout;
    weights costs;
} rollout_case;

static bool differentiate(const rollout_case *c, int checkpoints, double *value, double *gradient) {
    kt_rollout rollout = c->rollout;
    kt_error error;
    rollout.checkpoints = checkpoints;
    const size_t size = kt_rollout_work_size(c->model, &rollout);
    void *work = take(size);
    weights costs = c->costs;
    const bool fine = kt_fine("gradient",
                              kt_rollout_gradient(c->model, c->data, work, size, &rollout, c->q, c->v, value, gradient,
                                                  gradient + 2 * c->costs.nv, cost_of, &costs, &error),
                              &error);
    free(work);
    return fine;
}

/* Multiplies the matrices of all steps, forwards. The gradient is
 *     y_k = A_k' y_{k+1} + that of the cost */
static void multiply(const rollout_case *c, double *value, double *gradient) {
    const int nq = c->costs.nq, n = c->costs.nv, rows = 2 * n;
    static double q[(STEPS + 1) * KT_TREE_NQ], v[(STEPS + 1) * KT_TREE_NV], by[2 * KT_TREE_NV], at[2 * KT_TREE_NV];
    double *A = malloc(STEPS * (size_t)(rows * 3 * n) * sizeof *A);
    const size_t size = kt_step_work_size(c->model, c->rollout.method);
    void *work = take(size);
    kt_error error;
    weights costs = c->costs;
    memcpy(q, c->q, (size_t)nq * sizeof *q);
    memcpy(v, c->v, (size_t)n * sizeof *v);
    for (int k = 0; k < STEPS; k++) {
        double *A_k = A + (size_t)k * (size_t)(rows * 3 * n);
        const kt_step step = {.method = c->rollout.method,
                              .t = c->rollout.t + k * c->rollout.h,
                              .h = c->rollout.h,
                              .tau = c->rollout.inputs + k * n};
        kt_fine("matrices",
                kt_step_derivatives(c->model, c->data, work, size, &step, q + k * nq, v + k * n, q + (k + 1) * nq,
                                    v + (k + 1) * n, A_k, A_k + rows * rows, &error),
                &error);
    }
    *value = 0.0;
    memset(by, 0, sizeof by);
    for (int k = STEPS; k >= 0; k--) {
        const double *tau = k < STEPS ? c->rollout.inputs + k * n : NULL;
        double own[2 * KT_TREE_NV] = {0.0}, own_tau[KT_TREE_NV] = {0.0}, one = 0.0;
        const kt_cost_point point = {.step = k, .q = q + k * nq, .v = v + k * n, .tau = tau};
        (void)cost_of(&point, &one, own, own_tau, &costs);
        *value += one;
        memcpy(at, by, sizeof at);
        for (int j = 0; j < 3 * n && k < STEPS; j++) {
            const double *column = A + (size_t)k * (size_t)(rows * 3 * n) + rows * j;
            double sum = 0.0;
            for (int i = 0; i < rows; i++)
                sum += column[i] * at[i];
            *(j < rows ? &by[j] : &gradient[rows + k * n + j - rows]) = sum + (j < rows ? 0.0 : own_tau[j - rows]);
        }
        for (int i = 0; i < rows; i++)
            by[i] += own[i];
    }
    memcpy(gradient, by, (size_t)rows * sizeof *by);
    free(work);
    free(A);
}

static void check_rollout(rollout_case *c, kt_random *random, const char *name) {
    const int n = c->costs.nv, count = 2 * n + STEPS * n;
    double *inputs = malloc((size_t)(STEPS * n) * sizeof *inputs), *expected = calloc((size_t)count, sizeof *expected);
    double *observed = calloc((size_t)count, sizeof *observed), *few = calloc((size_t)count, sizeof *few);
    double value[3];
    kt_worst worst = kt_worst_make(name);
    for (int i = 0; i < STEPS * n; i++)
        inputs[i] = kt_random_normal(random);
    for (int i = 0; i < 2 * n; i++)
        c->costs.weight[i] = kt_random_uniform(random, 0.5, 2.0);
    c->rollout.inputs = inputs;
    c->rollout.steps = STEPS;
    multiply(c, &value[0], expected);
    if (differentiate(c, 0, &value[1], observed)) {
        const double largest = kt_tree_largest(expected, count); /* over forty seeds: 0.26 of the bound at most */
        for (int i = 0; i < count; i++)
            kt_worst_near(&worst, observed[i], expected[i], 1e-12 * largest, "number %d", i);
        kt_worst_near(&worst, value[1], value[0], 1e-13 * fabs(value[0]), "value");
        kt_check_worst(&worst);
    }
    static const int checkpoints[] = {1, 2, 3, 5, 8, STEPS - 1};
    for (size_t i = 0; i < sizeof checkpoints / sizeof *checkpoints; i++)
        if (differentiate(c, checkpoints[i], &value[2], few)) {
            kt_check_equal_bits("with fewer checkpoints", few, observed, (size_t)count);
            kt_check_equal_bits("their value", &value[2], &value[1], 1);
        }
    free(few);
    free(observed);
    free(expected);
    free(inputs);
}

KT_TEST(gradient_over_many_steps_is_the_product_of_their_matrices) {
    static const char *const trees[] = {"rk4", "dopri5", "radau5", "rodas5p", "bdf2"};
    static const char *const loops[] = {"rk4", "implicit-euler", "radau5", "rodas5p", "bdf2"};
    kt_random random = kt_random_of_test();
    static grown g;
    for (int n = 4; n < 9; n++) {
        grown_make(&g, n, &random);
        rollout_case c = {.model = g.tree.model,
                          .data = g.tree.data,
                          .q = g.state.q,
                          .v = g.state.v,
                          .rollout = {.method = kt_method_find(trees[n - 4]), .t = 0.1, .h = 0.002},
                          .costs = {.nq = g.tree.nq, .nv = g.tree.nv}};
        check_rollout(&c, &random, "gradient of a tree");
    }
    for (int k = 0; k < 5; k++) {
        static linkage l;
        four_bar f = four_bar_default();
        f.rate = 3.0;
        linkage_four_bar(&l, &f);
        linkage_build(&l, 0.0);
        rollout_case c = {.model = l.model,
                          .data = l.data,
                          .q = l.q,
                          .v = l.v,
                          .rollout = {.method = kt_method_find(loops[k]), .h = 0.01},
                          .costs = {.nq = l.nq, .nv = l.nv}};
        check_rollout(&c, &random, "gradient of a four-bar");
    }
}

static int stop(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    (void)value, (void)by_state, (void)by_tau, (void)user;
    return at->step == 2 ? 7 : 0;
}

KT_TEST(failed_gradient_leaves_outputs_untouched) {
    static linkage l;
    double value = 5.0, start[6] = {6.0}, inputs[3 * 4] = {7.0};
    kt_error error;
    four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    kt_rollout rollout = {.method = kt_method_find("rk4"), .h = 0.01, .steps = 4};
    const size_t size = kt_rollout_work_size(l.model, &rollout);
    void *work = take(size);
    kt_check_equal_int(
        "stopped",
        kt_rollout_gradient(l.model, l.data, work, size, &rollout, l.q, l.v, &value, start, inputs, stop, NULL, &error),
        KT_ERROR_CALLBACK);
    kt_check_contains("its words", error.message, "step 2 returned 7");
    kt_check_equal_int("memory",
                       kt_rollout_gradient(l.model, l.data, work, size - 1, &rollout, l.q, l.v, &value, start, inputs,
                                           stop, NULL, &error),
                       KT_ERROR_MEMORY);
    rollout.steps = 0;
    kt_check_equal_int(
        "no steps",
        kt_rollout_gradient(l.model, l.data, work, size, &rollout, l.q, l.v, &value, start, inputs, stop, NULL, &error),
        KT_ERROR_ARGUMENT);
    rollout.steps = 4;
    rollout.method = kt_method_find("rkc2");
    kt_check_equal_int(
        "stabilised",
        kt_rollout_gradient(l.model, l.data, work, size, &rollout, l.q, l.v, &value, start, inputs, stop, NULL, &error),
        KT_ERROR_ARGUMENT);
    kt_check_true("untouched", value == 5.0 && start[0] == 6.0 && inputs[0] == 7.0);
    free(work);
}

/* A wheel with stops, and with friction that slips. Its loops have no equations while they are open. */
KT_TEST(work_of_motions_is_scratch_while_loops_have_no_equations) {
    kt_effect effects[2];
    kt_error error;
    double A[2][4], B[2][2];
    kt_body wheel = kt_body_of("wheel", NULL, KT_JOINT_REVOLUTE, 0.0);
    wheel.joint.velocity[0] = -1.0;
    wheel.inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
    effects[0] = kt_effect_of(KT_EFFECT_JOINT_LIMIT, NULL);
    effects[0].lower = -1.0;
    effects[0].upper = 1.0;
    effects[0].restitution = 0.5;
    effects[1] = kt_effect_of(KT_EFFECT_JOINT_FRICTION, NULL);
    effects[1].coulomb = 0.5;
    effects[1].stick = true;
    effects[0].joint = effects[1].joint = "wheel";
    kt_description d = kt_description_of(&wheel, 1, NULL, 0, effects, 2);
    kt_model *model = kt_test_model(&d, NULL);
    for (int i = 0; i < 2; i++) {
        kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
        const size_t size = kt_motion_work_size(simulation);
        double *work = aligned_alloc(KT_ALIGNMENT, (size + KT_ALIGNMENT - 1) / KT_ALIGNMENT * KT_ALIGNMENT);
        kt_need(kt_check_true("memory", work != NULL));
        for (size_t k = 0; k < size / sizeof *work; k++)
            work[k] = 1e3 * i;
        (void)kt_fine("motion", kt_motion_derivatives(simulation, work, size, 0.5, A[i], B[i], &error), &error);
        free(work);
    }
    kt_check_equal_bits("A", A[1], A[0], 4);
    kt_check_equal_bits("B", B[1], B[0], 2);
    kt_check_near("angle by angle", A[1][0], 1.0, 1e-12);
}
