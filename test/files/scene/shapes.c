/* Bodies of several shapes against closed forms: solids cut into pieces, dumb-bells, shares by volume and length. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "collect.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A scene with one body. */
static kt_scene *read_body(const char *keys) {
    return kt_test_scene_of("kinetree: 1\nbodies:\n  - {name: a, joint: {type: free}, %s}\n", keys);
}

/* The body that the first keys describe is that of the second. Sums of some terms of the size of mass and lengths. */
static void check_same(const char *what, const char *parts, const char *whole) {
    kt_vec3 com[2];
    kt_sym3 inertia[2];
    kt_error error = {0};
    const kt_body *bodies[] = {read_body(parts)->description.bodies, read_body(whole)->description.bodies};
    for (int i = 0; i < 2; i++)
        kt_check_equal_int(what, kt_body_inertia(bodies[i], &com[i], &inertia[i], &error), KT_OK);
    const double *c = &com[0].x, *d = &com[1].x;
    const kt_sym3 s = inertia[0], t = inertia[1];
    const double one[] = {s.xx, s.yy, s.zz, s.xy, s.xz, s.yz}, other[] = {t.xx, t.yy, t.zz, t.xy, t.xz, t.yz};
    const double scale = fmax(1.0, bodies[1]->mass) * 16.0 * DBL_EPSILON;
    kt_check_near("mass", bodies[0]->mass, bodies[1]->mass, scale);
    for (int k = 0; k < 3; k++)
        kt_check_near("com", c[k], d[k], 16.0 * DBL_EPSILON);
    KT_WORST worst = kt_worst_make("inertia");
    for (int k = 0; k < 6; k++)
        kt_worst_near(&worst, one[k], other[k], 4.0 * scale, "%d", k);
}

KT_TEST(pieces_weigh_as_the_whole) {
    check_same("a box of two unequal ones, turned",
               "mass: 6, shapes: [{type: box, size: [1, 0.4, 0.2], at: [0.5, 0, 0]}, "
               "{type: box, size: [0.4, 2, 0.2], at: [2, 0, 0], rotation: {axis: [0, 0, 1], angle: 90 deg}}]",
               "mass: 6, shape: {type: box, size: [3, 0.4, 0.2], at: [1.5, 0, 0]}");
    check_same("a cylinder of two of different length, whose masses are given",
               "shapes: [{type: cylinder, radius: 0.3, length: 1, at: [0, 0, 0.5], mass: 2}, "
               "{type: cylinder, radius: 0.3, length: 3, at: [0, 0, 2.5], mass: 6}]",
               "mass: 8, shape: {type: cylinder, radius: 0.3, length: 4, at: [0, 0, 2]}");
    check_same("a slender rod of two, by length",
               "mass: 3, shapes: [{type: rod, to: [1, 1, 0]}, {type: rod, from: [3, 3, 0], to: [1, 1, 0]}]",
               "mass: 3, shape: {type: rod, to: [3, 3, 0]}");
    check_same("a shape alone", "mass: 2, shapes: [{type: sphere, radius: 0.2, at: [1, 2, 3]}]",
               "mass: 2, shape: {type: sphere, radius: 0.2, at: [1, 2, 3]}");
}

/* Points of m at the ends of a rod of M have, about the middle, the inertia
 *     M l^2 / 12 + m l^2 / 2. */
KT_TEST(dumb_bell_has_its_closed_form) {
    check_same(
        "about the middle",
        "mass: 5, shapes: [{type: rod, from: [-1, 0, 0], to: [1, 0, 0]}, {type: point, at: [-1, 0, 0], mass: 1}, "
        "{type: point, at: [1, 0, 0], mass: 1}]",
        "mass: 5, inertia: [0, 3, 3]");
    check_same(
        "one end heavier, a ball of its own mass and the rest by volume",
        "mass: 4, shapes: [{type: box, size: [2, 1, 1], at: [1, 0, 0]}, {type: sphere, radius: 0.5, at: [3, 0, 0], "
        "mass: 2}]",
        "mass: 4, com: [2, 0, 0], inertia: [0.53333333333333333, 5.0333333333333333, 5.0333333333333333]");
}

KT_TEST(what_is_given_counts_and_shapes_without_masses_are_pictures) {
    check_same("com", "mass: 1, com: [1, 0, 0], inertia: [1, 1, 1], shapes: [{type: rod, to: [0, 0, 1]}]",
               "mass: 1, com: [1, 0, 0], inertia: [1, 1, 1]");
    const kt_scene *scene = read_body("shapes: [{type: rod, to: [0, 0, 1]}, {type: point, at: [0, 0, 2]}]");
    kt_check_equal_int("shapes", scene->description.bodies[0].shape_count, 2);
    kt_check_true("no mass", scene->description.bodies[0].mass == 0.0);
}

KT_TEST(shapes_are_written_and_read_again) {
    const kt_scene *scene = read_body(
        "mass: 6, shapes: [{type: box, size: [1, 0.4, 0.2], at: [0.5, 0, 0]}, {type: sphere, radius: 0.1, at: "
        "[0, 0.3, 0.7], mass: 1.1}]");
    const kt_scene *again = kt_test_scene(kt_test_written(scene));
    const kt_body *a = scene->description.bodies, *b = again->description.bodies;
    kt_check_equal_int("shapes", b->shape_count, 2);
    kt_check_true("each",
                  b->shape_count == 2 && kt_same_bytes(&a->shapes[1].at, &b->shapes[1].at, sizeof a->shapes[1].at));
    kt_check_equal_bits("com", &b->com.x, &a->com.x, 3);
    kt_check_equal_bits("inertia", &b->inertia.xx, &a->inertia.xx, 6);
    kt_check_equal_bits("mass", &b->mass, &a->mass, 1);
}

KT_TEST(faults_of_shapes_are_told_at_their_places) {
    static const char *const wrong[][2] = {
        {"shapes: [{type: sphere, radius: 0.1, mass: 1}, {type: sphere, radius: 0.1}]",
         "some shapes have a `mass` and 1 has none"},
        {"mass: 1, shapes: [{type: sphere, radius: 0.1, mass: 2}]", "add up to 2 kg, and the body's mass is 1 kg"},
        {"mass: 1, shapes: [{type: sphere, radius: 0.1}, {type: point}]", "the shape has no volume"},
        {"mass: 1, shapes: [{type: sphere, radius: -0.1}]", "radius is -0.1"},
        {"shapes: [{type: sphere, radius: 0.1, mass: -1}]", "mass is -1; it cannot be negative"},
        {"mass: 1, shape: {type: point}, shapes: [{type: point}]", "has a `shape`, too"},
        {"mass: 1, shapes: {type: point}", "a list of shapes"},
        {"mass: 1, shapes: [{type: rod, to: [0, 0, 0]}]", "a rod needs a length"},
        {"mass: 1, shapes: [{type: ball}]", "ball"},
    };
    for (size_t i = 0; i < sizeof wrong / sizeof *wrong; i++) {
        static kt_collected faults;
        char text[1000];
        kt_scene scene;
        snprintf(text, sizeof text, "kinetree: 1\nbodies:\n  - {name: a, joint: {type: free}, %s}\n", wrong[i][0]);
        kt_check_true("rejected", kt_collect_parse(&faults, text, &scene) != KT_OK);
        kt_check_contains("fault", faults.text, wrong[i][1]);
        kt_check_equal_int("one fault", faults.count, 1);
    }
}

/* ---- meshes ------------------------------------------------------------------------------------------------------ */

/* A box of 20 x 30 x 40 mm with a corner at the origin, as OBJ, whole or without its top. The file's name is relative
 * to the folder of the scene. There is no such folder, so the name is written whole. */
static bool write_box(char *path, bool is_open) {
    static const char corners[] =
        "v 0 0 0\nv 20 0 0\nv 20 30 0\nv 0 30 0\nv 0 0 40\nv 20 0 40\nv 20 30 40\nv 0 30 40\n";
    const int number = mkstemp(path);
    FILE *file = number >= 0 ? fdopen(number, "w") : NULL;
    if (!kt_check_true("the file is there", file != NULL))
        return false;
    (void)fprintf(file, "%sf 4 3 2 1\nf 1 2 6 5\nf 2 3 7 6\nf 3 4 8 7\nf 4 1 5 8\n%s", corners,
                  is_open ? "" : "f 5 6 7 8\n");
    return fclose(file) == 0;
}

static void read_meshes(const char *keys, const char *meshes, kt_collected *faults, kt_scene *scene) {
    char text[1200];
    (void)snprintf(text, sizeof text, "kinetree: 1\nbodies:\n  - {name: a, joint: {type: free}%s}\nmeshes:\n%s", keys,
                   meshes);
    (void)kt_collect_parse(faults, text, scene);
}

/* The mass and the inertia of the box are
 *     m = 2700 * 24e-6 kg,   J = m (b^2 + c^2) / 12.
 * If it is mirrored, turned and moved, it is a box as well. */
KT_TEST(closed_meshes_weigh_as_their_solids) {
    static kt_collected faults;
    char path[] = "/tmp/kinetree-mesh-XXXXXX", meshes[600];
    kt_scene *a = kt_test_scene_place();
    kt_vec3 com;
    kt_sym3 inertia;
    if (!write_box(path, false))
        return;
    (void)snprintf(meshes, sizeof meshes,
                   "  - {body: a, file: %s, scale: [1e-3, -1e-3, 1e-3], at: [1, 2, 3], density: 2700,\n"
                   "     rotation: {axis: [0, 0, 1], angle: 90 deg}}\n"
                   "  - {body: a, file: %s, scale: [1e-3, 1e-3, 1e-3], at: [1.03, 2, 3], density: 5400}\n",
                   path, path);
    read_meshes("", meshes, &faults, a);
    kt_need(kt_check_text("faults", faults.text, ""));
    const double m = 2700.0 * 24e-6;
    char text[600];
    (void)snprintf(text, sizeof text,
                   "shapes: [{type: box, size: [0.03, 0.02, 0.04], at: [1.015, 2.01, 3.02], mass: %.17g}, "
                   "{type: box, size: [0.02, 0.03, 0.04], at: [1.04, 2.015, 3.02], mass: %.17g}]",
                   m, 2.0 * m);
    kt_error error = {0};
    const kt_body *solid = a->description.bodies, *boxes = read_body(text)->description.bodies;
    kt_check_equal_int("body", kt_body_inertia(solid, &com, &inertia, &error), KT_OK);
    kt_check_near("mass", solid->mass, 3.0 * m, 8.0 * DBL_EPSILON * m);
    kt_check_near("com x", com.x, boxes->com.x, 1e-15);
    kt_check_near("com y", com.y, boxes->com.y, 1e-15);
    kt_check_near("com z", com.z, boxes->com.z, 1e-15);
    const kt_sym3 s = inertia, t = boxes->inertia;
    const double one[] = {s.xx, s.yy, s.zz, s.xy, s.xz, s.yz}, other[] = {t.xx, t.yy, t.zz, t.xy, t.xz, t.yz};
    KT_WORST worst = kt_worst_make("inertia");
    for (int k = 0; k < 6; k++) /* m d e, where d = 0.03 m has the rounding error of places of 3 m */
        kt_worst_near(&worst, one[k], other[k], m * 0.03 * 4.0 * DBL_EPSILON, "%d", k);
    const char *written = kt_test_written(a);
    kt_check_true("no density is written", strstr(written, "density") == NULL);
    const kt_scene *again = kt_test_scene(written);
    kt_check_true("the same body", again->description.bodies[0].mass == a->description.bodies[0].mass);
    kt_check_equal_int("meshes", again->mesh_count, 2);
    (void)remove(path);
}

/* Masses of meshes are not computed again: for such a scene, the message requires a new reading. */
KT_TEST(density_that_varies_is_not_kept_in_silence) {
    const char *const name = "rho";
    const double value = 2700.0;
    const kt_scene_options options = {.variables = &name, .values = &value, .variable_count = 1};
    char path[] = "/tmp/kinetree-mesh-XXXXXX", text[600];
    kt_scene *scene = kt_test_scene_place();
    kt_error error = {0};
    if (!write_box(path, false))
        return;
    (void)snprintf(text, sizeof text,
                   "kinetree: 1\nparameters: {rho: 1}\nbodies:\n  - {name: a, joint: {type: free}}\n"
                   "meshes: [{body: a, file: %s, scale: [1e-3, 1e-3, 1e-3], density: =2*rho}]\n",
                   path);
    kt_need(kt_check_true("read",
                          kt_scene_parse_with("x", text, strlen(text), &options, scene, NULL, NULL, &error) == KT_OK));
    kt_check_near("mass", scene->description.bodies[0].mass, 2.0 * 2700.0 * 24e-6, 1e-15);
    kt_check_equal_int("varied", kt_scene_vary(scene, (double[]){1000.0}, &error), KT_ERROR_UNSUPPORTED);
    kt_check_near("mass as before", scene->description.bodies[0].mass, 2.0 * 2700.0 * 24e-6, 1e-15);
    (void)remove(path);
}

KT_TEST(meshes_without_a_volume_are_told) {
    static kt_collected faults;
    char path[] = "/tmp/kinetree-mesh-XXXXXX", meshes[600];
    static const struct {
        const char *body, *keys, *words;
    } table[] = {
        {"", "density: 2700",
         "the surface is not closed: 4 edges are those of a single triangle, the first from (0, 0, 40) to (0, 30, 40) "
         "in units of the file, and it has a density"},
        {"", "density: -1", "density is -1 kg/m^3; it must be above zero"},
        {", mass: 2, inertia: [1, 1, 1]", "density: 1",
         "body 'a' has a mass of its own; leave out its `mass`, or the density of its mesh"},
        {", mass: 2, inertia: [1, 1, 1]", "scale: [1, 1, 1]", ""}, /* for pictures */
    };
    if (!write_box(path, true))
        return;
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_scene *scene = kt_test_scene_place();
        (void)snprintf(meshes, sizeof meshes, "  - {body: a, file: %s, %s}\n", path, table[i].keys);
        read_meshes(table[i].body, meshes, &faults, scene);
        kt_check_equal_int(table[i].words, faults.count, table[i].words[0] != '\0');
        if (table[i].words[0] != '\0')
            kt_check_contains("words", faults.text, table[i].words);
    }
    kt_scene *scene = kt_test_scene_place();
    read_meshes("", "  - {body: a, file: /nowhere.stl, density: 1}\n", &faults, scene);
    kt_check_contains("no file", faults.text, "/nowhere.stl");
    (void)remove(path);
}
