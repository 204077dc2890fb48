/* Coordinate sets with unsupported requests, or with nothing to do. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closure.h"

#include <float.h>
#include <math.h>

static const kt_vec3 none = {0.0, 0.0, 0.0}, down = {0.0, -1.0, 0.0};

static void check_words(const char *what, kt_status status, const kt_error *error, kt_status expected,
                        const char *words) {
    kt_check_equal_int(what, status, expected);
    kt_check_contains("message", error->message, words);
}

/* Without loops every set is the tree, and so it is with one that holds nothing; without freedoms there is nothing to
 * it.
 */
KT_TEST(sets_of_what_has_no_loops_accelerate_as_the_tree) {
    for (int kind = 0; kind < 3; kind++) {
        const bool fixed = kind == 1;
        static linkage l;
        linkage_begin(&l);
        kt_body *bar = linkage_bar(&l, "bar", NULL, none, down, 0.4, 1.0);
        if (fixed)
            bar->joint.type = KT_JOINT_FIXED;
        if (kind == 2)
            linkage_close(&l, "idle", KT_LOOP_COAXIAL, "bar", none, NULL, none);
        linkage_compile(&l);
        if (kind == 2)
            kt_check_equal_int("rank", kt_model_mobility(l.model).rank, 0);
        for (int type = 0; type < (int)KT_CONSTRAINT_FORMULATION_COUNT; type++) {
            const kt_constraint_formulation_options options =
                kt_constraint_formulation_options_default((kt_constraint_formulation_type)type, 0.01);
            kt_constraint_formulation *set = closure_set(l.model, &options);
            kt_error e = {KT_OK, "", ""};
            double a = 77.0, expected = 77.0, rate = 77.0;
            (void)kt_fine(
                "set", kt_constraint_formulation_evaluate(set, l.data, 0.0, l.q, l.v, NULL, NULL, &rate, &a, &e), &e);
            if (!fixed) {
                linkage_accelerate(&l, 0.0, &expected);
                kt_check_near("rate", rate, 1.0, 0.0);
            }
            kt_check_near("acceleration", a, expected, 16.0 * DBL_EPSILON * fabs(expected));
            (void)kt_fine("verdict", kt_constraint_formulation_verdict(set, &e), &e);
        }
    }
    kt_check_true("no name", kt_constraint_formulation_name(KT_CONSTRAINT_FORMULATION_COUNT) == NULL &&
                                 kt_constraint_formulation_name((kt_constraint_formulation_type)-1) == NULL);
}

KT_TEST(sets_reject_what_overflows_and_what_is_out_of_range) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    for (int type = 0; type < (int)KT_CONSTRAINT_FORMULATION_COUNT; type++) {
        kt_constraint_formulation_options options =
            kt_constraint_formulation_options_default((kt_constraint_formulation_type)type, 0.01);
        kt_constraint_formulation *set = closure_set(l.model, &options);
        kt_error e = {KT_OK, "", ""};
        double v[3] = {1e200, 0.0, 0.0}, a[3] = {77.0, 77.0, 77.0};
        kt_check_equal_int("overflow",
                           kt_constraint_formulation_evaluate(set, l.data, 0.0, l.q, v, NULL, NULL, NULL, a, &e),
                           KT_ERROR_NOT_FINITE);
        kt_note("%s: %s", e.where, e.message);
        v[0] = (double)NAN;
        kt_check_equal_int("NaN", kt_constraint_formulation_evaluate(set, l.data, 0.0, l.q, v, NULL, NULL, NULL, a, &e),
                           KT_ERROR_NOT_FINITE);
        const double tau[3] = {DBL_MAX, 0.0, 0.0};
        kt_check_equal_int("torque",
                           kt_constraint_formulation_evaluate(set, l.data, 0.0, l.q, l.v, tau, NULL, NULL, a, &e),
                           KT_ERROR_NOT_FINITE);
        kt_note("%s: %s", e.where, e.message);
        kt_check_near("nothing is written", a[0], 77.0, 0.0);
        set = NULL;
        options.penalty = HUGE_VAL;
        check_words("penalty", kt_constraint_formulation_create(l.model, &options, &set, &e), &e, KT_ERROR_ARGUMENT,
                    "must be above zero");
        options.penalty = 0.0;
        check_words("penalty", kt_constraint_formulation_create(l.model, &options, &set, &e), &e, KT_ERROR_ARGUMENT,
                    "must be above zero");
        kt_check_true("no set", set == NULL);
    }
}

/* The start is assembled, for the penalty to be chosen. */
KT_TEST(set_of_what_cannot_be_assembled_is_rejected) {
    static linkage l;
    four_bar f = four_bar_default();
    const kt_constraint_formulation_options options =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_AUGMENTED, 0.01);
    kt_constraint_formulation *set = NULL;
    kt_error e = {KT_OK, "", ""};
    f.ground = 10.0;
    linkage_four_bar(&l, &f);
    linkage_compile(&l);
    check_words("out of reach", kt_constraint_formulation_create(l.model, &options, &set, &e), &e, KT_ERROR_CONSTRAINT,
                "'close' by ");
    kt_check_true("no set", set == NULL);
}
