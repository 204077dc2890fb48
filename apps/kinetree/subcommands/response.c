/* kinetree response: computes the frequency response of small motions to a force in a joint.
 *
 * The frequencies are spaced evenly in their logarithm. A lightly damped resonance is narrower than this spacing.
 * Therefore frequencies around each damped mode are added: its frequency f, and f (1 + k zeta) for a damping ratio
 * zeta.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"
#include "plot/plot.h"
#include "records/output.h"
#include "subcommands/modes.h"
#include "text/arguments.h"
#include "text/json.h"
#include "text/list.h"

#include "kinetree/descriptor.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { OUTPUTS_MOST = KT_PLOT_SERIES_MAX, POINTS_MOST = 100000, AROUND = 8, NAME_SIZE = 640 };

static const double two_pi = 6.28318530717958647693;

typedef struct kt_response_arguments {
    kt_settings settings;
    const char *input, *output, *plot, *out;
    double from, to;
    long points;
    int at;
    bool nearest, json, dark;
} kt_response_arguments;

#define KT_AT(member) offsetof(kt_response_arguments, member)

static const kt_option options[] = {
    KT_SET_OPTION,
    KT_OPTION(TEXT, "input", input, "JOINT",
              "let a force or torque act in this joint; default: in that of the scene's only motor"),
    KT_OPTION(NAMES, "output", output, "NAME,NAME",
              "compute these outputs: position.JOINT, velocity.JOINT, marker.BODY.MARKER.x; default: the position of "
              "the input"),
    KT_OPTION(POSITIVE, "from", from, "HZ",
              "take this as the lowest frequency; default: a tenth of the slowest mode's"),
    KT_OPTION(POSITIVE, "to", to, "HZ", "take this as the highest frequency; default: ten times the fastest mode's"),
    KT_OPTION(SEVERAL, "points", points, "N", "compute N frequencies, and some around each mode; default: 400"),
    KT_CHOICE("at", at, "STATE", "linearise about this state; default: rest, or the initial state if it moves",
              "initial|equilibrium"),
    KT_FLAG("nearest", nearest, "linearise about the equilibrium nearest to the initial position, stable or not"),
    KT_OPTION(TEXT, "out", out, "FILE.csv", "write a table of frequencies, amplitudes and phases"),
    KT_OPTION(TEXT, "plot", plot, "FILE", "draw a Bode diagram, .svg, .png or .pdf"),
    KT_FLAG("dark", dark, "draw the picture on a dark page"),
    KT_FLAG("json", json, "print the whole table as JSON"),
    KT_READER_OPTIONS,
};

static const kt_option_rule rules[] = {{"dark", true, "plot", NULL}};

const kt_usage kt_usage_response = {
    .command = "response",
    .examples = "  kinetree response dc-motor.yaml --input rotor --plot bode.svg\n"
                "  kinetree response quarter-car.yaml --input wheel --output position.car,position.wheel\n"
                "  kinetree response cart-pole.yaml --input cart --at initial --out b.csv\n",
    .operands = "SCENE",
    .about = "Linearises a scene and computes the response to a harmonic force in a joint.\n"
             "The amplitude is that of the output for a force of 1 N or a torque of 1 N m. The phase is in degrees; a "
             "negative one lags.\n"
             "The table lists the ends of the range, and the frequencies of largest and smallest amplitude between "
             "them.\n"
             "A linear response describes small motions about the state only.\n",
    KT_OPTIONS_OF(options),
    KT_RULES_OF(rules),
};

/* An output: the row y = row x of the states x. */
typedef struct kt_response_output {
    char name[NAME_SIZE];
    const char *unit;
    double *row;               /* states */
    double *amplitude, *phase; /* of each frequency; rad */
} kt_response_output;

typedef struct kt_response {
    kt_small_motion motion;
    const kt_linear_system *system;
    const char *state;
    int input; /* velocity coordinate */
    kt_response_output output[OUTPUTS_MOST];
    int output_count;
    double *frequency; /* Hz, ascending */
    size_t count;
} kt_response;

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* The velocity coordinate of a name as in columns, such as "crank" or "ball[2]"; -1 if there is none. */
static int find_coordinate(const kt_response *r, const char *name, kt_nearest *nearest) {
    for (int i = 0; i < r->system->coordinates; i++) {
        if (strcmp(kt_name_column(r->motion.model, i).text, name) == 0)
            return i;
        (void)kt_nearest_try(nearest, kt_joint_name(r->motion.model, kt_velocity_body(r->motion.model, i)));
    }
    return -1;
}

static int find_input(kt_response *r, const char *name) {
    kt_nearest nearest = kt_nearest_make(name != NULL ? name : "", NULL);
    int *motors = calloc((size_t)kt_motor_coordinates(r->motion.model, NULL) + 1, sizeof *motors);
    const int count = motors != NULL ? kt_motor_coordinates(r->motion.model, motors) : 0;
    r->input = name != NULL ? find_coordinate(r, name, &nearest) : count == 1 ? motors[0] : -1;
    free(motors);
    if (r->input >= 0)
        return KT_EXIT_DONE;
    if (name == NULL)
        return kt_misuse("response: the scene has %d motors, so the force has no default joint; name it with --input",
                         count);
    return kt_misuse("response: --input: there is no joint '%s'%s", kt_show(name).text,
                     kt_ask(&nearest, "", "; 'kinetree info' lists the joints").text);
}

/* The row of a marker's coordinate among the outputs of the system; -1 if there is none. */
static int find_marker_output(const kt_response *r, const char *name) {
    static const char *const parts[] = {"x", "y", "z", "vx", "vy", "vz"};
    const kt_model *model = r->motion.model;
    char text[NAME_SIZE];
    int row = 0;
    for (int body = 0; body < kt_model_body_count(model); body++)
        for (int marker = 0; marker < kt_marker_count(model, body); marker++)
            for (int k = 0; k < 6; k++, row++) {
                (void)snprintf(text, sizeof text, "marker.%s.%s.%s", kt_body_name(model, body),
                               kt_marker_name(model, body, marker), parts[k]);
                if (strcmp(text, name) == 0)
                    return row;
            }
    return -1;
}

/* Copies row `index` of a matrix of `rows` rows, column-major. */
static void copy_row(const kt_response *r, const double *matrix, int rows, int index, double *row) {
    for (int j = 0; j < r->system->states; j++)
        row[j] = matrix[(size_t)j * (size_t)rows + (size_t)index];
}

static bool slides(const kt_response *r, int coordinate) {
    const int body = kt_velocity_body(r->motion.model, coordinate);
    const kt_coordinates at = kt_body_coordinates(r->motion.model, body);
    const kt_coordinate_kind kind = kt_joint_coordinate_kind(at.type, coordinate - at.v);
    return kind == KT_COORDINATE_LENGTH || kind == KT_COORDINATE_TRANSLATION;
}

static int add_output(kt_response *r, const char *name) {
    static const char position[] = "position.", velocity[] = "velocity.";
    const kt_linear_system *s = r->system;
    kt_response_output *out = &r->output[r->output_count];
    const bool is_position = strncmp(name, position, sizeof position - 1) == 0,
               is_velocity = strncmp(name, velocity, sizeof velocity - 1) == 0;
    const char *joint = name + sizeof position - 1;
    kt_nearest nearest = kt_nearest_make(is_position || is_velocity ? joint : name, NULL);
    const int coordinate = is_position || is_velocity ? find_coordinate(r, joint, &nearest) : -1;
    const int marker = find_marker_output(r, name);
    out->row = calloc((size_t)s->states + 1, sizeof *out->row);
    if (out->row == NULL)
        return kt_say_no_memory("the response");
    r->output_count++;
    (void)snprintf(out->name, sizeof out->name, "%s", name);
    if (coordinate >= 0) {
        copy_row(r, is_position ? s->positions_of : s->velocities_of, s->coordinates, coordinate, out->row);
        out->unit = slides(r, coordinate) ? (is_position ? "m" : "m/s") : (is_position ? "rad" : "rad/s");
        return KT_EXIT_DONE;
    }
    if (marker >= 0) {
        copy_row(r, s->output, s->outputs, marker, out->row);
        out->unit = marker % 6 < 3 ? "m" : "m/s";
        return KT_EXIT_DONE;
    }
    return kt_misuse("response: --output: there is no '%s'%s; an output is position.JOINT, velocity.JOINT or "
                     "marker.BODY.MARKER.x",
                     kt_show(name).text, kt_ask(&nearest, "", "").text);
}

static int find_outputs(kt_response *r, const char *names) {
    char name[NAME_SIZE];
    int code = KT_EXIT_DONE;
    if (names == NULL) {
        (void)snprintf(name, sizeof name, "position.%s", kt_name_column(r->motion.model, r->input).text);
        return add_output(r, name);
    }
    while (code == KT_EXIT_DONE && kt_list_next(&names, name, sizeof name)) {
        if (r->output_count == OUTPUTS_MOST)
            return kt_misuse("response: --output takes at most %d names", (int)OUTPUTS_MOST);
        code = add_output(r, name);
    }
    return code;
}

/* ---- frequencies ------------------------------------------------------------------------------------------------- */

static int compare_numbers(const void *left, const void *right) {
    const double a = *(const double *)left, b = *(const double *)right;
    return a < b ? -1 : a > b;
}

/* The frequencies of the slowest and of the fastest mode that is not neutral, Hz; false if there are none. */
static bool find_range(const kt_small_motion *motion, double *slowest, double *fastest) {
    *slowest = (double)INFINITY;
    *fastest = 0.0;
    for (int i = 0; i < kt_modes_count(motion->modes); i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        if (kt_mode_is_neutral(&mode))
            continue;
        *slowest = fmin(*slowest, kt_mode_modulus(&mode) / two_pi);
        *fastest = fmax(*fastest, kt_mode_modulus(&mode) / two_pi);
    }
    return *fastest > 0.0;
}

/* Adds frequencies around a damped mode. */
static void add_around(kt_response *r, const kt_mode *mode, double from, double to) {
    const double f = mode->frequency, width = -mode->real / two_pi;
    for (int k = -AROUND; k <= AROUND && f > 0.0 && width > mode->error / two_pi; k++) {
        const double near = f + 0.5 * k * width;
        if (near > from && near < to)
            r->frequency[r->count++] = near;
    }
}

static int choose_frequencies(kt_response *r, const kt_response_arguments *a) {
    double slowest, fastest;
    const bool has_modes = find_range(&r->motion, &slowest, &fastest);
    const double from = isnan(a->from) ? 0.1 * slowest : a->from, to = isnan(a->to) ? 10.0 * fastest : a->to;
    const size_t points = (size_t)a->points, modes = (size_t)kt_modes_count(r->motion.modes);
    if (!has_modes && (isnan(a->from) || isnan(a->to)))
        return kt_misuse("response: no mode gives the range of frequencies; give --from and --to");
    if (!(from < to) || a->points < 2 || a->points > POINTS_MOST)
        return kt_misuse(
            "response: from %g Hz to %g Hz with %ld points; --to must be above --from, with 2 to %d points", from, to,
            a->points, (int)POINTS_MOST);
    r->frequency = calloc(points + modes * (2 * AROUND + 1), sizeof *r->frequency);
    if (r->frequency == NULL)
        return kt_say_no_memory("the response");
    for (size_t i = 0; i < points; i++)
        r->frequency[r->count++] = i + 1 == points ? to : from * pow(to / from, (double)i / (double)(points - 1));
    for (size_t i = 0; i < modes; i++) {
        const kt_mode mode = kt_modes_at(r->motion.modes, (int)i);
        add_around(r, &mode, from, to);
    }
    qsort(r->frequency, r->count, sizeof *r->frequency, compare_numbers);
    return KT_EXIT_DONE;
}

/* ---- the response ------------------------------------------------------------------------------------------------ */

/* Phases are continued from one frequency to the next, since those beyond half a turn are common. */
static void set_output(kt_response_output *out, size_t k, const double *states, int count) {
    double re = 0.0, im = 0.0;
    for (int i = 0; i < count; i++) {
        re += out->row[i] * states[2 * i];
        im += out->row[i] * states[2 * i + 1];
    }
    const double phase = atan2(im, re), before = k > 0 && !isnan(out->phase[k - 1]) ? out->phase[k - 1] : phase;
    out->amplitude[k] = hypot(re, im);
    out->phase[k] = out->amplitude[k] > 0.0 ? phase + two_pi * rint((before - phase) / two_pi) : (double)NAN;
}

/* Evaluates all frequencies; an infinite response is a gap. */
static int evaluate_response(kt_response *r) {
    const size_t states = (size_t)r->system->states;
    void *memory = malloc(kt_frequency_response_size(r->system) + 1);
    double *x = calloc(2 * states + 1, sizeof *x);
    int code = memory != NULL && x != NULL ? KT_EXIT_DONE : KT_EXIT_INTEGRATION;
    for (int i = 0; i < r->output_count && code == KT_EXIT_DONE; i++) {
        r->output[i].amplitude = calloc(r->count, sizeof(double));
        r->output[i].phase = calloc(r->count, sizeof(double));
        code = r->output[i].amplitude != NULL && r->output[i].phase != NULL ? KT_EXIT_DONE : KT_EXIT_INTEGRATION;
    }
    for (size_t k = 0; k < r->count && code == KT_EXIT_DONE; k++) {
        kt_error error = {0};
        const kt_status status =
            kt_frequency_response(r->system, r->input, two_pi * r->frequency[k], memory, x, &error);
        for (int i = 0; i < r->output_count; i++) {
            if (status == KT_OK)
                set_output(&r->output[i], k, x, r->system->states);
            else
                r->output[i].amplitude[k] = r->output[i].phase[k] = (double)NAN;
        }
    }
    free(memory);
    free(x);
    return code == KT_EXIT_DONE ? code : kt_say_no_memory("the response");
}

static double degrees(double angle) { return angle * 360.0 / two_pi; }

static const char *force_unit(const kt_response *r) { return slides(r, r->input) ? "N" : "N m"; }

/* The force in the unit of a ratio: m/N, m/(N m). */
static const char *force_divisor(const kt_response *r) { return slides(r, r->input) ? "N" : "(N m)"; }

/* ---- results ----------------------------------------------------------------------------------------------------- */

/* Whether an amplitude is at an end of the range, or larger or smaller than both neighbours. */
static const char *point_word(const kt_response *r, const double *y, size_t k) {
    if (k == 0 || k + 1 == r->count)
        return k == 0 ? "begin" : "end";
    if (!isfinite(y[k]))
        return "infinite";
    if (y[k] > y[k - 1] && y[k] > y[k + 1])
        return "peak";
    return y[k] < y[k - 1] && y[k] < y[k + 1] ? "valley" : NULL;
}

static int print_response(const kt_response *r) {
    printf("%s: response about its %s to a %s in %s\n", kt_show(r->motion.name).text, r->state,
           slides(r, r->input) ? "force" : "torque", kt_name_column(r->motion.model, r->input).text);
    for (int i = 0; i < r->output_count; i++) {
        const kt_response_output *out = &r->output[i];
        printf("\n%s\n  %12s  %14s  %9s\n  %12s  %14s  %9s\n", out->name, "frequency", "amplitude", "phase", "Hz", "",
               "deg");
        for (size_t k = 0; k < r->count; k++) {
            const char *word = point_word(r, out->amplitude, k);
            if (word != NULL)
                printf("  %12.6g  %14.6g  %9.2f  %s\n", r->frequency[k], out->amplitude[k], degrees(out->phase[k]),
                       word);
        }
        printf("  the amplitude is in %s for each %s\n", out->unit, force_unit(r));
    }
    return kt_finish_output(KT_EXIT_DONE);
}

static int write_response_json(const kt_response *r) {
    json_t *root = json_object(), *list = json_array();
    json_object_set_new(root, "scene", kt_json_text(r->motion.name));
    json_object_set_new(root, "about", json_string(r->state));
    json_object_set_new(root, "input", json_string(kt_name_column(r->motion.model, r->input).text));
    json_object_set_new(root, "input_unit", json_string(force_unit(r)));
    json_object_set_new(root, "frequency", kt_json_numbers(r->frequency, (int)r->count));
    for (int i = 0; i < r->output_count; i++) {
        json_t *one = json_object();
        json_object_set_new(one, "name", kt_json_text(r->output[i].name));
        json_object_set_new(one, "unit", json_string(r->output[i].unit));
        json_object_set_new(one, "amplitude", kt_json_numbers(r->output[i].amplitude, (int)r->count));
        json_object_set_new(one, "phase", kt_json_numbers(r->output[i].phase, (int)r->count));
        json_array_append_new(list, one);
    }
    json_object_set_new(root, "outputs", list);
    return kt_json_write(root, "-");
}

static int write_response_table(const kt_response *r, const char *path) {
    FILE *file = fopen(path, "w");
    if (file == NULL)
        return kt_reject(KT_EXIT_INTEGRATION, "%s cannot be written", kt_show_result(path).text);
    fprintf(file, "frequency [Hz]");
    for (int i = 0; i < r->output_count; i++)
        fprintf(file, ",%s.amplitude [%s/%s],%s.phase [deg]", r->output[i].name, r->output[i].unit, force_divisor(r),
                r->output[i].name);
    fputc('\n', file);
    for (size_t k = 0; k < r->count; k++) {
        fprintf(file, "%.17g", r->frequency[k]);
        for (int i = 0; i < r->output_count; i++)
            fprintf(file, ",%.17g,%.17g", r->output[i].amplitude[k], degrees(r->output[i].phase[k]));
        fputc('\n', file);
    }
    const bool is_written = ferror(file) == 0;
    return fclose(file) == 0 && is_written
               ? KT_EXIT_DONE
               : kt_reject(KT_EXIT_INTEGRATION, "%s cannot be written", kt_show_result(path).text);
}

/* ---- the picture ------------------------------------------------------------------------------------------------- */

static int draw_bode(const kt_response *r, const char *path, bool is_dark) {
    kt_plot_series series[2][OUTPUTS_MOST];
    char subtitle[200 + NAME_SIZE], unit[48];
    bool is_one_unit = true;
    for (int i = 0; i < r->output_count; i++)
        for (size_t k = 0; k < r->count; k++)
            r->output[i].phase[k] = degrees(r->output[i].phase[k]);
    for (int i = 0; i < r->output_count; i++) {
        const kt_response_output *out = &r->output[i];
        for (int p = 0; p < 2; p++)
            series[p][i] = (kt_plot_series){
                .label = out->name, .x = r->frequency, .y = p == 0 ? out->amplitude : out->phase, .count = r->count};
        is_one_unit = is_one_unit && strcmp(out->unit, r->output[0].unit) == 0;
    }
    (void)snprintf(unit, sizeof unit, "%s/%s", r->output[0].unit, force_divisor(r));
    (void)snprintf(subtitle, sizeof subtitle, "Response about its %s to a %s in %s", r->state,
                   slides(r, r->input) ? "force" : "torque", kt_name_column(r->motion.model, r->input).text);
    const kt_plot_panel panels[2] = {
        {.title = "Amplitude",
         .unit = is_one_unit ? unit : "SI",
         .series = series[0],
         .series_count = r->output_count,
         .has_legend = true,
         .x_log = true,
         .y_log = true},
        {.title = "Phase", .unit = "deg", .series = series[1], .series_count = r->output_count, .x_log = true}};
    const kt_plot plot = {.title = r->motion.name,
                          .subtitle = subtitle,
                          .x_title = "Frequency",
                          .x_unit = "Hz",
                          .panels = panels,
                          .panel_count = 2,
                          .is_dark = is_dark};
    return kt_plot_draw(&plot, path);
}

/* ---- command ----------------------------------------------------------------------------------------------------- */

static int compute_response(kt_response *r, const kt_response_arguments *a) {
    int code = kt_modes_prepare(&r->motion, a->at, a->nearest, &r->state);
    if (code != KT_EXIT_DONE)
        return code;
    r->system = kt_linearization_system(r->motion.linearization);
    code = find_input(r, a->input);
    if (code == KT_EXIT_DONE)
        code = find_outputs(r, a->output);
    if (code == KT_EXIT_DONE)
        code = choose_frequencies(r, a);
    return code == KT_EXIT_DONE ? evaluate_response(r) : code;
}

static void close_response(kt_response *r) {
    for (int i = 0; i < r->output_count; i++) {
        free(r->output[i].row);
        free(r->output[i].amplitude);
        free(r->output[i].phase);
    }
    free(r->frequency);
    kt_small_motion_close(&r->motion);
}

int kt_command_response(int argc, char **argv) {
    kt_response_arguments a = {.at = -1, .points = 400, .from = (double)NAN, .to = (double)NAN};
    kt_response *r = calloc(1, sizeof *r);
    int code = r != NULL ? kt_arguments_read(&kt_usage_response, argc, argv, &a, NULL) : kt_say_no_memory(NULL);
    const kt_file_use uses[] = {
        {"the scene", code < 0 ? argv[1] : NULL, false}, {"--plot", a.plot, true}, {"--out", a.out, true}};
    if (code >= 0 || (code = kt_check_files("response", uses, 3)) >= 0 ||
        (a.plot != NULL && (code = kt_plot_check(a.plot)) >= 0)) {
        free(r);
        return code;
    }
    code = kt_small_motion_open(&r->motion, argv[1], &a.settings);
    if (code == KT_EXIT_DONE)
        code = compute_response(r, &a);
    if (code == KT_EXIT_DONE && a.out != NULL)
        code = write_response_table(r, a.out);
    if (code == KT_EXIT_DONE)
        code = a.json ? write_response_json(r) : print_response(r);
    if (code == KT_EXIT_DONE && a.plot != NULL)
        code = draw_bode(r, a.plot, a.dark);
    close_response(r);
    free(r);
    return code;
}
