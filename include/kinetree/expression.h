/* Experimental. Formulas in text, "0.01*L + sin(2*pi*t)". A formula is parsed once. Its evaluation does not parse,
 * allocate memory or search for names.
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
 *
 *     condition    conjunction {or conjunction}                            of comparisons
 *     conjunction  negation {and negation}                                 of conditions
 *     negation     not negation | comparison
 *     comparison   sum [(< | <= | > | >= | == | !=) sum]                   1 if it holds, else 0
 *     sum          product {(+ | -) product}                               from left to right
 *     product      factor {(* | /) factor}                                 from left to right
 *     factor       (- | +) factor | primary [^ factor]                     -2^2 is -4, 2^3^2 is 2^9
 *     primary      number [deg | rad] | name | function(arguments) | table(arguments) | (condition)
 *
 * A number is decimal, such as 1e-3. A name begins with a letter or _, and may have letters, digits, _, dots and [k].
 * A name may have hyphens, too, if a symbol with this name exists: a-b is a difference unless there is a symbol 'a-b'.
 * The constant `pi` is predefined. Angles are in radians, and `30 deg` is one. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_EXPRESSION_H
#define KINETREE_EXPRESSION_H

#include "kinetree/lookup.h"
#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The functions: X(id, name, least and largest number of arguments). The function step(x) is 1 if x >= 0 and
 * otherwise zero. The function clamp(x, a, b) is min(max(x, a), b), and sign(0) is 0. */
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
    KT_EXPRESSION_DEPTH_MAX = 64,    /* values that wait for their operator, and nested parentheses */
    KT_EXPRESSION_NAME_MAX = 600     /* bytes of a name: two names of 255 bytes with the words around them */
};

/* A parsed formula; immutable, so that threads can share it. */
typedef struct kt_expression kt_expression;

/* The meaning of a name in a formula. */
typedef struct kt_symbol {
    int index;     /* of its value in the array `values` of an evaluation, from 0 */
    bool is_angle; /* it is an angle, or a rate of one: see kt_expression_is_angle */
    bool is_fixed; /* it is a constant, `number`, which the formula then contains; it has no index */
    double number; /* the value of a constant */
} kt_symbol;

/* The names that a formula may use. */
typedef struct kt_symbols {
    /* Finds a name; returns false if there is none. NULL: there are no names. */
    bool (*find)(void *user, const char *name, kt_symbol *symbol);
    /* Returns the k-th name, k from 0, for "did you mean"; NULL beyond the last. May be NULL: messages suggest no name.
     */
    const char *(*list)(void *user, int k);
    void *user;              /* passed to both */
    const kt_lookup *tables; /* the tables that a formula may call; NULL: none. A name of `find` hides a table */
    int table_count;         /* length of tables */
    const double *compiled;  /* for the library, which compiles the tables of models. NULL: calls of tables yield NaN */
} kt_symbols;

/* Returns the bytes of memory that a formula of this text takes at most; 0 if text is NULL. O(length). */
KT_API size_t kt_expression_size(const char *text);

/* Parses a terminated text into `size` bytes of memory. *expression then points into this memory. symbols may be NULL.
 * The memory is aligned as for a double and has at least kt_expression_size(text) bytes.
 *
 * Errors: *expression is untouched after an error, and the message includes the remedy.
 *   KT_ERROR_SCENE: the text is no formula, a name is unknown, or a bound is exceeded. *column (which may be NULL) then
 *     receives the column of the faulty character, from 1.
 *   KT_ERROR_MEMORY: the memory is too small or misaligned.
 *   KT_ERROR_ARGUMENT: a pointer is NULL.
 *
 * Cost: O(length) and a search for each name. */
KT_API KT_CHECKED kt_status kt_expression_parse(const char *text, const kt_symbols *symbols, void *memory, size_t size,
                                                const kt_expression **expression, int *column, kt_error *error);

/* Returns whether the result is an angle by its units. An angle is a sum or a multiple of numbers with deg or rad, or
 * of symbols that are angles. Products and ratios of angles, and results of functions, count as plain numbers. */
KT_API bool kt_expression_is_angle(const kt_expression *expression);

/* Writes the indices of the symbols that the formula uses, in the order of the text and once for each use. Writes at
 * most `room` indices (indices may be NULL if room is 0). Returns the number of all uses. O(length). */
KT_API size_t kt_expression_symbols(const kt_expression *expression, size_t room, int *indices);

/* Returns the value, with values[k] for the symbol of index k. values may be NULL if no symbol is used. An undefined
 * result is NaN or infinite, as in C's math library. Allocates nothing. O(length). */
KT_API double kt_expression_evaluate(const kt_expression *expression, const double *values);

/* Computes the value, first and second derivative along a curve values(s), in this order in out. The arrays rates
 * and second hold the first and second derivatives of values by s. Both may be NULL (zero). If t is the only symbol,
 * rates {1} and second {0} give a function of time and its derivatives.
 *
 * The derivatives are exact, by the chain rule in each operation. For abs, sign, min, max, step, clamp and comparisons,
 * the derivatives are those of the active branch. Allocates nothing. O(length). */
KT_API void kt_expression_taylor(const kt_expression *expression, const double *values, const double *rates,
                                 const double *second, double out[3]);

#ifdef __cplusplus
}
#endif
#endif
