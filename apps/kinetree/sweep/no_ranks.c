/* A program without MPI. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sweep/ranks.h"

kt_ranks *kt_ranks_start(int *code) {
    const char *ranks = getenv("OMPI_COMM_WORLD_SIZE");
    *code = -1;
    if (ranks != NULL && strtol(ranks, NULL, 10) > 1)
        *code = kt_misuse("sweep: this kinetree was built without MPI, and each rank would compute all runs; build it "
                          "with -Dmpi=enabled, or take --shard and --merge");
    return NULL;
}

bool kt_ranks_is_later(void) {
    return kt_ranks_is_above_zero(getenv("OMPI_COMM_WORLD_SIZE"), getenv("OMPI_COMM_WORLD_RANK"));
}

int kt_ranks_own(const kt_ranks *ranks) {
    (void)ranks;
    return 0;
}

int kt_ranks_serve(kt_ranks *ranks, const kt_sweep *sweep, int64_t first, int64_t end, kt_sweep_sink *sink, void *user,
                   kt_sweep_worker *all) {
    (void)ranks;
    return kt_sweep_run_all(sweep, first, end, 1, sink, user, all);
}

void kt_ranks_work(kt_ranks *ranks, const kt_sweep *sweep, int threads) { (void)ranks, (void)sweep, (void)threads; }

int kt_ranks_end(kt_ranks *ranks, int code) {
    (void)ranks;
    return code;
}
