/* Tendons, equalities and actuators that refer to copies by a <replicate>.
 *
 * If all that such an item refers to is in the <replicate>, each copy has an item of its own, with the suffix of the
 * copy at its name and references. The copies stand behind all other items, as in MuJoCo. An item that also refers to
 * something else stays, and is incomplete (mjcf_attach.c): MuJoCo rejects it, or leaves it out. */
#include "robot/mjcf_make.h"

#include <string.h>

int kt_mjcf_reference(const char *attribute) {
    static const struct {
        const char *attribute;
        int scope;
    } references[] = {{"body", KT_MJCF_BODIES},          {"body1", KT_MJCF_BODIES},    {"body2", KT_MJCF_BODIES},
                      {"joint", KT_MJCF_JOINTS},         {"joint1", KT_MJCF_JOINTS},   {"joint2", KT_MJCF_JOINTS},
                      {"jointinparent", KT_MJCF_JOINTS}, {"site", KT_MJCF_SITES},      {"sidesite", KT_MJCF_SITES},
                      {"geom", KT_MJCF_WRAPS},           {"site1", KT_MJCF_SITES},     {"site2", KT_MJCF_SITES},
                      {"refsite", KT_MJCF_SITES},        {"cranksite", KT_MJCF_SITES}, {"slidersite", KT_MJCF_SITES},
                      {"tendon", KT_MJCF_TENDONS},       {"tendon1", KT_MJCF_TENDONS}, {"tendon2", KT_MJCF_TENDONS}};
    for (size_t i = 0; i < sizeof references / sizeof *references; i++)
        if (strcmp(references[i].attribute, attribute) == 0)
            return references[i].scope;
    return -1;
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* The scope of an element with a name; -1: nothing refers to it. */
static int scope_of_copy(const kt_element *e) {
    return strcmp(e->name, "body") == 0                                         ? KT_MJCF_BODIES
           : strcmp(e->name, "joint") == 0 || strcmp(e->name, "freejoint") == 0 ? KT_MJCF_JOINTS
           : strcmp(e->name, "site") == 0                                       ? KT_MJCF_SITES
           : strcmp(e->name, "geom") == 0                                       ? KT_MJCF_WRAPS
                                                                                : -1;
}

static size_t count_elements(const kt_element *e) {
    size_t count = 1;
    for (const kt_element *child = e->first; child != NULL; child = child->next)
        count += count_elements(child);
    return count;
}

static void name_copies(kt_names *names, const kt_element *e) {
    for (const kt_element *child = e->first; child != NULL; child = child->next) {
        const char *name = kt_xml_attribute(child, "name");
        const int scope = scope_of_copy(child);
        if (name != NULL && scope >= 0)
            (void)kt_names_add(names, scope, name, 0);
        name_copies(names, child);
    }
}

/* Counts references of an element, and of those within, to what is copied and to all else. */
static void count_references(const kt_names *names, const kt_element *e, int *copied, int *others) {
    for (size_t i = 0; e->attributes[i] != NULL; i += 2) {
        const int scope = kt_mjcf_reference(e->attributes[i]);
        if (scope >= 0)
            ++*(kt_names_find(names, scope, e->attributes[i + 1]) >= 0 ? copied : others);
    }
    for (const kt_element *child = e->first; child != NULL; child = child->next)
        count_references(names, child, copied, others);
}

/* ---- items ------------------------------------------------------------------------------------------------------- */

static const char *const section_names[] = {"tendon", "equality", "actuator"};

/* Moves the items of one kind that all copies have to the list. Their tendons are copied, too. */
static void take_items(kt_mjcf *m, kt_element *root, const char *kind, kt_names *names, kt_list *items) {
    for (kt_element *s = root->first; s != NULL; s = s->next) {
        kt_element *before = NULL;
        for (kt_element *e = strcmp(s->name, kind) == 0 ? s->first : NULL, *next; e != NULL; e = next) {
            const char *name = kt_xml_attribute(e, "name");
            int copied = 0, others = 0;
            next = e->next;
            count_references(names, e, &copied, &others);
            if (copied == 0 || others > 0) {
                before = e;
                continue;
            }
            kt_element **item = kt_list_add(m->r, &m->r->scratch, items, sizeof(kt_element *));
            if (item == NULL)
                return;
            *item = e;
            if (name != NULL && strcmp(kind, "tendon") == 0)
                (void)kt_names_add(names, KT_MJCF_TENDONS, name, 0);
            (void)kt_mjcf_splice(s, before, e, NULL);
        }
    }
}

void kt_mjcf_take_copied_items(kt_mjcf *m, int document, const kt_element *of, kt_list *items) {
    kt_element *root = kt_mjcf_document_at(m, document)->root;
    size_t count = count_elements(of);
    kt_names names;
    *items = (kt_list){.items = NULL};
    for (const kt_element *s = kt_xml_child(root, "tendon"); s != NULL; s = kt_xml_next(s, "tendon"))
        count += count_elements(s);
    void *memory = kt_pool_take(&m->r->scratch, 1, kt_names_size(count));
    if (memory == NULL) {
        (void)kt_reader_out_of_memory(m->r);
        return;
    }
    kt_names_init(&names, count, memory);
    name_copies(&names, of);
    for (size_t i = 0; i < sizeof section_names / sizeof *section_names; i++)
        take_items(m, root, section_names[i], &names, items);
}

/* ---- copies ------------------------------------------------------------------------------------------------------ */

/* Adds a suffix to the name and the references of an element and of those within. False after reporting. */
static bool rename_copy(kt_mjcf *m, kt_element *e, const char *suffix) {
    size_t count = 0;
    while (e->attributes[count] != NULL)
        count++;
    const char **attributes = kt_pool_take(&m->r->scratch, count + 1, sizeof *attributes);
    if (attributes == NULL)
        return kt_reader_out_of_memory(m->r);
    for (size_t i = 0; i < count; i += 2) {
        const bool is_name = strcmp(e->attributes[i], "name") == 0 || kt_mjcf_reference(e->attributes[i]) >= 0;
        attributes[i] = e->attributes[i];
        attributes[i + 1] = is_name ? kt_mjcf_join(m, e, e->attributes[i + 1], suffix) : e->attributes[i + 1];
        if (attributes[i + 1] == NULL)
            return false;
    }
    e->attributes = attributes;
    for (kt_element *child = e->first; child != NULL; child = child->next)
        if (!rename_copy(m, child, suffix))
            return false;
    return true;
}

/* Copies an element and those within, below another one. NULL if there is no memory, or there are too many elements. */
static kt_element *copy_item(kt_mjcf *m, const kt_element *e, kt_element *to) {
    kt_element *copy = ++m->elements <= KT_MJCF_ELEMENTS_MOST ? kt_pool_take(&m->r->scratch, 1, sizeof *copy) : NULL;
    if (copy == NULL) {
        if (m->elements <= KT_MJCF_ELEMENTS_MOST)
            (void)kt_reader_out_of_memory(m->r);
        return NULL;
    }
    *copy = *e;
    copy->first = copy->last = copy->next = NULL;
    kt_mjcf_hang_below(to, copy);
    for (const kt_element *child = e->first; child != NULL; child = child->next)
        if (copy_item(m, child, copy) == NULL)
            return NULL;
    return copy;
}

bool kt_mjcf_copy_items(kt_mjcf *m, int document, const kt_list *items, const char *suffix) {
    static const char *const none[] = {NULL};
    kt_element *root = kt_mjcf_document_at(m, document)->root, *section = NULL;
    for (int i = 0; i < items->count; i++) {
        const kt_element *e = ((kt_element *const *)items->items)[i];
        if (section == NULL || strcmp(section->name, e->parent->name) != 0)
            section = kt_mjcf_add_element(m, root, e, e->parent->name, none, NULL);
        kt_element *copy = section != NULL ? copy_item(m, e, section) : NULL;
        if (copy == NULL || !rename_copy(m, copy, suffix))
            return false;
    }
    return true;
}
