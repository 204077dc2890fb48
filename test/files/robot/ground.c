/* Boxes as ground, and limits of joints that act with contacts. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "folder.h"
#include "run_file.h"

#define ROBOT "r"
#include "robot.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#define BOX_WORLD(box, joint)                                                                                          \
    "<mujoco><worldbody>" box "<body name='a' pos='.3 0 .5'>" joint                                                    \
    "<geom type='sphere' size='.1' mass='1'/></body></worldbody></mujoco>"

/* A box is ground if all that moves starts above its upper face, whichever face this is. */
KT_TEST(boxes_below_robots_are_ground) {
    static const struct {
        const char *text;
        int contacts;
    } table[] = {
        {BOX_WORLD("<geom type='box' size='1 2 .1' pos='0 0 .1'/>", "<freejoint/>"), 1},
        {BOX_WORLD("<geom type='box' size='.1 2 1' pos='0 0 .1' euler='0 90 0'/>", "<freejoint/>"), 1},
        {BOX_WORLD("<geom type='box' size='1 2 .1' pos='0 0 .1' euler='10 0 0'/>", "<freejoint/>"), 1},
        {BOX_WORLD("<geom type='box' size='1 2 .1' pos='0 0 .1'/>", "<joint type='slide' axis='0 0 1'/>"), 1},
        {BOX_WORLD("<geom type='box' size='1 2 .1' pos='2 0 .1'/>", "<freejoint/>"), 0},
        {BOX_WORLD("<geom type='box' size='1 2 .4' pos='0 0 .4'/>", "<freejoint/>"), 0},
        {BOX_WORLD("<geom type='box' size='1 2 .1' pos='0 0 .1' contype='0' conaffinity='0'/>", "<freejoint/>"), 0},
        {"<sdf version='1.9'><world name='w'><model name='m'><pose>0 0 .5 0 0 0</pose><link name='l'><collision "
         "name='c'><geometry><sphere><radius>.1</radius></sphere></geometry></collision></link></model><model "
         "name='floor'><static>true</static><link name='l'><collision name='c'><geometry><box><size>9 9 .2</size></box>"
         "</geometry></collision></link></model></world></sdf>",
         1},
        {"<robot name='r'><link name='world'><collision><origin xyz='0 0 -.5'/><geometry><box size='9 9 1'/></geometry>"
         "</collision></link><link name='b'><inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' "
         "ixz='0' iyz='0'/></inertial><collision><geometry><sphere radius='.1'/></geometry></collision></link>"
         "<joint name='j' type='floating'><parent link='world'/><child link='b'/><origin xyz='0 0 "
         ".1'/></joint></robot>",
         1},
    };
    static const kt_robot_options options = {.contacts = true};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, &options);
        kt_check_equal_int(table[i].text, scene->description.effect_count, table[i].contacts);
        kt_check_equal_int("note", has_ranked_note(scene, KT_NOTE_RANK_START, "planes without edges"),
                           table[i].contacts > 0);
    }
    static const char standing[] = BOX_WORLD("<geom type='box' size='1 2 .1' pos='0 0 .1'/>", "<freejoint/>");
    const kt_mechanism *m = run_file(kt_test_file(kt_test_folder(), "box.xml", standing), &options, NULL, 5.0);
    kt_check_near("it lies on the upper face", positions_of(m, "a")[2], 0.3, 1e-3);
}

/* Contacts that the file turns off stay off, with a warning. */
KT_TEST(flags_turn_contacts_off) {
#define FLAGGED(flag)                                                                                                  \
    "<mujoco><option><flag " flag "/></option><worldbody><geom type='plane' size='9 9 1'/><body name='a' "             \
    "pos='0 0 .5'><freejoint/><geom type='sphere' size='.1' mass='1'/></body></worldbody></mujoco>"
    static const struct {
        const char *text;
        int contacts;
    } table[] = {{FLAGGED("contact='disable'"), 0},
                 {FLAGGED("constraint='disable'"), 0},
                 {FLAGGED("contact='enable'"), 1},
                 {FLAGGED("limit='disable'"), 1}};
#undef FLAGGED
    static const kt_robot_options options = {.contacts = true};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, &options);
        kt_check_equal_int(table[i].text, scene->description.effect_count, table[i].contacts);
        kt_check_equal_int("warning", has_ranked_note(scene, KT_NOTE_RANK_MOTION, "turns contacts off"),
                           table[i].contacts == 0);
    }
}

/* A robot that moves beside a wall could touch this wall, although the wall belongs to the world, which carries the
 * robot. A box that is ground is touched, and needs no warning. */
KT_TEST(walls_beside_robots_are_a_warning) {
    static const kt_robot_options options = {.contacts = true, .has_ground = true};
    static const char wall[] = BOX_WORLD("<geom type='box' size='.1 2 1' pos='2 0 .1'/>", "<freejoint/>"),
                      floor[] = BOX_WORLD("<geom type='box' size='1 2 .1' pos='0 0 .1'/>", "<freejoint/>");
    kt_check_true("wall", has_ranked_note(test_robot(wall, &options), KT_NOTE_RANK_MOTION, "other geoms than planes"));
    kt_check_true("floor",
                  !has_ranked_note(test_robot(floor, &options), KT_NOTE_RANK_MOTION, "other geoms than planes"));
}

/* With contacts, limits act: an arm of 1 kg at 0.5 m falls on its stop and rests there within the softness of MuJoCo's
 * default. A time constant of 0.02 s under 9.81 rad/s^2 yields below 9.81 * 0.02^2 rad. */
KT_TEST(limits_act_with_contacts) {
    static const char arm[] =
        "<mujoco><compiler angle='radian'/><option gravity='0 0 -9.81'/><worldbody><body name='a'>"
        "<joint name='j' axis='0 1 0' range='-1 0.3'/><geom type='sphere' size='.05' mass='1' "
        "pos='.5 0 0'/></body></worldbody></mujoco>";
    static const kt_robot_options with = {.contacts = true}, without = {0};
    const kt_mechanism *m = run_file(kt_test_file(kt_test_folder(), "arm.xml", arm), &with, NULL, 5.0);
    kt_check_near("on the stop", positions_of(m, "a")[0], 0.3, 9.81 / 0.5 * 0.02 * 0.02);
    kt_check_true("a note", has_ranked_note(test_robot(arm, &with), KT_NOTE_RANK_START, "act as stops"));
    kt_check_true("a warning", has_ranked_note(test_robot(arm, &without), KT_NOTE_RANK_MOTION, "do not act"));
}
