/* Forward dynamics of planar trees: the recursion of aba_planar.h, in which each joint is eliminated by itself.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "dynamics/aba_planar.h"
#include "dynamics/dynamics.h"

#include <assert.h>

size_t KT_KERNEL(kt_planar_forward)(const kt_model *model, kt_data *data, const kt_real1 *q, const kt_real1 *v,
                                    const kt_real1 *tau, const kt_external *external, kt_real1 *a) {
    assert(kt_data_serve(model, data));
    kt_planar_articulated_motion(model, data, q, v, external);
    return kt_planar_articulated_solve(model, data, tau, kt_planar_eliminate_joint, NULL, a);
}
