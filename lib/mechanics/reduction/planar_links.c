/* The recursion over planar links with constraint groups (dynamics/aba_planar.h, planar_group.h), the planar
 * counterpart of spatial_links.c. No joint connects planar and spatial links, and a group is entirely planar or
 * entirely spatial. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/links.h"
#include "reduction/pin.h"
#include "reduction/planar_group.h"

#include "reduction/delassus.h"

#ifndef KT_LANES
#include "reduction/components.h"
#include "reduction/front.h"
#include "reduction/front4.h"
#include "reduction/kernel.h"

#include <assert.h>
#endif

static const kt_const1 none[2]; /* zero */

void KT_KERNEL(kt_planar_links_pose)(const kt_model *model, kt_data *data, const kt_real1 *q) {
    assert(kt_data_serve(model, data));
    kt_planar_motion *motion = data->planar;
    kt_planar_gather(model, data, q);
    kt_planar_ground_set(none, &motion[0]);
    for (size_t k = 1; k < model->n.planar; k++)
        (void)kt_planar_pose(&model->planar[k], kt_load2(motion[model->planar[k].parent].rotation), q,
                             data->planar_cosine, data->planar_sine, &motion[k]);
}

/* Computes velocities from given poses, and everything else that kt_planar_articulated_motion sets. */
void KT_KERNEL(kt_planar_links_move)(const kt_model *model, kt_data *data, const kt_real1 *v) {
    assert(kt_data_serve(model, data));
    for (size_t k = 1; k < model->n.planar; k++) {
        const kt_planar_link *link = &model->planar[k];
        kt_planar_motion *m = &data->planar[k];
        (void)kt_planar_velocity(link, data->planar[link->parent].omega, v, m);
        kt_planar_wrench_set(link, m->omega, m);
        if (link->branches)
            data->planar_inertia[k] = (kt_planar_inertia){.j = kt_real1_splat(0.0)};
    }
}

/* Eliminates a group by QR: M and the bias of its coordinates, the reduction, and the inertia that is left for the
 * parent `top`; 0: the ground, and the group accelerates at once. */
KT_INLINE kt_condition eliminate_dense(const kt_model *model, kt_data *data, const kt_group *group,
                                       const kt_group_work *w, int32_t top, const kt_real1 *tau, bool has_armature,
                                       kt_real1 *a) {
    kt_planar_inertia total;
    kt_planar_group_assemble(model, data, group, w, top, tau, &total);
    for (int i = 0; i < w->m && has_armature; i++)
        w->mass[i * (w->m + 1)] += model->armature[model->group_v[group->v + i]];
    const int width = top ? KT_PLANAR_WIDTH : 0;
#ifndef KT_LANES
    const bool regular = model->reduction->solve(w, data->rank[group - model->group], width);
    if (!regular)
        return false;
#else
    const kt_condition regular =
        KT_KERNEL(kt_qr_solve_group)(w, group->rank[data->factored[group - model->group]], width);
#endif
    if (top)
        kt_planar_group_onto_parent(w, &total, &data->planar_inertia[top]);
    else
        kt_planar_group_respond(model, data, group, w, 0, a);
    return regular;
}

static __attribute__((noinline)) kt_condition eliminate_dense_armature(const kt_model *model, kt_data *data,
                                                                       const kt_group *group, const kt_group_work *w,
                                                                       int32_t top, const kt_real1 *tau, kt_real1 *a) {
    return eliminate_dense(model, data, group, w, top, tau, true, a);
}

/* Eliminates a group of one pin, whose equations have not been filled; returns false if the group needs the general
 * method. */
static kt_condition eliminate_pin(const kt_model *model, kt_data *data, int32_t g, int32_t top,
                                  const kt_const1 *gravity, const kt_real1 *v, const kt_real1 *tau, kt_real1 *a) {
    const kt_group *group = &model->group[g];
    const int32_t index = model->group_loop[group->loop];
    kt_pin_group pin = {.group = group,
                        .loop = &model->loop[index],
                        .flat = &model->planar_loop[index],
                        .top = top,
                        .bound = {0, 0, KT_PIN_LINKS}};
#ifndef KT_LANES
    data->near[g] = false;
    data->rank[g] = group->rank[KT_ROWS_ALL];
#endif
    switch (pin.loop->length[0]) { /* pin.bound are constants in each */
    case 0:
        return kt_pin_eliminate(model, data, &pin, gravity, v, tau, a);
    case 1:
        pin.bound[1] = 1;
        return kt_pin_eliminate(model, data, &pin, gravity, v, tau, a);
    case 2:
        pin.bound[1] = 2;
        return kt_pin_eliminate(model, data, &pin, gravity, v, tau, a);
    default:
        pin.bound[1] = 3;
        return kt_pin_eliminate(model, data, &pin, gravity, v, tau, a);
    }
}

#ifndef KT_LANES

/* Eliminates a group by fronts, after the bias has been computed. */
static bool eliminate_planar_front(const kt_model *model, kt_data *data, int32_t g, int32_t top, const double *tau,
                                   double *a) {
    const kt_front_aim aim = {.kind = KT_FRONT_DYNAMICS, .tau = tau, .base = top != 0};
    kt_front_total total;
    if (!KT_KERNEL(kt_front_reduce)(model, data, (size_t)g, &aim, &total))
        return false;
    if (!top) {
        KT_KERNEL(kt_front_respond)(model, data, (size_t)g, NULL, a);
        return true;
    }
    kt_planar_inertia x = kt_planar_inertia_from_mat3(total.inertia);
    x.moment = total.bias[0];
    x.force[0] = total.bias[1];
    x.force[1] = total.bias[2];
    kt_planar_add(&data->planar_inertia[top], &x);
    return true;
}

#endif

/* The arguments that groups need in addition to those of the recursion. If v is not NULL, groups of one pin are solved
 * in closed form for these velocities; otherwise these groups have been factored like all others. Links of groups that
 * delassus.h has prepared count as links of the tree. */
typedef struct closure {
    const kt_model *model;
    kt_data *data;
    const kt_const1 *gravity;
    const kt_real1 *v;
    kt_real1 *a;
} closure;

/* Whether a group is in the form of Delassus and has been prepared for delassus.c; in lanes all are. */
KT_INLINE bool is_delassus(const closure *c, int32_t group) {
#ifndef KT_LANES
    return c->data->special_form[group] && c->model->group[group].form == KT_FORM_DELASSUS;
#else
    return c->model->group[group].form == KT_FORM_DELASSUS;
#endif
}

/* Stores 1 / (s'I s + armature) of a link for delassus.c. */
static void store_inverse(const closure *c, const kt_planar_link *link, const kt_planar_motion *m,
                          const kt_planar_carried *x) {
    kt_delassus d;
    kt_real1 u[2];
    kt_delassus_find(c->model, c->data, (size_t)link->group, &d);
    if (link->revolute) {
        d.inverse[link->local] = 1.0 / (x->j + link->armature);
        return;
    }
    kt_planar_along(link, m, u);
    d.inverse[link->local] =
        1.0 / (kt_dot2(kt_load2(u), kt_symmetric2_apply(x->diagonal, x->xy, kt_load2(u))) + link->armature);
}

/* Solves the groups in the form of Delassus of a plane, between the passes; returns one that cannot be solved, or
 * n.group. */
static size_t solve_planar_delassus(const closure *c, const kt_plane *plane) {
    const kt_model *model = c->model;
    for (size_t g = 0; g < model->n.group; g++) {
        const int32_t k = model->group_link[model->group[g].link] + model->to_planar;
        if (is_delassus(c, (int32_t)g) && k >= plane->first && k < plane->last &&
            kt_is_rejected(c->data, KT_KERNEL(kt_delassus_solve)(model, c->data, g, c->gravity)))
            return g;
    }
    return model->n.group;
}

/* Eliminates the group of a link in the backward pass, in any form except that of one pin. For a group on the ground,
 * this yields its accelerations. */
static kt_condition eliminate_group(const closure *c, const kt_planar_link *link, const kt_real1 *tau) {
    const kt_model *model = c->model;
    kt_data *data = c->data;
    const size_t g = (size_t)link->group;
    const kt_group *group = &model->group[g];
    const int32_t top = link->parent;
    kt_group_work w;
    kt_group_find(model, data, g, data->factored[g], &w);
    kt_planar_group_bias(model, data, group, top, kt_const_real1(-c->gravity[0]), kt_const_real1(-c->gravity[1]));
#ifndef KT_LANES
    if (data->special_form[g])
        return KT_KERNEL(kt_front4_solve)(model, data, g, tau, c->a);
    if (group->has_fronts)
        return eliminate_planar_front(model, data, link->group, top, tau, c->a);
#endif
    return group->has_armature ? eliminate_dense_armature(model, data, group, &w, top, tau, c->a)
                               : eliminate_dense(model, data, group, &w, top, tau, false, c->a);
}

/* The accelerations of a group, from the acceleration of its parent. `pins`: groups of one pin were eliminated in
 * closed form. */
static void respond_group(const kt_model *model, kt_data *data, int32_t g, int32_t top, bool pins, kt_real1 *a) {
    const kt_group *group = &model->group[g];
    if (pins && group->form == KT_FORM_PIN) {
        kt_pin_respond(model, data, group, top, a);
        return;
    }
#ifndef KT_LANES
    if (group->has_fronts) {
        const kt_planar_motion *p = &data->planar[top];
        const double base[3] = {p->alpha, p->linear[0], p->linear[1]};
        KT_KERNEL(kt_front_respond)(model, data, (size_t)g, base, a);
        return;
    }
#endif
    const kt_group_work w = kt_group_matrices(model, data, (size_t)g, KT_ROWS_ALL);
    kt_planar_group_respond(model, data, group, &w, top, a);
}

/* A group is eliminated at its first link, which the backward pass reaches last; `joint` eliminates links of the
 * tree. */
KT_INLINE kt_elimination eliminate_by(const kt_planar_link *link, const kt_planar_motion *m, const kt_real1 *tau,
                                      kt_planar_carried *x, kt_planar_response *response, const closure *c,
                                      kt_planar_eliminate *joint) {
    if (link->group < 0)
        return joint(link, m, tau, x, response, c->data);
    if (is_delassus(c, link->group)) {
        store_inverse(c, link, m, x);
        return joint(link, m, tau, x, response, c->data);
    }
    c->data->planar_inertia[link - c->model->planar] = kt_planar_unload(x);
    if (!link->first_of_group)
        return KT_ELIMINATION_ENDED;
    const bool pin = c->v && c->model->group[link->group].form == KT_FORM_PIN;
    const kt_condition regular =
        pin ? eliminate_pin(c->model, c->data, link->group, link->parent, c->gravity, c->v, tau, c->a)
            : eliminate_group(c, link, tau);
    return kt_is_rejected(c->data, regular) ? KT_ELIMINATION_SINGULAR : KT_ELIMINATION_ENDED;
}

KT_INLINE kt_elimination eliminate(const kt_planar_link *link, const kt_planar_motion *m, const kt_real1 *tau,
                                   kt_planar_carried *x, kt_planar_response *response, void *context) {
    return eliminate_by(link, m, tau, x, response, context, kt_planar_eliminate_joint);
}

static kt_elimination eliminate_planar_armature(const kt_planar_link *link, const kt_planar_motion *m,
                                                const kt_real1 *tau, kt_planar_carried *x, kt_planar_response *response,
                                                void *context) {
    return eliminate_by(link, m, tau, x, response, context, kt_planar_eliminate_armature);
}

/* The forward pass at one link. A group accelerates at its first link; the others take their coordinates from there. */
KT_INLINE void respond(const kt_planar_link *link, const kt_planar_response *response, kt_real1 *alpha,
                       kt_real2 *linear, kt_planar_motion *m, kt_real1 *a, void *context) {
    const closure *c = context;
    if (link->group < 0 || is_delassus(c, link->group)) {
        kt_planar_respond_joint(link, response, alpha, linear, m, a, NULL);
        return;
    }
    if (link->first_of_group && link->parent)
        respond_group(c->model, c->data, link->group, link->parent, c->v != NULL, a);
    if (link->carries_others) {
        kt_planar_acceleration(link, &c->data->planar[link->parent], a, m);
        *alpha = m->alpha;
        *linear = kt_load2(m->linear);
    }
}

static __attribute__((noinline)) size_t backward_armature(const kt_model *model, kt_data *data, const kt_plane *plane,
                                                          const kt_real1 *tau, closure *c) {
    return kt_planar_articulated_backward(model, data, plane, tau, eliminate_planar_armature, c);
}

size_t KT_KERNEL(kt_planar_links_accelerate)(const kt_model *model, kt_data *data, const kt_real1 *v,
                                             const kt_real1 *tau, bool weightless, kt_real1 *a) {
    assert(kt_data_serve(model, data));
    for (size_t p = 0; p < model->n.plane; p++) {
        const kt_plane *plane = &model->plane[p];
        closure c = {.model = model, .data = data, .gravity = weightless ? none : plane->gravity, .v = v, .a = a};
        const size_t failed = model->has_armature
                                  ? backward_armature(model, data, plane, tau, &c)
                                  : kt_planar_articulated_backward(model, data, plane, tau, eliminate, &c);
        if (failed)
            return model->n.spatial + failed - 1;
        const size_t singular = model->has_delassus ? solve_planar_delassus(&c, plane) : model->n.group;
        if (singular < model->n.group)
            return (size_t)model->group_link[model->group[singular].link];
        kt_planar_articulated_forward(model, data, plane, c.gravity, respond, a, &c);
    }
    return 0;
}
