/* Closed mechanisms of any size: four-bars hung on a chain, each a group of its own, and those whose loops share
 * bodies, one group.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_BARS_H
#define KT_BENCH_BARS_H

#include "kinetree/study.h"

/* ROW: rods hung on one another, as many as the number of loops, and no loop. ROPE: so many rods, held at both ends, in
 * a plane, in space, with spherical joints. SCISSORS: a lift of so many stages. LADDER: two chains of so many rods in
 * space, and rods of given length between them. NET: the same of three chains in a plane. GRID: three rows of so many
 * windows above each other. BRANCHES: so many links of a binary tree, each with a row of three windows. FORK: so many
 * windows, after each of which the row forks. FREER: a row of so many windows of five bars, each of which adds a
 * freedom. SPHERICAL: a row of so many windows whose axes meet in one point. BENNETT: a row of so many of Bennett's
 * linkages. */
typedef enum kt_bars_shape {
    KT_BARS_SEPARATE = 0,
    KT_BARS_CHAINED,
    KT_BARS_ROW,
    KT_BARS_ROPE,
    KT_BARS_ROPE_IN_SPACE,
    KT_BARS_ROPE_OF_BALLS,
    KT_BARS_SCISSORS,
    KT_BARS_LADDER,
    KT_BARS_NET,
    KT_BARS_GRID,
    KT_BARS_BRANCHES,
    KT_BARS_FORK,
    KT_BARS_FREER,
    KT_BARS_SPHERICAL,
    KT_BARS_BENNETT,
    KT_BARS_SHAPES
} kt_bars_shape;
extern const char *const kt_bars_shape_name[KT_BARS_SHAPES];

/* Ready to be evaluated, assembled and moving, in one formulation. */
typedef struct kt_bars {
    int loops;
    kt_model *model;         /* as described */
    kt_absolute *absolute;   /* its absolute formulation, or NULL */
    const kt_model *stepped; /* which of the two is evaluated */
    kt_data *data;
    double *q, *v, *a; /* nq, nv, nv of `stepped` */
    double *moved;     /* nq + 2 nv: another state, and the difference */
    double set_up;     /* seconds of processor time to describe and to compile it */
    kt_error error;    /* the first failure of a call below; KT_OK: none */
} kt_bars;

/* Allocates all of it; open: without the loops. On failure *bars is empty and *error holds the reason. */
KT_CHECKED kt_status kt_bars_make(kt_bars_shape shape, int loops, bool open, kt_formulation formulation,
                                  const kt_model_options *options, kt_bars *bars, kt_error *error);
void kt_bars_free(kt_bars *bars);

/* Task for kt_bench_measure, on kt_bars: a from the state, once. */
void kt_bars_accelerate(void *bars, long repetitions);

/* The same: projects a state that is 1e-6 of a radian or metre away, as after a step; assembles one that is 1e-3
 * away. */
void kt_bars_project(void *bars, long repetitions);
void kt_bars_assemble(void *bars, long repetitions);

/* Returns the power of the loops at rest as a part of the total power: |v . tau| / sum |v_i h_i| with tau = RNEA(a).
 * Returns NaN if a call fails. */
double kt_bars_idle_work(kt_bars *bars);

#endif
