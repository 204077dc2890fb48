/* Where loops are few enough for dense factors of their equations to take less time than factors along the tree (kkt.h).
 * All thresholds of this choice are here; those of a group within the recursion are in compile/form.c, and that between
 * plain loops and LAPACK is KT_LARGE (constraint/group.h). */
#ifndef KT_DERIVATIVE_DENSE_OR_TREE_H
#define KT_DERIVATIVE_DENSE_OR_TREE_H

#include "model/model.h"

/* Of derivatives: the matrices of linearised equations are wanted, one column a coordinate. */
bool kt_linearized_is_dense(const kt_model *model);

/* Of what joint forces do to accelerations, a few columns at a time. */
bool kt_mass_inverse_is_along(const kt_model *model);

#endif
