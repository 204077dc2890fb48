/* Aligned memory from malloc alone: in some C libraries for bare metal, aligned_alloc does not link. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BASE_ALIGNED_H
#define KT_BASE_ALIGNED_H

#include <stddef.h>

/* Allocates `bytes` at a multiple of KT_ARENA_ALIGNMENT; returns NULL if there is no memory. Only kt_aligned_release
 * may release it. */
void *kt_aligned_allocate(size_t bytes);

/* Releases memory of kt_aligned_allocate; NULL is allowed. */
void kt_aligned_release(void *memory);

#endif
