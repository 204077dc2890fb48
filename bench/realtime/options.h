/* The command line of bench/realtime. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_BENCH_REALTIME_OPTIONS_H
#define KT_BENCH_REALTIME_OPTIONS_H

#include <stdbool.h>

typedef struct kt_realtime_options {
    long steps, paced; /* of each scene, free running and paced; paced may be 0: none */
    bool sensors;      /* are read in each step */
    bool markdown;
    const char *csv; /* NULL: none */
} kt_realtime_options;

/* Reads the command line over the values that are in *settings. Returns -1 to go on, or the exit status (after --help,
 * or after a mistake, which it reports). */
int kt_realtime_read(int argc, char **argv, kt_realtime_options *settings);

#endif
