/* Steps end at the breakpoints of functions of time and of a caller's own forces. No pulse between two breakpoints is
 * skipped, and a method keeps its order across jumps of accelerations.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <math.h>
#include <string.h>

/* ---- force on a box of 1 kg -------------------------------------------------------------------------------------- */

typedef struct pushed {
    kt_lone lone;
    kt_effect effect;
} pushed;

static void push_by(pushed *p, kt_effect_type type) {
    kt_lone_make(&p->lone, KT_JOINT_PRISMATIC, 1.0);
    p->effect = kt_effect_of(type, p->lone.body.name);
    p->lone.description.effects = &p->effect;
    p->lone.description.effect_count = 1;
}

/* Position and velocity at the end of a run. */
static bool run_to_end(const kt_model *model, const char *method, double duration, const kt_simulation_options *options,
                       double state[2], kt_simulation_counts *counts) {
    kt_run run = kt_run_default();
    kt_error error = {0};
    run.integrator = method;
    run.duration = duration;
    kt_simulation *simulation = kt_test_simulation(model, &run, options);
    const bool fine = kt_fine("runs", kt_simulation_advance(simulation, duration, &error), &error);
    state[0] = kt_simulation_positions(simulation)[kt_model_nq(model) - 1];
    state[1] = kt_simulation_velocities(simulation)[kt_model_nv(model) - 1];
    if (counts != NULL)
        *counts = kt_simulation_counts_of(simulation);
    return fine;
}

/* A triangle of height F and length 2 l gives the velocity F l, as if from its middle on. */
KT_TEST(pulse_of_two_milliseconds_after_a_rest_is_seen_by_every_method) {
    static const double rows[] = {0.0, 0.0, 5.0, 0.0, 5.001, 1000.0, 5.002, 0.0};
    pushed p;
    push_by(&p, KT_EFFECT_MOTOR);
    p.effect.torque = kt_function_table(rows, 8, KT_INTERPOLATION_LINEAR);
    kt_model *model = kt_scene_compile(&p.lone.description);
    KT_WORST x = kt_worst_make("position, m"), v = kt_worst_make("velocity, m/s");
    for (int m = 0; m < kt_method_count(); m++) {
        double state[2];
        const char *name = kt_method_at(m)->name;
        if (!kt_method_is_adaptive(kt_method_at(m)) || !run_to_end(model, name, 10.0, NULL, state, NULL))
            continue;
        kt_worst_near(&x, state[0], 4.999, 1e-8, "%s", name);
        kt_worst_near(&v, state[1], 1.0, 1e-10, "%s", name);
    }
}

/* The box slides along one axis, and the force has its pulse in this component alone. */
KT_TEST(pulse_in_any_component_of_a_force_is_seen) {
    static const double rows[] = {0.0, 0.0, 5.0, 0.0, 5.001, 1000.0, 5.002, 0.0};
    KT_WORST v = kt_worst_make("velocity, m/s");
    for (int k = 0; k < 3; k++) {
        pushed p;
        double state[2];
        push_by(&p, KT_EFFECT_FORCE);
        p.lone.body.joint.axis = kt_vec3_make(k == 0, k == 1, k == 2);
        p.effect.joint = NULL;
        p.effect.between[0].body = p.lone.body.name;
        for (int i = 0; i < 3; i++)
            p.effect.value[i] =
                i == k ? kt_function_table(rows, 8, KT_INTERPOLATION_LINEAR) : kt_function_constant(0.0);
        if (run_to_end(kt_scene_compile(&p.lone.description), "dopri5", 10.0, NULL, state, NULL))
            kt_worst_near(&v, state[1], 1.0, 1e-10, "component %d", k);
    }
}

/* A bump begins and ends with zero, where heun has its stages. A pulse with smooth flanks lies in the last quarter of a
 * step, where rkc4 has no stage. Velocities are the areas: 16/35 of height times length, and height times length. */
KT_TEST(pulses_that_stages_lie_around_are_seen_by_every_method) {
    static const double tail = 0.02;
    const kt_function functions[] = {
        kt_function_bump(100.0, 7.3, 7.32),
        kt_function_expression("1000/(1 + exp(500*(7 - t))) - 1000/(1 + exp(500*(7.01 - t)))")};
    const double areas[] = {16.0 / 35.0 * 100.0 * tail, 10.0};
    KT_WORST v = kt_worst_make("velocity over the area");
    for (int k = 0; k < 2; k++) {
        pushed p;
        push_by(&p, KT_EFFECT_MOTOR);
        p.effect.torque = functions[k];
        kt_model *model = kt_scene_compile(&p.lone.description);
        for (int m = 0; m < kt_method_count(); m++) {
            double state[2];
            const char *name = kt_method_at(m)->name;
            if (kt_method_is_adaptive(kt_method_at(m)) && run_to_end(model, name, 10.0, NULL, state, NULL))
                kt_worst_near(&v, state[1] / areas[k], 1.0, 1e-6, "%s, pulse %d", name, k);
        }
    }
}

/* A sine of 50 periods a second under the tolerance: where steps grow they are a quarter of a period at most. */
KT_TEST(steps_are_a_quarter_of_a_sine_at_most) {
    pushed p;
    double state[2];
    kt_simulation_counts counts;
    push_by(&p, KT_EFFECT_MOTOR);
    p.effect.torque = kt_function_sine(1e-12, 50.0, 0.0, 0.0);
    kt_model *model = kt_scene_compile(&p.lone.description);
    if (run_to_end(model, "dopri5", 1.0, NULL, state, &counts)) {
        kt_check_above("steps", (double)counts.steps, 200.0);
        kt_check_below("steps", (double)counts.steps, 210.0);
    }
}

static int ignore(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}

/* Fixed steps of 0.1 s: a pulse of 2 ms lies between two stages, and a record of every millisecond shows it. A pulse of
 * 1 ms with a stage in each of its halves is accepted, and so is a ramp of 3 s. */
static void check_fixed(kt_function function, double step, kt_status expected) {
    pushed p;
    kt_error error = {0};
    kt_run run = kt_run_fixed("rk4", step, 8.0);
    run.interval = 1e-3;
    push_by(&p, KT_EFFECT_MOTOR);
    p.effect.torque = function;
    kt_model *model = kt_scene_compile(&p.lone.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    if (kt_check_equal_int("status", kt_simulation_run(simulation, ignore, NULL, &error), expected) &&
        expected != KT_OK) {
        kt_check_contains("when", error.message, "between breakpoints at 5 and 5.001 s");
        kt_check_contains("remedy", error.message, "take a smaller step, or an adaptive method");
    }
}

KT_TEST(record_of_a_pulse_that_no_fixed_step_has_seen_is_rejected) {
    static const double rows[] = {0.0, 0.0, 5.0, 0.0, 5.001, 1000.0, 5.002, 0.0};
    const kt_function short_pulse = kt_function_table(rows, 8, KT_INTERPOLATION_LINEAR);
    check_fixed(short_pulse, 0.1, KT_ERROR_STEP);
    check_fixed(short_pulse, 1e-3, KT_OK);
    check_fixed(kt_function_ramp(0.0, 1.0, 2.0, 5.0), 0.1, KT_OK);
}

/* ---- a caller's own ---------------------------------------------------------------------------------------------- */

/* The force is 1 N from 7 s to 7.01 s. */
static int pulse(void *user, double t, double q, double v, double *force, kt_effect_balance *balance) {
    (void)user, (void)q, (void)v, (void)balance;
    *force = t >= 7.0 && t < 7.01 ? 1.0 : 0.0;
    return 0;
}
static double breakpoint_of_pulse(void *user, double t) {
    (void)user;
    return t < 7.0 ? 7.0 : t < 7.01 ? 7.01 : HUGE_VAL;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): as the callback has it */
static int jump_in_equations(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    (void)rate, (void)error;
    return pulse(user, at->t, 0.0, 0.0, a, NULL);
}

/* The force jumps. Both of its limits are taken, one where a step ends and one where the next begins. Therefore
 * polynomials of degree 2 are integrated to rounding. */
static void check_pulse(const kt_model *model, const kt_simulation_options *options, const char *method) {
    double state[2];
    if (!run_to_end(model, method, 10.0, options, state, NULL))
        return;
    kt_check_near("position, m", state[0], 0.5e-4 + 0.01 * 2.99, 1e-14);
    kt_check_near("velocity, m/s", state[1], 0.01, 1e-14);
}

KT_TEST(breakpoints_of_a_callers_effect_are_where_steps_end) {
    static const char *const methods[] = {"dopri5", "dop853", "rodas5p", "radau5", "auto"};
    pushed p;
    push_by(&p, KT_EFFECT_CUSTOM);
    p.effect.joint_force = pulse;
    p.effect.breakpoint = breakpoint_of_pulse;
    kt_model *model = kt_scene_compile(&p.lone.description);
    for (size_t i = 0; i < sizeof methods / sizeof methods[0]; i++)
        check_pulse(model, NULL, methods[i]);
}

KT_TEST(breakpoints_of_a_callers_equations_are_where_steps_end) {
    kt_lone lone;
    kt_simulation_options options = kt_simulation_options_default();
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
    options.acceleration = jump_in_equations;
    options.breakpoint = breakpoint_of_pulse;
    kt_model *model = kt_scene_compile(&lone.description);
    check_pulse(model, &options, "dopri5");
}

/* Without the query, the method misses the pulse. The option max_step exists for this case. */
KT_TEST(max_step_of_a_run_bounds_steps) {
    pushed p;
    double state[2] = {0.0, 0.0};
    kt_run run = kt_run_default();
    push_by(&p, KT_EFFECT_CUSTOM);
    p.effect.joint_force = pulse;
    kt_model *model = kt_scene_compile(&p.lone.description);
    if (run_to_end(model, "dopri5", 10.0, NULL, state, NULL))
        kt_check_near("nothing was seen, m/s", state[1], 0.0, 0.0);
    run.max_step = 5e-3;
    run.integrator = "dopri5";
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_advance(simulation, 10.0);
    /* At a jump in the midst of a step an embedded estimate is some 70 times less than the error. */
    kt_check_near("velocity, m/s", kt_simulation_velocities(simulation)[0], 0.01, 1.5e-7);
    kt_check_above("steps", (double)kt_simulation_counts_of(simulation).steps, 2000.0);
}

/* ---- a drive whose acceleration jumps ---------------------------------------------------------------------------- */

/* A trolley goes 4 m from 5 s to 8 s, along a ramp. A mass of 1 kg hangs on it by a spring of 4 N/m and follows.
 *     x'' = 4 (f(t) - x),   f = c2 u^2 + c3 u^3,   u = t - 5,
 * and with w = 2 the solution from rest is
 *     x = c2 (u^2 - 2 (1 - cos w u) / w^2) + c3 (u^3 - 6 (u - sin(w u) / w) / w^2). */
static double follower(double u) {
    const double w = 2.0, c2 = 12.0 / 9.0, c3 = -8.0 / 27.0;
    return c2 * (u * u - 2.0 * (1.0 - cos(w * u)) / (w * w)) + c3 * (u * u * u - 6.0 * (u - sin(w * u) / w) / (w * w));
}

typedef struct towed {
    kt_body bodies[2];
    kt_loop loop;
    kt_effect spring;
    kt_description description;
} towed;

static kt_model *make_towed(towed *t) {
    memset(t, 0, sizeof *t);
    for (int i = 0; i < 2; i++) {
        t->bodies[i] = kt_body_default();
        t->bodies[i].joint.type = KT_JOINT_PRISMATIC;
        t->bodies[i].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        t->bodies[i].mass = 1.0;
    }
    t->bodies[0].name = "trolley";
    t->bodies[1].name = "load";
    t->bodies[1].parent = "trolley";
    t->loop = kt_loop_of("drive", KT_LOOP_MOTION);
    t->loop.joint = "trolley";
    t->loop.function = kt_function_ramp(0.0, 4.0, 5.0, 8.0);
    t->spring = kt_effect_of(KT_EFFECT_JOINT_SPRING, "load");
    t->spring.stiffness = 4.0;
    t->description = kt_description_of(t->bodies, 2, &t->loop, 1, &t->spring, 1);
    return kt_scene_compile(&t->description);
}

/* The load's position in the trolley, x - f. Both slopes of f'' at a breakpoint are taken from inside the steps. The
 * error is that of the smooth pieces, a few tolerances, and few steps are rejected there. */
KT_TEST(method_keeps_its_error_where_a_drive_begins_and_ends) {
    towed t;
    kt_model *model = make_towed(&t);
    KT_WORST error = kt_worst_make("position, m");
    for (int m = 0; m < kt_method_count(); m++) {
        double state[2];
        kt_simulation_counts counts;
        const kt_method *method = kt_method_at(m);
        if (!kt_method_is_adaptive(method) || method->order < 4 ||
            !run_to_end(model, method->name, 8.0, NULL, state, &counts))
            continue;
        kt_worst_near(&error, state[0], follower(3.0) - 4.0, 5e-9, "%s", method->name);
        kt_check_below(method->name, (double)counts.rejected, 15.0);
    }
}

/* ---- a drive whose speed jumps ----------------------------------------------------------------------------------- */

/* The load's speed in the trolley: 0 until the trolley halts at 2 s, then that of x = sin(2 u) / 2, u = t - 2. The
 * record at 2 s has one of both. */
static int compare_speed(const kt_record *record, void *user) {
    kt_worst *error = user;
    const bool is_before = record->t < 2.0 - 1e-9 || (record->t < 2.0 + 1e-9 && fabs(record->v[1]) < 0.5);
    kt_worst_near(error, record->v[1], is_before ? 0.0 : cos(2.0 * (record->t - 2.0)), 2e-8, "%g s", record->t);
    return 0;
}

/* The trolley moves at 1 m/s and halts. Functions of time have the slope before the halt, the slope after it, or
 * neither at that instant. Records before the halt are those of the motion, too. */
KT_TEST(load_swings_on_where_the_speed_of_a_drive_jumps) {
    static const double rows[] = {0.0, 0.0, 2.0, 2.0, 9.0, 2.0};
    const kt_function halts[] = {kt_function_table(rows, 4, KT_INTERPOLATION_LINEAR),
                                 kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR),
                                 kt_function_table(rows, 4, KT_INTERPOLATION_MONOTONE),
                                 kt_function_expression("min(t, 2)"), kt_function_expression("1 + t/2 - abs(t - 2)/2")};
    for (size_t k = 0; k < sizeof halts / sizeof *halts; k++) {
        towed t;
        (void)make_towed(&t);
        t.loop.function = halts[k];
        kt_model *model = kt_scene_compile(&t.description);
        KT_WORST error = kt_worst_make("speed, m/s");
        for (int m = 0; m < kt_method_count(); m++) {
            kt_run run = kt_run_default();
            kt_error fault = {0};
            run.integrator = kt_method_at(m)->name;
            run.duration = 4.0;
            run.interval = 0.25;
            if (!kt_method_is_adaptive(kt_method_at(m)) || kt_method_at(m)->order < 3)
                continue;
            kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
            kt_fine("runs", kt_simulation_run(simulation, compare_speed, &error, &fault), &fault);
        }
    }
}

/* The steps of 0.03 s have no point of their grid at the halt, and one ends there. Adams' method begins anew there. */
KT_TEST(fixed_steps_end_where_the_speed_of_a_drive_jumps) {
    static const char *const methods[] = {"rk4", "dopri5", "radau5", "ab4"};
    static const double rows[] = {0.0, 0.0, 0.4, 1.3, 2.0, 2.0}, bound[] = {2e-6, 3e-8, 2e-8, 2e-5};
    const kt_function halts[] = {kt_function_table(rows, 6, KT_INTERPOLATION_LINEAR),
                                 kt_function_expression("min(t, 2)")};
    for (size_t k = 0; k < sizeof halts / sizeof *halts; k++) {
        towed t;
        (void)make_towed(&t);
        t.loop.function = halts[k];
        kt_model *model = kt_scene_compile(&t.description);
        for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
            /* the sum of -jump sin(2 (t - its time)) / 2 over the jumps of the trolley */
            const double expected = k == 0 ? 2.8125 * sin(7.2) / 2.0 + 0.4375 * sin(4.0) / 2.0 : sin(4.0) / 2.0;
            kt_simulation *simulation = kt_scene_start(model, methods[m], 0.03, KT_RECORD_BALANCE);
            const double start = kt_scene_balance(simulation);
            kt_note("%s", methods[m]);
            kt_test_advance(simulation, 3.99);
            kt_check_equal_int("steps", (long long)kt_simulation_counts_of(simulation).steps, k == 0 ? 135 : 134);
            kt_test_advance(simulation, 4.0);
            kt_check_near("load, m", kt_simulation_positions(simulation)[1], expected, bound[m]);
            kt_check_near("balance, J", kt_scene_balance(simulation), start, bound[m]);
            kt_check_below("correction", kt_simulation_velocity_correction(simulation).share, 1e-12);
        }
    }
}

/* The search ends 1000 steps after it began. The halt comes there, or next to it. A first jump, from 2 m/s to 1 m/s,
 * may begin the search within a step. */
KT_TEST(fixed_steps_find_jumps_where_their_searches_end) {
    static const double first[] = {0.0, 0.0005}, halt[] = {0.9995, 1.0, 1.0003, 1.0007, 1.001, 2.0};
    KT_WORST load = kt_worst_make("load, m"), balance = kt_worst_make("balance, J");
    for (int k = 0; k < 12; k++) {
        const double a = first[k % 2], T = halt[k / 2], place = 2.0 * a + T - a;
        const double rows[] = {0.0, 0.0, a, 2.0 * a, T, place, 9.0, place};
        const double expected = 0.5 * sin(1.0) + (a > 0.0 ? 0.5 * sin(2.0 * (T + 0.5 - a)) : 0.0);
        towed t;
        (void)make_towed(&t);
        t.loop.function = a > 0.0 ? kt_function_table(rows, 8, KT_INTERPOLATION_LINEAR)
                                  : kt_function_table(rows + 2, 6, KT_INTERPOLATION_LINEAR);
        kt_model *model = kt_scene_compile(&t.description);
        kt_simulation *simulation = kt_scene_start(model, "rk4", 0.001, KT_RECORD_BALANCE);
        const double start = kt_scene_balance(simulation);
        kt_test_advance(simulation, T + 0.5);
        kt_worst_near(&load, kt_simulation_positions(simulation)[1], expected, 1e-11, "%g s and %g s", a, T);
        kt_worst_near(&balance, kt_scene_balance(simulation), start, 1e-9, "%g s and %g s", a, T);
    }
}

/* A caller's projection of the trolley, whose halt moves the load's momentum. It fails once behind the halt. */
static int halt_once(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error, void *user) {
    int *failures = user;
    const double speed = at->t < 2.0 ? 1.0 : 0.0;
    (void)error;
    if (at->t > 2.0 && *failures == 0) {
        ++*failures;
        return -7;
    }
    q[0] = fmin(at->t, 2.0);
    v[1] += v[0] - speed;
    v[0] = speed;
    *changed = true;
    return 0;
}

/* The call fails at the halt. The next one tries the jump again. */
KT_TEST(jump_of_a_drive_that_fails_is_tried_again) {
    static const double rows[] = {0.0, 0.0, 2.0, 2.0};
    towed t;
    int failures = 0;
    kt_error error = {0};
    kt_simulation_options options = kt_simulation_options_default();
    kt_run run = kt_run_default();
    (void)make_towed(&t);
    t.loop.function = kt_function_table(rows, 4, KT_INTERPOLATION_LINEAR);
    kt_model *model = kt_scene_compile(&t.description);
    options.projection = halt_once;
    options.user = &failures;
    run.integrator = "dop853";
    run.relative = run.absolute = 1e-10;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_check_equal_int("fails", kt_simulation_advance(simulation, 4.0, &error), KT_ERROR_CALLBACK);
    kt_check_near("time", kt_simulation_time(simulation), 2.0, 1e-12);
    kt_test_advance(simulation, 4.0);
    kt_check_near("trolley, m/s", kt_simulation_velocities(simulation)[0], 0.0, 0.0);
    kt_check_near("load, m/s", kt_simulation_velocities(simulation)[1], cos(4.0), 1e-7);
}

/* The drive takes the kinetic energy of the trolley, 1 kg (1 m/s)^2 / 2, when it halts. The load keeps its own. */
KT_TEST(drive_supplies_the_change_of_energy_where_its_speed_jumps) {
    static const double rows[] = {0.0, 0.0, 2.0, 2.0};
    static const char *const methods[] = {"dopri5", "radau5", "dop853"};
    towed t;
    (void)make_towed(&t);
    t.loop.function = kt_function_table(rows, 4, KT_INTERPOLATION_LINEAR);
    kt_model *model = kt_scene_compile(&t.description);
    for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
        kt_simulation *simulation = kt_scene_start(model, methods[m], 0.0, KT_RECORD_BALANCE);
        const double start = kt_scene_balance(simulation);
        kt_note("%s", methods[m]);
        kt_test_advance(simulation, 4.0);
        kt_check_near("balance, J", kt_scene_balance(simulation), start, 1e-8);
        kt_check_near("supplied, J", kt_simulation_work(simulation).supplied, -0.5, 1e-8);
    }
}

/* The slope of the formula changes its sign where that of abs is 0, and takes another branch within rounding. The drive
 * changes its speed from -5/2 to 7/2, and supplies 3 J to the trolley. */
KT_TEST(drive_supplies_the_change_of_energy_where_its_direction_changes) {
    static const char *const methods[] = {"dopri5", "radau5", "rk4"};
    static const char *const formulas[] = {"3*abs(t - 0.5) + t/2", "3*abs(t - 0.41234) + t/2", "t/2 + abs(3*t - 1.1)"};
    towed t;
    for (size_t i = 0; i < sizeof formulas / sizeof *formulas; i++) {
        (void)make_towed(&t);
        t.description.body_count = 1;
        t.description.effect_count = 0;
        t.loop.function = kt_function_expression(formulas[i]);
        kt_model *model = kt_scene_compile(&t.description);
        for (size_t m = 0; m < sizeof methods / sizeof *methods; m++) {
            kt_simulation *simulation = kt_scene_start(model, methods[m], m == 2 ? 0.003 : 0.0, KT_RECORD_BALANCE);
            kt_note("%s, %s", formulas[i], methods[m]);
            kt_test_advance(simulation, 1.0);
            kt_check_near("supplied, J", kt_simulation_work(simulation).supplied, 3.0, 1e-12);
        }
    }
}

/* ---- checkpoints, ticks ------------------------------------------------------------------------------------------ */

/* Saved in the midst of the ramp, and at its start, where a step ends. */
KT_TEST(restored_run_has_the_same_bits_at_breakpoints) {
    towed t;
    kt_run run = kt_run_default();
    kt_model *model = make_towed(&t);
    run.integrator = "dopri5";
    kt_simulation *first = kt_test_simulation(model, &run, NULL), *second = kt_test_simulation(model, &run, NULL);
    for (int k = 0; k < 2; k++) {
        const double when = k == 0 ? 5.0 : 6.5;
        kt_test_advance(first, when);
        kt_need(kt_scene_hand_over(first, second));
        kt_test_advance(first, when + 0.7);
        kt_test_advance(second, when + 0.7);
        kt_scene_check_equal("state", second, first);
    }
}

/* Records in the step that ended before a checkpoint come after it, and need that step's slopes at breakpoints. */
KT_TEST(records_after_a_checkpoint_have_the_same_bits_in_a_step_from_a_breakpoint) {
    towed t;
    kt_run run = kt_run_default();
    kt_model *model = make_towed(&t);
    run.integrator = "dopri5";
    run.duration = 8.0;
    run.interval = 0.02;
    run.relative = run.absolute = 1e-3; /* long steps */
    for (int stop = 249; stop < 262; stop++)
        kt_check_equal_int("records", kt_resumption_check(&(kt_resumption){.model = model, .run = &run}, stop), 401);
}

/* The searches of a run share their operations. A resumed run has no more of them, and therefore cuts the same ones. */
KT_TEST(restored_run_cuts_the_same_searches) {
    pushed p;
    kt_run run = kt_run_default();
    push_by(&p, KT_EFFECT_MOTOR);
    p.effect.torque =
        kt_function_expression("-1.439*sqrt(1 + (10.23*sin(134.7*t + 3.07))^2) + -4.332*1/(1 + (0.6895*sin(11.06*t + "
                               "1.34) + 16.5*(t - 5.9902))^2) + 3.131*tanh(976.84*(t - 7.6522))*exp(-(8.9389*(t - "
                               "9.1834))^2) + -0.3038*log(cosh(374.22*(t - 6.2779)))");
    kt_model *model = kt_scene_compile(&p.lone.description);
    kt_simulation *first = kt_test_simulation(model, &run, NULL), *second = kt_test_simulation(model, &run, NULL);
    kt_test_advance(first, 0.2);
    const uint64_t before = kt_simulation_counts_of(first).cut;
    (void)kt_scene_hand_over(first, second);
    kt_test_advance(first, 1.0);
    kt_test_advance(second, 1.0);
    const kt_simulation_counts a = kt_simulation_counts_of(first), b = kt_simulation_counts_of(second);
    kt_check_above("cut before", (double)before, 10.0);
    kt_check_above("cut behind", (double)(a.cut - before), 10.0);
    kt_check_equal_int("cut in the restored run", (long)b.cut, (long)a.cut);
    kt_check_equal_int("breakpoints of the restored run", (long)b.breakpoints, (long)a.breakpoints);
    kt_scene_check_equal("state", second, first);
}
