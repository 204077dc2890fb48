/* The spectrum of a formulation: eigenvalues of the Jacobian of its right-hand side in tangent coordinates,
 *
 *     xi' = B(xi) u(q0 (+) xi, v),   v' = a(q0 (+) xi, v)
 *
 * by central differences along all of xi and v, including directions in which the loops open. In these directions the
 * spectrum shows the modes that the formulation adds to the mechanism.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/dae.h"
#include "kinetree/algebra.h"
#include "kinetree/joint.h"
#include "linear/eigen.h"

#include <math.h>
#include <string.h>

#define KT_SPECTRUM_FIELDS(X)                                                                                          \
    KT_EIGEN_FIELDS(X)                                                                                                 \
    X(double, jacobian, n *n, "of (xi', v') by (xi, v)")                                                               \
    X(double, x, n, "a neighbouring state")                                                                            \
    X(double, ahead, n, "its rates")                                                                                   \
    X(double, rate, n, "u")                                                                                            \
    X(double, q, nq, "its positions")

typedef struct kt_formulation_spectrum {
    void *owned;
    KT_ARENA_DECLARE(KT_SPECTRUM_FIELDS)
} kt_formulation_spectrum;

KT_ARENA_LAYOUT(lay_out, kt_formulation_spectrum, KT_SPECTRUM_FIELDS, size_t n, size_t nq)

/* (xi', v') at x = (xi, v) */
static kt_status evaluate_spectrum(kt_formulation_spectrum *s, kt_constraint_formulation *formulation, kt_data *data,
                                   double t, const double *q, double *out, kt_error *error) {
    const size_t n = (size_t)formulation->n;
    kt_position_add(formulation->model, q, s->x, s->q);
    const kt_status status =
        kt_constraint_formulation_evaluate(formulation, data, t, s->q, s->x + n, NULL, NULL, s->rate, out + n, error);
    if (status == KT_OK)
        kt_dae_tangent_rate(formulation->model, s->x, s->rate, out);
    return status;
}

/* Central differences about xi = 0 and v. Their error is least with steps near the cube root of the rounding, 6e-6. */
static kt_status differentiate_formulation(kt_formulation_spectrum *s, kt_constraint_formulation *formulation,
                                           kt_data *data, double t, const double *q, const double *v, kt_error *error) {
    const size_t half = (size_t)formulation->n, n = 2 * half;
    kt_status status = KT_OK;
    for (size_t j = 0; j < n && status == KT_OK; j++) {
        double *column = s->jacobian + j * n;
        const double h = 6e-6 * (j < half ? 1.0 : fmax(1.0, fabs(v[j - half])));
        memset(s->x, 0, half * sizeof(double));
        memcpy(s->x + half, v, half * sizeof(double));
        s->x[j] += h;
        status = evaluate_spectrum(s, formulation, data, t, q, s->ahead, error);
        s->x[j] -= 2.0 * h;
        if (status == KT_OK)
            status = evaluate_spectrum(s, formulation, data, t, q, column, error);
        for (size_t i = 0; i < n; i++)
            column[i] = (s->ahead[i] - column[i]) / (2.0 * h);
    }
    return status;
}

/* Sorts by rising modulus. Entries of equal modulus keep LAPACK's order, so that pairs stay together. */
static void sort_by_modulus(const kt_formulation_spectrum *s, size_t n, double *real, double *imaginary) {
    for (size_t i = 0; i < n; i++) {
        const double re = s->real[i], im = s->imaginary[i], size = kt_hypot(re, im);
        size_t at = i;
        for (; at > 0 && kt_hypot(real[at - 1], imaginary[at - 1]) > size; at--) {
            real[at] = real[at - 1];
            imaginary[at] = imaginary[at - 1];
        }
        real[at] = re;
        imaginary[at] = im;
    }
}

kt_status kt_constraint_formulation_spectrum(kt_constraint_formulation *formulation, kt_data *data, double t,
                                             const double *q, const double *v, double *real, double *imaginary,
                                             kt_error *error) {
    if (KT_IS_MISSING(error, formulation, data, q || formulation->n == 0, v || formulation->n == 0, real, imaginary))
        return KT_ERROR_ARGUMENT;
    const size_t n = 2 * (size_t)formulation->n, nq = (size_t)kt_model_nq(formulation->model);
    const size_t size = lay_out(NULL, n, nq);
    double norm;
    kt_formulation_spectrum *s = kt_arena_allocate(size, "the spectrum of a formulation", error);
    if (s == NULL)
        return KT_ERROR_MEMORY;
    memset(s, 0, size);
    (void)lay_out(s, n, nq);
    s->owned = s;
    kt_status status = differentiate_formulation(s, formulation, data, t, q, v, error);
    if (status == KT_OK && !KT_EIGEN_SOLVE(s, n, s->jacobian, &norm))
        status = kt_formulation_reject(t, KT_ERROR_NOT_FINITE, "the eigenvalues of the formulation cannot be computed",
                                       error);
    if (status == KT_OK)
        sort_by_modulus(s, n, real, imaginary);
    kt_arena_free(s);
    return status;
}
