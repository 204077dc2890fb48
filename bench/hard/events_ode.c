/* Impacts, stick and slip in ODE: boxes, spheres and planes. Bodies that move along one axis alone are on a slider.
 * Contacts come from dCollide before each step, with Coulomb's pyramid along the slip (dContactApprox1). Steps are by
 * dWorldStep. ERP and CFM of contacts have ODE's defaults. A rope is a contact, too, while it is taut: the first body
 * touches the sphere of its length from inside. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "ode.h"

#include <math.h>

static void touch(const kt_ode_scene *s, dSurfaceParameters *surface) {
    surface->mode = dContactApprox1 | dContactBounce;
    surface->mu = s->problem->friction;
    surface->bounce = s->problem->restitution;
    surface->bounce_vel = 1e-6;
}

static void pull_rope(const kt_ode_scene *s) {
    const dReal *at = dBodyGetPosition(s->body[0]);
    const double distance = hypot(at[0], at[2]), depth = distance - s->problem->rope;
    if (s->problem->rope <= 0.0 || depth < 0.0)
        return;
    dContact contact = {
        .geom = {.pos = {at[0], 0.0, at[2]}, .normal = {-at[0] / distance, 0.0, -at[2] / distance}, .depth = depth}};
    dJointAttach(dJointCreateContact(s->world, s->contacts, &contact), s->body[0], NULL);
}

static dBodyID add_body(const kt_ode_scene *s, const kt_events_body *given) {
    const double *half = given->half;
    const bool is_free_x = given->is_free[KT_EVENTS_X], is_free_z = given->is_free[KT_EVENTS_Z];
    dBodyID body = dBodyCreate(s->world);
    dMass mass;
    dGeomID geom;
    dMatrix3 leaning;
    if (given->shape == KT_EVENTS_BALL) {
        dMassSetSphereTotal(&mass, given->mass, half[KT_EVENTS_X]);
        geom = dCreateSphere(s->space, half[KT_EVENTS_X]);
    } else {
        dMassSetBoxTotal(&mass, given->mass, 2.0 * half[KT_EVENTS_X], 0.2, 2.0 * half[KT_EVENTS_Z]);
        geom = dCreateBox(s->space, 2.0 * half[KT_EVENTS_X], 0.2, 2.0 * half[KT_EVENTS_Z]);
    }
    dRFromAxisAndAngle(leaning, 0.0, 1.0, 0.0, given->lean);
    dBodySetPosition(body, given->at[KT_EVENTS_X], 0.0, given->at[KT_EVENTS_Z]);
    dBodySetRotation(body, leaning);
    dBodySetLinearVel(body, given->speed, 0.0, 0.0);
    dBodySetMass(body, &mass);
    dGeomSetBody(geom, body);
    if (is_free_x != is_free_z) {
        dJointID slider = dJointCreateSlider(s->world, NULL);
        dJointAttach(slider, body, NULL);
        dJointSetSliderAxis(slider, is_free_x ? 1.0 : 0.0, 0.0, is_free_z ? 1.0 : 0.0);
    }
    return body;
}

static void build(kt_ode_scene *s) {
    const kt_events_problem *p = s->problem;
    dWorldSetGravity(s->world, p->gravity * sin(p->tilt), 0.0, -p->gravity * cos(p->tilt));
    for (int i = 0; i < p->contact_count; i++)
        if (p->contact[i].lower < 0) {
            const bool is_wall = p->contact[i].axis == KT_EVENTS_X;
            (void)dCreatePlane(s->space, is_wall ? 1.0 : 0.0, 0.0, is_wall ? 0.0 : 1.0, 0.0);
        }
    for (int i = 0; i < p->body_count; i++)
        s->body[i] = add_body(s, &p->body[i]);
}

static void see(kt_events_watch *watch, const kt_ode_scene *s, double t) {
    for (int i = 0; i < s->problem->body_count; i++)
        kt_events_see(watch, i, t, dBodyGetPosition(s->body[i])[s->problem->axis == KT_EVENTS_X ? 0 : 2]);
}

static void push(kt_ode_scene *s, double t) {
    const kt_events_problem *p = s->problem;
    for (int i = 0; i < p->body_count; i++) {
        const double x = dBodyGetPosition(s->body[i])[0];
        const double force = p->body[i].push + (i == 0 ? kt_events_pull(p, x, t) : 0.0);
        if (force != 0.0)
            dBodyAddForce(s->body[i], force, 0.0, 0.0);
    }
    pull_rope(s);
}

bool kt_events_ode(kt_events_watch *watch) {
    static const kt_ode_motion slides = {build, see, push, touch};
    return kt_ode_run(watch, &slides);
}

/* ---- any motion -------------------------------------------------------------------------------------------------- */

typedef struct collision {
    const kt_ode_scene *scene;
    const kt_ode_motion *motion;
} collision;

static void collide(void *data, dGeomID a, dGeomID b) {
    enum { MOST = 8 };
    const collision *c = data;
    dContactGeom found[MOST];
    const int count = dCollide(a, b, MOST, found, sizeof found[0]);
    for (int i = 0; i < count; i++) {
        dContact contact = {.geom = found[i]};
        c->motion->touch(c->scene, &contact.surface);
        dJointAttach(dJointCreateContact(c->scene->world, c->scene->contacts, &contact), dGeomGetBody(a),
                     dGeomGetBody(b));
    }
}

static void say_nothing(int number, const char *format, va_list arguments) {
    (void)number;
    (void)format;
    (void)arguments;
}

static void move(kt_events_watch *watch, kt_ode_scene *s, const kt_ode_motion *motion) {
    const kt_events_problem *p = watch->problem;
    const long every = lround(1e-3 / p->step), steps = lround(p->duration / p->step);
    collision c = {s, motion};
    for (long k = 0; k <= steps; k++) {
        const double t = (double)k * p->step;
        if (k % every == 0)
            motion->see(watch, s, t);
        motion->act(s, t);
        dSpaceCollide(s->space, &c, collide);
        (void)dWorldStep(s->world, p->step);
        dJointGroupEmpty(s->contacts);
    }
}

bool kt_ode_run(kt_events_watch *watch, const kt_ode_motion *motion) {
    dInitODE2(0);
    dSetMessageHandler(say_nothing);
    kt_ode_scene s = {.problem = watch->problem,
                      .world = dWorldCreate(),
                      .space = dSimpleSpaceCreate(NULL),
                      .contacts = dJointGroupCreate(0)};
    motion->build(&s);
    const double begin = kt_events_clock();
    move(watch, &s, motion);
    watch->seconds = kt_events_clock() - begin;
    dJointGroupDestroy(s.contacts);
    dSpaceDestroy(s.space);
    dWorldDestroy(s.world);
    dCloseODE();
    return true;
}
