/* The choice of the curves of a work-precision diagram. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_ACCURACY_CURVES_H
#define KT_COMMAND_PLOT_ACCURACY_CURVES_H

#include "subcommands/accuracy.h"

enum { KT_CURVES_SHOWN = 8, KT_CURVES_MAX = 512 };

/* Chooses the curves to draw: first those of the study, then those of other engines (KT_CURVES_MAX at most). --all
 * chooses all. Returns the number of curves that are not among the best of their families. */
int kt_choose_curves(const kt_findings *findings, bool *is_chosen);

#endif
