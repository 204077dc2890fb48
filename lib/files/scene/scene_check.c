/* The faults that kt_description_check finds, reported at their positions in the file.
 *
 * A fault comes with the item and the key that it is about. The key is looked up in the item's node, so that nothing is
 * stored for the many keys that are right. A fault that follows from a reported fault of form is left out: a mass that
 * could not be read is not zero.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scene/scene_part.h"

#include <stdlib.h>
#include <string.h>

typedef struct kt_checking {
    kt_reader *reader;
    const kt_description *description;
    /* The place of the last fault within a list or mapping: faults come in the order of its items. */
    const kt_node *list;
    kt_node *found;
    int sub;
    const kt_node *item; /* the last one that was checked for faults of form, and the result */
    bool is_item_faulty;
} kt_checking;

/* The key of a loop or effect that a fault is about; NULL if it is another item, or a key of every type. */
static const kt_key *fault_key_of(const kt_checking *c, const kt_place *place) {
    const kt_descriptor *descriptor = NULL;
    if (place->item == KT_ITEM_LOOP)
        descriptor = kt_loop_descriptor(c->description->loops[place->index].type);
    if (place->item == KT_ITEM_EFFECT)
        descriptor = kt_effect_descriptor(c->description->effects[place->index].type);
    return descriptor == NULL ? NULL : kt_descriptor_key(descriptor, place->field);
}

static kt_node *item_node(const kt_reader *r, const kt_place *place) {
    switch (place->item) {
    case KT_ITEM_BODY:
        return r->scene->body_nodes[place->index];
    case KT_ITEM_LOOP:
        return r->scene->loop_nodes[place->index];
    case KT_ITEM_EFFECT:
        return r->scene->effect_nodes[place->index];
    case KT_ITEM_HOLD:
        return r->scene->hold_nodes[place->index];
    case KT_ITEM_STATE:
        return r->scene->state_nodes[place->index];
    case KT_ITEM_SCENE:
        break;
    }
    return r->root;
}

/* The item `sub` of a list, or the key of a mapping's pair. O(1) a fault, on average. */
static kt_node *child(kt_checking *c, kt_node *node, int sub) {
    if (node->kind == KT_NODE_TEXT || sub < 0 || (uint32_t)sub >= node->count)
        return node;
    if (node != c->list || sub < c->sub) {
        c->list = node;
        c->found = node->of.first;
        c->sub = 0;
    }
    for (; c->sub < sub; c->sub++)
        c->found = node->kind == KT_NODE_MAP ? c->found->next->next : c->found->next;
    return c->found;
}

/* Follows a path such as "joint.axis" from the item as far as the file contains it. The parameter `also` is another
 * spelling of the last word, or NULL. */
static kt_node *follow_field(kt_checking *c, kt_node *node, const char *field, const char *also, int sub) {
    while (*field != '\0') {
        size_t length = strcspn(field, ".");
        char key[32];
        if (length >= sizeof key)
            return node;
        memcpy(key, field, length);
        key[length] = '\0';
        kt_node *next = kt_node_find(node, key);
        if (next == NULL && also != NULL)
            next = kt_node_find(node, also);
        if (next == NULL)
            return node;
        node = next;
        field += length + (field[length] == '.');
    }
    return child(c, node, sub);
}

enum { LONGEST_NAME = 255 };

/* Whether the value of a field names a body. */
static bool is_reference(const kt_place *place, const kt_key *key) {
    if (key == NULL)
        return place->item == KT_ITEM_HOLD || (place->item == KT_ITEM_BODY && strcmp(place->field, "parent") == 0);
    return key->kind == KT_KEY_END || key->kind == KT_KEY_ENDS || key->kind == KT_KEY_BODY ||
           key->kind == KT_KEY_JOINT || key->kind == KT_KEY_TERMS || key->kind == KT_KEY_PATH;
}

/* The object that the value of a field refers to. */
typedef struct referred {
    bool is_named;     /* else there is no name */
    int body;          /* -1: there is none of this name */
    bool lacks_marker; /* the body has no marker of this name */
    bool is_misspelt;  /* there is none, and the name resembles another one */
} referred;

/* Whether a name that no body has resembles the name of a body that is no second one. It is then misspelt. Otherwise
 * one of two bodies of one name may have been meant to have it. */
static bool is_misspelt(const kt_reader *r, const char *name) {
    const kt_description *d = r->scene->description;
    kt_nearest nearest = kt_nearest_make(name, NULL);
    const char *doubled = NULL;
    for (int others = 0; others < 2; others++) {
        for (int i = 0; i < d->body_count; i++)
            if (d->bodies[i].name != NULL && (kt_find_body(r, d->bodies[i].name) == i) == (others == 1))
                (void)kt_nearest_try(&nearest, d->bodies[i].name);
        doubled = others == 0 ? nearest.best : doubled;
    }
    return nearest.best != NULL && nearest.best != doubled;
}

static referred find_referred(const kt_reader *r, const kt_place *place, const kt_key *key, const kt_node *node) {
    char name[LONGEST_NAME + 1];
    const kt_node *text = node->kind == KT_NODE_MAP ? kt_node_find(node, "body") : node;
    if (text == NULL || text->kind != KT_NODE_TEXT)
        return (referred){.body = -1};
    const size_t length = strcspn(text->of.text, ".[");
    if (length > LONGEST_NAME)
        return (referred){.body = -1};
    memcpy(name, text->of.text, length);
    name[length] = '\0';
    const bool is_joint =
        key == NULL ? place->item == KT_ITEM_HOLD : key->kind == KT_KEY_JOINT || key->kind == KT_KEY_TERMS;
    const int joint = is_joint ? kt_find_joint(r, name) : -1, own = kt_find_body(r, name);
    const int body = joint >= 0 || (is_joint && (own < 0 || !kt_body_is_hidden(r, own))) ? joint : own;
    const bool has_marker = !is_joint && body >= 0 && text->of.text[length] == '.';
    return (referred){.is_named = true,
                      .body = body,
                      .is_misspelt = body < 0 && r->scene->names_are_doubled && is_misspelt(r, name),
                      .lacks_marker = has_marker && kt_find_marker(r, body, text->of.text + length + 1) < 0};
}

/* Whether a field names a body of which too little could be read to decide that the name is wrong. */
static bool refers_to_hidden(const kt_reader *r, const kt_place *place, const kt_key *key, const kt_node *node) {
    if (!is_reference(place, key))
        return false;
    const referred to = find_referred(r, place, key, node);
    if (to.body >= 0)
        return kt_body_is_hidden(r, to.body);
    return !r->scene->names_are_known || (r->scene->names_are_doubled && !to.is_misspelt);
}

/* Whether an item has faults of form; these do not change while the description is checked. Cost: O(item) for the first
 * fault of each. */
static bool is_item_faulty(kt_checking *c, const kt_node *item) {
    if (c->item != item)
        c->is_item_faulty = kt_node_is_faulty(item);
    c->item = item;
    return c->is_item_faulty;
}

/* Whether a fault is about an end that is right by itself, while the item could not be read otherwise, such as the
 * other end. */
static bool leans_on_other_end(kt_checking *c, const kt_place *place, const kt_key *key, const kt_node *item,
                               const kt_node *node) {
    if (key == NULL || !is_reference(place, key) || !is_item_faulty(c, item))
        return false;
    const referred to = find_referred(c->reader, place, key, node);
    const kt_node *body = node->kind == KT_NODE_MAP ? kt_node_find(node, "body") : node;
    const bool is_ground = body == NULL || (body->kind == KT_NODE_TEXT && strcmp(body->of.text, "world") == 0);
    return is_ground || (to.is_named && to.body >= 0 && !to.lacks_marker);
}

static bool is_faulty_at(const kt_node *map, const char *const *keys) {
    for (; *keys != NULL; keys++)
        if (kt_node_is_faulty(kt_node_find(map, *keys)))
            return true;
    return false;
}

/* Whether a key of a mapping in the item has a fault of form. */
static bool is_faulty_in(const kt_node *item, const char *map, const char *key) {
    const kt_node *in = kt_node_find(item, map);
    return in != NULL && in->kind == KT_NODE_MAP && kt_node_is_faulty(kt_node_find(in, key));
}

/* Whether a mapping in the item has a wrong key. */
static bool has_stray_in(const kt_node *item, const char *map) {
    const kt_node *in = kt_node_find(item, map);
    return in != NULL && kt_node_has_stray(in);
}

/* Whether the keys of a loop or effect were read at all. */
static bool has_type(const kt_node *item) {
    const kt_node *type = kt_node_find(item, "type");
    return type != NULL && !kt_node_is_faulty(type);
}

/* Whether the fault compares its key with another one that could not be read. */
static bool leans_on_faulty(const kt_place *place, const kt_node *item) {
    static const char *const pairs[][3] = {{"joint.axis2", "joint", "axis"}, {"shape.to", "shape", "from"}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
        if (strcmp(place->field, pairs[i][0]) == 0 &&
            (is_faulty_in(item, pairs[i][1], pairs[i][2]) || has_stray_in(item, pairs[i][1])))
            return true;
    return false;
}

/* Whether the fault is, or may come from, one of form. A key that is present and can be read is itself at fault; one
 * that is absent may be present but misspelt. */
static bool fault_is_known(kt_checking *c, const kt_place *place, const kt_key *key, const kt_node *item,
                           const kt_node *node) {
    const kt_reader *r = c->reader;
    static const char *const mass[] = {"mass", "com", "inertia", "shape", NULL}, *const joint[] = {"joint", NULL};
    size_t length = strcspn(place->field, ".");
    if (node->faulty || refers_to_hidden(r, place, key, node) || leans_on_faulty(place, item))
        return true;
    if (leans_on_other_end(c, place, key, item, node) || (node == item && kt_node_has_stray(item)))
        return true;
    if ((place->item == KT_ITEM_LOOP || place->item == KT_ITEM_EFFECT) && !has_type(item) &&
        strcmp(place->field, "name") != 0)
        return true;
    if (place->item == KT_ITEM_BODY && strcmp(place->field, "mass") == 0 &&
        kt_node_is_faulty(kt_node_find(item, "inertia"))) /* functions of both are read together */
        return true;
    if (place->item != KT_ITEM_BODY || node != item)
        return kt_node_is_faulty(node);
    if (length == 5 && strncmp(place->field, "joint", length) == 0)
        return is_faulty_at(item, joint);
    for (int i = 0; mass[i] != NULL; i++)
        if (strlen(mass[i]) == length && strncmp(place->field, mass[i], length) == 0)
            return is_faulty_at(item, mass);
    return kt_node_is_faulty(node);
}

static void take_description_fault(void *user, const kt_place *place, const kt_error *error) {
    kt_checking *c = user;
    kt_reader *r = c->reader;
    const kt_key *key = fault_key_of(c, place);
    const kt_node *item = item_node(r, place);
    const kt_node *node =
        follow_field(c, item_node(r, place), place->field, key != NULL ? key->also : NULL, place->sub);
    if (fault_is_known(c, place, key, item, node))
        return;
    kt_phrase where = {.length = 0};
    if (place->item == KT_ITEM_HOLD)
        kt_phrase_add(&where, "initial.hold[%d]: ", place->index);
    else if (place->item != KT_ITEM_SCENE)
        kt_phrase_add(&where, "%s: ", error->where);
    const char *message = error->message;
    const size_t length = key != NULL ? strlen(key->name) : 0;
    if (key != NULL && key->also != NULL && strncmp(message, key->name, length) == 0 &&
        kt_node_find(item, key->name) == NULL && kt_node_find(item, key->also) != NULL) {
        kt_phrase_add(&where, "%s", key->also); /* the file has the other spelling */
        message += length;
    }
    (void)kt_fault_put(r, error->code, node->line, node->column, "%s%s", where.text, message);
}

/* Whether the file defines the tree and its loops completely: a misspelt key may have defined more of them. */
static bool is_tree_known(const kt_reader *r) {
    for (const kt_node *node = r->root->of.first; node != NULL; node = node->next)
        if (node->faulty)
            return false;
    return kt_names_are_known(r) && !kt_node_is_faulty(kt_node_find(r->root, "bodies")) &&
           !kt_node_is_faulty(kt_node_find(r->root, "joints")) && !kt_node_is_faulty(kt_node_find(r->root, "loops"));
}

/* Whether a node is a list of three zeros. */
static bool is_zero_vector(const kt_node *node) {
    if (node == NULL || node->kind != KT_NODE_LIST || node->count != 3)
        return false;
    for (const kt_node *item = node->of.first; item != NULL; item = item->next) {
        char *end = NULL;
        if (item->kind != KT_NODE_TEXT || strtod(item->of.text, &end) != 0.0 || end == item->of.text || *end != '\0')
            return false;
    }
    return true;
}

/* The keys of a joint of unknown type are not read. No type has an axis of zeros. */
static void check_axes_of_unknown_types(kt_reader *r, const kt_description *d) {
    for (int i = 0; i < d->body_count; i++) {
        const kt_node *joint = kt_node_find(r->scene->body_nodes[i], "joint");
        const kt_node *axis = joint != NULL && joint->kind == KT_NODE_MAP ? kt_node_find(joint, "axis") : NULL;
        const char *name = d->bodies[i].name;
        if (is_zero_vector(axis) && !has_type(joint))
            (void)kt_fault_put(r, KT_ERROR_MODEL, axis->line, axis->column,
                               "body %s: joint.axis is zero; give it a direction, such as [0, 0, 1]",
                               name != NULL ? kt_name_quote(name).text : "without a name");
    }
}

/* Faults that only the whole mechanism shows are reported by its compilation. If other faults prevent the compilation,
 * they are searched for here, as long as there is room for more faults. The search takes the memory of a compilation.
 * */
void kt_check_description(kt_reader *r, const kt_description *description) {
    kt_checking c = {.reader = r, .description = description};
    kt_error error;
    check_axes_of_unknown_types(r, description);
    if (kt_description_check(description, take_description_fault, &c, &error) == KT_ERROR_MEMORY)
        (void)kt_reader_out_of_memory(r);
    else if (r->fault_count > 0 && r->fault_count < KT_FAULT_COUNT_MAX && is_tree_known(r)) {
        const kt_status status = kt_model_check(description, take_description_fault, &c, &error);
        (void)status; /* its faults have been reported one by one; without memory there are none to report */
    }
}
