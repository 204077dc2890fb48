/* Methods for ordinary differential equations y' = f(t, y), y in R^n: explicit, stabilised and implicit Runge-Kutta
 * methods, multistep methods, and one that chooses between explicit and implicit by itself, fixed and adaptive steps,
 * dense output, linear stability.
 *
 * A method is a constant struct of coefficients, kt_method. An integrator lives in the caller's memory and allocates
 * nothing; it owns the current time and state, and what the step-size control remembers. Two threads may use two
 * integrators at once, never one. Equal inputs give equal bits, on every instruction set.
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
 * (below: HNW), sections II.1 - II.6; each table names its own.
 */
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

/* The built-in methods, in rising order. A small library lacks those that
 * stand out: the implicit and the multistep ones. */
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

/* How the methods of one kind step: explicit; stabilised (explicit, with as many stages as the fastest decay of the
 * right-hand side needs); adams (explicit, multistep, predictor and corrector); dirk, radau, rosenbrock and two-step
 * (implicit, for stiff equations, the last one multistep); or switching (explicit until the motion is stiff, and
 * implicit while it is). Opaque; kt_method_family_name tells which. */
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
 * terms that vanish at both ends together with their slopes (the form of HNW's codes DOPRI5 and DOP853):
 *
 *     y(theta) = y0 + theta (F0 + theta' (F1 + theta (F2 + theta' (F3 + theta (F4 + theta' (F5 + ...)))))),
 *     theta' = 1 - theta,  F0 = y1 - y0,  F1 = h k_1 - F0,  F2 = F0 - h f(t1, y1) - F1,
 *     F_{3+m} = h sum_i d_mi k_i,  m = 0 .. dense_terms - 1
 *
 * so that it is C1 across steps, whatever a projection did to y1. The sum over i runs over the s stages, the slope
 * f(t1, y1) (which is the last stage itself where fsal is set), and dense_stages further stages, in this order.
 *
 * A caller's own table: clear the struct, fill in what it has (arrays stay the caller's and must outlive the
 * integrator), and hand it to kt_integrator_init, which calls kt_method_check and refuses a table whose order
 * conditions fail. */
typedef struct kt_method {
    const char *name; /* as in scene files: "rk4" */
    const char *
        title; /* for people: "Runge-Kutta 4, Kutta 1901"; NULL in a library for a machine without an operating system */
    const char *source; /* where the coefficients are published; likewise */

    /* NULL: explicit, as a caller's own table must be. For a stabilised method the stages follow from a recurrence, and
     * a step takes as many of them, up to KT_STABILISED_STAGES_MAX, as the fastest decay of the right-hand side needs;
     * its table is that of the member with the fewest. */
    const kt_method_family *family;

    int stages;             /* s */
    int order;              /* p of b */
    int embedded_order;     /* of b - e; 0: no error estimate */
    int embedded_order_low; /* of b - e_low; 0: one estimate. With two, err = err_e^2 / sqrt(err_e^2 + 0.01 err_low^2),
                               HNW II.10 */
    bool fsal;              /* the last stage is f(t1, y1): its row of a is b, its c is 1 */
    const double *a;        /* s (s - 1) / 2, strictly lower triangle by rows: a21, a31, a32, a41, ...; of an implicit
                               method s x s by rows */
    const double *b;        /* s */
    const double *c;        /* s, c_i = sum_j a_ij */
    const double *e;        /* s, b minus the embedded weights; NULL without estimate */
    const double *e_low;    /* s, or NULL */

    int dense_order;       /* of y(theta), uniformly in theta; 0 stands for min(p, 3), that of the cubic alone */
    int dense_terms;       /* terms beyond the cubic */
    int dense_stages;      /* stages only the dense output needs */
    const double *dense_a; /* their rows of a, each over all slopes before it: w, w + 1, ... long, w = s + !fsal */
    const double *dense_c; /* dense_stages */
    const double *dense_d; /* dense_terms x (w + dense_stages), by rows */

    /* A Rosenbrock method has, besides a_ij = alpha_ij and c_i = alpha_i, s x s by rows,
     *     k_i = f(t0 + alpha_i h, y0 + h sum_j alpha_ij k_j) + h f_y sum_j gamma_ij k_j + h f_t sum_j gamma_ij
     * and no `dense_terms`: its dense output is a quartic of its own. */
    const double *gamma;              /* s x s by rows; NULL for others */
    const kt_rosenbrock *transformed; /* the same table as steps compute with it; opaque */

    /* A multistep method of n steps; the table above is then that of the Runge-Kutta method which starts it:
     *
     *     y1 = sum_i past_i y_(1-i) + h sum_j slopes_j f_(1-j),   i = 1 .. n, j = 0 .. n
     *
     * An explicit one predicts y1 = y0 + h sum_j predictor_j f_(1-j), j = 1 .. n, and takes f there for f_1 (PECE). */
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

/* The built-in method of this name, as in scene files ("implicit-euler") or as in KT_METHOD_LIST ("implicit_euler");
 * NULL if there is none. Static storage. */
KT_API const kt_method *kt_method_find(const char *name);

/* The names of the built-in methods, or of the adaptive ones among them, in one line: "euler, midpoint, heun". Writes
 * as many of them as fit, a NUL included, and returns the length of all, as snprintf does. */
KT_API size_t kt_method_names(bool adaptive, char *text, size_t size);

/* "explicit", "stabilised", "adams", "dirk", "two-step", "rosenbrock", "radau", "switching". Static storage. */
KT_API const char *kt_method_family_name(const kt_method *method);

/* Whether all steps solve Newton's equations, with a Jacobian of the right-hand side: for stiff equations. */
KT_API bool kt_method_is_implicit(const kt_method *method);

/* Whether the method estimates its error, and so can choose its steps. */
KT_API bool kt_method_is_adaptive(const kt_method *method);

/* Whether the number of stages follows from the step (stabilised methods), so that `stages` is the least of them. */
KT_API bool kt_method_stages_vary(const kt_method *method);

/* The order of the method's dense output, uniformly in theta: the interpolated value is off by O(h^(q+1)). An order q
 * = p - 1 does not spoil the order p of what is recorded, since the interpolation error is not carried on. */
KT_API int kt_method_dense_order(const kt_method *method);

/* Checks a table: sizes; finite entries; row sums c_i = sum_j a_ij; for every rooted tree t of up to `order` nodes
 * the order condition sum_i b_i Phi_i(t) = 1 / gamma(t) (HNW II.2, theorem 2.13); the embedded weights to their
 * order; the dense output to its order for all theta (HNW II.6). A residual passes if rounding
 * the coefficients to double explains it: nodes * eps * (the sum of the absolute values of the terms).
 *
 * Errors: KT_ERROR_ARGUMENT, naming the first condition that fails and its residual.
 *
 * Cost: 8 trees for order 4, 200 for order 8, each O(nodes s^2). Allocates nothing; 40 kB of stack. */
KT_API KT_CHECKED kt_status kt_method_check(const kt_method *method, kt_error *error);

/* ---- linear stability -------------------------------------------------------------------------------------------- */

/* A complex number, re + i im. */
typedef struct kt_complex {
    double re, im; /* real and imaginary part */
} kt_complex;

/* What a method makes of y' = lambda y: y1 = R(h lambda) y0; Hairer and Wanner, Solving ODE II, IV.2 and IV.3. An
 * explicit method has the polynomial R(z) = 1 + sum_k z^k b' A^(k-1) 1, a stabilised method R(z) = a + b T_s(w0 +
 * w1 z), an implicit method a rational R = P / Q. A multistep method has the roots xi of its characteristic polynomial
 * sum_i c_i(z) xi^(n-i), one for each step: R is the one that stands for the motion, e^z, and the others are spurious.
 * Plain; copy it. */
typedef struct kt_stability {
    const kt_method_family *family;               /* of the method: which of these it is */
    int degree;                                   /* of R, or of P */
    double coefficient[KT_METHOD_STAGES_MAX + 1]; /* explicit: of z^0 .. z^degree; implicit: of P */
    int poles;                                    /* implicit: the degree of Q; 0 for others */
    double denominator[KT_METHOD_STAGES_MAX + 1]; /* implicit: of Q */
    double w0, w1, a, b;                          /* stabilised: P(z) = a + b T_s(w0 + w1 z) */
    int copies; /* stabilised: 1: R = P; 3: R = P(z) / 12 - 4 P(z/2)^2 / 3 + 9 P(z/3)^3 / 4 */
    int steps;  /* multistep: n; 0 for others */
    double characteristic[KT_METHOD_STEPS_MAX + 1][3]; /* multistep: of c_i(z), z^0 .. z^2 */
} kt_stability;

/* The stability function of a method, a caller's own table included (which kt_method_check has passed). `stages` is
 * read for a stabilised method alone: 2 to KT_STABILISED_STAGES_MAX. O(s^3).
 *
 * Errors: KT_ERROR_ARGUMENT (sizes, or stages, out of range). */
KT_API KT_CHECKED kt_status kt_stability_make(const kt_method *method, int stages, kt_stability *stability,
                                              kt_error *error);

/* The stages that a stabilised method takes where `z` is the step times the largest |lambda|, its margin included; a
 * tableau's own number. KT_STABILISED_STAGES_MAX + 1 where there are not enough. */
KT_API int kt_stability_stages(const kt_method *method, double z);

/* R(z), of a multistep method the root that is nearest to e^z; and how much a mode grows in a step, |R(z)|, of a
 * multistep method the largest |xi|. O(degree). */
KT_API kt_complex kt_stability_value(const kt_stability *stability, kt_complex z);
KT_API double kt_stability_gain(const kt_stability *stability, kt_complex z);

/* |R| on a grid of columns x rows points, both 2 or more, from `low` (gain[0]) to `high`, row by row: row i has the
 * imaginary part low.im + i (high.im - low.im) / (rows - 1). For contours: the boundary of stability is |R| = 1. */
KT_API void kt_stability_grid(const kt_stability *stability, kt_complex low, kt_complex high, int columns, int rows,
                              double *gain);

/* The largest x for which |R| <= 1 on [-x, 0] of the real axis; the largest y for which |R| <= 1 on [-iy, iy] of the
 * imaginary axis, 0 where there is none (Euler, Heun, midpoint). To a few roundings. HUGE_VAL where an implicit method
 * has no limit. */
KT_API double kt_stability_real_limit(const kt_stability *stability);
KT_API double kt_stability_imaginary_limit(const kt_stability *stability);

/* Verdicts of linear stability [MSD 5.3]. */
typedef struct kt_stability_verdict {
    bool a_stable;      /* no mode that decays or swings in truth grows, whatever the step: |R| <= 1 where Re z <= 0 */
    bool l_stable;      /* and what decays infinitely fast is gone after a step: R goes to 0 */
    double at_infinity; /* |R| there, the spectral radius at infinity; HUGE_VAL of an explicit method */
} kt_stability_verdict;

/* Judges a method by its stability function, on the imaginary axis and on the left of it, at points from |z| = 1e-4 to
 * 1e6, 40 per factor of ten on the axis; to 1e-7. Cost: 1,000 values of R, of an implicit method alone. */
KT_API kt_stability_verdict kt_stability_judge(const kt_stability *stability);

/* How much a step makes of a mode what the motion does not: the factor, over a run of `duration`, by which a solution
 * of y' = lambda y grows beyond what it does in truth, or beyond its start where in truth it decays:
 *
 *     growth = (|R(h lambda)| / max(1, e^(h Re lambda)))^(duration / h)
 *
 * At most 1 where the method damps the mode. So an undamped mode, on the imaginary axis, is no matter of rounding: a
 * method that is not stable there (Euler, Heun, midpoint) makes it grow slowly, and whether that shows depends on how
 * long one looks. A mode that grows in truth is followed for no more than the time 1 / Re lambda in which it grows by
 * e: what comes after is no longer linear. An implicit method's R has poles where modes grow; near them it grows faster
 * than the motion, which is a matter of accuracy: such a mode is taken as the undamped one of its frequency, Re lambda
 * =
 * 0. HUGE_VAL where the factor cannot be computed. `step`, `duration` > 0. */
KT_API double kt_stability_growth(const kt_stability *stability, kt_complex lambda, double step, double duration);

/* By how much a mode is off after one of its periods, T = 2 pi / |Im lambda|, over its amplitude at the period's begin:
 * |R(h lambda)^(T / h) - e^(lambda T)|, amplitude and phase together; with fewer than two steps a period 1 at least.
 * Im lambda is not 0. */
KT_API double kt_stability_period_error(const kt_stability *stability, kt_complex lambda, double step);

/* How much growth over a run still counts as stable: twice. A damped mode's limit hardly depends on it (a run has many
 * steps); an undamped one of Heun's method is then off by more than a radian in phase before it has doubled. */
#define KT_STABILITY_GROWTH 2.0

/* The largest step up to which kt_stability_growth stays within `growth` (> 1; KT_STABILITY_GROWTH) for every
 * eigenvalue; HUGE_VAL where none bounds it, 0 where the method's sizes are out of range. *index (or NULL): the
 * eigenvalue that bounds it, or -1. An eigenvalue that is zero, or on the imaginary axis, up to rounding makes no
 * difference. A stabilised method is taken as it runs: with the stages that it takes for each step; the step is within
 * that for which it has stages enough. To 1e-12. Allocates nothing. Cost: some hundred values of R for the fastest
 * eigenvalue, fewer for the others; for a stabilised method a thousand for each. */
KT_API double kt_stability_step(const kt_method *method, const kt_complex *eigenvalues, size_t count, double duration,
                                double growth, ptrdiff_t *index);

/* The growth (kt_stability_growth) of the eigenvalue that grows most with a step; 1 where there is none. *index as
 * above. HUGE_VAL where a stabilised method has too few stages for the step. O(count degree). */
KT_API double kt_stability_worst(const kt_method *method, const kt_complex *eigenvalues, size_t count, double step,
                                 double duration, ptrdiff_t *index);

/* ---- integrator -------------------------------------------------------------------------------------------------- */

/* An integrator: one motion under way. */
typedef struct kt_integrator kt_integrator;

/* Callbacks return 0: go on; > 0: recoverable, a smaller step may help (adaptive: the try is rejected; fixed: an
 * error); < 0: stop. A stopped step leaves the integrator as it was and may be taken again. A caller who wants a
 * message of its own keeps it behind `user`.
 *
 * rhs: dydt = f(t, y), n values, of its arguments alone. It is never asked for a t beyond the limit given to
 * kt_integrator_step (as long as 0 <= c_i <= 1, as in all built-in methods).
 *
 * project (or NULL): after each accepted try, before it is committed, may move y onto a manifold. *changed is true on
 * entry; set it to false only if not one bit of y was moved: then a method with fsal reuses its last stage as the
 * slope of the next step, otherwise the slope is evaluated again. A projection to 1e-16 after each step costs one
 * evaluation a step with fsal methods; a callback that leaves y alone while its defect is well below the tolerance
 * saves it, and state and slope still belong together to the last bit. */
typedef struct kt_integrator_callbacks {
    int (*rhs)(double t, const double *y, double *dydt, void *user); /* dydt = f(t, y), n numbers each */
    int (*project)(double t, double *y, bool *changed, void *user);  /* y back to a manifold; NULL: none */
    void *user;                                                      /* handed to both */
} kt_integrator_callbacks;

/* How a caller solves Newton's equations of an implicit method, (sigma - J) x = r with J = f_y, where it knows the
 * structure of f; kt_integrator_options.newton. The functions are handed the callbacks' `user` and return as those do;
 * J and the factors stay in the caller's memory, which belongs to one integrator.
 *
 * jacobian: computes J at (t, y), n values, where f = dydt, and keeps it. > 0: J cannot be computed there; what was
 * kept must be as it was.
 *
 * factor: factors sigma - J with the J that is kept; for a sigma with im = 0 and for others separately: a method may
 * use one of each. > 0: singular.
 *
 * autonomous (NULL: it may depend): whether f does not depend on t, so that a Rosenbrock method need not find its
 * slope.
 *
 * time_derivative (NULL: none): writes df/dt at (t, y), where f = dydt, to slope: n values, which are zero before; just
 * after t where f has a corner. > 0: it is not known, and is found by differences of f.
 *
 * solve: re + i im becomes (sigma - J)^-1 (re + i im), n values less the quadratures, with the last sigma of its kind;
 * `im` is NULL for the real one. */
typedef struct kt_newton {
    int (*jacobian)(double t, const double *y, const double *dydt, void *user); /* J at (t, y) */
    int (*factor)(kt_complex sigma, void *user);                                /* of sigma - J */
    int (*solve)(double *re, double *im, void *user);                           /* with these factors */
    bool (*autonomous)(void *user); /* Rosenbrock: whether f does not depend on t; NULL: it may */
    int (*time_derivative)(double t, const double *y, const double *dydt, double *slope,
                           void *user); /* Rosenbrock: df/dt */
} kt_newton;

/* A relative tolerance below this, the rounding of numbers (2^-52), is refused: no step could meet it. */
#define KT_TOLERANCE_LEAST 2.220446049250313e-16

/* How an integrator steps. */
typedef struct kt_integrator_options {
    size_t size; /* sizeof of this struct, for later versions; 0: as of version 0.2 */
    double step; /* > 0: fixed step, s; 0: adaptive, and the options below apply */

    /* Tolerances: a try passes if sqrt(mean((err_i / (absolute_i + relative max(|y0_i|, |y1_i|)))^2)) <= 1. */
    double relative_tolerance, absolute_tolerance; /* relative: 0, or at least KT_TOLERANCE_LEAST */
    const double *absolute_tolerances; /* n, instead of absolute_tolerance; NULL: none. Stays the caller's */

    double initial_step; /* > 0; 0: found from f and its change, after HNW II.4 */
    double min_step;     /* s; never below 16 eps |t| anyway */
    double max_step;     /* s; 0: no limit; one that is lost in the rounding of the time is refused by the step */

    /* PI control, Hairer and Wanner, Solving ODE II, IV.2: h_new = h safety err^(-alpha/k) err_last^(beta/k), err ~
     * h^k, within the two factors. */
    double safety, alpha, beta, factor_min, factor_max;

    uint64_t max_steps; /* accepted and rejected, since the start; 0: no limit */

    /* The last so many of the n equations are quadratures: f does not depend on them. They are integrated and
     * interpolated like the rest, but have no part in the error and in the choice of steps: they change not one
     * bit of the others. Less than n. */
    size_t quadratures;

    /* The first so many of the equations are those of positions, whose rates the others determine; 0: not known. auto
     * weighs differences of positions by the step, so that it sees modes that ring; no method's steps depend on it
     * otherwise. */
    size_t positions;

    /* Implicit methods: who solves Newton's equations. NULL: the integrator, with finite differences of f (central
     * ones for a Rosenbrock method, 2 n evaluations) and dense matrices. Must outlive the integrator. */
    const kt_newton *newton;
} kt_integrator_options;

/* Adaptive, tolerances 1e-6 and 1e-9, Hairer's control constants (safety 0.9, alpha 0.85, beta 0.2, factors 0.2 and
 * 10). */
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

/* Bytes for an integrator of n equations with this method, whatever the options; 0 if the method's sizes or n are out
 * of range or the size overflows. About (s + 4 + dense_stages) n doubles, n fewer with fsal; 17 n for a
 * stabilised method; one n more for each past slope of an Adams method, 1 of ab2 and 3 of ab4; 4 n^2 + 23 n for
 * rodas5p, 4 n^2 + 21 n for radau5, 4 n^2 + 25 n for auto, 4 n^2 + 18 n for bdf2 and two-step, 4 n^2 + 15 n for
 * implicit-euler and crank-nicolson. The memory needs no alignment. */
KT_API size_t kt_integrator_size(const kt_method *method, size_t n);

/* Initialises an integrator in the caller's memory, which must outlive it; nothing is to be released. n >= 1. Checks
 * options and, if the method is none of the built-in ones, the method. Needs kt_integrator_start next.
 *
 * Errors: KT_ERROR_ARGUMENT (options, n, the method, adaptive without an estimate), KT_ERROR_MEMORY (size too small).
 */
KT_API KT_CHECKED kt_status kt_integrator_init(void *memory, size_t size, const kt_method *method, size_t n,
                                               const kt_integrator_options *options, kt_integrator **integrator,
                                               kt_error *error);

/* Starts at time t from y (n values, copied), forgets all that was before, zeroes the counts. The callbacks are
 * copied. Calls none.
 *
 * Errors: KT_ERROR_ARGUMENT (no rhs), KT_ERROR_NOT_FINITE (t or y); the integrator is then as before. */
KT_API KT_CHECKED kt_status kt_integrator_start(kt_integrator *integrator, double t, const double *y,
                                                const kt_integrator_callbacks *callbacks, kt_error *error);

/* Replaces the state at the current time, as an event does: keeps time, grid, counts and the proposed step; forgets
 * slopes, the control's error memory, and the interpolant of the last step (interpolate up to the event first).
 *
 * Errors: as kt_integrator_start. */
KT_API KT_CHECKED kt_status kt_integrator_jump(kt_integrator *integrator, const double *y, kt_error *error);

/* One accepted step towards t_limit, never beyond it, with as many rejected tries as it needs. t_limit is INFINITY
 * where there is none; a t_limit before the current time integrates backwards. The step that reaches t_limit ends at
 * it exactly.
 *
 * Fixed step: ends at t0 + k h, without accumulated rounding; a t_limit between two of these is an extra stop, after
 * which the steps return to the same grid. A t_limit within rounding of a grid point is that grid point.
 *
 * Adaptive: where less than two steps are left, they are made equal.
 *
 * On failure time, state, control and interpolant are to the bit what they were; only the counts of work done have
 * grown, and progress is counted anew.
 *
 * Errors: KT_ERROR_ARGUMENT (not started, t_limit is NaN or the current time), KT_ERROR_NOT_FINITE (a slope or the
 * new state is not finite: at once in fixed mode, at the current state in either mode), KT_ERROR_STEP (the step
 * became too small, max_steps are used up, or there is no progress: 10,000 tries that have gone less than 1e-6 of the
 * larger of |t| and |t_limit|, or five times in a row less than 1e-5 of it), KT_ERROR_CALLBACK (a callback stopped, or
 * failed recoverably where the step is fixed).
 *
 * Stabilised (rkc2, rkc4): where the step is fixed it may need more stages than there are: KT_ERROR_STEP, and an
 * adaptive step is kept so short that it does not. How fast the right-hand side decays is estimated by differences, at
 * the start, every 25 steps (5 where the step is fixed), and where a try was rejected: four to eight evaluations. One
 * that has not settled to a hundredth after eight is taken as it is, with the margin of all, and counted (capped).
 *
 * Multistep (ab2, ab4, bdf2, two-step): steps are fixed. The formula needs past steps of the same length; where there
 * are not enough - at the start, after kt_integrator_jump, and before and after a step that is cut short by t_limit -
 * the one-step method of the same order that the table gives takes the step (Heun's of ab2, Kutta's of order 4 of ab4,
 * a diagonally implicit L-stable one of the others), so that the order stays.
 *
 * Rosenbrock (rodas5p): a step solves eight linear systems with one matrix and iterates nothing. Its order depends on
 * an exact Jacobian, which is computed at every step; where it cannot be, the old one serves on, or none where that one
 * misleads, and the step is counted (capped). Where f depends on time its slope is asked of the caller (kt_newton), or found by two more evaluations: off
 * by 1e-7 h^4 f_ttt in a step. With quadratures there are two more, too; these have order 4. A matrix that is singular
 * asks for a shorter step, and where the step is fixed that is KT_ERROR_STEP.
 *
 * Implicit (implicit-euler, crank-nicolson, bdf2, two-step, radau5): each try iterates at most 7 times, with fixed
 * steps 50 times (there to rounding). An iteration that does not converge asks for a new Jacobian, and with that one
 * still not, for a shorter step. Where the step is fixed, radau5 fails with KT_ERROR_STEP; the others, which solve for
 * one stage at a time, go on with damped corrections and a Jacobian in each of at most 50 iterations, and fail after
 * that. The Jacobian is kept as long as the iteration contracts thirtyfold; where it cannot be computed, the old one
 * serves on.
 *
 * Switching (auto): steps of dopri5, to the last bit, until they are bounded by stability alone; then steps of radau5,
 * until dopri5 would be cheaper again. The decision is made after an accepted step, from its last two stages or from
 * the Jacobian in use, and takes no evaluation. With a fixed step it is dopri5.
 *
 * Cost: s evaluations (s - 1 with fsal) and O(s^2 n / 2) a try; 2 of an Adams method; of rodas5p 8, a Jacobian and new
 * factors a step; a stabilised method's stages each O(n); an implicit
 * method's iterations s - 1 evaluations each and O(n^2), new factors O(n^3). */
KT_API KT_CHECKED kt_status kt_integrator_step(kt_integrator *integrator, double t_limit, kt_error *error);

/* y(t), n values, at a time within the last accepted step, its ends included (at the ends the very states, bit for
 * bit); right after the start only at the start. y_out must not be inside the integrator. Between the ends the value
 * is not projected. Changes no bit of any later step. Methods without fsal evaluate f(t1, y1) here, which the next
 * step then need not; dop853 adds 3 evaluations, once a step.
 *
 * Errors: KT_ERROR_ARGUMENT (t outside), KT_ERROR_CALLBACK, KT_ERROR_NOT_FINITE; y_out is then untouched.
 *
 * Cost: O(s n). */
KT_API KT_CHECKED kt_status kt_integrator_interpolate(kt_integrator *integrator, double t, double *y_out,
                                                      kt_error *error);

/* f(t, y) at the current time and state, n values, valid until the next call that takes a non-const integrator. Where
 * the last step has left it (fsal, and its projection moved nothing) or a call before this one, it is that; else it is
 * evaluated here, and the next step need not: no evaluation is made twice, and no bit of any later step changes.
 *
 * Errors: KT_ERROR_ARGUMENT (not started), KT_ERROR_CALLBACK, KT_ERROR_NOT_FINITE; the integrator is then as before. */
KT_API KT_CHECKED kt_status kt_integrator_derivative(kt_integrator *integrator, const double **slope, kt_error *error);

/* In turn: the current time; the current state (n values, valid until the next call that takes a non-const integrator);
 * the time where the last step began (the current time before any); n; the method. O(1). */
KT_API double kt_integrator_time(const kt_integrator *integrator);
KT_API const double *kt_integrator_state(const kt_integrator *integrator);
KT_API double kt_integrator_previous_time(const kt_integrator *integrator);
KT_API size_t kt_integrator_dimension(const kt_integrator *integrator);
KT_API const kt_method *kt_integrator_method(const kt_integrator *integrator);

/* What has been done since the start. */
typedef struct kt_integrator_counts {
    uint64_t steps;       /* accepted */
    uint64_t rejected;    /* tries */
    uint64_t evaluations; /* of the right-hand side, rejected tries and interpolation included */
    uint64_t capped;      /* stabilised: estimates of the decay that had not settled when they had taken all they may;
                        implicit with fixed steps: iterations that ended above rounding, where f is not that exact;
                        Rosenbrock: steps with an old Jacobian, or none */
    uint64_t jacobians;   /* implicit: computed */
    uint64_t factorizations; /* implicit: of Newton's matrices, real and complex ones */
    uint64_t switches;       /* auto: from the explicit method to the implicit one, and back */
} kt_integrator_counts;

/* What has been done since the start. */
KT_API kt_integrator_counts kt_integrator_counts_get(const kt_integrator *integrator);

/* All that an integrator remembers besides y, previous_y, history and what can be computed again from them. Without
 * padding, and plain: it may be written out as it stands. */
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
    int32_t has_previous;        /* whether previous_y is known */
    kt_integrator_counts counts; /* as kt_integrator_counts_get has them */
} kt_integrator_memory;

/* The memory of an integrator. Valid until the next call that takes a non-const integrator. */
KT_API const kt_integrator_memory *kt_integrator_memory_get(const kt_integrator *integrator);

/* How many numbers the method remembers of earlier steps: what a checkpoint holds besides. 0 for an explicit method
 * (its `history` may be NULL below), 2 for a stabilised one, for the rate of the fastest decay and its age; 2 and the
 * past slopes, n each, for an Adams method; for an implicit one 6, n for the state at which its Jacobian was computed,
 * and the slopes of the last step, 4 n of radau5, 3 n of rodas5p and 2 n of the others; 2 and 2 n more, for the state
 * before and its slope, of bdf2 and two-step; for auto those of radau5, n for a vector, and 12 of the detection.
 * O(1). */
KT_API size_t kt_integrator_history_size(const kt_integrator *integrator);

/* A checkpoint: copies out memory, y (n), previous_y (n; NULL: not wanted) and history (kt_integrator_history_size). */
KT_API void kt_integrator_save(const kt_integrator *integrator, kt_integrator_memory *memory, double *y,
                               double *previous_y, double *history);

/* Restores a checkpoint, in an integrator initialised with the same method, n and options: every later step has the
 * same bits as without the break. With previous_y the last step can be interpolated again (its stages are evaluated
 * anew, once); with NULL not.
 *
 * Errors: as kt_integrator_start. */
KT_API KT_CHECKED kt_status kt_integrator_restore(kt_integrator *integrator, const kt_integrator_memory *memory,
                                                  const double *y, const double *previous_y, const double *history,
                                                  const kt_integrator_callbacks *callbacks, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
