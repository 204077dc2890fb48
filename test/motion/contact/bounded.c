/* Fixed steps with a bound of their evaluations (kt_simulation_options.step_evaluations). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/simulation.h"
#include "simulation/simulation.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "motion/simulation/parsed.h"
#include "motion/simulation/scenes.h"
#include "random.h"

enum { TICKS = 200, CALM = 300 };
static const double tick = 1e-3, mass = 2.0, height = 0.1;

typedef struct kt_counts_of_walls {
    kt_contact_counts contacts;
    double evaluations, place;
} kt_counts_of_walls;

/* A box on four corners, above the plane z = 0, which slides along x. */
static void make_box_of(kt_parsed *m, double factor, double above, double speed, double friction, double restitution) {
    char text[2048];
    size_t used = (size_t)snprintf(
        text, sizeof text,
        "kinetree: 1\ngravity: [0, 0, -9.81]\nbodies:\n  - name: box\n    mass: %.17g\n    inertia: [%.17g, "
        "%.17g, %.17g]\n"
        "    joint: {type: free, position: {position: [0, 0, %.17g]}, velocity: {linear: [%.17g, 0, 0]}}\n    markers: "
        "{a: [0.2, 0.1, -0.1], b: [0.2, -0.1, -0.1], c: [-0.2, 0.1, -0.1], d: [-0.2, -0.1, -0.1]}\neffects:\n",
        factor * mass, factor * 0.02, factor * 0.05, factor * 0.06, height + above, speed);
    for (int i = 0; i < 4; i++)
        used += (size_t)snprintf(text + used, sizeof text - used,
                                 "  - {name: f%d, type: contact, point: box.%c, radius: 0, plane: world, axis: z, "
                                 "restitution: %.17g, friction: %.17g}\n",
                                 i, 'a' + i, restitution, friction);
    kt_parsed_make(m, text);
}

static void make_box(kt_parsed *m, double above, double speed, double friction, double restitution) {
    make_box_of(m, 1.0, above, speed, friction, restitution);
}

static kt_simulation *begin_box(const kt_parsed *m, const char *method, uint64_t bound) {
    kt_run run = kt_run_fixed(method, tick, 100.0);
    kt_simulation_options options = kt_simulation_options_default();
    run.record = KT_RECORD_REACTION;
    options.step_evaluations = bound;
    return kt_test_simulation(m->model, &run, &options);
}

/* Takes a tick. Returns its evaluations. */
static double take_tick(kt_simulation *simulation, const char *method) {
    kt_error error = {0};
    const uint64_t before = kt_simulation_counts_of(simulation).evaluations;
    kt_need_fine(method, kt_simulation_tick(simulation, tick, &error), &error);
    return (double)(kt_simulation_counts_of(simulation).evaluations - before);
}

/* Pushes a box with random wrenches that overturn it. Returns the largest number of evaluations of a tick. */
static double push_box_of(kt_simulation *simulation, kt_random *random, const char *method, double factor, int ticks) {
    double worst = 0.0;
    for (int k = 0; k < ticks; k++) {
        kt_wrench wrench[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}};
        kt_error error = {0};
        for (int i = 0; i < 3; i++)
            (&wrench[1].moment.x)[i] = factor * kt_random_uniform(random, -4.0, 4.0);
        wrench[1].force = kt_vec3_scale(factor, kt_vec3_make(kt_random_uniform(random, -20.0, 20.0),
                                                             kt_random_uniform(random, -20.0, 20.0),
                                                             kt_random_uniform(random, -40.0, 10.0)));
        if (k % 5 == 0)
            kt_need_fine("wrench", kt_simulation_set_wrenches(simulation, wrench, &error), &error);
        worst = fmax(worst, take_tick(simulation, method));
    }
    return worst;
}

static double push_box(kt_simulation *simulation, kt_random *random, const char *method, int ticks) {
    return push_box_of(simulation, random, method, 1.0, ticks);
}

/* The bound holds in every tick. Once the box rests, the simulation follows events again: with rk4, each tick then
 * takes four evaluations, and no time step completes another tick. */
KT_TEST(no_tick_exceeds_its_evaluations) {
    static const struct {
        const char *name;
        double stages;
    } methods[] = {{"rk4", 4.0}, {"heun", 2.0}};
    kt_random random = kt_random_of_test();
    double unbounded = 0.0, completed = 0.0;
    for (int n = 0; n < 8; n++) {
        const char *method = methods[n % 2].name;
        const double bound = n % 4 < 2 ? 20.0 : 60.0;
        kt_error error = {0};
        kt_parsed m;
        make_box(&m, 1e-3, 0.5, 0.3 + 0.1 * n, n % 3 * 0.3);
        kt_simulation *simulation = begin_box(&m, method, (uint64_t)bound), *free = begin_box(&m, method, 0);
        kt_random same = random;
        unbounded = fmax(unbounded, push_box(free, &same, method, 25));
        kt_check_below("evaluations of a tick", push_box(simulation, &random, method, TICKS), bound + 0.5);
        completed += (double)kt_simulation_contacts(simulation).completed;
        kt_need_fine("wrench", kt_simulation_set_wrenches(simulation, NULL, &error), &error);
        for (int k = 0; k < CALM; k++)
            kt_check_below("evaluations", take_tick(simulation, method), bound + 0.5);
        const uint64_t before = kt_simulation_contacts(simulation).completed;
        const double *q = kt_simulation_positions(simulation);
        kt_check_near("rests, m", q[2], height, 1e-6);
        kt_check_near("evaluations at rest", take_tick(simulation, method), methods[n % 2].stages, 0.0);
        kt_check_equal_int("completed at rest", (int64_t)(kt_simulation_contacts(simulation).completed - before), 0);
    }
    kt_check_above("ticks that a time step completed", completed, 10.0);
    kt_check_above("evaluations of a tick without a bound", unbounded, 60.0);
}

/* Implicit methods iterate, and dop853 evaluates more often where a step ends at an event. Both keep the bound. */
KT_TEST(no_tick_of_costlier_methods_exceeds_its_evaluations) {
    static const struct {
        const char *name;
        uint64_t bound;
    } methods[] = {{"dop853", 24}, {"radau5", 75}, {"implicit-euler", 75}, {"crank-nicolson", 75}};
    kt_random random = kt_random_of_test();
    for (int n = 0; n < 8; n++) {
        const char *method = methods[n % 4].name;
        kt_parsed m;
        kt_note("%s", method);
        make_box(&m, 1e-3, 0.5, 0.3 + 0.1 * n, n % 3 * 0.3);
        kt_simulation *simulation = begin_box(&m, method, methods[n % 4].bound);
        kt_check_below("evaluations of a tick", push_box(simulation, &random, method, TICKS),
                       (double)methods[n % 4].bound + 0.5);
        kt_check_above("completed", (double)kt_simulation_contacts(simulation).completed, 0.5);
    }
}

/* All masses, inertias, forces and moments are multiplied by a power of 4, whose square root is exact: every number of
 * the motion is the same, and so is every count. */
KT_TEST(masses_change_neither_the_motion_nor_its_evaluations) {
    static const double factors[] = {0x1p-20, 0x1p-4, 0x1p20};
    for (int n = 0; n < 6; n++) {
        const char *method = n < 3 ? "rk4" : "dopri5";
        kt_random random = kt_random_of_test(), same = random;
        kt_parsed m, twin;
        make_box_of(&m, 1.0, 1e-3, 0.5, 0.5, 0.3);
        make_box_of(&twin, factors[n % 3], 1e-3, 0.5, 0.5, 0.3);
        kt_simulation *simulation = begin_box(&m, method, 24), *other = begin_box(&twin, method, 24);
        kt_note("%s, masses times %g", method, factors[n % 3]);
        for (int k = 0; k < 20; k++) {
            const double worst = push_box_of(simulation, &random, method, 1.0, 10);
            kt_check_near("worst tick", push_box_of(other, &same, method, factors[n % 3], 10), worst, 0.0);
        }
        const kt_contact_counts one = kt_simulation_contacts(simulation), two = kt_simulation_contacts(other);
        kt_check_above("completed", (double)one.completed, 10.0);
        kt_check_equal_int("completed", (int64_t)two.completed, (int64_t)one.completed);
        kt_check_equal_int("impacts", (int64_t)two.impacts, (int64_t)one.impacts);
        kt_check_equal_int("evaluations", (int64_t)kt_simulation_counts_of(other).evaluations,
                           (int64_t)kt_simulation_counts_of(simulation).evaluations);
        kt_check_equal_bits("positions", kt_simulation_positions(other), kt_simulation_positions(simulation), 7);
        kt_check_equal_bits("velocities", kt_simulation_velocities(other), kt_simulation_velocities(simulation), 6);
    }
}

/* A box that slides onto the floor, with a bound that leaves no room to search the impact. The impact takes
 * mu sqrt(2 g h) from the speed v, and then the box slides on by v^2 / 2 mu g. A time step has an error of the order
 * of h v. */
KT_TEST(time_steps_complete_a_slide_to_its_closed_form) {
    static const double g = 9.81, speed = 1.0, friction = 0.4, above = 1e-3;
    kt_parsed m;
    make_box(&m, above, speed, friction, 0.0);
    kt_simulation *simulation = begin_box(&m, "rk4", 9);
    for (int k = 0; k < 400; k++)
        (void)take_tick(simulation, "rk4");
    const double fall = sqrt(2.0 * above / g), slides = speed - friction * sqrt(2.0 * g * above);
    const double exact = speed * fall + slides * slides / (2.0 * friction * g);
    kt_check_above("steps that a time step completed", (double)kt_simulation_contacts(simulation).completed, 0.5);
    kt_check_near("place, m", kt_simulation_positions(simulation)[0], exact, 2.0 * tick * speed);
    kt_check_near("height, m", kt_simulation_positions(simulation)[2], height, 1e-6);
    kt_check_below("speed, m/s", fabs(kt_simulation_velocities(simulation)[0]), 1e-9);
}

/* A bound that no tick reaches changes no bit. Even without a bound, no tick takes thousands of evaluations: it took
 * 39,459 if decisions about slow slip predict other directions than steps, and corners open and close in turns. */
KT_TEST(bound_that_is_not_reached_changes_nothing) {
    kt_random random = kt_random_of_test(), same = random;
    kt_parsed m;
    make_box(&m, 1e-3, 0.5, 0.5, 0.3);
    kt_simulation *with = begin_box(&m, "rk4", 1000000), *without = begin_box(&m, "rk4", 0);
    const double worst = push_box(without, &same, "rk4", 100);
    kt_check_near("evaluations", push_box(with, &random, "rk4", 100), worst, 0.0);
    kt_check_below("evaluations of a tick without a bound", worst, 2000.0);
    kt_check_equal_bits("positions", kt_simulation_positions(with), kt_simulation_positions(without), 7);
    kt_check_equal_bits("velocities", kt_simulation_velocities(with), kt_simulation_velocities(without), 6);
    kt_check_equal_int("completed", (int64_t)kt_simulation_contacts(with).completed, 0);
}

/* A checkpoint between ticks goes on with equal bits, also behind a time step. */
KT_TEST(bounded_ticks_resume_from_a_checkpoint) {
    kt_random random = kt_random_of_test();
    kt_error error = {0};
    kt_parsed m;
    make_box(&m, 1e-3, 0.5, 0.5, 0.3);
    kt_simulation *simulation = begin_box(&m, "rk4", 20), *other = begin_box(&m, "rk4", 20);
    const size_t size = kt_simulation_state_size(simulation);
    void *block = malloc(size);
    int behind = 0;
    kt_need(kt_check_true("memory", block != NULL));
    for (int n = 0; n < 60; n++) {
        const uint64_t before = kt_simulation_contacts(simulation).completed;
        (void)push_box(simulation, &random, "rk4", 5);
        behind += kt_simulation_contacts(simulation).completed > before;
        kt_simulation_save(simulation, block);
        kt_need_fine("restores", kt_simulation_restore(other, block, &error), &error);
        kt_random same = random, twin = random;
        (void)push_box(simulation, &same, "rk4", 3);
        (void)push_box(other, &twin, "rk4", 3);
        kt_check_equal_bits("positions", kt_simulation_positions(simulation), kt_simulation_positions(other), 7);
        kt_check_equal_bits("velocities", kt_simulation_velocities(simulation), kt_simulation_velocities(other), 6);
        random = same;
    }
    free(block);
    kt_check_above("checkpoints behind time steps", behind, 5.0);
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

enum { CORNERS = 4, ROWS = 1100 };

/* Records of a run, judged one by one. */
typedef struct judged {
    bool pauses; /* the recorder stops the run at each record */
    int count, loaded;
    double newton, cone; /* the largest residuals, as parts of the weight */
    double q[ROWS][7];
} judged;

/* A recorder: Newton's law of the box, and the cones of its contacts. */
static int judge(const kt_record *record, void *user) {
    static const double g = 9.81;
    judged *j = user;
    kt_vec3 left = kt_vec3_make(mass * record->a[0], mass * record->a[1], mass * (record->a[2] + g));
    double most = 0.0;
    for (int k = 0; k < CORNERS; k++) {
        kt_contact_load load;
        kt_error error = {0};
        kt_need_fine("load", kt_record_contact(record, k, &load, &error), &error);
        left = kt_vec3_sub(left, load.force);
        most = fmax(most, fmax(-load.force.z, hypot(load.force.x, load.force.y) - 0.5 * load.force.z));
        j->loaded += load.force.z > 0.0;
    }
    j->newton = fmax(j->newton, kt_vec3_norm(left) / (mass * g));
    j->cone = fmax(j->cone, most / (mass * g));
    kt_need(kt_check_true("room", j->count < ROWS));
    memcpy(j->q[j->count++], record->q, sizeof j->q[0]);
    return j->pauses;
}

/* A run of the box, which bounces. Each impact exceeds the bound. */
static kt_simulation *begin_run_of_box(const kt_parsed *m, double interval) {
    kt_run run = kt_run_fixed("rk4", tick, 0.3);
    kt_simulation_options options = kt_simulation_options_default();
    run.record = KT_RECORD_POSITION | KT_RECORD_ACCELERATION | KT_RECORD_REACTION;
    run.interval = interval;
    options.step_evaluations = 9;
    return kt_test_simulation(m->model, &run, &options);
}

/* Records lie within time steps and at their ends. The forces of all of them obey the laws, and no record changes the
 * motion. */
KT_TEST(records_of_completed_steps_obey_the_laws_and_do_not_change_the_motion) {
    static judged many, few;
    kt_error error = {0};
    kt_parsed m;
    many = few = (judged){.count = 0};
    make_box(&m, 1e-2, 0.5, 0.5, 0.5);
    kt_simulation *with = begin_run_of_box(&m, 0.3e-3), *without = begin_run_of_box(&m, 0.3);
    kt_need_fine("many records", kt_simulation_run(with, judge, &many, &error), &error);
    kt_need_fine("few records", kt_simulation_run(without, judge, &few, &error), &error);
    const kt_contact_counts counts = kt_simulation_contacts(with);
    const kt_completed_steps first = kt_simulation_completed_steps(with);
    kt_check_above("completed", (double)counts.completed, 5.0);
    kt_check_above("time of the first, s", first.time, sqrt(2.0 * 1e-2 / 9.81) - tick);
    kt_check_below("time of the first, s", first.time, sqrt(2.0 * 1e-2 / 9.81));
    kt_check_above("records within a time step", (double)first.records, 10.0);
    kt_check_above("contacts with a force", many.loaded, 100.0);
    kt_check_below("Newton's law", many.newton, 1e-12);
    kt_check_below("pulls, or friction beyond its cone", many.cone, 1e-12);
    kt_check_equal_int("few records", few.count, 2);
    kt_check_equal_int("completed", (int64_t)kt_simulation_contacts(without).completed, (int64_t)counts.completed);
    kt_check_equal_int("records within a time step", (int64_t)kt_simulation_completed_steps(without).records, 0);
    (void)kt_scene_check_equal("motion", without, with);
}

/* A run that stops at each record, and goes on in another simulation, has equal bits: within time steps, too. */
KT_TEST(bounded_runs_resume_at_each_record) {
    static judged whole, parts;
    kt_error error = {0};
    kt_parsed m;
    whole = parts = (judged){.count = 0};
    parts.pauses = true;
    make_box(&m, 1e-2, 0.5, 0.5, 0.5);
    kt_simulation *one = begin_run_of_box(&m, 0.3e-3),
                  *two[] = {begin_run_of_box(&m, 0.3e-3), begin_run_of_box(&m, 0.3e-3)};
    void *block = malloc(kt_simulation_state_size(one));
    int now = 0;
    kt_need(kt_check_true("memory", block != NULL));
    kt_need_fine("whole", kt_simulation_run(one, judge, &whole, &error), &error);
    while (parts.count < ROWS && kt_simulation_run(two[now], judge, &parts, &error) == KT_ERROR_CALLBACK) {
        kt_simulation_save(two[now], block);
        now = 1 - now;
        kt_need_fine("restores", kt_simulation_restore(two[now], block, &error), &error);
    }
    free(block);
    kt_check_equal_int("records", parts.count, whole.count);
    kt_check_equal_bits("positions", parts.q[0], whole.q[0], 7 * (size_t)whole.count);
    kt_check_equal_int("records within a time step", (int64_t)kt_simulation_completed_steps(two[now]).records,
                       (int64_t)kt_simulation_completed_steps(one).records);
    (void)kt_scene_check_equal("motion", two[now], one);
}

/* A ball between two walls, without gravity, at 1 m/s and 1 mm from wall to wall: 1,000 impacts in one step of 1 s. */
static kt_counts_of_walls step_between_walls(uint64_t of_step, uint64_t of_part) {
    kt_counts_of_walls found;
    kt_error error = {0};
    kt_parsed m;
    kt_run run = kt_run_fixed("rk4", 1.0, 10.0);
    kt_simulation_options options = kt_simulation_options_default();
    options.step_evaluations = of_step;
    options.stall_evaluations = of_part;
    kt_parsed_make(&m, "kinetree: 1\ngravity: [0, 0, 0]\nbodies:\n  - {name: ball, mass: 2, joint: {type: prismatic, "
                       "axis: x, position: 5e-4, velocity: 1}}\neffects:\n  - {type: joint_limit, name: wall, joint: "
                       "ball, lower: 0, upper: 1e-3, restitution: 1}\n");
    kt_simulation *simulation = kt_test_simulation(m.model, &run, &options);
    kt_need_fine("a step", kt_simulation_tick(simulation, 1.0, &error), &error);
    found.contacts = kt_simulation_contacts(simulation);
    found.evaluations = (double)kt_simulation_counts_of(simulation).evaluations;
    found.place = kt_simulation_positions(simulation)[0];
    return found;
}

/* A try that fails next to t = 0 may leave a length of 1e-30 s for the next step. If a time step then completes the
 * fixed step, this length is lost in the rounding of the new time. A length that this rounding resolves replaces it. */
KT_TEST(a_length_before_a_time_step_may_be_lost_behind_it) {
    kt_parsed m;
    make_box(&m, 0.0, 1.0, 0.4, 0.0);
    kt_simulation *simulation = begin_box(&m, "heun", 0);
    (void)take_tick(simulation, "heun");
    simulation->memory.shortened = 1e-30;
    (void)take_tick(simulation, "heun");
    kt_check_near("time, s", kt_simulation_time(simulation), 2.0 * tick, 0.0);
}

/* A bound of a whole step ends the impacts within it. A bound of its parts does not, because the time goes on: 1,000
 * impacts later, the ball is where it began. Parts in which the time stalls are bounded. */
KT_TEST(steps_that_advance_are_not_completed_and_steps_that_stall_are) {
    const kt_counts_of_walls free = step_between_walls(0, 0), step = step_between_walls(200, 0),
                             part = step_between_walls(0, 200), both = step_between_walls(200, 200),
                             stall = step_between_walls(0, 9);
    kt_check_above("evaluations without a bound", free.evaluations, 2000.0);
    kt_check_equal_int("impacts in a whole step", (int64_t)part.contacts.impacts, 1000);
    kt_check_equal_int("completed", (int64_t)part.contacts.completed, 0);
    kt_check_equal_bits("place", &part.place, &free.place, 1);
    kt_check_near("place, m", part.place, 5e-4, 1000.0 * 4.0 * DBL_EPSILON); /* roundings of the times of impacts */
    kt_check_equal_int("completed: bound of a step", (int64_t)step.contacts.completed, 1);
    kt_check_below("evaluations", step.evaluations, 201.0);
    kt_check_equal_int("completed: both bounds", (int64_t)both.contacts.completed, 1);
    kt_check_below("evaluations", both.evaluations, 201.0);
    kt_check_equal_int("completed: a part that stalls", (int64_t)stall.contacts.completed, 1);
}

KT_TEST(bounds_that_cannot_hold_are_rejected) {
    kt_parsed m;
    kt_error error = {0};
    kt_simulation *simulation;
    make_box(&m, 1e-3, 0.5, 0.5, 0.3);
    kt_run run = kt_run_fixed("rk4", tick, 1.0);
    kt_simulation_options options = kt_simulation_options_default();
    options.step_evaluations = 8;
    kt_check_equal_int("too few", kt_simulation_create(m.model, &run, &options, &simulation, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_contains("least", error.message, "9 or more");
    options.step_evaluations = 100;
    run = kt_run_within("dopri5", 1e-9, 1.0);
    kt_check_equal_int("adaptive", kt_simulation_create(m.model, &run, &options, &simulation, &error),
                       KT_ERROR_ARGUMENT);
    kt_check_text("where", error.where, "step_evaluations");
}
