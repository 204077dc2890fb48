/* Closing the loops: limits of iterations, and the initial values that an assembly has moved. The functions
 * kt_state_project and kt_state_assemble are in mechanism.h. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_CLOSURE_H
#define KINETREE_CLOSURE_H

#include "kinetree/model.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The limits of iterations. kt_data_iterations reports the largest numbers used, and whether a limit was reached.
 *
 * An evaluation of accelerations iterates only near a singular position of the loops. Near a singular position, an
 * evaluation uses at most 8 sets of 6 neighbouring states. Each of these is closed in at most 6 steps. Two further
 * states are closed in at most 4 steps each. (Reductions by SVD iterate within LAPACK, which has its own limits.) */
enum {
    KT_POSITION_STEPS_MAX = 30, /* of a projection; one or two suffice after a usual step */
    KT_VELOCITY_STEPS_MAX = 6,  /* of a projection, in two attempts; one suffices */
    KT_ASSEMBLY_STEPS_MAX = 200 /* of an assembly, along the manifold to the nearest state */
};

/* A given initial value that an assembly has moved. */
typedef struct kt_initial_change {
    int body;        /* the body whose joint has moved */
    unsigned part;   /* of its state: one of the KT_GIVEN_ bits */
    double change;   /* of the coordinate of that part that moved most: rad, m, rad/s or m/s. For a quaternion it is
                        the angle, rad. */
    double relative; /* Positions are relative to a radian, or to the length of the longest loop. Velocities are
                        relative to the fastest of the mechanism. */
} kt_initial_change;

/* The least relative size of a change that is reported. */
#define KT_INITIAL_CHANGE_LEAST 1e-6

/* Reports the given initial values that an assembly has changed by more than KT_INITIAL_CHANGE_LEAST. The state q (nq),
 * v (nv) was assembled from kt_model_initial. The positions and velocities of a simulation that has just been created
 * are such a state.
 *
 * There is one entry for each part of a joint, in the order of bodies, positions before velocities. Returns the number
 * of entries and fills the first `most` of them (changes may be NULL if most is 0). Allocates nothing. O(bodies). */
KT_API int kt_initial_changes(const kt_model *model, const double *q, const double *v, kt_initial_change *changes,
                              int most);

/* Reports velocities that an assembly has chosen: the description does not give them, and neither its velocities nor
 * the loops determine them. A group of loops with more degrees of freedom than given velocities has such velocities.
 * Velocities that were chosen as zero are not reported. Arguments and results are those of kt_initial_changes; `change`
 * is the velocity. */
KT_API int kt_initial_choices(const kt_model *model, const double *v, kt_initial_change *changes, int most);

#ifdef __cplusplus
}
#endif
#endif
