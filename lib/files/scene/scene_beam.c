/* Beams: the section `beams` is made into items of `bodies`, `effects` and `loops` before these are read. A segment is
 * therefore a body like any other, and others may have it as parent or end. Faults of its items are reported at the
 * beam. parts/beam_segments.c makes the items. They are written as a text, and read from there as nodes; the ends of
 * the beam keep the nodes that the file gives them.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "document/emit.h"
#include "kinetree/build.h"
#include "scene/expand.h"
#include "scene/scene_part.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { KT_BEAM_STATIONS_MAX = 64 };

/* A beam, and what the file has in other forms. */
typedef struct kt_scene_beam {
    kt_beam beam;
    kt_node *from, *to;
    double segments;
    bool has_ends;
} kt_scene_beam;

/* ---- kinds of values --------------------------------------------------------------------------------------------- */

static bool read_node(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)r, (void)scope;
    kt_node **out = kt_field_in(object, field);
    *out = node;
    return true;
}
static const kt_kind kind_node = {.read = read_node};

static bool check_stations(kt_reader *r, const kt_scope *scope, kt_node *node) {
    return (node->count >= 2 && node->count <= KT_BEAM_STATIONS_MAX) ||
           kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%u stations along the beam; there may be 2 to %d", node->count,
                       (int)KT_BEAM_STATIONS_MAX);
}

/* Room for the stations of a list; NULL after a fault. */
static double *take_stations(kt_reader *r, const kt_scope *scope, kt_node *node) {
    if (!check_stations(r, scope, node))
        return NULL;
    double *stations = kt_reader_take(r, &r->scratch, node->count, sizeof *stations);
    return stations;
}

/* A number, or a list of them at stations along the beam. */
static bool read_along(kt_reader *r, const kt_scope *scope, kt_node *node, kt_beam_property *out) {
    if (node->kind != KT_NODE_LIST)
        return kt_read_number(r, scope, node, KT_QUANTITY_POSITIVE, &out->value);
    double *stations = take_stations(r, scope, node);
    kt_scope here = {.outer = scope};
    if (stations == NULL)
        return false;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++)
        if (!kt_read_number(r, &here, item, KT_QUANTITY_POSITIVE, &stations[here.index]))
            return false;
    *out = (kt_beam_property){.stations = stations, .station_count = here.index};
    return true;
}

static bool read_scalar(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return read_along(r, scope, node, kt_field_in(object, field));
}
static const kt_kind kind_scalar = {.read = read_scalar};

/* A list of pairs [y, z] at stations along the beam. */
static bool read_pairs_along(kt_reader *r, const kt_scope *scope, kt_node *node, kt_beam_property out[2]) {
    double *y = take_stations(r, scope, node), *z = y != NULL ? take_stations(r, scope, node) : NULL, x[2];
    kt_scope here = {.outer = scope};
    if (z == NULL)
        return false;
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++) {
        if (!kt_read_numbers(r, &here, item, 2, KT_QUANTITY_POSITIVE, NULL, x))
            return false;
        y[here.index] = x[0];
        z[here.index] = x[1];
    }
    out[0] = (kt_beam_property){.stations = y, .station_count = here.index};
    out[1] = (kt_beam_property){.stations = z, .station_count = here.index};
    return true;
}

/* [y, z], or a list of such pairs at stations along the beam. */
static bool read_pair(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_beam_property *out = kt_field_in(object, field);
    double x[2];
    if (node->kind != KT_NODE_LIST || node->count < 2)
        return kt_fault_expected(r, scope, node, "[y, z], or a list of such pairs along the beam");
    if (node->of.first->kind == KT_NODE_LIST)
        return read_pairs_along(r, scope, node, out);
    if (!kt_read_numbers(r, scope, node, 2, KT_QUANTITY_POSITIVE, NULL, x))
        return false;
    out[0].value = x[0];
    out[1].value = x[1];
    return true;
}
static const kt_kind kind_pair = {.read = read_pair};

/* EI: one number bends in the plane, two about y and z. */
static bool read_bending(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_beam_property *out = kt_field_in(object, field);
    return node->kind == KT_NODE_LIST ? read_pair(r, scope, node, field, object) : read_along(r, scope, node, &out[1]);
}
static const kt_kind kind_bending = {.read = read_bending};

static bool read_ends(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    static const char *const names[] = {"clamped", "hinged", "free"};
    static const kt_choice choice = {"beams.ends", names, 3, 0, NULL};
    kt_scene_beam *out = object;
    (void)field;
    if (node->kind != KT_NODE_LIST || node->count != 2)
        return kt_fault_expected(r, scope, node, "two of clamped, hinged and free");
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL; item = item->next, here.index++) {
        const int value = kt_choice_read(r, &here, item, &choice);
        if (value < 0)
            return false;
        out->beam.ends[here.index] = (kt_beam_end)value;
    }
    out->has_ends = true;
    return true;
}
static const kt_kind kind_ends = {.read = read_ends};

#define AT(member) .offset = offsetof(kt_scene_beam, member)
static const kt_field fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(beam.name), .flags = KT_FIELD_REQUIRED},
    {.key = "from", .kind = &kind_node, AT(from)},
    {.key = "to", .kind = &kind_node, AT(to)},
    {.key = "ends", .kind = &kind_ends},
    {.key = "segments", .kind = &kt_kind_positive, AT(segments), .flags = KT_FIELD_REQUIRED},
    {.key = "length", .kind = &kt_kind_positive, AT(beam.length), .flags = KT_FIELD_REQUIRED},
    {.key = "mass_per_length", .kind = &kind_scalar, AT(beam.mass), .flags = KT_FIELD_REQUIRED},
    {.key = "inertia_per_length", .kind = &kt_kind_positive, AT(beam.polar_inertia)},
    {.key = "EA", .kind = &kind_scalar, AT(beam.EA)},
    {.key = "GA", .kind = &kind_pair, AT(beam.GA)},
    {.key = "GJ", .kind = &kind_scalar, AT(beam.GJ)},
    {.key = "EI", .kind = &kind_bending, AT(beam.EI), .flags = KT_FIELD_REQUIRED},
    {.key = "curvature", .kind = &kt_kind_vector, AT(beam.curvature)},
    {.key = "damping", .kind = &kt_kind_number, AT(beam.damping)},
};
static const kt_table beam_table = {.fields = fields, .count = KT_COUNT_OF(fields)};

/* ---- checks ------------------------------------------------------------------------------------------------------ */

static bool check_ends(kt_reader *r, const kt_scope *scope, kt_node *node, kt_scene_beam *b) {
    kt_beam_end *last = &b->beam.ends[1];
    if (!b->has_ends)
        *last = b->to != NULL ? KT_BEAM_CLAMPED : KT_BEAM_FREE;
    if (b->to == NULL && *last != KT_BEAM_FREE)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "ends"),
                           "the second end is attached, but 'to: END' is missing; add it, or make the end free");
    if (b->to != NULL && *last == KT_BEAM_FREE)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "ends"),
                           "the second end is free, so 'to' has no meaning; leave out one of them");
    return true;
}

static bool check_scene_beam(kt_reader *r, const kt_scope *scope, kt_node *node, kt_scene_beam *b) {
    kt_error error;
    if (b->segments != floor(b->segments) || b->segments > KT_BEAM_SEGMENTS_MAX)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, kt_node_find(node, "segments"),
                           "%g: segments are a whole number, 2 to %d", b->segments, (int)KT_BEAM_SEGMENTS_MAX);
    b->beam.segments = (int)b->segments;
    if (!check_ends(r, scope, node, b))
        return false;
    if (kt_beam_check(&b->beam, &error) == KT_OK)
        return true;
    kt_node *place = kt_node_find(node, error.where);
    return kt_fault_at(r, KT_ERROR_SCENE, scope, place != NULL ? place : node, "%s", error.message);
}

/* ---- nodes ------------------------------------------------------------------------------------------------------- */

/* The place of a marker in the file's bodies; NULL: none. *nearest gets the bodies, until one has the name. */
static const kt_node *find_beam_marker(const kt_reader *r, const char *body, const char *marker, bool *has_body,
                                       kt_nearest *nearest) {
    const kt_node *bodies = kt_node_find(r->root, "bodies");
    if (bodies == NULL || bodies->kind != KT_NODE_LIST)
        return NULL;
    for (const kt_node *item = bodies->of.first; item != NULL; item = item->next) {
        const kt_node *name = item->kind == KT_NODE_MAP ? kt_node_find(item, "name") : NULL;
        const kt_node *markers = item->kind == KT_NODE_MAP ? kt_node_find(item, "markers") : NULL;
        if (name == NULL || name->kind != KT_NODE_TEXT)
            continue;
        (void)kt_nearest_try(nearest, name->of.text);
        *has_body = strcmp(name->of.text, body) == 0;
        if (*has_body)
            return markers != NULL && markers->kind == KT_NODE_MAP ? kt_node_find(markers, marker) : NULL;
    }
    return NULL;
}

/* Where the first segment starts: its parent, and the nodes of the point and the rotation there. NULL: none. */
typedef struct kt_beam_start {
    const char *body;
    const kt_node *at, *rotation;
} kt_beam_start;

/* The body, the point and the rotation where the beam begins, as nodes of the scene: those of the marker, or of `from`
 * itself. */
static bool find_from(kt_reader *r, const kt_scope *scope, const kt_scene_beam *b, kt_beam_start *start) {
    kt_end end = kt_end_default();
    if (b->from != NULL && !kt_read_end(r, scope, b->from, &end))
        return false;
    const bool is_map = b->from != NULL && b->from->kind == KT_NODE_MAP;
    const kt_node *at = is_map ? kt_node_find(b->from, "at") : NULL;
    const kt_node *turned = is_map ? kt_node_find(b->from, "rotation") : NULL;
    if (end.marker != NULL) {
        const char *body = end.body != NULL ? end.body : "world";
        bool has_body = end.body == NULL;
        kt_nearest nearest = kt_nearest_make(body, &r->effort);
        at = find_beam_marker(r, body, end.marker, &has_body, &nearest);
        if (at == NULL && !has_body && nearest.best != NULL)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, b->from, "body '%s' does not exist; did you mean '%s'?", body,
                               nearest.best);
        if (at == NULL && !has_body)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, b->from, "body '%s' does not exist; name a body of the scene",
                               body);
        if (at == NULL)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, b->from, "body '%s' has no marker '%s'", body, end.marker);
    }
    if (at != NULL && at->kind == KT_NODE_MAP) {
        const kt_node *on = kt_node_find(at, "rotation");
        at = kt_node_find(at, "at");
        if (on != NULL && turned != NULL)
            return kt_fault_at(r, KT_ERROR_SCENE, scope, b->from,
                               "marker '%s' and the beam both have a rotation; give one rotation that combines the two",
                               end.marker);
        turned = on != NULL ? on : turned;
    }
    start->body = end.body != NULL ? end.body : "world";
    start->at = at;
    start->rotation = turned;
    return true;
}

/* ---- text -------------------------------------------------------------------------------------------------------- */

/* Words of the text that nodes of the file replace: the ends of the beam, the parent of the first segment. */
static const char *const word_from = "__from__", *const word_to = "__to__", *const word_parent = "__parent__";
/* Numbers that are replaced: they are written since they differ from the defaults. */
static const kt_vec3 numbers_of_file = {1.0, 2.0, 3.0};

static void write_part(kt_emitter *e, const kt_items *list, const void *items, int count) {
    kt_emit_key(e, list->section);
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int i = 0; i < count; i++)
        list->write(e, (const char *)items + (size_t)i * list->size, i);
    kt_emit_end(e);
}

/* The parts of a beam as the text of a scene, which the caller frees; NULL if there is no memory. */
static char *write_beam(const kt_beam *beam, const kt_beam_start *start, size_t *size) {
    kt_builder *builder = NULL;
    kt_error error;
    char *text = NULL;
    FILE *stream = NULL;
    if (kt_builder_create(&builder, &error) == KT_OK && kt_builder_add_beam(builder, beam, &error) == KT_OK)
        stream = open_memstream(&text, size);
    if (stream == NULL) {
        kt_builder_free(builder);
        return NULL;
    }
    kt_body *first = kt_builder_body(builder, 0);
    first->parent = word_parent;
    if (start->at != NULL)
        first->joint.at = numbers_of_file;
    if (start->rotation != NULL)
        first->joint.rotation = kt_rotation_vector(numbers_of_file);
    const kt_description parts = kt_builder_describe(builder);
    kt_emitter e = {.stream = stream};
    kt_emit_map(&e, KT_EMIT_FLOW);
    write_part(&e, &kt_bodies, parts.bodies, parts.body_count);
    write_part(&e, &kt_effects, parts.effects, parts.effect_count);
    write_part(&e, &kt_loops, parts.loops, parts.loop_count);
    kt_emit_end(&e);
    const bool good = fclose(stream) == 0 && e.fault.code == KT_OK;
    kt_builder_free(builder);
    if (good)
        return text;
    free(text);
    return NULL;
}

/* ---- the section ------------------------------------------------------------------------------------------------- */

static void replace_value(kt_node *map, const char *key, const kt_node *value) {
    kt_node *old = kt_node_find(map, key);
    if (value == NULL)
        return;
    old->kind = value->kind;
    old->of = value->of;
    old->count = value->count;
    old->plain = value->plain;
}

/* The nodes of the beam's parts: a mapping of three lists. */
static kt_node *parse_beam(kt_reader *r, kt_scene_beam *b, const kt_beam_start *start) {
    size_t size = 0;
    b->beam.from = b->beam.to = kt_end_default();
    b->beam.from.body = word_from;
    b->beam.to.body = word_to;
    char *text = write_beam(&b->beam, start, &size);
    char *kept = text != NULL ? kt_pool_text(&r->scratch, text, size) : NULL; /* nodes point into it */
    free(text);
    return kept != NULL ? kt_nodes_parse(r, kept, size) : NULL;
}

/* Makes the parts of a beam as text of a scene, puts the words of the scene into them, and appends them to the
 * sections. */
static void expand_beam(kt_reader *r, kt_node *node, const kt_scope *scope, kt_scene_beam *b) {
    static const char *const sections[] = {"bodies", "effects", "loops"};
    kt_beam_start start = {.body = "world"};
    if (!find_from(r, scope, b, &start))
        return;
    kt_node *parts = parse_beam(r, b, &start);
    if (parts == NULL) {
        (void)kt_reader_out_of_memory(r);
        return;
    }
    const kt_replacement words[] = {{word_parent, NULL, start.body},
                                    {word_from, b->from, b->from == NULL ? "world" : NULL},
                                    {word_to, b->to, NULL}};
    kt_node *joint = kt_node_find(kt_node_find(parts, "bodies")->of.first, "joint");
    kt_nodes_settle(parts, node, words, KT_COUNT_OF(words));
    replace_value(joint, "at", start.at);
    replace_value(joint, "rotation", start.rotation);
    for (int p = 0; p < KT_COUNT_OF(sections); p++)
        kt_nodes_append(r, sections[p], kt_node_find(parts, sections[p]), node);
}

void kt_beams_expand(kt_reader *r) {
    const kt_scope scope = {.key = "beams"};
    kt_node *list = kt_node_find(r->root, "beams"), **nodes;
    int count = 0;
    if (list == NULL ||
        !kt_list_nodes(r, &scope, list, "a list of beams ('- {name: ..., segments: ...}')", &nodes, &count))
        return;
    for (int i = 0; i < count && !r->out_of_memory; i++) {
        const kt_scope here = kt_item_scope("beam", "beams", i, nodes[i]);
        kt_scene_beam beam = {.beam = kt_beam_default()};
        if (kt_table_read(r, &here, nodes[i], &beam_table, &beam) && !kt_node_is_faulty(nodes[i]) &&
            check_scene_beam(r, &here, nodes[i], &beam))
            expand_beam(r, nodes[i], &here, &beam);
    }
    if (kt_node_is_faulty(list))
        r->scene->names_are_known = false;
}
