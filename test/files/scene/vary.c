/* Variables of scenes: every number of every bundled scene, changed by kt_scene_vary, against the scene read with
 * it. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"

#include "document/node.h"
#include "document/number.h"
#include "folder.h"
#include "scene/scene_reader.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "collect.h"

enum { PATH_SIZE = 512 };

/* The results for all numbers. */
typedef struct tally {
    const char *file;
    const char *text;
    size_t size, every; /* that many numbers are passed over for each that is tried */
    size_t seen, tried, followed, fixed, rejected;
    kt_worst same;
} tally;

static kt_status read_with(const tally *t, const char *path, const char *setting, double value, kt_scene *scene) {
    const kt_scene_options options = {.settings = &setting,
                                      .setting_count = setting != NULL,
                                      .variables = &path,
                                      .values = &value,
                                      .variable_count = path != NULL};
    kt_error error = {0};
    return kt_scene_parse_with(t->file, t->text, t->size, &options, scene, NULL, NULL, &error);
}

static bool same_text(const kt_scene *a, const kt_scene *b) {
    bool same = strcmp(kt_test_written(a), kt_test_written(b)) == 0;
    for (int k = 0; k < a->parameter_count; k++)
        same = same && kt_same_bytes(&a->parameters[k].value, &b->parameters[k].value, sizeof(double));
    return same;
}

/* Whether a scene that reading rejects is rejected when it is used, too. */
static bool is_rejected(const kt_scene *scene) {
    kt_error error = {0};
    return kt_description_check(&scene->description, NULL, NULL, &error) != KT_OK ||
           kt_run_check(&scene->run, &error) != KT_OK;
}

static void try_number(tally *t, const char *path, double value) {
    kt_scene varied = kt_scene_default(), anew = kt_scene_default();
    char setting[PATH_SIZE + 40];
    const double other = value != 0.0 ? 1.0625 * value : 0.25;
    kt_error error = {0};
    if (read_with(t, path, NULL, value, &varied) != KT_OK)
        return;
    t->tried++;
    (void)snprintf(setting, sizeof setting, "%s=%.17g", path, other);
    const bool is_right = read_with(t, NULL, setting, 0.0, &anew) == KT_OK;
    const kt_status status = kt_scene_vary(&varied, &other, &error);
    t->followed += status == KT_OK;
    t->fixed += status == KT_ERROR_UNSUPPORTED;
    t->rejected += !is_right;
    if (status == KT_OK)
        kt_worst_near(&t->same, is_right ? !same_text(&varied, &anew) : !is_rejected(&varied), 0.0, 0.5, "%.40s: %.70s",
                      t->file, setting);
    else if (status == KT_ERROR_SCENE)
        kt_worst_near(&t->same, is_right, 0.0, 0.5, "%.40s: %.70s is rejected", t->file, setting);
    kt_scene_free(&anew);
    kt_scene_free(&varied);
}

/* Depth is bounded by KT_NODE_DEPTH_MAX. */
static void walk(tally *t, const kt_node *node, char *path, size_t used) {
    double value;
    if (node->kind == KT_NODE_TEXT) {
        const kt_scalar scalar = kt_scalar_classify(node->of.text, &value);
        if ((scalar == KT_SCALAR_NUMBER || scalar == KT_SCALAR_ANGLE) && strcmp(path, "kinetree") != 0 &&
            t->seen++ % t->every == 0)
            try_number(t, path, value);
        return;
    }
    int k = 0;
    for (const kt_node *child = node->of.first; child != NULL; child = child->next, k++) {
        const bool is_map = node->kind == KT_NODE_MAP;
        const int added = is_map ? snprintf(path + used, PATH_SIZE - used, "%s%s", used > 0 ? "." : "", child->of.text)
                                 : snprintf(path + used, PATH_SIZE - used, "[%d]", k);
        child = is_map ? child->next : child;
        walk(t, child, path, used + (size_t)added);
    }
    path[used] = '\0';
}

static void walk_file(tally *t, const char *name) {
    char path[PATH_SIZE] = "";
    kt_reader reader = {.path = name};
    kt_node *root = NULL;
    const char *text = kt_test_read(kt_bundled_path(name), &t->size);
    t->file = name;
    t->text = text;
    if (kt_node_parse(&reader, text, t->size, &root))
        walk(t, root, path, 0);
    kt_pool_free(reader.scratch.chunks);
    kt_pool_free(reader.keep.chunks);
}

KT_TEST(every_number_of_the_bundled_scenes_changes_as_if_it_were_read) {
    const char *every = getenv("KT_VARY_EVERY"); /* 1: all of them, some 20 s */
    tally t = {.every = every != NULL ? strtoul(every, NULL, 10) : 7, .same = kt_worst_make("another scene")};
    for (int i = 0; kt_bundled(i) != NULL; i++)
        walk_file(&t, kt_bundled(i));
    printf("%zu numbers, %zu tried: %zu change, %zu cannot, %zu rejected\n", t.seen, t.tried, t.followed, t.fixed,
           t.rejected);
    kt_check_worst(&t.same);
    kt_check_above("numbers that change", (double)t.followed, 0.75 * (double)t.tried);
}

static const char *const chain =
    "kinetree: 1\n"
    "parameters: {area: =w*L, L: 2, w: 0.5, rate: =1/(L-1)}\n"
    "bodies: [{name: arm, joint: {type: revolute, velocity: =rate}, mass: =area, com: [=L/2, 0, 0]}]\n"
    "effects: [{type: motor, joint: arm, torque: w*sin(t)}]\n"
    "simulate: {step: =w/100}\n";

static kt_status read_chain(const char *const *variables, int count, kt_scene *scene, kt_error *error) {
    const double values[] = {2.0, 0.5};
    const kt_scene_options options = {.variables = variables, .values = values, .variable_count = count};
    return kt_scene_parse_with("chain", chain, strlen(chain), &options, scene, NULL, NULL, error);
}

KT_TEST(parameters_change_in_the_order_of_their_uses) {
    const char *const length = "L";
    kt_scene scene = kt_scene_default();
    kt_error error = {0};
    kt_need(kt_check_true("read", read_chain(&length, 1, &scene, &error) == KT_OK));
    kt_check_true("3 m", kt_scene_vary(&scene, (double[]){3.0}, &error) == KT_OK);
    kt_check_near("area, before which L stands", scene.parameters[0].value, 1.5, 0.0);
    kt_check_near("mass, of the area", scene.description.bodies[0].mass, 1.5, 0.0);
    kt_check_near("com, of L", scene.description.bodies[0].com.x, 1.5, 0.0);
    kt_check_near("velocity, of a rate", scene.description.bodies[0].joint.velocity[0], 0.5, 0.0);
    kt_check_equal_int("1 m has no rate", kt_scene_vary(&scene, (double[]){1.0}, &error), KT_ERROR_SCENE);
    kt_check_near("mass as before", scene.description.bodies[0].mass, 1.5, 0.0);
    kt_check_near("area as before", scene.parameters[0].value, 1.5, 0.0);
    kt_check_equal_int("not finite", kt_scene_vary(&scene, (double[]){1.0 / 0.0}, &error), KT_ERROR_SCENE);
    kt_scene_free(&scene);
}

/* The first value had no effect, and a table of a sweep showed it. */
KT_TEST(two_paths_of_one_number_are_told) {
    static const char *const paths[][2] = {{"bodies[0].joint.velocity", "bodies.arm.joint.velocity"},
                                           {"parameters.w", "w"}};
    for (int i = 0; i < 2; i++) {
        kt_scene scene = kt_scene_default();
        kt_error error = {0};
        char message[96];
        kt_check_equal_int("read", read_chain(paths[i], 2, &scene, &error), KT_ERROR_SCENE);
        (void)snprintf(message, sizeof message, "'%s' is the same value, and varies already; remove one", paths[i][0]);
        kt_check_contains("message", error.message, message);
        kt_check_contains("where", error.where, paths[i][1]);
    }
}

KT_TEST(what_is_no_number_is_told) {
    const char *const both[] = {"L", "w"};
    kt_scene scene = kt_scene_default();
    kt_error error = {0};
    kt_need(kt_check_true("read", read_chain(both, 2, &scene, &error) == KT_OK));
    kt_check_equal_int("a formula of time", kt_scene_vary(&scene, (double[]){3.0, 1.0}, &error), KT_ERROR_UNSUPPORTED);
    kt_check_text("its place", error.where, "chain:4:45");
    kt_check_near("mass as before", scene.description.bodies[0].mass, 1.0, 0.0);
    kt_scene_free(&scene);
    kt_need(kt_check_true("read without", read_chain(NULL, 0, &scene, &error) == KT_OK));
    kt_check_equal_int("no variables", kt_scene_vary(&scene, (double[]){1.0}, &error), KT_ERROR_ARGUMENT);
    kt_scene_free(&scene);
}
