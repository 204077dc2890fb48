/* The smallest singular value of the constraint Jacobian: the distance of a position from a singular one. */
#ifndef KT_COMMAND_RECORDS_SINGULAR_H
#define KT_COMMAND_RECORDS_SINGULAR_H

#include "kinetree/simulation.h"

typedef struct kt_singular kt_singular;

/* Allocates the memory for singular values of a model and its sets. Returns NULL if memory is insufficient. */
kt_singular *kt_singular_create(const kt_model *model);
void kt_singular_free(kt_singular *singular);

/* Returns the r-th largest singular value of A (kt_loop_equations) at (t, q, v). Here r is the rank of A at generic
 * positions. The value is 0 at a singular position. Infinite if r is 0; NaN if the state is not finite. */
double kt_singular_evaluate(kt_singular *singular, const kt_model *model, double t, const double *q, const double *v);

#endif
