/* Curves and surfaces of loops, as straight strokes in the frame of the loop's first end. A curve is drawn directly, a
 * surface as lines on it. An unbounded curve or surface is drawn around the second end, within the extent of the
 * mechanism. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "picture/picture.h"

#include <math.h>
#include <stdlib.h>

static const double turn = 6.28318530717958647692;

enum { ROUND = 48 /* strokes of a circle */, LINES = 4 /* of a plane, to either side */ };

typedef struct pencil {
    kt_stroke *strokes;
    int count;
} pencil;

static void draw_stroke(pencil *p, kt_vec3 from, kt_vec3 to) {
    if (p->count < KT_STROKES_MOST)
        p->strokes[p->count++] = (kt_stroke){from, to};
}

/* A circle about `centre`, which begins at `first` and turns towards `second`. */
static void draw_circle(pencil *p, kt_vec3 centre, kt_vec3 first, kt_vec3 second) {
    kt_vec3 last = kt_vec3_add(centre, first);
    for (int k = 1; k <= ROUND; k++) {
        const double a = turn * k / ROUND;
        const kt_vec3 direction = kt_vec3_add(kt_vec3_scale(cos(a), first), kt_vec3_scale(sin(a), second));
        const kt_vec3 next = kt_vec3_add(centre, direction);
        draw_stroke(p, last, next);
        last = next;
    }
}

/* A circle about the z axis. */
static void draw_ring(pencil *p, double radius, double z) {
    draw_circle(p, kt_vec3_make(0.0, 0.0, z), kt_vec3_make(radius, 0.0, 0.0), kt_vec3_make(0.0, radius, 0.0));
}

/* Draws up to four turns around the height `middle`. */
static void draw_helix(pencil *p, const kt_track *track, double middle, double reach) {
    const int turns = (int)fmin(4.0, 1.0 + reach / (fabs(track->pitch) * turn)), steps = ROUND * turns;
    const double first = middle / track->pitch - 0.5 * turn * turns;
    kt_vec3 last = {0.0, 0.0, 0.0};
    for (int k = 0; k <= steps; k++) {
        const double a = first + turn * k / ROUND;
        const kt_vec3 next = {track->radius * cos(a), track->radius * sin(a), track->pitch * a};
        if (k > 0)
            draw_stroke(p, last, next);
        last = next;
    }
}

/* The natural cubic spline, as three tables over the sums of distances between its points. */
static void draw_spline(pencil *p, const kt_track *track) {
    enum { STEPS = 240 };
    const int n = track->point_count;
    double *rows = calloc(3 * (size_t)n, 2 * sizeof *rows), length = 0.0;
    kt_function along[3];
    kt_vec3 last = track->points[0];
    for (int i = 0; i < n && rows != NULL; i++) {
        length += i > 0 ? kt_vec3_norm(kt_vec3_sub(track->points[i], track->points[i - 1])) : 0.0;
        const double x[] = {track->points[i].x, track->points[i].y, track->points[i].z};
        for (int k = 0; k < 3; k++) {
            rows[2 * (k * n + i)] = length;
            rows[2 * (k * n + i) + 1] = x[k];
        }
    }
    for (int k = 0; k < 3; k++)
        along[k] = kt_function_table(rows != NULL ? rows + 2 * (ptrdiff_t)k * n : NULL, 2 * n, KT_INTERPOLATION_CUBIC);
    for (int i = 1; i <= STEPS && rows != NULL; i++) {
        double x[3][3];
        for (int k = 0; k < 3; k++)
            if (kt_function_evaluate(&along[k], length * i / STEPS, x[k], NULL) != KT_OK)
                x[k][0] = 0.0;
        const kt_vec3 next = {x[0][0], x[1][0], x[2][0]};
        draw_stroke(p, last, next);
        last = next;
    }
    free(rows);
}

static void draw_track(pencil *p, const kt_track *track, kt_vec3 middle, double reach) {
    if (track->type == KT_TRACK_LINE)
        draw_stroke(p, kt_vec3_make(0.0, 0.0, middle.z - reach), kt_vec3_make(0.0, 0.0, middle.z + reach));
    else if (track->type == KT_TRACK_CIRCLE)
        draw_ring(p, track->radius, 0.0);
    else if (track->type == KT_TRACK_HELIX)
        draw_helix(p, track, middle.z, reach);
    else if (track->type == KT_TRACK_SPLINE && track->point_count > 1)
        draw_spline(p, track);
}

static void draw_plane(pencil *p, kt_vec3 middle, double reach) {
    for (int k = -LINES; k <= LINES; k++) {
        const double at = reach * k / LINES;
        draw_stroke(p, kt_vec3_make(middle.x + at, middle.y - reach, 0.0),
                    kt_vec3_make(middle.x + at, middle.y + reach, 0.0));
        draw_stroke(p, kt_vec3_make(middle.x - reach, middle.y + at, 0.0),
                    kt_vec3_make(middle.x + reach, middle.y + at, 0.0));
    }
}

static void draw_cylinder(pencil *p, double radius, double middle, double reach) {
    for (int k = 0; k < 8; k++) {
        const double x = radius * cos(turn * k / 8.0), y = radius * sin(turn * k / 8.0);
        draw_stroke(p, kt_vec3_make(x, y, middle - reach), kt_vec3_make(x, y, middle + reach));
    }
    for (int k = -1; k <= 1; k++)
        draw_ring(p, radius, middle + k * reach);
}

static void draw_sphere(pencil *p, double r) {
    const kt_vec3 centre = {0.0, 0.0, 0.0}, up = {0.0, 0.0, r};
    for (int k = 0; k < 3; k++)
        draw_circle(p, centre, kt_vec3_make(r * cos(turn * k / 6.0), r * sin(turn * k / 6.0), 0.0), up);
    for (int k = -1; k <= 1; k++)
        draw_ring(p, r * sqrt(1.0 - 0.25 * k * k), 0.5 * k * r);
}

static void draw_torus(pencil *p, double radius, double tube) {
    const kt_vec3 up = {0.0, 0.0, tube};
    for (int k = 0; k < 6; k++) {
        const kt_vec3 out = {cos(turn * k / 6.0), sin(turn * k / 6.0), 0.0};
        draw_circle(p, kt_vec3_scale(radius, out), kt_vec3_scale(tube, out), up);
    }
    for (int k = 0; k < 4; k++)
        draw_ring(p, radius + tube * cos(turn * k / 4.0), tube * sin(turn * k / 4.0));
}

int kt_strokes_of(const kt_loop *loop, kt_vec3 middle, double reach, kt_stroke strokes[KT_STROKES_MOST]) {
    pencil p = {.strokes = strokes};
    const kt_surface *surface = &loop->surface;
    if (loop->type == KT_LOOP_CURVE)
        draw_track(&p, &loop->curve, middle, reach);
    else if (loop->type == KT_LOOP_SURFACE && surface->type == KT_SURFACE_PLANE)
        draw_plane(&p, middle, reach);
    else if (loop->type == KT_LOOP_SURFACE && surface->type == KT_SURFACE_CYLINDER)
        draw_cylinder(&p, surface->radius, middle.z, reach);
    else if (loop->type == KT_LOOP_SURFACE && surface->type == KT_SURFACE_SPHERE)
        draw_sphere(&p, surface->radius);
    else if (loop->type == KT_LOOP_SURFACE && surface->type == KT_SURFACE_TORUS)
        draw_torus(&p, surface->radius, surface->tube);
    return p.count;
}

void kt_strokes_list(kt_picture *p, const kt_loop *loops, const kt_pose *poses, kt_bounds bounds) {
    kt_stroke *next = p->strokes;
    const double reach = 0.5 * kt_vec3_norm(kt_vec3_sub(bounds.high, bounds.low));
    for (int i = 0; i < p->loop_count; i++) {
        kt_picture_loop *loop = &p->loops[i];
        if (loop->type != KT_LOOP_CURVE && loop->type != KT_LOOP_SURFACE)
            continue;
        const kt_pose first = kt_body_frame_pose(&loop->ends[0], poses);
        const kt_vec3 apart = kt_vec3_sub(kt_body_frame_pose(&loop->ends[1], poses).position, first.position);
        const kt_vec3 middle = kt_mat3_apply_transposed(first.rotation, apart);
        loop->strokes = next;
        loop->stroke_count = kt_strokes_of(&loops[loop->loop], middle, reach > 0.0 ? reach : 1.0, next);
        next += loop->stroke_count;
    }
}
