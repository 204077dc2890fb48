/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "interpose.h"

#include <limits.h>
#include <stdio.h>
#include <string.h>

#include "kinetree/status.h"

KT_TEST(version_is_one_everywhere) {
    char numbers[40];
    snprintf(numbers, sizeof numbers, "%d.%d.%d", KT_VERSION_MAJOR, KT_VERSION_MINOR, KT_VERSION_PATCH);
    kt_check_text("KT_VERSION", KT_VERSION, numbers);
    kt_check_text("kt_version()", kt_version(), KT_VERSION);
    kt_check_text("version of the build", PROJECT_VERSION, KT_VERSION);
}

/* Written out here once more: programs and files hold these numbers. */
KT_TEST(status_values_are_pinned) {
    kt_check_equal_int("KT_OK", KT_OK, 0);
    kt_check_equal_int("KT_ERROR_ARGUMENT", KT_ERROR_ARGUMENT, 1);
    kt_check_equal_int("KT_ERROR_MEMORY", KT_ERROR_MEMORY, 2);
    kt_check_equal_int("KT_ERROR_MODEL", KT_ERROR_MODEL, 3);
    kt_check_equal_int("KT_ERROR_SINGULAR", KT_ERROR_SINGULAR, 4);
    kt_check_equal_int("KT_ERROR_CONSTRAINT", KT_ERROR_CONSTRAINT, 5);
    kt_check_equal_int("KT_ERROR_NOT_FINITE", KT_ERROR_NOT_FINITE, 6);
    kt_check_equal_int("KT_ERROR_STEP", KT_ERROR_STEP, 7);
    kt_check_equal_int("KT_ERROR_CALLBACK", KT_ERROR_CALLBACK, 8);
    kt_check_equal_int("KT_ERROR_FILE", KT_ERROR_FILE, 9);
    kt_check_equal_int("KT_ERROR_SCENE", KT_ERROR_SCENE, 10);
    kt_check_equal_int("KT_ERROR_UNSUPPORTED", KT_ERROR_UNSUPPORTED, 11);
    kt_check_equal_int("KT_ERROR_EFFECT", KT_ERROR_EFFECT, 12);
}

KT_TEST(every_status_has_a_text_of_its_own) {
#define STATUS_VALUE(name, value, text) name,
    static const kt_status all[] = {KT_STATUS_LIST(STATUS_VALUE)};
#undef STATUS_VALUE
    size_t count = sizeof all / sizeof *all;
    for (size_t i = 0; i < count; i++) {
        const char *text = kt_status_text(all[i]);
        size_t equals = 0;
        for (size_t j = 0; text != NULL && j < count; j++)
            equals += strcmp(text, kt_status_text(all[j])) == 0;
        kt_check_equal_int(text, (long long)equals, 1);
        kt_check_true("is a text", text != NULL && *text != '\0' && strcmp(text, "unknown status") != 0);
    }
    kt_check_text("text of KT_OK", kt_status_text(KT_OK), "done");
    kt_check_contains("singular without inertia", kt_status_text(KT_ERROR_SINGULAR), "no inertia");
    kt_check_contains("singular by its position", kt_status_text(KT_ERROR_SINGULAR), "singular position");
}

KT_TEST(value_that_is_no_status_is_unknown) {
    kt_check_text("-1", kt_status_text((kt_status)-1), "unknown status");
    kt_check_text("13", kt_status_text((kt_status)13), "unknown status");
    kt_check_text("largest", kt_status_text((kt_status)INT_MAX), "unknown status");
}

KT_TEST(error_set_fills_code_where_and_message) {
    kt_error error = {KT_OK, "old", "old"};
    kt_status status = kt_error_set(&error, KT_ERROR_MODEL, "body 'crank'", "mass %g is below %s", -1.5, "zero");
    kt_check_equal_int("status", status, KT_ERROR_MODEL);
    kt_check_equal_int("code", error.code, KT_ERROR_MODEL);
    kt_check_text("where", error.where, "body 'crank'");
    kt_check_text("message", error.message, "mass -1.5 is below zero");
}

KT_TEST(error_set_does_without_error_and_where) {
    kt_check_equal_int("no error", kt_error_set(NULL, KT_ERROR_STEP, "t = 1", "step %d", 1), KT_ERROR_STEP);
    kt_error error = {KT_OK, "old", "old"};
    kt_check_equal_int("no where", kt_error_set(&error, KT_ERROR_FILE, NULL, "missing"), KT_ERROR_FILE);
    kt_check_text("where is empty", error.where, "");
    kt_check_text("message", error.message, "missing");
}

/* One byte less than the array is the longest text that stays whole. */
KT_TEST(text_of_any_length_is_terminated_and_a_cut_one_ends_in_dots) {
    char text[2 * KT_MESSAGE_SIZE];
    for (size_t length = 0; length < sizeof text; length++) {
        memset(text, 'x', length);
        text[length] = '\0';
        kt_error error;
        memset(&error, 0x7F, sizeof error);
        if (kt_error_set(&error, KT_ERROR_SCENE, text, "%s", text) != KT_ERROR_SCENE)
            kt_check_true("status", false);
        size_t where = length < KT_WHERE_SIZE ? length : KT_WHERE_SIZE - 1;
        size_t message = length < KT_MESSAGE_SIZE ? length : KT_MESSAGE_SIZE - 1;
        bool holds = memchr(error.where, '\0', sizeof error.where) == error.where + where &&
                     memchr(error.message, '\0', sizeof error.message) == error.message + message &&
                     (where == length) == (strstr(error.where, "...") == NULL) &&
                     (message == length) == (strstr(error.message, "...") == NULL);
        if (!holds || length % 100 == 0)
            kt_check_true("terminated, and dotted where cut", holds);
    }
}

/* U+00E9 is C3 A9; with one or two bytes before it, the cut falls on either byte of a pair. */
KT_TEST(cut_falls_between_characters) {
    for (size_t lead = 1; lead <= 2; lead++) {
        char text[3 * KT_WHERE_SIZE] = "ab";
        for (size_t i = lead; i + 2 < sizeof text; i += 2)
            memcpy(text + i, "\xC3\xA9", 3);
        kt_error error;
        (void)kt_error_set(&error, KT_ERROR_SCENE, text, "x");
        size_t length = strlen(error.where);
        kt_check_text("ends in dots", error.where + length - 3, "...");
        kt_check_equal_int("last byte before them", (unsigned char)error.where[length - 4], 0xA9);
        kt_check_above("length", (double)length, KT_WHERE_SIZE - 2);
    }
}

KT_TEST(error_can_be_told_again_with_more_around_it) {
    kt_error error;
    (void)kt_error_set(&error, KT_ERROR_MODEL, "body 'crank'", "mass is below zero");
    (void)kt_error_set(&error, KT_ERROR_SCENE, error.where, "scene 'four-bar': %s", error.message);
    kt_check_text("where", error.where, "body 'crank'");
    kt_check_text("message", error.message, "scene 'four-bar': mass is below zero");
}

KT_TEST(error_set_allocates_nothing) {
    kt_error error;
    kt_interpose_start();
    (void)kt_error_set(&error, KT_ERROR_NOT_FINITE, "t = 3.5", "joint %zu of '%s' is %g at %.17g", (size_t)3, "arm",
                       -1e308, 0.1);
    long allocations = kt_interpose_stop();
    kt_check_equal_int("allocations", allocations, 0);
    kt_check_contains("message", error.message, "joint 3 of 'arm'");
}
