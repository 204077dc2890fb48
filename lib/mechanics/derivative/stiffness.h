/* The linearised equations of motion of a whole mechanism, before anything is solved (stiffness.c).
 * kt_stiffness_evaluate reduces them, and kt_acceleration_derivatives solves them. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DERIVATIVE_STIFFNESS_H
#define KT_DERIVATIVE_STIFFNESS_H

#include "base/arena.h"
#include "constraint/dual_rows.h"
#include "derivative/dense_or_tree.h"
#include "derivative/effect_derivatives.h"
#include "derivative/jacobian_qr.h"
#include "dynamics/dynamics_derivative.h"
#include "evaluate/evaluate.h"
#include "kinetree/dynamics.h"

/* Every array: type, name, count, meaning; p equations in the order of the loops, of n coordinates. With dense factors
 * of the loops' equations m and k are n and p, otherwise 0; l is n if there are loops. */
#define KT_STIFFNESS_FIELDS(X)                                                                                         \
    X(double, tree, kt_dynamics_work_size(model) / sizeof(double), "of the derivatives of the tree")                   \
    X(double, q, model->n.q, "positions")                                                                              \
    X(double, v, n, "velocities")                                                                                      \
    X(double, a, n, "accelerations")                                                                                   \
    X(double, lambda, p, "multipliers")                                                                                \
    X(double, force, n, "joint forces of the effects")                                                                 \
    X(double, weight, n, "joint forces of external wrenches")                                                          \
    X(double, change, n, "differences, and a right-hand side")                                                         \
    X(double, best, kt_model_is_differenced(model) ? n : 0, "the differences of the least error")                      \
    X(double, coarse, kt_model_is_differenced(model) ? n : 0, "those of a lower order")                                \
    X(double, load_friction, model->n.loaded, "friction from loads of the motion (load_derivatives.c)")                \
    X(double, load_gradient, 3 * model->n.loaded, "its derivatives by the loads, times the signs")                     \
    X(double, load_slope, model->n.loaded, "its derivatives by the rates of the joints, at constant loads")            \
    X(double, load_gain, 3 * model->n.loaded * model->n.loaded, "derivatives of the loads by the friction")            \
    X(double, load_here, 3 * model->n.loaded, "loads of the motion")                                                   \
    X(double, load_best, 3 * model->n.loaded, "derivatives of loads, the best")                                        \
    X(double, load_eight, 3 * model->n.loaded, "those of order eight")                                                 \
    X(double, load_six, 3 * model->n.loaded, "those of order six")                                                     \
    X(double, load_sample, 3 * model->n.loaded, "loads of a neighbouring state")                                       \
    X(double, jacobian, m *k, "A, p x n")                                                                              \
    X(char, factors, m ? kt_jacobian_qr_init(NULL, NULL, n, p) : 0, "of `qr`")                                         \
    X(double, product, m, "a column of M Z")                                                                           \
    X(double, half, m *m, "Q' M Z, n x f")                                                                             \
    X(kt_effect_dof, path, kt_effect_path_size(model), "of an effect")                                                 \
    X(kt_support_dof, dof, l, "of a loop")                                                                             \
    X(int32_t, chain, l ? model->n.link : 0, "of a loop")                                                              \
    X(double, force_x, n * model->n.x, "of kt_state_derivatives")                                                      \
    X(double, rate_q, n * model->n.x, "likewise")                                                                      \
    X(double, rate_v, n * model->n.x, "likewise")                                                                      \
    X(double, rate_x, model->n.x * model->n.x, "likewise")                                                             \
    X(double, e_q, n *p, "E by positions, p x n")                                                                      \
    X(double, e_v, n *p, "E by velocities")

typedef struct kt_linearized {
    const kt_model *model;
    kt_data *data;
    double t;
    size_t n, p;
    bool dense;               /* with loops: Q, R and Q' M Z are computed */
    bool exact;               /* with the changes of loads; false: friction from loads at constant loads */
    bool estimates;           /* next to singular positions `error` is estimated; false: they are rejected */
    double error;             /* error of derivatives by positions, over the coordinates' units; 0 if no singular
                                 position is near */
    kt_jacobian_qr qr;        /* factors of A, in `factors` */
    kt_derivative_work terms; /* terms of the tree, in `tree` */
    double *mass, *d_q, *d_v; /* M, D by positions and by velocities: n x n, where `terms` has them */
    KT_ARENA_DECLARE(KT_STIFFNESS_FIELDS)
} kt_linearized;

/* Returns the bytes of the arrays and, unless memory is NULL, initialises w in this memory.
 *
 * dense: with loops, Q, R and Q' M Z are computed. */
size_t kt_linearized_init(kt_linearized *w, void *memory, const kt_model *model, kt_data *data, double t, bool dense);

/* Fills M, D and with loops E at the accelerations a; NULL: the accelerations of the motion, which are evaluated. If w
 * is dense, also fills Q, R and Q' M Z. */
KT_CHECKED kt_status kt_linearized_fill(kt_linearized *w, const kt_dynamic_state *at, const double *a, kt_error *error);

/* Copies the contributions of auxiliary states, except force. */
void kt_linearized_copy_rates(const kt_linearized *w, const kt_state_derivatives *to);

/* kt_linearized_sum_effects: computes f (n), the joint forces of all effects, including J' times their wrenches. If
 * `differenced`, includes only effects without derivatives. kt_linearized_difference_effects: subtracts the derivatives
 * of these from D, by differences. */
KT_CHECKED kt_status kt_linearized_sum_effects(kt_linearized *w, const double *q, const double *v, bool differenced,
                                               double *f, kt_error *error);
KT_CHECKED kt_status kt_linearized_difference_effects(kt_linearized *w, const double *q, const double *v,
                                                      kt_error *error);

/* Friction from loads (load_derivatives.c). kt_linearized_find_loads: finds the friction of the motion, and leaves the
 * accelerations in w->a. kt_linearized_subtract_loads: subtracts its derivatives from D. kt_linearized_load_forces:
 * subtracts those by joint forces from the matrix d_tau (n x n). */
KT_CHECKED kt_status kt_linearized_find_loads(kt_linearized *w, const kt_dynamic_state *at, kt_error *error);
KT_CHECKED kt_status kt_linearized_subtract_loads(kt_linearized *w, const kt_dynamic_state *at, kt_error *error);
KT_CHECKED kt_status kt_linearized_load_forces(kt_linearized *w, const kt_dynamic_state *at, double *d_tau,
                                               kt_error *error);

/* The results of kt_stiffness_evaluate; unless `states` is NULL, for a model with auxiliary states, with
 * force = -Z' dF/dx (free x states). */
typedef struct kt_stiffness_matrices {
    double *basis, *mass, *stiffness, *damping;
    const kt_state_derivatives *states;
    bool exact; /* of kt_linearized */
} kt_stiffness_matrices;

KT_CHECKED kt_status kt_stiffness_evaluate_at(const kt_model *model, kt_data *data, void *memory, size_t memory_size,
                                              const kt_dynamic_state *at, const double *a,
                                              const kt_stiffness_matrices *to, kt_error *error);

/* The results of kt_acceleration_derivatives; unless `states` is NULL, for a model with auxiliary states, with
 * force = da/dx (nv x states). */
typedef struct kt_acceleration_matrices {
    kt_forward_matrices by;
    const kt_state_derivatives *states;
    bool uncertain; /* next to singular positions also return derivatives that are less accurate than KT_KNOWN */
} kt_acceleration_matrices;

/* kt_acceleration_derivatives at given accelerations a of the motion, or NULL. */
KT_CHECKED kt_status kt_acceleration_derivatives_at(const kt_model *model, kt_data *data, void *memory,
                                                    size_t memory_size, const kt_dynamic_state *at, const double *a,
                                                    const kt_acceleration_matrices *to, kt_error *error);

#endif
