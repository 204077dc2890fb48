/* Actuators of MJCF with activations, and tendons with armatures: against closed forms, and against today's MuJoCo
 * (mujoco_wasm.mjs), if KT_MUJOCO_WASM names the folder of npm's @mujoco/mujoco. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m.xml"
#include "folder.h"
#include "node.h"
#include "robot.h"
#include "run_file.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { JOINTS_MOST = 5 };

/* The positions of the joints a, b, ... of a model after a time, from its keyframe k. */
static void run_model(const char *path, double time, int joints, double *q) {
    const kt_robot_options options = {.keyframe = "k"};
    const kt_run run = {.duration = time, .relative = 1e-12, .absolute = 1e-12};
    const kt_mechanism *m = run_file(path, &options, &run, time);
    for (int i = 0; i < joints; i++)
        q[i] = *positions_of(m, (const char[]){(char)('a' + i), '\0'});
}

/* ---- closed forms ------------------------------------------------------------------------------------------------ */

#define SLIDE(name) "<body name='" name "'><joint name='" name "' type='slide'/><geom size='.1' mass='2'/></body>"

/* Masses of 2 kg without gravity. With w = u + (w0 - u) exp(-t/T) the force k w moves a mass at rest by
 *     k/m (u t^2/2 + (w0 - u) (T^2 exp(-t/T) - T^2 + T t)),
 * and with w = min(w0 + u t, w1), which reaches w1 at s, by
 *     k/m (w0 t^2/2 + u t^3/6)  up to s, and from there with the constant force k w1. */
KT_TEST(activations_move_masses_as_closed_forms_do) {
    static const char text[] = "<mujoco><option gravity='0 0 0'/><worldbody>" SLIDE("a") SLIDE("b") SLIDE("c")
        SLIDE("d") "</worldbody><actuator>"
                   "<general name='f' joint='a' dyntype='filterexact' dynprm='.4' gainprm='3'/>"
                   "<motor joint='b' gear='0'/>"
                   "<general joint='b' dyntype='integrator' gainprm='3' actrange='-1 .5' ctrlrange='-1 .5'/>"
                   "<cylinder joint='c' timeconst='.2' diameter='2' bias='1 0 0'/>"
                   "<general joint='d' dyntype='filter' dynprm='0' gainprm='3'/>"
                   "</actuator><keyframe><key name='k' ctrl='.7 0 9 .3 .2' act='.1 .2 -.4 .9'/></keyframe></mujoco>";
    double q[4];
    const double t = 1.5, s = (0.5 - 0.2) / 0.5, pi = 3.14159265358979323846;
    run_model(kt_test_file(kt_test_folder(), "m.xml", text), t, 4, q);
    const double filter = 0.7 * t * t / 2.0 + (0.1 - 0.7) * (0.16 * exp(-t / 0.4) - 0.16 + 0.4 * t);
    const double speed = 0.2 * s + 0.5 * s * s / 2.0, before = 0.2 * s * s / 2.0 + 0.5 * s * s * s / 6.0;
    const double integral = before + speed * (t - s) + 0.5 * (t - s) * (t - s) / 2.0;
    const double cylinder = 0.3 * t * t / 2.0 + (-0.4 - 0.3) * (0.04 * exp(-t / 0.2) - 0.04 + 0.2 * t);
    kt_check_near("filter", q[0], 1.5 * filter, 1e-9);
    kt_check_near("integrator within bounds", q[1], 1.5 * integral, 1e-9);
    kt_check_near("cylinder", q[2], 0.5 * (pi * cylinder + t * t / 2.0), 1e-9);
    kt_check_near("a time constant of zero", q[3], 1.5 * 0.2 * t * t / 2.0, 1e-9);
}

KT_TEST(activations_of_a_keyframe_need_a_number_each) {
    static const char text[] = "<mujoco><worldbody>" SLIDE(
        "a") "</worldbody><actuator><general joint='a' dyntype='filter'/><muscle joint='a'/>"
             "</actuator><keyframe><key name='k' act='.1'/></keyframe></mujoco>";
    const kt_robot_options options = {.keyframe = "k"};
    kt_scene scene;
    kt_check_equal_int("status", parse(text, &options, &scene), KT_ERROR_SCENE);
    kt_check_contains("message", faults.text, "act: expected 2 numbers, found '.1'");
}

/* Before the delay of 0.5 s the control is zero; the activation of the second mass leaves its start then. */
KT_TEST(delayed_controls_act_later) {
    static const char text[] = "<mujoco><option gravity='0 0 0'/><worldbody>" SLIDE("a") SLIDE("b") SLIDE(
        "c") "<body name='d'><joint name='d' type='slide'/><geom size='.1' mass='2'/><site name='s'/></body>"
             "</worldbody><actuator>"
             "<motor joint='a' gear='3' delay='.5' nsample='300'/><general joint='b' dyntype='filter' dynprm='.4' "
             "gainprm='3' "
             "delay='.5' nsample='300'/><position joint='c' kp='8' delay='.5' nsample='300'/>"
             "<motor site='s' gear='0 0 3' delay='.5' nsample='300'/></actuator><keyframe>"
             "<key name='k' ctrl='.7 .7 .2 .7' act='.3'/></keyframe></mujoco>";
    double q[4];
    const double t = 1.5, d = 0.5, s = t - d, T = 0.4, at = 0.3 * exp(-d / T);
    run_model(kt_test_file(kt_test_folder(), "m.xml", text), t, 4, q);
    const double decay = 0.3 * (T * T * exp(-d / T) - T * T + T * d), speed = 0.3 * T * (1.0 - exp(-d / T));
    const double filter = decay + speed * s + 0.7 * s * s / 2.0 + (at - 0.7) * (T * T * exp(-s / T) - T * T + T * s);
    kt_check_near("motor", q[0], 1.5 * 0.7 * s * s / 2.0, 1e-9);
    kt_check_near("filter", q[1], 1.5 * filter, 1e-9);
    kt_check_near("servo", q[2], 0.2 * (1.0 - cos(2.0 * s)), 1e-9);
    kt_check_near("motor of a site", q[3], 1.5 * 0.7 * s * s / 2.0, 1e-9);
}

/* MuJoCo's force is then that of the activation one step later: a warning, and the same force here. */
KT_TEST(early_activations_are_a_warning) {
    static const char text[] = "<mujoco><worldbody>" SLIDE(
        "a") "</worldbody><actuator><general joint='a' "
             "dyntype='filter' actearly='true'/><general joint='a' dyntype='filter'/></actuator></mujoco>";
    const kt_scene *scene = test_robot(text, NULL);
    int found = 0;
    for (int i = 0; i < scene->note_count; i++)
        found += scene->notes[i].rank == KT_NOTE_RANK_MOTION && strstr(scene->notes[i].what, "actearly") != NULL &&
                 strstr(scene->notes[i].what, ": 1") != NULL;
    kt_check_equal_int("warnings of one actuator", found, 1);
}

/* ---- muscles ----------------------------------------------------------------------------------------------------- */

/* The curves of MuJoCo's documentation, piece by piece. */
static double active_of(double l, double lmin, double lmax) {
    const double a = 0.5 * (lmin + 1.0), b = 0.5 * (1.0 + lmax);
    if (l < lmin || l > lmax)
        return 0.0;
    if (l <= a)
        return 0.5 * pow((l - lmin) / (a - lmin), 2.0);
    if (l <= 1.0)
        return 1.0 - 0.5 * pow((1.0 - l) / (1.0 - a), 2.0);
    return l <= b ? 1.0 - 0.5 * pow((l - 1.0) / (b - 1.0), 2.0) : 0.5 * pow((lmax - l) / (lmax - b), 2.0);
}

static double speed_of(double v, double fvmax) {
    const double c = fvmax - 1.0;
    return v <= -1.0 ? 0.0 : v <= 0.0 ? pow(v + 1.0, 2.0) : v <= c ? fvmax - pow(c - v, 2.0) / c : fvmax;
}

static double passive_of(double l, double lmax, double fpmax) {
    const double b = 0.5 * (1.0 + lmax), x = (l - 1.0) / (b - 1.0);
    return x <= 0.0 ? 0.0 : fpmax * (x <= 1.0 ? 0.5 * x * x : 0.5 + (x - 1.0));
}

/* A muscle in a joint of 2 kg with the limits -1 and 1, and the gear -0.5. The unit of its length is then
 * 1/(1.05 - 0.75), and a unit force accelerates the joint by 0.25. */
KT_TEST(muscles_have_the_curves_of_the_documentation) {
    static const char text[] =
        "<mujoco><worldbody><body name='a'><joint name='a' type='slide' range='-1 1'/><geom "
        "size='.1' mass='2'/></body></worldbody><actuator><muscle joint='a' gear='-.5' lengthrange='-.5 .5'/>"
        "</actuator></mujoco>";
    const kt_opened p = kt_test_open(test_robot(text, NULL), NULL);
    KT_WORST force = kt_worst_make("force"), rate = kt_worst_make("rate");
    for (int i = 0; i <= 60; i++)
        for (int k = 0; k <= 20; k++) {
            const double q = -6.0 + 0.2 * i, v = -20.0 + 2.0 * k, act = 0.05 * k - 0.1;
            const double unit = 1.0 / 0.3, l = 0.75 + (-0.5 * q + 0.5) / unit, speed = -0.5 * v / (unit * 1.5);
            const double e = 0.5 + 1.5 * fmin(fmax(act, 0.0), 1.0), tau = act < 0.0 ? 0.01 * e : 0.04 / e;
            const double pull =
                200.0 / 0.25 * (act * active_of(l, 0.5, 1.6) * speed_of(speed, 1.2) + passive_of(l, 1.6, 1.3));
            double f = (double)NAN, w = (double)NAN;
            kt_error error = {0};
            kt_auxiliary_states(p.model, p.data)[0] = act;
            if (kt_effect_forces(p.model, p.data, 0.0, &q, &v, &f, &error) != KT_OK ||
                kt_auxiliary_state_rates(p.model, p.data, 0.0, &q, &v, &w, &error) != KT_OK)
                f = (double)NAN;
            kt_worst_near(&force, f, 0.5 * pull, 1e-11, "%d, %d", i, k);
            kt_worst_near(&rate, w, -act / tau, 1e-11, "%d, %d", i, k);
        }
}

KT_TEST(muscles_without_ranges_are_left_out_with_a_remedy) {
    static const struct {
        const char *settings, *joint, *range;
        int effects;
    } cases[] = {
        {"", "range='-90 90'", "", 0},
        {"", "range='-90 90'", "lengthrange='-1 1'", 1},
        {"<lengthrange uselimit='true'/>", "range='-90 90'", "", 1},
        {"<lengthrange uselimit='true'/>", "", "", 0},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const kt_scene *scene = test_robot_of(NULL,
                                              "<mujoco><compiler>%s</compiler><worldbody><body><joint name='a' %s/>"
                                              "<geom size='.1' pos='.2 0 0'/></body></worldbody><actuator>"
                                              "<muscle joint='a' %s/></actuator></mujoco>",
                                              cases[i].settings, cases[i].joint, cases[i].range);
        kt_check_true("warning",
                      has_note(scene, "mj_saveLastXML of MuJoCo writes the ranges: 1") == (cases[i].effects == 0));
        kt_check_equal_int("effects", scene->description.effect_count, cases[i].effects);
    }
}

/* ---- MuJoCo ------------------------------------------------------------------------------------------------------ */

/* Filters and integrators, which MuJoCo integrates with its method of fourth order: in joints and a tendon, with gears,
 * bounds of force, defaults, and an affine gain. The step is a power of two, so that MuJoCo ends at 1 s. */
static const char robot[] =
    "<mujoco><option timestep='0.000244140625' integrator='RK4'><flag contact='disable' limit='disable'/></option>"
    "<default><joint axis='0 1 0' damping='.3'/><geom type='capsule' fromto='0 0 0 0 0 -.3' size='.02' mass='1'/>"
    "<default class='g'><general dyntype='filter' dynprm='.3' gainprm='4' biastype='affine' biasprm='.1 -3 "
    "-.2'/></default>"
    "</default><worldbody><body name='a'><joint name='a'/><geom/><body name='b' pos='0 0 -.3'><joint name='b'/><geom/>"
    "<body name='c' pos='0 0 -.3'><joint name='c'/><geom/><body name='d' pos='0 0 -.3'><joint name='d'/><geom/>"
    "<body name='e' pos='0 0 -.3'><joint name='e'/><geom/></body></body></body></body></body></worldbody>"
    "<tendon><fixed name='t'><joint joint='d' coef='1'/><joint joint='e' coef='-.5'/></fixed></tendon><actuator>"
    "<motor joint='a' gear='2'/><intvelocity joint='b' kp='15' kv='1'/>"
    "<general class='g' joint='c' forcerange='-1 1.5'/><cylinder joint='d' timeconst='.4' area='2' bias='0 -1 -.1'/>"
    "<general tendon='t' dyntype='filter' dynprm='.1' gaintype='affine' gainprm='1 .5 -.1' gear='1.5'/>"
    "<intvelocity joint='e' kp='5'/><position joint='a' kp='3'/></actuator>"
    "<keyframe><key name='k' qpos='.1 .2 .3 -.4 .5' ctrl='.1 .6 .7 .3 .8 .4 -.3' act='.05 .2 -.1 .3 .25'/></keyframe>"
    "</mujoco>";

/* Muscles in a joint, along a fixed tendon and along a spatial one. The time constant changes smoothly or at once. */
static const char muscles[] =
    "<mujoco><option timestep='0.000244140625' integrator='RK4'><flag contact='disable' "
    "limit='disable'/></option><default><joint axis='0 1 0' damping='.3' range='-90 90'/><geom type='capsule' "
    "fromto='0 0 0 0 0 -.3' size='.02' mass='1'/><default class='g'><muscle timeconst='.03 .06' scale='900' "
    "fvmax='1.4'/></default></default><worldbody><site name='s' pos='.1 0 .1'/><geom name='w' type='cylinder' "
    "size='.05 .1' zaxis='0 1 0' fromto='0 -.1 0 0 .1 0' contype='0' conaffinity='0' mass='0'/><body name='a'><joint "
    "name='a'/><geom/><site name='a' pos='.05 0 -.2'/><body name='b' pos='0 0 -.3'><joint name='b'/><geom/><body "
    "name='c' pos='0 0 -.3'><joint name='c'/><geom/></body></body></body></worldbody><tendon><fixed name='t'><joint "
    "joint='b' coef='.1'/><joint joint='c' coef='-.05'/></fixed><spatial name='p'><site site='s'/><geom "
    "geom='w'/><site site='a'/></spatial></tendon><actuator><muscle class='g' name='m' joint='a' gear='.05' "
    "lengthrange='-.1 .1' tausmooth='.4'/><muscle class='g' tendon='t' lengthrange='-.2 .2' force='40' "
    "tausmooth='0'/><muscle class='g' tendon='p' lengthrange='.1 .5' lmin='.2' vmax='2' range='.6 1.1'/><general "
    "joint='c' gear='-1' dyntype='muscle' dynprm='.05 .02 .2' gainprm='3'/><general joint='b' gaintype='muscle' "
    "gainprm='.5 1.2 4 1 .3 1.7 3 1 1.3' lengthrange='-2 2'/><cylinder joint='a' "
    "area='.3'/></actuator><keyframe><key name='k' qpos='.1 .2 .3' ctrl='.6 .7 .2 .8 .4 .9' act='.05 .9 .7 .3 "
    "-.2'/></keyframe></mujoco>";

/* Armatures of a spatial tendon of three parts, two of which are a branch with half the length, and of a fixed one.
 * Each joint carries the next one. */
static const char armatures[] =
    "<mujoco><option timestep='0.000244140625' integrator='RK4'><flag contact='disable' limit='disable'/></option>"
    "<default><geom type='capsule' fromto='0 0 0 0 0 -.3' size='.02' mass='1'/></default><worldbody><site name='w' "
    "pos='.1 .2 .1'/><body name='a'><joint name='a' axis='0 1 0' damping='.3'/><geom/><site name='a' pos='.05 0 -.2'/>"
    "<body name='b' pos='0 0 -.3'><joint name='b' axis='1 .2 0' ref='20'/><geom/><body name='c' pos='0 0 -.3'><joint "
    "name='c' type='slide' axis='.1 0 1' stiffness='30'/><geom/><site name='c' pos='.1 .1 -.1'/></body></body></body>"
    "</worldbody><tendon><spatial armature='1.7' stiffness='3' springlength='.2'><site site='w'/><site site='a'/>"
    "<pulley divisor='2'/><site site='w'/><site site='c'/><site site='a'/></spatial><fixed armature='.4'><joint "
    "joint='a' coef='1'/><joint joint='b' coef='-.5'/></fixed></tendon><keyframe><key name='k' qpos='.3 0 .05' "
    "qvel='1 0 -.3'/></keyframe></mujoco>";

/* The positions after 1 s are those of MuJoCo. */
static void compare_motion(const char *text, int joints) {
    char word[200];
    double ours[JOINTS_MOST];
    int count = 0;
    if (!has_mujoco())
        return;
    const char *path = kt_test_file(kt_test_folder(), "m.xml", text);
    run_model(path, 1.0, joints, ours);
    FILE *from = ask_mujoco("rest=1", (const char *const[]){path}, 1);
    const bool is_read = from != NULL && kt_check_true("MuJoCo reads it", is_read_by_mujoco(from, path)) &&
                         fscanf(from, "%199s", word) == 1;
    for (; count < joints && is_read && fscanf(from, "%199s", word) == 1; count++)
        kt_check_near("position after 1 s", ours[count], strtod(word, NULL), 1e-9);
    kt_check_equal_int("positions", count, joints);
    if (from != NULL)
        end_answers(from);
}

KT_TEST(actuators_with_activations_move_as_those_of_mujoco_of_today) { compare_motion(robot, JOINTS_MOST); }

KT_TEST(muscles_move_as_those_of_mujoco_of_today) { compare_motion(muscles, 3); }

KT_TEST(tendons_with_armatures_move_as_those_of_mujoco_of_today) { compare_motion(armatures, 3); }
