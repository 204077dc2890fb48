/* Rates: a linear relation of joint rates, sum of coefficient * rate = f(t): A v = b' with b' = f [MSD 4.17]. The loop
 * has no phi, and leaves the positions free. phi' = A v - f and phi'' = A a - f'. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/loop.h"

static kt_relation_row rates_relation(const kt_loop_record *loop, const double *numbers, double sum, double t) {
    double f[3];
    (void)sum;
    kt_curve_evaluate(&loop->curve, numbers, t, f);
    return (kt_relation_row){.rate = -f[0], .drift = -f[1]};
}

const kt_loop_kind KT_KERNEL(kt_loop_rates) = {.relate = rates_relation};

#if KT_DESCRIBES
static const kt_key keys[] = {
    {"coefficients", KT_KEY_TERMS, KT_LOOP_AT(terms), "", "c_i, a mapping of joints of one coordinate to numbers",
     .needed = true},
    {"rate", KT_KEY_FUNCTION, KT_LOOP_AT(function), "rad/s|m/s", "f, a number or a function of time", "0",
     .needed = false},
};
const kt_descriptor kt_loop_rates_descriptor = {
    .name = "rates",
    .help = "a linear relation of joint rates: a given speed, friction wheels, differentials",
    .formula = "sum of c_i v_i = f(t)",
    .example = "bodies:\n"
               "  - name: left\n"
               "    joint: {type: revolute, axis: y, velocity: 1}\n"
               "    mass: 1\n"
               "    shape: {type: rod, to: [0, 0, 0.1]}\n"
               "  - name: right\n"
               "    joint: {type: revolute, axis: y, at: [0.4, 0, 0], velocity: 1}\n"
               "    mass: 2\n"
               "    shape: {type: rod, to: [0, 0, 0.3]}\n"
               "loops:\n"
               "  - {name: speed, type: rates, coefficients: {left: 0.5, right: 0.5}, rate: 1}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
