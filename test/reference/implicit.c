/* Implicit methods on bundled scenes: their cost, and their order with loops, with quaternions and with rolling. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "files/scene/collect.h"
#include "scene.h"

#include <math.h>
#include <string.h>

enum { MOST = 64 };

/* The state at the end of a run; *counts receives the counts of the run. */
static bool end_of(const kt_case *c, const char *method, double step, double tolerance, double duration, double *y,
                   kt_simulation_counts *counts) {
    kt_run run = c->scene.run;
    kt_error error;
    run.integrator = method;
    run.step = step;
    run.relative = run.absolute = tolerance;
    run.record = 0;
    kt_simulation *s = kt_test_simulation(c->model, &run, NULL);
    const bool fine = kt_fine(method, kt_simulation_advance(s, duration, &error), &error);
    memcpy(y, kt_simulation_positions(s), (size_t)kt_model_nq(c->model) * sizeof *y);
    memcpy(y + kt_model_nq(c->model), kt_simulation_velocities(s), (size_t)kt_model_nv(c->model) * sizeof *y);
    if (counts != NULL)
        *counts = kt_simulation_counts_of(s);
    return fine;
}

static double distance(const kt_case *c, const double *x, const double *y) {
    double worst = 0.0;
    for (int i = 0; i < kt_model_nq(c->model) + kt_model_nv(c->model); i++)
        worst = fmax(worst, fabs(x[i] - y[i]));
    return worst;
}

/* A scene, and the step with which an error of order 5 shows. */
static const struct {
    const char *scene;
    double step, duration;
} cases[] = {{"slider-crank", 0.01, 0.5},  /* a loop in the plane */
             {"stewart", 0.05, 0.5},       /* loops in space */
             {"bricard", 0.2, 1.0},        /* a loop of which one equation depends on the others */
             {"spinning-top", 0.02, 0.5},  /* a quaternion */
             {"rolling-disc", 0.1, 1.0},   /* non-holonomic equations */
             {"sleeve", 0.01, 0.2},        /* driven by a function of time */
             {"n-four-bar-2", 0.04, 0.8}}; /* a singular position is passed */

/* Errors with h and h / 2, at a time when the leading term of the error rules. */
static void check_order(const char *method, double factor, double least) {
    for (size_t i = 0; i < sizeof cases / sizeof cases[0]; i++) {
        double exact[MOST], y[MOST], error[2];
        kt_case c = kt_case_open(cases[i].scene);
        kt_need(end_of(&c, "dop853", 0.0, 1e-13, cases[i].duration, exact, NULL));
        for (int k = 0; k < 2; k++) {
            (void)end_of(&c, method, factor * cases[i].step / (1 << k), 0.0, cases[i].duration, y, NULL);
            error[k] = distance(&c, y, exact);
        }
        kt_note("%s, %s: errors %.2g, %.2g", method, cases[i].scene, error[0], error[1]);
        kt_check_above("order", log2(error[0] / error[1]), least);
    }
}

KT_TEST(radau5_has_its_order_with_loops_quaternions_and_rolling) { check_order("radau5", 1.0, 4.5); }

KT_TEST(rodas5p_has_its_order_with_loops_quaternions_and_rolling) { check_order("rodas5p", 1.0, 4.5); }

KT_TEST(one_step_methods_of_low_order_have_it_with_loops_quaternions_and_rolling) {
    check_order("crank-nicolson", 0.05, 1.9);
    check_order("implicit-euler", 0.0125, 0.95);
}

KT_TEST(multistep_methods_have_their_order_with_loops_quaternions_and_rolling) {
    check_order("bdf2", 0.05, 1.9);
    check_order("two-step", 0.05, 1.9);
    check_order("ab2", 0.05, 1.9);
    check_order("ab4", 0.1, 3.8);
}

/* The governor to 1e-6: an explicit method takes 14,700 steps at any tolerance. The measured error was 2e-6. The run
 * took 260 steps and rejected 18 tries. It took 3,200 evaluations and 214 Jacobians. */
KT_TEST(the_stiff_governor_takes_few_steps) {
    double exact[MOST], y[MOST];
    kt_simulation_counts counts = {0};
    kt_case c = kt_case_open("flyball-governor");
    kt_need(end_of(&c, "radau5", 0.0, 1e-12, 10.0, exact, NULL));
    kt_need(end_of(&c, "radau5", 0.0, 1e-6, 10.0, y, &counts));
    kt_note("%d steps, %d rejected, %d evaluations, %d Jacobians", (int)counts.steps, (int)counts.rejected,
            (int)counts.evaluations, (int)counts.jacobians);
    kt_check_below("error", distance(&c, y, exact), 1e-5);
    kt_check_below("evaluations", (double)counts.evaluations, 4000.0);
    kt_check_below("Jacobians", (double)counts.jacobians, 300.0);
}

/* If nothing is stiff, one Jacobian serves for long: loops in the plane and in space, quaternions. */
KT_TEST(a_jacobian_serves_for_many_steps_where_nothing_is_stiff) {
    static const char *const scenes[] = {"four-bar", "bricard", "spinning-top", "rolling-disc", "stewart"};
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        double y[MOST];
        kt_simulation_counts counts = {0};
        kt_case c = kt_case_open(scenes[i]);
        kt_need(end_of(&c, "radau5", 0.0, 1e-10, 1.0, y, &counts));
        kt_note("%s: %d steps, %d evaluations, %d Jacobians", scenes[i], (int)counts.steps, (int)counts.evaluations,
                (int)counts.jacobians);
        kt_check_below("Jacobians, over steps", (double)counts.jacobians / (double)counts.steps, 0.05);
        kt_check_below("evaluations, over steps", (double)counts.evaluations / (double)counts.steps, 11.0);
    }
}

/* ---- auto -------------------------------------------------------------------------------------------------------- */

/* Scenes in which a decay bounds the steps of dopri5, in the arm and the gear once they have come to rest. */
static const char *const stiff[] = {"fishing-rod", "five-bar", "flyball-governor", "landing-gear", "lugre",
                                    "servo-arm",   "shot"};

/* Scenes in which that is so at a coarse tolerance alone. */
static const char *const coarse[] = {"dc-motor", "parachute", "pid-arm"};

static bool is_among(const char *const *scenes, size_t count, const char *scene) {
    for (size_t i = 0; i < count; i++)
        if (strcmp(scene, scenes[i]) == 0)
            return true;
    return false;
}

static bool is_calm_scene(const char *name) {
    return !is_among(stiff, sizeof stiff / sizeof stiff[0], name) &&
           !is_among(coarse, sizeof coarse / sizeof coarse[0], name);
}

/* Each run takes equally long: the whole motion to 1e-3, half of it to 1e-6, and a tenth of it to 1e-9. */
static void check_that_it_stays(const char *scene) {
    static const double tolerances[] = {1e-3, 1e-6, 1e-9}, parts[] = {1.0, 0.5, 0.1};
    int differ = 0;
    uint64_t switches = 0;
    kt_case c = kt_case_open(scene);
    for (int k = 0; k < 3; k++) {
        static double y[2][16 * MOST];
        kt_simulation_counts counts = {0}, other = {0};
        const double duration = c.scene.run.duration * parts[k];
        differ += !end_of(&c, "auto", 0.0, tolerances[k], duration, y[0], &counts) ||
                  !end_of(&c, "dopri5", 0.0, tolerances[k], duration, y[1], &other) ||
                  counts.evaluations != other.evaluations ||
                  memcmp(y[0], y[1], (size_t)(kt_model_nq(c.model) + kt_model_nv(c.model)) * sizeof(double)) != 0;
        switches += counts.switches;
    }
    kt_check_equal_int(scene, differ, 0);
    kt_check_equal_int("switches", (long long)switches, 0);
}

/* Corners (friction, a slack tether) and fast oscillations do not pass for stiffness: all other scenes there are. */
KT_TEST(auto_never_leaves_dopri5_where_nothing_is_stiff) {
    int scenes = 0;
    for (int i = 0; kt_bundled(i) != NULL; i++)
        if (is_calm_scene(kt_bundled(i))) {
            check_that_it_stays(kt_bundled(i));
            scenes++;
        }
    kt_check_above("scenes", scenes, 40);
}

/* Evaluations of a whole run of auto to 1e-6 by those of dopri5, which were counted once, for they take long. */
KT_TEST(auto_goes_over_where_a_decay_bounds_the_steps) {
    static const struct {
        double dopri5, part; /* measured: 0.009, 0.016, 0.035, 0.92, 0.009, 0.973, 0.098 */
    } costs[] = {{278972, 0.03}, {183506, 0.04}, {88808, 0.06}, {944, 0.97},
                 {118364, 0.02}, {12134, 0.99},  {46626, 0.15}};
    for (size_t i = 0; i < sizeof stiff / sizeof stiff[0]; i++) {
        double y[MOST + MOST];
        kt_simulation_counts counts = {0};
        kt_case c = kt_case_open(stiff[i]);
        kt_need(end_of(&c, "auto", 0.0, 1e-6, c.scene.run.duration, y, &counts));
        kt_check_above(stiff[i], (double)counts.switches, 0.5);
        kt_check_below("evaluations, over those of dopri5", (double)counts.evaluations / costs[i].dopri5,
                       costs[i].part);
    }
}
