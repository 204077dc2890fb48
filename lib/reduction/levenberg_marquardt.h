/* Closing loops from far off. */
#ifndef KT_REDUCTION_LEVENBERG_MARQUARDT_H
#define KT_REDUCTION_LEVENBERG_MARQUARDT_H

#include "reduction/project.h"

/* Moves q until the loops close, held coordinates (NULL: none) not at all, or until nothing helps any more; leaves the
 * equations there and returns the largest gap against its scale. `stubborn`: where they do not close, other starts are
 * tried. For set-up and assembly: not bounded in time as the projection of a step is, but to a fixed number of
 * evaluations. Uses delta, moved_q and beside_q of the data. */
double kt_assemble_levenberg_marquardt(const kt_model *model, kt_data *data, double t, const bool *held, bool stubborn,
                                       double *q);

/* Of one group, whose matrix is filled: the change of its coordinates, in their own units, that makes |A change +
 * gap|^2 in the equations' scales least, changes being damped by mu; into w->base. false: none, the matrix is not
 * finite. */
bool kt_damped_step(const kt_model *model, const kt_group *group, const kt_group_work *w, const double *gap, double mu);

/* The positions of a group's links from one state into another. */
void kt_take_group(const kt_model *model, const kt_group *group, const double *from, double *to);

/* out = q (+) step, but a link that does not move, or a part of one that is held (NULL: none are), keeps its bits:
 * the exponential map would round its quaternion anew. out may not be q. */
void kt_move(const kt_model *model, const bool *held, const double *q, const double *step, double *out);

/* The k-th of a fixed sequence of generic numbers in (-1, 1). */
double kt_generic(size_t k);

#endif
