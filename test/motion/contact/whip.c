/* A whip whose end hangs on a slack rope. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "whip.h"
#include "describe.h"

#include <math.h>
#include <stdio.h>

void kt_whip_make(kt_whip *w, double restitution, bool has_rope) {
    *w = (kt_whip){.description = kt_description_default()};
    for (int i = 0; i < KT_WHIP_LINKS; i++) {
        kt_body *body = &w->body[i];
        *body = kt_body_default();
        (void)snprintf(w->name[i], sizeof w->name[i], "w%d", i);
        body->name = w->name[i];
        body->parent = i > 0 ? w->name[i - 1] : NULL;
        body->joint.type = KT_JOINT_REVOLUTE;
        body->joint.axis = kt_vec3_make(0.0, 0.0, 1.0);
        body->joint.at = kt_vec3_make(i > 0 ? KT_WHIP_LINK : 0.0, 0.0, 0.0);
        body->mass = KT_WHIP_MASS;
        body->com = kt_vec3_make(0.5 * KT_WHIP_LINK, 0.0, 0.0);
        body->inertia.zz = body->inertia.yy = KT_WHIP_MASS * KT_WHIP_LINK * KT_WHIP_LINK / 12.0;
    }
    w->rope = kt_loop_of("rope", KT_LOOP_DISTANCE);
    w->rope.slack = true;
    w->rope.restitution = restitution;
    w->rope.between[0].at = kt_vec3_make(KT_WHIP_X, KT_WHIP_Y, 0.0);
    w->rope.between[1] = (kt_end){.body = w->name[KT_WHIP_LINKS - 1], .at = kt_vec3_make(KT_WHIP_LINK, 0.0, 0.0)};
    w->rope.function = kt_function_constant(KT_WHIP_ROPE);
    w->description.gravity = kt_vec3_make(0.0, -KT_WHIP_GRAVITY, 0.0);
    w->description.bodies = w->body;
    w->description.body_count = KT_WHIP_LINKS;
    w->description.loops = &w->rope;
    w->description.loop_count = has_rope;
}

void kt_whip_tip(const double *q, double *x, double *y) {
    double angle = 0.0;
    *x = *y = 0.0;
    for (int i = 0; i < KT_WHIP_LINKS; i++) {
        angle += q[i];
        *x += KT_WHIP_LINK * cos(angle);
        *y += KT_WHIP_LINK * sin(angle);
    }
}

double kt_whip_stretch(const double *q) {
    double x, y;
    kt_whip_tip(q, &x, &y);
    return hypot(x - KT_WHIP_X, y - KT_WHIP_Y) - KT_WHIP_ROPE;
}
