/* Accelerations by compiled code.
 *
 * The key of a compiled file is a sum over the text of its source without the numbers of the parameters, over the
 * compiler, and over the version. Runs that differ in masses or stiffnesses thus share a file, and each passes its own
 * numbers to it.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "native/native.h"

#include "base/sum.h"
#include "command.h"
#include "subcommands/run.h"

#include "kinetree/loop.h"

#include <dlfcn.h>
#include <errno.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* Functions behind the generated ones: sizes, and numbers in place of a struct. */
static const char own_functions[] = "\n#include <string.h>\n\n"
                                    "/* ---- for --native ---- */\n\n"
                                    "unsigned long long native_about(int k) {\n"
                                    "    return k == 0   ? native_STRUCTURE\n"
                                    "           : k == 1 ? sizeof(native_parameters)\n"
                                    "                    : sizeof(native_model);\n}\n\n"
                                    "void native_renew(const double *numbers, void *generic) {\n"
                                    "    native_parameters p;\n"
                                    "    memcpy(&p, numbers, sizeof p);\n"
                                    "    native_prepare(&p, generic);\n}\n";

/* Bytes of a source beyond which it does not pay. */
enum { SOURCE_MOST = 2000000 };

typedef unsigned long long native_about(int k);

/* Both files as text. */
typedef struct native_text {
    char *source, *header;
} native_text;

/* ---- what is rejected -------------------------------------------------------------------------------------------- */

/* Returns why the accelerations of a scene are not those of one file; NULL: they are. */
static const char *why_not_native(const kt_scene *scene, const kt_model *model) {
    return kt_scene_needs_settable(scene) ? "its events set numbers of the model"
           : kt_switch_count(model) > 0   ? "its loops or effects are switched, or contacts close"
           : scene->formulation != 0      ? "the absolute formulation has other equations"
           : scene->reduction != 0        ? "generated code has its own reduction (leave out --reduction)"
                                          : NULL;
}

static int reject_native(const char *command, const kt_scene *scene, const kt_model *model) {
    const char *why = why_not_native(scene, model);
    if (why == NULL)
        return -1;
    return kt_reject(KT_EXIT_SCENE, "%s: --native cannot compute this scene: %s; leave --native out", command, why);
}

/* Planar trees: each link of a generated file waits for a division of the next one, while the library takes 25 ns for a
 * link. Chains of 2, 8, 12 and 20 links take 0.4, 0.7, 1.0 and 1.2 of its time, and branched trees of 15 and 31 links
 * 0.9 and 1.1. */
bool kt_native_is_slow(const kt_model *model) {
    enum { PLANAR_MOST = 12 };
    return kt_loop_count(model) == 0 && kt_model_nv(model) > PLANAR_MOST && strcmp(kt_model_plan(model), "planar") == 0;
}

/* ---- generation -------------------------------------------------------------------------------------------------- */

static int generate_native(const char *command, const kt_model *model, native_text *text) {
    size_t size[2];
    kt_error error = {0};
    FILE *source = open_memstream(&text->source, &size[0]), *header = open_memstream(&text->header, &size[1]);
    kt_status status = KT_ERROR_MEMORY;
    if (source != NULL && header != NULL)
        status = kt_codegen_write(model, "native", KT_CODEGEN_ACCELERATION, false, source, header, &error);
    if (source != NULL && (fputs(own_functions, source) < 0 || fclose(source) != 0))
        status = status == KT_OK ? KT_ERROR_MEMORY : status;
    if (header != NULL && fclose(header) != 0)
        status = status == KT_OK ? KT_ERROR_MEMORY : status;
    if (status == KT_OK && size[0] <= SOURCE_MOST)
        return -1;
    if (status == KT_ERROR_MEMORY)
        return kt_say_no_memory(NULL);
    if (status == KT_OK)
        return kt_reject(KT_EXIT_SCENE,
                         "%s: --native cannot compute this scene: its code has %.1f MB, which compilers take minutes "
                         "for, and is slower than the library; leave --native out",
                         command, 1e-6 * (double)size[0]);
    return kt_reject(KT_EXIT_SCENE, "%s: --native cannot compute this scene: %s; leave --native out", command,
                     kt_words_of(&error).text);
}

/* Writes the name of the compiled file, made of two sums. */
static void name_native(const native_text *text, const kt_compiler *compiler, char name[64]) {
    const char *numbers = strstr(text->source, "native_default = {"), *behind = text->source;
    uint64_t sum[2] = {KT_SUM_START, 0};
    if (numbers != NULL)
        behind = strstr(numbers, "};");
    for (int i = 0; i < 2; i++) {
        sum[i] = kt_sum_add(sum[i], kt_version(), strlen(kt_version()) + 1);
        sum[i] = kt_sum_add(sum[i], compiler->identity, strlen(compiler->identity) + 1);
        sum[i] = kt_sum_add(sum[i], text->header, strlen(text->header) + 1);
        if (numbers != NULL)
            sum[i] = kt_sum_add(sum[i], text->source, (size_t)(numbers - text->source));
        sum[i] = kt_sum_add(sum[i], behind, strlen(behind));
        sum[1] = sum[0] * 0x9e3779b97f4a7c15u + 1; /* a start of its own */
    }
    (void)snprintf(name, 64, "%016llx%016llx.so", (unsigned long long)sum[0], (unsigned long long)sum[1]);
}

/* ---- compilation ------------------------------------------------------------------------------------------------- */

static bool write_native_file(const char *command, const char *folder, const char *name, const char *text) {
    char path[KT_NATIVE_PATH + 16];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    bool fine = file != NULL && fputs(text, file) >= 0;
    fine = file != NULL && fclose(file) == 0 && fine;
    if (!fine)
        kt_say("%s: --native: %s cannot be written: %s", command, kt_show(path).text, strerror(errno));
    return fine;
}

static bool compile_native(kt_native_file *file, const char *command, const native_text *text,
                           const kt_compiler *compiler, kt_code_cache *cache, const char *path) {
    const double start = kt_clock();
    if (!kt_code_cache_begin(cache, command))
        return false;
    const bool fine = write_native_file(command, cache->build, "native.c", text->source) &&
                      write_native_file(command, cache->build, "native.h", text->header) &&
                      kt_compiler_run(compiler, command, cache->build);
    const bool has = kt_code_cache_end(cache, command, path, fine);
    file->seconds = kt_clock() - start;
    return has;
}

/* ---- loading ----------------------------------------------------------------------------------------------------- */

bool kt_find_symbol(void *library, const char *name, void *function) {
    void *const address = dlsym(library, name);
    memcpy(function, &address, sizeof address);
    return address != NULL;
}

/* Loads a compiled file. Returns false without a message if the file is not one of this structure. */
static bool load_native(kt_native_file *file, uint64_t structure, const char *path) {
    native_about *about;
    file->library = dlopen(path, RTLD_NOW | RTLD_LOCAL);
    if (file->library == NULL || !kt_find_symbol(file->library, "native_about", &about) ||
        !kt_find_symbol(file->library, "native_renew", &file->renew) ||
        !kt_find_symbol(file->library, "native_acceleration", &file->acceleration) || about(0) != structure)
        return false;
    file->structure = structure;
    file->numbers = (size_t)about(1);
    file->prepared = (size_t)about(2);
    return true;
}

static void unload_native(kt_native_file *file) {
    if (file->library != NULL)
        (void)dlclose(file->library);
    file->library = NULL;
}

/* Loads the file from the cache, or compiles it before. A file of the cache that cannot be loaded is compiled again. */
static int take_native(kt_native_file *file, const char *command, uint64_t structure, const native_text *text) {
    kt_compiler compiler;
    kt_code_cache cache;
    char name[64], path[KT_NATIVE_PATH];
    bool is_foreign = false;
    if (!kt_compiler_find(&compiler, command) || !kt_code_cache_open(&cache, command))
        return KT_EXIT_INTEGRATION;
    name_native(text, &compiler, name);
    bool fine = kt_code_cache_path(&cache, name, path);
    const bool has = fine && kt_code_cache_has(command, path, &is_foreign);
    fine = fine && !is_foreign;
    if (fine && !(has && load_native(file, structure, path))) {
        unload_native(file);
        fine = compile_native(file, command, text, &compiler, &cache, path);
        if (fine && !load_native(file, structure, path)) {
            const char *why = dlerror();
            kt_say("%s: --native: the compiled file cannot be loaded%s%s; set CC to a compiler for this machine, or "
                   "leave --native out",
                   command, why != NULL ? ": " : "", why != NULL ? kt_show(why).text : "");
            fine = false;
        }
    }
    if (cache.is_temporary) {
        (void)unlink(path);
        (void)rmdir(cache.folder);
    }
    return fine ? -1 : KT_EXIT_INTEGRATION;
}

int kt_native_file_make(kt_native_file *file, const char *command, const kt_scene *scene, const kt_model *model) {
    native_text text = {NULL, NULL};
    *file = (kt_native_file){.library = NULL};
    int exit = reject_native(command, scene, model);
    exit = exit < 0 ? generate_native(command, model, &text) : exit;
    exit = exit < 0 ? take_native(file, command, kt_codegen_structure(model), &text) : exit;
    free(text.source);
    free(text.header);
    return exit;
}

void kt_native_file_free(kt_native_file *file) { unload_native(file); }

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

kt_status kt_native_code_begin(kt_native_code *code, const kt_native_file *file, const kt_model *model,
                               kt_error *error) {
    const int room = (int)(file->numbers / sizeof(double));
    int count = 0;
    *code = (kt_native_code){.file = file};
    code->numbers = calloc((size_t)room + 1, sizeof *code->numbers);
    code->prepared = malloc(file->prepared + 1);
    if (code->numbers == NULL || code->prepared == NULL)
        return kt_reject_memory(error);
    const kt_status status = kt_codegen_numbers(model, KT_CODEGEN_ACCELERATION, code->numbers, room, &count, error);
    if (status != KT_OK)
        return status;
    if ((count > 0 ? count : 1) != room)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "--native",
                            "the compiled file has %d numbers, and the model %d; remove the folder of compiled files",
                            room, count);
    file->renew(code->numbers, code->prepared);
    code->native =
        (kt_native){.structure = file->structure, .acceleration = file->acceleration, .prepared = code->prepared};
    return KT_OK;
}

void kt_native_code_free(kt_native_code *code) {
    free(code->numbers);
    free(code->prepared);
    code->numbers = code->prepared = NULL;
}

/* ---- what it saves ----------------------------------------------------------------------------------------------- */

/* A state, and the two ways to compute its acceleration. */
typedef struct native_race {
    const kt_native_code *code;
    kt_data *data;
    double t;
    const double *q, *v, *x;
    double *tau, *a;
} native_race;

static bool accelerate_once(const native_race *r, bool natively) {
    const kt_native *native = &r->code->native;
    return natively
               ? native->acceleration(native->prepared, r->t, r->q, r->v, r->x, r->tau, r->a) == 0
               : kt_acceleration_evaluate(native->model, r->data, r->t, r->q, r->v, NULL, NULL, r->a, NULL) == KT_OK;
}

/* Returns the time of one acceleration, s: the least of some groups. NaN if it fails. */
static double time_acceleration(const native_race *r, bool natively) {
    enum { GROUPS = 5 };
    double least = HUGE_VAL;
    int count = 1;
    for (int group = 0; group < GROUPS; group++) {
        const double start = kt_clock();
        for (int k = 0; k < count; k++)
            if (!accelerate_once(r, natively))
                return (double)NAN;
        const double seconds = kt_clock() - start;
        least = fmin(least, seconds / count);
        if (seconds < 1e-4 && count < 1000000) {
            count *= 4;
            group = -1;
        }
    }
    return least;
}

/* Describes the accelerations that the library has computed; "" for none. A try of a step may diverge to states that
 * are beyond the range of angles, and there a joint seems to move no inertia. */
static void describe_left(const kt_native *native, char text[400]) {
    const unsigned long long count = native->left;
    text[0] = '\0';
    if (native->computed == 0 && native->refused > 0)
        (void)snprintf(text, 400, "; the library computed all %llu because no inertia moves with joint '%s' alone",
                       count, kt_show(kt_joint_name(native->model, native->refused)).text);
    else if (native->refused < 0)
        (void)snprintf(text, 400, "; the library computed %llu next to singular positions of loop '%s'", count,
                       kt_show(kt_loop_name(native->model, -native->refused - 1)).text);
    else if (count > 0)
        (void)snprintf(text, 400, "; the library computed %llu, of states beyond the range of the file", count);
}

void kt_native_report(const kt_native_code *code, const kt_simulation *simulation) {
    const kt_model *model = code->native.model;
    const size_t nv = (size_t)kt_model_nv(model), states = (size_t)kt_auxiliary_state_count(model);
    kt_data *data = NULL;
    double *work = calloc(2 * nv + 1, sizeof *work);
    if (work == NULL || kt_data_create(model, &data, NULL) != KT_OK) {
        free(work);
        return;
    }
    const native_race race = {.code = code,
                              .data = data,
                              .t = kt_simulation_time(simulation),
                              .q = kt_simulation_positions(simulation),
                              .v = kt_simulation_velocities(simulation),
                              .x = kt_simulation_auxiliary_states(simulation),
                              .tau = work,
                              .a = work + nv};
    if (states > 0)
        memcpy(kt_auxiliary_states(model, data), race.x, states * sizeof *race.x);
    const double library = time_acceleration(&race, false), native = time_acceleration(&race, true);
    const double gain = library - native, count = (double)code->native.computed;
    char compiler[160] = "the compiled file was in the cache", left[400] = "";
    if (code->file->seconds > 0.0 && gain > 0.0)
        (void)snprintf(compiler, sizeof compiler, "the compiler took %.2g s, which pays from %.2g accelerations on",
                       code->file->seconds, code->file->seconds / gain);
    else if (code->file->seconds > 0.0)
        (void)snprintf(compiler, sizeof compiler, "the compiler took %.2g s", code->file->seconds);
    describe_left(&code->native, left);
    if (code->native.computed == 0 && code->native.left > 0)
        kt_say("--native: leave it out%s", left);
    else if (isnan(gain))
        kt_say("--native: %.0f accelerations; %s%s", count, compiler, left);
    else if (gain > 0.0)
        kt_say("--native: %.0f accelerations of %.2g us instead of %.2g us saved %.2g s; %s%s", count, 1e6 * native,
               1e6 * library, count * gain, compiler, left);
    else
        kt_say("--native: %.0f accelerations of %.2g us, and %.2g us by the library: leave --native out; %s%s", count,
               1e6 * native, 1e6 * library, compiler, left);
    kt_data_free(data);
    free(work);
}
