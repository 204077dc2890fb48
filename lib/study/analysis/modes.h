/* The struct of all modes, and the functions that its files share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ANALYSIS_MODES_H
#define KT_ANALYSIS_MODES_H

#include "base/arena.h"
#include "kinetree/analysis.h"
#include "linear/eigen.h"

/* Every array: type, name, count, meaning. n: the largest number of states, which is twice the number of coordinates
 * plus x, the number of auxiliary states. */
#define KT_MODES_FIELDS(X)                                                                                             \
    KT_EIGEN_FIELDS(X)                                                                                                 \
    X(double, matrix, n *n, "state matrix, overwritten")                                                               \
    X(double, rounding, n *n, "errors of the state matrix that are those of rounding")                                 \
    X(double, direct_error, n *n, "errors of the state matrix that are not those of forces")                           \
    X(double, by_force, n, "|w_v' R|")                                                                                 \
    X(double, largest, 2 * n, "in each row, in each column")                                                           \
    X(bool, removed, n, "states with the eigenvalue zero")                                                             \
    X(int, removal, n, "these states, in the order of their removal")                                                  \
    X(bool, replaced, n, "pairs of the second solution that a mode has")                                               \
    X(int, order, n, "eigenvalues as they are handed out")                                                             \
    X(double _Complex, refined, 2 * n, "a vector and its residual")                                                    \
    X(kt_mode, mode, n, "handed out")                                                                                  \
    X(double, positions, n *(n - x), "shapes: a complex number for each coordinate")                                   \
    X(double, velocities, n *(n - x), "shapes: likewise")                                                              \
    X(double, auxiliary_states, 2 * n * x, "shapes: a complex number for each auxiliary state")

struct kt_modes {
    void *owned; /* memory of kt_modes_create, or NULL */
    size_t n, x;
    int count;
    size_t removals;
    KT_ARENA_DECLARE(KT_MODES_FIELDS)
};

/* An eigenvector as LAPACK packs it: a real eigenvector is one column; the real and imaginary parts of a conjugate pair
 * are two columns. */
typedef struct kt_packed_vector {
    const double *re, *im; /* im: NULL if real */
} kt_packed_vector;

static inline kt_packed_vector kt_eigenvector_at(const kt_modes *m, const double *all, size_t n, size_t k) {
    kt_packed_vector x = {all + k * n, m->imaginary[k] > 0.0 ? all + (k + 1) * n : NULL};
    return x;
}

/* A large change of a state. */
double kt_modes_unit(const kt_linear_system *system, size_t state);

/* Sets columns and rows that do not exceed m->rounding to zero, until none is left (m->removed, m->removal). */
void kt_modes_remove_rounding(kt_modes *m, size_t n);

/* Writes the scaled shape and the excitation of mode `index` from the pair k of the current solution. */
void kt_modes_write_shape(kt_modes *m, const kt_linear_system *system, size_t k, int index);

/* |w' x| of the pair k. */
double kt_modes_product(const kt_modes *m, size_t n, size_t k);

/* Sets the members that follow from the eigenvalue. */
void kt_modes_set_eigenvalue(kt_mode *mode, double real, double imaginary);

/* The residual of the pair k, relative to its terms. */
double kt_modes_residual(const kt_modes *m, const kt_linear_system *system, size_t k, double real, double imaginary);

/* Computes again the pairs whose residuals exceed rounding. Overwrites the solution. */
void kt_modes_mend_shapes(kt_modes *m, const kt_linear_system *system);

#endif
