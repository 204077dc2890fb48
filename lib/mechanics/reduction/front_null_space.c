/* The null space of the equations of a constraint group that is reduced by fronts (front.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reduction/front.h"

#include "linear/qr.h"
#include "reduction/front_link.h"

#include <assert.h>

/* The parameters on which no later step depends are a basis, one after the other, at unit rate. This holds because the
 * changes of parameters are orthogonal. */
void KT_KERNEL(kt_front_nullspace)(const kt_model *model, kt_data *data, size_t g, int column, double *x) {
    assert(kt_data_serve(model, data) && g < model->n.group);
    assert(column >= 0 && column < model->group[g].v_count - data->rank[g]);
    kt_front f;
    int s = 0, n = 0;
    kt_front_find(model, data, g, data->factored[g], &f);
    for (int l = 0; l < f.group->v_count; l++)
        x[model->group_v[f.group->v + l]] = 0.0;
    for (; column >= f.count[s].left - f.count[s].kept; s++)
        column -= f.count[s].left - f.count[s].kept;
    double *p = f.z;
    for (int i = 0; i < f.stride; i++)
        p[i] = 0.0;
    p[f.count[s].kept + column] = 1.0;
    for (; s >= 0; s--) {
        const kt_front_count *at = &f.count[s];
        kt_front_factor factor;
        kt_front_factor_find(&f, s, &factor);
        for (int i = n ? at->kept : at->left; i < at->left; i++)
            p[i] = 0.0;
        for (int j = at->reflectors - 1; j >= 0; j--)
            kt_front_reflect(factor.coupled + j * kt_front_padded(at->left), factor.coupled_scale[j], at->left, p);
        for (int i = at->left - 1; i >= 0; i--)
            p[at->rank + i] = p[i];
        for (int i = 0; i < at->rank; i++)
            p[i] = 0.0;
        for (int j = at->rank - 1; j >= 0; j--)
            kt_reflect(factor.rows + j * at->params, factor.scale[j], j, at->params, p);
        n = kt_front_take_coordinates(&f, s, p, x) + 1; /* from here on free parameters do not move */
    }
}
