/* Motions with contacts in this engine: with events and adaptive steps by default, and with time stepping. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "engines.h"
#include "kinetree/simulation.h"

#include <stdlib.h>

typedef struct own_run {
    kt_simulation *simulation;
    kt_data *data;
    double start[KT_CONTACT_COORDINATES], torque[KT_CONTACT_COORDINATES];
} own_run;

static bool open_simulation(kt_contact_run *run, bool has_steps) {
    kt_run settings = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    own_run *own = run->own = calloc(1, sizeof *own);
    kt_error error;
    double v[KT_CONTACT_COORDINATES];
    if (own == NULL)
        return kt_contact_fail(run, "there is not enough memory");
    settings.duration = 1e3;
    if (has_steps) {
        settings.integrator = NULL;
        settings.step = run->setting;
    } else {
        settings.relative = settings.absolute = run->setting;
    }
    options.contact = has_steps ? KT_CONTACT_STEPS : KT_CONTACT_EVENTS;
    kt_model_initial(run->model, own->start, v);
    return (kt_data_create(run->model, &own->data, &error) == KT_OK &&
            kt_simulation_create(run->model, &settings, &options, &own->simulation, &error) == KT_OK) ||
           kt_contact_fail(run, error.message);
}

static bool open_with_events(kt_contact_run *run) { return open_simulation(run, false); }

static bool open_with_steps(kt_contact_run *run) { return open_simulation(run, true); }

static void hold_joints(const kt_contact_run *run, own_run *own) {
    const double *q = kt_simulation_positions(own->simulation), *v = kt_simulation_velocities(own->simulation);
    for (int b = 1; b < kt_model_body_count(run->model); b++) {
        const kt_coordinates c = kt_body_coordinates(run->model, b);
        if (c.nv == 1)
            own->torque[c.v] = -run->motion->stiffness * (q[c.q] - own->start[c.q]) - run->motion->damping * v[c.v];
    }
}

static bool move_simulation(kt_contact_run *run) {
    own_run *own = run->own;
    kt_error error;
    kt_status status = KT_OK;
    if (run->motion->stiffness > 0.0) {
        hold_joints(run, own);
        status = kt_simulation_set_torque(own->simulation, own->torque, &error);
    }
    if (status == KT_OK)
        status = kt_simulation_tick(own->simulation, run->motion->interval, &error);
    return status == KT_OK || kt_contact_fail(run, error.message);
}

static bool look_at_simulation(kt_contact_run *run) {
    own_run *own = run->own;
    kt_error error;
    if (kt_kinematics_update(run->model, own->data, kt_simulation_positions(own->simulation),
                             kt_simulation_velocities(own->simulation), NULL, &error) != KT_OK)
        return kt_contact_fail(run, error.message);
    kt_twin_read(run->model, own->data, &run->twin);
    return true;
}

static void close_simulation(kt_contact_run *run) {
    own_run *own = run->own;
    if (own != NULL) {
        kt_simulation_free(own->simulation);
        kt_data_free(own->data);
    }
    free(own);
}

const kt_contact_engine kt_contact_events = {
    "Kinetree, events", true, open_with_events, move_simulation, look_at_simulation, close_simulation};
const kt_contact_engine kt_contact_steps = {"Kinetree, steps",  false,           open_with_steps, move_simulation,
                                            look_at_simulation, close_simulation};
