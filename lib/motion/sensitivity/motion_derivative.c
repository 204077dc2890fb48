/* A and B of a simulation's motion over an interval, through its events.
 *
 * Between events, they are products of the matrices of the steps. An event is the root of g(t, x) along the motion. The
 * state after the event is x+ = R(t, x-): an impact, a contact that closes, an action. A neighbouring motion that
 * differs by dx at the time of the event reaches its own root later by
 *
 *     dt = -(g_x dx) / g',   g' = g_t + g_x f-
 *
 * At its root, this motion differs by d = dx + f- dt, and after the event by R_x d + R_t dt. Followed along the motion
 * after the event back to the time of the event, it differs by
 *
 *     dx+ = R_x (dx + f- dt) + R_t dt - f+ dt
 *
 * This is the saltation matrix times dx. The simulation itself evaluates R, and R is differenced only along the columns
 * of A and B. The change d is tangent to g = 0 and to the loops, so that neighbours reach the event, too. R_x d, g_x dx
 * and g' are differences of order four.
 *
 * Every neighbour is set in the simulation itself, and a checkpoint restores the simulation. The derivative does not
 * exist if a neighbour has another outcome than the motion (a different set of closed contacts), or if g touches zero
 * without a change of sign. The call then reports an error.
 *
 * Sources: Aizerman, Gantmacher, QJMAM 11, 1958; Leine, Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical
 * Systems, 2004, 7.1.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/sum.h"
#include "base/where.h"
#include "contact/contact.h"
#include "dynamics/dynamics.h"
#include "kinetree/joint.h"
#include "model/switching.h"
#include "sensitivity/sensitivity.h"
#include "simulation/event_root.h"

#include <math.h>

/* The shift of the largest number of a change in a difference: small enough that a contact still counts this shift as
 * rest, and far above rounding. */
static const double reach = 1e-4;
/* If g' is below this part of the largest |g| of a neighbour over its distance, the event is touched and not
 * crossed. */
static const double grazing = 1e-7;

/* Every array: type, name, count, meaning. N numbers of a change, n of the integrator's state, C columns: N and nv. */
#define KT_MOTION_FIELDS(X)                                                                                            \
    X(double, change, m->N * m->columns, "of the present state: A and B so far")                                       \
    X(double, moved, m->N * m->columns, "scratch: behind a step or an event")                                          \
    X(double, A, m->N * m->N, "of a step")                                                                             \
    X(double, B, m->N * m->nv, "of a step")                                                                            \
    X(double, start, m->n, "y where a step begins")                                                                    \
    X(double, before, m->n, "y at an event")                                                                           \
    X(double, after, m->n, "y behind it")                                                                              \
    X(double, rate_before, m->N, "f- there")                                                                           \
    X(double, rate_after, m->N, "f+")                                                                                  \
    X(double, later, m->columns, "dt of each column")                                                                  \
    X(double, y, m->n, "of a neighbour")                                                                               \
    X(double, sum, m->n, "of differences, and scratch")                                                                \
    X(double, along, m->N, "of a difference: d")                                                                       \
    X(double, torque, m->nv, "joint forces that are held")                                                             \
    X(char, checkpoint, m->saved, "of the simulation at an event")                                                     \
    X(char, data_memory, m->data_size, "data of steps")                                                                \
    X(char, step_memory, m->step_size, "work of steps")

typedef struct motion {
    kt_simulation *simulation;
    const kt_model *model; /* of the last step */
    kt_data *data;
    size_t N, n, nq, nv, columns;
    size_t saved, data_size, step_size; /* bytes */
    KT_ARENA_DECLARE(KT_MOTION_FIELDS)
} motion;

/* A direction of differences. The state changes at the rate `change` (N), and the time at the rate `time`. The joint
 * force of the coordinate tau changes at the rate 1 (-1: none). */
typedef struct direction {
    const double *change;
    int tau;
    double time;
} direction;

KT_ARENA_ARRAYS(place_arrays, motion, KT_MOTION_FIELDS, const motion *m)

/* ---- memory ------------------------------------------------------------------------------------------------------ */

/* The method whose steps are differentiated: the method of the simulation. Steps that depend on earlier steps are not
 * functions of a state. For such a method, radau5 over the same steps is used, which is stable for any step size. */
static const kt_method *method_of(const kt_simulation *simulation) {
    const kt_method *method = kt_integrator_method(simulation->integrator);
    return kt_step_work_size(simulation->model, method) > 0 ? method : kt_method_find("radau5");
}

/* The work of a step, for the largest of all sets of switches. */
static size_t step_size_of(const kt_model *model, const kt_method *method) {
    size_t most = kt_step_work_size(model, method);
    for (uint64_t k = 0; model->variants != NULL && most > 0 && k < kt_variants_count(model->variants); k++) {
        const size_t size = kt_step_work_size(kt_variants_model(model->variants, k), method);
        most = size > most ? size : most;
    }
    return most;
}

static void measure_motion(motion *m, const kt_simulation *simulation) {
    const kt_model *model = simulation->model;
    *m = (motion){.model = model,
                  .N = kt_tangent_numbers(model),
                  .n = simulation->size.n,
                  .nq = model->n.q,
                  .nv = model->n.v,
                  .columns = kt_tangent_numbers(model) + model->n.v,
                  .saved = kt_simulation_state_size(simulation),
                  .data_size = kt_data_size(model),
                  .step_size = step_size_of(model, method_of(simulation))};
}

size_t kt_motion_work_size(const kt_simulation *simulation) {
    motion m;
    if (simulation == NULL)
        return 0;
    measure_motion(&m, simulation);
    return m.step_size > 0 ? place_arrays(&m, NULL, &m) : 0;
}

static kt_status check_differentiated_simulation(const kt_simulation *simulation, kt_error *error) {
    if (simulation->options.acceleration != NULL || simulation->options.projection != NULL)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, "kt_motion_derivatives",
                            "the simulation uses equations or a projection of the caller, whose derivatives are "
                            "unknown; use those of the engine");
    if (kt_motion_work_size(simulation) == 0)
        return kt_error_set(error, KT_ERROR_UNSUPPORTED, "kt_motion_derivatives",
                            "a step of '%s' depends on earlier steps, so that it has no derivatives with respect to "
                            "one state; use rk4, dopri5, implicit-euler, crank-nicolson, radau5 or rodas5p",
                            kt_integrator_method(simulation->integrator)->name);
    return KT_OK;
}

/* The columns begin with A = 1 and B = 0. */
static kt_status begin_motion(motion *m, kt_simulation *simulation, void *work, size_t work_size, kt_error *error) {
    kt_status status = check_differentiated_simulation(simulation, error);
    if (status == KT_OK)
        status = kt_arena_check("work", "kt_motion_work_size", work, work_size, kt_motion_work_size(simulation), error);
    if (status != KT_OK)
        return status;
    measure_motion(m, simulation);
    m->simulation = simulation;
    (void)place_arrays(m, work, m);
    memset(m->change, 0, m->N * m->columns * sizeof *m->change);
    for (size_t i = 0; i < m->N; i++)
        m->change[i * m->N + i] = 1.0;
    return kt_data_init_followed(m->model, m->data_memory, m->data_size, &m->data, error);
}

/* ---- steps ------------------------------------------------------------------------------------------------------- */

/* change = A change. B is added to the columns of joint forces. */
static void multiply_changes(motion *m) {
    for (size_t j = 0; j < m->columns; j++) {
        const double *from = m->change + j * m->N;
        double *to = m->moved + j * m->N;
        kt_copy_or_clear(to, j >= m->N ? m->B + (j - m->N) * m->N : NULL, m->N * sizeof *to);
        for (size_t k = 0; k < m->N; k++)
            kt_add_times(to, from[k], m->A + k * m->N, m->N);
    }
    kt_copy(m->change, m->moved, m->N * m->columns * sizeof *m->change);
}

/* Adds the step that the simulation has taken from (t0, start). */
static kt_status add_taken_step(motion *m, double t0, kt_error *error) {
    const kt_simulation *simulation = m->simulation;
    const bool any = simulation->breakpoints.any; /* slopes are evaluated inside of the step */
    const double t1 = kt_integrator_time(simulation->integrator);
    const double from = any ? kt_simulation_time_inside(simulation, t0) : t0;
    const double to = any ? kt_simulation_time_inside(simulation, t1) : t1;
    const kt_step step = {.method = method_of(simulation),
                          .t = from,
                          .h = to - from,
                          .end = to,
                          .tau = simulation->tau,
                          .external = simulation->external,
                          .unprojected = simulation->options.unprojected};
    const kt_variants *variants = simulation->model->variants;
    const bool masks = variants != NULL && variants->switches.masked != 0;
    if ((simulation->model != m->model || masks)) /* a mask may have changed in its place */
        kt_data_rebind(simulation->model, m->data);
    m->model = simulation->model;
    kt_auxiliary_states_put(m->model, m->data, m->start);
    kt_step_work w;
    kt_status status = kt_step_begin(&w, m->model, m->data, m->step_memory, m->step_size, &step, error);
    if (status != KT_OK)
        return status;
    w.watched = true;
    status = kt_step_tangents(&w, m->start, m->start + m->nq, m->nv, error);
    if (status == KT_OK) {
        kt_step_give(&w, m->A, m->B);
        multiply_changes(m);
    }
    return status;
}

/* ---- events ------------------------------------------------------------------------------------------------------ */

static kt_status reject_event(const motion *m, size_t k, kt_status code, const char *words, kt_error *error) {
    return kt_error_set(
        error, code,
        kt_where_at("event", m->simulation->events.list[k].name, kt_integrator_time(m->simulation->integrator)).text,
        "%s", words);
}

/* Finds the event at the present time that changes the motion; events.count: there is none. */
static kt_status find_event(const motion *m, size_t *event, kt_error *error) {
    const kt_simulation *simulation = m->simulation;
    const size_t contacts = kt_simulation_contact_events(simulation);
    *event = simulation->events.count;
    for (size_t k = 0; k < simulation->events.count; k++) {
        if (!simulation->event_root[k].due || simulation->events.list[k].action == NULL)
            continue;
        if (*event < simulation->events.count)
            return reject_event(
                m, k, KT_ERROR_SINGULAR,
                "it happens at the same instant as another one; neighbouring motions have them in either "
                "order, and there is no derivative",
                error);
        if (k >= contacts && !simulation->events.list[k].repeatable)
            return reject_event(
                m, k, KT_ERROR_UNSUPPORTED,
                "its action would also be called in neighbouring states; if it only jumps and switches, set "
                "kt_event.repeatable",
                error);
        *event = k;
    }
    return KT_OK;
}

/* Writes the neighbour at a distance s along a direction to m->y, and its joint forces to the simulation. Returns its
 * time. */
static double make_neighbour(motion *m, const direction *d, double s) {
    kt_simulation *simulation = m->simulation;
    const size_t nq = m->nq, nv = m->nv;
    for (size_t i = 0; i < nv; i++)
        m->sum[i] = s * d->change[i];
    kt_copy(m->y, m->before, m->n * sizeof *m->y);
    kt_position_add(simulation->model, m->before, m->sum, m->y);
    for (size_t i = nv; i < m->N; i++)
        m->y[nq + i - nv] += s * d->change[i];
    if (d->tau >= 0) {
        kt_copy(simulation->torque, m->torque, nv * sizeof *m->torque);
        simulation->torque[d->tau] += s;
        simulation->memory.now.torque = true;
        kt_simulation_inputs_use(simulation);
    }
    return kt_integrator_time(simulation->integrator) + s * d->time;
}

/* The distance s at which the largest number of the direction shifts by `reach`; 0 for a direction without a change. */
static double direction_distance_of(const motion *m, const direction *d) {
    double most = fmax(fabs(d->time), d->tau >= 0 ? 1.0 : 0.0);
    for (size_t i = 0; i < m->N; i++)
        most = fmax(most, fabs(d->change[i]));
    return most > 0.0 ? reach / most : 0.0;
}

/* Central differences of order four over s: sum_i weight_i x(offset_i s) / s. */
enum { POINTS = 4 };
static const double offset[POINTS] = {-2.0, -1.0, 1.0, 2.0};
static const double weight[POINTS] = {1.0 / 12.0, -8.0 / 12.0, 8.0 / 12.0, -1.0 / 12.0};

/* The derivative of g along a direction; *size: the largest |g| of the neighbours, over the distance. */
static kt_status difference_value(motion *m, size_t k, const direction *d, double *rate, double *size,
                                  kt_error *error) {
    kt_simulation *simulation = m->simulation;
    const double s = direction_distance_of(m, d);
    kt_status status = KT_OK;
    *rate = *size = 0.0;
    for (int i = 0; status == KT_OK && i < POINTS && s > 0.0; i++) {
        double g, first;
        const double t = make_neighbour(m, d, offset[i] * s);
        /* The first contact computes the values of all contacts (contact/values.c). */
        if (k > 0 && k < kt_simulation_contact_events(simulation))
            status = kt_event_evaluate(simulation, 0, t, m->y, &first, error);
        if (status == KT_OK)
            status = kt_event_evaluate(simulation, k, t, m->y, &g, error);
        if (status == KT_OK) {
            *rate += weight[i] / s * g;
            *size = fmax(*size, fabs(g) / s);
        }
    }
    return status;
}

/* Computes velocities, accelerations and rates of auxiliary states: the change (N) of the state y in a unit of time. */
static kt_status find_state_rate(motion *m, double t, const double *y, double *rate, kt_error *error) {
    kt_simulation *simulation = m->simulation;
    const kt_integrator_callbacks callbacks = kt_simulation_callbacks(simulation);
    simulation->cause.code = KT_OK;
    if (callbacks.rhs(t, y, m->sum, callbacks.user) != 0)
        return kt_simulation_fail(simulation, &simulation->cause, error);
    kt_copy(rate, y + m->nq, m->nv * sizeof *rate);
    kt_copy(rate + m->nv, m->sum + m->nq, (m->N - m->nv) * sizeof *rate);
    return KT_OK;
}

/* Moves the simulation to a neighbour, whose loops are closed at the time `closing`. */
static kt_status move_to_neighbour(motion *m, double t, double closing, kt_error *error) {
    kt_simulation *simulation = m->simulation;
    const kt_integrator_callbacks callbacks = kt_simulation_callbacks(simulation);
    bool changed = false;
    kt_status status = kt_simulation_project(simulation, closing, m->y, &changed, error);
    if (status == KT_OK)
        status = kt_integrator_start(simulation->integrator, t, m->y, &callbacks, error);
    if (status != KT_OK)
        return status;
    kt_copy(simulation->state, m->y, simulation->size.state * sizeof *m->y);
    simulation->events.time = (double)NAN;
    simulation->cached = KT_CACHED_NOTHING;
    kt_simulation_forget_breakpoints(simulation);
    return KT_OK;
}

/* The outcome of an event, which must be equal for its neighbours. */
typedef struct outcome {
    uint64_t set, loops; /* a checksum of the loops that are on: a set may not tell all contacts apart */
    uint64_t impacts;
    int touching;
} outcome;

static bool is_same_outcome(const outcome *a, const outcome *b) {
    return a->set == b->set && a->loops == b->loops && a->impacts == b->impacts && a->touching == b->touching;
}

/* The outcome of the events that the simulation has just applied. */
static outcome outcome_of(const kt_simulation *simulation) {
    const kt_model *model = simulation->model;
    outcome end = {.set = model->set, .loops = KT_SUM_START};
    for (size_t i = 0; i < model->n.loop; i++) {
        const bool is_off = kt_loop_is_off(&model->loop[i]);
        end.loops = kt_sum_add(end.loops, &is_off, sizeof is_off);
    }
    end.impacts = simulation->memory.contacts.impacts;
    end.touching = simulation->contacts != NULL ? kt_contacts_total(simulation->contacts) : 0;
    return end;
}

/* Adds the difference of a neighbour's state y from m->after, times a factor. */
static void add_difference(motion *m, double factor, const double *y, double *to) {
    for (size_t j = 0; j < m->n; j++)
        m->sum[j] = factor * (y[j] - m->after[j]);
    kt_tangent_drop(m->simulation->model, m->after, m->sum, m->along);
    kt_copy(m->along + m->nv, m->sum + m->nq, (m->N - m->nv) * sizeof *to);
    for (size_t j = 0; j < m->N; j++)
        to[j] += m->along[j];
}

/* Computes R_x d + R_t dt, the difference of the states after the event along a direction, to `to` (N). */
static kt_status difference_state(motion *m, size_t k, const direction *d, const outcome *end, double *to,
                                  kt_error *error) {
    kt_simulation *simulation = m->simulation;
    const double s = direction_distance_of(m, d);
    memset(to, 0, m->N * sizeof *to);
    for (int i = 0; i < POINTS && s > 0.0; i++) {
        kt_status status = kt_simulation_restore(simulation, m->checkpoint, error);
        const double t = make_neighbour(m, d, offset[i] * s);
        if (status == KT_OK)
            status = move_to_neighbour(m, t, t, error);
        if (status == KT_OK)
            status = kt_simulation_fire(simulation, NULL, NULL, error);
        if (status == KT_ERROR_CONSTRAINT)
            return reject_event(
                m, k, KT_ERROR_SINGULAR,
                "neighbouring motions meet another contact that is nearly closed, or loops that they cannot "
                "close, and there is no derivative",
                error);
        if (status != KT_OK)
            return status;
        const outcome its = outcome_of(simulation);
        if (!is_same_outcome(&its, end))
            return reject_event(
                m, k, KT_ERROR_SINGULAR,
                "neighbouring motions come out of it with other contacts closed, and there is no derivative", error);
        add_difference(m, weight[i] / s, kt_integrator_state(simulation->integrator), to);
    }
    return KT_OK;
}

/* Computes the delays with which neighbouring motions reach the event. */
static kt_status find_event_delays(motion *m, size_t k, kt_error *error) {
    const double t = kt_integrator_time(m->simulation->integrator);
    double rate, size;
    kt_status status = find_state_rate(m, t, m->before, m->rate_before, error);
    if (status == KT_OK)
        status = difference_value(m, k, &(direction){m->rate_before, -1, 1.0}, &rate, &size, error);
    if (status == KT_OK && !(fabs(rate) > grazing * size))
        return reject_event(
            m, k, KT_ERROR_SINGULAR,
            "its value touches zero without crossing it; neighbouring motions may miss it, and there is no "
            "derivative",
            error);
    for (size_t j = 0; status == KT_OK && j < m->columns; j++) {
        double by;
        const direction d = {m->change + j * m->N, j < m->N ? -1 : (int)(j - m->N), 0.0};
        status = difference_value(m, k, &d, &by, &size, error);
        m->later[j] = -by / rate;
    }
    return status;
}

/* Computes the columns after the event, in place in m->change; m->moved is scratch. The state of the simulation is
 * undefined afterwards. */
static kt_status find_saltation(motion *m, size_t k, kt_error *error) {
    kt_simulation *simulation = m->simulation;
    const double t = kt_integrator_time(simulation->integrator);
    kt_status status = find_event_delays(m, k, error);
    if (status == KT_OK)
        status = kt_simulation_restore(simulation, m->checkpoint, error);
    if (status == KT_OK)
        status = kt_simulation_fire(simulation, NULL, NULL, error);
    if (status != KT_OK)
        return status;
    const outcome end = outcome_of(simulation);
    kt_copy(m->after, kt_integrator_state(simulation->integrator), m->n * sizeof *m->after);
    status = find_state_rate(m, t, m->after, m->rate_after, error);
    for (size_t j = 0; status == KT_OK && j < m->columns; j++) {
        double *column = m->change + j * m->N, *to = m->moved + j * m->N, later = m->later[j];
        for (size_t i = 0; i < m->N; i++)
            column[i] += later * m->rate_before[i];
        const direction d = {column, j < m->N ? -1 : (int)(j - m->N), later};
        status = difference_state(m, k, &d, &end, to, error);
        for (size_t i = 0; i < m->N; i++)
            to[i] -= later * m->rate_after[i];
    }
    kt_copy(m->change, m->moved, m->N * m->columns * sizeof *m->change);
    return status;
}

/* Applies the events at the present time to the motion and to its changes. A contact may open because forces jump. Such
 * a contact opens at the same time in neighbouring motions, whose states do not change. */
static kt_status pass_events(motion *m, kt_error *error) {
    kt_simulation *simulation = m->simulation;
    size_t k;
    kt_status status = find_event(m, &k, error);
    if (status != KT_OK)
        return status;
    if (k < simulation->events.count && !kt_simulation_has_jumped(simulation)) {
        kt_simulation_save(simulation, m->checkpoint);
        kt_copy(m->before, kt_integrator_state(simulation->integrator), m->n * sizeof *m->before);
        kt_copy(m->torque, simulation->torque, m->nv * sizeof *m->torque);
        status = find_saltation(m, k, error);
        const kt_status back = kt_simulation_restore(simulation, m->checkpoint, status == KT_OK ? error : NULL);
        status = status == KT_OK ? back : status;
    }
    return status == KT_OK ? kt_simulation_fire(simulation, NULL, NULL, error) : status;
}

/* ---- drives whose speed jumps ------------------------------------------------------------------------------------ */

/* Returns to the checkpoint, and applies the jumps of drives, from a neighbour or from the motion itself (d: NULL). */
static kt_status strike_neighbour(motion *m, const direction *d, double s, kt_error *error) {
    kt_simulation *simulation = m->simulation;
    kt_step_progress progress;
    kt_status status = kt_simulation_restore(simulation, m->checkpoint, error);
    if (status == KT_OK && d != NULL) {
        kt_simulation_recall_breakpoints(simulation);
        const double t = make_neighbour(m, d, s);
        status = move_to_neighbour(m, t, kt_simulation_closing_time(simulation, t), error);
    }
    return status == KT_OK ? kt_phase_enter(simulation, HUGE_VAL, &progress, error) : status;
}

/* The step that was taken began with a jump of m->start, the state of the checkpoint (jump.c). Moves the columns to the
 * state behind the jump, and the simulation back to the checkpoint. */
static kt_status pass_strike(motion *m, kt_error *error) {
    kt_simulation *simulation = m->simulation;
    kt_copy(m->before, m->start, m->n * sizeof *m->before);
    kt_status status = strike_neighbour(m, NULL, 0.0, error);
    const outcome end = outcome_of(simulation);
    kt_copy(m->after, kt_integrator_state(simulation->integrator), m->n * sizeof *m->after);
    memset(m->moved, 0, m->N * m->columns * sizeof *m->moved);
    for (size_t j = 0; j < m->columns; j++) {
        const direction d = {m->change + j * m->N, -1, 0.0};
        const double s = direction_distance_of(m, &d);
        for (int i = 0; status == KT_OK && i < POINTS && s > 0.0; i++) {
            status = strike_neighbour(m, &d, offset[i] * s, error);
            const outcome its = outcome_of(simulation);
            if (status == KT_OK && !is_same_outcome(&its, &end))
                return kt_error_set(error, KT_ERROR_SINGULAR,
                                    kt_where_format("t = %.9g s", kt_integrator_time(simulation->integrator)).text,
                                    "the speed of a drive jumps, and neighbouring motions have other contacts closed "
                                    "behind the jump; there is no derivative");
            if (status == KT_OK)
                add_difference(m, weight[i] / s, kt_integrator_state(simulation->integrator), m->moved + j * m->N);
        }
    }
    kt_copy(m->start, m->after, m->n * sizeof *m->start);
    kt_copy(m->change, m->moved, m->N * m->columns * sizeof *m->change);
    return status == KT_OK ? kt_simulation_restore(simulation, m->checkpoint, error) : status;
}

/* ---- the public function ----------------------------------------------------------------------------------------- */

/* Takes one step, at most to t_end, and applies its matrices and then the events at its end to the columns. If drives
 * jump at its beginning, the columns first change to the state behind the jump, and the step is taken again from the
 * checkpoint. The time does not advance if a part ends the step at its beginning (KT_VERDICT_STAY) to let events take
 * effect. */
static kt_status advance_motion(motion *m, double t_end, kt_error *error) {
    kt_simulation *simulation = m->simulation;
    const double t = kt_integrator_time(simulation->integrator);
    kt_copy(m->start, kt_integrator_state(simulation->integrator), m->n * sizeof *m->start);
    if (simulation->breakpoints.any)
        kt_simulation_save(simulation, m->checkpoint);
    kt_status status = kt_simulation_take_step(simulation, t_end, error);
    if (status == KT_OK && simulation->breakpoints.struck && simulation->breakpoints.begin == t) {
        status = pass_strike(m, error);
        if (status == KT_OK)
            status = kt_simulation_take_step(simulation, t_end, error);
    }
    if (status == KT_OK && kt_integrator_time(simulation->integrator) > t)
        status = add_taken_step(m, t, error);
    return status == KT_OK && simulation->memory.fires ? pass_events(m, error) : status;
}

kt_status kt_motion_derivatives(kt_simulation *simulation, void *work, size_t work_size, double t_end, double *A,
                                double *B, kt_error *error) {
    motion m;
    if (KT_IS_MISSING(error, simulation) || kt_simulation_require_outermost(simulation, __func__, error) != KT_OK)
        return KT_ERROR_ARGUMENT;
    const double t = kt_integrator_time(simulation->integrator);
    if (!(t_end >= t) || !isfinite(t_end))
        return kt_error_set(error, KT_ERROR_ARGUMENT, "t_end",
                            "%.17g s must be a time not before the current one, %.17g s", t_end, t);
    kt_status status = begin_motion(&m, simulation, work, work_size, error);
    if (status != KT_OK)
        return status;
    simulation->memory.stopped = 0;
    if (simulation->memory.fires) /* a call has ended before events took effect */
        status = pass_events(&m, error);
    while (status == KT_OK && simulation->memory.stopped == 0 && kt_integrator_time(simulation->integrator) < t_end)
        status = advance_motion(&m, t_end, error);
    kt_simulation_skip_records(simulation);
    if (status != KT_OK)
        return status;
    if (A != NULL)
        kt_copy(A, m.change, m.N * m.N * sizeof *A);
    if (B != NULL)
        kt_copy(B, m.change + m.N * m.N, m.N * m.nv * sizeof *B);
    return KT_OK;
}
