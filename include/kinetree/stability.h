/* Experimental. Linear stability of a method: its stability function R, the growth of modes, and the largest stable
 * step.
 *
 *     y' = lambda y,   y1 = R(h lambda) y0
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_STABILITY_H
#define KINETREE_STABILITY_H

#include "kinetree/method.h"

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* A complex number, re + i im. */
typedef struct kt_complex {
    double re, im; /* real and imaginary part */
} kt_complex;

/* The stability function R of a method: y' = lambda y gives y1 = R(h lambda) y0.
 *   Explicit: the polynomial R(z) = 1 + sum_k z^k b' A^(k-1) 1.
 *   Stabilised: R(z) = a + b T_s(w0 + w1 z).
 *   Implicit: a rational R = P / Q.
 *   Multistep: the n roots xi of the characteristic polynomial sum_i c_i(z) xi^(n-i). R is the principal root, which
 *     approximates e^z. The other roots are spurious.
 *
 * The struct has no pointers to own memory and may be copied.
 * Source: Hairer and Wanner, Solving ODE II, IV.2 and IV.3. */
typedef struct kt_stability {
    const kt_method_family *family;               /* of the method: selects one of these forms */
    int degree;                                   /* of R, or of P */
    double coefficient[KT_METHOD_STAGES_MAX + 1]; /* explicit: of z^0 .. z^degree; implicit: of P */
    int poles;                                    /* implicit: the degree of Q; 0 for others */
    double denominator[KT_METHOD_STAGES_MAX + 1]; /* implicit: of Q */
    double w0, w1, a, b;                          /* stabilised: P(z) = a + b T_s(w0 + w1 z) */
    int copies; /* stabilised: 1: R = P; 3: R = P(z) / 12 - 4 P(z/2)^2 / 3 + 9 P(z/3)^3 / 4 */
    int steps;  /* multistep: n; 0 for others */
    double characteristic[KT_METHOD_STEPS_MAX + 1][3]; /* multistep: of c_i(z), z^0 .. z^2 */
} kt_stability;

/* Computes the stability function of a method, which may be a caller's own table that kt_method_check has accepted.
 * `stages` is read for a stabilised method only: 2 to KT_STABILISED_STAGES_MAX.
 *
 * Errors: KT_ERROR_ARGUMENT (sizes, or stages, out of range).
 * Cost: O(s^3). */
KT_API KT_CHECKED kt_status kt_stability_make(const kt_method *method, int stages, kt_stability *stability,
                                              kt_error *error);

/* The number of stages that a stabilised method takes if `z` is the step times the largest |lambda|, including the
 * margin. For a tableau, the number of its stages. KT_STABILISED_STAGES_MAX + 1 if no allowed number is sufficient. */
KT_API int kt_stability_stages(const kt_method *method, double z);

/* The function kt_stability_value returns R(z). For a multistep method, this is the root nearest to e^z. The function
 * kt_stability_gain returns the growth of a mode in a step, |R(z)|. For a multistep method, this is the largest |xi|.
 * O(degree). */
KT_API kt_complex kt_stability_value(const kt_stability *stability, kt_complex z);
KT_API double kt_stability_gain(const kt_stability *stability, kt_complex z);

/* Evaluates |R| on a grid of columns x rows points, both 2 or more, from `low` (gain[0]) to `high`, row by row. Row i
 * has the imaginary part low.im + i (high.im - low.im) / (rows - 1). For contours: the boundary of stability is |R| =
 * 1. */
KT_API void kt_stability_grid(const kt_stability *stability, kt_complex low, kt_complex high, int columns, int rows,
                              double *gain);

/* The function kt_stability_real_limit returns the largest x for which |R| <= 1 on [-x, 0] of the real axis. The
 * function kt_stability_imaginary_limit returns the largest y for which |R| <= 1 on [-iy, iy] of the imaginary axis.
 * The function returns 0 if no such y exists (Euler, Heun, midpoint). Both limits are exact to a few roundings.
 * HUGE_VAL if an implicit method has no limit. */
KT_API double kt_stability_real_limit(const kt_stability *stability);
KT_API double kt_stability_imaginary_limit(const kt_stability *stability);

/* Verdicts of linear stability [MSD 5.3]. */
typedef struct kt_stability_verdict {
    bool a_stable;      /* for all steps, no mode that decays or oscillates in the exact solution grows: |R| <= 1 if
                           Re z <= 0 */
    bool l_stable;      /* A-stable, and an infinitely fast decay vanishes within a step: R goes to 0 */
    double at_infinity; /* |R| at infinity, the spectral radius there; HUGE_VAL of an explicit method */
} kt_stability_verdict;

/* Judges a method by its stability function, on the imaginary axis and to the left of it. The points have |z|
 * from 1e-4 to 1e6. The axis has 40 points per factor of ten. The verdicts hold to 1e-7.
 * Cost: 1,000 values of R, for an implicit method only. */
KT_API kt_stability_verdict kt_stability_assess(const kt_stability *stability);

/* The spurious growth of a mode: the factor, over a run of `duration`, by which a numerical solution of y' = lambda y
 * exceeds the exact solution. If the exact solution decays, the factor is relative to the initial value:
 *
 *     growth = (|R(h lambda)| / max(1, e^(h Re lambda)))^(duration / h)
 *
 * The factor is at most 1 if the method damps the mode. The factor also applies to an undamped mode, on the imaginary
 * axis. With a method that is unstable on this axis (Euler, Heun, midpoint), such a mode grows slowly, and the duration
 * of the run decides whether the growth is visible.
 *
 * If the exact solution grows, the mode is followed for at most the time 1 / Re lambda, in which it grows by e. The
 * motion is no longer linear after that time.
 *
 * R of an implicit method has poles in the half plane of growing modes. Near these poles the numerical solution grows
 * faster than the exact solution, which is an error of accuracy. Such a mode is replaced by the undamped mode of its
 * frequency, Re lambda = 0.
 *
 * HUGE_VAL if the factor cannot be computed. `step`, `duration` > 0. */
KT_API double kt_stability_growth(const kt_stability *stability, kt_complex lambda, double step, double duration);

/* The error of a mode after one of its periods, T = 2 pi / |Im lambda|: |R(h lambda)^(T / h) - e^(lambda T)|. The error
 * is relative to the amplitude at the start of the period and combines amplitude and phase. The error is at least 1
 * with fewer than two steps per period. Im lambda is not 0. */
KT_API double kt_stability_period_error(const kt_stability *stability, kt_complex lambda, double step);

/* The growth over a run that still counts as stable: a factor of 2. The limit of a damped mode hardly depends on this
 * factor, because a run has many steps. An undamped mode of Heun's method has a phase error above a radian before its
 * amplitude has doubled. */
#define KT_STABILITY_GROWTH 2.0

/* The largest step up to which kt_stability_growth stays within `growth` (> 1; KT_STABILITY_GROWTH) for every
 * eigenvalue. HUGE_VAL if no eigenvalue bounds the step, 0 if the method's sizes are out of range. *index (or NULL)
 * receives the eigenvalue that bounds the step, or -1. Rounding of an eigenvalue that is zero, or on the imaginary
 * axis, does not change the result. A stabilised method takes the stages that each step needs, as in a run. Its step
 * stays within the range that the largest number of stages covers. The result is accurate to 1e-12. Allocates nothing.
 * Cost: some hundred values of R for the fastest eigenvalue, fewer for the others. A stabilised method takes a thousand
 * values for each. */
KT_API double kt_stability_step(const kt_method *method, const kt_complex *eigenvalues, size_t count, double duration,
                                double growth, ptrdiff_t *index);

/* The growth (kt_stability_growth) of the eigenvalue that grows most with a step; 1 if there is none. *index is as for
 * kt_stability_step. HUGE_VAL if a stabilised method has too few stages for the step. O(count degree). */
KT_API double kt_stability_worst(const kt_method *method, const kt_complex *eigenvalues, size_t count, double step,
                                 double duration, ptrdiff_t *index);

#ifdef __cplusplus
}
#endif
#endif
