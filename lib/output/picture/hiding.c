/* The order of hidden solids.
 *
 * 1. The outlines of two pieces are convex polygons in the picture; their intersection is sampled. At each sample, a
 * ray towards the viewer leaves both pieces (kt_solid_cut); the piece that the ray leaves last is in front.
 * 2. Pairs of which each is in front somewhere are cut at the places along the longer one where this changes.
 * 3. "a is behind b" are the edges of a graph, which is sorted topologically. If the graph has a cycle, the longest
 *    piece of the cycle is halved, and all starts again. The edge with the least painting error is dropped instead, if
 *    this error is small or the limit of such rounds is reached. Pieces that need not have been cut are joined
 *    again. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/hiding.h"

#include "base/grow.h"
#include "base/order.h"
#include "picture/outline.h"
#include "picture/solid.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum {
    ALONG = 48,      /* samples along a piece that may be cut */
    CUTS_MAX = 6,    /* of a piece at once */
    ROUNDS_MAX = 2,  /* of cutting pairs */
    CYCLES_MAX = 12, /* that are cut open */
};

/* ---- one pair ---------------------------------------------------------------------------------------------------- */

/* A piece, and its quantities that are needed repeatedly. */
typedef struct shown {
    kt_solid solid;
    kt_outline outline;
    double left, right, bottom, top, area;
    double width;            /* half of the least extent in the plane of a diagram */
    bool shines, lets_shine; /* may be seen inside of another piece (a whole solid alone may); may show such a piece */
} shown;

/* Half of the least extent in the plane of a diagram, for a solid whose axes are in this plane or normal to it. Half of
 * the extent does not change, not even by rounding, as the solid turns in the plane. */
static double half_width(const kt_solid *solid) {
    const kt_mat3 r = solid->pose.rotation;
    const kt_vec3 h = solid->half;
    const double x = fabs(r.x.z), y = fabs(r.y.z), z = fabs(r.z.z);
    if (z >= x && z >= y)
        return fmin(h.x, h.y);
    return fmin(y >= x ? h.x : h.y, solid->type == KT_SOLID_SPHERE ? h.x
                                    : solid->type == KT_SOLID_ROD  ? h.z + h.x
                                                                   : h.z);
}

static shown show_piece(const kt_piece *piece) {
    const bool is_whole = piece->high - piece->low == 2.0 * piece->solid.half.z;
    shown s = {.solid = kt_piece_solid(piece),
               .shines = piece->shines && is_whole,
               .lets_shine = piece->shines,
               .left = DBL_MAX,
               .right = -DBL_MAX,
               .bottom = DBL_MAX,
               .top = -DBL_MAX};
    s.outline = kt_outline_of(&s.solid);
    s.area = kt_outline_area(&s.outline);
    for (int i = 0; i < s.outline.count; i++) {
        s.left = fmin(s.left, s.outline.corners[i].x);
        s.right = fmax(s.right, s.outline.corners[i].x);
        s.bottom = fmin(s.bottom, s.outline.corners[i].y);
        s.top = fmax(s.top, s.outline.corners[i].y);
    }
    s.width = half_width(&piece->solid);
    return s;
}

/* The interval in which the ray at a point of the picture is in the solid, counted towards the viewer. */
static bool depth_at(const kt_solid *solid, kt_outline_point at, double *back, double *front) {
    const kt_pose inverse = kt_pose_invert(solid->pose);
    const kt_vec3 from = kt_pose_apply(inverse, kt_vec3_make(at.x, at.y, 0.0)), towards = inverse.rotation.z;
    return kt_solid_cut(solid, from, towards, back, front);
}

typedef struct relation {
    double nearer, further;  /* by how much a is in front of b where it is most, and b of a; below 0: nowhere */
    bool apart;              /* in depth, somewhere */
    bool a_inside, b_inside; /* of the other, everywhere */
} relation;

/* In a diagram, pieces that share depth at a sample have no order there. */
static void sample_overlap(const shown *a, const shown *b, kt_outline_point at, bool is_diagram, relation *r) {
    double back_a, front_a, back_b, front_b;
    if (!depth_at(&a->solid, at, &back_a, &front_a) || !depth_at(&b->solid, at, &back_b, &front_b))
        return;
    const bool apart = back_a >= front_b || back_b >= front_a;
    r->apart = r->apart || apart;
    r->a_inside = r->a_inside && back_a >= back_b && front_a <= front_b;
    r->b_inside = r->b_inside && back_b >= back_a && front_b <= front_a;
    if (is_diagram && !apart)
        return;
    r->nearer = fmax(r->nearer, front_a - front_b);
    r->further = fmax(r->further, front_b - front_a);
}

/* Samples the overlap at its centre, and between the centre and the corners and middles of its edges. */
static relation relate_pieces(const shown *a, const shown *b, bool is_diagram) {
    relation r = {-DBL_MAX, -DBL_MAX, false, true, true};
    if (a->left >= b->right || b->left >= a->right || a->bottom >= b->top || b->bottom >= a->top)
        return r;
    const kt_outline part = kt_outline_overlap(&a->outline, &b->outline);
    kt_outline_point centre = {0.0, 0.0};
    if (part.count < 3 || kt_outline_area(&part) <= 1e-4 * fmin(a->area, b->area))
        return r;
    for (int i = 0; i < part.count; i++) {
        centre.x += part.corners[i].x / part.count;
        centre.y += part.corners[i].y / part.count;
    }
    sample_overlap(a, b, centre, is_diagram, &r);
    for (int i = 0; i < 2 * part.count; i++) {
        const kt_outline_point p = part.corners[i / 2], q = part.corners[(i / 2 + i % 2) % part.count];
        const kt_outline_point edge = {0.5 * (p.x + q.x) - centre.x, 0.5 * (p.y + q.y) - centre.y};
        static const double shares[] = {0.97, 0.6};
        for (int k = 0; k < 2; k++)
            sample_overlap(a, b, (kt_outline_point){centre.x + shares[k] * edge.x, centre.y + shares[k] * edge.y},
                           is_diagram, &r);
    }
    const bool a_in_b = a->shines && b->lets_shine && r.a_inside && kt_outline_area(&part) > 0.98 * a->area;
    const bool b_in_a = b->shines && a->lets_shine && r.b_inside && kt_outline_area(&part) > 0.98 * b->area;
    if (a_in_b != b_in_a) /* shown as if the other one were transparent */
        return (relation){.nearer = a_in_b ? DBL_MAX : -DBL_MAX, .further = b_in_a ? DBL_MAX : -DBL_MAX};
    if (is_diagram && !r.apart && a->width != b->width) /* the thinner one in front */
        return (relation){.nearer = a->width < b->width ? DBL_MAX : -DBL_MAX,
                          .further = b->width < a->width ? DBL_MAX : -DBL_MAX};
    return r;
}

/* ---- cuts -------------------------------------------------------------------------------------------------------- */

typedef struct cuts {
    int count;
    double at[CUTS_MAX];
} cuts;

/* The side of the piece at z along its middle: 1 in front of the other piece, -1 behind it. The side is 0 if the pieces
 * do not overlap at z. */
static int side_at(const kt_piece *piece, const shown *other, double z) {
    const kt_outline_point at = kt_outline_point_of(kt_pose_apply(piece->solid.pose, kt_vec3_make(0.0, 0.0, z)));
    double back, front, back_other, front_other;
    if (!depth_at(&piece->solid, at, &back, &front) || !depth_at(&other->solid, at, &back_other, &front_other))
        return 0;
    return front > front_other ? 1 : -1;
}

static void add_cut(cuts *c, double at, double gap) {
    for (int i = 0; i < c->count; i++)
        if (fabs(c->at[i] - at) < gap)
            return;
    if (c->count < CUTS_MAX)
        c->at[c->count++] = at;
}

/* Adds the places at which the piece changes from behind the other piece to in front of it, or back. Returns whether
 * any place is found. */
static bool find_cuts(const kt_piece *piece, const shown *other, cuts *c) {
    const double length = piece->high - piece->low, gap = 0.01 * length;
    const int count = c->count;
    int before = 0;
    double last = piece->low;
    for (int i = 0; i <= ALONG; i++) {
        const double z = piece->low + length * i / ALONG;
        const int side = side_at(piece, other, z);
        if (side * before < 0) {
            double a = last, b = z;
            for (int k = 0; k < 20; k++) {
                const double middle = 0.5 * (a + b);
                *(side_at(piece, other, middle) == before ? &a : &b) = middle;
            }
            if (b - piece->low > gap && piece->high - b > gap)
                add_cut(c, b, gap);
        }
        if (side != 0) {
            before = side;
            last = z;
        }
    }
    return c->count > count;
}

/* Replaces each piece by its parts between its cuts, at the same position of the list. */
static bool cut_all(kt_pieces *pieces, cuts *all) {
    kt_pieces made = {0};
    bool fine = true;
    for (int i = 0; i < pieces->count && fine; i++) {
        kt_piece piece = pieces->items[i];
        const double high = piece.high;
        qsort(all[i].at, (size_t)all[i].count, sizeof all[i].at[0], kt_compare_numbers);
        for (int k = 0; k <= all[i].count && fine; k++) {
            piece.high = k < all[i].count ? all[i].at[k] : high;
            fine = kt_pieces_append(&made, piece);
            piece.low = piece.high;
        }
    }
    if (!fine) {
        kt_pieces_free(&made);
        return false;
    }
    kt_pieces_free(pieces);
    *pieces = made;
    return true;
}

/* ---- all pairs --------------------------------------------------------------------------------------------------- */

/* Pieces of one solid: the piece towards the viewer comes later, unless other pieces require another order. */
static double order_in_solid(const kt_piece *a, const kt_piece *b) {
    return (a->low - b->low) * a->solid.pose.rotation.z.z;
}

static bool is_long(const kt_piece *piece, double tolerance) {
    return piece->solid.type != KT_SOLID_SPHERE && piece->high - piece->low > 4.0 * tolerance;
}

/* Half of the least of its edges or diameters. */
static double thickness_of(const kt_solid *solid) { return fmin(solid->half.x, solid->half.y); }

typedef struct edge {
    int behind, before;
    double weight; /* how far the hidden piece would show, if it were painted later; 0: dropped */
} edge;

/* A piece and its left end, for sorting. */
typedef struct beginning {
    double left;
    int piece;
} beginning;

typedef struct graph {
    shown *shown;
    cuts *cuts;
    int *waiting;
    beginning *beginnings;
    bool *is_taken;
    edge *edges;
    int edge_count;
    size_t edge_room;
    bool any_cut;
} graph;

static bool add_edge(graph *g, int behind, int before, double weight) {
    edge *more = kt_heap_grow(g->edges, (size_t)g->edge_count, 1, &g->edge_room, sizeof *more);
    if (more == NULL)
        return false;
    g->edges = more;
    g->edges[g->edge_count++] = (edge){behind, before, weight};
    return true;
}

/* Adds the edge between two pieces. If each is in front somewhere and cuts are allowed, plans to cut one of them, the
 * thinner one first. */
static bool relate_pair(graph *g, const kt_pieces *pieces, int i, int j, double tolerance, bool is_diagram,
                        bool may_cut) {
    const kt_piece *a = &pieces->items[i], *b = &pieces->items[j];
    if (a->thing == b->thing) {
        const double order = order_in_solid(a, b);
        return order == 0.0 || add_edge(g, order > 0.0 ? j : i, order > 0.0 ? i : j, DBL_MIN);
    }
    const relation r = relate_pieces(&g->shown[i], &g->shown[j], is_diagram);
    if (r.nearer <= tolerance && r.further <= tolerance)
        return true;
    const double slight = fmax(tolerance, fmin(thickness_of(&a->solid), thickness_of(&b->solid)));
    if (fmin(r.nearer, r.further) > slight && may_cut) {
        const bool first = thickness_of(&a->solid) <= thickness_of(&b->solid); /* the thinner one is tried first */
        for (int k = 0; k < 2; k++) {
            const int cut = (k == 0) == first ? i : j, other = cut == i ? j : i;
            if (is_long(&pieces->items[cut], tolerance) &&
                find_cuts(&pieces->items[cut], &g->shown[other], &g->cuts[cut])) {
                g->any_cut = true;
                break;
            }
        }
    }
    const double weight =
        fmin(r.nearer, r.further) > tolerance ? fabs(r.nearer - r.further) : fmax(r.nearer, r.further);
    return add_edge(g, r.nearer > r.further ? j : i, r.nearer > r.further ? i : j, fmax(weight, DBL_MIN));
}

static int compare_beginnings(const void *a, const void *b) {
    const beginning *p = a, *q = b;
    return p->left != q->left ? (p->left > q->left) - (p->left < q->left) : p->piece - q->piece;
}

/* Finds the edges of all pairs that overlap, from the left to the right. */
static bool relate_all(graph *g, const kt_pieces *pieces, double tolerance, bool is_diagram, bool may_cut) {
    const int n = pieces->count;
    g->edge_count = 0;
    g->any_cut = false;
    memset(g->cuts, 0, (size_t)n * sizeof *g->cuts);
    for (int i = 0; i < n; i++) {
        g->shown[i] = show_piece(&pieces->items[i]);
        g->beginnings[i] = (beginning){g->shown[i].left, i};
    }
    qsort(g->beginnings, (size_t)n, sizeof *g->beginnings, compare_beginnings);
    for (int i = 0; i < n; i++)
        for (int k = i + 1; k < n && g->beginnings[k].left < g->shown[g->beginnings[i].piece].right; k++) {
            const int a = g->beginnings[i].piece, b = g->beginnings[k].piece;
            if (!relate_pair(g, pieces, a < b ? a : b, a < b ? b : a, tolerance, is_diagram, may_cut))
                return false;
        }
    return true;
}

/* ---- sorting ----------------------------------------------------------------------------------------------------- */

static int compare_graph_edges(const void *a, const void *b) {
    return ((const edge *)a)->behind - ((const edge *)b)->behind;
}

/* The first piece that waits for no other piece; -1 if all remaining pieces belong to cycles, or wait for cycles. */
static int next_piece(const graph *g, int count) {
    for (int i = 0; i < count; i++)
        if (!g->is_taken[i] && g->waiting[i] == 0)
            return i;
    return -1;
}

/* An edge that a piece waits for. */
static int edge_before(const graph *g, int piece) {
    for (int i = 0; i < g->edge_count; i++)
        if (g->edges[i].before == piece && g->edges[i].weight > 0.0 && !g->is_taken[g->edges[i].behind])
            return i;
    return -1;
}

/* Goes backwards until a piece is met again, and once around: the lightest edge of the cycle, and the longest piece in
 * it. */
static int find_cycle(const graph *g, const kt_pieces *pieces, double tolerance, int *longest) {
    int piece = 0, lightest = -1;
    double length = 0.0;
    while (g->is_taken[piece])
        piece++;
    for (int i = 0; i < pieces->count; i++)
        piece = g->edges[edge_before(g, piece)].behind;
    *longest = -1;
    for (int start = piece, first = 1; first || piece != start; first = 0) {
        const int e = edge_before(g, piece);
        const kt_piece *p = &pieces->items[piece];
        lightest = lightest < 0 || g->edges[e].weight < g->edges[lightest].weight ? e : lightest;
        if (is_long(p, tolerance) && p->high - p->low > length) {
            length = p->high - p->low;
            *longest = piece;
        }
        piece = g->edges[e].behind;
    }
    return lightest;
}

/* The first of the edges of a piece `behind`, by bisection: edges are sorted by `behind`. */
static int first_edge(const graph *g, int behind) {
    int low = 0, high = g->edge_count;
    while (low < high) {
        const int middle = low + (high - low) / 2;
        if (g->edges[middle].behind < behind)
            low = middle + 1;
        else
            high = middle;
    }
    return low;
}

/* Opens a cycle. Returns its longest piece, to be halved. The opening requires that pieces may be cut, that the piece
 * is long enough, and that the lightest edge of the cycle weighs much. Otherwise drops that edge and returns -1. */
static int open_cycle(graph *g, const kt_pieces *pieces, double tolerance, bool may_cut) {
    int longest;
    edge *e = &g->edges[find_cycle(g, pieces, tolerance, &longest)];
    const double slight =
        0.5 * fmin(thickness_of(&pieces->items[e->behind].solid), thickness_of(&pieces->items[e->before].solid));
    if (may_cut && longest >= 0 && e->weight > fmax(slight, 4.0 * tolerance))
        return longest;
    e->weight = 0.0;
    g->waiting[e->before]--;
    return -1;
}

/* Kahn's algorithm. `order` receives all pieces. Returns -1, or a piece that is to be halved, to open a cycle. */
static int sort_graph(graph *g, const kt_pieces *pieces, double tolerance, bool may_cut, int *order) {
    if (g->edge_count > 0)
        qsort(g->edges, (size_t)g->edge_count, sizeof *g->edges, compare_graph_edges);
    memset(g->waiting, 0, (size_t)pieces->count * sizeof *g->waiting);
    memset(g->is_taken, 0, (size_t)pieces->count * sizeof *g->is_taken);
    for (int i = 0; i < g->edge_count; i++)
        g->waiting[g->edges[i].before]++;
    for (int count = 0; count < pieces->count; count++) {
        int next;
        while ((next = next_piece(g, pieces->count)) < 0) {
            const int cut = open_cycle(g, pieces, tolerance, may_cut);
            if (cut >= 0)
                return cut;
        }
        g->is_taken[next] = true;
        order[count] = next;
        for (int i = first_edge(g, next); i < g->edge_count && g->edges[i].behind == next; i++)
            g->waiting[g->edges[i].before] -= g->edges[i].weight > 0.0;
    }
    return -1;
}

/* ---- mending cuts ------------------------------------------------------------------------------------------------ */

/* Whether no piece that `which` must stay behind (is_before: in front of) is painted between two places. */
static bool place_is_free(const graph *g, const int *place, int which, bool is_before, int from, int to) {
    for (int i = 0; i < g->edge_count; i++) {
        const edge e = g->edges[i];
        const int other = is_before ? e.behind : e.before;
        if (e.weight > 0.0 && (is_before ? e.before : e.behind) == which && place[other] > from && place[other] < to)
            return false;
    }
    return true;
}

static bool is_neighbour(const kt_piece *a, const kt_piece *b) {
    return a->thing == b->thing && (a->high == b->low || b->high == a->low);
}

/* Joins the pieces with the indices i < k, if one may be painted together with the other. */
static bool join_two_pieces(graph *g, kt_pieces *pieces, int *order, int *place, int i, int k) {
    const int a = order[i], b = order[k];
    const bool at_last = place_is_free(g, place, a, false, i, k);
    if (!at_last && !place_is_free(g, place, b, true, i, k))
        return false;
    const int kept = at_last ? b : a, gone = at_last ? a : b;
    kt_piece *piece = &pieces->items[kept];
    piece->low = fmin(piece->low, pieces->items[gone].low);
    piece->high = fmax(piece->high, pieces->items[gone].high);
    for (int e = 0; e < g->edge_count; e++) {
        g->edges[e].behind = g->edges[e].behind == gone ? kept : g->edges[e].behind;
        g->edges[e].before = g->edges[e].before == gone ? kept : g->edges[e].before;
    }
    order[at_last ? i : k] = -1;
    place[gone] = -1;
    return true;
}

enum { JOINED_MOST = 2000 }; /* pieces; more are left as they are */

/* Joins pieces of one solid again that need not be separate. */
static void join_pieces(graph *g, kt_pieces *pieces, int *order) {
    int *place = g->waiting;
    bool any = pieces->count <= JOINED_MOST;
    for (int i = 0; i < pieces->count; i++)
        place[order[i]] = i;
    while (any) {
        any = false;
        for (int i = 0; i < pieces->count; i++)
            for (int k = i + 1; k < pieces->count && order[i] >= 0; k++)
                if (order[k] >= 0 && is_neighbour(&pieces->items[order[i]], &pieces->items[order[k]]))
                    any = join_two_pieces(g, pieces, order, place, i, k) || any;
    }
}

/* ---- rounds ------------------------------------------------------------------------------------------------------ */

static bool make_graph(graph *g, int count) {
    const size_t n = (size_t)count + 1;
    *g = (graph){.shown = calloc(n, sizeof *g->shown),
                 .cuts = calloc(n, sizeof *g->cuts),
                 .waiting = calloc(n, sizeof *g->waiting),
                 .beginnings = calloc(n, sizeof *g->beginnings),
                 .is_taken = calloc(n, sizeof *g->is_taken)};
    return g->shown != NULL && g->cuts != NULL && g->waiting != NULL && g->beginnings != NULL && g->is_taken != NULL;
}

static void free_graph(graph *g) {
    free(g->shown);
    free(g->cuts);
    free(g->waiting);
    free(g->beginnings);
    free(g->is_taken);
    free(g->edges);
}

/* Sorts the pieces as they are painted. A negative entry of `order` leaves a piece out. */
static bool put_in_order(kt_pieces *pieces, const int *order) {
    kt_piece *sorted = malloc((size_t)pieces->count * sizeof *sorted + 1);
    if (sorted == NULL)
        return false;
    const int count = pieces->count;
    pieces->count = 0;
    for (int i = 0; i < count; i++)
        if (order[i] >= 0)
            sorted[pieces->count++] = pieces->items[order[i]];
    free(pieces->items);
    pieces->items = sorted;
    pieces->room = (size_t)count;
    return true;
}

/* One round of sorting: returns false on failure. *done: the pieces are sorted; otherwise some have been cut. */
static bool sort_round(kt_pieces *pieces, double tolerance, bool is_diagram, int round, bool *done) {
    graph g;
    int *order = calloc((size_t)pieces->count + 1, sizeof *order);
    bool fine = make_graph(&g, pieces->count) && order != NULL &&
                relate_all(&g, pieces, tolerance, is_diagram, round < ROUNDS_MAX);
    *done = fine && !g.any_cut;
    if (*done) {
        const int cycle = sort_graph(&g, pieces, tolerance, round < ROUNDS_MAX + CYCLES_MAX, order);
        *done = cycle < 0;
        if (cycle >= 0)
            add_cut(&g.cuts[cycle], 0.5 * (pieces->items[cycle].low + pieces->items[cycle].high), 0.0);
    }
    if (*done)
        join_pieces(&g, pieces, order);
    if (fine)
        fine = *done ? put_in_order(pieces, order) : cut_all(pieces, g.cuts);
    free_graph(&g);
    free(order);
    return fine;
}

/* The first order of a diagram: the farther layer, the wider piece, the order of the list. Motions in a plane do not
 * change this order. */
typedef struct diagram_key {
    kt_piece piece;
    double layer, width;
    int index;
} diagram_key;

static int compare_diagram_keys(const void *a, const void *b) {
    const diagram_key *p = a, *q = b;
    if (p->layer == q->layer && p->width == q->width)
        return p->index - q->index;
    return p->layer != q->layer ? (p->layer > q->layer ? 1 : -1) : p->width < q->width ? 1 : -1;
}

/* Sorts the pieces of a diagram by that order. z points to the viewer, and depths are rounded to the tolerance. Returns
 * false if there is no memory. */
static bool sort_diagram(kt_pieces *pieces, double tolerance) {
    const size_t count = (size_t)pieces->count;
    diagram_key *keys = malloc(count * sizeof *keys + 1);
    if (keys == NULL)
        return false;
    for (size_t i = 0; i < count; i++) {
        const kt_piece *piece = &pieces->items[i];
        const double layer = floor(piece->solid.pose.position.z / tolerance + 0.5);
        keys[i] = (diagram_key){*piece, layer, half_width(&piece->solid), (int)i};
    }
    qsort(keys, count, sizeof *keys, compare_diagram_keys);
    for (size_t i = 0; i < count; i++)
        pieces->items[i] = keys[i].piece;
    free(keys);
    return true;
}

bool kt_pieces_sort(kt_pieces *pieces, double tolerance, bool is_diagram) {
    bool done = false;
    if (is_diagram && !sort_diagram(pieces, tolerance))
        return false;
    for (int round = 0; !done; round++)
        if (!sort_round(pieces, tolerance, is_diagram, round, &done))
            return false;
    return true;
}
