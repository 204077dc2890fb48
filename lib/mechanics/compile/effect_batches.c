/* Attaches effects to a tree: batches of effects of one type, which are evaluated together, and the links that carry
 * their ends.
 *
 * Effects on joints come first, then effects with one end, then effects with two ends. Within these sets, types are in
 * the order of their list, with the caller's own effects last. Effects of one type are in the description's order.
 * Effects on joints need no motion of links. The other effects need the motion of the links with their ends, and of all
 * links from these towards the ground.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compile/attach.h"
#include "effect/effect.h"
#include "effect/path.h"

#include <string.h>

/* The key by which batches are sorted. */
static int batch_key_of(int type, int ends) {
    return ends * (KT_EFFECT_TYPE_COUNT + 1) + (type == KT_EFFECT_CUSTOM ? KT_EFFECT_TYPE_COUNT : type);
}

enum { KEYS = 3 * (KT_EFFECT_TYPE_COUNT + 1) };

static bool link_turns(const kt_link *link) { return kt_motion_facts_of(link->motion).angles > 0; }

/* Marks the links from that of a body, on which an effect has an end, to the ground. */
static void mark(kt_attach *a, kt_counts *n, const char *body) {
    const kt_model *m = a->tree;
    int32_t link = m->body[kt_attach_body_named(m, body)].link;
    for (; link > 0 && a->force_link[link] == 0; link = m->link[link].parent) {
        a->force_link[link] = 1;
        n->force_link++;
        n->force_link_angle += link_turns(&m->link[link]);
    }
}

static bool is_carried_by(const kt_model *m, int32_t body, int32_t carrier) {
    while (body > carrier)
        body = m->body[body].parent;
    return body == carrier;
}

/* Marks the links of a body and of all bodies that it carries. */
static void mark_carried(kt_attach *a, kt_counts *n, const char *carrier) {
    const kt_model *m = a->tree;
    const int32_t index = kt_body_find(m, carrier);
    for (int32_t body = index; body < (int32_t)m->n.body; body++)
        if (is_carried_by(m, body, index))
            mark(a, n, m->text + m->body[body].name);
}

/* Marks the links of the markers among the variables, and the links whose gravity force is read. */
void kt_attach_mark_variables(kt_attach *a, kt_counts *n, const kt_formula_names *names) {
    for (int k = 0; k < names->count; k++) {
        const kt_variable *variable = &names->variable[k];
        const bool is_gravity = variable->type == KT_VARIABLE_GRAVITY;
        const char *body = variable->body >= 0 ? a->description->bodies[variable->body].name : NULL;
        if (!is_gravity && variable->type != KT_VARIABLE_MARKER && variable->type != KT_VARIABLE_MARKER_VELOCITY)
            continue;
        if (n->force_link == 0)
            n->force_link = 1; /* the ground */
        if (is_gravity)
            mark_carried(a, n, body);
        else
            mark(a, n, body);
    }
}

kt_status kt_attach_count_effects(kt_attach *a, kt_counts *n, kt_error *error) {
    bool known[KEYS] = {false};
    for (size_t i = 0; i < n->effect + n->effect_off; i++) {
        const kt_effect *effect = &a->description->effects[i];
        const int ends = kt_attach_end_count(a, effect), key = batch_key_of((int)effect->type, ends);
        n->text += effect->name ? strlen(effect->name) + 1 : 0;
        n->loaded += kt_effect_has_load(effect);
        n->term += kt_attach_count_turns(a, effect);
        if (kt_effect_has_path(effect))
            kt_attach_count_path(a->tree, effect, n);
        if (KT_IS_OFF(effect))
            continue;
        n->batch += !known[key];
        known[key] = true;
        if (ends > 0 && n->force_link == 0)
            n->force_link = 1; /* the ground */
        for (int k = 0; k < ends; k++)
            mark(a, n, kt_attach_end_body(a, effect, k));
        for (int k = 0; kt_effect_has_path(effect) && k < effect->path_count; k++)
            mark(a, n, effect->path[k].end.body);
        if (effect->type != KT_EFFECT_EXPRESSION)
            continue;
        kt_formula_names names;
        const kt_status status = kt_attach_count_formulas(a->description, effect, &names, n, error);
        if (status != KT_OK)
            return status;
        kt_attach_mark_variables(a, n, &names);
    }
    return KT_OK;
}

/* Lists the marked links in their order, parents before children; the marks become indices in this list. */
static void list_force_links(kt_attach *a, kt_model *m) {
    int32_t count = 1, angle = 0;
    if (m->n.force_link == 0)
        return;
    m->force_link[0] = (kt_force_link){.base = true};
    for (int32_t i = 1; i < (int32_t)m->n.link; i++) {
        const kt_link *link = &m->link[i];
        if (a->force_link[i] == 0)
            continue;
        kt_force_link *b = &m->force_link[count];
        *b = (kt_force_link){.link = i, .parent = a->force_link[link->parent]};
        b->base = m->force_link[b->parent].base && (b->parent == 0 || link->body == m->link[link->parent].body);
        if (link_turns(link)) {
            m->force_link_angle[angle] = link->q;
            m->force_link_angle_index[angle++] = link->angle;
        }
        a->force_link[i] = count++;
    }
}

/* Whether an effect of the description, and of a->effect, is switched off. */
static bool is_off(const kt_attach *a, size_t i) { return KT_IS_OFF(&a->description->effects[i]); }

void kt_attach_fill_effects(kt_attach *a, kt_model *m) {
    const size_t count = m->n.effect + m->n.effect_off;
    int32_t place = 0, batch = 0;
    list_force_links(a, m);
    for (size_t k = 0; k < m->n.variable; k++)
        m->variable[k].force_link = a->force_link[m->variable[k].link];
    for (size_t k = 0; k < m->n.path_link; k++)
        m->path_link[k].force_link = a->force_link[m->path_link[k].link];
    for (int key = 0; key < KEYS && place < (int32_t)m->n.effect; key++) {
        const int32_t first = place;
        for (size_t i = 0; i < count; i++) {
            const kt_effect_record *r = &a->effect[i];
            if (batch_key_of(r->type, r->ends) != key || is_off(a, i))
                continue;
            m->effect[place] = *r;
            for (int k = 0; k < r->ends; k++)
                m->effect[place].force_link[k] = a->force_link[r->link[k]];
            place++;
        }
        if (place > first)
            m->batch[batch++] = (kt_effect_batch){.kind = kt_effect_kind_of(m->effect[first].type),
                                                  .type = m->effect[first].type,
                                                  .ends = m->effect[first].ends,
                                                  .first = first,
                                                  .count = place - first};
    }
    for (size_t i = 0; i < count; i++)
        if (is_off(a, i))
            m->effect[place++] = a->effect[i];
}
