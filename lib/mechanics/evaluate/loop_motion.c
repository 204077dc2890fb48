/* The relative coordinates of loops, from the links' kinematics. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/loop.h"

#include "base/require.h"
#include "loop/loop_custom.h"
#include "model/model.h"

#include <math.h>
#include <string.h>

/* An end in the world; accelerations are not needed. */
static kt_loop_end moving_end_of(const kt_data *data, const kt_loop_record *loop, int k) {
    const kt_link_kinematics *link = &data->kinematics[loop->link[k]];
    kt_loop_end end;
    memset(&end, 0, sizeof end);
    const kt_vec3 arm = kt_mat3_apply(link->axes, loop->frame[k].position);
    kt_v4_from_mat3(kt_mat3_multiply(link->axes, loop->frame[k].rotation), end.axes);
    end.point = kt_v4_from(kt_vec3_add(link->position, arm));
    end.omega = kt_v4_from(link->omega);
    end.velocity = kt_v4_from(kt_vec3_add(link->velocity, kt_vec3_cross(link->omega, arm)));
    return end;
}

bool kt_loop_motion_evaluate(const kt_model *model, const kt_data *data, int loop, kt_loop_motion *motion) {
    if (KT_IS_OTHER_DATA(NULL, model, data) || !motion || !KT_IS_INDEX(loop, model->n.loop) ||
        model->loop[loop].term_count > 0)
        return false;
    const kt_loop_record *r = &model->loop[loop];
    if (kt_loop_is_off(r) && kt_loop_is_relation((kt_loop_type)r->type))
        return false;
    const kt_loop_end end[2] = {moving_end_of(data, r, 0), moving_end_of(data, r, 1)};
    const kt_loop_relative relative = kt_loop_relative_of(end);
    const kt_custom_motion seen = kt_custom_motion_of(end, &relative);
    *motion = kt_custom_motion_value(&seen);
    return true;
}

double kt_loop_arc_length(const kt_model *model, const kt_data *data, int loop) {
    kt_loop_motion motion;
    if (!kt_loop_motion_evaluate(model, data, loop, &motion))
        return (double)NAN;
    const kt_loop_record *r = &model->loop[loop];
    const double p[3] = {motion.position.x, motion.position.y, motion.position.z};
    const kt_loop_kind *kind = kt_loop_kinds_baseline[r->kind];
    return kind->arc_length ? kind->arc_length(r, model->number, p) : (double)NAN;
}
