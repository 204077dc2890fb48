/* The error of a call for which the memory does not suffice. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_MEMORY_H
#define KT_BASE_MEMORY_H

#include "kinetree/status.h"

#include <stddef.h>

static inline kt_status kt_reject_memory(kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory");
}

#endif
