/* The reader of formulas, for any text. It reports the fault and its place, or reads a formula whose value and
 * derivatives agree with each other. It takes no more memory than it requires. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "expression/formula_breakpoint.h"
#include "fuzz.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *const names[] = {"x", "y", "left-arm", "position.ball[2]", "tilt"};
enum { NAMES = sizeof names / sizeof *names };

static bool find(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    for (int k = 0; k < NAMES; k++) {
        if (strcmp(name, names[k]) != 0)
            continue;
        *symbol = (kt_symbol){.index = k, .is_angle = k == NAMES - 1};
        return true;
    }
    return false;
}

static const char *list(void *user, int k) {
    (void)user;
    return k < NAMES ? names[k] : NULL;
}

static void evaluate(const kt_expression *formula) {
    static const double values[NAMES] = {0.7, -1.3, 2.0, 0.0, 0.5}, still[NAMES] = {0.0};
    double out[3];
    int used[4] = {0};
    const double value = kt_expression_evaluate(formula, values);
    kt_expression_taylor(formula, values, still, NULL, out);
    kt_fuzz_must(memcmp(&value, &out[0], sizeof value) == 0 || (isnan(value) && isnan(out[0])),
                 "value %.17g and Taylor's %.17g are one", value, out[0]);
    kt_fuzz_must(out[1] == 0.0 && out[2] == 0.0, "what rests has no derivatives: %g, %g", out[1], out[2]);
    kt_expression_taylor(formula, values, values, values, out);
    const size_t count = kt_expression_symbols(formula, 4, used);
    for (size_t k = 0; k < count && k < 4; k++)
        kt_fuzz_must(used[k] >= 0 && used[k] < NAMES, "symbol %d exists", used[k]);
    (void)kt_expression_is_angle(formula);
}

/* At every time the formula is a number between its bounds, or NaN if that may be. */
static void check_bounds(const kt_expression *formula, double t) {
    const kt_jet jet = kt_expression_bound(formula, t, t, NULL, NULL);
    const double value = kt_expression_evaluate(formula, &t), room = isfinite(value) ? 1e-9 * fabs(value) : 0.0;
    kt_fuzz_must(jet.defined != (isnan(value) ? KT_DEFINED : KT_DEFINED_NOWHERE), "%.17g may be: %d", value,
                 (int)jet.defined);
    kt_fuzz_must(isnan(value) || (jet.c[0].lo - room <= value && value <= jet.c[0].hi + room),
                 "%.17g is between %.17g and %.17g", value, jet.c[0].lo, jet.c[0].hi);
}

/* A short formula of x alone, as one of time: bounds hold its value, and breakpoints come one after the other. */
static void find_breakpoints(const kt_expression *formula) {
    enum { MOST = 40 };
    int used[MOST], order = 0;
    const size_t count = kt_expression_symbols(formula, MOST, used);
    int64_t left = KT_BREAKPOINT_OPERATIONS / 16;
    double t = -0.5;
    if (formula->count > MOST)
        return;
    for (size_t k = 0; k < count; k++)
        if (used[k] != 0)
            return;
    for (int k = 0; k < 3 && t < 1e6; k++) {
        check_bounds(formula, t);
        const double next = kt_expression_next_breakpoint(formula, t, HUGE_VAL, &left, &order);
        kt_fuzz_must(next > t, "the breakpoint %.17g after %.17g comes later", next, t);
        t = next;
    }
}

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    const kt_symbols symbols = {.find = find, .list = list};
    char *text = malloc(size + 1);
    memcpy(text, data, size);
    text[size] = '\0';
    const size_t bytes = kt_expression_size(text), length = strlen(text);
    char *memory = malloc(bytes);
    const kt_expression *formula = NULL;
    int column = 0;
    kt_error error = {KT_OK, "", ""};
    const kt_status status = kt_expression_parse(text, &symbols, memory, bytes, &formula, &column, &error);
    if (status == KT_OK) {
        evaluate(formula);
        find_breakpoints(formula);
    } else {
        kt_fuzz_must(status == KT_ERROR_SCENE && error.code == status, "it is no formula: %d", (int)status);
        kt_fuzz_must(column >= 1 && (size_t)column <= length + 1, "column %d is in the text", column);
        kt_fuzz_must(error.message[0] != '\0' && formula == NULL, "a message, and no formula");
    }
    free(memory);
    free(text);
    return 0;
}
