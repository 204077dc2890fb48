/* Files that a model in MJCF includes.
 *
 * A file may be included several times, but not within itself. The sizes of files are summed. This limits the memory
 * that a small file can claim. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "robot/mjcf.h"

#include <string.h>

/* ---- elements ---------------------------------------------------------------------------------------------------- */

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
    const kt_mjcf_document *d = kt_mjcf_document_at(m, document);
    if (kt_include_is_circular(e, d->root->file, path, INCLUDES_MOST) || kt_text_is(d->path, path)) {
        (void)kt_mjcf_fault(m, e, "files include each other in a circle, or more than %d deep", (int)INCLUDES_MOST);
        return NULL;
    }
    kt_element *root = kt_include_read(m->r, e, path, &m->included_bytes);
    if (root == NULL || (strcmp(root->name, "robot") != 0 && strcmp(root->name, "sdf") != 0))
        return root; /* a part has any name: its elements replace the include */
    (void)kt_mjcf_fault(m, e, "%.200s begins with <%.40s>, and is no part of a model in MJCF", path, root->name);
    return NULL;
}

/* The contents of a file replace its <include>, and may include further files. */
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
