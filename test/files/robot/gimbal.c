/* Robots whose root turns on three hinges: they pass next to gimbal lock as a free body does, and in gimbal lock the
 * message names the remedy. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "folder.h"
#include "run_file.h"

#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>

#define HINGES                                                                                                         \
    "<joint name='list' type='hinge' axis='1 0 0'/><joint name='tilt' type='hinge' axis='0 1 0'/>"                     \
    "<joint name='rot' type='hinge' axis='0 0 1'/>"
#define ROBOT_OF(joints, start)                                                                                        \
    "<mujoco><option gravity='0 0 0'/><worldbody><body name='t'>" joints                                               \
    "<geom type='box' size='.2 .1 .05' mass='5'/>"                                                                     \
    "</body></worldbody><keyframe><key name='k' " start "/></keyframe></mujoco>"

static const kt_robot_options options = {.keyframe = "k"};

/* The axes of the body after a time. */
static kt_mat3 axes_after(const char *text, double time) {
    const kt_mechanism *m = run_file(kt_test_file(kt_test_folder(), "gimbal.xml", text), &options, NULL, time);
    kt_error error;
    kt_need_fine("places",
                 kt_kinematics_update(m->model, m->data, kt_simulation_positions(m->simulation),
                                      kt_simulation_velocities(m->simulation), NULL, &error),
                 &error);
    return kt_body_pose(m->model, m->data, kt_body_find(m->model, "t")).rotation;
}

/* A body without forces has one motion, on hinges and on a ball. The first hinge is about x, so that the angular
 * velocity at the start is that of qvel. Within 0.002 rad of gimbal lock, hinges turn a thousand times as fast. */
KT_TEST(hinges_pass_next_to_gimbal_lock_as_a_ball_does) {
    const kt_mat3 on_hinges = axes_after(ROBOT_OF(HINGES, "qpos='0 0 0' qvel='.004 -2 .001'"), 2.0);
    const kt_mat3 on_ball = axes_after(ROBOT_OF("<joint type='ball'/>", "qpos='1 0 0 0' qvel='.004 -2 .001'"), 2.0);
    kt_check_near("x of the axes", kt_vec3_norm(kt_vec3_sub(on_hinges.x, on_ball.x)), 0.0, 1e-6);
    kt_check_near("y of the axes", kt_vec3_norm(kt_vec3_sub(on_hinges.y, on_ball.y)), 0.0, 1e-6);
}

KT_TEST(gimbal_lock_names_the_remedy) {
    static const char text[] = ROBOT_OF(HINGES, "qpos='0 1.5707963267948966 0' qvel='.5 0 .1'");
    kt_mechanism m;
    kt_error error = {0};
    kt_need_fine("load",
                 kt_mechanism_load(kt_test_file(kt_test_folder(), "locked.xml", text), &options, NULL, &m, &error),
                 &error);
    kt_check_equal_int("status", kt_simulation_advance(m.simulation, 1.0, &error), KT_ERROR_SINGULAR);
    kt_check_contains("hinges", error.message, "'list', 'tilt' and 'rot' are next to gimbal lock");
    kt_check_contains("remedy", error.message, "one joint in their place: spherical, or free");
    kt_mechanism_free(&m);
}

/* With legs, the trunk does not turn as a ball does, and steps become shorter without end. The remedy comes first,
 * because a message has an end. */
KT_TEST(steps_that_fail_next_to_gimbal_lock_name_the_remedy) {
#define LEG(name, place)                                                                                               \
    "<body name='" name "' pos='" place " -.05'><joint name='hip-" name "' axis='0 1 0' damping='.1'/>"                \
    "<geom type='capsule' size='.02' fromto='0 0 0 0 0 -.2' mass='.3'/></body>"
    static const char text[] =
        "<mujoco><option gravity='0 0 0'/><worldbody><body name='t'>"
        "<joint name='the-first-hinge-of-the-trunk' type='hinge' axis='1 0 0'/>"
        "<joint name='the-second-hinge-of-the-trunk' type='hinge' axis='0 1 0'/>"
        "<joint name='the-third-hinge-of-the-trunk' type='hinge' axis='0 0 1'/>"
        "<geom type='box' size='.2 .1 .05' mass='5'/>" LEG("a", ".2 .1") LEG("b", "-.2 .1") LEG("c", ".2 -.1")
            LEG("d", "-.2 -.1") "</body></worldbody><keyframe><key name='k' qpos='0 0 0 0 0 0 0' "
                                "qvel='0 -2 1e-12 0 0 0 0'/></keyframe></mujoco>";
#undef LEG
    kt_mechanism m;
    kt_error error = {0};
    kt_need_fine("load", kt_mechanism_load(kt_test_file(kt_test_folder(), "leg.xml", text), &options, NULL, &m, &error),
                 &error);
    kt_check_equal_int("status", kt_simulation_advance(m.simulation, 2.0, &error), KT_ERROR_STEP);
    kt_check_contains("remedy", error.message, "one joint in their place: spherical, or free if it moves freely");
    kt_mechanism_free(&m);
}
