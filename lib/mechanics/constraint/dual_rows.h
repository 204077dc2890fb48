/* The motion along which loops and effects are differentiated, and rates of loops by dual numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_DUAL_ROWS_H
#define KT_CONSTRAINT_DUAL_ROWS_H

#include "dynamics/dof.h"
#include "model/model.h"

/* A degree of freedom on the path to one end of a loop or an effect. The path begins at the link that carries both
 * ends. The motion is expressed about a point near to the ends. */
typedef struct kt_support_dof {
    kt_dof_motion motion;
    int32_t v;     /* index of the velocity coordinate */
    int32_t end;   /* 0 or 1 */
    int32_t first; /* index on the path of the first degree of freedom that it moves: the first of its node */
} kt_support_dof;

/* A motion whose poses are in data, and work memory. */
typedef struct kt_dual_motion {
    const kt_model *model;
    const kt_data *data;
    double t;
    const double *q, *v, *a;
    kt_support_dof *dof; /* nv */
    int32_t *chain;      /* links */
} kt_dual_motion;

/* Writes the derivative of A v - b' with respect to q (equations x nv) to c_q. */
void kt_dual_loop_rates(const kt_dual_motion *x, double *c_q);

#endif
