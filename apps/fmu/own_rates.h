/* Rates of auxiliary states in the present state of a simulation. They have a file of their own, because the private
 * header of simulations and that of columns both have a type kt_columns. */
#ifndef KT_FMU_OWN_RATES_H
#define KT_FMU_OWN_RATES_H

#include "kinetree/simulation.h"

/* Computes x' (kt_own_state_count numbers) with the present model, whose parameters events may have set.
 * Errors: as kt_own_state_rates. */
kt_status kt_fmu_own_rates(kt_simulation *simulation, double *rates, kt_error *error);

#endif
