/* Aligned memory: every address is a multiple of the alignment, for every result of malloc, and each block is released
 * once. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "interpose.h"

#include "base/aligned.h"
#include "base/arena.h"

#include <stdint.h>
#include <string.h>

KT_TEST(memory_of_every_size_is_aligned_and_can_be_written) {
    enum { BLOCKS = 300 };
    unsigned char *block[BLOCKS];
    int misaligned = 0, lost = 0;
    kt_interpose_start();
    for (int i = 0; i < BLOCKS; i++) {
        block[i] = kt_aligned_allocate((size_t)i);
        misaligned += block[i] == NULL || (uintptr_t)block[i] % KT_ARENA_ALIGNMENT != 0;
        memset(block[i], i, (size_t)i);
    }
    for (int i = 0; i < BLOCKS; i++) {
        for (int k = 0; k < i; k++)
            lost += block[i][k] != (unsigned char)i;
        kt_aligned_release(block[i]);
    }
    kt_check_equal_int("allocations", kt_interpose_stop(), BLOCKS);
    kt_check_equal_int("releases", kt_interpose_frees(), BLOCKS);
    kt_check_equal_int("misaligned blocks", misaligned, 0);
    kt_check_equal_int("bytes that another block has overwritten", lost, 0);
}

KT_TEST(a_size_beyond_all_memory_is_rejected) {
    kt_check_true("no block", kt_aligned_allocate(SIZE_MAX) == NULL);
    kt_check_true("no block where only the margin overflows",
                  kt_aligned_allocate(SIZE_MAX - KT_ARENA_ALIGNMENT) == NULL);
    kt_aligned_release(NULL);
}
