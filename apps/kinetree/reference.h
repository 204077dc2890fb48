/* What 'kinetree help' writes beside help: man pages and completions for shells. */
#ifndef KT_COMMAND_REFERENCE_H
#define KT_COMMAND_REFERENCE_H

#include "command.h"

/* What the help and the man page of the whole command share. */
typedef struct kt_overview {
    const char *summary;     /* one line without a full stop */
    const char *examples;    /* lines */
    const char *exit_status; /* lines */
} kt_overview;

/* A man page on standard output; subcommand: NULL for that of the whole command. */
void kt_man_print(const kt_overview *overview, const kt_subcommand *subcommand);

/* A completion script on standard output; shell: as in KT_SHELLS, from 0. */
#define KT_SHELLS "bash|zsh|fish"
void kt_completion_print(int shell);

#endif
