/* Derivatives of forward dynamics from their terms (dynamics_derivative.h), a strip of columns at a time. A backward
 * pass carries the columns' wrenches to the root, a forward pass carries accelerations back. A strip is as wide as the
 * registers of the instruction set. Its numbers stay in registers, and pass through memory only where the tree
 * branches.
 *
 * The columns of a strip are neighbours in depth-first order. Therefore the nodes before all columns are the support of
 * the first column: its path to the root. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics_derivative.h"
#include "dynamics/sweep.h"

#if defined(__AVX512F__)
enum { WIDTH = 8 };
#else
enum { WIDTH = 4 };
#endif
typedef double strip __attribute__((vector_size(8 * WIDTH)));
typedef int64_t bits __attribute__((vector_size(8 * WIDTH)));

/* Which derivatives: with respect to q, to v, both, to tau; with external wrenches or without. Constants at
 * compilation. */
typedef struct kind {
    bool q, v, unit, loaded;
} kind;

typedef struct flow {
    strip q[6], v[6], psi[3], s[3];
} flow;

typedef struct columns {
    kt_derivative_work *w;
    size_t nv, batch, lane; /* of the strip's first column */
    size_t low, high;       /* its nodes, first and last */
} columns;

#if defined(__AVX512F__)
KT_INLINE strip splat(double x) { return (strip){x, x, x, x, x, x, x, x}; }
#else
KT_INLINE strip splat(double x) { return (strip){x, x, x, x}; }
#endif

KT_INLINE strip load(const void *x, size_t lane) {
    strip v;
    memcpy(&v, (const double *)x + lane, sizeof v);
    return v;
}

KT_INLINE strip dot6(const double *x, const strip *y) {
    const strip a = splat(x[0]) * y[0] + splat(x[1]) * y[1], b = splat(x[2]) * y[2] + splat(x[3]) * y[3];
    return (a + b) + (splat(x[4]) * y[4] + splat(x[5]) * y[5]);
}

KT_INLINE strip dot3(const double *x, const strip *y) {
    return splat(x[0]) * y[0] + splat(x[1]) * y[1] + splat(x[2]) * y[2];
}

/* Writes out loops over six registers. Not every compiler unrolls such loops, and otherwise the registers go to
 * memory. */
#define SIX(statement)                                                                                                 \
    do {                                                                                                               \
        statement(0);                                                                                                  \
        statement(1);                                                                                                  \
        statement(2);                                                                                                  \
        statement(3);                                                                                                  \
        statement(4);                                                                                                  \
        statement(5);                                                                                                  \
    } while (0)

/* y += x a, y -= x a */
KT_INLINE void add6(const double *x, strip a, strip *y) {
#define ADD(k) y[k] += splat(x[k]) * a
    SIX(ADD);
#undef ADD
}

KT_INLINE void subtract6(const double *x, strip a, strip *y) {
#define SUBTRACT(k) y[k] -= splat(x[k]) * a
    SIX(SUBTRACT);
#undef SUBTRACT
}

KT_INLINE void clear6(strip *x) {
#define CLEAR(k) x[k] = splat(0.0)
    SIX(CLEAR);
#undef CLEAR
}

KT_INLINE void clear3(strip *x) { x[0] = x[1] = x[2] = splat(0.0); }

KT_INLINE double *result(const columns *p, kt_v8 *matrix, size_t f) {
    return (double *)&matrix[p->batch * p->nv + f] + p->lane;
}

/* The lanes whose columns belong to node n. */
KT_INLINE bits lanes_of(const columns *p, size_t n) {
    bits node;
    memcpy(&node, p->w->batch[p->batch].node + p->lane, sizeof node);
    return node == (int64_t)n;
}

/* Adds the columns of these lanes. */
KT_INLINE void add_columns3(const columns *p, bits mine, strip *to, const kt_v8 *from) {
    to[0] += (strip)((bits)load(&from[0], p->lane) & mine);
    to[1] += (strip)((bits)load(&from[1], p->lane) & mine);
    to[2] += (strip)((bits)load(&from[2], p->lane) & mine);
}

KT_INLINE void add_columns6(const columns *p, bits mine, strip *to, const kt_v8 *from) {
    add_columns3(p, mine, to, from);
    add_columns3(p, mine, to + 3, from + 3);
}

/* Sets the results of the coordinates from .. to - 1 to zero. */
static inline void clear_rows(const columns *p, kind is, size_t from, size_t to) {
    const strip none = splat(0.0);
    for (size_t f = from; f < to; f++) {
        if (is.q || is.unit)
            memcpy(result(p, is.unit ? p->w->dtau : p->w->dq, f), &none, sizeof none);
        if (is.v)
            memcpy(result(p, p->w->dv, f), &none, sizeof none);
    }
}

/* ---- towards the root -------------------------------------------------------------------------------------------- */

/* y = -d S . f, f += U y */
KT_INLINE void project_wrench(const kt_dof_row *row, strip *f, double *y) {
    const strip force = dot6(row->s, f), out = splat(-row->d) * force;
    memcpy(y, &out, sizeof out);
    subtract6(row->u, force, f);
}

/* A unit joint force applied at degree of freedom f. */
KT_INLINE void apply_unit(const columns *p, size_t f, const kt_dof_row *row, strip *x, double *y) {
    const size_t lane = f - p->batch * KT_LANES - p->lane;
    if (lane >= WIDTH)
        return;
    y[lane] += row->d;
    for (int k = 0; k < 6; k++)
        x[k][lane] += row->u[k];
}

/* Backward pass at one node: projects the wrenches x on its degrees of freedom, the last one first, and stores the
 * results. A node at or behind p->low also adds its own terms to the wrenches. */
KT_INLINE void eliminate(const columns *p, kind is, size_t n, flow *x) {
    kt_derivative_work *w = p->w;
    const kt_derivative_node *node = &w->node[n];
    for (int32_t k = node->count - 1; k >= 0; k--) {
        const size_t f = (size_t)node->first + (size_t)k;
        const kt_dof_row *row = &w->row[f];
        if (is.q)
            project_wrench(row, x->q, result(p, w->dq, f));
        if (is.v)
            project_wrench(row, x->v, result(p, w->dv, f));
        if (is.unit) {
            project_wrench(row, x->q, result(p, w->dtau, f));
            apply_unit(p, f, row, x->q, result(p, w->dtau, f));
        }
    }
    if (n < p->low)
        return;
    const bits mine = lanes_of(p, n);
    if (is.q)
        add_columns6(p, mine, x->q, w->batch[p->batch].wrench[0]);
    if (is.v)
        add_columns6(p, mine, x->v, w->batch[p->batch].wrench[1]);
}

/* Sets the wrenches and motions that are requested to zero. */
KT_INLINE void clear(kind is, flow *x) {
    if (is.q || is.unit)
        clear6(x->q);
    if (is.v)
        clear6(x->v);
    if (is.q)
        clear3(x->psi);
    if (is.v || is.loaded)
        clear3(x->s);
}

/* A strip passes through memory where a node is not next to its parent. */
KT_INLINE void store(strip x, void *to) { memcpy(to, &x, sizeof x); }

KT_INLINE void store3(const strip *x, kt_v8 *to) {
    store(x[0], &to[0]);
    store(x[1], &to[1]);
    store(x[2], &to[2]);
}

KT_INLINE void load3(const kt_v8 *from, strip *x) {
    x[0] = load(&from[0], 0);
    x[1] = load(&from[1], 0);
    x[2] = load(&from[2], 0);
}

/* Stores what passes from one node to the next, for the branches that begin there. */
KT_INLINE void store_state(kind is, const flow *x, kt_derivative_state *to) {
    if (is.q || is.unit) {
        store3(x->q, to->q);
        store3(x->q + 3, to->q + 3);
    }
    if (is.v) {
        store3(x->v, to->v);
        store3(x->v + 3, to->v + 3);
    }
    if (is.q)
        store3(x->psi, to->psi);
    if (is.v || is.loaded)
        store3(x->s, to->s);
}

/* Loads what store_state has stored. */
KT_INLINE void load_state(kind is, const kt_derivative_state *from, flow *x) {
    if (is.q || is.unit) {
        load3(from->q, x->q);
        load3(from->q + 3, x->q + 3);
    }
    if (is.v) {
        load3(from->v, x->v);
        load3(from->v + 3, x->v + 3);
    }
    if (is.q)
        load3(from->psi, x->psi);
    if (is.v || is.loaded)
        load3(from->s, x->s);
}

/* Adds the wrenches of another branch to x. */
KT_INLINE void add_state(kind is, const kt_derivative_state *from, flow *x) {
    flow more;
    load_state(is, from, &more);
#define GATHER(k) x->q[k] += more.q[k]
    if (is.q || is.unit)
        SIX(GATHER);
#undef GATHER
#define GATHER(k) x->v[k] += more.v[k]
    if (is.v)
        SIX(GATHER);
#undef GATHER
}

/* Sets the sums over children to zero, for the nodes of the columns and for all nodes on the path to the root. */
static inline void clear_branches(const columns *p) {
    kt_derivative_work *w = p->w;
    for (size_t n = p->high; n > p->low; n--)
        if (w->node[n].branches)
            memset(&w->state[n], 0, sizeof w->state[n]);
    for (size_t n = p->low; n; n = (size_t)w->node[n].parent)
        if (w->node[n].branches)
            memset(&w->state[n], 0, sizeof w->state[n]);
}

/* Returns the root of the strip's first column. */
KT_INLINE size_t backward_pass(const columns *p, kind is) {
    kt_derivative_work *w = p->w;
    flow x;
    clear(is, &x);
    if (w->branched)
        clear_branches(p);
    for (size_t n = p->high;;) {
        const kt_derivative_node *node = &w->node[n];
        const size_t parent = (size_t)node->parent, next = n > p->low ? n - 1 : parent;
        if (node->branches)
            add_state(is, &w->state[n], &x);
        eliminate(p, is, n, &x);
        if (!next)
            return n;
        if (parent != next) {
            if (parent) {
                add_state(is, &w->state[parent], &x);
                store_state(is, &x, &w->state[parent]);
            }
            clear(is, &x);
        } else if (n <= p->low) {
            clear_rows(p, is, (size_t)w->node[parent].first + (size_t)w->node[parent].count, (size_t)node->first);
        }
        n = next;
    }
}

/* ---- from the root ----------------------------------------------------------------------------------------------- */

/* a = y - d U . A - b . psi - x . s, A += S a; if `after`, y is zero. */
KT_INLINE void respond(const kt_dof_row *row, bool after, strip *x, const strip *psi, const strip *s, double *to,
                       strip *excess) {
    strip a = splat(0.0) - dot6(row->u, x); /* not -0 for zero, at any width */
    if (!after)
        a += load(to, 0);
    if (psi)
        a -= dot3(row->b, psi);
    if (s)
        a -= dot3(row->x, s);
    memcpy(to, &a, sizeof a);
    *excess += a - a;
    add6(row->s, a, x);
}

/* One node: before the strip's own nodes, among them, or after them. */
KT_INLINE void accelerate(const columns *p, kind is, bool before, bool after, size_t n, flow *x, strip *excess) {
    kt_derivative_work *w = p->w;
    const kt_derivative_node *node = &w->node[n];
    if (!node->parent)
        clear(is, x);
    else if ((size_t)node->parent != n - 1)
        load_state(is, &w->state[node->parent], x);
    if (!before && !after && !is.unit) {
        const kt_dof_batch *b = &w->batch[p->batch];
        const bits mine = lanes_of(p, n);
        if (is.q) {
            add_columns6(p, mine, x->q, b->rate);
            add_columns3(p, mine, x->psi, b->psi);
        }
        if (is.v)
            add_columns6(p, mine, x->v, b->phi);
        if (is.v || is.loaded)
            add_columns3(p, mine, x->s, b->s);
    }
    for (int32_t k = 0; k < node->count; k++) {
        const size_t f = (size_t)node->first + (size_t)k;
        const kt_dof_row *row = &w->row[f];
        if (is.q)
            respond(row, after, x->q, before ? NULL : x->psi, before || !is.loaded ? NULL : x->s, result(p, w->dq, f),
                    excess);
        if (is.v)
            respond(row, after, x->v, before ? NULL : x->s, NULL, result(p, w->dv, f), excess);
        if (is.unit)
            respond(row, after, x->q, NULL, NULL, result(p, w->dtau, f), excess);
    }
    if (node->branches)
        store_state(is, x, &w->state[n]);
}

/* Accelerations of all nodes of the tree of `root`. Nodes before the strip's own have no terms psi' and s, and nodes
 * after them have y = 0. Returns the first node of the next tree. *excess stays zero if all results are finite. */
KT_INLINE size_t forward_pass(const columns *p, kind is, size_t root, strip *excess) {
    const kt_derivative_work *w = p->w;
    flow x;
    size_t n = root;
    clear(is, &x);
    for (; n < p->low; n++)
        accelerate(p, is, true, false, n, &x, excess);
    for (; n <= p->high; n++)
        accelerate(p, is, false, false, n, &x, excess);
    for (; n < w->nodes && w->node[n].parent; n++)
        accelerate(p, is, false, true, n, &x, excess);
    return n;
}

/* Computes all strips; returns whether all results are finite. */
KT_INLINE bool sweep(const kt_model *model, kind is, kt_derivative_work *w) {
    const size_t nv = model->n.v;
    strip excess = splat(0.0);
    for (size_t first = 0; first < nv; first += WIDTH) {
        const size_t last = first + WIDTH < nv ? first + WIDTH : nv;
        const columns p = {.w = w,
                           .nv = nv,
                           .batch = first / KT_LANES,
                           .lane = first % KT_LANES,
                           .low = (size_t)w->row[first].node,
                           .high = (size_t)w->row[last - 1].node};
        const size_t root = backward_pass(&p, is), end = forward_pass(&p, is, root, &excess);
        clear_rows(&p, is, 0, (size_t)w->node[root].first);
        clear_rows(&p, is, end < w->nodes ? (size_t)w->node[end].first : nv, nv);
    }
    double sum = 0.0;
    for (int k = 0; k < WIDTH; k++)
        sum += excess[k];
    return sum == 0.0;
}

static bool sweep_q(const kt_model *model, bool loaded, kt_derivative_work *w) {
    return loaded ? sweep(model, (kind){.q = true, .loaded = true}, w) : sweep(model, (kind){.q = true}, w);
}

/* With registers of eight lanes, one sweep serves q and v. With external wrenches, or in narrower registers, each has a
 * sweep of its own. */
bool KT_KERNEL(kt_derivative_forward)(const kt_model *model, bool unit, bool loaded, kt_derivative_work *w) {
    bool fine = true;
    if (WIDTH == 8 && !loaded)
        fine = sweep(model, (kind){.q = true, .v = true}, w);
    else
        fine = sweep_q(model, loaded, w) && sweep(model, (kind){.v = true}, w);
    return fine && (!unit || sweep(model, (kind){.unit = true}, w));
}
