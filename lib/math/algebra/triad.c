/* A right-handed triad about a given axis.
 *
 * Let z be the coordinate axis nearest to the unit vector n = (u, v, w), in cyclically renamed coordinates, so that
 * |w| >= |u|, |v|. With s = sign(w), the least rotation that takes s z onto n takes the triad (x, s y, s z) to
 *     t1 = (1 - u^2 / (1 + |w|),  -u v s / (s + w),   -s u)
 *     t2 = (-u v / (s + w),       s - v^2 / (s + w),  -v)
 *     n  = (u, v, w)
 * (Duff et al., "Building an Orthonormal Basis, Revisited", J. Computer Graphics Techniques 6(1), 2017). As
 * |s + w| = 1 + |w| > 1.5, nothing cancels.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/algebra.h"

/* Sums turn -0 into 0. An axis along a coordinate axis therefore gives the same bits for any signs of its zeros. */
static kt_vec3 from_renamed(int m, double u, double v, double w) {
    double a[3];
    a[(m + 1) % 3] = u + 0.0;
    a[(m + 2) % 3] = v + 0.0;
    a[m] = w + 0.0;
    return kt_vec3_make(a[0], a[1], a[2]);
}

kt_mat3 kt_triad_from_axis(kt_vec3 axis, int which) {
    if (which < 0 || which > 2)
        return kt_mat3_scale((double)NAN, kt_mat3_identity());
    const double n[3] = {axis.x, axis.y, axis.z};
    int m = which;
    for (int k = 1; k < 3; k++) {
        const int other = (which + k) % 3;
        if (fabs(n[other]) > fabs(n[m]))
            m = other;
    }
    const double u = n[(m + 1) % 3], v = n[(m + 2) % 3], w = n[m];
    const double s = copysign(1.0, w), k = -1.0 / (s + w), b = u * v * k;
    const kt_vec3 t1 = from_renamed(m, 1.0 + s * u * u * k, s * b, -s * u);
    const kt_vec3 t2 = from_renamed(m, b, s + v * v * k, -v);
    const kt_vec3 t3 = from_renamed(m, u, v, w);
    kt_mat3 triad = {t1, t2, t3}; /* which = 2 */
    if (which == 0)
        triad = (kt_mat3){t3, t1, t2};
    else if (which == 1)
        triad = (kt_mat3){t2, t3, t1};
    return triad;
}
