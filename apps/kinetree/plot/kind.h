/* Kinds of columns: the panel that a column of a result belongs to, by its name. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_PLOT_KIND_H
#define KT_COMMAND_PLOT_KIND_H

#include <stdbool.h>

enum { KT_COLUMN_KINDS = 23, KT_COLUMN_MARKER = 4 /* places of markers */ };

/* The kind of a column follows from its name: from the part before the first point, and from the ending. `ends` lists
 * the endings, with '|' between them. NULL accepts every ending. On a logarithmic axis, a column that may be a residual
 * is never noise, however small it is. */
typedef struct kt_column_kind {
    const char *name, *ends, *title, *unit;
    bool is_default, is_log, is_residual;
} kt_column_kind;

extern const kt_column_kind kt_column_kinds[KT_COLUMN_KINDS]; /* the last one: all other columns */

int kt_column_kind_of(const char *name);

/* Returns whether the first words of a column's name are these, whole: "marker" and "marker.tip" of "marker.tip.x". */
bool kt_column_begins(const char *name, const char *beginning);

/* Returns whether a name has one of the endings, with '|' between them. */
bool kt_column_ends(const char *name, const char *ends);

/* Returns whether a column is an own column of the scene with a unit. */
bool kt_column_has_own_unit(const char *name);

/* Returns whether a column is an own column of the scene: `columns` names it without points. The time is none. */
bool kt_column_is_own(const char *name);

#endif
