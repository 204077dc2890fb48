/* Lists of the command line: words, or numbers, with commas between. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/list.h"

#include "base/decimal.h"
#include "command.h"

#include <stdio.h>
#include <string.h>

bool kt_word_next(const char **rest, kt_word *word) {
    const char *text = *rest;
    if (text == NULL || *text == '\0')
        return false;
    *word = (kt_word){text, strcspn(text, ",")};
    *rest = text[word->length] == ',' ? text + word->length + 1 : NULL;
    return true;
}

bool kt_list_next(const char **rest, char *text, size_t size) {
    kt_word word;
    const bool is_there = kt_word_next(rest, &word);
    if (is_there)
        (void)snprintf(text, size, "%.*s", (int)word.length, word.text);
    return is_there;
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
