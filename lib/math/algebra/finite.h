/* Whether numbers are finite. The functions are inline, since a mechanism of one or two links is evaluated in the time
 * of a few calls. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_FINITE_H
#define KT_ALGEBRA_FINITE_H

#include "algebra/lane.h"

#include <stdbool.h>
#include <stddef.h>

/* Whether n numbers are all finite, without a branch for each. The difference x - x is 0 for a finite x, and NaN
 * otherwise. A NaN persists in a sum. Pairs are vector instructions. */
static inline bool kt_all_finite(const double *x, size_t n) {
    kt_v2 pair = kt_v2_splat(0.0);
    for (size_t i = 1; i < n; i += 2)
        pair += kt_v2_load(x + i - 1) - kt_v2_load(x + i - 1);
    const double last = n % 2 ? x[n - 1] - x[n - 1] : 0.0;
    return pair[0] + pair[1] + last == 0.0;
}

#endif
