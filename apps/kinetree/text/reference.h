/* Man pages, shell completions and the pages of types, as written by 'kinetree help'; the tree of a model as text. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_TEXT_REFERENCE_H
#define KT_COMMAND_TEXT_REFERENCE_H

#include "base/names.h"
#include "command.h"
#include "kinetree/model.h"

#include <stdbool.h>

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

/* Prints the tree on standard output, abridged to about a hundred lines. Returns 0, or -1 if memory is insufficient. */
int kt_tree_draw(const kt_model *model);

/* Prints everything about the types of this name (a joint and a loop may share one) for a terminal. Returns false if
 * there is none. */
bool kt_types_print(const char *name);

/* Compares a name with those of all types. */
void kt_types_try(kt_nearest *nearest);

/* Prints the page of all types in Markdown. */
void kt_types_print_page(void);

#endif
