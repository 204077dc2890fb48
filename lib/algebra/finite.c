/* Whether numbers are finite, without a branch for each: x - x is 0 for a finite x, and NaN otherwise, and NaN persists in a
 * sum. Pairs are vector instructions. */
#include "algebra/finite.h"

#include "algebra/lane.h"

bool kt_all_finite(const double *x, size_t n) {
    kt_v2 pair = kt_v2_splat(0.0);
    for (size_t i = 1; i < n; i += 2)
        pair += kt_v2_load(x + i - 1) - kt_v2_load(x + i - 1);
    const double last = n % 2 ? x[n - 1] - x[n - 1] : 0.0;
    return pair[0] + pair[1] + last == 0.0;
}
