/* Functions of time: their constructors, and their keys in scenes. The equations of functions are in curve.c. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/function.h"

#include "model/describe.h"

#include <stddef.h>

/* ---- constructors ------------------------------------------------------------------------------------------------ */

static kt_function function_of_type(kt_function_type type) {
    kt_function function = {.type = type, .numbers = NULL};
    return function;
}

kt_function kt_function_constant(double value) {
    kt_function function = function_of_type(KT_FUNCTION_CONSTANT);
    function.value = value;
    return function;
}

kt_function kt_function_sine(double amplitude, double frequency, double phase, double offset) {
    kt_function function = function_of_type(KT_FUNCTION_SINE);
    function.amplitude = amplitude;
    function.frequency = frequency;
    function.phase = phase;
    function.offset = offset;
    return function;
}

kt_function kt_function_ramp(double from, double to, double start, double end) {
    kt_function function = function_of_type(KT_FUNCTION_RAMP);
    function.from = from;
    function.to = to;
    function.start = start;
    function.end = end;
    return function;
}

kt_function kt_function_polynomial(const double *coefficients, int count) {
    kt_function function = function_of_type(KT_FUNCTION_POLYNOMIAL);
    function.numbers = coefficients;
    function.number_count = count;
    return function;
}

kt_function kt_function_table(const double *rows, int number_count, kt_interpolation interpolation) {
    kt_function function = function_of_type(KT_FUNCTION_TABLE);
    function.numbers = rows;
    function.number_count = number_count;
    function.interpolation = interpolation;
    return function;
}

kt_function kt_function_bump(double height, double start, double end) {
    kt_function function = function_of_type(KT_FUNCTION_BUMP);
    function.amplitude = height;
    function.start = start;
    function.end = end;
    return function;
}

static kt_function function_of_parts(kt_function_type type, const kt_function *parts, int part_count) {
    kt_function function = function_of_type(type);
    function.parts = parts;
    function.part_count = part_count;
    return function;
}

kt_function kt_function_sum(const kt_function *parts, int part_count) {
    return function_of_parts(KT_FUNCTION_SUM, parts, part_count);
}

kt_function kt_function_product(const kt_function *parts, int part_count) {
    return function_of_parts(KT_FUNCTION_PRODUCT, parts, part_count);
}

kt_function kt_function_expression(const char *text) {
    kt_function function = function_of_type(KT_FUNCTION_EXPRESSION);
    function.text = text;
    return function;
}

/* ---- descriptors ------------------------------------------------------------------------------------------------- */

/* In the keys, y denotes the unit of the function's value. */
#define AT(member) offsetof(kt_function, member)
static const kt_key constant_keys[] = {
    {"value", KT_KEY_NUMBER, AT(value), "y", "a; a plain number is this function, too", .needed = true},
};
static const kt_key sine_keys[] = {
    {"amplitude", KT_KEY_NUMBER, AT(amplitude), "y", "A", .needed = true},
    {"frequency", KT_KEY_NUMBER, AT(frequency), "Hz", "f", .range = KT_RANGE_NOT_NEGATIVE, .needed = true},
    {"phase", KT_KEY_NUMBER, AT(phase), "rad", "phi", .needed = false},
    {"offset", KT_KEY_NUMBER, AT(offset), "y", "y0", .needed = false},
};
static const kt_key ramp_keys[] = {
    {"from", KT_KEY_NUMBER, AT(from), "y", "a, the value until `start`", .needed = true},
    {"to", KT_KEY_NUMBER, AT(to), "y", "b, the value from `end` on", .needed = true},
    {"start", KT_KEY_NUMBER, AT(start), "s", "t0", .needed = true},
    {"end", KT_KEY_NUMBER, AT(end), "s", "t1, later than `start`", .needed = true},
};
static const kt_key bump_keys[] = {
    {"height", KT_KEY_NUMBER, AT(amplitude), "y", "A, the value in the middle", .needed = true},
    {"start", KT_KEY_NUMBER, AT(start), "s", "t0", .needed = true},
    {"end", KT_KEY_NUMBER, AT(end), "s", "t1, later than `start`", .needed = true},
};
static const kt_key sum_keys[] = {
    {"sum", KT_KEY_PARTS, AT(parts), "y", "[f, g, ...]: functions of time of any type", .needed = true},
};
static const kt_key product_keys[] = {
    {"product", KT_KEY_PARTS, AT(parts), "y", "[f, g, ...]: functions of time of any type", .needed = true},
};
static const kt_key expression_keys[] = {
    {"text", KT_KEY_FORMULA, AT(text), "y", "a formula of t and parameters; a plain text is this function, too",
     .needed = true},
};
static const kt_key polynomial_keys[] = {
    {"polynomial", KT_KEY_LIST, AT(numbers), "y, y/s, y/s^2, ...", "[c0, c1, c2, ...]", .needed = true},
};
static const kt_key table_keys[] = {
    {"table", KT_KEY_ROWS, AT(numbers), "s, y", "[[t0, y0], [t1, y1], ...] with increasing times", .needed = true},
    {"interpolation", KT_KEY_METHOD, AT(interpolation), "", "`linear`, `cubic` or `monotone`", "linear",
     .needed = false},
};
#undef AT

/* A scene with a motor whose torque is the given function. */
#define MOTOR(function)                                                                                                \
    "bodies:\n"                                                                                                        \
    "  - {name: crank, joint: {type: revolute, axis: y}, mass: 1, shape: {type: rod, to: [0.3, 0, 0]}}\n"              \
    "effects:\n"                                                                                                       \
    "  - {type: motor, joint: crank, torque: " function "}\n"

static const kt_descriptor descriptors[] = {
    [KT_FUNCTION_CONSTANT] =
        {
            .name = "constant",
            .help = "the same value at all times",
            .formula = "y = a",
            .example = MOTOR("1.5"),
            .keys = constant_keys,
            .key_count = 1,
        },
    [KT_FUNCTION_SINE] =
        {
            .name = "sine",
            .help = "a harmonic oscillation about an offset",
            .formula = "y = y0 + A sin(2 pi f t + phi)",
            .example = MOTOR("{sine: {amplitude: 1, frequency: 0.5, phase: 90 deg, offset: 1.5}}"),
            .keys = sine_keys,
            .key_count = 4,
        },
    [KT_FUNCTION_RAMP] =
        {
            .name = "ramp",
            .help = "from one value to another, with continuous slope",
            .formula = "y = a + (b - a) s^2 (3 - 2 s),  s = (t - t0) / (t1 - t0), from 0 to 1;  y'' jumps at t0 and t1",
            .example = MOTOR("{ramp: {from: 0, to: 2, start: 0.2, end: 0.6}}"),
            .keys = ramp_keys,
            .key_count = 4,
        },
    [KT_FUNCTION_POLYNOMIAL] =
        {
            .name = "polynomial",
            .help = "a polynomial of time",
            .formula = "y = c0 + c1 t + c2 t^2 + ...",
            .example = MOTOR("{polynomial: [0, 3, -3]}"),
            .keys = polynomial_keys,
            .key_count = 1,
        },
    [KT_FUNCTION_TABLE] =
        {
            .name = "table",
            .help = "interpolation between rows; constant before the first row and after the last one",
            .formula =
                "linear:    straight lines; the slope jumps at rows, so not for motions\n"
                "cubic:     the natural spline, with continuous y, y', y''; it overshoots: rows of 0, 0, 90, 90\n"
                "           degrees, 1 s apart, give -11.5 to 101.5 degrees\n"
                "monotone:  cubics with continuous y, y' that stay between the values of neighbouring rows",
            .example = MOTOR("{table: [[0, 0], [0.3, 2], [1, 1]], interpolation: monotone}"),
            .keys = table_keys,
            .key_count = 2,
        },
    [KT_FUNCTION_BUMP] =
        {
            .name = "bump",
            .help = "up and back once, with continuous slope and second derivative",
            .formula = "y = A (4 s (1 - s))^3,  s = (t - t0) / (t1 - t0), from 0 to 1",
            .example = MOTOR("{bump: {height: 2, start: 0.2, end: 0.6}}"),
            .keys = bump_keys,
            .key_count = 3,
        },
    [KT_FUNCTION_SUM] =
        {
            .name = "sum",
            .help = "the sum of functions of time",
            .formula = "y = f(t) + g(t) + ...",
            .example = MOTOR("{sum: [1, {sine: {amplitude: 1, frequency: 0.5}}]}"),
            .keys = sum_keys,
            .key_count = 1,
        },
    [KT_FUNCTION_PRODUCT] =
        {
            .name = "product",
            .help = "the product of functions of time",
            .formula = "y = f(t) g(t) ...",
            .example = MOTOR("{product: [{ramp: {from: 0, to: 1, start: 0, end: 0.5}}, {sine: {amplitude: 2, "
                             "frequency: 2}}]}"),
            .keys = product_keys,
            .key_count = 1,
        },
    [KT_FUNCTION_EXPRESSION] =
        {
            .name = "expression",
            .help = "a formula of t and parameters; steps end at its breakpoints and where its shape turns",
            .formula = "y = f(t)    + - * / ^, comparisons, sin cos tan asin acos atan atan2 sinh cosh tanh exp\n"
                       "            log sqrt abs sign min max hypot step(x) clamp(x, a, b)",
            .example = MOTOR("\"2*exp(-t)*sin(2*pi*t)\""),
            .keys = expression_keys,
            .key_count = 1,
        },
};

const kt_descriptor *kt_function_descriptor(kt_function_type type) {
    return type > KT_FUNCTION_NONE && (size_t)type < sizeof descriptors / sizeof *descriptors ? &descriptors[type]
                                                                                              : NULL;
}
