/* Symbols of joints, of the ground, of planes, and of loops. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"
#include "picture/solid.h"

#include <math.h>
#include <stdint.h>

enum { MOUNTS_MOST = 400 };

/* ---- pivots ------------------------------------------------------------------------------------------------------ */

static bool is_point_loop(kt_loop_type type) {
    return type == KT_LOOP_REVOLUTE || type == KT_LOOP_SPHERICAL || type == KT_LOOP_UNIVERSAL || type == KT_LOOP_WELD ||
           type == KT_LOOP_PRISMATIC || type == KT_LOOP_SCREW || type == KT_LOOP_CYLINDRICAL;
}

static bool is_slot(kt_loop_type type) { return type == KT_LOOP_INLINE || type == KT_LOOP_INPLANE; }

/* A dot is a line of no length, with round ends. */
static void trace_dot(cairo_t *c, kt_spot at) { kt_trace_line(c, at, at); }

/* Small circles, with a dot if they close a loop. They are painted layer by layer, which keeps files small. */
void kt_paint_pivots(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    const double r = sheet->pin, widths[] = {2.0 * r, 2.0 * r - fmin(2.6, r), 0.75 * r};
    const int joints = kt_sheet_is_crowded(sheet, sheet->pin, 20) ? 0 : p->joint_count;
    cairo_t *c = sheet->c;
    cairo_set_line_cap(c, CAIRO_LINE_CAP_ROUND);
    for (int layer = 0; layer < 3; layer++) {
        for (int i = 0; i < joints && layer < 2; i++)
            if (p->joints[i].type == KT_JOINT_REVOLUTE)
                trace_dot(c, kt_sheet_frame(sheet, &p->joints[i].frame));
        for (int i = 0; i < p->loop_count; i++)
            if (is_point_loop(p->loops[i].type) || is_slot(p->loops[i].type))
                trace_dot(c, kt_sheet_frame(sheet, &p->loops[i].ends[1]));
        kt_paper_stroke(c, layer == 1 ? sheet->palette->paper : kt_sheet_faded(sheet, sheet->palette->ink),
                        widths[layer]);
    }
    cairo_set_line_cap(c, CAIRO_LINE_CAP_BUTT);
}

/* A fixed point: a triangle below it on hatched ground. is_above: the triangle is above the point, because the body
 * hangs down. */
static void paint_mount(const kt_sheet *sheet, kt_spot at, bool is_above) {
    const double r = fmax(sheet->pin, 2.2), down = is_above ? -1.0 : 1.0;
    const kt_spot left = {at.x - 1.9 * r, at.y + down * 2.9 * r}, right = {at.x + 1.9 * r, at.y + down * 2.9 * r};
    cairo_t *c = sheet->c;
    cairo_move_to(c, at.x, at.y);
    cairo_line_to(c, left.x, left.y);
    cairo_line_to(c, right.x, right.y);
    cairo_close_path(c);
    kt_paper_fill(c, sheet->palette->faint, sheet->palette->quiet, 1.0);
    const kt_spot a = kt_spot_offset(left, (kt_spot){1.0, 0.0}, -r, 0.0),
                  b = kt_spot_offset(right, (kt_spot){1.0, 0.0}, r, 0.0);
    kt_paint_hatching(sheet, is_above ? b : a, is_above ? a : b);
}

/* Whether the middle of a rigid part is lower on the page than a spot, in the mean of the states that decide about
 * mounts. */
static bool hangs(const kt_sheet *sheet, int part, kt_spot from) {
    const kt_drawing *d = sheet->drawing;
    const kt_picture *p = d->picture;
    double sum = 0.0;
    int count = 0;
    for (int k = 0; k < kt_mount_states(d); k++)
        for (int i = 0; i < p->solid_count; i++)
            if (p->part[p->solids[i].body] == part) {
                const kt_pose pose = kt_pose_compose(kt_mount_state(d, k)[p->solids[i].body], p->solids[i].pose);
                sum += kt_sheet_place(sheet, pose.position).y;
                count++;
            }
    return count > 0 && sum / count > from.y + 1.5 * sheet->pin;
}

/* The spots of mounts that are painted. */
typedef struct mounts {
    kt_spot items[MOUNTS_MOST];
    int count;
} mounts;

/* Paints the mount of a frame on the ground, unless there is one at the same spot. part: what the frame carries. */
static void mount_frame(const kt_sheet *sheet, mounts *m, const kt_body_frame *frame, int part) {
    const kt_mount mount = kt_mount_of(sheet, frame);
    const kt_spot at = kt_sheet_place(sheet, mount.place);
    for (int i = 0; i < m->count; i++)
        if (kt_spot_distance(m->items[i], at) < 1.0)
            return;
    if (m->count < MOUNTS_MOST)
        m->items[m->count++] = at;
    paint_mount(sheet, at, mount.is_of_part ? mount.is_above : hangs(sheet, part, at));
}

/* Paints a mount of each pivot on the ground. */
void kt_paint_mounts(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    mounts m = {.count = 0};
    for (int i = 0; i < p->joint_count; i++)
        if (kt_sheet_is_ground(sheet, p->joints[i].frame.body) && p->joints[i].type == KT_JOINT_REVOLUTE)
            mount_frame(sheet, &m, &p->joints[i].frame, p->part[p->joints[i].body]);
    for (int i = 0; i < p->loop_count; i++)
        for (int k = 0; k < 2; k++) {
            const kt_picture_loop *loop = &p->loops[i];
            const bool is_pin = loop->type == KT_LOOP_REVOLUTE || loop->type == KT_LOOP_SPHERICAL;
            if (kt_sheet_is_ground(sheet, loop->ends[k].body) && is_pin)
                mount_frame(sheet, &m, &loop->ends[k], p->part[loop->ends[1 - k].body]);
        }
}

/* ---- guides ------------------------------------------------------------------------------------------------------ */

/* The extent of a rigid part along and across a direction on the page, from a spot. */
typedef struct reach {
    double low, high, left, right; /* left, right: of the direction; right is down where it points right */
} reach;

static reach pin_reach_of(const kt_sheet *sheet, int body, kt_spot from, kt_spot along) {
    const kt_picture *p = sheet->drawing->picture;
    const kt_camera *camera = &sheet->drawing->camera;
    reach r = {1e9, -1e9, 1e9, -1e9};
    for (int i = 0; i < p->solid_count; i++) {
        if (p->solids[i].body != body)
            continue;
        const kt_pose pose = kt_camera_pose(camera, kt_pose_compose(sheet->poses[body], p->solids[i].pose));
        const kt_spot at = kt_sheet_spot(sheet, pose.position);
        const kt_vec3 ahead = kt_mat3_apply_transposed(pose.rotation, kt_vec3_make(along.x, -along.y, 0.0));
        const kt_vec3 aside = kt_mat3_apply_transposed(pose.rotation, kt_vec3_make(along.y, along.x, 0.0));
        const double x = (at.x - from.x) * along.x + (at.y - from.y) * along.y;
        const double y = (at.y - from.y) * along.x - (at.x - from.x) * along.y;
        const double a = sheet->scale * kt_solid_reach(&p->solids[i], ahead);
        const double b = sheet->scale * kt_solid_reach(&p->solids[i], aside);
        r = (reach){fmin(r.low, x - a), fmax(r.high, x + a), fmin(r.left, y - b), fmax(r.right, y + b)};
    }
    return r.low <= r.high ? r : (reach){0.0, 0.0, 0.0, 0.0};
}

enum { GUIDE_MOST = 26 }; /* of a dashed guide beyond its block: within the border of a picture */

/* A slider in the plane. On the ground it has hatched guides: one below a block, two on both sides of a bar. Otherwise
 * it has a fine line. */
static void paint_guide(const kt_sheet *sheet, const kt_picture_joint *joint) {
    const kt_drawing *d = sheet->drawing;
    const kt_pose frame = kt_body_frame_pose(&joint->frame, sheet->poses);
    const kt_spot at = kt_sheet_place(sheet, frame.position);
    const kt_spot ahead =
        kt_sheet_place(sheet, kt_vec3_add(frame.position, kt_vec3_scale(d->picture->size, frame.rotation.z)));
    if (kt_spot_distance(at, ahead) < 0.2 * sheet->scale * d->picture->size)
        return;
    kt_spot along = kt_spot_direction(at, ahead);
    if (along.x < -1e-6 || (fabs(along.x) <= 1e-6 && along.y > 0.0))
        along = (kt_spot){-along.x, -along.y};
    const kt_spot body = kt_sheet_place(sheet, sheet->poses[joint->body].position);
    const double place = (body.x - at.x) * along.x + (body.y - at.y) * along.y;
    if (!kt_sheet_is_ground(sheet, joint->frame.body)) {
        kt_paint_line(sheet, at, body, 1.0,
                      kt_sheet_faded(sheet, d->picture->solid_count > 0 ? sheet->palette->quiet : sheet->palette->ink));
        return;
    }
    const reach r = pin_reach_of(sheet, joint->body, body, along);
    if (fabs(along.y) > 0.8 &&
        r.high - r.low <= 5.0 * (r.right - r.left)) { /* a block that does not rest on its guide */
        const double more = fmin(fmax(4.0 * sheet->pin, 0.15 * (r.high - r.low)), GUIDE_MOST);
        kt_paint_dashes(sheet, kt_spot_offset(body, along, r.low - more, 0.0),
                        kt_spot_offset(body, along, r.high + more, 0.0), kt_sheet_faded(sheet, sheet->palette->quiet),
                        1.0);
        return;
    }
    const double across = r.right - r.left, length = r.high - r.low;
    const double own = fmax(2.5 * sheet->pin, 0.35 * across);
    if (length > 5.0 * across) { /* a bar: guided where the joint is */
        const double half = 2.2 * sheet->pin, inside = fmin(fmax(0.0, place + r.low + half), place + r.high - half);
        for (int side = -1; side <= 1; side += 2) {
            const double aside = side < 0 ? r.left - 1.5 : r.right + 1.5;
            const kt_spot from = kt_spot_offset(at, along, inside - half, aside),
                          to = kt_spot_offset(at, along, inside + half, aside);
            kt_paint_hatching(sheet, side < 0 ? to : from, side < 0 ? from : to);
        }
        return;
    }
    double low = fmin(place, 0.0) + r.low, high = fmax(place, 0.0) + r.high;
    for (int i = 0; i < d->state_count; i++) {
        const kt_spot then =
            kt_sheet_place(sheet, d->poses[(ptrdiff_t)i * d->picture->body_count + joint->body].position);
        const double there = (then.x - at.x) * along.x + (then.y - at.y) * along.y;
        low = fmin(low, d->is_strobe ? there + r.low : low);
        high = fmax(high, d->is_strobe ? there + r.high : high);
    }
    kt_paint_hatching(sheet, kt_spot_offset(at, along, low - own, r.right + 1.5),
                      kt_spot_offset(at, along, high + own, r.right + 1.5));
}

/* ---- planes ------------------------------------------------------------------------------------------------------ */

static bool is_seen_from_its_edge(const kt_sheet *sheet, const kt_picture_plane *plane) {
    const kt_pose pose = kt_body_frame_pose(&plane->frame, sheet->poses);
    return fabs(kt_camera_point(&sheet->drawing->camera, pose.rotation.z).z) < 0.02;
}

bool kt_plane_is_paper(const kt_drawing *d, const kt_picture_plane *plane, const kt_pose *poses) {
    const kt_vec3 normal = kt_body_frame_pose(&plane->frame, poses).rotation.z;
    return d->picture->is_planar && fabs(kt_camera_point(&d->camera, normal).z) > 1.0 - 1e-9;
}

/* A plane seen from its edge is hatched ground. Other planes are squares with lines, as a floor for the things on
 * them. */
static void paint_plane(const kt_sheet *sheet, const kt_picture_plane *plane) {
    const kt_pose pose = kt_body_frame_pose(&plane->frame, sheet->poses);
    const kt_vec3 normal = kt_camera_point(&sheet->drawing->camera, pose.rotation.z);
    const double h = plane->half;
    cairo_t *c = sheet->c;
    if (is_seen_from_its_edge(sheet, plane)) {
        const kt_vec3 along = kt_vec3_cross(sheet->drawing->camera.axes.z, pose.rotation.z);
        const kt_spot a = kt_sheet_place(sheet, kt_vec3_sub(pose.position, kt_vec3_scale(-h, along)));
        const kt_spot b = kt_sheet_place(sheet, kt_vec3_sub(pose.position, kt_vec3_scale(h, along)));
        const kt_spot right = kt_spot_direction(a, b); /* hatched on the side that is not the normal's */
        const bool is_right = -right.y * normal.x + right.x * -normal.y < 0.0;
        kt_paint_hatching(sheet, is_right ? a : b, is_right ? b : a);
        return;
    }
    const kt_colour paper = sheet->palette->paper;
    kt_spot corners[4];
    for (int i = 0; i < 4; i++)
        corners[i] =
            kt_sheet_place(sheet, kt_pose_apply(pose, kt_vec3_make(i == 1 || i == 2 ? h : -h, i >= 2 ? h : -h, 0.0)));
    for (int i = 0; i < 4; i++)
        cairo_line_to(c, corners[i].x, corners[i].y);
    cairo_close_path(c);
    kt_paper_fill(c, kt_colour_mix(paper, sheet->palette->quiet, 0.09),
                  kt_colour_mix(paper, sheet->palette->quiet, 0.55), 1.0);
    for (int i = 1; i < 8; i++)
        for (int k = 0; k < 2; k++) {
            const kt_spot p = kt_spot_between(corners[0], corners[k == 0 ? 1 : 3], 0.125 * i);
            const kt_spot q = kt_spot_between(corners[k == 0 ? 3 : 1], corners[2], 0.125 * i);
            kt_trace_line(c, p, q);
        }
    kt_paper_stroke(c, kt_colour_mix(paper, sheet->palette->quiet, 0.2), 0.7);
}

void kt_paint_ground(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    for (int edge = 0; edge < 2; edge++) /* squares first: they would cover the ground of a contact */
        for (int i = 0; i < p->plane_count; i++)
            if (is_seen_from_its_edge(sheet, &p->planes[i]) == (edge == 1) &&
                !kt_plane_is_paper(sheet->drawing, &p->planes[i], sheet->poses))
                paint_plane(sheet, &p->planes[i]);
    for (int i = 0; i < p->joint_count && sheet->drawing->is_diagram; i++)
        if (p->joints[i].type == KT_JOINT_PRISMATIC)
            paint_guide(sheet, &p->joints[i]);
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* A point on a line or in a plane: a roller between two lines along which it may go. */
static void paint_slot(const kt_sheet *sheet, const kt_picture_loop *loop) {
    const kt_pose pose = kt_body_frame_pose(&loop->ends[0], sheet->poses);
    const kt_vec3 axis = kt_camera_point(&sheet->drawing->camera, pose.rotation.z);
    const double across = hypot(axis.x, axis.y), r = sheet->pin, half = 3.6 * r;
    const kt_spot at = kt_sheet_frame(sheet, &loop->ends[1]);
    if (across < 0.5)
        return;
    kt_spot along = {axis.x / across, -axis.y / across};
    if (loop->type == KT_LOOP_INPLANE)
        along = (kt_spot){along.y, -along.x};
    if (along.x < 0.0)
        along = (kt_spot){-along.x, -along.y};
    for (int side = -1; side <= 1; side += 2) {
        const kt_spot from = kt_spot_offset(at, along, -half, side * 1.25 * r),
                      to = kt_spot_offset(at, along, half, side * 1.25 * r);
        if (kt_sheet_is_ground(sheet, loop->ends[0].body))
            kt_paint_hatching(sheet, side < 0 ? to : from, side < 0 ? from : to);
        else
            kt_paint_line(sheet, from, to, 1.2, kt_sheet_faded(sheet, sheet->palette->ink));
    }
}

/* A curve, or lines on a surface. */
static void paint_strokes(const kt_sheet *sheet, const kt_picture_loop *loop) {
    const kt_pose pose = kt_body_frame_pose(&loop->ends[0], sheet->poses);
    for (int i = 0; i < loop->stroke_count; i++)
        kt_paint_line(sheet, kt_sheet_place(sheet, kt_pose_apply(pose, loop->strokes[i].from)),
                      kt_sheet_place(sheet, kt_pose_apply(pose, loop->strokes[i].to)),
                      loop->type == KT_LOOP_CURVE ? 1.4 : 0.7, kt_sheet_faded(sheet, sheet->palette->quiet));
}

typedef struct wheel_brush {
    const kt_sheet *sheet;
    double width;
    kt_colour colour;
} wheel_brush;

/* Adds a stroke to the path, which it continues where it can, so that dashes run on. */
static void add_wheel_stroke(void *user, kt_stroke stroke) {
    const kt_sheet *sheet = user;
    const kt_spot from = kt_sheet_place(sheet, stroke.from), to = kt_sheet_place(sheet, stroke.to);
    double x = 0.0, y = 0.0;
    if (cairo_has_current_point(sheet->c))
        cairo_get_current_point(sheet->c, &x, &y);
    if (!cairo_has_current_point(sheet->c) || fabs(x - from.x) + fabs(y - from.y) > 0.1)
        cairo_move_to(sheet->c, from.x, from.y);
    cairo_line_to(sheet->c, to.x, to.y);
}

static void paint_wheel_stroke(void *user, kt_stroke stroke) {
    const wheel_brush *b = user;
    kt_paint_line(b->sheet, kt_sheet_place(b->sheet, stroke.from), kt_sheet_place(b->sheet, stroke.to), b->width,
                  b->colour);
}

/* Paints pitch circles as thin chain lines, pulleys as thin lines, and ropes as thick lines. */
static void paint_wheels(const kt_sheet *sheet, int index) {
    static const double chain[] = {9.0, 2.5, 1.5, 2.5};
    const kt_picture *p = sheet->drawing->picture;
    const kt_picture_loop *loop = &p->loops[index];
    const bool is_rope = loop->type == KT_LOOP_SPAN || loop->type == KT_LOOP_BELT;
    wheel_brush thin = {sheet, 1.0, kt_sheet_faded(sheet, sheet->palette->quiet)},
                thick = {sheet, 2.2, kt_sheet_faded(sheet, sheet->palette->ink)};
    if (is_rope) {
        kt_wheel_strokes(loop, sheet->poses, paint_wheel_stroke, &thin);
        kt_rope_strokes(p->loops, p->loop_count, index, sheet->poses, paint_wheel_stroke, &thick);
        return;
    }
    kt_paper_use(sheet->c, thin.colour);
    cairo_set_line_width(sheet->c, thin.width);
    cairo_set_dash(sheet->c, chain, 4, 0.0);
    kt_wheel_strokes(loop, sheet->poses, add_wheel_stroke, (void *)(uintptr_t)sheet);
    cairo_stroke(sheet->c);
    cairo_set_dash(sheet->c, NULL, 0, 0.0);
}

/* Paints the curve of a rope that is slack in the state of a sheet. Returns false if the loop is no slack rope. */
static bool paint_slack_rope(const kt_sheet *sheet, const kt_picture_loop *loop) {
    const kt_drawing *d = sheet->drawing;
    const ptrdiff_t at = sheet->poses - d->poses;
    const int state = at >= 0 ? (int)(at / d->picture->body_count) : d->state_count;
    const kt_vec3 from = kt_body_frame_pose(&loop->ends[0], sheet->poses).position;
    const kt_vec3 to = kt_body_frame_pose(&loop->ends[1], sheet->poses).position;
    const double dashes[] = {5.0, 4.0};
    kt_vec3 control[2];
    if (loop->rope == NULL || d->times == NULL || state >= d->state_count ||
        !kt_picture_rope_curve(d->picture, loop, d->times[state], from, to, control))
        return false;
    const kt_spot a = kt_sheet_place(sheet, from), b = kt_sheet_place(sheet, to);
    const kt_spot p = kt_sheet_place(sheet, control[0]), q = kt_sheet_place(sheet, control[1]);
    kt_paper_use(sheet->c, kt_sheet_faded(sheet, sheet->palette->ink));
    cairo_set_line_width(sheet->c, 1.4);
    cairo_set_dash(sheet->c, dashes, 2, 0.0);
    cairo_move_to(sheet->c, a.x, a.y);
    cairo_curve_to(sheet->c, p.x, p.y, q.x, q.y, b.x, b.y);
    cairo_stroke(sheet->c);
    cairo_set_dash(sheet->c, NULL, 0, 0.0);
    return true;
}

void kt_paint_loops(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    const kt_colour open = {0.85, 0.1, 0.1};
    for (int i = 0; i < p->loop_count; i++) {
        const kt_picture_loop *loop = &p->loops[i];
        const kt_spot a = kt_sheet_frame(sheet, &loop->ends[0]), b = kt_sheet_frame(sheet, &loop->ends[1]);
        paint_strokes(sheet, loop);
        paint_wheels(sheet, i);
        if (!paint_slack_rope(sheet, loop) && loop->type == KT_LOOP_DISTANCE)
            kt_paint_dashes(sheet, a, b, kt_sheet_faded(sheet, sheet->palette->ink), 1.4);
        if (loop->type == KT_LOOP_INLINE && kt_spot_distance(a, b) > 1.0)
            kt_paint_dashes(sheet, a, b, kt_sheet_faded(sheet, sheet->palette->quiet), 1.0);
        if (sheet->drawing->is_diagram && is_slot(loop->type))
            paint_slot(sheet, loop);
        if (sheet->drawing->shows_gaps && is_point_loop(loop->type) && kt_spot_distance(a, b) > 1.0)
            kt_paint_dashes(sheet, a, b, open, 2.0);
    }
}
