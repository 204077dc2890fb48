/* Numbers from bytes: one byte is a sixteenth, or a mark that a longer number follows. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fuzz.h"

#include "kinetree/study.h"

#include <float.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

void kt_fuzz_must(bool condition, const char *format, ...) {
    if (condition)
        return;
    va_list arguments;
    va_start(arguments, format);
    (void)fputs("does not hold: ", stderr);
    (void)vfprintf(stderr, format, arguments);
    (void)fputc('\n', stderr);
    va_end(arguments);
    abort();
}

uint8_t kt_bytes_next(kt_bytes *bytes) { return bytes->at < bytes->end ? *bytes->at++ : 0; }

int kt_bytes_pick(kt_bytes *bytes, int count) { return kt_bytes_next(bytes) % count; }

bool kt_bytes_chance(kt_bytes *bytes) { return (kt_bytes_next(bytes) & 1U) != 0; }

static double any_bits(kt_bytes *bytes) {
    uint64_t bits = 0;
    double value;
    for (int i = 0; i < 8; i++)
        bits = bits << 8 | kt_bytes_next(bytes);
    memcpy(&value, &bits, sizeof value);
    return value;
}

/* A number of a magnitude up to 10^most. */
static double any_size(kt_bytes *bytes, int most) {
    const double digits = (int8_t)kt_bytes_next(bytes) / 16.0;
    const int exponent = kt_bytes_pick(bytes, 2 * most + 1) - most;
    return digits * pow(10.0, exponent);
}

double kt_bytes_number(kt_bytes *bytes, kt_wildness wild) {
    static const double
        tame[] = {1.5707963267948966, 3.141592653589793, -3.141592653589793, 0.1, 1e-3, 100.0, 1e-9},
        sized[] = {1e50, -1e50, 1e-50, 1e25, -0.0, 1e-8, 1e8, 1e16},
        worst[] = {(double)NAN, (double)INFINITY, -(double)INFINITY, DBL_MAX, DBL_TRUE_MIN, -DBL_MIN, 1e51, 1e151,
                   1e-160};
    const int8_t first = (int8_t)kt_bytes_next(bytes);
    if (first >= -96 && first <= 96)
        return first / 16.0;
    if (wild == KT_WILD_NOT || (first & 3) == 0)
        return tame[kt_bytes_pick(bytes, sizeof tame / sizeof *tame)];
    if (wild == KT_WILD_SIZES || (first & 3) == 1)
        return kt_bytes_chance(bytes) ? any_size(bytes, 49) : sized[kt_bytes_pick(bytes, sizeof sized / sizeof *sized)];
    if ((first & 3) == 2)
        return worst[kt_bytes_pick(bytes, sizeof worst / sizeof *worst)];
    return any_bits(bytes);
}

double kt_bytes_positive(kt_bytes *bytes, kt_wildness wild) {
    const double value = kt_bytes_number(bytes, wild);
    if (wild >= KT_WILD_NUMBERS)
        return value;
    return value == 0.0 ? 1.0 : fabs(value);
}

kt_vec3 kt_bytes_vector(kt_bytes *bytes, kt_wildness wild) {
    const double x = kt_bytes_number(bytes, wild), y = kt_bytes_number(bytes, wild);
    return kt_vec3_make(x, y, kt_bytes_number(bytes, wild));
}

kt_model_options kt_fuzz_options(kt_bytes *bytes, kt_formulation *formulation) {
    const unsigned chosen = kt_bytes_next(bytes);
    kt_model_options options = kt_model_options_default();
    options.isa = (chosen & 1U) != 0 ? KT_ISA_BASE : KT_ISA_AUTO;
    options.reduction = kt_reduction_method_of((kt_reduction)((chosen >> 1) % 3));
    options.metric = (chosen & 16U) != 0 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
    options.plan = (chosen & 64U) != 0 ? KT_PLAN_SPATIAL : KT_PLAN_AUTO;
    *formulation = (chosen & 32U) != 0 ? KT_FORMULATION_ABSOLUTE : KT_FORMULATION_TREE;
    return options;
}

kt_absolute *kt_fuzz_absolute(const kt_description *description, const kt_model_options *options, const kt_model *model,
                              kt_formulation formulation) {
    kt_absolute *absolute = NULL;
    kt_error error = {KT_OK, "", ""};
    if (formulation != KT_FORMULATION_ABSOLUTE)
        return NULL;
    bool is_of_tree = false; /* the variables of formulas, and loads that rub */
    for (int i = 0; i < description->effect_count; i++)
        is_of_tree = is_of_tree || description->effects[i].type == KT_EFFECT_EXPRESSION ||
                     description->effects[i].type == KT_EFFECT_JOINT_FRICTION;
    const kt_status status = kt_absolute_create(description, options, model, &absolute, &error);
    kt_fuzz_must((status == KT_OK) == (absolute != NULL) &&
                     (status == KT_OK || status == KT_ERROR_MODEL ||
                      (status == KT_ERROR_UNSUPPORTED && (is_of_tree || kt_massless_count(model) > 0))),
                 "free bodies may lack inertia, formulas, rubbing loads and joints without mass be of the tree, and "
                 "that is all: %s: %s",
                 error.where, error.message);
    return absolute;
}

void kt_bytes_change_word(kt_bytes *bytes, char *block, size_t words) {
    static const double reals[] = {0.0, -1.0, 1.0, 2.0, 1e300, -1e300, 1e-300, 0.5};
    static const int64_t integers[] = {0,         1,         -1,         2,         3,         INT64_MAX,
                                       INT64_MIN, INT32_MAX, 4294967297, 1LL << 52, 1LL << 40, 256};
    const size_t word = (kt_bytes_next(bytes) + 256U * kt_bytes_next(bytes)) % words;
    const unsigned kind = kt_bytes_next(bytes);
    char *at = block + 8 * word;
    int64_t integer = integers[kind % 12];
    double real = kind % 10 == 8 ? (double)NAN : kind % 10 == 9 ? HUGE_VAL : reals[kind % 8];
    uint64_t bits;
    switch (kind / 64) {
    case 0:
        memcpy(at, &integer, sizeof integer);
        break;
    case 1:
        memcpy(at, &real, sizeof real);
        break;
    case 2:
        at[kind % 8] = (char)kt_bytes_next(bytes);
        break;
    default:
        memcpy(&bits, at, sizeof bits);
        bits ^= UINT64_C(1) << kind % 64;
        memcpy(at, &bits, sizeof bits);
    }
}
