/* Forward dynamics of planar trees: the recursion of aba_planar.h, in which each joint is eliminated by itself.
 */
#include "dynamics/aba_planar.h"
#include "dynamics/dynamics.h"

size_t KT_KERNEL(kt_planar_forward)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                    const kt_real1 *tau, const kt_external *external, kt_real1 *a) {
    kt_planar_gather(model, data, q);
    for (size_t p = 0; p < model->n.plane; p++)
        kt_planar_articulated_motion(model, data, &model->plane[p], q, v);
    if (external)
        kt_planar_external(model, data->planar, external);
    for (size_t p = 0; p < model->n.plane; p++) {
        const kt_plane *plane = &model->plane[p];
        const size_t failed = kt_planar_articulated_backward(model, data, plane, tau, kt_planar_eliminate_joint, data);
        if (failed)
            return model->n.spatial + failed - 1;
        kt_planar_articulated_forward(model, data, plane, plane->gravity, kt_planar_respond_joint, a, NULL);
    }
    return 0;
}
