/* The clutch in ODE, which has no Stribeck curve. Dry friction is the motor of a joint with a target speed of zero.
 * Before each step its largest torque is set to the value of the curve at the slip. There is no other number to choose.
 * The error is in proportion to the step. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "clutch.h"
#include "ode.h"

static double turning(const kt_ode_scene *s, int which) { return dBodyGetAngularVel(s->body[which])[0]; }

static void build(kt_ode_scene *s) {
    const kt_clutch *c = &kt_clutch_data;
    for (int i = 0; i < 2; i++) {
        dMass mass;
        dMassSetParameters(&mass, c->mass[i], 0.0, 0.0, 0.0, c->inertia[i], c->inertia[i], c->inertia[i], 0.0, 0.0,
                           0.0);
        s->body[i] = dBodyCreate(s->world);
        dBodySetMass(s->body[i], &mass);
        s->joint = dJointCreateHinge(s->world, NULL);
        dJointAttach(s->joint, s->body[i], i == 0 ? NULL : s->body[0]);
        dJointSetHingeAxis(s->joint, 1.0, 0.0, 0.0);
    }
    dJointSetHingeParam(s->joint, dParamVel, 0.0);
    dBodySetAngularVel(s->body[0], c->speed, 0.0, 0.0);
}

static void see(kt_events_watch *watch, const kt_ode_scene *s, double t) {
    for (int i = 0; i < 2; i++)
        kt_events_see(watch, i, t, turning(s, i));
}

static void transmit(kt_ode_scene *s, double t) {
    dJointSetHingeParam(s->joint, dParamFMax, kt_clutch_friction(turning(s, 0) - turning(s, 1)));
    dBodyAddTorque(s->body[0], kt_clutch_push(t), 0.0, 0.0);
}

bool kt_events_clutch_ode(kt_events_watch *watch) {
    static const kt_ode_motion clutch = {build, see, transmit, NULL};
    return kt_ode_run(watch, &clutch);
}
