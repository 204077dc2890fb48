/* Whether numbers are finite. The functions are inline, since a mechanism of one or two links is evaluated in the time
 * of a few calls. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_FINITE_H
#define KT_ALGEBRA_FINITE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

/* Whether n numbers are all finite, without a branch for each. An infinity and a NaN have an exponent of eleven ones,
 * which overflows into the sign if a one is added. Integers take one cycle where a sum of doubles takes three or
 * four. */
static inline bool kt_all_finite(const double *x, size_t n) {
    const uint64_t exponent = 0x7ff0000000000000u, one = 0x0010000000000000u;
    uint64_t overflow = 0;
    for (size_t i = 0; i < n; i++) {
        uint64_t bits;
        memcpy(&bits, x + i, sizeof bits);
        overflow |= (bits & exponent) + one;
    }
    return !(overflow >> 63);
}

#endif
