/* The command line of `kinetree accuracy`. */
#include "accuracy.h"
#include "arguments.h"
#include "table.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

#define KT_AT(member) offsetof(kt_accuracy_arguments, member)

static const kt_option options[] = {
    {"integrators", KT_OPTION_TEXT, KT_AT(integrator_list), "A,B", "these methods only; default: all", NULL},
    {"steps", KT_OPTION_TEXT, KT_AT(step_list), "H,...", "steps of methods without error estimate, s; default: found",
     NULL},
    {"tolerances", KT_OPTION_TEXT, KT_AT(tolerance_list), "T,...", "tolerances of adaptive methods; default: found",
     NULL},
    {"duration", KT_OPTION_POSITIVE, KT_AT(duration), "S", "how long to simulate, seconds", NULL},
    {"goal", KT_OPTION_TEXT, KT_AT(goal_list), "E,...", "errors to find settings for; default: 1e-3,1e-6,1e-9", NULL},
    {"reference", KT_OPTION_TEXT, KT_AT(reference), "FILE", "records of a run that is right; default: computed", NULL},
    {"budget", KT_OPTION_POSITIVE, KT_AT(budget), "S",
     "CPU time for the study, seconds; default: 20; 60 with --compare-sets", NULL},
    {"prices", KT_OPTION_FLAG, KT_AT(prices), NULL,
     "what projection, formulation, reduction and records cost; default: where that is cheap", NULL},
    {"compare-sets", KT_OPTION_FLAG, KT_AT(compare_sets), NULL,
     "ways to keep loops closed, and what each gets wrong; by rk4 and dopri5", NULL},
    {"out", KT_OPTION_TEXT, KT_AT(out), "FILE",
     "every run as a line of CSV; '-': standard output; default: NAME-accuracy.csv, here; /dev/null: none", NULL},
    {"plot", KT_OPTION_TEXT, KT_AT(plot), "FILE",
     "the work-precision diagram: FILE.svg or FILE.png; default: NAME-accuracy.svg, here; /dev/null: none", NULL},
    {"plot-dark", KT_OPTION_TEXT, KT_AT(plot_dark), "FILE", "the same on a dark page, besides or instead", NULL},
    {"dark", KT_OPTION_FLAG, KT_AT(dark), NULL, "the picture on a dark page", NULL},
    {"quiet", KT_OPTION_FLAG, KT_AT(quiet), NULL, "no progress bar and no tables, but for errors", NULL},
};

const kt_usage kt_usage_accuracy = {
    .command = "accuracy",
    .examples = "  kinetree accuracy pendulum.yaml\n"
                "  kinetree accuracy pendulum.yaml --goal 1e-6 --plot pendulum-cost.svg --out pendulum-cost.csv\n"
                "  kinetree accuracy robot.yaml --integrators rk4,dopri5 --duration 2 --budget 60\n"
                "  kinetree accuracy robot.yaml --integrators rk4 --steps 1e-3,5e-4 --reference exact.csv\n"
                "  kinetree accuracy linkage.yaml --compare-sets --plot linkage-sets.svg\n",
    .operands = "SCENE",
    .least = 1,
    .most = 1,
    .about =
        "What accuracy costs: runs a scene with every method at many steps or tolerances, measures the error against\n"
        "a reference that is itself checked, and the CPU time, and says which setting is the cheapest for a goal.\n"
        "An error is the largest over all joints and records: angles on the circle, quaternions by the rotation\n"
        "between them, in rad; lengths over the scene's length scale (in metres where there are no angles).\n"
        "Where the scene is chaotic the study ends when errors have grown a million times, and says so.\n"
        "--compare-sets: the reduction with and without projection, the absolute formulation, Baumgarte's\n"
        "stabilisation (gains of 0.1 and 0.4 over the step), the augmented Lagrangian, force projection.\n",
    .options = options,
    .option_count = sizeof options / sizeof options[0],
};

static int say_no_method(const char *name) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (int i = 0; i < kt_method_count(); i++)
        (void)kt_nearest_try(&nearest, kt_method_at(i)->name);
    if (nearest.best != NULL)
        kt_say("accuracy: --integrators: there is no method '%s'%s", name, kt_ask(&nearest, "").text);
    else
        kt_say("accuracy: --integrators: there is no method '%s'; 'kinetree integrators' lists them", name);
    return KT_EXIT_USAGE;
}

/* In the order of the family, each once. */
static int read_methods(kt_accuracy_arguments *arguments) {
    char text[512];
    char *rest = text;
    bool wanted[KT_ACCURACY_METHODS_MAX] = {false};
    if ((size_t)snprintf(text, sizeof text, "%s", arguments->integrator_list) >= sizeof text) {
        kt_say("accuracy: --integrators: the list is too long");
        return KT_EXIT_USAGE;
    }
    for (char *word = kt_next_word(&rest); word != NULL; word = kt_next_word(&rest)) {
        const kt_method *method = kt_method_find(word);
        if (method == NULL)
            return say_no_method(word);
        for (int i = 0; i < kt_method_count() && i < KT_ACCURACY_METHODS_MAX; i++)
            wanted[i] = wanted[i] || kt_method_at(i) == method;
    }
    for (int i = 0; i < kt_method_count() && i < KT_ACCURACY_METHODS_MAX; i++)
        if (wanted[i])
            arguments->methods[arguments->method_count++] = kt_method_at(i);
    if (arguments->method_count > 0)
        return -1;
    kt_say("accuracy: --integrators: the list is empty");
    return KT_EXIT_USAGE;
}

static int read_lists(kt_accuracy_arguments *a) {
    int code = a->integrator_list != NULL ? read_methods(a) : -1;
    if (code >= 0)
        return code;
    if (a->integrator_list == NULL && a->compare_sets)
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

int kt_accuracy_arguments_read(int argc, char **argv, kt_accuracy_arguments *arguments) {
    int operands;
    *arguments = (kt_accuracy_arguments){.duration = (double)NAN, .budget = (double)NAN};
    int code = kt_arguments_read(&kt_usage_accuracy, argc, argv, arguments, &operands);
    if (isnan(arguments->budget)) /* so many curves need more */
        arguments->budget = arguments->compare_sets ? 60.0 : 20.0;
    return code >= 0 ? code : read_lists(arguments);
}
