/* Derivatives of inverse dynamics, and the mass matrix, from their terms (dynamics_derivative.h). For each degree of
 * freedom i, the computation follows the path to the root. The degrees of freedom k of the path that lie in one half of
 * a batch are combined with i at the same time, one in each lane. (Halves, because gcc compiles vectors of eight badly
 * for instruction sets that have four.)
 *     D_ik = dtau_i / dq_k = S_i . (I^C_i psi''_k + 2B^C_i psi'_k + X^C_i s_k)
 *     D_ki = dtau_k / dq_i = S_k . f_i                                             k before i's node
 *     M_ik = S_k . I^C_i S_i, and the armature on the diagonal
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics_derivative.h"
#include "dynamics/sweep.h"

enum { HALF = KT_LANES / 2 };

/* The entries for degree of freedom i and half a batch, k in each lane; by_q, by_v: D_ik, D_ki. */
typedef struct pairs {
    kt_v4 by_q[2], by_v[2], mass;
} pairs;

KT_INLINE kt_v4 half_of(const kt_v8 *x, size_t half) {
    kt_v4 v;
    memcpy(&v, (const double *)x + half * HALF, sizeof v);
    return v;
}

/* x . y for each lane of a half; n numbers, `stride` apart in x. */
KT_INLINE kt_v4 dots(const double *x, size_t stride, const kt_v8 *y, size_t half, size_t n) {
    kt_v4 sum = kt_v4_splat(x[0]) * half_of(&y[0], half);
    for (size_t k = 1; k < n; k++)
        sum += kt_v4_splat(x[k * stride]) * half_of(&y[k], half);
    return sum;
}

/* Computes D_ik, D_ki and M_ik for the degrees of freedom k of a half batch. Without external wrenches (`loaded`), X is
 * zero. */
KT_INLINE void combine(const kt_derivative_work *w, size_t i, size_t half, bool loaded, pairs *out) {
    const kt_dof_row *row = &w->row[i];
    const kt_dof_batch *own = &w->batch[i / KT_LANES], *c = &w->batch[half / 2];
    const double *wrench[2] = {(const double *)own->wrench[0] + i % KT_LANES,
                               (const double *)own->wrench[1] + i % KT_LANES};
    half %= 2;
    out->by_q[0] = dots(row->u, 1, c->rate, half, 6) + dots(row->b, 1, c->psi, half, 3);
    if (loaded)
        out->by_q[0] += dots(row->x, 1, c->s, half, 3);
    out->by_v[0] = dots(row->u, 1, c->phi, half, 6) + dots(row->b, 1, c->s, half, 3);
    out->by_q[1] = dots(wrench[0], KT_LANES, c->s, half, 6);
    out->by_v[1] = dots(wrench[1], KT_LANES, c->s, half, 6);
    out->mass = dots(row->u, 1, c->s, half, 6);
}

/* Stores the entries (i, k) and (k, i) of a lane. If k is in i's node (`same`), row k stores the entry (k, i) of D
 * itself. */
KT_INLINE void store(size_t ik, size_t ki, const pairs *x, size_t lane, bool same, double *by_q, double *by_v,
                     double *mass) {
    by_q[ik] = x->by_q[0][lane];
    by_v[ik] = x->by_v[0][lane];
    mass[ik] = mass[ki] = x->mass[lane];
    if (same)
        return;
    by_q[ki] = x->by_q[1][lane];
    by_v[ki] = x->by_v[1][lane];
}

/* The entries of i and all degrees of freedom of its path, from the last degree of freedom of i's node on. */
KT_INLINE void follow_path(size_t nv, size_t i, bool loaded, kt_derivative_work *w) {
    double *by_q = (double *)w->dq, *by_v = (double *)w->dv, *mass = (double *)w->dtau;
    const kt_derivative_node *node = &w->node[w->row[i].node];
    const size_t own = (size_t)w->row[i].v;
    size_t half = SIZE_MAX;
    pairs x;
    for (int32_t k = node->first + node->count - 1; k >= 0; k = w->row[k].before) {
        const size_t other = (size_t)w->row[k].v;
        if ((size_t)k / HALF != half) {
            half = (size_t)k / HALF;
            combine(w, i, half, loaded, &x);
        }
        store(other * nv + own, own * nv + other, &x, (size_t)k % HALF, k >= node->first, by_q, by_v, mass);
    }
}

void KT_KERNEL(kt_derivative_inverse)(const kt_model *model, bool loaded, kt_derivative_work *w) {
    const size_t nv = model->n.v, bytes = nv * nv * sizeof(double);
    memset(w->dq, 0, bytes);
    memset(w->dv, 0, bytes);
    memset(w->dtau, 0, bytes);
    for (size_t i = 0; i < nv; i++)
        follow_path(nv, i, loaded, w);
    for (size_t i = 0; i < nv; i++)
        ((double *)w->dtau)[i * nv + i] += model->armature[i];
}
