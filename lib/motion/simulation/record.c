/* Records at k * interval, from the method's dense output.
 *
 * A record's time is computed from its number, never by adding intervals. The last time is the duration itself. Between
 * the ends of a step, the norm of interpolated quaternions is wrong by the interpolation's error. The quaternions are
 * scaled in the record, not in the state.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "contact/contact.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "simulation/event_root.h"
#include "simulation/response.h"
#include "simulation/simulation.h"

#include <math.h>
#include <string.h>

/* Whether kt_simulation_run has not yet handed over all records before the current time, or events at this time have
 * not taken effect. Both need the last step with its inputs. */
static bool needs_last_step(const kt_simulation *simulation) {
    const int64_t k = simulation->memory.next_record;
    return simulation->memory.fires ||
           (k < simulation->records.count &&
            kt_simulation_record_time(simulation, k) < kt_integrator_time(simulation->integrator));
}

bool kt_simulation_owes_record(const kt_simulation *simulation) {
    const int64_t k = simulation->memory.next_record;
    return k < simulation->records.count &&
           kt_simulation_record_time(simulation, k) <= kt_integrator_time(simulation->integrator);
}

/* ---- one record -------------------------------------------------------------------------------------------------- */

/* Writes the state at a time within the last step to y. */
static kt_status read_dense_state(kt_simulation *simulation, double t, kt_error *error) {
    if (t == kt_integrator_time(simulation->integrator)) {
        memcpy(simulation->y, kt_integrator_state(simulation->integrator), simulation->size.n * sizeof(double));
        return KT_OK;
    }
    kt_work work;
    if (simulation->breakpoints.any)
        kt_simulation_recall_breakpoints(simulation); /* after a checkpoint, the stages of the step are taken again */
    const bool refined = simulation->memory.refined && kt_simulation_works_at(simulation, t, &work);
    const kt_status status = kt_simulation_between(simulation, t, error);
    if (refined) {
        simulation->y[simulation->size.work] = work.dissipated;
        simulation->y[simulation->size.work + 1] = work.supplied;
    }
    return status;
}

/* Computes the kinematics of the state in y from the results that data hold already. */
static kt_status move_kinematics(kt_simulation *simulation, double t, const double *a, kt_error *error) {
    const kt_model *model = simulation->model;
    kt_data *data = simulation->data;
    const double *q = simulation->y, *v = q + simulation->size.nq;
    if (simulation->cached == KT_CACHED_EVALUATION)
        return kt_motion_complete(model, data, &(kt_dynamic_state){.t = t, .q = q, .v = v}, a, data->kinematics, NULL,
                                  NULL, error);
    return kt_links_update(model, data, q, v, a, simulation->cached == KT_CACHED_POSES, data->kinematics, error);
}

/* Whether contacts change at t, up to rounding, which is the end of the last step, and their events have not taken
 * effect. */
static bool changes_contacts(const kt_simulation *simulation, double t) {
    const double end = kt_integrator_time(simulation->integrator);
    bool due = false;
    for (size_t k = 0; k < kt_simulation_contact_events(simulation); k++)
        due = due || simulation->event_root[k].due;
    return due && simulation->memory.fires && end - t <= kt_event_least_width(simulation, end);
}

/* The time of the state and of the forces of a record at t. If forces jump, records with hard contacts belong to the
 * step that ends at the jump: they have the limits from the left. Contacts may change because of such a jump, which is
 * no breakpoint if a fixed step ends there, or if a state causes the jump. */
static double time_from_left(const kt_simulation *simulation, double t) {
    const double before = t - 2.0 * kt_event_least_width(simulation, t);
    return changes_contacts(simulation, t) ? fmax(before, kt_integrator_previous_time(simulation->integrator)) : t;
}

/* The time of the forces of a record. With time stepping, it is the middle of the last step, at which contact forces
 * balance the other forces. */
static double time_of_forces(const kt_simulation *simulation, double t) {
    if (kt_simulation_is_stepped(simulation))
        return 0.5 * (kt_integrator_previous_time(simulation->integrator) + kt_integrator_time(simulation->integrator));
    const double left = time_from_left(simulation, t);
    return simulation->contacts != NULL && left == t ? kt_simulation_time_inside(simulation, t) : left;
}

/* Computes the reactions. Forces are checked at their own time: a contact may be held until the record. */
static kt_status react(kt_simulation *simulation, const kt_record *record, kt_error *error) {
    const bool reported = (simulation->records.bits & KT_RECORD_REACTIONS) != 0;
    const bool stepped = kt_simulation_is_stepped(simulation);
    const double t = time_of_forces(simulation, record->t);
    kt_status status = kt_simulation_react(simulation, t, simulation->y, reported, error);
    if (status == KT_OK && stepped)
        status = kt_simulation_date_masses(simulation, record->t, error);
    kt_hook_of_check_record *const *hook = simulation->phases.check_record;
    for (; status == KT_OK && record->index >= 0 && *hook != NULL; hook++)
        status = (*hook)(simulation, stepped ? record->t : t, error);
    return status;
}

/* Computes the kinematics and the quantities that follow from them. Energies belong to the model that is integrated. */
static kt_status evaluate_motion(kt_simulation *simulation, kt_record *record, kt_error *error) {
    const kt_model *model = simulation->model;
    kt_data *data = simulation->data;
    const double t = record->t, *q = simulation->y, *v = q + simulation->size.nq;
    kt_status status = kt_simulation_date_masses(simulation, t, error);
    if (status != KT_OK)
        return status;
    if ((simulation->records.bits & KT_RECORD_REACTIONS) != 0) {
        status = react(simulation, record, error);
        record->reactions = simulation->reaction;
        record->loop_reactions = simulation->loop_reaction;
        record->multipliers = simulation->multiplier;
    } else {
        status = move_kinematics(simulation, t, record->a != NULL ? simulation->a : NULL, error);
    }
    if (status != KT_OK)
        return status;
    if ((simulation->records.bits & (KT_RECORD_ENERGY | KT_RECORD_BALANCE)) != 0) {
        record->kinetic = kt_kinetic_energy(model, data);
        record->potential = kt_potential_energy(model, data) + kt_effect_energy(model, data, t, q, v);
    }
    record->data = data;
    return KT_OK;
}

/* Computes the requested quantities of the state in y. The accelerations of the state are in `a` if `accelerated`. Data
 * hold the results that `cached` names. The kinematics are computed last, so that they stay in the data. */
static kt_status report_record(kt_simulation *simulation, bool accelerated, kt_record *record, kt_error *error) {
    const double t = record->t, *q = simulation->y, *v = q + simulation->size.nq;
    kt_status status = KT_OK;
    record->work = kt_simulation_work_of(simulation, q);
    record->x = v + simulation->size.nv;
    kt_simulation_use_states(simulation, q);
    if (simulation->works.watches)
        record->estimate = kt_simulation_work_estimate(simulation, t);
    record->q = q;
    record->v = v;
    record->a = accelerated ? simulation->a : NULL;
    if ((simulation->records.bits & KT_RECORD_CONSTRAINT) != 0) {
        status = kt_loop_residual(simulation->model, simulation->data, kt_simulation_closing_time(simulation, t), q, v,
                                  &record->constraint, error);
        simulation->cached = simulation->groups > 0 ? KT_CACHED_POSES : simulation->cached;
    }
    return status == KT_OK && simulation->records.kinematics ? evaluate_motion(simulation, record, error) : status;
}

/* With time stepping, forces of contacts are loads of the evaluations of a record. */
static kt_status begin_loads(kt_simulation *simulation, double t, kt_error *error) {
    kt_status status = KT_OK;
    for (kt_hook_of_begin_record *const *hook = simulation->phases.begin_record; status == KT_OK && *hook; hook++)
        status = (*hook)(simulation, t, error);
    return status;
}

/* Adds to a record the loads of the parts (phase end_record), under the inputs that are in force. */
static kt_status end_loads(kt_simulation *simulation, kt_status status, kt_record *record, kt_error *error) {
    kt_hook_of_end_record *const *hook = simulation->phases.end_record;
    if (*hook != NULL)
        kt_simulation_inputs_use(simulation);
    for (; status == KT_OK && simulation->records.kinematics && *hook != NULL; hook++)
        status = (*hook)(simulation, record, error);
    return status;
}

/* Whether forces of effects that may be recorded follow from reactions (evaluate/load_friction.c). */
static bool effects_need_reactions(const kt_simulation *simulation) {
    return simulation->records.kinematics && simulation->model->n.loaded > 0;
}

/* Checks the law of contacts in a record without reactions (contact/certificate.c), so that no choice of columns hides
 * a violation. Other records are checked with their reactions. Cost: an evaluation with reactions, and the poses
 * alone if no contact is closed or touches. */
static kt_status check_without_reactions(kt_simulation *simulation, const kt_record *record, kt_error *error) {
    const bool has_reactions = (simulation->records.bits & KT_RECORD_REACTIONS) != 0;
    if (has_reactions || record->index < 0 || *simulation->phases.check_record == NULL ||
        !kt_contacts_may_act(simulation, record->t))
        return KT_OK;
    kt_simulation_use_states(simulation, simulation->y);
    kt_status status = kt_simulation_date_masses(simulation, record->t, error);
    if (status == KT_OK)
        status = react(simulation, record, error);
    simulation->cached = KT_CACHED_NOTHING;
    return status;
}

/* Computes the requested quantities of the state in y at any time. */
static kt_status evaluate_record(kt_simulation *simulation, kt_record *record, kt_error *error) {
    const bool accelerates = (simulation->records.bits & KT_RECORD_ACCELERATIONS) != 0;
    kt_status status = begin_loads(simulation, record->t, error);
    simulation->cached = KT_CACHED_NOTHING;
    if (status == KT_OK)
        status = check_without_reactions(simulation, record, error);
    if (status == KT_OK && (accelerates || effects_need_reactions(simulation)) &&
        kt_simulation_accelerate(simulation, time_of_forces(simulation, record->t), simulation->y, simulation->tau,
                                 simulation->external, simulation->a, error) != KT_OK)
        status = error->code;
    if (status == KT_OK)
        status = report_record(simulation, accelerates, record, error);
    status = end_loads(simulation, status, record, error);
    simulation->cached = KT_CACHED_NOTHING;
    return status;
}

/* A record without a state. */
static kt_record empty_record(const kt_simulation *simulation, int64_t index, double time) {
    kt_record record = {0};
    record.index = index;
    record.t = time;
    record.model = simulation->model;
    record.slow_slip = simulation->slow_slip;
    record.kinetic = record.potential = (double)NAN;
    record.estimate = (kt_work_estimate){(double)NAN, (double)NAN, (double)NAN};
    record.constraint.position = record.constraint.velocity = (double)NAN;
    return record;
}

void kt_simulation_begin_record(kt_simulation *simulation, int64_t k, kt_record *record) {
    *record = empty_record(simulation, k, kt_simulation_record_time(simulation, k));
    simulation->cause.code = KT_OK;
}

kt_status kt_simulation_read_record(kt_simulation *simulation, int64_t k, kt_record *record, kt_error *from) {
    kt_simulation_begin_record(simulation, k, record);
    return read_dense_state(simulation, time_from_left(simulation, record->t), from);
}

kt_status kt_simulation_give_record(kt_simulation *simulation, const kt_record *record, kt_recorder *recorder,
                                    void *user, kt_error *error) {
    simulation->memory.completed.records += simulation->memory.leaps > 0;
    simulation->memory.next_record += record->event == NULL;
    simulation->memory.recorded++;
    simulation->within = "a recorder";
    const int code = recorder(record, user);
    simulation->within = NULL;
    if (code == 0)
        return KT_OK;
    return kt_error_set(error, KT_ERROR_CALLBACK, kt_where_format("t = %.9g s", record->t).text,
                        "the recorder stopped at record %.0f", (double)record->index);
}

kt_status kt_simulation_complete_record(kt_simulation *simulation, kt_status status, kt_record *record, kt_error *from,
                                        kt_recorder *recorder, void *user, kt_error *error) {
    if (status == KT_OK) {
        kt_phase_complete(simulation);
        for (kt_hook_of_admit *const *hook = simulation->phases.admit; status == KT_OK && *hook != NULL; hook++)
            status = (*hook)(simulation, record->t, from);
        if (status == KT_OK)
            status = evaluate_record(simulation, record, from);
        if (status != KT_OK)
            simulation->cause = *from; /* it names the body */
    }
    if (status != KT_OK)
        return kt_simulation_fail(simulation, from, error);
    return kt_simulation_give_record(simulation, record, recorder, user, error);
}

static kt_status hand_over_record(kt_simulation *simulation, kt_recorder *recorder, void *user, kt_error *error) {
    kt_record record;
    kt_error from = {0};
    const kt_status status = kt_simulation_read_record(simulation, simulation->memory.next_record, &record, &from);
    return kt_simulation_complete_record(simulation, status, &record, &from, recorder, user, error);
}

/* Hands over the record of an event at the time t, within the last step or at its end. */
static kt_status record_event_at(kt_simulation *simulation, const kt_event *event, double t, kt_recorder *recorder,
                                 void *user, kt_error *error) {
    const bool of_contact = event < simulation->events.list + kt_simulation_contact_events(simulation);
    kt_record record = empty_record(simulation, of_contact ? KT_INDEX_CONTACT : KT_INDEX_EVENT, t);
    kt_error from = {0};
    record.event = event;
    simulation->cause.code = KT_OK;
    const kt_status status = read_dense_state(simulation, record.t, &from);
    return kt_simulation_complete_record(simulation, status, &record, &from, recorder, user, error);
}

kt_status kt_simulation_record_event(kt_simulation *simulation, const kt_event *event, kt_recorder *recorder,
                                     void *user, kt_error *error) {
    return record_event_at(simulation, event, kt_integrator_time(simulation->integrator), recorder, user, error);
}

/* Takes a step. A contact that comes to rest at the beginning of the step, at the time t, has no event. The record of
 * this change is handed over behind the step. */
static kt_status take_step_of_run(kt_simulation *simulation, kt_recorder *recorder, void *user, kt_error *error) {
    const double t = kt_integrator_time(simulation->integrator);
    simulation->changed_contact = 0;
    const kt_status status = kt_simulation_take_step(simulation, simulation->duration, error);
    if (status != KT_OK || simulation->changed_contact == 0 || !simulation->options.record_contacts)
        return status;
    return record_event_at(simulation, &simulation->events.list[simulation->changed_contact - 1], t, recorder, user,
                           error);
}

kt_status kt_simulation_respond(kt_simulation *simulation, const kt_instant *at, kt_simulation_response *response,
                                kt_error *error) {
    const kt_simulation_sizes *size = &simulation->size;
    const kt_simulation_response own = {.record = simulation->records.bits,
                                        .joint = simulation->reaction,
                                        .loop = simulation->loop_reaction,
                                        .multiplier = simulation->multiplier};
    const bool kinematics = simulation->records.kinematics;
    kt_record record = empty_record(simulation, KT_INDEX_EVENT, at->t);
    memmove(simulation->y, at->q, size->nq * sizeof(double));
    memmove(simulation->y + size->nq, at->v, size->nv * sizeof(double));
    if (size->x > 0)
        memmove(simulation->y + size->nq + size->nv, at->x, size->x * sizeof(double));
    simulation->records.bits = response->record | KT_RECORD_ACCELERATION;
    simulation->records.kinematics = true;
    simulation->reaction = response->joint;
    simulation->loop_reaction = response->loop;
    simulation->multiplier = response->multiplier;
    const kt_status status = evaluate_record(simulation, &record, error);
    simulation->records.bits = own.record;
    simulation->records.kinematics = kinematics;
    simulation->reaction = own.joint;
    simulation->loop_reaction = own.loop;
    simulation->multiplier = own.multiplier;
    if (status != KT_OK)
        return status;
    kt_copy(response->a, record.a, size->nv * sizeof(double));
    response->model = record.model;
    response->data = record.data;
    return KT_OK;
}

/* ---- accelerations of the present state -------------------------------------------------------------------------- */

/* With time stepping: the accelerations of a record of the present state, under these forces. */
/* NOLINTNEXTLINE(readability-non-const-parameter): written by way of the response */
static kt_status respond_to_inputs(kt_simulation *simulation, const double *tau, const kt_wrench *external, double *a,
                                   kt_error *error) {
    const double *y = kt_integrator_state(simulation->integrator);
    const kt_instant at = {.t = kt_integrator_time(simulation->integrator),
                           .q = y,
                           .v = y + simulation->size.nq,
                           .x = y + simulation->size.nq + simulation->size.nv};
    kt_simulation_response response = {.record = KT_RECORD_ACCELERATION, .a = a};
    simulation->tau = tau;
    simulation->external = external;
    const kt_status status = kt_simulation_respond(simulation, &at, &response, &simulation->cause);
    kt_simulation_inputs_use(simulation);
    return status == KT_OK ? KT_OK : kt_simulation_fail(simulation, &simulation->cause, error);
}

kt_status kt_simulation_acceleration(kt_simulation *simulation, double *a, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, a || !simulation->size.nv))
        return KT_ERROR_ARGUMENT;
    const kt_simulation_memory *memory = &simulation->memory;
    const double *y = kt_integrator_state(simulation->integrator);
    const double *tau = memory->next.torque ? simulation->torque_next : NULL;
    const kt_wrench *external = memory->next.wrenches ? simulation->wrench_next : NULL;
    double t = kt_integrator_time(simulation->integrator);
    const kt_status status = kt_phase_start(simulation, error);
    if (status != KT_OK)
        return status;
    simulation->cause.code = KT_OK;
    if (kt_simulation_is_stepped(simulation))
        return respond_to_inputs(simulation, tau, external, a, error);
    if (kt_simulation_accelerate(simulation, t, y, tau, external, simulation->a, &simulation->cause) != KT_OK)
        return kt_simulation_fail(simulation, &simulation->cause, error);
    kt_copy(a, simulation->a, simulation->size.nv * sizeof(double));
    for (int k = 0; k < (int)simulation->size.nv && simulation->size.balanced > 0; k++)
        if (kt_massless_moves(simulation->model, k))
            a[k] = (double)NAN;
    return KT_OK;
}

/* ---- the run ----------------------------------------------------------------------------------------------------- */

kt_status kt_simulation_hand_over(kt_simulation *simulation, kt_recorder *recorder, void *user, kt_error *error) {
    kt_status status = KT_OK;
    while (status == KT_OK && kt_simulation_owes_record(simulation))
        status = hand_over_record(simulation, recorder, user, error);
    return status == KT_OK ? kt_phase_arrive(simulation, error) : status;
}

kt_status kt_simulation_begin_run(kt_simulation *simulation, kt_error *error) {
    kt_integrator *integrator = simulation->integrator;
    const kt_status start = kt_phase_start(simulation, error);
    if (start != KT_OK)
        return start;
    /* A record at the very start belongs to the step that begins there, and so do its torques. A record within the last
     * step belongs to that step. */
    if (simulation->memory.next_record < simulation->records.count &&
        kt_simulation_record_time(simulation, simulation->memory.next_record) >= kt_integrator_time(integrator)) {
        kt_error from = {0};
        simulation->cause.code = KT_OK;
        const kt_status status = kt_simulation_inputs_commit(simulation, &from);
        if (status != KT_OK)
            return kt_simulation_fail(simulation, &from, error);
    }
    simulation->memory.stopped = 0;
    return KT_OK;
}

/* Calls the caller's progress function after every progress_steps steps. */
static kt_status show_run_progress(kt_simulation *simulation, kt_error *error) {
    if (simulation->options.progress == NULL || --simulation->records.progress_due > 0)
        return KT_OK;
    simulation->records.progress_due = simulation->options.progress_steps;
    if (simulation->options.progress(simulation, simulation->options.progress_user) != 0)
        return kt_error_set(error, KT_ERROR_CALLBACK,
                            kt_where_format("t = %.9g s", kt_integrator_time(simulation->integrator)).text,
                            "the progress callback ended the run");
    return KT_OK;
}

kt_status kt_simulation_run(kt_simulation *simulation, kt_recorder *record, void *user, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, record) ||
        kt_simulation_require_outermost(simulation, __func__, error) != KT_OK)
        return KT_ERROR_ARGUMENT;
    kt_integrator *integrator = simulation->integrator;
    kt_status status = kt_simulation_begin_run(simulation, error);
    if (status != KT_OK)
        return status;
    for (;;) {
        status = kt_simulation_hand_over(simulation, record, user, error);
        if (status == KT_OK)
            status = kt_simulation_fire(simulation, record, user, error);
        if (status != KT_OK || (simulation->memory.stopped > 0) ||
            !(kt_integrator_time(integrator) < simulation->duration))
            return status;
        status = take_step_of_run(simulation, record, user, error);
        if (status == KT_OK)
            status = show_run_progress(simulation, error);
        if (status != KT_OK)
            return status;
    }
}

/* ---- the present state, for sensors ------------------------------------------------------------------------------ */

/* A record of the present state reuses results of the last step and prepares those of the next one. After a step, the
 * integrator may already hold f(t, y) (the last stage of a method with fsal). Otherwise it is evaluated now, as the
 * first stage of the next step, which reuses it. The data then hold the intermediate results of that evaluation, from
 * which kinematics and reactions follow. Alternatively, data hold the poses of the last projection. */

/* Computes the accelerations of the present state into `a`. */
static kt_status find_acceleration(kt_simulation *simulation, kt_error *from) {
    const double *slope;
    kt_status status = kt_simulation_inputs_commit(simulation, from);
    if (status == KT_OK && simulation->breakpoints.any)
        status = kt_simulation_pass_breakpoint(simulation, from);
    if (status == KT_OK)
        status = kt_integrator_derivative(simulation->integrator, &slope, from);
    if (status != KT_OK)
        return status;
    if (simulation->slope != slope && simulation->cached == KT_CACHED_EVALUATION)
        simulation->cached = KT_CACHED_NOTHING; /* the data hold a later evaluation than the slope */
    memcpy(simulation->a, slope + simulation->size.nq, simulation->size.nv * sizeof(double));
    return KT_OK;
}

/* Computes the accelerations without the integrator, if the last step is still needed. */
static kt_status find_acceleration_aside(kt_simulation *simulation, kt_error *from) {
    const double t = kt_integrator_time(simulation->integrator);
    simulation->tau = simulation->memory.next.torque ? simulation->torque_next : NULL;
    simulation->external = simulation->memory.next.wrenches ? simulation->wrench_next : NULL;
    return kt_simulation_accelerate(simulation, t, simulation->y, simulation->tau, simulation->external, simulation->a,
                                    from) == KT_OK
               ? KT_OK
               : from->code;
}

/* Makes a record of the present state, between steps, without a change of the simulation. */
static kt_status sense(kt_simulation *simulation, kt_record *record, kt_error *from) {
    const bool accelerates = (simulation->records.bits & KT_RECORD_ACCELERATIONS) != 0;
    kt_status status = KT_OK;
    memcpy(simulation->y, kt_integrator_state(simulation->integrator), simulation->size.n * sizeof(double));
    kt_phase_complete(simulation);
    if (kt_simulation_is_stepped(simulation)) /* data do not hold results of the state */
        return evaluate_record(simulation, record, from);
    if (accelerates || (simulation->records.bits & KT_RECORD_REACTIONS) != 0 || effects_need_reactions(simulation))
        status = needs_last_step(simulation) ? find_acceleration_aside(simulation, from)
                                             : find_acceleration(simulation, from);
    else if (simulation->cached == KT_CACHED_EVALUATION)
        simulation->cached = KT_CACHED_NOTHING; /* data belong to some stage of the last step */
    if (status == KT_OK)
        status = report_record(simulation, accelerates, record, from);
    kt_simulation_inputs_use(simulation);
    simulation->cached = status == KT_OK && simulation->records.kinematics ? KT_CACHED_POSES : KT_CACHED_NOTHING;
    return status;
}

kt_status kt_simulation_sense(kt_simulation *simulation, kt_record *record, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, record))
        return KT_ERROR_ARGUMENT;
    const kt_status start = kt_phase_start(simulation, error);
    if (start != KT_OK)
        return start;
    kt_record now = empty_record(simulation, KT_INDEX_EVENT, kt_integrator_time(simulation->integrator));
    kt_error from = {0};
    simulation->cause.code = KT_OK;
    const kt_status status = sense(simulation, &now, &from);
    if (status != KT_OK) {
        if (simulation->cause.code == KT_OK)
            simulation->cause = from; /* it names the body */
        return kt_simulation_fail(simulation, &from, error);
    }
    *record = now;
    return KT_OK;
}
