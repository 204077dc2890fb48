/* A run's checkpoint in a file: enough to go on after a break as if there had been none. */
#ifndef KT_COMMAND_CHECKPOINT_H
#define KT_COMMAND_CHECKPOINT_H

#include "run.h"

/* Where a run writes its checkpoints, and how often. */
typedef struct kt_checkpoint {
    const char *path; /* NULL: none are written */
    double interval;  /* s of the clock between two */
    double last;      /* when the last was written */
    uint64_t scene;   /* what run this is: see kt_checkpoint_open */
    void *block;      /* the simulation's state */
    size_t size;
} kt_checkpoint;

/* Takes the fingerprint of the scene as it is run, with the command line's words in it, and the memory that a
 * checkpoint needs. path may be NULL (only to resume). Returns -1 to go on, or an exit code after saying why. */
int kt_checkpoint_open(kt_checkpoint *checkpoint, const char *path, double interval, const kt_outcome *outcome,
                       const kt_simulation_options *options);
void kt_checkpoint_close(kt_checkpoint *checkpoint);

/* Whether it is time for one. */
bool kt_checkpoint_is_due(const kt_checkpoint *checkpoint);

/* Writes one beside the old one, which it then replaces: whatever happens, there is a whole one. `lines`: bytes of the
 * records written. Returns 0, or -1 after saying why. */
int kt_checkpoint_write(kt_checkpoint *checkpoint, const kt_outcome *outcome, long long lines);

/* Takes a run up where a checkpoint left it: the simulation, and in *outcome what has been seen of it; *lines as given
 * to kt_checkpoint_write. Returns -1 to go on, or an exit code after saying why; nothing is changed then. */
int kt_checkpoint_resume(kt_checkpoint *checkpoint, const char *path, kt_outcome *outcome, long long *lines);

#endif
