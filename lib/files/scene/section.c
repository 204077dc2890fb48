/* The lists of loops and effects, and the joints that the assembly holds. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/describe.h"
#include "scene/scene_part.h"

#include <math.h>
#include <stddef.h>

/* Whether it acts throughout (kt_switching). */
static const char *const switching_names[] = {"always", "on", "off", "never"};
static const kt_choice switchings = {"switched", switching_names, KT_SWITCHING_COUNT, 0, NULL};

#define AT(item, member) .offset = offsetof(item, member)

/* ---- loops ------------------------------------------------------------------------------------------------------- */

static const char *const loop_names[] = {KT_LOOP_LIST(KT_LISTED_NAME)};
static const kt_choice loop_types = {"loops.type", loop_names, KT_LOOP_TYPE_COUNT, 0, NULL};

static const kt_descriptor *describe_loop(int type) { return kt_loop_descriptor((kt_loop_type)type); }

static const kt_field loop_fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(kt_loop, name)},
    {.key = "type", .kind = &kt_kind_choice, AT(kt_loop, type), .flags = KT_FIELD_REQUIRED, .detail = &loop_types},
    {.key = "switched", .kind = &kt_kind_choice, AT(kt_loop, switching), .detail = &switchings},
    {.key = "coordinates", .kind = &kt_kind_flag, AT(kt_loop, coordinates)},
};
static const kt_table loop_table = {.fields = loop_fields,
                                    .count = KT_COUNT_OF(loop_fields),
                                    .flow = true,
                                    .types = &loop_types,
                                    .describe = describe_loop,
                                    .kind_of = kt_kind_of_item_key};

static void read_loop_item(kt_reader *r, const kt_scope *scope, const kt_item_read *item) {
    kt_loop *loop = (kt_loop *)item->items + item->index;
    *loop = kt_loop_default();
    r->scene->joint_quantity = KT_QUANTITY_ANGLE;
    (void)kt_table_read(r, scope, item->nodes[item->index], &loop_table, loop);
}

static void write_loop(kt_emitter *e, const void *item, int index) {
    const kt_loop *loop = item, rest = kt_loop_default();
    if (loop->type == KT_LOOP_CUSTOM)
        kt_emit_reject(e, KT_ERROR_UNSUPPORTED, "loops[%d] calls back into a program; no scene file can hold it",
                       index);
    else
        kt_table_write(e, &loop_table, loop, &rest);
}

static bool finish_loops(kt_reader *r, const kt_item_read *all) {
    return kt_graph_loops_append(r, &((kt_scene *)all->object)->description);
}

const kt_items kt_loops = {.expected = "a list of loops ('- {type: ..., between: ...}')",
                           .noun = "loop",
                           .section = "loops",
                           .size = sizeof(kt_loop),
                           .array = offsetof(kt_scene, description.loops),
                           .count = offsetof(kt_scene, description.loop_count),
                           .nodes = offsetof(kt_scene_reading, loop_nodes),
                           .read = read_loop_item,
                           .write = write_loop,
                           .finish = finish_loops};

/* ---- the initial state ------------------------------------------------------------------------------------------- */

static void read_hold(kt_reader *r, const kt_scope *scope, const kt_item_read *item) {
    const char **name = (const char **)item->items + item->index;
    (void)kt_read_name(r, scope, item->nodes[item->index], "the name of a joint", name);
}

static void write_hold(kt_emitter *e, const void *item, int index) {
    (void)index;
    kt_emit_text(e, *(const char *const *)item);
}

static const kt_items hold = {.expected = "a list of joints",
                              .size = sizeof(const char *),
                              .array = offsetof(kt_scene, description.hold),
                              .count = offsetof(kt_scene, description.hold_count),
                              .nodes = offsetof(kt_scene_reading, hold_nodes),
                              .flow = true,
                              .read = read_hold,
                              .write = write_hold};
static const kt_field initial_fields[] = {
    {.key = "hold", .kind = &kt_kind_items, .detail = &hold},
    {.key = "tolerance", .kind = &kt_kind_number, AT(kt_scene, description.tolerance)},
    {.key = "from", .kind = &kt_kind_text, AT(kt_scene, from)},
};
const kt_table kt_initial_table = {.fields = initial_fields, .count = KT_COUNT_OF(initial_fields)};

/* ---- effects ----------------------------------------------------------------------------------------------------- */

static const char *const effect_names[] = {KT_EFFECT_LIST(KT_LISTED_NAME)};
static const kt_closed_word fmu = {
    "fmu",
    "is no type any more, since a scene couples no FMUs; export the plant with 'kinetree export --fmu', and couple "
    "both FMUs with FMPy or OMSimulator"};
static const kt_choice effect_types = {"effects.type", effect_names, KT_EFFECT_TYPE_COUNT, 0, &fmu};

static const kt_descriptor *describe_effect(int type) { return kt_effect_descriptor((kt_effect_type)type); }

static const kt_field effect_fields[] = {
    {.key = "name", .kind = &kt_kind_name, AT(kt_effect, name)},
    {.key = "type", .kind = &kt_kind_choice, AT(kt_effect, type), .flags = KT_FIELD_REQUIRED, .detail = &effect_types},
    {.key = "switched", .kind = &kt_kind_choice, AT(kt_effect, switching), .detail = &switchings},
};
static const kt_table effect_table = {.fields = effect_fields,
                                      .count = KT_COUNT_OF(effect_fields),
                                      .flow = true,
                                      .types = &effect_types,
                                      .describe = describe_effect,
                                      .kind_of = kt_kind_of_item_key};

/* A missing length is the initial one; types without a length have no initial length. */
static void read_effect(kt_reader *r, const kt_scope *scope, const kt_item_read *item) {
    kt_node *node = item->nodes[item->index];
    kt_effect *effect = (kt_effect *)item->items + item->index;
    const bool in_joint = kt_node_find(node, "joint") != NULL, between = kt_node_find(node, "between") != NULL;
    const bool path = kt_node_find(node, "path") != NULL;
    const kt_node *const at = kt_node_find(node, "at");
    *effect = kt_effect_default();
    effect->initial_length = true;
    effect->end_count = between || path ? 2 : at != NULL ? 1 : 0;
    r->scene->joint_quantity = KT_QUANTITY_ANGLE;
    const bool good = kt_table_read(r, scope, node, &effect_table, effect);
    if (!good || kt_descriptor_kind(kt_effect_descriptor(effect->type), KT_KEY_DISTANCE) == NULL)
        effect->initial_length = false;
    if (good && effect->type != KT_EFFECT_EXPRESSION)
        effect->end_count = 0;
    else if (good && in_joint + between + path + (at != NULL) != 1 && !kt_node_has_stray(node))
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                          "an expression acts in a `joint`, `between` two ends, along a `path`, or `at` a point of a "
                          "body; give one of "
                          "them");
    else if (good && effect->actuators == NULL && (isfinite(effect->lower) || isfinite(effect->upper)))
        (void)kt_fault_at(r, KT_ERROR_SCENE, scope, node,
                          "`lower` and `upper` bound the sum of `actuators`; write clamp(..) into the formula");
}

static void write_effect(kt_emitter *e, const void *item, int index) {
    const kt_effect *effect = item, rest = kt_effect_default();
    if (effect->type == KT_EFFECT_CUSTOM || effect->law != NULL)
        kt_emit_reject(e, KT_ERROR_UNSUPPORTED, "effects[%d] calls back into a program; no scene file can hold it",
                       index);
    else
        kt_table_write(e, &effect_table, effect, &rest);
}

const kt_items kt_effects = {.expected = "a list of effects ('- {type: ..., ...}')",
                             .noun = "effect",
                             .section = "effects",
                             .size = sizeof(kt_effect),
                             .array = offsetof(kt_scene, description.effects),
                             .count = offsetof(kt_scene, description.effect_count),
                             .nodes = offsetof(kt_scene_reading, effect_nodes),
                             .read = read_effect,
                             .write = write_effect};
