/* Relative coordinates of loops against the poses of the bodies at their ends, and the arc length of a curve. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanics/constraint/tangle.h"

#include "kinetree/dynamics.h"
#include "kinetree/loop.h"

#include <float.h>
#include <math.h>

/* The pose of an end, its frame turned to the loop's axis: z along it. */
static kt_pose pose_of(const tangle *g, int i, int k, int *body) {
    const kt_end *end = &g->loop[i].between[k];
    kt_pose pose = kt_pose_identity();
    kt_error e = {0};
    *body = end->body ? kt_body_find(g->tree.model, end->body) : 0;
    pose.position = end->at;
    (void)kt_fine("rotation", kt_rotation_evaluate(&end->rotation, &pose.rotation, &e), &e);
    return kt_pose_compose(kt_body_pose(g->tree.model, g->tree.data, *body), pose);
}

/* The second point is as far along the axis as in the world. The distance and the speed are the world's, and so is the
 * angle between both ends' axes. Rounding of some 20 m. */
KT_TEST(relative_coordinates_are_those_of_the_bodies) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    plan.types = 1U << KT_LOOP_REVOLUTE | 1U << KT_LOOP_CYLINDRICAL | 1U << KT_LOOP_INPLANE | 1U << KT_LOOP_COUPLING;
    KT_WORST along = kt_worst_make("along the axis"), far = kt_worst_make("distance"),
             speed = kt_worst_make("its rate"), turn = kt_worst_make("angular velocity");
    int relations = 0;
    for (int n = 0; n < 40; n++) {
        static tangle g;
        kt_error e = {0};
        tangle_grow(&g, &plan, &random);
        kt_need_fine("kinematics", kt_kinematics_update(g.tree.model, g.tree.data, g.q, g.v, NULL, &e), &e);
        for (int i = 0; i < g.loops; i++) {
            kt_loop_motion m = {.position = {7.0, 0.0, 0.0}};
            if (g.loop[i].type == KT_LOOP_COUPLING) {
                relations += !kt_loop_motion_evaluate(g.tree.model, g.tree.data, i, &m) && m.position.x == 7.0;
                continue;
            }
            kt_check_true("has ends", kt_loop_motion_evaluate(g.tree.model, g.tree.data, i, &m));
            int body[2];
            const kt_pose a = pose_of(&g, i, 0, &body[0]), b = pose_of(&g, i, 1, &body[1]);
            const kt_vec3 d = kt_vec3_sub(b.position, a.position);
            const kt_vec3 axis = kt_mat3_apply(a.rotation, kt_vec3_normalize(g.loop[i].axis));
            const kt_twist v1 = kt_body_twist(g.tree.model, g.tree.data, body[0]),
                           v2 = kt_body_twist(g.tree.model, g.tree.data, body[1]);
            const kt_vec3 p1 = kt_point_velocity(g.tree.model, g.tree.data, body[0], g.loop[i].between[0].at),
                          p2 = kt_point_velocity(g.tree.model, g.tree.data, body[1], g.loop[i].between[1].at);
            const kt_vec3 w = kt_vec3_sub(v2.angular, v1.angular);
            kt_worst_near(&along, m.position.z, kt_vec3_dot(d, axis), 256.0 * DBL_EPSILON, "%d, loop %d", n, i);
            kt_worst_near(&far, kt_vec3_norm(m.position), kt_vec3_norm(d), 256.0 * DBL_EPSILON, "%d, loop %d", n, i);
            kt_worst_near(&speed, kt_vec3_dot(m.position, m.velocity), kt_vec3_dot(d, kt_vec3_sub(p2, p1)),
                          2048.0 * DBL_EPSILON, "%d, loop %d", n, i);
            kt_worst_near(&turn, m.omega.z, kt_vec3_dot(w, axis), 512.0 * DBL_EPSILON, "%d, loop %d", n, i);
            kt_check_true("no curve", isnan(kt_loop_arc_length(g.tree.model, g.tree.data, i)));
        }
    }
    kt_check_true("relations have none", relations > 0);
}

/* A helix of radius `0.6` and `0.2 m` a radian, after 3.5 turns. */
KT_TEST(arc_length_counts_the_turns_of_a_helix) {
    const double angle = 7.0 * acos(-1.0), length = angle * hypot(0.6, 0.2);
    double q[7], v[6];
    kt_error e = {0};
    kt_body bead = kt_body_of("bead", NULL, KT_JOINT_FREE, 1.0);
    bead.inertia = (kt_sym3){1.0, 1.0, 1.0, 0.0, 0.0, 0.0};
    bead.joint.position[0] = 0.6 * cos(angle);
    bead.joint.position[1] = 0.6 * sin(angle);
    bead.joint.position[2] = 0.2 * angle;
    kt_loop wire = kt_loop_of("wire", KT_LOOP_CURVE);
    wire.between[1].body = "bead";
    wire.curve = (kt_track){.type = KT_TRACK_HELIX, .radius = 0.6, .pitch = 0.2};
    kt_description d = kt_description_of(&bead, 1, &wire, 1, NULL, 0);
    kt_model *model = kt_test_model(&d, NULL);
    kt_data *data = kt_test_data(model);
    kt_model_initial(model, q, v);
    kt_need_fine("kinematics", kt_kinematics_update(model, data, q, v, NULL, &e), &e);
    kt_check_near("arc length", kt_loop_arc_length(model, data, 0), length, 64.0 * DBL_EPSILON * length);
    kt_check_true("no such loop", isnan(kt_loop_arc_length(model, data, 1)));
}
