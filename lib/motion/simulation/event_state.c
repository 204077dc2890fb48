/* Events between steps: their list, which are armed, how often each happened, and which ended the motion. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/where.h"
#include "simulation/simulation.h"

#include "integrator/integrator.h"

#include <math.h>
#include <string.h>

/* Returns the index of the event of this name; events.count if there is none. */
static size_t find_event_named(const kt_simulation *simulation, const char *name) {
    size_t k = 0;
    while (k < simulation->events.count && strcmp(simulation->events.list[k].name, name) != 0)
        k++;
    return k;
}

kt_status kt_simulation_event_add(kt_simulation *simulation, const kt_event *event, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, event))
        return KT_ERROR_ARGUMENT;
    if (event->name == NULL || event->function == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_simulation_event_add",
                            "an event needs a name and a function");
    if ((unsigned)event->direction > KT_DIRECTION_FALLING)
        return kt_error_set(error, KT_ERROR_ARGUMENT, event->name, "there is no direction %d", (int)event->direction);
    if (find_event_named(simulation, event->name) < simulation->events.count)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, kt_where_format("event '%.60s'", event->name).text,
            "there is an event of this name already (hard stops, contacts, slack ropes and friction that "
            "sticks are events of the names of their loops, and `until` is one); give this one another");
    if (simulation->events.count == simulation->size.event)
        return kt_error_set(error, KT_ERROR_MEMORY, "kt_simulation_event_add",
                            "there is room for %lu events; give their number in the simulation's options (events)",
                            (unsigned long)simulation->size.event);
    kt_event_append(simulation, event);
    simulation->integrator->may_end_early |= event->stop || event->action != NULL;
    return KT_OK;
}

kt_status kt_simulation_event_set_on(kt_simulation *simulation, const char *name, bool on, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, name))
        return KT_ERROR_ARGUMENT;
    const size_t k = find_event_named(simulation, name);
    const kt_where_text where = kt_where_format("event '%.60s'", name);
    if (k == simulation->events.count)
        return kt_error_set(error, KT_ERROR_ARGUMENT, where.text, "there is no event of this name");
    if (k < kt_simulation_contact_events(simulation))
        return kt_error_set(error, KT_ERROR_ARGUMENT, where.text,
                            "it is that of a hard contact, which acts until it is released; use "
                            "kt_simulation_set_released");
    if (on != (simulation->event_memory[k].off == 0)) {
        simulation->event_memory[k].off = !on;
        simulation->event_memory[k].side = 0;
        simulation->event_memory[k].breakpoint = (double)NAN;
        simulation->event_root[k] = (kt_event_root){.due = 0};
        simulation->events.time = (double)NAN;
    }
    return KT_OK;
}

const kt_event *kt_simulation_stopped(const kt_simulation *simulation) {
    return simulation && simulation->memory.stopped > 0 ? &simulation->events.list[simulation->memory.stopped - 1]
                                                        : NULL;
}

uint64_t kt_simulation_event_count(const kt_simulation *simulation, const char *name) {
    const size_t k = simulation && name ? find_event_named(simulation, name) : 0;
    return simulation && name && k < simulation->events.count ? simulation->event_memory[k].count : 0;
}

const char *kt_simulation_event_name(const kt_simulation *simulation, size_t k) {
    return simulation && k < simulation->events.count ? simulation->events.list[k].name : NULL;
}

kt_event_cuts kt_simulation_event_cuts(const kt_simulation *simulation) {
    kt_event_cuts cuts = {.time = (double)NAN};
    if (simulation && simulation->memory.event_cuts > 0)
        cuts = (kt_event_cuts){.count = simulation->memory.event_cuts,
                               .time = simulation->memory.event_cut_time,
                               .event = &simulation->events.list[simulation->memory.event_cut_of]};
    return cuts;
}
