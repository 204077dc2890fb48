/* Cayley-Gibbs-Rodrigues parameters g = 2 tan(angle / 2) axis [MSD A.17].
 *
 * With the unit quaternion (w, v), g = 2 v / w; so (2, g) is that quaternion but for a factor, and
 *     R = I + 4 / (4 + g'g) (g x + g x g x / 2)                                             [MSD A.18]
 * is R(w, v). As w^2 = 4 / (4 + g'g),
 *     G = 4 / (4 + g'g) (I + g x / 2) = w^2 I + w v x                                      [MSD A.30]
 * which neither overflows nor loses the small terms. The inverse follows from a product:
 *     (I + g x / 2) (I - g x / 2 + g g' / 4) = (1 + g'g / 4) I
 *     G^-1 = I - g x / 2 + g g' / 4.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "kinetree/algebra.h"

#include <float.h>
#include <stddef.h>

static kt_quat quat_from_cgr(kt_vec3 g) { return kt_quat_normalize(kt_quat_make(2.0, g.x, g.y, g.z)); }

kt_mat3 kt_mat3_from_cgr(kt_vec3 g) { return kt_mat3_from_quat(quat_from_cgr(g)); }

kt_status kt_cgr_from_mat3(kt_mat3 rotation, kt_vec3 *cgr, kt_error *error) {
    if (KT_IS_MISSING(error, cgr))
        return KT_ERROR_ARGUMENT;
    if (!kt_mat3_is_finite(rotation))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the rotation matrix has an entry that is not finite");
    const kt_quat q = kt_quat_from_mat3(rotation);
    if (q.w <= 4.0 * DBL_EPSILON)
        return kt_error_set(error, KT_ERROR_SINGULAR, NULL,
                            "a rotation by half a turn, about [%g, %g, %g], has no Cayley-Gibbs-Rodrigues parameters "
                            "(they are infinite): use a quaternion or an Euler vector",
                            q.x, q.y, q.z);
    *cgr = kt_vec3_scale(2.0 / q.w, kt_vec3_make(q.x, q.y, q.z));
    return KT_OK;
}

kt_mat3 kt_cgr_map(kt_vec3 g) {
    const kt_quat q = quat_from_cgr(g);
    kt_mat3 map = kt_mat3_skew(kt_vec3_make(q.w * q.x, q.w * q.y, q.w * q.z));
    map.x.x = map.y.y = map.z.z = q.w * q.w;
    return map;
}

kt_mat3 kt_cgr_map_inverse(kt_vec3 g) {
    const kt_vec3 h = kt_vec3_scale(0.5, g);
    kt_mat3 m;
    m.x = kt_vec3_make(1.0 + h.x * h.x, h.x * h.y - h.z, h.x * h.z + h.y);
    m.y = kt_vec3_make(h.x * h.y + h.z, 1.0 + h.y * h.y, h.y * h.z - h.x);
    m.z = kt_vec3_make(h.x * h.z - h.y, h.y * h.z + h.x, 1.0 + h.z * h.z);
    return m;
}
