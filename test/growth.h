/* How the time of some work grows with its size. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_GROWTH_H
#define KT_TEST_GROWTH_H

#include <stdbool.h>

/* Does the work of one size, and returns its seconds of processor time: the difference of two calls of
 * kt_growth_now. NaN fails the check. */
typedef double kt_growth_work(const void *self, int size);

/* Processor time of this program. */
double kt_growth_now(void);

/* time(many) / time(few) <= bound.
 *
 * Other programs can only add to a time, so the least of several times is used. The two sizes are measured in turns, 3
 * times at least, and until the bound holds, 20 times at most. A bound lies between the ratios of linear and of
 * quadratic work, far from both: disturbances that hide quadratic work must slow down the short work in every turn.
 */
bool kt_check_growth(const char *what, kt_growth_work *work, const void *self, int few, int many, double bound);

#endif
