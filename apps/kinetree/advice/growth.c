/* Warns of fixed steps that diverge, if neither the modes nor the energy show it.
 *
 * A value is suspicious if it is far above all values of its kind in the first half of the run. Many sound motions grow
 * as much, such as an inverted pendulum or a late pulse. The motion is therefore continued twice from the last state,
 * with the steps of the run and with adaptive steps. If the motion itself grows, both continuations grow alike. If the
 * fixed steps amplify a decay or an oscillation, only their continuation grows.
 */
#include "advice/growth.h"

#include "scene/linear.h"
#include "subcommands/run.h"

#include "base/escape.h"
#include "kinetree/mechanism.h"

#include <math.h>
#include <string.h>

/* The growth since the first half of the run that is suspicious, and the quotient of both continuations that proves
 * the fault. Coarse but stable steps have smaller quotients. */
#define KT_GROWTH_LEAST 100.0
#define KT_GROWTH_QUOTIENT 2.0

enum {
    KT_GROWTH_STEPS = 16,    /* of the run, by which it is continued */
    KT_GROWTH_TRIES = 20000, /* adaptive steps over that time, at most */
};

/* ---- during the run ---------------------------------------------------------------------------------------------- */

static double largest_of(const double *values, int count, double most) {
    for (int i = 0; i < count; i++)
        most = fmax(most, fabs(values[i]));
    return most;
}

void kt_growth_add(kt_growth *growth, const kt_record *record, double duration) {
    if (record->time > 0.5 * duration)
        return;
    growth->speed = largest_of(record->v, kt_model_nv(record->model), growth->speed);
    if (record->x != NULL)
        growth->state = largest_of(record->x, kt_own_state_count(record->model), growth->state);
}

/* ---- at the end -------------------------------------------------------------------------------------------------- */

/* A value that may have diverged: coordinate `index` of the velocities, or of the auxiliary states. */
typedef struct suspect {
    bool is_state;
    int index;
    double before, end; /* the largest one of its kind in the first half; |value| at the end */
} suspect;

static double size_of(const kt_simulation *simulation, const suspect *s) {
    const double *values = s->is_state ? kt_simulation_own_states(simulation) : kt_simulation_velocities(simulation);
    return fabs(values[s->index]);
}

/* Returns whether a value at the end is suspicious, and the one that has grown most. */
static bool find_suspect(const kt_outcome *outcome, suspect *found) {
    const double before[] = {outcome->growth.speed, outcome->growth.state};
    const int count[] = {kt_model_nv(outcome->model), kt_own_state_count(outcome->model)};
    double most = KT_GROWTH_LEAST;
    bool any = false;
    for (int kind = 0; kind < 2; kind++)
        for (int i = 0; i < count[kind]; i++) {
            suspect s = {.is_state = kind == 1, .index = i, .before = before[kind]};
            s.end = size_of(outcome->simulation, &s);
            if (s.before > 0.0 && s.end > most * s.before) {
                most = s.end / s.before;
                *found = s;
                any = true;
            }
        }
    return any;
}

/* Continues the motion from its end, with steps of this length (0: adaptive). Returns the largest size of the value in
 * the second half of that time; NaN if the motion cannot be continued. */
static double continue_motion(const kt_outcome *outcome, const suspect *s, double step) {
    const kt_simulation *from = outcome->simulation;
    const double begin = kt_simulation_time(from), length = outcome->run->step;
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulation *simulation = NULL;
    kt_run run = *outcome->run;
    kt_error error = {0};
    kt_absolute_use(outcome->absolute, &options);
    options.max_steps = KT_GROWTH_TRIES;
    run.step = step;
    run.record = KT_RECORD_POSITION;
    run.marker_count = 0;
    run.duration = begin + KT_GROWTH_STEPS * length;
    if (step == 0.0) {
        run.integrator = NULL; /* the default for the model */
        run.relative = run.absolute = 1e-6;
    }
    kt_status status = kt_simulation_create(outcome->model, &run, &options, &simulation, &error);
    if (status == KT_OK)
        status = kt_simulation_set_state(simulation, begin, kt_simulation_positions(from),
                                         kt_simulation_velocities(from), &error);
    if (status == KT_OK && kt_own_state_count(outcome->model) > 0)
        status = kt_simulation_set_own_states(simulation, kt_simulation_own_states(from), &error);
    double most = 0.0;
    for (int i = 1; status == KT_OK && i <= KT_GROWTH_STEPS; i++) {
        status = kt_simulation_advance(simulation, begin + i * length, &error);
        if (status == KT_OK && 2 * i > KT_GROWTH_STEPS)
            most = fmax(most, size_of(simulation, s));
    }
    kt_simulation_free(simulation);
    return status == KT_OK ? most : status == KT_ERROR_NOT_FINITE ? HUGE_VAL : (double)NAN;
}

static bool is_reported(const kt_outcome *outcome) {
    size_t i;
    json_t *one;
    json_array_foreach(outcome->warnings.list, i, one) {
        const char *code = json_string_value(json_object_get(one, "code"));
        if (code != NULL && (strcmp(code, "unstable_step") == 0 || strcmp(code, "energy") == 0))
            return true;
    }
    return false;
}

void kt_warn_of_growth(kt_outcome *outcome) {
    suspect s;
    if (!(outcome->run->step > 0.0) || outcome->is_blown_up || outcome->failed.code != KT_OK || is_reported(outcome) ||
        !find_suspect(outcome, &s))
        return;
    const double coarse = continue_motion(outcome, &s, outcome->run->step);
    const double fine = coarse > s.end ? continue_motion(outcome, &s, 0.0) : (double)NAN;
    if (!(coarse > KT_GROWTH_QUOTIENT * fine))
        return;
    const kt_warning warning = {.code = "diverging_steps",
                                .time = kt_simulation_time(outcome->simulation),
                                .value = s.end / s.before,
                                .remedy = "Take smaller steps ('kinetree stability' shows which are stable), or an "
                                          "adaptive method"};
    kt_warn(&outcome->warnings, &warning,
            "steps of %g s let the %s '%s' grow to %.3g, %.2g times the largest such value in the first half of the "
            "run. In the next %d steps it would reach %.3g, but with adaptive steps only %.3g: the integration "
            "diverges",
            outcome->run->step, s.is_state ? "state" : "speed of joint",
            s.is_state ? kt_own_state_name(outcome->model, s.index) : kt_name_column(outcome->model, s.index).text,
            s.end, s.end / s.before, KT_GROWTH_STEPS, coarse, fine);
}
