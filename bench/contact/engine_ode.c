/* Motions with contacts in ODE (peers/ode_twin.h), by dWorldStep or by dWorldQuickStep. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../peers/ode_twin.h"
#include "engines.h"

static bool open_ode(kt_contact_run *run) {
    run->own = kt_ode_twin_create(&run->twin);
    return run->own != NULL || kt_contact_fail(run, "a body has no mass");
}

static bool open_quick(kt_contact_run *run) {
    if (!open_ode(run))
        return false;
    kt_ode_twin_set_quick(run->own);
    return true;
}

/* Torques last for a step. */
static bool move_ode(kt_contact_run *run) {
    double torque[KT_MECHANISM_BODIES];
    const bool held = run->motion->stiffness > 0.0;
    for (int i = 1; held && i < run->twin.description->body_count; i++) {
        double rate;
        const double angle = kt_ode_twin_angle(run->own, i, &rate);
        torque[i] = -run->motion->stiffness * angle - run->motion->damping * rate;
    }
    for (long k = kt_contact_steps_of(run); k > 0; k--) {
        for (int i = 1; held && i < run->twin.description->body_count; i++)
            kt_ode_twin_turn(run->own, i, torque[i]);
        kt_ode_twin_step(run->own, run->setting, 1);
    }
    return true;
}

static bool look_at_ode(kt_contact_run *run) {
    kt_ode_twin_read(run->own, &run->twin);
    return kt_vec3_is_finite(run->twin.pose[0].position) || kt_contact_fail(run, "its numbers are not finite");
}

static void close_ode(kt_contact_run *run) {
    if (run->own != NULL)
        kt_ode_twin_free(run->own);
}

const kt_contact_engine kt_contact_ode = {"ODE", false, open_ode, move_ode, look_at_ode, close_ode};
const kt_contact_engine kt_contact_ode_quick = {"ODE, quick", false, open_quick, move_ode, look_at_ode, close_ode};
