/* SPDX-License-Identifier: Apache-2.0 */
#include "linkages.h"
#include "describe.h"

#include <stdio.h>

static int body_of(const kt_linkages *x, const kt_body *body) { return (int)(body - x->body); }

static kt_vec3 draw_offset(bool flat, kt_random *random) {
    const double x = kt_random_uniform(random, 0.3, 1.0);
    return kt_vec3_make(x, 0.0, flat ? 0.0 : kt_random_uniform(random, -1.0, 1.0));
}

/* A link on another one (-1: on the ground): a revolute joint about y or, now and then, a prismatic one in the
 * plane. */
static int add_link(kt_linkages *x, int parent, kt_vec3 offset, bool prismatic, kt_random *random) {
    kt_body *body = &x->body[x->description.body_count++];
    const int at = body_of(x, body);
    *body = kt_body_default();
    (void)snprintf(x->name[at], sizeof x->name[at], "l%d", at);
    body->name = x->name[at];
    body->parent = parent < 0 ? NULL : x->name[parent];
    body->joint.type = prismatic ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE;
    body->joint.axis = prismatic ? kt_vec3_make(0.8, 0.0, 0.6) : kt_vec3_make(0.0, at % 3 ? 1.0 : -1.0, 0.0);
    body->joint.at = offset;
    body->mass = kt_random_uniform(random, 0.5, 2.0);
    body->com = kt_vec3_make(kt_random_uniform(random, -0.2, 0.5), 0.0, kt_random_uniform(random, -0.2, 0.2));
    body->inertia = (kt_sym3){.xx = 0.1, .yy = kt_random_uniform(random, 0.05, 0.2), .zz = 0.1};
    x->at[at] = kt_vec3_add(parent < 0 ? kt_vec3_make(0.0, 0.0, 0.0) : x->at[parent], offset);
    return at;
}

static kt_end end_at(const kt_linkages *x, int link, kt_vec3 point) {
    kt_end end = {.body = link < 0 ? NULL : x->name[link], .at = point};
    if (link >= 0)
        end.at = kt_vec3_sub(point, x->at[link]);
    return end;
}

/* Two paths of three links in all, held together by a pin. Returns the last link. */
static int add_linkage(kt_linkages *x, int parent, bool flat, kt_random *random) {
    const int first = kt_random_int(random, 0, 3), slides = kt_random_int(random, 0, 5);
    int last[2] = {parent, parent};
    for (int k = 0; k < 3; k++) {
        int *on = &last[k < first ? 0 : 1];
        *on = add_link(x, *on, draw_offset(flat, random), k == slides, random);
    }
    kt_vec3 point =
        kt_vec3_make(kt_random_uniform(random, 0.2, 1.0), 0.0, flat ? 0.0 : kt_random_uniform(random, 0.2, 1.0));
    if (last[1] >= 0)
        point = kt_vec3_add(point, x->at[last[1]]);
    kt_loop *loop = &x->loop[x->description.loop_count++];
    *loop = kt_loop_of(x->name[last[0] > last[1] ? last[0] : last[1]], KT_LOOP_REVOLUTE);
    loop->axis = kt_vec3_make(0.0, 1.0, 0.0);
    loop->between[0] = end_at(x, last[0], point);
    loop->between[1] = end_at(x, last[1], point);
    return x->description.body_count - 1;
}

static void add_effects(kt_linkages *x, int link, kt_random *random) {
    kt_effect *spring = &x->effect[x->description.effect_count++];
    *spring = kt_effect_of(KT_EFFECT_JOINT_SPRING, x->name[link]);
    spring->stiffness = kt_random_uniform(random, 1.0, 20.0);
    spring->damping = 0.5;
    kt_effect *foot = &x->effect[x->description.effect_count++];
    *foot = kt_effect_of(KT_EFFECT_CONTACT, NULL);
    foot->between[0] = (kt_end){.body = x->name[link], .at = {0.3, 0.0, -0.2}};
    foot->radius = 0.5;
    foot->stiffness = 1e3;
    foot->exponent = 1.5;
    foot->friction = 0.5;
    foot->slip = 0.01;
    foot->rolling = link % 3 == 0 ? 0.05 : 0.0;
    foot->axle = kt_vec3_make(0.0, link % 2 ? 1.0 : 0.0, 0.0);
}

void kt_linkages_describe(kt_linkages *x, bool flat, kt_random *random) {
    const int count = kt_random_int(random, 1, KT_LINKAGES_MOST);
    int parent = -1;
    *x = (kt_linkages){.description = kt_description_default()};
    x->description.bodies = x->body;
    x->description.loops = x->loop;
    x->description.effects = x->effect;
    x->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    if (kt_random_int(random, 0, 2)) {
        parent = add_link(x, -1, draw_offset(false, random), false, random);
        if (kt_random_int(random, 0, 1)) {
            x->body[parent].joint.type = KT_JOINT_PLANAR;
            x->body[parent].joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
        } else if (kt_random_int(random, 0, 1)) {
            x->body[parent].joint.armature[0] = 0.3;
        }
    }
    for (int i = 0; i < count; i++) {
        const int last = add_linkage(x, parent, flat && i == 0, random);
        if (kt_random_int(random, 0, 1))
            add_effects(x, last, random);
        if (kt_random_int(random, 0, 1)) /* load on the linkage, and perhaps another linkage on this load */
            parent = add_link(x, last, draw_offset(false, random), false, random);
    }
}
