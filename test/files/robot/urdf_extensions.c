/* Extensions of URDF by Gazebo: numbers and words as the attribute `value` or as text. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "r.urdf"
#include "robot.h"

#include "kinetree/import.h"

#include <stdio.h>

#define MASS "<inertial><mass value='1'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial>"

/* A ball on a slider above the ground. */
static kt_scene *read_extended(const char *extensions) {
    static const kt_robot_options options = {.contacts = true, .has_ground = true};
    return test_robot_of(&options,
                         "<robot name='r'><link name='a'/><link name='b'>" MASS
                         "<collision><geometry><sphere radius='0.1'/></geometry></collision></link><joint name='j' "
                         "type='prismatic'><parent link='a'/><child link='b'/><axis xyz='0 0 1'/><origin xyz='0 0 1'/>"
                         "</joint>%s</robot>",
                         extensions);
}

static const kt_effect *find_extended(const kt_scene *scene, kt_effect_type type) {
    for (int i = 0; i < scene->description.effect_count; i++)
        if (scene->description.effects[i].type == type)
            return &scene->description.effects[i];
    return NULL;
}

KT_TEST(extensions_have_their_value_as_an_attribute_or_as_text) {
    static const char attributes[] =
        "<gazebo reference='j'><springStiffness value='5'/><springReference value='0.1'/></gazebo>"
        "<gazebo reference='b'><mu1 value='0.25'/><mu2 value='9'/><turnGravityOff value='true'/></gazebo>"
        "<gazebo><static value='True'/></gazebo>";
    static const char texts[] =
        "<gazebo reference='j'><springStiffness>5</springStiffness><springReference>0.1</springReference></gazebo>"
        "<gazebo reference='b'><mu>0.25</mu><gravity value=' False '>true</gravity></gazebo>"
        "<gazebo><static>YES</static></gazebo>";
    static const char both[] =
        "<gazebo reference='j'><springStiffness value='5'>6</springStiffness><springReference value='0.1'/></gazebo>"
        "<gazebo reference='b'><mu value='0.25'/><gravity>0</gravity></gazebo><gazebo><static value='1'/></gazebo>";
    static const char *const forms[] = {attributes, texts, both};
    for (size_t i = 0; i < sizeof forms / sizeof *forms; i++) {
        const kt_scene *scene = read_extended(forms[i]);
        const kt_effect *spring = find_extended(scene, KT_EFFECT_JOINT_SPRING);
        const kt_effect *contact = find_extended(scene, KT_EFFECT_CONTACT);
        kt_need(kt_check_true("spring", spring != NULL));
        kt_check_near("stiffness", spring->stiffness, 5.0, 0.0);
        kt_check_near("rest", spring->rest.value, 0.1, 0.0);
        if (kt_check_true("contact", contact != NULL))
            kt_check_near("friction", contact->friction, 0.25, 0.0);
        kt_check_true("no weight", find_extended(scene, KT_EFFECT_FORCE) != NULL);
        kt_check_true("static", has_ranked_note(scene, KT_NOTE_RANK_MOTION, "'static' is left out: 1"));
        kt_check_true("all are known", !has_note(scene, "not known") && !has_note(scene, "'value'"));
    }
}

KT_TEST(extensions_that_move_the_robot_are_warnings) {
    static const char *const extensions[][2] = {
        {"<gazebo><joint name='k' type='revolute'><parent>a</parent><child>b</child></joint></gazebo>", "joint"},
        {"<gazebo><link name='c'/></gazebo>", "link"},
        {"<gazebo><joint:hinge name='k'/></gazebo>", "joint:hinge"},
        {"<gazebo reference='b'><kinematic>true</kinematic></gazebo>", "kinematic"},
        {"<gazebo reference='b'><enable_wind>true</enable_wind></gazebo>", "enable_wind"},
        {"<loop_joint name='k'/>", "loop_joint"},
        {"<drake:joint name='k' type='ball'/>", "drake:joint"},
        {"<drake:ball_constraint/>", "drake:ball_constraint"}};
    for (size_t i = 0; i < sizeof extensions / sizeof *extensions; i++) {
        char warning[100];
        (void)snprintf(warning, sizeof warning, "'%s' is left out: 1", extensions[i][1]);
        const kt_scene *scene = read_extended(extensions[i][0]);
        kt_check_true(warning, has_ranked_note(scene, KT_NOTE_RANK_MOTION, warning));
    }
    const kt_scene *scene =
        read_extended("<gazebo reference='b'><kinematic>false</kinematic><enable_wind>0</enable_wind></gazebo>");
    kt_check_true("what is off is not left out", !has_note(scene, "'kinematic'") && !has_note(scene, "'enable_wind'"));
}

/* In sdformat, any `turnGravityOff` but false, no and 0 takes the weight away. Of `gravity`, these words do. */
KT_TEST(only_words_for_no_decide_about_weight) {
    static const struct {
        const char *extension;
        bool is_light;
    } table[] = {{"<turnGravityOff value='NO'/>", false},
                 {"<turnGravityOff>False</turnGravityOff>", false},
                 {"<turnGravityOff>0</turnGravityOff>", false},
                 {"<turnGravityOff>TrUe</turnGravityOff>", true},
                 {"<turnGravityOff>on</turnGravityOff>", true},
                 {"<gravity value='1'/>", false},
                 {"<gravity/>", false},
                 {"<gravity>nonsense</gravity>", false},
                 {"<gravity>TRUE</gravity>", false},
                 {"<gravity>no</gravity>", true},
                 {"<gravity value='FALSE'/>", true}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[200];
        (void)snprintf(text, sizeof text, "<gazebo reference='b'>%s</gazebo>", table[i].extension);
        const kt_scene *scene = read_extended(text);
        kt_check_equal_int(table[i].extension, find_extended(scene, KT_EFFECT_FORCE) != NULL, table[i].is_light);
    }
}

KT_TEST(friction_below_zero_is_ignored_and_mu1_counts_before_mu) {
    static const struct {
        const char *extension;
        double friction;
    } table[] = {{"<mu1>-0.5</mu1>", 1.0},
                 {"<mu value='-2'/>", 1.0},
                 {"<mu1>0.5</mu1><mu>0.75</mu>", 0.5},
                 {"<mu>0.75</mu><mu1>-1</mu1>", 0.75},
                 {"<mu1>0</mu1>", 0.0}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[200];
        (void)snprintf(text, sizeof text, "<gazebo reference='b'>%s</gazebo>", table[i].extension);
        const kt_scene *scene = read_extended(text);
        const kt_effect *contact = find_extended(scene, KT_EFFECT_CONTACT);
        if (kt_check_true(table[i].extension, contact != NULL))
            kt_check_near("friction", contact->friction, table[i].friction, 0.0);
    }
}

KT_TEST(unreadable_numbers_of_extensions_are_left_out_with_a_warning) {
    const kt_scene *scene =
        read_extended("<gazebo reference='b'><mu1>high</mu1></gazebo><gazebo reference='j'><springStiffness value=''/>"
                      "<springReference/></gazebo>");
    static const char *const words[] = {"'mu1' is left out: 1", "'springStiffness' is left out: 1",
                                        "'springReference' is left out: 1"};
    for (size_t i = 0; i < sizeof words / sizeof *words; i++)
        kt_check_true(words[i], has_ranked_note(scene, KT_NOTE_RANK_MOTION, words[i]));
    const kt_effect *contact = find_extended(scene, KT_EFFECT_CONTACT);
    if (kt_check_true("contact", contact != NULL))
        kt_check_near("friction", contact->friction, 1.0, 0.0);
}
