/* Calls of Python that do several things at once: a call of Python for each would take longer than the dynamics. Those
 * that move a simulation also let its watch take states (advice/driven.h). */
/* SPDX-License-Identifier: Apache-2.0 */
#include <math.h>
#include <stdlib.h>
#include <string.h>

static bool kt_python_lock(kt_python_guard *guard) {
    return !atomic_flag_test_and_set_explicit(&guard->is_held, memory_order_acquire);
}

static void kt_python_unlock(kt_python_guard *guard) {
    atomic_flag_clear_explicit(&guard->is_held, memory_order_release);
}

static int kt_python_forward(const kt_python_data *at, double t, const double *q, const double *v, const double *tau,
                             double *a) {
    if (!kt_python_lock(at->guard))
        return KT_PYTHON_BUSY;
    const kt_status status = kt_acceleration_evaluate(at->model, at->data, t, q, v, tau, NULL, a, at->error);
    if (status == KT_OK && a == at->a)
        *at->has_a = true;
    kt_python_unlock(at->guard);
    return (int)status;
}

static int kt_python_inverse(const kt_python_data *at, const double *q, const double *v, const double *a, double *tau) {
    if (!kt_python_lock(at->guard))
        return KT_PYTHON_BUSY;
    const kt_status status = kt_dynamics_inverse(at->model, at->data, q, v, a, NULL, tau, at->error);
    kt_python_unlock(at->guard);
    return (int)status;
}

/* ---- control loops ----------------------------------------------------------------------------------------------- */

/* The watch of the energy ends with the first torque. */
static void kt_python_note_supply(kt_python_loop *loop) {
    for (size_t i = 0; i < loop->nv; i++)
        if (loop->torque[i] != 0.0) {
            kt_driven_supply(loop->watch);
            return;
        }
}

/* Sets the torques of the loop, unless they are those that the simulation has: methods that remember past steps go
 * on. On failure those that the simulation has return to the loop. */
static kt_status kt_python_apply(kt_python_loop *loop, kt_error *error) {
    const size_t size = loop->nv * sizeof(double);
    if (size == 0 || memcmp(loop->torque, loop->applied, size) == 0)
        return KT_OK;
    const kt_status status = kt_simulation_set_torque(loop->simulation, loop->torque, error);
    if (status == KT_OK) {
        kt_python_note_supply(loop);
        memcpy(loop->applied, loop->torque, size);
    } else
        memcpy(loop->torque, loop->applied, size);
    return status;
}

static void kt_python_records_free(kt_python_records *records) {
    free(records->rows);
    free(records->events);
}

/* Makes room for one more row of `width` numbers. */
static bool kt_python_make_room(double **rows, size_t count, size_t *room, size_t width, bool *is_short) {
    if (count < *room)
        return true;
    const size_t more = *room > 0 ? 2 * *room : 256;
    double *longer = realloc(*rows, more * width * sizeof *longer);
    *is_short = longer == NULL;
    if (longer != NULL)
        *rows = longer, *room = more;
    return longer != NULL;
}

/* Adds the events that have happened at the present time: steps end at events. */
static void kt_python_note_events(kt_python_loop *loop) {
    kt_python_records *r = loop->records;
    for (size_t k = 0; k < r->names && !r->is_short; k++) {
        const uint64_t count =
            kt_simulation_event_count(loop->simulation, kt_simulation_event_name(loop->simulation, k));
        if (count > r->seen[k] && kt_python_make_room(&r->events, r->event_count, &r->event_room, 2, &r->is_short)) {
            double *pair = r->events + 2 * r->event_count++;
            pair[0] = kt_simulation_time(loop->simulation);
            pair[1] = (double)k;
        }
        r->seen[k] = count;
    }
}

/* Adds a record of the present state if its interval has passed. */
static void kt_python_take_record(kt_python_loop *loop) {
    kt_python_records *records = loop->records;
    const double t = kt_simulation_time(loop->simulation);
    if (!records || records->is_short || t < records->next - 1e-9 * records->interval ||
        !kt_python_make_room(&records->rows, records->count, &records->room, records->width, &records->is_short))
        return;
    double *row = records->rows + records->count++ * records->width;
    const size_t states = records->width - 1 - loop->nv;
    row[0] = t;
    memcpy(row + 1, kt_simulation_positions(loop->simulation), states * sizeof *row);
    memcpy(row + 1 + states, loop->applied, loop->nv * sizeof *row);
    records->next = records->interval > 0.0 ? (floor(t / records->interval + 1e-9) + 1.0) * records->interval : t;
}

/* kt_simulation_tick step by step, with the same bits, so that events between are noted. Advancing to the present time
 * checks the call and begins its events. */
static kt_status kt_python_tick_by_steps(kt_python_loop *loop, double period, kt_error *error) {
    kt_simulation *s = loop->simulation;
    const double end = kt_simulation_period_end(s, period);
    if (!(end > kt_simulation_time(s)))
        return kt_simulation_tick(s, period, error); /* which rejects the period */
    kt_status status = kt_simulation_advance(s, kt_simulation_time(s), error);
    kt_python_note_events(loop);
    while (status == KT_OK && kt_simulation_stopped(s) == NULL && kt_simulation_time(s) < end) {
        status = kt_simulation_step(s, end, error);
        kt_python_note_events(loop);
    }
    return status;
}

/* A call that moves the simulation: kt_simulation_tick, kt_simulation_step or kt_simulation_advance. The watch takes
 * states before and after. */
static int kt_python_move(kt_python_loop *loop, kt_status (*move)(kt_simulation *, double, kt_error *), double by,
                          kt_error *error) {
    kt_status status = kt_python_apply(loop, error);
    const bool notes = loop->records && loop->records->names > 0;
    if (status == KT_OK) {
        kt_driven_begin(loop->watch);
        status = notes && move == kt_simulation_tick ? kt_python_tick_by_steps(loop, by, error)
                                                     : move(loop->simulation, by, error);
    }
    if (notes)
        kt_python_note_events(loop);
    if (status != KT_OK)
        return (int)status;
    if (loop->records)
        kt_python_take_record(loop);
    return kt_driven_take(loop->watch) ? KT_PYTHON_WARNED : KT_OK;
}

static int kt_python_guarded(kt_python_guard *guard, kt_python_loop *loop,
                             kt_status (*move)(kt_simulation *, double, kt_error *), double by, kt_error *error) {
    if (!kt_python_lock(guard))
        return KT_PYTHON_BUSY;
    const int status = kt_python_move(loop, move, by, error);
    kt_python_unlock(guard);
    return status;
}

static int kt_python_tick(kt_python_guard *guard, kt_python_loop *loop, double period, kt_error *error) {
    return kt_python_guarded(guard, loop, kt_simulation_tick, period, error);
}

static int kt_python_step(kt_python_guard *guard, kt_python_loop *loop, double limit, kt_error *error) {
    return kt_python_guarded(guard, loop, kt_simulation_step, limit, error);
}

/* kt_simulation_advance step by step, so that the watch takes states between. Advancing to the present time checks the
 * call and begins its events. */
static int kt_python_advance(kt_python_guard *guard, kt_python_loop *loop, double end, kt_error *error) {
    kt_simulation *s = loop->simulation;
    const double now = kt_simulation_time(s);
    int status = kt_python_guarded(guard, loop, kt_simulation_advance, end >= now ? now : end, error);
    if (!(end > now) || (status != KT_OK && status != KT_PYTHON_WARNED))
        return status;
    if (!kt_python_lock(guard))
        return KT_PYTHON_BUSY;
    while ((status == KT_OK || status == KT_PYTHON_WARNED) && kt_simulation_stopped(s) == NULL &&
           kt_simulation_time(s) < end)
        status = kt_python_move(loop, kt_simulation_step, end, error);
    kt_python_unlock(guard);
    return status;
}

/* Whether a loop until the time `end` has ended: by its time, or by an event. */
static bool kt_python_has_ended(const kt_python_loop *loop, double end) {
    return !(kt_simulation_time(loop->simulation) < end * (1.0 - 1e-12)) ||
           kt_simulation_stopped(loop->simulation) != NULL;
}

/* One turn of a loop, whose last period ends at `end`. */
static int kt_python_turn(kt_python_guard *guard, kt_python_loop *loop, double period, double end, kt_error *error) {
    const double left = end - kt_simulation_time(loop->simulation);
    const int status = kt_python_tick(guard, loop, period < left ? period : left, error);
    return status == KT_OK && kt_python_has_ended(loop, end) ? KT_PYTHON_ENDED : status;
}

/* The law torque + gain [q_at (-) q; v_at - v]. */
static int kt_python_feedback_law(void *user, double t, const double *q, const double *v, double *tau) {
    const kt_python_feedback *f = user;
    const size_t n = f->nv;
    (void)t;
    kt_position_subtract(f->model, f->q, q, f->error);
    for (size_t i = 0; i < n; i++)
        f->error[n + i] = f->v[i] - v[i];
    for (size_t i = 0; i < n; i++) {
        const double *row = f->gain + i * 2 * n;
        double sum = f->torque[i];
        for (size_t k = 0; k < 2 * n; k++)
            sum += row[k] * f->error[k];
        tau[i] = sum;
    }
    return 0;
}

static void kt_python_feed_back(kt_python_feedback *feedback, kt_python_loop *loop) {
    const kt_simulation *s = loop->simulation;
    (void)kt_python_feedback_law(feedback, 0.0, kt_simulation_positions(s), kt_simulation_velocities(s), loop->torque);
}

/* The whole loop with a law in C. */
static int kt_python_control(kt_python_loop *loop, kt_python_law *law, void *user, double period, double end,
                             kt_error *error) {
    kt_simulation *s = loop->simulation;
    const double *q = kt_simulation_positions(s), *v = kt_simulation_velocities(s);
    while (!kt_python_has_ended(loop, end)) {
        const double left = end - kt_simulation_time(s);
        if (law(user, kt_simulation_time(s), q, v, loop->torque) != 0)
            return KT_PYTHON_ENDED;
        const int status = kt_python_move(loop, kt_simulation_tick, period < left ? period : left, error);
        if (status != KT_OK && status != KT_PYTHON_WARNED) /* warnings are reported at the end */
            return status;
    }
    return KT_OK;
}

/* ---- all states of a batch --------------------------------------------------------------------------------------- */

/* Copies rows of n numbers, one for each state, into groups of lanes; zeros if there are no rows. */
static void kt_python_set_lanes(double *lanes, size_t stride, size_t width, size_t states, size_t n,
                                const double *rows) {
    for (size_t i = 0; i < states; i++) {
        double *to = lanes + i / width * stride + i % width;
        for (size_t k = 0; k < n; k++)
            to[k * width] = rows ? rows[i * n + k] : 0.0;
    }
}

static void kt_python_get_lanes(const double *lanes, size_t stride, size_t width, size_t states, size_t n,
                                double *rows) {
    for (size_t i = 0; i < states && rows; i++) {
        const double *from = lanes + i / width * stride + i % width;
        for (size_t k = 0; k < n; k++)
            rows[i * n + k] = from[k * width];
    }
}

static void kt_python_batch_set(kt_batch *batch, const kt_python_rows *rows) {
    const kt_batch_lanes to = kt_batch_lanes_of(batch);
    for (size_t i = 0; i < rows->states; i++)
        to.t[i] = rows->t;
    kt_python_set_lanes(to.q, to.state_stride, to.width, rows->states, rows->nq, rows->q);
    kt_python_set_lanes(to.v, to.state_stride, to.width, rows->states, rows->nv, rows->v);
    if (rows->x)
        kt_python_set_lanes(to.x, to.state_stride, to.width, rows->states, rows->nx, rows->x);
    if (rows->a)
        kt_python_set_lanes(to.a, to.force_stride, to.width, rows->states, rows->nv, rows->a);
    else
        kt_python_set_lanes(to.tau, to.force_stride, to.width, rows->states, rows->nv, rows->tau);
}

static void kt_python_batch_get(kt_batch *batch, const kt_python_rows *rows) {
    const kt_batch_lanes from = kt_batch_lanes_of(batch);
    kt_python_get_lanes(from.q, from.state_stride, from.width, rows->states, rows->nq, rows->q);
    kt_python_get_lanes(from.v, from.state_stride, from.width, rows->states, rows->nv, rows->v);
    kt_python_get_lanes(from.x, from.state_stride, from.width, rows->states, rows->nx, rows->x);
    kt_python_get_lanes(from.tau, from.force_stride, from.width, rows->states, rows->nv, rows->tau);
    kt_python_get_lanes(from.a, from.force_stride, from.width, rows->states, rows->nv, rows->a);
}
