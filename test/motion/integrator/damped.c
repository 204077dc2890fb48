/* Fixed implicit steps in cases in which the simplified Newton iteration fails: friction that sets in, a force out of
 * rest. The reference for a step is the solution of the same scalar equation by bisection. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <float.h>
#include <math.h>
#include <stdlib.h>

/* Dry friction, which holds the mass while the force is below it, on any scale that the steps see:
 *     v' = 2 sin(3 t) - 1.5 tanh(v / 1e-6) */
static int rubbed(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = 2.0 * sin(3.0 * t) - 1.5 * tanh(y[0] / 1e-6);
    return 0;
}

static double rubbed_at(double t, double v) {
    double slope;
    rubbed(t, &v, &slope, NULL);
    return slope;
}

/* The only v with v = base + part rubbed(t, v): the right side falls. */
static double solution_of(double t, double base, double part) {
    double low = base - 4.0 * part, high = base + 4.0 * part;
    for (int k = 0; k < 200; k++) {
        const double middle = 0.5 * (low + high);
        *(base + part * rubbed_at(t, middle) > middle ? &low : &high) = middle;
    }
    return 0.5 * (low + high);
}

static const kt_integrator_callbacks friction = {rubbed, NULL, NULL};

static kt_integrator *rubbed_begin(const char *name, double step) {
    kt_error error;
    kt_integrator *it = integrator_make(kt_method_find(name), 1, fixed_step(step));
    kt_fine(name, kt_integrator_start(it, 0.0, (double[]){0.0}, &friction, &error), &error);
    return it;
}

/* The equation of step k from y0 at t0 to t, with the state a step earlier. */
static double expected_of(const char *name, int k, double t0, double t, double h, double before, double y0) {
    if (name[0] == 'i')
        return solution_of(t, y0, h);
    if (name[0] == 'c')
        return solution_of(t, y0 + 0.5 * h * rubbed_at(t0, y0), 0.5 * h);
    return k > 0 ? solution_of(t, (4.0 * y0 - before) / 3.0, 2.0 / 3.0 * h) : (double)NAN;
}

/* Without damping every one of these runs ended with "Newton's iteration did not converge". Bound: the rounding of
 * speeds of up to 1, with which the mass slides. */
KT_TEST(friction_that_sets_in_within_a_step_is_solved) {
    static const char *const names[] = {"implicit-euler", "crank-nicolson", "bdf2"};
    static const double steps[] = {0.1, 0.02};
    for (int i = 0; i < 3; i++)
        for (int l = 0; l < 2; l++) {
            KT_WORST worst = kt_worst_make(names[i]);
            kt_integrator *it = rubbed_begin(names[i], steps[l]);
            double y[2] = {0.0, 0.0};
            for (int k = 0; k < 60; k++) {
                const double t0 = kt_integrator_time(it);
                if (!integrator_step(it, HUGE_VAL))
                    break;
                const double t = kt_integrator_time(it), found = kt_integrator_state(it)[0];
                const double expected = expected_of(names[i], k, t0, t, steps[l], y[0], y[1]);
                if (isfinite(expected))
                    kt_worst_near(&worst, found, expected, 0.5 * DBL_EPSILON, "t = %g", t);
                y[0] = y[1];
                y[1] = found;
            }
            kt_note("step %g: %d evaluations, %d Jacobians", steps[l], (int)kt_integrator_counts_of(it).evaluations,
                    (int)kt_integrator_counts_of(it).jacobians);
            kt_check_near("time", kt_integrator_time(it), 60.0 * steps[l], 1e-12);
        }
}

/* One integrator goes on; the other is put back, poisoned, before every step. */
KT_TEST(damped_steps_resume_to_the_last_bit) {
    static const char *const names[] = {"implicit-euler", "crank-nicolson", "bdf2", "two-step"};
    for (int i = 0; i < 4; i++) {
        kt_integrator *it = rubbed_begin(names[i], 0.05), *other = rubbed_begin(names[i], 0.05);
        double *history = malloc((kt_integrator_history_size(it) + 1) * sizeof *history);
        bool same = history != NULL;
        for (int k = 0; k < 40 && same; k++) {
            kt_error error;
            kt_integrator_memory memory;
            double y, before;
            kt_integrator_save(other, &memory, &y, &before, history);
            kt_integrator_poison(other, 0xa5);
            same = kt_fine("restored", kt_integrator_restore(other, &memory, &y, &before, history, &friction, &error),
                           &error) &&
                   integrator_step(it, HUGE_VAL) && integrator_step(other, HUGE_VAL) &&
                   same_bits(kt_integrator_state(it), kt_integrator_state(other), 1);
        }
        kt_check_equal_int(names[i], same, 1);
        free(history);
    }
}

/* The equation y' = -1000 y has a force of 1e5 from t = 10 on. The state decays to 1e-300 and less until then.
 * Corrections were weighed by the rounding of such a state. The corrections of a state of 100 never fell below it. */
static int pulsed(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = -1000.0 * y[0] + (t > 10.0 ? 1e5 : 0.0);
    return 0;
}

KT_TEST(a_force_out_of_rest_is_solved) {
    static const char *const names[] = {"implicit-euler", "crank-nicolson", "bdf2", "two-step", "radau5", "rodas5p"};
    for (int i = 0; i < 6; i++) {
        const bool rings = i == 1; /* by (1 - 31.25) / (1 + 31.25) a step */
        kt_integrator *it = integrator_start(kt_method_find(names[i]), 1, fixed_step(0.0625), pulsed, NULL, 0.0,
                                             (double[]){rings ? 0.0 : 1.0});
        kt_check_equal_int(names[i], integrate_to(it, 60.0), 1);
        kt_check_near(names[i], kt_integrator_state(it)[0], 100.0, 1e-11);
    }
}
