/* Writes JSON text value by value, without a tree of values before it. This takes a tenth of the time of a tree.
 *
 *     kt_json_writer out = {0};
 *     kt_put_open(&out, NULL, '{');
 *     kt_json_put_number(&out, "mass", 2.0);
 *     kt_put_close(&out, '}');
 *     if (!out.is_short) ... out.text ...
 *     free(out.text);
 *
 * key: the member's name, plain ASCII; NULL within a list, or for the whole. Texts have \u003c for "<", so that nothing
 * in them is markup where the JSON is an element of a page. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_TEXT_JSON_WRITER_H
#define KT_COMMAND_TEXT_JSON_WRITER_H

#include "kinetree/algebra.h"
#include "text/bytes.h"

typedef kt_bytes kt_json_writer;

/* bracket: '{' or '['; '}' or ']'. */
void kt_put_open(kt_json_writer *out, const char *key, char bracket);
void kt_put_close(kt_json_writer *out, char bracket);

/* A text; NULL is null. One that is not valid UTF-8 is escaped (kt_show). */
void kt_put_text(kt_json_writer *out, const char *key, const char *text);
void kt_put_boolean(kt_json_writer *out, const char *key, bool value);
void kt_put_integer(kt_json_writer *out, const char *key, long long n);
/* Writes nine significant digits, which distinguish all numbers of single precision; null if x is not finite. */
void kt_json_put_number(kt_json_writer *out, const char *key, double x);
/* Writes as many digits as read back the same bits; null if x is not finite. */
void kt_put_exact(kt_json_writer *out, const char *key, double x);
void kt_json_put_numbers(kt_json_writer *out, const char *key, const double *x, int count);
void kt_json_put_vector(kt_json_writer *out, const char *key, kt_vec3 u);
void kt_put_null(kt_json_writer *out, const char *key);
/* JSON that was written elsewhere. */
void kt_put_json(kt_json_writer *out, const char *key, const char *json);

#endif
