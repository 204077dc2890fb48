/* The gradient of a sum of a loop's equations in a plane (model/planar_loop.h), with respect to positions and
 * velocities:
 *     S = sum_f lambda_f . phi'(p_f) + pi . phi''(v, a)
 * where phi'(p) is the rate of phi along the velocities p. The ancestor is at rest. Let d lead from point 1 to point 2.
 * The rate of d along p_f is d'_f, and its rates along the motion (v, a) are d' and d''. J is a rotation by a right
 * angle. For a row
 *   along e      phi' = e . d' + w1 J e . d,   phi'' = e . d'' + 2 w1 J e . d' + (alpha1 J e - w1^2 e) . d
 *   of theta     phi' = s w,   phi'' = s alpha + s' w^2          w, alpha: of end 2 against end 1; s = d phi / d theta
 *   distance     phi' = n . d',   phi'' = n . d'' + (d'^2 - (n . d')^2) / r
 * these give the gradients by d, d'_f, d', d'', by the angles and by the rates of the ends. A revolute joint at o turns
 * the parts that it carries,
 *     dP = J (P - o),   dP'_f = J (P' - o')_f,   dP'' = J (P'' - o'')     by q
 *     dP' = J (P - o),  dP'' = 2 J (P' - o')                              by v
 * A prismatic joint along e turns with w and alpha. A prismatic joint adds e, w_f J e and alpha J e - w^2 e by q; by v,
 * it adds e and 2 w J e. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/gradient.h"
#include "constraint/planar_loop_jacobian.h"

enum { FIELDS = 3, MOTION = 2 /* the field v, after p_0 and p_1 */ };

/* A point on a path: position, angular velocities and velocities along all fields, accelerations of the motion. */
typedef struct point {
    kt_v2 at, rate[FIELDS], linear;
    double w[FIELDS], alpha;
} point;

/* A loop, and the gradients by the motion between its ends: d, d'_f, d'' and for each end its angle and rate. */
typedef struct gradient {
    const kt_model *model;
    const kt_data *data;
    const kt_loop_record *loop;
    const kt_planar_loop *flat;
    const double *field[FIELDS], *a;
    point end[2];
    kt_v2 by_d, by_rate[FIELDS], by_linear;
    double by_angle[2], by_w[2];
} gradient;

static double cross_planar(kt_v2 a, kt_v2 b) { return a[0] * b[1] - a[1] * b[0]; } /* J a . b */

static kt_v2 scaled(double s, kt_v2 a) { return kt_v2_splat(s) * a; }

/* Carries a point along r, fixed in the link that moves the point. */
static void carry(const gradient *g, kt_v2 r, point *x) {
    const kt_v2 turned = kt_v2_across(r);
    x->at += r;
    for (int f = 0; f < FIELDS; f++)
        if (g->field[f])
            x->rate[f] += scaled(x->w[f], turned);
    x->linear += scaled(x->alpha, turned) - scaled(x->w[MOTION] * x->w[MOTION], r);
}

/* Adds the motion of joint i to the motion of a point:
 *     revolute            w_f += p_f,      alpha += a_i
 *     prismatic along e   d'_f += p_f e,   d'' += a_i e + 2 w v_i J e */
static void move_along_joint(const gradient *g, const kt_planar_link *link, kt_v2 e, point *x) {
    const int32_t i = link->v;
    const double sign = link->revolute ? link->sign : 0.0, w = x->w[MOTION];
    if (!link->revolute && g->a)
        x->linear += scaled(g->a[i], e) + scaled(2.0 * w * g->field[MOTION][i], kt_v2_across(e));
    if (g->a)
        x->alpha += sign * g->a[i];
    for (int f = 0; f < FIELDS; f++) {
        if (!g->field[f])
            continue;
        x->w[f] += sign * g->field[f][i];
        if (!link->revolute)
            x->rate[f] += scaled(g->field[f][i], e);
    }
}

static const kt_planar_link *path_link_of(const gradient *g, int k, int i, const kt_planar_motion **m) {
    const int32_t at = g->model->path[g->loop->path[k] + i] + g->model->to_planar;
    *m = &g->data->planar[at];
    return &g->model->planar[at];
}

static kt_v2 axis_along(const kt_planar_link *link, const kt_planar_motion *m) {
    return link->revolute ? kt_v2_splat(0.0) : kt_planar_sum(kt_v2_load(m->rotation), link->along[0], link->along[1]);
}

/* Follows the joints from the ancestor to end k. */
static void follow_end_path(gradient *g, int k) {
    const double *arm = g->flat->arm[k];
    point *x = &g->end[k];
    *x = (point){.at = -kt_v2_load(g->flat->origin)};
    for (int i = 0; i < g->loop->length[k]; i++) {
        const kt_planar_motion *m;
        const kt_planar_link *link = path_link_of(g, k, i, &m);
        carry(g, kt_v2_load(m->offset), x);
        move_along_joint(g, link, axis_along(link, m), x);
    }
    carry(g, kt_planar_sum(kt_v2_load(g->data->planar[g->flat->link[k]].rotation), arm[0], arm[1]), x);
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* Adds rows along an axis: `sum` are the axes times lambda_f, and last times pi. */
static void add_axis_rows(gradient *g, const kt_v2 sum[FIELDS]) {
    const point *one = &g->end[0], *two = &g->end[1];
    const kt_v2 d = two->at - one->at, rate = two->rate[MOTION] - one->rate[MOTION];
    const kt_v2 linear = two->linear - one->linear, pi = sum[MOTION], turned = kt_v2_across(pi);
    const double w = one->w[MOTION], alpha = one->alpha;
    for (int f = 0; f < MOTION; f++) {
        const kt_v2 across_f = kt_v2_across(sum[f]);
        g->by_rate[f] += sum[f];
        g->by_d += scaled(one->w[f], across_f);
        g->by_angle[0] += kt_v2_dot(across_f, two->rate[f] - one->rate[f]) - one->w[f] * kt_v2_dot(sum[f], d);
    }
    g->by_linear += pi;
    g->by_rate[MOTION] += scaled(2.0 * w, turned);
    g->by_d += scaled(alpha, turned) - scaled(w * w, pi);
    g->by_angle[0] += kt_v2_dot(turned, linear) - 2.0 * w * kt_v2_dot(pi, rate) - alpha * kt_v2_dot(pi, d) -
                      w * w * kt_v2_dot(turned, d);
    g->by_w[0] += 2.0 * (kt_v2_dot(turned, rate) - w * kt_v2_dot(pi, d));
}

/* Adds a row that is a function of theta; s: its first three derivatives. */
static void add_turn(gradient *g, const double s[3], const double weight[FIELDS]) {
    const point *one = &g->end[0], *two = &g->end[1];
    const double w = two->w[MOTION] - one->w[MOTION], alpha = two->alpha - one->alpha;
    double by_angle = weight[MOTION] * (s[1] * alpha + s[2] * w * w);
    for (int f = 0; f < MOTION; f++)
        by_angle += weight[f] * s[1] * (two->w[f] - one->w[f]);
    for (int k = 0; k < 2; k++) {
        const double sign = k ? 1.0 : -1.0;
        g->by_angle[k] += sign * by_angle;
        g->by_w[k] += sign * weight[MOTION] * 2.0 * s[1] * w;
    }
}

/* The first three derivatives s, by theta, of the row of an angle: phi = factor p with p = 4 tan(theta / 4), for
 * which dp/dtheta = 1 + p^2 / 16. */
static void find_turn(double cosine, double sine, double factor, double s[3]) {
    const double p = kt_planar_turn(cosine, sine), dp = 1.0 + p * p / 16.0;
    s[0] = factor * dp;
    s[1] = factor * 0.125 * p * dp;
    s[2] = factor * 0.125 * dp * (1.0 + 3.0 * p * p / 16.0);
}

/* The first three derivatives, by theta, of the row of a right angle: phi = 2 c / (1 + |s|) with c = cos(theta), s =
 * sin(theta). */
static void find_normal(double cosine, double sine, double s[3]) {
    const double one = 1.0 + fabs(sine), sign = copysign(1.0, sine);
    s[0] = -2.0 * sign / one;
    s[1] = 2.0 * cosine / (one * one);
    s[2] = -2.0 * sine / (one * one) - 4.0 * cosine * cosine * sign / (one * one * one);
}

static kt_v2 row_axis_of(const gradient *g, const kt_planar_row *row) {
    return kt_planar_sum(kt_v2_load(g->data->planar[g->flat->link[0]].rotation), row->e[0], row->e[1]);
}

/* phi' = n . d',   phi'' = n . d'' + (d'^2 - (n . d')^2) / r,   n = d / r */
static void add_distance_gradient(gradient *g, const kt_planar_row *row, const double weight[FIELDS]) {
    const point *one = &g->end[0], *two = &g->end[1];
    const kt_v2 d = two->at - one->at, rate = two->rate[MOTION] - one->rate[MOTION];
    const kt_v2 linear = two->linear - one->linear;
    const double d2 = kt_v2_dot(d, d) + g->flat->height * g->flat->height;
    const bool apart = d2 > DBL_MIN; /* as in planar_loop_jacobian.h */
    const double inverse = apart ? 1.0 / sqrt(d2) : 0.0, pi = weight[MOTION];
    const kt_v2 n = apart ? scaled(inverse, d) : row_axis_of(g, row);
    const double along_n = kt_v2_dot(n, rate);
    const kt_v2 rest = rate - scaled(along_n, n);
    for (int f = 0; f < MOTION; f++) {
        const kt_v2 x = two->rate[f] - one->rate[f];
        g->by_rate[f] += scaled(weight[f], n);
        g->by_d += scaled(weight[f] * inverse, x - scaled(kt_v2_dot(n, x), n));
    }
    g->by_linear += scaled(pi, n);
    g->by_rate[MOTION] += scaled(2.0 * pi * inverse, rest);
    g->by_d += scaled(pi * inverse, linear - scaled(kt_v2_dot(n, linear), n));
    g->by_d -= scaled(pi * inverse * inverse,
                      scaled(kt_v2_dot(rate, rate) - along_n * along_n, n) + scaled(2.0 * along_n, rest));
}

/* The first three derivatives of a row by theta. */
static void find_derivatives(const gradient *g, const kt_planar_row *row, double s[3]) {
    const kt_planar_relative relative = {.first = &g->data->planar[g->flat->link[0]],
                                         .second = &g->data->planar[g->flat->link[1]]};
    double cosine, sine;
    kt_planar_angle(g->flat, &relative, &cosine, &sine);
    if (row->kind == KT_PLANAR_ROW_ROTATION)
        find_turn(cosine, sine, row->constant, s);
    else
        find_normal(cosine, sine, s);
}

/* Adds a row; rows along an axis are added to a common sum. */
static void add_row_gradient(gradient *g, const kt_planar_row *row, const double weight[FIELDS], kt_v2 axes[FIELDS]) {
    double s[3];
    if (row->kind == KT_PLANAR_ROW_ALONG) {
        const kt_v2 e = row_axis_of(g, row);
        for (int f = 0; f < FIELDS; f++)
            axes[f] += scaled(weight[f], e);
    } else if (row->kind == KT_PLANAR_ROW_DISTANCE) {
        add_distance_gradient(g, row, weight);
    } else {
        find_derivatives(g, row, s);
        add_turn(g, s, weight);
    }
}

/* Adds the gradients of all rows of a loop, weighted with the multipliers of up to three fields. */
static void add_rows(gradient *g, const kt_loop_sum *sum) {
    const kt_planar_loop *flat = g->flat;
    kt_v2 axes[FIELDS] = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    for (int i = 0; i < flat->count; i++) {
        const int32_t at = g->loop->equation + flat->row[i].row;
        const double weight[FIELDS] = {sum->lambda[0] ? sum->lambda[0][at] : 0.0,
                                       sum->lambda[1] ? sum->lambda[1][at] : 0.0, sum->pi ? sum->pi[at] : 0.0};
        add_row_gradient(g, &flat->row[i], weight, axes);
    }
    add_axis_rows(g, axes);
}

/* ---- joints ------------------------------------------------------------------------------------------------------ */

/* The joint of a link whose origin is at o, on the path to end k. */
static void write_joint_gradient(const gradient *g, int k, const kt_planar_link *link, kt_v2 e, const point *o,
                                 double *by_q, double *by_v) {
    const point *p = &g->end[k];
    const double sign = k ? 1.0 : -1.0, w = o->w[MOTION];
    double q, v;
    if (link->revolute) {
        q = cross_planar(p->at - o->at, g->by_d) + cross_planar(p->linear - o->linear, g->by_linear);
        v = cross_planar(p->at - o->at, g->by_rate[MOTION]) +
            2.0 * cross_planar(p->rate[MOTION] - o->rate[MOTION], g->by_linear);
    } else {
        q = kt_v2_dot(e, g->by_d) + o->alpha * cross_planar(e, g->by_linear) - w * w * kt_v2_dot(e, g->by_linear);
        v = kt_v2_dot(e, g->by_rate[MOTION]) + 2.0 * w * cross_planar(e, g->by_linear);
    }
    for (int f = 0; f < FIELDS; f++)
        q += link->revolute ? cross_planar(p->rate[f] - o->rate[f], g->by_rate[f])
                            : o->w[f] * cross_planar(e, g->by_rate[f]);
    if (link->revolute) {
        by_q[link->v] += link->sign * (sign * q + g->by_angle[k]);
        by_v[link->v] += link->sign * (sign * v + g->by_w[k]);
        return;
    }
    by_q[link->v] += sign * q;
    by_v[link->v] += sign * v;
}

/* Follows the joints to end k once more, and writes the gradient by each. */
static void write_path_gradient(const gradient *g, int k, double *by_q, double *by_v) {
    point x = {.at = -kt_v2_load(g->flat->origin)};
    for (int i = 0; i < g->loop->length[k]; i++) {
        const kt_planar_motion *m;
        const kt_planar_link *link = path_link_of(g, k, i, &m);
        const kt_v2 e = axis_along(link, m);
        carry(g, kt_v2_load(m->offset), &x);
        write_joint_gradient(g, k, link, e, &x, by_q, by_v);
        move_along_joint(g, link, e, &x);
    }
}

void KT_KERNEL(kt_planar_loop_gradient)(const kt_model *model, const kt_data *data, int32_t index,
                                        const kt_loop_sum *sum, double *by_q, double *by_v) {
    gradient g = {.model = model,
                  .data = data,
                  .loop = &model->loop[index],
                  .flat = &model->planar_loop[index],
                  .field = {sum->p[0], sum->p[1], sum->v},
                  .a = sum->a};
    for (int k = 0; k < 2; k++)
        follow_end_path(&g, k);
    add_rows(&g, sum);
    for (int k = 0; k < 2; k++)
        write_path_gradient(&g, k, by_q, by_v);
}

/* ---- matrices ---------------------------------------------------------------------------------------------------- */

/* The joints of both paths one by one, and their derivatives. Thus one pass over the paths serves all equations and the
 * sum of their second derivatives. A joint that carries another joint rotates the D of that joint. D_j = dd/dq_j; t_j
 * is the angle by which joint j turns its end, and theta_j the angle by which it turns end 2 against end 1.
 *     d^2(lambda . phi)/dq_j dq_k = (N + E) . t_j J D_k + J E . (t1_j D_k + t1_k D_j) - E . d t1_j t1_k
 *                                   + s' theta_j theta_k + D_j . B D_k
 * with j = k or j before k on its path.
 *     E = sum lambda e
 *     N, B: sum lambda n and lambda (1 - n n') / r of distances
 *     s' = sum lambda d^2 phi / d theta^2 */
typedef struct joint {
    kt_v2 d, rate, linear; /* derivatives of d, d' and d'' by its position */
    kt_v2 by_v;            /* of d'' by its rate, which changes d' as the position does d */
    double turn;           /* t_j */
    int32_t v, end;
} joint;

_Static_assert(sizeof(joint) <= sizeof(kt_support_dof), "one memory holds either");

/* Fields are p_1 for velocities alone, or v. */
static joint gradient_joint_of(const gradient *g, int k, int field, const kt_planar_link *link, kt_v2 e,
                               const point *o) {
    const point *p = &g->end[k];
    const double sign = (k ? 1.0 : -1.0) * (link->revolute ? link->sign : 1.0), w = o->w[field];
    joint j = {.turn = link->revolute ? link->sign : 0.0, .v = link->v, .end = k};
    if (link->revolute) {
        const kt_v2 rate = kt_v2_across(p->rate[field] - o->rate[field]);
        j.d = scaled(sign, kt_v2_across(p->at - o->at));
        j.rate = scaled(sign, rate);
        j.linear = scaled(sign, kt_v2_across(p->linear - o->linear));
        j.by_v = scaled(2.0 * sign, rate);
        return j;
    }
    const kt_v2 turned = kt_v2_across(e);
    j.d = scaled(sign, e);
    j.rate = scaled(sign * w, turned);
    j.linear = scaled(sign * o->alpha, turned) - scaled(sign * w * w, e);
    j.by_v = scaled(2.0 * sign * w, turned);
    return j;
}

/* Lists the joints on the paths to both ends of the loop, each with its part in the gradient. Returns their number. */
static size_t list_path_joints(const gradient *g, int field, joint *to) {
    size_t count = 0;
    for (int k = 0; k < 2; k++) {
        point x = {.at = -kt_v2_load(g->flat->origin)};
        for (int i = 0; i < g->loop->length[k]; i++) {
            const kt_planar_motion *m;
            const kt_planar_link *link = path_link_of(g, k, i, &m);
            const kt_v2 e = axis_along(link, m);
            carry(g, kt_v2_load(m->offset), &x);
            to[count++] = gradient_joint_of(g, k, field, link, e, &x);
            move_along_joint(g, link, e, &x);
        }
    }
    return count;
}

/* The derivatives of row r, times `sign`, into columns of p numbers. */
static void write_row_gradient(gradient *g, int field, const kt_planar_row *row, double sign, const joint *joints,
                               size_t count, double *by_q, double *by_v) {
    const size_t p = g->model->n.row, r = (size_t)g->loop->equation + (size_t)row->row;
    const kt_v2 none = {0.0, 0.0};
    double weight[FIELDS] = {0.0, 0.0, 0.0};
    kt_v2 axes[FIELDS] = {none, none, none};
    weight[field] = sign;
    g->by_d = g->by_linear = none;
    for (int f = 0; f < FIELDS; f++)
        g->by_rate[f] = none;
    for (int k = 0; k < 2; k++)
        g->by_angle[k] = g->by_w[k] = 0.0;
    add_row_gradient(g, row, weight, axes);
    if (row->kind == KT_PLANAR_ROW_ALONG)
        add_axis_rows(g, axes);
    for (size_t i = 0; i < count; i++) {
        const joint *j = &joints[i];
        const size_t at = (size_t)j->v * p + r;
        by_q[at] = kt_v2_dot2(j->d, g->by_d, j->rate, g->by_rate[field]) + kt_v2_dot(j->linear, g->by_linear) +
                   j->turn * g->by_angle[j->end];
        if (by_v)
            by_v[at] = kt_v2_dot2(j->d, g->by_rate[field], j->by_v, g->by_linear) + j->turn * g->by_w[j->end];
    }
}

/* The sums of second derivatives. */
typedef struct curvature {
    kt_v2 axis, normal; /* E, N */
    kt_v2 b[2];         /* columns of B */
    double turn;        /* s' */
} curvature;

/* Sums the second derivatives of the rows, each times its multiplier: E, N, B and s' of the formulas above. */
static curvature curvature_of(const gradient *g, const double *lambda) {
    const kt_v2 d = g->end[1].at - g->end[0].at, none = {0.0, 0.0};
    curvature c = {.axis = none, .normal = none, .b = {none, none}};
    for (int i = 0; i < g->flat->count; i++) {
        const kt_planar_row *row = &g->flat->row[i];
        const double weight = lambda[g->loop->equation + row->row],
                     d2 = kt_v2_dot(d, d) + g->flat->height * g->flat->height;
        double s[3];
        if (row->kind == KT_PLANAR_ROW_ALONG) {
            c.axis += scaled(weight, row_axis_of(g, row));
        } else if (row->kind != KT_PLANAR_ROW_DISTANCE) {
            find_derivatives(g, row, s);
            c.turn += weight * s[1];
        } else if (d2 > DBL_MIN) {
            const double inverse = 1.0 / sqrt(d2), by = weight * inverse;
            const kt_v2 n = scaled(inverse, d);
            c.normal += scaled(weight, n);
            c.b[0] += (kt_v2){by, 0.0} - scaled(by * n[0], n);
            c.b[1] += (kt_v2){0.0, by} - scaled(by * n[1], n);
        } else {
            c.normal += scaled(weight, row_axis_of(g, row));
        }
    }
    return c;
}

/* Subtracts the second derivatives from d_q. */
static void subtract_curvature(const gradient *g, const curvature *c, const joint *joints, size_t count, double *d_q) {
    const size_t n = g->model->n.v;
    const kt_v2 all = c->axis + c->normal, turned = kt_v2_across(c->axis);
    const double open = kt_v2_dot(c->axis, g->end[1].at - g->end[0].at);
    for (size_t b = 0; b < count; b++) {
        const joint *k = &joints[b];
        const double carried = kt_v2_dot(all, kt_v2_across(k->d)), across_k = kt_v2_dot(turned, k->d);
        const double one_k = k->end ? 0.0 : k->turn, theta_k = k->end ? k->turn : -k->turn;
        const kt_v2 bent = scaled(k->d[0], c->b[0]) + scaled(k->d[1], c->b[1]);
        for (size_t a = 0; a <= b; a++) {
            const joint *j = &joints[a];
            const double one_j = j->end ? 0.0 : j->turn, theta_j = j->end ? j->turn : -j->turn;
            const double x = (j->end == k->end ? j->turn * carried : 0.0) + one_j * across_k +
                             one_k * kt_v2_dot(turned, j->d) - open * one_j * one_k + c->turn * theta_j * theta_k +
                             kt_v2_dot(j->d, bent);
            d_q[(size_t)j->v * n + (size_t)k->v] -= x;
            if (a != b)
                d_q[(size_t)k->v * n + (size_t)j->v] -= x;
        }
    }
}

void KT_KERNEL(kt_planar_loop_matrices)(const kt_dual_motion *at, int32_t index, const double *lambda, bool moving,
                                        double *d_q, double *by_q, double *by_v) {
    const int field = moving ? MOTION : 1;
    joint *joints = (joint *)(void *)at->dof;
    gradient g = {.model = at->model,
                  .data = at->data,
                  .loop = &at->model->loop[index],
                  .flat = &at->model->planar_loop[index],
                  .a = moving ? at->a : NULL};
    g.field[field] = at->v;
    for (int k = 0; k < 2; k++)
        follow_end_path(&g, k);
    const size_t count = list_path_joints(&g, field, joints);
    for (int i = 0; i < g.flat->count; i++)
        write_row_gradient(&g, field, &g.flat->row[i], moving ? -1.0 : 1.0, joints, count, by_q, moving ? by_v : NULL);
    const curvature c = curvature_of(&g, lambda);
    subtract_curvature(&g, &c, joints, count, d_q);
}
