/* Symbols: joints, the ground, springs and dampers, planes, arrows, names. */
#include "command.h"
#include "draw_paper.h"
#include "picture/solid.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- lines ------------------------------------------------------------------------------------------------------- */

static kt_spot between(kt_spot a, kt_spot b, double share) {
    return (kt_spot){a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)};
}

static double distance(kt_spot a, kt_spot b) { return hypot(b.x - a.x, b.y - a.y); }

/* The unit direction from a to b; to the right where they are one. */
static kt_spot direction(kt_spot a, kt_spot b) {
    const double length = distance(a, b);
    return length > 1e-9 ? (kt_spot){(b.x - a.x) / length, (b.y - a.y) / length} : (kt_spot){1.0, 0.0};
}

/* Goes `ahead` along a direction and `aside` to its right (down, where it points right). */
static kt_spot offset(kt_spot from, kt_spot along, double ahead, double aside) {
    return (kt_spot){from.x + ahead * along.x - aside * along.y, from.y + ahead * along.y + aside * along.x};
}

static kt_colour faded(const kt_sheet *sheet, kt_colour colour) {
    return kt_colour_mix(colour, sheet->palette->paper, 0.85 * sheet->fade);
}

void kt_paint_line(const kt_sheet *sheet, kt_spot from, kt_spot to, double width, kt_colour colour) {
    kt_paper_use(sheet->c, colour);
    cairo_set_line_width(sheet->c, width);
    cairo_move_to(sheet->c, from.x, from.y);
    cairo_line_to(sheet->c, to.x, to.y);
    cairo_stroke(sheet->c);
}

void kt_paint_arrow(const kt_sheet *sheet, kt_spot from, kt_spot to, double width, kt_colour colour) {
    const kt_spot along = direction(from, to);
    const double head = 3.0 + 3.0 * width;
    const kt_spot neck = offset(to, along, -head, 0.0);
    const kt_spot left = offset(to, along, -head, -0.42 * head), right = offset(to, along, -head, 0.42 * head);
    kt_paint_line(sheet, from, neck, width, colour);
    cairo_move_to(sheet->c, to.x, to.y);
    cairo_line_to(sheet->c, left.x, left.y);
    cairo_line_to(sheet->c, right.x, right.y);
    cairo_close_path(sheet->c);
    cairo_fill(sheet->c);
}

void kt_paint_hatching(const kt_sheet *sheet, kt_spot from, kt_spot to) {
    const kt_spot along = direction(from, to);
    const double length = distance(from, to), step = 6.0;
    const int count = (int)fmax(round(length / step), 2.0);
    const kt_colour colour = faded(sheet, sheet->palette->quiet);
    kt_paint_line(sheet, from, to, 1.4, colour);
    for (int i = 0; i < count; i++) {
        const kt_spot top = offset(from, along, (i + 0.75) * length / count, 0.0);
        const kt_spot foot = offset(top, along, -0.75 * step, 0.75 * step);
        cairo_move_to(sheet->c, top.x, top.y);
        cairo_line_to(sheet->c, foot.x, foot.y);
    }
    cairo_set_line_width(sheet->c, 0.9);
    cairo_stroke(sheet->c);
}

static void paint_dashes(const kt_sheet *sheet, kt_spot from, kt_spot to, kt_colour colour, double width) {
    const double dashes[] = {5.0, 4.0};
    cairo_set_dash(sheet->c, dashes, 2, 0.0);
    kt_paint_line(sheet, from, to, width, colour);
    cairo_set_dash(sheet->c, NULL, 0, 0.0);
}

/* ---- springs and dampers ----------------------------------------------------------------------------------------- */

/* A triangular wave: 0, 1, 0, -1, 0 at u = 0, 1/4, 1/2, 3/4, 1. */
static double wave(double u) { return 1.0 - 4.0 * fabs(u + 0.25 - floor(u + 0.25) - 0.5); }

typedef struct wire {
    kt_spot from, to;
    double width, aside; /* of the coil, and of its middle from the line between the ends */
    int turns;
} wire;

static const double lead = 0.14; /* share of a spring that is straight at each end */

static kt_spot wire_at(const wire *w, double share) {
    const double coil = fmin(fmax((share - lead) / (1.0 - 2.0 * lead), 0.0), 1.0);
    return offset(between(w->from, w->to, share), direction(w->from, w->to), 0.0,
                  w->aside + w->width * wave(coil * w->turns));
}

/* Traces a spring from share a to share b, corner by corner. */
static void trace_wire(cairo_t *c, const wire *w, double a, double b) {
    const kt_spot first = wire_at(w, a), last = wire_at(w, b), in = wire_at(w, lead), out = wire_at(w, 1.0 - lead);
    cairo_move_to(c, first.x, first.y);
    if (a < lead && lead < b)
        cairo_line_to(c, in.x, in.y);
    for (int k = 0; k < 2 * w->turns; k++) {
        const double share = lead + (1.0 - 2.0 * lead) * (0.5 * k + 0.25) / w->turns;
        const kt_spot corner = wire_at(w, share);
        if (share > a && share < b)
            cairo_line_to(c, corner.x, corner.y);
    }
    if (a < 1.0 - lead && 1.0 - lead < b)
        cairo_line_to(c, out.x, out.y);
    cairo_line_to(c, last.x, last.y);
}

static void trace_part(cairo_t *c, kt_spot from, kt_spot to, double low, double high, double a, double b) {
    const double begin = fmax(low, a), end = fmin(high, b);
    if (begin >= end)
        return;
    const kt_spot p = between(from, to, begin), q = between(from, to, end);
    cairo_move_to(c, p.x, p.y);
    cairo_line_to(c, q.x, q.y);
}

/* Of a spring around a bar, what is in front of the bar. */
static void trace_coil(cairo_t *c, const wire *w, double a, double b) {
    for (int k = 0; k < w->turns; k++) {
        const double share = lead + (1.0 - 2.0 * lead) * (k + 0.75) / w->turns,
                     half = 0.5 * (1.0 - 2.0 * lead) / w->turns;
        const kt_spot from = wire_at(w, share), to = wire_at(w, share + half);
        if (share < a || share > b || k + 1 == w->turns)
            continue;
        cairo_move_to(c, from.x, from.y);
        cairo_line_to(c, to.x, to.y);
    }
}

/* A dashpot: a cup that is open at one end, and a piston in it. */
static void trace_dashpot(cairo_t *c, kt_spot from, kt_spot to, double width, double a, double b) {
    const kt_spot along = direction(from, to);
    const kt_spot bottom = between(from, to, 0.36), mouth = between(from, to, 0.62), piston = between(from, to, 0.5);
    const double depth = distance(bottom, mouth);
    trace_part(c, from, to, 0.0, 0.36, a, b);
    trace_part(c, from, to, 0.5, 1.0, a, b);
    for (int side = -1; side <= 1; side += 2)
        trace_part(c, offset(bottom, along, 0.0, side * width), offset(bottom, along, depth, side * width), 0.0, 1.0,
                   (a - 0.36) / 0.26, (b - 0.36) / 0.26);
    for (int i = 0; i < 2; i++) {
        const double at = i == 0 ? 0.36 : 0.5, share = i == 0 ? 1.0 : 0.72;
        const kt_spot middle = i == 0 ? bottom : piston;
        const kt_spot p = offset(middle, along, 0.0, -share * width), q = offset(middle, along, 0.0, share * width);
        if (a > at || b < at)
            continue;
        cairo_move_to(c, p.x, p.y);
        cairo_line_to(c, q.x, q.y);
    }
}

/* Both side by side hang on bars across their ends. */
static void trace_bars(cairo_t *c, kt_spot from, kt_spot to, double aside, double a, double b) {
    const kt_spot along = direction(from, to);
    for (int i = 0; i < 2; i++) {
        const double at = i == 0 ? 0.07 : 0.93;
        const kt_spot middle = between(from, to, at);
        const kt_spot p = offset(middle, along, 0.0, -aside), q = offset(middle, along, 0.0, aside);
        if (a > at || b < at)
            continue;
        cairo_move_to(c, p.x, p.y);
        cairo_line_to(c, q.x, q.y);
    }
    trace_part(c, from, to, 0.0, 0.07, a, b);
    trace_part(c, from, to, 0.93, 1.0, a, b);
}

void kt_paint_spring(const kt_sheet *sheet, kt_spot from, kt_spot to, double a, double b, bool has_stiffness,
                     bool has_damping, double around) {
    cairo_t *c = sheet->c;
    const double length = distance(from, to), width = fmin(fmax(1.15 * sheet->pin, around), 0.3 * length);
    const bool is_pair = has_stiffness && has_damping && around <= 0.0;
    const double aside = is_pair ? 1.35 * width : 0.0;
    const kt_spot along = direction(from, to);
    const double pitch = around > 0.0 ? 1.3 : 2.2; /* in half widths */
    const int turns = (int)fmin(fmax(round(length / (pitch * fmax(width, 0.1))), 4.0), 16.0);
    if (length < 2.0)
        return;
    if (is_pair) {
        trace_bars(c, from, to, aside, a, b);
        from = offset(from, along, 0.07 * length, 0.0);
        to = offset(to, along, -0.07 * length, 0.0);
        a = fmin(fmax((a - 0.07) / 0.86, 0.0), 1.0);
        b = fmin(fmax((b - 0.07) / 0.86, 0.0), 1.0);
    }
    const wire w = {from, to, width, -aside, turns};
    if (around > 0.0)
        trace_coil(c, &w, a, b);
    else if (has_stiffness || !has_damping)
        trace_wire(c, &w, a, b);
    if (has_damping && around <= 0.0)
        trace_dashpot(c, offset(from, along, 0.0, aside), offset(to, along, 0.0, aside), 0.85 * width, a, b);
    kt_paper_use(c, faded(sheet, sheet->palette->ink));
    cairo_set_line_width(c, fmin(1.3, 0.3 + 0.2 * sheet->pin));
    cairo_stroke(c);
}

/* ---- pivots ------------------------------------------------------------------------------------------------------ */

static kt_spot frame_spot(const kt_sheet *sheet, const kt_body_frame *frame) {
    return kt_sheet_place(sheet, kt_body_frame_pose(frame, sheet->poses).position);
}

static bool is_ground(const kt_sheet *sheet, int body) { return sheet->drawing->picture->part[body] == 0; }

static bool is_point_loop(kt_loop_type type) {
    return type == KT_LOOP_REVOLUTE || type == KT_LOOP_SPHERICAL || type == KT_LOOP_UNIVERSAL || type == KT_LOOP_WELD ||
           type == KT_LOOP_PRISMATIC || type == KT_LOOP_SCREW || type == KT_LOOP_CYLINDRICAL;
}

static bool is_slot(kt_loop_type type) { return type == KT_LOOP_INLINE || type == KT_LOOP_INPLANE; }

/* A dot is a line of no length, with round ends. */
static void trace_dot(cairo_t *c, kt_spot at) {
    cairo_move_to(c, at.x, at.y);
    cairo_line_to(c, at.x, at.y);
}

/* Small circles; with a dot where they close a loop. Layer by layer, which keeps files small. */
static void paint_pivots(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    const double r = sheet->pin, widths[] = {2.0 * r, 2.0 * r - fmin(2.6, r), 0.75 * r};
    const int joints = kt_sheet_is_crowded(sheet) ? 0 : p->joint_count;
    cairo_t *c = sheet->c;
    cairo_set_line_cap(c, CAIRO_LINE_CAP_ROUND);
    for (int layer = 0; layer < 3; layer++) {
        for (int i = 0; i < joints && layer < 2; i++)
            if (p->joints[i].type == KT_JOINT_REVOLUTE)
                trace_dot(c, frame_spot(sheet, &p->joints[i].frame));
        for (int i = 0; i < p->loop_count; i++)
            if (is_point_loop(p->loops[i].type) || is_slot(p->loops[i].type))
                trace_dot(c, frame_spot(sheet, &p->loops[i].ends[1]));
        kt_paper_use(c, layer == 1 ? sheet->palette->paper : faded(sheet, sheet->palette->ink));
        cairo_set_line_width(c, widths[layer]);
        cairo_stroke(c);
    }
    cairo_set_line_cap(c, CAIRO_LINE_CAP_BUTT);
}

/* A point that does not move: a triangle below it (above: where what it carries hangs down) on hatched ground. */
static void paint_mount(const kt_sheet *sheet, kt_spot at, bool is_above) {
    const double r = fmax(sheet->pin, 2.2), down = is_above ? -1.0 : 1.0;
    const kt_spot left = {at.x - 1.9 * r, at.y + down * 2.9 * r}, right = {at.x + 1.9 * r, at.y + down * 2.9 * r};
    cairo_t *c = sheet->c;
    cairo_move_to(c, at.x, at.y);
    cairo_line_to(c, left.x, left.y);
    cairo_line_to(c, right.x, right.y);
    cairo_close_path(c);
    kt_paper_use(c, sheet->palette->faint);
    cairo_fill_preserve(c);
    kt_paper_use(c, sheet->palette->quiet);
    cairo_set_line_width(c, 1.0);
    cairo_stroke(c);
    const kt_spot a = offset(left, (kt_spot){1.0, 0.0}, -r, 0.0), b = offset(right, (kt_spot){1.0, 0.0}, r, 0.0);
    kt_paint_hatching(sheet, is_above ? b : a, is_above ? a : b);
}

/* Whether the middle of a rigid part is lower on the page than a spot. */
static bool hangs(const kt_sheet *sheet, int part, kt_spot from) {
    const kt_picture *p = sheet->drawing->picture;
    double sum = 0.0;
    int count = 0;
    for (int i = 0; i < p->solid_count; i++)
        if (p->part[p->solids[i].body] == part) {
            const kt_pose pose = kt_pose_compose(sheet->poses[p->solids[i].body], p->solids[i].pose);
            sum += kt_sheet_place(sheet, pose.position).y;
            count++;
        }
    return count > 0 && sum / count > from.y + 1.5 * sheet->pin;
}

static bool turns_in_plane(kt_joint_type type) { return type == KT_JOINT_REVOLUTE; }

/* Mounts of all pivots on the ground, at one place one. */
static void paint_mounts(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    for (int i = 0; i < p->joint_count; i++) {
        const kt_picture_joint *joint = &p->joints[i];
        const kt_spot at = frame_spot(sheet, &joint->frame);
        bool again = false;
        for (int k = 0; k < i; k++)
            again = again || (is_ground(sheet, p->joints[k].frame.body) && turns_in_plane(p->joints[k].type) &&
                              distance(frame_spot(sheet, &p->joints[k].frame), at) < 1.0);
        if (is_ground(sheet, joint->frame.body) && turns_in_plane(joint->type) && !again)
            paint_mount(sheet, at, hangs(sheet, p->part[joint->body], at));
    }
    for (int i = 0; i < p->loop_count; i++)
        for (int k = 0; k < 2; k++) {
            const kt_picture_loop *loop = &p->loops[i];
            const kt_spot at = frame_spot(sheet, &loop->ends[k]);
            const bool is_pin = loop->type == KT_LOOP_REVOLUTE || loop->type == KT_LOOP_SPHERICAL;
            if (is_ground(sheet, loop->ends[k].body) && is_pin)
                paint_mount(sheet, at, hangs(sheet, p->part[loop->ends[1 - k].body], at));
        }
}

/* ---- guides ------------------------------------------------------------------------------------------------------ */

/* What a rigid part takes along and across a direction on the page, from a spot. */
typedef struct reach {
    double low, high, left, right; /* left, right: of the direction; right is down where it points right */
} reach;

static reach reach_of(const kt_sheet *sheet, int body, kt_spot from, kt_spot along) {
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

/* A slider in the plane: on the ground hatched guides, one below a block, two on both sides of a bar; else a fine line. */
static void paint_guide(const kt_sheet *sheet, const kt_picture_joint *joint) {
    const kt_drawing *d = sheet->drawing;
    const kt_pose frame = kt_body_frame_pose(&joint->frame, sheet->poses);
    const kt_spot at = kt_sheet_place(sheet, frame.position);
    const kt_spot ahead =
        kt_sheet_place(sheet, kt_vec3_add(frame.position, kt_vec3_scale(d->picture->size, frame.rotation.z)));
    if (distance(at, ahead) < 0.2 * sheet->scale * d->picture->size)
        return;
    kt_spot along = direction(at, ahead);
    if (along.x < -1e-6 || (fabs(along.x) <= 1e-6 && along.y > 0.0))
        along = (kt_spot){-along.x, -along.y};
    const kt_spot body = kt_sheet_place(sheet, sheet->poses[joint->body].position);
    const double place = (body.x - at.x) * along.x + (body.y - at.y) * along.y;
    if (!is_ground(sheet, joint->frame.body)) {
        kt_paint_line(sheet, at, body, 1.0,
                      faded(sheet, d->picture->solid_count > 0 ? sheet->palette->quiet : sheet->palette->ink));
        return;
    }
    const reach r = reach_of(sheet, joint->body, body, along);
    if (fabs(along.y) > 0.8 &&
        r.high - r.low <= 5.0 * (r.right - r.left)) { /* a block that does not rest on its guide */
        const double more = fmax(4.0 * sheet->pin, 0.15 * (r.high - r.low));
        paint_dashes(sheet, offset(body, along, r.low - more, 0.0), offset(body, along, r.high + more, 0.0),
                     faded(sheet, sheet->palette->quiet), 1.0);
        return;
    }
    const double across = r.right - r.left, length = r.high - r.low;
    const double own = fmax(2.5 * sheet->pin, 0.35 * across);
    if (length > 5.0 * across) { /* a bar: guided where the joint is */
        const double half = 2.2 * sheet->pin, inside = fmin(fmax(0.0, place + r.low + half), place + r.high - half);
        for (int side = -1; side <= 1; side += 2) {
            const double aside = side < 0 ? r.left - 1.5 : r.right + 1.5;
            const kt_spot from = offset(at, along, inside - half, aside), to = offset(at, along, inside + half, aside);
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
    kt_paint_hatching(sheet, offset(at, along, low - own, r.right + 1.5), offset(at, along, high + own, r.right + 1.5));
}

/* ---- planes ------------------------------------------------------------------------------------------------------ */

/* A plane seen from its edge is hatched ground, else a square with lines, on which things stand. */
static void paint_plane(const kt_sheet *sheet, const kt_picture_plane *plane) {
    const kt_pose pose = kt_body_frame_pose(&plane->frame, sheet->poses);
    const kt_vec3 normal = kt_camera_point(&sheet->drawing->camera, pose.rotation.z);
    const double h = plane->half;
    cairo_t *c = sheet->c;
    if (fabs(normal.z) < 0.02) {
        const kt_vec3 along = kt_vec3_cross(sheet->drawing->camera.axes.z, pose.rotation.z);
        const kt_spot a = kt_sheet_place(sheet, kt_vec3_sub(pose.position, kt_vec3_scale(-h, along)));
        const kt_spot b = kt_sheet_place(sheet, kt_vec3_sub(pose.position, kt_vec3_scale(h, along)));
        const kt_spot right = direction(a, b); /* hatched on the side that is not the normal's */
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
    kt_paper_use(c, kt_colour_mix(paper, sheet->palette->quiet, 0.09));
    cairo_fill_preserve(c);
    kt_paper_use(c, kt_colour_mix(paper, sheet->palette->quiet, 0.55));
    cairo_set_line_width(c, 1.0);
    cairo_stroke(c);
    for (int i = 1; i < 8; i++)
        for (int k = 0; k < 2; k++) {
            const kt_spot p = between(corners[0], corners[k == 0 ? 1 : 3], 0.125 * i);
            const kt_spot q = between(corners[k == 0 ? 3 : 1], corners[2], 0.125 * i);
            cairo_move_to(c, p.x, p.y);
            cairo_line_to(c, q.x, q.y);
        }
    kt_paper_use(c, kt_colour_mix(paper, sheet->palette->quiet, 0.2));
    cairo_set_line_width(c, 0.7);
    cairo_stroke(c);
}

void kt_paint_ground(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    for (int i = 0; i < p->plane_count; i++)
        paint_plane(sheet, &p->planes[i]);
    for (int i = 0; i < p->joint_count && sheet->drawing->is_diagram; i++)
        if (p->joints[i].type == KT_JOINT_PRISMATIC)
            paint_guide(sheet, &p->joints[i]);
}

/* ---- effects ----------------------------------------------------------------------------------------------------- */

/* A wall behind the end of a spring that does not move. */
static void paint_wall(const kt_sheet *sheet, kt_spot at, kt_spot from) {
    const kt_spot along = direction(from, at);
    const double half = 2.4 * fmax(sheet->pin, 3.0);
    kt_paint_hatching(sheet, offset(at, along, 0.0, half), offset(at, along, 0.0, -half));
}

static void paint_link(const kt_sheet *sheet, const kt_picture_effect *effect) {
    const kt_spot a = frame_spot(sheet, &effect->ends[0]), b = frame_spot(sheet, &effect->ends[1]);
    const bool is_far = distance(a, b) > 3.0;
    const bool is_centre = effect->ends[0].body == 0 || effect->ends[1].body == 0;
    for (int k = 0; k < 2 && effect->type != KT_EFFECT_ATTRACTION && is_far; k++)
        if (is_ground(sheet, effect->ends[k].body))
            paint_wall(sheet, k == 0 ? a : b, k == 0 ? b : a);
    if (effect->type == KT_EFFECT_ATTRACTION && is_centre) { /* towards the centre, which may be far away */
        const kt_spot from = effect->ends[0].body == 0 ? b : a, to = effect->ends[0].body == 0 ? a : b;
        const double start = 3.0 * sheet->pin, length = fmin(distance(a, b), start + 36.0);
        kt_paint_arrow(sheet, offset(from, direction(from, to), fmin(start, 0.5 * length), 0.0),
                       offset(from, direction(from, to), length, 0.0), 1.2, faded(sheet, sheet->palette->quiet));
    } else if (effect->type == KT_EFFECT_ATTRACTION)
        paint_dashes(sheet, a, b, faded(sheet, sheet->palette->quiet), 1.0);
    else if (effect->type == KT_EFFECT_SPRING && sheet->drawing->is_diagram)
        kt_paint_spring(sheet, a, b, 0.0, 1.0, effect->has_stiffness, effect->has_damping, 0.0);
}

/* A bushing: a square of rubber with a cross in it. */
static void paint_bushing(const kt_sheet *sheet, kt_spot at) {
    const double h = 1.5 * fmax(sheet->pin, 3.0);
    cairo_t *c = sheet->c;
    cairo_rectangle(c, at.x - h, at.y - h, 2.0 * h, 2.0 * h);
    kt_paper_use(c, sheet->palette->paper);
    cairo_fill_preserve(c);
    cairo_move_to(c, at.x - h, at.y - h);
    cairo_line_to(c, at.x + h, at.y + h);
    cairo_move_to(c, at.x - h, at.y + h);
    cairo_line_to(c, at.x + h, at.y - h);
    kt_paper_use(c, faded(sheet, sheet->palette->ink));
    cairo_set_line_width(c, 1.1);
    cairo_stroke(c);
}

/* An arc with a head, anticlockwise, around a spot; clockwise where `sign` is negative. */
static void paint_arc(const kt_sheet *sheet, kt_spot at, double sign, kt_colour colour) {
    const double r = 2.9 * fmax(sheet->pin, 3.0), middle = 1.45 * pi, end = middle - 0.3 * pi * sign;
    const kt_spot tip = {at.x + r * cos(end), at.y + r * sin(end)};
    const kt_spot ahead = {sign * sin(end - 0.08 * sign), -sign * cos(end - 0.08 * sign)};
    cairo_t *c = sheet->c;
    cairo_new_sub_path(c);
    cairo_arc(c, at.x, at.y, r, middle - 0.3 * pi, middle + 0.3 * pi);
    kt_paper_use(c, colour);
    cairo_set_line_width(c, 1.4);
    cairo_stroke(c);
    kt_paint_arrow(sheet, offset(tip, ahead, -3.5, 0.0), offset(tip, ahead, 4.5, 0.0), 1.4, colour);
}

/* An arc around a driven joint that turns; an arrow along one that slides. In diagrams alone. */
static void paint_motor(const kt_sheet *sheet, const kt_picture_joint *joint) {
    const kt_pose frame = kt_body_frame_pose(&joint->frame, sheet->poses);
    const kt_vec3 axis = kt_camera_point(&sheet->drawing->camera, frame.rotation.z);
    const kt_spot at = kt_sheet_place(sheet, frame.position);
    const double r = 2.9 * fmax(sheet->pin, 3.0), across = hypot(axis.x, axis.y);
    const kt_colour ink = faded(sheet, sheet->palette->ink);
    if (!sheet->drawing->is_diagram)
        return;
    if (joint->type == KT_JOINT_PRISMATIC && across > 0.2) {
        const kt_spot along = {axis.x / across, -axis.y / across};
        kt_paint_arrow(sheet, offset(at, along, -1.2 * r, 1.4 * r), offset(at, along, 1.2 * r, 1.4 * r), 1.3, ink);
    } else if (fabs(axis.z) > 0.5) {
        paint_arc(sheet, at, axis.z > 0.0 ? 1.0 : -1.0, ink);
    }
}

/* The spot at (x, y, z) of a joint's frame, in units of the page. */
static kt_spot joint_spot(const kt_sheet *sheet, const kt_picture_joint *joint, double x, double y, double z) {
    const kt_pose frame = kt_body_frame_pose(&joint->frame, sheet->poses);
    const kt_vec3 at = kt_vec3_scale(1.0 / sheet->scale, kt_vec3_make(x, y, z));
    return kt_sheet_place(sheet, kt_pose_apply(frame, at));
}

/* A spiral around a joint that turns; a zigzag next to one that slides. In diagrams alone. */
static void paint_joint_spring(const kt_sheet *sheet, const kt_picture_joint *joint) {
    const double r = 0.9 * fmax(sheet->pin, 3.0);
    const bool slides = joint->type == KT_JOINT_PRISMATIC;
    const int steps = slides ? 8 : 60;
    for (int i = 0; i <= steps; i++) {
        const double s = (double)i / steps, angle = 5.0 * pi * s, out = (1.5 + 2.0 * s) * r;
        const kt_spot at = slides ? joint_spot(sheet, joint, (i % 2 != 0 ? 2.6 : 1.8) * r, 0.0, (i - 4) * 0.8 * r)
                                  : joint_spot(sheet, joint, out * cos(angle), out * sin(angle), 0.0);
        cairo_line_to(sheet->c, at.x, at.y);
    }
    kt_paper_use(sheet->c, faded(sheet, sheet->palette->ink));
    cairo_set_line_width(sheet->c, 1.1);
    cairo_stroke(sheet->c);
}

/* The direction of what a joint carries at position 0: of the first solid of its body that is not at the joint. */
static double lever_of(const kt_picture *p, const kt_picture_joint *joint) {
    for (int i = 0; i < p->solid_count; i++) {
        const kt_vec3 at = kt_mat3_apply(joint->child, p->solids[i].pose.position);
        if (p->solids[i].body == joint->body && hypot(at.x, at.y) > 0.0)
            return atan2(at.y, at.x);
    }
    return 0.0;
}

/* A bar across the way of what a joint carries where it is at a limit. In diagrams alone. */
static void paint_stop(const kt_sheet *sheet, const kt_picture_joint *joint, double limit) {
    const double r = fmax(sheet->pin, 3.0), z = sheet->scale * limit;
    const double angle = lever_of(sheet->drawing->picture, joint) + limit;
    const kt_colour ink = faded(sheet, sheet->palette->ink);
    if (!isfinite(limit))
        return;
    if (joint->type == KT_JOINT_PRISMATIC)
        kt_paint_line(sheet, joint_spot(sheet, joint, -2.5 * r, 0.0, z), joint_spot(sheet, joint, 2.5 * r, 0.0, z), 1.8,
                      ink);
    else
        kt_paint_line(sheet, joint_spot(sheet, joint, 2.0 * r * cos(angle), 2.0 * r * sin(angle), 0.0),
                      joint_spot(sheet, joint, 5.5 * r * cos(angle), 5.5 * r * sin(angle), 0.0), 1.8, ink);
}

static void paint_in_joint(const kt_sheet *sheet, const kt_picture_effect *effect) {
    const kt_picture_joint *joint = &sheet->drawing->picture->joints[effect->joint];
    if (effect->type == KT_EFFECT_MOTOR || effect->type == KT_EFFECT_SERVO) {
        paint_motor(sheet, joint);
    } else if (sheet->drawing->is_diagram && effect->type == KT_EFFECT_JOINT_SPRING) {
        paint_joint_spring(sheet, joint);
    } else if (sheet->drawing->is_diagram && effect->type == KT_EFFECT_JOINT_LIMIT) {
        paint_stop(sheet, joint, effect->lower);
        paint_stop(sheet, joint, effect->upper);
    }
}

/* A prescribed motion as a motor; a coupling as a dashed line between its joints. In diagrams alone. */
static void paint_relations(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    for (int i = 0; i < p->relation_count && sheet->drawing->is_diagram; i++) {
        const kt_picture_relation *relation = &p->relations[i];
        const kt_picture_joint *joint = &p->joints[relation->joint];
        if (relation->other < 0)
            paint_motor(sheet, joint);
        else
            paint_dashes(sheet, frame_spot(sheet, &joint->frame), frame_spot(sheet, &p->joints[relation->other].frame),
                         faded(sheet, sheet->palette->quiet), 1.0);
    }
}

/* A force as an arrow whose head is at its point; a torque, where it turns in the picture, as an arc. */
static void paint_load(const kt_sheet *sheet, const kt_picture_effect *effect) {
    const kt_pose frame = kt_body_frame_pose(&effect->ends[0], sheet->poses);
    const kt_vec3 world = effect->is_carried ? kt_mat3_apply(frame.rotation, effect->direction) : effect->direction;
    const kt_vec3 d = kt_camera_point(&sheet->drawing->camera, world);
    const kt_spot at = kt_sheet_place(sheet, frame.position);
    const kt_colour colour = faded(sheet, sheet->palette->series[1]);
    if (effect->type == KT_EFFECT_FORCE && hypot(d.x, d.y) > 0.2)
        kt_paint_arrow(sheet, (kt_spot){at.x - 46.0 * d.x, at.y + 46.0 * d.y}, at, 2.0, colour);
    else if (effect->type == KT_EFFECT_TORQUE && fabs(d.z) > 0.5)
        paint_arc(sheet, at, d.z > 0.0 ? 1.0 : -1.0, colour);
}

static void paint_effects(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    for (int i = 0; i < p->effect_count; i++) {
        const kt_picture_effect *effect = &p->effects[i];
        if (effect->type == KT_EFFECT_SPRING || effect->type == KT_EFFECT_ATTRACTION)
            paint_link(sheet, effect);
        else if (effect->type == KT_EFFECT_FORCE || effect->type == KT_EFFECT_TORQUE)
            paint_load(sheet, effect);
        else if (effect->type == KT_EFFECT_BUSHING && sheet->drawing->is_diagram)
            paint_bushing(sheet, frame_spot(sheet, &effect->ends[0]));
        else if (effect->joint >= 0)
            paint_in_joint(sheet, effect);
    }
}

/* ---- loops ------------------------------------------------------------------------------------------------------- */

/* A point on a line or in a plane: a roller between two lines along which it may go. */
static void paint_slot(const kt_sheet *sheet, const kt_picture_loop *loop) {
    const kt_pose pose = kt_body_frame_pose(&loop->ends[0], sheet->poses);
    const kt_vec3 axis = kt_camera_point(&sheet->drawing->camera, pose.rotation.z);
    const double across = hypot(axis.x, axis.y), r = sheet->pin, half = 3.6 * r;
    const kt_spot at = frame_spot(sheet, &loop->ends[1]);
    if (across < 0.5)
        return;
    kt_spot along = {axis.x / across, -axis.y / across};
    if (loop->type == KT_LOOP_INPLANE)
        along = (kt_spot){along.y, -along.x};
    if (along.x < 0.0)
        along = (kt_spot){-along.x, -along.y};
    for (int side = -1; side <= 1; side += 2) {
        const kt_spot from = offset(at, along, -half, side * 1.25 * r), to = offset(at, along, half, side * 1.25 * r);
        if (is_ground(sheet, loop->ends[0].body))
            kt_paint_hatching(sheet, side < 0 ? to : from, side < 0 ? from : to);
        else
            kt_paint_line(sheet, from, to, 1.2, faded(sheet, sheet->palette->ink));
    }
}

static void paint_loops(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    const kt_colour open = {0.85, 0.1, 0.1};
    for (int i = 0; i < p->loop_count; i++) {
        const kt_picture_loop *loop = &p->loops[i];
        const kt_spot a = frame_spot(sheet, &loop->ends[0]), b = frame_spot(sheet, &loop->ends[1]);
        if (loop->type == KT_LOOP_DISTANCE)
            paint_dashes(sheet, a, b, faded(sheet, sheet->palette->ink), 1.4);
        else if (loop->type == KT_LOOP_INLINE && distance(a, b) > 1.0)
            paint_dashes(sheet, a, b, faded(sheet, sheet->palette->quiet), 1.0);
        if (sheet->drawing->is_diagram && is_slot(loop->type))
            paint_slot(sheet, loop);
        if (sheet->drawing->shows_gaps && is_point_loop(loop->type) && distance(a, b) > 1.0)
            paint_dashes(sheet, a, b, open, 2.0);
    }
}

/* ---- axes, markers, names ---------------------------------------------------------------------------------------- */

/* An axis as a line with a head; one that points at the viewer as a dot in a circle. */
static void paint_axis(const kt_sheet *sheet, const kt_picture_joint *joint) {
    const kt_pose frame = kt_body_frame_pose(&joint->frame, sheet->poses);
    const kt_vec3 axis = kt_camera_point(&sheet->drawing->camera, frame.rotation.z);
    const kt_colour colour = sheet->palette->series[1];
    const kt_spot at = kt_sheet_place(sheet, frame.position);
    const double length = fmax(6.0 * sheet->pin, 26.0);
    if (joint->type == KT_JOINT_FREE || joint->type == KT_JOINT_SPHERICAL)
        return;
    if (hypot(axis.x, axis.y) > 0.15) {
        kt_paint_arrow(sheet, (kt_spot){at.x - 0.6 * length * axis.x, at.y + 0.6 * length * axis.y},
                       (kt_spot){at.x + length * axis.x, at.y - length * axis.y}, 1.4, colour);
        return;
    }
    kt_paper_use(sheet->c, colour);
    cairo_new_sub_path(sheet->c);
    cairo_arc(sheet->c, at.x, at.y, fmax(1.7 * sheet->pin, 5.0), 0.0, 2.0 * pi);
    cairo_set_line_width(sheet->c, 1.4);
    cairo_stroke(sheet->c);
    cairo_arc(sheet->c, at.x, at.y, 1.6, 0.0, 2.0 * pi);
    cairo_fill(sheet->c);
}

/* Whether a joint or the end of a loop or an effect is where a marker is. */
static bool is_occupied(const kt_sheet *sheet, kt_spot at) {
    const kt_picture *p = sheet->drawing->picture;
    bool found = false;
    for (int i = 0; i < p->joint_count && !found; i++)
        found = distance(frame_spot(sheet, &p->joints[i].frame), at) < 2.0;
    for (int i = 0; i < 2 * p->loop_count && !found; i++)
        found = distance(frame_spot(sheet, &p->loops[i / 2].ends[i % 2]), at) < 2.0;
    for (int i = 0; i < p->effect_count && !found; i++)
        for (int k = 0; k < p->effects[i].end_count && !found; k++)
            found = distance(frame_spot(sheet, &p->effects[i].ends[k]), at) < 2.0;
    return found;
}

enum { LABELS_MOST = 400 };

/* Where labels are already. */
typedef struct labels {
    int count;
    struct label {
        double left, right, top, bottom;
    } items[LABELS_MOST];
} labels;

static bool is_clear(const labels *l, struct label one) {
    for (int i = 0; i < l->count; i++)
        if (one.left < l->items[i].right && l->items[i].left < one.right && one.top < l->items[i].bottom &&
            l->items[i].top < one.bottom)
            return false;
    return true;
}

/* Writes a name next to a spot, on the first of eight sides where no other name is. */
static void paint_label(const kt_sheet *sheet, labels *l, kt_spot at, const char *text, kt_colour colour) {
    static const kt_spot sides[] = {{8.0, -8.0}, {8.0, 16.0},  {-8.0, -8.0}, {-8.0, 16.0},
                                    {10.0, 4.0}, {-10.0, 4.0}, {8.0, -20.0}, {8.0, 28.0}};
    cairo_set_font_size(sheet->c, kt_small_size);
    const double width = kt_paper_width(sheet->c, text);
    struct label one = {0};
    int side = 0;
    for (; side < 8; side++) {
        const double left = sides[side].x < 0.0 ? at.x + sides[side].x - width : at.x + sides[side].x;
        one = (struct label){left, left + width, at.y + sides[side].y - 9.5, at.y + sides[side].y + 2.5};
        if (is_clear(l, one))
            break;
    }
    if (side == 8 || l->count == LABELS_MOST)
        return;
    l->items[l->count++] = one;
    const kt_colour paper = sheet->palette->paper;
    cairo_set_source_rgba(sheet->c, paper.red, paper.green, paper.blue, 0.72);
    cairo_rectangle(sheet->c, one.left - 1.5, one.top, width + 3.0, one.bottom - one.top);
    cairo_fill(sheet->c);
    kt_paper_use(sheet->c, colour);
    kt_paper_text(sheet->c, one.left, one.bottom - 2.5, KT_ANCHOR_LEFT, text);
}

/* A fine line from a marker that is in no solid of its rigid part to the nearest one. */
static void paint_leader(const kt_sheet *sheet, int body, kt_vec3 at) {
    const kt_picture *p = sheet->drawing->picture;
    double least = 1e300;
    kt_vec3 nearest = at;
    for (int i = 0; i < p->solid_count; i++) {
        if (p->part[p->solids[i].body] != p->part[body])
            continue;
        const kt_pose pose = kt_pose_compose(sheet->poses[p->solids[i].body], p->solids[i].pose);
        const kt_vec3 local = kt_pose_apply(kt_pose_invert(pose), at);
        const kt_vec3 found = kt_pose_apply(pose, kt_solid_nearest(&p->solids[i], local));
        const double far = kt_vec3_norm(kt_vec3_sub(found, at));
        nearest = far < least ? found : nearest;
        least = fmin(far, least);
    }
    if (least * sheet->scale > 2.0 * sheet->pin && least < 1e300)
        kt_paint_line(sheet, kt_sheet_place(sheet, at), kt_sheet_place(sheet, nearest), 0.7, sheet->palette->quiet);
}

/* Markers that are at no joint or end: small crosses. */
static void paint_markers(const kt_sheet *sheet, labels *l) {
    const kt_picture *p = sheet->drawing->picture;
    const double h = 3.2;
    for (int body = 0; body < p->body_count; body++)
        for (int k = 0; k < kt_marker_count(p->model, body); k++) {
            const kt_vec3 point = kt_pose_apply(sheet->poses[body], kt_marker_at(p->model, body, k));
            const kt_spot at = kt_sheet_place(sheet, point);
            if (!sheet->drawing->shows_names && is_occupied(sheet, at))
                continue;
            paint_leader(sheet, body, point);
            kt_paint_line(sheet, (kt_spot){at.x - h, at.y}, (kt_spot){at.x + h, at.y}, 1.1, sheet->palette->ink);
            kt_paint_line(sheet, (kt_spot){at.x, at.y - h}, (kt_spot){at.x, at.y + h}, 1.1, sheet->palette->ink);
            if (sheet->drawing->shows_names)
                paint_label(sheet, l, at, kt_marker_name(p->model, body, k), sheet->palette->quiet);
        }
}

/* The names that have room: of each body next to the middle of its first solid; of each loop at its second end. */
static void paint_names(const kt_sheet *sheet, labels *l) {
    const kt_picture *p = sheet->drawing->picture;
    for (int body = 1; body < p->body_count; body++)
        for (int i = 0; i < p->solid_count; i++)
            if (p->solids[i].body == body) {
                const kt_vec3 at = kt_pose_apply(sheet->poses[body], p->solids[i].pose.position);
                paint_label(sheet, l, kt_sheet_place(sheet, at), kt_body_name(p->model, body), sheet->palette->ink);
                break;
            }
    for (int i = 0; i < p->loop_count; i++) {
        paint_label(sheet, l, frame_spot(sheet, &p->loops[i].ends[1]), p->loops[i].name, sheet->palette->ink);
    }
}

void kt_paint_symbols(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    if (sheet->drawing->is_diagram && sheet->fade == 0.0)
        paint_mounts(sheet);
    paint_effects(sheet);
    paint_loops(sheet);
    paint_relations(sheet);
    if (sheet->drawing->is_diagram)
        paint_pivots(sheet);
    for (int i = 0; i < p->joint_count && sheet->drawing->shows_axes; i++)
        paint_axis(sheet, &p->joints[i]);
    labels l = {.count = 0};
    if (sheet->drawing->shows_names && sheet->fade == 0.0)
        paint_names(sheet, &l);
    if (sheet->fade == 0.0)
        paint_markers(sheet, &l);
}
