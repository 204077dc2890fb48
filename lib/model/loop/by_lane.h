/* The equations of one loop, for code that is compiled for one state or for several (algebra/real3.h). Types are
 * compiled for one state alone. For several states, by_lane.c evaluates one state after the other. Some 30 numbers go
 * in and 50 come out, of the thousands that an evaluation of a mechanism computes. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LOOP_BY_LANE_H
#define KT_LOOP_BY_LANE_H

#include "algebra/real.h"
#include "base/isa.h"

#ifdef KT_LANES
typedef kt_real3 kt_vector; /* vector type from which loop.h makes ends and rows of several states */
#endif

#include "loop/loop.h"

/* The arrays that several states read and write: x[number * width + lane]. */
typedef struct kt_loop_lanes {
    size_t width;
    const double *t;
    const double *end[2]; /* axes, point, omega, velocity, turn; of a relation end[0] is the sum */
    double *row;          /* moment, force, residual, rate, drift; of a relation the last three */
    size_t row_stride;    /* from a row to the next one */
} kt_loop_lanes;

/* Like the functions of kt_loop_kind. *flags: for each row a bit, set if the row is holonomic. */
#define KT_LOOP_BY_LANE_DECLARE(isa)                                                                                   \
    int kt_loop_evaluate_by_lane_##isa(const kt_loop_record *loop, const double *numbers, const kt_loop_lanes *at,     \
                                       unsigned *flags);                                                               \
    double kt_loop_relate_by_lane_##isa(const kt_loop_record *loop, const double *numbers, const kt_loop_lanes *at);
KT_EACH_ISA(KT_LOOP_BY_LANE_DECLARE)
#undef KT_LOOP_BY_LANE_DECLARE

#ifdef KT_LANES

/* As kt_relation_row. */
typedef struct kt_relation1 {
    kt_real1 residual, rate, drift;
    double closes;
} kt_relation1;

#define KT_OF_ONE(name) KT_PASTE(name##_by_lane_, KT_ISA)

KT_INLINE int kt_loop_evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], kt_real1 t,
                               kt_loop_row *rows) {
    const kt_loop_lanes at = {.width = KT_LANES,
                              .t = (const double *)&t,
                              .end = {(const double *)&end[0], (const double *)&end[1]},
                              .row = (double *)rows,
                              .row_stride = sizeof *rows / sizeof(double)};
    unsigned flags = 0;
    const int count = KT_OF_ONE(kt_loop_evaluate)(loop, numbers, &at, &flags);
    for (int r = 0; r < count; r++)
        rows[r].holonomic = (flags >> r & 1U) != 0;
    return count;
}

KT_INLINE kt_relation1 kt_loop_relate(const kt_loop_record *loop, const double *numbers, kt_real1 sum, kt_real1 t) {
    kt_relation1 row;
    const kt_loop_lanes at = {
        .width = KT_LANES, .t = (const double *)&t, .end = {(const double *)&sum}, .row = (double *)&row};
    row.closes = KT_OF_ONE(kt_loop_relate)(loop, numbers, &at);
    /* cppcheck-suppress uninitvar ; written through `at` */
    return row;
}

#undef KT_OF_ONE

/* A loop's function of time, and its two derivatives. */
KT_INLINE void kt_loop_function(const kt_loop_record *loop, const double *numbers, kt_real1 t, kt_real1 out[3]) {
    for (int lane = 0; lane < KT_LANES; lane++) {
        double f[3];
        kt_curve_evaluate(&loop->curve, numbers, t[lane], f);
        for (int k = 0; k < 3; k++)
            out[k][lane] = f[k];
    }
}

#elif defined(KT_ISA) && !defined(KT_DUAL)

typedef kt_relation_row kt_relation1;

KT_INLINE int kt_loop_evaluate(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                               kt_loop_row *rows) {
    return KT_KERNEL(kt_loop_kinds)[loop->kind]->evaluate(loop, numbers, end, t, rows);
}

KT_INLINE kt_relation1 kt_loop_relate(const kt_loop_record *loop, const double *numbers, double sum, double t) {
    return KT_KERNEL(kt_loop_kinds)[loop->kind]->relate(loop, numbers, sum, t);
}

KT_INLINE void kt_loop_function(const kt_loop_record *loop, const double *numbers, double t, double out[3]) {
    kt_curve_evaluate(&loop->curve, numbers, t, out);
}

#endif

#endif
