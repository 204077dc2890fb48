/* Tree joints: type, frame, initial position and velocity. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/build.h"
#include "model/relative.h"
#include "scene/scene_part.h"
#include "scene/vary.h"

#include <string.h>

#define JOINT_NAME(id, name, nq, nv) #name,
static const char *const type_names[] = {KT_JOINT_LIST(JOINT_NAME)};
static const kt_choice types = {"joint.type", type_names, KT_JOINT_TYPE_COUNT, 0, NULL};

#define JOINT_NQ(id, name, nq, nv) nq,
#define JOINT_NV(id, name, nq, nv) nv,
static const int position_counts[] = {KT_JOINT_LIST(JOINT_NQ)}, velocity_counts[] = {KT_JOINT_LIST(JOINT_NV)};

static bool coordinate_is_length(kt_joint_type type, int k) {
    const kt_coordinate_kind kind = kt_joint_coordinate_kind(type, k);
    return kind == KT_COORDINATE_LENGTH || kind == KT_COORDINATE_TRANSLATION;
}

/* The quantity of NAME[k] of a joint, or of a coordinate of a loop. */
static kt_quantity quantity_of_component(const kt_reader *r, const char *coordinate) {
    const kt_coordinate_name name = kt_coordinate_name_of(coordinate);
    const kt_description *d = r->scene->description;
    bool slides = false;
    for (int i = 0; i < d->body_count && name.has_index; i++)
        if (kt_coordinate_is_of(coordinate, name, kt_joint_name_of(&d->bodies[i])))
            return coordinate_is_length(d->bodies[i].joint.type, name.k) ? KT_QUANTITY_NUMBER : KT_QUANTITY_ANGLE;
    const int loop = kt_coordinate_loop(d, coordinate, 0);
    if (loop >= 0)
        slides = kt_relative_is_length(kt_relative_at(d->loops[loop].type, name.k));
    return slides ? KT_QUANTITY_NUMBER : KT_QUANTITY_ANGLE;
}

kt_quantity kt_joint_quantity(const kt_reader *r, const char *joint) {
    int body = kt_find_joint(r, joint);
    if (body < 0 && !joint) /* a name that could not be read */
        return KT_QUANTITY_ANGLE;
    if (body < 0)
        return quantity_of_component(r, joint);
    if (kt_body_is_hidden(r, body))
        return KT_QUANTITY_ANGLE;
    kt_joint_type type = r->scene->description->bodies[body].joint.type;
    return position_counts[type] == 1 && !coordinate_is_length(type, 0) ? KT_QUANTITY_ANGLE : KT_QUANTITY_NUMBER;
}

/* Joints named twice are left to kt_description_check. The sum of the terms is an angle if one of their joints
 * rotates. */
bool kt_terms_read(kt_reader *r, const kt_scope *scope, kt_node *node, kt_number_reader *read, const kt_term **out,
                   int *count) {
    if (node->kind != KT_NODE_MAP || node->count == 0)
        return kt_fault_expected(r, scope, node, "a mapping of joints to numbers (crank: 1)");
    kt_term *terms = kt_pool_take(&r->keep, node->count, sizeof *terms);
    if (terms == NULL)
        return kt_reader_out_of_memory(r);
    bool good = true;
    int i = 0;
    r->scene->joint_quantity = KT_QUANTITY_NUMBER;
    for (kt_node *key = node->of.first; key != NULL; key = key->next->next, i++) {
        const kt_scope here = {.outer = scope, .key = key->kind == KT_NODE_TEXT ? key->of.text : "?"};
        good = kt_read_name(r, scope, key, "the name of a joint", &terms[i].joint) && good;
        good = read(r, &here, key->next, KT_QUANTITY_NUMBER, &terms[i].coefficient) && good;
        if (kt_joint_quantity(r, terms[i].joint) == KT_QUANTITY_ANGLE)
            r->scene->joint_quantity = KT_QUANTITY_ANGLE;
    }
    *out = terms;
    *count = i;
    return good;
}

/* The index of the quaternion among the positions; -1 if there is none. Positions and velocities before it are written
 * separately. */
static int quaternion_index_of(const kt_joint *joint) {
    const int nq = position_counts[joint->type];
    return nq > velocity_counts[joint->type] ? nq - 4 : -1;
}

/* ---- positions --------------------------------------------------------------------------------------------------- */

/* Reads a quaternion, written as a list or as any rotation. */
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
    const kt_quat unit = kt_quat_from_mat3(matrix);
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

static void write_turn(kt_emitter *e, const kt_member *m) {
    kt_emit_map(e, KT_EMIT_FLOW);
    kt_emit_key(e, "quaternion");
    kt_emit_numbers(e, kt_member_value(m), 4);
    kt_emit_end(e);
}

static bool read_rates(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_put_numbers(r, scope, node, 3, KT_QUANTITY_RATE, NULL, kt_field_in(object, field));
}

static const kt_kind kind_turn = {.read = read_turn, .write = write_turn, .size = 4 * sizeof(double)},
                     kind_rates = {.read = read_rates, .write = kt_kind_numbers_write, .size = 3 * sizeof(double)};

/* A given part is written, zero or not. */
static bool is_given(const kt_joint *joint, unsigned part) { return (joint->given & part) != 0; }

static bool same_three(const kt_member *m, unsigned part) {
    return !is_given(m->object, part) && kt_same_bits(kt_member_value(m), kt_member_standard(m), 3 * sizeof(double));
}

static bool same_place(const kt_member *m) { return same_three(m, KT_GIVEN_POSITION); }

static bool same_linear(const kt_member *m) { return same_three(m, KT_GIVEN_VELOCITY); }

static bool same_angular(const kt_member *m) { return same_three(m, KT_GIVEN_ANGULAR); }

/* The fields of the position of a joint with three positions and a quaternion. */
#define AT(member) .offset = offsetof(kt_joint, member)
static const kt_field free_position_fields[] = {
    {.key = "position", .kind = &kt_kind_vector, AT(position[0]), .same = same_place},
    {.key = "orientation", .kind = &kind_turn, AT(position[3])},
};
static const kt_field free_velocity_fields[] = {
    {.key = "linear", .kind = &kt_kind_vector, AT(velocity[0]), .same = same_linear},
    {.key = "angular", .kind = &kind_rates, AT(velocity[3]), .same = same_angular},
};
static const kt_table free_position = {.fields = free_position_fields,
                                       .count = 2,
                                       .flow = true,
                                       .example = "{position: [x, y, z], orientation: ROTATION}"};
static const kt_table free_velocity = {
    .fields = free_velocity_fields, .count = 2, .flow = true, .example = "{linear: [x, y, z], angular: [x, y, z]}"};

/* If there is one coordinate, a list of one number is read as that number. Programs can write scenes without regard to
 * types. */
static bool is_list_of_one(const kt_node *node) { return node->kind == KT_NODE_LIST && node->count == 1; }

static bool read_coordinates(kt_reader *r, const kt_scope *scope, kt_node *node, kt_joint_type type, int count,
                             kt_quantity of_angle, double *out) {
    kt_quantity quantities[KT_JOINT_NQ_MAX];
    for (int k = 0; k < count; k++)
        quantities[k] = coordinate_is_length(type, k) ? KT_QUANTITY_NUMBER : of_angle;
    if (count == 1 && !is_list_of_one(node))
        return kt_put_number(r, scope, node, quantities[0], out);
    return kt_put_numbers(r, scope, node, count, KT_QUANTITY_NUMBER, quantities, out);
}

/* The position or the velocity of a joint. */
typedef struct kt_joint_half {
    const kt_table *parts; /* of a joint with three positions and a quaternion */
    unsigned given[2];     /* KT_GIVEN_ of these parts; the first also of a list of coordinates */
    const int *counts;     /* of each type */
    kt_quantity of_angle;
    bool may_turn; /* it may be a quaternion alone */
} kt_joint_half;

static const kt_joint_half position_half = {.parts = &free_position,
                                            .given = {KT_GIVEN_POSITION, KT_GIVEN_ORIENTATION},
                                            .counts = position_counts,
                                            .of_angle = KT_QUANTITY_ANGLE,
                                            .may_turn = true};
static const kt_joint_half velocity_half = {.parts = &free_velocity,
                                            .given = {KT_GIVEN_VELOCITY, KT_GIVEN_ANGULAR},
                                            .counts = velocity_counts,
                                            .of_angle = KT_QUANTITY_RATE};

/* Reads the positions or the velocities of a joint (half). A free joint has them in parts, and a spherical joint has an
 * orientation as its position. */
static bool read_half(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const kt_joint_half *half = kt_detail_of(field);
    kt_joint *joint = object;
    const int quaternion = quaternion_index_of(joint);
    const bool turns = quaternion == 0 && half->may_turn;
    if (quaternion <= 0) {
        joint->given |= half->given[turns];
        return turns ? read_orientation(r, scope, node, kt_field_in(object, field))
                     : read_coordinates(r, scope, node, joint->type, half->counts[joint->type], half->of_angle,
                                        kt_field_in(object, field));
    }
    if (!kt_table_read(r, scope, node, half->parts, joint))
        return false;
    for (int k = 0; k < half->parts->count; k++)
        joint->given |= kt_node_find(node, half->parts->fields[k].key) != NULL ? half->given[k] : 0;
    return true;
}

static void write_coordinates(kt_emitter *e, const double *values, int count) {
    if (count == 1)
        kt_emit_number(e, values[0]);
    else
        kt_emit_numbers(e, values, count);
}

static void write_half(kt_emitter *e, const kt_member *m) {
    const kt_joint_half *half = kt_detail_of(m->field);
    const kt_joint *joint = m->object;
    if (quaternion_index_of(joint) > 0)
        kt_table_write(e, half->parts, joint, m->standard);
    else
        write_coordinates(e, kt_member_value(m), half->counts[joint->type]);
}

/* The default position is all zeros, including coordinates that the type does not have. A quaternion of zeros is not
 * given. */
static bool same_position(const kt_member *m) {
    const kt_joint *joint = m->object, *rest = m->standard;
    return (!is_given(joint, KT_GIVEN_POSITION) || quaternion_index_of(joint) == 0) &&
           kt_same_bits(joint->position, rest->position, sizeof joint->position);
}

static bool same_velocity(const kt_member *m) {
    const kt_joint *joint = m->object, *rest = m->standard;
    return !is_given(joint, KT_GIVEN_VELOCITY) &&
           (!is_given(joint, KT_GIVEN_ANGULAR) || quaternion_index_of(joint) <= 0) &&
           kt_same_bits(joint->velocity, rest->velocity, sizeof joint->velocity);
}

/* One number for all degrees of freedom, or a list of one for each. The check of the description judges their signs. */
static bool read_armature(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_joint *joint = object;
    const int count = velocity_counts[joint->type];
    (void)field;
    if (is_list_of_one(node) || (count > 1 && node->kind == KT_NODE_LIST))
        return kt_put_numbers(r, scope, node, count, KT_QUANTITY_NUMBER, NULL, joint->armature);
    if (!kt_read_number(r, scope, node, KT_QUANTITY_NUMBER, &joint->armature[0]))
        return false;
    const bool follows = kt_number_follows(r, node, false, &joint->armature[0]);
    for (int k = 1; k < count; k++) {
        joint->armature[k] = joint->armature[0];
        if (follows)
            kt_number_follows_too(r, &joint->armature[k]);
    }
    return true;
}

static void write_armature(kt_emitter *e, const kt_member *m) {
    const kt_joint *joint = m->object;
    int count = velocity_counts[joint->type];
    while (count > 1 && joint->armature[count - 1] == joint->armature[0])
        count--;
    write_coordinates(e, joint->armature, count > 1 ? velocity_counts[joint->type] : 1);
}

static const kt_kind *kind_of_key(const kt_key *key) {
    static const kt_kind position = {
        .read = read_half, .write = write_half, .same = same_position, .detail = &position_half};
    static const kt_kind velocity = {
        .read = read_half, .write = write_half, .same = same_velocity, .detail = &velocity_half};
    static const kt_kind armature = {
        .read = read_armature, .write = write_armature, .size = KT_JOINT_NV_MAX * sizeof(double)};
    return key->kind == KT_KEY_POSITION   ? &position
           : key->kind == KT_KEY_VELOCITY ? &velocity
           : key->kind == KT_KEY_ARMATURE ? &armature
                                          : kt_kind_of_value_key(key);
}

/* ---- limits ------------------------------------------------------------------------------------------------------ */

#define LIMIT(member) .offset = offsetof(kt_joint, limits.member)

static bool read_joint_limit(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const bool slides = coordinate_is_length(((const kt_joint *)object)->type, 0);
    const bool is_rate = field->offset == offsetof(kt_joint, limits.velocity);
    const bool is_effort = field->offset == offsetof(kt_joint, limits.effort);
    const kt_quantity turning = is_rate ? KT_QUANTITY_RATE : KT_QUANTITY_ANGLE;
    return kt_put_number(r, scope, node, slides || is_effort ? KT_QUANTITY_NUMBER : turning,
                         kt_field_in(object, field));
}

static bool same_limits(const kt_member *m) {
    const kt_joint *joint = m->object, *rest = m->standard;
    return kt_same_bits(&joint->limits, &rest->limits, sizeof joint->limits);
}

static const kt_kind kind_limit = {.read = read_joint_limit, .write = kt_kind_numbers_write, .size = sizeof(double)};
static const kt_field limit_fields[] = {
    {.key = "lower", .kind = &kind_limit, LIMIT(lower)},
    {.key = "upper", .kind = &kind_limit, LIMIT(upper)},
    {.key = "velocity", .kind = &kind_limit, LIMIT(velocity)},
    {.key = "effort", .kind = &kind_limit, LIMIT(effort)},
};
static const kt_table limit_table = {.fields = limit_fields,
                                     .count = KT_COUNT_OF(limit_fields),
                                     .flow = true,
                                     .example = "{lower: -1, upper: 1, velocity: 2, effort: 50}"};

/* ---- the joint --------------------------------------------------------------------------------------------------- */

static const kt_descriptor *describe_joint(int type) { return kt_joint_descriptor((kt_joint_type)type); }

static const kt_field fields[] = {
    {.key = "type", .kind = &kt_kind_choice, AT(type), .flags = KT_FIELD_REQUIRED, .detail = &types},
    {.key = "name", .kind = &kt_kind_name, AT(name)},
    {.key = "guess", .kind = &kt_kind_flag, AT(guess)},
    {.key = "limits", .kind = &kt_kind_map, .offset = 0, .detail = &limit_table, .same = same_limits},
};
static const kt_field graph_fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(name), .flags = KT_FIELD_REQUIRED},
    {.key = "type", .kind = &kt_kind_choice, AT(type), .flags = KT_FIELD_REQUIRED, .detail = &types},
    {.key = "between", .kind = &kt_kind_ends, .offset = offsetof(kt_graph_joint, between), .flags = KT_FIELD_REQUIRED},
    {.key = "guess", .kind = &kt_kind_flag, AT(guess)},
    {.key = "limits", .kind = &kt_kind_map, .offset = 0, .detail = &limit_table, .same = same_limits},
};
_Static_assert(offsetof(kt_graph_joint, joint) == 0, "keys of a joint are read into a joint of a graph");
const kt_table kt_graph_joint_table = {.fields = graph_fields,
                                       .count = KT_COUNT_OF(graph_fields),
                                       .types = &types,
                                       .describe = describe_joint,
                                       .kind_of = kind_of_key};

const kt_table kt_joint_table = {.fields = fields,
                                 .count = KT_COUNT_OF(fields),
                                 .types = &types,
                                 .describe = describe_joint,
                                 .kind_of = kind_of_key};
