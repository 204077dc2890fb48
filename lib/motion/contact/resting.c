/* The model of small motions about the present state: all contacts at rest are closed.
 *
 * If reactions are not unique (four legs of a table), a simulation leaves redundant contacts open, although they touch.
 * A contact rests if it touches and its gap has neither a rate nor an acceleration. Its friction rests if it does not
 * slip.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "contact/contact.h"
#include "dynamics/dynamics.h"
#include "integrator/integrator.h"

#include <math.h>

/* Whether contact k rests. a: accelerations; those without contacts are in c->a. */
static bool is_resting(const kt_simulation *simulation, int k, const double *a) {
    const struct kt_contacts *c = simulation->contacts;
    double size, unused;
    if (kt_contact_is_released(&c->item[k]) || !kt_contact_touches(simulation, k, kt_contact_depth(&c->item[k])) ||
        !(fabs(kt_contacts_rate(c, k, 0, c->v)) <= kt_contact_resting(simulation, k)))
        return false;
    (void)kt_contacts_residual(c, k, 0, c->a, c->drift, &size);
    return fabs(kt_contacts_residual(c, k, 0, a, c->drift, &unused)) <= kt_contact_grazing * size;
}

/* Whether friction k of a contact that rests does not slip. */
static bool is_sticking(const struct kt_contacts *c, int k) {
    return kt_hypot(kt_contacts_rate(c, k, 0, c->v), kt_contacts_rate(c, k, 1, c->v)) <= c->rest_rate[k];
}

const kt_model *kt_contacts_resting_model(kt_simulation *simulation, const double *a) {
    struct kt_contacts *c = simulation->contacts;
    const kt_model *present = simulation->model, *model = present;
    const double t = kt_integrator_time(simulation->integrator), *y = kt_integrator_state(simulation->integrator);
    bool any = false;
    kt_copy(c->v, y + simulation->size.nq, simulation->size.nv * sizeof *c->v);
    const kt_status status = kt_contacts_find_free(simulation, t, y, NULL);
    for (int k = 0; k < c->n; k++)
        if (kt_contact_is_closed(present, &c->item[k]))
            c->item[k].next = KT_CONTACT_ON;
    for (int k = 0; status == KT_OK && k < c->sides; k++) {
        const int of = c->item[k].of;
        if (c->item[k].next == KT_CONTACT_ON || !is_resting(simulation, k, a))
            continue;
        any = true;
        c->item[k].next = KT_CONTACT_ON;
        if (of >= 0 && is_sticking(c, of))
            c->item[of].next = KT_CONTACT_ON;
    }
    if (any)
        model = kt_contacts_model(simulation, true);
    kt_data_rebind(present, simulation->data);
    kt_contacts_put_directions(simulation);
    simulation->cached = KT_CACHED_NOTHING;
    simulation->contact_time = (double)NAN;
    return model;
}
