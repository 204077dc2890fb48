/* Planar and floating joints of URDF: places, mass matrix and weight against closed forms in the axes of the file. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "r.urdf"
#include "robot.h"

#include "kinetree/kinetree.h"

#include <float.h>

#define ASKEW                                                                                                          \
    "<robot name='r'><link name='a'/><link name='b'><inertial><origin xyz='0.3 -0.2 0.5' rpy='0.2 0.1 -0.4'/>"         \
    "<mass value='2'/><inertia ixx='0.3' iyy='0.4' izz='0.5' ixy='0.02' ixz='0.01' iyz='-0.03'/></inertial></link>"    \
    "<joint name='j' type='%s'><parent link='a'/><child link='b'/><origin xyz='1 2 3' rpy='0.4 -0.7 1.1'/>"            \
    "<axis xyz='1 -2 0.5'/></joint></robot>"

typedef struct askew {
    kt_opened at;
    kt_pose joint; /* its frame, from the file */
    double q[7], mass[36], bias[6];
    kt_pose pose; /* of the link */
    int nv;
} askew;

/* Reads the robot with this joint; places and forces at q, from rest. */
static void open_askew(askew *r, const char *type, int nv) {
    memset(r, 0, sizeof *r);
    r->at = kt_test_open(test_robot_of(NULL, ASKEW, type), NULL);
    r->joint.position = kt_vec3_make(1.0, 2.0, 3.0);
    r->joint.rotation = kt_mat3_from_rpy(kt_vec3_make(0.4, -0.7, 1.1));
    r->nv = kt_model_nv(r->at.model);
    kt_need(kt_check_equal_int("degrees of freedom", r->nv, nv));
}

static void move_askew(askew *r) {
    const double zero[6] = {0.0};
    const kt_model *model = r->at.model;
    kt_data *data = r->at.data;
    kt_error error = {0};
    kt_need_fine("kinematics", kt_kinematics_update(model, data, r->q, zero, NULL, &error), &error);
    r->pose = kt_body_pose(model, data, kt_body_find(model, "b"));
    kt_need_fine("mass", kt_dynamics_mass(model, data, r->q, r->mass, &error), &error);
    kt_need_fine("bias", kt_dynamics_inverse(model, data, r->q, zero, zero, NULL, r->bias, &error), &error);
}

/* Each unit rate gives the link's origin the velocity V_i and the link the angular velocity W_i, in the world. The
 * centre of mass is at r from the origin. Then `M_ij = m (V_i + W_i x r) . (V_j + W_j x r) + W_i . I W_j`, and `h_i =
 * -m g . (V_i + W_i x r)`.
 */
static void check_askew(const askew *r, const kt_vec3 *linear, const kt_vec3 *angular) {
    const kt_mat3 turn = kt_mat3_multiply(r->pose.rotation, kt_mat3_from_rpy(kt_vec3_make(0.2, 0.1, -0.4)));
    const kt_sym3 inertia = kt_sym3_rotate(turn, kt_sym3_make(0.3, 0.4, 0.5, 0.02, 0.01, -0.03));
    const kt_vec3 lever = kt_mat3_apply(r->pose.rotation, kt_vec3_make(0.3, -0.2, 0.5));
    const kt_vec3 gravity = kt_vec3_make(0.0, 0.0, -9.81);
    KT_WORST mass = kt_worst_make("mass matrix"), bias = kt_worst_make("weight");
    for (int i = 0; i < r->nv; i++) {
        const kt_vec3 v = kt_vec3_add(linear[i], kt_vec3_cross(angular[i], lever));
        kt_worst_near(&bias, r->bias[i], -2.0 * kt_vec3_dot(gravity, v), 1e-13, "%d", i);
        for (int k = 0; k < r->nv; k++) {
            const kt_vec3 w = kt_vec3_add(linear[k], kt_vec3_cross(angular[k], lever));
            const double expected =
                2.0 * kt_vec3_dot(v, w) + kt_vec3_dot(angular[i], kt_sym3_apply(inertia, angular[k]));
            kt_worst_near(&mass, r->mass[i + r->nv * k], expected, 1e-14, "%d, %d", i, k);
        }
    }
}

KT_TEST(planar_joint_moves_in_the_plane_normal_to_its_axis_and_turns_about_it) {
    askew r;
    const double at[3] = {0.7, -0.4, 1.3};
    kt_vec3 linear[3], angular[3];
    open_askew(&r, "planar", 3);
    const kt_vec3 own = kt_vec3_normalize(kt_vec3_make(1.0, -2.0, 0.5));
    const kt_vec3 axis = kt_mat3_apply(r.joint.rotation, own), zero = kt_vec3_make(0.0, 0.0, 0.0);
    for (int k = 0; k < 2; k++) {
        memset(r.q, 0, sizeof r.q);
        r.q[k] = 1.0;
        move_askew(&r);
        linear[k] = kt_vec3_sub(r.pose.position, r.joint.position);
        angular[k] = zero;
        kt_check_near("normal to the axis", kt_vec3_dot(linear[k], axis), 0.0, 4.0 * DBL_EPSILON);
        kt_check_near("a metre is a metre", kt_vec3_norm(linear[k]), 1.0, 4.0 * DBL_EPSILON);
    }
    linear[2] = zero;
    angular[2] = axis;
    kt_check_near("right-handed", kt_vec3_dot(kt_vec3_cross(linear[0], linear[1]), axis), 1.0, 8.0 * DBL_EPSILON);
    memcpy(r.q, at, sizeof at);
    move_askew(&r);
    const kt_vec3 shift = kt_vec3_add(kt_vec3_scale(at[0], linear[0]), kt_vec3_scale(at[1], linear[1]));
    const kt_mat3 turn = kt_mat3_multiply(r.joint.rotation, kt_mat3_from_euler_vector(kt_vec3_scale(at[2], own)));
    const kt_vec3 off = kt_vec3_sub(r.pose.position, kt_vec3_add(r.joint.position, shift));
    kt_check_near("place", kt_vec3_norm(off), 0.0, 8.0 * DBL_EPSILON);
    kt_check_near("orientation", kt_vec3_norm(kt_vec3_sub(r.pose.rotation.x, turn.x)), 0.0, 8.0 * DBL_EPSILON);
    kt_check_near("orientation", kt_vec3_norm(kt_vec3_sub(r.pose.rotation.y, turn.y)), 0.0, 8.0 * DBL_EPSILON);
    check_askew(&r, linear, angular);
}

KT_TEST(floating_joint_moves_along_the_axes_of_its_frame_and_turns_in_the_link) {
    askew r;
    kt_vec3 linear[6], angular[6];
    const kt_quat turned = kt_quat_normalize(kt_quat_make(0.6, -0.3, 0.5, 0.2));
    const double at[7] = {0.7, -0.4, 1.3, turned.w, turned.x, turned.y, turned.z};
    open_askew(&r, "floating", 6);
    memcpy(r.q, at, sizeof at);
    move_askew(&r);
    const kt_pose moved = {.rotation = kt_mat3_from_quat(turned), .position = kt_vec3_make(0.7, -0.4, 1.3)};
    const kt_pose expected = kt_pose_compose(r.joint, moved);
    const kt_vec3 *frame = &r.joint.rotation.x, *link = &expected.rotation.x;
    for (int k = 0; k < 3; k++) {
        linear[k] = frame[k];
        angular[k] = linear[3 + k] = kt_vec3_make(0.0, 0.0, 0.0);
        angular[3 + k] = link[k];
    }
    kt_check_near("place", kt_vec3_norm(kt_vec3_sub(r.pose.position, expected.position)), 0.0, 8.0 * DBL_EPSILON);
    kt_check_near("orientation", kt_vec3_norm(kt_vec3_sub(r.pose.rotation.x, expected.rotation.x)), 0.0,
                  8.0 * DBL_EPSILON);
    check_askew(&r, linear, angular);
}
