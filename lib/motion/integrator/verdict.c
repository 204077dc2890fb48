/* Verdicts of linear stability [MSD 5.3.1, 5.3.2]. A method is A-stable if no mode grows that decays or oscillates in
 * the exact solution, for any step size. An A-stable method is L-stable if an infinitely fast decay is gone after one
 * step.
 *
 * The largest |R| of the left half plane is on the imaginary axis, unless R has a pole on the left (the maximum
 * principle). For a multistep method this holds for the largest root. Both are tested at points: the axis, and arcs in
 * the left half plane. A pole would be detected at nearby points of the arcs.
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, sections IV.3 and V.1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

#include <math.h>

/* Points per factor of ten of |z|, the least and largest exponent of ten, and the number of directions from the
 * imaginary to the real axis. */
enum { GRAIN = 40, LEAST = -4, MOST = 6, DIRECTIONS = 8 };

/* A growth in a step below this bound counts as rounding. The bound is the square root of eps: a double root turns an
 * error of eps into an error of this size. */
#define ROUNDING 1e-7

/* The |z| that represents infinity: the remainder, 1 / z or its square root, is below ROUNDING. */
#define FAR 1e100

static bool is_inside(const kt_stability *s, double re, double im) {
    return kt_stability_gain(s, (kt_complex){re, im}) <= 1.0 + ROUNDING;
}

/* Whether the left half plane lies in the region of stability, tested on the imaginary axis and on rays. */
static bool left_half_is_inside(const kt_stability *s) {
    const double quarter = acos(0.0);
    for (int k = LEAST * GRAIN; k <= MOST * GRAIN; k++) {
        const double size = pow(10.0, (double)k / GRAIN);
        if (!is_inside(s, 0.0, size))
            return false;
        for (int i = 1; i <= DIRECTIONS && k % 4 == 0; i++) {
            const double angle = quarter * (1.0 + (double)i / DIRECTIONS);
            if (!is_inside(s, size * cos(angle), size * sin(angle)))
                return false;
        }
    }
    return true;
}

kt_stability_verdict kt_stability_assess(const kt_stability *s) {
    if (!s)
        return (kt_stability_verdict){false, false, (double)NAN};
    if (s->poles == 0) /* a polynomial, or roots of polynomials in z: it grows without bound */
        return (kt_stability_verdict){.at_infinity = HUGE_VAL};
    const double far = kt_stability_gain(s, (kt_complex){-FAR, 0.0});
    kt_stability_verdict verdict = {.a_stable = left_half_is_inside(s), .at_infinity = far <= ROUNDING ? 0.0 : far};
    verdict.l_stable = verdict.a_stable && verdict.at_infinity == 0.0;
    return verdict;
}
