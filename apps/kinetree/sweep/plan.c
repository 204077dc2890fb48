/* The runs of a sweep: a grid of ranges and lists, a sample of ranges, or the rows of a table. Each may have
 * random values. Everything about a run follows from its number, so that any part of a sweep can be computed
 * anywhere. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/sweep.h"

#include "records/output.h"
#include "text/input.h"

#include "base/decimal.h"
#include "document/number.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- random numbers ---------------------------------------------------------------------------------------------- */

uint64_t kt_mix_bits(uint64_t x) {
    x += KT_MIX_STEP;
    x = (x ^ (x >> 30)) * UINT64_C(0xBF58476D1CE4E5B9);
    x = (x ^ (x >> 27)) * UINT64_C(0x94D049BB133111EB);
    return x ^ (x >> 31);
}

/* In (0, 1): number k of axis `axis` in a run. */
static double random_unit(uint64_t seed, int64_t run, int axis, int k) {
    const uint64_t key =
        kt_mix_bits(kt_mix_bits(kt_mix_bits(seed) ^ (uint64_t)run) ^ ((uint64_t)axis << 8 | (uint64_t)k));
    return ((double)(key >> 11) + 0.5) / 9007199254740992.0;
}

/* Box, Muller 1958. */
static double random_normal(uint64_t seed, int64_t run, int axis) {
    const double turn = 6.283185307179586 * random_unit(seed, run, axis, 1);
    return sqrt(-2.0 * log(random_unit(seed, run, axis, 0))) * cos(turn);
}

static double draw_axis_value(const kt_sweep_plan *plan, int64_t run, int axis) {
    const kt_axis *of = &plan->axes[axis];
    switch (of->draw) {
    case KT_DRAW_NORMAL:
        return of->a + of->b * random_normal(plan->seed, run, axis);
    case KT_DRAW_LOGNORMAL:
        return exp(of->a + of->b * random_normal(plan->seed, run, axis));
    case KT_DRAW_UNIFORM:
        break;
    }
    return of->a + (of->b - of->a) * random_unit(plan->seed, run, axis, 0);
}

/* ---- values of a run --------------------------------------------------------------------------------------------- */

/* A place in a range, 0 to 1; the ends are exact. */
static double value_in(const kt_axis *axis, double part) {
    if (part == 0.0)
        return axis->a;
    if (part == 1.0)
        return axis->b;
    return axis->is_logarithmic ? axis->a * pow(axis->b / axis->a, part) : axis->a + (axis->b - axis->a) * part;
}

/* The last axis runs fastest. */
static double grid_value(const kt_sweep_plan *plan, int64_t point, int axis) {
    for (int i = plan->count - 1; i > axis; i--)
        if (!plan->axes[i].is_random)
            point /= plan->axes[i].count;
    const kt_axis *of = &plan->axes[axis];
    const int64_t k = point % of->count;
    if (of->values != NULL)
        return of->values[k];
    return of->count == 1 ? of->a : value_in(of, (double)k / (double)(of->count - 1));
}

static double sample_value(const kt_sweep_plan *plan, int64_t point, int axis, int number) {
    const kt_axis *of = &plan->axes[axis];
    if (plan->sample == KT_SAMPLE_SOBOL) /* its first point is a corner of the range */
        return value_in(of, kt_sobol(number, (uint64_t)point + 1));
    const double within = random_unit(plan->seed, point, axis, 2);
    return value_in(of, ((double)of->permutation[point] + within) / (double)plan->points);
}

void kt_sweep_plan_values(const kt_sweep_plan *plan, int64_t run, double *values) {
    const int64_t point = run / plan->repeats;
    int number = 0;
    for (int i = 0; i < plan->count; i++) {
        const kt_axis *axis = &plan->axes[i];
        if (axis->is_random)
            values[i] = draw_axis_value(plan, run, i);
        else if (plan->is_table)
            values[i] = axis->values[point];
        else
            values[i] =
                plan->sample == KT_SAMPLE_GRID ? grid_value(plan, point, i) : sample_value(plan, point, i, number);
        number += !axis->is_random;
    }
}

void kt_sweep_plan_head(const kt_sweep_plan *plan, int count, kt_bytes *line) {
    kt_bytes_print(line, "%s", plan->columns[0]);
    for (int i = 0; i < plan->count; i++)
        kt_bytes_print(line, ",%s", plan->axes[i].path);
    for (int i = 1; i < count; i++)
        kt_bytes_print(line, ",%s", plan->columns[i]);
}

void kt_sweep_plan_start(const kt_sweep_plan *plan, int64_t run, const double *values, kt_bytes *line) {
    kt_bytes_print(line, "%lld", (long long)run);
    for (int i = 0; i < plan->count; i++)
        kt_sweep_put_cell(line, values[i]);
    kt_bytes_print(line, ",");
}

void kt_sweep_put_cell(kt_bytes *line, double value) {
    if (isnan(value))
        kt_bytes_print(line, ",");
    else
        kt_bytes_print(line, ",%.17g", value);
}

void kt_sweep_plan_set(const kt_sweep_plan *plan, const double *values, kt_sweep_texts *texts, kt_settings *settings) {
    for (int i = 0; i < plan->count && settings->count < KT_SETTINGS_MAX; i++) {
        (void)snprintf(texts->text[i], sizeof texts->text[i], "%.550s=%.17g%s", plan->axes[i].path, values[i],
                       plan->axes[i].is_angle ? " rad" : "");
        settings->text[settings->count++] = texts->text[i];
    }
}

/* ---- reading --------------------------------------------------------------------------------------------------- */

static int say_vary(const char *text) {
    return kt_misuse("--vary takes NAME=FROM:TO:COUNT, NAME=log:FROM:TO:COUNT or NAME=A,B,C, not '%s'; numbers are in "
                     "SI units, or angles such as 10 deg",
                     text);
}

static int say_random(const char *text) {
    return kt_misuse(
        "--random takes NAME=uniform(FROM,TO), NAME=normal(MEAN,DEVIATION) or NAME=lognormal(MEAN,DEVIATION), not '%s'",
        text);
}

/* A number at the end of a text. */
static bool is_number(const char *text, double *value) {
    const char *end;
    return kt_decimal_read(text, value, &end) && *end == '\0';
}

/* A value in SI units, or an angle with deg or rad as in scenes, and the character that must follow it. */
static bool take_axis_value(kt_axis *axis, const char **text, char after, double *value) {
    const char stops[] = {after, '\0'};
    const size_t length = strcspn(*text, stops);
    char word[80];
    if (length >= sizeof word || (*text)[length] != after)
        return false;
    memcpy(word, *text, length);
    word[length] = '\0';
    *text += length + (after != '\0');
    const char *number = word + strspn(word, " "), *end;
    if (kt_decimal_read(number, value, &end) && *end == '\0') {
        axis->has_plain = axis->has_plain || *value != 0.0;
        return true;
    }
    const bool is_angle = kt_scalar_classify(number, value) == KT_SCALAR_ANGLE;
    axis->is_angle = axis->is_angle || is_angle;
    return is_angle;
}

/* The name of a path "parameters.NAME", which "NAME" names, too; else the path. */
static const char *short_path(const char *path) {
    static const char section[] = "parameters.";
    const size_t length = sizeof section - 1;
    if (strncmp(path, section, length) != 0)
        return path;
    const char end = path[length + strcspn(path + length, ".[=")];
    return end == '\0' || end == '=' ? path + length : path;
}

/* Whether two texts "PATH=..." or "PATH" have the same path. */
static bool is_same_path(const char *a, const char *b) {
    a = short_path(a);
    b = short_path(b);
    const size_t length = strcspn(a, "=");
    return strcspn(b, "=") == length && strncmp(a, b, length) == 0;
}

/* Rejects a value that varies and that `--set` fixes, since one of them would have no effect. */
static int check_fixed_values(const kt_sweep_plan *plan, const kt_settings *settings) {
    for (int i = 0; i < plan->count; i++)
        for (int k = 0; k < settings->count; k++)
            if (is_same_path(plan->axes[i].path, settings->text[k]))
                return kt_misuse("'%s' varies, and '--set %s' sets the same value; remove one", plan->axes[i].path,
                                 kt_show(settings->text[k]).text);
    return -1;
}

/* Whether a name of `length` bytes is that of a column of every line. */
static bool names_line_column(const kt_sweep_plan *plan, const char *name, size_t length) {
    for (const char *const *column = plan->columns; *column != NULL; column++)
        if (strlen(*column) == length && strncmp(*column, name, length) == 0)
            return true;
    return false;
}

/* The axis of "PATH=..."; *rest: the text after it. */
static kt_axis *add_axis(kt_sweep_plan *plan, const char *text, const char **rest, int *code) {
    const char *equals = strchr(text, '=');
    const size_t length = (size_t)(equals - text);
    *code = -1;
    for (int i = 0; i < plan->count; i++)
        if (is_same_path(plan->axes[i].path, text)) {
            *code = kt_misuse("'%s' is varied twice; remove one", plan->axes[i].path);
            return NULL;
        }
    if (plan->count == KT_SWEEP_AXES_MAX) {
        *code = kt_misuse("a sweep varies at most %d values", KT_SWEEP_AXES_MAX);
        return NULL;
    }
    kt_axis *axis = &plan->axes[plan->count++];
    char *path = strndup(text, length);
    if (path != NULL && names_line_column(plan, text, length)) {
        axis->path = kt_join_texts("parameters.", path, "");
        free(path);
    } else {
        axis->path = path;
    }
    *rest = equals + 1;
    if (axis->path == NULL)
        *code = kt_say_no_memory(NULL);
    return axis->path != NULL ? axis : NULL;
}

static int read_list(const char *text, const char *rest, kt_axis *axis) {
    axis->values = calloc(strlen(rest) + 1, sizeof *axis->values);
    if (axis->values == NULL)
        return kt_say_no_memory(NULL);
    for (bool more = true; more;) {
        more = strchr(rest, ',') != NULL;
        if (!take_axis_value(axis, &rest, more ? ',' : '\0', &axis->values[axis->count]))
            return say_vary(text);
        axis->count++;
    }
    return -1;
}

static int read_axis_range(const char *text, const char *rest, kt_axis *axis) {
    double count = 0.0;
    if (strncmp(rest, "log:", 4) == 0) {
        axis->is_logarithmic = true;
        rest += 4;
    }
    if (!take_axis_value(axis, &rest, ':', &axis->a))
        return say_vary(text);
    const bool is_counted = strchr(rest, ':') != NULL;
    if (!take_axis_value(axis, &rest, is_counted ? ':' : '\0', &axis->b))
        return say_vary(text);
    if (is_counted && (!is_number(rest, &count) || !(count >= 1.0 && count <= 1e9) || count != floor(count)))
        return say_vary(text);
    if (axis->is_logarithmic && !(axis->a > 0.0 && axis->b > 0.0))
        return kt_misuse("--vary %s: a logarithmic range has ends above zero", text);
    axis->count = (int64_t)count;
    if (axis->count == 1 && axis->a != axis->b)
        kt_say("--vary %s: a range of one value is its first end; give 2 values or more", kt_show(text).text);
    return -1;
}

/* Rejects an axis with angles and other numbers: 10:60 deg begins at 10 rad. Zero needs no unit. */
static int check_axis_units(const char *where, const kt_axis *axis) {
    if (!axis->is_angle || !axis->has_plain)
        return -1;
    return kt_misuse("%s %s: some values are angles with a unit, and others are numbers; write the unit behind each "
                     "(10 deg:60 deg:3)",
                     where, axis->path);
}

static int read_vary(kt_sweep_plan *plan, const char *text) {
    const char *rest;
    int code;
    kt_axis *axis = add_axis(plan, text, &rest, &code);
    if (axis == NULL)
        return code;
    code = strchr(rest, ':') != NULL ? read_axis_range(text, rest, axis) : read_list(text, rest, axis);
    return code < 0 ? check_axis_units("--vary", axis) : code;
}

static int check_distribution(const kt_axis *axis) {
    const char *wrong = NULL;
    if (axis->draw != KT_DRAW_UNIFORM && !(axis->b >= 0.0))
        wrong = "the deviation is negative; give 0 or more";
    else if (axis->draw == KT_DRAW_LOGNORMAL && axis->is_angle)
        wrong = "mean and deviation of a logarithm are numbers; leave the units out";
    if (wrong != NULL)
        kt_say("--random %s: %s", axis->path, wrong);
    return wrong != NULL ? KT_EXIT_USAGE : -1;
}

static int read_random(kt_sweep_plan *plan, const char *text) {
    static const struct {
        const char *name;
        kt_draw draw;
    } draws[] = {{"uniform(", KT_DRAW_UNIFORM}, {"normal(", KT_DRAW_NORMAL}, {"lognormal(", KT_DRAW_LOGNORMAL}};
    const char *rest;
    int code;
    kt_axis *axis = add_axis(plan, text, &rest, &code);
    if (axis == NULL)
        return code;
    axis->is_random = true;
    for (size_t i = 0; i < sizeof draws / sizeof draws[0]; i++)
        if (strncmp(rest, draws[i].name, strlen(draws[i].name)) == 0) {
            rest += strlen(draws[i].name);
            axis->draw = draws[i].draw;
            if (!take_axis_value(axis, &rest, ',', &axis->a) || !take_axis_value(axis, &rest, ')', &axis->b) ||
                *rest != '\0')
                break;
            code = check_axis_units("--random", axis);
            return code < 0 ? check_distribution(axis) : code;
        }
    return say_random(text);
}

/* ---- a table ----------------------------------------------------------------------------------------------------- */

static int say_table(const char *path, int64_t line, const char *what) {
    return kt_reject(KT_EXIT_SCENE, "%s:%lld: %s", path, (long long)line, what);
}

/* The names of the first line. */
static int read_axis_names(kt_sweep_plan *plan, const char *path, char *line) {
    char *rest = line;
    for (char *name = strtok_r(line, ",", &rest); name != NULL; name = strtok_r(NULL, ",", &rest)) {
        char text[512];
        const char *ignored;
        int code;
        name += strspn(name, " ");
        for (size_t length = strlen(name); length > 0 && name[length - 1] == ' ';)
            name[--length] = '\0';
        const size_t length = strcspn(name, " ");
        if (name[length] != '\0' && name[strlen(name) - 1] == ']')
            return kt_reject(KT_EXIT_SCENE,
                             "%s:1: '%s': names of values that vary have no unit; write '%.*s', and values in SI units "
                             "or angles such as 10 deg",
                             path, kt_show(name).text, (int)length, kt_show(name).text);
        if ((size_t)snprintf(text, sizeof text, "%s=", name) >= sizeof text)
            return say_table(path, 1, "a name of a value that varies is too long; names have at most 510 bytes");
        if (add_axis(plan, text, &ignored, &code) == NULL)
            return KT_EXIT_SCENE;
    }
    return -1;
}

static const char row_rule[] = "a row has a number for each name of the first line, with commas between";

/* Ends a line, without its newline or its carriage return and newline. Returns the start of the next line. */
static char *end_axis_line(char *line) {
    const size_t length = strcspn(line, "\n");
    char *const next = line + length + (line[length] == '\n');
    line[length] = '\0';
    if (length > 0 && line[length - 1] == '\r')
        line[length - 1] = '\0';
    return next;
}

/* Returns whether the second line, if there is one, may be a row. If it may not, the file is of another kind, and its
 * first line, which may be a secret of the user, is not taken as names that messages quote. */
static bool has_axis_row(const char *text) {
    const char *row = text + strcspn(text, "\n");
    size_t commas[2] = {0, 0};
    row += strspn(row, "\r\n");
    for (const char *c = text; *c != '\0' && *c != '\n'; c++)
        commas[0] += *c == ',';
    for (const char *c = row; *c != '\0' && *c != '\n'; c++)
        commas[1] += *c == ',';
    return *row == '\0' || (commas[0] == commas[1] && strchr("+-.0123456789 \t", *row) != NULL);
}

static int read_axis_row(kt_sweep_plan *plan, const char *path, int64_t line, const char *text) {
    for (int i = 0; i < plan->count; i++) {
        kt_axis *axis = &plan->axes[i];
        if ((plan->points & (plan->points - 1)) == 0) { /* room grows by two */
            double *more = realloc(axis->values, (size_t)(plan->points > 0 ? 2 * plan->points : 1) * sizeof *more);
            if (more == NULL)
                return kt_say_no_memory(NULL);
            axis->values = more;
        }
        if (!take_axis_value(axis, &text, i + 1 < plan->count ? ',' : '\0', &axis->values[plan->points]))
            return say_table(path, line, row_rule);
    }
    plan->points++;
    return -1;
}

static int read_axis_table(kt_sweep_plan *plan, const char *path) {
    char *text = NULL;
    size_t size = 0;
    int64_t number = 0;
    kt_error error = {0};
    if (kt_input_read(path, &kt_input_table, &text, &size, &error) != KT_OK) {
        kt_say_error(&error);
        return KT_EXIT_SCENE;
    }
    char *at = kt_behind_mark(text);
    int code = has_axis_row(at) ? -1 : say_table(path, 2, row_rule);
    while (code < 0 && *at != '\0') {
        char *const line = at;
        at = end_axis_line(at);
        code = strchr(line, '\r') != NULL ? say_table(path, number + 1, "a carriage return is within the line")
               : number == 0              ? read_axis_names(plan, path, line)
               : line[0] != '\0'          ? read_axis_row(plan, path, number + 1, line)
                                          : -1;
        number++;
    }
    free(text);
    plan->is_table = true;
    for (int i = 0; code < 0 && i < plan->count; i++)
        code = check_axis_units(path, &plan->axes[i]) >= 0 ? KT_EXIT_SCENE : -1;
    if (code < 0 && plan->points == 0)
        return say_table(path, number, "there are no rows; the first line has the names, and each other line is a run");
    return code;
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

/* A permutation of the strata for each range (Fisher, Yates; Durstenfeld 1964). */
static int permute(kt_sweep_plan *plan, int i) {
    kt_axis *axis = &plan->axes[i];
    axis->permutation = malloc((size_t)plan->points * sizeof *axis->permutation);
    if (axis->permutation == NULL)
        return kt_say_no_memory(NULL);
    for (int64_t k = 0; k < plan->points; k++)
        axis->permutation[k] = k;
    for (int64_t k = plan->points - 1; k > 0; k--) {
        const int64_t j = (int64_t)(random_unit(plan->seed, k, i, 3) * (double)(k + 1)), kept = axis->permutation[k];
        axis->permutation[k] = axis->permutation[j];
        axis->permutation[j] = kept;
    }
    return -1;
}

static int set_sample(kt_sweep_plan *plan, const char *text) {
    const char *rest = strchr(text, ':');
    double count = 0.0;
    int ranges = 0;
    if (strncmp(text, "sobol:", 6) == 0)
        plan->sample = KT_SAMPLE_SOBOL;
    else if (strncmp(text, "latin:", 6) == 0)
        plan->sample = KT_SAMPLE_LATIN;
    else
        rest = NULL;
    if (rest == NULL || *rest++ == '\0' || !is_number(rest, &count) || !(count >= 1.0 && count <= 1e9) ||
        count != floor(count))
        return kt_misuse("--sample takes sobol:COUNT or latin:COUNT, not '%s'", text);
    plan->points = (int64_t)count;
    for (int i = 0; i < plan->count; i++) {
        if (plan->axes[i].is_random)
            continue;
        ranges++;
        if (plan->axes[i].values != NULL || plan->axes[i].count > 0)
            return kt_misuse("--sample fills ranges: give --vary %s=FROM:TO", plan->axes[i].path);
        const int code = plan->sample == KT_SAMPLE_LATIN ? permute(plan, i) : -1;
        if (code >= 0)
            return code;
    }
    if (ranges == 0 || (plan->sample == KT_SAMPLE_SOBOL && ranges > KT_SOBOL_AXES))
        return kt_misuse("--sample fills ranges, 1 to %d of them with sobol: give --vary NAME=FROM:TO", KT_SOBOL_AXES);
    return -1;
}

static int set_grid(kt_sweep_plan *plan) {
    plan->points = 1;
    for (int i = 0; i < plan->count; i++) {
        const kt_axis *axis = &plan->axes[i];
        if (axis->is_random)
            continue;
        if (axis->count == 0)
            return kt_misuse("--vary %s: give the number of values, FROM:TO:COUNT, or --sample", axis->path);
        if (plan->points > INT64_C(1000000000000) / axis->count)
            return kt_misuse("there are more than 1e12 runs");
        plan->points *= axis->count;
    }
    return -1;
}

int kt_sweep_plan_make(const kt_sweep_arguments *arguments, const char *const *columns, kt_sweep_plan *plan) {
    int code = -1;
    *plan = (kt_sweep_plan){.seed = (uint64_t)arguments->seed, .repeats = arguments->repeats, .columns = columns};
    if (arguments->from != NULL)
        code = read_axis_table(plan, arguments->from);
    for (int i = 0; code < 0 && i < arguments->vary.count; i++)
        code = read_vary(plan, arguments->vary.text[i]);
    for (int i = 0; code < 0 && i < arguments->random.count; i++)
        code = read_random(plan, arguments->random.text[i]);
    if (code < 0)
        code = check_fixed_values(plan, &arguments->settings);
    if (code >= 0)
        return code;
    if (plan->count == 0)
        return kt_misuse("nothing is varied; give --vary NAME=FROM:TO:COUNT, --random or --from");
    if (arguments->sample != NULL)
        return set_sample(plan, arguments->sample);
    return plan->is_table ? -1 : set_grid(plan);
}

/* Prints that a parameter changes nothing, and suggests one that does. */
static int say_without_use(const kt_scene *scene, const char *path, const char *name) {
    kt_nearest nearest = kt_nearest_make(name, NULL);
    for (int k = 0; k < scene->parameter_count; k++)
        if (scene->parameters[k].is_used)
            (void)kt_nearest_try(&nearest, scene->parameters[k].name);
    return kt_misuse(
        "'%s' varies, but nothing in the scene uses the parameter '%s'%s%s", path, name, kt_ask(&nearest, "", "").text,
        nearest.best != NULL ? "" : "; write =NAME where it is meant, or vary a number by its path (bodies.arm.mass)");
}

int kt_sweep_plan_check(const kt_sweep_plan *plan, const kt_scene *scene) {
    for (int i = 0; i < plan->count; i++) {
        const char *path = plan->axes[i].path, *name = short_path(path);
        for (int k = 0; k < scene->parameter_count; k++)
            if (!scene->parameters[k].is_used && strcmp(scene->parameters[k].name, name) == 0)
                return say_without_use(scene, path, name);
    }
    return -1;
}

void kt_sweep_plan_free(kt_sweep_plan *plan) {
    for (int i = 0; i < plan->count; i++) {
        free(plan->axes[i].path);
        free(plan->axes[i].values);
        free(plan->axes[i].permutation);
    }
    plan->count = 0;
}

int64_t kt_sweep_plan_largest(const kt_sweep_plan *plan, int axis) {
    const int64_t runs = kt_sweep_plan_runs(plan), most = runs < 1000000 ? runs : 1000000;
    double values[KT_SWEEP_AXES_MAX], largest = -1.0;
    int64_t found = 0;
    for (int64_t run = 0; run < most; run++) {
        kt_sweep_plan_values(plan, run, values);
        if (fabs(values[axis]) > largest) {
            largest = fabs(values[axis]);
            found = run;
        }
    }
    return found;
}
