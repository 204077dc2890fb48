/* Warns once, while the run proceeds, if adaptive steps are so short that the run takes many of them.
 *
 * After every BETWEEN steps the pace of the last WINDOW steps is compared with the rest of the run. If more than MANY
 * steps are left, the warning gives the length of steps, the expected time and the cause. The cause is one of these:
 * functions of time at whose breakpoints steps end, the fastest mode of the mechanism, or a tolerance near rounding. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"
#include "subcommands/stability.h"

#include <math.h>
#include <stdio.h>

enum { BETWEEN = 2000, WINDOW = 5, MANY = 1000000, COORDINATES_MOST = 60 };

/* Steps of at least this part of 1 / rate resolve the mode. Explicit methods at usual tolerances take from 0.02 to
 * 3. */
static const double resolved = 3e-3;
/* If more than this part of all steps ends at breakpoints, the breakpoints are the cause. */
static const double often = 0.1;
/* Tolerances below this are near rounding. */
static const double tight = 1e-11;

/* Writes a number of seconds in words. */
static void write_time(double seconds, char *text, size_t size) {
    if (seconds < 120.0)
        (void)snprintf(text, size, "%.0f seconds", seconds);
    else if (seconds < 7200.0)
        (void)snprintf(text, size, "%.0f minutes", seconds / 60.0);
    else if (seconds < 172800.0)
        (void)snprintf(text, size, "%.0f hours", seconds / 3600.0);
    else
        (void)snprintf(text, size, "%.3g days", seconds / 86400.0);
}

/* Describes the fastest mode in the present state, in words. Returns its rate, 1/s; 0: no mode was found. */
static double describe_fastest_mode(const kt_outcome *outcome, char *text, size_t size, bool *decays) {
    const kt_simulation *simulation = outcome->simulation;
    const double t = kt_simulation_time(simulation), *q = kt_outcome_positions(outcome);
    const double *v = kt_outcome_velocities(outcome);
    kt_spectrum *spectrum = NULL;
    kt_mode_watch *watch = NULL;
    double rate = 0.0;
    if (kt_model_nv(outcome->model) <= COORDINATES_MOST &&
        kt_spectrum_create(outcome->model, 1, &spectrum, NULL) == KT_OK &&
        kt_spectrum_add(spectrum, t, q, v, NULL, NULL) == KT_OK && kt_spectrum_fastest(spectrum) >= 0) {
        const kt_spectrum_mode at = kt_spectrum_at(spectrum, kt_spectrum_fastest(spectrum));
        kt_write_moving_mode(outcome->model, &at, text, size);
        rate = hypot(at.mode.real, at.mode.imaginary);
        *decays = fabs(at.mode.real) > fabs(at.mode.imaginary);
    } else if (kt_mode_watch_create(outcome->model, &watch, NULL) == KT_OK) {
        kt_mode_watch_add(watch, t, q, v);
        rate = kt_mode_watch_fastest(watch).rate;
        (void)snprintf(text, size, "rate of %.3g /s", rate);
        *decays = false;
    }
    kt_spectrum_free(spectrum);
    kt_mode_watch_free(watch);
    return rate;
}

/* Finds the cause of steps of this length, and a remedy. */
static void find_cause(const kt_outcome *outcome, double step, double breakpoints, char *cause, char *remedy,
                       size_t size) {
    char mode[256];
    bool decays = false;
    const double rate = describe_fastest_mode(outcome, mode, sizeof mode, &decays);
    const kt_method *method = kt_method_find(outcome->run->integrator);
    const bool is_explicit = method != NULL && !kt_method_is_implicit(method);
    if (breakpoints > often) {
        (void)snprintf(cause, size, "functions of time change their shape every %.3g s, where steps end",
                       step / breakpoints);
        (void)snprintf(remedy, size, "Take a slower function of time, or its mean; or shorten the run with --duration");
    } else if (step * rate > resolved && decays && is_explicit) {
        (void)snprintf(cause, size, "the fastest mode is a %s", mode);
        (void)snprintf(remedy, size, "Take radau5 (--integrator radau5), or less stiffness or damping there");
    } else if (step * rate > resolved) {
        (void)snprintf(cause, size, "the fastest mode is an %s", mode);
        (void)snprintf(remedy, size,
                       "Take less stiffness there, or lock the joint; radau5 with a larger --tolerance takes "
                       "longer steps if this oscillation is not excited");
    } else if (outcome->run->relative < tight) {
        (void)snprintf(cause, size, "the tolerance of %g is near rounding", outcome->run->relative);
        (void)snprintf(remedy, size, "Take a larger --tolerance, or dop853");
    } else {
        (void)snprintf(cause, size,
                       "no mode is as fast (%.3g /s) and no function of time: an effect jumps or bends often, "
                       "or events follow each other",
                       rate);
        (void)snprintf(remedy, size, "Smooth the jump, make it an event, or take a fixed step (--step)");
    }
}

static void warn_of_steps(kt_outcome *outcome, double step, double left, double breakpoints) {
    enum { SIZE = 400 };
    char cause[SIZE], remedy[SIZE], time[48];
    const double t = kt_simulation_time(outcome->simulation);
    const double steps = (double)kt_simulation_counts_of(outcome->simulation).steps;
    find_cause(outcome, step, breakpoints, cause, remedy, SIZE);
    write_time((kt_clock() - outcome->pace.begin) / steps * left, time, sizeof time);
    const kt_warning warning = kt_warning_at("many_steps", t, step, "s", remedy);
    kt_progress_end(outcome->pace.progress);
    kt_warn(&outcome->warnings, &warning,
            "steps of %.2g s at t = %.4g s: the rest of the run needs some %.2g of them, and some %s at this pace; %s",
            step, t, left, time, cause);
}

static void watch_pace(const kt_simulation *simulation, kt_outcome *outcome) {
    kt_pace *pace = &outcome->pace;
    const kt_simulation_counts counts = kt_simulation_counts_of(simulation);
    const double t = kt_simulation_time(simulation), steps = (double)BETWEEN * WINDOW;
    const uint64_t breakpoints = counts.breakpoints - pace->breakpoints;
    if (pace->said || ++pace->seen % WINDOW != 0)
        return;
    const double step = (t - pace->time) / steps, left = (outcome->run->duration - t) / step;
    pace->time = t;
    pace->breakpoints = counts.breakpoints;
    pace->said = left > (double)MANY;
    if (pace->said)
        warn_of_steps(outcome, step, left, (double)breakpoints / steps);
}

/* Every step is taken, and the pace of adaptive steps is watched at one of BETWEEN. */
static int watch_steps(const kt_simulation *simulation, void *user) {
    kt_outcome *outcome = user;
    const bool jumps = kt_path_watch_add(&outcome->paths, kt_simulation_time(simulation), kt_outcome_positions(outcome),
                                         kt_outcome_velocities(outcome));
    if (jumps)
        kt_progress_end(outcome->pace.progress);
    kt_steps_take(&outcome->steps);
    if (outcome->run->step == 0.0 && ++outcome->pace.steps % BETWEEN == 0)
        watch_pace(simulation, outcome);
    return 0;
}

void kt_watch_pace(kt_outcome *outcome, kt_simulation_options *options) {
    outcome->pace = (kt_pace){.begin = kt_clock()};
    options->progress = watch_steps;
    options->progress_steps = 1;
    options->progress_user = outcome;
}
