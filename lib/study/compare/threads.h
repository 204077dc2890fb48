/* Items of work by several threads, for the files of this folder. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_STUDY_THREADS_H
#define KT_STUDY_THREADS_H

#include "kinetree/status.h"

#include <stddef.h>

enum { KT_THREADS_MOST = 256 };

/* Computes item number `item`, by thread number `thread`: no two at once have the same number. */
typedef kt_status kt_threads_call(void *user, size_t thread, size_t item, kt_error *error);

/* Computes `count` items with `threads` threads (1 to KT_THREADS_MOST), including the calling thread. Each takes the
 * next item that no thread has taken. Returns the error of the first item that failed; all other items are computed,
 * too. If `used` is not NULL, *used becomes the number of threads, which is below the requested number if the system
 * does not start more. */
kt_status kt_threads_share(size_t count, size_t threads, kt_threads_call *call, void *user, size_t *used,
                           kt_error *error);

#endif
