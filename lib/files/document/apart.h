/* Work in a child process: a library that crashes on a damaged file ends the child alone. The child has a limited time
 * and 4 GiB of addresses (KT_LIMITS_ADDRESSES), writes nothing to the standard streams, and answers through a pipe. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_APART_H
#define KT_DOCUMENT_APART_H

#include "kinetree/status.h"

#include <stdbool.h>
#include <stddef.h>
#include <sys/types.h>

/* A sanitizer of addresses reserves terabytes. */
#if defined(__has_feature)
#if __has_feature(address_sanitizer)
#define KT_LIMITS_NO_ADDRESSES 1
#endif
#endif
#if !defined(__SANITIZE_ADDRESS__) && !defined(KT_LIMITS_NO_ADDRESSES)
#define KT_LIMITS_ADDRESSES 1
#endif

/* A child, for its parent. */
typedef struct kt_apart {
    pid_t child;
    int from;        /* the parent's end of the pipe */
    long long until; /* ms of the monotonic clock */
    double seconds;  /* s that the work may take */
} kt_apart;

/* The work of a child process. The function writes its answer with kt_apart_write, and returns whether the whole answer
 * could be written. */
typedef bool kt_apart_work(int to, void *user);

/* Starts a child that calls `work` and ends. kt_apart_end must follow. Errors: KT_ERROR_MEMORY. */
kt_status kt_apart_start(kt_apart *apart, kt_apart_work *work, void *user, double seconds, kt_error *error);

/* In the child: writes all bytes to the pipe, or returns false. */
bool kt_apart_write(int to, const void *data, size_t size);

/* In the child: no file can be opened from now on, so that a file cannot make a library read other files. */
void kt_apart_forbid_files(void);

/* In the parent: reads exactly `size` bytes of the answer. Returns false if the answer ends before, or is late. The
 * caller checks the data, because a child with damaged memory may answer anything. */
bool kt_apart_read(const kt_apart *apart, void *data, size_t size);

/* Ends the child. is_answered: the whole answer was read. Errors: KT_ERROR_SCENE, with the reason, if the answer is
 * incomplete. */
kt_status kt_apart_end(kt_apart *apart, bool is_answered, kt_error *error);

#endif
