/* What a failure says that a caller's own loop is the cause of. */
#ifndef KT_CLOSURE_REFUSED_LOOPS_H
#define KT_CLOSURE_REFUSED_LOOPS_H

#include "model/model.h"

/* Returns a failure, `status` as *error tells it; or, if the callback of a loop refuses the state (q, v; NULL: at rest),
 * KT_ERROR_CONSTRAINT or KT_ERROR_CALLBACK, and *error names that loop. Poses in data are those of q then. O(1) without
 * such loops. */
kt_status kt_loops_explain(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                           kt_status status, kt_error *error);

#endif
