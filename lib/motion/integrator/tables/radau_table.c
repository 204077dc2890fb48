/* Radau IIA of order 5, with three stages at the zeros of
 *
 *     d^2/dx^2 (x^2 (x - 1)^3) = 0:     c = (4 -+ sqrt 6) / 10, 1
 *
 * The first stage of the table is y0 itself. The slope f(t0, y0) has no part in the step (b_1 = 0), but in the error
 * estimate and in the dense output.
 *
 * Error estimate: formula (8.19) of Hairer and Wanner before its filter, of order 3,
 *
 *     err = gamma_0 h f0 + sum_i e_i z_i,     z_i = h sum_j a_ij k_j
 *     e   = gamma_0 / 3 (-13 - 7 sqrt 6, -13 + 7 sqrt 6, -1)
 *
 * with 1 / gamma_0 the real eigenvalue of A^-1.
 *
 * Dense output: y' is the cubic through the four slopes. The integral of this cubic meets y1, and has order 4. Beyond
 * the cubic of the ends it needs the third divided difference of the slopes over 4:
 *
 *     d_i = 1 / (4 prod_{j != i} (c_i - c_j))
 *
 * Source: E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, table IV.5.6 and section IV.8. All
 * digits are computed from these formulas.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

static const double a[] = {
    0.0, 0.0, 0.0, 0.0,
    /* k2 */
    0.0, 0.19681547722366042586838614, -0.065535425850198388108522783, 0.023770974348220152420408232,
    /* k3 */
    0.0, 0.39442431473908727699741167, 0.29207341166522846302050275, -0.04154875212599793019818601,
    /* k4 */
    0.0, 0.37640306270046727505007544, 0.51248582618842161383881345, 0.11111111111111111111111111};
static const double b[] = {0.0, 0.37640306270046727505007544, 0.51248582618842161383881345,
                           0.11111111111111111111111111};
static const double c[] = {0.0, 0.15505102572168219018027159, 0.64494897427831780981972841, 1.0};
static const double e[] = {-0.2748888295956773677478286, 0.42829829411536810455842005, -0.24503907438491652605986765,
                           0.091629609865225789249276201};
static const double d[] = {-2.5, 3.8951955118123059560799384, -2.2285288451456392894132718,
                           0.83333333333333333333333333};

const kt_method kt_method_radau5 = {
    .name = "radau5",
    .title = "Radau IIA 5, 1969: implicit, for stiff springs, dampers and contacts",
    .source = "E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, 1996, section IV.8",
    .family = &kt_family_radau,
    .stages = 4,
    .order = 5,
    .embedded_order = 3,
    .fsal = true,
    .a = a,
    .b = b,
    .c = c,
    .e = e,
    .dense_order = 4,
    .dense_terms = 1,
    .dense_d = d,
};
