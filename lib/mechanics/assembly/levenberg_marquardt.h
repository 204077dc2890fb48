/* Assembly from a state far from closed. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CLOSURE_LEVENBERG_MARQUARDT_H
#define KT_CLOSURE_LEVENBERG_MARQUARDT_H

#include "assembly/project.h"
#include "base/generic.h"

/* The start of a search. KT_SEARCH_SAMPLE: a sample, from which large groups either close soon or not at all.
 * KT_SEARCH_GIVEN: a state of the caller's. KT_SEARCH_STUBBORN: the state of the caller and, if the loops do not close,
 * several starts around this state. */
typedef enum kt_search { KT_SEARCH_SAMPLE = 0, KT_SEARCH_GIVEN, KT_SEARCH_STUBBORN } kt_search;

/* Changes q, except coordinates to be held (NULL: none), until the loops close or no step reduces the residuals. Leaves
 * the equations of the last q and returns the largest gap relative to its scale. Uses delta, moved_q and neighbour_q of
 * the data.
 * Cost: more evaluations than the projection after a step, but a bounded number; meant for set-up and assembly. */
double kt_assemble_levenberg_marquardt(const kt_model *model, kt_data *data, double t, const bool *held,
                                       kt_search search, double *q);

/* Writes the damped change of one group's coordinates, in their own units, to w->free. The equations of the group must
 * be filled. The change minimises |A change + gap|^2 in the equations' scales, damped by mu. Returns false if the
 * matrix is not finite. */
bool kt_damped_step(const kt_model *model, kt_data *data, size_t g, kt_rows rows, const double *gap, double mu);

/* Copies the positions of a group's links from one state to another. */
void kt_copy_group(const kt_model *model, const kt_group *group, const double *from, double *to);

#endif
