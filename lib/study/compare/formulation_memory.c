/* The memory of a constraint formulation, its options, and the choice of its penalty. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/options.h"
#include "compare/formulation.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "evaluate/load_friction.h"
#include "linear/lapack.h"
#include "model/describe.h"

#include <math.h>

const char *kt_constraint_formulation_name(kt_constraint_formulation_type type) {
    static const char *const names[] = {KT_CONSTRAINT_FORMULATION_LIST(KT_LISTED_NAME)};
    return (unsigned)type < KT_CONSTRAINT_FORMULATION_COUNT ? names[type] : NULL;
}

/* ---- layout ------------------------------------------------------------------------------------------------------ */

KT_ARENA_LAYOUT(lay_out, kt_constraint_formulation, KT_FORMULATION_FIELDS, size_t n, size_t q, size_t k)

static size_t place_formulation(void *memory, const kt_model *model) {
    return lay_out(memory, (size_t)kt_model_nv(model), (size_t)kt_model_nq(model),
                   (size_t)kt_model_mobility(model).equations);
}

size_t kt_constraint_formulation_size(const kt_model *model) { return model ? place_formulation(NULL, model) : 0; }

/* ---- placing ----------------------------------------------------------------------------------------------------- */

static kt_status check_formulation_options(const kt_constraint_formulation_options *o, kt_error *error) {
    if (kt_constraint_formulation_name(o->type) == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "type", "%d is no constraint formulation", (int)o->type);
    const double numbers[] = {o->alpha, o->beta, o->tolerance, o->rank_tolerance};
    static const char *const names[] = {"alpha", "beta", "tolerance", "rank_tolerance"};
    for (int i = 0; i < 4; i++)
        if (!(isfinite(numbers[i]) && numbers[i] >= 0.0))
            return kt_error_set(error, KT_ERROR_ARGUMENT, names[i], "%g: must be zero or more", numbers[i]);
    if (!(isfinite(o->penalty) && o->penalty > 0.0))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "penalty", "%g: must be above zero", o->penalty);
    if (o->iterations < 1)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "iterations", "%d: must be one or more", o->iterations);
    return KT_OK;
}

/* Chooses the penalty by an evaluation of Gauss' principle at the assembled initial state. The square of R's last
 * independent diagonal entry is an estimate of the smallest eigenvalue of A M^-1 A'. */
static kt_status choose_penalty(kt_constraint_formulation *formulation, kt_data *data, kt_error *error) {
    const kt_constraint_formulation_options wanted = formulation->options;
    kt_model_initial(formulation->model, formulation->state_q, formulation->state_v);
    kt_status status =
        kt_state_assemble(formulation->model, data, 0.0, formulation->state_q, formulation->state_v, error);
    if (status != KT_OK)
        return status;
    const bool followed = data->followed; /* the initial state may touch: only the sizes of the equations count */
    data->followed = true;
    formulation->options.type = KT_CONSTRAINT_FORMULATION_GAUSS;
    status = kt_constraint_formulation_evaluate(formulation, data, 0.0, formulation->state_q, formulation->state_v,
                                                NULL, NULL, NULL, formulation->velocity, error);
    formulation->options = wanted;
    data->followed = followed;
    const double last = formulation->largest > 0.0 ? formulation->largest : 1.0;
    formulation->penalty = wanted.penalty / (last * last);
    kt_constraint_formulation_reset(formulation);
    return status;
}

kt_status kt_constraint_formulation_init(const kt_model *model, kt_data *data,
                                         const kt_constraint_formulation_options *options, void *memory, size_t size,
                                         kt_constraint_formulation **formulation, kt_error *error) {
    if (KT_IS_MISSING(error, model, data, options, formulation))
        return KT_ERROR_ARGUMENT;
    kt_constraint_formulation_options own = kt_constraint_formulation_options_default(options->type, 1.0);
    const kt_constraint_formulation_options *o =
        KT_OPTIONS(kt_constraint_formulation_options, uncapped, &own, options, error);
    if (o == NULL)
        return KT_ERROR_ARGUMENT;
    kt_status status = kt_auxiliary_states_reject(model, "kt_constraint_formulation_init",
                                                  "only the engine's own equations of motion support them", error);
    if (status == KT_OK)
        status = kt_masses_reject(model, "kt_constraint_formulation_init",
                                  "only the engine's own equations of motion support this", error);
    if (status == KT_OK)
        status = kt_massless_reject(model, "kt_constraint_formulation_init",
                                    "only the engine's own equations of motion support this", error);
    if (status == KT_OK)
        status = kt_load_reject(model, "kt_constraint_formulation_init",
                                "only the engine's own equations of motion support this", error);
    if (status == KT_OK)
        status = kt_lapack_open(error);
    if (status == KT_OK)
        status = check_formulation_options(o, error);
    if (status != KT_OK)
        return status;
    status = kt_arena_begin("kt_constraint_formulation_init", "kt_constraint_formulation_size", memory, size,
                            place_formulation(NULL, model), error);
    if (status != KT_OK)
        return status;
    kt_constraint_formulation *made = memory;
    (void)place_formulation(memory, model);
    made->model = model;
    made->options = *o;
    made->n = kt_model_nv(model);
    made->k = kt_model_mobility(model).equations;
    made->cap = kt_model_mobility(model).rank;
    kt_constraint_formulation_reset(made);
    status = choose_penalty(made, data, error);
    if (status == KT_OK)
        *formulation = made;
    return status;
}

kt_status kt_constraint_formulation_create(const kt_model *model, const kt_constraint_formulation_options *options,
                                           kt_constraint_formulation **formulation, kt_error *error) {
    if (KT_IS_MISSING(error, model, options, formulation))
        return KT_ERROR_ARGUMENT;
    const size_t size = place_formulation(NULL, model);
    kt_data *data = NULL;
    kt_status status = kt_data_create(model, &data, error);
    if (status != KT_OK)
        return status;
    void *memory = kt_arena_allocate(size, "a constraint formulation", error);
    status = memory == NULL ? KT_ERROR_MEMORY
                            : kt_arena_own(memory, kt_constraint_formulation_init(model, data, options, memory, size,
                                                                                  formulation, error));
    kt_data_free(data);
    return status;
}

void kt_constraint_formulation_free(kt_constraint_formulation *formulation) { kt_arena_free(formulation); }
