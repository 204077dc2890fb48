/* Escaping of texts from outside. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/escape.h"
#include "check.h"
#include "kinetree/status.h"

#include <string.h>

KT_TEST(what_terminals_obey_is_escaped) {
    static const struct {
        const char *text, *shown;
    } cases[] = {{"four-bar, 60\xc2\xb0 \xe2\x86\x92 \xf0\x9f\x90\x8d \\n",
                  "four-bar, 60\xc2\xb0 \xe2\x86\x92 \xf0\x9f\x90\x8d \\n"},
                 {"a\x1b[31mb\x07", "a\\x1b[31mb\\x07"},
                 {"a\nb\tc\rd\x7f", "a\\nb\\tc\\rd\\x7f"},
                 {"\xc2\x9b"
                  "31m",
                  "\\u009b31m"}, /* the C1 control sequence introducer */
                 {"\xe2\x80\xae"
                  "abc",
                  "\\u202eabc"},              /* right to left */
                 {"\xe2\x80\xa8", "\\u2028"}, /* line separator */
                 {"\xff"
                  "a\x80",
                  "\\xffa\\x80"},                              /* no beginning of a character */
                 {"\xc0\xaf", "\\xc0\\xaf"},                   /* overlong */
                 {"\xe0\x80\xaf", "\\xe0\\x80\\xaf"},          /* overlong */
                 {"\xed\xa0\x80", "\\xed\\xa0\\x80"},          /* a surrogate */
                 {"\xf4\x90\x80\x80", "\\xf4\\x90\\x80\\x80"}, /* above the last */
                 {"\xe2\x86", "\\xe2\\x86"},                   /* cut */
                 {"", ""}};
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        char shown[64], again[64];
        const size_t length = kt_text_escape(cases[i].text, shown, sizeof shown);
        kt_check_text("shown", shown, cases[i].shown);
        kt_check_equal_int("length", (long long)length, (long long)strlen(cases[i].shown));
        (void)kt_text_escape(shown, again, sizeof again);
        kt_check_text("twice", again, shown);
    }
}

KT_TEST(escaped_text_is_cut_between_characters) {
    char shown[16];
    memset(shown, '#', sizeof shown);
    kt_check_equal_int("whole",
                       (long long)kt_text_escape("ab\x1b"
                                                 "cd",
                                                 shown, 6),
                       8);
    kt_check_text("the escape does not fit", shown, "ab");
    kt_check_equal_int("whole",
                       (long long)kt_text_escape("ab\x1b"
                                                 "cd",
                                                 shown, 7),
                       8);
    kt_check_text("the escape fits", shown, "ab\\x1b");
    kt_check_equal_int("beyond is not written", shown[8], '#');
    (void)kt_text_escape("abc", shown, 1);
    kt_check_text("no room", shown, "");
}

KT_TEST(errors_have_no_control_characters) {
    kt_error error;
    (void)kt_error_set(&error, KT_ERROR_SCENE, "a\x1b.yaml:1:1", "key '%s'", "\x1b]0;title\x07");
    kt_check_text("where", error.where, "a\\x1b.yaml:1:1");
    kt_check_text("message", error.message, "key '\\x1b]0;title\\x07'");
    char longest[2 * KT_MESSAGE_SIZE];
    memset(longest, '\x1b', sizeof longest);
    longest[KT_MESSAGE_SIZE - 100] = '\0';
    (void)kt_error_set(&error, KT_ERROR_SCENE, longest, "%s", longest);
    kt_check_contains("cut", error.message, "\\x1b...");
    kt_check_below("length", (double)strlen(error.message), KT_MESSAGE_SIZE - 1);
    kt_check_contains("cut", error.where, "...");
}
