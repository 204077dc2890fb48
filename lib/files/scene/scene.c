/* Whole scene files, from text to description and back.
 *
 * Numbers are read and written in the C locale, independently of that of the process. This thread's locale is switched
 * (uselocale) during the call, and faults are reported after it has been switched back.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"
#include "base/options.h"
#include "base/require.h"

#include "document/file.h"
#include "document/flow.h"
#include "model/describe.h"
#include "scene/assignment.h"
#include "scene/expand.h"
#include "scene/foothold.h"
#include "scene/named.h"
#include "scene/scene_event.h"
#include "scene/scene_parameter.h"
#include "scene/scene_part.h"
#include "scene/vary.h"

#include <locale.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the top of the file ----------------------------------------------------------------------------------------- */

/* Reads nothing: check_version has checked the version before anything else is read. */
static bool read_version(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)r, (void)scope, (void)node, (void)field, (void)object;
    return true;
}

static void write_version(kt_emitter *e, const kt_member *m) {
    (void)m;
    kt_emit_integer(e, 1);
}

static const kt_kind kind_version = {.read = read_version, .write = write_version};

/* Reads nothing: parameters and beams are read before anything else is. The parameters and beams are written as the
 * numbers, bodies and effects that follow from them. */
static const kt_kind kind_parameters = {.read = read_version, .same = kt_never_written};

static const char *const limit_names[] = {KT_INERTIA_LIMIT_LIST(KT_LISTED_NAME)};
static const kt_choice limits = {"inertia_check", limit_names, KT_INERTIA_LIMIT_COUNT, 0, NULL};

#define AT(member) .offset = offsetof(kt_scene, member)
static const kt_field fields[] = {
    {.key = "kinetree", .kind = &kind_version, .flags = KT_FIELD_REQUIRED},
    {.key = "name", .kind = &kt_kind_text, AT(description.name)},
    {.key = "parameters", .kind = &kind_parameters},
    {.key = "expressions", .kind = &kind_parameters},
    {.key = "tables", .kind = &kt_kind_tables, .flags = KT_FIELD_SECTION},
    {.key = "gravity", .kind = &kt_kind_vector, AT(description.gravity)},
    {.key = "inertia_check", .kind = &kt_kind_choice, AT(description.inertia_check), .detail = &limits},
    {.key = "beams", .kind = &kind_parameters},
    {.key = "bodies", .kind = &kt_kind_items, .flags = KT_FIELD_SECTION, .detail = &kt_bodies},
    {.key = "joints", .kind = &kt_kind_joints},
    {.key = "meshes", .kind = &kt_kind_items, .flags = KT_FIELD_SECTION, .detail = &kt_meshes},
    {.key = "states", .kind = &kt_kind_states, .flags = KT_FIELD_SECTION},
    {.key = "loops", .kind = &kt_kind_items, .flags = KT_FIELD_SECTION, .detail = &kt_loops},
    {.key = "initial", .kind = &kt_kind_map, .flags = KT_FIELD_SECTION, .detail = &kt_initial_table},
    {.key = "effects", .kind = &kt_kind_items, .flags = KT_FIELD_SECTION, .detail = &kt_effects},
    {.key = "events", .kind = &kt_kind_events, .flags = KT_FIELD_SECTION, .detail = &kt_event_items},
    {.key = "simulate", .kind = &kt_kind_simulate, .flags = KT_FIELD_SECTION},
    {.key = "output", .kind = &kt_kind_map, .flags = KT_FIELD_SECTION, .detail = &kt_output_table},
};
static const kt_table table = {.fields = fields, .count = KT_COUNT_OF(fields)};

/* A file of another kind may be any file of the user, and a message may go to others: the file is not quoted. */
#define NO_SCENE "expected a scene ('kinetree: 1' and other keys)"

/* Returns whether one of the keys is that of a scene, or resembles it. */
static bool has_key_of_scene(kt_reader *r, const kt_node *root) {
    bool found = root->of.first == NULL;
    for (const kt_node *key = root->of.first; key != NULL && !found; key = key->next->next) {
        kt_nearest nearest = kt_nearest_make(key->kind == KT_NODE_TEXT ? key->of.text : "", &r->effort);
        for (int i = 0; i < table.count; i++) {
            found = found || (key->kind == KT_NODE_TEXT && strcmp(key->of.text, fields[i].key) == 0);
            (void)kt_nearest_try(&nearest, fields[i].key);
        }
        found = found || nearest.best != NULL;
    }
    return found;
}

/* A file of another version is not read any further. */
static bool check_version(kt_reader *r, kt_node *root) {
    double value;
    kt_node *version = kt_node_find(root, "kinetree");
    if (version == NULL && kt_key_is_hidden(r, &table, root, "kinetree"))
        return true; /* the fault of the wrong key in its place reports this */
    if (version == NULL) {
        kt_fault_at(r, KT_ERROR_SCENE, NULL, root, "the key 'kinetree' is missing; begin with 'kinetree: 1'");
        return true;
    }
    const kt_scope scope = {.key = "kinetree"};
    if (!kt_read_number(r, &scope, version, KT_QUANTITY_NUMBER, &value))
        return false;
    if (strcmp(version->of.text, "1") == 0)
        return true;
    return kt_fault_at(r, KT_ERROR_SCENE, &scope, version,
                       "there is no version '%.40s' of the format; write 'kinetree: 1'", version->of.text);
}

/* ---- faults to the caller ---------------------------------------------------------------------------------------- */

/* Reports all faults; the first is the call's error. */
static kt_status report_faults(const kt_reader *r, const char *path, kt_scene_report *report, void *user,
                               kt_error *error) {
    char where[KT_WHERE_SIZE];
    kt_error one;
    for (size_t i = 0; report != NULL && i < r->fault_count; i++) {
        const kt_fault *fault = &r->faults[i];
        kt_reader_where(r, path, fault->line, fault->column, where);
        (void)kt_error_set(&one, fault->code, where, "%s", fault->message);
        report(user, &one);
    }
    if (report != NULL && r->fault_dropped > 0) {
        const kt_fault *last = &r->faults[r->fault_count - 1];
        kt_reader_where(r, path, last->line, last->column, where);
        (void)kt_error_set(&one, last->code, where, "%zu more faults are not listed; mend these first",
                           r->fault_dropped);
        report(user, &one);
    }
    kt_reader_where(r, path, r->faults[0].line, r->faults[0].column, where);
    return kt_error_set(error, r->faults[0].code, where, "%s", r->faults[0].message);
}

/* ---- places of bodies and loops -------------------------------------------------------------------------------------
 *
 * Some faults are found only when the scene is compiled. The nodes are freed by then, so the line and column of each
 * body and loop are stored. */

/* For each item, the position of the key that the faults are about, or of the item if the key is missing. */
static const kt_mark *mark_items(kt_reader *r, kt_node *const *items, int count, const char *key) {
    kt_mark *marks = kt_pool_take(&r->keep, (size_t)count + 1, sizeof *marks);
    for (int i = 0; marks != NULL && i < count; i++) {
        const kt_node *node = kt_node_find(items[i], key);
        node = node != NULL ? node : items[i];
        if (node->line >= KT_SETTING_LINE) /* marks are of the file */
            node = items[i];
        marks[i] = (kt_mark){node->line, node->column};
    }
    return marks;
}

/* The position of `initial.from` in the file; line 0: the file does not have this key. */
static kt_mark mark_initial_from(const kt_reader *r) {
    const kt_node *initial = kt_node_find(r->root, "initial"),
                  *from = initial != NULL ? kt_node_find(initial, "from") : NULL;
    return from != NULL && from->line < KT_SETTING_LINE ? (kt_mark){from->line, from->column} : (kt_mark){0, 0};
}

/* Remembers the lines of bodies and loops for faults that appear only after the scene has been read. */
static bool mark_scene(kt_reader *r, const char *path, kt_scene *scene) {
    kt_scene_marks *marks = kt_pool_take(&r->keep, 1, sizeof *marks);
    if (marks == NULL)
        return kt_reader_out_of_memory(r);
    marks->path = kt_pool_text(&r->keep, path, strlen(path));
    marks->bodies = mark_items(r, r->scene->body_nodes, scene->description.body_count, "joint");
    marks->loops = mark_items(r, r->scene->loop_nodes, scene->description.loop_count, "between");
    marks->from = mark_initial_from(r);
    marks->files = r->scene->files;
    scene->marks = marks;
    return (marks->path != NULL && marks->bodies != NULL && marks->loops != NULL) || kt_reader_out_of_memory(r);
}

/* Returns the mark of the item that `where` names, such as "body 'crank'"; NULL if the scene has none of that name. */
static const kt_mark *find_mark(const kt_scene *scene, const char *where) {
    const kt_description *description = &scene->description;
    char text[KT_WHERE_SIZE];
    if (scene->marks->from.line > 0 && strcmp(where, "initial.from") == 0)
        return &scene->marks->from;
    for (int i = 0; i < description->body_count; i++) {
        (void)snprintf(text, sizeof text, "body '%s'", description->bodies[i].name);
        if (strcmp(text, where) == 0)
            return &scene->marks->bodies[i];
    }
    for (int i = 0; i < description->loop_count; i++) {
        (void)snprintf(text, sizeof text, "loop '%s'", description->loops[i].name);
        if (strcmp(text, where) == 0)
            return &scene->marks->loops[i];
    }
    return NULL;
}

const char *kt_scene_path(const kt_scene *scene) { return scene && scene->marks != NULL ? scene->marks->path : NULL; }

const char *kt_scene_file(const kt_scene *scene, size_t k) {
    const kt_named_file *file = scene && scene->marks != NULL ? scene->marks->files : NULL;
    while (file != NULL && k-- > 0)
        file = file->next;
    return file != NULL ? file->path : NULL;
}

bool kt_scene_locate(const kt_scene *scene, kt_error *error) {
    if (!scene || !error)
        return false;
    const kt_mark *mark = scene->marks != NULL ? find_mark(scene, error->where) : NULL;
    if (mark == NULL)
        return false;
    const kt_error plain = *error;
    char where[KT_WHERE_SIZE];
    kt_document_where(where, scene->marks->path, mark->line, mark->column);
    (void)kt_error_set(error, plain.code, where, "%s: %s", plain.where, plain.message);
    return true;
}

/* ---- reading --------------------------------------------------------------------------------------------------- */

/* Reports an interval that divides the duration into more records than can be counted: each is right by itself. */
static void check_interval(kt_reader *r, const kt_run *run) {
    const kt_scope outer = {.key = "output"}, scope = {.outer = &outer, .key = "interval"};
    kt_node *output = kt_node_find(r->root, "output");
    kt_run records = kt_run_default();
    kt_error error = {0};
    records.duration = run->duration;
    records.interval = run->interval;
    if (output != NULL && output->kind == KT_NODE_MAP && kt_run_check(&records, &error) != KT_OK &&
        strcmp(error.where, "interval") == 0)
        kt_fault_at(r, KT_ERROR_SCENE, &scope, kt_node_find(output, "interval"), "%s; take a longer interval",
                    error.message);
}

/* Sections whose names others use may be there under wrong keys, which the table will report. */
static void hide_sections(kt_reader *r) {
    static const char *const sections[] = {"bodies", "joints", "beams", "states"};
    const kt_node *expressions = kt_node_find(r->root, "expressions");
    r->scene->parameters_are_hidden = kt_key_is_hidden(r, &table, r->root, "parameters");
    r->scene->hides_parameters =
        (expressions != NULL && kt_node_has_stray(expressions)) || kt_key_is_hidden(r, &table, r->root, "expressions");
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++)
        if (kt_key_is_hidden(r, &table, r->root, sections[i]))
            r->scene->names_are_known = false;
}

/* The order matters: settings change nodes before they are read; expressions and parameters come before formulas that
 * use them; beams and footholds add nodes to other sections. */
static void read_scene_text(kt_reader *r, const char *path, const char *text, size_t size, const void *options,
                            kt_scene *scene) {
    if (!kt_node_parse(r, text, size, &r->root) || r->out_of_memory)
        return;
    if (r->root->kind != KT_NODE_MAP) {
        kt_fault_at(r, KT_ERROR_SCENE, NULL, r->root, NO_SCENE ", found %s",
                    r->root->kind == KT_NODE_LIST ? "a list" : "a text");
        return;
    }
    if (!has_key_of_scene(r, r->root)) {
        kt_fault_at(r, KT_ERROR_SCENE, NULL, r->root, NO_SCENE ", found other keys alone");
        return;
    }
    kt_commas_check(r);
    kt_settings_apply(r, options, &table);
    r->scene->gives_step = options != NULL && ((const kt_scene_options *)options)->gives_step;
    r->scene->is_alone = options != NULL && ((const kt_scene_options *)options)->is_alone;
    kt_varying_start(r, options);
    if (!check_version(r, r->root))
        return;
    kt_expressions_list(r);
    hide_sections(r);
    kt_parameters_read(r);
    kt_tables_read(r, &scene->description);
    kt_assignments_add_states(r, &scene->description);
    kt_beams_expand(r);
    kt_footholds_expand(r);
    (void)kt_table_read(r, NULL, r->root, &table, scene);
    kt_footholds_measure(scene);
    kt_expressions_check(r);
    check_interval(r, &scene->run);
    if (!r->out_of_memory)
        kt_exhausts_add(r, &scene->description);
    if (!r->out_of_memory)
        kt_check_description(r, &scene->description);
    if (!r->out_of_memory && r->fault_count == 0 && mark_scene(r, path, scene)) {
        kt_parameters_finish(r, path, options, scene);
        kt_varying_finish(r, path, scene);
    }
}

/* The options of kt_scene_write_flow. */
typedef struct kt_flow_target {
    const kt_scene_options *options;
    FILE *stream;
} kt_flow_target;

/* Writes the scene with its settings in flow style. Values are not checked. */
static void write_flow_text(kt_reader *r, const char *path, const char *text, size_t size, const void *options,
                            kt_scene *scene) {
    const kt_flow_target *target = options;
    (void)path, (void)scene;
    if (!kt_node_parse(r, text, size, &r->root) || r->out_of_memory)
        return;
    kt_settings_apply(r, target->options, &table);
    if (!r->out_of_memory && r->fault_count == 0)
        kt_flow_write(r->root, target->stream);
}

kt_scene kt_scene_default(void) {
    kt_scene scene = {.description = kt_description_default(), .run = kt_run_default()};
    scene.run.integrator = NULL; /* chosen for the model */
    return scene;
}

enum { EFFORT = 50000000 }; /* operations on suggestions: about a tenth of a second */

kt_status kt_format_parse(kt_format_choice format, const char *path, const char *text, size_t size, kt_scene *scene,
                          kt_scene_report *report, void *user, kt_error *error) {
    if (path == NULL)
        path = "scene";
    if (scene == NULL || (text == NULL && size > 0))
        return kt_error_set(error, KT_ERROR_ARGUMENT, path, "scene and text cannot be NULL");
    if (size > KT_FILE_SIZE_MAX)
        return kt_error_set(error, KT_ERROR_FILE, path, "the text has %zu bytes; a scene has at most %d", size,
                            (int)KT_FILE_SIZE_MAX);
    locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain == (locale_t)0)
        return kt_error_set(error, KT_ERROR_MEMORY, path, "there is not enough memory to read the scene");
    locale_t before = uselocale(plain);
    kt_scene read = kt_scene_default();
    kt_scene_reading reading = {.names_are_known = true, .description = &read.description};
    kt_reader r = {.path = path, .effort = EFFORT, .scene = &reading};
    if (!kt_index_bodies(&r.scratch, &reading.names, NULL, 0)) /* there may be none */
        (void)kt_reader_out_of_memory(&r);
    else
        format.read(&r, path, text == NULL ? "" : text, size, format.options, &read);
    kt_fault_sort(&r);
    (void)uselocale(before);
    freelocale(plain);

    kt_status status = KT_OK;
    if (r.out_of_memory)
        status = kt_error_set(error, KT_ERROR_MEMORY, path, "there is not enough memory to read the scene");
    else if (r.fault_count > 0)
        status = report_faults(&r, path, report, user, error);
    if (status == KT_OK) {
        read.memory = r.keep.chunks;
        *scene = read;
    } else {
        kt_pool_free(r.keep.chunks);
    }
    kt_pool_free(r.scratch.chunks);
    return status;
}

kt_status kt_format_read(kt_format_choice format, const char *path, kt_scene *scene, kt_scene_report *report,
                         void *user, kt_error *error) {
    char *text = NULL;
    size_t size = 0;
    if (path == NULL || scene == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, path, "path and scene cannot be NULL");
    kt_status status = kt_file_read(path, &text, &size, error);
    if (status == KT_OK)
        status = kt_format_parse(format, path, text, size, scene, report, user, error);
    free(text);
    return status;
}

static kt_status check_scene_options(const kt_scene_options *options, kt_error *error) {
    if (options == NULL)
        return KT_ERROR_ARGUMENT;
    if (options->setting_count < 0 || (options->setting_count > 0 && options->settings == NULL))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options", "settings must be an array of setting_count texts");
    for (int k = 0; k < options->setting_count; k++)
        if (options->settings[k] == NULL)
            return kt_error_set(error, KT_ERROR_ARGUMENT, "options", "settings[%d] cannot be NULL", k);
    if (options->variable_count < 0 ||
        (options->variable_count > 0 && (options->variables == NULL || options->values == NULL)))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "options",
                            "variables and values must be arrays of variable_count texts and numbers");
    for (int k = 0; k < options->variable_count; k++)
        if (options->variables[k] == NULL)
            return kt_error_set(error, KT_ERROR_ARGUMENT, "options", "variables[%d] cannot be NULL", k);
    return KT_OK;
}

kt_status kt_scene_parse_with(const char *path, const char *text, size_t size, const kt_scene_options *options,
                              kt_scene *scene, kt_scene_report *report, void *user, kt_error *error) {
    kt_scene_options own = kt_scene_options_default();
    const kt_scene_options *o = KT_OPTIONS(kt_scene_options, is_alone, &own, options, error);
    const kt_status status = check_scene_options(o, error);
    return status != KT_OK
               ? status
               : kt_format_parse((kt_format_choice){read_scene_text, o}, path, text, size, scene, report, user, error);
}

kt_status kt_scene_read_with(const char *path, const kt_scene_options *options, kt_scene *scene,
                             kt_scene_report *report, void *user, kt_error *error) {
    kt_scene_options own = kt_scene_options_default();
    const kt_scene_options *o = KT_OPTIONS(kt_scene_options, is_alone, &own, options, error);
    const kt_status status = check_scene_options(o, error);
    return status != KT_OK ? status
                           : kt_format_read((kt_format_choice){read_scene_text, o}, path, scene, report, user, error);
}

kt_status kt_scene_parse(const char *path, const char *text, size_t size, kt_scene *scene, kt_scene_report *report,
                         void *user, kt_error *error) {
    if (KT_IS_MISSING(error, text || !size, scene))
        return KT_ERROR_ARGUMENT;
    return kt_scene_parse_with(path, text, size, NULL, scene, report, user, error);
}

kt_status kt_scene_read(const char *path, kt_scene *scene, kt_scene_report *report, void *user, kt_error *error) {
    if (KT_IS_MISSING(error, path, scene))
        return KT_ERROR_ARGUMENT;
    return kt_scene_read_with(path, NULL, scene, report, user, error);
}

void kt_scene_free(kt_scene *scene) {
    if (scene == NULL)
        return;
    kt_pool_free(scene->memory);
    *scene = kt_scene_default();
}

/* ---- writing ----------------------------------------------------------------------------------------------------- */

/* Emits first without a stream, so that nothing is written if the scene cannot be. */
static kt_status emit(const kt_scene *scene, FILE *stream, kt_error *error) {
    const kt_scene standard = kt_scene_default();
    kt_emitter trial = {.stream = NULL}, emitter = {.stream = stream};
    kt_table_write(&trial, &table, scene, &standard);
    if (trial.fault.code != KT_OK)
        return kt_error_set(error, trial.fault.code, "scene", "%s", trial.fault.message);
    kt_table_write(&emitter, &table, scene, &standard);
    if (fflush(stream) != 0 || ferror(stream))
        return kt_error_set(error, KT_ERROR_FILE, "scene", "the stream cannot be written to; is the disk full?");
    return KT_OK;
}

kt_status kt_scene_write(const kt_scene *scene, FILE *stream, kt_error *error) {
    if (KT_IS_MISSING(error, scene, stream))
        return KT_ERROR_ARGUMENT;
    kt_status status = kt_description_check(&scene->description, NULL, NULL, error);
    if (status == KT_OK)
        status = kt_check_run(&scene->run, &scene->description, error);
    if (status != KT_OK)
        return status;
    locale_t plain = newlocale(LC_ALL_MASK, "C", (locale_t)0);
    if (plain == (locale_t)0)
        return kt_error_set(error, KT_ERROR_MEMORY, "scene", "there is not enough memory to write the scene");
    locale_t before = uselocale(plain);
    status = emit(scene, stream, error);
    (void)uselocale(before);
    freelocale(plain);
    return status;
}

kt_status kt_scene_write_flow(const char *path, const char *text, size_t size, const kt_scene_options *options,
                              FILE *stream, kt_error *error) {
    const kt_flow_target target = {options, stream};
    kt_scene unused;
    if (KT_IS_MISSING(error, text, stream))
        return KT_ERROR_ARGUMENT;
    const kt_status status =
        kt_format_parse((kt_format_choice){write_flow_text, &target}, path, text, size, &unused, NULL, NULL, error);
    if (status == KT_OK)
        kt_scene_free(&unused);
    if (status == KT_OK && ferror(stream))
        return kt_error_set(error, KT_ERROR_FILE, "scene", "the stream cannot be written to; is the disk full?");
    return status;
}
