/* What the files of `kinetree modes` share. */
#ifndef KT_COMMAND_SUBCOMMANDS_MODES_H
#define KT_COMMAND_SUBCOMMANDS_MODES_H

#include "scene/linear.h"

#include "kinetree/study.h"

/* Prints the Floquet multipliers of the motion from the initial state. Returns an exit code. */
int kt_modes_print_period(const kt_small_motion *motion, double period, long steps, bool json);

/* Prints the eigenvalues that a constraint formulation adds to the modes of the motion, which have been computed about
 * its state. Returns an exit code. */
int kt_modes_print_formulation(const kt_small_motion *motion, kt_constraint_formulation_type type, double alpha,
                               double beta, bool json);

#endif
