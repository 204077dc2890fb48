/* RKC of order 4, by extrapolation: the table of its member of two stages, w0 = 1 + (6/5)/4 = 13/10, whose single step
 * is c_1 = 5/26, b = (-8/5, 13/5) (tables/chebyshev.c). One step over h has the slopes 1 and 2, two over h/2 have 1, 3,
 * 4 and 5, three over h/3 have 1 and 6 .. 10. b = T_1 / 12 - 4 T_2 / 3 + 9 T_3 / 4, and b - e = 9 T_3 / 5 - 4 T_2 / 5
 * is of order 3.
 *
 * Sources: as stabilised.c.
 */
#include "integrator/integrator.h"

/* clang-format off */
static const double a[] = {
    5.0 / 26.0,
    5.0 / 52.0, 0.0,
    -4.0 / 5.0, 0.0, 13.0 / 10.0,
    -4.0 / 5.0, 0.0, 13.0 / 10.0, 5.0 / 52.0,
    5.0 / 78.0, 0.0, 0.0, 0.0, 0.0,
    -8.0 / 15.0, 0.0, 0.0, 0.0, 0.0, 13.0 / 15.0,
    -8.0 / 15.0, 0.0, 0.0, 0.0, 0.0, 13.0 / 15.0, 5.0 / 78.0,
    -8.0 / 15.0, 0.0, 0.0, 0.0, 0.0, 13.0 / 15.0, -8.0 / 15.0, 13.0 / 15.0,
    -8.0 / 15.0, 0.0, 0.0, 0.0, 0.0, 13.0 / 15.0, -8.0 / 15.0, 13.0 / 15.0, 5.0 / 78.0,
};
static const double b[] = {
    -4.0 / 15.0, 13.0 / 60.0, -26.0 / 15.0, 16.0 / 15.0, -26.0 / 15.0, 39.0 / 20.0, -6.0 / 5.0, 39.0 / 20.0, -6.0 / 5.0, 39.0 / 20.0,
};
static const double c[] = {
    0.0, 5.0 / 26.0, 5.0 / 52.0, 1.0 / 2.0, 31.0 / 52.0, 5.0 / 78.0, 1.0 / 3.0, 31.0 / 78.0, 2.0 / 3.0, 19.0 / 26.0,
};
static const double e[] = {
    4.0 / 75.0, 13.0 / 60.0, -52.0 / 75.0, 32.0 / 75.0, -52.0 / 75.0, 39.0 / 100.0, -6.0 / 25.0, 39.0 / 100.0, -6.0 / 25.0, 39.0 / 100.0,
};
/* clang-format on */

const kt_method kt_method_rkc4 = {
    .name = "rkc4",
    .title = KT_WORDS("Runge-Kutta-Chebyshev, extrapolated to 4(3): stabilised, for strong dampers"),
    .source = KT_WORDS("as rkc2, and E. Hairer, S. P. Norsett, G. Wanner, 1993, section II.9"),
    .family = &kt_family_stabilised,
    .stages = 10,
    .order = 4,
    .embedded_order = 3,
    .a = a,
    .b = b,
    .c = c,
    .e = e,
};
