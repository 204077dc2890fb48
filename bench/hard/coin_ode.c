/* The spinning coin in ODE: a cylinder of 2 um, on a plane, with ERP and CFM as ODE sets them; no others do better. (Without ODE's gyroscopic
 * torque the error is a fifth at this step, by chance: it grows where steps get shorter.) */
#include "coin.h"
#include "events.h"

#include <math.h>
#include <ode/ode.h>

typedef struct scene {
    dWorldID world;
    dSpaceID space;
    dBodyID coin;
    dJointGroupID contacts;
} scene;

static void touch(void *data, dGeomID a, dGeomID b) {
    enum { MOST = 8 };
    const scene *s = data;
    dContactGeom found[MOST];
    const int count = dCollide(a, b, MOST, found, sizeof found[0]);
    for (int i = 0; i < count; i++) {
        dContact contact = {.geom = found[i], .surface = {.mode = dContactApprox1, .mu = KT_COIN_FRICTION}};
        dJointAttach(dJointCreateContact(s->world, s->contacts, &contact), dGeomGetBody(a), dGeomGetBody(b));
    }
}

static void build(scene *s) {
    const double m = KT_COIN_MASS, r = KT_COIN_RADIUS, Omega = kt_coin_rate();
    dMass mass;
    dMatrix3 inclined;
    dWorldSetGravity(s->world, 0.0, 0.0, -9.81);
    (void)dCreatePlane(s->space, 0.0, 0.0, 1.0, 0.0);
    s->coin = dBodyCreate(s->world);
    dMassSetParameters(&mass, m, 0.0, 0.0, 0.0, 0.25 * m * r * r, 0.25 * m * r * r, 0.5 * m * r * r, 0.0, 0.0, 0.0);
    dBodySetMass(s->coin, &mass);
    dGeomSetBody(dCreateCylinder(s->space, r, 2e-6), s->coin);
    dRFromAxisAndAngle(inclined, 1.0, 0.0, 0.0, KT_COIN_ALPHA);
    dBodySetRotation(s->coin, inclined);
    dBodySetPosition(s->coin, 0.0, 0.0, r * sin(KT_COIN_ALPHA));
    /* Omega sin(alpha) up the disc. */
    dBodySetAngularVel(s->coin, 0.0, Omega * sin(KT_COIN_ALPHA) * cos(KT_COIN_ALPHA),
                       Omega * sin(KT_COIN_ALPHA) * sin(KT_COIN_ALPHA));
}

static void damp(const scene *s) {
    const dReal *R = dBodyGetRotation(s->coin), *w = dBodyGetAngularVel(s->coin);
    const double axle[3] = {R[2], R[6], R[10]}, rate[3] = {w[0], w[1], w[2]};
    double torque[3];
    kt_coin_damper(axle, rate, torque);
    dBodyAddTorque(s->coin, torque[0], torque[1], torque[2]);
}

static void say_nothing(int number, const char *format, va_list arguments) {
    (void)number;
    (void)format;
    (void)arguments;
}

bool kt_events_coin_ode(kt_events_watch *watch) {
    dInitODE2(0);
    dSetMessageHandler(say_nothing);
    scene s = {.world = dWorldCreate(), .space = dSimpleSpaceCreate(NULL)};
    s.contacts = dJointGroupCreate(0);
    build(&s);
    const double h = watch->problem->step;
    const long every = lround(1e-3 / h), steps = lround(watch->problem->duration / h);
    const double begin = kt_events_clock();
    for (long k = 0; k <= steps; k++) {
        if (k % every == 0)
            kt_events_see(watch, 0, (double)k * h, dBodyGetPosition(s.coin)[2]);
        damp(&s);
        dSpaceCollide(s.space, &s, touch);
        (void)dWorldStep(s.world, h);
        dJointGroupEmpty(s.contacts);
    }
    watch->seconds = kt_events_clock() - begin;
    dJointGroupDestroy(s.contacts);
    dSpaceDestroy(s.space);
    dWorldDestroy(s.world);
    dCloseODE();
    return true;
}
