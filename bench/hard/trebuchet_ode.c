/* The trebuchet in ODE: hinges, and a joint that fixes the distance of two points (dJointTypeDBall). This joint is
 * disabled after the step in which the ball comes to the height of the release. ERP and CFM have ODE's defaults. The
 * search covered ERP from 0.05 to 0.8. It covered CFM from 0 to 1e-6. None of these values do better. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "ode.h"
#include "trebuchet.h"

#include <math.h>

enum { BEAM, BOX, BALL };

static void add_body(kt_ode_scene *s, int which, double mass, double inertia, double x, double y) {
    dMass m;
    dMassSetParameters(&m, mass, 0.0, 0.0, 0.0, inertia, inertia, inertia, 0.0, 0.0, 0.0);
    s->body[which] = dBodyCreate(s->world);
    dBodySetMass(s->body[which], &m);
    dBodySetPosition(s->body[which], x, y, 0.0);
}

static void add_hinge(const kt_ode_scene *s, dBodyID body, dBodyID on, double x, double y) {
    dJointID hinge = dJointCreateHinge(s->world, NULL);
    dJointAttach(hinge, body, on);
    dJointSetHingeAnchor(hinge, x, y, 0.0);
    dJointSetHingeAxis(hinge, 0.0, 0.0, 1.0);
}

static void build(kt_ode_scene *s) {
    const kt_trebuchet *given = &kt_trebuchet_data;
    double y[KT_TREBUCHET_STATES], ball[4];
    kt_trebuchet_start(y);
    kt_trebuchet_ball(y, ball);
    const double along[2] = {cos(y[0]), sin(y[0])};
    const double hinge[2] = {-given->short_arm * along[0], -given->short_arm * along[1]};
    dWorldSetGravity(s->world, 0.0, -given->gravity, 0.0);
    add_body(s, BEAM, given->beam, given->beam_inertia, 0.0, 0.0);
    add_body(s, BOX, given->box, given->box_inertia, hinge[0] + given->hangs * cos(y[1]),
             hinge[1] + given->hangs * sin(y[1]));
    add_body(s, BALL, given->ball, 0.01, ball[0], ball[1]);
    add_hinge(s, s->body[BEAM], NULL, 0.0, 0.0);
    add_hinge(s, s->body[BOX], s->body[BEAM], hinge[0], hinge[1]);
    s->joint = dJointCreateDBall(s->world, NULL);
    dJointAttach(s->joint, s->body[BEAM], s->body[BALL]);
    dJointSetDBallAnchor1(s->joint, given->long_arm * along[0], given->long_arm * along[1], 0.0);
    dJointSetDBallAnchor2(s->joint, ball[0], ball[1], 0.0);
}

static void see(kt_events_watch *watch, const kt_ode_scene *s, double t) {
    const dReal *at = dBodyGetPosition(s->body[BALL]), *speed = dBodyGetLinearVel(s->body[BALL]);
    kt_trebuchet_see(watch, t, (double[4]){at[0], at[1], speed[0], speed[1]});
}

static void let_go(kt_ode_scene *s, double t) {
    (void)t;
    if (dBodyGetPosition(s->body[BALL])[1] >= kt_trebuchet_data.release)
        dJointDisable(s->joint);
}

bool kt_events_trebuchet_ode(kt_events_watch *watch) {
    static const kt_ode_motion trebuchet = {build, see, let_go, NULL};
    return kt_ode_run(watch, &trebuchet);
}
