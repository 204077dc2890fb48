/* Derivatives of forward dynamics from their terms (derivative.h), eight columns at a time: what they push goes to the
 * root, the accelerations come back. */
#include "dynamics/derivative.h"
#include "dynamics/sweep.h"

KT_INLINE kt_v8 splat(double x) { return (kt_v8){x, x, x, x, x, x, x, x}; }

KT_INLINE kt_v8 dot6(const double *x, const kt_v8 *y) {
    const kt_v8 a = splat(x[0]) * y[0] + splat(x[1]) * y[1], b = splat(x[2]) * y[2] + splat(x[3]) * y[3];
    return (a + b) + (splat(x[4]) * y[4] + splat(x[5]) * y[5]);
}

KT_INLINE kt_v8 dot3(const double *x, const kt_v8 *y) {
    return splat(x[0]) * y[0] + splat(x[1]) * y[1] + splat(x[2]) * y[2];
}

/* y += x s */
KT_INLINE void add6(const double *x, kt_v8 s, kt_v8 *y) {
    for (int k = 0; k < 6; k++)
        y[k] += splat(x[k]) * s;
}

/* The columns of a batch that belong to a node: lanes from first to last. */
typedef struct lanes {
    size_t first, last;
} lanes;

KT_INLINE lanes lanes_of(const kt_node *node, size_t batch, size_t nv) {
    const size_t low = batch * KT_LANES, high = low + KT_LANES < nv ? low + KT_LANES : nv;
    const size_t first = (size_t)node->first, last = first + (size_t)node->count;
    const size_t a = first > low ? first : low, b = last < high ? last : high;
    return a < b ? (lanes){a - low, b - low} : (lanes){0, 0};
}

KT_INLINE void enter(kt_v8 *to, const kt_v8 *from, int count, lanes l) {
    for (int k = 0; k < count; k++)
        for (size_t i = l.first; i < l.last; i++)
            to[k][i] += from[k][i];
}

/* Towards the root: y into the rows; what is pushed from node to node stands in its state. */
static inline void push_node(const kt_model *model, size_t n, size_t b, bool unit, kt_derivative_work *w) {
    const kt_node *node = &w->node[n];
    const size_t nv = model->n.v;
    kt_derivative_state *x = &w->state[n], *up = &w->state[node->parent];
    const lanes l = lanes_of(node, b, nv);
    for (int32_t k = node->count - 1; k >= 0; k--) {
        const size_t f = (size_t)(node->first + k);
        const kt_freedom_row *row = &w->row[f];
        const kt_v8 q = dot6(row->s, x->q);
        add6(row->u, -q, x->q);
        if (unit) {
            kt_v8 *y = &w->dtau[b * nv + f];
            *y = splat(-row->d) * q;
            if (f / KT_LANES == b) {
                (*y)[f % KT_LANES] += row->d;
                for (int c = 0; c < 6; c++)
                    x->q[c][f % KT_LANES] += row->u[c];
            }
        } else {
            const kt_v8 v = dot6(row->s, x->v);
            add6(row->u, -v, x->v);
            w->dq[b * nv + f] = splat(-row->d) * q;
            w->dv[b * nv + f] = splat(-row->d) * v;
        }
    }
    if (!unit) {
        enter(x->q, w->batch[b].pushed[0], 6, l);
        enter(x->v, w->batch[b].pushed[1], 6, l);
    }
    for (int k = 0; k < 6 && node->parent; k++) {
        up->q[k] += x->q[k];
        if (!unit)
            up->v[k] += x->v[k];
    }
}

static inline void way_back(const kt_model *model, size_t b, size_t low, size_t high, bool unit,
                            kt_derivative_work *w) {
    for (size_t n = w->node[low].parent > 0 ? (size_t)w->node[low].parent : 0; n; n = (size_t)w->node[n].parent)
        w->state[n] = (kt_derivative_state){0};
    memset(&w->state[low], 0, (high + 1 - low) * sizeof *w->state);
    for (size_t n = high; n > low; n--)
        push_node(model, n, b, unit, w);
    for (size_t n = low; n; n = (size_t)w->node[n].parent)
        push_node(model, n, b, unit, w);
}

/* From the root: accelerations into the rows. */
static inline void move_node(const kt_model *model, size_t n, size_t b, bool unit, bool loaded, kt_derivative_work *w) {
    const kt_node *node = &w->node[n];
    const size_t nv = model->n.v;
    kt_derivative_state x = {0};
    if (node->parent)
        x = w->state[node->parent];
    if (!unit) {
        const lanes l = lanes_of(node, b, nv);
        const kt_freedom_batch *c = &w->batch[b];
        enter(x.q, c->rate, 6, l);
        enter(x.v, c->phi, 6, l);
        enter(x.psi, c->psi, 3, l);
        enter(x.s, c->s, 3, l);
    }
    for (int32_t k = 0; k < node->count; k++) {
        const size_t f = (size_t)(node->first + k);
        const kt_freedom_row *row = &w->row[f];
        kt_v8 *q = unit ? &w->dtau[b * nv + f] : &w->dq[b * nv + f], *v = &w->dv[b * nv + f];
        *q -= dot6(row->u, x.q);
        if (!unit) {
            *v -= dot6(row->u, x.v) + dot3(row->b, x.s);
            *q -= dot3(row->b, x.psi);
            if (loaded)
                *q -= dot3(row->x, x.s);
            add6(row->s, *v, x.v);
        }
        add6(row->s, *q, x.q);
    }
    w->state[n] = x;
}

static inline void sweep(const kt_model *model, bool unit, bool loaded, kt_derivative_work *w) {
    const size_t nv = model->n.v;
    memset(unit ? w->dtau : w->dq, 0, kt_batches(&model->n) * nv * sizeof *w->dq);
    if (!unit)
        memset(w->dv, 0, kt_batches(&model->n) * nv * sizeof *w->dv);
    for (size_t b = 0; b < kt_batches(&model->n); b++) {
        const size_t last = (b + 1) * KT_LANES < nv ? (b + 1) * KT_LANES : nv;
        const size_t low = (size_t)w->row[b * KT_LANES].node, high = (size_t)w->row[last - 1].node;
        size_t root = low;
        while (w->node[root].parent)
            root = (size_t)w->node[root].parent;
        way_back(model, b, low, high, unit, w);
        for (size_t n = root; n < w->nodes && (n <= high || w->node[n].parent); n++)
            move_node(model, n, b, unit, loaded, w);
    }
}

void KT_KERNEL(kt_derivative_forward)(const kt_model *model, bool unit, bool loaded, kt_derivative_work *w) {
    sweep(model, unit, loaded, w);
}
