/* SPDX-License-Identifier: Apache-2.0 */
#include "ropes.h"
#include "describe.h"

#include "kinetree/algebra.h"

#include <stdio.h>

static kt_vec3 draw_vector(const kt_ropes *x, double most, kt_random *random) {
    return kt_vec3_make(kt_random_uniform(random, -most, most),
                        x->planar ? 0.0 : kt_random_uniform(random, -most, most),
                        kt_random_uniform(random, -most, most));
}

/* From a link to the next one; of a folded rope nearly along a line, forth or back. */
static kt_vec3 draw_offset(const kt_ropes *x, kt_random *random) {
    const double length = kt_random_uniform(random, 0.3, 0.6);
    const bool back = x->folded && kt_random_int(random, 0, 1);
    return kt_vec3_add(kt_vec3_make(back ? -length : length, 0.0, 0.0), draw_vector(x, x->folded ? 1e-3 : 0.4, random));
}

/* In the plane now and then a prismatic joint; in space any with up to three degrees of freedom. */
static kt_joint_type draw_joint(const kt_ropes *x, kt_random *random) {
    static const kt_joint_type in_space[] = {KT_JOINT_REVOLUTE,  KT_JOINT_SPHERICAL, KT_JOINT_REVOLUTE,
                                             KT_JOINT_UNIVERSAL, KT_JOINT_PRISMATIC, KT_JOINT_SCREW};
    if (x->planar)
        return !x->folded && kt_random_int(random, 0, 5) == 0 ? KT_JOINT_PRISMATIC : KT_JOINT_REVOLUTE;
    return in_space[kt_random_int(random, 0, 5)];
}

static int add_link(kt_ropes *x, int parent, kt_joint_type type, kt_random *random) {
    const int at = x->description.body_count++;
    kt_body *body = &x->body[at];
    const kt_vec3 normal = kt_vec3_make(0.0, kt_random_int(random, 0, 1) ? 1.0 : -1.0, 0.0);
    *body = kt_body_default();
    (void)snprintf(x->name[at], sizeof x->name[at], "l%d", at);
    body->name = x->name[at];
    body->parent = parent < 0 ? NULL : x->name[parent];
    body->joint.type = type;
    body->joint.axis = x->planar && type == KT_JOINT_REVOLUTE
                           ? normal
                           : kt_vec3_add(kt_vec3_make(0.5, 0.0, 0.2), draw_vector(x, 0.4, random));
    body->joint.axis2 = kt_vec3_cross(body->joint.axis, kt_vec3_make(0.3, 0.4, -0.8));
    body->joint.pitch = 0.2;
    body->joint.at = draw_offset(x, random);
    body->mass = kt_random_uniform(random, 0.5, 2.0);
    body->com = draw_vector(x, 0.2, random);
    body->inertia = (kt_sym3){.xx = 0.1, .yy = kt_random_uniform(random, 0.08, 0.15), .zz = 0.12};
    x->at[at] = kt_vec3_add(parent < 0 ? kt_vec3_make(0.0, 0.0, 0.0) : x->at[parent], body->joint.at);
    return at;
}

static kt_loop *add_loop(kt_ropes *x, kt_loop_type type) {
    return kt_closures_add(&x->description, x->loop, x->loop_name, type);
}

/* Ties a link to the ground; returns how many equations that takes. */
static int tie(kt_ropes *x, int link, int most, kt_random *random) {
    static const struct {
        kt_loop_type type;
        int equations, in_plane; /* 0: not in a plane */
    } TYPES[] = {{KT_LOOP_SPHERICAL, 3, 2}, {KT_LOOP_DISTANCE, 1, 1},   {KT_LOOP_REVOLUTE, 5, 2},
                 {KT_LOOP_INLINE, 2, 0},    {KT_LOOP_UNIVERSAL, 4, 0},  {KT_LOOP_INPLANE, 1, 0},
                 {KT_LOOP_PARALLEL, 3, 1},  {KT_LOOP_CYLINDRICAL, 4, 0}};
    enum { COUNT = sizeof TYPES / sizeof *TYPES };
    int drawn = x->folded ? 0 : kt_random_int(random, 0, COUNT - 1), equations;
    for (;; drawn = (drawn + 1) % COUNT) {
        equations = x->planar ? TYPES[drawn].in_plane : TYPES[drawn].equations;
        if (equations > 0 && equations <= most)
            break;
    }
    const kt_vec3 tip = draw_offset(x, random), point = kt_vec3_add(x->at[link], tip);
    kt_loop *loop = add_loop(x, TYPES[drawn].type);
    loop->axis = x->planar ? kt_vec3_make(0.0, 1.0, 0.0) : kt_vec3_make(0.2, 0.9, -0.4);
    loop->axis2 = kt_vec3_cross(loop->axis, kt_vec3_make(0.1, -0.7, 0.5));
    loop->between[0] = (kt_end){.body = x->name[link], .at = tip};
    loop->between[1] = (kt_end){.at = point};
    if (loop->type == KT_LOOP_DISTANCE) {
        const kt_vec3 d = kt_vec3_make(0.4, 0.0, 0.3);
        loop->between[1].at = kt_vec3_add(point, d);
        if (kt_random_int(random, 0, 1))
            loop->function = kt_function_sine(0.02, 1.3, 0.4, kt_vec3_norm(d));
    }
    return equations;
}

static bool has_one_dof(const kt_body *body) {
    return body->joint.type != KT_JOINT_SPHERICAL && body->joint.type != KT_JOINT_UNIVERSAL;
}

/* A drive of a joint, or a relation of two. */
static void add_relation(kt_ropes *x, int rope, int first, kt_random *random) {
    const kt_body *a = &x->body[first + 1], *b = &x->body[first + 3];
    if (!has_one_dof(a) || !has_one_dof(b))
        return;
    if (kt_random_int(random, 0, 1)) {
        kt_loop *drive = add_loop(x, KT_LOOP_MOTION);
        drive->joint = a->name;
        drive->function = kt_function_sine(0.03, 0.7, 0.2, 0.0);
        return;
    }
    kt_loop *gear = add_loop(x, KT_LOOP_COUPLING);
    x->term[rope][0] = (kt_term){a->name, 1.0};
    x->term[rope][1] = (kt_term){b->name, kt_random_uniform(random, 0.4, 0.8)};
    gear->terms = x->term[rope];
    gear->term_count = 2;
}

static void add_damper(kt_ropes *x, int link, kt_random *random) {
    kt_effect *damper = &x->effect[x->description.effect_count];
    if (!has_one_dof(&x->body[link]))
        return;
    *damper = kt_effect_of(KT_EFFECT_JOINT_DAMPER, x->name[link]);
    damper->damping = kt_random_uniform(random, 0.1, 1.0);
    x->description.effect_count++;
}

/* A chain of links, tied to the ground at its end and, with a branch, in its middle. */
static void add_rope(kt_ropes *x, int rope, kt_random *random) {
    const int first = x->description.body_count, count = kt_random_int(random, 10, KT_ROPE_LINKS);
    int link = -1, left = 4;
    for (int i = 0; i < count; i++)
        link = add_link(x, link, draw_joint(x, random), random);
    if (kt_random_int(random, 0, 1)) { /* load on the rope */
        const int carried = add_link(x, first + count / 2, draw_joint(x, random), random);
        x->body[carried].joint.armature[0] = 0.1;
    }
    left -= tie(x, link, x->planar ? 2 : 3 + kt_random_int(random, 0, 1), random);
    if (left > 0 && kt_random_int(random, 0, 1)) {
        add_relation(x, rope, first, random);
        left--;
    }
    if (left > 0 && !x->folded && kt_random_int(random, 0, 1)) {
        link = add_link(x, first + 4, draw_joint(x, random), random);
        link = add_link(x, link, draw_joint(x, random), random);
        (void)tie(x, link, left, random);
    }
    for (int i = 0; i < count && kt_random_int(random, 0, 2) == 0; i++)
        if (has_one_dof(&x->body[first + i]))
            x->body[first + i].joint.armature[0] = 0.2;
    add_damper(x, first + 2, random);
}

void kt_ropes_describe(kt_ropes *x, bool planar, bool folded, kt_random *random) {
    const int count = kt_random_int(random, 1, KT_ROPES_MOST);
    *x = (kt_ropes){.planar = planar || folded, .folded = folded, .description = kt_description_default()};
    x->description.bodies = x->body;
    x->description.loops = x->loop;
    x->description.effects = x->effect;
    x->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    for (int i = 0; i < count; i++) {
        add_rope(x, i, random);
        x->folded = false;
    }
}
