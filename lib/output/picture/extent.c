/* The extent of a picture: the box around the mechanism, its size, and the planes that are shown below the
 * mechanism. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/elementary.h"
#include "base/order.h"
#include "picture/maker.h"
#include "picture/solid.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

kt_bounds kt_bounds_empty(void) {
    return (kt_bounds){.low = {DBL_MAX, DBL_MAX, DBL_MAX}, .high = {-DBL_MAX, -DBL_MAX, -DBL_MAX}};
}

static void widen_bounds(kt_bounds *b, kt_vec3 point) { kt_box_widen(&b->low, &b->high, point); }

static void widen_by_solid(kt_bounds *bounds, const kt_solid *solid, const kt_pose *poses) {
    const kt_pose pose = kt_pose_compose(poses[solid->body], solid->pose);
    const kt_vec3 reach = kt_vec3_make(kt_solid_reach(solid, kt_mat3_transpose(pose.rotation).x),
                                       kt_solid_reach(solid, kt_mat3_transpose(pose.rotation).y),
                                       kt_solid_reach(solid, kt_mat3_transpose(pose.rotation).z));
    widen_bounds(bounds, kt_vec3_sub(pose.position, reach));
    widen_bounds(bounds, kt_vec3_add(pose.position, reach));
}

bool kt_picture_shows_end(const kt_picture_effect *effect, int end) {
    return !(effect->type == KT_EFFECT_CONTACT && end == 1) &&
           !(effect->type == KT_EFFECT_ATTRACTION && effect->ends[end].body == 0);
}

typedef struct point_listener {
    kt_picture_point *each;
    void *user;
} point_listener;

static void hear_ends_of_line(void *user, kt_vec3 from, kt_vec3 to) {
    const point_listener *listener = user;
    listener->each(listener->user, from);
    listener->each(listener->user, to);
}

/* Points on the curve of a slack rope. */
static void hear_rope(const kt_picture *p, const kt_picture_loop *loop, const kt_pose *poses,
                      const point_listener *listener) {
    const kt_vec3 a = kt_body_frame_pose(&loop->ends[0], poses).position;
    const kt_vec3 b = kt_body_frame_pose(&loop->ends[1], poses).position;
    kt_vec3 control[2];
    if (loop->rope == NULL || !kt_picture_rope_curve(p, loop, 0.0, a, b, control))
        return;
    for (int k = 1; k < 8; k++) {
        const double s = k / 8.0, r = 1.0 - s;
        const kt_vec3 outer = kt_vec3_add(kt_vec3_scale(r * r * r, a), kt_vec3_scale(s * s * s, b));
        const kt_vec3 inner = kt_vec3_add(kt_vec3_scale(r, control[0]), kt_vec3_scale(s, control[1]));
        listener->each(listener->user, kt_vec3_add(outer, kt_vec3_scale(3.0 * r * s, inner)));
    }
}

static void hear_end_of_stroke(void *user, kt_stroke stroke) {
    const point_listener *listener = user;
    listener->each(listener->user, stroke.to);
}

void kt_picture_points(const kt_picture *p, const kt_pose *poses, kt_picture_point *each, void *user) {
    point_listener listener = {each, user};
    for (int i = 0; i < p->joint_count; i++)
        if (p->joints[i].type != KT_JOINT_FREE && p->joints[i].type != KT_JOINT_PLANAR)
            each(user, kt_body_frame_pose(&p->joints[i].frame, poses).position);
    for (int i = 0; i < p->loop_count; i++) {
        const kt_pose first = kt_body_frame_pose(&p->loops[i].ends[0], poses);
        for (int k = 0; k < (p->loops[i].type == KT_LOOP_ROLLING ? 1 : 2); k++)
            each(user, kt_body_frame_pose(&p->loops[i].ends[k], poses).position);
        for (int k = 0; k < p->loops[i].stroke_count; k++)
            each(user, kt_pose_apply(first, p->loops[i].strokes[k].to));
        if (p->loops[i].type != KT_LOOP_RACK)
            kt_wheel_strokes(&p->loops[i], poses, hear_end_of_stroke, &listener);
        hear_rope(p, &p->loops[i], poses, &listener);
    }
    for (int i = 0; i < p->effect_count; i++) {
        for (int k = 0; k < p->effects[i].end_count; k++)
            if (kt_picture_shows_end(&p->effects[i], k))
                each(user, kt_body_frame_pose(&p->effects[i].ends[k], poses).position);
        kt_picture_path(p, &p->effects[i], poses, hear_ends_of_line, &listener);
    }
}

static void widen_by_point(void *user, kt_vec3 point) { widen_bounds(user, point); }

kt_bounds kt_picture_widen(const kt_picture *p, const kt_pose *poses, kt_bounds bounds) {
    for (int i = 0; i < p->solid_count; i++)
        widen_by_solid(&bounds, &p->solids[i], poses);
    kt_picture_points(p, poses, widen_by_point, &bounds);
    return bounds;
}

/* The median of the lengths of links: of rods, and between the joints of a body; 0 if there are none. */
static double median_length(const kt_picture_maker *m, double *lengths) {
    const kt_picture *p = m->picture;
    size_t n = 0;
    for (int i = 0; i < p->solid_count; i++)
        if (p->solids[i].type == KT_SOLID_ROD && p->solids[i].half.z > 0.0)
            lengths[n++] = 2.0 * p->solids[i].half.z;
    for (int i = 0; i < p->joint_count; i++) {
        const double length = kt_vec3_norm(p->joints[i].frame.pose.position);
        if (p->joints[i].frame.body > 0 && length > 0.0)
            lengths[n++] = length;
    }
    qsort(lengths, n, sizeof *lengths, kt_compare_numbers);
    return n > 0 ? lengths[n / 2] : 0.0;
}

/* Size of the mechanism, and lengths that suit this size. Centres of mass count, too: a body may have no shape. */
kt_bounds kt_picture_measure(kt_picture_maker *m, double *lengths) {
    kt_picture *p = m->picture;
    kt_bounds bounds = kt_picture_widen(p, m->poses, kt_bounds_empty());
    for (int body = 1; body < p->body_count; body++)
        if (!kt_picture_has_own(m, body) && kt_picture_source(m, body)->mass > 0.0)
            widen_bounds(&bounds, kt_pose_apply(m->poses[body], kt_picture_source(m, body)->com));
    if (bounds.low.x > bounds.high.x)
        widen_bounds(&bounds, kt_vec3_make(0.0, 0.0, 0.0));
    p->size = kt_vec3_norm_wide(kt_vec3_sub(bounds.high, bounds.low));
    p->size = p->size > 0.0 && isfinite(p->size) ? p->size : 1.0;
    const double median = median_length(m, lengths);
    p->radius = 0.011 * p->size;
    if (median > 0.0)
        p->radius = fmax(fmin(p->radius, 0.06 * median), 0.0008 * p->size);
    return bounds;
}

/* ---- planes ------------------------------------------------------------------------------------------------------ */

/* A plane, unless there is one already that is the same. */
static void list_plane(kt_picture_maker *m, kt_body_frame frame) {
    kt_picture *p = m->picture;
    const kt_pose pose = kt_body_frame_pose(&frame, m->poses);
    for (int i = 0; i < p->plane_count; i++) {
        const kt_pose other = kt_body_frame_pose(&p->planes[i].frame, m->poses);
        const kt_vec3 apart = kt_vec3_sub(pose.position, other.position);
        if (p->part[p->planes[i].frame.body] == p->part[frame.body] &&
            kt_vec3_dot(pose.rotation.z, other.rotation.z) > 1.0 - 1e-9 &&
            fabs(kt_vec3_dot(apart, other.rotation.z)) <= 1e-6 * p->size)
            return;
    }
    p->planes[p->plane_count++] = (kt_picture_plane){.frame = frame};
}

void kt_picture_fit_planes(kt_picture *p, const kt_pose *poses, kt_bounds bounds) {
    const kt_vec3 middle = kt_vec3_scale(0.5, kt_vec3_add(bounds.low, bounds.high));
    const double size = kt_vec3_norm(kt_vec3_sub(bounds.high, bounds.low));
    for (int i = 0; i < p->plane_count; i++) {
        kt_body_frame *frame = &p->planes[i].frame;
        const kt_pose pose = kt_body_frame_pose(frame, poses);
        const double height = kt_vec3_dot(pose.rotation.z, kt_vec3_sub(middle, pose.position));
        const kt_vec3 foot = kt_vec3_sub(middle, kt_vec3_scale(height, pose.rotation.z));
        frame->pose.position = kt_pose_apply(kt_pose_invert(poses[frame->body]), foot);
        p->planes[i].half = 0.6 * fmax(size, 0.5 * p->size);
    }
}

void kt_picture_list_planes(kt_picture_maker *m, kt_bounds bounds) {
    kt_picture *p = m->picture;
    for (int i = 0; i < p->loop_count; i++)
        if (p->loops[i].type == KT_LOOP_ROLLING)
            list_plane(m, p->loops[i].ends[1]);
    for (int i = 0; i < p->effect_count; i++)
        if (p->effects[i].has_plane)
            list_plane(m, p->effects[i].ends[1]);
    for (int i = 0; i < p->joint_count; i++)
        if (p->joints[i].type == KT_JOINT_PLANAR && p->part[p->joints[i].frame.body] == 0)
            list_plane(m, p->joints[i].frame);
    kt_picture_fit_planes(p, m->poses, bounds);
}
