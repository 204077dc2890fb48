/* Surfaces and curves: a mapping of one key, the name of a form, to a mapping of the keys that the form has. Examples
 * are {sphere: {radius: 1}} and {spline: [[x, y, z], ...]}. */
#include "scene/part.h"

#include <stddef.h>
#include <stdio.h>

/* A family of forms: a table whose keys are their names, in the order of their types from 1 on. */
typedef struct forms {
    const char *what; /* "a surface" */
    const char *names;
    const kt_field *fields;
    int count;
} forms;

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

/* Reads the form into an object that holds the defaults; returns its type, 0 after a fault. */
static int read_form(kt_reader *r, const kt_scope *scope, kt_node *node, const forms *f, void *object) {
    const kt_table table = {.fields = f->fields, .count = f->count, .flow = true};
    if (node->kind != KT_NODE_MAP) {
        char expected[96];
        (void)snprintf(expected, sizeof expected, "%s (one of %s)", f->what, f->names);
        (void)kt_fault_expected(r, scope, node, expected);
        return 0;
    }
    (void)kt_table_read(r, scope, node, &table, object);
    const int type = find_stated_form(r, scope, node, f);
    return kt_node_is_faulty(node) || r->out_of_memory ? 0 : type;
}

static void write_stated_form(kt_emitter *e, const forms *f, int type, const void *object, const void *standard) {
    const kt_field *field = &f->fields[type - 1];
    kt_emit_map(e, true);
    kt_emit_key(e, field->key);
    field->kind->write(e, field, object, standard);
    kt_emit_end(e);
}

/* ---- surfaces ---------------------------------------------------------------------------------------------------- */

static const kt_descriptor *describe_surface(int type) { return kt_surface_descriptor((kt_surface_type)type); }

#define SURFACE_TABLE(id)                                                                                              \
    { .describe = describe_surface, .kind_of = kt_kind_of_value_key, .type = id, .flow = true }
static const kt_table plane_table = SURFACE_TABLE(KT_SURFACE_PLANE),
                      cylinder_table = SURFACE_TABLE(KT_SURFACE_CYLINDER),
                      sphere_table = SURFACE_TABLE(KT_SURFACE_SPHERE), torus_table = SURFACE_TABLE(KT_SURFACE_TORUS);
static const kt_field surface_fields[] = {
    {.key = "plane", .kind = &kt_kind_map, .detail = &plane_table},
    {.key = "cylinder", .kind = &kt_kind_map, .detail = &cylinder_table},
    {.key = "sphere", .kind = &kt_kind_map, .detail = &sphere_table},
    {.key = "torus", .kind = &kt_kind_map, .detail = &torus_table},
};
static const forms surfaces = {"a surface", "plane, cylinder, sphere, torus", surface_fields, 4};

static bool read_form_surface(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_surface surface = {.type = KT_SURFACE_NONE};
    surface.type = (kt_surface_type)read_form(r, scope, node, &surfaces, &surface);
    if (surface.type != KT_SURFACE_NONE)
        *(kt_surface *)kt_field_in(object, field) = surface;
    return surface.type != KT_SURFACE_NONE;
}

static void write_form_surface(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    static const kt_surface none = {.type = KT_SURFACE_NONE};
    const kt_surface *surface = kt_field_of(object, field);
    (void)standard;
    write_stated_form(e, &surfaces, (int)surface->type, surface, &none);
}

static bool same_surface(const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    return ((const kt_surface *)kt_field_of(object, field))->type == KT_SURFACE_NONE;
}

const kt_kind kt_kind_surface = {read_form_surface, write_form_surface, same_surface};

/* ---- curves ------------------------------------------------------------------------------------------------------ */

static bool read_form_points(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_track *track = object;
    const double *points = NULL;
    (void)field;
    const bool good =
        kt_read_points(r, scope, node, 3, "a list of points [[x, y, z], [x, y, z], ...]", &points, &track->point_count);
    track->points = (const kt_vec3 *)(const void *)points;
    return good;
}

static void write_form_points(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    const kt_track *track = object;
    (void)field, (void)standard;
    kt_write_points(e, (const double *)(const void *)track->points, 3, track->point_count);
}

static const kt_descriptor *describe_track(int type) { return kt_track_descriptor((kt_track_type)type); }

#define TRACK_TABLE(id)                                                                                                \
    { .describe = describe_track, .kind_of = kt_kind_of_value_key, .type = id, .flow = true }
static const kt_table line_table = TRACK_TABLE(KT_TRACK_LINE), circle_table = TRACK_TABLE(KT_TRACK_CIRCLE),
                      helix_table = TRACK_TABLE(KT_TRACK_HELIX);
static const kt_kind kind_points = {.read = read_form_points, .write = write_form_points};
static const kt_field track_fields[] = {
    {.key = "line", .kind = &kt_kind_map, .detail = &line_table},
    {.key = "circle", .kind = &kt_kind_map, .detail = &circle_table},
    {.key = "helix", .kind = &kt_kind_map, .detail = &helix_table},
    {.key = "spline", .kind = &kind_points},
};
static const forms tracks = {"a curve", "line, circle, helix, spline", track_fields, 4};

static bool read_track(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_track track = {.type = KT_TRACK_NONE};
    track.type = (kt_track_type)read_form(r, scope, node, &tracks, &track);
    if (track.type != KT_TRACK_NONE)
        *(kt_track *)kt_field_in(object, field) = track;
    return track.type != KT_TRACK_NONE;
}

static void write_track(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    static const kt_track none = {.type = KT_TRACK_NONE};
    const kt_track *track = kt_field_of(object, field);
    (void)standard;
    write_stated_form(e, &tracks, (int)track->type, track, &none);
}

static bool same_track(const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    return ((const kt_track *)kt_field_of(object, field))->type == KT_TRACK_NONE;
}

const kt_kind kt_kind_track = {read_track, write_track, same_track};
