/* Spans are tangents: both ends lie on the pulleys, and the radii there are normal to the span. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "picture/picture.h"

#include <math.h>

typedef struct last_strokes {
    kt_stroke stroke[2]; /* the last one comes first */
} last_strokes;

static void keep_last(void *user, kt_stroke stroke) {
    last_strokes *last = user;
    last->stroke[1] = last->stroke[0];
    last->stroke[0] = stroke;
}

KT_TEST(spans_touch_both_pulleys_at_right_angles) {
    kt_random random = kt_random_of_test();
    kt_worst on = kt_worst_make("distance from the circle"), normal = kt_worst_make("radius along the span");
    for (int n = 0; n < 200; n++) {
        kt_pose poses[2] = {kt_pose_identity(), kt_pose_identity()};
        last_strokes last;
        kt_picture_loop loop = {
            .type = n % 2 ? KT_LOOP_BELT : KT_LOOP_SPAN,
            .radii = {kt_random_uniform(&random, -1.0, 1.0), kt_random_uniform(&random, -1.0, 1.0)}};
        for (int k = 0; k < 2; k++) {
            loop.ends[k].body = k;
            loop.ends[k].pose = kt_pose_identity();
        }
        poses[1].position =
            kt_vec3_make(kt_random_uniform(&random, 2.1, 4.0), kt_random_uniform(&random, -3.0, 3.0), 0.0);
        kt_wheel_strokes(&loop, poses, keep_last, &last);
        for (int i = 0; i < (n % 2 ? 2 : 1); i++) {
            const kt_stroke span = last.stroke[i];
            const kt_vec3 along = kt_vec3_normalize(kt_vec3_sub(span.to, span.from));
            const kt_vec3 arm[2] = {kt_vec3_sub(span.from, poses[0].position), kt_vec3_sub(span.to, poses[1].position)};
            for (int k = 0; k < 2; k++) {
                kt_worst_near(&on, kt_vec3_norm(arm[k]), fabs(loop.radii[k]), 1e-14, "%d", n);
                kt_worst_near(&normal, kt_vec3_dot(arm[k], along), 0.0, 1e-14, "%d", n);
            }
        }
    }
    kt_check_worst(&on);
    kt_check_worst(&normal);
}
