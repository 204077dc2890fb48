/* Central differences of order eight and six from the same samples, with f_k = f(x + k h):
 *     d8 = sum_k w_k (f_k - f_-k) / h,   w = 4/5, -1/5, 4/105, -1/280
 *     d6 = sum_k w_k (f_k - f_-k) / h,   w = 3/4, -3/20, 1/60, 0
 * The error of d8 is h^8 / 630 times the ninth derivative. The error of d6, abs(d8 - d6), bounds the error of d8
 * wherever the differences converge. Rounding adds some eps / h of the values. Steps begin with KT_DIFFERENCE_STEP and
 * become shorter as long as the bound is too large. For example, friction that changes its sign over 1e-3 rad/s needs h
 * = 3e-5. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_DIFFERENCE_H
#define KT_DERIVATIVE_DIFFERENCE_H

#include <stddef.h>
#include <stdlib.h>

#define KT_DIFFERENCE_STEP 0.002    /* rad or m, and of their rates */
#define KT_DIFFERENCE_ROUNDING 64.0 /* eps of the largest value over h: the largest differences of constants */

enum { KT_DIFFERENCE_STEPS = 4 }; /* each an eighth of the one before */

/* w_k / h of order eight and six, for k from -4 to 4 without 0. */
static inline void kt_difference_weights(int k, double h, double *eight, double *six) {
    static const double of_eight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    static const double of_six[] = {3.0 / 4.0, -3.0 / 20.0, 1.0 / 60.0, 0.0};
    const int at = abs(k) - 1;
    *eight = (k < 0 ? -of_eight[at] : of_eight[at]) / h;
    *six = (k < 0 ? -of_six[at] : of_six[at]) / h;
}

/* n values at x + moved. *largest is raised to the size that their rounding is relative to. Returns 0, or an error. */
typedef int kt_difference_sample(void *user, double moved, double *values, double *largest);

/* A function of x, and room for n numbers each: a sample, and the differences of both orders. */
typedef struct kt_differenced {
    kt_difference_sample *sample;
    void *user;
    size_t n;
    double *values, *eight, *six;
} kt_differenced;

/* Writes the best differences to `best`, with steps from `step` on. *error is raised to the bound of their error,
 * relative to the largest difference; 0 if this error is of the size of rounding. Returns the error of a sample, or
 * 0. */
int kt_difference_find(const kt_differenced *of, double step, double *best, double *error);

#endif
