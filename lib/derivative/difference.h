/* Central differences of order eight and six of the same samples: with f_k = f(x + k h)
 *     d8 = sum_k w_k (f_k - f_-k) / h,   w = 4/5, -1/5, 4/105, -1/280
 *     d6 = sum_k w_k (f_k - f_-k) / h,   w = 3/4, -3/20, 1/60, 0
 * The error of d8 is h^8 / 630 times the ninth derivative. The error of d6, |d8 - d6|, is a bound of it wherever the
 * differences converge at all. Rounding adds some eps / h of the values. Steps begin with KT_DIFFERENCE_STEP and become
 * shorter as long as the bound is too large. For example, friction that changes its sign over 1e-3 rad/s needs
 * h = 3e-5. */
#ifndef KT_DERIVATIVE_DIFFERENCE_H
#define KT_DERIVATIVE_DIFFERENCE_H

#include <stddef.h>

#define KT_DIFFERENCE_STEP 0.002 /* rad or m, and of their rates */

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
 * relative to the largest of them; 0 if that is rounding. Returns the error of a sample, or 0. */
int kt_difference_find(const kt_differenced *of, double step, double *best, double *error);

#endif
