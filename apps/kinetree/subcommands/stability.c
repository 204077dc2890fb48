/* kinetree stability: finds the fastest modes of a scene, and the largest stable step of each method. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/stability.h"

#include "advice/penetration.h"
#include "open/linear.h"
#include "open/start.h"
#include "plot/plot.h"
#include "records/output.h"
#include "text/arguments.h"
#include "text/json.h"

#include <math.h>
#include <stdbool.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- the command line -------------------------------------------------------------------------------------------- */

typedef struct arguments {
    kt_settings settings;
    double step, duration;
    long samples;
    const char *integrator, *plot;
    bool json, dark;
    const char *base; /* of the name of the scene */
} arguments;

#define KT_AT(member) offsetof(arguments, member)

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_OPTION(POSITIVE, "step", step, "S", "check this step, seconds"),
    KT_OPTION(TEXT, "integrator", integrator, "NAME", "draw this method; default: the scene's"),
    KT_OPTION(POSITIVE, "duration", duration, "S", "follow the motion for S seconds; default: the scene's"),
    KT_OPTION(SEVERAL, "samples", samples, "N",
              "linearise at N states along the motion; default: 9, 1 for large scenes"),
    KT_OPTION(TEXT, "plot", plot, "FILE",
              "draw the modes times the step in the method's region of stability, .svg, .png or .pdf"),
    KT_FLAG("dark", dark, "draw the picture on a dark page"),
    KT_FLAG("json", json, "print all modes and steps as JSON"),
    KT_READER_OPTIONS,
};

static const kt_option_rule rules[] = {{"dark", true, "plot", NULL}};

const kt_usage kt_usage_stability = {
    .command = "stability",
    .examples = "  kinetree stability robot.yaml\n"
                "  kinetree stability robot.yaml --step 1e-3\n"
                "  kinetree stability robot.yaml --integrator rk4 --step 1e-3 --plot region.svg\n",
    .operands = "SCENE",
    .about =
        "Linearises the scene at states along its motion and prints its fastest modes.\n"
        "Hard contacts that are closed in a state are constraints of its modes.\n"
        "For each mode it prints how fast the mode decays or oscillates, and which joints move.\n"
        "Then it prints the largest stable fixed step of each method.\n"
        "A step is stable if no mode is amplified, over the duration, to more than twice its exact value.\n"
        "Some methods are not stable on the imaginary axis: euler, heun, midpoint and ralston.\n"
        "These methods slowly amplify undamped oscillations at any step, and their limits depend on the duration.\n"
        "\n"
        "Each implicit method has a verdict.\n"
        "The method is A-stable if no mode that decays or oscillates grows, for any step.\n"
        "The method is L-stable if an infinitely stiff mode also vanishes after one step. Otherwise, the factor of its "
        "decay is given.\n",
    KT_OPTIONS_OF(options),
    KT_RULES_OF(rules),
};

/* ---- messages ---------------------------------------------------------------------------------------------------- */

enum { LISTED_MAX = 8 };

/* Returns whether a real or imaginary part counts as nonzero. It does if it exceeds the error of the eigenvalue and a
 * millionth of its magnitude. */
static bool is_part(double part, const kt_mode *mode) {
    return fabs(part) > mode->error && fabs(part) > 1e-6 * kt_mode_modulus(mode);
}

static void print_scaled_mode(const kt_model *model, const kt_spectrum_mode *at, FILE *file) {
    char movers[128], rate[24] = "-", frequency[24] = "-", damping[24] = "-";
    if (is_part(at->mode.real, &at->mode))
        snprintf(rate, sizeof rate, "%.5g", at->mode.real);
    if (is_part(at->mode.imaginary, &at->mode))
        snprintf(frequency, sizeof frequency, "%.5g", at->mode.frequency);
    kt_write_movers(model, at->moves, movers, sizeof movers);
    if (rate[0] != '-' || rate[1] != '\0' || frequency[0] != '-')
        snprintf(damping, sizeof damping, "%.3g", is_part(at->mode.real, &at->mode) ? at->mode.damping : 0.0);
    fprintf(file, "  %12s  %13s  %9s  %s\n", rate, frequency, damping, movers);
}

/* Prints the modes at the time of the fastest one, and how the fastest rate varies along the motion. */
static void print_modes(const kt_stability_subject *subject) {
    const int fastest = kt_spectrum_fastest(subject->spectrum), count = kt_spectrum_count(subject->spectrum);
    if (fastest < 0) {
        puts("nothing moves: any step is stable");
        return;
    }
    const double time = kt_spectrum_at(subject->spectrum, fastest).t;
    double least = HUGE_VAL, least_time = 0.0;
    int listed = 0, left_out = 0;
    printf("fastest modes, at t = %g s\n  %12s  %13s  %9s  %s\n", time, "rate, 1/s", "frequency, Hz", "damping",
           "joints that move");
    for (int i = 0; i < count; i++) {
        const kt_spectrum_mode at = kt_spectrum_at(subject->spectrum, i);
        if (i == 0 || at.t != kt_spectrum_at(subject->spectrum, i - 1).t) /* the fastest mode of its state */
            if (kt_mode_modulus(&at.mode) < least) {
                least = kt_mode_modulus(&at.mode);
                least_time = at.t;
            }
        if (at.t == time && listed < LISTED_MAX && at.moves != NULL) {
            print_scaled_mode(subject->model, &at, stdout);
            listed++;
        } else if (at.t == time) {
            left_out++;
        }
    }
    if (left_out > 0)
        printf("  and %d slower\n", left_out);
    const kt_spectrum_mode first = kt_spectrum_at(subject->spectrum, fastest);
    if (least < 0.99 * kt_mode_modulus(&first.mode))
        printf("the fastest along the motion: from %.4g /s (at t = %g s) to %.4g /s\n", least, least_time,
               kt_mode_modulus(&first.mode));
}

/* Describes how the step changes the mode that it amplifies most. */
static void write_verdict(double growth, char *text, size_t size) {
    if (growth <= 1.0 + 1e-3)
        snprintf(text, size, "stable");
    else if (growth <= KT_STABILITY_GROWTH)
        snprintf(text, size, "gains %.2g %% over the run", 100.0 * (growth - 1.0));
    else if (growth < 1e6)
        snprintf(text, size, "unstable: %.3g-fold", growth);
    else
        snprintf(text, size, "unstable: diverges");
}

/* Returns the method at an index. The method to draw has the scene's rho. */
static const kt_method *drawn_method_at(const kt_stability_subject *subject, int index) {
    const kt_method *method = kt_method_at(index);
    return subject->method != NULL && strcmp(method->name, subject->method->name) == 0 ? subject->method : method;
}

static void print_limit(const kt_stability_subject *subject, const kt_method *method) {
    const kt_step_limit limit = kt_spectrum_limit(subject->spectrum, method, subject->duration, subject->step);
    char step[24] = "any", bound[144], verdict[48] = "";
    kt_write_verdict(method, bound, sizeof bound);
    if (limit.step <= subject->duration)
        snprintf(step, sizeof step, "%.4g", limit.step);
    if (limit.mode >= 0 && limit.step <= subject->duration) {
        const kt_spectrum_mode at = kt_spectrum_at(subject->spectrum, limit.mode);
        char mode[64];
        kt_write_mode(&at.mode, mode, sizeof mode);
        snprintf(bound, sizeof bound, "%s, t = %g s%s", mode, at.t,
                 strcmp(kt_method_family_name(method), "switching") == 0
                     ? "; adaptive ones are not bounded: radau5 takes them"
                     : "");
    }
    if (subject->step > 0.0)
        write_verdict(limit.growth, verdict, sizeof verdict);
    if (subject->step > 0.0)
        printf("  %-14s  %10s  %-26s  %s\n", method->name, step, verdict, bound);
    else
        printf("  %-14s  %10s  %s\n", method->name, step, bound);
}

static void print_limits(const kt_stability_subject *subject) {
    char asked[32] = "";
    printf("\nlargest stable step over %g s\n", subject->duration);
    if (subject->step > 0.0) {
        snprintf(asked, sizeof asked, "at %g s", subject->step);
        printf("  %-14s  %10s  %-26s  %s\n", "method", "step, s", asked, "bounded by; implicit: verdict");
    } else {
        printf("  %-14s  %10s  %s\n", "method", "step, s", "bounded by; implicit: verdict");
    }
    for (int i = 0; i < kt_method_count(); i++)
        print_limit(subject, drawn_method_at(subject, i));
}

/* ---- JSON -------------------------------------------------------------------------------------------------------- */

static json_t *describe_movers(const kt_model *model, const double *moves) {
    json_t *object = json_object();
    for (int body = 1; moves != NULL && body < kt_model_body_count(model); body++) {
        const kt_coordinates at = kt_body_coordinates(model, body);
        double most = 0.0;
        for (int i = 0; i < at.nv; i++)
            most = fmax(most, moves[at.v + i]);
        if (most >= 1e-3)
            json_object_set_new(object, kt_joint_name(model, body), kt_json_number(most));
    }
    return object;
}

static json_t *describe_mode(const kt_model *model, const kt_spectrum_mode *at) {
    json_t *mode = json_pack("{s:f, s:f, s:f, s:f, s:f}", "real", at->mode.real, "imaginary", at->mode.imaginary,
                             "frequency", at->mode.frequency, "damping", at->mode.damping, "error", at->mode.error);
    if (at->moves != NULL)
        json_object_set_new(mode, "moves", describe_movers(model, at->moves));
    return mode;
}

static json_t *describe_states(const kt_stability_subject *subject) {
    json_t *states = json_array(), *modes = NULL;
    for (int i = 0; i < kt_spectrum_count(subject->spectrum); i++) {
        const kt_spectrum_mode at = kt_spectrum_at(subject->spectrum, i);
        if (i == 0 || at.t != kt_spectrum_at(subject->spectrum, i - 1).t) {
            json_t *state = json_object();
            modes = json_array();
            json_object_set_new(state, "time", json_real(at.t));
            json_object_set_new(state, "modes", modes);
            json_array_append_new(states, state);
        }
        json_array_append_new(modes, describe_mode(subject->model, &at));
    }
    return states;
}

static json_t *describe_limit(const kt_stability_subject *subject, const kt_method *method) {
    const kt_step_limit limit = kt_spectrum_limit(subject->spectrum, method, subject->duration, subject->step);
    json_t *object = json_object();
    json_object_set_new(object, "integrator", json_string(method->name));
    json_object_set_new(object, "step", kt_json_number(limit.step));
    if (subject->step > 0.0)
        json_object_set_new(object, "growth", kt_json_number(limit.growth));
    kt_stability stability;
    if (kt_method_is_implicit(method) && kt_stability_make(method, 0, &stability, NULL) == KT_OK) {
        const kt_stability_verdict verdict = kt_stability_assess(&stability);
        json_object_set_new(object, "a_stable", json_boolean(verdict.a_stable));
        json_object_set_new(object, "l_stable", json_boolean(verdict.l_stable));
        json_object_set_new(object, "at_infinity", kt_json_number(verdict.at_infinity));
    }
    if (limit.mode >= 0) {
        const kt_spectrum_mode at = kt_spectrum_at(subject->spectrum, limit.mode);
        json_object_set_new(
            object, "bounded_by",
            json_pack("{s:f, s:f, s:f}", "time", at.t, "real", at.mode.real, "imaginary", at.mode.imaginary));
    }
    return object;
}

static int write_json(const kt_stability_subject *subject, json_t *inactive) {
    json_t *root = json_object(), *methods = json_array();
    json_object_set_new(root, "scene", kt_json_text(subject->name));
    json_object_set_new(root, "duration", json_real(subject->duration));
    if (subject->step > 0.0)
        json_object_set_new(root, "step", json_real(subject->step));
    json_object_set_new(root, "states", describe_states(subject));
    for (int i = 0; i < kt_method_count(); i++)
        json_array_append_new(methods, describe_limit(subject, drawn_method_at(subject, i)));
    json_object_set_new(root, "methods", methods);
    json_object_set(root, "inactive", inactive);
    return kt_json_write(root, "-");
}

/* ---- inactive contacts and limits -------------------------------------------------------------------------------- */

/* Returns whether a contact or joint limit acts in one of the states. A hard one, which is closed there, touches. */
static bool acts(const kt_stability_subject *subject, kt_data *data, int effect) {
    const double touching = isinf(subject->scene->description.effects[effect].restitution) ? 0.0 : 1e-9;
    for (int i = 0; i < kt_spectrum_samples(subject->spectrum); i++) {
        const double *q = kt_spectrum_positions(subject->spectrum, i);
        if (kt_kinematics_update(subject->model, data, q, NULL, NULL, NULL) == KT_OK &&
            kt_penetration_of(subject->model, data, &subject->scene->description, effect, q).depth > -touching)
            return true;
    }
    return false;
}

/* Lists the names of the contacts and joint limits that act in none of the states; a new reference. */
static json_t *list_inactive(const kt_stability_subject *subject) {
    const kt_description *d = &subject->scene->description;
    json_t *list = json_array();
    kt_data *data = NULL;
    if (kt_data_create(subject->model, &data, NULL) != KT_OK)
        return list;
    for (int i = 0; i < d->effect_count; i++)
        if (kt_effect_can_penetrate(&d->effects[i]) && !acts(subject, data, i))
            json_array_append_new(list, json_string(kt_name_penetration(&d->effects[i]).text));
    kt_data_free(data);
    return list;
}

static void say_inactive(const kt_stability_subject *subject, const json_t *list) {
    enum { NAMED = 4 };
    const size_t count = json_array_size(list);
    const int samples = kt_spectrum_samples(subject->spectrum);
    char names[1024] = "";
    size_t used = 0;
    for (size_t i = 0; i < count && i < NAMED; i++)
        used += (size_t)snprintf(names + used, sizeof names - used, "%s%s", i ? ", " : "",
                                 json_string_value(json_array_get(list, i)));
    if (count > NAMED)
        snprintf(names + used, sizeof names - used, " and %zu more", count - NAMED);
    if (count > 0)
        kt_say("stability: %s act%s in none of the %d linearised state%s: these numbers omit %s effect on the largest "
               "step; give more --samples, or a --duration in which %s",
               names, count == 1 ? "s" : "", samples, samples == 1 ? "" : "s", count == 1 ? "its" : "their",
               count == 1 ? "it acts" : "they act");
}

/* ---- parts of the command ---------------------------------------------------------------------------------------- */

enum { LARGE = 100 }; /* velocity coordinates; above this number one state is examined unless more are requested */

/* Finds the method to draw: the one requested, or the scene's own, with the scene's rho. Returns -1 on success, else an
 * exit code. */
static int choose_method(const char *name, const kt_run *run, const kt_model *model, kt_method *storage,
                         const kt_method **method) {
    kt_run wanted_run = *run;
    const char *wanted = name != NULL ? name : run->integrator;
    wanted_run.integrator = wanted;
    *method = kt_run_method(&wanted_run, model, storage);
    if (*method != NULL)
        return -1;
    return kt_reject_method("stability", wanted);
}

static int show_subject(const kt_stability_subject *subject, const arguments *given) {
    json_t *inactive = list_inactive(subject);
    say_inactive(subject, inactive);
    const int written = given->json ? write_json(subject, inactive) : KT_EXIT_DONE;
    json_decref(inactive);
    if (written != KT_EXIT_DONE)
        return written;
    if (!given->json) {
        const int samples = kt_spectrum_samples(subject->spectrum);
        printf("%s: %d state%s in %g s\n\n", kt_show(subject->name).text, samples, samples == 1 ? "" : "s",
               subject->duration);
        if (kt_model_mobility(subject->model).minimal == 0 && kt_spectrum_fastest(subject->spectrum) < 0) {
            puts("there are no degrees of freedom: loops alone determine the motion, and any step is stable");
        } else {
            print_modes(subject);
            print_limits(subject);
        }
    }
    return given->plot != NULL ? kt_stability_draw(subject, given->plot, given->dark) : KT_EXIT_DONE;
}

enum { SAMPLES_MOST = 10000 };

static int analyse(const kt_scene *scene, const kt_model *model, const arguments *given) {
    kt_run run = scene->run;
    kt_stability_subject subject = {.scene = scene, .model = model, .step = given->step > 0.0 ? given->step : 0.0};
    int code = choose_method(given->integrator, &run, model, &subject.by_rho, &subject.method);
    if (code >= 0 || (given->plot != NULL && (code = kt_plot_check(given->plot)) >= 0))
        return code;
    if (given->duration > 0.0)
        run.duration = given->duration;
    if (!(run.duration > 0.0))
        return kt_misuse("stability: the scene has no duration; give one: --duration 10");
    if (given->samples > SAMPLES_MOST)
        return kt_misuse("stability: --samples must be 1 to %d", SAMPLES_MOST);
    subject.duration = run.duration;
    subject.name = kt_title_of(model, given->base);
    const long samples = given->samples > 0 ? given->samples : kt_model_nv(model) > LARGE ? 1 : KT_SPECTRUM_SAMPLES;
    kt_error error = {0};
    kt_spectrum *spectrum = NULL;
    kt_status status = kt_spectrum_create(model, (int)samples, &spectrum, &error);
    if (status == KT_OK)
        status = kt_spectrum_along(spectrum, &run, &error);
    if (status != KT_OK)
        kt_say_error(&error);
    if (spectrum != NULL && kt_spectrum_samples(spectrum) > 0) {
        if (status != KT_OK)
            kt_say("stability: the motion could not be followed further; the results cover the motion up to there");
        subject.spectrum = spectrum;
        code = show_subject(&subject, given);
    } else if (status == KT_OK) {
        code = kt_reject(KT_EXIT_ASSEMBLY, "stability: nothing can be linearised wherever one looks: loops are at a "
                                           "singular position, or a hard contact begins to slip; try other --samples");
    }
    kt_spectrum_free(spectrum);
    return status == KT_OK ? code : kt_exit_code(status);
}

static int start_and_analyse(const kt_scene *scene, const kt_model *model, const void *user) {
    kt_say_left_out("stability", scene);
    int code = kt_reject_dense_size(model);
    code = code < 0 ? kt_start_report(scene, model) : code;
    return code == KT_EXIT_DONE ? analyse(scene, model, user) : code;
}

int kt_command_stability(int argc, char **argv) {
    arguments given = {0};
    int code = kt_arguments_read(&kt_usage_stability, argc, argv, &given, NULL);
    code = code < 0 ? kt_check_result("stability", "the scene", argv[1], "--plot", given.plot) : code;
    if (code >= 0)
        return code;
    char *base = kt_base_name(argv[1]);
    given.base = base != NULL ? base : "scene";
    code = kt_use_model(argv[1], &given.settings, start_and_analyse, &given);
    free(base);
    return kt_finish_output(code);
}
