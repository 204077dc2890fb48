/* Contacts and stops that adaptive steps would leap over. The cases are a slider kicked by an evenly turning crank once
 * a turn, a joint at its stop, and a ball on a plane.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

/* A driven crank turns at 1 rad/s. Its tip at 1 m kicks the face of a slider at 0.99 m, which a spring brings back.
 * Or a face of the crank at 0.99 m, which turns with the crank, kicks a point of the slider at 1 m from outside. */
typedef struct kicker {
    kt_body bodies[2];
    kt_loop drive;
    kt_effect effects[2];
    double polynomial[2];
    kt_description description;
} kicker;

static kt_model *make_kicker(kicker *k, bool face_turns) {
    const double rest = face_turns ? 1.0 : 0.99;
    memset(k, 0, sizeof *k);
    k->bodies[0] = kt_body_of("crank", NULL, KT_JOINT_REVOLUTE, 1.0);
    k->bodies[0].joint.position[0] = k->polynomial[0] = 1.5707963267948966;
    k->bodies[0].joint.velocity[0] = k->polynomial[1] = 1.0;
    k->bodies[0].inertia = (kt_sym3){.xx = 1.0, .yy = 1.0, .zz = 1.0};
    k->bodies[1] = kt_body_of("slider", NULL, KT_JOINT_PRISMATIC, 1.0);
    k->bodies[1].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    k->bodies[1].joint.position[0] = rest;
    k->drive = kt_loop_of("drive", KT_LOOP_MOTION);
    k->drive.joint = "crank";
    k->drive.function = kt_function_polynomial(k->polynomial, 2);
    k->effects[0] = kt_effect_of(KT_EFFECT_CONTACT, NULL);
    k->effects[0].name = "face";
    k->effects[0].between[0] =
        face_turns ? (kt_end){.body = "slider"} : (kt_end){.body = "crank", .at = {1.0, 0.0, 0.0}};
    k->effects[0].between[1] =
        face_turns ? (kt_end){.body = "crank", .at = {0.99, 0.0, 0.0}} : (kt_end){.body = "slider"};
    k->effects[0].axis = kt_vec3_make(-1.0, 0.0, 0.0);
    k->effects[0].stiffness = 1e4;
    k->effects[0].dissipation = 0.2;
    k->effects[1] = kt_effect_of(KT_EFFECT_JOINT_SPRING, "slider");
    k->effects[1].stiffness = 1.0;
    k->effects[1].rest = kt_function_constant(rest);
    k->effects[1].damping = 0.5;
    k->description = kt_description_of(k->bodies, 2, &k->drive, 1, k->effects, 2);
    return kt_scene_compile(&k->description);
}

/* The slider's equation by Kutta's method, 20 microseconds a step; state: x, v. */
static double push(bool face_turns, double t, double x, double v) {
    const double angle = 1.5707963267948966 + t, c = cos(angle), s = sin(angle);
    const double depth = face_turns ? x * c - 0.99 : c - x, rate = face_turns ? v * c - x * s : -s - v;
    const double kick = depth > 0.0 ? 1e4 * pow(depth, 1.5) * fmax(0.0, 1.0 + 0.3 * rate) : 0.0;
    return (face_turns ? -kick * c - (x - 1.0) : kick - (x - 0.99)) - 0.5 * v;
}

static void solve(bool face_turns, double duration, double state[2]) {
    const double h = 2e-5;
    double x = face_turns ? 1.0 : 0.99, v = 0.0;
    for (long k = 0; k < lround(duration / h); k++) {
        const double t = (double)k * h, a1 = push(face_turns, t, x, v), v2 = v + 0.5 * h * a1;
        const double a2 = push(face_turns, t + 0.5 * h, x + 0.5 * h * v, v2), v3 = v + 0.5 * h * a2;
        const double a3 = push(face_turns, t + 0.5 * h, x + 0.5 * h * v2, v3), v4 = v + h * a3,
                     a4 = push(face_turns, t + h, x + h * v3, v4);
        x += h / 6.0 * (v + 2.0 * v2 + 2.0 * v3 + v4);
        v += h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
    }
    state[0] = x;
    state[1] = v;
}

static int ignore(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}

/* The bound is ten times the measured error of the least accurate method, rkc2. */
static void check_kicks(bool face_turns) {
    static kicker k;
    kt_model *model = make_kicker(&k, face_turns);
    KT_WORST worst = kt_worst_make("slider, m");
    double right[2];
    solve(face_turns, 50.0, right);
    for (int m = 0; m < kt_method_count(); m++) {
        kt_run run = kt_run_default();
        if (!kt_method_is_adaptive(kt_method_at(m)))
            continue;
        run.integrator = kt_method_at(m)->name;
        run.duration = 50.0;
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        kt_test_run(simulation, ignore, NULL);
        kt_worst_near(&worst, kt_simulation_positions(simulation)[1], right[0], 1e-4, "%s", run.integrator);
    }
}

KT_TEST(crank_that_kicks_once_a_turn_is_seen_by_every_method) { check_kicks(false); }
KT_TEST(crank_whose_face_kicks_once_a_turn_is_seen_by_every_method) { check_kicks(true); }

/* With a fixed step no step is taken back: a record in which the contact acts that no step has seen is rejected. */
KT_TEST(record_of_a_contact_that_no_step_has_seen_is_rejected) {
    static kicker k;
    kt_model *model = make_kicker(&k, false);
    kt_run run = kt_run_fixed("rk4", 2.5, 50.0);
    kt_error error = {0};
    run.interval = 0.05;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_check_equal_int("status", kt_simulation_run(simulation, ignore, NULL, &error), KT_ERROR_STEP);
    kt_check_contains("names it", error.where, "effect 'face' (contact)");
    kt_check_contains("says what", error.message, "has detected it; take a smaller step");
}

/* ---- what stays at a boundary ------------------------------------------------------------------------------------ */

/* At rest at its stop, and along it: nothing is to be found, and no step is taken back for rounding. */
KT_TEST(joint_that_rests_at_its_stop_costs_no_steps) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
    kt_effect stop = kt_effect_of(KT_EFFECT_JOINT_LIMIT, lone.body.name);
    stop.upper = lone.body.joint.position[0] = 0.3;
    stop.stiffness = 1e5;
    lone.description.effects = &stop;
    lone.description.effect_count = 1;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_run(simulation, ignore, NULL);
    const kt_simulation_counts counts = kt_simulation_counts_of(simulation);
    kt_check_below("steps", (double)counts.steps, 20.0);
    kt_check_equal_int("taken back", (long long)counts.rejected, 0);
}

/* A mass swings on a spring, without damping, 0.1 mm further than to its stop. It touches the stop for 10 ms of a
 * period of 6.3 s. The oracle: two harmonic motions in turn, so that it is at rest again after ten periods; where no
 * touch is seen, at 0.15 m/s. At each kink of the force a method is off by some 1e-6 m/s. The mass either slides along
 * x or is free. The free mass rotates ten times as fast as it swings, held by a spring whose other end is far away. */
static void check_swing(kt_joint_type type, kt_effect touched) {
    static const double k = 1.0, stop = 1e5, reach = 0.5001, at = 0.5;
    kt_lone lone;
    kt_effect effects[2] = {kt_effect_default(), touched};
    kt_lone_make(&lone, type, 1.0);
    effects[0].stiffness = k;
    if (type == KT_JOINT_FREE) {
        lone.body.joint.at = kt_vec3_make(0.125, -1.0, 0.25);
        lone.body.joint.velocity[3] = 10.0;
        lone.body.joint.velocity[5] = 1.0;
        effects[0].type = KT_EFFECT_SPRING;
        effects[0].between[0].body = lone.body.name;
        effects[0].between[1].at = kt_vec3_make(-10.0, -1.0, 0.25);
        effects[0].length = 10.0;
    } else {
        effects[0].type = KT_EFFECT_JOINT_SPRING;
        effects[0].joint = lone.body.name;
    }
    lone.body.joint.position[0] = reach - lone.body.joint.at.x;
    effects[1].stiffness = stop;
    lone.description.effects = effects;
    lone.description.effect_count = 2;
    /* To the stop, at the speed s, and against both springs about a point at `inside` beyond it until it is left. */
    const double s = sqrt(k * (reach * reach - at * at)), w = sqrt(k + stop), inside = at * k / (k + stop);
    const double period = 2.0 * acos(-at / reach) + 2.0 * atan2(s / w, inside) / w;
    kt_model *model = kt_scene_compile(&lone.description);
    KT_WORST worst = kt_worst_make("velocity after ten swings, m/s");
    for (int m = 0; m < kt_method_count(); m++) {
        kt_run run = kt_run_default();
        if (!kt_method_is_adaptive(kt_method_at(m)) || kt_method_at(m)->order < 4)
            continue;
        run.integrator = kt_method_at(m)->name;
        run.duration = 10.0 * period;
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        kt_test_run(simulation, ignore, NULL);
        kt_worst_near(&worst, kt_simulation_velocities(simulation)[0], 0.0, 1e-4, "%s", run.integrator);
    }
}

KT_TEST(swing_that_touches_a_stop_is_seen) {
    kt_effect stop = kt_effect_of(KT_EFFECT_JOINT_LIMIT, "block");
    stop.lower = -0.5;
    check_swing(KT_JOINT_PRISMATIC, stop);
}

/* Such a stop may be a sphere at a corner of the mass, on a linear spring at a plane of the ground. A free mass has a
 * sphere about its centre instead. */
KT_TEST(swing_that_touches_the_ground_is_seen) {
    kt_effect contact = kt_effect_of(KT_EFFECT_CONTACT, NULL);
    contact.between[0] = (kt_end){.body = "block", .at = {0.1, 0.2, -0.3}};
    contact.between[1] = (kt_end){.at = {-0.45, 7.0, 3.0}};
    contact.radius = 0.05;
    contact.axis = kt_vec3_make(1.0, 0.0, 0.0);
    contact.exponent = 1.0;
    check_swing(KT_JOINT_PRISMATIC, contact);
    contact.between[0].at = kt_vec3_make(0.0, 0.0, 0.0);
    contact.between[1].at.x = -0.55;
    check_swing(KT_JOINT_FREE, contact);
}

/* ---- several --------------------------------------------------------------------------------------------------- */

enum { SEVERAL = 3 };

/* Ten periods of the swing above that touches its stop; it is at rest again after them. */
static double ten_swings(void) {
    const double reach = 0.5001, at = 0.5, stop = 1e5, s = sqrt(reach * reach - at * at), w = sqrt(1.0 + stop);
    return 10.0 * (2.0 * acos(-at / reach) + 2.0 * atan2(s / w, at / (1.0 + stop)) / w);
}

/* Blocks that swing beside each other, each with a stop, of which one reaches it. */
typedef struct row {
    kt_body bodies[SEVERAL];
    kt_effect effects[2 * SEVERAL];
    kt_description description;
} row;

static void make_row(row *r, int which, double lower) {
    static const char *const names[SEVERAL] = {"one", "two", "three"};
    for (int i = 0; i < SEVERAL; i++) {
        kt_effect *spring = &r->effects[i], *stop = &r->effects[SEVERAL + i];
        r->bodies[i] = kt_body_of(names[i], NULL, KT_JOINT_PRISMATIC, 1.0);
        r->bodies[i].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        r->bodies[i].joint.position[0] = i == which ? 0.5001 : 0.1;
        *spring = *stop = kt_effect_default();
        spring->type = KT_EFFECT_JOINT_SPRING;
        spring->stiffness = 1.0;
        stop->type = KT_EFFECT_JOINT_LIMIT;
        stop->stiffness = 1e5;
        stop->lower = lower;
        spring->joint = stop->joint = stop->name = names[i];
    }
    r->description = kt_description_of(r->bodies, SEVERAL, NULL, 0, r->effects, 2 * SEVERAL);
}

static kt_simulation *simulate(const kt_model *model, const char *method) {
    kt_run run = kt_run_default();
    run.integrator = method;
    run.duration = ten_swings();
    return kt_test_simulation(model, &run, NULL);
}

/* After ten swings by methods that have dense output of their own, one of high order, and one that ends steps at
 * stops. */
static void check_ten_swings(kt_worst *worst, const kt_description *description, int which, int v) {
    static const char *const methods[] = {"auto", "dop853", "rkc4"};
    kt_model *model = kt_scene_compile(description);
    for (int m = 0; m < 3; m++) {
        kt_simulation *simulation = simulate(model, methods[m]);
        kt_test_run(simulation, ignore, NULL);
        kt_worst_near(worst, kt_simulation_velocities(simulation)[v], 0.0, 1e-4, "%s, number %d", methods[m],
                      which + 1);
    }
}

/* The search treats stops in a row together. */
KT_TEST(each_stop_of_a_row_is_seen) {
    KT_WORST worst = kt_worst_make("velocity after ten swings, m/s");
    for (int which = 0; which < SEVERAL; which++) {
        row r;
        make_row(&r, which, -0.5);
        check_ten_swings(&worst, &r.description, which, which);
    }
}

/* Stops that nothing can reach are set to where they are touched, after some steps. */
KT_TEST(stops_that_are_set_in_a_run_are_seen) {
    static const char *const names[SEVERAL] = {"effect one.lower", "effect two.lower", "effect three.lower"};
    const double lower = -0.5;
    KT_WORST worst = kt_worst_make("velocity after ten swings, m/s");
    for (int which = 0; which < SEVERAL; which++) {
        row r;
        kt_error error = {0};
        kt_parameter parameter;
        make_row(&r, which, -10.0);
        kt_model *model = kt_scene_compile(&r.description), *copy = NULL;
        void *memory = aligned_alloc(KT_ALIGNMENT, kt_model_size(model));
        kt_need_fine("copied", kt_model_copy(model, memory, kt_model_size(model), &copy, &error), &error);
        kt_simulation *simulation = simulate(copy, "dop853");
        bool fine = kt_fine("begins", kt_simulation_advance(simulation, 0.1, &error), &error);
        for (int i = 0; i < SEVERAL && fine; i++)
            fine = kt_fine("found", kt_parameter_find(model, names[i], &parameter, &error), &error) &&
                   kt_fine("set", kt_simulation_set_parameter(simulation, copy, &parameter, &lower, &error), &error);
        if (fine && kt_fine("runs", kt_simulation_advance(simulation, ten_swings(), &error), &error))
            kt_worst_near(&worst, kt_simulation_velocities(simulation)[which], 0.0, 1e-4, "number %d", which + 1);
        free(memory);
    }
}

/* A block above one plane with several of its points, of which one reaches the plane. The search treats them
 * together. The block slides on the ground, or on a carrier that may turn about the slide. */
KT_TEST(each_point_above_a_plane_is_seen) {
    KT_WORST worst = kt_worst_make("velocity after ten swings, m/s");
    for (int n = 0; n < 2 * SEVERAL; n++) {
        const int which = n % SEVERAL;
        const bool is_carried = n >= SEVERAL;
        kt_lone lone;
        kt_body bodies[2];
        kt_effect effects[1 + SEVERAL];
        kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
        lone.body.joint.position[0] = 0.5001 - lone.body.joint.at.x;
        effects[0] = kt_effect_of(KT_EFFECT_JOINT_SPRING, lone.body.name);
        effects[0].stiffness = 1.0;
        for (int i = 0; i < SEVERAL; i++) {
            kt_effect *contact = &effects[1 + i];
            *contact = kt_effect_of(KT_EFFECT_CONTACT, NULL);
            contact->between[0] = (kt_end){.body = lone.body.name, .at = {i == which ? 0.1 : 0.4, 0.2 * i, -0.3}};
            contact->between[1] = (kt_end){.at = {-0.45, 7.0, 3.0}};
            contact->radius = 0.05;
            contact->axis = kt_vec3_make(1.0, 0.0, 0.0);
            contact->exponent = 1.0;
            contact->stiffness = 1e5;
        }
        lone.description.effects = effects;
        lone.description.effect_count = 1 + SEVERAL;
        if (is_carried) {
            bodies[0] = kt_body_of("carrier", NULL, KT_JOINT_REVOLUTE, 1.0);
            bodies[0].joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
            bodies[0].inertia = kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
            bodies[1] = lone.body;
            bodies[1].parent = "carrier";
            lone.description.bodies = bodies;
            lone.description.body_count = 2;
        }
        check_ten_swings(&worst, &lone.description, which, is_carried ? 1 : 0);
    }
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

KT_TEST(restored_run_has_the_same_bits_between_kicks) {
    static kicker k;
    kt_error error = {0};
    kt_run run = kt_run_default();
    kt_model *model = make_kicker(&k, false);
    run.integrator = "tsit5";
    kt_simulation *first = kt_test_simulation(model, &run, NULL), *second = kt_test_simulation(model, &run, NULL);
    for (int i = 0; i < 40; i++) {
        kt_need_fine("step", kt_simulation_step(first, HUGE_VAL, &error), &error);
        kt_need(kt_scene_hand_over(first, second));
        for (int j = 0; j < 3; j++) {
            (void)kt_fine("step", kt_simulation_step(first, HUGE_VAL, &error), &error);
            (void)kt_fine("step", kt_simulation_step(second, HUGE_VAL, &error), &error);
        }
        kt_scene_check_equal("state", second, first);
    }
}
