/* Regions of stability: |R(z)|, and the point at which a ray from 0 leaves a region. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

#include "kinetree/algebra.h"

#include <math.h>

kt_complex kt_stability_value(const kt_stability *s, kt_complex z) {
    if (!s)
        return (kt_complex){(double)NAN, (double)NAN};
    return s->family->value(s, z);
}

double kt_stability_gain(const kt_stability *s, kt_complex z) {
    if (!s)
        return (double)NAN;
    if (s->family->gain != NULL)
        return s->family->gain(s, z);
    const kt_complex value = kt_stability_value(s, z);
    return kt_hypot(value.re, value.im);
}

/* Tests the points x_k = (k / GRAIN)^2: R varies over lengths of order 1, and with many stages over lengths that grow
 * as sqrt(x). The boundary between the last point inside and the first outside is bisected to rounding. HUGE_VAL: none
 * up to `most`. */
enum { GRAIN = 64, HALVINGS = 60 };

double kt_first_exit(kt_is_inside *inside, const void *problem, double most) {
    double low = 0.0, high = 0.0;
    for (int k = 1;; k++) {
        high = (double)k * (double)k / (double)(GRAIN * GRAIN);
        high = high < most ? high : most;
        if (!inside(problem, high))
            break;
        if (high >= most)
            return HUGE_VAL;
        low = high;
    }
    for (int i = 0; i < HALVINGS && low < high; i++) {
        const double middle = 0.5 * (low + high);
        if (middle <= low || middle >= high)
            break;
        if (inside(problem, middle))
            low = middle;
        else
            high = middle;
    }
    return low;
}

/* A direction from 0. */
typedef struct axis {
    const kt_stability *stability;
    double re, im, least, rounding;
} axis;

/* kt_is_inside of |R| <= 1 + rounding at the distance x along the direction. */
static bool axis_is_inside(const void *problem, double x) {
    const axis *a = problem;
    x = fmax(x, a->least);
    return kt_stability_gain(a->stability, (kt_complex){a->re * x, a->im * x}) <= 1.0 + a->rounding;
}

double kt_axis_limit(const kt_stability *s, double re, double im, double least, double rounding) {
    return kt_first_exit(axis_is_inside, &(axis){s, re, im, least, rounding}, kt_farthest_stable(s));
}
