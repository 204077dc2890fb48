/* The lists of loops and effects, and the joints that the assembly holds. */
#include "scene/part.h"

#include <stddef.h>

/* Whether it acts throughout (kt_switching). */
static const char *const switching_names[] = {"always", "on", "off"};
static const kt_choice switchings = {"switched", switching_names, KT_SWITCHING_COUNT, 0};

/* ---- loops ------------------------------------------------------------------------------------------------------- */

#define LOOP_NAME(id, name) #name,
static const char *const loop_names[] = {KT_LOOP_LIST(LOOP_NAME)};
static const kt_choice loop_types = {"loops.type", loop_names, KT_LOOP_TYPE_COUNT, 0};

static const kt_descriptor *describe_loop(int type) { return kt_loop_descriptor((kt_loop_type)type); }

static const kt_field loop_fields[] = {
    {.key = "name", .kind = &kt_kind_name, .offset = offsetof(kt_loop, name)},
    {.key = "type",
     .kind = &kt_kind_choice,
     .offset = offsetof(kt_loop, type),
     .flags = KT_FIELD_REQUIRED,
     .detail = &loop_types},
    {.key = "switched", .kind = &kt_kind_choice, .offset = offsetof(kt_loop, switching), .detail = &switchings},
};
static const kt_table loop_table = {.fields = loop_fields,
                                    .count = KT_COUNT_OF(loop_fields),
                                    .flow = true,
                                    .types = &loop_types,
                                    .describe = describe_loop,
                                    .kind_of = kt_kind_of_item_key};

static bool read_loops(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    int count = 0;
    if (!kt_list_nodes(r, scope, node, "a list of loops ('- {type: ..., between: ...}')", &r->scene->loop_nodes,
                       &count))
        return false;
    kt_loop *loops = kt_pool_take(&r->keep, (size_t)count, sizeof *loops);
    if (loops == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < count; i++) {
        const kt_scope here = kt_item_scope("loop", "loops", i, r->scene->loop_nodes[i]);
        loops[i] = kt_loop_default();
        r->scene->joint_quantity = KT_QUANTITY_ANGLE;
        (void)kt_table_read(r, &here, r->scene->loop_nodes[i], &loop_table, &loops[i]);
    }
    scene->description.loops = loops;
    scene->description.loop_count = count;
    return true;
}

static void write_loops(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    const kt_description *description = &((const kt_scene *)object)->description;
    const kt_loop rest = kt_loop_default();
    kt_emit_list(e, false);
    for (int i = 0; i < description->loop_count; i++)
        if (description->loops[i].type == KT_LOOP_CUSTOM)
            kt_emit_refuse(e, KT_ERROR_UNSUPPORTED, "loops[%d] calls back into a program; no scene file can hold it",
                           i);
        else
            kt_table_write(e, &loop_table, &description->loops[i], &rest);
    kt_emit_end(e);
}

static bool same_loops(const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    return ((const kt_scene *)object)->description.loop_count == 0;
}

const kt_kind kt_kind_loops = {read_loops, write_loops, same_loops};

/* ---- the initial state ------------------------------------------------------------------------------------------- */

static bool read_hold(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    int count = 0;
    if (!kt_list_nodes(r, scope, node, "a list of joints", &r->scene->hold_nodes, &count))
        return false;
    const char **hold = kt_pool_take(&r->keep, (size_t)count, sizeof *hold);
    if (hold == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < count; i++) {
        const kt_scope here = {.outer = scope, .index = i};
        (void)kt_read_name(r, &here, r->scene->hold_nodes[i], "the name of a joint", &hold[i]);
    }
    scene->description.hold = hold;
    scene->description.hold_count = count;
    return true;
}

static void write_hold(kt_emitter *e, const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    const kt_description *description = &((const kt_scene *)object)->description;
    kt_emit_list(e, true);
    for (int i = 0; i < description->hold_count; i++)
        kt_emit_text(e, description->hold[i]);
    kt_emit_end(e);
}

static bool same_hold(const kt_field *field, const void *object, const void *standard) {
    (void)field;
    (void)standard;
    return ((const kt_scene *)object)->description.hold_count == 0;
}

static const kt_kind kind_hold = {read_hold, write_hold, same_hold};
static const kt_field initial_fields[] = {
    {.key = "hold", .kind = &kind_hold},
    {.key = "tolerance", .kind = &kt_kind_number, .offset = offsetof(kt_scene, description.tolerance)},
    {.key = "from", .kind = &kt_kind_text, .offset = offsetof(kt_scene, from)},
};
const kt_table kt_initial_table = {.fields = initial_fields, .count = KT_COUNT_OF(initial_fields)};

/* ---- effects ----------------------------------------------------------------------------------------------------- */

#define EFFECT_NAME(id, name) #name,
static const char *const effect_names[] = {KT_EFFECT_LIST(EFFECT_NAME)};
static const kt_choice effect_types = {"effects.type", effect_names, KT_EFFECT_TYPE_COUNT, 0};

static const kt_descriptor *describe_effect(int type) { return kt_effect_descriptor((kt_effect_type)type); }

static const kt_field effect_fields[] = {
    {.key = "name", .kind = &kt_kind_name, .offset = offsetof(kt_effect, name)},
    {.key = "type",
     .kind = &kt_kind_choice,
     .offset = offsetof(kt_effect, type),
     .flags = KT_FIELD_REQUIRED,
     .detail = &effect_types},
    {.key = "switched", .kind = &kt_kind_choice, .offset = offsetof(kt_effect, switching), .detail = &switchings},
};
static const kt_table effect_table = {.fields = effect_fields,
                                      .count = KT_COUNT_OF(effect_fields),
                                      .flow = true,
                                      .types = &effect_types,
                                      .describe = describe_effect,
                                      .kind_of = kt_kind_of_item_key};

/* A missing length is the initial one; types without a length have no initial length. */
static void read_effect(kt_reader *r, const kt_scope *scope, kt_node *node, kt_effect *effect) {
    const bool in_joint = kt_node_find(node, "joint") != NULL, between = kt_node_find(node, "between") != NULL;
    const kt_node *const at = kt_node_find(node, "at");
    effect->initial_length = true;
    effect->end_count = between ? 2 : at != NULL ? 1 : 0;
    r->scene->joint_quantity = KT_QUANTITY_ANGLE;
    const bool good = kt_table_read(r, scope, node, &effect_table, effect);
    if (!good || kt_descriptor_kind(kt_effect_descriptor(effect->type), KT_KEY_DISTANCE) == NULL)
        effect->initial_length = false;
    if (good && effect->type != KT_EFFECT_EXPRESSION)
        effect->end_count = 0;
    else if (good && in_joint + between + (at != NULL) != 1 && !kt_node_has_stray(node))
        (void)kt_fault_at(
            r, KT_ERROR_SCENE, scope, node,
            "an expression acts in a `joint`, `between` two ends, or `at` a point of a body; give one of them");
}

static bool read_effects(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    int count = 0;
    if (!kt_list_nodes(r, scope, node, "a list of effects ('- {type: ..., ...}')", &r->scene->effect_nodes, &count))
        return false;
    kt_effect *effects = kt_pool_take(&r->keep, (size_t)count, sizeof *effects);
    if (effects == NULL)
        return kt_reader_out_of_memory(r);
    for (int i = 0; i < count; i++) {
        const kt_scope here = kt_item_scope("effect", "effects", i, r->scene->effect_nodes[i]);
        effects[i] = kt_effect_default();
        read_effect(r, &here, r->scene->effect_nodes[i], &effects[i]);
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
        if (description->effects[i].type == KT_EFFECT_CUSTOM || description->effects[i].law != NULL)
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
