/* The inverse of a mass matrix, and the memory that operational-space inertia takes. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONTROL_MASS_INVERSE_H
#define KT_CONTROL_MASS_INVERSE_H

#include "derivative/kkt.h"
#include "dynamics/aba_inverse.h"
#include "kinetree/control.h"

/* Every array: type, name, count, meaning.
 *
 * closed: v with loops and dense factors, otherwise 0.
 *
 * along, data: with loops and factors along the tree, the bytes of kkt.h and of the data that kkt.h needs. */
#define KT_MASS_INVERSE_FIELDS(X)                                                                                      \
    X(char, terms, s->terms, "of a tree")                                                                              \
    X(char, along, s->along, "of `kkt`")                                                                               \
    X(char, memory, s->data, "of its data, which keep the factors")                                                    \
    X(double, basis, s->closed * s->closed, "Z, nv x dofs")                                                            \
    X(double, mass, s->closed * s->closed, "M")                                                                        \
    X(double, reduced, s->closed * s->closed, "Z' M Z, factored")                                                      \
    X(double, half, s->closed, "M z; Z' x")                                                                            \
    X(double, size, s->closed, "the scale of rounding errors of its diagonal")                                         \
    X(double, column, s->rows * s->v, "M^-1 J'")                                                                       \
    X(double, task, s->rows * s->rows, "J M^-1 J', factored")                                                          \
    X(double, inertia, s->rows * s->rows, "its inverse")                                                               \
    X(double, free_fraction, s->rows, "the part of a row that the loops leave free")                                   \
    X(double, unit, s->rows ? s->v : 0, "a large change of each coordinate")                                           \
    X(double, generic, s->rows ? s->v : 0, "a row of the same size as one of J; a row of X")

struct kt_mass_inverse {
    void *owned; /* memory of kt_mass_inverse_create, or NULL */
    const kt_model *model;
    bool has_terms; /* the object holds terms */
    int rows;       /* most of a Jacobian */
    int dofs;       /* columns of Z */
    kt_inverse_terms of_tree;
    kt_kkt kkt;
    KT_ARENA_DECLARE(KT_MASS_INVERSE_FIELDS)
};

/* x (nv x columns, finite) becomes M^-1 x. Requires the terms at this position. */
void kt_mass_inverse_columns(kt_mass_inverse *inverse, int columns, double *x);

#endif
