/* The place of an error, for kt_error_set: kt_where_format("t = %.9g s", t).text. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_WHERE_H
#define KT_BASE_WHERE_H

#include "base/inner.h"

/* Has room for more than kt_error.where, so that kt_error_set marks a text that is cut. */
typedef struct kt_where_text {
    char text[KT_WHERE_SIZE + 32];
} kt_where_text;

KT_INNER kt_where_text kt_where_format(const char *format, ...) KT_PRINTF(1, 2);

/* WHAT 'NAME' at t = ... s */
static inline kt_where_text kt_where_at(const char *what, const char *name, double t) {
    return kt_where_format("%s '%.60s' at t = %.9g s", what, name, t);
}

#endif
