/* Parts of a sweep (--shard), and how they are put together (--merge). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SWEEP_MERGE_H
#define KT_COMMAND_SWEEP_MERGE_H

#include "sweep/sweep.h"

/* The runs of a part, and which sweep they belong to: FILE.shard next to the lines. */
typedef struct kt_sweep_shard {
    uint64_t sweep;           /* kt_sweep_sum */
    int64_t runs, first, end; /* the number of all runs; the part has first, first + 1, ... before end */
} kt_sweep_shard;

/* Returns a checksum of the scene, its settings and the plan. */
uint64_t kt_sweep_sum(const kt_sweep *sweep);

/* Writes FILE.shard. Does nothing for standard output and devices. Returns KT_EXIT_DONE, or an exit code after printing
 * the error. */
int kt_sweep_shard_write(const char *out, const kt_sweep_shard *shard);
/* Removes FILE.shard of an earlier sweep. */
void kt_sweep_shard_remove(const char *out);

/* Prints the reason why lines with two different headers do not belong together, and the remedy. */
void kt_sweep_say_columns(const char *name, const char *than, const char *remedy);

/* Puts parts together in --out. Returns an exit code: KT_EXIT_INTEGRATION if runs are missing, though --out is
 * written. */
int kt_sweep_merge(const kt_sweep_arguments *arguments, char **names, int count);

#endif
