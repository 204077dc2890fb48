/* Equations of motion in place of the library's: the caller's accelerations and projection, and the transformation to
 * another model of the same mechanism.
 *
 * kt_simulation_options has a member for each.
 */
#ifndef KINETREE_EQUATIONS_H
#define KINETREE_EQUATIONS_H

#include "kinetree/dynamics.h"
#include "kinetree/mechanism.h"
#include "kinetree/model.h"

#include <stdbool.h>

#ifdef __cplusplus
extern "C" {
#endif

/* An instant at which the caller's right-hand side is evaluated. The simulation owns all its contents. */
typedef struct kt_instant {
    const kt_model *model;     /* the integrated model: the caller's, or that of the transformation */
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

/* Another model of the same mechanism, which is integrated in place of the simulation's own model, and functions that
 * convert between the two. The first argument of each function is the transformation itself. Free states, free forces
 * and free reactions belong to `model`; all others belong to the simulation's own model. The header formulation.h has
 * one transformation, the absolute formulation. */
typedef struct kt_transformation {
    const kt_model *model; /* the model that is integrated */
    /* Computes the free state of a state. The data contain its kinematics, from kt_kinematics_update. */
    void (*to_free)(const struct kt_transformation *self, const kt_data *data, const double *q, const double *v,
                    double *free_q, double *free_v);
    /* Computes the state and the accelerations from a free state with closed loops; free_a and a may both be NULL. On
     * entry q and v hold the state `ago` seconds earlier (negative: later). It selects one of the numbers that
     * represent the same rotation. */
    void (*from_free)(const struct kt_transformation *self, const double *free_q, const double *free_v,
                      const double *free_a, double ago, double *q, double *v, double *a);
    /* Computes the wrenches on all bodies of `model`. They consist of `external`, the wrenches on the own bodies (NULL:
     * none), and of the wrenches that tau (NULL: zero) exerts in the own joints. */
    void (*wrenches)(const struct kt_transformation *self, const double *free_q, const double *tau,
                     const kt_wrench *external, kt_wrench *wrenches);
    /* Computes the reactions in joints (one for each body, as in kt_joint_reactions) and in loops, under tau (NULL:
     * zero). `free_reactions` are the reactions in all loops of `model`. */
    void (*reactions)(const struct kt_transformation *self, const double *free_q, const double *tau,
                      const kt_wrench *free_reactions, kt_wrench *joints, kt_wrench *loops);
} kt_transformation;

#ifdef __cplusplus
}
#endif
#endif
