/* The energy balance of closed mechanisms: driven ones, whose loops do work, and others, whose loops do none. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "scenes.h"

#include "kinetree/scene.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

enum { MOST = 8, NUMBERS = 32 };

/* A bundled scene with effects and a loop more. */
typedef struct stage {
    const kt_scene *scene;
    kt_description description;
    kt_effect effects[MOST];
    kt_loop loops[MOST];
    kt_model *model;
} stage;

static void stage_open(stage *s, const char *name) {
    s->model = NULL;
    s->scene = kt_test_bundled(name);
    s->description = s->scene->description;
    for (int i = 0; i < s->description.effect_count; i++)
        s->effects[i] = s->description.effects[i];
    for (int i = 0; i < s->description.loop_count; i++)
        s->loops[i] = s->description.loops[i];
    s->description.effects = s->effects;
    s->description.loops = s->loops;
}

static kt_effect *add_effect(stage *s, kt_effect_type type, const char *joint) {
    kt_effect *effect = &s->effects[s->description.effect_count++];
    *effect = kt_effect_of(type, joint);
    return effect;
}

static void add_damper(stage *s, const char *joint, double damping) {
    add_effect(s, KT_EFFECT_JOINT_DAMPER, joint)->damping = damping;
}

static void add_motor(stage *s, const char *joint, kt_function torque) {
    add_effect(s, KT_EFFECT_MOTOR, joint)->torque = torque;
}

static kt_loop *add_loop(stage *s, const char *name, kt_loop_type type) {
    kt_loop *loop = &s->loops[s->description.loop_count++];
    *loop = kt_loop_of(name, type);
    return loop;
}

static void keep_ledger(stage *s, const char *integrator, double step, double tolerance, double duration,
                        kt_ledger *l) {
    kt_run run = kt_run_fixed(integrator, step, duration);
    run.record = KT_RECORD_BALANCE;
    run.relative = run.absolute = tolerance;
    run.interval = step; /* fixed steps: at their ends */
    *l = (kt_ledger){.count = 0};
    if (!s->model)
        s->model = kt_scene_compile(&s->description);
    kt_simulation *simulation = kt_test_simulation(s->model, &run, NULL);
    kt_test_run(simulation, kt_ledger_enter, l);
    kt_note("%s, step %g, tolerance %g: %g J heat, %g J supplied, drift %g J", integrator, step, tolerance,
            l->last.dissipated, l->last.supplied, l->drift);
    kt_need(kt_check_true("there are records", l->count > 1));
}

/* ---- forces with kinks ------------------------------------------------------------------------------------------- */

/* The rocker runs against a stop, again and again. All other forces in this file are smooth, and their bounds are a few
 * tolerances a joule. A step over a kink is of first order, and its estimate of the error may be zero by chance. The
 * measured errors were 5 to 350 tolerances. The energy was 14 J. */
KT_TEST(balance_of_a_four_bar_against_a_stop_closes_to_a_multiple_of_the_tolerance) {
    stage s;
    KT_WORST drift = kt_worst_make("drift, relative");
    stage_open(&s, "four-bar");
    add_damper(&s, "coupler", 0.1);
    add_motor(&s, "crank", kt_function_constant(3.0));
    kt_effect *stop = add_effect(&s, KT_EFFECT_JOINT_LIMIT, "rocker");
    stop->upper = 1.9;
    stop->stiffness = 2e3;
    for (int i = 6; i <= 12; i++) {
        kt_ledger l;
        const double tolerance = pow(10.0, -i);
        keep_ledger(&s, "dop853", 0.0, tolerance, 2.0, &l);
        kt_worst_below(&drift, l.drift / 14.0, 1e3 * tolerance, "tolerance %g", tolerance);
    }
}

/* ---- loops at rest ----------------------------------------------------------------------------------------------- */

KT_TEST(balance_of_a_motor_driven_four_bar_closes_with_the_order) {
    stage s;
    kt_ledger coarse, fine, tight;
    stage_open(&s, "four-bar");
    add_damper(&s, "rocker", 0.4);
    add_damper(&s, "coupler", 0.1);
    add_motor(&s, "crank", kt_function_sine(2.0, 1.3, 0.3, 1.0));
    keep_ledger(&s, "rk4", 4e-3, 0.0, 2.0, &coarse);
    keep_ledger(&s, "rk4", 2e-3, 0.0, 2.0, &fine);
    kt_check_near("order", log2(coarse.drift / fine.drift), 4.0, 0.4);
    keep_ledger(&s, "dop853", 0.0, 1e-11, 2.0, &tight);
    kt_check_above("heat", tight.last.dissipated, 1.0);
    kt_check_above("supplied", tight.last.supplied, 1.0);
    kt_check_below("drift", tight.drift, 2e-9);
}

/* Springs of 8e5 N/m, dampers of 4e4 N s/m. */
KT_TEST(balance_of_the_flyball_governor_closes_to_the_tolerance) {
    stage s;
    kt_ledger loose, tight;
    stage_open(&s, "flyball-governor");
    add_motor(&s, "shaft", kt_function_constant(20.0));
    keep_ledger(&s, "dopri5", 0.0, 1e-7, 1.0, &loose);
    keep_ledger(&s, "dopri5", 0.0, 1e-10, 1.0, &tight);
    kt_check_above("heat", tight.last.dissipated, 1e-3); /* the ropes hardly stretch */
    kt_check_above("supplied", tight.last.supplied, 1.0);
    kt_check_below("drift", tight.drift, 1e-10);
    kt_check_above("fell by", loose.drift / tight.drift, 100.0);
}

KT_TEST(rolling_does_no_work) {
    stage s;
    kt_ledger l;
    stage_open(&s, "rolling-disc");
    keep_ledger(&s, "dop853", 0.0, 1e-11, 2.0, &l);
    kt_check_near("heat", l.last.dissipated, 0.0, 0.0);
    kt_check_near("supplied", l.last.supplied, 0.0, 0.0);
    kt_check_below("drift", l.drift, 1e-9);
}

/* ---- driven loops ------------------------------------------------------------------------------------------------ */

static void prescribe_crank(stage *s) {
    kt_loop *drive = add_loop(s, "drive", KT_LOOP_MOTION);
    drive->joint = "crank";
    drive->function = kt_function_sine(0.9, 0.8, 0.5, 1.2); /* to and fro, and both speeds up and brakes */
    add_damper(s, "rocker", 0.4);
}

/* A rod of changing length between the middle of the coupler and the
 * world. */
static void stretch_rod(stage *s) {
    kt_loop *rod = add_loop(s, "ram", KT_LOOP_DISTANCE);
    rod->between[0].body = "coupler";
    rod->between[0].at = kt_vec3_make(0.45, 0.0, 0.0);
    rod->between[1].at = kt_vec3_make(-0.5, 0.5, 0.0);
    rod->function = kt_function_sine(0.06, 0.7, 0.4, 1.02);
    add_damper(s, "rocker", 0.4);
}

typedef void add_drive(stage *s);

static void follow_driven(add_drive *add) {
    stage s;
    kt_ledger coarse, fine, tight;
    stage_open(&s, "four-bar");
    s.description.hold_count = 0;
    add(&s);
    keep_ledger(&s, "rk4", 2e-2, 0.0, 2.0, &coarse);
    keep_ledger(&s, "rk4", 1e-2, 0.0, 2.0, &fine);
    kt_check_above("order", log2(coarse.drift / fine.drift), 3.6);
    keep_ledger(&s, "dop853", 0.0, 1e-11, 2.0, &tight);
    kt_check_above("heat", tight.last.dissipated, 0.01);
    kt_check_above("supplied", fabs(tight.last.supplied), 0.01);
    kt_check_below("drift", tight.drift, 5e-11);
}

KT_TEST(balance_of_a_prescribed_crank_closes) { follow_driven(prescribe_crank); }
KT_TEST(balance_of_a_driven_length_closes) { follow_driven(stretch_rod); }

/* Energy of the state at t, its loops closed, next to (q, v). */
static double energy_at(const kt_model *model, kt_data *data, double t, double *q, double *v) {
    kt_error error;
    kt_need_fine("project", kt_state_project(model, data, t, q, v, NULL, &error), &error);
    kt_need_fine("kinematics", kt_kinematics_update(model, data, q, v, NULL, &error), &error);
    return kt_kinetic_energy(model, data) + kt_potential_energy(model, data) + kt_effect_energy(model, data, t, q, v);
}

/* First, supplied - dissipated against differences of the energy along the motion. Second, the supply against the
 * moment times the rate of the drive. The moment is the reaction of the drive, found independently from multipliers. */
static void compare_power(add_drive *add, double bound) {
    enum { POINTS = 4 };
    stage s;
    kt_error error;
    double q[NUMBERS], v[NUMBERS], a[NUMBERS], moved_q[NUMBERS], moved_v[NUMBERS];
    stage_open(&s, "four-bar");
    s.description.hold_count = 0;
    add(&s);
    s.model = kt_scene_compile(&s.description);
    kt_data *data = kt_test_data(s.model);
    const kt_model *m = s.model;
    const int nv = kt_model_nv(m), drive = kt_loop_count(m) - 1;
    const bool turns = kt_loop_type_of(m, drive) == KT_LOOP_MOTION;
    kt_wrench *loops = calloc((size_t)kt_loop_count(m), sizeof *loops);
    KT_WORST slope = kt_worst_make("d(T + V)/dt"), supply = kt_worst_make("supplied");
    /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
    for (double t = 0.1; t < 1.3; t += 0.17) {
        static const double weight[POINTS] = {0.0, 0.75, -0.15, 1.0 / 60.0}, h = 2e-3;
        kt_power power;
        double change = 0.0;
        kt_model_initial(m, q, v);
        kt_need_fine("assemble", kt_state_assemble(m, data, t, q, v, &error), &error);
        kt_need_fine("power", kt_power_evaluate(m, data, t, q, v, NULL, NULL, a, &power, &error), &error);
        for (int i = -3; i <= 3; i++) { /* a state of the motion but for a third of h^3 / 6, which projection removes */
            const double dt = i * h;
            for (int k = 0; k < nv; k++) {
                moved_q[k] = q[k] + dt * (v[k] + 0.5 * dt * a[k]);
                moved_v[k] = v[k] + dt * a[k];
            }
            change += (i < 0 ? -weight[-i] : weight[i]) / h * energy_at(m, data, t + dt, moved_q, moved_v);
        }
        kt_worst_near(&slope, power.supplied - power.dissipated, change, bound * (1.0 + fabs(change)), "t = %g", t);
        kt_need_fine("reactions", kt_reaction_evaluate(m, data, t, q, v, NULL, NULL, NULL, loops, &error), &error);
        kt_need_fine("kinematics", kt_kinematics_update(m, data, q, v, NULL, &error), &error);
        const int coupler = kt_body_find(m, "coupler");
        const kt_vec3 rate = kt_point_velocity(m, data, coupler, kt_vec3_make(0.45, 0.0, 0.0));
        const double by_reaction = turns ? loops[drive].moment.z * v[0] : -kt_vec3_dot(loops[drive].force, rate);
        kt_worst_near(&supply, power.supplied, by_reaction, 64.0 * DBL_EPSILON * (1.0 + fabs(by_reaction)), "t = %g",
                      t);
    }
    free(loops);
}

KT_TEST(power_of_a_prescribed_motion_is_that_of_its_reaction_and_the_growth_of_energy) {
    compare_power(prescribe_crank, 2e-10);
}
KT_TEST(power_of_a_driven_length_is_that_of_its_reaction_and_the_growth_of_energy) {
    compare_power(stretch_rod, 2e-10);
}
