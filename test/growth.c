/* SPDX-License-Identifier: Apache-2.0 */
#include "growth.h"

#include <limits.h>
#include <math.h>
#include <time.h>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include "check.h"

double kt_growth_now(void) {
    struct timespec t;
    return clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t) == 0 ? (double)t.tv_sec + 1e-9 * (double)t.tv_nsec : (double)NAN;
}

/* Keeps memory that is freed: the system then provides its pages in the first turn alone. */
static void keep_pages(void) {
#ifdef __GLIBC__
    (void)mallopt(M_MMAP_MAX, 0);
    (void)mallopt(M_TRIM_THRESHOLD, INT_MAX);
    (void)mallopt(M_TOP_PAD, 1 << 28);
#endif
}

bool kt_check_growth(const char *what, kt_growth_work *work, const void *self, int few, int many, double bound) {
    double short_time = HUGE_VAL, long_time = HUGE_VAL;
    keep_pages();
    for (int i = 0; i < 20 && !(i >= 3 && long_time <= bound * short_time); i++) {
        const double of_few = work(self, few), of_many = work(self, many);
        if (isnan(of_few) || isnan(of_many))
            return kt_check_below(what, (double)NAN, bound);
        short_time = fmin(short_time, of_few);
        long_time = fmin(long_time, of_many);
    }
    return kt_check_below(what, long_time / short_time, bound);
}
