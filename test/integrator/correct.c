/* Corrections of the state at the end of a step of dop853. A mass on a spring passes a narrow dip or bump of a
 * potential, at random places. The oracle is the energy, which changes if a step misses a part of the force. */
#include "check.h"

#include "problems.h"

#include "integrator/integrator.h"

#include <math.h>

/* V = w x^2 / 2 + a exp(-(k (x - c))^2) */
typedef struct bump {
    double w, a, k, c;
    double begin;  /* of the present step */
    int earlier;   /* evaluations before its beginning */
    bool refuses;  /* a repetition is stopped */
    int corrected; /* steps before which the last one was repeated */
} bump;

/* An examination evaluates 12 stages, 3 of the dense output, and the defect. More evaluations repeat the step. */
enum { EXAMINATION = 16, RUNS = 300 };

static int force_of_bump(double t, const double *y, double *dydt, void *user) {
    bump *b = user;
    const double u = b->k * (y[0] - b->c);
    dydt[0] = y[1];
    dydt[1] = -b->w * y[0] + 2.0 * b->a * b->k * u * exp(-u * u);
    b->earlier += t < b->begin;
    return b->refuses && t < b->begin && b->earlier > EXAMINATION ? -1 : 0;
}

static double energy_of(const bump *b, const double *y) {
    const double u = b->k * (y[0] - b->c);
    return 0.5 * y[1] * y[1] + 0.5 * b->w * y[0] * y[0] + b->a * exp(-u * u);
}

static bump random_bump(kt_random *random) {
    const double a = exp(kt_random_uniform(random, log(0.001), log(0.1)));
    return (bump){.w = kt_random_uniform(random, 4.0, 12.0),
                  .a = kt_random_uniform(random, -1.0, 1.0) < 0.0 ? -a : a,
                  .k = kt_random_uniform(random, 4.0, 10.0),
                  .c = kt_random_uniform(random, -0.8, 0.8)};
}

static const double relative = 1e-9;

static kt_integrator *begin_bump(bump *b, double t, const double *y, double first_step) {
    kt_error error;
    kt_integrator_options options = tolerance(relative, relative);
    options.initial_step = first_step;
    const kt_integrator_callbacks callbacks = {force_of_bump, NULL, b};
    kt_integrator *it = integrator_make(kt_method_find("dop853"), 2, &options);
    is_ok("start", kt_integrator_start(it, t, y, &callbacks, &error), &error);
    return it;
}

/* Whether the last step from (t, y), before which a repetition was stopped, has the bits of the same step alone. */
static bool is_step_alone(const bump *b, const kt_integrator *it, double t, const double *y) {
    kt_error error;
    bump alone = *b;
    alone.refuses = false;
    kt_integrator *other = begin_bump(&alone, t, y, kt_integrator_time(it) - t);
    const bool same = is_ok("step", kt_integrator_step(other, HUGE_VAL, &error), &error) &&
                      kt_integrator_time(other) == kt_integrator_time(it) &&
                      same_bits(kt_integrator_state(other), kt_integrator_state(it), 2);
    integrator_free(other);
    return same;
}

/* The error of the energy after 5 s, in tolerances. NaN if a step fails, or if the time does not ascend. */
static double error_of_run(bump *b, bool corrects, int *other) {
    kt_error error;
    const double start[2] = {1.0, 0.0}, energy = energy_of(b, start);
    kt_integrator *it = begin_bump(b, 0.0, start, 0.0);
    it->corrects = corrects;
    b->corrected = 0;
    bool good = true;
    while (good && kt_integrator_time(it) < 5.0) {
        const double before[2] = {kt_integrator_state(it)[0], kt_integrator_state(it)[1]};
        b->begin = kt_integrator_time(it);
        b->earlier = 0;
        good = is_ok("step", kt_integrator_step(it, 5.0, &error), &error) && kt_integrator_time(it) > b->begin;
        b->corrected += b->earlier > EXAMINATION;
        if (b->refuses && b->earlier > EXAMINATION)
            *other += !is_step_alone(b, it, b->begin, before);
    }
    const double off = fabs(energy_of(b, kt_integrator_state(it)) - energy) / relative;
    integrator_free(it);
    return good ? off : (double)NAN;
}

/* The bound: of 1,800 runs (six seeds) with corrections, the worst is off by 405; without, by 58,700. */
KT_TEST(peaks_at_the_ends_of_steps_are_corrected) {
    kt_random random = kt_random_of_test();
    kt_worst with = kt_worst_make("corrected, tolerances");
    double without = 0.0;
    int corrected = 0, none = 0;
    for (int i = 0; i < RUNS; i++) {
        bump b = random_bump(&random);
        kt_worst_below(&with, error_of_run(&b, true, &none), 800.0, "run %d: k %g, a %g", i, b.k, b.a);
        corrected += b.corrected;
        without = fmax(without, error_of_run(&b, false, &none));
    }
    kt_check_worst(&with);
    kt_check_above("corrected steps", (double)corrected, 50.0);
    kt_check_above("worst without corrections, tolerances", without, 400.0);
}

/* The next step then begins with the old state. */
KT_TEST(a_repetition_that_fails_changes_nothing) {
    kt_random random = kt_random_of_test();
    int stopped = 0, other = 0, failed = 0;
    for (int i = 0; i < RUNS; i++) {
        bump b = random_bump(&random);
        b.refuses = true;
        failed += isnan(error_of_run(&b, true, &other));
        stopped += b.corrected;
    }
    kt_check_above("repetitions that were stopped", (double)stopped, 50.0);
    kt_check_equal_int("runs that failed", failed, 0);
    kt_check_equal_int("steps with other bits", other, 0);
}
