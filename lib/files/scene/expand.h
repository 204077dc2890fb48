/* Changes the nodes of a file before its sections are read. Some sections stand for items of others. Actions of
 * events are expanded. Formulas that a comma has cut are reported. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SCENE_EXPAND_H
#define KT_SCENE_EXPAND_H

#include "scene/scene_reader.h"

/* A word in a text of items, and the node or the text that replaces it. */
typedef struct kt_replacement {
    const char *word;
    const kt_node *node; /* NULL: the text */
    const char *text;
} kt_replacement;

/* Parses a text of items, or of keys; NULL without any. */
kt_node *kt_nodes_parse(kt_reader *r, const char *text, size_t length);

/* Gives the position of `place` to all nodes of a text, and replaces the words. */
void kt_nodes_settle(kt_node *node, const kt_node *place, const kt_replacement *words, int count);

/* Appends the items of a list, or the keys of a mapping, to a section. Makes the section if the file has none. */
void kt_nodes_append(kt_reader *r, const char *key, kt_node *items, const kt_node *place);

/* Visits the actions of the file's events that are mappings. */
typedef void kt_action_visit(const kt_node *action, void *user);
void kt_actions_visit(const kt_reader *r, kt_action_visit *visit, void *user);

/* Makes the items of the section `beams` into items of `bodies`, `effects` and `loops`, before these are read. */
void kt_beams_expand(kt_reader *r);

/* Reports plain texts of the file that a comma has cut within parentheses; their parts are faulty then. O(nodes). */
void kt_commas_check(kt_reader *r);

/* Whether a section of the file, a mapping, has a key. */
bool kt_section_has(const kt_reader *r, const char *section, const char *key);

#endif
