/* A simulation in the formulation of its scene (open/simulated.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "open/simulated.h"

kt_status kt_simulated_create(const kt_model *model, const kt_absolute *absolute, const kt_run *run,
                              const kt_simulation_options *options, kt_simulated *made, kt_error *error) {
    *made = (kt_simulated){NULL, NULL};
    if (absolute == NULL)
        return kt_simulation_create(model, run, options, &made->simulation, error);
    const kt_status status = kt_absolute_motion_create(absolute, run, options, &made->motion, error);
    made->simulation = kt_absolute_motion_simulation(made->motion);
    return status;
}

void kt_simulated_free(kt_simulated *made) {
    if (made->motion != NULL)
        kt_absolute_motion_free(made->motion);
    else
        kt_simulation_free(made->simulation);
    *made = (kt_simulated){NULL, NULL};
}

kt_status kt_simulated_run(kt_simulated of, kt_recorder *record, void *user, kt_error *error) {
    return of.motion != NULL ? kt_absolute_motion_run(of.motion, record, user, error)
                             : kt_simulation_run(of.simulation, record, user, error);
}

kt_status kt_simulated_set_state(kt_simulated of, double t, const double *q, const double *v, kt_error *error) {
    return of.motion != NULL ? kt_absolute_motion_set_state(of.motion, t, q, v, error)
                             : kt_simulation_set_state(of.simulation, t, q, v, error);
}

kt_status kt_simulated_acceleration(kt_simulated of, double *a, kt_error *error) {
    return of.motion != NULL ? kt_absolute_motion_acceleration(of.motion, a, error)
                             : kt_simulation_acceleration(of.simulation, a, error);
}

const double *kt_simulated_positions(kt_simulated of) {
    return of.motion != NULL ? kt_absolute_motion_positions(of.motion) : kt_simulation_positions(of.simulation);
}

const double *kt_simulated_velocities(kt_simulated of) {
    return of.motion != NULL ? kt_absolute_motion_velocities(of.motion) : kt_simulation_velocities(of.simulation);
}
