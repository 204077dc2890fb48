/* The emitter alone: requests that no right scene makes are rejected once, with a message. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/emit.h"

#include <math.h>
#include <stdlib.h>

#include "check.h"

KT_TEST(first_rejection_is_the_one_that_counts) {
    kt_emitter e = {0};
    kt_emit_number(&e, (double)NAN);
    kt_check_equal_int("code", e.fault.code, KT_ERROR_NOT_FINITE);
    kt_check_text("message", e.fault.message, "a number is nan; a scene file has finite numbers");
    kt_emit_text(&e, "\xFF");
    kt_check_equal_int("code", e.fault.code, KT_ERROR_NOT_FINITE);
    kt_check_text("message", e.fault.message, "a number is nan; a scene file has finite numbers");
}

KT_TEST(levels_are_counted) {
    kt_emitter e = {0};
    for (int i = 0; i < 16; i++)
        kt_emit_list(&e, i % 2 == 1 ? KT_EMIT_FLOW : KT_EMIT_BLOCK);
    kt_check_equal_int("fault of as many levels as there may be", e.fault.code, KT_OK);
    kt_emit_map(&e, KT_EMIT_BLOCK);
    kt_check_equal_int("fault of one more", e.fault.code, KT_ERROR_ARGUMENT);
    kt_check_text("message", e.fault.message, "the scene is nested too deeply");
    kt_check_equal_int("levels", e.depth, 16);
    for (int i = 0; i <= 16; i++)
        kt_emit_end(&e);
    kt_check_equal_int("levels after an end of each, the rejected one too", e.depth, 0);
}

/* Characters beyond the first 65536 are written unchanged; a control character within them is written by its number. */
KT_TEST(only_what_cannot_be_seen_is_escaped) {
    char *text = NULL;
    size_t size = 0;
    kt_emitter e = {.stream = open_memstream(&text, &size)};
    kt_need(kt_check_true("a stream", e.stream != NULL));
    kt_emit_map(&e, KT_EMIT_FLOW);
    kt_emit_key(&e, "a");
    kt_emit_text(&e, "\xF0\x9F\x94\xA7\xE2\x80\xA8\"\\\n\t\x01");
    kt_emit_end(&e);
    (void)fclose(e.stream);
    kt_check_text("written", text, "{a: \"\xF0\x9F\x94\xA7\\u2028\\\"\\\\\\n\\t\\u0001\"}\n");
    free(text);
}
