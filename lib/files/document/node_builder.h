/* Builds a tree of nodes from the events of a parser. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_NODE_BUILDER_H
#define KT_DOCUMENT_NODE_BUILDER_H

#include "document/document_reader.h"

typedef struct kt_node_builder {
    kt_reader *r;
    kt_node *open[KT_NODE_DEPTH_MAX]; /* lists and mappings, the outermost first */
    kt_node **tail[KT_NODE_DEPTH_MAX];
    int depth;
    uint32_t count;
    kt_node *root;
} kt_node_builder;

/* Adds a node after the last node of the innermost list or mapping. Returns NULL after reporting a fault. */
kt_node *kt_node_builder_add(kt_node_builder *b, kt_node_kind kind, uint32_t line, uint32_t column);

/* Adds a list or mapping, which holds the following nodes until kt_node_builder_close. Returns false after a fault. */
bool kt_node_builder_open(kt_node_builder *b, kt_node_kind kind, uint32_t line, uint32_t column);
void kt_node_builder_close(kt_node_builder *b);

/* Copies the text of a scalar. Returns false if memory has run out. */
bool kt_node_builder_text(kt_node_builder *b, kt_node *node, const char *text, size_t length);

#endif
