/* The steps of a simulation, its counts and its state. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "compile/compile.h"
#include "dynamics/dynamics.h"
#include "integrator/integrator.h"
#include "simulation/response.h"
#include "simulation/simulation.h"

#include <float.h>
#include <math.h>
#include <string.h>

/* ---- counts ------------------------------------------------------------------------------------------------------ */

/* Adds the passages next to singular positions that data have counted since the last call. */
static void add_crossings(kt_crossings *to, kt_crossings new) {
    if (new.near > 0) {
        to->smallest = to->near > 0 ? fmin(to->smallest, new.smallest) : new.smallest;
        to->since = to->near > 0 ? fmin(to->since, new.since) : new.since;
    }
    to->near += new.near;
    to->interpolated += new.interpolated;
    to->error = fmax(to->error, new.error);
    if (new.bend > 0.0)
        to->bend = to->bend > 0.0 ? fmin(to->bend, new.bend) : new.bend;
}

/* Adds the counts of the data since the last call. near_singular: whether any acceleration in between was computed next
 * to a singular position. */
void kt_simulation_count(kt_simulation *simulation) {
    const kt_integrator_memory *integrator = &simulation->integrator->memory;
    /* A fixed step may be longer than the passage (kt_crossings.bend). */
    const double step = simulation->step > 0.0 ? 0.0 : integrator->t - integrator->previous_t;
    kt_iterations *most = &simulation->memory.iterations;
    kt_data *data = simulation->data;
    simulation->near_singular = false;
    const kt_iterations new = data->iterations;
    data->iterations = (kt_iterations){0, 0, 0, 0};
    most->position = new.position > most->position ? new.position : most->position;
    most->velocity = new.velocity > most->velocity ? new.velocity : most->velocity;
    most->assembly = new.assembly > most->assembly ? new.assembly : most->assembly;
    most->capped += new.capped;
    simulation->memory.contacts.unconverged += data->unconverged;
    data->unconverged = 0;
    if (data->crossings.near > 0 && simulation->groups > 0) {
        const double drift = 0.5 * data->passage.acceleration * step * step;
        kt_crossings crossings = kt_data_crossings(data);
        crossings.error = fmax(crossings.error, drift);
        add_crossings(&simulation->memory.crossings, crossings);
        simulation->near_singular = true;
    }
}

kt_velocity_correction kt_simulation_velocity_correction(const kt_simulation *simulation) {
    if (!simulation)
        return (kt_velocity_correction){0.0, (double)NAN, 0};
    const kt_corrections *corrections = &simulation->memory.corrections;
    if (!(corrections->most > 0.0))
        return (kt_velocity_correction){0.0, (double)NAN, 0};
    return (kt_velocity_correction){corrections->most / corrections->fastest, corrections->time,
                                    kt_simulation_body_of(simulation, simulation->size.nq + (size_t)corrections->v)};
}

kt_simulation_counts kt_simulation_counts_of(const kt_simulation *simulation) {
    if (!simulation)
        return (kt_simulation_counts){.steps = 0};
    kt_integrator_counts from = kt_integrator_counts_of(simulation->integrator);
    kt_simulation_counts counts = {from.steps,
                                   from.rejected,
                                   from.evaluations,
                                   simulation->memory.factorizations,
                                   from.jacobians,
                                   from.switches,
                                   from.capped,
                                   simulation->memory.balance_evaluations,
                                   simulation->memory.joined,
                                   simulation->memory.iterations,
                                   simulation->memory.crossings,
                                   simulation->memory.cut,
                                   0};
    counts.iterations.capped += (uint32_t)from.capped;
    counts.breakpoints = simulation->memory.breakpoints;
    return counts;
}

static bool has_groups(const kt_simulation *simulation) { return simulation->groups > 0; }

const kt_part kt_count_part = {.is_active = has_groups, .count = kt_simulation_count};

/* ---- steps ------------------------------------------------------------------------------------------------------- */

static kt_status step_and_fire(kt_simulation *simulation, double t_limit, kt_error *error) {
    kt_status status = kt_simulation_take_step(simulation, t_limit, error);
    if (status == KT_OK)
        status = kt_phase_arrive(simulation, error);
    return status == KT_OK ? kt_simulation_fire(simulation, NULL, NULL, error) : status;
}

/* Begins and ends a call that may take steps_per_call steps. */
static void begin_call(kt_simulation *simulation) {
    kt_simulation_renew_model(simulation);
    simulation->memory.stopped = 0;
    simulation->events.latest = simulation->events.count;
    kt_integrator_limit_call(simulation->integrator, simulation->options.steps_per_call);
}

static kt_status end_call(kt_simulation *simulation, kt_status status) {
    kt_integrator_limit_call(simulation->integrator, 0);
    kt_simulation_skip_records(simulation);
    return status;
}

kt_status kt_simulation_require_outermost(const kt_simulation *simulation, const char *call, kt_error *error) {
    if (simulation->within == NULL)
        return KT_OK;
    return kt_error_set(error, KT_ERROR_ARGUMENT, call,
                        "%s has called it, within a call with the same simulation; call it after that call",
                        simulation->within);
}

kt_status kt_simulation_step(kt_simulation *simulation, double t_limit, kt_error *error) {
    if (KT_IS_MISSING(error, simulation) || kt_simulation_require_outermost(simulation, __func__, error) != KT_OK)
        return KT_ERROR_ARGUMENT;
    double t = kt_integrator_time(simulation->integrator);
    if (!(t_limit > t))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "t_limit", "%.17g s is not after the current time, %.17g s",
                            t_limit, t);
    begin_call(simulation);
    kt_status status = kt_simulation_fire(simulation, NULL, NULL, error);
    if (status == KT_OK && (simulation->memory.stopped == 0))
        status = step_and_fire(simulation, t_limit, error);
    return end_call(simulation, status);
}

kt_status kt_simulation_advance(kt_simulation *simulation, double t_end, kt_error *error) {
    if (KT_IS_MISSING(error, simulation) || kt_simulation_require_outermost(simulation, __func__, error) != KT_OK)
        return KT_ERROR_ARGUMENT;
    double t = kt_integrator_time(simulation->integrator);
    if (!(t_end >= t) || !isfinite(t_end))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "t_end",
                            "%.17g s must be a time not before the current one, %.17g s", t_end, t);
    begin_call(simulation);
    simulation->memory.event_many = 0; /* each call may take so many instants (event_chain.c) */
    kt_status status = kt_simulation_fire(simulation, NULL, NULL, error);
    while (status == KT_OK && (simulation->memory.stopped == 0) && kt_integrator_time(simulation->integrator) < t_end)
        status = step_and_fire(simulation, t_end, error);
    return end_call(simulation, status);
}

/* start + k period, if now is start + (k - 1) period up to rounding. */
double kt_simulation_period_end(const kt_simulation *simulation, double period) {
    if (!simulation || !(period > 0.0) || !isfinite(period))
        return (double)NAN;
    const kt_integrator_memory *m = kt_integrator_memory_of(simulation->integrator);
    const double k = nearbyint((m->t - m->origin) / period), tick = m->origin + k * period;
    const double rounding = 8.0 * DBL_EPSILON * fmax(fabs(m->origin), fabs(m->t));
    return fabs(tick - m->t) <= rounding ? m->origin + (k + 1.0) * period : m->t + period;
}

kt_status kt_simulation_tick(kt_simulation *simulation, double period, kt_error *error) {
    if (KT_IS_MISSING(error, simulation))
        return KT_ERROR_ARGUMENT;
    const double t = kt_integrator_time(simulation->integrator);
    if (!(period > 0.0) || !isfinite(period))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "period", "%g s: must be above zero", period);
    const double end = kt_simulation_period_end(simulation, period);
    if (!(end > t))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "period",
                            "%g s does not change the time, which is %.17g s; take a longer one", period, t);
    return kt_simulation_advance(simulation, end, error);
}

/* ---- state ------------------------------------------------------------------------------------------------------- */

const kt_model *kt_simulation_model(const kt_simulation *simulation) { return simulation ? simulation->model : NULL; }

double kt_simulation_time(const kt_simulation *simulation) {
    return simulation ? kt_integrator_time(simulation->integrator) : (double)NAN;
}

/* The state has memory of its own, because the integrator exchanges its arrays in every step, whereas a controller
 * stores these pointers. */
const double *kt_simulation_positions(const kt_simulation *simulation) { return simulation ? simulation->state : NULL; }

const double *kt_simulation_velocities(const kt_simulation *simulation) {
    return simulation ? simulation->state + simulation->size.nq : NULL;
}

const double *kt_simulation_auxiliary_states(const kt_simulation *simulation) {
    return simulation ? simulation->state + simulation->size.nq + simulation->size.nv : NULL;
}

kt_work kt_simulation_work(const kt_simulation *simulation) {
    if (!simulation)
        return (kt_work){(double)NAN, (double)NAN};
    return kt_simulation_work_of(simulation, kt_integrator_state(simulation->integrator));
}

/* Resets events: none has happened, and the new state determines their sides. */
static void forget_events(kt_simulation *simulation) {
    kt_simulation_memory *m = &simulation->memory;
    for (size_t k = 0; k < simulation->events.count; k++)
        simulation->event_memory[k] =
            (kt_event_memory){.breakpoint = (double)NAN, .off = simulation->event_memory[k].off};
    m->fires = m->stopped = 0;
    m->event_instants = m->event_row = m->event_shrinking = 0;
    m->own_time = simulation->contacts != NULL ? m->own_time : 0.0;
    m->event_many = m->event_missed = m->event_cuts = m->breakpoints = 0;
}

/* Closes the loops of the state in y, and moves the integrator to this state. */
static kt_status start_closed_at(kt_simulation *simulation, double t, kt_error *error) {
    bool changed;
    simulation->cached = KT_CACHED_NOTHING;
    simulation->memory.released = simulation->contact_released;
    kt_phase_reset(simulation);
    simulation->memory.contacts = (kt_contact_counts){.count = simulation->memory.contacts.count};
    simulation->memory.excess = (kt_contact_excess){.steps = 0};
    simulation->memory.completed = (kt_completed_steps){.records = 0};
    for (size_t k = 0; k < simulation->size.contacts; k++)
        simulation->contact_state[k].counted = false;
    const kt_status status = kt_simulation_project(simulation, t, simulation->y, &changed, error);
    if (status != KT_OK)
        return status;
    kt_phase_forget(simulation);
    kt_simulation_forget_breakpoints(simulation);
    simulation->memory.iterations = (kt_iterations){0, 0, 0, 0};
    simulation->memory.crossings = (kt_crossings){.near = 0};
    simulation->memory.corrections = (kt_corrections){0.0, 0.0, 0.0, 0};
    simulation->memory.powers = (kt_power_points){.count = 0};
    forget_events(simulation);
    kt_simulation_count(simulation);
    kt_integrator_callbacks callbacks = kt_simulation_callbacks(simulation);
    return kt_integrator_start(simulation->integrator, t, simulation->y, &callbacks, error);
}

bool kt_simulation_is_stepped(const kt_simulation *simulation) { return simulation->steps_over_contacts; }

/* From 2 pi / eps on, a double has no digit left for the angle within a turn. */
static kt_status reject_far_angles(const kt_model *model, const double *q, kt_error *error) {
    static const double most = 6.283185307179586 / DBL_EPSILON;
    for (size_t i = 1; i < model->n.link; i++) {
        const kt_link *link = &model->link[i];
        const kt_motion_facts motion = kt_motion_facts_of(link->motion);
        for (int k = motion.lengths; k < motion.plain; k++)
            if (!(fabs(q[link->q + k]) <= most))
                return kt_error_set(
                    error, KT_ERROR_ARGUMENT,
                    kt_where_format("joint '%.100s'", model->text + model->body[link->body].joint_name).text,
                    "an angle of %.3g rad has no digits within a turn; give the angle less its whole turns",
                    q[link->q + k]);
    }
    return KT_OK;
}

/* Checks a state that the caller gives. */
static kt_status check_given_state(const kt_simulation *simulation, const double *q, const double *v, kt_error *error) {
    const kt_input input = {.q = q, .v = v};
    const kt_status status = kt_input_check(simulation->model, &input, error);
    return status == KT_OK ? reject_far_angles(simulation->model, q, error) : status;
}

/* Begins a new motion at (t, q, v), with its loops closed. Auxiliary states take their initial values, and works and
 * counts are 0. */
static kt_status set_closed_state(kt_simulation *simulation, double t, const double *q, const double *v,
                                  kt_error *error) {
    const size_t nq = simulation->size.nq, nv = simulation->size.nv;
    double *new_q = simulation->y, *new_v = new_q + nq;
    if (!isfinite(t))
        return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "the time is %g; give a finite number", t);
    kt_move(new_q, q, nq * sizeof(double)); /* q may be the positions of this very simulation */
    kt_move(new_v, v ? v : simulation->model->zero, nv * sizeof(double));
    kt_copy(new_v + nv, simulation->model->v0 + simulation->model->n.v, simulation->size.x * sizeof(double));
    memset(simulation->y + simulation->size.work, 0, (simulation->size.n - simulation->size.work) * sizeof(double));
    kt_status status = check_given_state(simulation, new_q, new_v, error);
    if (status == KT_OK)
        status = start_closed_at(simulation, t, error);
    if (status != KT_OK)
        return status;
    memcpy(simulation->state, new_q, simulation->size.state * sizeof(double));
    simulation->memory.next_record = 0;
    simulation->memory.recorded = 0;
    simulation->memory.factorizations = simulation->memory.balance_evaluations = simulation->memory.joined = 0;
    simulation->memory.refined = false;
    kt_simulation_skip_records(simulation);
    return kt_phase_settle(simulation, error);
}

kt_status kt_simulation_set_state(kt_simulation *simulation, double t, const double *q, const double *v,
                                  kt_error *error) {
    if (KT_IS_MISSING(error, simulation, q || !simulation->size.nq) ||
        kt_simulation_require_outermost(simulation, __func__, error) != KT_OK)
        return KT_ERROR_ARGUMENT;
    kt_simulation_begin_change(simulation);
    return kt_simulation_end_change(simulation, set_closed_state(simulation, t, q, v, error));
}

/* Writes the final state of a jump to y, with closed loops. NULL: positions or velocities do not change. */
static kt_status close_jump_state(kt_simulation *simulation, const double *q, const double *v, kt_error *error) {
    const double t = kt_integrator_time(simulation->integrator);
    const size_t nq = simulation->size.nq, nv = simulation->size.nv;
    double *to = simulation->y;
    bool changed;
    memcpy(to, kt_integrator_state(simulation->integrator), simulation->size.n * sizeof(double));
    memmove(to, q ? q : simulation->state, nq * sizeof(double));
    memmove(to + nq, v ? v : simulation->state + nq, nv * sizeof(double));
    const kt_status status = check_given_state(simulation, to, to + nq, error);
    return status == KT_OK ? kt_simulation_project(simulation, t, to, &changed, error) : status;
}

/* The values that change at an instant; NULL: no change. */
typedef struct instant_change {
    const double *q, *v, *x;
    kt_model *model;
    kt_parameter_change *parameters;
    int count;
} instant_change;

/* Undoes the first `count` parameters, the last parameter first, since each parameter was valid together with earlier
 * ones. Numbers do not describe functions of time, which are written back as they were. */
static void undo_parameters(kt_model *model, kt_parameter_change *changes, int count, const kt_curve *curves) {
    for (int i = count - 1; i >= 0; i--) {
        double values[KT_PARAMETER_MAX];
        if (kt_parameter_get(model, &changes[i].parameter, values, NULL) == KT_OK)
            (void)!kt_parameter_set(model, &changes[i].parameter, changes[i].values, NULL);
        memcpy(changes[i].values, values, (size_t)changes[i].parameter.count * sizeof *values);
    }
    for (int i = 0; i < count; i++)
        kt_curves_restore(model, &changes[i].parameter, curves);
}

/* Sets the parameters, and returns their previous numbers in `parameters`. */
static kt_status exchange_parameters(const instant_change *change, kt_curve *curves, kt_error *error) {
    kt_status status = KT_OK;
    if (change->count > 0)
        kt_curves_save(change->model, curves);
    for (int i = 0; status == KT_OK && i < change->count; i++) {
        kt_parameter_change *one = &change->parameters[i];
        double values[KT_PARAMETER_MAX];
        status = kt_parameter_get(change->model, &one->parameter, values, error);
        if (status == KT_OK)
            status = kt_parameter_set(change->model, &one->parameter, one->values, error);
        if (status == KT_OK)
            memcpy(one->values, values, (size_t)one->parameter.count * sizeof *values);
        else
            undo_parameters(change->model, change->parameters, i, curves);
    }
    return status;
}

/* Moves to the changed state, from a state with the energy `before`. */
static kt_status move_to_change(kt_simulation *simulation, const instant_change *change,
                                const kt_simulation_energy *before, kt_error *error) {
    kt_simulation_energy after = {0.0, 0.0};
    simulation->cached = KT_CACHED_NOTHING;
    const bool keeps_forces = kt_simulation_is_stepped(simulation) && change->q == NULL; /* those of the last step */
    if (!keeps_forces)
        kt_phase_reset(simulation);
    kt_status status = close_jump_state(simulation, change->q, change->v, error);
    if (status == KT_OK && change->x != NULL)
        memcpy(simulation->y + simulation->size.nq + simulation->size.nv, change->x,
               simulation->size.x * sizeof(double));
    if (status == KT_OK && kt_simulation_accounts(simulation))
        status = kt_simulation_find_energy(simulation, simulation->y, &after, error);
    if (status != KT_OK)
        return status;
    kt_simulation_add_jump(simulation, after.kinetic + after.potential - (before->kinetic + before->potential), 0.0,
                           false);
    status = kt_simulation_land(simulation, before, &after, error);
    return status == KT_OK ? kt_phase_settle(simulation, error) : status;
}

/* Changes state and parameters at the present time, with the energy that the change adds. A failure changes nothing. */
static kt_status jump(kt_simulation *simulation, const instant_change *change, kt_error *error) {
    kt_simulation_energy before;
    kt_status status = kt_simulation_strike_due(simulation, error);
    if (status != KT_OK)
        return status;
    kt_simulation_begin_change(simulation);
    status = kt_simulation_begin_jump(simulation, false, &before, error);
    if (status == KT_OK)
        status = exchange_parameters(change, simulation->curve, error);
    if (status == KT_OK) {
        status = move_to_change(simulation, change, &before, error);
        if (status != KT_OK)
            undo_parameters(change->model, change->parameters, change->count, simulation->curve);
    }
    return kt_simulation_end_change(simulation, status);
}

kt_status kt_simulation_jump(kt_simulation *simulation, const double *q, const double *v, kt_error *error) {
    const instant_change change = {.q = q, .v = v};
    return KT_IS_MISSING(error, simulation) ? KT_ERROR_ARGUMENT : jump(simulation, &change, error);
}

static kt_status check_given_auxiliary_states(const kt_simulation *simulation, const double *x, kt_error *error) {
    for (size_t i = 0; i < simulation->size.x; i++)
        if (!isfinite(x[i])) {
            return kt_error_set(
                error, KT_ERROR_NOT_FINITE,
                kt_where_format("state '%.100s'", kt_auxiliary_state_name(simulation->model, (int)i)).text,
                "'%.100s' is %g; give a finite number", kt_auxiliary_state_name(simulation->model, (int)i),
                isnan(x[i]) ? fabs(x[i]) : x[i]);
        }
    return KT_OK;
}

kt_status kt_simulation_set_auxiliary_states(kt_simulation *simulation, const double *x, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, x || !simulation->size.x))
        return KT_ERROR_ARGUMENT;
    const instant_change change = {.x = x};
    const kt_status status = check_given_auxiliary_states(simulation, x, error);
    return status == KT_OK && simulation->size.x > 0 ? jump(simulation, &change, error) : status;
}

/* Checks that parameters of a model may change while the simulation runs. */
static kt_status check_changed_model(const kt_simulation *simulation, const kt_model *copy, kt_error *error) {
    const bool related = copy->variants != NULL && copy->variants == simulation->model->variants;
    if (copy != simulation->model && !related)
        return kt_error_set(error, KT_ERROR_ARGUMENT, "kt_simulation_set_parameter",
                            "the simulation runs on another model than this copy");
    return KT_OK;
}

kt_status kt_simulation_set_parameter(kt_simulation *simulation, kt_model *copy, const kt_parameter *parameter,
                                      const double *values, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, copy, parameter, values))
        return KT_ERROR_ARGUMENT;
    kt_status status = check_changed_model(simulation, copy, error);
    if (status == KT_OK)
        status = kt_parameter_set(copy, parameter, values, error);
    if (status != KT_OK)
        return status;
    kt_simulation_renew_model(simulation);
    simulation->memory.changed = true;
    kt_simulation_await_inputs(simulation);
    simulation->cached = KT_CACHED_NOTHING;
    return KT_OK;
}

kt_status kt_simulation_change(kt_simulation *simulation, kt_model *model, kt_parameter_change *changes, int count,
                               const double *x, kt_error *error) {
    if (KT_IS_MISSING(error, simulation, model, changes || count <= 0))
        return KT_ERROR_ARGUMENT;
    const instant_change change = {.x = x, .model = model, .parameters = changes, .count = count};
    kt_status status = check_changed_model(simulation, model, error);
    if (status == KT_OK && x != NULL)
        status = check_given_auxiliary_states(simulation, x, error);
    return status == KT_OK ? jump(simulation, &change, error) : status;
}
