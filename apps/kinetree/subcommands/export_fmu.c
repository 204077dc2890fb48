/* The archive of `kinetree export --fmu` has the description, the binary for this system, and the text of the scene.
 * With --sources it also has the source of the binary in one file, and a description of its build.
 *
 *     modelDescription.xml           binaries/PLATFORM/NAME.so    resources/scene.yaml
 *     sources/buildDescription.xml   sources/kinetree-fmu.c
 *
 * The binary is the same for all scenes. It reads the scene of the resources as a file without a folder. The command
 * reads it in the same way, so that a scene that needs other files is rejected here and not in the importer.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/export_fmu.h"

#include "command.h"
#include "open/bundled.h"
#include "records/output.h"
#include "text/input.h"

#include "kinetree/joint.h"
#include "kinetree/mechanism.h"

#include "../fmu/exchange.h"
#include "../fmu/reference.h"

#include <ctype.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const char ending[] = ".fmu";

enum { KT_FMU_TEXT = 64, KT_FMU_PATH = 4096 };

int kt_export_fmu_check(const kt_export_fmu *fmu) {
    const size_t length = strlen(fmu->out);
    if (length > strlen(ending) && strcmp(fmu->out + length - strlen(ending), ending) == 0)
        return -1;
    return kt_misuse("export: --fmu writes an archive; give --out FILE.fmu");
}

#ifdef KT_WITH_FMU

#include <minizip/zip.h>

/* Writes the name of the binary: that of the archive, with letters, digits and _. */
static void name_of_fmu(const char *out, char name[KT_FMU_TEXT]) {
    const char *slash = strrchr(out, '/'), *base = slash != NULL ? slash + 1 : out;
    (void)snprintf(name, KT_FMU_TEXT, "%s%.*s", isdigit((unsigned char)base[0]) ? "_" : "",
                   (int)(strlen(base) - strlen(ending)), base);
    for (char *at = name; *at != '\0'; at++)
        if (!isalnum((unsigned char)*at))
            *at = '_';
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

/* Reads a whole file. Returns an exit code; text is NULL after printing an error. The caller frees it. */
static int read_content(const char *path, kt_bytes *content) {
    static const kt_file_kind kind = {"a part of an FMU", "a part of an FMU", 256 << 20, false};
    kt_error error = {0};
    *content = (kt_bytes){0};
    if (kt_input_read(path, &kind, &content->text, &content->used, &error) == KT_OK)
        return KT_EXIT_DONE;
    kt_say_error(&error);
    return KT_EXIT_SCENE;
}

/* Reads an installed file. Returns an exit code after printing an error. */
static int read_installed(const char *name, kt_bytes *content) {
    static const char *const places[KT_PLACES] = {KT_FMU_FROM_PROGRAM, KT_FMU_BUILT, KT_FMU_INSTALLED};
    char path[KT_FMU_PATH];
    if (kt_find_installed(places, name, path, sizeof path))
        return read_content(path, content);
    return kt_reject(
        KT_EXIT_INTEGRATION,
        "export: %s, a part of FMUs, is neither in %s next to the program nor in %s; run 'ninja command' in the build "
        "directory, or install Kinetree as a whole",
        name, KT_FMU_FROM_PROGRAM, KT_FMU_INSTALLED);
}

/* ---- the archive ------------------------------------------------------------------------------------------------- */

static bool add_entry(zipFile zip, const char *name, kt_bytes content) {
    const zip_fileinfo info = {.dosDate = 0x210000}; /* 1980-01-01: equal scenes give equal bytes */
    if (zipOpenNewFileInZip(zip, name, &info, NULL, 0, NULL, 0, NULL, Z_DEFLATED, Z_DEFAULT_COMPRESSION) != ZIP_OK)
        return false;
    const bool fine = content.used == 0 || zipWriteInFileInZip(zip, content.text, (unsigned)content.used) == ZIP_OK;
    return zipCloseFileInZip(zip) == ZIP_OK && fine;
}

typedef struct kt_fmu_parts {
    const char *name, *platform; /* the name of the binary, and of its folder */
    kt_bytes description, binary, scene, licence;
    kt_bytes build, source; /* text is NULL: the archive has no sources */
    const kt_fmu_inputs *inputs;
} kt_fmu_parts;

static bool write_entries(const char *path, const kt_fmu_parts *parts) {
    char binary[KT_FMU_TEXT + 64];
    (void)snprintf(binary, sizeof binary, "binaries/%s/%s.so", parts->platform, parts->name);
    zipFile zip = zipOpen(path, APPEND_STATUS_CREATE);
    if (zip == NULL)
        return false;
    bool fine =
        add_entry(zip, "modelDescription.xml", parts->description) && add_entry(zip, binary, parts->binary) &&
        add_entry(zip, "resources/" KT_FMU_SCENE, parts->scene) &&
        add_entry(zip, "documentation/licenses/license.txt", parts->licence); /* where both versions of FMI look */
    if (parts->source.text != NULL)
        fine = fine && add_entry(zip, "sources/buildDescription.xml", parts->build) &&
               add_entry(zip, "sources/" KT_FMU_SOURCE, parts->source);
    return zipClose(zip, NULL) == ZIP_OK && fine;
}

static int write_archive(const char *out, const kt_fmu_parts *parts) {
    kt_output output = {.lock = -1};
    if (kt_output_start(&output, out) >= 0)
        return KT_EXIT_INTEGRATION;
    const bool fine = write_entries(kt_output_path(&output), parts);
    if (!fine)
        kt_say("%s cannot be written", kt_show(out).text);
    if (kt_output_end(&output, fine ? KT_OUTPUT_WHOLE : KT_OUTPUT_NOTHING) != 0 || !fine)
        return KT_EXIT_INTEGRATION;
    return KT_EXIT_DONE;
}

/* ---- the scene --------------------------------------------------------------------------------------------------- */

/* Reads the scene of the resources, with a setting (NULL: none). */
static kt_status parse_alone(const kt_bytes *text, const char *setting, kt_scene *scene, kt_error *error) {
    kt_scene_options options = kt_scene_options_default();
    options.settings = &setting;
    options.setting_count = setting != NULL;
    options.is_alone = true;
    return kt_scene_parse_with(KT_FMU_SCENE, text->text, text->used, &options, scene, NULL, NULL, error);
}

/* Returns why a scene cannot be an FMU, with the alternative; NULL if it can. */
static const char *reason_against(const kt_scene *scene) {
    const kt_scene usual = kt_scene_default();
    if (scene->formulation != usual.formulation)
        return "simulate.formulation is not that of tree coordinates; remove it";
    if (scene->reduction != usual.reduction)
        return "simulate.reduction is for comparisons; remove it";
    if (scene->contact != usual.contact)
        return "simulate.contact is time stepping, which an FMU does not have; remove it";
    if (scene->from != NULL)
        return "initial.from names a file; write its state into the scene with 'kinetree run --from ... --scene'";
    return NULL;
}

/* Marks the velocities of the joints whose forces are inputs. */
static void mark_inputs(const kt_model *model, const kt_fmu_inputs *inputs, bool *is_input) {
    for (int k = 0; k < inputs->count; k++)
        for (int body = 1; body < kt_model_body_count(model); body++) {
            const kt_coordinates c = kt_body_coordinates(model, body);
            const bool is_it =
                inputs->items[k].key == NULL && strcmp(kt_joint_name(model, body), inputs->items[k].of) == 0;
            for (int i = 0; i < c.nv && is_it; i++)
                is_input[c.v + i] = true;
        }
}

/* ---- the export -------------------------------------------------------------------------------------------------- */

/* Writes a description to memory. */
static int describe_fmu(void (*write)(const kt_fmu_model *fmu, FILE *stream), const kt_fmu_model *described,
                        kt_bytes *content) {
    FILE *stream = open_memstream(&content->text, &content->used);
    if (stream == NULL)
        return KT_EXIT_INTEGRATION;
    write(described, stream);
    return fclose(stream) == 0 ? KT_EXIT_DONE : KT_EXIT_INTEGRATION;
}

static int describe_and_write(const kt_export_fmu *fmu, const kt_fmu_model *described, kt_fmu_parts *parts) {
    int code = describe_fmu(kt_fmu_describe, described, &parts->description);
    if (code == KT_EXIT_DONE)
        code = read_installed("kinetree-fmu.so", &parts->binary);
    if (code == KT_EXIT_DONE)
        code = read_installed("kinetree-licence.txt", &parts->licence);
    if (code == KT_EXIT_DONE && fmu->has_sources)
        code = describe_fmu(kt_fmu_describe_build, described, &parts->build);
    if (code == KT_EXIT_DONE && fmu->has_sources)
        code = read_installed(KT_FMU_SOURCE, &parts->source);
    if (code == KT_EXIT_DONE)
        code = write_archive(fmu->out, parts);
    free(parts->description.text);
    free(parts->binary.text);
    free(parts->licence.text);
    free(parts->build.text);
    free(parts->source.text);
    return code;
}

/* Finds the uses of all parameters. The scene is read again with a value that differs slightly. */
static void find_uses(const kt_bytes *text, const kt_scene *scene, kt_fmu_use *uses) {
    for (int k = 0; k < scene->parameter_count; k++) {
        const kt_scene_parameter *parameter = &scene->parameters[k];
        const double factors[] = {1.0 + 1.0 / 1024.0, 1.0 - 1.0 / 1024.0};
        bool found = false;
        for (int i = 0; i < 2 && !found; i++) {
            char setting[KT_FMU_PATH];
            kt_scene other;
            kt_error error = {0};
            (void)snprintf(setting, sizeof setting, "%s=%.17g", parameter->name,
                           parameter->value != 0.0 ? parameter->value * factors[i] : 1.0 - factors[i]);
            found = parse_alone(text, setting, &other, &error) == KT_OK;
            if (!found)
                continue;
            kt_fmu_find_use(scene, &other, k, &uses[k]);
            kt_scene_free(&other);
        }
    }
}

/* Writes the archive of a compiled scene. */
static int write_model(const kt_export_fmu *fmu, const kt_scene *scene, const kt_model *model, kt_fmu_parts *parts) {
    kt_error error = {0};
    kt_columns columns = {.count = 0};
    unsigned record = 0;
    bool *is_input = calloc((size_t)kt_model_nv(model) + 1, sizeof *is_input);
    kt_fmu_role *roles = calloc((size_t)scene->parameter_count + 1, sizeof *roles);
    kt_fmu_use *uses = calloc((size_t)scene->parameter_count + 1, sizeof *uses);
    const char *reason = kt_fmu_reason_against_exchange(scene, model);
    int code = KT_EXIT_INTEGRATION;
    if (is_input == NULL || roles == NULL || uses == NULL ||
        !kt_columns_list(&columns, scene, model, &scene->run, kt_run_record(&scene->run, model))) {
        kt_say("there is not enough memory");
    } else if (kt_columns_add_own(&columns, scene, &record, &error) != KT_OK) {
        kt_say_error(&error);
        code = KT_EXIT_SCENE;
    } else {
        mark_inputs(model, parts->inputs, is_input);
        const kt_fmu_token token = kt_fmu_token_of(parts->scene.text, parts->scene.used);
        kt_fmu_find_roles(parts->scene.text, parts->scene.used, scene, roles);
        find_uses(&parts->scene, scene, uses);
        const kt_fmu_model described = {.name = parts->name,
                                        .token = token.text,
                                        .scene = scene,
                                        .model = model,
                                        .columns = &columns,
                                        .is_input = is_input,
                                        .inputs = parts->inputs,
                                        .roles = roles,
                                        .uses = uses,
                                        .has_exchange = reason == NULL,
                                        .has_sources = fmu->has_sources,
                                        .version = fmu->version};
        code = describe_and_write(fmu, &described, parts);
    }
    if (code == KT_EXIT_DONE && reason != NULL)
        kt_print("%s: note: the FMU is for co-simulation alone: %s\n", fmu->scene, reason);
    kt_columns_free(&columns);
    free(is_input);
    free(roles);
    free(uses);
    return code;
}

/* Begins the simulation that the FMU begins when it is instantiated. Returns an exit code after printing an error. */
static int check_fmu_start(const kt_export_fmu *fmu, const kt_scene *scene, const kt_model *model,
                           const kt_fmu_inputs *inputs) {
    kt_error error = {0};
    kt_simulation *simulation = NULL;
    bool has_functions = false;
    const kt_status status = kt_simulation_create(model, &scene->run, NULL, &simulation, &error);
    kt_simulation_free(simulation);
    if (status == KT_OK)
        return KT_EXIT_DONE;
    for (int k = 0; k < inputs->count; k++)
        has_functions |= inputs->items[k].key != NULL;
    return kt_reject(kt_exit_code(status), "%s cannot be exported as an FMU, because the FMU would not start: %s%s",
                     fmu->scene, kt_words_of(&error).text,
                     has_functions ? "; functions that are inputs begin at rest, so give the scene such a start, or "
                                     "remove them from --input"
                                   : "");
}

/* Reads the scene of the resources and compiles it. */
static int write_resource_scene(const kt_export_fmu *fmu, kt_fmu_parts *parts) {
    kt_error error = {0};
    kt_scene scene;
    kt_model *model = NULL;
    if (parse_alone(&parts->scene, NULL, &scene, &error) != KT_OK)
        return kt_reject(KT_EXIT_SCENE,
                         "%s cannot be exported as an FMU: it reads other files, which an FMU does not have; write "
                         "their numbers into the scene (%s: %s)",
                         fmu->scene, error.where, error.message);
    const char *reason = reason_against(&scene);
    int code = KT_EXIT_SCENE;
    if (reason != NULL)
        kt_say("%s cannot be exported as an FMU: %s", fmu->scene, reason);
    else
        code = kt_compile_scene(&scene, &model);
    if (code == KT_EXIT_DONE)
        code = check_fmu_start(fmu, &scene, model, parts->inputs);
    if (code == KT_EXIT_DONE)
        code = write_model(fmu, &scene, model, parts);
    kt_model_free(model);
    kt_scene_free(&scene);
    return code;
}

/* Writes the text of a scene in flow style, with settings and the line of inputs. Returns an exit code. */
static int write_flow_scene(const char *path, const kt_bytes *content, const kt_settings *settings,
                            const kt_fmu_inputs *inputs, kt_bytes *flow) {
    kt_error error = {0};
    kt_scene_options options = kt_scene_options_default();
    options.settings = settings->text;
    options.setting_count = settings->count;
    FILE *stream = open_memstream(&flow->text, &flow->used);
    int code = KT_EXIT_DONE;
    if (stream == NULL)
        return kt_say_no_memory(NULL);
    kt_fmu_write_inputs(inputs, stream);
    if (kt_scene_write_flow(path, content->text, content->used, &options, stream, &error) != KT_OK) {
        kt_say_error(&error);
        code = KT_EXIT_SCENE;
    }
    if (fclose(stream) != 0 && code == KT_EXIT_DONE)
        code = KT_EXIT_INTEGRATION;
    if (code != KT_EXIT_DONE)
        free(flow->text);
    return code;
}

/* Likewise, with the last setting for each function that is an input. A motor in a sliding joint may have either name
 * of its key in the file. */
static int write_flow_with(const char *path, const kt_bytes *content, const kt_settings *settings,
                           const kt_fmu_inputs *inputs, kt_bytes *flow) {
    kt_settings all = *settings;
    char(*texts)[KT_FMU_PATH] = calloc((size_t)inputs->count + 1, sizeof *texts);
    int code = texts != NULL ? write_flow_scene(path, content, &all, inputs, flow) : KT_EXIT_INTEGRATION;
    for (int k = 0; k < inputs->count && code == KT_EXIT_DONE; k++) {
        const kt_fmu_input *input = &inputs->items[k];
        if (input->key == NULL)
            continue;
        if (all.count == KT_SETTINGS_MAX) {
            code = kt_misuse("export: --set and functions of --input are more than %d", KT_SETTINGS_MAX);
            break;
        }
        all.text[all.count++] = texts[k];
        for (int other = 0; other < 2 && code == KT_EXIT_DONE; other++) {
            kt_scene scene;
            kt_error error = {0};
            free(flow->text);
            kt_fmu_set_input(input, other == 1, texts[k], sizeof *texts);
            code = write_flow_scene(path, content, &all, inputs, flow);
            if (code != KT_EXIT_DONE || input->key->also == NULL)
                break;
            if (parse_alone(flow, NULL, &scene, &error) == KT_OK) {
                kt_scene_free(&scene);
                break;
            }
        }
    }
    free(texts);
    return code;
}

/* Reads the file of the scene and writes its text in flow style, with settings and inputs. Returns an exit code. */
static int read_flow_scene(const kt_export_fmu *fmu, const kt_fmu_inputs *inputs, kt_bytes *flow) {
    kt_bytes content;
    int code = read_content(fmu->scene, &content);
    if (code != KT_EXIT_DONE)
        return code;
    if (content.text[strspn(content.text, " \t\r\n")] == '<') {
        code =
            kt_reject(KT_EXIT_SCENE, "%s is a robot, not a scene; 'kinetree import' writes it as a scene", fmu->scene);
    } else {
        code = write_flow_with(fmu->scene, &content, fmu->settings, inputs, flow);
    }
    free(content.text);
    return code;
}

int kt_export_fmu_write(const kt_export_fmu *fmu) {
    kt_scene scene;
    kt_fmu_inputs inputs = {.items = NULL};
    kt_fmu_parts parts = {.inputs = &inputs};
    char name[KT_FMU_TEXT];
    int code = kt_read_scene(fmu->scene, fmu->settings, &scene); /* prints all faults with their places in the file */
    if (code == KT_EXIT_DONE)
        code = kt_fmu_find_inputs(&scene, fmu->inputs, &inputs);
    kt_scene_free(&scene);
    if (code == KT_EXIT_DONE)
        code = read_flow_scene(fmu, &inputs, &parts.scene);
    if (code == KT_EXIT_DONE) {
        name_of_fmu(fmu->out, name);
        parts.name = name;
        parts.platform = fmu->version == KT_FMU_THIRD ? KT_FMU_PLATFORM : sizeof(void *) == 8 ? "linux64" : "linux32";
        code = write_resource_scene(fmu, &parts);
        free(parts.scene.text);
    }
    kt_fmu_free_inputs(&inputs);
    return code;
}

#else

int kt_export_fmu_write(const kt_export_fmu *fmu) {
    return kt_misuse("%s cannot be exported as an FMU: this build has no support of FMUs, which need Linux, minizip "
                     "and shared libraries",
                     fmu->scene);
}

#endif
