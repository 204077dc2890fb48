/* Paths of effects: a list of points and surfaces.
 *
 *     path: [POINT, {body: B, at: [..], radius: r, axis: y, side: [..], inside: true}, {body: B, divisor: 2}, POINT]
 *
 * A POINT is an end (scene_end.c). A point with a radius is a sphere, and with an axis a cylinder. A point with a
 * divisor begins a branch.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "kinetree/effect.h"
#include "scene/scene_part.h"

#include <stddef.h>

#define AT(member) offsetof(kt_path_point, member)

static const kt_field point_fields[] = {
    {.key = "body", .kind = &kt_kind_name, .offset = AT(end.body), .flags = KT_FIELD_REQUIRED},
    {.key = "marker", .kind = &kt_kind_name, .offset = AT(end.marker)},
    {.key = "at", .kind = &kt_kind_vector, .offset = AT(end.at)},
    {.key = "rotation", .kind = &kt_kind_rotation, .offset = AT(end.rotation)},
    {.key = "radius", .kind = &kt_kind_positive, .offset = AT(radius)},
    {.key = "axis", .kind = &kt_kind_axis, .offset = AT(axis)},
    {.key = "side", .kind = &kt_kind_vector, .offset = AT(side)},
    {.key = "inside", .kind = &kt_kind_flag, .offset = AT(inside)},
    {.key = "divisor", .kind = &kt_kind_positive, .offset = AT(divisor)},
};
static const kt_table point_table = {.fields = point_fields, .count = KT_COUNT_OF(point_fields), .flow = true};

static kt_path_point standard_point(void) { return (kt_path_point){.end = kt_end_default()}; }

static void read_path_point(kt_reader *r, const kt_scope *scope, const kt_item_read *item) {
    kt_path_point *point = (kt_path_point *)item->items + item->index;
    kt_node *node = item->nodes[item->index];
    *point = standard_point();
    if (node->kind != KT_NODE_MAP) {
        (void)kt_read_end(r, scope, node, &point->end);
        return;
    }
    (void)kt_table_read(r, scope, node, &point_table, point);
    (void)kt_end_settle(r, scope, node, &point->end);
}

static void write_path_point(kt_emitter *e, const void *item, int index) {
    const kt_path_point plain = standard_point();
    kt_path_point point = *(const kt_path_point *)item;
    (void)index;
    if (point.radius == 0.0 && point.divisor == 0.0) {
        kt_write_end(e, &point.end);
        return;
    }
    if (point.end.body == NULL)
        point.end.body = "world";
    kt_table_write(e, &point_table, &point, &plain);
}

static const kt_items points = {.expected = "a list of two points or more",
                                .least = 2,
                                .size = sizeof(kt_path_point),
                                .array = offsetof(kt_effect, path),
                                .count = offsetof(kt_effect, path_count),
                                .flow = true,
                                .read = read_path_point,
                                .write = write_path_point};
const kt_kind kt_kind_path = {.read = kt_items_read, .write = kt_items_write, .same = kt_items_same, .detail = &points};
