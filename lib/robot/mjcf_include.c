/* Files that a model in MJCF includes, and replicates.
 *
 * A file may be included several times, but not within itself. The sizes of files are summed, and copies of replicates
 * are counted. This limits the memory that a small file can claim. */
#include "robot/mjcf.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* ---- elements ---------------------------------------------------------------------------------------------------- */

void kt_mjcf_hang_below(kt_element *parent, kt_element *e) {
    e->parent = parent;
    e->next = NULL;
    if (parent->last == NULL)
        parent->first = e;
    else
        parent->last->next = e;
    parent->last = e;
}

kt_element *kt_mjcf_splice(kt_element *parent, kt_element *before, kt_element *e, kt_element *from) {
    kt_element *next = e->next;
    for (kt_element *child = from != NULL ? from->first : NULL; child != NULL; child = child->next)
        child->parent = parent;
    kt_element *first = from != NULL && from->first != NULL ? from->first : next;
    kt_element *last = from != NULL && from->first != NULL ? from->last : before;
    if (before != NULL)
        before->next = first;
    else
        parent->first = first;
    if (from != NULL && from->first != NULL)
        from->last->next = next;
    if (next == NULL)
        parent->last = last;
    return first;
}

/* ---- include ----------------------------------------------------------------------------------------------------- */

enum { INCLUDES_MOST = 64 /* files within one another */ };

/* Whether a file is the one that has an element of a document, or one that includes this file. */
static bool includes_itself(kt_mjcf *m, int document, const kt_element *e, const char *path) {
    const kt_mjcf_document *d = kt_mjcf_document_at(m, document);
    int depth = 0;
    for (; e->by != NULL && e->file != d->root->file; e = e->by)
        if (strcmp(e->file, path) == 0 || ++depth == INCLUDES_MOST)
            return true;
    return d->path != NULL && strcmp(d->path, path) == 0;
}

const char *kt_mjcf_find_file(kt_mjcf *m, int document, const kt_element *e, const char *name) {
    const kt_element *root = kt_mjcf_document_at(m, document)->root;
    const char *path = kt_include_relative(m->r, m->source, root, name);
    const char *near = kt_include_relative(m->r, m->source, e, name);
    if (path == NULL || near == NULL)
        return NULL;
    const bool is_near = e->file != root->file && !kt_include_is_there(m->r, m->source, path) &&
                         kt_include_is_there(m->r, m->source, near);
    return kt_include_path(m->r, m->source, e, is_near ? near : path);
}

static kt_element *include_file(kt_mjcf *m, const kt_element *e, int document) {
    const char *name = kt_xml_attribute(e, "file");
    if (name == NULL) {
        (void)kt_mjcf_fault(m, e, "the attribute 'file' is missing");
        return NULL;
    }
    const char *path = kt_mjcf_find_file(m, document, e, name);
    if (path == NULL)
        return NULL;
    if (includes_itself(m, document, e, path)) {
        (void)kt_mjcf_fault(m, e, "files include each other in a circle, or more than %d deep", (int)INCLUDES_MOST);
        return NULL;
    }
    kt_element *root = kt_include_read(m->r, e, path, &m->included_bytes);
    if (root == NULL || strcmp(root->name, "mujocoinclude") == 0 || strcmp(root->name, "mujoco") == 0)
        return root;
    (void)kt_mjcf_fault(m, e, "%.200s begins with <%.40s>, not with <mujocoinclude> or <mujoco>", path, root->name);
    return NULL;
}

static void expand_includes(kt_mjcf *m, int document, kt_element *parent, int depth) {
    kt_element *before = NULL;
    for (kt_element *e = parent->first; e != NULL && !m->r->out_of_memory;) {
        if (strcmp(e->name, "include") == 0) {
            e = kt_mjcf_splice(parent, before, e, include_file(m, e, document));
            continue;
        }
        if (depth == KT_XML_DEPTH_MAX) {
            (void)kt_mjcf_fault(m, e, "elements are nested more than %d deep", (int)KT_XML_DEPTH_MAX);
            e->first = e->last = NULL;
        }
        m->elements++;
        e->document = document;
        expand_includes(m, document, e, depth + 1);
        before = e;
        e = e->next;
    }
}

void kt_mjcf_include(kt_mjcf *m, int document, int depth) {
    kt_element *root = kt_mjcf_document_at(m, document)->root;
    root->document = document;
    expand_includes(m, document, root, depth);
}

/* ---- replicate --------------------------------------------------------------------------------------------------- */

/* Attributes with `suffix` at the name, and with childclass left as it is; NULL after reporting. */
static const char *const *copy_attributes(kt_mjcf *m, const kt_element *e, const char *suffix) {
    size_t count = 0;
    while (e->attributes[count] != NULL)
        count++;
    const char **copy = kt_pool_take(&m->r->scratch, count + 1, sizeof *copy);
    if (copy == NULL) {
        (void)kt_reader_out_of_memory(m->r);
        return NULL;
    }
    for (size_t i = 0; i < count; i += 2) {
        const char *value = e->attributes[i + 1];
        copy[i] = e->attributes[i];
        copy[i + 1] = value;
        if (strcmp(copy[i], "name") != 0)
            continue;
        const char **base = kt_list_add(m->r, &m->r->scratch, &m->copied, sizeof *base);
        copy[i + 1] = kt_mjcf_join(m, e, value, suffix);
        if (base == NULL || copy[i + 1] == NULL)
            return NULL;
        *base = value;
    }
    return copy;
}

/* Copies the children of an element; false if there is no memory, or there are too many elements. */
static bool copy_children(kt_mjcf *m, const kt_element *from, kt_element *to, const char *suffix) {
    for (const kt_element *e = from->first; e != NULL; e = e->next) {
        if (++m->elements > KT_MJCF_ELEMENTS_MOST)
            return false;
        kt_element *copy = kt_pool_take(&m->r->scratch, 1, sizeof *copy);
        if (copy == NULL)
            return kt_reader_out_of_memory(m->r);
        *copy = *e;
        copy->first = copy->last = copy->next = NULL;
        copy->attributes = copy_attributes(m, e, suffix);
        if (copy->attributes == NULL)
            return false;
        kt_mjcf_hang_below(to, copy);
        if (!copy_children(m, e, copy, suffix))
            return false;
    }
    return true;
}

/* A <frame> with the pose of a copy. */
static kt_element *make_copy_frame(kt_mjcf *m, const kt_element *e, kt_pose pose) {
    const kt_quat q = kt_quat_from_matrix(pose.rotation);
    const kt_vec3 p = pose.position;
    const char *childclass = kt_xml_attribute(e, "childclass");
    kt_element *frame = kt_pool_take(&m->r->scratch, 1, sizeof *frame);
    const char **attributes = kt_pool_take(&m->r->scratch, 7, sizeof *attributes);
    char *text = kt_pool_take(&m->r->scratch, 240, 1);
    if (frame == NULL || attributes == NULL || text == NULL) {
        (void)kt_reader_out_of_memory(m->r);
        return NULL;
    }
    (void)snprintf(text, 100, "%.17g %.17g %.17g", p.x, p.y, p.z);
    (void)snprintf(text + 100, 140, "%.17g %.17g %.17g %.17g", q.w, q.x, q.y, q.z);
    attributes[0] = "pos";
    attributes[1] = text;
    attributes[2] = "quat";
    attributes[3] = text + 100;
    attributes[4] = childclass != NULL ? "childclass" : NULL;
    attributes[5] = childclass;
    *frame = *e;
    frame->name = "frame";
    frame->attributes = attributes;
    frame->first = frame->last = frame->next = NULL;
    return frame;
}

/* The copies, each displaced from the one before by `offset` and turned by `euler`. Copy k has the pose T^k. */
static void replicate(kt_mjcf *m, int document, const kt_element *e, kt_element *copies) {
    static const char *const none[] = {NULL};
    const double count = kt_mjcf_number(m, e, NULL, "count", 0.0);
    const char *separator = kt_xml_attribute(e, "sep");
    kt_pose step = {.rotation = kt_mjcf_pose(m, e, NULL).rotation,
                    .position = kt_mjcf_vector(m, e, NULL, "offset", kt_vec3_make(0.0, 0.0, 0.0))};
    kt_pose at = kt_pose_identity();
    *copies = (kt_element){.name = "frame", .attributes = none};
    if (kt_draft_is_wrong(&m->draft))
        return;
    if (!(count >= 1.0 && count <= KT_MJCF_ELEMENTS_MOST && count == floor(count))) {
        (void)kt_mjcf_fault(m, e, "count: expected a whole number from 1 to %d", (int)KT_MJCF_ELEMENTS_MOST);
        return;
    }
    kt_list items;
    kt_mjcf_take_copied_items(m, document, e, &items);
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
            !kt_mjcf_copy_items(m, document, &items, suffix)) {
            if (!kt_draft_is_wrong(&m->draft))
                (void)kt_mjcf_fault(m, e, "copies make more than %d elements of the model", (int)KT_MJCF_ELEMENTS_MOST);
            return;
        }
        kt_mjcf_hang_below(copies, frame);
        at = kt_pose_compose(at, step);
    }
}

/* From the inside out, since copies have copies. */
static void expand_replicates(kt_mjcf *m, int document, kt_element *parent) {
    kt_element *before = NULL;
    for (kt_element *e = parent->first; e != NULL && !kt_draft_is_wrong(&m->draft);) {
        expand_replicates(m, document, e);
        if (strcmp(e->name, "replicate") == 0) {
            kt_element copies, *next = e->next;
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
