/* Surfaces and curves: a mapping of one key, the name of a form, to a mapping of the keys that the form has. Examples
 * are {sphere: {radius: 1}} and {spline: [[x, y, z], ...]}. */
#include "scene/part.h"

#include <stddef.h>
#include <stdio.h>
#include <string.h>

/* A family of forms: a table whose keys are their names, in the order of their types from 1 on. The type is the first
 * member of their struct. */
typedef struct forms {
    const char *what; /* "a surface" */
    const char *names;
    const kt_field *fields;
    int count;
    size_t size; /* of the struct */
} forms;

/* A surface or a curve. */
typedef union form {
    int type;
    kt_surface surface;
    kt_track track;
} form;
_Static_assert(offsetof(kt_surface, type) == 0 && offsetof(kt_track, type) == 0, "the first member");

/* The type of the one form that the mapping has; 0 after reporting a fault. */
static int find_stated_form(kt_reader *r, const kt_scope *scope, kt_node *node, const forms *f) {
    int found = 0;
    for (int i = 0; i < f->count; i++) {
        if (kt_node_find(node, f->fields[i].key) == NULL)
            continue;
        if (found) {
            kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'%s' and '%s' are two of them; leave one out",
                        f->fields[found - 1].key, f->fields[i].key);
            return 0;
        }
        found = i + 1;
    }
    if (!found && !kt_node_is_faulty(node))
        kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s is missing; give one of %s", f->what, f->names);
    return found;
}

static bool read_form(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const forms *f = kt_detail_of(field);
    const kt_table table = {.fields = f->fields, .count = f->count, .flow = true};
    form value;
    if (node->kind != KT_NODE_MAP) {
        char expected[96];
        (void)snprintf(expected, sizeof expected, "%s (one of %s)", f->what, f->names);
        return kt_fault_expected(r, scope, node, expected);
    }
    memset(&value, 0, sizeof value);
    (void)kt_table_read(r, scope, node, &table, &value);
    value.type = find_stated_form(r, scope, node, f);
    if (value.type == 0 || kt_node_is_faulty(node) || r->out_of_memory)
        return false;
    memcpy(kt_field_in(object, field), &value, f->size);
    return true;
}

static void write_form(kt_emitter *e, const kt_member *m) {
    const forms *f = kt_detail_of(m->field);
    const void *value = kt_member_value(m);
    int type;
    memcpy(&type, value, sizeof type);
    const kt_field *stated = &f->fields[type - 1];
    kt_emit_map(e, true);
    kt_emit_key(e, stated->key);
    stated->kind->write(e, &(kt_member){stated, value, kt_member_standard(m)});
    kt_emit_end(e);
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
static const forms surfaces = {"a surface", "plane, cylinder, sphere, torus", surface_fields, 4, sizeof(kt_surface)};
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
static const forms tracks = {"a curve", "line, circle, helix, spline", track_fields, 4, sizeof(kt_track)};
const kt_kind kt_kind_track = {.read = read_form, .write = write_form, .size = sizeof(int), .detail = &tracks};
