/* A simulation in the formulation of its scene; its state and its records in the coordinates of the tree. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_SCENE_SIMULATED_H
#define KT_COMMAND_SCENE_SIMULATED_H

#include "kinetree/formulation.h"

/* The simulation, and its owner in the absolute formulation; NULL: the coordinates of the tree are integrated. */
typedef struct kt_simulated {
    kt_simulation *simulation;
    kt_absolute_motion *motion;
} kt_simulated;

/* Creates the simulation of a model, or of its absolute formulation unless that is NULL. */
kt_status kt_simulated_create(const kt_model *model, const kt_absolute *absolute, const kt_run *run,
                              const kt_simulation_options *options, kt_simulated *made, kt_error *error);
void kt_simulated_free(kt_simulated *made);

/* As kt_simulation_run, _set_state, _acceleration, _positions and _velocities. */
kt_status kt_simulated_run(kt_simulated of, kt_recorder *record, void *user, kt_error *error);
kt_status kt_simulated_set_state(kt_simulated of, double t, const double *q, const double *v, kt_error *error);
kt_status kt_simulated_acceleration(kt_simulated of, double *a, kt_error *error);
const double *kt_simulated_positions(kt_simulated of);
const double *kt_simulated_velocities(kt_simulated of);

#endif
