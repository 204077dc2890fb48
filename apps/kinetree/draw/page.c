/* The page of a drawing: its layout, scale, axes, gravity. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"
#include "picture/solid.h"
#include "records/output.h"

#include "command.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum {
    WIDTH = 900,
    MARGIN = 30,
    TOP = 64,           /* title and subtitle */
    FOOT = 66,          /* axes and scale */
    BORDER = 30,        /* around the picture, for symbols */
    CAPTION = 24,       /* the time below a state, where there are several */
    LONG_CAPTION = 250, /* the room for a text */
    TALLEST = 560,      /* of the part that is drawn */
    TALLEST_MANY = 700, /* with texts below */
    LOWEST = 150,
};

static const double rest_fade = 0.45; /* of the state of rest behind a state */

/* ---- layout ------------------------------------------------------------------------------------------------------ */

typedef struct layout {
    double left, right, bottom, top; /* of all that is drawn, in the camera's frame, m */
    double scale;
    int columns, rows;
    double cell_width, cell_height;
    int height;   /* of the page */
    double grain; /* of places far from the origin, where it would be seen; else 0 */
} layout;

static bool is_captioned(const kt_drawing *d) { return !d->is_strobe && (d->state_count > 1 || d->captions != NULL); }

static void widen_layout(layout *l, kt_vec3 p) {
    l->left = fmin(l->left, p.x);
    l->right = fmax(l->right, p.x);
    l->bottom = fmin(l->bottom, p.y);
    l->top = fmax(l->top, p.y);
}

static const kt_pose *drawn_state_of(const kt_drawing *d, int state) {
    return d->poses + (ptrdiff_t)state * d->picture->body_count;
}

static void widen_by_solids(layout *l, const kt_drawing *d, const kt_pose *poses) {
    for (int i = 0; i < d->picture->solid_count; i++) {
        const kt_solid *solid = &d->picture->solids[i];
        const kt_pose pose = kt_camera_pose(&d->camera, kt_pose_compose(poses[solid->body], solid->pose));
        const kt_mat3 back = kt_mat3_transpose(pose.rotation);
        const kt_vec3 reach = kt_vec3_make(kt_solid_reach(solid, back.x), kt_solid_reach(solid, back.y), 0.0);
        widen_layout(l, kt_vec3_sub(pose.position, reach));
        widen_layout(l, kt_vec3_add(pose.position, reach));
    }
}

typedef struct point_view {
    layout *l;
    const kt_camera *camera;
} point_view;

static void widen_layout_by_point(void *user, kt_vec3 point) {
    const point_view *view = user;
    widen_layout(view->l, kt_camera_point(view->camera, point));
}

static void widen_by_state(layout *l, const kt_drawing *d, const kt_pose *poses) {
    point_view view = {l, &d->camera};
    widen_by_solids(l, d, poses);
    kt_picture_points(d->picture, poses, widen_layout_by_point, &view);
}

static void widen_by_markers(layout *l, const kt_drawing *d, const kt_pose *poses) {
    const kt_model *model = d->picture->model;
    for (int body = 0; body < d->picture->body_count; body++)
        for (int k = 0; k < kt_marker_count(model, body); k++)
            widen_layout(l, kt_camera_point(&d->camera, kt_pose_apply(poses[body], kt_marker_at(model, body, k))));
}

static void widen_by_planes(layout *l, const kt_drawing *d, const kt_pose *poses) {
    for (int i = 0; i < d->picture->plane_count; i++)
        for (int k = 0; k < 4 && !kt_plane_is_paper(d, &d->picture->planes[i], poses); k++) {
            const kt_picture_plane *plane = &d->picture->planes[i];
            const kt_vec3 corner =
                kt_vec3_make(k % 2 ? plane->half : -plane->half, k / 2 ? plane->half : -plane->half, 0.0);
            widen_layout(l,
                         kt_camera_point(&d->camera, kt_pose_apply(kt_body_frame_pose(&plane->frame, poses), corner)));
        }
}

/* Widens the layout by the rails of joints, in all states. Their ends are in the border. */
static void widen_by_rails(layout *l, const kt_drawing *d) {
    double low, high;
    for (int i = 0; i < d->picture->joint_count && !d->is_diagram; i++) {
        const kt_picture_joint *joint = &d->picture->joints[i];
        if (!kt_rail_span(d, joint, 1.5 * d->picture->radius, &low, &high))
            continue;
        for (int state = 0; state < d->state_count; state++) {
            const kt_pose frame = kt_body_frame_pose(&joint->frame, drawn_state_of(d, state));
            for (int k = 0; k < 2; k++) {
                const kt_vec3 end = kt_vec3_make(0.0, 0.0, k == 0 ? low : high);
                widen_layout(l, kt_camera_point(&d->camera, kt_pose_apply(frame, end)));
            }
        }
    }
}

/* Keeps a unit of the page at or above the rounding of positions, which is coarse far from the origin. */
static void keep_above_grain(layout *l) {
    const double far = fmax(fmax(fabs(l->left), fabs(l->right)), fmax(fabs(l->bottom), fabs(l->top)));
    const double grain = DBL_EPSILON * far, least = WIDTH * grain;
    const double lacking = least - fmax(l->right - l->left, l->top - l->bottom);
    if (!(lacking > 0.0))
        return;
    l->grain = grain;
    l->left -= 0.5 * lacking;
    l->right += 0.5 * lacking;
}

/* Finds the number of columns with which states become largest. */
static void arrange(layout *l, const kt_drawing *d) {
    const double width = fmax(l->right - l->left, 1e-9 * (l->top - l->bottom)),
                 height = fmax(l->top - l->bottom, 1e-9 * width);
    const int cells = d->is_strobe ? 1 : d->state_count;
    const double caption = is_captioned(d) ? CAPTION : 0.0, room_caption = d->captions != NULL ? LONG_CAPTION : 0.0;
    const double tallest = d->captions != NULL && cells > 1 ? TALLEST_MANY : TALLEST;
    l->scale = 0.0;
    for (int columns = 1; columns <= cells; columns++) {
        const int rows = (cells + columns - 1) / columns;
        const double room_x = (double)(WIDTH - 2 * MARGIN) / columns - 2.0 * BORDER;
        const double room_y = tallest / rows - 2.0 * BORDER - caption;
        const double scale = fmin(room_x / width, room_y / height);
        if (room_x + 2.0 * BORDER < room_caption && columns > 1)
            break;
        if (room_x <= 0.0 || room_y <= 0.0 || scale <= l->scale)
            continue;
        l->scale = scale;
        l->columns = columns;
        l->rows = rows;
    }
    l->cell_width = (double)(WIDTH - 2 * MARGIN) / l->columns;
    l->cell_height = fmax(l->scale * height + 2.0 * BORDER + caption, LOWEST);
    l->height = (int)ceil(TOP + l->rows * l->cell_height + FOOT);
}

static layout lay_out_page(const kt_drawing *d) {
    layout l = {.left = DBL_MAX, .right = -DBL_MAX, .bottom = DBL_MAX, .top = -DBL_MAX};
    for (int i = 0; i < d->state_count; i++)
        widen_by_state(&l, d, drawn_state_of(d, i));
    if (d->rest != NULL)
        widen_by_state(&l, d, d->rest);
    widen_by_markers(&l, d, drawn_state_of(d, d->state_count - 1));
    widen_by_rails(&l, d);
    widen_by_planes(&l, d, drawn_state_of(d, 0));
    for (int i = 0; i < d->path_count; i++)
        for (int k = 0; k < d->paths[i].count; k++)
            widen_layout(&l, kt_camera_point(&d->camera, d->paths[i].points[k]));
    if (l.left > l.right)
        l = (layout){.left = -0.5, .right = 0.5, .bottom = -0.5, .top = 0.5};
    if (!(l.right - l.left > 0.0) && !(l.top - l.bottom > 0.0)) {
        l.right += 0.5 * d->picture->size;
        l.left -= 0.5 * d->picture->size;
    }
    keep_above_grain(&l);
    arrange(&l, d);
    return l;
}

/* The sheet of a state: its cell. The picture lies in the middle of the cell. */
static kt_sheet sheet_of(cairo_t *c, const kt_drawing *d, const layout *l, int state) {
    const int cell = d->is_strobe ? 0 : state;
    const int column = cell % l->columns, row = cell / l->columns;
    const double left = MARGIN + column * l->cell_width, top = TOP + row * l->cell_height;
    const double middle_x = left + 0.5 * l->cell_width,
                 middle_y = top + 0.5 * (l->cell_height - (is_captioned(d) ? CAPTION : 0));
    return (kt_sheet){.c = c,
                      .palette = kt_palette_choose(d->is_dark),
                      .drawing = d,
                      .poses = drawn_state_of(d, state),
                      .scale = l->scale,
                      .x = middle_x - 0.5 * l->scale * (l->left + l->right),
                      .y = middle_y + 0.5 * l->scale * (l->bottom + l->top),
                      .pin = fmin(fmax(1.5 * l->scale * d->picture->radius, 1.6), 6.5)};
}

/* ---- around the mechanism ---------------------------------------------------------------------------------------- */

/* The world's axes as seen by the camera. */
static void paint_triad(const kt_sheet *sheet, kt_spot origin) {
    static const char *const names[] = {"x", "y", "z"};
    const double length = 24.0;
    double lowest = 0.0;
    for (int i = 0; i < 3; i++) {
        const kt_mat3 seen = kt_mat3_transpose(sheet->drawing->camera.axes);
        lowest = fmin(lowest, i == 0 ? seen.x.y : i == 1 ? seen.y.y : seen.z.y);
    }
    origin.y += length * (lowest + 0.5); /* all of it is above the lower edge */
    for (int i = 0; i < 3; i++) {
        const kt_vec3 axis = kt_camera_point(&sheet->drawing->camera,
                                             kt_vec3_make(i == 0 ? 1.0 : 0.0, i == 1 ? 1.0 : 0.0, i == 2 ? 1.0 : 0.0));
        const kt_spot tip = {origin.x + length * axis.x, origin.y - length * axis.y};
        if (hypot(axis.x, axis.y) < 0.3)
            continue;
        kt_paint_arrow(sheet, origin, tip, 1.0, sheet->palette->quiet);
        kt_paper_text(sheet->c, origin.x + (length + 9.0) * axis.x, origin.y - (length + 9.0) * axis.y + 4.0,
                      KT_ANCHOR_MIDDLE, names[i]);
    }
}

/* Rounds x down to one, two or five times a power of ten. */
static double round_below(double x) {
    const double power = pow(10.0, floor(log10(x)));
    return x >= 5.0 * power ? 5.0 * power : x >= 2.0 * power ? 2.0 * power : power;
}

static void write_length(double length, char *text, size_t size) {
    if (length >= 1e3)
        snprintf(text, size, "%g km", 1e-3 * length);
    else if (length >= 0.1)
        snprintf(text, size, "%g m", length);
    else if (length >= 1e-4)
        snprintf(text, size, "%g mm", 1e3 * length);
    else
        snprintf(text, size, "%g \u00b5m", 1e6 * length);
}

static void paint_scale(const kt_sheet *sheet, double right, double y) {
    const double length = round_below(140.0 / sheet->scale), width = length * sheet->scale;
    cairo_t *c = sheet->c;
    char text[48];
    write_length(length, text, sizeof text);
    kt_trace_line(c, (kt_spot){right - width, y - 4.0}, (kt_spot){right - width, y + 4.0});
    kt_trace_line(c, (kt_spot){right - width, y}, (kt_spot){right, y});
    kt_trace_line(c, (kt_spot){right, y - 4.0}, (kt_spot){right, y + 4.0});
    kt_paper_stroke(c, sheet->palette->quiet, 1.2);
    kt_paper_text(c, right - 0.5 * width, y - 8.0, KT_ANCHOR_MIDDLE, text);
}

/* Gravity as an arrow. If it is along the view, it is a dot or a cross in a circle. */
static void paint_gravity(const kt_sheet *sheet, kt_spot at) {
    const kt_vec3 g = sheet->drawing->picture->gravity;
    cairo_t *c = sheet->c;
    if (!(kt_vec3_dot(g, g) > 0.0))
        return;
    const kt_vec3 down = kt_camera_point(&sheet->drawing->camera, kt_vec3_normalize(g));
    const double length = 34.0;
    kt_paper_use(c, sheet->palette->quiet);
    kt_paper_text(c, at.x + 10.0, at.y + 5.0, KT_ANCHOR_LEFT, "g");
    if (hypot(down.x, down.y) > 0.3) {
        kt_paint_arrow(sheet, (kt_spot){at.x - 0.5 * length * down.x, at.y + 0.5 * length * down.y},
                       (kt_spot){at.x + 0.5 * length * down.x, at.y - 0.5 * length * down.y}, 1.4,
                       sheet->palette->quiet);
        return;
    }
    cairo_arc(c, at.x, at.y, 6.0, 0.0, 6.283185307179586);
    for (int side = -1; side <= 1 && down.z < 0.0; side += 2)
        kt_trace_line(c, (kt_spot){at.x - 4.2, at.y + side * 4.2}, (kt_spot){at.x + 4.2, at.y - side * 4.2});
    kt_paper_stroke(c, sheet->palette->quiet, 1.2);
    if (down.z > 0.0) {
        cairo_arc(c, at.x, at.y, 1.8, 0.0, 6.283185307179586);
        cairo_fill(c);
    }
}

static void paint_caption(const kt_sheet *sheet, const layout *l, int state) {
    const kt_drawing *d = sheet->drawing;
    char text[48] = "";
    if (d->captions == NULL)
        snprintf(text, sizeof text, "%.4g s", d->times[state]);
    cairo_set_font_size(sheet->c, kt_text_size);
    kt_paper_use(sheet->c, sheet->palette->quiet);
    const int column = state % l->columns, row = state / l->columns;
    kt_paper_text(sheet->c, MARGIN + (column + 0.5) * l->cell_width, TOP + (row + 1) * l->cell_height - 7.0,
                  KT_ANCHOR_MIDDLE, d->captions != NULL ? d->captions[state] : text);
}

/* The mechanism at rest, behind a state. */
static bool paint_rest(const kt_sheet *sheet) {
    if (sheet->drawing->rest == NULL)
        return true;
    kt_sheet grey = *sheet;
    grey.poses = sheet->drawing->rest;
    grey.is_grey = true;
    grey.fade = rest_fade;
    const bool fine = kt_paint_solids(&grey);
    kt_paint_symbols(&grey);
    return fine;
}

/* ---- the page ---------------------------------------------------------------------------------------------------- */

typedef struct page {
    const kt_drawing *drawing;
    int only;            /* the one state that is painted; -1: all */
    kt_path_layer layer; /* of the paths */
    layout layout;
    bool *fine;
    uint64_t *order; /* hash of the things that are painted, in their order; NULL: not needed */
} page;

/* The drawing as it is for one state. */
static const kt_drawing *of_state(const kt_drawing *d, int state, kt_drawing *own) {
    *own = *d;
    if (d->pictures != NULL)
        own->picture = &d->pictures[state];
    return own;
}

/* Begins to note the parts of paths that solids hide. In diagrams nothing hides a path. In an animation these parts
 * vary (kt_drawing_front). */
static bool begin_traces(const kt_drawing *d, const kt_sheet *sheet, kt_traces **traces) {
    if (d->is_diagram || d->is_moving || d->path_count == 0)
        return true;
    kt_traces_free(*traces);
    *traces = kt_traces_create(sheet);
    return *traces != NULL;
}

static void paint_page(cairo_t *c, const void *what) {
    const page *p = what;
    const kt_drawing *d = p->drawing;
    const int last = d->state_count - 1;
    kt_drawing own;
    kt_traces *traces = NULL;
    kt_sheet sheet = sheet_of(c, d, &p->layout, last);
    cairo_set_line_join(c, CAIRO_LINE_JOIN_ROUND);
    kt_paper_head(c, sheet.palette, 20.0, WIDTH - 110.0, d->title, d->subtitle);
    const int first = p->only >= 0 ? p->only : 0;
    for (int i = first; i <= (p->only >= 0 ? p->only : last); i++) {
        sheet = sheet_of(c, of_state(d, i, &own), &p->layout, i);
        sheet.fade =
            d->is_strobe && p->only < 0 ? 0.25 * (last > 0) * (i < last) + 0.7 * (last - i) / fmax(last, 1.0) : 0.0;
        if (!d->is_strobe || i == first) {
            const double fade = sheet.fade;
            sheet.fade = 0.0;
            kt_paint_ground(&sheet);
            if (p->layer == KT_PATHS_BEHIND)
                kt_paint_paths(&sheet);
            sheet.fade = fade;
        }
        if (!d->is_strobe || i == first)
            *p->fine = begin_traces(d, &sheet, &traces) && *p->fine;
        sheet.traces = traces;
        sheet.order = p->order;
        *p->fine = paint_rest(&sheet) && *p->fine;
        *p->fine = kt_paint_solids(&sheet) && *p->fine;
        if (!d->is_strobe || i == last)
            kt_paint_near_paths(&sheet);
        if (p->layer == KT_PATHS_BEFORE)
            kt_paint_paths(&sheet);
        if (!kt_sheet_is_plain(&sheet))
            kt_paint_symbols(&sheet);
        if (is_captioned(d))
            paint_caption(&sheet, &p->layout, i);
    }
    kt_traces_free(traces);
    sheet.fade = 0.0;
    sheet.drawing = d;
    cairo_set_font_size(c, kt_small_size);
    kt_paper_use(c, sheet.palette->quiet);
    paint_triad(&sheet, (kt_spot){52.0, p->layout.height - 38.0});
    paint_scale(&sheet, WIDTH - MARGIN, p->layout.height - 26.0);
    cairo_set_font_size(c, kt_text_size);
    paint_gravity(&sheet, (kt_spot){WIDTH - 52.0, 38.0});
}

double kt_drawing_grain(const kt_drawing *drawing) { return lay_out_page(drawing).grain; }

int kt_drawing_write(const kt_drawing *drawing, const char *path) {
    bool fine = true;
    const page p = {drawing, -1, KT_PATHS_BEHIND, lay_out_page(drawing), &fine, NULL};
    if (drawing->nameless != NULL)
        *drawing->nameless = 0;
    const int code = kt_paper_write(path, WIDTH, p.layout.height, paint_page, &p);
    if (!fine)
        kt_say("there is not enough memory for the picture");
    return fine ? code : KT_EXIT_INTEGRATION;
}

int kt_drawing_write_frames(const kt_drawing *drawing, const char *path) {
    const int stem = (int)kt_stem_length(path, ".png");
    const layout l = lay_out_page(drawing);
    char name[4096];
    bool fine = true;
    int code = KT_EXIT_DONE;
    for (int state = 0; state < drawing->state_count && code == KT_EXIT_DONE; state++) {
        const page p = {drawing, state, KT_PATHS_BEHIND, l, &fine, NULL};
        (void)snprintf(name, sizeof name, "%.*s-%04d.png", stem, path, state + 1);
        code = kt_paper_write(name, WIDTH, l.height, paint_page, &p);
    }
    return fine ? code : kt_say_no_memory("the picture");
}

/* NOLINTNEXTLINE(readability-non-const-parameter): the sheets write it */
char *kt_drawing_frame(const kt_drawing *drawing, int state, kt_path_layer layer, uint64_t *order) {
    bool fine = true;
    const page p = {drawing, state, layer, lay_out_page(drawing), &fine, order};
    char *text = kt_paper_svg(WIDTH, p.layout.height, paint_page, &p);
    if (fine)
        return text;
    kt_say("there is not enough memory for the picture");
    free(text);
    return NULL;
}

char *kt_drawing_front(const kt_drawing *drawing, int state, int path, double share) {
    kt_drawing own;
    const layout l = lay_out_page(drawing);
    kt_sheet sheet = sheet_of(NULL, of_state(drawing, state, &own), &l, state);
    own.paths += path; /* this one alone */
    own.path_count = 1;
    sheet.traces = kt_traces_create(&sheet);
    char *dashes = sheet.traces != NULL && kt_paint_solids(&sheet) ? kt_traces_dashes(&sheet, share) : NULL;
    kt_traces_free(sheet.traces);
    return dashes;
}
