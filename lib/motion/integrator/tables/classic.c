/* The classical methods of fixed steps, and Heun's method with Euler's embedded in it. Ralston's method has the least
 * error bound of all two-stage methods of order 2.
 *
 * Sources: HNW II.1, tables 1.1 and 1.2; W. Kutta, Z. Math. Phys. 46 (1901) 435; K. Heun, Z. Math. Phys. 45 (1900) 23;
 * A. Ralston, Math. Comp. 16 (1962) 431.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

#define HNW "E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, section II.1"

static const double zero[] = {0.0};
static const double one[] = {1.0};

const kt_method kt_method_euler = {
    .name = "euler",
    .title = "Explicit Euler",
    .source = HNW,
    .stages = 1,
    .order = 1,
    .a = zero, /* no entry */
    .b = one,
    .c = zero,
};

static const double midpoint_a[] = {1.0 / 2.0};
static const double midpoint_b[] = {0.0, 1.0};
static const double midpoint_c[] = {0.0, 1.0 / 2.0};

const kt_method kt_method_midpoint = {
    .name = "midpoint",
    .title = "Explicit midpoint rule, Runge 1895",
    .source = HNW,
    .stages = 2,
    .order = 2,
    .a = midpoint_a,
    .b = midpoint_b,
    .c = midpoint_c,
};

static const double heun_a[] = {1.0};
static const double heun_b[] = {1.0 / 2.0, 1.0 / 2.0};
static const double heun_c[] = {0.0, 1.0};
static const double heun_e[] = {-1.0 / 2.0, 1.0 / 2.0}; /* against b = (1, 0) */

const kt_method kt_method_heun = {
    .name = "heun",
    .title = "Heun 2(1), 1900: explicit trapezoidal rule, Euler embedded",
    .source = HNW,
    .stages = 2,
    .order = 2,
    .embedded_order = 1,
    .a = heun_a,
    .b = heun_b,
    .c = heun_c,
    .e = heun_e,
};

static const double ralston_a[] = {2.0 / 3.0};
static const double ralston_b[] = {1.0 / 4.0, 3.0 / 4.0};
static const double ralston_c[] = {0.0, 2.0 / 3.0};

const kt_method kt_method_ralston = {
    .name = "ralston",
    .title = "Ralston 2, 1962",
    .source = "A. Ralston, Math. Comp. 16 (1962) 431",
    .stages = 2,
    .order = 2,
    .a = ralston_a,
    .b = ralston_b,
    .c = ralston_c,
};

static const double kutta3_a[] = {
    1.0 / 2.0, /**/
    -1.0, 2.0, /**/
};
static const double kutta3_b[] = {1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0};
static const double kutta3_c[] = {0.0, 1.0 / 2.0, 1.0};

const kt_method kt_method_kutta3 = {
    .name = "kutta3",
    .title = "Kutta 3, 1901",
    .source = "W. Kutta, Z. Math. Phys. 46 (1901) 435",
    .stages = 3,
    .order = 3,
    .a = kutta3_a,
    .b = kutta3_b,
    .c = kutta3_c,
};

static const double rk4_a[] = {
    1.0 / 2.0,                 /**/
    0.0,       1.0 / 2.0,      /**/
    0.0,       0.0,       1.0, /**/
};
static const double rk4_b[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
static const double rk4_c[] = {0.0, 1.0 / 2.0, 1.0 / 2.0, 1.0};

const kt_method kt_method_rk4 = {
    .name = "rk4",
    .title = "The classical Runge-Kutta 4, Kutta 1901",
    .source = HNW,
    .stages = 4,
    .order = 4,
    .a = rk4_a,
    .b = rk4_b,
    .c = rk4_c,
};

static const double rk38_a[] = {
    1.0 / 3.0,             /**/
    -1.0 / 3.0, 1.0,       /**/
    1.0,        -1.0, 1.0, /**/
};
static const double rk38_b[] = {1.0 / 8.0, 3.0 / 8.0, 3.0 / 8.0, 1.0 / 8.0};
static const double rk38_c[] = {0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0};

const kt_method kt_method_rk38 = {
    .name = "rk38",
    .title = "The 3/8 rule, Kutta 1901",
    .source = HNW,
    .stages = 4,
    .order = 4,
    .a = rk38_a,
    .b = rk38_b,
    .c = rk38_c,
};
