/* The factors of a mass matrix, M = L'DL, and the loops over them that are compiled for each instruction set.
 *
 * Degrees of freedom are numbered in the order of the links, which is depth first. The support of k are the degrees of
 * freedom that carry k. Row k of L has non-zero entries only for the support of k, and a 1 on the diagonal. Rows are
 * stored packed. The entry for the p-th degree of freedom of the support, counted from the root, is number[row[k] + p],
 * p < depth[k]. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_LTDL_H
#define KT_DYNAMICS_LTDL_H

#include "base/arena.h"
#include "base/isa.h"
#include "kinetree/dynamics.h"
#include "model/model.h"

enum {
    KT_FACTOR_ROUND = 4, /* rows begin at a multiple of it: whole vectors are read and written */
    KT_FACTOR_SHORT = 6, /* numbers of a row that are read one by one as fast (measured: 5 to 7) */
};

typedef struct kt_factor_sizes {
    size_t v, link;
    size_t number; /* numbers of all rows, rounded up */
    size_t path;   /* the longest row and one more, rounded up */
} kt_factor_sizes;

#define KT_FACTOR_FIELDS(X)                                                                                            \
    X(double, number, s->number, "rows of L without the diagonal")                                                     \
    X(double, diagonal, s->v, "D")                                                                                     \
    X(double, path, s->path, "numbers of the support of the degree of freedom at hand, for passes down")               \
    X(double, sum, s->path, "the same for passes up: all zero between calls")                                          \
    X(double, x, s->v, "a right-hand side in the order of the links")                                                  \
    X(size_t, row, s->v, "where a row begins")                                                                         \
    X(int32_t, depth, s->v, "length of a row")                                                                         \
    X(int32_t, parent, s->v, "last degree of freedom of the support, or -1")                                           \
    X(int32_t, end, s->v, "one past the last degree of freedom that one carries")                                      \
    X(int32_t, last, s->link, "last degree of freedom of a link")

struct kt_mass_factor {
    void *owned; /* memory of kt_mass_factor_create, or NULL */
    const kt_model *model;
    const struct kt_factor_kernels *kernels; /* kernels for the model's instruction set */
    bool is_short;                           /* no row is longer than KT_FACTOR_SHORT */
    bool is_factored;                        /* the object holds factors */
    KT_ARENA_DECLARE(KT_FACTOR_FIELDS)
};

/* x = M^-1 x, L^-1 x, L'^-1 x or M x */
typedef enum kt_factor_call {
    KT_FACTOR_SOLVE,
    KT_FACTOR_SOLVE_LOWER,
    KT_FACTOR_SOLVE_UPPER,
    KT_FACTOR_MULTIPLY,
    KT_FACTOR_CALLS
} kt_factor_call;

/* compute: from M in the rows and D. Returns a degree of freedom whose pivot is not positive, or n.v.
 * apply: of as many columns, in the order of the links. */
typedef struct kt_factor_kernels {
    size_t (*compute)(kt_mass_factor *f);
    void (*apply[KT_FACTOR_CALLS])(const kt_mass_factor *f, int columns, double *x);
} kt_factor_kernels;

extern const kt_factor_kernels kt_factor_kernels_baseline, kt_factor_kernels_v3, kt_factor_kernels_v4;

#endif
