/* Quaternions among positions, of one state and, with KT_LANES, of several states at once (algebra/real3.h). The rates
 * of quaternions follow from velocities, and their norms become 1. Gradients by positions become gradients by rotations
 * xi in the body frame, or the reverse. A quaternion p changes by dp = p o (0, xi) / 2 (sensitivity/tangent.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_JOINT_TURN_H
#define KT_JOINT_TURN_H

#include "algebra/real.h"
#include "model/model.h"

#include <float.h>

typedef struct kt_turn {
    kt_real1 w, x, y, z;
} kt_turn;

/* The quaternion of a link, which follows its plain positions; NULL if it has none. */
KT_INLINE kt_real1 *kt_turn_of(const kt_link *link, kt_real1 *q) {
    const kt_motion_facts motion = kt_motion_facts_of(link->motion);
    return motion.quaternions ? q + link->q + motion.plain : NULL;
}

KT_INLINE kt_turn kt_turn_load(const kt_real1 *p) { return (kt_turn){p[0], p[1], p[2], p[3]}; }

KT_INLINE void kt_turn_store(kt_real1 *p, kt_turn a) {
    p[0] = a.w;
    p[1] = a.x;
    p[2] = a.y;
    p[3] = a.z;
}

KT_INLINE void kt_turn_add(kt_real1 *to, kt_turn a) {
    to[0] += a.w;
    to[1] += a.x;
    to[2] += a.y;
    to[3] += a.z;
}

KT_INLINE kt_real1 kt_turn_square(kt_turn p) { return p.w * p.w + p.x * p.x + p.y * p.y + p.z * p.z; }

KT_INLINE kt_turn kt_turn_multiply(kt_turn p, kt_turn q) {
    return (kt_turn){p.w * q.w - p.x * q.x - p.y * q.y - p.z * q.z, p.w * q.x + p.x * q.w + p.y * q.z - p.z * q.y,
                     p.w * q.y - p.x * q.z + p.y * q.w + p.z * q.x, p.w * q.z + p.x * q.y - p.y * q.x + p.z * q.w};
}

/* s p (0, w), with the products by 0 that functions for one state have, too. */
KT_INLINE kt_turn kt_turn_times(kt_turn p, kt_real1 s, const kt_real1 *w) {
    return kt_turn_multiply(p, (kt_turn){kt_real1_splat(0.0), s * w[0], s * w[1], s * w[2]});
}

/* The transpose of dp = p o (0, xi) / 2, applied to y: vec(conj(p) o y) / 2. */
KT_INLINE void kt_turn_lift(kt_turn p, kt_turn y, kt_real1 out[3]) {
    const kt_turn x = kt_turn_multiply((kt_turn){p.w, -p.x, -p.y, -p.z}, y);
    out[0] = 0.5 * x.x;
    out[1] = 0.5 * x.y;
    out[2] = 0.5 * x.z;
}

/* The coordinates of a body's joint. */
typedef struct kt_position_part {
    int q, v, plain; /* first position, first velocity, plain numbers of either */
    bool turns;      /* a quaternion follows the plain positions, three velocities the plain velocities */
} kt_position_part;

static inline kt_position_part kt_position_part_of(const kt_body_record *body) {
    const kt_joint_size *size = &kt_joint_sizes[body->type];
    const bool turns = size->nq > size->nv;
    return (kt_position_part){.q = body->q, .v = body->v, .plain = turns ? size->nq - 4 : size->nq, .turns = turns};
}

/* The rates of positions: velocities, and p (0, w) / 2. The result may be an input (position.c). */
KT_INLINE void kt_turns_rate(const kt_model *model, const kt_real1 *q, const kt_real1 *v, kt_real1 *out) {
    for (size_t i = model->n.body - 1; i > 0; i--) {
        const kt_position_part p = kt_position_part_of(&model->body[i]);
        const int turn = p.q + p.plain;
        if (p.turns)
            kt_turn_store(out + turn, kt_turn_times(kt_turn_load(q + turn), kt_real1_splat(0.5), v + p.v + p.plain));
        for (int k = p.plain - 1; k >= 0; k--)
            out[p.q + k] = v[p.v + k];
    }
}

KT_INLINE kt_condition kt_turn_is_off(kt_real1 square) { return kt_not(kt_abs1(square - 1.0) <= 4.0 * DBL_EPSILON); }

/* Scales quaternions to unit norm: each quaternion that is off by more than rounding, or all quaternions of a state if
 * one is off. Returns the states in which the norms of all quaternions are neither zero nor infinite. Other states are
 * unchanged. */
KT_INLINE kt_condition kt_turns_make_units(const kt_model *model, kt_real1 *q, bool each) {
    kt_condition off = kt_condition_false(), usual = kt_condition_true();
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_real1 *p = kt_turn_of(&model->link[i], q);
        if (!p)
            continue;
        const kt_real1 square = kt_turn_square(kt_turn_load(p));
        off |= kt_turn_is_off(square);
        usual &= (square > 1e-280) & (square < 1e280);
    }
    for (size_t i = 1; i < model->n.link && kt_is_anywhere(off & usual); i++) {
        kt_real1 *p = kt_turn_of(&model->link[i], q);
        if (!p)
            continue;
        const kt_real1 square = kt_turn_square(kt_turn_load(p)), s = 1.0 / kt_sqrt1(square);
        const kt_condition here = usual & (each ? kt_turn_is_off(square) : off);
        for (int k = 0; k < 4; k++)
            p[k] = KT_CHOOSE(here, s * p[k], p[k]);
    }
    return usual;
}

/* Adds the transpose of xi = 2 vec(p^-1 o dp), applied to by_xi: 2 p o (0, by_xi) / |p|^2. */
KT_INLINE void kt_turns_drop_transposed(const kt_model *model, const kt_real1 *q, const kt_real1 *by_xi,
                                        kt_real1 *by_q) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            by_q[link->q + k] += by_xi[link->v + k];
        if (!motion.quaternions)
            continue;
        const int at = link->q + motion.plain;
        const kt_turn p = kt_turn_load(q + at);
        kt_turn_add(by_q + at, kt_turn_times(p, 2.0 / kt_turn_square(p), by_xi + link->v + motion.plain));
    }
}

/* Adds the transpose of the rates of positions, by positions and velocities. */
KT_INLINE void kt_turns_rate_transposed(const kt_model *model, const kt_real1 *q, const kt_real1 *v,
                                        const kt_real1 *by_rate, kt_real1 *by_q, kt_real1 *by_v) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            by_v[link->v + k] += by_rate[link->q + k];
        if (!motion.quaternions)
            continue;
        const int at = link->q + motion.plain, w = link->v + motion.plain;
        const kt_turn y = kt_turn_load(by_rate + at);
        const kt_real1 back[3] = {-1.0 * v[w], -1.0 * v[w + 1], -1.0 * v[w + 2]};
        kt_real1 lifted[3];
        kt_turn_add(by_q + at, kt_turn_times(y, kt_real1_splat(0.5), back));
        kt_turn_lift(kt_turn_load(q + at), y, lifted);
        for (int k = 0; k < 3; k++)
            by_v[w + k] += lifted[k];
    }
}

/* The transpose of dp = p o (0, xi) / 2. */
KT_INLINE void kt_turns_lift_transposed(const kt_model *model, const kt_real1 *q, const kt_real1 *by_q,
                                        kt_real1 *by_xi) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = 0; k < motion.plain; k++)
            by_xi[link->v + k] = by_q[link->q + k];
        const int at = link->q + motion.plain;
        if (motion.quaternions)
            kt_turn_lift(kt_turn_load(q + at), kt_turn_load(by_q + at), by_xi + link->v + motion.plain);
    }
}

#endif
