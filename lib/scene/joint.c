/* Tree joints: type, frame, initial position and velocity. */
#include "scene/part.h"

#include <string.h>

enum {
    REVOLUTE = 1 << KT_JOINT_REVOLUTE,
    PRISMATIC = 1 << KT_JOINT_PRISMATIC,
    SCREW = 1 << KT_JOINT_SCREW,
    CYLINDRICAL = 1 << KT_JOINT_CYLINDRICAL,
    PLANAR = 1 << KT_JOINT_PLANAR,
    UNIVERSAL = 1 << KT_JOINT_UNIVERSAL,
    SPHERICAL = 1 << KT_JOINT_SPHERICAL,
    FREE = 1 << KT_JOINT_FREE
};

#define JOINT_NAME(id, name, nq, nv) #name,
static const char *const type_names[] = {KT_JOINT_LIST(JOINT_NAME)};
static const kt_choice types = {"joint.type", type_names, KT_JOINT_TYPE_COUNT, 0};

/* Positions and velocities of each type; what differs from type to type is only what turns (A) and what slides (L). */
#define A KT_QUANTITY_ANGLE
#define L KT_QUANTITY_NUMBER
#define W KT_QUANTITY_RATE
static const struct {
    int count;
    kt_quantity position[3], velocity[3];
} units[KT_JOINT_TYPE_COUNT] = {
    [KT_JOINT_REVOLUTE] = {1, {A}, {W}},
    [KT_JOINT_PRISMATIC] = {1, {L}, {L}},
    [KT_JOINT_SCREW] = {1, {A}, {W}},
    [KT_JOINT_CYLINDRICAL] = {2, {A, L}, {W, L}},
    [KT_JOINT_PLANAR] = {3, {L, L, A}, {L, L, W}},
    [KT_JOINT_UNIVERSAL] = {2, {A, A}, {W, W}},
    [KT_JOINT_SPHERICAL] = {3, {A, A, A}, {W, W, W}}, /* velocity only */
};
#undef A
#undef L
#undef W

kt_quantity kt_joint_quantity(const kt_reader *r, const char *joint) {
    int body = kt_find_body(r, joint);
    if (body < 0 || kt_body_is_hidden(r, body))
        return KT_QUANTITY_ANGLE;
    kt_joint_type type = r->description->bodies[body].joint.type;
    return units[type].count == 1 ? units[type].position[0] : KT_QUANTITY_NUMBER;
}

/* ---- positions --------------------------------------------------------------------------------------------------- */

/* A quaternion as a list or as any rotation. */
static bool read_orientation(kt_reader *r, const kt_scope *scope, kt_node *node, double q[4]) {
    if (node->kind == KT_NODE_LIST)
        return kt_read_quaternion(r, scope, node, q);
    kt_rotation rotation;
    kt_mat3 matrix;
    if (node->kind != KT_NODE_MAP)
        return kt_fault_expected(r, scope, node, "a quaternion [w, x, y, z] or a rotation {...}");
    if (!kt_read_rotation(r, scope, node, &rotation))
        return false;
    if (rotation.type == KT_ROTATION_QUATERNION) {
        memcpy(q, rotation.value, 4 * sizeof *q);
        return true;
    }
    kt_error error;
    if (kt_rotation_evaluate(&rotation, &matrix, &error) != KT_OK) /* GCOVR_EXCL_BR_LINE: reading it has tried that */
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s", error.message); /* GCOVR_EXCL_LINE */
    const kt_quat unit = kt_quat_from_matrix(matrix);
    q[0] = unit.w;
    q[1] = unit.x;
    q[2] = unit.y;
    q[3] = unit.z;
    kt_quaternion_settle(q);
    return true;
}

static bool read_turn(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return read_orientation(r, scope, node, kt_field_in(object, field));
}

static void write_turn(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    kt_emit_map(e, true);
    kt_emit_key(e, "quaternion");
    kt_emit_numbers(e, kt_field_of(object, field), 4);
    kt_emit_end(e);
}

static bool same_turn(const kt_field *field, const void *object, const void *standard) {
    return kt_same_bits(kt_field_of(object, field), kt_field_of(standard, field), 4 * sizeof(double));
}

static bool read_rates(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_numbers(r, scope, node, 3, KT_QUANTITY_RATE, NULL, kt_field_in(object, field));
}

static void write_rates(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    kt_emit_numbers(e, kt_field_of(object, field), 3);
}

static bool same_rates(const kt_field *field, const void *object, const void *standard) {
    return kt_same_bits(kt_field_of(object, field), kt_field_of(standard, field), 3 * sizeof(double));
}

static const kt_kind kind_turn = {read_turn, write_turn, same_turn}, kind_rates = {read_rates, write_rates, same_rates};

/* What is given is written, zero or not. */
static bool is_given(const kt_joint *joint, unsigned part) { return (joint->given & part) != 0; }

static bool same_place(const kt_field *field, const void *object, const void *standard) {
    return !is_given(object, KT_GIVEN_POSITION) && kt_kind_vector.same(field, object, standard);
}

static bool same_linear(const kt_field *field, const void *object, const void *standard) {
    return !is_given(object, KT_GIVEN_VELOCITY) && kt_kind_vector.same(field, object, standard);
}

static bool same_angular(const kt_field *field, const void *object, const void *standard) {
    return !is_given(object, KT_GIVEN_ANGULAR) && same_rates(field, object, standard);
}

/* Of a free joint: x, y, z, quaternion; linear, angular. */
#define AT(member) .offset = offsetof(kt_joint, member)
static const kt_field free_position_fields[] = {
    {.key = "position", .kind = &kt_kind_vector, AT(position[0]), .same = same_place},
    {.key = "orientation", .kind = &kind_turn, AT(position[3])},
};
static const kt_field free_velocity_fields[] = {
    {.key = "linear", .kind = &kt_kind_vector, AT(velocity[0]), .same = same_linear},
    {.key = "angular", .kind = &kind_rates, AT(velocity[3]), .same = same_angular},
};
static const kt_table free_position = {.where = "free.position",
                                       .fields = free_position_fields,
                                       .count = 2,
                                       .flow = true,
                                       .example = "{position: [x, y, z], orientation: ROTATION}"};
static const kt_table free_velocity = {.where = "free.velocity",
                                       .fields = free_velocity_fields,
                                       .count = 2,
                                       .flow = true,
                                       .example = "{linear: [x, y, z], angular: [x, y, z]}"};

static bool read_coordinates(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_quantity *quantities,
                             int count, double *out) {
    if (count == 1)
        return kt_read_number(r, scope, node, quantities[0], out);
    return kt_read_numbers(r, scope, node, count, KT_QUANTITY_NUMBER, quantities, out);
}

static void note_given(kt_joint *joint, const kt_node *node, const char *key, unsigned part) {
    if (kt_node_find(node, key) != NULL)
        joint->given |= part;
}

static bool read_position(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_joint *joint = object;
    (void)field;
    if (joint->type == KT_JOINT_FREE) {
        if (!kt_table_read(r, scope, node, &free_position, joint))
            return false;
        note_given(joint, node, "position", KT_GIVEN_POSITION);
        note_given(joint, node, "orientation", KT_GIVEN_ORIENTATION);
        return true;
    }
    joint->given |= joint->type == KT_JOINT_SPHERICAL ? KT_GIVEN_ORIENTATION : KT_GIVEN_POSITION;
    if (joint->type == KT_JOINT_SPHERICAL)
        return read_orientation(r, scope, node, joint->position);
    return read_coordinates(r, scope, node, units[joint->type].position, units[joint->type].count, joint->position);
}

static bool read_velocity(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_joint *joint = object;
    (void)field;
    if (joint->type == KT_JOINT_FREE) {
        if (!kt_table_read(r, scope, node, &free_velocity, joint))
            return false;
        note_given(joint, node, "linear", KT_GIVEN_VELOCITY);
        note_given(joint, node, "angular", KT_GIVEN_ANGULAR);
        return true;
    }
    joint->given |= KT_GIVEN_VELOCITY;
    return read_coordinates(r, scope, node, units[joint->type].velocity, units[joint->type].count, joint->velocity);
}

static void write_coordinates(kt_emitter *e, const double *values, int count) {
    if (count == 1)
        kt_emit_number(e, values[0]);
    else
        kt_emit_numbers(e, values, count);
}

static void write_position(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    const kt_joint *joint = object, *rest = standard;
    (void)field;
    if (joint->type == KT_JOINT_FREE)
        kt_table_write(e, &free_position, joint, rest);
    else
        write_coordinates(e, joint->position, joint->type == KT_JOINT_SPHERICAL ? 4 : units[joint->type].count);
}

static void write_velocity(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    const kt_joint *joint = object, *rest = standard;
    (void)field;
    if (joint->type == KT_JOINT_FREE)
        kt_table_write(e, &free_velocity, joint, rest);
    else
        write_coordinates(e, joint->velocity, units[joint->type].count);
}

/* All coordinates at rest are zeros, those that a type does not have too. A quaternion of zeros is not given. */
static bool same_position(const kt_field *field, const void *object, const void *standard) {
    const kt_joint *joint = object, *rest = standard;
    (void)field;
    return (!is_given(joint, KT_GIVEN_POSITION) || joint->type == KT_JOINT_SPHERICAL) &&
           kt_same_bits(joint->position, rest->position, sizeof joint->position);
}

static bool same_velocity(const kt_field *field, const void *object, const void *standard) {
    const kt_joint *joint = object, *rest = standard;
    (void)field;
    return !is_given(joint, KT_GIVEN_VELOCITY) &&
           (!is_given(joint, KT_GIVEN_ANGULAR) || joint->type != KT_JOINT_FREE) &&
           kt_same_bits(joint->velocity, rest->velocity, sizeof joint->velocity);
}

static const kt_kind kind_position = {read_position, write_position, same_position};
static const kt_kind kind_velocity = {read_velocity, write_velocity, same_velocity};

/* ---- the joint --------------------------------------------------------------------------------------------------- */

/* The description's zero stands for a second axis that is not given; one that is given as zero is a slip. */
static bool read_second_axis(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_vec3 *axis = kt_field_in(object, field);
    if (!kt_kind_axis.read(r, scope, node, field, object))
        return false;
    if (axis->x != 0.0 || axis->y != 0.0 || axis->z != 0.0)
        return true;
    return kt_fault_at(r, KT_ERROR_MODEL, scope, node,
                       "a zero axis has no direction; give one, such as [0, 0, 1], or leave the key out for the axis "
                       "after 'axis'");
}

static void write_second_axis(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    kt_kind_axis.write(e, field, object, standard);
}

static bool same_second_axis(const kt_field *field, const void *object, const void *standard) {
    return kt_kind_axis.same(field, object, standard);
}

static const kt_kind kind_second_axis = {read_second_axis, write_second_axis, same_second_axis};

enum {
    HAS_AXIS = REVOLUTE | PRISMATIC | SCREW | CYLINDRICAL | PLANAR | UNIVERSAL,
    MOVES = HAS_AXIS | SPHERICAL | FREE
};
static const kt_field fields[] = {
    {.key = "type", .kind = &kt_kind_choice, AT(type), .flags = KT_FIELD_REQUIRED, .detail = &types},
    {.key = "axis", .kind = &kt_kind_axis, AT(axis), .types = HAS_AXIS},
    {.key = "axis2", .kind = &kind_second_axis, AT(axis2), .types = UNIVERSAL},
    {.key = "pitch", .kind = &kt_kind_number, AT(pitch), .types = SCREW, .flags = KT_FIELD_REQUIRED},
    {.key = "at", .kind = &kt_kind_vector, AT(at)},
    {.key = "rotation", .kind = &kt_kind_rotation, AT(rotation)},
    {.key = "position", .kind = &kind_position, .types = MOVES},
    {.key = "velocity", .kind = &kind_velocity, .types = MOVES},
};
const kt_table kt_joint_table = {.where = "joint", .fields = fields, .count = KT_COUNT_OF(fields), .types = &types};
