/* A scene file as a tree of nodes, each with its line and column. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DOCUMENT_NODE_H
#define KT_DOCUMENT_NODE_H

#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef enum kt_node_kind { KT_NODE_TEXT = 0, KT_NODE_LIST, KT_NODE_MAP } kt_node_kind;

/* Children are chained by `next`; the children of a mapping are key, value, key, value ... */
typedef struct kt_node {
    union {
        const char *text;      /* text of a scalar: terminated */
        struct kt_node *first; /* first item of a list or mapping */
    } of;
    struct kt_node *next;
    uint32_t count;        /* bytes of the text, items of the list, pairs of the mapping */
    uint32_t line, column; /* from 1, in characters */
    uint8_t kind;          /* kt_node_kind */
    bool plain;            /* a scalar without quotes */
    bool faulty;           /* a fault has been reported here */
    bool follows;          /* a number that depends on a variable, until a reader has recorded its place (vary.h) */
} kt_node;

enum {
    KT_NODE_DEPTH_MAX = 32,     /* lists and mappings within one another; a scene needs nine */
    KT_NODE_COUNT_MAX = 1 << 23 /* 32 bytes each */
};

/* Returns the value of the first such key of a mapping; NULL if there is none. O(number of keys). */
kt_node *kt_node_find(const kt_node *map, const char *key);

/* Whether a fault has been reported at a key of a mapping: such a key may have been meant for any other key. */
bool kt_node_has_stray(const kt_node *map);

/* Whether a fault has been reported at this node or below it. A node that is NULL has no fault. */
bool kt_node_is_faulty(const kt_node *node);

typedef struct kt_reader kt_reader;

/* Reads text as one YAML document into *root. Every fault of form is reported; returns false if there is no tree to
 * continue with. Memory: at most KT_NODE_COUNT_MAX nodes and the text once more. */
bool kt_node_parse(kt_reader *reader, const char *text, size_t size, kt_node **root);

#endif
