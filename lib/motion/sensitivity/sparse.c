/* Products with matrices most of whose entries are zero, as derivatives of loops' equations are. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "sensitivity/sensitivity.h"

#include <assert.h>

void KT_KERNEL(kt_sparse_apply)(const kt_sparse *a, const kt_v8 *x, kt_v8 *y) {
    assert(a->columns == 0 || x != y); /* arrays without numbers may coincide */
    for (size_t j = 0; j < a->columns; j++) {
        const double *value = a->value + j * a->rows;
        const kt_v8 by = x[j];
        for (size_t i = a->begin[j]; i < a->begin[j + 1]; i++)
            y[a->row[i]] += value[a->row[i]] * by;
    }
}
