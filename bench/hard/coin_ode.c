/* The spinning coin in ODE: a cylinder of 2 um, on a plane, with ERP and CFM as ODE sets them; no others do better.
 * (Without ODE's gyroscopic torque the error is a fifth at this step, by chance: it grows where steps get shorter.) */
/* SPDX-License-Identifier: Apache-2.0 */
#include "coin.h"
#include "ode.h"

#include <math.h>

static void touch(const kt_ode_scene *s, dSurfaceParameters *surface) {
    (void)s;
    surface->mode = dContactApprox1;
    surface->mu = KT_COIN_FRICTION;
}

static void build(kt_ode_scene *s) {
    const double m = KT_COIN_MASS, r = KT_COIN_RADIUS, Omega = kt_coin_rate();
    dMass mass;
    dMatrix3 inclined;
    dWorldSetGravity(s->world, 0.0, 0.0, -9.81);
    (void)dCreatePlane(s->space, 0.0, 0.0, 1.0, 0.0);
    dBodyID coin = s->body[0] = dBodyCreate(s->world);
    dMassSetParameters(&mass, m, 0.0, 0.0, 0.0, 0.25 * m * r * r, 0.25 * m * r * r, 0.5 * m * r * r, 0.0, 0.0, 0.0);
    dBodySetMass(coin, &mass);
    dGeomSetBody(dCreateCylinder(s->space, r, 2e-6), coin);
    dRFromAxisAndAngle(inclined, 1.0, 0.0, 0.0, KT_COIN_ALPHA);
    dBodySetRotation(coin, inclined);
    dBodySetPosition(coin, 0.0, 0.0, r * sin(KT_COIN_ALPHA));
    /* Omega sin(alpha) up the disc. */
    dBodySetAngularVel(coin, 0.0, Omega * sin(KT_COIN_ALPHA) * cos(KT_COIN_ALPHA),
                       Omega * sin(KT_COIN_ALPHA) * sin(KT_COIN_ALPHA));
}

static void damp(kt_ode_scene *s, double t) {
    const dReal *R = dBodyGetRotation(s->body[0]), *w = dBodyGetAngularVel(s->body[0]);
    const double axle[3] = {R[2], R[6], R[10]}, rate[3] = {w[0], w[1], w[2]};
    double torque[3];
    (void)t;
    kt_coin_damper(axle, rate, torque);
    dBodyAddTorque(s->body[0], torque[0], torque[1], torque[2]);
}

static void see(kt_events_watch *watch, const kt_ode_scene *s, double t) {
    kt_events_see(watch, 0, t, dBodyGetPosition(s->body[0])[2]);
}

bool kt_events_coin_ode(kt_events_watch *watch) {
    static const kt_ode_motion coin = {build, see, damp, touch};
    return kt_ode_run(watch, &coin);
}
