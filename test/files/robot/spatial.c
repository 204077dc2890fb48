/* Spatial tendons of MJCF: stops, and what of them is left out. test/files/robot/mujoco_wasm compares their forces. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m.xml"
#include "folder.h"
#include "robot.h"
#include "run_file.h"

#include "kinetree/export.h"
#include "kinetree/import.h"
#include "kinetree/kinetree.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MODEL(tendon)                                                                                                  \
    "<mujoco><worldbody><site name='h' pos='0 0 2'/><body name='a' pos='0 0 1.5'><joint name='a' type='slide' "        \
    "axis='0 0 1'/><geom size='.1' mass='3'/><site name='s'/></body></worldbody><tendon>" tendon "</tendon></mujoco>"
#define BALL_JOINT(tendon)                                                                                             \
    "<mujoco><worldbody><site name='h' pos='0 0 2'/><geom name='g' size='.1'/><body><joint name='b' "                  \
    "type='ball'/><geom "                                                                                              \
    "size='.1'/><site name='h2'/></body></worldbody><tendon>" tendon "</tendon></mujoco>"
#define SITES "<site site='h'/><site site='s'/>"

/* The positions of the mass after each of two times; it starts at 0, and the rope's length is then 0.5 m. */
static void run_text(const char *text, const kt_robot_options *options, const double times[2], double q[2]) {
    kt_error error = {0};
    const kt_mechanism *m = run_file(kt_test_file(kt_test_folder(), "m.xml", text), options, NULL, times[0]);
    q[0] = kt_simulation_positions(m->simulation)[0];
    kt_need_fine("run on", kt_simulation_advance(m->simulation, times[1], &error), &error);
    q[1] = kt_simulation_positions(m->simulation)[0];
}

/* A mass on a rope of 1 m falls freely by 0.5 m, which takes 0.32 s. It comes to rest where the stop holds its weight,
 * at 1 m + m g / k below the hook. */
KT_TEST(limited_tendons_are_ropes_with_stops) {
    const kt_robot_options options = {.stop_stiffness = 5e3, .stop_damping = 300.0};
    const double times[2] = {0.3, 10.0};
    double q[2];
    run_text(MODEL("<spatial limited='true' range='0 1'>" SITES "</spatial>"), &options, times, q);
    kt_check_near("while the rope is slack", q[0], -0.5 * 9.81 * 0.09, 1e-9);
    kt_check_near("at rest", q[1], -0.5 - 3.0 * 9.81 / 5e3, 1e-9);
    run_text(MODEL("<spatial limited='true' range='0 1'>" SITES "</spatial>"), NULL, times, q);
    kt_check_near("without stops", q[0], -0.5 * 9.81 * 0.09, 1e-9);
}

/* The spring between 0.6 m and 0.8 m has no force: it holds the mass at 0.8 m + m g / k below the hook. */
KT_TEST(springs_of_tendons_have_no_force_between_their_two_lengths) {
    const double times[2] = {0.2, 20.0};
    double q[2];
    run_text(MODEL("<spatial stiffness='400' damping='40' springlength='.4 .8'>" SITES "</spatial>"), NULL, times, q);
    kt_check_near("at rest", q[1], -0.3 - 3.0 * 9.81 / 400.0, 1e-6);
}

/* k x + k2 x^3 = m g with the stretch x. */
KT_TEST(springs_of_tendons_may_be_polynomials) {
    const double times[2] = {0.2, 20.0};
    double q[2];
    run_text(MODEL("<spatial stiffness='200 0 900' damping='40' springlength='.8'>" SITES "</spatial>"), NULL, times,
             q);
    const double x = -0.3 - q[1];
    kt_check_near("force at rest", 200.0 * x + 900.0 * x * x * x, 3.0 * 9.81, 1e-4);
}

/* A mass under a friction above its weight creeps with the speed v0 artanh(m g / f). */
KT_TEST(friction_of_tendons_holds_but_for_a_slow_creep) {
    const double times[2] = {1.0, 11.0}, creep = 1e-3 * atanh(3.0 * 9.81 / 50.0);
    double q[2];
    run_text(MODEL("<spatial frictionloss='50'>" SITES "</spatial>"), NULL, times, q);
    kt_check_near("creep in 10 s", q[1] - q[0], -10.0 * creep, 1e-6);
}

/* L = d + d / 2: at rest 3/2 k (3/2 d - 1.2 m) = m g. */
KT_TEST(pulleys_divide_the_lengths_of_their_branches) {
    const double times[2] = {0.2, 20.0}, k = 400.0;
    double q[2];
    run_text(MODEL("<spatial stiffness='400' damping='40' springlength='1.2'>" SITES "<pulley divisor='2'/>" SITES
                   "</spatial>"),
             NULL, times, q);
    kt_check_near("at rest", q[1], 0.5 - (1.2 + 3.0 * 9.81 / (1.5 * k)) / 1.5, 1e-6);
}

KT_TEST(what_tendons_lose_is_told) {
    static const struct {
        const char *text, *note;
    } table[] = {
        {MODEL("<spatial>" SITES "<geom geom='g'/></spatial>"),
         "spatial tendon around a geom that is no sphere or cylinder, or without two sites in a branch: 1"},
        {MODEL("<spatial><site site='h'/><pulley divisor='2'/><site site='s'/></spatial>"), "two sites in a branch: 1"},
        {MODEL("<spatial>" SITES "<pulley/>" SITES "</spatial>"), "two sites in a branch: 1"},
        {MODEL("<spatial><site site='h'/></spatial>"), "two sites in a branch: 1"},
        {MODEL("<spatial frictionloss='1'>" SITES "</spatial>"), "dry friction that is smooth"},
        {BALL_JOINT("<spatial armature='1'><site site='h'/><geom geom='g'/><site site='h2'/></spatial>"),
         "armatures of spatial tendons that are left out: MuJoCo rejects paths around geoms, and the others have too "
         "many parts or a part without a length: 1"},
        {BALL_JOINT("<fixed name='t'><joint joint='b' coef='1'/></fixed>"), "fixed tendon by a ball or free joint: 1"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, NULL);
        kt_check_true(table[i].note, has_ranked_note(scene, KT_NOTE_RANK_MOTION, table[i].note));
    }
}

/* ---- armature ---------------------------------------------------------------------------------------------------- */

enum { ARM_NQ = 6, ARM_NV = 5, ARM_PARTS = 3 };

#define ARM                                                                                                            \
    "<mujoco><worldbody><site name='w' pos='.3 .1 .2'/><body name='a' pos='0 0 1'><joint name='a' axis='0 1 .2'/>"     \
    "<geom size='.1' pos='.3 0 0' mass='2'/><site name='a' pos='.2 .1 0'/><body name='b' pos='.5 0 0'><joint "         \
    "name='b' type='ball'/><geom type='box' size='.1 .2 .05' pos='.1 0 .1'/><site name='b' pos='.1 .2 .1'/><body "     \
    "name='c' pos='.3 0 0'><joint name='c' type='slide' axis='1 .3 0'/><geom size='.05' mass='1'/><site name='c' "     \
    "pos='0 .1 .1'/></body></body></body></worldbody><tendon>%s</tendon><keyframe><key name='k' qpos='%.17g %.17g "    \
    "%.17g %.17g %.17g %.17g' qvel='%.17g 0 %.17g %.17g %.17g'/></keyframe></mujoco>"

static const char arm_tendon[] =
    "<spatial armature='1.3'><site site='w'/><site site='a'/><site site='c'/><pulley divisor='2'/><site site='w'/>"
    "<site site='b'/></spatial><fixed armature='.7'><joint joint='a' coef='1'/><joint joint='c' coef='-.4'/></fixed>";

/* The parts of the spatial tendon. */
static const struct {
    const char *from, *to;
    kt_vec3 at[2];
    double divisor;
} arm_parts[ARM_PARTS] = {{NULL, "a", {{.3, .1, .2}, {.2, .1, 0.0}}, 1.0},
                          {"a", "c", {{.2, .1, 0.0}, {0.0, .1, .1}}, 1.0},
                          {NULL, "b", {{.3, .1, .2}, {.1, .2, .1}}, 2.0}};

typedef struct arm {
    kt_opened at;
    double q[64], v[64];
} arm;

/* Reads the arm and closes its loops at the start of the keyframe. */
static arm open_scene_of_arm(kt_scene *scene) {
    arm a = {.at = kt_test_open(scene, NULL)};
    kt_error error = {0};
    (void)kt_model_initial(a.at.model, a.q, a.v);
    kt_need_fine("assembled", kt_state_assemble(a.at.model, a.at.data, 0.0, a.q, a.v, &error), &error);
    return a;
}

static arm open_arm(const char *tendon, const double q[ARM_NQ], const double v[ARM_NV]) {
    const kt_robot_options options = {.keyframe = "k"};
    return open_scene_of_arm(
        test_robot_of(&options, ARM, tendon, q[0], q[1], q[2], q[3], q[4], q[5], v[0], v[2], v[3], v[4]));
}

/* Adds armature (J a + dJ/dt v) J' of a straight part to the forces, where J a + dJ/dt v is the acceleration of its
 * length. The kinematics are those of the acceleration a. */
static double part_of_arm(const arm *t, int part, double gradient[ARM_NV]) {
    kt_vec3 x[2], u[2], w[2];
    double jacobian[2][6 * ARM_NV];
    for (int k = 0; k < 2; k++) {
        const char *name = k == 0 ? arm_parts[part].from : arm_parts[part].to;
        const int body = name != NULL ? kt_body_find(t->at.model, name) : 0;
        const kt_vec3 at = arm_parts[part].at[k];
        x[k] = kt_point_position(t->at.model, t->at.data, body, at);
        u[k] = kt_point_velocity(t->at.model, t->at.data, body, at);
        w[k] = kt_point_acceleration(t->at.model, t->at.data, body, at);
        kt_point_jacobian(t->at.model, t->at.data, body, at, jacobian[k]);
    }
    const kt_vec3 d = kt_vec3_sub(x[1], x[0]), rate = kt_vec3_sub(u[1], u[0]), n = kt_vec3_normalize(d);
    const kt_vec3 across = kt_vec3_cross(n, rate);
    for (int j = 0; j < ARM_NV; j++) {
        const double *c = jacobian[1] + 6 * (size_t)j, *b = jacobian[0] + 6 * (size_t)j;
        gradient[j] += kt_vec3_dot(n, kt_vec3_make(c[3] - b[3], c[4] - b[4], c[5] - b[5])) / arm_parts[part].divisor;
    }
    return (kt_vec3_dot(n, kt_vec3_sub(w[1], w[0])) + kt_vec3_dot(across, across) / kt_vec3_norm(d)) /
           arm_parts[part].divisor;
}

/* The forces that the accelerations of the arm need: those of the tree, and of both armatures. */
static bool forces_of_arm(const arm *tree, const double a[ARM_NV], double f[ARM_NV]) {
    kt_error error = {0};
    double gradient[ARM_NV] = {0.0}, rate = 0.0;
    if (kt_dynamics_inverse(tree->at.model, tree->at.data, tree->q, tree->v, a, NULL, f, &error) != KT_OK ||
        kt_kinematics_update(tree->at.model, tree->at.data, tree->q, tree->v, a, &error) != KT_OK)
        return kt_check_text("the tree", error.message, "");
    for (int part = 0; part < ARM_PARTS; part++)
        rate += part_of_arm(tree, part, gradient);
    for (int j = 0; j < ARM_NV; j++)
        f[j] += 1.3 * rate * gradient[j];
    const double sum = 0.7 * (a[0] - 0.4 * a[4]);
    f[0] += sum;
    f[4] += -0.4 * sum;
    return true;
}

/* Forces of random size on the arm, the accelerations that it then has, and the forces that these need. */
KT_TEST(armatures_of_tendons_are_inertias_along_their_lengths) {
    kt_random random = kt_random_of_test();
    KT_WORST force = kt_worst_make("force"), kept = kt_worst_make("start");
    for (int n = 0; n < 20; n++) {
        double q[ARM_NQ], v[ARM_NV], tau[64] = {0.0}, a[64], f[ARM_NV];
        kt_error error = {0};
        for (int i = 0; i < ARM_NQ; i++)
            q[i] = i == 0 && n % 4 == 0 ? 0.0 : kt_random_uniform(&random, -1.0, 1.0);
        const double size = sqrt(q[1] * q[1] + q[2] * q[2] + q[3] * q[3] + q[4] * q[4]);
        for (int i = 1; i < 5; i++)
            q[i] /= size;
        for (int i = 0; i < ARM_NV; i++)
            v[i] = i == 1 || (i == 4 && n % 3 == 0) ? 0.0 : kt_random_uniform(&random, -2.0, 2.0);
        const arm arms[2] = {open_arm(arm_tendon, q, v), open_arm("", q, v)};
        for (int i = 0; i < ARM_NV; i++)
            tau[i] = kt_random_uniform(&random, -20.0, 20.0);
        kt_need_fine("acceleration",
                     kt_acceleration_evaluate(arms[0].at.model, arms[0].at.data, 0.0, arms[0].q, arms[0].v, tau, NULL,
                                              a, &error),
                     &error);
        if (forces_of_arm(&arms[1], a, f))
            for (int i = 0; i < ARM_NV; i++) {
                kt_worst_near(&force, f[i], tau[i], 1e-12, "%d, %d", n, i);
                kt_worst_near(&kept, arms[0].q[i], arms[1].q[i], 0.0, "position %d, %d", n, i);
                kt_worst_near(&kept, arms[0].v[i], arms[1].v[i], 0.0, "velocity %d, %d", n, i);
            }
    }
}

static void add_lost(void *user, const char *what, int count) {
    kt_note("%s %d", what, count);
    *(int *)user += count;
}

/* Writes the arm and reads it back. */
static arm give_arm_back(const arm *from, int *lost) {
    const kt_robot_options options = {.keyframe = "start"};
    const char *path = kt_test_path(kt_test_folder(), "m.xml");
    kt_error error = {0};
    FILE *to = fopen(path, "w");
    kt_need(kt_check_true("a file", to != NULL));
    kt_need_fine("written", kt_robot_write_scene(from->at.scene, KT_ROBOT_MJCF, NULL, to, add_lost, lost, &error),
                 &error);
    (void)fclose(to);
    return open_scene_of_arm(test_robot_file(path, &options));
}

/* A path with parts within bodies alone has a constant length, and no inertia. */
KT_TEST(armatures_of_constant_lengths_add_nothing) {
    static const char text[] =
        "<mujoco><worldbody><body><joint name='a'/><geom size='.1' pos='.2 0 0'/><site name='a1'/><site name='a2' "
        "pos='.1 0 "
        "0'/><body pos='.3 0 0'><joint name='b'/><geom size='.1' pos='.2 0 0'/><site name='b1'/><site name='b2' "
        "pos='.1 0 "
        "0'/></body></body></worldbody><tendon><spatial armature='.1'><site site='a1'/><site site='a2'/><pulley "
        "divisor='1'/><site site='b1'/><site site='b2'/></spatial></tendon></mujoco>";
    kt_scene *scene = kt_test_scene_place();
    kt_error error = {0};
    if (!kt_check_equal_int("read", kt_robot_parse("m", text, strlen(text), NULL, scene, NULL, NULL, &error), KT_OK)) {
        kt_note("%s", error.message);
        return;
    }
    kt_check_equal_int("loops", scene->description.loop_count, 0);
    kt_check_equal_int("bodies", scene->description.body_count, 2);
}

/* Accelerations of the arm and of its export at the same start. */
KT_TEST(armatures_of_tendons_come_back) {
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("acceleration");
    for (int n = 0; n < 5; n++) {
        double q[ARM_NQ] = {0.3, 0.5, -0.5, 0.5, 0.5, 0.1}, v[ARM_NV], a[2][64];
        kt_error error = {0};
        int lost = 0;
        for (int i = 0; i < ARM_NV; i++)
            v[i] = i == 1 ? 0.0 : kt_random_uniform(&random, -2.0, 2.0);
        const arm here = open_arm(arm_tendon, q, v), back = give_arm_back(&here, &lost);
        kt_check_equal_int("lost", lost, 0);
        kt_check_equal_int("loops", back.at.scene->description.loop_count, here.at.scene->description.loop_count);
        const arm *const arms[] = {&here, &back};
        for (int k = 0; k < 2; k++)
            kt_need_fine("acceleration",
                         kt_acceleration_evaluate(arms[k]->at.model, arms[k]->at.data, 0.0, arms[k]->q, arms[k]->v,
                                                  NULL, NULL, a[k], &error),
                         &error);
        for (int i = 0; i < ARM_NV; i++)
            kt_worst_near(&worst, a[1][i], a[0][i], 1e-12 * (1.0 + fabs(a[0][i])), "%d, %d", n, i);
    }
}

static void count_lost(void *user, const char *what, int count) {
    if (strcmp(what, "forces by formulas (actuators and springs by numbers have a place)") == 0)
        *(int *)user += count;
}

/* A formula is lost, and the numbers of a spring or an actuator are kept. */
KT_TEST(formulas_along_paths_are_counted_as_lost) {
    static const struct {
        const char *force;
        int lost;
    } cases[] = {{"force: \"3 - 2*length\"", 1},
                 {"force: \"-length^2\"", 1},
                 {"spring: {stiffness: 2, rest: 1.5}", 0},
                 {"actuators: [{bias: [0, 2, 0]}]", 0}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const kt_scene *scene = kt_test_scene_of(
            "kinetree: 1\nbodies: [{name: a, joint: {type: prismatic, axis: x}, mass: 1}]\neffects:\n"
            "  - {type: expression, path: [{body: world, at: [1, 1, 0]}, {body: world, radius: 0.1}, a], %s}\n",
            cases[i].force);
        kt_error error = {0};
        int lost = 0;
        FILE *to = tmpfile();
        kt_need(kt_check_true("a file", to != NULL));
        kt_check_equal_int("written", kt_robot_write_scene(scene, KT_ROBOT_MJCF, NULL, to, count_lost, &lost, &error),
                           KT_OK);
        kt_check_equal_int(cases[i].force, lost, cases[i].lost);
        (void)fclose(to);
    }
}
