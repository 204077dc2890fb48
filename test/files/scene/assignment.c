/* Parameters that events set. A run is compared with its closed form. The equations after an event are compared with
 * those of a scene that is read with the new numbers. Further tests cover checkpoints, files, and rejected events. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "running.h"

/* ---- a closed form ----------------------------------------------------------------------------------------------- */

/* m x'' = pull - k x, from x = 1 at rest. When x falls through 0.2, the stiffness becomes four times as large, and the
 * pull grows by x. */
static const char hardens[] =
    "kinetree: 1\n"
    "parameters: {k: 100, m: 2, pull: 3, twice: =2*k}\n"
    "bodies: [{name: block, joint: {type: prismatic, axis: x, position: 1}, mass: =m}]\n"
    "effects:\n"
    "  - {type: joint_spring, joint: block, stiffness: =twice/2, rest: 0}\n"
    "  - {type: expression, joint: block, force: \"pull + 0*twice\"}\n"
    "events: [{name: harden, when: \"position.block - k/500\", direction: falling, limit: 1,\n"
    "          then: [{set: {k: 4*k, pull: pull + position.block}}]}]\n"
    "simulate: {duration: 2, integrator: dop853, tolerance: 1e-12}\n"
    "output: {record: [position, velocity, balance]}\n";

/* x and v after t seconds of m x'' = pull - k x. */
static void swing(double m, double k, double pull, double t, double *x, double *v) {
    const double w = sqrt(k / m), a = *x - pull / k, b = *v / w;
    *x = pull / k + a * cos(w * t) + b * sin(w * t);
    *v = w * (b * cos(w * t) - a * sin(w * t));
}

typedef struct events_seen {
    int count;
    double time, x[2][2], k[2]; /* positions and velocities, and k, before and behind */
} events_seen;

static int see(const kt_record *record, void *user) {
    events_seen *seen = user;
    if (record->event == NULL || seen->count == 2)
        return 0;
    seen->time = record->t;
    seen->x[seen->count][0] = record->q[0];
    seen->x[seen->count][1] = record->v[0];
    seen->k[seen->count++] = record->x[0];
    return 0;
}

KT_TEST(an_event_sets_numbers_and_what_formulas_read) {
    events_seen seen = {0};
    kt_error error = {0};
    const running r = running_start(hardens, NULL);
    const kt_status status = kt_simulation_run(r.simulation, see, &seen, &error);
    kt_check_text("runs", status == KT_OK ? "" : error.message, "");
    const double at = acos((0.2 - 0.03) / 0.97) / sqrt(50.0);
    double x = 1.0, v = 0.0;
    swing(2.0, 100.0, 3.0, at, &x, &v);
    kt_check_near("the event, s", seen.time, at, 1e-12);
    kt_check_equal_int("a record before it and one behind", seen.count, 2);
    kt_check_near("k before", seen.k[0], 100.0, 0.0);
    kt_check_near("k behind", seen.k[1], 400.0, 0.0);
    const double gained = 0.5 * 300.0 * x * x;
    swing(2.0, 400.0, 3.2, 2.0 - at, &x, &v);
    kt_check_near("x", kt_simulation_positions(r.simulation)[0], x, 1e-10);
    kt_check_near("v", kt_simulation_velocities(r.simulation)[0], v, 1e-9);
    /* The pulls supply their work, and the event supplies the gain in energy of the spring. */
    const kt_work work = kt_simulation_work(r.simulation);
    kt_check_near("supplied", work.supplied - work.dissipated, 3.0 * (0.2 - 1.0) + 3.2 * (x - 0.2) + gained, 2e-10);
    kt_check_near("the states", kt_simulation_auxiliary_states(r.simulation)[2], 800.0, 0.0);
}

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

KT_TEST(checkpoints_hold_what_events_have_set) {
    kt_error error = {0};
    const running a = running_start(hardens, NULL);
    const running b = running_start(hardens, NULL);
    kt_check_equal_int("to 1 s", kt_simulation_advance(a.simulation, 1.0, &error), KT_OK);
    void *block = running_room(&a, 1);
    kt_simulation_save(a.simulation, block);
    kt_check_equal_int("to 2 s", kt_simulation_advance(a.simulation, 2.0, &error), KT_OK);
    kt_check_equal_int("restores", kt_simulation_restore(b.simulation, block, &error), KT_OK);
    kt_check_equal_int("sets", kt_scene_watch_sync(b.watch, b.simulation, &error), KT_OK);
    kt_check_equal_int("on to 2 s", kt_simulation_advance(b.simulation, 2.0, &error), KT_OK);
    kt_check_equal_int(
        "the same bits",
        memcmp(kt_simulation_positions(a.simulation), kt_simulation_positions(b.simulation), sizeof(double)), 0);
}

/* Replaces the first occurrence in a scene of at most 2000 characters. */
static void replace(const char *text, const char *old, const char *new, char *to) {
    const char *at = strstr(text, old);
    kt_check_true(old, at != NULL);
    if (at != NULL)
        (void)snprintf(to, 2000, "%.*s%s%s", (int)(at - text), text, new, at + strlen(old));
}

/* When the scenes are read, the numbers that follow from the parameters have equal values in all of them. */
KT_TEST(checkpoints_are_rejected_where_numbers_follow_otherwise) {
    static const struct {
        const char *old, *new, *words;
    } rows[] = {
        {"4*k,", "4*k,", NULL},
        {"m: 2, pull: 3,", "m: 2.5, pull: 3.5,", NULL}, /* values may differ */
        {"twice/2", "k", "other numbers of the model follow"},
        {"twice/2", "twice - 100", "other numbers of the model follow"},
        {"twice/2", "100", "other numbers of the model follow"},
        {"=2*k", "=100 + k", "other numbers of the model follow"},
        {"4*k,", "5*k,", "watch or do something else"},
        {"k/500", "k/400", "watch or do something else"},
        {"direction: falling", "direction: rising", "watch or do something else"},
        {"pull + 0*twice", "pull - 0*twice", "types or formulas"},
        {"pull + 0*twice", "twice + 0*pull", "types or formulas"},
    };
    char other[2000];
    kt_error error = {0};
    const running a = running_start(hardens, NULL);
    kt_check_equal_int("to 1 s", kt_simulation_advance(a.simulation, 1.0, &error), KT_OK);
    void *block = running_room(&a, 1);
    kt_simulation_save(a.simulation, block);
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        replace(hardens, rows[i].old, rows[i].new, other);
        const running b = running_start(other, NULL);
        error = (kt_error){0};
        kt_check_equal_int(rows[i].new, kt_simulation_restore(b.simulation, block, &error),
                           rows[i].words == NULL ? KT_OK : KT_ERROR_ARGUMENT);
        if (rows[i].words != NULL)
            kt_check_contains("words", error.message, rows[i].words);
    }
}

/* A checkpoint at each record of events, before and after their actions. */
typedef struct saves {
    kt_simulation *of;
    char *blocks; /* SAVES_MOST */
    int count;
} saves;

enum { SAVES_MOST = 16 };

static int save_at_events(const kt_record *record, void *user) {
    saves *s = user;
    if (record->event != NULL && s->count < SAVES_MOST)
        kt_simulation_save(s->of, s->blocks + (size_t)s->count++ * kt_simulation_state_size(s->of));
    return 0;
}

static int ignore(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}

/* An event's action moves its own value to the other side. The event happens equally often after a checkpoint that was
 * made in its own record. */
KT_TEST(checkpoints_in_records_of_events_hold_their_sides) {
    static const char charged[] = "kinetree: 1\n"
                                  "bodies: [{name: rotor, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
                                  "states: {charge: {rate: 1 + velocity.rotor}}\n"
                                  "effects: [{type: expression, joint: rotor, force: 0.3*charge}]\n"
                                  "events: [{name: full, when: charge - 1, then: {set: {charge: 0.5*charge}}}]\n"
                                  "simulate: {duration: 2, integrator: dopri5, tolerance: 1e-8}\n";
    kt_error error = {0};
    int differ = 0;
    const running a = running_start(charged, NULL);
    const running b = running_start(charged, NULL);
    saves s = {.of = a.simulation, .blocks = running_room(&a, SAVES_MOST)};
    kt_need(kt_check_equal_int("runs", kt_simulation_run(a.simulation, save_at_events, &s, &error), KT_OK));
    const double end = kt_simulation_positions(a.simulation)[0];
    for (int i = 0; i < s.count; i++) {
        const char *block = s.blocks + (size_t)i * kt_simulation_state_size(a.simulation);
        const bool fine = kt_simulation_restore(b.simulation, block, &error) == KT_OK &&
                          kt_scene_watch_sync(b.watch, b.simulation, &error) == KT_OK &&
                          kt_simulation_run(b.simulation, ignore, NULL, &error) == KT_OK;
        differ += !fine || kt_simulation_positions(b.simulation)[0] != end ||
                  kt_simulation_event_count(b.simulation, "full") != kt_simulation_event_count(a.simulation, "full");
    }
    kt_check_above("checkpoints", s.count, 5);
    kt_check_equal_int("ends of other bits", differ, 0);
}

/* Breakpoints of formulas of time are roots, whose last bits depend on where the search began: steps behind a
 * checkpoint end at the same. Every step is gone on from. */
KT_TEST(checkpoints_keep_the_breakpoints_of_formulas_of_time) {
    static const char driven[] =
        "kinetree: 1\n"
        "gravity: [0, 0, -9.81]\n"
        "bodies: [{name: arm, joint: {type: revolute, axis: y, position: -0.5}, mass: 1,\n"
        "          shape: {type: rod, to: [0, 0, -0.6]}}]\n"
        "effects:\n"
        "  - {type: expression, joint: arm, force: \"6*sin(3*t) + 2*sin(2.3*t) - 0.2*velocity.arm\"}\n"
        "simulate: {duration: 3, integrator: dopri5, tolerance: 1e-8}\n";
    kt_error error = {0};
    int steps = 0, differ = 0;
    const running a = running_start(driven, NULL);
    const running b = running_start(driven, NULL);
    kt_need(kt_check_equal_int("to the end", kt_simulation_advance(b.simulation, 3.0, &error), KT_OK));
    const double end = kt_simulation_positions(b.simulation)[0];
    void *block = running_room(&a, 1);
    for (bool fine = true; fine && kt_simulation_time(a.simulation) < 3.0; steps++) {
        fine = kt_simulation_step(a.simulation, 3.0, &error) == KT_OK;
        kt_simulation_save(a.simulation, block);
        fine = fine && kt_simulation_restore(b.simulation, block, &error) == KT_OK &&
               kt_simulation_advance(b.simulation, 3.0, &error) == KT_OK;
        differ += !fine || kt_simulation_positions(b.simulation)[0] != end;
    }
    kt_check_above("steps", steps, 20);
    kt_check_equal_int("ends of other bits", differ, 0);
}

/* ---- all that can be set ----------------------------------------------------------------------------------------- */

/* Everything that an event can set follows from p. This is gravity, a mass with the inertia of its shape, a centre,
 * inertias, and an armature. It is also numbers and functions of effects, a loop's length, and a formula. */
#define ALL_OF_IT                                                                                                      \
    "kinetree: 1\n"                                                                                                    \
    "parameters: {p: 1, q: =p + 1}\n"                                                                                  \
    "gravity: [0, =-9*p, 0.5]\n"                                                                                       \
    "bodies:\n"                                                                                                        \
    "  - {name: a, joint: {type: revolute, axis: z, armature: =0.1*p, position: 0.3}, mass: =2*q,\n"                   \
    "     shape: {type: rod, from: [0.1, 0, 0], to: [1, 0.2, 0]}, markers: {tip: [1, 0.2, 0]}}\n"                      \
    "  - {name: b, parent: a, joint: {type: spherical, at: [1, 0.2, 0]}, mass: 1, com: [0.2, =0.1*p, 0],\n"            \
    "     inertia: [=0.3*p, =0.4*p, =0.5*p], markers: {tip: [0, 0.5, 0]}}\n"                                           \
    "  - {name: c, joint: {type: revolute, axis: z, at: [3, 0, 0], position: 2}, mass: 1, com: [0.5, 0, 0],\n"         \
    "     inertia: [0.1, 0.1, 0.1], markers: {tip: [1, 0, 0]}}\n"                                                      \
    "loops:\n"                                                                                                         \
    "  - {name: rod, type: distance, between: [b.tip, c.tip], length: =1.5 + 0.01*p}\n"                                \
    "effects:\n"                                                                                                       \
    "  - {type: spring, between: [b.tip, world], stiffness: =30*p, length: 0.5, damping: =q}\n"                        \
    "  - {type: motor, joint: a, torque: =p*q}\n"                                                                      \
    "  - {type: force, at: c.tip, value: [1, =-p, 0.5]}\n"                                                             \
    "  - {type: bushing, between: [world, c], stiffness: [0, 0, 0, 0, 0, =p], damping: [0, 0, 0, 0, 0, =q]}\n"         \
    "  - {type: expression, joint: a, force: \"-p*position.a - q*velocity.c\"}\n"                                      \
    "simulate: {duration: 0.05, until: \"t > 0.05\", integrator: dop853}\n"

static const char all_of_it[] =
    ALL_OF_IT "events: [{name: change, when: t - 0.05, limit: 1, then: [{set: {p: =0.5 + 1}}]}]\n";
/* Without the event, so that nothing but the reader gives the numbers. */
static const char without_event[] = ALL_OF_IT;

KT_TEST(behind_an_event_the_equations_are_those_of_the_new_numbers) {
    static const char *const settings[] = {"p=1.5"};
    const kt_scene_options options = {.settings = settings, .setting_count = 1};
    kt_error error = {0};
    const running r = running_start(all_of_it, NULL);
    const running anew = running_start(without_event, &options);
    double before[8], a[8], expected[8];
    const int nv = kt_model_nv(r.model);
    kt_check_equal_int("velocities", nv, 5);
    const double *q = kt_simulation_positions(r.simulation), *v = kt_simulation_velocities(r.simulation);
    kt_check_equal_int("accelerates", kt_simulation_acceleration(r.simulation, before, &error), KT_OK);
    kt_check_equal_int("to the event", kt_simulation_advance(r.simulation, 0.06, &error), KT_OK);
    kt_check_text("it has happened", error.message, "");
    kt_check_equal_int("accelerates", kt_simulation_acceleration(r.simulation, a, &error), KT_OK);
    kt_status status = kt_simulation_set_state(anew.simulation, kt_simulation_time(r.simulation), q, v, &error);
    kt_check_text("the same state", status == KT_OK ? "" : error.message, "");
    kt_check_equal_int("accelerates", kt_simulation_acceleration(anew.simulation, expected, &error), KT_OK);
    for (int i = 0; i < nv; i++) {
        kt_check_near("closed alike", v[i], kt_simulation_velocities(anew.simulation)[i], 1e-12);
        kt_check_near("acceleration", a[i], expected[i], 1e-10);
    }
    /* And every one of them counts. */
    kt_check_true("it matters", fabs(before[0] - a[0]) > 0.1);
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

KT_TEST(what_is_set_is_written_unless_numbers_follow) {
    static const char formulas[] =
        "kinetree: 1\n"
        "parameters: {n: 0, f: 2}\n"
        "states: {charge: {initial: 1, rate: -f*charge}}\n"
        "bodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
        "effects: [{type: expression, joint: a, force: \"n + charge\"}]\n"
        "events: [{name: e, when: \"sin(5*t)\", then: [{set: {n: n + 1, charge: 30 deg}}]}]\n";
    const kt_scene *scene = running_read(formulas, NULL);
    kt_check_equal_int("states", scene->description.state_count, 2);
    const char *text = kt_test_written(scene);
    kt_check_contains("the set", text, "set: {n:");
    const kt_scene *again = running_read(text, NULL);
    kt_check_equal_int("sets", again->event_count > 0 ? again->events[0].set_count : 0, 2);
    kt_check_equal_int("states", again->description.state_count, 2);
    static const char follows[] = "kinetree: 1\n"
                                  "parameters: {n: 3, torque: =2*n}\n"
                                  "bodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
                                  "effects: [{type: expression, joint: a, force: torque - velocity.a}]\n"
                                  "events: [{name: e, when: \"sin(5*t)\", then: [{set: {n: 2}}]}]\n";
    static const char *const rejected[] = {hardens, follows};
    for (int i = 0; i < 2; i++)
        kt_check_unwritable("rejects", running_read(rejected[i], NULL), KT_ERROR_UNSUPPORTED,
                            "parameters from which other numbers follow");
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

KT_TEST(what_cannot_change_is_rejected_at_its_place) {
    static const struct {
        const char *line, *set, *place, *words;
    } wrong[] = {
        {"bodies: [{name: a, joint: {type: revolute, at: [=k, 0, 0]}, mass: 1, inertia: [1, 1, 1]}]", "k: 2", "x:3:49",
         "which cannot change during a run"},
        {"bodies: [{name: a, joint: {type: revolute, position: =2*k}, mass: 1, inertia: [1, 1, 1]}]", "k: 2", "x:3:54",
         "which cannot change during a run"},
        {"bodies: [{name: a, joint: {type: revolute}, mass: 1, shape: {type: sphere, radius: =k}}]", "k: 2", "x:3:84",
         "which cannot change during a run"},
        {"bodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
         "effects: [{type: motor, joint: a, torque: \"k*t\"}]",
         "k: 2", "x:4:43", "which cannot change during a run"},
        {"bodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}]\n"
         "effects: [{type: joint_limit, joint: a, lower: =-k, restitution: 0.5}]",
         "k: 2", "x:4:48", "which cannot change during a run"},
        {"bodies: [{name: a, joint: {type: revolute}, mass: =k, inertia: [1, 1, 1]}]", "b: 2", "x:4:46",
         "no parameter, state or velocity 'b'"},
        {"bodies: [{name: a, joint: {type: revolute}, mass: =k, inertia: [1, 1, 1]}]", "k: velocty.a", "x:4:49",
         "did you mean 'velocity.a'"},
        {"bodies: [{name: a, joint: {type: revolute}, mass: =k, inertia: [1, 1, 1]}]", "k: [1, 2]", "x:4:49",
         "a number or a formula"},
    };
    char text[512];
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        snprintf(text, sizeof text,
                 "kinetree: 1\nparameters: {k: 1}\n%s\nevents: [{name: e, when: t - 1, then: {set: {%s}}}]\n",
                 wrong[i].line, wrong[i].set);
        running_check_fault(wrong[i].line, text, wrong[i].place, wrong[i].words);
    }
}

/* A value that cannot be ends the run, and the message has the event, the time and the number. The model does not
 * change. */
KT_TEST(a_value_that_cannot_be_ends_the_run_in_words) {
    static const char negative[] = "kinetree: 1\n"
                                   "parameters: {k: 5, m: 1}\n"
                                   "bodies: [{name: a, joint: {type: prismatic, position: 1}, mass: =m}]\n"
                                   "effects: [{type: joint_spring, joint: a, stiffness: =k}]\n"
                                   "events: [{name: soften, when: t - 0.5, then: {set: {k: k + 1, m: m - 2}}}]\n"
                                   "simulate: {duration: 1}\n";
    kt_error error = {0};
    double mass = 0.0;
    const running r = running_start(negative, NULL);
    kt_check_true("ends", kt_simulation_advance(r.simulation, 1.0, &error) != KT_OK);
    kt_check_contains("where", error.where, "event 'soften' at t = 0.5 s");
    kt_check_contains("words", error.message, "mass");
    const kt_parameter parameter = {.kind = KT_PARAMETER_MASS, .item = 1, .count = 1};
    kt_check_equal_int("reads", kt_parameter_get(r.model, &parameter, &mass, &error), KT_OK);
    kt_check_near("the mass", mass, 1.0, 0.0);
    kt_check_near("the state", kt_simulation_auxiliary_states(r.simulation)[0], 5.0, 0.0);
}

/* It names the parameter, and a NaN has no sign. */
KT_TEST(a_value_that_is_no_number_ends_the_run_in_words) {
    static const char root[] = "kinetree: 1\n"
                               "parameters: {k: 5}\n"
                               "bodies: [{name: a, joint: {type: prismatic, position: 1}, mass: 1}]\n"
                               "effects: [{type: joint_spring, joint: a, stiffness: =k}]\n"
                               "events: [{name: soften, when: t - 0.5, then: {set: {k: sqrt(2 - k)}}}]\n"
                               "simulate: {duration: 1}\n";
    kt_error error = {0};
    const running r = running_start(root, NULL);
    kt_check_true("ends", kt_simulation_advance(r.simulation, 1.0, &error) != KT_OK);
    kt_check_contains("where", error.where, "event 'soften' at t = 0.5 s");
    kt_check_text("words", error.message, "'k' is nan; give a finite number");
}
