/* What the checks tell the runner about the test that is running. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_RUNNER_H
#define KT_TEST_RUNNER_H

#include <stddef.h>

typedef struct kt_running_test {
    const char *name;
    size_t checks, failures, skips;
} kt_running_test;

extern kt_running_test kt_running;

#endif
