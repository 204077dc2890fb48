/* Wheels of robots that roll, and rolling and torsional friction, against closed forms. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "folder.h"
#include "run_file.h"

#define ROBOT "r"
#include "robot.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>

static const double g = 9.81;

/* A free body of 1 kg with one geom on a floor, whose keyframe `k` starts it. */
static const kt_mechanism *run_geom(const char *geom, const char *start, double time) {
    static const kt_robot_options options = {.contacts = true, .keyframe = "k"};
    char text[2000];
    (void)snprintf(text, sizeof text,
                   "<mujoco><option gravity='0 0 -9.81' cone='elliptic' impratio='10'/><worldbody>"
                   "<geom type='plane' size='100 100 1'/><body name='w'><freejoint/>"
                   "<geom mass='1' %s/></body></worldbody><keyframe><key name='k' %s/></keyframe></mujoco>",
                   geom, start);
    return run_file(kt_test_file(kt_test_folder(), "wheel.xml", text), &options, NULL, time);
}

/* ---- rolling ----------------------------------------------------------------------------------------------------- */

/* A wheel that rolls on level ground keeps its speed. Nothing resists it, so that the bound is that of rounding. */
KT_TEST(wheels_that_roll_keep_their_speed) {
    static const struct {
        const char *geom;
        double radius;
    } wheels[] = {{"type='cylinder' size='.1 .03' quat='1 1 0 0'", 0.1},
                  {"type='cylinder' size='.4 .01' quat='1 1 0 0'", 0.4},
                  {"type='cylinder' size='.05 .5' euler='-90 0 0'", 0.05},
                  {"type='capsule' size='.1 .03' quat='1 1 0 0'", 0.1},
                  {"type='sphere' size='.1'", 0.1}};
    for (size_t i = 0; i < sizeof wheels / sizeof *wheels; i++) {
        char start[200];
        (void)snprintf(start, sizeof start, "qpos='0 0 %g 1 0 0 0' qvel='1 0 0 0 %.17g 0'", wheels[i].radius,
                       1.0 / wheels[i].radius);
        const kt_mechanism *m = run_geom(wheels[i].geom, start, 5.0);
        kt_check_near(wheels[i].geom, positions_of(m, "w")[0], 5.0, 1e-12);
        kt_check_near("it keeps its track", positions_of(m, "w")[1], 0.0, 1e-9);
    }
}

/* The wheel of a cart on a joint of URDF, too; a wheel without drive, pushed at 1 m/s. */
KT_TEST(wheels_of_urdf_roll) {
    static const char text[] =
        "<robot name='w'><link name='wheel'><inertial><origin rpy='1.5707963267948966 0 0'/><mass value='1'/>"
        "<inertia ixx='0.0028' iyy='0.0028' izz='0.005' ixy='0' ixz='0' iyz='0'/></inertial><collision>"
        "<origin rpy='1.5707963267948966 0 0'/><geometry><cylinder radius='0.1' length='0.06'/></geometry>"
        "</collision></link></robot>";
    static const kt_robot_options options = {.contacts = true, .has_ground = true, .floating = true, .ground = -0.1};
    kt_mechanism *m = (kt_mechanism *)run_file(kt_test_file(kt_test_folder(), "wheel.urdf", text), &options, NULL, 0.0);
    double v[6] = {1.0, 0.0, 0.0, 0.0, 10.0, 0.0};
    kt_error error = {0};
    kt_need_fine("start",
                 kt_simulation_set_state(m->simulation, 0.0, kt_simulation_positions(m->simulation), v, &error),
                 &error);
    kt_need_fine("run", kt_simulation_advance(m->simulation, 5.0, &error), &error);
    kt_check_near("way", positions_of(m, "wheel")[0], 5.0, 1e-12);
}

/* A cylinder that slides upright stops after v^2 / (2 mu g), and stands: all points of its lower rim carry it. */
KT_TEST(standing_cylinders_slide_and_stop) {
    const kt_mechanism *m =
        run_geom("type='cylinder' size='.2 .05' friction='0.3'", "qpos='0 0 .05 1 0 0 0' qvel='1 0 0 0 0 0'", 2.0);
    const double *q = positions_of(m, "w");
    kt_check_near("way", q[0], 0.5 / (1.0 * g), 2e-3); /* the floor's friction of 1 is the larger one */
    kt_check_near("upright", 2.0 * hypot(q[4], q[5]), 0.0, 1e-3);
}

/* A prism of 16 sides, about the axis y, or a cube: as a mesh of MJCF. */
static void write_prism(char *text, size_t size, int sides, const char *joint) {
    int n = snprintf(text, size, "<mujoco><asset><mesh name='m' vertex='");
    for (int i = 0; i < 2 * sides; i++) {
        const double turn = 2.0 * 3.14159265358979323846 * (i / 2) / sides;
        n += snprintf(text + n, size - (size_t)n, "%.9f %.9f %.9f ", 0.1 * cos(turn), i % 2 ? 0.03 : -0.03,
                      0.1 * sin(turn));
    }
    (void)snprintf(text + n, size - (size_t)n,
                   "'/></asset><worldbody><geom type='plane' size='9 9 1'/><body name='w' pos='0 0 .1'>%s"
                   "<geom type='mesh' mesh='m' mass='1'/></body></worldbody></mujoco>",
                   joint);
}

KT_TEST(meshes_of_wheels_are_a_warning) {
    static const struct {
        int sides;
        const char *joint;
        bool warns;
    } table[] = {{16, "<freejoint/>", true},
                 {16, "<joint type='hinge' axis='0 1 0'/>", true},
                 {16, "<joint type='hinge' axis='0 1 0' range='-90 90'/>", false},
                 {16, "<joint type='slide'/>", false},
                 {4, "<freejoint/>", false}};
    static const kt_robot_options options = {.contacts = true};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[4000];
        write_prism(text, sizeof text, table[i].sides, table[i].joint);
        const kt_scene *scene = test_robot(text, &options);
        kt_check_equal_int(table[i].joint, has_ranked_note(scene, KT_NOTE_RANK_MOTION, "meshes of wheels"),
                           table[i].warns);
    }
}

/* ---- friction of rolling and of spin ----------------------------------------------------------------------------- */

/* With rolling friction a N against the angular velocity v / R of a ball, 7/5 m v v' = -a N v / R: it stops after
 * 7 R v^2 / (10 a g). The speed over which friction builds up adds less than 1e-5 of the way. */
KT_TEST(balls_with_rolling_friction_stop) {
    static const double arms[] = {0.01, 0.02};
    for (size_t i = 0; i < 2; i++) {
        char geom[100];
        (void)snprintf(geom, sizeof geom, "type='sphere' size='.1' condim='6' friction='1 .005 %g'", arms[i]);
        const kt_mechanism *m = run_geom(geom, "qpos='0 0 .1 1 0 0 0' qvel='1 0 0 0 10 0'", 2.0);
        kt_check_near("way", positions_of(m, "w")[0], 0.07 / (arms[i] * g), 1e-3 * 0.07 / (arms[i] * g));
    }
    const kt_mechanism *m = run_geom("type='sphere' size='.1' condim='4' friction='1 .005 .01'",
                                     "qpos='0 0 .1 1 0 0 0' qvel='1 0 0 0 10 0'", 2.0);
    kt_check_near("without condim 6", positions_of(m, "w")[0], 2.0, 1e-12);
}

/* Torsional friction b N slows a spin by 5 b g / (2 R^2): until 20 rad/s are lost, and not at all below condim 4. */
KT_TEST(spins_end_by_torsional_friction) {
    static const char start[] = "qpos='0 0 .1 1 0 0 0' qvel='0 0 0 0 0 20'";
    static const char geom[] = "type='sphere' size='.1' condim='%d' friction='1 .01 0'";
    const double slows = 2.5 * 0.01 * g / 0.01;
    for (int condim = 3; condim <= 6; condim += condim < 4 ? 1 : 2) {
        char text[100];
        (void)snprintf(text, sizeof text, geom, condim);
        const double half = 10.0 / slows;
        const double *v = kt_simulation_velocities(run_geom(text, start, half)->simulation);
        kt_check_near("after half of the time", v[5], condim < 4 ? 20.0 : 10.0, 2e-3 * 20.0);
        v = kt_simulation_velocities(run_geom(text, start, 3.0 * half)->simulation);
        kt_check_near("after it", v[5], condim < 4 ? 20.0 : 0.0, 1e-6);
    }
}
