/* The choice between dense factors of the loops' equations and factors along the tree. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "derivative/dense_or_tree.h"

#include "constraint/group.h"
#include "kinetree/mechanism.h"
#include "reduction/method.h"

/* From this number of coordinates on, dense factors take longer than fronts. Dense factors also take longer than groups
 * with few coordinates each (rows of windows, ropes). */
enum { COORDINATES_FEW = 28 };

bool kt_linearized_is_dense(const kt_model *model) {
    if (!model->n.row)
        return false;
    if (!model->n.group || !model->reduction->fronts || model->structure == KT_STRUCTURE_DENSE)
        return true;
    bool dense = model->n.v < COORDINATES_FEW;
    for (size_t g = 0; g < model->n.group; g++)
        dense = dense || (!model->group[g].has_fronts && 2 * (size_t)model->group[g].v_count > model->n.v);
    return dense && model->structure != KT_STRUCTURE_FRONTS;
}

/* Above this number of products, dense factors take longer than factors along the tree. A column takes longer along the
 * tree. */
#define PRODUCTS_FEW 5e4

bool kt_mass_inverse_is_along(const kt_model *model) {
    if (!model->n.group || kt_linearized_is_dense(model))
        return false;
    const double n = (double)model->n.v, dofs = kt_model_mobility(model).minimal;
    return model->structure == KT_STRUCTURE_FRONTS || n * n * (dofs + 4.0) > PRODUCTS_FEW;
}
