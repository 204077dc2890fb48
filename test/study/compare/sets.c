/* Accelerations of the other coordinate sets on random closed mechanisms, for which all sets agree. Also wrong
 * arguments. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closure.h"
#include "interpose.h"
#include "mechanics/constraint/tangle.h"

#include "compare/formulation.h"
#include "model/model.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* The factor by which the errors may be larger. The numbers that the augmented set adds are of the size s |A|^2. Those
 * of the others are of the size of M. */
static double growth(const kt_constraint_formulation *set) {
    double most = 0.0;
    if (set->options.type != KT_CONSTRAINT_FORMULATION_AUGMENTED)
        return 1.0;
    for (int i = 0; i < set->n; i++)
        for (int r = 0; r < set->k; r++)
            most = fmax(most, fabs(set->jacobian[i * set->k + r]));
    return 1.0 + set->penalty * most * most;
}

/* Compares the set on the mechanism's state with the dense solution of tangle_solve in long double. The array `moved`
 * is the change due to a rounding of the matrices. All sets begin with the accelerations without loops, M^-1 f. Loops
 * remove the part that violates them. Force projection computes accelerations at the rates that it derives from v. The
 * error of these rates (`rates`) is not counted once more. Returns false if nothing was compared, because the library
 * regards the position as near a singular one. */
static bool compare(tangle *g, kt_constraint_formulation_type type, double times, kt_worst *worst, kt_worst *rates) {
    static tangle_system s;
    double a[KT_TREE_NV], rate[KT_TREE_NV], expected[KT_TREE_NV], moved[KT_TREE_NV];
    double given[KT_TREE_NV], loose[KT_TREE_NV];
    const kt_constraint_formulation_options options = kt_constraint_formulation_options_default(type, 1.0);
    kt_error e = {0};
    kt_constraint_formulation *set = closure_set(g->tree.model, &options);
    bool compared = false;
    if (kt_fine("acceleration",
                kt_acceleration_evaluate(g->tree.model, g->tree.data, g->t, g->q, g->v, g->tau, g->external, a, &e),
                &e) &&
        !tangle_was_near_singular(g->tree.model, g->tree.data) &&
        kt_fine("without loops",
                kt_dynamics_forward(g->tree.model, g->tree.data, g->q, g->v, g->tau, g->external, loose, &e), &e)) {
        tangle_system_of(g, &s);
        (void)kt_fine(
            "set",
            kt_constraint_formulation_evaluate(set, g->tree.data, g->t, g->q, g->v, g->tau, g->external, rate, a, &e),
            &e);
        memcpy(given, g->v, sizeof given);
        memcpy(g->v, rate, (size_t)g->tree.nv * sizeof *rate);
        (void)tangle_solve(g, &s, (tangle_way){.mixes = true, .by = loose}, expected, moved);
        memcpy(g->v, given, sizeof given);
        const double least = 16.0 * DBL_EPSILON * kt_tree_largest(expected, g->tree.nv);
        for (int i = 0; i < g->tree.nv; i++) {
            kt_worst_near(worst, a[i], expected[i], times * growth(set) * (moved[i] + least), "nv %d, %d", g->tree.nv,
                          i);
            kt_worst_near(rates, rate[i], g->v[i], 1e-12, "nv %d, %d", g->tree.nv, i);
        }
        compared = true;
    }
    return compared;
}

/* Rates are those of the state. For force projection they differ by rounding: 1.2e-13 was measured in 160 mechanisms.
 */
static void run(const tangle_plan *plan, kt_random *random, int mechanisms, const double *times) {
    static tangle g;
    kt_worst worst[KT_CONSTRAINT_FORMULATION_COUNT], rates = kt_worst_make("positions follow v");
    for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++)
        worst[type] = kt_worst_make(kt_constraint_formulation_name((kt_constraint_formulation_type)type));
    int compared = 0;
    for (int i = 0; i < mechanisms; i++) {
        tangle_grow(&g, plan, random);
        for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++)
            compared += compare(&g, (kt_constraint_formulation_type)type, times[type], &worst[type], &rates);
    }
    for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++)
        kt_check_worst(&worst[type]);
    kt_check_worst(&rates);
    kt_check_above("share compared", (double)compared / (mechanisms * KT_CONSTRAINT_FORMULATION_COUNT), 0.8);
}

/* Loops of all types, driven ones among them. */
KT_TEST(every_set_accelerates_as_the_dense_equations_say_on_the_manifold) {
    kt_random random = kt_random_of_test();
    const tangle_plan plan = tangle_plan_default();
    static const double times[] = {4.0, 4.0, 0.5, 4.0};
    run(&plan, &random, 100, times);
}

/* The long tier adds more mechanisms. */
KT_TEST(every_set_accelerates_redundant_mechanisms_on_the_manifold) {
    kt_random random = kt_random_of_test();
    tangle_plan plan = tangle_plan_default();
    static const double times[] = {4.0, 4.0, 0.5, 4.0};
    plan.loops = 6;
    plan.nearby = 1.0;
    plan.still = true;
    plan.tree.bodies = 10;
    plan.types = 1U << KT_LOOP_WELD | 1U << KT_LOOP_REVOLUTE | 1U << KT_LOOP_PRISMATIC | 1U << KT_LOOP_PLANAR;
    run(&plan, &random, KT_SHORT(15, 60), times);
}

/* ---- augmented: iterations --------------------------------------------------------------------------------------- */

/* The factor by which an error of e is multiplied: 1 + s (at least the largest eigenvalue of S). The first pivot of
 * Gauss' set is the largest column of A M^-1/2. */
static double gain_of(const tangle *g, const kt_constraint_formulation *set) {
    double a[KT_TREE_NV], gain = 1.0;
    const kt_constraint_formulation_options options =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 1.0);
    kt_error e = {0};
    kt_constraint_formulation *gauss = closure_set(g->tree.model, &options);
    kt_need_fine("gauss",
                 kt_constraint_formulation_evaluate(gauss, g->tree.data, g->t, g->q, g->v, NULL, NULL, NULL, a, &e),
                 &e);
    return gain + set->penalty * gauss->factor[0] * gauss->factor[0] * g->rows;
}

/* Checks the following recursion, from matrices that were computed apart:
 *     e_i+1 + s S e_i+1 = e_i,  S = A M^-1 A' */
static void check_contraction(const tangle *g, kt_constraint_formulation *set, double gain, kt_worst *worst) {
    static tangle_system s;
    static double e[3][TANGLE_ROWS];
    double a[KT_TREE_NV], pushed[KT_TREE_NV], felt[KT_TREE_NV];
    kt_error error = {0};
    set->options.tolerance = 0.0;
    tangle_system_of(g, &s);
    double terms = 0.0;
    for (int k = 0; k < 3; k++) {
        set->options.iterations = k + 1;
        kt_need_fine("set",
                     kt_constraint_formulation_evaluate(set, g->tree.data, g->t, g->q, g->v, g->tau, g->external, NULL,
                                                        a, &error),
                     &error);
        for (int r = 0; r < g->rows; r++) {
            double size = fabs(s.drift[r]);
            e[k][r] = -s.drift[r];
            for (int i = 0; i < g->tree.nv; i++) {
                e[k][r] += s.jacobian[i * g->rows + r] * a[i];
                size += fabs(s.jacobian[i * g->rows + r] * a[i]);
            }
            terms = fmax(terms, size);
        }
    }
    for (int k = 1; k < 3; k++) {
        for (int i = 0; i < g->tree.nv; i++) {
            pushed[i] = 0.0;
            for (int r = 0; r < g->rows; r++)
                pushed[i] += set->penalty * s.jacobian[i * g->rows + r] * e[k][r];
        }
        /* M^-1 of it by the recursion, without velocities and gravity: the difference of two accelerations */
        double with[KT_TREE_NV], without[KT_TREE_NV];
        kt_need_fine("with", kt_dynamics_forward(g->tree.model, g->tree.data, g->q, g->v, pushed, NULL, with, &error),
                     &error);
        kt_need_fine("without",
                     kt_dynamics_forward(g->tree.model, g->tree.data, g->q, g->v, NULL, NULL, without, &error), &error);
        for (int i = 0; i < g->tree.nv; i++)
            felt[i] = with[i] - without[i];
        for (int r = 0; r < g->rows; r++) {
            double left = e[k][r];
            for (int i = 0; i < g->tree.nv; i++)
                left += s.jacobian[i * g->rows + r] * felt[i];
            kt_worst_near(worst, left, e[k - 1][r], 16.0 * DBL_EPSILON * gain * terms, "iterate %d, row %d", k + 1, r);
        }
    }
}

KT_TEST(augmented_iterates_close_the_equations_by_the_factor_of_the_penalty) {
    kt_random random = kt_random_of_test();
    static tangle g;
    tangle_plan plan = tangle_plan_default();
    KT_WORST worst = kt_worst_make("e + s A M^-1 A' e against the e before");
    plan.loops = 2;
    plan.tree.bodies = 8;
    for (int i = 0; i < 30; i++) {
        tangle_grow(&g, &plan, &random);
        kt_constraint_formulation_options options =
            kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_AUGMENTED, 1.0);
        options.penalty = 3.0;
        kt_constraint_formulation *set = closure_set(g.tree.model, &options);
        check_contraction(&g, set, gain_of(&g, set), &worst);
    }
}

static void make_four_bar(linkage *l) {
    const four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
    linkage_build(l, 0.0);
}

/* The largest |A a - c| of the four-bar after so many iterations; it was placed in this very state. */
static double left_after(const linkage *l, kt_constraint_formulation *set, int iterations) {
    double a[8];
    kt_error e = {0};
    set->options.iterations = iterations;
    set->options.tolerance = 0.0;
    kt_constraint_formulation_reset(set);
    (void)kt_fine("set", kt_constraint_formulation_evaluate(set, l->data, 0.0, l->q, l->v, NULL, NULL, NULL, a, &e),
                  &e);
    return kt_constraint_formulation_statistics_of(set).residual;
}

/* An iteration divides by 1 + penalty along the smallest direction of A M^-1 A'. The last diagonal of R is at most a
 * few times larger than that. */
KT_TEST(penalty_is_what_an_iteration_divides_by) {
    linkage l;
    make_four_bar(&l);
    /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
    for (double penalty = 10.0; penalty < 2000.0; penalty *= 10.0) {
        kt_constraint_formulation_options options =
            kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_AUGMENTED, 0.01);
        options.penalty = penalty;
        kt_constraint_formulation *set = closure_set(l.model, &options);
        const double by = left_after(&l, set, 3) / left_after(&l, set, 4);
        kt_check_below("divided by", by, 1.0 + penalty);
        kt_check_above("divided by", by, 0.5 * (1.0 + penalty));
    }
}

/* ---- the caller's part ------------------------------------------------------------------------------------------- */

KT_TEST(sets_allocate_nothing_after_setting_up) {
    linkage l;
    double a[8], rate[8];
    kt_error e = {0};
    make_four_bar(&l);
    for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++) {
        const kt_constraint_formulation_options options =
            kt_constraint_formulation_options_default((kt_constraint_formulation_type)type, 0.01);
        const size_t size = kt_constraint_formulation_size(l.model);
        void *memory = aligned_alloc(KT_ALIGNMENT, size);
        kt_constraint_formulation *set = NULL;
        bool changed = false;
        kt_interpose_start();
        const kt_status placed = kt_constraint_formulation_init(l.model, l.data, &options, memory, size, &set, &e);
        kt_status moved = KT_OK;
        for (int i = 0; i < 3 && placed == KT_OK; i++)
            moved = kt_constraint_formulation_evaluate(set, l.data, 0.0, l.q, l.v, NULL, NULL, rate, a, &e);
        const kt_instant at = {.model = l.model, .data = l.data, .t = 0.0, .q = l.q, .v = l.v};
        const int projected = placed == KT_OK ? kt_formulation_project_positions(&at, l.q, l.v, &changed, &e, set) : -1;
        kt_check_equal_int("allocations", kt_interpose_stop(), 0);
        (void)kt_fine("placed", placed, &e);
        (void)kt_fine("evaluated", moved, &e);
        kt_check_equal_int("projected", projected, 0);
        free(memory);
    }
}

/* The bits of the result do not depend on the contents of a set's scratch. */
KT_TEST(sets_have_no_memory_of_what_they_evaluated) {
    linkage l;
    double first[8], other[8], again[8];
    kt_error e = {0};
    make_four_bar(&l);
    for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++) {
        const kt_constraint_formulation_options options =
            kt_constraint_formulation_options_default((kt_constraint_formulation_type)type, 0.01);
        kt_constraint_formulation *set = closure_set(l.model, &options);
        double q[8], v[8];
        for (int i = 0; i < l.nv; i++) {
            q[i] = l.q[i] + 0.1 * i;
            v[i] = 2.0 - l.v[i];
        }
        (void)kt_fine("first",
                      kt_constraint_formulation_evaluate(set, l.data, 0.0, l.q, l.v, NULL, NULL, NULL, first, &e), &e);
        (void)kt_fine("other", kt_constraint_formulation_evaluate(set, l.data, 0.0, q, v, NULL, NULL, NULL, other, &e),
                      &e);
        (void)kt_fine("again",
                      kt_constraint_formulation_evaluate(set, l.data, 0.0, l.q, l.v, NULL, NULL, NULL, again, &e), &e);
        kt_check_equal_bits(kt_constraint_formulation_name((kt_constraint_formulation_type)type), again, first,
                            (size_t)l.nv);
        kt_check_true("elsewhere it is another", memcmp(other, first, (size_t)l.nv * sizeof *other) != 0);
    }
}

static void check_rejection(const linkage *l, const kt_constraint_formulation_options *options, size_t size,
                            size_t shift, kt_status code, const char *where, const char *words) {
    char *memory = aligned_alloc(KT_ALIGNMENT, kt_constraint_formulation_size(l->model) + KT_ALIGNMENT);
    kt_constraint_formulation *set = NULL;
    kt_error e = {0};
    kt_check_equal_int(
        words, kt_constraint_formulation_init(l->model, l->data, options, memory + shift, size, &set, &e), code);
    kt_check_text("where", e.where, where);
    kt_check_contains("message", e.message, words);
    kt_check_true("no set", set == NULL);
    free(memory);
}

KT_TEST(sets_say_what_is_wrong_with_options_and_memory) {
    linkage l;
    const kt_constraint_formulation_options fine =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, 0.01);
    kt_constraint_formulation_options o = fine;
    make_four_bar(&l);
    const size_t size = kt_constraint_formulation_size(l.model);
    o.type = KT_CONSTRAINT_FORMULATION_COUNT;
    check_rejection(&l, &o, size, 0, KT_ERROR_ARGUMENT, "type", "no constraint formulation");
    o = fine;
    o.alpha = -1.0;
    check_rejection(&l, &o, size, 0, KT_ERROR_ARGUMENT, "alpha", "zero or more");
    o = kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, 0.0);
    check_rejection(&l, &o, size, 0, KT_ERROR_ARGUMENT, "alpha", "inf");
    o = fine;
    o.penalty = 0.0;
    check_rejection(&l, &o, size, 0, KT_ERROR_ARGUMENT, "penalty", "above zero");
    o = fine;
    o.iterations = 0;
    check_rejection(&l, &o, size, 0, KT_ERROR_ARGUMENT, "iterations", "one or more");
    check_rejection(&l, &fine, size - 1, 0, KT_ERROR_MEMORY, "kt_constraint_formulation_init", "bytes");
    check_rejection(&l, &fine, size, 8, KT_ERROR_MEMORY, "kt_constraint_formulation_init", "misaligned");
    kt_constraint_formulation *none = NULL;
    kt_check_equal_int("no memory", kt_constraint_formulation_init(l.model, l.data, &fine, NULL, size, &none, NULL),
                       KT_ERROR_MEMORY);
    kt_check_true("a name of none", kt_constraint_formulation_name(KT_CONSTRAINT_FORMULATION_COUNT) == NULL);
}

/* The second crank is massless: loops move it along with the first, and the reduction needs no more. */
KT_TEST(sets_say_that_they_need_inertia_along_every_joint) {
    linkage l;
    const four_bar f = four_bar_default();
    const kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 0.01);
    linkage_four_bar(&l, &f);
    l.body[l.description.body_count - 1].mass = 0.0;
    l.body[l.description.body_count - 1].inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    linkage_build(&l, 0.0);
    double a[8];
    kt_constraint_formulation *set = NULL;
    kt_error e = {0};
    linkage_accelerate(&l, 0.0, a);
    kt_check_equal_int("gauss", kt_constraint_formulation_create(l.model, &o, &set, &e), KT_ERROR_SINGULAR);
    kt_check_contains("message", e.message, "inertia along every joint");
}

/* A set of another model in a simulation. */
KT_TEST(a_simulation_rejects_the_set_of_another_model) {
    linkage l, other;
    const kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 0.01);
    make_four_bar(&l);
    make_four_bar(&other);
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_error e = {0};
    kt_constraint_formulation *set = closure_set(other.model, &o);
    kt_constraint_formulation_use(set, &options);
    (void)kt_fine("simulation", kt_simulation_create(l.model, NULL, &options, &simulation, &e), &e);
    kt_check_true("a step fails", kt_simulation_step(simulation, 1.0, &e) != KT_OK);
    kt_check_contains("message", e.message, "another model");
    kt_simulation_free(simulation);
}
