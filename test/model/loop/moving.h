/* Ends that move: poses as jets, the kt_loop_end they make, and every loop's equations written down once more, from the
 * relative pose alone. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_TEST_LOOP_MOVING_H
#define KT_TEST_LOOP_MOVING_H

#include "check.h"
#include "jet.h"
#include "loop/loop.h"

/* A frame in motion: origin, and orientation as a unit quaternion, scalar first. */
typedef struct moving {
    jet p[3], q[4];
} moving;

/* Rotation by `angle` about coordinate axis k. */
void moving_turn(int k, jet angle, jet q[4]);
void moving_multiply(const jet a[4], const jet b[4], jet out[4]);
/* Columns: matrix[k] is axis k. */
void moving_axes(const jet q[4], jet axes[3][3]);

/* Any orientation and place within `far` of the origin, with velocities and accelerations of order one. */
moving moving_random(kt_random *random, double far);
jet moving_random_jet(kt_random *random, double most);
/* `relative` is a pose in frame `first`. */
moving moving_compose(const moving *first, const moving *relative);
moving moving_relative(const moving *first, const moving *second);

/* The end, rounded to double. The members alpha and linear are NaN, since no equation may read them. The output
 * acceleration (may be NULL) receives the angular acceleration and that of the origin. */
kt_loop_end moving_end(const moving *m, kt_v4 acceleration[2]);

/* A record of this type with parameters of order one, and the numbers of its curve. The length of a distance is
 *     2 + 0.5 sin(3 t + 0.4). */
enum { MOVING_NUMBERS = 8 };
kt_loop_record moving_loop(kt_random *random, int type, double numbers[MOVING_NUMBERS]);
jet moving_length(double t);

/* phi, phi' and phi'' of all equations, but not those of a helix; returns their number. Those that are not holonomic
 * have phi = NaN. */
int moving_equations(const kt_loop_record *loop, double t, const moving *first, const moving *second, jet phi[6]);

/* phi' and phi'' according to a row. */
typedef struct moving_rates {
    double first, second;
} moving_rates;
/* Sums of the sizes of the terms of phi' and phi'', the scale of their rounding. */
moving_rates moving_scales(const kt_loop_end end[2], kt_v4 acceleration[2][2]);
moving_rates moving_rates_of(const kt_loop_row *row, const kt_loop_end end[2], kt_v4 acceleration[2][2]);

#endif
