/* Models of MJCF as texts. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_MJCF_TEXT_H
#define KT_TEST_ROBOT_MJCF_TEXT_H

#include "check.h"

#include <stdio.h>

#define BALL "<geom size='0.1'/>"
#define WORLD(within) "<mujoco><worldbody>" within "</worldbody></mujoco>"

/* `before`, a part that is repeated, and `after`, which the caller frees; NULL after a failed check. */
static inline char *repeat(const char *before, const char *part, size_t count, const char *after) {
    char *text = NULL;
    size_t size = 0;
    FILE *stream = open_memstream(&text, &size);
    if (!kt_check_true("there is memory", stream != NULL))
        return NULL;
    (void)fputs(before, stream);
    for (size_t i = 0; i < count; i++)
        (void)fputs(part, stream);
    (void)fputs(after, stream);
    kt_check_equal_int("it is written", fclose(stream), 0);
    return text;
}

#endif
