/* Masses that are functions of time: rockets, leaking vessels, conveyors.
 *
 * A body has mass m(t) and inertia J(t) about its centre of mass, which is fixed in the body. Such a body moves under
 * the equations of a body of constant mass, with the m and J of the instant. The mass that has left the body no longer
 * belongs to it [MSD H 3.1]:
 *
 *     m a_c = f + m' u,   J w' + w x J w = moments
 *
 * where u is the velocity, relative to the body, of the mass that leaves (m' < 0) or arrives. The thrust m' u is an
 * effect (effect/thrust.c). Without a thrust, the velocity of the leaving mass does not change. Thus M(q, t) and h(q,
 * v, t) are those of a model whose masses are constant. Each evaluation builds that model in the data, as a copy of all
 * parts that contain masses, and evaluates this model with the usual functions. Models of constant masses execute
 * nothing of this file.
 *
 * The mass that leaves takes energy along: at fixed q and v, with v_c and c of the centre of mass,
 *
 *     d(T + V)/dt = sum m' v_c^2 / 2 + w . J' w / 2 - m' g . c
 *
 * which counts as supplied (evaluate/power.c). If a method needs da/dt at fixed q and v,
 *
 *     M da/dt = d(tau)/dt - sum over bodies of the wrench that m' and J' need in place of m and J.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/vector_parts.h"
#include "base/copy.h"
#include "base/where.h"
#include "dynamics/dynamics.h"
#include "dynamics/without_masses.h"
#include "kinetree/dynamics.h"

#include <string.h>

/* ---- masses of an instant ---------------------------------------------------------------------------------------- */

/* A mass and an inertia about the centre of mass, or their derivatives by time. */
typedef struct content {
    double mass;
    kt_sym3 inertia;
} content;

/* order: 0, the values; 1, the derivatives. */
static content content_at(const kt_model *model, const kt_mass_record *r, double t, int order) {
    const kt_body_record *body = &model->body[r->body];
    double m[3], j[6][3];
    kt_curve_evaluate(&r->curve[0], model->number, t, m);
    if (!r->has_moments)
        return (content){m[order], kt_sym3_scaled(m[order] / body->mass, body->inertia)};
    for (int k = 0; k < 6; k++)
        kt_curve_evaluate(&r->curve[1 + k], model->number, t, j[k]);
    return (content){m[order],
                     kt_sym3_make(j[0][order], j[1][order], j[2][order], j[3][order], j[4][order], j[5][order])};
}

static const kt_kernels *steady_kernels(const kt_model *model) {
    return kt_kernels_of(model->isa, model->sweep, model->has_armature);
}

/* Sums the inertias again of all links that carry a variable mass. */
static void load_links(kt_model *now, const kt_model *model, double t) {
    for (size_t k = 0; k < model->n.varying; k++) {
        const kt_mass_record *r = &model->varying[k];
        const content c = content_at(model, r, t, 0);
        kt_body_record *body = &now->body[r->body];
        kt_link *link = &now->link[body->link];
        body->mass = c.mass;
        body->inertia = c.inertia;
        link->mass = 0.0;
        link->moment = kt_vec3_make(0.0, 0.0, 0.0);
        link->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    }
    for (size_t b = 1; b < now->n.body; b++)
        if (now->body[b].on_variable_link)
            kt_link_load(now, &now->body[b]);
    for (size_t k = 0; k < model->n.varying; k++) {
        const size_t link = (size_t)now->body[model->varying[k].body].link;
        if (link >= now->n.spatial && link > 0)
            kt_planar_link_set_inertia(now, link - now->n.spatial + 1);
    }
}

const kt_model *kt_model_of_instant(const kt_model *model, const kt_data *data) {
    kt_model *now = data->instant;
    char *links = data->instant_links;
    *now = *model;
    now->n.varying = 0;
    now->forward = model->steady;
    now->kernels = steady_kernels(model);
    now->link = (kt_link *)(void *)links;
    now->rest = (kt_link_rest *)(void *)(links + ((const char *)model->rest - (const char *)model->link));
    now->planar = data->instant_planar;
    now->body = data->instant_body;
    memcpy(links, model->link, kt_links_bytes(&model->n));
    kt_copy(now->planar, model->planar, model->n.planar * sizeof *now->planar);
    memcpy(now->body, model->body, model->n.body * sizeof *now->body);
    load_links(now, model, data->mass_time[0]);
    return now;
}

/* Rejects masses that are not above a part of their start at t, or inertias that are not finite, naming the body. */
static kt_status check_masses(const kt_model *model, double t, double part, kt_error *error) {
    for (size_t k = 0; k < model->n.varying; k++) {
        const kt_mass_record *r = &model->varying[k];
        const content c = content_at(model, r, t, 0);
        const double all = c.inertia.xx + c.inertia.yy + c.inertia.zz + c.inertia.xy + c.inertia.xz + c.inertia.yz;
        if (c.mass > part * model->body[r->body].mass && isfinite(c.mass) && isfinite(all))
            continue;
        return kt_error_set(
            error, KT_ERROR_SINGULAR,
            kt_where_format("body '%.100s', t = %.9g s", kt_body_name(model, r->body), t).text,
            "its mass is %g kg there; a mass must stay above 0, and inertias finite: let its function end above 0",
            c.mass);
    }
    return KT_OK;
}

/* ---- evaluations ------------------------------------------------------------------------------------------------- */

/* Forward dynamics of a model of variable masses with its loops (kt_model.forward): updates the masses to the time of
 * `at`, and solves the equations of a model whose masses are those of this instant. If these are singular, the error
 * names a body without mass. */
static kt_status forward_at(const kt_model *model, kt_data *data, const kt_dynamic_state *at, double *a,
                            kt_error *error) {
    static const double rounding = 1e-9; /* part of the mass at the start. Adaptive steps approach the time at which the
                                          * mass ends, so that the mass may be small and still positive there */
    kt_status status = kt_masses_update(model, data, at->t, error);
    if (status == KT_OK)
        status = model->steady(kt_model_of_instant(model, data), data, at, a, error);
    const kt_status cause = status == KT_ERROR_SINGULAR ? check_masses(model, at->t, rounding, error) : KT_OK;
    return cause != KT_OK ? cause : status;
}

static size_t variable_mass_forward(const kt_model *model, kt_data *data, const double *q, const double *v,
                                    const double *tau, const kt_wrench *external, double *a) {
    const kt_model *now = kt_model_of_instant(model, data);
    return now->kernels->forward(now, data, q, v, tau, external, a);
}

static void variable_mass_inverse(const kt_model *model, kt_data *data, const double *q, const double *v,
                                  const double *a, const kt_wrench *external, double *tau) {
    const kt_model *now = kt_model_of_instant(model, data);
    now->kernels->inverse(now, data, q, v, a, external, tau);
}

static size_t variable_mass_matrix(const kt_model *model, kt_data *data, const double *q, double *matrix) {
    const kt_model *now = kt_model_of_instant(model, data);
    return now->kernels->mass(now, data, q, matrix);
}

void kt_masses_attach(kt_model *model) {
    static const kt_kernels kernels = {.name = "variable masses",
                                       .forward = variable_mass_forward,
                                       .inverse = variable_mass_inverse,
                                       .mass = variable_mass_matrix,
                                       .mirror = mirror,
                                       .kinematics = kinematics,
                                       .follow = follow,
                                       .force_links = force_links};
    if (!model->n.varying)
        return;
    if (model->forward != forward_at)
        model->steady = model->forward;
    model->forward = forward_at;
    model->kernels = &kernels;
}

/* ---- rates ------------------------------------------------------------------------------------------------------- */

double kt_masses_power(const kt_model *model, kt_data *data, double t, const double *q, const double *v) {
    kt_link_kinematics *links = kt_links_scratch(data);
    const kt_vec3 g = kt_v4_vec3(model->gravity);
    double power = 0.0;
    kt_links_sweep(model, data, q, v, links);
    for (size_t k = 0; k < model->n.varying; k++) {
        const kt_mass_record *r = &model->varying[k];
        const kt_body_record *body = &model->body[r->body];
        const kt_link_kinematics *link = &links[body->link];
        const content rate = content_at(model, r, t, 1);
        if (body->fixed) /* as in kt_potential_energy */
            continue;
        const kt_mat3 axes = kt_mat3_multiply(link->axes, body->in_link.rotation);
        const kt_vec3 arm = kt_mat3_apply(link->axes, kt_pose_apply(body->in_link, body->com));
        const kt_vec3 w = kt_mat3_apply_transposed(axes, link->omega);
        const kt_vec3 velocity = kt_vec3_add(link->velocity, kt_vec3_cross(link->omega, arm));
        power += 0.5 * rate.mass * kt_vec3_dot(velocity, velocity);
        power += 0.5 * kt_vec3_dot(w, kt_sym3_apply(rate.inertia, w));
        power -= rate.mass * kt_vec3_dot(g, kt_vec3_add(link->position, arm));
    }
    return power;
}

kt_status kt_masses_add_rates(const kt_model *model, kt_data *data, double t, const double *q, const double *v,
                              const double *a, kt_wrench *wrenches, kt_error *error) {
    kt_link_kinematics *links = kt_links_scratch(data);
    const kt_status status = kt_links_update(model, data, q, v, a, false, links, error);
    for (size_t k = 0; k < model->n.varying && status == KT_OK; k++) {
        const kt_mass_record *r = &model->varying[k];
        const kt_body_record *body = &model->body[r->body];
        const kt_link_kinematics *link = &links[body->link];
        const content rate = content_at(model, r, nextafter(t, (double)INFINITY), 1);
        const kt_mat3 axes = kt_mat3_multiply(link->axes, body->in_link.rotation);
        const kt_vec3 w = kt_mat3_apply_transposed(axes, link->omega);
        const kt_vec3 alpha = kt_mat3_apply_transposed(axes, link->alpha);
        const kt_vec3 acceleration = kt_links_acceleration(model, links, r->body, body->com);
        const kt_vec3 force = kt_vec3_scale(rate.mass, kt_vec3_sub(acceleration, kt_v4_vec3(model->gravity)));
        const kt_vec3 spin = kt_vec3_cross(w, kt_sym3_apply(rate.inertia, w));
        const kt_vec3 turn = kt_mat3_apply(axes, kt_vec3_add(kt_sym3_apply(rate.inertia, alpha), spin));
        const kt_vec3 moment = kt_vec3_add(turn, kt_vec3_cross(kt_mat3_apply(axes, body->com), force));
        wrenches[r->body].force = kt_vec3_sub(wrenches[r->body].force, force);
        wrenches[r->body].moment = kt_vec3_sub(wrenches[r->body].moment, moment);
    }
    return status;
}

kt_status kt_masses_update(const kt_model *model, kt_data *data, double t, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data))
        return KT_ERROR_ARGUMENT;
    const kt_status status = check_masses(model, t, 0.0, error);
    if (status == KT_OK && model->n.varying)
        data->mass_time[0] = t;
    return status;
}

kt_status kt_masses_reject(const kt_model *model, const char *where, const char *what, kt_error *error) {
    if (model->n.varying)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, where,
                            "the mass of body '%.60s' is a function of time, and %s",
                            kt_body_name(model, model->varying[0].body), what);
    (void)model, (void)where, (void)what, (void)error;
    return KT_OK;
}
