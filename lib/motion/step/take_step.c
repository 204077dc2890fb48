/* One step of a simulation.
 *
 * A step moves the state from the present time to a later time, t_limit at most. The integrator tries steps and
 * controls their errors. A method evaluates forces at its stages only. Therefore it cannot notice that its step leapt
 * over a stop, or that an event happened within. For this reason the parts of the simulation (phases.h) judge each try:
 *
 *     start       parameters that were set take effect
 *     enter       inputs and forces of the step take effect
 *     limit       parts shorten the step, for example to the next breakpoint
 *     begin       parts compute values at the beginning of the step
 *     prepare     before each try of the integrator
 *     check       each part accepts the try, or undoes it; then the try is repeated up to an earlier time
 *     accept      all parts have accepted the try
 *     retry       after a failure, a part may ask for new tries
 *     count       the step has ended
 *     explain     after a failure, a part reports the cause
 *     finish      after a success, parts store results of the step
 *
 * Each phase walks the list of its hooks. Lists of phases in which no part acts are empty. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "integrator/integrator.h"
#include "step/simulation_struct.h"

kt_status kt_phase_start(kt_simulation *simulation, kt_error *error) {
    kt_status status = KT_OK;
    for (kt_hook_of_start *const *hook = simulation->phases.start; status == KT_OK && *hook != NULL; hook++)
        status = (*hook)(simulation, error);
    return status;
}

kt_status kt_phase_enter(kt_simulation *simulation, double t_limit, kt_step_progress *progress, kt_error *error) {
    kt_status status = KT_OK;
    *progress = (kt_step_progress){.t_limit = t_limit};
    simulation->cause.code = KT_OK;
    for (kt_hook_of_enter *const *hook = simulation->phases.enter; status == KT_OK && *hook != NULL; hook++)
        status = (*hook)(simulation, progress, error);
    for (kt_hook_of_limit *const *hook = simulation->phases.limit; status == KT_OK && *hook != NULL; hook++)
        (*hook)(simulation, progress);
    return status;
}

kt_status kt_phase_begin(kt_simulation *simulation, kt_error *error) {
    kt_status status = KT_OK;
    for (kt_hook_of_begin *const *hook = simulation->phases.begin; status == KT_OK && *hook != NULL; hook++)
        status = (*hook)(simulation, error);
    return status;
}

void kt_phase_prepare(kt_simulation *simulation, kt_step_progress *progress) {
    for (kt_hook_of_prepare *const *hook = simulation->phases.prepare; *hook != NULL; hook++)
        (*hook)(simulation, progress);
}

/* Walks the hooks until one undoes the try. All of them accept it before the first hook of `accept` runs. */
kt_status kt_phase_check(kt_simulation *simulation, kt_step_progress *progress, bool *again, kt_error *error) {
    kt_status status = KT_OK;
    kt_verdict verdict = KT_VERDICT_ACCEPT;
    for (kt_hook_of_check *const *hook = simulation->phases.check;
         status == KT_OK && verdict == KT_VERDICT_ACCEPT && *hook != NULL; hook++)
        status = (*hook)(simulation, progress, &verdict, error);
    progress->undone++;
    *again = verdict == KT_VERDICT_REPEAT;
    for (kt_hook_of_accept *const *hook = simulation->phases.accept;
         status == KT_OK && verdict == KT_VERDICT_ACCEPT && *hook != NULL; hook++)
        status = (*hook)(simulation, error);
    return status;
}

/* Tries steps until all parts accept one, or a try fails. After a failure, the progress of these tries is void. */
static kt_status try_step(kt_simulation *simulation, kt_step_progress progress, kt_error *error) {
    kt_status status = kt_phase_begin(simulation, error);
    for (bool again = true; status == KT_OK && again;) {
        kt_phase_prepare(simulation, &progress);
        status = kt_integrator_take_step(simulation->integrator, progress.t_limit, error);
        if (status == KT_OK)
            status = kt_phase_check(simulation, &progress, &again, error);
    }
    return status;
}

/* Whether new tries may succeed after a failure. A call that has used up its steps takes no more (steps_per_call). */
static bool may_retry(kt_simulation *simulation, kt_step_progress *progress, kt_status failed) {
    bool again = false;
    for (kt_hook_of_retry *const *hook = simulation->phases.retry; !again && *hook != NULL; hook++)
        again = !simulation->integrator->used_up && (*hook)(simulation, progress, failed);
    return again;
}

static kt_status try_until_accepted(kt_simulation *simulation, kt_step_progress *progress, kt_error *error) {
    kt_status status = try_step(simulation, *progress, error);
    while (status != KT_OK && may_retry(simulation, progress, status)) {
        simulation->cause.code = error->code = KT_OK;
        status = try_step(simulation, *progress, error);
    }
    return status;
}

kt_status kt_phase_end(kt_simulation *simulation, kt_status status, const kt_error *from, kt_error *error) {
    for (kt_hook_of_count *const *hook = simulation->phases.count; *hook != NULL; hook++)
        (*hook)(simulation);
    for (kt_hook_of_explain *const *hook = simulation->phases.explain; status != KT_OK && *hook != NULL; hook++)
        status = (*hook)(simulation, from, error);
    for (kt_hook_of_finish *const *hook = simulation->phases.finish; status == KT_OK && *hook != NULL; hook++)
        (*hook)(simulation);
    return status;
}

kt_status kt_simulation_take_step(kt_simulation *simulation, double t_limit, kt_error *error) {
    kt_step_progress progress;
    kt_error from = {0};
    kt_status status = kt_phase_arrive(simulation, error);
    if (status == KT_OK)
        status = kt_phase_start(simulation, error);
    if (status != KT_OK)
        return status;
    status = kt_phase_enter(simulation, t_limit, &progress, &from);
    if (status == KT_OK)
        status = simulation->phases.may_repeat
                     ? try_until_accepted(simulation, &progress, &from)
                     : kt_integrator_take_step(simulation->integrator, progress.t_limit, &from);
    return kt_phase_end(simulation, status, &from, error);
}
