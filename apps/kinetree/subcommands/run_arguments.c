/* Parses the command line of `kinetree run` and applies its options to the scene. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/modes.h"
#include "subcommands/run.h"
#include "text/arguments.h"
#include "text/list.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define KT_AT(member) offsetof(kt_run_arguments, member)

#define KT_RECORD_NAME(id, bit, name) " " #name ","
static const char record_help[] = "record some of" KT_RECORD_LIST(KT_RECORD_NAME) " separated by commas";
#undef KT_RECORD_NAME

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_OPTION(TEXT, "from", from, "RESULT[:TIME]",
              "start from the end of another run: its summary or records, or its record at a time"),
    KT_ROBOT_OPTIONS,
    KT_OPTION(NUMBER, "duration", duration, "S", "simulate for S seconds"),
    KT_OPTION(TEXT, "integrator", integrator, "NAME",
              "use this method; 'kinetree integrators' lists them; default: auto, or dopri5 with a fixed step or above "
              "100 velocity coordinates"),
    KT_OPTION(POSITIVE, "step", step, "S", "take fixed steps of S seconds"),
    KT_OPTION(TEXT, "tolerance", tolerance, "R[,A]", "take adaptive steps with this relative and absolute tolerance"),
    KT_OPTION(POSITIVE, "max-step", max_step, "S", "limit adaptive steps to S seconds"),
    KT_OPTION(NUMBER, "rho", rho, "R", "set the spectral radius of two-step at infinity, 0 to 1"),
    KT_CHOICE("formulation", formulation, "NAME", "choose the coordinates", "tree|absolute"),
    KT_CHOICE("reduction", reduction, "NAME", "choose the elimination of loops", "qr|partition|svd|eigen"),
    KT_CHOICE("metric", metric, "NAME", "choose the metric of the projections", "identity|mass"),
    KT_CHOICE("plan", plan, "NAME", "compute planar trees in their plane (auto), or like all others", "auto|spatial"),
    KT_FLAG("unprojected", unprojected, "let loops drift open, to see the effect of the projection"),
    KT_FLAG("check-error", check_error,
            "estimate the error of the run by a second run at a tenth of the tolerance, or with half of the step"),
    KT_FLAG("native", native,
            "compute accelerations by generated C, which the system's compiler compiles; compiled files are kept"),
    KT_OPTION(POSITIVE, "interval", interval, "S", "record every S seconds; default: about 1000 records"),
    KT_OPTION(NAMES, "record", record, "A,B", record_help),
    KT_OPTION(ANY_NAMES, "markers", markers, "B.M,...", "record the world positions of these markers, too"),
    KT_OPTION(TEXT, "out", out, "FILE",
              "write the records here, as CSV, or as HDF5 (FILE.h5); '-': standard output; default: NAME.csv"),
    KT_OPTION(TEXT, "summary", summary, "FILE", "write the end state and the cost as JSON; '-': standard output"),
    KT_OPTION(TEXT, "scene", scene, "FILE", "write the scene with the end of the run as its initial state"),
    KT_OPTION(TEXT, "plot", plot, "FILE",
              "draw the quantities of --record, or positions and energy: FILE.svg, FILE.png or FILE.pdf"),
    KT_OPTION(TEXT, "size", size, "WxH", "set the size of the picture, such as 1200x800; default: it fits a screen"),
    KT_FLAG("dark", dark, "draw the picture on a dark page"),
    KT_OPTION(TEXT, "view", view, "FILE.html", "write a page that shows the motion, in one file for any browser"),
    KT_OPTION(TEXT, "glb", glb, "FILE.glb", "write the motion as glTF 2.0, for other viewers and modellers"),
    KT_FLAG("boxes", boxes,
            "draw boxes with mass and inertia of the bodies instead of shapes and meshes (--view, --glb)"),
    KT_FLAG("quiet", quiet, "print errors only, and no progress bar"),
    KT_VERBOSE_OPTION,
    KT_OPTION(TEXT, "checkpoint", checkpoint, "FILE", "write the state that --resume needs here, at intervals"),
    KT_OPTION(POSITIVE, "checkpoint-interval", checkpoint_interval, "S",
              "write a checkpoint every S seconds of the clock; default: 10"),
    KT_OPTION(TEXT, "resume", resume, "FILE",
              "continue from a checkpoint of the same run; the records continue in --out"),
    KT_OPTION(TEXT, "records", records, "FILE",
              "show the motion of these records (CSV, HDF5) instead of a run"), /* of `view` alone: the last four */
    KT_OPTION(TEXT, "marks", marks, "SUMMARY", "draw lines at the events in this summary of the records"),
    KT_FLAG("live", live,
            "let the page run the scene itself, with sliders for its numbers (needs a build with -Dbrowser=enabled)"),
    KT_FLAG("modes", modes,
            "show the modes instead of a run: about rest, or about the initial state if it moves; 'kinetree modes "
            "--view' has more choices"),
};
enum { OF_VIEW = 4 };

static const kt_option_group groups[] = {{"Input", "set"},
                                         {"Method", "duration"},
                                         {"Output", "interval"},
                                         {"Recovery", "checkpoint"},
                                         {"Recorded motion", "records"},
                                         {"Live page", "live"},
                                         {"Modes", "modes"},
                                         {NULL, NULL}};

static const char not_with_time[] =
    "--view and --glb would not show the time before the checkpoint; leave --resume or them out";

static const kt_option_rule rules[] = {
    {"boxes", true, "view,glb", NULL}, /* of `run` alone: the first one */
    {"dark", true, "plot", NULL},
    {"size", true, "plot", NULL},
    {"checkpoint-interval", true, "checkpoint,resume", NULL},
    {"resume", false, "plot",
     "--plot would not show the time before the checkpoint; 'kinetree plot' draws the finished records, and with "
     "--marks the events that --summary lists"},
    {"resume", false, "view,glb", not_with_time},
    {"resume", false, "from",
     "--resume goes on with a run that was interrupted, --from starts another one; give one of them"},
    {"resume", false, "check-error",
     "--check-error compares the whole run with a second one; leave --resume or --check-error out"},
    {"step", false, "max-step", "--step sets a fixed step and --max-step bounds adaptive ones; give one of them"},
    {"step", false, "tolerance", "--step sets a fixed step and --tolerance an adaptive one; give one of them"},
    {"modes", false,
     "from,duration,integrator,step,tolerance,max-step,rho,formulation,reduction,metric,plan,unprojected,native,check-"
     "error,"
     "interval,record,markers,summary,scene,plot,size,dark,glb,checkpoint,checkpoint-interval,resume",
     "--modes shows small motions and no run; leave out --"}, /* of `view` alone: the last four */
    {"records", false,
     "from,duration,integrator,step,tolerance,max-step,rho,formulation,reduction,metric,plan,unprojected,native,check-"
     "error,"
     "interval,record,markers,summary,scene,plot,size,dark,glb,checkpoint,checkpoint-interval,resume,live,modes",
     "--records shows a motion that has been recorded, and no run; leave out --"},
    {"marks", true, "records", NULL},
    {"live", false,
     "from,max-step,rho,formulation,reduction,metric,plan,unprojected,native,record,markers,boxes,checkpoint,"
     "checkpoint-interval,resume,modes",
     "a live page runs the scene of the file; write what it needs into the scene, and leave out --"},
};
enum { RULES = sizeof rules / sizeof rules[0] };

const kt_usage kt_usage_run = {
    .command = "run",
    .examples = "  kinetree run pendulum.yaml\n"
                "  kinetree run pendulum.yaml --duration 5 --tolerance 1e-12 --plot pendulum.svg\n"
                "  kinetree run pendulum.yaml --integrator rk4 --step 1e-3 --summary - --out /dev/null\n"
                "  kinetree run humanoid.yaml --native                   accelerations by compiled C\n"
                "  kinetree run pendulum.yaml --checkpoint p.state       and after a break: --resume p.state\n"
                "  kinetree make chain --links 100 | kinetree run - --interval 0.1 --out - | head\n",
    .operands = "SCENE",
    .about = "Simulates a scene ('-': standard input) and writes its records as CSV with 17 significant digits.\n"
             "Each option overrides the key with its name in the scene's 'simulate' or 'output'.\n"
             "Results are written to NAME.partial, which is renamed at the end.\n"
             "If a run fails and NAME does not exist yet, NAME keeps the records until the failure.\n"
             "If NAME exists, it stays unchanged, and NAME.partial keeps these records.\n",
    .options = options,
    .option_count = sizeof options / sizeof options[0] - OF_VIEW,
    .groups = groups,
    .rules = rules,
    .rule_count = RULES - OF_VIEW,
};

const kt_usage kt_usage_view = {
    .command = "view",
    .examples = "  kinetree view pendulum.yaml\n"
                "  kinetree view four-bar.yaml --duration 2 --view four-bar.html\n"
                "  kinetree make chain --links 20 | kinetree view -\n"
                "  kinetree view four-bar.yaml --live                    sliders, and the engine in the page\n"
                "  kinetree view engine-mounts.yaml --modes\n",
    .operands = "SCENE",
    .about = "Simulates a scene and writes a page that shows its motion: NAME.html.\n"
             "Any browser with WebGL 2 opens this one file without a network.\n"
             "The motion plays, and can be turned and zoomed. Curves of the recorded quantities follow below.\n"
             "\n"
             "Takes the options of 'kinetree run'. Records are written only if --out names a file of records.\n"
             "If this name ends in .html, it names the page.\n"
             "The frames are the records. If the scene gives no interval, there are 60 a second, but at least 600 and "
             "at most 6000 in all.\n"
             "The page always shows the reactions in joints and loops. 'run --view' shows them if they are recorded.\n",
    KT_OPTIONS_OF(options),
    .groups = groups,
    .rules = rules + 1,
    .rule_count = RULES - 1,
};

static const kt_run_arguments not_given = {.duration = (double)NAN,
                                           .step = (double)NAN,
                                           .max_step = (double)NAN,
                                           .rho = (double)NAN,
                                           .interval = (double)NAN,
                                           .formulation = -1,
                                           .reduction = -1,
                                           .metric = -1,
                                           .plan = -1,
                                           .checkpoint_interval = 10.0};

int kt_run_view_modes(const kt_run_arguments *arguments, const char *path) {
    if (arguments->out != NULL)
        return kt_misuse("view: --modes shows small motions and no run; leave out --out");
    char *base = kt_base_name(path), own[4096];
    if (base == NULL)
        return kt_say_no_memory(NULL);
    snprintf(own, sizeof own, "%s.html", base);
    free(base);
    const char *page = arguments->view != NULL ? arguments->view : own;
    int code = kt_check_result("view", "the scene", path, "--view", page);
    code = code < 0 ? kt_check_ending("--view", page, ".html") : code;
    if (code >= 0)
        return code;
    kt_settings settings = arguments->settings;
    settings.is_quiet = arguments->quiet;
    char replaced[400] = "";
    kt_note_replaced(page, replaced, sizeof replaced);
    code = kt_view_modes(path, page, &settings, arguments->boxes);
    if (code == KT_EXIT_DONE && !arguments->quiet)
        kt_say_written("view", page, "", replaced);
    return code;
}

/* The page is the result of 'view', so that --out may name it. */
static void take_page(const kt_usage *usage, kt_run_arguments *arguments) {
    if (usage != &kt_usage_view || arguments->view != NULL || kt_stem_length(arguments->out, ".html") <= 0)
        return;
    arguments->view = arguments->out;
    arguments->out = NULL;
}

int kt_run_arguments_read(const kt_usage *usage, int argc, char **argv, kt_run_arguments *arguments) {
    *arguments = not_given;
    arguments->command = usage->command;
    int code = kt_arguments_read(usage, argc, argv, arguments, NULL);
    if (code >= 0)
        return code;
    take_page(usage, arguments);
    if (arguments->resume != NULL && arguments->view != NULL) /* `view --out` */
        return kt_misuse("%s: %s", usage->command, not_with_time);
    int to_stdout = (arguments->out != NULL && strcmp(arguments->out, "-") == 0) +
                    (arguments->summary != NULL && strcmp(arguments->summary, "-") == 0);
    if (to_stdout > 1)
        return kt_misuse("%s: --out and --summary cannot both be standard output; give one of them a file",
                         arguments->command);
    if ((arguments->checkpoint != NULL || arguments->resume != NULL) && arguments->out != NULL &&
        strcmp(arguments->out, "-") == 0)
        return kt_misuse(
            "%s: records on standard output cannot be taken up again: --checkpoint and --resume need a file",
            arguments->command);
    return -1;
}

/* The fixed step of the scene, if there is one, would not go with a tolerance. */
int kt_run_live_settings(const kt_run_arguments *arguments, kt_live_setting texts[KT_LIVE_SETTINGS],
                         kt_settings *settings) {
    const struct {
        const char *path;
        double value;
    } numbers[] = {{"simulate.duration", arguments->duration},
                   {"simulate.step", arguments->step},
                   {"output.interval", arguments->interval}};
    int count = 0;
    for (size_t i = 0; i < sizeof numbers / sizeof numbers[0]; i++)
        if (!isnan(numbers[i].value))
            (void)snprintf(texts[count++].text, sizeof texts->text, "%s=%.17g", numbers[i].path, numbers[i].value);
    if (arguments->integrator != NULL)
        (void)snprintf(texts[count++].text, sizeof texts->text, "simulate.integrator=%s", arguments->integrator);
    if (arguments->tolerance != NULL) {
        const char *comma = strchr(arguments->tolerance, ',');
        const int first = comma != NULL ? (int)(comma - arguments->tolerance) : (int)strlen(arguments->tolerance);
        (void)snprintf(texts[count++].text, sizeof texts->text, "simulate.tolerance={relative: %.*s, absolute: %s}",
                       first, arguments->tolerance, comma != NULL ? comma + 1 : arguments->tolerance);
    }
    for (int i = 0; i < count; i++) {
        if (settings->count == KT_SETTINGS_MAX)
            return kt_misuse("view: --set and the options of the method are more than %d", KT_SETTINGS_MAX);
        settings->text[settings->count++] = texts[i].text;
    }
    return -1;
}

/* ---- lists ------------------------------------------------------------------------------------------------------- */

static int override_record(const kt_run_arguments *arguments, unsigned *record) {
    char word[256];
    const char *rest = arguments->record;
    *record = 0;
    while (kt_list_next(&rest, word, sizeof word)) {
        kt_nearest nearest = kt_nearest_make(word, NULL);
        unsigned found = 0;
#define KT_RECORD_MATCH(id, bit, name)                                                                                 \
    found |= strcmp(word, #name) == 0 ? (bit) : 0U;                                                                    \
    (void)kt_nearest_try(&nearest, #name);
        KT_RECORD_LIST(KT_RECORD_MATCH)
#undef KT_RECORD_MATCH
        if (found == 0) {
            static const char all[] = ""
#define KT_RECORD_JOIN(id, bit, name) ", " #name
                KT_RECORD_LIST(KT_RECORD_JOIN);
#undef KT_RECORD_JOIN
            return kt_misuse("%s: --record: there is no '%s' to record; there are %s%s", arguments->command, word,
                             all + 2, kt_ask(&nearest, "", "").text);
        }
        *record |= found;
    }
    return -1;
}

int kt_say_no_body(const char *option, const kt_model *model, const char *name) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (int body = 0; body < kt_model_body_count(model); body++)
        (void)kt_nearest_try(&nearest, kt_body_name(model, body));
    return kt_misuse("%s: there is no body '%s'%s", option, name, kt_ask(&nearest, "", "").text);
}

static int say_no_marker(const char *option, const kt_model *model, int body, const char *name) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (int marker = 0; marker < kt_marker_count(model, body); marker++)
        (void)kt_nearest_try(&nearest, kt_marker_name(model, body, marker));
    return kt_misuse("%s: body '%s' has no marker '%s'%s", option, kt_body_name(model, body), name,
                     kt_ask(&nearest, "", "").text);
}

/* Reports a marker without its body, and suggests all markers of this name. */
static int say_no_pair(const char *option, const kt_model *model, const char *word) {
    char pairs[400] = "";
    size_t used = 0;
    for (int body = 0; body < kt_model_body_count(model); body++)
        if (kt_marker_find(model, body, word) >= 0 && used < sizeof pairs - 100)
            used += (size_t)snprintf(pairs + used, sizeof pairs - used, "%s'%.40s.%.40s'", used > 0 ? " or " : "",
                                     kt_body_name(model, body), word);
    return kt_misuse("%s takes BODY.MARKER, not '%s'%s%s%s", option, word, used > 0 ? "; did you mean " : "", pairs,
                     used > 0 ? "?" : "");
}

/* Parses "BODY.MARKER"; *pair refers to the model's own strings. */
static int read_marker_word(const char *option, const kt_model *model, char *word, kt_marker_pair *pair) {
    char *dot = strchr(word, '.');
    if (dot == NULL)
        return say_no_pair(option, model, word);
    *dot = '\0';
    int body = kt_body_find(model, word);
    if (body < 0)
        return kt_say_no_body(option, model, word);
    int marker = kt_marker_find(model, body, dot + 1);
    if (marker < 0)
        return say_no_marker(option, model, body, dot + 1);
    pair->body = kt_body_name(model, body);
    pair->marker = kt_marker_name(model, body, marker);
    return -1;
}

int kt_run_override_markers(const char *option, const char *list, const kt_model *model, kt_run *run,
                            kt_marker_pair **run_markers) {
    char word[1024];
    size_t most = 1;
    *run_markers = NULL;
    if (list == NULL)
        return -1;
    for (const char *c = list; *c != '\0'; c++)
        most += *c == ',';
    kt_marker_pair *pairs = calloc(most, sizeof *pairs);
    int code = pairs != NULL ? -1 : kt_say_no_memory(NULL), count = 0;
    while (code < 0 && kt_list_next(&list, word, sizeof word))
        code = read_marker_word(option, model, word, &pairs[count++]);
    if (code >= 0) {
        free(pairs);
        return code;
    }
    *run_markers = pairs;
    run->markers = pairs;
    run->marker_count = count;
    return -1;
}

/* ---- the method -------------------------------------------------------------------------------------------------- */

/* Parses one tolerance, as 1e-9, or a relative and an absolute tolerance, with a comma between them. At most one
 * tolerance may be 0. */
static int override_tolerance(const kt_run_arguments *arguments, kt_run *run) {
    double tolerance[2] = {0.0, 0.0};
    const int count = kt_numbers_read(arguments->tolerance, tolerance, 2);
    const double relative = tolerance[0], absolute = count == 1 ? relative : tolerance[1];
    if (count < 1 || count > 2 || relative < 0.0 || absolute < 0.0 || relative + absolute == 0.0)
        return kt_misuse(
            "%s: --tolerance takes a number above zero, or two with a comma between, of which one may be 0, not '%s'",
            arguments->command, arguments->tolerance);
    run->step = 0.0;
    run->relative = relative;
    run->absolute = absolute;
    return -1;
}

static int override_integrator(const kt_run_arguments *arguments, kt_run *run) {
    char option[64];
    if (kt_method_find(arguments->integrator) != NULL) {
        run->integrator = arguments->integrator;
        return -1;
    }
    (void)snprintf(option, sizeof option, "%s: --integrator", arguments->command);
    return kt_reject_method(option, arguments->integrator);
}

static int check_method_options(const kt_run_arguments *arguments, const kt_run *run) {
    const kt_method *method = run->integrator != NULL ? kt_method_find(run->integrator) : NULL;
    if (!isnan(arguments->rho) && (method == NULL || !(method->rho > 0.0)))
        return kt_misuse("%s: --rho is for --integrator two-step, and this is %s", arguments->command,
                         method != NULL ? method->name : "the default one");
    if (method == NULL || method->embedded_order > 0 || run->step > 0.0)
        return -1;
    if (arguments->tolerance != NULL)
        kt_say("%s: --tolerance is for methods that choose their steps, and %s has a fixed step: leave the option out, "
               "or add --integrator dopri5",
               arguments->command, run->integrator);
    else
        kt_say("integrator '%s' has no error estimate and needs a fixed step: --step 1e-3, or 'step: 1e-3' under "
               "'simulate'",
               run->integrator);
    return arguments->integrator != NULL || arguments->tolerance != NULL ? KT_EXIT_USAGE : KT_EXIT_SCENE;
}

/* Time stepping over contacts has a fixed step, no other method and no other coordinates. */
static int check_moreau_options(const kt_run_arguments *arguments) {
    const char *option = arguments->integrator != NULL  ? "integrator"
                         : arguments->tolerance != NULL ? "tolerance"
                         : !isnan(arguments->max_step)  ? "max-step"
                         : !isnan(arguments->rho)       ? "rho"
                         : arguments->formulation >= 0  ? "formulation"
                         : arguments->unprojected       ? "unprojected"
                                                        : NULL;
    if (option == NULL)
        return -1;
    return kt_misuse("%s: --%s: the scene has 'simulate.contact: steps', which is a method of its own with a fixed "
                     "step; leave the option out, or add --set simulate.contact=events",
                     arguments->command, option);
}

/* Checks the limits of the run. The scene was checked when it was read, so that any error here comes from an option. */
static int check_limit_options(const kt_run *run) {
    kt_error error = {0};
    if (kt_run_check(run, &error) != KT_OK) {
        kt_say_error(&error);
        return KT_EXIT_USAGE;
    }
    return -1;
}

int kt_run_override(const kt_run_arguments *arguments, kt_scene *scene) {
    kt_run *run = &scene->run;
    int code = scene->contact == KT_CONTACT_STEPS ? check_moreau_options(arguments) : -1;
    if (code >= 0)
        return code;
    if (!isnan(arguments->duration))
        run->duration = arguments->duration;
    if (!isnan(arguments->step))
        run->step = arguments->step;
    if (!isnan(arguments->max_step))
        run->max_step = arguments->max_step;
    if (!isnan(arguments->rho))
        run->rho = arguments->rho;
    if (!isnan(arguments->interval))
        run->interval = arguments->interval;
    if (arguments->formulation >= 0)
        scene->formulation = (kt_formulation)arguments->formulation;
    if (arguments->reduction >= 0)
        scene->reduction = (kt_reduction)arguments->reduction;
    if (arguments->metric >= 0)
        run->metric = (kt_metric)arguments->metric;
    if (arguments->plan >= 0)
        run->plan = (kt_plan)arguments->plan;
    if (arguments->integrator != NULL)
        code = override_integrator(arguments, run);
    if (code < 0 && arguments->tolerance != NULL)
        code = override_tolerance(arguments, run);
    if (code < 0 && arguments->record != NULL)
        code = override_record(arguments, &run->record);
    if (code < 0)
        code = check_method_options(arguments, run);
    return code >= 0 ? code : check_limit_options(run);
}
