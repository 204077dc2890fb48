/* The factors of a mass matrix, M = L'DL, and the loops over them that are compiled for each instruction set.
 *
 * Degrees of freedom are numbered in the order of the links, which is depth first. Row k of L has non-zero entries for
 * the degrees of freedom that carry k alone, its support, and a 1 on the diagonal. It is stored packed: the entry for
 * the p-th of the support, counted from the root, is number[row[k] + p], p < depth[k].
 */
#ifndef KT_DYNAMICS_FACTOR_H
#define KT_DYNAMICS_FACTOR_H

#include "base/arena.h"
#include "base/isa.h"
#include "kinetree/dynamics.h"
#include "model/model.h"

enum { KT_FACTOR_ROUND = 4 }; /* rows begin at a multiple of it: whole vectors are read and written */

typedef struct kt_factor_sizes {
    size_t v, link;
    size_t number; /* of all rows, rounded up */
    size_t path;   /* the longest row and one more, rounded up */
} kt_factor_sizes;

#define KT_FACTOR_FIELDS(X)                                                                                            \
    X(double, number, s->number, "rows of L without the diagonal")                                                     \
    X(double, diagonal, s->v, "D")                                                                                     \
    X(double, path, s->path, "numbers of the support of the degree of freedom at hand")                                \
    X(double, x, s->v, "a right-hand side in the order of the links")                                                  \
    X(size_t, row, s->v, "where a row begins")                                                                         \
    X(int32_t, depth, s->v, "length of a row")                                                                         \
    X(int32_t, parent, s->v, "last degree of freedom of the support, or -1")                                           \
    X(int32_t, end, s->v, "one past the last degree of freedom that one carries")                                      \
    X(int32_t, last, s->link, "last degree of freedom of a link")

struct kt_mass_factor {
    void *owned; /* memory of kt_mass_factor_create, or NULL */
    const kt_model *model;
    bool ready;         /* it holds factors */
    size_t path_length; /* the longest row and one more */
    KT_ARENA_DECLARE(KT_FACTOR_FIELDS)
};

/* What the passes do with L: multiply by it, or by its inverse. */
typedef enum kt_factor_use { KT_FACTOR_MULTIPLY, KT_FACTOR_SOLVE } kt_factor_use;

/* compute: from M in the rows and the diagonal. Returns a degree of freedom whose pivot is not positive, or n.v.
 * down: x = L x or L^-1 x. up: x = L' x or L'^-1 x. */
#define KT_FACTOR_DECLARE(level)                                                                                       \
    size_t kt_factor_compute_##level(kt_mass_factor *f);                                                               \
    void kt_factor_down_##level(kt_mass_factor *f, kt_factor_use use, double *x);                                      \
    void kt_factor_up_##level(kt_mass_factor *f, kt_factor_use use, double *x);
KT_FACTOR_DECLARE(baseline)
KT_FACTOR_DECLARE(v3)
KT_FACTOR_DECLARE(v4)
#undef KT_FACTOR_DECLARE

#endif
