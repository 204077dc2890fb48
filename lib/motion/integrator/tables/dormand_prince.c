/* The 5(4) pair of Dormand and Prince, RK5(4)7M. The dense output of order 4 is that of Hairer's DOPRI5 (due to
 * Shampine).
 *
 * Sources: J. R. Dormand, P. J. Prince, J. Comput. Appl. Math. 6 (1980) 19; HNW II.5, table 5.2. For d: HNW II.6, and
 * CONTD5 in the appendix there.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

/* clang-format off */
const double kt_dopri5_a[] = {
    1.0 / 5.0,
    3.0 / 40.0,       9.0 / 40.0,
    44.0 / 45.0,      -56.0 / 15.0,      32.0 / 9.0,
    19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0,
    9017.0 / 3168.0,  -355.0 / 33.0,     46732.0 / 5247.0, 49.0 / 176.0,  -5103.0 / 18656.0,
    35.0 / 384.0,     0.0,               500.0 / 1113.0,   125.0 / 192.0, -2187.0 / 6784.0,  11.0 / 84.0,
};
const double kt_dopri5_b[] = {
    35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0, 0.0,
};
const double kt_dopri5_c[] = {0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0};
const double kt_dopri5_e[] = {
    71.0 / 57600.0, 0.0, -71.0 / 16695.0, 71.0 / 1920.0, -17253.0 / 339200.0, 22.0 / 525.0, -1.0 / 40.0,
};
const double kt_dopri5_d[] = {
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
};
/* clang-format on */

const kt_method kt_method_dopri5 = {
    .name = "dopri5",
    .title = "Dormand-Prince 5(4), 1980",
    .source =
        "J. R. Dormand, P. J. Prince, A family of embedded Runge-Kutta formulae, J. Comput. Appl. Math. 6 (1980) 19",
    .stages = 7,
    .order = 5,
    .embedded_order = 4,
    .fsal = true,
    .a = kt_dopri5_a,
    .b = kt_dopri5_b,
    .c = kt_dopri5_c,
    .e = kt_dopri5_e,
    .dense_order = 4,
    .dense_terms = 1,
    .dense_d = kt_dopri5_d,
};
