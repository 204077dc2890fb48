/* SPDX-License-Identifier: Apache-2.0 */
#include "linkage.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void linkage_begin(linkage *l) {
    memset(l, 0, sizeof *l);
    l->description = kt_description_default();
    l->description.gravity = kt_vec3_make(0.0, -9.81, 0.0);
    l->description.bodies = l->body;
    l->description.loops = l->loop;
    l->options = kt_model_options_default();
}

kt_body *linkage_bar(linkage *l, const char *name, const char *parent, kt_vec3 at, kt_vec3 to, double angle,
                     double rate) {
    const int i = l->description.body_count++;
    kt_body *body = &l->body[i];
    snprintf(l->body_name[i], sizeof l->body_name[i], "%s", name);
    *body = kt_body_of(l->body_name[i], parent, KT_JOINT_REVOLUTE, 0.0);
    body->joint.at = at;
    body->joint.position[0] = angle;
    body->joint.velocity[0] = rate;
    body->joint.given = KT_GIVEN_POSITION | KT_GIVEN_VELOCITY; /* zeros, too */
    body->mass = kt_vec3_norm(to);
    body->com = kt_vec3_scale(0.5, to);
    const double m = body->mass / 12.0;
    body->inertia = kt_sym3_make(m * (to.y * to.y + to.z * to.z), m * (to.x * to.x + to.z * to.z),
                                 m * (to.x * to.x + to.y * to.y), -m * to.x * to.y, -m * to.x * to.z, -m * to.y * to.z);
    return body;
}

static kt_end end_at(const char *body, kt_vec3 at) {
    kt_end end = kt_end_default();
    end.body = body;
    end.at = at;
    return end;
}

kt_loop *linkage_close(linkage *l, const char *name, kt_loop_type type, const char *first, kt_vec3 at,
                       const char *second, kt_vec3 there) {
    const int i = l->description.loop_count++;
    kt_loop *loop = &l->loop[i];
    snprintf(l->loop_name[i], sizeof l->loop_name[i], "%s", name);
    *loop = kt_loop_of(l->loop_name[i], type);
    loop->between[0] = end_at(first, at);
    loop->between[1] = end_at(second, there);
    return loop;
}

void linkage_compile(linkage *l) {
    l->model = kt_test_model(&l->description, &l->options);
    l->data = kt_test_data(l->model);
    l->nq = kt_model_nq(l->model);
    l->nv = kt_model_nv(l->model);
    l->rows = kt_model_mobility(l->model).equations;
    kt_model_initial(l->model, l->q, l->v);
}

void linkage_build(linkage *l, double t) {
    kt_error error = {0};
    linkage_compile(l);
    kt_need_fine("assembles", kt_state_assemble(l->model, l->data, t, l->q, l->v, &error), &error);
}

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

four_bar four_bar_default(void) {
    return (four_bar){.crank = 1.0,
                      .coupler = 2.0,
                      .rocker = 1.8,
                      .ground = 2.2,
                      .angle = {1.0, -0.6, 1.6},
                      .rate = 2.0,
                      .size = 1.0,
                      .type = KT_LOOP_REVOLUTE};
}

void linkage_four_bar(linkage *l, const four_bar *f) {
    const double s = f->size;
    const kt_vec3 none = kt_vec3_make(0.0, 0.0, 0.0), tip = kt_vec3_make(f->coupler * s, 0.0, 0.0);
    linkage_begin(l);
    linkage_bar(l, "crank", NULL, none, kt_vec3_make(f->crank * s, 0.0, 0.0), f->angle[0], f->rate);
    linkage_bar(l, "coupler", "crank", kt_vec3_make(f->crank * s, 0.0, 0.0), tip, f->angle[1], 0.0);
    linkage_bar(l, "rocker", NULL, kt_vec3_make(f->ground * s, 0.0, 0.0), kt_vec3_make(f->rocker * s, 0.0, 0.0),
                f->angle[2], 0.0);
    linkage_close(l, "close", f->type, "coupler", tip, "rocker", kt_vec3_make(f->rocker * s, 0.0, 0.0));
}

void linkage_windows(linkage *l, int n, double theta, double rate, kt_loop_type type) {
    const kt_vec3 up = kt_vec3_make(0.0, 1.0, 0.0), along = kt_vec3_make(1.0, 0.0, 0.0);
    char name[16];
    linkage_begin(l);
    for (int i = 0; i <= n; i++) {
        snprintf(name, sizeof name, "crank%d", i);
        linkage_bar(l, name, NULL, kt_vec3_make(i, 0.0, 0.0), up, -theta, -rate);
    }
    for (int i = 0; i < n; i++) {
        snprintf(name, sizeof name, "bar%d", i);
        linkage_bar(l, name, l->body[i].name, up, along, theta, rate);
        snprintf(name, sizeof name, "loop%d", i);
        linkage_close(l, name, type, l->body[n + 1 + i].name, along, l->body[i + 1].name, up);
    }
}

double windows_acceleration(int n, double theta) { return 1.5 * 9.81 * (3 * n + 1) / (4 * n + 1) * sin(theta); }

void linkage_bricard(linkage *l) {
    static const double point[6][3] = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
    static const double axis[6][3] = {{0, 1, 0}, {0, 0, 1}, {1, 0, 0}, {0, 1, 0}, {0, 0, 1}, {1, 0, 0}};
    kt_vec3 at = kt_vec3_make(0.0, 0.0, 0.0), side = at;
    linkage_begin(l);
    for (int i = 0; i < 5; i++) {
        char name[16];
        side =
            kt_vec3_make(point[i + 1][0] - point[i][0], point[i + 1][1] - point[i][1], point[i + 1][2] - point[i][2]);
        snprintf(name, sizeof name, "bar%d", i);
        kt_body *body = linkage_bar(l, name, i ? l->body[i - 1].name : NULL, at, side, 0.0, 0.0);
        body->joint.axis = kt_vec3_make(axis[i][0], axis[i][1], axis[i][2]);
        const double thin = 0.001666666666666667, wide = 0.08416666666666667;
        body->inertia = kt_sym3_make(fabs(side.x) > 0.5 ? thin : wide, fabs(side.y) > 0.5 ? thin : wide,
                                     fabs(side.z) > 0.5 ? thin : wide, 0.0, 0.0, 0.0);
        at = side;
    }
    kt_loop *loop =
        linkage_close(l, "close", KT_LOOP_REVOLUTE, NULL, kt_vec3_make(0.0, 0.0, 1.0), l->body[4].name, side);
    loop->axis = kt_vec3_make(1.0, 0.0, 0.0);
}

/* ---- motion ------------------------------------------------------------------------------------------------------ */

static int slope(double t, const double *y, double *rate, void *user) {
    linkage_run *r = user;
    const double *v = y + r->l->nq;
    kt_error error = {0};
    r->evaluations++;
    if (kt_acceleration_evaluate(r->l->model, r->l->data, t, y, v, NULL, NULL, rate + r->l->nq, &error) != KT_OK)
        return 1;
    kt_position_rate(r->l->model, y, v, rate);
    return 0;
}

static int project(double t, double *y, bool *changed, void *user) {
    linkage_run *r = user;
    kt_error error = {0};
    return kt_state_project(r->l->model, r->l->data, t, y, y + r->l->nq, changed, &error) == KT_OK ? 0 : 1;
}

void linkage_run_begin(linkage_run *r, const char *method, double step, double tolerance, double t,
                       const kt_integrator_callbacks *callbacks) {
    linkage *l = r->l;
    kt_integrator_options options = kt_integrator_options_default();
    const kt_method *m = kt_method_find(method);
    const size_t n = (size_t)l->nq + (size_t)l->nv, size = kt_integrator_size(m, n);
    double y[2 * LINKAGE_NQ];
    kt_error error = {0};
    r->memory = malloc(size);
    options.step = step;
    options.relative_tolerance = options.absolute_tolerance = tolerance;
    memcpy(y, l->q, (size_t)l->nq * sizeof *y);
    memcpy(y + l->nq, l->v, (size_t)l->nv * sizeof *y);
    kt_test_own(r->memory, free);
    kt_need_fine("places", kt_integrator_init(r->memory, size, m, n, &options, &r->integrator, &error), &error);
    kt_need_fine("starts", kt_integrator_start(r->integrator, t, y, callbacks, &error), &error);
}

void linkage_run_start(linkage_run *r, linkage *l, const char *method, double step, double tolerance, bool loose,
                       double t) {
    const kt_integrator_callbacks callbacks = {slope, loose ? NULL : project, r};
    *r = (linkage_run){.l = l};
    linkage_run_begin(r, method, step, tolerance, t, &callbacks);
}

void linkage_run_to(linkage_run *r, double t) {
    kt_error error = {0};
    while (kt_integrator_time(r->integrator) < t)
        kt_need_fine("steps", kt_integrator_step(r->integrator, t, &error), &error);
    memcpy(r->l->q, kt_integrator_state(r->integrator), (size_t)r->l->nq * sizeof(double));
    memcpy(r->l->v, kt_integrator_state(r->integrator) + r->l->nq, (size_t)r->l->nv * sizeof(double));
}

/* ---- calls ------------------------------------------------------------------------------------------------------- */

void linkage_accelerate(const linkage *l, double t, double *a) {
    kt_error error = {0};
    kt_need_fine("accelerates", kt_acceleration_evaluate(l->model, l->data, t, l->q, l->v, NULL, NULL, a, &error),
                 &error);
}

kt_residual linkage_residual(const linkage *l, double t) {
    kt_residual residual = {(double)NAN, (double)NAN};
    kt_error error = {0};
    (void)kt_fine("has residuals", kt_loop_residual(l->model, l->data, t, l->q, l->v, &residual, &error), &error);
    return residual;
}

/* The state moved by up to `far`. */
static double states_differ(const kt_model *const model[2], kt_data *const data[2], double t, const double *q,
                            const double *v, double far, bool assemble) {
    double to[2][2 * LINKAGE_NQ], by[LINKAGE_NQ], most = 0.0;
    const int nq = kt_model_nq(model[0]), nv = kt_model_nv(model[0]);
    for (int i = 0; i < nv; i++)
        by[i] = 0.5 * far * (7 * i % 5 - 2);
    for (int k = 0; k < 2; k++) {
        kt_error e = {0};
        kt_position_add(model[k], q, by, to[k]);
        for (int i = 0; i < nv; i++)
            to[k][nq + i] = v[i] + by[i];
        kt_need_fine(assemble ? "assembles" : "projects",
                     assemble ? kt_state_assemble(model[k], data[k], t, to[k], to[k] + nq, &e)
                              : kt_state_project(model[k], data[k], t, to[k], to[k] + nq, NULL, &e),
                     &e);
    }
    for (int i = 0; i < nq + nv; i++)
        most = fmax(most, fabs(to[0][i] - to[1][i]));
    return most;
}

double linkage_projections_differ(const kt_model *const model[2], kt_data *const data[2], double t, const double *q,
                                  const double *v) {
    return states_differ(model, data, t, q, v, 1e-4, false);
}

double linkage_assemblies_differ(const kt_model *const model[2], kt_data *const data[2], double t, const double *q,
                                 const double *v, double far) {
    return states_differ(model, data, t, q, v, far, true);
}
