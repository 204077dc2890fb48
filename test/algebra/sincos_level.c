/* lib/algebra/sincos.h compiled for the instruction-set level that meson gives. */
#include "sincos_level.h"

#include "algebra/sincos.h"
#include "base/level.h"

void KT_KERNEL(kt_test_sincos)(const double *q, const int32_t *angle, size_t count, double *sine, double *cosine) {
    kt_sincos_gather(q, angle, count, sine, cosine);
}
