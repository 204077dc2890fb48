/* Warns of fixed steps that diverge, if neither the modes nor the energy show it.
 *
 * A value is suspicious if it is far above all values of its kind in the first half of the run. Many sound motions grow
 * as much, such as an inverted pendulum or a late pulse. The motion is therefore continued twice from the last state,
 * with the steps of the run and with adaptive steps. If the motion itself grows, both continuations grow alike. If the
 * fixed steps amplify a decay or an oscillation, only their continuation grows.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "advice/growth.h"

#include "open/linear.h"
#include "subcommands/run.h"

#include "kinetree/mechanism.h"

#include <math.h>

/* The growth since the first half of the run that is suspicious, and the quotient of both continuations that proves
 * the fault. Coarse but stable steps have smaller quotients. From the doubt on, the motion is continued further. */
#define KT_GROWTH_LEAST 100.0
#define KT_GROWTH_QUOTIENT 2.0
#define KT_GROWTH_DOUBT 1.2

enum {
    KT_GROWTH_STEPS = 16,      /* of the run, by which it is continued */
    KT_GROWTH_STEPS_MOST = 64, /* likewise, if these leave a doubt */
    KT_GROWTH_TRIES = 20000,   /* adaptive steps over that time, at most */
};

/* ---- during the run ---------------------------------------------------------------------------------------------- */

static double largest_of(const double *values, int count, double most) {
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(values[i]));
    return most;
}

void kt_growth_add(kt_growth *growth, const kt_record *record, double duration) {
    if (record->t > 0.5 * duration)
        return;
    growth->speed = largest_of(record->v, kt_model_nv(record->model), growth->speed);
    if (record->x != NULL)
        growth->state = largest_of(record->x, kt_auxiliary_state_count(record->model), growth->state);
}

/* ---- at the end -------------------------------------------------------------------------------------------------- */

/* A value that may have diverged: coordinate `index` of the velocities, or of the auxiliary states. */
typedef struct suspect {
    bool is_state;
    int index;
    double before, end; /* the largest one of its kind in the first half; |value| at the end */
} suspect;

static double suspect_size_of(kt_simulated of, const suspect *s) {
    const double *values = s->is_state ? kt_simulation_auxiliary_states(of.simulation) : kt_simulated_velocities(of);
    return fabs(values[s->index]);
}

/* Returns whether a value at the end is suspicious, and the one that has grown most. */
static bool find_suspect(const kt_growth *growth, const kt_grown_run *grown, suspect *found) {
    const double before[] = {growth->speed, growth->state};
    const int count[] = {kt_model_nv(grown->model), kt_auxiliary_state_count(grown->model)};
    double most = KT_GROWTH_LEAST;
    bool any = false;
    for (int kind = 0; kind < 2; kind++)
        for (int i = 0; i < count[kind]; i++) {
            suspect s = {.is_state = kind == 1, .index = i, .before = before[kind]};
            s.end = suspect_size_of(grown->by, &s);
            if (s.before > 0.0 && s.end > most * s.before) {
                most = s.end / s.before;
                *found = s;
                any = true;
            }
        }
    return any;
}

/* Continues the motion from its end for the time of so many steps of the run, with steps of this length (0: adaptive).
 * Returns the largest size of the value in the second half of that time; NaN if the motion cannot be continued. */
static double continue_motion(const kt_grown_run *grown, const suspect *s, double step, int steps) {
    const double begin = kt_simulation_time(grown->by.simulation), length = grown->run->step;
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulated onward;
    kt_run run = *grown->run;
    kt_error error = {0};
    options.max_steps = KT_GROWTH_TRIES;
    run.step = step;
    run.record = KT_RECORD_POSITION;
    run.marker_count = 0;
    run.duration = begin + steps * length;
    if (step == 0.0) {
        run.integrator = NULL; /* the default for the model */
        run.relative = run.absolute = 1e-6;
    }
    kt_status status = kt_simulated_create(grown->model, grown->absolute, &run, &options, &onward, &error);
    if (status == KT_OK)
        status = kt_simulated_set_state(onward, begin, kt_simulated_positions(grown->by),
                                        kt_simulated_velocities(grown->by), &error);
    if (status == KT_OK && kt_auxiliary_state_count(grown->model) > 0)
        status = kt_simulation_set_auxiliary_states(onward.simulation,
                                                    kt_simulation_auxiliary_states(grown->by.simulation), &error);
    double most = 0.0;
    for (int i = 1; status == KT_OK && i <= steps; i++) {
        status = kt_simulation_advance(onward.simulation, begin + i * length, &error);
        if (status == KT_OK && 2 * i > steps)
            most = fmax(most, suspect_size_of(onward, s));
    }
    kt_simulated_free(&onward);
    return status == KT_OK ? most : status == KT_ERROR_NOT_FINITE ? HUGE_VAL : (double)NAN;
}

double kt_growth_diverges(const kt_growth *growth, const kt_grown_run *grown, kt_error *error) {
    const double step = grown->run->step;
    suspect s;
    if (!(step > 0.0) || !find_suspect(growth, grown, &s))
        return 0.0;
    for (int steps = KT_GROWTH_STEPS; steps <= KT_GROWTH_STEPS_MOST; steps *= 4) {
        const double coarse = continue_motion(grown, &s, step, steps);
        const double fine = coarse > s.end ? continue_motion(grown, &s, 0.0, steps) : (double)NAN;
        if (coarse > KT_GROWTH_QUOTIENT * fine) {
            (void)kt_error_set(
                error, KT_ERROR_STEP, NULL,
                "steps of %g s let the %s '%s' grow to %.3g, %.2g times the largest such value in the first half of "
                "the run. In the next %d steps it would reach %.3g, but with adaptive steps only %.3g: the integration "
                "diverges",
                step, s.is_state ? "state" : "speed of joint",
                s.is_state ? kt_auxiliary_state_name(grown->model, s.index)
                           : kt_name_column(grown->model, s.index).text,
                s.end, s.end / s.before, steps, coarse, fine);
            return s.end / s.before;
        }
        if (!(coarse > KT_GROWTH_DOUBT * fine))
            break;
    }
    return 0.0;
}

void kt_warn_of_growth(kt_outcome *outcome) {
    const kt_grown_run grown = {outcome->model, outcome->absolute, outcome->run, kt_outcome_simulated(outcome)};
    kt_error error;
    if (outcome->is_blown_up || outcome->failed.code != KT_OK ||
        kt_warnings_have(&outcome->warnings, "unstable_step") || kt_warnings_have(&outcome->warnings, "energy"))
        return;
    const kt_warning warning =
        kt_warning_at("diverging_steps", kt_simulation_time(outcome->simulation),
                      kt_growth_diverges(&outcome->so_far.growth, &grown, &error), NULL,
                      "Take smaller steps ('kinetree stability' shows which are stable), or an adaptive method");
    if (warning.value > 0.0)
        kt_warn(&outcome->warnings, &warning, "%s", error.message);
}
