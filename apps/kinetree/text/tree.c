/* Prints trees as text that is readable for one body and for a hundred thousand.
 *
 * A body is printed below its parent, indented by one more level. Two things are abridged. A long run of bodies with
 * one child each is reduced to the first two and the last. A body with many children shows only the first ones.
 *
 * Then the tree is cut at the deepest level that keeps it within LINES_MAX lines. Levels count branchings, not the
 * bodies of a run. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "text/reference.h"

#include "command.h"
#include "text/bytes.h"

#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

enum { LINES_MAX = 100, RUN_SHOWN = 2, RUN_MAX = 12, CHILDREN_MAX = 10, CHILDREN_SHOWN = 8 };

typedef struct kt_glyphs {
    const char *branch, *last, *through, *none, *more;
} kt_glyphs;

static const kt_glyphs boxes = {"\u251c\u2500 ", "\u2514\u2500 ", "\u2502  ", "   ", "\u22ee "};
static const kt_glyphs ascii = {"|- ", "`- ", "|  ", "   ", ": "};

typedef struct kt_drawing {
    const kt_model *model;
    int *child, *next; /* first child; next sibling; -1: none */
    int *children;     /* number of children */
    int *below;        /* bodies in the subtree below this one */
    int deepest;       /* level below which the tree is cut */
    bool is_cut;       /* something below the deepest level was left out */
    bool silent;       /* only count lines */
    int lines;
    const kt_glyphs *glyphs;
    kt_bytes indent; /* prefix of the current line */
} kt_drawing;

/* ---- one line ---------------------------------------------------------------------------------------------------- */

static void show_markers(const kt_model *model, int body) {
    int count = kt_marker_count(model, body);
    for (int i = 0; i < count && i < 4; i++)
        printf("%s%s", i == 0 ? ", markers " : " ", kt_marker_name(model, body, i));
    if (count > 4)
        printf(" and %d more", count - 4);
}

static void show_body(kt_drawing *d, const char *glyph, int body) {
    d->lines++;
    if (d->silent)
        return;
    kt_coordinates at = kt_body_coordinates(d->model, body);
    double mass = kt_body_mass(d->model, body);
    printf("%.*s%s%s  %s", (int)d->indent.used, d->indent.text, glyph, kt_body_name(d->model, body),
           kt_joint_type_name(at.type));
    if (strcmp(kt_joint_name(d->model, body), kt_body_name(d->model, body)) != 0)
        printf(" '%s'", kt_joint_name(d->model, body));
    if (at.nv > 0)
        printf(", %d dof", at.nv);
    if (mass > 0.0)
        printf(", %g kg", mass);
    show_markers(d->model, body);
    putchar('\n');
}

static void show_more(kt_drawing *d, const char *format, ...) KT_PRINTF(2, 3);

static void show_more(kt_drawing *d, const char *format, ...) {
    d->lines++;
    if (d->silent)
        return;
    va_list arguments;
    printf("%.*s%s", (int)d->indent.used, d->indent.text, d->glyphs->more);
    va_start(arguments, format);
    vprintf(format, arguments);
    va_end(arguments);
    putchar('\n');
}

/* Indents by one more level. */
static void append_indent(kt_drawing *d, const char *glyph) {
    if (!d->silent)
        kt_bytes_add(&d->indent, glyph, strlen(glyph));
}

/* ---- traversal --------------------------------------------------------------------------------------------------- */

/* Returns the last body of the run that begins at `body`, in which all bodies before it have one child. *length: number
 * of bodies. */
static int end_of_run(const kt_drawing *d, int body, int *length) {
    *length = 1;
    for (; d->children[body] == 1; ++*length)
        body = d->child[body];
    return body;
}

static void draw_children(kt_drawing *d, int body, int level);

static void draw_branch(kt_drawing *d, int body, bool is_last, int level) {
    size_t used = d->indent.used;
    int length, end = end_of_run(d, body, &length);
    bool is_abridged = length > RUN_MAX;
    for (int i = 0;; i++) {
        show_body(d, i > 0 || is_last ? d->glyphs->last : d->glyphs->branch, body);
        append_indent(d, i > 0 || is_last ? d->glyphs->none : d->glyphs->through);
        if (body == end)
            break;
        body = d->child[body];
        if (is_abridged && i + 1 == RUN_SHOWN) {
            show_more(d, "%d more, from %s on, each on the one before", length - RUN_SHOWN - 1,
                      kt_body_name(d->model, body));
            body = end;
        }
    }
    draw_children(d, end, level + 1);
    d->indent.used = used;
}

static void draw_children(kt_drawing *d, int body, int level) {
    int count = d->children[body], shown = count <= CHILDREN_MAX ? count : CHILDREN_SHOWN;
    if (count == 0 || (d->silent && d->lines > LINES_MAX))
        return;
    if (level > d->deepest) {
        d->is_cut = true;
        show_more(d, "%d bod%s more", d->below[body], d->below[body] == 1 ? "y" : "ies");
        return;
    }
    int child = d->child[body], left = d->below[body];
    for (int i = 0; i < shown; i++) {
        left -= 1 + d->below[child];
        draw_branch(d, child, i == count - 1, level);
        child = d->next[child];
    }
    if (shown < count)
        show_more(d, "%d children more, %d bodies in all", count - shown, left);
}

/* Finds the deepest level with which the drawing stays within LINES_MAX lines. */
static void choose_depth(kt_drawing *d) {
    int best = 0;
    d->silent = true;
    for (d->deepest = 0;; d->deepest++) {
        d->lines = 1;
        d->is_cut = false;
        draw_children(d, 0, 0);
        if (d->lines > LINES_MAX)
            break;
        best = d->deepest;
        if (!d->is_cut)
            break;
    }
    d->deepest = best;
    d->silent = false;
}

int kt_tree_draw(const kt_model *model) {
    size_t count = (size_t)kt_model_body_count(model);
    int *numbers = malloc(4 * count * sizeof *numbers);
    if (numbers == NULL)
        return -1;
    kt_drawing d = {.model = model, .glyphs = kt_speaks_utf8(STDOUT_FILENO) ? &boxes : &ascii};
    d.child = numbers;
    d.next = numbers + count;
    d.children = numbers + 2 * count;
    d.below = numbers + 3 * count;
    for (size_t body = 0; body < count; body++) {
        d.child[body] = d.next[body] = -1;
        d.children[body] = d.below[body] = 0;
    }
    /* Backwards: parents have lower indices than their children, so that a subtree is complete when its root is
     * reached. */
    for (int body = (int)count - 1; body > 0; body--) {
        int parent = kt_body_parent(model, body);
        d.next[body] = d.child[parent];
        d.child[parent] = body;
        d.children[parent]++;
        d.below[parent] += 1 + d.below[body];
    }
    choose_depth(&d);
    puts(kt_body_name(model, 0));
    draw_children(&d, 0, 0);
    free(d.indent.text);
    free(numbers);
    return d.indent.is_short ? -1 : 0;
}
