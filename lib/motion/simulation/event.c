/* Events: times at which a function g(t, q, v) of the motion changes its sign.
 *
 * After a step from t0 to t1, g is sampled on the dense output: at t0, at t1 and three times between them. The
 * first root in the event's direction is found between two samples of different sign, or at the vertex of a parabola
 * through three samples (event_root.c). No step sees two roots closer than that: max_step bounds the roots that can be
 * missed.
 *
 * A step is long if the motion is simple (a driven crank, a wheel that turns freely), but g need not be simple. Such a
 * step is divided into panels. In a panel, no joint turns by more than half a turn, by its rates at the ends of the
 * step. A panel also ends at breakpoints of g as a function of time. Panels are sampled in turn until one has a root.
 *
 * The number of values of g that the search of a step may take is limited, for all its repetitions together. Each
 * repetition takes at most half of the remaining values. Beyond this limit, an adaptive step is repeated with the
 * length for which half of these values suffice. A fixed step has fewer, longer panels, and is counted (kt_event_cuts).
 *
 * Then the step is undone, and repeated so that it ends at the root. The state at the root has the order of the
 * method, not that of the dense output, and the next step begins there. The repeated step has another dense output, on
 * which the root differs by the error of the first dense output. The root is searched again. Since both dense outputs
 * agree better towards the end of a step, one or two repetitions suffice.
 *
 * Each repetition is shorter than the last. If a repetition has no root and has not reached its event, the root of the
 * longer step was an error of its dense output, for example because friction reversed within the step. Then the
 * repetition is accepted, and the next step begins at its end, nearer to the event. A longer repetition would have the
 * wrong dense output again, so that both would alternate, and other events between them would be missed.
 *
 * An event has a side: the sign that g had last. A value of zero keeps the previous side, so that a root at the end of
 * a step is not found twice. Open hard contacts that touch have the side -1, because they part, and may close again. If
 * forces have changed before such a contact parted, the contact penetrates instead, which is an event, too. Roots
 * within kt_event_together of each other are one instant. At an instant, events take effect in the order in which they
 * were added.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "simulation/event_root.h"

#include <limits.h>
#include <math.h>
#include <string.h>

enum { REPETITIONS = 8, SETTLES = 3 };
_Static_assert((REPETITIONS + 1) * KT_EVENT_AT_LEAST + 2 <= KT_EVENT_EVALUATIONS_LEAST,
               "what a step takes in any case");

/* The largest turn of a joint in a panel, by the rates at both ends of the step. */
static const double half_turn = 3.14159265358979323846;

/* The shortest step that the search for roots takes, s. */
static double shortest_event_step(const kt_simulation *simulation, double t) {
    return kt_time_step(kt_event_extent_of_times(simulation, t));
}

/* If the step was to end at a root, values below this part of the largest along the step are the root. */
static const double reached = 1e-3;

/* ---- a panel ----------------------------------------------------------------------------------------------------- */

/* Samples g along a panel whose first values are available: at its end, and three times between. */
static kt_status sample_panel(kt_simulation *simulation, double from, double to, double *times, kt_error *error) {
    const double t1 = kt_integrator_time(simulation->integrator);
    kt_status status = KT_OK;
    for (int j = 0; j < KT_EVENT_SAMPLES; j++)
        times[j] = j + 1 < KT_EVENT_SAMPLES ? from + (to - from) * j / (KT_EVENT_SAMPLES - 1) : to;
    for (int j = 1; status == KT_OK && j < KT_EVENT_SAMPLES; j++) {
        const double *y = kt_integrator_state(simulation->integrator);
        if (j + 1 < KT_EVENT_SAMPLES || to != t1) {
            status = kt_simulation_between(simulation, times[j], error);
            y = simulation->y;
        }
        if (status == KT_OK)
            status = kt_event_evaluate_all(simulation, times[j], y,
                                           simulation->events.value + (size_t)j * simulation->size.event, error);
    }
    return status;
}

/* Whether the step ends at event k as planned: the state has almost reached the event, or is beyond it. If the state is
 * far from the event, the dense output of the previous, longer try was wrong, for example because friction reversed
 * within that try. Then the time to which the slope at the end leads is noted. */
static bool arrives(kt_simulation *simulation, size_t k, const double *times) {
    const double *before = simulation->events.value + (KT_EVENT_SAMPLES - 2) * simulation->size.event + k,
                 *end = times + KT_EVENT_SAMPLES - 1;
    const double last = before[simulation->size.event], slope = (last - *before) / (end[0] - end[-1]);
    const bool is_hidden =
        kt_simulation_hides_contact(simulation, k, *end - times[0] <= kt_event_together(simulation, times[0]));
    if (is_hidden || kt_sign_of(last) != -simulation->event_root[k].side ||
        !(fabs(last) > reached * simulation->events.search[k].size))
        return true;
    if (slope * last < 0.0)
        simulation->events.lead = fmin(simulation->events.lead, *end - last / slope);
    return false;
}

/* Finds the roots of all events in a panel, in `root` and `side`. The earliest root so far becomes *first. settles: an
 * awaited end of slip is at the end of the step if the slip is below its rest velocity at the end. */
static kt_status find_roots_in(kt_simulation *simulation, const double *times, bool settles, double *first,
                               kt_error *error) {
    const double t1 = kt_integrator_time(simulation->integrator);
    kt_status status = KT_OK;
    for (size_t k = 0; status == KT_OK && k < simulation->events.count; k++) {
        kt_event_root *found = &simulation->event_root[k];
        kt_event_search *search = &simulation->events.search[k];
        double root = HUGE_VAL;
        int side = 0;
        if (found->due && found->time <= times[0]) /* in an earlier panel */
            continue;
        for (size_t j = 0; j < KT_EVENT_SAMPLES; j++)
            search->size = fmax(search->size, fabs(simulation->events.value[j * simulation->size.event + k]));
        if (kt_event_is_watched(simulation, k))
            status = kt_event_find_root(simulation, k, times, &root, &side, error);
        const bool is_awaited = found->due && found->time == t1;
        const bool settled =
            is_awaited && settles && times[KT_EVENT_SAMPLES - 1] == t1 && kt_simulation_ends_slip(simulation, k);
        root = settled ? HUGE_VAL : root;
        found->due = root < HUGE_VAL || is_awaited;
        if (root < HUGE_VAL) {
            found->time = root;
            found->side = side;
        } else if (is_awaited && times[KT_EVENT_SAMPLES - 1] == t1) {
            found->due = settled || arrives(simulation, k, times);
        }
        if (found->due)
            *first = fmin(*first, found->time);
    }
    return status;
}

/* The first breakpoint of an event after t, and the index of that event. The next search follows only after this
 * breakpoint is passed, because a search costs more than a step. */
static double next_event_breakpoint(kt_simulation *simulation, double t, size_t *of) {
    double next = HUGE_VAL;
    for (size_t k = 0; k < simulation->events.count; k++) {
        const kt_event *event = &simulation->events.list[k];
        double *breakpoint = &simulation->events.search[k].breakpoint;
        if (event->breakpoint == NULL || !kt_event_is_watched(simulation, k))
            continue;
        if (!(t < *breakpoint))
            *breakpoint = event->breakpoint(event->user, t);
        if (*breakpoint > t && *breakpoint < next) {
            next = *breakpoint;
            *of = k;
        }
    }
    return next;
}

/* ---- a step ------------------------------------------------------------------------------------------------------ */

/* The largest rate at which a joint turns in the state y, rad/s. */
static double largest_rate(const kt_simulation *simulation, const double *y) {
    const kt_model *model = simulation->model;
    const double *v = y + simulation->size.nq;
    double most = 0.0;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        double square = 0.0;
        for (int k = kt_link_lengths(link); k < kt_link_dofs(link); k++)
            square += v[link->v + k] * v[link->v + k];
        most = fmax(most, square);
    }
    return sqrt(most);
}

/* Evaluates g at the present time, unless the values are available, and sets the sides that are not set yet. */
static kt_status begin_events(kt_simulation *simulation, kt_error *error) {
    const double t = kt_integrator_time(simulation->integrator);
    const double *y = kt_integrator_state(simulation->integrator);
    if (simulation->events.time == t)
        return KT_OK;
    const kt_status status = kt_event_evaluate_all(simulation, t, y, simulation->events.value, error);
    if (status != KT_OK)
        return status;
    simulation->events.time = t;
    simulation->events.rate = largest_rate(simulation, y);
    for (size_t k = 0; k < simulation->events.count; k++)
        if (simulation->event_memory[k].side == 0 && kt_event_is_watched(simulation, k))
            simulation->event_memory[k].side = kt_sign_of(simulation->events.value[k]);
    return KT_OK;
}

/* Sets the values with which a search along the last step begins. */
static void begin_search(kt_simulation *simulation) {
    const size_t n = simulation->size.event;
    simulation->events.rate_end = largest_rate(simulation, kt_integrator_state(simulation->integrator));
    kt_copy(simulation->events.value + KT_EVENT_SAMPLES * n, simulation->events.value, n * sizeof(double));
    simulation->events.cut = 0;
    simulation->events.lead = HUGE_VAL;
    for (size_t k = 0; k < simulation->events.count; k++)
        simulation->events.search[k] = (kt_event_search){.side = (int)simulation->event_memory[k].side,
                                                         .spent = simulation->events.search[k].spent,
                                                         .breakpoint = simulation->event_memory[k].breakpoint};
}

/* The largest number of values that the step has taken so far for one event. */
static int most_spent(const kt_simulation *simulation) {
    int most = 0;
    for (size_t k = 0; k < simulation->events.count; k++)
        most = simulation->events.search[k].spent > most ? simulation->events.search[k].spent : most;
    return most;
}

/* The first event that is watched; events.count if there is none. */
static size_t first_watched(const kt_simulation *simulation) {
    size_t k = 0;
    while (k < simulation->events.count && !kt_event_is_watched(simulation, k))
        k++;
    return k;
}

/* The limits of the search along a step, and its progress. */
typedef struct reach {
    int begin, most; /* values taken before, and those with which the search ends */
    double half;     /* s, the time at which half of them were taken */
    bool cut;        /* the last panel contains more than half a turn, or breakpoints */
    size_t of;       /* the event that is reported: that of the last breakpoint, else the first watched one */
} reach;

/* A search may take half of the values that are left, apart from those that a step takes in any case
 * (KT_EVENT_EVALUATIONS_LEAST). */
static reach begin_reach(kt_simulation *simulation) {
    const int begin = most_spent(simulation);
    reach r = {.begin = begin, .most = INT_MAX, .half = -HUGE_VAL, .of = first_watched(simulation)};
    const int left = simulation->events.evaluations - KT_EVENT_EVALUATIONS_LEAST - begin;
    r.most = simulation->events.most = begin + (left > 0 ? left / 2 : 0);
    return r;
}

/* The number of panels of equal length of a step. An adaptive step is searched as far as its values suffice. */
static double count_panels(const kt_simulation *simulation, double length, reach *r) {
    const double turn = length * fmax(simulation->events.rate, simulation->events.rate_end);
    const double count = fmax(1.0, ceil(turn / half_turn)),
                 most = floor((double)(r->most - r->begin) / (KT_EVENT_SAMPLES - 1));
    if (simulation->step > 0.0 && count > most) {
        r->cut = true;
        return fmax(1.0, most);
    }
    return count;
}

/* The end of the panel [from, to] of a step to t1, or t1 if the values of the functions that are left do not suffice
 * for a further panel. Stores in r->half the beginning of the last panel before which half of the values were left. If
 * the search does not suffice for the whole step, a shorter step ends at that time. */
static double end_of_panel(const kt_simulation *simulation, double from, double to, double t1, reach *r) {
    const int spent = most_spent(simulation);
    if (2 * (spent - r->begin) <= r->most - r->begin)
        r->half = from;
    if (!(to < t1) || spent + 2 * (KT_EVENT_SAMPLES - 1) <= r->most)
        return to;
    r->cut = true;
    return t1;
}

/* Counts a search that was cut, with a last panel that is too long. */
static void count_cut(kt_simulation *simulation, const reach *r) {
    kt_simulation_memory *memory = &simulation->memory;
    if (memory->event_cuts++ == 0) {
        memory->event_cut_time = kt_integrator_previous_time(simulation->integrator);
        memory->event_cut_of = (int64_t)r->of;
    }
}

/* Finds the roots of all events in the first panel of the last step that has any, and the roots of the same instant.
 * The earliest root, or HUGE_VAL, goes to *first. If the search of an adaptive step takes too many values, the end of
 * the repeated step goes to *shorter, else HUGE_VAL. is_first: the step has not been searched before. may_shorten: the
 * step is adaptive, and may be repeated. settles: as in find_roots_in. */
static kt_status find_roots(kt_simulation *simulation, bool is_first, bool may_shorten, bool settles, double *first,
                            double *shorter, kt_error *error) {
    const size_t n = simulation->size.event;
    const double t0 = kt_integrator_previous_time(simulation->integrator);
    const double t1 = kt_integrator_time(simulation->integrator);
    double *value = simulation->events.value;
    double times[KT_EVENT_SAMPLES], from = t0, i = 1.0;
    kt_status status = KT_OK;
    *first = *shorter = HUGE_VAL;
    begin_search(simulation);
    reach r = begin_reach(simulation);
    if (r.of == simulation->events.count)
        return KT_OK;
    const double count = count_panels(simulation, t1 - t0, &r);
    if (is_first && count == 1.0 && !r.cut && !(next_event_breakpoint(simulation, t0, &r.of) < t1) &&
        kt_event_all_far(simulation)) {
        simulation->events.reach = t1;
        return KT_OK;
    }
    while (status == KT_OK && from < t1 && from <= *first + kt_event_together(simulation, *first)) {
        const double even = i < count ? t0 + (t1 - t0) * (i / count) : t1,
                     breakpoint = next_event_breakpoint(simulation, from, &r.of);
        const double to = end_of_panel(simulation, from, fmin(even, breakpoint), t1, &r);
        if (may_shorten && r.cut && r.half > t0 + shortest_event_step(simulation, t0)) {
            *shorter = r.half;
            break;
        }
        if (from > t0)
            kt_copy(value, value + (KT_EVENT_SAMPLES - 1) * n, n * sizeof(double));
        status = sample_panel(simulation, from, to, times, error);
        if (status == KT_OK)
            status = find_roots_in(simulation, times, settles, first, error);
        from = to;
        i += to == even;
    }
    if (r.cut && !(*shorter < HUGE_VAL))
        count_cut(simulation, &r);
    kt_copy(value, value + KT_EVENT_SAMPLES * n, n * sizeof(double));
    simulation->events.reach = from;
    return status;
}

/* The last root that belongs to the same instant as the first root. Later roots are not due any longer. */
static double event_instant_of(kt_simulation *simulation, double first) {
    double last = first;
    for (size_t k = 0; k < simulation->events.count; k++)
        if (simulation->event_root[k].due &&
            simulation->event_root[k].time <= first + kt_event_together(simulation, first))
            last = fmax(last, simulation->event_root[k].time);
    for (size_t k = 0; k < simulation->events.count; k++)
        if (simulation->event_root[k].due) {
            simulation->event_root[k].due = simulation->event_root[k].time <= last;
            simulation->event_root[k].time = last;
        }
    return last;
}

/* Accepts the last step: its end becomes the beginning of the next one. fires: events that are due take effect there,
 * and have the side behind their root. */
static void pass_step(kt_simulation *simulation, bool fires) {
    const size_t n = simulation->size.event;
    kt_copy(simulation->events.value, simulation->events.value + (KT_EVENT_SAMPLES - 1) * n, n * sizeof(double));
    simulation->events.time = kt_integrator_time(simulation->integrator);
    simulation->events.rate = simulation->events.rate_end;
    kt_simulation_clear_jump(simulation);
    simulation->memory.cut += simulation->events.cut;
    for (size_t k = 0; k < simulation->events.count; k++) {
        if (!kt_event_is_watched(simulation, k)) /* it has no value */
            continue;
        const int side = kt_sign_of(simulation->events.value[k]);
        const bool due = fires && simulation->event_root[k].due;
        simulation->event_memory[k].size = simulation->events.search[k].size;
        simulation->event_memory[k].breakpoint = simulation->events.search[k].breakpoint;
        if (due || side != 0)
            simulation->event_memory[k].side = due ? simulation->event_root[k].side : side;
    }
    simulation->memory.fires = fires;
}

/* Begins the tries of a step, the first of which ends at t1. */
static void begin_tries(kt_simulation *simulation, double t1) {
    simulation->events.end = t1;
    if (simulation->contacts == NULL) {
        static const double steps = 3.0; /* of the longest ones so far, in which a motion changes */
        const double length = t1 - kt_integrator_previous_time(simulation->integrator);
        simulation->memory.own_time = fmax(simulation->memory.own_time, steps * length);
    }
    for (size_t k = 0; k < simulation->events.count; k++)
        simulation->event_root[k].due = false;
}

/* Whether this is the first search of a step. */
static bool is_first_search(kt_simulation *simulation) {
    const bool first = !simulation->events.searched;
    simulation->events.searched = true;
    return first;
}

/* The event at which this try of the step was to end; events.count if there is none. */
static size_t aim_of(const kt_simulation *simulation) {
    const double t1 = kt_integrator_time(simulation->integrator);
    size_t k = 0;
    while (k < simulation->events.count && !(simulation->event_root[k].due && simulation->event_root[k].time == t1))
        k++;
    return k;
}

/* Remembers an event for which a step is repeated (steps_per_call). */
static void remember_due(kt_simulation *simulation) {
    for (size_t k = simulation->events.count; k-- > 0;)
        if (simulation->event_root[k].due)
            simulation->events.latest = k;
}

/* Whether a contact that is due is far from its event at the beginning of the step. Its value jumps between both, for
 * example because a force jumps next to the beginning of a fixed step. At the beginning it has not happened yet. */
static bool is_due_by_jump(const kt_simulation *simulation) {
    bool jumps = false;
    for (size_t k = 0; k < kt_simulation_contact_events(simulation); k++) {
        const double first = simulation->events.value[KT_EVENT_SAMPLES * simulation->size.event + k];
        jumps = jumps || (simulation->event_root[k].due && kt_sign_of(first) == -simulation->event_root[k].side &&
                          fabs(first) > reached * simulation->events.search[k].size);
    }
    return jumps;
}

/* Searches events after a try. If an event happened within the step, the step is undone, and the next try ends at the
 * event. */
static kt_status reject_event_step(kt_simulation *simulation, kt_step_progress *progress, kt_verdict *verdict,
                                   kt_error *error) {
    const int repetition = progress->undone;
    const double t0 = kt_integrator_previous_time(simulation->integrator);
    const double t1 = kt_integrator_time(simulation->integrator);
    double first, shorter;
    const bool is_first = is_first_search(simulation);
    if (is_first)
        for (size_t k = 0; k < simulation->events.count; k++)
            simulation->events.search[k].spent = 0;
    if (repetition == 0)
        begin_tries(simulation, t1);
    const size_t aim = aim_of(simulation);
    const bool may_shorten = simulation->step == 0.0 && repetition < REPETITIONS;
    kt_status status = find_roots(simulation, is_first && repetition == 0, may_shorten, repetition >= SETTLES, &first,
                                  &shorter, error);
    double instant = status == KT_OK && first < HUGE_VAL ? event_instant_of(simulation, first) : HUGE_VAL;
    const bool ends = repetition >= REPETITIONS &&
                      !(t1 - instant > kt_event_together(simulation, t1) && kt_simulation_skips_contact(simulation));
    const double least = 2.0 * shortest_event_step(simulation, simulation->events.end);
    const bool jumps = instant - t0 < least && is_due_by_jump(simulation);
    const bool reaches = fabs(t1 - instant) <= kt_event_least_width(simulation, t1) || (jumps && t1 - t0 <= least);
    const bool fires = instant < HUGE_VAL && (reaches || ends);
    if (fires && simulation->events.reach != t1) /* the last panel ended before the end of the step */
        status =
            kt_event_evaluate_all(simulation, t1, kt_integrator_state(simulation->integrator),
                                  simulation->events.value + (KT_EVENT_SAMPLES - 1) * simulation->size.event, error);
    if (status != KT_OK) {
        kt_simulation_store_cause(simulation, error);
        kt_integrator_retreat(simulation->integrator, t1 - t0);
        return status;
    }
    if (shorter < HUGE_VAL) {
        kt_integrator_retreat(simulation->integrator, shorter - t0);
        *verdict = KT_VERDICT_REPEAT;
        progress->t_limit = shorter;
        return KT_OK;
    }
    if (fires || !(instant < HUGE_VAL)) {
        simulation->events.fires = fires;
        simulation->events.aim = fires ? simulation->events.count : aim;
        return KT_OK;
    }
    instant = repetition >= REPETITIONS && !ends ? 0.5 * (t0 + t1) : jumps ? t0 + least : instant;
    kt_integrator_retreat(simulation->integrator, instant - t0);
    remember_due(simulation);
    *verdict = instant - t0 > shortest_event_step(simulation, instant) ? KT_VERDICT_REPEAT : KT_VERDICT_STAY;
    progress->t_limit = instant;
    if (*verdict == KT_VERDICT_STAY) { /* no step is so short: the event happens at the present state */
        for (size_t k = 0; k < simulation->events.count; k++)
            if (simulation->event_root[k].due)
                simulation->event_memory[k].side = simulation->event_root[k].side;
        simulation->memory.fires = true;
    }
    return KT_OK;
}

/* Accepts the last try, which all parts have accepted. */
static kt_status accept_events(kt_simulation *simulation, kt_error *error) {
    const size_t aim = simulation->events.aim;
    const double t0 = kt_integrator_previous_time(simulation->integrator);
    const kt_status status = kt_simulation_count_miss(simulation, aim < simulation->events.count, aim, error);
    if (status == KT_OK)
        pass_step(simulation, simulation->events.fires);
    else
        kt_integrator_retreat(simulation->integrator, kt_integrator_time(simulation->integrator) - t0);
    return status;
}

static kt_status begin_search_of_step(kt_simulation *simulation, kt_error *error) {
    simulation->events.searched = false;
    return begin_events(simulation, error);
}

static bool has_events(const kt_simulation *simulation) { return simulation->events.count > 0; }

/* ---- effects of events ------------------------------------------------------------------------------------------- */

/* Passes the present record to the recorder, if the event records or stops. Called before the action of the event, and
 * again after an action that changed the state. */
static kt_status hand_over_event(kt_simulation *simulation, size_t k, kt_recorder *recorder, void *user,
                                 kt_error *error) {
    const kt_event *event = &simulation->events.list[k];
    if (recorder == NULL || !(event->record || event->stop))
        return KT_OK;
    return kt_simulation_record_event(simulation, event, recorder, user, error);
}

/* Applies one event: its action, or the end of the run. */
static kt_status apply_one_event(kt_simulation *simulation, size_t k, kt_error *error) {
    const kt_event *event = &simulation->events.list[k];
    kt_error from = {0};
    const double t = kt_integrator_time(simulation->integrator);
    const kt_occurrence what = {.event = event,
                                .time = t,
                                .side = (int)simulation->event_root[k].side,
                                .count = ++simulation->event_memory[k].count};
    simulation->within = "the action of an event";
    const int code = event->action != NULL ? event->action(simulation, &what, &from, event->user) : 0;
    simulation->within = NULL;
    if (code < 0)
        return kt_event_fail(event, "action", t, &from, code, error);
    if (code > 0 || event->stop)
        simulation->memory.stopped = (int64_t)k + 1;
    return KT_OK;
}

/* Renews the sides after actions. An event whose value changed is on the side of its new value. If that value is zero,
 * the next nonzero value decides. */
static kt_status renew_sides(kt_simulation *simulation, kt_error *error) {
    if (simulation->events.time == kt_integrator_time(simulation->integrator))
        return KT_OK;
    const size_t n = simulation->size.event;
    double *before = simulation->events.value + n;
    memcpy(before, simulation->events.value, n * sizeof(double));
    const kt_status status = begin_events(simulation, error);
    for (size_t k = 0; status == KT_OK && k < simulation->events.count; k++)
        if (simulation->events.value[k] != before[k] && k >= kt_simulation_contact_events(simulation))
            simulation->event_memory[k].side = kt_sign_of(simulation->events.value[k]);
    return status;
}

/* Applies one event that is due: its record, its action and, if the action has changed the state, another record behind
 * it. A recorder that stops the run at an event does not receive the first record again. */
static kt_status fire(kt_simulation *simulation, size_t k, kt_recorder *recorder, void *user, kt_error *error) {
    kt_event_root *root = &simulation->event_root[k];
    const double t = kt_integrator_time(simulation->integrator);
    kt_status status = KT_OK;
    if (!root->recorded) {
        root->recorded = true;
        status = hand_over_event(simulation, k, recorder, user, error);
    }
    if (status != KT_OK)
        return status;
    root->due = root->recorded = false;
    status = apply_one_event(simulation, k, error);
    const bool awaits_step = k < simulation->contact_count && simulation->memory.leaps > 0; /* nothing changed */
    if (status != KT_OK || simulation->events.time == t || awaits_step)
        return status;
    status = renew_sides(simulation, error); /* before the record: a checkpoint there holds them */
    return status == KT_OK ? hand_over_event(simulation, k, recorder, user, error) : status;
}

/* Applies all events that are due, in their order. The first one counts the instant. */
static kt_status fire_all(kt_simulation *simulation, kt_recorder *recorder, void *user, kt_error *error) {
    kt_status status = begin_events(simulation, error); /* the values are missing only after a checkpoint */
    size_t k = 0;
    while (k < simulation->events.count && !simulation->event_root[k].due)
        k++;
    if (status == KT_OK && k < simulation->events.count && !simulation->event_root[k].recorded)
        status = kt_simulation_count_instant(simulation, k, kt_integrator_time(simulation->integrator), error);
    for (; status == KT_OK && k < simulation->events.count; k++)
        if (simulation->event_root[k].due)
            status = fire(simulation, k, recorder, user, error);
    if (status != KT_OK)
        return status;
    simulation->memory.fires = false;
    return renew_sides(simulation, error);
}

/* ---- the part of a simulation ------------------------------------------------------------------------------------ */

static void forget_values(kt_simulation *simulation) { simulation->events.time = (double)NAN; }

KT_ARENA_ARRAYS(lay_out_events, kt_events, KT_EVENT_FIELDS, size_t n)

static size_t measure_events(const kt_simulation_sizes *size) { return lay_out_events(NULL, NULL, size->event); }

static void init_events(kt_simulation *simulation, void *memory) {
    (void)lay_out_events(&simulation->events, memory, simulation->size.event);
}

const kt_part kt_event_part = {.measure = measure_events,
                               .init = init_events,
                               .is_active = has_events,
                               .rebind = forget_values,
                               .forget = forget_values,
                               .resume = forget_values,
                               .begin = begin_search_of_step,
                               .check = reject_event_step,
                               .accept = accept_events,
                               .fire = fire_all};
