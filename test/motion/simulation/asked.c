/* Rejected and repeated pushes, works under equations of the caller's, runs with invalid options, and the names of the
 * options that a run chooses.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "scenes.h"

#include "kinetree/study.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

/* ---- pushes ------------------------------------------------------------------------------------------------------ */

KT_TEST(wrench_that_is_not_finite_anywhere_is_rejected) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
    double a[6];
    for (int i = 0; i < 6; i++) {
        kt_error error = {KT_OK, "", ""};
        double wrenches[2][6] = {{0.0}};
        wrenches[1][i] = i % 2 == 0 ? (double)NAN : HUGE_VAL;
        kt_wrench given[2] = {
            {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}},
            {{wrenches[1][0], wrenches[1][1], wrenches[1][2]}, {wrenches[1][3], wrenches[1][4], wrenches[1][5]}}};
        kt_check_equal_int("status", kt_simulation_set_wrenches(simulation, given, &error), KT_ERROR_NOT_FINITE);
        kt_check_text("where", error.where, "body 'block'");
        kt_check_text("message", error.message, "the wrench is not finite");
    }
    const kt_wrench force[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.0, 0.0, 0.0}, {4.0, 0.0, 0.0}}};
    kt_check_equal_int("a force", kt_simulation_set_wrenches(simulation, force, NULL), KT_OK);
    kt_check_equal_int("acceleration", kt_simulation_acceleration(simulation, a, NULL), KT_OK);
    kt_check_near("under it", a[0], 2.0, 4.0 * DBL_EPSILON);
    kt_check_equal_int("none", kt_simulation_set_wrenches(simulation, NULL, NULL), KT_OK);
    kt_check_equal_int("acceleration", kt_simulation_acceleration(simulation, a, NULL), KT_OK);
    kt_check_near("without", a[0], 0.0, 0.0);
}

/* Six evaluations a step of dopri5, whose last slope is the first of the next, and one more where that was in vain. */
static int evaluations_with(const kt_wrench *first, const kt_wrench *second) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FREE, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    const kt_run run = kt_run_fixed("dopri5", 0.5, 10.0);
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_error error;
    (void)kt_fine("wrenches", kt_simulation_set_wrenches(simulation, first, &error), &error);
    (void)kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
    const uint64_t before = kt_simulation_counts_of(simulation).evaluations;
    (void)kt_fine("wrenches", kt_simulation_set_wrenches(simulation, second, &error), &error);
    (void)kt_fine("step", kt_simulation_step(simulation, HUGE_VAL, &error), &error);
    const int count = (int)(kt_simulation_counts_of(simulation).evaluations - before);
    return count;
}

KT_TEST(push_that_is_set_again_alike_costs_nothing) {
    const kt_wrench one[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.0, 0.0, 0.0}, {4.0, 0.0, 0.0}}};
    const kt_wrench other[2] = {{{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}}, {{0.0, 0.0, 0.0}, {4.0, 1.0, 0.0}}};
    kt_check_equal_int("alike", evaluations_with(one, one), 6);
    kt_check_equal_int("another", evaluations_with(one, other), 7);
    kt_check_equal_int("none", evaluations_with(one, NULL), 7);
}

/* ---- works under equations of the caller's ------------------------------------------------------------------------
 */

/* NOLINTNEXTLINE(readability-non-const-parameter): the type is the library's */
static int push_alone(const kt_instant *at, double *rate, double *a, kt_error *error, void *user) {
    (void)rate;
    (void)error;
    (void)user;
    a[0] = at->tau[0] / kt_body_mass(at->model, 1);
    return 0;
}

/* A force of 3 N acts on 2 kg for 2 s from rest. The speed reaches 3 m/s, and the work is m v^2 / 2. The integrand is
 * linear in t, which rk4 has exactly. */
KT_TEST(works_are_kept_under_the_callers_equations) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 0.125, 2.0);
    kt_simulation_options options = kt_simulation_options_default();
    const double force = 3.0;
    kt_error error;
    run.record = KT_RECORD_BALANCE;
    options.acceleration = push_alone;
    kt_simulation *simulation = kt_test_simulation(model, &run, &options);
    (void)kt_fine("force", kt_simulation_set_torque(simulation, &force, &error), &error);
    kt_test_advance(simulation, 2.0);
    kt_check_near("supplied", kt_simulation_work(simulation).supplied, 9.0, 64.0 * DBL_EPSILON * 9.0);
    kt_check_near("dissipated", kt_simulation_work(simulation).dissipated, 0.0, 0.0);
}

KT_TEST(what_does_not_move_does_no_work) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_FIXED, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_fixed("rk4", 0.25, 1.0);
    run.record = KT_RECORD_BALANCE;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_test_advance(simulation, 1.0);
    kt_check_near("dissipated", kt_simulation_work(simulation).dissipated, 0.0, 0.0);
    kt_check_near("supplied", kt_simulation_work(simulation).supplied, 0.0, 0.0);
}

/* ---- what is asked for ------------------------------------------------------------------------------------------- */

static void check_run(kt_run run, const char *where, const char *message) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = NULL;
    kt_error error = {KT_OK, "", ""};
    kt_check_equal_int("status", kt_simulation_create(model, &run, NULL, &simulation, &error), KT_ERROR_ARGUMENT);
    kt_check_contains("where", error.where, where);
    kt_check_contains("message", error.message, message);
    kt_check_true("no simulation", simulation == NULL);
}

KT_TEST(numbers_of_a_run_that_make_no_sense_are_rejected) {
    kt_run run = kt_run_default();
    run.step = (double)NAN;
    check_run(run, "step", "nan s: must be above zero");
    run = kt_run_default();
    run.interval = -0.5;
    check_run(run, "interval", "-0.5 s: must be above zero");
    run.interval = 0.0;
    run.rho = -0.1;
    check_run(run, "rho", "-0.1: the spectral radius at infinity must be 0 to 1");
    run = kt_run_default();
    run.relative = -1.0;
    check_run(run, "tolerance", "-1 (relative), 1e-09 (absolute): must be finite and not negative");
    run.relative = run.absolute = 0.0;
    check_run(run, "tolerance", "one of them above zero");
}

/* Values below rounding, and next to each the smallest value that is not. */
KT_TEST(runs_that_could_never_end_are_rejected) {
    kt_run run = kt_run_default();
    run.duration = 5e-324;
    check_run(run, "duration", "4.94066e-324 s is too short");
    run.duration = 0.99e-280;
    check_run(run, "duration", "too short to be divided into steps and records");
    run.duration = 1.01e-280;
    kt_check_equal_int("1.01e-280 s", kt_run_check(&run, NULL), KT_OK);
    run.duration = 0.0;
    run.step = 5e-324;
    kt_check_equal_int("no step at all", kt_run_check(&run, NULL), KT_OK);
    run.duration = 10.0;
    run.step = 3.5e-14; /* 16 eps times 10 s = 3.553e-14 s */
    check_run(run, "step", "3.5e-14 s is lost in the rounding of times up to 10 s");
    run.step = 3.6e-14;
    kt_check_equal_int("a step of 3.6e-14 s", kt_run_check(&run, NULL), KT_OK);
    run.relative = 1e-30;
    kt_check_equal_int("no tolerance is read", kt_run_check(&run, NULL), KT_OK);
    run.step = 0.0;
    check_run(run, "tolerance", "1e-30 (relative) is below the rounding of numbers");
    run.relative = 2.2e-16;
    check_run(run, "tolerance", "take 2.3e-16 or more");
    run.relative = 2.3e-16;
    kt_check_equal_int("a tolerance of 2.3e-16", kt_run_check(&run, NULL), KT_OK);
    run.relative = 0.0;
    kt_check_equal_int("the absolute one alone", kt_run_check(&run, NULL), KT_OK);
    run.interval = 1.1e-15; /* 10 s / 2^53 = 1.110e-15 s */
    check_run(run, "interval", "more records than can be counted");
    run.interval = 1.2e-15;
    kt_check_equal_int("an interval of 1.2e-15 s", kt_run_check(&run, NULL), KT_OK);
}

/* A run of the least duration ends like any other, with all its records. */
KT_TEST(shortest_run_ends) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    lone.body.joint.velocity[0] = 1.0;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    run.duration = KT_DURATION_LEAST;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL);
    kt_kept *kept = kt_kept_empty(model);
    kt_test_run(simulation, kt_keep, kept);
    kt_check_equal_int("records", kept->count, 1001);
    kt_check_near("position, m", kept->state[1000][0], 1e-280, 1e-294);
}

/* |p|^2 within four roundings of one is as near as scaling would bring it: those bits stay
 * (simulation/simulation_step.c). */
KT_TEST(quaternions_within_four_roundings_start_with_their_bits) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_SPHERICAL, 2.0);
    kt_model *model = kt_scene_compile(&lone.description);
    kt_simulation *simulation = kt_test_simulation(model, NULL, NULL);
    const double w = 1.0 + 2.0 * DBL_EPSILON, rounding = sqrt(DBL_EPSILON); /* |p|^2 - 1: 4 and 5 eps */
    const double given[2][4] = {{w, 0.0, 0.0, 0.0}, {w, rounding, 0.0, 0.0}}, v[3] = {0.0, 0.0, 0.0};
    kt_error error;
    for (int k = 0; k < 2; k++) {
        kt_need_fine("set", kt_simulation_set_state(simulation, 0.0, given[k], v, &error), &error);
        const double *q = kt_simulation_positions(simulation);
        if (k == 0)
            kt_check_equal_bits("quaternion", q, given[k], 4);
        else
            kt_check_near("w", q[0], 1.0, 0.0);
    }
}

KT_TEST(run_without_a_method_has_the_bits_of_the_defaults_where_nothing_is_stiff) {
    kt_lone lone;
    kt_lone_make(&lone, KT_JOINT_PRISMATIC, 2.0);
    lone.body.joint.velocity[0] = 1.0;
    kt_model *model = kt_scene_compile(&lone.description);
    kt_run run = kt_run_default();
    const kt_run standard = kt_run_default();
    kt_error error;
    run.integrator = NULL;
    kt_simulation *simulation = kt_test_simulation(model, &run, NULL),
                  *other = kt_test_simulation(model, &standard, NULL);
    (void)kt_fine("step", kt_simulation_step(simulation, 1.0, &error), &error);
    (void)kt_fine("step", kt_simulation_step(other, 1.0, &error), &error);
    kt_check_equal_bits("q", kt_simulation_positions(simulation), kt_simulation_positions(other), 1);
    kt_check_equal_bits("t", &(double){kt_simulation_time(simulation)}, &(double){kt_simulation_time(other)}, 1);
    kt_simulation_free(NULL);
}

/* A chain of so many links in a plane. */
static kt_model *compile_chain(int links) {
    static kt_body bodies[KT_RUN_IMPLICIT_MOST + 1];
    static char names[KT_RUN_IMPLICIT_MOST + 1][8];
    for (int i = 0; i < links; i++) {
        bodies[i] = kt_body_default();
        snprintf(names[i], sizeof names[i], "b%d", i);
        bodies[i].name = names[i];
        bodies[i].parent = i > 0 ? names[i - 1] : NULL;
        bodies[i].joint.type = KT_JOINT_REVOLUTE;
        bodies[i].mass = 1.0;
        bodies[i].com = kt_vec3_make(1.0, 0.0, 0.0);
    }
    kt_description description = kt_description_of(bodies, links, NULL, 0, NULL, 0);
    return kt_scene_compile(&description);
}

static void check_default(const char *what, const kt_run *run, const kt_model *model, const char *method,
                          const char *reason) {
    kt_method storage;
    const char *why = kt_run_method_reason(run, model);
    kt_check_text(what, kt_run_method(run, model, &storage)->name, method);
    kt_check_text(what, why != NULL ? why : "", reason);
}

KT_TEST(default_method_is_auto_where_steps_are_adaptive_and_matrices_small) {
    kt_model *most = compile_chain(KT_RUN_IMPLICIT_MOST), *more = compile_chain(KT_RUN_IMPLICIT_MOST + 1);
    kt_run run = kt_run_default();
    check_default("that of kt_run_default", &run, most, "dopri5", "");
    run.integrator = NULL;
    check_default("100 coordinates", &run, most, "auto", "the default");
    check_default("101 coordinates", &run, more, "dopri5",
                  "the default above 100 velocity coordinates, for the size of matrices; if the motion is stiff, name "
                  "auto or radau5");
    check_default("the caller's equations", &run, NULL, "dopri5",
                  "the default where the equations of motion are the caller's");
    run.step = 0.01;
    check_default("a fixed step", &run, most, "dopri5", "the default with a fixed step");
    run.integrator = "rk4";
    check_default("a name", &run, more, "rk4", "");
}

/* The size of a simulation, to the byte: that of the method behind the default. */
KT_TEST(simulation_of_the_default_method_takes_the_memory_of_that) {
    kt_model *most = compile_chain(KT_RUN_IMPLICIT_MOST), *more = compile_chain(KT_RUN_IMPLICIT_MOST + 1);
    kt_simulation_options own = kt_simulation_options_default();
    kt_run run = kt_run_default(), named = kt_run_default();
    own.acceleration = push_alone;
    run.integrator = NULL;
    named.integrator = "auto";
    kt_check_equal_int("100", (long long)kt_simulation_size(most, &run, NULL),
                       (long long)kt_simulation_size(most, &named, NULL));
    named.integrator = "dopri5";
    const size_t explicit_size = kt_simulation_size(most, &named, NULL);
    kt_check_equal_int("kt_run_default", (long long)kt_simulation_size(most, NULL, NULL), (long long)explicit_size);
    kt_check_equal_int("101", (long long)kt_simulation_size(more, &run, NULL),
                       (long long)kt_simulation_size(more, &named, NULL));
    kt_check_equal_int("own equations", (long long)kt_simulation_size(most, &run, &own),
                       (long long)kt_simulation_size(most, &named, &own));
    const double square = (double)KT_RUN_IMPLICIT_MOST * KT_RUN_IMPLICIT_MOST * sizeof(double);
    kt_check_near("auto takes 14 matrices more",
                  (double)(kt_simulation_size(most, &run, NULL) - explicit_size) / square, 14.0,
                  0.5); /* measured: 13.6 */
    run.step = named.step = 0.01;
    kt_check_equal_int("a fixed step", (long long)kt_simulation_size(most, &run, NULL),
                       (long long)kt_simulation_size(most, &named, NULL));
}

KT_TEST(every_choice_of_a_run_has_its_name) {
#define CHECK_NAME(id, word) kt_check_text(#id, NAME_OF(id), #word);
#define CHECK_RECORD(id, bit, word) kt_check_text(#id, kt_record_name(bit), #word);
#define NAME_OF kt_formulation_name
    KT_FORMULATION_LIST(CHECK_NAME)
#undef NAME_OF
#define NAME_OF kt_reduction_name
    KT_REDUCTION_LIST(CHECK_NAME)
#undef NAME_OF
#define NAME_OF kt_metric_name
    KT_METRIC_LIST(CHECK_NAME)
#undef NAME_OF
#define NAME_OF kt_plan_name
    KT_PLAN_LIST(CHECK_NAME)
#undef NAME_OF
    KT_RECORD_LIST(CHECK_RECORD)
    kt_check_true("no formulation", kt_formulation_name(KT_FORMULATION_COUNT) == NULL);
    kt_check_true("none below", kt_formulation_name((kt_formulation)-1) == NULL);
    kt_check_true("no reduction", kt_reduction_name((kt_reduction)99) == NULL);
    kt_check_true("no metric", kt_metric_name((kt_metric)99) == NULL);
    kt_check_true("no plan", kt_plan_name(KT_PLAN_COUNT) == NULL);
    kt_check_true("none below", kt_plan_name((kt_plan)-1) == NULL);
    kt_check_true("no record", kt_record_name(3) == NULL);
}
