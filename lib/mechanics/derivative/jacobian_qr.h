/* The Jacobian A of all loops as one dense matrix, factored [MSD 7.33, 7.34]:
 *
 *     A' P = [Q1 Z] [R1; 0]
 *
 * The factors serve the linearised equations of mechanisms with few loops, and reductions without other factors
 * (stiffness.c, sensitivity/projection.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_JACOBIAN_QR_H
#define KT_DERIVATIVE_JACOBIAN_QR_H

#include "base/arena.h"
#include "constraint/group.h"

/* Every array: type, name, count, meaning; p equations in the order of the loops, of n coordinates. */
#define KT_JACOBIAN_QR_FIELDS(X)                                                                                       \
    X(double, factor, n *p, "A' factored")                                                                             \
    X(double, reflector_scale, n + p, "scales of the reflectors")                                                      \
    X(double, norm, p, "squared lengths of the equations")                                                             \
    X(double, weight, p, "by which independent equations are chosen")                                                  \
    X(int32_t, pivot, p, "order of the equations")                                                                     \
    X(double, basis, n *n, "orthogonal factor Q = [Q1 Z]")

typedef struct kt_jacobian_qr {
    size_t n, p;
    int rank;
    KT_ARENA_DECLARE(KT_JACOBIAN_QR_FIELDS)
} kt_jacobian_qr;

/* Returns the bytes of the arrays and, unless memory is NULL, initialises w in this memory. */
size_t kt_jacobian_qr_init(kt_jacobian_qr *w, void *memory, size_t n, size_t p);

/* Factors the equations of one kind among those of A (p x n). Among dependent equations, the choice is the same as in
 * evaluations and projections.
 *
 * Errors: KT_ERROR_SINGULAR if fewer equations are independent than at generic positions. Cost: O(n^2 p). */
KT_CHECKED kt_status kt_jacobian_qr_factor(kt_jacobian_qr *w, const kt_model *model, kt_rows rows, const double *a,
                                           kt_error *error);

/* Computes y = R1^-T e from p numbers e. Only the numbers of the independent equations are used, in the order of the
 * pivots. */
void kt_jacobian_qr_solve_lower(const kt_jacobian_qr *w, const double *e, double *y);

/* Computes the p multipliers with A' lambda = f. The multipliers of the independent equations follow from R1 lambda =
 * Q1' f; all others are zero. */
void kt_jacobian_qr_multipliers(const kt_jacobian_qr *w, const double *f, double *lambda);

/* The error of kt_jacobian_qr_factor. */
kt_status kt_jacobian_singular(kt_error *error);

#endif
