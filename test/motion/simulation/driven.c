/* Mechanisms whose drives leave no degree of freedom. Position and velocity follow from the time alone, with every
 * method of integration. Steps are as long as the motion allows. The works of the drives follow, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "formulation.h"
#include "parsed.h"
#include "sanitized.h"

#include "integrator/integrator.h"
#include "kinetree/scene.h"
#include "simulation/simulation.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char crank[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, axis: z}, mass: 1, shape: {type: rod, to: [0.3, 0, 0]}}\n"
    "loops:\n"
    "  - {name: drive, type: motion, joint: crank, position: {polynomial: [0, 6.28]}}\n";

/* A damper and a spring, for powers and for forces that an implicit method would linearise. */
static const char four_bar[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, position: 60 deg}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n"
    "  - {name: coupler, parent: crank, joint: {type: revolute, at: [1, 0, 0], position: -50 deg}, mass: 2, shape: "
    "{type: "
    "rod, to: [3, 0, 0]}, markers: {tip: [3, 0, 0]}}\n"
    "  - {name: rocker, joint: {type: revolute, at: [2.5, 0, 0], position: 70 deg}, mass: 1, shape: {type: rod, to: "
    "[2, 0, "
    "0]}, markers: {tip: [2, 0, 0]}}\n"
    "loops:\n"
    "  - {name: close, type: revolute, between: [coupler.tip, rocker.tip]}\n"
    "  - {name: drive, type: motion, joint: crank, position: {sine: {amplitude: 0.4, frequency: 1.5, offset: 1.0}}}\n"
    "effects:\n"
    "  - {type: joint_damper, joint: rocker, damping: 1e4}\n"
    "  - {type: joint_spring, joint: rocker, stiffness: 1e5}\n";

/* A quaternion, all of whose rotations are driven. */
static const char ball[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: yaw, joint: {type: revolute, axis: z}, mass: 1, inertia: [1, 1, 1]}\n"
    "  - {name: ball, joint: {type: spherical}, mass: 1, inertia: [1, 2, 3]}\n"
    "loops:\n"
    "  - {name: together, type: parallel, between: [yaw, ball]}\n"
    "  - {name: drive, type: motion, joint: yaw, position: {sine: {amplitude: 2, frequency: 1}}}\n";

/* The largest difference to the state of dop853 at 1e-13 over all records. */
typedef struct compared {
    kt_worst worst;
    const kt_kept *right;
} compared;

static int compare(const kt_record *record, void *user) {
    compared *c = user;
    const double *right = c->right->state[record->index];
    const size_t nq = (size_t)c->right->nq, nv = (size_t)c->right->nv;
    for (size_t i = 0; i < nq + nv; i++) /* both are closed states, so only rounding remains */
        kt_worst_near(&c->worst, i < nq ? record->q[i] : record->v[i - nq], right[i], i < nq ? 1e-14 : 1e-12,
                      "%s[%zu] at %g s", i < nq ? "q" : "v", i < nq ? i : i - nq, record->t);
    return 0;
}

static void check_method(const kt_model *model, const kt_absolute *absolute, const kt_run *run, const kt_kept *right) {
    compared c = {kt_worst_make(run->integrator), right};
    const kt_either e = kt_either_begin(model, absolute, run, NULL);
    kt_note("%s, step %g%s", run->integrator, run->step, absolute != NULL ? ", absolute" : "");
    kt_either_test_run(e, compare, &c);
    kt_check_worst(&c.worst);
    kt_check_below("steps", (double)kt_simulation_counts_of(e.simulation).steps, 400.0);
}

/* Counts over all scenes and all works: see kt_is_asked. */
static int asked_scenes, asked_works;

static void check_scene(const char *text) {
    static kt_kept right;
    kt_scene scene;
    kt_parsed_scene(text, &scene);
    kt_model *model = kt_scene_compile(&scene.description);
    kt_check_equal_int("degrees of freedom", kt_model_mobility(model).minimal, 0);
    kt_run run = kt_run_fixed("dop853", 0.0, 1.0);
    run.relative = run.absolute = 1e-13;
    run.interval = 0.025;
    kt_kept *kept = kt_kept_empty(model);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_run(simulation, kt_keep, kept);
    right = *kept;
    kt_absolute *absolute = kt_formulate(&scene.description, NULL, model, KT_FORMULATION_ABSOLUTE);
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *method = kt_method_at(i);
        if (!kt_method_is_implicit(method) && strcmp(method->name, "auto") != 0)
            continue;
        for (int k = 0; k < 4; k++) {
            run.integrator = method->name;
            run.step = k % 2 == 0 ? 2.5e-3 : 0.0; /* records at the ends of steps: positions are those of the loops */
            run.relative = run.absolute = 1e-9;
            if ((run.step > 0.0 || kt_method_is_adaptive(method)) && kt_is_asked(&asked_scenes, 4))
                check_method(model, k < 2 ? NULL : absolute, &run, &right);
        }
    }
}

KT_TEST(driven_crank_turns_by_every_implicit_method) { check_scene(crank); }
KT_TEST(driven_four_bar_moves_by_every_implicit_method) { check_scene(four_bar); }
KT_TEST(driven_ball_turns_by_every_implicit_method) { check_scene(ball); }

/* ---- works of the drives ----------------------------------------------------------------------------------------- */

/* A ram of 1 kg that a drive pushes into a spring which acts in one direction alone, and pulls out again. */
static const char press[] =
    "kinetree: 1\n"
    "bodies:\n"
    "  - {name: ram, joint: {type: prismatic, axis: y}, mass: 1, inertia: [1, 1, 1], markers: {face: [0, 0, 0]}}\n"
    "loops:\n"
    "  - {name: drive, type: motion, joint: ram, position: {sine: {amplitude: 0.1, frequency: 0.5, phase: 90 deg}}}\n"
    "effects:\n"
    "  - {type: contact, point: ram.face, plane: {body: world, at: [0, 0.02, 0]}, axis: y, stiffness: 1e5, exponent: "
    "1}\n";

/* The energy at time t over that at the start, all of which the drive has supplied. */
typedef double supplied_at(double t);

static double supplied_to_crank(double t) { return 9.81 * 0.15 * sin(6.28 * t); }

static double supplied_to_press(double t) {
    const double w = 3.14159265358979323846, y = 0.1 * cos(w * t), v = -0.1 * w * sin(w * t);
    const double depth = fmax(0.0, 0.02 - y);
    return 0.5 * v * v + 0.5e5 * depth * depth;
}

typedef struct account {
    kt_worst *worst;
    const char *method;
    supplied_at *right;
    double bound, works[512];
    int stop_at; /* -1: never */
} account;

static int enter(const kt_record *record, void *user) {
    account *a = user;
    if (record->index == a->stop_at)
        return -1;
    a->works[record->index] = record->work.supplied;
    kt_worst_near(a->worst, record->work.supplied, a->right(record->t), a->bound, "%s, %g s", a->method, record->t);
    return 0;
}

static kt_model *compile(const char *text) {
    kt_scene scene;
    kt_parsed_scene(text, &scene);
    return kt_scene_compile(&scene.description);
}

/* Checks records within steps, too: few of the 401 records are at the end of a step. */
static void check_works(const char *text, supplied_at *right, double bound, double bound_of_order_2) {
    kt_model *model = compile(text);
    kt_worst worst = kt_worst_make("supplied, J");
    for (int i = 0; i < kt_method_count(); i++) {
        const kt_method *method = kt_method_at(i);
        if (!kt_method_is_adaptive(method) || !kt_is_asked(&asked_works, 4))
            continue;
        kt_run run = kt_run_fixed(method->name, 0.0, 4.0);
        run.interval = 0.01;
        run.record = KT_RECORD_POSITION | KT_RECORD_BALANCE;
        account a = {.worst = &worst,
                     .method = method->name,
                     .right = right,
                     .bound = method->order > 2 ? bound : bound_of_order_2,
                     .stop_at = -1};
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        kt_test_run(simulation, enter, &a);
        const kt_simulation_counts counts = kt_simulation_counts_of(simulation);
        kt_note("%s: %llu steps, %llu evaluations, and %llu for works", method->name, (unsigned long long)counts.steps,
                (unsigned long long)counts.evaluations, (unsigned long long)counts.balance);
    }
    kt_check_worst(&worst);
}

/* The works reach 1.5 J, with tolerances of 1e-9. Without error control of the works, they are 14 J off (dop853: 140
 * J). Measured: up to 3.4e-7 J within the first step of rkc4, whose dense output is of order 3 and which is not
 * integrated again. */
KT_TEST(work_of_a_drive_that_turns_a_crank_evenly_is_its_energy) { check_works(crank, supplied_to_crank, 1e-6, 1e-6); }

/* The works reach 720 J. The power has a corner, where estimates are those of the error, up to 100 tolerances a
 * step. */
KT_TEST(work_of_a_drive_that_closes_a_contact_is_its_energy) { check_works(press, supplied_to_press, 2e-4, 5e-3); }

/* ---- a dead point at the end of a step --------------------------------------------------------------------------- */

/* Two bars that a ram straightens and lets go again, exactly to their dead point. */
static const char toggle[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: upper, joint: {type: revolute, at: [0, 1.2, 0], position: -10 deg}, mass: 20, shape: {type: rod, to: "
    "[0, "
    "-0.5, 0], radius: 0.03}}\n"
    "  - {name: lower, parent: upper, joint: {type: revolute, at: [0, -0.5, 0], position: 20 deg}, mass: 20, shape: "
    "{type: "
    "rod, to: [0, -0.5, 0], radius: 0.03}, markers: {pin: [0, -0.5, 0]}}\n"
    "  - {name: ram, joint: {type: prismatic, axis: y, at: [0, 0.2, 0]}, mass: 50, inertia: [1, 1, 1], markers: {face: "
    "[0, "
    "-0.1, 0]}}\n"
    "loops:\n"
    "  - {name: drive, type: motion, joint: ram, position: {sine: {amplitude: 0.01, frequency: 0.5, phase: 90 deg, "
    "offset: 0.01}}}\n"
    "  - {name: pin, type: revolute, between: [lower.pin, ram]}\n"
    "initial: {hold: []}\n"
    "effects:\n"
    "  - {type: contact, point: ram.face, plane: {body: world, at: [0, 0.105, 0]}, axis: y, stiffness: 2e7, exponent: "
    "1, "
    "dissipation: 0.1}\n";

/* The ram is lifted by 0.02 m at most, so cos(upper) >= 0.98. The bars are at most 0.21 rad from straight. */
static int look_at_bars(const kt_record *record, void *user) {
    kt_worst_below(user, fabs(record->q[0]), 0.21, "upper at %g s", record->t);
    return 0;
}

/* The acceleration at the end of such a step is only rounding. Its dense output leads to -14,357 rad and to a work of
 * 1.5e25 J. Whether the run passes the dead point is another matter. */
KT_TEST(records_of_a_step_that_ends_at_a_dead_point_are_of_the_motion) {
    static const double tolerances[] = {1e-4, 1e-5, 1e-6, 1e-7, 1e-8};
    kt_error error;
    kt_model *model = compile(toggle);
    unsigned long long joined = 0;
    for (size_t i = 0; i < sizeof tolerances / sizeof *tolerances; i++) {
        kt_run run = kt_run_fixed("dop853", 0.0, 3.0);
        run.relative = run.absolute = tolerances[i];
        run.interval = 1e-3;
        KT_WORST worst = kt_worst_make("angle");
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        const kt_status status = kt_simulation_run(simulation, look_at_bars, &worst, &error);
        joined += kt_simulation_counts_of(simulation).joined;
        kt_note("tolerance %g: until %g s, status %d", tolerances[i], kt_simulation_time(simulation), (int)status);
    }
    kt_check_above("states joined", (double)joined, 100.0);
}

/* The same with a slope at the end of a step that is spoilt on purpose. */
KT_TEST(dense_output_that_leaves_the_motion_is_not_taken) {
    kt_error error;
    kt_model *model = compile(toggle);
    const kt_run run = kt_run_fixed("dopri5", 0.0, 3.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    const double *slope;
    kt_test_advance(simulation, 0.7);
    kt_integrator *it = simulation->integrator;
    (void)kt_fine("slope", kt_integrator_derivative(it, &slope, &error), &error);
    const double t = 0.5 * (kt_integrator_previous_time(it) + kt_integrator_time(it));
    const double angle = -acos(1.0 - 0.01 - 0.01 * cos(3.14159265358979323846 * t)); /* from the height of the ram */
    for (int spoilt = 0; spoilt < 2; spoilt++) {
        it->k[it->derivative_slot][spoilt ? 0 : 1] *= spoilt ? 1e12 : 1.0;
        (void)kt_fine("state", kt_simulation_between(simulation, t, &error), &error);
        kt_check_near("angle", simulation->y[0], angle, 1e-12);
        kt_check_equal_int("joined", (long long)kt_simulation_counts_of(simulation).joined, spoilt);
    }
}

/* Steps that come to nothing while loops drift open have a remedy of their own. */
KT_TEST(failing_step_of_open_loops_is_told_to_close_them) {
    kt_error error = {KT_OK, "", ""};
    kt_model *model = compile(toggle);
    kt_simulation_options options = kt_simulation_options_default();
    const kt_run run = kt_run_fixed("dopri5", 0.0, 3.0);
    options.max_steps = 3;
    for (int open = 0; open < 2; open++) {
        options.unprojected = open;
        kt_simulation *simulation = kt_test_simulation(model, &run, &options);
        kt_check_equal_int("status", kt_simulation_advance(simulation, 3.0, &error), KT_ERROR_STEP);
        kt_check_true(error.message, (strstr(error.message, "let them be closed after each step") != NULL) == open);
    }
}

/* The errors of accelerations, which reject tries next to the dead point. */
enum { JUDGED_MOST = 256 };
static kt_passage judged[2][JUDGED_MOST];
static int run_judged, judged_count[2];

static double judge(double h, void *user) {
    const kt_simulation *simulation = user;
    const kt_passage passage = simulation->data->passage;
    if (passage.time > 0.0 && judged_count[run_judged] < JUDGED_MOST)
        judged[run_judged][judged_count[run_judged]++] = passage;
    return kt_simulation_noise.within(h, user);
}

/* As a record does that lies within the last step. */
static kt_status ask_in_between(kt_simulation *simulation, kt_error *error) {
    const kt_integrator *it = simulation->integrator;
    const double t = 0.5 * (kt_integrator_previous_time(it) + kt_integrator_time(it));
    const kt_status status = kt_simulation_between(simulation, t, error);
    if (status == KT_OK &&
        kt_simulation_accelerate(simulation, t, simulation->y, NULL, NULL, simulation->a, error) != 0)
        return error->code;
    return status;
}

/* Records and works evaluate accelerations between two steps. The second step must be judged by its own errors.
 * Otherwise a drive next to its dead point moves differently if a balance is kept. */
KT_TEST(what_is_asked_between_steps_does_not_judge_the_next) {
    const kt_noise noise = {kt_simulation_noise.begin, judge, kt_simulation_noise.instant};
    kt_error error;
    kt_model *model = compile(toggle);
    for (run_judged = 0; run_judged < 2; run_judged++) {
        kt_run run = kt_run_fixed("dopri5", 0.0, 3.0);
        run.relative = run.absolute = 1e-11;
        kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
        simulation->integrator->noise = &noise;
        kt_status status = KT_OK;
        while (status == KT_OK && kt_simulation_time(simulation) < 3.0) {
            status = kt_simulation_step(simulation, 3.0, &error);
            if (status == KT_OK && run_judged == 1)
                status = ask_in_between(simulation, &error);
        }
        (void)kt_fine("steps", status, &error);
    }
    kt_check_above("tries", judged_count[0], 3.0);
    kt_check_equal_int("as many", judged_count[1], judged_count[0]);
    kt_check_equal_bits("errors", &judged[1][0].acceleration, &judged[0][0].acceleration, (size_t)3 * JUDGED_MOST);
}

/* A crank that is driven, from rest, to where its four-bar is stretched and goes no farther, at 1.43329539 s: the power
 * grows without bound. */
static const char stretched[] =
    "kinetree: 1\n"
    "gravity: [0, -9.81, 0]\n"
    "bodies:\n"
    "  - {name: crank, joint: {type: revolute, position: 0.8700121311548521}, mass: 1, shape: {type: rod, to: "
    "[0.9798656002108206, 0, 0]}}\n"
    "  - {name: coupler, parent: crank, joint: {type: revolute, at: [0.9798656002108206, 0, 0], position: "
    "-1.0175237795390186}, mass: 2, shape: {type: rod, to: [0.9936992499808137, 0, 0]}}\n"
    "  - {name: rocker, joint: {type: revolute, at: [1.287658927953888, 0, 0], position: 1.0737144445328868}, mass: 1, "
    "shape: {type: rod, to: [0.6859059152705063, 0, 0]}}\n"
    "  - {name: clock, joint: {type: revolute, at: [0, 5, 0], position: -1}, mass: 0.1, shape: {type: rod, to: [0.1, "
    "0, "
    "0]}}\n"
    "loops:\n"
    "  - {name: close, type: revolute, between: [{body: coupler, at: [0.9936992499808137, 0, 0]}, {body: rocker, at: "
    "[0.6859059152705063, 0, 0]}]}\n"
    "  - {name: drive, type: motion, joint: crank, position: {polynomial: [0.8700121311548521, 0.5450830478123165]}}\n"
    "initial: {hold: []}\n";

/* Works that are never given up would take panels of a millionth of a step; the run itself takes 0.05 s. */
KT_TEST(works_before_a_dead_point_are_given_up) {
    kt_error error = {KT_OK, "", ""};
    kt_model *model = compile(stretched);
    kt_run run = kt_run_fixed("dopri5", 0.0, 2.0);
    run.record = KT_RECORD_POSITION | KT_RECORD_BALANCE;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_check_true("ends there", kt_simulation_advance(simulation, 2.0, &error) != KT_OK);
    kt_note("%s: %s", error.where, error.message);
    kt_check_near("time", kt_simulation_time(simulation), 1.43329539, 1e-9);
    kt_check_below("evaluations for works", (double)kt_simulation_counts_of(simulation).balance, 2e3);
}

/* A checkpoint between records of one long step. */
KT_TEST(works_go_on_bit_for_bit_within_a_long_step) {
    static account whole, first, second;
    kt_error error;
    kt_model *model = compile(crank);
    kt_run run = kt_run_fixed("dopri5", 0.0, 4.0);
    run.interval = 0.01;
    run.record = KT_RECORD_POSITION | KT_RECORD_BALANCE;
    kt_worst worst = kt_worst_make("supplied, J");
    whole = (account){.worst = &worst, .method = "dopri5", .right = supplied_to_crank, .bound = 1e-9, .stop_at = -1};
    first = second = whole;
    first.stop_at = 237;
    kt_simulation *one = kt_test_simulation(model, &run, NULL), *two = kt_test_simulation(model, &run, NULL),
                  *three = kt_test_simulation(model, &run, NULL);
    if (three != NULL) {
        kt_test_run(one, enter, &whole);
        kt_check_equal_int("first", kt_simulation_run(two, enter, &first, &error), KT_ERROR_CALLBACK);
        (void)kt_scene_hand_over(two, three);
        kt_test_run(three, enter, &second);
        kt_check_equal_bits("first", first.works, whole.works, 237);
        kt_check_equal_bits("second", second.works + 238, whole.works + 238, 401 - 238);
        kt_check_worst(&worst);
    }
}
