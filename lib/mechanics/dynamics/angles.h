/* Sines and cosines of the joint angles, of one state or of all lanes (algebra/real3.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_ANGLES_H
#define KT_DYNAMICS_ANGLES_H

#include "algebra/sincos.h"
#include "model/model.h"

/* Sines and cosines of the angles `first` to `first + count` of all. */
KT_OPERATOR void kt_angles_gather(const kt_model *model, kt_data *data, const kt_real1 *q, size_t first, size_t count,
                                  kt_real1 *sine, kt_real1 *cosine) {
#ifdef KT_LANES
    (void)model;
    kt_sincos_gather((const double *)q, data->lane_angle + KT_LANES * first, KT_LANES * count, (double *)sine,
                     (double *)cosine);
#else
    (void)data;
    kt_sincos_gather(q, model->angle + first, count, sine, cosine);
#endif
}

/* Sines and cosines of the angles of links that carry forces. */
KT_OPERATOR void kt_force_angles_gather(const kt_model *model, kt_data *data, const kt_real1 *q, kt_real1 *sine,
                                        kt_real1 *cosine) {
    const size_t count = model->n.force_link_angle;
#ifdef KT_LANES
    kt_sincos_gather((const double *)q, data->lane_force_angle, KT_LANES * count, (double *)sine, (double *)cosine);
#else
    (void)data;
    kt_sincos_gather(q, model->force_link_angle, count, sine, cosine);
#endif
}

#endif
