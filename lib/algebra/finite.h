/* Whether numbers are finite. */
#ifndef KT_ALGEBRA_FINITE_H
#define KT_ALGEBRA_FINITE_H

#include <stdbool.h>
#include <stddef.h>

/* Whether n numbers are all finite. */
bool kt_all_finite(const double *x, size_t n);

#endif
