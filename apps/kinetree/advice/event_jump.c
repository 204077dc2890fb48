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

enum { WATCHED_MOST = 64 };

/* Returns the index of the scene's event of this name, with `until` last; -1: it does not read atan2. */
static int find_angle_event(const kt_scene *scene, const char *name) {
    for (int i = 0; i < kt_scene_event_room(scene) && i < WATCHED_MOST; i++) {
        const kt_scene_event *event = i < scene->event_count ? &scene->events[i] : &scene->until;
        if (strcmp(event->name, name) == 0)
            return event->when != NULL && strstr(event->when, "atan2") != NULL ? i : -1;
    }
    return -1;
}

/* Returns the value of an event's formula in the state of a record; NaN if it cannot be computed. */
static double event_value_of(const kt_record *record) {
    kt_data *data = NULL;
    double value = (double)NAN;
    if (kt_data_create(record->model, &data, NULL) == KT_OK) {
        const kt_instant at = {
            .model = record->model, .data = data, .t = record->t, .q = record->q, .v = record->v, .x = record->x};
        if (record->event->function(&at, &value, NULL, record->event->user) != 0)
            value = (double)NAN;
    }
    kt_data_free(data);
    return value;
}

void kt_watch_event_jump(kt_outcome *outcome, const kt_record *record) {
    const int event = record->event != NULL && record->event->function != NULL && outcome->absolute == NULL
                          ? find_angle_event(outcome->scene, record->event->name)
                          : -1;
    if (event < 0 || (outcome->so_far.jumped >> event & 1U) != 0)
        return;
    const double value = event_value_of(record);
    if (!(fabs(value) > JUMP))
        return;
    outcome->so_far.jumped |= UINT64_C(1) << event;
    const kt_warning warning =
        kt_warning_at("event_jump", record->t, value, NULL,
                      "Give the event a `direction`, or compare sin and cos: y*cos(a) - x*sin(a) has no jump");
    kt_warn(&outcome->warnings, &warning,
            "event '%s' has happened at a jump of atan2, from pi to -pi: its formula is %.3g there, and not zero",
            record->event->name, value);
}
