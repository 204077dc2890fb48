/* The choice between dense factors of the loops' equations, which are faster if loops are few, and factors along the
 * tree (kkt.h). All thresholds of this choice are here. The thresholds of a group within the recursion are in
 * compile/form.c. The threshold between plain loops and LAPACK is KT_LARGE (constraint/group.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_DENSE_OR_TREE_H
#define KT_DERIVATIVE_DENSE_OR_TREE_H

#include "model/model.h"

/* Whether derivatives use dense factors. Dense factors need the matrices of linearised equations, with one column for
 * each coordinate. */
bool kt_linearized_is_dense(const kt_model *model);

/* Whether the responses of accelerations to joint forces, a few columns at a time, are computed along the tree. */
bool kt_mass_inverse_is_along(const kt_model *model);

#endif
