/* Arguments that a call requires and has not been given. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"

#include <string.h>

void kt_missing_report(kt_error *error, const char *call, const char *conditions, int number) {
    const char *name = conditions;
    while (number-- > 1)
        name = strchr(name, ',') + 1;
    name += strspn(name, " ");
    (void)kt_error_set(error, KT_ERROR_ARGUMENT, call, "'%.*s' is NULL; it must be given", (int)strcspn(name, " ,-.>"),
                       name);
}
