/* Effects that act in a joint can act in a relative coordinate of a loop, too. Then wrenches that do the same work
 * exert the force. The coordinate's rate is c' = m . w + f . u (constraint/relative_coordinate.h). A force Q along the
 * coordinate becomes
 *
 *     Q m, Q f           on the second end, about its point
 *     -Q (m + d x f), -Q f on the first end, about its point.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "evaluate/relative_force.h"

#include "constraint/relative_coordinate.h"

static kt_loop_end effect_loop_end(const kt_effect_end *e) {
    kt_loop_end end = {.point = kt_v4_from(e->point),
                       .omega = kt_v4_from(e->omega),
                       .velocity = kt_v4_from(e->velocity),
                       .alpha = kt_v4_splat(0.0),
                       .linear = kt_v4_splat(0.0)};
    kt_v4_from_mat3(e->axes, end.axes);
    return end;
}

kt_relative_motion kt_relative_motion_of(const kt_model *model, const kt_effect_record *effect, const double *q,
                                         const kt_effect_end end[2]) {
    const kt_relative_record *relative = &effect->relative;
    const kt_loop_end ends[2] = {effect_loop_end(&end[0]), effect_loop_end(&end[1])};
    kt_relative_turns counted = {0.0, 0.0};
    for (int32_t k = 0; k < relative->term_count; k++) {
        const kt_term_record *term = &model->term[relative->term + k];
        *(k < relative->first_count ? &counted.first : &counted.second) +=
            term->coefficient * q[model->link[term->link].q];
    }
    const kt_relative_coordinate c = kt_relative_coordinate_of(relative, counted, &model->loop[relative->loop], ends);
    return (kt_relative_motion){.position = c.position,
                                .rate = c.rate,
                                .counted = {counted.first, counted.second},
                                .moment = kt_v4_vec3(c.moment),
                                .force = kt_v4_vec3(c.force)};
}

void kt_relative_wrenches(const kt_relative_motion *motion, const kt_effect_end end[2], double force,
                          kt_wrench wrench[2]) {
    const kt_vec3 d = kt_vec3_sub(end[1].point, end[0].point);
    wrench[1] =
        (kt_wrench){.moment = kt_vec3_scale(force, motion->moment), .force = kt_vec3_scale(force, motion->force)};
    wrench[0] =
        (kt_wrench){.moment = kt_vec3_scale(-1.0, kt_vec3_add(wrench[1].moment, kt_vec3_cross(d, wrench[1].force))),
                    .force = kt_vec3_scale(-1.0, wrench[1].force)};
}
