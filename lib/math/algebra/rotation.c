/* A rotation as scene files and callers describe it: the constructors, and its checked evaluation. A matrix may deviate
 * from a rotation by the rounding of written numbers. Such a matrix is then replaced by the nearest rotation. Any other
 * matrix is an error, and the message suggests a correction.
 *
 * The check computes A'A - I. Let A = Q S, with Q the nearest rotation and S the stretch, so that A'A = S^2. Entries of
 * A'A - I up to 2e-6 are therefore stretches and shears up to 1e-6. A matrix with six decimals always passes. Its
 * entries have errors d up to 0.5e-6. Such errors change no entry of A'A by more than 2 sqrt(3) d. The change is
 * 1.7e-6, below the limit.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "kinetree/algebra.h"

#include <stddef.h>

/* The largest deviation of a norm or a length from 1. The product of a column with itself deviates twice as much. */
static const double QUATERNION_TOLERANCE = 1e-3, MATRIX_TOLERANCE = 1e-6;

/* The name of each type in scene files, and the count of its numbers. */
static const struct {
    const char *name;
    int count;
} types[] = {{"none", 0},   {"quaternion", 4}, {"rpy", 3},  {"euler", 3},
             {"vector", 3}, {"cgr", 3},        {"axis", 4}, {"matrix", 9}};

/* ---- constructors ------------------------------------------------------------------------------------------------ */

static kt_rotation make_rotation(kt_rotation_type type, double a, double b, double c, double d) {
    const kt_rotation r = {type, 0, {a, b, c, d, 0.0, 0.0, 0.0, 0.0, 0.0}};
    return r;
}

kt_rotation kt_rotation_quaternion(double w, double x, double y, double z) {
    return make_rotation(KT_ROTATION_QUATERNION, w, x, y, z);
}

kt_rotation kt_rotation_rpy(double roll, double pitch, double yaw) {
    return make_rotation(KT_ROTATION_RPY, roll, pitch, yaw, 0.0);
}

kt_rotation kt_rotation_euler(int sequence, double a, double b, double c) {
    kt_rotation r = make_rotation(KT_ROTATION_EULER, a, b, c, 0.0);
    r.sequence = sequence;
    return r;
}

kt_rotation kt_rotation_vector(kt_vec3 theta) {
    return make_rotation(KT_ROTATION_VECTOR, theta.x, theta.y, theta.z, 0.0);
}

kt_rotation kt_rotation_cgr(kt_vec3 cgr) { return make_rotation(KT_ROTATION_CGR, cgr.x, cgr.y, cgr.z, 0.0); }

kt_rotation kt_rotation_axis_angle(kt_vec3 axis, double angle) {
    return make_rotation(KT_ROTATION_AXIS_ANGLE, axis.x, axis.y, axis.z, angle);
}

kt_rotation kt_rotation_matrix(kt_mat3 m) {
    const kt_rotation r = {KT_ROTATION_MATRIX, 0, {m.x.x, m.y.x, m.z.x, m.x.y, m.y.y, m.z.y, m.x.z, m.y.z, m.z.z}};
    return r;
}

/* ---- evaluation -------------------------------------------------------------------------------------------------- */

static kt_status from_quaternion(const double *v, kt_mat3 *rotation, kt_error *error) {
    const kt_quat q = kt_quat_make(v[0], v[1], v[2], v[3]);
    const double norm = kt_hypot(kt_hypot(q.w, q.x), kt_hypot(q.y, q.z));
    if (!(fabs(norm - 1.0) <= QUATERNION_TOLERANCE))
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL,
                            "the quaternion [%g, %g, %g, %g] has norm %.9g, a rotation has norm 1 within %g: %s", q.w,
                            q.x, q.y, q.z, norm, QUATERNION_TOLERANCE,
                            norm > 0.0 ? "divide each number by the norm (scalar first: [w, x, y, z])"
                                       : "write [1, 0, 0, 0] for no rotation");
    *rotation = kt_mat3_from_quat(q);
    return KT_OK;
}

/* The entry of A'A - I that is farthest from zero. (If an entry off the diagonal overflows to NaN, a diagonal entry is
 * infinite.) */
static double worst_product(kt_mat3 a, int *row, int *col) {
    const kt_vec3 columns[3] = {a.x, a.y, a.z};
    double worst = 0.0;
    *row = *col = 0;
    for (int i = 0; i < 3; i++)
        for (int j = i; j < 3; j++) {
            const double off = kt_vec3_dot(columns[i], columns[j]) - (i == j ? 1.0 : 0.0);
            if (fabs(off) > fabs(worst)) {
                worst = off;
                *row = i;
                *col = j;
            }
        }
    return worst;
}

static kt_status from_matrix(const double *v, kt_mat3 *rotation, kt_error *error) {
    kt_mat3 a;
    a.x = kt_vec3_make(v[0], v[3], v[6]);
    a.y = kt_vec3_make(v[1], v[4], v[7]);
    a.z = kt_vec3_make(v[2], v[5], v[8]);
    int row, col;
    const double worst = worst_product(a, &row, &col);
    if (!(fabs(worst) <= 2.0 * MATRIX_TOLERANCE)) {
        if (row == col)
            return kt_error_set(
                error, KT_ERROR_ARGUMENT, NULL,
                "column %d of the rotation matrix has length %.9g, not 1 within %g: give its entries with "
                "at least six decimals, or describe the rotation by a quaternion",
                col + 1, sqrt(1.0 + worst), MATRIX_TOLERANCE);
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, NULL,
            "columns %d and %d of the rotation matrix are not at right angles within %g (their product is "
            "%.9g): give their entries with at least six decimals, or describe the rotation by a quaternion",
            row + 1, col + 1, MATRIX_TOLERANCE, worst);
    }
    if (kt_mat3_determinant(a) < 0.0)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, NULL,
            "the rotation matrix has determinant -1, so it mirrors: check the order of its columns (the axes "
            "of the turned frame, right-handed), or change the sign of one");
    *rotation = kt_mat3_orthonormalize(a);
    return KT_OK;
}

kt_status kt_rotation_evaluate(const kt_rotation *description, kt_mat3 *rotation, kt_error *error) {
    if (KT_IS_MISSING(error, description, rotation))
        return KT_ERROR_ARGUMENT;
    if (description == NULL || rotation == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL, "no rotation was given, or no place for its matrix");
    const int type = (int)description->type;
    const double *v = description->value;
    if (type < 0 || type >= (int)(sizeof types / sizeof *types))
        return kt_error_set(error, KT_ERROR_ARGUMENT, NULL,
                            "the rotation type %d does not exist: use one of the KT_ROTATION_ constants", type);
    for (int i = 0; i < types[type].count; i++)
        if (!isfinite(v[i]))
            return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL,
                                "number %d of the rotation '%s' is %g: give a finite number", i + 1, types[type].name,
                                v[i]);
    const kt_vec3 first = kt_vec3_make(v[0], v[1], v[2]);
    switch (description->type) {
    case KT_ROTATION_NONE:
        *rotation = kt_mat3_identity();
        return KT_OK;
    case KT_ROTATION_QUATERNION:
        return from_quaternion(v, rotation, error);
    case KT_ROTATION_RPY:
        *rotation = kt_mat3_from_rpy(first);
        return KT_OK;
    case KT_ROTATION_EULER:
        return kt_mat3_from_euler(description->sequence, first, rotation, error);
    case KT_ROTATION_VECTOR:
        *rotation = kt_mat3_from_euler_vector(first);
        return KT_OK;
    case KT_ROTATION_CGR:
        *rotation = kt_mat3_from_cgr(first);
        return KT_OK;
    case KT_ROTATION_AXIS_ANGLE:
        return kt_mat3_from_axis_angle(first, v[3], rotation, error);
    case KT_ROTATION_MATRIX:
        break;
    }
    return from_matrix(v, rotation, error);
}
