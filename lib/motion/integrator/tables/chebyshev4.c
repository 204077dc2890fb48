/* RKC of order 4, by extrapolation: the table of its member of two stages. A single step of the member is
 * (tables/chebyshev.c)
 *
 *     w0 = 1 + (6/5)/4 = 13/10,     c_1 = 5/26,     b = (-8/5, 13/5)
 *
 * The steps of the three sequences have these slopes:
 *
 *     one step over h         1, 2
 *     two steps over h/2      1, 3, 4, 5
 *     three steps over h/3    1, 6 .. 10
 *
 * The weights of the result and of the embedded result, which is of order 3, are
 *
 *     b     = T_1 / 12 - 4 T_2 / 3 + 9 T_3 / 4
 *     b - e = 9 T_3 / 5 - 4 T_2 / 5
 *
 * Sources: as stabilised.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
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
    -4.0 / 15.0, 13.0 / 60.0, -26.0 / 15.0, 16.0 / 15.0, -26.0 / 15.0, 39.0 / 20.0, -6.0 / 5.0,
    39.0 / 20.0, -6.0 / 5.0, 39.0 / 20.0,
};
static const double c[] = {
    0.0, 5.0 / 26.0, 5.0 / 52.0, 1.0 / 2.0, 31.0 / 52.0, 5.0 / 78.0, 1.0 / 3.0, 31.0 / 78.0, 2.0 / 3.0, 19.0 / 26.0,
};
static const double e[] = {
    4.0 / 75.0, 13.0 / 60.0, -52.0 / 75.0, 32.0 / 75.0, -52.0 / 75.0, 39.0 / 100.0,
    -6.0 / 25.0, 39.0 / 100.0, -6.0 / 25.0, 39.0 / 100.0,
};
/* clang-format on */

const kt_method kt_method_rkc4 = {
    .name = "rkc4",
    .title = "Runge-Kutta-Chebyshev, extrapolated to 4(3): stabilised, for strong dampers",
    .source = "as rkc2, and E. Hairer, S. P. Norsett, G. Wanner, 1993, section II.9",
    .family = &kt_family_stabilised,
    .stages = 10,
    .order = 4,
    .embedded_order = 3,
    .a = a,
    .b = b,
    .c = c,
    .e = e,
};
