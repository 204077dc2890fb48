/* The velocities of contacts that slip (slip.c), and the frames in which their friction acts. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/joint_motion.h"
#include "evaluate/slip.h"
#include "reduction/kernel.h"

/* d follows slip if the cosine of its angle with s is less than this. */
static const double aligned = 0.9;

typedef struct slip_end {
    kt_mat3 axes;
    kt_vec3 point, omega, velocity;
    kt_vec3 arm, lever; /* from its body's origin, and from its link's */
} slip_end;

/* The axes of a sphere are not computed, because only the axes of planes and discs are read. */
static inline slip_end slip_end_of(const kt_link_kinematics *link, const kt_effect_record *effect, int k) {
    if (effect->link[k] == 0) { /* the ground, at rest */
        const kt_vec3 at = effect->frame[k].position;
        return (slip_end){.axes = effect->frame[k].rotation, .point = at, .arm = effect->arm[k], .lever = at};
    }
    const kt_vec3 arm = kt_mat3_apply(link->axes, effect->frame[k].position);
    return (slip_end){.axes =
                          k == 1 || effect->disc ? kt_mat3_multiply(link->axes, effect->frame[k].rotation) : link->axes,
                      .point = kt_vec3_add(link->position, arm),
                      .omega = link->omega,
                      .velocity = kt_vec3_add(link->velocity, kt_vec3_cross(link->omega, arm)),
                      .arm = kt_mat3_apply(link->axes, effect->arm[k]),
                      .lever = arm};
}

/* Whether a contact is between a sphere and a plane at rest. */
static inline bool is_on_ground(const kt_effect_record *effect) {
    return effect->link[1] == 0 && effect->link[0] != 0 && !effect->disc;
}

KT_INLINE void store_vec3(kt_vec3 *to, kt_v4 x) { memcpy(to, &x, sizeof *to); }

/* The motion of a link: its axes, and its angular velocity, position and velocity. */
typedef struct link_state {
    const kt_v4 *axes;
    kt_v4 omega, position, velocity;
} link_state;

/* find_slip of such a contact. */
KT_INLINE void find_slip_on_ground(const link_state *link, const kt_effect_record *effect, double s[2],
                                   kt_slip_frame *frame) {
    const kt_mat3 *plane = &effect->frame[1].rotation;
    const kt_v4 down = kt_v4_splat(-effect->radius) * kt_v4_from(plane->z);
    const kt_v4 arm = kt_v4_apply_to(link->axes, effect->frame[0].position);
    const kt_v4 slip = link->velocity + kt_v4_cross(link->omega, arm) + kt_v4_cross(link->omega, down);
    s[0] = kt_v4_dot(kt_v4_from(plane->x), slip);
    s[1] = kt_v4_dot(kt_v4_from(plane->y), slip);
    if (frame == NULL)
        return;
    const kt_v4 at = kt_v4_from(effect->frame[1].position), on_plane = link->position + arm + down - at;
    frame->axis[0] = plane->x;
    frame->axis[1] = plane->y;
    store_vec3(&frame->lever[0], arm + down);
    store_vec3(&frame->arm[0], kt_v4_apply_to(link->axes, effect->arm[0]) + down);
    store_vec3(&frame->arm[1], kt_v4_from(effect->arm[1]) + on_plane);
}

/* Finds the slip velocity of a contact from the motion of both links, and unless frame is NULL the axes and arms of its
 * friction. */
static void find_slip(const kt_link_kinematics *of_sphere, const kt_link_kinematics *of_plane,
                      const kt_effect_record *effect, double s[2], kt_slip_frame *frame) {
    if (is_on_ground(effect)) {
        kt_v4 axes[3];
        kt_v4_from_mat3(of_sphere->axes, axes);
        const link_state link = {axes, kt_v4_from(of_sphere->omega), kt_v4_from(of_sphere->position),
                                 kt_v4_from(of_sphere->velocity)};
        find_slip_on_ground(&link, effect, s, frame);
        return;
    }
    const slip_end centre = slip_end_of(of_sphere, effect, 0), plane = slip_end_of(of_plane, effect, 1);
    const kt_vec3 down = kt_contact_lowest(effect, centre.axes, plane.axes.z);
    const kt_vec3 lever = kt_vec3_sub(kt_vec3_add(centre.point, down), plane.point);
    const kt_vec3 on_sphere = kt_vec3_add(centre.velocity, kt_vec3_cross(centre.omega, down));
    const kt_vec3 on_plane = kt_vec3_add(plane.velocity, kt_vec3_cross(plane.omega, lever));
    const kt_vec3 slip = kt_vec3_sub(on_sphere, on_plane);
    s[0] = kt_vec3_dot(plane.axes.x, slip);
    s[1] = kt_vec3_dot(plane.axes.y, slip);
    if (frame)
        *frame = (kt_slip_frame){.axis = {plane.axes.x, plane.axes.y},
                                 .arm = {kt_vec3_add(centre.arm, down), kt_vec3_add(plane.arm, lever)},
                                 .lever = {kt_vec3_add(centre.lever, down), kt_vec3_add(plane.lever, lever)}};
}

/* Sets poses and velocities in the data's motion. Returns false if the model has planar links. */
static bool set_poses_of_slip(const kt_model *model, kt_data *data, const double *q, const double *v) {
    if (model->n.planar > 0)
        return false;
    const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
    if (!data->placed)
        kernels->pose(model, data, q);
    data->placed = false;
    kernels->move(model, data, v);
    return true;
}

/* Finds the state of a link from this motion, along its path. */
static void follow_link(const kt_model *model, const kt_data *data, const double *v, int32_t link, link_state *state) {
    kt_real3 position = kt_zero3(), velocity = kt_zero3();
    for (int32_t i = link; i > 0; i = model->link[i].parent) {
        const kt_link_motion *m = &data->motion[i], *up = &data->motion[model->link[i].parent];
        kt_real3 angular, linear;
        position = kt_add3(position, m->offset);
        if (model->link[i].parent != 0) /* the ground does not turn */
            velocity = kt_add3(velocity, kt_cross3(up->omega, m->offset));
        if (kt_link_is_revolute(&model->link[i]))
            continue;
        kt_joint_twist(&model->link[i], up, m, v, &angular, &linear);
        velocity = kt_add3(velocity, linear);
    }
    *state = (link_state){data->motion[link].axes, data->motion[link].omega, position, velocity};
}

/* find_slip from this motion, unless a sphere is on a plane at rest. */
static void find_slip_along_paths(const kt_model *model, kt_data *data, const double *v, size_t k) {
    const kt_effect_record *effect = kt_slip_problem_of(data)->contact[k].effect;
    kt_link_kinematics motion[2];
    for (int end = 0; end < 2; end++) {
        link_state state;
        if (effect->link[end] == 0) /* the ground's is not read */
            continue;
        follow_link(model, data, v, effect->link[end], &state);
        motion[end].axes = kt_v4_mat3(state.axes);
        motion[end].omega = kt_v4_vec3(state.omega);
        motion[end].position = kt_v4_vec3(state.position);
        motion[end].velocity = kt_v4_vec3(state.velocity);
    }
    find_slip(&motion[0], &motion[1], effect, data->slip_velocity + 2 * k, &data->slip_frame[k]);
}

/* Finds slip from this motion. */
static void find_frames_of_motion(const kt_model *model, kt_data *data, const double *v) {
    const kt_slip_contact *contact = kt_slip_problem_of(data)->contact;
    int32_t followed = 0; /* the link of `state`; contacts of a link follow each other */
    link_state state;
    for (size_t k = 0; k < model->n.slip; k++) {
        const kt_effect_record *effect = contact[k].effect;
        if (!is_on_ground(effect)) {
            find_slip_along_paths(model, data, v, k);
            continue;
        }
        if (effect->link[0] != followed)
            follow_link(model, data, v, followed = effect->link[0], &state);
        find_slip_on_ground(&state, effect, data->slip_velocity + 2 * k, &data->slip_frame[k]);
    }
}

void kt_slip_find_frames(const kt_model *model, kt_data *data, const kt_dynamic_state *at) {
    data->posed = set_poses_of_slip(model, data, at->q, at->v);
    if (data->posed) {
        find_frames_of_motion(model, data, at->v);
        return;
    }
    kt_link_kinematics *links = kt_links_scratch(data);
    kt_links_sweep(model, data, at->q, at->v, links);
    for (size_t k = 0; k < model->n.slip; k++) {
        const kt_effect_record *effect = kt_slip_problem_of(data)->contact[k].effect;
        find_slip(&links[effect->link[0]], &links[effect->link[1]], effect, data->slip_velocity + 2 * k,
                  &data->slip_frame[k]);
    }
}

void kt_slip_find_rates(const kt_model *model, kt_data *data, const double *q, const double *v, double *s) {
    kt_link_kinematics *links = kt_links_scratch(data);
    kt_links_sweep(model, data, q, v, links);
    for (size_t i = 0; i < model->n.loop; i++)
        if (model->loop[i].slips > 0) {
            const kt_effect_record *effect = kt_effect_record_find(model, model->loop[i].slips - 1);
            find_slip(&links[effect->link[0]], &links[effect->link[1]], effect, s, NULL);
            s += 2;
        }
}

bool kt_slip_follow(const kt_model *model, kt_data *data, const double *q, const double *v, double least) {
    bool any = false;
    kt_slip_find_rates(model, data, q, v, data->slip_velocity);
    for (size_t k = 0; k < model->n.slip; k++) {
        const double *s = data->slip_velocity + 2 * k, size = kt_hypot(s[0], s[1]);
        double *d = data->slip + 2 * k;
        const bool is_aligned = s[0] * d[0] + s[1] * d[1] >= aligned * size;
        if (!(size > least) || (is_aligned && !kt_slip_lags(data, k)))
            continue;
        for (size_t i = 0; i < 2; i++)
            d[i] = s[i] / size;
        any = true;
    }
    return any;
}
