/* The axes of an inertia in MuJoCo's order, since some frames of MJCF have these axes: of free bodies with `align`, and
 * of the drag of a medium.
 *
 * MuJoCo turns the axes by Jacobi rotations of a quaternion. Each annuls the largest entry D_rc off the diagonal of
 * D = R' S R, with the smaller of two angles a:
 *     t = tan a = sign(tau) / (|tau| + sqrt(1 + tau^2)),   tau = (D_cc - D_rr) / (2 D_rc).
 * The iteration stops when that entry is of the size of rounding. Quarter turns then sort the moments, the largest
 * first; equal ones keep their order. Source: user_util.cc. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf_axes.h"

#include <math.h>

static const double axes_enough = 1e-15; /* of the sum of the moments */

/* An entry of R' S R. */
static double turned_entry(kt_sym3 s, kt_vec3 a, kt_vec3 b) { return kt_vec3_dot(a, kt_sym3_apply(s, b)); }

/* The quaternion of a rotation about an axis with the sine of half its angle. */
static kt_quat quat_about(int axis, double cosine, double sine) {
    return kt_quat_make(cosine, axis == 0 ? sine : 0.0, axis == 1 ? sine : 0.0, axis == 2 ? sine : 0.0);
}

/* Makes one rotation; returns false if no rotation is needed. On return, `moments` are those before the rotation. */
static bool turn_axes(kt_sym3 s, kt_quat *q, double moments[3]) {
    const kt_mat3 r = kt_mat3_from_quat(*q);
    const double d01 = turned_entry(s, r.x, r.y), d02 = turned_entry(s, r.x, r.z), d12 = turned_entry(s, r.y, r.z);
    kt_moments_about(s, r, moments);
    const int axis = fabs(d01) > fabs(d02) && fabs(d01) > fabs(d12) ? 2 : fabs(d02) > fabs(d12) ? 1 : 0;
    const int row = axis == 0 ? 1 : 0, column = axis == 2 ? 1 : 2;
    const double entry = axis == 2 ? d01 : axis == 1 ? d02 : d12;
    if (fabs(entry) <= axes_enough * (moments[0] + moments[1] + moments[2]))
        return false;
    const double tau = (moments[column] - moments[row]) / (2.0 * entry);
    const double t = 1.0 / (fabs(tau) + sqrt(1.0 + tau * tau)), cosine = 1.0 / sqrt(1.0 + t * t);
    const double half = t * cosine / sqrt(2.0 + 2.0 * cosine), sine = (tau >= 0.0) == (axis != 1) ? -half : half;
    *q = kt_quat_normalize(kt_quat_multiply(*q, quat_about(axis, sqrt(1.0 - sine * sine), sine)));
    return true;
}

kt_mat3 kt_mjcf_axes(kt_sym3 inertia) {
    kt_quat q = kt_quat_make(1.0, 0.0, 0.0, 0.0);
    double moments[3] = {0.0, 0.0, 0.0};
    const double equal = 1e-12; /* as in MuJoCo, kg m^2 */
    for (int i = 0; i < 500 && turn_axes(inertia, &q, moments); i++)
        continue;
    for (int pass = 0; pass < 3; pass++) {
        const int i = pass % 2;
        const double first = moments[i], half = sqrt(0.5);
        if (!(first + equal < moments[i + 1]))
            continue;
        moments[i] = moments[i + 1];
        moments[i + 1] = first;
        q = kt_quat_normalize(kt_quat_multiply(q, quat_about((i + 2) % 3, half, half)));
    }
    return kt_mat3_from_quat(q);
}

kt_mat3 kt_mjcf_axes_of_body(const kt_mjcf_body *b) {
    return b->has_axes ? b->inertial.rotation : kt_mjcf_axes(b->inertia);
}

bool kt_mjcf_has_doubtful_axes(const kt_mjcf_body *b) {
    double moments[3];
    kt_moments_about(b->inertia, kt_mjcf_axes_of_body(b), moments);
    for (int i = 0; i < 3; i++)
        if (b->has_mesh && fabs(moments[i] - moments[(i + 1) % 3]) <= 1e-5 * moments[i])
            return true;
    return false;
}
