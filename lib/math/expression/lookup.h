/* Lookup tables of formulas, compiled into numbers; and tables of one input, which functions of time have, too. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_EXPRESSION_LOOKUP_H
#define KT_EXPRESSION_LOOKUP_H

#include "base/inner.h"
#include "expression/expression.h"

#include <stdint.h>

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* A compiled row of a table of one input: the polynomial y + s (b + s (c + s d)), s = x - row[KT_PIECE_X], which is
 * valid up to the next row. */
enum { KT_PIECE_X, KT_PIECE_Y, KT_PIECE_B, KT_PIECE_C, KT_PIECE_D, KT_PIECE_SIZE };

/* The slopes at the ends of a table. */
typedef enum kt_row_ends {
    KT_ROW_ENDS_FREE,  /* they follow from the rows */
    KT_ROW_ENDS_GIVEN, /* the caller states them; for cubic tables */
    KT_ROW_ENDS_JOINED /* the last row is the first row of the next period */
} kt_row_ends;

/* Compiles the points x, y, x, y, ... with increasing x, `count` of them, at least 2. Fills count * KT_PIECE_SIZE
 * numbers of `rows`. slopes: those of KT_ROW_ENDS_GIVEN. O(count). */
void kt_rows_compile(const double *points, int count, kt_interpolation interpolation, kt_row_ends ends,
                     const double *slopes, double *rows);

/* The row that begins the piece at x, or the nearest row that begins a piece. O(log count). */
int kt_rows_find(const double *rows, int count, double x);

/* ---- lookup tables ----------------------------------------------------------------------------------------------- */

/* The polynomial that a table is near one input, or near two: with s = x - at[0] and r = y - at[1],
 *     one input   c0 + s (c1 + s (c2 + s c3))
 *     two inputs  c0 + c1 s + r (c2 + c3 s)
 * low and high bound the inputs for which this polynomial is valid. All c are NaN outside the rows of a table that
 * rejects such inputs. */
typedef struct kt_lookup_piece {
    int inputs;
    double at[2], c[4], low[2], high[2];
} kt_lookup_piece;

/* The values and derivatives of a piece. The derivative yy is 0, since a piece of two inputs is bilinear. */
typedef struct kt_lookup_value {
    double z, x, y, xx, xy;
} kt_lookup_value;

/* The compiled table of a term; NULL: the table was not compiled when the formula was parsed. Terms contain a distance
 * in place of a pointer, so that a model can be copied. */
static inline const double *kt_lookup_of(const kt_expression_term *term) {
    return term->number == 0.0 ? NULL : (const double *)(const void *)term + (int64_t)term->number;
}

/* Sets the table of a term at its final place. */
static inline void kt_lookup_attach(kt_expression_term *term, const double *table) {
    const int64_t apart = ((intptr_t)table - (intptr_t)term) / (int64_t)sizeof(double);
    term->number = table == NULL ? 0.0 : (double)apart;
}

/* Copies terms, which keep their tables. */
static inline void kt_expression_copy_terms(const kt_expression_term *from, size_t count, kt_expression_term *to) {
    for (size_t i = 0; i < count; i++) {
        to[i] = from[i];
        if (kt_operator_is_lookup((kt_operator)from[i].code))
            kt_lookup_attach(&to[i], kt_lookup_of(&from[i]));
    }
}

/* The piece of a table (NULL: all c are NaN) at an input x, or at two. O(log rows). */
KT_INNER kt_lookup_piece kt_lookup_piece_at(const double *table, double x, double y);

KT_INNER kt_lookup_value kt_lookup_evaluate(const kt_lookup_piece *piece, double x, double y);

/* The size of a compiled table, and its parts: rows of one input, or the values of x, the values of y, and the grid. */
enum { KT_LOOKUP_INPUTS, KT_LOOKUP_INTERPOLATION, KT_LOOKUP_OUTSIDE, KT_LOOKUP_NX, KT_LOOKUP_NY, KT_LOOKUP_HEAD };
KT_INNER size_t kt_lookup_size(const double *table);

/* Returns how many numbers a compiled table takes. O(rows). */
size_t kt_lookup_numbers(const kt_lookup *lookup);

/* Compiles a table into kt_lookup_numbers(lookup) numbers. kt_lookup_check must have accepted the table. O(rows). */
void kt_lookup_compile(const kt_lookup *lookup, double *numbers);

/* Writes the reason for which a table cannot be compiled, and returns false. */
KT_INNER bool kt_lookup_check(const kt_lookup *lookup, char *text, size_t size);

#endif
