/* Names and errors as texts for display. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "command.h"

#include "base/escape.h"

#include <stdio.h>
#include <string.h>

kt_shown kt_show(const char *name) {
    kt_shown shown = {""};
    if (kt_text_escape(name, shown.text, sizeof shown.text) >= sizeof shown.text) {
        size_t end = sizeof shown.text - sizeof "...";
        while (end > 0 && ((unsigned char)shown.text[end] & 0xC0U) == 0x80U)
            end--;
        memcpy(shown.text + end, "...", sizeof "...");
    }
    return shown;
}

kt_error_words kt_words_of(const kt_error *error) {
    kt_error_words words;
    (void)snprintf(words.text, sizeof words.text, "%s%s%s", error->where, error->where[0] != '\0' ? ": " : "",
                   error->message[0] != '\0' ? error->message : kt_status_text(error->code));
    return words;
}
