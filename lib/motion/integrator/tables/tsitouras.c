/* The 5(4) pair of Tsitouras, with his dense output of order 4, which needs no further stage.
 *
 * The paper prints 16 digits. Here are 25, which meet the order conditions to 1e-24.
 *
 * The dense output is published as polynomials b_i(theta) of degree 4. Since it is C1, each polynomial is a cubic given
 * by the ends plus d_i theta^2 (1 - theta)^2. The coefficient of theta^4 is therefore d_i. The paper does not print all
 * digits of d. The missing ones follow from the conditions of order 4, with d_2 and d_7 as printed.
 *
 * Source: Ch. Tsitouras, Runge-Kutta pairs of order 5(4) satisfying only the first column simplifying assumption,
 * Comput. Math. Appl. 62 (2011) 770.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

static const double a[] = {
    /* k2 */
    0.161,
    /* k3 */
    -8.480655492356988544426874e-3, 0.3354806554923569885444269,
    /* k4 */
    2.897153057105493432130433, -6.35944848997507484314816, 4.362295432869581411017727,
    /* k5 */
    5.325864828439256604428878, -11.74888356406282787774717, 7.495539342889836208304605, -0.09249506636175524925650208,
    /* k6 */
    5.861455442946420028659251, -12.92096931784710929170612, 8.159367898576158643180401, -0.07158497328140099722453054,
    -0.02826905039406838290900306,
    /* k7 */
    0.09646076681806522951816731, 0.01, 0.4798896504144995747752495, 1.379008574103741893192275,
    -3.290069515436080679901048, 2.324710524099773982415356};
static const double b[] = {
    0.09646076681806522951816731,
    0.01,
    0.4798896504144995747752495,
    1.379008574103741893192275,
    -3.290069515436080679901048,
    2.324710524099773982415356,
    0.0,
};
static const double c[] = {0.0, 0.161, 0.327, 0.9, 0.9800255409045096857298103, 1.0, 1.0};
static const double e[] = {
    1.780011052225771443378551e-3,
    8.164344596567469032236361e-4,
    -7.880878010261996010314728e-3,
    0.1447110071732629075371651,
    -0.5823571654525552250199376,
    0.4580821059291869466616365,
    -1.0 / 66.0,
};
static const double d[] = {
    -1.053088497729021557227490,
    0.1017,
    2.490627285651252793083545,
    -16.54810288924490271830730,
    47.37952196281928121868158,
    -34.87065786149660973623034,
    2.5,
};

const kt_method kt_method_tsit5 = {
    .name = "tsit5",
    .title = "Tsitouras 5(4), 2011",
    .source = "Ch. Tsitouras, Runge-Kutta pairs of order 5(4), Comput. Math. Appl. 62 (2011) 770",
    .stages = 7,
    .order = 5,
    .embedded_order = 4,
    .fsal = true,
    .a = a,
    .b = b,
    .c = c,
    .e = e,
    .dense_order = 4,
    .dense_terms = 1,
    .dense_d = d,
};
