/* Generic numbers: a property that holds for these numbers holds for almost all numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_GENERIC_H
#define KT_BASE_GENERIC_H

#include <math.h>
#include <stddef.h>

/* Returns the k-th of a fixed sequence of generic numbers in (-1, 1). */
static inline double kt_generic(size_t k) {
    const double x = (double)(k + 1) * 0.61803398874989485; /* the golden ratio */
    return 2.0 * (x - floor(x)) - 1.0;
}

#endif
