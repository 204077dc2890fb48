/* An accuracy study from its options to its results: memory, models of the variants, and the order of the work. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/options.h"
#include "base/require.h"
#include "kinetree/study.h"

#include "base/aligned.h"
#include "base/arena.h"
#include "compare/accuracy.h"
#include "integrator/integrator.h"

#include <math.h>
#include <string.h>

kt_variant kt_variant_default(const kt_run *run) {
    const kt_run standard = kt_run_default();
    kt_variant variant = {0};
    variant.model = kt_model_options_default();
    variant.model.metric = (run ? run : &standard)->metric;
    variant.model.plan = (run ? run : &standard)->plan;
    variant.simulation = kt_simulation_options_default();
    return variant;
}

/* ---- checks of the request --------------------------------------------------------------------------------------- */

static kt_status reject_study(kt_error *error, const char *where, const char *message) {
    return kt_error_set(error, KT_ERROR_ARGUMENT, where, "%s", message);
}

static bool are_positive(const double *numbers, int count) {
    for (int i = 0; i < count; i++)
        if (!(isfinite(numbers[i]) && numbers[i] > 0.0))
            return false;
    return numbers == NULL || (count > 0 && count <= KT_ACCURACY_LADDER_MAX);
}

static bool has_length(const void *array, int count) { return count >= 0 && (count == 0 || array != NULL); }

static kt_status check_variant(const kt_variant *variant, kt_error *error) {
    if (kt_formulation_name(variant->formulation) == NULL)
        return reject_study(error, "variant.formulation", "there is no such formulation");
    if (kt_constraint_formulation_name(variant->constraint_formulation) == NULL)
        return reject_study(error, "variant.constraint_formulation", "there is no such constraint formulation");
    if (!(isfinite(variant->gain) && variant->gain >= 0.0))
        return reject_study(error, "variant.gain", "must be above zero, or zero for 1");
    return KT_OK;
}

/* Lengths without their arrays, and numbers that are none. */
static kt_status check_lists(const kt_accuracy_options *options, kt_error *error) {
    if (!has_length(options->methods, options->method_count))
        return reject_study(error, "methods", "method_count is not their number");
    if (!has_length(options->steps, options->step_count))
        return reject_study(error, "steps", "step_count is not their number");
    if (!has_length(options->tolerances, options->tolerance_count))
        return reject_study(error, "tolerances", "tolerance_count is not their number");
    if (!has_length(options->goals, options->goal_count) || !are_positive(options->goals, options->goal_count))
        return reject_study(error, "goals", "must be numbers above zero, and goal_count their number");
    if (!has_length(options->variants, options->variant_count))
        return reject_study(error, "variants", "variant_count is not their number");
    if (!(isfinite(options->duration) && options->duration >= 0.0))
        return reject_study(error, "duration", "must be above zero, or zero for that of the run");
    if ((unsigned)options->subject > KT_ACCURACY_QUANTITY)
        return reject_study(error, "subject", "there is no such subject");
    if ((options->subject == KT_ACCURACY_QUANTITY) != (options->quantity != NULL) ||
        (options->quantity != NULL && (options->quantity->evaluate == NULL || options->reference != NULL)))
        return reject_study(error, "quantity",
                            "belongs to KT_ACCURACY_QUANTITY, with a function, and with a computed reference");
    const kt_accuracy_events *events = options->events;
    if (events != NULL && (events->count < 0 || events->add == NULL || events->release == NULL))
        return reject_study(error, "events", "count, add and release are needed");
    kt_status status = options->own ? check_variant(options->own, error) : KT_OK;
    for (int i = 0; i < options->variant_count && status == KT_OK; i++)
        status = check_variant(&options->variants[i], error);
    return status;
}

/* The number of curves of a variant. */
static int count_study_methods(const kt_accuracy_options *options) {
    return (options->methods != NULL ? options->method_count : kt_method_count()) + (options->contact_steps ? 1 : 0);
}

/* With contact_steps, Moreau and Jean's method follows the other methods. */
static const kt_method *study_method_at(const kt_accuracy_options *options, int index) {
    if (options->contact_steps && index == count_study_methods(options) - 1)
        return &kt_method_moreau_jean;
    return options->methods != NULL ? options->methods[index] : kt_method_at(index);
}

static kt_status check_accuracy_options(const kt_accuracy_options *options, double duration, kt_error *error) {
    const kt_status status = check_lists(options, error);
    if (status != KT_OK)
        return status;
    if (!(isfinite(duration) && duration > 0.0))
        return reject_study(error, "duration", "must be above zero for an error to be measured");
    if (options->records < 1 || !(options->budget > 0.0 && isfinite(options->budget)) ||
        !(options->amplification > 1.0 && isfinite(options->amplification)) || options->run_evaluations == 0)
        return reject_study(error, "accuracy",
                            "records, budget and run_evaluations must be above 0, amplification above 1");
    if (!are_positive(options->steps, options->step_count))
        return reject_study(error, "steps", "must be 1 to 40 numbers above zero");
    if (!are_positive(options->tolerances, options->tolerance_count))
        return reject_study(error, "tolerances", "must be 1 to 40 numbers above zero");
    if ((options->methods != NULL && count_study_methods(options) < 1) ||
        (options->variants != NULL && options->variant_count < 1))
        return reject_study(error, "accuracy", "an empty list of methods or variants leaves nothing to run");
    if (options->reference != NULL && options->reference->count < 2) /* its interval is checked with the duration */
        return reject_study(error, "reference", "it needs two records or more, an interval above zero apart");
    return KT_OK;
}

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* All arrays of a study: type, name, count, meaning. */
#define KT_ACCURACY_FIELDS(X)                                                                                          \
    X(kt_model *, models, variants, "compiled as a variant asks")                                                      \
    X(kt_absolute *, absolutes, variants, "of the absolute variants that need one")                                    \
    X(double, reference.q, rows * object->nq, "records")                                                               \
    X(double, reference.v, rows * object->nv, "records")                                                               \
    X(double, reference.energy, rows, "records")                                                                       \
    X(double, second.q, rows * object->nq, "records of the solution that it is held against")                          \
    X(double, second.v, rows * object->nv, "records of that")                                                          \
    X(double, second.energy, rows, "records of that")                                                                  \
    X(double, reference.quantity, rows, "of the caller")                                                               \
    X(double, second.quantity, rows, "of the caller")                                                                  \
    X(double, difference, object->nv, "of two states")                                                                 \
    X(double, begin, object->nq + object->nv, "state at the start")                                                    \
    X(double, moved, object->nq, "neighbouring positions")                                                             \
    X(kt_accuracy_instant, log.instants, KT_ACCURACY_INSTANTS_MAX, "of the reference")                                 \
    X(kt_accuracy_instant, second_log.instants, KT_ACCURACY_INSTANTS_MAX, "of the second solution")                    \
    X(kt_accuracy_instant, run_log.instants, KT_ACCURACY_INSTANTS_MAX, "of a run")                                     \
    X(bool, is_masked, rows, "records next to instants")                                                               \
    X(kt_accuracy_curve, curves, curves, "results")                                                                    \
    X(kt_accuracy_point, points, KT_ACCURACY_POINTS_MAX *curves, "results")

KT_ARENA_ARRAYS(place_arrays, kt_accuracy, KT_ACCURACY_FIELDS, size_t rows, size_t variants, size_t curves)

/* Allocates the study, followed by its arrays. */
static kt_accuracy *make_study_room(const kt_accuracy *start) {
    kt_accuracy probe = *start;
    const size_t rows = (size_t)start->results.records + 1, variants = (size_t)start->results.variant_count;
    const size_t curves = (size_t)start->results.curve_count, head = kt_arena_round(sizeof(kt_accuracy));
    const size_t bytes = head + place_arrays(&probe, NULL, rows, variants, curves);
    char *memory = kt_arena_allocate(bytes, "the study", NULL);
    if (memory == NULL)
        return NULL;
    memset(memory, 0, bytes);
    kt_accuracy *study = (kt_accuracy *)(void *)memory;
    *study = *start;
    (void)place_arrays(study, memory + head, rows, variants, curves);
    study->results.curves = study->curves;
    study->results.points = study->points;
    study->log.study = study->second_log.study = study->run_log.study = study;
    study->results.instants = study->log.instants;
    if (study->results.variants == NULL) /* the scene's own settings are stored here */
        study->results.variants = &study->own;
    return study;
}

void kt_accuracy_free(kt_accuracy *study) {
    if (study == NULL)
        return;
    for (int i = 0; i < study->results.variant_count; i++) {
        kt_absolute_free(study->absolutes[i]);
        kt_model_free(study->models[i]);
    }
    kt_absolute_free(study->absolute);
    kt_model_free(study->model);
    kt_aligned_release(study);
}

/* ---- the study --------------------------------------------------------------------------------------------------- */

/* Runs one curve. to_come: the number of remaining curves, including this curve. */
static kt_status run_curve(kt_accuracy *study, int index, int methods, int to_come, kt_error *error) {
    kt_accuracy_results *results = &study->results;
    kt_accuracy_curve *curve = &study->curves[index];
    const double now = kt_accuracy_now(study), left = study->deadline - now;
    curve->variant = index / methods;
    curve->method = study_method_at(&study->options, index % methods);
    curve->adaptive = curve->method->embedded_order > 0;
    curve->first = KT_ACCURACY_POINTS_MAX * index;
    const char *label = results->variants[curve->variant].label;
    kt_status status = kt_accuracy_report(study, 1.0 - 0.85 * to_come / results->curve_count,
                                          label != NULL && curve->variant > 0 ? label : curve->method->name, error);
    if (status == KT_OK && study->models[curve->variant] == NULL)
        status = kt_accuracy_compile(study, &results->variants[curve->variant], &study->models[curve->variant],
                                     &study->absolutes[curve->variant], error);
    if (status != KT_OK)
        return status;
    /* The time left is shared equally by the remaining curves; one curve may use twice its share. */
    status = kt_accuracy_climb(study, curve, now + fmin(left, 2.0 * left / to_come), error);
    const bool lacks_events = study->absolutes[curve->variant] != NULL && study->options.events != NULL;
    if (status != KT_ERROR_UNSUPPORTED || !(lacks_events || kt_accuracy_has_contacts(study->model)))
        return status;
    curve->count = 0; /* hard contacts exclude some methods, and absolute coordinates events */
    curve->end = KT_ACCURACY_UNSUPPORTED;
    return KT_OK;
}

/* Moves the points of all curves together, without gaps. */
static void close_gaps(kt_accuracy *study) {
    int used = 0;
    for (int i = 0; i < study->results.curve_count; i++) {
        kt_accuracy_curve *curve = &study->curves[i];
        memmove(study->points + used, study->points + curve->first, (size_t)curve->count * sizeof *study->points);
        curve->first = used;
        used += curve->count;
    }
    study->results.point_count = used;
}

/* Methods of high order run first, so that the best results do not wait for slow methods. */
static kt_status run_study(kt_accuracy *study, kt_error *error) {
    const int count = study->results.curve_count, variants = study->results.variant_count, methods = count / variants;
    kt_status status = kt_accuracy_find_reference(study, error);
    study->deadline = study->started + study->options.budget;
    for (int i = 0; i < count && status == KT_OK; i++)
        status = run_curve(study, i % variants * methods + (methods - 1 - i / variants), methods, count - i, error);
    study->results.instant_count = study->log.count;
    if (status == KT_OK) {
        close_gaps(study);
        kt_accuracy_mark_front(study);
    }
    return status;
}

/* The part that precedes allocation: sizes and the model. */
static kt_status begin_study(kt_accuracy *study, const kt_description *description, const kt_run *run,
                             kt_error *error) {
    const kt_accuracy_options *options = &study->options;
    kt_accuracy_results *results = &study->results;
    study->description = description;
    study->run = *run;
    study->started = kt_accuracy_now(study);
    results->asked = options->duration > 0.0 ? options->duration : run->duration;
    results->records = options->records;
    results->subject = options->subject;
    results->absolute_scale = 1.0;
    if (options->reference != NULL) {
        results->records = options->reference->count - 1;
        results->asked = options->reference->interval * results->records;
    }
    results->duration = results->asked;
    results->interval = results->duration / results->records;
    kt_status status = check_accuracy_options(options, results->asked, error);
    if (status != KT_OK)
        return status;
    study->own = options->own != NULL ? *options->own : kt_variant_default(run);
    results->variants = options->variants;
    results->variant_count = options->variants != NULL ? options->variant_count : 1;
    results->curve_count = count_study_methods(options) * results->variant_count;
    status = kt_accuracy_compile(study, &study->own, &study->model, &study->absolute, error);
    if (status != KT_OK)
        return status;
    study->nq = (size_t)kt_model_nq(study->model);
    study->nv = (size_t)kt_model_nv(study->model);
    if (study->nv == 0)
        return reject_study(error, "accuracy", "nothing moves in this scene: it has no error");
    return KT_OK;
}

kt_status kt_accuracy_create(const kt_description *description, const kt_run *run, const kt_accuracy_options *options,
                             kt_accuracy **study, kt_error *error) {
    if (KT_IS_MISSING(error, description, run, study))
        return KT_ERROR_ARGUMENT;
    kt_accuracy_options own = kt_accuracy_options_default();
    const kt_accuracy_options *o = KT_OPTIONS(kt_accuracy_options, user, &own, options, error);
    if (o == NULL)
        return KT_ERROR_ARGUMENT;
    kt_accuracy start = {.options = *o};
    kt_accuracy *made = NULL;
    kt_status status = begin_study(&start, description, run, error);
    if (status == KT_OK) {
        made = make_study_room(&start);
        if (made == NULL)
            status = kt_error_set(error, KT_ERROR_MEMORY, "accuracy", "there is not enough memory for the study");
    }
    if (status != KT_OK) {
        kt_absolute_free(start.absolute);
        kt_model_free(start.model);
        return status;
    }
    status = run_study(made, error);
    if (status == KT_OK)
        *study = made;
    else
        kt_accuracy_free(made);
    return status;
}

const kt_accuracy_results *kt_accuracy_results_of(const kt_accuracy *study) { return study ? &study->results : NULL; }

const kt_model *kt_accuracy_model(const kt_accuracy *study) { return study ? study->model : NULL; }

kt_status kt_accuracy_measure(kt_accuracy *study, const kt_variant *variant, const kt_method *method, bool adaptive,
                              double setting, kt_accuracy_point *point, kt_error *error) {
    if (KT_IS_MISSING(error, study, variant, method, point))
        return KT_ERROR_ARGUMENT;
    kt_model *model = NULL;
    kt_absolute *absolute = NULL;
    if (!(setting > 0.0) || (adaptive && method->embedded_order == 0))
        return reject_study(error, "accuracy",
                            "a method, adaptive only with an error estimate, and a setting above zero");
    kt_status status = kt_accuracy_compile(study, variant, &model, &absolute, error);
    if (status == KT_OK) {
        point->setting = setting;
        status = kt_accuracy_try(study, model, absolute, variant, method, adaptive, point, error);
    }
    kt_absolute_free(absolute);
    kt_model_free(model);
    return status;
}
