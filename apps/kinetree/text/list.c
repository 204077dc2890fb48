/* Lists of the command line: words, or numbers, with commas between. */
#include "text/list.h"

#include "base/decimal.h"
#include "command.h"

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

int kt_numbers_read(const char *list, double *numbers, int most) {
    int count = 0;
    for (const char *at = list;; at++) {
        double number;
        if (!kt_decimal_read(at, &number, &at) || (*at != ',' && *at != '\0'))
            return -1;
        if (count < most)
            numbers[count] = number;
        count++;
        if (*at == '\0')
            return count;
    }
}

int kt_list_read(const char *command, const char *name, const char *list, double *numbers, int most) {
    const int count = kt_numbers_read(list, numbers, most);
    bool fine = count >= 0;
    for (int i = 0; i < count && i < most; i++)
        fine = fine && numbers[i] > 0.0;
    if (fine && count <= most)
        return count;
    if (fine)
        kt_say("%s: --%s: at most %d numbers", command, name, most);
    else
        kt_say("%s: --%s takes numbers above zero with commas between, not '%s'", command, name, list);
    return -1;
}
