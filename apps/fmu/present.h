/* Calculations in the present state of a simulation: with its contacts, and with the parameters that events have set.
 * Only they read the simulation's own struct. */
#ifndef KT_FMU_PRESENT_H
#define KT_FMU_PRESENT_H

#include "kinetree/simulation.h"

/* Returns the data of the present model (kt_simulation_model), which hold the auxiliary states. */
kt_data *kt_fmu_present_data(kt_simulation *simulation);

/* Computes x' (kt_own_state_count numbers). Errors: as kt_own_state_rates. */
kt_status kt_fmu_own_rates(kt_simulation *simulation, double *rates, kt_error *error);

#endif
