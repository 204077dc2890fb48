/* Lists of the command line: words, or numbers, with commas between. */
#ifndef KT_COMMAND_TEXT_LIST_H
#define KT_COMMAND_TEXT_LIST_H

/* Cuts the next word off a comma-separated list; NULL at its end. */
char *kt_next_word(char **rest);

/* Parses a list of numbers. Returns how many there are, of which the first `most` are stored; -1 if any is none. */
int kt_numbers_read(const char *list, double *numbers, int most);

/* Parses a list of at most `most` positive numbers; errors are reported for option `name` of `command`. Returns the
 * number of numbers, or -1 on errors. */
int kt_list_read(const char *command, const char *name, const char *list, double *numbers, int most);

#endif
