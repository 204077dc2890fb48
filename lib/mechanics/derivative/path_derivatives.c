/* Derivatives of the joint forces of effects along paths.
 *
 * A force f along a path of the length L exerts on each of the path's links the wrench W_k = f dL/d(pose of k), about
 * the link's origin. The force depends on L and L', and these, like the gradient, on the motion of all links. Each link
 * is therefore treated as an end of a caller's own effect, whose wrenches depend on the motion of all ends
 * (kt_effect_subtract_own_column). Dual numbers differentiate the code of the path itself. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/path_derivatives.h"

#include "derivative/dual_effect.h"
#include "evaluate/path_force.h"

size_t kt_path_ends_find(const kt_effects_state *s, const kt_effect_record *effect, kt_path_ends *e,
                         kt_effect_end read[2]) {
    const kt_path_link *link = s->model->path_link + effect->path_link;
    const int count = effect->path_link_count;
    size_t dofs = 0;
    int first = 0;
    while (first + 1 < count && link[first].link == 0)
        first++;
    const kt_v4 from = kt_effect_base_of(s, link[first].link).a;
    for (int k = 0; k < count; k++) {
        kt_effect_record one = {.ends = 1, .link = {link[k].link, 0}};
        one.frame[0].rotation = kt_mat3_identity();
        e->base[k] = kt_effect_base_of(s, link[k].link);
        kt_effect_find_end(s, &one, 0, e->base[k], from, &e->motion[k], &e->end[k]);
        dofs = kt_effect_follow(s, 0, link[k].link, k, e->motion[k].origin, e->motion[k].point, dofs);
    }
    kt_path_evaluate(s->model->path_point + effect->path_point, effect->path_count, e->end, count, &e->value);
    kt_path_as_ends(e->value.length, e->value.rate, read);
    return dofs;
}

void kt_path_wrenches_find(const kt_effect_record *effect, const kt_path_ends *e, double force, kt_effect_pair *x) {
    const kt_v4 f = kt_v4_splat(force);
    for (int k = 0; k < effect->path_link_count; k++)
        x[k] = (kt_effect_pair){f * kt_v4_from(e->value.unit[k].moment), f * kt_v4_from(e->value.unit[k].force)};
}

/* Subtracts the columns of the degrees of freedom that move link `moved`. */
static void subtract_moved_link(const kt_effects_state *s, const kt_path_ends *e, int moved, int links,
                                const kt_effect_jacobian *jacobian, size_t count, double *d_q, double *d_v) {
    const kt_end_motion *motion = &e->motion[moved];
    for (size_t b = 0; b < count; b++) {
        const kt_effect_dof *k = &s->path[b];
        if (k->end != moved)
            continue;
        for (int end = 0; end < links; end++) {
            kt_effect_columns c;
            kt_effect_find_columns(&jacobian[end], motion->omega, motion->velocity - e->base[moved].b, k, true, &c);
            kt_effect_subtract_own_column(s, k, end, count, &c, d_q, d_v);
        }
    }
}

void kt_path_subtract(const kt_effects_state *s, const kt_effect_record *effect, const kt_path_ends *e,
                      const double force[3], size_t count, double *d_q, double *d_v) {
    const kt_path_point_record *points = s->model->path_point + effect->path_point;
    const kt_path_link *link = s->model->path_link + effect->path_link;
    const int links = effect->path_link_count;
    kt_effect_jacobian jacobian[KT_PATH_LINK_MAX];
    for (int moved = 0; moved < links; moved++) {
        if (link[moved].link == 0)
            continue;
        kt_dual_path_jacobians(points, effect->path_count, e->end, links, moved, force, jacobian);
        for (int k = 0; k < links; k++)
            if (k != moved)
                jacobian[k].moment = jacobian[k].force = (kt_vec3){0.0, 0.0, 0.0};
        subtract_moved_link(s, e, moved, links, jacobian, count, d_q, d_v);
    }
}
