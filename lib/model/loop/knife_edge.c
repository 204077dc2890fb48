/* Knife edge: the second point has no velocity against the first end's body along the second end's axis a = f_z. This
 * axis turns with the second end. Examples are an ice skate, and the wheel of a cart without its mass (Chaplygin's
 * sleigh). The loop is non-holonomic, a . u = 0. With u, w and the Coriolis terms of relative_motion.h, and a' = w x a
 * as seen from end 1,
 *     phi'  = a . u
 *     phi'' = a . u' + a . coriolis + (w x a) . u
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/relative_motion.h"

static int evaluate_knife_edge(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                               kt_loop_row *rows) {
    (void)loop, (void)numbers, (void)t;
    const kt_loop_relative r = kt_loop_relative_of(end);
    const kt_vector a = end[1].axes[2];
    rows[0] = (kt_loop_row){
        .force = a, .moment = kt_vector_zero(), .drift = kt_dot(a, r.coriolis) + kt_dot(kt_cross(r.w, a), r.u)};
    return 1;
}

const kt_loop_kind KT_KERNEL(kt_loop_knife_edge) = {
    .rows = 1, .evaluate = evaluate_knife_edge, .part = {KT_PART_SPATIAL}};

#if KT_DESCRIBES
static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "a, across the edge, in the frame of the second end", .needed = false},
};
const kt_descriptor kt_loop_knife_edge_descriptor = {
    .name = "knife_edge",
    .help = "the second point does not move sideways: an ice skate",
    .formula =
        "a . v = 0    v: velocity of the second point relative to the first body;  a: axis, fixed to the second end",
    .example = "bodies:\n"
               "  - name: skate\n"
               "    joint: {type: planar, axis: z, velocity: [1, 0, 2]}\n"
               "    mass: 1\n"
               "    shape: {type: box, size: [0.4, 0.05, 0.05]}\n"
               "loops:\n"
               "  - {name: edge, type: knife_edge, between: [world, skate], axis: y}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
