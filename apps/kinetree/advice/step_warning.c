/* Warnings about fixed steps: steps outside of a method's region of stability, or too few steps per period.
 *
 * The rate of the fastest mode is estimated at the records, for about a fiftieth of the run's evaluations
 * (kt_mode_watch). At the end, unless this rate is clearly harmless, the modes at that state and at the last state are
 * computed. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"
#include "subcommands/stability.h"

#include "algebra/elementary.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <stdio.h>

enum {
    FIRST_EVALUATIONS = 60, /* evaluations that the watch may use in any run, however short */
    PART = 50,              /* the watch may use 1/PART of the run's evaluations */
    COORDINATES_MOST = 60,  /* velocity coordinates, up to which modes are computed */
    FOLLOWED_STEPS = 10000, /* adaptive steps of the motion that replaces an unstable run */
};

#define DOUBT 2.0 /* safety factor: the estimated rates err downwards */

kt_mode_watch *kt_watch_steps(kt_outcome *outcome) {
    const kt_run *run = outcome->run;
    kt_warning warning = kt_warning_of("unknown_stability", (double)NAN, NULL,
                                       "Run 'kinetree stability', or compare with a run of half the step");
    kt_mode_watch *watch = NULL;
    kt_error error = {0};
    if (!(run->step > 0.0) || !(run->duration > run->step) || kt_model_nv(outcome->model) == 0)
        return NULL;
    if (kt_mode_watch_create(outcome->model, &watch, &error) == KT_OK)
        return watch;
    if (error.code == KT_ERROR_MEMORY)
        warning.remedy = "Run it again with more memory, or compare with a run of half the step";
    kt_warn(&outcome->warnings, &warning, "steps of %g s may be unstable or too long; this cannot be checked: %s",
            run->step, error.message);
    return NULL;
}

void kt_watch_step(kt_mode_watch *watch, const kt_outcome *outcome, const kt_record *record) {
    if (watch == NULL)
        return;
    /* These are the evaluations of the steps only. Their number is equal in an interrupted and an uninterrupted run. */
    const kt_method *method = kt_method_find(outcome->run->integrator);
    const uint64_t stages = method != NULL ? (uint64_t)method->stages : 1;
    const uint64_t evaluations = stages * kt_simulation_counts_of(outcome->simulation).steps;
    if (kt_mode_watch_evaluations(watch) <= FIRST_EVALUATIONS + evaluations / PART)
        kt_mode_watch_add(watch, record->t, record->q, record->v);
}

/* ---- possible faults of the step --------------------------------------------------------------------------------- */

enum { DIRECTIONS = 5 };

/* Fills in eigenvalues of this magnitude, from undamped oscillation to pure decay. */
static void fan_out(double rate, kt_complex *lambda) {
    for (int i = 0; i < DIRECTIONS; i++) {
        const double angle = acos(0.0) * (1.0 + (double)i / (DIRECTIONS - 1));
        lambda[i] = (kt_complex){i > 0 ? rate * cos(angle) : 0.0, i < DIRECTIONS - 1 ? rate * sin(angle) : 0.0};
    }
}

/* Returns whether a mode with a rate of up to this might be amplified, or sampled too coarsely. */
static bool is_in_doubt(const kt_run *run, const kt_method *method, double rate) {
    kt_complex lambda[DIRECTIONS];
    kt_stability stability;
    fan_out(rate, lambda);
    return kt_stability_worst(method, lambda, DIRECTIONS, run->step, run->duration, NULL) > KT_STABILITY_GROWTH ||
           kt_stability_make(method, kt_stability_stages(method, run->step * rate), &stability, NULL) != KT_OK ||
           kt_stability_period_error(&stability, lambda[0], run->step) > KT_SAMPLING_ERROR;
}

/* ---- messages ---------------------------------------------------------------------------------------------------- */

static void advise_step(kt_outcome *outcome, double step) {
    outcome->advised_step = outcome->advised_step > 0.0 ? fmin(outcome->advised_step, step) : step;
}

static void name_mode(const kt_outcome *outcome, const kt_spectrum_mode *at, char *text, size_t size) {
    char mode[224];
    kt_write_moving_mode(outcome->model, at, mode, sizeof mode);
    snprintf(text, size, "%s %s", mode[0] == 'u' || mode[0] == 'o' ? "an" : "a", mode);
}

static void warn_of_instability(kt_outcome *outcome, const kt_method *method, const kt_spectrum *spectrum,
                                const kt_step_limit *limit) {
    char mode[256], remedy[128], by[48] = "without bound";
    const kt_spectrum_mode at = kt_spectrum_at(spectrum, limit->mode);
    name_mode(outcome, &at, mode, sizeof mode);
    if (limit->growth < 1e6)
        snprintf(by, sizeof by, "%.2g-fold over the run", limit->growth);
    snprintf(remedy, sizeof remedy, "Take steps below %.3g s%s; 'kinetree stability' shows more", limit->step,
             !kt_method_stages_vary(method) && limit->growth >= 1e6 && at.mode.damping > 0.9 ? ", or rkc2" : "");
    const kt_warning warning = kt_warning_at("unstable_step", at.t, limit->step, "s", remedy);
    advise_step(outcome, limit->step);
    kt_warn(&outcome->warnings, &warning,
            "steps of %g s are too long for %s to be stable: the method amplifies %s, as it is at t = %g s, %s",
            outcome->run->step, method->name, mode, at.t, by);
}

static void warn_of_samples(kt_outcome *outcome, const kt_method *method, const kt_spectrum *spectrum,
                            const kt_sampling *sampling) {
    char mode[256], remedy[160];
    const kt_spectrum_mode at = kt_spectrum_at(spectrum, sampling->mode);
    const double period = sampling->samples * outcome->run->step;
    name_mode(outcome, &at, mode, sizeof mode);
    snprintf(remedy, sizeof remedy,
             "Take steps below %.2g s, %.2g a period, for an error of %g, or a method of higher order", sampling->step,
             period / sampling->step, KT_SAMPLING_ERROR);
    const kt_warning warning = kt_warning_at("few_samples", at.t, sampling->samples, NULL, remedy);
    advise_step(outcome, sampling->step);
    kt_warn(
        &outcome->warnings, &warning,
        "%s at %g s takes %.3g steps a period of %s, found at t = %g s, whose error after each period is %.2g times "
        "its amplitude",
        method->name, outcome->run->step, sampling->samples, mode, at.t, sampling->error);
}

/* Warns by the rate alone, for large scenes or if the modes cannot be computed: the step must be unstable for modes of
 * every direction. Returns whether it has warned. */
static bool warn_of_rate(kt_outcome *outcome, const kt_method *method, const kt_fast_state *fastest) {
    kt_complex lambda[DIRECTIONS];
    char remedy[128];
    ptrdiff_t index;
    fan_out(fastest->rate, lambda);
    for (int i = 0; i < DIRECTIONS; i++)
        if (!(kt_stability_worst(method, &lambda[i], 1, outcome->run->step, outcome->run->duration, &index) >
              KT_STABILITY_GROWTH))
            return false;
    const double step =
        kt_stability_step(method, lambda, DIRECTIONS, outcome->run->duration, KT_STABILITY_GROWTH, &index);
    snprintf(remedy, sizeof remedy, "Take steps below %.2g s; 'kinetree stability' shows more", step);
    const kt_warning warning = kt_warning_at("unstable_step", fastest->t, step, "s", remedy);
    advise_step(outcome, step);
    kt_warn(&outcome->warnings, &warning,
            "steps of %g s are too long for %s to be stable: the rate of the fastest mode is about %.3g /s at t = %g s",
            outcome->run->step, method->name, fastest->rate, fastest->t);
    return true;
}

/* Warns that the stability is undetermined, since the modes cannot be computed without LAPACK or memory. */
static void warn_of_doubt(kt_outcome *outcome, const kt_method *method, const kt_fast_state *fastest,
                          const kt_error *error) {
    const kt_warning warning =
        kt_warning_at("unknown_stability", fastest->t, fastest->rate, "1/s",
                      "Mend this fault and run 'kinetree stability', or compare with a run of half the step");
    kt_warn(&outcome->warnings, &warning,
            "steps of %g s may be unstable or too long for %s: the rate of the fastest mode is about %.3g /s at t = %g "
            "s, but its direction cannot be computed: %s: %s",
            outcome->run->step, method->name, fastest->rate, fastest->t, error->where, error->message);
}

/* ---- at the end -------------------------------------------------------------------------------------------------- */

static bool add_spectrum_state(kt_spectrum *spectrum, double t, const double *q, const double *v, kt_error *error) {
    return kt_spectrum_add(spectrum, t, q, v, NULL, error) == KT_OK;
}

static bool add_fastest(kt_spectrum *spectrum, const kt_mode_watch *watch, kt_error *error) {
    const kt_fast_state fastest = kt_mode_watch_fastest(watch);
    return fastest.rate > 0.0 && add_spectrum_state(spectrum, fastest.t, fastest.q, fastest.v, error);
}

/* Adds the modes at the last state, with the contacts that are closed there. The model as it is compiled has all of
 * them open, and rejects such a state. */
static bool add_closed(const kt_outcome *outcome, kt_spectrum **spectrum, kt_error *error) {
    const kt_simulation *simulation = outcome->simulation;
    kt_spectrum *closed = NULL;
    if (kt_spectrum_create(kt_outcome_model(outcome), 1, &closed, error) != KT_OK)
        return false;
    kt_spectrum_free(*spectrum);
    *spectrum = closed;
    return add_spectrum_state(closed, kt_simulation_time(simulation), kt_outcome_positions(outcome),
                              kt_outcome_velocities(outcome), error);
}

static kt_simulation_options follow_options(void) {
    kt_simulation_options options = kt_simulation_options_default();
    options.max_steps = FOLLOWED_STEPS;
    return options;
}

/* Adds the modes at the start of the motion and at its state with the fastest mode, computed with adaptive steps. The
 * motion need not reach the end of the run. */
static void follow_motion(kt_outcome *outcome, kt_spectrum *spectrum) {
    kt_run run = *outcome->run;
    kt_simulation_options options = follow_options();
    kt_mode_watch *watch = kt_watch_steps(outcome);
    kt_simulated follower = {NULL, NULL};
    kt_error error = {0};
    run.integrator = NULL; /* the default for the model */
    run.relative = run.absolute = 1e-6;
    run.step = 0.0;
    run.record = KT_RECORD_POSITION;
    run.marker_count = 0;
    kt_status status = watch == NULL
                           ? KT_ERROR_MEMORY
                           : kt_simulated_create(outcome->model, outcome->absolute, &run, &options, &follower, &error);
    if (status == KT_OK)
        (void)add_spectrum_state(spectrum, 0.0, kt_simulated_positions(follower), kt_simulated_velocities(follower),
                                 &error);
    while (status == KT_OK && kt_simulation_time(follower.simulation) < run.duration) {
        status = kt_simulation_step(follower.simulation, run.duration, &error);
        if (status == KT_OK)
            kt_mode_watch_add(watch, kt_simulation_time(follower.simulation), kt_simulated_positions(follower),
                              kt_simulated_velocities(follower));
    }
    if (watch != NULL)
        (void)add_fastest(spectrum, watch, &error);
    kt_simulated_free(&follower);
    kt_mode_watch_free(watch);
}

static bool is_unstable(const kt_outcome *outcome, const kt_method *method, const kt_spectrum *spectrum,
                        kt_step_limit *limit) {
    *limit = kt_spectrum_limit(spectrum, method, outcome->run->duration, outcome->run->step);
    return limit->growth > KT_STABILITY_GROWTH && limit->mode >= 0;
}

static void warn_by(kt_outcome *outcome, const kt_method *method, const kt_spectrum *spectrum) {
    kt_step_limit limit;
    if (is_unstable(outcome, method, spectrum, &limit)) {
        limit.mode = kt_spectrum_limit(spectrum, method, outcome->run->duration, 0.0).mode; /* the limiting mode */
        warn_of_instability(outcome, method, spectrum, &limit);
    }
    const kt_sampling sampling = kt_spectrum_sampling(spectrum, method, outcome->run->step);
    if (sampling.mode >= 0)
        warn_of_samples(outcome, method, spectrum, &sampling);
}

/* Warns with the modes of the mechanism. The states of an unstable run do not belong to the true motion, above all if
 * the run ended early. The modes of the true motion are therefore used first. */
static void warn_of_modes(kt_outcome *outcome, const kt_method *method, const kt_mode_watch *watch) {
    const kt_simulation *simulation = outcome->simulation;
    const kt_fast_state fastest = kt_mode_watch_fastest(watch);
    const double end = kt_simulation_time(simulation);
    kt_spectrum *own = NULL, *motion = NULL;
    kt_error error = {0};
    kt_step_limit limit;
    if (kt_spectrum_create(outcome->model, 2, &own, &error) != KT_OK ||
        kt_spectrum_create(outcome->model, 2, &motion, &error) != KT_OK) {
        warn_of_doubt(outcome, method, &fastest, &error);
        kt_spectrum_free(own);
        return;
    }
    bool found = add_fastest(own, watch, &error);
    if (end != fastest.t)
        found |= add_spectrum_state(own, end, kt_outcome_positions(outcome), kt_outcome_velocities(outcome), &error);
    if (!found && error.code == KT_ERROR_UNSUPPORTED)
        found = add_closed(outcome, &own, &error);
    const bool unstable = is_unstable(outcome, method, own, &limit), sound = end >= outcome->run->duration;
    if (unstable || !sound)
        follow_motion(outcome, motion);
    if (is_unstable(outcome, method, motion, &limit))
        warn_by(outcome, method, motion);
    else if (found && sound && !outcome->is_blown_up)
        warn_by(outcome, method, own);
    else if (!found && fastest.rate > 0.0 && !warn_of_rate(outcome, method, &fastest) &&
             (error.code == KT_ERROR_UNSUPPORTED || error.code == KT_ERROR_MEMORY))
        warn_of_doubt(outcome, method, &fastest, &error); /* else nothing moves, or loops are singular */
    kt_spectrum_free(own);
    kt_spectrum_free(motion);
}

/* Modes need LAPACK, which a live page lacks. Rates alone then decide. */
static bool can_compute_modes(const kt_model *model) {
#ifdef KT_NO_LAPACK
    (void)model;
    return false;
#else
    return kt_model_nv(model) <= COORDINATES_MOST;
#endif
}

void kt_warn_of_step(kt_outcome *outcome, const kt_mode_watch *watch) {
    const kt_method *method = outcome->run->integrator != NULL ? kt_method_find(outcome->run->integrator) : NULL;
    if (watch == NULL || method == NULL)
        return;
    const kt_fast_state fastest = kt_mode_watch_fastest(watch);
    if (!is_in_doubt(outcome->run, method, DOUBT * fastest.rate))
        return;
    if (can_compute_modes(outcome->model))
        warn_of_modes(outcome, method, watch);
    else
        warn_of_rate(outcome, method, &fastest);
}

/* ---- velocity corrections ---------------------------------------------------------------------------------------- */

void kt_watch_correction(kt_outcome *outcome) {
    const kt_velocity_correction correction = kt_simulation_velocity_correction(outcome->simulation);
    if (!(correction.share > KT_CORRECTION_ERROR))
        outcome->so_far.corrected_since = (double)NAN;
    else if (isnan(outcome->so_far.corrected_since))
        outcome->so_far.corrected_since = correction.time;
}

/* Adaptive steps follow a path that bends. Projections then change velocities by some 1e-6 of the fastest at most. Next
 * to a singular position, a path may bend within less than the rounding of positions. Projections then act as an
 * impact. Example: a scissor lift of unequal bars swings through its folded position. Velocities change by 0.3 of the
 * fastest, and the motion loses 12 J. Its energy was 33 J. */
#define IMPACT_LEAST 1e-3

static void warn_of_impact(kt_outcome *outcome) {
    const kt_velocity_correction correction = kt_simulation_velocity_correction(outcome->simulation);
    const kt_warning warning =
        kt_warning_at("large_projection", correction.time, correction.share, NULL,
                      "Compare with runs of another tolerance, and of slightly different lengths or starts");
    if (kt_simulation_counts_of(outcome->simulation).crossings.near > 0 &&
        correction.share > fmax(IMPACT_LEAST, 10.0 * outcome->run->relative))
        kt_warn(&outcome->warnings, &warning,
                "next to a singular position of the loops the path bends more sharply than the steps resolve. At t = "
                "%.9g s the projection has changed the velocity of joint '%s' by %.2g times the fastest in the loops, "
                "as an impact does. The energy has changed, too",
                correction.time, kt_joint_name(kt_simulation_model(outcome->simulation), correction.body),
                correction.share);
}

void kt_warn_of_correction(kt_outcome *outcome) {
    const char *jumping = kt_start_jumping(
        outcome->scene, outcome->run->duration); /* this has been reported and explains the correction */
    kt_watch_correction(outcome);
    const kt_velocity_correction correction = kt_simulation_velocity_correction(outcome->simulation);
    const bool driven = outcome->so_far.energy.energetics == KT_ENERGY_SUPPLIED;
    const kt_warning warning =
        kt_warning_at("large_projection", outcome->so_far.corrected_since, correction.share, NULL,
                      driven ? "Take much smaller steps, or an adaptive method, which ends at a dead point"
                             : "Take much smaller steps, or an adaptive method");
    if (!(outcome->run->step > 0.0) && jumping == NULL)
        warn_of_impact(outcome);
    if (outcome->run->step > 0.0 && jumping == NULL && !isnan(outcome->so_far.corrected_since))
        kt_warn(&outcome->warnings, &warning,
                "velocities after steps of %g s do not fit the loops. The projection has changed that of joint '%s' by "
                "up to %.2g times the fastest in the loops, and by more than %g times from t = %.9g s on. The steps "
                "are much too long there%s",
                outcome->run->step, kt_joint_name(kt_simulation_model(outcome->simulation), correction.body),
                correction.share, KT_CORRECTION_ERROR, outcome->so_far.corrected_since,
                driven ? ", or have leapt over a dead point, where the loops cannot move as they are driven" : "");
}

/* ---- drift without projection ------------------------------------------------------------------------------------ */

/* A gap of this part of the mechanism's extent is reported. */
#define DRIFT_PART 1e-6

/* The largest edge of the box of all bodies' origins, markers and mass centre at the end of the run, m; 0: unknown. */
static double extent_at_end(const kt_outcome *outcome) {
    const kt_model *model = outcome->model;
    kt_data *data = NULL;
    kt_vec3 low = {HUGE_VAL, HUGE_VAL, HUGE_VAL}, high = {-HUGE_VAL, -HUGE_VAL, -HUGE_VAL}, at;
    double edge = 0.0;
    if (kt_data_create(model, &data, NULL) != KT_OK)
        return 0.0;
    if (kt_kinematics_update(model, data, kt_outcome_positions(outcome), NULL, NULL, NULL) == KT_OK) {
        if (kt_mass_center(model, data, &at) > 0.0)
            kt_box_widen(&low, &high, at);
        for (int body = 0; body < kt_model_body_count(model); body++) {
            kt_box_widen(&low, &high, kt_point_position(model, data, body, kt_vec3_make(0.0, 0.0, 0.0)));
            for (int marker = 0; marker < kt_marker_count(model, body); marker++)
                kt_box_widen(&low, &high, kt_point_position(model, data, body, kt_marker_at(model, body, marker)));
        }
        edge = fmax(high.x - low.x, fmax(high.y - low.y, high.z - low.z));
    }
    kt_data_free(data);
    return isfinite(edge) ? edge : 0.0;
}

void kt_warn_of_drift(kt_outcome *outcome) {
    const double gap = outcome->so_far.constraint.position;
    const double extent = outcome->unprojected && kt_loop_count(outcome->model) > 0 ? extent_at_end(outcome) : 0.0;
    if (!(extent > 0.0) || gap <= DRIFT_PART * extent)
        return;
    const kt_warning warning = kt_warning_at("drift", (double)NAN, gap, NULL, "Leave out --unprojected");
    kt_warn(&outcome->warnings, &warning,
            "without projection the loops have drifted open by up to %.2g (m or rad), %.2g times the extent of the "
            "mechanism (%.3g m)",
            gap, gap / extent, extent);
}
