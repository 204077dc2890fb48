/* Forward dynamics of trees in space: the recursion of aba.h, in which each joint is eliminated by itself. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba.h"
#include "dynamics/dynamics.h"

#include <assert.h>

size_t KT_KERNEL(kt_forward)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                             const kt_real1 *tau, const kt_external *external, kt_real1 *a) {
    assert(kt_data_serve(model, data));
    const size_t end = model->n.spatial;
    kt_articulated_motion(model, data, q, v, end);
    if (external)
        kt_external_set(model, data, external);
    const size_t failed = kt_articulated_backward(model, data, tau, end, kt_eliminate_joint, NULL);
    if (!failed)
        kt_articulated_forward(model, data, end, kt_link_respond, a);
    return failed;
}
