/* Sensors of many states: motion and Jacobians of frames, in lanes. States that lanes cannot compute use the calls for
 * one state. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/where.h"
#include "batch/batch.h"

#include "kinetree/control.h"
#include "kinetree/dynamics.h"

#include <string.h>

/* Returns the memory for a state's results for one frame; NULL: these results are not requested. */
static kt_frame_motion *sensed_motion_of(const kt_batch_sensors *s, size_t state, size_t frame) {
    return s->motion ? s->motion + state * s->count + frame : NULL;
}

static double *jacobian_of(const kt_batch *batch, const kt_batch_sensors *s, size_t state, size_t frame) {
    return s->jacobian ? s->jacobian + (state * s->count + frame) * 6 * batch->n.nv : NULL;
}

/* Lanes are copied over these structs, number by number. */
_Static_assert(sizeof(kt_pose) == KT_POSE_NUMBERS * sizeof(double), "a pose is its numbers");
_Static_assert(sizeof(kt_frame_motion) == KT_FRAME_NUMBERS * sizeof(double), "a frame's motion is its numbers");

/* ---- one state --------------------------------------------------------------------------------------------------- */

/* From the kinematics that data hold. */
static kt_frame_motion frame_motion(const kt_model *model, const kt_data *data, const kt_batch_frame *frame) {
    const int body = frame->body;
    kt_frame_motion out = {.pose = kt_body_pose(model, data, body),
                           .velocity = kt_body_twist(model, data, body),
                           .acceleration = kt_body_acceleration(model, data, body)};
    if (frame->marker >= 0) {
        const kt_vec3 at = kt_marker_at(model, body, frame->marker);
        out.pose = kt_marker_pose(model, data, body, frame->marker);
        out.velocity.linear = kt_point_velocity(model, data, body, at);
        out.acceleration.linear = kt_point_acceleration(model, data, body, at);
    }
    return out;
}

/* Evaluates the sensors of one state with the functions for one state, and with that state's own model. */
static void sense_alone(kt_batch_work *w, kt_batch_group *group, const kt_batch_sensors *s, size_t lane,
                        kt_batch_fault *fault) {
    const kt_batch *batch = w->batch;
    const size_t state = group->first + lane, nv = batch->n.nv;
    const kt_model *model = batch->own[state];
    kt_error made;
    kt_batch_take(w, group, lane);
    kt_lane_take(batch->a + group->first * nv, batch->n.width, lane, nv, w->one_a);
    w->alone_count++;
    if (kt_kinematics_update(model, w->data, w->one_q, w->one_v, w->one_a, &made) != KT_OK) {
        kt_batch_fail(w, group, lane, &made, fault);
        return;
    }
    for (size_t i = 0; i < s->count; i++) {
        const kt_batch_frame *frame = &s->frames[i];
        const kt_vec3 at = kt_vec3_make(0.0, 0.0, 0.0);
        if (s->motion)
            *sensed_motion_of(s, state, i) = frame_motion(model, w->data, frame);
        if (s->jacobian)
            kt_point_jacobian(model, w->data, frame->body,
                              frame->marker < 0 ? at : kt_marker_at(model, frame->body, frame->marker),
                              jacobian_of(batch, s, state, i));
    }
}

/* ---- in lanes ---------------------------------------------------------------------------------------------------- */

/* Markers with the same index may have other positions in the models of other lanes. */
static void take_markers(const kt_batch *batch, const kt_batch_group *group, const kt_batch_frame *frame, double *out) {
    for (size_t lane = 0; lane < batch->n.width; lane++) {
        const kt_model *model = batch->own[group->first + lane];
        const kt_pose *pose = &model->marker[model->body[frame->body].marker + frame->marker].frame;
        kt_lane_put(&pose->rotation.x.x, batch->n.width, lane, KT_POSE_NUMBERS, out);
    }
}

/* Evaluates sensor i in `lanes`, from the kinematics that the workspace holds. The kernel writes only nonzero columns
 * of a Jacobian, so that its memory is cleared first. */
static void sense_frame(kt_batch_work *w, const kt_batch_group *group, const kt_batch_sensors *s, size_t i,
                        kt_lane_mask lanes) {
    const kt_batch *batch = w->batch;
    const size_t width = batch->n.width;
    const kt_batch_frame *frame = &s->frames[i];
    _Alignas(KT_ALIGNMENT) double marker[KT_POSE_NUMBERS * KT_LANES_MOST], motion[KT_FRAME_NUMBERS * KT_LANES_MOST];
    const kt_lane_frame at = {.body = frame->body, .marker = frame->marker < 0 ? NULL : marker};
    double *out[KT_LANES_MOST] = {NULL};
    if (at.marker)
        take_markers(batch, group, frame, marker);
    if (s->motion)
        batch->kernels->frame(group->model, w->lanes, &at, motion);
    for (size_t lane = 0; lane < width; lane++) {
        if (!kt_lane_is_in(lanes, lane))
            continue;
        if (s->motion)
            kt_lane_take(motion, width, lane, KT_FRAME_NUMBERS, (double *)sensed_motion_of(s, group->first + lane, i));
        out[lane] = jacobian_of(batch, s, group->first + lane, i);
        if (out[lane])
            memset(out[lane], 0, 6 * batch->n.nv * sizeof *out[lane]);
    }
    if (s->jacobian)
        batch->kernels->jacobian(group->model, w->lanes, &at, out);
}

/* Computes the motion of all links. Numbers that are not finite may have no effect on the motion, such as the velocity
 * of a joint about its own axis. The call for one state rejects them nevertheless, so that this function checks all
 * numbers. */
static kt_lane_mask move_lane_links(kt_batch_work *w, const kt_batch_group *group, const double *a) {
    const kt_lane_kernels *kernels = w->batch->kernels;
    const kt_batch_counts *n = &w->batch->n;
    if (!kernels || !group->model)
        return 0;
    return group->active & kernels->finite(group->q, n->nq + n->nv) & kernels->finite(a, n->nv) &
           kernels->kinematics(group->model, w->lanes, group->q, group->v, a);
}

void kt_batch_sense_group(kt_batch_work *w, kt_batch_group *group, const kt_batch_sensors *sensors,
                          kt_batch_fault *fault) {
    const kt_lane_mask done = move_lane_links(w, group, w->batch->a + group->first * w->batch->n.nv);
    for (size_t i = 0; i < sensors->count && done; i++)
        sense_frame(w, group, sensors, i, done);
    for (size_t lane = 0; lane < group->used; lane++) {
        if (kt_lane_is_in(done, lane))
            w->in_lanes++;
        else
            sense_alone(w, group, sensors, lane, fault);
    }
}

kt_status kt_batch_check_sensors(const kt_batch *batch, const kt_batch_sensors *sensors, kt_error *error) {
    if (KT_IS_MISSING(error, sensors))
        return KT_ERROR_ARGUMENT;
    if (sensors->count > 0 && !sensors->frames)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "sensors.frames", "is NULL, and count is %lu",
                            (unsigned long)sensors->count);
    for (size_t i = 0; i < sensors->count; i++) {
        const kt_batch_frame *frame = &sensors->frames[i];
        if (KT_IS_INDEX(frame->body, batch->model->n.body) &&
            (frame->marker == -1 || KT_IS_INDEX(frame->marker, batch->model->body[frame->body].marker_count)))
            continue;
        return kt_error_set(error, KT_ERROR_ARGUMENT, kt_where_format("sensors.frames[%lu]", (unsigned long)i).text,
                            "there is no marker %d of a body %d", frame->marker, frame->body);
    }
    return KT_OK;
}
