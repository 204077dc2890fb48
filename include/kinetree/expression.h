/* Formulas in text, "0.01*L + sin(2*pi*t)": read once, then evaluated without reading, allocating or looking up a name.
 *
 *     static bool find(void *user, const char *name, kt_symbol *symbol) {
 *         *symbol = (kt_symbol){.index = 0};
 *         return strcmp(name, "t") == 0;
 *     }
 *
 * and then
 *
 *     double time = 0.5, memory[64];
 *     const kt_symbols symbols = {.find = find};
 *     const kt_expression *formula = NULL;
 *     status = kt_expression_parse("1 + t^2", &symbols, memory, sizeof memory, &formula, NULL, &error);
 *     if (status == KT_OK)
 *         printf("%g\n", kt_expression_evaluate(formula, &time));
 *
 * Grammar, weakest operators first:
 *     comparison   sum [(< | <= | > | >= | == | !=) sum]                   1 if it holds, else 0
 *     sum          product {(+ | -) product}
 *     product      factor {(* | /) factor}
 *     factor       (- | +) factor | primary [^ factor]                     -2^2 is -4, 2^3^2 is 2^9
 *     primary      number [deg | rad] | name | function(arguments) | (comparison)
 * A number is decimal, 1e-3. A name begins with a letter or _, and may have letters, digits, _, dots and [k]; hyphens too,
 * where the name with them is known: a-b is a difference unless there is a symbol 'a-b'. `pi` is known. Angles are in
 * radians, and `30 deg` is one.
 */
#ifndef KINETREE_EXPRESSION_H
#define KINETREE_EXPRESSION_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The functions: X(id, name, least and largest number of arguments). step(x) is 1 if x >= 0, else 0; clamp(x, a, b) is
 * min(max(x, a), b); sign(0) is 0. */
#define KT_EXPRESSION_FUNCTION_LIST(X)                                                                                 \
    X(SIN, sin, 1, 1)                                                                                                  \
    X(COS, cos, 1, 1)                                                                                                  \
    X(TAN, tan, 1, 1)                                                                                                  \
    X(ASIN, asin, 1, 1)                                                                                                \
    X(ACOS, acos, 1, 1)                                                                                                \
    X(ATAN, atan, 1, 1)                                                                                                \
    X(ATAN2, atan2, 2, 2)                                                                                              \
    X(SINH, sinh, 1, 1)                                                                                                \
    X(COSH, cosh, 1, 1)                                                                                                \
    X(TANH, tanh, 1, 1)                                                                                                \
    X(EXP, exp, 1, 1)                                                                                                  \
    X(LOG, log, 1, 1)                                                                                                  \
    X(SQRT, sqrt, 1, 1)                                                                                                \
    X(ABS, abs, 1, 1)                                                                                                  \
    X(SIGN, sign, 1, 1)                                                                                                \
    X(MIN, min, 2, 16)                                                                                                 \
    X(MAX, max, 2, 16)                                                                                                 \
    X(HYPOT, hypot, 2, 2)                                                                                              \
    X(STEP, step, 1, 1)                                                                                                \
    X(CLAMP, clamp, 3, 3)

/* Bounds of a formula. */
enum {
    KT_EXPRESSION_LENGTH_MAX = 4096, /* bytes of the text */
    KT_EXPRESSION_DEPTH_MAX = 64,    /* values that wait for their operator, and parentheses within one another */
    KT_EXPRESSION_NAME_MAX = 255     /* bytes of a name */
};

/* A formula that has been read; immutable, to be shared freely between threads. */
typedef struct kt_expression kt_expression;

/* What a name of a formula stands for. */
typedef struct kt_symbol {
    int index;     /* of its value in the array that evaluation is given, from 0 */
    bool is_angle; /* it is an angle, or a rate of one: see kt_expression_is_angle */
    bool is_fixed; /* it stands for `number`, which the formula then holds, and has no index */
    double number; /* of a fixed one */
} kt_symbol;

/* The names that a formula may use. */
typedef struct kt_symbols {
    /* Finds a name; returns false if there is none. NULL: there are no names. */
    bool (*find)(void *user, const char *name, kt_symbol *symbol);
    /* The k-th name, k from 0, for "did you mean"; NULL beyond the last. May itself be NULL: nothing is suggested. */
    const char *(*list)(void *user, int k);
    void *user; /* what both are given */
} kt_symbols;

/* Returns the bytes of memory that a formula of this text takes at most; 0 if text is NULL. O(length). */
KT_API size_t kt_expression_size(const char *text);

/* Reads a terminated text into `size` bytes of memory, aligned as for a double and of at least kt_expression_size(text);
 * *expression then points into it. symbols may be NULL. On failure *expression is untouched, *column (which may be NULL)
 * is that of the character at fault, from 1, and the message says how to mend it. Errors: KT_ERROR_SCENE (the text is no
 * formula, a name is unknown, a bound is exceeded), KT_ERROR_MEMORY, KT_ERROR_ARGUMENT. O(length) and a search for each
 * name. */
KT_API KT_CHECKED kt_status kt_expression_parse(const char *text, const kt_symbols *symbols, void *memory, size_t size,
                                                const kt_expression **expression, int *column, kt_error *error);

/* Whether the result is an angle by its units: a sum or a multiple of numbers with deg or rad, or of symbols that are
 * angles. Products and ratios of angles, and what functions return, count as plain numbers. */
KT_API bool kt_expression_is_angle(const kt_expression *expression);

/* Writes the indices of the symbols that the formula uses, in the order of the text and once for each time, as far as
 * there is room (indices may be NULL if room is 0). Returns how many there are. O(length). */
KT_API size_t kt_expression_symbols(const kt_expression *expression, size_t room, int *indices);

/* The value, with values[k] for the symbol of index k; values may be NULL if no symbol is used. What is not defined is
 * NaN or infinite, as in C's math library. Allocates nothing. O(length). */
KT_API double kt_expression_evaluate(const kt_expression *expression, const double *values);

/* Value, first and second derivative along a curve values(s) with the given first and second derivatives by s: out[0],
 * out[1] and out[2]. With t as the only symbol, rates {1} and second {0}: a function of time and its derivatives. rates
 * and second may be NULL (zero). They are exact, by the chain rule in each operation; those of abs, sign, min, max,
 * step, clamp and comparisons are those of the branch that is taken. Allocates nothing. O(length). */
KT_API void kt_expression_taylor(const kt_expression *expression, const double *values, const double *rates,
                                 const double *second, double out[3]);

#ifdef __cplusplus
}
#endif
#endif
