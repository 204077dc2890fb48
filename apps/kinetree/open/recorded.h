/* A motion that has been recorded: the positions of a file of records at their times, for pictures that show it.
 *
 *     code = kt_recorded_open(&recorded, path, model);
 *     kt_recorded_positions(&recorded, model, 0.5, q);
 *     kt_recorded_close(&recorded);
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_OPEN_RECORDED_H
#define KT_COMMAND_OPEN_RECORDED_H

#include "kinetree/model.h"

typedef struct kt_recorded {
    double *time;  /* s, rising */
    double *q, *v; /* count rows of nq and nv */
    size_t count;
    double *scratch; /* nv */
} kt_recorded;

/* Reads the times, positions and velocities of a file of `kinetree run --out` or of a recording of Python. A record
 * that is not later than the one before is left out, as those of events are. Velocities that the file lacks are zero.
 * Returns KT_EXIT_DONE, or an exit code after printing the error. kt_recorded_close releases the motion in both
 * cases. */
int kt_recorded_open(kt_recorded *recorded, const char *path, const kt_model *model);
void kt_recorded_close(kt_recorded *recorded);

/* Writes the positions at a time, by the cubic through the positions and velocities of both neighbours, which has the
 * error of h^4 for records that are h apart. Before the first record and behind the last one, these. */
void kt_recorded_positions(kt_recorded *recorded, const kt_model *model, double time, double *q);

#endif
