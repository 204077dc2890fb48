/* Experimental. The transformation to another model of the same mechanism, which is integrated in place of the
 * simulation's own. The caller's accelerations and projection are in instant.h. kt_simulation_options has a member for
 * each of them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_EQUATIONS_H
#define KINETREE_EQUATIONS_H

#include "kinetree/model.h"
#include "kinetree/simulation.h"

#ifdef __cplusplus
extern "C" {
#endif

/* Another model of the same mechanism, which is integrated in place of the simulation's own model, and functions that
 * convert between the two. The first argument of each function is the transformation itself. Free states, free forces
 * and free reactions belong to `model`; all others belong to the simulation's own model. The header formulation.h has
 * one transformation, the absolute formulation. */
struct kt_transformation {
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
};

#ifdef __cplusplus
}
#endif
#endif
