/* Accelerations under friction that is proportional to reactions; load_friction.c has its law k.
 *
 * Accelerations and reactions are affine in joint forces, L = L0 + G x. One evaluation yields L0, and one for each
 * friction a column of G. Newton's method solves x_i + s_i k_i(L0 + G x) = 0, from x = 0. For one friction k is convex,
 * so that the iteration approaches the smallest force from below. If the slope 1 + s dk/dx is not positive on the way,
 * no force or a second force may satisfy the law: the friction jams the joint, as in Painleve's paradox. An evaluation
 * with x yields the accelerations, and corrects L0 where reactions are not affine (slip of contacts).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "evaluate/load_friction.h"

#include <math.h>

enum { NEWTON_MAX = 50, CORRECTIONS_MAX = 20 };

/* The smallest pivot of Newton's matrix: friction that makes a load a thousand times as large jams. */
static const double jammed = 1e-3;
/* Residuals of the law, relative to the friction: of Newton's method, and of the evaluation. */
static const double rounding_of_root = 1e-14, agrees = 1e-10;

/* With `last`, accelerations alone. Loads leave the kinematics in place of the links' motion, from which reactions of
 * the caller follow. Therefore the last evaluation is without loads. */
static kt_status evaluate_under_loads(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                      bool last, kt_error *error) {
    kt_dynamic_state loaded = *at;
    kt_copy_or_clear(data->load_tau, at->tau, model->n.v * sizeof *data->load_tau);
    for (size_t k = 0; k < model->n.loaded; k++)
        data->load_tau[model->link[kt_loaded_effect(model, k)->link[0]].v] += data->load_friction[k];
    loaded.tau = data->load_tau;
    const kt_status status = model->unloaded(model, data, &loaded, a, error);
    return status == KT_OK && !last
               ? kt_motion_complete(model, data, &loaded, a, kt_links_scratch(data), data->load_joint, NULL, error)
               : status;
}

kt_status kt_loads_evaluate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                            kt_error *error) {
    return evaluate_under_loads(model, data, at, a, false, error);
}

/* ---- the forces -------------------------------------------------------------------------------------------------- */

/* A problem: the signs s, and the scale of friction. */
typedef struct load_problem {
    const kt_model *model;
    kt_data *data;
    const kt_dynamic_state *at;
    size_t n;
    double unit;
} load_problem;

static kt_status reject_jam(const load_problem *p, size_t slot, double pivot, kt_error *error) {
    const int32_t body = kt_loaded_effect(p->model, slot)->body[0];
    return kt_error_set(error, KT_ERROR_SINGULAR, kt_where_at("joint", kt_joint_name(p->model, body), p->at->t).text,
                        "its friction jams: it grows as fast as the reaction that causes it, so that no force or two "
                        "forces satisfy its law (1 - dF/dF = %.3g); take less friction, more inertia, or start at rest "
                        "with `stick`",
                        pivot);
}

/* Writes x + s k(L0 + G x) to load_residual, and its derivative to load_matrix. Returns the largest residual over the
 * friction. */
static double find_load_residuals(const load_problem *p) {
    const kt_data *d = p->data;
    double worst = 0.0;
    for (size_t k = 0; k < p->n; k++) {
        const kt_effect_record *e = kt_loaded_effect(p->model, k);
        const double s = kt_load_sign(p->model, d, e, p->at->v);
        double load[3], gradient[3];
        for (size_t c = 0; c < 3; c++) {
            load[c] = d->load_free[3 * k + c];
            for (size_t j = 0; j < p->n; j++)
                load[c] += d->load_gain[3 * (j * p->n + k) + c] * d->load_friction[j];
        }
        const double friction = fabs(s) * kt_load_law(p->model, e, load, s, gradient);
        d->load_residual[k] = d->load_friction[k] + copysign(friction, s);
        for (size_t j = 0; j < p->n; j++) {
            const double *gain = d->load_gain + 3 * (j * p->n + k);
            d->load_matrix[j * p->n + k] =
                (double)(j == k) + s * (gradient[0] * gain[0] + gradient[1] * gain[1] + gradient[2] * gain[2]);
        }
        worst = fmax(worst, fabs(d->load_residual[k]) / fmax(fmax(friction, fabs(d->load_friction[k])), p->unit));
    }
    return worst;
}

/* Eliminates in order, since each leading minor of the matrix is that of fewer frictions, and must be positive, too.
 * Returns the row whose pivot is not; n: none. The solution replaces load_residual. */
static size_t solve_load_step(const load_problem *p, double *pivot) {
    const size_t n = p->n;
    double *A = p->data->load_matrix, *b = p->data->load_residual;
    for (size_t k = 0; k < n; k++) {
        *pivot = A[k * n + k];
        if (!(*pivot > jammed))
            return k;
        for (size_t i = k + 1; i < n; i++) {
            const double factor = A[k * n + i] / *pivot;
            for (size_t j = k + 1; j < n; j++)
                A[j * n + i] -= factor * A[j * n + k];
            b[i] -= factor * b[k];
        }
    }
    for (size_t k = n; k-- > 0;) {
        for (size_t j = k + 1; j < n; j++)
            b[k] -= A[j * n + k] * b[j];
        b[k] /= A[k * n + k];
    }
    return n;
}

kt_status kt_loads_solve(const kt_model *model, kt_data *data, const kt_dynamic_state *at, kt_error *error) {
    const load_problem p = {.model = model, .data = data, .at = at, .n = model->n.loaded};
    double pivot;
    const size_t stuck = solve_load_step(&p, &pivot);
    return stuck < p.n ? reject_jam(&p, stuck, pivot, error) : KT_OK;
}

/* Newton's iteration for x_i + s_i k_i(L0 + G x) = 0; a pivot that is too small is a jam. */
static kt_status find_friction(const load_problem *p, kt_error *error) {
    for (int step = 0; step < NEWTON_MAX; step++) {
        double pivot;
        if (find_load_residuals(p) <= rounding_of_root)
            return KT_OK;
        const size_t stuck = solve_load_step(p, &pivot);
        if (stuck < p->n)
            return reject_jam(p, stuck, pivot, error);
        double change = 0.0;
        for (size_t k = 0; k < p->n; k++) {
            const double before = p->data->load_friction[k];
            p->data->load_friction[k] -= p->data->load_residual[k];
            change = fmax(change, fabs(p->data->load_residual[k]) / fmax(fabs(before), p->unit));
        }
        if (change <= rounding_of_root)
            return KT_OK;
    }
    return reject_jam(p, 0, (double)NAN, error);
}

/* Finds the loads without this friction, and their gain by each friction. */
static kt_status find_gains(load_problem *p, double *a, kt_error *error) {
    kt_data *d = p->data;
    kt_clear(d->load_friction, p->n * sizeof *d->load_friction);
    kt_clear(d->load_gain, 3 * p->n * p->n * sizeof *d->load_gain);
    kt_status status = kt_loads_evaluate(p->model, d, p->at, a, error);
    kt_copy(d->load_free, d->load, 3 * p->n * sizeof *d->load);
    p->unit = 0.0;
    for (size_t k = 0; status == KT_OK && k < p->n; k++)
        p->unit = fmax(p->unit, kt_load_friction_find(p->model, d, kt_loaded_effect(p->model, k), 1.0));
    p->unit = p->unit > 0.0 ? p->unit : 1.0;
    for (size_t k = 0; status == KT_OK && k < p->n; k++) {
        if (kt_load_sign(p->model, d, kt_loaded_effect(p->model, k), p->at->v) == 0.0)
            continue;
        d->load_friction[k] = p->unit;
        status = kt_loads_evaluate(p->model, d, p->at, a, error);
        for (size_t c = 0; c < 3 * p->n; c++)
            d->load_gain[3 * k * p->n + c] = (d->load[c] - d->load_free[c]) / p->unit;
        d->load_friction[k] = 0.0;
    }
    return status;
}

/* Moves the constant part L0 of the affine loads L0 + G x by their difference from the evaluated loads. A load has
 * three components. Returns the largest error of the friction law, relative to the friction. */
static double correct_loads(const load_problem *p) {
    const kt_data *d = p->data;
    double worst = 0.0;
    for (size_t k = 0; k < p->n; k++) {
        const kt_effect_record *e = kt_loaded_effect(p->model, k);
        for (size_t c = 0; c < 3; c++) {
            double load = d->load_free[3 * k + c];
            for (size_t j = 0; j < p->n; j++)
                load += d->load_gain[3 * (j * p->n + k) + c] * d->load_friction[j];
            d->load_free[3 * k + c] += d->load[3 * k + c] - load;
        }
        const double s = kt_load_sign(p->model, d, e, p->at->v);
        const double friction = fabs(s) * kt_load_friction_find(p->model, d, e, s);
        worst = fmax(worst, fabs(d->load_friction[k] + copysign(friction, s)) / fmax(friction, p->unit));
    }
    return worst;
}

static bool any_acts(const kt_model *model, const kt_data *data, const double *v) {
    bool any = false;
    for (size_t k = 0; k < model->n.loaded; k++)
        any = any || kt_load_sign(model, data, kt_loaded_effect(model, k), v) != 0.0;
    return any;
}

/* Newton's method from the gains at zero friction, then corrections until an evaluation reproduces the loads. If no
 * such friction acts, the model's other forward dynamics (`unloaded`) serves alone. */
static kt_status load_forward(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                              kt_error *error) {
    load_problem p = {.model = model, .data = data, .at = at, .n = model->n.loaded};
    data->load_state = kt_state_hash(model, at->q, at->v);
    if (!any_acts(model, data, at->v)) {
        kt_clear(data->load_friction, p.n * sizeof *data->load_friction);
        kt_copy_or_clear(data->load_tau, at->tau, model->n.v * sizeof *data->load_tau);
        return model->unloaded(model, data, at, a, error);
    }
    kt_status status = find_gains(&p, a, error);
    for (int k = 0; status == KT_OK && k < CORRECTIONS_MAX; k++) {
        status = find_friction(&p, error);
        if (status == KT_OK)
            status = kt_loads_evaluate(model, data, at, a, error);
        if (status == KT_OK && correct_loads(&p) <= agrees)
            return evaluate_under_loads(model, data, at, a, true, error);
    }
    return status == KT_OK ? reject_jam(&p, 0, (double)NAN, error) : status;
}

void kt_load_attach(kt_model *model) {
    if (model->n.loaded == 0)
        return;
    model->unloaded = model->forward;
    model->forward = load_forward;
}
