/* Curve: the second point stays on a curve c(s) of the first end's frame, and its arc length may be given.
 *
 * The foot of the point p (d in that frame) is the nearest point of the curve, (p - c) . c' = 0. The derivatives of c
 * by s are c1, c2 and c3, and delta = p - c. u is the velocity and a the acceleration of p as seen in that frame,
 *     s'  = c1 . u / D,                 D = c1 . c1 - delta . c2
 *     s'' = (c1 . a + b) / D,           b = 2 s' c2 . u + s'^2 (delta . c3 - 3 c1 . c2)
 * The rows across the curve are along its normals N_1 and N_2, for a fixed direction g:
 *     N_1 = w / |w|,  w = g x c1,       N_2 = T x N_1,  T = c1 / |c1|
 * The normals turn about T by tau for each unit of s,
 *     tau   = N_2 . w' / |w|,           w' = g x c2, w'' = g x c3
 *     tau'  = (N_2 . w'' - (N_2 . c2) (T . w') / |c1| - 2 tau N_1 . w') / |w|
 *     N_1'  = tau N_2 - (N_1 . c2) c1 / c1^2,   N_2' = -tau N_1 - (N_2 . c2) c1 / c1^2
 * Let phi_k = N_k . delta, and k* the index of the other row. With the sign e = 1 for k = 1 and e = -1 for k = 2,
 *     phi'  = N_k . u + e tau s' phi_k*
 *     phi'' = N_k . a + s' (e tau N_k* . u - (N_k . c2) (c1 . u) / c1^2)
 *             + e (tau s'' + tau' s'^2) phi_k* + e tau s' phi_k*'
 * With the arc length, sigma' = |c1| s',
 *     phi   = sigma - f(t)
 *     phi'  = |c1| / D c1 . u - f'
 *     phi'' = |c1| s'' + (c1 . c2) s'^2 / |c1| - f''
 * Lines, circles and helices have their arc length as the parameter. A spline is natural, and its parameter is the sum
 * of the points' distances. The arc length of a spline is the sum of Gauss's quadrature of |c1| over its pieces.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "loop/relative_motion.h"

#include <float.h>
#include <math.h>

/* ---- the numbers of a spline ----------------------------------------------------------------------------------------
 *
 * Parameters and arc lengths at the points, a reference direction, and for each piece the coefficients of 1, x, x^2 and
 * x^3 in three components.
 */
enum { PIECE = 12 };

static const double *lengths_of(const double *spline, int points) { return spline + points; }
static const double *spline_reference_of(const double *spline, int points) { return spline + 2 * (size_t)points; }
static const double *piece_of(const double *spline, int points, int i) {
    return spline + 2 * (size_t)points + 3 + PIECE * (size_t)i;
}

/* |c1| of a piece at x from its beginning. */
static double speed_at(const double *piece, double x) {
    double square = 0.0;
    for (int k = 0; k < 3; k++) {
        const double slope = piece[3 + k] + x * (2.0 * piece[6 + k] + x * 3.0 * piece[9 + k]);
        square += slope * slope;
    }
    return sqrt(square);
}

/* The integral of |c1| from the beginning of a piece to x: Gauss's rule of eight points, in four parts of the piece. */
static double length_to(const double *piece, double x) {
    static const double node[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
    static const double weight[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};
    enum { PARTS = 4 };
    const double half = 0.5 * x / PARTS;
    double sum = 0.0;
    for (int part = 0; part < PARTS; part++)
        for (int i = 0; i < 4; i++) {
            const double middle = (2 * part + 1) * half, off = node[i] * half;
            sum += weight[i] * (speed_at(piece, middle - off) + speed_at(piece, middle + off));
        }
    return half * sum;
}

/* ---- points of a curve ------------------------------------------------------------------------------------------- */

/* c and its derivatives by the parameter, in the first end's frame. */
typedef struct place {
    kt_vector c, c1, c2, c3;
} place;

/* About the axis, at the arc length s; a circle has no pitch. */
static place place_of_helix(const kt_loop_record *loop, kt_real s) {
    const double R = loop->radius, h = loop->pitch, rate = 1.0 / sqrt(R * R + h * h);
    const kt_real angle = rate * s, c = kt_cos(angle), z = kt_sin(angle);
    const double r1 = R * rate, r2 = r1 * rate, r3 = r2 * rate;
    return (place){.c = kt_vector_make(R * c, R * z, h * angle),
                   .c1 = kt_vector_make(-r1 * z, r1 * c, h * rate),
                   .c2 = kt_vector_make(-r2 * c, -r2 * z, 0.0),
                   .c3 = kt_vector_make(r3 * z, -r3 * c, 0.0)};
}

/* The piece of a spline that has the parameter s. */
static int piece_at(const double *spline, int points, double s) {
    int low = 0, high = points - 1;
    while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (spline[middle] <= s)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static kt_vector curve_vector_of(const double *a) { return kt_vector_make(a[0], a[1], a[2]); }

/* Beyond its ends a spline is straight. */
static place place_of_spline(const double *spline, int points, kt_real s) {
    const int i = piece_at(spline, points, kt_value(s));
    const double *a = piece_of(spline, points, i), last = spline[points - 1];
    const bool after = kt_value(s) > last, straight = kt_value(s) < 0.0 || after;
    const kt_real x = after ? last - spline[i] + 0.0 * s : straight ? 0.0 * s : s - spline[i];
    const kt_vector c0 = curve_vector_of(a), b = curve_vector_of(a + 3), c = curve_vector_of(a + 6),
                    d = curve_vector_of(a + 9);
    place at = {.c = c0 + kt_scale(x, b + kt_scale(x, c + kt_scale(x, d))),
                .c1 = b + kt_scale(x, kt_scale(2.0, c) + kt_scale(3.0 * x, d)),
                .c2 = kt_scale(2.0, c) + kt_scale(6.0 * x, d),
                .c3 = kt_scale(6.0, d)};
    if (straight) {
        at.c = at.c + kt_scale(after ? s - last : s, at.c1);
        at.c2 = at.c3 = kt_vector_zero();
    }
    return at;
}

/* The curve at s with its derivatives. A line is the z axis, and s is its arc length. */
static place place_at(const kt_loop_record *loop, const double *numbers, kt_real s) {
    if (loop->form == KT_TRACK_LINE)
        return (place){.c = kt_vector_make(0.0, 0.0, s),
                       .c1 = kt_vector_make(0.0, 0.0, 1.0),
                       .c2 = kt_vector_zero(),
                       .c3 = kt_vector_zero()};
    if (loop->form == KT_TRACK_SPLINE)
        return place_of_spline(numbers + loop->number, loop->count, s);
    return place_of_helix(loop, s);
}

/* ---- the foot ---------------------------------------------------------------------------------------------------- */

/* The nearest of nine points of each piece of a spline. */
static double nearest_sample(const double *spline, int points, const double p[3]) {
    enum { SAMPLES = 8 };
    double best = HUGE_VAL, found = 0.0;
    for (int i = 0; i + 1 < points; i++)
        for (int k = 0; k <= SAMPLES; k++) {
            const double *a = piece_of(spline, points, i), x = k * (spline[i + 1] - spline[i]) / SAMPLES;
            double square = 0.0;
            for (int j = 0; j < 3; j++) {
                const double gap = a[j] + x * (a[3 + j] + x * (a[6 + j] + x * a[9 + j])) - p[j];
                square += gap * gap;
            }
            if (square < best) {
                best = square;
                found = spline[i] + x;
            }
        }
    return found;
}

/* Returns the start of the search for the foot: on a helix in the turn whose height is nearest. */
static double foot_near(const kt_loop_record *loop, const double *numbers, const double p[3]) {
    if (loop->form == KT_TRACK_SPLINE)
        return nearest_sample(numbers + loop->number, loop->count, p);
    if (loop->form == KT_TRACK_LINE)
        return p[2];
    const double R = loop->radius, h = loop->pitch, full = 6.283185307179586, angle = atan2(p[1], p[0]);
    const double turns = h != 0.0 ? nearbyint((p[2] / h - angle) / full) : 0.0;
    return (angle + full * turns) * sqrt(R * R + h * h);
}

/* Newton's step from s towards the foot of p; where the curve's curvature takes over, one that goes downhill. */
static kt_real step_to_foot(const kt_loop_record *loop, const double *numbers, kt_real s, kt_vector p) {
    const place x = place_at(loop, numbers, s);
    const kt_vector delta = p - x.c;
    const kt_real slope = kt_dot(x.c1, x.c1), D = slope - kt_dot(delta, x.c2);
    return kt_dot(delta, x.c1) / (kt_value(D) > 0.1 * kt_value(slope) ? D : slope);
}

/* The foot of the point: Newton's method from nearby for its value, and once more for its derivative. */
static kt_real foot_of(const kt_loop_record *loop, const double *numbers, kt_vector p) {
    enum { STEPS = 40 };
    const double at[3] = {kt_value(kt_component(p, 0)), kt_value(kt_component(p, 1)), kt_value(kt_component(p, 2))};
    const kt_vector fixed = curve_vector_of(at);
    double s = foot_near(loop, numbers, at), change = HUGE_VAL;
    for (int i = 0; i < STEPS && fabs(change) > 4.0 * DBL_EPSILON * (1.0 + fabs(s)); i++) {
        change = kt_value(step_to_foot(loop, numbers, s, fixed));
        s += change;
    }
    return s + step_to_foot(loop, numbers, s, p);
}

/* ---- rows -------------------------------------------------------------------------------------------------------- */

/* sigma at the foot s, whose value with the speed |c1| gives the derivative. */
static kt_real arc_length(const kt_loop_record *loop, const double *numbers, kt_real s, kt_real speed) {
    if (loop->form != KT_TRACK_SPLINE)
        return s;
    const double *spline = numbers + loop->number, value = kt_value(s), last = spline[loop->count - 1];
    const int i = piece_at(spline, loop->count, value);
    const double inside = fmin(fmax(value, 0.0), last), start = lengths_of(spline, loop->count)[i];
    const double sum = start + length_to(piece_of(spline, loop->count, i), inside - spline[i]);
    return sum + kt_value(speed) * (value - inside) + speed * (s - value);
}

/* Least part of c1^2 that D counts as: at a centre of curvature, where all of the curve is as near, D is zero. */
#define LEAST 1e-6

/* The motion of the foot, vectors in the first end's frame. */
typedef struct foot {
    place at;
    kt_vector delta, u;
    kt_real s, D, square, speed; /* s, D, c1^2, |c1| */
    kt_real rate, bias;          /* s', b */
} foot;

/* The foot of a point p that moves at the velocity u, in the curve's frame: the parameter s with (p - c(s)) . c'(s)
 * = 0, its rate c' . u / D with D = c' . c' - (p - c) . c'', and the part of its acceleration that velocities alone
 * cause. */
static foot foot_moving(const kt_loop_record *loop, const double *numbers, kt_vector p, kt_vector u) {
    foot f = {.s = foot_of(loop, numbers, p), .u = u};
    f.at = place_at(loop, numbers, f.s);
    f.delta = p - f.at.c;
    f.square = kt_dot(f.at.c1, f.at.c1);
    f.speed = kt_sqrt(f.square);
    f.D = kt_max(f.square - kt_dot(f.delta, f.at.c2), LEAST * kt_value(f.square));
    f.rate = kt_dot(f.at.c1, u) / f.D;
    f.bias = 2.0 * f.rate * kt_dot(f.at.c2, u) +
             f.rate * f.rate * (kt_dot(f.delta, f.at.c3) - 3.0 * kt_dot(f.at.c1, f.at.c2));
    return f;
}

/* The direction g, which is never along the curve. */
static kt_vector reference(const kt_loop_record *loop, const double *numbers) {
    if (loop->form == KT_TRACK_SPLINE)
        return curve_vector_of(spline_reference_of(numbers + loop->number, loop->count));
    return loop->form == KT_TRACK_LINE ? kt_vector_make(1.0, 0.0, 0.0) : kt_vector_make(0.0, 0.0, 1.0);
}

/* The rows across the curve. */
static void rows_across(const foot *f, kt_vector g, const kt_vector *e, kt_vector coriolis, kt_loop_row rows[2]) {
    const place *x = &f->at;
    const kt_vector w = kt_cross(g, x->c1), w1 = kt_cross(g, x->c2), w2 = kt_cross(g, x->c3);
    const kt_real size = kt_sqrt(kt_dot(w, w));
    const kt_vector T = kt_over(x->c1, f->speed), across = kt_over(w, size);
    const kt_vector normal[2] = {across, kt_cross(T, across)};
    const kt_real tau = kt_dot(normal[1], w1) / size;
    const kt_real tau1 =
        (kt_dot(normal[1], w2) - kt_dot(normal[1], x->c2) * kt_dot(T, w1) / f->speed - 2.0 * tau * kt_dot(across, w1)) /
        size;
    const kt_real turn = tau * f->rate, turn_rate = tau * f->bias / f->D + tau1 * f->rate * f->rate;
    const kt_real phi[2] = {kt_dot(normal[0], f->delta), kt_dot(normal[1], f->delta)};
    const kt_real rate[2] = {kt_dot(normal[0], f->u) + turn * phi[1], kt_dot(normal[1], f->u) - turn * phi[0]};
    const kt_real curved = f->rate * kt_dot(x->c1, f->u) / f->square;
    for (int k = 0; k < 2; k++) {
        const double sign = k ? -1.0 : 1.0;
        const int other = 1 - k;
        const kt_vector force = kt_apply(e, normal[k] + kt_scale(sign * tau * phi[other] / f->D, x->c1));
        rows[k] = (kt_loop_row){
            .force = force,
            .moment = kt_vector_zero(),
            .residual = phi[k],
            .drift = kt_dot(force, coriolis) - kt_dot(normal[k], x->c2) * curved +
                     sign * (turn * kt_dot(normal[other], f->u) + turn_rate * phi[other] + turn * rate[other]),
            .holonomic = true};
    }
}

/* The row of the arc length. */
static kt_loop_row row_along(const kt_loop_record *loop, const double *numbers, const foot *f, const kt_vector *e,
                             kt_vector coriolis, double t) {
    double goal[3];
    kt_curve_evaluate(&loop->curve, numbers, t, goal);
    const kt_real phi = arc_length(loop, numbers, f->s, f->speed) - goal[0];
    const kt_vector force = kt_apply(e, kt_scale(f->speed / f->D, f->at.c1));
    const kt_real bias = f->speed / f->D * f->bias + kt_dot(f->at.c1, f->at.c2) * f->rate * f->rate / f->speed;
    return (kt_loop_row){.force = force,
                         .moment = kt_vector_zero(),
                         .residual =
                             loop->form == KT_TRACK_CIRCLE ? kt_remainder(phi, 6.283185307179586 * loop->radius) : phi,
                         .rate = -goal[1],
                         .drift = kt_dot(force, coriolis) + bias - goal[2],
                         .holonomic = true};
}

static int evaluate_curve(const kt_loop_record *loop, const double *numbers, const kt_loop_end end[2], double t,
                          kt_loop_row *rows) {
    const kt_loop_relative r = kt_loop_relative_of(end);
    const kt_vector *e = end[0].axes;
    const foot f = foot_moving(loop, numbers, kt_apply_transposed(e, r.d), kt_apply_transposed(e, r.u));
    rows_across(&f, reference(loop, numbers), e, r.coriolis, rows);
    if (loop->row_count < 3)
        return 2;
    rows[2] = row_along(loop, numbers, &f, e, r.coriolis, t);
    return 3;
}

static double arc_length_at(const kt_loop_record *loop, const double *numbers, const double p[3]) {
    const kt_real s = foot_of(loop, numbers, curve_vector_of(p));
    const place x = place_at(loop, numbers, s);
    return kt_value(arc_length(loop, numbers, s, kt_sqrt(kt_dot(x.c1, x.c1))));
}

static int curve_row_count(const kt_loop *loop) { return loop->function.type == KT_FUNCTION_NONE ? 2 : 3; }

/* ---- the spline -------------------------------------------------------------------------------------------------- */

/* The numbers of a spline: two for each point, three for the whole, and PIECE for each piece between two points. */
static size_t curve_number_count(const kt_loop *loop) {
    const size_t points = loop->curve.type == KT_TRACK_SPLINE ? (size_t)loop->curve.point_count : 0;
    return points ? 2 * points + 3 + PIECE * (points - 1) : 0;
}

static void read_track_point(const kt_track *track, int i, double p[3]) {
    p[0] = track->points[i].x;
    p[1] = track->points[i].y;
    p[2] = track->points[i].z;
}

/* The natural spline of component k: second derivatives m_i by elimination, then the coefficients (model/function.c).
 * The coefficients of x^2 and x^3 hold the diagonal and m meanwhile. */
static void fit_component(const kt_track *track, int k, double *spline) {
    const int n = track->point_count;
    double *piece = spline + 2 * (size_t)n + 3, before[3], here[3], next[3];
    for (int i = 0; i + 1 < n; i++) {
        const double h = spline[i + 1] - spline[i];
        read_track_point(track, i, here);
        read_track_point(track, i + 1, next);
        double *a = piece + PIECE * (size_t)i;
        a[k] = here[k];
        a[3 + k] = (next[k] - here[k]) / h;
        a[6 + k] = 1.0;
        a[9 + k] = 0.0;
        if (i == 0)
            continue;
        read_track_point(track, i - 1, before);
        const double *up = a - PIECE, width = spline[i] - spline[i - 1];
        const double factor = i > 1 ? width / up[6 + k] : 0.0;
        a[6 + k] = 2.0 * (width + h) - factor * width;
        a[9 + k] = 6.0 * (a[3 + k] - (here[k] - before[k]) / width) - factor * up[9 + k];
    }
    double after = 0.0; /* m of the point after the piece */
    for (int i = n - 2; i >= 0; i--) {
        double *a = piece + PIECE * (size_t)i;
        const double h = spline[i + 1] - spline[i];
        const double m = i > 0 ? (a[9 + k] - h * after) / a[6 + k] : 0.0;
        a[3 + k] -= h * (2.0 * m + after) / 6.0;
        a[6 + k] = 0.5 * m;
        a[9 + k] = (after - m) / (6.0 * h);
        after = m;
    }
}

/* The least square of the sine between the curve's tangent and a direction. */
static double clearance(const double *spline, int points, const double g[3]) {
    enum { SAMPLES = 8 };
    double least = 1.0;
    for (int i = 0; i + 1 < points; i++)
        for (int j = 0; j <= SAMPLES; j++) {
            const double *a = piece_of(spline, points, i), x = j * (spline[i + 1] - spline[i]) / SAMPLES;
            double along = 0.0;
            for (int k = 0; k < 3; k++)
                along += g[k] * (a[3 + k] + x * (2.0 * a[6 + k] + x * 3.0 * a[9 + k]));
            const double cosine = along / speed_at(a, x);
            least = fmin(least, 1.0 - cosine * cosine);
        }
    return least;
}

/* Chooses a direction that is never along the curve: among sample directions, the direction with the largest
 * clearance. */
static void choose_reference(double *spline, int points) {
    enum { DIRECTIONS = 64 };
    double best = -1.0;
    for (int i = 0; i < DIRECTIONS; i++) {
        const double z = (i + 0.5) / DIRECTIONS, r = sqrt(1.0 - z * z), angle = 2.399963229728653 * i;
        const double g[3] = {r * cos(angle), r * sin(angle), z};
        const double clear = clearance(spline, points, g);
        if (clear > best) {
            best = clear;
            for (int k = 0; k < 3; k++)
                spline[2 * (size_t)points + (size_t)k] = g[k];
        }
    }
}

/* Stores the curve's numbers. A spline is parametrised by the lengths of its chords: n parameters, n arc lengths up to
 * the points, and the coefficients of each component. */
static void prepare_curve(const kt_description *description, const kt_loop *loop, double *numbers,
                          kt_loop_record *record) {
    (void)description;
    const kt_track *track = &loop->curve;
    const int n = track->point_count;
    record->form = (int32_t)track->type;
    record->radius = track->radius;
    record->pitch = track->type == KT_TRACK_HELIX ? track->pitch : 0.0;
    if (track->type != KT_TRACK_SPLINE)
        return;
    double *spline = numbers + record->number;
    record->count = n;
    spline[0] = spline[n] = 0.0;
    for (int i = 0; i + 1 < n; i++)
        spline[i + 1] = spline[i] + kt_vec3_norm(kt_vec3_sub(track->points[i + 1], track->points[i]));
    for (int k = 0; k < 3; k++)
        fit_component(track, k, spline);
    for (int i = 0; i + 1 < n; i++)
        spline[n + i + 1] = spline[n + i] + length_to(piece_of(spline, n, i), spline[i + 1] - spline[i]);
    choose_reference(spline, n);
}

const kt_loop_kind KT_KERNEL(kt_loop_curve) = {.rows = 3,
                                               .evaluate = evaluate_curve,
                                               .part = {KT_PART_SPATIAL, KT_PART_SPATIAL, KT_PART_SPATIAL},
                                               .row_count = curve_row_count,
                                               .number_count = curve_number_count,
                                               .prepare = prepare_curve,
                                               .arc_length = arc_length_at};

#if KT_DESCRIBES
#define BEAD                                                                                                           \
    "bodies:\n"                                                                                                        \
    "  - name: bead\n"                                                                                                 \
    "    joint: {type: free, position: {position: [0, 0.3, 0.4]}}\n"                                                   \
    "    mass: 1\n"                                                                                                    \
    "    shape: {type: sphere, radius: 0.03}\n"                                                                        \
    "loops:\n"

static const kt_key keys[] = {
    KT_BETWEEN_KEY(kt_loop),
    {"curve", KT_KEY_TRACK, KT_LOOP_AT(curve), "", "one of line, circle, helix, spline", .needed = true},
    {"axis", KT_KEY_AXIS, KT_LOOP_AT(axis), "", "z of the curve, in the frame of the first end", .needed = false},
    {"distance", KT_KEY_FUNCTION, KT_LOOP_AT(function), "m",
     "f, the arc length, a number or a function of time: one equation more", "free", .needed = false},
};
const kt_descriptor kt_loop_curve_descriptor = {
    .name = "curve",
    .help = "the second point stays on a curve; its arc length may be given",
    .formula = "N_1 . (d - c) = 0,  N_2 . (d - c) = 0    c: the nearest point of the curve, N_k: its normals\n"
               "sigma = f(t)                             sigma: arc length; of a circle, whole turns are not "
               "counted",
    .example = BEAD "  - {name: wire, type: curve, between: [world, bead], curve: {circle: {radius: 0.5}}, axis: x}\n",
    KT_DESCRIPTOR_KEYS,
};
#endif
