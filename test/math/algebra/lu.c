/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/lu.h"

#include "check.h"

#include <float.h>
#include <math.h>
#include <string.h>

enum { MOST = 24 };

/* |A x - b| over n eps |A| |x|, which is 1 or so for a backward stable solution. */
static double backward_error(const double *a_re, const double *a_im, size_t n, const double *x_re, const double *x_im,
                             const double *b_re, const double *b_im) {
    double worst = 0.0, size_a = 0.0, size_x = 0.0;
    for (size_t i = 0; i < n; i++) {
        double re = -b_re[i], im = -b_im[i], row = 0.0;
        for (size_t j = 0; j < n; j++) {
            const double c = a_re[j * n + i], d = a_im[j * n + i];
            re += c * x_re[j] - d * x_im[j];
            im += c * x_im[j] + d * x_re[j];
            row += hypot(c, d);
        }
        worst = fmax(worst, hypot(re, im));
        size_a = fmax(size_a, row);
        size_x = fmax(size_x, hypot(x_re[i], x_im[i]));
    }
    return worst / ((double)n * DBL_EPSILON * size_a * size_x);
}

static void random_values(kt_random *random, double *values, size_t count) {
    for (size_t i = 0; i < count; i++)
        values[i] = kt_random_normal(random);
}

/* Rows of sizes that differ by up to 1e6, so that pivots matter. */
static void scale_rows(kt_random *random, double *re, double *im, size_t n) {
    for (size_t i = 0; i < n; i++) {
        const double scale = exp(kt_random_uniform(random, -7.0, 7.0));
        for (size_t j = 0; j < n; j++) {
            re[j * n + i] *= scale;
            im[j * n + i] *= scale;
        }
    }
}

KT_TEST(solutions_have_residuals_of_rounding) {
    kt_random random = kt_random_of_test();
    KT_WORST real = kt_worst_make("real"), complex = kt_worst_make("complex");
    for (size_t n = 1; n <= MOST; n++) {
        double a[2][MOST * MOST], f[2][MOST * MOST], b[2][MOST], x[2][MOST];
        const double zero[MOST * MOST] = {0.0};
        int pivot[MOST];
        random_values(&random, a[0], n * n);
        random_values(&random, a[1], n * n);
        random_values(&random, b[0], n);
        random_values(&random, b[1], n);
        if (n % 2 == 0)
            scale_rows(&random, a[0], a[1], n);
        if (n > 1)
            a[0][0] = a[1][0] = 0.0; /* no elimination without pivots */
        memcpy(f, a, sizeof f);
        memcpy(x, b, sizeof x);
        kt_check_true("regular", kt_lu_factor(f[0], n, pivot));
        kt_lu_solve(f[0], n, pivot, x[0]);
        kt_worst_below(&real, backward_error(a[0], zero, n, x[0], zero, b[0], zero), 4.0, "n = %zu", n);
        memcpy(f, a, sizeof f);
        memcpy(x, b, sizeof x);
        kt_check_true("regular", kt_lu_factor_complex(f[0], f[1], n, pivot));
        kt_lu_solve_complex(f[0], f[1], n, pivot, x[0], x[1]);
        kt_worst_below(&complex, backward_error(a[0], a[1], n, x[0], x[1], b[0], b[1]), 4.0, "n = %zu", n);
    }
}

KT_TEST(transposed_solutions_have_residuals_of_rounding) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("transposed");
    for (size_t n = 1; n <= MOST; n++) {
        double a[MOST * MOST], t[MOST * MOST], f[MOST * MOST], b[MOST], x[MOST];
        const double zero[MOST * MOST] = {0.0};
        int pivot[MOST];
        random_values(&random, a, n * n);
        random_values(&random, b, n);
        if (n > 1)
            a[0] = 0.0;
        for (size_t i = 0; i < n * n; i++)
            t[i % n * n + i / n] = a[i];
        memcpy(f, a, sizeof f);
        memcpy(x, b, sizeof x);
        kt_check_true("regular", kt_lu_factor(f, n, pivot));
        kt_lu_solve_transposed(f, n, pivot, x);
        kt_worst_below(&worst, backward_error(t, zero, n, x, zero, b, zero), 4.0, "n = %zu", n);
    }
}

KT_TEST(singular_matrices_are_told) {
    double a[4] = {1.0, 2.0, 2.0, 4.0}, re[4] = {1.0, 0.0, 0.0, 1.0}, im[4] = {0.0, 1.0, -1.0, 0.0};
    double bad[1] = {(double)NAN}, zero[1] = {0.0};
    int pivot[2];
    kt_check_true("of rank 1", !kt_lu_factor(a, 2, pivot));
    kt_check_true("complex, of rank 1", !kt_lu_factor_complex(re, im, 2, pivot)); /* (1, i) and -i times that */
    kt_check_true("NaN", !kt_lu_factor(bad, 1, pivot));
    kt_check_true("NaN", !kt_lu_factor_complex(zero, bad, 1, pivot));
    kt_check_true("of no size", kt_lu_factor(NULL, 0, NULL));
}
