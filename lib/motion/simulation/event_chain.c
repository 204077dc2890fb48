/* Chains of events: instants that follow each other without end, too many instants, and events whose time a run does
 * not reach.
 *
 * Instants of events that come ever closer accumulate. With the last interval d and the ratio r, their limit is d r /
 * (1 - r) after the last one. The ratio r (event_ratio) is the largest ratio of successive intervals that shrink, and
 * counts after SHRINKING of them (event_shrinking), since two events that are close by chance make one ratio small.
 *
 * A chain has no end if the time up to that limit is less than the part `at_once` of the time since its intervals
 * shrink (event_chain), or if its last interval is below INSTANTS times the width of an instant. The chain has no end
 * either if IN_A_ROW successive intervals are that short. Records have no part in this: they must not influence the
 * motion. The remaining impacts of a chain of contacts are applied at once (contact/accumulate.c), up to MARGIN times
 * that limit.
 *
 * Besides, at most WITHIN instants may lie within one fixed step, or within a thousandth of the run. This bounds the
 * cost of a step. Each call of kt_simulation_advance begins a new count.
 *
 * If a step is far too long for the motion, its dense output may have roots that no shorter step reaches. At most
 * MISSED successive steps may be cut short for such a root. Each of these steps is accepted. The next step is not
 * longer, since a longer step would show such a root again. If the slope at its beginning leads to the event, the next
 * step takes a little more than the remaining time. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/where.h"
#include "simulation/event_root.h"
#include "simulation/simulation.h"

#include <math.h>

static const double at_once = 1e-9;
enum { SHRINKING = 8, IN_A_ROW = 64, INSTANTS = 16, MARGIN = 4, PARTS = 1000, WITHIN = 10000, MISSED = 100 };

static kt_status reject_chain(const kt_simulation *simulation, size_t k, double t, kt_error *error) {
    return kt_error_set(
        error, KT_ERROR_STEP, kt_where_at("event", simulation->events.list[k].name, t).text,
        "events follow each other without end: there were %.0f instants with events, and the last two are %.3g s "
        "apart; %s",
        (double)simulation->memory.event_instants + 1.0, t - simulation->memory.event_last,
        k < kt_simulation_contact_events(simulation)
            ? "give its contact a larger rest_velocity, from which it rests; let no prescribed motion close a gap"
            : "give it a limit, let it stop the run, or change what it sets so that the chain ends");
}

static kt_status reject_many(const kt_simulation *simulation, size_t k, double t, double span, kt_error *error) {
    return kt_error_set(error, KT_ERROR_STEP, kt_where_at("event", simulation->events.list[k].name, t).text,
                        "%d instants of events lie within %.3g s (a fixed step, or a thousandth of the run), the "
                        "last one %.3g s behind the one before; %s",
                        (int)WITHIN, span, t - simulation->memory.event_last,
                        k < kt_simulation_contact_events(simulation)
                            ? "give its contact a larger rest_velocity, from which it rests, or a smaller restitution, "
                              "or take a smaller step"
                            : "give it a limit, or take a smaller step");
}

/* Counts the instants within a fixed step, or within a part of the run. */
static kt_status count_within(kt_simulation *simulation, size_t k, double t, kt_error *error) {
    kt_simulation_memory *memory = &simulation->memory;
    const double span = simulation->step > 0.0 ? simulation->step : simulation->duration / PARTS;
    if (memory->event_many == 0 || !(t - memory->event_since <= span)) {
        memory->event_since = t;
        memory->event_many = 0;
    }
    return ++memory->event_many > WITHIN
               ? kt_simulation_explain_disc(simulation, reject_many(simulation, k, t, span, error), error)
               : KT_OK;
}

/* Whether the accumulating events are impacts of a hard contact, which are applied now up to the end of the window. */
static bool comes_to_rest(kt_simulation *simulation, size_t k, double window) {
    simulation->memory.event_row = simulation->memory.event_shrinking = 0;
    return k < simulation->contact_count && simulation->events.source->rest(simulation, k, window);
}

/* Continues the chain of shrinking intervals with the interval d from event_last to the present instant. If d does not
 * shrink, a new chain begins with the interval before. short_interval: the length up to which intervals count as
 * short. */
static void extend_chain(kt_simulation_memory *memory, double d, double short_interval) {
    const double before = memory->event_interval;
    const bool follows = memory->event_instants > 0, shrinks = memory->event_instants > 1 && d < before;
    memory->event_chain = shrinks && memory->event_shrinking > 0 ? memory->event_chain : memory->event_last - before;
    memory->event_shrinking = shrinks ? memory->event_shrinking + 1 : 0;
    memory->event_ratio = shrinks ? fmax(memory->event_shrinking > 1 ? memory->event_ratio : 0.0, d / before) : 0.0;
    memory->event_row = follows && d <= short_interval ? memory->event_row + 1 : 0;
}

/* Whether the chain, continued to the instant t, has no end. If its events are those of contacts, the remaining impacts
 * are applied at once: those up to the time *window behind t. */
static bool has_no_end(const kt_simulation_memory *memory, double t, double short_interval, double *window) {
    const double d = t - memory->event_last, r = memory->event_ratio, lasts = t - memory->event_chain;
    const double left = d * r / (1.0 - r);
    const bool is_row = memory->event_row >= IN_A_ROW;
    /* An interval within the rounding of t has no meaningful ratio to others. */
    const bool has_ratio = d > kt_time_together(t);
    const bool is_close = memory->event_shrinking >= SHRINKING && (d <= short_interval || left <= at_once * lasts);
    *window = is_row ? IN_A_ROW * short_interval : MARGIN * left;
    return is_row || (has_ratio && is_close);
}

kt_status kt_simulation_count_instant(kt_simulation *simulation, size_t k, double t, kt_error *error) {
    kt_simulation_memory *memory = &simulation->memory;
    const double d = t - memory->event_last, short_interval = INSTANTS * kt_event_together(simulation, t);
    const bool follows = memory->event_instants > 0;
    double window;
    simulation->events.latest = k;
    extend_chain(memory, d, short_interval);
    if (has_no_end(memory, t, short_interval, &window) && !comes_to_rest(simulation, k, window))
        return kt_simulation_explain_disc(simulation, reject_chain(simulation, k, t, error), error);
    const kt_status status = count_within(simulation, k, t, error);
    if (status != KT_OK)
        return status;
    memory->event_interval = follows ? d : 0.0;
    memory->event_last = t;
    memory->event_instants++;
    return KT_OK;
}

kt_status kt_simulation_count_miss(kt_simulation *simulation, bool missed, size_t k, kt_error *error) {
    static const double beyond = 1.1; /* of the remaining time */
    const double t = kt_integrator_time(simulation->integrator),
                 length = t - kt_integrator_previous_time(simulation->integrator);
    if (missed && simulation->memory.event_missed >= MISSED)
        return kt_error_set(error, KT_ERROR_STEP, kt_where_at("event", simulation->events.list[k].name, t).text,
                            "%d successive steps were cut short for this event, and none reached it (the last one has "
                            "%.3g s): the steps are too long for the motion; take a smaller step or tolerance",
                            (int)MISSED, length);
    simulation->memory.event_missed = missed ? simulation->memory.event_missed + 1 : 0;
    if (missed)
        simulation->memory.shortened = fmin(length, beyond * (simulation->events.lead - t));
    return KT_OK;
}

/* ---- a step ------------------------------------------------------------------------------------------------------ */

void kt_simulation_store_cause(kt_simulation *simulation, const kt_error *error) {
    if (error->code != KT_ERROR_CALLBACK || simulation->cause.code == KT_OK)
        simulation->cause = *error;
    simulation->ahead = true;
}

bool kt_simulation_skips_contact(const kt_simulation *simulation) {
    const double *last = simulation->events.value + (KT_EVENT_VALUES - 2) * simulation->size.event;
    bool skips = false;
    for (size_t k = 0; k < kt_simulation_contact_events(simulation); k++)
        skips = skips || (!simulation->event_root[k].due && simulation->event_memory[k].side > 0 && last[k] < 0.0);
    return skips;
}

bool kt_simulation_ends_slip(const kt_simulation *simulation, size_t k) {
    const double last = simulation->events.value[(KT_EVENT_VALUES - 2) * simulation->size.event + k];
    return k < kt_simulation_contact_events(simulation) && simulation->events.source->ends(simulation, k, last);
}

bool kt_simulation_hides_contact(const kt_simulation *simulation, size_t k, bool is_brief) {
    const double *value = simulation->events.value + k;
    const double last = value[(KT_EVENT_VALUES - 2) * simulation->size.event];
    bool hides = k < kt_simulation_contact_events(simulation) && last == value[0] &&
                 fabs(last) <= simulation->events.source->margin(simulation, k);
    for (size_t j = 1; !is_brief && j + 2 < KT_EVENT_VALUES; j++)
        hides = hides && value[j * simulation->size.event] == last;
    return hides;
}
