/* Effects: a new one is its keys in this table, for as long as kt_effect has room for what they say. */
#include "scene/part.h"

#include <stddef.h>
#include <string.h>

/* A bit for each type: SPRING is 1U << KT_EFFECT_SPRING. */
enum {
    SPRING = 1 << KT_EFFECT_SPRING,
    JOINT_SPRING = 1 << KT_EFFECT_JOINT_SPRING,
    JOINT_DAMPER = 1 << KT_EFFECT_JOINT_DAMPER,
    JOINT_FRICTION = 1 << KT_EFFECT_JOINT_FRICTION,
    JOINT_LIMIT = 1 << KT_EFFECT_JOINT_LIMIT,
    BUSHING = 1 << KT_EFFECT_BUSHING,
    MOTOR = 1 << KT_EFFECT_MOTOR,
    FORCE = 1 << KT_EFFECT_FORCE,
    TORQUE = 1 << KT_EFFECT_TORQUE,
    DRAG = 1 << KT_EFFECT_DRAG,
    ATTRACTION = 1 << KT_EFFECT_ATTRACTION,
    CONTACT = 1 << KT_EFFECT_CONTACT,
    IN_JOINT = JOINT_SPRING | JOINT_DAMPER | JOINT_FRICTION | JOINT_LIMIT | MOTOR
};

#define EFFECT_NAME(id, name) #name,
static const char *const type_names[] = {KT_EFFECT_LIST(EFFECT_NAME)};
static const kt_choice types = {"effects.type", type_names, KT_EFFECT_TYPE_COUNT, 0};

/* Where there is no length it is the initial one, which reading begins with. */
static bool same_length(const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    return ((const kt_effect *)object)->initial_length;
}

static bool read_length(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_effect *effect = object;
    effect->initial_length = false;
    return kt_read_number(r, scope, node, KT_QUANTITY_NUMBER, kt_field_in(object, field));
}

static const char *const frame_names[] = {"world", "body"};
static const kt_choice frames = {"effects.frame", frame_names, 2, 0};

static const kt_kind kind_length = {read_length, kt_number_write, same_length};

/* Positions and speeds of the effect's joint, which has been read before: of an angle where it turns. */
static bool read_position(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const kt_effect *effect = object;
    return kt_read_number(r, scope, node, kt_joint_quantity(r, effect->joint), kt_field_in(object, field));
}

static bool read_speed(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const kt_effect *effect = object;
    const bool turns = kt_joint_quantity(r, effect->joint) == KT_QUANTITY_ANGLE;
    return kt_read_number(r, scope, node, turns ? KT_QUANTITY_RATE : KT_QUANTITY_NUMBER, kt_field_in(object, field));
}

static const kt_kind kind_position = {read_position, kt_number_write, kt_number_same};
static const kt_kind kind_speed = {read_speed, kt_number_write, kt_number_same};

/* Along and about x, y, z. */
static bool read_six(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_numbers(r, scope, node, 6, KT_QUANTITY_NUMBER, NULL, kt_field_in(object, field));
}

static void write_six(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    kt_emit_numbers(e, kt_field_of(object, field), 6);
}

static bool same_six(const kt_field *field, const void *object, const void *standard) {
    return kt_same_bits(kt_field_of(object, field), kt_field_of(standard, field), 6 * sizeof(double));
}

static const kt_kind kind_six = {read_six, write_six, same_six};

/* `on: BODY` and `at: [..]` are one end. Its marker, if it has one, is the point already. */
static void write_body(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)standard;
    kt_end end;
    memcpy(&end, kt_field_of(object, field), sizeof end);
    end.at = kt_vec3_make(0.0, 0.0, 0.0);
    kt_write_end(e, &end);
}

static bool read_body(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    return kt_read_end(r, scope, node, kt_field_in(object, field));
}

/* A vector; or a marker, MARKER or BODY.MARKER, of the body that `on` has named. */
static bool read_point(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    kt_end *on = &((kt_effect *)object)->between[0], point;
    (void)field;
    if (on->marker != NULL || on->at.x != 0.0 || on->at.y != 0.0 || on->at.z != 0.0)
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'on' says where already; leave one of them out");
    if (node->kind == KT_NODE_LIST)
        return kt_read_vector(r, scope, node, KT_QUANTITY_NUMBER, &on->at);
    if (node->kind != KT_NODE_TEXT || on->body == NULL)
        return kt_fault_expected(r, scope, node, "a list of three numbers, or a marker");
    if (!kt_read_end(r, scope, node, &point))
        return false;
    if (point.body == NULL || (point.marker != NULL && strcmp(point.body, on->body) != 0))
        return kt_fault_at(r, KT_ERROR_SCENE, scope, node, "%s is not on %s; name a marker of that body",
                           kt_name_quote(node->of.text).text, kt_name_quote(on->body).text);
    on->marker = point.marker != NULL ? point.marker : point.body;
    return true;
}

static bool same_point(const kt_field *field, const void *object, const void *standard) {
    return ((const kt_effect *)object)->between[0].marker != NULL || kt_kind_vector.same(field, object, standard);
}

static void write_point(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    kt_kind_vector.write(e, field, object, standard);
}

static const kt_kind kind_body = {.read = read_body, .write = write_body};
static const kt_kind kind_point = {read_point, write_point, same_point};

#define AT(member) .offset = offsetof(kt_effect, member)
#define REQUIRED .flags = KT_FIELD_REQUIRED
static const kt_field fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(name)},
    {.key = "type", .kind = &kt_kind_choice, AT(type), REQUIRED, .detail = &types},
    {.key = "between", .kind = &kt_kind_ends, AT(between), .types = SPRING | BUSHING | ATTRACTION, REQUIRED},
    {.key = "joint", .kind = &kt_kind_name, AT(joint), .types = IN_JOINT, REQUIRED},
    {.key = "point", .kind = &kt_kind_end, AT(between[0]), .types = CONTACT, REQUIRED},
    {.key = "radius", .kind = &kt_kind_number, AT(radius), .types = CONTACT},
    {.key = "plane", .kind = &kt_kind_end, AT(between[1]), .types = CONTACT, REQUIRED},
    {.key = "axis", .kind = &kt_kind_axis, AT(axis), .types = CONTACT},
    {.key = "lower", .kind = &kind_position, AT(lower), .types = JOINT_LIMIT},
    {.key = "upper", .kind = &kind_position, AT(upper), .types = JOINT_LIMIT},
    {.key = "stiffness", .kind = &kt_kind_number, AT(stiffness), .types = SPRING | JOINT_SPRING},
    {.key = "stiffness", .kind = &kt_kind_number, AT(stiffness), .types = JOINT_LIMIT | CONTACT, REQUIRED},
    {.key = "stiffness", .kind = &kind_six, AT(stiffnesses), .types = BUSHING},
    {.key = "length", .kind = &kind_length, AT(length), .types = SPRING},
    {.key = "rest", .kind = &kind_position, AT(rest), .types = JOINT_SPRING},
    {.key = "damping", .kind = &kt_kind_number, AT(damping), .types = SPRING | JOINT_SPRING | JOINT_LIMIT},
    {.key = "damping", .kind = &kt_kind_number, AT(damping), .types = JOINT_DAMPER, REQUIRED},
    {.key = "damping", .kind = &kind_six, AT(dampings), .types = BUSHING},
    {.key = "coulomb", .kind = &kt_kind_number, AT(coulomb), .types = JOINT_FRICTION},
    {.key = "viscous", .kind = &kt_kind_number, AT(viscous), .types = JOINT_FRICTION},
    {.key = "static", .kind = &kt_kind_number, AT(breakaway), .types = JOINT_FRICTION},
    {.key = "stribeck", .kind = &kind_speed, AT(stribeck), .types = JOINT_FRICTION},
    {.key = "smoothing", .kind = &kind_speed, AT(smoothing), .types = JOINT_FRICTION},
    {.key = "exponent", .kind = &kt_kind_number, AT(exponent), .types = CONTACT},
    {.key = "dissipation", .kind = &kt_kind_number, AT(dissipation), .types = CONTACT},
    {.key = "friction", .kind = &kt_kind_number, AT(friction), .types = CONTACT},
    {.key = "slip", .kind = &kt_kind_number, AT(slip), .types = CONTACT},
    {.key = "at", .kind = &kt_kind_end, AT(between[0]), .types = FORCE, REQUIRED},
    {.key = "on", .kind = &kt_kind_end, AT(between[0]), .types = TORQUE, REQUIRED},
    {.key = "on", .kind = &kind_body, AT(between[0]), .types = DRAG, REQUIRED},
    {.key = "at", .kind = &kind_point, AT(between[0].at), .types = DRAG},
    {.key = "value", .kind = &kt_kind_functions, AT(value), .types = FORCE | TORQUE, REQUIRED},
    {.key = "frame", .kind = &kt_kind_choice, AT(frame), .types = FORCE | TORQUE, .detail = &frames},
    {.key = "linear", .kind = &kt_kind_number, AT(linear), .types = DRAG},
    {.key = "quadratic", .kind = &kt_kind_number, AT(quadratic), .types = DRAG},
    {.key = "strength", .kind = &kt_kind_number, AT(strength), .types = ATTRACTION, REQUIRED},
    {.key = "torque", .kind = &kt_kind_function, AT(torque), .types = MOTOR},
    {.key = "force", .kind = &kt_kind_function, AT(torque), .types = MOTOR, .flags = KT_FIELD_READ_ONLY},
};
static const kt_table effect_table = {
    .where = "effects", .fields = fields, .count = KT_COUNT_OF(fields), .flow = true, .types = &types};

static void read_effect(kt_reader *r, const kt_scope *scope, kt_node *node, kt_effect *effect) {
    effect->initial_length = true;
    if (!kt_table_read(r, scope, node, &effect_table, effect) || effect->type != KT_EFFECT_SPRING)
        effect->initial_length = false;
    if (effect->type != KT_EFFECT_MOTOR)
        return;
    const kt_node *torque = kt_node_find(node, "torque"), *force = kt_node_find(node, "force");
    if (torque == NULL && force == NULL && !kt_node_is_faulty(node)) /* a misspelt one has been told */
        kt_fault_at(r, KT_ERROR_SCENE, scope, node, "the key 'torque' (or 'force') is missing");
    else if (torque != NULL && force != NULL)
        kt_fault_at(r, KT_ERROR_SCENE, scope, node, "'torque' and 'force' are the same; leave one of them out");
}

static bool read_effects(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    int count = 0;
    if (!kt_list_nodes(r, scope, node, "a list of effects ('- {type: ..., ...}')", &r->effect_nodes, &count))
        return false;
    kt_effect *effects = kt_pool_take(&r->keep, (size_t)count, sizeof *effects);
    if (effects == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < count; i++) {
        const kt_scope here = kt_item_scope("effect", "effects", i, r->effect_nodes[i]);
        effects[i] = kt_effect_default();
        read_effect(r, &here, r->effect_nodes[i], &effects[i]);
    }
    scene->description.effects = effects;
    scene->description.effect_count = count;
    return true;
}

static void write_effects(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    const kt_description *description = &((const kt_scene *)object)->description;
    const kt_effect rest = kt_effect_default();
    kt_emit_list(e, false);
    for (int i = 0; i < description->effect_count; i++)
        if (description->effects[i].type == KT_EFFECT_CUSTOM)
            kt_emit_refuse(e, KT_ERROR_UNSUPPORTED, "effects[%d] calls back into a program; no scene file can hold it",
                           i);
        else
            kt_table_write(e, &effect_table, &description->effects[i], &rest);
    kt_emit_end(e);
}

static bool same_effects(const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    return ((const kt_scene *)object)->description.effect_count == 0;
}

const kt_kind kt_kind_effects = {read_effects, write_effects, same_effects};
