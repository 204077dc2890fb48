/* Reads and compiles scenes for the subcommands, and prints their errors. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/load.h"
#include "open/start.h"
#include "records/output.h"
#include "text/bytes.h"
#include "text/input.h"

#include "kinetree/import.h"
#include "kinetree/study.h"

#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* ---- standard input ---------------------------------------------------------------------------------------------- */

/* Standard input may be endless; no scene is longer than this, and the reader reports it. */
enum { INPUT_MOST = 65 << 20 };

/* ---- reading ----------------------------------------------------------------------------------------------------- */

typedef struct kt_reported {
    const char *path;
    int faults, most; /* most: printed; 0: all */
} kt_reported;

/* Printed faults of a robot's file. Generated files often repeat one fault many times. */
enum { ROBOT_FAULTS_MOST = 12 };

/* Returns ":LINE:COLUMN" at the end of a location whose path was cut because of its length; NULL: the path is
 * complete. */
static const char *place_in_file(const char *where) {
    const char *end = where + strlen(where);
    if (strncmp(where, "...", 3) != 0)
        return NULL;
    for (int colons = 0; end > where && colons < 2;)
        colons += *--end == ':';
    return *end == ':' ? end : NULL;
}

static void print_scene_fault(void *user, const kt_error *error) {
    kt_reported *reported = user;
    if (reported->faults++ >= reported->most && reported->most > 0)
        return;
    /* The format of compilers, without the command's name: editors recognise FILE:LINE:COLUMN at the start of a
     * line. */
    const char *place = place_in_file(error->where);
    kt_print("%s%s%s%s\n", place != NULL ? reported->path : error->where, place != NULL ? place : "",
             error->where[0] != '\0' ? ": " : "", error->message);
}

/* Decides from the first character of the text. The reader of robots finds the format. */
static bool is_xml(const char *text, size_t size) {
    size_t i = size >= 3 && memcmp(text, "\xEF\xBB\xBF", 3) == 0 ? 3 : 0; /* a byte order mark */
    while (i < size && strchr(" \t\r\n", text[i]) != NULL && text[i] != '\0')
        i++;
    return i < size && text[i] == '<';
}

/* Returns whether a regular file begins as XML does. The name of the file does not matter. */
static bool is_xml_file(const char *path) {
    char text[512];
    kt_error error = {0};
    FILE *file = kt_input_open(path, &kt_input_scene, &error);
    if (file == NULL)
        return false;
    const size_t size = fread(text, 1, sizeof text, file);
    (void)fclose(file);
    return is_xml(text, size);
}

static const char standard_input[] = "(standard input)";
static bool input_is_robot; /* of standard input, which a command reads once */

bool kt_is_robot_scene(const kt_scene *scene) {
    const char *path = kt_scene_path(scene);
    return path != NULL &&
           (strcmp(path, standard_input) == 0 ? input_is_robot : kt_is_robot_name(path) || is_xml_file(path));
}

/* Rejects settings for a robot, which has no parameters and no keys of a scene. Returns -1 without settings, else an
 * exit code. */
static int reject_settings(const char *path, const kt_settings *settings) {
    if (settings == NULL || settings->count == 0)
        return -1;
    return kt_misuse(
        "%s: --set %s: a robot in URDF, MJCF or SDF has no keys of a scene; write it as one by 'kinetree import' first",
        path, settings->text[0]);
}

/* ---- robots ------------------------------------------------------------------------------------------------------ */

/* Adds folders to a search path; the caller frees the result. NULL: memory is insufficient. */
static char *add_folders(char *path, const char *more) {
    const size_t length = path != NULL ? strlen(path) : 0;
    char *longer = path != NULL ? realloc(path, length + strlen(more) + 2) : NULL;
    if (longer == NULL)
        free(path);
    else
        (void)sprintf(longer + length, "%s%s", length > 0 ? ":" : "", more);
    return longer;
}

/* Adds the folders in which Gazebo keeps models of servers. */
static char *add_kept_models(char *path) {
    static const char *const folders[] = {".gz/fuel", ".ignition/fuel"};
    static const char *const variables[] = {"GZ_FUEL_CACHE_PATH", "IGN_FUEL_CACHE_PATH"};
    const char *home = getenv("HOME");
    char folder[4096];
    for (size_t i = 0; i < sizeof variables / sizeof *variables; i++) {
        const char *given = getenv(variables[i]);
        if (given != NULL && *given != '\0')
            return add_folders(path, given);
    }
    for (size_t i = 0; i < sizeof folders / sizeof *folders && home != NULL && path != NULL; i++)
        if ((size_t)snprintf(folder, sizeof folder, "%s/%s", home, folders[i]) < sizeof folder)
            path = add_folders(path, folder);
    return path;
}

/* Returns the search path for packages and models: the given folders, then the folders of the environment. The caller
 * frees it; NULL: memory is insufficient. */
static char *compose_search_path(const char *given) {
    static const char *const variables[] = {"KINETREE_SEARCH", "ROS_PACKAGE_PATH", "GZ_SIM_RESOURCE_PATH",
                                            "GAZEBO_MODEL_PATH"};
    char *path = strdup(given != NULL ? given : "");
    for (size_t i = 0; i < sizeof variables / sizeof *variables && path != NULL; i++) {
        const char *value = getenv(variables[i]);
        if (value != NULL && *value != '\0')
            path = add_folders(path, value);
    }
    return add_kept_models(path);
}

/* ---- notes ------------------------------------------------------------------------------------------------------- */

/* Prints the location of a note. The name of the file is left out if the note before has it, too. Without a place, it
 * is the file alone. */
static void print_location(const kt_scene_note *note, bool has_place, const char **before) {
    const char *place = note->where + strlen(note->where);
    for (int colons = 0; place > note->where && colons < 2;)
        colons += *--place == ':';
    const size_t length = (size_t)(place - note->where);
    const bool is_same = *before != NULL && strncmp(*before, note->where, length + 1) == 0;
    *before = note->where;
    if (is_same)
        kt_print("  %s%s", has_place ? place + 1 : "", has_place ? ": " : "");
    else
        kt_print("%.*s%s: ", (int)length, note->where, has_place ? place : "");
}

static void print_rank(const kt_scene *scene, kt_note_rank rank, const char **before) {
    for (int i = 0; i < scene->note_count; i++) {
        if (scene->notes[i].rank != rank)
            continue;
        print_location(&scene->notes[i], true, before);
        kt_print("%s: %s\n", rank == KT_NOTE_RANK_MOTION ? "warning" : "note", scene->notes[i].what);
    }
}

/* The start and the limits on one line. */
static void print_start(const kt_scene *scene, const char **before) {
    int count = 0;
    for (int i = 0; i < scene->note_count; i++) {
        if (scene->notes[i].rank != KT_NOTE_RANK_START)
            continue;
        if (count == 0)
            print_location(&scene->notes[i], false, before);
        kt_print("%s%s", count++ == 0 ? "note: start and limits: " : "; ", scene->notes[i].what);
    }
    if (count > 0)
        kt_print("\n");
}

/* Prints a line for each warning and for each kind of unknown name, and a line for the start and the limits. All else
 * needs --verbose. */
static void print_notes(const kt_scene *scene, const kt_settings *settings) {
    const bool is_verbose = settings != NULL && settings->is_verbose;
    const char *before = NULL;
    if (settings != NULL && settings->is_quiet)
        return;
    print_rank(scene, KT_NOTE_RANK_MOTION, &before);
    print_rank(scene, KT_NOTE_RANK_NAME, &before);
    if (is_verbose) {
        print_rank(scene, KT_NOTE_RANK_START, &before);
        print_rank(scene, KT_NOTE_RANK_DETAIL, &before);
    } else {
        print_start(scene, &before);
    }
}

/* Whether an option for robots is given, which a scene has no use for; reports it. */
static bool reject_robot_options(const char *name, const kt_settings *settings) {
    const struct kt_robot_how *how = settings != NULL ? &settings->robot : NULL;
    if (how == NULL || (!how->floating && !how->contacts && how->ground == NULL && how->keyframe == NULL &&
                        how->search == NULL && how->allow == NULL && how->inertia == 0 && how->stops == 0.0 &&
                        how->stop_damping == 0.0 && how->density == 0.0 && how->masses.count == 0))
        return false;
    kt_say("%s: --floating, --keyframe, --contacts, --ground, --stops, --stop-damping, --inertia, --density, --mass, "
           "--search and --allow are for robots in URDF, MJCF or SDF; this is a scene",
           name);
    return true;
}

static int read_any(const char *path, bool is_robot, const kt_robot_options *options, const kt_settings *settings,
                    kt_scene *scene) {
    kt_scene_options how = kt_scene_options_default();
    how.settings = settings != NULL ? settings->text : NULL;
    how.setting_count = settings != NULL ? settings->count : 0;
    how.gives_step = settings != NULL && settings->gives_step;
    kt_reported reported = {.path = path, .most = is_robot ? ROBOT_FAULTS_MOST : 0};
    kt_error error = {0};
    kt_status status;
    if (strcmp(path, "-") == 0) {
        kt_bytes input = {0};
        errno = 0;
        if (!kt_bytes_read(&input, stdin, INPUT_MOST))
            return kt_reject(KT_EXIT_SCENE, "standard input cannot be read: %s", strerror(errno != 0 ? errno : ENOMEM));
        const char *const name = standard_input;
        is_robot = is_robot || is_xml(input.text, input.used);
        input_is_robot = is_robot;
        reported.most = is_robot ? ROBOT_FAULTS_MOST : 0;
        if (is_robot ? reject_settings(name, settings) >= 0 : reject_robot_options(name, settings)) {
            free(input.text);
            return KT_EXIT_USAGE;
        }
        status =
            is_robot
                ? kt_robot_parse(name, input.text, input.used, options, scene, print_scene_fault, &reported, &error)
                : kt_scene_parse_with(name, input.text, input.used, &how, scene, print_scene_fault, &reported, &error);
        free(input.text);
    } else if (is_robot && reject_settings(path, settings) >= 0) {
        return KT_EXIT_USAGE;
    } else if (is_robot) {
        status = kt_robot_read(path, options, scene, print_scene_fault, &reported, &error);
    } else {
        status = kt_scene_read_with(path, &how, scene, print_scene_fault, &reported, &error);
    }
    if (status != KT_OK && reported.faults == 0)
        kt_say_error(&error);
    if (reported.most > 0 && reported.faults > reported.most)
        kt_say("%s has %d more errors; mend these first", path, reported.faults - reported.most);
    if (status == KT_OK)
        print_notes(scene, settings);
    if (status == KT_ERROR_FILE)
        kt_missing_suggest(path);
    return kt_exit_code(status);
}

/* Reads a scene or a robot. The folders of the environment extend the search path of robots. */
static int read_with(const char *path, bool is_robot, const kt_robot_options *options, const kt_settings *settings,
                     kt_scene *scene) {
    kt_robot_options with = *options;
    char *search = compose_search_path(options->search);
    if (search == NULL)
        return kt_reject(KT_EXIT_SCENE, "there is not enough memory");
    with.search = search;
    const int code = read_any(path, is_robot, &with, settings, scene);
    free(search);
    return code;
}

bool kt_robot_how_apply(const struct kt_robot_how *how, kt_robot_options *options) {
    char *end;
    options->floating = how->floating;
    options->contacts = how->contacts;
    options->keyframe = how->keyframe;
    options->search = how->search;
    options->allow = how->allow;
    options->inertia = (kt_robot_inertia)how->inertia;
    options->stop_stiffness = how->stops;
    options->stop_damping = how->stop_damping;
    options->density = how->density;
    options->masses = how->masses.text;
    options->mass_count = how->masses.count;
    if (how->stop_damping != 0.0 && how->stops == 0.0) {
        kt_say("--stop-damping has nothing to act on: --stops STIFFNESS goes with it");
        return false;
    }
    options->has_ground = how->ground != NULL;
    if (how->ground == NULL)
        return true;
    options->ground = strtod(strncmp(how->ground, "z=", 2) == 0 ? how->ground + 2 : how->ground, &end);
    if (*end != '\0' || !isfinite(options->ground)) {
        kt_say("--ground is a height in m, such as 0, not '%s'", how->ground);
        return false;
    }
    if (!how->contacts)
        kt_say("--ground is for contacts; give --contacts, too");
    return how->contacts;
}

int kt_read_scene_as_written(const char *path, const kt_settings *settings, kt_scene *scene) {
    const bool is_robot = kt_is_robot_name(path) || is_xml_file(path), may_be = is_robot || strcmp(path, "-") == 0;
    kt_robot_options options = {0};
    if (!may_be && access(path, F_OK) == 0 && reject_robot_options(path, settings))
        return KT_EXIT_USAGE;
    if (settings != NULL && !kt_robot_how_apply(&settings->robot, &options))
        return KT_EXIT_USAGE;
    return may_be ? read_with(path, is_robot, &options, settings, scene) : read_any(path, false, NULL, settings, scene);
}

int kt_read_robot(const char *path, const kt_robot_options *options, const kt_settings *settings, kt_scene *scene) {
    return read_with(path, true, options, settings, scene);
}

typedef struct kt_reported_at {
    const kt_scene *scene;
    kt_reported reported;
} kt_reported_at;

static void report_located(void *user, const kt_place *place, const kt_error *fault) {
    kt_reported_at *of = user;
    kt_error error = *fault;
    (void)place;
    (void)kt_scene_locate(of->scene, &error);
    print_scene_fault(&of->reported, &error);
}

void kt_say_located(const kt_scene *scene, kt_error *error) {
    kt_reported reported = {.path = kt_scene_path(scene)};
    if (kt_scene_locate(scene, error))
        print_scene_fault(&reported, error);
    else
        kt_say_error(error);
}

/* Prints every error that concerns the mechanism as a whole; if there is none, the error from its compilation. */
static void report_all(const kt_scene *scene, kt_error *found) {
    kt_reported_at of = {.scene = scene, .reported.path = kt_scene_path(scene)};
    kt_error error = {0};
    if (kt_model_check(&scene->description, report_located, &of, &error) == KT_OK || of.reported.faults == 0)
        kt_say_located(scene, found);
}

int kt_compile_absolute(const kt_scene *scene, const kt_model *model, kt_absolute **absolute) {
    const kt_model_options options = kt_compile_options(scene);
    kt_error error = {0};
    *absolute = NULL;
    if (scene->formulation != KT_FORMULATION_ABSOLUTE)
        return KT_EXIT_DONE;
    const kt_status status = kt_absolute_create(&scene->description, &options, model, absolute, &error);
    if (status == KT_ERROR_MODEL)
        report_all(scene, &error);
    else if (status != KT_OK)
        kt_say_error(&error);
    return kt_exit_code(status);
}

const kt_model *kt_integrated_model(const kt_model *model, const kt_absolute *absolute) {
    return absolute != NULL ? kt_absolute_model(absolute) : model;
}

int kt_compile_scene(const kt_scene *scene, kt_model **model) {
    kt_error error = {0};
    const kt_model_options options = kt_compile_options(scene);
    kt_status status = kt_model_compile(&scene->description, &options, model, &error);
    if (status == KT_ERROR_MODEL)
        report_all(scene, &error);
    else if (status != KT_OK)
        kt_say_error(&error);
    if (status == KT_OK) {
        (void)kt_start_say_inertias(scene);
        kt_start_say_massless(*model);
    }
    return kt_exit_code(status);
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

static kt_status write_scene_stream(FILE *file, const void *scene, kt_error *error) {
    return kt_scene_write(scene, file, error);
}

int kt_write_scene(const kt_scene *scene, const char *path, kt_status status, kt_error *error) {
    if (status == KT_OK)
        status = kt_output_fill(path, write_scene_stream, scene, error);
    if (status == KT_OK)
        return KT_EXIT_DONE;
    return kt_reject(KT_EXIT_INTEGRATION, "%s cannot be written: %s", kt_show_result(path).text,
                     error->message[0] != '\0' ? error->message : kt_status_text(status));
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

const char *kt_title_of(const kt_model *model, const char *base) {
    const char *name = kt_model_name(model);
    return name != NULL && *name != '\0' ? name : base;
}

char *kt_base_name(const char *path) {
    if (strcmp(path, "-") == 0)
        return strdup("scene");
    const char *slash = strrchr(path, '/');
    const char *name = slash != NULL ? slash + 1 : path;
    const char *dot = strrchr(name, '.');
    size_t length = dot != NULL && dot != name ? (size_t)(dot - name) : strlen(name);
    return strndup(name, length);
}
