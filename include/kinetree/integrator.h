/* Experimental. Integrators: solutions of ordinary differential equations y' = f(t, y), y in R^n, with fixed or
 * adaptive steps and dense output. The methods are in method.h, and their linear stability is in stability.h.
 *
 * An integrator lives in the caller's memory and allocates nothing. The integrator owns the current time, the state and
 * the memory of the step-size control. Two threads may use two integrators at the same time, but never a single
 * integrator. Equal inputs give equal bits, on every instruction set.
 *
 *     kt_integrator_options options = kt_integrator_options_default();
 *     options.relative_tolerance = 1e-8;
 *     const kt_method *method = kt_method_find("dopri5");
 *     const size_t size = kt_integrator_size(method, n);
 *     void *memory = malloc(size);
 *     kt_integrator *integrator = NULL;
 *     status = kt_integrator_init(memory, size, method, n, &options, &integrator, &error);
 *     if (status == KT_OK)
 *         status = kt_integrator_start(integrator, 0.0, y, &callbacks, &error);
 *     while (status == KT_OK && kt_integrator_time(integrator) < 10.0)
 *         status = kt_integrator_step(integrator, 10.0, &error);
 *     free(memory);
 *
 * Sources: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993
 * (below: HNW), section II.4. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_INTEGRATOR_H
#define KINETREE_INTEGRATOR_H

#include "kinetree/method.h"
#include "kinetree/stability.h"
#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* An integrator: the state of one integration. */
typedef struct kt_integrator kt_integrator;

/* The functions that an integrator calls. They return
 *   0: continue;
 *   > 0: recoverable. An adaptive method repeats the step with a smaller size. A fixed step fails;
 *   < 0: stop. A stopped step leaves the integrator unchanged and may be repeated.
 *
 * A caller can keep its own error message in the object that `user` points to.
 *
 * rhs: dydt = f(t, y), n values, a function of its arguments alone. The integrator never calls rhs with a t beyond the
 * limit given to kt_integrator_step (as long as 0 <= c_i <= 1, as in all built-in methods).
 *
 * project (or NULL): after each accepted try, before it is committed, this function may move y onto a manifold.
 * *changed is true on entry. Set it to false only if not one bit of y was moved. A method with fsal then reuses its
 * last stage as the slope of the next step. Otherwise the slope is evaluated again. With fsal methods, a projection to
 * 1e-16 after each step therefore costs one evaluation a step. A callback that leaves y unchanged avoids this cost
 * while the constraint error is well below the tolerance. State and slope remain consistent to the last bit. */
typedef struct kt_integrator_callbacks {
    int (*rhs)(double t, const double *y, double *dydt, void *user); /* dydt = f(t, y), n numbers each */
    int (*project)(double t, double *y, bool *changed, void *user);  /* y back to a manifold; NULL: none */
    void *user;                                                      /* passed to both */
} kt_integrator_callbacks;

/* Solves Newton's equations of an implicit method, (sigma - J) x = r with J = f_y, in the caller's code;
 * kt_integrator_options.newton. This serves callers that can use the structure of f. The functions receive the `user`
 * of the callbacks and return values with the same meaning. J and the factors stay in the caller's memory, which
 * belongs to one integrator.
 *
 * jacobian: computes J at (t, y), n values, with f = dydt at this point, and stores J. > 0: J cannot be computed, and
 * the previous J must stay stored.
 *
 * factor: factors sigma - J with the J that is kept. Factors for a sigma with im = 0 and for a complex sigma are
 * separate: a method may use both at the same time. > 0: singular.
 *
 * autonomous (NULL: f may depend on t): returns whether f does not depend on t. A Rosenbrock method then needs no time
 * derivative.
 *
 * time_derivative (NULL: none): writes df/dt at (t, y), with f = dydt at this point, to slope: n values, which are zero
 * on entry. At a breakpoint of f, this is the derivative just after t. > 0: the derivative is not available; it is
 * found by differences of f.
 *
 * solve: replaces re + i im by (sigma - J)^-1 (re + i im), n values less the quadratures, with the last sigma of its
 * kind. `im` is NULL for the real sigma. */
typedef struct kt_newton {
    int (*jacobian)(double t, const double *y, const double *dydt, void *user); /* J at (t, y) */
    int (*factor)(kt_complex sigma, void *user);                                /* of sigma - J */
    int (*solve)(double *re, double *im, void *user);                           /* with these factors */
    bool (*autonomous)(void *user); /* Rosenbrock: whether f does not depend on t; NULL: it may */
    int (*time_derivative)(double t, const double *y, const double *dydt, double *slope,
                           void *user); /* Rosenbrock: df/dt */
} kt_newton;

/* How an integrator steps. */
typedef struct kt_integrator_options {
    size_t size; /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    double step; /* > 0: fixed step, s; 0: adaptive, and the options below apply */

    /* A try passes if sqrt(mean((err_i / (absolute_i + relative max(|y0_i|, |y1_i|)))^2)) <= 1. */
    double relative_tolerance, absolute_tolerance; /* relative: 0, or at least KT_TOLERANCE_LEAST */
    const double *absolute_tolerances; /* n, instead of absolute_tolerance; NULL: none. Stays the caller's */

    double initial_step; /* > 0; 0: found from f and its change, after HNW II.4 */
    double min_step;     /* s; never below 16 eps |t| anyway */
    double max_step;     /* s; 0: no limit. kt_integrator_step rejects a limit that is below the rounding of the time */

    /* PI control, Hairer and Wanner, Solving ODE II, IV.2: h_new = h safety err^(-alpha/k) err_last^(beta/k), err ~
     * h^k. The ratio h_new / h stays between factor_min and factor_max. */
    double safety, alpha, beta, factor_min, factor_max;

    uint64_t max_steps; /* accepted and rejected, since the start; 0: no limit */

    /* The number of quadratures, which are the last of the n equations: f does not depend on them. They are integrated
     * and interpolated like the rest. They enter neither the error nor the choice of steps: no bit of the other
     * equations depends on them. Less than n. */
    size_t quadratures;

    /* The number of position equations, which are the first of the equations; 0: unknown. Their rates follow from the
     * other equations. auto weighs differences of positions by the step, so that it detects oscillating modes. The
     * steps of the other methods do not depend on this number. */
    size_t positions;

    /* Implicit methods: the caller's solver of Newton's equations. NULL: the integrator solves them, with finite
     * differences of f and dense matrices. A Rosenbrock method takes central differences, 2 n evaluations. Must outlive
     * the integrator. */
    const kt_newton *newton;
} kt_integrator_options;

/* Adaptive, tolerances 1e-6 and 1e-9, and Hairer's control constants. These are safety 0.9, alpha 0.85, beta
 * 0.2, and the factors 0.2 and 10. */
static inline kt_integrator_options kt_integrator_options_default(void) {
    kt_integrator_options options;
    memset(&options, 0, sizeof options);
    options.size = sizeof options;
    options.relative_tolerance = 1e-6;
    options.absolute_tolerance = 1e-9;
    options.safety = 0.9;
    options.alpha = 0.85;
    options.beta = 0.2;
    options.factor_min = 0.2;
    options.factor_max = 10.0;
    return options;
}

/* Bytes for an integrator of n equations with this method, for all options. 0 if the method's sizes or n are out of
 * range or the size overflows. The memory needs no alignment. The number of doubles is about
 *
 *     (s + 4 + dense_stages) n        explicit; n fewer with fsal
 *     (s + 4 + dense_stages + p) n    adams, with p past slopes: 1 of ab2, 3 of ab4
 *     17 n                            rkc2
 *     19 n                            rkc4
 *     4 n^2 + 23 n                    rodas5p
 *     4 n^2 + 21 n                    radau5
 *     4 n^2 + 25 n                    auto
 *     4 n^2 + 18 n                    bdf2, two-step
 *     4 n^2 + 15 n                    implicit-euler, crank-nicolson */
KT_API size_t kt_integrator_size(const kt_method *method, size_t n);

/* Initialises an integrator in the caller's memory. n >= 1. Checks options and, unless the method is built in, also
 * checks the method. Call kt_integrator_start next.
 *
 * Ownership: the memory must outlive the integrator; the integrator needs no release.
 *
 * Errors: KT_ERROR_ARGUMENT (options, n, the method, adaptive without an estimate), KT_ERROR_MEMORY (size too small).
 */
KT_API KT_CHECKED kt_status kt_integrator_init(void *memory, size_t size, const kt_method *method, size_t n,
                                               const kt_integrator_options *options, kt_integrator **integrator,
                                               kt_error *error);

/* Starts at time t from y (n values, copied), discards all earlier history and sets the counts to zero. The callbacks
 * are copied. Calls no callback.
 *
 * Errors: KT_ERROR_ARGUMENT (no rhs), KT_ERROR_NOT_FINITE (t or y); the integrator is then unchanged. */
KT_API KT_CHECKED kt_status kt_integrator_start(kt_integrator *integrator, double t, const double *y,
                                                const kt_integrator_callbacks *callbacks, kt_error *error);

/* Replaces the state at the current time, as an event does. Keeps time, grid, counts and the proposed step. Discards
 * the slopes, the control's error memory, and the interpolant of the last step (interpolate up to the event first).
 *
 * Errors: as kt_integrator_start. */
KT_API KT_CHECKED kt_status kt_integrator_jump(kt_integrator *integrator, const double *y, kt_error *error);

/* Takes one accepted step towards t_limit, never beyond it, after as many rejected tries as necessary. t_limit is
 * INFINITY if there is no limit. A t_limit before the current time integrates backwards. The step that reaches t_limit
 * ends at it exactly.
 *
 * Fixed step: ends at t0 + k h, without accumulated rounding. A t_limit between two of these points is an extra stop,
 * after which the steps return to the same grid. A t_limit within rounding of a grid point is that grid point.
 *
 * Adaptive: if less than two steps remain until t_limit, the step size is chosen so that these steps are equal.
 *
 * On failure time, state, control and interpolant keep their bits. Only the counts of work done have grown, and
 * progress is counted anew.
 *
 * Errors:
 *   KT_ERROR_ARGUMENT: not started, or t_limit is NaN or the current time.
 *   KT_ERROR_NOT_FINITE: a slope or the new state is not finite. With a fixed step the first such value is an error; at
 *     the current state it is an error in either mode.
 *   KT_ERROR_STEP: the step became too small, max_steps are used up, or there is no progress. Progress is measured over
 *     windows of 10,000 tries, relative to the larger of |t| and |t_limit|. The integrator makes no progress if a
 * window advances by less than 1e-6, or if each of five consecutive windows advances by less than 1e-5. A simulation
 * whose events may end the run uses at most 1e4 s in place of the limit. The same error reports a fixed step or
 * max_step below the rounding of the
 *     time, and tolerances below the rounding of the state.
 *   KT_ERROR_CALLBACK: a callback stopped, or failed recoverably with a fixed step.
 *
 * Stabilised (rkc2, rkc4): a fixed step may need more stages than the method has, which is KT_ERROR_STEP. An adaptive
 * step is kept short enough for the available stages. The fastest decay of the right-hand side is estimated by
 * differences, with four to eight evaluations. An estimate is made at the start, every 25 steps (5 with a fixed step),
 * and after a rejected try. If the estimate has not settled to a hundredth after eight evaluations, it is used with the
 * usual margin, and counted (capped).
 *
 * Multistep (ab2, ab4, bdf2, two-step): steps are fixed. The formula needs past steps of the same length. Too few exist
 * at the start, after kt_integrator_jump, and before and after a step that t_limit cuts short. The one-step method in
 * the table, which has the same order, then takes the step, so that the order is preserved. It is Heun's method for
 * ab2, Kutta's of order 4 for ab4, and a diagonally implicit L-stable one for the others.
 *
 * Rosenbrock (rodas5p): a step solves eight linear systems with one matrix and iterates nothing.
 *   The order depends on an exact Jacobian, which is computed at every step. If this fails, the old Jacobian is used,
 * or no Jacobian if the old one would mislead. Such a step is counted (capped).
 *   If f depends on time, its time derivative comes from the caller (kt_newton) or from two more evaluations.
 * Differences have an error of 1e-7 h^4 f_ttt in a step.
 *   Quadratures need two more evaluations, too, and have order 4.
 *   A singular matrix requires a shorter step. With a fixed step this is KT_ERROR_STEP.
 *
 * Implicit (implicit-euler, crank-nicolson, bdf2, two-step, radau5): each try iterates at most 7 times. With fixed
 * steps the limit is 50, and the iteration goes down to rounding.
 *   If an iteration does not converge, a new Jacobian is computed. If this iteration does not converge either, the step
 * is shortened.
 *   With a fixed step, radau5 fails with KT_ERROR_STEP. The others, which solve for one stage at a time, continue with
 *     damped corrections and a new Jacobian in each iteration. The step fails after at most 50 iterations.
 *   The Jacobian is kept as long as the iteration contracts thirtyfold. If the Jacobian cannot be computed, the old one
 * is used.
 *
 * Switching (auto): takes steps of dopri5, equal to the last bit, until stability alone bounds the step. Then auto
 * takes steps of radau5, until dopri5 would be cheaper again. The decision is made after an accepted step, from its
 * last two stages or from the Jacobian in use, and takes no evaluation. With a fixed step auto is dopri5.
 *
 * Cost: for each try, in terms of evaluations and operations:
 *   Explicit methods take s evaluations and O(s^2 n / 2). With fsal they take s - 1 evaluations.
 *   Adams methods take 2 evaluations.
 *   A step of rodas5p takes 8 evaluations, a Jacobian and new factors.
 *   Stabilised methods take one evaluation and O(n) for each stage.
 *   Implicit methods take s - 1 evaluations and O(n^2) for each iteration. New factors take O(n^3). */
KT_API KT_CHECKED kt_status kt_integrator_step(kt_integrator *integrator, double t_limit, kt_error *error);

/* Evaluates y(t), n values, at a time within the last accepted step or at its ends. At the ends, the result has the
 * same bits as the states. Right after the start only the start time is allowed. y_out must not be inside the
 * integrator. Between the ends the value is not projected. No bit of any later step changes.
 *
 * Errors: KT_ERROR_ARGUMENT (t outside), KT_ERROR_CALLBACK, KT_ERROR_NOT_FINITE; y_out is then untouched.
 *
 * Cost: O(s n). Methods without fsal evaluate f(t1, y1) in this call, and the next step reuses the value. dop853 adds 3
 * evaluations, once a step. */
KT_API KT_CHECKED kt_status kt_integrator_interpolate(kt_integrator *integrator, double t, double *y_out,
                                                      kt_error *error);

/* Returns f(t, y) at the current time and state: n values, valid until the next call that takes a non-const integrator.
 * The slope is already available after a step with fsal whose projection moved nothing, or after an earlier call of
 * this function. Otherwise this call evaluates the slope, and the next step reuses it. No evaluation is made twice, and
 * no bit of any later step changes.
 *
 * Errors: KT_ERROR_ARGUMENT (not started), KT_ERROR_CALLBACK, KT_ERROR_NOT_FINITE; the integrator is then unchanged. */
KT_API KT_CHECKED kt_status kt_integrator_derivative(kt_integrator *integrator, const double **slope, kt_error *error);

/* In turn: the current time; the current state; the time at which the last step began; n; the method. The state has n
 * values, valid until the next call that takes a non-const integrator. Before any step, the previous time is the
 * current time. O(1). */
KT_API double kt_integrator_time(const kt_integrator *integrator);
KT_API const double *kt_integrator_state(const kt_integrator *integrator);
KT_API double kt_integrator_previous_time(const kt_integrator *integrator);
KT_API size_t kt_integrator_dimension(const kt_integrator *integrator);
KT_API const kt_method *kt_integrator_method(const kt_integrator *integrator);

/* Counts of the work done since the start. */
typedef struct kt_integrator_counts {
    uint64_t steps;          /* accepted */
    uint64_t rejected;       /* tries */
    uint64_t evaluations;    /* of the right-hand side, rejected tries and interpolation included */
    uint64_t capped;         /* Stabilised: estimates of the decay that had not settled after the largest number of
                                evaluations. Implicit with fixed steps: iterations that ended above rounding, because
                                f is less exact. Rosenbrock: steps with an old Jacobian, or none. */
    uint64_t jacobians;      /* implicit: computed */
    uint64_t factorizations; /* implicit: of Newton's matrices, real and complex ones */
    uint64_t switches;       /* auto: from the explicit method to the implicit one, and back */
} kt_integrator_counts;

/* Returns the counts since the start. */
KT_API kt_integrator_counts kt_integrator_counts_of(const kt_integrator *integrator);

/* The numbers of an integrator that a checkpoint needs besides y, previous_y and history. Everything else can be
 * computed again. The struct has no padding and no pointers, so its bytes may be written to a file. */
typedef struct kt_integrator_memory {
    double t;                    /* current time */
    double previous_t;           /* where the last step began */
    double origin;               /* fixed step: t0 of the grid t0 + k h */
    int64_t grid;                /* fixed step: the last k with t0 + k h <= t */
    double last_step;            /* t - previous_t up to rounding, with its sign; 0 before any step */
    double next_step;            /* adaptive: proposed size, > 0; 0: not yet chosen */
    double last_error;           /* adaptive: weighted norm of the last accepted step's error estimate; NaN: none */
    double control_error;        /* adaptive: err_last of the PI control */
    double advanced;             /* adaptive: how far steps have gone in the present window of tries, >= 0 */
    uint64_t window;             /* adaptive: tries, accepted or rejected, before that window began */
    uint64_t slow;               /* adaptive: windows in a row, up to that one, in which steps hardly advanced */
    int32_t on_grid;             /* fixed step: whether t is t0 + grid h */
    int32_t has_previous;        /* whether previous_y is available */
    kt_integrator_counts counts; /* as kt_integrator_counts_of returns them */
} kt_integrator_memory;

/* The memory of an integrator. Valid until the next call that takes a non-const integrator. */
KT_API const kt_integrator_memory *kt_integrator_memory_of(const kt_integrator *integrator);

/* Returns the number of numbers that the method stores of earlier steps. A checkpoint holds these numbers as `history`.
 *   Explicit methods have none. Their `history` may be NULL below.
 *   Stabilised methods have 2: the rate of the fastest decay, and its age.
 *   Adams methods have 2, and n for each past slope.
 *   Implicit methods have 6 + n. The n numbers are the state at which the Jacobian was computed.
 *   Implicit methods also keep the slopes of the last step. These are 4 n for radau5 and 3 n for rodas5p. The others
 *     keep 2 n.
 *   Besides, bdf2 and two-step keep the previous state and its slope, 2 + 2 n.
 *   The method auto has the numbers of radau5, n for a vector, and 12 for the detection of stiffness.
 *
 * O(1). */
KT_API size_t kt_integrator_history_size(const kt_integrator *integrator);

/* Saves a checkpoint: copies memory, y (n), previous_y (n; NULL: not wanted) and history (kt_integrator_history_size).
 */
KT_API void kt_integrator_save(const kt_integrator *integrator, kt_integrator_memory *memory, double *y,
                               double *previous_y, double *history);

/* Restores a checkpoint, in an integrator initialised with the same method, n and options. Every later step has the
 * same bits as without the interruption. With previous_y, kt_integrator_interpolate works for the last step, whose
 * stages are evaluated once more. With NULL, the last step cannot be interpolated.
 *
 * Errors: as kt_integrator_start. */
KT_API KT_CHECKED kt_status kt_integrator_restore(kt_integrator *integrator, const kt_integrator_memory *memory,
                                                  const double *y, const double *previous_y, const double *history,
                                                  const kt_integrator_callbacks *callbacks, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
