/* The factors of kkt.h: articulated inertias from the tips to the ground. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/kkt_link.h"
#include "reduction/planar_group.h"
#include "reduction/spatial_group.h"

#include <string.h>

/* ---- inertias as components x components numbers ----------------------------------------------------------------- */

static double *inertia_of(const kt_kkt *w, size_t i) {
    return w->inertia + (size_t)(KT_FRONT_SPACE * KT_FRONT_SPACE) * i;
}

/* Writes the inertia of a rigid link about its origin as a square matrix: of six components c, or of three in a
 * plane. */
static void set_rigid(const kt_kkt *w, size_t i, int c) {
    if (c == KT_FRONT_SPACE) {
        kt_articulated x;
        kt_articulated_rigid(&w->model->link[i], &w->data->motion[i], &(kt_link_origin){.moment = {0.0}}, &x);
        kt_inertia_to_matrix(&x, inertia_of(w, i));
        return;
    }
    const int32_t k = (int32_t)i + w->model->to_planar;
    const kt_planar_link *link = &w->model->planar[k];
    double first[2];
    kt_planar_rotate(&w->data->planar[k], link->moment, first);
    const kt_planar_inertia x = {.j = link->inertia, .h = {-first[1], first[0]}, .xx = link->mass, .yy = link->mass};
    kt_planar_inertia_to_matrix(&x, inertia_of(w, i));
}

/* Converts inertias back to the form that the methods of a group read. */
static void hand_over_inertias(const kt_kkt *w, size_t i, int c) {
    if (c == KT_FRONT_SPACE)
        kt_inertia_from_mat3(inertia_of(w, i), &w->data->articulated[i]);
    else
        w->data->planar_inertia[(int32_t)i + w->model->to_planar] = kt_planar_inertia_from_mat3(inertia_of(w, i));
}

/* Adds X' I X, where X takes the parent's acceleration to the link's origin. */
static void pass_on_inertia(const kt_kkt *w, size_t i, int c) {
    const kt_v4 r = kt_kkt_offset(w, i, c);
    const double *inertia = inertia_of(w, i);
    double *parent = inertia_of(w, (size_t)w->model->link[i].parent);
    for (int k = 0; k < c; k++) {
        double x[KT_FRONT_SPACE] = {0.0}, y[KT_FRONT_SPACE] = {0.0};
        x[k] = 1.0;
        kt_motion_shift(c, r, x);
        for (int j = 0; j < c; j++)
            for (int l = 0; l < c; l++)
                y[l] += inertia[j * c + l] * x[j];
        kt_wrench_shift(c, r, y);
        for (int l = 0; l < c; l++)
            parent[k * c + l] += y[l];
    }
}

/* ---- links outside groups ---------------------------------------------------------------------------------------- */

static int set_axes(const kt_kkt *w, size_t i, int c) {
    const kt_front f = {.model = w->model, .data = w->data, .components = c};
    return kt_front_subspace(&f, (int32_t)i, w->axis + KT_FRONT_SPACE * (size_t)w->model->link[i].v);
}

/* Eliminates the degrees of freedom of a link, the last one first: I -= U U' / D with U = I s and D = s . U +
 * armature. Returns false if D vanishes. */
static bool eliminate_link(const kt_kkt *w, size_t i, int c, int dofs) {
    const int32_t v = w->model->link[i].v;
    double *inertia = inertia_of(w, i);
    for (int d = dofs - 1; d >= 0; d--) {
        const double *s = kt_kkt_axis(w, i) + d * KT_FRONT_SPACE;
        double *gain = w->gain + KT_FRONT_SPACE * (size_t)(v + d), u[KT_FRONT_SPACE] = {0.0};
        double along = w->model->armature[v + d], size = w->model->link[i].size + along;
        for (int j = 0; j < c; j++)
            for (int k = 0; k < c; k++)
                u[k] += inertia[j * c + k] * s[j];
        for (int k = 0; k < c; k++) {
            along += s[k] * u[k];
            size += s[k] * s[k] * inertia[k * (c + 1)];
        }
        if (!(along > KT_NO_INERTIA * size))
            return false;
        w->inverse[v + d] = 1.0 / along;
        for (int k = 0; k < c; k++)
            gain[k] = u[k] / along;
        for (int j = 0; j < c; j++)
            for (int k = 0; k < c; k++)
                inertia[j * c + k] -= u[k] * gain[j];
    }
    return true;
}

/* ---- groups ------------------------------------------------------------------------------------------------------ */

/* Sets the map of a group whose energy has been reduced, or whose null space is in its work memory. */
static void set_map(kt_kkt *w, size_t g, const kt_group_work *of) {
    const int m = of->m, rank = w->data->rank[g], dofs = m - rank;
    double *at = w->map + w->mapped, *unit = of->multiplier;
    kt_kkt_map map;
    w->begin[g] = w->mapped;
    w->mapped = (size_t)(kt_kkt_group_map_find(of, rank, at, &map) - w->map);
    memset(unit, 0, (size_t)of->k * sizeof *unit);
    for (int r = 0; r < of->k; r++) {
        unit[r] = 1.0;
        w->model->reduction->particular(of, rank, unit, map.close + r * m);
        unit[r] = 0.0;
        if (w->metric == KT_METRIC_MASS)
            kt_group_apply_mass(of, map.close + r * m, map.pull + r * m);
        else /* N' times this part is zero */
            memset(map.pull + r * m, 0, (size_t)m * sizeof *map.pull);
    }
    if (w->metric != KT_METRIC_MASS) {
        memcpy(map.free, of->basis, (size_t)(m * dofs) * sizeof *map.free);
        return;
    }
    for (int j = 0; j < dofs; j++) {
        double *to = map.free + j * m;
        for (int i = 0; i < m; i++) {
            to[i] = of->basis[j * m + i];
            for (int l = 0; l < j; l++)
                to[i] -= of->reduced[l * dofs + j] * map.free[l * m + i];
            to[i] /= of->reduced[j * (dofs + 1)];
        }
    }
}

/* A group by dense matrices: its map, and its inertia on the parent. */
static bool reduce_dense(kt_kkt *w, size_t g, int c, double *parent) {
    const kt_model *model = w->model;
    const kt_group *group = &model->group[g];
    const kt_group_work of = kt_group_matrices(model, w->data, g, w->rows);
    const bool spatial = c == KT_FRONT_SPACE;
    const int32_t top = group->parent && !spatial ? group->parent + model->to_planar : 0;
    double more[KT_FRONT_SPACE * KT_FRONT_SPACE];
    kt_articulated total, onto;
    kt_planar_inertia flat, flat_onto = {.j = 0.0};
    if (spatial)
        kt_group_assemble(model, w->data, group, &of, model->zero, &total);
    else
        kt_planar_group_assemble(model, w->data, group, &of, top, model->zero, &flat);
    kt_group_gear(model, group, &of);
    if (!model->reduction->solve(&of, w->data->rank[g], group->parent ? c : 0))
        return false;
    set_map(w, g, &of);
    if (!group->parent)
        return true;
    if (spatial) {
        memset(&onto, 0, sizeof onto);
        kt_group_onto_parent(&of, &total, &onto);
        kt_inertia_to_matrix(&onto, more);
    } else {
        kt_planar_group_onto_parent(&of, &flat, &flat_onto);
        kt_planar_inertia_to_matrix(&flat_onto, more);
    }
    for (int k = 0; k < c * c; k++)
        parent[k] += more[k];
    return true;
}

/* Passes the inertias of a group's links to the group, and reduces the group onto its parent. */
static bool reduce_group(kt_kkt *w, size_t g, int c) {
    const kt_group *group = &w->model->group[g];
    double *parent = inertia_of(w, (size_t)group->parent);
    for (int l = 0; l < group->link_count; l++)
        hand_over_inertias(w, (size_t)w->model->group_link[group->link + l], c);
    if (group->has_fronts)
        return KT_KERNEL(kt_kkt_reduce_front)(w, g, parent);
    return reduce_dense(w, g, c, parent);
}

/* With the metric of the coordinates. */
static void reduce_apart(kt_kkt *w, size_t g) {
    const kt_group_work of = kt_group_matrices(w->model, w->data, g, w->rows);
    if (w->model->group[g].has_fronts) {
        (void)KT_KERNEL(kt_kkt_reduce_front)(w, g, NULL);
        return;
    }
    w->model->reduction->basis(&of, w->data->rank[g]);
    set_map(w, g, &of);
}

bool KT_KERNEL(kt_kkt_reduce)(kt_kkt *w) {
    const kt_model *model = w->model;
    w->mapped = 0;
    for (size_t i = 1; i < model->n.link; i++)
        set_rigid(w, i, kt_kkt_components(model, i));
    if (w->metric != KT_METRIC_MASS) {
        for (size_t i = 1; i < model->n.link; i++)
            (void)set_axes(w, i, kt_kkt_components(model, i));
        for (size_t g = 0; g < model->n.group; g++)
            reduce_apart(w, g);
        return true;
    }
    for (size_t i = model->n.link - 1; i > 0; i--) {
        const kt_link *link = &model->link[i];
        const int c = kt_kkt_components(model, i), dofs = set_axes(w, i, c);
        if (link->group >= 0) { /* a group is eliminated at its first link */
            if (model->group_link[model->group[link->group].link] == (int32_t)i &&
                !reduce_group(w, (size_t)link->group, c))
                return false;
            continue;
        }
        if (!eliminate_link(w, i, c, dofs))
            return false;
        if (link->parent)
            pass_on_inertia(w, i, c);
    }
    return true;
}
