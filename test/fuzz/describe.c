/* A tree of bodies from bytes. After the last byte, zeros follow, and zeros are the plainest choice everywhere. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "fuzz.h"

#include <string.h>

static const char *const names[KT_FUZZ_BODIES] = {"a", "b", "c", "d", "e", "f"};
static const char *const marker_names[KT_FUZZ_MARKERS] = {"tip", "top"};

/* Names that no body has, or that none may have. */
static const char *wrong_name(kt_bytes *bytes) {
    static char longest[1000];
    static const char *const wrong[] = {NULL,       "",     "world", "a b",   "zz",  "1a",
                                        "\xC3\x28", "\x01", "a.tip", longest, "%n%s"};
    memset(longest, 'x', sizeof longest - 1);
    return wrong[kt_bytes_pick(bytes, sizeof wrong / sizeof *wrong)];
}

const char *kt_fuzz_name(kt_bytes *bytes, const kt_fuzz_mechanism *m, int body) {
    if (m->wild == KT_WILD_ALL && kt_bytes_pick(bytes, 16) == 15)
        return wrong_name(bytes);
    return body < 0 ? NULL : names[body % KT_FUZZ_BODIES];
}

kt_vec3 kt_fuzz_axis(kt_bytes *bytes, kt_wildness wild) {
    const int kind = kt_bytes_pick(bytes, 8);
    if (kind < 6) {
        const double sign = kind < 3 ? 1.0 : -1.0;
        return kt_vec3_make(kind % 3 == 1 ? sign : 0.0, kind % 3 == 2 ? sign : 0.0, kind % 3 == 0 ? sign : 0.0);
    }
    kt_vec3 axis = kt_bytes_vector(bytes, wild);
    if (wild < KT_WILD_NUMBERS && axis.x == 0.0 && axis.y == 0.0 && axis.z == 0.0)
        axis.z = 1.0;
    return axis;
}

/* A rotation from any numbers. If they must be those of a rotation, the function corrects them. */
void kt_fuzz_rotation(kt_bytes *bytes, kt_wildness wild, kt_rotation *rotation) {
    static const int sequences[] = {121, 123, 131, 132, 212, 213, 231, 232, 312, 313, 321, 323, 0, 111, -313};
    const int type = kt_bytes_pick(bytes, 16);
    memset(rotation, 0, sizeof *rotation);
    if (type > KT_ROTATION_MATRIX + (wild == KT_WILD_ALL ? 3 : 0)) /* most have none */
        return;
    rotation->type = (kt_rotation_type)type;
    if (type == KT_ROTATION_NONE)
        return;
    rotation->sequence = sequences[kt_bytes_pick(bytes, wild == KT_WILD_ALL ? 15 : 12)];
    for (int i = 0; i < (type == KT_ROTATION_MATRIX ? 9 : 4); i++)
        rotation->value[i] = kt_bytes_number(bytes, wild);
    if (wild == KT_WILD_ALL && kt_bytes_chance(bytes))
        return;
    double *x = rotation->value;
    if (type == KT_ROTATION_AXIS_ANGLE && x[0] == 0.0 && x[1] == 0.0 && x[2] == 0.0)
        x[2] = 1.0;
    if (type != KT_ROTATION_QUATERNION && type != KT_ROTATION_MATRIX)
        return;
    const kt_quat given = kt_quat_make(x[0] == 0.0 ? 1.0 : x[0], x[1], x[2], x[3]);
    const kt_quat q = kt_quat_normalize(given);
    *rotation = type == KT_ROTATION_QUATERNION ? kt_rotation_quaternion(q.w, q.x, q.y, q.z)
                                               : kt_rotation_matrix(kt_mat3_from_quat(q));
}

/* ---- a body ------------------------------------------------------------------------------------------------------ */

static void describe_coordinates(kt_bytes *bytes, kt_wildness wild, kt_joint *joint) {
    const int first = joint->type == KT_JOINT_FREE ? 3 : joint->type == KT_JOINT_SPHERICAL ? 0 : 7;
    for (int i = 0; i < 7; i++)
        joint->position[i] = kt_bytes_number(bytes, wild);
    for (int i = 0; i < 6; i++)
        joint->velocity[i] = kt_bytes_number(bytes, wild);
    if (first == 7 || (wild == KT_WILD_ALL && kt_bytes_chance(bytes)))
        return;
    double *q = joint->position + first;
    const kt_quat unit = kt_quat_normalize(kt_quat_make(q[0] == 0.0 ? 1.0 : q[0], q[1], q[2], q[3]));
    q[0] = unit.w;
    q[1] = unit.x;
    q[2] = unit.y;
    q[3] = unit.z;
}

static void describe_joint(kt_bytes *bytes, kt_wildness wild, kt_joint *joint) {
    *joint = kt_joint_default();
    joint->type = (kt_joint_type)((kt_bytes_pick(bytes, KT_JOINT_TYPE_COUNT + (wild == KT_WILD_ALL)) + 1) %
                                  (KT_JOINT_TYPE_COUNT + 1)); /* zeros: a revolute joint */
    if (joint->type == KT_JOINT_TYPE_COUNT && wild != KT_WILD_ALL)
        joint->type = KT_JOINT_FIXED;
    joint->axis = kt_fuzz_axis(bytes, wild);
    if (joint->type == KT_JOINT_UNIVERSAL && kt_bytes_chance(bytes))
        joint->axis2 = kt_fuzz_axis(bytes, wild);
    if (joint->type == KT_JOINT_SCREW)
        joint->pitch = kt_bytes_number(bytes, wild);
    if (kt_bytes_chance(bytes))
        joint->at = kt_bytes_vector(bytes, wild);
    kt_fuzz_rotation(bytes, wild, &joint->rotation);
    if (kt_bytes_chance(bytes))
        describe_coordinates(bytes, wild, joint);
}

static void describe_shape(kt_bytes *bytes, kt_wildness wild, kt_shape *shape) {
    static const double corners[] = {0.0, 0.0, 1.0, -0.2, 1.3, 0.7, 0.4, 0.3, -0.1, 0.9};
    *shape = kt_shape_default();
    shape->type = (kt_shape_type)kt_bytes_pick(bytes, KT_SHAPE_TYPE_COUNT + (wild == KT_WILD_ALL));
    shape->from = kt_bytes_vector(bytes, wild);
    shape->to = kt_bytes_vector(bytes, wild);
    if (wild < KT_WILD_NUMBERS && kt_vec3_norm(kt_vec3_sub(shape->to, shape->from)) == 0.0)
        shape->to.x += 1.0;
    shape->at = kt_bytes_vector(bytes, wild);
    shape->size.x = kt_bytes_positive(bytes, wild);
    shape->size.y = kt_bytes_positive(bytes, wild);
    shape->size.z = kt_bytes_positive(bytes, wild);
    shape->radius = kt_bytes_positive(bytes, wild);
    shape->length = kt_bytes_positive(bytes, wild);
    shape->axis = kt_fuzz_axis(bytes, wild);
    shape->points = corners;
    shape->point_count = (int)kt_bytes_pick(bytes, 3) + (wild < KT_WILD_NUMBERS ? 3 : 2);
    kt_fuzz_rotation(bytes, wild, &shape->rotation);
}

/* The inertia of two points of a mass each, which a body can have; or any numbers. */
static kt_sym3 describe_inertia(kt_bytes *bytes, kt_wildness wild) {
    kt_sym3 inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    if (wild == KT_WILD_ALL && kt_bytes_chance(bytes)) {
        const kt_vec3 d = kt_bytes_vector(bytes, wild), o = kt_bytes_vector(bytes, wild);
        return kt_sym3_make(d.x, d.y, d.z, o.x, o.y, o.z);
    }
    const int points = kt_bytes_pick(bytes, 4);
    for (int i = 0; i < points; i++) {
        const double mass = kt_bytes_positive(bytes, wild);
        inertia = kt_sym3_shift(inertia, mass, kt_bytes_vector(bytes, wild));
    }
    return points > 0 ? inertia : kt_sym3_make(1.0, 1.0, 1.0, 0.0, 0.0, 0.0);
}

static void describe_mass(kt_bytes *bytes, kt_wildness wild, kt_body *body) {
    const int kind = kt_bytes_pick(bytes, 8); /* 0 to 3: mass and inertia; 4: a point; 5: of a shape; 6, 7: none */
    if (kind >= 6 && wild < KT_WILD_NUMBERS)
        return;
    body->mass = kt_bytes_positive(bytes, wild);
    if (kind == 5) {
        describe_shape(bytes, wild, &body->shape);
        body->com_of_shape = body->inertia_of_shape = body->shape.type != KT_SHAPE_NONE || wild == KT_WILD_ALL;
        return;
    }
    if (kind > 0)
        body->com = kt_bytes_vector(bytes, wild);
    if (kind < 4)
        body->inertia = describe_inertia(bytes, wild);
}

static void describe_body(kt_bytes *bytes, kt_fuzz_mechanism *m, int i) {
    kt_body *body = &m->body[i];
    *body = kt_body_default();
    body->name = kt_fuzz_name(bytes, m, i);
    /* Zeros give a chain. A wild mechanism may have any parent, also the body itself. */
    const int back = kt_bytes_pick(bytes, i + 1) + 1;
    body->parent = kt_fuzz_name(bytes, m, i - back);
    if (m->wild == KT_WILD_ALL && kt_bytes_pick(bytes, 16) == 15)
        body->parent = names[kt_bytes_pick(bytes, KT_FUZZ_BODIES)];
    describe_joint(bytes, m->wild, &body->joint);
    describe_mass(bytes, m->wild, body);
    body->marker_count = kt_bytes_pick(bytes, KT_FUZZ_MARKERS + 1);
    body->markers = body->marker_count > 0 ? m->marker[i] : NULL;
    for (int k = 0; k < body->marker_count; k++) {
        m->marker[i][k].name = marker_names[m->wild == KT_WILD_ALL ? kt_bytes_pick(bytes, 2) : k];
        m->marker[i][k].at = kt_bytes_vector(bytes, m->wild);
    }
    if (m->wild == KT_WILD_ALL && kt_bytes_pick(bytes, 32) == 31)
        body->marker_count = kt_bytes_chance(bytes) ? -1 : 0;
}

/* ---- all --------------------------------------------------------------------------------------------------------- */

/* Lists that are not there, and counts that cannot be. */
static void spoil(kt_bytes *bytes, kt_description *d) {
    switch (kt_bytes_pick(bytes, 32)) {
    case 31:
        d->bodies = NULL;
        break;
    case 30:
        d->loops = NULL;
        break;
    case 29:
        d->effects = NULL;
        break;
    case 28:
        d->hold = NULL;
        break;
    case 27:
        d->body_count = -1;
        break;
    case 26:
        d->loop_count = -1000000;
        break;
    case 25:
        d->effect_count = 2147483647;
        break;
    default:
        break;
    }
}

void kt_fuzz_describe(kt_bytes *bytes, kt_fuzz_mechanism *m) {
    memset(m, 0, sizeof *m);
    m->wild = (kt_wildness)kt_bytes_pick(bytes, KT_WILD_COUNT);
    m->description = kt_description_default();
    kt_description *d = &m->description;
    d->bodies = m->body;
    d->body_count = kt_bytes_pick(bytes, KT_FUZZ_BODIES + 1);
    if (kt_bytes_chance(bytes))
        d->gravity = kt_bytes_vector(bytes, m->wild);
    for (int i = 0; i < d->body_count; i++)
        describe_body(bytes, m, i);
    kt_fuzz_attach(bytes, m);
    d->hold = m->hold;
    d->hold_count = d->body_count > 0 ? kt_bytes_pick(bytes, 3) : 0;
    for (int i = 0; i < d->hold_count; i++)
        m->hold[i] = kt_fuzz_name(bytes, m, kt_bytes_pick(bytes, d->body_count));
    if (m->wild < KT_WILD_ALL && d->hold_count == 2 && m->hold[0] == m->hold[1])
        d->hold_count = 1;
    if (m->wild == KT_WILD_ALL)
        spoil(bytes, d);
}
