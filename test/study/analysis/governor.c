/* The stiff flyball governor (IFToMM A05). The tests check the rates of its published eigenvalues and the steps at
 * which its runs blow up. They also count the cost of a stabilised method. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "reference/scene.h"

#include "kinetree/analysis.h"
#include "kinetree/stability.h"

#include <math.h>

typedef struct governor {
    kt_case c;
    kt_table table;
    int shaft, slider, right;
} governor;

static governor governor_open(void) {
    const kt_case c = kt_case_open("flyball-governor");
    const kt_table table = kt_table_open("A05_flyball_governor", "phi_rad s_m alpha_rad phidot sdot alphadot");
    return (governor){c, table, kt_case_q(&c, "shaft"), kt_case_q(&c, "slider"), kt_case_q(&c, "right")};
}

/* Largest error against the table (angles, height, rates; all nq = nv here) up to `duration`; HUGE_VAL where the run
 * fails or has gone astray. */
static double run_error(const governor *g, const kt_run *run, kt_simulation_counts *counts) {
    kt_error error = {0};
    double worst = 0.0;
    kt_simulation *simulation = kt_test_simulation(g->c.model, run, NULL);
    for (size_t i = 0; i < g->table.rows && g->table.t[i] <= run->duration && worst < 1.0; i++) {
        const double t = g->table.t[i], *row = g->table.value + i * g->table.columns;
        if (t > kt_simulation_time(simulation) && kt_simulation_advance(simulation, t, &error) != KT_OK) {
            worst = HUGE_VAL;
            break;
        }
        const double *q = kt_simulation_positions(simulation), *v = kt_simulation_velocities(simulation);
        const int at[3] = {g->shaft, g->slider, g->right};
        for (int k = 0; k < 3; k++)
            worst = fmax(worst, fmax(fabs(q[at[k]] - row[k]), fabs(v[at[k]] - row[3 + k])));
    }
    *counts = kt_simulation_counts_of(simulation);
    return worst;
}

static kt_run fixed_run(const char *integrator, double step, double duration) {
    kt_run run = kt_run_default();
    run.integrator = integrator;
    run.step = step;
    run.duration = duration;
    return run;
}

/* ---- the fastest modes ------------------------------------------------------------------------------------------- */

/* Published at t = 0 (4 decimals): `-8117.2033, -20.0507, +-7.346i`. The shaft's angle enters nothing: two zeros. */
KT_TEST(eigenvalues_at_the_start_are_the_published_ones) {
    const governor g = governor_open();
    kt_error error = {0};
    kt_spectrum *spectrum = kt_test_spectrum(g.c.model, 1);
    kt_need_fine("along", kt_spectrum_along(spectrum, &g.c.scene.run, &error), &error);
    static const kt_complex published[] = {{-8117.2033, 0.0}, {-20.0507, 0.0}, {-0.0001, 7.346}};
    KT_WORST worst = kt_worst_make("lambda");
    for (int k = 0; k < 3; k++) {
        double nearest = HUGE_VAL;
        for (int i = 0; i < kt_spectrum_count(spectrum); i++) {
            const kt_mode mode = kt_spectrum_at(spectrum, i).mode;
            nearest = fmin(nearest, hypot(mode.real - published[k].re, mode.imaginary - published[k].im));
        }
        kt_worst_below(&worst, nearest, k == 2 ? 5e-4 : 5e-5, "%g + %gi", published[k].re, published[k].im);
    }
    const kt_spectrum_mode fastest = kt_spectrum_at(spectrum, kt_spectrum_fastest(spectrum));
    kt_check_near("in it the slider moves", fastest.moves[kt_case_v(&g.c, "slider")], 1.0, 1e-12);
    kt_check_near("the arms alike", fastest.moves[kt_case_v(&g.c, "left")], fastest.moves[kt_case_v(&g.c, "right")],
                  1e-13); /* measured: 3e-15 */
    kt_check_below("not the shaft", fastest.moves[kt_case_v(&g.c, "shaft")], 1e-3);
}

/* ---- where runs blow up ------------------------------------------------------------------------------------------ */

/* Whether the run leaves the motion: not by its errors of truncation, below 1e-3 at these steps, but by a tenth. */
static bool blows_up(const governor *g, const char *integrator, double step, double duration) {
    const kt_run run = fixed_run(integrator, step, duration);
    kt_simulation_counts counts;
    return !(run_error(g, &run, &counts) < 0.1);
}

KT_TEST(the_governor_blows_up_within_three_tenths_of_the_predicted_step) {
    static const char *const methods[] = {"euler", "heun", "kutta3", "rk4", "dopri5", "tsit5", "dop853"};
    const governor g = governor_open();
    kt_error error = {0};
    kt_run run = kt_run_default();
    run.duration = 2.0;
    kt_spectrum *spectrum = kt_test_spectrum(g.c.model, KT_SPECTRUM_SAMPLES);
    kt_need_fine("along", kt_spectrum_along(spectrum, &run, &error), &error);
    KT_WORST worst = kt_worst_make("step of blow-up over the predicted one");
    for (int i = 0; i < 7; i++) {
        const kt_step_limit limit = kt_spectrum_limit(spectrum, kt_method_find(methods[i]), run.duration, 0.0);
        double low = 0.5 * limit.step, high = 2.0 * limit.step;
        for (int k = 0; k < 8; k++) {
            const double middle = sqrt(low * high);
            *(blows_up(&g, methods[i], middle, run.duration) ? &high : &low) = middle;
        }
        kt_worst_near(&worst, sqrt(low * high) / limit.step, 1.0, 0.3, "%s at %g s", methods[i], limit.step);
    }
}

/* ---- what a stabilised method costs ------------------------------------------------------------------------------ */

/* Evaluations and errors over the whole run. The stabilised methods take their records from the dense output. The
 * method rkc2 has order two and follows a swing of 7.3 rad/s over 73 rad. The method rk4 runs with steps of 1e-4 s, and
 * at its limit.
 *
 * | method | evaluations  | error |
 * | rk4    | 400000       | 3e-10 |
 * | rk4    | 121000       | 2e-7  |
 * | rkc2   | 8000         | 6e-2  |
 * | rkc2   | 16600        | 3e-3  |
 * | rkc2   | 53000        | 9e-5  |
 * | rkc2   | 120000       | 2e-5  |
 * | rkc4   | 36000        | 3e-4  |
 * | rkc4   | 40000        | 5e-5  |
 * | rkc4   | 52000        | 5e-6  |
 * | rkc4   | 69000        | 5e-7  |
 * | rkc4   | 62000 (0.01 s) | 3e-7 | */
KT_TEST(stabilised_methods_hold_the_table_with_a_fifth_of_the_evaluations_of_rk4_at_1e_4) {
    static const struct {
        const char *method;
        double step, tolerance, error, factor;
    } cases[] = {{"rkc2", 0.0, 1e-6, 3e-3, 20.0},
                 {"rkc2", 0.0, 1e-8, 1e-4, 5.0},
                 {"rkc4", 0.0, 1e-6, 1e-4, 8.0},
                 {"rkc4", 0.01, 0.0, 1e-6, 5.0}};
    const governor g = governor_open();
    kt_simulation_counts rk4, counts;
    const kt_run fixed = fixed_run("rk4", 1e-4, 10.0);
    kt_check_below("error of rk4", run_error(&g, &fixed, &rk4), 1e-9);
    for (int i = 0; i < 4; i++) {
        kt_run run = fixed_run(cases[i].method, cases[i].step, 10.0);
        run.relative = run.absolute = cases[i].tolerance;
        kt_check_below(cases[i].method, run_error(&g, &run, &counts), cases[i].error);
        kt_note("%llu evaluations", (unsigned long long)counts.evaluations);
        kt_check_above("rk4's evaluations over them", (double)rk4.evaluations / (double)counts.evaluations,
                       cases[i].factor);
    }
}
