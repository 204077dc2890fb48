/* The accelerations of a whole mechanism: effects are summed, then a tree or a mechanism with loops is computed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/evaluate.h"

#include "algebra/finite.h"
#include "assembly/rejected_loops.h"
#include "base/copy.h"
#include "base/where.h"
#include "constraint/rejecting_loop.h"
#include "dynamics/dynamics.h"
#include "kinetree/algebra.h"

#include <string.h>

kt_status kt_wrenches_check(const kt_model *model, const double *q, const double *v, const kt_wrench *external,
                            kt_error *error) {
    const kt_input input = {.q = q, .v = v, .external = external};
    return kt_input_check(model, &input, error);
}

kt_status kt_inertia_reject(const char *where, kt_error *error) {
    return kt_error_set(
        error, KT_ERROR_SINGULAR, where,
        "the mechanism has no positive inertia along one of the degrees of freedom that its loops leave");
}

/* Explains why a mechanism with loops has no acceleration. The joint of link `failed` has no inertia or, if `failed`
 * is 0, the acceleration is not finite. The error names the input or the loop of the caller at fault, or the joint. */
static kt_status reject_closed_forward(const kt_model *model, kt_data *data, const kt_dynamic_state *at, size_t failed,
                                       kt_error *error) {
    const kt_input input = {.q = at->q, .v = at->v, .x = at->tau, .what = "force or torque", .external = at->external};
    kt_status status = kt_input_check(model, &input, error);
    if (status != KT_OK)
        return status;
    if (failed) {
        const char *joint = model->text + model->body[model->link[failed].body].joint_name;
        const kt_where_text where = kt_where_format("joint '%.100s', t = %.9g s", joint, at->t);
        status = kt_inertia_reject_motion(model, where.text, error);
    } else {
        status = kt_result_reject(model, data->scratch, "acceleration", error);
    }
    return kt_loops_explain(model, data, at->t, at->q, at->v, status, error);
}

/* Next to a singular position, kt_crossing_accelerate decides between this acceleration and an interpolated one. */
kt_status kt_closed_forward(const kt_model *model, kt_data *data, const kt_dynamic_state *given, double *a,
                            kt_error *error) {
    kt_dynamic_state at = *given;
    at.tau = at.tau ? at.tau : model->zero;
    data->interpolated = false;
    size_t failed = model->group_kernels->forward(model, data, &at, false, data->scratch);
    if (kt_is_near_singular(model, data))
        failed = kt_crossing_accelerate(model, data, &at, failed);
    if (failed || !kt_all_finite(data->scratch, model->n.v))
        return reject_closed_forward(model, data, &at, failed, error);
    memcpy(a, data->scratch, model->n.v * sizeof *a);
    return KT_OK;
}

/* With forces besides those of joints. Not inlined: all other evaluations would save its registers. */
static __attribute__((noinline)) kt_status accelerate_loaded(const kt_model *model, kt_data *data,
                                                             const kt_dynamic_state *at, double *a, kt_error *error) {
    kt_dynamic_state loaded;
    kt_status status = at->external ? kt_wrenches_check(model, at->q, at->v, at->external, error) : KT_OK;
    if (status != KT_OK)
        return status;
    if (model->n.effect) {
        loaded = *at;
        status = kt_effects_apply(model, data, &loaded, error);
        at = &loaded;
    }
    if (status == KT_OK)
        status = model->forward(model, data, at, a, error);
    return model->custom ? kt_stop_report(model, data, at->t, status, error) : status;
}

/* Inlined: the recursion alone is the last call of both callers, after which they need no registers. */
KT_INLINE kt_status accelerate(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                               kt_error *error) {
    return at->external || model->n.effect || model->custom ? accelerate_loaded(model, data, at, a, error)
                                                            : model->forward(model, data, at, a, error);
}

kt_status kt_acceleration_trusted(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                  kt_error *error) {
    return accelerate(model, data, at, a, error);
}

/* Checks open contacts before. Their poses serve the accelerations of slip, too, unless effects come between. */
static kt_status accelerate_checked(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                                    kt_error *error) {
    kt_status status = model->variants->check_open(model, data, at->t, at->q, at->v, error);
    data->placed = data->placed && model->n.effect == 0;
    if (status == KT_OK)
        status = kt_acceleration_trusted(model, data, at, a, error);
    data->placed = false;
    return status;
}

kt_status kt_acceleration_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                                   const double *tau, const kt_wrench *external, double *a, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, a || !model->n.v))
        return KT_ERROR_ARGUMENT;
    const kt_dynamic_state at = {t, q, v ? v : model->zero, tau, external};
    if (model->variants != NULL && !data->followed)
        return accelerate_checked(model, data, &at, a, error);
    return accelerate(model, data, &at, a, error);
}

/* Points at->external at the sum of its wrenches and the wrenches of changing masses (dynamics/variable_mass.c). */
static kt_status add_mass_rates(const kt_model *model, kt_data *data, kt_dynamic_state *at, const double *a,
                                kt_error *error) {
    kt_copy_or_clear(data->mass_wrench, at->external, model->n.body * sizeof *data->mass_wrench);
    at->external = data->mass_wrench;
    return kt_masses_add_rates(model, data, at->t, at->q, at->v, a, data->mass_wrench, error);
}

kt_status kt_acceleration_time_derivative(const kt_model *model, kt_data *data, const kt_dynamic_state *at,
                                          const double *a, double *da_dt, kt_error *error) {
    kt_dynamic_state loaded = *at;
    kt_status status = kt_effects_apply_rising(model, data, &loaded, error);
    if (status == KT_OK && model->n.varying)
        status = add_mass_rates(model, data, &loaded, a, error);
    if (status == KT_OK)
        status = model->forward(model, data, &loaded, da_dt, error);
    for (size_t i = 0; i < model->n.v && status == KT_OK; i++)
        da_dt[i] -= a[i];
    return status;
}

void kt_slip_begin_load(const kt_model *model, kt_data *data, const kt_wrench *external) {
    kt_copy_or_clear(data->slip_loaded, external, model->n.body * sizeof *data->slip_loaded);
}

void kt_slip_add_force(kt_data *data, const kt_effect_record *effect, size_t k, double x, double y) {
    const kt_slip_frame *frame = &data->slip_frame[k];
    for (int end = 0; end < 2; end++) {
        const double sign = end == 0 ? 1.0 : -1.0;
        const kt_vec3 force =
            kt_vec3_add(kt_vec3_scale(sign * x, frame->axis[0]), kt_vec3_scale(sign * y, frame->axis[1]));
        kt_wrench *body = &data->slip_loaded[effect->body[end]];
        body->moment = kt_vec3_add(body->moment, kt_vec3_cross(frame->arm[end], force));
        body->force = kt_vec3_add(body->force, force);
    }
}

void kt_slip_add_friction_load(kt_data *data, const kt_effect_record *effect, size_t k, double normal) {
    const double *e = data->slip_direction + 2 * k, force = -effect->friction * normal;
    kt_slip_add_force(data, effect, k, force * e[0], force * e[1]);
}

const kt_wrench *kt_slip_load(const kt_model *model, kt_data *data, const kt_wrench *external) {
    kt_slip_begin_load(model, data, external);
    for (size_t k = 0; k < model->n.slip; k++)
        kt_slip_add_friction_load(data, kt_effect_record_find(model, kt_slip_loop(model, k)->slips - 1), k,
                                  data->slip_normal[k]);
    return data->slip_loaded;
}

kt_status kt_slip_reject(const kt_model *model, const char *where, kt_error *error) {
    return model->n.slip == 0
               ? KT_OK
               : kt_error_set(
                     error, KT_ERROR_UNSUPPORTED, where,
                     "'%.60s' is a hard contact that slips, and derivatives of its friction are not computed; take "
                     "differences, or an elastic contact (stiffness)",
                     kt_slip_name(model, 0));
}
