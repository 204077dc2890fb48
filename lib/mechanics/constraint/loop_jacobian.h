/* The equations of a group's loops in its coordinates: A', phi, phi_t and b''.
 *
 * The ends are computed from the loop's ancestor along its two paths. No digits are lost far from the world's origin,
 * and motions of the loop as a whole do not enter. A row has the wrench (n, f) on the second end, about the point of
 * this end. For a degree of freedom let s be its angular velocity, and u the velocity that the degree of freedom gives
 * to the point. The entry of the row is n . s + f . u, with the opposite sign on the first path.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_LOOP_JACOBIAN_H
#define KT_CONSTRAINT_LOOP_JACOBIAN_H

#include "constraint/group.h"
#include "constraint/rejecting_loop.h"
#include "dynamics/sweep.h"
#include "loop/by_lane.h"

#ifndef KT_LANES
#include "constraint/formula_row.h"
#endif

#include <string.h>

/* The motion of a loop's end relative to the ancestor's origin; needs poses, and if `moving` velocities and c
 * (sweep.h). Returns the vector from the origin of the end's link to its point; 0 for the ground.
 */
KT_INLINE kt_real3 kt_end_follow(const kt_model *model, const kt_data *data, const kt_loop_record *loop, int k,
                                 bool moving, const kt_real1 *v, kt_loop_end *end) {
    const kt_real3 none = kt_zero3();
    const kt_mat3 *own = &loop->frame[k].rotation;
    end->turn = kt_real1_splat(0.0);
    if (loop->link[k] == 0) { /* the ground, at rest */
        end->axes[0] = kt_from3(own->x);
        end->axes[1] = kt_from3(own->y);
        end->axes[2] = kt_from3(own->z);
        end->point = kt_from3(kt_vec3_sub(loop->frame[k].position, loop->origin));
        end->omega = end->velocity = end->alpha = end->linear = none;
        return none;
    }
    const int32_t *path = model->path + loop->path[k];
    kt_real3 point = kt_sub3(none, kt_from3(loop->origin)), velocity = none, alpha = none, linear = none;
    kt_real3 omega = moving ? data->motion[loop->ancestor].omega : none;
    for (int i = 0; i < loop->length[k]; i++) {
        const kt_link *link = &model->link[path[i]];
        const kt_link_motion *m = &data->motion[path[i]];
        point = kt_add3(point, m->offset);
        if (!moving)
            continue;
        if (i > 0 || loop->ancestor != 0) /* the ground does not turn */
            velocity = kt_add3(velocity, kt_cross3(omega, m->offset));
        if (!kt_link_is_revolute(link)) {
            kt_real3 angular, linear_velocity;
            kt_joint_twist(link, &data->motion[link->parent], m, v, &angular, &linear_velocity);
            velocity = kt_add3(velocity, linear_velocity);
        }
        linear = kt_add3(linear, i > 0 ? kt_add3(kt_cross3(alpha, m->offset), m->linear) : m->linear);
        alpha = kt_add3(alpha, m->alpha);
        omega = m->omega;
    }
    const kt_link_motion *force_link = &data->motion[loop->link[k]];
    const kt_real3 frame[3] = {kt_from3(own->x), kt_from3(own->y), kt_from3(own->z)};
    if (k == 1 && loop->kind == KT_LOOP_INPLANE) /* reads the point alone */
        end->axes[0] = end->axes[1] = end->axes[2] = none;
    else
        kt_multiply3(force_link->axes, frame, end->axes);
    const kt_real3 arm = kt_apply3(force_link->axes, kt_from3(loop->frame[k].position));
    end->point = kt_add3(point, arm);
    end->omega = omega;
    end->velocity = kt_add3(velocity, kt_cross3(omega, arm));
    end->alpha = alpha;
    end->linear = kt_add3(kt_add3(linear, kt_cross3(alpha, arm)), kt_cross3(omega, kt_cross3(omega, arm)));
    return arm;
}

/* The turns of both ends, of a loop that counts them. */
KT_INLINE void kt_ends_count(const kt_model *model, const kt_loop_record *loop, const kt_real1 *q, kt_loop_end end[2]) {
    const double *sign = model->number + loop->turn;
    for (int k = 0; k < 2; k++)
        for (int i = 0; i < loop->length[k]; i++, sign++)
            if (*sign != 0.0)
                end[k].turn += *sign * q[model->link[model->path[loop->path[k] + i]].q];
}

/* A point of a body above a plane on the ground (KT_LOOP_INPLANE): contacts with the ground. The frame at rest leaves
 * the equation few terms: d_z = e_z . d, and d'' without the Coriolis terms of loop/relative_motion.h. Other loops have
 * the bits of the general calculation, and so have these. */
KT_INLINE bool kt_loop_is_over_ground(const kt_loop_record *loop) {
    return loop->kind == KT_LOOP_INPLANE && loop->link[0] == 0;
}

/* d, from the plane's point; *arm: from the origin of the end's link. Needs poses. */
KT_INLINE kt_real3 kt_point_over_ground(const kt_model *model, const kt_data *data, const kt_loop_record *loop,
                                        kt_real3 *arm) {
    const int32_t *path = model->path + loop->path[1];
    kt_real3 point = kt_sub3(kt_zero3(), kt_from3(loop->origin));
    for (int i = 0; i < loop->length[1]; i++)
        point = kt_add3(point, data->motion[path[i]].offset);
    *arm = kt_apply3(data->motion[loop->link[1]].axes, kt_from3(loop->frame[1].position));
    return kt_sub3(kt_add3(point, *arm), kt_from3(kt_vec3_sub(loop->frame[0].position, loop->origin)));
}

/* d'' at accelerations of zero of all joints; needs velocities and c. The parent of the first link is the ground, so
 * that its c is zero. */
KT_INLINE kt_real3 kt_bias_over_ground(const kt_model *model, const kt_data *data, const kt_loop_record *loop,
                                       kt_real3 arm) {
    const int32_t *path = model->path + loop->path[1];
    const kt_link_motion *m = &data->motion[path[0]];
    if (loop->length[1] == 1)
        return kt_cross3(m->omega, kt_cross3(m->omega, arm));
    m = &data->motion[path[1]];
    kt_real3 alpha = m->alpha, linear = m->linear;
    for (int i = 2; i < loop->length[1]; i++) {
        m = &data->motion[path[i]];
        linear = kt_add3(linear, kt_add3(kt_cross3(alpha, m->offset), m->linear));
        alpha = kt_add3(alpha, m->alpha);
    }
    return kt_add3(kt_add3(linear, kt_cross3(alpha, arm)), kt_cross3(m->omega, kt_cross3(m->omega, arm)));
}

/* The velocity that a degree of freedom gives to the point at `arm` from the origin of its link. */
KT_INLINE kt_real3 kt_dof_velocity_at(const kt_dof *dof, kt_real3 arm) {
    if (dof->kind == KT_DOF_TRANSLATION)
        return dof->u;
    const kt_real3 turned = kt_cross3(kt_dof_angular(dof), arm);
    return dof->kind == KT_DOF_ROTATION ? turned : kt_add3(turned, kt_dof_linear(dof));
}

/* One path of a loop. */
typedef struct kt_rows_path_terms {
    const kt_group_work *w;
    const int32_t *slot;
    const kt_loop_row *rows;
    int count, local; /* number of rows; first coordinate of the link */
    double sign;
    kt_real3 arm; /* from the origin of the link to the second end's point */
} kt_rows_path_terms;

/* Adds one degree of freedom to all rows: angular velocity s, velocity u of the second end's point. */
KT_INLINE void kt_rows_dof(const kt_dof *dof, void *context) {
    const kt_rows_path_terms *p = context;
    const kt_real3 s = kt_dof_angular(dof), u = kt_dof_velocity_at(dof, p->arm);
    kt_real1 *a = p->w->a + p->local + dof->index;
    for (int r = 0; r < p->count; r++) {
        if (p->slot[r] < 0)
            continue;
        const kt_real1 x = kt_dot3(p->rows[r].force, u);
        a[(size_t)p->slot[r] * (size_t)p->w->m] +=
            p->sign * (dof->kind == KT_DOF_TRANSLATION ? x : kt_dot3(p->rows[r].moment, s) + x);
    }
}

/* Writes A' of one path. `arm` is the vector from the origin of the end's link to the second end's point. */
KT_INLINE void kt_rows_path(const kt_model *model, const kt_data *data, const kt_loop_record *loop, int k,
                            kt_rows_path_terms p) {
    p.sign = k ? 1.0 : -1.0;
    for (int i = loop->length[k] - 1; i >= 0; i--) {
        const int32_t index = model->path[loop->path[k] + i];
        const kt_link *link = &model->link[index];
        const kt_link_motion *m = &data->motion[index];
        p.local = link->local;
        kt_dofs_visit(link, data->motion[link->parent].axes, m->axes, kt_rows_dof, &p);
        p.arm = kt_add3(p.arm, m->offset);
    }
}

/* Stores everything of a row but its entries in A'; d: from the first end's point to the second's. */
KT_INLINE void kt_rows_store(const kt_model *model, const kt_group_work *w, const kt_loop_row *row,
                             const kt_loop_end end[2], kt_real3 d, int32_t slot) {
    const kt_real3 alpha = kt_sub3(end[1].alpha, end[0].alpha);
    const kt_real3 linear = kt_sub3(kt_sub3(end[1].linear, end[0].linear), kt_cross3(end[0].alpha, d));
    w->residual[slot] = row->holonomic ? row->residual : kt_real1_splat(0.0);
    w->closes[slot] = kt_real1_splat(row->holonomic ? 1.0 : 0.0);
    w->scale[slot] =
        KT_CHOOSE(kt_dot3(row->force, row->force) > 0.0, kt_real1_splat(model->length), kt_real1_splat(1.0));
    w->rate[slot] = row->rate;
    w->right[slot] = -(row->drift + kt_dot3(row->moment, alpha) + kt_dot3(row->force, linear));
}

/* The rows of a loop between frames; v is NULL if the links are at rest. */
KT_INLINE void kt_rows_frames(const kt_model *model, const kt_data *data, const kt_group_work *w,
                              const kt_loop_record *loop, const int32_t *slot, const kt_real1 *q, const kt_real1 *v,
                              kt_real1 t) {
    kt_loop_end end[2];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_real3 arm[2];
    for (int k = 0; k < 2; k++)
        arm[k] = kt_end_follow(model, data, loop, k, v != NULL, v, &end[k]);
    if (loop->counted)
        kt_ends_count(model, loop, q, end);
    const int count = kt_loop_evaluate(loop, model->number, end, t, rows);
#ifndef KT_LANES
    if (loop->equations != NULL)
        kt_stop_store_code(model, data, loop, rows[0].rate);
#endif
    const kt_real3 d = kt_sub3(end[1].point, end[0].point);
    for (int r = 0; r < count; r++)
        if (slot[r] >= 0)
            kt_rows_store(model, w, &rows[r], end, d, slot[r]);
    kt_rows_path_terms p = {.w = w, .slot = slot, .rows = rows, .count = count};
    for (int k = 0; k < 2; k++) {
        if (loop->length[k] == 0) /* the ancestor itself */
            continue;
        p.arm = k == 0 ? kt_add3(arm[0], d) : arm[1];
        kt_rows_path(model, data, loop, k, p);
    }
}

/* The row of a loop over the ground. */
typedef struct kt_ground_row {
    kt_real1 *a; /* first coordinate of the link */
    kt_real3 normal, arm;
} kt_ground_row;

KT_INLINE void kt_ground_row_dof(const kt_dof *dof, void *context) {
    const kt_ground_row *p = context;
    p->a[dof->index] = kt_dot3(p->normal, kt_dof_velocity_at(dof, p->arm));
}

/* The entries of a link in the row of a loop over the ground. Translations of a free joint along the ground's axes have
 * the components of the normal. */
KT_INLINE void kt_ground_row_link(const kt_link *link, const kt_link_motion *parent, const kt_link_motion *m,
                                  kt_ground_row *p) {
    if (link->motion != KT_MOTION_FREE || link->parent != 0 || link->rest_is_rotated) {
        kt_dofs_visit(link, parent->axes, m->axes, kt_ground_row_dof, p);
        return;
    }
    for (int k = 0; k < 3; k++) {
        p->a[k] = KT_PART3(p->normal, k);
        p->a[k + 3] = kt_dot3(p->normal, kt_cross3(m->axes[k], p->arm));
    }
}

/* kt_rows_frames of a loop over the ground. Without `moving`, b'' becomes 0. */
KT_INLINE void kt_rows_over_ground(const kt_model *model, const kt_data *data, const kt_group_work *w,
                                   const kt_loop_record *loop, int32_t slot, bool moving) {
    const int32_t *path = model->path + loop->path[1];
    kt_ground_row p = {.normal = kt_from3(loop->frame[0].rotation.z)};
    if (slot < 0)
        return;
    const kt_real3 d = kt_point_over_ground(model, data, loop, &p.arm);
    w->residual[slot] = kt_dot3(p.normal, d);
    w->closes[slot] = kt_real1_splat(1.0);
    w->scale[slot] = kt_real1_splat(model->length);
    w->rate[slot] = kt_real1_splat(0.0);
    w->right[slot] = moving ? -kt_dot3(p.normal, kt_bias_over_ground(model, data, loop, p.arm)) : kt_real1_splat(0.0);
    for (int i = loop->length[1] - 1; i >= 0; i--) {
        const kt_link *link = &model->link[path[i]];
        const kt_link_motion *m = &data->motion[path[i]];
        p.a = w->a + (size_t)slot * (size_t)w->m + link->local;
        kt_ground_row_link(link, &data->motion[link->parent], m, &p);
        p.arm = kt_add3(p.arm, m->offset);
    }
}

/* Stores everything of a relation but its entries in A'. */
KT_INLINE void kt_rows_relation_value(const kt_model *model, const kt_group *group, const kt_group_work *w,
                                      const kt_loop_record *loop, int32_t slot, const kt_real1 *q, kt_real1 t) {
    kt_real1 sum = kt_real1_splat(0.0);
    double scale = 0.0;
    if (slot < 0)
        return;
    for (int k = 0; k < loop->term_count; k++) {
        const kt_term_record *term = &model->term[loop->term + k];
        const kt_link *link = &model->link[term->link];
        sum += term->coefficient * q[link->q];
        scale = fmax(scale, fabs(term->coefficient) * model->unit[group->v + link->local]);
    }
    w->scale[slot] = kt_real1_splat(scale);
    const kt_relation1 row = kt_loop_relate(loop, model->number, sum, t);
    w->closes[slot] = kt_real1_splat(row.closes);
    w->residual[slot] = row.residual;
    w->rate[slot] = row.rate;
    w->right[slot] = -row.drift;
}

#ifndef KT_LANES
/* Adds the contribution of a coupling's formula to the equation. The scale is the change of the equation for a unit
 * displacement, also if the slopes vanish. */
static inline void kt_rows_add_formula(const kt_model *model, const kt_group *group, const kt_group_work *w,
                                       const kt_loop_record *loop, int32_t slot, const double *q, const double *v) {
    kt_formula_row f;
    double scale = 0.0;
    kt_formula_row_evaluate(model, loop, q, v, &f);
    for (int k = 0; k < loop->term_count; k++) {
        const kt_term_record *term = &model->term[loop->term + k];
        const int32_t local = model->link[term->link].local;
        const double unit = model->unit[group->v + local];
        w->a[(size_t)slot * (size_t)w->m + (size_t)local] += f.by[k];
        scale = fmax(scale, unit * fmax(fabs(term->coefficient + f.by[k]), 0.5 * unit * fabs(f.twice[k])));
    }
    w->scale[slot] = scale > 0.0 ? scale : 1.0;
    w->residual[slot] += f.value;
    w->right[slot] -= f.drift;
}
#endif

KT_INLINE void kt_rows_relation(const kt_model *model, const kt_group *group, const kt_group_work *w,
                                const kt_loop_record *loop, int32_t slot, const kt_real1 *q, const kt_real1 *v,
                                kt_real1 t) {
    kt_rows_relation_value(model, group, w, loop, slot, q, t);
#ifndef KT_LANES
    if (loop->form && slot >= 0)
        kt_rows_add_formula(model, group, w, loop, slot, q, v);
#else
    (void)v; /* formulas are not computed in lanes */
#endif
    for (int k = 0; k < loop->term_count && slot >= 0; k++) {
        const kt_term_record *term = &model->term[loop->term + k];
        w->a[(size_t)slot * (size_t)w->m + (size_t)model->link[term->link].local] += term->coefficient;
    }
}

#ifndef KT_LANES
/* kt_rows_fill for a group of one coordinate with one relation without a formula. Only the few matrices that are
 * written are located. */
KT_INLINE void kt_rows_fill_one(const kt_model *model, const kt_data *data, size_t g, const double *q, double t) {
    const kt_group *group = &model->group[g];
    const kt_loop_record *loop = &model->loop[model->group_loop[group->loop]];
    const int32_t slot = model->slot[loop->slot];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    w.a[0] = slot >= 0 ? model->term[loop->term].coefficient : 0.0;
    kt_rows_relation_value(model, group, &w, loop, slot, q, t);
}
#endif

/* Fills the rows of a loop, whose entries in A' are zero, into these slots. v is NULL if the links are at rest. */
KT_INLINE void kt_rows_loop(const kt_model *model, const kt_data *data, const kt_group_work *w,
                            const kt_loop_record *loop, const int32_t *slot, const kt_real1 *q, const kt_real1 *v,
                            kt_real1 t) {
    if (loop->term_count)
        kt_rows_relation(model, &model->group[loop->group], w, loop, slot[0], q, v, t);
    else if (kt_loop_is_over_ground(loop))
        kt_rows_over_ground(model, data, w, loop, slot[0], v != NULL);
    else
        kt_rows_frames(model, data, w, loop, slot, q, v, t);
}

/* Fills A', phi and phi_t of a group, the scales of the residuals, and if `moving` b''. Requires the links' poses, and
 * if `moving` velocities and c. */
static inline void kt_rows_fill(const kt_model *model, const kt_data *data, size_t g, bool moving, const kt_real1 *q,
                                const kt_real1 *v, kt_real1 t) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
    memset(w.a, 0, (size_t)w.m * (size_t)w.k * sizeof *w.a);
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        kt_rows_loop(model, data, &w, loop, model->slot + loop->slot, q, moving ? v : NULL, t);
    }
}

#endif
