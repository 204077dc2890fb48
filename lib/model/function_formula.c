/* Functions of time that are made of others, and formulas.
 *
 *   bump     y = a u^3 with u = 4 s (1 - s), s = (t - c) / (d - c): with u' = 4 (1 - 2 s) / (d - c) and
 *            u'' = -8 / (d - c)^2,  y' = 3 a u^2 u',  y'' = 3 a (2 u u'^2 + u^2 u'')
 *   sum      y = f + g,  y' = f' + g',  y'' = f'' + g''
 *   product  y = f g,  y' = f' g + f g',  y'' = f'' g + 2 f' g' + f g''
 *
 * The numbers of a sum or product are the curves of its parts, and then those parts' numbers; those of a formula are its
 * terms. Neither contains a pointer, so that a model can be copied.
 */
#include "model/function_formula.h"

#include "expression/corner.h"

#include <math.h>
#include <string.h>

enum { CURVE_NUMBERS = sizeof(kt_curve) / sizeof(double) };
_Static_assert(sizeof(kt_curve) % sizeof(double) == 0 && _Alignof(kt_expression) <= _Alignof(double),
               "curves and formulas lie among numbers");

/* ---- compilation ------------------------------------------------------------------------------------------------- */

static bool find_time(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    *symbol = (kt_symbol){.index = 0};
    return strcmp(name, "t") == 0;
}

static const char *list_time(void *user, int k) {
    (void)user;
    return k == 0 ? "t" : NULL;
}

kt_status kt_formula_of_time(const char *text, void *memory, size_t size, const kt_expression **expression, int *column,
                             kt_error *error) {
    const kt_symbols symbols = {.find = find_time, .list = list_time};
    return kt_expression_parse(text, &symbols, memory, size, expression, column, error);
}

size_t kt_curve_formula_numbers(const kt_function *function) {
    size_t count = 0;
    if (function->type == KT_FUNCTION_EXPRESSION)
        return (kt_expression_size(function->text) + sizeof(double) - 1) / sizeof(double);
    if (function->type != KT_FUNCTION_SUM && function->type != KT_FUNCTION_PRODUCT)
        return 0;
    for (int i = 0; i < function->part_count; i++)
        count += CURVE_NUMBERS + kt_curve_number_count(&function->parts[i]);
    return count;
}

static void compile_parts(const kt_function *function, double *numbers, kt_curve *curve) {
    size_t at = curve->first + (size_t)function->part_count * CURVE_NUMBERS;
    curve->count = function->part_count;
    for (int i = 0; i < function->part_count; i++) {
        const kt_curve part = kt_curve_compile(&function->parts[i], numbers, at);
        memcpy(numbers + curve->first + (size_t)i * CURVE_NUMBERS, &part, sizeof part);
        at += kt_curve_number_count(&function->parts[i]);
    }
}

void kt_curve_formula_compile(const kt_function *function, double *numbers, kt_curve *curve) {
    const kt_expression *expression = NULL;
    if (function->type == KT_FUNCTION_BUMP) {
        curve->a = function->amplitude;
        curve->c = function->start;
        curve->d = function->end;
    } else if (function->type == KT_FUNCTION_EXPRESSION) {
        const kt_status status = kt_formula_of_time(function->text, numbers + curve->first,
                                                    kt_expression_size(function->text), &expression, NULL, NULL);
        if (status != KT_OK) /* GCOVR_EXCL_BR_LINE: the check of the description has read it */
            curve->type = KT_FUNCTION_NONE;
    } else {
        compile_parts(function, numbers, curve);
    }
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static kt_curve part_of(const kt_curve *curve, const double *numbers, int i) {
    kt_curve part;
    memcpy(&part, numbers + curve->first + (size_t)i * CURVE_NUMBERS, sizeof part);
    return part;
}

static const kt_expression *formula_of(const kt_curve *curve, const double *numbers) {
    return (const kt_expression *)(const void *)(numbers + curve->first);
}

static void evaluate_bump(const kt_curve *curve, double t, double out[3]) {
    const double length = curve->d - curve->c, s = (t - curve->c) / length, a = 3.0 * curve->a;
    if (!(s > 0.0 && s < 1.0)) {
        out[0] = out[1] = out[2] = 0.0;
        return;
    }
    const double u = 4.0 * s * (1.0 - s), d1 = 4.0 * (1.0 - 2.0 * s) / length, d2 = -8.0 / (length * length);
    out[0] = curve->a * u * u * u;
    out[1] = a * u * u * d1;
    out[2] = a * u * (2.0 * d1 * d1 + u * d2);
}

void kt_curve_formula_evaluate(const kt_curve *curve, const double *numbers, double t, double out[3]) {
    static const double rate = 1.0;
    if (curve->type == KT_FUNCTION_BUMP) {
        evaluate_bump(curve, t, out);
        return;
    }
    if (curve->type == KT_FUNCTION_EXPRESSION) {
        kt_expression_taylor(formula_of(curve, numbers), &t, &rate, NULL, out);
        return;
    }
    const bool is_sum = curve->type == KT_FUNCTION_SUM;
    double f[3] = {is_sum ? 0.0 : 1.0, 0.0, 0.0}, g[3];
    for (int i = 0; i < curve->count; i++) {
        const kt_curve part = part_of(curve, numbers, i);
        kt_curve_evaluate(&part, numbers, t, g);
        f[2] = is_sum ? f[2] + g[2] : f[2] * g[0] + 2.0 * f[1] * g[1] + f[0] * g[2];
        f[1] = is_sum ? f[1] + g[1] : f[1] * g[0] + f[0] * g[1];
        f[0] = is_sum ? f[0] + g[0] : f[0] * g[0];
    }
    memcpy(out, f, sizeof f);
}

double kt_curve_formula_speed(const kt_curve *curve, const double *numbers, double t) {
    double y[3] = {0.0, 0.0, 0.0}, size = 1.0, speed = 0.0;
    if (curve->type == KT_FUNCTION_BUMP) {
        evaluate_bump(curve, t, y);
        return fabs(y[1]);
    }
    if (curve->type == KT_FUNCTION_EXPRESSION)
        return kt_expression_speed(formula_of(curve, numbers), t);
    for (int i = 0; i < curve->count; i++) {
        const kt_curve part = part_of(curve, numbers, i);
        const double of_part = kt_curve_speed(&part, numbers, t);
        kt_curve_evaluate(&part, numbers, t, y);
        speed = curve->type == KT_FUNCTION_SUM ? speed + of_part : speed * fabs(y[0]) + size * of_part;
        size *= fabs(y[0]);
    }
    return speed;
}

/* ---- corners ----------------------------------------------------------------------------------------------------- */

kt_corner kt_curve_formula_corner(const kt_curve *curve, const double *numbers, double t) {
    kt_corner first = {HUGE_VAL, KT_CORNER_ORDER_MAX};
    if (curve->type == KT_FUNCTION_BUMP)
        return (kt_corner){t < curve->c ? curve->c : t < curve->d ? curve->d : HUGE_VAL, KT_CORNER_ORDER_MAX};
    if (curve->type == KT_FUNCTION_EXPRESSION) {
        first.time = kt_expression_next_corner(formula_of(curve, numbers), t, &first.order);
        return first;
    }
    for (int i = 0; i < curve->count; i++) {
        const kt_curve part = part_of(curve, numbers, i);
        const kt_corner corner = kt_curve_next_corner(&part, numbers, t);
        if (corner.time < first.time || (corner.time == first.time && corner.order < first.order))
            first = corner;
    }
    return first;
}

/* The quarter period of a product of sines of frequencies f and g is that of f + g, which it has. */
double kt_curve_formula_longest_step(const kt_curve *curve, const double *numbers) {
    double longest = HUGE_VAL, inverse = 0.0;
    for (int i = 0; i < curve->count; i++) {
        const kt_curve part = part_of(curve, numbers, i);
        const double length = kt_curve_longest_step(&part, numbers);
        longest = fmin(longest, length);
        inverse += 1.0 / length;
    }
    return curve->type == KT_FUNCTION_PRODUCT && inverse > 0.0 ? 1.0 / inverse : longest;
}
