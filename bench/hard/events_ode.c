/* Impacts, stick and slip in ODE: a box or a sphere on a plane, contacts by dCollide before each step with Coulomb's pyramid
 * along the slip (dContactApprox1), dWorldStep. ERP and CFM of contacts as ODE sets them. */
#include "events.h"

#include <ode/ode.h>
#include <stdio.h>

typedef struct scene {
    const kt_events_problem *problem;
    dWorldID world;
    dSpaceID space;
    dBodyID body;
    dJointGroupID contacts;
} scene;

static void touch(void *data, dGeomID a, dGeomID b) {
    enum { MOST = 8 };
    const scene *s = data;
    dContactGeom found[MOST];
    const int count = dCollide(a, b, MOST, found, sizeof found[0]);
    for (int i = 0; i < count; i++) {
        dContact contact = {.geom = found[i]};
        contact.surface.mode = dContactApprox1 | dContactBounce;
        contact.surface.mu = s->problem->friction;
        contact.surface.bounce = s->problem->restitution;
        contact.surface.bounce_vel = 1e-6;
        dJointAttach(dJointCreateContact(s->world, s->contacts, &contact), dGeomGetBody(a), dGeomGetBody(b));
    }
}

static void build(scene *s, bool is_ball) {
    const kt_events_problem *p = s->problem;
    dMass mass;
    dGeomID geom;
    dWorldSetGravity(s->world, p->gravity * sin(p->tilt), 0.0, -p->gravity * cos(p->tilt));
    (void)dCreatePlane(s->space, 0.0, 0.0, 1.0, 0.0);
    if (is_ball) {
        dMassSetSphereTotal(&mass, p->mass, p->radius);
        geom = dCreateSphere(s->space, p->radius);
        dBodySetPosition(s->body, 0.0, 0.0, p->drop + p->radius);
    } else {
        dMassSetBoxTotal(&mass, p->mass, 0.2, 0.2, 0.1);
        geom = dCreateBox(s->space, 0.2, 0.2, 0.1);
        dBodySetPosition(s->body, 0.0, 0.0, 0.05);
    }
    dBodySetMass(s->body, &mass);
    dGeomSetBody(geom, s->body);
}

static void move(scene *s, kt_events_watch *watch) {
    const kt_events_problem *p = s->problem;
    const long every = lround(1e-3 / p->step), steps = lround(p->duration / p->step);
    for (long k = 0; k <= steps; k++) {
        const dReal *at = dBodyGetPosition(s->body);
        const double t = (double)k * p->step;
        if (k % every == 0)
            kt_events_see(watch, t, watch->which == KT_EVENTS_BOUNCE ? at[2] - p->radius : at[0]);
        if (p->stiffness > 0.0)
            dBodyAddForce(s->body, -p->stiffness * (at[0] + p->belt * t), 0.0, 0.0);
        dSpaceCollide(s->space, s, touch);
        (void)dWorldStep(s->world, p->step);
        dJointGroupEmpty(s->contacts);
    }
}

static void say_nothing(int number, const char *format, va_list arguments) {
    (void)number;
    (void)format;
    (void)arguments;
}

bool kt_events_ode(kt_events_watch *watch) {
    dInitODE2(0);
    dSetMessageHandler(say_nothing);
    scene s = {.problem = watch->problem, .world = dWorldCreate(), .space = dSimpleSpaceCreate(NULL)};
    s.body = dBodyCreate(s.world);
    s.contacts = dJointGroupCreate(0);
    build(&s, watch->which == KT_EVENTS_BOUNCE);
    const double begin = kt_events_clock();
    move(&s, watch);
    watch->seconds = kt_events_clock() - begin;
    dJointGroupDestroy(s.contacts);
    dSpaceDestroy(s.space);
    dWorldDestroy(s.world);
    dCloseODE();
    return true;
}
