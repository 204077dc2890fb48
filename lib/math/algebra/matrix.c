/* Rotation about a coordinate axis [MSD A.1], and the rotation nearest to a matrix that is almost a rotation.
 *
 * The polar factor Q of A = Q S by the Newton-Schulz iteration A <- A (3 I - A'A) / 2 (Higham, Functions of Matrices,
 * 2008, 8.3). The iteration keeps the singular vectors. Each singular value changes by
 *     s <- s (3 - s^2) / 2:   s = 1 + e becomes 1 - 3 e^2 / 2 - e^3 / 2
 * A matrix whose A'A is exactly I is returned unchanged.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/algebra.h"

kt_mat3 kt_mat3_about(int axis, double angle) {
    const double c = cos(angle), s = sin(angle);
    kt_mat3 r = kt_mat3_identity();
    if (axis == 0) {
        r.y = kt_vec3_make(0.0, c, s);
        r.z = kt_vec3_make(0.0, -s, c);
    } else if (axis == 1) {
        r.z = kt_vec3_make(s, 0.0, c);
        r.x = kt_vec3_make(c, 0.0, -s);
    } else {
        r.x = kt_vec3_make(c, s, 0.0);
        r.y = kt_vec3_make(-s, c, 0.0);
    }
    return r;
}

kt_mat3 kt_mat3_orthonormalize(kt_mat3 a) {
    /* Six steps reach rounding from s = 0.71, where |A'A - I| is one half. Three steps are enough from 1e-3. */
    enum { STEPS = 6 };
    for (int step = 0; step < STEPS; step++) {
        kt_mat3 m = kt_mat3_scale(-0.5, kt_mat3_multiply(kt_mat3_transpose(a), a)); /* (3 I - A'A) / 2 */
        m.x.x += 1.5;
        m.y.y += 1.5;
        m.z.z += 1.5;
        a = kt_mat3_multiply(a, m);
    }
    return a;
}
