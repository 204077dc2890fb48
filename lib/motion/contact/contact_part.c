/* Hard contacts: loops that bound one side, g(q, t) >= 0 (stops, floors, slack ropes), along a motion.
 *
 * An open contact has its gap g > 0 watched. A closed contact is a constraint of the mechanism like any other: its loop
 * is switched on (model/switching.h). The reaction of a closed contact lambda > 0 is watched. Both are events
 * (event.c). For the contacts that touch at an event, let u = J v - b' be the rates of their gaps, and W = J M^-1 J'.
 * M^-1 belongs to the mechanism with its other loops (control/mass_inverse.c). At an event, two steps follow.
 *
 * 1. If some contacts close, u < 0, impulses p follow from Newton's rule or Poisson's (contact/impact.c).
 *
 * 2. Contacts with u+ = 0, or no faster than the rest velocity, are closed from now on if their reaction is
 *    compressive. (Two contacts that close in turn would otherwise go on for ever.) With the accelerations w of their
 *    gaps without reactions,
 *
 *       w+ = w + W lambda,   0 <= lambda  complementary to  w+ >= 0
 *
 * The speed of a drive may jump. Velocities first jump with all contacts open. The two steps follow, in which contacts
 * that were closed do not bounce (contact/impact.c).
 *
 * Friction of a joint that sticks (kt_effect.stick) is handled alike. While the joint slips, events watch its rate in
 * the direction of slip. While the joint sticks, friction is a constraint, and events watch the reserve S - abs(lambda)
 * to its limit S. Dry friction has no impulse. At rest
 *
 *       -S <= lambda <= S,   a = 0 within,   a >= 0 if lambda = -S,   a <= 0 if lambda = S
 *
 * One solver serves for both steps (cone/coulomb.h). If reactions without friction of contacts are not unique (four
 * legs of a table), the redundant contacts stay open.
 *
 * Sources: C. Glocker, Set-Valued Force Laws, 2001; F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral
 * Contacts, 1996.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"

#include "base/copy.h"
#include "base/require.h"
#include "contact/moreau.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "model/switching.h"

#include <math.h>

/* ---- events ------------------------------------------------------------------------------------------------------ */

/* Attempts to free a contact that friction wedges. */
enum { RELEASE, IMPULSES = 4, HOLD = RELEASE + 1 + IMPULSES };

/* The value of a contact as an event: its gap while it is open, its reserve while it is closed (values.c). */
static int watch_contact(const kt_instant *at, double *value, kt_error *error, void *user) {
    const kt_contact *contact = user;
    kt_simulation *simulation = contact->simulation;
    struct kt_contacts *c = simulation->contacts;
    const size_t nq = at->model->n.q, nv = at->model->n.v;
    /* The first contact is evaluated first at each instant; the others reuse its results. */
    const bool known = contact->index > 0 && simulation->contact_time == at->t && c->set == at->model->set &&
                       memcmp(c->at, at->q, nq * sizeof(double)) == 0 &&
                       memcmp(c->at + nq, at->v, nv * sizeof(double)) == 0;
    if (!known) {
        kt_instant inside = *at; /* where forces jump: the forces of the step that ends or begins here */
        inside.t = kt_simulation_time_inside(simulation, at->t);
        simulation->contact_time = (double)NAN;
        if (kt_contacts_find_values(c, &inside, error) != KT_OK)
            return 1;
        memcpy(c->at, at->q, nq * sizeof(double));
        memcpy(c->at + nq, at->v, nv * sizeof(double));
        simulation->contact_time = at->t;
        c->set = at->model->set;
    }
    *value = c->value[contact->index];
    return 0;
}

/* Evaluates the values of all contacts in the present state, as the next step will. Returns the error's code. */
static kt_status find_present_values(kt_simulation *simulation) {
    const double *y = kt_integrator_state(simulation->integrator), *v = y + simulation->size.nq;
    kt_instant at = {.model = simulation->model, .data = simulation->data, .q = y, .v = v, .tau = simulation->tau};
    kt_error made = {0};
    double first;
    at.t = kt_integrator_time(simulation->integrator);
    at.x = v + simulation->size.nv;
    at.external = simulation->external;
    kt_simulation_use_states(simulation, y);
    simulation->cached = KT_CACHED_NOTHING;
    return watch_contact(&at, &first, &made, &simulation->contacts->item[0]) == 0 ? KT_OK : made.code;
}

/* Whether friction wedges a contact in the present state. */
static bool is_wedged(kt_simulation *simulation) {
    return simulation->model->n.slip > 0 && find_present_values(simulation) == KT_ERROR_SINGULAR;
}

/* Resolves all contacts that are due at this instant, also those whose reactions end. An earlier event at this instant
 * may have resolved a contact already, which then has the other side again. */
static int act_on_contacts(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    const kt_contact *contact = user;
    struct kt_contacts *c = simulation->contacts;
    bool any = c->stops || c->window > 0.0;
    (void)what;
    for (int k = 0; k < c->n; k++) {
        const bool mine = k == contact->index, closed = kt_contact_is_closed(simulation->model, &c->item[k]);
        const bool due = simulation->event_memory[k].side < 0 && (mine || simulation->event_root[k].due);
        c->item[k].meets = due && !closed;
        c->item[k].leaves = kt_contact_leaves(simulation, k, due && closed);
        if (c->item[k].meets && kt_contact_rubs(c, k))
            kt_contact_count_reversal(simulation, k);
        any = any || due;
    }
    kt_contacts_slip_together(simulation);
    const kt_status status = any ? kt_phase_settle(simulation, error) : KT_OK;
    kt_contacts_clear_due(c);
    c->rests = c->stops = false;
    c->window = 0.0;
    if (status == KT_OK && any && is_wedged(simulation)) /* no step begins here, except a time step */
        (void)kt_bounded_step_replaces(simulation, KT_ERROR_SINGULAR);
    return status == KT_OK || kt_bounded_step_replaces(simulation, status) ? 0 : -1;
}

/* Takes the model in which no contact is closed and no friction sticks, except friction that is released. */
static void open_all(kt_simulation *simulation) {
    const uint64_t set = (simulation->model->set & ~simulation->contact_mask) |
                         (simulation->memory.released & simulation->contact_friction);
    if (set != simulation->model->set)
        kt_simulation_take_model(simulation, kt_contacts_open_model(simulation, set));
    kt_contacts_renew_model(simulation);
    simulation->memory.set = set;
    simulation->memory.own_time = simulation->memory.slip_noise = 0.0;
    for (size_t k = 0; k < simulation->contact_count; k++) {
        kt_contact_memory *state = &simulation->contact_state[k];
        state->closed = false;
        state->closes_at = state->parts_at = state->opens_at = 0.0;
        state->left_at = state->held = -HUGE_VAL;
    }
}

/* ---- at an instant ----------------------------------------------------------------------------------------------- */

/* Stores which contacts are closed, and counts changes. Switches and jumps open all contacts first: a contact that is
 * closed again afterwards is not counted. */
static void store_changes(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    kt_contact_counts *counts = &simulation->memory.contacts;
    const kt_model *model = simulation->model;
    for (int k = 0; k < c->n; k++) {
        const kt_contact *contact = &c->item[k];
        const bool was = simulation->contact_state[k].counted, is = kt_contact_is_closed(model, contact);
        simulation->changed_contact = is != was ? (size_t)k + 1 : simulation->changed_contact;
        simulation->contact_state[k].closed = simulation->contact_state[k].counted = is;
        counts->closings += k < c->sides && is && !was;
        counts->openings += k < c->sides && was && !is;
        counts->sticks += k >= c->sides && is && !was;
        counts->slips += k >= c->sides && was && !is &&
                         (kt_contact_rubs(c, k) ? kt_contact_is_closed(model, &c->item[contact->of])
                                                : !kt_contact_is_released(contact));
    }
}

/* Adds to *lost the energy that closing contacts and sticking friction dissipate without an impact: a bounce or slip
 * that comes to rest, or is held, still has a speed, which the projection onto the loops removes. A change of
 * velocities of the size of rounding dissipates nothing. */
static kt_status add_holds(kt_simulation *simulation, const double *y, double *lost, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    double held = 0.0;
    const kt_status status = kt_simulation_find_loss(simulation, c->v, y, &held, error);
    if (status == KT_OK && sqrt(2.0 * held) > kt_contact_rounding * c->speed)
        *lost += held;
    return status;
}

/* Commits contacts: the model of the set that follows, and the state after impulses. approach: the speed before
 * the impulses; 0: no impulses. */
static kt_status commit_jump_of_contacts(kt_simulation *simulation, double lost, double approach, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double t = kt_simulation_closing_time(simulation, kt_integrator_time(simulation->integrator));
    const double *from = kt_integrator_state(simulation->integrator);
    const uint64_t set = kt_contacts_set(simulation);
    kt_simulation_energy before, after = {0.0, 0.0};
    bool changed = false;
    kt_status status = kt_simulation_begin_jump(simulation, false, &before, error);
    if (status != KT_OK)
        return status;
    const kt_model *old = simulation->model;
    kt_simulation_take_model(simulation, kt_contacts_model(simulation, false));
    memcpy(simulation->y, from, simulation->size.n * sizeof(double));
    memcpy(simulation->y + simulation->size.nq, c->v, simulation->size.nv * sizeof(double));
    status = kt_simulation_project(simulation, t, simulation->y, &changed, error);
    status = kt_contacts_check_rates(simulation, t, simulation->y + simulation->size.nq, approach, status, error);
    if (status == KT_OK)
        status = add_holds(simulation, simulation->y, &lost, error);
    if (status == KT_OK && kt_simulation_accounts(simulation))
        status = kt_simulation_find_energy(simulation, simulation->y, &after, error);
    if (status == KT_OK) {
        const bool driven =
            c->all->driven || simulation->model->driven; /* a moving contact may be open again after a bounce */
        kt_simulation_add_jump(simulation, after.kinetic + after.potential - before.kinetic - before.potential, lost,
                               driven);
        status = kt_simulation_land(simulation, &before, &after, error);
    }
    if (status != KT_OK) {
        kt_simulation_take_model(simulation, old);
        return status;
    }
    simulation->memory.set = set;
    simulation->memory.contacts.dissipated += lost;
    store_changes(simulation);
    return KT_OK;
}

/* Sets the gap at which each open contact of the selected island closes, and the present sides of their events. */
static void watch_open_of_island(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    for (int i = 0; i < c->resting; i++) {
        const int k = c->list[i];
        if (kt_contact_is_closed(simulation->model, &c->item[k]))
            continue;
        if (i < c->meeting)
            kt_contact_watch_gap(simulation, i);
        if (i < c->meeting || fabs(c->v[c->item[k].v]) <= c->rest_rate[k])
            simulation->event_memory[k].side = -1;
    }
}

/* An open contact that touches either parts first, or penetrates; friction that slips from rest either slips in its
 * direction first, or reverses (event.c). Closing others may have moved an open contact beyond its boundary, by the
 * tolerance of touching. Such a contact then closes at its present gap, since a bounce may be lower than that. */
static kt_status watch_open(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *y = kt_integrator_state(simulation->integrator);
    const kt_status status =
        kt_contacts_find_equations(c, simulation->model, t, y, y + simulation->size.nq, false, error);
    for (int i = 0; status == KT_OK && i < c->islands; i++)
        if (kt_contacts_select(c, i))
            watch_open_of_island(simulation);
    for (int k = 0; status == KT_OK && k < c->n; k++)
        if (c->item[k].spared) {
            if (k < c->sides)
                simulation->contact_state[k].parts_at = simulation->contact_state[k].closes_at =
                    fmin(c->gap[k], 0.0) - kt_contact_depth(&c->item[k]);
            simulation->event_memory[k].side = -1;
        }
    for (int k = c->sides; k < c->n; k++)
        simulation->contact_state[k].closes_at = -HUGE_VAL;
    (void)kt_contacts_follow_slip(simulation);
    simulation->contact_time = (double)NAN; /* values of this state have changed */
    return status;
}

/* Applies impulses, and finds the next set. *lost grows by the energy that impulses dissipate; *approach: the speed
 * before the impulses. */
static kt_status solve_contacts(kt_simulation *simulation, double t, double *lost, double *approach, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *y = kt_integrator_state(simulation->integrator);
    const kt_model *model = simulation->model, *open = kt_model_switched(model, model->set & ~c->mask);
    simulation->cached = KT_CACHED_NOTHING;
    kt_data_rebind(open, simulation->data);
    kt_status status = kt_contacts_find_response(simulation, open, t, y, error);
    if (status == KT_OK)
        status = kt_contacts_find_speed(simulation, open, y, error);
    if (status == KT_OK)
        status = kt_contacts_spare_held(simulation, open, t, error);
    if (status == KT_OK && c->window > 0.0)
        status = kt_contacts_accumulate(simulation, open, t, lost, error);
    *approach = status == KT_OK ? kt_contacts_find_rates(simulation) : 0.0;
    if (status == KT_OK && *approach > 0.0)
        status = kt_contacts_check_levers(simulation, open, t, error);
    if (status == KT_OK && *approach > 0.0)
        status = kt_contacts_apply_impact(simulation, t, lost, error);
    if (status == KT_OK)
        status = kt_contacts_solve_reactions(simulation, t, lost, error);
    kt_data_rebind(model, simulation->data);
    return status;
}

/* Moves c->v to the velocities just after t, at which speeds of drives jump. No contact reacts yet. */
static kt_status strike_open(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const kt_model *model = simulation->model;
    double *y = simulation->y;
    bool changed;
    memcpy(y, kt_integrator_state(simulation->integrator), simulation->size.n * sizeof *y);
    kt_simulation_take_model(simulation, kt_model_switched(model, model->set & ~c->mask));
    const kt_status status = kt_simulation_project(simulation, t, y, &changed, error);
    kt_simulation_take_model(simulation, model);
    kt_copy(c->v, y + simulation->size.nq, simulation->size.nv * sizeof *y);
    return status;
}

/* Decides which contacts are closed from this instant on: their equations, those that touch, impacts and forces, and
 * the jump to the new state. */
static kt_status resolve_once(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_simulation_recall_breakpoints(simulation);
    const double t = kt_simulation_time_inside(simulation, kt_integrator_time(simulation->integrator));
    const double *y = kt_integrator_state(simulation->integrator);
    double lost = 0.0, approach = 0.0;
    for (int k = 0; k < c->n; k++)
        simulation->event_memory[k].side = 1; /* gaps and reactions are not negative from now on */
    kt_simulation_clear_jump(simulation);
    kt_copy(c->v, y + simulation->size.nq, simulation->size.nv * sizeof(double));
    if (!(simulation->memory.own_time > 0.0))
        kt_contacts_begin_own_time(simulation, t, y);
    kt_status status = c->strikes ? strike_open(simulation, t, error) : KT_OK;
    if (status == KT_OK)
        status = kt_contacts_find_equations(c, simulation->model, t, y, c->v, true, error);
    if (status == KT_OK)
        status = kt_contacts_find_touching(simulation, t, error);
    const bool any = status == KT_OK && kt_contacts_total(c) > 0;
    if (status == KT_OK && !any)
        store_changes(simulation);
    if (!any && !c->strikes)
        return status;
    if (any)
        status = solve_contacts(simulation, t, &lost, &approach, error);
    else
        kt_contacts_let_slip(c);
    if (status == KT_OK)
        status = commit_jump_of_contacts(simulation, lost, approach, error);
    if (status != KT_OK)
        return status;
    simulation->memory.held = kt_contacts_find_held(simulation);
    return watch_open(simulation, t, error);
}

/* Frees the contact that friction wedged last. An implicit method may evaluate other states behind the one that failed.
 * A contact wedges if it slips, and no normal force obeys Coulomb's law: friction mu N raises the force N that it needs
 * by more than N (Painleve's paradox). Without such a contact, treats the slowest contact with slow slip. The attempts
 * are, in this order:
 *
 *     RELEASE    The contact is released, if it then parts.
 *     then       Impulses without a collision stop the slip, up to IMPULSES times.
 *     HOLD       The slip is held for a short time, once for each contact. A contact that slips on nevertheless has
 *                neighbours on its body that slip, too. Then all slow slip is held.
 *
 * Returns false if no attempt is left. */
bool kt_contacts_free_wedged(kt_simulation *simulation, int *attempt) {
    struct kt_contacts *c = simulation->contacts;
    kt_status status = KT_ERROR_CONSTRAINT;
    c->wedged = kt_contacts_find_wedged(simulation);
    if (c->wedged < 0) {
        c->wedged = kt_contacts_find_slow(simulation);
        *attempt = *attempt > HOLD ? *attempt : HOLD;
    }
    while (c->wedged >= 0 && status != KT_OK && *attempt < HOLD + c->sides) {
        const int now = (*attempt)++;
        kt_error made = {0};
        kt_contacts_clear_due(c); /* the marks of the attempt before */
        c->releases = now == RELEASE;
        c->jams = now > RELEASE && now < HOLD;
        c->holds = now >= HOLD;
        c->holds_slow = c->holds && kt_contact_is_held(simulation, c->item[c->wedged].of);
        if (c->holds)
            kt_contact_hold(simulation, c->item[c->wedged].of);
        status = resolve_once(simulation, &made);
        simulation->memory.contacts.rested += c->holds && status == KT_OK;
        if (c->jams && status != KT_OK) /* another impulse would fail, too */
            *attempt = HOLD;
        c->releases = c->holds = c->holds_slow = c->jams = false;
    }
    return status == KT_OK;
}

/* A decision holds if the state to which it leads has its forces. The projection that ends rates of some contacts
 * changes those of others: an open contact that touches may close, and slow slip may turn. Then the next decision, at
 * this instant, frees items whose reserve is negative, and finds the impacts of contacts that close. Otherwise such a
 * contact would penetrate first, and strike faster than it parted: its bounces would not fade. */
enum { DECISIONS = 8 };

/* Whether the present state refutes the decision. Marks the items that leave, with an error. */
static bool is_refuted(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *v = kt_integrator_state(simulation->integrator) + simulation->size.nq;
    bool refuted = false;
    error->code = KT_OK;
    for (int k = find_present_values(simulation) == KT_OK ? 0 : c->n; k < c->n; k++) {
        const bool leaves = kt_contact_breaks_law(simulation, k, error);
        const bool parted = k < c->sides && simulation->event_memory[k].side < 0 && !c->item[k].spared;
        c->item[k].leaves = kt_contact_leaves(simulation, k, leaves) || c->item[k].leaves;
        refuted = refuted || leaves || (parted && kt_contacts_rate(c, k, 0, v) < -kt_contact_resting(simulation, k));
    }
    return refuted;
}

static kt_status resolve_contacts(kt_simulation *simulation, kt_error *error) {
    kt_status status = resolve_once(simulation, error);
    kt_error made = {0};
    int attempt = 0;
    for (int i = 0; i <= DECISIONS && status == KT_OK && is_refuted(simulation, &made); i++)
        status = i < DECISIONS ? resolve_once(simulation, error)
                               : kt_error_set(error, made.code, made.where, "%s", made.message);
    kt_contacts_clear_due(simulation->contacts);
    while (status == KT_OK && is_wedged(simulation) && kt_contacts_free_wedged(simulation, &attempt)) {
    }
    return status;
}

/* Resolves the contacts after velocities of drives have jumped: closed contacts then have no restitution. */
static kt_status strike_contacts(kt_simulation *simulation, kt_error *error) {
    simulation->contacts->strikes = true;
    const kt_status status = resolve_contacts(simulation, error);
    simulation->contacts->strikes = false;
    return status;
}

/* The contact that comes to rest at event k. Slip of a joint may come to rest between the impacts of a contact. Then
 * the chain is that of the contact. */
static int bouncing_contact(const kt_simulation *simulation, int k) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_model *model = simulation->model;
    const bool slips = k >= c->sides && !kt_contact_rubs(c, k) && !kt_contact_is_closed(model, &c->item[k]);
    for (int i = 0; slips && i < c->sides; i++)
        if (c->item[i].island == c->item[k].island && !kt_contact_is_closed(model, &c->item[i]) &&
            model->loop[c->item[i].loop].rest_velocity > 0.0)
            return i;
    return k;
}

/* Lets a contact rest whose impacts accumulate within the window, s, or slip whose reversals do. Without a rest
 * velocity, or if a joint reverses in either direction of its friction, a time step replaces the rest of a fixed step.
 * Returns false if none does. */
static bool come_to_rest(kt_simulation *simulation, size_t event, double window) {
    struct kt_contacts *c = simulation->contacts;
    const int k = bouncing_contact(simulation, (int)event);
    const kt_contact *item = &c->item[k < c->sides || c->item[k].of < 0 ? k : c->item[k].of];
    const bool is_open = !kt_contact_is_closed(simulation->model, &c->item[k]);
    const bool may = simulation->model->loop[item->loop].rest_velocity > 0.0;
    c->window = may && (k < c->sides || !is_open) ? window : 0.0;
    c->stops = may && (kt_contact_rubs(c, k) || !is_open);
    simulation->memory.contacts.rested += c->window > 0.0 || c->stops;
    return c->window > 0.0 || c->stops || kt_bounded_step_replaces(simulation, KT_ERROR_STEP);
}

static const kt_event_source contact_source = {
    .rest = come_to_rest, .ends = kt_contact_slip_ends, .margin = kt_contact_value_margin, .kink = kt_contact_kink};

/* ---- the part of a simulation ------------------------------------------------------------------------------------ */

static bool has_contacts(const kt_simulation *simulation) {
    return simulation->contacts != NULL && !simulation->steps_over_contacts;
}

static bool has_slip(const kt_simulation *simulation) { return has_contacts(simulation) && simulation->contacts->rubs; }

static void follow_model(kt_simulation *simulation) {
    kt_contacts_put_directions(simulation);
    kt_contacts_store_ranks(simulation);
}

static kt_status begin_with_contacts(kt_simulation *simulation, kt_error *error) {
    kt_contacts_find_excess(simulation);
    return kt_contacts_begin_prediction(simulation, error);
}

static void resume_contacts(kt_simulation *simulation) { simulation->contact_time = (double)NAN; }

const kt_part kt_slip_part = {.is_active = has_slip, .begin = kt_contacts_begin_slip};

const kt_part kt_contact_part = {.is_active = has_contacts,
                                 .start = kt_contacts_start,
                                 .begin = begin_with_contacts,
                                 .accept = kt_contacts_count_excess,
                                 .rebind = follow_model,
                                 .renew = kt_contacts_renew_model,
                                 .variant = kt_contacts_open_model,
                                 .reset = open_all,
                                 .interrupt = kt_simulation_mark_jump,
                                 .resume = resume_contacts,
                                 .settle = resolve_contacts,
                                 .strike = strike_contacts,
                                 .check_record = kt_contacts_check_record};

kt_status kt_contacts_init(kt_simulation *simulation, kt_error *error) {
    const bool steps = simulation->steps_over_contacts, leaps = steps || kt_bounds_steps(&simulation->options);
    kt_status status =
        steps ? kt_load_reject(simulation->model, "contacts", "time stepping does not support this", error) : KT_OK;
    if (status == KT_OK)
        status = kt_contacts_lay_out(simulation, error);
    if (status != KT_OK)
        return status;
    struct kt_contacts *c = simulation->contacts;
    for (int k = 0; status == KT_OK && !steps && k < c->n; k++) {
        const kt_event event = {.name = kt_loop_name(simulation->model, c->item[k].loop),
                                .function = watch_contact,
                                .action = act_on_contacts,
                                .user = &c->item[k],
                                .record = simulation->options.record_contacts,
                                .direction = KT_DIRECTION_FALLING};
        kt_event_append(simulation, &event);
    }
    simulation->contact_count = steps ? 0 : (size_t)c->n;
    simulation->contact_mask = c->mask;
    simulation->events.source = &contact_source;
    if (status == KT_OK && leaps)
        kt_moreau_init(simulation);
    if (steps && simulation->step > 0.0) /* records only: a motion takes some hundred steps */
        simulation->slow_slip = kt_slip_slow * c->all->length / (300.0 * simulation->step);
    simulation->memory.contacts.count = 0;
    for (int k = 0; k < c->n; k++)
        simulation->memory.contacts.count += !kt_contact_rubs(c, k);
    kt_parts_list(simulation);
    return status;
}
