/* A generated file as texts. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_CODEGEN_TEXT_H
#define KT_TEST_CODEGEN_TEXT_H

#include "check.h"

#include "kinetree/codegen.h"

#include <stdio.h>
#include <stdlib.h>

/* The source and the header, which the running test owns. Both are empty if nothing is written. */
typedef struct kt_generated_text {
    char *source, *header;
    size_t length; /* of the source */
} kt_generated_text;

static inline kt_status kt_generate_text(const kt_model *model, const char *name, unsigned functions, bool fold,
                                         kt_generated_text *text, kt_error *error) {
    size_t length;
    FILE *source = open_memstream(&text->source, &text->length), *header = open_memstream(&text->header, &length);
    kt_need((source != NULL && header != NULL) || kt_check_true("there is memory", false));
    const kt_status status = kt_codegen_write(model, name, functions, fold, source, header, error);
    fclose(source);
    fclose(header);
    kt_test_own(text->source, free);
    kt_test_own(text->header, free);
    return status;
}

static inline void kt_generated_text_release(kt_generated_text *text) {
    kt_test_release(text->source);
    kt_test_release(text->header);
}

#endif
