/* Masses that options give to robots: in every format they act, or are rejected by name. Closed forms: a box of edges
 * a, b, c has `m (b^2 + c^2) / 12` about its x, a ball `2/5 m r^2`. */
/* SPDX-License-Identifier: Apache-2.0 */
#define ROBOT "m"
#include "robot.h"

#include <float.h>

static const double pi = 3.14159265358979323846;

/* The first link has no mass. It has a box of `0.1 x 0.2 x 0.3` m at `(0, 0, 1)` and a ball of 0.1 m at the origin. The
 * second link has 2 kg. */
#define URDF                                                                                                           \
    "<robot name='r'><link name='base'/><link name='a'><visual><origin xyz='0 0 1'/><geometry><box size='0.1 0.2 0.3'" \
    "/></geometry></visual><visual><geometry><sphere radius='0.1'/></geometry></visual></link><link name='b'>"         \
    "<inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1' ixy='0' ixz='0' iyz='0'/></inertial></link>"          \
    "<joint name='j' type='continuous'><parent link='base'/><child link='a'/></joint>"                                 \
    "<joint name='k' type='continuous'><parent link='base'/><child link='b'/></joint></robot>"
#define MJCF                                                                                                           \
    "<mujoco><worldbody><body name='a'><joint/><geom type='box' size='0.05 0.1 0.15' pos='0 0 1'/><geom size='0.1'/>"  \
    "</body><body name='b'><joint/><inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/></body>"                        \
    "<body name='c'><joint/><geom size='0.1' density='500'/></body></worldbody></mujoco>"
#define SDF                                                                                                            \
    "<sdf version='1.9'><model name='m'><link name='a'><collision name='c'><pose>0 0 1 0 0 0</pose><geometry><box>"    \
    "<size>0.1 0.2 0.3</size></box></geometry></collision><collision name='d'><geometry><sphere><radius>0.1</radius>"  \
    "</sphere></geometry></collision></link><link name='b'><inertial><mass>2</mass></inertial></link>"                 \
    "<model name='n'><link name='c'/></model></model></sdf>"

static const char *const texts[] = {URDF, MJCF, SDF};

/* Mass, height of the centre and inertia about x of body a, whose solids have a density. */
static void check_solids(const kt_body *a, double density) {
    const double box = density * 0.006, ball = density * 4.0 / 3.0 * pi * 1e-3, mass = box + ball, z = box / mass;
    const double own = box * (0.04 + 0.09) / 12.0 + 0.4 * ball * 0.01;
    kt_vec3 com;
    kt_sym3 inertia;
    kt_need(kt_check_equal_int("inertia", kt_body_inertia(a, &com, &inertia, NULL), KT_OK));
    kt_check_near("mass", a->mass, mass, 4.0 * DBL_EPSILON * mass);
    kt_check_near("centre", com.z, z, 4.0 * DBL_EPSILON);
    kt_check_near("about x", inertia.xx, own + box * (1.0 - z) * (1.0 - z) + ball * z * z, 16.0 * DBL_EPSILON * mass);
}

/* A reduction that is a word gives no armature, and does not end the import. */
KT_TEST(transmission_by_a_word_is_told_and_left_out) {
    static const char text[] =
        "<robot name='r'><link name='base'/><link name='a'><inertial><mass value='2'/><inertia ixx='1' iyy='1' izz='1' "
        "ixy='0' ixz='0' iyz='0'/></inertial></link><joint name='j' type='continuous'><parent link='base'/>"
        "<child link='a'/></joint><transmission name='t'><joint name='j'/><actuator name='m'><mechanicalReduction>"
        "reduction</mechanicalReduction><rotorInertia>3</rotorInertia></actuator></transmission></robot>";
    kt_scene *scene = test_robot(text, NULL);
    kt_check_equal_bits("armature", find_body(scene, "a")->joint.armature, &(double){0.0}, 1);
    kt_check_true("told", has_note(scene, "transmissions with a reduction or an inertia that is no number"));
}

KT_TEST(density_acts_in_every_format_and_not_on_masses_that_the_file_gives) {
    const kt_robot_options options = {.density = 250.0};
    for (int i = 0; i < 3; i++) {
        kt_scene *scene = test_robot(texts[i], &options);
        check_solids(find_body(scene, "a"), 250.0);
        kt_check_equal_bits("that of the file", &find_body(scene, "b")->mass, &(double){2.0}, 1);
        kt_check_true("told", has_note(scene, "--density"));
        if (i == 1)
            kt_check_near("a density of the file", find_body(scene, "c")->mass, 500.0 * 4.0 / 3.0 * pi * 1e-3, 1e-15);
        if (i == 2)
            kt_check_equal_bits("no solids", &find_body(scene, "n__c")->mass, &(double){1.0}, 1);
    }
}

KT_TEST(masses_of_links_act_in_every_format) {
    static const char *const masses[][2] = {{"a=3", "b=8"}, {"b=8", "a=3"}};
    for (int i = 0; i < 3; i++) {
        const kt_robot_options options = {.masses = masses[i % 2], .mass_count = 2};
        kt_scene *scene = test_robot(texts[i], &options);
        const kt_body *b = find_body(scene, "b");
        kt_check_equal_bits("in place of another", &b->mass, &(double){8.0}, 1);
        kt_check_equal_bits("its inertia grows with it", &b->inertia.xx, &(double){4.0}, 1);
        kt_check_equal_bits("the other", &find_body(scene, "a")->mass, &(double){3.0}, 1);
        if (i == 0)
            check_solids(find_body(scene, "a"), 3.0 / (0.006 + 4.0 / 3.0 * pi * 1e-3));
        else {
            const kt_body *was = find_body(test_robot(texts[i], NULL), "a");
            kt_check_near("inertia as the mass", find_body(scene, "a")->inertia.xx / was->inertia.xx, 3.0 / was->mass,
                          4.0 * DBL_EPSILON * 3.0 / was->mass);
        }
    }
}

KT_TEST(links_of_nested_models_are_named_as_in_the_file_or_in_the_scene) {
    static const char *const names[] = {"n::c=5", "n__c=5"};
    for (int i = 0; i < 2; i++) {
        const kt_robot_options options = {.masses = &names[i], .mass_count = 1};
        kt_scene *scene = test_robot(SDF, &options);
        kt_check_equal_bits(names[i], &find_body(scene, "n__c")->mass, &(double){5.0}, 1);
    }
}

KT_TEST(body_between_two_axes_is_no_link) {
    static const char text[] = "<sdf version='1.9'><model name='m'><link name='a'/><joint name='f' type='universal'>"
                               "<parent>world</parent><child>a</child><axis><xyz>1 0 0</xyz></axis>"
                               "<axis2><xyz>0 1 0</xyz></axis2></joint></model></sdf>";
    const kt_robot_options options = {.masses = (const char *[]){"f=3"}, .mass_count = 1};
    kt_scene scene;
    kt_check_equal_int("status", parse(text, &options, &scene), KT_ERROR_SCENE);
    kt_check_contains("message", faults.text, "mass 'f=3': there is no link of this name");
}

KT_TEST(what_does_not_fit_is_rejected_by_name) {
    static const char *const wrong[] = {"x=1", "a=-1", "a"};
    for (int i = 0; i < 3; i++) {
        const kt_robot_options options = {.masses = wrong, .mass_count = 3}, key = {.keyframe = "home"};
        kt_scene scene;
        kt_check_equal_int("masses", parse(texts[i], &options, &scene), KT_ERROR_SCENE);
        kt_check_contains("no such link", faults.text, "mass 'x=1': there is no link of this name\n");
        kt_check_contains("no mass", faults.text, "mass 'a=-1': expected LINK=MASS, with a mass above zero\n");
        kt_check_contains("no sign", faults.text, "mass 'a': expected LINK=MASS");
        kt_check_equal_int("keyframe", parse(texts[i], &key, &scene), KT_ERROR_SCENE);
        kt_check_contains("words", faults.text,
                          i == 1 ? "there is no keyframe 'home'"
                                 : "keyframe 'home': there are keyframes in MJCF alone");
    }
}

KT_TEST(surfaces_that_mujoco_has_built_in_are_left_out_with_a_remedy) {
    static const char text[] =
        "<mujoco><asset><mesh name='h' builtin='hemisphere' params='0'/>"
        "<mesh name='t' builtin='none' vertex='0 0 0 .125 0 0 0 .125 0 0 0 .125'/></asset><worldbody><body name='a'>"
        "<joint/><geom size='.1'/><geom type='mesh' mesh='h'/></body><body name='c'><joint/><geom type='mesh' "
        "mesh='t'/>"
        "</body></worldbody></mujoco>";
    kt_scene *scene = test_robot(text, NULL);
    kt_check_near("of vertices, none is built in", find_body(scene, "c")->mass, 1000.0 / 3072.0, 1e-15);
    kt_check_true("warning", has_ranked_note(scene, KT_NOTE_RANK_MOTION,
                                             "surfaces that MuJoCo has built in, left out; its mj_saveLastXML writes "
                                             "their vertices: 1"));
    kt_check_true("mass",
                  has_note(scene, "is missing in 1 body (a), since the mesh has none (MuJoCo has it built in)"));
}

#define PI 3.14159265358979323846

/* A brick with the sides 0.2 m, 0.4 m and 0.6 m, off the origin. The box of the same inertia is the brick. By the box
 * around it, a sphere has the radius of the longest half side, and a cylinder about z that of the middle one. */
KT_TEST(solids_are_fitted_to_meshes) {
    static const struct {
        const char *setting, *geom;
        double mass;
    } table[] = {
        {"false", "type='box'", 48.0},
        {"false", "type='box' fitscale='2'", 8.0 * 48.0},
        {"false", "type='sphere'", 4000.0 / 3.0 * PI * 0.2 * 0.2 * 0.2},
        {"true", "type='box'", 48.0},
        {"true", "type='sphere'", 4000.0 / 3.0 * PI * 0.3 * 0.3 * 0.3},
        {"true", "type='cylinder'", 1000.0 * PI * 0.2 * 0.2 * 0.6},
        {"true", "type='box' mass='3'", 3.0},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot_of(
            NULL,
            "<mujoco><compiler fitaabb='%s'/><asset><mesh name='m' scale='0.2 0.2 0.2' vertex='5 10 15 6 10 15 "
            "5 12 15 6 12 15 5 10 18 6 10 18 5 12 18 6 12 18'/></asset><worldbody><body name='b'><joint/>"
            "<geom mesh='m' %s/></body></worldbody></mujoco>",
            table[i].setting, table[i].geom);
        const kt_body *b = find_body(scene, "b");
        kt_note("%s, fitaabb %s", table[i].geom, table[i].setting);
        kt_check_near("mass", b->mass, table[i].mass, 1e-12 * table[i].mass);
        kt_check_near("place along y", b->com.y, 2.2, 1e-13);
        if (strcmp(table[i].geom, "type='box'") == 0)
            kt_check_near("about z", b->inertia.zz, 48.0 / 12.0 * (0.04 + 0.16), 1e-12);
        kt_check_true("no mass is missing", !has_note(scene, "is missing"));
    }
}

KT_TEST(what_cannot_be_fitted_is_rejected) {
    static const struct {
        const char *geom, *message;
    } table[] = {
        {"type='plane' size='1 1 1'", "no plane and no field of heights can be fitted to a mesh"},
        {"type='capsule' fromto='0 0 0 1 0 0'", "fromto is not possible in a geom with a mesh"},
        {"type='box' fitscale='0'", "the solid that is fitted to the mesh has no extent along an axis"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[600];
        kt_scene scene;
        (void)snprintf(text, sizeof text,
                       "<mujoco><asset><mesh name='t' vertex='0 0 0 1 0 0 0 1 0 0 0 1'/></asset><worldbody><body>"
                       "<joint/><geom mesh='t' %s/></body></worldbody></mujoco>",
                       table[i].geom);
        kt_check_equal_int(table[i].geom, parse(text, NULL, &scene), KT_ERROR_SCENE);
        kt_check_contains("message", faults.text, table[i].message);
    }
}

/* With so few vertices, MuJoCo's hull is smaller. */
KT_TEST(hull_of_few_vertices_is_warned_of) {
    static const char *const faces[] = {"", " face='0 2 1 0 1 3 0 3 2 1 2 3'"};
    for (int i = 0; i < 2; i++) {
        kt_scene *scene =
            test_robot_of(NULL,
                          "<mujoco><asset><mesh name='t' vertex='0 0 0 1 0 0 0 1 0 0 0 1' maxhullvert='5'%s/></asset>"
                          "<worldbody><body><joint/><geom type='mesh' mesh='t'/></body></worldbody></mujoco>",
                          faces[i]);
        kt_check_equal_int("a hull alone", has_note(scene, "a hull with a bounded number of vertices"), i == 0);
    }
}

/* As in MuJoCo. Twice the volume is a sixth of the cube of an edge. */
KT_TEST(vertices_of_meshes_are_single_precision_numbers) {
    static const char text[] =
        "<mujoco><asset><mesh name='t' vertex='0 0 0 .1 0 0 0 .1 0 0 0 .1' scale='1 1 2'/></asset><worldbody>"
        "<body name='b'><joint/><geom type='mesh' mesh='t'/></body></worldbody></mujoco>";
    const double edge = (double)0.1f, mass = 1000.0 * edge * edge * edge / 3.0;
    kt_scene *scene = test_robot(text, NULL);
    kt_check_near("mass", find_body(scene, "b")->mass, mass, 8.0 * DBL_EPSILON * mass);
    kt_check_near("place along z", find_body(scene, "b")->com.z, 0.5 * edge, 8.0 * DBL_EPSILON);
}

KT_TEST(vertices_beyond_single_precision_are_reported) {
    static const char text[] =
        "<mujoco><asset><mesh name='t' vertex='0 0 0 1e39 0 0 0 1 0 0 0 1'/></asset><worldbody><body name='b'><joint/>"
        "<geom size='.1'/><geom type='mesh' mesh='t'/></body></worldbody></mujoco>";
    kt_scene *scene = test_robot(text, NULL);
    kt_check_true("named", has_note(scene, "(t: a vertex is beyond the range of single-precision numbers)"));
}

/* A field of heights without a name has that of its file. It weighs as a box with a quarter of its heights. */
KT_TEST(fields_of_heights_without_a_name_have_that_of_their_file) {
    static const char *const names[] = {"a", "b"};
    for (int i = 0; i < 2; i++) {
        kt_scene *scene = test_robot_of(
            NULL,
            "<mujoco><asset><hfield file='folder/a.png' size='1 2 .4 .2'/></asset><worldbody><body name='b'>"
            "<joint/><geom size='.1' mass='1'/><geom type='hfield' hfield='%s'/></body></worldbody></mujoco>",
            names[i]);
        const double mass = i == 0 ? 1.0 + 1000.0 * 8.0 * 1.0 * 2.0 * 0.2 : 1.0;
        kt_check_near("mass", find_body(scene, "b")->mass, mass, 1e-12 * mass);
        kt_check_equal_int("missing", has_note(scene, "(a field of heights without a size)"), i == 1);
    }
}

KT_TEST(meshes_of_plugins_are_warned_of_with_the_reason) {
    static const char text[] =
        "<mujoco><asset><mesh name='t'><plugin plugin='mujoco.sdf.torus'/></mesh></asset><worldbody><body name='b'>"
        "<joint/><geom size='.1'/><geom type='sdf' mesh='t'/></body></worldbody></mujoco>";
    kt_scene *scene = test_robot(text, NULL);
    kt_check_true("named", has_ranked_note(scene, KT_NOTE_RANK_MOTION,
                                           "(t: a plugin makes the mesh: give its body an <inertial>)"));
}

/* MuJoCo rejects these meshes. */
KT_TEST(meshes_without_mass_are_warned_of_with_the_reason) {
    static const char *const table[][2] = {
        {"face='0 1 2'", "(t: the mesh encloses no volume: inertia=\"shell\" gives it the mass of its surface)"},
        {"face='0 1 2 0 2 1' inertia='exact'", "(t: the mesh encloses no volume"},
        {"face='0 1 2 0 3 1 0 2 3 1 3 2' inertia='exact'",
         "(t: the triangles of the mesh face inwards: turn them, or give the mesh inertia=\"convex\" or \"legacy\")"},
        {"face='0 1 1' inertia='shell'", "(t: the triangles of the mesh have no area)"},
        {"face='0 2 1 0 1 3 0 3 2 1 2 3' scale='1 1 0' inertia='convex'",
         "(t: the vertices of the mesh are in one plane, so that their hull encloses nothing)"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot_of(
            NULL,
            "<mujoco><asset><mesh name='t' vertex='0 0 0 1 0 0 0 1 0 0 0 1' %s/></asset>"
            "<worldbody><body name='b'><joint/><geom size='.1'/><geom type='mesh' mesh='t'/></body></worldbody>"
            "</mujoco>",
            table[i][0]);
        for (int n = 0; n < scene->note_count; n++)
            if (has_note(scene, "the mass of geoms is missing") && strstr(scene->notes[n].what, "is missing") != NULL)
                kt_check_contains("reason", scene->notes[n].what, table[i][1]);
        kt_check_true("warned of",
                      has_ranked_note(scene, KT_NOTE_RANK_MOTION, "the mass of geoms is missing in 1 body"));
    }
}
