/* Hard contacts: loops that bound one side, g(q, t) >= 0 (stops, floors, slack ropes), along a motion.
 *
 * An open contact has its gap g > 0 watched. A closed contact is a constraint of the mechanism like any other: its loop
 * is switched on (model/switching.h). Its reaction lambda > 0 is watched. Both are events (event.c). For the contacts
 * that touch at an event, let u = J v - b' be the rates of their gaps, and W = J M^-1 J'. M^-1 belongs to the mechanism
 * with its other loops (control/mass_inverse.c). At an event, two steps follow.
 *
 * 1. If some contacts close, u < 0, impulses p follow from Newton's rule or Poisson's (contact_impact.c).
 *
 * 2. Contacts with u+ = 0, or no faster than the rest velocity, are closed from now on if their reaction is
 *    compressive. (Two contacts that close in turn would otherwise go on for ever.) With the accelerations w of their
 *    gaps without reactions,
 *
 *       w+ = w + W lambda,   0 <= lambda  complementary to  w+ >= 0
 *
 * Friction of a joint that sticks (kt_effect.stick) is handled alike. While it slips, its rate in the direction of slip
 * is watched. While it sticks, it is a constraint, and the reserve S - |lambda| to its limit S is watched. It has no
 * impulse. At rest
 *
 *       -S <= lambda <= S,   a = 0 within,   a >= 0 if lambda = -S,   a <= 0 if lambda = S
 *
 * With z1 = lambda + S and z2 = max(-a, 0), these are two more rows, a + z2 >= 0 and 2 S - z1 >= 0.
 *
 * Both are linear complementarity problems with a positive semidefinite matrix (linear/lemke.h). If reactions are not
 * unique (four legs of a table), Lemke's basic solution leaves the redundant contacts open.
 *
 * Sources: C. Glocker, Set-Valued Force Laws, 2001; F. Pfeiffer, C. Glocker, Multibody Dynamics with Unilateral
 * Contacts, 1996.
 */
#include "simulation/contact.h"

#include "base/copy.h"
#include "base/require.h"
#include "control/mass_inverse.h"
#include "dynamics/dynamics.h"
#include "integrator/integrator.h"
#include "mechanism/evaluate.h"
#include "model/switching.h"

#include <float.h>
#include <math.h>
#include <stdio.h>

/* Gaps up to the first part of the mechanism's length, or of 1 m or rad, touch. No gap may be deeper than the
 * second. */
static const double touching = 1e-11, deep = 1e-6;
/* Rates and accelerations below this part of the sum of their terms are rounding. */
static const double rounding = 1e-11;
/* The largest relative inward acceleration of a leaving contact: the event is exact to rounding of the time. */
static const double sinks = 1e-6;
/* Slip of a contact has reversed at this speed against its first direction, m/s; rounding is less. */
static const double turned = 1e-12;
KT_ARENA_LAYOUT(lay_out, struct kt_contacts, KT_CONTACT_FIELDS, const kt_contact_sizes *s)

/* ---- memory ------------------------------------------------------------------------------------------------------ */

static bool is_watched(const kt_loop_record *loop) { return loop->side != KT_SIDE_NONE || loop->friction > 0; }

size_t kt_contacts_of(const kt_model *model) {
    size_t count = 0;
    for (size_t i = 0; i < model->n.loop; i++)
        count += is_watched(&model->loop[i]);
    return count;
}

static kt_contact_sizes sizes_of(const kt_model *model, size_t n) {
    kt_contact_sizes s = {.n = n, .nq = model->n.q, .nv = model->n.v, .data = kt_data_size(model)};
    size_t sides = 0, rubs = 0;
    for (size_t i = 0; i < model->n.loop; i++) {
        sides += model->loop[i].side != KT_SIDE_NONE;
        rubs += model->loop[i].rubs > 0;
    }
    s.list = n + rubs;
    s.lemke = 2 * n - sides - 2 * rubs;
    if (rubs > 0) {
        s.problem = kt_coulomb_size(n - rubs, s.list);
        s.solution = kt_coulomb_solution_size(n - rubs, s.list);
        s.solver = kt_coulomb_solver_size(n - rubs, s.list);
    }
    for (uint64_t k = 0; k < kt_family_models(model->family); k++) {
        const kt_model *one = kt_family_model(model->family, k);
        const size_t inverse = kt_mass_inverse_size(one, 0);
        s.inverse = inverse > s.inverse ? inverse : s.inverse;
        s.rows = one->n.row > s.rows ? one->n.row : s.rows;
    }
    return s;
}

size_t kt_contacts_size(const kt_model *model, size_t n) {
    const kt_contact_sizes s = n > 0 ? sizes_of(model, n) : (kt_contact_sizes){.n = 0};
    return n > 0 ? lay_out(NULL, &s) : 0;
}

/* ---- values of events -------------------------------------------------------------------------------------------- */

static double direction_of(const kt_model *model, const kt_contact *contact) {
    return (model->set & contact->back) != 0 ? -1.0 : 1.0;
}

/* The slip of a joint along its direction. For a joint that is held (find_held), it counts from the rate of rest. */
static double slip_of_joint(const kt_model *model, const kt_contact *contact, const double *v) {
    const bool is_held = (contact->simulation->memory.held & contact->bit) != 0;
    return direction_of(model, contact) * v[contact->v] + (is_held ? kt_contact_resting : 0.0);
}

/* The event value of a contact's friction: the reserve of the cone, or the slip along its direction. */
static double friction_of(const struct kt_contacts *c, const kt_instant *at, int k) {
    const kt_model *model = at->model;
    const kt_contact *friction = &c->item[k], *contact = &c->item[friction->of];
    if (!kt_contact_is_closed(model, contact))
        return 1.0;
    if (kt_contact_is_closed(model, friction)) {
        const double *tangent = c->reaction + kt_contact_row(model, friction);
        return kt_contact_coefficient(model, friction) * c->reaction[kt_contact_row(model, contact)] -
               hypot(tangent[0], tangent[1]);
    }
    return kt_contact_slip_along(model, at->data, contact) - friction->simulation->contact_state[k].closes_at + turned;
}

/* The gaps of open contacts, and the reactions of closed ones. */
static kt_status find_values(struct kt_contacts *c, const kt_instant *at, kt_error *error) {
    const kt_model *model = at->model;
    kt_status status = KT_OK;
    bool sticks = false, presses = false;
    for (int k = 0; k < c->n; k++) {
        const bool closed = kt_contact_is_closed(model, &c->item[k]);
        presses = presses || closed;
        sticks = sticks || (closed && kt_contact_rubs(c, k));
    }
    if ((model->set & c->mask) != c->mask)
        status = kt_contacts_find_equations(c, model, at->t, at->q, at->v, false, error);
    if (status == KT_OK && presses)
        status = kt_multiplier_evaluate(model, at->data, at->t, at->q, at->v, at->tau, at->external, c->row, error);
    for (int k = 0; status == KT_OK && k < c->n; k++) {
        const kt_contact *contact = &c->item[k];
        const bool closed = kt_contact_is_closed(model, contact);
        const double reaction = closed ? contact->sign * c->row[kt_contact_row(model, contact)] : 0.0;
        if (kt_contact_is_released(contact))
            c->value[k] = 1.0;
        else if (k < c->sides)
            c->value[k] = closed ? reaction : c->gap[k] - contact->simulation->contact_state[k].closes_at;
        else if (!kt_contact_rubs(c, k))
            c->value[k] =
                closed ? kt_contact_limit(model, contact) - fabs(reaction) : slip_of_joint(model, contact, at->v);
    }
    if (status == KT_OK && sticks)
        status = kt_contacts_find_reactions(c, at, error);
    for (int k = c->sides; status == KT_OK && k < c->n; k++)
        if (kt_contact_rubs(c, k))
            c->value[k] = friction_of(c, at, k);
    return status;
}

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
        if (find_values(c, &inside, error) != KT_OK)
            return 1;
        memcpy(c->at, at->q, nq * sizeof(double));
        memcpy(c->at + nq, at->v, nv * sizeof(double));
        simulation->contact_time = at->t;
        c->set = at->model->set;
    }
    *value = c->value[contact->index];
    return 0;
}

/* Resolves all contacts that are due at this instant, also those whose reactions end. An earlier event may have
 * resolved one: then it has the other side again. */
static int act(kt_simulation *simulation, const kt_occurrence *what, kt_error *error, void *user) {
    const kt_contact *contact = user;
    struct kt_contacts *c = simulation->contacts;
    (void)what;
    for (int k = 0; k < c->n; k++) {
        const bool mine = k == contact->index, closed = kt_contact_is_closed(simulation->model, &c->item[k]);
        const bool due = simulation->event_memory[k].side < 0 && (mine || simulation->event_root[k].due);
        c->item[k].meets = due && !closed;
        c->item[k].leaves = kt_contact_leaves(simulation, k, due && closed);
    }
    const kt_status status = simulation->contact_calls->resolve(simulation, error);
    for (int k = 0; k < c->n; k++)
        c->item[k].meets = c->item[k].leaves = false;
    c->rests = c->stops = false;
    return status == KT_OK ? 0 : -1;
}

static void open_all(kt_simulation *simulation) {
    const uint64_t set = (simulation->model->set & ~simulation->contact_mask) |
                         (simulation->memory.released & simulation->contact_friction);
    if (set != simulation->model->set)
        kt_simulation_take_model(simulation, kt_model_switched(simulation->model, set));
    simulation->memory.set = set;
    for (size_t k = 0; k < simulation->contact_count; k++) {
        simulation->contact_state[k].closed = false;
        simulation->contact_state[k].closes_at = 0.0;
        simulation->contact_state[k].left_at = -HUGE_VAL;
    }
}

/* ---- where contacts touch ---------------------------------------------------------------------------------------- */

static void add_row(struct kt_contacts *c, int k, int component) {
    c->list[c->touching] = k;
    c->component[c->touching++] = component;
}

/* Lists the contacts that touch, and all friction. Errors: a contact penetrates deeply. */
static kt_status find_touching(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double scale = fmax(1.0, c->all->length);
    char where[KT_WHERE_SIZE];
    c->touching = 0;
    for (int k = 0; k < c->sides; k++) {
        if (kt_contact_is_released(&c->item[k]))
            continue;
        simulation->memory.beyond = c->gap[k] < -deep * scale;
        if (simulation->memory.beyond) {
            snprintf(where, sizeof where, "contact '%.60s' at t = %.9g s", kt_loop_name(c->all, c->item[k].loop), t);
            return kt_error_set(error, KT_ERROR_CONSTRAINT, where,
                                "'%.60s' is %.3g (m or rad) beyond its boundary; begin on its free side, and bound the "
                                "steps (max_step)",
                                kt_loop_name(c->all, c->item[k].loop), -c->gap[k]);
        }
        if (c->gap[k] <= touching * scale || c->item[k].meets || kt_contact_is_closed(simulation->model, &c->item[k]))
            add_row(c, k, 0);
    }
    c->meeting = c->touching;
    for (int k = c->sides; k < c->n; k++)
        if (!kt_contact_rubs(c, k) && !kt_contact_is_released(&c->item[k]))
            add_row(c, k, 0);
    c->resting = c->touching;
    for (int i = 0; i < c->meeting; i++)
        for (int component = 0; component < 2 && c->item[c->list[i]].of >= 0; component++)
            add_row(c, c->item[c->list[i]].of, component);
    return KT_OK;
}

/* Computes M^-1 J' and W of the mechanism with all contacts open, from data of the simulation. */
static kt_status find_response(kt_simulation *simulation, const kt_model *open, double t, const double *q, double *W,
                               kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const size_t nv = open->n.v;
    const int m = c->touching;
    kt_mass_inverse *inverse = NULL;
    for (int i = 0; i < m; i++)
        for (size_t j = 0; j < nv; j++)
            c->response[(size_t)i * nv + j] = kt_contact_entry(c, i, j);
    kt_status status = kt_mass_inverse_init(open, 0, c->inverse_memory, c->inverse_size, &inverse, error);
    if (status == KT_OK)
        status = kt_mass_inverse_compute(inverse, simulation->data, t, q, error);
    if (status == KT_OK)
        status = kt_mass_inverse_apply(inverse, m, c->response, error);
    for (int i = 0; status == KT_OK && i < m; i++)
        for (int k = 0; k < m; k++) {
            double sum = 0.0;
            for (size_t j = 0; j < nv; j++)
                sum += kt_contact_entry(c, i, j) * c->response[(size_t)k * nv + j];
            W[i * m + k] = sum;
        }
    return status;
}

/* The problem of reactions: n rows of contacts and friction at rest, then a second row for each friction. */
typedef struct reactions {
    int n, sides; /* the number of rows, and of contacts */
} reactions;

/* Lists the rows that can have a reaction, with their free accelerations. A contact whose reaction has ended gets no
 * reaction, because the event has found the change of sign. The step ends a few rounding units of the time earlier,
 * where the contact may still have a compressive reaction. */
static void list_reactions(kt_simulation *simulation, const double *W, const double *u, reactions *r) {
    struct kt_contacts *c = simulation->contacts;
    double size;
    *r = (reactions){.n = 0};
    for (int i = 0; i < c->touching; i++) {
        const kt_contact *contact = &c->item[c->list[i]];
        const bool is_side = i < c->meeting;
        (void)kt_contact_rate(c, W, i, &size);
        if (is_side && u[i] > fmax(kt_contact_rest(simulation, W, i), rounding * size))
            continue;
        if (!is_side && fabs(c->v[contact->v]) > kt_contact_resting)
            continue;
        if (is_side && contact->leaves)
            continue;
        const double free = kt_contact_acceleration(c, W, i, &size);
        c->slip[r->n] = is_side ? 0.0 : kt_contact_slip(simulation->model, contact);
        c->limit[r->n] = is_side ? 0.0 : kt_contact_limit(simulation->model, contact);
        c->free[r->n] = is_side && fabs(free) <= rounding * size ? 0.0 : free;
        c->pressing[r->n++] = i;
        r->sides += is_side;
    }
    /* At rest, the model has friction that slips forwards. */
    for (int i = 0; i < r->n; i++)
        for (int k = r->sides; k < r->n; k++)
            c->free[i] += W[c->pressing[i] * c->touching + c->pressing[k]] * c->slip[k];
}

/* Solves w = W lambda + free with lambda = z1 - S, and the rows of z2 for friction. */
static bool solve_reactions(struct kt_contacts *c, const double *W, const reactions *r, uint64_t *pivots) {
    const int friction = r->n - r->sides, rows = r->n + friction;
    double *M = c->M, *q = c->q;
    kt_clear(M, (size_t)(rows * rows) * sizeof *M);
    for (int i = 0; i < r->n; i++) {
        q[i] = c->free[i];
        for (int k = 0; k < r->n; k++) {
            M[i * rows + k] = W[c->pressing[i] * c->touching + c->pressing[k]];
            q[i] -= M[i * rows + k] * c->limit[k];
        }
    }
    for (int k = r->sides; k < r->n; k++) {
        M[k * rows + k + friction] = 1.0;
        M[(k + friction) * rows + k] = -1.0;
        q[k + friction] = 2.0 * c->limit[k];
    }
    return kt_lemke_solve(rows, M, q, c->lemke, c->z, pivots);
}

/* Finds contacts whose reaction has ended but that would penetrate, and lets them stay. At the same instant, friction
 * or another contact has changed the force on them. All accelerations may be rounding, as for a pendulum that hangs
 * down, or for a body that a growing force lifts. The acceleration from the largest reaction of the last step is
 * therefore a measure, too. */
static bool find_sinking(kt_simulation *simulation, const double *W, const reactions *r) {
    struct kt_contacts *c = simulation->contacts;
    bool sinking = false;
    for (int i = 0; i < c->meeting; i++) {
        double size, w = kt_contact_acceleration(c, W, i, &size);
        for (int k = 0; k < r->n; k++)
            w += W[i * c->touching + c->pressing[k]] * (c->z[k] - c->limit[k] + c->slip[k]);
        size = fmax(size, W[i * c->touching + i] * simulation->event_memory[c->list[i]].size);
        kt_contact *contact = &c->item[c->list[i]];
        if (!(w < -sinks * size) || !contact->leaves)
            continue;
        contact->leaves = false;
        sinking = true;
    }
    return sinking;
}

/* Computes sqrt(x'M x). Data of the simulation belong to `model`. */
static kt_status find_norm(kt_simulation *simulation, const kt_model *model, const double *q, const double *x,
                           double *norm, kt_error *error) {
    const kt_status status = kt_kinematics_update(model, simulation->data, q, x, NULL, error);
    if (status == KT_OK)
        *norm = sqrt(2.0 * kt_kinetic_energy(model, simulation->data));
    return status;
}

/* Computes the accelerations with all contacts open, to c->a, and the equations at the velocities after impulses. */
static kt_status find_free(kt_simulation *simulation, double t, const double *y, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_contacts_let_slip(c);
    const kt_model *slipping = kt_model_switched(simulation->model, kt_contacts_set(simulation));
    kt_data_adapt(slipping, simulation->data);
    kt_simulation_use_states(simulation, y);
    kt_status status = kt_acceleration_evaluate(slipping, simulation->data, t, y, c->v, simulation->tau,
                                                simulation->external, c->a, error);
    if (status == KT_OK)
        status = find_norm(simulation, slipping, y, c->a, &c->change, error);
    return status == KT_OK ? kt_contacts_find_equations(c, simulation->model, t, y, c->v, true, error) : status;
}

/* The state of friction in row i. At its upper limit, z1 is 2 S except for rounding. There z2 decides, since variables
 * outside of Lemke's basis are exactly 0. Friction at its limit slips, against the force that is its limit. */
static kt_contact_side side_of_friction(const struct kt_contacts *c, const reactions *r, int i,
                                        const kt_contact *contact) {
    const double most = 2.0 * c->limit[i], edge = contact->leaves ? 1e-6 * most : 0.0;
    const double z1 = c->z[i], z2 = c->z[i + r->n - r->sides];
    return z2 > 0.0 || z1 >= most - edge ? KT_CONTACT_BACK : z1 > edge ? KT_CONTACT_ON : KT_CONTACT_OFF;
}

/* Solves contact forces: the touching contacts with compressive reactions, and the friction, of the set that
 * follows. */
static kt_status press(kt_simulation *simulation, double t, const double *y, const double *W, const double *u,
                       kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    reactions r;
    const kt_status status = find_free(simulation, t, y, error);
    if (status != KT_OK)
        return status;
    bool found;
    do {
        list_reactions(simulation, W, u, &r);
        found = solve_reactions(c, W, &r, &simulation->memory.contacts.pivots);
    } while (found && find_sinking(simulation, W, &r));
    if (!found)
        return kt_contacts_refuse(simulation, t, "reactions", error);
    kt_contacts_let_slip(c);
    for (int i = 0; i < r.n; i++) {
        kt_contact *contact = &c->item[c->list[c->pressing[i]]];
        contact->next = i >= r.sides    ? side_of_friction(c, &r, i, contact)
                        : c->z[i] > 0.0 ? KT_CONTACT_ON
                                        : KT_CONTACT_OFF;
    }
    return KT_OK;
}

/* Finds friction of joints that slips at no rate, since closed contacts, loops or other sticking friction hold the
 * joint. Its row then depends on theirs: orthogonalisation in the metric of W leaves nothing of it. Its rate is
 * rounding until its constraints move. Slip has reversed if it is against its direction and faster than rest. */
static uint64_t find_held(const kt_simulation *simulation, const double *W) {
    const struct kt_contacts *c = simulation->contacts;
    const int m = c->touching;
    int *row = c->independent, n = 0;
    uint64_t held = 0;
    for (int pass = 0; pass < 2; pass++) /* closed contacts first */
        for (int i = 0; i < m; i++) {
            const kt_contact *item = &c->item[c->list[i]];
            const bool closed = kt_contact_is_closed(simulation->model, item);
            const bool slips = i >= c->meeting && i < c->resting && !closed;
            double left = W[i * m + i];
            if (pass == 0 ? !closed : !slips || fabs(c->v[item->v]) > kt_contact_resting)
                continue;
            double *L = c->L + (ptrdiff_t)n * m;
            for (int j = 0; j < n; j++) {
                const double *other = c->L + (ptrdiff_t)j * m;
                double sum = W[i * m + row[j]];
                for (int k = 0; k < j; k++)
                    sum -= L[k] * other[k];
                L[j] = sum / other[j];
                left -= L[j] * L[j];
            }
            const bool depends = !(left > rounding * W[i * m + i]);
            if (pass > 0 && depends)
                held |= item->bit;
            if (pass == 0 && !depends) {
                L[n] = sqrt(left);
                row[n++] = i;
            }
        }
    return held;
}

/* press if contacts with friction are among those that touch (contact_friction.c). */
static kt_status press_with_friction(kt_simulation *simulation, double t, const double *W, double *u, double *lost,
                                     kt_error *error) {
    const double *y = kt_integrator_state(simulation->integrator);
    kt_status status = find_free(simulation, t, y, error);
    if (status == KT_OK)
        status = kt_contacts_press(simulation, t, W, u, error);
    if (status != KT_ERROR_CONSTRAINT || !kt_contacts_jam(simulation, W, u, lost))
        return status;
    for (int k = 0; k < simulation->contacts->n; k++)
        simulation->contacts->item[k].leaves = false;
    status = find_free(simulation, t, y, error);
    return status == KT_OK ? kt_contacts_press(simulation, t, W, u, error) : status;
}

/* Counts changes. Switches and jumps open all contacts first: a contact that is closed again behind them is not
 * counted. */
static void count_changes(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    kt_contact_counts *counts = &simulation->memory.contacts;
    const kt_model *model = simulation->model;
    for (int k = 0; k < c->n; k++) {
        const kt_contact *contact = &c->item[k];
        const bool was = simulation->contact_state[k].counted, is = kt_contact_is_closed(model, contact);
        simulation->contact_state[k].counted = is;
        counts->closings += k < c->sides && is && !was;
        counts->openings += k < c->sides && was && !is;
        counts->sticks += k >= c->sides && is && !was;
        counts->slips += k >= c->sides && was && !is &&
                         (kt_contact_rubs(c, k) ? kt_contact_is_closed(model, &c->item[contact->of])
                                                : !kt_contact_is_released(contact));
    }
}

/* Commits contacts: the model of the set that follows, and the state after impulses. approach: the speed before
 * the impulses; 0: no impulses. */
static kt_status settle(kt_simulation *simulation, double lost, double approach, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double t = kt_integrator_time(simulation->integrator), *from = kt_integrator_state(simulation->integrator);
    const bool balanced = kt_simulation_is_balanced(simulation), accounts = balanced || simulation->watches_works;
    const uint64_t set = kt_contacts_set(simulation);
    kt_simulation_energy before = {0.0, 0.0}, after = {0.0, 0.0};
    kt_status status = KT_OK;
    bool changed = false;
    if (KT_HAS_JACOBIAN && simulation->watches_works)
        kt_simulation_complete_powers(simulation);
    if (accounts)
        status = kt_simulation_find_energy(simulation, from, &before, error);
    if (status != KT_OK)
        return status;
    const kt_model *old = simulation->model;
    kt_simulation_take_model(simulation, kt_contacts_model(simulation, false));
    memcpy(simulation->y, from, simulation->size.n * sizeof(double));
    memcpy(simulation->y + simulation->size.nq, c->v, simulation->size.nv * sizeof(double));
    status = kt_simulation_project(simulation, t, simulation->y, &changed, error);
    status = kt_contacts_check_rates(simulation, t, simulation->y + simulation->size.nq, approach, status, error);
    if (status == KT_OK && accounts)
        status = kt_simulation_find_energy(simulation, simulation->y, &after, error);
    if (status == KT_OK && balanced) {
        double *work = simulation->y + simulation->size.work;
        const double gain = after.kinetic + after.potential - before.kinetic - before.potential;
        const bool driven =
            c->all->driven || simulation->model->driven; /* a moving contact may be open again after a bounce */
        work[0] += driven ? lost : fmax(-gain, 0.0);
        work[1] += driven ? gain + lost : fmax(gain, 0.0);
    }
    if (status == KT_OK)
        status = kt_simulation_land(simulation, simulation->y, before.kinetic + before.potential,
                                    after.kinetic + after.potential, error);
    if (status != KT_OK) {
        kt_simulation_take_model(simulation, old);
        return status;
    }
    simulation->memory.set = set;
    for (int k = 0; k < c->n; k++)
        simulation->contact_state[k].closed = kt_contact_is_closed(simulation->model, &c->item[k]);
    simulation->memory.contacts.dissipated += lost;
    count_changes(simulation);
    return KT_OK;
}

/* ---- at an instant ----------------------------------------------------------------------------------------------- */

/* A contact that is left open while it touches, or friction that slips from rest, moves to the free side first, or
 * penetrates (event.c). Closing others may have moved an open contact beyond its boundary, by the tolerance of
 * touching. It then closes at its present gap, since a bounce may be lower than that. */
static kt_status watch_open(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *y = kt_integrator_state(simulation->integrator);
    const kt_status status =
        kt_contacts_find_equations(c, simulation->model, t, y, y + simulation->size.nq, false, error);
    for (int i = 0; status == KT_OK && i < c->resting; i++) {
        const int k = c->list[i];
        if (kt_contact_is_closed(simulation->model, &c->item[k]))
            continue;
        if (i < c->meeting)
            simulation->contact_state[k].closes_at = fmin(c->gap[k], 0.0) - kt_contact_margin(simulation, i);
        if (i < c->meeting || fabs(c->v[c->item[k].v]) <= kt_contact_resting)
            simulation->event_memory[k].side = -1;
    }
    for (int k = c->sides; k < c->n; k++)
        simulation->contact_state[k].closes_at = -HUGE_VAL;
    (void)kt_contacts_follow_slip(simulation);
    simulation->contact_time = (double)NAN; /* values of this state have changed */
    return status;
}

static kt_status resolve(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_simulation_recall_corners(simulation);
    const double t = kt_simulation_time_inside(simulation, kt_integrator_time(simulation->integrator));
    const double *y = kt_integrator_state(simulation->integrator);
    const kt_model *model = simulation->model, *open = kt_model_switched(model, model->set & ~c->mask);
    double *W = c->W, *u = c->u, lost = 0.0, approach = 0.0, size;
    for (int k = 0; k < c->n; k++)
        simulation->event_memory[k].side = 1; /* gaps and reactions are not negative from now on */
    kt_simulation_clear_jump(simulation);
    kt_copy(c->v, y + simulation->size.nq, simulation->size.nv * sizeof(double));
    kt_status status = kt_contacts_find_equations(c, model, t, y, c->v, true, error);
    if (status == KT_OK)
        status = find_touching(simulation, t, error);
    if (status == KT_OK && c->touching == 0)
        count_changes(simulation);
    if (status != KT_OK || c->touching == 0)
        return status;
    simulation->cached = KT_CACHED_NOTHING;
    kt_data_adapt(open, simulation->data);
    status = find_response(simulation, open, t, y, W, error);
    if (status == KT_OK)
        status = find_norm(simulation, open, y, c->v, &c->speed, error);
    for (int i = 0; status == KT_OK && i < c->touching; i++) {
        u[i] = kt_contact_rate(c, W, i, &size);
        if (fabs(u[i]) <= rounding * size)
            u[i] = 0.0;
        approach = i < c->meeting ? fmax(approach, -u[i]) : approach;
    }
    for (int k = 0; approach > 0.0 && k < c->sides; k++) /* after impulses, all reactions are possible */
        c->item[k].leaves = false;
    const bool rough = c->touching > c->resting; /* a contact with friction touches */
    if (status == KT_OK && approach > 0.0)
        status = kt_contacts_check_levers(simulation, open, t, W, u, error);
    if (status == KT_OK && approach > 0.0)
        status = kt_contacts_strike(simulation, t, W, u, &lost, error);
    if (status == KT_OK && rough)
        status = press_with_friction(simulation, t, W, u, &lost, error);
    else if (status == KT_OK)
        status = press(simulation, t, y, W, u, error);
    kt_data_adapt(model, simulation->data);
    if (status == KT_OK)
        status = settle(simulation, lost, approach, error);
    if (status != KT_OK)
        return status;
    simulation->memory.held = find_held(simulation, W);
    return watch_open(simulation, t, error);
}

static bool rest(kt_simulation *simulation, size_t k) {
    struct kt_contacts *c = simulation->contacts;
    const kt_contact *item = &c->item[(int)k < c->sides || c->item[k].of < 0 ? k : (size_t)c->item[k].of];
    const bool is_open = !kt_contact_is_closed(simulation->model, &c->item[k]);
    const bool may = is_open && simulation->model->loop[item->loop].rest_velocity > 0.0;
    c->rests = may && (int)k < c->sides;
    c->stops = may && kt_contact_rubs(c, (int)k);
    simulation->memory.contacts.rested += c->rests || c->stops;
    return c->rests || c->stops;
}

static const kt_contact_calls calls = {.rest = rest,
                                       .open = open_all,
                                       .resolve = resolve,
                                       .follow = kt_contacts_put_directions,
                                       .check = kt_contacts_check_record,
                                       .keep = kt_simulation_keep,
                                       .take_back = kt_simulation_take_change_back,
                                       .renew = kt_contacts_renew_model};

/* Lists the contacts, and friction after them. */
static void list_items(kt_simulation *simulation, struct kt_contacts *c) {
    const kt_model *model = simulation->model;
    const kt_switches *switches = &model->family->switches;
    int k = 0;
    for (int friction = 0; friction < 2; friction++) {
        for (size_t i = 0; i < model->n.loop; i++) {
            const kt_loop_record *loop = &model->loop[i];
            if (!is_watched(loop) || (loop->friction > 0) != (friction > 0))
                continue;
            const int effect = loop->friction - 1, back = friction ? kt_effect_switch(model, effect) : -1;
            c->item[k] = (kt_contact){.simulation = simulation,
                                      .loop = (int)i,
                                      .index = k,
                                      .bit = kt_loop_switch(model, (int)i) < switches->own
                                                 ? kt_switch_bits(model, kt_loop_switch(model, (int)i))
                                                 : 0,
                                      .sign = loop->side == KT_SIDE_BELOW ? -1.0 : 1.0,
                                      .effect = effect,
                                      .back = back >= 0 ? (uint64_t)1 << back : 0,
                                      .of = -1};
            c->mask |= kt_switch_bits(model, kt_loop_switch(model, (int)i)) | c->item[k].back;
            c->back |= c->item[k].back;
            for (int j = 0; friction && j < c->sides; j++)
                if (model->loop[c->item[j].loop].rubs == loop->friction) {
                    c->item[j].of = k;
                    c->item[k].of = j;
                }
            k++;
        }
        c->sides = friction ? c->sides : k;
    }
}

/* Returns an error if the mass matrix has no inverse at any position. */
static kt_status refuse_massless(const kt_simulation *simulation, const struct kt_contacts *c, kt_error *error) {
    const kt_model *model = simulation->model;
    char where[KT_WHERE_SIZE];
    snprintf(where, sizeof where, "contact '%.60s'", kt_loop_name(model, c->item[0].loop));
    return kt_massless_refuse(
        kt_model_switched(model, model->set & ~c->mask), where,
        "impacts of a hard contact, stop or slack rope, and friction that sticks, are found by the "
        "inverse of the mass matrix, which there is not (elastic ones, with stiffness, need none)",
        error);
}

static void init_solvers(struct kt_contacts *c, const kt_contact_sizes *s) {
    const size_t phase = kt_impact_phase_size(s->n, s->list), items = 2 * s->n - s->list;
    c->compression = kt_impact_phase_init(s->n, s->list, c->phase_memory);
    c->phase = kt_impact_phase_init(s->n, s->list, c->phase_memory + phase);
    if (s->problem == 0)
        return;
    c->problem = kt_coulomb_init(items, s->list, c->problem_memory);
    c->solution = kt_coulomb_solution_init(items, s->list, c->solution_memory);
    c->solver = kt_coulomb_solver_init(items, s->list, c->solver_memory);
}

kt_status kt_contacts_init(kt_simulation *simulation, kt_error *error) {
    const kt_model *model = simulation->model;
    const size_t n = kt_contacts_of(model);
    const kt_contact_sizes s = sizes_of(model, n);
    struct kt_contacts *c = (struct kt_contacts *)(void *)simulation->contact_memory;
    (void)lay_out(c, &s);
    c->n = (int)n;
    c->inverse_size = s.inverse;
    simulation->contact_time = (double)NAN;
    c->mask = c->back = 0;
    init_solvers(c, &s);
    simulation->contacts = c;
    kt_contacts_init_masks(simulation);
    list_items(simulation, c);
    c->all = kt_model_switched(model, (model->set | c->mask) & ~c->back);
    for (int k = 0; k < c->n; k++) { /* compile/hard.c */
        const uint64_t both = c->item[k].bit | c->item[k].back;
        const bool is_dry = k >= c->sides && !kt_contact_rubs(c, k);
        simulation->contact_friction |= is_dry ? both : 0;
        if (k < c->sides ? !model->loop[c->item[k].loop].contact : is_dry && (model->set & both) == both)
            simulation->contact_released |= both; /* nothing if contacts share bits */
    }
    simulation->memory.released = simulation->contact_released;
    c->rubs = c->rests = c->stops = false;
    for (int k = c->sides; k < c->n; k++) /* a loop that is off has no links */
        if (kt_contact_rubs(c, k))
            c->rubs = true;
        else
            c->item[k].v = c->all->link[c->all->loop[c->item[k].loop].link[0]].v;
    kt_status status = refuse_massless(simulation, c, error);
    if (status == KT_OK)
        status = kt_data_init_followed(c->all, c->data_memory, s.data, &c->data, error);
    for (int k = 0; status == KT_OK && k < c->n; k++) {
        const kt_event event = {.name = kt_loop_name(model, c->item[k].loop),
                                .function = watch_contact,
                                .action = act,
                                .user = &c->item[k],
                                .record = simulation->records_contacts,
                                .direction = KT_DIRECTION_FALLING};
        status = kt_simulation_event_add(simulation, &event, error);
    }
    if (status == KT_OK && c->rubs) {
        c->watch = *simulation->watch;
        c->begin = c->watch.begin;
        c->watch.begin = kt_contacts_begin_step;
        simulation->watch = &c->watch;
    }
    simulation->contact_count = n;
    simulation->contact_mask = c->mask;
    simulation->contact_margin = 2.0 * touching * fmax(1.0, c->all->length);
    simulation->contact_calls = &calls;
    simulation->memory.contacts.count = n;
    return status;
}

/* ---- released ---------------------------------------------------------------------------------------------------- */

uint64_t kt_simulation_released(const kt_simulation *simulation) {
    const bool has = simulation != NULL && simulation->contacts != NULL;
    return has ? simulation->memory.released & ~simulation->contacts->back : 0;
}

kt_status kt_simulation_release(kt_simulation *simulation, uint64_t set, kt_error *error) {
    if (KT_IS_MISSING(error, simulation))
        return KT_ERROR_ARGUMENT;
    const uint64_t before = simulation->memory.released;
    const struct kt_contacts *c = simulation->contacts;
    uint64_t known = 0, after = set;
    for (int k = 0; c != NULL && k < c->n; k++) {
        known |= kt_contact_rubs(c, k) ? 0 : c->item[k].bit;
        after |= (set & c->item[k].bit) != 0 ? c->item[k].back : 0;
    }
    if ((set & ~known) != 0)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "kt_simulation_release",
            "of the set 0x%llx only 0x%llx are hard stops, contacts, slack ropes, or joint friction that sticks",
            (unsigned long long)set, (unsigned long long)(set & known));
    if (after == before)
        return KT_OK;
    simulation->memory.released = after;
    simulation->contact_time = (double)NAN;
    const kt_status status = kt_simulation_switch(simulation, simulation->model->set, NULL, error);
    if (status != KT_OK)
        simulation->memory.released = before;
    return status;
}

/* ---- for callers ------------------------------------------------------------------------------------------------- */

kt_contact_counts kt_simulation_contacts(const kt_simulation *simulation) {
    return simulation != NULL ? simulation->memory.contacts : (kt_contact_counts){.impacts = 0};
}
