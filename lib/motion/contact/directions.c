/* Directions of slip of hard contacts, from step to step (evaluate/slip.c).
 *
 * A direction d is fixed along a step, and slip against d ends the step. If slip has turned from d when a step begins,
 * d becomes its direction. If friction has little reserve to stop a slip, the slip turns at a rate of mu N / (m |s|)
 * next to rest, which has no bound. The error of a step is then below the tolerances however slip turns within it. Slip
 * goes round its rest without ever reversing along d, in steps of about |s| m / (mu N).
 *
 * So slip counts its turns while it is slower than the rest velocity of its contact. It also counts steps along which
 * such slip grows by less than an eighth: because rounding may hide turns, one foot may slip while it holds another
 * foot, and steps that friction keeps short need thousands for slip that grows slowly. Tries of a fixed step that find
 * no solution, or gain energy, count, too (contact/retry.c). After TURNS such events, contacts that slip below their
 * rest velocity come to rest at the beginning of a step, like slip that comes to rest in ever shorter parts
 * (contact/contact_part.c). If friction can hold only some contacts, the others begin to slip again. If friction can
 * hold none, all slip on as before.
 *
 * The errors of adaptive steps may be larger than the rest velocity. Slip then goes round its rest at the speed of
 * these errors, or stays at one speed: the stages of heun may lie on both sides of rest, and their forces cancel. Slip
 * that is slower than ten times the tolerances of the velocities therefore counts as slow, too.
 *
 * With fixed steps, slip may turn around the state of rest at any speed: a foot of little mass stops within a small
 * part of a step, and the errors of stages are of the size of its slip. Slip that reverses TURNS times within the
 * length of a step comes to rest at whatever speed, since the step does not resolve it. Steps predict slip with other
 * forces than decisions do (evaluate/slip_prediction.c), so next to the limit of rest these may contradict each other.
 * Therefore friction holds slip that came to rest by turns, for `hold` and for the length of a step.
 *
 * Stages behind a reversal have the opposite friction. Then the search may find the reversal at another time in each
 * repetition of the step, before or after its end. At the third repetition, slip that is due to reverse at the end of a
 * step, and is not faster than its rest velocity, ends. All slip that reverses below this speed comes to rest if
 * friction can hold it.
 *
 * A held contact stays at rest while other contacts change. Otherwise the turns of another foot would end its rest.
 *
 * Reactions of the corners of a foot are not unique. Several corners may be at their limits. If one of these corners
 * slips, the next evaluated reactions may exceed the limit of another corner, which then slips in place of the first
 * corner. The two would take turns without end. Friction that has reached its limit twice slips for the rest of the
 * instant.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"
#include "evaluate/slip.h"
#include "integrator/integrator.h"
#include "kinetree/algebra.h"

#include <float.h>
#include <math.h>

enum { TURNS = 8 };

/* A part of the time in which the mechanism moves by its own size (own_time.c), and growth in a step that counts. */
static const double hold = 3e-4, grown = 1.125;

/* The index of a contact's slip among all contacts that slip. */
static size_t index_of_slip(const kt_model *model, const kt_contact *contact) {
    size_t slips = 0;
    for (int i = 0; i < contact->loop; i++)
        slips += model->loop[i].slips > 0;
    return slips;
}

double kt_contact_slip_along(const kt_model *model, const kt_data *data, const kt_contact *contact) {
    const size_t slips = index_of_slip(model, contact);
    const double *s = data->slip_velocity + 2 * slips, *d = data->slip + 2 * slips;
    return s[0] * d[0] + s[1] * d[1];
}

int kt_contacts_find_wedged(const kt_simulation *simulation) {
    const kt_model *model = simulation->model;
    const struct kt_contacts *c = simulation->contacts;
    const size_t wedged = model->n.slip > 0 ? kt_slip_problem_of(simulation->data)->wedged : 0;
    int contact = 0;
    if (wedged >= model->n.slip)
        return -1;
    const kt_loop_record *loop = kt_slip_loop(model, wedged);
    while (&model->loop[c->item[contact].loop] != loop)
        contact++;
    return contact;
}

bool kt_contact_is_slipping(const kt_simulation *simulation, int k) {
    return simulation->model->loop[simulation->contacts->item[k].loop].slips > 0;
}

/* Whether steps may be too long for the rate at which friction turns slip: fixed steps of explicit methods. This does
 * not depend on the present slip: decisions at the start, at which nothing slips yet, predict as the steps behind. */
static bool predicts_wide(const kt_simulation *simulation) {
    return simulation->step > 0.0 && simulation->integrator->options.newton == NULL && simulation->contacts->rubs;
}

/* Whether two contacts slip, and act on each other. */
static bool slip_together(const kt_simulation *simulation, int i, int k) {
    return kt_contact_is_slipping(simulation, i) && kt_contact_is_slipping(simulation, k) &&
           simulation->contact_state[i].block == simulation->contact_state[k].block;
}

/* The rate at which friction changes slip in the block of contact k, m/s^2. */
static double rate_of_friction(const kt_simulation *simulation, int k) {
    const struct kt_contacts *c = simulation->contacts;
    double rate = 0.0;
    for (int i = 0; i < c->sides; i++)
        if (slip_together(simulation, i, k))
            rate += simulation->contact_state[i].load * simulation->contact_state[i].response;
    return rate;
}

/* Finds the least and the largest tolerance of the velocities in the state y, m/s; NULL: their absolute tolerances. An
 * angular velocity moves a point at the mechanism's length from the axis. */
static void find_tolerated_speeds(const kt_simulation *simulation, const double *y, double *least, double *most) {
    const kt_model *all = simulation->contacts->all;
    *least = HUGE_VAL;
    *most = 0.0;
    for (size_t l = 0; l < all->n.link; l++) {
        const kt_link *link = &all->link[l];
        for (int j = 0; j < kt_link_dofs(link); j++) {
            const size_t i = simulation->size.nq + (size_t)(link->v + j);
            const double v = y != NULL ? y[i] : 0.0;
            const double speed =
                kt_error_scale(simulation->integrator, i, v, v) * (j < kt_link_lengths(link) ? 1.0 : all->length);
            *least = fmin(*least, speed);
            *most = fmax(*most, speed);
        }
    }
}

/* The speed at which the mechanism moves by its own size, m/s. */
static double own_speed_of(const kt_simulation *simulation) {
    const double time = simulation->memory.own_time;
    return time > 0.0 ? simulation->contacts->all->length / time : 0.0;
}

/* tau0 and s0 of predictions with adaptive steps, as parts of the own time and of the own speed. The factor r is 1 for
 * fixed steps (evaluate/slip_prediction.c). */
static double part_of_predictions(const kt_simulation *simulation) {
    const double own = own_speed_of(simulation);
    double least, most;
    if (simulation->step > 0.0 || !(own > 0.0))
        return kt_slip_slow;
    find_tolerated_speeds(simulation, NULL, &least, &most);
    return kt_slip_slow * fmax(1.0, fmin(300.0, sqrt(least / (kt_slip_rest * own))));
}

double kt_contacts_adaptive_time(const kt_simulation *simulation, double speed) {
    const double part = part_of_predictions(simulation);
    return kt_slip_time_at_speed(speed, part * simulation->memory.own_time, part * own_speed_of(simulation));
}

bool kt_contacts_is_unresolved(const kt_simulation *simulation, double most) {
    return predicts_wide(simulation) &&
           simulation->step * most > part_of_predictions(simulation) * own_speed_of(simulation);
}

double kt_contacts_prediction_time(const kt_simulation *simulation, double speed, double most) {
    const double h = simulation->step;
    if (!kt_contacts_is_unresolved(simulation, most))
        return kt_contacts_adaptive_time(simulation, speed);
    return kt_slip_time_at_speed(speed, fmax(h, kt_slip_slow * simulation->memory.own_time), h * most);
}

void kt_contacts_put_directions(kt_simulation *simulation) {
    const bool wide = predicts_wide(simulation);
    const double part = part_of_predictions(simulation);
    simulation->slow_slip = simulation->data->slow_slip = part * own_speed_of(simulation);
    simulation->data->still_slip = fmax(kt_slip_still * simulation->slow_slip, simulation->memory.slip_noise);
    if (simulation->model->n.slip > 0)
        kt_slip_problem_of(simulation->data)->slow_time = part * simulation->memory.own_time;
    for (int k = 0; simulation->model->n.slip > 0 && k < simulation->contacts->sides; k++) {
        const kt_contact_memory *memory = &simulation->contact_state[k];
        if (!kt_contact_is_slipping(simulation, k))
            continue;
        const size_t at = 2 * index_of_slip(simulation->model, &simulation->contacts->item[k]);
        memcpy(simulation->data->slip + at, memory->slip, sizeof memory->slip);
        simulation->data->slip_slow[at] = wide ? simulation->step : 0.0;
        simulation->data->slip_slow[at + 1] = wide ? simulation->step * rate_of_friction(simulation, k) : 0.0;
    }
}

/* Takes the normal forces of slip from the values of events at the beginning of a step. Returns whether predictions
 * change, and so the slope at the beginning. */
static bool take_loads(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    const double t = kt_integrator_time(simulation->integrator);
    bool changes = false;
    for (int k = 0; k < c->sides; k++)
        if (kt_contact_is_slipping(simulation, k) && !(t < simulation->contact_state[k].held))
            simulation->contact_state[k].load = fmax(simulation->events.value[k], 0.0);
    for (int k = 0; k < c->sides; k++)
        if (kt_contact_is_slipping(simulation, k)) {
            const double before = simulation->data->slip_slow[2 * index_of_slip(simulation->model, &c->item[k]) + 1];
            const double after = simulation->step * rate_of_friction(simulation, k);
            changes = changes || (before != after && simulation->contact_state[k].speed < fmax(before, after));
        }
    kt_contacts_put_directions(simulation);
    return changes;
}

/* The speed below which adaptive steps do not resolve slip, m/s: ten times the largest tolerance of a velocity. */
static double unresolved_speed(const kt_simulation *simulation) {
    double least, most = 0.0;
    if (simulation->step == 0.0)
        find_tolerated_speeds(simulation, kt_integrator_state(simulation->integrator), &least, &most);
    return 10.0 * most;
}

/* The speed up to which the slip of contact k is slow, m/s. 0: the contact has no rest velocity. */
static double slow_speed_of(const kt_simulation *simulation, int k, double unresolved) {
    const double rest = simulation->model->loop[simulation->contacts->item[k].loop].rest_velocity;
    return rest > 0.0 ? fmax(rest, unresolved) : 0.0;
}

double kt_contact_stopping_speed(const kt_simulation *simulation, int k) {
    return fmax(slow_speed_of(simulation, k, unresolved_speed(simulation)), simulation->contact_state[k].stops_below);
}

/* Takes the directions from the data, and counts the turns of slow slip. */
static void take_directions(kt_simulation *simulation) {
    const double unresolved = unresolved_speed(simulation);
    for (int k = 0; k < simulation->contacts->sides; k++) {
        kt_contact_memory *memory = &simulation->contact_state[k];
        if (!kt_contact_is_slipping(simulation, k)) {
            memory->turns = 0;
            continue;
        }
        const kt_contact *contact = &simulation->contacts->item[k];
        const size_t at = 2 * index_of_slip(simulation->model, contact);
        const double *d = simulation->data->slip + at, *s = simulation->data->slip_velocity + at;
        const double speed = kt_hypot(s[0], s[1]);
        const bool is_slow = speed <= slow_speed_of(simulation, k, unresolved);
        const bool turns = d[0] != memory->slip[0] || d[1] != memory->slip[1];
        memory->turns = is_slow ? memory->turns + (turns || speed <= grown * memory->speed) : 0;
        memory->speed = speed;
        memcpy(memory->slip, d, sizeof memory->slip);
    }
}

/* The least slip that has a direction, m/s. Slower slip is rounding of velocities, or of the time of an event at which
 * slip reverses. */
static double least_directed_slip(const kt_simulation *simulation) {
    static const double directed = 5e-12;
    return fmax(directed * own_speed_of(simulation), simulation->memory.slip_noise);
}

bool kt_contacts_follow_slip(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_model *model = simulation->model;
    const double *y = kt_integrator_state(simulation->integrator);
    if (model->n.slip == 0)
        return false;
    simulation->cached = KT_CACHED_NOTHING;
    bool changes = kt_slip_follow(model, simulation->data, y, y + simulation->size.nq, least_directed_slip(simulation));
    take_directions(simulation);
    for (int k = c->sides; k < c->n; k++) {
        if (!kt_contact_rubs(c, k) || kt_contact_is_closed(model, &c->item[k]) ||
            !kt_contact_is_closed(model, &c->item[c->item[k].of]))
            continue;
        const double along = kt_contact_slip_along(model, simulation->data, &c->item[c->item[k].of]);
        double *rest = &simulation->contact_state[k].closes_at;
        changes = changes || (*rest < 0.0 && along > *rest);
        *rest = fmin(fmax(*rest, along), 0.0);
    }
    return changes;
}

/* Whether a contact, or friction, has left at the time t. */
static bool has_left_at(const kt_contact_memory *memory, double t) {
    return fabs(t - memory->left_at) <= kt_time_step(t);
}

bool kt_contact_leaves(kt_simulation *simulation, int k, bool due) {
    const double t = kt_integrator_time(simulation->integrator);
    kt_contact_memory *memory = &simulation->contact_state[k];
    const bool same = has_left_at(memory, t);
    memory->left = same ? memory->left + due : (uint64_t)due;
    memory->left_at = due ? t : memory->left_at;
    if (k < simulation->contacts->sides)
        return due;
    return due || memory->left > 1;
}

void kt_contacts_slip_together(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    const double t = kt_integrator_time(simulation->integrator);
    for (int k = c->sides; k < c->n; k++)
        for (int i = c->sides; !kt_contact_rubs(c, k) && has_left_at(&simulation->contact_state[k], t) && i < c->n; i++)
            if (i != k && kt_contacts_share_rate(c, i, k))
                c->item[i].leaves = c->item[k].leaves = true;
}

bool kt_contact_slip_ends(const kt_simulation *simulation, size_t k, double slip) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_contact *friction = &c->item[k];
    return kt_contact_rubs(c, (int)k) && !kt_contact_is_closed(simulation->model, friction) &&
           fabs(slip) <= simulation->model->loop[c->item[friction->of].loop].rest_velocity;
}

int kt_contacts_find_slow(const kt_simulation *simulation) {
    const double unresolved = unresolved_speed(simulation);
    int slowest = -1;
    for (int k = 0; k < simulation->contacts->sides; k++) {
        const double speed = simulation->contact_state[k].speed;
        if (kt_contact_is_slipping(simulation, k) && speed <= slow_speed_of(simulation, k, unresolved) &&
            (slowest < 0 || speed < simulation->contact_state[slowest].speed))
            slowest = k;
    }
    return slowest;
}

void kt_contact_hold(kt_simulation *simulation, int k) {
    simulation->contact_state[k].held = kt_integrator_time(simulation->integrator) + hold * simulation->memory.own_time;
}

/* Holds friction k, or with fixed steps for one step at least, and counts this. */
static void hold_friction(kt_simulation *simulation, int k) {
    simulation->contact_state[k].held =
        kt_integrator_time(simulation->integrator) + fmax(hold * simulation->memory.own_time, simulation->step);
    simulation->memory.contacts.rested++;
}

bool kt_contact_is_held(const kt_simulation *simulation, int k) {
    return kt_integrator_time(simulation->integrator) < simulation->contact_state[k].held;
}

static bool any_is_held(const kt_simulation *simulation) {
    bool any = false;
    for (int k = 0; k < simulation->contacts->n; k++)
        any = any || kt_contact_is_held(simulation, k);
    return any;
}

void kt_contact_hold_turning(kt_simulation *simulation, int k) {
    if (!has_left_at(&simulation->contact_state[k], kt_integrator_time(simulation->integrator)))
        return;
    kt_contact_hold(simulation, k);
    simulation->memory.contacts.rested++;
}

void kt_contact_count_reversal(kt_simulation *simulation, int k) {
    const double t = kt_integrator_time(simulation->integrator);
    const int contact = simulation->contacts->item[k].of;
    kt_contact_memory *memory = &simulation->contact_state[contact];
    const bool may_rest = simulation->model->loop[simulation->contacts->item[contact].loop].rest_velocity > 0.0;
    if (!(simulation->step > 0.0) || !may_rest)
        return;
    const bool is_within = memory->reversals > 0 && fabs(t - memory->since) <= simulation->step;
    memory->fastest = is_within ? fmax(memory->fastest, memory->speed) : memory->speed;
    memory->since = is_within ? memory->since : t;
    memory->reversals = is_within ? memory->reversals + 1 : 1;
}

/* Friction that does not stick any more is not held, either. */
static void forget_ended_holds(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    for (int k = c->sides; k < c->n; k++)
        if (!kt_contact_is_closed(simulation->model, &c->item[k]))
            simulation->contact_state[k].held = -HUGE_VAL;
}

/* Lets slow slip that turns round its rest come to rest. An event would also decide anew about contacts that friction
 * holds. Two contacts could then end each other's hold without end, at one instant. Therefore held contacts stay at
 * rest here. If an event has ended a hold, so that the friction slips, it is not held again. */
static kt_status end_turns(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    bool turns = false;
    for (int k = 0; k < c->sides; k++) {
        kt_contact_memory *memory = &simulation->contact_state[k];
        const bool reverses = memory->reversals >= TURNS, many = memory->turns >= TURNS || reverses;
        turns = turns || many;
        memory->turns = many ? 0 : memory->turns;
        memory->reversals = many ? 0 : memory->reversals;
        memory->stops_below = reverses ? memory->fastest : many ? DBL_MIN : 0.0;
    }
    if (!turns)
        return KT_OK;
    forget_ended_holds(simulation);
    c->holds = c->stops = true;
    const kt_status status = kt_phase_settle(simulation, error);
    c->holds = c->stops = false;
    for (int k = 0; k < c->sides; k++) {
        double *stops_below = &simulation->contact_state[k].stops_below;
        if (*stops_below > 0.0 && kt_contact_is_closed(simulation->model, &c->item[c->item[k].of]))
            hold_friction(simulation, c->item[k].of);
        *stops_below = 0.0;
    }
    simulation->memory.contacts.rested++;
    return status;
}

/* A hold that ends between two steps uncovers reactions that the step before did not show to events. */
static void end_holds(kt_simulation *simulation) {
    const double t = kt_integrator_time(simulation->integrator);
    for (int k = 0; k < simulation->contacts->n; k++) {
        double *held = &simulation->contact_state[k].held;
        if (!(*held > -HUGE_VAL) || t < *held)
            continue;
        *held = -HUGE_VAL;
        kt_simulation_mark_jump(simulation);
    }
}

/* If directions change, forces in the present state equal the previous forces except for rounding. A simulation that is
 * restored at this point has the same directions. While a contact is held, the values of events are computed again:
 * kt_contacts_find_excess needs their multipliers at the beginning of the step. */
kt_status kt_contacts_begin_slip(kt_simulation *simulation, kt_error *error) {
    if (simulation->model->n.slip > 0)
        kt_slip_problem_of(simulation->data)->wedged = simulation->model->n.slip;
    end_holds(simulation);
    if (kt_contacts_follow_slip(simulation)) {
        kt_integrator_change(simulation->integrator, true);
        simulation->contact_time = simulation->events.time = (double)NAN;
    }
    const kt_status status = end_turns(simulation, error);
    if (any_is_held(simulation))
        simulation->contact_time = simulation->events.time = (double)NAN;
    return status;
}

kt_status kt_contacts_begin_prediction(kt_simulation *simulation, kt_error *error) {
    (void)error;
    if (simulation->model->n.slip > 0 && predicts_wide(simulation) && take_loads(simulation))
        kt_integrator_change(simulation->integrator, true);
    return KT_OK;
}
