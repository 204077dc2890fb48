/* The equations of a differential-algebraic baseline, F(y', y, t) = 0, at one stage:
 *
 *     xi' - B(xi) (v + A' mu)             n
 *     M v' - f - A' lambda                n
 *     closure equations of the type       m, of ggl 2 m
 *
 * with M, f and A at q0 (+) xi. A rotation that is q0 exp(xi) has the angular velocity w of the body for
 *
 *     xi' = w + xi x w / 2 + c xi x (xi x w),   x = |xi|
 *     c = (1 - (x / 2) cot(x / 2)) / x^2 = 1/12 + x^2 / 720 + ...
 *
 * Source: E. Hairer, C. Lubich, G. Wanner, Geometric Numerical Integration, IV.7.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/dae.h"
#include "joint/joint.h"
#include "model/model.h"

#include <math.h>
#include <string.h>

static kt_vec3 rotation_rate(kt_vec3 xi, kt_vec3 w) {
    const double square = kt_vec3_dot(xi, xi), x = sqrt(square);
    const double c =
        x < 1e-2 ? 1.0 / 12.0 + square / 720.0 + square * square / 30240.0 : (1.0 - 0.5 * x / tan(0.5 * x)) / square;
    const kt_vec3 once = kt_vec3_cross(xi, w), twice = kt_vec3_cross(xi, once);
    return kt_vec3_add(w, kt_vec3_add(kt_vec3_scale(0.5, once), kt_vec3_scale(c, twice)));
}

void kt_dae_tangent_rate(const kt_model *model, const double *xi, const double *u, double *rate) {
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        const int turning = link->v + motion.plain;
        for (int k = 0; k < motion.plain; k++)
            rate[link->v + k] = u[link->v + k];
        if (motion.quaternions)
            kt_joint_store(rate + turning, rotation_rate(kt_joint_load(xi + turning), kt_joint_load(u + turning)));
    }
}

/* The residual of closure equation r, in the form that the type requires. */
static double closure_of(const kt_dae *dae, size_t r, const double *acceleration) {
    const kt_constraint_formulation *e = dae->equations;
    const kt_dae_options *o = &dae->options;
    double second = -e->drift[r];
    switch (o->type) {
    case KT_DAE_INDEX3:
    case KT_DAE_GGL:
        return dae->holonomic[r] ? e->phi[r] : e->slip[r];
    case KT_DAE_INDEX2:
        return e->slip[r];
    default:
        for (size_t i = 0; i < dae->n; i++)
            second += e->jacobian[i * dae->k + r] * acceleration[i];
        return o->type == KT_DAE_STABILISED ? second + 2.0 * o->alpha * e->slip[r] + o->beta * o->beta * e->phi[r]
                                            : second;
    }
}

kt_status kt_dae_evaluate(kt_dae *dae, double t, const double *y, const double *rate, double *residual,
                          kt_error *error) {
    const size_t n = dae->n, k = dae->k, m = dae->m;
    const double *v = y + n, *lambda = y + 2 * n, *mu = lambda + m;
    const kt_constraint_formulation *e = dae->equations;
    kt_position_add(dae->model, dae->q, y, dae->stage_q);
    const kt_status status = kt_formulation_fill(dae->equations, dae->data, t, dae->stage_q, v, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < n; i++) {
        dae->u[i] = v[i];
        residual[n + i] = -e->force[i];
        for (size_t j = 0; j < n; j++) /* the lower triangle and its mirror are both there */
            residual[n + i] += e->mass[j * n + i] * rate[n + j];
        for (size_t r = 0; r < m; r++) {
            const double a = e->jacobian[i * k + (size_t)dae->row[r]];
            residual[n + i] -= a * lambda[r];
            if (dae->options.type == KT_DAE_GGL)
                dae->u[i] += a * mu[r];
        }
    }
    kt_dae_tangent_rate(dae->model, y, dae->u, dae->u + n);
    for (size_t i = 0; i < n; i++)
        residual[i] = rate[i] - dae->u[n + i];
    for (size_t r = 0; r < m; r++) {
        const size_t row = (size_t)dae->row[r];
        residual[2 * n + r] = closure_of(dae, row, rate + n);
        /* Rolling has nothing to stabilise: mu is 0. */
        if (dae->options.type == KT_DAE_GGL)
            residual[2 * n + m + r] = dae->holonomic[row] ? e->slip[row] : mu[r];
    }
    return KT_OK;
}

/* Columns of F by xi and v. Their steps are the cube root of rounding. */
static kt_status difference_residual(kt_dae *dae, double t, const double *y, const double *rate, kt_error *error) {
    const double step = 6e-6;
    kt_status status = KT_OK;
    memcpy(dae->stage_y, y, dae->size * sizeof *y);
    for (size_t j = 0; j < 2 * dae->n && status == KT_OK; j++) {
        double *column = dae->by_state + j * dae->size;
        const double h = step * fmax(1.0, fabs(y[j]));
        dae->stage_y[j] = y[j] - h;
        status = kt_dae_evaluate(dae, t, dae->stage_y, rate, dae->moved, error);
        dae->stage_y[j] = y[j] + h;
        if (status == KT_OK)
            status = kt_dae_evaluate(dae, t, dae->stage_y, rate, column, error);
        dae->stage_y[j] = y[j];
        for (size_t i = 0; i < dae->size; i++)
            column[i] = (column[i] - dae->moved[i]) / (2.0 * h);
    }
    return status;
}

kt_status kt_dae_differentiate(kt_dae *dae, double t, const double *y, const double *rate, kt_error *error) {
    const size_t n = dae->n, m = dae->m, k = dae->k, size = dae->size;
    const kt_constraint_formulation *e = dae->equations;
    const bool accelerates = dae->options.type == KT_DAE_INDEX1 || dae->options.type == KT_DAE_STABILISED;
    kt_status status = difference_residual(dae, t, y, rate, error);
    if (status == KT_OK)
        status = kt_dae_evaluate(dae, t, y, rate, dae->moved, error);
    if (status != KT_OK)
        return status;
    dae->counts.jacobians++;
    memset(dae->by_rest, 0, size * size * sizeof(double));
    for (size_t j = 0; j < n; j++) {
        dae->by_rest[j * size + j] = 1.0;
        for (size_t i = 0; i < n; i++)
            dae->by_rest[(n + j) * size + n + i] = e->mass[j * n + i];
        for (size_t r = 0; r < m; r++) {
            const double a = e->jacobian[j * k + (size_t)dae->row[r]];
            dae->by_rest[(2 * n + r) * size + n + j] = -a;
            if (accelerates)
                dae->by_rest[(n + j) * size + 2 * n + r] = a;
        }
    }
    for (size_t r = 0; r < m && dae->options.type == KT_DAE_GGL; r++) {
        for (size_t j = 0; j < n; j++)
            dae->u[j] = e->jacobian[j * k + (size_t)dae->row[r]];
        kt_dae_tangent_rate(dae->model, y, dae->u, dae->u + n);
        for (size_t j = 0; j < n; j++)
            dae->by_rest[(2 * n + m + r) * size + j] = -dae->u[n + j];
        if (!dae->holonomic[dae->row[r]])
            dae->by_rest[(2 * n + m + r) * size + 2 * n + m + r] = 1.0;
    }
    return KT_OK;
}
