/* Lookup tables of one input or two, which formulas call by their names, such as a cam or an engine map.
 *
 * Units: SI and radians.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_LOOKUP_H
#define KINETREE_LOOKUP_H

#include "kinetree/status.h"

#ifdef __cplusplus
extern "C" {
#endif

/* The interpolation between the rows of a table: straight lines, a cubic spline, or cubics without overshoot. */
typedef enum kt_interpolation {
    KT_INTERPOLATION_LINEAR = 0 /* lines */,
    KT_INTERPOLATION_CUBIC /* spline */,
    KT_INTERPOLATION_MONOTONE /* cubics without overshoot */
} kt_interpolation;

/* The value of a lookup table for an input before its first row, or behind its last row. */
typedef enum kt_outside {
    KT_OUTSIDE_REJECT = 0, /* none: the formula has no value, which is an error */
    KT_OUTSIDE_HOLD,       /* the value at the edge */
    KT_OUTSIDE_EXTEND,     /* a straight line with the slope at the edge */
    KT_OUTSIDE_REPEAT      /* the table repeats itself, as over the turns of a cam */
} kt_outside;

/* A lookup table, which formulas call by its name: `lift(position.cam)` or `torque(speed, throttle)`.
 *
 * With one input, rows are x, z with increasing x; the interpolations are those of kt_function_table. A cubic table
 * that repeats itself is twice continuously differentiable at its ends, too. With two inputs, rows are x, y, z: a
 * complete grid, in the order of x, and for each x in the order of y. Within a cell of the grid the table is bilinear:
 * z = a + b x + c y + d x y. */
typedef struct kt_lookup {
    const char *name;               /* as a parameter's: letters, digits and _ */
    int inputs;                     /* 1 or 2 */
    const double *rows;             /* inputs + 1 numbers each; at most 1e100 in size */
    int row_count;                  /* 2 to KT_LOOKUP_ROWS_MAX */
    kt_interpolation interpolation; /* with two inputs linear */
    kt_outside outside;             /* for inputs outside the rows; with two inputs not KT_OUTSIDE_REPEAT */
} kt_lookup;

/* The largest number of rows of a lookup table. */
enum { KT_LOOKUP_ROWS_MAX = 1000000 /* rows */ };

#ifdef __cplusplus
}
#endif
#endif
