/* SPDX-License-Identifier: Apache-2.0 */
#include "mechanisms.h"

#include "kinetree/description.h"

#include <math.h>
#include <stdio.h>

static const kt_vec3 along_x = {1.0, 0.0, 0.0}, along_y = {0.0, 1.0, 0.0}, along_z = {0.0, 0.0, 1.0};

/* Adds a box of the given mass and size on a joint. parent: an index, or -1. Returns the index of the body. */
static int add_body(kt_contact_mechanism *m, int parent, kt_joint_type type, kt_vec3 axis, kt_vec3 at, double mass,
                    kt_vec3 com, kt_vec3 size) {
    const int index = m->bodies++;
    kt_body *b = &m->body[index];
    const double x = size.x * size.x, y = size.y * size.y, z = size.z * size.z, part = mass / 12.0;
    (void)snprintf(m->name[index], sizeof m->name[index], "b%d", index);
    *b = kt_body_default();
    b->name = m->name[index];
    b->parent = parent >= 0 ? m->name[parent] : NULL;
    b->joint.type = type;
    b->joint.axis = axis;
    b->joint.at = at;
    b->mass = mass;
    b->com = com;
    b->inertia = (kt_sym3){part * (y + z), part * (x + z), part * (x + y), 0.0, 0.0, 0.0};
    return index;
}

static int add_hinge(kt_contact_mechanism *m, int parent, kt_vec3 axis, kt_vec3 at, double angle, double mass,
                     double com, kt_vec3 size) {
    const int index = add_body(m, parent, KT_JOINT_REVOLUTE, axis, at, mass, kt_vec3_make(0.0, 0.0, com), size);
    m->body[index].joint.position[0] = angle;
    return index;
}

static int add_base(kt_contact_mechanism *m, double height, double mass, kt_vec3 com, kt_vec3 size) {
    const int index = add_body(m, -1, KT_JOINT_FREE, along_z, kt_vec3_make(0.0, 0.0, 0.0), mass, com, size);
    m->body[index].joint.position[2] = height;
    m->body[index].joint.position[3] = 1.0;
    return index;
}

static void add_contact(kt_contact_mechanism *m, int body, kt_vec3 at, double radius, double friction) {
    m->item[m->items++] = (kt_mechanism_item){.body = m->name[body], .at = at, .radius = radius, .friction = friction};
}

static void add_stop(kt_contact_mechanism *m, int body, double lower) {
    m->item[m->items++] = (kt_mechanism_item){.stop = true, .body = m->name[body], .lower = lower};
}

/* A box on the first `corners` of its four contacts. The others are 1 mm higher. */
static void add_box(kt_contact_mechanism *m, int corners, kt_vec3 com) {
    const kt_vec3 size = kt_vec3_make(0.4, 0.3, 0.2);
    const int box = add_base(m, 0.12, 2.0, com, size);
    for (int k = 0; k < 4; k++)
        add_contact(m, box, kt_vec3_make(k & 1 ? 0.2 : -0.2, k & 2 ? 0.15 : -0.15, k < corners ? -0.1 : -0.099), 0.02,
                    0.6);
}

void kt_mechanism_box(kt_contact_mechanism *m) { add_box(m, 4, kt_vec3_make(0.01, -0.02, 0.015)); }

void kt_mechanism_tripod(kt_contact_mechanism *m) { add_box(m, 3, kt_vec3_make(0.01, -0.02, 0.015)); }

void kt_mechanism_block(kt_contact_mechanism *m) {
    add_box(m, 4, kt_vec3_make(0.0, 0.0, 0.0));
    m->body[0].joint.position[2] = KT_BLOCK_LOW + KT_BLOCK_DROP;
    m->body[0].joint.velocity[0] = KT_BLOCK_SPEED;
}

/* A sphere on a level floor would roll on: no law of this bench resists that. */
void kt_mechanism_heap(kt_contact_mechanism *m) {
    static const double radius = 0.05, width = 0.14;
    for (int side = -1; side <= 1; side += 2) {
        m->plane[m->planes++].normal = kt_vec3_make(0.28 * side, 0.0, 0.96);
        m->plane[m->planes++].normal = kt_vec3_make(0.0, 0.28 * side, 0.96);
        m->plane[m->planes++] =
            (kt_mechanism_plane){kt_vec3_make(-side * width, 0.0, 0.0), kt_vec3_make(side, 0.0, 0.0)};
        m->plane[m->planes++] =
            (kt_mechanism_plane){kt_vec3_make(0.0, -side * width, 0.0), kt_vec3_make(0.0, side, 0.0)};
    }
    for (int i = 0; i < KT_MECHANISM_ITEMS; i++) {
        const int layer = i / 4;
        const double size = 2.0 * sqrt(0.6) * radius; /* 2/5 m r^2 */
        const int ball =
            add_base(m, 0.08 + 0.115 * layer, 1.0, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(size, size, size));
        m->body[ball].joint.position[0] = (i & 1 ? -0.06 : 0.06) + 0.008 * sin(7.0 * i);
        m->body[ball].joint.position[1] = (i & 2 ? -0.06 : 0.06) + 0.008 * sin(11.0 * i + 1.0);
        add_contact(m, ball, kt_vec3_make(0.0, 0.0, 0.0), radius, 0.5);
    }
    m->touches = true;
}

void kt_mechanism_quadruped(kt_contact_mechanism *m) {
    const kt_vec3 size = kt_vec3_make(0.06, 0.06, 0.25);
    const int trunk = add_base(m, 0.45, 9.0, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.6, 0.3, 0.15));
    for (int leg = 0; leg < 4; leg++) {
        const double side = leg % 2 ? -1.0 : 1.0;
        const kt_vec3 hip = kt_vec3_make(leg < 2 ? 0.3 : -0.3, 0.15 * side, 0.0);
        int last = add_hinge(m, trunk, along_x, hip, 0.0, 0.8, 0.0, size);
        last = add_hinge(m, last, along_y, kt_vec3_make(0.0, 0.06 * side, 0.0), 0.6, 0.6, -0.11, size);
        last = add_hinge(m, last, along_y, kt_vec3_make(0.0, 0.0, -0.25), -1.2, 0.4, -0.11, size);
        add_contact(m, last, kt_vec3_make(0.0, 0.0, -0.25), 0.02, 0.7);
    }
}

static void add_arm(kt_contact_mechanism *m, int trunk, double side) {
    const kt_vec3 axis[4] = {along_y, along_x, along_z, along_y}, size = kt_vec3_make(0.07, 0.07, 0.22);
    for (int k = 0, last = trunk; k < 4; k++) {
        const kt_vec3 at =
            k == 0 ? kt_vec3_make(0.0, 0.22 * side, 0.35) : kt_vec3_make(0.0, 0.0, k == 3 ? -0.25 : -0.02);
        last = add_hinge(m, last, axis[k], at, k == 3 ? -0.6 : 0.1 * (side + 0.5), k == 3 ? 1.2 : 0.7, -0.1, size);
    }
}

static void add_leg(kt_contact_mechanism *m, int pelvis, double side) {
    static const double angle[6] = {0.0, 0.0, -0.35, 0.7, -0.35, 0.0}, mass[6] = {0.5, 0.5, 4.0, 4.0, 0.5, 1.0};
    const kt_vec3 axis[6] = {along_z, along_x, along_y, along_y, along_y, along_x};
    int last = pelvis;
    for (int k = 0; k < 6; k++) {
        const bool big = k == 2 || k == 3;
        const kt_vec3 at =
            k == 0 ? kt_vec3_make(0.0, 0.1 * side, -0.05) : kt_vec3_make(0.0, 0.0, k == 3 || k == 4 ? -0.38 : -0.01);
        last = add_hinge(m, last, axis[k], at, angle[k], mass[k], big ? -0.18 : -0.02,
                         big ? kt_vec3_make(0.1, 0.1, 0.38) : kt_vec3_make(0.08, 0.06, 0.05));
    }
    for (int k = 0; k < 4; k++)
        add_contact(m, last, kt_vec3_make(k & 1 ? 0.15 : -0.06, k & 2 ? 0.045 : -0.045, -0.05), 0.01, 0.8);
}

void kt_mechanism_humanoid(kt_contact_mechanism *m) {
    const kt_vec3 axis[3] = {along_z, along_x, along_y};
    const int pelvis = add_base(m, 0.9, 8.0, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(0.2, 0.3, 0.15));
    int trunk = pelvis;
    for (int k = 0; k < 3; k++)
        trunk = add_hinge(m, trunk, axis[k], kt_vec3_make(0.0, 0.0, k ? 0.03 : 0.08), 0.0, k == 2 ? 18.0 : 0.6,
                          k == 2 ? 0.2 : 0.0, k == 2 ? kt_vec3_make(0.2, 0.35, 0.45) : kt_vec3_make(0.06, 0.06, 0.06));
    for (int side = -1; side <= 1; side += 2)
        add_arm(m, trunk, side);
    for (int side = -1; side <= 1; side += 2)
        add_leg(m, pelvis, side);
}

void kt_mechanism_biped(kt_contact_mechanism *m) {
    const int pelvis = add_base(m, 0.9, 20.0, kt_vec3_make(0.0, 0.0, 0.1), kt_vec3_make(0.2, 0.3, 0.3));
    for (int side = -1; side <= 1; side += 2)
        add_leg(m, pelvis, side);
}

void kt_mechanism_chain(kt_contact_mechanism *m) {
    for (int i = 0; i < 20; i++) {
        const int link = add_hinge(m, i - 1, i % 2 ? along_x : along_y, kt_vec3_make(0.0, 0.0, i ? -0.1 : 0.0), 0.1,
                                   0.2, -0.05, kt_vec3_make(0.02, 0.02, 0.1));
        if (i % 2 == 0)
            add_stop(m, link, 0.1);
    }
}

void kt_mechanism_fourbar(kt_contact_mechanism *m) {
    const kt_vec3 ground = kt_vec3_make(0.0, 0.0, 0.0);
    const int crank = add_body(m, -1, KT_JOINT_REVOLUTE, along_y, ground, 0.5, kt_vec3_make(0.15, 0.0, 0.0),
                               kt_vec3_make(0.3, 0.02, 0.02));
    const int coupler = add_body(m, crank, KT_JOINT_REVOLUTE, along_y, kt_vec3_make(0.3, 0.0, 0.0), 1.0,
                                 kt_vec3_make(0.4, 0.0, 0.0), kt_vec3_make(0.8, 0.02, 0.02));
    const int rocker = add_body(m, -1, KT_JOINT_REVOLUTE, along_y, kt_vec3_make(0.9, 0.0, 0.0), 0.7,
                                kt_vec3_make(0.3, 0.0, 0.0), kt_vec3_make(0.6, 0.02, 0.02));
    const int rod =
        add_hinge(m, coupler, along_y, kt_vec3_make(0.4, 0.0, 0.0), 0.0, 0.6, -0.2, kt_vec3_make(0.03, 0.03, 0.4));
    m->body[crank].joint.position[0] = -1.1;
    m->body[coupler].joint.position[0] = 1.0;
    m->body[rocker].joint.position[0] = -1.4;
    (void)rod;
    add_stop(m, rocker, -3.0);
    m->closed = true;
}

/* ---- the description --------------------------------------------------------------------------------------------- */

static kt_effect *add_effect(kt_contact_mechanism *m, int *count, const kt_mechanism_item *item) {
    kt_effect *effect = &m->effect[*count];
    (void)snprintf(m->effect_name[*count], sizeof m->effect_name[*count], "c%d", *count);
    *effect = kt_effect_default();
    effect->name = m->effect_name[(*count)++];
    effect->type = item->stop ? KT_EFFECT_JOINT_LIMIT : KT_EFFECT_CONTACT;
    effect->friction = item->friction;
    effect->restitution = item->restitution; /* hard */
    effect->radius = item->radius;
    if (item->stop) {
        effect->joint = item->body;
        effect->lower = item->lower;
    } else {
        effect->between[0].body = item->body;
        effect->between[0].at = item->at;
    }
    return effect;
}

/* The effects of an item: its stop, or its contacts with planes and with the items before. */
static void add_effects(kt_contact_mechanism *m, int *count, int which) {
    const kt_mechanism_item *item = &m->item[which];
    if (item->stop)
        (void)add_effect(m, count, item);
    for (int k = 0; k < m->planes && !item->stop; k++) {
        kt_effect *effect = add_effect(m, count, item);
        effect->between[1].at = m->plane[k].at;
        effect->axis = m->plane[k].normal;
    }
    for (int k = 0; k < which && m->touches; k++) {
        kt_effect *effect = add_effect(m, count, item);
        effect->between[1].body = m->item[k].body;
        effect->between[1].at = m->item[k].at;
        effect->radius2 = m->item[k].radius;
    }
}

kt_description kt_mechanism_describe(kt_contact_mechanism *m, bool contacts) {
    kt_description d = kt_description_default();
    if (m->planes == 0)
        m->plane[m->planes++].normal = along_z;
    for (int k = 0; k < m->items && contacts; k++)
        add_effects(m, &d.effect_count, k);
    m->pin = kt_loop_default();
    m->pin.name = "pin";
    m->pin.type = KT_LOOP_SPHERICAL;
    m->pin.between[0].body = m->name[1];
    m->pin.between[0].at = kt_vec3_make(0.8, 0.0, 0.0);
    m->pin.between[1].body = m->name[2];
    m->pin.between[1].at = kt_vec3_make(0.6, 0.0, 0.0);
    d.bodies = m->body;
    d.body_count = m->bodies;
    d.loops = &m->pin;
    d.loop_count = m->closed;
    d.effects = m->effect;
    d.gravity = kt_vec3_make(0.0, 0.0, -9.81);
    return d;
}

kt_status kt_mechanism_compile(kt_contact_mechanism *m, bool contacts, kt_isa isa, kt_model **model, kt_error *error) {
    const kt_description d = kt_mechanism_describe(m, contacts);
    kt_model_options options = kt_model_options_default();
    options.isa = isa;
    options.contact_switches = KT_SWITCH_MAX;
    return kt_model_compile(&d, &options, model, error);
}
