/* The energy balance: kinetic + potential + dissipated - supplied is constant, and each of the two works has its
 * correct value. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "formulation.h"
#include "scenes.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { EFFECTS = 3 };

/* A block that slides along x: m x'' = -k x - c x' + F sin(w t). */
typedef struct oscillator {
    kt_lone lone;
    kt_effect effects[EFFECTS];
    double m, k, c, amplitude, w;
} oscillator;

static void oscillator_make(oscillator *o, double amplitude) {
    *o = (oscillator){.m = 1.3, .k = 40.0, .c = 0.9, .amplitude = amplitude, .w = 7.0};
    kt_lone_make(&o->lone, KT_JOINT_PRISMATIC, o->m);
    o->effects[0] = kt_effect_of(KT_EFFECT_SPRING, NULL);
    o->effects[0].between[1].body = "block";
    o->effects[0].stiffness = o->k;
    o->effects[0].length = 0.0;
    o->effects[0].initial_length = false;
    o->effects[1] = kt_effect_of(KT_EFFECT_JOINT_DAMPER, "block");
    o->effects[1].damping = o->c;
    o->effects[2] = kt_effect_of(KT_EFFECT_MOTOR, "block");
    o->effects[2].torque = kt_function_sine(amplitude, o->w / 6.283185307179586, 0.0, 0.0);
    o->lone.description.effects = o->effects;
    o->lone.description.effect_count = amplitude == 0.0 ? 2 : 3;
}

static kt_run balanced(const char *integrator, double step, double duration) {
    kt_run run = kt_run_fixed(integrator, step, duration);
    run.record = KT_RECORD_POSITION | KT_RECORD_BALANCE;
    return run;
}

/* Runs with records every `run->interval`. */
static void keep_ledger_of(const kt_model *model, const kt_absolute *absolute, const kt_run *run, kt_ledger *l) {
    *l = (kt_ledger){.count = 0};
    kt_either_test_run(kt_either_begin(model, absolute, run, NULL), kt_ledger_enter, l);
    kt_need(kt_check_true("there are records", l->count > 1));
}

static void keep_ledger(const kt_model *model, const kt_run *run, kt_ledger *l) { keep_ledger_of(model, NULL, run, l); }

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

typedef struct compared {
    const oscillator *o;
    double x0;
    kt_worst dissipated, supplied;
} compared;

/* x = x0 e^(-g t) (cos w t + g / w sin w t), w^2 = k/m - g^2, g = c / 2m. The lost energy is heat. */
static int compare_free(const kt_record *r, void *user) {
    compared *it = user;
    const oscillator *o = it->o;
    const double g = 0.5 * o->c / o->m, w0 = o->k / o->m, w = sqrt(w0 - g * g), t = r->t, fade = exp(-g * t);
    const double x = it->x0 * fade * (cos(w * t) + g / w * sin(w * t)), v = -it->x0 * fade * w0 / w * sin(w * t);
    const double heat = 0.5 * o->k * (it->x0 * it->x0 - x * x) - 0.5 * o->m * v * v;
    kt_worst_near(&it->dissipated, r->work.dissipated, heat, 2e-11, "t = %g", t);
    kt_worst_near(&it->supplied, r->work.supplied, 0.0, 0.0, "t = %g", t);
    return 0;
}

/* In the steady state x = X sin(w t - f), and with s = f + pi/2 - ... the works follow from
 *     F sin(a) X w cos(a - f) = F X w (sin(2 a - f) + sin f) / 2,     c (X w cos(a - f))^2. */
static int compare_driven(const kt_record *r, void *user) {
    compared *it = user;
    const oscillator *o = it->o;
    const double w = o->w, t = r->t, real = o->k - o->m * w * w, imaginary = o->c * w;
    const double x = o->amplitude / sqrt(real * real + imaginary * imaginary), f = atan2(imaginary, real);
    const double in = 0.5 * o->amplitude * x * (w * t * sin(f) - 0.5 * (cos(2.0 * w * t - f) - cos(f)));
    const double out = 0.5 * o->c * x * x * w * (w * t + 0.5 * (sin(2.0 * (w * t - f)) + sin(2.0 * f)));
    kt_worst_near(&it->supplied, r->work.supplied, in, 2e-10, "t = %g", t);
    kt_worst_near(&it->dissipated, r->work.dissipated, out, 2e-10, "t = %g", t);
    return 0;
}

static void compare(const oscillator *o, double x0, double v0, kt_recorder *recorder) {
    kt_error error;
    kt_run run = balanced("dop853", 0.0, 5.0);
    run.relative = run.absolute = 1e-12;
    compared it = {o, x0, kt_worst_make("heat"), kt_worst_make("work of the drive")};
    kt_model *model = kt_scene_compile(&o->lone.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_need_fine("state", kt_simulation_set_state(simulation, 0.0, &x0, &v0, &error), &error);
    kt_test_run(simulation, recorder, &it);
    kt_check_worst(&it.dissipated);
    kt_check_worst(&it.supplied);
}

KT_TEST(heat_of_a_damped_oscillator_is_that_of_the_closed_form) {
    oscillator o;
    oscillator_make(&o, 0.0);
    compare(&o, 0.3, 0.0, compare_free);
}

KT_TEST(works_begin_at_zero_where_a_state_is_set) {
    oscillator o;
    kt_ledger ledger = {.count = 0};
    kt_error error;
    const double x = 0.2, v = 0.0;
    oscillator_make(&o, 11.0);
    const kt_run run = balanced("dop853", 0.0, 2.0);
    kt_model *model = kt_scene_compile(&o.lone.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_run(simulation, kt_ledger_enter, &ledger);
    kt_check_above("dissipated before, J", kt_simulation_work(simulation).dissipated, 1e-3);
    kt_need_fine("state", kt_simulation_set_state(simulation, 0.0, &x, &v, &error), &error);
    kt_check_true("nothing dissipated", kt_simulation_work(simulation).dissipated == 0.0);
    kt_check_true("nothing supplied", kt_simulation_work(simulation).supplied == 0.0);
}

KT_TEST(works_of_a_driven_oscillator_are_those_of_the_closed_form) {
    oscillator o;
    oscillator_make(&o, 11.0);
    const double real = o.k - o.m * o.w * o.w, imaginary = o.c * o.w;
    const double x = o.amplitude / sqrt(real * real + imaginary * imaginary), f = atan2(imaginary, real);
    compare(&o, -x * sin(f), x * o.w * cos(f), compare_driven);
}

/* A torque on a pendulum that turns by an angle, and a force on its bob. The works are tau dq and F . dr for any
 * motion. */
KT_TEST(held_torques_and_wrenches_supply_force_times_way) {
    kt_lone pendulum;
    kt_error error;
    const double torque = 1.7;
    const kt_wrench wrenches[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.3, -0.2, 0.45}, {2.0, -1.0, 3.0}}};
    kt_pendulum_make(&pendulum, 0.4, 1.0);
    kt_run run = balanced("dop853", 0.0, 3.0);
    run.relative = run.absolute = 1e-12;
    kt_model *model = kt_scene_compile(&pendulum.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    const double bound = 16.0 * DBL_EPSILON; /* the two are the same sums but for rounding */
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, &torque, &error), &error);
    kt_test_advance(simulation, 1.0);
    const double turned = kt_simulation_positions(simulation)[0] - 0.4;
    kt_check_near("torque", kt_simulation_work(simulation).supplied, torque * turned, bound);
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, NULL, &error), &error);
    (void)kt_fine("wrench", kt_simulation_set_wrenches(simulation, wrenches, &error), &error);
    kt_test_advance(simulation, 3.0);
    /* the wrench is about the joint's origin, which rests: only its moment about the axis does work */
    const double more = kt_simulation_positions(simulation)[0] - 0.4 - turned;
    kt_check_near("wrench", kt_simulation_work(simulation).supplied, torque * turned + 0.45 * more, bound);
}

KT_TEST(force_on_a_free_body_supplies_its_gain_of_energy) {
    kt_lone lone;
    kt_error error;
    kt_ledger l = {.count = 0};
    const kt_wrench wrenches[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.3, -0.2, 0.45}, {2.0, -1.0, 3.0}}};
    kt_lone_make(&lone, KT_JOINT_FREE, 2.0);
    lone.body.com = kt_vec3_make(0.1, -0.2, 0.05);
    kt_run run = balanced("dop853", 0.0, 2.0);
    run.relative = run.absolute = 1e-12;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    (void)kt_fine("wrench", kt_simulation_set_wrenches(simulation, wrenches, &error), &error);
    kt_test_run(simulation, kt_ledger_enter, &l);
    kt_check_above("supplied", l.last.supplied, 1.0);
    kt_check_below("drift", l.drift, 1e-10);
}

/* ---- order ------------------------------------------------------------------------------------------------------- */

KT_TEST(balance_closes_with_the_order_of_the_method) {
    static const struct {
        const char *name;
        double step, order;
    } methods[] = {{"euler", 1e-3, 1.0}, {"heun", 4e-3, 2.0},   {"kutta3", 1e-2, 3.0},
                   {"rk4", 1e-2, 4.0},   {"dopri5", 2e-2, 5.0}, {"tsit5", 2e-2, 5.0}};
    oscillator o;
    oscillator_make(&o, 11.0);
    kt_model *model = kt_scene_compile(&o.lone.description);
    for (size_t i = 0; i < sizeof methods / sizeof *methods && model; i++) {
        kt_ledger coarse, fine;
        kt_run run = balanced(methods[i].name, methods[i].step, 4.0);
        run.interval = methods[i].step; /* at the steps' ends */
        keep_ledger(model, &run, &coarse);
        run.step *= 0.5;
        keep_ledger(model, &run, &fine);
        kt_note("%s: %g J with h = %g, %g J with half of it", methods[i].name, coarse.drift, methods[i].step,
                fine.drift);
        /* methods of even order keep a linear oscillator's energy to one order more */
        kt_check_above(methods[i].name, log2(coarse.drift / fine.drift), methods[i].order - 0.3);
    }
}

KT_TEST(balance_closes_to_the_tolerance) {
    oscillator o;
    oscillator_make(&o, 11.0);
    kt_model *model = kt_scene_compile(&o.lone.description);
    static const char *const methods[] = {"dopri5", "tsit5", "dop853"};
    for (int i = 0; i < 3 && model; i++)
        /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
        for (double tolerance = 1e-5; tolerance > 1e-11; tolerance *= 1e-2) {
            kt_ledger l;
            kt_run run = balanced(methods[i], 0.0, 4.0);
            run.relative = run.absolute = tolerance;
            keep_ledger(model, &run, &l);
            kt_note("%s at %g", methods[i], tolerance);
            kt_check_below("drift, J", l.drift, 400.0 * tolerance); /* of some 30 J; measured: 49 to 176 tolerances */
        }
}

/* ---- what it costs ----------------------------------------------------------------------------------------------- */

/* Quaternions, so that something is projected; a spring, a damper and a drive. */
static kt_model *compile_tumbler(void) {
    static kt_body bodies[2];
    static kt_effect effects[3];
    for (int i = 0; i < 2; i++) {
        bodies[i] = kt_body_default();
        bodies[i].mass = 1.0;
        bodies[i].com = kt_vec3_make(0.5, 0.1, 0.0);
        bodies[i].inertia = kt_sym3_make(0.1, 0.2, 0.25, 0.0, 0.0, 0.0);
        bodies[i].joint.velocity[0] = 1.0;
    }
    bodies[0].name = "arm";
    bodies[0].joint.type = KT_JOINT_REVOLUTE;
    bodies[1].name = "ball";
    bodies[1].parent = "arm";
    bodies[1].joint.type = KT_JOINT_SPHERICAL;
    bodies[1].joint.at = kt_vec3_make(1.0, 0.0, 0.0);
    for (int i = 0; i < 3; i++)
        effects[i] = kt_effect_default();
    effects[0].type = KT_EFFECT_SPRING;
    effects[0].between[0].at = kt_vec3_make(0.0, 0.0, 1.5);
    effects[0].between[1].body = "ball";
    effects[0].between[1].at = kt_vec3_make(1.0, 0.0, 0.0);
    effects[0].stiffness = 20.0;
    effects[0].damping = 0.3;
    effects[0].length = 0.7;
    effects[0].initial_length = false;
    effects[1].type = KT_EFFECT_JOINT_DAMPER;
    effects[1].joint = "arm";
    effects[1].damping = 0.2;
    effects[2].type = KT_EFFECT_MOTOR;
    effects[2].joint = "arm";
    effects[2].torque = kt_function_sine(3.0, 0.8, 0.0, 0.0);
    kt_description d = kt_description_default();
    d.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    kt_describe(&d, bodies, 2, NULL, 0, effects, 3);
    return kt_scene_compile(&d);
}

KT_TEST(motion_has_the_same_bits_with_its_balance) {
    static kt_kept without;
    kt_model *model = compile_tumbler();
    for (int i = 0; i < kt_method_count() && model; i++) {
        const kt_method *method = kt_method_at(i);
        for (int adaptive = 0; adaptive <= (method->embedded_order > 0); adaptive++) {
            kt_run run = kt_run_fixed(method->name, adaptive ? 0.0 : 0.01, 1.0);
            run.relative = run.absolute = 1e-6;
            run.interval = 0.013;
            run.record = KT_RECORD_POSITION | KT_RECORD_ACCELERATION | KT_RECORD_ENERGY;
            kt_kept *kept = kt_kept_empty(model);
            kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
            kt_test_run(simulation, kt_keep, kept);
            const kt_simulation_counts counts = kt_simulation_counts_of(simulation);
            kt_check_true("no works", isnan(kt_simulation_work(simulation).dissipated) &&
                                          isnan(kt_simulation_work(simulation).supplied));
            without = *kept;

            run.record |= KT_RECORD_BALANCE;
            kept = kt_kept_empty(model);
            simulation = kt_test_simulation(model, &run, NULL);
            kt_test_run(simulation, kt_keep, kept);
            kt_simulation_counts more = kt_simulation_counts_of(simulation);
            if (method->gamma != NULL) /* two more evaluations a try */
                more.evaluations -= 2 * (more.steps + more.rejected);
            kt_check_true("its own evaluations are counted apart", adaptive || more.balance == 0);
            more.balance = 0;
            kt_check_above("heat", kt_simulation_work(simulation).dissipated, 1.0);
            kt_note("%s%s", method->name, adaptive ? ", adaptive" : "");
            kt_check_equal_int("records", kept->count, without.count);
            kt_check_equal_bits("states and accelerations", kept->state[0], without.state[0],
                                (size_t)without.count * KT_KEPT_NUMBERS);
            kt_check_equal_bits("energies", kept->energy, without.energy, (size_t)without.count);
            kt_check_true("as much work", memcmp(&counts, &more, sizeof counts) == 0);
        }
    }
}

KT_TEST(absolute_formulation_keeps_the_same_works) {
    oscillator o;
    oscillator_make(&o, 11.0);
    kt_model *model = kt_scene_compile(&o.lone.description);
    kt_ledger tree, other;
    kt_run run = balanced("dop853", 0.0, 4.0);
    run.relative = run.absolute = 1e-11;
    kt_absolute *absolute = kt_formulate(&o.lone.description, NULL, model, KT_FORMULATION_ABSOLUTE);
    kt_need(absolute != NULL);
    keep_ledger(model, &run, &tree);
    keep_ledger_of(model, absolute, &run, &other);
    kt_check_near("dissipated", other.last.dissipated, tree.last.dissipated, 1e-9);
    kt_check_near("supplied", other.last.supplied, tree.last.supplied, 1e-9);
    kt_check_below("drift", other.drift, 5e-9);
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

KT_TEST(checkpoint_carries_the_works) {
    kt_error error;
    kt_model *model = compile_tumbler();
    kt_run run = balanced("dopri5", 0.0, 2.0), plain = run;
    plain.record = KT_RECORD_POSITION;
    kt_simulation *a = kt_test_simulation(model, &run, NULL), *b = kt_test_simulation(model, &run, NULL);
    kt_simulation *other = kt_test_simulation(model, &plain, NULL);
    void *block = malloc(kt_simulation_state_size(a));
    kt_test_advance(a, 1.0);
    kt_simulation_save(a, block);
    kt_test_advance(a, 2.0);
    (void)kt_fine("restore", kt_simulation_restore(b, block, &error), &error);
    kt_test_advance(b, 2.0);
    const kt_work first = kt_simulation_work(a), second = kt_simulation_work(b);
    kt_check_equal_bits("dissipated", &second.dissipated, &first.dissipated, 1);
    kt_check_equal_bits("supplied", &second.supplied, &first.supplied, 1);
    kt_check_above("which is some", first.dissipated, 0.1);
    kt_check_equal_int("a run without a balance", kt_simulation_restore(other, block, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("says why", error.message, "keeps an energy balance");

    const double q[5] = {0.1, 1.0, 0.0, 0.0, 0.0}, v[4] = {0.0, 0.0, 0.0, 0.0};
    (void)kt_fine("state", kt_simulation_set_state(a, 0.5, q, v, &error), &error);
    const double works[2] = {kt_simulation_work(a).dissipated, kt_simulation_work(a).supplied}, none[2] = {0.0, 0.0};
    kt_check_equal_bits("a new start", works, none, 2);
    free(block);
}
