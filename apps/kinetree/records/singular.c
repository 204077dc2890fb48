/* Singular values by one-sided Jacobi rotations (Hestenes 1958; Demmel and Veselic 1992). The vectors a_i are the rows
 * or columns of A, whichever are fewer. They are rotated in pairs,
 *
 *     tan 2 theta = 2 a_i . a_j / (a_i . a_i - a_j . a_j),
 *
 * until all are orthogonal. Their lengths are the singular values. Small values keep their relative accuracy, which a
 * decomposition of A A' would lose.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/gravity.h"

#include "base/order.h"
#include "kinetree/algebra.h"
#include "kinetree/mechanism.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

struct kt_singular {
    kt_data *data;
    double *jacobian;  /* equations x nv, column-major */
    double *vector;    /* the fewer of rows and columns, one behind the other */
    double *magnitude; /* of each vector */
};

kt_singular *kt_singular_create(const kt_model *model) {
    const kt_mobility mobility = kt_model_mobility(model); /* of the model with everything switched on */
    const size_t size = (size_t)mobility.equations * (size_t)mobility.tree + 1;
    kt_singular *made = calloc(1, sizeof *made);
    if (made == NULL)
        return NULL;
    made->jacobian = malloc(size * sizeof *made->jacobian);
    made->vector = malloc(size * sizeof *made->vector);
    made->magnitude = malloc(((size_t)mobility.equations + 1) * sizeof *made->magnitude);
    if (made->jacobian != NULL && made->vector != NULL && made->magnitude != NULL &&
        kt_data_create(model, &made->data, NULL) == KT_OK)
        return made;
    kt_singular_free(made);
    return NULL;
}

void kt_singular_free(kt_singular *singular) {
    if (singular == NULL)
        return;
    kt_data_free(singular->data);
    free(singular->jacobian);
    free(singular->vector);
    free(singular->magnitude);
    free(singular);
}

static double long_product(const double *a, const double *b, size_t length) {
    double sum = 0.0;
    for (size_t i = 0; i < length; i++)
        sum += a[i] * b[i];
    return sum;
}

/* Makes two vectors orthogonal. Returns whether they were not. */
static bool rotate_columns(double *a, double *b, size_t length) {
    const double aa = long_product(a, a, length), bb = long_product(b, b, length), ab = long_product(a, b, length);
    if (fabs(ab) <= (double)length * DBL_EPSILON * sqrt(aa) * sqrt(bb))
        return false;
    const double cot = (bb - aa) / (2.0 * ab), t = copysign(1.0, cot) / (fabs(cot) + kt_hypot(1.0, cot));
    const double c = 1.0 / kt_hypot(1.0, t), s = c * t;
    for (size_t i = 0; i < length; i++) {
        const double x = a[i], y = b[i];
        a[i] = c * x - s * y;
        b[i] = s * x + c * y;
    }
    return true;
}

static void make_orthogonal(double *vector, size_t count, size_t length) {
    enum { SWEEPS_MAX = 60 }; /* convergence is quadratic: some ten are needed */
    bool rotated = true;
    for (int sweep = 0; rotated && sweep < SWEEPS_MAX; sweep++) {
        rotated = false;
        for (size_t i = 0; i < count; i++)
            for (size_t j = i + 1; j < count; j++)
                rotated = rotate_columns(vector + i * length, vector + j * length, length) || rotated;
    }
}

double kt_singular_evaluate(kt_singular *singular, const kt_model *model, double t, const double *q, const double *v) {
    const kt_mobility mobility = kt_model_mobility(model);
    const size_t rows = (size_t)mobility.equations, columns = (size_t)mobility.tree;
    const size_t count = rows < columns ? rows : columns, length = rows < columns ? columns : rows;
    if (mobility.rank == 0)
        return HUGE_VAL;
    if (kt_loop_equations(model, singular->data, t, q, v, singular->jacobian, NULL, NULL, NULL, NULL) != KT_OK)
        return (double)NAN;
    for (size_t i = 0; i < count; i++)
        for (size_t k = 0; k < length; k++)
            singular->vector[i * length + k] = singular->jacobian[rows < columns ? k * rows + i : i * rows + k];
    make_orthogonal(singular->vector, count, length);
    for (size_t i = 0; i < count; i++) {
        const double *a = singular->vector + i * length;
        singular->magnitude[i] = sqrt(long_product(a, a, length));
    }
    qsort(singular->magnitude, count, sizeof *singular->magnitude, kt_compare_numbers);
    return singular->magnitude[count - (size_t)mobility.rank];
}
