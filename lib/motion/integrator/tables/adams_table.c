/* Adams methods of two and of four steps. Each is started by the Runge-Kutta method of its order (Heun's; Kutta's of
 * order 4).
 *
 *     p: Adams-Bashforth    (3, -1) / 2                  (55, -59, 37, -9) / 24
 *     b: Adams-Moulton      (1, 1) / 2                   (9, 19, -5, 1) / 24
 *
 * Source: E. Hairer, S. P. Norsett, G. Wanner, Solving ODE I, 1993, section III.1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

static const double heun_a[] = {1.0}, heun_b[] = {0.5, 0.5}, heun_c[] = {0.0, 1.0};
static const double kutta_a[] = {0.5, 0.0, 0.5, 0.0, 0.0, 1.0};
static const double kutta_b[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0}, kutta_c[] = {0.0, 0.5, 0.5, 1.0};

static const double bashforth_2[] = {1.5, -0.5}, moulton_2[] = {0.5, 0.5, 0.0};
static const double bashforth_4[] = {55.0 / 24.0, -59.0 / 24.0, 37.0 / 24.0, -9.0 / 24.0};
static const double moulton_4[] = {9.0 / 24.0, 19.0 / 24.0, -5.0 / 24.0, 1.0 / 24.0, 0.0};

const kt_method kt_method_ab2 = {
    .name = "ab2",
    .title = "Adams-Bashforth 2 with Adams-Moulton 2 (PECE), 1883",
    .source = "E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, section III.1",
    .family = &kt_family_adams,
    .stages = 2,
    .order = 2,
    .a = heun_a,
    .b = heun_b,
    .c = heun_c,
    .steps = 2,
    .slopes = moulton_2,
    .predictor = bashforth_2,
};

const kt_method kt_method_ab4 = {
    .name = "ab4",
    .title = "Adams-Bashforth 4 with Adams-Moulton 4 (PECE), 1883 and 1926",
    .source = "E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, section III.1",
    .family = &kt_family_adams,
    .stages = 4,
    .order = 4,
    .a = kutta_a,
    .b = kutta_b,
    .c = kutta_c,
    .steps = 4,
    .slopes = moulton_4,
    .predictor = bashforth_4,
};
