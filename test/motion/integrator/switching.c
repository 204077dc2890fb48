/* auto: dopri5 until the motion is stiff, radau5 while it is. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "check.h"

#include "interpose.h"
#include "problems.h"

#include "integrator/integrator.h"

#include <math.h>
#include <string.h>

static const kt_method *automatic(void) { return kt_method_find("auto"); }

/* ---- motions that are not stiff ---------------------------------------------------------------------------------- */

KT_TEST(motions_that_are_not_stiff_have_the_bits_of_dopri5) {
    static const double tolerances[] = {1e-3, 1e-6, 1e-10};
    const problem *const problems[] = {&problem_kepler, &problem_chirp};
    for (int i = 0; i < 6; i++) {
        const problem *p = problems[i % 2];
        const kt_integrator_options options = tolerance(tolerances[i / 2], tolerances[i / 2]);
        kt_integrator *it = integrator_begin(automatic(), p, options);
        kt_integrator *other = integrator_begin(kt_method_find("dopri5"), p, options);
        double between[2][PROBLEM_MAX];
        integrate_to(it, p->end);
        integrate_to(other, p->end);
        const double t = 0.3 * kt_integrator_time(it) + 0.7 * kt_integrator_previous_time(it);
        integrator_value(it, t, between[0]);
        integrator_value(other, t, between[1]);
        const kt_integrator_counts a = kt_integrator_counts_of(it), b = kt_integrator_counts_of(other);
        kt_check_equal_bits(p->name, kt_integrator_state(it), kt_integrator_state(other), p->n);
        kt_check_equal_bits("between", between[0], between[1], p->n);
        kt_check_equal_int("counts", memcmp(&a, &b, sizeof a), 0);
    }
}

/* ---- motions that are -------------------------------------------------------------------------------------------- */

static double rise(double t, double from, double to) {
    const double u = fmin(1.0, fmax(0.0, (t - from) / (to - from)));
    return u * u * (3.0 - 2.0 * u);
}

/* Prothero and Robinson's equation, with the solution y = sin t:
 *     y' = lambda(t) (y - sin t) + cos t
 * From t = 1 to t = 2 lambda goes from -1 to -1e5. It goes back between t = 3 and t = 4. */
static int stiff_for_a_while(double t, const double *y, double *dydt, void *user) {
    (void)user;
    dydt[0] = (-1.0 - 1e5 * (rise(t, 1.0, 2.0) - rise(t, 3.0, 4.0))) * (y[0] - sin(t)) + cos(t);
    return 0;
}

static kt_integrator *begin_with(const kt_method *method, double tol, const kt_integrator_callbacks *callbacks) {
    kt_error error;
    kt_integrator *it = integrator_make(method, 1, tolerance(tol, tol));
    kt_fine("start", kt_integrator_start(it, 0.0, (double[]){0.0}, callbacks, &error), &error);
    return it;
}

static kt_integrator *begin(double tol, const kt_integrator_callbacks *callbacks) {
    return begin_with(automatic(), tol, callbacks);
}

static const kt_integrator_callbacks for_a_while = {stiff_for_a_while, NULL, NULL};

/* What a run to t = 20 shows. */
typedef struct course {
    double end, between; /* the largest errors at the ends of steps, and within them */
    double first[3];     /* the end of the first step after so many switches */
    int steps_soft;      /* after t = 4, when nothing is stiff any more, until the second switch */
    kt_integrator_counts counts;
} course;

static course follow(const kt_method *method, double tol) {
    kt_integrator *it = begin_with(method, tol, &for_a_while);
    course c = {.first = {0.0, (double)NAN, (double)NAN}};
    while (kt_integrator_time(it) < 20.0 && integrator_step(it, 20.0)) {
        const double t0 = kt_integrator_previous_time(it), t1 = kt_integrator_time(it);
        c.counts = kt_integrator_counts_of(it);
        if (c.counts.switches < 3 && isnan(c.first[c.counts.switches]))
            c.first[c.counts.switches] = t1;
        c.steps_soft += c.counts.switches == 1 && t1 > 4.0;
        c.end = fmax(c.end, fabs(kt_integrator_state(it)[0] - sin(t1)));
        for (int part = 1; part < 4; part++) {
            const double t = t0 + 0.25 * part * (t1 - t0);
            double y = (double)NAN;
            integrator_value(it, t, &y);
            c.between = fmax(c.between, fabs(y - sin(t)));
        }
    }
    return c;
}

/* It goes over once the steps show that it is stiff, and comes back. Dense output is evaluated in every step, those at
 * the switches among them. It is not worse than that of radau5, whose order is lower within a stiff step. */
KT_TEST(it_goes_over_where_it_is_stiff_and_comes_back) {
    static const double tolerances[] = {1e-6, 1e-7, 1e-8};
    for (int i = 0; i < 3; i++) {
        const course c = follow(automatic(), tolerances[i]),
                     all_implicit = follow(kt_method_find("radau5"), tolerances[i]);
        kt_note("tolerance %g: %d steps, %d evaluations; over at %.6f, back at %.6f", tolerances[i],
                (int)c.counts.steps, (int)c.counts.evaluations, c.first[1], c.first[2]);
        kt_check_equal_int("switches", (long long)c.counts.switches, 2);
        kt_check_near("over, after t = 1", c.first[1], 1.1, 0.1);
        kt_check_above("back, after t = 4", c.first[2], 4.0);
        kt_check_near("steps of radau5 since", c.steps_soft, 10.0, 2.0);
        kt_check_below("error", c.end, 3.0 * tolerances[i]);
        kt_check_below("error between", c.between, 3.0 * all_implicit.between);
        kt_check_below("evaluations", (double)c.counts.evaluations, 3000.0); /* dopri5: 360,000 */
    }
}

/* The same at many tolerances. If the matrix hid that the force had gone, the force was stepped over at 6 of 161
 * tolerances. Errors were up to 9e6 tolerances. */
KT_TEST(a_stiff_force_that_fades_is_not_stepped_over) {
    enum { COUNT = 161 };
    static const char *const names[] = {"radau5", "auto", "rodas5p"};
    for (int k = 0; k < 3; k++) {
        KT_WORST off = kt_worst_make(names[k]);
        for (int i = 0; i < COUNT; i++) {
            const double tol = pow(10.0, -5.0 - 0.025 * i);
            kt_worst_below(&off, follow(kt_method_find(names[k]), tol).end / tol, 30.0, "tolerance %g", tol);
        }
    }
}

/* Van der Pol's oscillator, mu = 1e6 (radau.c has the source of y(2)). */
KT_TEST(a_stiff_oscillator_is_integrated_in_few_steps_and_no_allocation) {
    kt_integrator *it =
        integrator_start(automatic(), 2, tolerance(1e-6, 1e-6), van_der_pol, NULL, 0.0, (double[]){2.0, 0.0});
    kt_interpose_start();
    integrate_to(it, 2.0);
    kt_check_equal_int("allocations", kt_interpose_stop(), 0);
    const kt_integrator_counts counts = kt_integrator_counts_of(it);
    kt_note("%d steps, %d evaluations, %d switches", (int)counts.steps, (int)counts.evaluations, (int)counts.switches);
    kt_check_near("y1", kt_integrator_state(it)[0], 1.706167732170483, 1e-5);
    kt_check_below("evaluations", (double)counts.evaluations, 12000.0); /* radau5: 6,000; dopri5: 6e6 */
}

/* Oscillators of which the second and third are slower than the first, pulled along by a pendulum: positions, then
 * velocities. */
enum { RINGING = 3, MOVING = RINGING + 1 };

typedef struct ringing {
    double rate, damping; /* of the first, 1/s; over the critical one */
    int count;            /* of oscillators, up to RINGING */
} ringing;

static int ring(double t, const double *y, double *dydt, void *user) {
    const ringing *r = user;
    const int n = r->count + 1;
    const double *q = y, *v = y + n;
    memcpy(dydt, v, (size_t)n * sizeof *v);
    dydt[n] = -9.81 * sin(q[0]);
    for (int i = 1; i < n; i++) {
        const double w = r->rate / (0.3 + 0.7 * i);
        dydt[n + i] = -2.0 * r->damping * w * v[i] - w * w * (q[i] - 0.3 * sin(t) - 0.2 * q[0]);
    }
    return 0;
}

static kt_integrator_counts count_ringing(const kt_method *method, ringing *r, double tol, double *y) {
    kt_integrator_options options = tolerance(tol, tol);
    const size_t n = (size_t)r->count + 1;
    const double start[2 * MOVING] = {1.0, 0.2, 0.2, 0.2};
    options.positions = n;
    kt_integrator *it = integrator_start(method, 2 * n, options, ring, r, 0.0, start);
    integrate_to(it, 2000.0 / r->rate);
    const kt_integrator_counts counts = kt_integrator_counts_of(it);
    memcpy(y, kt_integrator_state(it), 2 * n * sizeof *y);
    return counts;
}

/* Rates at which the tolerance alone would allow ten times the step. At damping 0.05, at most 0.57 of the evaluations
 * were measured. At damping above 0.3, at most 0.08 were measured. */
KT_TEST(modes_that_ring_while_they_decay_are_found) {
    static const double dampings[] = {0.03, 0.05, 0.1, 0.2, 0.3, 0.5, 0.7, 0.9, 1.0};
    static const double tolerances[] = {1e-3, 1e-5, 1e-7}, rates[] = {5e3, 3e4, 1e6};
    KT_WORST apart = kt_worst_make("positions, apart, over the tolerance");
    for (size_t i = 0; i < 9; i++)
        for (int k = 0; k < 6; k++) {
            double y[2 * MOVING], z[2 * MOVING], off = 0.0;
            ringing r = {rates[k / 2], dampings[i], k % 2 == 0 ? 1 : RINGING};
            const double tol = tolerances[k / 2];
            const kt_integrator_counts counts = count_ringing(automatic(), &r, tol, y),
                                       other = count_ringing(kt_method_find("dopri5"), &r, tol, z);
            for (int j = 0; j <= r.count; j++)
                off = fmax(off, fabs(y[j] - z[j]));
            kt_note("damping %g, %d oscillators, tolerance %g: %d steps and %d switches, dopri5 %d steps", r.damping,
                    r.count, tol, (int)counts.steps, (int)counts.switches, (int)other.steps);
            kt_check_above("found", (double)counts.switches, 0.5);
            if (r.damping > 0.04) /* one that rings longer makes it come back at 1e-3, and go over again */
                kt_check_below("evaluations, over those of dopri5",
                               (double)counts.evaluations / (double)other.evaluations, 0.6);
            kt_worst_near(&apart, off / tol, 0.0, 0.1, "damping %g, tolerance %g", r.damping, tol);
        }
}

/* ---- what it remembers ------------------------------------------------------------------------------------------- */

/* From a checkpoint of any step, by an integrator whose scratch is garbage: the detection, too, goes on as it was. */
KT_TEST(a_checkpoint_of_any_step_is_resumed_to_the_last_bit) {
    kt_error error;
    kt_integrator *it = begin(1e-6, &for_a_while), *other = begin(1e-6, &for_a_while);
    double history[HISTORY_MAX], y, previous, here[3], there[3];
    int steps = 0, differ = 0;
    while (kt_integrator_time(it) < 10.0) {
        kt_integrator_memory memory;
        kt_integrator_save(it, &memory, &y, &previous, history);
        kt_fine("restore",
                kt_integrator_restore(other, &memory, &y, memory.has_previous ? &previous : NULL, history, &for_a_while,
                                      &error),
                &error);
        kt_integrator_poison(other, 0xA5);
        const double t = 0.5 * (memory.t + memory.previous_t);
        if (memory.has_previous) {
            integrator_value(it, t, &here[0]);
            integrator_value(other, t, &there[0]);
        } else {
            here[0] = there[0] = 0.0;
        }
        integrator_step(it, 10.0);
        integrator_step(other, 10.0);
        here[1] = kt_integrator_time(it), there[1] = kt_integrator_time(other);
        here[2] = kt_integrator_state(it)[0], there[2] = kt_integrator_state(other)[0];
        differ += !same_bits(here, there, 3) ||
                  kt_integrator_counts_of(it).switches != kt_integrator_counts_of(other).switches;
        steps++;
    }
    kt_check_equal_int("switches", (long long)kt_integrator_counts_of(it).switches, 2);
    kt_check_above("steps", steps, 60);
    kt_check_equal_int("steps that differ", differ, 0);
}

/* A right-hand side that stops on request. */
typedef struct stopper {
    int calls, stop_at;
} stopper;

static int stiff_and_stopped(double t, const double *y, double *dydt, void *user) {
    stopper *s = user;
    return s->calls++ == s->stop_at ? -1 : stiff_for_a_while(t, y, dydt, NULL);
}

/* Every step is stopped once, in its second evaluation, those at the switches, too. The last step can be interpolated
 * as before, and the motion goes on as if nothing had happened. */
KT_TEST(a_stopped_step_changes_nothing_at_a_switch_either) {
    kt_error error;
    stopper s = {0, -1}, free_running = {0, -1};
    const kt_integrator_callbacks stopped = {stiff_and_stopped, NULL, &s};
    const kt_integrator_callbacks undisturbed = {stiff_and_stopped, NULL, &free_running};
    kt_integrator *it = begin(1e-6, &stopped), *other = begin(1e-6, &undisturbed);
    int differ = 0, stops = 0;
    while (kt_integrator_time(it) < 10.0) {
        const double t = 0.5 * (kt_integrator_time(it) + kt_integrator_previous_time(it));
        double y[2] = {0.0, 0.0};
        s.stop_at = s.calls + 1;
        stops += kt_integrator_step(it, 10.0, &error) == KT_ERROR_CALLBACK;
        s.stop_at = -1;
        integrator_value(it, t, &y[0]);
        integrator_value(other, t, &y[1]);
        differ += !same_bits(&y[0], &y[1], 1);
        integrator_step(it, 10.0);
        integrator_step(other, 10.0);
        differ += !same_bits(kt_integrator_state(it), kt_integrator_state(other), 1);
    }
    kt_check_equal_int("switches", (long long)kt_integrator_counts_of(it).switches, 2);
    kt_check_above("stops", stops, 60);
    kt_check_equal_int("differences", differ, 0);
}

/* An input that changes now and then (kt_integrator_jump) does not make a stiff motion begin anew. */
KT_TEST(a_jump_leaves_a_stiff_motion_stiff) {
    kt_error error;
    kt_integrator *it = begin(1e-6, &for_a_while);
    integrate_to(it, 2.2);
    kt_check_equal_int("switches", (long long)kt_integrator_counts_of(it).switches, 1);
    for (int i = 1; i <= 20; i++) {
        double y = kt_integrator_state(it)[0];
        kt_fine("jump", kt_integrator_jump(it, &y, &error), &error);
        integrate_to(it, 2.2 + 0.01 * i);
    }
    const kt_integrator_counts counts = kt_integrator_counts_of(it);
    kt_check_equal_int("switches", (long long)counts.switches, 1);
    kt_check_below("steps", (double)counts.steps, 400.0); /* dopri5 takes 6000 for these 0.2 s */
    kt_check_near("state", kt_integrator_state(it)[0], sin(2.4), 1e-11);
    kt_fine("start", kt_integrator_start(it, 0.0, (double[]){0.0}, &for_a_while, &error), &error);
    kt_integrator *fresh = begin(1e-6, &for_a_while);
    integrate_to(it, 1.5);
    integrate_to(fresh, 1.5);
    kt_check_equal_bits("started again", kt_integrator_state(it), kt_integrator_state(fresh), 1);
}

/* With a fixed step there is no choice: dopri5. */
KT_TEST(fixed_steps_are_those_of_dopri5) {
    const kt_integrator_options options = fixed_step(0.05);
    kt_integrator *it = integrator_begin(automatic(), &problem_kepler, options);
    kt_integrator *other = integrator_begin(kt_method_find("dopri5"), &problem_kepler, options);
    integrate_to(it, 5.0);
    integrate_to(other, 5.0);
    kt_check_equal_bits("state", kt_integrator_state(it), kt_integrator_state(other), 4);
}

/* A spring of frequency w without damping, whose end moves slowly: q'' = w^2 (a sin t - q). On the slow motion
 * q = a sin t / (1 - 1 / w^2) the oscillation has no part, but dopri5 is stable only up to steps of 1 / w. */
static int follow_slowly(double t, const double *y, double *dydt, void *user) {
    const double w = 1e6;
    (void)user;
    dydt[0] = y[1];
    dydt[1] = w * w * (0.1 * sin(t) - y[0]);
    return 0;
}

KT_TEST(an_idle_oscillation_does_not_bound_the_steps) {
    static const double tolerances[] = {1e-6, 1e-9};
    const double a = 0.1 / (1.0 - 1e-12), start[] = {0.0, a};
    for (int i = 0; i < 2; i++) {
        kt_integrator_options options = tolerance(tolerances[i], tolerances[i]);
        options.positions = 1;
        kt_integrator *it = integrator_start(automatic(), 2, options, follow_slowly, NULL, 0.0, start);
        kt_integrator *other = integrator_start(kt_method_find("dopri5"), 2, options, follow_slowly, NULL, 0.0, start);
        integrate_to(it, 0.5);
        integrate_to(other, 0.05);
        kt_check_below("steps", (double)kt_integrator_counts_of(it).steps, 1e4);
        kt_check_above("steps of dopri5 for a tenth", (double)kt_integrator_counts_of(other).steps, 3e4);
        kt_check_near("position", kt_integrator_state(it)[0], a * sin(0.5), 1e-13);
    }
}
