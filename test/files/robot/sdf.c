/* Models in SDF: the result of each element, warnings, and faults at their places. The script
 * sdf_oracle.py compares places, inertias and axes with another reader. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m.sdf"
#include "robot.h"
#include "sdf_text.h"

#include "kinetree/kinetree.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

#define JOINT(name, type, parent, child, within)                                                                       \
    "<joint name='" name "' type='" type "'><parent>" parent "</parent><child>" child "</child>" within "</joint>"

static const kt_effect *find_effect(const kt_scene *scene, kt_effect_type type) {
    for (int i = 0; i < scene->description.effect_count; i++)
        if (scene->description.effects[i].type == type)
            return &scene->description.effects[i];
    (void)kt_check_true(kt_effect_type_name(type), false);
    return &scene->description.effects[0];
}

/* ---- what becomes of a model ------------------------------------------------------------------------------------- */

KT_TEST(link_without_joint_moves_freely_and_weighs_what_the_format_says) {
    kt_scene *scene = test_robot(SDF("<pose>1 2 3 0 0 0</pose>" LINK("a")), NULL);
    const kt_body *a = find_body(scene, "a");
    kt_check_equal_int("type", a->joint.type, KT_JOINT_FREE);
    kt_check_equal_bits("place", a->joint.position, (const double[]){1.0, 2.0, 3.0, 1.0}, 4);
    kt_check_equal_bits("mass", &a->mass, &(double){1.0}, 1);
    kt_check_equal_bits("inertia", &a->inertia.xx, (const double[]){1.0, 1.0, 1.0, 0.0, 0.0, 0.0}, 6);
    kt_check_equal_bits("gravity", &scene->description.gravity.x, (const double[]){0.0, 0.0, -9.8}, 3);
    kt_check_true("told to be free", has_note(scene, "links that move freely"));
    kt_check_true("told to weigh that",
                  has_note(scene, "defaults of the format (1 kg, 1 kg m^2; --density computes both from shapes): 1"));
}

/* The shapes give the centre and the ratios of the moments. */
KT_TEST(mass_next_to_auto_scales_what_the_shapes_give) {
#define AUTO(mass)                                                                                                     \
    SDF("<link name='a'><inertial auto='true'>" mass "<density>100</density></inertial><collision name='c'>"           \
        "<pose>1 0 0 0 0 0</pose><geometry><box><size>1 2 3</size></box></geometry></collision><collision name='d'>"   \
        "<density>300</density><geometry><sphere><radius>1</radius></sphere></geometry></collision></link>")
    const kt_body by_density = *find_body(test_robot(AUTO(""), NULL), "a");
    const kt_body by_mass = *find_body(test_robot(AUTO("<mass>7</mass>"), NULL), "a");
#undef AUTO
    kt_check_near("mass by densities", by_density.mass, 600.0 + 400.0 * acos(-1.0), 1e-12);
    kt_check_near("mass", by_mass.mass, 7.0, 0.0);
    kt_check_near("centre", by_mass.com.x, by_density.com.x, 1e-15);
    kt_check_near("inertia", by_mass.inertia.yy, by_density.inertia.yy * 7.0 / by_density.mass, 1e-13);
}

/* The name is the world's, even if others have it. */
KT_TEST(parent_world_is_the_world_and_no_link_or_joint_of_that_name) {
    static const char *const texts[] = {
        SDF(LINK("world")
                LINK("a") "<joint name='j' type='revolute'><parent>world</parent><child>a</child><axis><xyz>0 1 0"
                          "</xyz><initial_position>0.5</initial_position></axis></joint>"),
        SDF(LINK("a") "<joint name='world' type='revolute'><parent>world</parent><child>a</child><axis><xyz>0 1 0</xyz>"
                      "<initial_position>0.5</initial_position></axis></joint>")};
    for (int i = 0; i < 2; i++) {
        kt_scene *scene = test_robot(texts[i], NULL);
        const kt_body *a = find_body(scene, "a");
        kt_check_true("its parent is the world", a->parent == NULL);
        kt_check_equal_int("type", a->joint.type, KT_JOINT_REVOLUTE);
        kt_check_equal_bits("it starts where it says", a->joint.position, &(double){0.5}, 1);
        kt_check_true("told", has_note(scene, "links with the name 'world'") == (i == 0));
    }
}

/* Unread elements of the format for forces cause a warning. */
KT_TEST(decay_and_added_mass_are_warnings) {
    int warnings = 0;
    kt_scene *scene = test_robot(
        SDF("<link name='a'><inertial><mass>1</mass><fluid_added_mass><xx>1</xx></fluid_added_mass></inertial>"
            "<velocity_decay><linear>0.5</linear></velocity_decay></link>"),
        NULL);
    for (int i = 0; i < scene->note_count; i++)
        warnings +=
            scene->notes[i].rank == KT_NOTE_RANK_MOTION && strstr(scene->notes[i].what, "' is left out") != NULL;
    kt_check_equal_int("warnings", warnings, 2);
}

KT_TEST(joint_types_are_ours) {
    static const struct {
        const char *type;
        kt_joint_type ours;
        int bodies;
    } table[] = {
        {"revolute", KT_JOINT_REVOLUTE, 2},  {"continuous", KT_JOINT_REVOLUTE, 2}, {"prismatic", KT_JOINT_PRISMATIC, 2},
        {"fixed", KT_JOINT_FIXED, 2},        {"ball", KT_JOINT_SPHERICAL, 2},      {"screw", KT_JOINT_SCREW, 2},
        {"universal", KT_JOINT_REVOLUTE, 3}, {"revolute2", KT_JOINT_REVOLUTE, 3},  {"piston", KT_JOINT_PRISMATIC, 3}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot_of(
            NULL,
            SDF(LINK("a") LINK("b") JOINT("j", "%s", "a", "b",
                                          "<screw_thread_pitch>2</screw_thread_pitch><axis><xyz>0 2 0</xyz>"
                                          "</axis><axis2><xyz>1 0 0</xyz></axis2>")),
            table[i].type);
        const kt_joint *joint = &find_body(scene, "b")->joint;
        kt_check_equal_int(table[i].type, joint->type, table[i].ours);
        kt_check_equal_int("bodies", scene->description.body_count, table[i].bodies);
        if (table[i].ours == KT_JOINT_SCREW)
            kt_check_near("metres a radian", joint->pitch, 1.0 / acos(-1.0), DBL_EPSILON);
        kt_check_true("two axes are told", has_note(scene, "joints of two axes") == (table[i].bodies == 3));
    }
}

/* The link is turned by 90 degrees about z: the model's x is its -y. Until 1.4 an axis is in the model's frame, then in
 * the joint's. Until 1.6 the file may choose the model's frame. */
KT_TEST(axes_are_in_the_frame_that_the_version_says) {
    static const struct {
        const char *version, *within;
        bool of_model;
    } table[] = {{"1.4", "", true},
                 {"1.5", "", false},
                 {"1.6", "", false},
                 {"1.6", "<use_parent_model_frame>true</use_parent_model_frame>", true},
                 {"1.9", "", false}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot_of(
            NULL,
            "<sdf version='%s'><model name='m'>" LINK("a") "<link name='b'><pose>0 0 0 0 0 %.17g</pose></link>" JOINT(
                "j", "revolute", "a", "b", "<axis><xyz>1 0 0</xyz>%s</axis>") "</model></sdf>",
            table[i].version, 0.5 * acos(-1.0), table[i].within);
        const kt_vec3 axis = find_body(scene, "b")->joint.axis;
        kt_note("version %s %s", table[i].version, table[i].within);
        kt_check_near("x", axis.x, table[i].of_model ? 0.0 : 1.0, 1e-15);
        kt_check_near("y", axis.y, table[i].of_model ? -1.0 : 0.0, 1e-15);
    }
}

KT_TEST(forces_of_both_axes_act_in_their_joints) {
    const kt_robot_options stops = {.stop_stiffness = 1e4, .stop_damping = 2.0};
    kt_scene *scene =
        test_robot(SDF(LINK("a") LINK("b") JOINT(
                       "j", "universal", "a", "b",
                       "<axis><xyz>1 0 0</xyz><dynamics><damping>0.5</damping><friction>0.25</friction></dynamics>"
                       "<limit><lower>-inf</lower><upper>1.5</upper></limit></axis>"
                       "<axis2><xyz>0 1 0</xyz><dynamics><spring_stiffness>4</spring_stiffness><spring_reference>-1"
                       "</spring_reference></dynamics><limit><lower>-1e16</lower><upper>1e16</upper></limit></axis2>")),
                   &stops);
    const kt_effect *damper = find_effect(scene, KT_EFFECT_JOINT_DAMPER);
    const kt_effect *rub = find_effect(scene, KT_EFFECT_JOINT_FRICTION);
    const kt_effect *stop = find_effect(scene, KT_EFFECT_JOINT_LIMIT);
    const kt_effect *spring = find_effect(scene, KT_EFFECT_JOINT_SPRING);
    kt_check_equal_int("effects", scene->description.effect_count, 4);
    kt_check_equal_bits("numbers",
                        (const double[]){damper->damping, rub->coulomb, stop->lower, stop->upper, stop->stiffness,
                                         stop->damping, spring->stiffness, spring->rest.value},
                        (const double[]){0.5, 0.25, -(double)INFINITY, 1.5, 1e4, 2.0, 4.0, -1.0}, 8);
    kt_check_true("the first axis is one joint", strcmp(damper->joint, rub->joint) == 0);
    kt_check_true("the second another", strcmp(damper->joint, spring->joint) != 0);
}

KT_TEST(mimic_counts_from_its_reference) {
    kt_scene *scene =
        test_robot(SDF(LINK("a") LINK("b") LINK("c") JOINT("j", "revolute", "a", "b", "") JOINT(
                       "k", "revolute", "a", "c",
                       "<axis><xyz>0 0 1</xyz><mimic joint='j'><multiplier>-2</multiplier><offset>0.25</offset>"
                       "<reference>0.5</reference></mimic></axis>")),
                   NULL);
    kt_need(kt_check_equal_int("loops", scene->description.loop_count, 1));
    const kt_loop *loop = &scene->description.loops[0];
    kt_check_equal_int("type", loop->type, KT_LOOP_COUPLING);
    kt_check_equal_bits("q + 2 q' = 0.25 + 2 0.5",
                        (const double[]){loop->terms[0].coefficient, loop->terms[1].coefficient, loop->offset},
                        (const double[]){1.0, 2.0, 1.25}, 3);
}

/* A pair of gears on parallel axes: t2 = -3 t1. */
KT_TEST(gearbox_is_a_coupling_of_the_joints_between_its_links) {
    kt_scene *scene = test_robot(
        SDF(LINK("g") LINK("a") LINK("b") JOINT("w", "fixed", "world", "g", "")
                JOINT("j", "revolute", "g", "a", "<axis><xyz>0 1 0</xyz></axis>")
                    JOINT("k", "revolute", "g", "b", "<axis><xyz>0 -1 0</xyz></axis>")
                        JOINT("t", "gearbox", "a", "b",
                              "<gearbox_ratio>3</gearbox_ratio><gearbox_reference_body>g</gearbox_reference_body>"
                              "<axis><xyz>0 1 0</xyz></axis><axis2><xyz>0 1 0</xyz></axis2>")),
        NULL);
    kt_need(kt_check_equal_int("loops", scene->description.loop_count, 1));
    const kt_loop *loop = &scene->description.loops[0];
    kt_check_equal_int("terms", loop->term_count, 2);
    kt_check_equal_bits("-q_k + 3 q_j = 0",
                        (const double[]){loop->terms[0].coefficient, loop->terms[1].coefficient, loop->offset},
                        (const double[]){-1.0, 3.0, 0.0}, 3);
}

KT_TEST(gearbox_about_another_axis_is_told_and_left_out) {
    kt_scene *scene =
        test_robot(SDF(LINK("g") LINK("a") LINK("b") JOINT("j", "revolute", "g", "a", "")
                           JOINT("k", "revolute", "g", "b", "<axis><xyz>0 1 0</xyz></axis>")
                               JOINT("t", "gearbox", "a", "b",
                                     "<gearbox_reference_body>g</gearbox_reference_body><axis><xyz>0 0 1</xyz></axis>"
                                     "<axis2><xyz>0 0 1</xyz></axis2>")),
                   NULL);
    kt_check_equal_int("loops", scene->description.loop_count, 0);
    kt_check_true("told", has_note(scene, "gearboxes that are left out"));
}

#define CUT "<physics><simbody><must_be_loop_joint>true</must_be_loop_joint></simbody></physics>"

KT_TEST(joints_that_close_loops_are_loops_of_their_kind) {
    static const struct {
        const char *type;
        kt_loop_type ours;
    } table[] = {{"revolute", KT_LOOP_REVOLUTE},   {"prismatic", KT_LOOP_PRISMATIC}, {"fixed", KT_LOOP_WELD},
                 {"ball", KT_LOOP_SPHERICAL},      {"screw", KT_LOOP_SCREW},         {"universal", KT_LOOP_UNIVERSAL},
                 {"revolute2", KT_LOOP_UNIVERSAL}, {"piston", KT_LOOP_CYLINDRICAL}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot_of(
            NULL,
            SDF(LINK("a") LINK("b") JOINT("w", "ball", "world", "a", "") JOINT("v", "ball", "world", "b", "")
                    JOINT("loop", "%s", "a", "b",
                          CUT "<axis><xyz>1 0 0</xyz><dynamics><damping>1</damping></dynamics></axis>"
                              "<axis2><xyz>0 1 0</xyz></axis2>")),
            table[i].type);
        kt_check_equal_int("bodies", scene->description.body_count, 2);
        if (kt_check_equal_int("loops", scene->description.loop_count, 1))
            kt_check_equal_int(table[i].type, scene->description.loops[0].type, table[i].ours);
        kt_check_true("told", has_note(scene, "joints that close loops: 1"));
    }
}

/* The angle of `crank` after a while, with elastic stops at limits. */
static double crank_after(const char *text, double duration) {
    const kt_robot_options stops = {.stop_stiffness = 200.0};
    kt_error error = {0};
    kt_scene *scene = test_robot(text, &stops);
    kt_check_true("no force is lost", !has_note(scene, "springs and stops are left out"));
    kt_check_near("stop", find_effect(scene, KT_EFFECT_JOINT_LIMIT)->stiffness, 200.0, 0.0);
    const kt_model *model = kt_test_model(&scene->description, NULL);
    kt_simulation *simulation = kt_test_simulation(model, &scene->run, NULL);
    kt_need_fine("run", kt_simulation_advance(simulation, duration, &error), &error);
    return kt_simulation_positions(simulation)[kt_body_coordinates(model, kt_body_find(model, "crank")).q];
}

/* A linkage whose last joint has a spring, a damper, friction and limits. Either this joint or another closes the loop.
 */
#define MASS(at)                                                                                                       \
    "<inertial><pose>" at " 0 0 0</pose><inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial>"
#define BAR(name, at, com) "<link name='" name "'><pose>" at " 0 0 0</pose>" MASS(com) "</link>"
#define PIN(name, parent, child, within) JOINT(name, "revolute", parent, child, within "<axis><xyz>1 0 0</xyz></axis>")
#define FORCES                                                                                                         \
    "<dynamics><damping>0.5</damping><friction>0.2</friction><spring_stiffness>40</spring_stiffness>"                  \
    "<spring_reference>0.3</spring_reference></dynamics><limit><lower>-0.05</lower><upper>0.05</upper></limit>"
#define LINKAGE(cut, other, last)                                                                                      \
    SDF(BAR("crank", "0 0 0", "0 0 0.2") BAR("coupler", "0 0 0.4", "0 0.5 0") BAR("rocker", "0 1 0", "0 0 0.3")        \
            PIN("a", "world", "crank", "") PIN("b", "crank", "coupler", other)                                         \
                JOINT("c", last, "world", "rocker", cut "<axis><xyz>" AXIS "</xyz>" FORCES "</axis>")                  \
                    PIN("d", "coupler", "rocker", "<pose>0 0 0.4 0 0 0</pose>"))

KT_TEST(forces_act_in_joints_that_close_loops_as_in_others) {
    static const char *const texts[][2] = {
#define AXIS "1 0 0"
        {LINKAGE(CUT, "", "revolute"), LINKAGE("", CUT, "revolute")},
#undef AXIS
#define AXIS "0 1 0.2"
        {LINKAGE(CUT, "", "prismatic"), LINKAGE("", CUT, "prismatic")},
#undef AXIS
    };
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        const double in_loop = crank_after(texts[i][0], 0.3), in_tree = crank_after(texts[i][1], 0.3);
        kt_check_above("it moves, rad", fabs(in_tree), 0.02);
        kt_check_near("angle, rad", in_loop, in_tree, 1e-8);
    }
}

KT_TEST(forces_of_several_axes_in_a_loop_are_warnings) {
    static const char *const within[] = {"<dynamics><damping>1</damping></dynamics>",
                                         "<limit><lower>-1</lower><upper>1</upper></limit>", ""};
    for (int stop = 0; stop < 2; stop++)
        for (int i = 0; i < 3; i++) {
            const kt_robot_options options = {.stop_stiffness = 1e3 * stop};
            const kt_scene *scene = test_robot_of(
                &options,
                SDF(LINK("a") LINK("b") JOINT("w", "ball", "world", "a", "") JOINT("v", "ball", "world", "b", "") JOINT(
                    "u", "universal", "a", "b", CUT "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>0 1 0</xyz>%s</axis2>")),
                within[i]);
            kt_check_equal_int("lost", count_notes(scene, "springs and stops are left out"), i < 2);
            kt_check_true("with stops, too", !has_note(scene, "without --stops"));
        }
}

/* Two links on balls, with a hinge between them: a ball in the loop leaves three equations, and the hinge five. */
KT_TEST(joints_with_many_coordinates_close_loops) {
    kt_scene *scene = test_robot(SDF(LINK("a") LINK("b") JOINT("w", "ball", "world", "a", "")
                                         JOINT("v", "ball", "world", "b", "") JOINT("h", "revolute", "a", "b", "")),
                                 NULL);
    kt_need(kt_check_equal_int("loops", scene->description.loop_count, 1));
    kt_check_equal_int("type", scene->description.loops[0].type, KT_LOOP_SPHERICAL);
    kt_check_text("the second ball", scene->description.loops[0].name, "v");
    kt_check_text("the hinge carries", find_body(scene, "b")->parent, "a");
}

KT_TEST(joint_carries_its_parent_where_another_carries_the_child) {
    kt_scene *scene = test_robot(SDF(LINK("a") LINK("b") LINK("c") JOINT("j", "revolute", "a", "b", "")
                                         JOINT("k", "revolute", "c", "b", "<axis><xyz>0 1 0</xyz></axis>")),
                                 NULL);
    kt_check_text("on the child", find_body(scene, "c")->parent, "b");
    kt_check_near("about the opposite axis", find_body(scene, "c")->joint.axis.y, -1.0, DBL_EPSILON);
    kt_check_true("told", has_note(scene, "joints that carry their parent"));
}

KT_TEST(static_models_are_fixed_and_links_without_gravity_are_held) {
    kt_scene *scene = test_robot(
        "<sdf version='1.5'><world name='w'><physics type='ode'><gravity>0 0 -5</gravity></physics>"
        "<model name='s'><static>true</static>" LINK(
            "a") "</model><model name='f'><link name='a'>"
                 "<gravity>0</gravity><inertial><mass>2</mass><pose>0.5 0 0 0 0 0</pose></inertial></link></model>"
                 "</world></sdf>",
        NULL);
    kt_check_equal_int("fixed", find_body(scene, "s__a")->joint.type, KT_JOINT_FIXED);
    kt_check_equal_int("free", find_body(scene, "f__a")->joint.type, KT_JOINT_FREE);
    const kt_effect *force = find_effect(scene, KT_EFFECT_FORCE);
    kt_check_near("against the weight", force->value[2].value, 10.0, DBL_EPSILON);
    kt_check_near("at the centre of mass", force->between[0].at.x, 0.5, DBL_EPSILON);
}

KT_TEST(root_that_is_fixed_to_the_world_is_freed_by_floating) {
    const kt_robot_options floats = {.floating = true};
    kt_scene *scene =
        test_robot(SDF("<pose>0 0 2 0 0 0</pose>" LINK("a") JOINT("w", "fixed", "world", "a", "")), &floats);
    kt_check_equal_int("free", find_body(scene, "a")->joint.type, KT_JOINT_FREE);
    kt_check_near("where it stood", find_body(scene, "a")->joint.position[2], 2.0, DBL_EPSILON);
}

KT_TEST(inertias_that_no_body_has_are_judged_by_rigid_parts) {
    static const char text[] =
        SDF("<link name='a'><inertial><mass>5</mass></inertial></link><link name='imu'><inertial><mass>0.01</mass>"
            "<inertia><ixx>1e-6</ixx><iyy>1e-6</iyy><izz>1</izz></inertia></inertial></link>" JOINT("j", "%s", "a",
                                                                                                    "imu", ""));
    char part[900];
    kt_scene rejected;
    (void)snprintf(part, sizeof part, text, "fixed");
    const kt_scene *scene = test_robot(part, NULL);
    kt_check_equal_int("accepted", (int)scene->description.inertia_check, KT_INERTIA_ACCEPT);
    kt_check_true("told", has_note(scene, "impossible inertias of links, within rigid parts"));
    (void)snprintf(part, sizeof part, text, "revolute");
    kt_check_equal_int("rejected where it moves", parse(part, NULL, &rejected), KT_ERROR_SCENE);
    kt_check_contains("words", faults.text, "link 'imu': inertial: inertia: the principal moments are");
}

KT_TEST(picture_is_the_first_solid_wherever_its_frame_is) {
    kt_scene *scene = test_robot(
        SDF("<frame name='f'><pose>0 0 1 0 0 0</pose></frame><link name='a'><pose>0 0 0.25 0 0 0</pose>"
            "<visual name='m'><geometry><mesh><uri>x.dae</uri></mesh></geometry></visual><visual name='v'>"
            "<pose relative_to='f'>1 0 0 0 0 0</pose><geometry><box><size>1 2 3</size></box></geometry></visual>"
            "<collision name='c'><geometry><sphere><radius>1</radius></sphere></geometry></collision></link>"),
        NULL);
    const kt_shape *shape = &find_body(scene, "a")->shape;
    kt_check_equal_int("type", shape->type, KT_SHAPE_BOX);
    kt_check_equal_bits("size", &shape->size.x, (const double[]){1.0, 2.0, 3.0}, 3);
    kt_check_equal_bits("place", &shape->at.x, (const double[]){1.0, 0.0, 0.75}, 3);
    kt_check_true("meshes are told", has_note(scene, "1; the first: x.dae"));
    kt_check_true("contacts are told", has_note(scene, "falls, 4.9 m in the first second"));
}

KT_TEST(cones_are_drawn_as_cylinders_of_half_their_radius) {
    kt_scene *scene =
        test_robot(SDF("<link name='a'><visual name='v'><geometry><cone><radius>2</radius><length>3</length></cone>"
                       "</geometry></visual></link>"),
                   NULL);
    const kt_shape *shape = &find_body(scene, "a")->shape;
    kt_check_equal_int("type", shape->type, KT_SHAPE_CYLINDER);
    kt_check_equal_bits("radius", &shape->radius, (const double[]){1.0}, 1);
    kt_check_equal_bits("length", &shape->length, (const double[]){3.0}, 1);
    kt_check_true("told", has_note(scene, "cones, which pictures have as cylinders of half their radius: 1"));
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

KT_TEST(faults_are_told_at_their_places) {
    static const char *const wrong[][2] = {
        {"<sdf><model name='m'><link name='a'/></model></sdf>", "1:1: version: expected 1.0 to 1.12, found ''"},
        {"<sdf version='0.9'><model name='m'/></sdf>", "1:1: version: expected 1.0 to 1.12, found '0.9'"},
        {"<sdf version='1.9'/>", "1:1: there is no <model> and no <world>"},
        {SDF("<link/>"), "1:36: model 'm': link: the attribute 'name' is missing"},
        {SDF(LINK("a") LINK("a")), "1:52: model 'm': link 'a': the name is that of the link in line 1, too"},
        {SDF("<frame name='a'/>" LINK("a")), "frame 'a': the name is that of the link in line 1, too"},
        {SDF(LINK("arm") JOINT("j", "fixed", "world", "amr", "")), "child: 'amr' does not exist; did you mean 'arm'?"},
        {SDF(LINK("a") "<joint name='j' type='fixed'><child>a</child></joint>"), "joint 'j': <parent> is missing"},
        {SDF(LINK("a") JOINT("j", "hinge", "world", "a", "")), "there is no type 'hinge'; it is revolute"},
        {SDF(LINK("a") JOINT("j", "fixed", "a", "a", "")), "parent and child are the same link"},
        {SDF(LINK("a") JOINT("j", "revolute", "world", "a", "<axis><xyz>0 0 0</xyz></axis>")),
         "axis: xyz: the axis is zero"},
        {SDF(LINK("a") JOINT("j", "revolute", "world", "a", "<axis><xyz>0 1</xyz></axis>")),
         "axis: xyz: expected 3 numbers, found '0 1'"},
        {SDF(LINK("a") JOINT("j", "screw", "world", "a", "<thread_pitch>0</thread_pitch>")),
         "thread_pitch: the thread is zero radians a metre"},
        {SDF("<link name='a'><pose>1 2 3</pose></link>"), "pose: expected 6 numbers, found '1 2 3'"},
        {SDF("<link name='a'><pose rotation_format='euler'>0 0 0 0 0 0</pose></link>"), "there is no 'euler'"},
        {SDF("<link name='a'><pose rotation_format='quat_xyzw'>0 0 0 0 0 0 0</pose></link>"),
         "the norm of the quaternion is zero"},
        {SDF("<link name='a'><pose relative_to='b'/></link><frame name='b'><pose relative_to='a'/></frame>"),
         "poses are relative to each other in a circle"},
        {SDF(LINK("a") "<frame name='f' attached_to='g'/><frame name='g' attached_to='f'/>" JOINT("j", "fixed", "a",
                                                                                                  "f", "")),
         "circle"},
        {SDF("<model name='n'/>" LINK("a") JOINT("j", "fixed", "a", "n", "")), "child: this is attached to no link"},
        {SDF("<static>perhaps</static>" LINK("a")), "static: expected true or false, found 'perhaps'"},
        {SDF("<link name='a'><inertial><mass>-1</mass></inertial></link>"), "mass is -1"},
        {SDF(LINK("a") LINK("b") JOINT("w", "ball", "world", "a", "") JOINT("v", "ball", "world", "b", "")
                 JOINT("u", "universal", "a", "b", CUT "<axis><xyz>1 0 0</xyz></axis><axis2><xyz>1 1 0</xyz></axis2>")),
         "its axes are not normal to each other: the cosine is 0.707107"},
        {SDF("<include/>"), "include: <uri> is missing"},
        {"<!DOCTYPE sdf [<!ENTITY a 'b'>]><sdf version='1.9'/>", "a document type (<!DOCTYPE ...>) is not read"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        kt_scene scene;
        kt_check_true(wrong[i][0], parse(wrong[i][0], NULL, &scene) != KT_OK);
        kt_check_contains(wrong[i][0], faults.text, wrong[i][1]);
    }
}

/* ---- size -------------------------------------------------------------------------------------------------------- */

/* A chain of frames, each relative to the one before, in the opposite order; a joint for each: time is proportional. */
KT_TEST(long_chains_of_frames_and_joints_are_read_in_proportional_time) {
    enum { COUNT = 20000 };
    const size_t room = (size_t)COUNT * 260 + 200;
    char *text = malloc(room);
    size_t length = 0;
    if (text == NULL) {
        kt_check_true("memory", false);
        return;
    }
    length += (size_t)snprintf(text, room, "<sdf version='1.9'><model name='m'><link name='l0'/><frame name='f0'/>");
    for (int i = COUNT; i > 0; i--)
        length += (size_t)snprintf(
            text + length, room - length,
            "<frame name='f%d' attached_to='f%d'><pose>0 0 1 0 0 0</pose></frame><link name='l%d'><pose "
            "relative_to='f%d'"
            "/></link><joint name='j%d' type='revolute'><parent>l%d</parent><child>l%d</child></joint>",
            i, i - 1, i, i, i, i - 1, i);
    (void)snprintf(text + length, room - length, "</model></sdf>");
    kt_scene *scene = test_robot(text, NULL);
    kt_check_equal_int("bodies", scene->description.body_count, COUNT + 1);
    kt_check_near("the last on the one before", find_body(scene, "l20000")->joint.at.z, 1.0, 4.0 * DBL_EPSILON);
    free(text);
}

KT_TEST(comments_with_dashes_are_read_as_other_readers_do) {
    kt_scene *scene =
        test_robot("<sdf version='1.9'><!-- a -- b --- c --><model name='m'><link name='a'/></model></sdf>", NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 1);
}
