/* Effects: a new one is its keys in this table, for as long as kt_effect has room for what they say. */
#include "scene/part.h"

#include <stddef.h>

enum {
    SPRING = 1 << KT_EFFECT_SPRING,
    JOINT_DAMPER = 1 << KT_EFFECT_JOINT_DAMPER,
    MOTOR = 1 << KT_EFFECT_MOTOR,
    FORCE = 1 << KT_EFFECT_FORCE
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

#define AT(member) .offset = offsetof(kt_effect, member)
#define REQUIRED .flags = KT_FIELD_REQUIRED
static const kt_field fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(name)},
    {.key = "type", .kind = &kt_kind_choice, AT(type), REQUIRED, .detail = &types},
    {.key = "between", .kind = &kt_kind_ends, AT(between), .types = SPRING, REQUIRED},
    {.key = "joint", .kind = &kt_kind_name, AT(joint), .types = JOINT_DAMPER | MOTOR, REQUIRED},
    {.key = "stiffness", .kind = &kt_kind_number, AT(stiffness), .types = SPRING},
    {.key = "length", .kind = &kind_length, AT(length), .types = SPRING},
    {.key = "damping", .kind = &kt_kind_number, AT(damping), .types = SPRING},
    {.key = "damping", .kind = &kt_kind_number, AT(damping), .types = JOINT_DAMPER, REQUIRED},
    {.key = "at", .kind = &kt_kind_end, AT(between[0]), .types = FORCE, REQUIRED},
    {.key = "value", .kind = &kt_kind_functions, AT(value), .types = FORCE, REQUIRED},
    {.key = "frame", .kind = &kt_kind_choice, AT(frame), .types = FORCE, .detail = &frames},
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
    kt_effect *effects = kt_arena_take(&r->keep, (size_t)count, sizeof *effects);
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
        kt_table_write(e, &effect_table, &description->effects[i], &rest);
    kt_emit_end(e);
}

static bool same_effects(const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    return ((const kt_scene *)object)->description.effect_count == 0;
}

const kt_kind kt_kind_effects = {read_effects, write_effects, same_effects};
