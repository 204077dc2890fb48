/* Bundled scenes in which a part is missing or replaced: each is read and simulated, or an error gives the reason.
 *
 * The test cuts every scene, as a tree of nodes (lib/files/document/node.h). It leaves out each key and each item in
 * turn, replaces each value by another, leaves out any two sections, and keeps each section alone.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"
#include "kinetree/simulation.h"

#include "collect.h"
#include "document/node.h"
#include "folder.h"
#include "scene/scene_reader.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"

enum { PATH_SIZE = 512, SIMULATED = 20 /* one in so many of the cuts that compile */ };

/* The values that replace a value. */
static const char *const values[] = {"", "3", "-1e300", "[]", "{}", "[[x]]", "{x: {y: 1}}", "world", "\"0/0\""};
enum { VALUES = sizeof values / sizeof values[0] };

typedef struct cutting {
    const char *file;
    const kt_node *root, *cut, *second, *alone;                   /* missing; all other sections than `alone` are */
    const char *value;                                            /* in place of `cut`; NULL: missing */
    size_t seen, tried, read, compiled, simulated, silent, every; /* every: one in so many parts is cut */
    char path[PATH_SIZE];
} cutting;

/* ---- the text of a tree ------------------------------------------------------------------------------------------ */

static void write_scalar(FILE *to, const kt_node *node) {
    if (node->plain && node->count > 0) {
        (void)fputs(node->of.text, to);
        return;
    }
    (void)fputc('"', to);
    for (const char *c = node->of.text; *c != '\0'; c++)
        if (*c == '\n')
            (void)fputs("\\n", to);
        else
            (void)fprintf(to, *c == '"' || *c == '\\' ? "\\%c" : "%c", *c);
    (void)fputc('"', to);
}

static bool is_cut(const cutting *c, const kt_node *parent, const kt_node *child) {
    if (parent == c->root && c->alone != NULL)
        return child != c->alone && child != c->root->of.first; /* the version comes first */
    return (child == c->cut && c->value == NULL) || child == c->second;
}

/* In block style, so that plain text stays plain. Depth is bounded by KT_NODE_DEPTH_MAX. */
static void write_node(FILE *to, const cutting *c, const kt_node *node, int depth) {
    const bool is_map = node->kind == KT_NODE_MAP;
    int written = 0;
    if (node == c->cut && c->value != NULL) {
        (void)fprintf(to, " %s\n", c->value);
        return;
    }
    if (node->kind == KT_NODE_TEXT) {
        (void)fputc(' ', to);
        write_scalar(to, node);
        (void)fputc('\n', to);
        return;
    }
    for (const kt_node *child = node->of.first; child != NULL; child = child->next) {
        const kt_node *key = child;
        child = is_map ? child->next : child;
        if (is_cut(c, node, is_map ? key : child))
            continue;
        (void)fprintf(to, "%s%*s", written++ == 0 ? "\n" : "", 2 * depth, "");
        if (is_map)
            write_scalar(to, key);
        (void)fputs(is_map ? ":" : "-", to);
        write_node(to, c, child, depth + 1);
    }
    if (written == 0)
        (void)fputs(is_map ? " {}\n" : " []\n", to);
}

/* ---- what becomes of it ------------------------------------------------------------------------------------------ */

static bool is_told(const kt_error *error, kt_status status) {
    return error->code == status && error->message[0] != '\0';
}

static bool simulate(cutting *c, const kt_scene *scene, const kt_model *model) {
    kt_simulation *simulation = NULL;
    kt_error error = {0};
    kt_status status = kt_simulation_create(model, &scene->run, NULL, &simulation, &error);
    for (int k = 0; k < 2 && status == KT_OK; k++)
        status = kt_simulation_step(simulation, 1e-3, &error);
    kt_simulation_free(simulation);
    c->simulated++;
    return status == KT_OK || is_told(&error, status);
}

static bool is_fine(cutting *c, const char *text, size_t size) {
    kt_scene scene = kt_scene_default();
    kt_model *model = NULL;
    kt_error error = {0};
    kt_status status = kt_scene_parse(c->path, text, size, &scene, NULL, NULL, &error);
    c->tried++;
    if (status != KT_OK)
        return is_told(&error, status) && strchr(error.where, ':') != NULL;
    c->read++;
    status = kt_model_compile(&scene.description, NULL, &model, &error);
    bool fine = status == KT_OK || is_told(&error, status);
    if (status == KT_OK && c->compiled++ % SIMULATED == 0)
        fine = simulate(c, &scene, model);
    kt_model_free(model);
    kt_scene_free(&scene);
    return fine;
}

static void try_text(cutting *c) {
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (stream == NULL) {
        c->silent++;
        return;
    }
    write_node(stream, c, c->root, 0);
    (void)fclose(stream);
    if (!is_fine(c, text, size)) {
        c->silent++;
        kt_note("%s: fails without an error:\n%.2000s", c->file, text);
    }
    free(text);
}

/* ---- which parts ------------------------------------------------------------------------------------------------- */

static void cut_all(cutting *c, const kt_node *node) {
    const bool is_map = node->kind == KT_NODE_MAP;
    if (node->kind == KT_NODE_TEXT)
        return;
    for (const kt_node *child = node->of.first; child != NULL; child = child->next) {
        const bool chosen = c->seen++ % c->every == 0;
        c->cut = child;
        c->value = NULL;
        if (chosen)
            try_text(c);
        child = is_map ? child->next : child;
        c->cut = child;
        c->value = values[c->tried % VALUES];
        if (chosen)
            try_text(c);
        cut_all(c, child);
    }
    c->cut = NULL;
}

static void cut_sections(cutting *c) {
    const kt_node *const version = c->root->of.first;
    c->value = NULL;
    for (const kt_node *a = version; a != NULL; a = a->next->next) {
        c->alone = a;
        try_text(c);
        c->alone = NULL;
        for (const kt_node *b = a->next->next; b != NULL && a != version; b = b->next->next) {
            c->cut = a;
            c->second = b;
            try_text(c);
        }
        c->cut = c->second = NULL;
    }
}

static void cut_file(cutting *c, const char *name) {
    kt_reader reader = {.path = name};
    kt_node *root = NULL;
    size_t size;
    (void)snprintf(c->path, sizeof c->path, "%s", kt_bundled_path(name));
    const char *text = kt_test_read(c->path, &size);
    c->file = name;
    kt_need(kt_check_true(name, size > 0 && kt_node_parse(&reader, text, size, &root) && root->kind == KT_NODE_MAP));
    c->root = root;
    cut_all(c, root);
    cut_sections(c);
    kt_pool_free(reader.scratch.chunks);
    kt_pool_free(reader.keep.chunks);
}

KT_TEST(scenes_of_which_a_part_is_missing_are_read_or_rejected) {
    const char *every = getenv("KT_CUT_EVERY"); /* 1: all of them, some 30 s */
    cutting c = {.every = every != NULL ? strtoul(every, NULL, 10) : 13};
    for (int i = 0; kt_bundled(i) != NULL; i++)
        cut_file(&c, kt_bundled(i));
    printf("%zu scenes: %zu are read, %zu compile, %zu of them are simulated\n", c.tried, c.read, c.compiled,
           c.simulated);
    kt_check_equal_int("without an error", (long long)c.silent, 0);
    kt_check_above("scenes", (double)c.tried, 3000.0);
    kt_check_above("compile", (double)c.compiled, 0.1 * (double)c.tried);
}
