/* Strokes of curves and surfaces: both their ends lie on the curve or surface. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "picture/picture.h"

#include <math.h>

static kt_stroke strokes[KT_STROKES_MOST];

/* How far a point is from the curve or the surface. */
typedef double off(kt_vec3 p);

static double off_line(kt_vec3 p) { return hypot(p.x, p.y); }
static double off_circle(kt_vec3 p) { return hypot(hypot(p.x, p.y) - 0.7, p.z); }
static double off_helix(kt_vec3 p) { return hypot(p.x - 0.7 * cos(p.z / 0.1), p.y - 0.7 * sin(p.z / 0.1)); }
static double off_plane(kt_vec3 p) { return fabs(p.z); }
static double off_cylinder(kt_vec3 p) { return fabs(hypot(p.x, p.y) - 0.7); }
static double off_sphere(kt_vec3 p) { return fabs(kt_vec3_norm(p) - 0.7); }
static double off_torus(kt_vec3 p) { return fabs(hypot(hypot(p.x, p.y) - 0.7, p.z) - 0.2); }

static void check(const char *what, const kt_loop *loop, off *distance) {
    const int count = kt_strokes_of(loop, kt_vec3_make(0.3, 0.2, 0.4), 2.0, strokes);
    KT_WORST worst = kt_worst_make(what);
    for (int i = 0; i < count; i++) {
        kt_worst_near(&worst, distance(strokes[i].from), 0.0, 1e-14, "from of stroke %d", i);
        kt_worst_near(&worst, distance(strokes[i].to), 0.0, 1e-14, "to of stroke %d", i);
    }
    kt_check_true("it fits", count < KT_STROKES_MOST);
}

KT_TEST(strokes_lie_on_their_curve_or_surface) {
    static const struct {
        const char *name;
        kt_track_type curve;
        kt_surface_type surface;
        off *distance;
    } rows[] = {{"line", KT_TRACK_LINE, KT_SURFACE_NONE, off_line},
                {"circle", KT_TRACK_CIRCLE, KT_SURFACE_NONE, off_circle},
                {"helix", KT_TRACK_HELIX, KT_SURFACE_NONE, off_helix},
                {"plane", KT_TRACK_NONE, KT_SURFACE_PLANE, off_plane},
                {"cylinder", KT_TRACK_NONE, KT_SURFACE_CYLINDER, off_cylinder},
                {"sphere", KT_TRACK_NONE, KT_SURFACE_SPHERE, off_sphere},
                {"torus", KT_TRACK_NONE, KT_SURFACE_TORUS, off_torus}};
    for (size_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        kt_loop loop = kt_loop_default();
        loop.type = rows[i].curve != KT_TRACK_NONE ? KT_LOOP_CURVE : KT_LOOP_SURFACE;
        loop.curve = (kt_track){.type = rows[i].curve, .radius = 0.7, .pitch = 0.1};
        loop.surface = (kt_surface){.type = rows[i].surface, .radius = 0.7, .tube = 0.2};
        check(rows[i].name, &loop, rows[i].distance);
    }
}

KT_TEST(strokes_of_a_spline_go_through_its_points) {
    const kt_vec3 points[] = {{0.0, 0.0, 1.0}, {0.5, 0.0, 0.4}, {1.0, 0.2, 0.6}, {1.5, 0.0, 0.0}};
    kt_loop loop = kt_loop_default();
    loop.type = KT_LOOP_CURVE;
    loop.curve = (kt_track){.type = KT_TRACK_SPLINE, .points = points, .point_count = 4};
    const int count = kt_strokes_of(&loop, points[0], 1.0, strokes);
    kt_check_above("strokes", count, 100.0);
    double longest = 0.0;
    for (int i = 0; i < count; i++)
        longest = fmax(longest, kt_vec3_norm(kt_vec3_sub(strokes[i].to, strokes[i].from)));
    for (int k = 0; k < 4; k++) { /* which lie within half of a stroke from an end of it */
        double least = kt_vec3_norm(kt_vec3_sub(strokes[0].from, points[k]));
        for (int i = 0; i < count; i++)
            least = fmin(least, kt_vec3_norm(kt_vec3_sub(strokes[i].to, points[k])));
        kt_check_below("a point from the nearest end over half a stroke", least / (0.5 * longest), 1.0);
    }
    double turned = 0.0;
    for (int i = 1; i < count; i++) {
        const kt_vec3 a = kt_vec3_sub(strokes[i - 1].to, strokes[i - 1].from),
                      b = kt_vec3_sub(strokes[i].to, strokes[i].from);
        turned = fmax(turned, kt_vec3_norm(kt_vec3_cross(a, b)) / (kt_vec3_norm(a) * kt_vec3_norm(b)));
    }
    kt_check_below("turn from stroke to stroke: there are no corners", turned, 0.1);
}

KT_TEST(other_loops_have_none) {
    kt_loop loop = kt_loop_default();
    loop.type = KT_LOOP_REVOLUTE;
    kt_check_equal_int("strokes", kt_strokes_of(&loop, kt_vec3_make(0.0, 0.0, 0.0), 1.0, strokes), 0);
}
