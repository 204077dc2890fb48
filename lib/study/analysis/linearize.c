/* The matrices of small motions about a state.
 *
 * Neighbouring motions x(t) = (q (+) dq, v + dv) obey, to first order and along any direction in the manifold of
 * states,
 *
 *     dq' = dv + C(v) dq,   dv' = da,
 *
 * where C is -omega x on the rotations of spherical and free joints and 0 elsewhere. The change of the acceleration
 * along the direction is da. C follows from R' = R (omega x): a rotation dR = R (dq x) in body axes has
 *
 *     dq' = domega - omega x dq.
 *
 * Exact derivatives (exact.c) are taken along (free_position_j, velocity_change_j) and (0, free_velocity_j), see
 * independent_coordinates.c. Along each of these directions one state changes by one and the others do not change.
 *
 * Finite differences (probe.c, probe_difference.c) are used if a caller's own effects have no derivatives, and near
 * singular positions. Their directions are, for j = 1 .. n,
 *
 *     e_j = (free_position_j, 0) and (0, free_velocity_j).
 *
 * The probes yield G = (dq, dv, da, ..)_j; S selects the states from dq, dv. The projection changes the states
 * themselves a little. Therefore S G = W is only nearly the identity. The lower left part of S G is the change of
 * velocities that is necessary on the manifold when the position changes. The derivatives by the states are
 *
 *     G W^-1,   state = S (dv + C dq, da) W^-1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "analysis/analysis.h"

#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "evaluate/open.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* How many times the estimated errors two derivatives may differ by that are both right. */
#define ERRORS_MOST 4.0
#define FIRST 0.1 /* first step in units: radians, lengths, or these per characteristic time of the motion */

/* ---- derivatives along the manifold ------------------------------------------------------------------------------ */

kt_status kt_linearization_differentiate(kt_linearization *l, const double *dq, const double *dv, double scale,
                                         size_t column, kt_error *error) {
    const size_t nv = l->size.v;
    kt_copy_or_clear(l->direction, dq, nv * sizeof *dq);
    kt_copy_or_clear(l->direction + nv, dv, nv * sizeof *dv);
    kt_clear(l->direction + 2 * nv, l->size.x * sizeof *l->direction);
    const double largest = fmax(kt_largest_in_units(l, l->direction), kt_largest_in_units(l, l->direction + nv));
    return kt_probe_difference(l, FIRST * scale / largest, l->derivative + column * l->size.f,
                               l->derivative_error + column * l->size.f, error);
}

/* The derivative with respect to auxiliary state k. */
static kt_status differentiate_state(kt_linearization *l, size_t k, size_t column, kt_error *error) {
    memset(l->direction, 0, (2 * l->size.v + l->size.x) * sizeof *l->direction);
    l->direction[2 * l->size.v + k] = 1.0;
    return kt_probe_difference(l, FIRST * fmax(1.0, fabs(l->x0[k])), l->derivative + column * l->size.f,
                               l->derivative_error + column * l->size.f, error);
}

/* The number of states that are positions or velocities. */
static size_t moving_of(const kt_linear_system *system) {
    return (size_t)system->positions + (size_t)system->velocities;
}

/* Differentiates by each free position, each free velocity and each auxiliary state. Each is one column of the
 * system. */
static kt_status differentiate_probes(kt_linearization *l, const kt_linear_system *system, kt_error *error) {
    const size_t nv = l->size.v, positions = (size_t)system->positions;
    kt_status status = KT_OK;
    for (size_t j = 0; j < positions && status == KT_OK; j++)
        status = kt_linearization_differentiate(l, l->free_position + j * nv, NULL, 1.0, j, error);
    for (size_t j = 0; j < (size_t)system->velocities && status == KT_OK; j++)
        status = kt_linearization_differentiate(l, NULL, l->free_velocity + j * nv, fmax(1.0, system->speed),
                                                positions + j, error);
    for (size_t k = 0; k < l->size.x && status == KT_OK; k++)
        status = differentiate_state(l, k, moving_of(system) + k, error);
    return status;
}

/* The index in a probe of a position or velocity that is a state. */
static size_t state_place_of(const kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system,
                             size_t state) {
    const size_t positions = (size_t)system->positions;
    return state < positions ? (size_t)out->position_coordinate[state]
                             : l->size.v + (size_t)out->velocity_coordinate[state - positions];
}

/* A large change of a state. */
static double state_unit_of(const kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system,
                            size_t state) {
    return state < moving_of(system) ? l->unit[state_place_of(l, out, system, state) % l->size.v] : 1.0;
}

/* column_j -= factor * column_c; errors are added. */
static void subtract_system_column(kt_linearization *l, size_t n, size_t j, size_t c, double factor) {
    const size_t f = l->size.f;
    for (size_t i = 0; i < f; i++) {
        l->derivative[j * f + i] -= factor * l->derivative[c * f + i];
        l->derivative_error[j * f + i] += fabs(factor) * l->derivative_error[c * f + i];
    }
    for (size_t i = 0; i < n; i++)
        l->overlap[j * n + i] -= factor * l->overlap[c * n + i];
}

/* G <- G W^-1 by column operations; W = S G is nearly lower triangular with a unit diagonal. */
static void reduce_to_states(kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system) {
    const size_t n = moving_of(system), f = l->size.f;
    for (size_t j = 0; j < n; j++)
        for (size_t i = 0; i < n; i++)
            l->overlap[j * n + i] = l->derivative[j * f + state_place_of(l, out, system, i)];
    for (size_t c = n; c-- > 0;) {
        const double whole = l->overlap[c * n + c];
        for (size_t i = 0; i < f; i++) {
            l->derivative[c * f + i] /= whole;
            l->derivative_error[c * f + i] /= fabs(whole);
        }
        for (size_t i = 0; i < n; i++)
            l->overlap[c * n + i] /= whole;
        for (size_t j = 0; j < n; j++)
            if (j != c && l->overlap[j * n + c] != 0.0)
                subtract_system_column(l, n, j, c, l->overlap[j * n + c]);
    }
}

/* ---- exact derivatives ------------------------------------------------------------------------------------------- */

/* x += C(v) dq for one column. */
static void add_rotation_rate(const kt_linearization *l, const double *dq, double *x) {
    for (size_t i = 1; i < l->model->n.link; i++) {
        const kt_link *link = &l->model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        if (!motion.quaternions)
            continue;
        const int first = link->v + motion.plain;
        const double *w = l->v0 + first, *d = dq + first;
        const kt_vec3 c = kt_vec3_cross(kt_vec3_make(w[0], w[1], w[2]), kt_vec3_make(d[0], d[1], d[2]));
        x[first] -= c.x;
        x[first + 1] -= c.y;
        x[first + 2] -= c.z;
    }
}

/* Column j is (dq, dv) along state j: a position also changes the velocities, so that these stay on the manifold; a
 * velocity changes velocities alone. */
static void write_exact_bases(const kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system) {
    const size_t nv = l->size.v, positions = (size_t)system->positions;
    memset(out->positions_of, 0, (size_t)system->states * nv * sizeof *out->positions_of);
    memset(out->velocities_of, 0, (size_t)system->states * nv * sizeof *out->velocities_of);
    memcpy(out->positions_of, l->free_position, positions * nv * sizeof *out->positions_of);
    memcpy(out->velocities_of, l->velocity_change, positions * nv * sizeof *out->velocities_of);
    memcpy(out->velocities_of + positions * nv, l->free_velocity,
           (size_t)system->velocities * nv * sizeof *out->velocities_of);
}

/* Adds the rounding errors of velocity_change to a column. */
static void add_velocity_errors(kt_linearization *l, const kt_linear_system *system, size_t j) {
    const size_t nv = l->size.v;
    double *error = l->derivative_error + j * l->size.f;
    memset(error, 0, 2 * nv * sizeof *error);
    if (j >= (size_t)system->positions)
        return;
    memcpy(error + nv, l->velocity_rounding + j * nv, nv * sizeof *error);
    for (size_t k = 0; k < nv; k++)
        for (size_t i = 0; i < nv && error[nv + k] > 0.0; i++)
            error[2 * nv + i] += fabs(l->by_velocity[k * nv + i]) * error[nv + k];
    for (size_t k = 0; k < nv && l->size.x > 0; k++)
        for (size_t i = 0; i < l->size.x; i++)
            error[kt_probe_rates(l) + i] += fabs(l->rate_v[k * l->size.x + i]) * error[nv + k];
}

/* Adds the marker accelerations J' v at velocities v0 + h dq, without joint accelerations, times 1 / (4 h). */
static kt_status add_drifts(kt_linearization *l, const double *dq, double h, double *sum, double *size,
                            kt_error *error) {
    for (size_t i = 0; i < l->size.v; i++)
        l->v[i] = l->v0[i] + h * dq[i];
    const kt_status status = kt_kinematics_update(l->model, l->data, l->q0, l->v, NULL, error);
    for (size_t m = 0; m < l->size.markers && status == KT_OK; m++) {
        const kt_vec3 at = kt_marker_at(l->model, l->marker[m].body, l->marker[m].marker);
        const kt_vec3 a = kt_point_acceleration(l->model, l->data, l->marker[m].body, at);
        const double x[3] = {a.x, a.y, a.z};
        for (size_t i = 0; i < 3; i++) {
            sum[3 * m + i] += x[i] / (4.0 * h);
            size[3 * m + i] += fabs(x[i] / (4.0 * h));
        }
    }
    return status;
}

static void fill_marker_jacobian(kt_linearization *l, size_t m) {
    const kt_vec3 at = kt_marker_at(l->model, l->marker[m].body, l->marker[m].marker);
    kt_point_jacobian(l->model, l->data, l->marker[m].body, at, l->jacobian);
}

/* Computes the change of the marker velocities J(q) v along (dq, dv), J dv + B(v, dq). Here B(v, w) is (dJ along w) v.
 * A point p of a body that v rotates has the velocity R (v x p), so that B(v, w) = R (w x (v x p)). By Jacobi's
 * identity, B(v, w) - B(w, v) = J (w x v) of the rotations, and w x v = C(v) w. The kinematic queries yield B(v, v):
 *
 *     B(v, v) = J' v,   B(v, dq) = (B(v + dq, v + dq) - B(v - dq, v - dq)) / 4 + J C(v) dq / 2
 *
 * speed: the largest velocity of the state; 0 if it rests, so that B is 0. */
static kt_status differentiate_markers(kt_linearization *l, const double *dq, const double *dv, double speed,
                                       double *derivative, double *derivative_error, kt_error *error) {
    const size_t nv = l->size.v;
    const double length = kt_largest_in_units(l, dq);
    kt_status status = KT_OK;
    memset(derivative, 0, 3 * l->size.markers * sizeof *derivative);
    memset(derivative_error, 0, 3 * l->size.markers * sizeof *derivative_error);
    memset(l->direction, 0, nv * sizeof *l->direction);
    add_rotation_rate(l, dq, l->direction);
    for (size_t i = 0; i < nv; i++)
        l->direction[i] = dv[i] + 0.5 * l->direction[i];
    for (int side = -1; side < 2 && length > 0.0 && speed > 0.0 && status == KT_OK; side += 2)
        status = add_drifts(l, dq, side * speed / length, derivative, derivative_error, error);
    if (status == KT_OK)
        status = kt_kinematics_update(l->model, l->data, l->q0, NULL, NULL, error);
    for (size_t m = 0; m < l->size.markers && status == KT_OK; m++) {
        fill_marker_jacobian(l, m);
        for (size_t i = 0; i < 3; i++)
            for (size_t k = 0; k < nv; k++) {
                const double x = l->jacobian[6 * k + 3 + i] * l->direction[k];
                derivative[3 * m + i] += x;
                derivative_error[3 * m + i] += fabs(x);
            }
    }
    for (size_t i = 0; i < 3 * l->size.markers; i++)
        derivative_error[i] *= 4.0 * DBL_EPSILON;
    return status;
}

/* Writes an input's column from the derivatives of all accelerations by this input, and their errors. */
static void write_input_column(const kt_system_arrays *out, const kt_linear_system *system, size_t input,
                               const double *derivative, const double *derivative_error) {
    double *b = out->input + input * (size_t)system->states,
           *b_error = out->input_error + input * (size_t)system->states;
    kt_clear(b, (size_t)system->states * sizeof *b);
    kt_clear(b_error, (size_t)system->states * sizeof *b);
    for (int i = 0; i < system->velocities; i++) {
        b[system->positions + i] = derivative[out->velocity_coordinate[i]];
        b_error[system->positions + i] = derivative_error[out->velocity_coordinate[i]];
    }
}

/* Computes all derivatives along the states by exact derivatives; returns KT_ERROR_SINGULAR if exact derivatives cannot
 * be computed. */
static kt_status differentiate_exactly(kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system,
                                       kt_error *error) {
    const size_t n = (size_t)system->states, moving = moving_of(system), nv = l->size.v, f = l->size.f;
    write_exact_bases(l, out, system);
    kt_status status = kt_exact_derivatives(l, moving, out->positions_of, out->velocities_of, error);
    for (size_t j = moving; j < n; j++) {
        memset(l->derivative + j * f, 0, 2 * nv * sizeof(double));
        memset(l->derivative_error + j * f, 0, 2 * nv * sizeof(double));
        memset(l->derivative + j * f + 3 * nv, 0, 3 * l->size.markers * sizeof(double));
        memset(l->derivative_error + j * f + 3 * nv, 0, 3 * l->size.markers * sizeof(double));
    }
    for (size_t j = 0; j < moving && status == KT_OK; j++) {
        const double *dq = out->positions_of + j * nv, *dv = out->velocities_of + j * nv;
        add_velocity_errors(l, system, j);
        if (l->size.markers > 0)
            status = differentiate_markers(l, dq, dv, system->speed, l->derivative + j * f + 3 * nv,
                                           l->derivative_error + j * f + 3 * nv, error);
    }
    for (size_t k = 0; k < l->size.inputs && status == KT_OK; k++)
        write_input_column(out, system, k, l->input_derivative + k * nv, l->input_derivative_error + k * nv);
    return status;
}

/* ---- matrices ---------------------------------------------------------------------------------------------------- */

/* Writes dq and dv of all joints from the states. Entries with exact values replace differences. */
static void write_bases(const kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system) {
    const size_t nv = l->size.v;
    write_exact_bases(l, out, system);
    for (size_t j = 0; j < (size_t)system->positions; j++) {
        double *dv = out->velocities_of + j * nv;
        memcpy(dv, l->derivative + j * l->size.f + nv, nv * sizeof *dv);
        for (int k = 0; k < system->velocities; k++)
            dv[out->velocity_coordinate[k]] = 0.0;
    }
}

/* Writes S (dv + C dq, da) of each column. A rate of a position has an error only if its velocity depends on others. */
static void write_system_state(kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system) {
    const size_t n = (size_t)system->states, nv = l->size.v, f = l->size.f, positions = (size_t)system->positions,
                 moving = moving_of(system);
    double *rate = l->direction;
    for (size_t j = 0; j < n; j++) {
        const double *derivative = l->derivative + j * f, *error = l->derivative_error + j * f;
        memcpy(rate, out->velocities_of + j * nv, nv * sizeof *rate);
        add_rotation_rate(l, out->positions_of + j * nv, rate);
        for (size_t i = 0; i < positions; i++) {
            const size_t k = (size_t)out->position_coordinate[i];
            out->state[j * n + i] = rate[k];
            out->state_error[j * n + i] = j < positions && l->pivot_row[k] >= 0 ? error[nv + k] : 0.0;
        }
        for (size_t i = positions; i < n; i++) {
            const size_t k =
                i < moving ? 2 * nv + (size_t)out->velocity_coordinate[i - positions] : kt_probe_rates(l) + i - moving;
            out->state[j * n + i] = derivative[k];
            out->state_error[j * n + i] = error[k];
        }
    }
}

/* The part of state_error that comes from errors of forces: |response| force_error. */
static void write_force_errors(const kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system) {
    const size_t nv = l->size.v, rows = (size_t)system->velocities, moving = moving_of(system);
    memset(out->response, 0, rows * nv * sizeof *out->response);
    memset(out->force_error, 0, (size_t)system->states * nv * sizeof *out->force_error);
    if (!system->exact)
        return;
    for (size_t k = 0; k < nv; k++)
        for (size_t i = 0; i < rows; i++)
            out->response[k * rows + i] = l->by_force[k * nv + (size_t)out->velocity_coordinate[i]];
    memcpy(out->force_error, l->force_rounding, moving * nv * sizeof *out->force_error);
}

/* Adds the errors from the derivatives of the states themselves: |state| times these. */
static void add_overlap_errors(const kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system) {
    const size_t n = (size_t)system->states, f = l->size.f, first = (size_t)system->positions;
    for (size_t j = 0; j < moving_of(system); j++)
        for (size_t k = 0; k < moving_of(system); k++) {
            const double overlap = l->derivative_error[j * f + state_place_of(l, out, system, k)];
            for (size_t i = first; i < n && overlap > 0.0; i++)
                out->state_error[j * n + i] += fabs(out->state[k * n + i]) * overlap;
        }
}

/* Writes J dq and its derivative by time for each marker. */
static void write_system_output(kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system) {
    const size_t n = (size_t)system->states, nv = l->size.v, f = l->size.f, rows = 6 * l->size.markers;
    for (size_t m = 0; m < l->size.markers; m++) {
        fill_marker_jacobian(l, m);
        for (size_t j = 0; j < n; j++)
            for (size_t i = 0; i < 3; i++) {
                double position = 0.0, size = 0.0;
                for (size_t k = 0; k < nv; k++) {
                    const double x = l->jacobian[6 * k + 3 + i] * out->positions_of[j * nv + k];
                    position += x;
                    size += fabs(x);
                }
                const size_t index = j * rows + 6 * m + i;
                out->output[index] = position;
                out->output_error[index] = 4.0 * DBL_EPSILON * size;
                out->output[index + 3] = l->derivative[j * f + 3 * nv + 3 * m + i];
                out->output_error[index + 3] = l->derivative_error[j * f + 3 * nv + 3 * m + i];
            }
    }
}

/* ---- inputs ------------------------------------------------------------------------------------------------------ */

/* Derivative of the acceleration by a joint force, by a central difference of half-width h, into l->ahead. */
static kt_status differentiate_input(kt_linearization *l, int coordinate, double h, kt_error *error) {
    const size_t nv = l->size.v;
    double *accelerations[2] = {l->ahead, l->behind};
    for (int side = 0; side < 2; side++) {
        memcpy(l->tau_moved, l->tau, nv * sizeof(double));
        l->tau_moved[coordinate] += side ? -h : h;
        const kt_status status = kt_acceleration_evaluate(l->model, l->data, l->t, l->q0, l->v0, l->tau_moved, NULL,
                                                          accelerations[side], error);
        if (status != KT_OK)
            return status;
    }
    const double all = (l->tau[coordinate] + h) - (l->tau[coordinate] - h);
    for (size_t i = 0; i < nv; i++)
        l->ahead[i] = (l->ahead[i] - l->behind[i]) / all;
    return KT_OK;
}

/* Accelerations are linear in joint forces, so the difference is exact. The step must only be large enough for its
 * effect not to be lost in the rounding of the other terms. */
static kt_status write_input(kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system,
                             size_t input, kt_error *error) {
    const size_t nv = l->size.v;
    kt_status status = differentiate_input(l, l->input_coordinate[input], 1.0, error);
    if (status != KT_OK)
        return status;
    const double effect = kt_largest_in_units(l, l->ahead), pull = kt_largest_in_units(l, l->floor + 2 * nv);
    const double h = effect > 0.0 && pull > 0.0 ? pull / effect : 1.0;
    status = differentiate_input(l, l->input_coordinate[input], h, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < nv; i++)
        l->behind[i] = 4.0 * DBL_EPSILON * (effect * l->unit[i]);
    write_input_column(out, system, input, l->ahead, l->behind);
    return KT_OK;
}

/* Computes all derivatives by finite differences. */
static kt_status differentiate_numerically(kt_linearization *l, const kt_system_arrays *out,
                                           const kt_linear_system *system, kt_error *error) {
    kt_status status = differentiate_probes(l, system, error);
    for (size_t k = 0; k < l->size.inputs && status == KT_OK; k++)
        status = write_input(l, out, system, k, error);
    if (status != KT_OK)
        return status;
    reduce_to_states(l, out, system);
    write_bases(l, out, system);
    return KT_OK;
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

/* The largest entry of a matrix like `state`, minus another matrix unless NULL, in units. */
static double largest_entry_of(const kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system,
                               const double *matrix, const double *other) {
    const size_t n = (size_t)system->states;
    double most = 0.0;
    for (size_t i = 0; i < n; i++)
        for (size_t j = 0; j < n; j++) {
            const double unit = state_unit_of(l, out, system, j) / state_unit_of(l, out, system, i);
            most = fmax(most, fabs(matrix[j * n + i] - (other ? other[j * n + i] : 0.0)) * unit);
        }
    return most;
}

static void describe_system(kt_linearization *l, const kt_system_arrays *out, kt_linear_system *system) {
    const size_t n = (size_t)system->states, positions = (size_t)system->positions, moving = moving_of(system);
    const double whole = largest_entry_of(l, out, system, out->state, NULL);
    for (size_t i = 0; i < n; i++)
        out->rate[i] = i < positions ? l->v0[out->position_coordinate[i]]
                       : i < moving  ? l->a0[out->velocity_coordinate[i - positions]]
                                     : l->x_rate[i - moving];
    system->error = whole > 0.0 ? largest_entry_of(l, out, system, out->state_error, NULL) / whole : 0.0;
#define KT_SYSTEM_SHOW(type, name, count, meaning) system->name = out->name;
    KT_SYSTEM_FIELDS(KT_SYSTEM_SHOW)
#undef KT_SYSTEM_SHOW
    system->coordinates = (int)l->size.v;
    system->inputs = (int)l->size.inputs;
    system->outputs = (int)(6 * l->size.markers);
    system->unit = l->unit;
}

/* Computes all matrices by exact derivatives or by differences. */
static kt_status fill_linear_system(kt_linearization *l, const kt_system_arrays *out, kt_linear_system *system,
                                    bool exact, kt_error *error) {
    kt_status status =
        exact ? differentiate_exactly(l, out, system, error) : differentiate_numerically(l, out, system, error);
    if (status == KT_OK)
        status = kt_kinematics_update(l->model, l->data, l->q0, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    system->exact = exact;
    write_system_state(l, out, system);
    write_force_errors(l, out, system);
    add_overlap_errors(l, out, system);
    write_system_output(l, out, system);
    describe_system(l, out, system);
    return KT_OK;
}

/* Whether two estimates of the matrix differ by more than the errors of both explain. The errors are relative to the
 * largest entry, as describe_system() has them. */
static bool are_apart(const kt_linearization *l, const kt_system_arrays *out, const kt_linear_system *system,
                      double error) {
    const double whole = largest_entry_of(l, out, system, out->state, NULL);
    return largest_entry_of(l, out, system, out->state, l->other_state) > ERRORS_MOST * (error + system->error) * whole;
}

/* Whether the path through the state bends near a singular position. At such a state, the acceleration is not
 * interpolated, and differences would extend across the bend. */
static bool is_bent(kt_linearization *l) {
    return kt_acceleration_evaluate(l->model, l->data, l->t, l->q0, l->v0, l->tau, NULL, l->ahead, NULL) != KT_OK ||
           !l->data->interpolated;
}

/* The error of exact derivatives grows towards a singular position, while differences use states farther away from it.
 * If the path bends within their steps, differences are wrong: then both differ by more than their errors, and exact
 * derivatives are used. Otherwise the derivatives with the smaller error are used, as for the accelerations themselves
 * (evaluate/singular_crossing.c). */
static kt_status differentiate_system(kt_linearization *l, const kt_system_arrays *out, kt_linear_system *system,
                                      kt_error *error) {
    const bool near = system->near_singular;
    const kt_status status =
        near || kt_exact_is_possible(l) ? fill_linear_system(l, out, system, true, error) : KT_ERROR_SINGULAR;
    if (status == KT_ERROR_SINGULAR && near && is_bent(l))
        return status;
    if (status == KT_ERROR_SINGULAR)
        return fill_linear_system(l, out, system, false, error);
    if (status != KT_OK || !near)
        return status;
    const double exact = system->error;
    memcpy(l->other_state, out->state, (size_t)system->states * (size_t)system->states * sizeof *l->other_state);
    if (fill_linear_system(l, out, system, false, NULL) == KT_OK && system->error < exact &&
        !are_apart(l, out, system, exact))
        return KT_OK;
    return fill_linear_system(l, out, system, true, error);
}

kt_status kt_linearization_begin(kt_linearization *l, double t, const double *q, const double *v, const double *tau,
                                 kt_linear_system *system, kt_error *error) {
    const size_t nv = l->size.v;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the time is %g; give a finite number", t);
    l->t = t;
    const kt_input input = {.q = q, .v = v, .x = tau, .what = "force or torque"};
    kt_status status = kt_input_check(l->model, &input, error);
    if (status != KT_OK)
        return status;
    kt_copy(l->q0, q, l->size.q * sizeof *q);
    memcpy(l->v0, v, nv * sizeof *v);
    kt_copy_or_clear(l->tau, tau, nv * sizeof *tau);
    kt_copy(l->data->x, l->x0, l->size.x * sizeof *l->x0);
    status = kt_state_project(l->model, l->data, l->t, l->q0, l->v0, NULL, error);
    if (status == KT_OK)
        status = kt_acceleration_evaluate(l->model, l->data, l->t, l->q0, l->v0, l->tau, NULL, l->a0, error);
    if (status == KT_OK && l->size.x > 0)
        status = kt_auxiliary_state_rates(l->model, l->data, l->t, l->q0, l->v0, l->x_rate, error);
    system->speed = status == KT_OK ? kt_largest_in_units(l, l->v0) : 0.0;
    system->acceleration = status == KT_OK ? kt_largest_in_units(l, l->a0) : 0.0;
    return status;
}

kt_status kt_linearization_evaluate(kt_linearization *l, double t, const double *q, const double *v, const double *tau,
                                    kt_error *error) {
    if (KT_IS_MISSING(error, l, q || !l->model->n.q))
        return KT_ERROR_ARGUMENT;
    v = v ? v : l->model->zero;
    const kt_system_arrays *out = &l->arrays[l->next];
    kt_linear_system system = {0};
    kt_status status = kt_linearization_begin(l, t, q, v, tau, &system, error);
    if (status == KT_OK && !l->follows)
        status = kt_open_contacts_check(l->model, l->data, t, l->q0, l->v0, error);
    if (status == KT_OK)
        status = kt_independent_coordinates_choose(l, &l->arrays[l->next], &system, error);
    if (status != KT_OK)
        return status;
    kt_probe_floor(l);
    status = differentiate_system(l, out, &system, error);
    if (status != KT_OK)
        return status;
    l->system = system;
    l->next = 1 - l->next;
    return KT_OK;
}

const kt_linear_system *kt_linearization_system(const kt_linearization *l) { return l ? &l->system : NULL; }
