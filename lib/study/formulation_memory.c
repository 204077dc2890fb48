/* Laying a coordinate set out in memory, and choosing its penalty. */
#include "base/aligned.h"
#include "base/arena.h"
#include "reduction/lapack.h"
#include "study/formulation.h"

#include <math.h>

const char *kt_constraint_formulation_name(kt_constraint_formulation_type type) {
    switch (type) {
#define KT_CONSTRAINT_FORMULATION_NAME(id, name)                                                                       \
    case id:                                                                                                           \
        return #name;
        KT_CONSTRAINT_FORMULATION_LIST(KT_CONSTRAINT_FORMULATION_NAME)
#undef KT_CONSTRAINT_FORMULATION_NAME
    case KT_CONSTRAINT_FORMULATION_COUNT:
        break;
    }
    return NULL;
}

kt_constraint_formulation_options kt_constraint_formulation_options_default(kt_constraint_formulation_type type,
                                                                            double step) {
    const kt_constraint_formulation_options options = {.type = type,
                                                       .alpha = 0.1 / step,
                                                       .beta = 0.1 / step,
                                                       .penalty = 1e4,
                                                       .iterations = 12,
                                                       .tolerance = 1e-11,
                                                       .rank_tolerance = 1e-12};
    return options;
}

/* ---- layout ------------------------------------------------------------------------------------------------------ */

static size_t lay_out(const kt_model *model, void *memory) {
    const size_t n = (size_t)kt_model_nv(model), q = (size_t)kt_model_nq(model);
    const size_t k = (size_t)kt_model_mobility(model).equations;
    kt_constraint_formulation scratch;
    size_t used = 0;
    kt_constraint_formulation *set = kt_arena_take(memory, &used, sizeof *set);
    if (set == NULL)
        set = &scratch;
#define KT_FORMULATION_PLACE(type, name, count, meaning)                                                               \
    set->name = kt_arena_take(memory, &used, (count) * sizeof(type));
    KT_FORMULATION_FIELDS(KT_FORMULATION_PLACE)
#undef KT_FORMULATION_PLACE
    set->n = (int)n;
    set->k = (int)k;
    return used;
}

size_t kt_constraint_formulation_size(const kt_model *model) { return lay_out(model, NULL); }

/* ---- placing ----------------------------------------------------------------------------------------------------- */

static kt_status check(const kt_constraint_formulation_options *o, kt_error *error) {
    if (kt_constraint_formulation_name(o->type) == NULL)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "type", "%d is no coordinate set", (int)o->type);
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

/* By way of an evaluation by Gauss' principle at the assembled initial state: R's last diagonal squared stands for the
 * smallest eigenvalue of A M^-1 A'. */
static kt_status choose_penalty(kt_constraint_formulation *set, kt_data *data, kt_error *error) {
    const kt_constraint_formulation_options wanted = set->options;
    kt_model_initial(set->model, set->state_q, set->state_v);
    kt_status status = kt_state_assemble(set->model, data, 0.0, set->state_q, set->state_v, error);
    if (status != KT_OK)
        return status;
    set->options.type = KT_CONSTRAINT_FORMULATION_GAUSS;
    status = kt_constraint_formulation_evaluate(set, data, 0.0, set->state_q, set->state_v, NULL, NULL, NULL,
                                                set->velocity, error);
    set->options = wanted;
    const double last = set->largest > 0.0 ? set->largest : 1.0;
    set->penalty = wanted.penalty / (last * last);
    kt_constraint_formulation_reset(set);
    return status;
}

kt_status kt_constraint_formulation_init(const kt_model *model, kt_data *data,
                                         const kt_constraint_formulation_options *options, void *memory, size_t size,
                                         kt_constraint_formulation **set, kt_error *error) {
    kt_status status = kt_lapack_open(error);
    if (status != KT_OK)
        return status;
    status = check(options, error);
    if (status != KT_OK)
        return status;
    const size_t needed = lay_out(model, NULL);
    if (!kt_arena_fits(memory, size, needed))
        return kt_arena_refuse("kt_constraint_formulation_init", "kt_constraint_formulation_size", memory, size, needed,
                               error);
    kt_constraint_formulation *placed = memory;
    (void)lay_out(model, memory);
    placed->owned = NULL;
    placed->model = model;
    placed->options = *options;
    placed->cap = kt_model_mobility(model).rank;
    kt_constraint_formulation_reset(placed);
    status = choose_penalty(placed, data, error);
    if (status == KT_OK)
        *set = placed;
    return status;
}

kt_status kt_constraint_formulation_create(const kt_model *model, const kt_constraint_formulation_options *options,
                                           kt_constraint_formulation **set, kt_error *error) {
    const size_t size = lay_out(model, NULL);
    kt_data *data = NULL;
    kt_constraint_formulation *placed = NULL;
    kt_status status = kt_data_create(model, &data, error);
    if (status != KT_OK)
        return status;
    void *memory = kt_aligned_allocate(size);
    if (memory == NULL)
        status = kt_error_set(error, KT_ERROR_MEMORY, NULL, "%zu bytes for a coordinate set are not to be had", size);
    else
        status = kt_constraint_formulation_init(model, data, options, memory, size, &placed, error);
    kt_data_free(data);
    if (placed == NULL) {
        kt_aligned_release(memory);
        return status;
    }
    placed->owned = memory;
    *set = placed;
    return KT_OK;
}

void kt_constraint_formulation_free(kt_constraint_formulation *set) {
    if (set != NULL)
        kt_aligned_release(set->owned);
}
