/* Characters that a scene file may consist of, and texts that need no quotes. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_DOCUMENT_TEXT_H
#define KT_DOCUMENT_DOCUMENT_TEXT_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

/* Writes the first character of text (UTF-8, at least one byte) and returns its length in bytes; 0 if the bytes are not
 * a valid sequence. */
size_t kt_utf8_decode(const char *text, size_t size, uint32_t *character);

/* Whether all of text is UTF-8; *offset is where it is not. O(size). */
bool kt_utf8_is_valid(const char *text, size_t size, size_t *offset);

/* Whether YAML allows a character in a file: no control characters except tab and line ends, no byte order mark
 * within. */
bool kt_character_is_allowed(uint32_t character);

/* Whether a character can be written within a line as itself. */
bool kt_character_is_plain(uint32_t character);

/* Whether a valid text can be written without quotes. Such a text has no indicator of YAML, and is no word or number
 * that YAML 1.1 or 1.2 reads as something else than text. In doubt, the function returns false. */
bool kt_text_is_plain(const char *text);

#endif
