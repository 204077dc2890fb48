/* The wrenches of the loops, from their equations' multipliers: the sum of the rows' wrenches times lambda. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "constraint/loop_wrenches.h"
#include "constraint/loop_jacobian.h"

#include <assert.h>

/* Adds a wrench at `arm` from a link's origin to the body's, about the body frame's origin. */
KT_INLINE void add_to_body(const kt_model *model, const kt_data *data, int32_t body, kt_v4 moment, kt_v4 force,
                           kt_v4 arm, kt_wrench *bodies) {
    const kt_body_record *b = &model->body[body];
    const kt_v4 origin = kt_v4_apply(data->motion[b->link].axes, kt_v4_from(b->in_link.position));
    const kt_v4 about = moment + kt_v4_cross(arm - origin, force);
    bodies[body].moment = kt_vec3_add(bodies[body].moment, kt_v4_vec3(about));
    bodies[body].force = kt_vec3_add(bodies[body].force, kt_v4_vec3(force));
}

/* A relation acts along its joints; a prescribed motion is reported as the wrench on its joint's body. */
static kt_wrench relation_wrench(const kt_model *model, const kt_data *data, const kt_loop_record *loop,
                                 double lambda) {
    kt_wrench out = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    const kt_term_record *term = &model->term[loop->term];
    const kt_vec3 along =
        kt_vec3_scale(lambda, kt_v4_vec3(kt_link_axis(&model->link[term->link], &data->motion[term->link])));
    if (loop->type != KT_LOOP_MOTION)
        return out;
    if (kt_link_lengths(&model->link[term->link]))
        out.force = along;
    else
        out.moment = along;
    return out;
}

/* A row that no joint moves, such as the normal of a slide's contact, has no multiplier in its group, but may have a
 * given one. */
static kt_wrench frame_wrench(const kt_model *model, const kt_data *data, const kt_group_work *w,
                              const kt_loop_record *loop, const int32_t *slot, double t, kt_wrench *bodies,
                              kt_wrench *idle) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_loop_end end[2];
    kt_loop_row rows[KT_LOOP_ROW_MAX];
    kt_v4 moment = none, force = none, arm[2];
    for (int k = 0; k < 2; k++) {
        kt_end_follow(model, data, loop, k, false, NULL, &end[k]);
        arm[k] = kt_v4_apply(data->motion[loop->link[k]].axes, kt_v4_from(loop->frame[k].position));
    }
    const kt_loop_kind *kind = KT_KERNEL(kt_loop_kinds)[loop->kind];
    const int count = kind->evaluate(loop, model->number, end, t, rows);
    const double *given = data->given_multipliers;
    double lambda[KT_LOOP_ROW_MAX];
    for (int r = 0; r < count; r++) {
        lambda[r] = slot[r] >= 0 ? w->multiplier[slot[r]] : given != NULL ? given[loop->equation + r] : 0.0;
        moment += kt_v4_splat(lambda[r]) * rows[r].moment;
        force += kt_v4_splat(lambda[r]) * rows[r].force;
    }
    const kt_v4 d = end[1].point - end[0].point, rows_moment = moment, rows_force = force;
    if (kind->load)
        kind->load(loop, end, lambda, &moment, &force);
    if (kind->load && idle) {
        add_to_body(model, data, loop->body[1], moment - rows_moment, force - rows_force, arm[1], idle);
        add_to_body(model, data, loop->body[0], rows_moment - moment, rows_force - force, arm[0] + d, idle);
    }
    add_to_body(model, data, loop->body[1], moment, force, arm[1], bodies);
    add_to_body(model, data, loop->body[0], -moment, -force, arm[0] + d, bodies);
    kt_wrench out;
    out.moment = kt_v4_vec3(moment + kt_v4_cross(d, force));
    out.force = kt_v4_vec3(force);
    return out;
}

/* The wrench of a loop in a group that is reduced by fronts. The equations of such a group are stored as wrenches on
 * the links, about their origins, so that the cost does not grow with the length of the path. The wrench on the first
 * link is the opposite of the wrench on the second end. */
static kt_wrench front_wrench(const kt_model *model, const kt_data *data, const kt_group_work *w,
                              const kt_loop_record *loop, const int32_t *slot, kt_wrench *bodies) {
    const kt_v4 none = kt_v4_splat(0.0);
    const kt_v4 arm = kt_v4_apply(data->motion[loop->link[0]].axes, kt_v4_from(loop->frame[0].position));
    kt_wrench out = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int k = 1; k >= 0; k--) {
        kt_v4 moment = none, force = none;
        for (int r = 0; r < loop->row_count; r++) {
            if (slot[r] < 0)
                continue;
            const double *x = w->wrench + (size_t)(2 * slot[r] + k) * KT_FRONT_SPACE;
            const kt_v4 lambda = kt_v4_splat(w->multiplier[slot[r]]);
            moment += lambda * (kt_v4){x[0], x[1], x[2], 0.0};
            force += lambda * (kt_v4){x[3], x[4], x[5], 0.0};
        }
        add_to_body(model, data, loop->body[k], moment, force, none, bodies);
        out.moment = kt_v4_vec3(kt_v4_cross(arm, force) - moment);
        out.force = kt_v4_vec3(-force);
    }
    return out;
}

void KT_KERNEL(kt_react)(const kt_model *model, const kt_data *data, double t, kt_wrench *bodies, kt_wrench *idle,
                         kt_wrench *loops) {
    assert(kt_data_serve(model, data));
    for (size_t g = 0; g < model->n.group; g++) {
        const kt_group *group = &model->group[g];
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        for (int i = 0; i < group->loop_count; i++) {
            const int32_t index = model->group_loop[group->loop + i];
            const kt_loop_record *loop = &model->loop[index];
            const int32_t *slot = model->slot + loop->slot;
            if (loop->term_count)
                loops[index] = relation_wrench(model, data, loop, slot[0] < 0 ? 0.0 : w.multiplier[slot[0]]);
            else if (group->has_fronts && !KT_KERNEL(kt_loop_kinds)[loop->kind]->load &&
                     data->given_multipliers == NULL)
                loops[index] = front_wrench(model, data, &w, loop, slot, bodies);
            else
                loops[index] = frame_wrench(model, data, &w, loop, slot, t, bodies, idle);
        }
    }
}
