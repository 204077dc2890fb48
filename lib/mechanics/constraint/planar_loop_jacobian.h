/* The equations of a group's loops in a plane: A', phi, phi_t and b'' as in loop_jacobian.h, for vectors of two
 * components.
 *
 * J u = (-u_y, u_x) is u rotated by a right angle, so that w x u = w J u. The velocities alone give no angular
 * acceleration in a plane. Let d = p2 - p1 be the vector between the ends' points. The ends have the angular velocities
 * w1 and w2. The ends' points have the accelerations a1 and a2 that the velocities alone give. Let u = d' - w1 J d. For
 * a row
 *   along e       phi   = e . d + constant
 *                 phi'' = e . (a2 - a1 - 2 w1 J u + w1^2 d)
 *   rotation      phi   = k p,  p = 4 tan(theta / 4)
 *                 phi'  = k (1 + p^2 / 16) (w2 - w1)
 *                 phi'' = p phi' (w2 - w1) / 8
 *   orthogonal    phi   = 2 c / (1 + |s|),  c = cos(theta), s = sin(theta)        (orientation.h has the derivation)
 *                 phi'  = -2 sgn(s) / (1 + |s|) (w2 - w1)
 *                 phi'' = 2 c / (1 + |s|)^2 (w2 - w1)^2
 *   distance      phi   = |D| - L(t),  D = (d, height),  n = D / |D|
 *                 phi'' = n . (a2 - a1) + |n x d'|^2 / |D| - L''
 * A spatial row is the row of the loop's type in space (loop/loop.h), for ends in the basis (e1, e2, n) of the plane.
 * Only the moment about n and the force in the plane are taken from its wrench.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_PLANAR_LOOP_JACOBIAN_H
#define KT_CONSTRAINT_PLANAR_LOOP_JACOBIAN_H

#include "constraint/group.h"
#include "constraint/loop_jacobian.h"
#include "dynamics/sweep_planar.h"

#include <float.h>

/* An end of a loop relative to the ancestor's origin, as if this origin were at rest; `linear` is the part of the
 * acceleration that velocities cause. */
typedef struct kt_planar_end {
    kt_real1 arm[2]; /* from its link's origin */
    kt_real1 point[2], velocity[2], linear[2], omega;
} kt_planar_end;

/* A row's force on the second end at its point and moment about n, for a unit multiplier; its index among the rows. */
typedef struct kt_planar_wrench {
    kt_real1 force[2], moment;
    int32_t slot;
} kt_planar_wrench;

/* The motion of end k relative to the point flat->origin of the ancestor, link by link along its path; `linear` is the
 * acceleration that the velocities alone give. Without `moving`, velocities count as zero. */
KT_INLINE void kt_planar_end_follow(const kt_model *model, const kt_data *data, const kt_loop_record *loop,
                                    const kt_planar_loop *flat, int k, bool moving, const kt_real1 *v,
                                    kt_planar_end *end) {
    const int32_t *path = model->path + loop->path[k], count = loop->length[k], first = model->to_planar;
    const kt_real1 zero = kt_real1_splat(0.0);
    kt_real1 x = kt_real1_splat(-flat->origin[0]), y = kt_real1_splat(-flat->origin[1]);
    kt_real1 vx = zero, vy = zero, ax = zero, ay = zero, w = moving ? data->planar[flat->ancestor].omega : zero;
    for (int i = 0; i < count; i++) {
        const kt_planar_link *link = &model->planar[path[i] + first];
        const kt_planar_motion *m = &data->planar[path[i] + first];
        x += m->offset[0];
        y += m->offset[1];
        if (!moving)
            continue;
        vx -= w * m->offset[1];
        vy += w * m->offset[0];
        ax += m->linear[0];
        ay += m->linear[1];
        w = m->omega;
        if (!link->revolute) {
            kt_real1 u[2];
            kt_planar_along(link, m, u);
            vx += v[link->v] * u[0];
            vy += v[link->v] * u[1];
        }
    }
    kt_planar_rotate(&data->planar[flat->link[k]], flat->arm[k], end->arm);
    end->omega = w;
    end->point[0] = x + end->arm[0];
    end->point[1] = y + end->arm[1];
    end->velocity[0] = vx - w * end->arm[1];
    end->velocity[1] = vy + w * end->arm[0];
    end->linear[0] = ax - w * w * end->arm[0];
    end->linear[1] = ay - w * w * end->arm[1];
}

/* The quantities that the rows of a loop share. */
typedef struct kt_planar_relative {
    kt_real1 d[2], rate[2], linear[2]; /* d; d'; a2 - a1 */
    kt_real1 relative[2];              /* a2 - a1 - 2 w1 J u + w1^2 d */
    kt_real1 w;                        /* w2 - w1 */
    const kt_planar_motion *first, *second;
} kt_planar_relative;

KT_INLINE void kt_planar_relate(const kt_data *data, const kt_planar_loop *flat, const kt_planar_end end[2],
                                kt_planar_relative *r) {
    for (int k = 0; k < 2; k++) {
        r->d[k] = end[1].point[k] - end[0].point[k];
        r->rate[k] = end[1].velocity[k] - end[0].velocity[k];
        r->linear[k] = end[1].linear[k] - end[0].linear[k];
    }
    const kt_real1 w1 = end[0].omega, twice = 2.0 * w1, ww = w1 * w1;
    const kt_real1 ux = r->rate[0] + w1 * r->d[1], uy = r->rate[1] - w1 * r->d[0];
    r->relative[0] = r->linear[0] + (twice * uy + ww * r->d[0]);
    r->relative[1] = r->linear[1] - (twice * ux - ww * r->d[1]);
    r->w = end[1].omega - w1;
    r->first = &data->planar[flat->link[0]];
    r->second = &data->planar[flat->link[1]];
}

/* theta: cosine and sine. */
KT_INLINE void kt_planar_angle(const kt_planar_loop *flat, const kt_planar_relative *r, kt_real1 *cosine,
                               kt_real1 *sine) {
    const kt_planar_motion *a = r->first, *b = r->second;
    const kt_real1 c = a->c * b->c + a->s * b->s, s = a->c * b->s - a->s * b->c;
    *cosine = c * flat->c - s * flat->s;
    *sine = s * flat->c + c * flat->s;
}

/* phi, phi_t and phi'' for zero joint accelerations. */
typedef struct kt_planar_value {
    kt_real1 residual, rate, bias;
} kt_planar_value;

KT_INLINE kt_planar_value kt_planar_row_along(const kt_planar_row *row, const kt_planar_relative *r,
                                              kt_planar_wrench *w) {
    kt_planar_rotate(r->first, row->e, w->force);
    w->moment = kt_real1_splat(0.0);
    return (kt_planar_value){.residual = (w->force[0] * r->d[0] + w->force[1] * r->d[1]) + row->constant,
                             .rate = kt_real1_splat(0.0),
                             .bias = w->force[0] * r->relative[0] + w->force[1] * r->relative[1]};
}

/* x with the sign of another number. */
KT_OPERATOR kt_real1 kt_planar_signed(kt_real1 x, kt_real1 sign) {
#ifdef KT_LANES
    return (kt_real1)(((kt_condition)x & INT64_MAX) | ((kt_condition)sign & INT64_MIN));
#else
    return copysign(x, sign);
#endif
}

/* Returns 4 tan(theta / 4). The larger of sin and cos of theta / 2 is computed first, and the smaller from the larger,
 * so that neither loses digits. */
KT_INLINE kt_real1 kt_planar_turn(kt_real1 c, kt_real1 s) {
    const kt_real1 large = kt_sqrt1(0.5 * (1.0 + kt_abs1(c))), small = 0.5 * kt_abs1(s) / large;
    const kt_real1 cosine = KT_CHOOSE(c >= 0.0, large, small),
                   sine = kt_planar_signed(KT_CHOOSE(c >= 0.0, small, large), s);
    return 4.0 * sine / (1.0 + cosine);
}

KT_INLINE kt_planar_value kt_planar_row_rotation(const kt_planar_loop *flat, const kt_planar_row *row,
                                                 const kt_planar_relative *r, kt_planar_wrench *w) {
    kt_real1 c, s;
    kt_planar_angle(flat, r, &c, &s);
    const kt_real1 p = kt_planar_turn(c, s), derivative = 1.0 + p * p / 16.0;
    w->force[0] = w->force[1] = kt_real1_splat(0.0);
    w->moment = row->constant * derivative;
    return (kt_planar_value){
        .residual = row->constant * p, .rate = kt_real1_splat(0.0), .bias = 0.125 * p * w->moment * (r->w * r->w)};
}

KT_INLINE kt_planar_value kt_planar_row_orthogonal(const kt_planar_loop *flat, const kt_planar_relative *r,
                                                   kt_planar_wrench *w) {
    kt_real1 c, s;
    kt_planar_angle(flat, r, &c, &s);
    const kt_real1 one = 1.0 + kt_abs1(s);
    w->force[0] = w->force[1] = kt_real1_splat(0.0);
    w->moment = -kt_planar_signed(2.0 / one, s);
    return (kt_planar_value){
        .residual = 2.0 * c / one, .rate = kt_real1_splat(0.0), .bias = 2.0 * c / (one * one) * (r->w * r->w)};
}

KT_INLINE kt_planar_value kt_planar_row_distance(const kt_model *model, const kt_loop_record *loop,
                                                 const kt_planar_loop *flat, const kt_planar_row *row,
                                                 const kt_planar_relative *r, kt_real1 t, kt_planar_wrench *w) {
    const kt_real1 *d = r->d, zero = kt_real1_splat(0.0);
    const double h = flat->height;
    kt_real1 length[3], d2 = d[0] * d[0] + d[1] * d[1] + h * h;
    kt_loop_function(loop, model->number, t, length);
#ifndef KT_LANES
    const bool apart = d2 > DBL_MIN; /* as in loop/distance.c */
#else
    const bool apart = true; /* a state in which they are not has no numbers, and leaves the lanes */
    d2 = kt_choose(d2 > DBL_MIN, d2, kt_real1_splat((double)NAN));
#endif
    const kt_real1 norm = apart ? kt_sqrt1(d2) : zero, sine = apart ? h / norm : zero;
    if (apart) {
        w->force[0] = d[0] / norm;
        w->force[1] = d[1] / norm;
    } else {
        kt_planar_rotate(r->first, row->e, w->force);
    }
    w->moment = zero;
    const kt_real1 across = w->force[0] * r->rate[1] - w->force[1] * r->rate[0];
    const kt_real1 speed2 = r->rate[0] * r->rate[0] + r->rate[1] * r->rate[1];
    const kt_real1 bias = apart ? (across * across + sine * sine * speed2) / norm : zero;
    return (kt_planar_value){.residual = norm - length[0],
                             .rate = -length[1],
                             .bias = bias - length[2] + w->force[0] * r->linear[0] + w->force[1] * r->linear[1]};
}

/* A loop with its form in the plane, the indices of its rows among the rows of the group, and the positions. */
typedef struct kt_loop_in_plane {
    const kt_loop_record *loop;
    const kt_planar_loop *flat;
    const int32_t *slot;
    const kt_real1 *q; /* NULL: no row counts turns */
} kt_loop_in_plane;

#ifndef KT_LANES
/* Evaluates the rows of a loop that are not left out and have the same form as in space (planar_rows_in_space.c).
 * Returns their number.
 */
#define KT_ROWS_IN_SPACE_DECLARE(isa)                                                                                  \
    int kt_planar_rows_in_space_##isa(const kt_model *model, const kt_data *data, const kt_group_work *w,              \
                                      const kt_loop_in_plane *x, const kt_planar_end end[2], double t,                 \
                                      kt_planar_wrench *rows);
KT_EACH_ISA(KT_ROWS_IN_SPACE_DECLARE)
#undef KT_ROWS_IN_SPACE_DECLARE
#endif

/* Evaluates the rows of one loop that are not left out: their wrenches, and everything but A'. Returns their number. As
 * long as ranks are unknown, the rows 0 = 0 that come last have indices, too: all of a loop, or none. In lanes no row
 * has the form of space (kt_lanes_fit_model). */
KT_INLINE int kt_planar_rows_evaluate(const kt_model *model, const kt_data *data, const kt_group_work *w,
                                      const kt_loop_in_plane *x, const kt_planar_end end[2],
                                      const kt_planar_relative *r, kt_real1 t, kt_planar_wrench *rows) {
    const kt_planar_loop *flat = x->flat;
    const bool has_vanishing = flat->vanishing_count > 0 && x->slot[flat->row[flat->count].row] >= 0;
    const int last = flat->count + (has_vanishing ? flat->vanishing_count : 0);
    int count = 0;
#ifndef KT_LANES
    int in_space = 0;
#else
    (void)data, (void)end;
#endif
    for (int i = 0; i < last; i++) {
        const kt_planar_row *row = &flat->row[i];
        const int32_t at = x->slot[row->row];
        kt_planar_wrench *out = &rows[count];
        kt_planar_value value;
        if (at < 0)
            continue;
        switch ((kt_planar_row_kind)row->kind) {
        case KT_PLANAR_ROW_ALONG:
            value = kt_planar_row_along(row, r, out);
            break;
        case KT_PLANAR_ROW_ROTATION:
            value = kt_planar_row_rotation(flat, row, r, out);
            break;
        case KT_PLANAR_ROW_ORTHOGONAL:
            value = kt_planar_row_orthogonal(flat, r, out);
            break;
        case KT_PLANAR_ROW_DISTANCE:
            value = kt_planar_row_distance(model, x->loop, flat, row, r, t, out);
            break;
        case KT_PLANAR_ROW_VOID:
            out->force[0] = out->force[1] = out->moment = kt_real1_splat(0.0);
            value.residual = value.rate = value.bias = kt_real1_splat(0.0);
            break;
        case KT_PLANAR_ROW_SPATIAL:
        default:
#ifndef KT_LANES
            in_space++;
#endif
            continue;
        }
        out->slot = at;
        w->residual[at] = value.residual;
        w->closes[at] = kt_real1_splat(1.0);
        w->scale[at] = kt_real1_splat(
            row->kind == KT_PLANAR_ROW_ALONG || row->kind == KT_PLANAR_ROW_DISTANCE ? model->length : 1.0);
        w->rate[at] = value.rate;
        w->right[at] = -value.bias;
        count++;
    }
#ifndef KT_LANES
    if (in_space) {
        const kt_group_work work = *w; /* copies, so that for all other loops *w and *x need not be in memory */
        const kt_loop_in_plane same = *x;
        count += KT_KERNEL(kt_planar_rows_in_space)(model, data, &work, &same, end, t, rows + count);
    }
#endif
    return count;
}

/* Writes A' of one path. `arm` is the vector from the origin of the end's link to the second end's point. */
KT_INLINE void kt_planar_rows_path(const kt_model *model, const kt_data *data, const kt_group_work *w,
                                   const kt_loop_record *loop, int k, const kt_planar_wrench *rows, int count,
                                   const kt_real1 arm[2]) {
    const double sign = k ? 1.0 : -1.0;
    const int32_t *path = model->path + loop->path[k], first = model->to_planar, stride = w->m;
    const kt_planar_link *links = model->planar + first;
    const kt_planar_motion *motion = data->planar + first;
    kt_real1 *a = w->a, ax = arm[0], ay = arm[1];
    for (int i = loop->length[k] - 1; i >= 0; i--) {
        const kt_planar_link *link = &links[path[i]];
        const kt_planar_motion *m = &motion[path[i]];
        kt_real1 *column = a + link->local;
        if (link->revolute) {
            const kt_const1 n = sign * link->sign;
            for (int r = 0; r < count; r++)
                column[rows[r].slot * stride] = n * (rows[r].moment + (ax * rows[r].force[1] - ay * rows[r].force[0]));
        } else {
            kt_real1 u[2];
            kt_planar_along(link, m, u);
            for (int r = 0; r < count; r++)
                column[rows[r].slot * stride] = sign * (rows[r].force[0] * u[0] + rows[r].force[1] * u[1]);
        }
        ax += m->offset[0];
        ay += m->offset[1];
    }
}

/* Does the same as kt_rows_loop, in the plane. */
KT_INLINE void kt_planar_rows_loop(const kt_model *model, const kt_data *data, const kt_group_work *w,
                                   const kt_loop_in_plane *x, bool moving, const kt_real1 *v, kt_real1 t) {
    const kt_loop_record *loop = x->loop;
    kt_planar_end end[2];
    kt_planar_relative r;
    kt_planar_wrench rows[KT_PLANAR_ROW_MAX];
    if (loop->term_count) {
        kt_rows_relation(model, &model->group[loop->group], w, loop, x->slot[0], x->q, moving ? v : NULL, t);
        return;
    }
    for (int k = 0; k < 2; k++)
        kt_planar_end_follow(model, data, loop, x->flat, k, moving, v, &end[k]);
    kt_planar_relate(data, x->flat, end, &r);
    const int count = kt_planar_rows_evaluate(model, data, w, x, end, &r, t, rows);
    const kt_real1 first[2] = {end[0].arm[0] + r.d[0], end[0].arm[1] + r.d[1]};
    kt_planar_rows_path(model, data, w, loop, 0, rows, count, first);
    kt_planar_rows_path(model, data, w, loop, 1, rows, count, end[1].arm);
}

/* Does the same as kt_rows_fill, in the plane. */
KT_INLINE void kt_planar_rows_fill(const kt_model *model, const kt_data *data, size_t g, const kt_group_work *w,
                                   bool moving, const kt_real1 *q, const kt_real1 *v, kt_real1 t) {
    const kt_group *group = &model->group[g];
    for (int i = 0; i < w->m * w->k; i++)
        w->a[i] = kt_real1_splat(0.0);
    for (int i = 0; i < group->loop_count; i++) {
        const int32_t index = model->group_loop[group->loop + i];
        const kt_loop_record *loop = &model->loop[index];
        const kt_loop_in_plane x = {loop, &model->planar_loop[index], model->slot + loop->slot, q};
        kt_planar_rows_loop(model, data, w, &x, moving, v, t);
    }
}

#endif
