/* SPDX-License-Identifier: Apache-2.0 */
#include "moving.h"

static const jet zero = {0.0L, 0.0L, 0.0L};

void moving_turn(int k, jet angle, jet q[4]) {
    const jet half = jet_scale(0.5L, angle);
    for (int i = 0; i < 4; i++)
        q[i] = zero;
    q[0] = jet_cos(half);
    q[1 + k] = jet_sin(half);
}

void moving_multiply(const jet a[4], const jet b[4], jet out[4]) {
    jet c[4];
    c[0] = jet_sub(jet_mul(a[0], b[0]), jet_dot(a + 1, b + 1));
    for (int i = 0; i < 3; i++) {
        const int j = (i + 1) % 3, k = (i + 2) % 3;
        const jet cross = jet_sub(jet_mul(a[1 + j], b[1 + k]), jet_mul(a[1 + k], b[1 + j]));
        c[1 + i] = jet_add(jet_add(jet_mul(a[0], b[1 + i]), jet_mul(b[0], a[1 + i])), cross);
    }
    for (int i = 0; i < 4; i++)
        out[i] = c[i];
}

static void conjugate(const jet q[4], jet out[4]) {
    out[0] = q[0];
    for (int i = 1; i < 4; i++)
        out[i] = jet_scale(-1.0L, q[i]);
}

/* q u q* */
static void turn(const jet q[4], const jet u[3], jet out[3]) {
    jet pure[4] = {zero, u[0], u[1], u[2]}, back[4];
    conjugate(q, back);
    moving_multiply(q, pure, pure);
    moving_multiply(pure, back, pure);
    for (int i = 0; i < 3; i++)
        out[i] = pure[1 + i];
}

void moving_axes(const jet q[4], jet axes[3][3]) {
    for (int k = 0; k < 3; k++) {
        jet unit[3] = {zero, zero, zero};
        unit[k].x = 1.0L;
        turn(q, unit, axes[k]);
    }
}

jet moving_random_jet(kt_random *random, double most) {
    const double x = kt_random_uniform(random, -most, most), d = kt_random_normal(random);
    return jet_make((long double)x, (long double)d, (long double)kt_random_normal(random));
}

moving moving_random(kt_random *random, double far) {
    moving m;
    jet step[4];
    for (int k = 0; k < 3; k++)
        m.p[k] = moving_random_jet(random, far);
    moving_turn(2, moving_random_jet(random, 3.14), m.q);
    moving_turn(0, moving_random_jet(random, 3.14), step);
    moving_multiply(m.q, step, m.q);
    moving_turn(1, moving_random_jet(random, 3.14), step);
    moving_multiply(m.q, step, m.q);
    return m;
}

moving moving_compose(const moving *first, const moving *relative) {
    moving m;
    turn(first->q, relative->p, m.p);
    for (int i = 0; i < 3; i++)
        m.p[i] = jet_add(first->p[i], m.p[i]);
    moving_multiply(first->q, relative->q, m.q);
    return m;
}

moving moving_relative(const moving *first, const moving *second) {
    moving m;
    jet back[4], d[3];
    conjugate(first->q, back);
    for (int i = 0; i < 3; i++)
        d[i] = jet_sub(second->p[i], first->p[i]);
    turn(back, d, m.p);
    moving_multiply(back, second->q, m.q);
    for (int i = 3; i >= 0 && m.q[0].x < 0.0L; i--)
        m.q[i] = jet_scale(-1.0L, m.q[i]);
    return m;
}

static kt_v4 lanes(long double x, long double y, long double z) {
    return (kt_v4){(double)x, (double)y, (double)z, 0.0};
}

/* omega = 2 q' q*, alpha = 2 q'' q* (vector parts; q' q'* is a scalar) */
kt_loop_end moving_end(const moving *m, kt_v4 acceleration[2]) {
    kt_loop_end end;
    jet axes[3][3], back[4], rate[4], bend[4];
    moving_axes(m->q, axes);
    conjugate(m->q, back);
    for (int i = 0; i < 4; i++) {
        rate[i] = jet_constant(2.0L * m->q[i].d);
        bend[i] = jet_constant(2.0L * m->q[i].dd);
    }
    moving_multiply(rate, back, rate);
    moving_multiply(bend, back, bend);
    for (int k = 0; k < 3; k++)
        end.axes[k] = lanes(axes[k][0].x, axes[k][1].x, axes[k][2].x);
    end.point = lanes(m->p[0].x, m->p[1].x, m->p[2].x);
    end.velocity = lanes(m->p[0].d, m->p[1].d, m->p[2].d);
    end.omega = lanes(rate[1].x, rate[2].x, rate[3].x);
    end.turn = 0.0;
    end.alpha = end.linear = kt_v4_splat((double)NAN);
    if (acceleration) {
        acceleration[0] = lanes(bend[1].x, bend[2].x, bend[3].x);
        acceleration[1] = lanes(m->p[0].dd, m->p[1].dd, m->p[2].dd);
    }
    return end;
}

kt_loop_record moving_loop(kt_random *random, int type, double numbers[MOVING_NUMBERS]) {
    const kt_function length = kt_function_sine(0.5, 3.0 / 6.283185307179586, 0.4, 2.0);
    kt_loop_record loop = {.type = type};
    loop.pitch = kt_random_uniform(random, 0.1, 0.5) * (kt_random_int(random, 0, 1) ? 1.0 : -1.0);
    loop.angle = kt_random_uniform(random, -3.0, 3.0);
    loop.radius = kt_random_uniform(random, 0.3, 1.2);
    loop.contact = type == KT_LOOP_ROLLING;
    loop.curve = kt_curve_compile(&length, numbers, 0);
    loop.tube = kt_random_uniform(random, 0.1, 0.25);
    loop.form = type == KT_LOOP_SURFACE   ? kt_random_int(random, KT_SURFACE_PLANE, KT_SURFACE_TORUS)
                : type == KT_LOOP_ROLLING ? kt_random_int(random, 0, 2) /* a disc; a ball; a rim */
                                          : kt_random_int(random, KT_TRACK_LINE, KT_TRACK_HELIX);
    if (type == KT_LOOP_SURFACE || (type == KT_LOOP_CURVE && loop.form != KT_TRACK_HELIX))
        loop.pitch = 0.0;
    for (int k = 0; k < 2 && type >= KT_LOOP_GEAR; k++) {
        loop.gain[k] = kt_random_uniform(random, 0.02, 0.1) * (kt_random_int(random, 0, 1) ? 1.0 : -1.0);
        loop.bearing[k] = kt_random_uniform(random, -3.0, 3.0);
        loop.phase[k] = kt_random_uniform(random, -1.0, 1.0);
    }
    loop.slope[1] = type >= KT_LOOP_GEAR ? kt_random_uniform(random, -0.5, 0.5) : 0.0;
    loop.sense = type >= KT_LOOP_GEAR && kt_random_int(random, 0, 1) ? 1.0 : -1.0;
    loop.row_count = 2; /* of a curve: its arc length is free */
    return loop;
}

jet moving_length(double t) {
    const jet phase = jet_make(3.0L * (long double)t + 0.4L, 3.0L, 0.0L);
    return jet_add(jet_constant(2.0L), jet_scale(0.5L, jet_sin(phase)));
}

/* ---- the equations -------------------------------------------------------------------------------------------------
 */

static jet one_plus(jet a) { return jet_add(jet_constant(1.0L), a); }

static void parallel(const moving *r, jet phi[3]) {
    const jet scale = jet_scale(4.0L, jet_invert(one_plus(r->q[0])));
    for (int k = 0; k < 3; k++)
        phi[k] = jet_mul(scale, r->q[1 + k]);
}

/* The least rotation that takes z to the second z, f = (x, y, z), is about (-y, x, 0), with cos = z: as quaternion (b,
 * e), b^2 = (1 + z) / 2 = (x^2 + y^2) / (2 (1 - z)). */
static void coaxial(const moving *r, jet phi[2]) {
    jet axes[3][3];
    moving_axes(r->q, axes);
    const jet x = axes[2][0], y = axes[2][1], z = axes[2][2];
    const jet across = jet_add(jet_mul(x, x), jet_mul(y, y));
    const jet half =
        z.x > 0.0L ? jet_scale(0.5L, one_plus(z)) : jet_div(jet_scale(0.5L, across), jet_sub(jet_constant(1.0L), z));
    const jet b = jet_sqrt(half), scale = jet_scale(2.0L, jet_invert(jet_mul(b, one_plus(b))));
    phi[0] = jet_scale(-1.0L, jet_mul(scale, y));
    phi[1] = jet_mul(scale, x);
}

/* 2 tan(eps / 2), sin(eps) = z */
static jet orthogonal(const moving *r) {
    jet axes[3][3];
    moving_axes(r->q, axes);
    const jet x = axes[2][0], y = axes[2][1], z = axes[2][2];
    const jet s = jet_sqrt(jet_add(jet_mul(x, x), jet_mul(y, y)));
    return jet_scale(2.0L, jet_div(z, one_plus(s)));
}

/* phi for the number of whole turns that makes it least. */
static jet screw(const kt_loop_record *loop, const moving *r) {
    const jet turned = jet_sub(jet_scale(2.0L, jet_atan2(r->q[3], r->q[0])), jet_constant((long double)loop->angle));
    jet phi = jet_sub(r->p[2], jet_scale((long double)loop->pitch, turned));
    phi.x = remainderl(phi.x, 8.0L * atanl(1.0L) * (long double)loop->pitch);
    return phi;
}

/* Seen from the plane: the wheel's material point that is at the contact, and the gap. X and Y are the heights of the
 * disc's axes. At the lowest point of the rim, (cos, sin) along these axes is -(X, Y) / |(X, Y)|. */
static void rolling(const kt_loop_record *loop, const moving *wheel, jet phi[3]) {
    jet axes[3][3], material[3], velocity[3];
    moving_axes(wheel->q, axes);
    const bool ball = loop->form == 1;
    const jet x = axes[0][2], y = axes[1][2];
    const jet size = ball ? jet_constant(1.0L) : jet_sqrt(jet_add(jet_mul(x, x), jet_mul(y, y)));
    const long double radius = (long double)loop->radius;
    for (int k = 0; k < 3; k++)
        material[k] = jet_scale(k < 2 || ball ? -radius : 0.0L, jet_div(axes[k][2], size));
    for (int i = 0; i < 3; i++) {
        velocity[i] = jet_rate(wheel->p[i]);
        for (int k = 0; k < 3; k++)
            velocity[i] = jet_add(velocity[i], jet_mul(jet_rate(axes[k][i]), material[k]));
        phi[i] = jet_make((long double)NAN, velocity[i].x, velocity[i].d);
    }
    phi[2] = jet_sub(wheel->p[2], jet_scale(radius, size));
}

/* The second end's point seen from the first, and across the edge. */
static jet knife_edge(const moving *r) {
    jet axes[3][3], velocity[3];
    moving_axes(r->q, axes);
    for (int i = 0; i < 3; i++)
        velocity[i] = jet_rate(r->p[i]);
    const jet across = jet_dot(axes[2], velocity);
    return jet_make((long double)NAN, across.x, across.d);
}

/* 4 tan((theta - angle) / 4), at the nearest of all whole turns */
static jet homokinetic(const kt_loop_record *loop, const moving *r) {
    const jet turned = jet_sub(jet_scale(2.0L, jet_atan2(r->q[3], r->q[0])), jet_constant((long double)loop->angle));
    const jet quarter = jet_make(0.25L * remainderl(turned.x, 8.0L * atanl(1.0L)), 0.25L * turned.d, 0.25L * turned.dd);
    return jet_scale(4.0L, jet_div(jet_sin(quarter), jet_cos(quarter)));
}

static jet norm(jet x, jet y) { return jet_sqrt(jet_add(jet_mul(x, x), jet_mul(y, y))); }

static jet less(jet a, double b) { return jet_sub(a, jet_constant((long double)b)); }

static jet surface(const kt_loop_record *loop, const moving *r) {
    const jet rho = norm(r->p[0], r->p[1]);
    switch (loop->form) {
    case KT_SURFACE_PLANE:
        return r->p[2];
    case KT_SURFACE_CYLINDER:
        return less(rho, loop->radius);
    case KT_SURFACE_SPHERE:
        return less(norm(rho, r->p[2]), loop->radius);
    default:
        return less(norm(less(rho, loop->radius), r->p[2]), loop->tube);
    }
}

/* A line or a circle: across it, along its normals, and the arc length. */
static int curve(const kt_loop_record *loop, double t, const moving *r, jet phi[3]) {
    const long double R = (long double)loop->radius, around = 8.0L * atanl(1.0L) * R;
    if (loop->form == KT_TRACK_LINE) {
        phi[0] = jet_scale(-1.0L, r->p[1]);
        phi[1] = r->p[0];
        phi[2] = jet_sub(r->p[2], moving_length(t));
    } else {
        phi[0] = jet_scale(-1.0L, less(norm(r->p[0], r->p[1]), loop->radius));
        phi[1] = r->p[2];
        phi[2] = jet_sub(jet_scale(R, jet_atan2(r->p[1], r->p[0])), moving_length(t));
        phi[2].x = remainderl(phi[2].x, around);
    }
    return loop->row_count;
}

static jet nearest(jet a, double b) {
    const jet apart = less(a, b);
    return jet_make(remainderl(apart.x, 8.0L * atanl(1.0L)), apart.d, apart.dd);
}

/* The angles of d in the frames of both ends, from those at the start. */
static void bearings(const kt_loop_record *loop, const moving *r, jet beta[2]) {
    jet axes[3][3];
    moving_axes(r->q, axes);
    const jet second = jet_atan2(jet_dot(r->p, axes[1]), jet_dot(r->p, axes[0]));
    beta[0] = nearest(jet_atan2(r->p[1], r->p[0]), loop->bearing[0]);
    const jet alike = jet_scale((long double)loop->sense, beta[0]);
    beta[1] = jet_add(alike, nearest(jet_sub(second, alike), loop->bearing[1]));
}

/* The length of a straight span and of what it loses on the pulleys. */
static jet span(const kt_loop_record *loop, const moving *r, double side, double phase) {
    jet beta[2];
    const long double one = (long double)(side * loop->gain[0]), two = (long double)(side * loop->gain[1]);
    const jet D = jet_constant(one - two);
    const jet square = jet_add(jet_mul(r->p[0], r->p[0]), jet_mul(r->p[1], r->p[1]));
    const jet length = jet_sqrt(jet_sub(square, jet_mul(D, D)));
    bearings(loop, r, beta);
    const jet wound = jet_sub(jet_scale(two * (long double)loop->sense, beta[1]), jet_scale(one, beta[0]));
    return less(jet_add(jet_add(length, jet_mul(D, jet_atan2(D, length))), wound), phase);
}

static int wheels(const kt_loop_record *loop, const moving *r, jet phi[6]) {
    jet axes[3][3], beta[2];
    moving_axes(r->q, axes);
    bearings(loop, r, beta);
    if (loop->type == KT_LOOP_SPAN) {
        phi[0] = span(loop, r, 1.0, loop->phase[0]);
        return 1;
    }
    if (loop->type == KT_LOOP_BELT) {
        const jet one = span(loop, r, 1.0, loop->phase[0]), two = span(loop, r, -1.0, loop->phase[1]);
        phi[0] = jet_scale(0.5L, jet_sub(one, two));
        phi[1] = jet_add(one, two);
        return 2;
    }
    if (loop->type == KT_LOOP_RACK) {
        const jet gamma = nearest(jet_atan2(axes[2][1], axes[2][0]), loop->bearing[0]);
        phi[0] = less(jet_sub(jet_dot(axes[2], r->p), jet_scale((long double)loop->gain[0], gamma)), loop->phase[0]);
        return 1;
    }
    phi[0] = jet_add(jet_scale((long double)loop->gain[0], beta[0]), jet_scale((long double)loop->gain[1], beta[1]));
    if (loop->type == KT_LOOP_GEAR)
        phi[0] = less(jet_add(phi[0], jet_scale((long double)loop->slope[1], r->p[2])), loop->phase[0]);
    return 1;
}

static int lower_pair(const kt_loop_record *loop, const moving *r, jet phi[6]) {
    const bool point[KT_LOOP_TYPE_COUNT][3] = {
        [KT_LOOP_SPHERICAL] = {true, true, true},    [KT_LOOP_INLINE] = {true, true, false},
        [KT_LOOP_INPLANE] = {false, false, true},    [KT_LOOP_REVOLUTE] = {true, true, true},
        [KT_LOOP_PRISMATIC] = {true, true, false},   [KT_LOOP_SCREW] = {true, true, false},
        [KT_LOOP_CYLINDRICAL] = {true, true, false}, [KT_LOOP_PLANAR] = {false, false, true},
        [KT_LOOP_WELD] = {true, true, true},         [KT_LOOP_UNIVERSAL] = {true, true, true},
        [KT_LOOP_HOMOKINETIC] = {true, true, true},
    };
    int n = 0;
    for (int k = 0; k < 3; k++)
        if (point[loop->type][k])
            phi[n++] = r->p[k];
    switch (loop->type) {
    case KT_LOOP_PARALLEL:
    case KT_LOOP_PRISMATIC:
    case KT_LOOP_WELD:
        parallel(r, phi + n);
        return n + 3;
    case KT_LOOP_COAXIAL:
    case KT_LOOP_REVOLUTE:
    case KT_LOOP_CYLINDRICAL:
    case KT_LOOP_SCREW:
    case KT_LOOP_PLANAR:
        coaxial(r, phi + n);
        n += 2;
        break;
    case KT_LOOP_ORTHOGONAL:
    case KT_LOOP_UNIVERSAL:
        phi[n++] = orthogonal(r);
        break;
    default:
        break;
    }
    if (loop->type == KT_LOOP_SCREW)
        phi[n++] = screw(loop, r);
    if (loop->type == KT_LOOP_HOMOKINETIC)
        phi[n++] = homokinetic(loop, r);
    return n;
}

int moving_equations(const kt_loop_record *loop, double t, const moving *first, const moving *second, jet phi[6]) {
    const moving r = moving_relative(first, second);
    if (loop->type == KT_LOOP_DISTANCE) {
        phi[0] = jet_sub(jet_sqrt(jet_dot(r.p, r.p)), moving_length(t));
        return 1;
    }
    if (loop->type == KT_LOOP_ROLLING) {
        const moving wheel = moving_relative(second, first);
        rolling(loop, &wheel, phi);
        if (loop->form == 2)
            phi[0] = phi[2];
        return loop->form == 2 ? 1 : loop->contact ? 3 : 2;
    }
    if (loop->type == KT_LOOP_CURVE)
        return curve(loop, t, &r, phi);
    if (loop->type == KT_LOOP_SURFACE) {
        phi[0] = surface(loop, &r);
        return 1;
    }
    if (loop->type >= KT_LOOP_GEAR)
        return wheels(loop, &r, phi);
    if (loop->type == KT_LOOP_KNIFE_EDGE) {
        phi[0] = knife_edge(&r);
        return 1;
    }
    return lower_pair(loop, &r, phi);
}

moving_rates moving_rates_of(const kt_loop_row *row, const kt_loop_end end[2], kt_v4 acceleration[2][2]) {
    const kt_v4 d = end[1].point - end[0].point;
    const kt_v4 w = end[1].omega - end[0].omega, alpha = acceleration[1][0] - acceleration[0][0];
    const kt_v4 u = end[1].velocity - end[0].velocity - kt_v4_cross(end[0].omega, d);
    const kt_v4 a = acceleration[1][1] - acceleration[0][1] - kt_v4_cross(acceleration[0][0], d);
    return (moving_rates){.first = kt_v4_dot(row->moment, w) + kt_v4_dot(row->force, u) + row->rate,
                          .second = kt_v4_dot(row->moment, alpha) + kt_v4_dot(row->force, a) + row->drift};
}

static double size(kt_v4 u) { return sqrt(kt_v4_dot(u, u)); }

moving_rates moving_scales(const kt_loop_end end[2], kt_v4 acceleration[2][2]) {
    const double arm = 1.0 + size(end[1].point - end[0].point);
    const double w = size(end[0].omega) + size(end[1].omega), v = size(end[0].velocity) + size(end[1].velocity);
    const double alpha = size(acceleration[0][0]) + size(acceleration[1][0]);
    const double a = size(acceleration[0][1]) + size(acceleration[1][1]);
    return (moving_rates){.first = w * arm + v + 1.0, .second = (w * w + alpha) * arm + (w + v) * (w + v) + a + 4.0};
}
