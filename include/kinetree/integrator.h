/* Methods for ordinary differential equations y' = f(t, y), y in R^n. There are explicit, stabilised and implicit
 * Runge-Kutta methods, multistep methods, and one method that switches between explicit and implicit steps. Steps are
 * fixed or adaptive. The header also covers dense output and linear stability.
 *
 * A method is a constant struct of coefficients, kt_method. An integrator lives in the caller's memory and allocates
 * nothing. It owns the current time, the state and the memory of the step-size control. Two threads may use two
 * integrators at the same time, but never a single integrator. Equal inputs give equal bits, on every instruction set.
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
 * Sources: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993
 * (below: HNW), sections II.1 - II.6. Each table names its own source. */
#ifndef KINETREE_INTEGRATOR_H
#define KINETREE_INTEGRATOR_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#include <string.h>

#ifdef __cplusplus
extern "C" {
#endif

/* ---- methods ----------------------------------------------------------------------------------------------------- */

/* The built-in methods, in rising order. A small library contains only the methods marked CORE. It omits the implicit
 * and multistep methods, and auto. */
#define KT_METHOD_LIST_BY_KIND(CORE, MORE)                                                                             \
    CORE(euler)                                                                                                        \
    MORE(implicit_euler)                                                                                               \
    CORE(midpoint)                                                                                                     \
    CORE(heun)                                                                                                         \
    CORE(ralston)                                                                                                      \
    MORE(crank_nicolson)                                                                                               \
    MORE(bdf2)                                                                                                         \
    MORE(two_step)                                                                                                     \
    MORE(ab2)                                                                                                          \
    CORE(rkc2)                                                                                                         \
    CORE(kutta3)                                                                                                       \
    CORE(bs32)                                                                                                         \
    CORE(rk4)                                                                                                          \
    CORE(rk38)                                                                                                         \
    MORE(ab4)                                                                                                          \
    CORE(rkc4)                                                                                                         \
    CORE(dopri5)                                                                                                       \
    CORE(tsit5)                                                                                                        \
    MORE(auto)                                                                                                         \
    MORE(rodas5p)                                                                                                      \
    MORE(radau5)                                                                                                       \
    CORE(dop853)
#define KT_METHOD_LIST(X) KT_METHOD_LIST_BY_KIND(X, X)

/* The kind of steps that a method takes. Opaque; kt_method_family_name returns its name.
 *   Explicit methods.
 *   Stabilised methods are explicit. The number of stages follows from the fastest decay of the right-hand side.
 *   The family adams is explicit and multistep, with a predictor and a corrector.
 *   The families dirk, radau and rosenbrock are implicit, for stiff equations.
 *   The family two-step is implicit, for stiff equations, and multistep.
 *   Switching methods are explicit until the motion is stiff, and implicit while it is stiff. */
typedef struct kt_method_family kt_method_family;

/* The largest tables. */
enum {
    KT_METHOD_STAGES_MAX = 32,     /* stages, the slope at the new point and the stages of the dense output together */
    KT_METHOD_ORDER_MAX = 12,      /* of a method */
    KT_METHOD_DENSE_TERMS_MAX = 8, /* of the dense output, beyond the cubic */
    KT_METHOD_STEPS_MAX = 4,       /* of a multistep method */
    KT_STABILISED_STAGES_MAX = 250 /* of a stabilised method */
};

/* The table of a Rosenbrock method as its steps compute with it. Opaque. */
typedef struct kt_rosenbrock kt_rosenbrock;

/* A Runge-Kutta method, HNW II.1:
 *
 *     k_i = f(t + c_i h, y0 + h sum_j a_ij k_j),   i = 1 .. s     explicit: over j < i
 *     y1  = y0 + h sum_i b_i k_i
 *
 * Dense output, theta = (t - t0) / h in [0, 1], is the cubic through y0, y1 with the slopes k_1 and f(t1, y1), plus
 * further terms. These terms vanish at both ends together with their slopes (the form of HNW's codes DOPRI5 and
 * DOP853):
 *
 *     y(theta) = y0 + theta (F0 + theta' (F1 + theta (F2 + theta' (F3 + theta (F4 + theta' (F5 + ...)))))),
 *     theta' = 1 - theta,  F0 = y1 - y0,  F1 = h k_1 - F0,  F2 = F0 - h f(t1, y1) - F1,
 *     F_{3+m} = h sum_i d_mi k_i,  m = 0 .. dense_terms - 1
 *
 * This makes y(theta) C1 across steps, even if a projection has moved y1. The sum over i runs over the s stages, the
 * slope f(t1, y1), and dense_stages further stages, in this order. With fsal, the slope f(t1, y1) is the last stage.
 *
 * A caller's own table: clear the struct, fill in the members that the table has, and pass it to kt_integrator_init.
 * That function calls kt_method_check and rejects a table whose order conditions fail.
 * Ownership: the arrays stay the caller's and must outlive the integrator. */
typedef struct kt_method {
    const char *name; /* as in scene files: "rk4" */
    /* For people: "Runge-Kutta 4, Kutta 1901". NULL in a library for a machine without an operating system. */
    const char *title;
    const char *source; /* where the coefficients are published; likewise */

    /* NULL: explicit, as a caller's own table must be. The stages of a stabilised method follow from a recurrence. A
     * step takes as many stages as the fastest decay of the right-hand side needs, up to KT_STABILISED_STAGES_MAX. The
     * table of a stabilised method is that of the member with the fewest stages. */
    const kt_method_family *family;

    int stages;             /* s */
    int order;              /* p of b */
    int embedded_order;     /* of b - e; 0: no error estimate */
    int embedded_order_low; /* of b - e_low; 0: one estimate. With two, err = err_e^2 / sqrt(err_e^2 + 0.01
                               err_low^2), HNW II.10 */
    bool fsal;              /* the last stage is f(t1, y1): its row of a is b, its c is 1 */
    const double *a;        /* strictly lower triangle by rows, s (s - 1) / 2: a21, a31, a32, a41, ...; of an
                               implicit method s x s by rows */
    const double *b;        /* s */
    const double *c;        /* s, c_i = sum_j a_ij */
    const double *e;        /* s, b minus the embedded weights; NULL without estimate */
    const double *e_low;    /* s, or NULL */

    int dense_order;       /* of y(theta), uniformly in theta; 0 means min(p, 3), the order of the cubic alone */
    int dense_terms;       /* terms beyond the cubic */
    int dense_stages;      /* stages only the dense output needs */
    const double *dense_a; /* their rows of a, each over all slopes before it: w, w + 1, ... long, w = s + !fsal */
    const double *dense_c; /* dense_stages */
    const double *dense_d; /* dense_terms x (w + dense_stages), by rows */

    /* A Rosenbrock method has, besides a_ij = alpha_ij and c_i = alpha_i, s x s by rows,
     *
     *     k_i = f(t0 + alpha_i h, y0 + h sum_j alpha_ij k_j) + h f_y sum_j gamma_ij k_j + h f_t sum_j gamma_ij
     *
     * It has no `dense_terms`: its dense output is a quartic of its own. */
    const double *gamma;              /* s x s by rows; NULL for others */
    const kt_rosenbrock *transformed; /* the same table as steps compute with it; opaque */

    /* A multistep method of n steps. The table above then has the Runge-Kutta method of its first steps.
     * Its own steps are:
     *
     *     y1 = sum_i past_i y_(1-i) + h sum_j slopes_j f_(1-j),   i = 1 .. n, j = 0 .. n
     *
     * An explicit multistep method predicts y1 = y0 + h sum_j predictor_j f_(1-j), j = 1 .. n. It evaluates f at the
     * predicted y1 and uses this value for f_1 (PECE). */
    int steps;               /* n; 0: a method of one step */
    const double *past;      /* n; NULL: explicit (1, 0, ...), or as `rho` has it */
    const double *slopes;    /* n + 1; NULL: as `rho` has it */
    const double *predictor; /* n; explicit */
    double rho;              /* of the family two-step: the spectral radius at infinity, 0 to 1 */
} kt_method;

/* The number of built-in methods. */
KT_API int kt_method_count(void);

/* The built-in method at 0 <= index < kt_method_count(), by rising order; NULL outside. Static storage. */
KT_API const kt_method *kt_method_at(int index);

/* The built-in method of this name; NULL if there is none. The name is written as in scene files ("implicit-euler") or
 * as in KT_METHOD_LIST ("implicit_euler"). Static storage. */
KT_API const kt_method *kt_method_find(const char *name);

/* Writes the names of the built-in methods, or only of the adaptive ones, in one line: "euler, midpoint, heun". Writes
 * as much as fits, a NUL included, and returns the length of the whole text, as snprintf does. */
KT_API size_t kt_method_names(bool adaptive, char *text, size_t size);

/* "explicit", "stabilised", "adams", "dirk", "two-step", "rosenbrock", "radau", "switching". Static storage. */
KT_API const char *kt_method_family_name(const kt_method *method);

/* Returns whether all steps solve Newton's equations, with a Jacobian of the right-hand side: for stiff equations. */
KT_API bool kt_method_is_implicit(const kt_method *method);

/* Returns whether the method estimates its error, and so can choose its steps. */
KT_API bool kt_method_is_adaptive(const kt_method *method);

/* Returns whether the number of stages follows from the step (stabilised methods). `stages` is then the least number.
 */
KT_API bool kt_method_stages_vary(const kt_method *method);

/* The order q of the method's dense output, uniformly in theta: the interpolated value has an error of O(h^(q+1)). An
 * order q = p - 1 preserves the order p of recorded values, because interpolation errors do not accumulate. */
KT_API int kt_method_dense_order(const kt_method *method);

/* Checks a table. The conditions are
 *   Sizes are allowed, and entries are finite.
 *   Row sums are c_i = sum_j a_ij.
 *   The order condition sum_i b_i Phi_i(t) = 1 / gamma(t) is fulfilled for every rooted tree t of up to `order` nodes
 *     (HNW II.2, theorem 2.13).
 *   The embedded weights have their order.
 *   The dense output has its order for all theta (HNW II.6).
 *
 * A residual passes if rounding the coefficients to double explains it. The bound is nodes * eps * (the sum of the
 * absolute values of the terms).
 *
 * Errors: KT_ERROR_ARGUMENT, naming the first condition that fails and its residual.
 *
 * Cost: order 4 has 8 trees, and order 8 has 200. Each tree takes O(nodes s^2). Allocates nothing; 40 kB of stack. */
KT_API KT_CHECKED kt_status kt_method_check(const kt_method *method, kt_error *error);

/* ---- linear stability -------------------------------------------------------------------------------------------- */

/* A complex number, re + i im. */
typedef struct kt_complex {
    double re, im; /* real and imaginary part */
} kt_complex;

/* The stability function R of a method: y' = lambda y gives y1 = R(h lambda) y0.
 *   Explicit: the polynomial R(z) = 1 + sum_k z^k b' A^(k-1) 1.
 *   Stabilised: R(z) = a + b T_s(w0 + w1 z).
 *   Implicit: a rational R = P / Q.
 *   Multistep: the n roots xi of the characteristic polynomial sum_i c_i(z) xi^(n-i). R is the principal root, which
 *     approximates e^z. The other roots are spurious.
 *
 * The struct has no pointers to own memory and may be copied.
 * Source: Hairer and Wanner, Solving ODE II, IV.2 and IV.3. */
typedef struct kt_stability {
    const kt_method_family *family;               /* of the method: selects one of these forms */
    int degree;                                   /* of R, or of P */
    double coefficient[KT_METHOD_STAGES_MAX + 1]; /* explicit: of z^0 .. z^degree; implicit: of P */
    int poles;                                    /* implicit: the degree of Q; 0 for others */
    double denominator[KT_METHOD_STAGES_MAX + 1]; /* implicit: of Q */
    double w0, w1, a, b;                          /* stabilised: P(z) = a + b T_s(w0 + w1 z) */
    int copies; /* stabilised: 1: R = P; 3: R = P(z) / 12 - 4 P(z/2)^2 / 3 + 9 P(z/3)^3 / 4 */
    int steps;  /* multistep: n; 0 for others */
    double characteristic[KT_METHOD_STEPS_MAX + 1][3]; /* multistep: of c_i(z), z^0 .. z^2 */
} kt_stability;

/* Computes the stability function of a method, which may be a caller's own table that kt_method_check has accepted.
 * `stages` is read for a stabilised method only: 2 to KT_STABILISED_STAGES_MAX.
 *
 * Errors: KT_ERROR_ARGUMENT (sizes, or stages, out of range).
 * Cost: O(s^3). */
KT_API KT_CHECKED kt_status kt_stability_make(const kt_method *method, int stages, kt_stability *stability,
                                              kt_error *error);

/* The number of stages that a stabilised method takes if `z` is the step times the largest |lambda|, its margin
 * included. For a tableau, its own number. KT_STABILISED_STAGES_MAX + 1 if no allowed number is sufficient. */
KT_API int kt_stability_stages(const kt_method *method, double z);

/* The function kt_stability_value returns R(z). For a multistep method, this is the root nearest to e^z. The function
 * kt_stability_gain returns the growth of a mode in a step, |R(z)|. For a multistep method, this is the largest |xi|.
 * O(degree). */
KT_API kt_complex kt_stability_value(const kt_stability *stability, kt_complex z);
KT_API double kt_stability_gain(const kt_stability *stability, kt_complex z);

/* Evaluates |R| on a grid of columns x rows points, both 2 or more, from `low` (gain[0]) to `high`, row by row. Row i
 * has the imaginary part low.im + i (high.im - low.im) / (rows - 1). For contours: the boundary of stability is |R| =
 * 1. */
KT_API void kt_stability_grid(const kt_stability *stability, kt_complex low, kt_complex high, int columns, int rows,
                              double *gain);

/* The function kt_stability_real_limit returns the largest x for which |R| <= 1 on [-x, 0] of the real axis. The
 * function kt_stability_imaginary_limit returns the largest y for which |R| <= 1 on [-iy, iy] of the imaginary axis. It
 * returns 0 if there is none (Euler, Heun, midpoint). Both limits are exact to a few roundings. HUGE_VAL if an implicit
 * method has no limit. */
KT_API double kt_stability_real_limit(const kt_stability *stability);
KT_API double kt_stability_imaginary_limit(const kt_stability *stability);

/* Verdicts of linear stability [MSD 5.3]. */
typedef struct kt_stability_verdict {
    bool a_stable;      /* for all steps, no mode that decays or oscillates in the exact solution grows: |R| <= 1 if
                           Re z <= 0 */
    bool l_stable;      /* A-stable, and an infinitely fast decay vanishes within a step: R goes to 0 */
    double at_infinity; /* |R| at infinity, the spectral radius there; HUGE_VAL of an explicit method */
} kt_stability_verdict;

/* Judges a method by its stability function, on the imaginary axis and to the left of it. The points have |z|
 * from 1e-4 to 1e6. On the axis there are 40 points per factor of ten. The verdicts hold to 1e-7.
 * Cost: 1,000 values of R, for an implicit method only. */
KT_API kt_stability_verdict kt_stability_judge(const kt_stability *stability);

/* The spurious growth of a mode: the factor, over a run of `duration`, by which a numerical solution of y' = lambda y
 * exceeds the exact one. If the exact solution decays, the factor is relative to the initial value:
 *
 *     growth = (|R(h lambda)| / max(1, e^(h Re lambda)))^(duration / h)
 *
 * The factor is at most 1 if the method damps the mode. An undamped mode, on the imaginary axis, is judged by the same
 * factor, not by rounding. A method that is unstable there (Euler, Heun, midpoint) makes it grow slowly, and the
 * duration of the run decides whether this is visible.
 *
 * If the exact solution grows, the mode is followed for at most the time 1 / Re lambda, in which it grows by e. The
 * motion is no longer linear after that time.
 *
 * R of an implicit method has poles in the half plane of growing modes. Near these poles the numerical solution grows
 * faster than the exact one, which is an error of accuracy. Such a mode is replaced by the undamped mode of its
 * frequency, Re lambda = 0.
 *
 * HUGE_VAL if the factor cannot be computed. `step`, `duration` > 0. */
KT_API double kt_stability_growth(const kt_stability *stability, kt_complex lambda, double step, double duration);

/* The error of a mode after one of its periods, T = 2 pi / |Im lambda|: |R(h lambda)^(T / h) - e^(lambda T)|. The error
 * is relative to the amplitude at the start of the period and combines amplitude and phase. The error is at least 1
 * with fewer than two steps per period. Im lambda is not 0. */
KT_API double kt_stability_period_error(const kt_stability *stability, kt_complex lambda, double step);

/* The growth over a run that still counts as stable: a factor of 2. The limit of a damped mode hardly depends on this
 * factor, because a run has many steps. An undamped mode of Heun's method has a phase error above a radian before its
 * amplitude has doubled. */
#define KT_STABILITY_GROWTH 2.0

/* The largest step up to which kt_stability_growth stays within `growth` (> 1; KT_STABILITY_GROWTH) for every
 * eigenvalue. HUGE_VAL if no eigenvalue bounds the step, 0 if the method's sizes are out of range. *index (or NULL)
 * receives the eigenvalue that bounds it, or -1. Rounding of an eigenvalue that is zero, or on the imaginary axis, does
 * not change the result. A stabilised method takes the stages that each step needs, as in a run. Its step stays within
 * the range that the largest number of stages covers. The result is accurate to 1e-12. Allocates nothing.
 * Cost: some hundred values of R for the fastest eigenvalue, fewer for the others. A stabilised method takes a thousand
 * values for each. */
KT_API double kt_stability_step(const kt_method *method, const kt_complex *eigenvalues, size_t count, double duration,
                                double growth, ptrdiff_t *index);

/* The growth (kt_stability_growth) of the eigenvalue that grows most with a step; 1 if there is none. *index is as for
 * kt_stability_step. HUGE_VAL if a stabilised method has too few stages for the step. O(count degree). */
KT_API double kt_stability_worst(const kt_method *method, const kt_complex *eigenvalues, size_t count, double step,
                                 double duration, ptrdiff_t *index);

/* ---- integrator -------------------------------------------------------------------------------------------------- */

/* An integrator: the state of one integration. */
typedef struct kt_integrator kt_integrator;

/* The functions that an integrator calls. They return
 *   0: continue;
 *   > 0: recoverable. An adaptive method repeats the step with a smaller size. A fixed step fails;
 *   < 0: stop. A stopped step leaves the integrator unchanged and may be repeated.
 *
 * A caller can keep an own error message behind `user`.
 *
 * rhs: dydt = f(t, y), n values, a function of its arguments alone. It is never called with a t beyond the limit given
 * to kt_integrator_step (as long as 0 <= c_i <= 1, as in all built-in methods).
 *
 * project (or NULL): after each accepted try, before it is committed, this function may move y onto a manifold.
 * *changed is true on entry. Set it to false only if not one bit of y was moved. A method with fsal then reuses its
 * last stage as the slope of the next step. Otherwise the slope is evaluated again. With fsal methods, a projection to
 * 1e-16 after each step therefore costs one evaluation a step. A callback avoids this cost if it leaves y unchanged
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
 * jacobian: computes J at (t, y), n values, with f = dydt there, and keeps it. > 0: J cannot be computed there; the
 * previous J must be kept unchanged.
 *
 * factor: factors sigma - J with the J that is kept. Factors for a sigma with im = 0 and for a complex sigma are
 * separate: a method may use one of each. > 0: singular.
 *
 * autonomous (NULL: f may depend on t): returns whether f does not depend on t. A Rosenbrock method then needs no time
 * derivative.
 *
 * time_derivative (NULL: none): writes df/dt at (t, y), with f = dydt there, to slope: n values, which are zero on
 * entry. At a breakpoint of f it is the derivative just after t. > 0: the derivative is not available; it is found by
 * differences of f.
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

/* How a simulation steps over hard contacts, stops, slack ropes and friction that sticks. X(id, name in scene files) */
#define KT_CONTACT_SCHEME_LIST(X)                                                                                      \
    X(KT_CONTACT_EVENTS, events) /* impacts and transitions are events at which steps end */                           \
    X(KT_CONTACT_STEPS, steps)   /* time stepping: fixed steps with impulses, which end at no event */

/* The scheme of a simulation. Time stepping is Moreau's midpoint rule, of first order. It needs a fixed step
 * (kt_run.step), has no other method, and follows Newton's rule alone. */
typedef enum kt_contact_scheme {
#define KT_CONTACT_SCHEME_ENUM(id, name) id,
    KT_CONTACT_SCHEME_LIST(KT_CONTACT_SCHEME_ENUM)
#undef KT_CONTACT_SCHEME_ENUM
        KT_CONTACT_SCHEME_COUNT /* how many */
} kt_contact_scheme;

/* The least relative tolerance, the rounding of numbers (2^-52). A smaller one is rejected: no step could meet it. */
#define KT_TOLERANCE_LEAST 2.220446049250313e-16

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
 *     17 n                            stabilised
 *     4 n^2 + 23 n                    rodas5p
 *     4 n^2 + 21 n                    radau5
 *     4 n^2 + 25 n                    auto
 *     4 n^2 + 18 n                    bdf2, two-step
 *     4 n^2 + 15 n                    implicit-euler, crank-nicolson */
KT_API size_t kt_integrator_size(const kt_method *method, size_t n);

/* Initialises an integrator in the caller's memory. n >= 1. Checks options and, if the method is not a built-in one,
 * the method. Call kt_integrator_start next.
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

/* Takes one accepted step towards t_limit, never beyond it, with as many rejected tries as it needs. t_limit is
 * INFINITY if there is no limit. A t_limit before the current time integrates backwards. The step that reaches t_limit
 * ends at it exactly.
 *
 * Fixed step: ends at t0 + k h, without accumulated rounding. A t_limit between two of these points is an extra stop,
 * after which the steps return to the same grid. A t_limit within rounding of a grid point is that grid point.
 *
 * Adaptive: if less than two steps are left until t_limit, they are made equal.
 *
 * On failure time, state, control and interpolant keep their bits. Only the counts of work done have grown, and
 * progress is counted anew.
 *
 * Errors:
 *   KT_ERROR_ARGUMENT: not started, or t_limit is NaN or the current time.
 *   KT_ERROR_NOT_FINITE: a slope or the new state is not finite. With a fixed step the first such value is an error; at
 *     the current state it is an error in either mode.
 *   KT_ERROR_STEP: the step became too small, max_steps are used up, or there is no progress. Progress is measured over
 *     windows of 10,000 tries, relative to the larger of |t| and |t_limit|. There is none if a window advances by less
 *     than 1e-6, or if five windows in a row advance by less than 1e-5 each. The same error reports a fixed step or
 *     max_step below the rounding of the time, and tolerances below the rounding of the state.
 *   KT_ERROR_CALLBACK: a callback stopped, or failed recoverably with a fixed step.
 *
 * Stabilised (rkc2, rkc4): a fixed step may need more stages than there are, which is KT_ERROR_STEP. An adaptive step
 * is kept short enough for the available stages. The fastest decay of the right-hand side is estimated by differences,
 * with four to eight evaluations. An estimate is made at the start, every 25 steps (5 with a fixed step), and after a
 * rejected try. If the estimate has not settled to a hundredth after eight evaluations, it is used with the usual
 * margin, and counted (capped).
 *
 * Multistep (ab2, ab4, bdf2, two-step): steps are fixed. The formula needs past steps of the same length. Too few exist
 * at the start, after kt_integrator_jump, and before and after a step that t_limit cuts short. The one-step method in
 * the table, which has the same order, then takes the step, so that the order is preserved. It is Heun's method for
 * ab2, Kutta's of order 4 for ab4, and a diagonally implicit L-stable one for the others.
 *
 * Rosenbrock (rodas5p): a step solves eight linear systems with one matrix and iterates nothing.
 *   The order depends on an exact Jacobian, which is computed at every step. If it cannot be computed, the old one is
 *     used, or none if the old one misleads. Such a step is counted (capped).
 *   If f depends on time, its time derivative comes from the caller (kt_newton) or from two more evaluations. The
 *     latter have an error of 1e-7 h^4 f_ttt in a step.
 *   Quadratures take two more evaluations, too; they have order 4.
 *   A singular matrix requires a shorter step. With a fixed step this is KT_ERROR_STEP.
 *
 * Implicit (implicit-euler, crank-nicolson, bdf2, two-step, radau5): each try iterates at most 7 times. With fixed
 * steps the limit is 50, and the iteration goes down to rounding.
 *   If an iteration does not converge, a new Jacobian is computed. If it still does not converge, the step is
 *     shortened.
 *   With a fixed step, radau5 fails with KT_ERROR_STEP. The others, which solve for one stage at a time, continue with
 *     damped corrections and a new Jacobian in each iteration. They fail after at most 50 iterations.
 *   The Jacobian is kept as long as the iteration contracts thirtyfold. If it cannot be computed, the old one is kept.
 *
 * Switching (auto): takes steps of dopri5, equal to the last bit, until stability alone bounds them. It then takes
 * steps of radau5, until dopri5 would be cheaper again. The decision is made after an accepted step, from its last two
 * stages or from the Jacobian in use, and takes no evaluation. With a fixed step auto is dopri5.
 *
 * Cost: for each try, in terms of evaluations and operations:
 *   Explicit methods take s evaluations and O(s^2 n / 2). With fsal they take s - 1 evaluations.
 *   Adams methods take 2 evaluations.
 *   A step of rodas5p takes 8 evaluations, a Jacobian and new factors.
 *   Stabilised methods take one evaluation and O(n) for each stage.
 *   Implicit methods take s - 1 evaluations and O(n^2) for each iteration. New factors take O(n^3). */
KT_API KT_CHECKED kt_status kt_integrator_step(kt_integrator *integrator, double t_limit, kt_error *error);

/* Evaluates y(t), n values, at a time within the last accepted step, its ends included. At the ends the result has the
 * same bits as the states there. Right after the start only the start time is allowed. y_out must not be inside the
 * integrator. Between the ends the value is not projected. No bit of any later step changes.
 *
 * Errors: KT_ERROR_ARGUMENT (t outside), KT_ERROR_CALLBACK, KT_ERROR_NOT_FINITE; y_out is then untouched.
 *
 * Cost: O(s n). Methods without fsal evaluate f(t1, y1) here, and the next step reuses the value. dop853 adds 3
 * evaluations, once a step. */
KT_API KT_CHECKED kt_status kt_integrator_interpolate(kt_integrator *integrator, double t, double *y_out,
                                                      kt_error *error);

/* Returns f(t, y) at the current time and state: n values, valid until the next call that takes a non-const integrator.
 * The slope is already available after a step with fsal whose projection moved nothing, or after an earlier call of
 * this function. Otherwise it is evaluated here, and the next step reuses it. No evaluation is made twice, and no bit
 * of any later step changes.
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
KT_API kt_integrator_counts kt_integrator_counts_get(const kt_integrator *integrator);

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
    kt_integrator_counts counts; /* as kt_integrator_counts_get returns them */
} kt_integrator_memory;

/* The memory of an integrator. Valid until the next call that takes a non-const integrator. */
KT_API const kt_integrator_memory *kt_integrator_memory_get(const kt_integrator *integrator);

/* Returns how many numbers of earlier steps the method keeps. A checkpoint holds them as `history`.
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
 * same bits as without the interruption. With previous_y the last step can be interpolated again; its stages are
 * evaluated once more. With NULL it cannot be interpolated.
 *
 * Errors: as kt_integrator_start. */
KT_API KT_CHECKED kt_status kt_integrator_restore(kt_integrator *integrator, const kt_integrator_memory *memory,
                                                  const double *y, const double *previous_y, const double *history,
                                                  const kt_integrator_callbacks *callbacks, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
