#include "growth.h"

#include <math.h>
#include <sys/resource.h>

#include "check.h"

double kt_growth_now(void) {
    struct rusage use;
    return getrusage(RUSAGE_SELF, &use) == 0 ? (double)use.ru_utime.tv_sec + 1e-6 * (double)use.ru_utime.tv_usec
                                             : (double)NAN;
}

bool kt_check_growth(const char *what, kt_growth_work *work, const void *self, int few, int many, double bound) {
    double short_time = HUGE_VAL, long_time = HUGE_VAL;
    for (int i = 0; i < 20 && !(i >= 3 && long_time <= bound * short_time); i++) {
        const double of_few = work(self, few), of_many = work(self, many);
        if (isnan(of_few) || isnan(of_many))
            return kt_check_below(what, (double)NAN, bound);
        short_time = fmin(short_time, of_few);
        long_time = fmin(long_time, of_many);
    }
    return kt_check_below(what, long_time / short_time, bound);
}
