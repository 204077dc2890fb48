/* The woodpecker toy in ODE: a carrier that slides, on it a sleeve that turns, and on that a bird. The edges and the
 * beak are spheres, and each meets the pole in a plane. The solver dWorldStep bounds friction by the normal forces
 * without friction, so nothing jams there and the toy slides off. The solver dWorldQuickStep bounds friction by the
 * normal forces with friction. The search covered 20 to 200 iterations. It covered relaxations from 1 to 1.8. The
 * choice of 100 iterations and 1.7 has the least error. Others have errors from 5e-4 to 1.5e-1 s. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "events.h"
#include "woodpecker.h"

#include <math.h>
#include <ode/ode.h>

enum { CARRIER, SLEEVE, BIRD, BODIES };

typedef struct scene {
    dWorldID world;
    dSpaceID space;
    dBodyID body[BODIES];
    dGeomID beak;
    dJointID spring;
    dJointGroupID contacts;
    kt_pecks pecks;
    double t;
} scene;

static void touch(void *data, dGeomID a, dGeomID b) {
    scene *s = data;
    dContact contact = {
        .surface = {.mode = dContactApprox1 | dContactBounce, .mu = kt_woodpecker_data.friction, .bounce_vel = 1e-6}};
    if (dCollide(a, b, 1, &contact.geom, sizeof contact.geom) == 0)
        return;
    if (a == s->beak || b == s->beak) {
        contact.surface.bounce = kt_woodpecker_data.restitution;
        kt_pecks_see(&s->pecks, s->t);
    }
    dJointAttach(dJointCreateContact(s->world, s->contacts, &contact), dGeomGetBody(a), dGeomGetBody(b));
}

static dBodyID add_body(const scene *s, double x, double mass, double inertia) {
    dMass total;
    dBodyID body = dBodyCreate(s->world);
    dMassSetParameters(&total, mass, 0.0, 0.0, 0.0, inertia, inertia, inertia, 0.0, 0.0, 0.0);
    dBodySetMass(body, &total);
    dBodySetPosition(body, x, 0.0, 0.0);
    return body;
}

static dJointID add_hinge(const scene *s, dBodyID parent, dBodyID body, double x) {
    dJointID hinge = dJointCreateHinge(s->world, NULL);
    dJointAttach(hinge, body, parent);
    dJointSetHingeAnchor(hinge, x, 0.0, 0.0);
    dJointSetHingeAxis(hinge, 0.0, 0.0, 1.0);
    return hinge;
}

/* A sphere of the body that touches where (x, y) is. */
static dGeomID add_sphere(const scene *s, dBodyID body, double x, double y, unsigned long bit) {
    dGeomID sphere = dCreateSphere(s->space, KT_WOODPECKER_RHO);
    dGeomSetBody(sphere, body);
    dGeomSetOffsetWorldPosition(sphere, x + KT_WOODPECKER_RHO, y, 0.0);
    dGeomSetCategoryBits(sphere, bit);
    dGeomSetCollideBits(sphere, bit);
    return sphere;
}

static void add_plane(const scene *s, double x, unsigned long bit) {
    dGeomID plane = dCreatePlane(s->space, 1.0, 0.0, 0.0, x);
    dGeomSetCategoryBits(plane, bit);
    dGeomSetCollideBits(plane, bit);
}

/* With both angles 0. */
static void build(scene *s) {
    const kt_woodpecker *t = &kt_woodpecker_data;
    const double N = KT_WOODPECKER_N, NN = N * N, beak = t->lM + t->lG - t->lS;
    enum { EDGES = 1, BEAK = 2 };
    dWorldSetGravity(s->world, 0.0, -t->g, 0.0);
    dWorldSetQuickStepNumIterations(s->world, 100);
    dWorldSetQuickStepW(s->world, 1.7);
    s->body[CARRIER] = add_body(s, 0.0, 0.5 * t->mM, NN * t->JM);
    s->body[SLEEVE] = add_body(s, 0.0, 0.5 * t->mM, NN * t->JM);
    s->body[BIRD] = add_body(s, N * (t->lM + t->lG), t->mS, NN * t->JS);
    dJointID slider = dJointCreateSlider(s->world, NULL);
    dJointAttach(slider, s->body[CARRIER], NULL);
    dJointSetSliderAxis(slider, 0.0, 1.0, 0.0);
    (void)add_hinge(s, s->body[CARRIER], s->body[SLEEVE], 0.0);
    s->spring = add_hinge(s, s->body[SLEEVE], s->body[BIRD], N * t->lM);
    (void)add_sphere(s, s->body[SLEEVE], N * t->rM, N * t->hM, EDGES);
    (void)add_sphere(s, s->body[SLEEVE], N * t->rM, -N * t->hM, EDGES);
    s->beak = add_sphere(s, s->body[BIRD], N * beak, N * t->hS, BEAK);
    add_plane(s, N * t->rM - (t->rM - t->r0), EDGES);
    add_plane(s, N * beak - (beak - t->r0), BEAK);
}

static void turn(dBodyID body, double angle) {
    dMatrix3 rotation;
    dRFromAxisAndAngle(rotation, 0.0, 0.0, 1.0, angle);
    dBodySetRotation(body, rotation);
}

static void begin_motion(const scene *s) {
    const kt_woodpecker *t = &kt_woodpecker_data;
    const double N = KT_WOODPECKER_N, phiM = (t->r0 - t->rM) / t->hM, M = phiM / N, S = t->phiS / N;
    turn(s->body[SLEEVE], M);
    turn(s->body[BIRD], S);
    dBodySetPosition(s->body[BIRD], N * (t->lM * cos(M) + t->lG * cos(S)), N * (t->lM * sin(M) + t->lG * sin(S)), 0.0);
    for (int i = 0; i < BODIES; i++)
        dBodySetLinearVel(s->body[i], 0.0, t->fall + (i == BIRD ? t->lG * t->turn : 0.0), 0.0);
    dBodySetAngularVel(s->body[BIRD], 0.0, 0.0, t->turn / N);
}

static void say_nothing(int number, const char *format, va_list arguments) {
    (void)number;
    (void)format;
    (void)arguments;
}

bool kt_events_woodpecker_ode(kt_events_watch *watch) {
    const double h = watch->problem->step, stiffness = KT_WOODPECKER_N * KT_WOODPECKER_N * kt_woodpecker_data.c;
    const long steps = lround(watch->problem->duration / h);
    dInitODE2(0);
    dSetMessageHandler(say_nothing);
    scene s = {.world = dWorldCreate(), .space = dSimpleSpaceCreate(NULL)};
    s.contacts = dJointGroupCreate(0);
    build(&s);
    begin_motion(&s);
    const double begin = kt_events_clock();
    for (long k = 0; k <= steps; k++) {
        s.t = (double)k * h;
        dJointAddHingeTorque(s.spring, -stiffness * dJointGetHingeAngle(s.spring));
        dSpaceCollide(s.space, &s, touch);
        (void)dWorldQuickStep(s.world, h);
        dJointGroupEmpty(s.contacts);
    }
    watch->seconds = kt_events_clock() - begin;
    kt_events_see(watch, 0, watch->problem->duration, kt_pecks_period(&s.pecks));
    dJointGroupDestroy(s.contacts);
    dSpaceDestroy(s.space);
    dWorldDestroy(s.world);
    dCloseODE();
    return true;
}
