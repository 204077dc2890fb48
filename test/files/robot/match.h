/* Bodies of models that another program reads, too, are found by their names. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_IMPORT_MATCH_H
#define KT_TEST_IMPORT_MATCH_H

#include "kinetree/kinetree.h"

/* Our names have '_' for characters that names of scenes cannot have. */
static inline bool same_name(const char *ours, const char *theirs) {
    for (; *theirs != '\0' && (*theirs == *ours || *ours == '_'); theirs++)
        ours++;
    return *theirs == '\0' && *ours == '\0';
}

/* -1: none has it. */
static inline int our_body(const kt_model *model, const char *theirs) {
    for (int b = 1; b < kt_model_body_count(model); b++)
        if (*theirs != '\0' && same_name(kt_body_name(model, b), theirs))
            return b;
    return -1;
}

#endif
