/* The spanning tree of a graph of bodies and joints.
 *
 * A joint of the tree carries a body and has f coordinates. Any other joint closes a loop of 6 - f equations. Which
 * tree makes the smallest groups of loops? Loops belong to one group if they share joints, and the groups are the
 * blocks of the graph (its largest parts without a cut vertex) for every tree. This is so because fundamental cycles of
 * a connected matroid are connected, whatever its basis. In a block of e joints with F coordinates and n bodies, each
 * tree cuts e - n joints. If these have C coordinates, the group has
 *
 *     F - C coordinates,    6 (e - n) - C equations.
 *
 * Both are least if C is greatest, that is, if the joints of the tree have the fewest coordinates. With the number of
 * coordinates as weight, this is the tree of least weight, which Kruskal's greedy method finds: take the edges in
 * ascending order of weight, and leave out each that would close a cycle. Further preferences, such as given start
 * positions, are higher digits of the weight.
 *
 * Among equal weights, short loops are better, since fewer joints depend on their equations. The height of a vertex is
 * its distance from the roots in the graph. Edges are taken in ascending order of the greater height of their ends,
 * then of the other height. Then every vertex of height d + 1 is joined with a vertex of height d before any other edge
 * of height d + 1 is tried. If all weights are equal, the result is therefore the tree of a search in breadth. Edges
 * that lead away from the roots come first among equals, because a reversed joint turns about the opposite axis.
 *
 * Source: J. B. Kruskal, Proc. AMS 7, p. 48 (1956), doi:10.1090/S0002-9939-1956-0078686-7. On connected matroids: J.
 * Oxley, Matroid Theory, 2nd ed. (2011), proposition 4.3.2 ff.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "parts/spanning.h"

#include <stddef.h>

/* The edges at each vertex: first[i] to first[i + 1] in `edges`. */
typedef struct incidence {
    int *first, *edges;
} incidence;

/* The rank of an edge among the edges that Kruskal's method takes. */
typedef struct edge_rank {
    int weight, height, sum, away, index;
} edge_rank;

typedef struct spanning_search {
    kt_spanning *graph;
    incidence at[2]; /* edges by their first vertices, and by their second vertices */
    int *height;     /* of each vertex; -1: not reached yet */
    int *queue, queued;
    int *above; /* union-find, of each vertex */
    edge_rank *ranks, *merged;
    int *root, given_count, root_count; /* roots: the given ones first */
} spanning_search;

/* The edges whose end `end` is vertex v become edges[first[v]] to edges[first[v + 1] - 1], by counting. */
static bool sort_by_end(kt_pool *pool, const kt_spanning *g, int end, incidence *at) {
    int *ends = kt_pool_take(pool, (size_t)g->vertex_count + 2, sizeof *ends);
    at->edges = kt_pool_take(pool, (size_t)g->edge_count + 1, sizeof *at->edges);
    at->first = ends;
    if (ends == NULL || at->edges == NULL)
        return false;
    for (int i = 0; i < g->edge_count; i++)
        ends[g->edge[i].end[end] + 2]++;
    for (int i = 2; i < g->vertex_count + 2; i++)
        ends[i] += ends[i - 1];
    for (int i = 0; i < g->edge_count; i++)
        at->edges[ends[g->edge[i].end[end] + 1]++] = i;
    return true;
}

static bool begin_search(kt_pool *pool, kt_spanning *g, spanning_search *s) {
    const size_t vertices = (size_t)g->vertex_count + 1, edges = (size_t)g->edge_count + 1;
    *s = (spanning_search){.graph = g};
    g->carrier = kt_pool_take(pool, vertices, sizeof *g->carrier);
    g->depth = kt_pool_take(pool, vertices, sizeof *g->depth);
    g->order = kt_pool_take(pool, vertices, sizeof *g->order);
    s->height = kt_pool_take(pool, vertices, sizeof *s->height);
    s->above = kt_pool_take(pool, vertices, sizeof *s->above);
    s->root = kt_pool_take(pool, vertices, sizeof *s->root);
    s->ranks = kt_pool_take(pool, edges, sizeof *s->ranks);
    s->merged = kt_pool_take(pool, edges, sizeof *s->merged);
    s->queue = g->order;
    if (g->carrier == NULL || g->depth == NULL || g->order == NULL || s->height == NULL || s->above == NULL ||
        s->root == NULL || s->ranks == NULL || s->merged == NULL || !sort_by_end(pool, g, 0, &s->at[0]) ||
        !sort_by_end(pool, g, 1, &s->at[1]))
        return false;
    for (int i = 0; i < g->vertex_count; i++) {
        g->carrier[i] = s->height[i] = -1;
        s->above[i] = i;
        if (i == 0 || (g->is_root != NULL && g->is_root[i]))
            s->root[s->root_count++] = i;
    }
    s->given_count = s->root_count;
    return true;
}

/* ---- heights ------------------------------------------------------------------------------------------------------
 * */

static void reach(spanning_search *s, int vertex, int height) {
    if (s->height[vertex] >= 0)
        return;
    s->height[vertex] = height;
    s->queue[s->queued++] = vertex;
}

/* Gives heights to all vertices that the vertices of the queue reach from its index `from` on. */
static void grow_heights(spanning_search *s, int from) {
    for (int k = from; k < s->queued; k++)
        for (int end = 0; end < 2; end++) {
            const int vertex = s->queue[k];
            for (int i = s->at[end].first[vertex]; i < s->at[end].first[vertex + 1]; i++) {
                const kt_edge *edge = &s->graph->edge[s->at[end].edges[i]];
                if (edge->weight != KT_EDGE_CUT)
                    reach(s, edge->end[1 - end], s->height[vertex] + 1);
            }
        }
}

/* Finds the heights, and a root of each part without one. */
static void measure_heights(spanning_search *s) {
    const int vertices = s->graph->vertex_count;
    for (int i = 0; i < s->given_count; i++)
        reach(s, s->root[i], 0);
    grow_heights(s, 0);
    for (int pass = 0; pass < 2; pass++)
        for (int i = 1; i < vertices; i++) {
            const bool is_target = s->at[1].first[i + 1] > s->at[1].first[i];
            if (s->height[i] >= 0 || (pass == 0 && is_target))
                continue;
            const int from = s->queued;
            s->root[s->root_count++] = i;
            reach(s, i, 0);
            grow_heights(s, from);
        }
}

/* ---- the edges of the tree --------------------------------------------------------------------------------------- */

static int set_of(int *above, int vertex) {
    while (above[vertex] != vertex)
        vertex = above[vertex] = above[above[vertex]];
    return vertex;
}

/* Whether an edge is taken before another one. */
static bool is_before(const edge_rank *a, const edge_rank *b) {
    const int pairs[][2] = {
        {a->weight, b->weight}, {a->height, b->height}, {a->sum, b->sum}, {a->away, b->away}, {a->index, b->index}};
    for (size_t i = 0; i < sizeof pairs / sizeof *pairs; i++)
        if (pairs[i][0] != pairs[i][1])
            return pairs[i][0] < pairs[i][1];
    return false;
}

/* Sorts the ranks by merging runs of twice the length each time. */
static void sort_ranks(spanning_search *s) {
    const int count = s->graph->edge_count;
    edge_rank *from = s->ranks, *to = s->merged;
    for (int run = 1; run < count; run *= 2) {
        for (int begin = 0; begin < count; begin += 2 * run) {
            const int middle = begin + run < count ? begin + run : count;
            const int end = middle + run < count ? middle + run : count;
            int a = begin, b = middle;
            for (int k = begin; k < end; k++)
                to[k] = a < middle && (b == end || !is_before(&from[b], &from[a])) ? from[a++] : from[b++];
        }
        s->ranks = to;
        to = from;
        from = s->ranks;
    }
}

static edge_rank rank_of(const spanning_search *s, int index) {
    const kt_edge *edge = &s->graph->edge[index];
    const int a = s->height[edge->end[0]], b = s->height[edge->end[1]];
    return (edge_rank){.weight = edge->weight, .height = a > b ? a : b, .sum = a + b, .away = a > b, .index = index};
}

/* Kruskal's algorithm: by rank, an edge is used unless its ends are connected already. Edges to be cut are never used.
 */
static void choose_edges(spanning_search *s) {
    kt_spanning *g = s->graph;
    for (int i = 1; i < s->root_count; i++)
        s->above[s->root[i]] = 0; /* the ground holds all roots */
    for (int i = 0; i < g->edge_count; i++)
        s->ranks[i] = rank_of(s, i);
    sort_ranks(s);
    for (int i = 0; i < g->edge_count && s->ranks[i].weight < KT_EDGE_CUT; i++) {
        kt_edge *edge = &g->edge[s->ranks[i].index];
        const int a = set_of(s->above, edge->end[0]), b = set_of(s->above, edge->end[1]);
        edge->is_used = a != b;
        s->above[a] = b;
    }
}

/* ---- from the roots outwards ------------------------------------------------------------------------------------- */

static void visit_vertex(spanning_search *s, int vertex, int edge, int parent) {
    s->graph->carrier[vertex] = edge;
    s->graph->depth[vertex] = parent >= 0 ? s->graph->depth[parent] + 1 : 0;
    s->graph->order[s->queued++] = vertex;
    s->height[vertex] = -1; /* visited */
}

/* Visits the vertices at the other ends of a vertex's edges: along the edges (end 0), or against them (end 1). */
static void expand_vertex(spanning_search *s, int vertex, int end) {
    for (int i = s->at[end].first[vertex]; i < s->at[end].first[vertex + 1]; i++) {
        kt_edge *edge = &s->graph->edge[s->at[end].edges[i]];
        const int next = edge->end[1 - end];
        if (!edge->is_used || s->height[next] < 0)
            continue;
        edge->is_reversed = end == 1;
        visit_vertex(s, next, s->at[end].edges[i], vertex);
    }
}

/* Edges are followed along their direction first, so that bodies keep the order of their joints. */
static void direct_edges(spanning_search *s) {
    int along = 0, against = 0;
    s->queued = 0;
    for (int i = 0; i < s->root_count; i++) {
        visit_vertex(s, s->root[i], -1, -1);
        if (i + 1 < s->given_count)
            continue; /* all given roots come first */
        while (against < s->queued)
            if (along < s->queued)
                expand_vertex(s, s->graph->order[along++], 0);
            else
                expand_vertex(s, s->graph->order[against++], 1);
    }
}

bool kt_spanning_find(kt_pool *pool, kt_spanning *graph) {
    spanning_search search;
    if (!begin_search(pool, graph, &search))
        return false;
    measure_heights(&search);
    choose_edges(&search);
    direct_edges(&search);
    return true;
}

/* ---- cycles ------------------------------------------------------------------------------------------------------ */

int kt_spanning_heaviest(const kt_spanning *graph, int edge, int *length) {
    int vertex[2] = {graph->edge[edge].end[0], graph->edge[edge].end[1]}, heaviest = -1;
    *length = 0;
    while (vertex[0] != vertex[1]) {
        const int upper = graph->depth[vertex[1]] > graph->depth[vertex[0]];
        const int carrier = graph->carrier[vertex[upper]];
        if (carrier < 0)
            break; /* both are roots, which the ground holds */
        if (heaviest < 0 || graph->edge[carrier].weight > graph->edge[heaviest].weight)
            heaviest = carrier;
        vertex[upper] = graph->edge[carrier].end[graph->edge[carrier].is_reversed];
        (*length)++;
    }
    return heaviest;
}
