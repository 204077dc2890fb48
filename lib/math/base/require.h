/* Checks of the arguments of a public call, before the call reads through them.
 *
 *     if (KT_IS_MISSING(error, model, q || !model->n.q, columns))
 *         return KT_ERROR_ARGUMENT;
 *
 * is true if one of the conditions is false, and *error is then filled. The message names the first such argument: the
 * word at the beginning of the condition. Conditions are evaluated in order, so that a condition may read through a
 * pointer that an earlier one requires. An array without numbers may be NULL: `q || !model->n.q`. If all hold, no
 * function is called.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_REQUIRE_H
#define KT_BASE_REQUIRE_H

#include "base/inner.h"

#include <stdbool.h>
#include <stddef.h>

/* The number of the first condition that is false, from 1; 0: none. */
#define KT_FALSE_1(a) (!(a) ? 1 : 0)
#define KT_FALSE_2(a, b) (!(a) ? 1 : !(b) ? 2 : 0)
#define KT_FALSE_3(a, b, c) (!(a) ? 1 : !(b) ? 2 : !(c) ? 3 : 0)
#define KT_FALSE_4(a, b, c, d) (!(a) ? 1 : !(b) ? 2 : !(c) ? 3 : !(d) ? 4 : 0)
#define KT_FALSE_5(a, b, c, d, e) (!(a) ? 1 : !(b) ? 2 : !(c) ? 3 : !(d) ? 4 : !(e) ? 5 : 0)
#define KT_FALSE_6(a, b, c, d, e, f) (!(a) ? 1 : !(b) ? 2 : !(c) ? 3 : !(d) ? 4 : !(e) ? 5 : !(f) ? 6 : 0)
#define KT_FALSE_OF(a, b, c, d, e, f, name, ...) name
#define KT_FALSE(...)                                                                                                  \
    KT_FALSE_OF(__VA_ARGS__, KT_FALSE_6, KT_FALSE_5, KT_FALSE_4, KT_FALSE_3, KT_FALSE_2, KT_FALSE_1, )(__VA_ARGS__)

#define KT_IS_MISSING(error, ...) kt_is_missing(error, __func__, #__VA_ARGS__, KT_FALSE(__VA_ARGS__))

/* Fills the error of a condition of the list that is false: its number, from 1. */
KT_INNER void kt_missing_report(kt_error *error, const char *call, const char *conditions, int number);

static inline bool kt_is_missing(kt_error *error, const char *call, const char *conditions, int number) {
    if (number > 0)
        kt_missing_report(error, call, conditions, number);
    return number > 0;
}

/* Whether `index` is one of `count`. */
#define KT_IS_INDEX(index, count) ((index) >= 0 && (size_t)(index) < (size_t)(count))

#endif
