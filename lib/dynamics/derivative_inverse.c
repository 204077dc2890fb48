/* Derivatives of inverse dynamics from their terms (derivative.h): for each degree of freedom, along its path to the
 * root. */
#include "dynamics/derivative.h"
#include "dynamics/sweep.h"

KT_INLINE double dot6(const double *x, const kt_v8 *y, size_t lane) {
    double sum = 0.0;
    for (int k = 0; k < 6; k++)
        sum += x[k] * y[k][lane];
    return sum;
}

KT_INLINE double dot3(const double *x, const kt_v8 *y, size_t lane) {
    return x[0] * y[0][lane] + x[1] * y[1][lane] + x[2] * y[2][lane];
}

/* Sets the entry of row i and column k, and if k is not in the same node, the entry of row k and column i. */
static inline void set_pair(size_t nv, size_t i, size_t k, bool same, kt_derivative_work *w) {
    const kt_dof_row *row = &w->row[i], *other = &w->row[k];
    const size_t bi = i / KT_LANES, li = i % KT_LANES, bk = k / KT_LANES, lk = k % KT_LANES;
    const kt_dof_batch *c = &w->batch[bk], *own = &w->batch[bi];
    w->dq[bk * nv + i][lk] = dot6(row->u, c->rate, lk) + dot3(row->b, c->psi, lk) + dot3(row->x, c->s, lk);
    w->dv[bk * nv + i][lk] = dot6(row->u, c->phi, lk) + dot3(row->b, c->s, lk);
    if (same)
        return;
    w->dq[bi * nv + k][li] = dot6(other->s, own->wrench[0], li);
    w->dv[bi * nv + k][li] = dot6(other->s, own->wrench[1], li);
}

void KT_KERNEL(kt_derivative_inverse)(const kt_model *model, kt_derivative_work *w) {
    const size_t nv = model->n.v;
    memset(w->dq, 0, kt_batches(&model->n) * nv * sizeof *w->dq);
    memset(w->dv, 0, kt_batches(&model->n) * nv * sizeof *w->dv);
    for (size_t i = 0; i < nv; i++)
        for (int32_t n = w->row[i].node; n; n = w->node[n].parent)
            for (int32_t k = 0; k < w->node[n].count; k++)
                set_pair(nv, i, (size_t)w->node[n].first + (size_t)k, n == w->row[i].node, w);
}
