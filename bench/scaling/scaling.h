/* One line of the table: the cost of a chain of n links. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_SCALING_H
#define KT_BENCH_SCALING_H

#include "chain.h"
#include "report.h"

enum {
    KT_SCALING_RNEA,
    KT_SCALING_ABA,
    KT_SCALING_RK4,
    KT_SCALING_CRBA,
    KT_SCALING_DERIVATIVES,
    KT_SCALING_BIAS,     /* J' v of the last link's end, after kinematics */
    KT_SCALING_TERMS,    /* of M^-1 */
    KT_SCALING_COLUMN,   /* M^-1 x */
    KT_SCALING_FORWARD,  /* derivatives of forward dynamics, da/dtau among them */
    KT_SCALING_MATRICES, /* A and B of a step of rk4 */
    KT_SCALING_MOTION,   /* 50 steps */
    KT_SCALING_GRADIENT, /* of a cost over these, by all inputs */
    KT_SCALING_REGRESSOR,
    KT_SCALING_CLOSED_FORWARD, /* the last four but the regressor, of a row of windows */
    KT_SCALING_CLOSED_MATRICES,
    KT_SCALING_CLOSED_MOTION,
    KT_SCALING_CLOSED_GRADIENT,
    KT_SCALING_CALLS
};
extern const char *const kt_scaling_call[KT_SCALING_CALLS]; /* names */

enum { KT_SCALING_MASS_MAX = 2000 }; /* longest chain whose mass matrix is filled: nv^2 numbers, 32 MB */

typedef struct kt_scaling_line {
    int n;
    kt_isa isa;
    bool measured[KT_SCALING_CALLS];
    kt_bench_times times[KT_SCALING_CALLS];
    double set_up;                  /* s: description, model, data */
    size_t model, data, integrator; /* bytes */
    long allocations;               /* in two calls of each kind, after set-up */
    double error;                   /* of the way there and back; see scaling.c */
} kt_scaling_line;

/* Fills a line. On failure *error holds the reason. */
KT_CHECKED kt_status kt_scaling_measure(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error);

/* Fills one line for each instruction-set level that there is, RNEA and ABA only, timed in turns; *count of them, at
 * most KT_SCALING_ISAS. */
enum { KT_SCALING_ISAS = 3 };
KT_CHECKED kt_status kt_scaling_compare_isas(int n, const kt_bench_options *options,
                                             kt_scaling_line lines[KT_SCALING_ISAS], int *count, kt_error *error);

/* Fills a line with ABA and its derivatives, da/dq and da/dv together, timed in turns. */
KT_CHECKED kt_status kt_scaling_derive(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error);

/* Fills a line with the time of ABA and the times of operational space relative to it, timed in turns. */
KT_CHECKED kt_status kt_scaling_control(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error);

/* Fills a line with RNEA and the regressor, timed in turns. */
KT_CHECKED kt_status kt_scaling_regressor(int n, const kt_bench_options *options, kt_scaling_line *line,
                                          kt_error *error);

/* Fills a line with derivatives of forward dynamics, A and B of a step, a motion and a gradient over it. */
KT_CHECKED kt_status kt_scaling_steps(int n, const kt_bench_options *options, kt_scaling_line *line, kt_error *error);

/* The same of a row of windows, four-bars that share their cranks. */
KT_CHECKED kt_status kt_scaling_closed_steps(int loops, const kt_bench_options *options, kt_scaling_line *line,
                                             kt_error *error);

#endif
