/* Differential-algebraic baselines: orders of positions, velocities and multipliers, drift, and failures. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"
#include "mechanics/constraint/linkage.h"

#include "kinetree/joint.h"
#include "kinetree/study.h"

#include <math.h>
#include <string.h>

/* A point mass of 2 kg on two sliders, 1 m from the origin. Source: [MSD 7.13]. */
static void make_pendulum(linkage *l, double angle, double rate) {
    linkage_begin(l);
    kt_body *x = linkage_bar(l, "x", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    x->joint.type = KT_JOINT_PRISMATIC;
    x->joint.axis = kt_vec3_make(1.0, 0.0, 0.0);
    x->mass = 0.0;
    x->inertia = kt_sym3_make(0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    x->com = kt_vec3_make(0.0, 0.0, 0.0);
    x->joint.position[0] = sin(angle);
    x->joint.velocity[0] = rate * cos(angle);
    kt_body *z = linkage_bar(l, "z", "x", kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    z->joint.type = KT_JOINT_PRISMATIC;
    z->joint.axis = kt_vec3_make(0.0, 1.0, 0.0);
    z->mass = 2.0;
    z->inertia = x->inertia;
    z->com = x->com;
    z->joint.position[0] = -cos(angle);
    z->joint.velocity[0] = rate * sin(angle);
    kt_loop *loop =
        linkage_close(l, "rod", KT_LOOP_DISTANCE, NULL, kt_vec3_make(0.0, 0.0, 0.0), "z", kt_vec3_make(0.0, 0.0, 0.0));
    loop->function = kt_function_constant(1.0);
    linkage_build(l, 0.0);
}

/* A model, its state at the start, and the right one at the end: by the reduction and dop853 at the tolerance 1e-13. */
typedef struct motion {
    const kt_model *model;
    kt_data *data;
    double q[LINKAGE_NQ], v[LINKAGE_NQ], end_q[LINKAGE_NQ], end_v[LINKAGE_NQ], end_multiplier[6 * LINKAGE_LOOPS];
    double duration;
} motion;

/* The right multipliers are those of the right end by [MSD 8.54]. */
static bool find_end(motion *m, kt_dae *dae) {
    kt_run run = kt_run_default();
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_error e = {0};
    run.duration = m->duration;
    run.relative = run.absolute = 1e-13;
    options.method = kt_method_find("dop853");
    bool fine = kt_fine("reference", kt_simulation_create(m->model, &run, &options, &simulation, &e), &e) &&
                kt_fine("its start", kt_simulation_set_state(simulation, 0.0, m->q, m->v, &e), &e) &&
                kt_fine("its run", kt_simulation_advance(simulation, m->duration, &e), &e);
    if (fine) {
        memcpy(m->end_q, kt_simulation_positions(simulation), (size_t)kt_model_nq(m->model) * sizeof(double));
        memcpy(m->end_v, kt_simulation_velocities(simulation), (size_t)kt_model_nv(m->model) * sizeof(double));
        fine = kt_fine("its multipliers",
                       kt_dae_consistent(dae, m->duration, m->end_q, m->end_v, m->end_multiplier, &e), &e);
    }
    kt_simulation_free(simulation);
    return fine;
}

/* Errors at the end, the residual there, and the condition of the last step. */
typedef struct outcome {
    double position, velocity, multiplier, condition;
    kt_residual residual;
    kt_dae_counts counts;
} outcome;

static double largest(const double *a, const double *b, int n) {
    double most = 0.0;
    for (int i = 0; i < n; i++)
        most = fmax(most, fabs(a[i] - (b != NULL ? b[i] : 0.0)));
    return most;
}

static outcome compare(const motion *m, kt_dae *dae) {
    outcome o = {.condition = kt_dae_condition(dae), .counts = kt_dae_counts_of(dae)};
    double d[LINKAGE_NQ];
    kt_error e = {0};
    kt_position_subtract(m->model, kt_dae_positions(dae), m->end_q, d);
    o.position = largest(d, NULL, kt_model_nv(m->model));
    o.velocity = largest(kt_dae_velocities(dae), m->end_v, kt_model_nv(m->model));
    o.multiplier = largest(kt_dae_multipliers(dae), m->end_multiplier, kt_model_mobility(m->model).equations);
    (void)kt_fine("residual", kt_dae_residual(dae, &o.residual, &e), &e);
    return o;
}

/* One run of so many steps. */
static outcome run(motion *m, const kt_dae_options *options, int steps) {
    outcome o = {.position = (double)NAN, .velocity = (double)NAN, .multiplier = (double)NAN};
    kt_dae *dae = NULL;
    kt_error e = {0};
    kt_need_fine("baseline", kt_dae_create(m->model, options, &dae, &e), &e);
    bool fine = kt_fine("start", kt_dae_start(dae, 0.0, m->q, m->v, &e), &e) && find_end(m, dae);
    for (int i = 0; i < steps && fine; i++)
        fine = kt_fine("step", kt_dae_step(dae, m->duration / steps, &e), &e);
    if (fine)
        o = compare(m, dae);
    kt_dae_free(dae);
    return o;
}

static motion motion_of(const linkage *l, double duration) {
    motion m = {.model = l->model, .data = l->data, .duration = duration};
    memcpy(m.q, l->q, sizeof m.q);
    memcpy(m.v, l->v, sizeof m.v);
    return m;
}

/* ---- the pendulum ------------------------------------------------------------------------------------------------ */

/* Orders of q, v and lambda. The order of the drift is 0 if there is none. Radau IIA with three stages has the orders
 *
 *     index 3          5, 3, 2
 *     index 2 and ggl  5, 5, 3
 *     index 1          5
 *
 * Sources: [Hairer, Lubich, Roche 1989, table 2.3; Hairer and Wanner II, VII.4]. The multipliers of Crank-Nicolson with
 * index 3 do not converge at all: 0.
 */
typedef struct expected {
    kt_dae_type type;
    const char *method;
    double position, velocity, multiplier;
    bool drifts, slips;
} expected;

static const expected table[] = {
    {KT_DAE_INDEX3, "implicit-euler", 1.0, 1.0, 1.0, false, true},
    {KT_DAE_INDEX3, "crank-nicolson", 2.0, 2.0, 0.0, false, true},
    {KT_DAE_INDEX3, "bdf2", 2.0, 2.0, 2.0, false, true},
    {KT_DAE_INDEX3, "two-step", 2.0, 2.0, 2.0, false, true},
    {KT_DAE_INDEX3, "radau5", 5.0, 3.0, 2.0, false, true},
    {KT_DAE_INDEX2, "implicit-euler", 1.0, 1.0, 1.0, true, false},
    {KT_DAE_INDEX2, "crank-nicolson", 2.0, 2.0, 2.0, true, false},
    {KT_DAE_INDEX2, "bdf2", 2.0, 2.0, 2.0, true, false},
    {KT_DAE_INDEX2, "two-step", 2.0, 2.0, 2.0, true, false},
    {KT_DAE_INDEX2, "radau5", 5.0, 5.0, 3.0, true, false},
    {KT_DAE_INDEX1, "implicit-euler", 1.0, 1.0, 1.0, true, true},
    {KT_DAE_INDEX1, "crank-nicolson", 2.0, 2.0, 2.0, true, true},
    {KT_DAE_INDEX1, "bdf2", 2.0, 2.0, 2.0, true, true},
    {KT_DAE_INDEX1, "two-step", 2.0, 2.0, 2.0, true, true},
    {KT_DAE_INDEX1, "radau5", 5.0, 5.0, 5.0, true, true},
    {KT_DAE_GGL, "implicit-euler", 1.0, 1.0, 1.0, false, false},
    {KT_DAE_GGL, "crank-nicolson", 2.0, 2.0, 2.0, false, false},
    {KT_DAE_GGL, "bdf2", 2.0, 2.0, 2.0, false, false},
    {KT_DAE_GGL, "two-step", 2.0, 2.0, 2.0, false, false},
    {KT_DAE_GGL, "radau5", 5.0, 5.0, 3.0, false, false},
    {KT_DAE_STABILISED, "implicit-euler", 1.0, 1.0, 1.0, true, true},
    {KT_DAE_STABILISED, "crank-nicolson", 2.0, 2.0, 2.0, true, true},
    {KT_DAE_STABILISED, "bdf2", 2.0, 2.0, 2.0, true, true},
    {KT_DAE_STABILISED, "two-step", 2.0, 2.0, 2.0, true, true},
    {KT_DAE_STABILISED, "radau5", 5.0, 5.0, 5.0, true, true},
};

/* Over 1 s, orders are within 0.3 of their limits. The steps are 5 and 2.5 ms. For Radau IIA they are 20 and 10 ms,
 * since shorter ones meet rounding. */
typedef struct order_checks {
    kt_worst position, velocity, multiplier, drift, slip, closed, still;
} order_checks;

static void note_orders(order_checks *all, const expected *x, const outcome *coarse, const outcome *fine) {
    const char *type = kt_dae_name(x->type);
    kt_note("%s, %s: q %.1e, v %.1e, lambda %.1e; drift %.1e m, %.1e m/s; condition %.1e", type, x->method,
            fine->position, fine->velocity, fine->multiplier, fine->residual.position, fine->residual.velocity,
            fine->condition);
    kt_worst_near(&all->position, log2(coarse->position / fine->position), x->position, 0.3, "%s %s", type, x->method);
    kt_worst_near(&all->velocity, log2(coarse->velocity / fine->velocity), x->velocity, 0.3, "%s %s", type, x->method);
    kt_worst_near(&all->multiplier, log2(coarse->multiplier / fine->multiplier), x->multiplier, 0.3, "%s %s", type,
                  x->method);
    if (x->drifts)
        kt_worst_near(&all->drift, log2(coarse->residual.position / fine->residual.position), x->position, 0.3, "%s %s",
                      type, x->method);
    else
        kt_worst_below(&all->closed, fine->residual.position, 1e-15, "%s %s", type, x->method);
    if (x->slips)
        kt_worst_near(&all->slip, log2(coarse->residual.velocity / fine->residual.velocity), x->velocity, 0.3, "%s %s",
                      type, x->method);
    else
        kt_worst_below(&all->still, fine->residual.velocity, 1e-15, "%s %s", type, x->method);
}

KT_TEST(orders_of_positions_velocities_and_multipliers_are_those_of_the_index) {
    linkage l;
    order_checks all = {kt_worst_make("order of positions"),
                        kt_worst_make("order of velocities"),
                        kt_worst_make("order of multipliers"),
                        kt_worst_make("order of drift"),
                        kt_worst_make("order of slip"),
                        kt_worst_make("positions on the loop, m"),
                        kt_worst_make("velocities on the loop, m/s")};
    make_pendulum(&l, 1.0, 0.5);
    motion m = motion_of(&l, 1.0);
    for (size_t i = 0; i < sizeof table / sizeof *table; i++) {
        kt_dae_options options = kt_dae_options_default(table[i].type);
        options.method = kt_method_find(table[i].method);
        const int steps = options.method->order == 5 ? 50 : 200;
        const outcome coarse = run(&m, &options, steps), fine = run(&m, &options, 2 * steps);
        note_orders(&all, &table[i], &coarse, &fine);
    }
    kt_check_worst(&all.position);
    kt_check_worst(&all.velocity);
    kt_check_worst(&all.multiplier);
    kt_check_worst(&all.drift);
    kt_check_worst(&all.slip);
    kt_check_worst(&all.closed);
    kt_check_worst(&all.still);
}

/* O(h^-k) [Petzold, Loetstedt 1986]; ggl has the index 2. */
KT_TEST(condition_of_newtons_matrix_grows_with_the_index) {
    static const struct {
        kt_dae_type type;
        double power;
    } rows[] = {{KT_DAE_INDEX3, 3.0}, {KT_DAE_INDEX2, 2.0}, {KT_DAE_INDEX1, 1.0}, {KT_DAE_GGL, 2.0}};
    linkage l;
    make_pendulum(&l, 1.0, 0.5);
    motion m = motion_of(&l, 0.1);
    for (int i = 0; i < 4; i++) {
        kt_dae_options options = kt_dae_options_default(rows[i].type);
        options.method = kt_method_find("implicit-euler");
        const outcome coarse = run(&m, &options, 50), fine = run(&m, &options, 100);
        kt_note("%s: %.2e at 2 ms, %.2e at 1 ms", kt_dae_name(rows[i].type), coarse.condition, fine.condition);
        kt_check_near("power of 1/h", log2(fine.condition / coarse.condition), rows[i].power, 0.05);
    }
}

/* ---- what is infinitely fast ------------------------------------------------------------------------------------- */

/* A pendulum that starts with 1 mm/s along its rod, which no motion on the loop does. With index 3, this excites the
 * modes at infinity. A step multiplies them by the method's value there: -1 for Crank-Nicolson, -rho for [MSD 5.31]. */
static bool follow(const kt_method *method, double *lambda, int steps) {
    linkage l;
    kt_dae *dae = NULL;
    kt_error e = {0};
    kt_dae_options options = kt_dae_options_default(KT_DAE_INDEX3);
    options.method = method;
    make_pendulum(&l, 0.7, 0.0);
    bool fine = kt_fine("baseline", kt_dae_create(l.model, &options, &dae, &e), &e);
    if (fine) {
        l.v[1] -= 1e-3 * cos(0.7);
        l.v[0] += 1e-3 * sin(0.7);
        fine = kt_fine("start", kt_dae_start(dae, 0.0, l.q, l.v, &e), &e);
    }
    for (int i = 0; i < steps && fine; i++) {
        fine = kt_fine("step", kt_dae_step(dae, 1e-3, &e), &e);
        lambda[i] = kt_dae_multipliers(dae)[0];
    }
    kt_dae_free(dae);
    return fine;
}

/* The part of lambda that alternates from step to step. */
static double alternating(const double *lambda, int at) {
    return 0.25 * fabs(lambda[at - 1] - 2.0 * lambda[at] + lambda[at + 1]);
}

enum { STEPS = 302 };

KT_TEST(crank_nicolson_rings_on_index_3_for_ever) {
    static double lambda[STEPS];
    if (!follow(kt_method_find("crank-nicolson"), lambda, STEPS))
        return;
    kt_note("lambda, some 15 N, alternates by %.3g N after 10 steps, %.3g N after 300", alternating(lambda, 10),
            alternating(lambda, 300));
    kt_check_above("it does not decay", alternating(lambda, 300) / alternating(lambda, 10), 1.0);
}

/* The curvature of lambda remains, 5e-5 N. With rho = 0.9, 40 steps multiply by rho^40 = 0.015. After them, the
 * polynomial of the multiple root is still larger. */
KT_TEST(damping_at_infinity_ends_the_ringing) {
    static const struct {
        double rho;
        bool gone[2]; /* after 40 and 300 steps */
    } rows[] = {
        {0.0, {true, true}}, {0.3, {true, true}}, {0.6, {true, true}}, {0.9, {false, true}}, {1.0, {false, false}}};
    static double lambda[STEPS];
    for (int i = 0; i < 5; i++) {
        kt_method method = *kt_method_find("two-step");
        method.rho = rows[i].rho;
        if (!follow(&method, lambda, STEPS))
            continue;
        for (int late = 0; late < 2; late++) {
            const double rest = alternating(lambda, late ? 300 : 40);
            kt_note("rho %.1f after %d steps:", rows[i].rho, late ? 300 : 40);
            if (rows[i].gone[late])
                kt_check_below("lambda alternates by, N", rest, 2e-4);
            else
                kt_check_above("lambda alternates by, N", rest, late ? 1000.0 : 10.0);
        }
    }
}

/* ---- linkages ---------------------------------------------------------------------------------------------------- */

/* The orders of Radau IIA on a model, from so many steps and twice as many. An error that happens to cancel at the end
 * falls faster. */
static void check_linkage(motion *m, kt_dae_type type, int steps, const double *orders) {
    const kt_dae_options options = kt_dae_options_default(type);
    const outcome coarse = run(m, &options, steps), fine = run(m, &options, 2 * steps);
    kt_note("%s: q %.1e, v %.1e, lambda %.1e; condition %.1e", kt_dae_name(type), fine.position, fine.velocity,
            fine.multiplier, fine.condition);
    kt_check_above("order of positions", log2(coarse.position / fine.position), orders[0] - 0.4);
    kt_check_above("order of velocities", log2(coarse.velocity / fine.velocity), orders[1] - 0.4);
    kt_check_above("order of multipliers", log2(coarse.multiplier / fine.multiplier), orders[2] - 0.4);
}

static const double index3[] = {5.0, 3.0, 2.0}, index2[] = {5.0, 5.0, 3.0}, index1[] = {5.0, 5.0, 5.0};

/* The revolute loop has five equations in space, and two of them are independent. The baseline chooses them. */
KT_TEST(four_bars_of_redundant_equations_keep_the_orders) {
    four_bar f = four_bar_default();
    linkage l;
    f.rate = 2.0;
    linkage_four_bar(&l, &f);
    linkage_build(&l, 0.0);
    motion m = motion_of(&l, 0.5);
    check_linkage(&m, KT_DAE_INDEX3, 12, index3);
    check_linkage(&m, KT_DAE_INDEX2, 12, index2);
    check_linkage(&m, KT_DAE_INDEX1, 12, index1);
}

/* Bodies by positions and quaternions, joints as loops. */
KT_TEST(absolute_coordinates_keep_the_orders) {
    four_bar f = four_bar_default();
    linkage l;
    f.rate = 2.0;
    linkage_four_bar(&l, &f);
    for (int i = 0; i < l.description.body_count; i++) /* slender bars have none about themselves */
        l.body[i].inertia.xx = 0.1;
    linkage_build(&l, 0.0);
    kt_absolute *absolute = NULL;
    kt_error e = {0};
    kt_need_fine("absolute", kt_absolute_create(&l.description, &l.options, l.model, &absolute, &e), &e);
    motion m = {.model = kt_absolute_model(absolute), .duration = 0.1};
    kt_model_initial(m.model, m.q, m.v);
    kt_data *data = kt_test_data(m.model);
    kt_need_fine("assembly", kt_state_assemble(m.model, data, 0.0, m.q, m.v, &e), &e);
    check_linkage(&m, KT_DAE_INDEX3, 4, index3);
    check_linkage(&m, KT_DAE_GGL, 2, index2);
    kt_absolute_free(absolute);
}

/* A body on a ball joint tumbles while a rod holds its tip. Its axis of rotation turns, so the rate of the rotation
 * vector is not the angular velocity. */
KT_TEST(tumbling_bodies_keep_the_orders) {
    linkage l;
    linkage_begin(&l);
    kt_body *bar = linkage_bar(&l, "bar", NULL, kt_vec3_make(0.0, 0.0, 0.0), kt_vec3_make(1.0, 0.0, 0.0), 0.0, 0.0);
    bar->joint.type = KT_JOINT_SPHERICAL;
    bar->joint.position[0] = 1.0;
    bar->joint.velocity[0] = 3.0;
    bar->joint.velocity[1] = 2.0;
    bar->joint.velocity[2] = 0.0;
    bar->inertia = kt_sym3_make(0.1, 0.2, 0.25, 0.0, 0.0, 0.0);
    kt_loop *rod = linkage_close(&l, "rod", KT_LOOP_DISTANCE, NULL, kt_vec3_make(0.5, 2.0, 0.5), "bar",
                                 kt_vec3_make(1.0, 0.3, 0.0));
    rod->function = kt_function_constant(sqrt(0.25 + 1.7 * 1.7 + 0.25));
    linkage_build(&l, 0.0);
    motion m = motion_of(&l, 0.3);
    check_linkage(&m, KT_DAE_INDEX3, 8, index3);
    check_linkage(&m, KT_DAE_INDEX1, 8, index1);
    kt_dae_options bdf = kt_dae_options_default(KT_DAE_GGL);
    bdf.method = kt_method_find("bdf2");
    const outcome coarse = run(&m, &bdf, 100), fine = run(&m, &bdf, 200);
    kt_check_near("bdf2: order of positions", log2(coarse.position / fine.position), 2.0, 0.2);
}

/* The N-four-bar, N = 2 [A02], upright at 2 rad/s. Away from its singular position the baselines agree with the
 * reduction. At the singular position their equations lose a rank, and the chosen ones are dependent. The errors grow
 * where the reduction passes. */
KT_TEST(an_n_four_bar_is_followed_to_its_singular_position) {
    linkage l;
    linkage_windows(&l, 2, 0.3, 1.0, KT_LOOP_REVOLUTE);
    linkage_build(&l, 0.0);
    motion m = motion_of(&l, 0.2);
    check_linkage(&m, KT_DAE_GGL, 4, index2);
    linkage_windows(&l, 2, 1.57079632679489662, 0.0, KT_LOOP_REVOLUTE);
    kt_dae *dae = NULL;
    kt_error e = {0};
    const kt_dae_options options = kt_dae_options_default(KT_DAE_GGL);
    linkage_build(&l, 0.0);
    kt_need_fine("baseline", kt_dae_create(l.model, &options, &dae, &e), &e);
    kt_check_equal_int("at the position itself", kt_dae_start(dae, 0.0, l.q, l.v, &e), KT_ERROR_SINGULAR);
    kt_check_contains("message", e.message, "singular position");
    kt_check_true("there is no state", kt_dae_step(dae, 1e-3, &e) != KT_OK);
    kt_dae_free(dae);
}

/* ---- rejections -------------------------------------------------------------------------------------------------- */

static void check_rejection(const kt_model *model, kt_dae_options options, const char *where, const char *words) {
    kt_dae *dae = NULL;
    kt_error e = {0};
    kt_check_equal_int(words, kt_dae_create(model, &options, &dae, &e), KT_ERROR_ARGUMENT);
    kt_check_text("where", e.where, where);
    kt_check_contains("message", e.message, words);
    kt_check_true("no baseline", dae == NULL);
}

KT_TEST(baselines_say_what_is_wrong_with_their_options) {
    linkage l;
    make_pendulum(&l, 1.0, 0.5);
    kt_dae_options o = kt_dae_options_default(KT_DAE_STABILISED);
    o.alpha = -1.0;
    check_rejection(l.model, o, "alpha, beta", "zero or more");
    o = kt_dae_options_default(KT_DAE_COUNT);
    check_rejection(l.model, o, "type", "no differential-algebraic baseline");
    o = kt_dae_options_default(KT_DAE_INDEX3);
    o.method = kt_method_find("rk4");
    check_rejection(l.model, o, "method", "take implicit-euler, crank-nicolson, bdf2, two-step or radau5");
    o.method = kt_method_find("rodas5p");
    check_rejection(l.model, o, "method", "rodas5p");
    kt_check_true("no name", kt_dae_name(KT_DAE_COUNT) == NULL);
    kt_check_true("no condition", isnan(kt_dae_condition(NULL)));
}

/* A step of twenty times the period cannot be solved. The previous state stays. */
KT_TEST(a_step_that_fails_leaves_the_state) {
    linkage l;
    kt_dae *dae = NULL;
    kt_error e = {0};
    const kt_dae_options options = kt_dae_options_default(KT_DAE_INDEX3);
    make_pendulum(&l, 1.0, 9.0);
    kt_need_fine("baseline", kt_dae_create(l.model, &options, &dae, &e), &e);
    kt_need_fine("start", kt_dae_start(dae, 0.0, l.q, l.v, &e), &e);
    kt_check_true("fails", kt_dae_step(dae, 40.0, &e) != KT_OK);
    kt_check_contains("where", e.where, "t = 0 s");
    kt_check_equal_bits("positions", kt_dae_positions(dae), l.q, 2);
    kt_check_equal_bits("velocities", kt_dae_velocities(dae), l.v, 2);
    kt_check_true("time", kt_dae_time(dae) == 0.0);
    kt_dae_free(dae);
}
