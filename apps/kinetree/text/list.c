/* Lists of the command line: words, or numbers, with commas between. */
#include "text/list.h"

#include "command.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

char *kt_next_word(char **rest) {
    char *word = *rest;
    if (word == NULL || *word == '\0')
        return NULL;
    char *comma = strchr(word, ',');
    *rest = comma != NULL ? comma + 1 : NULL;
    if (comma != NULL)
        *comma = '\0';
    return word;
}

int kt_list_read(const char *command, const char *name, const char *list, double *numbers, int most) {
    int count = 0;
    for (const char *at = list;; at++) {
        char *end;
        const double number = strtod(at, &end);
        if (end == at || !(isfinite(number) && number > 0.0) || (*end != ',' && *end != '\0')) {
            kt_say("%s: --%s takes numbers above zero with commas between, not '%s'", command, name, list);
            return -1;
        }
        if (count == most) {
            kt_say("%s: --%s: at most %d numbers", command, name, most);
            return -1;
        }
        numbers[count++] = number;
        at = end;
        if (*at == '\0')
            return count;
    }
}
