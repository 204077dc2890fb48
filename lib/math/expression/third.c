/* The third derivative of a formula along a line, by Taylor coefficients (series.h) in doubles. A result that is not
 * finite is evaluated again, with numbers of any exponent (wide.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/third.h"
#include "expression/wide.h"

#include <math.h>

typedef double number;

static const number nothing = 0.0;

static number number_of(double x) { return x; }
static double double_of(number x) { return x; }
static double sign_of(number x) { return x; }
static number plus(number x, number y) { return x + y; }
static number minus(number x) { return -x; }
static number times(number x, number y) { return x * y; }
static number over(number x, number y) { return x / y; }
static number number_exp(number x) { return exp(x); }
static number number_log(number x) { return log(x); }
static number number_power(number x, double p) { return pow(x, p); }
static double number_atan2(number x, number y) { return atan2(x, y); }

#include "expression/series.h"

double kt_expression_third(const kt_expression *expression, const double *values, const double *rates) {
    const series z = series_of(expression, values, rates, NULL);
    if (isfinite(z.c[0]) && isfinite(z.c[1]) && isfinite(z.c[2]) && isfinite(z.c[3]))
        return 6.0 * z.c[3];
    double wide[4];
    kt_expression_wide(expression, values, rates, NULL, 3, wide);
    return isfinite(wide[3]) ? wide[3] : 6.0 * z.c[3];
}
