/* Angles in degrees. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ALGEBRA_ANGLE_H
#define KT_ALGEBRA_ANGLE_H

#include <math.h>

/* Converts x degrees to radians: x pi / 180 with one rounding, except at ties. The common angles therefore have the
 * nearest doubles:
 *     180 deg = pi,  90 deg = pi/2,  60 deg = pi/3. */
static inline double kt_radians(double degrees) {
    static const double pi_high = 3.141592653589793116, pi_low = 1.2246467991473532e-16; /* pi = high + low */
    const double product = degrees * pi_high;
    const double error = fma(degrees, pi_high, -product) + degrees * pi_low;
    const double quotient = product / 180.0;
    return quotient + (fma(-quotient, 180.0, product) + error) / 180.0;
}

#endif
