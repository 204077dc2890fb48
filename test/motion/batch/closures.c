/* SPDX-License-Identifier: Apache-2.0 */
#include "closures.h"

#include "kinetree/algebra.h"

#include <stdio.h>

static const kt_vec3 NORMAL = {0.0, 1.0, 0.0}; /* of the plane */

static kt_vec3 draw_vector(const kt_closures *x, double most, kt_random *random) {
    return kt_vec3_make(kt_random_uniform(random, -most, most),
                        x->planar ? 0.0 : kt_random_uniform(random, -most, most),
                        kt_random_uniform(random, -most, most));
}

/* A direction that is no multiple of any other one drawn; in the plane its normal. */
static kt_vec3 draw_axis(const kt_closures *x, kt_random *random) {
    const kt_vec3 axis = kt_vec3_make(kt_random_uniform(random, 0.2, 1.0), kt_random_uniform(random, -1.0, 1.0),
                                      kt_random_uniform(random, -1.0, 1.0));
    return x->planar ? NORMAL : axis;
}

static kt_joint_type draw_joint(const kt_closures *x, kt_random *random) {
    static const kt_joint_type in_space[] = {KT_JOINT_REVOLUTE,  KT_JOINT_REVOLUTE,  KT_JOINT_SPHERICAL,
                                             KT_JOINT_UNIVERSAL, KT_JOINT_PRISMATIC, KT_JOINT_CYLINDRICAL,
                                             KT_JOINT_SCREW,     KT_JOINT_REVOLUTE};
    return x->planar ? KT_JOINT_REVOLUTE : in_space[kt_random_int(random, 0, 7)];
}

static int dofs_of(kt_joint_type type) {
    switch (type) {
    case KT_JOINT_FREE:
        return 6;
    case KT_JOINT_SPHERICAL:
    case KT_JOINT_PLANAR:
        return 3;
    case KT_JOINT_UNIVERSAL:
    case KT_JOINT_CYLINDRICAL:
        return 2;
    default:
        return 1;
    }
}

static int add_link(kt_closures *x, int parent, kt_joint_type type, kt_random *random) {
    const int at = x->description.body_count++;
    kt_body *body = &x->body[at];
    *body = kt_body_default();
    (void)snprintf(x->name[at], sizeof x->name[at], "l%d", at);
    body->name = x->name[at];
    body->parent = parent < 0 ? NULL : x->name[parent];
    body->joint.type = type;
    body->joint.axis = draw_axis(x, random);
    body->joint.axis2 = kt_vec3_cross(body->joint.axis, kt_vec3_make(0.3, 0.4, -0.8));
    body->joint.pitch = 0.2;
    body->joint.at = draw_vector(x, 1.0, random);
    body->mass = kt_random_uniform(random, 0.5, 2.0);
    body->com = draw_vector(x, 0.3, random);
    body->inertia = (kt_sym3){.xx = 0.1, .yy = kt_random_uniform(random, 0.08, 0.15), .zz = 0.12};
    x->at[at] = kt_vec3_add(parent < 0 ? kt_vec3_make(0.0, 0.0, 0.0) : x->at[parent], body->joint.at);
    x->dofs += dofs_of(type);
    return at;
}

static kt_end end_at(const kt_closures *x, int link, kt_vec3 point) {
    kt_end end = {.body = link < 0 ? NULL : x->name[link], .at = point};
    if (link >= 0)
        end.at = kt_vec3_sub(point, x->at[link]);
    return end;
}

kt_loop *kt_closures_add(kt_description *description, kt_loop *loops, char (*names)[KT_CLOSURE_NAME],
                         kt_loop_type type) {
    const int at = description->loop_count++;
    kt_loop *loop = &loops[at];
    *loop = kt_loop_default();
    (void)snprintf(names[at], sizeof names[at], "c%d", at);
    loop->name = names[at];
    loop->type = type;
    return loop;
}

static kt_loop *add_loop(kt_closures *x, kt_loop_type type) {
    return kt_closures_add(&x->description, x->loop, x->loop_name, type);
}

/* Types and their numbers of equations, in space and in a plane. */
static const struct {
    kt_loop_type type;
    int equations, in_plane;
} TYPES[] = {{KT_LOOP_SPHERICAL, 3, 2},  {KT_LOOP_REVOLUTE, 5, 2},    {KT_LOOP_DISTANCE, 1, 1},
             {KT_LOOP_INLINE, 2, 0},     {KT_LOOP_INPLANE, 1, 0},     {KT_LOOP_PARALLEL, 3, 1},
             {KT_LOOP_COAXIAL, 2, 0},    {KT_LOOP_PRISMATIC, 5, 0},   {KT_LOOP_CYLINDRICAL, 4, 0},
             {KT_LOOP_PLANAR, 3, 0},     {KT_LOOP_WELD, 6, 3},        {KT_LOOP_UNIVERSAL, 4, 0},
             {KT_LOOP_ORTHOGONAL, 1, 0}, {KT_LOOP_HOMOKINETIC, 4, 0}, {KT_LOOP_SCREW, 5, 0}};

/* Closes the two paths that end with these links. */
static void close_paths(kt_closures *x, const int last[2], bool driven, kt_random *random) {
    enum { COUNT = sizeof TYPES / sizeof *TYPES };
    const kt_vec3 point =
        kt_vec3_add(last[1] < 0 ? kt_vec3_make(0.0, 0.0, 0.0) : x->at[last[1]], draw_vector(x, 0.8, random));
    int drawn = kt_random_int(random, 0, COUNT - 1);
    for (;; drawn = (drawn + 1) % COUNT) {
        const int equations = x->planar ? TYPES[drawn].in_plane : TYPES[drawn].equations;
        if (equations > 0 && equations < x->dofs)
            break;
    }
    kt_loop *loop = add_loop(x, TYPES[drawn].type);
    loop->axis = draw_axis(x, random);
    loop->axis2 = kt_vec3_cross(loop->axis, kt_vec3_make(0.1, -0.7, 0.5));
    loop->pitch = 0.3;
    loop->between[0] = end_at(x, last[0], point);
    loop->between[1] = end_at(x, last[1], point);
    if (loop->type == KT_LOOP_DISTANCE) {
        const kt_vec3 d = kt_vec3_make(0.4, 0.0, 0.3);
        loop->between[1] = end_at(x, last[1], kt_vec3_add(point, d));
        if (driven)
            loop->function = kt_function_sine(0.02, 1.3, 0.4, kt_vec3_norm(d));
    }
    x->dofs -= x->planar ? TYPES[drawn].in_plane : TYPES[drawn].equations;
}

/* A drive of the first joint of a chain, or a relation of two, if these have one coordinate each. */
static void add_drive(kt_closures *x, int first, bool driven, kt_random *random) {
    const kt_body *body[2] = {&x->body[first], &x->body[first + 1]};
    const int kind = kt_random_int(random, 0, driven ? 2 : 1);
    if (x->dofs < 3 || dofs_of(body[0]->joint.type) > 1)
        return;
    if (driven && kind == 0) {
        kt_loop *loop = add_loop(x, KT_LOOP_MOTION);
        loop->joint = body[0]->name;
        loop->function = kt_function_sine(0.03, 0.7, 0.2, 0.0);
    } else if (dofs_of(body[1]->joint.type) == 1) {
        kt_loop *loop = add_loop(x, kind == 1 ? KT_LOOP_COUPLING : KT_LOOP_RATES);
        kt_term *terms = x->term[x->description.loop_count > 2];
        terms[0] = (kt_term){body[0]->name, 1.0};
        terms[1] = (kt_term){body[1]->name, kt_random_uniform(random, 0.4, 0.8)};
        loop->terms = terms;
        loop->term_count = 2;
        if (kind == 2)
            loop->function = kt_function_sine(0.1, 0.9, 0.0, 0.05);
    }
}

static void add_chain(kt_closures *x, int base, bool driven, kt_random *random) {
    const int count = kt_random_int(random, 4, KT_CLOSURE_BODIES), first = x->description.body_count;
    const int split = kt_random_int(random, 1, count - 1);
    int last[2] = {base, base};
    x->dofs = 0;
    for (int i = 0; i < count; i++)
        last[i < split] = add_link(x, last[i < split], draw_joint(x, random), random);
    close_paths(x, last, driven, random);
    if (split > 1)
        add_drive(x, first, driven, random);
}

void kt_closures_describe(kt_closures *x, bool planar, bool driven, kt_random *random) {
    static const kt_joint_type bases[] = {KT_JOINT_FREE, KT_JOINT_SPHERICAL, KT_JOINT_REVOLUTE};
    const int count = kt_random_int(random, 1, KT_CLOSURES_MOST);
    int base = -1;
    *x = (kt_closures){.planar = planar, .description = kt_description_default()};
    x->description.bodies = x->body;
    x->description.loops = x->loop;
    x->description.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    if (kt_random_int(random, 0, 2))
        base = add_link(x, -1, planar ? KT_JOINT_PLANAR : bases[kt_random_int(random, 0, 2)], random);
    for (int i = 0; i < count; i++)
        add_chain(x, base, driven, random);
    if (base < 0 || kt_random_int(random, 0, 2) == 0) /* armature of a chain's joint */
        for (int k = 0; k < 3; k++)
            x->body[x->description.body_count - 1].joint.armature[k] = 0.2;
    if (base < 0) { /* load on a chain, with armature */
        const int last = x->description.body_count - 1, own = add_link(x, last, KT_JOINT_REVOLUTE, random);
        x->body[add_link(x, own, draw_joint(x, random), random)].joint.armature[0] = 0.2;
        x->body[own].joint.armature[0] = 0.3;
    }
}
