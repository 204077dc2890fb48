/* Sweeps over the processes of MPI (ranks.c; no_ranks.c where the program is built without): rank 0 hands out blocks of runs,
 * receives what they give, and writes; the others compute. */
#ifndef KT_COMMAND_SWEEP_RANKS_H
#define KT_COMMAND_SWEEP_RANKS_H

#include "sweep/sweep.h"

typedef struct kt_ranks kt_ranks;

/* The processes that mpirun has started; NULL: there is only this one. If mpirun has started several and the program is built
 * without MPI, each would do the whole: *code is then an exit code, after printing that; else -1. */
kt_ranks *kt_ranks_start(int *code);

/* The number of this one, from 0. */
int kt_ranks_own(const kt_ranks *ranks);

/* Rank 0: as kt_sweep_run_all. */
int kt_ranks_serve(kt_ranks *ranks, const kt_sweep *sweep, int64_t first, int64_t end, kt_sweep_sink *sink, void *user,
                   kt_sweep_worker *all);

/* The others: compute what rank 0 hands out, each by so many threads. */
void kt_ranks_work(kt_ranks *ranks, const kt_sweep *sweep, int threads);

/* The last call of each: rank 0 lets the others go, whether or not they have had anything to do. Returns code. NULL is allowed. */
int kt_ranks_end(kt_ranks *ranks, int code);

#endif
