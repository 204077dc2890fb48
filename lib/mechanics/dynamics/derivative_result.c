/* From strips of columns, in the order of the links, to matrices in the order of the coordinates. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/dynamics_derivative.h"

KT_INLINE void copy_number(const kt_derivative_work *w, size_t nv, size_t i, size_t k, const kt_v8 *from, double *to) {
    to[(size_t)w->row[k].v * nv + (size_t)w->row[i].v] = from[k / KT_LANES * nv + i][k % KT_LANES];
}

/* Four rows of four columns, transposed. */
KT_INLINE void copy_tile(size_t nv, size_t i, size_t k, const kt_v8 *from, double *to) {
    const double *x = (const double *)&from[k / KT_LANES * nv + i] + k % KT_LANES;
    const kt_v4 a = kt_v4_load(x), b = kt_v4_load(x + KT_LANES), c = kt_v4_load(x + 2 * KT_LANES),
                d = kt_v4_load(x + 3 * KT_LANES);
    const kt_v4 ab = __builtin_shufflevector(a, b, 0, 4, 2, 6), ba = __builtin_shufflevector(a, b, 1, 5, 3, 7);
    const kt_v4 cd = __builtin_shufflevector(c, d, 0, 4, 2, 6), dc = __builtin_shufflevector(c, d, 1, 5, 3, 7);
    const kt_v4 column[4] = {__builtin_shufflevector(ab, cd, 0, 1, 4, 5), __builtin_shufflevector(ba, dc, 0, 1, 4, 5),
                             __builtin_shufflevector(ab, cd, 2, 3, 6, 7), __builtin_shufflevector(ba, dc, 2, 3, 6, 7)};
    memcpy(to + k * nv + i, &column[0], sizeof a);
    memcpy(to + (k + 1) * nv + i, &column[1], sizeof a);
    memcpy(to + (k + 2) * nv + i, &column[2], sizeof a);
    memcpy(to + (k + 3) * nv + i, &column[3], sizeof a);
}

void KT_KERNEL(kt_derivative_hand_over)(const kt_model *model, const kt_derivative_work *w, const kt_v8 *from,
                                        double *to) {
    const size_t nv = model->n.v;
    size_t whole = 0; /* in tiles */
    while (whole < nv && (size_t)w->row[whole].v == whole)
        whole++;
    whole = whole == nv ? nv / 4 * 4 : 0;
    for (size_t k = 0; k < whole; k += 4)
        for (size_t i = 0; i < whole; i += 4)
            copy_tile(nv, i, k, from, to);
    for (size_t k = 0; k < nv; k++)
        for (size_t i = k < whole ? whole : 0; i < nv; i++)
            copy_number(w, nv, i, k, from, to);
}
