/* The other coordinate sets on the bundled scenes with loops: the results in which they equal the reduction, and their
 * failures. The reference is the reduction with projection, dop853 at 1e-13, which test/reference holds against the
 * published motions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "closure.h"
#include "formulation.h"
#include "reference/scene.h"

#include <math.h>
#include <string.h>

#define COUNT_OF(array) (sizeof(array) / sizeof(array)[0])

static const char *const loop_scenes[] = {
    "andrews",       "bicycle",     "bicycle-point", "bricard",      "four-bar", "hooke-shaft",  "n-four-bar-2",
    "n-four-bar-40", "peaucellier", "rolling-disc",  "scissor-lift", "skate",    "slider-crank", "slider-crank-spring",
    "stephenson",    "stewart",     "watt"};

enum { NUMBERS = 600, RECORDS = 20 };

/* ---- accelerations ----------------------------------------------------------------------------------------------- */

static void compare_at(const kt_model *model, const char *scene, const double *q, const double *v, double t,
                       kt_worst *worst) {
    static double a[NUMBERS], expected[NUMBERS];
    kt_error e = {0};
    kt_data *data = kt_test_data(model);
    double size = 1e-2; /* and closure errors of 1e-14 m, by gains of 1 / s */
    kt_need_fine("tree", kt_dynamics_forward(model, data, q, v, NULL, NULL, a, &e), &e);
    kt_need_fine("reduction", kt_acceleration_evaluate(model, data, t, q, v, NULL, NULL, expected, &e), &e);
    for (int i = 0; i < kt_model_nv(model); i++)
        size = fmax(size, fmax(fabs(a[i]), fabs(expected[i])));
    for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++) {
        const kt_constraint_formulation_options options =
            kt_constraint_formulation_options_default((kt_constraint_formulation_type)type, 0.1);
        kt_constraint_formulation *set = closure_set(model, &options);
        if (kt_fine(scene, kt_constraint_formulation_evaluate(set, data, t, q, v, NULL, NULL, NULL, a, &e), &e))
            for (int i = 0; i < kt_model_nv(model); i++)
                kt_worst_near(&worst[type], a[i], expected[i],
                              (type == KT_CONSTRAINT_FORMULATION_AUGMENTED ? 1e-9 : 1e-12) * size, "%s, %d", scene, i);
    }
}

/* At the start and 5% into the run; springs, motors, forces and driven loops included. */
KT_TEST(every_set_accelerates_every_bundled_scene_with_loops_as_the_reduction_does) {
    kt_worst worst[KT_CONSTRAINT_FORMULATION_COUNT];
    for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++)
        worst[type] = kt_worst_make(kt_constraint_formulation_name((kt_constraint_formulation_type)type));
    for (size_t i = 0; i < COUNT_OF(loop_scenes); i++) {
        kt_case c = kt_case_open(loop_scenes[i]);
        kt_simulation *simulation = kt_test_simulation(c.model, &c.scene.run, NULL);
        kt_check_above(loop_scenes[i], kt_loop_count(c.model), 1.0);
        for (int k = 0; k < 2; k++) {
            compare_at(c.model, loop_scenes[i], kt_simulation_positions(simulation),
                       kt_simulation_velocities(simulation), kt_simulation_time(simulation), worst);
            if (k == 0)
                kt_test_advance(simulation, 0.05 * c.scene.run.duration);
        }
    }
    for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++)
        kt_check_worst(&worst[type]);
}

/* ---- runs -------------------------------------------------------------------------------------------------------- */

/* Positions at RECORDS + 1 times, and how far others are from them. */
typedef struct motion {
    const kt_model *model;
    double q[RECORDS + 1][NUMBERS];
    bool known;
    double error, open, slip, energy, first; /* of a run that is compared; errors in rad and m */
    uint64_t evaluations;
    kt_status status;
} motion;

static int follow(const kt_record *record, void *user) {
    motion *m = user;
    double step[NUMBERS];
    if (!m->known) {
        memcpy(m->q[record->index], record->q, (size_t)kt_model_nq(m->model) * sizeof(double));
        return 0;
    }
    kt_position_subtract(m->model, record->q, m->q[record->index], step);
    for (int i = 0; i < kt_model_nv(m->model); i++)
        m->error = fmax(m->error, fabs(step[i]));
    if (record->index == 0)
        m->first = record->kinetic + record->potential;
    m->energy = fmax(m->energy, fabs(record->kinetic + record->potential - m->first));
    m->open = fmax(m->open, record->constraint.position);
    m->slip = fmax(m->slip, record->constraint.velocity);
    return 0;
}

/* One run: a method, and a set (or NULL for the reduction). */
static void go_as(const kt_case *c, const kt_absolute *absolute, motion *m, const char *method, double step,
                  double tolerance, kt_constraint_formulation *set) {
    kt_run run = c->scene.run;
    kt_simulation_options options = kt_simulation_options_default();
    kt_error e = {0};
    run.integrator = method;
    run.step = step;
    run.relative = run.absolute = tolerance;
    run.interval = run.duration / RECORDS;
    run.record = KT_RECORD_CONSTRAINT | KT_RECORD_ENERGY;
    run.marker_count = 0;
    options.max_steps = 300000;
    if (set)
        kt_constraint_formulation_use(set, &options);
    m->model = c->model;
    m->error = m->open = m->slip = m->energy = 0.0;
    m->evaluations = 0;
    const kt_either either = kt_either_begin(c->model, absolute, &run, &options);
    m->status = kt_either_run(either, follow, m, &e);
    m->evaluations = kt_simulation_counts_of(either.simulation).evaluations;
    if (m->status != KT_OK)
        kt_note("stopped: %s: %s", e.where, e.message);
    if (m->known)
        kt_note("%s %s: error %.1e, open %.1e, slip %.1e, energy %.1e, %llu evaluations", method,
                set ? "by the set" : "minimal", m->error, m->open, m->slip, m->energy,
                (unsigned long long)m->evaluations);
}

static void go(const kt_case *c, motion *m, const char *method, double step, double tolerance,
               kt_constraint_formulation *set) {
    go_as(c, NULL, m, method, step, tolerance, set);
}

/* Opens a scene and runs its reference. */
static kt_case open_scene(motion *m, const char *name, double duration) {
    kt_case c = kt_case_open(name);
    if (duration > 0.0)
        c.scene.run.duration = duration;
    m->known = false;
    go(&c, m, "dop853", 0.0, 1e-13, NULL);
    m->known = true;
    kt_need(kt_check_equal_int(name, m->status, KT_OK));
    return c;
}

/* The report of the set on its run. words: of the message, or NULL without a message. */
static void check_verdict(const kt_constraint_formulation *set, kt_status status, const char *words) {
    kt_error e = {0};
    kt_check_equal_int("verdict", kt_constraint_formulation_verdict(set, &e), status);
    if (words)
        kt_check_contains("verdict", e.message, words);
}

/* The gains do not change while the step is halved. */
KT_TEST(rk4_keeps_its_order_with_every_set) {
    static motion m;
    const kt_case c = open_scene(&m, "slider-crank", 1.0);
    for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++) {
        double error[2], energy[2];
        for (int k = 0; k < 2; k++) {
            const kt_constraint_formulation_options options =
                kt_constraint_formulation_options_default((kt_constraint_formulation_type)type, 4e-3);
            kt_constraint_formulation *set = closure_set(c.model, &options);
            go(&c, &m, "rk4", 1e-3 / (1 << k), 0.0, set);
            error[k] = m.error;
            energy[k] = m.energy;
            check_verdict(set, KT_OK, NULL);
        }
        kt_check_near(kt_constraint_formulation_name((kt_constraint_formulation_type)type), log2(energy[0] / energy[1]),
                      4.0, 0.3);
        kt_check_above("order of the positions", log2(error[0] / error[1]), 3.7); /* some signs change meanwhile */
    }
}

/* Positions close to rounding, velocities keep their drift; without any of it both drift. */
KT_TEST(force_projection_stays_closed_where_gauss_drifts) {
    static motion m;
    const kt_case c = open_scene(&m, "four-bar", 2.0);
    const kt_constraint_formulation_options gauss =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 0.01);
    const kt_constraint_formulation_options projection =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_PROJECTION, 0.01);
    kt_constraint_formulation *set = closure_set(c.model, &gauss);
    go(&c, &m, "rk4", 0.01, 0.0, set);
    const double drift = m.open;
    set = closure_set(c.model, &projection);
    go(&c, &m, "rk4", 0.01, 0.0, set);
    kt_check_below("open", m.open, 1e-13);
    kt_check_above("times that of gauss", drift / m.open, 1e9);
    kt_check_above("drift of the velocities", m.slip, 1e-4);
}

/* Twice the step that the gains allow. */
KT_TEST(a_set_whose_loops_came_apart_says_so) {
    static motion m;
    const kt_case c = open_scene(&m, "four-bar", 2.0);
    const kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, 0.1 * 0.01 / 5.0);
    kt_constraint_formulation *set = closure_set(c.model, &o);
    go(&c, &m, "rk4", 0.01, 0.0, set);
    check_verdict(set, KT_ERROR_CONSTRAINT, "came apart by");
}

/* All joints are loops then, and many of their equations redundant. */
KT_TEST(every_set_runs_the_absolute_formulation) {
    static motion m;
    const kt_case c = open_scene(&m, "slider-crank", 0.5);
    kt_absolute *absolute = kt_formulate(&c.scene.description, NULL, c.model, KT_FORMULATION_ABSOLUTE);
    if (absolute != NULL)
        for (int type = 0; type < KT_CONSTRAINT_FORMULATION_COUNT; type++) {
            const kt_constraint_formulation_options o =
                kt_constraint_formulation_options_default((kt_constraint_formulation_type)type, 1e-3);
            kt_constraint_formulation *set = closure_set(kt_absolute_model(absolute), &o);
            go_as(&c, absolute, &m, "rk4", 1e-3, 0.0, set);
            kt_check_equal_int(kt_constraint_formulation_name((kt_constraint_formulation_type)type), m.status, KT_OK);
            kt_check_below("error", m.error, 1.3e-5); /* 6.2e-6 was measured, by gauss */
        }
}

/* ---- what is expected to go wrong -------------------------------------------------------------------------------- */

/* Bricard's five equations have rank four, and off the manifold the fifth looks independent. A user who trusts it (as
 * textbooks do) has a structure of no freedom. Then rk4 stops or errs by more than a hundred times, and a verdict
 * reports it. */
KT_TEST(trusting_redundant_equations_wrecks_bricard) {
    static motion m;
    const kt_case c = open_scene(&m, "bricard", 2.0);
    kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, 0.01);
    kt_constraint_formulation *set = closure_set(c.model, &o);
    go(&c, &m, "rk4", 0.01, 0.0, set);
    const double right = m.error;
    kt_check_equal_int("run", m.status, KT_OK);
    kt_check_below("error", right, 1e-6);
    check_verdict(set, KT_OK, NULL);
    o.uncapped = true;
    set = closure_set(c.model, &o);
    go(&c, &m, "rk4", 0.01, 0.0, set);
    kt_check_true("stops, or errs", m.status != KT_OK || m.error > 100.0 * right);
    kt_check_above("evaluations that trusted it", (double)kt_constraint_formulation_statistics_of(set).trusted, 1.0);
    check_verdict(set, KT_ERROR_CONSTRAINT, "were trusted in");
}

/* Counts runs with dopri5 that do not arrive or arrive elsewhere, at tolerances from 1e-5 to 1e-9. A verdict reports
 * them. Also returns, for the other runs, the largest error over the reduction's. (The verdict warns of these only if a
 * stage came near to a crossing.) */
static int lost_ways(const kt_case *c, motion *m, const kt_constraint_formulation_options *o, double *worst) {
    int lost = 0;
    *worst = 0.0;
    /* NOLINTNEXTLINE(cert-flp30-c,clang-analyzer-security.FloatLoopCounter): each number is meant */
    for (double tolerance = 1e-5; tolerance > 5e-10; tolerance *= 0.1) {
        go(c, m, "dopri5", 0.0, tolerance, NULL);
        const double right = m->error;
        kt_constraint_formulation *set = closure_set(c->model, o);
        go(c, m, "dopri5", 0.0, tolerance, set);
        if (m->status != KT_OK || m->error > 0.3) {
            check_verdict(set, KT_ERROR_SINGULAR, "of a singular position");
            lost++;
        } else {
            *worst = fmax(*worst, m->error / right);
        }
    }
    return lost;
}

/* The N-four-bar passes positions in which its freedom jumps from 1 to 3. A closure error, however small, decides the
 * way on, at some 5 rad/s. Without gains it is lost at every tolerance. It is also lost with gains of 2 / s, although
 * the loops look closed to 1e-9. With 24 / s it passes most times: one of these five was lost, and rounding decides
 * which. */
KT_TEST(sets_that_drift_lose_the_n_four_bar_at_every_tolerance_and_stiff_gains_only_help) {
    static motion m;
    const kt_case c = open_scene(&m, "n-four-bar-2", 10.0);
    double worst;
    kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_GAUSS, 0.01);
    kt_check_equal_int("gauss: lost", lost_ways(&c, &m, &o, &worst), 5);
    kt_check_below("loops at the last tolerance", m.open, 1e-9);
    o = kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, 0.05);
    kt_check_equal_int("soft gains: lost", lost_ways(&c, &m, &o, &worst), 5);
    kt_check_below("loops at the last tolerance", m.open, 1e-9);
    o = kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_BAUMGARTE, 0.1 / 24.0);
    kt_check_below("stiff gains: lost", lost_ways(&c, &m, &o, &worst), 3.0);
    kt_check_below("errors over the reduction's", worst, 2.0);
}

/* Force projection crosses, being closed to rounding. The augmented set cannot keep its equations there, and reports
 * this. */
KT_TEST(force_projection_crosses_the_n_four_bar_and_the_augmented_set_loses_digits) {
    static motion m;
    const kt_case c = open_scene(&m, "n-four-bar-2", 10.0);
    kt_constraint_formulation_options o =
        kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_PROJECTION, 0.01);
    kt_constraint_formulation *set = closure_set(c.model, &o);
    go(&c, &m, "dopri5", 0.0, 1e-8, set);
    kt_check_below("projection: error", m.error, 5e-5);
    check_verdict(set, KT_ERROR_SINGULAR, "of a singular position");
    o = kt_constraint_formulation_options_default(KT_CONSTRAINT_FORMULATION_AUGMENTED, 0.01);
    set = closure_set(c.model, &o);
    go(&c, &m, "dopri5", 0.0, 1e-8, set);
    kt_check_above("augmented: equations left open", kt_constraint_formulation_statistics_of(set).residual, 0.5);
    check_verdict(set, KT_ERROR_SINGULAR, "still off by");
}
