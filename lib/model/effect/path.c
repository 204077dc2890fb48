/* The length of a path, a thread without friction, and its gradient.
 *
 * A path leads through points that are fixed in bodies. Between two points p and q, the path may lead around a sphere
 * or a cylinder of radius r. Let p and q be relative to the centre of the sphere, or to the axis of the cylinder. Both
 * points lie in a plane with the unit normal n: the axis of the cylinder, or p x q / |p x q|.
 *
 * Outside of the circle, with d = |p|, s = sqrt(d^2 - r^2) and the sense o = 1 (counterclockwise about n) or -1:
 *     tangents      s_p, s_q
 *     arc           theta = phi - atan(s_p / r) - atan(s_q / r)          phi: the angle from p to q in the sense o
 *     length        L = s_p + r theta + s_q
 *     directions    u_p = (s_p p - o r n x p) / d_p^2,   u_q = (s_q q + o r n x q) / d_q^2
 * Only the ends of a shortest path change its length to first order, so dL/dp = u_p and dL/dq = u_q. Both are finite
 * where a point reaches the circle. The path is straight if theta <= 0 for the shorter sense. At theta = 0, L and its
 * gradient equal those of the line, so that L is continuously differentiable; its second derivative jumps.
 *
 * A side is a direction from the centre in which the path should pass. Then the path is straight only if the line
 * passes the centre on that side. Otherwise the path has the sense for which the middle of the points of contact is
 * nearer to the side, unless the tangents cross. The length jumps where a line that does not touch the circle changes
 * the side.
 *
 * Inside: the path leads through the circle as through a ring. If the line passes outside, the path touches the ring at
 * the point T with the least |p - T| + |q - T|. Both lines have the angle b with the normal at T:
 *     2 b - asin(r sin b / |p|) - asin(r sin b / |q|) = phi,   T at the angle b - asin(r sin b / |p|) from p
 *
 * A cylinder is unrolled: with the length L2 in the plane and h = a . (q - p) along the axis
 *     L = sqrt(L2^2 + h^2),   dL/dp = (L2 u_p - h a) / L,   dL/dq = (L2 u_q + h a) / L
 *
 * The surface bears the opposite forces along the same lines. A point within the surface, or an angle of 0 between p
 * and q seen from the centre, leaves the path straight. If the line passes through the centre of a sphere, any plane is
 * as short.
 *
 * The definitions equal those of MuJoCo's spatial tendons, as documented in its XML reference and computation chapters.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "effect/path.h"

#include <float.h>

/* The path between two points p and q: its length, and dL/dp, dL/dq. */
typedef struct kt_path_part {
    kt_real length;
    kt_triple away[2];
} kt_path_part;

static kt_vec3 plain_of(kt_triple a) {
#ifdef KT_DUAL
    return kt_v4_vec3(kt_vector_value(a));
#else
    return a;
#endif
}

/* ---- the sense around a circle ----------------------------------------------------------------------------------- */

/* Whether the segments from a to b and from c to d meet, in a plane. */
static bool segments_meet(const double a[2], const double b[2], const double c[2], const double d[2]) {
    const double ab[2] = {b[0] - a[0], b[1] - a[1]}, cd[2] = {d[0] - c[0], d[1] - c[1]};
    const double ac[2] = {c[0] - a[0], c[1] - a[1]}, across = ab[0] * cd[1] - ab[1] * cd[0];
    const double x = (ac[0] * cd[1] - ac[1] * cd[0]) / across, y = (ac[0] * ab[1] - ac[1] * ab[0]) / across;
    return across != 0.0 && x >= 0.0 && x <= 1.0 && y >= 0.0 && y <= 1.0;
}

/* The point of the circle that the tangent from p reaches counterclockwise (sense 1) or clockwise. */
static void contact_point(const double p[2], double r, double sense, double to[2]) {
    const double square = p[0] * p[0] + p[1] * p[1], s = sqrt(fmax(square - r * r, 0.0));
    to[0] = (r * r * p[0] - sense * r * s * p[1]) / square;
    to[1] = (r * r * p[1] + sense * r * s * p[0]) / square;
}

/* Whether the line from p to q passes the circle on this side, without touching the circle. */
static bool line_is_clear(const double p[2], const double q[2], const double side[2], double r) {
    const double d[2] = {q[0] - p[0], q[1] - p[1]}, square = d[0] * d[0] + d[1] * d[1];
    const double at = square > 0.0 ? fmin(fmax(-(d[0] * p[0] + d[1] * p[1]) / square, 0.0), 1.0) : 0.0;
    const double near[2] = {p[0] + at * d[0], p[1] + at * d[1]};
    return near[0] * near[0] + near[1] * near[1] > r * r && near[0] * side[0] + near[1] * side[1] >= 0.0;
}

/* How near the middle of the points of contact is to the side: a cosine, or -2 if the tangents cross. */
static double nearness(const double p[2], const double q[2], const double side[2], double r, double sense) {
    double a[2], b[2];
    contact_point(p, r, sense, a);
    contact_point(q, r, -sense, b);
    const double middle[2] = {a[0] + b[0], a[1] + b[1]}, norm = kt_hypot(middle[0], middle[1]);
    if (segments_meet(p, a, q, b))
        return -2.0;
    return norm > 0.0 ? (middle[0] * side[0] + middle[1] * side[1]) / norm : 0.0;
}

/* The sense in which the path leads around the circle on a side; 0: the path is straight. */
static double sense_of_side(kt_triple p, kt_triple q, kt_triple n, kt_triple side, double r) {
    const kt_vec3 x = kt_vec3_normalize(plain_of(p)), y = kt_vec3_cross(plain_of(n), x);
    const double from[2] = {kt_vec3_norm(plain_of(p)), 0.0};
    const double to[2] = {kt_vec3_dot(plain_of(q), x), kt_vec3_dot(plain_of(q), y)};
    double s[2] = {kt_vec3_dot(plain_of(side), x), kt_vec3_dot(plain_of(side), y)};
    const double norm = kt_hypot(s[0], s[1]);
    s[0] = norm > 0.0 ? s[0] / norm : 1.0;
    s[1] = norm > 0.0 ? s[1] / norm : 0.0;
    if (line_is_clear(from, to, s, r))
        return 0.0;
    const double left = nearness(from, to, s, r, 1.0), right = nearness(from, to, s, r, -1.0);
    return left == -2.0 && right == -2.0 ? 0.0 : right > left ? -1.0 : 1.0;
}

/* A point counts as on the circle up to rounding. */
static const double on_circle = 1.0 - 16.0 * DBL_EPSILON;

/* The distance from a point to where its line touches the circle. The distance has no derivative on the circle itself.
 * */
static kt_real reach_of(kt_real square, double r) {
    return kt_value(square) > r * r ? kt_sqrt(square - r * r) : kt_real_of(0.0);
}

/* ---- in a plane -------------------------------------------------------------------------------------------------- */

/* Returns false if the path is straight. */
static bool wrap_outside(kt_triple p, kt_triple q, kt_triple n, const kt_triple *side, double r, kt_path_part *to) {
    const kt_real square[2] = {kt_triple_dot(p, p), kt_triple_dot(q, q)};
    if (kt_value(square[0]) < on_circle * r * r || kt_value(square[1]) < on_circle * r * r)
        return false;
    const kt_real s[2] = {reach_of(square[0], r), reach_of(square[1], r)};
    const kt_real free_angle = kt_atan2(s[0], kt_real_of(r)) + kt_atan2(s[1], kt_real_of(r));
    const kt_real angle = kt_atan2(kt_triple_dot(n, kt_triple_cross(p, q)), kt_triple_dot(p, q));
    const double shorter = fabs(kt_value(angle)) > kt_value(free_angle) ? kt_value(angle) < 0.0 ? -1.0 : 1.0 : 0.0;
    const double sense = side != NULL ? sense_of_side(p, q, n, *side, r) : shorter;
    if (sense == 0.0)
        return false;
    const double turn = 2.0 * 3.14159265358979323846;
    kt_real arc = sense * angle + (sense * kt_value(angle) < 0.0 ? turn : 0.0) - free_angle;
    arc += kt_value(arc) < 0.0 ? turn : 0.0;
    to->length = s[0] + r * arc + s[1];
    to->away[0] =
        kt_triple_scale(1.0 / square[0], kt_triple_sub(kt_triple_scale(s[0], p),
                                                       kt_triple_scale(kt_real_of(sense * r), kt_triple_cross(n, p))));
    to->away[1] =
        kt_triple_scale(1.0 / square[1], kt_triple_add(kt_triple_scale(s[1], q),
                                                       kt_triple_scale(kt_real_of(sense * r), kt_triple_cross(n, q))));
    return true;
}

enum { RING_STEPS = 60 };

/* The angle b at a ring: Newton's steps, halved intervals where these leave the interval. near, far: r / |p|, r / |q|.
 * The function increases with a slope of at least 2 - near - far. */
static double angle_at_ring(double near, double far, double phi) {
    double low = 0.0, high = 0.5 * 3.14159265358979323846, b = 0.5 * high;
    for (int k = 0; k < RING_STEPS && high - low > DBL_EPSILON; k++) {
        const double x = near * sin(b), y = far * sin(b);
        const double excess = 2.0 * b - asin(x) - asin(y) - phi;
        const double slope = 2.0 - cos(b) * (near / sqrt(1.0 - x * x) + far / sqrt(1.0 - y * y));
        low = excess < 0.0 ? b : low;
        high = excess < 0.0 ? high : b;
        const double next = b - excess / slope;
        if (fabs(next - b) <= DBL_EPSILON)
            return next;
        b = next > low && next < high ? next : 0.5 * (low + high);
    }
    return b;
}

/* n is such that q is counterclockwise of p. The point at the ring is exact in the values. One step of Newton's method
 * in dual numbers gives its derivative. */
static bool wrap_inside(kt_triple p, kt_triple q, kt_triple n, double r, kt_path_part *to) {
    const kt_real d[2] = {kt_triple_norm(p), kt_triple_norm(q)};
    const double near = r / kt_value(d[0]), far = r / kt_value(d[1]);
    const double phi = kt_value(kt_atan2(kt_triple_dot(n, kt_triple_cross(p, q)), kt_triple_dot(p, q)));
    if (!(near < 1.0 && far < 1.0) || acos(near) + acos(far) <= phi)
        return false;
    const double b = angle_at_ring(near, far, phi), at = b - asin(near * sin(b));
    const kt_triple x = kt_triple_scale(1.0 / d[0], p), y = kt_triple_cross(n, x);
    const kt_triple reached =
        kt_triple_add(kt_triple_scale(kt_real_of(r * cos(at)), x), kt_triple_scale(kt_real_of(r * sin(at)), y));
    const kt_triple forward =
        kt_triple_sub(kt_triple_scale(kt_real_of(r * cos(at)), y), kt_triple_scale(kt_real_of(r * sin(at)), x));
    const kt_triple line[2] = {kt_triple_sub(p, reached), kt_triple_sub(q, reached)};
    kt_real residual = kt_real_of(0.0);
    double slope = 0.0;
    for (int k = 0; k < 2; k++) {
        const kt_real length = kt_triple_norm(line[k]), along = kt_triple_dot(line[k], forward) / length;
        const double l = kt_value(length), a = kt_value(along);
        residual -= along;
        slope += (r * r + kt_value(kt_triple_dot(line[k], reached)) - a * a) / l;
    }
    const kt_triple moved = kt_triple_scale(residual / slope, forward);
    to->length = kt_real_of(0.0);
    for (int k = 0; k < 2; k++) {
        const kt_triple away = kt_triple_add(line[k], moved);
        const kt_real length = kt_triple_norm(away);
        to->length += length;
        to->away[k] = kt_triple_scale(1.0 / length, away);
    }
    return true;
}

/* ---- in space ---------------------------------------------------------------------------------------------------- */

/* The part around a circle in the plane normal to n: outside of it, or inside as through a ring. Returns false if the
 * path is straight. */
static bool wrap_in_plane(const kt_path_point_record *surface, kt_triple p, kt_triple q, kt_triple n,
                          const kt_triple *side, kt_path_part *to) {
    if (!surface->inside)
        return wrap_outside(p, q, n, surface->has_side ? side : NULL, surface->radius, to);
    const double turned = kt_value(kt_triple_dot(n, kt_triple_cross(p, q)));
    return wrap_inside(p, q, turned < 0.0 ? kt_triple_scale(kt_real_of(-1.0), n) : n, surface->radius, to);
}

/* The normal of the plane of p and q; if p and q are parallel, any normal to p. */
static kt_triple plane_normal_of(kt_triple p, kt_triple q) {
    const kt_triple n = kt_triple_cross(p, q);
    const kt_real square = kt_triple_dot(n, n);
    const double scale = kt_value(kt_triple_dot(p, p)) * kt_value(kt_triple_dot(q, q));
    if (kt_value(square) > DBL_EPSILON * DBL_EPSILON * scale)
        return kt_triple_scale(1.0 / kt_sqrt(square), n);
    const kt_vec3 along = plain_of(p);
    const kt_mat3 triad = kt_triad_from_axis(kt_vec3_norm(along) > 0.0 ? along : kt_vec3_make(0.0, 0.0, 1.0), 2);
    return kt_triple_constant(triad.x.x, triad.x.y, triad.x.z);
}

static kt_triple fixed_in(const kt_effect_frame *frame, kt_vec3 at) {
    return kt_columns_apply(frame->axes, kt_triple_constant(at.x, at.y, at.z));
}

static kt_triple part_across(kt_triple a, kt_triple u) {
    return kt_triple_sub(u, kt_triple_scale(kt_triple_dot(a, u), a));
}

/* The path from p to q, relative to the centre, around a surface on a frame. */
static bool wrap_around(const kt_path_point_record *surface, const kt_effect_frame *frame, kt_triple p, kt_triple q,
                        kt_path_part *to) {
    const kt_triple side = fixed_in(frame, surface->side);
    if (surface->type == KT_PATH_SPHERE)
        return wrap_in_plane(surface, p, q, plane_normal_of(p, q), &side, to);
    const kt_triple a = fixed_in(frame, surface->axis);
    if (!wrap_in_plane(surface, part_across(a, p), part_across(a, q), a, &side, to))
        return false;
    const kt_real h = kt_triple_dot(a, kt_triple_sub(q, p)), flat = to->length;
    to->length = kt_sqrt(flat * flat + h * h);
    for (int k = 0; k < 2; k++)
        to->away[k] = kt_triple_scale(
            1.0 / to->length, kt_triple_add(kt_triple_scale(flat, to->away[k]), kt_triple_scale(k == 0 ? -h : h, a)));
    return true;
}

/* The part along the line d = q - p: dL/dp = -d / |d|, dL/dq = d / |d|. */
static void lead_straight(kt_triple p, kt_triple q, kt_path_part *to) {
    const kt_triple d = kt_triple_sub(q, p);
    to->length = kt_triple_norm(d);
    const kt_real inverse = kt_value(to->length) > 0.0 ? 1.0 / to->length : kt_real_of(0.0);
    to->away[1] = kt_triple_scale(inverse, d);
    to->away[0] = kt_triple_scale(-inverse, d);
}

/* ---- the path ---------------------------------------------------------------------------------------------------- */

/* Adds a force on a link at a point to the wrench about its frame's point. */
static void add_force_at(const kt_effect_frame *frame, kt_triple point, kt_triple force, kt_effect_wrench *wrench) {
    const kt_triple arm = kt_triple_sub(point, frame->point);
    wrench->moment = kt_triple_add(wrench->moment, kt_triple_cross(arm, force));
    wrench->force = kt_triple_add(wrench->force, force);
}

/* Adds the part between two points; around: the surface between them, or NULL. */
static void add_part(const kt_path_point_record *from, const kt_path_point_record *around,
                     const kt_path_point_record *to, double divisor, const kt_effect_frame *frame, kt_path_value *value,
                     kt_triple force[2]) {
    const kt_path_point_record *const ends[2] = {from, to};
    kt_triple point[2];
    kt_path_part b;
    for (int k = 0; k < 2; k++)
        point[k] = kt_triple_add(frame[ends[k]->link].point, fixed_in(&frame[ends[k]->link], ends[k]->at));
    bool wraps = false;
    if (around != NULL) {
        const kt_effect_frame *on = &frame[around->link];
        const kt_triple centre = kt_triple_add(on->point, fixed_in(on, around->at));
        wraps = wrap_around(around, on, kt_triple_sub(point[0], centre), kt_triple_sub(point[1], centre), &b);
    }
    if (!wraps)
        lead_straight(point[0], point[1], &b);
    value->length += b.length / divisor;
    for (int k = 0; k < 2; k++) {
        force[k] = kt_triple_scale(kt_real_of(1.0 / divisor), b.away[k]);
        add_force_at(&frame[ends[k]->link], point[k], force[k], &value->unit[ends[k]->link]);
        if (wraps)
            add_force_at(&frame[around->link], point[k], kt_triple_scale(kt_real_of(-1.0), force[k]),
                         &value->unit[around->link]);
    }
}

/* Sums the lengths and the forces of the straight and wrapped parts between consecutive points; a surface between two
 * points belongs to the part between these. A point with a divisor begins a new branch: no part leads to it, and the
 * branch counts by 1 / divisor, as the several strands of a pulley do. */
void KT_EFFECT(kt_path_evaluate)(const kt_path_point_record *points, int count, const kt_effect_frame *frame, int links,
                                 kt_path_value *value) {
    const kt_path_point_record *last = NULL, *around = NULL;
    double divisor = 1.0;
    bool first = true;
    value->length = value->rate = kt_real_of(0.0);
    value->end[0] = value->end[1] = kt_triple_zero();
    for (int k = 0; k < links; k++)
        value->unit[k] = (kt_effect_wrench){.moment = kt_triple_zero(), .force = kt_triple_zero()};
    for (const kt_path_point_record *point = points; point < points + count; point++) {
        kt_triple force[2];
        if (point->type != KT_PATH_POINT) {
            around = point;
            continue;
        }
        if (point->divisor > 0.0) {
            divisor = point->divisor;
            last = NULL;
        }
        if (last != NULL) {
            add_part(last, around, point, divisor, frame, value, force);
            value->end[0] = first ? force[0] : value->end[0];
            value->end[1] = force[1];
            first = false;
        }
        last = point;
        around = NULL;
    }
    for (int k = 0; k < links; k++)
        value->rate += kt_triple_dot(value->unit[k].moment, frame[k].omega) +
                       kt_triple_dot(value->unit[k].force, frame[k].velocity);
}

/* ---- pictures ---------------------------------------------------------------------------------------------------- */

#ifndef KT_DUAL

enum { ARC = 12 }; /* lines of an arc */

static kt_vec3 between(kt_vec3 a, kt_vec3 b, double share) {
    return kt_vec3_add(kt_vec3_scale(1.0 - share, a), kt_vec3_scale(share, b));
}

/* The point of contact on the line from p along -away: the first point at the distance r from the centre, or from the
 * axis. */
static kt_vec3 reached_from(const kt_path_point_record *surface, kt_vec3 axis, kt_vec3 p, kt_vec3 away) {
    const bool is_sphere = surface->type == KT_PATH_SPHERE;
    const kt_vec3 flat = is_sphere ? p : part_across(axis, p), u = is_sphere ? away : part_across(axis, away);
    const double norm = kt_vec3_norm(u), along = kt_vec3_dot(flat, u) / norm;
    const double square = along * along - kt_vec3_dot(flat, flat) + surface->radius * surface->radius;
    return kt_vec3_sub(p, kt_vec3_scale((along - sqrt(fmax(square, 0.0))) / norm, away));
}

/* Writes the points of an arc between two points of contact, relative to the centre, along the shorter arc or, if the
 * path leaves the first point in the other sense, along the longer arc. A ring is touched in a single
 * point. */
static void trace_arc(kt_vec3 n, kt_vec3 axis, kt_vec3 from, kt_vec3 to, kt_vec3 away, bool is_ring, kt_vec3 *points) {
    const kt_vec3 a = part_across(axis, from), b = part_across(axis, to), forward = kt_vec3_cross(n, a);
    double turn = is_ring ? 0.0 : atan2(kt_vec3_dot(n, kt_vec3_cross(a, b)), kt_vec3_dot(a, b));
    if (turn * kt_vec3_dot(forward, away) > 0.0)
        turn -= copysign(2.0 * 3.14159265358979323846, turn);
    for (int i = 0; i <= ARC; i++) {
        const double share = (double)i / ARC, x = turn * share;
        const kt_vec3 around = kt_vec3_add(kt_vec3_scale(cos(x), a), kt_vec3_scale(sin(x), forward));
        const kt_vec3 up = between(kt_vec3_sub(from, a), kt_vec3_sub(to, b), share);
        points[i] = kt_vec3_add(around, up);
    }
}

/* Writes the ARC + 3 points of a part around a surface, whose centre is the origin. */
static void trace_around(const kt_path_point_record *surface, const kt_effect_frame *frame, kt_vec3 p, kt_vec3 q,
                         kt_vec3 *points) {
    const kt_vec3 axis = surface->type == KT_PATH_CYLINDER ? fixed_in(frame, surface->axis) : kt_triple_zero();
    kt_path_part part;
    points[0] = p;
    points[ARC + 2] = q;
    for (int i = 1; i < ARC + 2; i++)
        points[i] = between(p, q, (double)i / (ARC + 2));
    if (!wrap_around(surface, frame, p, q, &part))
        return;
    const kt_vec3 n = surface->type == KT_PATH_CYLINDER ? axis : plane_normal_of(p, q);
    trace_arc(n, axis, reached_from(surface, axis, p, part.away[0]), reached_from(surface, axis, q, part.away[1]),
              part.away[0], surface->inside, points + 1);
}

int kt_path_trace(const kt_path_point_record *points, int count, const kt_effect_frame *frame, kt_path_line *each,
                  void *user) {
    const kt_path_point_record *last = NULL, *around = NULL;
    int lines = 0;
    for (const kt_path_point_record *point = points; point < points + count; point++) {
        kt_vec3 vertex[ARC + 3];
        if (point->type != KT_PATH_POINT) {
            around = point;
            continue;
        }
        last = point->divisor > 0.0 ? NULL : last;
        const int parts = last == NULL ? 0 : around != NULL ? ARC + 2 : 1;
        if (parts > 0 && each != NULL) {
            const kt_effect_frame *on = &frame[around != NULL ? around->link : 0];
            const kt_vec3 o = around != NULL ? kt_vec3_add(on->point, fixed_in(on, around->at)) : kt_triple_zero();
            const kt_effect_frame *ends[2] = {&frame[last->link], &frame[point->link]};
            vertex[0] = kt_vec3_sub(kt_vec3_add(ends[0]->point, fixed_in(ends[0], last->at)), o);
            vertex[parts] = kt_vec3_sub(kt_vec3_add(ends[1]->point, fixed_in(ends[1], point->at)), o);
            if (around != NULL)
                trace_around(around, on, vertex[0], vertex[parts], vertex);
            for (int i = 0; i < parts; i++)
                each(user, kt_vec3_add(vertex[i], o), kt_vec3_add(vertex[i + 1], o));
        }
        lines += parts;
        last = point;
        around = NULL;
    }
    return lines;
}

#endif
