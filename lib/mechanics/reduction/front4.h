/* Fronts of at most four parameters in a plane (front.h), for accelerations at regular positions: a row of four-bars.
 *
 * Parameters are lanes, so that no code loop runs over parameters: T_i' is three vectors, H four. A step has at most
 * two equations D p = e. Two reflectors yield D' Pi = Q [R1; 0]. Then p = p0 + Z p2 with p0 = Q (y, 0), R1' y = e, and
 * Z the other columns of Q. With the lanes R = [Z p0]
 *   T R gives T Z and T p0,  H R gives H Z and H p0,  H becomes Z' H Z,  g becomes Z' (g - H p0)
 * Each parameter is kept as long as a link is open. When no link is open, the minimisation eliminates all parameters.
 *
 * Every exceptional case (next to a singular position, no inertia, not finite) is left to front_factor.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_FRONT4_H
#define KT_REDUCTION_FRONT4_H

#include "reduction/front.h"

/* The most parameters, equations of a step and active links. */
enum { KT_FRONT4_PARAMS = 4, KT_FRONT4_ROWS = 2, KT_FRONT4_SLOTS = 16 };

/* The results that a step keeps for the backward pass, in the group's memory for fronts. */
typedef struct kt_front4_step {
    kt_v4 basis[3], particular; /* Z by columns; p0 */
    kt_v4 last;                 /* the parameters that it minimises out */
    int32_t params, rank;
    bool ends;
} kt_front4_step;

static inline size_t kt_front4_count(size_t steps) { return steps * sizeof(kt_front4_step) / sizeof(double); }

/* Writes the accelerations of a group on the ground to a; without tau the least solution of A x = right. The group's
 * equations have been filled and its bias is computed (planar_group.h). Returns false if the group is left to
 * front_factor.c. Sets the same data as kt_front_factor, for the equations data->factored. */
#define KT_FRONT4_DECLARE(isa)                                                                                         \
    bool kt_front4_solve_##isa(const kt_model *model, kt_data *data, size_t g, const double *tau, double *a);
KT_EACH_ISA(KT_FRONT4_DECLARE)

#endif
