/* Lists of the command line: words, or numbers, with commas between. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_TEXT_LIST_H
#define KT_COMMAND_TEXT_LIST_H

#include <stdbool.h>
#include <stddef.h>

/* A word of a list: a part of its text. */
typedef struct kt_word {
    const char *text;
    size_t length;
} kt_word;

/* Takes the next word off a list. Returns false at its end; a list ends with its last word, or with a comma. */
bool kt_word_next(const char **rest, kt_word *word);

/* Copies the next word into `text`, cut off if it is too long; likewise. */
bool kt_list_next(const char **rest, char *text, size_t size);

/* Parses a list of numbers. Returns how many there are, of which the first `most` are stored; -1 if any is none. */
int kt_numbers_read(const char *list, double *numbers, int most);

/* Parses a list of at most `most` positive numbers; errors are reported for option `name` of `command`. Returns the
 * number of numbers, or -1 on errors. */
int kt_list_read(const char *command, const char *name, const char *list, double *numbers, int most);

#endif
