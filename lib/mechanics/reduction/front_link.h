/* Motion and inertia of a link, for fronts (front.h), in the plane or in space: accelerations (alpha, a) have
 * three or six components. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_FRONT_LINK_H
#define KT_REDUCTION_FRONT_LINK_H

#include "constraint/planar_loop_jacobian.h"
#include "reduction/components.h"
#include "reduction/front.h"

/* From the parent's origin to the link's. */
KT_INLINE kt_real3 kt_front_offset(const kt_front *f, int32_t i) {
    if (f->components == KT_FRONT_SPACE)
        return f->data->motion[i].offset;
    const kt_real1 *r = f->data->planar[i + f->model->to_planar].offset;
    return kt_make3(r[0], r[1], kt_real1_splat(0.0));
}

/* Writes S: the accelerations for unit values of the link's coordinates, one after the other. Coordinates that count as
 * constants have zeros. Returns their number. */
KT_INLINE int kt_front_subspace(const kt_front *f, int32_t i, kt_real1 *s) {
    const kt_link *link = &f->model->link[i];
    const kt_real1 zero = kt_real1_splat(0.0);
    if (f->components == KT_FRONT_SPACE / 2) {
        const int32_t k = i + f->model->to_planar;
        const kt_planar_link *planar = &f->model->planar[k];
        const bool fixed = kt_front_is_fixed(f, link->local);
        kt_real1 u[2] = {zero, zero};
        if (!planar->revolute && !fixed)
            kt_planar_along(planar, &f->data->planar[k], u);
        s[0] = planar->revolute && !fixed ? kt_const_real1(planar->sign) : zero;
        s[1] = u[0];
        s[2] = u[1];
        return 1;
    }
    kt_subspace own;
    kt_link_subspace(link, &f->data->motion[link->parent], &f->data->motion[i], &own);
    for (int d = 0; d < own.count; d++)
        for (int c = 0; c < 3; c++) {
            const bool fixed = kt_front_is_fixed(f, link->local + d);
            s[d * KT_FRONT_SPACE + c] = fixed ? zero : KT_PART3(own.angular[d], c);
            s[d * KT_FRONT_SPACE + 3 + c] = fixed ? zero : KT_PART3(own.linear[d], c);
        }
    return own.count;
}

#ifndef KT_LANES

/* Writes the symmetric articulated inertia of the link with all bodies that it carries outside the group, and the bias
 * wrench. The bias wrench includes the accelerations due to velocities alone (kt_group_bias, kt_planar_group_bias). */
KT_INLINE void kt_front_inertia(const kt_front *f, int32_t i, double *inertia, double *bias) {
    if (f->components == KT_FRONT_SPACE / 2) {
        const kt_planar_inertia *x = &f->data->planar_inertia[i + f->model->to_planar];
        kt_planar_inertia_to_matrix(x, inertia);
        bias[0] = x->moment;
        bias[1] = x->force[0];
        bias[2] = x->force[1];
        return;
    }
    const kt_articulated *x = &f->data->articulated[i];
    kt_inertia_to_matrix(x, inertia);
    for (int c = 0; c < 3; c++) {
        bias[c] = x->moment[c];
        bias[c + 3] = x->force[c];
    }
}

#endif

/* The motion of a link of the group, relative to the parent's origin (front_rows.c). */
KT_INLINE kt_front_motion *kt_front_motion_of(const kt_front *f, int32_t link) {
    return &f->data->front_motion[f->group->v + f->model->link[link].local];
}

/* The holder of the equation of a relation that a step completes. */
static inline int32_t kt_front_relation_of(const kt_front *f, const kt_front_step *step, int32_t loop) {
    int32_t i = step->term;
    while (f->model->front_term[i].loop != loop)
        i++;
    return f->group->link_count + f->model->front_term[i].slot;
}

#ifndef KT_LANES

/* Releases the slots of relations that are complete and of links on which nothing depends any more. */
static inline void kt_front_release_last_uses(kt_front *f, const kt_front_step *step) {
    for (int i = step->loop; i < step->loop + step->loop_count; i++)
        if (f->model->loop[f->model->front_loop[i]].term_count)
            kt_front_release(f, kt_front_relation_of(f, step, f->model->front_loop[i]));
    for (int i = step->last_use; i < step->last_use + step->last_use_count; i++)
        kt_front_release(f, f->model->front_last_use[i]);
}

/* Removes the coordinates of a step's link from the parameters; returns the number of remaining parameters. */
static inline int kt_front_take_coordinates(const kt_front *f, int s, const double *p, double *step) {
    const kt_link *link = &f->model->link[f->step[s].link];
    const int dofs = kt_link_dofs(link), n = f->count[s].params - dofs;
    for (int d = 0; d < dofs; d++)
        step[link->v + d] = p[n + d];
    return n;
}

#endif

#endif
