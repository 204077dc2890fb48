/* Formulas with names, which other formulas use: the section `expressions` (named.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_NAMED_H
#define KT_SCENE_NAMED_H

#include "kinetree/expression.h"
#include "scene/scene_reader.h"

/* Lists the section, before anything else is read. */
void kt_expressions_list(kt_reader *r);

/* Whether a name has a meaning of its own in expressions: t, pi, units and functions. */
bool kt_is_reserved(const char *name);

/* A place within the text of a node, from 0 and in bytes, as a node; texts over several lines have only a beginning. */
kt_node kt_spot_of(const kt_node *node, int at);

/* Whether there is an expression of this name; the k-th name, NULL beyond the last. */
bool kt_is_named(const kt_reader *r, const char *name);
const char *kt_expression_name(const kt_reader *r, int k);

/* The key of the k-th that nothing uses, k from 0; NULL beyond the last. */
kt_node *kt_expression_unused(const kt_reader *r, int k);

/* The first word of a text that is such a name: its place from 0; -1 if there is none. */
int kt_find_named(const kt_reader *r, const char *text);

/* Text that comes from one node: from `at` on it is the node's text from `offset` on. */
typedef struct kt_stretch {
    int at, offset;
    kt_node *node;
    int named; /* index of the named formula that owns the node; -1: the node is that of the formula */
} kt_stretch;

/* A formula whose expressions are written out. */
typedef struct kt_written {
    const char *text;
    kt_node *node; /* node of the formula */
    kt_stretch *stretches;
    int count;
} kt_written;

/* Writes the expressions of a formula out, each in parentheses. `variables`: the names that the formula may use, which
 * may have hyphens. Reports expressions that depend on themselves or become too long, and returns false. */
bool kt_write_out(kt_reader *r, const kt_scope *scope, kt_node *node, const kt_symbols *variables, kt_written *out);

/* Whether an expression that was written out is the value of a variable (vary.h). */
bool kt_written_varies(const kt_reader *r, const kt_written *written);

/* Reports a fault at a place of the text that was written out, from 0: in the formula, or in the expression that it
 * comes from. Returns false. */
bool kt_written_fault(kt_reader *r, const kt_scope *scope, const kt_written *written, int at, const char *message);

#endif
