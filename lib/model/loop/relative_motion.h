/* The second end's motion seen from the first, and rows that close it along the first end's axes.
 *
 * d = p2 - p1, and with the frame of end 1 turning at w1,
 *     u = v2 - v1 - w1 x d is d's rate in this frame,
 *     w = w2 - w1.
 * For an axis e of that frame, e' = w1 x e, so phi = e . d has
 *     phi'  = e . u
 *     phi'' = e . u' - e . (2 w1 x u + w1 x (w1 x d)),   u' = a2 - a1 - alpha1 x d  [loop.h]
 * (du/dt = u' - w1 x (u + w1 x d), and e' . u = - e . (w1 x u)). The same holds of any direction fixed in end 1's
 * frame. Seen in that frame, w's rate is w' - w1 x w2.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_LOOP_RELATIVE_MOTION_H
#define KT_LOOP_RELATIVE_MOTION_H

#include "loop/loop.h"

typedef struct kt_loop_relative {
    kt_vector d, u, w;  /* see above */
    kt_vector coriolis; /* -(2 w1 x u + w1 x (w1 x d)) */
    kt_vector turning;  /* w1 x w2 */
} kt_loop_relative;

KT_INLINE kt_loop_relative kt_loop_relative_of(const kt_loop_end end[2]) {
    kt_loop_relative r;
    const kt_vector w1 = end[0].omega;
    r.d = end[1].point - end[0].point;
    const kt_vector carried = kt_cross(w1, r.d);
    r.u = end[1].velocity - end[0].velocity - carried;
    r.w = end[1].omega - w1;
    r.coriolis = -kt_cross(w1, r.u + r.u + carried);
    r.turning = kt_cross(w1, end[1].omega);
    return r;
}

/* phi = e . d, e fixed in end 1's frame */
KT_INLINE kt_loop_row kt_row_along(const kt_loop_relative *r, kt_vector e) {
    return (kt_loop_row){.force = e,
                         .moment = kt_vector_zero(),
                         .residual = kt_dot(e, r->d),
                         .drift = kt_dot(e, r->coriolis),
                         .holonomic = true};
}

/* Defines a type, `kind`, whose rows depend on the motion of its ends alone. The function of the type has the name
 * `own`. The rows are d along the first end's axes first .. after - 1, then the rows that `turn` writes (kt_row_none,
 * orientation.h). The parts of the rows follow as arguments. */
#define KT_LOOP_OF_ENDS(own, kind, first, after, turn, ...)                                                            \
    static int own(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,              \
                   kt_loop_row *rows) {                                                                                \
        (void)loop, (void)numbers, (void)t;                                                                            \
        const kt_loop_relative r = kt_loop_relative_of(end);                                                           \
        for (int k = first; k < after; k++)                                                                            \
            rows[k - first] = kt_row_along(&r, end[0].axes[k]);                                                        \
        turn(end, &r, rows + (after - first));                                                                         \
        return (int)sizeof((unsigned char[]){__VA_ARGS__});                                                            \
    }                                                                                                                  \
    const kt_loop_kind kind = {.rows = sizeof((unsigned char[]){__VA_ARGS__}), .evaluate = own, .part = {__VA_ARGS__}};

/* No rows for the orientation. */
KT_INLINE void kt_row_none(const kt_loop_end end[2], const kt_loop_relative *r, kt_loop_row *rows) {
    (void)end, (void)r, (void)rows;
}

#endif
