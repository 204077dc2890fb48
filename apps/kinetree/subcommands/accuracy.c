/* kinetree accuracy: the cost of each accuracy for any scene (methods, step sizes and tolerances compared). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/accuracy.h"
#include "open/start.h"
#include "plot/plot.h"
#include "records/output.h"
#include "subcommands/run.h"
#include "text/arguments.h"
#include "text/list.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the command line ------------------------------------------------------------------------------------------- */

#define KT_AT(member) offsetof(kt_accuracy_arguments, member)

static const kt_option option_table[] = {
    KT_SET_OPTION,
    KT_OPTION(NAMES, "integrators", integrator_list, "A,B",
              "compare these methods only; 'steps': time stepping over hard contacts; default: all"),
    KT_OPTION(TEXT, "steps", step_list, "H,...",
              "use these steps for methods without an error estimate, s; default: found"),
    KT_OPTION(TEXT, "tolerances", tolerance_list, "T,...", "use these tolerances for adaptive methods; default: found"),
    KT_OPTION(POSITIVE, "duration", duration, "S", "simulate for S seconds"),
    KT_OPTION(TEXT, "goal", goal_list, "E,...", "find settings for these errors; default: 1e-3,1e-6,1e-9"),
    KT_OPTION(TEXT, "of", of, "position|velocity|COLUMN",
              "study errors of positions, of velocities, or of a column such as reaction.crank.fx; default: position"),
    KT_OPTION(SETTING, "vary", vary, "NAME=VALUES",
              "run a study for each value, as sweep does, and write one line of CSV each: the cost of each goal; no "
              "pictures"),
    KT_OPTION(TEXT, "reference", reference, "FILE", "compare with these records of a trusted run; default: computed"),
    KT_OPTION(POSITIVE, "budget", budget, "S",
              "limit the CPU time of the study to S seconds; default: 20; 60 with --formulations"),
    KT_FLAG("prices", prices,
            "measure the costs of projection, formulation, reduction and records; default: if that is cheap"),
    KT_FLAG("formulations", formulations,
            "compare methods that keep loops closed, and their errors; with rk4 and dopri5"),
    KT_FLAG(
        "baselines", baselines,
        "compare differential-algebraic formulations of the loops, with implicit methods; no other table and no file"),
    KT_FLAG("peers", peers, "run the scene in other engines, too: with each program kinetree-peer-NAME on the PATH"),
    KT_OPTION(TEXT, "out", out, "FILE",
              "write every run as a line of CSV; '-': standard output; default: NAME-accuracy.csv; /dev/null: none"),
    KT_OPTION(
        TEXT, "plot", plot, "FILE",
        "draw the work-precision diagram: FILE.svg, FILE.png or FILE.pdf; default: NAME-accuracy.svg; /dev/null: none"),
    KT_OPTION(TEXT, "plot-dark", plot_dark, "FILE", "draw the diagram on a dark page, with --plot or alone"),
    KT_FLAG("dark", dark, "draw the picture on a dark page"),
    KT_FLAG("all", all, "draw all methods, not only the best of each family"),
    KT_FLAG("settings", name_settings, "write the step or the tolerance at each point of the picture"),
    KT_OPTION(TEXT, "size", size, "WxH",
              "set the size of the picture, such as 420x800 for a phone; default: 1039x527, for a slide"),
    KT_ROBOT_OPTIONS,
    KT_FLAG("quiet", quiet, "print errors only: no progress bar, no tables"),
    KT_VERBOSE_OPTION,
};

static const kt_option_rule rules[] = {
    {"vary", false, "baselines,formulations,prices,plot,plot-dark,all,settings,size,reference",
     "--vary writes a line for each value; --plot, --reference, --prices, --formulations and --baselines are of a "
     "single study"},
    {"peers", false, "vary,baselines,formulations",
     "--peers is of a single study, without --vary, --formulations and --baselines"},
    {"of", false, "peers,baselines", "--peers and --baselines compare positions; leave --of out"},
    {"baselines", false, "integrators,formulations,out,plot,plot-dark,all,settings,size,prices,tolerances",
     "--baselines has a table of its own: it takes --steps, --duration and --reference, and no other choice of runs "
     "and outputs"},
};

const kt_usage kt_usage_accuracy = {
    .command = "accuracy",
    .examples = "  kinetree accuracy pendulum.yaml\n"
                "  kinetree accuracy pendulum.yaml --goal 1e-6 --plot pendulum-cost.svg --out pendulum-cost.csv\n"
                "  kinetree accuracy robot.yaml --integrators rk4,dopri5 --duration 2 --budget 60\n"
                "  kinetree accuracy robot.yaml --integrators rk4 --steps 1e-3,5e-4 --reference exact.csv\n"
                "  kinetree accuracy robot.yaml --peers --plot robot-engines.svg\n"
                "  kinetree accuracy linkage.yaml --formulations --plot linkage-formulations.svg\n"
                "  kinetree accuracy linkage.yaml --baselines --duration 1 --steps 0.01,0.005,0.0025\n",
    .operands = "SCENE",
    .about =
        "Compares the cost of accuracy: runs a scene with every method at many steps or tolerances.\n"
        "The study measures CPU time, and the error against a reference that is itself checked.\n"
        "The study prints the cheapest setting for each goal.\n"
        "An error is the largest one over all joints and records, of positions or of the choice of --of.\n"
        "Angles are compared on the circle, and quaternions using the rotation between them, in rad.\n"
        "Lengths are divided by the length scale of the scene; without angles they are in metres.\n"
        "Errors are measured outside of short windows about events. A second table has the errors of the times of "
        "events.\n"
        "The picture has the best method of each family, at most eight. Slopes show orders, and rings show the "
        "recommended points.\n"
        "Bars reach from the least to the median of measured times.\n"
        "If the scene is chaotic, the study ends when errors have grown by a factor of a million, and prints a note.\n"
        "\n"
        "--formulations compares the reduction with and without projection, the absolute formulation, Baumgarte's "
        "stabilisation,\n"
        "the augmented Lagrangian and force projection.\n"
        "Baumgarte's gains are 0.1 and 0.4, divided by the step.\n"
        "\n"
        "--peers adds points of other engines to the tables, the CSV file and the diagram, for the same records.\n"
        "'bench/run engines SCENE' builds the programs for MuJoCo, ODE, Simbody and SUNDIALS, and does this.\n"
        "An engine that fails is listed with its reason.\n"
        "\n"
        "--baselines compares equations with multipliers: of index 3, 2 and 1, of Gear, Leimkuhler and Gupta, and of "
        "index 1 after Baumgarte.\n"
        "They are integrated with implicit Euler, Crank-Nicolson, BDF2, the two-step method and Radau IIA, in tree and "
        "absolute coordinates.\n"
        "The tables list errors of positions, velocities and multipliers, drift, condition and orders.\n",
    KT_OPTIONS_OF(option_table),
    KT_RULES_OF(rules),
};

/* Reads the methods of --integrators, in the order of kt_method_at. */
static int read_methods(kt_accuracy_arguments *arguments) {
    char word[64];
    const char *rest = arguments->integrator_list;
    bool wanted[KT_ACCURACY_METHODS_MAX] = {false};
    while (kt_list_next(&rest, word, sizeof word)) {
        if (strcmp(word, KT_STEPS_NAME) == 0) {
            arguments->has_steps = true;
            continue;
        }
        const kt_method *method = kt_method_find(word);
        if (method == NULL)
            return kt_reject_method("accuracy: --integrators", word);
        for (int i = 0; i < kt_method_count() && i < KT_ACCURACY_METHODS_MAX; i++)
            wanted[i] = wanted[i] || kt_method_at(i) == method;
    }
    for (int i = 0; i < kt_method_count() && i < KT_ACCURACY_METHODS_MAX; i++)
        if (wanted[i])
            arguments->methods[arguments->method_count++] = kt_method_at(i);
    return -1;
}

static int read_lists(kt_accuracy_arguments *a) {
    int code = a->integrator_list != NULL ? read_methods(a) : -1;
    if (code >= 0)
        return code;
    if (a->baselines) { /* the study needs one run of its own */
        a->methods[0] = kt_method_find("dopri5");
        a->method_count = 1;
        a->tolerances[0] = 1e-6;
        a->tolerance_count = 1;
    }
    if (a->integrator_list == NULL && a->formulations)
        a->method_count = kt_compared_methods(a->methods);
    if (a->step_list != NULL)
        a->step_count = kt_list_read("accuracy", "steps", a->step_list, a->steps, KT_ACCURACY_SETTINGS_MAX);
    if (a->tolerance_list != NULL && a->step_count >= 0)
        a->tolerance_count =
            kt_list_read("accuracy", "tolerances", a->tolerance_list, a->tolerances, KT_ACCURACY_SETTINGS_MAX);
    if (a->step_count >= 0 && a->tolerance_count >= 0)
        a->goal_count = kt_list_read("accuracy", "goal", a->goal_list != NULL ? a->goal_list : "1e-3,1e-6,1e-9",
                                     a->goals, KT_ACCURACY_GOALS_MAX);
    return a->step_count < 0 || a->tolerance_count < 0 || a->goal_count < 0 ? KT_EXIT_USAGE : -1;
}

/* Parses the command line. Returns -1 if the command can continue, else an exit code. */
static int read_accuracy_arguments(int argc, char **argv, kt_accuracy_arguments *arguments) {
    *arguments = (kt_accuracy_arguments){.duration = (double)NAN, .budget = (double)NAN};
    int code = kt_arguments_read(&kt_usage_accuracy, argc, argv, arguments, NULL);
    if (isnan(arguments->budget)) /* a comparison of formulations has many more curves */
        arguments->budget = arguments->formulations ? 60.0 : 20.0;
    if (code < 0)
        code = kt_plot_size_read("accuracy", arguments->size, &arguments->picture_size);
    return code >= 0 ? code : read_lists(arguments);
}

/* Whether formulations or other engines are compared, which have neither events nor hard contacts. */
static bool compares_equations(const kt_accuracy_arguments *arguments) {
    return arguments->formulations || arguments->baselines || arguments->peers;
}

static double cpu_now(void *user) {
    (void)user;
    return kt_cpu_clock();
}

static int show_study_progress(double done, const char *what, void *user) {
    kt_progress_show(user, done, what);
    return 0;
}

static kt_accuracy_options choose_study_options(const kt_accuracy_arguments *arguments, const kt_study_subject *subject,
                                                const kt_reference_file *reference, kt_progress *progress) {
    kt_accuracy_options options = kt_accuracy_options_default();
    options.duration = isnan(arguments->duration) ? 0.0 : arguments->duration;
    if (arguments->baselines)
        options.records = 20; /* steps are at most as long as their interval */
    options.methods = arguments->method_count > 0 || arguments->has_steps ? arguments->methods : NULL;
    options.method_count = arguments->method_count;
    options.steps = arguments->step_count > 0 ? arguments->steps : NULL;
    options.step_count = arguments->step_count;
    options.tolerances = arguments->tolerance_count > 0 ? arguments->tolerances : NULL;
    options.tolerance_count = arguments->tolerance_count;
    options.goals = arguments->goals;
    options.goal_count = arguments->goal_count;
    options.reference = reference->states != NULL ? &reference->reference : NULL;
    options.subject = subject->of;
    options.quantity = subject->of == KT_ACCURACY_QUANTITY ? &subject->quantity : NULL;
    options.budget = arguments->budget;
    options.clock = cpu_now;
    options.progress = show_study_progress;
    options.user = progress;
    return options;
}

static void say_study_file(const char *what, const char *path) {
    if (path != NULL && strcmp(path, "-") != 0)
        kt_print("  %s: %s\n", what, kt_show(path).text);
}

/* Writes the CSV file and the pictures, prints their names, then the tables. Returns an exit code. */
static int report_findings(const kt_findings *findings) {
    const kt_accuracy_arguments *arguments = findings->arguments;
    int code = KT_EXIT_DONE;
    if (arguments->baselines)
        return kt_finish_output(kt_findings_print_baselines(findings));
    if (arguments->out != NULL)
        code = kt_findings_write(findings, arguments->out);
    for (int dark = 0; dark < 2; dark++) {
        const char *path = dark ? arguments->plot_dark : arguments->plot;
        const int drawn = path != NULL ? kt_findings_draw(findings, path, dark || arguments->dark) : KT_EXIT_DONE;
        code = code == KT_EXIT_DONE ? drawn : code;
    }
    if (code == KT_EXIT_DONE && !arguments->quiet) {
        say_study_file("every run", arguments->out);
        say_study_file("picture", arguments->plot);
        say_study_file("picture", arguments->plot_dark);
    }
    /* Tables and CSV lines must not be mixed on standard output. */
    if (!arguments->quiet && (arguments->out == NULL || strcmp(arguments->out, "-") != 0)) {
        kt_findings_print(findings);
        fflush(stdout);
        const int priced =
            arguments->formulations ? kt_findings_print_formulations(findings) : kt_findings_print_prices(findings);
        code = code == KT_EXIT_DONE ? priced : code;
    }
    return kt_finish_output(code);
}

/* The report, after runs in other engines if they are asked for. */
static int report_with_peers(kt_findings *findings, const char *path) {
    const kt_accuracy_arguments *a = findings->arguments;
    const kt_peer_work work = {findings->scene, path, &a->settings, findings->study, a->budget, a->quiet};
    kt_peers *peers = NULL;
    int code = a->peers ? kt_peers_measure(&work, &peers) : -1;
    findings->peers = peers;
    if (code < 0)
        code = report_findings(findings);
    findings->peers = NULL;
    free(peers);
    return code;
}

/* A study of the whole motion, with events and hard contacts. */
static void choose_events(const kt_accuracy_arguments *arguments, const kt_scene *scene, const kt_model *model,
                          kt_accuracy_events *events, kt_accuracy_options *options) {
    *events = kt_study_events(scene);
    options->events = events->count > 0 && !compares_equations(arguments) ? events : NULL;
    options->contact_steps =
        kt_contact_count(model) > 0 && (arguments->has_steps || arguments->integrator_list == NULL);
}

static int study_scene(const kt_accuracy_arguments *arguments, const kt_scene *scene, const kt_model *model,
                       const char *path, const char *name, const kt_study_subject *subject,
                       const kt_reference_file *reference) {
    kt_error error = {0};
    kt_progress progress = kt_progress_start(arguments->quiet);
    kt_accuracy_options options = choose_study_options(arguments, subject, reference, &progress);
    const kt_variant own = kt_own_variant(scene);
    kt_variant variants[KT_COMPARED_FORMULATIONS];
    kt_accuracy_events events;
    choose_events(arguments, scene, model, &events, &options);
    options.own = &own;
    if (arguments->formulations) {
        kt_compared_formulations(scene, variants);
        options.variants = variants;
        options.variant_count = KT_COMPARED_FORMULATIONS;
    }
    kt_findings findings = {.arguments = arguments, .scene = scene, .name = name, .subject = subject};
    kt_status status = kt_accuracy_create(&scene->description, &scene->run, &options, &findings.study, &error);
    kt_progress_end(&progress);
    if (status != KT_OK)
        return kt_say_status(status, &error);
    findings.results = kt_accuracy_results_of(findings.study);
    const int code = arguments->along != NULL ? kt_accuracy_along_line(arguments->along, &findings)
                                              : report_with_peers(&findings, path);
    kt_accuracy_free(findings.study);
    return code;
}

static int study_file(const kt_accuracy_arguments *arguments, const char *path, const char *base) {
    kt_scene scene;
    kt_model *model = NULL;
    kt_reference_file reference = {0};
    kt_study_subject subject = {.of = KT_ACCURACY_POSITIONS};
    kt_settings settings = arguments->settings;
    settings.is_quiet = arguments->quiet;
    int code = kt_load_model(path, &settings, &scene, &model);
    if (code != KT_EXIT_DONE)
        return code;
    code = compares_equations(arguments) ? kt_reject_contacts("accuracy", model) : -1;
    if (code < 0 && arguments->has_steps && kt_contact_count(model) == 0)
        code = kt_misuse("accuracy: --integrators steps: time stepping is for hard stops, contacts, slack ropes and "
                         "friction that sticks, and %s has none; leave it out",
                         kt_show(path).text);
    if (code < 0 && (arguments->formulations || arguments->baselines) && kt_loop_count(model) == 0)
        code = kt_misuse("accuracy: %s: --%s: nothing to compare: there are no loops to keep closed", path,
                         arguments->baselines ? "baselines" : "formulations");
    if (code < 0 && compares_equations(arguments))
        kt_say_left_out("accuracy", &scene);
    if (code < 0 && !arguments->quiet && kt_model_mobility(model).minimal == 0)
        kt_say("accuracy: the scene has no degrees of freedom: its loops alone determine the motion, and the "
               "projection after each step closes them to rounding with any method. Methods differ in cost, and in the "
               "largest step that the projection can follow");
    if (code < 0 && arguments->reference != NULL)
        code = kt_reference_read(arguments->reference, model, arguments->duration, &reference);
    if (code < 0) {
        const int start = kt_start_report(&scene, model);
        code = start == KT_EXIT_DONE ? -1 : start;
    }
    if (code < 0)
        code = kt_study_subject_open(&subject, arguments->of, &scene, model);
    if (code < 0 && subject.of == KT_ACCURACY_QUANTITY && arguments->reference != NULL)
        code = kt_misuse("accuracy: --reference has positions and velocities, not the values of --of %s; leave one out",
                         kt_show(arguments->of).text);
    if (code < 0)
        code = study_scene(arguments, &scene, model, path, kt_title_of(model, base), &subject, &reference);
    kt_study_subject_close(&subject);
    free(reference.states);
    kt_model_free(model);
    kt_scene_free(&scene);
    return code;
}

/* ---- output files ------------------------------------------------------------------------------------------------ */

/* Fills in the file names that the command line does not give. A picture needs a name that ends in its format, hence
 * /dev/null means no picture. */
static void choose_files(kt_accuracy_arguments *arguments, const char *csv, const char *picture) {
    if (arguments->baselines)
        return;
    if (arguments->out == NULL)
        arguments->out = csv;
    if (arguments->plot == NULL && arguments->plot_dark == NULL && arguments->vary.count == 0 && kt_plot_is_possible())
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
    if (code < 0 && kt_stem_length(arguments->out, ".svg|.png|.pdf") >= 0)
        code = kt_misuse("accuracy: --out writes lines as CSV, not '%s'; did you mean --plot?", arguments->out);
    if (code < 0 && arguments->plot != NULL)
        code = kt_plot_check(arguments->plot);
    if (code < 0 && arguments->plot_dark != NULL)
        code = kt_plot_check(arguments->plot_dark);
    return code;
}

int kt_command_accuracy(int argc, char **argv) {
    kt_accuracy_arguments arguments;
    int code = read_accuracy_arguments(argc, argv, &arguments);
    if (code >= 0)
        return code;
    char *base = kt_base_name(argv[1]);
    char *csv = base != NULL ? kt_join_texts(base, "-accuracy", ".csv") : NULL; /* BASE.csv is that of `run` */
    char *picture = base != NULL ? kt_join_texts(base, "-accuracy", ".svg") : NULL;
    if (csv == NULL || picture == NULL) {
        code = kt_say_no_memory(NULL);
    } else {
        choose_files(&arguments, csv, picture);
        code = check_results(&arguments, argv[1]);
    }
    if (code < 0)
        code = arguments.vary.count > 0 ? kt_accuracy_study_all(&arguments, study_file, argv[1], base)
                                        : study_file(&arguments, argv[1], base);
    free(picture);
    free(csv);
    free(base);
    return code;
}
