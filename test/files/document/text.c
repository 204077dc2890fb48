/* Characters. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/document_text.h"

#include <string.h>

#include "check.h"

typedef struct sequence {
    const char *bytes;
    size_t length;
    uint32_t character;
} sequence;

/* The first and last of each length, and then sequences that are no UTF-8. These are too long a form, surrogates,
 * values beyond U+10FFFF, a cut sequence, or a continuation without a lead. */
KT_TEST(utf8_is_decoded_strictly) {
    static const sequence table[] = {{"\x01", 1, 1},
                                     {"\x7F", 1, 0x7F},
                                     {"\xC2\x80", 2, 0x80},
                                     {"\xDF\xBF", 2, 0x7FF},
                                     {"\xE0\xA0\x80", 3, 0x800},
                                     {"\xED\x9F\xBF", 3, 0xD7FF},
                                     {"\xEE\x80\x80", 3, 0xE000},
                                     {"\xEF\xBF\xBF", 3, 0xFFFF},
                                     {"\xF0\x90\x80\x80", 4, 0x10000},
                                     {"\xF4\x8F\xBF\xBF", 4, 0x10FFFF},
                                     {"\xC0\x80", 0, 0},
                                     {"\xC1\xBF", 0, 0},
                                     {"\xE0\x9F\xBF", 0, 0},
                                     {"\xED\xA0\x80", 0, 0},
                                     {"\xED\xBF\xBF", 0, 0},
                                     {"\xF0\x8F\xBF\xBF", 0, 0},
                                     {"\xF4\x90\x80\x80", 0, 0},
                                     {"\xF8\x88\x80\x80\x80", 0, 0},
                                     {"\x80", 0, 0},
                                     {"\xC2", 0, 0},
                                     {"\xC2 ", 0, 0},
                                     {"\xE2\x82", 0, 0},
                                     {"\xF0\x9F\x98", 0, 0},
                                     {"\xFF", 0, 0}};
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        uint32_t character = 0;
        size_t offset = 99, size = strlen(table[i].bytes);
        kt_check_equal_int("length", (long long)kt_utf8_decode(table[i].bytes, size, &character),
                           (long long)table[i].length);
        kt_check_equal_int("character", character, table[i].character);
        kt_check_true("the text as a whole",
                      kt_utf8_is_valid(table[i].bytes, size, &offset) == (table[i].length != 0) &&
                          (table[i].length != 0 ? offset == 99 : offset == 0));
    }
}

KT_TEST(characters_of_yaml_are_allowed) {
    static const uint32_t allowed[] = {'\t', '\n',   '\r',   ' ',    '~',     0x85,
                                       0xA0, 0xD7FF, 0xE000, 0xFFFD, 0x10000, 0x10FFFF};
    static const uint32_t rejected[] = {0, 1, 0x1F, 0x7F, 0x80, 0x84, 0x86, 0x9F, 0xFEFF, 0xFFFE, 0xFFFF};
    for (size_t i = 0; i < sizeof allowed / sizeof *allowed; i++)
        kt_check_true("allowed", kt_character_is_allowed(allowed[i]));
    for (size_t i = 0; i < sizeof rejected / sizeof *rejected; i++)
        kt_check_true("rejected", !kt_character_is_allowed(rejected[i]) && !kt_character_is_plain(rejected[i]));
    kt_check_true("line ends do not stand within a line",
                  !kt_character_is_plain('\n') && !kt_character_is_plain(0x85) && !kt_character_is_plain(0x2028));
}

KT_TEST(quotes_are_spared_where_nothing_can_be_mistaken) {
    static const char *const plain[] = {"four-bar linkage", "crank", "a_b-c", "v1.2", "x (y)", "E5",
                                        "3 bars",           "_",     "1a"};
    static const char *const quoted[] = {"",    " a",  "a ",   "a: b",        "a#b",        "yes", "No",
                                         "ON",  "y",   "n",    "null",        "False",      "1",   "1.5",
                                         "1e5", ".5",  "-a",   "1:30",        "2026-01-02", "1_0", "a,b",
                                         "[a",  "a\n", "a\tb", "caf\xC3\xA9", "=",          "~",   "30 deg"};
    for (size_t i = 0; i < sizeof plain / sizeof *plain; i++)
        kt_check_true(plain[i], kt_text_is_plain(plain[i]));
    for (size_t i = 0; i < sizeof quoted / sizeof *quoted; i++)
        kt_check_true(quoted[i], !kt_text_is_plain(quoted[i]));
}
