/* Messages about loops that are open, or whose velocities do not fit. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CLOSURE_OPEN_LOOPS_H
#define KT_CLOSURE_OPEN_LOOPS_H

#include "assembly/project.h"

/* Returns KT_OK if a search from q closes the loops at t to `tolerance`. Otherwise returns kt_open_loops_error, with
 * `what`. */
kt_status kt_loops_reach(const kt_model *model, kt_data *data, double t, const double *q, double tolerance,
                         const char *what, kt_error *error);

/* Writes the least-squares violation of the velocity equations into `right`. If equations contradict each other, the
 * factored equations would assign the whole violation to one equation. */
void kt_velocity_gaps_least_squares(const kt_model *model, kt_data *data);

/* The equations of which a message gives the violations: those of positions (residuals), or of velocities (`right`). */
typedef enum kt_open_equations { KT_OPEN_POSITIONS, KT_OPEN_VELOCITIES } kt_open_equations;

/* Returns KT_ERROR_CONSTRAINT with the loops that violate these equations as last filled, worst first, and their gaps.
 * `what` precedes the names of the loops. */
kt_status kt_open_loops_error(const kt_model *model, kt_data *data, double t, const char *what,
                              kt_open_equations violated, kt_error *error);

#endif
