/* Seventeen significant digits of a number, by integers.
 *
 * A number is m 2^e with m < 2^53. Its digits are those of
 *
 *     N = m 2^e 10^k = (m 5^k) 2^(e+k),     10^16 <= N < 10^17,
 *
 * rounded to the nearest integer, and to even between two of them. For 0 <= k <= 27 the product m 5^k has at most 116
 * bits, so that its bits below 2^-(e+k) are exact: they decide the rounding. Other numbers are left to snprintf.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/digits.h"

#include <math.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <string.h>

enum { DIGITS = 17, POWER_MOST = 27 };

static const uint64_t least = 10000000000000000U; /* 10^16, the least number with so many digits */

/* ---- integers ---------------------------------------------------------------------------------------------------- */

/* high 2^64 + low */
typedef struct wide {
    uint64_t high, low;
} wide;

static wide multiply_wide(uint64_t a, uint64_t b) {
    static const uint64_t mask = 0xffffffffU;
    const uint64_t low = (a & mask) * (b & mask), first = (a >> 32U) * (b & mask) + (low >> 32U);
    const uint64_t second = (a & mask) * (b >> 32U) + (first & mask);
    return (wide){(a >> 32U) * (b >> 32U) + (first >> 32U) + (second >> 32U), (second << 32U) | (low & mask)};
}

static uint64_t power_of_five(int k) {
    uint64_t power = 1, factor = 5;
    for (; k > 0; k /= 2) {
        power = k % 2 != 0 ? power * factor : power;
        factor *= factor;
    }
    return power;
}

/* The integer part of p / 2^shift. Returns false if it is too large. *above: the remainder against a half, -1, 0, 1. */
static bool divide_wide(wide p, int shift, uint64_t *part, int *above) {
    *above = -1;
    if (shift <= 0 && shift > -64) {
        *part = p.low << (unsigned)-shift;
        return p.high == 0 && *part >> (unsigned)-shift == p.low;
    }
    if (shift <= 0 || shift > 63 || p.high >> (unsigned)shift != 0)
        return false;
    const uint64_t rest = p.low & (((uint64_t)1 << (unsigned)shift) - 1), half = (uint64_t)1 << (unsigned)(shift - 1);
    *part = (p.high << (unsigned)(64 - shift)) | (p.low >> (unsigned)shift);
    *above = (rest > half) - (rest < half);
    return true;
}

/* ---- digits ------------------------------------------------------------------------------------------------------ */

/* The digits of a positive number as an integer, which times 10^(*exponent - 16) is the number. Returns false if the
 * number is left to snprintf. */
static bool find_digits(double value, uint64_t *digits, int *exponent) {
    int e;
    const uint64_t m = (uint64_t)ldexp(frexp(value, &e), 53);
    *exponent = (int)floor((e - 1) * 0.30102999566398120); /* log10(2): at most one too small */
    for (int attempt = 0; attempt < 2; attempt++, ++*exponent) {
        const int k = DIGITS - 1 - *exponent;
        int above;
        if (k < 0 || k > POWER_MOST || !divide_wide(multiply_wide(m, power_of_five(k)), 53 - e - k, digits, &above))
            return false;
        if (*digits >= 10 * least)
            continue;
        *digits += above > 0 || (above == 0 && *digits % 2 != 0);
        if (*digits == 10 * least) {
            *digits = least;
            ++*exponent;
        }
        return *digits >= least;
    }
    return false;
}

/* Writes the digits without the zeros behind them; returns how many. */
static int write_digits(char text[DIGITS], uint64_t digits) {
    int count = DIGITS;
    uint32_t part[2] = {(uint32_t)(digits / 100000000U), (uint32_t)(digits % 100000000U)};
    for (int i = DIGITS - 1; i >= 0; i--) {
        uint32_t *from = &part[i > DIGITS - 9];
        text[i] = (char)('0' + *from % 10U);
        *from /= 10U;
    }
    while (count > 1 && text[count - 1] == '0')
        count--;
    return count;
}

/* ---- text -------------------------------------------------------------------------------------------------------- */

static char *add_bytes(char *to, const char *from, int count) {
    memcpy(to, from, (size_t)count);
    return to + count;
}

static char *add_zeros(char *to, int count) {
    memset(to, '0', (size_t)count);
    return to + count;
}

/* 1.25e-07 */
static char *add_scientific(char *to, const char *digits, int count, int exponent) {
    to = add_bytes(to, digits, 1);
    if (count > 1) {
        *to++ = '.';
        to = add_bytes(to, digits + 1, count - 1);
    }
    to = add_bytes(to, "e-", 2);
    *to++ = (char)('0' + -exponent / 10);
    *to++ = (char)('0' + -exponent % 10);
    return to;
}

/* 125, 1.25 or 0.00125 */
static char *add_fixed(char *to, const char *digits, int count, int exponent) {
    const int whole = exponent + 1;
    if (whole <= 0)
        return add_bytes(add_zeros(add_bytes(to, "0.", 2), -whole), digits, count);
    if (count <= whole)
        return add_zeros(add_bytes(to, digits, count), whole - count);
    to = add_bytes(to, digits, whole);
    *to++ = '.';
    return add_bytes(to, digits + whole, count - whole);
}

int kt_digits_write(char *to, double value) {
    char text[DIGITS], *end = to;
    uint64_t digits;
    int exponent;
    if (signbit(value))
        *end++ = '-';
    if (value == 0.0) {
        *end++ = '0';
    } else if (isfinite(value) && find_digits(fabs(value), &digits, &exponent)) {
        const int count = write_digits(text, digits);
        end = exponent < -4 ? add_scientific(end, text, count, exponent) : add_fixed(end, text, count, exponent);
    } else {
        return snprintf(to, KT_DIGITS_SIZE, "%.17g", value);
    }
    *end = '\0';
    return (int)(end - to);
}
