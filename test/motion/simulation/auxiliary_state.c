/* Auxiliary states: their rates, their use in a simulation, and the functions that reject them. The scenes that have
 * some are held against other equations in auxiliary_state_scenes.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parsed.h"

#include "kinetree/analysis.h"
#include "kinetree/mechanism.h"
#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* An arm in space, a four-bar that reads a marker of its coupler, and two states that depend on each other. No effect
 * reads the second state, so it is a quadrature of the motion. */
#define ARM                                                                                                            \
    "kinetree: 1\ngravity: [0, -9.81, 0]\nparameters: {T: 0.2}\nbodies:\n"                                             \
    "  - {name: arm, joint: {type: revolute, axis: z, position: 30 deg, velocity: 1}, mass: 1,\n"                      \
    "     shape: {type: rod, to: [1, 0, 0]}, markers: {tip: [1, 0, 0]}}\n"
#define STATES                                                                                                         \
    "states:\n"                                                                                                        \
    "  lag: {initial: 0.5, rate: \"(position.arm - lag)/T\"}\n"                                                        \
    "  way: {rate: \"marker.arm.tip.vx + lag*t\"}\n"                                                                   \
    "effects:\n"                                                                                                       \
    "  - {type: expression, joint: arm, force: \"-3*lag - 0.1*velocity.arm\"}\n"

KT_TEST(rates_and_forces_read_the_states_in_the_data) {
    kt_parsed m;
    kt_error error;
    const double q = 0.7, v = -1.3, t = 2.0;
    double a, rates[2] = {-1.0, -1.0};
    kt_parsed_make(&m, ARM STATES);
    double *x = kt_auxiliary_states(m.model, m.data);
    kt_check_equal_int("states", kt_auxiliary_state_count(m.model), 2);
    kt_check_text("name", kt_auxiliary_state_name(m.model, 1), "way");
    kt_check_equal_int("found", kt_auxiliary_state_find(m.model, "way"), 1);
    kt_check_equal_int("not found", kt_auxiliary_state_find(m.model, "away"), -1);
    kt_check_near("initial", x[0], 0.5, 0.0);
    x[0] = 0.25;
    x[1] = 9.0;
    (void)kt_fine("rates", kt_auxiliary_state_rates(m.model, m.data, t, &q, &v, rates, &error), &error);
    kt_check_near("(q - x)/T", rates[0], (q - 0.25) / 0.2, 4.0 * DBL_EPSILON);
    kt_check_near("vx + x t", rates[1], -v * sin(q) + 0.25 * t, 4.0 * DBL_EPSILON);
    (void)kt_fine("acceleration", kt_acceleration_evaluate(m.model, m.data, t, &q, &v, NULL, NULL, &a, &error), &error);
    kt_check_near("(torque - weight)/J", a, (-3.0 * 0.25 - 0.1 * v - 9.81 * 0.5 * cos(q)) * 3.0, 64.0 * DBL_EPSILON);
    x[0] = (double)NAN;
    rates[0] = 7.0;
    kt_check_equal_int("a rate of NaN", kt_auxiliary_state_rates(m.model, m.data, t, &q, &v, rates, &error),
                       KT_ERROR_NOT_FINITE);
    kt_check_contains("it is named", error.where, "state 'lag'");
    kt_check_near("untouched", rates[0], 7.0, 0.0);
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

enum { RECORDS = 300, NUMBERS = 4 };

typedef struct records {
    int count, stop;
    double y[RECORDS][NUMBERS]; /* q, v, x */
} records;

static int keep(const kt_record *record, void *user) {
    records *r = user;
    const double y[NUMBERS] = {record->q[0], record->v[0], record->x[0], record->x[1]};
    if (r->count == RECORDS)
        return -1;
    memcpy(r->y[r->count], y, sizeof y);
    return ++r->count == r->stop ? -1 : 0;
}

static kt_run run_by(const char *method, double step) {
    kt_run run = kt_run_fixed(method, step, 2.0);
    run.interval = 0.0137;
    run.relative = 1e-9;
    run.absolute = 1e-11;
    return run;
}

static const struct {
    const char *name;
    double step;
} methods[] = {{"dopri5", 0.0},  {"dop853", 0.0},    {"rkc2", 0.0},           {"radau5", 0.0},
               {"rodas5p", 0.0}, {"auto", 0.0},      {"rk4", 1e-3},           {"ab4", 1e-3},
               {"bdf2", 1e-3},   {"two-step", 1e-3}, {"implicit-euler", 1e-3}};

KT_TEST(run_goes_on_from_a_checkpoint_with_the_same_bits) {
    kt_parsed m;
    kt_parsed_make(&m, ARM STATES);
    for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
        const kt_run run = run_by(methods[k].name, methods[k].step);
        kt_note("%s", methods[k].name);
        kt_check_equal_int("records", kt_resumption_check(&(kt_resumption){.model = m.model, .run = &run}, 60), 147);
    }
}

/* Between steps, too. */
KT_TEST(records_have_the_states_of_the_motion) {
    static records fine, coarse;
    kt_parsed m;
    kt_parsed_make(&m, ARM STATES);
    kt_run run = run_by("dop853", 0.0);
    run.relative = 1e-13;
    kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
    fine = (records){.count = 0};
    kt_test_run(s, keep, &fine);
    for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
        /* Errors of the state: the tolerance of adaptive methods, or h^p of fixed steps, times the growth of some 1000.
         * That of implicit-euler, 0.1, would show nothing. */
        const char *name = methods[k].name;
        const bool first = strcmp(name, "implicit-euler") == 0,
                   second = strcmp(name, "bdf2") == 0 || strcmp(name, "two-step") == 0 || strcmp(name, "rkc2") == 0;
        if (first)
            continue;
        const double bound = second ? 3e-4 : methods[k].step > 0.0 ? 1e-8 : 1e-6;
        kt_worst worst = {.what = methods[k].name};
        run = run_by(methods[k].name, methods[k].step);
        s = kt_test_simulation(m.model, &run, NULL);
        coarse = (records){.count = 0};
        kt_test_run(s, keep, &coarse);
        kt_check_equal_int("records", coarse.count, fine.count);
        for (int i = 0; i < fine.count && i < coarse.count; i++)
            for (int c = 0; c < NUMBERS; c++)
                kt_worst_near(&worst, coarse.y[i][c], fine.y[i][c], bound, "%d.%d", i, c);
        kt_check_worst(&worst);
    }
}

/* The balance is computed by other equations besides, which must not move a bit. */
KT_TEST(balance_moves_no_bit_and_closes) {
    static records without, with;
    kt_parsed m;
    kt_error error;
    kt_parsed_make(&m, ARM STATES);
    kt_run run = run_by("dopri5", 0.0);
    kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
    without = with = (records){.count = 0};
    kt_test_run(s, keep, &without);
    run.record = KT_RECORD_BALANCE | KT_RECORD_STATE;
    s = kt_test_simulation(m.model, &run, NULL);
    kt_record start, last;
    (void)kt_fine("start", kt_simulation_sense(s, &start, &error), &error);
    kt_test_run(s, keep, &with);
    (void)kt_fine("end", kt_simulation_sense(s, &last, &error), &error);
    kt_check_equal_bits("motion", with.y[0], without.y[0], NUMBERS * (size_t)without.count);
    kt_check_near("energy", last.kinetic + last.potential + last.work.dissipated - last.work.supplied,
                  start.kinetic + start.potential, 1e-7);
}

KT_TEST(states_are_set_and_start_anew) {
    kt_parsed m;
    kt_error error;
    kt_parsed_make(&m, ARM STATES);
    const kt_run run = run_by("dopri5", 0.0);
    kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
    const double *x = kt_simulation_auxiliary_states(s), set[2] = {2.0, 3.0}, wrong[2] = {0.0, HUGE_VAL}, q = 0.1;
    double before[3];
    kt_test_advance(s, 0.5);
    kt_check_true("they have moved", x[0] != 0.5 && x[1] != 0.0);
    memcpy(before, kt_simulation_positions(s), 2 * sizeof *before);
    kt_check_equal_int("an infinity", kt_simulation_set_auxiliary_states(s, wrong, &error), KT_ERROR_NOT_FINITE);
    kt_check_contains("is named", error.where, "way");
    (void)kt_fine("set", kt_simulation_set_auxiliary_states(s, set, &error), &error);
    kt_check_equal_bits("states", x, set, 2);
    kt_check_equal_bits("positions and velocities stay", kt_simulation_positions(s), before, 2);
    kt_check_near("time", kt_simulation_time(s), 0.5, 0.0);
    (void)kt_fine("restart", kt_simulation_set_state(s, 0.0, &q, NULL, &error), &error);
    kt_check_near("initial", x[0], 0.5, 0.0);
    kt_check_near("initial", x[1], 0.0, 0.0);
}

/* x' = 1 from -0.3. The state passes zero at 0.3 s, to the rounding of the time. */
KT_TEST(event_and_rate_of_a_model_without_coordinates) {
    static const char text[] = "kinetree: 1\nbodies:\n  - {name: block, mass: 1}\n"
                               "states: {clock: {initial: -0.3, rate: \"1\"}, decay: {initial: 2, rate: \"-decay\"}}\n"
                               "simulate: {duration: 1, until: \"clock > 0\"}\n";
    kt_parsed m;
    kt_error error;
    kt_parsed_make(&m, text);
    kt_run run = run_by("dopri5", 0.0);
    run.relative = 1e-12;
    kt_simulation_options options = kt_simulation_options_default();
    kt_scene_watch *watch = NULL;
    options.events = kt_scene_event_room(&m.scene);
    kt_simulation *s = kt_test_simulation(m.model, &run, &options);
    (void)kt_fine("events", kt_scene_watch_create(&m.scene, m.model, s, NULL, 0, &watch, &error), &error);
    kt_test_advance(s, 1.0);
    kt_check_near("time", kt_simulation_time(s), 0.3, 4.0 * DBL_EPSILON);
    kt_check_near("decay", kt_simulation_auxiliary_states(s)[1], 2.0 * exp(-0.3), 1e-11); /* some tolerances */
    kt_scene_watch_free(watch);
}

KT_TEST(rate_that_is_not_finite_is_named_with_its_time) {
    static const char text[] = ARM "states: {x: {initial: 1, rate: \"-1/x\"}}\n"; /* sqrt(1 - 2 t) */
    kt_parsed m;
    kt_error error;
    kt_parsed_make(&m, text);
    const kt_run run = run_by("rk4", 0.5);
    kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
    const double zero = 0.0;
    (void)kt_fine("set", kt_simulation_set_auxiliary_states(s, &zero, &error), &error);
    kt_check_equal_int("status", kt_simulation_advance(s, 1.0, &error), KT_ERROR_NOT_FINITE);
    kt_check_contains("where", error.where, "state 'x'");
    kt_check_contains("time", error.where, "t = 0 s");
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

/* Pulses that begin and end while nothing else moves, in the formula of a force, of a rate, and as a factor of a
 * velocity. No stage of a long step would see them. The impulse is 10 N over 1 ms. The factor exp(-((t - 5)/w)^2)
 * multiplies the velocity by exp(w sqrt(pi)/2). */
KT_TEST(steps_end_where_formulas_of_forces_and_rates_begin) {
    static const char text[] =
        "kinetree: 1\nbodies:\n  - {name: block, joint: {type: prismatic, axis: x}, mass: 2}\n"
        "states: {level: {rate: \"step(t - 2.3) - step(t - 2.301) - 0.1*level\"}}\neffects:\n"
        "  - {type: expression, joint: block, force: \"10*step(t - 3)*(1 - step(t - 3.001)) - 0*velocity.block\"}\n"
        "  - {type: expression, joint: block, force: \"2*velocity.block*exp(-((t - 5)/0.01)^2)\"}\n";
    const double v = 10.0 * 0.001 / 2.0 * exp(0.01 * sqrt(acos(-1.0))), x = (1.0 - exp(-1e-4)) / 0.1 * exp(-0.5699);
    kt_parsed m;
    KT_WORST velocity = kt_worst_make("velocity"), level = kt_worst_make("level");
    kt_parsed_make(&m, text);
    for (size_t k = 0; k < sizeof methods / sizeof *methods; k++) {
        if (methods[k].step > 0.0)
            continue;
        kt_run run = run_by(methods[k].name, 0.0);
        run.duration = 8.0;
        kt_simulation *s = kt_test_simulation(m.model, &run, NULL);
        kt_test_advance(s, 8.0);
        const double bound =
            strcmp(methods[k].name, "rkc2") == 0 ? 1e-7 : 1e-9; /* errors of order 2 add up over many steps */
        kt_worst_near(&velocity, kt_simulation_velocities(s)[0], v, bound, "%s", methods[k].name);
        kt_worst_near(&level, kt_simulation_auxiliary_states(s)[0], x, bound, "%s", methods[k].name);
    }
}

static void rejects(const char *what, kt_status status, const kt_error *error) {
    kt_check_equal_int(what, status, KT_ERROR_UNSUPPORTED);
    kt_check_contains("it says why", error->message, "auxiliary states ('lag' is one)");
}

KT_TEST(what_does_not_know_auxiliary_states_says_so) {
    kt_parsed m;
    kt_error error = {0};
    kt_mode_watch *watch = NULL;
    kt_absolute *absolute = NULL;
    kt_constraint_formulation *formulation = NULL;
    kt_parsed_make(&m, ARM STATES);
    rejects("watch on modes", kt_mode_watch_create(m.model, &watch, &error), &error);
    rejects("absolute coordinates", kt_absolute_create(&m.scene.description, NULL, m.model, &absolute, &error), &error);
    const kt_constraint_formulation_options gauss =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 0.01);
    rejects("formulation", kt_constraint_formulation_create(m.model, &gauss, &formulation, &error), &error);
}
