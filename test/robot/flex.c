/* Flexible bodies of MJCF: points, edges, files and faults. Masses, bias forces and dampers are compared with those of
 * MuJoCo (mujoco_wasm.c, flex.xml and flexes.xml). */
#define ROBOT "m"
#include "robot.h"

#include "../folder.h"
#include "node.h"
#include "run_file.h"

#include "kinetree/kinetree.h"

#include <math.h>
#include <stdint.h>

#define FLEX(attributes, content)                                                                                      \
    "<mujoco><worldbody><body name='b'><flexcomp name='f' " attributes ">" content "</flexcomp></body></worldbody>"    \
    "</mujoco>"

/* ---- points and edges -------------------------------------------------------------------------------------------- */

/* A circle of seven points, of which one is pinned, and edges of constant length. */
KT_TEST(edges_of_constant_length_are_distances) {
    kt_scene *scene = test_robot(
        FLEX("type='circle' dim='1' count='8 1 1' spacing='.1 .1 .1'", "<edge equality='true'/><pin id='2'/>"), NULL);
    const kt_description *d = &scene->description;
    kt_check_equal_int("bodies", d->body_count, 1 + 6 * 3);
    kt_check_equal_int("edges", d->loop_count, 7);
    for (int i = 0; i < d->loop_count; i++) {
        double length[3] = {0.0};
        kt_check_equal_int("type", (int)d->loops[i].type, KT_LOOP_DISTANCE);
        kt_check_equal_int("function", kt_function_evaluate(&d->loops[i].function, 0.0, length, NULL), KT_OK);
        kt_check_near("length", length[0], 0.1, 1e-15);
    }
}

/* Contacts are those of a sphere at each point that moves. */
KT_TEST(points_of_cables_touch_planes) {
    static const char text[] =
        "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body name='b' pos='0 0 1'><flexcomp name='f' dim='1' "
        "type='grid' count='5 1 1' radius='.004'><contact friction='.4'/><pin id='0'/></flexcomp></body></worldbody>"
        "</mujoco>";
    const kt_robot_options options = {.contacts = true};
    kt_scene *scene = test_robot(text, &options);
    kt_check_equal_int("contacts", scene->description.effect_count, 4);
    for (int i = 0; i < scene->description.effect_count; i++)
        kt_check_near("radius", scene->description.effects[i].radius, 0.004, 0.0);
}

/* A square has five edges, of which a damper acts in each that a pin does not hold at both ends. */
KT_TEST(edges_of_surfaces_are_those_of_all_triangles) {
    kt_scene *scene =
        test_robot(FLEX("count='3 2 1' spacing='.1 .1 .1'", "<edge damping='1'/><pin grid='0 0 0 1'/>"), NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 1 + 4 * 3);
    kt_check_equal_int("dampers", scene->description.effect_count, 9 - 1);
}

/* Points 1 and 3 are in no element. The pin is that of point 2. */
KT_TEST(points_without_an_element_vanish) {
    kt_scene *scene = test_robot(
        FLEX("type='direct' dim='2' mass='3' point='0 0 0 9 9 9 .1 0 0 8 8 8 0 .2 0' element='0 2 4'", "<pin id='2'/>"),
        NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 1 + 2 * 3);
    kt_check_near("mass", find_body(scene, "f_2")->mass, 1.0, 1e-15);
}

KT_TEST(points_without_a_radius_have_no_shape) {
    kt_scene *scene = test_robot(FLEX("count='3 3 1' radius='0'", ""), NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 1 + 9 * 3);
    kt_check_true("no contact is left out", !has_note(scene, "could touch"));
}

/* ---- soft equalities --------------------------------------------------------------------------------------------- */

enum { SPRINGS_NV = 3 };

/* A triangle with two pins, whose third point is stretched by x along its edge to the first: the force along it. */
static double force_of_edge(const char *text, double x) {
    const double q[SPRINGS_NV] = {x, 0.0, 0.0}, v[SPRINGS_NV] = {0.0};
    double forces[SPRINGS_NV] = {(double)NAN, 0.0, 0.0};
    kt_error error = {0};
    const kt_opened flex = kt_test_open(test_robot(text, NULL), NULL);
    kt_need(kt_check_equal_int("degrees of freedom", kt_model_nv(flex.model), SPRINGS_NV));
    kt_need_fine("forces", kt_effect_forces(flex.model, flex.data, 0.0, q, v, forces, &error), &error);
    return -forces[0];
}

/* MuJoCo's law at rest: k d(x)^2 x = (1 - d(x)) A f with the mobility A of both ends, k = 1 / (dmax^2 T^2 z^2). The
 * impedance is constant here, so that x follows at once. The second edge is at a right angle and adds nothing to first
 * order. */
KT_TEST(soft_edges_yield_as_much_as_those_of_mujoco) {
    static const struct {
        const char *text;
        double d, time, ratio, mass;
    } table[] = {
        {FLEX("type='direct' dim='2' mass='6' point='0 0 0 .5 0 0 .5 .7 0' element='0 1 2'",
              "<edge equality='true' solimp='.8 .8 .001' solref='.05 .7'/><pin id='0 2'/>"),
         0.8, 0.05, 0.7, 2.0},
        {FLEX("type='direct' dim='2' mass='6' point='0 0 0 .5 0 0 .5 .7 0' element='0 1 2'",
              "<edge equality='vert' solimp='.95 .95 .001' solref='.001 1'/><pin id='0 2'/>"),
         0.95, 0.004, 1.0, 2.0}, /* at least two steps of 2 ms */
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const double d = table[i].d, t = table[i].time, z = table[i].ratio, k = 1.0 / (d * d * t * t * z * z);
        const double stiffness = table[i].mass * k * d * d / (1.0 - d), x = 1e-6;
        kt_check_near("force, N", force_of_edge(table[i].text, x), stiffness * x, 1e-5 * stiffness * x);
    }
}

/* As in MuJoCo, a solref of mixed signs is replaced with its default. */
KT_TEST(edges_with_a_solref_of_mixed_signs_have_the_default) {
#define TRIANGLE(reference)                                                                                            \
    FLEX("type='direct' dim='2' mass='6' point='0 0 0 .5 0 0 .5 .7 0' element='0 1 2'",                                \
         "<edge equality='true' solref='" reference "'/><pin id='0 2'/>")
    static const char *const texts[] = {TRIANGLE("0.02 0"), TRIANGLE("-100 1")};
    const double standard = force_of_edge(TRIANGLE("0.02 1"), 1e-6);
    for (size_t i = 0; i < sizeof texts / sizeof *texts; i++) {
        kt_check_near("force, N", force_of_edge(texts[i], 1e-6), standard, 0.0);
        kt_scene *scene = test_robot(texts[i], NULL);
        kt_check_true("warning", has_ranked_note(scene, KT_NOTE_RANK_MOTION, "solref of which one number alone"));
    }
#undef TRIANGLE
}

/* A cloth that hangs from its upper edge, at rest after 4 s here and in MuJoCo: the lowest corner, m. */
KT_TEST(a_hanging_cloth_sags_as_in_mujoco) {
    enum { COORDINATES = 12 * 3 };
    static const char text[] =
        "<mujoco><worldbody><body name='b' pos='0 0 1' euler='90 0 0'><flexcomp name='f' count='4 4 1' dim='2' "
        "spacing='.1 .1 .1' radius='.001' mass='1'><edge equality='true'/><pin gridrange='0 3 3 3'/><contact "
        "selfcollide='none' internal='false'/></flexcomp></body></worldbody><keyframe><key name='k' time='0'/>"
        "</keyframe></mujoco>";
    const char *path = kt_test_file(kt_test_folder(), "m.xml", text);
    const kt_run run = {.duration = 4.0, .integrator = "radau5", .relative = 1e-9, .absolute = 1e-9};
    double theirs[1 + COORDINATES] = {0.0};
    int count = 0;
    if (!has_mujoco())
        return;
    FILE *from = ask_mujoco("rest=4", &path, 1);
    if (from != NULL && is_read_by_mujoco(from, path))
        for (int i = 0; i <= COORDINATES && count == i; i++)
            count += fscanf(from, "%lf", &theirs[i]);
    kt_check_equal_int("numbers", count, 1 + COORDINATES);
    if (from != NULL)
        end_answers(from);
    kt_check_above("theirs", -theirs[2], 1e-3);
    kt_check_near("ours", *positions_of(run_file(path, NULL, &run, 4.0), "f_0_joint_2"), theirs[2],
                  0.05 * fabs(theirs[2]));
}

/* ---- files of Gmsh ----------------------------------------------------------------------------------------------- */

/* A file of Gmsh while it is written, as text or bytes. */
typedef struct gmsh_file {
    char text[4000];
    size_t size;
    bool is_binary;
} gmsh_file;

static void put_word(gmsh_file *g, const char *word) {
    g->size += (size_t)snprintf(g->text + g->size, sizeof g->text - g->size, "%s", word);
}

static void put_bytes(gmsh_file *g, const void *from, size_t size) {
    memcpy(g->text + g->size, from, size);
    g->size += size;
}

/* An integer of 4 or 8 bytes. */
static void put_integer(gmsh_file *g, int value, int bytes, const char *after) {
    const int32_t small = value;
    const uint64_t large = (uint64_t)value;
    if (g->is_binary) {
        put_bytes(g, bytes == 4 ? (const void *)&small : (const void *)&large, (size_t)bytes);
        return;
    }
    char word[40];
    (void)snprintf(word, sizeof word, "%d%s", value, after);
    put_word(g, word);
}

static void put_point(gmsh_file *g, const double *p) {
    char word[120];
    if (g->is_binary) {
        put_bytes(g, p, 3 * sizeof *p);
        return;
    }
    (void)snprintf(word, sizeof word, "%.17g %.17g %.17g\n", p[0], p[1], p[2]);
    put_word(g, word);
}

static const double gmsh_points[5][3] = {
    {0.0, 0.0, 0.0}, {0.1, 0.0, 0.0}, {0.0, 0.12, 0.0}, {0.0, 0.0, 0.3}, {0.1, 0.2, 0.3}};
static const int gmsh_elements[2][4] = {{1, 2, 3, 4}, {2, 3, 4, 5}};

static void write_gmsh_2(gmsh_file *g) {
    put_word(g, g->is_binary ? "$MeshFormat\n2.2 1 8\n\1\n$EndMeshFormat\n" : "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n");
    put_word(g, "$Nodes\n5\n");
    for (int i = 0; i < 5; i++) {
        put_integer(g, i + 1, 4, " ");
        put_point(g, gmsh_points[i]);
    }
    put_word(g, "\n$EndNodes\n$Elements\n2\n");
    for (int i = 0; i < 2; i++) {
        if (!g->is_binary)
            put_integer(g, i + 1, 4, " ");
        put_integer(g, 4, 4, " "); /* a tetrahedron */
        if (g->is_binary)
            put_integer(g, 1, 4, " ");
        put_integer(g, 2, 4, " ");
        if (g->is_binary)
            put_integer(g, i + 1, 4, " ");
        put_integer(g, 0, 4, " ");
        put_integer(g, 1, 4, " ");
        for (int k = 0; k < 4; k++)
            put_integer(g, gmsh_elements[i][k], 4, k < 3 ? " " : "\n");
    }
    put_word(g, "\n$EndElements\n");
}

static void put_block(gmsh_file *g, int count, int type) {
    const int sizes[4] = {1, count, 1, count};
    for (int i = 0; i < 4; i++)
        put_integer(g, sizes[i], 8, " ");
    put_integer(g, 3, 4, " ");
    put_integer(g, 1, 4, " ");
    put_integer(g, type, 4, " ");
    put_integer(g, count, 8, "\n");
}

static void write_gmsh_4(gmsh_file *g) {
    put_word(g, g->is_binary ? "$MeshFormat\n4.1 1 8\n\1\n$EndMeshFormat\n" : "$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
    put_word(g, "$Nodes\n");
    put_block(g, 5, 0);
    for (int i = 0; i < 5; i++)
        put_integer(g, i + 1, 8, "\n");
    for (int i = 0; i < 5; i++)
        put_point(g, gmsh_points[i]);
    put_word(g, "\n$EndNodes\n$Elements\n");
    put_block(g, 2, 4);
    for (int i = 0; i < 2; i++) {
        put_integer(g, i + 1, 8, " ");
        for (int k = 0; k < 4; k++)
            put_integer(g, gmsh_elements[i][k], 8, k < 3 ? " " : "\n");
    }
    put_word(g, "\n$EndElements\n");
}

/* A model with the first `size` bytes of a file. */
static kt_status read_gmsh(const char *folder, const gmsh_file *g, size_t size, kt_scene *scene) {
    char path[400];
    kt_error error = {0};
    (void)snprintf(path, sizeof path, "%s/part.msh", folder);
    FILE *file = fopen(path, "wb");
    kt_check_true("the file is written", file != NULL && fwrite(g->text, 1, size, file) == size && fclose(file) == 0);
    (void)kt_test_file(folder, "m.xml",
                       FLEX("type='gmsh' dim='3' file='part.msh' mass='5' scale='1 2 1'", "<edge damping='1'/>"));
    (void)snprintf(path, sizeof path, "%s/m.xml", folder);
    return kt_robot_read(path, NULL, scene, NULL, NULL, &error);
}

static void check_gmsh(const kt_scene *scene) {
    kt_check_equal_int("bodies", scene->description.body_count, 1 + 5 * 3);
    kt_check_equal_int("edges", scene->description.effect_count, 9);
    for (int i = 0; i < 5; i++) {
        char name[20];
        (void)snprintf(name, sizeof name, "f_%d", i);
        const kt_body *b = find_body(scene, name);
        kt_check_near("mass", b->mass, 1.0, 1e-15);
    }
}

/* Sums the places of the bodies that the file of a folder makes. */
static double place_sum(const kt_scene *scene) {
    double sum = 0.0;
    for (int i = 0; i < scene->description.body_count; i++) {
        const kt_vec3 p = scene->description.bodies[i].joint.at;
        sum += p.x + 3.0 * p.y + 7.0 * p.z;
    }
    return sum;
}

/* Both formats of Gmsh, as text and as bytes. Each file that is cut short is left out, with a warning. */
KT_TEST(files_of_gmsh_have_points_and_elements_in_both_formats) {
    const char *folder = kt_test_folder();
    for (int kind = 0; kind < 4; kind++) {
        gmsh_file g = {.is_binary = kind % 2 == 1};
        kt_scene scene;
        int left_out = 0, cuts = 0;
        (kind < 2 ? write_gmsh_2 : write_gmsh_4)(&g);
        kt_note("%s, %s", kind < 2 ? "2.2" : "4.1", g.is_binary ? "bytes" : "text");
        kt_need(kt_check_equal_int("status", read_gmsh(folder, &g, g.size, &scene), KT_OK));
        double expected = 0.0;
        check_gmsh(&scene);
        for (int i = 0; i < 5; i++)
            expected += gmsh_points[i][0] + 6.0 * gmsh_points[i][1] + 7.0 * gmsh_points[i][2];
        kt_check_near("places", place_sum(&scene), expected, 1e-14);
        kt_scene_free(&scene);
        for (size_t size = 0; size + strlen("$EndElements\n") < g.size; size += 3, cuts++)
            if (read_gmsh(folder, &g, size, &scene) == KT_OK) {
                left_out += has_ranked_note(&scene, KT_NOTE_RANK_MOTION, "flexcomps whose file cannot be read");
                kt_scene_free(&scene);
            }
        kt_check_equal_int("files that are cut short, left out", left_out, cuts);
    }
}

/* Coordinates that are not finite, and numbers of points or elements that are too large, are rejected at their place. A
 * number that the file is too short for is none of these. */
KT_TEST(faults_of_files_of_gmsh_have_their_place) {
    static const struct {
        const char *points, *elements, *message;
    } table[] = {
        {"3\n1 0 0 0\n2 1 0 0\n3 0 nan 0\n", "1\n1 2 0 1 2 3\n", "part.msh:8: point 3 has a coordinate that is not "},
        {"3\n1 0 0 0\n2 1 0 inf\n3 0 1 0\n", "1\n1 2 0 1 2 3\n", "part.msh:7: point 2 has a coordinate that is not "},
        {"3\n1 1e999 0 0\n2 1 0 0\n3 0 1 0\n", "1\n1 2 0 1 2 3\n", "part.msh:6: point 1 has a coordinate that is "},
        {"17000000\n1 0 0 0\n", "1\n1 2 0 1 2 3\n", "has 17000000 points or elements; expected 1 to 16777216"},
        {"3\n1 0 0 0\n2 1 0 0\n3 0 1 0\n", "2e8\n1 2 0 1 2 3\n", "has 200000000 points or elements; expected"},
        {"16000000\n1 0 0 0\n2 1 0 0\n3 0 1 0\n", "1\n1 2 0 1 2 3\n", NULL},
    };
    const char *folder = kt_test_folder();
    char path[400], text[400];
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = kt_test_scene_place();
        kt_error error = {0};
        (void)snprintf(text, sizeof text,
                       "$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n%s$EndNodes\n$Elements\n%s$EndElements\n",
                       table[i].points, table[i].elements);
        (void)kt_test_file(folder, "part.msh", text);
        (void)kt_test_file(folder, "m.xml", FLEX("type='gmsh' file='part.msh'", ""));
        (void)snprintf(path, sizeof path, "%s/m.xml", folder);
        const kt_status status = kt_robot_read(path, NULL, scene, NULL, NULL, &error);
        kt_check_equal_int("status", status, table[i].message != NULL ? KT_ERROR_SCENE : KT_OK);
        if (table[i].message != NULL)
            kt_check_contains("message", error.message, table[i].message);
        if (status == KT_OK) {
            kt_check_true("left out",
                          has_ranked_note(scene, KT_NOTE_RANK_MOTION, "flexcomps whose file cannot be read"));
        }
    }
}

/* Points and elements of lines; surfaces of lines are left out. */
KT_TEST(lines_of_obj_are_edges) {
    static const struct {
        const char *attributes;
        int bodies, edges;
    } table[] = {{FLEX("type='mesh' dim='1' file='l.obj'", "<edge damping='1'/>"), 1 + 4 * 3, 3},
                 {FLEX("type='mesh' dim='2' file='l.obj'", "<edge damping='1'/>"), 1, 0}};
    const char *folder = kt_test_folder();
    (void)kt_test_file(folder, "l.obj", "v 0 0 0\nv 2 0 0\nv 1 0 0\nv 3 0 0\nl 1 3 2\nl 2 4\n");
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot_file(kt_test_file(folder, "m.xml", table[i].attributes), NULL);
        kt_check_equal_int("bodies", scene->description.body_count, table[i].bodies);
        kt_check_equal_int("edges", scene->description.effect_count, table[i].edges);
        kt_check_equal_int("left out", has_note(scene, "it has lines alone, which need dim="), i == 1);
    }
}

/* MuJoCo drops a flex with pins in the world of an attached model. Elasticity of what is not attached is no matter. */
KT_TEST(elasticity_of_attached_flexcomps_acts) {
    static const char part[] =
        "<mujoco model='p'><worldbody><flexcomp name='f' count='2 2 1'><elasticity young='1e3' thickness='.1' "
        "elastic2d='stretch'/><pin id='0'/></flexcomp><body name='b'><flexcomp name='g' count='2 2 1'><elasticity "
        "young='1e3' thickness='.1' elastic2d='stretch'/><pin id='0'/></flexcomp></body></worldbody></mujoco>";
    static const struct {
        const char *attach;
        int effects, pins; /* two triangles with three edges each have a force */
    } table[] = {{"<attach model='p' prefix='p_'/>", 12, 1}, {"<attach model='p' body='b' prefix='p_'/>", 6, 0}};
    const char *folder = kt_test_folder();
    char path[400], text[400];
    (void)kt_test_file(folder, "p.xml", part);
    (void)snprintf(path, sizeof path, "%s/m.xml", folder);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        (void)snprintf(text, sizeof text,
                       "<mujoco><asset><model name='p' file='p.xml'/></asset><worldbody>%s</worldbody></mujoco>",
                       table[i].attach);
        const kt_scene *scene = test_robot_file(kt_test_file(folder, "m.xml", text), NULL);
        kt_check_equal_int("forces", scene->description.effect_count, table[i].effects);
        kt_check_equal_int("pins", has_note(scene, "a flexcomp with pins in the world"), table[i].pins);
        kt_check_true("nothing is left out", !has_note(scene, "elasticity of a flexcomp"));
    }
}

/* Facets share the vertices of an edge on which -0 and 0 are both written: four points, not six. */
KT_TEST(vertices_at_minus_zero_are_those_at_zero) {
    static const char facets[] = "solid s\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 0 1 0\nvertex -1 0 0\n"
                                 "endloop\nendfacet\nfacet normal 0 0 1\nouter loop\nvertex -0 0 0\nvertex 1 0 0\n"
                                 "vertex -0 1 -0\nendloop\nendfacet\nendsolid s\n";
    const char *folder = kt_test_folder();
    (void)kt_test_file(folder, "s.stl", facets);
    const kt_scene *scene = test_robot_file(
        kt_test_file(folder, "m.xml", FLEX("type='mesh' dim='2' file='s.stl' mass='4'", "<edge damping='1'/>")), NULL);
    kt_check_equal_int("bodies", scene->description.body_count, 1 + 4 * 3);
    kt_check_equal_int("edges", scene->description.effect_count, 5);
}

/* ---- warnings and faults ----------------------------------------------------------------------------------------- */

KT_TEST(flexcomps_that_are_another_model_here_have_a_warning) {
    static const struct {
        const char *text, *note;
        int bodies;
    } table[] = {
        {FLEX("count='2 2 2' dim='3' dof='trilinear'", "<elasticity young='1e4'/>"), "elasticity of cells", 25},
        {FLEX("count='2 2 1' dof='2d'", "<elasticity young='1e4' thickness='.1' elastic2d='bend'/>"),
         "bending of a flexcomp whose points have one or two slides", 9},
        {FLEX("type='direct' dim='2' point='0 0 0 .3 0 0 .1 .2 0 .1 -.3 0' element='1 0 3 0 1 2'",
              "<elasticity young='1e4' thickness='.1' elastic2d='bend'/>"),
         "MuJoCo exchanges the ends of some edges", 13},
        {FLEX("count='33 33 1'", "<elasticity young='1e4' thickness='.1' elastic2d='stretch'/>"),
         "elasticity of a flexcomp with more than 2000 elements", 1 + 33 * 33 * 3},
        {"<mujoco><worldbody><replicate count='2' offset='1 0 0'><body name='a'><flexcomp name='f' count='2 2 1' "
         "dim='2'><elasticity young='1' thickness='.1' elastic2d='both'/></flexcomp></body></replicate></worldbody>"
         "</mujoco>",
         "elasticity of a flexcomp that <replicate> renames", 26},
        {FLEX("count='2 2 1'", "<edge equality='true'/>"), "springs and dampers that yield as much; a single edge", 13},
        {FLEX("count='2 2 1'", "<edge equality='true'/>"), "fixes their points: 5", 13},
        {FLEX("count='2 2 2' dim='3' dof='trilinear'", "<edge equality='strain'/>"), "equalities of cells", 25},
        {FLEX("type='mesh' file='none.stl'", ""), "flexcomps whose file cannot be read, left out: 1; the first: ", 1},
        {FLEX("type='gmsh' file='none.msh'", ""), "flexcomps whose file cannot be read, left out: 1; the first: ", 1},
        {"<mujoco><worldbody><body name='a'><flexcomp name='f' type='gmsh' "
         "file='none.msh'/></body></worldbody><equality>"
         "<connect body1='f_0' anchor='0 0 0'/><weld body1='a' body2='f_8'/></equality></mujoco>",
         "equality of a point of a flexcomp that is left out: 2", 1},
        {"<mujoco><worldbody><body name='a'><joint/><geom size='.1'/></body></worldbody>"
         "<deformable><flex name='f' dim='1' body='world a' element='0 1'/></deformable></mujoco>",
         "'flex' is left out: 1", 1},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = test_robot(table[i].text, NULL);
        kt_check_true(table[i].note, has_ranked_note(scene, KT_NOTE_RANK_MOTION, table[i].note));
        kt_check_equal_int("bodies", scene->description.body_count, table[i].bodies);
    }
}

KT_TEST(numbers_of_surfaces_without_elasticity_are_free) {
    kt_scene *scene = test_robot(FLEX("count='2 2 1'", "<elasticity poisson='.7' thickness='0'/>"), NULL);
    kt_check_equal_int("effects", scene->description.effect_count, 0);
}

KT_TEST(faults_of_flexcomps_have_their_place) {
    static const struct {
        const char *text, *message;
    } table[] = {
        {FLEX("dim='1' type='grid' count='1 1 1'", ""), "count: expected 2 or more points along axis 1"},
        {FLEX("dim='1' type='circle' count='2 1 1'", ""), "count: expected 3 or more points along axis 1"},
        {FLEX("dim='1' type='grid' count='3001 1 1'", ""), "expected up to 3000 points that move"},
        {FLEX("dim='3' type='grid' count='1e4 1e4 1e4'", ""), "expected 1 to 16777216 points and elements"},
        {FLEX("dim='1' type='grid' count='1e9 1 1'", ""), "expected 1 to 16777216 points and elements"},
        {FLEX("dim='2' type='grid' count='3 3 3'", ""), "count: a surface has 1 point along axis 3"},
        {FLEX("dim='1' type='box'", ""), "dim: a box is a surface (2) or a volume (3)"},
        {FLEX("dim='4'", ""), "dim: expected 1, 2 or 3"},
        {FLEX("count='3 3 1' dof='most'", ""), "dof: there is no 'most'"},
        {FLEX("dim='1' type='grid' count='6 1 1'", "<pin range='3e9 2'/>"), "range: there is no such point"},
        {FLEX("dim='1' type='grid' count='6 1 1'", "<pin range='2 -3e9'/>"), "range: there is no such point"},
        {FLEX("dim='1' type='grid' count='6 1 1'", "<pin grid='2'/>"), "a line has no grid"},
        {FLEX("count='3 3 1'", "<pin grid='2 3'/>"), "grid: there is no such point"},
        {FLEX("count='3 3 1'", "<pin gridrange='0 0 1'/>"), "gridrange: expected a multiple of 4 numbers"},
        {FLEX("dim='1' type='grid' count='4 1 1'", "<pin id='4'/>"), "id: there is no such point"},
        {FLEX("dim='2' type='direct' point='0 0 0 1 0 0 0 1 0' element='0 1 2'", "<pin gridrange='0 0 1 1'/>"),
         "points of a file or of the text have no grid"},
        {FLEX("dim='1' type='direct' point='0 0 0 1 0' element='0 1'", ""), "expected `point` with three numbers"},
        {FLEX("dim='1' type='direct' point='0 0 0 1 0 0' element='0 2'", ""), "element: there is no point 2"},
        {FLEX("dim='1' type='direct' point='0 0 0 1 0 a' element='0 1'", ""), "point: expected numbers"},
        {FLEX("dim='3' type='direct' point='0 0 0 1 0 0' element='0 1 0'", ""), "`element` with four points each"},
        {FLEX("type='mesh'", ""), "the attribute 'file' is missing"},
        {FLEX("type='direct' dim='2' point='0 0 0 1 0 0 2 0 0' element='0 1 2'",
              "<elasticity young='1' thickness='.1' elastic2d='stretch'/>"),
         "an element without area or volume has no elasticity"},
        {FLEX("type='direct' dim='2' point='0 0 0 1 0 0 2 0 0 0 1 0' element='0 1 2 1 0 3'",
              "<elasticity young='1' thickness='.1' elastic2d='bend'/>"),
         "an element without area or volume has no elasticity"},
        {FLEX("count='2 2 1'", "<elasticity young='1' poisson='.5'/>"),
         "poisson: expected a number from 0 on, below 0.5"},
        {FLEX("count='2 2 1'", "<elasticity young='1' elastic2d='bend'/>"),
         "thickness: elastic2d=\"bend\" needs a number above 0"},
        {FLEX("count='2 2 1'", "<elasticity young='1' thickness='0' elastic2d='stretch'/>"),
         "thickness: elastic2d=\"stretch\" needs a number above 0"},
        {"<mujoco><worldbody><flexcomp dim='1' type='grid' count='4 1 1'/></worldbody></mujoco>",
         "the attribute 'name' is missing"},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene scene;
        kt_error error = {0};
        kt_check_equal_int("status",
                           kt_robot_parse("m", table[i].text, strlen(table[i].text), NULL, &scene, NULL, NULL, &error),
                           KT_ERROR_SCENE);
        kt_check_contains("message", error.message, table[i].message);
    }
}
