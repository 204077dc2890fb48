/* Wheels and ropes between two ends: the pitch circles of teeth, the pitch line of a rack, the straight spans of ropes
 * between two pulleys, and their arcs on the pulleys. Pulleys are circles, too. With d between the centres, n the axis,
 * e = d / a in the plane normal to n, and signed radii rho, a span leaves its pulleys at C_k + rho_k m (loop/span.h):
 *     x = cos(delta) e - sin(delta) n x e,   m = n x x,   sin(delta) = (rho_1 - rho_2) / a
 * A rope that goes on to its second pulley along x turns there about -n if rho is positive. On the first pulley the
 * rope turns about n if it goes on to this pulley along -x.
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
}

/* ---- ropes ------------------------------------------------------------------------------------------------------- */

/* A span: its axis, its radii, and the points at which it leaves its pulleys. */
typedef struct drawn_span {
    kt_vec3 n, centre[2], point[2];
    double radius[2];
} drawn_span;

/* Returns false if the pulleys are too close for a span. side: -1 for the other span of a belt. */
static bool find_span(const kt_picture_loop *loop, const kt_pose *poses, double side, drawn_span *span) {
    const kt_pose at[2] = {kt_body_frame_pose(&loop->ends[0], poses), kt_body_frame_pose(&loop->ends[1], poses)};
    const kt_vec3 n = at[0].rotation.z, d = kt_vec3_sub(at[1].position, at[0].position);
    const kt_vec3 across = kt_vec3_sub(d, kt_vec3_scale(kt_vec3_dot(n, d), n));
    const double a = kt_vec3_norm(across), sine = side * (loop->radii[0] - loop->radii[1]) / a;
    if (!(fabs(sine) < 1.0))
        return false;
    const kt_vec3 e = kt_vec3_scale(1.0 / a, across), t = kt_vec3_cross(n, e);
    const kt_vec3 x = kt_vec3_sub(kt_vec3_scale(sqrt(1.0 - sine * sine), e), kt_vec3_scale(sine, t));
    const kt_vec3 m = kt_vec3_cross(n, x);
    span->n = n;
    for (int k = 0; k < 2; k++) {
        span->radius[k] = side * loop->radii[k];
        span->centre[k] = at[k].position;
        span->point[k] = kt_vec3_add(at[k].position, kt_vec3_scale(span->radius[k], m));
    }
    return true;
}

/* The axis about which a rope turns on a pulley, going from the span on to the pulley at end k. */
static kt_vec3 winding_of(const drawn_span *span, int k) {
    return kt_vec3_scale((k == 1 ? -1.0 : 1.0) * (span->radius[k] < 0.0 ? -1.0 : 1.0), span->n);
}

/* Draws the rope on a pulley, from end k of one span to a point of another. */
static void draw_wrap(const wheel_pencil *p, const drawn_span *span, int k, kt_vec3 to) {
    const double turn = 6.283185307179586;
    const kt_vec3 axis = winding_of(span, k), a = kt_vec3_sub(span->point[k], span->centre[k]);
    const kt_vec3 b = kt_vec3_sub(to, span->centre[k]), across = kt_vec3_cross(axis, a);
    double angle = atan2(kt_vec3_dot(across, b), kt_vec3_dot(a, b));
    angle += angle < 0.0 ? turn : 0.0;
    const int steps = 1 + (int)(STEPS * angle / turn);
    kt_vec3 last = span->point[k];
    for (int i = 1; i <= steps; i++) {
        const double x = angle * i / steps;
        const kt_vec3 next =
            kt_vec3_add(span->centre[k], kt_vec3_add(kt_vec3_scale(cos(x), a), kt_vec3_scale(sin(x), across)));
        p->each(p->user, (kt_stroke){last, next});
        last = next;
    }
}

/* Whether two ends are the two sides of a rope on one pulley: the rope goes on to the pulley from either side, in
 * opposite senses. */
static bool are_sides_of_pulley(const kt_picture_loop *one, const drawn_span *a, int k, const kt_picture_loop *two,
                                const drawn_span *b, int i) {
    const double r = fabs(a->radius[k]), apart = kt_vec3_norm(kt_vec3_sub(a->centre[k], b->centre[i]));
    return r > 0.0 && one->ends[k].body == two->ends[i].body && apart <= 1e-9 * r &&
           fabs(fabs(b->radius[i]) - r) <= 1e-9 * r && kt_vec3_dot(winding_of(a, k), winding_of(b, i)) < 0.0;
}

/* Draws the rope between a span and a later one of the list that goes on at the same pulley. */
static void draw_wraps(const wheel_pencil *p, const kt_picture_loop *loops, int count, int index, const kt_pose *poses,
                       const drawn_span *span) {
    for (int k = 0; k < 2; k++)
        for (int other = index + 1; other < count; other++) {
            drawn_span next;
            if (loops[other].type != KT_LOOP_SPAN || !find_span(&loops[other], poses, 1.0, &next))
                continue;
            for (int i = 0; i < 2; i++)
                if (are_sides_of_pulley(&loops[index], span, k, &loops[other], &next, i)) {
                    draw_wrap(p, span, k, next.point[i]);
                    other = count;
                    break;
                }
        }
}

void kt_rope_strokes(const kt_picture_loop *loops, int count, int index, const kt_pose *poses, kt_stroke_each *each,
                     void *user) {
    const kt_picture_loop *loop = &loops[index];
    const wheel_pencil p = {each, user};
    drawn_span span, other;
    const bool is_belt = loop->type == KT_LOOP_BELT;
    if ((!is_belt && loop->type != KT_LOOP_SPAN) || loop->radii[0] == 0.0 || !find_span(loop, poses, 1.0, &span))
        return;
    if (!is_belt)
        draw_wraps(&p, loops, count, index, poses, &span);
    if (is_belt && find_span(loop, poses, -1.0, &other)) {
        for (int k = 0; k < 2; k++)
            draw_wrap(&p, &span, k, other.point[k]);
        each(user, (kt_stroke){other.point[0], other.point[1]});
    }
    each(user, (kt_stroke){span.point[0], span.point[1]});
}
