/* Powers, computed only on request.
 *
 * The forces on a tree are tau' = tau + effects + J' external, and the forces that hold the loops closed are A' lambda:
 *     M a + h = tau' + A' lambda
 *     d(T + V)/dt = v . (tau' + A' lambda) + dV/dt
 * Effects report the dissipated and the supplied part of their power (effect/effect.h), and account for dV/dt. On the
 * manifold A v = b', so that v . A' lambda = lambda . b' = -lambda . phi_t. Only loops that change with time do work,
 * so that nothing is computed without such loops. Otherwise inverse dynamics evaluates v . (M a + h - tau'). This sum
 * needs no multipliers, so that the solution method and redundant equations do not affect the power. Like a, the power
 * passes smoothly through singular positions. Mass that leaves or joins a body of variable mass takes energy along
 * (dynamics/variable_mass.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "evaluate/load_friction.h"
#include "linear/cholesky.h"
#include "model/scratch.h"

/* sum over bodies of n . w + f . v */
static double power_of_wrenches(const kt_model *model, kt_data *data, const double *q, const double *v,
                                const kt_wrench *wrenches) {
    double sum = 0.0;
    kt_link_kinematics *links = kt_links_scratch(data);
    kt_links_sweep(model, data, q, v, links);
    for (int b = 1; b < (int)model->n.body; b++) {
        const kt_twist twist = kt_links_twist(model, links, b);
        sum += kt_vec3_dot(wrenches[b].moment, twist.angular) + kt_vec3_dot(wrenches[b].force, twist.linear);
    }
    return sum;
}

/* v . (M a + h - tau - J' external) */
static kt_status power_of_loops(const kt_model *model, kt_data *data, const kt_dynamic_state *at, const double *a,
                                double *power, kt_error *error) {
    double *needed = kt_scratch_part(model, data, 1);
    const kt_status status = kt_inverse_trusted(model, data, at->q, at->v, a, at->external, needed, error);
    if (status == KT_OK)
        *power = kt_dense_dot(at->v, needed, (int)model->n.v) -
                 (at->tau ? kt_dense_dot(at->v, at->tau, (int)model->n.v) : 0.0);
    return status;
}

/* Powers can overflow where accelerations do not. */
static kt_status reject_power(const kt_model *model, double t, const kt_input *input, kt_error *error) {
    const kt_status status = kt_input_check(model, input, error);
    if (status != KT_OK)
        return status;
    return kt_error_set(error, KT_ERROR_NOT_FINITE, kt_where_format("t = %.9g s", t).text,
                        "a power overflows; look for a velocity, force or torque that is huge");
}

/* The power that friction of contacts that slip dissipated in the last evaluation. */
static double power_of_slip(const kt_model *model, const kt_data *data) {
    double sum = 0.0;
    for (size_t k = 0; k < model->n.slip; k++) {
        const double *s = data->slip_velocity + 2 * k, *e = data->slip_direction + 2 * k;
        sum += kt_slip_friction(model, k) * data->slip_normal[k] * (e[0] * s[0] + e[1] * s[1]);
    }
    return sum;
}

kt_status kt_power_evaluate(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                            const double *tau, const kt_wrench *external, double *a, kt_power *power, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) || KT_IS_MISSING(error, q || !model->n.q, a || !model->n.v, power))
        return KT_ERROR_ARGUMENT;
    v = v ? v : model->zero;
    kt_dynamic_state loaded = {t, q, v, tau, external};
    double *acceleration = kt_scratch_part(model, data, 2), loops = 0.0;
    kt_power sum = {0.0, 0.0};
    kt_status status = kt_open_contacts_reject(model, data, &loaded, error);
    if (status == KT_OK && external)
        status = kt_wrenches_check(model, q, v, external, error);
    if (status == KT_OK && model->n.effect)
        status = kt_effects_account(model, data, &loaded, &sum, error);
    if (status != KT_OK)
        return status;
    status = model->forward(model, data, &loaded, acceleration, error);
    if (status == KT_OK && model->n.slip > 0) {
        sum.dissipated += power_of_slip(model, data);
        if (model->driven)
            loaded.external = kt_slip_load(model, data, loaded.external);
    }
    if (status == KT_OK && model->n.loaded > 0) {
        sum.dissipated += kt_load_power(model, data, v);
        loaded.tau = data->load_tau;
    }
    if (status == KT_OK && model->driven)
        status = power_of_loops(model, data, &loaded, acceleration, &loops, error);
    if (status != KT_OK)
        return status;
    sum.supplied += loops;
    if (model->n.varying)
        sum.supplied += kt_masses_power(model, data, t, q, v);
    if (tau)
        sum.supplied += kt_dense_dot(tau, v, (int)model->n.v);
    if (external)
        sum.supplied += power_of_wrenches(model, data, q, v, external);
    if (!isfinite(sum.dissipated + sum.supplied)) {
        const kt_input input = {.q = q, .v = v, .x = tau, .what = "force or torque", .external = external};
        return reject_power(model, t, &input, error);
    }
    kt_copy(a, acceleration, model->n.v * sizeof *a);
    *power = sum;
    return KT_OK;
}
