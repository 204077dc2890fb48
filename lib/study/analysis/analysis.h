/* The private struct of a linearisation, and the functions that the files of this folder share. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_ANALYSIS_ANALYSIS_H
#define KT_ANALYSIS_ANALYSIS_H

#include "base/arena.h"
#include "constraint/dual_rows.h"
#include "kinetree/analysis.h"
#include "model/model.h"

#include <math.h>

/* n: largest number of states, x: auxiliary states among them; v, q: coordinates; f: numbers of a probe, which are
 * differenced (probe.c). */
typedef struct kt_linearization_sizes {
    size_t q, v, x, n, f, link, inputs, markers, rows, data, work;
} kt_linearization_sizes;

/* The number of columns of the extrapolation tableau. */
enum { KT_TABLEAU_DEPTH = 6 };

/* The arrays of a linear system, which exist twice: for the last successful evaluation and for the current one. */
#define KT_SYSTEM_FIELDS(X)                                                                                            \
    X(int, position_coordinate, s->v, "independent positions")                                                         \
    X(int, velocity_coordinate, s->v, "independent velocities")                                                        \
    X(double, state, s->n * s->n, "matrix")                                                                            \
    X(double, input, s->n * s->inputs, "matrix")                                                                       \
    X(double, output, 6 * s->markers * s->n, "matrix")                                                                 \
    X(double, positions_of, s->v * s->n, "all positions from the states")                                              \
    X(double, velocities_of, s->v * s->n, "all velocities from the states")                                            \
    X(double, rate, s->n, "x' of the state itself")                                                                    \
    X(double, state_error, s->n * s->n, "of state")                                                                    \
    X(double, input_error, s->n * s->inputs, "of input")                                                               \
    X(double, output_error, 6 * s->markers * s->n, "of output")                                                        \
    X(double, response, s->v * s->v, "accelerations of the states by joint forces")                                    \
    X(double, force_error, s->v * s->n, "errors of forces, a part of state_error")

typedef struct kt_system_arrays {
    KT_ARENA_DECLARE(KT_SYSTEM_FIELDS)
} kt_system_arrays;

/* Room for the candidate of an equation in an elimination (independent_coordinates.c). */
enum { KT_CANDIDATE_BYTES = 16 };

/* Every other array: type, name, count, meaning. */
#define KT_LINEARIZATION_FIELDS(X)                                                                                     \
    X(int, input_coordinate, s->inputs, "what is driven")                                                              \
    X(kt_marker_index, marker, s->markers, "outputs")                                                                  \
    X(double, unit, s->v, "a large change of each coordinate")                                                         \
    X(double, q0, s->q, "the state")                                                                                   \
    X(double, v0, s->v, "the state")                                                                                   \
    X(double, a0, s->v, "its acceleration")                                                                            \
    X(double, x0, s->x, "auxiliary states")                                                                            \
    X(double, x_given, s->x, "before a search for an equilibrium")                                                     \
    X(double, x_begin, s->x, "at the beginning of a step")                                                             \
    X(double, x_unit, s->x, "of auxiliary states, by which steps to an equilibrium are measured")                      \
    X(double, matrix, s->x > 0 ? (s->v + s->x) * (s->v + s->x) : 0, "of an equilibrium with auxiliary states")         \
    X(double, x_rate, s->x, "their rates")                                                                             \
    X(double, tau, s->v, "joint forces")                                                                               \
    X(double, tau_moved, s->v, "neighbouring joint forces, or a step")                                                 \
    X(double, q, s->q, "a neighbouring state")                                                                         \
    X(double, v, s->v, "a neighbouring state")                                                                         \
    X(double, direction, 2 * s->v + s->x, "direction of a derivative: dq, dv, dx")                                     \
    X(double, equation, 2 * s->rows * s->v, "A and d(A v - b')/dq, eliminated")                                        \
    X(bool, holonomic, s->rows, "equations with a residual")                                                           \
    X(char, candidate, KT_CANDIDATE_BYTES * s->rows, "of each equation for a pivot")                                   \
    X(int32_t, filled, s->rows, "equations that a pivot changes")                                                      \
    X(int32_t, pivot_row, s->v, "row that a dependent coordinate is taken from, or -1")                                \
    X(double, free_position, s->v * s->v, "basis of allowed steps: nv x positions")                                    \
    X(double, free_velocity, s->v * s->v, "basis of allowed changes of velocity: nv x velocities")                     \
    X(double, velocity_change, s->v * s->v, "dv along each allowed step: nv x positions")                              \
    X(double, velocity_rounding, s->v * s->v, "its rounding errors")                                                   \
    X(kt_support_dof, dof, s->v, "of a loop")                                                                          \
    X(int32_t, chain, s->link, "of a loop")                                                                            \
    X(double, ahead, s->f, "probed ahead")                                                                             \
    X(double, behind, s->f, "probed behind")                                                                           \
    X(double, tableau, 2 * KT_TABLEAU_DEPTH * s->f, "two rows of an extrapolation")                                    \
    X(double, derivative, s->f * s->n, "derivatives of the probed values")                                             \
    X(double, derivative_error, s->f * s->n, "their errors")                                                           \
    X(double, best_step, s->f, "that a derivative was taken from")                                                     \
    X(double, floor, s->f, "rounding of the probed values")                                                            \
    X(double, jacobian, 6 * s->v, "of a marker")                                                                       \
    X(double, overlap, s->n * s->n, "derivatives of the states along the directions taken")                            \
    X(double, weight, s->v, "forces at rest")                                                                          \
    X(double, inertia, s->v, "diagonal of M in the freedoms that are left")                                            \
    X(double, stiffness, s->v * s->v, "H in the freedoms that are left")                                               \
    X(double, factor, (s->v + s->x) * (s->v + s->x), "to be factored")                                                 \
    X(int32_t, pivot, s->v + s->x, "of LU")                                                                            \
    X(int32_t, dependent, s->v, "coordinates that depend on others")                                                   \
    X(double, force, s->v + s->x, "g in the freedoms that are left")                                                   \
    X(double, step, s->v + s->x, "step in the freedoms that are left")                                                 \
    X(double, tried_q, s->q, "a position tried")                                                                       \
    X(double, tried_a, s->v, "its acceleration")                                                                       \
    X(double, by_position, s->v * s->v, "da/dq")                                                                       \
    X(double, by_velocity, s->v * s->v, "da/dv")                                                                       \
    X(double, by_state, s->v * s->x, "da/dx")                                                                          \
    X(double, rate_q, s->x * s->v, "-df/dq of the rates f of auxiliary states")                                        \
    X(double, rate_v, s->x * s->v, "-df/dv")                                                                           \
    X(double, rate_x, s->x * s->x, "-df/dx")                                                                           \
    X(double, by_force, s->v * s->v, "da/dtau")                                                                        \
    X(double, force_rounding, s->v * s->n, "rounding errors of the forces that a column is solved from")               \
    X(double, mass, s->v * s->v, "M")                                                                                  \
    X(double, other_state, s->n * s->n, "matrix by exact derivatives, next to a singular position")                    \
    X(double, input_derivative, s->v * s->inputs, "da/dtau of the inputs")                                             \
    X(double, input_derivative_error, s->v * s->inputs, "its errors")                                                  \
    X(char, work, s->work, "of the derivatives")                                                                       \
    X(char, data_memory, s->data, "the model's data")

struct kt_linearization {
    void *owned; /* memory of kt_linearization_create, or NULL */
    kt_linearization_sizes size;
    const kt_model *model;
    kt_data *data;
    double t;
    bool differences; /* finite differences are used even where exact derivatives exist */
    bool of_force;    /* finite differences are those of the force M a instead of the acceleration */
    kt_system_arrays arrays[2];
    bool follows; /* the model is that of a simulation, which follows its contacts: open ones have no reaction */
    int next;     /* index of the array set that the next evaluation writes */
    kt_linear_system system;
    KT_ARENA_DECLARE(KT_LINEARIZATION_FIELDS)
};

/* ---- independent_coordinates.c ----------------------------------------------------------------------------------- */

/* Chooses the independent coordinates at (t, q0, v0), written to `out`, and the bases of the motions that the equations
 * allow. Fills the counts of *system and near_singular. Returns KT_ERROR_SINGULAR at a singular position, where the
 * equations have less than their usual rank. */
kt_status kt_independent_coordinates_choose(kt_linearization *l, kt_system_arrays *out, kt_linear_system *system,
                                            kt_error *error);

/* ---- probe.c ----------------------------------------------------------------------------------------------------- */

/* The length of a probe, and the index at which the rates of auxiliary states begin. A probe contains dq, dv, a (nv
 * each), then the velocities of the markers (3 each), then these rates. */
static inline size_t kt_probe_count(size_t nv, size_t markers, size_t states) { return 3 * nv + 3 * markers + states; }
static inline size_t kt_probe_rates(const kt_linearization *l) { return l->size.f - l->size.x; }

/* Projects the state at the distance `step` along l->direction onto the manifold, and writes the probe at the projected
 * state. */
kt_status kt_probe(kt_linearization *l, double step, double *out, kt_error *error);

/* a <- M a at q. */
kt_status kt_probe_force(kt_linearization *l, const double *q, double *a, kt_error *error);

/* Writes to l->floor the size of the terms to which the rounding error of each number of a probe is proportional. */
void kt_probe_floor(kt_linearization *l);

/* The largest component of x (nv) over its unit. */
static inline double kt_largest_in_units(const kt_linearization *l, const double *x) {
    double most = 0.0;
    for (size_t i = 0; i < l->size.v; i++)
        most = fmax(most, fabs(x[i]) / l->unit[i]);
    return most;
}

/* y += factor matrix x, rows x n, column by column: most directions of a tree are unit vectors. */
static inline void kt_add_columns(const double *matrix, size_t rows, size_t n, double factor, const double *x,
                                  double *y) {
    for (size_t k = 0; k < n; k++)
        for (size_t i = 0; i < rows && x[k] != 0.0; i++)
            y[i] += factor * matrix[k * rows + i] * x[k];
}

/* ---- probe_difference.c ------------------------------------------------------------------------------------------ */

/* Derivatives of the probe along l->direction and their estimated errors (f numbers each), from steps `first`, first /
 * 2, ... */
kt_status kt_probe_difference(kt_linearization *l, double first, double *derivative, double *derivative_error,
                              kt_error *error);

/* ---- exact.c ----------------------------------------------------------------------------------------------------- */

/* Whether all derivatives of the model are exact: the model has no effect of a caller, and differences are not
 * requested. */
bool kt_exact_is_possible(const kt_linearization *l);

/* Computes derivatives of the acceleration and of the rates of auxiliary states. The first columns are derivatives
 * along `count` directions (dq, dv), columns of nv numbers. The derivatives by each auxiliary state follow. Writes rows
 * 2 nv to 3 nv, and the rows of the rates, of derivative and derivative_error. Requires kt_probe_floor. Errors:
 * KT_ERROR_SINGULAR near singular positions. */
kt_status kt_exact_derivatives(kt_linearization *l, size_t count, const double *dq, const double *dv, kt_error *error);

/* Computes the derivatives of the force M a at rest along dq, and writes the mass matrix. */
kt_status kt_exact_force_derivatives(kt_linearization *l, size_t count, const double *dq, kt_error *error);

/* ---- equilibrium_states.c ---------------------------------------------------------------------------------------- */

/* Finds an equilibrium of positions and auxiliary states from q and x0, into q0 and x0. Fills *found, which is zero. */
KT_CHECKED kt_status kt_equilibrium_of_states(kt_linearization *l, const kt_equilibrium_options *options, double t,
                                              const double *q, const double *tau, kt_equilibrium *found,
                                              kt_error *error);

/* ---- linearize.c ------------------------------------------------------------------------------------------------- */

/* Projects the state (q, v) onto the loop equations and evaluates its acceleration under tau, into q0, v0, tau and a0.
 */
kt_status kt_linearization_begin(kt_linearization *l, double t, const double *q, const double *v, const double *tau,
                                 kt_linear_system *system, kt_error *error);

/* Computes derivatives of the probe along (dq, dv), into this column of derivative and derivative_error. Either of dq
 * and dv may be NULL (zero). The number scale is the size of a large change along the direction, in units (per second
 * for velocities). */
kt_status kt_linearization_differentiate(kt_linearization *l, const double *dq, const double *dv, double scale,
                                         size_t column, kt_error *error);

#endif
