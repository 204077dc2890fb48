/* The equations that a simulation integrates: its right-hand side and its projection.
 *
 * The state is y = (q, v, x), and the right-hand side is
 *
 *     q' = E(q) v           v itself except for quaternions, p' = p o (0, w) / 2 (kt_position_rate)
 *     v' = a(t, q, v, x)    kt_acceleration_evaluate, or the caller's
 *     x' = f(t, q, v, x)    auxiliary states, absent in most models (kt_auxiliary_state_rates)
 *
 * If some coordinates move no mass, all three are evaluated at the (q, v) in which the forces on these coordinates are
 * balanced (kt_massless_balance).
 *
 * If a balance is computed, y = (q, v, x, W_d, W_s) with W_d' and W_s' the powers dissipated and supplied
 * (kt_power_evaluate).
 *
 * Runge-Kutta steps leave the norm of quaternions and the closure of loops wrong by their local error. After each
 * accepted step both are corrected [MSD 7.55 to 7.58]. The correction changes the state by at most that error and
 * therefore keeps the method's order.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "algebra/lane.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "model/switching.h"
#include "step/simulation_core.h"

#include <assert.h>
#include <float.h>
#include <math.h>
#include <string.h>

bool kt_simulation_is_recoverable(kt_status status) {
    return status == KT_ERROR_NOT_FINITE || status == KT_ERROR_SINGULAR || status == KT_ERROR_CONSTRAINT ||
           status == KT_ERROR_EFFECT;
}

void kt_simulation_inputs_use(kt_simulation *simulation) {
    simulation->tau = simulation->memory.now.torque ? simulation->torque : NULL;
    simulation->external = simulation->memory.now.wrenches ? simulation->wrench : NULL;
}

/* ---- the caller's equations -------------------------------------------------------------------------------------- */

/* A state as the caller's callbacks receive it. In y, the auxiliary states follow the velocities. */
static kt_instant evaluated_instant_of(const kt_simulation *simulation, const kt_dynamic_state *at) {
    return (kt_instant){.model = simulation->model,
                        .data = simulation->data,
                        .t = at->t,
                        .q = at->q,
                        .v = at->v,
                        .x = at->v + simulation->size.nv,
                        .tau = at->tau,
                        .external = at->external};
}

/* The error of the caller's callback that returned `result`, with its message or, if it wrote none, a standard message.
 * The status tells whether a smaller step may avoid the error, which results above 0 mean. */
static kt_status reject_callback(int result, const char *what, kt_error *made, kt_error *error) {
    if (made->code == KT_OK)
        (void)kt_error_set(made, KT_ERROR_CALLBACK, NULL, "the caller's %s returned %d", what, result);
    if (error != NULL)
        *error = *made;
    return result > 0 ? KT_ERROR_CONSTRAINT : KT_ERROR_CALLBACK;
}

/* Replaces the velocities and accelerations of the library, in `a`, by those of the caller's right-hand side. *rate
 * points to the velocities. */
static kt_status accelerate_by_caller(kt_simulation *simulation, const kt_dynamic_state *at, const double **rate,
                                      double *a, kt_error *error) {
    const kt_instant instant = evaluated_instant_of(simulation, at);
    kt_error made = {0};
    memcpy(simulation->rate, at->v, simulation->size.nv * sizeof(double));
    *rate = simulation->rate;
    const int result = simulation->options.acceleration(&instant, simulation->rate, a, &made, simulation->options.user);
    return result == 0 ? KT_OK : reject_callback(result, "right-hand side", &made, error);
}

/* ---- accelerations and powers between steps ---------------------------------------------------------------------- */

kt_status kt_simulation_accelerate(kt_simulation *simulation, double t, const double *y, const double *tau,
                                   const kt_wrench *external, double *a, kt_error *error) {
    assert(isfinite(t) && (simulation->size.nv == 0 || a != y));
    const kt_dynamic_state at = {t, y, y + simulation->size.nq, tau, external};
    const double *rate;
    simulation->cached = KT_CACHED_NOTHING;
    kt_simulation_use_states(simulation, y);
    return simulation->options.acceleration != NULL
               ? accelerate_by_caller(simulation, &at, &rate, a, error)
               : kt_acceleration_trusted(simulation->model, simulation->data, &at, a, error);
}

kt_status kt_simulation_power(kt_simulation *simulation, double t, const double *y, kt_power *power, kt_error *error) {
    const kt_dynamic_state at = {t, y, y + simulation->size.nq, simulation->tau, simulation->external};
    const double *rate;
    simulation->cached = KT_CACHED_NOTHING;
    kt_simulation_use_states(simulation, y);
    const kt_status status = kt_power_evaluate(simulation->model, simulation->data, t, at.q, at.v, at.tau, at.external,
                                               simulation->a, power, error);
    return status == KT_OK && simulation->options.acceleration != NULL
               ? accelerate_by_caller(simulation, &at, &rate, simulation->a, error)
               : status;
}

/* ---- callbacks of the integrator --------------------------------------------------------------------------------- */

/* Whether an evaluation is at the state between two steps. Such an evaluation is the first evaluation of a step, or the
 * last one if the method reuses its slope for the next step. */
KT_INLINE bool is_end_of_step(const kt_simulation *simulation, const double *y, const double *dydt) {
    const kt_integrator *it = simulation->integrator;
    return y == it->y || (it->gives_end_derivative && dydt == it->k[it->fresh]);
}

/* Balances the forces of the state y at the time `at`, for coordinates that move no mass. */
static kt_status balance_forces(kt_simulation *simulation, double at, const double *y, double *balanced,
                                kt_error *error) {
    const kt_simulation_sizes *size = &simulation->size;
    const kt_dynamic_state state = {at, y, y + size->nq, simulation->tau, simulation->external};
    const kt_status status = kt_massless_solve(simulation->model, simulation->data, &state, error);
    if (status == KT_OK) {
        memmove(balanced, y, size->n * sizeof *y);
        memcpy(balanced, simulation->data->balanced_q, size->nq * sizeof *y);
        memcpy(balanced + size->nq, simulation->data->balanced_v, size->nv * sizeof *y);
    }
    return status;
}

/* Puts the auxiliary states of y into force, and points `at` to the state with its forces balanced. */
static kt_status use_states(kt_simulation *simulation, const double *y, kt_dynamic_state *at) {
    kt_simulation_use_states(simulation, y);
    if (simulation->size.balanced > 0) {
        const kt_status status = balance_forces(simulation, at->t, y, simulation->balanced, &simulation->cause);
        if (status != KT_OK)
            return status;
        at->q = simulation->balanced;
        at->v = simulation->balanced + simulation->size.nq;
    }
    (void)at;
    return KT_OK;
}

/* Classifies an error at t for the integrator: a smaller step may avoid the error, unless it occurs at the present
 * state. */
static int fail_slope(kt_simulation *simulation, double t, kt_status status) {
    simulation->ahead = t != kt_integrator_time(simulation->integrator);
    return kt_simulation_is_recoverable(status) && simulation->ahead ? 1 : -1;
}

/* Computes the slope at (t, y). Near a breakpoint, forces and drives are evaluated at a time that differs from t by
 * rounding. */
static int evaluate_slope(double t, const double *y, double *dydt, void *user) {
    kt_simulation *simulation = user;
    const kt_simulation_sizes *size = &simulation->size;
    const kt_model *model = simulation->model;
    kt_data *data = simulation->data;
    const bool by_caller = simulation->options.acceleration != NULL, works = size->integrates_works;
    const bool at_end = simulation->works.watches && is_end_of_step(simulation, y, dydt);
    kt_dynamic_state at = {t, y, y + size->nq, simulation->tau, simulation->external};
    kt_power power = {0.0, 0.0};
    if (simulation->breakpoints.any)
        at.t = kt_simulation_time_inside(simulation, t);
    kt_status status = size->x + size->balanced > 0 ? use_states(simulation, y, &at) : KT_OK;
    if (status != KT_OK)
        return fail_slope(simulation, t, status);
    const double *rate = at.v;
    double *a = dydt + size->nq;
    if (works || at_end)
        status = kt_power_evaluate(model, data, at.t, at.q, at.v, at.tau, at.external, a, &power, &simulation->cause);
    else if (!by_caller)
        status = kt_acceleration_trusted(model, data, &at, a, &simulation->cause);
    if (status == KT_OK && by_caller)
        status = accelerate_by_caller(simulation, &at, &rate, a, &simulation->cause);
    if (!by_caller || works)
        simulation->memory.factorizations += (uint64_t)simulation->groups;
    /* Powers and the caller's right-hand side may leave anything in data. */
    const bool left = !works && !(at_end && (model->driven || simulation->external != NULL)) && !by_caller;
    simulation->cached = left ? KT_CACHED_EVALUATION : KT_CACHED_NOTHING;
    simulation->slope = dydt;
    if (status != KT_OK)
        return fail_slope(simulation, t, status);
    if (size->quaternion > 0)
        kt_position_rate(model, at.q, rate, dydt);
    else if (size->nq > 0)
        memcpy(dydt, rate, size->nq * sizeof *dydt);
    else
        dydt[0] = 0.0; /* the integrator's one number where nothing moves */
    if (at_end)
        kt_simulation_take_power(simulation, y, dydt, power);
    if (works) {
        dydt[size->work] = power.dissipated;
        dydt[size->work + 1] = power.supplied;
    }
    if (size->x > 0)
        status = kt_auxiliary_state_rates_trusted(model, data, at.t, at.q, at.v, a + size->nv, &simulation->cause);
    return status == KT_OK ? 0 : fail_slope(simulation, t, status);
}

/* Scaling brings |p|^2 no nearer to 1 than four roundings. */
static const double unit_defect = 4.0 * DBL_EPSILON;

static bool is_unit_quaternion(const double *p) {
    double defect = p[0] * p[0] + p[1] * p[1] + p[2] * p[2] + p[3] * p[3] - 1.0;
    return fabs(defect) <= unit_defect;
}

/* Projects y by the caller's projection instead of the library's. */
static kt_status project_by_caller(kt_simulation *simulation, double t, double *y, bool *changed, kt_error *error) {
    const kt_instant at =
        evaluated_instant_of(simulation, &(kt_dynamic_state){.t = t, .q = y, .v = y + simulation->size.nq});
    kt_error made = {0};
    const int result =
        simulation->options.projection(&at, y, y + simulation->size.nq, changed, &made, simulation->options.user);
    return result == 0 ? KT_OK : reject_callback(result, "projection", &made, error);
}

kt_status kt_simulation_project(kt_simulation *simulation, double t, double *y, bool *changed, kt_error *error) {
    assert(isfinite(t));
    const bool balances = simulation->size.balanced > 0;
    *changed = false;
    if (simulation->closes_loops)
        simulation->cached = KT_CACHED_NOTHING;
    if (simulation->options.projection != NULL && !simulation->options.unprojected) {
        const kt_status status = project_by_caller(simulation, t, y, changed, error);
        if (status != KT_OK)
            return status;
    } else if (simulation->groups > 0 && !simulation->options.unprojected) {
        simulation->memory.factorizations += (uint64_t)simulation->groups;
        const kt_status status = kt_state_project_trusted(simulation->model, simulation->data, t, y,
                                                          y + simulation->size.nq, changed, error);
        if (status != KT_OK || !balances)
            return status;
    }
    if (balances) {
        *changed = true;
        simulation->cached = KT_CACHED_NOTHING;
        kt_simulation_use_states(simulation, y);
        const kt_status status = balance_forces(simulation, t, y, y, error);
        if (status != KT_OK)
            return status;
    }
    for (size_t i = 0; i < simulation->size.quaternion && !*changed; i++)
        *changed = !is_unit_quaternion(y + simulation->quaternion[i]);
    if (!*changed || kt_position_normalize(simulation->model, y))
        return KT_OK;
    return kt_error_set(error, KT_ERROR_NOT_FINITE, NULL, "a quaternion has become zero");
}

/* A position or a velocity of a drive jumps between the times `before` and `after`. A step that ends there (`strikes`)
 * closes the loops before the jump, a step that begins there (`struck`) closes them after the jump. */
double kt_simulation_closing_time(const kt_simulation *simulation, double t) {
    const kt_breakpoints *c = &simulation->breakpoints;
    if (c->strikes && t > c->before && t <= c->end)
        return c->before;
    return c->struck && t >= c->begin && t < c->after ? c->after : t;
}

/* Projects the state after a step, and stores the correction. y is finite, since the integrator has checked it. A
 * motion ends at a dead point of its drives: smaller steps would only approach that point and finally leap over it. */
static int project_state(double t, double *y, bool *changed, void *user) {
    kt_simulation *simulation = user;
    const kt_data *data = simulation->data;
    const bool engine = simulation->options.projection == NULL;
    const double closing = simulation->breakpoints.any ? kt_simulation_closing_time(simulation, t) : t;
    const kt_status status = kt_simulation_project(simulation, closing, y, changed, &simulation->cause);
    simulation->ahead = true;
    if (status != KT_OK)
        return kt_simulation_is_recoverable(status) && !(engine && data->dead) ? 1 : -1;
    if (!simulation->closes_loops || !engine)
        return 0;
    simulation->cached = KT_CACHED_POSES;
    kt_corrections *corrections = &simulation->memory.corrections;
    corrections->fastest = fmax(corrections->fastest, data->fastest);
    if (data->correction > corrections->most) {
        corrections->most = data->correction;
        corrections->time = t;
        corrections->v = data->corrected_v;
    }
    return 0;
}

/* Errors of accelerations next to a singular position. These accelerations are uncertain by passage.acceleration. If
 * both ways of computation may be right, accelerations jump by passage.jump between the two. A step of a tenth of the
 * time to the position resolves the path. A method of fourth order resolves it to 1e-5 of the distance. Errors of the
 * stages have either sign and add up to some of these values.
 *
 * The limit of a tenth applies if rounding deviates by more than the tolerance, which is reported. Otherwise the limit
 * is a thousandth of that time, since the estimated error of shorter steps is rounding. */
static double acceleration_noise_within(double h, void *user) {
    const kt_simulation *simulation = user;
    const kt_passage *passage = &simulation->data->passage;
    const bool uncertain = passage->error > simulation->integrator->options.relative_tolerance;
    const double off = fmax(4.0 * passage->acceleration, passage->jump);
    return h <= (uncertain ? 0.1 : 1e-3) * passage->time ? off * h : 0.0;
}

/* Records and the work done need accelerations, too. These evaluations must not affect the acceptance of a step. */
static void begin_passage(void *user) {
    const kt_simulation *simulation = user;
    simulation->data->passage = (kt_passage){.time = 0.0};
}

/* Friction of hard contacts jumps where slip ends or turns. An event there is found up to an instant (event.c). */
static double instant_of_slip(double t, void *user) {
    const kt_simulation *simulation = user;
    return simulation->model->n.slip > 0 ? kt_time_step(t) : 0.0;
}

const struct kt_noise kt_simulation_noise = {begin_passage, acceleration_noise_within, instant_of_slip};

/* Time stepping takes no slopes: the integrator's own steps do (leap.c). */
static int write_no_slope(double t, const double *y, double *dydt, void *user) {
    const kt_simulation *simulation = user;
    (void)t, (void)y;
    memset(dydt, 0, simulation->size.n * sizeof *dydt);
    return 0;
}

kt_integrator_callbacks kt_simulation_callbacks(kt_simulation *simulation) {
    if (simulation->steps_over_contacts)
        return (kt_integrator_callbacks){.rhs = write_no_slope, .user = simulation};
    const bool projects = simulation->closes_loops || simulation->size.quaternion > 0 || simulation->size.balanced > 0;
    return (kt_integrator_callbacks){evaluate_slope, projects ? project_state : NULL, simulation};
}

/* Copies the state after a step to the array whose address does not change. */
static void finish_state(kt_simulation *simulation) {
    memcpy(simulation->state, simulation->integrator->y, simulation->size.state * sizeof(double));
}

const kt_part kt_state_part = {.finish = finish_state};

/* ---- the model --------------------------------------------------------------------------------------------------- */

void kt_simulation_follow_model(kt_simulation *simulation) {
    const bool adapts = !(simulation->step > 0.0), breakpoints = kt_simulation_has_breakpoints(simulation->model);
    simulation->groups = kt_loop_group_count(simulation->model);
    simulation->closes_loops =
        (simulation->groups > 0 || simulation->options.projection != NULL) && !simulation->options.unprojected;
    simulation->breakpoints.any =
        adapts ? simulation->options.breakpoint != NULL || breakpoints
               : !simulation->steps_over_contacts && kt_simulation_has_motion_breakpoints(simulation->model);
    simulation->breakpoints.fixed = !adapts && breakpoints;
    simulation->watches_ends = breakpoints && adapts && simulation->lacks_end_stage;
    simulation->near_singular = false;
    kt_simulation_renew_breakpoints(simulation);
    kt_parts_list(simulation);
    kt_phase_rebind(simulation);
}

void kt_simulation_renew_model(const kt_simulation *simulation) { kt_phase_renew(simulation); }
