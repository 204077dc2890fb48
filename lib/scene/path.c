/* Paths of effects: a list of points and surfaces.
 *
 *     path: [POINT, {body: B, at: [..], radius: r, axis: y, side: [..], inside: true}, {body: B, divisor: 2}, POINT]
 *
 * A POINT is an end (end.c). A point with a radius is a sphere, and with an axis a cylinder. A point with a divisor
 * begins a branch.
 */
#include "kinetree/effect.h"
#include "scene/value.h"

#include <stddef.h>
#include <string.h>

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

static bool read_path_point(kt_reader *r, const kt_scope *scope, kt_node *node, kt_path_point *point) {
    if (node->kind != KT_NODE_MAP)
        return kt_read_end(r, scope, node, &point->end);
    (void)kt_table_read(r, scope, node, &point_table, point);
    if (point->end.marker != NULL && kt_node_find(node, "at") != NULL)
        kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'marker' and 'at' are two points; leave one of them out");
    if (point->end.body != NULL && strcmp(point->end.body, "world") == 0)
        point->end.body = NULL;
    return !kt_node_is_faulty(node);
}

static bool read_path(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_effect *effect = object;
    (void)field;
    if (node->kind != KT_NODE_LIST || node->count < 2)
        return kt_fault_expected(r, scope, node, "a list of two points or more");
    kt_path_point *points = kt_pool_take(&r->keep, node->count, sizeof *points);
    if (points == NULL)
        return kt_reader_out_of_memory(r);
    bool good = true;
    int i = 0;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, i++) {
        const kt_scope here = {.outer = scope, .index = i};
        points[i] = standard_point();
        good = read_path_point(r, &here, item, &points[i]) && good;
    }
    effect->path = points;
    effect->path_count = i;
    return good;
}

static void write_path_points(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    const kt_effect *effect = object;
    const kt_path_point plain = standard_point();
    (void)field, (void)standard;
    kt_emit_list(e, true);
    for (int i = 0; i < effect->path_count; i++) {
        kt_path_point point = effect->path[i];
        if (point.radius == 0.0 && point.divisor == 0.0) {
            kt_write_end(e, &point.end);
            continue;
        }
        if (point.end.body == NULL)
            point.end.body = "world";
        kt_table_write(e, &point_table, &point, &plain);
    }
    kt_emit_end(e);
}

static bool same_path(const kt_field *field, const void *object, const void *standard) {
    (void)field, (void)standard;
    return ((const kt_effect *)object)->path_count == 0;
}

const kt_kind kt_kind_path = {read_path, write_path_points, same_path};
