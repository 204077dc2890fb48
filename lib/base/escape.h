/* Texts from outside, made fit for a terminal, a picture or a log. */
#ifndef KT_BASE_ESCAPE_H
#define KT_BASE_ESCAPE_H

#include <stddef.h>

/* Writes text to out (size bytes, size > 0, terminated) so that it is UTF-8 and no terminal obeys it: control
 * characters (C0, delete, C1) become \n, \t, \r or \x1b, marks that turn the direction of writing \u202e, and bytes
 * that are no UTF-8 \xff. All else stays, the backslash too: what has been escaped does not change when it is escaped
 * again. Returns the bytes that the whole text takes, without the terminating zero; where that is size or more, out has
 * as many whole characters as fit. out may not overlap text. */
size_t kt_text_escape(const char *text, char *out, size_t size);

#endif
