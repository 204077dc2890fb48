/* Random mechanisms next to singular positions, against an oracle in quadruple precision (quadruple.h).
 *
 * A singular position is found by Newton's method on the extended system in positions, the loops' points and the left
 * vector of the lost direction,
 *     A(q, points)' lambda = 0,   |lambda| = 1,
 * with the points on the first bodies placed where the loops close. The motions that pass it have directions w with
 *     A w = 0,   lambda' phi_qq(w, w) = 0;
 * from there the state goes on by h along w, 1e-1 to 1e-12, is closed in quadruple precision and rounded to doubles.
 * A mechanism whose points are moved by d in addition passes at a small distance instead.
 *
 * What can be asked. The doubles are a state that is open by eps; of the exactly closed states next to it that the
 * rounding could have meant, two are at hand: that before rounding and the nearest one. Their accelerations differ by
 * some eps v^2 / s^3, with s the smallest singular value: `spread` is the larger of their difference and that. No
 * computation from the doubles alone can tell them apart; whatever is nearer counts.
 */
#include "check.h"
#include "quadruple.h"

#include "kinetree/mechanism.h"
#include "kinetree/model.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { DISTANCES = 12 };

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

/* A tree of three to six bodies with one or two loops that close from one end of a branch to the world or to another
 * branch. Returns false for what has no motion left, or not more coordinates than a singular position needs. */
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

/* Places the loops' first points where the second ones are; lengths likewise. In quadruple precision they are rounded
 * to what a description can hold. */
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

/* A' lambda, |lambda|^2 - 1, and the directions of revolute loops in space. Points are doubles: what is solved for is
 * exact up to their rounding, which makes the distance to the singular position, not an error. */
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
        if (revolute) { /* the axes' other way round, which fulfils these equations as well, is refused later */
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

typedef struct library {
    kt_description d;
    kt_model_options options;
    kt_body body[QUAD_BODIES];
    kt_loop loop[QUAD_LOOPS];
    char name[QUAD_BODIES + QUAD_LOOPS][8];
    kt_model *model;
    kt_data *data;
    int order[QUAD_BODIES]; /* where each body's coordinates are, in the order of the model */
} library;

static kt_vec3 axis_at(int axis) {
    return kt_vec3_make(axis == 0 ? 1.0 : 0.0, axis == 1 ? 1.0 : 0.0, axis == 2 ? 1.0 : 0.0);
}
static kt_vec3 vector_of(const double *x) { return kt_vec3_make(x[0], x[1], x[2]); }

static bool compile(library *l, const quad_mechanism *m) {
    kt_error e = {0};
    memset(l, 0, sizeof *l);
    l->d = kt_description_default();
    l->options = kt_model_options_default();
    l->d.gravity = vector_of(m->gravity);
    l->d.bodies = l->body;
    l->d.loops = l->loop;
    l->d.body_count = m->bodies;
    l->d.loop_count = m->loops;
    for (int i = 0; i < m->bodies; i++) {
        kt_body *b = &l->body[i];
        (void)snprintf(l->name[i], sizeof l->name[i], "b%d", i);
        *b = kt_body_default();
        b->name = l->name[i];
        b->parent = m->joint[i].parent < 0 ? NULL : l->name[m->joint[i].parent];
        b->joint.type = m->joint[i].type;
        b->joint.axis = axis_at(m->joint[i].axis);
        b->joint.axis2 = axis_at(m->joint[i].axis2);
        b->joint.at = vector_of(m->joint[i].at);
        b->mass = m->mass[i];
        b->com = vector_of(m->com[i]);
        const double *in = m->inertia[i];
        b->inertia = kt_sym3_make(in[0], in[1], in[2], in[3], in[4], in[5]);
    }
    for (int k = 0; k < m->loops; k++) {
        kt_loop *o = &l->loop[k];
        (void)snprintf(l->name[QUAD_BODIES + k], sizeof l->name[0], "l%d", k);
        *o = kt_loop_default();
        o->name = l->name[QUAD_BODIES + k];
        o->type = m->loop[k].type;
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

static void discard(library *l) {
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

/* A mechanism at a singular position q*, left vector lambda, and a direction w of a motion through it. */
typedef struct singular {
    quad_mechanism m;
    quad q[QUAD_NQ], lambda[QUAD_ROWS], w[QUAD_NV];
    double off[QUAD_LOOPS][3];
    int seed;
} singular;

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
static void next_singular(singular *s) {
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

static int mechanisms(void) {
    const char *given = getenv("KT_MECHANISMS");
    return given ? atoi(given) : 40;
}

/* The state at h from the singular position, before and after rounding. */
typedef struct near_state {
    quad q[QUAD_NQ], v[QUAD_NV], a[QUAD_NV];
    double q_of[QUAD_NQ], v_of[QUAD_NV];
    double least, most, speed, scale; /* singular values; |v|; the largest acceleration, or 1 */
} near_state;

static bool state_at(const singular *s, const quad_mechanism *m, double h, near_state *n) {
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

/* The exactly closed state nearest to the rounded one: its acceleration. */
static bool nearest_acceleration(const quad_mechanism *m, const near_state *n, quad *a) {
    quad q[QUAD_NQ], v[QUAD_NV];
    for (int j = 0; j < m->nq; j++)
        q[j] = n->q_of[j];
    for (int j = 0; j < m->nv; j++)
        v[j] = n->v_of[j];
    return quad_close(m, q) && quad_close_velocity(m, q, v) && quad_accelerate(m, q, v, a);
}

static double apart(int n, const quad *a, const double *b) {
    double most = 0.0;
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs((double)(a[i] - b[i])));
    return most;
}

/* The mechanism with its points moved by d, and as a description can hold it. */
static quad_mechanism off_by(const singular *s, double d) {
    quad_mechanism m = s->m;
    for (int k = 0; k < m.loops; k++)
        for (int i = 0; i < 3; i++)
            m.loop[k].at[1][i] += d * s->off[k][i];
    round_mechanism(&m);
    return m;
}

static bool accelerates(const library *l, const quad_mechanism *m, const near_state *n, double *a) {
    kt_error e = {0};
    const bool done = kt_acceleration_evaluate(l->model, l->data, 0.0, n->q_of, n->v_of, m->tau, NULL, a, &e) == KT_OK;
    if (!done)
        kt_note("%s", e.message);
    return done;
}

/* What no direct computation can undercut: a residual of some roundings, over s^3: the six
 * coordinates of a state, of at most pi, are rounded by half a unit each, at levers of at most 2: 19 eps. The rest, 1e-9, is that of the mechanism's own condition where nothing is near. */
static double direct_bound(const near_state *n) {
    return 1e-9 * n->scale + 20.0 * DBL_EPSILON * n->speed * n->speed / (n->least * n->least * n->least);
}

static const char *space(const quad_mechanism *m) { return m->planar ? "plane" : "space"; }

static void compare_off(const singular *s, double d, kt_worst *worst, int *told) {
    const quad_mechanism m = off_by(s, d);
    library l;
    if (kt_check_true("compiles", compile(&l, &m)))
        for (int k = 1; k <= DISTANCES; k++) {
            near_state n;
            quad nearest[QUAD_NV];
            double a[QUAD_NV];
            if (!state_at(s, &m, pow(10.0, -k), &n) || !nearest_acceleration(&m, &n, nearest))
                continue;
            double error = accelerates(&l, &m, &n, a) ? fmin(apart(m.nv, n.a, a), apart(m.nv, nearest, a)) : HUGE_VAL;
            if (!(error <= direct_bound(&n)) && (*told)++ < 40)
                kt_note("seed %d, %s, %d of %d, d = %g, h = 1e-%d, s = %.1e: |a| = %.1e, error %.1e of %.1e", s->seed,
                        space(&m), m.nv - m.rows, m.nv, d, k, n.least, n.scale, error, direct_bound(&n));
            kt_worst_below(worst, error, direct_bound(&n), "seed %d, d = %g, h = 1e-%d, s = %.1e", s->seed, d, k,
                           n.least);
        }
    discard(&l);
}

/* Motions that pass a singular position at a small distance: the acceleration is that of the motion, as accurately as a
 * residual of some roundings allows. */
KT_TEST(accelerations_of_motions_that_miss_a_singular_position) {
    static const double distances[] = {1e-12, 1e-11, 1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3};
    kt_worst worst = kt_worst_make("acceleration");
    singular s = {.seed = 0};
    int told = 0;
    for (int i = 0; i < mechanisms(); i++) {
        next_singular(&s);
        for (size_t k = 0; k < sizeof distances / sizeof *distances; k++)
            compare_off(&s, distances[k], &worst, &told);
    }
    kt_check_worst(&worst);
}

/* Motions that meet the position: with one degree of freedom two smooth branches cross there, and the acceleration is
 * that of the branch at any distance, although rounding moves the mechanism off the position. The exact mechanism's
 * points are no doubles; what it does closer than 1e-7 is, to 1e-7, what it does there. Where more freedom is left the
 * branches form a cone, about whose apex neighbouring motions bend: then it is the direct computation's accuracy that
 * can be asked. */
KT_TEST(accelerations_of_motions_that_meet_a_singular_position) {
    kt_worst worst = kt_worst_make("acceleration"), cone = kt_worst_make("acceleration at a cone");
    singular s = {.seed = 0};
    int told = 0;
    for (int i = 0; i < mechanisms(); i++) {
        next_singular(&s);
        const quad_mechanism m = off_by(&s, 0.0);
        library l;
        near_state n, last = {.least = 0.0};
        if (kt_check_true("compiles", compile(&l, &m)))
            for (int k = 1; k <= DISTANCES; k++) {
                double a[QUAD_NV];
                quad nearest[QUAD_NV];
                if (!state_at(&s, &s.m, pow(10.0, -k), &n))
                    continue;
                if (k <= 7)
                    last = n;
                double error = accelerates(&l, &m, &n, a) ? apart(m.nv, last.a, a) : HUGE_VAL;
                if (nearest_acceleration(&m, &n, nearest))
                    error = fmin(error, apart(m.nv, nearest, a));
                const bool crosses = m.nv - m.rows == 1;
                const double bound = crosses ? fmin(direct_bound(&n), 1e-6 * last.scale) : direct_bound(&n);
                if (!(error <= bound) && told++ < 40)
                    kt_note("seed %d, %s, %d of %d, h = 1e-%d, s = %.1e: |a| = %.1e, error %.1e of %.1e", s.seed,
                            space(&m), m.nv - m.rows, m.nv, k, n.least, last.scale, error, bound);
                kt_worst_below(crosses ? &worst : &cone, error, bound, "seed %d, h = 1e-%d, s = %.1e", s.seed, k,
                               n.least);
            }
        discard(&l);
    }
    kt_check_worst(&worst);
    kt_check_worst(&cone);
}

/* The null space and the equations at a rounded state: A N = 0 by the oracle's A there; and with the accelerations of the
 * exact motion A a = b''. Neither knows of 1 / s: rounding alone is allowed, of some hundred operations. */
KT_TEST(null_space_and_equations_next_to_singular_positions) {
    kt_worst null = kt_worst_make("A N"), velocity = kt_worst_make("A v"), drift = kt_worst_make("A a - b''");
    singular s = {.seed = 0};
    for (int i = 0; i < mechanisms(); i++) {
        next_singular(&s);
        const quad_mechanism m = off_by(&s, 1e-6);
        library l;
        near_state n;
        if (kt_check_true("compiles", compile(&l, &m)))
            for (int k = 1; k <= 8; k++) {
                double N[QUAD_NV * QUAD_NV], J[30 * QUAD_NV], residual[30], rate[30], bias[30];
                quad A[QUAD_ROWS][QUAD_NV], q[QUAD_NQ];
                int columns;
                kt_error e = {0};
                if (!state_at(&s, &m, pow(10.0, -k), &n))
                    continue;
                for (int j = 0; j < m.nq; j++)
                    q[j] = n.q_of[j];
                quad_jacobian(&m, q, A);
                const double tiny = 100.0 * DBL_EPSILON * n.most, v2 = n.speed * n.speed;
                if (kt_loop_nullspace(l.model, l.data, 0.0, n.q_of, N, &columns, &e) != KT_OK ||
                    kt_loop_equations(l.model, l.data, 0.0, n.q_of, n.v_of, J, residual, rate, bias, &e) != KT_OK) {
                    kt_check_true(e.message, false);
                    continue;
                }
                for (int c = 0; c < columns; c++)
                    for (int r = 0; r < m.rows; r++) {
                        quad sum = 0;
                        for (int j = 0; j < m.nv; j++)
                            sum += A[r][j] * N[c * m.nv + j];
                        kt_worst_below(&null, fabs((double)sum), tiny, "seed %d, h = 1e-%d", s.seed, k);
                    }
                const int rows = kt_model_mobility(l.model).equations;
                for (int r = 0; r < rows; r++) {
                    quad av = 0, aa = 0;
                    for (int j = 0; j < m.nv; j++)
                        av += J[j * rows + r] * n.v[j], aa += J[j * rows + r] * n.a[j];
                    kt_worst_below(&velocity, fabs((double)av - rate[r]), tiny * n.speed, "seed %d, h = 1e-%d", s.seed,
                                   k);
                    kt_worst_below(&drift, fabs((double)aa - bias[r]), tiny * (n.scale + v2), "seed %d, h = 1e-%d",
                                   s.seed, k);
                }
            }
        discard(&l);
    }
    kt_check_worst(&null);
    kt_check_worst(&velocity);
    kt_check_worst(&drift);
}

/* The change of the acceleration along a change of the state that the loops allow, by central differences of the oracle. */
static bool oracle_change(const quad_mechanism *m, const near_state *n, const quad *along, quad *dv, quad *da) {
    const quad e = 1e-9Q * (quad)n->least;
    quad v[2][QUAD_NV], a[2][QUAD_NV];
    for (int i = 0; i < 2; i++) {
        quad step[QUAD_NV], q[QUAD_NQ];
        for (int j = 0; j < m->nv; j++)
            step[j] = (i ? e : -e) * along[j], v[i][j] = n->v[j];
        quad_add(m, n->q, step, q);
        if (!quad_close(m, q) || !quad_close_velocity(m, q, v[i]) || !quad_accelerate(m, q, v[i], a[i]))
            return false;
    }
    for (int j = 0; j < m->nv; j++)
        dv[j] = (v[1][j] - v[0][j]) / (2 * e), da[j] = (a[1][j] - a[0][j]) / (2 * e);
    return true;
}

/* Derivatives are those of the motion, or refused: an acceleration that is not known to more than c eps v^2 / s^3 has
 * derivatives that are not known to more than that over s. Where the path bends they are d v^2 / s^4 themselves: what is
 * returned is known to the same factor, some eps / d, of its size. All but 2 % of the states are computed. */
KT_TEST(derivatives_next_to_singular_positions_are_right_or_refused) {
    static const double distances[] = {1e-10, 1e-7, 1e-4};
    static unsigned char work[1 << 20] __attribute__((aligned(64)));
    kt_worst worst = kt_worst_make("change of the acceleration"), known = kt_worst_make("the same, over d");
    singular s = {.seed = 0};
    int refused = 0, told = 0, all = 0;
    for (int i = 0; i < mechanisms(); i++) {
        next_singular(&s);
        kt_random r = kt_random_named("along");
        for (size_t id = 0; id < sizeof distances / sizeof *distances; id++) {
            const quad_mechanism m = off_by(&s, distances[id]);
            library l;
            near_state n;
            if (kt_check_true("compiles", compile(&l, &m)))
                for (int k = 1; k <= 10; k++) {
                    double dq[QUAD_NV * QUAD_NV], dv[QUAD_NV * QUAD_NV], worst_error = 0.0, size = 1.0;
                    quad along[QUAD_NV], change_v[QUAD_NV], change_a[QUAD_NV];
                    kt_error e = {0};
                    if (!state_at(&s, &m, pow(10.0, -k), &n))
                        continue;
                    for (int j = 0; j < m.nv; j++)
                        along[j] = kt_random_normal(&r);
                    if (!quad_close_velocity(&m, n.q, along) || !oracle_change(&m, &n, along, change_v, change_a))
                        continue;
                    const kt_status status = kt_acceleration_derivatives(l.model, l.data, work, sizeof work, 0.0,
                                                                         n.q_of, n.v_of, m.tau, NULL, dq, dv, NULL, &e);
                    all++;
                    if (status == KT_ERROR_SINGULAR) {
                        refused++;
                        continue;
                    }
                    for (int row = 0; row < m.nv; row++) {
                        quad sum = 0;
                        for (int j = 0; j < m.nv; j++)
                            sum += dq[j * m.nv + row] * along[j] + dv[j * m.nv + row] * change_v[j];
                        worst_error = fmax(worst_error, fabs((double)(sum - change_a[row])));
                        size = fmax(size, fabs((double)change_a[row]));
                    }
                    if (status != KT_OK)
                        worst_error = HUGE_VAL;
                    const double s2 = n.least * n.least,
                                 bound = 1e-9 * size + 30.0 * DBL_EPSILON * n.speed * n.speed / (s2 * s2);
                    if (!(worst_error <= bound) && told++ < 40)
                        kt_note("seed %d, %s, d = %g, h = 1e-%d, s = %.1e: |da| = %.1e, error %.1e of %.1e %s", s.seed,
                                space(&m), distances[id], k, n.least, size, worst_error, bound, e.message);
                    kt_worst_below(&worst, worst_error, bound, "seed %d, d = %g, h = 1e-%d", s.seed, distances[id], k);
                    kt_worst_below(&known, worst_error, (1e-11 + 20.0 * DBL_EPSILON / distances[id]) * size,
                                   "seed %d, d = %g, h = 1e-%d", s.seed, distances[id], k);
                }
            discard(&l);
        }
    }
    kt_note("%d refused of %d", refused, all);
    kt_check_below("refused, of all", (double)refused / all, 0.02);
    kt_check_worst(&worst);
    kt_check_worst(&known);
}
