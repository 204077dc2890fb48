/* The spanning tree of a graph of bodies and joints (spanning.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_PARTS_SPANNING_H
#define KT_PARTS_SPANNING_H

#include "base/inner.h"
#include "base/pool.h"

/* An edge of this weight is never in the tree. */
enum { KT_EDGE_CUT = 1 << 20 };

/* A joint between two vertices. */
typedef struct kt_edge {
    int end[2];       /* vertices; the edge leads from the first to the second */
    int weight;       /* lighter edges are preferred for the tree; not negative */
    bool is_used;     /* the edge is in the tree */
    bool is_reversed; /* seen from the root, it leads to its first vertex */
} kt_edge;

/* A graph, and its tree. Vertex 0 is the ground. */
typedef struct kt_spanning {
    int vertex_count, edge_count;
    kt_edge *edge;       /* the caller's */
    const bool *is_root; /* vertices that are roots besides the ground; NULL: none */
    int *carrier;        /* for each vertex: the edge that leads to the vertex in the tree; -1: a root */
    int *depth;          /* for each vertex: edges of the tree between the vertex and its root */
    int *order;          /* vertices, each behind the vertex that carries it */
} kt_spanning;

/* Finds the tree of least weight. The arrays are taken from the pool. A part of the graph without a root gets one: the
 * first vertex to which no edge leads, or else its first vertex. Returns false if there is no memory. */
KT_INNER bool kt_spanning_find(kt_pool *pool, kt_spanning *graph);

/* The heaviest edge of the tree on the way between the ends of an edge that is not in the tree; -1: there is none.
 * *length is the number of edges on that way. O(length). */
int kt_spanning_heaviest(const kt_spanning *graph, int edge, int *length);

#endif
