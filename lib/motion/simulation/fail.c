/* Error messages of a step, or a record, that failed: the time, the cause and the remedy.
 *
 * If loops change with time, no position may close them after some time. Motions contradict each other, or
 * a length exceeds the length of the bars between its ends. The error of the step itself then reveals little: rates
 * that grow without bound, steps that shrink to nothing, a state far away. The loops are therefore closed once more at
 * a later time, starting from the last closed position. The delay is a fixed step, or the interval between records. If
 * the loops cannot be closed at this later time either, the message names them and their remaining gaps.
 *
 * Rates that drives and loops prescribe (a wheel that rolls) may end, although positions do not. Let s(t) be the size
 * of the smallest direction of the equations A v = b. Then s v stays as b requires, and s falls by v, so that
 *
 *     v ~ (t* - t)^(-1/2),    t* - t = |v|^2 / (2 v . v')
 *
 * and steps shrink with the remaining time. The message names t*.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/dead_point.h"
#include "assembly/open_loops.h"
#include "base/where.h"
#include "dynamics/aba_inverse.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "loop/loop.h"
#include "model/switching.h"
#include "simulation/simulation.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

/* Returns KT_OK if the loops can be closed after the fraction `part` of that delay. */
static kt_status close_later(const kt_simulation *simulation, double part, kt_error *found) {
    const double t = kt_integrator_time(simulation->integrator);
    const double later = t + part * (simulation->step > 0.0 ? simulation->step : simulation->records.interval);
    char what[96];
    (void)snprintf(what, sizeof what, "from here on the loops cannot be closed; at t = %.9g s these stay open", later);
    return kt_loops_reach(simulation->model, simulation->data, later, simulation->state, KT_CLOSED_ASSEMBLED, what,
                          found);
}

/* Whether a step fails because loops can be closed now but not later. Then *found has the message. A search that starts
 * too far away may miss the closed position, so the loops must fail to close twice. */
static bool is_end_of_loops(kt_simulation *simulation, kt_status from, kt_error *found) {
    const kt_status cause = simulation->cause.code;
    if (!simulation->model->driven || simulation->options.unprojected || simulation->options.projection != NULL)
        return false;
    if (from != KT_ERROR_STEP && cause != KT_ERROR_CONSTRAINT && cause != KT_ERROR_SINGULAR)
        return false;
    simulation->cached = KT_CACHED_NOTHING;
    return (cause == KT_ERROR_CONSTRAINT || close_later(simulation, 0.1, found) != KT_OK) &&
           close_later(simulation, 1.0, found) != KT_OK;
}

int kt_simulation_body_of(const kt_simulation *simulation, size_t at) {
    const int i = (int)at, nq = (int)simulation->size.nq;
    for (int body = 1; body < kt_model_body_count(simulation->model); body++) {
        const kt_coordinates c = kt_body_coordinates(simulation->model, body);
        if ((i >= c.q && i < c.q + c.nq) || (i >= nq + c.v && i < nq + c.v + c.nv))
            return body;
    }
    return 0;
}

/* Far from a dead point, velocities need at least this share of the time since the start to double. */
static const double doubling = 1e-4;

/* Whether a step has become too small since a dead point of the drives is near. *left: the remaining time, s. Towards a
 * dead point at t*, v'v grows like 1 / (t* - t), so that t* - t = v'v / (2 v'a). Far from a dead point, this formula
 * gives the time in which velocities double. */
static bool is_next_to_dead_point(const kt_simulation *simulation, double *left) {
    const kt_integrator *integrator = simulation->integrator;
    const double *v = kt_integrator_state(integrator) + simulation->size.nq;
    const double *slope = kt_integrator_known_derivative(integrator);
    const double smallest = simulation->memory.crossings.smallest;
    if (!simulation->model->driven || !slope || simulation->memory.crossings.near == 0 || smallest > KT_DEAD)
        return false;
    double square = 0.0, growth = 0.0;
    for (size_t i = 0; i < simulation->size.nv; i++) {
        square += v[i] * v[i];
        growth += 2.0 * v[i] * slope[simulation->size.nq + i];
    }
    *left = square / growth;
    return growth > 0.0 && *left < doubling * (kt_integrator_time(integrator) - integrator->memory.origin);
}

static kt_status reject_dead_point(const kt_simulation *simulation, double left, kt_error *error) {
    const size_t nq = simulation->size.nq;
    const double *v = kt_integrator_state(simulation->integrator) + nq, t = kt_integrator_time(simulation->integrator);
    size_t fastest = 0;
    for (size_t i = 0; i < simulation->size.nv; i++)
        if (fabs(v[i]) > fabs(v[fastest]))
            fastest = i;
    const char *joint = kt_joint_name(simulation->model, kt_simulation_body_of(simulation, nq + fastest));
    return kt_error_set(error, KT_ERROR_STEP, kt_where_format("t = %.9g s, joint '%.60s'", t, joint).text,
                        "a dead point of the driven loops is at t = %.9g s, %.2g s ahead. Velocities grow without "
                        "bound towards it: a direction of the loops' equations vanishes there, and has %.2g of its "
                        "usual size already. Let the drives stop, or turn back, before",
                        t + left, left, simulation->memory.crossings.smallest);
}

/* Whether `where` contains a time. The function needs no strstr, since newlib's strstr takes 1.4 kB of a
 * microcontroller's memory. */
static bool contains_time(const char *where) {
    const char *at = strchr(where, 't');
    while (at != NULL && strncmp(at, "t = ", 4) != 0)
        at = strchr(at + 1, 't');
    return at != NULL;
}

/* The place of the cause, with a time. */
static kt_where_text cause_with_time(const kt_simulation *simulation) {
    const kt_error *cause = &simulation->cause;
    const bool known = cause->code != KT_OK;
    if (known && contains_time(cause->where)) /* contains the time of a stage */
        return kt_where_format("%s", cause->where);
    return kt_where_format("t = %.9g s%s%s", kt_integrator_time(simulation->integrator),
                           known && cause->where[0] != '\0' ? ", " : "", known ? cause->where : "");
}

/* The place of a failure: of its cause if there is one, otherwise of the error, as of an event with its name. */
static kt_where_text place_of_failure(const kt_simulation *simulation, const kt_error *from) {
    return simulation->cause.code == KT_OK && contains_time(from->where) ? kt_where_format("%s", from->where)
                                                                         : cause_with_time(simulation);
}

/* Whether a fixed step may have leapt over a bend of the path next to a singular position. */
static bool may_have_leapt(const kt_simulation *simulation) {
    return simulation->step > 0.0 && simulation->memory.crossings.near > 0;
}

/* Advice for a fixed step. If a step leaps over a bend, velocities grow until they overflow, much later and far from
 * the bend. Therefore the advice mentions every bend. advice: room for ADVICE. */
enum { ADVICE = 240 };
/* The advice for a failed fixed step: where paths bend, a step may have leapt from one path to another. */
static const char *advise_fixed(const kt_simulation *simulation, char *advice) {
    const kt_crossings *seen = &simulation->memory.crossings;
    char bend[96] = ", where paths bend: a smaller one";
    if (!may_have_leapt(simulation))
        return "a smaller one may help, or an adaptive method";
    if (seen->bend > 0.0)
        (void)snprintf(bend, sizeof bend, ", where its path bends within %.2g s: one below a tenth of that",
                       seen->bend);
    (void)snprintf(advice, ADVICE,
                   "since t = %.9g s the motion has come next to singular positions of the loops%s may help, or an "
                   "adaptive method",
                   seen->since, bend);
    return advice;
}

kt_status kt_simulation_fail(const kt_simulation *simulation, const kt_error *from, kt_error *error) {
    const kt_error *what = simulation->cause.code != KT_OK ? &simulation->cause : from;
    char advice[ADVICE];
    const kt_where_text where = place_of_failure(simulation, from);
    if (may_have_leapt(simulation) && kt_simulation_is_recoverable(what->code))
        return kt_error_set(error, what->code, where.text, "%s (the step is fixed at %g s: %s)", what->message,
                            simulation->step, advise_fixed(simulation, advice));
    return kt_error_set(error, what->code, where.text, "%s", what->message);
}

/* The error of an adaptive step that has become too small, with accelerations next to a singular position. */
static kt_status reject_bend(const kt_simulation *simulation, const kt_error *from, const char *where,
                             kt_error *error) {
    const kt_crossings *seen = &simulation->memory.crossings;
    const kt_method *method = kt_integrator_method(simulation->integrator);
    const bool is_other = method != kt_method_find("dopri5") && method != kt_method_find("radau5");
    char bend[64] = "";
    if (seen->bend > 0.0)
        (void)snprintf(bend, sizeof bend, "; the path bends within %.2g s", seen->bend);
    return kt_error_set(error, from->code, where,
                        "next to a singular position of the loops (a direction has %.2g of its usual size%s)%s: %s",
                        seen->smallest, bend, is_other ? ", which dopri5 or radau5 may pass" : "", from->message);
}

/* A disc that lies flat on its plane touches everywhere, and its rim has no lowest point. Below this inclination in
 * rad, a disc is flat up to rounding. The turning motion of such a disc then has an inertia of m r^2 times the square
 * of the inclination. Impacts run around the rim in less and less time. */
static const double flat = 1e-3;

/* The inclination of a disc against the plane that its rim touches. HUGE_VAL for a disc that does not touch, and for
 * other loops. */
static double inclination_of(const kt_loop_record *loop, const kt_link_kinematics *links) {
    kt_mat3 axes[2];
    kt_vec3 point[2];
    if (loop->type != KT_LOOP_ROLLING || kt_loop_is_off(loop) || loop->form == KT_ROLLING_BALL ||
        loop->form == KT_ROLLING_BALLS)
        return HUGE_VAL;
    for (int end = 0; end < 2; end++) {
        const kt_link_kinematics *link = &links[loop->link[end]];
        axes[end] = kt_mat3_multiply(link->axes, loop->frame[end].rotation);
        point[end] = kt_vec3_add(link->position, kt_mat3_apply(link->axes, loop->frame[end].position));
    }
    const double s = kt_vec3_norm(kt_vec3_cross(axes[1].z, axes[0].z));
    const double gap = kt_vec3_dot(axes[1].z, kt_vec3_sub(point[0], point[1])) - loop->radius * s;
    return fabs(gap) < flat * loop->radius ? s : HUGE_VAL;
}

kt_status kt_simulation_explain_disc(kt_simulation *simulation, kt_status status, kt_error *error) {
    if (error == NULL) /* no message is needed */
        return status;
    const kt_model *model = simulation->model, *closed = kt_variants_closed(model);
    const kt_model *all = closed != NULL ? closed : model;
    const double *y = kt_integrator_state(simulation->integrator);
    const kt_error from = *error;
    double least = flat;
    int disc = -1;
    for (size_t i = 0; i < all->n.loop; i++) {
        kt_link_kinematics *links = kt_links_scratch(simulation->data);
        if (all->loop[i].type != KT_LOOP_ROLLING)
            continue;
        simulation->cached = KT_CACHED_NOTHING;
        kt_links_sweep(model, simulation->data, y, y + simulation->size.nq, links);
        const double inclination = inclination_of(&all->loop[i], links);
        disc = inclination < least ? (int)i : disc;
        least = fmin(inclination, least);
    }
    if (disc < 0)
        return status;
    return kt_error_set(
        error, from.code, from.where,
        "the disc '%.60s' lies flat but for %.2g rad, where its rim ('%.60s') has no lowest point: end the run "
        "before, where it is inclined by 1e-3 rad (until), give it three spheres on its rim, or an elastic contact "
        "(stiffness): %s",
        kt_body_name(model, all->loop[disc].body[0]), least, kt_loop_name(all, disc), from.message);
}

/* Below this volume of the unit vectors along three hinges, the hinges are next to gimbal lock. */
static const double locked = 0.1;

/* Names the remedy if a step fails next to gimbal lock of three hinges. */
static kt_status explain_gimbal(kt_simulation *simulation, kt_status status, kt_error *error) {
    const kt_model *model = simulation->model;
    const double *y = kt_integrator_state(simulation->integrator);
    const kt_error from = *error;
    kt_link_kinematics *links = kt_links_scratch(simulation->data);
    if (from.code != KT_ERROR_STEP)
        return status;
    simulation->cached = KT_CACHED_NOTHING;
    kt_links_sweep(model, simulation->data, y, y + simulation->size.nq, links);
    for (size_t i = 1; i < model->n.spatial; i++) {
        kt_vec3 axis[3];
        if (kt_link_first_of_hinges(model, i) != i)
            continue;
        for (size_t k = 0; k < 3; k++) {
            const kt_mat3 axes = links[i + k].axes;
            axis[k] = model->link[i + k].axis == 0 ? axes.x : model->link[i + k].axis == 1 ? axes.y : axes.z;
        }
        if (fabs(kt_vec3_dot(axis[0], kt_vec3_cross(axis[1], axis[2]))) < locked)
            return kt_error_set(error, from.code, from.where, "%s; %s", kt_link_gimbal_advice(model, i).text,
                                from.message); /* the remedy first, since a message has an end */
    }
    return status;
}

/* A call that has taken all of its steps (kt_simulation_options.steps_per_call). */
static kt_status report_call_used_up(const kt_simulation *simulation, kt_error *error) {
    const size_t k = simulation->events.latest;
    const bool contact = k < kt_simulation_contact_events(simulation);
    char last[160] = "";
    if (k < simulation->events.count)
        (void)snprintf(last, sizeof last, ", the last one at the %s '%.60s'", contact ? "contact" : "event",
                       simulation->events.list[k].name);
    return kt_error_set(error, KT_ERROR_STEP,
                        kt_where_format("t = %.9g s", kt_integrator_time(simulation->integrator)).text,
                        "the %.0f steps that a call may take (steps_per_call) are used up%s; %sallow more steps, or "
                        "shorter calls. The next call goes on from here",
                        (double)simulation->options.steps_per_call, last,
                        contact ? "give the contact a larger rest_velocity or a smaller restitution, " : "");
}

/* Reports why a step failed: the end of the loops' motion, a dead point, the cause within an evaluation, or the
 * error estimate, each with its remedy. */
static kt_status fail_step(kt_simulation *simulation, const kt_error *from, kt_error *error) {
    const kt_error *cause = &simulation->cause;
    const double t = kt_integrator_time(simulation->integrator);
    char advice[ADVICE];
    kt_error end;
    if (simulation->integrator->used_up)
        return report_call_used_up(simulation, error);
    if (is_end_of_loops(simulation, from->code, &end))
        return kt_error_set(
            error, end.code, kt_where_format("t = %.9g s", t).text,
            "%s. Change the driving functions so that the loops can be closed, or end the run before this time",
            end.message);
    double left;
    if (cause->code == KT_OK && from->code == KT_ERROR_STEP && is_next_to_dead_point(simulation, &left))
        return reject_dead_point(simulation, left, error);
    kt_where_text where = place_of_failure(simulation, from);
    if (cause->code != KT_OK && from->code == KT_ERROR_STEP) {
        const kt_integrator *integrator = simulation->integrator;
        const bool same = kt_integrator_blamed(integrator) >= integrator->sizes.n; /* no estimate of errors failed */
        return same ? kt_error_set(error, cause->code, where.text, "%s (smaller steps did not help)", cause->message)
                    : kt_error_set(error, cause->code, where.text, "%s; smaller steps did not help: %s", cause->message,
                                   from->message);
    }
    if (simulation->step > 0.0 && simulation->ahead && kt_simulation_is_recoverable(cause->code))
        return kt_error_set(error, cause->code, where.text, "%s (the step is fixed at %g s: %s)", cause->message,
                            simulation->step, advise_fixed(simulation, advice));
    if (cause->code == KT_OK && from->code == KT_ERROR_STEP && simulation->options.unprojected &&
        simulation->groups > 0)
        return kt_error_set(error, from->code, where.text,
                            "%s. Loops are left to drift open (unprojected), which makes accelerations uncertain near "
                            "singular positions: let them be closed after each step",
                            from->message);
    const int blamed = kt_simulation_body_of(simulation, kt_integrator_blamed(simulation->integrator));
    if (cause->code == KT_OK && from->code == KT_ERROR_STEP && blamed > 0)
        where = kt_where_format("t = %.9g s, joint '%.80s'", t, kt_joint_name(simulation->model, blamed));
    if (simulation->near_singular && cause->code == KT_OK && from->code == KT_ERROR_STEP && !(simulation->step > 0.0))
        return reject_bend(simulation, from, where.text, error);
    return cause->code == KT_OK && from->code == KT_ERROR_STEP && blamed > 0
               ? kt_error_set(error, from->code, where.text, "%s", from->message)
               : kt_simulation_fail(simulation, from, error);
}

/* Reports the cause of a step that failed, with a remedy. */
static kt_status explain_step(kt_simulation *simulation, const kt_error *from, kt_error *error) {
    kt_status status = fail_step(simulation, from, error);
    status = kt_simulation_explain_disc(simulation, status, error);
    return error != NULL ? explain_gimbal(simulation, status, error) : status;
}

const kt_part kt_failure_part = {.explain = explain_step};
