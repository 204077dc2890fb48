/* One run of a sweep, as a line: its values, its end, its cost, and the last, least and greatest value of each
 * column of its records. A run that fails is a line, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/sweep.h"

#include "advice/angles.h"
#include "advice/excess.h"
#include "advice/growth.h"
#include "base/grow.h"
#include "open/load.h"
#include "open/play.h"
#include "records/columns.h"
#include "text/bytes.h"
#include "text/list.h"

#include "kinetree/analysis.h"
#include "kinetree/loop.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- text -------------------------------------------------------------------------------------------------------- */

/* Both parts of a text in quotes, those in them doubled, on one line. */
static void add_quoted(kt_bytes *to, const char *const parts[2]) {
    kt_bytes_print(to, ",\"");
    for (int i = 0; i < 2; i++)
        for (const char *c = parts[i]; *c != '\0'; c++)
            kt_bytes_print(to, *c == '"' ? "\"\"" : "%c", *c == '\n' ? ' ' : *c);
    kt_bytes_print(to, "\"");
}

/* The finished line; NULL if memory did not suffice. */
static char *end_line(kt_bytes *to) {
    kt_bytes_print(to, "\n");
    if (!to->is_short)
        return to->text;
    free(to->text);
    return NULL;
}

/* ---- the scene of a run ------------------------------------------------------------------------------------------ */

/* A run and the objects that it owns. */
typedef struct kt_sweep_run {
    const kt_sweep *sweep;
    int64_t number;
    double values[KT_SWEEP_AXES_MAX];
    size_t *place;   /* of each column of the lines, among those of the run; as many as these: none */
    kt_scene own;    /* read for this run */
    kt_scene *scene; /* that, or the worker's, which is another run's by the time this one runs; NULL: there is none */
    kt_model *model;
    kt_absolute *absolute;
    kt_simulated by; /* its simulation */
    kt_native_code native;
    kt_sweep_worker *worker; /* counts the accelerations */
    kt_scene_watch *watch;
    kt_columns columns;
    kt_extremes extremes; /* of each column of the lines */
    kt_energy_watch energy;
    kt_growth growth;
    kt_run run;             /* as the scene had it when this run was prepared */
    kt_sweep_result result; /* receives records, if they are kept */
    kt_status status;       /* of the preparation */
    kt_error error;
    kt_error excess; /* a value beyond all reason, which has ended the run */
    bool failed;     /* memory did not suffice */
} made;

static void release_run(made *m) {
    kt_extremes_free(&m->extremes);
    kt_columns_free(&m->columns);
    kt_simulated_free(&m->by);
    kt_scene_watch_free(m->watch);
    kt_absolute_free(m->absolute);
    kt_native_code_free(&m->native);
    kt_model_free(m->model);
    kt_scene_free(&m->own);
    m->scene = NULL;
    m->model = NULL;
    m->absolute = NULL;
    m->watch = NULL;
    m->energy = (kt_energy_watch){.records = 0};
    m->own = kt_scene_default();
}

static void keep_first(void *user, const kt_error *fault) {
    kt_error *first = user;
    if (first->code == KT_OK)
        *first = *fault;
}

/* Reads the scene with the values of a run, which can be varied again. */
static kt_status read_varied_scene(const kt_sweep *sweep, const double *values, kt_scene *scene,
                                   kt_scene_report *report, void *user, kt_error *error) {
    const kt_settings *fixed = &sweep->arguments->settings;
    const char *variables[KT_SWEEP_AXES_MAX];
    for (int i = 0; i < sweep->plan.count; i++)
        variables[i] = sweep->plan.axes[i].path;
    const kt_scene_options options = {.settings = fixed->text,
                                      .setting_count = fixed->count,
                                      .variables = variables,
                                      .values = values,
                                      .variable_count = sweep->plan.count};
    return kt_scene_parse_with(sweep->path, sweep->text, sweep->size, &options, scene, report, user, error);
}

static kt_status compile_varied(made *m, kt_error *error) {
    const kt_model_options options = kt_compile_options(m->scene);
    kt_status status = kt_model_compile(&m->scene->description, &options, &m->model, error);
    if (status == KT_ERROR_MODEL)
        (void)kt_scene_locate(m->scene, error);
    if (status == KT_OK && m->scene->formulation == KT_FORMULATION_ABSOLUTE)
        status = kt_absolute_create(&m->scene->description, &options, m->model, &m->absolute, error);
    return status;
}

/* Own columns with them; *record: what these need besides. */
static kt_status list_run_columns(made *m, unsigned *record, kt_error *error) {
    return kt_columns_list(&m->columns, m->scene, m->model, &m->scene->run, kt_run_record(&m->scene->run, m->model))
               ? kt_columns_add_own(&m->columns, m->scene, record, error)
               : kt_reject_memory(error);
}

/* With --native: passes the numbers of the run to the file, if its structure is that of the first run. */
static kt_status use_native(made *m, kt_simulation_options *options, kt_error *error) {
    const kt_native_file *file = &m->sweep->native;
    if (file->library == NULL || kt_codegen_structure(m->model) != file->structure)
        return KT_OK;
    kt_status status = kt_native_code_begin(&m->native, file, m->model, error);
    if (status == KT_OK)
        status = kt_native_use(&m->native.native, m->model, options, error);
    return status;
}

/* Compiles and assembles the scene, and lists the columns of its records. */
static kt_status prepare_run(made *m, kt_error *error) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_status status = compile_varied(m, error);
    if (status != KT_OK)
        return status;
    m->energy = kt_energy_watch_of(m->scene, m->model);
    m->run = m->scene->run;
    status = list_run_columns(m, &options.record, error);
    options.record |= KT_RECORD_ENERGY;
    if (status == KT_OK)
        status = use_native(m, &options, error);
    if (status == KT_OK)
        status = kt_simulate_scene(m->scene, m->model, &m->scene->run, m->absolute, &options, &m->by, &m->watch, error);
    if (status == KT_OK && !kt_extremes_start(&m->extremes, m->sweep->column_count))
        status = kt_reject_memory(error);
    return status;
}

/* From the scene that the worker has, by its numbers alone. Whatever fails is told by reading the scene. */
static bool prepare_again(kt_sweep_worker *worker, const double *values, made *m) {
    kt_error error = {0};
    if (!worker->has_scene || worker->why[0] != '\0')
        return false;
    kt_status status = kt_scene_vary(&worker->scene, values, &error);
    if (status == KT_ERROR_UNSUPPORTED)
        (void)snprintf(worker->why, sizeof worker->why, "%s", error.where);
    m->scene = &worker->scene;
    if (status == KT_OK)
        status = prepare_run(m, &error);
    if (status != KT_OK)
        release_run(m);
    return status == KT_OK;
}

/* From the text; the worker takes the first scene over. */
static kt_status prepare_anew(const kt_sweep *sweep, kt_sweep_worker *worker, const double *values, made *m,
                              kt_error *error) {
    kt_error fault = {0};
    const kt_status status = read_varied_scene(sweep, values, &m->own, keep_first, &fault, error);
    worker->anew++;
    if (fault.code != KT_OK)
        *error = fault;
    if (status != KT_OK)
        return status;
    m->scene = &m->own;
    if (!worker->has_scene) {
        worker->scene = m->own;
        worker->has_scene = true;
        m->own = kt_scene_default();
        m->scene = &worker->scene;
    }
    return prepare_run(m, error);
}

void kt_sweep_worker_free(kt_sweep_worker *worker) {
    if (worker->has_scene)
        kt_scene_free(&worker->scene);
    worker->has_scene = false;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

/* Adds the time and the columns of lines. */
static bool keep_record(made *m, double time, const double *values) {
    kt_sweep_result *to = &m->result;
    const size_t width = m->sweep->column_count + 1;
    double *records = kt_heap_grow(to->records, to->rows, 1, &to->room, width * sizeof *records);
    if (records == NULL)
        return false;
    to->records = records;
    double *row = to->records + to->rows++ * width;
    row[0] = time;
    for (size_t i = 0; i + 1 < width; i++)
        row[i + 1] = m->place[i] < m->columns.count ? values[m->place[i]] : (double)NAN;
    return true;
}

static int take_record(const kt_record *record, void *user) {
    made *m = user;
    if (kt_find_excess(record, &m->excess))
        return -1;
    const double *values = kt_columns_evaluate(&m->columns, record);
    kt_energy_watch_add(&m->energy, record);
    kt_growth_add(&m->growth, record, m->run.duration);
    for (size_t i = 0; i < m->sweep->column_count; i++)
        if (m->place[i] < m->columns.count)
            kt_extreme_add(&m->extremes.column[i], record->t, values[m->place[i]], isnan(values[m->place[i]]));
    m->failed = m->sweep->arguments->keep != NULL && !keep_record(m, record->t, values);
    return m->failed ? -1 : 0;
}

/* The end of a run with the `status` of its simulation. */
static kt_status judge_run(const made *m, kt_status status, kt_error *error) {
    if (m->failed)
        return kt_reject_memory(error);
    if (m->excess.code != KT_OK) {
        *error = m->excess;
        return error->code;
    }
    if (status == KT_OK && kt_energy_watch_is_blown_up(&m->energy))
        return kt_error_set(error, KT_ERROR_STEP, NULL,
                            "the energy has risen in a scene that cannot gain any: the integration has blown up");
    const kt_grown_run grown = {m->model, m->absolute, &m->run, m->by};
    if (status == KT_OK && kt_growth_diverges(&m->growth, &grown, error) > 0.0)
        return error->code;
    return status;
}

/* Where the columns of lines are among those of a run. */
static void find_line_columns(const kt_sweep *sweep, const kt_columns *columns, size_t *place) {
    size_t guess = 0;
    for (size_t i = 0; i < sweep->column_count; i++) {
        place[i] = kt_columns_find(columns, sweep->columns[i].name, guess);
        guess = place[i] + 1;
    }
}

static void add_column_cells(kt_bytes *line, const made *m) {
    for (size_t i = 0; i < m->sweep->column_count; i++) {
        const kt_extreme *of = m->extremes.column != NULL ? &m->extremes.column[i] : NULL;
        const bool has_values = of != NULL && m->place[i] < m->columns.count && !isnan(of->last);
        for (int k = 0; k < m->sweep->functional_count; k++)
            kt_sweep_put_cell(line, has_values ? kt_sweep_functional_of(of, m->sweep->functionals[k]) : (double)NAN);
    }
}

const char *const kt_sweep_line_columns[] = {"run",         "status",       "time",       "steps",
                                             "evaluations", "energy.error", KT_SWEEP_WHY, NULL};

char *kt_sweep_header(const kt_sweep *sweep) {
    kt_bytes line = {0};
    kt_sweep_plan_head(&sweep->plan, KT_SWEEP_LEADING, &line);
    for (size_t i = 0; i < sweep->event_count; i++)
        if (strpbrk(sweep->events[i], ",\"\n") != NULL)
            add_quoted(&line, (const char *const[]){"event.", sweep->events[i]});
        else
            kt_bytes_print(&line, ",event.%s", sweep->events[i]);
    for (size_t i = 0; i < sweep->column_count; i++)
        for (int k = 0; k < sweep->functional_count; k++)
            kt_bytes_print(&line, ",%s.%s", sweep->columns[i].name, kt_sweep_functional_names[sweep->functionals[k]]);
    kt_bytes_print(&line, "," KT_SWEEP_WHY);
    return end_line(&line);
}

/* How often each event has happened; a run that did not begin has empty cells. */
static void add_events(kt_bytes *line, const kt_sweep *sweep, const made *m) {
    for (size_t i = 0; i < sweep->event_count; i++)
        if (m->by.simulation != NULL)
            kt_bytes_print(line, ",%llu",
                           (unsigned long long)kt_simulation_event_count(m->by.simulation, sweep->events[i]));
        else
            kt_bytes_print(line, ",");
}

static char *write_run_line(const made *m, kt_status status, const kt_error *error) {
    const kt_sweep *sweep = m->sweep;
    kt_bytes line = {0};
    kt_sweep_plan_start(&sweep->plan, m->number, m->values, &line);
    const kt_simulation_counts counts = kt_simulation_counts_of(m->by.simulation);
    kt_bytes_print(&line, "%s", kt_exit_name(kt_exit_code(status)));
    kt_sweep_put_cell(&line, kt_simulation_time(m->by.simulation));
    kt_bytes_print(&line, ",%llu,%llu", (unsigned long long)counts.steps, (unsigned long long)counts.evaluations);
    kt_sweep_put_cell(&line, kt_energy_is_known(&m->energy) ? kt_energy_watch_error(&m->energy) : (double)NAN);
    add_events(&line, sweep, m);
    add_column_cells(&line, m);
    if (status == KT_OK)
        kt_bytes_print(&line, ",");
    else
        add_quoted(&line, (const char *const[]){"", kt_words_of(error).text});
    return end_line(&line);
}

kt_sweep_run *kt_sweep_begin(const kt_sweep *sweep, kt_sweep_worker *worker, int64_t number) {
    made *m = calloc(1, sizeof *m);
    if (m == NULL)
        return NULL;
    m->place = malloc((sweep->column_count + 1) * sizeof *m->place);
    if (m->place == NULL) {
        free(m);
        return NULL;
    }
    m->sweep = sweep;
    m->number = number;
    m->worker = worker;
    m->own = kt_scene_default();
    kt_sweep_plan_values(&sweep->plan, number, m->values);
    worker->runs++;
    m->status = prepare_again(worker, m->values, m) ? KT_OK : prepare_anew(sweep, worker, m->values, m, &m->error);
    find_line_columns(sweep, &m->columns, m->place);
    return m;
}

int64_t kt_sweep_number(const kt_sweep_run *run) { return run->number; }

const kt_model *kt_sweep_model(const kt_sweep_run *run) { return run->model; }

bool kt_sweep_member(kt_sweep_run *run, kt_ensemble_member *member) {
    *member = (kt_ensemble_member){.simulation = run->by.simulation, .record = take_record, .user = run};
    return run->status == KT_OK;
}

kt_sweep_result kt_sweep_end(kt_sweep_run *run, kt_status status, const kt_error *error) {
    kt_error why = error != NULL ? *error : (kt_error){.code = KT_OK};
    status = run->status == KT_OK ? judge_run(run, status, &why) : run->status;
    run->result.code = kt_exit_code(status);
    run->result.line = write_run_line(run, status, run->status == KT_OK ? &why : &run->error);
    const kt_sweep_result result = run->result;
    run->worker->unmade += run->by.simulation == NULL;
    if (run->native.file != NULL) {
        run->worker->natively++;
        run->worker->computed += run->native.native.computed;
        run->worker->left += run->native.native.left;
    }
    release_run(run);
    free(run->place);
    free(run);
    return result;
}

kt_sweep_result kt_sweep_one(const kt_sweep *sweep, kt_sweep_worker *worker, int64_t number) {
    kt_sweep_run *run = kt_sweep_begin(sweep, worker, number);
    kt_error error = {0};
    if (run == NULL)
        return (kt_sweep_result){.line = NULL};
    const kt_status status = run->status == KT_OK ? kt_simulated_run(run->by, take_record, run, &error) : KT_OK;
    return kt_sweep_end(run, status, &error);
}

void kt_sweep_result_free(kt_sweep_result *result) {
    free(result->line);
    free(result->records);
    *result = (kt_sweep_result){.line = NULL};
}

/* ---- columns ----------------------------------------------------------------------------------------------------- */

static void say_fault(void *user, const kt_error *fault) {
    (void)user;
    kt_print("%s: %s\n", fault->where, fault->message);
}

static bool add_sweep_column(kt_sweep *sweep, const char *name, const char *unit) {
    const size_t n = sweep->column_count;
    struct kt_sweep_column *columns = realloc(sweep->columns, (n + 1) * sizeof *columns);
    if (columns == NULL)
        return false;
    sweep->columns = columns;
    columns[n] = (struct kt_sweep_column){strdup(name), strdup(unit)};
    sweep->column_count++;
    return columns[n].name != NULL && columns[n].unit != NULL;
}

/* All columns but time. */
static bool add_all(kt_sweep *sweep, const kt_columns *columns) {
    char name[512];
    bool fine = true;
    for (size_t i = 0; fine && i < columns->count; i++)
        if (columns->columns[i].source != KT_COLUMN_TIME) {
            (void)kt_column_name(columns, i, name, sizeof name);
            fine = add_sweep_column(sweep, name, kt_column_quantity(columns, i).unit);
        }
    return fine;
}

/* Those of --columns; an exit code if one is not recorded. */
static int add_chosen(kt_sweep *sweep, const kt_columns *columns, const char *list) {
    char name[512];
    while (kt_list_next(&list, name, sizeof name)) {
        const size_t found = kt_columns_find(columns, name, 0);
        if (found == columns->count) {
            kt_nearest nearest = kt_nearest_make(name, NULL);
            (void)add_all(sweep, columns); /* whose names stay, for the suggestion */
            for (size_t i = 0; i < sweep->column_count; i++)
                (void)kt_nearest_try(&nearest, sweep->columns[i].name);
            return kt_misuse(
                "sweep: --columns: the records have no column '%s'%s; --set output.record=[...] records more", name,
                kt_ask(&nearest, "", "").text);
        }
        if (!add_sweep_column(sweep, name, kt_column_quantity(columns, found).unit))
            return kt_say_no_memory(NULL);
    }
    return -1;
}

/* `until` is in the time that is reached. */
static bool add_events_of(kt_sweep *sweep, const kt_scene *scene) {
    sweep->events = calloc((size_t)scene->event_count + 1, sizeof *sweep->events);
    for (int i = 0; sweep->events != NULL && i < scene->event_count; i++) {
        sweep->events[i] = strdup(scene->events[i].name);
        if (sweep->events[i] == NULL)
            return false;
        sweep->event_count++;
    }
    return sweep->events != NULL;
}

/* The settings of a run, with its values; `texts` holds those. */
static kt_settings settings_of(const kt_sweep *sweep, int64_t run, kt_sweep_texts *texts) {
    kt_settings settings = sweep->arguments->settings;
    double values[KT_SWEEP_AXES_MAX];
    kt_sweep_plan_values(&sweep->plan, run, values);
    kt_sweep_plan_set(&sweep->plan, values, texts, &settings);
    return settings;
}

/* Reads and compiles the scene of a run. Its values are settings, whose units the scene checks. */
static kt_status make_model(const kt_sweep *sweep, int64_t run, made *m, kt_scene_report *report, void *user,
                            kt_error *error) {
    kt_sweep_texts texts;
    const kt_settings settings = settings_of(sweep, run, &texts);
    const kt_scene_options options = {.settings = settings.text, .setting_count = settings.count};
    const kt_status status =
        kt_scene_parse_with(sweep->path, sweep->text, sweep->size, &options, &m->own, report, user, error);
    m->scene = status == KT_OK ? &m->own : NULL;
    return status == KT_OK ? compile_varied(m, error) : status;
}

/* The first run whose scene is right; 0 if none of the first thousand is. */
static int64_t find_first_valid_run(const kt_sweep *sweep) {
    const int64_t runs = kt_sweep_plan_runs(&sweep->plan), most = runs < 1000 ? runs : 1000;
    for (int64_t run = 0; run < most; run++) {
        made m = {.scene = NULL};
        kt_error error = {0};
        const kt_status status = make_model(sweep, run, &m, NULL, NULL, &error);
        release_run(&m);
        if (status == KT_OK)
            return run;
    }
    return 0;
}

/* Warns of the values of an axis in a run that are doubtful angles; returns their number. */
static int warn_of_axis_angles(const kt_sweep *sweep, const kt_scene *scene, int64_t run, int axis,
                               kt_warnings *warnings) {
    kt_sweep_texts texts;
    (void)settings_of(sweep, run, &texts);
    const kt_settings own = {.text = {texts.text[axis]}, .count = 1};
    return kt_angles_set_warn(warnings, scene, &own);
}

/* Warns of doubtful angles in the first valid run, and of those that only the runs with the largest values have. */
static void say_angles_of_runs(const kt_sweep *sweep, const kt_scene *first, int64_t first_run) {
    kt_sweep_texts texts;
    const kt_settings settings = settings_of(sweep, first_run, &texts);
    kt_warnings silent = {.quiet = true}, printed = {.quiet = false};
    if (sweep->arguments->quiet)
        return;
    (void)kt_angles_say(first, &settings);
    for (int axis = 0; axis < sweep->plan.count; axis++) {
        made m = {.scene = NULL};
        kt_error error = {0};
        const int64_t run = kt_sweep_plan_largest(&sweep->plan, axis);
        if (warn_of_axis_angles(sweep, first, first_run, axis, &silent) == 0 &&
            make_model(sweep, run, &m, NULL, NULL, &error) == KT_OK)
            (void)warn_of_axis_angles(sweep, m.scene, run, axis, &printed);
        release_run(&m);
    }
    kt_warnings_free(&silent);
    kt_warnings_free(&printed);
}

int kt_sweep_list_columns(kt_sweep *sweep) {
    made m = {.scene = NULL};
    kt_error error = {0};
    int code = -1;
    const int64_t first = find_first_valid_run(sweep);
    kt_status status = make_model(sweep, first, &m, say_fault, NULL, &error);
    const bool read = status == KT_OK;
    sweep->is_absolute = m.absolute != NULL;
    unsigned record;
    if (status == KT_OK)
        code = kt_check_scene_files(m.scene);
    if (code < 0 && status == KT_OK)
        code = kt_sweep_plan_check(&sweep->plan, m.scene);
    if (code < 0 && status == KT_OK)
        say_angles_of_runs(sweep, m.scene, first);
    if (code < 0 && status == KT_OK && sweep->arguments->native)
        code = kt_sweep_make_native(sweep, m.scene, m.model);
    if (code < 0 && status == KT_OK)
        status = list_run_columns(&m, &record, &error);
    if (code < 0 && status == KT_OK && sweep->arguments->columns != NULL)
        code = add_chosen(sweep, &m.columns, sweep->arguments->columns);
    else if (code < 0 && status == KT_OK && !add_all(sweep, &m.columns))
        status = kt_reject_memory(&error);
    if (code < 0 && status == KT_OK && !add_events_of(sweep, m.scene))
        status = kt_reject_memory(&error);
    if (status == KT_OK && m.scene->from != NULL && code < 0)
        code = kt_reject(KT_EXIT_SCENE,
                         "sweep: the scene starts from %s (initial.from), which a sweep does not read; write the state "
                         "into the scene",
                         kt_show(m.scene->from).text);
    if (status != KT_OK && (read || m.scene != NULL)) /* faults of reading were printed */
        kt_say_error(&error);
    if (status != KT_OK)
        code = kt_exit_code(status);
    release_run(&m);
    return code;
}

void kt_sweep_free(kt_sweep *sweep) {
    kt_native_file_free(&sweep->native);
    kt_sweep_plan_free(&sweep->plan);
    for (size_t i = 0; i < sweep->column_count; i++) {
        free(sweep->columns[i].name);
        free(sweep->columns[i].unit);
    }
    for (size_t i = 0; i < sweep->event_count; i++)
        free(sweep->events[i]);
    free(sweep->columns);
    free(sweep->events);
    free(sweep->text);
}
