/* S lambda = b of a group in range space (half_columns.h): the factor of S, and its use. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_HALF_SQUARE_H
#define KT_REDUCTION_HALF_SQUARE_H

#include "linear/cholesky.h"
#include "reduction/half_columns.h"

/* The least square of the sine. */
static const double kt_half_independent = 1e-4;

/* Calls a function with the distance of the columns of S and the number of equations. If these are four at most, both
 * are constants, so that loops are unrolled. */
#define KT_HALF_BY_RANK(h, function, ...)                                                                              \
    ((h)->rank == 3   ? function(KT_HALF_LANES, 3, __VA_ARGS__)                                                        \
     : (h)->rank == 1 ? function(KT_HALF_LANES, 1, __VA_ARGS__)                                                        \
     : (h)->rank == 2 ? function(KT_HALF_LANES, 2, __VA_ARGS__)                                                        \
     : (h)->rank == 4 ? function(KT_HALF_LANES, 4, __VA_ARGS__)                                                        \
                      : function(KT_HALF_LANES * (size_t)(h)->n, (h)->rank, __VA_ARGS__))

/* S x = x, with the factor of S, for one right side or for four. */
#define KT_HALF_SUBSTITUTE(name, type)                                                                                 \
    KT_INLINE void name##_of(size_t stride, int rank, const double *l, type *x) {                                      \
        for (int j = 0; j < rank; j++) {                                                                               \
            x[j] /= l[(size_t)j * (stride + 1)];                                                                       \
            for (int i = j + 1; i < rank; i++)                                                                         \
                x[i] -= l[(size_t)j * stride + (size_t)i] * x[j];                                                      \
        }                                                                                                              \
        for (int j = rank - 1; j >= 0; j--) {                                                                          \
            for (int i = j + 1; i < rank; i++)                                                                         \
                x[j] -= l[(size_t)j * stride + (size_t)i] * x[i];                                                      \
            x[j] /= l[(size_t)j * (stride + 1)];                                                                       \
        }                                                                                                              \
    }                                                                                                                  \
    KT_INLINE void name(const kt_half *h, type *x) { KT_HALF_BY_RANK(h, name##_of, h->square, x); }
KT_HALF_SUBSTITUTE(kt_half_substitute, double)
KT_HALF_SUBSTITUTE(kt_half_substitute_four, kt_v4)

KT_INLINE bool kt_half_factor(size_t stride, int rank, double *square) {
    return kt_dense_cholesky(square, stride, rank, NULL);
}

/* Solves S lambda = right by Cholesky's method. */
KT_INLINE bool kt_half_find_multipliers(const kt_half *h) {
    const size_t stride = KT_HALF_LANES * (size_t)h->n;
    const double *l = h->square;
    double sum = 0.0;
    bool independent = true;
    for (int j = 0; j < h->rank; j++)
        h->diagonal[j] = l[(size_t)j * (stride + 1)];
    if (!KT_HALF_BY_RANK(h, kt_half_factor, h->square))
        return false;
    for (int j = 0; j < h->rank; j++) {
        const double pivot = l[(size_t)j * (stride + 1)];
        independent = independent && pivot * pivot > kt_half_independent * h->diagonal[j];
    }
    kt_half_substitute(h, h->multiplier);
    for (int j = 0; j < h->rank; j++)
        sum += h->multiplier[j];
    return independent && isfinite(sum);
}

#endif
