/* Shared declarations of this folder. A held input is a joint force tau, or a parameter p of the model.
 *
 *     stage.c                 the start of a step, and derivatives of accelerations at a stage
 *     tangent_step.c          a step as a function: stages, sum, projection
 *     step_derivatives.c      tangents of a step, column by column: A and B
 *     step_parameter.c        tangents of a step by a parameter of the model: C
 *     stage_parameter.c       the derivative of an evaluation of accelerations by a parameter
 *     parameter_derivative.c  derivatives of the equations of motion and of the loops by a parameter, by differences
 *     implicit.c              the stages of implicit methods, solved
 *     implicit_changes.c      tangents and the adjoint of these stages
 *     tangent_rosenbrock.c    steps of linearly implicit methods, and their tangents
 *     step_adjoint.c          the adjoint of a step: a gradient by the state after it becomes one by the state before
 *     stage_adjoint.c         the adjoint of an evaluation of accelerations
 *     stage_loops.c           the part of loops in that adjoint
 *     rollout.c               gradients over many steps
 *     rollout_lanes.c         gradients of several motions at once
 *     revolve.c               the states of a motion that are kept while it is reversed
 *     tangent_contact.c       rejects steps in which hard contacts close or open
 *     motion_derivative.c     A and B of a simulation's motion, through its events
 *     projection.c            the derivative of the projection onto the loops
 *     projection_adjoint.c    the adjoint of that projection
 *     tangent.c               quaternions: changes dp as rotations xi, and the rates of both
 *     product.c               products of small matrices, compiled for each instruction set
 *     sparse.c                products with sparse matrices, compiled for each instruction set
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SENSITIVITY_SENSITIVITY_H
#define KT_SENSITIVITY_SENSITIVITY_H

#include "base/arena.h"
#include "base/copy.h"
#include "base/isa.h"
#include "constraint/dual_rows.h"
#include "derivative/jacobian_qr.h"
#include "derivative/kkt.h"
#include "dynamics/aba_inverse.h"
#include "dynamics/dynamics_derivative.h"
#include "dynamics/rnea_gradient.h"
#include "integrator/integrator.h"
#include "kinetree/sensitivity.h"

/* ---- quaternions ------------------------------------------------------------------------------------------------- */

/* Whether every position is a plain number, so that xi = dq. */
static inline bool kt_is_plain(const kt_model *model) { return model->n.q == model->n.v; }

/* xi = 2 vec(p^-1 o dp); the change of the norm is left out. */
void kt_tangent_drop(const kt_model *model, const double *q, const double *dq, double *xi);

/* d(q') = dE(q) v + E(q) dv. */
void kt_tangent_rate(const kt_model *model, const double *q, const double *v, const double *dq, const double *dv,
                     double *rate);

/* xi+ of q+ = q (+) x, where q changes by xi and x by dx: exp(-x) xi + T(x) dx; out may be xi. */
void kt_tangent_add(const kt_model *model, const double *x, const double *xi, const double *dx, double *out);

/* Gradients with respect to the results become gradients with respect to the arguments. The other transposed functions
 * are in joint/turn.h. kt_turns_drop_transposed and kt_turns_rate_transposed add to by_q and by_v. */
void kt_tangent_add_transposed(const kt_model *model, const double *x, const double *by_out, double *by_xi,
                               double *by_dx);

/* ---- products ---------------------------------------------------------------------------------------------------- */

/* The length of a column of n numbers, padded to whole vectors. Numbers behind the n-th stay zero. */
static inline size_t kt_padded(size_t n) { return (n + KT_LANES - 1) / KT_LANES * KT_LANES; }

/* The numbers e of velocities and auxiliary states. The lengths of columns of positions, and of these. */
static inline size_t kt_rate_numbers(const kt_model *model) { return model->n.v + model->n.x; }
static inline size_t kt_padded_q(const kt_model *model) { return kt_padded(model->n.q + model->n.x); }
static inline size_t kt_padded_v(const kt_model *model) { return kt_padded(kt_rate_numbers(model)); }

/* Products of small matrices. All arguments but A and B have the alignment of arrays of an arena.
 *
 * kt_product: Y += A X + B Z with n x n matrices A and B. X, Z and Y have `columns` padded columns. scratch:
 * 2 KT_LANES n numbers.
 *
 * kt_sum: out = start + h sum_j row_j k_j, over `count` rows k_j of n numbers, one after the other. n: a multiple of
 * KT_LANES.
 *
 * kt_solve_lanes: eight columns x become A^-1 x, a vector a row, with the factors of algebra/lu.h. The bits equal those
 * of kt_lu_solve. */
#define KT_PRODUCTS_DECLARE(isa)                                                                                       \
    void kt_product_##isa(size_t n, const double *a, const double *b, double *scratch, size_t columns,                 \
                          const double *x, const double *z, double *y);                                                \
    void kt_sum_##isa(double *out, const double *start, double h, const double *row, size_t count, const double *k,    \
                      size_t n);                                                                                       \
    void kt_solve_lanes_##isa(const double *lu, size_t n, const int *pivot, kt_v8 *x);
KT_EACH_ISA(KT_PRODUCTS_DECLARE)
#undef KT_PRODUCTS_DECLARE

/* A sparse matrix: all of its numbers, column-major, and the rows of each column that are not zero. The function
 * kt_sparse_apply computes y += A x for eight columns, a vector a row. */
typedef struct kt_sparse {
    size_t rows, columns;
    const double *value;
    size_t *begin; /* columns + 1: the beginning of each column in `row` */
    int32_t *row;
} kt_sparse;

#define KT_SPARSE_DECLARE(isa) void kt_sparse_apply_##isa(const kt_sparse *a, const kt_v8 *x, kt_v8 *y);
KT_EACH_ISA(KT_SPARSE_DECLARE)
#undef KT_SPARSE_DECLARE

/* ---- a parameter ------------------------------------------------------------------------------------------------- */

/* Every array: type, name, count, meaning; n coordinates, p equations. */
#define KT_PARAMETER_FIELDS(X)                                                                                         \
    X(double, by_parameter, n *KT_PARAMETER_MAX, "a_p of a stage")                                                     \
    X(double, inertia, n *KT_PARAMETER_MAX, "M_p x of a projection")                                                   \
    X(double, gap, p *KT_PARAMETER_MAX, "derivatives of what is closed: phi, A v - b', or A a - b''")                  \
    X(double, force, n, "-dr/dp")                                                                                      \
    X(double, moved, n, "of the accelerations, what the loops themselves ask for")                                     \
    X(double, value, 2 * n + p, "of a difference, and forces besides")                                                 \
    X(char, copy, kt_model_size(model), "the model, in which the parameter is shifted")

typedef struct kt_parameter_work {
    const kt_parameter *parameter;
    kt_data *data;
    kt_model *shifted;            /* in `copy` */
    size_t n, p, count;           /* coordinates, equations, numbers of the parameter */
    double now[KT_PARAMETER_MAX]; /* the numbers, without a shift */
    KT_ARENA_DECLARE(KT_PARAMETER_FIELDS)
} kt_parameter_work;

size_t kt_parameter_work_size(const kt_model *model);

/* Initialises w in memory of that size, with a copy of the model. Errors: the parameter has no derivative. */
KT_CHECKED kt_status kt_parameter_begin(kt_parameter_work *w, const kt_model *model, kt_data *data, void *memory,
                                        const kt_parameter *parameter, kt_error *error);

/* The point of an evaluation. Members that an evaluation does not use may be NULL. */
typedef struct kt_parameter_point {
    double t;
    const double *q, *v, *a;
    const kt_wrench *external;
} kt_parameter_point;

/* M a into out, which has room for 2 nv numbers. */
KT_CHECKED kt_status kt_parameter_inertia(const kt_model *model, kt_data *data, const kt_parameter_point *at,
                                          double *out, kt_error *error);

/* The derivatives of r (nv), and of b'' (p), with respect to number k. */
KT_CHECKED kt_status kt_parameter_residual(kt_parameter_work *w, int k, const kt_parameter_point *at, double *out,
                                           kt_error *error);
KT_CHECKED kt_status kt_parameter_drift(kt_parameter_work *w, int k, const kt_parameter_point *at, double *out,
                                        kt_error *error);

/* The change of a projection with the parameter, for the correction x: w->inertia (n x count) and w->gap (p x count).
 * Unless v is NULL, both belong to velocities. */
KT_CHECKED kt_status kt_parameter_project(kt_parameter_work *w, double t, const double *q, const double *v,
                                          const double *x, kt_error *error);

/* ---- the projection ---------------------------------------------------------------------------------------------- */

/* Every array: type, name, count, meaning; n coordinates, p equations, all zero without loops. m: n with dense factors,
 * otherwise 0; factors: bytes of either kind of factors. */
#define KT_PROJECTION_FIELDS(X)                                                                                        \
    X(double, q, p ? (KT_POSITION_STEPS_MAX + 1) * model->n.q : 0, "positions of all iterations")                      \
    X(double, v, n, "velocities before the projection")                                                                \
    X(double, x, n, "correction")                                                                                      \
    X(double, change, n, "its change")                                                                                 \
    X(double, residue, n, "gradient")                                                                                  \
    X(double, lambda, p, "its multipliers")                                                                            \
    X(double, residual, p, "phi, or b'")                                                                               \
    X(double, jacobian, n *p, "p x n")                                                                                 \
    X(char, factors, factors, "of `qr` or `kkt`")                                                                      \
    X(double, metric, m *m, "W")                                                                                       \
    X(double, half, m *m, "W Z")                                                                                       \
    X(double, map, 4 * m * m, "the changes of unit vectors")                                                           \
    X(double, reduced, m *m, "Z' W Z, factored")                                                                       \
    X(double, force, n *n, "G = d(J' lambda - W x)/dq, n x n")                                                         \
    X(double, equation, n *p, "-E = d(r + J x)/dq, p x n")                                                             \
    X(size_t, begin, 3 * (n + 1), "of sparse matrices")                                                                \
    X(int32_t, row, n *n + 2 * n * p, "likewise")                                                                      \
    X(kt_v8, columns, 3 * n + p, "columns under way: xi, dv, right-hand sides")                                        \
    X(double, moved, KT_LANES *n, "these right-hand sides, then dx")                                                   \
    X(double, closed, KT_LANES *p, "those of J")                                                                       \
    X(double, unit, n, "zeros, or a unit vector")                                                                      \
    X(double, work, 4 * n + 2 * p, "vectors")                                                                          \
    X(double, response, n, "g: response to a gradient")                                                                \
    X(double, by_g, n, "W g")                                                                                          \
    X(double, by_x, n, "W x")                                                                                          \
    X(double, by_inertia, n, "gradient of g . W x")                                                                    \
    X(double, before, n, "gradient by the positions before an iteration")                                              \
    X(kt_gradient_link, links, p ? model->n.link : 0, "of kt_gradient_evaluate")                                       \
    X(kt_support_dof, dof, n, "of a loop")                                                                             \
    X(int32_t, chain, p ? model->n.link : 0, "of a loop")

/* The state that is projected, and the work of one linear step of its projection. */
typedef struct kt_projection_work {
    const kt_model *model;
    kt_data *data;
    double t;
    size_t n, p;
    bool dense;                                   /* whether the factors are `qr`, else `kkt` */
    kt_jacobian_qr qr;                            /* in `factors` */
    kt_kkt kkt;                                   /* in `factors` */
    kt_sparse force_of, equation_of, jacobian_of; /* G, -E and J */
    uint32_t iterations;                          /* iterations of the positions, in the last kt_projection_run */
    double smallest;                              /* size of the smallest direction of that run (assembly/project.h) */
    KT_ARENA_DECLARE(KT_PROJECTION_FIELDS)
} kt_projection_work;

size_t kt_projection_place(kt_projection_work *w, void *memory, const kt_model *model);

/* Projects q, v in place (kt_state_project, or quaternions alone), and columns of changes (xi, dv) of 2 nv numbers. The
 * changes are derivatives by the state or, unless `parameter` is NULL, by its numbers. On failure, q, v and the columns
 * are undefined. */
KT_CHECKED kt_status kt_projection_columns(kt_projection_work *w, double *q, double *v, size_t columns, double *x,
                                           kt_parameter_work *parameter, kt_error *error);

/* Computes the least x with J x = e for the equations of accelerations at a state. */
KT_CHECKED kt_status kt_projection_least(kt_projection_work *w, double t, const double *q, const double *v,
                                         const double *e, double *x, kt_error *error);

/* Projects q, v in place. The arrays w->q and w->v keep the state before, and w->iterations counts the moves of the
 * positions. The function kt_projection_begin only keeps these, without a projection. Then kt_projection_transposed
 * turns a gradient x (2 nv) by the state after the projection into that by the state before. */
KT_CHECKED kt_status kt_projection_run(kt_projection_work *w, double *q, double *v, kt_error *error);

/* Rejects derivatives of the last kt_projection_run that are too uncertain next to a singular position. The arguments
 * by_q and v_by_q are the largest derivatives of positions and of velocities by positions, over their units. */
KT_CHECKED kt_status kt_projection_reject_unknown(const kt_projection_work *w, const double *v, double by_q,
                                                  double v_by_q, kt_error *error);
KT_CHECKED kt_status kt_projection_begin(kt_projection_work *w, const double *q, const double *v, kt_error *error);
KT_CHECKED kt_status kt_projection_transposed(kt_projection_work *w, const double *q, const double *v, double *x,
                                              kt_error *error);

/* ---- a step ------------------------------------------------------------------------------------------------------ */

/* The rows of the largest variant with hard contacts, stops or slack ropes; 0 without such a variant. */
size_t kt_step_contact_rows(const kt_model *model);

/* Every array: type, name, count, meaning. N numbers of a state y = (q, v, x), n velocities, m auxiliary states, s
 * stages that count, c columns, of which at most p belong to held inputs. For implicit methods, g stages are solved
 * together, with u unknowns in all. Explicit methods have g = 1 and u = 0. Linearly implicit methods have g = 2, for
 * the derivatives at two states, and r = 1; else r = 0.
 *
 * Matrices and columns join velocities and auxiliary states, e = n + m numbers. An auxiliary state is thus a velocity
 * whose position has no effect: its columns of a_q are 0. */
#define KT_STEP_FIELDS(X)                                                                                              \
    X(double, y, N, "state at the start")                                                                              \
    X(double, stage, s *N, "states of the stages")                                                                     \
    X(double, slope, s *N, "their slopes K_i")                                                                         \
    X(double, next, N, "state at the end")                                                                             \
    X(double, before, m, "auxiliary states that the data held")                                                        \
    X(double, unit, n, "a unit vector")                                                                                \
    X(double, start_q, kt_padded_q(model) * c, "dy of all columns, padded: dq")                                        \
    X(double, start_v, kt_padded(e) * c, "dv and dx")                                                                  \
    X(double, change_q, kt_padded_q(model) * c, "dY_i: dq")                                                            \
    X(double, change_v, s *kt_padded(e) * c, "dv and dx, of each stage")                                               \
    X(double, rate_q, kt_is_plain(model) ? 0 : s *kt_padded_q(model) * c, "dK_i: of q', if that is not v")             \
    X(double, rate_v, s *kt_padded(e) * c, "of v' and x'; at last dv+ and dx+")                                        \
    X(double, xi, kt_is_plain(model) ? 0 : kt_padded(e) * c, "rotations of a stage, if they are not dq")               \
    X(double, end, 2 * n * c, "dq+ and dv+, tangent")                                                                  \
    X(double, by_q, g *e *e, "a_q and x'_q, of each stage")                                                            \
    X(double, by_v, g *e *e, "a_v, a_x, x'_v and x'_x")                                                                \
    X(double, by_states, m *(2 * n + e), "blocks of these, of kt_state_derivatives")                                   \
    X(double, by_tau, n *n, "a_tau")                                                                                   \
    X(double, by_held, u ? g *n *p : 0, "a_tau or a_p, of each stage")                                                 \
    X(double, matrix, u *u, "of the stages that are solved together, factored")                                        \
    X(int, pivot, u, "of its factors")                                                                                 \
    X(double, correction, u, "residual and correction, or a right-hand side and its solution")                         \
    X(double, mass, u && !model->n.group ? g * n * n : 0, "of each stage")                                             \
    X(kt_v8, lanes, u, "eight right-hand sides, a vector a row")                                                       \
    X(double, taken, u, "the correction that is damped")                                                               \
    X(double, from, u, "the slopes where it begins")                                                                   \
    X(double, guess, u, "the slopes at first")                                                                         \
    X(double, reached, u ? g *n : 0, "accelerations at the stages")                                                    \
    X(double, outside, u ? g * model->n.q : 0, "changes of positions by other stages")                                 \
    X(double, seed, u ? g *N : 0, "gradients by the slopes")                                                           \
    X(double, increment, r *s *N, "U_i of a linearly implicit method")                                                 \
    X(double, time_derivative, r *N, "h f_t")                                                                          \
    X(double, neighbour, r *N, "a neighbouring state")                                                                 \
    X(double, neighbour_slope, r *N, "its slope")                                                                      \
    X(double, moved, r *s *c *N, "dU_i of all columns")                                                                \
    X(double, changed, r *c *N, "dY_i")                                                                                \
    X(double, right, r *c *N, "right-hand sides")                                                                      \
    X(double, first, r *c *N, "the changes of the slope at the start")                                                 \
    X(double, unit_state, u ? 2 * N + n : 0, "a unit vector, and what it changes")                                     \
    X(double, contact_row, kt_step_contact_rows(model), "gaps or reactions of hard contacts")                          \
    X(char, contact_memory, kt_step_contact_rows(model) > 0 ? kt_data_size(model) : 0, "data for them")                \
    X(double, tiles, 2 * KT_LANES * e, "of a product")                                                                 \
    X(double, by_stage, s *N, "gradients by X_i")                                                                      \
    X(double, raw, N, "state before the projection")                                                                   \
    X(double, by_end, N, "gradient by it, of dq and dv")                                                               \
    X(double, by_start, N, "gradient by y, likewise")                                                                  \
    X(double, by_slope, N, "by K_i")                                                                                   \
    X(double, by_next, 2 * n + m, "by y+, tangent")                                                                    \
    X(double, by_force, n, "by tau")                                                                                   \
    X(double, tangent, 3 * n + m, "gradients of a stage by xi and v, and w = M^-1 mu")                                 \
    X(double, inverse_force, n, "of kt_gradient_evaluate")                                                             \
    X(double, momentum, n, "likewise")                                                                                 \
    X(kt_gradient_link, links, model->n.link, "likewise")                                                              \
    X(char, inverse, kt_inverse_layout(NULL, NULL, &model->n), "M^-1, by its terms")                                   \
    X(char, derivative, kt_acceleration_work_size(model), "of kt_acceleration_derivatives")                            \
    X(char, tree, kt_dynamics_work_size(model), "of kt_dynamics_forward_derivatives")

typedef struct kt_step_work {
    const kt_model *model;
    kt_data *data;
    const kt_step *step;
    size_t stages;                /* stages that count: without the last one of an explicit fsal method */
    size_t states;                /* columns of the state: 2 n + m, or none */
    bool coupled;                 /* the method is implicit */
    bool linear;                  /* the method is linearly implicit */
    bool watched;                 /* a simulation has taken the step and found no event in it */
    size_t unknowns;              /* number for each stage: e, or with quaternions N; 0: explicit */
    size_t held_most;             /* columns of by_held */
    bool one_derivative;          /* by_q and by_v belong to one stage and serve all */
    size_t derivative_at;         /* stage to which by_q and by_v belong in that case */
    kt_parameter_work *parameter; /* NULL: the held input is tau */
    kt_projection_work projection;
    KT_ARENA_DECLARE(KT_STEP_FIELDS)
} kt_step_work;

/* Whether a model has auxiliary states; the numbers of y = (q, v, x), and of a change (xi, dv, dx). */
static inline bool kt_has_auxiliary_states(const kt_model *model) { return model->n.x > 0; }
static inline size_t kt_state_numbers(const kt_model *model) { return model->n.q + model->n.v + model->n.x; }
static inline size_t kt_tangent_numbers(const kt_model *model) { return 2 * model->n.v + model->n.x; }

/* Copies the auxiliary states of y to the data, from which all evaluations read them. */
static inline void kt_auxiliary_states_put(const kt_model *model, kt_data *data, const double *y) {
    if (kt_has_auxiliary_states(model))
        kt_copy(data->x, y + model->n.q + model->n.v, model->n.x * sizeof *y);
}

/* Restores the auxiliary states that the data held before the step. */
static inline void kt_auxiliary_states_restore(kt_step_work *w) {
    if (kt_has_auxiliary_states(w->model))
        kt_copy(w->data->x, w->before, w->model->n.x * sizeof *w->before);
}

/* Rejects a step to `next` in which a hard contact closes, its reaction changes sign, or friction sticks
 * (tangent_contact.c). */
KT_CHECKED kt_status kt_step_reject_contacts(kt_step_work *w, const double *next, kt_error *error);

/* Copies columns of the tangents at the end, kt_tangent_numbers a column (step_derivatives.c). */
void kt_step_copy(const kt_step_work *w, size_t first, size_t columns, double *to);

/* Checks the step and the memory, and initialises w in that memory. */
KT_CHECKED kt_status kt_step_begin(kt_step_work *w, const kt_model *model, kt_data *data, void *memory, size_t size,
                                   const kt_step *step, kt_error *error);

/* Copies the state at the start, and computes states and slopes of all stages, and `next`, which is not yet projected.
 * On success and on failure, the data hold the previous auxiliary states afterwards. */
KT_CHECKED kt_status kt_step_stages(kt_step_work *w, const double *q, const double *v, kt_error *error);

/* The parts of kt_step_stages.
 *
 * Copies the state at the start. */
void kt_step_start(kt_step_work *w, const double *q, const double *v);
/* Forms the state of stage i, and its slope K_i except the accelerations and the rates of auxiliary states. The caller
 * computes these into *a. */
const double *kt_step_stage(kt_step_work *w, size_t i, double **a);
/* Computes the accelerations and the rates of auxiliary states at a state y. */
KT_CHECKED kt_status kt_step_rates(const kt_step_work *w, double t, const double *y, double *a, kt_error *error);
/* Computes the whole slope at a state y. */
KT_CHECKED kt_status kt_step_slope(const kt_step_work *w, double t, const double *y, double *slope, kt_error *error);
/* Sums the slopes up to `next`. */
void kt_step_finish(kt_step_work *w);

/* The number of stages that count. The last stage of an explicit FSAL method does not count, because it belongs to the
 * next step. */
size_t kt_step_stages_of(const kt_method *method);

/* The numbers of a slope of a stage that are kept, so that all stages follow from them. The kept numbers are the
 * accelerations, or the whole slope for implicit methods. No number is stored if the adjoint repeats the step. */
size_t kt_step_kept(const kt_model *model, const kt_method *method);

/* Whether a method is implicit and its steps are differentiable functions of a state. kt_coupled_most: the most stages
 * that the method solves together. */
bool kt_method_is_coupled(const kt_method *method);
size_t kt_coupled_most(const kt_method *method);

/* Functions for implicit methods.
 *
 * Computes the stages, like kt_step_stages. */
KT_CHECKED kt_status kt_coupled_stages(kt_step_work *w, const double *q, const double *v, kt_error *error);
/* The tangents dK of all stages (change_v, rate_q, rate_v). */
KT_CHECKED kt_status kt_coupled_tangents(kt_step_work *w, const double *q, const double *v, size_t held,
                                         kt_error *error);
/* The adjoint, from by_end to by_stage and by_force. */
KT_CHECKED kt_status kt_coupled_adjoint(kt_step_work *w, kt_error *error);
/* Restores the stages from their slopes. */
void kt_coupled_recall(kt_step_work *w);

/* Whether a method is linearly implicit. Then its stages, and the changes at the end (change_q, rate_v). */
static inline bool kt_method_is_linear(const kt_method *method) { return method->transformed != NULL; }
KT_CHECKED kt_status kt_rosenbrock_stages(kt_step_work *w, const double *q, const double *v, kt_error *error);
KT_CHECKED kt_status kt_rosenbrock_tangents(kt_step_work *w, const double *q, const double *v, size_t held,
                                            kt_error *error);

/* Row i of the table's matrix. */
static inline const double *kt_step_row(const kt_method *method, size_t i) { return method->a + i * (i - (i > 0)) / 2; }

/* The time at the end of a step. */
static inline double kt_step_end(const kt_step *step) { return step->end != 0.0 ? step->end : step->t + step->h; }

/* The time of stage i. */
static inline double kt_step_time(const kt_step *step, size_t i) {
    return step->method->c[i] == 1.0 ? kt_step_end(step) : kt_stage_time(step->method->c[i], step->t, step->h);
}

/* Computes a_q, a_v and with `inputs` a_tau (w->by_q, by_v, by_tau) at stage i. Computes the accelerations, too, unless
 * a is NULL. */
KT_CHECKED kt_status kt_step_differentiate(kt_step_work *w, size_t i, bool inputs, double *a, kt_error *error);
/* Computes the derivatives, with those of auxiliary states, at any time and state y with given accelerations. The
 * results go to the matrices with the index `block`, among stages that are solved together. */
KT_CHECKED kt_status kt_step_differentiate_at(kt_step_work *w, double t, const double *y, const double *a, size_t block,
                                              bool inputs, kt_error *error);

/* The change of the slope (E(q) v, a, f) at y for a change dy, both of N numbers, with the derivatives of a block. The
 * n numbers xi are scratch for the rotations of dy. */
void kt_slope_change(const kt_step_work *w, size_t block, const double *y, const double *dy, double *xi, double *out);

/* Adds `factor` times these changes for all unit vectors dy to the columns, of m numbers, of a matrix. */
void kt_slope_add(const kt_step_work *w, size_t block, const double *y, double factor, size_t m, double *to);

/* Computes the tangents of a step, into w->next and w->end: w->states columns, and `held` columns of held inputs. */
KT_CHECKED kt_status kt_step_tangents(kt_step_work *w, const double *q, const double *v, size_t held, kt_error *error);

/* Copies these tangents to A and B (NULL: not requested). The auxiliary states after the step go to the data. */
void kt_step_give(const kt_step_work *w, double *A, double *B);

/* Computes a_p at a state y with the accelerations a, from w->by_tau, into w->parameter->by_parameter. */
KT_CHECKED kt_status kt_parameter_stage(kt_step_work *w, double t, const double *y, const double *a, kt_error *error);

/* The adjoint of the step from q, v. kt_adjoint_run computes the state after the step, w->next. The caller writes the
 * gradient by this state to w->by_next. Then kt_adjoint_sweep turns w->by_next into the gradient by the state before
 * the step (tangent), and w->by_force into the gradient by tau. */
KT_CHECKED kt_status kt_adjoint_run(kt_step_work *w, const double *q, const double *v, kt_error *error);
KT_CHECKED kt_status kt_adjoint_sweep(kt_step_work *w, kt_error *error);

/* Saves the results of kt_adjoint_run: the kept part of all slopes (stages x kt_step_kept), the state after the step,
 * and the iterations of its projection. The function kt_adjoint_recall restores the results of kt_adjoint_run from
 * these. */
void kt_adjoint_save(const kt_step_work *w, double *slopes, double *next, uint32_t *iterations);
KT_CHECKED kt_status kt_adjoint_recall(kt_step_work *w, const double *q, const double *v, const double *slopes,
                                       const double *next, uint32_t iterations, kt_error *error);

/* The adjoint of the accelerations of stage i: mu . da = by_xi . xi + by_v . dv + by_tau . dtau. All three go to
 * w->tangent. */
KT_CHECKED kt_status kt_stage_adjoint(kt_step_work *w, size_t i, const double *mu, kt_error *error);

/* With loops: the response to mu, and the part of their multipliers in w->tangent. The second function uses the results
 * of kt_gradient_evaluate in w->inverse_force and w->momentum. */
KT_CHECKED kt_status kt_stage_respond(kt_step_work *w, double t, const double *q, const double *mu, double *by_tau,
                                      kt_error *error);
KT_CHECKED kt_status kt_stage_add_loops(kt_step_work *w, size_t stage, const double *mu, kt_error *error);
/* Computes the poses in space that the gradient of the loops reads, if a sweep in the plane has left these poses
 * out. */
KT_CHECKED kt_status kt_sweep_pose(const kt_model *model, kt_data *data, const double *q, kt_error *error);

/* Adds w . dQ of effects in joints at a state. Numbers of q, v and of the gradients are `stride` apart, as in a lane
 * among others. */
void kt_joint_effects_add(const kt_model *model, double t, size_t stride, const double *q, const double *v,
                          const double *by_tau, double *by_xi, double *by_v);
/* The reason why the adjoint of a model's accelerations is not one sweep. NULL if it is one sweep, since all effects
 * are joint forces that the library can differentiate. */
const char *kt_sweep_rejected(const kt_model *model);

/* ---- checkpoints ------------------------------------------------------------------------------------------------- */

/* The memory of a motion that is reversed (revolve.c). The memory has `most` checkpoints of `numbers` numbers, of which
 * `kept` are in use. The last checkpoint belongs to the present step. Stored with each checkpoint: the index of its
 * step, and whether this step has been computed since. */
typedef struct kt_revolve {
    int steps, most, kept;
    size_t numbers;
    double *state, *here; /* most states, and one between them */
    int *index;
    bool *taken;
} kt_revolve;

/* The callback `advance` replaces the state at the start of step k by the state at the start of step k + 1. Unless
 * `checkpoint` is -1, the callback saves the results of the step with this checkpoint. The callback `reverse` is the
 * adjoint of step k. The results of this step were saved with a checkpoint, or not at all (-1). */
typedef kt_status kt_revolve_advance(void *user, int k, int checkpoint, double *state, kt_error *error);
typedef kt_status kt_revolve_reverse(void *user, int k, int checkpoint, const double *state, kt_error *error);

/* Reverses all steps; the first checkpoint is at the start of the motion. */
KT_CHECKED kt_status kt_revolve_run(kt_revolve *r, kt_revolve_advance *advance, kt_revolve_reverse *reverse, void *user,
                                    kt_error *error);

/* The checkpoints of a rollout, and the arrays of its reversal. */
int kt_checkpoints_of(const kt_rollout *rollout);
kt_revolve kt_revolve_of(const kt_rollout *rollout, size_t numbers, double *state, double *here, int *index,
                         bool *taken);

/* The point of a rollout's cost at the state y of step k. */
kt_cost_point kt_rollout_point(const kt_model *model, const kt_rollout *rollout, int k, const double *y);
/* Computes k_i / h (step_adjoint.c) of one state, or of lanes, with `all` numbers. */
void kt_adjoint_gather(const kt_method *method, size_t i, size_t stages, size_t all, const double *by_end,
                       const double *by_stage, double *by_slope);

/* kt_state_close after a step, without the projection onto loops if `unprojected`. */
KT_CHECKED kt_status kt_step_close(const kt_model *model, kt_data *data, const kt_step *step, double *q, double *v,
                                   kt_error *error);

#endif
