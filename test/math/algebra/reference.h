/* Rotations computed apart from the library, in complex long double and by other formulas. These are products of
 * elementary rotations, the exponential series, the Cayley transform and the quaternion sandwich. Complex numbers yield
 * f'(x) = Im f(x + i h) / h without any cancellation. With h = 1e-30, derivatives are therefore as exact as values
 * (Squire and Trapp, 1998). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ALGEBRA_REFERENCE_H
#define KT_TEST_ALGEBRA_REFERENCE_H

#include "check.h"

#include <complex.h>

#include "kinetree/algebra.h"

typedef long double complex kt_reference_number;

typedef struct kt_reference_matrix {
    kt_reference_number m[3][3];
} kt_reference_matrix;

/* A rotation from the parameters p; `sequence` is for Euler angles alone. */
typedef kt_reference_matrix kt_reference_rotation(int sequence, const kt_reference_number *p);

kt_reference_rotation kt_reference_euler;       /* three angles: a product of elementary rotations */
kt_reference_rotation kt_reference_exponential; /* Euler vector: the series of exp(theta x) */
kt_reference_rotation kt_reference_cgr; /* CGR: (I - g x / 2)^-1 (I + g x / 2); exp(2 atan(|g| / 2) n x) where large */
kt_reference_rotation kt_reference_sandwich;   /* quaternion of any norm: e -> q e q^-1 */
kt_reference_rotation kt_reference_axis_angle; /* axis, not normalised here, and angle: exp(angle axis x) */

kt_reference_matrix kt_reference_multiply(kt_reference_matrix a, kt_reference_matrix b);
kt_reference_matrix kt_reference_real(kt_reference_rotation *rotation, int sequence, const double *p, int count);
kt_mat3 kt_reference_rounded(kt_reference_matrix a);

/* Largest difference of two entries. */
double kt_reference_difference(kt_mat3 a, kt_reference_matrix b);

/* G has the columns ax(R_k R') in the reference frame, or ax(R' R_k) in the turned frame. R_k is the derivative of R by
 * parameter k. */
void kt_reference_map(kt_reference_rotation *rotation, int sequence, const double *p, int count, bool body,
                      long double map[3][4]);

/* ---- small helpers of the tests ---------------------------------------------------------------------------------- */

kt_vec3 kt_reference_column(kt_mat3 a, int i);
double kt_reference_component(kt_vec3 a, int i);
double kt_reference_entry(kt_mat3 a, int row, int col);

/* Largest entry of a - b, of A'A - I, and the largest entry. */
double kt_reference_distance(kt_mat3 a, kt_mat3 b);
double kt_reference_skewness(kt_mat3 a);
double kt_reference_largest(kt_mat3 a);

/* A direction times a length. */
kt_vec3 kt_reference_direction(kt_random *random, double length);

/* A rotation matrix, uniform, correctly rounded. */
kt_mat3 kt_reference_random(kt_random *random);

/* 10^uniform */
double kt_reference_magnitude(kt_random *random, double lowest_power, double highest_power);

#define KT_PI 3.14159265358979323846

#endif
