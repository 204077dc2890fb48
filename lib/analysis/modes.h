/* The inside of modes. */
#ifndef KT_ANALYSIS_MODES_H
#define KT_ANALYSIS_MODES_H

#include "kinetree/analysis.h"

/* Numbers that dgeevx works in for n states: more than its least, so that it can work in blocks. */
static inline size_t kt_modes_work(size_t n) { return 66 * n + 64; }

/* Every array: type, name, count, meaning. n: states at most, twice the coordinates. */
#define KT_MODES_FIELDS(X)                                                                                             \
    X(double, matrix, n *n, "state matrix, overwritten")                                                               \
    X(double, left, n *n, "left vectors, as LAPACK packs them")                                                        \
    X(double, right, n *n, "right vectors")                                                                            \
    X(double, real, n, "of eigenvalues")                                                                               \
    X(double, imaginary, n, "of eigenvalues")                                                                          \
    X(double, condition, n, "of eigenvalues")                                                                          \
    X(double, scale, n, "of balancing")                                                                                \
    X(double, work, kt_modes_work(n), "of LAPACK")                                                                     \
    X(int, order, n, "eigenvalues as they are handed out")                                                             \
    X(kt_mode, mode, n, "handed out")                                                                                  \
    X(double, positions, n *n, "shapes: n / 2 complex numbers each")                                                   \
    X(double, velocities, n *n, "shapes: n / 2 complex numbers each")

struct kt_modes {
    void *owned; /* memory of kt_modes_create, or NULL */
    size_t n;
    int count;
#define KT_MODES_DECLARE(type, name, count, meaning) type *name;
    KT_MODES_FIELDS(KT_MODES_DECLARE)
#undef KT_MODES_DECLARE
};

#endif
