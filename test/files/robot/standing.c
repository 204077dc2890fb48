/* Robots on the ground of their file: four legs with servos, open or closed, dropped from a small height. The contacts
 * of open legs have random stiffness, damping, friction and cone. After 3 s the robots rest at the places that today's
 * MuJoCo computes (mujoco_wasm.mjs). KT_MUJOCO_WASM names the folder of npm's @mujoco/mujoco. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "folder.h"
#include "node.h"
#include "random.h"
#include "run_file.h"

#define ROBOT "m.xml"
#include "robot.h"

#include "kinetree/import.h"
#include "kinetree/kinetree.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { ROBOTS = 12, LEGS = 4, SECONDS = 3, COORDINATES_MOST = 7 + 5 * LEGS };

static double real(kt_random *random, double lower, double upper) { return kt_random_uniform(random, lower, upper); }

/* One of them: feet are spheres, ends of capsules, boxes, or meshes. */
static void write_foot(FILE *to, int kind) {
    static const char *const feet[] = {"<geom class='foot' pos='0 0 -.2' size='.03'/>",
                                       "<geom class='foot' type='capsule' fromto='0 0 -.05 0 0 -.2' size='.03'/>",
                                       "<geom class='foot' type='box' pos='0 0 -.2' size='.04 .03 .02'/>",
                                       "<geom class='foot' type='mesh' pos='0 0 -.2' mesh='wedge'/>"};
    fputs(feet[kind], to);
}

static bool write_robot(const char *path, kt_random *random) {
    FILE *to = fopen(path, "w");
    const bool is_elliptic = kt_random_int(random, 0, 1) == 1, is_first = kt_random_int(random, 0, 1) == 1;
    const double low = real(random, 0.5, 0.9), trunk = real(random, 5.0, 30.0);
    static const int all[] = {3, 4, 6};
    const int kind = kt_random_int(random, 0, 3), dimensions = all[kt_random_int(random, 0, 2)];
    if (to == NULL)
        return false;
    fprintf(to,
            "<mujoco><option cone='%s' impratio='%.3g'/><default><geom contype='0' "
            "conaffinity='1'/>",
            is_elliptic ? "elliptic" : "pyramidal", real(random, 1.0, 10.0));
    fprintf(
        to,
        "<default class='foot'><geom mass='.1' condim='%d' priority='%d' friction='%.3g' margin='%.3g' solref='%.3g "
        "%.3g' ",
        dimensions, is_first, real(random, 0.4, 1.0), real(random, 0.0, 0.003), real(random, 0.015, 0.03),
        real(random, 0.8, 1.2));
    fprintf(
        to,
        "solimp='%.3g %.3g %.3g'/></default></default><asset><mesh name='wedge' vertex='-.04 -.03 -.02 .04 -.03 -.02 "
        ".04 .03 -.02 -.04 .03 -.02 -.03 -.02 .02 .03 -.02 .02 .03 .02 .02 -.03 .02 .02'/></asset><worldbody>",
        low, low + real(random, 0.01, 0.09), real(random, 0.001, 0.01));
    fprintf(to,
            "<geom type='plane' size='1 1 .1' pos='0 0 .1' contype='1' conaffinity='0'/><body name='trunk'><freejoint/>"
            "<geom type='box' size='.25 .12 .06' mass='%.4g'/>",
            trunk);
    for (int i = 0; i < LEGS; i++) {
        fprintf(to,
                "<body name='h%d' pos='%g %g 0'><joint name='h%d' axis='0 1 0' damping='1'/><geom type='capsule' "
                "fromto='0 0 0 0 0 -.2' size='.02' mass='.6' conaffinity='0'/><body name='k%d' pos='0 0 -.2'>"
                "<joint name='k%d' axis='0 1 0' damping='1'/><geom type='capsule' fromto='0 0 0 0 0 -.2' size='.015' "
                "mass='.3' conaffinity='0'/>",
                i, i < 2 ? 0.2 : -0.2, i % 2 == 0 ? 0.12 : -0.12, i, i, i);
        write_foot(to, kind);
        fprintf(to, "</body></body>");
    }
    fprintf(to, "</body></worldbody><actuator>");
    for (int i = 0; i < LEGS; i++)
        fprintf(to, "<position joint='h%d' kp='%g' kv='5'/><position joint='k%d' kp='%g' kv='5'/>", i, 20.0 * trunk, i,
                20.0 * trunk);
    fprintf(
        to,
        "</actuator><keyframe><key name='home' qpos='0 0 .52 1 0 0 0 .3 -.6 .3 -.6 .3 -.6 .3 -.6' ctrl='.3 -.6 .3 -.6 "
        ".3 -.6 .3 -.6'/></keyframe></mujoco>\n");
    return fclose(to) == 0;
}

/* Legs of five links: thigh h, shin k with an elastic heel e, and a crank c whose rod r an equality joins to the heel.
 * Servos hold h and c. */
static bool write_closed_legs(const char *path, kt_random *random) {
    FILE *to = fopen(path, "w");
    const double crank = real(random, 0.04, 0.08), bend = real(random, 0.2, 0.4), trunk = real(random, 5.0, 12.0);
    if (to == NULL)
        return false;
    fprintf(to,
            "<mujoco><option cone='elliptic' impratio='5' timestep='.0002' integrator='implicitfast'/><default><geom "
            "contype='0' "
            "conaffinity='0'/></default><worldbody><geom type='plane' size='1 1 .1' contype='1'/><body name='trunk'>"
            "<freejoint/><geom type='box' size='.25 .12 .06' mass='%.4g'/>",
            trunk);
    for (int i = 0; i < LEGS; i++) {
        const double x = i < 2 ? 0.2 : -0.2, y = i % 2 == 0 ? 0.12 : -0.12;
        fprintf(to,
                "<body name='h%d' pos='%g %g 0'><joint name='h%d' axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 "
                "-.2' size='.02' mass='.6'/><body name='k%d' pos='0 0 -.2'><joint name='k%d' axis='0 1 0'/><geom "
                "type='capsule' fromto='0 0 0 0 0 -.2' size='.015' mass='.3'/><geom pos='0 0 -.2' size='.03' mass='.1' "
                "conaffinity='1'/>",
                i, x, y, i, i, i);
        fprintf(to,
                "<body name='e%d'><joint name='e%d' axis='0 1 0' stiffness='%.4g' damping='1'/><geom type='capsule' "
                "fromto='0 0 0 %g 0 0' size='.01' mass='.05'/></body></body></body><body name='c%d' pos='%g %g 0'>"
                "<joint name='c%d' axis='0 1 0'/><geom type='capsule' fromto='0 0 0 %g 0 0' size='.01' mass='.05'/>"
                "<body name='r%d' pos='%g 0 0'><joint name='r%d' axis='0 1 0'/><geom type='capsule' fromto='0 0 0 0 0 "
                "-.2' size='.005' mass='.05'/></body></body>",
                i, i, real(random, 100.0, 250.0), -crank, i, x, y, i, -crank, i, -crank, i);
    }
    fprintf(to, "</body></worldbody><equality>");
    for (int i = 0; i < LEGS; i++)
        fprintf(to, "<connect body1='r%d' body2='e%d' anchor='0 0 -.2' solref='.0004 1'/>", i, i);
    fprintf(to, "</equality><actuator>");
    for (int i = 0; i < LEGS; i++)
        fprintf(to, "<position joint='h%d' kp='%g' kv='6'/><position joint='c%d' kp='%g' kv='6'/>", i, 20.0 * trunk, i,
                20.0 * trunk);
    fprintf(to, "</actuator><keyframe><key name='home' qpos='0 0 %.4g 1 0 0 0", 0.13 + 0.4 * cos(bend));
    for (int i = 0; i < LEGS; i++)
        fprintf(to, " %.4g %.4g 0 %.4g %.4g", bend, -2.0 * bend, -bend, 2.0 * bend);
    fprintf(to, "' ctrl='");
    for (int i = 0; i < LEGS; i++)
        fprintf(to, "%.4g %.4g ", bend, -bend);
    fprintf(to, "'/></keyframe></mujoco>\n");
    return fclose(to) == 0;
}

/* Positions in MuJoCo's order; `joints` has the letters of the joints of a leg. */
static void run_here(const char *path, const char *joints, double *q) {
    const kt_robot_options options = {.keyframe = "home", .contacts = true};
    const kt_mechanism *m = run_file(path, &options, NULL, SECONDS);
    memcpy(q, positions_of(m, "trunk"), 7 * sizeof *q);
    const int of_leg = (int)strlen(joints);
    for (int i = 0; i < of_leg * LEGS; i++)
        q[7 + i] = *positions_of(m, (const char[]){joints[i % of_leg], (char)('0' + i / of_leg), '\0'});
}

static bool read_theirs(FILE *from, const char *path, int coordinates, double *q) {
    char word[200], count[20];
    if (!is_read_by_mujoco(from, path) || fscanf(from, "%19s", count) != 1 || strtol(count, NULL, 10) != coordinates)
        return kt_check_true(path, false);
    for (int i = 0; i < coordinates; i++)
        if (fscanf(from, "%199s", word) != 1)
            return kt_check_true("a position is read", false);
        else
            q[i] = strtod(word, NULL);
    return true;
}

static const kt_robot_options with_contacts = {.contacts = true};

#define MODEL(floor, geoms, rest)                                                                                      \
    "<mujoco><worldbody><geom name='f' type='plane' size='1 1 1' " floor "/><body name='a'><freejoint/>" geoms         \
    "</body></worldbody>" rest "</mujoco>"

KT_TEST(planes_touch_the_points_of_solids_that_masks_pairs_and_excludes_allow) {
    static const struct {
        const char *text;
        int contacts;
    } table[] = {
        {MODEL("", "<geom size='.1'/>", ""), 1},
        {MODEL("", "<geom type='capsule' size='.1 .2'/>", ""), 2},
        {MODEL("", "<geom type='box' size='.1 .2 .3'/>", ""), 8},
        {MODEL("", "<geom type='cylinder' size='.1 .2'/>", ""), 2},
        {MODEL("", "<geom type='ellipsoid' size='.1 .2 .3'/>", ""), 26},
        {MODEL("", "<geom type='ellipsoid' size='.1 .1 .1'/>", ""), 1},
        {MODEL("", "<geom type='mesh' mesh='m'/>",
               "<asset><mesh name='m' vertex='0 0 0 1 0 0 0 1 0 0 0 1 .1 .1 .1'/></asset>"),
         4},
        {MODEL("contype='2' conaffinity='0'", "<geom size='.1'/>", ""), 0},
        {MODEL("contype='2' conaffinity='0'", "<geom size='.1' conaffinity='6'/>", ""), 1},
        {MODEL("contype='0' conaffinity='0'", "<geom name='g' size='.1'/>",
               "<contact><pair geom1='g' geom2='f'/></contact>"),
         1},
        {MODEL("", "<geom size='.1'/>", "<contact><exclude body1='a' body2='world'/></contact>"), 0},
        {"<mujoco><worldbody><geom type='plane' size='1 1 1'/><body><geom size='.1'/><body name='b'><joint/><geom "
         "size='.1'/>"
         "</body></body></worldbody></mujoco>",
         1}, /* bodies that do not move touch nothing */
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, &with_contacts);
        kt_check_equal_int(table[i].text, scene->description.effect_count, table[i].contacts);
        kt_check_equal_int("warning of an ellipsoid that is no sphere",
                           has_ranked_note(scene, KT_NOTE_RANK_MOTION, "26 spheres"), table[i].contacts == 26);
    }
}

/* A body without joints that --floating frees is as one with a free joint: alone, and with a body on a hinge. */
KT_TEST(bodies_that_are_freed_touch_planes_as_free_ones_do) {
#define ROBOT_OF(joint, rest)                                                                                          \
    "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body name='a' pos='0 0 .4'>" joint                           \
    "<geom type='box' size='.1 .2 .3'/>" rest "</body></worldbody></mujoco>"
#define ARM "<body name='b' pos='.5 0 0'><joint axis='0 1 0'/><geom size='.1'/></body>"
    static const char *const texts[][2] = {{ROBOT_OF("<freejoint/>", ""), ROBOT_OF("", "")},
                                           {ROBOT_OF("<freejoint/>", ARM), ROBOT_OF("", ARM)}};
    const kt_robot_options freed = {.contacts = true, .floating = true}, falls = {.floating = true};
    for (int i = 0; i < 2; i++) {
        const kt_description d = test_robot(texts[i][0], &with_contacts)->description;
        const kt_description other = test_robot(texts[i][1], &freed)->description;
        kt_check_equal_int("of the free one", d.effect_count, 8 + i);
        kt_need(kt_check_equal_int("of the freed one", other.effect_count, d.effect_count));
        for (int k = 0; k < d.effect_count; k++) {
            const kt_effect *a = &d.effects[k], *b = &other.effects[k];
            kt_check_near("stiffness, N/m^m", b->stiffness, a->stiffness, 1e-12 * a->stiffness);
            kt_check_near("slip, m/s", b->slip, a->slip, 1e-12 * a->slip);
        }
        kt_check_true("told to fall", has_ranked_note(test_robot(texts[i][1], &falls), KT_NOTE_RANK_MOTION, "falls, "));
    }
#undef ROBOT_OF
#undef ARM
}

/* A ball of 1 kg with a constant impedance: A = 1, and K = k d^2 / (1 - d) = 1 / (T^2 (1 - d)) with d = dmax. The
 * margin raises the plane; a ground is one more. */
KT_TEST(contacts_have_the_stiffness_of_the_file) {
    static const char text[] =
        MODEL("pos='0 0 .5'", "<geom size='.1' mass='1' condim='1' margin='.01' friction='.7'/>", "");
    static const char constant[] = "<mujoco><default><geom solimp='.9 .9 .001' solref='.02 1' condim='1'/></default>";
    char whole[1000];
    const kt_robot_options on_ground = {.contacts = true, .has_ground = true, .ground = -2.0};
    (void)snprintf(whole, sizeof whole, "%s%s", constant, text + strlen("<mujoco>"));
    const kt_scene *scene = test_robot(whole, &on_ground);
    kt_need(kt_check_equal_int("contacts", scene->description.effect_count, 2));
    const kt_effect *floor = &scene->description.effects[1], *ground = &scene->description.effects[0];
    kt_check_near("stiffness", floor->stiffness, 1.0 / (4e-4 * 0.1), 1e-8 * 25000.0);
    kt_check_near("exponent", floor->exponent, 1.0, 1e-9);
    kt_check_near("without friction", floor->friction, 0.0, 0.0);
    kt_check_near("height of the floor and the margin", floor->between[1].at.z, 0.51, 1e-15);
    kt_check_near("height of the ground and the margin", ground->between[1].at.z, -1.99, 1e-15);
    kt_check_near("radius", floor->radius, 0.1, 0.0);
}

/* As in MuJoCo, the default applies: a spring of a damping ratio of 0 would be infinite. */
KT_TEST(solref_of_mixed_signs_is_the_default_with_a_warning) {
    static const struct {
        const char *reference;
        bool is_mixed;
        int contacts;
    } table[] = {{"0.02 1", false, 1}, {"0.02 0", true, 1},     {"0.02 -1", true, 1}, {"-1000 1", true, 1},
                 {"0 1", true, 1},     {"-1000 -10", false, 1}, {"0 0", false, 0}};
    double standard = 0.0;
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        char text[400];
        (void)snprintf(text, sizeof text,
                       "<mujoco><worldbody><geom type='plane' size='1 1 1'/><body><freejoint/><geom size='.1' "
                       "priority='1' solref='%s'/></body></worldbody></mujoco>",
                       table[i].reference);
        const kt_scene *scene = test_robot(text, &with_contacts);
        const int count = scene->description.effect_count;
        kt_check_equal_int(table[i].reference, count, table[i].contacts);
        kt_check_equal_int("warning", has_ranked_note(scene, KT_NOTE_RANK_MOTION, "solref of which one number alone"),
                           table[i].is_mixed);
        kt_check_equal_int("left out", has_note(scene, "or a solref without stiffness"), count == 0);
        if (i == 0)
            standard = scene->description.effects[0].stiffness;
        if (table[i].is_mixed && count > 0)
            kt_check_equal_bits("stiffness", &scene->description.effects[0].stiffness, &standard, 1);
    }
}

/* On a pyramidal cone, the edges of a contact share its force: K = k d^2 / (1 - d) (condim - 1) r / ((1 + mu^2) mu^2).
 * A torsional and a rolling friction have edges, too. */
KT_TEST(edges_of_a_pyramid_share_the_force_of_a_contact) {
    static const int dimensions[] = {3, 4, 6};
    for (size_t i = 0; i < sizeof dimensions / sizeof *dimensions; i++) {
        const double mu = 0.7, ratio = 5.0, alone = 1.0 / (4e-4 * 0.1), n = dimensions[i];
        char text[1000];
        (void)snprintf(text, sizeof text,
                       "<mujoco><option impratio='5'/><default><geom solimp='.9 .9 .001' solref='.02 1' friction='.7'/>"
                       "</default><worldbody><geom type='plane' size='1 1 1'/><body><freejoint/>"
                       "<geom size='.1' mass='1' condim='%d'/></body></worldbody></mujoco>",
                       dimensions[i]);
        const kt_scene *scene = test_robot(text, &with_contacts);
        kt_need(kt_check_equal_int("contacts", scene->description.effect_count, 1));
        const double expected = alone * (n - 1.0) * ratio / ((1.0 + mu * mu) * mu * mu);
        kt_check_near("stiffness", scene->description.effects[0].stiffness, expected, 1e-8 * expected);
    }
}

static const kt_vec3 half_axes[] = {{.1, .07, .01}, {.04, .03, .02}, {.03, .1, .03}, {.1, .05, .001}};

/* The spheres of an ellipsoid are inside: their support max(c n) + r is at most |A n|, and near it. It is equal along
 * the axes. */
KT_TEST(spheres_of_ellipsoids_are_inside_them_and_near_their_surface) {
    kt_random random = kt_random_of_test();
    KT_WORST inside = kt_worst_make("support, of the ellipsoid's"), near = kt_worst_make("below the surface"),
             axes = kt_worst_make("at the axes");
    for (size_t i = 0; i < sizeof half_axes / sizeof *half_axes; i++) {
        char text[1000];
        const kt_vec3 a = half_axes[i];
        (void)snprintf(text, sizeof text, MODEL("", "<geom type='ellipsoid' size='%g %g %g'/>", ""), a.x, a.y, a.z);
        const kt_scene *scene = test_robot(text, &with_contacts);
        const double most = fmax(a.x, fmax(a.y, a.z));
        for (int k = 0; k < 2003; k++) {
            double d[3] = {k == 0, k == 1, k == 2};
            if (k >= 3)
                kt_random_direction(&random, 3, d);
            const kt_vec3 n = kt_vec3_make(d[0], d[1], d[2]);
            const double exact = kt_vec3_norm(kt_vec3_make(a.x * n.x, a.y * n.y, a.z * n.z));
            double support = 0.0;
            for (int j = 0; j < scene->description.effect_count; j++) {
                const kt_effect *e = &scene->description.effects[j];
                support = fmax(support, kt_vec3_dot(e->between[0].at, n) + e->radius);
            }
            kt_worst_below(&inside, support / exact, 1.0 + 1e-14, "%zu, %d", i, k);
            kt_worst_below(&near, 1e-14 + (exact - support) / most, 0.08, "%zu, %d", i, k);
            if (k < 3)
                kt_worst_near(&axes, support, exact, 1e-15, "%zu, %d", i, k);
        }
    }
}

/* Vertices in MJCF are single-precision numbers. gcc 12 may leave out conversions of variables that are not
 * volatile. */
static double rounded_to_single(double x) {
    volatile float single = (float)x;
    return (double)single;
}

/* A prism on its sole: a polygon with `corners` at a radius of 0.1 m in a plane, above whose edges it is wider by the
 * bevel. Its first `corners` vertices are those of the sole. All are rotated; returns their number. */
static int make_beveled_foot(int corners, double stretch, const double rotation[4], kt_vec3 vertices[3 * 7]) {
    const kt_mat3 turned = kt_mat3_from_quat(kt_quat_make(rotation[0], rotation[1], rotation[2], rotation[3]));
    for (int i = 0; i < 3 * corners; i++) {
        const int ring = i / corners;
        const double angle = 2.0 * 3.14159265358979323846 * (i % corners + 0.5) / corners, r = ring == 0 ? 0.1 : 0.11;
        const kt_vec3 x =
            kt_mat3_apply(turned, kt_vec3_make(stretch * r * cos(angle), r * sin(angle), 0.02 * ring * ring));
        vertices[i] = kt_vec3_make(rounded_to_single(x.x), rounded_to_single(x.y), rounded_to_single(x.z));
    }
    return 3 * corners;
}

/* A sole decides over which area a foot stands. The farthest vertices in few directions are those of the bevel. */
KT_TEST(meshes_touch_in_all_corners_of_a_flat_sole_that_a_bevel_surrounds) {
    kt_random random = kt_random_of_test();
    KT_WORST missed = kt_worst_make("from a corner of the sole to the nearest contact, m");
    for (int trial = 0; trial < 40; trial++) {
        const int corners = kt_random_int(&random, 3, 7);
        double rotation[4] = {1.0, 0.0, 0.0, 0.0};
        if (trial > 0)
            kt_random_direction(&random, 4, rotation);
        kt_vec3 vertices[3 * 7];
        const int count = make_beveled_foot(corners, corners == 4 ? 9.0 : 1.0, rotation, vertices);
        char text[4000] = "<mujoco><asset><mesh name='m' vertex='";
        for (int i = 0; i < count; i++)
            (void)snprintf(text + strlen(text), sizeof text - strlen(text), "%.17g %.17g %.17g ", vertices[i].x,
                           vertices[i].y, vertices[i].z);
        (void)snprintf(text + strlen(text), sizeof text - strlen(text),
                       "'/></asset><worldbody><geom type='plane' size='1 1 1'/><body><freejoint/><geom type='mesh' "
                       "mesh='m'/></body></worldbody></mujoco>");
        const kt_scene *scene = test_robot(text, &with_contacts);
        for (int i = 0; i < corners; i++) {
            double nearest = HUGE_VAL;
            for (int k = 0; k < scene->description.effect_count; k++)
                nearest =
                    fmin(nearest, kt_vec3_norm(kt_vec3_sub(scene->description.effects[k].between[0].at, vertices[i])));
            kt_worst_near(&missed, nearest, 0.0, 1e-12, "%d, %d corners, %d", trial, corners, i);
        }
    }
}

KT_TEST(robots_that_fall_or_start_in_the_ground_are_told) {
    static const char planeless[] =
        "<mujoco><worldbody><body><freejoint/><geom size='.1'/></body></worldbody></mujoco>";
    const struct {
        const char *name, *text, *note;
        const kt_robot_options *options;
    } table[] = {
        {"without contacts", MODEL("", "<geom size='.1'/>", ""), "falls, 4.9 m in the first second", NULL},
        {"without a plane", planeless, "--ground HEIGHT adds a floor", &with_contacts},
        {"in the ground", MODEL("pos='0 0 .2'", "<geom size='.1'/>", ""), "starts 0.3 m deep in the ground",
         &with_contacts},
        {"on the ground", MODEL("pos='0 0 -.1'", "<geom size='.1'/>", ""), NULL, &with_contacts},
    };
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        const kt_scene *scene = test_robot(table[i].text, table[i].options);
        if (table[i].note != NULL)
            kt_check_true(table[i].name, has_ranked_note(scene, KT_NOTE_RANK_MOTION, table[i].note));
        else
            kt_check_true(table[i].name, !has_ranked_note(scene, KT_NOTE_RANK_MOTION, "ground"));
    }
}

KT_TEST(a_ground_alone_is_rejected) {
    static const char text[] = MODEL("", "<geom size='.1'/>", "");
    const kt_robot_options ground = {.has_ground = true};
    kt_scene scene;
    kt_error error = {0};
    kt_check_equal_int("a ground alone",
                       kt_robot_parse("m", text, sizeof text - 1, &ground, &scene, NULL, NULL, &error),
                       KT_ERROR_ARGUMENT);
}

/* Robots with legs of some joints. The bounds are those of the trunk's quaternion and of the joints, rad. */
static void compare_standing(int count, bool (*write)(const char *, kt_random *), const char *joints_of_leg,
                             double tilt_bound, double joint_bound) {
    static char paths[ROBOTS][80];
    const char *asked[ROBOTS];
    const char *folder = kt_test_folder();
    char states[20];
    kt_random random = kt_random_of_test();
    const int coordinates = 7 + LEGS * (int)strlen(joints_of_leg);
    if (!has_mujoco())
        return;
    KT_WORST height = kt_worst_make("height, m"), tilt = kt_worst_make("tilt"), joints = kt_worst_make("joints, rad");
    (void)snprintf(states, sizeof states, "rest=%d", SECONDS);
    for (int i = 0; i < count; i++) {
        (void)snprintf(paths[i], sizeof paths[i], "%s/%d.xml", folder, i);
        kt_check_true("it is written", write(paths[i], &random));
        asked[i] = paths[i];
    }
    FILE *from = ask_mujoco(states, asked, count);
    for (int i = 0; i < count && from != NULL; i++) {
        double ours[COORDINATES_MOST], theirs[COORDINATES_MOST];
        if (!read_theirs(from, paths[i], coordinates, theirs))
            continue;
        run_here(paths[i], joints_of_leg, ours);
        kt_check_above("it stands, m", theirs[2], 0.3);
        kt_worst_near(&height, ours[2], theirs[2], 1e-3, "%d", i);
        for (int k = 3; k < 7; k++)
            kt_worst_near(&tilt, ours[k], theirs[k], tilt_bound, "%d, %d", i, k);
        for (int k = 7; k < coordinates; k++)
            kt_worst_near(&joints, ours[k], theirs[k], joint_bound, "%d, %d", i, k);
    }
    if (from != NULL)
        end_answers(from);
    kt_check_equal_int("robots compared", (int)height.count, count);
}

KT_TEST(robots_stand_where_those_of_mujoco_of_today_do) { compare_standing(ROBOTS, write_robot, "hk", 5e-4, 2e-4); }

/* Dropped from 10 cm, with loops and springs in the legs. MuJoCo's equalities are soft, here as stiff as it allows.
 * Friction holds the feet where the impact left them, which differs: by up to 4e-3 of the legs' length. */
KT_TEST(robots_of_closed_legs_stand_after_a_drop_where_those_of_mujoco_do) {
    compare_standing(4, write_closed_legs, "hkecr", 3e-3, 1.5e-2);
}
