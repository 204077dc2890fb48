/* The times and the contents of records. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* A block that slides at 1 m/s: q(t) = t, which every method of order 1 integrates exactly but for rounding. */
static kt_model *make_slider(void) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    lone.body.joint.velocity[0] = 1.0;
    return kt_scene_compile(&lone.description);
}

/* Runs and checks that record k has the time k * interval to the bit, but the last one the duration. */
static void check_times(const kt_model *model, kt_run run, int expected) {
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_kept *kept = kt_kept_empty(model);
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("records", kept->count, expected);
    kt_check_equal_int("records told before", kt_simulation_record_count(simulation), expected);
    double interval = run.interval > 0.0 ? run.interval : run.duration / 1000.0;
    int wrong = 0;
    for (int k = 0; k < kept->count; k++) {
        double time = k == expected - 1 ? run.duration : k * interval;
        if (memcmp(&kept->time[k], &time, sizeof time) != 0 || kept->index[k] != k)
            wrong++;
    }
    kt_check_equal_int("times or indices that are wrong", wrong, 0);
    kt_check_equal_bits("end of the simulation", &(double){kt_simulation_time(simulation)}, &run.duration, 1);
}

KT_TEST(records_fall_on_multiples_and_on_the_duration) {
    kt_model *model = make_slider();
    kt_run run = kt_run_default();
    run.duration = 10.0;
    run.interval = 0.01;
    check_times(model, run, 1001);
    run.duration = 1.05; /* the last interval is half as long */
    run.interval = 0.1;
    check_times(model, run, 12);
    run.duration = 0.3; /* 3 * 0.1 is above 0.3 by an ulp */
    check_times(model, run, 4);
    run.duration = 0.7; /* 0.7 / 0.1 is below 7 by an ulp */
    check_times(model, run, 8);
    run.duration = 2.1; /* 2.1 / 0.3 is above 7 by an ulp */
    run.interval = 0.3;
    check_times(model, run, 8);
    run.duration = 1.0;
    run.interval = 3.0; /* longer than the run */
    check_times(model, run, 2);
    run.duration = 2.0;
    run.interval = 0.0;
    check_times(model, run, 1001);
    run.duration = 0.0;
    check_times(model, run, 1);
}

/* Steps of 0.3 s and records every 0.07 s: most lie within steps, and no step ends for them. */
KT_TEST(records_do_not_shorten_steps) {
    kt_model *model = make_slider();
    kt_run run = kt_run_fixed("rk4", 0.3, 3.0);
    run.interval = 0.07;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_kept *kept = kt_kept_empty(model);
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("steps", (long long)kt_simulation_counts_of(simulation).steps, 10);
    kt_check_equal_int("records", kept->count, 44);
    /* Ten additions of h v, each rounded to half an ulp of 3. */
    KT_WORST position = kt_worst_make("position against time");
    for (int k = 0; k < kept->count; k++)
        kt_worst_near(&position, kept->state[k][0], kept->time[k], 10.0 * DBL_EPSILON, "t = %g", kept->time[k]);
}

/* 3.5 steps of 0.3 s: the last one is shortened, and the end is the duration to the bit. */
KT_TEST(duration_need_not_be_a_multiple_of_the_step) {
    kt_model *model = make_slider();
    kt_run run = kt_run_fixed("rk4", 0.3, 1.05);
    run.interval = 1.0;
    check_times(model, run, 3);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_run(simulation, kt_keep, kt_kept_empty(model));
    kt_check_equal_int("steps", (long long)kt_simulation_counts_of(simulation).steps, 4);
    kt_check_near("position", kt_simulation_positions(simulation)[0], 1.05, 4.0 * DBL_EPSILON);
}

/* A recorder that stops has had its record; the next run goes on with the one after it, though the clock is beyond. */
KT_TEST(run_goes_on_after_a_recorder_that_stopped) {
    kt_model *model = make_slider();
    kt_run run = kt_run_fixed("dopri5", 0.5, 2.0);
    run.interval = 0.1;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_kept *kept = kt_kept_empty(model);
    kt_error error;
    kept->stop_at = 7; /* within the second step */
    kt_check_equal_int("status", kt_simulation_run(simulation, kt_keep, kept, &error), KT_ERROR_CALLBACK);
    kt_check_contains("message", error.message, "record 7");
    kt_check_contains("where", error.where, "t = 0.7");
    kt_check_equal_int("records before", kept->count, 8);
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("records after", kept->count, 21);
    KT_WORST position = kt_worst_make("position against time");
    for (int k = 0; k < kept->count; k++)
        kt_worst_near(&position, kept->state[k][0], 0.1 * k, 8.0 * DBL_EPSILON, "k = %d", k);
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("nothing is recorded twice", kept->count, 21);
}

KT_TEST(run_after_advance_records_from_there_on) {
    kt_model *model = make_slider();
    kt_run run = kt_run_default();
    run.duration = 1.0;
    run.interval = 0.125;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_kept *kept = kt_kept_empty(model);
    kt_test_advance(simulation, 0.5);
    kt_check_equal_bits("time", &(double){kt_simulation_time(simulation)}, &(double){0.5}, 1);
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("records", kept->count, 5);
    kt_check_equal_int("first", kept->index[0], 4);

    simulation = kt_test_simulation(model, &run, NULL);
    kept = kt_kept_empty(model);
    kt_test_advance(simulation, 0.55);
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("first after", kept->index[0], 5);
    kt_check_equal_int("all after", kept->count, 4);
}

/* ---- what is in a record ----------------------------------------------------------------------------------------- */

/* A pendulum at angle u and rate w has a = -g sin u, T = w^2 / 2, V = -g cos u. The link pulls the bob, and the joint
 * pulls the link, with m (g cos u + w^2) towards the pivot. Angles and rates are those of the record, so rounding alone
 * is left.
 */
static int check_pendulum(const kt_record *record, void *user) {
    kt_worst *worst = user;
    double u = record->q[0], w = record->v[0], g = 9.81, scale = g + w * w;
    double pull = g * cos(u) + w * w; /* along (-sin u, cos u), and -g sin u across is the acceleration of the bob */
    kt_worst_near(&worst[0], record->a[0], -g * sin(u), 4.0 * DBL_EPSILON * g, "t = %g", record->t);
    kt_worst_near(&worst[1], record->kinetic, 0.5 * w * w, 8.0 * DBL_EPSILON * (1.0 + w * w), "t = %g", record->t);
    kt_worst_near(&worst[2], record->potential, -g * cos(u), 4.0 * DBL_EPSILON * g, "t = %g", record->t);
    kt_wrench joint = record->reactions[1];
    kt_worst_near(&worst[3], joint.force.x, -pull * sin(u), 16.0 * DBL_EPSILON * scale, "t = %g", record->t);
    kt_worst_near(&worst[4], joint.force.y, pull * cos(u), 16.0 * DBL_EPSILON * scale, "t = %g", record->t);
    kt_worst_near(&worst[5], joint.moment.z, 0.0, 16.0 * DBL_EPSILON * scale, "t = %g", record->t);
    kt_worst_near(&worst[6], record->constraint.position, 0.0, 0.0, "t = %g", record->t);
    return 0;
}

KT_TEST(record_has_what_was_asked_for) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    run.duration = 2.0;
    run.interval = 0.05;
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_ENERGY | KT_RECORD_REACTION | KT_RECORD_CONSTRAINT;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_worst worst[7] = {
        kt_worst_make("acceleration"),         kt_worst_make("kinetic energy"),     kt_worst_make("potential energy"),
        kt_worst_make("reaction, horizontal"), kt_worst_make("reaction, vertical"), kt_worst_make("reaction, moment"),
        kt_worst_make("constraint of a tree"),
    };
    kt_test_run(simulation, check_pendulum, worst);
    for (int i = 0; i < 7; i++)
        kt_check_worst(&worst[i]);
}

static int check_nothing_more(const kt_record *record, void *user) {
    int *more = user;
    *more += record->a != NULL || record->reactions != NULL || record->data != NULL || !isnan(record->kinetic) ||
             !isnan(record->constraint.position);
    return 0;
}

typedef struct kt_bob {
    const kt_model *model;
    kt_worst place;
} kt_bob;

static int check_bob(const kt_record *record, void *user) {
    kt_bob *bob = user;
    kt_vec3 at = kt_point_position(bob->model, record->data, 1, kt_vec3_make(0.0, -1.0, 0.0));
    kt_worst_near(&bob->place, at.x, sin(record->q[0]), 2.0 * DBL_EPSILON, "t = %g", record->t);
    kt_worst_near(&bob->place, at.y, -cos(record->q[0]), 2.0 * DBL_EPSILON, "t = %g", record->t);
    return 0;
}

KT_TEST(record_answers_queries_of_kinematics_where_asked) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_bob bob = {model, kt_worst_make("place of the bob")};
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.record = KT_RECORD_POSITION;
    options.kinematics = true;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_test_run(simulation, check_bob, &bob);
    kt_check_worst(&bob.place);
}

/* With time steps over contacts, accelerations are computed like a record. Records after them have only what was
 * requested. */
KT_TEST(accelerations_that_are_read_add_nothing_to_records) {
    kt_lone lone;
    kt_effect stop = kt_effect_of(KT_EFFECT_JOINT_LIMIT, "block");
    kt_error error = {0};
    double a = 0.0;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
    stop.lower = -0.5;
    stop.restitution = 0.5;
    lone.description.effects = &stop;
    lone.description.effect_count = 1;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    run.integrator = NULL;
    run.step = 0.01;
    run.duration = 1.0;
    options.contact = KT_CONTACT_STEPS;
    run.record = KT_RECORD_POSITION;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    int more = 0;
    kt_need_fine("acceleration", kt_simulation_acceleration(simulation, &a, &error), &error);
    kt_test_run(simulation, check_nothing_more, &more);
    kt_check_equal_int("records with more", more, 0);
}

KT_TEST(record_has_nothing_that_was_not_asked_for) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    run.record = KT_RECORD_POSITION;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    int more = 0;
    kt_test_run(simulation, check_nothing_more, &more);
    kt_check_equal_int("records with more", more, 0);
}
