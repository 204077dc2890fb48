/* Methods for ordinary differential equations y' = f(t, y), y in R^n. The list has explicit, stabilised and implicit
 * Runge-Kutta methods, multistep methods, and a method that switches between explicit and implicit steps.
 *
 * A method is a constant struct of coefficients, kt_method. integrator.h takes steps with a method, and stability.h
 * computes the method's linear stability.
 *
 * Sources: E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 2nd ed., Springer 1993
 * (below: HNW), sections II.1 - II.6. Each table names its own source. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KINETREE_METHOD_H
#define KINETREE_METHOD_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#ifdef __cplusplus
extern "C" {
#endif

/* The least relative tolerance, the rounding of numbers (2^-52). A smaller tolerance is rejected, because no step could
 * satisfy it. */
#define KT_TOLERANCE_LEAST 2.220446049250313e-16

/* The built-in methods, in rising order. */
#define KT_METHOD_LIST(X)                                                                                              \
    X(euler)                                                                                                           \
    X(implicit_euler)                                                                                                  \
    X(midpoint)                                                                                                        \
    X(heun)                                                                                                            \
    X(ralston)                                                                                                         \
    X(crank_nicolson)                                                                                                  \
    X(bdf2)                                                                                                            \
    X(two_step)                                                                                                        \
    X(ab2)                                                                                                             \
    X(rkc2)                                                                                                            \
    X(kutta3)                                                                                                          \
    X(bs32)                                                                                                            \
    X(rk4)                                                                                                             \
    X(rk38)                                                                                                            \
    X(ab4)                                                                                                             \
    X(rkc4)                                                                                                            \
    X(dopri5)                                                                                                          \
    X(tsit5)                                                                                                           \
    X(auto)                                                                                                            \
    X(rodas5p)                                                                                                         \
    X(radau5)                                                                                                          \
    X(dop853)

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

/* The table of a Rosenbrock method in the form that its steps use. Opaque. */
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
 * For a table of your own, clear the struct, fill in the members that the table has, and pass the struct to
 * kt_integrator_init. That function calls kt_method_check and rejects a table whose order conditions fail.
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

/* Writes the names of the built-in methods, or only of the adaptive methods, in one line: "euler, midpoint, heun".
 * Writes as much as fits, including a NUL, and returns the length of the whole text, as snprintf does. */
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
 * A residual passes if the rounding of the coefficients to double explains the residual. The bound is nodes * eps *
 * (the sum of the absolute values of the terms).
 *
 * Errors: KT_ERROR_ARGUMENT, naming the first condition that fails and its residual.
 *
 * Cost: order 4 has 8 trees, and order 8 has 200. Each tree takes O(nodes s^2). Allocates nothing; 40 kB of stack. */
KT_API KT_CHECKED kt_status kt_method_check(const kt_method *method, kt_error *error);

#ifdef __cplusplus
}
#endif
#endif
