/* The whip in ODE: links on ball joints, as nothing leaves the plane, and a rope. The rope is a contact while it is
 * taut: the tip touches the sphere of its length from inside. The search covered ERP from 0.2 to 1. It covered CFM from
 * 1e-10 to 1e-5. The solver was dWorldStep, or dWorldQuickStep with up to 300 iterations. The chosen values have the
 * least error. Others have errors up to 1.2e-3. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "../../test/motion/contact/whip.h"

#include "ode.h"

#include <assert.h>
#include <math.h>

static_assert((int)KT_WHIP_LINKS <= (int)KT_ODE_BODIES, "a body a link");

static void build(kt_ode_scene *s) {
    const double l = KT_WHIP_LINK, m = KT_WHIP_MASS, inertia = m * l * l / 12.0;
    dMass mass;
    dWorldSetGravity(s->world, 0.0, -KT_WHIP_GRAVITY, 0.0);
    dWorldSetERP(s->world, 0.5);
    dMassSetParameters(&mass, m, 0.0, 0.0, 0.0, inertia, inertia, inertia, 0.0, 0.0, 0.0);
    for (int i = 0; i < KT_WHIP_LINKS; i++) {
        s->body[i] = dBodyCreate(s->world);
        dBodySetMass(s->body[i], &mass);
        dBodySetPosition(s->body[i], (i + 0.5) * l, 0.0, 0.0);
        dJointID joint = dJointCreateBall(s->world, NULL);
        dJointAttach(joint, s->body[i], i > 0 ? s->body[i - 1] : NULL);
        dJointSetBallAnchor(joint, i * l, 0.0, 0.0);
    }
}

static void pull_rope(kt_ode_scene *s, double t) {
    dVector3 tip;
    (void)t;
    dBodyGetRelPointPos(s->body[KT_WHIP_LINKS - 1], 0.5 * KT_WHIP_LINK, 0.0, 0.0, tip);
    const double x = KT_WHIP_X - tip[0], y = KT_WHIP_Y - tip[1], distance = hypot(x, y),
                 depth = distance - KT_WHIP_ROPE;
    if (depth < 0.0)
        return;
    dContact contact = {
        .geom = {.pos = {tip[0], tip[1], 0.0}, .normal = {x / distance, y / distance, 0.0}, .depth = depth}};
    dJointAttach(dJointCreateContact(s->world, s->contacts, &contact), s->body[KT_WHIP_LINKS - 1], NULL);
}

static void see(kt_events_watch *watch, const kt_ode_scene *s, double t) {
    dVector3 tip;
    dBodyGetRelPointPos(s->body[KT_WHIP_LINKS - 1], 0.5 * KT_WHIP_LINK, 0.0, 0.0, tip);
    kt_events_see(watch, 0, t, tip[0]);
    kt_events_see(watch, 1, t, tip[1]);
}

bool kt_events_whip_ode(kt_events_watch *watch) {
    static const kt_ode_motion whip = {build, see, pull_rope, NULL};
    return kt_ode_run(watch, &whip);
}
