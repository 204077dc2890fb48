/* The catalogue of wrong scenes. wrong/NAME.txt has the exact messages for reading wrong/NAME.yaml.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "collect.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "document/file.h"

enum { NAMES_MAX = 400 };

typedef struct names {
    char *name[NAMES_MAX];
    int count;
} names;

static int compare_names(const void *a, const void *b) {
    const char *const *x = a, *const *y = b;
    return strcmp(*x, *y);
}

static bool ends_in(const char *text, const char *end) {
    size_t length = strlen(text), tail = strlen(end);
    return length > tail && strcmp(text + length - tail, end) == 0;
}

static void list_scenes(names *list) {
    DIR *directory = opendir(WRONG_DIRECTORY);
    list->count = 0;
    for (struct dirent *entry; directory != NULL && (entry = readdir(directory)) != NULL;)
        if (ends_in(entry->d_name, ".yaml") && list->count < NAMES_MAX)
            list->name[list->count++] = strndup(entry->d_name, strlen(entry->d_name) - strlen(".yaml"));
    if (directory != NULL)
        (void)closedir(directory);
    qsort(list->name, (size_t)list->count, sizeof *list->name, compare_names);
}

static void free_names(names *list) {
    for (int i = 0; i < list->count; i++)
        free(list->name[i]);
}

/* The whole file, terminated; NULL where there is none. */
static char *load(const char *name, const char *ending, size_t *size) {
    char path[512], *text;
    snprintf(path, sizeof path, "%s/%s%s", WRONG_DIRECTORY, name, ending);
    if (kt_file_read(path, &text, size, NULL) != KT_OK)
        return NULL;
    char *longer = realloc(text, *size + 1);
    if (longer != NULL)
        longer[*size] = '\0';
    return longer;
}

/* In the expected words, {methods} is a placeholder for the names of all methods. {adaptive methods} is a placeholder
 * for those of the adaptive ones. Therefore, a new method changes no text here. The result replaces `text`. */
static char *expand(char *text) {
    static const char *const marks[] = {"{methods}", "{adaptive methods}"};
    char methods[256];
    for (int i = 0; text != NULL && i < 2; i++) {
        char *at = strstr(text, marks[i]), *longer;
        const size_t length = at != NULL ? kt_method_names(i == 1, methods, sizeof methods) : 0;
        if (at == NULL || (longer = malloc(strlen(text) + length + 1)) == NULL)
            continue;
        sprintf(longer, "%.*s%s%s", (int)(at - text), text, methods, at + strlen(marks[i]));
        free(text);
        text = longer;
    }
    return text;
}

static kt_collected faults;

static void check_scene(const char *name) {
    size_t size = 0, expected_size = 0;
    char *text = load(name, ".yaml", &size), *expected = expand(load(name, ".txt", &expected_size));
    const kt_scene untouched = kt_scene_default();
    kt_scene scene;
    kt_error error;
    if (text == NULL || expected == NULL) {
        kt_check_true(name, false);
        free(text);
        free(expected);
        return;
    }
    memcpy(&scene, &untouched, sizeof scene); /* with its padding */
    memset(&faults, 0, sizeof faults);
    snprintf(faults.path, sizeof faults.path, "%s.yaml", name);
    kt_status status = kt_scene_parse(faults.path, text, size, &scene, kt_collect, &faults, &error);
    kt_check_text(name, faults.text, expected);
    kt_check_equal_int("faults without a place, out of order or cut", faults.strange, 0);
    kt_check_true("the call fails with the first fault",
                  status != KT_OK && status == faults.first.code && error.code == status &&
                      strcmp(error.where, faults.first.where) == 0 && strcmp(error.message, faults.first.message) == 0);
    kt_check_true("the scene is untouched", kt_same_bytes(&scene, &untouched, sizeof scene));
    free(text);
    free(expected);
}

KT_TEST(every_wrong_scene_is_told_what_is_wrong_and_where) {
    names list;
    list_scenes(&list);
    kt_check_above("wrong scenes", list.count, 80.0);
    for (int i = 0; i < list.count; i++)
        check_scene(list.name[i]);
    free_names(&list);
}

KT_TEST(without_a_report_the_first_fault_is_the_error) {
    static const char text[] = "kinetree: 1\ngravty: [0, 0, 0]\nbodys: []\n";
    kt_scene scene;
    kt_error error;
    kt_status status = kt_scene_parse(NULL, text, sizeof text - 1, &scene, NULL, NULL, &error);
    kt_check_equal_int("status", status, KT_ERROR_SCENE);
    kt_check_text("where", error.where, "scene:2:1");
    kt_check_text("message", error.message, "unknown key 'gravty'; did you mean 'gravity'?");
    status = kt_scene_parse(NULL, text, sizeof text - 1, &scene, NULL, NULL, NULL);
    kt_check_equal_int("status without an error", status, KT_ERROR_SCENE);
}
