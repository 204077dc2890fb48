/* SPDX-License-Identifier: Apache-2.0 */
#include "small.h"

#include <math.h>

void small_open(small *s, const kt_model *model, const kt_linearization_options *options, double t, const double *q,
                const double *v, const double *tau) {
    kt_error error = {0};
    s->model = model;
    s->linearization = kt_test_linearization(model, options);
    s->modes = kt_test_modes(model);
    kt_need_fine("is linearised", kt_linearization_evaluate(s->linearization, t, q, v, tau, &error), &error);
    s->system = kt_linearization_system(s->linearization);
    kt_need_fine("has eigenvalues", kt_modes_evaluate(s->modes, s->system, &error), &error);
}

double small_at(const double *matrix, int rows, int i, int j) { return matrix[(size_t)j * (size_t)rows + (size_t)i]; }

kt_mode small_nearest(const small *s, double real, double imaginary, double *distance) {
    kt_mode best = {0};
    *distance = HUGE_VAL;
    for (int i = 0; i < kt_modes_count(s->modes); i++) {
        const kt_mode mode = kt_modes_at(s->modes, i);
        const double away = hypot(mode.real - real, mode.imaginary - fabs(imaginary));
        if (!(away < *distance))
            continue;
        *distance = away;
        best = mode;
    }
    return best;
}

void small_expect(const small *s, double real, double imaginary, double bound, kt_worst *worst) {
    double distance;
    (void)small_nearest(s, real, imaginary, &distance);
    kt_worst_below(worst, distance, bound, "lambda = %.6g + %.6g i", real, imaginary);
}
