/* Poses and motion of all links in world axes: the forward pass of sweep.h, without gravity. */
#include "dynamics/dynamics.h"
#include "dynamics/sweep.h"

/* The sum of x - x over a link's motion: 0 if all of it is finite, NaN otherwise. (An offset or an angular velocity
 * that is not finite shows in the accelerations.) */
KT_INLINE kt_v4 excess(const kt_link_motion *m, const kt_link_origin *at) {
    return ((m->alpha - m->alpha) + (m->linear - m->linear)) +
           ((at->position - at->position) + (at->velocity - at->velocity));
}

KT_INLINE bool is_zero(kt_v4 x) { return x[0] + x[1] + x[2] == 0.0; }

/* posed: the data already hold the poses. */
KT_INLINE size_t sweep(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a,
                       bool posed) {
    const kt_v4 none = kt_v4_splat(0.0);
    kt_link_motion *motion = data->motion;
    kt_link_origin *at = data->origin;
    kt_v4 sum = none;
    if (!posed)
        kt_sincos_gather(q, model->angle, model->n.spatial_angle, data->sine, data->cosine);
    kt_ground_set(none, &motion[0]);
    memset(&at[0], 0, sizeof at[0]);
    for (size_t i = 1; i < model->n.spatial; i++) {
        const kt_link *link = &model->link[i];
        const kt_link_motion *parent = &motion[link->parent];
        kt_link_motion *m = &motion[i];
        if (!posed)
            kt_link_pose(link, parent, q, data->cosine, data->sine, m);
        kt_link_velocity(link, parent, v, m);
        kt_link_acceleration(link, parent, a, m);
        kt_v4 angular, linear;
        kt_joint_twist(link, parent, m, v, &angular, &linear);
        at[i].position = at[link->parent].position + m->offset;
        at[i].velocity = at[link->parent].velocity + kt_v4_cross(parent->omega, m->offset) + linear;
        sum += excess(m, &at[i]);
    }
    size_t failed = is_zero(sum) ? 0 : 1;
    while (failed && is_zero(excess(&motion[failed], &at[failed])))
        failed++;
    return failed;
}

size_t KT_KERNEL(kt_kinematics)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                const double *a) {
    return sweep(model, data, q, v, a, false);
}

size_t KT_KERNEL(kt_follow)(const kt_model *model, kt_data *data, const double *q, const double *v, const double *a) {
    return sweep(model, data, q, v, a, true);
}
