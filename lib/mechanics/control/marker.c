/* Frames of markers: those of their bodies, turned by a constant rotation S. So with KT_TWIST_BODY every quantity y in
 * the body's axes becomes S'y in the marker's. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "control/control.h"

static const kt_marker_record *marker_record_of(const kt_model *model, int body, int marker) {
    if (!model || !KT_IS_INDEX(body, model->n.body) || !KT_IS_INDEX(marker, model->body[body].marker_count))
        return NULL;
    return &model->marker[model->body[body].marker + marker];
}

/* A 6 x nv matrix of a frame of a body. */
typedef void frame_matrix(const kt_model *model, const kt_data *data, int body, kt_vec3 point, kt_twist_frame frame,
                          double *matrix);

/* Computes the Jacobian of the marker's place, with its columns in the marker's axes. */
static void compute_of_marker(frame_matrix *compute, const kt_model *model, const kt_data *data, int body, int marker,
                              kt_twist_frame frame, double *matrix) {
    const kt_marker_record *m = marker_record_of(model, body, marker);
    if (!m || !kt_data_serve(model, data) || !matrix)
        return;
    compute(model, data, body, m->frame.position, frame, matrix);
    for (size_t k = 0; k < 2 * model->n.v && frame == KT_TWIST_BODY; k++) {
        double *part = matrix + 3 * k;
        const kt_vec3 y = kt_mat3_apply_transposed(m->frame.rotation, kt_vec3_make(part[0], part[1], part[2]));
        part[0] = y.x, part[1] = y.y, part[2] = y.z;
    }
}

kt_pose kt_marker_pose(const kt_model *model, const kt_data *data, int body, int marker) {
    const kt_marker_record *m = marker_record_of(model, body, marker);
    const kt_pose pose = kt_body_pose(model, data, m ? body : -1);
    return m ? kt_pose_compose(pose, m->frame) : pose;
}

void kt_marker_jacobian(const kt_model *model, const kt_data *data, int body, int marker, kt_twist_frame frame,
                        double *jacobian) {
    compute_of_marker(kt_frame_jacobian, model, data, body, marker, frame, jacobian);
}

kt_twist kt_marker_bias(const kt_model *model, const kt_data *data, int body, int marker, kt_twist_frame frame) {
    const kt_marker_record *m = marker_record_of(model, body, marker);
    const kt_vec3 origin = {0.0, 0.0, 0.0};
    kt_twist bias = kt_frame_bias(model, data, m ? body : -1, m ? m->frame.position : origin, frame);
    if (m && frame == KT_TWIST_BODY) {
        bias.angular = kt_mat3_apply_transposed(m->frame.rotation, bias.angular);
        bias.linear = kt_mat3_apply_transposed(m->frame.rotation, bias.linear);
    }
    return bias;
}

void kt_marker_jacobian_derivative(const kt_model *model, const kt_data *data, int body, int marker,
                                   kt_twist_frame frame, double *derivative) {
    compute_of_marker(kt_frame_jacobian_derivative, model, data, body, marker, frame, derivative);
}

void kt_marker_twist_derivative(const kt_model *model, const kt_data *data, int body, int marker, kt_twist_frame frame,
                                double *derivative) {
    compute_of_marker(kt_frame_twist_derivative, model, data, body, marker, frame, derivative);
}
