/* The coordinates of a loop that stands for a joint (kt_loop.coordinates).
 *
 * The motion of the second end relative to the first gives them as in any joint (joint/joint.h). Only whole turns of an
 * angle are unknown. Let s be the sum of the positions of the joints between the ends, each counted about the axis of
 * the loop. If all these joints turn about parallels of the axis, the angle is s plus a constant: the angle less s does
 * not change. With s0 the sum at the initial positions q0 and wrap(x) = x - 2 pi round(x / 2 pi), the angle at q0 is
 * wrap(angle - s + s0), and therefore
 *
 *     angle = wrap(measured - s + s0) + s - s0.
 *
 * A screw of pitch p counts its turns by its advance d: its angle is d / p.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/vector_parts.h"
#include "base/require.h"
#include "joint/joint.h"
#include "kinetree/joint.h"
#include "kinetree/loop.h"
#include "model/model.h"
#include "model/motion.h"

#include <math.h>
#include <string.h>

kt_coordinates kt_loop_coordinates(const kt_model *model, int loop) {
    if (!model || !KT_IS_INDEX(loop, model->n.loop))
        return (kt_coordinates){.type = KT_JOINT_FIXED};
    const kt_joint_type type = (kt_joint_type)model->loop[loop].joint;
    return (kt_coordinates){.type = type, .nq = kt_joint_sizes[type].nq, .nv = kt_joint_sizes[type].nv};
}

/* The factor with which a link counts in an angle about an axis of the world: 1, -1, or 0 if the link does not turn.
 * NaN if the link turns about another axis. */
static double turns_about(const kt_model *model, const kt_data *data, int32_t link, kt_vec3 axis) {
    const double parallel = 1e-9; /* sine of the angle that errors of integrated positions leave between axes */
    const kt_link *l = &model->link[link];
    const kt_motion_facts facts = kt_motion_facts_of(l->motion);
    if (facts.angles + facts.quaternions == 0)
        return 0.0;
    const kt_vec3 own = kt_mat3_column(data->kinematics[link].axes, l->axis);
    const bool is_parallel = facts.positions == 1 && kt_vec3_norm(kt_vec3_cross(own, axis)) < parallel;
    return is_parallel ? copysign(1.0, kt_vec3_dot(own, axis)) : (double)NAN;
}

/* The sum of changes of positions, from the initial ones on, that turn the second end about the axis of the loop; 0 if
 * they do not determine its angle. */
static double counted_turn(const kt_model *model, const kt_data *data, const kt_loop_record *r, const double *q) {
    const kt_link_kinematics *first = &data->kinematics[r->link[0]];
    const kt_vec3 axis = kt_mat3_apply(first->axes, r->frame[0].rotation.z);
    double sum = 0.0;
    for (int k = 0; k < 2; k++)
        for (int32_t i = r->link[k]; i != r->ancestor; i = model->link[i].parent) {
            const double turns = turns_about(model, data, i, axis);
            const int32_t at = model->link[i].q;
            sum += turns != 0.0 ? (k == 1 ? turns : -turns) * (q[at] - model->q0[at]) : 0.0;
        }
    return isnan(sum) ? 0.0 : sum;
}

/* The angle `measured` + 2 pi k that is nearest to `counted`, which is s - s0 above. */
static double angle_near(double measured, double counted) {
    const double turn = 6.283185307179586, margin = 1e-6; /* angles of half a turn, as given, stay positive */
    const double start = measured - counted;
    return start - turn * rint((start - margin) / turn) + counted;
}

/* The motion of the second end in the joint frame: the frames of loops have z along their axes. */
static kt_joint_motion joint_motion_of(const kt_loop_record *r, const kt_joint_axes *axes, const kt_loop_motion *m) {
    const bool is_universal = r->joint == KT_JOINT_UNIVERSAL;
    const kt_mat3 first = axes->triad, last = is_universal ? kt_triad_from_axis(axes->second, 2) : first;
    kt_joint_motion motion = {.pose.position = kt_mat3_apply(first, m->position)};
    motion.pose.rotation = kt_mat3_multiply(first, kt_mat3_multiply(m->rotation, kt_mat3_transpose(last)));
    motion.velocity.linear = kt_mat3_apply(first, m->velocity);
    motion.velocity.angular = kt_mat3_apply(first, m->omega);
    return motion;
}

/* Positions near which kt_joint_measure is to find those of the loop, given those nearest to zero. */
static void count_turns(const kt_model *model, const kt_data *data, const kt_loop_record *r, const double *q,
                        const double *measured, const kt_joint_motion *motion, double *near) {
    const double counted = counted_turn(model, data, r, q);
    const kt_joint_type type = (kt_joint_type)r->joint;
    for (int k = 0; k < kt_joint_sizes[type].nv; k++) {
        const kt_coordinate_kind kind = kt_joint_coordinate_kind(type, k);
        if (type == KT_JOINT_SCREW && r->pitch != 0.0)
            near[k] = kt_vec3_dot(kt_joint_unit(r->axis[0]), motion->pose.position) / r->pitch;
        else if ((kind == KT_COORDINATE_ANGLE || kind == KT_COORDINATE_TURNS) && type != KT_JOINT_UNIVERSAL)
            near[k] = angle_near(measured[k], counted);
    }
}

bool kt_loop_coordinates_evaluate(const kt_model *model, const kt_data *data, int loop, const double *q,
                                  double *positions, double *velocities) {
    kt_loop_motion seen;
    const kt_coordinates at = kt_loop_coordinates(model, loop);
    if (at.nq == 0 || !q || !positions || !velocities || !kt_loop_motion_evaluate(model, data, loop, &seen))
        return false;
    const kt_loop_record *r = &model->loop[loop];
    const kt_joint joint = {.type = at.type, .axis = r->axis[0], .axis2 = r->axis[1]};
    const kt_joint_axes axes = kt_joint_axes_of(&joint);
    const kt_joint_motion motion = joint_motion_of(r, &axes, &seen);
    double near[KT_JOINT_NQ_MAX] = {0.0}, found[KT_JOINT_NQ_MAX], rate[KT_JOINT_NV_MAX], ignored[KT_JOINT_NV_MAX];
    if (kt_joint_quaternion(at.type) >= 0)
        near[kt_joint_quaternion(at.type)] = 1.0;
    kt_joint_measure(at.type, &axes, &motion, near, found, rate, ignored);
    count_turns(model, data, r, q, found, &motion, near);
    kt_joint_measure(at.type, &axes, &motion, near, positions, rate, ignored);
    memcpy(velocities, rate, (size_t)at.nv * sizeof *rate);
    return true;
}
