/* Wheels and ropes between two ends: the pitch circles of teeth, the pitch line of a rack, and the straight spans
 * between two pulleys. Pulleys are circles, too. With d between the centres, n the axis, e = d / a in the plane normal
 * to n, and signed radii rho, a span leaves its pulleys at C_k + rho_k m (loop/span.h):
 *     x = cos(delta) e - sin(delta) n x e,   m = n x x,   sin(delta) = (rho_1 - rho_2) / a
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/picture.h"

#include <math.h>
#include <stdlib.h>

enum { STEPS = 60 };

typedef struct wheel_pencil {
    kt_stroke_each *each;
    void *user;
} wheel_pencil;

static void draw_wheel(const wheel_pencil *p, kt_pose at, double radius) {
    const double turn = 6.283185307179586;
    kt_vec3 last = kt_pose_apply(at, kt_vec3_make(radius, 0.0, 0.0));
    for (int i = 1; i <= STEPS && radius != 0.0; i++) {
        const double angle = turn * i / STEPS;
        const kt_vec3 next = kt_pose_apply(at, kt_vec3_make(radius * cos(angle), radius * sin(angle), 0.0));
        p->each(p->user, (kt_stroke){last, next});
        last = next;
    }
}

static void draw_wheel_span(const wheel_pencil *p, const kt_pose at[2], double first, double second) {
    const kt_vec3 n = at[0].rotation.z, d = kt_vec3_sub(at[1].position, at[0].position);
    const kt_vec3 across = kt_vec3_sub(d, kt_vec3_scale(kt_vec3_dot(n, d), n));
    const double a = kt_vec3_norm(across), sine = (first - second) / a;
    if (!(fabs(sine) < 1.0))
        return;
    const kt_vec3 e = kt_vec3_scale(1.0 / a, across), t = kt_vec3_cross(n, e);
    const kt_vec3 x = kt_vec3_sub(kt_vec3_scale(sqrt(1.0 - sine * sine), e), kt_vec3_scale(sine, t));
    const kt_vec3 m = kt_vec3_cross(n, x);
    p->each(p->user, (kt_stroke){kt_vec3_add(at[0].position, kt_vec3_scale(first, m)),
                                 kt_vec3_add(at[1].position, kt_vec3_scale(second, m))});
}

/* Draws the pitch line of a rack. The line is as long as two turns of the wheel, with its middle at the point nearest
 * to the centre. */
static void draw_pitch_line(const wheel_pencil *p, const kt_pose at[2], double radius) {
    const kt_vec3 t = at[1].rotation.z, d = kt_vec3_sub(at[0].position, at[1].position);
    const kt_vec3 foot = kt_vec3_add(at[1].position, kt_vec3_scale(kt_vec3_dot(d, t), t));
    const kt_vec3 half = kt_vec3_scale(6.0 * radius, t);
    p->each(p->user, (kt_stroke){kt_vec3_sub(foot, half), kt_vec3_add(foot, half)});
}

void kt_wheel_strokes(const kt_picture_loop *loop, const kt_pose *poses, kt_stroke_each *each, void *user) {
    const double *radius = loop->radii;
    const kt_pose at[2] = {kt_body_frame_pose(&loop->ends[0], poses), kt_body_frame_pose(&loop->ends[1], poses)};
    const wheel_pencil p = {each, user};
    if (radius[0] == 0.0)
        return;
    draw_wheel(&p, at[0], radius[0]);
    if (loop->type == KT_LOOP_RACK)
        draw_pitch_line(&p, at, radius[0]);
    else
        draw_wheel(&p, at[1], radius[1]);
    if (loop->type == KT_LOOP_SPAN || loop->type == KT_LOOP_BELT)
        draw_wheel_span(&p, at, radius[0], radius[1]);
    if (loop->type == KT_LOOP_BELT)
        draw_wheel_span(&p, at, -radius[0], -radius[1]);
}
