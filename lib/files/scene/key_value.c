/* The kinds of keys whose values are numbers, vectors, axes, rotations or flags: joints, shapes, loops, effects and
 * functions of time have them. The key's unit decides how a number may be written. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/value.h"

#include <string.h>

const char *kt_key_unit(const kt_reader *r, const kt_field *field) {
    const kt_key *key = field->detail;
    const char *second = strchr(key->unit, '|');
    return second != NULL && r->scene->joint_quantity != KT_QUANTITY_ANGLE ? second + 1 : key->unit;
}

/* The quantity of a key's number. Within a function of time, y is the unit of its value. */
kt_quantity kt_key_quantity(const kt_reader *r, const kt_field *field) {
    const char *unit = kt_key_unit(r, field);
    if (strcmp(unit, "y") == 0)
        return (kt_quantity)r->scene->quantity;
    const size_t length = strcspn(unit, "|");
    if (length == 3 && strncmp(unit, "rad", length) == 0)
        return KT_QUANTITY_ANGLE;
    return length == 5 && strncmp(unit, "rad/s", length) == 0 ? KT_QUANTITY_RATE : KT_QUANTITY_NUMBER;
}

static bool read_key_number(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_put_number(r, scope, node, kt_key_quantity(r, field), kt_field_in(object, field));
}

/* If the default is zero, zero means that no axis is given; to write it is a mistake. */
static bool read_key_axis(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const kt_key *key = field->detail;
    const kt_vec3 *axis = kt_field_in(object, field), before = *axis;
    const bool may_be_missing = before.x == 0.0 && before.y == 0.0 && before.z == 0.0;
    if (!kt_kind_axis.read(r, scope, node, field, object))
        return false;
    if (!may_be_missing || axis->x != 0.0 || axis->y != 0.0 || axis->z != 0.0)
        return true;
    return kt_fault_at(r, KT_ERROR_MODEL, scope, node,
                       "a zero axis has no direction; give one, such as [0, 0, 1], or leave the key out for %s",
                       key->standard);
}

/* ---- corners of a polygon ---------------------------------------------------------------------------------------- */

static bool read_corners(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_shape *shape = object;
    (void)field;
    return kt_read_points(r, scope, node, 2, NULL, "a list of corners [[x, y], [x, y], ...]", &shape->points,
                          &shape->point_count);
}

static void write_corners(kt_emitter *e, const kt_member *m) {
    const kt_shape *shape = m->object;
    kt_write_points(e, shape->points, 2, shape->point_count);
}

const kt_kind *kt_kind_of_value_key(const kt_key *key) {
    static const kt_kind number = {.read = read_key_number, .write = kt_kind_numbers_write, .size = sizeof(double)};
    static const kt_kind six = {
        .read = kt_kind_numbers_read, .write = kt_kind_numbers_write, .size = 6 * sizeof(double)};
    static const kt_kind axis = {.read = read_key_axis, .write = kt_axis_write, .size = sizeof(kt_vec3)};
    static const kt_kind corners = {.read = read_corners, .write = write_corners};
    static const kt_kind *const kinds[KT_KEY_KIND_COUNT] = {
        [KT_KEY_NUMBER] = &number,
        [KT_KEY_SIX] = &six,
        [KT_KEY_VECTOR] = &kt_kind_vector,
        [KT_KEY_AXIS] = &axis,
        [KT_KEY_ROTATION] = &kt_kind_rotation,
        [KT_KEY_FLAG] = &kt_kind_flag,
        [KT_KEY_CORNERS] = &corners,
    };
    return kinds[key->kind];
}
