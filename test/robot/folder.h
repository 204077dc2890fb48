/* Files in a folder of a test, which the test removes. */
#ifndef KT_TEST_ROBOT_FOLDER_H
#define KT_TEST_ROBOT_FOLDER_H

#include "check.h"

#include <stdbool.h>
#include <stdio.h>

/* Writes a text to FOLDER/NAME. */
static inline bool put_file(const char *folder, const char *name, const char *text) {
    char path[400];
    (void)snprintf(path, sizeof path, "%s/%s", folder, name);
    FILE *file = fopen(path, "w");
    const bool is_written = file != NULL && fputs(text, file) >= 0;
    return (file != NULL && fclose(file) == 0 && is_written) || kt_check_true(path, false);
}

#endif
