/* The value of one event's function, and its first root in a panel of a step (event_root.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SIMULATION_EVENT_ROOT_H
#define KT_SIMULATION_EVENT_ROOT_H

#include "algebra/elementary.h"
#include "simulation/simulation.h"

#include <math.h>

/* Samples of a panel. The last row of values belongs to the beginning of the step. */
enum { KT_EVENT_SAMPLES = KT_EVENT_VALUES - 1 };

/* Values that the search of a panel takes in any case: of its samples, and of a root. */
enum { KT_EVENT_ROOT_STEPS = 128, KT_EVENT_AT_LEAST = KT_EVENT_SAMPLES - 1 + KT_EVENT_ROOT_STEPS };

/* Roots as near as rounding of the time, or of positions, hides are one instant. */
KT_INLINE double kt_event_together(const kt_simulation *simulation, double t) {
    return fmax(kt_simulation_instant(simulation), kt_time_together(t));
}

/* The size to which rounding of times in a step is relative. A step from t = 0 would shrink without end towards a root
 * at t = 0. Therefore a rounding of the end of the step's first try bounds the step from below: within this rounding,
 * no state changes. */
double kt_event_extent_of_times(const kt_simulation *simulation, double t);

/* The width to which a root is enclosed, s. */
double kt_event_least_width(const kt_simulation *simulation, double t);

/* Whether event k is searched: the event is armed, and its limit is not reached. */
bool kt_event_is_watched(const kt_simulation *simulation, size_t k);

/* Evaluates g of event k, or of all watched events, in the state y. */
KT_CHECKED kt_status kt_event_evaluate(kt_simulation *simulation, size_t k, double t, const double *y, double *value,
                                       kt_error *error);
KT_CHECKED kt_status kt_event_evaluate_all(kt_simulation *simulation, double t, const double *y, double *values,
                                           kt_error *error);

/* The error of a caller's function or action, `what`, that returned the code. */
kt_status kt_event_fail(const kt_event *event, const char *what, double t, const kt_error *from, int code,
                        kt_error *error);

/* The value below which event k of a contact that touches is due: it penetrates, however slowly. -HUGE_VAL for other
 * events. A step that begins deeper may go deeper by half of this margin. */
double kt_event_depth(const kt_simulation *simulation, size_t k);

/* Finds the first root of event k in a panel in its direction, and the side behind the root. `times` are the times of
 * the samples, whose values are in simulation->events.value. HUGE_VAL: no root, and the side of g does not change. */
KT_CHECKED kt_status kt_event_find_root(kt_simulation *simulation, size_t k, const double *times, double *root,
                                        int *side, kt_error *error);

/* Whether no event has a root in the last step, judged from samples that need no evaluation of the slope. `false` means
 * that the search decides. The values at the beginning of the step are known, and no other sample was evaluated before
 * (event_far.c). */
bool kt_event_all_far(kt_simulation *simulation);

#endif
