/* Names of links and joints in URDF that scenes cannot have: each gets one of its own, in linear time. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "r.urdf"
#include "robot.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

KT_TEST(names_that_scenes_cannot_have_are_changed_and_differ) {
    static const char *const expected[] = {"left_arm", "left_arm_2", "_7th", "world_2", "h_b"};
    kt_scene *scene = test_robot(
        "<robot name='r'><link name='left arm'/><link name='left/arm'/><link name='7th'/><link name='world'/>"
        "<link name='h&#228;b'/>"
        "<joint name='1' type='fixed'><parent link='left arm'/><child link='left/arm'/></joint>"
        "<joint name='2' type='fixed'><parent link='left arm'/><child link='7th'/></joint>"
        "<joint name='3' type='fixed'><parent link='left arm'/><child link='world'/></joint>"
        "<joint name='4' type='fixed'><parent link='world'/><child link='h&#228;b'/></joint></robot>",
        NULL);
    for (int i = 0; i < 4; i++)
        kt_check_text("name", scene->description.bodies[i].name, expected[i]);
    kt_check_equal_int("notes: of the root, of names of links, and of each joint", scene->note_count, 6);
    kt_check_text("of joints", scene->notes[2].what,
                  "joint '1' is called '_1', since names have letters, digits, _ and -, and each joint its own");
    kt_check_text("joint", scene->description.bodies[1].joint.name, "_1");
    kt_check_text("what", scene->notes[1].what,
                  "names of links that are not valid names of bodies, with '_' in place of invalid characters: 5");
    kt_check_text("a name in UTF-8: a byte, a '_'", scene->description.bodies[4].name, "h__b");
    kt_check_text("parent", scene->description.bodies[4].parent, "world_2");
}

/* In the order of the file; numbers of a name go on where its last one ended. */
KT_TEST(names_that_collide_get_numbers) {
    static const char *const names[][2] = {{"a b", "a_b"},      {"a.b", "a_b_2"},     {"a_b_2", "a_b_2_2"},
                                           {"a/b", "a_b_3"},    {"a_b.2", "a_b_2_3"}, {"world", "world_2"},
                                           {"wor.ld", "wor_ld"}};
    char text[4000] = "<robot name='r'><link name='base'/>";
    for (int i = 0; i < 7; i++)
        (void)snprintf(
            text + strlen(text), sizeof text - strlen(text),
            "<link name='%s'/><joint name='j%d' type='fixed'><parent link='base'/><child link='%s'/></joint>",
            names[i][0], i, names[i][0]);
    (void)snprintf(text + strlen(text), sizeof text - strlen(text), "</robot>");
    kt_scene *scene = test_robot(text, NULL);
    for (int i = 0; i < 7; i++)
        kt_check_text(names[i][0], scene->description.bodies[i + 1].name, names[i][1]);
}
