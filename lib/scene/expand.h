/* Nodes that the reader makes of others: sections of a file that stand for items of other sections. */
#ifndef KT_SCENE_EXPAND_H
#define KT_SCENE_EXPAND_H

#include "scene/reader.h"

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

#endif
