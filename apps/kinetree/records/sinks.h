/* The uses of each record of a run: rows, pictures, watches and the bar of progress. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_SINKS_H
#define KT_COMMAND_RECORDS_SINKS_H

#include "plot/run.h"
#include "records/checkpoint.h"
#include "view/view.h"

/* Everything that a run collects for its results. */
typedef struct kt_results {
    kt_columns columns;
    kt_csv csv;
    kt_keep keep;      /* records that become HDF5 */
    size_t kept;       /* rows of these */
    kt_plot_run *plot; /* NULL: none */
    kt_motion *motion; /* NULL: none */
} kt_results;

/* Data of the recorder. */
typedef struct kt_sinks {
    kt_results *results;
    kt_progress *progress;
    kt_outcome *outcome;
    kt_mode_watch *modes; /* NULL: none */
    const kt_checkpoint *checkpoint;
    double aside; /* s, CPU time for writing, which does not count as cost of the simulation */
    bool failed;  /* a line could not be written */
    bool pauses;  /* the run pauses for a checkpoint */
} kt_sinks;

/* Takes a record; user: the sinks. Returns 0 to go on, 1 for a checkpoint that is due, and -1 after a failure, which is
 * printed. */
int kt_take_record(const kt_record *record, void *user);

#endif
