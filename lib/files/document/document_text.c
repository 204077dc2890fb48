/* Characters that a scene file may consist of, and texts that need no quotes. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/document_text.h"
#include "base/text.h"

#include "document/number.h"

#include <string.h>

bool kt_character_is_allowed(uint32_t c) {
    if (c < 0x20U)
        return c == '\t' || c == '\n' || c == '\r';
    if (c >= 0x7FU && c < 0xA0U)
        return c == 0x85U;
    return c != 0xFEFFU && c != 0xFFFEU && c != 0xFFFFU;
}

bool kt_character_is_plain(uint32_t c) {
    bool breaks = c == 0x85U || c == 0x2028U || c == 0x2029U; /* line ends to YAML 1.1 */
    return c >= 0x20U && kt_character_is_allowed(c) && !breaks;
}

/* Words that YAML 1.1 reads as booleans; kt_scalar_classify has the words of YAML 1.2. */
static bool is_old_boolean(const char *text) {
    static const char *const words[] = {"y", "yes", "on", "n", "no", "off", "true", "false", "null", NULL};
    return kt_is_word_of(text, words);
}

static bool is_letter_or_digit(char c) { return kt_is_letter(c) || kt_is_digit(c); }

bool kt_text_is_plain(const char *text) {
    double value;
    size_t length = strlen(text);
    if (length == 0 || !is_letter_or_digit(text[0]) || text[length - 1] == ' ' || is_old_boolean(text) ||
        kt_scalar_classify(text, &value) != KT_SCALAR_TEXT)
        return false;
    if (text[0] >= '0' && text[0] <= '9' && text[strspn(text, "0123456789+-_.:eE")] == '\0') /* dates, 1:30, 1_000 */
        return false;
    for (const char *c = text; *c != '\0'; c++)
        if (!is_letter_or_digit(*c) && strchr(" ._-+/()", *c) == NULL)
            return false;
    return true;
}
