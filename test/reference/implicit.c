/* Implicit methods on bundled scenes: their order with loops, with quaternions and with rolling, and what they cost. */
#include "scene.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { MOST = 64 };

/* The state at the end of a run; *counts what it took. */
static bool end_of(const kt_case *c, const char *method, double step, double tolerance, double duration, double *y,
                   kt_simulation_counts *counts) {
    kt_run run = c->scene.run;
    kt_error error;
    kt_simulation *s = NULL;
    run.integrator = method;
    run.step = step;
    run.relative = run.absolute = tolerance;
    run.record = 0;
    if (!kt_fine("made", kt_simulation_create(c->model, &run, NULL, &s, &error), &error))
        return false;
    const bool fine = kt_fine(method, kt_simulation_advance(s, duration, &error), &error);
    memcpy(y, kt_simulation_positions(s), (size_t)kt_model_nq(c->model) * sizeof *y);
    memcpy(y + kt_model_nq(c->model), kt_simulation_velocities(s), (size_t)kt_model_nv(c->model) * sizeof *y);
    if (counts != NULL)
        *counts = kt_simulation_counts_get(s);
    kt_simulation_free(s);
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
        kt_case c;
        if (kt_case_open(&c, cases[i].scene) && end_of(&c, "dop853", 0.0, 1e-13, cases[i].duration, exact, NULL)) {
            for (int k = 0; k < 2; k++) {
                (void)end_of(&c, method, factor * cases[i].step / (1 << k), 0.0, cases[i].duration, y, NULL);
                error[k] = distance(&c, y, exact);
            }
            kt_note("%s, %s: errors %.2g, %.2g", method, cases[i].scene, error[0], error[1]);
            kt_check_above("order", log2(error[0] / error[1]), least);
        }
        kt_case_close(&c);
    }
}

KT_TEST(radau5_has_its_order_with_loops_quaternions_and_rolling) { check_order("radau5", 1.0, 4.5); }

KT_TEST(rodas5p_has_its_order_with_loops_quaternions_and_rolling) { check_order("rodas5p", 1.0, 4.5); }

KT_TEST(multistep_methods_have_their_order_with_loops_quaternions_and_rolling) {
    check_order("bdf2", 0.025,
                1.9); /* with 0.05 a step ends next to the singular position: Newton's iteration fails, and says so */
    check_order("two-step", 0.05, 1.9);
    check_order("ab2", 0.05, 1.9);
    check_order("ab4", 0.1, 3.8);
}

/* The governor to 1e-6: an explicit method takes 14,700 steps, whatever its tolerance. Measured: 260 steps, 18 tries
 * rejected, 3,200 evaluations, 214 Jacobians, for an error of 2e-6. */
KT_TEST(the_stiff_governor_takes_few_steps) {
    double exact[MOST], y[MOST];
    kt_simulation_counts counts = {0};
    kt_case c;
    if (kt_case_open(&c, "flyball-governor") && end_of(&c, "radau5", 0.0, 1e-12, 10.0, exact, NULL) &&
        end_of(&c, "radau5", 0.0, 1e-6, 10.0, y, &counts)) {
        kt_note("%d steps, %d rejected, %d evaluations, %d Jacobians", (int)counts.steps, (int)counts.rejected,
                (int)counts.evaluations, (int)counts.jacobians);
        kt_check_below("error", distance(&c, y, exact), 1e-5);
        kt_check_below("evaluations", (double)counts.evaluations, 4000.0);
        kt_check_below("Jacobians", (double)counts.jacobians, 300.0);
    }
    kt_case_close(&c);
}

/* Where nothing is stiff, one Jacobian serves for long: loops in the plane and in space, quaternions. */
KT_TEST(a_jacobian_serves_for_many_steps_where_nothing_is_stiff) {
    static const char *const scenes[] = {"four-bar", "bricard", "spinning-top", "rolling-disc", "stewart"};
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        double y[MOST];
        kt_simulation_counts counts = {0};
        kt_case c;
        if (kt_case_open(&c, scenes[i]) && end_of(&c, "radau5", 0.0, 1e-10, 1.0, y, &counts)) {
            kt_note("%s: %d steps, %d evaluations, %d Jacobians", scenes[i], (int)counts.steps, (int)counts.evaluations,
                    (int)counts.jacobians);
            kt_check_below("Jacobians, over steps", (double)counts.jacobians / (double)counts.steps, 0.05);
            kt_check_below("evaluations, over steps", (double)counts.evaluations / (double)counts.steps, 11.0);
        }
        kt_case_close(&c);
    }
}

/* auto has the bits of dopri5 where nothing is stiff; on the double pendulum at every tolerance. */
KT_TEST(auto_never_leaves_dopri5_where_nothing_is_stiff) {
    static const char *const scenes[] = {"double-pendulum", "chain",        "arm7",     "andrews",    "bricard",
                                         "spinning-top",    "rolling-disc", "watt",     "skate",      "three-body",
                                         "slider-crank",    "cart-pole",    "humanoid", "hooke-shaft"};
    static const double tolerances[] = {1e-3, 1e-4, 1e-5, 1e-7, 1e-11};
    for (size_t i = 0; i < sizeof scenes / sizeof scenes[0]; i++) {
        kt_case c;
        int differ = 0;
        if (kt_case_open(&c, scenes[i]))
            for (int k = i == 0 ? 0 : 3; k < (i == 0 ? 5 : 4); k++) {
                double y[2][MOST + MOST];
                kt_simulation_counts counts = {0};
                const double duration = fmin(c.scene.run.duration, i == 0 ? 10.0 : 0.3);
                if (end_of(&c, "auto", 0.0, tolerances[k], duration, y[0], &counts) &&
                    end_of(&c, "dopri5", 0.0, tolerances[k], duration, y[1], NULL))
                    differ +=
                        counts.switches != 0 ||
                        memcmp(y[0], y[1], (size_t)(kt_model_nq(c.model) + kt_model_nv(c.model)) * sizeof(double)) != 0;
            }
        kt_check_equal_int(scenes[i], differ, 0);
        kt_case_close(&c);
    }
}
