/* Mechanisms in a plane against the same mechanisms by the spatial kernels: whatever can be asked of their loops has
 * the same answer but for rounding. (acceleration.c and equations.c hold both against other formulations.) */
#include "linkage.h"
#include "tangle.h"

#include "model/internal.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

#define EPS DBL_EPSILON

/* A mechanism compiled twice. */
typedef struct pair {
    tangle g; /* in its plane */
    kt_model *space;
    kt_data *data;
} pair;

static void pair_free(pair *p) {
    kt_data_free(p->data);
    kt_model_free(p->space);
    tangle_free(&p->g);
}

static bool pair_grow(pair *p, const tangle_plan *plan, kt_random *random) {
    kt_error e = {0};
    kt_model_options options = plan->options;
    options.plan = KT_PLAN_SPATIAL;
    p->space = NULL;
    p->data = NULL;
    return tangle_grow(&p->g, plan, random) &&
           kt_tree_fine("compiles", kt_model_compile(&p->g.tree.description, &options, &p->space, &e), &e) &&
           kt_tree_fine("data", kt_data_create(p->space, &p->data, &e), &e);
}

/* Four of five in one plane, the others mixed; every way of reduction, and both metrics. */
static tangle_plan draw_plan(int i) {
    tangle_plan plan = tangle_plan_planar();
    if (i % 5 == 4) {
        plan.tree.planar = 2;
        plan.tree.from_world = 0.4;
        plan.nearby = 1.0;
    }
    plan.options.reduction = (kt_reduction)(i % 3);
    plan.options.metric = i % 2 ? KT_METRIC_MASS : KT_METRIC_IDENTITY;
    return plan;
}

/* Off the manifold by up to `size`. */
static void disturb(const tangle *g, kt_random *random, double size, double *q, double *v) {
    double step[KT_TREE_NV];
    for (int i = 0; i < g->tree.nv; i++) {
        step[i] = kt_random_uniform(random, -size, size);
        v[i] = g->v[i] + kt_random_uniform(random, -size, size);
    }
    kt_position_add(g->tree.model, g->q, step, q);
}

/* ---- what a model tells of its loops -----------------------------------------------------------------------------
 */

static void compare_words(const pair *p, kt_worst *worst) {
    const kt_model *flat = p->g.tree.model;
    const kt_freedom a = kt_model_freedom(flat), b = kt_model_freedom(p->space);
    kt_worst_below(worst, a.tree != b.tree || a.equations != b.equations || a.rank != b.rank || a.minimal != b.minimal,
                   0.5, "freedoms: %d of %d equations independent, %d of %d in space", a.rank, a.equations, b.rank,
                   b.equations);
    const int groups = kt_loop_group_count(flat);
    kt_worst_near(worst, groups, kt_loop_group_count(p->space), 0.5, "groups");
    for (int i = 0; i < groups && i < kt_loop_group_count(p->space); i++) {
        const kt_loop_group c = kt_loop_group_at(flat, i), d = kt_loop_group_at(p->space, i);
        kt_worst_near(worst, c.equations, d.equations, 0.5, "equations of group %d", i);
        kt_worst_near(worst, c.rank, d.rank, 0.5, "rank of group %d", i);
        kt_worst_near(worst, c.coordinates, d.coordinates, 0.5, "coordinates of group %d", i);
    }
}

KT_TEST(counts_of_loops_in_a_plane_are_those_of_space) {
    static pair p;
    kt_random random = kt_random_of_test();
    kt_worst worst = kt_worst_make("freedoms and groups");
    int planar = 0, mixed = 0;
    for (int i = 0; i < 100; i++) {
        const tangle_plan plan = draw_plan(i);
        if (pair_grow(&p, &plan, &random)) {
            compare_words(&p, &worst);
            planar += strcmp(kt_model_plan(p.g.tree.model), "planar") == 0;
            mixed += strcmp(kt_model_plan(p.g.tree.model), "mixed") == 0;
            kt_worst_below(&worst, strcmp(kt_model_plan(p.space), "spatial") != 0, 0.5, "plan: spatial");
        }
        pair_free(&p);
    }
    kt_check_worst(&worst);
    kt_check_above("planar", planar, 75.0);
    kt_check_above("mixed", mixed, 10.0);
}

/* ---- equations ----------------------------------------------------------------------------------------------------
 */

typedef struct equations {
    double jacobian[TANGLE_ROWS * KT_TREE_NV], residual[TANGLE_ROWS], rate[TANGLE_ROWS], drift[TANGLE_ROWS];
} equations;

static bool ask(const kt_model *model, kt_data *data, double t, const double *q, const double *v, equations *x) {
    kt_error e = {0};
    return kt_tree_fine("equations",
                        kt_loop_equations(model, data, t, q, v, x->jacobian, x->residual, x->rate, x->drift, &e), &e);
}

/* Lengths along a loop are some ten metres, and rounding of each link moves all that it carries: 10 eps were measured.
 * Terms of b'' are such lengths times v^2. */
KT_TEST(equations_in_a_plane_are_those_of_space_row_by_row) {
    static pair p;
    static equations flat, space;
    kt_random random = kt_random_of_test();
    kt_worst slopes = kt_worst_make("A"), residuals = kt_worst_make("phi");
    kt_worst rates = kt_worst_make("phi_t"), drifts = kt_worst_make("b''");
    for (int i = 0; i < 100; i++) {
        const tangle_plan plan = draw_plan(i);
        if (pair_grow(&p, &plan, &random)) {
            double q[KT_TREE_NQ], v[KT_TREE_NV];
            disturb(&p.g, &random, 0.1, q, v);
            const int n = p.g.rows * p.g.tree.nv;
            if (ask(p.g.tree.model, p.g.tree.data, p.g.t, q, v, &flat) && ask(p.space, p.data, p.g.t, q, v, &space)) {
                const double size = fmax(1.0, kt_tree_largest(space.jacobian, n));
                const double most = fmax(1.0, kt_tree_largest(v, p.g.tree.nv));
                for (int k = 0; k < n; k++)
                    kt_worst_near(&slopes, flat.jacobian[k], space.jacobian[k], 100.0 * EPS * size, "%d", k);
                for (int k = 0; k < p.g.rows; k++) {
                    kt_worst_near(&residuals, flat.residual[k], space.residual[k], 100.0 * EPS * size, "%d", k);
                    kt_worst_near(&rates, flat.rate[k], space.rate[k], EPS * size, "%d", k);
                    kt_worst_near(&drifts, flat.drift[k], space.drift[k], 100.0 * EPS * size * most * most, "%d", k);
                }
            }
        }
        pair_free(&p);
    }
    kt_check_worst(&slopes);
    kt_check_worst(&residuals);
    kt_check_worst(&rates);
    kt_check_worst(&drifts);
}

/* ---- closing ------------------------------------------------------------------------------------------------------
 */

KT_TEST(projection_in_a_plane_is_that_of_space) {
    static pair p;
    kt_random random = kt_random_of_test();
    kt_worst positions = kt_worst_make("q"), velocities = kt_worst_make("v"), gaps = kt_worst_make("residuals");
    for (int i = 0; i < 90; i++) {
        const tangle_plan plan = draw_plan(i);
        if (pair_grow(&p, &plan, &random)) {
            double q[2][KT_TREE_NQ], v[2][KT_TREE_NV];
            kt_error e = {0};
            kt_residual r[2];
            disturb(&p.g, &random, 1e-3, q[0], v[0]);
            memcpy(q[1], q[0], sizeof q[0]);
            memcpy(v[1], v[0], sizeof v[0]);
            const bool fine =
                kt_tree_fine("residual", kt_loop_residual(p.g.tree.model, p.g.tree.data, p.g.t, q[0], v[0], &r[0], &e),
                             &e) &&
                kt_tree_fine("residual", kt_loop_residual(p.space, p.data, p.g.t, q[1], v[1], &r[1], &e), &e) &&
                kt_tree_fine("projects", kt_state_project(p.g.tree.model, p.g.tree.data, p.g.t, q[0], v[0], NULL, &e),
                             &e) &&
                kt_tree_fine("projects", kt_state_project(p.space, p.data, p.g.t, q[1], v[1], NULL, &e), &e);
            const double most = fmax(1.0, kt_tree_largest(v[1], p.g.tree.nv));
            for (int k = 0; k < p.g.tree.nq && fine; k++)
                kt_worst_near(&positions, q[0][k], q[1][k], 2e-13, "%d, q %d", i, k);
            for (int k = 0; k < p.g.tree.nv && fine; k++)
                kt_worst_near(&velocities, v[0][k], v[1][k], 2e-13 * most, "%d, v %d", i, k);
            kt_worst_near(&gaps, r[0].position, r[1].position, 1e-14, "%d", i);
            kt_worst_near(&gaps, r[0].velocity, r[1].velocity, 1e-13, "%d", i);
        }
        pair_free(&p);
    }
    kt_check_worst(&positions);
    kt_check_worst(&velocities);
    kt_check_worst(&gaps);
}

/* Two searches go the same way, but for rounding: 2e-15 was measured. */
KT_TEST(assembly_in_a_plane_is_that_of_space) {
    static pair p;
    kt_random random = kt_random_of_test();
    kt_worst positions = kt_worst_make("q"), velocities = kt_worst_make("v");
    int assembled = 0, held = 0;
    for (int i = 0; i < 60; i++) {
        tangle_plan plan = draw_plan(i);
        plan.loops = 2;
        if (pair_grow(&p, &plan, &random)) {
            double q[2][KT_TREE_NQ], v[2][KT_TREE_NV];
            kt_error e = {0};
            disturb(&p.g, &random, 0.02, q[0], v[0]);
            memcpy(q[1], q[0], sizeof q[0]);
            memcpy(v[1], v[0], sizeof v[0]);
            const int k0 = kt_random_int(&random, 0, p.g.tree.nv - 1); /* a joint that is held */
            p.g.tree.model->held[k0] = p.space->held[k0] = i % 2;
            const kt_status a = kt_state_assemble(p.g.tree.model, p.g.tree.data, p.g.t, q[0], v[0], &e);
            const kt_status b = kt_state_assemble(p.space, p.data, p.g.t, q[1], v[1], &e);
            kt_worst_below(&positions, a != b, 0.5, "%d: one can be assembled and the other not", i);
            assembled += a == KT_OK && b == KT_OK;
            held += i % 2 && a == KT_OK;
            const double most = fmax(1.0, kt_tree_largest(v[1], p.g.tree.nv));
            for (int k = 0; k < p.g.tree.nq && a == KT_OK && b == KT_OK; k++)
                kt_worst_near(&positions, q[0][k], q[1][k], 1e-13, "%d, q %d", i, k);
            for (int k = 0; k < p.g.tree.nv && a == KT_OK && b == KT_OK; k++)
                kt_worst_near(&velocities, v[0][k], v[1][k], 1e-13 * most, "%d, v %d", i, k);
        }
        pair_free(&p);
    }
    kt_check_worst(&positions);
    kt_check_worst(&velocities);
    kt_check_above("assembled", assembled, 50.0);
    kt_check_above("with a joint held", held, 20.0);
}

/* ---- reactions ----------------------------------------------------------------------------------------------------
 */

static double largest_of(const kt_wrench *w, int n) {
    double most = 0.0;
    for (int i = 0; i < n; i++)
        most = fmax(most, fmax(kt_vec3_norm(w[i].moment), kt_vec3_norm(w[i].force)));
    return most;
}

static double apart(const kt_wrench *a, const kt_wrench *b) {
    return fmax(kt_vec3_norm(kt_vec3_sub(a->moment, b->moment)), kt_vec3_norm(kt_vec3_sub(a->force, b->force)));
}

/* With what acts out of the plane. Errors of accelerations, times masses, are divided by the size of the equations'
 * last direction, which may be small: 2e-14 of the largest was measured. */
KT_TEST(reactions_in_a_plane_are_those_of_space) {
    static pair p;
    kt_random random = kt_random_of_test();
    kt_worst joints = kt_worst_make("joints"), loops = kt_worst_make("loops");
    double out = 0.0;
    for (int i = 0; i < 60; i++) {
        const tangle_plan plan = draw_plan(i);
        if (pair_grow(&p, &plan, &random)) {
            kt_wrench joint[2][KT_TREE_SLOTS], loop[2][TANGLE_LOOPS];
            const tangle *g = &p.g;
            kt_error e = {0};
            if (kt_tree_fine("reactions",
                             kt_reaction_evaluate(g->tree.model, g->tree.data, g->t, g->q, g->v, g->tau, g->external,
                                                  joint[0], loop[0], &e),
                             &e) &&
                kt_tree_fine(
                    "reactions",
                    kt_reaction_evaluate(p.space, p.data, g->t, g->q, g->v, g->tau, g->external, joint[1], loop[1], &e),
                    &e)) {
                const double size = fmax(largest_of(joint[1] + 1, g->tree.count - 1), largest_of(loop[1], g->loops));
                for (int k = 1; k < g->tree.count; k++) {
                    kt_worst_below(&joints, apart(&joint[0][k], &joint[1][k]), 1e-13 * size, "%d, joint %d", i, k);
                    out = fmax(out, fabs(kt_vec3_dot(joint[0][k].force, g->tree.normal)));
                }
                for (int k = 0; k < g->loops; k++)
                    kt_worst_below(&loops, apart(&loop[0][k], &loop[1][k]), 1e-13 * size, "%d, loop %d", i, k);
            }
        }
        pair_free(&p);
    }
    kt_check_worst(&joints);
    kt_check_worst(&loops);
    kt_check_above("some of it out of the plane", out, 1.0);
}

/* ---- what is planar -----------------------------------------------------------------------------------------------
 */

static const char *plan_of(linkage *l) {
    static char text[16] = "";
    text[0] = '\0';
    if (linkage_compile(l))
        (void)snprintf(text, sizeof text, "%s", kt_model_plan(l->model));
    linkage_free(l);
    return text;
}

/* A four-bar in the plane of x and y, closed at (2, 0, 0) of the coupler and the rocker's tip. */
static kt_loop *begin(linkage *l) {
    const four_bar f = four_bar_default();
    linkage_four_bar(l, &f);
    return &l->loop[0];
}

KT_TEST(loops_that_hold_more_than_the_plane_does_are_spatial) {
    static linkage l;
    (void)begin(&l);
    kt_check_text("revolute about the normal", plan_of(&l), "planar");
    begin(&l)->axis = kt_vec3_make(0.0, 1e-9, 1.0);
    kt_check_text("with an oblique axis", plan_of(&l), "spatial");
    kt_loop *loop = begin(&l);
    loop->between[0].at.z += 1e-9;
    kt_check_text("with one end higher", plan_of(&l), "spatial");
    loop = begin(&l);
    loop->between[1].rotation = kt_rotation_matrix(
        (kt_mat3){kt_vec3_make(1.0, 0.0, 0.0), kt_vec3_make(0.0, -1.0, 0.0), kt_vec3_make(0.0, 0.0, -1.0)});
    kt_check_text("with its axes opposed", plan_of(&l), "spatial");
    loop = begin(&l);
    loop->type = KT_LOOP_DISTANCE;
    loop->between[0].at.z += 0.3;
    kt_check_text("a rod from one height to another", plan_of(&l), "planar");
    loop = begin(&l);
    loop->type = KT_LOOP_SPHERICAL;
    loop->axis = kt_vec3_make(0.3, 0.2, 0.9);
    kt_check_text("spherical, whatever its axis", plan_of(&l), "planar");
    loop = begin(&l);
    loop->type = KT_LOOP_SCREW;
    loop->pitch = 0.1;
    kt_check_text("screw", plan_of(&l), "spatial");
}

/* One spatial body that is coupled makes all of them spatial; one that is not leaves them alone. */
KT_TEST(what_loops_connect_is_planar_together_or_not_at_all) {
    static linkage l;
    static const char *const plans[2] = {"mixed", "spatial"};
    for (int coupled = 0; coupled < 2; coupled++) {
        static kt_term terms[2];
        (void)begin(&l);
        kt_body *other =
            linkage_bar(&l, "other", NULL, kt_vec3_make(0.0, 0.0, 1.0), kt_vec3_make(0.0, 1.0, 0.0), 0.1, 0.0);
        other->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
        if (coupled) {
            kt_loop *gear = linkage_close(&l, "gear", KT_LOOP_COUPLING, NULL, kt_vec3_make(0.0, 0.0, 0.0), NULL,
                                          kt_vec3_make(0.0, 0.0, 0.0));
            terms[0] = (kt_term){.joint = "crank", .coefficient = 1.0};
            terms[1] = (kt_term){.joint = "other", .coefficient = 2.0};
            gear->terms = terms;
            gear->term_count = 2;
        }
        kt_check_text(coupled ? "a gear to another plane" : "another plane", plan_of(&l),
                      coupled ? plans[1] : "planar");
    }
}

/* ---- wrenches that are no numbers -------------------------------------------------------------------------------- */

/* Across the plane, where its recursions do not look: powers and reactions would be NaN, and said to be right. */
KT_TEST(wrench_across_the_plane_that_is_not_finite_is_refused) {
    static linkage l;
    const four_bar f = four_bar_default();
    linkage_four_bar(&l, &f);
    if (linkage_build(&l, 0.0)) {
        kt_wrench external[4], joints[4], loops[1];
        double a[3] = {7.0, 7.0, 7.0};
        kt_power power = {7.0, 7.0};
        kt_error error = {0};
        memset(external, 0, sizeof external);
        joints[1].force.z = loops[0].force.z = 7.0;
        external[2].force.z = (double)NAN;
        kt_check_text("plan", kt_model_plan(l.model), "planar");
        kt_check_equal_int("accelerations",
                           kt_acceleration_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, external, a, &error),
                           KT_ERROR_NOT_FINITE);
        kt_check_contains("where", error.where, kt_body_name(l.model, 2));
        kt_check_equal_int("powers",
                           kt_power_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, external, a, &power, &error),
                           KT_ERROR_NOT_FINITE);
        kt_check_equal_int("reactions",
                           kt_reaction_evaluate(l.model, l.data, 0.0, l.q, l.v, NULL, external, joints, loops, &error),
                           KT_ERROR_NOT_FINITE);
        kt_check_near("accelerations untouched", a[0], 7.0, 0.0);
        kt_check_near("powers untouched", power.supplied, 7.0, 0.0);
        kt_check_near("reactions untouched", joints[1].force.z + loops[0].force.z, 14.0, 0.0);
    }
    linkage_free(&l);
}

KT_TEST(power_that_overflows_is_refused) {
    static linkage l;
    kt_error error = {0};
    linkage_begin(&l);
    linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    if (linkage_compile(&l)) {
        const double v = 1e120, tau = 1e200;
        double a = 7.0;
        kt_power power = {7.0, 7.0};
        kt_check_equal_int("acceleration",
                           kt_acceleration_evaluate(l.model, l.data, 0.0, l.q, &v, &tau, NULL, &a, &error), KT_OK);
        a = 7.0;
        kt_check_equal_int("power", kt_power_evaluate(l.model, l.data, 0.5, l.q, &v, &tau, NULL, &a, &power, &error),
                           KT_ERROR_NOT_FINITE);
        kt_check_text("where", error.where, "t = 0.5 s");
        kt_check_contains("message", error.message, "a power overflows");
        kt_check_near("untouched", a + power.supplied, 14.0, 0.0);
    }
    linkage_free(&l);
}
