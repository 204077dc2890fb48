/* A step as a function of its start: the stages of the table, their sum, and the projection. The bits are those of a
 * simulation (integrator/explicit.c, step/state_equations.c). A fixed step does not need the last stage of an
 * fsal method. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/project.h"
#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "joint/joint.h"
#include "sensitivity/sensitivity.h"

#include <math.h>

/* ---- memory ------------------------------------------------------------------------------------------------------ */

size_t kt_step_stages_of(const kt_method *method) {
    return (size_t)(method->stages - (method->fsal && !kt_method_is_coupled(method) ? 1 : 0));
}

size_t kt_step_kept(const kt_model *model, const kt_method *method) {
    if (kt_method_is_linear(method) || kt_has_auxiliary_states(model)) /* the step is taken again */
        return 0;
    return model->n.v + (kt_method_is_coupled(method) ? model->n.q : 0);
}

/* Whether a step of the method is a function of a state. */
static bool step_is_function(const kt_method *method) {
    return method && (kt_method_family_of(method) == &kt_family_explicit || kt_method_is_coupled(method) ||
                      kt_method_is_linear(method));
}

/* Unknowns of each implicit stage: its rates, or with quaternions its whole slope. Explicit stages have none. */
static size_t unknowns_of(const kt_model *model, const kt_method *method) {
    if (!kt_method_is_coupled(method) && !kt_method_is_linear(method))
        return 0;
    return kt_is_plain(model) ? kt_rate_numbers(model) : kt_state_numbers(model);
}

static size_t held_most(const kt_model *model) { return model->n.v > KT_PARAMETER_MAX ? model->n.v : KT_PARAMETER_MAX; }

KT_ARENA_ARRAYS(place_arrays, kt_step_work, KT_STEP_FIELDS, const kt_model *model, size_t N, size_t n, size_t e,
                size_t s, size_t m, size_t c, size_t p, size_t g, size_t u, size_t r)

static size_t place_step_work(kt_step_work *w, void *memory, const kt_model *model, const kt_method *method) {
    const bool linear = kt_method_is_linear(method);
    const size_t n = model->n.v, m = model->n.x, unknowns = unknowns_of(model, method);
    const size_t most = kt_method_is_coupled(method) ? kt_coupled_most(method) : 1, g = linear ? 2 : most;
    const size_t columns = (n > KT_PARAMETER_MAX / 3 ? 3 * n : KT_PARAMETER_MAX) + m;
    const size_t used = place_arrays(w, memory, model, kt_state_numbers(model), n, n + m, kt_step_stages_of(method), m,
                                     columns, held_most(model), g, most * unknowns, linear);
    return used + kt_projection_place(w ? &w->projection : NULL, memory ? (char *)memory + used : NULL, model);
}

size_t kt_step_work_size(const kt_model *model, const kt_method *method) {
    if (!model || !method)
        return 0;
    return step_is_function(method) && kt_method_check_sizes(method, NULL) == KT_OK
               ? place_step_work(NULL, NULL, model, method)
               : 0;
}

static kt_status check_step_states(const kt_model *model, const double *x, kt_error *error) {
    return kt_all_finite(x, model->n.x) ? KT_OK
                                        : kt_error_set(error, KT_ERROR_NOT_FINITE, "auxiliary states",
                                                       "a number of x at the start is not finite");
}

kt_status kt_step_begin(kt_step_work *w, const kt_model *model, kt_data *data, void *memory, size_t size,
                        const kt_step *step, kt_error *error) {
    if (step->method == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "step.method",
                            "there is no method; kt_method_find returns NULL for an unknown name, and kt_method_at "
                            "lists the methods");
    if (!step_is_function(step->method))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "step",
                            "a step of '%s' depends on earlier steps, so it has no derivatives with respect to one "
                            "state; use rk4, dopri5, implicit-euler, crank-nicolson, radau5 or rodas5p",
                            step->method->name);
    if (!isfinite(step->h) || !isfinite(step->t))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "step", "t = %g s or h = %g s is not finite", step->t, step->h);
    if (!(fabs(kt_step_end(step) - (step->t + step->h)) <= 1e-6 * fabs(step->h)))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "step.end", "%.17g s is not t + h = %.17g s, up to rounding",
                            step->end, step->t + step->h);
    kt_status status = kt_masses_reject(
        model, "step", "derivatives of a step would leave that out; integrate neighbouring motions instead", error);
    if (status == KT_OK)
        status = kt_massless_reject(
            model, "step", "derivatives of a step would leave that out; integrate neighbouring motions instead", error);
    if (status == KT_OK)
        status = kt_slip_reject(model, "step", error);
    if (status == KT_OK && kt_has_auxiliary_states(model) && step->x)
        status = check_step_states(model, step->x, error);
    if (status == KT_OK)
        status = kt_method_check_sizes(step->method, error);
    if (status == KT_OK)
        status =
            kt_arena_check("work", "kt_step_work_size", memory, size, kt_step_work_size(model, step->method), error);
    if (status != KT_OK)
        return status;
    *w = (kt_step_work){.model = model,
                        .data = data,
                        .step = step,
                        .stages = kt_step_stages_of(step->method),
                        .states = kt_tangent_numbers(model),
                        .coupled = kt_method_is_coupled(step->method),
                        .linear = kt_method_is_linear(step->method),
                        .unknowns = unknowns_of(model, step->method),
                        .held_most = held_most(model)};
    (void)place_step_work(w, memory, model, step->method);
    if (kt_has_auxiliary_states(model))
        kt_copy(w->before, data->x, model->n.x * sizeof *w->before);
    w->projection.data = data;
    w->projection.t = kt_step_end(step);
    return KT_OK;
}

/* ---- stages ------------------------------------------------------------------------------------------------------ */

const double *kt_step_stage(kt_step_work *w, size_t i, double **a) {
    const size_t nq = w->model->n.q, N = kt_state_numbers(w->model);
    double *y = w->stage + i * N, *k = w->slope + i * N;
    kt_combine_rows(y, w->y, w->step->h, kt_step_row(w->step->method, i), i, w->slope, N);
    kt_position_rate(w->model, y, y + nq, k);
    *a = k + nq;
    return y;
}

void kt_step_finish(kt_step_work *w) {
    kt_combine_rows(w->next, w->y, w->step->h, w->step->method->b, w->stages, w->slope, kt_state_numbers(w->model));
}

/* Evaluates all stages of an explicit step, and the state at its end. */
static kt_status explicit_stages(kt_step_work *w, const double *q, const double *v, kt_error *error) {
    kt_step_start(w, q, v);
    for (size_t i = 0; i < w->stages; i++) {
        double *a;
        const double *y = kt_step_stage(w, i, &a);
        const kt_status status = kt_step_rates(w, kt_step_time(w->step, i), y, a, error);
        if (status != KT_OK)
            return status;
    }
    kt_step_finish(w);
    return KT_OK;
}

kt_status kt_step_stages(kt_step_work *w, const double *q, const double *v, kt_error *error) {
    const kt_status status = w->coupled  ? kt_coupled_stages(w, q, v, error)
                             : w->linear ? kt_rosenbrock_stages(w, q, v, error)
                                         : explicit_stages(w, q, v, error);
    kt_auxiliary_states_restore(w);
    return status;
}

/* ---- after the step ---------------------------------------------------------------------------------------------- */

kt_status kt_step_close(const kt_model *model, kt_data *data, const kt_step *step, double *q, double *v,
                        kt_error *error) {
    return kt_state_close(model, data, kt_step_end(step), !step->unprojected, q, v, error);
}

/* ---- the public function ----------------------------------------------------------------------------------------- */

kt_status kt_step_evaluate(const kt_model *model, kt_data *data, void *work, size_t work_size, const kt_step *step,
                           const double *q, const double *v, double *next_q, double *next_v, kt_error *error) {
    if (KT_IS_OTHER_DATA(error, model, data) ||
        KT_IS_MISSING(error, step, q || !model->n.q, next_q || !model->n.q, next_v || !model->n.v))
        return KT_ERROR_ARGUMENT;
    v = v ? v : model->zero;
    const size_t nq = model->n.q;
    kt_step_work w;
    kt_status status = kt_step_begin(&w, model, data, work, work_size, step, error);
    if (status == KT_OK)
        status = kt_step_stages(&w, q, v, error);
    if (status == KT_OK)
        status = kt_step_close(model, data, step, w.next, w.next + nq, error);
    if (status == KT_OK)
        status = kt_step_reject_contacts(&w, w.next, error);
    if (status != KT_OK)
        return status;
    kt_copy(next_q, w.next, nq * sizeof *next_q);
    kt_copy(next_v, w.next + nq, model->n.v * sizeof *next_v);
    kt_auxiliary_states_put(model, data, w.next);
    return KT_OK;
}
