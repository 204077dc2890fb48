/* The error of a call that needs more memory than there is. */
#ifndef KT_BASE_MEMORY_H
#define KT_BASE_MEMORY_H

#include "kinetree/status.h"

#include <stddef.h>

static inline kt_status kt_reject_memory(kt_error *error) {
    return kt_error_set(error, KT_ERROR_MEMORY, NULL, "there is not enough memory");
}

#endif
