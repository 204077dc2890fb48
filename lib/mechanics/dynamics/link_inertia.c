/* Inertias of links, summed from their bodies, in space and in planes; and gravity in planes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/vector_parts.h"
#include "dynamics/dynamics.h"

void kt_link_load(kt_model *model, const kt_body_record *body) {
    kt_link *link = &model->link[body->link];
    const kt_vec3 com = kt_pose_apply(body->in_link, body->com);
    const kt_sym3 about_com = kt_sym3_rotate(body->in_link.rotation, body->inertia);
    const kt_sym3 j = kt_sym3_shift(about_com, body->mass, com);
    link->inertia = kt_sym3_add(link->inertia, j);
    link->moment = kt_vec3_add(link->moment, kt_vec3_scale(body->mass, com));
    link->mass += body->mass;
}

void kt_planar_link_set_inertia(kt_model *model, size_t index) {
    const kt_link *link = &model->link[model->n.spatial + index - 1];
    const kt_mat3 own = kt_mat3_transpose(kt_v4_mat3(model->planar_rest[index].axes));
    const kt_vec3 moment = kt_mat3_apply_transposed(own, link->moment);
    const kt_sym3 *j = &link->inertia;
    kt_planar_link *planar = &model->planar[index];
    planar->moment[0] = moment.x;
    planar->moment[1] = moment.y;
    planar->inertia = kt_link_lengths(link) > 0 ? kt_vec3_dot(own.z, kt_sym3_apply(*j, own.z))
                                                : kt_vec3_part(kt_vec3_make(j->xx, j->yy, j->zz), link->axis);
    planar->mass = link->mass;
}

void kt_link_add_inertia(kt_model *model, int32_t index) {
    kt_link *link = &model->link[index];
    link->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    link->moment = kt_vec3_make(0.0, 0.0, 0.0);
    link->mass = 0.0;
    for (size_t b = 1; b < model->n.body; b++)
        if (model->body[b].link == index)
            kt_link_load(model, &model->body[b]);
    if (index > 0 && kt_link_is_planar(model, (size_t)index))
        kt_planar_link_set_inertia(model, (size_t)index - model->n.spatial + 1);
}

void kt_plane_set_weights(const kt_model *model, kt_plane *plane) {
    const kt_vec3 g = kt_mat3_apply_transposed(plane->basis, kt_v4_vec3(model->gravity));
    plane->gravity[0] = g.x;
    plane->gravity[1] = g.y;
}
