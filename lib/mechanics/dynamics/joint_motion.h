/* The effect of each elementary motion on a link (model/motion.h): its pose, and its degrees of freedom, in world axes
 * about the link's own origin. The latter determine velocities, Jacobians, joint forces and the rows of loops. Each of
 * these is a function that kt_dofs_visit calls for one degree of freedom after the other. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_JOINT_MOTION_H
#define KT_DYNAMICS_JOINT_MOTION_H

#include "model/model.h"

/* The most frequent motion by far, for which sums leave out all zeros. */
KT_INLINE bool kt_link_is_revolute(const kt_link *link) { return link->motion == KT_MOTION_REVOLUTE; }

KT_INLINE kt_real3 kt_load3(const kt_real1 *x) { return kt_make3(x[0], x[1], x[2]); }

/* The link's axes at joint position zero, in the world. */
KT_INLINE void kt_axes_at_zero(const kt_link *link, const kt_real3 parent[3], kt_real3 out[3]) {
    if (link->rest_is_rotated) {
        const kt_mat3 *rest = &kt_link_rest_of(link)->axes;
        out[0] = kt_apply_to3(parent, rest->x);
        out[1] = kt_apply_to3(parent, rest->y);
        out[2] = kt_apply_to3(parent, rest->z);
    } else {
        out[0] = parent[0];
        out[1] = parent[1];
        out[2] = parent[2];
    }
}

/* s */
KT_INLINE kt_real3 kt_link_axis(const kt_link *link, const kt_link_motion *m) { return m->axes[link->axis]; }

/* ---- poses: axes and offset from the axes at rest, with the offset at rest set --------------------------------
 */

/* Rotates two columns of `base` in their plane and leaves the third: base times R1, R2 or R3 of the angle. */
KT_INLINE void kt_rotate_axes(int axis, const kt_real3 base[3], kt_real1 c, kt_real1 s, kt_real3 out[3]) {
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    out[axis] = base[axis];
    out[j] = kt_add3(kt_scale3(c, base[j]), kt_scale3(s, base[k]));
    out[k] = kt_sub3(kt_scale3(c, base[k]), kt_scale3(s, base[j]));
}

/* The columns of base times R(p), for a quaternion p of any non-zero norm. */
KT_INLINE void kt_quaternion_axes(const kt_real1 *p, const kt_real3 base[3], kt_real3 out[3]) {
    kt_real3 r[3];
    kt_rotation3(p, r);
    kt_multiply3(base, r, out);
}

KT_INLINE void kt_revolute_pose(const kt_link *link, const kt_real3 base[3], const kt_real1 *q, const kt_real1 *cosine,
                                const kt_real1 *sine, kt_link_motion *out) {
    const kt_real1 c = cosine[link->angle], s = sine[link->angle];
    (void)q;
    switch (link->axis) {
    case 0:
        kt_rotate_axes(0, base, c, s, out->axes);
        break;
    case 1:
        kt_rotate_axes(1, base, c, s, out->axes);
        break;
    default:
        kt_rotate_axes(2, base, c, s, out->axes);
        break;
    }
}

KT_INLINE void kt_prismatic_pose(const kt_link *link, const kt_real3 base[3], const kt_real1 *q, const kt_real1 *cosine,
                                 const kt_real1 *sine, kt_link_motion *out) {
    (void)cosine, (void)sine;
    for (int k = 0; k < 3; k++)
        out->axes[k] = base[k];
    out->offset = kt_add_scaled3(out->offset, q[link->q], base[link->axis]);
}

KT_INLINE void kt_screw_pose(const kt_link *link, const kt_real3 base[3], const kt_real1 *q, const kt_real1 *cosine,
                             const kt_real1 *sine, kt_link_motion *out) {
    kt_revolute_pose(link, base, q, cosine, sine, out);
    out->offset = kt_add_scaled3(out->offset, kt_link_pitch(link) * q[link->q], base[link->axis]);
}

KT_INLINE void kt_spherical_pose(const kt_link *link, const kt_real3 base[3], const kt_real1 *q, const kt_real1 *cosine,
                                 const kt_real1 *sine, kt_link_motion *out) {
    (void)cosine, (void)sine;
    kt_quaternion_axes(q + link->q, base, out->axes);
}

KT_INLINE void kt_free_pose(const kt_link *link, const kt_real3 base[3], const kt_real1 *q, const kt_real1 *cosine,
                            const kt_real1 *sine, kt_link_motion *out) {
    (void)cosine, (void)sine;
    kt_quaternion_axes(q + link->q + 3, base, out->axes);
    out->offset = kt_add3(out->offset, kt_apply3(base, kt_load3(q + link->q)));
}

/* Pose of one link from its parent's: axes, offset. */
KT_INLINE void kt_link_pose(const kt_link *link, const kt_link_motion *parent, const kt_real1 *q,
                            const kt_real1 *cosine, const kt_real1 *sine, kt_link_motion *out) {
    out->offset = kt_const_apply3(parent->axes, link->at);
    if (kt_link_is_revolute(link) && !link->rest_is_rotated) {
        kt_revolute_pose(link, parent->axes, q, cosine, sine, out);
        return;
    }
    kt_real3 base[3];
    kt_axes_at_zero(link, parent->axes, base);
    switch ((kt_motion)link->motion) {
#define KT_MOTION_POSE(id, name, ...)                                                                                  \
    case KT_MOTION_##id:                                                                                               \
        kt_##name##_pose(link, base, q, cosine, sine, out);                                                            \
        break;
        KT_MOTION_LIST(KT_MOTION_POSE)
#undef KT_MOTION_POSE
    case KT_MOTION_NONE:
        break;
    }
}

/* ---- degrees of freedom ------------------------------------------------------------------------------------------ */

/* S = (u, 0), (0, u) or (u, p u). */
typedef enum kt_dof_kind { KT_DOF_ROTATION, KT_DOF_TRANSLATION, KT_DOF_SCREW } kt_dof_kind;

typedef struct kt_dof {
    kt_dof_kind kind;
    int index;  /* among those of the link */
    bool first; /* the first degree of freedom of its kind */
    kt_real3 u;
    double pitch; /* p */
} kt_dof;

KT_INLINE kt_real3 kt_dof_angular(const kt_dof *dof) { return dof->kind == KT_DOF_TRANSLATION ? kt_zero3() : dof->u; }

KT_INLINE kt_real3 kt_dof_linear(const kt_dof *dof) {
    switch (dof->kind) {
    case KT_DOF_TRANSLATION:
        return dof->u;
    case KT_DOF_SCREW:
        return kt_scale3(kt_real1_splat(dof->pitch), dof->u);
    case KT_DOF_ROTATION:
        break;
    }
    return kt_zero3();
}

/* The function that is called for a degree of freedom. */
typedef void kt_dof_visit(const kt_dof *dof, void *context);

/* Visits three degrees of freedom of one kind. */
KT_INLINE void kt_dofs_visit3(kt_dof_kind kind, int first, const kt_real3 u[3], kt_dof_visit *visit, void *context) {
    for (int k = 0; k < 3; k++)
        visit(&(kt_dof){.kind = kind, .index = first + k, .first = k == 0, .u = u[k]}, context);
}

KT_INLINE void kt_revolute_dofs(const kt_link *link, const kt_real3 parent[3], const kt_real3 axes[3],
                                kt_dof_visit *visit, void *context) {
    (void)parent;
    visit(&(kt_dof){.kind = KT_DOF_ROTATION, .first = true, .u = axes[link->axis]}, context);
}

KT_INLINE void kt_prismatic_dofs(const kt_link *link, const kt_real3 parent[3], const kt_real3 axes[3],
                                 kt_dof_visit *visit, void *context) {
    (void)parent;
    visit(&(kt_dof){.kind = KT_DOF_TRANSLATION, .first = true, .u = axes[link->axis]}, context);
}

KT_INLINE void kt_screw_dofs(const kt_link *link, const kt_real3 parent[3], const kt_real3 axes[3], kt_dof_visit *visit,
                             void *context) {
    (void)parent;
    visit(&(kt_dof){.kind = KT_DOF_SCREW, .first = true, .u = axes[link->axis], .pitch = kt_link_pitch(link)}, context);
}

KT_INLINE void kt_spherical_dofs(const kt_link *link, const kt_real3 parent[3], const kt_real3 axes[3],
                                 kt_dof_visit *visit, void *context) {
    (void)link, (void)parent;
    kt_dofs_visit3(KT_DOF_ROTATION, 0, axes, visit, context);
}

KT_INLINE void kt_free_dofs(const kt_link *link, const kt_real3 parent[3], const kt_real3 axes[3], kt_dof_visit *visit,
                            void *context) {
    kt_real3 base[3];
    kt_axes_at_zero(link, parent, base);
    kt_dofs_visit3(KT_DOF_TRANSLATION, 0, base, visit, context);
    kt_dofs_visit3(KT_DOF_ROTATION, 3, axes, visit, context);
}

/* Visits the degrees of freedom of a link in their order. parent, axes: the axes of the parent and of the link. */
KT_INLINE void kt_dofs_visit(const kt_link *link, const kt_real3 parent[3], const kt_real3 axes[3], kt_dof_visit *visit,
                             void *context) {
    switch ((kt_motion)link->motion) {
#define KT_MOTION_DOFS(id, name, ...)                                                                                  \
    case KT_MOTION_##id:                                                                                               \
        kt_##name##_dofs(link, parent, axes, visit, context);                                                          \
        break;
        KT_MOTION_LIST(KT_MOTION_DOFS)
#undef KT_MOTION_DOFS
    case KT_MOTION_NONE:
        break;
    }
}

#ifndef KT_LANES
/* Visits the degrees of freedom of link i, with the kinematics of all links. */
KT_INLINE void kt_link_dofs_visit(const kt_model *model, const kt_link_kinematics *links, size_t i, kt_dof_visit *visit,
                                  void *context) {
    kt_v4 axes[3], parent[3];
    kt_v4_from_mat3(links[i].axes, axes);
    kt_v4_from_mat3(links[model->link[i].parent].axes, parent);
    kt_dofs_visit(&model->link[i], parent, axes, visit, context);
}
#endif

/* ---- their forces ------------------------------------------------------------------------------------------------ */

/* A wrench about the origin of a link, and where the joint forces S . (n, f) of the link's degrees of freedom go. The
 * wrench is not copied, because a recursion that stores a copy and loads the copy again waits for the store in each
 * link. */
typedef struct kt_dof_projection {
    const kt_link_origin *load;
    kt_real1 *tau;
} kt_dof_projection;

KT_INLINE void kt_project_wrench(const kt_dof *dof, void *context) {
    const kt_dof_projection *p = context;
    const kt_real3 n = p->load->moment, f = p->load->force;
    p->tau[dof->index] =
        kt_dot3(dof->u, dof->kind == KT_DOF_ROTATION      ? n
                        : dof->kind == KT_DOF_TRANSLATION ? f
                                                          : kt_add_scaled3(n, kt_real1_splat(dof->pitch), f));
}

/* ---- their twist ------------------------------------------------------------------------------------------------- */

typedef struct kt_twist_sum {
    const kt_real1 *x;
    kt_real3 angular, linear;
} kt_twist_sum;

/* Adds x S; the first of a kind is not added to zero. */
KT_INLINE void kt_twist_add(const kt_dof *dof, void *context) {
    kt_twist_sum *sum = context;
    const kt_real3 x = kt_scale3(sum->x[dof->index], dof->u);
    if (dof->kind != KT_DOF_TRANSLATION)
        sum->angular = dof->first ? x : kt_add3(sum->angular, x);
    if (dof->kind == KT_DOF_TRANSLATION)
        sum->linear = dof->first ? x : kt_add3(sum->linear, x);
    if (dof->kind == KT_DOF_SCREW)
        sum->linear = kt_scale3(dof->pitch * sum->x[dof->index], dof->u);
}

/* The joint's relative velocity for the rates v: its angular and linear parts. */
KT_INLINE void kt_joint_twist(const kt_link *link, const kt_link_motion *parent, const kt_link_motion *self,
                              const kt_real1 *v, kt_real3 *angular, kt_real3 *linear) {
    kt_twist_sum sum = {.x = v + link->v, .angular = kt_zero3(), .linear = kt_zero3()};
    kt_dofs_visit(link, parent->axes, self->axes, kt_twist_add, &sum);
    *angular = sum.angular;
    *linear = sum.linear;
}

/* ---- their matrix ------------------------------------------------------------------------------------------------ */

/* S, column by column. */
typedef struct kt_subspace {
    int count;
    kt_real3 angular[KT_DOF_MAX], linear[KT_DOF_MAX];
} kt_subspace;

KT_INLINE void kt_subspace_add(const kt_dof *dof, void *context) {
    kt_subspace *s = context;
    s->angular[dof->index] = kt_dof_angular(dof);
    s->linear[dof->index] = kt_dof_linear(dof);
    s->count = dof->index + 1;
}

KT_INLINE void kt_link_subspace(const kt_link *link, const kt_link_motion *parent, const kt_link_motion *m,
                                kt_subspace *s) {
    s->count = 0;
    kt_dofs_visit(link, parent->axes, m->axes, kt_subspace_add, s);
}

/* S . (moment, force) of one column. */
KT_INLINE kt_real1 kt_along(kt_real3 angular, kt_real3 linear, kt_real3 moment, kt_real3 force) {
    return kt_dot3(angular, moment) + kt_dot3(linear, force);
}

#endif
