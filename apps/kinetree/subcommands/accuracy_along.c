/* `accuracy --vary`: runs a study for each value of a parameter. Each study writes one line, as a run of a sweep does:
 * the cheapest setting for each goal, and its cost. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/accuracy.h"

#include "open/load.h"
#include "records/output.h"
#include "sweep/sweep.h"

#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* The columns of the lines besides the values, of which the first COLUMNS are written; those of each goal follow. The
 * others are those of sweeps: a parameter has the same column in both. */
static const char *const columns[] = {"run",         "status",       "uncertainty", "time", "steps",
                                      "evaluations", "energy.error", KT_SWEEP_WHY,  NULL};
enum { COLUMNS = 3 };

struct kt_accuracy_along {
    const kt_accuracy_arguments *arguments;
    const kt_sweep_plan *plan;
    FILE *file;
    int64_t number;
    const double *values;
    bool written;
};

/* Ends a line, and writes it. Returns an exit code. */
static int put_line(FILE *file, kt_bytes *line) {
    kt_bytes_print(line, "\n");
    const int code = line->is_short ? kt_reject(KT_EXIT_INTEGRATION, "accuracy: a line is left out: there is not "
                                                                     "enough memory")
                                    : KT_EXIT_DONE;
    if (code == KT_EXIT_DONE)
        (void)fputs(line->text, file);
    free(line->text);
    return code;
}

static int write_header(FILE *file, const kt_accuracy_arguments *arguments, const kt_sweep_plan *plan) {
    kt_bytes line = {0};
    kt_sweep_plan_head(plan, COLUMNS, &line);
    for (int g = 0; g < arguments->goal_count; g++) {
        const double goal = arguments->goals[g];
        kt_bytes_print(&line, ",evaluations.%g,seconds.%g,setting.%g,method.%g", goal, goal, goal, goal);
    }
    return put_line(file, &line);
}

static void add_goal(kt_bytes *line, const kt_findings *findings, double goal) {
    const int best = findings != NULL ? kt_accuracy_best(findings->study, goal) : -1;
    if (best < 0) { /* no run came that close */
        kt_bytes_print(line, ",,,,");
        return;
    }
    const kt_accuracy_point *point = &findings->results->points[best];
    const double per_second = 1.0 / findings->results->duration;
    kt_bytes_print(line, ",%.6g,%.3g,%.6g,%s", (double)point->counts.evaluations * per_second, point->cpu * per_second,
                   point->setting, kt_findings_method(kt_findings_curve(findings, best)));
}

int kt_accuracy_along_line(kt_accuracy_along *along, const kt_findings *findings) {
    kt_bytes line = {0};
    kt_bytes_print(&line, "%lld", (long long)along->number);
    for (int i = 0; i < along->plan->count; i++)
        kt_sweep_put_cell(&line, along->values[i]);
    if (findings != NULL)
        kt_bytes_print(&line, ",done,%.3g", findings->results->uncertainty.judged);
    else
        kt_bytes_print(&line, ",failed,");
    for (int g = 0; g < along->arguments->goal_count; g++)
        add_goal(&line, findings, along->arguments->goals[g]);
    along->written = true;
    return put_line(along->file, &line);
}

/* The settings of the command line, and the values of a run. */
static kt_settings settings_of_run(const kt_accuracy_arguments *arguments, const kt_sweep_plan *plan, int64_t run,
                                   kt_sweep_texts *texts) {
    double values[KT_SWEEP_AXES_MAX];
    kt_settings settings = arguments->settings;
    kt_sweep_plan_values(plan, run, values);
    kt_sweep_plan_set(plan, values, texts, &settings);
    return settings;
}

/* The studies of a file of lines, and the exit code of the last one that failed. */
typedef struct kt_studies {
    const kt_accuracy_arguments *arguments;
    const kt_sweep_plan *plan;
    kt_accuracy_study *study;
    const char *path, *base;
    int *code;
} kt_studies;

/* Runs all studies, one after the other, because parallel studies would disturb each other's measured times. */
static void write_all_studies(FILE *file, const void *what) {
    const kt_studies *all = what;
    const kt_accuracy_arguments *arguments = all->arguments;
    *all->code = write_header(file, arguments, all->plan);
    for (int64_t run = 0; run < kt_sweep_plan_runs(all->plan); run++) {
        double values[KT_SWEEP_AXES_MAX];
        kt_sweep_texts texts;
        kt_accuracy_arguments one = *arguments;
        kt_sweep_plan_values(all->plan, run, values);
        one.settings = settings_of_run(arguments, all->plan, run, &texts);
        kt_accuracy_along along = {
            .arguments = arguments, .plan = all->plan, .file = file, .number = run, .values = values};
        one.along = &along;
        const int studied = all->study(&one, all->path, all->base);
        const int written = along.written ? KT_EXIT_DONE : kt_accuracy_along_line(&along, NULL);
        if (!arguments->quiet)
            kt_print("%lld of %lld values\n", (long long)run + 1, (long long)kt_sweep_plan_runs(all->plan));
        *all->code = studied != KT_EXIT_DONE ? studied : written != KT_EXIT_DONE ? written : *all->code;
        (void)fflush(file);
    }
}

/* Rejects values that vary and that the scene does not have or use, before the file of lines is written. If the scene
 * is wrong with each of the first thousand values, the errors of the first one are printed. Returns -1, or an exit code
 * after printing the error. */
static int check_varied_values(const kt_accuracy_arguments *arguments, const kt_sweep_plan *plan, const char *path) {
    const int64_t runs = kt_sweep_plan_runs(plan), most = runs < 1000 ? runs : 1000;
    kt_sweep_texts texts;
    kt_scene scene;
    if (strcmp(path, "-") == 0)
        return kt_misuse(
            "accuracy: --vary reads the scene anew for each value, and standard input can be read once; name a file");
    for (int64_t run = 0; run < most; run++) {
        const kt_settings settings = settings_of_run(arguments, plan, run, &texts);
        kt_scene_options options = kt_scene_options_default();
        kt_error error = {0};
        options.settings = settings.text;
        options.setting_count = settings.count;
        if (kt_scene_read_with(path, &options, &scene, NULL, NULL, &error) != KT_OK)
            continue;
        int code = kt_check_scene_files(&scene);
        code = code < 0 ? kt_sweep_plan_check(plan, &scene) : code;
        kt_scene_free(&scene);
        return code;
    }
    const kt_settings settings = settings_of_run(arguments, plan, 0, &texts);
    const int code = kt_read_scene(path, &settings, &scene);
    if (code != KT_EXIT_DONE)
        return code;
    kt_scene_free(&scene);
    return -1;
}

int kt_accuracy_study_all(const kt_accuracy_arguments *arguments, kt_accuracy_study *study, const char *path,
                          const char *base) {
    const kt_sweep_arguments sweep = {.settings = arguments->settings, .vary = arguments->vary, .repeats = 1};
    kt_sweep_plan plan;
    int code = kt_sweep_plan_make(&sweep, columns, &plan);
    code = code < 0 ? check_varied_values(arguments, &plan, path) : code;
    if (code < 0) {
        const kt_studies all = {arguments, &plan, study, path, base, &code};
        const int written = kt_output_write(arguments->out, write_all_studies, &all);
        code = written != KT_EXIT_DONE ? written : code;
    }
    kt_sweep_plan_free(&plan);
    return code;
}
