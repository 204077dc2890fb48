/* Gauss' principle of least constraint, with given second derivatives of the closures.
 *
 * The acceleration a minimises (a - a_f)' M (a - a_f), a_f = M^-1 f, subject to A a = c [MSD 4.22]. With M = L L',
 * y = L' a and B = L^-1 A', y is the vector nearest to y_f = L^-1 f with B' y = c. Column pivoting gives
 *
 *     B P = [Q1 Q2] [R1 S; 0 0] of rank r
 *
 * Thus B' y = c becomes R1' Q1' y = (P' c)_1. The other equations depend on these, and
 *
 *     y = Q1 R1^-T (P' c)_1 + Q2 Q2' y_f,     a = L^-T y.
 *
 * Written out for full rank [MSD 4.29], this is
 *
 *     a = a_f - M^-1 A' (A M^-1 A')^-1 (A a_f - c)
 *
 * without the squared condition number of A M^-1 A'. If equations are redundant, the first r pivots are kept and all
 * others are ignored. This equals the pseudo-inverse if c is consistent, which is the case on the manifold.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/formulation.h"
#include "linear/lapack.h"

#include <math.h>

static double diagonal(const kt_constraint_formulation *formulation, int i) {
    return fabs(formulation->factor[(size_t)i * (size_t)formulation->n + (size_t)i]);
}

/* Updates the statistics of the last independent direction, relative to the first, and of the rank. */
static void watch_rank(kt_constraint_formulation *formulation, double t, int rank) {
    const double last =
        formulation->cap > 0 && formulation->cap <= formulation->n ? diagonal(formulation, formulation->cap - 1) : 1.0;
    if (last > formulation->largest)
        formulation->largest = last;
    if (last < formulation->least) {
        formulation->least = last;
        formulation->found.least_time = t;
    }
    formulation->found.least = formulation->largest > 0.0 ? formulation->least / formulation->largest : 1.0;
    formulation->found.dropped += rank < formulation->cap;
    formulation->found.trusted += rank > formulation->cap;
}

int kt_formulation_factor(kt_constraint_formulation *formulation, double t, bool watch) {
    const int n = formulation->n, k = formulation->k, most = n < k ? n : k;
    int rank = 0;
    if (most == 0)
        return 0;
    (void)kt_lapack_geqp3(n, k, formulation->factor, formulation->pivot, formulation->reflector_scale,
                          formulation->work, 34 * (n + k));
    while (rank < most && diagonal(formulation, rank) > formulation->options.rank_tolerance * diagonal(formulation, 0))
        rank++;
    if (!formulation->options.uncapped && rank > formulation->cap)
        rank = formulation->cap;
    if (watch)
        watch_rank(formulation, t, rank);
    return rank;
}

void kt_formulation_constrain(kt_constraint_formulation *formulation, int rank, const double *b, double *x) {
    const int n = formulation->n, most = n < formulation->k ? n : formulation->k;
    if (rank == 0)
        return;
    (void)kt_lapack_ormqr('T', n, 1, most, formulation->factor, formulation->reflector_scale, x, formulation->work, 1);
    for (int i = 0; i < rank; i++) {
        const double *column = formulation->factor + (size_t)i * (size_t)n;
        double sum = b[formulation->pivot[i] - 1];
        for (int j = 0; j < i; j++)
            sum -= column[j] * x[j];
        x[i] = sum / column[i];
    }
    (void)kt_lapack_ormqr('N', n, 1, most, formulation->factor, formulation->reflector_scale, x, formulation->work, 1);
}

kt_status kt_formulation_gauss(kt_constraint_formulation *formulation, double t, double *a, kt_error *error) {
    const int n = formulation->n, k = formulation->k;
    if (n > 0 && kt_lapack_potrf(n, formulation->mass) != 0)
        return kt_formulation_reject(
            t, KT_ERROR_SINGULAR,
            "the mass matrix of the tree is singular: this formulation needs inertia along every joint, the "
            "reduction only along the degrees of freedom that loops leave",
            error);
    for (int r = 0; r < k; r++)
        for (int i = 0; i < n; i++)
            formulation->factor[(size_t)r * (size_t)n + (size_t)i] =
                formulation->jacobian[(size_t)i * (size_t)k + (size_t)r];
    for (int i = 0; i < n; i++)
        a[i] = formulation->force[i];
    if (n == 0)
        return KT_OK;
    (void)kt_lapack_trtrs('N', n, 1, formulation->mass, a);
    if (k > 0)
        (void)kt_lapack_trtrs('N', n, k, formulation->mass, formulation->factor);
    kt_formulation_constrain(formulation, kt_formulation_factor(formulation, t, true), formulation->target, a);
    (void)kt_lapack_trtrs('T', n, 1, formulation->mass, a);
    return KT_OK;
}
