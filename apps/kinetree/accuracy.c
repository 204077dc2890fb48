/* kinetree accuracy: what accuracy costs, for any scene. */
#include "accuracy.h"
#include "output.h"

#include "plot.h"
#include "run.h"
#include "start.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

static double cpu_now(void *user) {
    struct timespec time;
    (void)user;
    if (clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time) != 0)
        return 0.0;
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static int show_progress(double done, const char *what, void *user) {
    kt_progress_show(user, done, what);
    return 0;
}

static kt_accuracy_options choose_options(const kt_accuracy_arguments *arguments, const kt_reference_file *reference,
                                          kt_progress *progress) {
    kt_accuracy_options options = kt_accuracy_options_default();
    options.duration = isnan(arguments->duration) ? 0.0 : arguments->duration;
    options.methods = arguments->method_count > 0 ? arguments->methods : NULL;
    options.method_count = arguments->method_count;
    options.steps = arguments->step_count > 0 ? arguments->steps : NULL;
    options.step_count = arguments->step_count;
    options.tolerances = arguments->tolerance_count > 0 ? arguments->tolerances : NULL;
    options.tolerance_count = arguments->tolerance_count;
    options.reference = reference->states != NULL ? &reference->reference : NULL;
    options.budget = arguments->budget;
    options.clock = cpu_now;
    options.progress = show_progress;
    options.user = progress;
    return options;
}

static void say_file(const char *what, const char *path) {
    if (path != NULL && strcmp(path, "-") != 0)
        fprintf(stderr, "  %s: %s\n", what, kt_show(path).text);
}

/* Everything that is to come out, in turn. */
static int tell(const kt_findings *findings) {
    const kt_accuracy_arguments *arguments = findings->arguments;
    int code = KT_EXIT_DONE;
    if (arguments->out != NULL)
        code = kt_findings_write(findings, arguments->out);
    if (arguments->plot != NULL) {
        const int drawn = kt_findings_draw(findings, arguments->plot, arguments->dark);
        code = code == KT_EXIT_DONE ? drawn : code;
    }
    if (arguments->plot_dark != NULL) {
        const int drawn = kt_findings_draw(findings, arguments->plot_dark, true);
        code = code == KT_EXIT_DONE ? drawn : code;
    }
    if (code == KT_EXIT_DONE && !arguments->quiet) {
        say_file("every run", arguments->out);
        say_file("picture", arguments->plot);
        say_file("picture", arguments->plot_dark);
    }
    /* Tables and lines of CSV cannot share standard output. */
    if (!arguments->quiet && (arguments->out == NULL || strcmp(arguments->out, "-") != 0)) {
        kt_findings_print(findings);
        fflush(stdout);
        const int priced =
            arguments->compare_sets ? kt_findings_print_sets(findings) : kt_findings_print_prices(findings);
        code = code == KT_EXIT_DONE ? priced : code;
    }
    return kt_finish_output(code);
}

static int study_scene(const kt_accuracy_arguments *arguments, const kt_scene *scene, const char *name,
                       const kt_reference_file *reference) {
    kt_error error = {0};
    kt_progress progress = kt_progress_start(arguments->quiet);
    kt_accuracy_options options = choose_options(arguments, reference, &progress);
    kt_variant variants[KT_COMPARED_FORMULATIONS];
    if (arguments->compare_sets) {
        kt_compared_formulations(&scene->run, variants);
        options.variants = variants;
        options.variant_count = KT_COMPARED_FORMULATIONS;
    }
    kt_findings findings = {.arguments = arguments, .scene = scene, .name = name};
    kt_status status = kt_accuracy_create(&scene->description, &scene->run, &options, &findings.study, &error);
    kt_progress_end(&progress);
    if (status != KT_OK) {
        kt_say_error(&error);
        return kt_exit_code(status);
    }
    findings.results = kt_accuracy_get(findings.study);
    const int code = tell(&findings);
    kt_accuracy_free(findings.study);
    return code;
}

static int study_file(const kt_accuracy_arguments *arguments, const char *path, const char *base) {
    kt_scene scene;
    kt_model *model = NULL;
    kt_reference_file reference = {0};
    int code = kt_load_model(path, &scene, &model);
    if (code != KT_EXIT_DONE)
        return code;
    const char *title = scene.description.name;
    if (arguments->compare_sets && kt_loop_count(model) == 0) {
        kt_say("accuracy: %s: --compare-sets: nothing to compare: there are no loops to keep closed", path);
        kt_model_free(model);
        kt_scene_free(&scene);
        return KT_EXIT_USAGE;
    }
    if (!arguments->quiet && kt_model_mobility(model).minimal == 0)
        kt_say(
            "accuracy: the scene has no degrees of freedom: its loops alone tell the motion, and the projection after "
            "each step closes them to rounding, whatever the method; what methods differ in is the step that the "
            "projection can follow, and its cost");
    code = arguments->reference != NULL
               ? kt_reference_read(arguments->reference, model, arguments->duration, &reference)
               : -1;
    if (code < 0) {
        const int start = kt_start_tell(&scene, model);
        code = start == KT_EXIT_DONE ? -1 : start;
    }
    if (code < 0)
        code = study_scene(arguments, &scene, title != NULL && *title != '\0' ? title : base, &reference);
    free(reference.states);
    kt_model_free(model);
    kt_scene_free(&scene);
    return code;
}

/* ---- where results go -------------------------------------------------------------------------------------------- */

/* NAME-accuracy.csv beside the records of `kinetree run`, NAME.csv. The caller frees it. */
static char *default_name(const char *base, const char *ending) {
    const size_t room = strlen(base) + strlen("-accuracy") + strlen(ending) + 1;
    char *name = malloc(room);
    if (name != NULL)
        snprintf(name, room, "%s-accuracy%s", base, ending);
    return name;
}

/* What the command line leaves open. A picture is none by any name but that of its format, and so by that of nothing. */
static void choose_files(kt_accuracy_arguments *arguments, const char *csv, const char *picture) {
    if (arguments->out == NULL)
        arguments->out = csv;
    if (arguments->plot == NULL && arguments->plot_dark == NULL && kt_plot_is_possible())
        arguments->plot = picture;
    if (arguments->plot != NULL && strcmp(arguments->plot, "/dev/null") == 0)
        arguments->plot = NULL;
}

static int check_results(const kt_accuracy_arguments *arguments, const char *path) {
    const kt_file_use uses[] = {{"the scene", path, false},
                                {"the reference", arguments->reference, false},
                                {"--out", arguments->out, true},
                                {"--plot", arguments->plot, true},
                                {"--plot-dark", arguments->plot_dark, true}};
    int code = kt_check_files("accuracy", uses, sizeof uses / sizeof uses[0]);
    if (code < 0 && arguments->plot != NULL)
        code = kt_plot_check(arguments->plot);
    if (code < 0 && arguments->plot_dark != NULL)
        code = kt_plot_check(arguments->plot_dark);
    return code;
}

int kt_command_accuracy(int argc, char **argv) {
    kt_accuracy_arguments arguments;
    int code = kt_accuracy_arguments_read(argc, argv, &arguments);
    if (code >= 0)
        return code;
    char *base = kt_base_name(argv[1]);
    char *csv = base != NULL ? default_name(base, ".csv") : NULL,
         *picture = base != NULL ? default_name(base, ".svg") : NULL;
    if (csv == NULL || picture == NULL) {
        kt_say("there is not enough memory");
        code = KT_EXIT_INTEGRATION;
    } else {
        choose_files(&arguments, csv, picture);
        code = check_results(&arguments, argv[1]);
    }
    if (code < 0)
        code = study_file(&arguments, argv[1], base);
    free(picture);
    free(csv);
    free(base);
    return code;
}
