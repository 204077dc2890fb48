/* Projection onto the loops: tolerances, one projection in place. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CLOSURE_PROJECT_H
#define KT_CLOSURE_PROJECT_H

#include "kinetree/closure.h"

#include <float.h>

/* The rounding level of residuals relative to their scales (a radian, or the length of the longest loop). For velocity
 * equations, the level is relative to their largest term. No smaller residual is required. */
#define KT_CLOSED DBL_EPSILON

/* The gap that counts as closed: after a step (from a position near to closed), and after a search. A search leaves
 * rounding or a gap that does not close. This was measured with six families of test/hard/band.py, assembled next to
 * their singular positions (d = 0 to 1e-6). The energies of these runs do not change, in three digits, if
 * KT_CLOSED_ASSEMBLED is from 1e-13 to 1e-6. */
#define KT_CLOSED_STEP 1e-12
#define KT_CLOSED_ASSEMBLED 1e-9

/* Steps of velocities in each of two attempts. */
enum { KT_VELOCITY_STEPS = KT_VELOCITY_STEPS_MAX / 2 };

#ifndef KT_LANES

#include "dynamics/dynamics.h"
#include "kinetree/dynamics.h"
#include "kinetree/loop.h"
#include "reduction/kernel.h"

typedef enum kt_closure {
    KT_CLOSURE_DONE = 0,
    KT_CLOSURE_OPEN,
    KT_CLOSURE_NOT_FINITE,
    KT_CLOSURE_SINGULAR,
    KT_CLOSURE_DEAD
} kt_closure;

/* Whether a group was near a singular position when it was last factored. */
bool kt_is_near_singular(const kt_model *model, const kt_data *data);

/* The size of the smallest direction of the groups that are near a singular position, relative to its usual size. The
 * size is 0 if a direction vanishes, and 1 if no group is near a singular position. `rows` must be factored, with all
 * directions. */
double kt_smallest_direction(const kt_model *model, const kt_data *data, kt_rows rows);

/* The in-place forms of kt_state_project and kt_state_assemble for a model with loops. `given` are the positions before
 * the assembly. `input` is used in messages. */
kt_status kt_loops_project(const kt_model *model, kt_data *data, double t, const kt_input *input, double *q, double *v,
                           bool *moved, kt_error *error);
/* Projects the velocities alone; the positions do not change. */
kt_status kt_velocities_project(const kt_model *model, kt_data *data, double t, const kt_input *input, double *v,
                                kt_error *error);
kt_status kt_loops_assemble(const kt_model *model, kt_data *data, double t, const double *given, double *q, double *v,
                            kt_error *error);

/* right <- A d - phi in all groups, as last filled. */
void kt_aim_nearest(const kt_model *model, kt_data *data, const double *d);

/* Stores -(A v + phi_t) of all groups in `right` and its violation in *violation. */
void kt_velocity_violation(const kt_model *model, kt_data *data, const double *v, kt_violation *violation);

/* right <- -phi in all groups whose gap is above `goal`. */
void kt_residuals_to_right_hand_side(const kt_model *model, const kt_data *data, double goal);

/* The end of a projection. */
typedef struct kt_projection_limits {
    int steps;        /* at most */
    double gap;       /* to this gap, which may be 0, or to the rounding level */
    double tolerance; /* tolerance to which the loops are closed, or the projection has failed */
} kt_projection_limits;

/* Projects q, then v, in place. Returns OPEN if q is not closed to the tolerance, or v is not (then *violation.gap is
 * closed). *changed becomes true if any number changed. */
kt_closure kt_project_in_place(const kt_model *model, kt_data *data, double t, double *q, double *v,
                               const kt_projection_limits *limits, bool *changed, kt_violation *violation);

#endif

#endif
