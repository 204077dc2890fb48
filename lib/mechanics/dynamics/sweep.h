/* Forward pass from the ground to the tips: a link's motion from its parent's.
 *
 * Vectors are in world axes, each link about its own origin; r = origin minus the parent's origin. Accelerations are
 * classical (not spatial) ones of the origins. So the shift from parent to child is
 *   alpha = alpha_p + c_n + [alpha of the joint]
 *   a     = a_p + alpha_p x r + c_f + [a of the joint]
 *   c_n   = w_p x (joint's angular velocity)
 *   c_f   = w_p x (w_p x r) + 2 w_p x (joint's linear velocity)
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_SWEEP_H
#define KT_DYNAMICS_SWEEP_H

#include "algebra/sincos.h"
#include "dynamics/joint_motion.h"

#include <string.h>

/* Whether a recursion of one state ends because a joint has no inertia. For several states the recursion goes on.
 * data->sound excludes the states without inertia, whose results are invalid. */
KT_OPERATOR bool kt_is_rejected(void *data, kt_condition has_inertia) {
#ifdef KT_LANES
    ((kt_data *)data)->sound &= has_inertia;
    return false;
#else
    (void)data;
    return !has_inertia;
#endif
}

/* Prefetches memory that a sweep reaches a few links later. This makes a mechanism faster that exceeds the caches
 * (model->exceeds_caches): processors prefetch few arrays at a time, and backward passes less well. If a cache holds
 * the mechanism, prefetching does not help. */
enum { KT_LINKS_AHEAD = 8 };

KT_INLINE void kt_fetch(const void *memory, size_t size) {
#ifdef __OPTIMIZE_SIZE__
    (void)memory, (void)size;
#else
    for (size_t at = 0; at < size; at += KT_ARENA_ALIGNMENT)
        __builtin_prefetch((const char *)memory + at);
#endif
}

/* Returns the link KT_LINKS_AHEAD links after link i, but at most the last link before `end`; in backward passes, the
 * link as many before, but at least 0. */
KT_INLINE size_t kt_ahead(size_t i, size_t end) { return i + KT_LINKS_AHEAD < end ? i + KT_LINKS_AHEAD : i; }
KT_INLINE size_t kt_ahead_down(size_t i) { return i > KT_LINKS_AHEAD ? i - KT_LINKS_AHEAD : 0; }

KT_INLINE void kt_link_fetch(const kt_model *model, const kt_data *data, size_t i) {
    kt_fetch(&model->link[i], sizeof *model->link);
    kt_fetch(&data->motion[i], sizeof *data->motion);
}

/* Velocity of one link and its velocity-product accelerations c_n (in alpha) and c_f (in linear). */
KT_INLINE void kt_link_velocity(const kt_link *link, const kt_link_motion *parent, const kt_real1 *v,
                                kt_link_motion *out) {
    const kt_real3 w = parent->omega, around = kt_cross3(w, kt_cross3(w, out->offset));
    if (kt_link_is_revolute(link)) { /* the most frequent motion, without terms that it does not need */
        const kt_real3 rate = kt_scale3(v[link->v], kt_link_axis(link, out));
        out->omega = kt_add3(w, rate);
        out->alpha = kt_cross3(w, rate);
        out->linear = around;
        return;
    }
    kt_real3 angular, linear;
    kt_joint_twist(link, parent, out, v, &angular, &linear);
    out->omega = kt_add3(w, angular);
    out->alpha = kt_cross3(w, angular);
    out->linear = kt_add_scaled3(around, kt_real1_splat(2.0), kt_cross3(w, linear));
}

/* From c_n, c_f to the full accelerations, for joint accelerations a. */
KT_INLINE void kt_link_acceleration(const kt_link *link, const kt_link_motion *parent, const kt_real1 *a,
                                    kt_link_motion *out) {
    kt_real3 angular, linear;
    kt_joint_twist(link, parent, out, a, &angular, &linear);
    out->alpha = kt_add3(out->alpha, kt_add3(parent->alpha, angular));
    out->linear = kt_add3(out->linear, kt_add3(kt_add3(parent->linear, kt_cross3(parent->alpha, out->offset)), linear));
}

/* The gravity of a state's model. */
KT_OPERATOR kt_real3 kt_gravity3(const kt_model *model, const kt_data *data) {
#ifdef KT_LANES
    (void)model;
    return *data->gravity;
#else
    (void)data;
    return model->gravity;
#endif
}

/* The ground: world axes, at rest, with the acceleration -gravity. */
KT_INLINE void kt_ground_set(kt_real3 gravity, kt_link_motion *ground) {
    const kt_real3 none = kt_zero3();
    const kt_real1 zero = kt_real1_splat(0.0), one = kt_real1_splat(1.0);
    *ground =
        (kt_link_motion){.axes = {kt_make3(one, zero, zero), kt_make3(zero, one, zero), kt_make3(zero, zero, one)},
                         .offset = none,
                         .omega = none,
                         .alpha = none,
                         .linear = kt_minus3(gravity)};
}

/* Subtracts wrenches on bodies (world axes, about the body frames' origins) from the wrenches of their links. */
KT_INLINE void kt_external_subtract(const kt_model *model, kt_data *data, const kt_external *external) {
    for (size_t b = 1; b < model->n.body; b++) {
        const kt_body_record *body = &model->body[b];
        kt_link_origin *load = &data->origin[body->link];
        const kt_real3 arm = kt_apply3(data->motion[body->link].axes, kt_const_from3(body->in_link.position));
        const kt_real3 force = kt_of_external3(external[b].force);
        load->moment = kt_sub3(load->moment, kt_add3(kt_of_external3(external[b].moment), kt_cross3(arm, force)));
        load->force = kt_sub3(load->force, force);
    }
}

/* No wrenches act on links: the zero wrench of the ground replaces the wrenches of all links. */
KT_INLINE void kt_external_none(kt_data *data) {
    memset(&data->origin[0], 0, sizeof data->origin[0]);
    data->has_external = false;
}

/* Sets the wrenches of links if only external wrenches act. */
KT_INLINE void kt_external_set(const kt_model *model, kt_data *data, const kt_external *external) {
    memset(data->origin, 0, model->n.link * sizeof *data->origin);
    kt_external_subtract(model, data, external);
    data->has_external = true;
}

#endif
