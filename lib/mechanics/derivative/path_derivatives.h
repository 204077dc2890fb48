/* Derivatives of the joint forces of effects along paths (path_derivatives.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_PATH_DERIVATIVES_H
#define KT_DERIVATIVE_PATH_DERIVATIVES_H

#include "derivative/effect_columns.h"
#include "effect/path.h"

/* The links of a path as ends of its effect, and the path in this state. */
typedef struct kt_path_ends {
    kt_effect_pair base[KT_PATH_LINK_MAX];
    kt_end_motion motion[KT_PATH_LINK_MAX];
    kt_effect_end end[KT_PATH_LINK_MAX];
    kt_path_value value;
} kt_path_ends;

/* Finds the links of an effect's path, and lists the degrees of freedom from the ground to each of these links in
 * s->path. Writes two ends from which formulas read length and speed. Returns the number of degrees of freedom. */
size_t kt_path_ends_find(const kt_effects_state *s, const kt_effect_record *effect, kt_path_ends *e,
                         kt_effect_end read[2]);

/* Writes the wrenches of a force along the path on the path's links, each about the link's origin. */
void kt_path_wrenches_find(const kt_effect_record *effect, const kt_path_ends *e, double force, kt_effect_pair *x);

/* Subtracts the derivatives of the joint forces by the motion of the path's links. The array `force` holds the force,
 * and its derivatives by length and speed. */
void kt_path_subtract(const kt_effects_state *s, const kt_effect_record *effect, const kt_path_ends *e,
                      const double force[3], size_t count, double *d_q, double *d_v);

#endif
