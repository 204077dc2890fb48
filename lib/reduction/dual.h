/* What closes and pushes a mechanism, differentiated: its own part of kt_acceleration_derivatives (derivative.c). */
#ifndef KT_REDUCTION_DUAL_H
#define KT_REDUCTION_DUAL_H

#include "dynamics/dof.h"

/* A freedom on the way from what carries both ends of a loop to one of them, or of an effect, told from a point near to
 * them. */
typedef struct kt_support_dof {
    kt_dof_motion motion;
    int32_t v;     /* its coordinate */
    int32_t end;   /* 0 or 1 */
    int32_t first; /* among those of the way: the first that it moves, with it: of its node */
} kt_support_dof;

/* A motion whose poses are in data, and what to work in. */
typedef struct kt_dual_motion {
    const kt_model *model;
    const kt_data *data;
    double t;
    const double *q, *v, *a;
    kt_support_dof *dof; /* nv */
    int32_t *chain;      /* links */
} kt_dual_motion;

/* Loops, with multipliers lambda of all equations: takes d(A' lambda)/dq off d_q (nv x nv), and writes the derivatives
 * of b'' - A a by q and v (equations x nv). */
void kt_dual_loops(const kt_dual_motion *x, const double *lambda, double *d_q, double *e_q, double *e_v);

/* Effects, but a caller's own: takes the derivatives of their joint forces off d_q and d_v. */
void kt_dual_effects(const kt_dual_motion *x, double *d_q, double *d_v);

#endif
