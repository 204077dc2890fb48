/* Sweeps over the processes of MPI (ranks.c; no_ranks.c in builds without MPI). Rank 0 distributes blocks of runs,
 * receives their results, and writes. The others compute. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SWEEP_RANKS_H
#define KT_COMMAND_SWEEP_RANKS_H

#include "sweep/sweep.h"

#include <stdlib.h>

typedef struct kt_ranks kt_ranks;

/* The processes that mpirun has started; NULL: there is only this one. If mpirun has started several, but the
 * program is built without MPI, each would compute all runs. *code is then an exit code after printing this, else
 * -1. */
kt_ranks *kt_ranks_start(int *code);

/* Returns whether this process is a rank above 0 of several, by the variables of its starter. Rank 0 prints for all. */
bool kt_ranks_is_later(void);
static inline bool kt_ranks_is_above_zero(const char *size, const char *rank) {
    return size != NULL && strtol(size, NULL, 10) > 1 && rank != NULL && strtol(rank, NULL, 10) > 0;
}

/* The number of this one, from 0. */
int kt_ranks_own(const kt_ranks *ranks);

/* Rank 0: as kt_sweep_run_all. */
int kt_ranks_serve(kt_ranks *ranks, const kt_sweep *sweep, int64_t first, int64_t end, kt_sweep_sink *sink, void *user,
                   kt_sweep_worker *all);

/* For the other ranks: computes the blocks of rank 0, each in several threads. */
void kt_ranks_work(kt_ranks *ranks, const kt_sweep *sweep, int threads);

/* The last call of each: rank 0 lets the others go, whether or not they have had anything to do. Returns code.
 * NULL is allowed. */
int kt_ranks_end(kt_ranks *ranks, int code);

#endif
