/* The degrees of freedom that move the ends of effects, and the columns of derivatives for each of these degrees of
 * freedom (effect_columns.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_EFFECT_COLUMNS_H
#define KT_DERIVATIVE_EFFECT_COLUMNS_H

#include "derivative/effect_derivatives.h"
#include "effect/effect.h"

/* The data that all effects of a state share. */
typedef struct kt_effects_state {
    const kt_model *model;
    kt_data *data;
    const kt_derivative_work *x;
    const kt_dynamic_state *at;
    kt_effect_dof *path;
} kt_effects_state;

/* Two vectors: angular and linear, or moment and force. */
typedef struct kt_effect_pair {
    kt_v4 a, b;
} kt_effect_pair;

/* An end; the origin is that of the end's link. The position is relative to `from`. The velocity is relative to the
 * world or, with a base of zero, to the base of the end's tree. */
typedef struct kt_end_motion {
    kt_v4 origin, point, omega, velocity;
} kt_end_motion;

/* The columns of one degree of freedom: C S, X of the degrees of freedom that it carries on the end, and X of the
 * others. */
typedef struct kt_effect_columns {
    kt_effect_pair rate, carried, others;
} kt_effect_columns;

/* The deepest common ancestor of links a and b. */
int32_t kt_effect_carrier_of(const kt_model *model, int32_t a, int32_t b);

/* Returns position and velocity of the reference of a link's tree; its positions and velocities are relative to these.
 * For the ground both are zero. */
kt_effect_pair kt_effect_base_of(const kt_effects_state *s, int32_t link);

/* Finds end k of an effect. */
void kt_effect_find_end(const kt_effects_state *s, const kt_effect_record *effect, int k, kt_effect_pair base,
                        kt_v4 from, kt_end_motion *m, kt_effect_end *end);

/* Adds the degrees of freedom between the carrier and a link to s->path, expressed about p, from index `count` on.
 * Returns the new count. Both points are relative to the same point. */
size_t kt_effect_follow(const kt_effects_state *s, int32_t carrier, int32_t to, int32_t end, kt_v4 origin, kt_v4 p,
                        size_t count);

/* Finds the columns of k. velocity: of the last end, relative to the tree of k. */
void kt_effect_find_columns(const kt_effect_jacobian *of, kt_v4 omega, kt_v4 velocity, const kt_effect_dof *k,
                            bool last, kt_effect_columns *out);

/* The wrench on each end depends on the motion of both, and the wrenches need not add up to zero. So each end is
 * treated as the only end of an effect, W_e. The motion of the other end adds columns without the terms of W_e itself:
 *     dtau_i = sum_e [S_i (e) . (sum_f dW_e/d(motion of f)) + dS_i (e) . W_e]
 * With k on the path of f, these are the columns of kt_effect_find_columns for the matrices by end f. For f != e, g has
 * W = 0. */
void kt_effect_subtract_own_column(const kt_effects_state *s, const kt_effect_dof *k, int32_t end, size_t count,
                                   const kt_effect_columns *c, double *d_q, double *d_v);

#endif
