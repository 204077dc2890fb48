/* The time in which the mechanism moves by its own size. All thresholds of times and rates are parts of this time.
 *
 * Let x be the motion of every joint by its unit, 1 rad or the mechanism's length. Let a be the accelerations of the
 * mechanism without contacts. The items are gaps, slip, and rates of joints with dry friction. Let u be the rate of an
 * item, and l its unit. Then
 *
 *     T = min(sqrt(|x| / |a|), l / |u|),    |x|^2 = x'M x,    over all items
 *
 * T follows the units of time, and depends neither on those of length nor on a factor of all masses. All rates u are
 * relative to the other body. Therefore T is equal in all frames that move at a constant velocity, which the speeds of
 * the joints are not. A rate is rest if the mechanism moves by less than a part `kt_slip_rest` of its size within T.
 * Without forces and rates nothing moves, and T counts as unknown: only zero rates are rest.
 *
 * Rounding of a time t changes rates by accelerations: by about |a| / |x| of their unit times the distance of roots
 * that are one instant (kt_time_together). This error does not grow with the rates, as 1 / T^2 does. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"

#include "base/copy.h"
#include "integrator/integrator.h"
#include "model/switching.h"

#include <math.h>

/* The largest rate of an item, in units per s. The two rates of slip are those of one item. */
static double fastest_item(const struct kt_contacts *c) {
    double most = 0.0;
    for (int k = 0; k < c->n; k++) {
        const double u = kt_contacts_rate(c, k, 0, c->v),
                     across = kt_contact_rubs(c, k) ? kt_contacts_rate(c, k, 1, c->v) : 0.0;
        if (!kt_contact_is_released(&c->item[k]))
            most = fmax(most, kt_hypot(u, across) / c->item[k].unit);
    }
    return most;
}

kt_status kt_contacts_find_speed(kt_simulation *simulation, const kt_model *open, const double *q, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    c->fastest = fastest_item(c);
    return kt_contacts_find_norm(simulation, open, q, c->v, &c->speed, error);
}

kt_status kt_contacts_find_own_time(kt_simulation *simulation, const kt_model *open, const double *q, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    kt_simulation_memory *memory = &simulation->memory;
    double norm;
    const kt_status status = kt_contacts_find_unit(simulation, open, q, &norm, error);
    if (status != KT_OK)
        return status;
    const double time = fmin(sqrt(norm / c->change), 1.0 / c->fastest);
    const double rounding = kt_time_together(kt_integrator_time(simulation->integrator));
    memory->own_time = isfinite(time) ? time : 0.0;
    memory->slip_noise = norm > 0.0 ? rounding * c->all->length * c->change / norm : 0.0;
    return KT_OK;
}
