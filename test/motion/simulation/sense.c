/* Sensors: a record of the present state has the bits of a run that evaluates everything anew. Showing it costs no
 * evaluation and moves no bit. Every bundled scene is held to that.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "scene_files.h"
#include "scenes.h"

#include "kinetree/scene.h"
#include "kinetree/study.h"
#include "model/model.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { STEPS = 12, MOST = 4096, TREE = 60 }; /* bodies: more take long */

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

typedef void visitor(const char *name, const kt_model *model, const kt_run *run, void *user);

/* Every bundled scene, one after the other; run is the scene's own. */
static void for_each_scene(visitor *visit, void *user) {
    kt_check_above("scenes", kt_bundled_count(), 40);
    for (int i = 0; kt_bundled(i) != NULL; i++) {
        const kt_scene *scene = kt_test_bundled(kt_bundled(i));
        const kt_description *description = &scene->description;
        kt_model_options options = kt_model_options_default();
        const bool large = description->body_count > TREE || kt_is_switched(description); /* its events evaluate, too */
        options.reduction = kt_reduction_method_of(scene->reduction);
        options.metric = scene->run.metric;
        if (large)
            continue;
        visit(kt_bundled(i), kt_test_model(description, &options), &scene->run, user);
    }
}

/* A fixed step that suits the scene. Stiff springs and dampers allow no larger one. */
static kt_run run_of(const char *name, const kt_run *given, const char *method, unsigned record) {
    const bool stiff =
        strcmp(name, "flyball-governor") == 0 || strcmp(name, "fishing-rod") == 0 || strcmp(name, "five-bar") == 0;
    const double part = stiff ? 1e-6 : 1e-4;
    kt_run run = kt_run_fixed(method, part * given->duration, STEPS * (part * given->duration));
    run.interval = run.step;
    run.record = record;
    return run;
}

static kt_simulation *simulate(const kt_model *model, const kt_run *run) {
    kt_simulation_options options = kt_simulation_options_default();
    options.kinematics = true;
    return kt_test_simulation(model, run, &options);
}

/* ---- what is shown ----------------------------------------------------------------------------------------------- */

/* All numbers of a record and of its data, one after the other. */
typedef struct numbers {
    int count;
    double x[MOST];
} numbers;

static void add(numbers *n, const double *x, int count) {
    for (int i = 0; x != NULL && i < count && n->count < MOST; i++)
        n->x[n->count++] = x[i];
}

static void add_bodies(numbers *n, const kt_model *model, const kt_data *data) {
    const kt_vec3 at = {0.1, -0.2, 0.3};
    for (int body = 1; body < kt_model_body_count(model); body++) {
        const kt_pose pose = kt_body_pose(model, data, body);
        const kt_twist velocity = kt_body_twist(model, data, body), change = kt_body_acceleration(model, data, body);
        const kt_vec3 p[3] = {kt_point_position(model, data, body, at), kt_point_velocity(model, data, body, at),
                              kt_point_acceleration(model, data, body, at)};
        add(n, &pose.rotation.x.x, 9);
        add(n, &velocity.angular.x, 6);
        add(n, &change.angular.x, 6);
        add(n, &p[0].x, 9);
    }
}

static void collect(const kt_model *model, const kt_record *record, numbers *n) {
    const double others[] = {record->t, record->kinetic, record->potential, record->constraint.position,
                             record->constraint.velocity};
    n->count = 0;
    add(n, record->q, kt_model_nq(model));
    add(n, record->v, kt_model_nv(model));
    add(n, record->a, kt_model_nv(model));
    add(n, others, 5);
    if (record->reactions != NULL) {
        add(n, &record->reactions[0].moment.x, 6 * kt_model_body_count(model));
        add(n, &record->loop_reactions[0].moment.x, 6 * kt_loop_count(model));
        add(n, record->multipliers, kt_model_mobility(model).equations);
    }
    if (record->data != NULL)
        add_bodies(n, model, record->data);
}

typedef struct album {
    const kt_model *model;
    int count;
    numbers *page; /* STEPS + 1 */
} album;

static int keep(const kt_record *record, void *user) {
    album *a = user;
    if (a->count > STEPS)
        return -1;
    collect(a->model, record, &a->page[a->count++]);
    return 0;
}

/* ---- the same bits ----------------------------------------------------------------------------------------------- */

typedef struct comparison {
    const char *method;
    unsigned record;
    long compared, differing;
    char first[160];
} comparison;

static void compare(const char *name, const kt_model *model, const kt_run *given, void *user) {
    static numbers pages[STEPS + 1], shown;
    comparison *c = user;
    const kt_run run = run_of(name, given, c->method, c->record);
    kt_simulation *recorded = simulate(model, &run), *sensed = simulate(model, &run);
    album a = {model, 0, pages};
    kt_record record;
    kt_error error;
    bool fine = kt_fine(name, kt_simulation_run(recorded, keep, &a, &error), &error);
    for (int k = 0; k <= STEPS && fine; k++) {
        fine = kt_fine(name, kt_simulation_sense(sensed, &record, &error), &error);
        if (!fine)
            break;
        collect(model, &record, &shown);
        c->compared += shown.count;
        for (int i = 0; i < shown.count; i++) {
            const bool same = memcmp(&shown.x[i], &pages[k].x[i], sizeof(double)) == 0;
            if (!same && c->differing++ == 0)
                snprintf(c->first, sizeof c->first, "%s: record %d, number %d of %d: %.17g, not %.17g", name, k, i,
                         shown.count, shown.x[i], pages[k].x[i]);
        }
        c->differing += shown.count != pages[k].count;
        if (k < STEPS)
            fine = kt_fine(name, kt_simulation_step(sensed, HUGE_VAL, &error), &error);
    }
}

static const unsigned every = KT_RECORD_ACCELERATION | KT_RECORD_REACTION | KT_RECORD_ENERGY;

static void check_all(const char *method, unsigned record) {
    comparison c = {.method = method, .record = record};
    for_each_scene(compare, &c);
    if (c.differing > 0)
        kt_note("%s, records %u: %s", method, record, c.first);
    kt_check_above("numbers compared", (double)c.compared, 10000.0);
    kt_check_equal_int(method, c.differing, 0);
}

KT_TEST(sensors_show_to_the_bit_what_a_run_records) {
    static const char *const methods[] = {"rk4", "dopri5", "dop853", "rkc2"};
    for (int i = 0; i < 4; i++)
        check_all(methods[i], every);
}

/* Each part by itself, without the values that the others leave or spoil. */
KT_TEST(sensors_show_to_the_bit_each_part_alone) {
    static const unsigned parts[] = {KT_RECORD_POSITION,
                                     KT_RECORD_ACCELERATION,
                                     KT_RECORD_REACTION,
                                     KT_RECORD_ACCELERATION | KT_RECORD_CONSTRAINT,
                                     KT_RECORD_REACTION | KT_RECORD_CONSTRAINT,
                                     KT_RECORD_BALANCE};
    for (size_t i = 0; i < sizeof parts / sizeof *parts; i++) {
        check_all("rk4", parts[i]);
        check_all("tsit5", parts[i]);
    }
}

/* Passes through ten singular positions of two four-bars in a row. At and next to these positions, accelerations are
 * those of nearby states. The oracles are an evaluation and kinematics from nothing, with data of their own. */
KT_TEST(sensors_show_to_the_bit_what_a_singular_position_does) {
    static kt_wrench joints[16], loops[16];
    static double multipliers[16];
    kt_error error;
    kt_record record;
    const kt_opened opened = kt_test_open(kt_test_bundled("n-four-bar-2"), NULL);
    kt_model *model = opened.model;
    kt_data *data = opened.data;
    kt_run run = kt_run_fixed("rk4", 2e-3, 10.0);
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_REACTION;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    int near = 0, differing = 0;
    for (int k = 0; k < 5000; k++) {
        kt_need_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
        kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
        kt_need_fine("reactions",
                     kt_reaction_evaluate(model, data, record.t, record.q, record.v, NULL, NULL, joints, loops, &error),
                     &error);
        kt_need_fine("multipliers",
                     kt_multiplier_evaluate(model, data, record.t, record.q, record.v, NULL, NULL, multipliers, &error),
                     &error);
        near += data->interpolated;
        differing += memcmp(multipliers, record.multipliers,
                            (size_t)kt_model_mobility(model).equations * sizeof *multipliers) != 0;
        differing += memcmp(joints, record.reactions, (size_t)kt_model_body_count(model) * sizeof *joints) != 0;
        differing += memcmp(loops, record.loop_reactions, (size_t)kt_loop_count(model) * sizeof *loops) != 0;
        (void)kt_fine("kinematics", kt_kinematics_update(model, data, record.q, record.v, record.a, &error), &error);
        for (int body = 1; body < kt_model_body_count(model); body++) {
            const kt_twist a = kt_body_acceleration(model, record.data, body),
                           b = kt_body_acceleration(model, data, body);
            differing += memcmp(&a, &b, sizeof a) != 0;
        }
    }
    kt_check_above("states at singular positions", near, 10);
    kt_check_equal_int("differing", differing, 0);
}

/* ---- what it costs ----------------------------------------------------------------------------------------------- */

/* When torques are set. */
typedef enum moment { NEVER, BEFORE_SENSING, AFTER_SENSING } moment;

typedef struct price {
    const char *method;
    bool fixed;
    moment order;
    int scenes;
    long more;        /* evaluations and factorisations that sensing has added, over all scenes */
    long least, most; /* that it may add */
    long moved;       /* scenes whose state differs */
} price;

static void set(kt_simulation *simulation, int nv, int k) {
    double torque[MOST];
    kt_error error;
    for (int i = 0; i < nv && i < MOST; i++)
        torque[i] = 1e-3 * sin(1.0 + k + 0.7 * i);
    (void)kt_fine("torques", kt_simulation_set_torque(simulation, torque, &error), &error);
}

static bool go(const char *name, kt_simulation *simulation, int nv, bool senses, moment order) {
    kt_record record;
    kt_error error;
    bool fine = true;
    for (int k = 0; k < STEPS && fine; k++) {
        if (order == BEFORE_SENSING)
            set(simulation, nv, k);
        fine = !senses || kt_fine(name, kt_simulation_sense(simulation, &record, &error), &error);
        if (order == AFTER_SENSING)
            set(simulation, nv, k);
        fine = fine && kt_fine(name, kt_simulation_step(simulation, HUGE_VAL, &error), &error);
    }
    return fine;
}

static void count(const char *name, const kt_model *model, const kt_run *given, void *user) {
    price *p = user;
    kt_run run = run_of(name, given, p->method, KT_RECORD_ACCELERATION | KT_RECORD_REACTION);
    if (!p->fixed)
        run.step = 0.0;
    run.interval = 0.0;
    const int nq = kt_model_nq(model), nv = kt_model_nv(model);
    kt_simulation *plain = simulate(model, &run), *sensed = simulate(model, &run);
    if (go(name, plain, nv, false, p->order) && go(name, sensed, nv, true, p->order)) {
        const kt_simulation_counts a = kt_simulation_counts_of(plain), b = kt_simulation_counts_of(sensed);
        const double *q[2] = {kt_simulation_positions(plain), kt_simulation_positions(sensed)};
        const long more = (long)(b.evaluations - a.evaluations);
        if (more > 0 && p->order != AFTER_SENSING)
            kt_note("%s, %s: %ld evaluations more", name, p->method, more);
        p->more += more + (p->order == AFTER_SENSING ? 0 : (long)(b.factorizations - a.factorizations));
        p->moved += memcmp(q[0], q[1], (size_t)(nq + nv) * sizeof(double)) != 0;
        /* a step that ends with an evaluation of its last state needs no other, unless projection moves that state */
        const bool ends = kt_method_find(p->method)->fsal, stays = nq == nv && kt_loop_count(model) == 0;
        p->least += p->order != AFTER_SENSING ? 0 : ends ? 1 : STEPS;
        p->most += p->order != AFTER_SENSING ? 0 : ends && stays ? 1 : STEPS;
        p->scenes++;
    }
}

static void check_price(price p) {
    for_each_scene(count, &p);
    kt_check_above("scenes", p.scenes, 40);
    if (p.least > 0)
        kt_check_above(p.method, (double)p.more, (double)p.least);
    else
        kt_check_below("fewer evaluations", -(double)p.more, 0.0);
    kt_check_below(p.method, (double)p.more, (double)p.most);
    kt_check_equal_int("scenes that move otherwise", p.moved, 0);
}

KT_TEST(steps_with_sensors_evaluate_as_often_as_without) {
    static const char *const methods[] = {"euler", "rk4", "bs32", "dopri5", "tsit5", "dop853", "rkc2", "rkc4"};
    for (size_t i = 0; i < sizeof methods / sizeof *methods; i++) {
        check_price((price){.method = methods[i], .fixed = true, .order = NEVER});
        check_price((price){.method = methods[i], .fixed = true, .order = BEFORE_SENSING});
    }
}

KT_TEST(adaptive_steps_with_sensors_are_the_same) {
    check_price((price){.method = "dopri5", .order = NEVER});
    check_price((price){.method = "dop853", .order = BEFORE_SENSING});
}

/* The first sensing always evaluates: there was no step before it. */
KT_TEST(torques_set_after_sensing_cost_an_evaluation_where_no_step_ends_with_one) {
    check_price((price){.method = "rk4", .fixed = true, .order = AFTER_SENSING});
    check_price((price){.method = "dopri5", .fixed = true, .order = AFTER_SENSING});
}

/* ---- between the steps ------------------------------------------------------------------------------------------- */

/* Stops within a step, sets a torque, looks or not, and goes on. */
static void interrupt(const kt_model *model, bool looks, album *kept) {
    kt_run run = kt_run_fixed("dopri5", 0.1, 0.1 * STEPS / 2.0);
    run.interval = 0.05;
    run.record = KT_RECORD_ACCELERATION;
    const double torque = 3.0;
    kt_simulation *simulation = simulate(model, &run);
    kt_error error;
    kt_record record;
    kt_kept *stopper = kt_kept_empty(model);
    stopper->stop_at = 4; /* at 0.2, before the step to 0.3 is made; record 5 lies within this step */
    kt_check_equal_int("stopped", kt_simulation_run(simulation, kt_keep, stopper, &error), KT_ERROR_CALLBACK);
    kt_check_true("step", kt_fine("step", kt_simulation_set_torque(simulation, &torque, &error), &error));
    stopper->stop_at = 5;
    kt_check_equal_int("stopped", kt_simulation_run(simulation, kt_keep, stopper, &error), KT_ERROR_CALLBACK);
    kt_check_near("a record is owed before the time, s", kt_simulation_time(simulation) - stopper->time[5], 0.05,
                  1e-15);
    const double other = -2.0;
    (void)kt_fine("torque", kt_simulation_set_torque(simulation, &other, &error), &error);
    if (looks && kt_fine("sense", kt_simulation_sense(simulation, &record, &error), &error)) {
        double a;
        kt_check_near("time, s", record.t, kt_simulation_time(simulation), 0.0);
        (void)kt_fine("acceleration", kt_simulation_acceleration(simulation, &a, &error), &error);
        kt_check_equal_bits("acceleration under the next torque", record.a, &a, 1);
    }
    kept->count = 0;
    kt_test_run(simulation, keep, kept);
}

KT_TEST(sensing_between_records_of_a_step_changes_none) {
    static numbers pages[2][STEPS + 1];
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.5);
    kt_model *model = kt_scene_compile(&lone.description);
    album with = {model, 0, pages[0]}, without = {model, 0, pages[1]};
    interrupt(model, true, &with);
    interrupt(model, false, &without);
    kt_check_equal_int("records", with.count, without.count);
    kt_check_above("records", with.count, 5);
    for (int i = 0; i < with.count; i++)
        kt_check_equal_bits("record", with.page[i].x, without.page[i].x, (size_t)without.page[i].count);
}

/* NOLINTNEXTLINE(readability-non-const-parameter): the type is the library's */
static int reject(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    (void)rate, (void)error;
    a[0] = -at->q[0];
    return *(int *)user;
}

static int stop_at_once(const kt_record *record, void *user) {
    (void)user;
    return record->t > 0.85;
}

/* A slider comes to rest at 1 s, where its friction sticks. The run is interrupted at a record within the step that
 * ends there, so that the friction has not taken effect yet. A torque is set, and one of two simulations senses it. */
KT_TEST(sensing_before_an_event_takes_effect_does_not_change_it) {
    kt_lone lone;
    kt_effect friction = kt_effect_default();
    kt_run run = kt_run_default();
    kt_error error;
    kt_record now;
    kt_simulation *s[2];
    const double torque = -3.0;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 1.0);
    lone.body.joint.velocity[0] = 1.0;
    friction.type = KT_EFFECT_JOINT_FRICTION;
    friction.joint = lone.body.name;
    friction.coulomb = 1.0;
    friction.stick = true;
    lone.description.effects = &friction;
    lone.description.effect_count = 1;
    run.interval = 0.3;
    run.record = KT_RECORD_ACCELERATION;
    kt_model *model = kt_scene_compile(&lone.description);
    for (int i = 0; i < 2; i++) {
        s[i] = kt_test_simulation(model, &run, NULL);
        kt_check_equal_int("interrupted", kt_simulation_run(s[i], stop_at_once, NULL, &error), KT_ERROR_CALLBACK);
        kt_check_near("time of rest", kt_simulation_time(s[i]), 1.0, 1e-9);
        (void)kt_fine("torque", kt_simulation_set_torque(s[i], &torque, &error), &error);
        if (i == 1)
            (void)kt_fine("sense", kt_simulation_sense(s[i], &now, &error), &error);
        (void)kt_fine("a step", kt_simulation_step(s[i], 1.5, &error), &error);
        kt_check_equal_int("sticks", (long long)kt_simulation_contacts(s[i]).sticks, 1);
    }
    kt_check_near("time", kt_simulation_time(s[1]), kt_simulation_time(s[0]), 0.0);
    kt_scene_check_equal("state", s[1], s[0]);
}

KT_TEST(failed_sensing_leaves_the_record_and_the_simulation_as_they_were) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.5);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 0.1, 1.0);
    run.record = KT_RECORD_ACCELERATION;
    kt_simulation_options options = kt_simulation_options_default();
    int answer = 0;
    options.acceleration = reject;
    options.user = &answer;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    kt_error error = {0};
    kt_record record = {.index = 77};
    answer = -1;
    kt_check_equal_int("rejected", kt_simulation_sense(simulation, &record, &error), KT_ERROR_CALLBACK);
    kt_check_contains("where", error.where, "t = 0 s");
    kt_check_equal_int("record", record.index, 77);
    answer = 0;
    kt_check_true("sense", kt_fine("sense", kt_simulation_sense(simulation, &record, &error), &error));
    kt_check_equal_int("no number", record.index, -1);
    const double expected = -1.0;
    kt_check_equal_bits("the caller's acceleration", record.a, &expected, 1);
    kt_check_true("step", kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error));
}

/* A state that is rejected has been tried in the same memory. */
KT_TEST(rejected_states_spoil_no_sensor) {
    static numbers before, after;
    kt_error error;
    kt_record record;
    kt_random random = kt_random_of_test();
    double q[64], v[64];
    int rejected = 0;
    kt_model *model = kt_scene_compile(&kt_test_bundled("bricard")->description);
    for (int i = 0; i < 20; i++) {
        kt_run run = kt_run_fixed("rk4", 1e-3, 1.0);
        run.record = i % 2 == 0 ? KT_RECORD_POSITION : every;
        kt_simulation *simulation = simulate(model, &run);
        (void)kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
        (void)kt_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
        collect(model, &record, &before);
        for (int k = 0; k < kt_model_nq(model); k++)
            q[k] = kt_random_uniform(&random, -3.0, 3.0);
        memset(v, 0, sizeof v);
        if (kt_simulation_set_state(simulation, 0.0, q, v, &error) != KT_OK) {
            (void)kt_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
            collect(model, &record, &after);
            if (memcmp(after.x, before.x, (size_t)before.count * sizeof(double)) != 0)
                kt_check_equal_bits("sensors", after.x, before.x, (size_t)before.count);
            rejected++;
        }
    }
    kt_check_above("states rejected", rejected, 3);
}

/* ---- what it means ----------------------------------------------------------------------------------------------- */

/* A point mass on a link of 1 m. An accelerometer in it shows the carrying acceleration along the link, g cos x + x'^2.
 * It shows nothing across the link, for any motion. The joint carries the same force, along the link. */
KT_TEST(accelerometer_and_wrench_of_a_pendulum_show_what_carries_it) {
    kt_lone lone;
    kt_pendulum_make(&lone, 1.0, 0.5);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 1e-3, 1.0);
    run.record = KT_RECORD_ACCELERATION | KT_RECORD_REACTION;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    KT_WORST along = kt_worst_make("along the link, m/s^2"), across = kt_worst_make("across it, m/s^2");
    KT_WORST borne = kt_worst_make("force in the joint, N");
    kt_record record;
    kt_error error;
    for (int k = 0; k < 1000; k++) {
        kt_need_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
        kt_need_fine("sense", kt_simulation_sense(simulation, &record, &error), &error);
        const kt_mat3 axes = kt_body_pose(model, record.data, 1).rotation;
        const kt_vec3 a = kt_point_acceleration(model, record.data, 1, kt_vec3_make(0.0, -1.0, 0.0));
        const kt_vec3 felt = kt_mat3_apply_transposed(axes, kt_vec3_sub(a, kt_model_gravity(model)));
        const kt_vec3 force = kt_mat3_apply_transposed(axes, record.reactions[1].force);
        const double x = record.q[0], w = record.v[0], expected = 9.81 * cos(x) + w * w;
        /* up to 30 m/s^2, with an error of a few roundings. The largest measured error was 1.1e-14. */
        kt_worst_near(&along, felt.y, expected, 2e-14, "step %d", k);
        kt_worst_near(&across, felt.x, 0.0, 2e-14, "step %d", k);
        kt_worst_near(&borne, force.y, expected, 2e-14, "step %d", k);
    }
}
