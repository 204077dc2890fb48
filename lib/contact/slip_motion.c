/* The velocities of contacts that slip (slip.c), and the frames in which their friction acts. */
#include "contact/slip.h"
#include "dynamics/motion.h"
#include "reduction/kernel.h"

#include <math.h>

/* d follows slip that is faster than `directed`, m/s, if the cosine of its angle with s is less than `aligned`. */
static const double directed = 1e-11, aligned = 0.9;

typedef struct slip_end {
    kt_mat3 axes;
    kt_vec3 point, omega, velocity;
    kt_vec3 arm, lever; /* from its body's origin, and from its link's */
} slip_end;

/* The axes of a sphere are not computed: only those of planes and discs are read. */
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

/* find_slip of a sphere on a plane that is at rest. */
static void find_slip_on_ground(const kt_link_kinematics *link, const kt_effect_record *effect, double s[2],
                                kt_slip_frame *frame) {
    const kt_mat3 *plane = &effect->frame[1].rotation;
    const kt_vec3 at = effect->frame[1].position, down = kt_vec3_scale(-effect->radius, plane->z);
    const kt_vec3 arm = kt_mat3_apply(link->axes, effect->frame[0].position);
    const kt_vec3 slip =
        kt_vec3_add(kt_vec3_add(link->velocity, kt_vec3_cross(link->omega, arm)), kt_vec3_cross(link->omega, down));
    s[0] = kt_vec3_dot(plane->x, slip);
    s[1] = kt_vec3_dot(plane->y, slip);
    if (frame == NULL)
        return;
    const kt_vec3 on_plane = kt_vec3_sub(kt_vec3_add(kt_vec3_add(link->position, arm), down), at);
    frame->axis[0] = plane->x;
    frame->axis[1] = plane->y;
    frame->arm[0] = kt_vec3_add(kt_mat3_apply(link->axes, effect->arm[0]), down);
    frame->arm[1] = kt_vec3_add(effect->arm[1], on_plane);
    frame->lever[0] = kt_vec3_add(arm, down);
    frame->lever[1] = kt_vec3_add(at, on_plane);
}

/* Finds the slip velocity of a contact from the motion of both links, and unless frame is NULL the axes and arms of its
 * friction. */
static void find_slip(const kt_link_kinematics *of_sphere, const kt_link_kinematics *of_plane,
                      const kt_effect_record *effect, double s[2], kt_slip_frame *frame) {
    if (effect->link[1] == 0 && effect->link[0] != 0 && !effect->disc) {
        find_slip_on_ground(of_sphere, effect, s, frame);
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
    if (!KT_HAS_LOOPS || model->n.planar > 0)
        return false;
    const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(model);
    if (!data->placed)
        kernels->pose(model, data, q);
    data->placed = false;
    kernels->move(model, data, v);
    return true;
}

/* Finds axes, position and velocities of a link from this motion, along its path. For the ground nothing is written. */
static void follow_link(const kt_model *model, const kt_data *data, const double *v, int32_t link,
                        kt_link_kinematics *motion) {
    const kt_link_motion *own = &data->motion[link];
    kt_real3 position = kt_zero3(), velocity = kt_zero3();
    if (link == 0)
        return;
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
    motion->axes = kt_v4_mat3(own->axes);
    motion->omega = kt_v4_vec3(own->omega);
    motion->position = kt_v4_vec3(position);
    motion->velocity = kt_v4_vec3(velocity);
}

void kt_slip_find_frames(const kt_model *model, kt_data *data, const kt_dynamic_state *at) {
    kt_link_kinematics *links = kt_links_scratch(data), own[2];
    int32_t followed[2] = {0, 0}; /* the links of `own`; contacts of a link follow each other */
    data->posed = set_poses_of_slip(model, data, at->q, at->v);
    if (!data->posed)
        kt_links_sweep(model, data, at->q, at->v, links);
    for (size_t k = 0; k < model->n.slip; k++) {
        const kt_effect_record *effect = kt_slip_problem_of(data)->contact[k].effect;
        for (int end = 0; end < 2 && data->posed; end++)
            if (effect->link[end] != followed[end])
                follow_link(model, data, at->v, followed[end] = effect->link[end], &own[end]);
        find_slip(data->posed ? &own[0] : &links[effect->link[0]], data->posed ? &own[1] : &links[effect->link[1]],
                  effect, data->slip_velocity + 2 * k, &data->slip_frame[k]);
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

bool kt_slip_follow(const kt_model *model, kt_data *data, const double *q, const double *v) {
    bool any = false;
    kt_slip_find_rates(model, data, q, v, data->slip_velocity);
    for (size_t k = 0; k < model->n.slip; k++) {
        const double *s = data->slip_velocity + 2 * k, size = kt_hypot(s[0], s[1]);
        double *d = data->slip + 2 * k;
        if (!(size > directed) || s[0] * d[0] + s[1] * d[1] >= aligned * size)
            continue;
        for (size_t i = 0; i < 2; i++)
            d[i] = s[i] / size;
        any = true;
    }
    return any;
}
