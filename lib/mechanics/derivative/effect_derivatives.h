/* The contributions of effects to the linearised equations of motion (effect_derivatives.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_EFFECT_DERIVATIVES_H
#define KT_DERIVATIVE_EFFECT_DERIVATIVES_H

#include "dynamics/dynamics_derivative.h"

/* A degree of freedom on the path to one of the ends of an effect, from the link that carries both. S and psi' are
 * about the point of the last end. */
typedef struct kt_effect_dof {
    kt_v4 s[2], psi[2];
    size_t v;      /* index of the velocity coordinate */
    int32_t index; /* in the order of the links */
    int32_t first; /* the first of its node */
    int32_t end;
} kt_effect_dof;

/* The contributions of auxiliary states to linearised equations, in arrays of the caller. F are the joint forces of
 * effects, and x' = f the rates of the states. */
typedef struct kt_state_derivatives {
    double *force;  /* -dF/dx, nv x states; its reduction or solution if the equations are reduced or solved */
    double *rate_q; /* -df/dq, states x nv */
    double *rate_v; /* -df/dv, states x nv */
    double *rate_x; /* -df/dx, states x states */
} kt_state_derivatives;

/* Subtracts the derivatives of the joint forces of all effects that have them (kt_effect_is_differenced) from x->dq and
 * x->dv (nv x nv). With auxiliary states, also writes the derivatives by these states and of their rates.
 *
 * x: the terms of the tree at this state, whose poses are in data.
 *
 * path: scratch for kt_effect_path_size.
 *
 * Errors: of a caller's own effects KT_ERROR_EFFECT, KT_ERROR_CALLBACK, KT_ERROR_NOT_FINITE. */
KT_CHECKED kt_status kt_effects_differentiate(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                              const kt_derivative_work *x, kt_effect_dof *path,
                                              const kt_state_derivatives *states, kt_error *error);

/* Returns the most degrees of freedom between the ends of one effect. If each end alone moves the wrenches, the paths
 * from both ends to the ground count, and the paths of all links of the effect's path. If formulas have variables, the
 * path of one variable is added. */
static inline size_t kt_effect_path_size(const kt_model *model) {
    size_t count = model->n.variable ? 2 : 1;
    for (size_t i = 0; i < model->n.batch; i++)
        if (model->batch[i].type == KT_EFFECT_CUSTOM)
            count = 2;
    for (size_t i = 0; i < model->n.effect; i++) {
        const size_t links = (size_t)model->effect[i].path_link_count + 1;
        count = links > count ? links : count;
    }
    return count * model->n.v;
}

#endif
