/* Values beyond all reason. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/excess.h"

#include "open/linear.h"

#include "kinetree/mechanism.h"

#include <math.h>

static const char remedy[] =
    "the integration has blown up; take smaller steps, or an adaptive method, or find the force that drives the motion";

/* Returns the index of the first value beyond a limit; `count`: there is none. NaN is beyond every limit. */
static int find_beyond(const double *values, int count, double most) {
    for (int i = 0; i < count; i++)
        if (!(fabs(values[i]) <= most))
            return i;
    return count;
}

bool kt_find_excess(const kt_record *record, kt_error *error) {
    const int nv = kt_model_nv(record->model), states = record->x != NULL ? kt_auxiliary_state_count(record->model) : 0;
    const int v = find_beyond(record->v, nv, KT_SPEED_MOST), x = find_beyond(record->x, states, KT_STATE_MOST);
    if (v < nv)
        (void)kt_error_set(error, KT_ERROR_STEP, NULL,
                           "t = %.9g s: the speed of joint '%s' is %.3g m/s or rad/s, above that of light (%.9g): %s",
                           record->t, kt_name_column(record->model, v).text, fabs(record->v[v]), KT_SPEED_MOST, remedy);
    else if (x < states)
        (void)kt_error_set(error, KT_ERROR_STEP, NULL, "t = %.9g s: the state '%s' is %.3g, above %g: %s", record->t,
                           kt_auxiliary_state_name(record->model, x), record->x[x], KT_STATE_MOST, remedy);
    else
        return false;
    return true;
}

bool kt_find_lost_impulses(const kt_simulation *simulation, double time, kt_error *error) {
    const kt_contact_counts seen = kt_simulation_contacts(simulation);
    if (seen.completed == 0 || seen.failures == 0)
        return false;
    (void)kt_error_set(error, KT_ERROR_STEP, NULL,
                       "contacts at t = %.9g s: they change without end within a fixed step, and the time step that "
                       "should complete it has not found its impulses: the step is far too long for the motion; take "
                       "smaller steps, or an adaptive method",
                       time);
    return true;
}
