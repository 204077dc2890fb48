/* The 3(2) pair of Bogacki and Shampine. The dense output of the pair is the cubic of order 3. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

static const double a[] = {
    1.0 / 2.0,                       /**/
    0.0,       3.0 / 4.0,            /**/
    2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0, /**/
};
static const double b[] = {2.0 / 9.0, 1.0 / 3.0, 4.0 / 9.0, 0.0};
static const double c[] = {0.0, 1.0 / 2.0, 3.0 / 4.0, 1.0};
static const double e[] = {-5.0 / 72.0, 1.0 / 12.0, 1.0 / 9.0, -1.0 / 8.0}; /* against (7/24, 1/4, 1/3, 1/8) */

const kt_method kt_method_bs32 = {
    .name = "bs32",
    .title = "Bogacki-Shampine 3(2), 1989",
    .source = "P. Bogacki, L. F. Shampine, A 3(2) pair of Runge-Kutta formulas, Appl. Math. Lett. 2 (1989) 321",
    .stages = 4,
    .order = 3,
    .embedded_order = 2,
    .fsal = true,
    .a = a,
    .b = b,
    .c = c,
    .e = e,
};
