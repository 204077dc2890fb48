/* Fits to the points of a study: orders, error floors, and the Pareto fronts.
 *
 * In the asymptotic range error = C setting^p, a straight line of slope p in logarithms, fitted by least squares. The
 * range ends at large errors that are not small compared with the motion, and at small errors at which rounding or the
 * reference's uncertainty becomes visible. The fit uses the finest points of the range.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/accuracy.h"

#include <math.h>

static const double asymptotic = 1e-2; /* of the amplitude: largest error in the asymptotic range */
static const double clear = 10.0;      /* times floor or uncertainty: larger errors are essentially those of the
                                          method */
static const double spread_most = 0.2; /* of the slope: points that scatter more have no slope */
enum { FIT_LEAST = 3, FIT_MOST = 5 };

double kt_accuracy_amplitude(const kt_accuracy *study) {
    const double range = study->results.range;
    if (!(range > 0.0))
        return 1.0;
    return study->results.subject == KT_ACCURACY_POSITIONS ? fmin(range, 1.0) : range;
}

void kt_accuracy_select(const kt_accuracy *study, kt_accuracy_error *error) {
    switch (study->results.subject) {
    case KT_ACCURACY_VELOCITIES:
        error->judged = error->velocity;
        break;
    case KT_ACCURACY_QUANTITY:
        error->judged = error->quantity;
        break;
    default:
        error->judged = error->position;
        break;
    }
}

bool kt_accuracy_is_held(const kt_accuracy_curve *curve, const kt_accuracy_point *loose,
                         const kt_accuracy_point *tight) {
    if (!curve->adaptive || loose->counts.steps == 0)
        return false;
    const double expected = log(loose->setting / tight->setting) / curve->method->order;
    return log((double)tight->counts.steps / (double)loose->counts.steps) < 0.2 * expected;
}

static double curve_floor_of(const kt_accuracy *study, const kt_accuracy_curve *curve) {
    const kt_accuracy_point *points = study->points + curve->first;
    double least = HUGE_VAL;
    for (int i = 0; i < curve->count; i++)
        least = points[i].usable ? fmin(least, points[i].error.judged) : least;
    return least;
}

/* The least squares line through n points, from their sums. */
typedef struct kt_line_sums {
    double n, x, y, xx, xy, yy;
    double least, most; /* of x */
} kt_line_sums;

static void add_to_line(kt_line_sums *s, double x, double y) {
    s->least = s->n > 0.0 ? fmin(s->least, x) : x;
    s->most = s->n > 0.0 ? fmax(s->most, x) : x;
    s->n += 1.0;
    s->x += x;
    s->y += y;
    s->xx += x * x;
    s->xy += x * y;
    s->yy += y * y;
}

/* Sets slope, spread and fitted, if enough points lie near a line. */
static void fit_line(const kt_line_sums *s, double range, kt_accuracy_curve *curve) {
    curve->fitted = 0;
    curve->slope = curve->slope_spread = (double)NAN;
    if (s->n < FIT_LEAST || s->most - s->least < range)
        return;
    const double sxx = s->xx - s->x * s->x / s->n, sxy = s->xy - s->x * s->y / s->n, syy = s->yy - s->y * s->y / s->n;
    const double slope = sxy / sxx, rest = fmax(syy - slope * sxy, 0.0);
    const double spread = sqrt(rest / (s->n - 2.0) / sxx);
    if (spread > spread_most * fabs(slope))
        return;
    curve->slope = slope;
    curve->slope_spread = spread;
    curve->fitted = (int)s->n;
}

void kt_accuracy_fit(const kt_accuracy *study, kt_accuracy_curve *curve) {
    const kt_accuracy_point *points = study->points + curve->first;
    const double amplitude = kt_accuracy_amplitude(study);
    const bool ended = curve->end == KT_ACCURACY_FLOOR;
    const int most = curve->adaptive ? KT_ACCURACY_POINTS_MAX : FIT_MOST;
    double least = clear * study->results.uncertainty.judged;
    kt_line_sums sums = {0};
    curve->floor = ended ? curve_floor_of(study, curve) : (double)NAN;
    if (ended)
        least = fmax(least, clear * curve->floor);
    for (int i = curve->count - 1; i >= 0 && sums.n < most; i--) {
        if (!points[i].usable || points[i].error.judged <= least || points[i].error.judged > asymptotic * amplitude)
            continue;
        if (i + 1 < curve->count && kt_accuracy_is_held(curve, &points[i], &points[i + 1]))
            continue;
        add_to_line(&sums, log(points[i].setting), log(points[i].error.judged));
    }
    fit_line(&sums, log(curve->adaptive ? 30.0 : 3.5), curve);
}

/* ---- fronts ------------------------------------------------------------------------------------------------------ */

static double cost(const kt_accuracy_point *point, bool of_time) {
    return of_time ? point->cpu : (double)point->counts.evaluations;
}

/* Whether no point of variant 0 has a smaller error at no higher cost, or a lower cost with no larger error. */
static bool is_on_front(const kt_accuracy *study, const kt_accuracy_point *point, bool of_time) {
    const double error = kt_accuracy_known(study, point), price = cost(point, of_time);
    for (int c = 0; c < study->results.curve_count; c++) {
        const kt_accuracy_curve *curve = &study->curves[c];
        for (int i = 0; i < curve->count && curve->variant == 0; i++) {
            const kt_accuracy_point *other = &study->points[curve->first + i];
            const double its_error = kt_accuracy_known(study, other), its_price = cost(other, of_time);
            if (other->usable && its_error <= error && its_price <= price && (its_error < error || its_price < price))
                return false;
        }
    }
    return true;
}

void kt_accuracy_mark_front(kt_accuracy *study) {
    for (int c = 0; c < study->results.curve_count; c++) {
        const kt_accuracy_curve *curve = &study->curves[c];
        for (int i = 0; i < curve->count; i++) {
            kt_accuracy_point *point = &study->points[curve->first + i];
            point->fewest = point->usable && curve->variant == 0 && is_on_front(study, point, false);
            point->cheapest =
                point->usable && curve->variant == 0 && !isnan(point->cpu) && is_on_front(study, point, true);
        }
    }
}

/* From the tightest setting on, as long as the goal is reached. Coarse clocks of other engines may measure equal costs.
 * The loosest of these settings is then the best. */
int kt_accuracy_best_of(const kt_accuracy *study, const kt_accuracy_point *points, int count, double goal) {
    int best = -1;
    if (!study || !points)
        return -1;
    const bool timed = study->options.clock != NULL;
    for (int i = count - 1; i >= 0; i--) {
        if (points[i].status != KT_OK)
            continue;
        if (!points[i].usable || !(kt_accuracy_known(study, &points[i]) <= goal))
            break;
        if (best < 0 || cost(&points[i], timed) <= cost(&points[best], timed))
            best = i;
    }
    return best;
}

int kt_accuracy_best(const kt_accuracy *study, double goal) {
    if (!study)
        return -1;
    int best = -1;
    const bool timed = study->options.clock != NULL;
    for (int c = 0; c < study->results.curve_count; c++) {
        const kt_accuracy_curve *curve = &study->curves[c];
        const kt_accuracy_point *points = study->points + curve->first;
        const int found = curve->variant == 0 ? kt_accuracy_best_of(study, points, curve->count, goal) : -1;
        if (found >= 0 && (best < 0 || cost(&points[found], timed) < cost(&study->points[best], timed)))
            best = curve->first + found;
    }
    return best;
}
