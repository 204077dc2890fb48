/* What a run reports before its first step, and what its view will not show. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/advice.h"
#include "advice/angles.h"
#include "advice/penetration.h"
#include "open/play.h"
#include "open/start.h"
#include "subcommands/run.h"
#include "view/view.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- the start --------------------------------------------------------------------------------------------------- */

static void warn_of_long_step(kt_outcome *outcome) {
    const kt_run *run = outcome->run;
    const kt_warning warning = kt_warning_of("long_step", run->step, "s", "Give a shorter step, or a longer duration");
    if (run->duration > 0.0 && run->step > run->duration)
        kt_warn(&outcome->warnings, &warning, "the step, %g s, is longer than the duration: one step of %g s is taken",
                run->step, run->duration);
}

/* Warns of files of gigabytes, which a wrong digit of the interval makes. */
static void warn_of_many_records(kt_outcome *outcome) {
    enum { MANY = 10000000 };
    const int64_t records = kt_simulation_record_count(outcome->simulation);
    const kt_warning warning = kt_warning_of("many_records", (double)records, NULL, "Give a longer --interval");
    if (records - 1 > MANY)
        kt_warn(&outcome->warnings, &warning, "%.3g records are to be written, one every %g s", (double)records,
                outcome->run->interval);
}

/* Warns if the velocity of a driven joint jumps. Steps end there. */
static void warn_of_jumps(kt_outcome *outcome) {
    const char *loop = kt_start_jumping(outcome->scene, outcome->run->duration);
    const kt_warning warning = kt_warning_of(
        "speed_jump", (double)NAN, NULL,
        "Give the table 'interpolation: cubic' or 'monotone'. In a formula, avoid sign, step, comparisons, and "
        "kinks of abs, min, max and clamp");
    if (loop != NULL)
        kt_warn(&outcome->warnings, &warning,
                "the speed of loop '%s' jumps at a row of its table, or at a branch of its formula", loop);
}

/* Notes the events whose values are on the side of zero to which they lead, at the start. */
static void note_held_events(kt_outcome *outcome) {
    const kt_scene *scene = outcome->scene;
    for (int i = 0; i < kt_scene_event_room(scene) && i < KT_EVENTS_NOTED; i++) {
        const kt_direction to = i < scene->event_count ? scene->events[i].direction : scene->until.direction;
        const double value =
            to != KT_DIRECTION_EITHER ? kt_scene_event_value(outcome->events, outcome->simulation, i) : 0.0;
        if (to == KT_DIRECTION_RISING ? value > 0.0 : value < 0.0)
            outcome->so_far.held |= UINT64_C(1) << i;
    }
}

static bool held_at_start(const kt_outcome *outcome, int event) {
    return event < KT_EVENTS_NOTED && (outcome->so_far.held >> event & 1U) != 0;
}

/* An event that has not happened seems to lie beyond the motion, although its condition has held all the time. */
void kt_warn_of_held_events(kt_outcome *outcome) {
    const kt_warning warning = kt_warning_of("event_holds", (double)NAN, NULL,
                                             "Reverse the comparison, or let the run begin where it is false");
    for (int i = 0; i < outcome->scene->event_count; i++) {
        const kt_scene_event *event = &outcome->scene->events[i];
        if (held_at_start(outcome, i) && kt_simulation_event_count(outcome->simulation, event->name) == 0)
            kt_warn(&outcome->warnings, &warning,
                    "event '%s' has not happened: its condition is true from the start, and an event is the change to "
                    "true: %s",
                    event->name, event->when);
    }
}

/* Warns if the run cannot end by its condition before that has ceased to hold. */
static void warn_of_until(kt_outcome *outcome) {
    const kt_warning warning = kt_warning_of("until_holds", (double)NAN, NULL,
                                             "Reverse the comparison, or let the run begin where it is false");
    if (outcome->scene->until.when != NULL && held_at_start(outcome, outcome->scene->event_count))
        kt_warn(&outcome->warnings, &warning,
                "`until: %s` is true at the start, and ends the run only when it becomes true again",
                outcome->scene->until.when);
}

/* Warns of a gravity that is given in millimetres. `check` doubts others, too. */
static void warn_of_gravity(kt_outcome *outcome) {
    const double size = kt_vec3_norm(outcome->scene->description.gravity);
    const kt_warning warning = kt_warning_of("gravity", size, "m/s^2", "Give all lengths in metres, and 9.81");
    if (size > 9000.0 && size < 11000.0)
        kt_warn(&outcome->warnings, &warning, "gravity is %.6g m/s^2, a thousand times that of the earth", size);
}

/* Lists the items that an import has left out, but no details. They were printed when the scene was read. Those that
 * change the motion come first, since a page shows the first one. */
static void list_notes(kt_outcome *outcome) {
    static const kt_note_rank ranks[] = {KT_NOTE_RANK_MOTION, KT_NOTE_RANK_NAME, KT_NOTE_RANK_START};
    const kt_warning warning = {.code = "left_out", .time = (double)NAN, .value = (double)NAN, .is_said = true};
    for (size_t k = 0; k < sizeof ranks / sizeof *ranks; k++)
        for (int i = 0; i < outcome->scene->note_count; i++)
            if (outcome->scene->notes[i].rank == ranks[k])
                kt_warn(&outcome->warnings, &warning, "%s: %s", outcome->scene->notes[i].where,
                        outcome->scene->notes[i].what);
}

/* Warns if velocities at the start point into closed contacts or stops, so that the run begins with impacts.
 * Coordinates that the scene does not give may have changed, too. */
static void warn_of_impacts_at_start(kt_outcome *outcome) {
    const kt_contact_counts seen = kt_simulation_contacts(outcome->simulation);
    const kt_warning warning = kt_warning_at("start_impact", 0.0, seen.dissipated, "J",
                                             "Give velocities that keep closed contacts closed, or start away from "
                                             "them");
    if (seen.impacts > 0)
        kt_warn(&outcome->warnings, &warning,
                "the start is inconsistent: velocities point into closed contacts, and %llu impact%s at t = 0 "
                "dissipate%s %.3g J",
                (unsigned long long)seen.impacts, kt_plural((long long)seen.impacts), seen.impacts == 1 ? "s" : "",
                seen.dissipated);
}

void kt_warn_of_start(kt_outcome *outcome) {
    warn_of_long_step(outcome);
    warn_of_many_records(outcome);
    warn_of_jumps(outcome);
    note_held_events(outcome);
    warn_of_until(outcome);
    warn_of_impacts_at_start(outcome);
    warn_of_gravity(outcome);
    (void)kt_angles_warn(&outcome->warnings, outcome->scene, true, outcome->settings);
    (void)kt_plausible_warn(&outcome->warnings, outcome->scene, 10.0);
    (void)kt_idle_warn(&outcome->warnings, outcome->scene);
    (void)kt_slender_warn(&outcome->warnings, outcome->scene);
    (void)kt_column_units_warn(&outcome->warnings, outcome->scene, outcome->model);
    (void)kt_penetration_warn(&outcome->warnings, outcome->scene, outcome->model, kt_outcome_positions(outcome));
}

/* Lists the values of the start that differ from those of the scene. kt_start_say_moved prints them. */
static void list_moved(kt_outcome *outcome) {
    enum { LISTED = 4 };
    char text[400] = "";
    const size_t count = json_array_size(outcome->moved);
    for (size_t i = 0; i < count && i < LISTED; i++) {
        const json_t *one = json_array_get(outcome->moved, i), *from = json_object_get(one, "from");
        const size_t used = strlen(text);
        char numbers[80] = "";
        if (json_is_number(from))
            (void)snprintf(numbers, sizeof numbers, " from %.6g to %.6g", json_number_value(from),
                           json_number_value(json_object_get(one, "to")));
        (void)snprintf(text + used, sizeof text - used, "%s%.60s %s%s", i > 0 ? ", " : "",
                       json_string_value(json_object_get(one, "joint")),
                       json_string_value(json_object_get(one, "part")), numbers);
    }
    char more[40] = "";
    if (count > LISTED)
        (void)snprintf(more, sizeof more, " and %zu more", count - LISTED);
    const kt_warning warning = {.code = "start_moved",
                                .time = 0.0,
                                .value = (double)count,
                                .is_said = true,
                                .remedy = "Give values that close the loops; 'initial: {hold: [JOINT]}' keeps a value"};
    const bool is_struck = kt_simulation_contacts(outcome->simulation).impacts > 0;
    if (count > 0)
        kt_warn(&outcome->warnings, &warning, "%s moved initial values that the scene gives: %s%s",
                kt_start_cause(outcome->model, is_struck), text, more);
}

void kt_report_start(kt_outcome *outcome, bool quiet) {
    const double *q = kt_outcome_positions(outcome);
    const double *v = kt_outcome_velocities(outcome);
    list_notes(outcome);
    kt_warn_of_start(outcome);
    outcome->moved = kt_start_moved(outcome->model, q, v);
    list_moved(outcome);
    if (!quiet)
        (void)kt_say_disagreement(outcome->scene, outcome->model);
    if (!quiet)
        (void)kt_start_say_moved(NULL, outcome->scene, outcome->model, q, v,
                                 kt_simulation_contacts(outcome->simulation).impacts > 0);
}

/* ---- the view ---------------------------------------------------------------------------------------------------- */

void kt_warn_of_frames(kt_outcome *outcome, const kt_motion *motion) {
    if (motion == NULL || motion->count < 2)
        return;
    const kt_warning lost = kt_warning_of("lost_mesh", (double)motion->picture->lost_meshes, NULL,
                                          "Mend the file, or take the item out of `meshes`");
    if (motion->picture->lost_meshes > 0)
        kt_warn(&outcome->warnings, &lost, "%d mesh%s not shown; the first is %s", motion->picture->lost_meshes,
                motion->picture->lost_meshes == 1 ? " is" : "es are", motion->picture->lost_reason);
    const double gap = motion->times[1] - motion->times[0], half_turn = 3.14159265358979323846;
    const kt_warning thinned = kt_warning_of("thinned_view", (double)motion->stride, NULL,
                                             "Give a longer --interval, or view a part of the motion with --duration");
    const kt_warning spin = kt_warning_of("fast_rotation", motion->fastest, "rad/s", "Give a shorter --interval");
    if (motion->stride > 1)
        kt_warn(&outcome->warnings, &thinned,
                "the view shows one record in %lld, for all would make it larger than %d MB", (long long)motion->stride,
                KT_MOTION_BYTES_MAX / 1000000);
    if (motion->fastest * gap > half_turn)
        kt_warn(&outcome->warnings, &spin,
                "'%s' turns by %.2g turns from frame to frame of the view, which shows it slower or backwards",
                kt_joint_name(outcome->model, motion->fastest_body), 0.5 * motion->fastest * gap / half_turn);
}
