/* Newton's equations of an implicit method, (sigma - J) x = r with J = f_y, and the iteration (newton.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_NEWTON_H
#define KT_INTEGRATOR_NEWTON_H

#include "base/block_words.h"
#include "integrator/integrator.h"

#include <float.h>

/* The most iterations of a try: with adaptive steps, and with fixed steps, which are iterated to rounding. */
enum { KT_NEWTON_ITERATIONS = 7, KT_NEWTON_ITERATIONS_FIXED = 50 };

/* With fixed steps, the size of a correction is relative to 4 eps |y|. Once corrections stop shrinking, their size
 * decides: up to KT_NEWTON_ROUNDED they are rounding of f, up to KT_NEWTON_TOLERATED (1e-7 of y) they are accepted and
 * counted (counts.capped), and above that the iteration has diverged. */
#define KT_NEWTON_ROUNDED 1e4
#define KT_NEWTON_TOLERATED 1e8

/* The most stages that are iterated at once. */
enum { KT_NEWTON_STAGES = 3 };

/* The origin of the Jacobian in use. */
typedef enum kt_jacobian_state {
    KT_JACOBIAN_NONE = 0,
    KT_JACOBIAN_KNOWN,
    KT_JACOBIAN_ZERO,    /* J could not be computed at (t_J, y_J), and there was none before: J = 0 */
    KT_JACOBIAN_LEFT_OUT /* J = 0: none can be computed, and with the old one iterations diverge or stages go wrong */
} kt_jacobian_state;

/* The numbers that determine the next step besides the state: the first part of an implicit method's history. */
typedef struct kt_newton_memory {
    double state;     /* a kt_jacobian_state */
    double requested; /* 1: the next step computes J at its start, instead of using the J of earlier steps */
    double time;      /* t_J */
    double step;      /* h for which sigma - J was factored; 0: for none */
    double ratio;     /* theta / (1 - theta) of the last iteration: the error left over the last correction */
} kt_newton_memory;

/* Ranges of these numbers, as entries of a list of kt_history_word. */
#define KT_NEWTON_WORDS                                                                                                \
    {"state of the Jacobian", KT_HISTORY_START, 0, KT_JACOBIAN_NONE, KT_JACOBIAN_LEFT_OUT},                            \
        {"new Jacobian", KT_HISTORY_START, 1, KT_BLOCK_YES_NO}, {                                                      \
        "ratio of corrections", KT_HISTORY_START, 4, 0.0, DBL_MAX                                                      \
    }

enum { KT_NEWTON_NUMBERS = sizeof(kt_newton_memory) / sizeof(double) };

/* Arrays of a try. The matrices exist only if the caller does not solve Newton's equations
 * (kt_integrator_options.newton). */
#define KT_NEWTON_FIELDS(X)                                                                                            \
    X(double, jacobian, matrix, "f_y, column-major")                                                                   \
    X(double, real, matrix, "factors of sigma - J for a real sigma")                                                   \
    X(double, re, matrix, "for a complex one: real parts")                                                             \
    X(double, im, matrix, "imaginary parts")                                                                           \
    X(int, pivot, pivots, "of the real one")                                                                           \
    X(int, pivot_complex, pivots, "of the complex one")                                                                \
    X(double, scale, n, "of the components in the norm of corrections")                                                \
    X(double, row, rows *n, "the method's own")

typedef struct kt_newton_work {
    kt_newton_memory now;            /* as of this try; the history has it from the last step */
    double slack;                    /* the tolerances of a try over those of the options */
    double factored;                 /* the step of the factors in memory; 0: none */
    double rate, worst;              /* theta of the try's iteration: mean and largest */
    double last_size, last_quotient; /* size of the corrections so far, and their quotient */
    double bare[KT_NEWTON_STAGES];   /* |r / sigma| of each stage, of the last iteration (kt_newton_store_residual) */
    double hidden, hidden_quotient;  /* the largest that is not tolerable, and its quotient; 0: all are */
    bool hides_residual;             /* the last correction hides a residual that is not tolerable */
    int iterations;                  /* iterations of the try */
    bool is_of_now;                  /* J was computed at the start of this step */
    bool damped;                     /* fixed steps: the simplified iteration has failed, and the damped one goes on */
    bool is_in_memory;               /* J is in memory */
    bool rejected;                   /* a try of this step was rejected */
    KT_ARENA_DECLARE(KT_NEWTON_FIELDS)
} kt_newton_work;

static inline kt_newton_work *kt_newton_of(const kt_integrator *it) { return (kt_newton_work *)(void *)it->scratch; }

/* Whether a try takes J = 0. */
static inline bool kt_newton_is_zero(const kt_newton_work *w) {
    return (int)w->now.state == KT_JACOBIAN_ZERO || (int)w->now.state == KT_JACOBIAN_LEFT_OUT;
}

/* One of the method's own vectors of a try. */
static inline double *kt_newton_row(const kt_integrator *it, int i) {
    return kt_newton_of(it)->row + (size_t)i * it->sizes.n;
}

/* The method's own part of the history. */
static inline double *kt_newton_history(const kt_integrator *it) {
    return it->history + KT_NEWTON_NUMBERS + it->sizes.n;
}

/* For `measure` of a family whose methods keep `rows` vectors of a try, and `history` numbers between steps. */
void kt_newton_measure(kt_integrator_sizes *sizes, size_t rows, size_t history);

/* Before a try: lays the scratch out and provides J. J of an earlier step is used again, unless a new J was requested,
 * or a try with an old J was rejected. Requires f(t, y) in slot 0. */
kt_try_result kt_newton_prepare(kt_integrator *it, bool rejected, kt_try *result);

/* Computes J at the start of this step, unless the J in use already is that. If J cannot be computed, the J of earlier
 * steps remains in use; without such a J, J = 0. */
kt_try_result kt_newton_refresh(kt_integrator *it, kt_try *result);

/* Factors sigma - J for the step h, unless the factors are in memory. sigma is real / h, and also pair / h unless
 * pair.im is 0.
 * Errors: KT_TRY_DIVERGED if a matrix is singular. */
kt_try_result kt_newton_factor(kt_integrator *it, double h, double real, kt_complex pair, kt_try *result);

/* Replaces r with (sigma - J)^-1 r, n values, using the factors of kt_newton_factor. Quadratures, on which f does not
 * depend, are divided by sigma. `im` NULL: the real system. */
kt_try_result kt_newton_solve(kt_integrator *it, kt_complex sigma, double *re, double *im, kt_try *result);

/* Begins a simplified Newton iteration. After each correction, kt_newton_test_convergence decides from the weighted
 * norm of the correction. KT_TRY_PASSED with *done ends the iteration; without *done the iteration continues.
 * KT_TRY_DIVERGED sets result->factor, the factor by which the step should be shorter. */
void kt_newton_begin(kt_integrator *it);
/* Records |r / sigma| of a stage with the residual r: the correction for J = 0. Must be called before
 * kt_newton_test_convergence if the correction with J may be small although the residual is large. */
void kt_newton_store_residual(kt_integrator *it, size_t stage, double bare);
kt_try_result kt_newton_test_convergence(kt_integrator *it, double size, bool *done, kt_try *result);

/* Reports that the iteration does not converge: the next step is shorter by `factor`. */
kt_try_result kt_newton_diverged(const kt_integrator *it, double factor, kt_try *result);

/* sum_i (x_i / scale_i)^2 */
double kt_newton_square(const kt_integrator *it, const double *x);

/* kt_newton_square for the correction x of a stage or its increment. With fixed steps the scale includes the size of
 * the corrected vector, which may be far larger than the state at the start of the step. */
double kt_newton_square_of(const kt_integrator *it, const double *x, const double *stage);

/* Returns KT_TRY_NOT_FINITE if the norm of a correction is not finite because of a component of x. */
kt_try_result kt_newton_check(const kt_integrator *it, const double *x, double t, double size, kt_try *result);

/* For one iteration of Newton's method without simplification: computes J at a stage (t, Y), with f in the slot, and
 * the factors of sigma - J. If J cannot be computed at this stage, the J in memory is used. */
kt_try_result kt_newton_relinearize(kt_integrator *it, double t, const double *stage, size_t slot, double sigma,
                                    kt_try *result);

/* Decides how a try continues that did not converge. The try continues (KT_TRY_PASSED) with the same step and J at the
 * present state. If J cannot be computed, the try continues without J, or fails. */
kt_try_result kt_newton_retry(kt_integrator *it, kt_try *result);

/* After a step, and before the first step of a motion. kt_newton_request_jacobian is called after kt_newton_accept: the
 * next step then begins with a new Jacobian. */
void kt_newton_accept(kt_integrator *it);
void kt_newton_request_jacobian(kt_integrator *it);
void kt_newton_discard(kt_integrator *it);

/* Forgets the Jacobian, and keeps the rest of the history. */
void kt_newton_renew(kt_integrator *it);

/* h_new / h after an accepted step, with the predictive control of Gustafsson: Hairer and Wanner IV.8 (8.20, 8.21). The
 * result is limited so that the next iteration does not fail. */
double kt_newton_control(const kt_integrator *it, double h, double error);

kt_status kt_newton_report(const kt_integrator *it, const char *where, kt_error *error);

/* Members of a family of methods with Newton's equations. */
#define KT_NEWTON_MEMBERS                                                                                              \
    .implicit = true, .start = kt_newton_discard, .prepare = kt_newton_prepare, .real_limit = kt_rational_limit,       \
    .imaginary_limit = kt_rational_limit

#endif
