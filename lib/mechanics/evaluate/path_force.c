/* The path of an effect in one state, and the force along the path. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/path_force.h"

#include "evaluate/effect_formula.h"
#include "evaluate/evaluate.h"

/* The frame of a point of a path (kt_path_frame_of), computed from the poses of all links. */
static kt_effect_end frame_at(const kt_link_kinematics *kinematics, const kt_path_link *link) {
    const kt_link_kinematics *on = &kinematics[link->link];
    return (kt_effect_end){.axes = on->axes, .point = on->position, .omega = on->omega, .velocity = on->velocity};
}

void kt_path_value_find(const kt_model *model, const kt_data *data, const kt_link_kinematics *kinematics,
                        const kt_effect_record *effect, kt_path_value *value) {
    const kt_path_link *link = model->path_link + effect->path_link;
    kt_effect_end frame[KT_PATH_LINK_MAX];
    if (kinematics == NULL)
        kt_path_frames_of(model, data, effect, frame);
    for (int32_t k = 0; k < effect->path_link_count && kinematics != NULL; k++)
        frame[k] = frame_at(kinematics, &link[k]);
    kt_path_evaluate(model->path_point + effect->path_point, effect->path_count, frame, effect->path_link_count, value);
}

int kt_path_force_find(const kt_model *model, const kt_data *data, const kt_link_kinematics *kinematics,
                       const kt_effect_record *effect, const kt_dynamic_state *at, kt_path_value *value, double *force,
                       kt_effect_balance *balance) {
    double variables[KT_FORMULA_VARIABLE_MAX], found[6];
    kt_effect_end end[2];
    kt_path_value_find(model, data, kinematics, effect, value);
    kt_path_as_ends(value->length, value->rate, end);
    kt_formula_variables_read(model, data, kinematics, effect, at, end, variables);
    const int code = kt_formulas_evaluate(model, effect, variables, found);
    *force = found[0];
    if (balance)
        *balance = (kt_effect_balance){.supplied = found[0] * value->rate};
    return code;
}

int kt_path_lines(const kt_model *model, int effect, const kt_pose *poses, kt_path_line *each, void *user) {
    const kt_effect_record *record = kt_effect_record_find(model, effect);
    kt_effect_end frame[KT_PATH_LINK_MAX];
    if (record == NULL || record->path_count == 0)
        return 0;
    for (int32_t k = 0; k < record->path_link_count && each != NULL; k++) {
        const kt_path_link *link = &model->path_link[record->path_link + k];
        const kt_pose pose = kt_pose_compose(poses[link->body], kt_pose_invert(model->body[link->body].in_link));
        frame[k] = (kt_effect_end){.axes = pose.rotation, .point = pose.position};
    }
    return kt_path_trace(model->path_point + record->path_point, record->path_count, frame, each, user);
}

void kt_path_measure(const kt_path_point_record *points, int count, const kt_effect_end *frame, int links,
                     kt_path_value *value) {
    kt_path_evaluate(points, count, frame, links, value);
}
