/* Steps of a batch, compared with those of MuJoCo. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_BATCH_PEER_H
#define KT_BENCH_BATCH_PEER_H

#include "../report.h"

/* Prints and notes rk4 steps a second of one core: of a batch of `states` humanoids, and of one in MuJoCo, without
 * contact. Returns an exit status. */
int kt_measure_peer(size_t states, const kt_bench_options *options, kt_csv *csv);

#endif
