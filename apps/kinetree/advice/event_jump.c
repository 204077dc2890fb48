/* Warns of an event at the jump of atan2.
 *
 * An angle by atan2 jumps from pi to -pi. A change of sign there counts as the event, although the angle does not pass
 * the value that the formula names. At a true root the value is next to zero, and behind the jump it is of the size of
 * a turn. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Values behind a root, rad: the root is enclosed to rounding of the time. */
#define JUMP 0.1

static const kt_scene_event *event_at(const kt_scene *scene, int i) {
    return i < scene->event_count ? &scene->events[i] : &scene->until;
}

bool kt_event_reads_angle(const kt_scene *scene, int event) {
    const char *when = event_at(scene, event)->when;
    return when != NULL && strstr(when, "atan2") != NULL;
}

bool kt_warn_of_event_jump(kt_warnings *warnings, const kt_scene *scene, kt_scene_watch *events,
                           const kt_simulation *simulation, int event) {
    const double value = kt_scene_event_value(events, simulation, event);
    const kt_warning warning =
        kt_warning_at("event_jump", kt_simulation_time(simulation), value, NULL,
                      "Give the event a `direction`, or compare sin and cos: y*cos(a) - x*sin(a) has no jump");
    if (!(fabs(value) > JUMP))
        return false;
    kt_warn(warnings, &warning,
            "event '%s' has happened at a jump of atan2, from pi to -pi: its formula is %.3g there, and not zero",
            event_at(scene, event)->name, value);
    return true;
}

void kt_watch_event_jump(kt_outcome *outcome, const kt_record *record) {
    const kt_scene *scene = outcome->scene;
    const int most = kt_scene_event_room(scene) < KT_EVENTS_NOTED ? kt_scene_event_room(scene) : KT_EVENTS_NOTED;
    for (int i = 0; i < most && record->event != NULL; i++) {
        if (strcmp(event_at(scene, i)->name, record->event->name) != 0 || !kt_event_reads_angle(scene, i) ||
            (outcome->so_far.jumped >> i & 1U) != 0)
            continue;
        if (kt_warn_of_event_jump(&outcome->warnings, scene, outcome->events, outcome->simulation, i))
            outcome->so_far.jumped |= UINT64_C(1) << i;
    }
}
