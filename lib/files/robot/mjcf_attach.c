/* Models that a model in MJCF attaches. Elements of <asset> name their files. An <attach> element is the place for one
 * of their bodies, or for all that is in their world.
 *
 * An attached model keeps its own settings and default classes. Its names get a prefix, and so do its references to
 * them. Its other items (tendons, equalities, actuators, keyframes) are attached if all that they refer to is attached.
 * Each attachment reads the file anew, and the sizes of all files are summed. No model may attach itself, directly or
 * through others. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <string.h>

static const char no_document[] = "the file is attached within itself; a model cannot be a part of itself";

bool kt_mjcf_is_within(const kt_mjcf *m, int document, int other) {
    while (document >= 0 && document != other)
        document = kt_mjcf_document_at(m, document)->parent;
    return document == other;
}

/* ---- files ------------------------------------------------------------------------------------------------------- */

static int add_document(kt_mjcf *m, kt_element *root, int parent, const char *path, const char *prefix) {
    kt_mjcf_document *d = kt_list_add(m->r, &m->r->scratch, &m->documents, sizeof *d);
    if (d == NULL)
        return -1;
    *d = (kt_mjcf_document){.root = root, .parent = parent, .path = path, .prefix = prefix, .main = -2};
    return m->documents.count - 1;
}

/* Whether a document, or a document that attaches it, comes from a file. */
static bool attaches_itself(const kt_mjcf *m, int document, const char *path) {
    while (document >= 0 && !kt_text_is(kt_mjcf_document_at(m, document)->path, path))
        document = kt_mjcf_document_at(m, document)->parent;
    return document >= 0;
}

/* Reads the file of a <model>; NULL after reporting. */
static kt_element *read_model(kt_mjcf *m, const kt_element *model, int document, const char **path) {
    const char *file = kt_xml_attribute(model, "file");
    if (file == NULL) {
        (void)kt_mjcf_fault(m, model, "the attribute 'file' is missing");
        return NULL;
    }
    *path = kt_mjcf_find_file(m, document, model, file);
    if (*path == NULL)
        return NULL;
    if (attaches_itself(m, document, *path)) {
        (void)kt_mjcf_fault(m, model, "%s", no_document);
        return NULL;
    }
    kt_element *root = kt_include_read(m->r, model, *path, &m->included_bytes);
    if (root == NULL || strcmp(root->name, "mujoco") == 0)
        return root;
    (void)kt_mjcf_fault(m, model, "%.200s begins with <%.40s>, not with <mujoco>", *path, root->name);
    return NULL;
}

/* The root of the model that an asset of a document names; an asset without a name has the name of its file's root.
 * NULL after reporting. */
static kt_element *find_model(kt_mjcf *m, const kt_element *e, int document, const char *name, const char **path) {
    const kt_element *root = kt_mjcf_document_at(m, document)->root;
    for (const kt_element *s = kt_xml_child(root, "asset"); s != NULL; s = kt_xml_next(s, "asset"))
        for (const kt_element *a = kt_xml_child(s, "model"); a != NULL; a = kt_xml_next(a, "model"))
            if (kt_text_is(kt_xml_attribute(a, "name"), name))
                return read_model(m, a, document, path);
    for (const kt_element *s = kt_xml_child(root, "asset"); s != NULL; s = kt_xml_next(s, "asset"))
        for (const kt_element *a = kt_xml_child(s, "model"); a != NULL; a = kt_xml_next(a, "model")) {
            kt_element *read = kt_xml_attribute(a, "name") == NULL ? read_model(m, a, document, path) : NULL;
            if (kt_draft_is_wrong(&m->draft))
                return NULL;
            if (read != NULL && kt_text_is(kt_xml_attribute(read, "model"), name))
                return read;
        }
    (void)kt_mjcf_fault(m, e, "there is no <model> %s in <asset>", kt_name_quote(name).text);
    return NULL;
}

/* ---- names ------------------------------------------------------------------------------------------------------- */

/* The scope of the names to which an attribute refers; -1: none. */
static int scope_of_reference(const char *attribute) {
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

/* Names of elements, and references to them. Classes need no prefix: each document has its own. */
static bool has_prefix(const char *attribute) {
    return scope_of_reference(attribute) >= 0 || kt_words_have(" name mesh hfield ", attribute);
}

/* Puts the prefix before all names and references in an element and in everything below it. */
static void rename_all(kt_mjcf *m, kt_element *e, const char *prefix) {
    const char **own = kt_element_own(m->r, e);
    for (size_t i = 0; own != NULL && own[i] != NULL; i += 2) {
        if (!has_prefix(own[i]) || *own[i + 1] == '\0')
            continue;
        const char *whole = kt_mjcf_join(m, e, prefix, own[i + 1]);
        if (whole == NULL)
            return;
        own[i + 1] = whole;
    }
    for (kt_element *child = e->first; child != NULL && !kt_draft_is_wrong(&m->draft); child = child->next)
        rename_all(m, child, prefix);
}

/* ---- joints of the whole model ----------------------------------------------------------------------------------- */

static void list_joints(kt_mjcf *m, kt_element *within, kt_list *joints);

/* Lists the joints of one kind in a body, or follows its bodies (name: body). Frames are no bodies: their contents
 * belong to the body around them. */
static void list_here(kt_mjcf *m, kt_element *within, const char *name, kt_list *joints) {
    for (kt_element *e = within->first; e != NULL && !m->r->out_of_memory; e = e->next) {
        if (strcmp(e->name, "frame") == 0) {
            list_here(m, e, name, joints);
        } else if (strcmp(e->name, name) == 0 && strcmp(name, "body") == 0) {
            list_joints(m, e, joints);
        } else if (strcmp(e->name, name) == 0) {
            const kt_element **to = kt_list_add(m->r, &m->r->scratch, joints, sizeof *to);
            if (to != NULL)
                *to = e;
        }
    }
}

/* In the order of mjcf_body.c's collect_body: that of the numbers of a keyframe. */
static void list_joints(kt_mjcf *m, kt_element *within, kt_list *joints) {
    list_here(m, within, "joint", joints);
    list_here(m, within, "freejoint", joints);
    list_here(m, within, "body", joints);
}

/* ---- attaching --------------------------------------------------------------------------------------------------- */

static kt_element *find_attached_body(kt_element *within, const char *name) {
    kt_element *found = NULL;
    for (kt_element *e = within->first; e != NULL && found == NULL; e = e->next)
        found = strcmp(e->name, "body") == 0 && kt_text_is(kt_xml_attribute(e, "name"), name)
                    ? e
                    : find_attached_body(e, name);
    return found;
}

static void unlink_element(kt_element *e) {
    kt_element *parent = e->parent, *before = NULL;
    for (kt_element *child = parent->first; child != e; child = child->next)
        before = child;
    (void)kt_mjcf_splice(parent, before, e, NULL);
}

/* A <frame> in place of an <attach>, for the contents of an element of the attached model. */
static kt_element *make_attached_frame(kt_mjcf *m, const kt_element *at, const kt_element *of) {
    kt_element *frame = kt_element_at(m->r, at, "frame", of->attributes);
    if (frame == NULL || kt_element_own(m->r, frame) == NULL)
        return NULL;
    frame->document = of->document;
    m->elements++;
    return frame;
}

/* A <frame> for a body that is taken out of its surroundings. It has the class of the surroundings, in the body's
 * document. */
static kt_element *make_bare_frame(kt_mjcf *m, const kt_element *at, const kt_element *body) {
    const kt_element *p = body->parent;
    while (p->parent != NULL && (p->document != body->document || kt_xml_attribute(p, "childclass") == NULL))
        p = p->parent;
    const char *class = p->document == body->document ? kt_xml_attribute(p, "childclass") : NULL;
    const char *const attributes[] = {class != NULL ? "childclass" : NULL, class, NULL};
    return make_attached_frame(m, at, &(kt_element){.attributes = attributes, .document = body->document});
}

/* Takes the body of a name out of a model, or all that is in its world, into frames below `to`. */
static void take_bodies(kt_mjcf *m, const kt_element *e, const kt_mjcf_document *d, kt_element *to) {
    const char *name = kt_xml_attribute(e, "body");
    kt_element *body = NULL;
    for (kt_element *w = kt_xml_child(d->root, "worldbody"); w != NULL && body == NULL;
         w = kt_xml_next(w, "worldbody")) {
        body = name != NULL ? find_attached_body(w, name) : NULL;
        if (name != NULL && body == NULL)
            continue;
        kt_element *frame = body != NULL ? make_bare_frame(m, e, body) : make_attached_frame(m, e, w);
        if (frame == NULL)
            return;
        kt_element_hang(to, frame);
        if (body != NULL) {
            unlink_element(body);
            kt_element_hang(frame, body);
            continue;
        }
        for (kt_element *child = w->first, *next; child != NULL; child = next) {
            next = child->next;
            kt_element_hang(frame, child);
        }
        w->first = w->last = NULL;
    }
    if (name != NULL && body == NULL)
        (void)kt_mjcf_fault(m, e, "body %s does not exist in the model", kt_name_quote(name).text);
}

/* Moves all sections of a model, except its bodies, settings and classes, to the model that attaches it. */
static void take_sections(kt_element *from, kt_element *to) {
    static const char kept[] = " worldbody compiler default option size statistic visual ";
    kt_element *e = from->first;
    from->first = from->last = NULL;
    for (kt_element *next; e != NULL; e = next) {
        next = e->next;
        kt_element_hang(kt_words_have(kept, e->name) ? from : to, e);
    }
}

/* Options and the total mass concern the whole model, so that those of an attached model are counted as lost. */
static void count_lost(kt_mjcf *m, int document) {
    const kt_mjcf_document *d = kt_mjcf_document_at(m, document);
    const kt_element *option = kt_xml_child(d->root, "option");
    if (option != NULL || d->settings.total_mass > 0.0)
        kt_left_count(&m->notes.lost_settings, option != NULL ? option : kt_xml_child(d->root, "compiler"));
}

static void expand_document(kt_mjcf *m, int document, int depth);

/* Makes the contents that replace an <attach>, below `to`. */
static void attach(kt_mjcf *m, const kt_element *e, int depth, kt_element *to) {
    const char *name = kt_xml_attribute(e, "model"), *prefix = kt_xml_attribute(e, "prefix"), *path = NULL;
    if (prefix == NULL) {
        (void)kt_mjcf_fault(m, e, "the attribute 'prefix' is missing");
        return;
    }
    if (name == NULL) {
        kt_left_count(&m->notes.attached, e);
        return;
    }
    kt_element *root = find_model(m, e, e->document, name, &path);
    const int document = root != NULL ? add_document(m, root, e->document, path, prefix) : -1;
    if (document < 0)
        return;
    expand_document(m, document, depth);
    if (kt_draft_is_wrong(&m->draft))
        return;
    count_lost(m, document);
    kt_list joints = {.items = NULL};
    for (kt_element *w = kt_xml_child(root, "worldbody"); w != NULL; w = kt_xml_next(w, "worldbody"))
        list_joints(m, w, &joints);
    kt_mjcf_document_at(m, document)->joints = joints;
    take_bodies(m, e, kt_mjcf_document_at(m, document), to);
    rename_all(m, to, prefix);
    for (kt_element *s = root->first; s != NULL; s = s->next)
        if (strcmp(s->name, "worldbody") != 0)
            rename_all(m, s, prefix);
    take_sections(root, kt_mjcf_document_at(m, e->document)->root);
}

/* Expands the world, bodies and their frames. Contents that are attached have been expanded before. */
static void attach_within(kt_mjcf *m, kt_element *parent, int depth) {
    kt_element *before = NULL;
    for (kt_element *e = parent->first, *next; e != NULL && !kt_draft_is_wrong(&m->draft); e = next) {
        next = e->next;
        if (strcmp(e->name, "attach") != 0) {
            attach_within(m, e, depth + 1);
            before = e;
            continue;
        }
        if (!kt_words_have(" worldbody body frame ", parent->name)) {
            (void)kt_mjcf_fault(m, e, "it stands in <%.40s>; put it into <worldbody>, <body> or <frame>", parent->name);
            return;
        }
        kt_element attached = {.name = "frame", .attributes = kt_no_attributes, .document = e->document};
        attach(m, e, depth, &attached);
        (void)kt_mjcf_splice(parent, before, e, &attached);
        before = attached.last != NULL ? attached.last : before;
    }
}

/* Reports elements that stand for many bodies. MuJoCo expands these elements when it compiles a model. */
static void reject_shorthands(kt_mjcf *m, const kt_element *within) {
    for (const kt_element *e = within->first; e != NULL; e = e->next) {
        if (kt_words_have(" flexcomp composite replicate ", e->name))
            (void)kt_mjcf_fault(m, e,
                                "it is not read; mj_saveLastXML of MuJoCo writes the model with the bodies that it "
                                "stands for, which can be read");
        else
            reject_shorthands(m, e);
    }
}

static void expand_document(kt_mjcf *m, int document, int depth) {
    kt_mjcf_include(m, document, depth);
    kt_mjcf_read_settings(m, document);
    reject_shorthands(m, kt_mjcf_document_at(m, document)->root);
    if (!kt_draft_is_wrong(&m->draft))
        attach_within(m, kt_mjcf_document_at(m, document)->root, depth);
}

void kt_mjcf_expand(kt_mjcf *m) {
    if (add_document(m, m->root, -1, m->source->folder != NULL ? m->source->path : NULL, "") == 0)
        expand_document(m, 0, 0);
}

/* ---- what is incomplete ----------------------------------------------------------------------------------------- */

/* Whether a name belongs to an incomplete item. */
static bool is_lost(const kt_mjcf *m, const char *name) {
    bool found = false;
    for (int i = 0; i < m->lost_names.count && !found; i++)
        found = strcmp(((const char *const *)m->lost_names.items)[i], name) == 0;
    return found;
}

/* Whether all references of an element, and of the elements in it, exist, or are missing from the model itself. */
static bool is_complete(const kt_mjcf *m, const kt_element *e) {
    for (size_t i = 0; e->attributes[i] != NULL; i += 2) {
        const int scope = scope_of_reference(e->attributes[i]);
        const char *name = e->attributes[i + 1];
        if (scope >= 0 &&
            kt_names_find(&m->names, scope == KT_MJCF_TENDONS ? KT_MJCF_COMPLETE_TENDONS : scope, name) < 0 &&
            (e->document > 0 || is_lost(m, name)))
            return false;
    }
    for (const kt_element *child = e->first; child != NULL; child = child->next)
        if (!is_complete(m, child))
            return false;
    return true;
}

void kt_mjcf_mark_incomplete(kt_mjcf *m) {
    static const char *const sections[] = {"tendon", "equality", "actuator"};
    for (size_t i = 0; i < sizeof sections / sizeof *sections; i++)
        for (kt_element *e = kt_mjcf_section_of_all(m, sections[i], NULL); e != NULL;
             e = kt_mjcf_section_of_all(m, sections[i], e)) {
            const char *name = kt_xml_attribute(e, "name");
            if (!is_complete(m, e)) {
                e->number = KT_MJCF_INCOMPLETE;
                kt_left_count(&m->notes.incomplete, e);
                const char **lost =
                    name != NULL ? kt_list_add(m->r, &m->r->scratch, &m->lost_names, sizeof *lost) : NULL;
                if (lost != NULL) /* what refers to it is incomplete, too */
                    *lost = name;
            } else if (i == 0 && name != NULL) {
                (void)kt_names_add(&m->names, KT_MJCF_COMPLETE_TENDONS, name, 0);
            }
        }
}
