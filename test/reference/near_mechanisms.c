/* Newton's method finds a singular position on the extended system (near_singular.c). The unknowns are the positions,
 * the loops' points and the left vector of the lost direction. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "near_mechanisms.h"
#include "describe.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* ---- mechanisms -------------------------------------------------------------------------------------------------- */

static double length_of(kt_random *r) { return kt_random_uniform(r, 0.4, 1.2); }

static void random_body(quad_mechanism *m, int i, kt_random *r) {
    double d[3];
    kt_random_direction(r, 3, d);
    m->mass[i] = kt_random_uniform(r, 0.5, 2.0);
    for (int k = 0; k < 3; k++)
        m->com[i][k] = m->planar && k == 2 ? 0.0 : 0.3 * d[k];
    const double x = kt_random_uniform(r, 0.05, 0.2), y = kt_random_uniform(r, 0.05, 0.2);
    const double inertia[6] = {x, y, x + y - 0.02, 0.01, m->planar ? 0.0 : 0.005, m->planar ? 0.0 : -0.008};
    memcpy(m->inertia[i], inertia, sizeof inertia);
}

static void random_point(const quad_mechanism *m, kt_random *r, double *at) {
    double d[3];
    const double l = length_of(r);
    if (m->planar) {
        kt_random_direction(r, 2, d);
        d[2] = 0.0;
    } else {
        kt_random_direction(r, 3, d);
    }
    for (int k = 0; k < 3; k++)
        at[k] = l * d[k];
}

static kt_joint_type random_joint(const quad_mechanism *m, kt_random *r) {
    const double x = kt_random_uniform(r, 0.0, 1.0);
    if (x < (m->planar ? 0.8 : 0.6))
        return KT_JOINT_REVOLUTE;
    if (m->planar || x < 0.7)
        return KT_JOINT_PRISMATIC;
    return x < 0.8 ? KT_JOINT_UNIVERSAL : x < 0.9 ? KT_JOINT_CYLINDRICAL : KT_JOINT_SPHERICAL;
}

/* A tree of three to six bodies with one or two loops. A loop closes from one end of a branch to the world or to
 * another branch. Returns false if no motion is left. It also returns false if there are not more coordinates than a
 * singular position needs. */
static bool random_mechanism(quad_mechanism *m, kt_random *r) {
    memset(m, 0, sizeof *m);
    m->planar = kt_random_int(r, 0, 1);
    m->loops = kt_random_int(r, 1, 2);
    m->bodies = m->loops == 1 ? kt_random_int(r, 3, 5) : kt_random_int(r, 5, 6);
    m->gravity[1] = -9.81;
    for (int i = 0; i < m->bodies; i++) {
        quad_joint *j = &m->joint[i];
        j->type = random_joint(m, r);
        j->parent = i == 0 || kt_random_int(r, 0, 3) == 0 ? -1
                    : kt_random_int(r, 0, 2)              ? i - 1
                                                          : kt_random_int(r, 0, i - 1);
        j->axis = m->planar ? j->type == KT_JOINT_PRISMATIC ? kt_random_int(r, 0, 1) : 2 : kt_random_int(r, 0, 2);
        j->axis2 = (j->axis + 1) % 3;
        random_point(m, r, j->at);
        random_body(m, i, r);
    }
    for (int k = 0; k < m->loops; k++) {
        static const kt_loop_type types[] = {KT_LOOP_SPHERICAL, KT_LOOP_REVOLUTE, KT_LOOP_INLINE, KT_LOOP_DISTANCE};
        quad_loop *l = &m->loop[k];
        l->second = k == 0 ? m->bodies - 1 : kt_random_int(r, 1, m->bodies - 2);
        l->first = kt_random_int(r, 0, 1) ? -1 : kt_random_int(r, 0, l->second - 1);
        l->type = m->planar ? KT_LOOP_REVOLUTE : types[kt_random_int(r, 0, 3)];
        if (l->type == KT_LOOP_INLINE || (l->type == KT_LOOP_REVOLUTE && !m->planar))
            l->first = -1;
        double at[3];
        random_point(m, r, at);
        for (int i = 0; i < 3; i++)
            l->at[1][i] = at[i];
    }
    quad_count(m);
    for (int i = 0; i < m->nv; i++)
        m->tau[i] = kt_random_normal(r);
    return m->nv > m->rows && m->nv <= QUAD_NV && m->nq <= QUAD_NQ && m->rows <= QUAD_ROWS;
}

/* ---- singular positions ------------------------------------------------------------------------------------------ */

/* Places the loops' first points where the second ones are; lengths likewise. In quadruple precision, they are rounded
 * to numbers that a description can hold. */
static void fit_points(quad_mechanism *m, const quad *q) {
    for (int k = 0; k < m->loops; k++) {
        quad_loop *l = &m->loop[k];
        const quad at[3] = {l->at[1][0], l->at[1][1], l->at[1][2]};
        quad p[3], x[3];
        quad_point(m, q, l->second, at, p);
        quad_in_body(m, q, l->first, p, x);
        if (l->type == KT_LOOP_DISTANCE) {
            quad s = 0;
            for (int i = 0; i < 3; i++)
                s += (x[i] - l->at[0][i]) * (x[i] - l->at[0][i]);
            l->length = quad_sqrt(s);
        } else {
            for (int i = 0; i < 3; i++)
                l->at[0][i] = x[i];
        }
    }
}

enum { EXTENDED_ROWS = QUAD_NV + 1 + 2, EXTENDED_COLUMNS = 40 };

/* A' lambda, |lambda|^2 - 1, and the directions of revolute loops in space. Points are doubles, so the solution is
 * exact up to their rounding. This rounding is no error: it sets the distance to the singular position. */
static int extended(quad_mechanism *m, const quad *q, const quad *lambda, quad *out) {
    quad A[QUAD_ROWS][QUAD_NV], phi[QUAD_ROWS];
    int n = m->nv;
    fit_points(m, q);
    quad_jacobian(m, q, A);
    for (int j = 0; j < m->nv; j++) {
        out[j] = 0;
        for (int i = 0; i < m->rows; i++)
            out[j] += A[i][j] * lambda[i];
    }
    out[n] = -1;
    for (int i = 0; i < m->rows; i++)
        out[n] += lambda[i] * lambda[i];
    n++;
    quad_residual(m, q, phi);
    int row = 0;
    for (int k = 0; k < m->loops; k++) {
        const kt_loop_type type = m->loop[k].type;
        const bool revolute = type == KT_LOOP_REVOLUTE && !m->planar;
        if (revolute) { /* the axes' other way round, which fulfils these equations as well, is rejected later */
            out[n++] = phi[row + 3];
            out[n++] = phi[row + 4];
        }
        row += revolute ? 5 : type == KT_LOOP_DISTANCE ? 1 : type == KT_LOOP_INLINE || m->planar ? 2 : 3;
    }
    return n;
}

/* Unknowns: positions, points of the loops on their second bodies, lambda. */
static int moved(const quad_mechanism *m, const quad *q, const quad *lambda, const quad *x, quad_mechanism *mm,
                 quad *qq, quad *ll) {
    int n = m->nv;
    *mm = *m;
    quad_add(m, q, x, qq);
    for (int k = 0; k < m->loops; k++)
        for (int i = 0; i < (m->planar ? 2 : 3); i++, n++)
            mm->loop[k].at[1][i] = m->loop[k].at[1][i] + x[n];
    for (int i = 0; i < m->rows; i++, n++)
        ll[i] = lambda[i] + x[n];
    return n;
}

static bool find_singular(quad_mechanism *m, quad *q, quad *lambda, kt_random *r) {
    quad x[EXTENDED_COLUMNS], f[EXTENDED_ROWS], g[EXTENDED_ROWS], A[QUAD_ROWS][QUAD_NV], least, most;
    for (int i = 0; i < m->bodies; i++)
        for (int k = m->at_q[i]; k < (i + 1 < m->bodies ? m->at_q[i + 1] : m->nq); k++)
            q[k] = m->joint[i].type == KT_JOINT_PRISMATIC ? kt_random_uniform(r, -0.5, 0.5)
                                                          : kt_random_uniform(r, -3.0, 3.0);
    memset(x, 0, sizeof x);
    quad_add(m, q, x, q);
    fit_points(m, q);
    quad_jacobian(m, q, A);
    quad_singular(m->rows, m->nv, &A[0][0], QUAD_NV, &least, &most, lambda);
    for (int k = 0; k < 40; k++) {
        quad D[EXTENDED_ROWS][EXTENDED_COLUMNS], qq[QUAD_NQ], ll[QUAD_ROWS];
        quad_mechanism mm;
        const int rows = extended(m, q, lambda, f);
        const quad open = quad_norm(rows, f);
        memset(x, 0, sizeof x);
        const int columns = moved(m, q, lambda, x, &mm, qq, ll);
        if (columns > EXTENDED_COLUMNS || rows > columns)
            return false;
        if (open < 1e-29Q)
            break;
        if (!(open < 1e3Q) || k == 39)
            return false;
        const quad step = 1e-16Q;
        for (int j = 0; j < columns; j++) {
            x[j] = step;
            (void)moved(m, q, lambda, x, &mm, qq, ll);
            (void)extended(&mm, qq, ll, g);
            for (int i = 0; i < rows; i++)
                D[i][j] = (g[i] - f[i]) / step;
            x[j] = 0;
        }
        if (!quad_least(rows, columns, &D[0][0], EXTENDED_COLUMNS, f, x))
            return false;
        const quad size = quad_norm(columns, x), most_step = 0.5Q;
        for (int j = 0; j < columns; j++)
            x[j] *= size > most_step ? -most_step / size : -1;
        (void)moved(m, q, lambda, x, &mm, qq, ll);
        *m = mm;
        memcpy(q, qq, (size_t)m->nq * sizeof *q);
        memcpy(lambda, ll, (size_t)m->rows * sizeof *lambda);
    }
    fit_points(m, q);
    quad_jacobian(m, q, A);
    quad_singular(m->rows, m->nv, &A[0][0], QUAD_NV, &least, &most, lambda);
    for (int k = 0; k < m->nq; k++)
        if (quad_abs(q[k]) > 20)
            return false;
    for (int k = 0; k < m->loops; k++)
        for (int i = 0; i < 3; i++)
            if (quad_abs(m->loop[k].at[1][i]) > 3 || quad_abs(m->loop[k].at[0][i]) > 6)
                return false;
    return least < 1e-26Q && most > 0.1Q;
}

/* Removes from x its part in the row space of A less its lost direction. */
static bool into_kernel(const quad_mechanism *m, quad A[QUAD_ROWS][QUAD_NV], const quad *lambda, quad *x) {
    /* rows orthogonal to lambda: by a Householder reflection that turns lambda into the last axis */
    quad H[QUAD_ROWS], B[QUAD_ROWS][QUAD_NV], rate[QUAD_ROWS], step[QUAD_NV], hh = 0;
    const int n = m->rows;
    memcpy(H, lambda, (size_t)n * sizeof *H);
    H[n - 1] += H[n - 1] > 0 ? quad_norm(n, lambda) : -quad_norm(n, lambda);
    for (int i = 0; i < n; i++)
        hh += H[i] * H[i];
    for (int i = 0; i < n; i++)
        for (int j = 0; j < m->nv; j++) {
            quad s = 0;
            for (int k = 0; k < n; k++)
                s += ((i == k ? 1 : 0) - 2 * H[i] * H[k] / hh) * A[k][j];
            B[i][j] = s;
        }
    for (int pass = 0; n > 1 && pass < 2; pass++) {
        for (int i = 0; i < n - 1; i++) {
            rate[i] = 0;
            for (int j = 0; j < m->nv; j++)
                rate[i] += B[i][j] * x[j];
        }
        if (!quad_least(n - 1, m->nv, &B[0][0], QUAD_NV, rate, step))
            return false;
        for (int j = 0; j < m->nv; j++)
            x[j] -= step[j];
    }
    return true;
}

static quad curvature(const quad_mechanism *m, const quad *q, const quad *lambda, const quad *w) {
    quad bias[QUAD_ROWS], s = 0;
    quad_bias(m, q, w, bias);
    for (int i = 0; i < m->rows; i++)
        s += lambda[i] * bias[i];
    return s;
}

/* A direction of a motion through the singular position. */
static bool find_direction(const quad_mechanism *m, const quad *q, const quad *lambda, kt_random *r, quad *w) {
    quad A[QUAD_ROWS][QUAD_NV];
    quad_jacobian(m, q, A);
    for (int tries = 0; tries < 20; tries++) {
        quad x[QUAD_NV], y[QUAD_NV], s[QUAD_NV];
        for (int j = 0; j < m->nv; j++)
            x[j] = kt_random_normal(r), y[j] = kt_random_normal(r);
        if (!into_kernel(m, A, lambda, x) || !into_kernel(m, A, lambda, y))
            return false;
        for (int j = 0; j < m->nv; j++)
            s[j] = x[j] + y[j];
        const quad xx = curvature(m, q, lambda, x), yy = curvature(m, q, lambda, y);
        const quad xy = (curvature(m, q, lambda, s) - xx - yy) / 2, D = xy * xy - xx * yy;
        if (!(D > 0.01Q * xy * xy) || !(quad_abs(yy) > 1e-3Q))
            continue;
        const quad t = (-xy + quad_sqrt(D)) / yy;
        for (int j = 0; j < m->nv; j++)
            w[j] = x[j] + t * y[j];
        const quad size = quad_norm(m->nv, w);
        for (int j = 0; j < m->nv; j++)
            w[j] /= size;
        return size > 0.1Q;
    }
    return false;
}

/* ---- the library's model ----------------------------------------------------------------------------------------- */

static kt_vec3 axis_at(int axis) {
    return kt_vec3_make(axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0);
}
static kt_vec3 vector_of(const double *x) { return kt_vec3_make(x[0], x[1], x[2]); }

bool near_compile(library *l, const quad_mechanism *m) {
    kt_error e = {0};
    memset(l, 0, sizeof *l);
    l->d = kt_description_default();
    l->options = kt_model_options_default();
    l->d.gravity = vector_of(m->gravity);
    kt_describe(&l->d, l->body, m->bodies, l->loop, m->loops, NULL, 0);
    for (int i = 0; i < m->bodies; i++) {
        kt_body *b = &l->body[i];
        (void)snprintf(l->name[i], sizeof l->name[i], "b%d", i);
        *b = kt_body_of(l->name[i], m->joint[i].parent < 0 ? NULL : l->name[m->joint[i].parent], m->joint[i].type,
                        m->mass[i]);
        b->joint.axis = axis_at(m->joint[i].axis);
        b->joint.axis2 = axis_at(m->joint[i].axis2);
        b->joint.at = vector_of(m->joint[i].at);
        b->com = vector_of(m->com[i]);
        const double *in = m->inertia[i];
        b->inertia = kt_sym3_make(in[0], in[1], in[2], in[3], in[4], in[5]);
    }
    for (int k = 0; k < m->loops; k++) {
        kt_loop *o = &l->loop[k];
        (void)snprintf(l->name[QUAD_BODIES + k], sizeof l->name[0], "l%d", k);
        *o = kt_loop_of(l->name[QUAD_BODIES + k], m->loop[k].type);
        for (int i = 0; i < 2; i++) {
            const int body = i ? m->loop[k].second : m->loop[k].first;
            o->between[i] = kt_end_default();
            o->between[i].body = body < 0 ? NULL : l->name[body];
            o->between[i].at =
                kt_vec3_make((double)m->loop[k].at[i][0], (double)m->loop[k].at[i][1], (double)m->loop[k].at[i][2]);
        }
        if (o->type == KT_LOOP_DISTANCE)
            o->function = kt_function_constant((double)m->loop[k].length);
    }
    const kt_status status = kt_model_compile(&l->d, &l->options, &l->model, &e);
    if (status != KT_OK || kt_data_create(l->model, &l->data, &e) != KT_OK) {
        kt_note("%s: %s", e.where, e.message);
        return false;
    }
    return true;
}

void near_discard(library *l) {
    kt_data_free(l->data);
    kt_model_free(l->model);
}

/* As a description can hold it. */
static void round_mechanism(quad_mechanism *m) {
    for (int k = 0; k < m->loops; k++) {
        quad_loop *l = &m->loop[k];
        l->length = (double)l->length;
        for (int i = 0; i < 2; i++)
            for (int j = 0; j < 3; j++)
                l->at[i][j] = (double)l->at[i][j];
    }
}

/* In space the axes of a revolute loop agree, and are not opposite. */
static bool axes_agree(const quad_mechanism *m, const quad *q) {
    for (int k = 0; k < m->loops; k++) {
        const quad_loop *l = &m->loop[k];
        const quad origin[3] = {0, 0, 0}, tip[3] = {0, 0, 1};
        quad a[3], b[3];
        quad_point(m, q, l->second, origin, a);
        quad_point(m, q, l->second, tip, b);
        if (l->type == KT_LOOP_REVOLUTE && !m->planar && !(b[2] - a[2] > 0.5Q))
            return false;
    }
    return true;
}

/* The next one of the series after s->seed. */
void near_next(singular *s) {
    for (;;) {
        char name[32];
        (void)snprintf(name, sizeof name, "near singular %d", ++s->seed);
        kt_random r = kt_random_named(name);
        if (!random_mechanism(&s->m, &r) || !find_singular(&s->m, s->q, s->lambda, &r) || !axes_agree(&s->m, s->q) ||
            !find_direction(&s->m, s->q, s->lambda, &r, s->w))
            continue;
        memset(s->off, 0, sizeof s->off);
        for (int k = 0; k < s->m.loops; k++)
            kt_random_direction(&r, s->m.planar ? 2 : 3, s->off[k]);
        return;
    }
}

int near_mechanisms(void) {
    const char *given = getenv("KT_MECHANISMS");
    return given ? atoi(given) : KT_SHORT(12, 40);
}

bool near_state_at(const singular *s, const quad_mechanism *m, double h, near_state *n) {
    quad step[QUAD_NV], A[QUAD_ROWS][QUAD_NV], least, most, left[QUAD_ROWS];
    for (int j = 0; j < m->nv; j++)
        step[j] = h * s->w[j], n->v[j] = 2 * s->w[j];
    quad_add(m, s->q, step, n->q);
    if (!quad_close(m, n->q) || !quad_close_velocity(m, n->q, n->v) || !quad_accelerate(m, n->q, n->v, n->a) ||
        !axes_agree(m, n->q))
        return false;
    for (int j = 0; j < m->nq; j++)
        n->q_of[j] = (double)n->q[j];
    n->scale = 1.0;
    for (int j = 0; j < m->nv; j++) {
        n->v_of[j] = (double)n->v[j];
        n->scale = fmax(n->scale, fabs((double)n->a[j]));
    }
    quad_jacobian(m, n->q, A);
    quad_singular(m->rows, m->nv, &A[0][0], QUAD_NV, &least, &most, left);
    n->least = (double)least;
    n->most = (double)most;
    n->speed = (double)quad_norm(m->nv, n->v);
    return true;
}

/* The mechanism with its points moved by d, and as a description can hold it. */
quad_mechanism near_off_by(const singular *s, double d) {
    quad_mechanism m = s->m;
    for (int k = 0; k < m.loops; k++)
        for (int i = 0; i < 3; i++)
            m.loop[k].at[1][i] += d * s->off[k][i];
    round_mechanism(&m);
    return m;
}
