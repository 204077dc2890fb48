/* Forward dynamics of trees with armature, in space and in the plane: forward.c and planar_forward.c with another
 * elimination of joints. These two are compiled by themselves, so that what has no armature is compiled as if there were
 * none.
 */
#include "dynamics/articulated.h"
#include "dynamics/dynamics.h"
#include "dynamics/planar_articulated.h"

size_t KT_KERNEL(kt_geared_forward)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                    const double *tau, const kt_wrench *external, double *a) {
    const size_t end = model->n.spatial;
    kt_articulated_motion(model, data, q, v, end);
    if (external)
        kt_external_subtract(model, data->motion, external);
    const size_t failed = kt_articulated_backward(model, data, tau, end, kt_eliminate_geared, NULL);
    if (!failed)
        kt_articulated_forward(model, data, end, kt_link_respond_geared, a);
    return failed;
}

size_t KT_KERNEL(kt_planar_geared_forward)(const kt_model *model, kt_data *data, const double *q, const double *v,
                                           const double *tau, const kt_wrench *external, double *a) {
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++)
        kt_planar_articulated_motion(model, data, &model->plane[p], q, v);
    if (external)
        kt_planar_external(model, data->planar, external);
    for (size_t p = 0; p < model->n.plane; p++) {
        const kt_plane *plane = &model->plane[p];
        const size_t failed = kt_planar_articulated_backward(model, data, plane, tau, kt_planar_eliminate_geared, NULL);
        if (failed)
            return model->n.spatial + failed - 1;
        kt_planar_articulated_forward(model, data, plane, plane->gravity, kt_planar_respond_joint, a, NULL);
    }
    return 0;
}
