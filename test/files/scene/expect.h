/* Compares the numbers of a scene, after reading, with explicit numbers, bit for bit. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_SCENE_EXPECT_H
#define KT_TEST_SCENE_EXPECT_H

#include "check.h"

#define PI 3.14159265358979323846

#define CHECK_NUMBERS(what, observed, ...)                                                                             \
    do {                                                                                                               \
        const double expected_[] = {__VA_ARGS__};                                                                      \
        kt_check_equal_bits(what, observed, expected_, sizeof expected_ / sizeof *expected_);                          \
    } while (0)

/* The check for a kt_vec3. */
#define CHECK_VECTOR(what, v, x_, y_, z_)                                                                              \
    do {                                                                                                               \
        const double seen_[] = {(v).x, (v).y, (v).z};                                                                  \
        CHECK_NUMBERS(what, seen_, x_, y_, z_);                                                                        \
    } while (0)

#endif
