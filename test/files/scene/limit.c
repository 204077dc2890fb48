/* Files that are no scenes, and scenes that are too much: a clear word, in bounded time and memory. */
/* SPDX-License-Identifier: Apache-2.0 */
#include <fcntl.h>
#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "check.h"
#include "collect.h"
#include "document/file.h"
#include "document/node.h"
#include "random.h"
#include "sanitized.h"
#include "scene/scene_reader.h"

/* The largest files are smaller in the quick tier, and under sanitizers, which take ten times as long. */
enum { FEWER = KT_ADDRESS_SANITIZER ? 10 : KT_SHORT(4, 1) };

/* A text that grows. */
typedef struct growing {
    char *text;
    size_t length, room;
} growing;

static void add(growing *g, const char *format, ...) __attribute__((format(printf, 2, 3)));

static void add(growing *g, const char *format, ...) {
    if (g->room - g->length < 1024) {
        g->room = 2 * g->room + 4096;
        g->text = realloc(g->text, g->room);
        if (g->text == NULL)
            abort();
    }
    va_list arguments;
    va_start(arguments, format);
    g->length += (size_t)vsnprintf(g->text + g->length, g->room - g->length, format, arguments);
    va_end(arguments);
}

static void repeat(growing *g, const char *part, int count) {
    for (int i = 0; i < count; i++)
        add(g, "%s", part);
}

static kt_collected faults;

/* Parses and releases g; the first fault is in faults.first. */
static kt_status parse(growing *g) {
    kt_scene scene;
    kt_status status = kt_collect_parse(&faults, g->text, &scene);
    if (status == KT_OK)
        kt_scene_free(&scene);
    free(g->text);
    return status;
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

static void check_unreadable(const char *path, const char *message) {
    kt_scene scene;
    kt_error error = {KT_OK, "", ""};
    memset(&faults, 0, sizeof faults);
    kt_check_equal_int(path, kt_scene_read(path, &scene, kt_collect, &faults, &error), KT_ERROR_FILE);
    kt_check_text("where", error.where, path);
    kt_check_text("message", error.message, message);
    kt_check_equal_int("faults reported", faults.count, 0);
}

/* /proc/kmsg reports to be a regular file, and a read of it waits. Here a pipe without a writer's bytes is such a file:
 * the writing end stays open, and the reading end does not wait. */
KT_TEST(read_that_would_wait_is_an_error) {
    static const kt_file_kind kind = {"a table", "a file with a table", 1 << 10, true};
    const char *written[] = {"", "time,x\n0,1\n"};
    for (size_t i = 0; i < sizeof written / sizeof *written; i++) {
        kt_error error = {KT_OK, "", ""};
        char *text = NULL;
        size_t size = 0;
        int ends[2];
        kt_need(kt_check_true("a pipe", pipe(ends) == 0 && fcntl(ends[0], F_SETFL, O_NONBLOCK) == 0));
        kt_check_true("written", write(ends[1], written[i], strlen(written[i])) == (ssize_t)strlen(written[i]));
        kt_check_equal_int("status", kt_file_read_open(ends[0], "kmsg", &kind, &text, &size, &error), KT_ERROR_FILE);
        kt_check_text("where", error.where, "kmsg");
        kt_check_text("message", error.message,
                      "a read of it waits until something is written; name a file with a table");
        kt_check_true("there is no text", text == NULL);
        (void)close(ends[0]);
        (void)close(ends[1]);
    }
}

KT_TEST(what_is_no_file_is_said_in_words) {
    char directory[] = "/tmp/kinetree-limit-XXXXXX", path[64];
    kt_need(kt_check_true("a directory of its own", mkdtemp(directory) != NULL));
    check_unreadable(directory, "this is a directory; name a scene file");
    snprintf(path, sizeof path, "%s/missing.yaml", directory);
    check_unreadable(path, "cannot be read: No such file or directory");
    check_unreadable("", "cannot be read: No such file or directory");
    check_unreadable("/dev/zero", "this is a device; name a scene file");
    snprintf(path, sizeof path, "%s/pipe", directory);
    kt_check_equal_int("a pipe", mkfifo(path, 0600), 0);
    check_unreadable(path, "this is a pipe; name a scene file"); /* without waiting for who would write to it */
    (void)unlink(path);
    snprintf(path, sizeof path, "%s/socket", directory);
    struct sockaddr_un address = {.sun_family = AF_UNIX};
    strcpy(address.sun_path, path);
    const int file = socket(AF_UNIX, SOCK_STREAM, 0);
    kt_check_equal_int("a socket", bind(file, (const struct sockaddr *)&address, sizeof address), 0);
    check_unreadable(path, "cannot be read: No such device or address"); /* one cannot be opened at all */
    (void)close(file);
    (void)unlink(path);
    snprintf(path, sizeof path, "%s/large.yaml", directory);
    FILE *large = fopen(path, "w");
    kt_check_true("a file of more than 64 MB",
                  large != NULL && ftruncate(fileno(large), (off_t)KT_FILE_SIZE_MAX + 1048576) == 0);
    check_unreadable(path, "the file has 65 MB; a scene has at most 64");
    if (large != NULL)
        (void)fclose(large);
    (void)unlink(path);
    (void)rmdir(directory);
}

KT_TEST(file_is_read_as_its_text_is) {
    char path[] = "/tmp/kinetree-limit-XXXXXX";
    int file = mkstemp(path);
    kt_scene scene;
    static const char text[] = "kinetree: 1\nname: from a file\n";
    kt_need(kt_check_true("a file", file >= 0 && write(file, text, sizeof text - 1) == sizeof text - 1));
    (void)close(file);
    const kt_status status = kt_scene_read(path, &scene, NULL, NULL, NULL);
    (void)unlink(path);
    kt_need(kt_check_equal_int("status", status, KT_OK));
    kt_check_text("name", scene.description.name, "from a file");
    kt_scene_free(&scene);
    /* A file of a size that is not available beforehand, and that is no scene. */
    kt_error error;
    if (access("/proc/self/status", R_OK) != 0) {
        kt_skip("a file whose size is not told beforehand", "this system has no /proc/self/status");
        return;
    }
    kt_check_equal_int("/proc/self/status", kt_scene_read("/proc/self/status", &scene, NULL, NULL, &error),
                       KT_ERROR_SCENE);
    kt_check_contains("where", error.where, "/proc/self/status:1:1");
}

KT_TEST(arguments_are_checked) {
    kt_scene scene;
    kt_error error;
    kt_check_equal_int("no path", kt_scene_read(NULL, &scene, NULL, NULL, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no scene", kt_scene_read("x", NULL, NULL, NULL, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no text", kt_scene_parse("x", NULL, 1, &scene, NULL, NULL, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("no scene", kt_scene_parse("x", "", 0, NULL, NULL, NULL, &error), KT_ERROR_ARGUMENT);
    kt_check_equal_int("nothing at all", kt_scene_parse("x", NULL, 0, &scene, NULL, NULL, &error), KT_ERROR_SCENE);
    kt_check_equal_int("too long", kt_scene_parse("x", "", (size_t)KT_FILE_SIZE_MAX + 1, &scene, NULL, NULL, &error),
                       KT_ERROR_FILE);
}

/* The end of a path is more useful than its beginning. */
KT_TEST(long_path_keeps_its_end_and_the_line) {
    char path[600];
    kt_scene scene;
    kt_error error;
    size_t length = 0;
    while (length < 500)
        length += (size_t)snprintf(path + length, sizeof path - length, "\xC3\xA9");
    snprintf(path + length, sizeof path - length, "%s", "ddddddddddddddddddddddddddddddddddddddddddddd/four-bar.yaml");
    kt_check_equal_int("status", kt_scene_parse(path, "x", 1, &scene, NULL, NULL, &error), KT_ERROR_SCENE);
    kt_check_contains("where", error.where, "ddd/four-bar.yaml:1:1");
    kt_check_true("it begins with dots and a whole character",
                  strncmp(error.where, "...", 3) == 0 && ((unsigned char)error.where[3] & 0xC0U) != 0x80U);
}

/* ---- nesting, repetition ----------------------------------------------------------------------------------------- */

KT_TEST(deep_nesting_is_rejected) {
    growing lists = {0}, maps = {0}, blocks = {0};
    add(&lists, "kinetree: 1\nname: ");
    repeat(&lists, "[", 100000);
    kt_check_equal_int("100000 lists", parse(&lists), KT_ERROR_SCENE);
    kt_check_contains("message", faults.first.message, "nested deeper than 32");
    repeat(&maps, "{a: ", 100000);
    kt_check_equal_int("100000 mappings", parse(&maps), KT_ERROR_SCENE);
    kt_check_contains("message", faults.first.message, "nested deeper than 32");
    repeat(&blocks, "- ", 100000);
    kt_check_equal_int("100000 block lists", parse(&blocks), KT_ERROR_SCENE);
    kt_check_contains("message", faults.first.message, "nested deeper than 32");
}

/* The laughs of a hundred lines, each of ten of the one before. */
KT_TEST(aliases_do_not_multiply) {
    growing g = {0};
    add(&g, "kinetree: 1\nbodies:\n  - &a0 {name: a}\n");
    for (int i = 1; i < 100; i++) {
        add(&g, "  - &a%d [", i);
        for (int k = 0; k < 10; k++)
            add(&g, "%s*a%d", k > 0 ? ", " : "", i - 1);
        add(&g, "]\n");
    }
    kt_check_equal_int("status", parse(&g), KT_ERROR_SCENE);
    kt_check_contains("first", faults.first.message, "anchors are not part of a scene file");
    kt_check_equal_int("faults told, with the line on the rest", faults.count, KT_FAULT_COUNT_MAX + 1);
}

KT_TEST(million_aliases_are_rejected) {
    growing g = {0};
    add(&g, "kinetree: 1\nbodies: [&a {name: a}");
    repeat(&g, ", *a", 1000000 / FEWER);
    add(&g, "]\n");
    kt_check_equal_int("status", parse(&g), KT_ERROR_SCENE);
    kt_check_contains("first", faults.first.message, "anchors are not part of a scene file");
    kt_check_contains("last", faults.last.message, "more faults are not listed; mend these first");
}

KT_TEST(endless_faults_are_counted) {
    growing g = {0};
    add(&g, "kinetree: 1\nbodies:\n");
    repeat(&g, "  - {name: a, colour: red}\n", 100000);
    kt_check_equal_int("status", parse(&g), KT_ERROR_SCENE);
    kt_check_equal_int("faults told, with the line on the rest", faults.count, KT_FAULT_COUNT_MAX + 1);
    /* 100000 unknown keys, and 99999 names that are there already. */
    kt_check_text("last", faults.last.message, "198999 more faults are not listed; mend these first");
    kt_check_equal_int("out of order", faults.strange, 0);
}

/* Each of many bodies with a parent that does not exist: suggestions have a budget. */
KT_TEST(endless_suggestions_are_bounded) {
    growing g = {0};
    add(&g, "kinetree: 1\nbodies:\n");
    for (int i = 0; i < 30000; i++)
        add(&g, "  - {name: a_long_name_of_a_body_%d, parent: a_lnog_name_of_a_body_%d}\n", i, i);
    kt_check_equal_int("status", parse(&g), KT_ERROR_MODEL);
    kt_check_contains("first", faults.first.message, "does not exist");
    g = (growing){0};
    add(&g, "kinetree: 1\nbodies:\n");
    for (int i = 0; i < 30000; i++)
        add(&g, "  - {name: a_long_name_of_a_body_%d}\n", i);
    add(&g, "output:\n  markers:\n");
    for (int i = 0; i < 30000; i++)
        add(&g, "    - a_lnog_name_of_a_body_%d.tip\n", i);
    kt_check_equal_int("status", parse(&g), KT_ERROR_SCENE);
    kt_check_contains("first", faults.first.message, "does not exist; did you mean 'a_long_name_of_a_body_0'?");
}

/* Long lists where one of a thing is wanted: a list is read once, a key's text once. */
KT_TEST(long_values_are_read_once) {
    growing g = {0};
    add(&g, "kinetree: 1\ngravity: [");
    repeat(&g, "0, ", 300000);
    add(&g, "0]\n");
    kt_check_equal_int("300001 numbers of gravity", parse(&g), KT_ERROR_SCENE);
    kt_check_text("message", faults.text, "2:10: gravity: expected a list of three numbers, found a list of 300001\n");
    g = (growing){0};
    add(&g, "kinetree: 1\nname: ");
    repeat(&g, "long ", 400000);
    add(&g, "\ngravity: [");
    repeat(&g, "0", 400000);
    add(&g, ".5, 0, 0]\n");
    kt_check_equal_int("a name of 2 MB and a number of 400001 digits", parse(&g), KT_OK);
    g = (growing){0};
    add(&g, "kinetree: 1\nbodies:\n  - name: ");
    repeat(&g, "x", 100000);
    add(&g, "\n    mass: ");
    repeat(&g, "y", 100000);
    add(&g, "\n    ");
    repeat(&g, "z", 1000);
    add(&g, ": 1\n");
    kt_check_equal_int("names and keys of 100000 letters", parse(&g), KT_ERROR_SCENE);
    kt_check_equal_int("faults", faults.count, 2);
    kt_check_equal_int("faults without a place, or cut", faults.strange, 0);
}

KT_TEST(too_many_values_are_rejected) {
    if (KT_ADDRESS_SANITIZER) {
        kt_skip("too many values", "reading eight million takes half a minute under sanitizers");
        return;
    }
    size_t count = (size_t)KT_NODE_COUNT_MAX + 100;
    char *text = malloc(2 * count + 32);
    kt_scene scene;
    kt_error error = {KT_OK, "", ""};
    kt_check_true("memory", text != NULL);
    if (text == NULL)
        return;
    size_t length = (size_t)sprintf(text, "kinetree: 1\nname: [");
    for (size_t i = 0; i < count; i++) {
        text[length++] = '1';
        text[length++] = ',';
    }
    text[length++] = ']';
    kt_check_equal_int("status", kt_scene_parse(NULL, text, length, &scene, NULL, NULL, &error), KT_ERROR_SCENE);
    kt_check_text("message", error.message, "the file has more values than a scene may have (8388608)");
    free(text);
}

/* ---- size -------------------------------------------------------------------------------------------------------- */

/* Anything quadratic would take minutes here. */
KT_TEST(chain_of_many_bodies_is_read) {
    enum { COUNT = 100000 / FEWER };
    growing g = {0};
    kt_scene scene;
    add(&g, "kinetree: 1\nbodies:\n");
    for (int i = COUNT - 1; i >= 0; i--) {
        add(&g, "  - {name: link%d, parent: %s", i, i == 0 ? "world" : "link");
        if (i > 0)
            add(&g, "%d", i - 1);
        add(&g, ", joint: {type: revolute, axis: y, at: [1, 0, 0]}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}\n");
    }
    kt_status status = kt_collect_parse(&faults, g.text, &scene);
    free(g.text);
    kt_need(kt_check_equal_int("status", status, KT_OK));
    kt_check_equal_int("bodies", scene.description.body_count, COUNT);
    char first[16], parent[16];
    (void)snprintf(first, sizeof first, "link%d", COUNT - 1);
    (void)snprintf(parent, sizeof parent, "link%d", COUNT - 2);
    kt_check_text("first", scene.description.bodies[0].name, first);
    kt_check_text("its parent", scene.description.bodies[0].parent, parent);
    const char *written = kt_test_written(&scene);
    kt_scene *again = kt_test_scene(written);
    kt_check_text("last", again->description.bodies[COUNT - 1].name, "link0");
    kt_scene_free(&scene);
}
