/* The joints' algebra on positions. Every position except a quaternion is a plain number; a quaternion p moves by
 *   p' = 1/2 p (0, w) [MSD A.36],   p (+) d = p exp(d / 2)
 *
 * with w and d in the body frame. In a joint with a quaternion, the plain numbers come first.
 *
 * An output may be any of the inputs. A body has no fewer positions than velocities, and both follow each other in the
 * order of the bodies. Thus the index of a body's first position is not below the index of its first velocity.
 * Therefore positions are written from the last to the first, and velocities from the first to the last, so that no
 * number is overwritten before it has been read. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "joint/joint.h"
#include "joint/turn.h"
#include "kinetree/joint.h"

#include <string.h>

static void store_quaternion(double *p, kt_quat a) {
    p[0] = a.w;
    p[1] = a.x;
    p[2] = a.y;
    p[3] = a.z;
}

/* out = p (+) d, a quaternion; out may be p or d. */
static void add_rotation(const double *p, const double *d, double *out) {
    store_quaternion(out, kt_quat_normalize(kt_quat_multiply(kt_joint_load_quaternion(p),
                                                             kt_quat_from_euler_vector(kt_joint_load(d)))));
}

void kt_position_rate(const kt_model *model, const double *q, const double *v, double *qdot) {
    if (!model || !q || !v || !qdot)
        return;
    kt_turns_rate(model, q, v, qdot);
}

void kt_position_add(const kt_model *model, const double *q, const double *dv, double *out) {
    if (!model || !q || !dv || !out)
        return;
    for (size_t i = model->n.body - 1; i > 0; i--) {
        const kt_position_part p = kt_position_part_of(&model->body[i]);
        if (p.turns)
            add_rotation(q + p.q + p.plain, dv + p.v + p.plain, out + p.q + p.plain);
        for (int k = p.plain - 1; k >= 0; k--)
            out[p.q + k] = q[p.q + k] + dv[p.v + k];
    }
}

void kt_position_move(const kt_model *model, const bool *held, const double *q, const double *dv, double *out) {
    if (model->n.q == model->n.v) { /* without quaternions, a position and its rate have one index */
        for (size_t i = 0; i < model->n.q; i++)
            out[i] = dv[i] != 0.0 && !(held && held[i]) ? q[i] + dv[i] : q[i];
        return;
    }
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        const int v = link->v, rotation = v + motion.plain, first = link->q + motion.plain;
        bool moves = false;
        for (int k = 0; k < motion.velocities; k++)
            moves |= dv[v + k] != 0.0;
        const bool plain = moves && !(held && held[v]);
        for (int k = 0; k < motion.plain; k++)
            out[link->q + k] = plain ? q[link->q + k] + dv[v + k] : q[link->q + k];
        if (motion.quaternions && moves && !(held && held[rotation]))
            add_rotation(q + first, dv + rotation, out + first);
        else if (motion.quaternions)
            memmove(out + first, q + first, 4 * sizeof *q);
    }
}

void kt_position_subtract(const kt_model *model, const double *end, const double *q, double *dv) {
    if (!model || !end || !q || !dv)
        return;
    for (size_t i = 1; i < model->n.body; i++) {
        const kt_position_part p = kt_position_part_of(&model->body[i]);
        for (int k = 0; k < p.plain; k++)
            dv[p.v + k] = end[p.q + k] - q[p.q + k];
        if (!p.turns)
            continue;
        const kt_quat from = kt_quat_conjugate(kt_joint_load_quaternion(q + p.q + p.plain));
        const kt_quat to = kt_joint_load_quaternion(end + p.q + p.plain);
        kt_joint_store(dv + p.v + p.plain, kt_euler_vector_from_quat(kt_quat_multiply(from, to)));
    }
}
