/* One block of memory for the vectors and matrices of a test. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_NUMBERS_H
#define KT_TEST_ROBOT_NUMBERS_H

#include "check.h"

#include <stdlib.h>

typedef struct numbers {
    double **at; /* receives the place of `count` zeros */
    size_t count;
} numbers;

/* The block begins with the first ones, whose pointer frees it. Returns false after a failed check. */
static inline bool take_numbers(const numbers *all, size_t arrays) {
    size_t size = 1;
    for (size_t i = 0; i < arrays; i++)
        size += all[i].count;
    double *next = calloc(size, sizeof *next);
    for (size_t i = 0; i < arrays; i++) {
        *all[i].at = next;
        next = next != NULL ? next + all[i].count : NULL;
    }
    return next != NULL || kt_check_true("there is memory", false);
}

#define TAKE_NUMBERS(...)                                                                                              \
    take_numbers((const numbers[]){__VA_ARGS__}, sizeof((const numbers[]){__VA_ARGS__}) / sizeof(numbers))

#endif
