/* BDF2, and the two-step family, whose default spectral radius is 0.6. Both start with the L-stable diagonally implicit
 * method of two stages and order 2:
 *
 *     gamma = 1 - 1 / sqrt 2
 *
 * Sources: [MSD 5.31]; for the starting method R. Alexander, SIAM J. Numer. Anal. 14 (1977) 1006.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

#define GAMMA 0.29289321881345247559915564
#define REST 0.70710678118654752440084436

static const double a[] = {0.0, 0.0, 0.0, 0.0, GAMMA, 0.0, 0.0, REST, GAMMA};
static const double b[] = {0.0, REST, GAMMA}, c[] = {0.0, GAMMA, 1.0};

const kt_method kt_method_bdf2 = {
    .name = "bdf2",
    .title = "Two-step BDF, Curtiss and Hirschfelder 1952: L-stable",
    .source = "C. F. Curtiss, J. O. Hirschfelder, Proc. Nat. Acad. Sci. 38 (1952) 235",
    .family = &kt_family_two_step,
    .stages = 3,
    .order = 2,
    .fsal = true,
    .a = a,
    .b = b,
    .c = c,
    .steps = 2,
    .rho = 0.0,
};

const kt_method kt_method_two_step = {
    .name = "two-step",
    .title = "Two-step method with chosen damping, 2001: A-stable, rho at infinity",
    .source = "P. Masarati, M. Lanz, P. Mantegazza, XVI Congresso AIDAA, Palermo 2001",
    .family = &kt_family_two_step,
    .stages = 3,
    .order = 2,
    .fsal = true,
    .a = a,
    .b = b,
    .c = c,
    .steps = 2,
    .rho = 0.6,
};
