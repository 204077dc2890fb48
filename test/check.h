/* Tests: the files of a folder are one program. Its meson.build lists the files, and nothing lists their KT_TESTs.
 *
 *     #include "check.h"
 *
 *     KT_TEST(quaternion_product_turns_twice) {
 *         kt_check_near("angle", observed, expected, 4.0 * DBL_EPSILON);
 *     }
 *
 * A check prints its observed value, its bound and their ratio, and goes on. The test fails at its end if any check
 * failed, or if there was none. NaN fails every check.
 *
 * A check that would hardly fail is marked "slack". Its ratio is below 1e-3. The bound would then let a thousandfold
 * error pass, or a value that must not be small could fall to a thousandth. A number of failures is slack if more than
 * 2 are allowed and none occurs. Slack fails no test. The script test/count.py counts it at the end of the suite. A
 * comment at each place gives the reason for its bound.
 *
 * Arguments of the program are patterns that choose tests by name ('aba_*'), file ('disc') or both
 * ('disc/rolls*'). Each file runs in a process of its own: runner.c.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CHECK_H
#define KT_TEST_CHECK_H

#include <stdbool.h>
#include <stddef.h>

#include "random.h"

typedef struct kt_test {
    const char *name, *file;
    void (*body)(void);
    struct kt_test *next;
} kt_test;

/* Adds a test to those that main runs, in the order of the calls. */
void kt_test_register(kt_test *test);

#define KT_TEST(name)                                                                                                  \
    static void name(void);                                                                                            \
    __attribute__((constructor)) static void kt_register_##name(void) {                                                \
        static kt_test test = {#name, __FILE__, name, NULL};                                                           \
        kt_test_register(&test);                                                                                       \
    }                                                                                                                  \
    static void name(void)

/* Each returns whether it held, for the test that cannot go on without. */

/* |observed - expected| <= bound */
bool kt_check_near(const char *what, double observed, double expected, double bound);

/* observed <= bound; meant for errors, other magnitudes, and numbers of failures: a negative value fails. */
bool kt_check_below(const char *what, double observed, double bound);

/* observed >= bound, for quantities that must not be small: a rejected value, a condition, an observed order. A bound
 * of 0 must be exceeded, because counts and magnitudes are never below 0. */
bool kt_check_above(const char *what, double observed, double bound);

bool kt_check_equal_int(const char *what, long long observed, long long expected);

/* The same bits: -0 differs from 0, and a NaN equals the same NaN. */
bool kt_check_equal_bits(const char *what, const double *observed, const double *expected, size_t count);

bool kt_check_true(const char *what, bool condition);

/* A text that is missing (NULL) fails. */
bool kt_check_text(const char *what, const char *observed, const char *expected);
bool kt_check_contains(const char *what, const char *observed, const char *part);

/* Many comparisons, one line. The worst ratio is kept with the name of its place:
 *
 *     KT_WORST error = kt_worst_make("acceleration");
 *     for (...)
 *         kt_worst_near(&error, a, b, bound, "tree %d joint %d", tree, joint);
 *
 * It is checked at the end of its block, also by a return or continue, unless kt_need ends the test before. The check
 * fails if any comparison did, or if there was none. A kt_worst that outlives its block, or is a part of something, is
 * checked by a call.
 */
#define KT_WORST __attribute__((cleanup(kt_check_worst))) kt_worst

typedef struct kt_worst {
    const char *what;
    double ratio, observed, bound;
    size_t count, failures;
    char where[120];
} kt_worst;

kt_worst kt_worst_make(const char *what);
void kt_worst_near(kt_worst *worst, double observed, double expected, double bound, const char *where, ...)
    __attribute__((format(printf, 5, 6)));
void kt_worst_below(kt_worst *worst, double observed, double bound, const char *where, ...)
    __attribute__((format(printf, 4, 5)));
bool kt_check_worst(const kt_worst *worst);

/* ---- the end of a test ------------------------------------------------------------------------------------------- */

/* Gives an object to the running test. When the body of the test has ended, also by kt_end_test, release(object) is
 * called for all objects, the latest first. NULL is not kept. */
void kt_test_own(void *object, void (*release)(void *object));

/* Releases an object of the running test at once, for tests that make many large ones. NULL is left alone. */
void kt_test_release(void *object);

/* Each process of tests calls the function before its first test. */
void kt_test_before(void (*function)(void));

/* Ends the running test. */
_Noreturn void kt_end_test(void);

/* Ends the running test unless its check has held: kt_need(kt_check_true("a contact", contact != NULL)); */
void kt_need(bool held);

/* Reports a feature that this machine lacks (such as an instruction set), and why. It is counted as skipped, and the
 * test goes on. A test that makes no check at all is skipped itself. */
void kt_skip(const char *what, const char *why);
#define KT_NO_ISA "this processor or build does not have this level of the instruction set"

/* A line of explanation among the checks. */
void kt_note(const char *format, ...) __attribute__((format(printf, 1, 2)));

#endif
