/* Bodies: the list, and the keys of each. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/compile.h"
#include "model/describe.h"
#include "scene/shapes.h"
#include "scene/vary.h"

#include <math.h>
#include <string.h>

/* ---- mass properties: they depend on one another ----------------------------------------------------------------- */

static bool is_of_name(char c) {
    return c != '\0' && strchr("abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_", c) != NULL;
}

/* Whether a node is a function of time, and no number: a mapping, or a formula that contains t. */
static bool is_function_of_time(const kt_node *node) {
    if (node->kind != KT_NODE_TEXT)
        return node->kind == KT_NODE_MAP;
    for (const char *at = strchr(node->of.text, 't'); at != NULL && node->of.text[0] != '='; at = strchr(at + 1, 't'))
        if ((at == node->of.text || !is_of_name(at[-1])) && !is_of_name(at[1]))
            return true;
    return false;
}

/* The variable mass of a body, which is created if there is none. */
static kt_variable_mass *variable_mass_of(kt_reader *r, kt_body *body) {
    kt_variable_mass *made = kt_reader_take(r, &r->keep, 1, sizeof *made);
    if (made == NULL)
        return NULL;
    *made = body->variable_mass != NULL ? *body->variable_mass : (kt_variable_mass){.mass.type = KT_FUNCTION_NONE};
    body->variable_mass = made;
    return made;
}

/* Reads a function of time, and its value at t = 0. */
static bool read_dated(kt_reader *r, const kt_scope *scope, kt_node *node, kt_function *function, double *first) {
    double value[3];
    kt_error error = {0};
    if (!kt_read_function(r, scope, node, KT_QUANTITY_NUMBER, function))
        return false;
    if (kt_function_evaluate(function, 0.0, value, &error) != KT_OK)
        return kt_fault_at(r, error.code, scope, node, "%s", error.message);
    *first = value[0];
    return true;
}

static bool read_mass(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_body *body = object;
    if (!is_function_of_time(node))
        return kt_kind_number.read(r, scope, node, field, object);
    kt_variable_mass *variable = variable_mass_of(r, body);
    r->scene->unit = "kg";
    const bool good = variable != NULL && read_dated(r, scope, node, &variable->mass, &body->mass);
    r->scene->unit = NULL;
    if (!good)
        return false;
    return body->mass > 0.0 || kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                                           "the mass is %g at t = 0; it must be above 0 at all times", body->mass);
}

static void write_mass(kt_emitter *e, const kt_member *m) {
    const kt_body *body = m->object;
    if (body->variable_mass != NULL)
        kt_write_function(e, &body->variable_mass->mass);
    else
        kt_emit_number(e, body->mass);
}

static bool same_mass(const kt_member *m) {
    const kt_body *body = m->object;
    return body->variable_mass == NULL && !body->com_of_shape && !body->inertia_of_shape &&
           kt_same_bits(kt_member_value(m), kt_member_standard(m), sizeof body->mass);
}

/* Whether `mass` and `shape` are both written, so that a com or an inertia that is not written would be the shape's. */
static bool shape_has_mass(const kt_body *body, const kt_body *standard) {
    bool has_mass =
        body->com_of_shape || body->inertia_of_shape || !kt_same_bits(&body->mass, &standard->mass, sizeof body->mass);
    return has_mass && (body->shape.type != KT_SHAPE_NONE || body->shape_count > 0);
}

static bool same_com(const kt_member *m) {
    const kt_body *body = m->object;
    return body->com_of_shape || (!shape_has_mass(body, m->standard) &&
                                  kt_same_bits(kt_member_value(m), kt_member_standard(m), sizeof body->com));
}

static bool read_inertias(kt_reader *r, const kt_scope *scope, kt_node *node, kt_body *body, double values[6]) {
    kt_variable_mass *variable = variable_mass_of(r, body);
    bool good = variable != NULL;
    kt_scope here = {.outer = scope};
    for (kt_node *item = node->of.first; item != NULL && variable != NULL; item = item->next, here.index++)
        good = read_dated(r, &here, item, &variable->inertia[here.index], &values[here.index]) && good;
    return good;
}

static void follow_inertia(kt_reader *r, const kt_node *list, kt_sym3 *inertia) {
    double *const places[] = {&inertia->xx, &inertia->yy, &inertia->zz, &inertia->xy, &inertia->xz, &inertia->yz};
    int k = 0;
    for (kt_node *item = list->of.first; item != NULL; item = item->next)
        (void)kt_number_follows(r, item, false, places[k++]);
}

static bool read_inertia(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    double values[6] = {0.0};
    bool varies = false;
    if (node->kind != KT_NODE_LIST || (node->count != 3 && node->count != 6))
        return kt_fault_expected(r, scope, node, "[Ixx, Iyy, Izz] or [Ixx, Iyy, Izz, Ixy, Ixz, Iyz]");
    for (const kt_node *item = node->of.first; item != NULL; item = item->next)
        varies |= is_function_of_time(item);
    if (!(varies ? read_inertias(r, scope, node, object, values)
                 : kt_read_numbers(r, scope, node, (int)node->count, KT_QUANTITY_NUMBER, NULL, values)))
        return false;
    kt_sym3 *inertia = kt_field_in(object, field);
    *inertia = kt_sym3_make(values[0], values[1], values[2], values[3], values[4], values[5]);
    if (!varies)
        follow_inertia(r, node, inertia);
    return true;
}

static void write_inertias(kt_emitter *e, const kt_variable_mass *variable) {
    const kt_function zero = kt_function_constant(0.0);
    kt_emit_list(e, KT_EMIT_FLOW);
    for (int k = 0; k < 6; k++)
        kt_write_function(e, variable->inertia[k].type != KT_FUNCTION_NONE ? &variable->inertia[k] : &zero);
    kt_emit_end(e);
}

static void write_inertia(kt_emitter *e, const kt_member *m) {
    static const double zero[3] = {0.0, 0.0, 0.0};
    const kt_variable_mass *variable = ((const kt_body *)m->object)->variable_mass;
    if (variable != NULL && kt_variable_mass_has_moments(variable)) {
        write_inertias(e, variable);
        return;
    }
    const kt_sym3 *i = kt_member_value(m);
    const double values[] = {i->xx, i->yy, i->zz, i->xy, i->xz, i->yz};
    kt_emit_numbers(e, values, kt_same_bits(values + 3, zero, sizeof zero) ? 3 : 6);
}

static bool same_inertia(const kt_member *m) {
    const kt_body *body = m->object;
    return body->inertia_of_shape || (!shape_has_mass(body, m->standard) &&
                                      kt_same_bits(kt_member_value(m), kt_member_standard(m), sizeof(kt_sym3)));
}

/* Compared by same_inertia. */
static const kt_kind kind_inertia = {.read = read_inertia, .write = write_inertia};
static const kt_kind kind_mass = {.read = read_mass, .write = write_mass};

/* Mass that leaves or arrives has a velocity, which becomes an effect of type thrust at the end (kt_exhausts_add). */
static bool read_exhaust(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_vec3 velocity;
    (void)field, (void)object;
    return kt_read_vector(r, scope, node, &velocity);
}
static const kt_kind kind_exhaust = {.read = read_exhaust, .same = kt_never_written};

/* ---- other keys -------------------------------------------------------------------------------------------------- */

/* Whether the parent is the default, the world: the key is then not written. */
static bool same_parent(const kt_member *m) {
    const char *const *parent = kt_member_value(m);
    return *parent == NULL || strcmp(*parent, "world") == 0;
}

static bool same_shape(const kt_member *m) {
    const kt_body *body = m->object;
    return body->shape.type == KT_SHAPE_NONE;
}

/* A joint is not written if it is fixed, does not place the body and has no name. */
static bool same_body_joint(const kt_member *m) {
    const kt_joint *joint = &((const kt_body *)m->object)->joint, *rest = &((const kt_body *)m->standard)->joint;
    return joint->type == KT_JOINT_FIXED && joint->name == NULL &&
           kt_same_bits(&joint->at, &rest->at, sizeof joint->at) && kt_same_rotation(&joint->rotation, &rest->rotation);
}

static const kt_field marker_fields[] = {
    {.key = "at", .kind = &kt_kind_vector, .offset = offsetof(kt_marker, at)},
    {.key = "rotation", .kind = &kt_kind_rotation, .offset = offsetof(kt_marker, rotation)},
};
static const kt_table marker_table = {.fields = marker_fields, .count = KT_COUNT_OF(marker_fields)};

/* A point, or a frame: `tip: [1, 0, 0]`, `tool: {at: [1, 0, 0], rotation: ROTATION}`. */
static bool read_body_marker(kt_reader *r, const kt_scope *scope, kt_node *node, kt_marker *marker) {
    return node->kind == KT_NODE_MAP ? kt_table_read(r, scope, node, &marker_table, marker)
                                     : kt_put_numbers(r, scope, node, 3, KT_QUANTITY_NUMBER, NULL, &marker->at.x);
}

static void write_marker(kt_emitter *e, const kt_marker *marker) {
    static const kt_marker standard = {.name = NULL};
    const double at[] = {marker->at.x, marker->at.y, marker->at.z};
    kt_emit_name(e, marker->name);
    if (kt_same_rotation(&marker->rotation, &standard.rotation)) {
        kt_emit_numbers(e, at, 3);
        return;
    }
    kt_emit_map(e, KT_EMIT_FLOW);
    kt_emit_key(e, "at");
    kt_emit_numbers(e, at, 3);
    kt_emit_key(e, "rotation");
    kt_write_rotation(e, &marker->rotation);
    kt_emit_end(e);
}

/* Names used twice are left to kt_description_check. */
static bool read_body_markers(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_body *body = object;
    if (node->kind != KT_NODE_MAP)
        return kt_fault_expected(r, scope, node, "a mapping of names to points (tip: [1, 0, 0])");
    kt_marker *markers = kt_pool_take(&r->keep, node->count, sizeof *markers);
    if (markers == NULL)
        return kt_reader_out_of_memory(r);
    bool good = true;
    int i = 0;
    for (kt_node *key = node->of.first; key != NULL; key = key->next->next, i++) {
        const kt_scope here = {.outer = scope, .key = key->kind == KT_NODE_TEXT ? key->of.text : "?"};
        good = kt_read_name(r, scope, key, "a marker's name", &markers[i].name) && good;
        good = read_body_marker(r, &here, key->next, &markers[i]) && good;
    }
    body->markers = markers;
    body->marker_count = i;
    return good;
}

static void write_body_markers(kt_emitter *e, const kt_member *m) {
    const kt_body *body = m->object;
    kt_emit_map(e, KT_EMIT_BLOCK);
    for (int i = 0; i < body->marker_count; i++)
        write_marker(e, &body->markers[i]);
    kt_emit_end(e);
}

static const kt_kind kind_markers = {.read = read_body_markers, .write = write_body_markers, .size = sizeof(int)};

/* ---- shapes ------------------------------------------------------------------------------------------------------ */

static const char *const shape_names[] = {KT_SHAPE_LIST(KT_LISTED_NAME)};
static const kt_choice shape_types = {"shape.type", shape_names, KT_SHAPE_TYPE_COUNT, KT_SHAPE_NONE + 1, NULL};

static const kt_descriptor *describe_shape(int type) { return kt_shape_descriptor((kt_shape_type)type); }

static const kt_field shape_fields[] = {
    {.key = "type", .kind = &kt_kind_choice, .flags = KT_FIELD_REQUIRED, .detail = &shape_types},
};
_Static_assert(offsetof(kt_shape, type) == 0, "the key `type` of a shape");
static const kt_table shape_table = {.fields = shape_fields,
                                     .count = 1,
                                     .flow = true,
                                     .types = &shape_types,
                                     .describe = describe_shape,
                                     .kind_of = kt_kind_of_value_key};

/* ---- several shapes ---------------------------------------------------------------------------------------------- */

static const kt_field part_fields[] = {
    {.key = "type", .kind = &kt_kind_choice, .flags = KT_FIELD_REQUIRED, .detail = &shape_types},
    {.key = "mass", .kind = &kt_kind_number, .offset = offsetof(kt_scene_part, mass)},
};
_Static_assert(offsetof(kt_scene_part, shape) == 0, "keys of a shape are read into a part");
static const kt_table part_table = {.fields = part_fields,
                                    .count = KT_COUNT_OF(part_fields),
                                    .flow = true,
                                    .types = &shape_types,
                                    .describe = describe_shape,
                                    .kind_of = kt_kind_of_value_key};

/* Their masses are settled once the body has been read (read_body_item). */
static bool read_shapes(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_body *body = object;
    kt_node **nodes = NULL;
    int count = 0;
    (void)field;
    if (!kt_list_nodes(r, scope, node, "a list of shapes ('- {type: ...}')", &nodes, &count))
        return false;
    kt_shape *shapes = kt_pool_take(&r->keep, (size_t)count + 1, sizeof *shapes);
    kt_scene_part *parts = kt_pool_take(&r->scratch, (size_t)count + 1, sizeof *parts);
    if (shapes == NULL || parts == NULL)
        return kt_reader_out_of_memory(r);
    bool good = true;
    for (int i = 0; i < count; i++) {
        const kt_scope here = {.outer = scope, .index = i};
        parts[i] = (kt_scene_part){.shape = kt_shape_default(), .mass = (double)NAN};
        good = kt_table_read(r, &here, nodes[i], &part_table, &parts[i]) && !kt_node_is_faulty(nodes[i]) && good;
        shapes[i] = parts[i].shape;
    }
    body->shapes = shapes;
    body->shape_count = good ? count : 0;
    r->scene->parts = good ? parts : NULL;
    r->scene->part_nodes = nodes;
    return good;
}

static void write_shapes(kt_emitter *e, const kt_member *m) {
    const kt_body *body = m->object;
    const kt_shape rest = kt_shape_default();
    kt_emit_list(e, KT_EMIT_BLOCK);
    for (int i = 0; i < body->shape_count; i++)
        kt_table_write(e, &shape_table, &body->shapes[i], &rest);
    kt_emit_end(e);
}

static const kt_kind kind_shapes = {.read = read_shapes, .write = write_shapes, .size = sizeof(int)};

/* ---- a body ------------------------------------------------------------------------------------------------------ */

#define AT(member) .offset = offsetof(kt_body, member)
static const kt_field fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(name), .flags = KT_FIELD_REQUIRED},
    {.key = "parent", .kind = &kt_kind_name, AT(parent), .same = same_parent},
    {.key = "joint", .kind = &kt_kind_map, AT(joint), .detail = &kt_joint_table, .same = same_body_joint},
    {.key = "mass", .kind = &kind_mass, AT(mass), .same = same_mass},
    {.key = "com", .kind = &kt_kind_vector, AT(com), .same = same_com},
    {.key = "inertia", .kind = &kind_inertia, AT(inertia), .same = same_inertia},
    {.key = "exhaust", .kind = &kind_exhaust},
    {.key = "shape", .kind = &kt_kind_map, AT(shape), .detail = &shape_table, .same = same_shape},
    {.key = "shapes", .kind = &kind_shapes, AT(shape_count)},
    {.key = "markers", .kind = &kind_markers, AT(marker_count)},
};
static const kt_table body_table = {.fields = fields, .count = KT_COUNT_OF(fields)};

/* Gives the body the mass, com and inertia of its shapes. */
static void settle_shapes(kt_reader *r, const kt_scope *scope, kt_node *node, kt_body *body) {
    kt_node *list = kt_node_find(node, "shapes");
    if (r->scene->parts == NULL || list == NULL)
        return;
    if (kt_node_find(node, "shape") != NULL) {
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, list, "the body has a `shape`, too; put it into the list");
        return;
    }
    const unsigned given = (kt_node_find(node, "mass") != NULL ? KT_GIVES_MASS : 0) |
                           (kt_node_find(node, "com") != NULL ? KT_GIVES_COM : 0) |
                           (kt_node_find(node, "inertia") != NULL ? KT_GIVES_INERTIA : 0);
    (void)kt_parts_settle(r, scope, list, r->scene->part_nodes, r->scene->parts, body->shape_count, given, body);
}

static void read_keys(kt_reader *r, const kt_scope *scope, kt_node *node, kt_body *body) {
    r->scene->parts = NULL;
    if (!kt_table_read(r, scope, node, &body_table, body))
        return;
    settle_shapes(r, scope, node, body);
    if (body->variable_mass != NULL && body->variable_mass->mass.type == KT_FUNCTION_NONE) {
        kt_variable_mass *variable = variable_mass_of(r, body); /* inertias alone vary */
        if (variable != NULL)
            variable->mass = kt_function_constant(body->mass);
    }
    if (body->parent != NULL && strcmp(body->parent, "world") == 0)
        body->parent = NULL;
    if (kt_node_find(node, "mass") != NULL && kt_node_find(node, "shape") != NULL) {
        body->com_of_shape = kt_node_find(node, "com") == NULL;
        body->inertia_of_shape = kt_node_find(node, "inertia") == NULL;
    }
}

static void read_body_item(kt_reader *r, const kt_scope *scope, const kt_item_read *item) {
    kt_body *body = (kt_body *)item->items + item->index;
    *body = kt_body_default();
    read_keys(r, scope, item->nodes[item->index], body);
    if (!kt_name_is_valid(body->name) || strcmp(body->name, "world") == 0)
        r->scene->names_are_known = false;
    r->scene->hides_bodies = r->scene->hides_bodies || kt_body_is_hidden(r, item->index);
}

/* ---- the list ---------------------------------------------------------------------------------------------------- */

bool kt_bodies_index(kt_reader *r, const kt_body *bodies, int count) {
    if (!kt_index_bodies(&r->scratch, &r->scene->names, bodies, count))
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < count; i++)
        if (kt_find_body(r, bodies[i].name) != i) /* one of the two may have another name */
            r->scene->names_are_doubled = true;
    return true;
}

static bool index_bodies(kt_reader *r, const kt_item_read *all) { return kt_bodies_index(r, all->items, all->count); }

static void write_body_item(kt_emitter *e, const void *item, int index) {
    const kt_body rest = kt_body_default();
    (void)index;
    kt_table_write(e, &body_table, item, &rest);
}

const kt_items kt_bodies = {.expected = "a list of bodies ('- name: ...')",
                            .noun = "body",
                            .section = "bodies",
                            .size = sizeof(kt_body),
                            .array = offsetof(kt_scene, description.bodies),
                            .count = offsetof(kt_scene, description.body_count),
                            .nodes = offsetof(kt_scene_reading, body_nodes),
                            .read = read_body_item,
                            .write = write_body_item,
                            .finish = index_bodies};

/* ---- what leaves bodies ------------------------------------------------------------------------------------------ */

/* The thrust of a body's exhaust, at its centre of mass. */
static bool make_thrust(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_body *body, kt_effect *thrust) {
    static const char suffix[] = "-exhaust";
    const size_t length = strlen(body->name);
    char *name = kt_pool_take(&r->keep, length + sizeof suffix, 1);
    kt_end end = kt_end_default();
    kt_sym3 inertia;
    if (name == NULL)
        return kt_reader_out_of_memory(r);
    if (body->variable_mass == NULL)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                           "the mass is constant, so nothing leaves or arrives; give `mass` as a function of time");
    memcpy(name, body->name, length);
    memcpy(name + length, suffix, sizeof suffix);
    *thrust = kt_effect_default();
    if (!kt_read_vector(r, scope, node, &thrust->exhaust) ||
        kt_body_inertia(body, &end.at, &inertia, NULL) != KT_OK) /* the check of the body reports its fault */
        return false;
    end.body = body->name;
    thrust->name = name;
    thrust->type = KT_EFFECT_THRUST;
    thrust->between[0] = end;
    thrust->mass = body->variable_mass->mass;
    return true;
}

/* A body with wrong keys gets no faults that follow from these keys. */
static bool has_exhaust_name(const kt_reader *r, const kt_description *d, int body) {
    return kt_name_is_valid(d->bodies[body].name) && !kt_node_has_stray(r->scene->body_nodes[body]);
}

void kt_exhausts_add(kt_reader *r, kt_description *d) {
    int count = 0, added = d->effect_count;
    for (int i = 0; i < d->body_count; i++)
        count += kt_node_find(r->scene->body_nodes[i], "exhaust") != NULL && has_exhaust_name(r, d, i);
    if (count == 0)
        return;
    const size_t all = (size_t)d->effect_count + (size_t)count;
    kt_effect *effects = kt_reader_take(r, &r->keep, all, sizeof *effects);
    kt_node **nodes = kt_reader_take(r, &r->scratch, all, sizeof *nodes);
    if (effects == NULL || nodes == NULL)
        return;
    for (int i = 0; i < d->effect_count; i++) {
        effects[i] = d->effects[i];
        nodes[i] = r->scene->effect_nodes[i];
    }
    for (int i = 0; i < d->body_count; i++) {
        kt_node *node = kt_node_find(r->scene->body_nodes[i], "exhaust");
        const kt_scope body = kt_item_scope("body", "bodies", i, r->scene->body_nodes[i]);
        const kt_scope here = {.outer = &body, .key = "exhaust"};
        if (node == NULL || !has_exhaust_name(r, d, i) || !make_thrust(r, &here, node, &d->bodies[i], &effects[added]))
            continue;
        nodes[added++] = r->scene->body_nodes[i];
    }
    d->effects = effects;
    d->effect_count = added;
    r->scene->effect_nodes = nodes;
}
