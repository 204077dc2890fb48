/* The degrees of freedom that move the ends of effects, and the columns of derivatives that they have. The mathematics
 * is that of effect_derivatives.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/effect_columns.h"

#include "evaluate/evaluate.h"

int32_t kt_effect_carrier_of(const kt_model *model, int32_t a, int32_t b) {
    while (a != b) {
        if (a > b)
            a = model->link[a].parent;
        else
            b = model->link[b].parent;
    }
    return a;
}

kt_effect_pair kt_effect_base_of(const kt_effects_state *s, int32_t link) {
    kt_effect_pair base = {kt_v4_splat(0.0), kt_v4_splat(0.0)};
    if (link == 0)
        return base;
    while (s->model->link[link].parent)
        link = s->model->link[link].parent;
    const kt_link_motion *motion = s->data->motion;
    kt_v4 angular;
    kt_joint_twist(&s->model->link[link], &motion[0], &motion[link], s->at->v, &angular, &base.b);
    base.a = motion[link].offset;
    return base;
}

void kt_effect_find_end(const kt_effects_state *s, const kt_effect_record *effect, int k, kt_effect_pair base,
                        kt_v4 from, kt_end_motion *m, kt_effect_end *end) {
    const int32_t i = effect->link[k];
    const kt_link_motion *link = &s->data->motion[i];
    kt_v4 frame[3], axes[3];
    kt_v4_from_mat3(effect->frame[k].rotation, frame);
    kt_multiply3(link->axes, frame, axes);
    const kt_v4 arm = kt_v4_apply(link->axes, kt_v4_from(effect->frame[k].position));
    m->origin = base.a - from;
    m->velocity = base.b;
    m->omega = kt_v4_splat(0.0);
    if (i) {
        m->origin += s->x->link[i].origin;
        m->omega = link->omega;
        m->velocity += s->x->link[i].velocity + kt_v4_cross(link->omega, arm);
    }
    m->point = m->origin + arm;
    *end = (kt_effect_end){.axes = kt_v4_mat3(axes),
                           .point = kt_v4_vec3(m->point),
                           .omega = kt_v4_vec3(m->omega),
                           .velocity = kt_v4_vec3(m->velocity)};
}

size_t kt_effect_follow(const kt_effects_state *s, int32_t carrier, int32_t to, int32_t end, kt_v4 origin, kt_v4 p,
                        size_t count) {
    const kt_derivative_work *x = s->x;
    for (int32_t i = to; i != carrier; i = s->model->link[i].parent) {
        const kt_v4 arm = p - origin;
        const int dofs = kt_link_dofs(&s->model->link[i]);
        const kt_derivative_node *node = &x->node[x->link[i].last];
        for (int32_t k = node->first + node->count - 1, n = 0; n < dofs; n++, k--) {
            const kt_dof_motion *m = &x->motion[k];
            s->path[count++] = (kt_effect_dof){.s = {m->s[0], m->s[1] + kt_v4_cross(m->s[0], arm)},
                                               .psi = {m->psi[0], m->psi[1] + kt_v4_cross(m->psi[0], arm)},
                                               .v = (size_t)x->row[k].v,
                                               .index = k,
                                               .first = x->node[x->row[k].node].first,
                                               .end = end};
        }
        origin -= s->data->motion[i].offset;
    }
    return count;
}

/* y += A x */
static inline void add_matrix_times(kt_mat3 matrix, kt_v4 x, kt_v4 *y) {
    kt_v4 a[3];
    kt_v4_from_mat3(matrix, a);
    *y += kt_v4_apply(a, x);
}

/* The product of a matrix of the effect and x = (a rotation, a displacement), or their rates. If the effect acts at a
 * point alone, only the displacement gives a force. */
static inline kt_effect_pair apply_jacobian(const kt_effect_jacobian *of, const kt_mat3 matrix[2][2],
                                            kt_effect_pair x) {
    kt_effect_pair y = {kt_v4_splat(0.0), kt_v4_splat(0.0)};
    add_matrix_times(matrix[1][1], x.b, &y.b);
    if (of->at_point)
        return y;
    add_matrix_times(matrix[0][0], x.a, &y.a);
    add_matrix_times(matrix[0][1], x.b, &y.a);
    add_matrix_times(matrix[1][0], x.a, &y.b);
    return y;
}

void kt_effect_find_columns(const kt_effect_jacobian *of, kt_v4 omega, kt_v4 velocity, const kt_effect_dof *k,
                            bool last, kt_effect_columns *out) {
    const kt_v4 m = of->at_point ? kt_v4_splat(0.0) : kt_v4_from(of->moment), f = kt_v4_from(of->force);
    const kt_effect_pair s = {k->s[0], k->s[1]};
    const kt_effect_pair turned = {kt_v4_cross(s.a, omega) + k->psi[0], kt_v4_cross(s.a, velocity) + k->psi[1]};
    const kt_effect_pair stiff = apply_jacobian(of, of->stiffness, s), damped = apply_jacobian(of, of->damping, turned);
    const kt_effect_pair g = {stiff.a + damped.a, stiff.b + damped.b};
    const kt_effect_pair rotated = {g.a - kt_v4_cross(s.a, m), g.b - kt_v4_cross(s.a, f)};
    const kt_effect_pair moved = {g.a + kt_v4_cross(s.b, f), g.b};
    out->rate = apply_jacobian(of, of->damping, s);
    out->carried = last ? rotated : moved;
    out->others = last ? moved : rotated;
}

/* Subtracts from column k of the derivatives, for each degree of freedom i on the path of end `end`:
 *     d_q -= S_i . W_q,   d_v -= S_i . W_v
 * W_v is c->rate. W_q is c->carried if k carries i, and otherwise c->others. */
void kt_effect_subtract_own_column(const kt_effects_state *s, const kt_effect_dof *k, int32_t end, size_t count,
                                   const kt_effect_columns *c, double *d_q, double *d_v) {
    const size_t column = k->v * s->model->n.v;
    for (size_t a = 0; a < count; a++) {
        const kt_effect_dof *i = &s->path[a];
        if (i->end != end)
            continue;
        const kt_effect_pair *by = i->index >= k->first ? &c->carried : &c->others;
        d_q[column + i->v] -= kt_v4_dot2(i->s[0], by->a, i->s[1], by->b);
        d_v[column + i->v] -= kt_v4_dot2(i->s[0], c->rate.a, i->s[1], c->rate.b);
    }
}
