/* Events of scenes are read, written and read again, and wrong ones are rejected with a message. The effects of events
 * on a run are compared with closed forms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/dynamics.h"
#include "kinetree/scene.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

#include "check.h"
#include "difference.h"
#include "running.h"

/* A stone is thrown. The level is h, which the marker has 0.1 m below the stone:
 *     x = 3 t,   y = 1 + 4 t - g t^2 / 2. */
static const char thrown[] = "kinetree: 1\n"
                             "gravity: [0, -9.81, 0]\n"
                             "parameters: {h: 0.25}\n"
                             "bodies:\n"
                             "  - name: stone\n"
                             "    joint: {type: free, position: {position: [0, 1, 0]}, velocity: {linear: [3, 4, 0]}}\n"
                             "    mass: 1\n"
                             "    inertia: [1, 1, 1]\n"
                             "    markers: {foot: [0, -0.1, 0]}\n"
                             "events:\n"
                             "  - {name: top, when: \"marker.stone.foot.vy\", direction: falling, then: record}\n"
                             "  - {name: above, when: \"marker.stone.foot.y > 1.2\", then: [record, {call: tell}]}\n"
                             "  - {name: far, when: marker.stone.foot.x - 2*h, then: [{call: tell}], limit: 1}\n"
                             "simulate: {duration: 10, until: \"marker.stone.foot.y < h\"}\n";

/* ---- a run ------------------------------------------------------------------------------------------------------- */

typedef struct rows {
    int count;
    double time[16];
    const char *name[16]; /* of the simulation's events */
    int told;
    double told_at[16];
} rows;

static int keep(const kt_record *record, void *user) {
    rows *r = user;
    if (record->event == NULL || r->count == 16)
        return 0;
    r->time[r->count] = record->t;
    r->name[r->count++] = record->event->name;
    return 0;
}

static int tell(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    rows *r = user;
    (void)simulation;
    (void)error;
    if (r->told < 16)
        r->told_at[r->told++] = what->time;
    return 0;
}

/* Where y - 0.1 = level, falling (sign 1) or rising (-1). */
static double time_at(double level, double sign) {
    return (4.0 + sign * sqrt(16.0 + 2.0 * 9.81 * (0.9 - level))) / 9.81;
}

/* A condition of several comparisons becomes true when its last comparison does. */
KT_TEST(several_comparisons_are_one_event) {
    static const struct {
        const char *when;
        double level, sign;
    } cases[] = {{"marker.stone.foot.vy < 0 and marker.stone.foot.y < 1.2", 1.2, 1.0},
                 {"marker.stone.foot.vy < 0 or marker.stone.foot.y > 1.2", 1.2, -1.0},
                 {"not marker.stone.foot.y < 1.5 and t > 0.01", 1.5, -1.0},
                 {"not (marker.stone.foot.y >= 1 or marker.stone.foot.vy > 0)", 1.0, 1.0}};
    for (size_t k = 0; k < sizeof cases / sizeof *cases; k++) {
        char text[900];
        rows r = {0};
        (void)snprintf(
            text, sizeof text,
            "kinetree: 1\ngravity: [0, -9.81, 0]\nbodies:\n  - name: stone\n    joint: {type: free, position: "
            "{position: [0, 1, 0]}, velocity: {linear: [3, 4, 0]}}\n    mass: 1\n    inertia: [1, 1, 1]\n"
            "    markers: {foot: [0, -0.1, 0]}\nsimulate: {duration: 10, until: \"%s\"}\n",
            cases[k].when);
        const running m = running_start(text, NULL);
        kt_test_run(m.simulation, keep, &r);
        kt_check_near(cases[k].when, kt_simulation_time(m.simulation), time_at(cases[k].level, cases[k].sign), 1e-12);
    }
}

KT_TEST(a_run_has_the_events_of_its_scene) {
    running untold;
    kt_scene_watch *watch = NULL;
    kt_error error = {0};
    rows r = {0};
    const kt_scene_call calls[] = {{"tell", tell, &r}};
    kt_scene *scene = running_read(thrown, NULL);
    kt_simulation_options options = kt_simulation_options_default();
    options.events = kt_scene_event_room(scene);
    kt_check_equal_int("room", options.events, 4);
    kt_check_equal_int("a call that is not given", running_open(&untold, scene, &options, &error), KT_ERROR_SCENE);
    kt_check_contains("words", error.message, "no action 'tell'");
    kt_simulation *simulation = kt_test_simulation(untold.model, &scene->run, &options);
    kt_need_fine("events", kt_scene_watch_create(scene, untold.model, simulation, calls, 1, &watch, &error), &error);
    kt_need_fine("run", kt_simulation_run(simulation, keep, &r, &error), &error);
    const double expected[] = {time_at(1.2, -1.0), 4.0 / 9.81, time_at(0.25, 1.0)};
    static const char *const names[] = {"above", "top", "until"};
    kt_check_equal_int("records", r.count, 3);
    for (int i = 0; i < 3 && i < r.count; i++) {
        kt_check_text("event", r.name[i], names[i]);
        kt_check_near("time, s", r.time[i], expected[i], 16.0 * DBL_EPSILON);
    }
    kt_check_equal_int("calls", r.told, 2);
    kt_check_near("far, s", r.told_at[1], 0.5 / 3.0, 16.0 * DBL_EPSILON);
    kt_check_near("the end, s", kt_simulation_time(simulation), expected[2], 16.0 * DBL_EPSILON);
    kt_scene_watch_free(watch);
}

/* ---- long steps -------------------------------------------------------------------------------------------------- */

/* A crank turns by itself, so that a step grows to many of its turns. Its tip passes y = 0 if 0.1 + t/2 = k pi. A
 * cosine passes its level in each of its periods. A spike of 2 ms is one event. */
KT_TEST(events_of_a_crank_are_found_in_long_steps) {
    static const char text[] =
        "kinetree: 1\n"
        "gravity: [0, 0, 0]\n"
        "bodies:\n"
        "  - {name: crank, joint: {type: revolute, position: 0.1, velocity: 0.5}, mass: 1, inertia: [1, 1, 1],\n"
        "     markers: {tip: [1, 0, 0]}}\n"
        "events:\n"
        "  - {name: turn, when: marker.crank.tip.y, then: record}\n"
        "  - {name: crest, when: cos(40*t) > 0.9999, then: record}\n"
        "  - {name: spike, when: abs(t - 41.123) < 1e-3, then: record}\n"
        "simulate: {duration: 50}\n";
    const running r = running_start(text, NULL);
    kt_error error = {0};
    kt_check_equal_int("runs", kt_simulation_advance(r.simulation, 50.0, &error), KT_OK);
    kt_check_equal_int("turns", (long)kt_simulation_event_count(r.simulation, "turn"), 7);
    kt_check_equal_int("crests", (long)kt_simulation_event_count(r.simulation, "crest"), 318);
    kt_check_equal_int("spike", (long)kt_simulation_event_count(r.simulation, "spike"), 1);
}

/* Three events happen at t = 2. The first ends a part of the step, and the second is its breakpoint. They happen in the
 * order of the file, so that x becomes 123. */
KT_TEST(events_at_a_breakpoint_happen_together_in_order) {
    static const char text[] = "kinetree: 1\n"
                               "gravity: [0, 0, 0]\n"
                               "bodies:\n"
                               "  - {name: slide, joint: {type: prismatic, velocity: 1}, mass: 1}\n"
                               "states:\n"
                               "  x: {rate: 0}\n"
                               "events:\n"
                               "  - {name: a, when: t > 2, then: {set: {x: 10*x + 1}}}\n"
                               "  - {name: b, when: step(t - 2) > 0.5, then: {set: {x: 10*x + 2}}}\n"
                               "  - {name: c, when: position.slide > 2, then: {set: {x: 10*x + 3}}}\n"
                               "simulate: {duration: 50}\n";
    const running r = running_start(text, NULL);
    kt_error error = {0};
    kt_check_equal_int("runs", kt_simulation_advance(r.simulation, 50.0, &error), KT_OK);
    kt_check_near("x", kt_simulation_auxiliary_states(r.simulation)[0], 123.0, 0.0);
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

KT_TEST(events_are_written_and_read_again) {
    const char *text = kt_test_written(running_read(thrown, NULL));
    const kt_scene *again = running_read(text, NULL);
    kt_check_text("the same text", kt_test_written(again), text);
    kt_check_contains("a parameter is its number", text, "2*(0.25)");
    kt_check_equal_int("events", again->event_count, 3);
    kt_check_equal_int("a comparison rises", again->events[1].direction, KT_DIRECTION_RISING);
    kt_check_equal_int("limit", again->events[2].limit, 1);
    kt_check_true("until stops", again->until.stop && again->until.direction == KT_DIRECTION_RISING);
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

KT_TEST(faults_of_events_name_their_place_and_the_mend) {
    static const struct {
        const char *events, *place, *words;
    } wrong[] = {
        {"events: [{name: a, when: \"position.arn\", then: stop}]", "x:4:27", "did you mean 'position.arm'"},
        {"events: [{name: a, when: position.arm, then: halt}]", "x:4:46", "{engage: NAME}"},
        {"events: [{name: a, when: position.arm, then: stopp}]", "x:4:46", "did you mean 'stop'? Expected an action"},
        {"events: [{name: a, when: position.arm, then: relase}]", "x:4:46", "did you mean {release: NAME}?"},
        {"events: [{name: a, when: position.arm, then: {stop: true}}]", "x:4:46",
         "'stop' takes no value; write the word alone: stop"},
        {"events: [{name: a, when: position.arm, then: [{record: 1}]}]", "x:4:47",
         "'record' takes no value; write the word alone: record"},
        {"events: [{name: a, when: position.arm, then: []}]", "x:4:46", "an action"},
        {"events: [{name: a, when: position.arm, then: [stop, stop]}]", "x:4:53", "there already"},
        {"events: [{name: a, when: position.arm, then: {dance: b}}]", "x:4:46", "{call: NAME}"},
        {"events: [{name: a, when: position.arm, then: {release: b}}]", "x:4:56", "there is no loop or effect 'b'"},
        {"events: [{name: a, when: position.arm > 1, direction: falling, then: stop}]", "x:4:55", "comparison"},
        {"events: [{name: a, when: position.arm, then: stop, limit: 1.5}]", "x:4:59", "whole number"},
        {"events: [{name: a, when: position.arm, then: stop}, {name: a, when: t - 1, then: stop}]", "x:4:53",
         "this name already"},
        {"events: [{when: position.arm, then: stop}]", "x:4:10", "name"},
        {"events: [{name: a, then: stop}]", "x:4:10", "when"},
        {"events: {name: a}", "x:4:9", "a list of events"},
        {"simulate: {until: \"position.arm <\"}", "x:4:34", "missing before the end"},
        {"events: [{name: a, when: \"position.arm == 0.5\", then: stop}]", "x:4:26", ": \"position.arm - (0.5)\""},
        {"simulate: {until: \"position.arm != 0\"}", "x:4:19", "when they are equal: \"position.arm\""},
        {"simulate: {until: \"2 > 1\"}", "x:4:19", "has no variable"},
        {"simulate: {until: \"cos(t) > 1\"}", "x:4:19", "never change places"},
        {"simulate: {until: \"abs(position.arm)\"}", "x:4:19", "\"abs(position.arm) > 0.5\""},
        {"states: {n: {rate: 0}}\nsimulate: {until: n > 3.5}", "x:5:19",
         "'n > 3.5' changes only where events set its values"},
        {"parameters: {F: 1}\nevents: [{name: a, when: position.arm, then: {set: {F: -F}}},\n"
         "  {name: b, when: F + 0.5, then: stop}]",
         "x:6:19", "so the event never happens; use them next to t, position.JOINT"},
        {"  - {name: cart, joint: {type: prismatic}, mass: 1}\n"
         "events: [{name: a, when: position.arm, then: {set: {velocity.cart: 30 deg}}}]",
         "x:5:68", "expected a number, found the angle '30 deg'"},
        {"  - {name: box, joint: {type: free}, mass: 1, inertia: [1, 1, 1]}\n"
         "events: [{name: a, when: position.arm, then: {set: {\"velocity.box[2]\": 30 deg}}}]",
         "x:5:72", "expected a number, found the angle '30 deg'"},
    };
    char text[512];
    for (size_t i = 0; i < sizeof wrong / sizeof wrong[0]; i++) {
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies:\n  - {name: arm, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n%s\n",
                 wrong[i].events);
        running_check_fault(wrong[i].events, text, wrong[i].place, wrong[i].words);
    }
}

/* Degrees for the rate of an angle are per second, as in the joint. */
KT_TEST(rates_of_angles_are_set_in_degrees) {
    static const char *const sets[] = {"velocity.arm: 30 deg", "\"velocity.box[4]\": 30 deg", "velocity.cart: 0.5",
                                       "velocity.cart: 30 deg/1 rad"};
    for (size_t i = 0; i < sizeof sets / sizeof sets[0]; i++) {
        char text[512];
        snprintf(text, sizeof text,
                 "kinetree: 1\nbodies:\n  - {name: arm, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                 "  - {name: cart, joint: {type: prismatic}, mass: 1}\n"
                 "  - {name: box, joint: {type: free}, mass: 1, inertia: [1, 1, 1]}\n"
                 "events: [{name: a, when: position.arm, then: {set: {%s}}}]\n",
                 sets[i]);
        kt_check_true(sets[i], running_parse(text, NULL, kt_test_scene_place()));
    }
}
