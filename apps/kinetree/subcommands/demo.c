/* kinetree demo: lists and runs the bundled scenes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/bundled.h"
#include "subcommands/run.h"
#include "text/arguments.h"

#include <dirent.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { FOLDER_SIZE = 4096, PATH_SIZE = FOLDER_SIZE + 260 };

typedef struct kt_demo_arguments {
    bool force;
} kt_demo_arguments;

#define KT_AT(member) offsetof(kt_demo_arguments, member)

static const kt_option options[] = {
    KT_FLAG("force", force, "replace existing results"),
};

const kt_usage kt_usage_demo = {
    .command = "demo",
    .examples = "  kinetree demo\n"
                "  kinetree demo pendulum\n"
                "  kinetree demo pendulum --duration 3 --plot pendulum.svg\n",
    .operands = "[NAME [OPTION OF run...]]",
    .about = "Without a name, lists the bundled scenes.\n"
             "With a name, runs the scene as 'kinetree run' does, with the options of 'kinetree run'.\n"
             "Existing results stay, unless --force is given.\n"
             "The command also writes a page that shows the motion, NAME.html, unless --out names a file.\n"
             "KINETREE_SCENES=FOLDER lists and runs the scenes of another folder.\n",
    KT_OPTIONS_OF(options),
    .also = &kt_usage_run,
};

/* ---- listing ----------------------------------------------------------------------------------------------------- */

static void list_scene(const char *folder, const char *file, int width) {
    char path[PATH_SIZE];
    kt_scene scene;
    kt_error error;
    (void)snprintf(path, sizeof path, "%s/%s", folder, file);
    int length = (int)strlen(file) - 5;
    if (kt_scene_read(path, &scene, NULL, NULL, &error) != KT_OK) {
        printf("%-*.*s  (does not read; 'kinetree check %s' shows the reason)\n", width, length, file, path);
        return;
    }
    printf("%-*.*s  %s\n", width, length, file,
           scene.description.name != NULL ? kt_show(scene.description.name).text : "");
    kt_scene_free(&scene);
}

static int list_demos(const char *folder, struct dirent **entries, int count) {
    int width = 0;
    for (int i = 0; i < count; i++) {
        int length = (int)strlen(entries[i]->d_name) - 5;
        width = length > width ? length : width;
    }
    for (int i = 0; i < count; i++)
        list_scene(folder, entries[i]->d_name, width);
    return kt_finish_output(KT_EXIT_DONE);
}

/* ---- running ----------------------------------------------------------------------------------------------------- */

static int say_unknown_demo(const char *name, struct dirent **entries, int count) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (int i = 0; i < count; i++) {
        entries[i]->d_name[strlen(entries[i]->d_name) - 5] = '\0';
        (void)kt_nearest_try(&nearest, entries[i]->d_name);
    }
    return kt_misuse("demo: there is no scene '%s'%s", name, kt_ask(&nearest, "", "; 'kinetree demo' lists them").text);
}

/* Removes --force from the arguments, at any position; the others are passed to `kinetree run`. Returns whether it was
 * there. */
static bool take_force(int *argc, char **argv) {
    int count = 0;
    for (int i = 0; i < *argc; i++)
        if (strcmp(argv[i], "--force") != 0)
            argv[count++] = argv[i];
    const bool forces = count < *argc;
    argv[count] = NULL;
    *argc = count;
    return forces;
}

static int run_demo(int argc, char **argv, bool forces, const char *folder, struct dirent **entries, int count) {
    char path[PATH_SIZE], file[PATH_SIZE];
    int found = -1;
    snprintf(file, sizeof file, "%s.yaml", argv[1]);
    for (int i = 0; i < count; i++)
        if (strcmp(entries[i]->d_name, file) == 0 || strcmp(entries[i]->d_name, argv[1]) == 0)
            found = i;
    if (found < 0)
        return say_unknown_demo(argv[1], entries, count);
    (void)snprintf(path, sizeof path, "%s/%s", folder, entries[found]->d_name);
    argv[0] = (char[]){"run"};
    argv[1] = path;
    const kt_run_manner manner = {.usage = &kt_usage_run, .has_records = true, .has_view = true, .is_careful = !forces};
    return kt_run_command(argc, argv, &manner);
}

int kt_command_demo(int argc, char **argv) {
    char folder[FOLDER_SIZE];
    struct dirent **entries = NULL;
    const bool forces = take_force(&argc, argv);
    if (argc < 2 || argv[1][0] == '-') {
        kt_demo_arguments arguments = {false};
        int code = kt_arguments_read(&kt_usage_demo, argc, argv, &arguments, NULL);
        if (code >= 0)
            return code;
    }
    if (!kt_bundled_find(folder, sizeof folder, true))
        return KT_EXIT_SCENE;
    int count = scandir(folder, &entries, kt_is_bundled_scene, alphasort);
    if (count < 0)
        return kt_reject(KT_EXIT_SCENE, "demo: %s cannot be read", folder);
    int code = argc < 2 ? list_demos(folder, entries, count) : run_demo(argc, argv, forces, folder, entries, count);
    for (int i = 0; i < count; i++)
        free(entries[i]);
    free(entries);
    return code;
}
