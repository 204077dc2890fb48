/* Numbers of a block that comes from a file: each is held against its range, also within an array. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/block_words.h"

#include <math.h>
#include <string.h>

#include "check.h"

typedef struct block {
    bool flag;
    int32_t index[3];
    uint64_t count;
    double times[2], any;
} block;

static const kt_block_word words[] = {
    KT_BLOCK_WORD(block, flag, KT_BLOCK_YES_NO),
    KT_BLOCK_WORD(block, index[0], -1.0, 5.0),
    KT_BLOCK_WORD(block, count, KT_BLOCK_COUNT),
    {"index", offsetof(block, index), 12, KT_BLOCK_INT32, -1.0, 5.0},
    {"times", offsetof(block, times), 16, KT_BLOCK_REAL, KT_BLOCK_FINITE},
    KT_BLOCK_WORD(block, any, KT_BLOCK_ANY),
};

/* Checks which word is wrong; NULL: none. The block lies at an odd address. */
static void check_wrong(const block *b, const char *name, double expected) {
    char memory[sizeof *b + 1];
    double value = 0.0;
    memcpy(memory + 1, b, sizeof *b);
    const kt_block_word *wrong = kt_block_find_wrong(memory + 1, words, sizeof words / sizeof *words, &value);
    kt_check_text("word", wrong != NULL ? wrong->name : "", name);
    if (wrong != NULL && !isnan(expected))
        kt_check_near("value", value, expected, 0.0);
}

KT_TEST(the_first_number_out_of_its_range_is_found) {
    const block right = {true, {-1, 0, 5}, 7, {0.0, 1e300}, (double)NAN};
    block b = right;
    const uint8_t two = 2;
    check_wrong(&b, "", 0.0);
    memcpy(&b.flag, &two, 1);
    check_wrong(&b, "flag", 2.0);
    b = right;
    b.index[0] = -2;
    check_wrong(&b, "index[0]", -2.0);
    b = right;
    b.index[2] = 6;
    check_wrong(&b, "index", 6.0);
    b = right;
    b.count = (uint64_t)1 << 60;
    check_wrong(&b, "count", 0x1p60);
    b = right;
    b.times[1] = (double)NAN;
    check_wrong(&b, "times", (double)NAN);
}
