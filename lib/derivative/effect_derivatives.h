/* What effects add to the linearised equations of motion (effect_derivatives.c). */
#ifndef KT_DERIVATIVE_EFFECT_DERIVATIVES_H
#define KT_DERIVATIVE_EFFECT_DERIVATIVES_H

#include "dynamics/derivative.h"

/* A degree of freedom on the path from the link that carries both ends of an effect to one of them: S and psi', about
 * the point of the last end. */
typedef struct kt_effect_dof {
    kt_v4 s[2], psi[2];
    size_t v;      /* its coordinate */
    int32_t index; /* in the order of the links */
    int32_t first; /* the first of its node */
    int32_t end;
} kt_effect_dof;

/* Subtracts the derivatives of the joint forces of all effects but a caller's own from d_q and d_v (nv x nv). x: the
 * terms of the tree at this state, whose poses are in data; path: scratch for nv. */
void kt_effects_differentiate(const kt_model *model, const kt_data *data, const kt_derivative_work *x, double t,
                              const double *q, const double *v, kt_effect_dof *path, double *d_q, double *d_v);

#endif
