#include "base/decimal.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

static const char *skip_sign(const char *c) { return *c == '+' || *c == '-' ? c + 1 : c; }

static const char *skip_digits(const char *c) { return c + strspn(c, "0123456789"); }

const char *kt_decimal_end(const char *text) {
    const char *const whole = skip_sign(text), *c = skip_digits(whole);
    bool has_digits = c > whole;
    if (*c == '.') {
        const char *const fraction = c + 1;
        c = skip_digits(fraction);
        has_digits = has_digits || c > fraction;
    }
    if (!has_digits)
        return text;
    if (*c == 'e' || *c == 'E') {
        const char *const exponent = skip_sign(c + 1), *const end = skip_digits(exponent);
        c = end > exponent ? end : c;
    }
    return c;
}

bool kt_decimal_read(const char *text, double *value, const char **end) {
    const char *const after = kt_decimal_end(text);
    const double number = after > text ? strtod(text, NULL) : (double)NAN;
    if (!isfinite(number))
        return false;
    *value = number;
    *end = after;
    return true;
}
