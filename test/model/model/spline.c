/* Cubic tables against GSL's natural spline. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/function.h"

#include <float.h>
#include <math.h>

#include <gsl/gsl_spline.h>

#include "check.h"
#include "fixture.h"

enum { ROWS = 40 };

/* GSL solves the same tridiagonal system in another arrangement. Its matrix is diagonally dominant (condition below 3
 * for steps of like size; here they differ up to 7.5 times). The bound 100 eps max|y| / least step^k is about twenty
 * times the measured error. */
KT_TEST(cubic_table_is_the_natural_spline) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("against gsl_interp_cspline");
    for (int count = 3; count <= ROWS; count++) {
        double rows[2 * ROWS], t[ROWS], y[ROWS];
        for (int k = 0; k < count; k++) {
            rows[2 * k] = t[k] = k > 0 ? t[k - 1] + kt_random_uniform(&random, 0.2, 1.5) : -3.0;
            rows[2 * k + 1] = y[k] = kt_random_normal(&random);
        }
        const kt_function table = kt_function_table(rows, 2 * count, KT_INTERPOLATION_CUBIC);
        gsl_spline *spline = gsl_spline_alloc(gsl_interp_cspline, (size_t)count);
        gsl_spline_init(spline, t, y, (size_t)count);
        for (int i = 0; i < 50; i++) {
            const double x = kt_random_uniform(&random, t[0], t[count - 1]);
            const double expected[3] = {gsl_spline_eval(spline, x, NULL), gsl_spline_eval_deriv(spline, x, NULL),
                                        gsl_spline_eval_deriv2(spline, x, NULL)};
            double out[3] = {(double)NAN, (double)NAN, (double)NAN};
            kt_error error = {0};
            kt_need_fine("evaluated", kt_function_evaluate(&table, x, out, &error), &error);
            for (int d = 0; d < 3; d++)
                kt_worst_near(&worst, out[d], expected[d], 8.0 * DBL_EPSILON * 3.0 / pow(0.2, d),
                              "%d rows, t = %g, derivative %d", count, x, d);
        }
        gsl_spline_free(spline);
    }
}
