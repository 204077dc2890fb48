/* run --check-error: an estimate of the error of a run, from a second run with a tighter setting.
 *
 * At a setting s (a tolerance, or a step), the error is about C s^p. Let x and y be the states of the run and of a
 * second one at the setting r s. The difference of the two is
 *
 *     x - y = C s^p (1 - r^p),   hence the error of x is about (x - y) / (1 - r^p)
 *
 * This is Richardson's extrapolation (L. F. Richardson 1911, Phil. Trans. R. Soc. A 210, 307). For a fixed step, p is
 * the order of the method and r = 1/2. For a tolerance, r = 1/10. A method of order p whose estimate has order q
 * controls an error of h^(q + 1) in each step. Therefore the error of the run falls like tol^(p / (q + 1)), at most
 * like tol. If the setting is already so tight that rounding would spoil a tighter one, the second run is looser.
 *
 * The run keeps its states at all records. A record of the second run at the same time is compared with them. The
 * estimate fails if the two runs part: then the error is as large as their difference, or larger.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

#include "base/grow.h"
#include "open/play.h"
#include "text/json.h"

#include "kinetree/joint.h"

#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static const double tightest = 1e-13; /* the least tolerance of a second run */
static const double parted = 0.01;    /* of the motion: two runs further apart do not show a small error */
static const double same_time = 1e-12;

void kt_error_check_take(kt_error_check *check, const kt_model *model, const kt_record *record) {
    const size_t nq = (size_t)kt_model_nq(model), nv = (size_t)kt_model_nv(model);
    check->width = 1 + nq + nv;
    double *rows = kt_heap_grow(check->rows, check->count, 1, &check->room, check->width * sizeof *rows);
    check->is_short = check->is_short || rows == NULL;
    if (rows == NULL)
        return;
    check->rows = rows;
    double *row = rows + check->width * check->count++;
    row[0] = record->t;
    memcpy(row + 1, record->q, nq * sizeof *row);
    memcpy(row + 1 + nq, record->v, nv * sizeof *row);
}

void kt_error_check_free(kt_error_check *check) {
    if (check != NULL)
        free(check->rows);
}

/* ---- the second run ---------------------------------------------------------------------------------------------- */

/* Compares the records of the second run. */
typedef struct kt_error_walk {
    kt_error_check *check;
    const kt_model *model;
    double *difference; /* [nv] */
    size_t row;         /* the first record of the run that may be at the time */
    double reach;       /* the largest motion of a joint, in the norm: from the first record */
    bool has_jumps;     /* velocities are compared at the end only */
} kt_error_walk;

/* Returns the record of the run at this time; NULL: it has none. */
static const double *find_row(kt_error_walk *walk, double time) {
    const kt_error_check *check = walk->check;
    const double *row = check->rows + check->width * walk->row;
    const double slack = same_time * (1.0 + fabs(time));
    for (; walk->row < check->count && row[0] < time - slack; row += check->width)
        walk->row++;
    return walk->row < check->count && row[0] <= time + slack ? row : NULL;
}

static kt_difference larger_difference(kt_difference a, kt_difference b) {
    return (kt_difference){fmax(a.angle, b.angle), fmax(a.length, b.length)};
}

static int compare_record(const kt_record *record, void *user) {
    kt_error_walk *walk = user;
    kt_error_check *check = walk->check;
    const int nq = kt_model_nq(walk->model), nv = kt_model_nv(walk->model);
    const double *row = record->index != KT_INDEX_CONTACT ? find_row(walk, record->t) : NULL;
    if (row == NULL)
        return 0;
    kt_position_subtract(walk->model, record->q, row + 1, walk->difference);
    const kt_difference found = kt_difference_size(walk->model, walk->difference, false);
    if (found.angle > check->position.angle || found.length > check->position.length)
        check->time = record->t;
    check->position = larger_difference(check->position, found);
    kt_position_subtract(walk->model, row + 1, check->rows + 1, walk->difference);
    const kt_difference moved = kt_difference_size(walk->model, walk->difference, false);
    check->motion = larger_difference(check->motion, moved);
    for (int i = 0; i < nv; i++)
        walk->difference[i] = record->v[i] - row[1 + nq + i];
    const kt_difference rates = kt_difference_size(walk->model, walk->difference, true);
    check->velocity = walk->has_jumps ? rates : larger_difference(check->velocity, rates);
    check->compared++;
    return 0;
}

/* Sets the settings of the second run, and the power of the error. */
static kt_run tighten_run(const kt_outcome *outcome, kt_error_check *check) {
    kt_run run = *outcome->run;
    kt_method storage;
    const kt_method *method = kt_run_method(&run, outcome->model, &storage);
    const bool is_stepping = outcome->scene->contact == KT_CONTACT_STEPS;
    check->is_fixed = run.step > 0.0;
    if (check->is_fixed) {
        check->power = is_stepping || method == NULL ? 1.0 : method->order;
        check->ratio = 0.5;
        run.step *= check->ratio;
        check->setting = run.step;
        return run;
    }
    const double least = fmin(run.relative, run.absolute);
    check->power = method != NULL ? fmin(1.0, method->order / (method->embedded_order + 1.0)) : 1.0;
    check->ratio = 0.1 * least >= tightest ? 0.1 : 10.0;
    run.relative *= check->ratio;
    run.absolute *= check->ratio;
    check->setting = run.relative;
    return run;
}

static kt_status run_second(kt_outcome *outcome, kt_error_walk *walk, const kt_run *run, kt_error *error) {
    kt_simulation_options options = kt_simulation_options_default();
    kt_simulated second;
    kt_scene_watch *events = NULL;
    options.unprojected = outcome->unprojected;
    options.stall_evaluations = kt_bound_of_fixed_steps(outcome, options);
    kt_status status =
        kt_simulate_scene(outcome->scene, outcome->model, run, outcome->absolute, &options, &second, &events, error);
    if (status == KT_OK)
        status = kt_simulated_run(second, compare_record, walk, error);
    kt_simulated_free(&second);
    kt_scene_watch_free(events);
    return status;
}

static kt_difference scale_difference(kt_difference difference, double factor) {
    return (kt_difference){factor * difference.angle, factor * difference.length};
}

/* Whether a difference is small compared with the motion. */
static bool is_small(double difference, double motion) { return !(difference > parted * motion) || difference == 0.0; }

void kt_error_check_finish(kt_error_check *check, kt_outcome *outcome) {
    kt_error error = {0};
    kt_error_walk walk = {.check = check, .model = outcome->model};
    walk.has_jumps = kt_simulation_contacts(outcome->simulation).count > 0 || kt_scene_event_room(outcome->scene) > 0;
    walk.difference = malloc(((size_t)kt_model_nv(outcome->model) + 1) * sizeof *walk.difference);
    check->is_at_end = walk.has_jumps;
    const kt_run run = tighten_run(outcome, check);
    if (check->is_short || walk.difference == NULL) {
        (void)snprintf(check->reason, sizeof check->reason, "there is not enough memory for the states");
    } else if (run_second(outcome, &walk, &run, &error) != KT_OK) {
        (void)snprintf(check->reason, sizeof check->reason, "the second run failed: %.250s", error.message);
    } else if (check->compared < 2) {
        (void)snprintf(check->reason, sizeof check->reason, "the two runs have no record in common");
    } else {
        const double factor = 1.0 / fabs(1.0 - pow(check->ratio, check->power));
        check->is_known = true;
        check->is_parted = !is_small(check->position.angle, check->motion.angle) ||
                           !is_small(check->position.length, check->motion.length);
        check->position = scale_difference(check->position, factor);
        check->velocity = scale_difference(check->velocity, factor);
    }
    free(walk.difference);
}

/* ---- results ----------------------------------------------------------------------------------------------------- */

/* Prints "3e-9 rad and 1e-9 m". */
static void say_difference(kt_difference difference, const char *angle, const char *length) {
    const bool has_both = difference.angle > 0.0 && difference.length > 0.0;
    if (difference.angle > 0.0 || !(difference.length > 0.0))
        kt_print("%.2g %s", difference.angle, angle);
    kt_print("%s", has_both ? " and " : "");
    if (difference.length > 0.0)
        kt_print("%.2g %s", difference.length, length);
}

void kt_error_check_say(const kt_error_check *check) {
    if (!check->is_known) {
        kt_print("  error unknown: %s\n", kt_show(check->reason).text);
        return;
    }
    kt_print("%s", check->is_parted ? "  error: at least " : "  error: about ");
    say_difference(check->position, "rad", "m");
    kt_print(" (largest at %.4g s), ", check->time);
    say_difference(check->velocity, "rad/s", "m/s");
    kt_print("%s; estimated by a second run with %s %.3g\n", check->is_at_end ? " at the end" : "",
             check->is_fixed ? "step" : "tolerance", check->setting);
    if (check->is_parted)
        kt_print(
            "    the two runs part: the motion is chaotic, or the setting is too coarse. 'kinetree accuracy' shows "
            "which\n");
}

json_t *kt_error_check_describe(const kt_error_check *check) {
    if (!check->is_known)
        return json_pack("{s:n, s:n, s:n, s:n, s:s}", "angle", "length", "angular_velocity", "velocity", "why",
                         check->reason);
    return json_pack("{s:o, s:o, s:o, s:o, s:b, s:f, s:b, s:s, s:f, s:f}", "angle",
                     kt_json_number(check->position.angle), "length", kt_json_number(check->position.length),
                     "angular_velocity", kt_json_number(check->velocity.angle), "velocity",
                     kt_json_number(check->velocity.length), "velocity_at_end", check->is_at_end, "time", check->time,
                     "parted", check->is_parted, "kind", check->is_fixed ? "step" : "tolerance", "second",
                     check->setting, "power", check->power);
}
