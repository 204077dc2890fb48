/* Conversions between a tree and its absolute formulation (model/absolute.h): states, forces, reactions.
 *
 * `tree` is a model that was compiled for the absolute formulation; q, v, a, tau and wrenches are the tree's unless
 * they are called free. A free state is one of kt_model_absolute(tree).
 */
#ifndef KT_SIMULATION_ABSOLUTE_H
#define KT_SIMULATION_ABSOLUTE_H

#include "kinetree/dynamics.h"

/* Computes the free state of a tree's state, whose kinematics kt_kinematics_update has left in the tree's data. */
void kt_absolute_spread(const kt_model *tree, const kt_data *data, const double *q, const double *v, double *free_q,
                        double *free_v);

/* The tree's state some time ago. It decides which of the numbers that represent the same rotation is meant, provided
 * that each joint has turned by its mean rate to within half a turn. */
typedef struct kt_absolute_past {
    const double *q, *v;
    double ago; /* s; negative for a later state */
} kt_absolute_past;

/* Computes the tree's state from a free state whose loops are closed. free_a and a may both be NULL. q and v may be
 * those of the past. */
void kt_absolute_gather(const kt_model *tree, const double *free_q, const double *free_v, const double *free_a,
                        const kt_absolute_past *past, double *q, double *v, double *a);

/* Computes the wrenches on the free bodies: those on the tree's bodies (NULL: none) and those that tau (NULL: zero)
 * exerts in its joints. */
void kt_absolute_wrenches(const kt_model *tree, const double *free_q, const double *tau, const kt_wrench *external,
                          kt_wrench *wrenches);

/* Computes the reactions in joints (as kt_joint_reactions; one for each body) and in loops from those of all loops of
 * the absolute formulation, under tau (NULL: zero). */
void kt_absolute_reactions(const kt_model *tree, const double *free_q, const double *tau, const kt_wrench *from,
                           kt_wrench *joints, kt_wrench *loops);

#endif
