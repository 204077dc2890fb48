/* Steps on hard contacts that fail, or that gain energy.
 *
 * Slip of a contact may end, or turn, within a step. Before the search for events has shortened the step, stages lie
 * after that time. The friction at these stages has a direction in which the contact may wedge, so that no acceleration
 * exists (evaluate/slip.c). For the same reason an implicit method may find no solution of its equations. Therefore the
 * step is repeated with a quarter of its length, as often as necessary. Adaptive methods shorten their steps
 * themselves, except where a value of an event cannot be computed.
 *
 * The dense output of such a step may also show an event that no shorter step reaches. Fixed steps behind an event that
 * was missed, or behind a failed try, grow slowly, also across impacts: the next full step would fail likewise.
 *
 * Friction of a contact that slips may turn fast, or have no bound (Painleve's paradox). A fixed step that does not
 * resolve it may end with more energy than it began with, although nothing supplies any. Such a step is repeated in the
 * same way, down to `finest` of its length. Between both lengths, errors are larger than the work of friction.
 *
 * If no length passes, friction wedges a contact in the present state, or behind it within the shortest step, or slow
 * slip turns within that step. Slow slip then comes to rest, or the contact is freed (contact/contact_part.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"
#include "integrator/integrator.h"

#include <float.h>
#include <math.h>

/* Tries that are shortened within the length of a fixed step. */
enum { MOST = 10000 };

/* The shortest step, which is as long as an instant of events, s. */
static double shortest_step_at(const kt_simulation *simulation, double t) {
    return fmax(kt_simulation_instant(simulation), kt_time_step(t));
}

/* Each try of a step that failed is shorter by this factor. Each later step is longer by at most this factor. */
static const double growth = 4.0;

/* Steps below this part of a fixed step are not repeated for their energy. */
static const double finest = 1.0 / 4096.0;
/* A growth of the energy below these parts of the kinetic and of the potential energies is an error of free flight, or
 * rounding. */
static const double flight = 1e-9, rounding = 16.0 * DBL_EPSILON;

/* Whether a fixed step with slip, on which only forces act that cannot supply energy, raised the energy T + V by more
 * than errors of free flight. */
static bool gains_energy(kt_simulation *simulation) {
    const kt_simulation_memory *memory = &simulation->memory;
    const kt_integrator *integrator = simulation->integrator;
    const double t0 = kt_integrator_previous_time(integrator), h = kt_integrator_time(integrator) - t0;
    kt_simulation_energy from, to;
    kt_error ignored;
    if (!(h > finest * simulation->step) || simulation->step == 0.0 || simulation->model->n.slip == 0 ||
        simulation->options.acceleration != NULL || memory->now.torque || memory->now.wrenches ||
        !(h > growth * shortest_step_at(simulation, t0)) || memory->retries + 1 >= MOST ||
        kt_model_energetics(simulation->model) == KT_ENERGY_SUPPLIED ||
        kt_simulation_find_energy(simulation, integrator->previous_y, &from, &ignored) != KT_OK ||
        kt_simulation_find_energy(simulation, integrator->y, &to, &ignored) != KT_OK)
        return false;
    const double growth_of_energy = to.kinetic + to.potential - from.kinetic - from.potential;
    return growth_of_energy >
           flight * (from.kinetic + to.kinetic) + rounding * (fabs(from.potential) + fabs(to.potential));
}

/* Fails a step along which contacts that slip gained energy, so that it is repeated. */
/* NOLINTNEXTLINE(readability-non-const-parameter): a hook of the phase `check` */
static kt_status check_energy(kt_simulation *simulation, kt_step_progress *progress, kt_verdict *verdict,
                              kt_error *error) {
    kt_integrator *integrator = simulation->integrator;
    (void)progress, (void)verdict, (void)error;
    if (!gains_energy(simulation))
        return KT_OK;
    simulation->cause.code = KT_OK;
    kt_integrator_retreat(integrator, kt_integrator_time(integrator) - kt_integrator_previous_time(integrator));
    return KT_ERROR_STEP;
}

/* The length of the step that failed. A step that is undone is the proposal of the next one. */
static double failed_length_of(const kt_simulation *simulation, double t_limit) {
    const kt_integrator_memory *m = &simulation->integrator->memory;
    const double step = simulation->step;
    return (step > 0.0 ? fmin(t_limit, m->origin + (double)(m->grid + 1) * step) : fmin(t_limit, m->t + m->next_step)) -
           m->t;
}

/* Whether a shorter step may pass. A fixed step also fails if Newton's iteration does not converge. */
static bool may_pass(const kt_simulation *simulation, kt_status status) {
    const kt_status cause = simulation->cause.code;
    if (simulation->step > 0.0 && cause == KT_OK)
        return status == KT_ERROR_STEP || status == KT_ERROR_NOT_FINITE;
    return kt_simulation_is_recoverable(cause) && simulation->ahead && status != KT_ERROR_STEP;
}

/* After a failure, steps grow from its length by a factor at most, until they are fixed steps again. A time step may
 * have gone on to a time whose rounding is larger. */
static void limit_step(kt_simulation *simulation, kt_step_progress *progress) {
    const double t = simulation->integrator->memory.t;
    double *h = &simulation->memory.shortened;
    simulation->contacts->retry = (kt_contact_retry){.t_limit = progress->t_limit};
    if (!(*h > 0.0))
        return;
    *h = fmax(*h, shortest_step_at(simulation, t));
    progress->t_limit = fmin(progress->t_limit, t + *h);
    *h = *h < simulation->step ? growth * *h : 0.0;
}

/* Friction of slow slip turns behind its rest. An implicit method may then find no solution, and a fixed step of any
 * method may gain energy. Such a try counts like a turn (contact/directions.c). Slip that is faster has no turns at the
 * beginning of the next step. */
static void count_turns(kt_simulation *simulation) {
    for (int k = 0; k < simulation->contacts->sides; k++)
        if (kt_contact_is_slipping(simulation, k))
            simulation->contact_state[k].turns++;
}

/* Whether the step may be tried with a part of its length, which becomes its end *t_limit. */
static bool shorten_step(kt_simulation *simulation, kt_status status, double *t_limit) {
    kt_simulation_memory *memory = &simulation->memory;
    kt_integrator_memory *m = &simulation->integrator->memory;
    const double h = failed_length_of(simulation, *t_limit) / growth;
    if (!may_pass(simulation, status) || !(h > shortest_step_at(simulation, m->t)))
        return false;
    const bool is_within = memory->retries > 0 && m->t - memory->retried_since <= simulation->step;
    memory->retried_since = is_within ? memory->retried_since : m->t;
    memory->retries = is_within ? memory->retries + 1 : 1;
    if (memory->retries > MOST)
        return false;
    m->counts.rejected++;
    if (status == KT_ERROR_STEP)
        count_turns(simulation);
    memory->shortened = growth * h;
    *t_limit = m->t + h;
    return true;
}

/* Shorter steps are tried first. If none may pass, a contact that friction wedges is freed. */
static bool retry_step(kt_simulation *simulation, kt_step_progress *progress, kt_status failed) {
    kt_contact_retry *retry = &simulation->contacts->retry;
    if (simulation->integrator->exhausted) /* a time step follows (bounded_step.c) */
        return false;
    if (shorten_step(simulation, failed, &progress->t_limit))
        return true;
    simulation->memory.shortened = 0.0;
    progress->t_limit = retry->t_limit;
    return kt_contacts_free_wedged(simulation, &retry->attempt);
}

static bool retries_steps(const kt_simulation *simulation) {
    return simulation->contacts != NULL && !simulation->steps_over_contacts;
}

const kt_part kt_retry_part = {
    .is_active = retries_steps, .limit = limit_step, .check = check_energy, .retry = retry_step};
