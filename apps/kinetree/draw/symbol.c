/* The symbols over all solids: joints, axes, markers, names. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"
#include "picture/solid.h"

#include <math.h>
#include <string.h>

static const double pi = 3.14159265358979323846;

/* ---- axes, markers, names ---------------------------------------------------------------------------------------- */

/* An axis as a line with a head. An axis towards the viewer is a dot in a circle. */
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
    cairo_new_sub_path(sheet->c);
    cairo_arc(sheet->c, at.x, at.y, fmax(1.7 * sheet->pin, 5.0), 0.0, 2.0 * pi);
    kt_paper_stroke(sheet->c, colour, 1.4);
    cairo_arc(sheet->c, at.x, at.y, 1.6, 0.0, 2.0 * pi);
    cairo_fill(sheet->c);
}

/* Whether a joint or the end of a loop or an effect is where a marker is. */
static bool is_occupied(const kt_sheet *sheet, kt_spot at) {
    const kt_picture *p = sheet->drawing->picture;
    bool found = false;
    for (int i = 0; i < p->joint_count && !found; i++)
        found = kt_spot_distance(kt_sheet_frame(sheet, &p->joints[i].frame), at) < 2.0;
    for (int i = 0; i < 2 * p->loop_count && !found; i++)
        found = kt_spot_distance(kt_sheet_frame(sheet, &p->loops[i / 2].ends[i % 2]), at) < 2.0;
    for (int i = 0; i < p->effect_count && !found; i++)
        for (int k = 0; k < p->effects[i].end_count && !found; k++)
            found = kt_spot_distance(kt_sheet_frame(sheet, &p->effects[i].ends[k]), at) < 2.0;
    return found;
}

enum { LABELS_MOST = 4000 };

/* The areas that labels may not cover: the middles of bodies, and other labels. */
typedef struct labels {
    int count, left_out;
    struct label {
        double left, right, top, bottom;
        const char *text; /* NULL: a middle */
        kt_spot at;
    } items[LABELS_MOST];
} labels;

static bool label_is_clear(const labels *l, struct label one) {
    static const double gap = 5.0; /* between names, which would read as one name */
    for (int i = 0; i < l->count; i++) {
        const double apart = l->items[i].text != NULL ? gap : 0.0;
        if (one.left - apart < l->items[i].right && l->items[i].left - apart < one.right &&
            one.top < l->items[i].bottom && l->items[i].top < one.bottom)
            return false;
    }
    return true;
}

/* Whether a spot has the same name already: several bodies may have a marker there. */
static bool label_is_there(const labels *l, kt_spot at, const char *text) {
    for (int i = 0; i < l->count; i++)
        if (l->items[i].text != NULL && strcmp(l->items[i].text, text) == 0 &&
            kt_spot_distance(l->items[i].at, at) < 2.0)
            return true;
    return false;
}

/* Writes a name next to a spot, on the first of eight sides where no other name is. */
static void paint_label(const kt_sheet *sheet, labels *l, kt_spot at, const char *text, kt_colour colour) {
    static const kt_spot sides[] = {{8.0, -8.0}, {8.0, 16.0},  {-8.0, -8.0}, {-8.0, 16.0},
                                    {10.0, 4.0}, {-10.0, 4.0}, {8.0, -20.0}, {8.0, 28.0}};
    cairo_set_font_size(sheet->c, kt_small_size);
    const double width = kt_paper_width(sheet->c, text);
    if (label_is_there(l, at, text))
        return;
    struct label one = {0};
    int side = 0;
    for (; side < 8; side++) {
        const double left = sides[side].x < 0.0 ? at.x + sides[side].x - width : at.x + sides[side].x;
        one = (struct label){left, left + width, at.y + sides[side].y - 9.5, at.y + sides[side].y + 2.5, text, at};
        if (label_is_clear(l, one))
            break;
    }
    if (side == 8 || l->count == LABELS_MOST) {
        l->left_out++;
        return;
    }
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

/* The middle of the first solid of a body, on the page. Returns false if the body has none. */
static bool find_middle(const kt_sheet *sheet, int body, kt_spot *at) {
    const kt_picture *p = sheet->drawing->picture;
    for (int i = 0; i < p->solid_count; i++)
        if (p->solids[i].body == body) {
            *at = kt_sheet_place(sheet, kt_pose_apply(sheet->poses[body], p->solids[i].pose.position));
            return true;
        }
    return false;
}

/* The names that have room. Those of bodies are next to their middles, and those of loops at the second end. That of a
 * wheel that rolls would be the origin of the plane: its name is at the wheel. */
static void paint_names(const kt_sheet *sheet, labels *l) {
    const kt_picture *p = sheet->drawing->picture;
    kt_spot at;
    for (int body = 1; body < p->body_count; body++)
        if (l->count < LABELS_MOST / 2 && find_middle(sheet, body, &at))
            l->items[l->count++] = (struct label){at.x, at.x, at.y, at.y, NULL, at};
    for (int body = 1; body < p->body_count; body++)
        if (find_middle(sheet, body, &at))
            paint_label(sheet, l, at, kt_body_name(p->model, body), sheet->palette->ink);
    for (int i = 0; i < p->loop_count; i++) {
        const kt_body_frame *end = &p->loops[i].ends[p->loops[i].type == KT_LOOP_ROLLING ? 0 : 1];
        paint_label(sheet, l, kt_sheet_frame(sheet, end), p->loops[i].name, sheet->palette->ink);
    }
}

void kt_paint_symbols(const kt_sheet *sheet) {
    const kt_picture *p = sheet->drawing->picture;
    if (sheet->drawing->is_diagram && sheet->fade == 0.0)
        kt_paint_mounts(sheet);
    if (!sheet->is_grey) { /* effects are shown once */
        kt_paint_effects(sheet);
        kt_paint_relations(sheet);
    }
    kt_paint_loops(sheet);
    if (sheet->drawing->is_diagram)
        kt_paint_pivots(sheet);
    for (int i = 0; i < p->joint_count && sheet->drawing->shows_axes; i++)
        paint_axis(sheet, &p->joints[i]);
    labels l;
    l.count = l.left_out = 0;
    if (sheet->drawing->shows_names && sheet->fade == 0.0)
        paint_names(sheet, &l);
    if (sheet->fade == 0.0)
        paint_markers(sheet, &l);
    if (sheet->drawing->nameless != NULL)
        *sheet->drawing->nameless += l.left_out;
}
