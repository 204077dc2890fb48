/* Rules for functions of time in a description. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/check.h"
#include "model/formula_names.h"
#include "model/function_formula.h"

#include <math.h>
#include <stddef.h>
#include <stdio.h>

/* With shorter steps of time, second derivatives would overflow. */
static const double least_step = 1e-50;

/* Checks the numbers of a sine, a ramp or a bump, which are its keys. The last two start and end. */
static bool check_numbers_of_keys(kt_checker *checker, const char *field, const kt_function *f) {
    const kt_descriptor *form = kt_function_descriptor(f->type);
    bool fine = true;
    for (int i = 0; i < form->key_count; i++) {
        const kt_key *key = &form->keys[i];
        const double *x = (const double *)(const void *)((const char *)f + key->offset);
        char suffix[32];
        snprintf(suffix, sizeof suffix, ".%s.%s", form->name, key->name);
        fine = (key->range == KT_RANGE_NOT_NEGATIVE ? kt_checker_not_negative(checker, field, suffix, *x)
                                                    : kt_checker_value(checker, field, -1, suffix, -1, *x)) &&
               fine;
    }
    if (f->type != KT_FUNCTION_SINE && kt_number_is_fine(f->start) && kt_number_is_fine(f->end) &&
        !(f->end - f->start >= least_step)) {
        kt_checker_fault(checker, field, -1, "%s.%s starts at %.17g and ends at %.17g; it must end later", field,
                         form->name, f->start, f->end);
        fine = false;
    }
    return fine;
}

static bool check_polynomial(kt_checker *checker, const char *field, const kt_function *f) {
    if (f->number_count < 1 || f->numbers == NULL) {
        kt_checker_fault(checker, field, -1, "%s.polynomial has no coefficients; give c0, c1, ...", field);
        return false;
    }
    return kt_checker_values(checker, field, -1, ".polynomial", f->numbers, f->number_count);
}

/* Numbers of a table are rows [t, y], with increasing times. */
static bool check_table(kt_checker *checker, const char *field, const kt_function *f) {
    if (f->interpolation != KT_INTERPOLATION_LINEAR && f->interpolation != KT_INTERPOLATION_CUBIC &&
        f->interpolation != KT_INTERPOLATION_MONOTONE) {
        kt_checker_fault(
            checker, field, -1, "%s.interpolation is %d; there are linear (%d), cubic (%d) and monotone (%d)", field,
            (int)f->interpolation, KT_INTERPOLATION_LINEAR, KT_INTERPOLATION_CUBIC, KT_INTERPOLATION_MONOTONE);
        return false;
    }
    if (f->has_slopes && f->interpolation != KT_INTERPOLATION_CUBIC) {
        kt_checker_fault(checker, field, -1, "%s.slopes: slopes at the ends are those of cubic tables", field);
        return false;
    }
    if (f->has_slopes && !kt_checker_values(checker, field, -1, ".slopes", f->slopes, 2))
        return false;
    if (f->number_count < 4 || f->numbers == NULL) {
        kt_checker_fault(checker, field, -1, "%s.table needs two rows [t, y] or more", field);
        return false;
    }
    if (f->number_count % 2 != 0) {
        kt_checker_fault(checker, field, -1, "%s.table has %d numbers; rows are pairs of t and y", field,
                         f->number_count);
        return false;
    }
    for (int i = 0; i < f->number_count; i++) {
        char suffix[48];
        if (!kt_number_is_fine(f->numbers[i])) {
            snprintf(suffix, sizeof suffix, ".table[%d]", i / 2);
            return kt_checker_value(checker, field, -1, suffix, i % 2, f->numbers[i]);
        }
    }
    for (int k = 2; k < f->number_count; k += 2)
        if (!(f->numbers[k] - f->numbers[k - 2] >= least_step)) {
            kt_checker_fault(checker, field, -1, "%s.table[%d] has time %.17g after %.17g; times must increase", field,
                             k / 2, f->numbers[k], f->numbers[k - 2]);
            return false;
        }
    return true;
}

static bool check_expression(kt_checker *checker, const char *field, const kt_function *f) {
    const kt_symbols time = kt_time_symbols();
    if (f->text != NULL)
        return kt_checker_text(checker, field, f->text, &time);
    kt_checker_fault(checker, field, -1, "%s has no formula; give it as text", field);
    return false;
}

static bool check_any(kt_checker *checker, const char *field, const kt_function *function, int depth);

/* Checks the parts of a sum or product, which are functions again; `depth` bounds the recursion. */
static bool check_parts(kt_checker *checker, const char *field, const kt_function *f, int depth) {
    bool fine = true;
    if (f->part_count < 1 || f->parts == NULL || depth >= KT_FUNCTION_DEPTH_MAX) {
        kt_checker_fault(checker, field, -1,
                         depth < KT_FUNCTION_DEPTH_MAX
                             ? "%s.%s has no functions; give one or more"
                             : "%s.%s is within too many others; put fewer of them into one another",
                         field, f->type == KT_FUNCTION_SUM ? "sum" : "product");
        return false;
    }
    for (int i = 0; i < f->part_count; i++) {
        if (f->parts[i].type == KT_FUNCTION_NONE)
            kt_checker_fault(checker, field, -1, "%s: part %d is no function", field, i);
        fine = f->parts[i].type != KT_FUNCTION_NONE && check_any(checker, field, &f->parts[i], depth + 1) && fine;
    }
    return fine;
}

static bool check_function_formula(kt_checker *checker, const char *field, const kt_function *function, int depth) {
    if (function->type == KT_FUNCTION_BUMP)
        return check_numbers_of_keys(checker, field, function);
    if (function->type == KT_FUNCTION_EXPRESSION)
        return check_expression(checker, field, function);
    return check_parts(checker, field, function, depth);
}

/* Reports the faults of a function of time; returns whether it has none. depth: how many functions it is part of. */
static bool check_any(kt_checker *checker, const char *field, const kt_function *function, int depth) {
    switch (function->type) {
    case KT_FUNCTION_NONE:
        return true;
    case KT_FUNCTION_CONSTANT:
        return kt_checker_number(checker, field, function->value);
    case KT_FUNCTION_SINE:
    case KT_FUNCTION_RAMP:
        return check_numbers_of_keys(checker, field, function);
    case KT_FUNCTION_POLYNOMIAL:
        return check_polynomial(checker, field, function);
    case KT_FUNCTION_TABLE:
        return check_table(checker, field, function);
    case KT_FUNCTION_BUMP:
    case KT_FUNCTION_SUM:
    case KT_FUNCTION_PRODUCT:
    case KT_FUNCTION_EXPRESSION:
        return check_function_formula(checker, field, function, depth);
    }
    kt_checker_fault(checker, field, -1,
                     "%s has function type %d, and there is none of that number; take one of kt_function_type", field,
                     (int)function->type);
    return false;
}

bool kt_checker_function(kt_checker *checker, const char *field, const kt_function *function) {
    return check_any(checker, field, function, 0);
}

/* Returns the least value that the function takes, as far as this is possible without evaluation: for a polynomial the
 * value at t = 0, for a table the least value of its rows. */
static double least_value(const kt_function *f) {
    double least = KT_NUMBER_MOST;
    switch (f->type) {
    case KT_FUNCTION_NONE:
        break;
    case KT_FUNCTION_CONSTANT:
        return f->value;
    case KT_FUNCTION_SINE:
        /* With a frequency of zero the function keeps its initial value. */
        return f->offset + (f->frequency > 0.0 ? -fabs(f->amplitude) : f->amplitude * sin(f->phase));
    case KT_FUNCTION_RAMP:
        return fmin(f->from, f->to);
    case KT_FUNCTION_POLYNOMIAL:
        return f->numbers[0];
    case KT_FUNCTION_TABLE:
        for (int k = 1; k < f->number_count; k += 2)
            least = fmin(least, f->numbers[k]);
        break;
    case KT_FUNCTION_BUMP: /* these have values only by evaluation at a time */
    case KT_FUNCTION_SUM:
    case KT_FUNCTION_PRODUCT:
    case KT_FUNCTION_EXPRESSION:
        break;
    }
    return least;
}

void kt_checker_positive_function(kt_checker *checker, const char *field, const kt_function *function) {
    if (!kt_checker_function(checker, field, function))
        return;
    const double least = least_value(function);
    if (function->type == KT_FUNCTION_CONSTANT)
        kt_checker_positive(checker, field, least);
    else if (!(least > 0.0))
        kt_checker_fault(checker, field, -1, "%s falls to %g; it must stay greater than 0", field, least);
}
