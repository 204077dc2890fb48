/* The family of methods whose steps the caller takes: time stepping over impacts (contact/moreau.c), in which the
 * state has no slope. The integrator keeps the grid, the two states of the last step, and the dense output between
 * them,
 *
 *     y(theta) = y0 + theta (y1 - y0)
 *
 * The slope at the end of a step is the mean slope over the step, (y1 - y0) / h.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"

static kt_status check_leap_sizes(const kt_method *method, kt_error *error) {
    (void)method, (void)error; /* there is one method, kt_method_moreau_jean */
    return KT_OK;
}

static void measure_leap(const kt_method *method, kt_integrator_sizes *sizes) {
    (void)method;
    sizes->slots = 2;
}

static void init_leap(kt_integrator *it) {
    it->fresh = 1;
    it->gives_end_derivative = true;
}

static kt_try_result take_leap(kt_integrator *it, const kt_interval *in, kt_try *r) {
    const int code = it->leap->step(in->t, in->h, in->end, in->y, it->trial, it->callbacks.user);
    for (size_t i = 0; i < it->sizes.n; i++)
        it->k[it->fresh][i] = (it->trial[i] - in->y[i]) / in->h;
    r->result = KT_TRY_PASSED;
    return kt_try_called(r, code, "the step", in->end);
}

static void accept_leap(kt_integrator *it) { it->leap->accept(it->callbacks.user); }

/* A straight line between both ends, since a leap has no stages. */
static kt_try_result join_ends(kt_integrator *it, double t, double *y_out, kt_try *r) {
    const double t0 = it->memory.previous_t, theta = (t - t0) / (it->memory.t - t0);
    for (size_t i = 0; i < it->sizes.n; i++)
        y_out[i] = it->previous_y[i] + theta * (it->y[i] - it->previous_y[i]);
    return r->result = KT_TRY_PASSED;
}

static const kt_method_family family = {
    .name = "time stepping",
    .check_sizes = check_leap_sizes,
    .measure = measure_leap,
    .init = init_leap,
    .try_step = take_leap,
    .error = kt_no_error,
    .error_at = kt_no_error_at,
    .accept = accept_leap,
    .interpolate = join_ends,
};

static const double whole[] = {1.0}, start[] = {0.0};

const kt_method kt_method_moreau_jean = {
    .name = "moreau-jean",
    .title = "Moreau 1988, Jean 1999: time stepping with impulses, theta = 1/2",
    .source = "V. Acary, B. Brogliato, Numerical Methods for Nonsmooth Dynamical Systems, 2008, chapter 10",
    .family = &family,
    .stages = 1,
    .order = 1,
    .b = whole,
    .c = start,
    .dense_order = 1,
};
