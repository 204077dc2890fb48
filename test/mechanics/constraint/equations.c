/* The equations of loops as matrices, against differences. A is the derivative of phi along the joints' own steps. The
 * derivative of phi by time is -b'. Along q (+) s v, t + s, the rate of A v - b' is -b''. Differences are of sixth
 * order with step h. The bounds are their rounding, some eps / h, times a measured number.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "linkage.h"
#include "tangle.h"

#include "evaluate/evaluate.h"
#include "reduction/kernel.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { PLACES = 6 };
static const double h = 2e-3;
static const double place[PLACES] = {-3.0, -2.0, -1.0, 1.0, 2.0, 3.0};
static const double weight[PLACES] = {-1.0 / 60.0, 9.0 / 60.0, -45.0 / 60.0, 45.0 / 60.0, -9.0 / 60.0, 1.0 / 60.0};

typedef struct matrices {
    double jacobian[TANGLE_ROWS * KT_TREE_NV], residual[TANGLE_ROWS], rate[TANGLE_ROWS], drift[TANGLE_ROWS];
} matrices;

static void evaluate(const tangle *g, double t, const double *q, const double *v, matrices *m) {
    kt_error e = {0};
    kt_need_fine(
        "equations",
        kt_loop_equations(g->tree.model, g->tree.data, t, q, v, m->jacobian, m->residual, m->rate, m->drift, &e), &e);
}

/* Rolling has no phi but for the contact, knife edges and rates have none. */
static bool is_holonomic(const tangle *g, int row) {
    for (int i = 0; i < g->loops; i++) {
        const int count = kt_loop_type_of(g->tree.model, i) == KT_LOOP_ROLLING ? (g->loop[i].holonomic ? 3 : 2) : -1;
        static const int rows[KT_LOOP_TYPE_COUNT] = {3, 2, 1, 1, 3, 2, 1, 5, 5, 5, 4, 3, 6, 4,
                                                     1, 1, 2, 1, 1, 4, 1, 2, 1, 1, 1, 1, 2};
        const bool is_driven = g->loop[i].type == KT_LOOP_CURVE && g->loop[i].function.type != KT_FUNCTION_NONE;
        const int all = count < 0 ? rows[g->loop[i].type] + is_driven : count;
        if (row < all)
            return count < 0 ? g->loop[i].type != KT_LOOP_KNIFE_EDGE && g->loop[i].type != KT_LOOP_RATES : row == 2;
        row -= all;
    }
    return true;
}

static void take_step(const tangle *g, const double *dv, double s, double *out) {
    double step[KT_TREE_NV];
    for (int i = 0; i < g->tree.nv; i++)
        step[i] = s * dv[i];
    kt_position_add(g->tree.model, g->q, step, out);
}

/* Differences of step h and h / 2: the second has 1 / 64 of the truncation error of the first. */
typedef struct slopes {
    double whole[TANGLE_ROWS], half[TANGLE_ROWS];
} slopes;

static void add(slopes *s, int half, int p, int row, double value) {
    (half ? s->half : s->whole)[row] += weight[p] * value / (half ? 0.5 * h : h);
}

static double bound(const slopes *s, int row) { return fabs(s->whole[row] - s->half[row]) / 32.0 + 1e-11; }

/* d phi / d u_k, and d phi / d t as column nv. */
static void check_column(const tangle *g, const matrices *at, int k, kt_worst *worst) {
    static matrices m;
    double q[KT_TREE_NQ], unit[KT_TREE_NV] = {0.0};
    slopes s = {{0.0}, {0.0}};
    if (k < g->tree.nv)
        unit[k] = 1.0;
    for (int p = 0; p < 2 * PLACES; p++) {
        const double step = place[p / 2] * (p % 2 ? 0.5 * h : h);
        take_step(g, unit, step, q);
        evaluate(g, k < g->tree.nv ? g->t : g->t + step, q, g->v, &m);
        for (int r = 0; r < g->rows; r++)
            add(&s, p % 2, p / 2, r, m.residual[r]);
    }
    for (int r = 0; r < g->rows; r++)
        if (is_holonomic(g, r))
            kt_worst_near(worst, k < g->tree.nv ? at->jacobian[k * g->rows + r] : -at->rate[r], s.half[r], bound(&s, r),
                          "nv %d, row %d, column %d", g->tree.nv, r, k);
}

static void check_drift(const tangle *g, const matrices *at, kt_worst *worst) {
    static matrices m;
    double q[KT_TREE_NQ];
    slopes s = {{0.0}, {0.0}};
    for (int p = 0; p < 2 * PLACES; p++) {
        const double step = place[p / 2] * (p % 2 ? 0.5 * h : h);
        take_step(g, g->v, step, q);
        evaluate(g, g->t + step, q, g->v, &m);
        for (int r = 0; r < g->rows; r++) {
            double flow = -m.rate[r];
            for (int i = 0; i < g->tree.nv; i++)
                flow += m.jacobian[i * g->rows + r] * g->v[i];
            add(&s, p % 2, p / 2, r, flow);
        }
    }
    for (int r = 0; r < g->rows; r++)
        kt_worst_near(worst, at->drift[r], -s.half[r], bound(&s, r), "nv %d, row %d", g->tree.nv, r);
}

/* On the manifold, and off it. */
KT_TEST(equations_are_the_derivatives_of_their_residuals) {
    static tangle g;
    static matrices at;
    kt_random random = kt_random_of_test();
    const tangle_plan plan = tangle_plan_default();
    KT_WORST columns = kt_worst_make("A and b'"), drift = kt_worst_make("b''");
    for (int i = 0; i < 60; i++) {
        tangle_grow(&g, &plan, &random);
        for (int k = 0; k < g.tree.nv && i % 2; k++)
            g.v[k] = kt_random_uniform(&random, -1.0, 1.0); /* also velocities that do not fit */
        if (i % 2)
            take_step(&g, g.v, 0.05, g.q);
        evaluate(&g, g.t, g.q, g.v, &at);
        for (int k = 0; k <= g.tree.nv; k++)
            check_column(&g, &at, k, &columns);
        check_drift(&g, &at, &drift);
    }
}

/* Other loops do not change the rows of a loop, to the bit. The rows are in the order of the description. The test is
 * in space, since parts that lie in a plane alone may be tied to other parts. They are then computed in another way.
 * The test uses dense matrices, since fewer equations on as many links may be reduced link by link. */
KT_TEST(rows_of_a_loop_do_not_depend_on_other_loops) {
    static tangle g;
    static matrices all, one;
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    long differ = 0, rows = 0, astray = 0;
    plan.options.plan = KT_PLAN_SPATIAL;
    plan.options.structure = KT_STRUCTURE_DENSE;
    for (int i = 0; i < 40; i++) {
        tangle_grow(&g, &plan, &random);
        evaluate(&g, g.t, g.q, g.v, &all);
        int row = 0;
        for (int l = 0; l < g.loops; l++) {
            kt_description d = g.tree.description;
            kt_error e = {0};
            d.loops = &g.loop[l];
            d.loop_count = 1;
            kt_model *model = kt_test_model(&d, &plan.options);
            kt_data *data = kt_test_data(model);
            kt_need_fine(
                "equations",
                kt_loop_equations(model, data, g.t, g.q, g.v, one.jacobian, one.residual, one.rate, one.drift, &e), &e);
            const int count = kt_model_mobility(model).equations;
            const kt_loop_rows stand = kt_loop_rows_of(g.tree.model, l);
            astray += stand.first != row || stand.count != count;
            astray += kt_loop_find(g.tree.model, g.loop[l].name) != l;
            for (int r = 0; r < count; r++, row++, rows++) {
                bool same = one.residual[r] == all.residual[row] && one.rate[r] == all.rate[row] &&
                            one.drift[r] == all.drift[row];
                for (int k = 0; k < g.tree.nv; k++)
                    same &= one.jacobian[k * count + r] == all.jacobian[k * g.rows + row];
                differ += !same;
            }
        }
        astray += g.tree.model != NULL && kt_loop_find(g.tree.model, "none") != -1;
    }
    kt_check_above("rows", (double)rows, 300.0);
    kt_check_equal_int("loops that are not found, or not where their rows are", astray, 0);
    kt_check_equal_int("rows that differ", differ, 0);
}

/* The equations of all loops by groups, of the loops together or one after the other. */
typedef struct entries {
    double jacobian[TANGLE_ROWS * KT_TREE_NV], residual[TANGLE_ROWS], rate[TANGLE_ROWS], drift[TANGLE_ROWS];
} entries;

/* Marks the coordinates of a loop's paths, as positions in its group. A relation may depend on all coordinates. */
static void mark_paths(const kt_model *model, const kt_loop_record *loop, bool *on_path) {
    for (int i = 0; i < model->group[loop->group].v_count; i++)
        on_path[i] = loop->term_count > 0;
    for (int end = 0; end < 2; end++)
        for (int i = 0; i < loop->length[end]; i++) {
            const kt_link *link = &model->link[model->path[loop->path[end] + i]];
            for (int k = 0; k < kt_link_dofs(link); k++)
                on_path[link->local + k] = true;
        }
}

/* Fills loop by loop. Entries outside of the paths are NaN. Returns the largest of these entries in `all`. */
static double fill_one_by_one(const tangle *g, const kt_dynamic_state *at, const entries *all, entries *one) {
    double lost = 0.0;
    const kt_model *model = g->tree.model;
    model->group_kernels->follow(model, g->tree.data, at->q, at->v);
    for (int l = 0; l < g->loops; l++) {
        const kt_loop_record *loop = &model->loop[l];
        const kt_group *group = &model->group[loop->group];
        bool on_path[KT_TREE_NV];
        mark_paths(model, loop, on_path);
        for (int r = 0; r < loop->row_count; r++)
            for (int i = 0; i < group->v_count; i++) {
                const size_t entry = kt_loop_entry(group, loop, r) + (size_t)i;
                one->jacobian[entry] = on_path[i] ? 0.0 : (double)NAN;
                lost = fmax(lost, on_path[i] ? 0.0 : fabs(all->jacobian[entry]));
            }
        kt_loop_entries_of(model, g->tree.data, at, l, one->jacobian, one->residual, one->rate, one->drift);
    }
    return lost;
}

/* The largest difference, relative to 1 and the numbers. NaN in b is left out of a. */
static double largest_difference(const double *a, const double *b, size_t n) {
    double most = 0.0;
    for (size_t i = 0; i < n; i++)
        if (!isnan(b[i]) || isnan(a[i]))
            most = fmax(most, fabs(a[i] - b[i]) / fmax(1.0, fabs(a[i])));
    return most;
}

/* Time stepping fills the equations of contacts one by one. With dense matrices the bits are those of all loops; fronts
 * compute the entries as products. */
KT_TEST(a_loop_alone_has_the_equations_that_all_have) {
    static tangle g;
    static entries all, one;
    static const char *const name[] = {"in space", "in the plane", "fronts in space", "fronts in the plane"};
    kt_random random = kt_random_of_test();
    for (int p = 0; p < 4; p++) {
        tangle_plan plan = p % 2 == 0 ? tangle_plan_default() : tangle_plan_planar();
        const double bound = p < 2 ? 0.0 : 1e-14;
        double worst = 0.0, lost = 0.0;
        plan.options.structure = p < 2 ? KT_STRUCTURE_DENSE : KT_STRUCTURE_FRONTS;
        for (int i = 0; i < 20; i++) {
            kt_error e = {0};
            tangle_grow(&g, &plan, &random);
            const kt_dynamic_state at = {.t = g.t, .q = g.q, .v = g.v};
            const kt_counts *n = &g.tree.model->n;
            kt_need_fine(
                "entries",
                kt_loop_entries(g.tree.model, g.tree.data, &at, all.jacobian, all.residual, all.rate, all.drift, &e),
                &e);
            lost = fmax(lost, fill_one_by_one(&g, &at, &all, &one));
            worst = fmax(worst, largest_difference(all.jacobian, one.jacobian, n->entry));
            worst = fmax(worst, largest_difference(all.residual, one.residual, n->row));
            worst = fmax(worst, largest_difference(all.rate, one.rate, n->row));
            worst = fmax(worst, largest_difference(all.drift, one.drift, n->row));
        }
        kt_check_below(name[p], worst, bound);
        kt_check_below("entries outside of the paths", lost, bound);
    }
}

/* A four-bar in the plane, closed by a revolute joint: three of the five equations are void and read as zeros. */
KT_TEST(void_rows_are_zero) {
    static linkage l;
    double jacobian[15], residual[5], rate[5], drift[5], size[5] = {0.0};
    kt_error e = {0};
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    kt_need_fine("equations", kt_loop_equations(l.model, l.data, 0.0, l.q, l.v, jacobian, residual, rate, drift, &e),
                 &e);
    for (int r = 0; r < 5; r++)
        for (int k = 0; k < 3; k++)
            size[r] += fabs(jacobian[k * 5 + r]);
    for (int r = 0; r < 5; r++) {
        if (r < 2) {
            kt_check_above("row in the plane", size[r], 1.0);
            kt_check_above("its drift", fabs(drift[r]), 0.1);
        } else {
            kt_check_equal_bits("row across the plane", &size[r], &(double){0.0}, 1);
            kt_check_equal_bits("its drift", &drift[r], &(double){0.0}, 1);
        }
    }
}

KT_TEST(equations_reject_what_is_not_finite_and_touch_nothing) {
    static linkage l;
    double jacobian[15], residual[5], before[15], nan = (double)NAN;
    kt_error e = {0};
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    for (int i = 0; i < 15; i++)
        jacobian[i] = before[i] = i;
    memcpy(residual, before, sizeof residual);
    for (int k = 0; k < 3; k++) {
        const double kept = k == 1 ? l.v[2] : l.q[1];
        if (k < 2)
            *(k ? &l.v[2] : &l.q[1]) = nan;
        kt_check_equal_int(
            "status",
            kt_loop_equations(l.model, l.data, k < 2 ? 0.0 : nan, l.q, l.v, jacobian, residual, NULL, NULL, &e),
            KT_ERROR_NOT_FINITE);
        *(k == 1 ? &l.v[2] : &l.q[1]) = kept;
        kt_check_text("where", e.where, k == 0 ? "joint 'coupler'" : k == 1 ? "joint 'rocker'" : "");
    }
    kt_check_equal_bits("jacobian", jacobian, before, 15);
    kt_check_equal_bits("residual", residual, before, 5);
}
