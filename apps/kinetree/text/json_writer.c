/* Writes JSON text value by value. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/json_writer.h"

#include "command.h"
#include "document/document_text.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- the text ---------------------------------------------------------------------------------------------------- */

/* A comma between members, and the name of this one. */
static void put_key(kt_json_writer *out, const char *key) {
    const char last = out->used > 0 ? out->text[out->used - 1] : '[';
    if (last != '{' && last != '[')
        kt_bytes_add(out, ",", 1);
    if (key != NULL) {
        kt_bytes_add(out, "\"", 1);
        kt_bytes_add(out, key, strlen(key));
        kt_bytes_add(out, "\":", 2);
    }
}

void kt_put_open(kt_json_writer *out, const char *key, char bracket) {
    put_key(out, key);
    kt_bytes_add(out, &bracket, 1);
}

void kt_put_close(kt_json_writer *out, char bracket) { kt_bytes_add(out, &bracket, 1); }

/* ---- texts ------------------------------------------------------------------------------------------------------- */

/* "<" occurs within texts alone. */
void kt_put_json(kt_json_writer *out, const char *key, const char *json) {
    put_key(out, key);
    for (const char *less; (less = strchr(json, '<')) != NULL; json = less + 1) {
        kt_bytes_add(out, json, (size_t)(less - json));
        kt_bytes_add(out, "\\u003c", 6);
    }
    kt_bytes_add(out, json, strlen(json));
}

/* Writes a character within a text; bytes beyond ASCII are parts of UTF-8. */
static void put_character(kt_json_writer *out, char c) {
    static const char controls[] = "\b\f\n\r\t", letters[] = "bfnrt";
    const char *control = c != '\0' ? strchr(controls, c) : NULL;
    if (control != NULL)
        kt_bytes_print(out, "\\%c", letters[control - controls]);
    else if ((unsigned char)c < ' ' || c == '<')
        kt_bytes_print(out, "\\u%04x", (unsigned)c);
    else if (c == '"' || c == '\\')
        kt_bytes_print(out, "\\%c", c);
    else
        kt_bytes_add(out, &c, 1);
}

void kt_put_text(kt_json_writer *out, const char *key, const char *text) {
    size_t offset;
    if (text == NULL) {
        kt_put_null(out, key);
        return;
    }
    kt_shown shown = {""};
    if (!kt_utf8_is_valid(text, strlen(text), &offset))
        shown = kt_show(text);
    put_key(out, key);
    kt_bytes_add(out, "\"", 1);
    for (const char *c = shown.text[0] != '\0' ? shown.text : text; *c != '\0'; c++)
        put_character(out, *c);
    kt_bytes_add(out, "\"", 1);
}

/* ---- numbers ----------------------------------------------------------------------------------------------------- */

void kt_put_null(kt_json_writer *out, const char *key) {
    put_key(out, key);
    kt_bytes_add(out, "null", 4);
}

void kt_put_boolean(kt_json_writer *out, const char *key, bool value) {
    put_key(out, key);
    kt_bytes_add(out, value ? "true" : "false", value ? 4 : 5);
}

/* Writes n / 10^decimals, with a digit before the point at least. Returns the length. */
static size_t print_fixed(char *to, unsigned long long n, int decimals) {
    char digits[24];
    int count = 0;
    size_t used = 0;
    while (decimals > 0 && n % 10 == 0) {
        n /= 10;
        decimals--;
    }
    do {
        digits[count++] = (char)('0' + n % 10);
        n /= 10;
    } while (n > 0 || count <= decimals);
    while (count > 0) {
        to[used++] = digits[--count];
        if (count == decimals && count > 0)
            to[used++] = '.';
    }
    return used;
}

void kt_put_integer(kt_json_writer *out, const char *key, long long n) {
    char text[24] = "-";
    const size_t sign = n < 0 ? 1 : 0;
    put_key(out, key);
    kt_bytes_add(out, text,
                 sign + print_fixed(text + sign, sign != 0 ? 0ULL - (unsigned long long)n : (unsigned long long)n, 0));
}

/* Writes whole numbers, and numbers of everyday size with nine digits. For the latter, x 10^d has nine digits before
 * the decimal point, d being the number of decimals. Its relative error is 2^-53, so the nine digits are right except
 * for ties. The C library prints other numbers. */
void kt_json_put_number(kt_json_writer *out, const char *key, double x) {
    const double size = fabs(x);
    if (!isfinite(x)) {
        kt_put_null(out, key);
        return;
    }
    if (size < 1e9 && x == floor(x)) {
        kt_put_integer(out, key, (long long)x);
        return;
    }
    char text[40] = "-";
    size_t length = x < 0.0 ? 1 : 0;
    if (size < 1e-5 || size >= 1e9) {
        length = (size_t)snprintf(text, sizeof text, "%.9g", x);
    } else {
        double power = 1.0;
        int decimals = 0;
        while (size * power < 1e8) {
            power *= 10.0;
            decimals++;
        }
        length += print_fixed(text + length, (unsigned long long)(size * power + 0.5), decimals);
    }
    put_key(out, key);
    kt_bytes_add(out, text, length);
}

void kt_put_exact(kt_json_writer *out, const char *key, double x) {
    if (!isfinite(x)) {
        kt_put_null(out, key);
        return;
    }
    put_key(out, key);
    kt_bytes_print(out, "%.17g", x);
}

void kt_json_put_numbers(kt_json_writer *out, const char *key, const double *x, int count) {
    kt_put_open(out, key, '[');
    for (int i = 0; i < count; i++)
        kt_json_put_number(out, NULL, x[i]);
    kt_put_close(out, ']');
}

void kt_json_put_vector(kt_json_writer *out, const char *key, kt_vec3 u) {
    const double x[] = {u.x, u.y, u.z};
    kt_json_put_numbers(out, key, x, 3);
}
