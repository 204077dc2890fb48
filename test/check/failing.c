/* Every test here must fail: selftest.py checks this. The condition in a test's name holds if the check in it fails. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include <math.h>
#include <stdlib.h>

KT_TEST(test_without_a_check) {}
KT_TEST(near_beyond_the_bound) { kt_check_near("x", 1.0, 1.0 + 1e-3, 0.9e-3); }
KT_TEST(near_nan_observed) { kt_check_near("x", (double)NAN, 1.0, 1.0); }
KT_TEST(near_nan_expected) { kt_check_near("x", 1.0, (double)NAN, 1.0); }
KT_TEST(near_nan_bound) { kt_check_near("x", 1.0, 1.0, (double)NAN); }
KT_TEST(near_infinite_both) { kt_check_near("x", HUGE_VAL, HUGE_VAL, 1.0); }
KT_TEST(near_infinite_bound) { kt_check_near("x", 1.0, 2.0, HUGE_VAL); }
KT_TEST(near_negative_bound) { kt_check_near("x", 1.0, 1.0, -1.0); }
KT_TEST(near_zero_bound) { kt_check_near("x", 1.0, 1.0 + 0x1p-52, 0.0); }
KT_TEST(below_beyond_the_bound) { kt_check_below("x", 1.1, 1.0); }
KT_TEST(below_nan) { kt_check_below("x", (double)NAN, 1.0); }
KT_TEST(below_negative) { kt_check_below("x", -0.5, 1.0); }
KT_TEST(below_infinite_bound) { kt_check_below("x", 0.5, HUGE_VAL); }
KT_TEST(above_short_of_the_bound) { kt_check_above("x", 0.9, 1.0); }
KT_TEST(above_zero_of_zero) { kt_check_above("x", 0.0, 0.0); }
KT_TEST(above_nan) { kt_check_above("x", (double)NAN, 1.0); }
KT_TEST(equal_int_differs) { kt_check_equal_int("x", 1LL << 40, (1LL << 40) + 1); }
KT_TEST(equal_bits_sign_of_zero) {
    const double a[] = {1.0, 0.0};
    const double b[] = {1.0, -0.0};
    kt_check_equal_bits("x", a, b, 2);
}
KT_TEST(equal_bits_of_nothing) {
    const double a = 1.0;
    kt_check_equal_bits("x", &a, &a, 0);
}
KT_TEST(true_is_false) { kt_check_true("x", false); }
KT_TEST(text_differs) { kt_check_text("x", "one", "two"); }
KT_TEST(text_is_missing) { kt_check_text("x", NULL, NULL); }
KT_TEST(contains_not) { kt_check_contains("x", "a message", "another"); }
KT_TEST(contains_nothing) { kt_check_contains("x", "a message", ""); }
KT_TEST(worst_of_none) {
    kt_worst worst = kt_worst_make("x");
    kt_check_worst(&worst);
}
KT_TEST(worst_one_beyond) {
    kt_worst worst = kt_worst_make("x");
    kt_worst_near(&worst, 1.0, 1.0, 1e-3, "first");
    kt_worst_near(&worst, 1.0, 1.1, 1e-3, "second");
    kt_worst_near(&worst, 1.0, 1.0, 1e-3, "third");
    kt_check_worst(&worst);
}
KT_TEST(worst_one_nan) {
    kt_worst worst = kt_worst_make("x");
    kt_worst_below(&worst, (double)NAN, 1e-3, "first");
    kt_worst_below(&worst, 0.5e-3, 1e-3, "second");
    kt_check_worst(&worst);
}
KT_TEST(worst_one_negative) {
    kt_worst worst = kt_worst_make("x");
    kt_worst_below(&worst, 0.5e-3, 1e-3, "first");
    kt_worst_below(&worst, -0.5e-3, 1e-3, "second");
    kt_check_worst(&worst);
}
KT_TEST(worst_of_none_in_a_block) {
    KT_WORST worst = kt_worst_make("x");
    (void)&worst;
}
KT_TEST(worst_one_beyond_in_a_block_that_is_left) {
    for (int i = 0; i < 2; i++) {
        KT_WORST worst = kt_worst_make("x");
        kt_worst_near(&worst, 1.0, 1.0 + i, 1e-3, "round %d", i);
        continue;
    }
}
KT_TEST(failure_beside_slack) {
    kt_check_below("failures: slack", 0.0, 3.0);
    kt_check_below("failures: tight", 0.0, 2.0);
    kt_check_below("some failures: tight", 1.0, 60.0);
    kt_check_below("error: slack", 1e-4, 1.0);
    kt_check_above("far above: slack", 1001.0, 1.0);
    kt_check_above("above: tight", 999.0, 1.0);
    kt_check_true("x", false);
}
KT_TEST(failure_before_a_check_that_holds) {
    setenv("KT_LEFT_BY_FAILING", "1", 1); /* crashing.c */
    kt_check_true("x", false);
    kt_check_true("y", true);
}

/* ---- ends -------------------------------------------------------------------------------------------------------- */

KT_TEST(end_is_before_the_first_check) {
    kt_end_test();
    kt_check_true("x", true);
}
KT_TEST(need_of_what_does_not_hold_ends_the_test) {
    kt_need(false);
    kt_check_true("x", true);
}

static char released[] = "released";

static void fail_when_released(void *object) { kt_check_true(object, false); }

KT_TEST(object_is_released) {
    kt_test_own(released, fail_when_released);
    kt_check_true("x", true);
}
KT_TEST(object_is_released_after_an_end) {
    kt_test_own(released, fail_when_released);
    kt_check_true("x", true);
    kt_end_test();
}
