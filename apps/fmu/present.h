/* Calculations in the present state of a simulation: with its contacts, and with the parameters that events have set.
 * Only they read the simulation's own struct. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_FMU_PRESENT_H
#define KT_FMU_PRESENT_H

#include "kinetree/simulation.h"

/* Returns the data of the present model (kt_simulation_model), which hold the auxiliary states. */
kt_data *kt_fmu_present_data(kt_simulation *simulation);

/* Computes x' (kt_auxiliary_state_count numbers). Errors: as kt_auxiliary_state_rates. */
kt_status kt_fmu_own_rates(kt_simulation *simulation, double *rates, kt_error *error);

/* Lets the simulation compute all anew that depends on the parameters of its model, as kt_simulation_set_parameter. */
void kt_fmu_forget_present(kt_simulation *simulation);

/* Returns the first time after t at which a function of time, or its first or second derivative, jumps; HUGE_VAL: none.
 * The functions are those of drives, effects, masses and formulas. */
double kt_fmu_next_jump(const kt_model *model, double t);

#endif
