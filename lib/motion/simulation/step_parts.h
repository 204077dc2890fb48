/* The parts of kt_simulation_take_step, for callers that try the steps of several simulations together
 * (batch/ensemble.c).
 *
 * First, `begin_step` puts inputs into force and limits the step to the next breakpoint. Next, `begin_watch` evaluates
 * events at the beginning of the step. While `again` is true, each try takes three calls: `begin_try`, an accepted step
 * of the integrator to *t_limit, and `check_step`.
 *
 * The last call, `check_step`, undoes a step that leapt over a contact or that contains an event. The end of the next
 * try is then *t_limit. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SIMULATION_STEP_PARTS_H
#define KT_SIMULATION_STEP_PARTS_H

#include "integrator/integrator.h"
#include "simulation/simulation.h"

kt_status kt_simulation_begin_step(kt_simulation *simulation, double *t_limit, kt_error *from);
kt_status kt_simulation_begin_watch(kt_simulation *simulation, kt_error *error);
void kt_simulation_begin_try(kt_simulation *simulation);
kt_status kt_simulation_check_step(kt_simulation *simulation, int repetition, double *t_limit, bool *again,
                                   kt_error *error);

/* Applies the events at the present time that have not taken effect yet: the events of the last step, or the events
 * that a previous call did not apply. */
KT_CHECKED kt_status kt_simulation_fire(kt_simulation *simulation, kt_error *error);

/* The end of the period that begins now: start + k period, if now is start + (k - 1) period up to rounding. */
double kt_simulation_period_end(const kt_simulation *simulation, double period);

/* Begins a step, a run or an evaluation. Takes over parameters that have been set. Reports a contact that has been
 * beyond its boundary since the start (memory.beyond). */
KT_CHECKED kt_status kt_simulation_check_start(kt_simulation *simulation, kt_error *error);

#endif
