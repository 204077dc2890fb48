/* Decodes UTF-8. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/document_text.h"

size_t kt_utf8_decode(const char *text, size_t size, uint32_t *character) {
    static const uint32_t least[] = {0, 0, 0x80, 0x800,
                                     0x10000}; /* by length: a longer form than needed is not valid */
    unsigned char lead = (unsigned char)text[0];
    size_t length = lead < 0x80U ? 1 : lead < 0xC0U ? 0 : lead < 0xE0U ? 2 : lead < 0xF0U ? 3 : lead < 0xF8U ? 4 : 0;
    if (length == 0 || length > size)
        return 0;
    uint32_t c = length == 1 ? lead : lead & (0xFFU >> (length + 1));
    for (size_t i = 1; i < length; i++) {
        unsigned char next = (unsigned char)text[i];
        if ((next & 0xC0U) != 0x80U)
            return 0;
        c = c << 6 | (next & 0x3FU);
    }
    if (c < least[length] || c > 0x10FFFFU || (c >= 0xD800U && c <= 0xDFFFU))
        return 0;
    *character = c;
    return length;
}

bool kt_utf8_is_valid(const char *text, size_t size, size_t *offset) {
    uint32_t character;
    for (size_t i = 0; i < size;) {
        size_t length = kt_utf8_decode(text + i, size - i, &character);
        if (length == 0) {
            *offset = i;
            return false;
        }
        i += length;
    }
    return true;
}
