/* Options of earlier versions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/options.h"

#include <string.h>

const void *kt_options_read(const kt_options_kind *kind, void *own, const void *given, kt_error *error) {
    size_t size;
    if (given == NULL)
        return own;
    memcpy(&size, given, sizeof size);
    if (size == 0)
        size = kind->first;
    if (size < kind->first || size > kind->now) {
        (void)kt_error_set(error, KT_ERROR_ARGUMENT, "options.size",
                           "%lu: %s has %lu bytes in this library; begin with %s_default, or leave size 0",
                           (unsigned long)size, kind->name, (unsigned long)kind->now, kind->name);
        return NULL;
    }
    if (size == kind->now)
        return given;
    memcpy(own, given, size);
    memcpy(own, &kind->now, sizeof kind->now);
    return own;
}
