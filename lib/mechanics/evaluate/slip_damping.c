/* The derivative of friction by velocities, for implicit methods. The derivative has the part in which the direction of
 * friction follows slip, whose rate is large while slip is slow. Let F be the joint forces of units of force at the
 * contacts, so that their slip velocities change by F' dv:
 *
 *     Z'C = -Z' F (dT/ds) F'
 *
 * If no slip is slow, dT/ds = -mu N (1 - e e') / |s| of each contact. The change of N by friction is left out.
 *
 * If some slip is slow, T follows from u = W p + b (slip.c), in which, for this derivative, only b = (abs(s) / tau) e +
 * ... depends on s. The changes of p = (N, T) obey
 *
 *     (W dp)_N = 0
 *     (W dp + db)_T = 0                                              slip that comes to rest within tau
 *     sigma (dT + mu e dN) + mu N (1 - e e') (W dp + db)_T = 0       slip that does not come to rest, sigma = u_T . e
 *     dT + mu e dN = dT at fixed N                                   other slip
 *
 * T of several feet is not unique. Then W is singular along changes that have no joint force; a small number on its
 * diagonal makes it regular.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/finite.h"
#include "algebra/lu.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "evaluate/slip.h"
#include "kinetree/algebra.h"
#include "linear/cholesky.h"

#include <math.h>
#include <string.h>

/* The number that is added to the diagonal of W, relative to the largest number of W. */
static const double regular = 1e-9;

/* out = factor (1 - e e') + along e e' */
static void project_pair(const double *e, double factor, double along, double out[2][2]) {
    for (int i = 0; i < 2; i++)
        for (int k = 0; k < 2; k++)
            out[i][k] = (i == k ? factor : 0.0) + (along - factor) * e[i] * e[k];
}

/* The sign of s along e, and *size = |s|. */
static double side_of_slip(const double *s, const double *e, double *size) {
    *size = kt_hypot(s[0], s[1]);
    return s[0] * e[0] + s[1] * e[1] < 0.0 ? -1.0 : 1.0;
}

/* dT/ds of a contact at a fixed normal force. */
static void differentiate_direction(const kt_model *model, const kt_data *data, size_t k, double normal,
                                    double out[2][2]) {
    double size;
    const double *e = data->slip_direction + 2 * k;
    const double side = side_of_slip(data->slip_velocity + 2 * k, e, &size);
    project_pair(e, size > 0.0 ? -side * kt_slip_friction(model, k) * normal / size : 0.0, 0.0, out);
}

/* db/ds of slow slip with the prediction time tau (slip_prediction.c). With the direction of slip d, and e = s / |s| on
 * the side of d:
 *
 *     db/ds = side / tau (1 - e e') + along e e'
 *     along = side grows / tau    if tau is the time that belongs to the speed |s|
 *             0                   if tau is shorter
 *
 * The first part turns slip. The second part changes its speed, on which tau depends. */
static void differentiate_prediction(const kt_data *data, const kt_slip_problem *p, size_t k, double out[2][2]) {
    double grows, size, e[2];
    const double *s = data->slip_velocity + 2 * k, *d = data->slip + 2 * k;
    const double most = kt_slip_prediction_time(data, k, &grows), side = side_of_slip(s, d, &size);
    for (int i = 0; i < 2; i++)
        e[i] = size > 0.0 ? side * s[i] / size : d[i];
    project_pair(e, side / p->tau[k], p->tau[k] < most ? 0.0 : side * grows / p->tau[k], out);
}

/* Turns the tangential rows of contact k of an island into the equations of dp, and writes their right-hand sides. */
static void pose_changes(const kt_model *model, const kt_data *data, kt_slip_problem *p, size_t k) {
    const size_t m = 3 * p->at->n, row = 3 * k + 1, index = kt_slip_index(p, k);
    const double *e = p->to.e[k], mu = kt_slip_friction(model, index), N = p->to.p[row - 1];
    const bool predicted = p->predicted[index];
    const bool rests = predicted && p->to.mode[k] == KT_COULOMB_STICK;
    const double sigma = predicted ? p->to.u[row] * e[0] + p->to.u[row + 1] * e[1] : 1.0;
    double across[2][2], right[2][2];
    project_pair(e, rests ? 1.0 : predicted ? mu * N : 0.0, rests ? 1.0 : 0.0, across);
    if (predicted)
        differentiate_prediction(data, p, index, right);
    else
        differentiate_direction(model, data, index, -N, right);
    for (size_t j = 0; j < m; j++) {
        double *x = &p->W_at[row * m + j], *y = &p->W_at[(row + 1) * m + j];
        const double u[2] = {*x, *y};
        *x = across[0][0] * u[0] + across[0][1] * u[1];
        *y = across[1][0] * u[0] + across[1][1] * u[1];
    }
    for (size_t i = 0; i < 2 && !rests; i++) {
        p->W_at[(row + i) * m + row + i] += sigma;
        p->W_at[(row + i) * m + row - 1] += sigma * mu * e[i];
    }
    for (size_t i = 0; i < 2; i++)
        for (size_t j = 0; j < 2; j++)
            p->by_slip[(2 * k + j) * m + row + i] =
                -(predicted ? across[i][0] * right[0][j] + across[i][1] * right[1][j] : right[i][j]);
}

/* dp/ds of an island, if some slip is slow. */
static bool differentiate_slow(const kt_model *model, const kt_data *data, kt_slip_problem *p) {
    const size_t n = p->at->n, m = 3 * n;
    double most = 0.0;
    for (size_t i = 0; i < m; i++)
        most = i % 3 == 0 ? most : fmax(most, p->W_at[i * m + i]);
    for (size_t i = 0; i < m; i++)
        p->W_at[i * m + i] += i % 3 == 0 ? 0.0 : regular * most;
    for (size_t k = 0; k < n; k++)
        pose_changes(model, data, p, k);
    if (!kt_lu_factor(p->W_at, m, p->pivot)) /* the rows of W are the columns of its transpose */
        return false;
    for (size_t j = 0; j < 2 * n; j++)
        kt_lu_solve_transposed(p->W_at, m, p->pivot, p->by_slip + j * m);
    return kt_all_finite(p->by_slip, 2 * n * m);
}

/* dp/ds of an island without slow slip: only the direction of each friction force depends on s. */
static bool differentiate_fast(const kt_model *model, const kt_data *data, kt_slip_problem *p) {
    for (size_t k = 0; k < p->at->n; k++) {
        const size_t index = kt_slip_index(p, k);
        double by[2][2];
        differentiate_direction(model, data, index, data->slip_normal[index], by);
        for (size_t i = 0; i < 4; i++)
            p->by_slip[(2 * k + i / 2) * 3 * p->at->n + 3 * k + 1 + i % 2] = by[i % 2][i / 2];
    }
    return true;
}

/* The column of F' of coordinate i. unit: zeros (nv). */
static void find_unit_force(const kt_model *model, kt_data *data, const double *q, size_t i, double *unit,
                            kt_slip_problem *p) {
    unit[i] = 1.0;
    kt_slip_find_rates(model, data, q, unit, p->rate);
    unit[i] = 0.0;
    for (size_t k = 0; k < 2 * p->at->n; k++)
        p->unit_force[k * model->n.v + i] = p->rate[2 * kt_slip_index(p, k / 2) + k % 2];
}

/* Finds F of an island (see above). Entry i of its rows is the change of the slip velocities for a unit of velocity
 * i. unit: scratch (nv). */
static void find_unit_forces(const kt_model *model, kt_data *data, const double *q, double *unit, kt_slip_problem *p) {
    const size_t nv = model->n.v;
    memset(unit, 0, nv * sizeof *unit);
    memset(p->unit_force, 0, 2 * p->at->n * nv * sizeof *p->unit_force);
    for (size_t i = 0; i < nv && p->islands == 1; i++)
        find_unit_force(model, data, q, i, unit, p);
    for (size_t g = 0; g < model->n.group && p->islands > 1; g++) {
        const kt_group *group = &model->group[g];
        for (int32_t i = 0; i < group->v_count && group->island == p->at->index; i++)
            find_unit_force(model, data, q, (size_t)model->group_v[group->v + i], unit, p);
    }
}

/* Adds -Z' F by F' of the forces' derivatives, by one column of F' after the other. */
static void add_products(const kt_model *model, kt_slip_problem *p, double unit, const double *basis, size_t free,
                         double *force, double *damping) {
    const size_t n = p->at->n, nv = model->n.v;
    for (size_t j = 0; j < 2 * n; j++) {
        memset(force, 0, nv * sizeof *force);
        for (size_t k = 0; k < 2 * n; k++)
            for (size_t i = 0; i < nv; i++)
                force[i] += unit * p->by_slip[j * 3 * n + 3 * (k / 2) + 1 + k % 2] * p->unit_force[k * nv + i];
        for (size_t i = 0; i < free; i++) {
            const double along = basis ? kt_dense_dot(basis + i * nv, force, (int)nv) : force[i];
            for (size_t c = 0; c < nv; c++)
                damping[c * free + i] -= along * p->unit_force[j * nv + c];
        }
    }
}

kt_status kt_slip_add_damping(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *basis,
                              size_t free, double *a, double *damping, kt_error *error) {
    kt_slip_problem *p = kt_slip_problem_of(data);
    const kt_status status = kt_acceleration_trusted(model, data, at, a, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < p->islands; i++) {
        kt_slip_select(model, p, &p->island[i]);
        memset(p->by_slip, 0, 6 * p->at->n * p->at->n * sizeof *p->by_slip);
        find_unit_forces(model, data, at->q, a, p);
        if ((p->at->is_slow ? differentiate_slow : differentiate_fast)(model, data, p))
            add_products(model, p, p->at->is_slow ? p->at->unit : 1.0, basis, free, a, damping);
    }
    return KT_OK;
}
