/* A run's checkpoint file: a run that was interrupted continues from it with the same results as without
 * interruption. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_RECORDS_CHECKPOINT_H
#define KT_COMMAND_RECORDS_CHECKPOINT_H

#include "subcommands/run.h"

/* The file of a run's checkpoints, and how often it is written. */
typedef struct kt_checkpoint {
    const char *path;     /* NULL: none are written */
    char *file;           /* the file itself, behind symbolic links; NULL: none */
    char *new_path;       /* FILE.new, which becomes `file` when it is complete; NULL: none */
    int lock;             /* descriptor of `file`, or of `new_path` before the first checkpoint; -1: none */
    bool has_file;        /* the lock is on `file` */
    bool is_lost;         /* a checkpoint could not be written, which is reported once */
    bool is_written;      /* the run has written a checkpoint, */
    double time;          /* the last one at this time of the motion, s */
    double interval;      /* s between two checkpoints, measured by kt_clock */
    double last;          /* s, value of kt_clock when the last one was written */
    uint64_t scene;       /* fingerprint of the scene */
    uint64_t run;         /* fingerprint of the scene with the options of the command line applied */
    char words[160];      /* options of the command line, for messages */
    kt_written records;   /* up to the last checkpoint */
    kt_mode_watch *modes; /* NULL: none */
    void *block;          /* the simulation's state, then that of `modes` */
    size_t size, mode_size;
} kt_checkpoint;

/* Locks the file, computes the fingerprints, and allocates the memory for a checkpoint. A new file gets its name with
 * the first checkpoint. The path may be NULL (only to resume). The run's watch on fast modes, `modes`, may be NULL.
 * Returns -1 on success, else an exit code after printing the error. An error is reported if another run writes its
 * checkpoints there. A call of kt_checkpoint_close must follow in any case. */
int kt_checkpoint_open(kt_checkpoint *checkpoint, const char *path, double interval, const kt_outcome *outcome,
                       const kt_simulation_options *options, kt_mode_watch *modes);
void kt_checkpoint_close(kt_checkpoint *checkpoint);

/* Returns whether the interval since the last checkpoint has elapsed. */
bool kt_checkpoint_is_due(const kt_checkpoint *checkpoint);

/* Writes a checkpoint to a new file, which then replaces the old one: there is a complete file at any time. All records
 * in `lines` must be written (kt_lines_flush). These records reach the disk before the checkpoint. Returns 0. Returns 1
 * if the file cannot be written, with a warning the first time; the last checkpoint stays, and the run can go on.
 * Returns -1 after printing an error of the records or of memory. */
int kt_checkpoint_write(kt_checkpoint *checkpoint, kt_outcome *outcome, const kt_lines *lines);

/* Checks that a file can be read and begins as a checkpoint does. An empty file counts as a checkpoint before its first
 * record. Returns -1, else an exit code after printing the error. */
int kt_checkpoint_check(const char *path);

/* Resumes a run from a checkpoint. Restores the simulation, the watch on modes, and the results and warnings so far in
 * *outcome. Sets checkpoint->records to the records that belong to the checkpoint. Returns -1 on success, else an exit
 * code after printing the error, with *outcome unchanged. */
int kt_checkpoint_resume(kt_checkpoint *checkpoint, const char *path, kt_outcome *outcome);

#endif
