/* The method of a run in words. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_METHOD_WORDS_H
#define KT_COMMAND_RECORDS_METHOD_WORDS_H

#include "kinetree/run.h"

/* "dopri5, tolerance 1e-9" */
typedef struct kt_method_words {
    char text[96];
} kt_method_words;

kt_method_words kt_describe_method(const kt_run *run);

#endif
