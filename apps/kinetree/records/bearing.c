/* Computes the wrench that a joint transmits by its structure alone.
 *
 * A coordinate of a joint moves the body by a twist (w, l). The wrench of effects and drives in the joint has power
 * only in these twists. If w is not zero, this wrench is a moment along w and is removed:
 *
 *     M <- M - a (a.M + p a.F),   a = w / |w|,   p = a.l / |w|, the pitch,
 *
 * If w is zero, this wrench is a force along l, which is removed. Oblique axes (of a universal joint) are made
 * orthogonal, so that each can be removed alone. The reference point of the moments does not matter, because it lies on
 * the free axes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "records/gravity.h"

#include "kinetree/joint.h"

static kt_vec3 column_rows_of(const double *column, int first) {
    return kt_vec3_make(column[first], column[first + 1], column[first + 2]);
}

static kt_vec3 without(kt_vec3 u, double amount, kt_vec3 along) { return kt_vec3_sub(u, kt_vec3_scale(amount, along)); }

kt_wrench kt_bearing_of(const kt_model *model, const kt_data *data, int body, kt_wrench reaction, double *jacobian) {
    const kt_coordinates at = kt_body_coordinates(model, body);
    kt_wrench rest = reaction;
    kt_vec3 axes[KT_JOINT_NV_MAX];
    int count = 0;
    if (at.nv == 0)
        return rest;
    kt_point_jacobian(model, data, body, kt_vec3_make(0.0, 0.0, 0.0), jacobian);
    for (int k = at.v; k < at.v + at.nv; k++) {
        const kt_vec3 l = column_rows_of(jacobian + 6 * (ptrdiff_t)k, 3);
        kt_vec3 w = column_rows_of(jacobian + 6 * (ptrdiff_t)k, 0);
        const bool turns = kt_vec3_norm(w) > 0.0;
        for (int i = 0; i < count; i++)
            w = without(w, kt_vec3_dot(w, axes[i]), axes[i]);
        const double turn = kt_vec3_norm(w), length = kt_vec3_norm(l);
        if (turns && turn > 1e-12) { /* of 1 */
            const kt_vec3 a = kt_vec3_scale(1.0 / turn, w);
            const double pitch = kt_vec3_dot(a, l) / turn;
            const double moment = kt_vec3_dot(a, reaction.moment) + pitch * kt_vec3_dot(a, reaction.force);
            rest.moment = without(rest.moment, moment, a);
            axes[count++] = a;
        } else if (!turns && length > 0.0) {
            const kt_vec3 a = kt_vec3_scale(1.0 / length, l);
            rest.force = without(rest.force, kt_vec3_dot(a, reaction.force), a);
        }
    }
    return rest;
}
