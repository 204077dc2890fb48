/* The equations of a group that is reduced by fronts (front.h): loop_jacobian.h and planar_loop_jacobian.h without A.
 *
 * Motions are relative to the origin of the group's parent, so that one pass computes the motions of all links, for
 * paths of any length. A row is stored as the wrenches (n, f) of a unit multiplier on its two links, about their
 * origins. Its entry for a coordinate is the sum of n . w + f . v for the velocities (w, v) that the coordinate gives
 * to the links. For loops on the ground a point near the first loop replaces the world's origin, which may be far
 * away. Without `moving`, velocities count as zero, and b'' is not needed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/front.h"

#include "constraint/loop_jacobian.h"
#include "reduction/front_link.h"

#include <assert.h>
#include <string.h>

/* ---- motion of the links ----------------------------------------------------------------------------------------- */

/* The motion of the group's parent. Positions, in the parent's axes, are relative to the point of the first loop that
 * has a point. */
static kt_front_motion motion_of_parent(const kt_front *f, bool planar) {
    const kt_real3 none = kt_zero3();
    kt_front_motion parent = {.point = none, .velocity = none, .alpha = none, .linear = none};
    for (int i = 0; i < f->group->loop_count && f->group->parent == 0; i++) {
        const int32_t index = f->model->group_loop[f->group->loop + i];
        const kt_loop_record *loop = &f->model->loop[index];
        if (loop->term_count || loop->ancestor != 0)
            continue;
        const double *flat = planar ? f->model->planar_loop[index].origin : NULL;
        parent.point = kt_sub3(none, kt_from3(planar ? kt_vec3_make(flat[0], flat[1], 0.0) : loop->origin));
        break;
    }
    return parent;
}

/* a + (x, y), in a plane. */
KT_INLINE kt_real3 add_flat(kt_real3 a, kt_real1 x, kt_real1 y) {
#ifndef KT_LANES
    return a + kt_make3(x, y, 0.0);
#else
    return kt_make3(a.x + x, a.y + y, a.z);
#endif
}

/* Computes the motion of link i in the plane from the motion of the link before (kt_planar_end_follow). */
static void move_planar(const kt_front *f, const kt_front_motion *from, int32_t i, bool moving, const kt_real1 *v,
                        kt_front_motion *to) {
    const int32_t k = i + f->model->to_planar;
    const kt_planar_link *link = &f->model->planar[k];
    const kt_planar_motion *m = &f->data->planar[k];
    const kt_real1 w = moving ? f->data->planar[link->parent].omega : kt_real1_splat(0.0);
    *to = *from;
    to->point = add_flat(to->point, m->offset[0], m->offset[1]);
    if (!moving)
        return;
    to->velocity = add_flat(to->velocity, -w * m->offset[1], w * m->offset[0]);
    to->linear = add_flat(to->linear, m->linear[0], m->linear[1]);
    if (!link->revolute) {
        kt_real1 u[2];
        kt_planar_along(link, m, u);
        to->velocity = add_flat(to->velocity, v[link->v] * u[0], v[link->v] * u[1]);
    }
}

/* Computes the motion of link i in space from the motion of the link before (kt_end_follow). */
static void move_spatial(const kt_front *f, const kt_front_motion *from, int32_t i, bool moving, const kt_real1 *v,
                         kt_front_motion *to) {
    const kt_link *link = &f->model->link[i];
    const kt_link_motion *m = &f->data->motion[i], *up = &f->data->motion[link->parent];
    *to = *from;
    to->point = kt_add3(to->point, m->offset);
    if (!moving)
        return;
    to->velocity = kt_add3(to->velocity, kt_cross3(up->omega, m->offset));
    if (!kt_link_is_revolute(link)) {
        kt_real3 angular, linear;
        kt_joint_twist(link, up, m, v, &angular, &linear);
        to->velocity = kt_add3(to->velocity, linear);
    }
    to->linear = kt_add3(to->linear, kt_add3(kt_cross3(from->alpha, m->offset), m->linear));
    to->alpha = kt_add3(to->alpha, m->alpha);
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* The equations of a loop in the plane: right-hand sides, and the wrenches of unit multipliers on both links. The
 * reaction on the first link acts at the second end's point, hence its arm has d in addition. Without `moving`,
 * velocities count as zero. */
static void evaluate_planar(const kt_front *f, int32_t index, const kt_front_motion *parent, bool moving, kt_real1 t) {
    const kt_loop_record *loop = &f->model->loop[index];
    const kt_planar_loop *flat = &f->model->planar_loop[index];
    const int32_t *slot = f->model->slot + loop->slot;
    kt_planar_end end[2];
    kt_planar_relative r;
    kt_planar_wrench rows[KT_PLANAR_ROW_MAX];
    for (int k = 0; k < 2; k++) {
        const kt_front_motion *m = loop->link[k] == f->group->parent ? parent : kt_front_motion_of(f, loop->link[k]);
        kt_planar_end *e = &end[k];
        const kt_real1 w = moving ? f->data->planar[flat->link[k]].omega : kt_real1_splat(0.0);
        kt_planar_rotate(&f->data->planar[flat->link[k]], flat->arm[k], e->arm);
        e->omega = w;
        for (int c = 0; c < 2; c++) {
            e->point[c] = KT_PART3(m->point, c) + e->arm[c];
            e->linear[c] = KT_PART3(m->linear, c) - w * w * e->arm[c];
        }
        e->velocity[0] = KT_PART3(m->velocity, 0) - w * e->arm[1];
        e->velocity[1] = KT_PART3(m->velocity, 1) + w * e->arm[0];
    }
    kt_planar_relate(f->data, flat, end, &r);
    const int count = kt_planar_rows_evaluate(f->model, f->data, &f->w, &(kt_loop_in_plane){loop, flat, slot, NULL},
                                              end, &r, t, rows);
    for (int i = 0; i < count; i++)
        for (int k = 0; k < 2; k++) {
            const double sign = k ? 1.0 : -1.0;
            const kt_real1 *force = rows[i].force, zero = kt_real1_splat(0.0);
            const kt_real1 x = end[k].arm[0] + (k ? zero : r.d[0]), y = end[k].arm[1] + (k ? zero : r.d[1]);
            kt_real1 *w = kt_front_wrench(f, rows[i].slot, k);
            w[0] = sign * (rows[i].moment + (x * force[1] - y * force[0]));
            w[1] = sign * force[0];
            w[2] = sign * force[1];
        }
}

/* The motion of an end; its arm from the origin of its link. */
static kt_real3 place_end(const kt_front *f, const kt_loop_record *loop, int k, const kt_front_motion *parent,
                          bool moving, kt_loop_end *end) {
    const kt_front_motion *m = loop->link[k] == f->group->parent ? parent : kt_front_motion_of(f, loop->link[k]);
    const kt_link_motion *link = &f->data->motion[loop->link[k]];
    const kt_mat3 *own = &loop->frame[k].rotation;
    const kt_real3 arm = kt_apply3(link->axes, kt_from3(loop->frame[k].position));
    const kt_real3 omega = moving ? link->omega : kt_zero3();
    const kt_real3 frame[3] = {kt_from3(own->x), kt_from3(own->y), kt_from3(own->z)};
    kt_multiply3(link->axes, frame, end->axes);
    end->point = kt_add3(m->point, arm);
    end->turn = kt_real1_splat(0.0); /* loops that count turns are reduced with dense matrices */
    end->omega = omega;
    end->velocity = kt_add3(m->velocity, kt_cross3(omega, arm));
    end->alpha = m->alpha;
    end->linear = kt_add3(kt_add3(m->linear, kt_cross3(m->alpha, arm)), kt_cross3(omega, kt_cross3(omega, arm)));
    return arm;
}

/* The wrench of a unit multiplier about the origin of a link, from which the row's point is at `arm`. */
static void store_wrench(const kt_loop_row *row, kt_real3 arm, double sign, kt_real1 *w) {
    const kt_real3 moment = kt_add3(row->moment, kt_cross3(arm, row->force));
    for (int c = 0; c < 3; c++) {
        w[c] = sign * KT_PART3(moment, c);
        w[c + 3] = sign * KT_PART3(row->force, c);
    }
}

/* Likewise in space. */
static void evaluate_spatial(const kt_front *f, int32_t index, const kt_front_motion *parent, bool moving, kt_real1 t) {
    const kt_loop_record *loop = &f->model->loop[index];
    const int32_t *slot = f->model->slot + loop->slot;
    kt_loop_end end[2];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_real3 arm[2];
    for (int k = 0; k < 2; k++)
        arm[k] = place_end(f, loop, k, parent, moving, &end[k]);
    const int count = kt_loop_evaluate(loop, f->model->number, end, t, rows);
    const kt_real3 d = kt_sub3(end[1].point, end[0].point);
    for (int r = 0; r < count; r++) {
        if (slot[r] < 0)
            continue;
        kt_rows_store(f->model, &f->w, &rows[r], end, d, slot[r]);
        store_wrench(&rows[r], kt_add3(arm[0], d), -1.0, kt_front_wrench(f, slot[r], 0));
        store_wrench(&rows[r], arm[1], 1.0, kt_front_wrench(f, slot[r], 1));
    }
}

/* The scale replaces the sizes of the coefficients (kt_front_reach). */
static void evaluate_relation(const kt_front *f, const kt_loop_record *loop, const kt_real1 *q, kt_real1 t) {
    const int32_t slot = f->model->slot[loop->slot];
    kt_rows_relation_value(f->model, f->group, &f->w, loop, slot, q, t);
    if (slot < 0)
        return;
    memset(kt_front_wrench(f, slot, 0), 0, 2 * KT_FRONT_SPACE * sizeof(kt_real1));
    *kt_front_wrench(f, slot, 0) = f->w.scale[slot];
}

void KT_KERNEL(kt_front_fill)(const kt_model *model, kt_data *data, size_t g, bool planar, bool moving,
                              const kt_real1 *q, const kt_real1 *v, kt_real1 t) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    assert(model->group[g].has_fronts);
    kt_front f;
#ifndef KT_LANES
    data->front_planar[g] = planar;
    memset(data->front_fixed + model->group[g].v, 0, (size_t)model->group[g].v_count * sizeof *data->front_fixed);
#endif
    kt_front_find(model, data, g, KT_ROWS_ALL, &f);
    const kt_front_motion parent = motion_of_parent(&f, planar);
    for (int l = 0; l < f.group->link_count; l++) {
        const int32_t i = model->group_link[f.group->link + l], up = model->link[i].parent;
        const kt_front_motion *from = up == f.group->parent ? &parent : kt_front_motion_of(&f, up);
        if (planar)
            move_planar(&f, from, i, moving, v, kt_front_motion_of(&f, i));
        else
            move_spatial(&f, from, i, moving, v, kt_front_motion_of(&f, i));
    }
    for (int i = 0; i < f.group->loop_count; i++) {
        const int32_t index = model->group_loop[f.group->loop + i];
        const kt_loop_record *loop = &model->loop[index];
        if (loop->term_count)
            evaluate_relation(&f, loop, q, t);
        else if (planar)
            evaluate_planar(&f, index, &parent, moving, t);
        else
            evaluate_spatial(&f, index, &parent, moving, t);
    }
}

/* ---- A x --------------------------------------------------------------------------------------------------------- */

/* The velocity of a link at the rates x, and the sizes of its terms. */
static void move_at(const kt_front *f, const kt_front_step *step, const kt_real1 *x, kt_real1 *out, kt_real1 *speed) {
    const int c = f->components, angular = c == 3 ? 1 : 3;
    const kt_real1 zero = kt_real1_splat(0.0);
    const kt_real1 *up = step->up < 0 ? NULL : kt_front_constant(f, step->up);
    const kt_real1 *up_speed = f->speed + 2 * (step->up < 0 ? 0 : f->step[step->up].slot);
    kt_real1 own[KT_DOF_MAX * KT_FRONT_SPACE];
    const int dofs = kt_front_subspace(f, step->link, own);
    const kt_real3 r = kt_front_offset(f, step->link);
    for (int k = 0; k < c; k++)
        out[k] = up ? up[k] : zero;
    if (up)
        kt_motion_shift(c, r, out);
    const kt_real1 arm = kt_most1(kt_abs1(KT_PART3(r, 0)), kt_most1(kt_abs1(KT_PART3(r, 1)), kt_abs1(KT_PART3(r, 2))));
    speed[0] = up ? up_speed[0] : zero;
    speed[1] = up ? kt_most1(up_speed[1], up_speed[0] * arm) : zero;
    for (int d = 0; d < dofs; d++) {
        const kt_real1 rate = x[f->model->link[step->link].v + d];
        for (int k = 0; k < c; k++) {
            const kt_real1 term = own[d * c + k] * rate;
            out[k] += term;
            speed[k >= angular] = kt_most1(speed[k >= angular], kt_abs1(term));
        }
    }
}

/* The sum of w_k . x_k over both ends of a loop, with wrenches w of the row and motions x. *size: the largest term. */
static kt_real1 row_at(const kt_front *f, const kt_loop_record *loop, int32_t row, kt_real1 *size) {
    const int c = f->components, angular = c == 3 ? 1 : 3;
    kt_real1 sum = kt_real1_splat(0.0);
    for (int k = 0; k < 2; k++) {
        const int32_t slot = kt_front_step_of(f, loop->link[k]);
        const kt_real1 *w = kt_front_wrench(f, row, k);
        for (int i = 0; i < c && slot >= 0; i++) {
            sum += w[i] * kt_front_constant(f, slot)[i];
            *size = kt_most1(*size, kt_abs1(w[i]) * f->speed[2 * f->step[slot].slot + (i >= angular)]);
        }
    }
    return sum;
}

void KT_KERNEL(kt_front_apply)(const kt_model *model, kt_data *data, size_t g, kt_rows rows, const kt_real1 *x,
                               kt_real1 *out, kt_real1 *size) {
    assert(g < model->n.group && model->group[g].has_fronts);
    assert(x != out);
    const kt_real1 zero = kt_real1_splat(0.0);
    kt_front f;
    kt_front_find(model, data, g, rows, &f);
    for (int s = 0; s < f.group->link_count; s++) {
        const kt_front_step *step = &f.step[s];
        move_at(&f, step, x, kt_front_constant(&f, s), f.speed + 2 * step->slot);
        for (int i = step->term; i < step->term + step->term_count; i++) {
            const kt_front_term *term = &model->front_term[i];
            const kt_link *link = &model->link[model->term[term->term].link];
            kt_real1 *sum = kt_front_constant(&f, f.group->link_count + term->slot),
                     *most = kt_front_vector(&f, f.group->link_count + term->slot);
            const kt_real1 add =
                kt_front_is_fixed(&f, link->local) ? zero : model->term[term->term].coefficient * x[link->v];
            *sum = (term->first ? zero : *sum) + add;
            *most = kt_most1(term->first ? zero : *most, kt_abs1(add));
        }
        for (int i = step->loop; i < step->loop + step->loop_count; i++) {
            const kt_loop_record *loop = &model->loop[model->front_loop[i]];
            const int32_t *slot = f.model->slot + loop->slot;
            for (int r = 0; r < loop->row_count; r++) {
                kt_real1 most = zero;
                if (!kt_front_counts(&f, slot[r]))
                    continue;
                const int32_t relation = loop->term_count ? kt_front_relation_of(&f, step, model->front_loop[i]) : -1;
                out[slot[r]] = relation < 0 ? row_at(&f, loop, slot[r], &most) : *kt_front_constant(&f, relation);
                if (size)
                    size[slot[r]] = relation < 0 ? most : *kt_front_vector(&f, relation);
            }
        }
    }
}
