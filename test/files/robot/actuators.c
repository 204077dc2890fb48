/* Actuators by numbers as actuators of MJCF: models with activations and tendons are written and read back, and written
 * as scene files. At random states the forces and the rates of activations are the same, and so are the numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "write_back.h"

#define ROBOT "m.xml"
#include "robot.h"

#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

enum { TRIALS = 20, COORDINATES_MOST = 20 };

typedef kt_opened machine;

/* Forces and rates of auxiliary states. */
static bool evaluate(const machine *m, double t, const double *q, const double *v, const double *x, double *force,
                     double *rate) {
    kt_error error = {0};
    memcpy(kt_auxiliary_states(m->model, m->data), x, (size_t)kt_auxiliary_state_count(m->model) * sizeof *x);
    return kt_effect_forces(m->model, m->data, t, q, v, force, &error) == KT_OK &&
           kt_auxiliary_state_rates(m->model, m->data, t, q, v, rate, &error) == KT_OK;
}

static void compare_numbers(kt_worst *worst, int count, const double *a, const double *b) {
    double most = 0.0;
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(a[i]));
    for (int i = 0; i < count; i++)
        kt_worst_near(worst, b[i], a[i], 1e-12 * fmax(most, 1.0), "%d", i);
}

/* The state of `a` that has the name of a state of `b`. If none has, several actuators have become one effect, and
 * the order is the same. */
static int find_state(const machine *a, const machine *b, int i) {
    const int found = kt_auxiliary_state_find(a->model, kt_auxiliary_state_name(b->model, i));
    return found >= 0 ? found : i;
}

/* Both have the same coordinates in the same order. */
static void compare_machines(const machine *a, const machine *b, kt_random *random) {
    KT_WORST forces = kt_worst_make("forces"), rates = kt_worst_make("rates of activations");
    double q[COORDINATES_MOST], v[COORDINATES_MOST], x[2][COORDINATES_MOST], force[2][COORDINATES_MOST],
        rate[2][COORDINATES_MOST];
    const int nq = kt_model_nq(a->model), count = kt_auxiliary_state_count(a->model);
    if (!kt_check_equal_int("coordinates", kt_model_nq(b->model), nq) ||
        !kt_check_equal_int("activations", kt_auxiliary_state_count(b->model), count))
        return;
    for (int i = 0; i < count; i++)
        kt_worst_near(&rates, kt_auxiliary_states(b->model, b->data)[i],
                      kt_auxiliary_states(a->model, a->data)[find_state(a, b, i)], 1e-15, "initial %d", i);
    for (int n = 0; n < TRIALS; n++) {
        for (int i = 0; i < nq; i++) {
            q[i] = kt_random_uniform(random, -1.0, 1.0);
            v[i] = kt_random_uniform(random, -2.0, 2.0);
        }
        for (int i = 0; i < count; i++)
            x[0][i] = kt_random_uniform(random, -1.0, 2.0);
        for (int i = 0; i < count; i++)
            x[1][i] = x[0][find_state(a, b, i)];
        const double t = n % 3 == 0 ? 0.0 : kt_random_uniform(random, 0.0, 1.0);
        kt_need(kt_check_true("forces", evaluate(a, t, q, v, x[0], force[0], rate[0]) &&
                                            evaluate(b, t, q, v, x[1], force[1], rate[1])));
        compare_numbers(&forces, kt_model_nv(a->model), force[0], force[1]);
        for (int i = 0; i < count; i++)
            x[0][i] = rate[0][find_state(a, b, i)];
        compare_numbers(&rates, count, x[0], rate[1]);
    }
}

/* Writes a model and reads it back. `lost` is all that the writer reports. */
static void check_actuators(const char *text, const char *lost) {
    const kt_robot_options start = {.keyframe = "start"};
    kt_random random = kt_random_of_test();
    told t;
    const machine here = kt_test_open(test_robot(text, &(kt_robot_options){.keyframe = "k"}), NULL);
    const kt_scene *written = come_back(&here.scene->description, KT_ROBOT_MJCF, &start, &t);
    kt_check_text("lost", t.text, lost);
    const machine back = kt_test_open((kt_scene *)written, NULL);
    kt_need(kt_check_below("coordinates", kt_model_nq(here.model), COORDINATES_MOST));
    compare_machines(&here, &back, &random);
}

#define LINKS                                                                                                          \
    "<body name='a'><joint name='a' axis='0 1 0'/><geom size='.1' pos='.2 0 0'/><site name='s' pos='.1 0 .1'/>"        \
    "<body name='b' pos='.5 0 0'><joint name='b' axis='0 .2 1'/><geom size='.1' pos='.3 0 0'/><geom name='g' "         \
    "type='cylinder' size='.03 .1' contype='0' conaffinity='0' mass='0'/><site name='t' pos='.3 .1 .2'/>"              \
    "<body name='c' pos='.5 0 0'><joint name='c' type='slide'/><geom size='.1'/><site name='u' pos='0 .1 0'/></body>"  \
    "</body></body>"
#define MODEL(rest) "<mujoco><compiler angle='radian'/><worldbody>" LINKS "</worldbody>" rest "</mujoco>"

KT_TEST(filters_and_integrators_of_joints_come_back) {
    check_actuators(
        MODEL("<actuator><general name='f' joint='a' gear='2' dyntype='filterexact' dynprm='.4' gainprm='3' "
              "biastype='affine' biasprm='.1 -4 -.2'/><intvelocity name='i' joint='b' kp='7' kv='.3'/>"
              "<cylinder name='z' joint='c' timeconst='.2' diameter='2' bias='1 -3 0'/>"
              "<position name='p' joint='c' kp='5' timeconst='.1'/></actuator>"
              "<keyframe><key name='k' ctrl='.7 .2 -.3 .4' act='.1 .5 -.4 .9'/></keyframe>"),
        "");
}

KT_TEST(affine_gains_and_forces_that_grow_with_the_length_come_back) {
    check_actuators(MODEL("<actuator><general name='f' joint='a' dyntype='filter' dynprm='.3' gaintype='affine' "
                          "gainprm='2 -1 .5' biastype='affine' biasprm='0 3 .1'/>"
                          "<general name='g' joint='b' gainprm='2' biastype='affine' biasprm='.2 6 .3'/></actuator>"
                          "<keyframe><key name='k' ctrl='.7 .2' act='.1'/></keyframe>"),
                    "");
}

KT_TEST(actuators_of_spatial_tendons_come_back) {
    check_actuators(
        MODEL("<tendon><spatial name='l' stiffness='8' springlength='.4' damping='.2'><site site='s'/>"
              "<site site='t'/></spatial></tendon><actuator><motor name='m' tendon='l' gear='3'/>"
              "<position name='p' tendon='l' kp='9' kv='.4' gear='-1.5'/><general name='f' tendon='l' "
              "dyntype='filterexact' dynprm='.2' gainprm='4' biastype='affine' biasprm='1 -2 0'/></actuator>"
              "<keyframe><key name='k' ctrl='.7 .2 .5' act='.3'/></keyframe>"),
        "");
}

/* Without a force between two lengths, from the length zero on, and with one length. */
KT_TEST(springs_of_spatial_tendons_come_back) {
    check_actuators(
        MODEL("<tendon><spatial name='l' stiffness='8' springlength='.4 .7' damping='.2'><site site='s'/>"
              "<site site='t'/></spatial><spatial name='m' stiffness='30' springlength='0 .5'><site site='s'/>"
              "<site site='u'/></spatial><spatial name='n' stiffness='5' springlength='.3'><site site='t'/>"
              "<site site='u'/></spatial></tendon><actuator><general name='f' joint='a' dyntype='filterexact' "
              "dynprm='.2'/></actuator><keyframe><key name='k' ctrl='.5' act='.3'/></keyframe>"),
        "");
}

KT_TEST(muscles_of_joints_and_spatial_tendons_come_back) {
    check_actuators(MODEL("<tendon><spatial name='l'><site site='s'/><site site='t'/></spatial></tendon><actuator>"
                          "<muscle name='m' joint='a' gear='-1.5' lengthrange='-2 3' force='40' timeconst='.02 .07' "
                          "range='.6 1.2' lmin='.4' lmax='1.7' vmax='2' fpmax='1.1' fvmax='1.3'/>"
                          "<muscle name='n' joint='a' lengthrange='-1 1.5' force='25' tausmooth='.3'/>"
                          "<muscle name='o' tendon='l' lengthrange='.2 .9' force='70' fvmax='1'/>"
                          "</actuator><keyframe><key name='k' ctrl='.7 .2 .5' act='.3 .1 0'/></keyframe>"),
                    "");
}

/* A muscle of random numbers in a joint, and one along a path around a cylinder. */
KT_TEST(random_muscles_come_back) {
    kt_random random = kt_random_of_test();
    for (int n = 0; n < 10; n++) {
        char text[4000], muscles[2][500];
        for (int i = 0; i < 2; i++) {
            const double least = kt_random_uniform(&random, -1.0, 0.3);
            (void)snprintf(muscles[i], sizeof muscles[i],
                           "lengthrange='%.17g %.17g' force='%.4g' timeconst='%.3g %.3g' tausmooth='%.3g' range='%.3g "
                           "%.3g' lmin='%.3g' lmax='%.3g' vmax='%.3g' fpmax='%.3g' fvmax='%.3g' gear='%.3g'",
                           least, least + kt_random_uniform(&random, 0.2, 3.0), kt_random_uniform(&random, 1.0, 1000.0),
                           kt_random_uniform(&random, 0.005, 0.05), kt_random_uniform(&random, 0.02, 0.09),
                           n % 2 == 0 ? 0.0 : kt_random_uniform(&random, 0.1, 1.0),
                           kt_random_uniform(&random, 0.4, 0.9), kt_random_uniform(&random, 1.0, 1.5),
                           kt_random_uniform(&random, 0.3, 0.7), kt_random_uniform(&random, 1.3, 1.9),
                           kt_random_uniform(&random, 0.8, 10.0), kt_random_uniform(&random, 0.5, 2.0),
                           kt_random_uniform(&random, 0.9, 1.6), kt_random_uniform(&random, 0.3, 2.0));
        }
        (void)snprintf(text, sizeof text,
                       MODEL("<tendon><spatial name='l'><site site='s'/><geom geom='g'/><site site='u'/></spatial>"
                             "</tendon><actuator><muscle name='m' joint='b' %s/><muscle name='o' tendon='l' %s/>"
                             "</actuator><keyframe><key name='k' ctrl='%.3g %.3g' act='.3 .1'/></keyframe>"),
                       muscles[0], muscles[1], kt_random_uniform(&random, -0.5, 1.5),
                       kt_random_uniform(&random, 0.0, 1.0));
        check_actuators(text, "");
    }
}

KT_TEST(bounds_of_forces_and_activations_come_back) {
    check_actuators(MODEL("<tendon><spatial name='l'><site site='s'/><site site='t'/></spatial></tendon><actuator>"
                          "<general name='f' joint='a' gear='-2' dyntype='filterexact' dynprm='.4' gainprm='3' "
                          "biastype='affine' biasprm='.1 -4 -.2' forcerange='-1 2' actrange='-.3 .6'/>"
                          "<position name='p' tendon='l' kp='9' kv='.4' gear='-1.5' forcerange='-.5 .7'/>"
                          "<muscle name='m' joint='b' gear='1.3' lengthrange='-2 3' force='40' forcerange='-9 0'/>"
                          "</actuator><keyframe><key name='k' ctrl='.7 .2 .5' act='.1 .3'/></keyframe>"),
                    "");
}

/* MuJoCo bounds the force of a muscle before its gear, and the sum of forces in a joint behind it. */
KT_TEST(bounds_of_a_joint_with_one_muscle_come_back) {
    static const char *const gears[] = {"-1' force='40", ".5' force='60"};
    for (int i = 0; i < 2; i++) {
        char text[600];
        (void)snprintf(text, sizeof text,
                       "<mujoco><worldbody><body><joint name='a' actuatorfrcrange='-10 100'/><geom size='.1' pos='.2 0 "
                       "0'/></body></worldbody><actuator><muscle joint='a' lengthrange='-2 3' gear='%s'/></actuator>"
                       "<keyframe><key name='k' ctrl='.7' act='.9'/></keyframe></mujoco>",
                       gears[i]);
        check_actuators(text, "");
    }
}

/* Controls that are zero before a delay: of forces, servos, activations and muscles. */
KT_TEST(delays_come_back) {
    check_actuators(
        MODEL("<tendon><spatial name='l'><site site='s'/><site site='t'/></spatial></tendon><actuator>"
              "<motor name='d' joint='a' gear='3' delay='.1' nsample='100'/>"
              "<position name='p' joint='c' kp='8' kv='.3' delay='.7' nsample='900' forcerange='-2 2'/>"
              "<general name='f' joint='b' dyntype='filterexact' dynprm='.2' gainprm='3' delay='.3' "
              "nsample='300' actrange='-1 .5'/><motor name='t' tendon='l' delay='.2' nsample='100'/>"
              "<muscle name='m' joint='b' lengthrange='-2 3' force='40' delay='.4' nsample='300'/></actuator>"
              "<keyframe><key name='k' ctrl='.7 .2 -.3 .5 .6' act='.1 .4'/></keyframe>"),
        "");
}

/* Several actuators of one joint or path, each with its bounds and its delay, and the bounds of their sum. */
KT_TEST(sums_of_bounded_actuators_come_back) {
    check_actuators(MODEL("<tendon><spatial name='l'><site site='s'/><site site='t'/></spatial></tendon><actuator>"
                          "<position name='p' joint='c' kp='8' delay='.7' nsample='900' forcerange='-2 2'/>"
                          "<intvelocity name='i' joint='c' kp='3' actrange='-.5 .5' forcerange='-1 2'/>"
                          "<position name='q' tendon='l' kp='9' forcerange='-.5 .7'/></actuator>"
                          "<keyframe><key name='k' ctrl='.7 .2 -.3' act='.1'/></keyframe>"),
                    "");
    check_actuators(
        "<mujoco><worldbody><body><joint name='a' actuatorfrcrange='-3 2'/><geom size='.1' pos='.2 0 0'/></body>"
        "</worldbody><actuator><position name='p' joint='a' kp='8' forcerange='-2 2'/><general name='f' "
        "joint='a' dyntype='filterexact' dynprm='.2' gainprm='30' forcerange='-4 4'/><general name='g' "
        "joint='a' dyntype='integrator' gainprm='9'/></actuator><keyframe><key name='k' ctrl='.7 .2 .1' "
        "act='.1 .3'/></keyframe></mujoco>",
        "");
    check_actuators(
        "<mujoco><worldbody><body><joint name='a' actuatorfrcrange='-3 2'/><geom size='.1' pos='.2 0 0'/></body>"
        "</worldbody><actuator><position joint='a' kp='8'/><general joint='a' dyntype='filterexact' "
        "dynprm='.2' gainprm='3'/></actuator><keyframe><key name='k' ctrl='.7 .2' act='.3'/></keyframe></mujoco>",
        "");
}

#define FIVE(text) text text text text text
#define LONG FIVE(FIVE(FIVE("jj"))) "jjjjj" /* a name of 255 bytes */
#define HINGE(name, springs)                                                                                           \
    "<mujoco><compiler angle='radian'/><worldbody><body name='a'><joint name='" name "' " springs                      \
    " axis='0 1 0' actuatorfrcrange='-3 2'/><geom size='.1' pos='.2 0 0'/></body></worldbody><actuator>"               \
    "<position name='" name "' joint='" name "' kp='8' forcerange='-2 2'/>"                                            \
    "<general name='" name "2' joint='" name "' dyntype='filterexact' dynprm='.2' gainprm='30' forcerange='-4 4'/>"    \
    "<general name='" name "3' joint='" name "' dyntype='integrator' gainprm='9'/></actuator>"                         \
    "<keyframe><key name='k' ctrl='.7 .2 .1' act='.1 .3'/></keyframe></mujoco>"
#define POLYNOMIALS "stiffness='2 3 4' damping='.1 .2'"

/* Names have no influence on what is kept: neither in the actuators of a bounded sum nor in polynomial springs. */
KT_TEST(names_of_255_bytes_lose_nothing) {
    const kt_robot_options options = {.keyframe = "k"};
    kt_random random = kt_random_of_test();
    const machine plain = kt_test_open(test_robot(HINGE("j", POLYNOMIALS), &options), NULL),
                  named = kt_test_open(test_robot(HINGE(LONG, POLYNOMIALS), &options), NULL);
    kt_check_text("the joint", named.scene->description.bodies[0].joint.name, LONG);
    compare_machines(&plain, &named, &random);
    check_actuators(HINGE("j", ""), "");
    check_actuators(HINGE(LONG, ""), "");
    check_actuators(HINGE("j", POLYNOMIALS), "");
    check_actuators(HINGE(LONG, POLYNOMIALS), "");
}

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

/* A model that is written in MJCF from the scene, and from a scene file of it. */
static void write_twice(const kt_scene *scene, const char *lost, char *text[2]) {
    const kt_scene *const scenes[] = {scene, kt_test_scene(kt_test_written(scene))};
    for (int i = 0; i < 2; i++) {
        kt_error error = {0};
        told t;
        kt_need_fine("written", write_back(&scenes[i]->description, KT_ROBOT_MJCF, &t, &text[i], &error), &error);
        kt_check_text("lost", t.text, lost);
    }
}

/* Checks that the written model has parts, between '|', and so has the model after it was read and written once more,
 * also by way of scene files. */
static void check_numbers(const char *model, const char *parts) {
    const kt_robot_options first = {.keyframe = "k"}, again = {.keyframe = "start"};
    char *text[2], *back[2], part[400];
    write_twice(test_robot(model, &first), "", text);
    kt_check_text("from the scene file", text[1], text[0]);
    write_twice(test_robot(text[0], &again), "", back);
    kt_check_text("once more from the scene file", back[1], back[0]);
    kt_check_text("tendons and actuators once more", strstr(back[0], "<tendon>"), strstr(text[0], "<tendon>"));
    for (const char *at = parts; *at != '\0'; at += *at == '|') {
        const size_t length = strcspn(at, "|");
        (void)snprintf(part, sizeof part, "%.*s", (int)length, at);
        kt_check_contains("numbers", text[0], part);
        kt_check_contains("numbers once more", back[0], part);
        at += length;
    }
}

KT_TEST(numbers_of_actuators_and_their_activations_come_back) {
    check_numbers(
        MODEL("<actuator><general name='f' joint='a' gear='-2' dyntype='filterexact' dynprm='.4' gaintype='affine' "
              "gainprm='3 .5 -.25' biastype='affine' biasprm='.1 -4 -.2' ctrlrange='-1 1' forcerange='-1 2' "
              "actrange='-.3 .6'/><intvelocity name='i' joint='b' kp='7' kv='.3' delay='.7' nsample='7001'/>"
              "<muscle name='m' joint='c' gear='1.5' lengthrange='-2 3' range='.6 1.2' force='40' timeconst='.02 .07' "
              "tausmooth='.3' lmin='.4' lmax='1.7' vmax='2' fpmax='1.1' fvmax='1.3'/>"
              "<motor name='d' joint='a' gear='3' delay='.1' nsample='1001'/></actuator>"
              "<keyframe><key name='k' ctrl='.7 .2 .5 .25' act='.1 .5 .3'/></keyframe>"),
        "name=\"f\" joint=\"a\" gear=\"-2\" ctrlrange=\"-1 1\" forcerange=\"-1 2\" actrange=\"-0.3 0.6\" "
        "dyntype=\"filterexact\" dynprm=\"0.4\" gaintype=\"affine\" gainprm=\"3 0.5 -0.25\" biastype=\"affine\" "
        "biasprm=\"0.1 -4 -0.2\"|"
        "name=\"i\" joint=\"b\" gear=\"1\" delay=\"0.7\" nsample=\"7001\" dyntype=\"integrator\" gainprm=\"7\" "
        "biastype=\"affine\" biasprm=\"0 -7 -0.3\"|"
        "name=\"m\" joint=\"c\" gear=\"1.5\" dyntype=\"muscle\" dynprm=\"0.02 0.07 0.3\" gaintype=\"muscle\" "
        "gainprm=\"0.6 1.2 40 200 0.4 1.7 2 1.1 1.3\"|lengthrange=\"-2 3\"|"
        "name=\"d\" joint=\"a\" gear=\"3\" delay=\"0.1\" nsample=\"1001\" gainprm=\"1\"/>|"
        "ctrl=\" 0.7 0.25 0.2 0.5\"|act=\" 0.1 0.5 0.3\"");
}

/* A joint with a polynomial spring and actuators of a bounded sum, tendons of one joint and of two, and a path. */
KT_TEST(numbers_of_polynomial_springs_and_tendons_come_back) {
    check_numbers(
        "<mujoco><compiler angle='radian'/><worldbody><site name='w' pos='0 0 1'/><body name='a'><joint name='a' "
        "axis='0 1 0' stiffness='2 3 4' damping='.1 .2 .3' springref='.25' actuatorfrcrange='-3 2'/><geom size='.1' "
        "pos='.2 0 0'/><site name='s' pos='.1 0 .1'/><body name='b' pos='.5 0 0'><joint name='b' axis='0 1 0' "
        "actuatorfrcrange='-5 4'/><geom size='.1' pos='.2 0 0'/></body></body></worldbody><tendon><fixed name='one' "
        "stiffness='5 6 7' springlength='-.1 .3' damping='.4 .5'><joint joint='b' coef='-2'/></fixed><fixed name='two' "
        "actuatorfrcrange='-1 1.5'><joint joint='a' coef='.5'/><joint joint='b' coef='1.5'/></fixed><spatial "
        "name='path' stiffness='8 0 9' springlength='.4 .7' damping='.2 .1'><site site='w'/><site site='s'/></spatial>"
        "</tendon><actuator><position name='p' joint='a' kp='8' forcerange='-2 2'/><general name='q' joint='a' "
        "dyntype='filter' dynprm='.2' gainprm='30'/><motor name='r' tendon='two' gear='2' forcerange='-.5 .5'/>"
        "<motor name='s' tendon='two'/></actuator>"
        "<keyframe><key name='k' ctrl='.7 .2 .1 .4' act='.3'/></keyframe></mujoco>",
        "actuatorfrcrange=\"-3 2\" damping=\"0.1 0.2 0.3\" stiffness=\"2 3 4\" springref=\"0.25\"|"
        "actuatorfrcrange=\"-5 4\"|stiffness=\"5 6 7\" springlength=\"-0.1 0.3\"|damping=\"0.4 0.5 0\"|"
        "<joint joint=\"b\" coef=\"-2\"/>|"
        "<fixed name=\"two\" actuatorfrcrange=\"-1 1.5\"><joint joint=\"a\" coef=\"0.5\"/><joint joint=\"b\" "
        "coef=\"1.5\"/>|name=\"path\" stiffness=\"8 0 9\" springlength=\"0.4 0.7\" damping=\"0.2 0.1 0\"|"
        "name=\"p\" joint=\"a\" gear=\"1\" forcerange=\"-2 2\" gainprm=\"8\" biastype=\"affine\" biasprm=\"0 -8 "
        "0\"|name=\"r\" tendon=\"two\" gear=\"2\" forcerange=\"-0.5 0.5\"|name=\"s\" tendon=\"two\" gear=\"1\"");
}

KT_TEST(actuators_of_sites_come_back) {
    static const char text[] =
        "<mujoco><worldbody><body name='a'><freejoint/><geom size='.1' mass='2'/><site name='s' pos='.1 .2 0' "
        "euler='90 0 0'/></body></worldbody><actuator><general name='f' site='s' gear='1 2 3 .1 .2 .3' "
        "dyntype='filter' dynprm='.4' gainprm='3' forcerange='-1 2'/></actuator>"
        "<keyframe><key name='k' qpos='0 0 1 1 0 0 0' ctrl='.7' act='.1'/></keyframe></mujoco>";
    check_actuators(text, "");
    check_numbers(text, "dyntype=\"filterexact\" dynprm=\"0.4\"");
}

/* Numbers, and a formula that is written out. */
static const char *const numbers_and_formulas[][2] = {
    {"actuators: [{gear: 2, gain: 5, bias: [0.1, -5, -1], control: 0.3, control_upper: 0.25, lower: -1, upper: 1.5}], "
     "upper: 2.5",
     "force: \"min(2*clamp(1.35 - 10*position.a - 2*velocity.a, -1, 1.5), 2.5)\""},
    {"actuators: [{gear: 2, gain: [3, 0.5, -0.2], activation: w, activation_upper: 0.4}, "
     "{gain: 4, control: 0.5, delay: 0.5}]",
     "force: \"2*min(w, 0.4)*(3 + position.a - 0.4*velocity.a) + 0.5*step(t - 0.5)*4\""},
    {"actuators: [{gain: 0, active: {lengths: [-2, 1], force: 40}, activation: w}]",
     "force: \"-40*w*(clamp((l + -0.5)*4, 0, 2)^2/2 - clamp((l + -0.75)*4, 0, 1)^2)*(clamp((1.6 - l)/0.3, 0, 2)^2/2 - "
     "clamp((1.3 - l)/0.3, 0, 1)^2)*(clamp(s + 1, 0, 1)^2 + clamp(s, 0, 0.2)*(2 - clamp(s*5, 0, 1)))\""},
    {"spring: {factor: -0.5, stiffness: [10, 2, 4], rest: [0.1, 0.2], damping: [0.3, 0.1, 0.2]}",
     "force: \"0.5*x*(10 + 2*x + 4*x^2) + 0.5*v*(0.3 + 0.1*abs(v) + 0.2*v^2)\""},
};

/* Opens both; l and s are the scaled length and rate of the muscle, x and v those of the spring. */
static machine open_numbers(const char *force) {
    return kt_test_open(
        kt_test_scene_of("kinetree: 1\nbodies: [{name: a, joint: {type: revolute, axis: y}, mass: 1, "
                         "shape: {type: rod, to: [0, 0, -1]}}]\nstates: {w: {activation: {type: filter, "
                         "control: 0.7, times: 0.4}}}\nexpressions: {l: 0.95 + 0.1*position.a, s: "
                         "velocity.a/15, x: \"min(0, -0.5*position.a - 0.1) + max(0, -0.5*position.a - "
                         "0.2)\", v: -0.5*velocity.a}\neffects: [{type: expression, joint: a, %s}]\n",
                         force),
        NULL);
}

/* Forces and their derivatives, which follow from the same kernels. */
KT_TEST(numbers_have_the_forces_and_derivatives_of_formulas) {
    static _Alignas(64) double work[1 << 12];
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("force, derivatives");
    for (size_t i = 0; i < sizeof numbers_and_formulas / sizeof *numbers_and_formulas; i++) {
        const machine of[2] = {open_numbers(numbers_and_formulas[i][0]), open_numbers(numbers_and_formulas[i][1])};
        for (int n = 0; n < TRIALS; n++) {
            const double q = kt_random_uniform(&random, -3.0, 3.0), v = kt_random_uniform(&random, -9.0, 9.0),
                         w = kt_random_uniform(&random, -0.2, 1.2), t = kt_random_uniform(&random, 0.0, 1.0);
            double found[2][4];
            for (int k = 0; k < 2; k++) {
                kt_error error = {0};
                kt_need(kt_check_true("force", evaluate(&of[k], t, &q, &v, &w, &found[k][0], &found[k][1])));
                kt_need_fine("derivatives",
                             kt_acceleration_derivatives(of[k].model, of[k].data, work, sizeof work, t, &q, &v, NULL,
                                                         NULL, &found[k][2], &found[k][3], NULL, &error),
                             &error);
            }
            for (int k = 0; k < 4; k++)
                kt_worst_near(&worst, found[0][k], found[1][k], 1e-12 * (1.0 + fabs(found[1][k])), "%d, %d", (int)i, k);
        }
    }
}

/* ---- what is lost ------------------------------------------------------------------------------------------------ */

#define BY_FORMULA "forces by formulas (actuators and springs by numbers have a place)"

/* Formulas of a user are lost, also those that have the force of an actuator. */
KT_TEST(forces_by_formulas_are_left_out_and_told) {
    static const char *const forces[] = {"2*position.a*step(t - 1)", "3 - 2*position.a", "abs(velocity.a)",
                                         "2*clamp(x, -1, 1)", "clamp(velocity.a*x + 2*x, -1, position.a)"};
    for (size_t i = 0; i < sizeof forces / sizeof *forces; i++) {
        char text[500];
        told t;
        (void)snprintf(text, sizeof text,
                       "kinetree: 1\nbodies: [{name: a, joint: {type: revolute, axis: x}, mass: 1, inertia: [1, 1, "
                       "1]}]\nstates:\n  x: {rate: \"1 - x\"}\neffects:\n  - {type: expression, joint: a, force: "
                       "\"%s\"}\n",
                       forces[i]);
        (void)come_back(&kt_test_scene(text)->description, KT_ROBOT_MJCF, NULL, &t);
        kt_check_text(forces[i], t.text, BY_FORMULA " 1\nauxiliary states 1\n");
    }
}

/* MuJoCo bounds each of its actuators, and the sum of all in a joint, but not the sum of two of three. It has no
 * activation by a formula. */
KT_TEST(numbers_without_a_place_in_mjcf_are_told) {
    static const struct {
        const char *effects, *lost;
    } cases[] = {
        {"[{type: expression, joint: a, upper: 1, actuators: [{control: 2}, {control: 3}]}, {type: motor, joint: a, "
         "torque: 1}]",
         "bounds of sums of actuators, which MuJoCo has for all that move a joint alone 1\nauxiliary states 1\n"},
        {"[{type: expression, joint: a, actuators: [{activation: x}]}]",
         "actuators whose activation has a rate by a formula 1\nauxiliary states 1\n"},
        {"[{type: expression, between: [world, a], spring: {stiffness: 5, rest: [1, 2], beyond: true}}]",
         "stops along paths 1\nauxiliary states 1\n"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        told t;
        (void)come_back(
            &kt_test_scene_of(
                 "kinetree: 1\nbodies: [{name: a, joint: {type: prismatic, axis: x}, mass: 1, inertia: [1, 1, 1]}]"
                 "\nstates: {x: {rate: \"1 - x\"}}\neffects: %s\n",
                 cases[i].effects)
                 ->description,
            KT_ROBOT_MJCF, NULL, &t);
        kt_check_text(cases[i].effects, t.text, cases[i].lost);
    }
}

KT_TEST(faulty_numbers_are_rejected_with_a_remedy) {
    static const char *const cases[][2] = {
        {"force: \"1\", upper: 2", "write clamp(..) into the formula"},
        {"force: \"1\", actuators: [{}]", "exclude one another; give one of them"},
        {"actuators: [{activation: z}]", "state 'z' does not exist; add it to `states`"},
        {"actuators: [{tendon: t, sum_lower: 1}, {tendon: t, gear: 2, sum_lower: 1}]", "must have zero between them"},
        {"actuators: [{terms: {b: 1}}]", "its terms do not name the joint of the effect"},
        {"spring: {friction: 2}", "take joint_friction, or joint_limit"},
        {"spring: {rest: [2, 1]}", "rest is 2 and 1; give two numbers that rise"},
        {"lower: 3, upper: 1, actuators: [{}]", "lower is 3, and the upper bound 1"},
        {"actuators: [{active: {lengths: [1, 1], force: 3}}]", "active: lengths are 1 and 1"},
        {"actuators: [{delay: -1}]", "delay is -1; it must be 0 or more"},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char text[500];
        kt_error error = {0};
        const int length =
            snprintf(text, sizeof text,
                     "kinetree: 1\nbodies: [{name: a, joint: {type: prismatic}, mass: 1}, {name: b, joint: {type: "
                     "prismatic}, mass: 1}]\neffects: [{type: expression, joint: a, %s}]\n",
                     cases[i][0]);
        kt_check_true(cases[i][0],
                      kt_scene_parse("x", text, (size_t)length, kt_test_scene_place(), NULL, NULL, &error) != KT_OK);
        kt_check_contains("message", error.message, cases[i][1]);
    }
}
