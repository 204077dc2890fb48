/* The C files of `kinetree export --c`. */
#ifndef KT_COMMAND_SUBCOMMANDS_EXPORT_C_H
#define KT_COMMAND_SUBCOMMANDS_EXPORT_C_H

#include "text/arguments.h"

#include <stdbool.h>

typedef struct kt_export_c {
    const char *scene, *functions, *out; /* functions: NULL for the default */
    const kt_settings *settings;
    bool constant;
} kt_export_c;

/* Checks the command line. Returns -1, or an exit code after printing the error. */
int kt_export_c_check(const kt_export_c *c);

/* Reads the scene and writes both files. Returns an exit code. */
int kt_export_c_write(const kt_export_c *c);

#endif
