/* Linear systems and modes of test mechanisms, with calls that must succeed. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ANALYSIS_SMALL_H
#define KT_TEST_ANALYSIS_SMALL_H

#include "fixture.h"

/* A model, linearised about a state. */
typedef struct small {
    const kt_model *model;
    kt_linearization *linearization;
    kt_modes *modes;
    const kt_linear_system *system;
} small;

/* Linearises about (t, q, v), with modes. The running test owns them, and a failure ends it. */
void small_open(small *s, const kt_model *model, const kt_linearization_options *options, double t, const double *q,
                const double *v, const double *tau);

/* Number i, j of a matrix by columns. */
double small_at(const double *matrix, int rows, int i, int j);

/* The mode nearest to lambda; the distance in *distance. */
kt_mode small_nearest(const small *s, double real, double imaginary, double *distance);

/* Holds the mode nearest to lambda against it. */
void small_expect(const small *s, double real, double imaginary, double bound, kt_worst *worst);

#endif
