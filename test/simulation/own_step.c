/* Derivatives of steps with own states: the step against a simulation's bits, A and B against differences of the step,
 * through a loop, quaternions and markers; Floquet multipliers against the exponentials of the modes. */
#include "scenes.h"

#include "kinetree/analysis.h"
#include "kinetree/mechanism.h"
#include "kinetree/scene.h"
#include "kinetree/sensitivity.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A four-bar and a free ball; states read both, and act on both. */
#define MACHINE                                                                                                        \
    "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"                                                                   \
    "  - {name: crank, joint: {type: revolute, axis: z, position: 60 deg, velocity: 2}, mass: 1,\n"                    \
    "     shape: {type: rod, to: [1, 0, 0]}}\n"                                                                        \
    "  - {name: rod, parent: crank, joint: {type: revolute, axis: z, at: [1, 0, 0], position: -50 deg}, mass: 2,\n"    \
    "     shape: {type: rod, to: [2, 0, 0]}, markers: {tip: [2, 0, 0], mid: [1, 0.3, 0]}}\n"                           \
    "  - {name: rocker, joint: {type: revolute, axis: z, at: [2.5, 0, 0], position: 80 deg}, mass: 1,\n"               \
    "     shape: {type: rod, to: [1.5, 0, 0]}, markers: {tip: [1.5, 0, 0]}}\n"                                         \
    "  - {name: ball, joint: {type: free, position: {position: [0, 1, 1]}, velocity: {linear: [1, 2, 3], angular: "    \
    "[1, -2, 3]}},\n"                                                                                                  \
    "     mass: 1, shape: {type: box, size: [0.3, 0.2, 0.1]}, markers: {eye: [0.1, 0.2, 0]}}\n"                        \
    "loops:\n  - {name: close, type: revolute, between: [rod.tip, rocker.tip]}\n"                                      \
    "initial: {hold: [crank]}\n"                                                                                       \
    "states:\n"                                                                                                        \
    "  lag: {initial: 0.5, rate: \"3*(marker.rod.mid.y - lag)\"}\n"                                                    \
    "  seen: {initial: -0.2, rate: \"marker.ball.eye.vx*lag - seen + sin(t)\"}\n"                                      \
    "effects:\n"                                                                                                       \
    "  - {type: expression, joint: crank, force: \"-4*lag - 0.3*seen*velocity.crank\"}\n"                              \
    "  - {type: expression, at: ball.eye, force: [\"seen\", \"-lag*lag\", 0], frame: body}\n"

enum { NQ = 10, NV = 9, STATES = 2, ALL = 2 * NV + STATES };

typedef struct machine {
    kt_scene scene;
    kt_model *model;
    kt_data *data;
    void *work;
    size_t size;
    kt_step step;
    double q[NQ], v[NV], x[STATES], tau[NV];
} machine;

static bool make(machine *m, const char *method) {
    kt_error error = {0};
    memset(m, 0, sizeof *m);
    if (!kt_fine("scene", kt_scene_parse("x", MACHINE, strlen(MACHINE), &m->scene, NULL, NULL, &error), &error) ||
        !kt_fine("model", kt_model_compile(&m->scene.description, NULL, &m->model, &error), &error) ||
        !kt_fine("data", kt_data_create(m->model, &m->data, &error), &error))
        return false;
    kt_model_initial(m->model, m->q, m->v);
    m->step = (kt_step){.method = kt_method_find(method), .t = 0.3, .h = 0.02, .tau = m->tau};
    m->size = kt_step_work_size(m->model, m->step.method);
    m->work = aligned_alloc(KT_ALIGNMENT, m->size);
    memset(m->work, 0xFF, m->size);
    for (int i = 0; i < NV; i++)
        m->tau[i] = 0.1 * i;
    kt_own_states_initial(m->model, m->x);
    return kt_fine("closed", kt_state_assemble(m->model, m->data, 0.3, m->q, m->v, &error), &error);
}

static void end(machine *m) {
    free(m->work);
    kt_data_free(m->data);
    kt_model_free(m->model);
    kt_scene_free(&m->scene);
}

static const char *const methods[] = {"rk4", "dopri5", "heun"};
enum { METHODS = sizeof methods / sizeof *methods };

KT_TEST(step_has_the_bits_of_a_simulation) {
    for (int k = 0; k < METHODS; k++) {
        static machine m;
        kt_error error;
        double q[NQ], v[NV];
        if (!make(&m, methods[k]))
            return;
        kt_run run = kt_run_default();
        run.integrator = methods[k];
        run.step = m.step.h;
        kt_simulation *s = kt_scene_simulate(m.model, &run, NULL);
        (void)kt_fine("set", kt_simulation_set_state(s, m.step.t, m.q, m.v, &error), &error);
        (void)kt_fine("torque", kt_simulation_set_torque(s, m.tau, &error), &error);
        memcpy(m.q, kt_simulation_positions(s), sizeof m.q);
        memcpy(m.v, kt_simulation_velocities(s), sizeof m.v);
        (void)kt_fine("advance", kt_simulation_advance(s, m.step.t + m.step.h, &error), &error);
        memcpy(kt_own_states(m.model, m.data), m.x, sizeof m.x);
        (void)kt_fine("step", kt_step_evaluate(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, &error),
                      &error);
        kt_note("%s", methods[k]);
        kt_check_equal_bits("positions", q, kt_simulation_positions(s), NQ);
        kt_check_equal_bits("velocities", v, kt_simulation_velocities(s), NV);
        kt_check_equal_bits("own states", kt_own_states(m.model, m.data), kt_simulation_own_states(s), STATES);
        kt_simulation_free(s);
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
    double *x = kt_own_states(m->model, m->data);
    for (int i = 0; i < STATES; i++)
        x[i] = m->x[i] + z[2 * NV + i];
    if (input >= 0)
        m->tau[input] += change;
    (void)kt_fine("step", kt_step_evaluate(m->model, m->data, m->work, m->size, &m->step, q, v, next_q, next_v, &error),
                  &error);
    if (input >= 0)
        m->tau[input] -= change;
    kt_position_subtract(m->model, next_q, from, out);
    memcpy(out + NV, next_v, sizeof next_v);
    memcpy(out + 2 * NV, x, STATES * sizeof *x);
}

/* Differences of order eight over h = 0.002, whose error is h^8 / 630 of the ninth derivative, and rounding. */
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

KT_TEST(derivatives_of_a_step_are_those_of_its_differences) {
    for (int k = 0; k < METHODS; k++) {
        static machine m;
        static double all[(ALL + NV) * ALL];
        kt_error error;
        double q[NQ], v[NV];
        kt_worst worst = {.what = methods[k]};
        if (!make(&m, methods[k]))
            return;
        double *x = kt_own_states(m.model, m.data);
        memcpy(x, m.x, sizeof m.x);
        if (kt_fine("derivatives",
                    kt_step_derivatives(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, all, all + ALL * ALL,
                                        &error),
                    &error)) {
            const double after[STATES] = {x[0], x[1]};
            double column[ALL];
            for (int j = 0; j < ALL + NV; j++) {
                difference(&m, j, column, q);
                for (int i = 0; i < ALL; i++)
                    kt_worst_near(&worst, all[j * ALL + i], column[i], 1e-11, "%d %d", i, j);
            }
            memcpy(x, m.x, sizeof m.x);
            (void)kt_fine("step", kt_step_evaluate(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, &error),
                          &error);
            kt_check_equal_bits("states after it", after, x, STATES);
        }
        kt_check_worst(&worst);
        end(&m);
    }
}

KT_TEST(failed_step_leaves_the_own_states) {
    static machine m;
    kt_error error;
    double q[NQ], v[NV];
    if (!make(&m, "rk4"))
        return;
    double *x = kt_own_states(m.model, m.data), before[STATES] = {0.25, (double)NAN};
    memcpy(x, before, sizeof before);
    kt_check_true("it fails", kt_step_derivatives(m.model, m.data, m.work, m.size, &m.step, m.q, m.v, q, v, NULL, NULL,
                                                  &error) != KT_OK);
    kt_check_near("x", x[0], 0.25, 0.0);
    kt_check_true("NaN", isnan(x[1]));
    end(&m);
}

/* J q'' = -P q + x - D q', x' = -20 q - 0.5 x: a linear system at rest, whose multipliers over T are exp(lambda T); that of a state
 * alone is exp(-3 T). */
KT_TEST(multipliers_of_a_rest_are_the_exponentials_of_its_modes) {
    static const char text[] =
        "kinetree: 1\nbodies:\n  - {name: arm, joint: {type: prismatic, axis: x}, mass: 2}\n"
        "states: {x: {rate: \"-20*position.arm - 0.5*x\"}, alone: {rate: \"-3*alone\"}}\neffects:\n"
        "  - {type: expression, joint: arm, force: \"-50*position.arm + x - velocity.arm\"}\n";
    const double T = 0.7, q = 0.0, v = 0.0;
    kt_scene scene;
    kt_model *model = NULL;
    kt_modes *modes = NULL;
    kt_linearization *l = NULL;
    kt_floquet *floquet = NULL;
    kt_error error = {0};
    const kt_floquet_options options = kt_floquet_options_default(T);
    const kt_linearization_options linear = kt_linearization_options_default();
    if (!kt_fine("scene", kt_scene_parse("x", text, strlen(text), &scene, NULL, NULL, &error), &error) ||
        !kt_fine("model", kt_model_compile(&scene.description, NULL, &model, &error), &error) ||
        !kt_fine("linear", kt_linearization_create(model, &linear, &l, &error), &error) ||
        !kt_fine("system", kt_linearization_evaluate(l, 0.0, &q, &v, NULL, &error), &error) ||
        !kt_fine("modes", kt_modes_create(model, &modes, &error), &error) ||
        !kt_fine("evaluate", kt_modes_evaluate(modes, kt_linearization_system(l), &error), &error) ||
        !kt_fine("floquet", kt_floquet_create(model, &options, &floquet, &error), &error) ||
        !kt_fine("multipliers", kt_floquet_evaluate(floquet, 0.0, &q, &v, &error), &error))
        return;
    kt_check_equal_int("multipliers", kt_floquet_count(floquet), kt_modes_count(modes));
    for (int i = 0; i < kt_modes_count(modes); i++) {
        const kt_mode mode = kt_modes_at(modes, i);
        const double re = exp(mode.real * T) * cos(mode.imaginary * T),
                     im = exp(mode.real * T) * sin(mode.imaginary * T);
        double nearest = HUGE_VAL;
        for (int j = 0; j < kt_floquet_count(floquet); j++) {
            const kt_multiplier mu = kt_floquet_at(floquet, j);
            nearest = fmin(nearest, hypot(mu.real - re, mu.imaginary - fabs(im)));
        }
        kt_check_below("distance of the nearest multiplier", nearest, 1e-9);
    }
    kt_check_below("gap", kt_floquet_gap(floquet), 0.0);
    kt_floquet_own_states(floquet)[1] = 2.0;
    (void)kt_fine("again", kt_floquet_evaluate(floquet, 0.0, &q, &v, &error), &error);
    kt_check_near("gap of the state", kt_floquet_gap(floquet), 1.0 - exp(-3.0 * T), 1e-9);
    kt_floquet_free(floquet);
    kt_modes_free(modes);
    kt_linearization_free(l);
    kt_model_free(model);
    kt_scene_free(&scene);
}
