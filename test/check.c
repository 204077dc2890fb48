/* The checks of check.h, and the main of every test program. */
#include "check.h"

#include <math.h>
#include <setjmp.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include <cmocka.h>

enum { MAX_TESTS = 512 };
static kt_test *first_test;
static kt_test *last_test;
static const char *running = "";
static size_t checks, failures, skips;

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static const char *shown(const char *text) { return text == NULL ? "(none)" : text; }

static bool report(bool holds, const char *what, const char *format, ...) __attribute__((format(printf, 3, 4)));

static bool report(bool holds, const char *what, const char *format, ...) {
    checks++;
    if (!holds)
        failures++;
    printf("  %s %-44s ", holds ? "    " : "FAIL", shown(what));
    va_list arguments;
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    putchar('\n');
    return holds;
}

/* The ratio x / bound. A bound of zero requires exactly zero. No x meets a bound that is not finite or below zero. */
static double ratio_of(double x, double bound) {
    if (bound > 0.0 && isfinite(bound))
        return x / bound;
    return x == 0.0 && bound == 0.0 ? 0.0 : (double)NAN;
}

static const char *slack_if(bool far) { return far ? "  slack" : ""; }

static const char *slack(double ratio) { return slack_if(ratio > 0.0 && ratio < 1e-3); }

bool kt_check_near(const char *what, double observed, double expected, double bound) {
    double error = fabs(observed - expected);
    double ratio = ratio_of(error, bound);
    return report(ratio <= 1.0, what, "observed %.17g  expected %.17g  error %.3g  bound %.3g  ratio %.3g%s", observed,
                  expected, error, bound, ratio, slack(ratio));
}

bool kt_check_below(const char *what, double observed, double bound) {
    double ratio = ratio_of(observed, bound);
    const bool never_used = observed == 0.0 && bound > 2.0; /* failures that are allowed */
    return report(ratio >= 0.0 && ratio <= 1.0, what, "observed %.6g  bound %.3g  ratio %.3g%s", observed, bound, ratio,
                  never_used ? slack_if(true) : slack(ratio));
}

bool kt_check_above(const char *what, double observed, double bound) {
    return report(observed >= bound && (observed > 0.0 || bound != 0.0), what,
                  "observed %.6g  lower bound %.3g  ratio %.3g%s", observed, bound, bound / observed,
                  slack_if(observed > 0.0 && bound < 1e-3 * observed));
}

bool kt_check_equal_int(const char *what, long long observed, long long expected) {
    return report(observed == expected, what, "observed %lld  expected %lld", observed, expected);
}

static bool same_bits(double a, double b) {
    uint64_t x, y;
    memcpy(&x, &a, sizeof x);
    memcpy(&y, &b, sizeof y);
    return x == y;
}

bool kt_check_equal_bits(const char *what, const double *observed, const double *expected, size_t count) {
    size_t equal = 0;
    while (equal < count && same_bits(observed[equal], expected[equal]))
        equal++;
    if (equal == count)
        return report(count > 0, what, "%zu numbers bit for bit", count);
    return report(false, what, "number %zu of %zu: observed %a  expected %a", equal, count, observed[equal],
                  expected[equal]);
}

bool kt_check_true(const char *what, bool condition) {
    return report(condition, what, "%s", condition ? "true" : "false");
}

bool kt_check_text(const char *what, const char *observed, const char *expected) {
    bool holds = observed != NULL && expected != NULL && strcmp(observed, expected) == 0;
    return report(holds, what, "observed \"%s\"  expected \"%s\"", shown(observed), shown(expected));
}

bool kt_check_contains(const char *what, const char *observed, const char *part) {
    bool holds = observed != NULL && part != NULL && *part != '\0' && strstr(observed, part) != NULL;
    return report(holds, what, "observed \"%s\"  expected in it \"%s\"", shown(observed), shown(part));
}

void kt_note(const char *format, ...) {
    fputs("       ", stdout);
    va_list arguments;
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    putchar('\n');
}

/* The form that count.py reads. */
void kt_skip(const char *what, const char *why) {
    skips++;
    printf("[  SKIPPED ] %s, %s: %s\n", running, what, why);
}

/* ---- the worst of many ---------------------------------------------------------------------------------------------
 */

kt_worst kt_worst_make(const char *what) {
    kt_worst worst = {.what = what, .ratio = -1.0};
    return worst;
}

static void take(kt_worst *worst, double observed, double bound, const char *where, va_list arguments)
    __attribute__((format(printf, 4, 0)));

static void take(kt_worst *worst, double observed, double bound, const char *where, va_list arguments) {
    double ratio = observed < 0.0 ? (double)NAN : ratio_of(observed, bound);
    bool holds = ratio <= 1.0;
    worst->count++;
    if (!holds)
        worst->failures++;
    /* Once a NaN is held, nothing is worse. */
    if (!isnan(worst->ratio) && !(ratio <= worst->ratio)) {
        worst->ratio = ratio;
        worst->observed = observed;
        worst->bound = bound;
        vsnprintf(worst->where, sizeof worst->where, where, arguments);
    }
}

void kt_worst_near(kt_worst *worst, double observed, double expected, double bound, const char *where, ...) {
    va_list arguments;
    va_start(arguments, where);
    take(worst, fabs(observed - expected), bound, where, arguments);
    va_end(arguments);
}

void kt_worst_below(kt_worst *worst, double observed, double bound, const char *where, ...) {
    va_list arguments;
    va_start(arguments, where);
    take(worst, observed, bound, where, arguments);
    va_end(arguments);
}

bool kt_check_worst(const kt_worst *worst) {
    bool holds = worst->count > 0 && worst->failures == 0;
    return report(holds, worst->what, "worst %.3g  bound %.3g  ratio %.3g%s  at %s  (%zu of %zu fail)", worst->observed,
                  worst->bound, worst->ratio, slack(worst->ratio), worst->where, worst->failures, worst->count);
}

/* ---- running -------------------------------------------------------------------------------------------------------
 */

void kt_test_register(kt_test *test) {
    if (first_test == NULL)
        first_test = test;
    else
        last_test->next = test;
    last_test = test;
}

static jmp_buf end_of_test;

void kt_end_test(void) { longjmp(end_of_test, 1); }

void kt_need(bool held) {
    if (!held)
        kt_end_test();
}

kt_random kt_random_of_test(void) { return kt_random_named(running); }

/* Static, because tests count allocations and make them fail. */
enum { MAX_OWNED = 20000 };
static struct {
    void *object;
    void (*release)(void *object);
} owned[MAX_OWNED];
static size_t owned_count;

void kt_test_own(void *object, void (*release)(void *object)) {
    if (object == NULL)
        return;
    if (owned_count == MAX_OWNED) {
        fputs("a test must own no more than MAX_OWNED objects\n", stderr);
        abort();
    }
    owned[owned_count].object = object;
    owned[owned_count++].release = release;
}

void kt_test_release(void *object) {
    for (size_t i = owned_count; object != NULL && i-- > 0;)
        if (owned[i].object == object) {
            void (*const release)(void *) = owned[i].release;
            owned_count--;
            memmove(&owned[i], &owned[i + 1], (owned_count - i) * sizeof *owned);
            release(object);
            return;
        }
}

static void release_owned(void) {
    while (owned_count > 0) {
        owned_count--;
        owned[owned_count].release(owned[owned_count].object);
    }
}

static void run_registered(void **state) {
    const kt_test *test = *state;
    running = test->name;
    checks = failures = skips = 0;
    if (setjmp(end_of_test) == 0)
        test->body();
    release_owned();
    if (checks == 0 && skips > 0)
        skip();
    if (checks == 0)
        fail_msg("no check was made");
    if (failures > 0)
        fail_msg("%zu of %zu checks failed", failures, checks);
}

int main(int argc, char **argv) {
    struct CMUnitTest tests[MAX_TESTS];
    size_t count = 0;
    /* A crash must not take the lines before it along. */
    setvbuf(stdout, NULL, _IOLBF, 0);
    for (kt_test *test = first_test; test != NULL && count < MAX_TESTS; test = test->next)
        tests[count++] = (struct CMUnitTest){test->name, run_registered, NULL, NULL, test};
    if (count == 0 || count == MAX_TESTS) {
        fputs("a test program must have tests, and fewer than MAX_TESTS\n", stderr);
        return 1;
    }
    if (argc > 1)
        cmocka_set_test_filter(argv[1]);
    const char *slash = strrchr(argv[0], '/');
    printf("seed %llu (KT_SEED sets another)\n", (unsigned long long)kt_random_seed());
    return _cmocka_run_group_tests(slash == NULL ? argv[0] : slash + 1, tests, count, NULL, NULL);
}
