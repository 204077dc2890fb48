/* The checks of check.h. The file runner.c runs tests. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "runner.h"

#include <math.h>
#include <stdarg.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static const char *shown(const char *text) { return text == NULL ? "(none)" : text; }

static bool report(bool holds, const char *what, const char *format, ...) __attribute__((format(printf, 3, 4)));

static bool report(bool holds, const char *what, const char *format, ...) {
    kt_running.checks++;
    if (!holds)
        kt_running.failures++;
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
    kt_running.skips++;
    printf("[  SKIPPED ] %s, %s: %s\n", kt_running.name, what, why);
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
