/* Does work of one kind and size, in the function measured_work. work.py counts the instructions.
 *
 * work-count KIND SIZE; without arguments, the kinds are printed */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../describe.h"

#include "kinetree/import.h"
#include "kinetree/model.h"
#include "kinetree/scene.h"
#include "mesh/mesh.h"

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

typedef struct input {
    int size;
    char *text; /* of a file; enough for all kinds */
    size_t length;
    double *points;
    kt_description description;
} input;

static void add(input *in, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void add(input *in, const char *format, ...) {
    va_list arguments;
    va_start(arguments, format);
    in->length += (size_t)vsnprintf(in->text + in->length, 1000, format, arguments);
    va_end(arguments);
}

/* ---- the kinds --------------------------------------------------------------------------------------------------- */

/* Points of a sphere: all of them are corners, so that every triangle stays in the way of later points. */
static void place_on_sphere(input *in) {
    for (int i = 0; i < in->size; i++) {
        const double turn = 2.399963229728653 * i, z = 1.0 - (2.0 * i + 1.0) / in->size, r = sqrt(1.0 - z * z);
        in->points[3 * i] = r * cos(turn);
        in->points[3 * i + 1] = r * sin(turn);
        in->points[3 * i + 2] = z;
    }
}

static bool make_hull(const input *in) {
    kt_triangles mesh = {.vertices = NULL};
    kt_error error = {0};
    const kt_status status = kt_triangles_make(in->points, in->size, NULL, 0, &mesh, &error);
    const bool is_right = status == KT_OK && mesh.triangle_count == 2 * in->size - 4;
    kt_triangles_free(&mesh);
    return is_right;
}

/* Links of one name, or of names of 17 characters, neither letter nor digit, that become one. */
static void name_links(input *in, bool is_one_name) {
    add(in, "<robot name='r'><link name='base'/>");
    for (int i = 0; i < in->size; i++) {
        char name[20] = "a";
        for (int k = 0; k < 17 && !is_one_name; k++)
            name[k] = i >> k & 1 ? '.' : '/';
        add(in, "<link name='%s'/><joint name='j%d' type='fixed'><parent link='base'/><child link='%s'/></joint>", name,
            i, name);
    }
    add(in, "</robot>");
}

static void name_links_equally(input *in) { name_links(in, true); }
static void name_links_alike(input *in) { name_links(in, false); }

static bool read_robot(const input *in, kt_status expected) {
    kt_scene scene;
    kt_error error = {0};
    const kt_status status = kt_robot_parse("r.urdf", in->text, in->length, NULL, &scene, NULL, NULL, &error);
    if (status == KT_OK)
        kt_scene_free(&scene);
    return status == expected;
}

static bool reject_equal_links(const input *in) { return read_robot(in, KT_ERROR_SCENE); }
static bool read_alike_links(const input *in) { return read_robot(in, KT_OK); }

/* Two bodies with many markers, each of one name or of its own. */
static void add_ends(input *in, bool has_markers, bool is_one_name) {
    static const char *const ends[] = {"a", "b"};
    add(in, "kinetree: 1\nbodies:\n");
    for (int k = 0; k < 2; k++) {
        add(in, "  - name: %s\n    joint: {type: revolute, at: [%d, 0, 0]}\n    mass: 1\n    inertia: [1, 1, 1]\n%s",
            ends[k], 2 * k, has_markers ? "    markers:\n" : "");
        for (int i = 0; i < in->size && has_markers; i++)
            add(in, "      m%d: [%d, 0, %d]\n", is_one_name ? 0 : i, 1 - 2 * k, i);
    }
}

static void repeat_markers(input *in) { add_ends(in, true, true); }

static void repeat_terms(input *in) {
    add_ends(in, false, false);
    add(in, "loops:\n  - name: l\n    type: coupling\n    coefficients:\n");
    for (int i = 0; i < in->size; i++)
        add(in, "      a: %d\n", i);
}

static void close_between_markers(input *in) {
    add_ends(in, true, false);
    add(in, "loops:\n");
    for (int i = 0; i < in->size; i++)
        add(in, "  - {name: l%d, type: inplane, axis: x, between: [a.m%d, b.m%d]}\n", i, i, i);
}

/* A chain of parameters, each one more than the next, in the order that is worst for a reader that goes through them in
 * turn. */
static void chain_parameters(input *in) {
    add(in, "kinetree: 1\nparameters:\n");
    for (int k = 0; k + 1 < in->size; k++)
        add(in, "  p%d: =p%d + 1\n", k, k + 1);
    add(in, "  p%d: 1\nbodies:\n  - {name: a, joint: {type: prismatic}, mass: =p0}\n", in->size - 1);
}

static bool read_and_compile(const input *in, kt_status expected) {
    kt_model_options options = kt_model_options_default();
    kt_scene scene;
    kt_model *model = NULL;
    kt_error error = {0};
    options.isa = KT_ISA_BASE; /* valgrind lacks AVX-512 */
    kt_status status = kt_scene_parse("s.yaml", in->text, in->length, &scene, NULL, NULL, &error);
    if (status != KT_OK)
        return status == expected;
    status = kt_model_compile(&scene.description, &options, &model, &error);
    kt_model_free(model);
    kt_scene_free(&scene);
    return status == expected;
}

static bool reject_scene(const input *in) { return read_and_compile(in, KT_ERROR_MODEL); }
static bool accept_scene(const input *in) { return read_and_compile(in, KT_OK); }

/* Rods of 1 m, each turning about the next coordinate axis at the end of the last rod, or all on the world. They are
 * described from the root to the tip, or from the tip to the root. */
static void describe_rods(input *in, bool is_backwards, bool is_star) {
    kt_body *bodies = calloc((size_t)in->size, sizeof *bodies);
    char(*names)[16] = calloc((size_t)in->size, sizeof *names);
    if (bodies == NULL || names == NULL)
        abort();
    for (int i = 0; i < in->size; i++)
        (void)snprintf(names[i], sizeof names[i], "link%d", i);
    for (int i = 0; i < in->size; i++) {
        const bool is_root = i == 0 || is_star;
        kt_body *body = &bodies[is_backwards ? in->size - 1 - i : i];
        *body = kt_body_of(names[i], is_root ? NULL : names[i - 1], KT_JOINT_REVOLUTE, 1.0);
        body->joint.axis = kt_vec3_make(i % 3 == 0, i % 3 == 1, i % 3 == 2);
        body->joint.at = kt_vec3_make(is_root ? 0.0 : 1.0, 0.0, 0.0);
        body->com = kt_vec3_make(0.5, 0.0, 0.0);
        body->inertia = kt_sym3_make(0.01, 1.0 / 12.0, 1.0 / 12.0, 0.0, 0.0, 0.0);
    }
    in->description = kt_description_of(bodies, in->size, NULL, 0, NULL, 0);
}

static void describe_chain(input *in) { describe_rods(in, false, false); }
static void describe_chain_backwards(input *in) { describe_rods(in, true, false); }
static void describe_star(input *in) { describe_rods(in, false, true); }

static bool compile_rods(const input *in) {
    kt_model_options options = kt_model_options_default();
    kt_model *model = NULL;
    kt_error error = {0};
    options.isa = KT_ISA_BASE;
    const bool is_right = kt_model_compile(&in->description, &options, &model, &error) == KT_OK;
    kt_model_free(model);
    return is_right;
}

/* Work that grows with the square of the size, which the test must find. */
static void prepare_nothing(input *in) { in->length = 0; }

static bool compare_pairs(const input *in) {
    volatile int pairs = 0;
    for (int i = 0; i < in->size; i++)
        for (int k = 0; k < in->size; k++)
            pairs = pairs + 1;
    return pairs == in->size * in->size;
}

/* ---- the program ------------------------------------------------------------------------------------------------- */

static const struct kind {
    const char *name;
    void (*prepare)(input *in);
    bool (*work)(const input *in);
} kinds[] = {
    {"hull", place_on_sphere, make_hull},
    {"equal_links", name_links_equally, reject_equal_links},
    {"links_alike", name_links_alike, read_alike_links},
    {"equal_markers", repeat_markers, reject_scene},
    {"equal_terms", repeat_terms, reject_scene},
    {"loops_between_markers", close_between_markers, accept_scene},
    {"chain_of_parameters", chain_parameters, accept_scene},
    {"chain", describe_chain, compile_rods},
    {"chain_from_its_tip", describe_chain_backwards, compile_rods},
    {"star", describe_star, compile_rods},
    {"pairs", prepare_nothing, compare_pairs},
};
enum { KINDS = sizeof kinds / sizeof *kinds };

bool measured_work(const struct kind *kind, const input *in);

__attribute__((noinline)) bool measured_work(const struct kind *kind, const input *in) { return kind->work(in); }

int main(int argc, char **argv) {
    for (int i = 0; i < KINDS && argc < 3; i++)
        (void)printf("%s\n", kinds[i].name);
    if (argc < 3)
        return 0;
    input in = {.size = atoi(argv[2])};
    in.text = malloc((size_t)in.size * 400 + 2000);
    in.points = malloc((size_t)in.size * 3 * sizeof *in.points);
    if (in.text == NULL || in.points == NULL)
        return 1;
    for (int i = 0; i < KINDS; i++)
        if (strcmp(kinds[i].name, argv[1]) == 0) {
            kinds[i].prepare(&in);
            return measured_work(&kinds[i], &in) ? 0 : 2;
        }
    return 1;
}
