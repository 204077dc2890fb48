/* Derivatives of the equations of motion and of the loops with respect to the numbers of a parameter, at a state. They
 * are dr/dp of
 *
 *     r(q, v, a; p) = M a + h - J' external - Q,
 *
 * dM/dp x, and those of phi, b' and b''.
 *
 * The derivatives are central differences in a copy of the model. The residual r is linear in gravity, mass and inertia
 * and quadratic in com, so that differences of order two are exact. These numbers are shifted by their own size, so
 * that only rounding is lost. Forces of effects may bend anywhere (a limit, dry friction), but are polynomials of most
 * of their numbers. These are shifted by a 1024th, in differences of order four. So are masses, coms and gravity if a
 * formula reads gravity forces. Armature is the diagonal of M.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "evaluate/load_friction.h"
#include "sensitivity/sensitivity.h"

#include <string.h>

KT_ARENA_ARRAYS(place_arrays, kt_parameter_work, KT_PARAMETER_FIELDS, const kt_model *model, size_t n, size_t p)

size_t kt_parameter_work_size(const kt_model *model) {
    return place_arrays(NULL, NULL, model, model->n.v, model->n.row);
}

kt_status kt_parameter_begin(kt_parameter_work *w, const kt_model *model, kt_data *data, void *memory,
                             const kt_parameter *parameter, kt_error *error) {
    kt_status status = kt_parameter_require(model, parameter, error);
    if (status == KT_OK)
        status = kt_load_reject(model, "parameter", "take differences of two runs", error);
    if (status != KT_OK)
        return status;
    if (parameter->kind == KT_PARAMETER_HOLD)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "parameter",
                            "there is no derivative with respect to hold, which is a choice of assembly and no number");
    if (parameter->kind == KT_PARAMETER_LOOP_PLACE)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, "parameter",
                            "there is no derivative with respect to the place of a loop; take differences of two runs");
    if (!kt_parameter_stands(model, parameter))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "parameter",
                            "the function of time of %s is neither constant nor set with kt_parameter_set, so it has "
                            "no numbers; set it in a copy of the model, and differentiate that copy",
                            kt_name_quote(parameter->key->name).text);
    *w = (kt_parameter_work){
        .parameter = parameter, .data = data, .n = model->n.v, .p = model->n.row, .count = (size_t)parameter->count};
    (void)place_arrays(w, memory, model, w->n, w->p);
    const kt_status read = kt_parameter_get(model, parameter, w->now, error);
    return read != KT_OK ? read : kt_model_copy(model, w->copy, kt_model_size(model), &w->shifted, error);
}

/* ---- differences ------------------------------------------------------------------------------------------------- */

/* A quantity that depends on the parameter, written to `out`, which has room for twice as many numbers. */
typedef kt_status quantity(const kt_model *model, kt_data *data, const kt_parameter_point *at, double *out,
                           kt_error *error);

/* r */
static kt_status find_force_residual(const kt_model *model, kt_data *data, const kt_parameter_point *at, double *out,
                                     kt_error *error) {
    kt_dynamic_state loaded = {.t = at->t, .q = at->q, .v = at->v, .external = at->external};
    double *other = out + model->n.v;
    kt_status status = model->n.effect ? kt_effects_apply(model, data, &loaded, error) : KT_OK;
    if (status != KT_OK)
        return status;
    memcpy(other, loaded.tau ? loaded.tau : model->zero, model->n.v * sizeof *other);
    status = kt_inverse_trusted(model, data, at->q, at->v, at->a, loaded.external, out, error);
    for (size_t i = 0; i < model->n.v && status == KT_OK; i++)
        out[i] -= other[i];
    return status;
}

/* Computes M a with inverse dynamics at rest, as the difference with and without the accelerations. */
kt_status kt_parameter_inertia(const kt_model *model, kt_data *data, const kt_parameter_point *at, double *out,
                               kt_error *error) {
    double *other = out + model->n.v;
    kt_status status = kt_inverse_trusted(model, data, at->q, NULL, at->a, NULL, out, error);
    if (status == KT_OK)
        status = kt_inverse_trusted(model, data, at->q, NULL, NULL, NULL, other, error);
    for (size_t i = 0; i < model->n.v && status == KT_OK; i++)
        out[i] -= other[i];
    return status;
}

/* phi */
static kt_status find_loop_gap(const kt_model *model, kt_data *data, const kt_parameter_point *at, double *out,
                               kt_error *error) {
    return kt_loop_equations(model, data, at->t, at->q, NULL, NULL, out, NULL, NULL, error);
}

/* -b' = phi_t: kt_loop_equations returns b', for which A v = b'. */
static kt_status find_loop_rate(const kt_model *model, kt_data *data, const kt_parameter_point *at, double *out,
                                kt_error *error) {
    const kt_status status = kt_loop_equations(model, data, at->t, at->q, at->v, NULL, NULL, out, NULL, error);
    for (size_t i = 0; i < model->n.row && status == KT_OK; i++)
        out[i] = -out[i];
    return status;
}

static kt_status find_loop_drift(const kt_model *model, kt_data *data, const kt_parameter_point *at, double *out,
                                 kt_error *error) {
    return kt_loop_equations(model, data, at->t, at->q, at->v, NULL, NULL, NULL, out, error);
}

/* Whether r is a polynomial of degree two in the numbers of the parameter. */
static bool is_quadratic(const kt_parameter_work *w) {
    return w->parameter->kind < KT_PARAMETER_EFFECT && w->shifted->n.gravity == 0;
}

/* The shift of number k. */
static double number_shift_of(const kt_parameter_work *w, int k) {
    const double size = fabs(w->now[k]);
    if (is_quadratic(w))
        return fmax(size, 1.0);
    return 0x1p-10 * (size > 0.0 ? size : 1.0);
}

/* The derivative of `count` values with respect to number k. An infinite number (an absent limit) has the derivative
 * 0. */
static kt_status differentiate_by_number(kt_parameter_work *w, int k, quantity *of, const kt_parameter_point *at,
                                         size_t count, double *out, kt_error *error) {
    static const double weights[2][5] = {{0.0, -0.5, 0.0, 0.5, 0.0},
                                         {1.0 / 12.0, -2.0 / 3.0, 0.0, 2.0 / 3.0, -1.0 / 12.0}};
    const double *weight = weights[!is_quadratic(w)] + 2;
    const double reach = number_shift_of(w, k);
    kt_status status = KT_OK;
    memset(out, 0, count * sizeof *out);
    for (int s = -2; s <= 2 && status == KT_OK && isfinite(w->now[k]); s++) {
        double values[KT_PARAMETER_MAX];
        if (weight[s] == 0.0)
            continue;
        memcpy(values, w->now, sizeof values);
        values[k] += s * reach;
        kt_parameter_put(w->shifted, w->parameter, values);
        status = of(w->shifted, w->data, at, w->value, error);
        for (size_t i = 0; i < count && status == KT_OK; i++)
            out[i] += weight[s] / reach * w->value[i];
    }
    kt_parameter_put(w->shifted, w->parameter, w->now);
    return status;
}

/* The derivative of the forces r or M a with respect to number k. With respect to an armature, the derivative is the
 * acceleration itself. */
static kt_status differentiate_forces(kt_parameter_work *w, int k, quantity *of, const kt_parameter_point *at,
                                      double *out, kt_error *error) {
    if (w->parameter->kind != KT_PARAMETER_ARMATURE)
        return differentiate_by_number(w, k, of, at, w->n, out, error);
    const int v = w->shifted->body[w->parameter->item].v + k;
    memset(out, 0, w->n * sizeof *out);
    out[v] = at->a[v];
    return KT_OK;
}

/* ---- what they are needed for ------------------------------------------------------------------------------------ */

kt_status kt_parameter_residual(kt_parameter_work *w, int k, const kt_parameter_point *at, double *out,
                                kt_error *error) {
    return differentiate_forces(w, k, find_force_residual, at, out, error);
}

kt_status kt_parameter_drift(kt_parameter_work *w, int k, const kt_parameter_point *at, double *out, kt_error *error) {
    return differentiate_by_number(w, k, find_loop_drift, at, w->p, out, error);
}

kt_status kt_parameter_project(kt_parameter_work *w, double t, const double *q, const double *v, const double *x,
                               kt_error *error) {
    const kt_parameter_kind kind = w->parameter->kind;
    const kt_parameter_point at = {.t = t, .q = q, .v = v, .a = x};
    kt_status status = KT_OK;
    memset(w->inertia, 0, w->n * KT_PARAMETER_MAX * sizeof *w->inertia);
    memset(w->gap, 0, w->p * KT_PARAMETER_MAX * sizeof *w->gap);
    for (int k = 0; k < w->parameter->count && status == KT_OK; k++) {
        if (kind >= KT_PARAMETER_MASS && kind <= KT_PARAMETER_ARMATURE)
            status = differentiate_forces(w, k, kt_parameter_inertia, &at, w->inertia + (size_t)k * w->n, error);
        if (kind == KT_PARAMETER_LOOP_CURVE)
            status = differentiate_by_number(w, k, v ? find_loop_rate : find_loop_gap, &at, w->p,
                                             w->gap + (size_t)k * w->p, error);
    }
    return status;
}
