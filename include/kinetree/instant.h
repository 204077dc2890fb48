/* An instant of a motion, and the functions of a caller that replace equations of the engine there. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_INSTANT_H
#define KINETREE_INSTANT_H

#include "kinetree/model.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* An instant at which a function of the caller is evaluated. The simulation owns all its contents. */
typedef struct kt_instant {
    const kt_model *model;     /* the simulation's model */
    kt_data *data;             /* scratch data for that model */
    double t;                  /* s */
    const double *q, *v;       /* nq positions, nv velocities, of that model */
    const double *tau;         /* nv: applied torques, without those of effects; NULL: none */
    const kt_wrench *external; /* one applied wrench for each body; NULL: none */
    const double *x;           /* auxiliary states, kt_auxiliary_state_count */
} kt_instant;

/* Computes the accelerations v' = a (nv) at any stage of a step, in place of kt_acceleration_evaluate. The result
 * depends on the arguments alone. On entry `rate` (nv) contains v. The function may change `rate`: the positions then
 * change with q' = kt_position_rate(q, rate).
 * Returns 0 on success. Returns a positive number if `a` cannot be computed in this state but a smaller step may help.
 * Returns a negative number to stop. If the function writes a message to *error, the simulation reports this
 * message. */
typedef int kt_right_hand_side(const kt_instant *at, double *rate, double *a, kt_error *error, void *user);

/* Projects the state q (nq), v (nv), in place of kt_state_project. The arrays are at->q and at->v. The simulation calls
 * this function after each accepted step, and for records between steps. On entry *changed is false. Returns the same
 * values as a right-hand side. */
typedef int kt_projection(const kt_instant *at, double *q, double *v, bool *changed, kt_error *error, void *user);

#ifdef __cplusplus
}
#endif
#endif
