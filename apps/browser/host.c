/* Functions that the C library of WebAssembly lacks, and the connection to the page.
 *
 * The resource of an FMU is a file. A page has no files, so that kt_page_resource stands for the only one: the linker
 * replaces fopen (--wrap=fopen).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "host.h"

#include "advice/warnings.h"
#include "open/load.h"
#include "open/simulated.h"

#include "picture/load.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const kt_bytes *resource;

void kt_host_offer(const kt_bytes *text) { resource = text; }

FILE *__wrap_fopen(const char *path, const char *mode);
FILE *__wrap_fopen(const char *path, const char *mode) {
    (void)path;
    if (resource == NULL || resource->used == 0 || mode[0] != 'r')
        return NULL;
    return fmemopen(resource->text, resource->used, "r");
}

char *realpath(const char *restrict path, char *restrict resolved);
char *realpath(const char *restrict path, char *restrict resolved) {
    (void)path, (void)resolved;
    return NULL;
}

/* Meshes are in files of their own, so that a page shows bodies without their meshes. */
/* NOLINTNEXTLINE(readability-non-const-parameter): the declaration of the reader of meshes */
kt_status kt_mesh_load(const kt_scene_mesh *from, int most, kt_mesh *surface, kt_solid *solid, kt_error *error) {
    (void)most, (void)surface, (void)solid;
    return kt_error_set(error, KT_ERROR_UNSUPPORTED, from->file, "a page cannot read files");
}

void kt_host_print(kt_host_rank rank, const char *text) { kt_host_message((int)rank, text, strlen(text)); }

/* The messages of the command's files that a page has. */
void kt_say(const char *format, ...) {
    char text[1024];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(text, sizeof text, format, arguments);
    va_end(arguments);
    kt_host_print(KT_HOST_FAULT, text);
}

void kt_say_error(const kt_error *error) { kt_say("%s", kt_words_of(error).text); }

/* The list of a run's warnings in a page: their codes, each with a line feed behind it. The words are in the page. */
struct json_t {
    char codes[4096];
    size_t used;
};

void kt_warn(kt_warnings *warnings, const kt_warning *warning, const char *format, ...) {
    static json_t given; /* one run at a time */
    char what[640], text[1100];
    va_list arguments;
    va_start(arguments, format);
    (void)vsnprintf(what, sizeof what, format, arguments);
    va_end(arguments);
    (void)snprintf(text, sizeof text, "%s. %s.", what, warning->remedy);
    kt_host_print(KT_HOST_NOTE, text);
    if (warnings->list == NULL)
        given = (json_t){.used = 0};
    warnings->list = &given;
    if (given.used + strlen(warning->code) + 2 < sizeof given.codes)
        given.used += (size_t)sprintf(given.codes + given.used, "%s\n", warning->code);
}

bool kt_warnings_have(const kt_warnings *warnings, const char *code) {
    const size_t size = strlen(code);
    for (const char *at = warnings->list != NULL ? warnings->list->codes : ""; *at != '\0'; at = strchr(at, '\n') + 1)
        if (strncmp(at, code, size) == 0 && at[size] == '\n')
            return true;
    return false;
}

/* A page has no robots and no other formulations. */
bool kt_is_robot_scene(const kt_scene *scene) {
    (void)scene;
    return false;
}

kt_status kt_simulated_create(const kt_model *model, const kt_absolute *absolute, const kt_run *run,
                              const kt_simulation_options *options, kt_simulated *made, kt_error *error) {
    (void)absolute;
    *made = (kt_simulated){NULL, NULL};
    return kt_simulation_create(model, run, options, &made->simulation, error);
}

void kt_simulated_free(kt_simulated *made) { kt_simulation_free(made->simulation); }

kt_status kt_simulated_set_state(kt_simulated of, double t, const double *q, const double *v, kt_error *error) {
    return kt_simulation_set_state(of.simulation, t, q, v, error);
}

const double *kt_simulated_positions(kt_simulated of) { return kt_simulation_positions(of.simulation); }
const double *kt_simulated_velocities(kt_simulated of) { return kt_simulation_velocities(of.simulation); }
