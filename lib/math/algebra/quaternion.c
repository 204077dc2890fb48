/* The quaternion of a rotation matrix: Shepperd, "Quaternion from Rotation Matrix", J. Guidance and Control 1(3), 1978.
 *
 * The matrix of a quaternion (w, v) is
 *     R = I + 2 w v x + 2 v x v x,   w^2 + v'v = 1.
 * Sums and differences of entries give every product of two components:
 *     4 w w = 1 + R11 + R22 + R33     4 w x = R32 - R23     4 y z = R23 + R32
 *     4 x x = 1 + R11 - R22 - R33     4 w y = R13 - R31     4 x z = R13 + R31
 *     4 y y = 1 - R11 + R22 - R33     4 w z = R21 - R12     4 x y = R12 + R21
 *     4 z z = 1 - R11 - R22 + R33
 * The four products that hold the largest component are the quaternion times a factor of at least 2. Small components
 * come from small differences, so that their relative accuracy remains down to the smallest angles.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/algebra.h"

kt_quat kt_quat_from_mat3(kt_mat3 r) {
    const double r11 = r.x.x, r22 = r.y.y, r33 = r.z.z;
    const double wx = r.y.z - r.z.y, wy = r.z.x - r.x.z, wz = r.x.y - r.y.x;
    const double yz = r.y.z + r.z.y, xz = r.z.x + r.x.z, xy = r.x.y + r.y.x;
    const double trace = r11 + r22 + r33;
    kt_quat q;
    if (trace >= r11 && trace >= r22 && trace >= r33)
        q = kt_quat_make(1.0 + trace, wx, wy, wz);
    else if (r11 >= r22 && r11 >= r33)
        q = kt_quat_make(wx, 1.0 + r11 - r22 - r33, xy, xz);
    else if (r22 >= r33)
        q = kt_quat_make(wy, xy, 1.0 + r22 - r11 - r33, yz);
    else
        q = kt_quat_make(wz, xz, yz, 1.0 + r33 - r11 - r22);
    if (q.w < 0.0)
        q = kt_quat_make(-q.w, -q.x, -q.y, -q.z);
    return kt_quat_normalize(q);
}
