/* The times of records: their number, their times, and which are still to come. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "simulation/simulation.h"

#include <float.h>
#include <math.h>

/* The number of intervals, of which the last may be shorter. Duration, interval and quotient each have an error of up
 * to half an ulp. Therefore a quotient within 2 eps of a whole number (relative) counts as whole. */
double kt_record_intervals(double duration, double interval) {
    if (!(duration > 0.0))
        return 0.0;
    double count = duration / interval;
    double whole = round(count);
    if (whole >= 1.0 && fabs(count - whole) <= 2.0 * DBL_EPSILON * count)
        return whole;
    return ceil(count);
}

double kt_simulation_record_time(const kt_simulation *simulation, int64_t k) {
    return k == simulation->records.count - 1 ? simulation->duration : (double)k * simulation->records.interval;
}

int64_t kt_simulation_record_count(const kt_simulation *simulation) {
    return simulation ? simulation->records.count : 0;
}

void kt_simulation_skip_records(kt_simulation *simulation) {
    double t = kt_integrator_time(simulation->integrator);
    int64_t last = simulation->records.count - 1;
    int64_t k = simulation->memory.next_record;
    if (k > last || kt_simulation_record_time(simulation, k) >= t)
        return;
    /* Division gives an estimate of the number, and comparisons then find it. */
    double guess = simulation->records.interval > 0.0 ? floor(t / simulation->records.interval) - 1.0 : 0.0;
    if (guess > (double)last)
        guess = (double)last;
    if (guess > (double)k)
        k = (int64_t)guess;
    while (k <= last && kt_simulation_record_time(simulation, k) < t)
        k++;
    simulation->memory.next_record = k;
}
