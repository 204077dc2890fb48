/* Tendons, equalities and actuators that refer to copies by a <replicate>.
 *
 * An item may refer to bodies, joints and sites in the <replicate> alone. Then each copy has an item of its own, whose
 * name and references have the suffix of the copy. The copies stand behind all other items, as in MuJoCo. An item that
 * also refers to something else stays, and is incomplete (mjcf_attach.c): MuJoCo rejects it, or leaves it out. */
#include "robot/mjcf_copies.h"
#include "robot/mjcf_make.h"

#include <math.h>
#include <stdio.h>
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
    const bool is_actuator = root->document == 0 && strcmp(kind, "actuator") == 0;
    int place = 0;
    for (kt_element *s = root->first; s != NULL; s = s->next) {
        kt_element *before = NULL;
        for (kt_element *e = strcmp(s->name, kind) == 0 ? s->first : NULL, *next; e != NULL; e = next, place++) {
            const char *name = kt_xml_attribute(e, "name");
            int copied = 0, others = 0;
            next = e->next;
            count_references(names, e, &copied, &others);
            if (copied == 0 || others > 0) {
                before = e;
                continue;
            }
            kt_element **item = kt_list_add(m->r, &m->r->scratch, items, sizeof(kt_element *));
            int *moved = is_actuator ? kt_list_add(m->r, &m->r->scratch, &m->moved_actuators, sizeof *moved) : &place;
            if (item == NULL || moved == NULL)
                return;
            *item = e;
            *moved = place;
            if (name != NULL && strcmp(kind, "tendon") == 0)
                (void)kt_names_add(names, KT_MJCF_TENDONS, name, 0);
            (void)kt_mjcf_splice(s, before, e, NULL);
        }
    }
}

static void take_copied_items(kt_mjcf *m, int document, const kt_element *of, kt_list *items) {
    kt_element *root = kt_mjcf_document_at(m, document)->root;
    size_t count = count_elements(of);
    kt_names names;
    *items = (kt_list){.items = NULL};
    for (const kt_element *s = kt_xml_child(root, "tendon"); s != NULL; s = kt_xml_next(s, "tendon"))
        count += count_elements(s);
    if (!kt_robot_names(m->r, &names, count))
        return;
    name_copies(&names, of);
    for (size_t i = 0; i < sizeof section_names / sizeof *section_names; i++)
        take_items(m, root, section_names[i], &names, items);
}

/* ---- copies ------------------------------------------------------------------------------------------------------ */

/* Gives the copy of an element its name, with a suffix; in an item, also its references. False after reporting. */
static bool rename_copy(kt_mjcf *m, kt_element *e, const char *suffix, bool is_item) {
    const char **own = kt_element_own(m->r, e);
    for (size_t i = 0; own != NULL && own[i] != NULL; i += 2) {
        const char *value = own[i + 1];
        if (strcmp(own[i], "name") != 0 && !(is_item && kt_mjcf_reference(own[i]) >= 0))
            continue;
        const char **base = is_item ? &value : kt_list_add(m->r, &m->r->scratch, &m->copied, sizeof *base);
        const char *whole = kt_mjcf_join(m, e, value, suffix);
        if (base == NULL || whole == NULL)
            return false;
        *base = value;
        own[i + 1] = whole;
    }
    return own != NULL;
}

/* Copies an element and those within, below another one. False after reporting, or if there are too many elements. */
static bool copy_element(kt_mjcf *m, const kt_element *e, kt_element *to, const char *suffix, bool is_item) {
    kt_element *copy = ++m->elements <= KT_MJCF_ELEMENTS_MOST ? kt_element_at(m->r, e, e->name, e->attributes) : NULL;
    if (copy == NULL || !rename_copy(m, copy, suffix, is_item))
        return false;
    kt_element_hang(to, copy);
    for (const kt_element *child = e->first; child != NULL; child = child->next)
        if (!copy_element(m, child, copy, suffix, is_item))
            return false;
    return true;
}

static bool copy_items(kt_mjcf *m, int document, const kt_list *items, const char *suffix) {
    kt_element *root = kt_mjcf_document_at(m, document)->root, *section = NULL;
    for (int i = 0; i < items->count; i++) {
        const kt_element *e = ((kt_element *const *)items->items)[i];
        if (section == NULL || strcmp(section->name, e->parent->name) != 0)
            section = kt_mjcf_add_element(m, root, e, e->parent->name, kt_no_attributes, NULL);
        if (section == NULL || !copy_element(m, e, section, suffix, true))
            return false;
    }
    return true;
}

bool kt_mjcf_has_copies(const kt_mjcf *m, const char *name) {
    bool found = false;
    for (int i = 0; i < m->copied.count && !found; i++)
        found = strcmp(((const char *const *)m->copied.items)[i], name) == 0;
    return found;
}

/* ---- replicate --------------------------------------------------------------------------------------------------- */

/* Copies the children of an element; false if there is no memory, or there are too many elements. */
static bool copy_children(kt_mjcf *m, const kt_element *from, kt_element *to, const char *suffix) {
    for (const kt_element *e = from->first; e != NULL; e = e->next)
        if (!copy_element(m, e, to, suffix, false))
            return false;
    return true;
}

/* A <frame> with the pose of a copy. */
static kt_element *make_copy_frame(kt_mjcf *m, const kt_element *e, kt_pose pose) {
    const kt_quat q = kt_quat_from_matrix(pose.rotation);
    const kt_vec3 p = pose.position;
    const char *childclass = kt_xml_attribute(e, "childclass");
    const char *place = kt_mjcf_write_numbers(m, 3, (const double[]){p.x, p.y, p.z});
    const char *turned = kt_mjcf_write_numbers(m, 4, (const double[]){q.w, q.x, q.y, q.z});
    const char *const attributes[] = {"pos",      place, "quat", turned, childclass != NULL ? "childclass" : NULL,
                                      childclass, NULL};
    kt_element *frame = place != NULL && turned != NULL ? kt_element_at(m->r, e, "frame", attributes) : NULL;
    return frame != NULL && kt_element_own(m->r, frame) != NULL ? frame : NULL;
}

int kt_mjcf_copy_of(const kt_mjcf *m, const kt_element *e, int near) {
    const kt_mjcf_copy *copies = m->copies.items;
    for (; e != NULL; e = e->parent)
        for (int i = near < 0 ? 0 : near; i <= near + 1 && i < m->copies.count; i++)
            if (copies[i].frame == e)
                return i;
    return -1;
}

/* Keeps the copy of a <replicate> of the model itself that is in no other one. */
static void keep_copy(kt_mjcf *m, int document, const kt_element *e, const kt_element *frame, const char *suffix) {
    for (const kt_element *up = e->parent; up != NULL; up = up->parent)
        if (strcmp(up->name, "replicate") == 0)
            return;
    kt_mjcf_copy *copy = document == 0 ? kt_list_add(m->r, &m->r->scratch, &m->copies, sizeof *copy) : NULL;
    if (copy == NULL)
        return;
    copy->frame = frame;
    (void)snprintf(copy->suffix, sizeof copy->suffix, "%s", suffix);
}

/* The copies. The angles of copy k are those of `euler` times k. Each is displaced by `offset` from the one before,
 * along the axes of that one. */
static void replicate(kt_mjcf *m, int document, const kt_element *e, kt_element *copies) {
    const double count = kt_mjcf_number(m, e, NULL, "count", 0.0);
    const char *separator = kt_xml_attribute(e, "sep");
    const kt_vec3 offset = kt_mjcf_vector(m, e, NULL, "offset", kt_vec3_make(0.0, 0.0, 0.0));
    kt_pose at = kt_pose_identity();
    double euler[3] = {0.0, 0.0, 0.0};
    (void)kt_mjcf_numbers(m, e, NULL, "euler", 3, 3, euler);
    *copies = (kt_element){.name = "frame", .attributes = kt_no_attributes};
    if (kt_draft_is_wrong(&m->draft))
        return;
    if (!(count >= 1.0 && count <= KT_MJCF_ELEMENTS_MOST && count == floor(count))) {
        (void)kt_mjcf_fault(m, e, "count: expected a whole number from 1 to %d", (int)KT_MJCF_ELEMENTS_MOST);
        return;
    }
    kt_list items;
    take_copied_items(m, document, e, &items);
    int digits = 1;
    for (int power = 10; power <= (int)count; power *= 10)
        digits++;
    for (int k = 0; k < (int)count && !m->r->out_of_memory; k++) {
        char suffix[80];
        kt_element *frame = make_copy_frame(m, e, at);
        (void)snprintf(suffix, sizeof suffix, "%.40s%0*d", separator != NULL ? separator : "", digits < 8 ? digits : 8,
                       k);
        if (frame == NULL)
            return;
        if (++m->elements > KT_MJCF_ELEMENTS_MOST || !copy_children(m, e, frame, suffix) ||
            !copy_items(m, document, &items, suffix)) {
            if (!kt_draft_is_wrong(&m->draft))
                (void)kt_mjcf_fault(m, e, "copies make more than %d elements of the model", (int)KT_MJCF_ELEMENTS_MOST);
            return;
        }
        kt_element_hang(copies, frame);
        keep_copy(m, document, e, frame, suffix);
        at.position = kt_pose_apply(at, offset);
        at.rotation = kt_mjcf_rotation_of_euler(
            kt_mjcf_settings_of(m, e), (const double[]){(k + 1) * euler[0], (k + 1) * euler[1], (k + 1) * euler[2]});
    }
}

/* From the inside out, since copies have copies. */
static void expand_replicates(kt_mjcf *m, int document, kt_element *parent) {
    kt_element *before = NULL;
    for (kt_element *e = parent->first; e != NULL && !kt_draft_is_wrong(&m->draft);) {
        expand_replicates(m, document, e);
        if (strcmp(e->name, "replicate") == 0) {
            kt_element copies, *next = e->next;
            m->replicate_count += document == 0;
            replicate(m, document, e, &copies);
            (void)kt_mjcf_splice(parent, before, e, &copies);
            before = copies.last != NULL ? copies.last : before;
            e = next;
            continue;
        }
        before = e;
        e = e->next;
    }
}

void kt_mjcf_replicate(kt_mjcf *m, int document) {
    expand_replicates(m, document, kt_mjcf_document_at(m, document)->root);
}
