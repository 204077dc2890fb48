/* Whether the motion of links is finite. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_DYNAMICS_EXCESS_H
#define KT_DYNAMICS_EXCESS_H

#include "model/model.h"

/* The sum of x - x over a link's motion: 0 if all of it is finite, NaN otherwise. (An offset or an angular velocity
 * that is not finite shows in the accelerations.) */
KT_INLINE kt_real3 kt_excess(const kt_link_motion *m, const kt_link_origin *at) {
    return kt_add3(kt_add3(kt_sub3(m->alpha, m->alpha), kt_sub3(m->linear, m->linear)),
                   kt_add3(kt_sub3(at->position, at->position), kt_sub3(at->velocity, at->velocity)));
}

/* Returns the first link, from `first` on, whose motion is not finite, or 0 if there is none. `sum` is the sum of the
 * excess of all links. For several states, data->sound excludes the states that are not finite. */
KT_INLINE size_t kt_first_excess(kt_data *data, kt_real3 sum, size_t first) {
#ifdef KT_LANES
    (void)first;
    data->sound &= kt_sum3(sum) == kt_real1_splat(0.0);
    return 0;
#else
    size_t failed = kt_sum3(sum) == 0.0 ? 0 : first;
    while (failed && kt_sum3(kt_excess(&data->motion[failed], &data->origin[failed])) == 0.0)
        failed++;
    return failed;
#endif
}

#endif
