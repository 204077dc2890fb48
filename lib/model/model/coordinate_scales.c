/* The size of a large change of each coordinate. The size is the scale that separates small changes from rounding. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "model/model.h"

#include <math.h>

/* The first joints of the tree may be far from the origin of the world. The distances of these joints are left out,
 * since they do not depend on the size of the mechanism. */
double kt_model_extent(const kt_model *model) {
    double extent = 0.0;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        if (link->mass > 0.0)
            extent = fmax(extent, kt_vec3_norm(link->moment) / link->mass);
        if (link->parent > 0)
            extent = fmax(extent, kt_vec3_norm(link->at));
    }
    if (!(extent > 0.0) && model->n.group)
        extent = model->length;
    return extent > 0.0 ? extent : 1.0;
}

void kt_model_units(const kt_model *model, double *unit) {
    const double extent = kt_model_extent(model);
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        for (int k = 0; k < kt_link_dofs(link); k++)
            unit[link->v + k] = k < kt_link_lengths(link) ? extent : 1.0;
    }
}
