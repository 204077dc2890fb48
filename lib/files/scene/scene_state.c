/* Auxiliary states of a scene, and their rates, in which every one of them may be used:
 *
 *     states: {current: {initial: 0, rate: "(supply - R*current - k*velocity.rotor)/L"}}
 *
 * or their activations by numbers (scene_actuator.c).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "model/formula_names.h"
#include "scene/foothold.h"
#include "scene/named.h"
#include "scene/scene_expression.h"
#include "scene/scene_part.h"

#include <stddef.h>

static bool read_state_rate(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    const char **out = kt_field_in(object, field);
    kt_formula_names names = {.description = r->scene->description};
    const kt_symbols symbols = kt_formula_symbols(&names);
    if (node->kind != KT_NODE_TEXT || node->count == 0)
        return kt_fault_expected(r, scope, node, "a formula (\"(input - current)/T\")");
    if (!kt_variables_are_known(r)) {
        node->faulty = true; /* a fault of the names has been reported */
        return false;
    }
    return kt_read_formula(r, scope, node, &symbols, true, out);
}

static const kt_kind kind_rate = {.read = read_state_rate, .write = kt_text_write};

#define AT(member) .offset = offsetof(kt_auxiliary_state, member)
static const kt_field state_fields[] = {
    {.key = "initial", .kind = &kt_kind_number, AT(initial)},
    {.key = "rate", .kind = &kind_rate, AT(rate), .flags = KT_FIELD_REQUIRED},
};
static const kt_table state_table = {.fields = state_fields, .count = KT_COUNT_OF(state_fields), .flow = true};
static const kt_field activated_fields[] = {
    {.key = "initial", .kind = &kt_kind_number, AT(initial)},
    {.key = "activation", .kind = &kt_kind_activation, AT(activation), .flags = KT_FIELD_REQUIRED},
};
static const kt_table activated_table = {
    .fields = activated_fields, .count = KT_COUNT_OF(activated_fields), .flow = true};

/* All names, before any rate is read; the first of them is state k. */
static bool read_state_names(kt_reader *r, const kt_scope *scope, kt_node *map, kt_auxiliary_state *states, size_t k) {
    bool good = true;
    for (kt_node *key = map->of.first; key != NULL; key = key->next->next, k++) {
        states[k] = kt_auxiliary_state_default();
        r->scene->state_nodes[k] = key->next;
        if (key->kind != KT_NODE_TEXT) {
            good = kt_fault_expected(r, scope, key, "the name of a state");
            continue;
        }
        states[k].name = kt_pool_text(&r->keep, key->of.text, key->count);
        if (states[k].name == NULL)
            good = kt_reader_out_of_memory(r);
        else if (kt_is_named(r, states[k].name))
            (void)kt_fault_at(r, KT_ERROR_SCENE, scope, key,
                              "'%.40s' is one of `expressions`; take another name for the state", states[k].name);
        else if (kt_is_parameter(r, states[k].name))
            (void)kt_fault_at(r, KT_ERROR_SCENE, scope, key, "'%.40s' is a parameter; take another name for the state",
                              states[k].name);
    }
    return good;
}

/* All names are read before the first rate, because rates may name later states. */
static bool read_states(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_field *field, void *object) {
    (void)field;
    kt_scene *scene = object;
    if (node->kind != KT_NODE_MAP) {
        r->scene->names_are_known = false;
        return kt_fault_expected(r, scope, node, "names and rates of states ('current: {rate: ...}')");
    }
    /* After the states of parameters that events set (assignment.h). */
    const size_t before = (size_t)scene->description.state_count, count = before + node->count;
    kt_auxiliary_state *states = kt_pool_take(&r->keep, count + 1, sizeof *states);
    kt_node **nodes = kt_pool_take(&r->scratch, count + 1, sizeof(kt_node *));
    if (states == NULL || nodes == NULL)
        return kt_reader_out_of_memory(r);
    kt_copy(states, scene->description.states, before * sizeof *states);
    kt_copy(nodes, r->scene->state_nodes, before * sizeof *nodes);
    r->scene->state_nodes = nodes;
    r->scene->names_are_known = read_state_names(r, scope, node, states, before) && r->scene->names_are_known;
    scene->description.states = states;
    scene->description.state_count = (int)count;
    r->scene->description = &scene->description; /* also of a scene without bodies */
    for (int k = (int)before; k < scene->description.state_count; k++) {
        const kt_scope here = {.outer = scope, .key = states[k].name, .index = k - (int)before};
        kt_node *one = r->scene->state_nodes[k];
        const bool is_activation = one->kind == KT_NODE_MAP && kt_node_find(one, "activation") != NULL;
        (void)kt_table_read(r, &here, one, is_activation ? &activated_table : &state_table, &states[k]);
    }
    return !kt_node_is_faulty(node);
}

static void write_state_list(kt_emitter *e, const kt_member *m) {
    const kt_description *d = &((const kt_scene *)m->object)->description;
    const kt_auxiliary_state rest = kt_auxiliary_state_default();
    kt_emit_map(e, KT_EMIT_BLOCK);
    for (int k = 0; k < d->state_count; k++) {
        if (kt_scene_is_place_state(m->object, d->states[k].name))
            continue; /* of an event, which makes it again */
        kt_emit_key(e, d->states[k].name);
        if (d->states[k].activation != NULL)
            kt_table_write(e, &activated_table, &d->states[k], &rest);
        else if (d->states[k].rate == NULL)
            kt_emit_reject(e, KT_ERROR_UNSUPPORTED,
                           "the rate of state '%.60s' is a program's; no scene file can hold it", d->states[k].name);
        else
            kt_table_write(e, &state_table, &d->states[k], &rest);
    }
    kt_emit_end(e);
}

static bool same_states(const kt_member *m) {
    const kt_description *d = &((const kt_scene *)m->object)->description;
    bool none = true;
    for (int k = 0; k < d->state_count; k++)
        none = none && kt_scene_is_place_state(m->object, d->states[k].name);
    return none;
}

const kt_kind kt_kind_states = {.read = read_states, .write = write_state_list, .same = same_states};
