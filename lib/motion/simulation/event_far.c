/* Steps without an event, found without the slope at the end of the step.
 *
 * The dense output of an explicit method needs f1 = f(t1, y1). If the inputs change at t1, as in a control loop, the
 * next step needs another f at t1, so that f1 would serve only the search for events, and rk4 would evaluate five times
 * per step. The parabola of kt_integrator_sketch needs no evaluation. The parabola, whose slope at the end is f1',
 * deviates from the dense output by at most 4/27 h |f1 - f1'|, which is small against the path of the step if the step
 * resolves the motion.
 *
 * With g_0 .. g_4 the values along the parabola, an event is far if all values have the sign of the event's side, and
 *
 *     min |g_j| > far_ranges (max g_j - min g_j)
 *
 * Then g has no root, provided that its largest change along the motion is at most far_ranges times that along the
 * parabola. A contact that touches is never far if it penetrates, however slowly (kt_event_depth). If an event is not
 * far, all events are searched on the dense output (event.c). The test is for fixed steps: a fixed step resolves the
 * motion, while an adaptive one may be as long as a period. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "simulation/event_root.h"

static const double far_ranges = 2.0;

/* Samples g of all events along the parabola, and at its end. */
static bool sample_sketch(kt_simulation *simulation) {
    const kt_integrator *it = simulation->integrator;
    const double t0 = it->memory.previous_t, t1 = it->memory.t;
    const size_t n = simulation->size.event;
    kt_error error;
    for (int j = 1; j < KT_EVENT_SAMPLES; j++) {
        const double t = j + 1 < KT_EVENT_SAMPLES ? t0 + (t1 - t0) * j / (KT_EVENT_SAMPLES - 1) : t1;
        const double *y = t == t1 ? it->y : simulation->y;
        bool changed;
        if (t != t1 && (!kt_integrator_sketch(it, t, simulation->y) ||
                        kt_simulation_project(simulation, kt_simulation_closing_time(simulation, t), simulation->y,
                                              &changed, &error) != KT_OK))
            return false;
        if (kt_event_evaluate_all(simulation, t, y, simulation->events.value + (size_t)j * n, &error) != KT_OK)
            return false;
    }
    return true;
}

/* Whether event k is far along the whole step; *size: its largest |g|. */
static bool event_is_far(const kt_simulation *simulation, size_t k, double *size) {
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (size_t j = 0; j < KT_EVENT_SAMPLES; j++) {
        const double g = simulation->events.value[j * simulation->size.event + k];
        low = fmin(low, g);
        high = fmax(high, g);
    }
    *size = fmax(fabs(low), fabs(high));
    const int side = simulation->events.search[k].side;
    const bool is_deep = side < 0 && low < kt_event_depth(simulation, k);
    return side != 0 && kt_sign_of(low) == side && kt_sign_of(high) == side && !is_deep &&
           fmin(fabs(low), fabs(high)) > far_ranges * (high - low); /* false for infinite values */
}

bool kt_event_all_far(kt_simulation *simulation) {
    /* At a dead point of drives, accelerations have no bound, so that the parabola is not near the motion. */
    const bool may_have_dead_point = simulation->model->driven && simulation->closes_loops;
    if (!(simulation->step > 0.0) || may_have_dead_point)
        return false;
    bool far = sample_sketch(simulation);
    for (size_t k = 0; k < simulation->events.count && far; k++)
        if (kt_event_is_watched(simulation, k))
            far = event_is_far(simulation, k, &simulation->events.search[k].size);
    for (size_t k = 0; k < simulation->events.count && !far; k++) { /* as before this test */
        simulation->events.search[k].spent = 0;
        simulation->events.search[k].size = 0.0;
    }
    if (!far)
        simulation->cause.code = KT_OK;
    return far;
}
