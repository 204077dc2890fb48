/* Options of programs that were compiled with earlier headers: a struct that has grown twice. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/options.h"

#include "check.h"

#include <string.h>

/* Version 0.2 has `first`, a later one `second`, this library `third`. */
typedef struct kt_grown_options {
    size_t size;
    double first;
    double second;
    int third, fourth;
} kt_grown_options;

static const kt_grown_options defaults = {sizeof defaults, 1.0, 2.0, 3, 4};

static const kt_grown_options *read_of(kt_grown_options *own, const kt_grown_options *given, kt_error *error) {
    *own = defaults;
    return KT_OPTIONS(kt_grown_options, first, own, given, error);
}

KT_TEST(members_beyond_the_size_of_the_caller_are_the_defaults) {
    const size_t sizes[] = {0, KT_SIZE_TO(kt_grown_options, first), KT_SIZE_TO(kt_grown_options, second),
                            sizeof(kt_grown_options)};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        kt_error error = {KT_OK, "", ""};
        kt_grown_options own, given = {sizes[i], 10.0, 20.0, 30, 40};
        const kt_grown_options *o = read_of(&own, &given, &error);
        kt_note("size %zu", sizes[i]);
        if (!kt_check_true("read", o != NULL))
            continue;
        kt_check_near("first", o->first, 10.0, 0.0);
        kt_check_near("second", o->second, i < 2 ? 2.0 : 20.0, 0.0);
        kt_check_equal_int("third", o->third, i < 3 ? 3 : 30);
        kt_check_equal_int("fourth", o->fourth, i < 3 ? 4 : 40);
        kt_check_equal_int("size", (long long)o->size, (long long)sizeof own);
    }
}

KT_TEST(options_that_are_not_given_are_the_defaults) {
    kt_grown_options own;
    const kt_grown_options *o = read_of(&own, NULL, NULL);
    kt_check_true("own", o == &own);
    kt_check_near("second", own.second, 2.0, 0.0);
}

KT_TEST(sizes_that_are_none_are_rejected) {
    const size_t sizes[] = {1, KT_SIZE_TO(kt_grown_options, first) - 1, sizeof(kt_grown_options) + 8, (size_t)-1};
    for (size_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        kt_error error = {KT_OK, "", ""};
        kt_grown_options own, given = {sizes[i], 10.0, 20.0, 30, 40};
        kt_check_true("none", read_of(&own, &given, &error) == NULL);
        kt_check_equal_int("code", error.code, KT_ERROR_ARGUMENT);
        kt_check_contains("the struct is named", error.message, "kt_grown_options");
        kt_check_true("defaults stay", memcmp(&own, &defaults, sizeof own) == 0);
    }
}
