/* Linear multistep methods (multistep.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_MULTISTEP_H
#define KT_INTEGRATOR_MULTISTEP_H

#include "base/inner.h"
#include "integrator/integrator.h"

/* y1 = sum_i past_i y_(1-i) + h sum_j slopes_j f_(1-j); `predictor_j` of f_(1-j), of an explicit method. */
typedef struct kt_multistep {
    int steps;                            /* n */
    double past[KT_METHOD_STEPS_MAX + 1]; /* past_1 .. past_n at 1 .. n */
    double slopes[KT_METHOD_STEPS_MAX + 1];
    double predictor[KT_METHOD_STEPS_MAX + 1];
} kt_multistep;

KT_INNER kt_multistep kt_multistep_of(const kt_method *method);

/* For `check_sizes` of a family of multistep methods. */
kt_status kt_multistep_check_sizes(const kt_method *method, kt_error *error);

/* The conditions of order [MSD 5.7 .. 5.14] of a multistep method, and of its predictor. */
kt_status kt_multistep_check_order(const kt_method *method, kt_error *error);

/* Linear stability of these families. */
kt_status kt_multistep_stability(const kt_method *method, int stages, kt_stability *out, kt_error *error);
kt_complex kt_multistep_value(const kt_stability *stability, kt_complex z);
double kt_multistep_gain(const kt_stability *stability, kt_complex z);
double kt_multistep_real_limit(const kt_stability *stability);
double kt_multistep_imaginary_limit(const kt_stability *stability);

#endif
