/* The C files of `kinetree export --c`: FILE.c and FILE.h, both whole or not at all. */
#include "subcommands/export_c.h"

#include "base/names.h"
#include "command.h"
#include "records/output.h"

#include "kinetree/codegen.h"

#include <ctype.h>
#include <errno.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KT_EXPORT_NAME = 64 };

/* Reads a list of functions, apart by commas; NULL: the default. Returns 0 after printing an error. */
static unsigned read_function_names(const char *list) {
    unsigned functions = 0;
    if (list == NULL)
        return KT_CODEGEN_FORWARD | KT_CODEGEN_INVERSE | KT_CODEGEN_BIAS | KT_CODEGEN_MASS;
    for (const char *at = list; at != NULL; at = strchr(at, ',') != NULL ? strchr(at, ',') + 1 : NULL) {
        char word[KT_EXPORT_NAME];
        int k = 0;
        (void)snprintf(word, sizeof word, "%.*s", (int)strcspn(at, ","), at);
        while (k < KT_CODEGEN_COUNT && strcmp(kt_codegen_name(k), word) != 0)
            k++;
        if (k < KT_CODEGEN_COUNT) {
            functions |= 1u << k;
            continue;
        }
        kt_nearest nearest = kt_nearest_make(word, NULL);
        for (k = 0; k < KT_CODEGEN_COUNT; k++)
            (void)kt_nearest_try(&nearest, kt_codegen_name(k));
        kt_say("export: --functions has no '%s'%s", word,
               nearest.best != NULL ? kt_ask(&nearest, "").text : "; 'kinetree export --help' lists the functions");
        return 0;
    }
    return functions;
}

/* Writes the name of the files without folder and ending, with which all names in C begin. Returns whether it fits. */
static bool name_of_file(const char *out, char name[KT_EXPORT_NAME]) {
    const char *slash = strrchr(out, '/'), *base = slash != NULL ? slash + 1 : out;
    return snprintf(name, KT_EXPORT_NAME, "%.*s", (int)strlen(base) - 2, base) < KT_EXPORT_NAME;
}

static bool is_name_in_c(const char *name) {
    bool fine = isalpha((unsigned char)name[0]);
    for (const char *at = name; *at != '\0'; at++)
        fine &= isalnum((unsigned char)*at) || *at == '_';
    return fine;
}

int kt_export_c_check(const kt_export_c *c) {
    const size_t length = strlen(c->out);
    char name[KT_EXPORT_NAME];
    if (read_function_names(c->functions) == 0)
        return KT_EXIT_USAGE;
    if (length < 3 || strcmp(c->out + length - 2, ".c") != 0) {
        kt_say("export: --c writes two files; give --out FILE.c, and FILE.h is written next to it");
        return KT_EXIT_USAGE;
    }
    if (!name_of_file(c->out, name)) {
        kt_say("export: names in C begin with that of the file; '%s...' must have at most %d letters, digits and _",
               name, KT_EXPORT_NAME - 1);
        return KT_EXIT_USAGE;
    }
    if (!is_name_in_c(name)) {
        kt_say("export: names in C begin with that of the file; '%s' must begin with a letter and go on with letters, "
               "digits and _",
               name);
        return KT_EXIT_USAGE;
    }
    return -1;
}

/* Opens one of both files for writing. Returns NULL after printing an error. */
static FILE *open_output(kt_output *output, const char *path) {
    if (kt_output_start(output, path) >= 0)
        return NULL;
    FILE *file = fopen(kt_output_path(output), "w");
    if (file == NULL)
        kt_say("%s cannot be written: %s", path, strerror(errno));
    return file;
}

/* Sources beyond this size take compilers minutes and gigabytes, bytes. */
static const long much_source = 2000000;

static void say_source_size(const kt_export_c *c, long size) {
    if (size > much_source)
        fprintf(stderr,
                "%s: warning: %s has %.0f MB, for which a compiler may need minutes and several GB of memory; leave "
                "functions out (--functions; derivatives take most), or use the library\n",
                c->scene, c->out, 1e-6 * (double)size);
}

static int write_source_and_header(const kt_export_c *c, const kt_model *model, const char *header_path) {
    kt_output output[2] = {{.lock = -1}, {.lock = -1}};
    kt_error error = {0};
    char name[KT_EXPORT_NAME];
    (void)name_of_file(c->out, name);
    FILE *source = open_output(&output[0], c->out);
    FILE *header = source != NULL ? open_output(&output[1], header_path) : NULL;
    kt_status status = KT_ERROR_FILE;
    long size = 0;
    if (header != NULL) {
        status = kt_codegen_write(model, name, read_function_names(c->functions), c->constant, source, header, &error);
        if (status != KT_OK)
            kt_say("%s cannot be exported as C: %s%s%s", c->scene, error.where, error.where[0] != '\0' ? ": " : "",
                   error.message);
        size = ftell(source);
    }
    if (source != NULL && fclose(source) != 0 && status == KT_OK)
        status = kt_error_set(NULL, KT_ERROR_FILE, NULL, "-");
    if (header != NULL && fclose(header) != 0 && status == KT_OK)
        status = kt_error_set(NULL, KT_ERROR_FILE, NULL, "-");
    for (int i = 0; i < 2; i++)
        if (kt_output_end(&output[i], status == KT_OK ? KT_OUTPUT_WHOLE : KT_OUTPUT_NOTHING) != 0)
            status = KT_ERROR_FILE;
    if (status == KT_OK)
        say_source_size(c, size);
    return status == KT_OK ? KT_EXIT_DONE : status == KT_ERROR_MODEL ? KT_EXIT_SCENE : KT_EXIT_INTEGRATION;
}

/* Prints which effects the file leaves out. */
static void say_effects(const kt_export_c *c, const kt_model *model) {
    const unsigned with_effects = KT_CODEGEN_EFFECTS | KT_CODEGEN_EFFECT_DERIVATIVES | (unsigned)KT_CODEGEN_STEPS |
                                  (unsigned)KT_CODEGEN_STEP_DERIVATIVES;
    if (kt_effect_count(model) > 0 && !(read_function_names(c->functions) & with_effects))
        fprintf(stderr, "%s: note: left out: forces of effects (%d); add them to tau, or try --functions effects\n",
                c->scene, kt_effect_count(model));
}

/* Prints how many events the file leaves out. */
static void say_events(const kt_export_c *c, const kt_scene *scene) {
    const bool has_until = scene->until.when != NULL;
    if (scene->event_count > 0 || has_until)
        fprintf(stderr, "%s: note: left out: events (%d%s); a program has to watch them, and change q, v and x%s\n",
                c->scene, scene->event_count + has_until, has_until ? ", `until` among them" : "",
                kt_scene_sets(scene) ? "; the header lists the states that they set" : "");
}

int kt_export_c_write(const kt_export_c *c) {
    kt_scene scene;
    kt_model *model = NULL;
    const size_t length = strlen(c->out);
    char *header = malloc(length + 1);
    if (header == NULL) {
        kt_say("export: there is not enough memory");
        return KT_EXIT_INTEGRATION;
    }
    memcpy(header, c->out, length + 1);
    header[length - 1] = 'h';
    int code = kt_load_model(c->scene, c->settings, &scene, &model);
    if (code == KT_EXIT_DONE) {
        code = kt_reject_fmus("export", &scene);
        code = code < 0 ? write_source_and_header(c, model, header) : code;
        if (code == KT_EXIT_DONE) {
            say_effects(c, model);
            say_events(c, &scene);
        }
        kt_model_free(model);
        kt_scene_free(&scene);
    }
    free(header);
    return code;
}
