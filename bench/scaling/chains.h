/* The second table of bench/run loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_CHAINS_H
#define KT_BENCH_CHAINS_H

#include "report.h"

/* Times mechanisms whose loops share bodies, up to sizes that rise with options->max, and prints how all of it grows.
 * Returns an exit status; *trusted becomes false if a figure is not to be trusted. */
int kt_chains_run(const kt_bench_options *options, kt_csv *csv, bool *trusted);

#endif
