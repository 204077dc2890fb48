/* Impacts that accumulate: their instants have a limit, and the speeds of the contacts need not vanish there.
 *
 * A point in a wedge of a stop and a floor strikes one of them and then the other, ever faster. Each pair of impacts
 * leaves a part of the speed and a smaller part of the gap. At the limit of the instants both gaps are closed, but the
 * speed may be far from zero: hundreds of impacts remain, which no time separates. An impulse on both contacts at once
 * is another law, and may throw the point out of the wedge. So the impacts continue one by one.
 *
 * Behind the last instant that events resolve, all remaining impacts lie within the time `window`, a small part of the
 * chain's time or a rounding of the time (simulation/event_chain.c). The configuration does not change within it. J and
 * W are frozen, and each gap that does not touch is
 *
 *     g + u s
 *
 * since accelerations hardly change speeds above those of rest within this time.
 *
 * The next impact is that of the gap which closes first. It obeys the law of impact.c with the rows whose gaps are
 * zero. Gaps shrink faster than speeds, and would underflow: gaps, the window and times are then all measured in a unit
 * smaller by `unit`. The chain ends when no gap closes within the window: all contacts rest, since an impact slower
 * than the rest velocity has no bounce, or the bodies part. Gaps are numbers of their own: rounding of positions
 * does not hide their order. Tolerances do not end a bounce here, since no step follows it.
 *
 * If impacts reach a limit first, what still closes comes to rest. The speed that this drops is reported
 * (kt_contact_counts.dropped). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "contact/contact.h"
#include "integrator/integrator.h"
#include "kinetree/loop.h"

#include <math.h>

enum { IMPACTS = 100000 };
static const double tiny = 0x1p-600, unit = 0x1p-500;

/* The rate of the gap of item k; 0 if it is rounding. */
static double rate_of_gap(const struct kt_contacts *c, int k) {
    double size;
    const double rate = kt_contacts_residual(c, k, 0, c->v, c->rate, &size);
    return fabs(rate) <= kt_contact_rounding * size ? 0.0 : rate;
}

/* The time until the gap of item k closes. */
static double time_to_impact(const struct kt_contacts *c, int k) {
    const double u = rate_of_gap(c, k);
    return u < 0.0 ? c->gap[k] / -u : HUGE_VAL;
}

/* Contacts that are closed, or close at this instant, have no gap. */
static void clear_gaps(const kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    for (int k = 0; k < c->sides; k++)
        if (c->item[k].meets || kt_contact_is_closed(simulation->model, &c->item[k]))
            c->gap[k] = 0.0;
}

/* Lets contacts fly that part, or that do not touch. Contacts that touch and rest stay. */
static void begin_flights(struct kt_contacts *c) {
    for (int k = 0; k < c->sides; k++)
        c->item[k].flies =
            !c->item[k].spared && !kt_contact_is_released(&c->item[k]) && (c->gap[k] > 0.0 || rate_of_gap(c, k) > 0.0);
}

/* Moves all gaps up to the next impact. Returns its time, or HUGE_VAL if none follows within the rest of the window. */
static double fly_to_impact(struct kt_contacts *c, double most) {
    double s = HUGE_VAL;
    int first = -1;
    for (int k = 0; k < c->sides; k++) {
        const double time = c->item[k].flies ? time_to_impact(c, k) : HUGE_VAL;
        first = time < s ? k : first;
        s = fmin(s, time);
    }
    if (!(s <= most) || first < 0)
        return HUGE_VAL;
    for (int k = 0; k < c->sides; k++)
        if (c->item[k].flies)
            c->gap[k] = fmax(c->gap[k] + s * rate_of_gap(c, k), 0.0);
    c->gap[first] = 0.0;
    c->item[first].flies = false;
    c->item[first].meets = true;
    return s;
}

/* Measures times and gaps in a smaller unit, in which speeds are as before. */
static void take_smaller_unit(struct kt_contacts *c) {
    for (int k = 0; k < c->sides; k++)
        c->gap[k] /= unit;
    c->window /= unit;
}

/* The rows that touch, their W and their rates. *approach: the largest speed at which one of them closes, in its
 * units per s. */
static kt_status find_struck(kt_simulation *simulation, const kt_model *open, double t, double *approach,
                             kt_error *error) {
    const double *q = kt_integrator_state(simulation->integrator);
    kt_contacts_list_rows(simulation);
    kt_status status = kt_contacts_find_response(simulation, open, t, q, error);
    if (status == KT_OK)
        status = kt_contacts_find_speed(simulation, open, q, error);
    *approach = status == KT_OK ? kt_contacts_find_rates(simulation) : 0.0;
    return status;
}

kt_status kt_contacts_accumulate(kt_simulation *simulation, const kt_model *open, double t, double *lost,
                                 kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    double flight = 0.0, approach = 0.0;
    kt_status status = KT_OK;
    int n = 0;
    clear_gaps(simulation);
    for (; status == KT_OK && flight <= c->window && n < IMPACTS; n++) {
        begin_flights(c);
        status = find_struck(simulation, open, t, &approach, error);
        if (status == KT_OK && approach > 0.0)
            status = kt_contacts_check_levers(simulation, open, t, error);
        if (status == KT_OK && approach > 0.0)
            status = kt_contacts_apply_impact(simulation, t, lost, error);
        begin_flights(c);
        c->window -= fmin(flight, c->window);
        flight = fly_to_impact(c, c->window);
        if (flight > 0.0 && flight < tiny) {
            take_smaller_unit(c);
            flight /= unit;
        }
    }
    for (int k = 0; k < c->sides; k++)
        c->item[k].flies = false;
    c->rests = n == IMPACTS;
    if (status == KT_OK)
        status = find_struck(simulation, open, t, &approach, error);
    if (c->rests)
        simulation->memory.contacts.dropped = fmax(simulation->memory.contacts.dropped, approach * c->all->length);
    return status;
}
