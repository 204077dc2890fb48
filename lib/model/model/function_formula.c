/* Functions of time that are bumps or formulas.
 *
 *   bump     y = a u^3 with u = 4 s (1 - s), s = (t - c) / (d - c): with u' = 4 (1 - 2 s) / (d - c) and
 *            u'' = -8 / (d - c)^2,  y' = 3 a u^2 u',  y'' = 3 a (2 u u'^2 + u^2 u'')
 *
 * The numbers of a formula are its terms. The numbers contain no pointer, so that a model can be copied.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/function_formula.h"

#include "expression/formula_breakpoint.h"

#include <math.h>
#include <string.h>

_Static_assert(_Alignof(kt_expression) <= _Alignof(double), "formulas lie among numbers");

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

kt_symbols kt_time_symbols(void) { return (kt_symbols){.find = find_time, .list = list_time}; }

kt_status kt_formula_of_time(const char *text, void *memory, size_t size, const kt_expression **expression, int *column,
                             kt_error *error) {
    const kt_symbols symbols = kt_time_symbols();
    return kt_expression_parse(text, &symbols, memory, size, expression, column, error);
}

size_t kt_curve_formula_numbers(const kt_function *function) {
    if (function->type != KT_FUNCTION_EXPRESSION)
        return 0;
    return (kt_expression_size(function->text) + sizeof(double) - 1) / sizeof(double);
}

void kt_curve_formula_compile(const kt_function *function, double *numbers, kt_curve *curve) {
    const kt_expression *expression = NULL;
    if (function->type == KT_FUNCTION_BUMP) {
        curve->a = function->amplitude;
        curve->c = function->start;
        curve->d = function->end;
    } else {
        const kt_status status = kt_formula_of_time(function->text, numbers + curve->first,
                                                    kt_expression_size(function->text), &expression, NULL, NULL);
        if (status != KT_OK) /* GCOVR_EXCL_BR_LINE: the check of the description has read it */
            curve->type = KT_FUNCTION_NONE;
    }
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static const kt_expression *curve_formula_of(const kt_curve *curve, const double *numbers) {
    return (const kt_expression *)(const void *)(numbers + curve->first);
}

/* A bump of height a between the times c and d: a u^3 with a parabola u that vanishes at both ends, so that the first
 * two derivatives vanish there, too. out: the value and these derivatives. */
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
    kt_expression_taylor(curve_formula_of(curve, numbers), &t, &rate, NULL, out);
}

double kt_curve_formula_speed(const kt_curve *curve, const double *numbers, double t) {
    double y[3];
    if (curve->type == KT_FUNCTION_BUMP) {
        evaluate_bump(curve, t, y);
        return fabs(y[1]);
    }
    return kt_expression_speed(curve_formula_of(curve, numbers), t);
}

/* ---- breakpoints ------------------------------------------------------------------------------------------------- */

kt_breakpoint kt_curve_formula_breakpoint(const kt_curve *curve, const double *numbers, double t, double until,
                                          int64_t *left) {
    kt_breakpoint first = {HUGE_VAL, KT_BREAKPOINT_ORDER_MAX};
    if (curve->type == KT_FUNCTION_BUMP)
        return (kt_breakpoint){t < curve->c ? curve->c : t < curve->d ? curve->d : HUGE_VAL, KT_BREAKPOINT_ORDER_MAX};
    first.time = kt_expression_next_breakpoint(curve_formula_of(curve, numbers), t, until, left, &first.order);
    return first;
}
