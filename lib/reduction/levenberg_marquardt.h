/* Assembly from a state far from closed. */
#ifndef KT_REDUCTION_LEVENBERG_MARQUARDT_H
#define KT_REDUCTION_LEVENBERG_MARQUARDT_H

#include "reduction/project.h"

/* Changes q, except coordinates to be held (NULL: none), until the loops close or no step reduces the residuals; leaves
 * the equations there and returns the largest gap relative to its scale. `stubborn`: other starts are tried if the
 * loops do not close. For set-up and assembly: it is not as short as the projection of a step, but takes a bounded
 * number of evaluations. Uses delta, moved_q and beside_q of the data. */
double kt_assemble_levenberg_marquardt(const kt_model *model, kt_data *data, double t, const bool *held, bool stubborn,
                                       double *q);

/* For one group, whose matrix is filled: the change of its coordinates, in their own units, that minimises
 * |A change + gap|^2 in the equations' scales, damped by mu; into w->free. Returns false if the matrix is not finite.
 * */
bool kt_damped_step(const kt_model *model, const kt_group *group, const kt_group_work *w, const double *gap, double mu);

/* Copies the positions of a group's links from one state to another. */
void kt_take_group(const kt_model *model, const kt_group *group, const double *from, double *to);

/* out = q (+) step, except that a link that does not move, or a part that is held (NULL: none), keeps its bits: the
 * exponential map would round its quaternion. out must not be q. */
void kt_move(const kt_model *model, const bool *held, const double *q, const double *step, double *out);

/* The k-th of a fixed sequence of generic numbers in (-1, 1). */
double kt_generic(size_t k);

#endif
