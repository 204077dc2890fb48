/* FMUs in a simulation (couple.h).
 *
 * Communication point k is the time t_k = k h, with the step h. Three things happen at t_k:
 *
 *     the FMU advances from t_(k-1) to t_k with the inputs of t_(k-1),
 *     its inputs become the formulas in the state at t_k,
 *     its outputs are read and held until t_(k+1).
 *
 * Outputs that depend on inputs directly thus act without a delay. All others are those of t_k, and depend on inputs
 * until t_(k-1).
 *
 * The event of an FMU has the value t - t_k before the next point t_k, and a small positive one from there on. Its root
 * is therefore t_k to the last bit, and the secants of the search lead there.
 */
#include "scene/couple.h"

#include <float.h>
#include <math.h>

static kt_status fail_couple_memory(kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, "kt_scene_watch_create", "there is not enough memory");
}

kt_status kt_coupled_bind(const kt_binding *in, const kt_scene *scene, const kt_scene_fmu *fmu,
                          kt_assignments *assignments, kt_coupled_fmu *to, bool *moves, kt_error *error) {
    const size_t inputs = (size_t)fmu->input_count, outputs = (size_t)fmu->output_count;
    *to = (kt_coupled_fmu){.step = fmu->step,
                           .formulas = kt_pool_take(in->pool, inputs + 1, sizeof *to->formulas),
                           .inputs = kt_pool_take(in->pool, inputs + 1, sizeof *to->inputs),
                           .outputs = kt_pool_take(in->pool, outputs + 1, sizeof *to->outputs),
                           .states = kt_pool_take(in->pool, outputs + 1, sizeof *to->states),
                           .input_count = fmu->input_count,
                           .output_count = fmu->output_count,
                           .assignments = assignments};
    if (to->formulas == NULL || to->inputs == NULL || to->outputs == NULL || to->states == NULL)
        return fail_couple_memory(error);
    kt_status status = KT_OK;
    for (int i = 0; status == KT_OK && i < fmu->input_count; i++) {
        status = kt_formula_bind(in, scene, fmu->inputs[i].text, false, &to->formulas[i], error);
        *moves = *moves || to->formulas[i].moves;
    }
    for (int i = 0; status == KT_OK && i < fmu->output_count; i++) {
        to->states[i] = kt_own_state_find(in->model, fmu->outputs[i].text);
        if (to->states[i] < 0)
            status = kt_error_set(error, KT_ERROR_MODEL, "kt_scene_watch_create", "the model has no state '%s'",
                                  fmu->outputs[i].text);
    }
    return status;
}

int kt_coupled_clock(const kt_coupled_fmu *coupled, const kt_instant *at, double *value, kt_error *error) {
    const double next = (double)(coupled->point + 1) * coupled->step;
    if (!coupled->is_coupled) {
        (void)kt_error_set(error, KT_ERROR_UNSUPPORTED, NULL,
                           "the scene couples an FMU, and this program does not run it; 'kinetree run' does, and a "
                           "program couples it by kt_scene_watch_couple");
        return 1;
    }
    *value = at->t < next ? at->t - next : DBL_MIN;
    return 0;
}

double kt_scene_next_sample(double step, double t) {
    if (!(step > 0.0) || !isfinite(step) || !isfinite(t))
        return (double)NAN;
    if (!(fabs(t) < 0x1p52 * step))
        return HUGE_VAL;
    double k = floor(t / step) + 1.0;
    while (k * step <= t)
        k += 1.0;
    while ((k - 1.0) * step > t)
        k -= 1.0;
    return k * step;
}

int kt_coupled_sample(kt_coupled_fmu *coupled, uint64_t number, const kt_instant *at, kt_simulation *simulation,
                      kt_error *error) {
    double *x = coupled->output_count > 0 ? kt_assignments_states(coupled->assignments, simulation) : NULL;
    for (int i = 0; i < coupled->input_count; i++)
        if (kt_bound_evaluate(&coupled->formulas[i], at, &coupled->inputs[i], error) != 0)
            return -1;
    for (int i = 0; i < coupled->output_count; i++)
        coupled->outputs[i] = x[coupled->states[i]];
    const kt_scene_sample sample = {.number = number,
                                    .time = (double)number * coupled->step,
                                    .step = coupled->step,
                                    .inputs = coupled->inputs,
                                    .outputs = coupled->outputs};
    const int code = coupled->with.sample(&sample, error, coupled->with.user);
    coupled->point = number;
    for (int i = 0; i < coupled->output_count; i++)
        x[coupled->states[i]] = coupled->outputs[i];
    if (code >= 0 && x != NULL && kt_assignments_apply(coupled->assignments, simulation, error) != KT_OK)
        return -1;
    return code;
}

void kt_coupled_sync(kt_coupled_fmu *coupled, uint64_t count, double t) {
    const double next = t > 0.0 ? kt_scene_next_sample(coupled->step, t) : coupled->step;
    const uint64_t before = next < HUGE_VAL ? (uint64_t)(next / coupled->step + 0.5) - 1 : 0;
    coupled->point = count > 0 ? count : before;
}

void kt_coupled_take(kt_coupled_fmu *coupled, const kt_scene_coupling *with) {
    if (coupled->is_coupled && coupled->with.release != NULL)
        coupled->with.release(coupled->with.user);
    coupled->is_coupled = with != NULL;
    coupled->with = with != NULL ? *with : (kt_scene_coupling){.user = NULL};
}
