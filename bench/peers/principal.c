/* Principal axes by Jacobi's rotations (Golub & Van Loan, Matrix Computations, 4th ed., 8.5). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "principal.h"

/* About axis k the angle |t| <= pi/4 with
 *     tan 2t = 2 J_ij / (J_ii - J_jj)
 * clears J_ij. In the end each sweep squares the remaining off-diagonal terms. */
kt_quat kt_principal_axes(kt_sym3 inertia, kt_vec3 *moments) {
    enum { SWEEPS = 8 };
    kt_quat r = kt_quat_identity();
    kt_sym3 j = inertia;
    for (int turn = 0; turn < 3 * SWEEPS; turn++) {
        const int k = turn % 3;
        const double off[3] = {j.yz, j.xz, j.xy}, diagonal[3] = {j.xx, j.yy, j.zz};
        const double more = diagonal[(k + 1) % 3] - diagonal[(k + 2) % 3];
        const double half = 0.25 * atan2(copysign(2.0, more) * off[k], fabs(more)); /* t/2, as a quaternion wants it */
        const double s = sin(half);
        r = kt_quat_normalize(
            kt_quat_multiply(r, kt_quat_make(cos(half), k == 0 ? s : 0.0, k == 1 ? s : 0.0, k == 2 ? s : 0.0)));
        j = kt_sym3_rotate(kt_mat3_from_quat(kt_quat_conjugate(r)), inertia);
    }
    *moments = kt_vec3_make(j.xx, j.yy, j.zz);
    return r;
}
