/* Differential-algebraic baselines against the reference of a study. The reference multipliers follow from the
 * reference's states [MSD 8.54] and the equations that the baseline has chosen. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/arena.h"
#include "base/require.h"
#include "compare/accuracy.h"

#include <math.h>
#include <string.h>

/* Arrays: type, name, count, meaning. */
#define KT_BASELINE_FIELDS(X)                                                                                          \
    X(double, q, nq, "the reference's positions, of the model that is integrated")                                     \
    X(double, v, nv, "velocities")                                                                                     \
    X(double, own_q, own_nq, "positions of the study's model")                                                         \
    X(double, own_v, own_nv, "velocities")                                                                             \
    X(double, multiplier, k, "the reference's")

typedef struct kt_baseline_work {
    void *owned;
    const kt_model *model; /* that is integrated */
    const kt_absolute *absolute;
    kt_data *data; /* of the study's model */
    kt_dae *dae;
    double largest; /* |multiplier| of the reference, over the records so far */
    KT_ARENA_DECLARE(KT_BASELINE_FIELDS)
} kt_baseline_work;

KT_ARENA_LAYOUT(lay_out, kt_baseline_work, KT_BASELINE_FIELDS, size_t nq, size_t nv, size_t own_nq, size_t own_nv,
                size_t k)

static size_t place_baseline(void *memory, const kt_accuracy *study, const kt_model *model) {
    return lay_out(memory, (size_t)kt_model_nq(model), (size_t)kt_model_nv(model), study->nq, study->nv,
                   (size_t)kt_model_mobility(model).equations);
}

/* The reference's state at a record, in the coordinates that are integrated. */
static kt_status spread_reference(const kt_accuracy *study, kt_baseline_work *w, int record, kt_error *error) {
    const kt_accuracy_state from = kt_accuracy_row(study, &study->reference, record);
    if (w->absolute == NULL) {
        memcpy(w->q, from.q, study->nq * sizeof *w->q);
        memcpy(w->v, from.v, study->nv * sizeof *w->v);
        return KT_OK;
    }
    const kt_status status = kt_kinematics_update(study->model, w->data, from.q, from.v, NULL, error);
    if (status == KT_OK)
        kt_absolute_from_tree(w->absolute, w->data, from.q, from.v, w->q, w->v);
    return status;
}

/* Adds the errors at a record. The baseline's multipliers are compared with those of the reference's state;
 * run_baseline() divides this error by the largest of these. */
static kt_status note_errors(kt_accuracy *study, kt_baseline_work *w, int record, kt_accuracy_baseline *b,
                             kt_error *error) {
    kt_accuracy_state at = {kt_dae_positions(w->dae), kt_dae_velocities(w->dae)};
    kt_residual open;
    kt_status status = kt_dae_residual(w->dae, &open, error);
    if (status == KT_OK)
        status = spread_reference(study, w, record, error);
    if (status == KT_OK)
        status = kt_dae_consistent(w->dae, kt_dae_time(w->dae), w->q, w->v, w->multiplier, error);
    if (status != KT_OK)
        return status;
    if (w->absolute != NULL) {
        kt_absolute_to_tree(w->absolute, at.q, at.v, NULL, study->results.interval, w->own_q, w->own_v, NULL);
        at = (kt_accuracy_state){w->own_q, w->own_v};
    }
    const kt_accuracy_state reference = kt_accuracy_row(study, &study->reference, record);
    kt_accuracy_add(&b->error, kt_accuracy_distance(study, reference, at), open);
    for (int r = 0; r < kt_model_mobility(w->model).equations; r++) {
        b->multiplier = kt_worse(b->multiplier, fabs(kt_dae_multipliers(w->dae)[r] - w->multiplier[r]));
        w->largest = kt_worse(w->largest, fabs(w->multiplier[r]));
    }
    return KT_OK;
}

/* An error of the run is a result of the baseline, and not an error of the call. */
static kt_status run_baseline(kt_accuracy *study, kt_baseline_work *w, double step, kt_accuracy_baseline *b) {
    const double interval = study->results.interval;
    const int steps = (int)fmax(1.0, ceil(interval / step * (1.0 - 1e-9)));
    memcpy(w->own_q, study->reference.q, study->nq * sizeof(double));
    memcpy(w->own_v, study->reference.v, study->nv * sizeof(double));
    b->step = interval / steps;
    kt_status status = spread_reference(study, w, 0, NULL);
    if (status == KT_OK)
        status = kt_dae_start(w->dae, 0.0, w->q, w->v, NULL);
    for (int record = 1; record <= study->results.records && status == KT_OK; record++) {
        for (int i = 0; i < steps && status == KT_OK; i++)
            status = kt_dae_step(w->dae, b->step, NULL);
        if (status == KT_OK && record == study->results.records)
            b->condition = kt_dae_condition(w->dae);
        if (status == KT_OK)
            status = note_errors(study, w, record, b, NULL);
    }
    b->counts = kt_dae_counts_of(w->dae);
    b->multiplier /= w->largest > 0.0 ? w->largest : 1.0;
    return status;
}

kt_status kt_accuracy_measure_baseline(kt_accuracy *study, const kt_dae_options *options, kt_formulation formulation,
                                       double step, kt_accuracy_baseline *baseline, kt_error *error) {
    if (KT_IS_MISSING(error, study, options, baseline, step > 0.0))
        return KT_ERROR_ARGUMENT;
    kt_absolute *absolute = NULL;
    kt_accuracy_baseline b = {.condition = (double)NAN};
    kt_status status = KT_OK;
    if (formulation == KT_FORMULATION_ABSOLUTE)
        status = kt_absolute_create(study->description, &study->own.model, study->model, &absolute, error);
    if (status != KT_OK)
        return status;
    const kt_model *model = absolute != NULL ? kt_absolute_model(absolute) : study->model;
    const size_t size = place_baseline(NULL, study, model);
    kt_baseline_work *w = kt_arena_allocate(size, "a baseline", error);
    if (w == NULL) {
        kt_absolute_free(absolute);
        return KT_ERROR_MEMORY;
    }
    memset(w, 0, size);
    (void)place_baseline(w, study, model);
    w->owned = w;
    w->model = model;
    w->absolute = absolute;
    status = kt_data_create(study->model, &w->data, error);
    if (status == KT_OK)
        status = kt_dae_create(model, options, &w->dae, error);
    if (status == KT_OK) {
        b.status = run_baseline(study, w, step, &b);
        *baseline = b;
    }
    kt_dae_free(w->dae);
    kt_data_free(w->data);
    kt_arena_free(w);
    kt_absolute_free(absolute);
    return status;
}
