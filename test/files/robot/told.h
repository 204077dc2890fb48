/* What an export reports, as lines of text. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_ROBOT_TOLD_H
#define KT_TEST_ROBOT_TOLD_H

#include <stdio.h>
#include <string.h>

typedef struct told {
    char text[2000];
} told;

static inline void hear(void *user, const char *what, int count) {
    told *t = user;
    const size_t length = strlen(t->text);
    (void)snprintf(t->text + length, sizeof t->text - length, "%s %d\n", what, count);
}

#endif
