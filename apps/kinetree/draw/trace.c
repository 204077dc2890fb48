/* Paths of points. All of a path is painted behind the solids. In space, the parts that are nearer to the viewer than
 * every solid are painted again, in front of them. The solids of each painted state decide which parts these are. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "draw/paper.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

enum { TRACE_POINTS_MOST = 40000 };

static const double trace_step = 1.5; /* between points, on the page */

/* A solid hides a point if it is nearer by more than this, on the page. A path on the surface of a solid is visible. */
static const double trace_slack = 3.0;

typedef struct trace_point {
    kt_vec3 at;      /* in the camera's frame */
    int path;        /* whose point it is */
    double share;    /* of the points of the path, up to this one: 0 to 1 */
    bool is_covered; /* a solid is before or behind it */
    bool is_hidden;  /* a solid is before it */
} trace_point;

struct kt_traces {
    trace_point *points;
    int count;
};

static void use_trace_pen(const kt_sheet *sheet, int path) {
    const int body = sheet->drawing->paths[path].body;
    const double ink = sheet->drawing->is_diagram ? 0.25 : 0.5; /* a path is seen on its own body */
    kt_paper_use(sheet->c, kt_colour_mix(kt_sheet_colour(sheet, body), sheet->palette->ink, ink));
    cairo_set_line_width(sheet->c, 1.2);
}

void kt_paint_paths(const kt_sheet *sheet) {
    for (int i = 0; i < sheet->drawing->path_count; i++) {
        const kt_drawn_path *path = &sheet->drawing->paths[i];
        kt_spot last = {DBL_MAX, DBL_MAX};
        for (int k = 0; k < path->count; k++) {
            const kt_spot at = kt_sheet_place(sheet, path->points[k]);
            if (k > 0 && k + 1 < path->count && kt_spot_distance(at, last) < 0.7)
                continue;
            cairo_line_to(sheet->c, at.x, at.y);
            last = at;
        }
        use_trace_pen(sheet, i);
        cairo_stroke(sheet->c);
    }
}

/* ---- points ------------------------------------------------------------------------------------------------------ */

/* The pieces into which a line of a path is cut. */
static int pieces_of_line(const kt_sheet *sheet, const kt_drawn_path *path, int k, double step) {
    const kt_vec3 line = kt_vec3_sub(path->points[k + 1], path->points[k]);
    return 1 + (int)fmin(sheet->scale * kt_vec3_norm(line) / step, TRACE_POINTS_MOST);
}

static double count_trace_points(const kt_sheet *sheet, double step) {
    double count = 0.0;
    for (int i = 0; i < sheet->drawing->path_count; i++)
        for (int k = 0; k + 1 < sheet->drawing->paths[i].count; k++)
            count += pieces_of_line(sheet, &sheet->drawing->paths[i], k, step);
    return count + sheet->drawing->path_count;
}

static void list_trace_points(const kt_sheet *sheet, double step, kt_traces *t) {
    const kt_camera *camera = &sheet->drawing->camera;
    for (int i = 0; i < sheet->drawing->path_count; i++) {
        const kt_drawn_path *path = &sheet->drawing->paths[i];
        for (int k = 0; k < path->count; k++) {
            const int pieces = k + 1 < path->count ? pieces_of_line(sheet, path, k, step) : 1;
            for (int n = 0; n < pieces; n++) {
                const kt_vec3 line = n > 0 ? kt_vec3_sub(path->points[k + 1], path->points[k]) : (kt_vec3){0};
                const kt_vec3 at = kt_vec3_add(path->points[k], kt_vec3_scale((double)n / pieces, line));
                t->points[t->count++] = (trace_point){.at = kt_camera_point(camera, at),
                                                      .path = i,
                                                      .share = (k + (double)n / pieces) / fmax(path->count - 1, 1)};
            }
        }
    }
}

kt_traces *kt_traces_create(const kt_sheet *sheet) {
    double step = trace_step;
    while (count_trace_points(sheet, step) > TRACE_POINTS_MOST && step < 1e6)
        step *= 2.0;
    kt_traces *t = calloc(1, sizeof *t);
    if (t == NULL)
        return NULL;
    t->points = malloc((size_t)(count_trace_points(sheet, step) + 1.0) * sizeof *t->points);
    if (t->points == NULL) {
        free(t);
        return NULL;
    }
    list_trace_points(sheet, step, t);
    return t;
}

void kt_traces_free(kt_traces *traces) {
    if (traces != NULL)
        free(traces->points);
    free(traces);
}

void kt_traces_cover(const kt_sheet *sheet, kt_trace_depth *depth, const void *user) {
    const double slack = trace_slack / sheet->scale;
    for (int i = 0; sheet->traces != NULL && i < sheet->traces->count; i++) {
        trace_point *point = &sheet->traces->points[i];
        double front = -DBL_MAX;
        if (!depth(user, point->at, &front))
            continue;
        point->is_covered = true;
        point->is_hidden = front > point->at.z + slack;
    }
}

/* Whether a point belongs to a part that is painted in front: it covers a solid, or continues such a part by one point
 * beyond the outline of the solid. */
static bool is_in_front(const kt_traces *t, int i) {
    const trace_point *point = &t->points[i];
    bool covers = point->is_covered;
    for (int k = i - 1; k <= i + 1; k += 2)
        covers = covers || (k >= 0 && k < t->count && t->points[k].path == point->path && t->points[k].is_covered &&
                            !t->points[k].is_hidden);
    return covers && !point->is_hidden;
}

void kt_paint_near_paths(const kt_sheet *sheet) {
    const kt_traces *t = sheet->traces;
    kt_spot last = {0};
    for (int i = 0; t != NULL && i < t->count; i++) {
        const bool is_new = i == 0 || t->points[i - 1].path != t->points[i].path;
        const bool starts = is_new || !is_in_front(t, i - 1);
        const bool ends = i + 1 == t->count || t->points[i + 1].path != t->points[i].path || !is_in_front(t, i + 1);
        if (!is_in_front(t, i))
            continue;
        const kt_spot at = kt_sheet_spot(sheet, t->points[i].at);
        if (starts) {
            use_trace_pen(sheet, t->points[i].path);
            cairo_move_to(sheet->c, at.x, at.y);
        } else if (ends || kt_spot_distance(at, last) >= 0.7) {
            cairo_line_to(sheet->c, at.x, at.y);
        }
        last = starts || ends || kt_spot_distance(at, last) >= 0.7 ? at : last;
        if (ends)
            cairo_stroke(sheet->c);
    }
}

/* ---- dashes ------------------------------------------------------------------------------------------------------ */

double kt_path_share(const kt_drawing *drawing, const kt_drawn_path *path, double part) {
    double whole = 0.0, covered = 0.0;
    const double reached = part * (path->count - 1);
    for (int i = 1; i < path->count; i++) {
        const kt_vec3 line = kt_camera_point(&drawing->camera, kt_vec3_sub(path->points[i], path->points[i - 1]));
        const double length = hypot(line.x, line.y);
        whole += length;
        covered += length * fmin(fmax(reached - (i - 1), 0.0), 1.0);
    }
    return whole > 0.0 ? covered / whole : 1.0;
}

static double line_on_page(const kt_traces *t, int i) {
    return hypot(t->points[i].at.x - t->points[i - 1].at.x, t->points[i].at.y - t->points[i - 1].at.y);
}

char *kt_traces_dashes(const kt_sheet *sheet, double share) {
    const kt_traces *t = sheet->traces;
    char *text = NULL;
    size_t size = 0;
    double whole = 0.0, gone = 0.0, begin = 0.0, end = 0.0, written = 0.0;
    FILE *file = open_memstream(&text, &size);
    for (int i = 1; i < t->count; i++)
        whole += line_on_page(t, i);
    if (file == NULL)
        return NULL;
    fputs("0", file);
    bool was_seen = false;
    for (int i = 0; i < t->count && whole > 0.0; i++) {
        const bool is_seen = is_in_front(t, i) && t->points[i].share <= share;
        gone += i > 0 ? line_on_page(t, i) : 0.0;
        begin = is_seen && !was_seen ? gone : begin;
        end = is_seen ? gone : end;
        if ((was_seen && !is_seen) || (is_seen && i + 1 == t->count)) {
            fprintf(file, " %.4f %.4f", (begin - written) / whole, (end - begin) / whole);
            written = end;
        }
        was_seen = is_seen;
    }
    fputs(" 1", file);
    return fclose(file) == 0 ? text : NULL;
}
