/* The modes of a scene over a parameter: `modes --sweep`, and its Campbell diagram.
 *
 * The scene is read, assembled and linearised anew for each value. Modes have no names, so the modes of successive
 * values are matched by their shapes. With the shapes x and y of positions and velocities, over their units and scaled
 * to length 1, two modes agree by |x* y|, and are apart by |lambda - mu| / (|lambda| + |mu|). The pair with the
 * greatest agreement less distance is matched first, then the best pair of the others. Where curves cross, shapes
 * therefore keep them apart. Where curves veer, the shapes change gradually, and so do the curves.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/modes.h"

#include "command.h"
#include "plot/plot.h"
#include "text/json.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { VALUES_MOST = 2000, VALUES_USUAL = 41, DRAWN_MOST = KT_PLOT_SERIES_MAX, LINES_MOST = 3 };

static const double two_pi = 6.28318530717958647693;

/* One mode at one value. */
typedef struct kt_swept_mode {
    double frequency, rate, damping; /* Hz, 1/s */
    double real, imaginary;
    double *shape; /* numbers of a complex vector of length 1 */
} kt_swept_mode;

/* The modes at one value. */
typedef struct kt_swept_value {
    kt_swept_mode *modes;
    int count;
    int *curve; /* of each mode */
} kt_swept_value;

typedef struct kt_modes_sweep {
    char path[256]; /* of the parameter */
    double from, to;
    int value_count, curve_count;
    size_t shape_size; /* complex numbers of a shape */
    double *value;
    kt_swept_value *at;
    char name[256], state[64];
    char movers[DRAWN_MOST][64];
} kt_modes_sweep;

/* ---- the values -------------------------------------------------------------------------------------------------- */

/* Reads "PATH=FROM:TO" or "PATH=FROM:TO:COUNT". */
static int read_range(const char *text, kt_modes_sweep *s) {
    const char *sign = strchr(text, '=');
    char *end = NULL;
    double count = VALUES_USUAL;
    const size_t length = sign != NULL ? (size_t)(sign - text) : 0;
    bool good = length > 0 && length < sizeof s->path;
    s->from = good ? strtod(sign + 1, &end) : 0.0;
    good = good && end != sign + 1 && *end == ':';
    const char *second = good ? end + 1 : NULL;
    s->to = good ? strtod(second, &end) : 0.0;
    good = good && end != second && (*end == '\0' || *end == ':');
    if (good && *end == ':') {
        const char *third = end + 1;
        count = strtod(third, &end);
        good = end != third && *end == '\0';
    }
    if (!good || !isfinite(s->from) || !isfinite(s->to) || !(s->from < s->to) || !(count >= 2.0) ||
        count > VALUES_MOST || count != floor(count))
        return kt_misuse(
            "modes: --sweep takes PARAMETER=FROM:TO or PARAMETER=FROM:TO:COUNT, with FROM below TO and 2 to "
            "%d values, not '%s'",
            (int)VALUES_MOST, kt_show(text).text);
    (void)snprintf(s->path, sizeof s->path, "%.*s", (int)length, text);
    s->value_count = (int)count;
    return KT_EXIT_DONE;
}

/* ---- modes at a value -------------------------------------------------------------------------------------------- */

/* Shapes have the positions and velocities of all joints over their units, and auxiliary states. */
static size_t shape_size(const kt_small_motion *motion) {
    const kt_linear_system *system = kt_linearization_system(motion->linearization);
    return 2 * (size_t)system->coordinates + (size_t)system->auxiliary_states;
}

static bool keep_shape(const kt_small_motion *motion, int mode, double modulus, double *out) {
    const kt_linear_system *s = kt_linearization_system(motion->linearization);
    const double *q = kt_modes_positions(motion->modes, mode), *v = kt_modes_velocities(motion->modes, mode),
                 *x = kt_modes_auxiliary_states(motion->modes, mode);
    double sum = 0.0;
    size_t n = 0;
    for (int i = 0; i < 2 * s->coordinates; i++)
        out[n++] = q[i] / s->unit[i / 2];
    for (int i = 0; i < 2 * s->coordinates; i++)
        out[n++] = v[i] / (s->unit[i / 2] * fmax(modulus, 1e-300));
    for (int i = 0; i < 2 * s->auxiliary_states; i++)
        out[n++] = x[i];
    for (size_t i = 0; i < n; i++)
        sum += out[i] * out[i];
    for (size_t i = 0; i < n && sum > 0.0; i++)
        out[i] /= sqrt(sum);
    return sum > 0.0;
}

static int keep_modes(const kt_small_motion *motion, long most, kt_swept_value *at) {
    const int count = kt_modes_count(motion->modes);
    at->modes = calloc((size_t)count + 1, sizeof *at->modes);
    at->curve = calloc((size_t)count + 1, sizeof *at->curve);
    if (at->modes == NULL || at->curve == NULL)
        return kt_say_no_memory("the sweep");
    for (int i = 0; i < count && at->count < most; i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        kt_swept_mode *to = &at->modes[at->count];
        if (kt_mode_is_neutral(&mode))
            continue;
        *to = (kt_swept_mode){.frequency = mode.frequency,
                              .rate = fabs(mode.real) > mode.error ? mode.real : 0.0,
                              .damping = fabs(mode.real) > mode.error ? mode.damping : 0.0,
                              .real = mode.real,
                              .imaginary = mode.imaginary};
        to->shape = calloc(2 * shape_size(motion) + 1, sizeof *to->shape);
        if (to->shape == NULL)
            return kt_say_no_memory("the sweep");
        (void)keep_shape(motion, i, kt_mode_modulus(&mode), to->shape);
        at->count++;
    }
    return KT_EXIT_DONE;
}

/* The joints that move most in the modes of the first value, for the legend. */
static void name_curves(kt_modes_sweep *s, const kt_small_motion *motion) {
    int number = 0;
    for (int i = 0; i < kt_modes_count(motion->modes) && number < DRAWN_MOST; i++) {
        const kt_mode mode = kt_modes_at(motion->modes, i);
        kt_mover mover;
        if (kt_mode_is_neutral(&mode))
            continue;
        const bool has_mover = kt_find_movers(motion, i, &mover, 1, 0.0) > 0;
        (void)snprintf(s->movers[number], sizeof s->movers[number], "%d: %.48s", number + 1,
                       has_mover ? kt_name_coordinate(motion, mover.coordinate).text : "");
        number++;
    }
}

static int sweep_value(kt_modes_sweep *s, int k, const kt_modes_request *request, const char *path,
                       const kt_settings *settings) {
    char text[320];
    kt_settings *own = malloc(sizeof *own);
    kt_small_motion motion;
    const char *state = "";
    if (own == NULL)
        return kt_say_no_memory("the sweep");
    *own = *settings;
    own->is_quiet = own->is_quiet || k > 0; /* notes on the file are printed once */
    if (own->count == KT_SETTINGS_MAX) {
        free(own);
        return kt_misuse("modes: --set and --sweep are more than %d", (int)KT_SETTINGS_MAX);
    }
    (void)snprintf(text, sizeof text, "%s=%.17g", s->path, s->value[k]);
    own->text[own->count++] = text;
    int code = kt_small_motion_open(&motion, path, own);
    motion.rotating = request->rotating;
    motion.is_repeated = k > 0;
    if (code == KT_EXIT_DONE)
        code = kt_modes_prepare(&motion, request->at, request->nearest, &state);
    if (code == KT_EXIT_DONE && k == 0) {
        s->shape_size = shape_size(&motion);
        (void)snprintf(s->name, sizeof s->name, "%s", kt_show(motion.name).text);
        (void)snprintf(s->state, sizeof s->state, "%s", state);
        name_curves(s, &motion);
    }
    if (code == KT_EXIT_DONE && strcmp(state, s->state) != 0)
        kt_say("modes: --sweep: at %s, the state is a %s, not a %s; modes of an instant do not decide the stability",
               text, state, s->state);
    if (code == KT_EXIT_DONE)
        code = keep_modes(&motion, request->count, &s->at[k]);
    if (code != KT_EXIT_DONE)
        kt_say("modes: --sweep ends at %s", text);
    kt_small_motion_close(&motion);
    free(own);
    return code;
}

/* ---- curves ------------------------------------------------------------------------------------------------------ */

/* How well two modes of neighbouring values agree. */
static double agreement(const kt_swept_mode *a, const kt_swept_mode *b, size_t size) {
    double re = 0.0, im = 0.0;
    for (size_t i = 0; i < size; i++) {
        const double *x = a->shape + 2 * i, *y = b->shape + 2 * i;
        re += x[0] * y[0] + x[1] * y[1];
        im += x[0] * y[1] - x[1] * y[0];
    }
    const double apart = hypot(a->real - b->real, a->imaginary - b->imaginary);
    return hypot(re, im) - apart / (hypot(a->real, a->imaginary) + hypot(b->real, b->imaginary));
}

/* Gives each mode of value k the curve of the mode of value k - 1 that agrees best, or a new curve. */
static void match_modes(kt_modes_sweep *s, int k) {
    const kt_swept_value *before = &s->at[k - 1];
    kt_swept_value *at = &s->at[k];
    for (int i = 0; i < at->count; i++)
        at->curve[i] = -1;
    for (int pairs = 0; pairs < before->count && pairs < at->count; pairs++) {
        double best = -(double)INFINITY;
        int from = -1, to = -1;
        for (int i = 0; i < before->count; i++)
            for (int j = 0; j < at->count; j++) {
                bool is_taken = at->curve[j] >= 0;
                for (int m = 0; m < at->count && !is_taken; m++)
                    is_taken = at->curve[m] == before->curve[i];
                const double now = is_taken ? best : agreement(&before->modes[i], &at->modes[j], s->shape_size);
                if (!is_taken && now > best) {
                    best = now;
                    from = i;
                    to = j;
                }
            }
        if (from >= 0)
            at->curve[to] = before->curve[from];
    }
    for (int i = 0; i < at->count; i++)
        if (at->curve[i] < 0)
            at->curve[i] = s->curve_count++;
}

static void trace_curves(kt_modes_sweep *s) {
    for (int i = 0; i < s->at[0].count; i++)
        s->at[0].curve[i] = s->curve_count++;
    for (int k = 1; k < s->value_count; k++)
        match_modes(s, k);
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

static int print_sweep(const kt_modes_sweep *s) {
    printf("%s: modes over %s, linearised about the %s\n", s->name, s->path, s->state);
    printf("%14s  %5s  %12s  %12s  %9s\n", s->path, "curve", "frequency", "rate", "damping");
    printf("%14s  %5s  %12s  %12s  %9s\n", "", "", "Hz", "1/s", "ratio");
    for (int k = 0; k < s->value_count; k++)
        for (int i = 0; i < s->at[k].count; i++) {
            const kt_swept_mode *m = &s->at[k].modes[i];
            printf("%14.8g  %5d  %12.6g  %12.6g  %9.4f\n", s->value[k], s->at[k].curve[i] + 1, m->frequency, m->rate,
                   m->damping);
        }
    return kt_finish_output(KT_EXIT_DONE);
}

static int write_sweep_json(const kt_modes_sweep *s) {
    json_t *root = json_object(), *list = json_array();
    json_object_set_new(root, "scene", kt_json_text(s->name));
    json_object_set_new(root, "about", json_string(s->state));
    json_object_set_new(root, "parameter", kt_json_text(s->path));
    for (int k = 0; k < s->value_count; k++) {
        json_t *one = json_object(), *modes = json_array();
        for (int i = 0; i < s->at[k].count; i++) {
            const kt_swept_mode *m = &s->at[k].modes[i];
            json_array_append_new(modes, json_pack("{s:i, s:f, s:f, s:f, s:f}", "curve", s->at[k].curve[i] + 1,
                                                   "frequency", m->frequency, "rate", m->rate, "damping", m->damping,
                                                   "imaginary", m->imaginary));
        }
        json_object_set_new(one, "value", kt_json_number(s->value[k]));
        json_object_set_new(one, "modes", modes);
        json_array_append_new(list, one);
    }
    json_object_set_new(root, "values", list);
    return kt_json_write(root, "-");
}

/* The numbers of a curve over all values; NaN where it has none. */
static void fill_curve(const kt_modes_sweep *s, int curve, double *frequency, double *rate) {
    for (int k = 0; k < s->value_count; k++) {
        frequency[k] = rate[k] = (double)NAN;
        for (int i = 0; i < s->at[k].count; i++)
            if (s->at[k].curve[i] == curve) {
                frequency[k] = s->at[k].modes[i].frequency;
                rate[k] = s->at[k].modes[i].rate;
            }
    }
}

static int draw_campbell(const kt_modes_sweep *s, const char *path, long orders, bool is_dark) {
    const size_t n = (size_t)s->value_count;
    const int lines = orders < LINES_MOST ? (int)orders : LINES_MOST;
    const int most = lines > 0 ? DRAWN_MOST - 1 : DRAWN_MOST; /* the last colour is that of the lines */
    const int drawn = s->curve_count < most ? s->curve_count : most;
    bool has_rate = false;
    double *numbers = calloc(n * (2 * DRAWN_MOST + LINES_MOST), sizeof *numbers);
    kt_plot_series series[2][DRAWN_MOST + LINES_MOST];
    char labels[LINES_MOST][32], subtitle[400];
    if (numbers == NULL)
        return kt_say_no_memory("the picture");
    for (int c = 0; c < drawn; c++) {
        double *y = numbers + 2 * n * (size_t)c;
        fill_curve(s, c, y, y + n);
        for (size_t i = 0; i < n; i++)
            has_rate = has_rate || fabs(y[n + i]) > 0.0;
        for (int p = 0; p < 2; p++)
            series[p][c] = (kt_plot_series){
                .label = s->movers[c], .x = s->value, .y = p == 0 ? y : y + n, .count = n, .colour = c + 1};
    }
    for (int k = 0; k < lines; k++) {
        double *y = numbers + n * (size_t)(2 * DRAWN_MOST + k);
        for (size_t i = 0; i < n; i++)
            y[i] = (k + 1) * fabs(s->value[i]) / two_pi;
        if (k == 0)
            (void)snprintf(labels[k], sizeof labels[k], "%.20s/2\317\200", s->path);
        else
            (void)snprintf(labels[k], sizeof labels[k], "%d %.20s/2\317\200", k + 1, s->path);
        series[0][drawn + k] = (kt_plot_series){
            .label = labels[k], .x = s->value, .y = y, .count = n, .colour = KT_PLOT_SERIES_MAX, .is_dashed = true};
    }
    (void)snprintf(subtitle, sizeof subtitle, "Modes about the %s over %s", s->state, s->path);
    const kt_plot_panel panels[2] = {
        {.title = "Frequency",
         .unit = "Hz",
         .series = series[0],
         .series_count = drawn + lines,
         .left_out = s->curve_count - drawn,
         .has_legend = true},
        {.title = "Rate (above 0: growth)", .unit = "1/s", .series = series[1], .series_count = drawn}};
    const kt_plot plot = {.title = s->name,
                          .subtitle = subtitle,
                          .x_title = s->path,
                          .panels = panels,
                          .panel_count = has_rate ? 2 : 1,
                          .is_dark = is_dark};
    const int code = kt_plot_draw(&plot, path);
    free(numbers);
    return code;
}

static void free_sweep(kt_modes_sweep *s) {
    for (int k = 0; s->at != NULL && k < s->value_count; k++) {
        for (int i = 0; i < s->at[k].count; i++)
            free(s->at[k].modes[i].shape);
        free(s->at[k].modes);
        free(s->at[k].curve);
    }
    free(s->at);
    free(s->value);
}

static int take_sweep(kt_modes_sweep *s) {
    s->value = calloc((size_t)s->value_count, sizeof *s->value);
    s->at = calloc((size_t)s->value_count, sizeof *s->at);
    if (s->value == NULL || s->at == NULL)
        return kt_say_no_memory("the sweep");
    for (int k = 0; k < s->value_count; k++)
        s->value[k] = k + 1 == s->value_count ? s->to : s->from + (s->to - s->from) * k / (s->value_count - 1);
    return KT_EXIT_DONE;
}

int kt_modes_sweep_print(const char *range, const char *path, const kt_settings *settings,
                         const kt_modes_request *request) {
    kt_modes_sweep s = {.value_count = 0};
    int code = read_range(range, &s);
    if (code == KT_EXIT_DONE)
        code = take_sweep(&s);
    for (int c = 0; c < DRAWN_MOST; c++)
        (void)snprintf(s.movers[c], sizeof s.movers[c], "%d", c + 1);
    for (int k = 0; k < s.value_count && code == KT_EXIT_DONE; k++)
        code = sweep_value(&s, k, request, path, settings);
    if (code == KT_EXIT_DONE)
        trace_curves(&s);
    if (code == KT_EXIT_DONE)
        code = request->json ? write_sweep_json(&s) : print_sweep(&s);
    if (code == KT_EXIT_DONE && request->plot != NULL)
        code = draw_campbell(&s, request->plot, request->orders, request->dark);
    free_sweep(&s);
    return code;
}
