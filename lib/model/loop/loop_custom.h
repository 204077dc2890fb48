/* The motion that the callback of a caller's own loop sees. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LOOP_LOOP_CUSTOM_H
#define KT_LOOP_LOOP_CUSTOM_H

#include "kinetree/loop.h"
#include "loop/relative_motion.h"

#include <math.h>
#include <string.h>

/* NaNs that carry the code that a callback has returned: the lower half of the NaN has the code, the upper half a mark.
 * Copies keep these bits. */
#define KT_CUSTOM_MARK 0x7ff84b54U
static inline double kt_custom_stop(int code) {
    const uint64_t bits = (uint64_t)KT_CUSTOM_MARK << 32 | (uint32_t)code;
    double x;
    memcpy(&x, &bits, sizeof x);
    return x;
}
/* Whether a callback has returned a negative number, and which. */
static inline bool kt_custom_stopped(double rate, int *code) {
    uint64_t bits;
    if (!isnan(rate))
        return false;
    memcpy(&bits, &rate, sizeof bits);
    *code = (int)(int32_t)(uint32_t)bits;
    return bits >> 32 == KT_CUSTOM_MARK && *code < 0;
}

KT_INLINE kt_vec3 kt_value_of(kt_vector a) {
    return kt_vec3_make(kt_value(kt_component(a, 0)), kt_value(kt_component(a, 1)), kt_value(kt_component(a, 2)));
}

/* The second end's motion in the axes e of the first. */
typedef struct kt_custom_motion {
    kt_vector d, axes[3], u, w;
} kt_custom_motion;

KT_INLINE kt_custom_motion kt_custom_motion_of(const kt_loop_end end[2], const kt_loop_relative *r) {
    const kt_vector *e = end[0].axes;
    return (kt_custom_motion){.d = kt_apply_transposed(e, r->d),
                              .axes = {kt_apply_transposed(e, end[1].axes[0]), kt_apply_transposed(e, end[1].axes[1]),
                                       kt_apply_transposed(e, end[1].axes[2])},
                              .u = kt_apply_transposed(e, r->u),
                              .w = kt_apply_transposed(e, r->w)};
}

KT_INLINE kt_loop_motion kt_custom_motion_value(const kt_custom_motion *m) {
    return (kt_loop_motion){.position = kt_value_of(m->d),
                            .rotation = {kt_value_of(m->axes[0]), kt_value_of(m->axes[1]), kt_value_of(m->axes[2])},
                            .velocity = kt_value_of(m->u),
                            .omega = kt_value_of(m->w)};
}

#endif
