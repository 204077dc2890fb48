/* Solids as shapes of the page: outlines that are exact for each type, three tones for the faces of a box. Round solids
 * have soft shades. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"

#include <math.h>

static const double pi = 3.14159265358979323846;

enum { SHADED_MOST = 120 }; /* solids; more are painted flat, so that the file stays small */

/* ---- colours ----------------------------------------------------------------------------------------------------- */

static const kt_colour white = {1.0, 1.0, 1.0}, black = {0.0, 0.0, 0.0};

kt_colour kt_paint_shade(kt_colour colour, kt_vec3 n) {
    const kt_vec3 light = {-0.41, 0.71, 0.57};
    const double bright = kt_vec3_dot(n, light);
    return bright > 0.4 ? kt_colour_mix(colour, white, 0.45 * (bright - 0.4))
                        : kt_colour_mix(colour, black, 0.34 * (0.4 - bright));
}

static bool is_shaded(const kt_sheet *sheet, double radius) {
    return radius >= 7.0 && sheet->fade == 0.0 && !sheet->drawing->is_plain &&
           sheet->drawing->picture->solid_count <= SHADED_MOST;
}

/* A gradient across a round bar: dark on the side that is turned from the light. The unit direction `across` starts
 * from the middle of the bar on the page. */
static cairo_pattern_t *round_shade(kt_colour colour, kt_spot middle, kt_spot across, double radius) {
    cairo_pattern_t *pattern = cairo_pattern_create_linear(middle.x - radius * across.x, middle.y - radius * across.y,
                                                           middle.x + radius * across.x, middle.y + radius * across.y);
    for (int i = 0; i <= 2; i++) {
        const double s = i - 1.0;
        const kt_vec3 normal = kt_vec3_make(s * across.x, -s * across.y, sqrt(fmax(1.0 - s * s, 0.0)));
        const kt_colour tone = kt_paint_shade(colour, normal);
        cairo_pattern_add_color_stop_rgb(pattern, 0.5 * i, tone.red, tone.green, tone.blue);
    }
    return pattern;
}

static cairo_pattern_t *ball_shade(kt_colour colour, kt_spot middle, double radius) {
    cairo_pattern_t *pattern =
        cairo_pattern_create_radial(middle.x - 0.35 * radius, middle.y - 0.45 * radius, 0.0, middle.x - 0.1 * radius,
                                    middle.y - 0.1 * radius, 1.15 * radius);
    const kt_colour bright = kt_colour_mix(colour, white, 0.42), dark = kt_colour_mix(colour, black, 0.3);
    cairo_pattern_add_color_stop_rgb(pattern, 0.0, bright.red, bright.green, bright.blue);
    cairo_pattern_add_color_stop_rgb(pattern, 0.5, colour.red, colour.green, colour.blue);
    cairo_pattern_add_color_stop_rgb(pattern, 1.0, dark.red, dark.green, dark.blue);
    return pattern;
}

static void use_pattern(cairo_t *c, cairo_pattern_t *pattern) {
    cairo_set_source(c, pattern);
    cairo_pattern_destroy(pattern);
}

/* ---- round bars -------------------------------------------------------------------------------------------------- */

static void stroke_bar(cairo_t *c, kt_spot a, kt_spot b, double width, bool round_a, bool round_b) {
    cairo_set_line_width(c, width);
    cairo_set_line_cap(c, round_a && round_b ? CAIRO_LINE_CAP_ROUND : CAIRO_LINE_CAP_BUTT);
    kt_trace_line(c, a, b);
    cairo_stroke(c);
    cairo_set_line_cap(c, CAIRO_LINE_CAP_ROUND);
    if (round_a != round_b) { /* one end is a cut */
        const kt_spot end = round_a ? a : b;
        kt_trace_line(c, end, end);
        cairo_stroke(c);
    }
    cairo_set_line_cap(c, CAIRO_LINE_CAP_BUTT);
}

static void paint_rod(const kt_sheet *sheet, const kt_piece *piece, kt_colour colour) {
    const kt_pose pose = piece->solid.pose;
    const double half = piece->solid.half.z, near = 1e-9 * half;
    const double radius = fmax(sheet->scale * piece->solid.half.x, 1.1);
    const kt_spot a = kt_sheet_spot(sheet, kt_pose_apply(pose, kt_vec3_make(0.0, 0.0, piece->low)));
    const kt_spot b = kt_sheet_spot(sheet, kt_pose_apply(pose, kt_vec3_make(0.0, 0.0, piece->high)));
    const bool round_a = piece->low <= -half + near, round_b = piece->high >= half - near;
    const double length = hypot(b.x - a.x, b.y - a.y);
    const bool has_edge = radius >= 2.0 && !kt_sheet_is_plain(sheet);
    if (has_edge) {
        kt_paper_use(sheet->c, kt_sheet_edge(sheet, colour));
        stroke_bar(sheet->c, a, b, 2.0 * radius + 0.5, round_a, round_b);
    }
    const kt_spot middle = {0.5 * (a.x + b.x), 0.5 * (a.y + b.y)};
    const kt_vec3 axis = pose.rotation.z;
    kt_paper_use(sheet->c, kt_paint_shade(colour, kt_vec3_make(0.0, 0.35, sqrt(1.0 - 0.35 * 0.35))));
    if (is_shaded(sheet, radius) && length > 0.5 * radius) {
        const double across = hypot(axis.x, axis.y);
        use_pattern(sheet->c, round_shade(colour, middle, (kt_spot){axis.y / across, axis.x / across}, radius));
    } else if (is_shaded(sheet, radius)) {
        use_pattern(sheet->c, ball_shade(colour, middle, radius));
    }
    stroke_bar(sheet->c, a, b, has_edge ? 2.0 * radius - 1.5 : 2.0 * radius, round_a, round_b);
}

static void paint_ball(const kt_sheet *sheet, const kt_piece *piece, kt_colour colour) {
    const kt_spot middle = kt_sheet_spot(sheet, piece->solid.pose.position);
    const double radius = fmax(sheet->scale * piece->solid.half.x, 2.5);
    cairo_new_sub_path(sheet->c);
    cairo_arc(sheet->c, middle.x, middle.y, radius, 0.0, 2.0 * pi);
    kt_paper_use(sheet->c, colour);
    if (is_shaded(sheet, radius))
        use_pattern(sheet->c, ball_shade(colour, middle, radius));
    cairo_fill_preserve(sheet->c);
    kt_paper_stroke(sheet->c, kt_sheet_edge(sheet, colour), 1.0);
}

/* ---- boxes ------------------------------------------------------------------------------------------------------- */

/* The corners of the face normal to axis `out` (0 for x) on side `sign`, in turn, in the solid's frame. */
static void face_corners(const kt_piece *piece, int out, double sign, kt_vec3 corners[4]) {
    const int u = (out + 1) % 3, v = (out + 2) % 3;
    for (int i = 0; i < 4; i++) {
        double at[3];
        at[out] = sign;
        at[u] = i == 1 || i == 2 ? 1.0 : -1.0;
        at[v] = i >= 2 ? 1.0 : -1.0;
        corners[i] = kt_vec3_make(at[0] * piece->solid.half.x, at[1] * piece->solid.half.y,
                                  at[2] > 0.0 ? piece->high : piece->low);
    }
}

static bool piece_is_cut(const kt_piece *piece, double z) { return fabs(z) < piece->solid.half.z * (1.0 - 1e-9); }

/* Lines along a face, but for where the piece was cut. */
static void trace_edges(const kt_sheet *sheet, const kt_piece *piece, const kt_vec3 corners[4]) {
    for (int i = 0; i < 4; i++) {
        const kt_vec3 from = corners[i], to = corners[(i + 1) % 4];
        if (from.z == to.z && piece_is_cut(piece, from.z))
            continue;
        const kt_spot a = kt_sheet_spot(sheet, kt_pose_apply(piece->solid.pose, from));
        const kt_spot b = kt_sheet_spot(sheet, kt_pose_apply(piece->solid.pose, to));
        kt_trace_line(sheet->c, a, b);
    }
}

static void paint_box(const kt_sheet *sheet, const kt_piece *piece, kt_colour colour) {
    const kt_mat3 r = piece->solid.pose.rotation;
    const kt_vec3 axes[3] = {r.x, r.y, r.z};
    cairo_t *c = sheet->c;
    cairo_set_line_cap(c, CAIRO_LINE_CAP_ROUND);
    for (int face = 0; face < 6; face++) {
        const double sign = face % 2 == 0 ? 1.0 : -1.0;
        const kt_vec3 normal = kt_vec3_scale(sign, axes[face / 2]);
        kt_vec3 corners[4];
        if (normal.z < 1e-6 || (face / 2 == 2 && piece_is_cut(piece, sign > 0.0 ? piece->high : piece->low)))
            continue;
        face_corners(piece, face / 2, sign, corners);
        for (int i = 0; i < 4; i++) {
            const kt_spot at = kt_sheet_spot(sheet, kt_pose_apply(piece->solid.pose, corners[i]));
            cairo_line_to(c, at.x, at.y);
        }
        cairo_close_path(c);
        const kt_colour tone = kt_paint_shade(colour, normal.z > 0.999 ? kt_vec3_make(0.0, 0.35, 0.94) : normal);
        const bool is_whole = !piece_is_cut(piece, piece->low) && !piece_is_cut(piece, piece->high);
        kt_paper_use(c, tone);
        cairo_fill_preserve(c);
        if (!is_whole) {
            cairo_set_line_width(c, 0.6);
            cairo_stroke(c);
            trace_edges(sheet, piece, corners);
        }
        kt_paper_stroke(c, kt_sheet_edge(sheet, colour), 1.0);
    }
    cairo_set_line_cap(c, CAIRO_LINE_CAP_BUTT);
}

/* ---- cylinders --------------------------------------------------------------------------------------------------- */

/* Half of an ellipse, or all of it: around `middle`, `minor` along the unit direction `along`, `major` across it. */
static void trace_ellipse(cairo_t *c, kt_spot middle, kt_spot along, double minor, double major, double from,
                          double to) {
    cairo_matrix_t matrix,
        own = {along.x * minor, along.y * minor, -along.y * major, along.x * major, middle.x, middle.y};
    cairo_get_matrix(c, &matrix);
    cairo_transform(c, &own);
    cairo_arc(c, 0.0, 0.0, 1.0, from, to);
    cairo_set_matrix(c, &matrix);
}

/* An ellipse of no width would make cairo's matrix singular. */
static double wide_enough(double minor) { return fmax(minor, 1e-3); }

static void paint_cylinder(const kt_sheet *sheet, const kt_piece *piece, kt_colour colour) {
    cairo_t *c = sheet->c;
    const kt_pose pose = piece->solid.pose;
    const kt_vec3 axis = pose.rotation.z;
    const double sign = axis.z >= 0.0 ? 1.0 : -1.0, across = hypot(axis.x, axis.y);
    const double z_near = sign > 0.0 ? piece->high : piece->low, z_far = sign > 0.0 ? piece->low : piece->high;
    const kt_spot near = kt_sheet_spot(sheet, kt_pose_apply(pose, kt_vec3_make(0.0, 0.0, z_near)));
    const kt_spot far = kt_sheet_spot(sheet, kt_pose_apply(pose, kt_vec3_make(0.0, 0.0, z_far)));
    const double radius = fmax(sheet->scale * piece->solid.half.x, 1.1), minor = wide_enough(radius * fabs(axis.z));
    const kt_spot along =
        across > 1e-9 ? (kt_spot){sign * axis.x / across, -sign * axis.y / across} : (kt_spot){1.0, 0.0};
    const kt_colour edge = kt_sheet_edge(sheet, colour);
    cairo_new_path(c);
    if (across > 1e-6) { /* the side: half of the far rim, and half of the near one */
        trace_ellipse(c, far, along, minor, radius, 0.5 * pi, 1.5 * pi);
        trace_ellipse(c, near, along, minor, radius, -0.5 * pi, 0.5 * pi);
        cairo_close_path(c);
        const kt_spot middle = {0.5 * (near.x + far.x), 0.5 * (near.y + far.y)};
        kt_paper_use(c, kt_paint_shade(colour, kt_vec3_make(0.0, 0.35, 0.94)));
        if (is_shaded(sheet, radius))
            use_pattern(c, round_shade(colour, middle, (kt_spot){-along.y, along.x}, radius));
        cairo_fill_preserve(c);
        kt_paper_use(c, edge);
        cairo_set_line_width(c, 1.0);
        if (piece_is_cut(piece, piece->low) || piece_is_cut(piece, piece->high)) {
            cairo_new_path(c);
            for (int side = -1; side <= 1; side += 2) {
                cairo_move_to(c, far.x - side * radius * along.y, far.y + side * radius * along.x);
                cairo_line_to(c, near.x - side * radius * along.y, near.y + side * radius * along.x);
            }
            cairo_new_sub_path(c);
            if (!piece_is_cut(piece, z_far))
                trace_ellipse(c, far, along, minor, radius, 0.5 * pi, 1.5 * pi);
        }
        cairo_stroke(c);
    }
    if (fabs(axis.z) < 1e-6 || piece_is_cut(piece, z_near))
        return;
    cairo_new_sub_path(c);
    trace_ellipse(c, near, along, minor, radius, 0.0, 2.0 * pi);
    cairo_close_path(c);
    kt_paper_use(
        c, kt_paint_shade(colour, fabs(axis.z) > 0.999 ? kt_vec3_make(0.0, 0.35, 0.94) : kt_vec3_scale(sign, axis)));
    cairo_fill_preserve(c);
    kt_paper_stroke(c, edge, 1.0);
    if (radius > 14.0) { /* a radius, which shows how it turns */
        const kt_spot rim = kt_sheet_spot(sheet, kt_pose_apply(pose, kt_vec3_make(piece->solid.half.x, 0.0, z_near)));
        kt_trace_line(c, near, rim);
        cairo_set_line_width(c, 0.8);
        cairo_stroke(c);
    }
}

/* A piece that is a little longer where it was cut, so that no gap shows. */
static kt_piece lengthen(const kt_sheet *sheet, const kt_piece *piece) {
    kt_piece longer = *piece;
    const double more = fmin(0.6 / sheet->scale, 1e-3 * piece->solid.half.z + 0.25 * (piece->high - piece->low));
    longer.low -= piece_is_cut(piece, piece->low) ? more : 0.0;
    longer.high += piece_is_cut(piece, piece->high) ? more : 0.0;
    return longer;
}

void kt_paint_piece(const kt_sheet *sheet, const kt_piece *piece, kt_colour colour) {
    const kt_piece longer = lengthen(sheet, piece);
    switch (piece->solid.type) {
    case KT_SOLID_BOX:
        paint_box(sheet, &longer, colour);
        break;
    case KT_SOLID_SPHERE:
        paint_ball(sheet, &longer, colour);
        break;
    case KT_SOLID_CYLINDER:
        paint_cylinder(sheet, &longer, colour);
        break;
    default:
        paint_rod(sheet, &longer, colour);
    }
}
