/* Counts the allocations of a program, whichever library makes them, and can make one fail.
 *
 *     kt_interpose_start();
 *     ... code that must not allocate ...
 *     kt_check_equal_int("allocations", kt_interpose_stop(), 0);
 *
 * For a test program with 'interpose': true in its entry (see meson.build). Not for several threads.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_INTERPOSE_H
#define KT_TEST_INTERPOSE_H

/* Counts from zero. */
void kt_interpose_start(void);

/* As kt_interpose_start, and the n-th allocation from now (1 is the next) returns NULL, alone. 0: none fails. */
void kt_interpose_start_failing(long n);

/* Ends the count: malloc, calloc, realloc, aligned_alloc, posix_memalign together. */
long kt_interpose_stop(void);

/* Calls of free (not of free(NULL)) in the last count. */
long kt_interpose_frees(void);

/* Whether the n-th allocation of the last count was reached and made to fail: when it was not, all are tried. */
int kt_interpose_has_failed(void);

#endif
