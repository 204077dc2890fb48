/* Numbers and angles as a scene file writes them. All functions require the C locale, which kt_scene_parse sets. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_NUMBER_H
#define KT_DOCUMENT_NUMBER_H

#include "base/decimal.h"

#include <stdbool.h>
#include <stddef.h>

/* The type of a plain scalar: the core schema of YAML 1.2, and a number with a unit of angle. */
typedef enum kt_scalar {
    KT_SCALAR_TEXT = 0,
    KT_SCALAR_NULL,       /* empty, ~, null */
    KT_SCALAR_BOOL,       /* true, false */
    KT_SCALAR_NUMBER,     /* decimal and finite */
    KT_SCALAR_ANGLE,      /* a number with `deg` or `rad` */
    KT_SCALAR_NOT_FINITE, /* .inf, .nan */
    KT_SCALAR_INF_WORD,   /* inf, nan, infinity: text to YAML, but presumably meant as a number */
    KT_SCALAR_TOO_LARGE,  /* beyond the range of double */
    KT_SCALAR_HEX,        /* 0x1F, 0o17 */
    KT_SCALAR_OCTAL       /* `017`: in base eight to YAML 1.1, in base ten to YAML 1.2 */
} kt_scalar;

/* Classifies a terminated plain scalar. *value is the number, or for an angle its value in radians. Underscores,
 * sexagesimals (`1:30`) and the words of YAML 1.1 (yes, on) are text. A number too small for a double becomes the
 * nearest double, subnormal or zero. */
kt_scalar kt_scalar_classify(const char *text, double *value);

/* Whether a text is one of some words of up to eight small letters, in any case; NULL ends them. */
bool kt_is_word_of(const char *text, const char *const *words);

#endif
