/* The time in which the mechanism moves by its own size. All thresholds of times and rates are parts of this time.
 *
 * Let x be the motion of every joint by its unit, 1 rad or the mechanism's length. In the metric of the masses, with
 * the accelerations a of the mechanism without contacts, and with its velocities v,
 *
 *     T = min(sqrt(|x| / |a|), |x| / |v|),    |x|^2 = x'M x
 *
 * T follows the units of time, and depends neither on those of length nor on a factor of all masses. A rate is rest if
 * the mechanism moves by less than a part `kt_slip_rest` of its size within T. Without forces and velocities nothing
 * moves, and T counts as unknown: only zero rates are rest. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"

#include "base/copy.h"
#include "model/switching.h"

#include <math.h>

kt_status kt_contacts_find_own_time(kt_simulation *simulation, const kt_model *open, const double *q, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    double square;
    const kt_status status = kt_contacts_find_unit(simulation, open, q, &square, error);
    if (status != KT_OK)
        return status;
    const double size = sqrt(square), time = fmin(sqrt(size / c->change), size / c->speed);
    simulation->memory.own_time = isfinite(time) ? time : 0.0;
    return KT_OK;
}
