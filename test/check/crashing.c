/* Tests that end their process, between tests that pass. selftest.py reads the report. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include <stdlib.h>

KT_TEST(file_does_not_see_what_another_left) {
    kt_check_true("failing.c leaves a variable of the environment", getenv("KT_LEFT_BY_FAILING") == NULL);
}
KT_TEST(crash_ends_its_process) {
    kt_check_true("x", true);
    abort();
}
KT_TEST(test_behind_a_crash_is_run) { kt_check_true("x", true); }
KT_TEST(exit_ends_its_process) {
    kt_check_true("x", true);
    exit(0);
}
KT_TEST(test_behind_an_exit_is_run) { kt_check_true("x", true); }

static void end_badly(void) { _Exit(3); }

KT_TEST(process_ends_badly_after_its_last_test) { kt_check_true("x", atexit(end_badly) == 0); }
