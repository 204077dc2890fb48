/* The third derivative of a formula along a line. An operation of one value z = f(x) has
 *     z' = f' x',   z'' = f' x'' + f'' x'^2,   z''' = f' x''' + 3 f'' x' x'' + f''' x'^3      (Faa di Bruno)
 * Products follow Leibniz' rule, and the other operations of two values are made of these:
 *     x / y = x y^-1,   x^y = e^(y log x),   hypot = (x^2 + y^2)^(1/2),   atan2' = (x' y - x y') / (x^2 + y^2)
 * An infinite derivative is ignored if its argument does not change, as in evaluate.c.
 */
#include "expression/third.h"
#include "expression/wide.h"

#include <math.h>

/* A value and its first three derivatives along the line. */
typedef struct series {
    double d[4];
} series;

static series constant(double value) { return (series){{value, 0.0, 0.0, 0.0}}; }

static double times(double partial, double change) { return change != 0.0 ? partial * change : 0.0; }

/* f: a function's value and derivatives at x. */
static series compose(const double f[4], const series *x) {
    const double a = x->d[1], b = x->d[2], c = x->d[3];
    return (series){{f[0], times(f[1], a), times(f[1], b) + times(f[2], a * a),
                     times(f[1], c) + 3.0 * times(f[2], a * b) + times(f[3], a * a * a)}};
}

static series sum(const series *x, double factor, const series *y) {
    series z;
    for (int k = 0; k < 4; k++)
        z.d[k] = x->d[k] + factor * y->d[k];
    return z;
}

static series product(const series *x, const series *y) {
    const double *a = x->d, *b = y->d;
    return (series){{a[0] * b[0], a[1] * b[0] + a[0] * b[1], a[2] * b[0] + 2.0 * a[1] * b[1] + a[0] * b[2],
                     a[3] * b[0] + 3.0 * (a[2] * b[1] + a[1] * b[2]) + a[0] * b[3]}};
}

/* x^p; terms whose factor is zero have no power. */
static series power(const series *x, double p) {
    double f[4], factor = 1.0;
    for (int k = 0; k < 4; k++) {
        f[k] = factor == 0.0 ? 0.0 : factor * pow(x->d[0], p - k);
        factor *= p - k;
    }
    return compose(f, x);
}

static series quotient(const series *x, const series *y) {
    const series inverse = power(y, -1.0);
    series z = product(x, &inverse);
    z.d[0] = x->d[0] / y->d[0];
    return z;
}

/* ---- functions of one value -------------------------------------------------------------------------------------- */

/* The function 1 / sqrt(1 - x^2) and its derivatives: those of asin from the first on. */
static void derivatives_of_asin(double x, double f[4]) {
    const double w = 1.0 - x * x, r = 1.0 / sqrt(w);
    f[1] = r;
    f[2] = x * r / w;
    f[3] = (1.0 + 2.0 * x * x) * r / (w * w);
}

static void derivatives_of(kt_operator code, double x, double f[4]) {
    const double v = f[0], w = 1.0 + x * x, u = 1.0 + v * v, m = 1.0 - v * v;
    switch (code) {
    case KT_OPERATOR_SIN:
    case KT_OPERATOR_COS:
        f[1] = code == KT_OPERATOR_SIN ? cos(x) : -sin(x);
        f[2] = -v;
        f[3] = -f[1];
        break;
    case KT_OPERATOR_TAN:
        f[1] = u;
        f[2] = 2.0 * v * u;
        f[3] = 2.0 * u * (1.0 + 3.0 * v * v);
        break;
    case KT_OPERATOR_ASIN:
    case KT_OPERATOR_ACOS:
        derivatives_of_asin(x, f);
        for (int k = 1; k < 4 && code == KT_OPERATOR_ACOS; k++)
            f[k] = -f[k];
        break;
    case KT_OPERATOR_ATAN:
        f[1] = 1.0 / w;
        f[2] = -2.0 * x / (w * w);
        f[3] = (6.0 * x * x - 2.0) / (w * w * w);
        break;
    case KT_OPERATOR_SINH:
    case KT_OPERATOR_COSH:
        f[1] = f[3] = code == KT_OPERATOR_SINH ? cosh(x) : sinh(x);
        f[2] = v;
        break;
    case KT_OPERATOR_TANH:
        f[1] = m;
        f[2] = -2.0 * v * m;
        f[3] = -2.0 * m * (1.0 - 3.0 * v * v);
        break;
    case KT_OPERATOR_EXP:
        f[1] = f[2] = f[3] = v;
        break;
    case KT_OPERATOR_LOG:
        f[1] = 1.0 / x;
        f[2] = -1.0 / (x * x);
        f[3] = 2.0 / (x * x * x);
        break;
    case KT_OPERATOR_ABS:
        f[1] = (x > 0.0) - (x < 0.0);
        break;
    default: /* constant on each side of a jump */
        break;
    }
}

static series of_one(kt_operator code, const series *x, double value) {
    double f[4] = {value, 0.0, 0.0, 0.0};
    if (code == KT_OPERATOR_NEGATE)
        return (series){{-x->d[0], -x->d[1], -x->d[2], -x->d[3]}};
    if (code == KT_OPERATOR_SQRT)
        return power(x, 0.5);
    derivatives_of(code, x->d[0], f);
    return compose(f, x);
}

/* ---- functions of two values ------------------------------------------------------------------------------------- */

static bool is_constant(const series *x) { return x->d[1] == 0.0 && x->d[2] == 0.0 && x->d[3] == 0.0; }

static series raise(const series *x, const series *y) {
    double f[4] = {log(x->d[0]), 0.0, 0.0, 0.0};
    if (is_constant(y))
        return power(x, y->d[0]);
    derivatives_of(KT_OPERATOR_LOG, x->d[0], f);
    const series logarithm = compose(f, x), exponent = product(y, &logarithm);
    for (int k = 0; k < 4; k++)
        f[k] = pow(x->d[0], y->d[0]);
    return compose(f, &exponent);
}

static series square_sum(const series *x, const series *y) {
    const series a = product(x, x), b = product(y, y);
    return sum(&a, 1.0, &b);
}

/* The angle of (y, x), its first argument first. */
static series angle(const series *x, const series *y, double value) {
    const series dx = {{x->d[1], x->d[2], x->d[3], 0.0}}, dy = {{y->d[1], y->d[2], y->d[3], 0.0}};
    const series a = product(&dx, y), b = product(x, &dy), turning = sum(&a, -1.0, &b), square = square_sum(x, y);
    const series rate = quotient(&turning, &square);
    return (series){{value, rate.d[0], rate.d[1], rate.d[2]}};
}

static series of_two(kt_operator code, const series *x, const series *y, double value) {
    switch (code) {
    case KT_OPERATOR_ADD:
        return sum(x, 1.0, y);
    case KT_OPERATOR_SUBTRACT:
        return sum(x, -1.0, y);
    case KT_OPERATOR_MULTIPLY:
        return product(x, y);
    case KT_OPERATOR_DIVIDE:
        return quotient(x, y);
    case KT_OPERATOR_POWER:
        return raise(x, y);
    case KT_OPERATOR_ATAN2:
        return angle(x, y, value);
    case KT_OPERATOR_HYPOT: {
        const series square = square_sum(x, y);
        return power(&square, 0.5);
    }
    case KT_OPERATOR_MIN:
    case KT_OPERATOR_MAX:
        return value == x->d[0] ? *x : *y;
    default:
        return constant(value);
    }
}

double kt_expression_third(const kt_expression *expression, const double *values, const double *rates) {
    series stack[KT_EXPRESSION_DEPTH_MAX] = {{{0.0}}};
    int top = -1;
    for (size_t i = 0; i < expression->count; i++) {
        const kt_expression_term *term = &expression->term[i];
        const kt_operator code = (kt_operator)term->code;
        if (code == KT_OPERATOR_NUMBER) {
            stack[++top] = constant(term->number);
        } else if (code == KT_OPERATOR_SYMBOL) {
            stack[++top] = (series){{values[term->symbol], rates[term->symbol], 0.0, 0.0}};
        } else if (kt_operator_is_binary(code)) {
            top--;
            const series *x = &stack[top], *y = &stack[top + 1];
            stack[top] = of_two(code, x, y, kt_operator_value(code, x->d[0], y->d[0]));
        } else {
            stack[top] = of_one(code, &stack[top], kt_operator_value(code, stack[top].d[0], 0.0));
        }
    }
    const double *d = stack[0].d;
    if (isfinite(d[0]) && isfinite(d[1]) && isfinite(d[2]) && isfinite(d[3]))
        return d[3];
    double wide[4];
    kt_expression_wide(expression, values, rates, NULL, 3, wide);
    return isfinite(wide[3]) ? wide[3] : d[3];
}
