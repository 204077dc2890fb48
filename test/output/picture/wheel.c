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
        kt_rope_strokes(&loop, 1, 0, poses, keep_last, &last);
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

/* All ends of the strokes of a rope. */
typedef struct rope_ends {
    kt_vec3 point[2000];
    int count;
} rope_ends;

static void keep_ends(void *user, kt_stroke stroke) {
    rope_ends *ends = user;
    ends->point[ends->count++] = stroke.from;
    ends->point[ends->count++] = stroke.to;
}

static kt_picture_loop span_between(int first, int second, double one, double two) {
    kt_picture_loop loop = {.type = KT_LOOP_SPAN, .radii = {one, two}};
    loop.ends[0] = (kt_body_frame){.body = first, .pose = kt_pose_identity()};
    loop.ends[1] = (kt_body_frame){.body = second, .pose = kt_pose_identity()};
    return loop;
}

static void check_closed_line(const char *what, const kt_picture_loop *loops, int count, const kt_pose *poses) {
    static rope_ends ends;
    KT_WORST gap = kt_worst_make(what);
    ends.count = 0;
    for (int i = 0; i < count; i++)
        kt_rope_strokes(loops, count, i, poses, keep_ends, &ends);
    for (int i = 0; i < ends.count; i++) {
        double nearest = 1.0;
        for (int j = 0; j < ends.count; j++)
            if (j != i && j / 2 != i / 2)
                nearest = fmin(nearest, kt_vec3_norm(kt_vec3_sub(ends.point[i], ends.point[j])));
        kt_worst_near(&gap, nearest, 0.0, 1e-14, "%d", i);
    }
    kt_check_equal_int("strokes of arcs and spans", ends.count / 2 > 2 * count + 10, 1);
}

/* Crank, idler and alternator: the idler lies on the other side of the belt. A belt of two pulleys is closed, too, and
 * so is a crossed one. */
KT_TEST(ropes_on_pulleys_are_closed_lines) {
    kt_pose poses[3] = {kt_pose_identity(), kt_pose_identity(), kt_pose_identity()};
    poses[1].position = kt_vec3_make(0.4, 0.1, 0.0);
    poses[2].position = kt_vec3_make(0.2, -0.02, 0.0);
    const kt_picture_loop serpentine[] = {span_between(1, 0, -0.04, -0.1), span_between(0, 2, -0.1, 0.03),
                                          span_between(2, 1, 0.03, -0.04)};
    check_closed_line("serpentine", serpentine, 3, poses);
    for (int crossed = 0; crossed < 2; crossed++) {
        kt_picture_loop belt = span_between(0, 1, 0.1, crossed ? -0.04 : 0.04);
        belt.type = KT_LOOP_BELT;
        check_closed_line(crossed ? "crossed belt" : "belt", &belt, 1, poses);
    }
}
