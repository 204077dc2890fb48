/* Fixed steps with a bound of their evaluations.
 *
 * Events resolve each impact and each change of friction. If much happens within a fixed step, the step is divided into
 * many parts, and its cost has no bound. A control loop cannot wait. With kt_simulation_options.step_evaluations = E, a
 * step of the grid of fixed steps takes at most E evaluations of the accelerations. Before each try, with the number n
 * of evaluations since the beginning of the step,
 *
 *     n + try + time step <= E     events are followed
 *     otherwise                    one time step (moreau.c) completes the step
 *
 * A run can wait, if the time goes on: 10,000 impacts within a step may be its true motion, and a time step of this
 * length would lose them. With kt_simulation_options.stall_evaluations = E, n counts from the last instant that is a
 * part 1 / PARTS of the step earlier. A step that advances is then never replaced, and one that stalls is.
 *
 * A time step takes two evaluations, whatever happens within it. Its impulses obey Coulomb's law with the same solver,
 * and its error is of the first order in its length. A try that fails, and that no shorter try replaces, is also
 * replaced by a time step. Events of the caller are found within a time step. Each of them divides the time step.
 *
 * Records within a time step and at its end are those of time stepping (moreau_record.c): forces are means over it.
 * Behind them, contacts are resolved at the end of the step as after an impact, and are events again. If they cannot
 * be resolved, because a time step left one deeper than events allow, the next step is a time step, too. This holds at
 * the instant of an impact, too. The counts have the number of time steps (kt_contact_counts.completed). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "contact/contact.h"
#include "contact/moreau.h"
#include "integrator/integrator.h"

#include <math.h>

/* Evaluations of a time step and of the slope at its beginning, and of a try besides its stages: the slopes at both
 * ends. The stages of the dense output count, too, because events are sought in it. An implicit method takes a number
 * of evaluations that depends on its iterations: usual tries have room, and a try that needs more is stopped. */
enum { TIME_STEP = 3, ENDS = 2, IMPLICIT_TRY = 64, PARTS = 1000 };

/* kt_simulation_memory.leaps: steps are time steps; and the last one has ended, but contacts are not events yet. */
enum { LEAPS = 1, ENDED = 2 };

uint64_t kt_step_evaluations_least(const kt_method *method) {
    const int most = kt_method_family_of(method)->stages_max, stages = most > 0 ? most : method->stages;
    return TIME_STEP + ENDS + (uint64_t)(kt_method_needs_newton(method) ? IMPLICIT_TRY : stages + method->dense_stages);
}

static bool is_bounded(const kt_simulation *simulation) {
    return simulation->contacts != NULL && kt_bounds_steps(&simulation->options);
}

/* The end of a count that begins at `begun`. limit: 0 for none. */
static uint64_t end_count(uint64_t begun, uint64_t limit) {
    return limit == 0 || limit > UINT64_MAX - begun ? UINT64_MAX : begun + limit;
}

/* The number of evaluations at which the step, or its present part, has used up its bound. */
static uint64_t find_bound(const kt_simulation *simulation) {
    const kt_simulation_options *options = &simulation->options;
    const uint64_t of_step = end_count(simulation->memory.step_begun, options->step_evaluations),
                   of_part = end_count(simulation->memory.part_begun, options->stall_evaluations);
    return of_step < of_part ? of_step : of_part;
}

/* Whether one more try would exceed the bound. */
static bool is_exhausted(const kt_simulation *simulation) {
    const kt_integrator *it = simulation->integrator;
    return it->memory.counts.evaluations + kt_step_evaluations_least(it->method) > find_bound(simulation);
}

/* Lets the integrator take time steps, or steps of its method again. Slopes of the other kind are not valid. */
static void switch_integrator(kt_simulation *simulation, bool leaps) {
    kt_integrator *it = simulation->integrator;
    it->family = kt_method_family_of(leaps ? &kt_method_moreau_jean : it->method);
    it->leap = leaps ? &kt_moreau_leap : NULL;
    it->gives_end_derivative = leaps || it->method->fsal;
    it->stages_known = it->dense_known = false;
    it->derivative_slot = leaps ? 0 : -1; /* a time step needs no slope */
}

/* Lets the simulation take time steps. */
static void take_leaps(kt_simulation *simulation) {
    simulation->steps_over_contacts = true;
    kt_moreau_open(simulation);
    switch_integrator(simulation, true);
    kt_parts_list(simulation);
}

/* From now on, steps are time steps. Memories of contacts as events end. Forces of a time step before remain. */
static void begin_leaps(kt_simulation *simulation) {
    simulation->memory.leaps = LEAPS;
    for (size_t k = 0; k < simulation->contact_count; k++) {
        kt_contact_memory *state = &simulation->contact_state[k];
        state->closes_at = state->parts_at = state->opens_at = 0.0;
        state->left_at = state->held = -HUGE_VAL;
        simulation->event_root[k].due = false;
    }
    take_leaps(simulation);
}

/* From now on, contacts are events again. */
static void end_leaps(kt_simulation *simulation) {
    simulation->memory.leaps = 0;
    simulation->steps_over_contacts = false;
    for (size_t k = 0; k < simulation->contact_count; k++)
        simulation->contact_state[k].counted = simulation->contact_state[k].closed;
    kt_parts_list(simulation);
    kt_simulation_take_model(simulation, simulation->model); /* its callbacks */
    switch_integrator(simulation, false);
}

/* ---- hooks ------------------------------------------------------------------------------------------------------- */

/* Counts the evaluations of each fixed step from its beginning, and those of a part of it. */
static kt_status enter_bounded(kt_simulation *simulation, const kt_step_progress *progress, kt_error *error) {
    const kt_integrator_memory *m = &simulation->integrator->memory;
    kt_simulation_memory *memory = &simulation->memory;
    /* Instants of events may lie within rounding of a point of the grid. A new start begins all counts anew. */
    if ((m->on_grid && m->grid != memory->step_grid) || memory->step_begun > m->counts.evaluations) {
        memory->step_begun = m->counts.evaluations;
        memory->step_grid = m->grid;
        memory->part_since = -HUGE_VAL;
    }
    const double t = kt_integrator_time(simulation->integrator);
    if (!(fabs(t - memory->part_since) <= simulation->step / PARTS)) {
        memory->part_begun = m->counts.evaluations;
        memory->part_since = t;
    }
    simulation->contacts->bounded_end = progress->t_limit;
    (void)error;
    return KT_OK;
}

/* Before a try: bounds its evaluations by those that are left for the step. If none are left, the rest of the step
 * is resolved by time stepping. */
static void prepare_bounded(kt_simulation *simulation, kt_step_progress *progress) {
    kt_integrator *it = simulation->integrator;
    const kt_simulation_memory *memory = &simulation->memory;
    const bool exhausted = !memory->leaps && is_exhausted(simulation);
    if (exhausted) {
        begin_leaps(simulation);
        progress->t_limit = simulation->contacts->bounded_end;
    }
    it->exhausted = false;
    it->evaluations_end = memory->leaps || !kt_method_needs_newton(it->method) ? 0 : find_bound(simulation) - TIME_STEP;
}

static void end_bounded(kt_simulation *simulation) { simulation->integrator->evaluations_end = 0; }

bool kt_bounded_step_replaces(kt_simulation *simulation, kt_status failed) {
    const bool helps = simulation->integrator->exhausted || failed == KT_ERROR_STEP || failed == KT_ERROR_CONSTRAINT ||
                       failed == KT_ERROR_SINGULAR || failed == KT_ERROR_NOT_FINITE;
    if (!is_bounded(simulation) || simulation->memory.leaps || !helps || simulation->cause.code == KT_ERROR_CALLBACK)
        return false;
    simulation->memory.beyond = false;
    begin_leaps(simulation);
    return true;
}

/* A step that fails is repeated as a time step, unless a callback failed. */
static bool retry_bounded(kt_simulation *simulation, kt_step_progress *progress, kt_status failed) {
    if (!kt_bounded_step_replaces(simulation, failed))
        return false;
    progress->t_limit = simulation->contacts->bounded_end;
    return true;
}

/* Resolves contacts behind a time step. Contacts that were closed in it touch, and do not bounce. */
static kt_status follow_time_step(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double t = kt_integrator_time(simulation->integrator), *y = kt_integrator_state(simulation->integrator);
    kt_status status = kt_contacts_find_equations(c, simulation->model, t, y, y + simulation->size.nq, false, error);
    for (int k = 0; status == KT_OK && k < c->sides; k++) {
        c->item[k].meets = simulation->contact_state[k].closed != 0;
        if (c->item[k].meets && !(c->gap[k] <= kt_contact_deep * c->item[k].unit))
            status = kt_error_set(error, KT_ERROR_CONSTRAINT, "contact", "a time step has not closed it yet");
    }
    c->rests = c->stops = true;
    if (status == KT_OK)
        status = kt_phase_settle(simulation, error);
    c->rests = c->stops = false;
    return status;
}

/* A time step does work that powers do not show. The estimate of works takes the change of the energy, which it does
 * not judge. */
static void account_time_step(kt_simulation *simulation) {
    const kt_integrator *it = simulation->integrator;
    kt_power_points *powers = &simulation->memory.powers;
    kt_simulation_energy from, to;
    kt_error ignored;
    powers->count = 0;
    if (!simulation->works.watches || kt_simulation_find_energy(simulation, it->previous_y, &from, &ignored) != KT_OK ||
        kt_simulation_find_energy(simulation, it->y, &to, &ignored) != KT_OK)
        return;
    const double lost = from.kinetic + from.potential - (to.kinetic + to.potential);
    powers->sum[1].net += lost;
    powers->sum[1].error += fabs(lost);
}

/* Counts a time step. */
static kt_status accept_bounded(kt_simulation *simulation, kt_error *error) {
    kt_contact_counts *counts = &simulation->memory.contacts;
    (void)error;
    if (!simulation->memory.leaps)
        return KT_OK;
    account_time_step(simulation);
    if (counts->completed++ == 0)
        simulation->memory.completed.time = kt_integrator_previous_time(simulation->integrator);
    simulation->memory.leaps = ENDED;
    return KT_OK;
}

/* After a time step, contacts become events again if the state permits this. */
static kt_status arrive_bounded(kt_simulation *simulation, kt_error *error) {
    kt_error ignored;
    (void)error;
    if (simulation->memory.leaps != ENDED)
        return KT_OK;
    end_leaps(simulation);
    if (follow_time_step(simulation, &ignored) != KT_OK) {
        simulation->memory.beyond = false;
        begin_leaps(simulation);
    } else {
        for (size_t k = 0; k < simulation->contact_count; k++)
            kt_clear(simulation->contact_state[k].force, sizeof simulation->contact_state[k].force);
    }
    return KT_OK;
}

/* Follows a state that was copied back. */
static void resume_bounded(kt_simulation *simulation) {
    if (simulation->steps_over_contacts == (simulation->memory.leaps != 0))
        return;
    if (simulation->memory.leaps)
        take_leaps(simulation);
    else
        end_leaps(simulation);
}

const kt_part kt_bounded_step_part = {.is_active = is_bounded,
                                      .enter = enter_bounded,
                                      .prepare = prepare_bounded,
                                      .accept = accept_bounded,
                                      .arrive = arrive_bounded,
                                      .retry = retry_bounded,
                                      .count = end_bounded,
                                      .resume = resume_bounded};
