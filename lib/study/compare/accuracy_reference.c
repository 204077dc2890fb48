/* The reference of a study, its uncertainty, and the horizon up to which it holds.
 *
 * Two solutions are computed by methods that share no coefficient, dop853 and tsit5, each at the tightest tolerance
 * that works within the budget. Their difference bounds the error of the better solution unless both have the same
 * error. This difference is the uncertainty of the reference. A given reference is compared with dop853.
 *
 * Horizon. With d(t) the distance between the reference and a run whose initial state is moved by d(0) = 1e-8 or so,
 *
 *     K(t) = d(t) / d(0),   d = |q - q'| + T |v - v'|,   T = amplitude / largest speed
 *
 * is the growth factor of small errors up to t (log K / t: the finite-time Lyapunov exponent, Benettin 1976). Rounding
 * is such an error, too. If K reaches 1e6, a result has lost six digits in addition to the method's error. Then a
 * coarse step no longer distinguishes a good method from a bad method, and the study stops at this time. The study also
 * stops where the two solutions diverge, for instance at a position from which a mechanism can move on in several ways.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "compare/accuracy.h"

#include "algebra/elementary.h"
#include "kinetree/joint.h"
#include "simulation/simulation.h"

#include <float.h>
#include <math.h>
#include <stdio.h>
#include <string.h>

static const double tightest = 1e-13, loosest = 1e-9, nudge = 1e-8;
static const double small = 1e-3;  /* amplitudes below this have smaller absolute tolerances */
static const double noise = 1e3;   /* times rounding, times the growth of errors: a motion below that is rounding */
static const double parted = 1e-5; /* of the amplitude: two solutions further apart are no longer the same motion */

/* Observes a run at its records. */
typedef struct kt_walk {
    kt_accuracy_guard guard;
    kt_accuracy_states *into;          /* where states are stored; NULL: nowhere */
    const kt_accuracy_states *against; /* the states for comparison; NULL: none */
    double begin, time;                /* d(0), and T above */
    double amplification;              /* the largest K */
    double max_step;                   /* s; 0: the scene's */
    int rows;                          /* records taken */
    bool has_room;                     /* the bounding box is to be computed */
    kt_vec3 low, high;
    double reached;  /* s: the time at which the run ended */
    bool is_stopped; /* by an event of the scene */
} kt_walk;

static void widen_walk(kt_walk *walk, kt_vec3 at) { kt_box_widen(&walk->low, &walk->high, at); }

/* Extends the box by all joint origins and markers, and by the centre of mass. */
static void widen_by_bodies(kt_walk *walk, const kt_model *model, const kt_data *data) {
    kt_vec3 center;
    if (kt_mass_center(model, data, &center) > 0.0)
        widen_walk(walk, center);
    for (int body = 1; body < kt_model_body_count(model); body++) {
        widen_walk(walk, kt_point_position(model, data, body, kt_vec3_make(0.0, 0.0, 0.0)));
        for (int marker = 0; marker < kt_marker_count(model, body); marker++)
            widen_walk(walk, kt_point_position(model, data, body, kt_marker_at(model, body, marker)));
    }
}

/* d(t) of a record. */
static double walk_distance(const kt_walk *walk, const kt_record *record) {
    const kt_accuracy *study = walk->guard.study;
    const kt_accuracy_norm norm = kt_accuracy_distance(study, kt_accuracy_row(study, walk->against, record->index),
                                                       (kt_accuracy_state){record->q, record->v});
    return norm.position + walk->time * norm.velocity;
}

/* Stores and compares a record. Ends the run if small errors have grown beyond the limit; `rows` then excludes this
 * record. */
static int watch_walk(const kt_record *record, void *user) {
    kt_walk *walk = user;
    kt_accuracy *study = walk->guard.study;
    if (record->index < 0 || record->index > study->results.records)
        return 0;
    const size_t row = (size_t)record->index;
    if (walk->into != NULL) {
        memcpy(walk->into->q + row * study->nq, record->q, study->nq * sizeof(double));
        memcpy(walk->into->v + row * study->nv, record->v, study->nv * sizeof(double));
        walk->into->energy[row] = record->kinetic + record->potential;
        walk->into->quantity[row] = kt_accuracy_quantity_of(study, record);
    }
    if (walk->has_room)
        widen_by_bodies(walk, record->model, record->data);
    if (walk->against != NULL && !study->is_masked[row]) {
        const double grown = walk_distance(walk, record) / walk->begin;
        if (!(grown <= study->options.amplification))
            return 1;
        walk->amplification = fmax(walk->amplification, grown);
    }
    walk->rows = (int)record->index + 1;
    return 0;
}

/* ---- one solution ------------------------------------------------------------------------------------------------ */

static kt_status make_simulation(kt_walk *walk, const char *name, double tolerance, kt_accuracy_play *play,
                                 kt_error *error) {
    kt_accuracy *study = walk->guard.study;
    kt_run run = kt_accuracy_run(study, kt_method_find(name), true, tolerance);
    kt_simulation_options options = kt_simulation_options_default();
    if (walk->max_step > 0.0)
        run.max_step = run.max_step > 0.0 ? fmin(run.max_step, walk->max_step) : walk->max_step;
    run.record = KT_RECORD_POSITION | KT_RECORD_VELOCITY | KT_RECORD_ENERGY;
    options.kinematics = true;
    if (walk->into != NULL)
        kt_accuracy_record_quantity(study, &options);
    kt_accuracy_guard_use(&walk->guard, &options);
    return kt_accuracy_open(study, study->model, NULL, &run, &options, play, error);
}

/* A run that an event has ended stays in its last state. */
static void stay_at_end(kt_walk *walk, const kt_simulation *simulation) {
    const kt_accuracy *study = walk->guard.study;
    const kt_accuracy_states *into = walk->into;
    for (size_t row = (size_t)walk->rows; into != NULL && row <= (size_t)study->results.records; row++) {
        memcpy(into->q + row * study->nq, kt_simulation_positions(simulation), study->nq * sizeof(double));
        memcpy(into->v + row * study->nv, kt_simulation_velocities(simulation), study->nv * sizeof(double));
        into->energy[row] = row > 0 ? into->energy[row - 1] : 0.0;
        into->quantity[row] = row > 0 ? into->quantity[row - 1] : 0.0;
    }
    walk->rows = study->results.records + 1;
}

/* Runs to the end, or until the walk stops, its time is over or its log is full, which are no errors. */
static kt_status follow_walk(kt_walk *walk, const kt_accuracy_play *play, kt_error *error) {
    kt_simulation *simulation = play->simulation;
    if (walk->guard.log != NULL)
        kt_instants_start(walk->guard.log, simulation);
    const kt_status status = kt_simulation_run(simulation, watch_walk, walk, error);
    walk->reached = kt_simulation_time(simulation);
    if (walk->guard.log != NULL)
        kt_instants_watch(walk->guard.log, simulation);
    walk->is_stopped = status == KT_OK && kt_simulation_stopped(simulation) != NULL;
    if (walk->is_stopped)
        stay_at_end(walk, simulation);
    return status == KT_ERROR_CALLBACK || walk->guard.late ? KT_OK : status;
}

/* Solves at the tightest tolerance that works, from *tolerance upwards, and writes this tolerance. */
static kt_status solve_reference(kt_walk *start, const char *method, double *tolerance, kt_simulation_counts *counts,
                                 kt_error *error) {
    kt_status status;
    const kt_walk fresh = *start;
    for (;;) {
        kt_accuracy_play play;
        *start = fresh;
        status = make_simulation(start, method, *tolerance, &play, error);
        if (status != KT_OK)
            return status;
        status = follow_walk(start, &play, error);
        *counts = kt_simulation_counts_of(play.simulation);
        const kt_status closed = kt_accuracy_close(&play, status == KT_OK ? error : NULL);
        status = status == KT_OK ? closed : status;
        if (status != KT_ERROR_STEP || *tolerance > 0.5 * loosest)
            return status;
        *tolerance *= 10.0;
    }
}

/* Keeps the first `rows` records. */
static void shorten_reference(kt_accuracy *study, int rows, kt_accuracy_cut cut) {
    kt_accuracy_results *results = &study->results;
    if (rows > results->records)
        return;
    results->records = rows > 1 ? rows - 1 : 1;
    results->duration = results->records * results->interval;
    results->cut = cut;
}

/* ---- scales ------------------------------------------------------------------------------------------------------ */

/* The length that counts as much as 1 rad: the longest edge of the box of the motion, if the scene has angles and
 * lengths; else 1 m. */
static void find_length(kt_accuracy *study, const kt_walk *walk) {
    kt_accuracy_results *results = &study->results;
    results->unit = kt_accuracy_find_unit(study->model);
    const kt_vec3 size = kt_vec3_sub(walk->high, walk->low);
    const double edge = fmax(size.x, fmax(size.y, size.z));
    results->length = results->unit == KT_ACCURACY_MIXED && edge > 0.0 && isfinite(edge) ? edge : 1.0;
}

/* Computes the amplitude: the largest distance from the initial state. Returns the largest speed, for which the
 * velocities of `begin` are zero meanwhile. */
static double find_amplitude(kt_accuracy *study, const kt_accuracy_states *states) {
    kt_accuracy_results *results = &study->results;
    double speed = 0.0;
    results->amplitude = 0.0;
    memset(study->begin + study->nq, 0, study->nv * sizeof(double));
    for (int k = 0; k <= results->records; k++) {
        const kt_accuracy_norm norm = kt_accuracy_distance(
            study, (kt_accuracy_state){study->begin, study->begin + study->nq}, kt_accuracy_row(study, states, k));
        results->amplitude = fmax(results->amplitude, norm.position);
        speed = fmax(speed, norm.velocity);
    }
    memcpy(study->begin + study->nq, states->v, study->nv * sizeof(double));
    return speed;
}

/* ---- growth ------------------------------------------------------------------------------------------------------ */

/* Compares the reference with a run whose initial state is moved a little in all directions. Returns the number of
 * records before the limit; if the neighbouring motion cannot be run, all records, and the growth is then unknown. */
static int find_growth(kt_accuracy *study, const kt_accuracy_states *states, double speed) {
    kt_accuracy_results *results = &study->results;
    kt_walk walk = {
        .guard = kt_accuracy_guard_make(study, 0.1, 8.0), .against = states, .begin = 1.0, .amplification = 1.0};
    kt_accuracy_play play;
    walk.time = speed > 0.0 && results->amplitude > 0.0 ? results->amplitude / speed : 1.0;
    walk.rows = results->records + 1;
    if (make_simulation(&walk, "dop853", 1e-12, &play, NULL) != KT_OK)
        return walk.rows;
    for (size_t i = 0; i < study->nv; i++)
        study->difference[i] = nudge * results->absolute_scale *
                               cos(1.0 + 2.39996 * (double)i); /* multiples of the golden angle: no symmetry */
    kt_position_add(study->model, study->begin, study->difference, study->moved);
    if (kt_accuracy_restart(&play, study->moved, study->begin + study->nq, NULL) == KT_OK) {
        const kt_record first = {.q = kt_simulation_positions(play.simulation),
                                 .v = kt_simulation_velocities(play.simulation)};
        walk.begin = walk_distance(&walk, &first);
        const bool failed =
            walk.begin > 0.01 * nudge * results->absolute_scale && follow_walk(&walk, &play, NULL) != KT_OK;
        if (failed || walk.guard.late) /* the limit was not reached */
            walk.rows = results->records + 1;
    }
    if (kt_accuracy_close(&play, NULL) != KT_OK)
        return results->records + 1;
    results->amplification = walk.amplification;
    results->growth = log(walk.amplification) / ((walk.rows > 1 ? walk.rows - 1 : 1) * results->interval);
    return walk.rows;
}

/* ---- the second solution ----------------------------------------------------------------------------------------- */

/* The tolerance of the second solution. A method of order 5 takes about six times the evaluations of dop853 at 1e-13.
 * For each decade of a looser tolerance, the number falls by a factor of 10^(1/5). */
static double choose_tolerance(const kt_accuracy *study, double used) {
    double tolerance = tightest;
    if (study->options.clock == NULL)
        return tolerance;
    while (tolerance < 0.1 * loosest && 6.0 * used * pow(tolerance / tightest, -0.2) > 0.15 * study->options.budget)
        tolerance *= 10.0;
    return tolerance;
}

/* The largest differences of two solutions before they diverge. Returns the number of records before this
 * divergence. */
static int compare_solutions(const kt_accuracy *study, const kt_accuracy_states *a, const kt_accuracy_states *b,
                             int rows, kt_accuracy_error *error) {
    const kt_accuracy_results *results = &study->results;
    memset(error, 0, sizeof *error);
    for (int k = 0; k < rows; k++) {
        const kt_accuracy_norm norm =
            kt_accuracy_distance(study, kt_accuracy_row(study, a, k), kt_accuracy_row(study, b, k));
        if (study->is_masked[k])
            continue;
        error->end_position = norm.position;
        error->end_velocity = norm.velocity;
        if (!(norm.position <= parted * fmax(results->amplitude, nudge * results->absolute_scale)))
            return k;
        error->position = fmax(error->position, norm.position);
        error->velocity = fmax(error->velocity, norm.velocity);
        error->energy = fmax(error->energy, fabs(a->energy[k] - b->energy[k]));
        error->quantity = fmax(error->quantity, fabs(a->quantity[k] - b->quantity[k]));
    }
    return rows;
}

/* The longest step of the second solution: a hundredth of the shortest feature of the functions of time. The second
 * solution detects features that the reference steps over. The step becomes longer if a tenth of the budget would not
 * suffice. 0: no limit. */
static double choose_second_step(const kt_accuracy *study) {
    const double duration = study->results.duration, evaluations = 6.0;
    const double shortest = kt_simulation_shortest_feature(study->model, duration);
    if (!isfinite(shortest))
        return 0.0;
    double most = (double)study->options.run_evaluations / evaluations;
    if (study->options.clock != NULL && study->evaluation > 0.0)
        most = fmin(most, 0.1 * study->options.budget / (evaluations * study->evaluation));
    return fmax(0.01 * shortest, duration / fmax(most, 1.0));
}

/* The second solution of a computed reference, by tsit5. Fills study->second. */
static kt_status find_second(kt_accuracy *study, double used, kt_error *error) {
    kt_accuracy_results *results = &study->results;
    kt_simulation_counts counts;
    kt_walk walk = {.guard = kt_accuracy_guard_make(study, 0.25, 16.0), .into = &study->second};
    walk.guard.log = &study->second_log;
    results->check = kt_method_find("tsit5");
    results->check_tolerance = choose_tolerance(study, used);
    results->check_step = walk.max_step = choose_second_step(study);
    const kt_status status = solve_reference(&walk, results->check->name, &results->check_tolerance, &counts, error);
    if (status != KT_OK)
        return status;
    shorten_reference(study, walk.rows, KT_ACCURACY_LATE);
    return KT_OK;
}

/* ---- the whole --------------------------------------------------------------------------------------------------- */

/* Results of dop853's solution. */
typedef struct kt_first {
    double used, reached; /* s: clock time used; time of the motion that was reached */
    bool late;            /* the time budget ended before the motion */
    bool is_stopped;      /* an event ended the motion */
    int taken, grown;     /* numbers of records: of the solution; before small errors are large */
} kt_first;

static kt_status say_late(const kt_accuracy *study, const kt_first *first, kt_error *error) {
    const double asked = study->results.asked;
    char needed[64] = "";
    if (first->reached > 0.0 && study->options.clock != NULL)
        snprintf(needed, sizeof needed, ", all of it some %.2g s", first->used * asked / first->reached);
    return kt_error_set(error, KT_ERROR_STEP, "reference",
                        "of %g s it came to %.3g s in %.2g s of the processor's time%s: a larger budget or a shorter "
                        "duration is needed",
                        asked, first->reached, first->used, needed);
}

/* Solves at the tightest tolerance at which the motion advances: below the noise of a model's accelerations steps
 * become tiny. */
static kt_status find_solution(kt_accuracy *study, kt_accuracy_states *states, kt_walk *walk, kt_first *first,
                               double *tolerance, kt_simulation_counts *counts, kt_error *error) {
    *tolerance = tightest;
    for (;;) {
        *walk = (kt_walk){.guard = kt_accuracy_guard_make(study, 0.15, 4.0), .into = states, .has_room = true};
        walk->low = kt_vec3_make(HUGE_VAL, HUGE_VAL, HUGE_VAL);
        walk->high = kt_vec3_make(-HUGE_VAL, -HUGE_VAL, -HUGE_VAL);
        walk->guard.log = &study->log;
        const double start = kt_accuracy_now(study);
        const kt_status status = solve_reference(walk, "dop853", tolerance, counts, error);
        if (status != KT_OK)
            return status;
        *first = (kt_first){.used = kt_accuracy_now(study) - start,
                            .reached = walk->reached,
                            .late = walk->guard.late,
                            .is_stopped = walk->is_stopped,
                            .taken = walk->rows};
        if (!walk->guard.late || walk->reached >= 0.02 * study->results.asked)
            return KT_OK;
        if (*tolerance > 0.5 * loosest)
            return say_late(study, first, error);
        *tolerance *= 100.0;
    }
}

/* Solves by dop853, either as the reference or as the check of a given one. Finds the scales, the cost of an evaluation
 * and the growth of small errors, too. */
static kt_status find_first(kt_accuracy *study, kt_accuracy_states *states, kt_first *first, kt_error *error) {
    kt_accuracy_results *results = &study->results;
    kt_simulation_counts counts;
    kt_walk walk;
    double *tolerance = results->reference != NULL ? &results->reference_tolerance : &results->check_tolerance;
    const kt_status status = find_solution(study, states, &walk, first, tolerance, &counts, error);
    if (status != KT_OK)
        return status;
    shorten_reference(study, walk.rows, study->log.is_full ? KT_ACCURACY_CROWDED : KT_ACCURACY_LATE);
    kt_accuracy_mask(study, &study->log);
    study->evaluation = first->used / (double)counts.evaluations;
    study->reference_steps = (double)counts.steps / results->duration;
    memcpy(study->begin, states->q, study->nq * sizeof(double));
    memcpy(study->begin + study->nq, states->v, study->nv * sizeof(double));
    find_length(study, &walk);
    first->grown = find_growth(study, states, find_amplitude(study, states));
    return KT_OK;
}

/* Rejects a scene in which nothing moves but rounding. The largest coordinate has a rounding, which the motion
 * amplifies by at most the growth factor. */
static kt_status reject_rest(const kt_accuracy *study, kt_error *error) {
    const kt_accuracy_results *results = &study->results;
    double largest = 0.0;
    for (size_t i = 0; i < study->nq; i++)
        largest = fmax(largest, fabs(study->begin[i]));
    const double growth = fmax(results->amplification, 1.0);
    if (results->subject == KT_ACCURACY_QUANTITY ||
        (results->amplitude > noise * DBL_EPSILON * growth * largest && results->amplitude > 0.0))
        return KT_OK;
    if (growth > 1.0 / noise / nudge)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "accuracy",
            "the motion starts at an unstable rest: rounding alone moves it (by %.2g in %.4g s, in which "
            "a small error grows by %.2g); a start next to the rest is needed",
            results->amplitude, results->duration, growth);
    return kt_error_set(error, KT_ERROR_ARGUMENT, "accuracy",
                        "nothing moves in %.4g s, so that no run has an error; give a start or a force that moves the "
                        "mechanism",
                        results->duration);
}

/* Whether absolute tolerances must be smaller, because the amplitude is far below 1. If so, chooses the tolerances. */
static bool is_tiny(kt_accuracy_results *results) {
    if (results->absolute_scale != 1.0 || !(results->amplitude > 0.0) || results->amplitude >= small)
        return false;
    results->absolute_scale = pow(10.0, floor(log10(results->amplitude)));
    return true;
}

/* Computes the reference. If the horizon is short, the reference is computed again, with all records within the
 * horizon. */
static kt_status find_computed(kt_accuracy *study, kt_error *error) {
    kt_accuracy_results *results = &study->results;
    const int records = results->records;
    kt_first first = {0};
    kt_accuracy_cut cut = KT_ACCURACY_WHOLE;
    results->reference = kt_method_find("dop853");
    for (int i = 0; i < 5; i++) {
        const double interval = results->interval;
        const kt_status status = find_first(study, &study->reference, &first, error);
        if (status != KT_OK)
            return status;
        const kt_status moves = reject_rest(study, error);
        if (moves != KT_OK)
            return moves;
        if (is_tiny(results))
            continue;
        if (first.is_stopped && first.reached < results->duration) {
            results->duration = first.reached;
            cut = KT_ACCURACY_STOPPED;
        } else if (first.late && 8 * first.taken < records) {
            results->duration = 0.5 * first.reached;
            cut = KT_ACCURACY_LATE;
        } else if (2 * first.grown < records && first.grown < first.taken) {
            results->duration = (first.grown > 1 ? first.grown - 1 : 1) * interval;
            cut = KT_ACCURACY_GROWTH;
        } else {
            break;
        }
        results->interval = results->duration / records;
        results->records = records;
        results->cut = cut;
    }
    if (first.taken < 2)
        return say_late(study, &first, error);
    shorten_reference(study, first.grown, KT_ACCURACY_GROWTH);
    return find_second(study, first.used, error);
}

/* Checks a given reference by dop853, whose energy is used. */
static kt_status find_given(kt_accuracy *study, kt_error *error) {
    const kt_reference *given = study->options.reference;
    const size_t rows = (size_t)given->count;
    kt_first first = {0};
    memcpy(study->reference.q, given->q, rows * study->nq * sizeof(double));
    memcpy(study->reference.v, given->v, rows * study->nv * sizeof(double));
    study->results.check = kt_method_find("dop853");
    const kt_status status = find_first(study, &study->second, &first, error);
    if (status != KT_OK)
        return status;
    if (first.taken < 2)
        return say_late(study, &first, error);
    const kt_status moves = reject_rest(study, error);
    if (moves != KT_OK)
        return moves;
    shorten_reference(study, first.grown, KT_ACCURACY_GROWTH);
    memcpy(study->reference.energy, study->second.energy, rows * sizeof(double));
    return KT_OK;
}

/* A quantity that changes by less than this part of its magnitude counts as constant: the rest is the error of the
 * reference, as in the total energy of a motion without friction. */
static const double constant = 1e-6;

/* Sets the range of the study's subject. speed: the largest one in the norm. */
static kt_status find_range(kt_accuracy *study, double speed, kt_error *error) {
    kt_accuracy_results *results = &study->results;
    results->range = results->subject == KT_ACCURACY_VELOCITIES ? speed : results->amplitude;
    if (results->subject != KT_ACCURACY_QUANTITY)
        return KT_OK;
    double low = HUGE_VAL, high = -HUGE_VAL;
    for (int k = 0; k <= results->records; k++) {
        const double value = study->reference.quantity[k];
        if (!isfinite(value))
            return kt_error_set(error, KT_ERROR_ARGUMENT, "quantity",
                                "it is not finite at %.6g s: no error of it can be measured; a duration that ends "
                                "before helps",
                                k * results->interval);
        low = fmin(low, value);
        high = fmax(high, value);
    }
    const double magnitude = fmax(fabs(low), fabs(high));
    results->range = high - low > constant * magnitude ? high - low : magnitude;
    if (results->range > 0.0)
        return KT_OK;
    return kt_error_set(error, KT_ERROR_ARGUMENT, "quantity",
                        "it is zero during the whole motion, hence it has no error to study");
}

kt_status kt_accuracy_find_reference(kt_accuracy *study, kt_error *error) {
    kt_accuracy_results *results = &study->results;
    kt_status status = kt_accuracy_report(study, 0.0, "the reference", error);
    if (status == KT_OK)
        status = study->options.reference != NULL ? find_given(study, error) : find_computed(study, error);
    if (status != KT_OK)
        return status;
    const int rows =
        compare_solutions(study, &study->reference, &study->second, results->records + 1, &results->uncertainty);
    shorten_reference(study, rows, KT_ACCURACY_DISAGREEMENT);
    kt_accuracy_mask(study, &study->log);
    kt_instants_compare(study, &study->log, &study->second_log, &results->uncertainty);
    if (rows < 2 && study->options.reference == NULL)
        return kt_error_set(
            error, KT_ERROR_STEP, "reference",
            "%s and %s part before the first record, at %.3g s: nothing can be measured there; a shorter "
            "duration helps",
            results->reference->name, results->check->name, results->interval);
    if (rows < 2)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "reference",
                            "it parts from what %s computes at once: %.3g in the norm of the study, with an amplitude "
                            "of %.3g; is it of this scene, with the same start?",
                            results->check->name, results->uncertainty.end_position, results->amplitude);
    kt_accuracy_select(study, &results->uncertainty);
    return find_range(study, find_amplitude(study, &study->reference), error);
}
