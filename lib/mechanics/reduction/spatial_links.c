/* The recursion over spatial links with constraint groups: the articulated-body recursion (dynamics/aba.h), in which
 * each group is one step (spatial_group.h). Bodies outside all loops have the same cost as in a tree.
 *
 * The functions treat links 1 to end - 1 and the groups among them (links.h). These are all links, or the links before
 * the planar links, which planar_links.c treats. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/whole_symmetric.h"

#include "reduction/links.h"
#include "reduction/spatial_group.h"

#include "reduction/delassus.h"

#ifndef KT_LANES
#include "reduction/components.h"
#include "reduction/front.h"
#include "reduction/half_columns.h"
#include "reduction/kernel.h"

#include <assert.h>
#endif

void KT_KERNEL(kt_spatial_links_pose)(const kt_model *model, kt_data *data, const kt_real1 *q, size_t end) {
    assert(end <= model->n.link); /* data may be those of another variant (evaluate/open.c) */
    const size_t angles = end == model->n.link ? model->n.angle : model->n.spatial_angle;
    kt_angles_gather(model, data, q, 0, angles, data->sine, data->cosine);
    kt_ground_set(kt_zero3(), &data->motion[0]);
    for (size_t i = 1; i < end; i++)
        kt_link_pose(&model->link[i], &data->motion[model->link[i].parent], q, data->cosine, data->sine,
                     &data->motion[i]);
}

void KT_KERNEL(kt_spatial_links_move)(const kt_model *model, kt_data *data, const kt_real1 *v, size_t end) {
    assert(end <= model->n.link); /* likewise */
    for (size_t i = 1; i < end; i++)
        kt_link_velocity(&model->link[i], &data->motion[model->link[i].parent], v, &data->motion[i]);
}

void KT_KERNEL(kt_spatial_links_clear)(const kt_model *model, kt_data *data, size_t end) {
    assert(kt_data_serve(model, data) && end <= model->n.link);
    for (size_t i = 1; i < end; i++)
        kt_articulated_clear(&model->link[i], &data->articulated[model->link[i].articulated]);
    kt_external_none(data);
}

void KT_KERNEL(kt_spatial_links_motion)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                        const kt_external *external, size_t end) {
    assert(kt_data_serve(model, data) && end <= model->n.link);
    kt_articulated_motion(model, data, q, v, end);
    if (external)
        kt_external_set(model, data, external);
}

#ifndef KT_LANES

/* Adds the inertia and the bias that a group leaves for its parent. */
static void add_total(const kt_front_total *total, kt_articulated *to) {
    const double *b = total->bias;
    kt_articulated x;
    kt_inertia_from_mat3(total->inertia, &x);
    x.moment = (kt_v4){b[0], b[1], b[2], 0.0};
    x.force = (kt_v4){b[3], b[4], b[5], 0.0};
    kt_articulated_add(to, &x);
}

/* Eliminates a group by fronts. */
static bool eliminate_front(const kt_model *model, kt_data *data, int32_t g, const double *tau) {
    const kt_group *group = &model->group[g];
    const kt_front_aim aim = {.kind = KT_FRONT_DYNAMICS, .tau = tau, .base = group->parent != 0};
    kt_front_total total;
    kt_group_bias(model, data, group);
    if (!KT_KERNEL(kt_front_reduce)(model, data, (size_t)g, &aim, &total))
        return false;
    if (group->parent)
        add_total(&total, &data->articulated[group->parent]);
    return true;
}

#endif

/* Eliminates a group by QR: M and the bias of its coordinates, the reduction, and the inertia that is left for the
 * parent. */
KT_INLINE kt_condition eliminate_dense(const kt_model *model, kt_data *data, int32_t g, const kt_real1 *tau,
                                       bool has_armature) {
    const kt_group *group = &model->group[g];
    const kt_group_work w = kt_group_matrices(model, data, (size_t)g, data->factored[g]);
    const int width = group->parent ? 6 : 0;
    kt_articulated total;
    kt_group_assemble(model, data, group, &w, tau, &total);
    if (has_armature)
        kt_group_gear(model, group, &w);
#ifndef KT_LANES
    const bool regular = model->reduction->solve(&w, data->rank[g], width);
    if (!regular)
        return false;
#else
    const kt_condition regular = KT_KERNEL(kt_qr_solve_group)(&w, group->rank[data->factored[g]], width);
#endif
    if (group->parent)
        kt_group_onto_parent(&w, &total, &data->articulated[group->parent]);
    return regular;
}

static __attribute__((noinline)) kt_condition eliminate_dense_armature(const kt_model *model, kt_data *data, int32_t g,
                                                                       const kt_real1 *tau) {
    return eliminate_dense(model, data, g, tau, true);
}

/* Eliminates a group in the form that compilation chose. */
static __attribute__((noinline)) kt_condition eliminate_whole(const kt_model *model, kt_data *data, int32_t g,
                                                              const kt_real1 *tau) {
#ifndef KT_LANES
    if (model->group[g].has_fronts)
        return eliminate_front(model, data, g, tau);
#endif
    if (model->group[g].has_armature)
        return eliminate_dense_armature(model, data, g, tau);
    return eliminate_dense(model, data, g, tau, false);
}

/* Whether a group is in the form of Delassus and has been prepared for delassus.c; in lanes all are. */
KT_INLINE bool is_special(const kt_model *model, const kt_data *data, int32_t group) {
#ifndef KT_LANES
    (void)model;
    return data->special_form[group];
#else
    (void)data;
    return model->group[group].form == KT_FORM_DELASSUS;
#endif
}

/* S'[J H; G M] S of a joint with one axis, S = (s_n, s_f). */
KT_INLINE kt_real1 inertia_along(const kt_link *link, kt_real3 s, const kt_articulated *x) {
    const kt_real3 none = kt_zero3();
    const kt_real3 n = link->motion == KT_MOTION_PRISMATIC ? none : s;
    const kt_real3 f = link->motion == KT_MOTION_REVOLUTE ? none
                       : link->motion == KT_MOTION_SCREW  ? kt_scale3(kt_real1_splat(kt_link_pitch(link)), s)
                                                          : s;
    return kt_dots3(n, kt_articulated_moment(x, n, f), f, kt_articulated_force(x, n, f));
}

/* Stores the inverse inertia of a link in a group of the form of Delassus, for delassus.c, or in a group in range
 * space, for half_columns.c. Such a link counts as a link of the tree. Returns whether the link is also eliminated. */
KT_INLINE bool store_inverse_inertia(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                     kt_articulated *x, bool ranges, double armature) {
    const kt_link *link = &model->link[i];
    kt_delassus d;
#ifndef KT_LANES
    if (ranges && model->group[link->group].form == KT_FORM_DENSE)
        return KT_KERNEL(kt_half_store)(model, data, i, tau, x);
#endif
    (void)tau, (void)ranges;
    if (link->motion == KT_MOTION_SPHERICAL)
        return false;
    kt_delassus_find(model, data, (size_t)link->group, &d);
    d.inverse[link->local] = 1.0 / (inertia_along(link, kt_link_axis(link, &data->motion[i]), x) + armature);
    return false;
}

/* Solves the groups in the form of Delassus and in range space, between the passes; returns the first link of a group
 * that cannot be solved, or 0. */
static size_t solve_delassus(const kt_model *model, kt_data *data, size_t end) {
    for (size_t g = 0; g < model->n.group; g++) {
        const int32_t link = model->group_link[model->group[g].link];
#ifndef KT_LANES
        if (data->special_form[g] && model->group[g].form == KT_FORM_DENSE) {
            if (!kt_group_is_locked(model, &model->group[g]) && !KT_KERNEL(kt_half_solve)(model, data, g))
                return (size_t)link;
            continue;
        }
#endif
        if (is_special(model, data, (int32_t)g) && (size_t)link < end &&
            kt_is_rejected(data, KT_KERNEL(kt_delassus_solve)(model, data, g, NULL)))
            return (size_t)link;
    }
#ifndef KT_LANES
    if (data->between) {
        void (*between)(const kt_model *, kt_data *) = data->between;
        data->between = NULL;
        between(model, data);
        for (size_t g = 0; g < model->n.group; g++)
            if (data->special_form[g] && model->group[g].form == KT_FORM_DENSE)
                KT_KERNEL(kt_half_complete)(model, data, g);
    }
#endif
    return 0;
}

/* The accelerations of a group that is reduced by fronts, from the acceleration of its parent. */
KT_INLINE void respond_front(const kt_model *model, kt_data *data, int32_t g, kt_real1 *a) {
#ifndef KT_LANES
    const kt_group *group = &model->group[g];
    const kt_link_motion *m = &data->motion[group->parent];
    const double base[KT_FRONT_SPACE] = {m->alpha[0],  m->alpha[1],  m->alpha[2],
                                         m->linear[0], m->linear[1], m->linear[2]};
    KT_KERNEL(kt_front_respond)(model, data, (size_t)g, group->parent ? base : NULL, a);
#else
    (void)model, (void)data, (void)g, (void)a;
#endif
}

/* A group is eliminated at its first link, which the backward pass reaches last. */
KT_INLINE kt_elimination eliminate_of_group(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                            kt_articulated *x) {
    const int32_t group = model->link[i].group;
    data->articulated[i] = *x;
    const bool first = model->group_link[model->group[group].link] == (int32_t)i;
    return first && kt_is_rejected(data, eliminate_whole(model, data, group, tau)) ? KT_ELIMINATION_SINGULAR
                                                                                   : KT_ELIMINATION_ENDED;
}

/* Whether a group in a special form is a joint at its stop (half_columns.h). */
KT_INLINE bool is_locked(const kt_model *model, int32_t group) {
#ifndef KT_LANES
    return kt_group_is_locked(model, &model->group[group]);
#else
    (void)model, (void)group;
    return false;
#endif
}

KT_INLINE void lock(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau, kt_articulated *x) {
#ifndef KT_LANES
    KT_KERNEL(kt_half_lock)(model, data, i, tau, x);
#else
    (void)model, (void)data, (void)i, (void)tau, (void)x;
#endif
}

/* Eliminates a link by `joint`, unless its group does. `context` is not NULL if groups in the form of Delassus are not
 * eliminated. ranges: nor those in range space. */
KT_INLINE kt_elimination eliminate_with(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                        kt_articulated *x, void *context, bool ranges, kt_eliminate *joint) {
    const int32_t group = model->link[i].group;
    const bool delassus = group >= 0 && context && is_special(model, data, group);
    if (group >= 0 && !delassus)
        return eliminate_of_group(model, data, i, tau, x);
    if (ranges && delassus && is_locked(model, group)) {
        lock(model, data, i, tau, x);
        return KT_ELIMINATION_PASSED;
    }
    const double armature = delassus && joint == kt_eliminate_armature ? model->armature[model->link[i].v] : 0.0;
    if (delassus && store_inverse_inertia(model, data, i, tau, x, ranges, armature))
        return KT_ELIMINATION_PASSED;
    return joint(model, data, i, tau, x, NULL);
}

KT_INLINE kt_elimination eliminate(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                   kt_articulated *x, void *context) {
    return eliminate_with(model, data, i, tau, x, context, false, kt_eliminate_joint);
}

KT_INLINE kt_elimination eliminate_in_range_space(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                                  kt_articulated *x, void *context) {
    return eliminate_with(model, data, i, tau, x, context, true, kt_eliminate_joint);
}

static kt_elimination eliminate_armature(const kt_model *model, kt_data *data, size_t i, const kt_real1 *tau,
                                         kt_articulated *x, void *context) {
    const kt_elimination done = eliminate_with(model, data, i, tau, x, context, true, kt_eliminate_armature);
#ifdef KT_LANES /* aba_armature.c has written elements on and below the diagonal alone (whole_symmetric.h) */
    kt_symmetric3_mirror(x->j);
    kt_symmetric3_mirror(x->m);
#endif
    return done;
}

/* The acceleration of link i in the forward pass. A group accelerates at its first link. With `delassus`, the links of
 * groups in the form of Delassus accelerate one by one, as in a tree. */
KT_INLINE void respond_to(const kt_model *model, kt_data *data, size_t i, bool delassus, kt_acceleration *at,
                          kt_real1 *a) {
    const kt_link *link = &model->link[i];
    if (link->group < 0 || (delassus && is_special(model, data, link->group))) {
        kt_link_respond(model, data, i, at, a);
        return;
    }
    const kt_group *group = &model->group[link->group];
    if (model->group_link[group->link] == (int32_t)i && group->has_fronts) {
        respond_front(model, data, link->group, a);
    } else if (model->group_link[group->link] == (int32_t)i) {
        const kt_group_work w = kt_group_matrices(model, data, (size_t)link->group, KT_ROWS_ALL);
        kt_group_respond(model, data, group, &w, a);
    }
    kt_link_acceleration(link, &data->motion[link->parent], a, &data->motion[i]);
    *at = kt_acceleration_of(&data->motion[i]);
}

KT_INLINE void respond(const kt_model *model, kt_data *data, size_t i, kt_acceleration *at, kt_real1 *a) {
    respond_to(model, data, i, false, at, a);
}
KT_INLINE void respond_delassus(const kt_model *model, kt_data *data, size_t i, kt_acceleration *at, kt_real1 *a) {
    respond_to(model, data, i, true, at, a);
}

/* Computes accelerations of a model that has groups which are solved between the passes. */
KT_INLINE size_t accelerate_special(const kt_model *model, kt_data *data, const kt_real1 *tau, size_t end,
                                    kt_eliminate *eliminate_link, kt_real1 *a) {
    bool delassus = true;
    const size_t failed = kt_articulated_backward(model, data, tau, end, eliminate_link, &delassus);
    const size_t singular = failed ? failed : solve_delassus(model, data, end);
    if (!singular)
        kt_articulated_forward(model, data, end, respond_delassus, a);
    return singular;
}

/* The groups are in the form of Delassus (delassus.h). */
static size_t accelerate_delassus(const kt_model *model, kt_data *data, const kt_real1 *tau, size_t end, kt_real1 *a) {
    return accelerate_special(model, data, tau, end, eliminate, a);
}

#ifndef KT_LANES
/* Some groups are in range space (half_columns.h), whose functions take the address of a link's inertia. A loop that
 * calls them holds the inertia in memory, where a recursion waits for each store. So ropes have a loop without these
 * calls, which takes 0.87 of the time. */
static size_t accelerate_in_range_space(const kt_model *model, kt_data *data, const kt_real1 *tau, size_t end,
                                        kt_real1 *a) {
    return accelerate_special(model, data, tau, end, eliminate_in_range_space, a);
}

static bool has_group_in_range_space(const kt_model *model, const kt_data *data) {
    for (size_t g = 0; g < model->n.group; g++)
        if (data->special_form[g] && model->group[g].form == KT_FORM_DENSE)
            return true;
    return false;
}
#endif

static void respond_armature(const kt_model *model, kt_data *data, size_t i, kt_acceleration *at, kt_real1 *a) {
    const int32_t group = model->link[i].group;
    if (group < 0 || is_special(model, data, group))
        kt_link_respond_armature(model, data, i, at, a);
    else
        respond(model, data, i, at, a);
}

/* The passes of kt_spatial_links_accelerate with armature. delassus: groups with forms of their own are solved between
 * the passes. */
static __attribute__((noinline)) size_t accelerate_armature(const kt_model *model, kt_data *data, const kt_real1 *tau,
                                                            size_t end, bool delassus, kt_real1 *a) {
    const size_t failed =
        kt_articulated_backward(model, data, tau, end, eliminate_armature, delassus ? &delassus : NULL);
    const size_t singular = failed || !delassus ? failed : solve_delassus(model, data, end);
    if (!singular)
        kt_articulated_forward(model, data, end, respond_armature, a);
    return singular;
}

size_t KT_KERNEL(kt_spatial_links_accelerate)(const kt_model *model, kt_data *data, const kt_real1 *tau, size_t end,
                                              bool delassus, kt_real1 *a) {
    assert(kt_data_serve(model, data) && end <= model->n.link);
    if (model->has_armature)
        return accelerate_armature(model, data, tau, end, delassus, a);
#ifndef KT_LANES
    if (delassus && has_group_in_range_space(model, data))
        return accelerate_in_range_space(model, data, tau, end, a);
#endif
    if (delassus)
        return accelerate_delassus(model, data, tau, end, a);
    const size_t failed = kt_articulated_backward(model, data, tau, end, eliminate, NULL);
    if (!failed)
        kt_articulated_forward(model, data, end, respond, a);
    return failed;
}

#ifndef KT_LANES
void KT_KERNEL(kt_spatial_links_resume)(const kt_model *model, kt_data *data, const double *v, size_t end, double *a) {
    assert(kt_data_serve(model, data) && end <= model->n.link);
    KT_KERNEL(kt_spatial_links_move)(model, data, v, end);
    data->motion[0].linear = -model->gravity;
    if (model->has_armature)
        kt_articulated_forward(model, data, end, respond_armature, a);
    else
        kt_articulated_forward(model, data, end, respond_delassus, a);
}
#endif
