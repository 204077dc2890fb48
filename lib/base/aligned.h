/* Aligned memory from malloc alone: aligned_alloc of some C libraries for bare metal does not link. */
#ifndef KT_BASE_ALIGNED_H
#define KT_BASE_ALIGNED_H

#include <stddef.h>

/* `bytes` at a multiple of KT_ALIGNMENT, to be released with kt_aligned_release alone; NULL where there is no memory.
 * */
void *kt_aligned_allocate(size_t bytes);

/* NULL is allowed. */
void kt_aligned_release(void *memory);

#endif
