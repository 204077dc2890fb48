/* Poses and motion of all links in world axes: the forward pass of sweep.h, without gravity. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/angles.h"
#include "dynamics/dynamics.h"
#include "dynamics/excess.h"
#include "dynamics/sweep.h"

#include <assert.h>

/* posed: the data already hold the poses. */
KT_INLINE size_t sweep(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v, const kt_real1 *a,
                       bool posed) {
    kt_link_motion *motion = data->motion;
    kt_link_origin *at = data->origin;
    kt_real3 sum = kt_zero3();
    if (!posed)
        kt_angles_gather(model, data, q, 0, model->n.spatial_angle, data->sine, data->cosine);
    kt_ground_set(kt_zero3(), &motion[0]);
    memset(&at[0], 0, sizeof at[0]);
    for (size_t i = 1; i < model->n.spatial; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *parent = &motion[link->parent];
        kt_link_motion *m = &motion[i];
        if (!posed)
            kt_link_pose(link, parent, q, data->cosine, data->sine, m);
        kt_link_velocity(link, parent, v, m);
        kt_link_acceleration(link, parent, a, m);
        kt_real3 angular, linear;
        kt_joint_twist(link, parent, m, v, &angular, &linear);
        at[i].position = kt_add3(at[link->parent].position, m->offset);
        at[i].velocity = kt_add3(kt_add3(at[link->parent].velocity, kt_cross3(parent->omega, m->offset)), linear);
        sum = kt_add3(sum, kt_excess(m, &at[i]));
    }
    return kt_first_excess(data, sum, 1);
}

size_t KT_KERNEL(kt_kinematics)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                const kt_real1 *a) {
    assert(kt_data_serve(model, data));
    return sweep(model, data, q, v, a, false);
}

size_t KT_KERNEL(kt_follow)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                            const kt_real1 *a) {
    assert(kt_data_serve(model, data));
    return sweep(model, data, q, v, a, true);
}
