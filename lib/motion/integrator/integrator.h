/* Declarations that the files of this folder share.
 *
 *     integrator.c         an integrator in the caller's memory: options, start, dense output, checkpoints
 *     step.c               one accepted step, for any family of methods
 *     step_control.c       the step size
 *     try.c                functions of every family for a tried step: slopes evaluated and checked, norms, errors
 *
 *     method_list.c        the list of methods
 *     method.c             the properties of a method that its family determines
 *     method_table.c       the properties of a method that its table determines
 *     tables/              coefficients, one const struct per method
 *     order.c              rooted trees and order conditions
 *     stability.c          linear stability: growth of modes, and the longest stable step
 *     region.c             regions of stability
 *     verdict.c            A- and L-stability
 *
 *     explicit.c           the family of explicit Runge-Kutta methods (stages.c, dense_output.c)
 *     stabilised.c         the family of Runge-Kutta-Chebyshev methods
 *     radius.c             the spectral radius, which determines the number of stages of these
 *
 *     multistep.c          weights, orders and characteristic polynomials of multistep methods
 *     adams.c              the family of Adams methods, predictor and corrector
 *
 *     dirk.c               the family of diagonally implicit Runge-Kutta methods
 *     two_step.c           the family of implicit two-step methods with a chosen spectral radius at infinity
 *     radau.c              the family of Radau IIA methods, implicit
 *     rosenbrock.c         the family of Rosenbrock methods, linearly implicit
 *     newton.c             Newton's equations of implicit methods: the Jacobian, its factors, the iteration
 *     rational.c           their stability functions
 *
 *     stiff_switching.c    the family of methods that are explicit until the motion is stiff, and implicit while it is
 *     leap.c               the method whose steps the caller takes
 *
 * A family is one const struct of functions, kt_method_family. The algorithm of a family is private to one file. The
 * other files call it through the struct.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_INTEGRATOR_H
#define KT_INTEGRATOR_INTEGRATOR_H

#include "base/arena.h"
#include "base/require.h"
#include "kinetree/integrator.h"

#include <float.h>
#include <math.h>

/* Check of an option: finite, and zero or more. */
static inline bool kt_is_not_negative(double x) { return isfinite(x) && x >= 0.0; }

/* ---- methods ----------------------------------------------------------------------------------------------------- */

#define KT_METHOD_EXTERN(name) extern const kt_method kt_method_##name;
KT_METHOD_LIST(KT_METHOD_EXTERN)
#undef KT_METHOD_EXTERN

/* The coefficients of dopri5, which auto uses, too (tables/dormand_prince.c). */
extern const double kt_dopri5_a[], kt_dopri5_b[], kt_dopri5_c[], kt_dopri5_e[], kt_dopri5_d[];

/* Whether the method is one of the built-in list, whose tables the tests check. */
bool kt_method_is_built_in(const kt_method *method);

/* Checks the sizes, and that no array is missing. kt_integrator_size requires this before reading any array.
 * kt_table_check_sizes checks the table alone, without the family's part. */
kt_status kt_method_check_sizes(const kt_method *method, kt_error *error);
kt_status kt_table_check_sizes(const kt_method *method, kt_error *error);
/* Returns the error of a method whose table is not valid. */
kt_status kt_table_reject(const kt_method *method, kt_error *error, const char *message);

/* The family of a method: explicit Runge-Kutta if the method names no family. */
const kt_method_family *kt_method_family_of(const kt_method *method);

/* Whether steps solve Newton's equations, all or some of them. */
bool kt_method_needs_newton(const kt_method *method);

/* k of err ~ h^k, for the error estimate of a method. */
double kt_method_error_order(const kt_method *method);

/* For tests: the number of rooted trees, and so of order conditions, with 1 <= nodes <= KT_METHOD_ORDER_MAX nodes. */
int kt_tree_count(int nodes);

/* Slots of slopes: the stages, f(t1, y1) (the last stage where fsal is set), the stages of the dense output. */
static inline int kt_method_fresh(const kt_method *method) { return method->stages - (method->fsal ? 1 : 0); }
static inline int kt_method_slots(const kt_method *method) {
    return kt_method_fresh(method) + 1 + method->dense_stages;
}

/* ---- integrator -------------------------------------------------------------------------------------------------- */

/* weight * k_slot */
typedef struct kt_stage_term {
    double weight;
    size_t slot;
} kt_stage_term;

typedef struct kt_integrator_sizes {
    size_t n;           /* equations */
    size_t stride;      /* doubles from one slope to the next */
    bool owns_matrices; /* matrices of Newton's equations, n x n, are part of the memory of an implicit method */
    /* The sizes that the family determines. */
    size_t slots;       /* slopes: 2 or more, because the choice of the first step uses slot 1 */
    size_t rows, terms; /* sizes of the compiled table */
    size_t history;     /* numbers that belong to a checkpoint */
    size_t scratch;     /* bytes that are not preserved from one step to the next */
    size_t newton_rows; /* vectors of a try of an implicit method (kt_newton_row) */
} kt_integrator_sizes;

/* Arrays: type, name, count, meaning (base/arena.h). These arrays are preserved between steps. */
#define KT_INTEGRATOR_KEPT(X)                                                                                          \
    X(kt_stage_term, terms, s->terms, "the table without its zeros")                                                   \
    X(size_t, row, s->rows + 1, "first term of each row")                                                              \
    X(double *, k, s->slots, "slope in each slot")                                                                     \
    X(double, y, s->n, "state at t")                                                                                   \
    X(double, previous_y, s->n, "state at previous_t")                                                                 \
    X(double, history, s->history, "what the family remembers of earlier steps; part of a checkpoint")

/* Arrays of scratch: each call writes them before reading, or computes them again. */
#define KT_INTEGRATOR_SCRATCH(X)                                                                                       \
    X(double, trial, s->n, "states of the stages; state at the end of the try")                                        \
    X(char, scratch, s->scratch, "the family's")                                                                       \
    X(double, slopes, s->slots * s->stride, "the slopes")

#define KT_INTEGRATOR_FIELDS(X) KT_INTEGRATOR_KEPT(X) KT_INTEGRATOR_SCRATCH(X)

/* Bytes of an integrator with these options. Newton's matrices are left out if the caller solves the equations. */
size_t kt_integrator_size_with(const kt_method *method, size_t n, const kt_integrator_options *options);

/* Errors of the slopes themselves, which do not shrink with the step. The caller's record of slopes for `within` covers
 * the tries of one step. The slope at the start of the step may be evaluated in an earlier call. */
typedef struct kt_noise {
    void (*begin)(void *user);              /* before the first try of a step, with f at its start in slot 0 */
    double (*within)(double h, void *user); /* by how much they may put the state off within the last try of the step h,
                                               which is short; 0: none, or not short */
    double (*instant)(double t, void *user); /* slopes jump at a time near t that is known up to this, s; 0: none */
} kt_noise;

/* The steps of kt_method_moreau_jean. `step` writes the state at `end` = t + h to y1, and returns the values of a
 * callback; `accept` follows if the step is accepted, and `retreat` if an accepted step is undone. */
typedef struct kt_leap {
    int (*step)(double t, double h, double end, const double *y, double *y1, void *user);
    void (*accept)(void *user);
    void (*retreat)(void *user);
} kt_leap;

/* The method whose steps the caller computes. The list of methods does not contain this method, since no scene names it
 * as an integrator. */
KT_INNER extern const kt_method kt_method_moreau_jean;

struct kt_integrator {
    const kt_method *method;
    const kt_method_family *family; /* the family of the method */
    const kt_method *table;         /* the method, or of one that switches the one that takes the present step */
    kt_integrator_options options;
    kt_integrator_callbacks callbacks;
    const kt_noise *noise; /* NULL: slopes are exact to rounding */
    const kt_leap *leap;   /* steps of kt_method_moreau_jean, which the caller takes; else NULL */
    kt_integrator_memory memory;
    kt_integrator_sizes sizes;
    double error_order;        /* err ~ h^error_order */
    size_t counted;            /* equations in the error norms: all but the quadratures, which come last */
    size_t fresh;              /* slot of f at the end of a step */
    bool gives_end_derivative; /* a try leaves f(t1, y1) in slot `fresh` */
    bool started;
    /* The state of the slopes. A tried step needs f(t, y) in slot 0. The dense output of the last step needs it in slot
     * `fresh`, with the stages of that step. The two uses alternate by swapping pointers. */
    bool stages_known;       /* the slots hold the stages of the last step that its dense output needs */
    bool dense_known;        /* and they hold the stages of the dense output */
    bool jacobian_known;     /* implicit: the Jacobian in memory is that which the history describes */
    bool factors_known;      /* likewise the factors of Newton's matrices */
    int derivative_slot;     /* slot of f(t, y): 0, fresh, or -1 if it is in none */
    double quadrature_error; /* see kt_integrator_quadrature_error */
    uint64_t tries_end; /* the number of steps and rejected steps beyond which the present call has no more; 0: none */
    uint64_t tries_in_call;   /* how many the call may take */
    double call_began;        /* the time at which the call began */
    bool used_up;             /* the call needed more of them */
    uint64_t evaluations_end; /* the number of evaluations beyond which tries have no more, and stop; 0: none */
    bool exhausted;           /* a try needed more of them */
    bool may_end_early;       /* events may end the motion before t_limit */
    double until;             /* the end of the motion, if steps are limited to an earlier time; else 0 */
    size_t blamed;            /* component that caused the last step to fail; n: none */
    KT_ARENA_DECLARE(KT_INTEGRATOR_FIELDS)
};

/* For tests: fills all scratch with a byte and marks it as unknown. No bit of later results changes. */
void kt_integrator_poison(kt_integrator *it, unsigned char byte);

/* Undoes the last accepted step, if its beginning is in memory. The state becomes that at the beginning, the step
 * counts as rejected, and the next one is proposed with the length `step`. As with kt_integrator_jump, slopes and
 * history are forgotten. */
void kt_integrator_retreat(kt_integrator *it, double step);

/* Like kt_integrator_jump to the present state, for changed inputs of the right-hand side. The state remains. smooth:
 * the inputs are samples of smooth signals, so that earlier slopes remain valid. */
void kt_integrator_change(kt_integrator *it, bool smooth);

/* Begins a call that may try at most this many steps, accepted and rejected together; 0: no limit. If the call needs
 * more, it->used_up is set, and the step fails. */
void kt_integrator_limit_call(kt_integrator *it, uint64_t tries);

/* f(t, y) at the present time and state if this slope is in memory; otherwise NULL. */
const double *kt_integrator_known_derivative(const kt_integrator *it);

/* Writes a state within the last step without another evaluation: the parabola through both ends of the step with the
 * slope at its beginning. The parabola differs from the dense output by at most 4/27 h |f1 - f1'|, where f1' is the
 * slope of the parabola at the end. Returns false if the dense output costs no evaluation either, or if the slope is
 * not in memory.
 */
bool kt_integrator_sketch(const kt_integrator *it, double t, double *y_out);

/* The state at the start of the last step, n values. If that state is not in memory, the present state. */
const double *kt_integrator_previous_state(const kt_integrator *it);

/* ---- tries ------------------------------------------------------------------------------------------------------- */

typedef enum kt_try_result {
    KT_TRY_PASSED = 0,
    KT_TRY_RECOVERABLE, /* a callback returned > 0 */
    KT_TRY_NOT_FINITE,
    KT_TRY_INACCURATE,
    KT_TRY_TOO_LONG, /* the method cannot take so long a step; the family's report gives the reason */
    KT_TRY_DIVERGED, /* Newton's iteration did not converge; likewise */
    KT_TRY_STOPPED   /* a callback returned < 0 */
} kt_try_result;

/* The result of a tried step, and the cause of a failure. */
typedef struct kt_try {
    kt_try_result result;
    const char *what; /* "the right-hand side", "the new state" ... */
    double t;
    int code;         /* returned by the callback */
    size_t component; /* index of the component that is not finite */
    double error;     /* weighted norm of the error estimate, for an adaptive step */
    double factor;    /* KT_TRY_DIVERGED: h of the next try over this one's */
    double growth;    /* kt_control_accepted of the error, if computed already; 0: it is not */
} kt_try;

/* Records a failure of a try, and returns its kind. */
static inline kt_try_result kt_try_fail(kt_try *result, kt_try_result found, const char *what, double t) {
    result->what = what;
    result->t = t;
    return result->result = found;
}

/* Fills the result from the code of a callback. If the code is 0, returns KT_TRY_PASSED and leaves the result
 * unchanged. */
static inline kt_try_result kt_try_called(kt_try *result, int code, const char *what, double t) {
    if (code == 0)
        return KT_TRY_PASSED;
    result->code = code;
    return kt_try_fail(result, code > 0 ? KT_TRY_RECOVERABLE : KT_TRY_STOPPED, what, t);
}

/* The interval from (t, y) over h to `end`, which is t + h up to rounding: stages with c = 1 are evaluated at `end`
 * itself. */
typedef struct kt_interval {
    double t, h, end;
    const double *y;
} kt_interval;

/* Returns the index of the first value that is not finite; n if all are finite. */
size_t kt_first_not_finite(const double *values, size_t n);

/* k[slot] = f(t, y); the evaluation is counted and its result checked (stages.c). */
kt_try_result kt_evaluate(kt_integrator *it, double t, const double *y, size_t slot, kt_try *result);

/* to += factor x, of n numbers; a factor of 0 reads none. */
static inline void kt_add_times(double *restrict to, double factor, const double *restrict x, size_t n) {
    for (size_t l = 0; l < n && factor != 0.0; l++)
        to[l] += factor * x[l];
}

/* absolute + relative max(|y0|, |y1|) + DBL_MIN. Because of the last term, the scale is above 0, so that 0 / 0 does not
 * occur. */
static inline double kt_scale_of(double absolute, double relative, double y0, double y1) {
    const double a = fabs(y0), b = fabs(y1);
    return absolute + relative * (a > b ? a : b) + DBL_MIN;
}

/* kt_scale_of with the tolerances of component i. */
double kt_error_scale(const kt_integrator *it, size_t i, double y0, double y1);

/* sqrt(mean(((u_i - v_i) / scale_i)^2)) with the scales of the current state; v may be NULL (zero). */
double kt_scaled_norm(const kt_integrator *it, const double *u, const double *v);

/* `error` of families with one estimate: sqrt(mean((error_at(i) / scale_i)^2)). */
double kt_error_norm(const kt_integrator *it, double h);

/* `error` and `error_at` of families without an error estimate, whose steps are fixed: 0. */
double kt_no_error(const kt_integrator *it, double h);
double kt_no_error_at(const kt_integrator *it, double h, size_t i);

/* Reports a failed tried step as an error: code, time and message. */
kt_status kt_try_report(const kt_integrator *it, const kt_try *result, const char *advice, kt_error *error);

/* Checks the results of the family's try_step: slopes and `trial`. For an adaptive step, also computes
 * result->error. */
kt_try_result kt_try_check(kt_integrator *it, const kt_interval *interval, kt_try *result);
/* The last part of kt_try_check, for an adaptive step whose error estimate is given. */
kt_try_result kt_try_check_error(const kt_interval *interval, double error, kt_try *result);

/* A step that will be tried. */
typedef struct kt_plan_of_try {
    kt_interval interval;
    double proposed; /* adaptive: |h| regardless of t_limit */
    bool clipped;    /* adaptive: |h| < proposed because of t_limit */
    int64_t grid;    /* fixed: the grid index and flag of the memory after the step */
    bool on_grid;
} kt_plan_of_try;

/* Like kt_integrator_step, for an integrator that is not NULL and has been started. */
kt_status kt_integrator_take_step(kt_integrator *it, double t_limit, kt_error *error);

/* Parts of kt_integrator_take_step, for callers that try the steps of several integrators at once (batch/ensemble.c).
 * First, kt_attempt_begin plans a try. While `again` is set, the caller runs the family's try_step on plan.interval. If
 * try_step has passed, the caller calls kt_try_check. Then kt_attempt_end accepts the step, or rejects the try and
 * plans another. */
typedef struct kt_attempt {
    double t_limit;
    double proposed, least; /* adaptive: |h| of the next try, and the least that may be tried */
    bool retried;           /* adaptive: a try was rejected */
    kt_plan_of_try plan;
} kt_attempt;
kt_status kt_attempt_begin(kt_integrator *it, double t_limit, kt_attempt *attempt, kt_error *error);
kt_status kt_attempt_end(kt_integrator *it, kt_attempt *attempt, kt_try *result, bool *again, kt_error *error);

/* The largest error estimate of a quadrature over its tolerance, for the last adaptive step. Returns 0 without
 * quadratures, and with fixed steps. */
double kt_integrator_quadrature_error(const kt_integrator *it);
/* Replaces the quadratures at the end of the last step by more accurate values. No other result depends on
 * quadratures. */
void kt_integrator_put_quadratures(kt_integrator *it, const double *values);

/* The component that caused the last step to fail with KT_ERROR_STEP or KT_ERROR_NOT_FINITE; n if unknown. */
size_t kt_integrator_blamed(const kt_integrator *it);

/* Checks a checkpoint's memory and history, which come from outside (memory_words.c). Errors: KT_ERROR_ARGUMENT, with
 * the word that is out of range. */
KT_CHECKED kt_status kt_integrator_check_memory(const kt_integrator *it, const kt_integrator_memory *memory,
                                                const double *history, kt_error *error);

/* ---- families ---------------------------------------------------------------------------------------------------- */

/* A number of the history that a method takes as an index, a count or a choice, with its range: a checkpoint comes from
 * outside (base/block_words.h). A list ends with a name of NULL. */
typedef enum kt_history_part {
    KT_HISTORY_START,  /* `at` counts from the first number, */
    KT_HISTORY_METHOD, /* from the first behind Newton's, */
    KT_HISTORY_END,    /* or from the last number backwards: 1 is the last one */
} kt_history_part;

typedef struct kt_history_word {
    const char *name;
    kt_history_part part;
    int at;
    double first, last;
} kt_history_word;

/* The functions of one kind of method. The stepper owns time, state, step size and projection; the family does
 * everything else, in the order of the members. Only members marked NULL may be left out. */
struct kt_method_family {
    const char *name; /* as "explicit" */
    bool implicit;    /* a is the whole matrix, s x s by rows, and steps solve Newton's equations */
    bool exact;       /* implicit: the order depends on an exact Jacobian */
    bool open;        /* a caller's own method may be of this family */
    bool switches;    /* a is that of an explicit method, and steps solve Newton's equations if that is cheaper */
    int stages_max;   /* the largest number of stages, if it follows from the step; 0 if it is fixed */

    /* Set-up. n and stride in sizes are given, and the family adds its own sizes. A caller's own method must be of a
     * family that is open, and must pass `check_sizes`. Before that, nothing of it is read. */
    kt_status (*check_sizes)(const kt_method *method, kt_error *error);
    kt_status (*check_order)(const kt_method *method, kt_error *error); /* NULL: conditions of the table alone */
    void (*measure)(const kt_method *method, kt_integrator_sizes *sizes);
    void (*init)(kt_integrator *it);  /* sets fresh, gives_end_derivative and the table; the memory is laid out and
                                         zeroed */
    void (*start)(kt_integrator *it); /* NULL: no history. Sets the history of a motion that begins or jumps */
    /* Called if inputs of the right-hand side have changed at the present time, but not the state. Keeps the part of
     * the history that remains valid, always or if the inputs are samples of smooth signals. NULL: as start. */
    void (*change)(kt_integrator *it, bool smooth);
    const kt_history_word *words;       /* NULL: any finite numbers are a history */
    void (*restore)(kt_integrator *it); /* NULL: nothing to do. Restores the values that follow from a history */

    /* One step. `prepare` (NULL: nothing to do) computes the data that all tries need in addition to f(t, y), which is
     * in slot 0. `prepare` is called again, with `rejected`, before each further try. The function `try_step` computes
     * slopes and `trial`. Then `error` returns the weighted norm of the error estimate. Finally `accept` (NULL: no
     * history) writes the history; it cannot fail.
     *
     * The function `longest_step` (NULL: any) bounds an adaptive step. After an accepted one, `control` (NULL: PI
     * control) returns h_new / h. The function `report` describes a try with the result KT_TRY_TOO_LONG or
     * KT_TRY_DIVERGED. */
    kt_try_result (*prepare)(kt_integrator *it, bool rejected, kt_try *result);
    kt_try_result (*try_step)(kt_integrator *it, const kt_interval *interval, kt_try *result);
    double (*error)(const kt_integrator *it, double h);
    double (*error_at)(const kt_integrator *it, double h, size_t i); /* error of component i alone, unweighted */
    void (*accept)(kt_integrator *it);
    double (*longest_step)(const kt_integrator *it);
    double (*control)(const kt_integrator *it, double h, double error);
    kt_status (*report)(const kt_integrator *it, const char *where, kt_error *error);

    /* Computes y(t) strictly within the last step, n values. */
    kt_try_result (*interpolate)(kt_integrator *it, double t, double *y_out, kt_try *result);

    /* Linear stability (kt_stability_make and the functions after it in the public header). For a step h with z = h max
     * |lambda|, `stages` (NULL: the number is fixed) returns the number of stages. Defined together with it, `reach`
     * returns the largest z for which there are enough stages. If the gain is |value|, `gain` is NULL. */
    kt_status (*stability)(const kt_method *method, int stages, kt_stability *stability, kt_error *error);
    kt_complex (*value)(const kt_stability *stability, kt_complex z);
    double (*gain)(const kt_stability *stability, kt_complex z);
    double (*real_limit)(const kt_stability *stability);
    double (*imaginary_limit)(const kt_stability *stability);
    int (*stages)(const kt_method *method, double z);
    double (*reach)(const kt_method *method);
};

extern const kt_method_family kt_family_explicit, kt_family_stabilised, kt_family_adams;
extern const kt_method_family kt_family_dirk, kt_family_two_step, kt_family_radau, kt_family_rosenbrock;
extern const kt_method_family kt_family_switching;

/* For families whose table is explicit: its slots and rows, and the table compiled (explicit.c). */
void kt_explicit_measure(const kt_method *method, kt_integrator_sizes *sizes);
void kt_explicit_init(kt_integrator *it);

/* All stages of the table, and y1 in `trial` (stages.c). */
kt_try_result kt_explicit_step(kt_integrator *it, const kt_interval *interval, kt_try *result);

/* Evaluates the stages first .. last - 1 of the table on an interval, into their slots (stages.c). */
kt_try_result kt_evaluate_stages(kt_integrator *it, const kt_interval *interval, size_t first, size_t last,
                                 kt_try *result);

/* Writes the nonzero weights among `count` weights, weight j for slot j. Returns the number of nonzero weights. */
static inline size_t kt_stage_terms(const double *weights, size_t count, kt_stage_term *terms) {
    size_t used = 0;
    for (size_t j = 0; j < count; j++)
        if (weights[j] != 0.0)
            terms[used++] = (kt_stage_term){weights[j], j};
    return used;
}

/* The time of a stage at the part c of a step. */
static inline double kt_stage_time(double c, double t, double h) { return c == 1.0 ? t + h : t + c * h; }

/* out = y + h sum_j weight_j k_j over one row, n values, summed in the order of the row (stages.c). */
void kt_combine(double *out, const double *y, double h, const kt_stage_term *terms, size_t count, double *const *k,
                size_t n);

/* kt_combine for a row of `count` weights with zeros. k: rows of n numbers. */
void kt_combine_rows(double *out, const double *y, double h, const double *weights, size_t count, double *k, size_t n);

/* sum_j weight_j k_j for the component `at` (stages.c). */
double kt_slopes_sum(const kt_stage_term *terms, size_t count, double *const *k, size_t at);

/* The mean of ((sum_j weight_j k_j) / scale)^2 over the components with tolerances, where kt_scale_of gives the scale
 * of a component from the states at both ends of the try (stages.c). */
double kt_slopes_mean_square(const kt_integrator *it, const kt_stage_term *terms, size_t count);

/* The error estimate of a step h from mean squares: err with a single estimate. With two estimates, after HNW
 * (II.10.17):
 *
 *     h err_5^2 / sqrt(err_5^2 + 0.01 err_3^2) */
static inline double kt_explicit_error(double h, double high, bool has_low, double low) {
    return has_low && high != 0.0 ? fabs(h) * high / sqrt(high + 0.01 * low) : fabs(h) * sqrt(high);
}

/* A compiled table has the terms of the stages, and then the terms of these rows: b, e, and e_low (explicit.c). */
enum { KT_ROW_B, KT_ROW_E, KT_ROW_E_LOW, KT_ROW_DENSE };

/* The dense output in the form that the public header gives, from slopes in slots. kt_dense_state takes
 * the slopes k. */
kt_try_result kt_table_interpolate(kt_integrator *it, double t, double *y_out, kt_try *result);
void kt_dense_state(const kt_integrator *it, double t, size_t slots, double *const *k, double *y_out);

/* R = P / Q of an implicit method; infinite at a pole (rational.c). */
kt_complex kt_rational_value(const kt_stability *stability, kt_complex z);

/* The limit on either axis of an A-stable method: none. */
double kt_rational_limit(const kt_stability *stability);
/* R of stages that are solved one after the other, from stage `first` on. The numerator has at most this degree. */
void kt_rational_stages(const kt_method *m, double gamma, int first, int degree, kt_stability *out);

/* Two steps are equal if they differ by no more than the rounding of times. Then data that depend on the step's length
 * are used again for the next step. */
#define KT_SAME_STEP 1e-8
static inline bool kt_is_same_step(double h, double other) { return fabs(h - other) <= KT_SAME_STEP * fabs(h); }

/* kt_is_inside returns whether x lies inside a region. Searching outwards from 0, kt_first_exit returns the first
 * boundary of the region to rounding: a point between the last point inside and the first outside. Returns HUGE_VAL if
 * the region has no boundary up to `most` (region.c). */
typedef bool kt_is_inside(const void *problem, double x);
double kt_first_exit(kt_is_inside *inside, const void *problem, double most);
/* The farthest point along a direction (re, im) of size 1 up to which |R| exceeds 1 by no more than `rounding`. Points
 * nearer to 0 than `least` count as that far out. */
double kt_axis_limit(const kt_stability *s, double re, double im, double least, double rounding);

/* A bound of all limits. No consistent polynomial of degree s keeps |R| at most 1 further than 2 s^2. A rational R of
 * an A-stable method has no limit on the left. If a mode grows, its poles lie within the bound. */
static inline double kt_farthest_stable(const kt_stability *s) {
    const double degree = s->poles > s->degree ? s->poles : s->degree;
    return 2.0 * degree * degree + 1.0;
}

/* ---- step size --------------------------------------------------------------------------------------------------- */

/* x^p for finite x > 0 and |p| at most 2, to about 1e-12, using only arithmetic. The bits are the same on every
 * platform, which no libm guarantees. */
double kt_control_power(double x, double p);

/* The exponents of the errors of an accepted step and of the step before; h_new / h from the powers. */
static inline double kt_control_exponent(const kt_integrator *it) { return -it->options.alpha / it->error_order; }
static inline double kt_control_exponent_before(const kt_integrator *it) { return it->options.beta / it->error_order; }
static inline double kt_control_clamp(double x, double low, double high) { return x < low ? low : x > high ? high : x; }
static inline double kt_control_growth(const kt_integrator *it, double power, double power_before) {
    const kt_integrator_options *o = &it->options;
    return kt_control_clamp(o->safety * power * power_before, o->factor_min, o->factor_max);
}

/* h_new / h after an accepted step, and after a rejected step. */
double kt_control_accepted(const kt_integrator *it, double error);
double kt_control_rejected(const kt_integrator *it, double error);

/* Proposes the first step in a direction (+-1), after HNW II.4. Requires f(t, y) in slot 0, and evaluates f only within
 * `limit`. Returns 0 if a callback stopped. */
double kt_control_initial(kt_integrator *it, double direction, double limit, kt_try *result);

/* Adaptive steps. A motion makes no progress if the motion advances, over KT_PROGRESS_TRIES tries, by less than
 * KT_PROGRESS of its time per try. The same is true for less than KT_PROGRESS_LASTING over KT_PROGRESS_WINDOWS such
 * windows of tries in a row. If events may end the motion, its time is at most KT_PROGRESS_OPEN (s), or the reached
 * time. */
#define KT_PROGRESS 1e-10
#define KT_PROGRESS_LASTING 1e-9
#define KT_PROGRESS_OPEN 1e4
enum { KT_PROGRESS_TRIES = 10000, KT_PROGRESS_WINDOWS = 5 };

/* memory.control_error before the first step, and its lower bound (err_last of Hairer's DOPRI5). */
#define KT_CONTROL_ERROR_FLOOR 1e-4

#endif
