/* The cost of published accuracy: processor time of a whole run, with the set-up of the simulation and without that of
 *   the model. Andrews' squeezing mechanism (IVP test set; IFToMM A03) runs to t = 0.03 s with all angles within 1e-6
 *   rad. Bricard's mechanism (IFToMM A04) runs for 10 s with all points within 1e-7 m. Each adaptive method of order 3
 *   and more runs at the largest tolerance that keeps the bound. Tolerances have four values a decade, and the next
 *   three keep the bound, too.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "report.h"

#include "kinetree/scene.h"

#include <jansson.h>
#include <math.h>
#include <stdlib.h>

enum { LADDER = 37 }; /* tolerances 1e-2 to 1e-11 */

/* Processor time that a mechanism may take at most, with the best method. */
static const double seconds_most = 6e-3;

typedef struct problem {
    const char *scene, *table;
    double duration, bound;
    const char *unit;
    /* distance of a record to a row of the table; *lost where a name is not in the model */
    double (*error)(const kt_model *model, const kt_record *record, const double *row, bool *lost);
} problem;

typedef struct table {
    size_t rows, columns;
    double *t, *value;
} table;

typedef struct attempt {
    const problem *about;
    const kt_model *model;
    const table *known;
    kt_run run;
    double worst;
    size_t compared;
    bool lost;
    kt_status status;
    kt_error error;
    kt_simulation_counts counts;
} attempt;

/* ---- errors ------------------------------------------------------------------------------------------------------ */

static double squeezer_error(const kt_model *model, const kt_record *record, const double *row, bool *lost) {
    static const char *const joints[] = {"K1", "K2", "K3", "K4", "K5", "K6", "K7"};
    double worst = 0.0;
    for (int i = 0; i < 7; i++) {
        const int body = kt_body_find(model, joints[i]);
        *lost |= body < 0;
        if (body >= 0)
            worst = fmax(worst, fabs(record->q[kt_body_coordinates(model, body).q] - row[i]));
    }
    return worst;
}

static double ring_error(const kt_model *model, const kt_record *record, const double *row, bool *lost) {
    static const char *const rods[] = {"rod1", "rod2", "rod3", "rod4"};
    double worst = 0.0;
    for (int i = 0; i < 4; i++) {
        const int body = kt_body_find(model, rods[i]), end = body < 0 ? -1 : kt_marker_find(model, body, "end");
        *lost |= end < 0;
        if (end < 0)
            continue;
        const kt_pose pose = kt_body_pose(model, record->data, body);
        const kt_vec3 p = kt_pose_apply(pose, kt_marker_at(model, body, end));
        worst = fmax(worst, kt_vec3_norm(kt_vec3_sub(p, kt_vec3_make(row[3 * i], row[3 * i + 1], row[3 * i + 2]))));
    }
    return worst;
}

static const problem problems[] = {
    {"andrews", "A03_andrews_squeezer", 0.03, 1e-6, "rad", squeezer_error},
    {"bricard", "A04_bricard", 10.0, 1e-7, "m", ring_error},
};

/* ---- tables ------------------------------------------------------------------------------------------------------ */

static bool take_rows(const json_t *reference, table *out) {
    const json_t *t = json_object_get(reference, "t"), *value = json_object_get(reference, "value");
    out->rows = json_array_size(t);
    out->columns = json_array_size(json_object_get(reference, "columns"));
    out->t = calloc(out->rows + 1, sizeof *out->t);
    out->value = calloc(out->rows * out->columns + 1, sizeof *out->value);
    bool fine = out->rows > 0 && out->t && out->value && json_array_size(value) == out->rows;
    for (size_t i = 0; fine && i < out->rows; i++) {
        const json_t *row = json_array_get(value, i);
        out->t[i] = json_number_value(json_array_get(t, i));
        fine = json_array_size(row) == out->columns;
        for (size_t k = 0; fine && k < out->columns; k++)
            out->value[i * out->columns + k] = json_number_value(json_array_get(row, k));
    }
    return fine;
}

static bool open_table(const char *name, table *out) {
    char path[1024];
    json_error_t error;
    *out = (table){0};
    (void)snprintf(path, sizeof path, KT_REFERENCE "/%s.json", name);
    json_t *root = json_load_file(path, 0, &error);
    const bool fine = root && take_rows(json_object_get(root, "reference"), out);
    if (!fine)
        (void)fprintf(stderr, "%s: not a table: %s\n", path, root ? "rows are missing" : error.text);
    json_decref(root);
    return fine;
}

static void close_table(table *t) {
    free(t->t);
    free(t->value);
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* The row of the table at a record's time, or NULL. */
static const double *row_at(const table *known, double t) {
    for (size_t i = 0; i < known->rows; i++)
        if (fabs(known->t[i] - t) <= 1e-9)
            return known->value + i * known->columns;
    return NULL;
}

static int compare(const kt_record *record, void *user) {
    attempt *a = user;
    const double *row = row_at(a->known, record->t);
    if (!row)
        return 0;
    const double error = a->about->error(a->model, record, row, &a->lost);
    a->worst = isnan(error) ? HUGE_VAL : fmax(a->worst, error);
    a->compared++;
    return 0;
}

static int ignore(const kt_record *record, void *user) {
    (void)record, (void)user;
    return 0;
}

static void run_once(attempt *a, kt_recorder *recorder) {
    kt_simulation *simulation = NULL;
    kt_simulation_options options = kt_simulation_options_default();
    options.kinematics = recorder == compare;
    a->status = kt_simulation_create(a->model, &a->run, &options, &simulation, &a->error);
    if (a->status == KT_OK)
        a->status = kt_simulation_run(simulation, recorder, a, &a->error);
    if (a->status == KT_OK)
        a->counts = kt_simulation_counts_of(simulation);
    kt_simulation_free(simulation);
}

static void repeat(void *user, long repetitions) {
    attempt *a = user;
    for (long k = 0; k < repetitions && a->status == KT_OK; k++)
        run_once(a, ignore);
}

/* The error with a tolerance: over all rows of the table up to the duration; infinite where the run fails. */
static double error_with(attempt *a, const kt_run *run, double tolerance) {
    a->run = *run;
    a->run.relative = a->run.absolute = tolerance;
    a->worst = 0.0;
    a->compared = 0;
    run_once(a, compare);
    return a->status == KT_OK && a->compared > 0 && !a->lost ? a->worst : HUGE_VAL;
}

static double rung(int i) { return pow(10.0, -2.0 - 0.25 * i); }

/* The largest tolerance that keeps the bound, as do the next three; 0 where there is none. Leaves it in the run. */
static double choose_tolerance(attempt *a, const kt_run *run, double *error) {
    enum { KEPT = 4 };
    int kept = 0;
    double first = 0.0;
    for (int i = 0; i < LADDER && kept < KEPT; i++) {
        const double e = error_with(a, run, rung(i));
        if (e > a->about->bound)
            kept = 0;
        else if (kept++ == 0)
            first = e;
        if (kept == KEPT || (i == LADDER - 1 && kept)) {
            *error = first;
            (void)error_with(a, run, rung(i - kept + 1));
            return rung(i - kept + 1);
        }
    }
    return 0.0;
}

/* ---- the table of figures ---------------------------------------------------------------------------------------- */

static const char about_text[] =
    "Times runs of Andrews' squeezing mechanism and of Bricard's mechanism that keep a published accuracy.\n";
static const char columns[] = "scene,method,tolerance,evaluations,error," KT_CSV_TIMES "," KT_CSV_ORIGIN;

/* Seconds of the best method; a negative number where nothing could be measured. */
static double try_methods(const problem *p, const kt_scene *scene, const kt_model *model, const table *known,
                          const kt_bench_options *options, kt_csv *csv) {
    double best = HUGE_VAL;
    for (int m = 0; m < kt_method_count(); m++) {
        const kt_method *method = kt_method_at(m);
        if (method->embedded_order == 0 || method->order < 3)
            continue;
        attempt a = {.about = p, .model = model, .known = known};
        kt_run run = scene->run;
        double error = HUGE_VAL;
        run.integrator = method->name;
        run.step = 0.0;
        run.duration = p->duration;
        run.interval = known->rows > 1 ? known->t[1] - known->t[0] : p->duration;
        const double tolerance = choose_tolerance(&a, &run, &error);
        if (!(tolerance > 0.0)) {
            printf("%10s %10s: no tolerance keeps %g %s\n", p->scene, method->name, p->bound, p->unit);
            continue;
        }
        const kt_bench_task task = {repeat, &a};
        kt_bench_times times;
        a.run.interval = a.run.duration; /* the first record and the last */
        a.run.record = KT_RECORD_POSITION;
        a.run.marker_count = 0;
        kt_bench_measure(&task, 1, options->seconds, &times);
        if (a.status != KT_OK) {
            (void)kt_bench_tell(&a.error);
            return -1.0;
        }
        printf("%10s %10s %10.1e %8llu %10.1e %s %9.3f %9.3f\n", p->scene, method->name, tolerance,
               (unsigned long long)a.counts.evaluations, error, p->unit, 1e3 * times.low, 1e3 * times.high);
        best = fmin(best, times.low);
        kt_csv_text(csv, p->scene);
        kt_csv_text(csv, method->name);
        kt_csv_number(csv, tolerance);
        kt_csv_number(csv, (double)a.counts.evaluations);
        kt_csv_number(csv, error);
        kt_csv_times(csv, &times);
        kt_csv_origin(csv, kt_model_isa(model));
        kt_csv_line(csv);
    }
    return best;
}

static int measure(const problem *p, const kt_bench_options *options, kt_csv *csv) {
    char path[1024];
    kt_error error;
    kt_scene scene = kt_scene_default();
    kt_model *model = NULL;
    table known = {0};
    double best = -1.0;
    (void)snprintf(path, sizeof path, KT_SCENES "/%s.yaml", p->scene);
    kt_model_options settings = kt_model_options_default();
    settings.isa = options->isa;
    if (kt_scene_read(path, &scene, NULL, NULL, &error) != KT_OK ||
        kt_model_compile(&scene.description, &settings, &model, &error) != KT_OK)
        (void)kt_bench_tell(&error);
    else if (open_table(p->table, &known))
        best = try_methods(p, &scene, model, &known, options, csv);
    close_table(&known);
    kt_model_free(model);
    kt_scene_free(&scene);
    if (!(best > 0.0 && best < HUGE_VAL))
        return KT_BENCH_FAILED;
    printf("%10s: %g %s in %.3f ms: %s\n\n", p->scene, p->bound, p->unit, 1e3 * best,
           best <= seconds_most ? "less than 6 ms" : "MORE THAN 6 ms");
    return best <= seconds_most || !options->check ? KT_BENCH_DONE : KT_BENCH_MISSED;
}

int main(int argc, char **argv) {
    kt_bench_options options = {.max = 1, .seconds = 0.5};
    int result = kt_bench_read(argc, argv, about_text, &options);
    if (result >= 0)
        return result;
    kt_csv csv;
    if (!kt_csv_open(&csv, options.csv, columns))
        return KT_BENCH_FAILED;
    kt_bench_heading("Published mechanisms to a published accuracy", options.isa, options.csv);
    printf("%10s %10s %10s %8s %12s %11s %9s\n", "scene", "method", "tolerance", "calls", "error", "ms (25%)", "(75%)");
    result = KT_BENCH_DONE;
    for (size_t i = 0; i < sizeof problems / sizeof *problems; i++) {
        const int one = measure(&problems[i], &options, &csv);
        result = one > result ? one : result;
    }
    return kt_csv_close(&csv) ? result : KT_BENCH_FAILED;
}
