/* Distance: |d| = L(t), d = p2 - p1 [MSD 6.34 to 6.44]. With n = d / |d| and d' = v2 - v1,
 *     phi   = |d| - L
 *     phi'  = n . d' - L'
 *     phi'' = n . d'' + (|d'|^2 - (n . d')^2) / |d| - L''
 * and n . (w1 x d) = n . (alpha1 x d) = 0, so that n . d' = n . u and n . d'' = n . u'. If the points coincide, n is
 * undefined. The first end's x axis is taken, so that an iteration towards |d| = L has a direction. The curvature is
 * set to zero.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/relative_motion.h"

#include <float.h>

static int evaluate_distance(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                             kt_loop_row *rows) {
    double length[3];
    kt_curve_evaluate(&loop->curve, numbers, t, length);
    const kt_vector d = end[1].point - end[0].point, rate = end[1].velocity - end[0].velocity;
    const kt_real d2 = kt_dot(d, d);
    const bool apart = kt_value(d2) > DBL_MIN; /* below, the square has lost digits */
    const kt_real norm = apart ? kt_sqrt(d2) : 0.0;
    const kt_vector n = apart ? kt_over(d, norm) : end[0].axes[0];
    const kt_vector across = kt_cross(n, rate); /* |d'|^2 - (n . d')^2 without cancellation */
    const kt_real bias = apart ? kt_dot(across, across) / norm : 0.0;
    rows[0] = (kt_loop_row){.force = n,
                            .moment = kt_vector_zero(),
                            .residual = norm - length[0],
                            .rate = -length[1],
                            .drift = bias - length[2],
                            .holonomic = true};
    return 1;
}

const kt_loop_kind KT_KERNEL(kt_loop_distance) = {
    .rows = 1, .evaluate = evaluate_distance, .part = {KT_PART_DISTANCE}, .initial_distance = true};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"slack", KT_KEY_FLAG, KT_LOOP_AT(slack), "", "true: a rope, which only pulls; the distance may be less than L",
     .needed = false},
    {"restitution", KT_KEY_NUMBER, KT_LOOP_AT(restitution), "",
     "e, of a rope that becomes taut: ends that part at w return at e w", .range = KT_RANGE_NOT_NEGATIVE},
    {"rest_velocity", KT_KEY_NUMBER, KT_LOOP_AT(rest_velocity), "m/s",
     "of a rope: ends that part more slowly do not bounce", .range = KT_RANGE_NOT_NEGATIVE},
    KT_POISSON_KEY(KT_LOOP_AT(poisson), "of a rope: "){
        "length", KT_KEY_FUNCTION, KT_LOOP_AT(function), "m", "L, a number or a function of time",
        "the distance in the given positions, before loops are closed", .range = KT_RANGE_POSITIVE},
};
const kt_descriptor kt_loop_distance_descriptor = {
    .name = "distance",
    .help = "the two points keep a distance",
    .formula = "|d| = L(t)    d: from the first point to the second",
    .example = KT_EXAMPLE_BOX "  - {name: hold, type: distance, between: [world, box.corner]}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
