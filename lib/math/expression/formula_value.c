/* Values of formulas, and their derivatives along a curve.
 *
 * An operation z = f(x, y) along a curve s has
 *     z'  = f_x x' + f_y y'
 *     z'' = f_x x'' + f_y y'' + f_xx x'^2 + 2 f_xy x' y' + f_yy y'^2.
 * An infinite partial derivative is ignored if its argument does not change. The root sqrt(0) has no slope, but a
 * constant under the root needs none.
 *
 * Intermediate values can exceed the largest number although the result is a number. Examples are log(1 + exp(8000)),
 * and the derivatives of 1 / cosh(8000). A result that is not finite is evaluated again, with numbers of any exponent
 * (wide.h).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/elementary.h"
#include "expression/expression.h"
#include "expression/formula_breakpoint.h"
#include "expression/lookup.h"
#include "expression/wide.h"

#include <math.h>
#include <string.h>

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* The value with wide numbers, for a usual value that is not finite. Returns the usual value if the wide one is not
 * finite. */
static double value_with_wide_numbers(const kt_expression *expression, const double *values, double usual) {
    double wide;
    kt_expression_wide(expression, values, NULL, NULL, 0, &wide);
    return isfinite(wide) ? wide : usual;
}

static kt_lookup_value lookup_of(const kt_expression_term *term, double x, double y) {
    const kt_lookup_piece piece = kt_lookup_piece_at(kt_lookup_of(term), x, y);
    return kt_lookup_evaluate(&piece, x, y);
}

/* The operators of sums and products come first, because most operators of a formula are sums and products. */
double kt_expression_evaluate(const kt_expression *expression, const double *values) {
    if (!expression)
        return (double)NAN;
    double stack[KT_EXPRESSION_DEPTH_MAX + 1];
    double *top = stack;
    *top = 0.0;
    const kt_expression_term *const end = expression->term + expression->count;
    for (const kt_expression_term *term = expression->term; term < end; term++)
        switch (term->code) {
        case KT_OPERATOR_NUMBER:
            *++top = term->number;
            break;
        case KT_OPERATOR_SYMBOL:
            *++top = values[term->symbol];
            break;
        case KT_OPERATOR_NEGATE:
            *top = -*top;
            break;
        case KT_OPERATOR_ADD:
            top--;
            top[0] += top[1];
            break;
        case KT_OPERATOR_SUBTRACT:
            top--;
            top[0] -= top[1];
            break;
        case KT_OPERATOR_MULTIPLY:
            top--;
            top[0] *= top[1];
            break;
        case KT_OPERATOR_LOOKUP:
            *top = lookup_of(term, *top, 0.0).z;
            break;
        case KT_OPERATOR_LOOKUP2:
            top--;
            *top = lookup_of(term, top[0], top[1]).z;
            break;
        default:
            if (kt_operator_is_binary((kt_operator)term->code)) {
                top--;
                top[0] = kt_operator_value((kt_operator)term->code, top[0], top[1]);
            } else {
                top[0] = kt_operator_value((kt_operator)term->code, top[0], 0.0);
            }
        }
    return isfinite(*top) ? *top : value_with_wide_numbers(expression, values, *top);
}

/* The index of the branch that an operation takes: 0, 1 or, for sign, 2. Smooth operations have the branch 0. */
static uint64_t branch_of(kt_operator code, double x, double y) {
    switch (code) {
    case KT_OPERATOR_ABS:
        return x > 0.0;
    case KT_OPERATOR_SIGN:
        return (uint64_t)(x > 0.0) + (uint64_t)(x >= 0.0);
    case KT_OPERATOR_STEP:
        return x >= 0.0;
    case KT_OPERATOR_MIN:
    case KT_OPERATOR_MAX:
    case KT_OPERATOR_LESS:
    case KT_OPERATOR_GREATER_EQUAL:
        return x < y;
    case KT_OPERATOR_LESS_EQUAL:
    case KT_OPERATOR_GREATER:
    case KT_OPERATOR_EQUAL:
    case KT_OPERATOR_NOT_EQUAL:
        return x <= y;
    default:
        return 0;
    }
}

/* The bits of the inputs at which the piece of a table begins. */
static uint64_t piece_of_table(const kt_expression_term *term, double x, double y) {
    const kt_lookup_piece piece = kt_lookup_piece_at(kt_lookup_of(term), x, y);
    uint64_t low[2];
    memcpy(low, piece.low, sizeof low);
    return low[0] ^ (low[1] << 1U);
}

uint64_t kt_expression_branches(const kt_expression *expression, const double *values) {
    static const uint64_t prime = 1099511628211U; /* Fowler, Noll and Vo */
    double stack[KT_EXPRESSION_DEPTH_MAX + 1] = {0.0};
    uint64_t hash = 14695981039346656037U;
    for (kt_postfix w = kt_postfix_begin(expression); kt_postfix_next(&w);) {
        if (w.is_leaf) {
            stack[w.at] = w.code == KT_OPERATOR_NUMBER ? w.term->number : values[w.term->symbol];
            continue;
        }
        const double x = stack[w.at], y = stack[w.other];
        const bool is_lookup = kt_operator_is_lookup(w.code);
        hash = (hash ^ (is_lookup ? piece_of_table(w.term, x, y) : branch_of(w.code, x, y))) * prime;
        stack[w.at] = is_lookup ? lookup_of(w.term, x, y).z : kt_operator_value(w.code, x, y);
    }
    return hash;
}

bool kt_expression_is_angle(const kt_expression *expression) { return expression && expression->is_angle; }

size_t kt_expression_symbols(const kt_expression *expression, size_t room, int *indices) {
    if (!expression)
        return 0;
    room = indices ? room : 0;
    size_t count = 0;
    for (size_t i = 0; i < expression->count; i++) {
        if (expression->term[i].code != KT_OPERATOR_SYMBOL)
            continue;
        if (count < room)
            indices[count] = expression->term[i].symbol;
        count++;
    }
    return count;
}

/* ---- derivatives ------------------------------------------------------------------------------------------------- */

/* Partial derivatives of an operation. Derivatives by y are zero for an operation of one argument. */
typedef struct kt_partials {
    double x, y, xx, xy, yy;
} kt_partials;

/* Derivatives of x^y. At x = 0 a constant exponent of 0 or 1 leaves no infinite terms. 0^y is 0 for a positive y. */
static kt_partials partials_of_power(double x, double y, double value) {
    kt_partials f = {.x = y == 0.0 ? 0.0 : y * pow(x, y - 1.0),
                     .xx = y == 0.0 || y == 1.0 ? 0.0 : y * (y - 1.0) * pow(x, y - 2.0)};
    const double l = value != 0.0 ? log(x) : 0.0;
    f.y = value * l;
    f.yy = f.y * l;
    f.xy = pow(x, y - 1.0) * (1.0 + y * l);
    return f;
}

/* With r the length of (x, y): derivatives of the angle atan2(x, y) of the point (y, x), and of r. */
static kt_partials partials_of_atan2(double x, double y) {
    const double r2 = x * x + y * y, a = y / r2, b = x / r2;
    return (kt_partials){.x = a, .y = -b, .xx = -2.0 * a * b, .xy = b * b - a * a, .yy = 2.0 * a * b};
}

static kt_partials partials_of_hypot(double x, double y, double r) {
    const double a = x / r, b = y / r;
    return (kt_partials){.x = a, .y = b, .xx = b * b / r, .xy = -a * b / r, .yy = a * a / r};
}

/* The partial derivatives of an operator at (x, y), with its value there; those not named are 0. */
static kt_partials partials_of(kt_operator code, double x, double y, double value) {
    const double square = value * value;
    switch (code) {
    case KT_OPERATOR_NEGATE:
        return (kt_partials){.x = -1.0};
    case KT_OPERATOR_ADD:
        return (kt_partials){.x = 1.0, .y = 1.0};
    case KT_OPERATOR_SUBTRACT:
        return (kt_partials){.x = 1.0, .y = -1.0};
    case KT_OPERATOR_MULTIPLY:
        return (kt_partials){.x = y, .y = x, .xy = 1.0};
    case KT_OPERATOR_DIVIDE:
        return (kt_partials){.x = 1.0 / y, .y = -value / y, .xy = -1.0 / (y * y), .yy = 2.0 * value / (y * y)};
    case KT_OPERATOR_POWER:
        return partials_of_power(x, y, value);
    case KT_OPERATOR_SIN:
        return (kt_partials){.x = cos(x), .xx = -value};
    case KT_OPERATOR_COS:
        return (kt_partials){.x = -sin(x), .xx = -value};
    case KT_OPERATOR_TAN:
        return (kt_partials){.x = 1.0 + square, .xx = 2.0 * value * (1.0 + square)};
    case KT_OPERATOR_ASIN:
        return (kt_partials){.x = 1.0 / sqrt(1.0 - x * x), .xx = x / ((1.0 - x * x) * sqrt(1.0 - x * x))};
    case KT_OPERATOR_ACOS:
        return (kt_partials){.x = -1.0 / sqrt(1.0 - x * x), .xx = -x / ((1.0 - x * x) * sqrt(1.0 - x * x))};
    case KT_OPERATOR_ATAN:
        return (kt_partials){.x = 1.0 / (1.0 + x * x), .xx = -2.0 * x / ((1.0 + x * x) * (1.0 + x * x))};
    case KT_OPERATOR_ATAN2:
        return partials_of_atan2(x, y);
    case KT_OPERATOR_SINH:
        return (kt_partials){.x = cosh(x), .xx = value};
    case KT_OPERATOR_COSH:
        return (kt_partials){.x = sinh(x), .xx = value};
    case KT_OPERATOR_TANH:
        return (kt_partials){.x = 1.0 - square, .xx = -2.0 * value * (1.0 - square)};
    case KT_OPERATOR_EXP:
        return (kt_partials){.x = value, .xx = value};
    case KT_OPERATOR_LOG:
        return (kt_partials){.x = 1.0 / x, .xx = -1.0 / (x * x)};
    case KT_OPERATOR_SQRT:
        return (kt_partials){.x = 0.5 / value, .xx = -0.25 / (value * x)};
    case KT_OPERATOR_ABS:
        return (kt_partials){.x = kt_sign_of(x)};
    case KT_OPERATOR_MIN:
    case KT_OPERATOR_MAX:
        return (kt_partials){.x = value == x ? 1.0 : 0.0, .y = value == x ? 0.0 : 1.0};
    case KT_OPERATOR_HYPOT:
        return partials_of_hypot(x, y, value);
    default: /* constant on each side of a jump */
        return (kt_partials){.x = 0.0};
    }
}

/* A value with its first and second derivative along the curve. */
typedef struct kt_taylor {
    double v, d, dd;
} kt_taylor;

/* A partial derivative may be infinite where its argument does not change; then it has no effect. */
static double partial_product(double partial, double change) { return change != 0.0 ? partial * change : 0.0; }

/* f' = f_x x' + f_y y',   f'' = f_x x'' + f_y y'' + f_xx x'^2 + 2 f_xy x' y' + f_yy y'^2 */
static kt_taylor apply_partials(double value, kt_partials f, kt_taylor x, kt_taylor y) {
    return (kt_taylor){
        .v = value,
        .d = partial_product(f.x, x.d) + partial_product(f.y, y.d),
        .dd = partial_product(f.x, x.dd) + partial_product(f.y, y.dd) + partial_product(f.xx, x.d * x.d) +
              2.0 * partial_product(f.xy, x.d * y.d) + partial_product(f.yy, y.d * y.d),
    };
}

static kt_taylor apply_operator(const kt_expression_term *term, kt_taylor x, kt_taylor y) {
    const kt_operator code = (kt_operator)term->code;
    if (kt_operator_is_lookup(code)) {
        const kt_lookup_value f = lookup_of(term, x.v, y.v);
        return apply_partials(f.z, (kt_partials){.x = f.x, .y = f.y, .xx = f.xx, .xy = f.xy}, x, y);
    }
    const double value = kt_operator_value(code, x.v, y.v);
    return apply_partials(value, partials_of(code, x.v, y.v, value), x, y);
}

/* The value of a number or a symbol. */
static kt_taylor taylor_of_leaf(const kt_expression_term *term, const double *values, const double *rates,
                                const double *second) {
    const int32_t k = term->symbol;
    if (term->code == KT_OPERATOR_NUMBER)
        return (kt_taylor){.v = term->number};
    return (kt_taylor){.v = values[k], .d = rates ? rates[k] : 0.0, .dd = second ? second[k] : 0.0};
}

/* Replaces the first number that is not finite, and the numbers after it, with finite numbers, computed with wide
 * numbers (wide.h). */
static void mend(const kt_expression *expression, const double *values, const double *rates, const double *second,
                 double out[3]) {
    double wide[3];
    kt_expression_wide(expression, values, rates, second, 2, wide);
    bool follows = false;
    for (int k = 0; k < 3; k++) {
        follows = follows || !isfinite(out[k]);
        if (follows && isfinite(wide[0]) && isfinite(wide[k]))
            out[k] = wide[k];
    }
}

void kt_expression_taylor(const kt_expression *expression, const double *values, const double *rates,
                          const double *second, double out[3]) {
    if (!expression || !out)
        return;
    kt_taylor stack[KT_EXPRESSION_DEPTH_MAX] = {{0.0, 0.0, 0.0}};
    const kt_taylor none = {.v = 0.0};
    for (kt_postfix w = kt_postfix_begin(expression); kt_postfix_next(&w);)
        stack[w.at] = w.is_leaf ? taylor_of_leaf(w.term, values, rates, second)
                                : apply_operator(w.term, stack[w.at], w.is_binary ? stack[w.other] : none);
    out[0] = stack[0].v;
    out[1] = stack[0].d;
    out[2] = stack[0].dd;
    if (!isfinite(out[0]) || !isfinite(out[1]) || !isfinite(out[2]))
        mend(expression, values, rates, second, out);
}
