/* Man pages and shell completions, as written by 'kinetree help'. */
#ifndef KT_COMMAND_TEXT_REFERENCE_H
#define KT_COMMAND_TEXT_REFERENCE_H

#include "command.h"

/* The source of the help, the man pages and the completions: all subcommands, and texts about the whole command. */
typedef struct kt_overview {
    const char *summary;     /* one line without a full stop */
    const char *examples;    /* lines */
    const char *exit_status; /* lines */
    const kt_subcommand *subcommands;
    size_t count;
} kt_overview;

/* Prints a man page on standard output; subcommand: NULL for the page of the whole command. */
void kt_man_print(const kt_overview *overview, const kt_subcommand *subcommand);

/* Prints a completion script on standard output; shell: index in KT_SHELLS, from 0. */
#define KT_SHELLS "bash|zsh|fish"
void kt_completion_print(const kt_overview *all, int shell);

#endif
