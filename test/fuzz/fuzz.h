/* Fuzzing: entry points that take any bytes, and the functions that they share.
 *
 * scene.c (also for URDF, MJCF and SDF), model.c and motion.c each have the entry LLVMFuzzerTestOneInput of libFuzzer
 * and AFL++. The function kt_fuzz_must checks a claim. It ends the process if the claim is false, which fuzzers notice.
 * The program replay.c calls the same entries in the suite; `test/fuzz/run` builds the fuzzers.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_FUZZ_H
#define KT_TEST_FUZZ_H

#include "kinetree/model.h"
#include "kinetree/study.h"

#include <stdint.h>

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

/* Prints the words and aborts where the condition does not hold. */
void kt_fuzz_must(bool condition, const char *format, ...) __attribute__((format(printf, 2, 3)));

/* ---- bytes, read from front to back; zeros behind their end ------------------------------------------------------ */

typedef struct kt_bytes {
    const uint8_t *at, *end;
} kt_bytes;

uint8_t kt_bytes_next(kt_bytes *bytes);
int kt_bytes_pick(kt_bytes *bytes, int count); /* 0 <= value < count; 0 behind the end */
bool kt_bytes_chance(kt_bytes *bytes);         /* false behind the end */

/* The allowed range of the numbers and choices that are read. */
typedef enum kt_wildness {
    KT_WILD_NOT = 0, /* a mechanism of human size, right unless by bad luck */
    KT_WILD_SIZES,   /* numbers of all magnitudes that a description may have */
    KT_WILD_NUMBERS, /* any number: NaN, infinite, subnormal */
    KT_WILD_ALL,     /* and names that do not exist, types that are none, lists that are not there */
    KT_WILD_COUNT
} kt_wildness;

/* Most take one byte, so that a changed byte is a changed number; 0 behind the end. */
double kt_bytes_number(kt_bytes *bytes, kt_wildness wild);
double kt_bytes_positive(kt_bytes *bytes, kt_wildness wild); /* > 0, unless wild */
kt_vec3 kt_bytes_vector(kt_bytes *bytes, kt_wildness wild);

/* Changes a word of a block: the number of the word in two bytes, and a value. */
void kt_bytes_change_word(kt_bytes *bytes, char *block, size_t words);

/* ---- mechanisms from bytes --------------------------------------------------------------------------------------- */

enum { KT_FUZZ_BODIES = 6, KT_FUZZ_LOOPS = 4, KT_FUZZ_EFFECTS = 5, KT_FUZZ_MARKERS = 2, KT_FUZZ_NUMBERS = 8 };
enum { KT_FUZZ_TERMS = 3, KT_FUZZ_FUNCTIONS = KT_FUZZ_LOOPS + 3 * KT_FUZZ_EFFECTS };

/* The behaviour of a caller's own effect. */
typedef struct kt_fuzz_push {
    int returns;
    double force;
} kt_fuzz_push;

/* Points into itself: not to be copied. */
typedef struct kt_fuzz_mechanism {
    kt_description description;
    kt_body body[KT_FUZZ_BODIES];
    kt_marker marker[KT_FUZZ_BODIES][KT_FUZZ_MARKERS];
    kt_loop loop[KT_FUZZ_LOOPS];
    kt_term term[KT_FUZZ_LOOPS][KT_FUZZ_TERMS];
    char formula[KT_FUZZ_LOOPS][200]; /* of couplings */
    kt_effect effect[KT_FUZZ_EFFECTS];
    kt_fuzz_push push[KT_FUZZ_EFFECTS];
    double numbers[KT_FUZZ_FUNCTIONS][KT_FUZZ_NUMBERS];
    int functions;
    const char *hold[2];
    kt_wildness wild;
    bool custom; /* some effect is the caller's own */
} kt_fuzz_mechanism;

/* describe.c: the mechanism and its effects, right or wrong; attach.c: its loops and effects. */
void kt_fuzz_describe(kt_bytes *bytes, kt_fuzz_mechanism *m);
void kt_fuzz_attach(kt_bytes *bytes, kt_fuzz_mechanism *m);
void kt_fuzz_rotation(kt_bytes *bytes, kt_wildness wild, kt_rotation *rotation);
kt_vec3 kt_fuzz_axis(kt_bytes *bytes, kt_wildness wild);
const char *kt_fuzz_name(kt_bytes *bytes, const kt_fuzz_mechanism *m, int body);

/* Options of a model, all of them legal, and which formulation of it is to be tried. */
kt_model_options kt_fuzz_options(kt_bytes *bytes, kt_formulation *formulation);

/* The absolute formulation of a model, where it is to be tried; else NULL. */
kt_absolute *kt_fuzz_absolute(const kt_description *description, const kt_model_options *options, const kt_model *model,
                              kt_formulation formulation);

#endif
