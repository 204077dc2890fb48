/* The smallest planar constraint group, solved in closed form: three coordinates x, and one pin that holds two points
 * together (four-bars, slider-cranks). One degree of freedom remains.
 *
 * Let c_i be the rate of p2 - p1 for a unit rate of x_i, as it enters the loop's rows. For a revolute joint, c_i is J
 * times the lever to p2; for a prismatic joint, its direction. (The rows are taken along e1 and e2, which changes no
 * solution.) With a x b = a_x b_y - a_y b_x for vectors in the plane (kt_cross2) and A = [c_1 c_2 c_3],
 *   null vector                 n  = (c_2 x c_3, c_3 x c_1, c_1 x c_2)
 *   least solution of A x0 = b'' x0 = ((b'' x c_1, b'' x c_2, b'' x c_3) x n) / n.n
 * Virtual power replaces the mass matrix. Let U_i = (w, u) be the velocities of the links at the rates n. Let A_i =
 * (alpha, a) be their accelerations for x0, together with the accelerations that velocities alone cause. Let IA_i and
 * (n_b, f_b) be their articulated inertias and bias wrenches. Then
 *   D = sum U_i . IA_i U_i
 *   z = (n . tau - sum U_i . (IA_i A_i + (n_b, f_b))) / D
 *   y = x0 + n z                     accelerations while the parent's acceleration A is zero
 * and with the momentum p = sum IA_i U_i about the parent's origin
 *   inertia on the parent            Ic - p p' / D
 *   bias wrench on the parent        W + p z
 *   accelerations                    x = y - n (p . A) / D
 * This is spatial_group.h for one degree of freedom.
 *
 * Every exceptional case (near a singular position, no inertia, not finite) is left to the general method.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_REDUCTION_PIN_H
#define KT_REDUCTION_PIN_H

#include "constraint/group.h"
#include "dynamics/aba_planar.h"

#include <assert.h>

enum { KT_PIN_LINKS = 3 };

/* gcc does not unroll loops of this length by itself. */
#if defined(__GNUC__) && !defined(__clang__)
#define KT_PIN_UNROLL _Pragma("GCC unroll 3")
#else
#define KT_PIN_UNROLL
#endif

/* Below this fraction of the inertia that the links carry along the degree of freedom, the general method decides
 * whether the inertia is zero. */
#define KT_PIN_INERTIA 1e-10

/* The letters of the equations above, a row a link, in the order of the paths: links of the first end come first. */
typedef struct kt_pin {
    const kt_planar_link *link[KT_PIN_LINKS];
    kt_real2 offset[KT_PIN_LINKS]; /* from the previous link */
    kt_real2 at[KT_PIN_LINKS];     /* from the parent's origin */
    kt_real2 bias[KT_PIN_LINKS];   /* acceleration from the velocities alone */
    kt_real2 along[KT_PIN_LINKS];  /* direction of prismatic joints */
    kt_real2 c[KT_PIN_LINKS];      /* rates of p2 - p1, columns of A */
    kt_real2 drift;                /* -b'' */
    kt_real1 n[KT_PIN_LINKS];      /* null vector */
    kt_real1 x[KT_PIN_LINKS];      /* x0 */
} kt_pin;

/* One end of the loop, relative to the parent's origin. */
typedef struct kt_pin_end {
    kt_real2 point, rate, linear; /* linear: from the velocities alone */
    kt_real1 omega;
} kt_pin_end;

/* The group, its loop and the parent. bound: the first links of the paths to the loop's ends. The links of the path to
 * end k are bound[k] to bound[k + 1] - 1. */
typedef struct kt_pin_group {
    const kt_group *group;
    const kt_loop_record *loop;
    const kt_planar_loop *flat;
    int32_t top;
    int bound[3];
} kt_pin_group;

/* Follows the path to end k, from the parent's angular velocity w. */
KT_INLINE kt_pin_end kt_pin_follow(const kt_model *model, const kt_data *data, const kt_pin_group *g, int k, kt_real1 w,
                                   const kt_real1 *v, kt_pin *p) {
    const kt_planar_loop *flat = g->flat;
    const int32_t *path = model->path + g->loop->path[k];
    const int from = g->bound[k], to = g->bound[k + 1];
    const kt_real2 none = kt_same2(0.0);
    kt_real2 at = kt_minus2(kt_from2(flat->origin)), rate = none, bias = none;
    const int32_t first = model->to_planar;
    KT_PIN_UNROLL
    for (int i = from; i < to; i++) {
        const int32_t index = path[i - from] + first;
        const kt_planar_link *link = p->link[i] = &model->planar[index];
        const kt_planar_motion *m = &data->planar[index];
        p->offset[i] = kt_load2(m->offset);
        at = kt_add2(at, p->offset[i]);
        bias = kt_add2(bias, kt_load2(m->linear));
        rate = kt_add_scaled2(rate, w, kt_across2(p->offset[i]));
        w = m->omega;
        p->along[i] = none;
        if (!link->revolute) {
            p->along[i] = kt_planar_const_sum(kt_load2(m->rotation), link->along);
            rate = kt_add_scaled2(rate, v[link->v], p->along[i]);
        }
        p->at[i] = at;
        p->bias[i] = bias;
    }
    const kt_real2 arm = kt_planar_sum_of(kt_load2(data->planar[flat->link[k]].rotation), flat->arm[k]);
    return (kt_pin_end){.point = kt_add2(at, arm),
                        .rate = kt_add_scaled2(rate, w, kt_across2(arm)),
                        .linear = kt_sub_scaled2(bias, w * w, arm),
                        .omega = w};
}

/* Computes c_i and the drift. `first`: the number of links on the first end's path. */
KT_INLINE void kt_pin_relate(const kt_pin_end *one, const kt_pin_end *two, int first, kt_pin *p) {
    const kt_real2 d = kt_sub2(two->point, one->point);
    const kt_real1 w = one->omega;
    const kt_real2 relative = kt_sub_scaled2(kt_sub2(two->rate, one->rate), w, kt_across2(d));
    p->drift = kt_add_scaled2(kt_sub2(two->linear, one->linear), w,
                              kt_sub2(kt_scale2(w, d), kt_mul2(kt_same2(2.0), kt_across2(relative))));
    KT_PIN_UNROLL
    for (int i = 0; i < KT_PIN_LINKS; i++) {
        const double sign = i < first ? -1.0 : 1.0;
        p->c[i] = p->link[i]->revolute
                      ? kt_mul2(kt_const_same2(sign * p->link[i]->sign), kt_across2(kt_sub2(two->point, p->at[i])))
                      : kt_mul2(kt_same2(sign), p->along[i]);
    }
}

/* Computes n and x0; returns false near a singular position. usual: the usual size of the group's last independent
 * direction. */
KT_INLINE kt_condition kt_pin_reduce(double usual, kt_pin *p) {
    const kt_real2 *c = p->c, b = kt_minus2(p->drift);
    const kt_real2 squares = kt_add2(kt_add2(kt_mul2(c[0], c[0]), kt_mul2(c[1], c[1])), kt_mul2(c[2], c[2]));
    const kt_real1 all = KT_PART2(squares, 0) + KT_PART2(squares, 1);
    const double small = KT_NEAR_SINGULAR * usual;
    kt_condition regular = kt_condition_true();
    kt_real1 *n = p->n, *x = p->x;
    n[0] = kt_cross2(c[1], c[2]);
    n[1] = kt_cross2(c[2], c[0]);
    n[2] = kt_cross2(c[0], c[1]);
    const kt_real1 nn = n[0] * n[0] + n[1] * n[1] + n[2] * n[2];
    /* the size of the last direction in QR is |n| divided by the norm of the longest row of A, at most that of A */
    if (kt_fails(&regular, nn > small * small * all) || kt_fails(&regular, nn > KT_RANK_TOLERANCE * (all * all)))
        return kt_condition_false();
    const kt_real1 one = 1.0 / nn, bx = KT_PART2(b, 0) * one, by = KT_PART2(b, 1) * one;
    const kt_real1 g0 = bx * KT_PART2(c[0], 1) - by * KT_PART2(c[0], 0);
    const kt_real1 g1 = bx * KT_PART2(c[1], 1) - by * KT_PART2(c[1], 0);
    const kt_real1 g2 = bx * KT_PART2(c[2], 1) - by * KT_PART2(c[2], 0);
    x[0] = g1 * n[2] - g2 * n[1];
    x[1] = g2 * n[0] - g0 * n[2];
    x[2] = g0 * n[1] - g1 * n[0];
    return regular;
}

/* The velocity of one link at the rates n, and its acceleration for x0. */
typedef struct kt_pin_body {
    kt_real1 w, alpha;
    kt_real2 u, a;
} kt_pin_body;

KT_INLINE void kt_pin_move(const kt_pin *p, int i, kt_pin_body *body) {
    const kt_real2 across = kt_across2(p->offset[i]);
    body->u = kt_add_scaled2(body->u, body->w, across);
    body->a = kt_add_scaled2(body->a, body->alpha, across);
    if (p->link[i]->revolute) {
        body->w += p->link[i]->sign * p->n[i];
        body->alpha += p->link[i]->sign * p->x[i];
    } else {
        body->u = kt_add_scaled2(body->u, p->n[i], p->along[i]);
        body->a = kt_add_scaled2(body->a, p->x[i], p->along[i]);
    }
}

/* Sums over the links: D, and the virtual power of the wrenches along n. If the parent moves, also the momentum p
 * (about its origin), Ic and W. */
typedef struct kt_pin_sum {
    kt_real1 inertia, power, carried, moment; /* `carried`: the scale that D is compared with */
    kt_real2 force;
    kt_planar_inertia total;
} kt_pin_sum;

/* Adds the terms of link i to the sums: its wrench IA A + (n, f), power U . wrench, and U . IA U. ground: -gravity if
 * the group is on the ground. If the group `rides` on a moving parent, also p, Ic and W about the parent's origin. */
KT_INLINE void kt_pin_add(const kt_pin *p, int i, const kt_pin_body *body, kt_real2 ground, bool rides,
                          const kt_planar_inertia *x, kt_pin_sum *sum) {
    const kt_real2 h = kt_load2(x->h), a = kt_add2(body->a, kt_add2(p->bias[i], ground));
    const kt_real2 diagonal = kt_make2(x->xx, x->yy);
    const kt_real1 moment = x->j * body->w + kt_dot2(h, body->u);
    const kt_real2 force = kt_add2(kt_scale2(body->w, h), kt_symmetric2_apply(diagonal, x->xy, body->u));
    sum->inertia += body->w * moment + kt_dot2(body->u, force);
    sum->carried += p->n[i] * p->n[i] * p->link[i]->size;
    if (!rides) {
        sum->power += (moment * body->alpha + body->w * x->moment) + kt_dots2(force, a, body->u, kt_load2(x->force));
        return;
    }
    kt_planar_inertia moved = *x;
    const kt_real2 resists =
        kt_add2(kt_load2(x->force), kt_add2(kt_scale2(body->alpha, h), kt_symmetric2_apply(diagonal, x->xy, a)));
    moved.moment += x->j * body->alpha + kt_dot2(h, a);
    kt_store2(moved.force, resists);
    sum->power += body->w * moved.moment + kt_dot2(body->u, resists);
    sum->moment += moment + kt_cross2(p->at[i], force);
    sum->force = kt_add2(sum->force, force);
    kt_planar_shift(&moved, (const kt_real1[2]){KT_PART2(p->at[i], 0), KT_PART2(p->at[i], 1)});
    kt_planar_add(&sum->total, &moved);
}

/* Adds the group's inertia and bias wrench to the parent; `one` is 1 / D. */
KT_INLINE void kt_pin_onto_parent(const kt_pin_sum *sum, kt_real1 one, kt_real1 z, kt_planar_inertia *parent) {
    kt_planar_inertia x = sum->total;
    const kt_real1 moment = sum->moment, fx = KT_PART2(sum->force, 0), fy = KT_PART2(sum->force, 1);
    const kt_real1 gx = fx * one, gy = fy * one;
    x.j -= moment * (moment * one);
    x.h[0] -= moment * gx;
    x.h[1] -= moment * gy;
    x.xx -= fx * gx;
    x.xy -= fx * gy;
    x.yy -= fy * gy;
    x.moment += moment * z;
    x.force[0] += fx * z;
    x.force[1] += fy * z;
    kt_planar_add(parent, &x);
}

/* Adds the links of the path to end k to the sums; the parent is at rest. */
KT_INLINE void kt_pin_sum_path(const kt_model *model, const kt_data *data, const kt_pin_group *g, int k,
                               const kt_pin *p, kt_real2 ground, const kt_real1 *tau, kt_pin_sum *sum) {
    const int from = g->bound[k], to = g->bound[k + 1];
    const bool rides = g->top != 0;
    const kt_real1 zero = kt_real1_splat(0.0);
    kt_pin_body body = {.w = zero, .alpha = zero, .u = kt_same2(0.0), .a = kt_same2(0.0)};
    KT_PIN_UNROLL
    for (int i = from; i < to; i++) {
        kt_pin_move(p, i, &body);
        kt_pin_add(p, i, &body, ground, rides, &data->planar_inertia[p->link[i] - model->planar], sum);
        sum->power -= p->n[i] * tau[p->link[i]->v];
    }
}

/* Eliminates the whole group. On the ground, it writes the accelerations to a. Otherwise x0 + n z, n and the momentum
 * of n over D are stored for the forward pass, and the parent receives the inertia and the bias wrench of the group.
 * Returns false near a singular position, or if D is no inertia. */
KT_INLINE kt_condition kt_pin_eliminate(const kt_model *model, kt_data *data, const kt_pin_group *g,
                                        const kt_const1 *gravity, const kt_real1 *v, const kt_real1 *tau, kt_real1 *a) {
    assert(g->group->v_count == KT_PIN_LINKS);
    assert(g->bound[0] == 0 && g->bound[1] >= 0 && g->bound[1] <= KT_PIN_LINKS && g->bound[2] == KT_PIN_LINKS);
    const kt_group *group = g->group;
    const int32_t top = g->top;
    const kt_real2 none = kt_same2(0.0), ground = top ? none : kt_minus2(kt_const_load2(gravity));
    const kt_real1 omega = data->planar[top].omega;
    kt_pin p;
    kt_pin_sum sum = {.inertia = kt_real1_splat(0.0), .force = none};
    const kt_pin_end first_end = kt_pin_follow(model, data, g, 0, omega, v, &p);
    const kt_pin_end second_end = kt_pin_follow(model, data, g, 1, omega, v, &p);
    kt_pin_relate(&first_end, &second_end, g->bound[1], &p);
    kt_condition regular = kt_pin_reduce(group->usual[KT_ROWS_ALL], &p);
    if (kt_fails(&regular, regular))
        return kt_condition_false();
    kt_pin_sum_path(model, data, g, 0, &p, ground, tau, &sum);
    kt_pin_sum_path(model, data, g, 1, &p, ground, tau, &sum);
    if (kt_fails(&regular, sum.inertia > KT_PIN_INERTIA * sum.carried))
        return kt_condition_false();
    const kt_real1 one = 1.0 / sum.inertia, z = -sum.power * one;
    if (top == 0) {
        for (int i = 0; i < KT_PIN_LINKS; i++)
            a[p.link[i]->v] = p.x[i] + p.n[i] * z;
        return regular;
    }
    const kt_group_work w = kt_group_matrices(model, data, (size_t)(group - model->group), KT_ROWS_ALL);
    for (int i = 0; i < KT_PIN_LINKS; i++) {
        w.free[p.link[i]->local] = p.x[i] + p.n[i] * z;
        kt_pin_null_vector(&w)[p.link[i]->local] = p.n[i];
    }
    kt_real1 *momentum = kt_pin_momentum(&w);
    momentum[0] = sum.moment * one;
    kt_store2(momentum + 1, kt_scale2(one, sum.force));
    kt_pin_onto_parent(&sum, one, z, &data->planar_inertia[top]);
    return regular;
}

/* Does the same as kt_planar_group_respond, for a group of one pin. */
KT_INLINE void kt_pin_respond(const kt_model *model, const kt_data *data, const kt_group *group, int32_t top,
                              kt_real1 *a) {
    const kt_planar_motion *up = &data->planar[top];
    const int32_t *v = model->group_v + group->v;
    const kt_group_work w = kt_group_matrices(model, data, (size_t)(group - model->group), KT_ROWS_ALL);
    const kt_real1 *momentum = kt_pin_momentum(&w), *n = kt_pin_null_vector(&w);
    const kt_real1 pull = momentum[0] * up->alpha + (momentum[1] * up->linear[0] + momentum[2] * up->linear[1]);
    for (int i = 0; i < KT_PIN_LINKS; i++)
        a[v[i]] = w.free[i] - n[i] * pull;
}

#endif
