/* The list of events, which hard contacts and callers extend. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "step/simulation_core.h"

#include <assert.h>
#include <math.h>

void kt_event_append(kt_simulation *simulation, const kt_event *event) {
    assert(simulation->events.count < simulation->size.event);
    const size_t k = simulation->events.count++;
    simulation->events.list[k] = *event;
    simulation->event_memory[k] = (kt_event_memory){.breakpoint = (double)NAN};
    simulation->event_root[k] = (kt_event_root){.due = 0};
    simulation->events.search[k] = (kt_event_search){.breakpoint = (double)NAN};
    simulation->events.time = (double)NAN;
    kt_parts_list(simulation);
}
