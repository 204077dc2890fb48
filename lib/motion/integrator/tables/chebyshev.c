/* RKC of order 2: the table of its member of two stages. With w1 = w0 and equal b_j, the recurrence in stabilised.c
 * gives
 *
 *     w0 = 1 + (2/13)/4 = 27/26,     b_0 = b_1 = b_2 = 1 / (4 w0^2)
 *     c_1 = 1 / (4 w0),  b = (1 - 2 w0, 2 w0)
 *
 * The leading term of the error estimate is the same for every number of stages:
 *
 *     4/5 (y0 - y1) + 2/5 h (f0 + f1) = h^3/15 y''' + O(h^4)
 *
 * Source: B. P. Sommeijer, L. F. Shampine, J. G. Verwer, J. Comput. Appl. Math. 88 (1998) 315, sections 2 and 3.1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

static const double a[] = {
    13.0 / 54.0,               /**/
    -14.0 / 13.0, 27.0 / 13.0, /**/
};
static const double b[] = {-14.0 / 13.0, 27.0 / 13.0, 0.0};
static const double c[] = {0.0, 13.0 / 54.0, 1.0};
static const double e[] = {2.0 / 5.0 + 4.0 / 5.0 * (14.0 / 13.0), -4.0 / 5.0 * (27.0 / 13.0), 2.0 / 5.0};

const kt_method kt_method_rkc2 = {
    .name = "rkc2",
    .title = "Runge-Kutta-Chebyshev 2, 1990: stabilised, for strong dampers",
    .source = "B. P. Sommeijer, L. F. Shampine, J. G. Verwer, J. Comput. Appl. Math. 88 (1998) 315",
    .family = &kt_family_stabilised,
    .stages = 3,
    .order = 2,
    .embedded_order = 2,
    .fsal = true,
    .a = a,
    .b = b,
    .c = c,
    .e = e,
};
