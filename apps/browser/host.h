/* The page in which the engine runs. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BROWSER_HOST_H
#define KT_BROWSER_HOST_H

#include "text/bytes.h"

typedef enum kt_host_rank { KT_HOST_FAULT, KT_HOST_NOTE } kt_host_rank;

/* Functions of the page (apps/browser/engine.js): a message, and the time that a run has reached, s. */
#define KT_FROM_PAGE(name) __attribute__((import_module("page"), import_name(#name)))
KT_FROM_PAGE(message) void kt_host_message(int rank, const char *text, size_t size);
KT_FROM_PAGE(progress) void kt_host_progress(double time);

/* Sends a message to the page. */
void kt_host_print(kt_host_rank rank, const char *text);

/* Offers a text as the resource of the next FMU; NULL: none. The text must outlive its use. */
void kt_host_offer(const kt_bytes *text);

#endif
