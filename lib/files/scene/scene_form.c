/* Surfaces and curves: a mapping of one key, the name of a form, to a mapping of the keys that the form has. Examples
 * are {sphere: {radius: 1}} and {spline: [[x, y, z], ...]}. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_part.h"

#include <stddef.h>
#include <string.h>

/* A surface or a curve. */
typedef union form {
    int type;
    kt_surface surface;
    kt_track track;
} form;
_Static_assert(offsetof(kt_surface, type) == 0 && offsetof(kt_track, type) == 0, "the first member");

/* The keys that occur select the type of the form. */
static bool read_form(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const kt_forms *forms = kt_detail_of(field);
    const kt_table table = {.fields = forms->fields, .count = forms->count, .flow = true};
    form value;
    if (node->kind != KT_NODE_MAP)
        return kt_fault_expected(r, scope, node, forms->expected);
    memset(&value, 0, sizeof value);
    (void)kt_table_read(r, scope, node, &table, &value);
    value.type = kt_form_find(r, scope, node, forms);
    if (value.type == 0 || kt_node_is_faulty(node) || r->out_of_memory)
        return false;
    memcpy(kt_field_in(object, field), &value, forms->size);
    return true;
}

static void write_form(kt_emitter *e, const kt_member *m) {
    int type;
    memcpy(&type, kt_member_value(m), sizeof type);
    kt_form_write(e, kt_detail_of(m->field), type, kt_member_value(m), kt_member_standard(m));
}

/* ---- surfaces ---------------------------------------------------------------------------------------------------- */

static const kt_descriptor *describe_surface(int type) { return kt_surface_descriptor((kt_surface_type)type); }

static const kt_table plane_table = KT_TYPE_TABLE(describe_surface, KT_SURFACE_PLANE),
                      cylinder_table = KT_TYPE_TABLE(describe_surface, KT_SURFACE_CYLINDER),
                      sphere_table = KT_TYPE_TABLE(describe_surface, KT_SURFACE_SPHERE),
                      torus_table = KT_TYPE_TABLE(describe_surface, KT_SURFACE_TORUS);
static const kt_field surface_fields[] = {
    {.key = "plane", .kind = &kt_kind_map, .detail = &plane_table},
    {.key = "cylinder", .kind = &kt_kind_map, .detail = &cylinder_table},
    {.key = "sphere", .kind = &kt_kind_map, .detail = &sphere_table},
    {.key = "torus", .kind = &kt_kind_map, .detail = &torus_table},
};
static const int surface_types[] = {KT_SURFACE_PLANE, KT_SURFACE_CYLINDER, KT_SURFACE_SPHERE, KT_SURFACE_TORUS};
static const kt_forms surfaces = {.several = "surfaces",
                                  .expected = "a surface (one of plane, cylinder, sphere, torus)",
                                  .missing = "a surface is missing; give one of plane, cylinder, sphere, torus",
                                  .fields = surface_fields,
                                  .types = surface_types,
                                  .count = KT_COUNT_OF(surface_fields),
                                  .size = sizeof(kt_surface)};
const kt_kind kt_kind_surface = {.read = read_form, .write = write_form, .size = sizeof(int), .detail = &surfaces};

/* ---- curves ------------------------------------------------------------------------------------------------------ */

static bool read_form_points(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_track *track = object;
    const double *points = NULL;
    (void)field;
    const bool good = kt_read_points(r, scope, node, 3, NULL, "a list of points [[x, y, z], [x, y, z], ...]", &points,
                                     &track->point_count);
    track->points = (const kt_vec3 *)(const void *)points;
    return good;
}

static void write_form_points(kt_emitter *e, const kt_member *m) {
    const kt_track *track = m->object;
    kt_write_points(e, (const double *)(const void *)track->points, 3, track->point_count);
}

static const kt_descriptor *describe_track(int type) { return kt_track_descriptor((kt_track_type)type); }

static const kt_table line_table = KT_TYPE_TABLE(describe_track, KT_TRACK_LINE),
                      circle_table = KT_TYPE_TABLE(describe_track, KT_TRACK_CIRCLE),
                      helix_table = KT_TYPE_TABLE(describe_track, KT_TRACK_HELIX);
static const kt_kind kind_points = {.read = read_form_points, .write = write_form_points};
static const kt_field track_fields[] = {
    {.key = "line", .kind = &kt_kind_map, .detail = &line_table},
    {.key = "circle", .kind = &kt_kind_map, .detail = &circle_table},
    {.key = "helix", .kind = &kt_kind_map, .detail = &helix_table},
    {.key = "spline", .kind = &kind_points},
};
static const int track_types[] = {KT_TRACK_LINE, KT_TRACK_CIRCLE, KT_TRACK_HELIX, KT_TRACK_SPLINE};
static const kt_forms tracks = {.several = "curves",
                                .expected = "a curve (one of line, circle, helix, spline)",
                                .missing = "a curve is missing; give one of line, circle, helix, spline",
                                .fields = track_fields,
                                .types = track_types,
                                .count = KT_COUNT_OF(track_fields),
                                .size = sizeof(kt_track)};
const kt_kind kt_kind_track = {.read = read_form, .write = write_form, .size = sizeof(int), .detail = &tracks};
