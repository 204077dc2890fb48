/* Chapter 2 and appendix A: rotations and their representations. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "notes.h"

#include <math.h>

static double determinant(kt_mat3 a) { return kt_vec3_dot(a.x, kt_vec3_cross(a.y, a.z)); }

static kt_mat3 of_vector(kt_vec3 theta) { return kt_mat3_from_quat(kt_quat_from_euler_vector(theta)); }

static void chapter_2(void) {
    const kt_mat3 R = any_rotation(),
                  J = {kt_vec3_make(2.0, 0.3, 0.1), kt_vec3_make(0.3, 3.0, 0.2), kt_vec3_make(0.1, 0.2, 4.0)};
    const kt_vec3 a = any_vector(), b = any_vector(), w = any_vector();
    tell("2.1", fabs(fabs(determinant(R)) - 1.0));
    /* (a x)' = -(a x), a x a = 0, (R a) x = R (a x) R' */
    const kt_mat3 turned = kt_mat3_multiply(kt_mat3_multiply(R, kt_mat3_skew(a)), kt_mat3_transpose(R));
    tell("2.2", difference(kt_mat3_skew(kt_mat3_apply(R, a)), turned));
    /* R J R' b = R (J (R' b)), and its rate w x (R J R') - (R J R') w x */
    const kt_mat3 world = kt_mat3_multiply(kt_mat3_multiply(R, J), kt_mat3_transpose(R));
    tell("2.3", size_of(kt_vec3_sub(kt_mat3_apply(world, b),
                                    kt_mat3_apply(R, kt_mat3_apply(J, kt_mat3_apply_transposed(R, b))))));
    const double h = 1e-6;
    const kt_mat3 ahead = kt_mat3_multiply(of_vector(kt_vec3_scale(h, w)), R),
                  behind = kt_mat3_multiply(of_vector(kt_vec3_scale(-h, w)), R);
    const kt_mat3 J_ahead = kt_mat3_multiply(kt_mat3_multiply(ahead, J), kt_mat3_transpose(ahead)),
                  J_behind = kt_mat3_multiply(kt_mat3_multiply(behind, J), kt_mat3_transpose(behind));
    const kt_mat3 rate = kt_mat3_add(kt_mat3_multiply(kt_mat3_skew(w), world),
                                     kt_mat3_scale(-1.0, kt_mat3_multiply(world, kt_mat3_skew(w))));
    tell("2.4", difference(kt_mat3_scale(0.5 / h, kt_mat3_add(J_ahead, kt_mat3_scale(-1.0, J_behind))), rate));
    /* delta (R b) = theta_delta x R b */
    const kt_vec3 moved = kt_vec3_scale(0.5 / h, kt_vec3_sub(kt_mat3_apply(ahead, b), kt_mat3_apply(behind, b)));
    tell("2.5", size_of(kt_vec3_sub(moved, kt_vec3_cross(w, kt_mat3_apply(R, b)))));
}

/* Compares the velocity of a point of a body in a tree with the difference of its positions. */
static bool velocity_of_point(void) {
    mechanism m;
    kt_error e = {0};
    kt_vec3 place[2];
    double q[32];
    if (!open_mechanism(
            &m, "kinetree: 1\nbodies:\n  - {name: b, joint: {type: free, velocity: {linear: [1, 2, 3], angular: "
                "[0.3, -0.4, 0.5]}}, mass: 1, inertia: [1, 1, 1]}\n"))
        return false;
    const kt_vec3 at = kt_vec3_make(0.2, 0.5, -0.7);
    const double h = 1e-6;
    for (int i = 0; i < 2; i++) {
        double step[6];
        for (int k = 0; k < 6; k++)
            step[k] = (i ? h : -h) * m.v[k];
        kt_position_add(m.model, m.q, step, q);
        if (!works(kt_kinematics_update(m.model, m.data, q, m.v, NULL, &e), &e))
            return false;
        place[i] = kt_pose_apply(kt_body_pose(m.model, m.data, 1), at);
    }
    if (!works(kt_kinematics_update(m.model, m.data, m.q, m.v, NULL, &e), &e))
        return false;
    const kt_pose pose = kt_body_pose(m.model, m.data, 1);
    const kt_vec3 w = kt_vec3_make(0.3, -0.4, 0.5), v = kt_vec3_make(1.0, 2.0, 3.0);
    const kt_mat3 R = pose.rotation;
    const kt_vec3 rigid = kt_vec3_add(v, kt_vec3_cross(kt_mat3_apply(R, w), kt_mat3_apply(R, at)));
    tell("2.6", size_of(kt_vec3_sub(kt_vec3_scale(0.5 / h, kt_vec3_sub(place[1], place[0])), rigid)));
    close_mechanism(&m);
    return true;
}

/* G of the Euler vector: w = G theta'. The perturbation of an increment is likewise theta_delta = G delta theta. */
static bool increments(void) {
    const kt_vec3 theta = any_vector(), rate = any_vector();
    const kt_mat3 reference = any_rotation();
    const double h = 1e-6;
    const kt_mat3 ahead = of_vector(kt_vec3_add(theta, kt_vec3_scale(h, rate))),
                  behind = of_vector(kt_vec3_sub(theta, kt_vec3_scale(h, rate)));
    const kt_vec3 w = kt_vec3_scale(
        0.5 / h, kt_euler_vector_from_quat(kt_quat_from_mat3(kt_mat3_multiply(ahead, kt_mat3_transpose(behind)))));
    const kt_vec3 by_map = kt_mat3_apply(kt_euler_vector_map(theta), rate);
    tell("2.7", size_of(kt_vec3_sub(w, by_map)));
    /* With a reference R_0 that does not move, R = R(theta) R_0 turns at the same w. */
    const kt_vec3 turned = kt_vec3_scale(
        0.5 / h, kt_euler_vector_from_quat(kt_quat_from_mat3(kt_mat3_multiply(
                     kt_mat3_multiply(ahead, reference), kt_mat3_transpose(kt_mat3_multiply(behind, reference))))));
    tell("2.9", size_of(kt_vec3_sub(turned, by_map)));
    kt_mat3 inverse;
    kt_error e = {0};
    if (!works(kt_euler_vector_map_inverse(theta, &inverse, &e), &e))
        return false;
    tell("2.8", size_of(kt_vec3_sub(kt_mat3_apply(inverse, w), rate)));
    tell("2.10", difference(kt_mat3_multiply(inverse, kt_euler_vector_map(theta)), kt_mat3_identity()));
    return true;
}

static bool euler_angles(void) {
    const kt_vec3 angles = kt_vec3_make(0.4, 0.7, -1.1);
    kt_vec3 found;
    kt_mat3 R;
    bool singular;
    kt_error e = {0};
    const kt_rotation description = kt_rotation_euler(313, angles.x, angles.y, angles.z);
    if (!works(kt_rotation_evaluate(&description, &R, &e), &e) ||
        !works(kt_euler_from_mat3(313, R, &found, &singular, &e), &e))
        return false;
    tell("A.1", size_of(kt_vec3_sub(found, angles)));
    return true;
}

/* The order, in |theta|, of the error of the series of R. It has the terms I + theta x, and for terms = 2 also theta x
 * theta x / 2. */
static double order_of(int terms) {
    double off[2];
    const kt_vec3 n = kt_vec3_normalize(kt_vec3_make(1.0, 2.0, -1.0));
    for (int i = 0; i < 2; i++) {
        const kt_vec3 theta = kt_vec3_scale(i ? 0.005 : 0.01, n);
        const kt_mat3 S = kt_mat3_skew(theta);
        kt_mat3 sum = kt_mat3_add(kt_mat3_identity(), S);
        if (terms == 2)
            sum = kt_mat3_add(sum, kt_mat3_scale(0.5, kt_mat3_multiply(S, S)));
        off[i] = difference(of_vector(theta), sum);
    }
    return log2(off[0] / off[1]);
}

static void appendix(void) {
    const kt_vec3 theta = any_vector(), b = any_vector(), w = any_vector();
    const kt_mat3 R = of_vector(theta);
    const kt_quat p = kt_quat_from_euler_vector(theta), q = kt_quat_from_euler_vector(any_vector());
    /* R theta = theta: the axis does not move */
    tell("A.2", size_of(kt_vec3_sub(kt_mat3_apply(R, theta), theta)));
    tell("A.3", difference(kt_mat3_multiply(R, kt_mat3_transpose(R)), kt_mat3_identity()));
    /* exp(theta x) by its series against the quaternion */
    kt_mat3 sum = kt_mat3_identity(), term = kt_mat3_identity();
    for (int k = 1; k < 30; k++) {
        term = kt_mat3_scale(1.0 / k, kt_mat3_multiply(term, kt_mat3_skew(theta)));
        sum = kt_mat3_add(sum, term);
    }
    tell("A.4", difference(sum, R));
    const kt_vec3 little = kt_vec3_scale(1e-9, b);
    tell("A.5", difference(of_vector(little), kt_mat3_add(kt_mat3_identity(), kt_mat3_skew(little))));
    tell("A.6", order_of(1));
    tell("A.7", order_of(2));
    tell("A.8", difference(kt_mat3_from_quat(kt_quat_multiply(p, q)),
                           kt_mat3_multiply(kt_mat3_from_quat(p), kt_mat3_from_quat(q))));
    const kt_quat rate = kt_quat_rate_world(p, w);
    tell("A.9", fabs(p.w * rate.w + p.x * rate.x + p.y * rate.y + p.z * rate.z)); /* p . p' = 0 */
    tell("A.10", size_of(kt_vec3_sub(kt_quat_angular_world(p, rate), w)));
    tell("A.11", size_of(kt_vec3_sub(kt_quat_angular_body(p, rate), kt_mat3_apply_transposed(R, w))));
}

bool rotations(void) {
    chapter_2();
    const bool done = velocity_of_point() && increments() && euler_angles();
    appendix();
    return done;
}
