/* The oracle of quadruple.h: kinematics by joints, the rows of joints and loops. Each body holds the results of
 * its joint: pose, velocity, and the acceleration without joint accelerations. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "quadruple.h"

#include <quadmath.h>
#include <string.h>

/* ---- vectors ----------------------------------------------------------------------------------------------------- */

static void cross(const quad a[3], const quad b[3], quad out[3]) {
    const quad x = a[1] * b[2] - a[2] * b[1], y = a[2] * b[0] - a[0] * b[2], z = a[0] * b[1] - a[1] * b[0];
    out[0] = x, out[1] = y, out[2] = z;
}

static quad dot(const quad a[3], const quad b[3]) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

static void apply(quad R[3][3], const quad x[3], quad out[3]) {
    const quad y[3] = {x[0], x[1], x[2]};
    for (int i = 0; i < 3; i++)
        out[i] = R[i][0] * y[0] + R[i][1] * y[1] + R[i][2] * y[2];
}

static void multiply(quad A[3][3], quad B[3][3], quad out[3][3]) {
    quad C[3][3];
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            C[i][j] = A[i][0] * B[0][j] + A[i][1] * B[1][j] + A[i][2] * B[2][j];
    memcpy(out, C, sizeof C);
}

static void turn(int axis, quad angle, quad R[3][3]) {
    const int j = (axis + 1) % 3, k = (axis + 2) % 3;
    const quad c = cosq(angle), s = sinq(angle);
    memset(R, 0, 9 * sizeof(quad));
    R[axis][axis] = 1;
    R[j][j] = c, R[k][k] = c, R[j][k] = -s, R[k][j] = s;
}

static void of_quaternion(const quad *q, quad R[3][3]) {
    const quad n = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    const quad w = q[0], x = q[1], y = q[2], z = q[3];
    R[0][0] = 1 - 2 * (y * y + z * z) / n, R[0][1] = 2 * (x * y - w * z) / n, R[0][2] = 2 * (x * z + w * y) / n;
    R[1][0] = 2 * (x * y + w * z) / n, R[1][1] = 1 - 2 * (x * x + z * z) / n, R[1][2] = 2 * (y * z - w * x) / n;
    R[2][0] = 2 * (x * z - w * y) / n, R[2][1] = 2 * (y * z + w * x) / n, R[2][2] = 1 - 2 * (x * x + y * y) / n;
}

/* ---- coordinates ------------------------------------------------------------------------------------------------- */

static int size_of(kt_joint_type type) {
    return type == KT_JOINT_SPHERICAL ? 3 : type == KT_JOINT_UNIVERSAL || type == KT_JOINT_CYLINDRICAL ? 2 : 1;
}

static int rows_of(const quad_mechanism *m, const quad_loop *l) {
    switch (l->type) {
    case KT_LOOP_SPHERICAL:
        return m->planar ? 2 : 3;
    case KT_LOOP_REVOLUTE:
        return m->planar ? 2 : 5;
    case KT_LOOP_INLINE:
        return 2;
    default:
        return 1;
    }
}

void quad_count(quad_mechanism *m) {
    m->nq = m->nv = m->rows = 0;
    for (int i = 0; i < m->bodies; i++) {
        m->at_q[i] = m->nq, m->at_v[i] = m->nv;
        m->nq += m->joint[i].type == KT_JOINT_SPHERICAL ? 4 : size_of(m->joint[i].type);
        m->nv += size_of(m->joint[i].type);
    }
    for (int k = 0; k < m->loops; k++)
        m->rows += rows_of(m, &m->loop[k]);
}

void quad_add(const quad_mechanism *m, const quad *q, const quad *step, quad *out) {
    for (int i = 0; i < m->bodies; i++) {
        const quad *p = q + m->at_q[i], *d = step + m->at_v[i];
        quad *o = out + m->at_q[i];
        if (m->joint[i].type == KT_JOINT_SPHERICAL) { /* q exp(d / 2) */
            const quad angle = quad_norm(3, d), c = cosq(angle / 2);
            const quad s = angle > 1e-20Q ? sinq(angle / 2) / angle : 0.5Q;
            const quad e[4] = {c, s * d[0], s * d[1], s * d[2]};
            const quad w = p[0] * e[0] - p[1] * e[1] - p[2] * e[2] - p[3] * e[3];
            const quad x = p[0] * e[1] + e[0] * p[1] + p[2] * e[3] - p[3] * e[2];
            const quad y = p[0] * e[2] + e[0] * p[2] + p[3] * e[1] - p[1] * e[3];
            const quad z = p[0] * e[3] + e[0] * p[3] + p[1] * e[2] - p[2] * e[1];
            const quad n = sqrtq(w * w + x * x + y * y + z * z);
            o[0] = w / n, o[1] = x / n, o[2] = y / n, o[3] = z / n;
        } else {
            for (int k = 0; k < size_of(m->joint[i].type); k++)
                o[k] = p[k] + d[k];
        }
    }
}

/* ---- kinematics -------------------------------------------------------------------------------------------------- */

typedef struct body {
    quad R[3][3], r[3], w[3], v[3]; /* pose, angular velocity, velocity of the origin */
    quad alpha[3], a[3];            /* accelerations at zero joint accelerations */
    quad axis[3][3];                /* axes of the joint's motions, world */
    quad e[3];                      /* from the parent's origin to its own */
} body;

static const body ground = {.R = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};

static void unit(int axis, quad out[3]) { out[0] = axis == 0, out[1] = axis == 1, out[2] = axis == 2; }

static void place(const quad_mechanism *m, const quad *q, body *b) {
    for (int i = 0; i < m->bodies; i++) {
        const quad_joint *j = &m->joint[i];
        const quad *p = q + m->at_q[i], at[3] = {j->at[0], j->at[1], j->at[2]};
        body parent = j->parent < 0 ? ground : b[j->parent], *o = &b[i];
        quad Q[3][3], n[3];
        *o = ground;
        unit(j->axis, n);
        apply(parent.R, at, o->e);
        apply(parent.R, n, o->axis[0]);
        if (j->type == KT_JOINT_SPHERICAL) {
            of_quaternion(p, Q);
        } else if (j->type == KT_JOINT_PRISMATIC) {
            turn(j->axis, 0, Q);
            for (int k = 0; k < 3; k++)
                o->e[k] += p[0] * o->axis[0][k];
        } else {
            turn(j->axis, p[0], Q);
        }
        if (j->type == KT_JOINT_CYLINDRICAL)
            for (int k = 0; k < 3; k++)
                o->e[k] += p[1] * o->axis[0][k];
        multiply(parent.R, Q, o->R);
        if (j->type == KT_JOINT_UNIVERSAL) {
            unit(j->axis2, n);
            apply(o->R, n, o->axis[1]);
            turn(j->axis2, p[1], Q);
            multiply(o->R, Q, o->R);
        }
        if (j->type == KT_JOINT_SPHERICAL)
            for (int k = 0; k < 3; k++)
                for (int c = 0; c < 3; c++)
                    o->axis[c][k] = o->R[k][c];
        for (int k = 0; k < 3; k++)
            o->r[k] = parent.r[k] + o->e[k];
    }
}

/* Velocities, and accelerations without joint accelerations. */
static void move(const quad_mechanism *m, const quad *u, body *b) {
    for (int i = 0; i < m->bodies; i++) {
        const quad_joint *j = &m->joint[i];
        const body parent = j->parent < 0 ? ground : b[j->parent];
        const quad *x = u + m->at_v[i];
        body *o = &b[i];
        quad w[3] = {0, 0, 0}, slide[3] = {0, 0, 0}, bend[3] = {0, 0, 0}, t[3], s[3];
        const int turns = j->type == KT_JOINT_PRISMATIC ? 0 : j->type == KT_JOINT_CYLINDRICAL ? 1 : size_of(j->type);
        for (int c = 0; c < turns; c++) {
            quad one[3];
            for (int k = 0; k < 3; k++)
                one[k] = x[c] * o->axis[c][k];
            /* d/dt of the axis: the parent and the turns before carry it. The body itself carries the axes of a ball.
             * The sum of w x (w_c) over its three axes is then that of the parent's motion alone. */
            for (int k = 0; k < 3; k++)
                t[k] = parent.w[k] + (j->type == KT_JOINT_SPHERICAL ? 0 : w[k]);
            cross(t, one, s);
            for (int k = 0; k < 3; k++)
                bend[k] += s[k], w[k] += one[k];
        }
        if (j->type == KT_JOINT_PRISMATIC || j->type == KT_JOINT_CYLINDRICAL)
            for (int k = 0; k < 3; k++)
                slide[k] = x[j->type == KT_JOINT_CYLINDRICAL] * o->axis[0][k];
        cross(parent.w, o->e, t);
        for (int k = 0; k < 3; k++) {
            o->w[k] = parent.w[k] + w[k];
            o->v[k] = parent.v[k] + t[k] + slide[k];
            o->alpha[k] = parent.alpha[k] + bend[k];
        }
        cross(parent.w, t, s);
        cross(parent.w, slide, t);
        for (int k = 0; k < 3; k++)
            o->a[k] = parent.a[k] + s[k] + 2 * t[k];
        cross(parent.alpha, o->e, t);
        for (int k = 0; k < 3; k++)
            o->a[k] += t[k];
    }
}

static const body *at_body(const body *b, int i) { return i < 0 ? &ground : &b[i]; }

/* An end: the arm from its body's origin, the point, its velocity, and its acceleration without joint accelerations. */
typedef struct point {
    quad arm[3], r[3], v[3], a[3];
} point;

static point end_of(const quad_loop *l, int side, const body *bodies) {
    const body *b = at_body(bodies, side ? l->second : l->first);
    const quad at[3] = {l->at[side][0], l->at[side][1], l->at[side][2]};
    point p;
    quad R[3][3], t[3], s[3];
    memcpy(R, b->R, sizeof R);
    apply(R, at, p.arm);
    cross(b->w, p.arm, t);
    cross(b->w, t, s);
    for (int k = 0; k < 3; k++) {
        p.r[k] = b->r[k] + p.arm[k];
        p.v[k] = b->v[k] + t[k];
        p.a[k] = b->a[k] + s[k];
    }
    cross(b->alpha, p.arm, t);
    for (int k = 0; k < 3; k++)
        p.a[k] += t[k];
    return p;
}

/* phi, phi' and phi'' without joint accelerations. */
static void equations(const quad_mechanism *m, const body *b, quad *phi, quad *rate, quad *bias) {
    int row = 0;
    for (int i = 0; i < m->loops; i++) {
        const quad_loop *l = &m->loop[i];
        const point p = end_of(l, 0, b), o = end_of(l, 1, b);
        quad d[3], v[3], a[3];
        for (int k = 0; k < 3; k++)
            d[k] = o.r[k] - p.r[k], v[k] = o.v[k] - p.v[k], a[k] = o.a[k] - p.a[k];
        if (l->type == KT_LOOP_DISTANCE) {
            phi[row] = (dot(d, d) - l->length * l->length) / 2;
            rate[row] = dot(d, v);
            bias[row++] = dot(d, a) + dot(v, v);
            continue;
        }
        const int points = m->planar || l->type == KT_LOOP_INLINE ? 2 : 3;
        for (int k = 0; k < points; k++, row++)
            phi[row] = d[k], rate[row] = v[k], bias[row] = a[k];
        if (l->type == KT_LOOP_REVOLUTE && !m->planar) {
            const body *s = at_body(b, l->second);
            const quad n[3] = {s->R[0][2], s->R[1][2], s->R[2][2]};
            quad t[3], tt[3], aa[3];
            cross(s->w, n, t);
            cross(s->w, t, tt);
            cross(s->alpha, n, aa);
            for (int k = 0; k < 2; k++, row++)
                phi[row] = n[k], rate[row] = t[k], bias[row] = tt[k] + aa[k];
        }
    }
}

void quad_residual(const quad_mechanism *m, const quad *q, quad *phi) {
    body b[QUAD_BODIES];
    quad unused[2][QUAD_ROWS];
    place(m, q, b);
    equations(m, b, phi, unused[0], unused[1]);
}

void quad_jacobian(const quad_mechanism *m, const quad *q, quad A[QUAD_ROWS][QUAD_NV]) {
    body b[QUAD_BODIES];
    quad u[QUAD_NV] = {0}, phi[QUAD_ROWS], rate[QUAD_ROWS], bias[QUAD_ROWS];
    place(m, q, b);
    for (int j = 0; j < m->nv; j++) {
        u[j] = 1;
        move(m, u, b);
        equations(m, b, phi, rate, bias);
        for (int i = 0; i < m->rows; i++)
            A[i][j] = rate[i];
        u[j] = 0;
    }
}

void quad_bias(const quad_mechanism *m, const quad *q, const quad *u, quad *bias) {
    body b[QUAD_BODIES];
    quad phi[QUAD_ROWS], rate[QUAD_ROWS];
    place(m, q, b);
    move(m, u, b);
    equations(m, b, phi, rate, bias);
}

void quad_point(const quad_mechanism *m, const quad *q, int i, const quad at[3], quad out[3]) {
    body b[QUAD_BODIES];
    place(m, q, b);
    quad R[3][3], t[3];
    memcpy(R, at_body(b, i)->R, sizeof R);
    apply(R, at, t);
    for (int k = 0; k < 3; k++)
        out[k] = at_body(b, i)->r[k] + t[k];
}

void quad_in_body(const quad_mechanism *m, const quad *q, int i, const quad p[3], quad out[3]) {
    body b[QUAD_BODIES];
    place(m, q, b);
    const body *o = at_body(b, i);
    quad d[3];
    for (int k = 0; k < 3; k++)
        d[k] = p[k] - o->r[k];
    for (int k = 0; k < 3; k++)
        out[k] = o->R[0][k] * d[0] + o->R[1][k] * d[1] + o->R[2][k] * d[2];
}

/* ---- states ------------------------------------------------------------------------------------------------------ */

bool quad_close(const quad_mechanism *m, quad *q) {
    for (int k = 0; k < 60; k++) {
        quad phi[QUAD_ROWS], A[QUAD_ROWS][QUAD_NV], step[QUAD_NV];
        quad_residual(m, q, phi);
        const quad open = quad_norm(m->rows, phi);
        if (open < 1e-31Q)
            return true;
        quad_jacobian(m, q, A);
        if (!(open < 10) || !quad_least(m->rows, m->nv, &A[0][0], QUAD_NV, phi, step))
            return false;
        for (int i = 0; i < m->nv; i++)
            step[i] = -step[i];
        quad_add(m, q, step, q);
        if (quad_norm(m->nv, step) < 1e-31Q)
            return open < 1e-29Q;
    }
    return false;
}

bool quad_close_velocity(const quad_mechanism *m, const quad *q, quad *u) {
    quad A[QUAD_ROWS][QUAD_NV], rate[QUAD_ROWS], step[QUAD_NV];
    quad_jacobian(m, q, A);
    for (int k = 0; k < 3; k++) {
        for (int i = 0; i < m->rows; i++) {
            rate[i] = 0;
            for (int j = 0; j < m->nv; j++)
                rate[i] += A[i][j] * u[j];
        }
        if (!quad_least(m->rows, m->nv, &A[0][0], QUAD_NV, rate, step))
            return false;
        for (int j = 0; j < m->nv; j++)
            u[j] -= step[j];
    }
    return true;
}

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

typedef struct system {
    int n;
    quad K[QUAD_UNKNOWNS][QUAD_UNKNOWNS], x[QUAD_UNKNOWNS];
} system_of_equations;

/* One row: coefficients of alpha and a of a body are added. */
static void put(system_of_equations *s, int row, int i, const quad angular[3], const quad linear[3], quad sign) {
    for (int k = 0; i >= 0 && k < 3; k++) {
        if (angular)
            s->K[row][6 * i + k] += sign * angular[k];
        if (linear)
            s->K[row][6 * i + 3 + k] += sign * linear[k];
    }
}

/* The row n . (acceleration of a point of body i, at the arm) */
static void put_point(system_of_equations *s, int row, int i, const quad arm[3], const quad n[3], quad sign) {
    quad t[3];
    cross(arm, n, t); /* n . (alpha x arm) = alpha . (arm x n) */
    put(s, row, i, t, n, sign);
}

static void across(const quad n[3], quad t1[3], quad t2[3]) {
    int k = fabsq(n[0]) < fabsq(n[1]) ? 0 : 1;
    if (fabsq(n[2]) < fabsq(n[k]))
        k = 2;
    quad e[3];
    unit(k, e);
    cross(n, e, t1);
    const quad l = quad_norm(3, t1);
    for (int i = 0; i < 3; i++)
        t1[i] /= l;
    cross(n, t1, t2);
}

static void put_masses(const quad_mechanism *m, const body *b, const quad *tau, system_of_equations *s) {
    for (int i = 0; i < m->bodies; i++) {
        const quad mass = m->mass[i], c0[3] = {m->com[i][0], m->com[i][1], m->com[i][2]};
        const double *in = m->inertia[i];
        quad I[3][3] = {{in[0], in[3], in[4]}, {in[3], in[1], in[5]}, {in[4], in[5], in[2]}};
        quad R[3][3], T[3][3], c[3], t[3], h[3], force[3], moment[3];
        memcpy(R, b[i].R, sizeof R);
        for (int r = 0; r < 3; r++)
            for (int k = 0; k < 3; k++)
                T[r][k] = R[k][r];
        multiply(R, I, I);
        multiply(I, T, I);
        apply(R, c0, c);
        /* about the origin: I - m [c][c]; m c x a; m (a + alpha x c) */
        for (int r = 0; r < 3; r++)
            for (int k = 0; k < 3; k++) {
                const quad shift = mass * ((r == k ? dot(c, c) : 0) - c[r] * c[k]);
                s->K[6 * i + r][6 * i + k] = I[r][k] + shift;
                s->K[6 * i + 3 + r][6 * i + 3 + k] = r == k ? mass : 0;
            }
        const quad C[3][3] = {{0, -c[2], c[1]}, {c[2], 0, -c[0]}, {-c[1], c[0], 0}};
        for (int r = 0; r < 3; r++)
            for (int k = 0; k < 3; k++) {
                s->K[6 * i + r][6 * i + 3 + k] = mass * C[r][k];
                s->K[6 * i + 3 + r][6 * i + k] = -mass * C[r][k];
            }
        cross(b[i].w, c, t);
        cross(b[i].w, t, force); /* m w x (w x c) */
        for (int k = 0; k < 3; k++)
            force[k] = mass * (m->gravity[k] - force[k]);
        quad J[3][3];
        for (int r = 0; r < 3; r++)
            for (int k = 0; k < 3; k++)
                J[r][k] = s->K[6 * i + r][6 * i + k];
        apply(J, b[i].w, h);
        cross(b[i].w, h, t);
        const quad g[3] = {mass * m->gravity[0], mass * m->gravity[1], mass * m->gravity[2]};
        cross(c, g, moment);
        for (int k = 0; k < 3; k++) {
            s->x[6 * i + k] += moment[k] - t[k];
            s->x[6 * i + 3 + k] += force[k];
        }
        /* joint forces: torques about the axes, forces along them, on the body and back on its parent */
        const quad_joint *j = &m->joint[i];
        const quad *f = tau + m->at_v[i];
        for (int c1 = 0; c1 < size_of(j->type); c1++) {
            const bool slides = j->type == KT_JOINT_PRISMATIC || (j->type == KT_JOINT_CYLINDRICAL && c1 == 1);
            const quad *n = b[i].axis[slides ? 0 : c1];
            quad arm[3];
            cross(b[i].e, n, arm);
            for (int k = 0; k < 3; k++) {
                s->x[6 * i + (slides ? 3 : 0) + k] += f[c1] * n[k];
                if (j->parent >= 0) {
                    s->x[6 * j->parent + (slides ? 3 : 0) + k] -= f[c1] * n[k];
                    if (slides)
                        s->x[6 * j->parent + k] -= f[c1] * arm[k];
                }
            }
        }
    }
}

/* Rows of the joint of body i, from `row` on; returns the next. */
static int put_joint(const quad_mechanism *m, const body *bodies, int i, int row, system_of_equations *s) {
    const quad_joint *j = &m->joint[i];
    const body *b = &bodies[i], *p = at_body(bodies, j->parent);
    quad relative[3], t[3], tt[3], slip[3], own[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}, t1[3], t2[3];
    const quad none[3] = {0, 0, 0};
    for (int k = 0; k < 3; k++)
        relative[k] = b->w[k] - p->w[k];
    across(b->axis[0], t1, t2);
    /* points: a_i - a_p - alpha_p x e = w_p x (w_p x e) + 2 w_p x (relative velocity), along the locked axes */
    cross(p->w, b->e, t);
    for (int k = 0; k < 3; k++)
        slip[k] = b->v[k] - p->v[k] - t[k];
    cross(p->w, t, tt);
    cross(p->w, slip, t);
    for (int k = 0; k < 3; k++)
        tt[k] += 2 * t[k];
    const bool slides = j->type == KT_JOINT_PRISMATIC || j->type == KT_JOINT_CYLINDRICAL;
    for (int k = 0; k < (slides ? 2 : 3); k++, row++) {
        const quad *n = !slides ? own[k] : k == 0 ? t1 : t2;
        put_point(s, row, i, none, n, 1);
        put_point(s, row, j->parent, b->e, n, -1);
        s->x[row] = dot(n, tt);
    }
    /* turns */
    if (j->type == KT_JOINT_PRISMATIC) {
        for (int k = 0; k < 3; k++, row++) {
            put(s, row, i, own[k], NULL, 1);
            put(s, row, j->parent, own[k], NULL, -1);
        }
    } else if (j->type == KT_JOINT_REVOLUTE || j->type == KT_JOINT_CYLINDRICAL) {
        for (int k = 0; k < 2; k++, row++) { /* n' = w_p x n */
            const quad *n = k == 0 ? t1 : t2;
            cross(p->w, n, t);
            put(s, row, i, n, NULL, 1);
            put(s, row, j->parent, n, NULL, -1);
            s->x[row] = -dot(t, relative);
        }
    } else if (j->type == KT_JOINT_UNIVERSAL) {
        quad n[3], d1[3], d2[3], w1[3];
        const quad rate = dot(b->axis[0], relative);
        cross(b->axis[0], b->axis[1], n);
        cross(p->w, b->axis[0], d1);
        for (int k = 0; k < 3; k++)
            w1[k] = p->w[k] + rate * b->axis[0][k];
        cross(w1, b->axis[1], d2);
        cross(d1, b->axis[1], t);
        cross(b->axis[0], d2, tt);
        for (int k = 0; k < 3; k++)
            t[k] += tt[k];
        put(s, row, i, n, NULL, 1);
        put(s, row, j->parent, n, NULL, -1);
        s->x[row++] = -dot(t, relative);
    }
    return row;
}

static int put_loops(const quad_mechanism *m, const body *b, int row, system_of_equations *s) {
    const quad own[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
    for (int i = 0; i < m->loops; i++) {
        const quad_loop *l = &m->loop[i];
        const point p = end_of(l, 0, b), o = end_of(l, 1, b);
        const body *pb = at_body(b, l->first), *ob = at_body(b, l->second);
        quad t[3], cp[3], co[3], d[3], v[3];
        cross(pb->w, p.arm, t);
        cross(pb->w, t, cp);
        cross(ob->w, o.arm, t);
        cross(ob->w, t, co);
        for (int k = 0; k < 3; k++)
            d[k] = o.r[k] - p.r[k], v[k] = o.v[k] - p.v[k];
        const bool distance = l->type == KT_LOOP_DISTANCE;
        const int points = distance ? 1 : m->planar || l->type == KT_LOOP_INLINE ? 2 : 3;
        for (int k = 0; k < points; k++, row++) {
            const quad *n = distance ? d : own[k];
            put_point(s, row, l->second, o.arm, n, 1);
            put_point(s, row, l->first, p.arm, n, -1);
            s->x[row] = dot(n, cp) - dot(n, co) - (distance ? dot(v, v) : 0);
        }
        if (l->type == KT_LOOP_REVOLUTE && !m->planar) {
            const quad n[3] = {ob->R[0][2], ob->R[1][2], ob->R[2][2]};
            quad tt[3];
            cross(ob->w, n, t);
            cross(ob->w, t, tt);
            for (int k = 0; k < 2; k++, row++) { /* e . (alpha x n) = alpha . (n x e) */
                cross(n, own[k], t);
                put(s, row, l->second, t, NULL, 1);
                s->x[row] = -tt[k];
            }
        }
    }
    return row;
}

bool quad_accelerate(const quad_mechanism *m, const quad *q, const quad *u, quad *a) {
    static system_of_equations s;
    body b[QUAD_BODIES];
    quad tau[QUAD_NV], t[3], tt[3];
    memset(&s, 0, sizeof s);
    for (int i = 0; i < m->nv; i++)
        tau[i] = m->tau[i];
    place(m, q, b);
    move(m, u, b);
    put_masses(m, b, tau, &s);
    int row = 6 * m->bodies;
    for (int i = 0; i < m->bodies; i++)
        row = put_joint(m, b, i, row, &s);
    s.n = put_loops(m, b, row, &s);
    for (int i = 6 * m->bodies; i < s.n; i++)
        for (int k = 0; k < 6 * m->bodies; k++)
            s.K[k][i] = s.K[i][k];
    if (!quad_eliminate(s.n, &s.K[0][0], QUAD_UNKNOWNS, s.x))
        return false;
    for (int i = 0; i < m->bodies; i++) {
        const quad_joint *j = &m->joint[i];
        const body *o = &b[i], *p = at_body(b, j->parent);
        const quad zero[6] = {0}, *x = &s.x[6 * i], *y = j->parent < 0 ? zero : &s.x[6 * j->parent];
        quad w[3], alpha[3], *out = a + m->at_v[i];
        for (int k = 0; k < 3; k++)
            w[k] = o->w[k] - p->w[k], alpha[k] = x[k] - y[k];
        const bool slides = j->type == KT_JOINT_PRISMATIC || j->type == KT_JOINT_CYLINDRICAL;
        if (slides) {
            quad slip[3], acc[3];
            cross(p->w, o->e, t);
            for (int k = 0; k < 3; k++)
                slip[k] = o->v[k] - p->v[k] - t[k];
            cross(p->w, t, tt);
            cross(y, o->e, t);
            for (int k = 0; k < 3; k++)
                acc[k] = x[3 + k] - y[3 + k] - t[k] - tt[k];
            cross(p->w, slip, t);
            for (int k = 0; k < 3; k++)
                acc[k] -= 2 * t[k];
            out[j->type == KT_JOINT_CYLINDRICAL] = dot(o->axis[0], acc);
        }
        if (j->type == KT_JOINT_REVOLUTE || j->type == KT_JOINT_CYLINDRICAL)
            out[0] = dot(o->axis[0], alpha);
        if (j->type == KT_JOINT_UNIVERSAL) {
            const quad rate = dot(o->axis[0], w);
            quad w1[3];
            cross(p->w, o->axis[0], t);
            out[0] = dot(o->axis[0], alpha) + dot(t, w);
            for (int k = 0; k < 3; k++)
                w1[k] = p->w[k] + rate * o->axis[0][k];
            cross(w1, o->axis[1], t);
            out[1] = dot(o->axis[1], alpha) + dot(t, w);
        }
        if (j->type == KT_JOINT_SPHERICAL) { /* d/dt (R' w) = R' (alpha - w_i x w) */
            cross(o->w, w, t);
            for (int c = 0; c < 3; c++)
                out[c] = dot(o->axis[c], alpha) - dot(o->axis[c], t);
        }
    }
    return true;
}
