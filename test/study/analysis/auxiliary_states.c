/* Linear systems, modes and equilibria of models with auxiliary states: closed forms, and differences along the
 * manifold. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "motion/simulation/parsed.h"

#include "kinetree/analysis.h"

#include <float.h>
#include <math.h>
#include <string.h>

typedef struct made {
    kt_model *model;
    kt_linearization *exact, *differences;
} made;

static void make(made *m, const char *text) {
    kt_linearization_options options = kt_linearization_options_default();
    kt_scene scene;
    kt_parsed_scene(text, &scene);
    m->model = kt_test_model(&scene.description, NULL);
    m->exact = kt_test_linearization(m->model, &options);
    options.differences = true;
    m->differences = kt_test_linearization(m->model, &options);
}

/* ---- a controller with memory ------------------------------------------------------------------------------------ */

/* J q'' = P (s - q) + I x - D q' - m g l cos(q) / 2, x' = s - q. */
#define CONTROLLED                                                                                                     \
    "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"                                                                   \
    "  - {name: arm, joint: {type: revolute, axis: z, position: 1.3}, mass: 2, com: [0.4, 0, 0],\n"                    \
    "     inertia: [0.05, 0.05, 0.05]}\n"                                                                              \
    "states: {sum: {rate: \"0.7 - position.arm\"}, aside: {initial: 3, rate: \"-4*aside\"}}\n"                         \
    "effects:\n"                                                                                                       \
    "  - {type: expression, joint: arm, force: \"20*(0.7 - position.arm) + 15*sum - 2*velocity.arm\"}\n"               \
    "  - {type: motor, joint: arm, torque: 0}\n"

KT_TEST(equilibrium_of_a_controller_with_memory_is_its_closed_form) {
    made m;
    kt_error error;
    kt_equilibrium found;
    double q = 1.3;
    make(&m, CONTROLLED);
    double *x = kt_linearization_auxiliary_states(m.exact);
    kt_check_near("initial", x[1], 3.0, 0.0);
    (void)kt_fine("found", kt_equilibrium_find(m.exact, NULL, 0.0, &q, NULL, &found, &error), &error);
    kt_check_near("angle", q, 0.7, 4.0 * DBL_EPSILON);
    kt_check_near("sum", x[0], 2.0 * 9.81 * 0.4 * cos(0.7) / 15.0, 8.0 * DBL_EPSILON);
    kt_check_near("aside", x[1], 0.0, 1e-15);
    kt_check_true("steps", found.steps > 1);
}

KT_TEST(matrices_of_a_controller_with_memory_are_its_closed_form) {
    made m;
    kt_error error;
    const double q = 0.9, v = 0.2, J = 0.05 + 2.0 * 0.16;
    const double expected[4][4] = {{0.0, (-20.0 + 2.0 * 9.81 * 0.4 * sin(q)) / J, -1.0, 0.0},
                                   {1.0, -2.0 / J, 0.0, 0.0},
                                   {0.0, 15.0 / J, 0.0, 0.0},
                                   {0.0, 0.0, 0.0, -4.0}};
    make(&m, CONTROLLED);
    kt_linearization *const both[] = {m.exact, m.differences};
    for (int k = 0; k < 2; k++) {
        kt_worst worst = {.what = k ? "differences" : "exact"};
        (void)kt_fine("evaluated", kt_linearization_evaluate(both[k], 0.0, &q, &v, NULL, &error), &error);
        const kt_linear_system *s = kt_linearization_system(both[k]);
        kt_check_equal_int("states", s->states, 4);
        kt_check_equal_int("own", s->auxiliary_states, 2);
        kt_check_equal_int("exact", s->exact, k == 0);
        for (int j = 0; j < 4 && s->states == 4; j++)
            for (int i = 0; i < 4; i++)
                kt_worst_near(&worst, s->state[j * 4 + i], expected[j][i], k ? 1e-10 : 1e-13, "%d %d", i, j);
        kt_check_near("input", s->input[1], 1.0 / J, 1e-14);
        kt_check_near("no input", s->input[2], 0.0, 0.0);
        kt_check_near("rate", s->rate[2], 0.7 - q, 1e-15);
        kt_check_near("rate", s->rate[3], -12.0, 1e-15);
        kt_check_worst(&worst);
    }
}

/* `lambda^3 + D/J lambda^2 + k/J lambda + I/J = 0` at the equilibrium, and -4 for the state that nothing reads. */
KT_TEST(modes_of_a_controller_with_memory_are_roots_of_its_polynomial) {
    made m;
    kt_error error;
    kt_modes *modes = NULL;
    double q = 0.7;
    const double J = 0.05 + 2.0 * 0.16, k = 20.0 - 2.0 * 9.81 * 0.4 * sin(0.7);
    make(&m, CONTROLLED);
    (void)kt_fine("found", kt_equilibrium_find(m.exact, NULL, 0.0, &q, NULL, NULL, &error), &error);
    (void)kt_fine("evaluated", kt_linearization_evaluate(m.exact, 0.0, &q, NULL, NULL, &error), &error);
    (void)kt_fine("modes", kt_modes_create(m.model, &modes, &error), &error);
    (void)kt_fine("evaluated", kt_modes_evaluate(modes, kt_linearization_system(m.exact), &error), &error);
    int aside = 0, count = 0;
    for (int i = 0; i < kt_modes_count(modes); i++) {
        const kt_mode mode = kt_modes_at(modes, i);
        const double a = mode.real, b = mode.imaginary, *shape = kt_modes_auxiliary_states(modes, i);
        count += mode.count;
        if (fabs(a + 4.0) < 1e-9 && b == 0.0) {
            aside++;
            kt_check_near("nothing moves", hypot(kt_modes_positions(modes, i)[0], kt_modes_velocities(modes, i)[0]),
                          0.0, 0.0);
            kt_check_true("but the state", fabs(shape[2]) > 0.9);
            continue;
        }
        const double re = a * a * a - 3.0 * a * b * b + 2.0 / J * (a * a - b * b) + k / J * a + 15.0 / J;
        const double im = 3.0 * a * a * b - b * b * b + 4.0 / J * a * b + k / J * b;
        kt_check_near("root", hypot(re, im), 0.0, 1e-11);
        /* x = -q / lambda, with q = 1 */
        kt_check_near("share of the sum", hypot(shape[0], shape[1]), 1.0 / hypot(a, b), 1e-14);
    }
    kt_check_equal_int("aside", aside, 1);
    kt_check_equal_int("all", count, 4);
    kt_modes_free(modes);
}

/* ---- at limits and where nothing holds a state ------------------------------------------------------------------- */

/* A mass hangs between two chambers that a valve fills. The rate x' of both is the valve's opening. At rest the valve
 * is shut, so that only their difference is determined: m g = a - b. The second case is a controller at its limit, with
 * slope zero there. In the third, the force lags, and swings through zero on the way. */
KT_TEST(motion_leads_to_rest_where_newton_s_method_does_not) {
    static const struct {
        const char *text;
        double position, difference;
    } table[] = {
        {"kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
         "  - {name: arm, joint: {type: prismatic, axis: y}, mass: 2}\n"
         "states:\n  a: {initial: 3, rate: \"50*(0.1 - position.arm)\"}\n  b: {initial: 3, rate: \"-50*(0.1 - "
         "position.arm)\"}\n"
         "effects:\n  - {type: expression, joint: arm, force: \"a - b - 80*velocity.arm - 200*(position.arm - "
         "0.1)\"}\n",
         0.1, 2.0 * 9.81},
        {"kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
         "  - {name: arm, joint: {type: prismatic, axis: y}, mass: 2}\n"
         "states:\n  a: {rate: \"5 - position.arm + 0.5*(clamp(30*(5 - position.arm) + 40*a - 12*velocity.arm, -25, "
         "25) - "
         "30*(5 - position.arm) - 40*a + 12*velocity.arm)\"}\n  b: {rate: \"-b\"}\n"
         "effects:\n  - {type: expression, joint: arm, force: \"clamp(30*(5 - position.arm) + 40*a - 12*velocity.arm, "
         "-25, 25)\"}\n",
         5.0, 2.0 * 9.81 / 40.0},
        {"kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"
         "  - {name: arm, joint: {type: prismatic, axis: y}, mass: 50}\n"
         "states:\n  a: {initial: 490.5, rate: \"(clamp(7500*(1.5 - position.arm) + 4000*b - 1500*velocity.arm, -2000, "
         "2000) - a)/0.05\"}\n  b: {rate: \"1.5 - position.arm\"}\n"
         "effects:\n  - {type: expression, joint: arm, force: \"a - 10*velocity.arm\"}\n",
         1.5, 50.0 * 9.81 * (1.0 - 1.0 / 4000.0)},
    };
    for (size_t k = 0; k < sizeof table / sizeof *table; k++) {
        made m;
        kt_error error;
        kt_equilibrium found;
        double q = 0.0;
        make(&m, table[k].text);
        const double *x = kt_linearization_auxiliary_states(m.exact);
        (void)kt_fine("found", kt_equilibrium_find(m.exact, NULL, 0.0, &q, NULL, &found, &error), &error);
        kt_check_true("by the motion", found.followed);
        kt_check_near("position", q, table[k].position, 1e-12);
        kt_check_near("difference", x[0] - x[1], table[k].difference, 1e-11);
        kt_check_below("acceleration", found.acceleration, 1e-11);
    }
}

/* ---- in space, and with a loop ----------------------------------------------------------------------------------- */

#define BODIES                                                                                                         \
    "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n"                                                                   \
    "  - {name: ball, joint: {type: spherical}, mass: 2, com: [0.3, 0.1, 0], inertia: [0.2, 0.3, 0.4]}\n"              \
    "  - {name: arm, parent: ball, joint: {type: revolute, axis: y, at: [0.5, 0, 0.1]}, mass: 1, com: [0.2, 0, "       \
    "0.1],\n"                                                                                                          \
    "     inertia: [0.02, 0.03, 0.04], markers: {tip: [0.4, 0.1, 0]}}\n"                                               \
    "states:\n"                                                                                                        \
    "  lag: {initial: 0.5, rate: \"30*(position.arm - lag) + lag^2\"}\n"                                               \
    "  charge: {initial: 1, rate: \"marker.arm.tip.vx - lag*charge + velocity.ball[1]*marker.arm.tip.y\"}\n"           \
    "effects:\n"                                                                                                       \
    "  - {type: expression, joint: arm, force: \"-3*lag - 4*charge*velocity.arm\"}\n"                                  \
    "  - {type: expression, between: [arm.tip, {body: world, at: [1, 1, 0]}], force: \"5*charge*lag - length\"}\n"     \
    "  - {type: expression, at: ball, force: [charge^2, 0, lag], torque: [0, lag, 0]}\n"
#define LOOP "loops:\n  - {name: rod, type: distance, between: [arm.tip, {body: world, at: [1.2, 0.4, 0.3]}]}\n"

/* The differences along the manifold do not use the Jacobians. */
static void compare(const char *text) {
    made m;
    kt_error error;
    make(&m, text);
    double q[5], v[4] = {0.4, -0.3, 0.5, 0.7};
    KT_WORST worst = kt_worst_make("differences");
    kt_model_initial(m.model, q, NULL);
    (void)kt_fine("exact", kt_linearization_evaluate(m.exact, 0.2, q, v, NULL, &error), &error);
    (void)kt_fine("differences", kt_linearization_evaluate(m.differences, 0.2, q, v, NULL, &error), &error);
    const kt_linear_system *a = kt_linearization_system(m.exact), *b = kt_linearization_system(m.differences);
    kt_need(kt_check_equal_int("states", a->states, b->states));
    for (int i = 0; i < a->states * a->states; i++)
        kt_worst_near(&worst, a->state[i], b->state[i], 4.0 * (a->state_error[i] + b->state_error[i]) + 1e-13, "%d %d",
                      i % a->states, i / a->states);
    kt_check_true("it has columns of states", a->states == a->positions + a->velocities + 2);
    kt_check_below("error", b->error, 1e-11);
}

KT_TEST(matrices_in_space_are_those_of_differences) { compare(BODIES); }

KT_TEST(matrices_with_a_loop_are_those_of_differences) { compare(BODIES LOOP); }

/* Newton's method finds the equilibrium of the formulas from another start: nothing moves there and no state
 * changes. */
KT_TEST(equilibrium_in_space_with_a_loop_rests) {
    made m;
    kt_error error;
    double q[5], v[4] = {0.0}, a[4], rates[2];
    make(&m, BODIES LOOP);
    kt_data *data = kt_test_data(m.model);
    kt_model_initial(m.model, q, NULL);
    (void)kt_fine("found", kt_equilibrium_find(m.exact, NULL, 0.0, q, NULL, NULL, &error), &error);
    memcpy(kt_auxiliary_states(m.model, data), kt_linearization_auxiliary_states(m.exact), sizeof rates);
    (void)kt_fine("acceleration", kt_acceleration_evaluate(m.model, data, 0.0, q, v, NULL, NULL, a, &error), &error);
    (void)kt_fine("rates", kt_auxiliary_state_rates(m.model, data, 0.0, q, v, rates, &error), &error);
    for (int i = 0; i < 4; i++)
        kt_check_near("acceleration", a[i], 0.0, 2e-12);
    for (int i = 0; i < 2; i++)
        kt_check_near("rate", rates[i], 0.0, 1e-13);
}

/* A motor drives a flywheel against friction alone, so that it has no position of rest. The call returns a message and
 * leaves the states as they were. */
KT_TEST(what_has_no_equilibrium_is_rejected_and_keeps_its_states) {
    made m;
    kt_error error;
    double q = 0.25;
    make(&m, "kinetree: 1\nbodies:\n  - {name: wheel, joint: {type: revolute}, inertia: [1, 1, 1], mass: 1}\n"
             "states: {current: {initial: 2, rate: \"12 - current - velocity.wheel\"}}\n"
             "effects:\n  - {type: expression, joint: wheel, force: \"current - velocity.wheel\"}\n");
    kt_check_equal_int("rejected", kt_equilibrium_find(m.exact, NULL, 0.0, &q, NULL, NULL, &error), KT_ERROR_STEP);
    kt_check_contains("which", error.where, "current");
    kt_check_near("position", q, 0.25, 0.0);
    kt_check_near("state", kt_linearization_auxiliary_states(m.exact)[0], 2.0, 0.0);
}
