/* Assembly from a state far from closed. */
#ifndef KT_CLOSURE_LEVENBERG_MARQUARDT_H
#define KT_CLOSURE_LEVENBERG_MARQUARDT_H

#include "base/generic.h"
#include "closure/project.h"

/* What a search starts from: a sample, from which large groups either close soon or not at all; a state of the
 * caller's; that, and if the loops do not close, several starts around it. */
typedef enum kt_search { KT_SEARCH_SAMPLE = 0, KT_SEARCH_GIVEN, KT_SEARCH_STUBBORN } kt_search;

/* Changes q, except coordinates to be held (NULL: none), until the loops close or no step reduces the residuals; leaves
 * the equations there and returns the largest gap relative to its scale. It is meant for set-up and assembly: it takes
 * more evaluations than the projection after a step, but a bounded number. Uses delta, moved_q and neighbour_q of the
 * data. */
double kt_assemble_levenberg_marquardt(const kt_model *model, kt_data *data, double t, const bool *held,
                                       kt_search search, double *q);

/* For one group, whose equations are filled: the change of its coordinates, in their own units, that minimises
 * |A change + gap|^2 in the equations' scales, damped by mu, is written to w->free. Returns false if the matrix is not
 * finite. */
bool kt_damped_step(const kt_model *model, kt_data *data, size_t g, kt_rows rows, const double *gap, double mu);

/* Copies the positions of a group's links from one state to another. */
void kt_take_group(const kt_model *model, const kt_group *group, const double *from, double *to);

#endif
