/* Rosenbrock methods of eight stages (rosenbrock.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_ROSENBROCK_H
#define KT_INTEGRATOR_ROSENBROCK_H

#include "integrator/integrator.h"

enum { KT_ROSENBROCK_STAGES = 8 };

/* The coefficients that a step computes with, in addition to the method's table. */
struct kt_rosenbrock {
    double a[KT_ROSENBROCK_STAGES][KT_ROSENBROCK_STAGES];        /* strictly lower */
    double coupling[KT_ROSENBROCK_STAGES][KT_ROSENBROCK_STAGES]; /* C, strictly lower */
    double m[KT_ROSENBROCK_STAGES];
    double gamma_sum[KT_ROSENBROCK_STAGES]; /* gamma_i = sum_j gamma_ij */
    double middle[KT_ROSENBROCK_STAGES];    /* y(1/2) = y0 + sum_i middle_i U_i */
    double end[KT_ROSENBROCK_STAGES];       /* h y'(1) = sum_i end_i U_i */
};

#endif
