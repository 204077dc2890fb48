/* Checks whether a tree has inertia along all its degrees of freedom at a position. The check is the backward pass of
 * aba.h at rest, with a sharper pivot test than forward dynamics can afford.
 *
 * Projecting out a degree of freedom leaves rounding errors in J and M. The errors are proportional to the previous
 * entries, whose sizes are passed from link to link. For M, the size is the carried mass. For J, the size has two
 * parts. One is the sum of the traces of the rigid inertias carried. The other is the largest of two kinds of terms:
 * sum s_i^2 J_ii of rotations that were projected out, and mass times r^2 of shifts. If prismatic joints change r, the
 * present r is used. Behind a spherical or a free joint no part of J remains: its rows are then exactly zero. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba.h"
#include "dynamics/dynamics.h"

typedef struct size {
    double mass, trace, largest;
} size;

/* Returns the memory in which the sizes of a link's children are summed. At set-up, the memory of the kinematics is not
 * used yet. */
static size *children_size_of(kt_data *data, size_t i) { return (size *)&data->kinematics[i]; }

/* Whether there is inertia along all degrees of freedom of a link. Adds the part that is projected out to the size. */
static bool link_is_regular(const kt_link *link, const kt_link_motion *m, const kt_articulated *x, size *s) {
    const kt_v4 n = kt_link_axis(link, m);
    kt_v4 unused[2];
    const double turn = kt_v4_dot(n, kt_v4_apply(x->j, n)), slide = kt_v4_dot(n, kt_v4_apply(x->m, n));
    const double both = kt_v4_dot(n, kt_v4_apply(x->g, n)), p = kt_link_pitch(link);
    switch ((kt_motion)link->motion) {
    case KT_MOTION_REVOLUTE:
        s->largest = fmax(s->largest, kt_v4_dot(n * n, kt_diagonal3(x->j)));
        return turn > KT_NO_INERTIA * (s->trace + s->largest);
    case KT_MOTION_PRISMATIC:
        return slide > KT_NO_INERTIA * s->mass;
    case KT_MOTION_SCREW:
        s->largest = fmax(s->largest, kt_v4_dot(n * n, kt_diagonal3(x->j)));
        return turn + p * (2.0 * both + p * slide) > KT_NO_INERTIA * (s->trace + s->largest + p * p * s->mass);
    case KT_MOTION_SPHERICAL:
        return kt_factor3(x->j, kt_diagonal3(x->j) + kt_v4_splat(s->trace + s->largest), &unused[0], &unused[1]);
    case KT_MOTION_FREE:
        return kt_factor3(x->m, kt_v4_splat(s->mass), &unused[0], &unused[1]);
    case KT_MOTION_NONE:
        break;
    }
    return false;
}

/* As link_is_regular, for a link that may have armature: a along S, a S_n S_n' in J or a S_f S_f' in M. */
static bool is_regular_armature(const kt_model *model, const kt_data *data, size_t i, const kt_articulated *x,
                                size *s) {
    const kt_link *link = &model->link[i];
    kt_articulated all = *x;
    kt_subspace own;
    own.count = 0;
    if (link->has_armature)
        kt_link_subspace(link, &data->motion[link->parent], &data->motion[i], &own);
    for (int k = 0; k < own.count; k++) {
        const bool slides = kt_v4_dot(own.angular[k], own.angular[k]) == 0.0;
        const kt_v4 u = slides ? own.linear[k] : own.angular[k];
        for (int c = 0; c < 3; c++)
            (slides ? all.m : all.j)[c] += u * kt_v4_splat(u[c] * model->armature[link->v + k]);
    }
    return link_is_regular(link, &data->motion[i], &all, s);
}

/* The verdicts, and how many links have been found to have no inertia. */
typedef struct judgement {
    unsigned char *verdict;
    size_t found;
} judgement;

/* A link that can move in every direction passes none. */
static bool passes_inertia(const kt_link *link) { return kt_motion_facts_of(link->motion).velocities < KT_DOF_MAX; }

/* Whether a link can rotate about every axis: nothing of J remains then. */
static bool rotates_freely(const kt_link *link) { return kt_motion_facts_of(link->motion).quaternions > 0; }

/* Adds the sizes of the inertia that link i passes to its parent. */
static void pass_size(const kt_model *model, kt_data *data, size_t i, size s) {
    const kt_link *link = &model->link[i];
    const kt_v4 r = data->motion[i].offset;
    size *up = children_size_of(data, (size_t)link->parent);
    if (!passes_inertia(link))
        return;
    if (rotates_freely(link))
        s.trace = s.largest = 0.0;
    up->mass += s.mass;
    up->trace += s.trace;
    up->largest = fmax(up->largest, fmax(s.largest, s.mass * kt_v4_dot(r, r)));
}

/* Eliminates a joint that has inertia. Otherwise nothing is passed on, and the verdict on its parent becomes unknown.
 * The exception is a free link, which passes no inertia to its parent. */
KT_INLINE kt_elimination eliminate_or_reject(const kt_model *model, kt_data *data, size_t i, const double *tau,
                                             kt_articulated *x, void *context) {
    judgement *j = context;
    const kt_link *link = &model->link[i];
    size s = *children_size_of(data, i);
    s.trace += link->inertia.xx + link->inertia.yy + link->inertia.zz;
    s.mass += link->mass;
    if (j->verdict[i] == KT_INERTIA_THERE &&
        !(is_regular_armature(model, data, i, x, &s) &&
          (link->has_armature ? kt_project_armature_baseline(model, data, i, tau, x)
                              : kt_articulated_project(model, data, i, tau, x)))) {
        j->verdict[i] = KT_INERTIA_NONE;
        j->found++;
    }
    if (j->verdict[i] == KT_INERTIA_THERE) {
        pass_size(model, data, i, s);
        return KT_ELIMINATION_PASSED;
    }
    if (passes_inertia(link))
        j->verdict[link->parent] = KT_INERTIA_UNKNOWN;
    memset(x, 0, sizeof *x);
    return KT_ELIMINATION_PASSED;
}

/* NOLINTNEXTLINE(readability-non-const-parameter): verdicts are written by way of the judgement */
size_t kt_singular_links(const kt_model *model, kt_data *data, const double *q, unsigned char *verdict) {
    judgement j = {.verdict = verdict};
    kt_articulated_motion(model, data, q, model->zero, model->n.link);
    memset(data->kinematics, 0, model->n.link * sizeof *data->kinematics);
    (void)kt_articulated_backward(model, data, model->zero, model->n.link, eliminate_or_reject, &j);
    return j.found;
}
