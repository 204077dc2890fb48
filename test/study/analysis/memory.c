/* Every allocation in the set-up of an analysis fails once. The call reports the failure, leaks nothing, and returns no
 * object. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "interpose.h"
#include "mechanics/constraint/linkage.h"

#include "kinetree/analysis.h"
#include "kinetree/study.h"

static linkage l;

/* Makes and releases something; returns the status of making, and whether it was handed out on failure. */
typedef kt_status attempt(bool *handed_out, kt_error *error);

static kt_status make_linearization(bool *handed_out, kt_error *error) {
    kt_linearization *made = NULL;
    const kt_status status = kt_linearization_create(l.model, NULL, &made, error);
    *handed_out = made != NULL;
    kt_linearization_free(made);
    return status;
}

static kt_status make_modes(bool *handed_out, kt_error *error) {
    kt_modes *made = NULL;
    const kt_status status = kt_modes_create(l.model, &made, error);
    *handed_out = made != NULL;
    kt_modes_free(made);
    return status;
}

static kt_status make_spectrum(bool *handed_out, kt_error *error) {
    kt_spectrum *made = NULL;
    const kt_status status = kt_spectrum_create(l.model, 3, &made, error);
    *handed_out = made != NULL;
    kt_spectrum_free(made);
    return status;
}

static kt_status make_set(bool *handed_out, kt_error *error) {
    const kt_constraint_formulation_options options =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_AUGMENTED, 1e-2);
    kt_constraint_formulation *made = NULL;
    const kt_status status = kt_constraint_formulation_create(l.model, &options, &made, error);
    *handed_out = made != NULL;
    kt_constraint_formulation_free(made);
    return status;
}

static kt_spectrum *spectrum;

static kt_status look_along(bool *handed_out, kt_error *error) {
    kt_run run = kt_run_default();
    run.duration = 0.01;
    const kt_status status = kt_spectrum_along(spectrum, &run, error);
    *handed_out = kt_spectrum_samples(spectrum) > 0;
    return status;
}

/* Without a failure the call succeeds. With a failure it returns KT_ERROR_MEMORY. There are as many frees as successful
 * allocations. */
static void check_each(const char *what, attempt *call, int least) {
    int tried = 0, wrong = 0, silent = 0, leaks = 0, kept = 0;
    kt_note("%s", what);
    for (int failed = 1; failed && tried < 1000; tried++) {
        kt_error error = {KT_OK, "", ""};
        bool handed_out = false;
        kt_interpose_start_failing(tried + 1);
        const kt_status status = call(&handed_out, &error);
        const long allocations = kt_interpose_stop();
        failed = kt_interpose_has_failed();
        wrong += status != (failed ? KT_ERROR_MEMORY : KT_OK);
        silent += failed && (error.code != status || error.message[0] == '\0');
        leaks += kt_interpose_frees() != allocations - failed;
        kept += failed ? handed_out : !handed_out;
    }
    kt_check_above("allocations that were made to fail", tried - 1, least);
    kt_check_equal_int("calls that did not say so", wrong, 0);
    kt_check_equal_int("calls without words", silent, 0);
    kt_check_equal_int("calls that leaked", leaks, 0);
    kt_check_equal_int("calls that handed out something, or nothing", kept, 0);
}

KT_TEST(each_failing_allocation_is_an_error_of_setting_up) {
    const four_bar f = four_bar_default();
    kt_error error = {0};
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    check_each("linearisation", make_linearization, 1);
    check_each("modes", make_modes, 1);
    check_each("spectrum", make_spectrum, 1);
    check_each("set", make_set, 2);
    kt_need_fine("spectrum", kt_spectrum_create(l.model, 3, &spectrum, &error), &error);
    check_each("spectrum along a motion", look_along, 1);
    kt_spectrum_free(spectrum);
}

/* ---- a study --------------------------------------------------------------------------------------------------------
 */

/* One run of rk4, or two curves whose settings are found. A failure may only cost the growth, which is then unknown. */
static kt_status study(bool finds, bool has_set, bool *is_whole, kt_error *error) {
    kt_run run = kt_run_default();
    kt_accuracy_options options = kt_accuracy_options_default();
    const kt_method *const methods[] = {kt_method_find("rk4"), kt_method_find("dopri5")};
    const double step = 0.01;
    kt_accuracy *made = NULL;
    run.duration = 0.1;
    options.records = 4;
    options.methods = methods;
    options.method_count = options.step_count = 1;
    options.steps = &step;
    kt_variant variant = kt_variant_default(&run);
    variant.has_constraint_formulation = true;
    if (has_set) {
        options.variants = &variant;
        options.variant_count = 1;
    }
    if (finds) {
        options.method_count = 2;
        options.steps = NULL;
        options.step_count = 0;
        options.run_evaluations = 500;
    }
    const kt_status status = kt_accuracy_create(&l.description, &run, &options, &made, error);
    *is_whole = made != NULL && kt_accuracy_results_of(made)->amplification > 0.0;
    kt_accuracy_free(made);
    return status;
}

/* The first 40 allocations, and every `stride`-th from there on. */
static void check_studies(bool finds, bool has_set, int stride, double least) {
    int tried = 0, wrong = 0, unknown = 0, leaks = 0;
    for (int n = 1, failed = 1; failed; n += n < 40 ? 1 : stride, tried++) {
        kt_error error = {KT_OK, "", ""};
        bool is_whole = false;
        kt_interpose_start_failing(n);
        const kt_status status = study(finds, has_set, &is_whole, &error);
        const long allocations = kt_interpose_stop();
        failed = kt_interpose_has_failed();
        if (failed && status == KT_OK && !is_whole)
            unknown++;
        else
            wrong += status != (failed ? KT_ERROR_MEMORY : KT_OK) || is_whole == failed;
        leaks += kt_interpose_frees() != allocations - failed;
    }
    kt_check_above("allocations that were made to fail", tried - 1, least);
    kt_check_equal_int("calls that did not say so", wrong, 0);
    kt_check_equal_int("studies without growth", unknown, 1);
    kt_check_equal_int("calls that leaked", leaks, 0);
}

KT_TEST(each_failing_allocation_is_an_error_of_a_study_or_leaves_growth_unknown) {
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    check_studies(false, false, 1, 10.0);
    check_studies(false, true, 1, 12.0);
    check_studies(true, false, 3, 40.0);
}
