/* Newton's equations of an implicit method, (sigma - J) x = r with J = f_y, and the iteration (newton.c). */
#ifndef KT_INTEGRATOR_NEWTON_H
#define KT_INTEGRATOR_NEWTON_H

#include "integrator/integrator.h"

/* The most iterations of a try: with adaptive steps, and with fixed ones, which are iterated to rounding. */
enum { KT_NEWTON_ITERATIONS = 7, KT_NEWTON_ITERATIONS_FIXED = 50 };

/* The most stages that are iterated at once. */
enum { KT_NEWTON_STAGES = 3 };

/* Where the Jacobian in use was computed. */
typedef enum kt_jacobian_state {
    KT_JACOBIAN_NONE = 0,
    KT_JACOBIAN_KNOWN,
    KT_JACOBIAN_ZERO,    /* it could not be computed at (t_J, y_J), and there was none before: J = 0 */
    KT_JACOBIAN_LEFT_OUT /* none can be computed, and by that of (t_J, y_J) iterations diverge or stages go wrong: J = 0 */
} kt_jacobian_state;

/* The numbers that determine the next step besides the state: the first part of an implicit method's history. */
typedef struct kt_newton_memory {
    double state;  /* a kt_jacobian_state */
    double wanted; /* 1: the next step begins with a new Jacobian */
    double time;   /* t_J */
    double step;   /* h for which sigma - J was factored; 0: for none */
    double ratio;  /* theta / (1 - theta) of the last iteration: the error left over the last correction */
} kt_newton_memory;

enum { KT_NEWTON_NUMBERS = sizeof(kt_newton_memory) / sizeof(double) };

/* Arrays of a try. The matrices are there only if the caller does not solve (kt_integrator_options.newton). */
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
    double last_size, last_quotient; /* of the corrections so far */
    double bare[KT_NEWTON_STAGES];   /* |r / sigma| of each stage, of the last iteration (kt_newton_note) */
    double hidden, hidden_quotient;  /* the largest that is not tolerable, and its quotient; 0: all are */
    bool hides;                      /* the last correction hides what is not tolerable */
    int iterations;                  /* of the try */
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

/* Before a try: lays the scratch out and makes J known: that of earlier steps, or a new one where that is wanted or
 * where a try with an old one was rejected. Requires f(t, y) in slot 0. */
kt_try_result kt_newton_prepare(kt_integrator *it, size_t rows, bool rejected, kt_try *result);

/* J at the start of this step, unless it is that already. */
kt_try_result kt_newton_refresh(kt_integrator *it, kt_try *result);

/* Factors sigma - J for the step h, unless they are known: for sigma = real / h, and for pair / h unless pair.im is 0.
 * KT_TRY_DIVERGED where a matrix is singular. */
kt_try_result kt_newton_factor(kt_integrator *it, double h, double real, kt_complex pair, kt_try *result);

/* r becomes (sigma - J)^-1 r with the factors of kt_newton_factor, n values; quadratures, on which f does not depend,
 * are divided by sigma. `im` NULL: the real system. */
kt_try_result kt_newton_solve(kt_integrator *it, kt_complex sigma, double *re, double *im, kt_try *result);

/* A simplified Newton iteration. Begins one; then, after each correction, kt_newton_judge decides by its weighted norm:
 * KT_TRY_PASSED with *done, or without: go on; KT_TRY_DIVERGED with result->factor, how much shorter the step should
 * be. */
void kt_newton_begin(kt_integrator *it);
/* Before kt_newton_judge, where J may hide what is left of the residual r of a stage: |r / sigma|, its correction if J
 * was 0. */
void kt_newton_note(kt_integrator *it, size_t stage, double bare);
kt_try_result kt_newton_judge(kt_integrator *it, double size, bool *done, kt_try *result);

/* sum_i (x_i / scale_i)^2 */
double kt_newton_square(const kt_integrator *it, const double *x);

/* The same of the correction x of a stage or its increment. With fixed steps the scale knows the size of what is
 * corrected: it may be far larger than the state at the start of the step. */
double kt_newton_square_of(const kt_integrator *it, const double *x, const double *stage);

/* KT_TRY_NOT_FINITE where the norm of a correction is not finite because of a component of x. */
kt_try_result kt_newton_check(const kt_integrator *it, const double *x, double t, double size, kt_try *result);

/* For one iteration of Newton's method without simplification: J at a stage (t, Y), where f is in the slot, and the
 * factors of sigma - J. Where J cannot be computed there, that in memory serves. */
kt_try_result kt_newton_relinearize(kt_integrator *it, double t, const double *stage, size_t slot, double sigma,
                                    kt_try *result);

/* How a try that did not converge goes on: with J as of now and the same step (KT_TRY_PASSED), without J where it cannot be
 * computed now, or not at all. */
kt_try_result kt_newton_retry(kt_integrator *it, kt_try *result);

/* After a step, and before the first one of a motion. kt_newton_want, after the first: the next step begins with a new
 * Jacobian. */
void kt_newton_accept(kt_integrator *it);
void kt_newton_want(kt_integrator *it);
void kt_newton_forget(kt_integrator *it);

/* Forgets the Jacobian, and leaves the rest of the history. */
void kt_newton_renew(kt_integrator *it);

/* h_new / h after an accepted step, with the predictive control of Gustafsson: Hairer and Wanner IV.8 (8.20, 8.21); not
 * so long that the iteration would fail. */
double kt_newton_control(const kt_integrator *it, double h, double error);

kt_status kt_newton_report(const kt_integrator *it, const char *where, kt_error *error);

#endif
