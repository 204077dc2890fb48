/* lib/algebra/sincos.h compiled for the instruction-set level that meson gives. */
#include "sincos_level.h"

#include "algebra/sincos.h"
#include "base/isa.h"

void KT_KERNEL(kt_test_sincos)(const double *q, const int32_t *angle, size_t count, double *sine, double *cosine) {
    static int32_t places[KT_SINCOS_MOST + KT_SINCOS_LANES - 1]; /* zeros at the end */
    memset(places, 0, sizeof places);
    memcpy(places, angle, count * sizeof *angle);
    kt_sincos_gather(q, places, count, sine, cosine);
}
