/* The declarations that the files of the differential-algebraic baselines share.
 *
 * For n tangent coordinates and m independent equations, the N unknowns of a stage are y = (xi, v, lambda, mu). The
 * positions xi are relative to the positions q at the start of the step, q (+) xi. The type ggl alone has mu.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STUDY_DAE_H
#define KT_STUDY_DAE_H

#include "compare/formulation.h"

/* Stages that are solved together: three of Radau IIA. */
enum { KT_DAE_STAGES = 3 };

/* Every array: type, name, count, meaning. `most` is the largest N of a stage, `all` the N of all stages together. */
#define KT_DAE_FIELDS(X)                                                                                               \
    X(int32_t, row, k, "the independent equations")                                                                    \
    X(bool, holonomic, k, "equations with a residual")                                                                 \
    X(double, q, nq, "positions at t")                                                                                 \
    X(double, v, n, "velocities at t")                                                                                 \
    X(double, multiplier, k, "lambda at t, of all equations")                                                          \
    X(double, mu, k, "at t, of the independent ones")                                                                  \
    X(double, slope, 2 * n, "xi' and v' at t")                                                                         \
    X(double, past_q, nq, "positions a step before")                                                                   \
    X(double, past_slope, 2 * n, "u and v' there")                                                                     \
    X(double, past_v, n, "velocities there")                                                                           \
    X(double, base, KT_DAE_STAGES * 2 * n, "of xi and v in each stage: what is known")                                 \
    X(double, y, all, "unknowns of all stages")                                                                        \
    X(double, residual, all, "F of all stages")                                                                        \
    X(double, rate, 2 * n, "xi' and v' of a stage")                                                                    \
    X(double, by_state, most * 2 * n, "dF/d(xi, v) of a stage")                                                        \
    X(double, by_rest, most *most, "dF/dy' and dF/d(lambda, mu)")                                                      \
    X(double, moved, most, "F at a neighbouring state")                                                                \
    X(double, matrix, all *all, "Newton's")                                                                            \
    X(double, factor, all *all, "its factors")                                                                         \
    X(int, pivot, all, "of these")                                                                                     \
    X(double, stage_q, nq, "positions of a stage")                                                                     \
    X(double, u, 2 * n, "v + A' mu; and xi' of it")                                                                    \
    X(double, stage_y, most, "a neighbouring stage")                                                                   \
    X(double, svd, all *all + 7 * all, "left vectors and singular values; of LAPACK")

struct kt_dae {
    void *owned; /* memory of kt_dae_create */
    const kt_model *model;
    kt_data *data;
    kt_constraint_formulation *equations; /* M, f, A, phi, b', b'' at a state, and the choice of equations */
    kt_dae_options options;
    size_t n, nq, k, m;   /* nv, nq, equations, independent ones */
    size_t size;          /* N */
    int stages;           /* stages of the matrix */
    double t, past_h;     /* time; length of the last step, 0: none */
    bool started, solved; /* a state exists; a matrix exists */
    kt_dae_counts counts;
    KT_ARENA_DECLARE(KT_DAE_FIELDS)
};

/* F(y, y') at a time: y of a stage (N), rate = (xi', v'). */
KT_CHECKED kt_status kt_dae_evaluate(kt_dae *dae, double t, const double *y, const double *rate, double *residual,
                                     kt_error *error);

/* dF/d(xi, v) by central differences, and all other derivatives exactly, at a stage. */
KT_CHECKED kt_status kt_dae_differentiate(kt_dae *dae, double t, const double *y, const double *rate, kt_error *error);

/* xi' for q (+) xi that changes with u: u but for rotations. */
void kt_dae_tangent_rate(const kt_model *model, const double *xi, const double *u, double *rate);

#endif
