/* The part of loops in derivatives (constraint/gradient.h), against differences of their equations. The test has loops
 * of every type, in space and in a plane, on the manifold and off it, for any accelerations and multipliers. Planar
 * loops are compared with dual numbers (dual_rows.h).
 *
 * Differences of order eight, of steps H and H / 2. The error of the second is 1 / 256 of the error of the first. The
 * error of their extrapolation is therefore about 1 / 256 of their difference, or rounding, some eps / H of the
 * numbers.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "tangle.h"

#include "constraint/formula_row.h"
#include "model/model.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#define H 0.005
enum { MECHANISMS = 60, MATRIX = TANGLE_ROWS * KT_TREE_NV, SQUARE = KT_TREE_NV * KT_TREE_NV };

/* A' lambda (nv) and b'' - A a (rows), or how they change. */
typedef struct sample {
    double force[KT_TREE_NV], slack[TANGLE_ROWS];
} sample;

typedef struct motion {
    const tangle *g;
    double a[KT_TREE_NV], lambda[TANGLE_ROWS];
} motion;

static void take(const motion *m, const double *q, const double *v, sample *s) {
    static double jacobian[MATRIX];
    const int nv = m->g->tree.nv, rows = m->g->rows;
    kt_error e = {0};
    kt_need_fine(
        "equations",
        kt_loop_equations(m->g->tree.model, m->g->tree.data, m->g->t, q, v, jacobian, NULL, NULL, s->slack, &e), &e);
    for (int i = 0; i < nv; i++) {
        s->force[i] = 0.0;
        for (int r = 0; r < rows; r++) {
            s->force[i] += jacobian[i * rows + r] * m->lambda[r];
            s->slack[r] -= jacobian[i * rows + r] * m->a[i];
        }
    }
}

/* Adds factor * sample at a step in q_j or v_j. */
static void add(const motion *m, int j, bool rate, double step, double factor, sample *sum) {
    double q[KT_TREE_NQ], v[KT_TREE_NV], move[KT_TREE_NV] = {0.0};
    sample s;
    memcpy(v, m->g->v, sizeof v);
    if (rate)
        v[j] += step;
    else
        move[j] = step;
    kt_position_add(m->g->tree.model, m->g->q, move, q);
    take(m, q, v, &s);
    for (int i = 0; i < KT_TREE_NV; i++)
        sum->force[i] += factor * s.force[i];
    for (int r = 0; r < TANGLE_ROWS; r++)
        sum->slack[r] += factor * s.slack[r];
}

static void difference(const motion *m, int j, bool rate, double h, sample *out) {
    static const double weight[] = {4.0 / 5.0, -1.0 / 5.0, 4.0 / 105.0, -1.0 / 280.0};
    memset(out, 0, sizeof *out);
    for (int k = 1; k <= 4; k++) {
        add(m, j, rate, k * h, weight[k - 1] / h, out);
        add(m, j, rate, -k * h, -weight[k - 1] / h, out);
    }
}

/* Extrapolates to a step of nothing; *apart receives the largest difference of both. */
static double extrapolate(double whole, double half, double *apart) {
    *apart = fmax(*apart, fabs(half - whole));
    return half + (half - whole) / 255.0;
}

typedef struct derivatives {
    double force[SQUARE], slack_q[MATRIX], slack_v[MATRIX];
} derivatives;

/* dual: all loops by dual numbers. */
static void derive(const motion *m, bool dual, derivatives *d) {
    static kt_support_dof dof[KT_TREE_NV];
    static int32_t chain[KT_TREE_SLOTS * 3];
    const kt_model *model = m->g->tree.model;
    kt_error e = {0};
    kt_need(model->n.link <= sizeof chain / sizeof *chain || kt_check_true("links fit", false));
    kt_need_fine("kinematics", kt_kinematics_update(model, m->g->tree.data, m->g->q, NULL, NULL, &e), &e);
    const kt_dual_motion at = {.model = model,
                               .data = m->g->tree.data,
                               .t = m->g->t,
                               .q = m->g->q,
                               .v = m->g->v,
                               .a = m->a,
                               .dof = dof,
                               .chain = chain};
    memset(d, 0, sizeof *d);
    if (!dual)
        kt_loop_matrices(&at, m->lambda, true, d->force, d->slack_q, d->slack_v);
    for (size_t i = 0; i < model->n.loop && dual; i++) {
        if (kt_has_formula_row(&model->loop[i]))
            kt_formula_row_matrices(&at, &model->loop[i], m->lambda, true, d->force, d->slack_q, d->slack_v);
        if (!model->loop[i].term_count)
            kt_dual_loop_matrices(&at, (int32_t)i, m->lambda, true, d->force, d->slack_q, d->slack_v);
    }
}

/* Errors of a column, relative to the largest number of its matrix. For a difference of 0, they are relative to its
 * rounding, eps / H.
 */
typedef struct errors {
    kt_worst force, slack_q, slack_v, dual;
} errors;

static void compare(const motion *m, const derivatives *d, int j, bool rate, errors *worst, int n) {
    const int nv = m->g->tree.nv, rows = m->g->rows;
    const double *force = d->force + j * nv, *slack = (rate ? d->slack_v : d->slack_q) + j * rows;
    const double most = fmax(kt_tree_largest(d->slack_q, nv * rows), kt_tree_largest(d->slack_v, nv * rows));
    const double force_most = fmax(1.0, kt_tree_largest(d->force, nv * nv)), slack_most = fmax(1.0, most);
    sample whole, half;
    double apart = 0.0;
    difference(m, j, rate, H, &whole);
    difference(m, j, rate, 0.5 * H, &half);
    for (int i = 0; i < nv; i++) {
        const double expected = extrapolate(whole.force[i], half.force[i], &apart);
        const double bound = apart / 16.0 + 2e-12 * force_most;
        kt_worst_near(&worst->force, rate ? 0.0 : -force[i], expected, bound, "mechanism %d row %d column %d%s", n, i,
                      j, rate ? " (v)" : "");
    }
    apart = 0.0;
    for (int r = 0; r < rows; r++) {
        const double expected = extrapolate(whole.slack[r], half.slack[r], &apart);
        kt_worst_near(rate ? &worst->slack_v : &worst->slack_q, slack[r], expected, apart / 16.0 + 2e-12 * slack_most,
                      "mechanism %d equation %d column %d", n, r, j);
    }
}

/* Planar loops by their own forms against dual numbers. */
static void compare_dual(const motion *m, const derivatives *d, kt_worst *worst, int n) {
    static derivatives dual;
    const double *x = (const double *)d, *y = (const double *)&dual;
    derive(m, true, &dual);
    const int count = (int)(sizeof dual / sizeof *y);
    const double bound = 1e-13 * fmax(1.0, kt_tree_largest(y, count));
    for (int i = 0; i < count; i++)
        kt_worst_near(worst, x[i], y[i], bound, "mechanism %d number %d", n, i);
}

static void put_off(tangle *g, kt_random *random) {
    double step[KT_TREE_NV], q[KT_TREE_NQ];
    for (int i = 0; i < g->tree.nv; i++) {
        step[i] = kt_random_uniform(random, -0.05, 0.05);
        g->v[i] = kt_random_uniform(random, -1.0, 1.0);
    }
    memcpy(q, g->q, sizeof q);
    kt_position_add(g->tree.model, q, step, g->q);
}

static void check_all(tangle_plan plan, int types_wanted, int flat_wanted) {
    kt_random random = kt_random_of_test();
    static tangle g;
    static derivatives d;
    static motion m;
    errors worst = {kt_worst_make("d(A' lambda)"), kt_worst_make("d(b'' - A a)/dq"), kt_worst_make("d(b'' - A a)/dv"),
                    kt_worst_make("dual numbers")};
    int types[KT_LOOP_TYPE_COUNT] = {0}, kinds = 0, flat = 0;
    for (int n = 0; n < MECHANISMS; n++) {
        tangle_grow(&g, &plan, &random);
        m.g = &g;
        if (n % 2)
            put_off(&g, &random);
        for (int i = 0; i < KT_TREE_NV; i++)
            m.a[i] = kt_random_normal(&random);
        for (int r = 0; r < TANGLE_ROWS; r++)
            m.lambda[r] = kt_random_normal(&random);
        for (int i = 0; i < g.loops; i++)
            types[g.loop[i].type]++;
        derive(&m, false, &d);
        for (int j = 0; j < g.tree.nv; j++) {
            compare(&m, &d, j, false, &worst, n);
            compare(&m, &d, j, true, &worst, n);
        }
        if (!kt_loop_gradient_reads_space(g.tree.model)) {
            compare_dual(&m, &d, &worst.dual, n);
            flat++;
        }
    }
    kt_check_worst(&worst.force);
    kt_check_worst(&worst.slack_q);
    kt_check_worst(&worst.slack_v);
    if (flat_wanted > 0) {
        kt_check_worst(&worst.dual);
        kt_check_above("by their own forms", flat, flat_wanted);
    }
    for (int i = 0; i < KT_LOOP_TYPE_COUNT; i++)
        kinds += types[i] > 0;
    kt_check_equal_int("types of loops", kinds, types_wanted);
}

KT_TEST(loops_change_as_differences_of_their_equations_do) {
    tangle_plan plan = tangle_plan_default();
    plan.loops = 3;
    plan.tree.bodies = 10;
    check_all(plan, KT_LOOP_GEAR, 0);
}

/* Screws and rolling have no form in a plane; curves are drawn in space alone. */
KT_TEST(loops_in_a_plane_change_as_differences_of_their_equations_do) {
    tangle_plan plan = tangle_plan_planar();
    plan.loops = 3;
    plan.tree.bodies = 10;
    check_all(plan, KT_LOOP_GEAR - 3, 10);
}
