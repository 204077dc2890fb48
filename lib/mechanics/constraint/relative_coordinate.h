/* A relative coordinate of a loop (d_i, theta_i of [MSD 6.2]): its value c and its rate. The file also has the wrench
 * on the second end that a unit force along the coordinate exerts,
 *     c' = m . w + f . u            w, u of loop/relative_motion.h
 * so that the power of a force Q is Q c' in every state, whether the loop is closed or not. The z axes of the first and
 * of the second end are e = e_z and f = f_z; d leads from the first point to the second.
 *     displacements    c = e_k . d                                     f = e_k
 *     angle            theta of loop/orientation.h                     m = (e + f) / (1 + e . f)
 *     universal 1      m = f x h / |h|^2,  h = (e_x . f) e_y - (e_y . f) e_x
 *     universal 2      m = e x h / |h|^2,  h = (f_x . e) f_y - (f_y . e) f_x
 * The stretch of a span is phi of loop/span.h. The first universal angle is the angle of f about e from e_x. The
 * second is the angle of the frame about f, less the angle of e from f_x. Angles that differ by whole turns are
 * equivalent; the angle is the one nearest to
 *     angle + sum of coefficient * position + d_z / pitch
 *
 * In this sum the links of the loop whose axes stay parallel to e count turns; screws count turns, too.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_CONSTRAINT_RELATIVE_COORDINATE_H
#define KT_CONSTRAINT_RELATIVE_COORDINATE_H

#include "loop/orientation.h"
#include "loop/span.h"
#include "model/model.h"
#include "model/relative.h"

typedef struct kt_relative_coordinate {
    kt_real position, rate;
    kt_vector moment, force; /* on the second end, about its point; the opposite acts on the first at the same point */
} kt_relative_coordinate;

/* The direction of axis `f` about z of the frame e. The axis rotates at w in this frame, and *moment . w is the rate of
 * the direction. */
KT_INLINE kt_real kt_direction_about(const kt_vector e[3], kt_vector f, kt_vector *moment) {
    const kt_real x = kt_dot(e[0], f), y = kt_dot(e[1], f);
    *moment = kt_over(kt_cross(f, kt_scale(x, e[1]) - kt_scale(y, e[0])), x * x + y * y);
    return kt_atan2(y, x);
}

/* The sums over the links of both ends that count turns about z of the first end. Those of the first end count
 * backwards. */
typedef struct kt_relative_turns {
    double first, second;
} kt_relative_turns;

/* How much longer a span is than its rope: phi of loop/span.h, which is no equation here. */
KT_INLINE void kt_stretch_of(const kt_loop_record *loop, kt_relative_turns counted, const kt_loop_end end[2],
                             const kt_loop_relative *r, kt_relative_coordinate *c) {
    kt_loop_end turned[2] = {end[0], end[1]};
    turned[0].turn = kt_real_of(-counted.first);
    turned[1].turn = kt_real_of(loop->sense * counted.second);
    const kt_loop_row row = kt_row_of_long_span(loop, turned, r, loop->gain, loop->phase[0]);
    c->position = row.residual;
    c->moment = row.moment;
    c->force = row.force;
}

/* counted: see above. loop: that of the coordinate. */
KT_INLINE kt_relative_coordinate kt_relative_coordinate_of(const kt_relative_record *record, kt_relative_turns counted,
                                                           const kt_loop_record *loop, const kt_loop_end end[2]) {
    const kt_loop_relative r = kt_loop_relative_of(end);
    kt_relative_coordinate c = {.moment = kt_vector_zero(), .force = kt_vector_zero()};
    if (record->type == KT_RELATIVE_STRETCH) {
        kt_stretch_of(loop, counted, end, &r, &c);
    } else if (record->type == KT_RELATIVE_ANGLE) {
        const kt_axis_turn turn = kt_axis_turn_of(end, &r);
        c.position = turn.theta;
        c.moment = turn.k;
    } else if (record->type == KT_RELATIVE_FIRST) {
        c.position = kt_direction_about(end[0].axes, end[1].axes[2], &c.moment) - record->zero;
    } else if (record->type == KT_RELATIVE_SECOND) {
        c.position = record->zero - kt_direction_about(end[1].axes, end[0].axes[2], &c.moment);
    } else {
        c.force = end[0].axes[record->type - KT_RELATIVE_X];
        c.position = kt_dot(c.force, r.d);
    }
    c.rate = kt_dot(c.moment, r.w) + kt_dot(c.force, r.u);
    if (!kt_relative_is_length((kt_relative)record->type)) {
        const double along = record->per_length * kt_value(kt_dot(end[0].axes[2], r.d));
        const double turns = record->angle + (counted.first + counted.second) + along;
        c.position += KT_TURN * rint((turns - kt_value(c.position)) / KT_TURN);
    }
    return c;
}

#endif
