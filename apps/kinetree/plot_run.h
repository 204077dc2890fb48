/* The picture of a run: what is recorded (by default joint positions) and markers against time, and what the total
 * energy changes by; or where works are
 * recorded, energy and works together, which none should. */
#ifndef KT_COMMAND_PLOT_RUN_H
#define KT_COMMAND_PLOT_RUN_H

#include "plot.h"
#include "run.h"

typedef struct kt_plot_run kt_plot_run;

/* run: as it is run, with what is to be recorded; it must outlive the picture. NULL where there is no memory. */
kt_plot_run *kt_plot_run_start(const kt_model *model, const kt_run *run);
/* Returns 0, or -1 after saying why. */
int kt_plot_run_take(kt_plot_run *plot, const kt_record *record);
/* Returns an exit code. */
int kt_plot_run_write(const kt_plot_run *plot, const kt_outcome *outcome, const char *path, bool is_dark);
void kt_plot_run_free(kt_plot_run *plot);

#endif
