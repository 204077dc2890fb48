/* The twelve sequences of Euler angles, R = Ri(a) Rj(b) Rk(c), and roll, pitch, yaw [MSD A.1.1, A.2.1].
 *
 * Let m be the axis that is neither i nor j, and e = +1 if (i, j, m) is cyclic, else -1. Then (i, j, e m) is a
 * right-handed triad. Let C be R in its components: a signed permutation of the entries, so exact. The sequence reads
 *     1-2-1 where k = i:   C = R1(a) R2(b) R1(c)
 *     1-2-3 where k = m:   C = R1(a) R2(b) R3(e c)
 * Only these two sequences have to be inverted. For 1-2-1
 *     C11 = cos b,  (C21, C31) = sin b (sin a, -cos a),   (C12, C13) = sin b (sin c, cos c)
 * and for 1-2-3
 *     C13 = sin b,  (C23, C33) = cos b (-sin a, cos a),   (C12, C11) = cos b (-sin(e c), cos(e c))
 * If the common factor is large, these entries give a and c with their relative accuracy. If the factor is small, a and
 * c are noise. Then the second row of R1(-a) C gives the c that belongs to this a, so that the angles reproduce the
 * rotation:
 *     cos a (C21, C22, C23) + sin a (C31, C32, C33) = (0, cos c, -sin c)  or  (sin(e c), cos(e c), 0)
 * At the singular middle angle c = 0 is chosen, and the second column of R1(a) R2(b), (0, cos a, sin a), gives a.
 *
 * omega = adot ei + bdot Ri(a) ej + cdot Ri(a) Rj(b) ek: the columns of G, g1 g2 g3. In the axes turned by Ri(a), the
 * columns are ei, ej and Rj(b) ek. So det G is -sin b for k = i, and e cos b for k = m. As g2 is normal to the two
 * others, the rows of the inverse are (g2 x g3) / det, g2 and (g1 x g2) / det.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/vector_parts.h"
#include "base/require.h"
#include "kinetree/algebra.h"

#include <float.h>
#include <stddef.h>

static const double PI = 3.14159265358979323846;
static const double SINGULAR = 16.0 * DBL_EPSILON;

typedef struct axes { /* as above: axes from 0 to 2, and the sign e */
    int i, j, k;
    double e;
    bool proper; /* 1-2-1, k = i; else 1-2-3, k = m */
} axes;

static bool axes_of(int sequence, axes *a) {
    a->i = sequence / 100 - 1;
    a->j = sequence / 10 % 10 - 1;
    a->k = sequence % 10 - 1;
    if (a->i < 0 || a->i > 2 || a->j < 0 || a->j > 2 || a->k < 0 || a->k > 2 || a->i == a->j || a->j == a->k)
        return false;
    a->e = a->j == (a->i + 1) % 3 ? 1.0 : -1.0;
    a->proper = a->k == a->i;
    return true;
}

static kt_status unknown_sequence(int sequence, kt_error *error) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, NULL,
                        "the Euler sequence %d is none of 121 123 131 132 212 213 231 232 312 313 321 323: give three "
                        "axes from 1 to 3, none twice in a row",
                        sequence);
}

static kt_status check_euler_angles(int sequence, kt_vec3 angles, axes *a, kt_error *error) {
    if (!axes_of(sequence, a))
        return unknown_sequence(sequence, error);
    if (!kt_vec3_is_finite(angles))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the Euler angles [%g, %g, %g] are not finite", angles.x,
                            angles.y, angles.z);
    return KT_OK;
}

/* ---- angles to matrix and back ----------------------------------------------------------------------------------- */

static kt_mat3 compose_euler_rotation(const axes *a, kt_vec3 angles) {
    const kt_mat3 rj_rk = kt_mat3_multiply(kt_mat3_about(a->j, angles.y), kt_mat3_about(a->k, angles.z));
    return kt_mat3_multiply(kt_mat3_about(a->i, angles.x), rj_rk);
}

/* C: the components of R in the triad (i, j, e m). */
static void to_canonical(const axes *a, kt_mat3 r, double c[3][3]) {
    const int axis[3] = {a->i, a->j, 3 - a->i - a->j};
    const double sign[3] = {1.0, 1.0, a->e};
    for (int col = 0; col < 3; col++) {
        const kt_vec3 v = kt_mat3_column(r, axis[col]);
        const double u[3] = {v.x, v.y, v.z};
        for (int row = 0; row < 3; row++)
            c[row][col] = sign[row] * sign[col] * u[axis[row]];
    }
}

/* The angles of a rotation, by the entries of C that the top of this file lists. */
static kt_vec3 angles_of(const axes *s, kt_mat3 r, bool *singular) {
    double c[3][3];
    to_canonical(s, r, c);
    /* lever: |sin b| or |cos b|, which multiplies the sine and cosine of a and c */
    const double sin_a = s->proper ? c[1][0] : -c[1][2], cos_a = s->proper ? -c[2][0] : c[2][2];
    const double lever = kt_hypot(sin_a, cos_a);
    const double b = s->proper ? atan2(lever, c[0][0]) : atan2(c[0][2], lever);
    *singular = lever <= SINGULAR;
    if (*singular)
        return kt_vec3_make(atan2(c[2][1], c[1][1]), s->proper ? rint(b / PI) * PI : copysign(0.5 * PI, b), 0.0);
    const double a = atan2(sin_a, cos_a);
    double third; /* c or e c */
    if (lever > 0.5) {
        third = s->proper ? atan2(c[0][1], c[0][2]) : atan2(-c[0][1], c[0][0]);
    } else {
        const double ca = cos(a), sa = sin(a), cos_c = ca * c[1][1] + sa * c[2][1];
        const double sin_c = s->proper ? -(ca * c[1][2] + sa * c[2][2]) : ca * c[1][0] + sa * c[2][0];
        third = atan2(sin_c, cos_c);
    }
    return kt_vec3_make(a, b, s->proper ? third : s->e * third);
}

kt_status kt_mat3_from_euler(int sequence, kt_vec3 angles, kt_mat3 *rotation, kt_error *error) {
    if (KT_IS_MISSING(error, rotation))
        return KT_ERROR_ARGUMENT;
    axes a;
    const kt_status status = check_euler_angles(sequence, angles, &a, error);
    if (status == KT_OK)
        *rotation = compose_euler_rotation(&a, angles);
    return status;
}

kt_status kt_euler_from_mat3(int sequence, kt_mat3 rotation, kt_vec3 *angles, bool *singular, kt_error *error) {
    if (KT_IS_MISSING(error, angles))
        return KT_ERROR_ARGUMENT;
    axes a;
    if (!axes_of(sequence, &a))
        return unknown_sequence(sequence, error);
    if (!kt_mat3_is_finite(rotation))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the rotation matrix has an entry that is not finite");
    bool at_singularity;
    *angles = angles_of(&a, rotation, &at_singularity);
    if (singular != NULL)
        *singular = at_singularity;
    return KT_OK;
}

/* ---- rates to angular velocity and back -------------------------------------------------------------------------- */

/* G: omega = G (adot, bdot, cdot). */
static kt_mat3 euler_rate_map(const axes *a, kt_vec3 angles) {
    const kt_mat3 identity = kt_mat3_identity(), ri = kt_mat3_about(a->i, angles.x);
    kt_mat3 g;
    g.x = kt_mat3_column(identity, a->i);
    g.y = kt_mat3_column(ri, a->j);
    g.z = kt_mat3_apply(ri, kt_mat3_column(kt_mat3_about(a->j, angles.y), a->k));
    return g;
}

kt_status kt_euler_map(int sequence, kt_vec3 angles, kt_mat3 *map, kt_error *error) {
    if (KT_IS_MISSING(error, map))
        return KT_ERROR_ARGUMENT;
    axes a;
    const kt_status status = check_euler_angles(sequence, angles, &a, error);
    if (status == KT_OK)
        *map = euler_rate_map(&a, angles);
    return status;
}

kt_status kt_euler_map_inverse(int sequence, kt_vec3 angles, kt_mat3 *inverse, kt_error *error) {
    if (KT_IS_MISSING(error, inverse))
        return KT_ERROR_ARGUMENT;
    axes a;
    const kt_status status = check_euler_angles(sequence, angles, &a, error);
    if (status != KT_OK)
        return status;
    const double determinant = a.proper ? -sin(angles.y) : a.e * cos(angles.y);
    if (fabs(determinant) <= SINGULAR * fmax(1.0, fabs(angles.y)))
        return kt_error_set(
            error, KT_ERROR_SINGULAR, NULL,
            "at the middle angle %.17g rad the first and third axes of Euler sequence %d fall together: use "
            "a quaternion, or a sequence whose %s",
            angles.y, sequence, a.proper ? "three axes differ" : "first and third axes are the same");
    const kt_mat3 g = euler_rate_map(&a, angles);
    kt_mat3 rows;
    rows.x = kt_vec3_scale(1.0 / determinant, kt_vec3_cross(g.y, g.z));
    rows.y = g.y;
    rows.z = kt_vec3_scale(1.0 / determinant, kt_vec3_cross(g.x, g.y));
    *inverse = kt_mat3_transpose(rows);
    return KT_OK;
}

/* ---- roll, pitch, yaw: sequence 321 backwards -------------------------------------------------------------------- */

static kt_vec3 backwards(kt_vec3 a) { return kt_vec3_make(a.z, a.y, a.x); }

static const axes yaw_pitch_roll = {2, 1, 0, -1.0, false};

kt_mat3 kt_mat3_from_rpy(kt_vec3 rpy) { return compose_euler_rotation(&yaw_pitch_roll, backwards(rpy)); }

kt_vec3 kt_rpy_from_mat3(kt_mat3 rotation, bool *singular) {
    bool at_singularity;
    const kt_vec3 found = angles_of(&yaw_pitch_roll, rotation, &at_singularity);
    if (singular != NULL)
        *singular = at_singularity;
    return backwards(found);
}

kt_mat3 kt_rpy_map(kt_vec3 rpy) {
    const kt_mat3 g = euler_rate_map(&yaw_pitch_roll, backwards(rpy));
    kt_mat3 map;
    map.x = g.z;
    map.y = g.y;
    map.z = g.x;
    return map;
}

kt_status kt_rpy_map_inverse(kt_vec3 rpy, kt_mat3 *inverse, kt_error *error) {
    if (KT_IS_MISSING(error, inverse))
        return KT_ERROR_ARGUMENT;
    const kt_status status = kt_euler_map_inverse(321, backwards(rpy), inverse, error);
    if (status == KT_OK) {
        inverse->x = backwards(inverse->x);
        inverse->y = backwards(inverse->y);
        inverse->z = backwards(inverse->z);
    }
    return status;
}
