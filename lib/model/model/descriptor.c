/* Queries of descriptors. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/describe.h"

#include <string.h>

const kt_key *kt_descriptor_key(const kt_descriptor *descriptor, const char *name) {
    for (int i = 0; descriptor && name && i < descriptor->key_count; i++)
        if (strcmp(descriptor->keys[i].name, name) == 0)
            return &descriptor->keys[i];
    return NULL;
}

const kt_key *kt_descriptor_kind(const kt_descriptor *descriptor, kt_key_kind kind) {
    for (int i = 0; descriptor != NULL && i < descriptor->key_count; i++)
        if (descriptor->keys[i].kind == kind)
            return &descriptor->keys[i];
    return NULL;
}

bool kt_descriptor_reads(const kt_descriptor *descriptor, size_t offset) {
    for (int i = 0; descriptor != NULL && i < descriptor->key_count; i++)
        if (descriptor->keys[i].offset == offset)
            return true;
    return false;
}

int kt_descriptor_end_count(const kt_descriptor *descriptor) {
    int count = 0;
    for (int i = 0; i < descriptor->key_count; i++) {
        const kt_key_kind kind = descriptor->keys[i].kind;
        count += kind == KT_KEY_ENDS ? 2 : kind == KT_KEY_END || kind == KT_KEY_BODY;
    }
    return count;
}
