/* Statics: forces of contacts and dry friction under which nothing moves.
 *
 *     minimise |p|^2 / 2    subject to    A p = c,    p in K
 *
 * A p = c is Newton's law of a mechanism at rest, such as W p + b = 0. K is the product of the cones |p_t| <= mu (p_n -
 * l) of contacts, the half-lines p_n >= l of contacts without friction, and the intervals |p| <= S of dry friction. The
 * diagonal blocks of W give the norm: item i has the weight w_i, the mean of the diagonal of its block. Several
 * contacts may share a load in many ways, but the minimum is unique, and independent of the order of items and of
 * units. At statics, De Saxce's form of Coulomb's law is this problem: the slip is zero, so that the bipotential has no
 * coupling of normal and tangential rows (doi:10.1016/S0895-7177(98)00119-8; doi:10.1002/zamm.201000073).
 *
 * All forces with A p = c are p = p0 + Z x. The least p, p0, is in the range of A', and Z is an orthonormal basis of
 * the other directions. Rest exists if the largest margin is not negative:
 *
 *     maximise t    subject to    p0 + Z x - t e in K,    t <= cap
 *
 * The vector e is the axis of each cone, with the length 1 in the scaled norm. (x, t) always has interior points, so a
 * barrier method finds both maxima without a first phase, and A p = c holds to rounding in each of its points. The
 * margin is a continuous function of the load, and changes its sign where rest ends. Therefore events watch the margin.
 * All forces are measured in the largest force of p0, or in the largest least force: without a load, p0 is zero. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONE_STATICS_H
#define KT_CONE_STATICS_H

#include "base/arena.h"

#include <stdbool.h>

typedef enum kt_statics_type {
    KT_STATICS_NORMAL, /* one row, p >= l */
    KT_STATICS_CONE,   /* a normal row, then two tangential ones */
    KT_STATICS_DRY,    /* one row, |p| <= S */
    KT_STATICS_FREE,   /* one row of a loop, without a limit */
} kt_statics_type;

typedef struct kt_statics_item {
    kt_statics_type type;
    int row;         /* its first force */
    double friction; /* mu; of dry friction S */
    double least;    /* l */
    double metric;   /* w */
    int of;          /* of the caller */
} kt_statics_item;

/* Matrices are stored by rows. Vectors of the basis are stored one after the other. */
#define KT_STATICS_FIELDS(X)                                                                                           \
    X(kt_statics_item, item, rows, "items")                                                                            \
    X(double, p, rows, "forces")                                                                                       \
    X(int, equation, rows, "of the caller: of each force")                                                             \
    X(double, sign, rows, "likewise")                                                                                  \
    X(double, scale, rows, "of each force: the root of its item's weight")                                             \
    X(double, matrix, rows *columns, "A', a row for each force")                                                       \
    X(double, work, rows *columns, "scratch: its columns that remain")                                                 \
    X(double, basis, rows *rows, "orthonormal: first of the range of A', then Z")                                      \
    X(double, hessian, (rows + 1) * (rows + 1), "scratch, of x and t; its lower triangle by columns")                  \
    X(double, step, rows + 1, "scratch: Newton's step of x and t")                                                     \
    X(double, local, 4 * (rows + 1), "scratch: of each unknown, its part in an item; by rows")                         \
    X(double, next, rows, "scratch: forces after the step")                                                            \
    X(double, change, rows, "scratch: by which forces change")                                                         \
    X(int, pivot, rows, "scratch: of a matrix that is not symmetric")

typedef struct kt_statics {
    int n, rows, columns; /* items; forces; equations */
    int rank, nullity;    /* dimensions of the range, and of Z */
    double unit;          /* the largest force of p0, or least force, in the scaled norm */
    double margin;        /* the largest t, relative to `unit` */
    KT_ARENA_DECLARE(KT_STATICS_FIELDS)
} kt_statics;

/* The margin up to which t is maximised: forces with more reserve than that are not changed. */
static const double kt_statics_cap = 0.05;
/* The margin is exact up to this part of `unit`. Rest exists if the margin is no further below zero. */
static const double kt_statics_exact = 1e-9;

/* Bytes of a problem of so many forces and equations, and the problem, without items, in memory of that size. */
size_t kt_statics_size(size_t rows, size_t columns);
kt_statics *kt_statics_init(size_t rows, size_t columns, void *memory);
/* Adds an item, whose rows follow the rows of earlier items. A metric that is not positive counts as 1: no force moves
 * an item that other loops hold. */
kt_statics_item *kt_statics_add(kt_statics *statics, kt_statics_type type, double friction, double least,
                                double metric);

/* Finds p0 from forces p that satisfy A p = c. */
void kt_statics_begin(kt_statics *statics);
/* Finds p0 for a square A, and for c, which p has at first. A is W, which is symmetric, unless friction follows normal
 * forces. The caller checks the residual, since possibly no forces have A p = c. Returns false if a symmetric A is not
 * positive semidefinite, or if p0 is not found. */
bool kt_statics_begin_square(kt_statics *statics, bool symmetric);
/* Finds the largest margin, and forces p with this margin. */
void kt_statics_find_margin(kt_statics *statics);
/* Finds the least p in K, after kt_statics_find_margin. If the margin is not positive, p stays as it is. */
void kt_statics_find_least(kt_statics *statics);

/* Whether an item bounds the margin: others of these end at the same load. */
bool kt_statics_bounds_margin(const kt_statics *statics, int item);
/* A force of the problem. */
static inline double kt_statics_force(const kt_statics *statics, int row) {
    return statics->p[row] * (statics->unit > 0.0 ? statics->unit : 1.0) / statics->scale[row];
}

#endif
