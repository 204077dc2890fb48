/* Coordinates that move no mass: quasi-statics [MSD 8.1].
 *
 * Let N be the motions that move no mass (compile/massless.c): M N = 0, N' h = 0. The equations of motion along N are
 * no differential equations of second order. These equations are the balance of the forces that act on the massless
 * parts:
 *
 *     r(q, v, t) = N' tau = 0
 *
 * N is constant. N B has two kinds of columns: dampers resist along N_d = N B_d, and none resists along N_s = N B_s. If
 * a state (q, v) is right except for a part along N, the balance determines this part:
 *
 *     B_s' r(q + N_s y, v) = 0              for y, positions of coordinates that only springs hold
 *     B_d' r(q, v + N_d s) = 0              for s, speeds of coordinates that dampers resist: of first order for q
 *     d/dt B_s' r = 0 along v + N_s u       then for u, the speeds of coordinates that only springs hold
 *
 * The equations are solved by Newton's method with differences. If forces are linear, this takes a step or two, and the
 * remaining error is rounding. The accelerations a of M a = tau - h at that state are the accelerations of all masses.
 * Along N, accelerations are neither determined nor needed. A simulation evaluates its right-hand side at the balanced
 * state, with its v as q'. After each step the simulation moves the state to the balance, in the same way as a
 * projection moves a state onto the loops. The equations are no more than with a small mass, but nothing is stiff.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/lu.h"
#include "base/copy.h"
#include "base/where.h"
#include "evaluate/evaluate.h"
#include "kinetree/joint.h"

#include <float.h>
#include <string.h>

int kt_massless_count(const kt_model *model) { return model ? (int)model->n.massless : 0; }

int kt_massless_coordinate(const kt_model *model, int k) {
    return model && KT_IS_INDEX(k, model->n.massless) ? model->massless[k] : -1;
}

bool kt_massless_moves(const kt_model *model, int v) {
    bool moves = false;
    for (size_t k = 0; model && KT_IS_INDEX(v, model->n.v) && k < model->n.massless; k++)
        moves |= model->massless_motion[k * model->n.v + (size_t)v] != 0.0;
    return moves;
}

enum { ITERATIONS = 30 };

/* A balance that is being sought. Columns first to last of N B move; equations first to last of B' r are to vanish. */
typedef struct balance {
    const kt_model *model;
    kt_data *data;
    kt_dynamic_state at;
    double *q, *v;                      /* the state, which is improved */
    double *near_q, *near_v, *step, *a; /* scratch: nq, nv, nv, nv */
    double *residual, *near_residual;   /* massless */
    size_t first, last;
    bool speeds; /* velocities move, not positions */
} balance;

/* dv = sum of x_k times column k of N B. */
static void combine_balance_motions(const balance *b, const double *x, double *dv) {
    const size_t nv = b->model->n.v;
    memset(dv, 0, nv * sizeof *dv);
    for (size_t k = b->first; k < b->last; k++)
        for (size_t i = 0; i < nv; i++)
            dv[i] += x[k] * b->model->massless_motion[k * nv + i];
}

static void add_velocity_times(const double *v, double s, const double *dv, size_t nv, double *out) {
    for (size_t i = 0; i < nv; i++)
        out[i] = v[i] + s * dv[i];
}

/* B' r at a state; b->a are its accelerations. */
static kt_status find_balance_residual(const balance *b, double t, const double *q, const double *v, double *residual,
                                       kt_error *error) {
    const kt_model *m = b->model;
    const size_t n = m->n.massless;
    const kt_dynamic_state at = {.t = t, .q = q, .v = v, .tau = b->at.tau, .external = b->at.external};
    const kt_status status = kt_acceleration_trusted(m, b->data, &at, b->a, error);
    for (size_t k = 0; k < n && status == KT_OK; k++) {
        residual[k] = 0.0;
        for (size_t j = 0; j < n; j++)
            residual[k] += m->massless_basis[k * n + j] * b->a[m->massless[j]];
    }
    return status;
}

static double largest_magnitude(const double *x, size_t n) {
    double most = 0.0;
    for (size_t i = 0; i < n; i++)
        most = fmax(most, fabs(x[i]));
    return most;
}

/* The state moved by s dv, in positions or in velocities. */
static void neighbour(const balance *b, double s, const double *dv, const double **q, const double **v) {
    *q = b->q;
    *v = b->v;
    if (b->speeds) {
        add_velocity_times(b->v, s, dv, b->model->n.v, b->near_v);
        *v = b->near_v;
    } else {
        for (size_t i = 0; i < b->model->n.v; i++)
            b->near_v[i] = s * dv[i];
        kt_position_add(b->model, b->q, b->near_v, b->near_q);
        *q = b->near_q;
    }
}

static kt_status reject_quasi_static(const balance *b, const char *what, kt_error *error) {
    const int body = kt_velocity_body(b->model, b->model->massless[0]);
    return kt_error_set(
        error, KT_ERROR_SINGULAR,
        kt_where_format("joint '%.100s', t = %.9g s", kt_joint_name(b->model, body), b->at.t).text,
        "it moves no mass, and %s; give its bodies a small mass, and integrate with an implicit method (radau5)", what);
}

static const char unbalanced[] = "the forces on it do not determine its position: springs and dampers must hold it in "
                                 "every position, each damper always or never";

/* Factors the derivative of the residuals with respect to the coordinates that move. */
static kt_status factor_quasi_static(const balance *b, double scale, kt_error *error) {
    double *matrix = b->data->balance_matrix;
    const size_t count = b->last - b->first;
    const double small = sqrt(DBL_EPSILON) * fmax(1.0, scale);
    kt_status status = KT_OK;
    for (size_t j = 0; j < count && status == KT_OK; j++) {
        const double *q, *v;
        neighbour(b, small, b->model->massless_motion + (b->first + j) * b->model->n.v, &q, &v);
        status = find_balance_residual(b, b->at.t, q, v, b->near_residual, error);
        for (size_t i = 0; i < count; i++)
            matrix[j * count + i] = (b->near_residual[b->first + i] - b->residual[b->first + i]) / small;
    }
    if (status == KT_OK && !kt_lu_factor(matrix, count, b->data->balance_pivot))
        return reject_quasi_static(b, unbalanced, error);
    return status;
}

/* Newton's method along the columns. The iteration ends when a step is of the size of rounding, or not smaller than the
 * previous step. */
static kt_status find_balance(const balance *b, kt_error *error) {
    const size_t nv = b->model->n.v, count = b->last - b->first;
    double last = (double)INFINITY, faster = 0.0;
    for (int k = 0; k < ITERATIONS && count > 0; k++) {
        const double scale = b->speeds ? largest_magnitude(b->v, nv) : largest_magnitude(b->q, b->model->n.q);
        kt_status status = find_balance_residual(b, b->at.t, b->q, b->v, b->residual, error);
        if (status == KT_OK && !(faster > 0.0 && faster < 0.1))
            status = factor_quasi_static(b, scale, error);
        if (status != KT_OK)
            return status;
        kt_lu_solve(b->data->balance_matrix, count, b->data->balance_pivot, b->residual + b->first);
        const double size = largest_magnitude(b->residual + b->first, count);
        if (!isfinite(size))
            return reject_quasi_static(b, unbalanced, error);
        if (size <= 4.0 * DBL_EPSILON * scale || (k > 0 && size >= 0.5 * last && size <= 1e-9 * fmax(1.0, scale)))
            return KT_OK;
        faster = k > 0 ? size / last : 0.0;
        last = size;
        combine_balance_motions(b, b->residual, b->step);
        const double *q, *v;
        neighbour(b, -1.0, b->step, &q, &v);
        kt_copy(b->q, q, (b->speeds ? 0 : b->model->n.q) * sizeof *q);
        kt_copy(b->v, v, (b->speeds ? nv : 0) * sizeof *v);
    }
    return count == 0 ? KT_OK
                      : reject_quasi_static(b, "no balance of the forces on it is found near the last one", error);
}

/* Finds the velocities of the coordinates that springs alone hold. The residual, differenced along the motion, does not
 * change. The derivative by positions is factored. Accelerations along N do not matter, as the balance of springs does
 * not depend on velocities along N. */
static kt_status follow_springs(const balance *b, const double *a, kt_error *error) {
    const size_t nq = b->model->n.q, nv = b->model->n.v, count = b->last - b->first;
    const double h = 1e-6 / fmax(1.0, largest_magnitude(b->v, nv));
    double *ahead = b->near_q + nq;
    for (int k = 0; k < 2; k++) {
        for (int side = -1; side <= 1; side += 2) {
            double *residual = side < 0 ? b->residual : b->near_residual;
            for (size_t i = 0; i < nv; i++)
                b->step[i] = side * h * b->v[i];
            add_velocity_times(b->v, side * h, a, nv, b->near_v);
            kt_position_add(b->model, b->q, b->step, ahead);
            const kt_status status = find_balance_residual(b, b->at.t + side * h, ahead, b->near_v, residual, error);
            if (status != KT_OK)
                return status;
        }
        for (size_t i = b->first; i < b->last; i++)
            b->residual[i] = (b->near_residual[i] - b->residual[i]) / (2.0 * h);
        kt_lu_solve(b->data->balance_matrix, count, b->data->balance_pivot, b->residual + b->first);
        combine_balance_motions(b, b->residual, b->step);
        add_velocity_times(b->v, -1.0, b->step, nv, b->v);
    }
    return KT_OK;
}

/* Sets the arrays of a balance, and its start at the given state. */
static balance begin_balance(const kt_model *model, kt_data *data, const kt_dynamic_state *at) {
    const size_t nq = model->n.q, nv = model->n.v;
    balance b = {.model = model, .data = data, .at = *at, .q = data->balanced_q, .v = data->balanced_v};
    b.near_q = data->balance; /* memory for two arrays of nq numbers */
    b.near_v = b.near_q + 2 * nq;
    b.step = b.near_v + nv;
    b.a = b.step + nv;
    b.residual = data->balance_residual;
    b.near_residual = b.residual + model->n.massless;
    kt_copy(b.q, at->q, nq * sizeof *b.q);
    kt_copy(b.v, at->v, nv * sizeof *b.v);
    return b;
}

/* Finds y, then s, then u of the equations above: positions along springs, speeds along dampers, and the speeds of
 * coordinates that only springs hold. */
kt_status kt_massless_solve(const kt_model *model, kt_data *data, const kt_dynamic_state *at, kt_error *error) {
    const size_t n = model->n.massless, nv = model->n.v;
    balance b = begin_balance(model, data, at);
    b.first = 0;
    b.last = model->damped;
    b.speeds = true;
    balance springs = b;
    springs.first = model->damped;
    springs.last = n;
    springs.speeds = false;
    kt_status status = find_balance(&springs, error);
    if (status == KT_OK)
        status = find_balance(&b, error);
    if (status != KT_OK || springs.first == springs.last)
        return status;
    double *a = b.a + nv;
    status = find_balance_residual(&b, at->t, b.q, b.v, b.residual, error);
    if (status == KT_OK)
        status = factor_quasi_static(&springs, largest_magnitude(b.q, model->n.q), error);
    if (status != KT_OK)
        return status;
    status = find_balance_residual(&b, at->t, b.q, b.v, b.residual, error);
    memcpy(a, b.a, nv * sizeof *a);
    kt_lu_solve(data->balance_matrix, n - springs.first, data->balance_pivot, b.residual + springs.first);
    if (status == KT_OK && !(largest_magnitude(b.residual + springs.first, n - springs.first) <=
                             1e-7 * fmax(1.0, largest_magnitude(b.q, model->n.q))))
        return reject_quasi_static(&b, unbalanced, error);
    return status == KT_OK ? follow_springs(&springs, a, error) : status;
}

kt_status kt_massless_balance(const kt_model *model, kt_data *data, double t, double *q, double *v, const double *tau,
                              const kt_wrench *external, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, v || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_input input = {.q = q, .v = v, .x = tau, .what = "force", .external = external};
    kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK || model->n.massless == 0)
        return status;
    status = kt_massless_solve(model, data, &(kt_dynamic_state){t, q, v, tau, external}, error);
    if (status == KT_OK) {
        memcpy(q, data->balanced_q, model->n.q * sizeof *q);
        memcpy(v, data->balanced_v, model->n.v * sizeof *v);
    }
    (void)t;
    return status;
}
