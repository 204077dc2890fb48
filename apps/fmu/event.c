/* Events of a scene in model exchange. The importer integrates, and locates changes of sign of event indicators; these
 * are the values of the events. In event mode the actions of all events that are due take effect in their order.
 *
 * The rules are those of a run (simulation/event.c). An event has a side, the sign that its value had last. It is due
 * if its value is on the other side, in its direction. An importer that stops at a root may find a value of zero, which
 * counts as the other side. If an action changes the value of an event, the event is on the side of its new value, and
 * is not due for this change.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "instance.h"

#include "algebra/elementary.h"
#include "simulation/event_root.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

kt_status kt_fmu_take_events(kt_fmu *fmu, kt_error *error) {
    const size_t room = fmu->simulation->events.count + 1;
    fmu->events = calloc(room, sizeof *fmu->events);
    if (fmu->events == NULL)
        return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory");
    fmu->event_count = fmu->is_exchange ? (int)fmu->simulation->events.count : 0;
    return KT_OK;
}

void kt_fmu_forget_events(kt_fmu *fmu) {
    for (int k = 0; k < fmu->event_count; k++)
        fmu->events[k] = (kt_fmu_event){.side = 0.0};
}

static bool is_armed(const kt_fmu *fmu, int k) {
    const uint64_t limit = fmu->simulation->events.list[k].limit;
    return limit == 0 || fmu->events[k].count < (double)limit;
}

kt_status kt_fmu_indicate(kt_fmu *fmu, int k, double *value, kt_error *error) {
    kt_simulation *simulation = fmu->simulation;
    const double t = fmu->is_exchange ? fmu->time : kt_simulation_time(simulation);
    *value = 1.0;
    if (fmu->is_exchange && !is_armed(fmu, k))
        return KT_OK;
    kt_status status = kt_fmu_show_signals(fmu, error);
    if (status == KT_OK)
        status = kt_simulation_set_torque(simulation, fmu->torque, error);
    return status == KT_OK ? kt_event_evaluate(simulation, (size_t)k, t, kt_fmu_state(fmu), value, error) : status;
}

/* Renews the values and sides of all events, and marks those that are due. With `is_action` none is, and only those
 * whose value changed have a new side. */
static kt_status renew_events(kt_fmu *fmu, bool is_action, bool *any, kt_error *error) {
    kt_status status = KT_OK;
    for (int k = 0; k < fmu->event_count && status == KT_OK; k++) {
        kt_fmu_event *e = &fmu->events[k];
        double value;
        status = kt_fmu_indicate(fmu, k, &value, error);
        const int side = value != 0.0 || is_action ? kt_sign_of(value) : -(int)e->side;
        if (status != KT_OK || !is_armed(fmu, k) || (is_action && value == e->value))
            continue;
        const kt_direction direction = fmu->simulation->events.list[k].direction;
        const bool counts = direction == KT_DIRECTION_EITHER || (direction == KT_DIRECTION_RISING) == (side > 0);
        if (!is_action && side != 0 && e->side != 0.0 && side != (int)e->side && counts)
            e->is_due = *any = true;
        if (side != 0 || is_action)
            e->side = side;
        e->value = value;
    }
    return status;
}

/* Applies an event in the state of the simulation, which is then that of the importer. */
static kt_status apply_event(kt_fmu *fmu, int k, bool *stops, kt_error *error) {
    const kt_event *event = &fmu->simulation->events.list[k];
    kt_fmu_event *e = &fmu->events[k];
    e->is_due = false;
    e->count += 1.0;
    const kt_occurrence what = {.event = event, .time = fmu->time, .side = (int)e->side, .count = (uint64_t)e->count};
    const int code = event->action != NULL ? event->action(fmu->simulation, &what, error, event->user) : 0;
    if (code < 0)
        return error->code != KT_OK ? error->code
                                    : kt_error_set(error, KT_ERROR_CALLBACK, event->name, "its action failed");
    *stops = *stops || code > 0 || event->stop;
    memcpy(fmu->y, kt_simulation_positions(fmu->simulation), (size_t)kt_fmu_size(fmu) * sizeof *fmu->y);
    kt_fmu_change(fmu);
    bool none;
    return renew_events(fmu, true, &none, error);
}

kt_status kt_fmu_apply_events(kt_fmu *fmu, bool *applied, bool *stops, kt_error *error) {
    kt_status status = renew_events(fmu, false, applied, error);
    if (status == KT_OK && *applied)
        status = kt_fmu_take_over(fmu, error);
    for (int k = 0; k < fmu->event_count && status == KT_OK && *applied; k++)
        if (fmu->events[k].is_due)
            status = apply_event(fmu, k, stops, error);
    return status;
}

double kt_fmu_next_breakpoint(const kt_fmu *fmu, double t) {
    double next = HUGE_VAL;
    for (int k = 0; k < fmu->event_count; k++) {
        const kt_event *event = &fmu->simulation->events.list[k];
        const double time =
            event->breakpoint != NULL && is_armed(fmu, k) ? event->breakpoint(event->user, t) : HUGE_VAL;
        next = time > t ? fmin(next, time) : next;
    }
    return next;
}
