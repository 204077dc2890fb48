/* The order of numbers, for qsort. A NaN has no order and counts as equal to each number. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_ORDER_H
#define KT_BASE_ORDER_H

/* Returns -1 if a < b, 0 if a == b, and 1 if a > b. */
static inline int kt_order_numbers(double a, double b) { return (a > b) - (a < b); }

/* Compares two doubles by their addresses, for qsort. */
static inline int kt_compare_numbers(const void *a, const void *b) {
    return kt_order_numbers(*(const double *)a, *(const double *)b);
}

#endif
