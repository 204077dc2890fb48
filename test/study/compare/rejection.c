/* Accuracy studies that are impossible, or possible in part only: the messages, and the results that are kept. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "bench.h"

#include <math.h>

static void reject(bench *b, kt_status expected, const char *where, const char *message) {
    kt_check_equal_int("status", create(b), expected);
    kt_check_text("where", b->error.where, where);
    kt_check_text("message", b->error.message, message);
    kt_check_true("no study", b->study == NULL);
    kt_accuracy_free(b->study); /* NULL, which is allowed */
}

/* ---- options ------------------------------------------------------------------------------------------------------
 */

static const char whole_numbers[] = "records, budget and run_evaluations must be above 0, amplification above 1";
static const char empty[] = "an empty list of methods or variants leaves nothing to run";

KT_TEST(options_out_of_range_are_rejected) {
    bench b;
    make(&b);
    b.run.duration = HUGE_VAL;
    reject(&b, KT_ERROR_ARGUMENT, "duration", "must be above zero for an error to be measured");
    make(&b);
    b.options.records = 0;
    reject(&b, KT_ERROR_ARGUMENT, "accuracy", whole_numbers);
    make(&b);
    b.options.budget = (double)NAN;
    reject(&b, KT_ERROR_ARGUMENT, "accuracy", whole_numbers);
    make(&b);
    b.options.amplification = 1.0;
    reject(&b, KT_ERROR_ARGUMENT, "accuracy", whole_numbers);
    make(&b);
    b.options.run_evaluations = 0;
    reject(&b, KT_ERROR_ARGUMENT, "accuracy", whole_numbers);
    make(&b);
    b.step = HUGE_VAL;
    reject(&b, KT_ERROR_ARGUMENT, "steps", "must be 1 to 40 numbers above zero");
    make(&b);
    b.options.step_count = 0;
    reject(&b, KT_ERROR_ARGUMENT, "steps", "must be 1 to 40 numbers above zero");
    make(&b);
    b.tolerance = -1.0;
    reject(&b, KT_ERROR_ARGUMENT, "tolerances", "must be 1 to 40 numbers above zero");
    make(&b);
    double many[41];
    for (int i = 0; i < 41; i++)
        many[i] = 1e-3;
    b.options.tolerances = many;
    b.options.tolerance_count = 41;
    reject(&b, KT_ERROR_ARGUMENT, "tolerances", "must be 1 to 40 numbers above zero");
    make(&b);
    b.options.method_count = 0;
    reject(&b, KT_ERROR_ARGUMENT, "accuracy", empty);
    make(&b);
    const kt_variant own = kt_variant_default(&b.run);
    b.options.variants = &own;
    reject(&b, KT_ERROR_ARGUMENT, "accuracy", empty);
}

KT_TEST(references_that_are_none_are_rejected) {
    static const char words[] = "it needs two records or more, an interval above zero apart";
    const double q[3] = {1.0, 1.0, 1.0}, v[3] = {0.0, 0.0, 0.0};
    kt_reference reference = {0.5, 3, q, v};
    bench b;
    make(&b);
    b.options.reference = &reference;
    reference.count = 1; /* no interval, and so no duration */
    reject(&b, KT_ERROR_ARGUMENT, "duration", "must be above zero for an error to be measured");
    reference = (kt_reference){-0.5, -1, q, v}; /* two wrongs */
    reject(&b, KT_ERROR_ARGUMENT, "reference", words);
    reference = (kt_reference){0.5, 3, q, v};
    kt_check_equal_int("one that stands still", create(&b), KT_ERROR_ARGUMENT);
    kt_check_contains("message", b.error.message, "it parts from what dop853 computes at once");
}

KT_TEST(measurements_of_nothing_are_rejected) {
    static const char words[] = "a method, adaptive only with an error estimate, and a setting above zero";
    bench b;
    kt_accuracy_point point = {.setting = 77.0};
    make(&b);
    must_create(&b);
    const kt_variant own = kt_variant_default(&b.run);
    kt_check_equal_int("no method", kt_accuracy_measure(b.study, &own, NULL, false, 0.01, &point, &b.error),
                       KT_ERROR_ARGUMENT);
    kt_check_text("message", b.error.message, "'method' is NULL; it must be given");
    kt_check_equal_int("no step", kt_accuracy_measure(b.study, &own, b.methods[0], false, 0.0, &point, &b.error),
                       KT_ERROR_ARGUMENT);
    kt_check_text("message", b.error.message, words);
    kt_check_equal_int("no estimate", kt_accuracy_measure(b.study, &own, b.methods[0], true, 0.01, &point, &b.error),
                       KT_ERROR_ARGUMENT);
    b.body.mass = -1.0; /* the description is the caller's all the time */
    kt_check_equal_int("a scene that has become wrong",
                       kt_accuracy_measure(b.study, &own, b.methods[0], false, 0.01, &point, &b.error), KT_ERROR_MODEL);
    kt_check_near("the point is untouched", point.setting, 77.0, 0.0);
    kt_check_equal_int("the model is the scene's", kt_model_nv(kt_accuracy_model(b.study)), 1);
}

/* ---- too little time ----------------------------------------------------------------------------------------------
 */

typedef struct ticking {
    double time, step;
} ticking;

static double tick(void *user) {
    ticking *t = user;
    return t->time += t->step;
}

/* The limit is counted in evaluations, as there is no clock. Or it is measured by a clock, and the message reports how
 * much time is needed. */
KT_TEST(reference_out_of_time_says_how_far_it_came) {
    bench b;
    ticking slow = {0.0, 1.0};
    make(&b);
    b.options.run_evaluations = 2;
    kt_check_equal_int("evaluations", create(&b), KT_ERROR_STEP);
    kt_note("%s: %s", b.error.where, b.error.message);
    kt_check_text("where", b.error.where, "reference");
    kt_check_contains("message", b.error.message, "of 1 s it came to ");
    kt_check_contains("message", b.error.message,
                      " s of the processor's time: a larger budget or a shorter duration is needed");
    make(&b);
    b.run.duration = 1e4;
    b.options.clock = tick;
    b.options.user = &slow;
    b.options.budget = 30.0;
    kt_check_equal_int("clock", create(&b), KT_ERROR_STEP);
    kt_note("%s: %s", b.error.where, b.error.message);
    kt_check_contains("message", b.error.message, "of 10000 s it came to ");
    kt_check_contains("message", b.error.message, ", all of it some ");
}

KT_TEST(given_reference_out_of_time_says_so_too) {
    const double q[3] = {1.0, 0.9, 0.8}, v[3] = {0.0, -1.0, -1.0};
    const kt_reference reference = {0.5, 3, q, v};
    bench b;
    make(&b);
    b.options.run_evaluations = 2;
    b.options.reference = &reference;
    kt_check_equal_int("evaluations", create(&b), KT_ERROR_STEP);
    kt_check_contains("message", b.error.message, "of 1 s it came to ");
}

static int stop(double done, const char *what, void *user) {
    (void)user;
    kt_check_near("nothing is done yet", done, 0.0, 0.0);
    kt_check_text("what comes first", what, "the reference");
    return 1;
}

KT_TEST(study_is_stopped_before_its_reference) {
    bench b;
    make(&b);
    b.options.progress = stop;
    reject(&b, KT_ERROR_CALLBACK, "accuracy", "the study was stopped before the reference");
}

/* Only settings for which there is a reference are studied. */
KT_TEST(study_ends_where_its_reference_does) {
    bench b;
    make(&b);
    b.run.duration = 1000.0;
    b.options.run_evaluations = 2000;
    b.options.records = 200;
    must_create(&b);
    const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
    kt_check_equal_int("cut", r->cut, KT_ACCURACY_LATE);
    kt_check_near("asked", r->asked, 1000.0, 0.0);
    kt_check_above("studied", r->duration, 10.0);
    kt_check_below("studied", r->duration, 500.0);
    kt_check_below("uncertainty", r->uncertainty.position, 1e-10);
}

/* Runs longer than run_evaluations report this, and none of their results is used. */
KT_TEST(runs_that_are_too_long_are_points_without_an_error) {
    bench b;
    make(&b);
    b.options.run_evaluations = 1000;
    b.step = 1e-6;
    must_create(&b);
    const kt_accuracy_results *r = kt_accuracy_results_of(b.study);
    kt_need(kt_check_equal_int("points", r->point_count, 1));
    kt_check_true("unusable", !r->points[0].usable && r->points[0].status != KT_OK);
    kt_check_true("without an error", isinf(r->points[0].error.position));
    kt_check_equal_int("none is best", kt_accuracy_best(b.study, 1.0), -1);

    make(&b); /* and where settings are found no coarser one is left */
    b.options.steps = b.options.tolerances = NULL;
    b.options.step_count = b.options.tolerance_count = 0;
    b.options.method_count = 2;
    b.options.run_evaluations = 300;
    must_create(&b);
    r = kt_accuracy_results_of(b.study);
    for (int i = 0; i < r->curve_count; i++)
        kt_check_equal_int(r->curves[i].method->name, r->curves[i].end, KT_ACCURACY_LENGTH);
}

/* ---- settings ---------------------------------------------------------------------------------------------------- */

KT_TEST(settings_of_a_run_are_those_of_its_variant) {
    kt_run run = kt_run_default();
    run.metric = KT_METRIC_MASS;
    run.plan = KT_PLAN_SPATIAL;
    const kt_variant variant = kt_variant_default(&run);
    kt_check_equal_int("metric", variant.model.metric, KT_METRIC_MASS);
    kt_check_equal_int("plan", variant.model.plan, KT_PLAN_SPATIAL);
    kt_check_equal_int("formulation", variant.formulation, KT_FORMULATION_TREE);
    kt_check_true("reduction", variant.model.reduction == NULL);
}

KT_TEST(what_is_not_another_choice_is_the_default) {
    kt_check_true("qr", kt_reduction_method_of(KT_REDUCTION_QR) == NULL);
    kt_check_true("none", kt_reduction_method_of(KT_REDUCTION_COUNT) == NULL);
    kt_check_true("two others",
                  kt_reduction_method_of(KT_REDUCTION_PARTITION) != NULL &&
                      kt_reduction_method_of(KT_REDUCTION_SVD) != NULL &&
                      kt_reduction_method_of(KT_REDUCTION_SVD) != kt_reduction_method_of(KT_REDUCTION_PARTITION));
    kt_check_true("no model", kt_absolute_model(NULL) == NULL);
}
