/* Derivatives of friction that is proportional to reactions (evaluate/load_friction.c).
 *
 * The friction x of a state z obeys x + s(v) k(L(z, x)) = 0, with the loads L. Therefore, with K = s dk/dL,
 *
 *     (1 + K dL/dx) dx/dz = -(K dL/dz + k ds/dz)
 *
 * dL/dx is a derivative by joint forces. dL/dz at constant friction are central differences (difference.h).
 * Reactions are smooth even if friction changes its sign over a small speed, of which ds/dv is exact. By joint forces,
 * loads are affine, and one difference is exact. The equations of motion gain -dx/dz in D.
 *
 * Newton's matrices of implicit methods need no exact derivatives. They have dx/dv = -k ds/dv, at constant loads.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/difference.h"
#include "derivative/stiffness.h"

#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "evaluate/load_friction.h"
#include "kinetree/joint.h"

#include <math.h>
#include <string.h>

typedef enum load_variable { BY_POSITION, BY_VELOCITY, BY_STATE, BY_FORCE } load_variable;

/* Loads at a neighbouring state, at constant friction. */
typedef struct load_column {
    kt_linearized *w;
    const kt_dynamic_state *at;
    load_variable by;
    size_t j;
    kt_error *error;
} load_column;

static size_t velocity_of(const kt_model *model, size_t k) {
    return (size_t)model->link[kt_loaded_effect(model, k)->link[0]].v;
}

/* The loads at the state in w->q, w->v and the joint forces w->force, into data->load. */
static kt_status evaluate_neighbour(const load_column *c) {
    kt_linearized *w = c->w;
    kt_dynamic_state moved = {c->at->t, w->q, w->v, w->force, c->at->external};
    kt_status status = kt_effects_apply(w->model, w->data, &moved, c->error);
    kt_copy(w->data->load_friction, w->load_friction, w->model->n.loaded * sizeof *w->load_friction);
    return status == KT_OK ? kt_loads_evaluate(w->model, w->data, &moved, w->change, c->error) : status;
}

/* Evaluates the loads with one number moved: a position, a velocity, a joint force or an auxiliary state. */
static kt_status move_and_evaluate(const load_column *c, double moved) {
    kt_linearized *w = c->w;
    const size_t n = w->n;
    double *x = c->by == BY_STATE ? &w->data->x[c->j] : NULL;
    const double kept = x != NULL ? *x : 0.0;
    kt_clear(w->v, n * sizeof *w->v);
    w->v[c->j] = c->by == BY_POSITION ? moved : 0.0;
    kt_position_add(w->model, c->at->q, w->v, w->q);
    kt_copy(w->v, c->at->v, n * sizeof *w->v);
    kt_copy_or_clear(w->force, c->at->tau, n * sizeof *w->force);
    w->v[c->j] += c->by == BY_VELOCITY ? moved : 0.0;
    w->force[c->j] += c->by == BY_FORCE ? moved : 0.0;
    if (x != NULL)
        *x += moved;
    const kt_status status = evaluate_neighbour(c);
    if (x != NULL)
        *x = kept;
    return status;
}

/* A sample for differences (kt_differenced): the loads, three for each friction. */
static int sample_loads(void *user, double moved, double *values, double *largest) {
    const load_column *c = user;
    const kt_status status = move_and_evaluate(c, moved);
    const double *load = c->w->data->load;
    for (size_t i = 0; i < 3 * c->w->model->n.loaded && status == KT_OK; i++) {
        values[i] = load[i];
        *largest = fmax(*largest, fabs(load[i]));
    }
    return (int)status;
}

/* dL by a joint force, from a change as large as the friction, or 1. */
static kt_status difference_affine(const load_column *c) {
    kt_linearized *w = c->w;
    double unit = 0.0;
    for (size_t k = 0; k < w->model->n.loaded; k++)
        unit = fmax(unit, fabs(w->load_friction[k]));
    unit = unit > 0.0 ? unit : 1.0;
    const kt_status status = move_and_evaluate(c, unit);
    for (size_t i = 0; i < 3 * w->model->n.loaded; i++)
        w->load_best[i] = (w->data->load[i] - w->load_here[i]) / unit;
    return status;
}

/* Writes -dx/dz, of the frictions x by one variable z (see above), to data->load_residual. */
static kt_status find_friction_column(const load_column *c) {
    kt_linearized *w = c->w;
    kt_data *d = w->data;
    const kt_model *model = w->model;
    const size_t n = model->n.loaded;
    const kt_differenced loads = {sample_loads, (void *)c, 3 * n, w->load_sample, w->load_eight, w->load_six};
    const kt_status status = c->by == BY_FORCE ? difference_affine(c)
                                               : (kt_status)kt_difference_find(&loads, KT_DIFFERENCE_STEP, w->load_best,
                                                                               &d->difference_error);
    if (status != KT_OK)
        return status;
    for (size_t k = 0; k < n; k++) {
        const double *g = w->load_gradient + 3 * k, *dl = w->load_best + 3 * k;
        const bool own = c->by == BY_VELOCITY && velocity_of(model, k) == c->j;
        d->load_residual[k] = g[0] * dl[0] + g[1] * dl[1] + g[2] * dl[2] + (own ? w->load_slope[k] : 0.0);
        for (size_t j = 0; j < n; j++) {
            const double *gain = w->load_gain + 3 * (j * n + k);
            d->load_matrix[j * n + k] = (double)(j == k) + g[0] * gain[0] + g[1] * gain[1] + g[2] * gain[2];
        }
    }
    return kt_loads_solve(model, d, c->at, c->error);
}

/* Adds -dx/dz to the columns of a matrix of n rows. */
static kt_status add_columns(kt_linearized *w, const kt_dynamic_state *at, load_variable by, size_t columns, double *d,
                             kt_error *error) {
    load_column c = {w, at, by, 0, error};
    kt_status status = KT_OK;
    for (; c.j < columns && status == KT_OK; c.j++) {
        status = find_friction_column(&c);
        for (size_t k = 0; k < w->model->n.loaded && status == KT_OK; k++)
            d[c.j * w->n + velocity_of(w->model, k)] += w->data->load_residual[k];
    }
    return status;
}

/* ---- the motion itself ------------------------------------------------------------------------------------------- */

/* dL/dx: the loads are affine in the friction. */
static kt_status find_load_gain(kt_linearized *w, const kt_dynamic_state *at, kt_error *error) {
    const size_t n = w->model->n.loaded;
    kt_status status = KT_OK;
    for (size_t k = 0; k < n && status == KT_OK; k++) {
        const load_column c = {w, at, BY_FORCE, velocity_of(w->model, k), error};
        status = difference_affine(&c);
        kt_copy(w->load_gain + 3 * n * k, w->load_best, 3 * n * sizeof *w->load_best);
    }
    return status;
}

/* Before the other terms, because the multipliers of loops depend on the friction. */
kt_status kt_linearized_find_loads(kt_linearized *w, const kt_dynamic_state *at, kt_error *error) {
    const kt_model *model = w->model;
    kt_data *d = w->data;
    load_column here = {w, at, BY_POSITION, 0, error};
    kt_status status = kt_acceleration_trusted(model, d, at, w->a, error);
    kt_copy(w->load_friction, d->load_friction, model->n.loaded * sizeof *w->load_friction);
    if (status == KT_OK)
        status = move_and_evaluate(&here, 0.0);
    kt_copy(w->load_here, d->load, 3 * model->n.loaded * sizeof *w->load_here);
    for (size_t k = 0; k < model->n.loaded && status == KT_OK; k++) {
        const kt_effect_record *e = kt_loaded_effect(model, k);
        const double s = kt_load_sign(model, d, e, at->v);
        const double size = kt_load_law(model, e, d->load + 3 * k, s, w->load_gradient + 3 * k);
        for (size_t i = 0; i < 3; i++)
            w->load_gradient[3 * k + i] *= s;
        w->load_slope[k] = size * kt_load_sign_slope(model, d, e, at->v);
    }
    return status == KT_OK && w->exact ? find_load_gain(w, at, error) : status;
}

kt_status kt_linearized_subtract_loads(kt_linearized *w, const kt_dynamic_state *at, kt_error *error) {
    if (w->model->n.loaded == 0)
        return KT_OK;
    for (size_t k = 0; k < w->model->n.loaded && !w->exact; k++)
        w->d_v[velocity_of(w->model, k) * (w->n + 1)] += w->load_slope[k];
    kt_status status = w->exact ? add_columns(w, at, BY_POSITION, w->n, w->d_q, error) : KT_OK;
    if (status == KT_OK && w->exact)
        status = add_columns(w, at, BY_VELOCITY, w->n, w->d_v, error);
    if (status == KT_OK && w->exact)
        status = add_columns(w, at, BY_STATE, w->model->n.x, w->force_x, error);
    return status;
}

kt_status kt_linearized_load_forces(kt_linearized *w, const kt_dynamic_state *at, double *d_tau, kt_error *error) {
    return w->model->n.loaded == 0 ? KT_OK : add_columns(w, at, BY_FORCE, w->n, d_tau, error);
}
