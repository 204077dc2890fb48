/* The drives of a scene: loops that change with time, and jumps of the velocities that these loops prescribe. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/start.h"

#include <math.h>
#include <string.h>

/* Returns whether the value of a formula may jump. */
static bool may_jump(const char *text) {
    static const char *const words[] = {"sign(", "step(", "<", ">", "==", "!="};
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        if (strstr(text, words[k]) != NULL)
            return true;
    return false;
}

static double slope_at(const kt_function *f, double t) {
    double out[3];
    return kt_function_evaluate(f, t, out, NULL) == KT_OK ? out[1] : (double)NAN;
}

/* Returns the change of the slope between two times, or near a kink between them. The half with the larger change is
 * halved again, to the length of rounding. */
static double slope_change(const kt_function *f, double from, double to) {
    double before = slope_at(f, from), after = slope_at(f, to);
    for (int k = 0; k < 40 && before != after; k++) {
        const double middle = 0.5 * (from + to), slope = slope_at(f, middle);
        if (fabs(slope - before) > fabs(after - slope)) {
            to = middle;
            after = slope;
        } else {
            from = middle;
            before = slope;
        }
    }
    return fabs(after - before);
}

/* Returns whether the slope of a formula jumps during the run, by more than a small part of itself. Pulses between two
 * samples are not found. */
static bool formula_has_kink(const kt_function *f, double duration) {
    enum { PARTS = 128 };
    static const char *const words[] = {"abs", "min", "max", "clamp"};
    double largest = 0.0, jump = 0.0;
    bool may = false;
    for (size_t k = 0; k < sizeof words / sizeof *words; k++)
        may = may || strstr(f->text, words[k]) != NULL;
    if (!may)
        return false;
    for (int k = 0; k < PARTS; k++) {
        const double from = duration * k / PARTS, to = duration * (k + 1) / PARTS;
        largest = fmax(largest, fabs(slope_at(f, to)));
        jump = fmax(jump, slope_change(f, k > 0 ? from : 1e-9 * to, k + 1 < PARTS ? to : to - 1e-9 * duration));
    }
    return jump > 1e-6 * largest;
}

/* The slope of a linear table behind row i, which is zero before the first row and behind the last one. */
static double table_slope(const kt_function *f, int i) {
    const double *row = f->numbers + 2 * i;
    return i >= 0 && 2 * (i + 1) < f->number_count ? (row[3] - row[1]) / (row[2] - row[0]) : 0.0;
}

/* Returns whether the slope of a linear table jumps at a row during the run, by more than rounding. */
static bool table_has_kink(const kt_function *f, double duration) {
    bool has = false;
    for (int i = 0; f->interpolation == KT_INTERPOLATION_LINEAR && 2 * i < f->number_count && !has; i++) {
        const double t = f->numbers[2 * i], before = table_slope(f, i - 1), after = table_slope(f, i);
        has = t > 0.0 && t < duration && fabs(after - before) > 1e-9 * (fabs(after) + fabs(before));
    }
    return has;
}

/* Returns whether the value of a function, or with `slope` also its slope, may jump. */
static bool function_jumps(const kt_function *f, bool slope, double duration) {
    bool jumps = f->type == KT_FUNCTION_EXPRESSION && (may_jump(f->text) || (slope && formula_has_kink(f, duration)));
    jumps = jumps || (f->type == KT_FUNCTION_TABLE && slope && table_has_kink(f, duration));
    for (int i = 0; i < f->part_count && !jumps; i++)
        jumps = function_jumps(&f->parts[i], slope, duration);
    return jumps;
}

const char *kt_start_jumping(const kt_scene *scene, double duration) {
    const kt_description *d = &scene->description;
    for (int i = 0; i < d->loop_count; i++)
        if (function_jumps(&d->loops[i].function, d->loops[i].type != KT_LOOP_RATES, duration))
            return d->loops[i].name;
    return NULL;
}

bool kt_is_driven(const kt_description *description) {
    for (int i = 0; i < description->loop_count; i++) {
        const kt_loop *loop = &description->loops[i];
        const kt_function_type type = loop->function.type;
        if (type != KT_FUNCTION_NONE && (type != KT_FUNCTION_CONSTANT || loop->type == KT_LOOP_RATES))
            return true; /* a constant rate drives, too */
    }
    return false;
}
