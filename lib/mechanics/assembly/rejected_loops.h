/* The error of a failure whose cause is a caller's own loop. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CLOSURE_REJECTD_LOOPS_H
#define KT_CLOSURE_REJECTD_LOOPS_H

#include "model/model.h"

/* Returns `status`, a failure described in *error, unless the callback of a loop rejects the state (q, v; NULL: at
 * rest) or gives equations that are not finite. The function then returns KT_ERROR_CONSTRAINT, KT_ERROR_CALLBACK or
 * KT_ERROR_NOT_FINITE, *error names the loop, and the poses in data are those of q.
 * Cost: O(1) without such loops. */
kt_status kt_loops_explain(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                           kt_status status, kt_error *error);

#endif
