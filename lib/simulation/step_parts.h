/* The parts of kt_simulation_take_step, for callers that try the steps of several simulations together
 * (batch/ensemble.c).
 *
 * First, `begin_step` puts inputs into force and limits the step to the next breakpoint. Next, `begin_watch` evaluates
 * events at the beginning of the step. While `again` is true, each try takes three calls: `begin_try`, an accepted step
 * of the integrator to *t_limit, and `check_step`.
 *
 * The last call, `check_step`, undoes a step that leapt over a contact or that contains an event. The end of the next
 * try is then *t_limit. */
#ifndef KT_SIMULATION_STEP_PARTS_H
#define KT_SIMULATION_STEP_PARTS_H

#include "integrator/integrator.h"
#include "simulation/simulation.h"

static inline kt_status kt_simulation_begin_step(kt_simulation *simulation, double *t_limit, kt_error *from) {
    simulation->cause.code = KT_OK;
    kt_status status = simulation->memory.pending ? kt_simulation_inputs_commit(simulation, from) : KT_OK;
    if (status == KT_OK && simulation->corners.any) {
        status = kt_simulation_pass_corner(simulation, from);
        kt_simulation_clip_step(simulation, t_limit);
    }
    return status;
}
static inline kt_status kt_simulation_begin_watch(kt_simulation *simulation, kt_error *error) {
#if KT_HAS_EVENTS
    simulation->event_searched = false;
#endif
    return KT_HAS_EVENTS && simulation->watch != NULL ? simulation->watch->begin(simulation, error) : KT_OK;
}
static inline void kt_simulation_begin_try(kt_simulation *simulation) {
    if (KT_HAS_GAP && simulation->watches_gaps && simulation->gap_time != simulation->integrator->memory.t)
        kt_simulation_begin_gaps(simulation);
}
static inline kt_status kt_simulation_check_step(kt_simulation *simulation, int repetition, double *t_limit,
                                                 bool *again, kt_error *error) {
    *again = KT_HAS_GAP && ((simulation->watches_ends && kt_simulation_take_back_missed(simulation, t_limit)) ||
                            (simulation->watches_gaps && kt_simulation_take_back(simulation, t_limit)));
    return KT_HAS_EVENTS && !*again && simulation->watch != NULL
               ? simulation->watch->take_back(simulation, repetition, t_limit, again, error)
               : KT_OK;
}

/* Takes a step. A step that leapt over a contact or a stop is repeated up to that, a step with an event up to the
 * event. */
static inline kt_status kt_simulation_try_watched(kt_simulation *simulation, double t_limit, kt_error *error) {
    kt_status status = kt_simulation_begin_watch(simulation, error);
    bool again = true;
    for (int repetition = 0; status == KT_OK && again; repetition++) {
        kt_simulation_begin_try(simulation);
        status = kt_integrator_take_step(simulation->integrator, t_limit, error);
        if (status == KT_OK)
            status = kt_simulation_check_step(simulation, repetition, &t_limit, &again, error);
    }
    return status;
}

/* A step on hard contacts that fails may have a shorter one, or one behind an impulse. */
static inline kt_status kt_simulation_step_watched(kt_simulation *simulation, double t_limit, kt_error *error) {
#if KT_HAS_EVENTS
    kt_retry retry = {.t_limit = t_limit};
    if (simulation->contacts != NULL)
        simulation->contact_calls->limit(simulation, &t_limit);
#endif
    kt_status status = kt_simulation_try_watched(simulation, t_limit, error);
#if KT_HAS_EVENTS
    while (status != KT_OK && simulation->contacts != NULL &&
           simulation->contact_calls->retry(simulation, &retry, status, &t_limit)) {
        simulation->cause.code = error->code = KT_OK;
        status = kt_simulation_try_watched(simulation, t_limit, error);
    }
#endif
    return status;
}

/* Applies the events at the present time that have not taken effect yet: those of the last step, or those that a
 * previous call left pending. */
KT_CHECKED kt_status kt_simulation_fire(kt_simulation *simulation, kt_error *error);

/* The end of the period that begins now: start + k period, if now is start + (k - 1) period up to rounding. */
double kt_simulation_period_end(const kt_simulation *simulation, double period);

/* Reports a contact that is beyond its boundary since the start (memory.beyond). */
KT_CHECKED kt_status kt_simulation_check_start(kt_simulation *simulation, kt_error *error);

#endif
