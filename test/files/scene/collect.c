/* SPDX-License-Identifier: Apache-2.0 */
#include "collect.h"

#include "check.h"

#include <dirent.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

bool kt_same_bytes(const void *a, const void *b, size_t size) { return memcmp(a, b, size) == 0; }

/* ":LINE:COLUMN" and nothing after it. */
static bool read_place(const char *text, unsigned *line, unsigned *column) {
    char *end;
    if (*text != ':')
        return false;
    *line = (unsigned)strtoul(text + 1, &end, 10);
    if (*end != ':' || *line == 0)
        return false;
    *column = (unsigned)strtoul(end + 1, &end, 10);
    return *end == '\0' && *column > 0;
}

void kt_collect(void *user, const kt_error *fault) {
    kt_collected *c = user;
    size_t path = strlen(c->path);
    unsigned line = 0, column = 0;
    bool has_place = strncmp(fault->where, c->path, path) == 0 && read_place(fault->where + path, &line, &column);
    bool ordered = c->count == 0 || line > c->line || (line == c->line && column >= c->column);
    size_t length = strlen(fault->message);
    bool cut = length < 8 || strcmp(fault->message + length - 3, "...") == 0;
    if (!has_place || !ordered || cut || fault->code == KT_OK)
        c->strange++;
    if (c->count++ == 0)
        c->first = *fault;
    c->last = *fault;
    c->line = line;
    c->column = column;
    int wrote = snprintf(c->text + c->length, sizeof c->text - c->length, "%u:%u: %s\n", line, column, fault->message);
    if (wrote > 0 && (size_t)wrote < sizeof c->text - c->length)
        c->length += (size_t)wrote;
    else
        c->text[c->length] = '\0';
}

kt_status kt_collect_parse(kt_collected *faults, const char *text, kt_scene *scene) {
    kt_error error;
    memset(faults, 0, sizeof *faults);
    strcpy(faults->path, "test.yaml");
    return kt_scene_parse(faults->path, text, strlen(text), scene, kt_collect, faults, &error);
}

static void release_scene(void *scene) {
    kt_scene_free(scene);
    free(scene);
}

kt_scene *kt_test_scene_place(void) {
    kt_scene *scene = malloc(sizeof *scene);
    kt_need(scene != NULL || kt_check_true("there is memory", false));
    *scene = kt_scene_default();
    kt_test_own(scene, release_scene);
    return scene;
}

kt_scene *kt_test_scene(const char *text) {
    static kt_collected faults;
    kt_scene *scene = kt_test_scene_place();
    const kt_status status = kt_collect_parse(&faults, text, scene);
    if (status != KT_OK || faults.count > 0) {
        kt_note("%.400s", faults.text);
        kt_need(kt_check_true("a right scene is read without a fault", false));
    }
    return scene;
}

kt_scene *kt_test_scene_of(const char *format, ...) {
    static char text[1 << 16];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    return kt_test_scene(text);
}

static void note_fault(void *user, const kt_error *fault) {
    (void)user;
    kt_note("%s: %s", fault->where, fault->message);
}

kt_scene *kt_test_scene_file(const char *path) {
    kt_scene *scene = kt_test_scene_place();
    kt_error error = {0};
    kt_need_fine(path, kt_scene_read(path, scene, note_fault, NULL, &error), &error);
    return scene;
}

static int is_bundled_scene(const struct dirent *entry) {
    const char *end = strrchr(entry->d_name, '.');
    return end != NULL && end != entry->d_name && strcmp(end, ".yaml") == 0;
}

int kt_bundled_count(void) {
    int count = 0;
    while (kt_bundled(count) != NULL)
        count++;
    return count;
}

const char *kt_bundled(int i) {
    static struct dirent **entries;
    static int count;
    if (entries == NULL) {
        count = scandir(KT_SCENES, &entries, is_bundled_scene, alphasort);
        for (int k = 0; k < count; k++)
            *strrchr(entries[k]->d_name, '.') = '\0';
    }
    return i < count ? entries[i]->d_name : NULL;
}

const char *kt_bundled_path(const char *name) {
    static char path[1024];
    (void)snprintf(path, sizeof path, "%s/%s.yaml", KT_SCENES, name);
    return path;
}

kt_scene *kt_test_bundled(const char *name) { return kt_test_scene_file(kt_bundled_path(name)); }

kt_opened kt_test_open(kt_scene *scene, const kt_model_options *options) {
    kt_model *model = kt_test_model(&scene->description, options);
    return (kt_opened){scene, model, kt_test_data(model)};
}

const char *kt_test_written(const kt_scene *scene) {
    char *text = NULL;
    size_t size = 0;
    kt_error error;
    FILE *stream = open_memstream(&text, &size);
    kt_need(stream != NULL || kt_check_true("there is memory", false));
    const kt_status status = kt_scene_write(scene, stream, &error);
    (void)fclose(stream);
    kt_test_own(text, free);
    kt_need_fine("a scene is written", status, &error);
    return text;
}

void kt_check_unwritable(const char *what, const kt_scene *scene, kt_status expected, const char *part) {
    char *text = NULL;
    size_t size = 0;
    kt_error error = {KT_OK, "", ""};
    FILE *stream = open_memstream(&text, &size);
    if (stream == NULL)
        return;
    kt_check_equal_int(what, kt_scene_write(scene, stream, &error), expected);
    (void)fclose(stream);
    kt_check_contains(what, error.message, part);
    kt_check_equal_int("bytes written", (long long)size, 0);
    free(text);
}
