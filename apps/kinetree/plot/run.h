/* The picture of a run: the recorded quantities and markers against time. The default is joint positions, markers and
 * the scene's `output.columns`. A further panel has the change of the total energy or, if the work done is
 * recorded, the change of the balance of energies and work, which should be zero. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_RUN_H
#define KT_COMMAND_PLOT_RUN_H

#include "plot/plot.h"
#include "subcommands/run.h"

typedef struct kt_plot_run kt_plot_run;

/* columns: those of the run's records; they must outlive the picture. Returns NULL if memory is insufficient. */
kt_plot_run *kt_plot_run_start(const kt_columns *columns, const kt_run *run);
/* Adds a record and the values of its columns. Returns 0, or -1 after printing the error. */
int kt_plot_run_take(kt_plot_run *plot, const kt_record *record, const double *values);
/* Draws the picture. Unless is_quiet, prints the columns that it leaves out as noise. Returns an exit code. */
int kt_plot_run_write(const kt_plot_run *plot, const kt_outcome *outcome, const char *path, kt_plot_size size,
                      bool is_dark, bool is_quiet);
void kt_plot_run_free(kt_plot_run *plot);

#endif
