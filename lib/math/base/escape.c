/* Escaping: the text is decoded as UTF-8, and every character is classified. Overlong forms and surrogates are not
 * UTF-8 (Unicode 15, table 3-7). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/escape.h"

#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

/* Decodes the character at the start of a text and returns its number of bytes, or 0 if the bytes are not valid
 * UTF-8. */
static int decode(const unsigned char *text, uint32_t *character) {
    const int more = text[0] < 0x80U                       ? 0
                     : text[0] >= 0xC2U && text[0] < 0xE0U ? 1
                     : text[0] >= 0xE0U && text[0] < 0xF0U ? 2
                     : text[0] >= 0xF0U && text[0] < 0xF5U ? 3
                                                           : -1;
    static const uint32_t least[] = {0, 0x80, 0x800, 0x10000};
    if (more < 0)
        return 0;
    *character = more == 0 ? text[0] : text[0] & (0x3FU >> more);
    for (int i = 1; i <= more; i++) {
        if ((text[i] & 0xC0U) != 0x80U) /* rejects the terminating zero, too */
            return 0;
        *character = *character << 6 | (text[i] & 0x3FU);
    }
    const bool is_right =
        *character >= least[more] && *character <= 0x10FFFFU && (*character < 0xD800U || *character > 0xDFFFU);
    return is_right ? 1 + more : 0;
}

static bool is_control(uint32_t c) { return c < 0x20U || (c >= 0x7FU && c < 0xA0U); }

/* Line and paragraph separators, and characters that change the direction of writing. */
static bool turns_text(uint32_t c) {
    return c == 0x200EU || c == 0x200FU || (c >= 0x2028U && c <= 0x202EU) || (c >= 0x2066U && c <= 0x2069U);
}

size_t kt_text_escape(const char *text, char *out, size_t size) {
    size_t length = 0, kept = 0;
    while (*text != '\0') {
        char unit[12]; /* "\\uXXXX", or a character of up to four bytes */
        uint32_t c = 0;
        const int bytes = decode((const unsigned char *)text, &c);
        if (bytes == 0 || (is_control(c) && c < 0x80U && c != '\n' && c != '\t' && c != '\r'))
            (void)snprintf(unit, sizeof unit, "\\x%02x", (unsigned)(unsigned char)*text);
        else if (is_control(c) && c < 0x80U)
            (void)snprintf(unit, sizeof unit, "\\%c", c == '\n' ? 'n' : c == '\t' ? 't' : 'r');
        else if (is_control(c) || turns_text(c))
            (void)snprintf(unit, sizeof unit, "\\u%04x", (unsigned)c);
        else {
            memcpy(unit, text, (size_t)bytes);
            unit[bytes] = '\0';
        }
        const size_t more = strlen(unit);
        if (length == kept && length + more < size) {
            memcpy(out + kept, unit, more);
            kept += more;
        }
        length += more;
        text += bytes > 0 ? bytes : 1;
    }
    out[kept] = '\0';
    return length;
}
