/* A run's checkpoint file: a run that was interrupted continues from it with the same results as without
 * interruption. */
#ifndef KT_COMMAND_RECORDS_CHECKPOINT_H
#define KT_COMMAND_RECORDS_CHECKPOINT_H

#include "subcommands/run.h"

/* The file of a run's checkpoints, and how often it is written. */
typedef struct kt_checkpoint {
    const char *path; /* NULL: none are written */
    double interval;  /* s between two checkpoints, measured by kt_clock */
    double last;      /* s, value of kt_clock when the last one was written */
    uint64_t scene;   /* fingerprint of the run: see kt_checkpoint_open */
    void *block;      /* the simulation's state */
    size_t size;
} kt_checkpoint;

/* Computes the fingerprint of the scene, with the options of the command line applied, and allocates the memory for a
 * checkpoint. path may be NULL (only to resume). Returns -1 on success, else an exit code after printing the error. */
int kt_checkpoint_open(kt_checkpoint *checkpoint, const char *path, double interval, const kt_outcome *outcome,
                       const kt_simulation_options *options);
void kt_checkpoint_close(kt_checkpoint *checkpoint);

/* Returns whether the interval since the last checkpoint has elapsed. */
bool kt_checkpoint_is_due(const kt_checkpoint *checkpoint);

/* Writes a checkpoint to a new file, which then replaces the old one: there is a complete file at any time. `lines`:
 * number of bytes of the records written so far. Returns 0, or -1 after printing the error. */
int kt_checkpoint_write(kt_checkpoint *checkpoint, const kt_outcome *outcome, long long lines);

/* Resumes a run from a checkpoint: restores the simulation and the results so far in *outcome; *lines is the value that
 * kt_checkpoint_write was given. Returns -1 on success, else an exit code after printing the error, with *outcome and
 * *lines unchanged. */
int kt_checkpoint_resume(kt_checkpoint *checkpoint, const char *path, kt_outcome *outcome, long long *lines);

#endif
