/* Stages that are solved one after the other (dirk.c), shared by diagonally implicit methods and implicit multistep
 * methods. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_INTEGRATOR_DIRK_H
#define KT_INTEGRATOR_DIRK_H

#include "integrator/newton.h"

/* Rows of a try: a stage and its base. The damped iteration adds the start of a correction, and the correction. */
enum { KT_DIRK_STAGE, KT_DIRK_BASE, KT_DIRK_FROM, KT_DIRK_CORRECTION, KT_DIRK_ROWS };

/* The first numbers of the history besides Newton's: whether a step has been made, and n slopes at each end of this
 * step. */
enum { KT_DIRK_FLAG, KT_DIRK_SLOPES };
extern const kt_history_word kt_dirk_words[];
static inline size_t kt_dirk_history(size_t n) { return KT_DIRK_SLOPES + 2 * n; }

/* Solves Y = base + h gamma f(t, Y), with the base and a first guess of Y in their rows. The sign of h gamma is that of
 * the step. On return, Y is in its row, and the slope (Y - base) / (h gamma) in the slot. */
kt_try_result kt_dirk_solve(kt_integrator *it, double t, double h_gamma, size_t slot, kt_try *result);

/* A try of a step: `solve` leaves y1 in the row of stages. If its iteration does not converge, the try continues with
 * a new Jacobian, and then damped. */
typedef kt_try_result kt_dirk_solver(kt_integrator *it, const kt_interval *interval, kt_try *result);
kt_try_result kt_dirk_try(kt_integrator *it, const kt_interval *interval, kt_dirk_solver *solve, kt_try *result);

/* The slope at the start of a step: the slope of the last step's solution, or f if no step was made. */
const double *kt_dirk_slope(const kt_integrator *it);

/* All stages of the table; y1 is left in the row of stages. */
kt_try_result kt_dirk_stages(kt_integrator *it, const kt_interval *interval, kt_try *result);

/* After a step: keeps the slopes at its ends. And the cubic through both states with both slopes. */
void kt_dirk_accept(kt_integrator *it);
kt_try_result kt_dirk_interpolate(kt_integrator *it, double t, double *y_out, kt_try *result);

/* `init` of a family with the slots of the table. */
void kt_dirk_init(kt_integrator *it);

#endif
