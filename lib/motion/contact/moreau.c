/* Time stepping over impacts: Moreau's midpoint rule with impulses (theta = 1/2), as an alternative to events.
 *
 * A step of length h takes (q, v) to (q+, v+). Contacts have the gaps g(q) >= 0 and rates u = J v - b'. M^-1 belongs to
 * the mechanism with its other loops.
 *
 *     qm = q (+) h v / 2                   the middle, at which other loops are closed
 *     v+ = v + h a(qm, vm) + M^-1 J' p     a without contacts; J, b' and M at qm
 *     q+ = qm (+) h v+ / 2                 then loops are closed, positions and velocities
 *
 * In the first of two passes vm is v, in the second pass (v + v+) / 2. Both solve for the impulses p. These obey
 * Newton's rule and Coulomb's law at the velocities of the end. With the rates u- at the beginning, and uf at the end
 * without impulses
 *
 *     0 <= p_n  complementary to  u_n+ - r >= 0,    |p_t| <= mu p_n,    |u_t+| p_t = -mu p_n u_t+
 *     r = -e u_n-                              if the contact bounces, |u_n-| > max(rest velocity, u_n- - uf_n)
 *     r = -g(qm) / h, at most max(c, min(d / h, u_n- - uf_n))  otherwise
 *     c = max(-u_n-, 0), and at most 2 h b'' for a closed contact
 *
 * A bounce that is shorter than about a step does not exist: the second speed is the speed of free fall during h. The
 * bound -g / h lets a contact close without penetration, since the middles of two steps are h v+ apart. For the same
 * reason, contacts with g(qm) + h u_n+ < 0 take part. A closed contact with a curved gap has u_n+ = -u_n- = h b'' / 2,
 * as in the method SHAKE, and dissipates nothing. Dry friction of joints is |p| <= h S (cone/cone.h). Without a
 * solution of the cone solver, its best impulses are used, and the step is counted.
 *
 * Depths that the bound does not remove are those of the start, of the cone solver's residual, or of bounces that
 * others prevent. The middle is moved out of these contacts, by the least displacement in the mass metric:
 *
 *     qm <- qm (+) M^-1 J' m,    0 <= m  complementary to  g(qm) + h max(r, 0) + J M^-1 J' m >= 0
 *
 * Gaps, bounds and the accelerations of the second pass are evaluated after this displacement. M and J are those before
 * it: a second factorisation would change velocities by a part of the depth. If bounces are reduced, a second
 * displacement ends the step.
 *
 * Redundant contacts. Four corners of a rigid face share a load in many ways, and friction of corners that differ
 * depends on the shares. Let p be redundant impulses, J'p = 0. Newton's method with the damping delta
 * (cone/cone_newton.c) moves the impulses along p by about p . r / delta, until a corner has no load. Gaps of one
 * rigid face have p . g = 0. So all bounds must be r = -g / h to rounding. The residual of the cone solver leaves
 * depths of 1e-7 G h^2, with the acceleration G of free fall. Contacts with such a depth would have r = 0 instead.
 * Hence depths are moved out before the bounds are known. Depths up to the rounding d of a gap are removed within the
 * step.
 *
 * Friction that sticks in a heap is redundant, too, but the gaps of its contacts are independent. Then bounds that
 * part, r > 0, may have no solution: a sphere between two walls cannot leave both. Others, r < 0, have solutions in
 * which contacts slip or open by rounding. So a closed contact does not return the speed of its approach, unless its
 * gap is curved. If both bodies are at rest and the residual of the cone solver explains the gap of a closed contact,
 * of either sign, a displacement closes the gap: the equation g(qm) + J M^-1 J' m = 0 replaces the complementarity.
 * Then all contacts stick with r = 0, and the impulses of the last step solve the next step.
 *
 * The impulses of a step dissipate -p . (u- + u+) / 2. If restitution makes this negative, the restitution is halved,
 * as for events (contact/impact.c); steps that still gain energy are counted. A displacement lifts weights: its energy
 * is of the order of the depth.
 *
 * Sources: J. J. Moreau, Unilateral contact and dry friction in finite freedom dynamics, 1988; M. Jean, The non-smooth
 * contact dynamics method, 1999; D. E. Stewart, J. C. Trinkle, An implicit time-stepping scheme, 1996 (the bound).
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/moreau.h"

#include "base/copy.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "model/switching.h"

#include <math.h>

KT_ARENA_LAYOUT(lay_out_moreau, kt_moreau, KT_MOREAU_FIELDS, const kt_counts *n, const kt_contact_sizes *s,
                size_t state)

/* ---- memory ------------------------------------------------------------------------------------------------------ */

size_t kt_moreau_size(const kt_model *model, size_t n) {
    const kt_contact_sizes s = kt_contact_sizes_of(model);
    return lay_out_moreau(NULL, &model->n, &s, n);
}

void kt_moreau_init(kt_simulation *simulation) {
    const kt_contact_sizes s = kt_contact_sizes_of(simulation->model);
    kt_moreau *m = (kt_moreau *)(void *)simulation->moreau_memory;
    (void)lay_out_moreau(m, &simulation->model->n, &s, simulation->size.n);
    m->cone = simulation->contacts->solver->cone;
    simulation->moreau = m;
    simulation->integrator->leap = simulation->steps_over_contacts ? &kt_moreau_leap : NULL;
}

/* ---- parts of a step --------------------------------------------------------------------------------------------- */

/* from (+) h v / 2, with other loops closed if `closes`. */
static kt_status move_half(kt_simulation *simulation, double t, double h, const double *v, bool closes, double *q,
                           kt_error *error) {
    kt_moreau *m = simulation->moreau;
    const size_t nq = simulation->size.nq, nv = simulation->size.nv;
    bool changed = false;
    for (size_t i = 0; i < nv; i++)
        m->change[i] = 0.5 * h * v[i];
    kt_copy(m->position, q, nq * sizeof *q);
    kt_position_add(simulation->model, m->position, m->change, q);
    return closes ? kt_simulation_project(simulation, t, q, &changed, error) : KT_OK;
}

/* One evaluation in the middle: accelerations to simulation->a, rates of auxiliary states to m->rate and, if not NULL,
 * the power. */
static kt_status evaluate_middle(kt_simulation *simulation, double t, kt_power *power, kt_error *error) {
    kt_moreau *m = simulation->moreau;
    const kt_status status = power != NULL ? kt_simulation_power(simulation, t, m->y, power, error)
                                           : kt_simulation_accelerate(simulation, t, m->y, simulation->tau,
                                                                      simulation->external, simulation->a, error);
    if (status != KT_OK)
        return error->code != KT_OK ? error->code : status;
    return simulation->size.x > 0 ? kt_auxiliary_state_rates_trusted(simulation->model, simulation->data, t, m->y,
                                                                     m->y + simulation->size.nq, m->rate, error)
                                  : KT_OK;
}

/* Velocities without impulses, from y to m->y, and the rates of auxiliary states. The mean velocity vm is m->middle. */
static kt_status move_freely(kt_simulation *simulation, double t, double h, const double *y, kt_power *power,
                             kt_error *error) {
    kt_moreau *m = simulation->moreau;
    const size_t nq = simulation->size.nq, nv = simulation->size.nv;
    kt_copy(m->y + nq, m->middle, nv * sizeof *y);
    const kt_status status = evaluate_middle(simulation, t, power, error);
    for (size_t i = 0; i < nv; i++)
        m->y[nq + i] = y[nq + i] + h * simulation->a[i];
    simulation->integrator->memory.counts.evaluations++;
    return status;
}

/* Advances the auxiliary states from their values in y, over a part of the step. */
static void move_states(const kt_simulation *simulation, double h, const double *y) {
    const size_t x = simulation->size.nq + simulation->size.nv;
    for (size_t i = 0; i < simulation->size.x; i++)
        simulation->moreau->y[x + i] = y[x + i] + h * simulation->moreau->rate[i];
}

/* Adds the impulses to the velocities without impulses in m->y. again: the second pass; the first one corrects depths,
 * and settles gaps, before it solves. */
static kt_status add_impulses(kt_simulation *simulation, double h, const double *v, bool again, kt_error *error) {
    bool any = false;
    kt_moreau_take_free(simulation, h);
    kt_status status = kt_moreau_add_closing(simulation, h, v, &any, error);
    if (status == KT_OK && !again) {
        kt_moreau_correct(simulation, h, true);
        kt_moreau_settle_gaps(simulation, h);
        kt_moreau_renew_laws(simulation, h);
    }
    any = simulation->moreau->count > 0;
    while (status == KT_OK && any) { /* each solution may close more contacts; each contact joins once */
        status = kt_moreau_solve(simulation, error);
        if (status == KT_OK)
            status = kt_moreau_add_closing(simulation, h, v, &any, error);
    }
    return status;
}

/* One pass of a step: velocities without impulses, then the impulses and the velocities with them. The first pass
 * evaluates forces with the velocities v before the step. The second one (`again`) uses the mean of these and of the
 * velocities that the first pass has found, and begins with the contacts of the first. */
static kt_status take_pass(kt_simulation *simulation, double t, double h, const double *y, bool again, kt_power *power,
                           kt_error *error) {
    kt_moreau *m = simulation->moreau;
    const size_t nv = simulation->size.nv;
    const double *v = y + simulation->size.nq;
    for (size_t i = 0; i < nv; i++)
        m->middle[i] = again ? 0.5 * (v[i] + m->after[i]) : v[i];
    kt_status status = move_freely(simulation, t, h, y, again ? power : NULL, error);
    if (status == KT_OK)
        move_states(simulation, again ? h : 0.5 * h, y);
    if (status == KT_OK && !again)
        status = kt_moreau_begin(simulation, t, v, error);
    return status == KT_OK ? add_impulses(simulation, h, v, again, error) : status;
}

/* The energy that viscous parts of dry friction dissipate in the step. */
static double viscous_loss_of(const kt_simulation *simulation, double h, const double *v) {
    const kt_moreau *m = simulation->moreau;
    double lost = 0.0;
    for (int i = 0; i < m->dry; i++) {
        const int j = simulation->contacts->item[m->item[i]].v;
        lost += 0.5 * h * m->viscous[i] * (v[j] + m->after[j]);
    }
    return lost;
}

/* The work of contacts whose boundaries move: p . b'. */
static double carried_work_of(const kt_simulation *simulation) {
    const kt_moreau *m = simulation->moreau;
    const struct kt_contacts *c = simulation->contacts;
    double carried = 0.0;
    for (int i = 0; i < m->count; i++)
        for (int r = m->first[i], k = 0; k < kt_moreau_rows(m, i); r++, k++)
            carried += m->p[3 * i + k] * c->item[m->item[i]].sign * kt_moreau_right(c, c->rows[r], c->components[r]);
    return carried;
}

/* vm . M dv, with the mean velocity vm = (v + v+) / 2 and the change dv of the velocities by impulses. */
static kt_status find_impulsive_work(kt_simulation *simulation, double h, const double *v, double *work,
                                     kt_error *error) {
    const kt_moreau *m = simulation->moreau;
    const size_t nv = simulation->size.nv;
    double *weight = m->change, *sum = m->middle; /* M dv + weight */
    for (size_t j = 0; j < nv; j++)
        sum[j] = m->after[j] - v[j] - h * simulation->a[j];
    kt_status status = kt_inverse_trusted(simulation->model, simulation->data, m->y, NULL, NULL, NULL, weight, error);
    if (status == KT_OK)
        status = kt_inverse_trusted(simulation->model, simulation->data, m->y, NULL, sum, NULL, sum, error);
    *work = 0.0;
    for (size_t j = 0; status == KT_OK && j < nv; j++)
        *work += 0.5 * (v[j] + m->after[j]) * (sum[j] - weight[j]);
    return status;
}

/* Adds the work done in the step to the work in the state. Impulses p of contacts and of dry friction change the
 * velocities by dv. Driven loops then have impulses, too, with the work
 *
 *     vm . A'l = vm . (M dv - J'p),    -vm . J'p = dissipated energy - p . b'
 */
static kt_status add_works(kt_simulation *simulation, double h, const double *v, kt_power power, double *next,
                           kt_error *error) {
    const kt_moreau *m = simulation->moreau;
    const double lost = m->counts.dissipated, viscous = viscous_loss_of(simulation, h, v),
                 carried = carried_work_of(simulation);
    double driven = 0.0;
    kt_status status = KT_OK;
    if (simulation->model->driven && m->count > 0) {
        status = find_impulsive_work(simulation, h, v, &driven, error);
        driven += lost + viscous - carried;
    }
    next[simulation->size.work] += h * power.dissipated + fmax(lost, 0.0) + viscous;
    next[simulation->size.work + 1] += h * power.supplied + carried + driven + fmax(-lost, 0.0);
    return status;
}

/* The step from (t, y) to `next` at `end`: the middle, two passes for v+, and q+. */
static kt_status take_step(kt_simulation *simulation, double t, double h, double end, const double *y, double *next,
                           kt_error *error) {
    kt_moreau *m = simulation->moreau;
    const size_t nq = simulation->size.nq, nv = simulation->size.nv, n = simulation->size.n;
    const double middle = t + 0.5 * h;
    const bool balanced = simulation->size.integrates_works;
    kt_power power = {0.0, 0.0};
    bool changed = false;
    m->h = h;
    m->count = m->dry = 0;
    m->counts = (kt_moreau_counts){.closed = 0};
    kt_copy(m->y, y, n * sizeof *y);
    kt_status status = move_half(simulation, middle, h, y + nq, simulation->groups > 0, m->y, error);
    if (status == KT_OK)
        status = take_pass(simulation, middle, h, y, false, NULL, error);
    if (status == KT_OK)
        status = take_pass(simulation, middle, h, y, true, balanced ? &power : NULL, error);
    if (status == KT_OK && m->count > 0)
        status = kt_moreau_check(simulation, h, error);
    if (status != KT_OK)
        return status;
    kt_moreau_correct(simulation, h, false);
    kt_copy(next, m->y, n * sizeof *y);
    kt_copy(next + nq, m->after, nv * sizeof *y);
    if (balanced)
        status = add_works(simulation, h, y + nq, power, next, error);
    if (status == KT_OK)
        status = move_half(simulation, end, h, m->after, false, next, error);
    return status == KT_OK ? kt_simulation_project(simulation, end, next, &changed, error) : status;
}

/* ---- callbacks of the integrator --------------------------------------------------------------------------------- */

/* A step by time stepping, as the integrator's callback. Returns 1 for an error that a shorter step may avoid, or
 * -1. */
static int leap(double t, double h, double end, const double *y, double *next, void *user) {
    kt_simulation *simulation = user;
    simulation->cached = KT_CACHED_NOTHING;
    const kt_status status = take_step(simulation, t, h, end, y, next, &simulation->cause);
    simulation->cached = KT_CACHED_NOTHING;
    simulation->ahead = true;
    return status == KT_OK ? 0 : kt_simulation_is_recoverable(status) ? 1 : -1;
}

/* Stores the forces of the step, which the next one begins with, and counts changes. */
static void store_force(kt_simulation *simulation, int k, int i) {
    const kt_moreau *m = simulation->moreau;
    const struct kt_contacts *c = simulation->contacts;
    kt_contact_counts *counts = &simulation->memory.contacts;
    kt_contact_memory *state = &simulation->contact_state[k];
    const bool was_closed = state->closed != 0, is_dry = k >= c->sides;
    for (int r = 0; r < 3; r++)
        state->force[r] = i >= 0 ? m->p[3 * i + r] / m->h : 0.0;
    state->force[1] -= is_dry && i >= 0 ? m->viscous[i] : 0.0;
    state->closed = i >= 0 && (is_dry ? fabs(m->p[3 * i]) < m->limit[i] : m->p[3 * i] > 0.0);
    if (is_dry) {
        counts->sticks += state->closed && !was_closed;
        counts->slips += !state->closed && was_closed;
        return;
    }
    counts->impacts += state->closed && m->e[i] > 0.0;
    counts->closings += state->closed && !was_closed;
    counts->openings += !state->closed && was_closed;
}

/* Stores the forces of the accepted step, and adds its counts to those of the run. */
static void accept_moreau(void *user) {
    kt_simulation *simulation = user;
    kt_moreau *m = simulation->moreau;
    const struct kt_contacts *c = simulation->contacts;
    kt_contact_counts *counts = &simulation->memory.contacts;
    m->saved_counts = *counts;
    kt_copy(m->saved, simulation->contact_state, (size_t)c->n * sizeof *m->saved);
    for (int k = 0; k < c->n; k++)
        if (!kt_contact_rubs(c, k))
            store_force(simulation, k, m->item_of[k]);
    counts->closed += m->counts.closed;
    counts->pivots += m->counts.newton;
    counts->failures += m->counts.failures;
    counts->reduced += m->counts.reduced;
    counts->dissipated += m->counts.dissipated;
    counts->supplied += fmax(-m->counts.dissipated, 0.0);
    counts->penetration = fmax(counts->penetration, m->counts.penetration);
}

/* Restores the forces and the counts before a step that is undone: an event repeats it up to its instant. */
static void retreat_moreau(void *user) {
    kt_simulation *simulation = user;
    const kt_moreau *m = simulation->moreau;
    kt_copy(simulation->contact_state, m->saved, (size_t)simulation->contacts->n * sizeof *m->saved);
    simulation->memory.contacts = m->saved_counts;
}

const struct kt_leap kt_moreau_leap = {leap, accept_moreau, retreat_moreau};

/* ---- operations on contacts -------------------------------------------------------------------------------------- */

/* The model without contacts. In this model, dry friction of joints does not act, because it is released
 * (compile/variants.c). */
static void take_open_model(kt_simulation *simulation) {
    const uint64_t set = (simulation->model->set & ~simulation->contact_mask) | simulation->contact_friction;
    if (set != simulation->model->set)
        kt_simulation_take_model(simulation, kt_contacts_open_model(simulation, set));
    kt_contacts_renew_model(simulation);
    simulation->memory.set = set;
}

void kt_moreau_open(kt_simulation *simulation) {
    take_open_model(simulation);
    kt_simulation_take_model(simulation, simulation->model);
}

/* Forgets all forces of contacts. */
static void begin_anew(kt_simulation *simulation) {
    take_open_model(simulation);
    for (size_t k = 0; k < simulation->size.contacts; k++) {
        kt_clear(simulation->contact_state[k].force, sizeof simulation->contact_state[k].force);
        simulation->contact_state[k].closed = false;
    }
}

/* A start beyond a boundary is an error, as with events. Behind the first contact, steps themselves penetrate. */
static kt_status commit_steps(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double t = kt_integrator_time(simulation->integrator), *y = kt_integrator_state(simulation->integrator);
    take_open_model(simulation);
    if (simulation->memory.contacts.closed > 0)
        return KT_OK;
    const kt_status status =
        kt_contacts_find_equations(c, simulation->model, t, y, y + simulation->size.nq, false, error);
    return status == KT_OK ? kt_contacts_find_touching(simulation, t, error) : status;
}

static bool has_moreau(const kt_simulation *simulation) {
    return simulation->contacts != NULL && simulation->steps_over_contacts;
}

const kt_part kt_moreau_part = {.is_active = has_moreau,
                                .start = kt_contacts_start,
                                .rebind = kt_contacts_store_ranks,
                                .renew = kt_contacts_renew_model,
                                .variant = kt_contacts_open_model,
                                .reset = begin_anew,
                                .settle = commit_steps,
                                .begin_record = kt_moreau_begin_record,
                                .end_record = kt_moreau_end_record};
