/* Converts between the coordinates, forces and reactions of a tree and of its free bodies.
 *
 * The relative motion of a joint between bodies p and c, whose frame J is fixed to p, is in the axes of J
 *     x = R_J' (x_c - x_J),                          R = R_J' R_c
 *     w = R_J' (w_c - w_p),                          u = R_J' (v_c - v_p - w_p x d),                 d = x_c - x_p
 *     w' = R_J' (w_c' - w_p' - w_p x (w_c - w_p)),   u' = R_J' (a_c - a_p - w_p' x d - w_p x (w_p x d) - 2 w_p x R_J u)
 * and each joint type reads its coordinates from that.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/absolute.h"

#include "joint/joint.h"

#include <string.h>

/* ---- free bodies ------------------------------------------------------------------------------------------------- */

void kt_free_coordinates(kt_pose pose, kt_twist twist, double *q, double *v) {
    const kt_quat p = kt_quat_from_mat3(pose.rotation);
    const kt_vec3 w = kt_mat3_apply_transposed(pose.rotation, twist.angular);
    const double position[7] = {pose.position.x, pose.position.y, pose.position.z, p.w, p.x, p.y, p.z};
    const double velocity[6] = {twist.linear.x, twist.linear.y, twist.linear.z, w.x, w.y, w.z};
    memcpy(q, position, sizeof position);
    memcpy(v, velocity, sizeof velocity);
}

void kt_cross_motion(const kt_absolute_joint *joint, kt_pose parent, kt_twist parent_twist, const double *q,
                     const double *v, kt_pose *pose, kt_twist *twist) {
    const kt_mat3 triad = joint->axes.triad;
    const kt_mat3 turned = kt_mat3_multiply(kt_mat3_multiply(triad, kt_mat3_about(2, q[0])), kt_mat3_transpose(triad));
    const kt_pose frame = kt_pose_compose(parent, joint->frame);
    const kt_vec3 arm = kt_vec3_sub(frame.position, parent.position);
    const kt_vec3 spin = kt_vec3_scale(v[0], kt_mat3_apply(frame.rotation, triad.z));
    *pose = frame;
    pose->rotation = kt_mat3_multiply(frame.rotation, turned);
    twist->angular = kt_vec3_add(parent_twist.angular, spin);
    twist->linear = kt_vec3_add(parent_twist.linear, kt_vec3_cross(parent_twist.angular, arm));
}

/* A body in the world: rates of its frame's origin, world axes. */
typedef struct motion {
    kt_pose pose;
    kt_twist velocity, acceleration;
} motion;

/* The pose of a body of the absolute model; body 0 is the world. */
static kt_pose absolute_pose_of(const kt_model *absolute, int body, const double *q) {
    kt_pose pose = kt_pose_identity();
    if (body == 0)
        return pose;
    q += kt_body_coordinates(absolute, body).q;
    pose.position = kt_joint_load(q);
    pose.rotation = kt_mat3_from_quat(kt_quat_make(q[3], q[4], q[5], q[6]));
    return pose;
}

/* A free joint has the velocity of its body's origin in world axes, but the angular velocity in body axes. */
static motion absolute_motion_of(const kt_model *absolute, int body, const double *q, const double *v,
                                 const double *a) {
    motion m = {.pose = absolute_pose_of(absolute, body, q)};
    if (body == 0)
        return m;
    const int at = kt_body_coordinates(absolute, body).v;
    m.velocity.linear = kt_joint_load(v + at);
    m.velocity.angular = kt_mat3_apply(m.pose.rotation, kt_joint_load(v + at + 3));
    if (a) {
        m.acceleration.linear = kt_joint_load(a + at);
        m.acceleration.angular = kt_mat3_apply(m.pose.rotation, kt_joint_load(a + at + 3));
    }
    return m;
}

/* ---- from the tree ----------------------------------------------------------------------------------------------- */

static void write_free(const kt_model *absolute, int body, kt_pose pose, kt_twist twist, double *q, double *v) {
    const kt_coordinates at = kt_body_coordinates(absolute, body);
    kt_free_coordinates(pose, twist, q + at.q, v + at.v);
}

void kt_absolute_from_tree(const kt_absolute *of, const kt_data *data, const double *q, const double *v, double *free_q,
                           double *free_v) {
    if (of == NULL || !kt_data_serve(of->tree, data) || q == NULL || v == NULL || free_q == NULL || free_v == NULL)
        return;
    const kt_model *tree = of->tree, *absolute = of->model;
    for (int b = 1; b < kt_model_body_count(tree); b++) {
        const kt_absolute_joint *j = &of->joint[b];
        const kt_coordinates at = kt_body_coordinates(tree, b);
        const int up = kt_body_parent(tree, b);
        write_free(absolute, j->body, kt_body_pose(tree, data, b), kt_body_twist(tree, data, b), free_q, free_v);
        if (j->counter) {
            const kt_coordinates counter = kt_body_coordinates(absolute, j->counter);
            free_q[counter.q] = q[at.q];
            free_v[counter.v] = v[at.v];
        }
        if (j->cross) {
            kt_pose pose;
            kt_twist twist;
            kt_cross_motion(j, kt_body_pose(tree, data, up), kt_body_twist(tree, data, up), q + at.q, v + at.v, &pose,
                            &twist);
            write_free(absolute, j->cross, pose, twist, free_q, free_v);
        }
    }
}

/* ---- to the tree ------------------------------------------------------------------------------------------------- */

/* The formulas at the top: p and c are the parent and the body, and `frame` is J in the frame of p. */
static kt_joint_motion relative_motion(const motion *p, const motion *c, const kt_pose *frame) {
    const kt_pose joint = kt_pose_compose(p->pose, *frame);
    const kt_vec3 w = p->velocity.angular, d = kt_vec3_sub(c->pose.position, p->pose.position);
    const kt_vec3 carried = kt_vec3_cross(w, d), turning = kt_vec3_sub(c->velocity.angular, w);
    const kt_vec3 u = kt_vec3_sub(kt_vec3_sub(c->velocity.linear, p->velocity.linear), carried);
    const kt_vec3 twice = kt_vec3_add(kt_vec3_add(u, u), carried);
    const kt_vec3 swung = kt_vec3_cross(p->acceleration.angular, d);
    kt_vec3 dw = kt_vec3_sub(c->acceleration.angular, p->acceleration.angular);
    kt_vec3 du = kt_vec3_sub(kt_vec3_sub(c->acceleration.linear, p->acceleration.linear), swung);
    dw = kt_vec3_sub(dw, kt_vec3_cross(w, turning));
    du = kt_vec3_sub(du, kt_vec3_cross(w, twice));
    kt_joint_motion m;
    m.pose = kt_pose_compose(kt_pose_invert(joint), c->pose);
    m.velocity.angular = kt_mat3_apply_transposed(joint.rotation, turning);
    m.velocity.linear = kt_mat3_apply_transposed(joint.rotation, u);
    m.acceleration.angular = kt_mat3_apply_transposed(joint.rotation, dw);
    m.acceleration.linear = kt_mat3_apply_transposed(joint.rotation, du);
    return m;
}

/* Computes the coordinates of one joint; q and v hold the coordinates `ago` seconds earlier. */
static void measure_absolute_state(const kt_absolute_joint *j, kt_coordinates at, const kt_joint_motion *m, double ago,
                                   double *q, double *v, double *a) {
    double near[KT_JOINT_NQ_MAX], rate[KT_JOINT_NV_MAX], second[KT_JOINT_NV_MAX];
    memcpy(near, q + at.q, (size_t)at.nq * sizeof *near);
    kt_joint_measure(at.type, &j->axes, m, near, q + at.q, rate, second);
    if (at.nq == at.nv) { /* plain numbers: this predicted change gives the number of whole turns */
        for (int k = 0; k < at.nq; k++)
            near[k] += 0.5 * ago * (v[at.v + k] + rate[k]);
        kt_joint_measure(at.type, &j->axes, m, near, q + at.q, rate, second);
    }
    memcpy(v + at.v, rate, (size_t)at.nv * sizeof *v);
    if (a)
        memcpy(a + at.v, second, (size_t)at.nv * sizeof *a);
}

void kt_absolute_to_tree(const kt_absolute *of, const double *free_q, const double *free_v, const double *free_a,
                         double ago, double *q, double *v, double *a) {
    if (of == NULL || free_q == NULL || free_v == NULL || q == NULL || v == NULL || (free_a == NULL) != (a == NULL))
        return;
    const kt_model *tree = of->tree, *absolute = of->model;
    for (int b = 1; b < kt_model_body_count(tree); b++) {
        const kt_absolute_joint *j = &of->joint[b];
        const kt_coordinates at = kt_body_coordinates(tree, b);
        if (at.nq == 0)
            continue;
        const motion p = absolute_motion_of(absolute, j->parent, free_q, free_v, free_a);
        const motion c = absolute_motion_of(absolute, j->body, free_q, free_v, free_a);
        const kt_joint_motion m = relative_motion(&p, &c, &j->frame);
        measure_absolute_state(j, at, &m, ago, q, v, a);
    }
}

/* ---- forces ------------------------------------------------------------------------------------------------------ */

static kt_vec3 joint_point(const kt_model *absolute, const kt_absolute_joint *j, const double *free_q) {
    return kt_pose_apply(absolute_pose_of(absolute, j->parent, free_q), j->frame.position);
}

/* The wrench that tau exerts on the body of a joint, about the body's origin, world axes. */
static kt_wrench joint_wrench(const kt_model *absolute, const kt_absolute_joint *j, const double *tau,
                              const double *free_q) {
    const kt_pose joint = kt_pose_compose(absolute_pose_of(absolute, j->parent, free_q), j->frame);
    const kt_pose relative = kt_pose_compose(kt_pose_invert(joint), absolute_pose_of(absolute, j->body, free_q));
    kt_wrench w = kt_joint_wrench((kt_joint_type)j->type, &j->axes, &relative, tau);
    w.moment = kt_mat3_apply(joint.rotation, w.moment);
    w.force = kt_mat3_apply(joint.rotation, w.force);
    return w;
}

/* Adds a wrench, given about `point`, about a free body's origin. */
static void add_at(const kt_model *absolute, int body, kt_vec3 point, kt_wrench w, const double *free_q,
                   kt_wrench *wrenches) {
    const kt_vec3 arm = kt_vec3_sub(point, absolute_pose_of(absolute, body, free_q).position);
    const kt_vec3 moment = kt_vec3_add(w.moment, kt_vec3_cross(arm, w.force));
    wrenches[body].moment = kt_vec3_add(wrenches[body].moment, moment);
    wrenches[body].force = kt_vec3_add(wrenches[body].force, w.force);
}

void kt_absolute_wrenches(const kt_absolute *of, const double *free_q, const double *tau, const kt_wrench *external,
                          kt_wrench *wrenches) {
    if (of == NULL || free_q == NULL || wrenches == NULL)
        return;
    const kt_model *tree = of->tree, *absolute = of->model;
    memset(wrenches, 0, (size_t)kt_model_body_count(absolute) * sizeof *wrenches);
    for (int b = 1; b < kt_model_body_count(tree) && external; b++)
        wrenches[of->joint[b].body] = external[b];
    for (int b = 1; b < kt_model_body_count(tree) && tau; b++) {
        const kt_absolute_joint *j = &of->joint[b];
        const kt_coordinates at = kt_body_coordinates(tree, b);
        if (at.nv == 0)
            continue;
        const kt_vec3 origin = absolute_pose_of(absolute, j->body, free_q).position;
        const kt_wrench w = joint_wrench(absolute, j, tau + at.v, free_q);
        const kt_wrench opposite = {kt_vec3_scale(-1.0, w.moment), kt_vec3_scale(-1.0, w.force)};
        add_at(absolute, j->body, origin, w, free_q, wrenches);
        add_at(absolute, j->parent, origin, opposite, free_q, wrenches);
    }
}

static void add_wrench(kt_wrench *sum, kt_wrench w, kt_vec3 moved) {
    sum->moment = kt_vec3_add(sum->moment, kt_vec3_add(w.moment, moved));
    sum->force = kt_vec3_add(sum->force, w.force);
}

/* The tree's loops come first among those of the absolute formulation. */
void kt_absolute_reactions(const kt_absolute *of, const double *free_q, const double *tau, const kt_wrench *from,
                           kt_wrench *joints, kt_wrench *loops) {
    if (of == NULL || free_q == NULL || from == NULL || joints == NULL || (loops == NULL && of->tree->n.loop > 0))
        return;
    const kt_model *tree = of->tree, *absolute = of->model;
    const kt_vec3 none = {0.0, 0.0, 0.0};
    memset(joints, 0, (size_t)kt_model_body_count(tree) * sizeof *joints);
    if (tree->n.loop > 0)
        memcpy(loops, from, tree->n.loop * sizeof *loops);
    for (int b = 1; b < kt_model_body_count(tree); b++) {
        const kt_absolute_joint *j = &of->joint[b];
        const kt_coordinates at = kt_body_coordinates(tree, b);
        if (j->loop >= 0)
            add_wrench(&joints[b], from[j->loop], none);
        if (j->tie >= 0) /* a moment, or a force along the axis, on which its point lies */
            add_wrench(&joints[b], from[j->tie], none);
        if (!tau || at.nv == 0)
            continue;
        const kt_wrench applied = joint_wrench(absolute, j, tau + at.v, free_q);
        const kt_vec3 arm =
            kt_vec3_sub(absolute_pose_of(absolute, j->body, free_q).position, joint_point(absolute, j, free_q));
        add_wrench(&joints[b], applied, kt_vec3_cross(arm, applied.force));
    }
}
