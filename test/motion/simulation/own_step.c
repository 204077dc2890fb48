/* Derivatives of steps with auxiliary states. The oracles are the step of a simulation, and differences of the step for
 * A, B and C. Gradients run over many steps, through a loop, quaternions and markers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parsed.h"

#include "kinetree/batch.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A four-bar and a free ball; states read both, and act on both. */
#define BODIES                                                                                                         \
    "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"                                                                   \
    "  - {name: crank, joint: {type: revolute, axis: z, position: 60 deg, velocity: 2}, mass: 1,\n"                    \
    "     shape: {type: rod, to: [1, 0, 0]}}\n"                                                                        \
    "  - {name: rod, parent: crank, joint: {type: revolute, axis: z, at: [1, 0, 0], position: -50 deg}, mass: 2,\n"    \
    "     shape: {type: rod, to: [2, 0, 0]}, markers: {tip: [2, 0, 0], mid: [1, 0.3, 0]}}\n"                           \
    "  - {name: rocker, joint: {type: revolute, axis: z, at: [2.5, 0, 0], position: 80 deg}, mass: 1,\n"               \
    "     shape: {type: rod, to: [1.5, 0, 0]}, markers: {tip: [1.5, 0, 0]}}\n"                                         \
    "  - {name: ball, joint: {type: free, position: {position: [0, 1, 1]}, velocity: {linear: [1, 2, 3], angular: "    \
    "[1, -2, 3]}},\n"                                                                                                  \
    "     mass: 1, shape: {type: box, size: [0.3, 0.2, 0.1]}, markers: {eye: [0.1, 0.2, 0]}}\n"
#define LOOP "loops:\n  - {name: close, type: revolute, between: [rod.tip, rocker.tip]}\n"
#define STATES                                                                                                         \
    "initial: {hold: [crank]}\n"                                                                                       \
    "states:\n"                                                                                                        \
    "  lag: {initial: 0.5, rate: \"3*(marker.rod.mid.y - lag)\"}\n"                                                    \
    "  seen: {initial: -0.2, rate: \"marker.ball.eye.vx*lag - seen + sin(t)\"}\n"                                      \
    "effects:\n"                                                                                                       \
    "  - {name: pull, type: joint_spring, joint: crank, stiffness: 5}\n"                                               \
    "  - {type: expression, joint: crank, force: \"-4*lag - 0.3*seen*velocity.crank\"}\n"                              \
    "  - {type: expression, at: ball.eye, force: [\"seen\", \"-lag*lag\", 0], frame: body}\n"
#define MACHINE BODIES LOOP STATES

enum { NQ = 10, NV = 9, COUNT = 2, ALL = 2 * NV + COUNT };

typedef struct machine {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    void *work;
    size_t size;
    kt_step step;
    double q[NQ], v[NV], x[COUNT], tau[NV];
    bool stops; /* its cost, at step 2 */
} machine;

static void make_of(machine *m, const char *text, const char *method) {
    kt_error error = {0};
    memset(m, 0, sizeof *m);
    kt_parsed_scene(text, &m->scene);
    m->model = kt_scene_compile(&m->scene.description);
    m->data = kt_test_data(m->model);
    kt_model_initial(m->model, m->q, m->v);
    m->step = (kt_step){.method = kt_method_find(method), .t = 0.3, .h = 0.02, .tau = m->tau};
    m->size = kt_step_work_size(m->model, m->step.method);
    m->work = aligned_alloc(KT_ALIGNMENT, m->size);
    memset(m->work, 0xFF, m->size);
    for (int i = 0; i < NV; i++)
        m->tau[i] = 0.1 * i;
    kt_auxiliary_states_initial(m->model, m->x);
    kt_need_fine("closed", kt_state_assemble(m->model, m->data, 0.3, m->q, m->v, &error), &error);
}

static void make(machine *m, const char *method) { make_of(m, MACHINE, method); }

static void end(machine *m) { free(m->work); }

static const char *const methods[] = {"rk4",    "dopri5", "heun",   "implicit-euler", "crank-nicolson",
                                      "radau5", "bdf2",   "rodas5p"};
enum { METHODS = sizeof methods / sizeof *methods, EXPLICIT = 3 };

KT_TEST(step_is_that_of_a_simulation) {
    for (int k = 0; k < METHODS; k++) {
        static machine m;
        kt_error error;
        double q[NQ], v[NV];
        make(&m, methods[k]);
        kt_run run = kt_run_default();
        run.integrator = methods[k];
        run.step = m.step.h;
        kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
        (void)kt_fine("set", kt_simulation_set_state(s, m.step.t, m.q, m.v, &error), &error);
        (void)kt_fine("torque", kt_simulation_set_torque(s, m.tau, &error), &error);
        memcpy(m.q, kt_simulation_positions(s), sizeof m.q);
        memcpy(m.v, kt_simulation_velocities(s), sizeof m.v);
        kt_test_advance(s, m.step.t + m.step.h);
        memcpy(kt_auxiliary_states(m.model, m.data), m.x, sizeof m.x);
        (void)kt_fine("step", kt_step_evaluate(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, &error),
                      &error);
        kt_note("%s", methods[k]);
        const double *x = kt_auxiliary_states(m.model, m.data);
        if (k < EXPLICIT) {
            kt_check_equal_bits("positions", q, kt_simulation_positions(s), NQ);
            kt_check_equal_bits("velocities", v, kt_simulation_velocities(s), NV);
            kt_check_equal_bits("auxiliary states", x, kt_simulation_auxiliary_states(s), COUNT);
        } else { /* iterated otherwise, to the rounding of either */
            kt_worst worst = {.what = "difference"};
            for (int i = 0; i < NQ; i++)
                kt_worst_near(&worst, q[i], kt_simulation_positions(s)[i], 3e-13, "position %d", i);
            for (int i = 0; i < NV; i++)
                kt_worst_near(&worst, v[i], kt_simulation_velocities(s)[i], 3e-13, "velocity %d", i);
            for (int i = 0; i < COUNT; i++)
                kt_worst_near(&worst, x[i], kt_simulation_auxiliary_states(s)[i], 3e-13, "auxiliary state %d", i);
            kt_check_worst(&worst);
        }
        end(&m);
    }
}

/* The state after a step from one that is changed by z (xi, dv, dx), and torques by one number. */
static void take(machine *m, const double z[ALL], int input, double change, double out[ALL], const double *from) {
    kt_error error;
    double q[NQ], v[NV], next_q[NQ], next_v[NV];
    kt_position_add(m->model, m->q, z, q);
    for (int i = 0; i < NV; i++)
        v[i] = m->v[i] + z[NV + i];
    double *x = kt_auxiliary_states(m->model, m->data);
    for (int i = 0; i < COUNT; i++)
        x[i] = m->x[i] + z[2 * NV + i];
    if (input >= 0)
        m->tau[input] += change;
    (void)kt_fine("step", kt_step_evaluate(m->model, m->data, m->work, m->size, &m->step, q, v, next_q, next_v, &error),
                  &error);
    if (input >= 0)
        m->tau[input] -= change;
    kt_position_subtract(m->model, next_q, from, out);
    memcpy(out + NV, next_v, sizeof next_v);
    memcpy(out + 2 * NV, x, COUNT * sizeof *x);
}

/* Differences of order eight, with h = 0.002. Their error is rounding, and h^8 / 630 of the ninth derivative. */
static void difference(machine *m, int column, double out[ALL], const double *from) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    const double h = 0.002;
    memset(out, 0, ALL * sizeof *out);
    for (int k = -4; k <= 4; k++) {
        double z[ALL] = {0.0}, y[ALL];
        if (k == 0)
            continue;
        if (column < ALL)
            z[column] = k * h;
        take(m, z, column < ALL ? -1 : column - ALL, k * h, y, from);
        for (int i = 0; i < ALL; i++)
            out[i] += (k < 0 ? -weight[-k - 1] : weight[k - 1]) * y[i] / h;
    }
}

/* The derivatives of rodas5p are differences of a Jacobian over 1/512. Their error is 4400 roundings of entries of some
 * 20. */
KT_TEST(derivatives_of_a_step_are_those_of_its_differences) {
    for (int k = 0; k < METHODS + 2; k++) { /* two of them of a tree, too */
        const char *method = k < METHODS ? methods[k] : k == METHODS ? "radau5" : "implicit-euler";
        const double bound = strcmp(method, "rodas5p") == 0 ? 1e-10 : 1e-11;
        static machine m;
        static double all[(ALL + NV) * ALL];
        kt_error error;
        double q[NQ], v[NV];
        kt_worst worst = {.what = k < METHODS ? method : "of a tree"};
        make_of(&m, k < METHODS ? MACHINE : BODIES STATES, method);
        double *x = kt_auxiliary_states(m.model, m.data);
        memcpy(x, m.x, sizeof m.x);
        kt_need_fine(
            "derivatives",
            kt_step_derivatives(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, all, all + ALL * ALL, &error),
            &error);
        const double after[COUNT] = {x[0], x[1]};
        double column[ALL];
        for (int j = 0; j < ALL + NV; j++) {
            difference(&m, j, column, q);
            for (int i = 0; i < ALL; i++)
                kt_worst_near(&worst, all[j * ALL + i], column[i], bound, "%d %d", i, j);
        }
        memcpy(x, m.x, sizeof m.x);
        (void)kt_fine("step", kt_step_evaluate(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, &error),
                      &error);
        kt_check_equal_bits("states after it", after, x, COUNT);
        kt_check_worst(&worst);
        end(&m);
    }
}

/* The state after the step whose gravity, or whose mass of the rod, is changed. */
static void take_changed(machine *m, kt_model *copy, const kt_parameter *parameter, int number, double change,
                         double out[ALL], const double *from) {
    kt_error error;
    double values[KT_PARAMETER_MAX], q[NQ], v[NV];
    (void)kt_fine("get", kt_parameter_get(m->model, parameter, values, &error), &error);
    values[number] += change;
    (void)kt_fine("set", kt_parameter_set(copy, parameter, values, &error), &error);
    memcpy(kt_auxiliary_states(m->model, m->data), m->x, sizeof m->x);
    (void)kt_fine("step", kt_step_evaluate(copy, m->data, m->work, m->size, &m->step, m->q, m->v, q, v, &error),
                  &error);
    kt_position_subtract(m->model, q, from, out);
    memcpy(out + NV, v, sizeof v);
    memcpy(out + 2 * NV, kt_auxiliary_states(m->model, m->data), COUNT * sizeof *out);
    values[number] -= change;
    (void)kt_fine("set back", kt_parameter_set(copy, parameter, values, &error), &error);
}

/* Central differences over d have the error d^2 / 6 of the third derivative. After Richardson's extrapolation the error
 * is of order d^4. In rodas5p a stiffness is differenced twice. The widths are 1/1024 and 1/512. */
KT_TEST(derivatives_by_parameters_are_those_of_differences) {
    static const char *const names[] = {"gravity", "rod.mass", "effect pull.stiffness"};
    for (int k = 0; k < METHODS; k++) {
        const double bound = strcmp(methods[k], "rodas5p") == 0 ? 1e-9 : 1e-11;
        static machine m;
        kt_error error;
        kt_worst worst = {.what = methods[k]};
        double q[NQ], v[NV], C[ALL * KT_PARAMETER_MAX], far[2][ALL], near[2][ALL];
        kt_model *copy = NULL;
        make(&m, methods[k]);
        void *room = aligned_alloc(KT_ALIGNMENT, kt_model_size(m.model));
        const size_t size = kt_step_parameter_work_size(m.model, m.step.method);
        void *work = aligned_alloc(KT_ALIGNMENT, size);
        (void)kt_fine("copy", kt_model_copy(m.model, room, kt_model_size(m.model), &copy, &error), &error);
        (void)kt_fine("step", kt_step_evaluate(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, &error),
                      &error);
        memcpy(kt_auxiliary_states(m.model, m.data), m.x, sizeof m.x);
        for (size_t p = 0; p < sizeof names / sizeof *names; p++) {
            kt_parameter parameter;
            const double d = 1e-2;
            kt_need_fine("find", kt_parameter_find(m.model, names[p], &parameter, &error), &error);
            kt_need_fine(
                "C",
                kt_step_parameter_derivatives(m.model, m.data, work, size, &m.step, &parameter, m.q, m.v, C, &error),
                &error);
            kt_check_equal_bits("states stay", kt_auxiliary_states(m.model, m.data), m.x, COUNT);
            for (int j = 0; j < parameter.count; j++) {
                for (int sign = 0; sign < 2; sign++) {
                    take_changed(&m, copy, &parameter, j, sign ? d : -d, far[sign], q);
                    take_changed(&m, copy, &parameter, j, sign ? d / 2.0 : -d / 2.0, near[sign], q);
                }
                for (int i = 0; i < ALL; i++)
                    kt_worst_near(&worst, C[j * ALL + i],
                                  (8.0 * (near[1][i] - near[0][i]) - (far[1][i] - far[0][i])) / (6.0 * d), bound,
                                  "%s %d: %d", names[p], j, i);
            }
            memcpy(kt_auxiliary_states(m.model, m.data), m.x, sizeof m.x);
        }
        kt_check_worst(&worst);
        free(work);
        free(room);
        end(&m);
    }
}

/* A smooth cost of a state, its own states and inputs. */
static int cost(const kt_cost_point *at, double *value, double *by_state, double *by_tau, void *user) {
    const machine *m = user;
    double xi[NV], sum = 0.0;
    if (m->stops && at->step == 2)
        return 7;
    kt_position_subtract(m->model, at->q, m->q, xi); /* of the coordinates in the plane alone, whose changes add up */
    for (int i = 0; i < 3; i++)
        sum += sin(xi[i]);
    for (int i = 0; i < NV; i++)
        sum += 0.01 * at->v[i] * at->v[i];
    *value = sum + at->x[0] * at->x[0] + 3.0 * at->x[1];
    for (int i = 0; i < NV && at->tau; i++)
        *value += at->tau[i] * at->tau[i];
    for (int i = 0; i < ALL && by_state; i++)
        by_state[i] = i < 3         ? cos(xi[i])
                      : i < NV      ? 0.0
                      : i < 2 * NV  ? 0.02 * at->v[i - NV]
                      : i == 2 * NV ? 2.0 * at->x[0]
                                    : 3.0;
    for (int i = 0; i < NV && by_tau; i++)
        by_tau[i] = 2.0 * at->tau[i];
    return 0;
}

enum { STEPS = 5 };

static double value_of(machine *m, void *work, size_t size, const kt_rollout *rollout, const double z[ALL]) {
    kt_error error;
    double q[NQ], v[NV], value = 0.0;
    double *x = kt_auxiliary_states(m->model, m->data);
    kt_position_add(m->model, m->q, z, q);
    for (int i = 0; i < NV; i++)
        v[i] = m->v[i] + z[NV + i];
    for (int i = 0; i < COUNT; i++)
        x[i] = m->x[i] + z[2 * NV + i];
    (void)kt_fine(
        "value", kt_rollout_gradient(m->model, m->data, work, size, rollout, q, v, &value, NULL, NULL, cost, m, &error),
        &error);
    return value;
}

/* Against differences of the value, and with few checkpoints to the bit. */
KT_TEST(gradient_of_many_steps_is_that_of_its_differences) {
    static const char *const by[] = {"rk4", "radau5"};
    for (size_t k = 0; k < sizeof by / sizeof *by; k++) {
        static machine m;
        static double inputs[STEPS * NV], start[ALL], by_inputs[STEPS * NV], few[ALL + STEPS * NV];
        static const double zero[ALL];
        kt_error error;
        kt_worst worst = {.what = by[k]};
        double value, other;
        make(&m, by[k]);
        for (int i = 0; i < STEPS * NV; i++)
            inputs[i] = 0.1 * (i % 7) - 0.2;
        kt_rollout rollout = {.method = m.step.method, .t = 0.3, .h = 0.02, .steps = STEPS, .inputs = inputs};
        const size_t size = kt_rollout_work_size(m.model, &rollout);
        void *work = aligned_alloc(KT_ALIGNMENT, size);
        memcpy(kt_auxiliary_states(m.model, m.data), m.x, sizeof m.x);
        (void)kt_fine("gradient",
                      kt_rollout_gradient(m.model, m.data, work, size, &rollout, m.q, m.v, &value, start, by_inputs,
                                          cost, &m, &error),
                      &error);
        kt_check_equal_bits("states stay", kt_auxiliary_states(m.model, m.data), m.x, COUNT);
        rollout.checkpoints = 2;
        (void)kt_fine("few checkpoints",
                      kt_rollout_gradient(m.model, m.data, work, size, &rollout, m.q, m.v, &other, few, few + ALL, cost,
                                          &m, &error),
                      &error);
        kt_check_equal_bits("value", &other, &value, 1);
        kt_check_equal_bits("by the start", few, start, ALL);
        kt_check_equal_bits("by inputs", few + ALL, by_inputs, STEPS * NV);
        const double d = 4e-3;
        for (int j = 0; j < ALL + NV; j += 2) { /* the inputs of the second step */
            static const double weight[] = {0.75, -0.15, 1.0 / 60.0};
            double sum = 0.0;
            for (int i = -3; i <= 3; i++) {
                double z[ALL] = {0.0};
                if (i == 0)
                    continue;
                if (j < ALL)
                    z[j] = i * d;
                else
                    inputs[NV + j - ALL] += i * d;
                sum += (i < 0 ? -weight[-i - 1] : weight[i - 1]) * value_of(&m, work, size, &rollout, z) / d;
                if (j >= ALL)
                    inputs[NV + j - ALL] = 0.1 * ((NV + j - ALL) % 7) - 0.2;
            }
            kt_worst_near(&worst, j < ALL ? start[j] : by_inputs[NV + j - ALL], sum, 1e-10, "%d", j);
        }
        kt_check_near("the value is the same", value_of(&m, work, size, &rollout, zero), value, 0.0);
        kt_check_worst(&worst);
        free(work);
        end(&m);
    }
}

KT_TEST(failed_gradient_leaves_the_auxiliary_states) {
    static machine m;
    kt_error error;
    double value;
    make(&m, "rk4");
    const kt_rollout rollout = {.method = m.step.method, .h = 0.02, .steps = STEPS};
    const size_t size = kt_rollout_work_size(m.model, &rollout);
    void *work = aligned_alloc(KT_ALIGNMENT, size);
    memcpy(kt_auxiliary_states(m.model, m.data), m.x, sizeof m.x);
    m.stops = true;
    kt_check_equal_int(
        "it stops",
        kt_rollout_gradient(m.model, m.data, work, size, &rollout, m.q, m.v, &value, NULL, NULL, cost, &m, &error),
        KT_ERROR_CALLBACK);
    kt_check_equal_bits("auxiliary states", kt_auxiliary_states(m.model, m.data), m.x, COUNT);
    free(work);
    end(&m);
}

/* The state after STEPS steps from given auxiliary states. */
static void walk(machine *m, const double x[COUNT], double out[NQ + NV + COUNT]) {
    kt_error error;
    double *q = out, *v = out + NQ, *next = out + NQ + NV;
    kt_step step = m->step;
    memcpy(q, m->q, sizeof m->q);
    memcpy(v, m->v, sizeof m->v);
    memcpy(next, x, COUNT * sizeof *x);
    for (int i = 0; i < STEPS; i++) {
        step.x = i == 0 ? x : NULL; /* NULL continues */
        step.t = m->step.t + i * m->step.h;
        (void)kt_fine("step", kt_step_evaluate(m->model, m->data, m->work, m->size, &step, q, v, q, v, &error), &error);
    }
    memcpy(next, kt_auxiliary_states(m->model, m->data), COUNT * sizeof *next);
}

KT_TEST(two_motions_from_given_auxiliary_states_have_equal_bits) {
    for (int k = 0; k < METHODS; k++) {
        static machine m;
        static double inputs[STEPS * NV], by[2][ALL + STEPS * NV];
        kt_error error;
        double motion[3][NQ + NV + COUNT], value[2], other[COUNT];
        make(&m, methods[k]);
        kt_note("%s", methods[k]);
        for (int i = 0; i < COUNT; i++)
            other[i] = m.x[i] + 1.0;
        walk(&m, m.x, motion[0]);
        walk(&m, m.x, motion[1]);
        walk(&m, other, motion[2]);
        kt_check_equal_bits("steps", motion[1], motion[0], NQ + NV + COUNT);
        kt_check_true("x counts", memcmp(motion[2], motion[0], sizeof motion[0]) != 0);
        kt_rollout rollout = {.method = m.step.method, .t = 0.3, .h = 0.02, .steps = STEPS, .inputs = inputs, .x = m.x};
        const size_t size = kt_rollout_work_size(m.model, &rollout);
        void *work = aligned_alloc(KT_ALIGNMENT, size);
        for (int i = 0; i < 2; i++) { /* for any contents of the data, which stay the same */
            double *x = kt_auxiliary_states(m.model, m.data), before[COUNT] = {7.0 + i, -3.0};
            memcpy(x, before, sizeof before);
            (void)kt_fine("gradient",
                          kt_rollout_gradient(m.model, m.data, work, size, &rollout, m.q, m.v, &value[i], by[i],
                                              by[i] + ALL, cost, &m, &error),
                          &error);
            kt_check_equal_bits("the data", x, before, COUNT);
        }
        kt_check_equal_bits("value", &value[1], &value[0], 1);
        kt_check_equal_bits("gradients", by[1], by[0], ALL + STEPS * NV);
        free(work);
        end(&m);
    }
}

KT_TEST(steps_that_fail_leave_the_auxiliary_states_of_the_data) {
    static machine m;
    kt_error error;
    double q[NQ], v[NV], by[ALL] = {1.0}, A[ALL * ALL];
    const double wrong[COUNT] = {0.0, (double)NAN}, before[COUNT] = {7.0, -3.0}, far[NQ] = {(double)INFINITY};
    make(&m, "rk4");
    double *x = kt_auxiliary_states(m.model, m.data);
    memcpy(x, before, sizeof before);
    for (int i = 0; i < 2; i++) { /* a start that is not finite, and a step that fails on its way */
        kt_step step = m.step;
        const double *from = i == 0 ? m.q : far;
        step.x = i == 0 ? wrong : m.x;
        kt_check_equal_int("step", kt_step_evaluate(m.model, m.data, m.work, m.size, &step, from, m.v, q, v, &error),
                           KT_ERROR_NOT_FINITE);
        kt_check_equal_int(
            "derivatives",
            kt_step_derivatives(m.model, m.data, m.work, m.size, &step, from, m.v, q, v, A, NULL, &error),
            KT_ERROR_NOT_FINITE);
        kt_check_equal_int("adjoint",
                           kt_step_adjoint(m.model, m.data, m.work, m.size, &step, from, m.v, by, by, NULL, &error),
                           KT_ERROR_NOT_FINITE);
        kt_check_equal_bits("the data", x, before, COUNT);
    }
    end(&m);
}

/* by_state = A' y and by_tau = B' y, with the matrices that differences have confirmed. */
KT_TEST(adjoint_of_a_step_applies_the_transposed_matrices) {
    for (int k = 0; k < METHODS; k++) {
        static machine m;
        static double all[(ALL + NV) * ALL];
        kt_error error;
        kt_worst worst = {.what = methods[k]};
        double by[ALL], out[ALL + NV];
        make(&m, methods[k]);
        double *x = kt_auxiliary_states(m.model, m.data);
        for (int i = 0; i < ALL; i++)
            by[i] = cos(3.0 * i);
        memcpy(x, m.x, sizeof m.x);
        (void)kt_fine("adjoint",
                      kt_step_adjoint(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, by, out, out + ALL, &error),
                      &error);
        kt_check_equal_bits("states stay", x, m.x, COUNT);
        (void)kt_fine("matrices",
                      kt_step_derivatives(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, NULL, NULL, all,
                                          all + ALL * ALL, &error),
                      &error);
        for (int j = 0; j < ALL + NV; j++) {
            double sum = 0.0;
            for (int i = 0; i < ALL; i++)
                sum += all[j * ALL + i] * by[i];
            kt_worst_near(&worst, out[j], sum, 1e-13, "%d", j);
        }
        kt_check_worst(&worst);
        end(&m);
    }
}

/* ---- many at once ------------------------------------------------------------------------------------------------ */

enum { MANY = 11, ONES = 4 /* steps */ };

/* State i of a batch. */
static void vary(const machine *m, size_t i, double q[NQ], double v[NV], double x[COUNT]) {
    double z[NV];
    for (int j = 0; j < NV; j++) {
        z[j] = 0.02 * cos((double)i + 3.0 * j);
        v[j] = m->v[j] + 0.1 * sin(2.0 * (double)i + j);
    }
    kt_position_add(m->model, m->q, z, q);
    x[0] = 0.5 - 0.1 * (double)i;
    x[1] = i == 7 ? (double)NAN : 0.2 * (double)i;
}

/* x += h f(t, q, v, x), v += h a, q = q (+) h v, and back onto the loops. */
static kt_status take_semi_implicit(machine *m, double t, double h, double q[NQ], double v[NV]) {
    kt_error error;
    double a[NV], rates[COUNT], moved[NQ], *x = kt_auxiliary_states(m->model, m->data);
    kt_status status = kt_acceleration_evaluate(m->model, m->data, t, q, v, m->tau, NULL, a, &error);
    if (status == KT_OK)
        status = kt_auxiliary_state_rates(m->model, m->data, t, q, v, rates, &error);
    for (int i = 0; i < COUNT; i++)
        x[i] += h * rates[i];
    for (int i = 0; i < NV; i++) {
        v[i] += h * a[i];
        a[i] = h * v[i];
    }
    kt_position_add(m->model, q, a, moved);
    memcpy(q, moved, sizeof moved);
    return status == KT_OK ? kt_state_project(m->model, m->data, t + h, q, v, NULL, &error) : status;
}

static void compare_batch(const char *text, bool semi_implicit) {
    static machine m;
    kt_batch_options options = kt_batch_options_default();
    kt_batch *batch = NULL;
    kt_error error;
    int different = 0;
    double q[NQ], v[NV], x[COUNT], got_q[NQ], got_v[NV], got_x[COUNT], t;
    make_of(&m, text, "rk4");
    options.states = MANY;
    options.method = m.step.method;
    kt_need_fine("batch", kt_batch_create(m.model, &options, &batch, &error), &error);
    (void)kt_fine("get", kt_batch_get_auxiliary_states(batch, 3, got_x, &error), &error);
    kt_check_equal_bits("initial", got_x, m.x, COUNT);
    for (size_t i = 0; i < MANY; i++) {
        vary(&m, i, q, v, x);
        (void)kt_fine("torque", kt_batch_set_torque(batch, i, m.tau, &error), &error);
        (void)kt_fine("auxiliary states", kt_batch_set_auxiliary_states(batch, i, x, &error), &error);
        (void)kt_fine("state", kt_batch_set_state(batch, i, 0.3, q, v, &error), &error);
    }
    const kt_status status = semi_implicit ? kt_batch_step_semi_implicit(batch, m.step.h, ONES, &error)
                                           : kt_batch_step(batch, m.step.h, ONES, &error);
    kt_check_true("the seventh fails", status != KT_OK && kt_batch_status(batch, 7) == status);
    kt_check_contains("named", error.where, "state 7");
    for (size_t i = 0; i < MANY; i++) {
        kt_step step = m.step;
        vary(&m, i, q, v, x);
        memcpy(kt_auxiliary_states(m.model, m.data), x, sizeof x);
        for (int k = 0; k < ONES && i != 7; k++) {
            (void)kt_fine("one",
                          semi_implicit ? take_semi_implicit(&m, step.t, step.h, q, v)
                                        : kt_step_evaluate(m.model, m.data, m.work, m.size, &step, q, v, q, v, &error),
                          &error);
            step.t += step.h;
        }
        (void)kt_fine("get", kt_batch_get_state(batch, i, &t, got_q, got_v, &error), &error);
        (void)kt_fine("get", kt_batch_get_auxiliary_states(batch, i, got_x, &error), &error);
        different += memcmp(q, got_q, sizeof q) != 0 || memcmp(v, got_v, sizeof v) != 0 ||
                     memcmp(kt_auxiliary_states(m.model, m.data), got_x, sizeof x) != 0;
    }
    kt_check_equal_int("states of other bits", different, 0);
    const kt_batch_report report = kt_batch_report_of(batch);
    kt_note("%zu at once, %llu in lanes, %llu alone", report.width, (unsigned long long)report.in_lanes,
            (unsigned long long)report.alone);
    kt_batch_free(batch);
    end(&m);
}

KT_TEST(states_of_a_batch_have_the_bits_of_single_ones) {
    for (int semi_implicit = 0; semi_implicit < 2; semi_implicit++) {
        compare_batch(BODIES STATES, semi_implicit);
        compare_batch(MACHINE, semi_implicit);
    }
}

KT_TEST(failed_step_leaves_the_auxiliary_states) {
    static machine m;
    kt_error error;
    double q[NQ], v[NV];
    make(&m, "rk4");
    double *x = kt_auxiliary_states(m.model, m.data), before[COUNT] = {0.25, (double)NAN};
    memcpy(x, before, sizeof before);
    kt_check_true("it fails", kt_step_derivatives(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, NULL, NULL,
                                                  &error) != KT_OK);
    kt_check_near("x", x[0], 0.25, 0.0);
    kt_check_true("NaN", isnan(x[1]));
    end(&m);
}
