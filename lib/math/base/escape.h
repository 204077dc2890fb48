/* Escapes texts from outside the library for terminals, pictures and logs. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_ESCAPE_H
#define KT_BASE_ESCAPE_H

#include <stddef.h>

/* Writes text to out (size bytes, size > 0, terminated) as valid UTF-8 without anything that a terminal would
 * interpret. ASCII control characters become \n, \t, \r or \x1b. Others become \u202e with their own number: C1
 * controls, line separators and characters that change the direction of writing. Bytes that are not UTF-8 become \xff.
 * Everything else is copied, including the backslash. Therefore a second escaping does not change the text.
 * Returns the bytes that the whole text takes, without the terminating zero. If that is size or more, out has as many
 * whole characters as fit. The array out may not overlap text. */
size_t kt_text_escape(const char *text, char *out, size_t size);

#endif
