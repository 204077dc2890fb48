/* SPDX-License-Identifier: Apache-2.0 */
#include "oracle.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#pragma GCC diagnostic ignored "-Wdouble-promotion" /* to long double: that is the purpose */

/* ---- Taylor series in time: c[0] + c[1] t + c[2] t^2 --------------------------------------------------------- */

typedef struct series {
    long double c[3];
} series;

static series make(long double c0, long double c1, long double c2) { return (series){{c0, c1, c2}}; }
static series plus(series a, series b) { return make(a.c[0] + b.c[0], a.c[1] + b.c[1], a.c[2] + b.c[2]); }

static series times(series a, series b) {
    return make(a.c[0] * b.c[0], a.c[0] * b.c[1] + a.c[1] * b.c[0],
                a.c[0] * b.c[2] + a.c[1] * b.c[1] + a.c[2] * b.c[0]);
}

static series scaled(long double s, series a) { return make(s * a.c[0], s * a.c[1], s * a.c[2]); }

/* f(x(t)) from f, f' and f'' at x(0) */
static series chain(series x, long double f, long double d, long double dd) {
    return make(f, d * x.c[1], d * x.c[2] + dd * x.c[1] * x.c[1] / 2);
}

typedef struct frame {
    series r[3][3], p[3];
} frame;

static const frame at_rest = {.r = {{{{1}}, {{0}}, {{0}}}, {{{0}}, {{1}}, {{0}}}, {{{0}}, {{0}}, {{1}}}}};

static frame compose(const frame *a, const frame *b) {
    frame c;
    for (int i = 0; i < 3; i++) {
        c.p[i] = a->p[i];
        for (int j = 0; j < 3; j++) {
            c.p[i] = plus(c.p[i], times(a->r[i][j], b->p[j]));
            c.r[i][j] = make(0, 0, 0);
            for (int k = 0; k < 3; k++)
                c.r[i][j] = plus(c.r[i][j], times(a->r[i][k], b->r[k][j]));
        }
    }
    return c;
}

/* ---- joints -------------------------------------------------------------------------------------------------- */

typedef struct unit {
    long double n[3];
} unit;

static unit unit_of(kt_vec3 axis) {
    const long double x = axis.x, y = axis.y, z = axis.z, length = sqrtl(x * x + y * y + z * z);
    return (unit){{x / length, y / length, z / length}};
}

static void cross_matrix(const long double n[3], long double m[3][3]) {
    const long double skew[3][3] = {{0, -n[2], n[1]}, {n[2], 0, -n[0]}, {-n[1], n[0], 0}};
    memcpy(m, skew, sizeof skew);
}

/* `1 + sin [n] + (1 - cos) [n]^2` */
static frame turn(unit axis, series angle) {
    const long double x = angle.c[0];
    const series s = chain(angle, sinl(x), cosl(x), -sinl(x)), c = chain(angle, 1 - cosl(x), sinl(x), cosl(x));
    long double m[3][3];
    frame out = at_rest;
    cross_matrix(axis.n, m);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            long double square = 0;
            for (int k = 0; k < 3; k++)
                square += m[i][k] * m[k][j];
            out.r[i][j] = plus(out.r[i][j], plus(scaled(m[i][j], s), scaled(square, c)));
        }
    return out;
}

static frame slide(unit axis, series length) {
    frame out = at_rest;
    for (int i = 0; i < 3; i++)
        out.p[i] = scaled(axis.n[i], length);
    return out;
}

/* R(q) exp([w t + w' t^2 / 2]) */
static frame ball(const double *q, const double *w, const double *dw) {
    const long double n2 =
        (long double)q[0] * q[0] + (long double)q[1] * q[1] + (long double)q[2] * q[2] + (long double)q[3] * q[3];
    const long double v[3] = {q[1], q[2], q[3]}, omega[3] = {w[0], w[1], w[2]}, domega[3] = {dw[0], dw[1], dw[2]};
    long double m[3][3], one[3][3], two[3][3];
    frame rest = at_rest, move = at_rest;
    cross_matrix(v, m);
    cross_matrix(omega, one);
    cross_matrix(domega, two);
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++) {
            long double square = 0, w2 = 0;
            for (int k = 0; k < 3; k++) {
                square += m[i][k] * m[k][j];
                w2 += one[i][k] * one[k][j];
            }
            rest.r[i][j].c[0] += 2 * (q[0] * m[i][j] + square) / n2;
            move.r[i][j].c[1] = one[i][j];
            move.r[i][j].c[2] = (two[i][j] + w2) / 2;
        }
    return compose(&rest, &move);
}

/* The axis that follows; by name for the coordinate axes. */
static unit second_axis(const kt_joint *joint) {
    const kt_vec3 n = joint->axis, m = joint->axis2;
    if (m.x != 0.0 || m.y != 0.0 || m.z != 0.0)
        return unit_of(m);
    if (n.x == 0.0 && n.y == 0.0 && n.z > 0.0)
        return (unit){{1, 0, 0}};
    if (n.y == 0.0 && n.z == 0.0 && n.x > 0.0)
        return (unit){{0, 1, 0}};
    if (n.z == 0.0 && n.x == 0.0 && n.y > 0.0)
        return (unit){{0, 0, 1}};
    return unit_of(kt_triad_from_axis(kt_vec3_normalize(n), 2).x);
}

/* Rotation of a joint frame as the description has it. */
static frame rest_of(const kt_joint *joint) {
    kt_mat3 r = kt_mat3_identity();
    kt_error error;
    frame out = at_rest;
    if (kt_rotation_evaluate(&joint->rotation, &r, &error) != KT_OK)
        abort();
    const kt_vec3 columns[3] = {r.x, r.y, r.z};
    for (int j = 0; j < 3; j++) {
        out.r[0][j] = make(columns[j].x, 0, 0);
        out.r[1][j] = make(columns[j].y, 0, 0);
        out.r[2][j] = make(columns[j].z, 0, 0);
    }
    out.p[0].c[0] = joint->at.x;
    out.p[1].c[0] = joint->at.y;
    out.p[2].c[0] = joint->at.z;
    return out;
}

static frame motion_of(const kt_joint *joint, const double *q, const double *v, const double *a) {
    series x[KT_JOINT_NQ_MAX];
    const unit n = unit_of(joint->axis);
    frame first, second;
    const int plain = joint->type == KT_JOINT_SPHERICAL || joint->type == KT_JOINT_FREE ? 3 : KT_JOINT_NV_MAX;
    for (int i = 0; i < plain; i++)
        x[i] = make(q[i], v[i], a[i] / 2.0L);
    switch (joint->type) {
    case KT_JOINT_REVOLUTE:
        return turn(n, x[0]);
    case KT_JOINT_PRISMATIC:
        return slide(n, x[0]);
    case KT_JOINT_SCREW:
        first = turn(n, x[0]);
        second = slide(n, scaled(joint->pitch, x[0]));
        return compose(&first, &second);
    case KT_JOINT_CYLINDRICAL:
        first = turn(n, x[0]);
        second = slide(n, x[1]);
        return compose(&first, &second);
    case KT_JOINT_UNIVERSAL:
        first = turn(n, x[0]);
        second = turn(second_axis(joint), x[1]);
        return compose(&first, &second);
    case KT_JOINT_PLANAR: {
        const kt_mat3 triad = kt_triad_from_axis(kt_vec3_normalize(joint->axis), 2);
        const frame along_x = slide(unit_of(triad.x), x[0]), along_y = slide(unit_of(triad.y), x[1]);
        first = compose(&along_x, &along_y);
        second = turn(n, x[2]);
        return compose(&first, &second);
    }
    case KT_JOINT_SPHERICAL:
        return ball(q, v, a);
    case KT_JOINT_FREE:
        first = at_rest;
        for (int i = 0; i < 3; i++)
            first.p[i] = x[i];
        second = ball(q + 3, v + 3, a + 3);
        return compose(&first, &second);
    case KT_JOINT_FIXED:
    case KT_JOINT_TYPE_COUNT:
        break;
    }
    return at_rest;
}

/* ---- motion of the bodies ------------------------------------------------------------------------------------ */

static const kt_body *described(const kt_tree *tree, int body) {
    return &tree->description.bodies[kt_body_source(tree->model, body)];
}

/* Vector of the skew part of A B' */
static void axial(long double a[3][3], long double b[3][3], long double out[3]) {
    long double m[3][3] = {{0}};
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            for (int k = 0; k < 3; k++)
                m[i][j] += a[i][k] * b[j][k];
    out[0] = (m[2][1] - m[1][2]) / 2;
    out[1] = (m[0][2] - m[2][0]) / 2;
    out[2] = (m[1][0] - m[0][1]) / 2;
}

static void rates(const frame *f, kt_oracle_body *out) {
    long double d[3][3], dd[3][3];
    for (int i = 0; i < 3; i++) {
        out->p[i] = f->p[i].c[0];
        out->u[i] = f->p[i].c[1];
        out->a[i] = 2 * f->p[i].c[2];
        for (int j = 0; j < 3; j++) {
            out->r[i][j] = f->r[i][j].c[0];
            d[i][j] = f->r[i][j].c[1];
            dd[i][j] = 2 * f->r[i][j].c[2];
        }
    }
    axial(d, out->r, out->w);
    axial(dd, out->r, out->alpha);
}

void kt_oracle_motion(const kt_tree *tree, const double *q, const double *v, const double *a, kt_oracle_body *bodies) {
    static const double none[KT_TREE_NV];
    frame frames[KT_TREE_SLOTS];
    frames[0] = at_rest;
    rates(&frames[0], &bodies[0]);
    for (int b = 1; b < tree->count; b++) {
        const kt_coordinates c = kt_body_coordinates(tree->model, b);
        const kt_joint *joint = &described(tree, b)->joint;
        const double *vb = (v ? v : none) + c.v, *ab = (a ? a : none) + c.v;
        double x[KT_JOINT_NQ_MAX] = {0}, y[KT_JOINT_NV_MAX] = {0}, z[KT_JOINT_NV_MAX] = {0};
        memcpy(x, q + c.q, (size_t)c.nq * sizeof *x);
        memcpy(y, vb, (size_t)c.nv * sizeof *y);
        memcpy(z, ab, (size_t)c.nv * sizeof *z);
        const frame rest = rest_of(joint), motion = motion_of(joint, x, y, z);
        const frame in_parent = compose(&rest, &motion);
        frames[b] = compose(&frames[kt_body_parent(tree->model, b)], &in_parent);
        rates(&frames[b], &bodies[b]);
    }
}

bool kt_oracle_moves(const kt_tree *tree, int body) {
    for (; body > 0; body = kt_body_parent(tree->model, body))
        if (kt_body_coordinates(tree->model, body).nv > 0)
            return true;
    return false;
}
