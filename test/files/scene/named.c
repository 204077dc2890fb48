/* Named expressions: a formula with names has the value of the formula with their expressions, and faults are
 * located. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/expression.h"
#include "kinetree/scene.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "check.h"
#include "collect.h"
#include "random.h"

static kt_collected faults;

static kt_status parse(const char *text, kt_scene *scene) { return kt_collect_parse(&faults, text, scene); }

/* ---- values ------------------------------------------------------------------------------------------------------ */

/* Variables of joints whose names go on with hyphens and the names of expressions. */
#define JOINTS "arm", "arm-e0", "e1-e2"
static const char *const joints[] = {JOINTS};
static const double positions[] = {0.7, -1.3, 2.1};

static bool find_position(void *user, const char *name, kt_symbol *symbol) {
    (void)user;
    for (int k = 0; k < 3; k++)
        if (strncmp(name, "position.", 9) == 0 && strcmp(name + 9, joints[k]) == 0) {
            *symbol = (kt_symbol){.index = k};
            return true;
        }
    return false;
}

/* A value of a formula, as text and as number. */
typedef struct operand {
    char text[64];
    double value;
} operand;

static operand draw_operand(kt_random *random, int before, const double *values) {
    operand o;
    const int kind = kt_random_int(random, 0, before > 0 ? 4 : 2);
    if (kind == 0) {
        o.value = (double)kt_random_int(random, 1, 9) / 4.0;
        snprintf(o.text, sizeof o.text, "%g", o.value);
    } else if (kind == 1) {
        const int k = kt_random_int(random, 0, 2);
        o.value = positions[k];
        snprintf(o.text, sizeof o.text, "position.%s", joints[k]);
    } else if (kind == 2) {
        o.value = 1.5;
        snprintf(o.text, sizeof o.text, "gain");
    } else {
        const int k = kt_random_int(random, 0, before - 1);
        o.value = values[k];
        snprintf(o.text, sizeof o.text, "e%d", k);
    }
    return o;
}

/* Operators whose values depend on how strongly they bind: without parentheses around an expression they would
 * differ. */
static double combine(kt_random *random, operand a, operand b, char *text, size_t size) {
    static const char *const signs[] = {"+", "-", "*", "/"};
    const int sign = kt_random_int(random, 0, 6);
    if (sign < 4)
        snprintf(text, size, "%s %s %s", a.text, signs[sign], b.text);
    else if (sign == 4)
        snprintf(text, size, "-%s^2", a.text);
    else
        snprintf(text, size, "%s(%s, 2*%s)", sign == 5 ? "max" : "atan2", a.text, b.text);
    switch (sign) {
    case 0:
        return a.value + b.value;
    case 1:
        return a.value - b.value;
    case 2:
        return a.value * b.value;
    case 3:
        return a.value / b.value;
    case 4:
        return -(a.value * a.value);
    case 5:
        return fmax(a.value, 2.0 * b.value);
    default:
        return atan2(a.value, 2.0 * b.value);
    }
}

/* The rate of the state uses the last expression; the order in the file is that of a permutation. */
static double draw_scene(kt_random *random, int count, char *text, size_t size) {
    char formula[12][160];
    double values[12];
    size_t used = (size_t)snprintf(text, size,
                                   "kinetree: 1\nparameters: {gain: 1.5}\nbodies:\n"
                                   "  - {name: arm, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                                   "  - {name: arm-e0, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                                   "  - {name: e1-e2, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"
                                   "expressions:\n");
    for (int i = 0; i < count; i++) {
        const operand a = draw_operand(random, i, values), b = draw_operand(random, i, values);
        values[i] = combine(random, a, b, formula[i], sizeof formula[i]);
    }
    for (int i = 0; i < count; i++) {
        const int k = (count + 1 - i) % count;
        used += (size_t)snprintf(text + used, size - used, "  e%d: \"%s%s\"\n", k, i % 3 == 0 ? "=" : "", formula[k]);
    }
    snprintf(text + used, size - used, "states: {work: {rate: \"3 - e%d/2\"}}\n", count - 1);
    return 3.0 - values[count - 1] / 2.0;
}

static double rate_of(const kt_scene *scene) {
    static double memory[8192];
    const kt_symbols symbols = {.find = find_position};
    const kt_expression *expression = NULL;
    kt_error error = {0};
    const kt_status status = kt_expression_parse(scene->description.states[0].rate, &symbols, memory, sizeof memory,
                                                 &expression, NULL, &error);
    return status == KT_OK ? kt_expression_evaluate(expression, positions) : (double)NAN;
}

KT_TEST(named_expressions_have_the_values_of_their_formulas) {
    enum { COUNT = 400 };
    kt_random random = kt_random_of_test();
    KT_WORST worst = kt_worst_make("values of rates");
    int finite = 0;
    for (int i = 0; i < COUNT; i++) {
        char text[6000];
        kt_scene *scene = kt_test_scene_place();
        const double expected = draw_scene(&random, kt_random_int(&random, 1, 8), text, sizeof text);
        if (!isfinite(expected) || fabs(expected) > 1e9)
            continue;
        const bool reads = parse(text, scene) == KT_OK;
        kt_worst_near(&worst, reads ? rate_of(scene) : (double)NAN, expected, 1e-13 * (1.0 + fabs(expected)),
                      "scene %d", i);
        finite++;
    }
    kt_check_equal_int("most are compared", finite > COUNT / 2, 1);
}

/* ---- faults ------------------------------------------------------------------------------------------------------ */

#define BODY "bodies:\n  - {name: arm, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}\n"

static void check_fault(const char *text, const char *where, const char *message) {
    kt_scene *scene = kt_test_scene_place();
    kt_check_equal_int("is rejected", parse(text, scene), KT_ERROR_SCENE);
    kt_check_contains("where", faults.text, where);
    kt_check_contains("message", faults.text, message);
}

KT_TEST(faults_of_named_expressions_are_located) {
    check_fault("kinetree: 1\n" BODY "expressions: {a: 2*b, b: c + 1, c: -a}\nstates: {x: {rate: 1 + b}}\n", "4:26",
                "depends on itself: b -> c -> a -> b");
    check_fault("kinetree: 1\n" BODY "expressions: {a: a + 1}\n", "4:18", "depends on itself: a -> a");
    check_fault("kinetree: 1\n" BODY "expressions: {a: 2*velocity.arn}\nstates: {x: {rate: 1 + a}}\n", "4:20",
                "there is no name 'velocity.arn'; did you mean 'velocity.arm'? (in the formula of line 5");
    check_fault("kinetree: 1\n" BODY "expressions: {lean: t}\nstates: {x: {rate: 1 + leen}}\n", "5:24",
                "did you mean 'lean'?");
    check_fault("kinetree: 1\n" BODY "expressions: {a: 2*(velocity.arm}\n", "4:33", "a ')' is missing");
    check_fault("kinetree: 1\nparameters: {m: =2*a}\n" BODY "expressions: {a: t}\n", "2:20",
                "'a' is a formula of `expressions`");
    check_fault("kinetree: 1\nparameters: {a: 2}\n" BODY "expressions: {a: t}\n", "2:14", "take another name");
    check_fault("kinetree: 1\n" BODY "expressions: {a: t}\nstates: {a: {rate: 1}}\n", "5:10", "take another name");
    check_fault("kinetree: 1\n" BODY "expressions: {sin: t}\n", "4:15", "a meaning of its own");
    check_fault("kinetree: 1\n" BODY "expressions: {a: t, a: 2*t}\n", "4:21", "there already, in line 4");
}

/* Each doubles the last: 13 of them have more than 4096 characters. */
KT_TEST(expressions_that_grow_beyond_the_longest_formula_are_rejected) {
    char text[2000];
    size_t used = (size_t)snprintf(text, sizeof text, "kinetree: 1\n" BODY "expressions:\n  e0: t\n");
    for (int k = 1; k <= 40; k++)
        used += (size_t)snprintf(text + used, sizeof text - used, "  e%d: e%d + e%d\n", k, k - 1, k - 1);
    snprintf(text + used, sizeof text - used, "states: {x: {rate: e40}}\n");
    check_fault(text, "46:20", "more than 4096 characters");
}

KT_TEST(an_expression_that_nothing_uses_is_noted) {
    kt_scene *scene = kt_test_scene_place();
    kt_check_equal_int(
        "reads", parse("kinetree: 1\n" BODY "expressions: {a: t, b: reaction.arm.fx}\nstates: {x: {rate: a}}\n", scene),
        KT_OK);
    kt_check_equal_int("notes", scene->note_count, 1);
    if (scene->note_count == 1)
        kt_check_contains("note", scene->notes[0].what, "nothing uses the expression 'b'");
}
