/* Changes of positions as rotations. A quaternion p changes by dp = p o (s, xi / 2), with its rotation xi in the body
 * frame and the change s of its norm. The rate of p p' = p o (0, w) / 2 is linear in both factors.
 *
 * For q+ = q (+) x, p+ = p o exp(x / 2) is a unit vector again, and
 *
 *     xi+ = exp(-x) xi + T(x) dx,   T(x) = 1 - (1 - cos r) / r^2 [x] + (r - sin r) / r^3 [x]^2,   r = |x|
 *
 * T is the right Jacobian of the exponential map. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"
#include "kinetree/joint.h"
#include "sensitivity/sensitivity.h"

void kt_tangent_drop(const kt_model *model, const double *q, const double *dq, double *xi) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            xi[link->v + k] = dq[link->q + k];
        if (!motion.quaternions)
            continue;
        const int at = link->q + motion.plain;
        kt_joint_store(xi + link->v + motion.plain,
                       kt_quat_angular_body(kt_joint_load_quaternion(q + at), kt_joint_load_quaternion(dq + at)));
    }
}

void kt_tangent_rate(const kt_model *model, const double *q, const double *v, const double *dq, const double *dv,
                     double *rate) {
    kt_position_rate(model, q, dv, rate);
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        if (!motion.quaternions)
            continue;
        double *p = rate + link->q + motion.plain;
        const kt_quat d = kt_quat_rate_body(kt_joint_load_quaternion(dq + link->q + motion.plain),
                                            kt_joint_load(v + link->v + motion.plain));
        p[0] += d.w;
        p[1] += d.x;
        p[2] += d.y;
        p[3] += d.z;
    }
}

/* T(x) dx; T(x)' = T(-x). */
static kt_vec3 rotation_tangent(kt_vec3 x, kt_vec3 dx) {
    const double r = kt_vec3_norm(x);
    const double first = r < 1e-3 ? 0.5 - r * r / 24.0 : (1.0 - cos(r)) / (r * r);
    const double second = r < 1e-2 ? 1.0 / 6.0 - r * r / 120.0 * (1.0 - r * r / 42.0) : (r - sin(r)) / (r * r * r);
    const kt_vec3 once = kt_vec3_cross(x, dx), twice = kt_vec3_cross(x, once);
    return kt_vec3_add(dx, kt_vec3_add(kt_vec3_scale(-first, once), kt_vec3_scale(second, twice)));
}

void kt_tangent_add(const kt_model *model, const double *x, const double *xi, const double *dx, double *out) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            out[link->v + k] = xi[link->v + k] + dx[link->v + k];
        if (!motion.quaternions)
            continue;
        const int at = link->v + motion.plain;
        const kt_vec3 turn = kt_joint_load(x + at);
        const kt_vec3 turned =
            kt_mat3_apply_transposed(kt_mat3_from_quat(kt_quat_from_euler_vector(turn)), kt_joint_load(xi + at));
        kt_joint_store(out + at, kt_vec3_add(turned, rotation_tangent(turn, kt_joint_load(dx + at))));
    }
}

/* ---- transposed -------------------------------------------------------------------------------------------------- */

void kt_tangent_add_transposed(const kt_model *model, const double *x, const double *by_out, double *by_xi,
                               double *by_dx) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            by_xi[link->v + k] = by_dx[link->v + k] = by_out[link->v + k];
        if (!motion.quaternions)
            continue;
        const int at = link->v + motion.plain;
        const kt_vec3 turn = kt_joint_load(x + at), y = kt_joint_load(by_out + at);
        kt_joint_store(by_xi + at, kt_mat3_apply(kt_mat3_from_quat(kt_quat_from_euler_vector(turn)), y));
        kt_joint_store(by_dx + at, rotation_tangent(kt_vec3_scale(-1.0, turn), y));
    }
}
