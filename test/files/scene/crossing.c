/* Formulas of events that can never change their sign are rejected, and no others. The test draws random formulas as
 * trees. It computes samples of their values along the tree.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "collect.h"
#include "random.h"

/* ---- formulas ---------------------------------------------------------------------------------------------------- */

enum { VARIABLES = 4, TERMS = 64, TEXT = 1500, SAMPLES = 400, FORMULAS = 3000 };

static const char *const names[VARIABLES] = {"t", "position.p", "velocity.p", "s"};

/* Postfix: numbers, variables and operators. */
typedef struct term {
    char code;
    double number;
    int variable;
} term;

typedef struct drawn {
    term terms[TERMS];
    int count;
    char text[TEXT];
    size_t length;
    kt_random *random;
} drawn;

static void put(drawn *f, const char *text) {
    const int length = snprintf(f->text + f->length, sizeof f->text - f->length, "%s", text);
    f->length += (size_t)length;
}

static void push(drawn *f, term what) {
    if (f->count < TERMS)
        f->terms[f->count++] = what;
}

static void number(drawn *f, double value) {
    char text[32];
    snprintf(text, sizeof text, "%.3f", value);
    put(f, text);
    push(f, (term){.code = 'n', .number = strtod(text, NULL)});
}

static void variable(drawn *f) {
    const int k = kt_random_int(f->random, 0, VARIABLES - 1);
    put(f, names[k]);
    push(f, (term){.code = 'v', .variable = k});
}

typedef struct operation {
    char code;
    const char *open, *between, *close;
} operation;

/* Operations with any two operands, with one, and those with one or two whose values are never negative. */
static const operation twos[] = {{'+', "(", " + ", ")"},
                                 {'-', "(", " - ", ")"},
                                 {'*', "(", "*", ")"},
                                 {'m', "min(", ", ", ")"},
                                 {'M', "max(", ", ", ")"}};
static const operation ones[] = {
    {'_', "(-", "", ")"}, {'s', "sin(", "", ")"}, {'a', "atan(", "", ")"}, {'g', "sign(", "", ")"}};
static const operation positive_twos[] = {{'h', "hypot(", ", ", ")"},
                                          {'<', "(", " < ", ")"},
                                          {'G', "(", " >= ", ")"},
                                          {'=', "(", " == ", ")"},
                                          {'#', "(", " != ", ")"}};
static const operation positive_ones[] = {
    {'A', "abs(", "", ")"}, {'2', "(", "", ")^2"}, {'t', "step(", "", ")"}, {'e', "exp(", "", "/10)"}};

#define PICK(list) (list)[kt_random_int(f->random, 0, (int)(sizeof(list) / sizeof *(list)) - 1)]

static void draw_any(drawn *f, int depth);

static void draw_one(drawn *f, operation what, void (*inner)(drawn *, int), int depth) {
    put(f, what.open);
    inner(f, depth - 1);
    put(f, what.close);
    push(f, (term){.code = what.code});
}

static void draw_two(drawn *f, operation what, void (*inner)(drawn *, int), int depth) {
    put(f, what.open);
    inner(f, depth - 1);
    put(f, what.between);
    inner(f, depth - 1);
    put(f, what.close);
    push(f, (term){.code = what.code});
}

/* A formula whose values are never below zero. */
static void draw_positive(drawn *f, int depth) {
    static const operation kept[] = {{'+', "(", " + ", ")"}, {'*', "(", "*", ")"}, {'m', "min(", ", ", ")"}};
    const int kind = kt_random_int(f->random, 0, depth > 0 ? 3 : 1);
    if (kind == 0) {
        draw_one(f, PICK(positive_ones), draw_any, depth);
    } else if (kind == 1) {
        draw_two(f, PICK(positive_twos), draw_any, depth);
    } else if (kind == 2) {
        draw_two(f, PICK(kept), draw_positive, depth);
    } else { /* of which one alone is positive */
        put(f, "max(");
        draw_any(f, depth - 1);
        put(f, ", ");
        draw_positive(f, depth - 1);
        put(f, ")");
        push(f, (term){.code = 'M'});
    }
}

static void draw_any(drawn *f, int depth) {
    const int kind = kt_random_int(f->random, 0, depth > 0 ? 4 : 1);
    if (kind == 0)
        number(f, kt_random_uniform(f->random, -3.0, 3.0));
    else if (kind == 1)
        variable(f);
    else if (kind == 2)
        draw_two(f, PICK(twos), draw_any, depth);
    else if (kind == 3)
        draw_one(f, PICK(ones), draw_any, depth);
    else
        draw_positive(f, depth - 1);
}

/* ---- values ------------------------------------------------------------------------------------------------------ */

static double one_value(char code, double x) {
    switch (code) {
    case '_':
        return -x;
    case 's':
        return sin(x);
    case 'a':
        return atan(x);
    case 'g':
        return (x > 0.0) - (x < 0.0);
    case 'A':
        return fabs(x);
    case '2':
        return x * x;
    case 't':
        return x >= 0.0;
    default:
        return exp(x / 10.0);
    }
}

static double two_value(char code, double x, double y) {
    switch (code) {
    case '+':
        return x + y;
    case '-':
        return x - y;
    case '*':
        return x * y;
    case 'm':
        return fmin(x, y);
    case 'M':
        return fmax(x, y);
    case 'h':
        return hypot(x, y);
    case '<':
        return x < y;
    case 'G':
        return x >= y;
    case '=':
        return x == y;
    default:
        return x != y;
    }
}

static double value_of(const drawn *f, const double *values) {
    double stack[TERMS + 1];
    int top = 0;
    for (int i = 0; i < f->count; i++) {
        const term *what = &f->terms[i];
        if (what->code == 'n' || what->code == 'v') {
            stack[top++] = what->code == 'n' ? what->number : values[what->variable];
        } else if (strchr("_sagA2te", what->code) != NULL) {
            stack[top - 1] = one_value(what->code, stack[top - 1]);
        } else {
            top--;
            stack[top - 1] = two_value(what->code, stack[top - 1], stack[top]);
        }
    }
    return stack[0];
}

/* Whether samples of a formula have both signs. */
static bool is_seen_to_cross(const drawn *f) {
    bool below = false, above = false;
    for (int i = 0; i < SAMPLES && !(below && above); i++) {
        double values[VARIABLES];
        for (int k = 0; k < VARIABLES; k++)
            values[k] = kt_random_normal(f->random) * exp(2.0 * kt_random_normal(f->random));
        const double value = value_of(f, values);
        below = below || value < 0.0;
        above = above || value > 0.0;
    }
    return below && above;
}

/* ---- scenes ------------------------------------------------------------------------------------------------------ */

static kt_collected faults;

/* Reads a scene with an event of this formula. Returns whether there is no fault. The only other fault allowed is that
 * of a formula that has no sign to change. */
static bool is_accepted(const char *formula) {
    char text[TEXT + 400];
    kt_scene scene;
    snprintf(text, sizeof text,
             "kinetree: 1\nbodies:\n  - {name: p, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
             "states: {s: {rate: t}}\nevents:\n  - {name: e, when: \"%s\", then: stop}\n",
             formula);
    memset(&faults, 0, sizeof faults);
    if (kt_collect_parse(&faults, text, &scene) == KT_OK) {
        kt_scene_free(&scene);
        return true;
    }
    kt_check_equal_int(formula, faults.count, 1);
    if (strstr(faults.text, "never") == NULL)
        kt_check_text(formula, faults.text, "a fault of a formula that never changes its sign");
    return false;
}

KT_TEST(formulas_that_are_seen_to_change_their_sign_are_accepted) {
    kt_random random = kt_random_of_test();
    int crossing = 0, wrong = 0;
    for (int i = 0; i < FORMULAS; i++) {
        drawn f = {.random = &random};
        draw_any(&f, 4);
        if (f.count == TERMS || !is_seen_to_cross(&f))
            continue;
        crossing++;
        if (!is_accepted(f.text) && wrong++ == 0)
            kt_check_text("the first that is rejected and changes its sign", f.text, "");
    }
    kt_check_true("at least 500 formulas change their sign", crossing > 500);
    kt_check_equal_int("rejected ones of them", wrong, 0);
}

/* If the whole formula is a comparison without parentheses, its event happens when the comparison becomes true. */
static bool is_comparison_in_parentheses(const drawn *f) {
    const char last = f->count > 0 ? f->terms[f->count - 1].code : 'n';
    return f->text[0] == '(' && (last == '<' || last == 'G');
}

/* The test makes no claim about products with exp, whose bounds are beyond the largest number. */
KT_TEST(formulas_of_one_sign_are_rejected) {
    kt_random random = kt_random_of_test();
    int rejected = 0, wrong = 0;
    for (int i = 0; i < FORMULAS; i++) {
        drawn f = {.random = &random};
        const int kind = kt_random_int(&random, 0, 3);
        put(&f, kind == 1 ? "-" : "");
        draw_positive(&f, 3);
        put(&f, kind == 2 ? " > -0.25" : kind == 3 ? " <= -0.25" : "");
        if (f.count == TERMS || (kind == 0 && is_comparison_in_parentheses(&f)))
            continue;
        if (!is_accepted(f.text))
            rejected++;
        else if (strstr(f.text, "exp(") == NULL && wrong++ == 0)
            kt_check_text("the first that is accepted and never changes its sign", f.text, "");
    }
    kt_check_true("2,800 of 3,000 formulas of one sign are rejected", rejected > 2800);
    kt_check_equal_int("accepted ones without exp", wrong, 0);
}

/* A square, a difference and a quotient of equal operands have one sign. A cube has that of its operand. */
KT_TEST(equal_operands_are_seen) {
    static const char *const forms[][3] = {
        {"(", ")*(", ")"}, {"(", ") - (", ")"}, {"(", ")/(", ")"}, {"s*s + (", ")*(", ")"}, {"-((", ")*(", ")) > 1"}};
    kt_random random = kt_random_of_test();
    int crossing = 0, accepted = 0, cubes = 0;
    for (int i = 0; i < 500; i++) {
        drawn f = {.random = &random};
        char text[3 * TEXT + 20];
        draw_any(&f, 3);
        if (f.count == TERMS || 3 * f.length + 20 > TEXT || strpbrk(f.text, "<>=") != NULL ||
            strstr(f.text, "exp(") != NULL || !is_seen_to_cross(&f))
            continue;
        crossing++;
        for (size_t k = 0; k < sizeof forms / sizeof *forms; k++) {
            snprintf(text, sizeof text, "%s%s%s%s%s", forms[k][0], f.text, forms[k][1], f.text, forms[k][2]);
            if (is_accepted(text) && accepted++ == 0)
                kt_check_text("the first that is accepted and has one sign", text, "");
        }
        snprintf(text, sizeof text, "(%s)*(%s)*(%s)", f.text, f.text, f.text);
        cubes += is_accepted(text);
    }
    kt_check_true("at least 60 formulas", crossing > 60);
    kt_check_equal_int("accepted", accepted, 0);
    kt_check_equal_int("cubes that are accepted", cubes, crossing);
    static const char *const even[] = {"s*t*s*t", "s*t*t*s", "t*s^3*t*s", "s^2*t*t + 1", "-(t*s*t*s*s*s)"};
    for (size_t k = 0; k < sizeof even / sizeof *even; k++)
        kt_check_text("a product of even powers that is accepted", is_accepted(even[k]) ? even[k] : "", "");
    kt_check_true("a product with an odd power is accepted", is_accepted("s*t*s") && is_accepted("s*t*s*t*s"));
    kt_check_true("a product is accepted", is_accepted("s*t") && is_accepted("(s - 1)*(s + 1)"));
    kt_check_true("a square minus a number is accepted", is_accepted("s*s - 1") && is_accepted("s*s < 0.25"));
}
