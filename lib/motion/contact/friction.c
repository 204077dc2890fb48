/* Impacts and reactions of touching contacts with Coulomb's friction, with cone/coulomb.h.
 *
 * Impacts: in each phase (impact.c), Coulomb's law relates the impulses and the slip at its end, in one step. A
 * contact sticks if its impulse lies in the cone, and otherwise slips against the impulse. Dry friction of joints has
 * no impulse.
 *
 * Reactions, at accelerations: a slipping contact has a given direction of friction. A resting contact sticks or begins
 * to slip against its friction. Dry friction of joints is among the items. Blocks of W are solved one after the other.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "cone/coulomb.h"
#include "contact/contact.h"
#include "kinetree/algebra.h"

#include <math.h>

/* The times that friction reaches its limit within an instant before it is held, and predictions that are repeated. */
enum { LIMITS = 3, PREDICTIONS = 2 };
/* Slip of up to `about` times the speed of a wedged contact is about as fast. */
static const double about = 10.0;
/* The approach of a contact that is wedged, relative to its slip. */
static const double small = 1e-9;

static double entry_of_W(const void *user, int line, int column) { return kt_contacts_product(user, line, column); }

/* Begins a problem of rows of the list. */
static kt_coulomb *begin_coulomb(struct kt_contacts *c) {
    kt_coulomb *p = c->problem;
    p->n = p->rows = 0;
    p->W = kt_contacts_are_stored(c) ? c->W : NULL;
    p->entry = entry_of_W;
    p->user = c;
    p->stride = c->touching;
    return p;
}

static int add_line(kt_coulomb *p, int line) {
    p->line[p->rows] = line;
    return p->rows++;
}

/* Adds the contact or the dry friction of a row of the list, with the rows of its friction. */
static kt_coulomb_item *add_item(kt_coulomb *p, const kt_simulation *simulation, int line) {
    struct kt_contacts *c = simulation->contacts;
    const int friction = line < c->meeting ? kt_contact_friction_line(c, line) : -1;
    kt_coulomb_item *item = &p->item[p->n];
    c->posed[p->n++] = line;
    *item = (kt_coulomb_item){.type = KT_COULOMB_FRICTIONLESS, .row = add_line(p, line)};
    if (friction >= 0) {
        item->type = KT_COULOMB_CONE;
        item->friction = kt_contact_coefficient(simulation->model, &c->item[c->list[friction]]);
        item->across = add_line(p, friction);
        (void)add_line(p, friction + 1);
    }
    return item;
}

/* ---- impacts ----------------------------------------------------------------------------------------------------- */

/* Normal rates of the problem are measured from their bounds, so that p - least is complementary to u - bound. Behind
 * the solution they are absolute again, and exactly the bound where a contact presses. */
bool kt_contacts_solve_phase(kt_simulation *simulation, double *u, double *p) {
    struct kt_contacts *c = simulation->contacts;
    double size;
    kt_coulomb *of = begin_coulomb(c);
    for (int i = 0; i < c->meeting; i++)
        add_item(of, simulation, i)->least = c->least[i];
    for (int j = 0; j < of->rows; j++)
        of->b[j] = u[of->line[j]];
    for (int i = 0; i < of->n; i++) {
        kt_coulomb_item *item = &of->item[i];
        of->b[item->row] -= c->bound[i];
        for (int k = 0; k < kt_coulomb_rows(item); k++) {
            (void)kt_contact_rate(c, of->line[kt_coulomb_row_of(item, k)], &size);
            item->size = fmax(item->size, size);
        }
    }
    if (!kt_coulomb_solve(of, c->solver, false, c->solution, &simulation->memory.contacts.pivots))
        return false;
    for (int j = 0; j < of->rows; j++) {
        p[of->line[j]] = c->solution->p[j];
        u[of->line[j]] = c->solution->u[j];
    }
    for (int i = 0; i < of->n; i++)
        u[i] = p[i] > c->least[i] ? c->bound[i] : u[i] + c->bound[i];
    return true;
}

/* Poses the problem of an impact without approach. `wedged` is the row of a contact, or -1. This contact is given an
 * approach rate that is small compared with its slip, so that zero impulse is not a solution. Friction is larger by the
 * part `excess`. */
static kt_coulomb *pose_jam(const kt_simulation *simulation, int wedged, double excess) {
    struct kt_contacts *c = simulation->contacts;
    kt_coulomb *p = begin_coulomb(c);
    for (int i = 0; i < c->meeting; i++)
        if (c->u[i] <= kt_contact_rest(simulation, i))
            add_item(p, simulation, i)->friction *= 1.0 + excess;
    for (int j = 0; j < p->rows; j++)
        p->b[j] = c->u[p->line[j]];
    for (int i = 0; i < p->n; i++) {
        kt_coulomb_item *item = &p->item[i];
        for (int k = 0; k < kt_coulomb_rows(item); k++)
            item->size = fmax(item->size, fabs(p->b[kt_coulomb_row_of(item, k)]));
        const bool is_wedged = c->posed[i] == wedged;
        p->b[item->row] = is_wedged ? -small * kt_hypot(p->b[item->across], p->b[item->across + 1]) : 0.0;
    }
    return p;
}

/* Finds impulses that do not raise the energy. *energy: the energy that the impulses dissipate. */
static bool solve_jam(kt_simulation *simulation, kt_coulomb *p, double *energy) {
    struct kt_contacts *c = simulation->contacts;
    double most = 0.0;
    *energy = 0.0;
    if (p->n == 0 || !kt_coulomb_solve(p, c->solver, false, c->solution, &simulation->memory.contacts.pivots))
        return false;
    for (int j = 0; j < p->rows; j++) {
        most = fmax(most, fabs(c->solution->p[j]));
        *energy -= 0.5 * c->solution->p[j] * (p->b[j] + c->solution->u[j]);
    }
    return most > 0.0 && *energy >= 0.0;
}

/* Whether the impulses of the solution change the slip of row i, and not just its approach. */
static bool has_stopped(const struct kt_contacts *c, int i) {
    const int line = kt_contact_friction_line(c, i);
    const kt_coulomb *p = c->problem;
    for (int k = 0; k < p->n; k++)
        if (c->posed[k] == i) {
            const double *after = c->solution->u + p->item[k].across;
            return kt_hypot(after[0] - c->u[line], after[1] - c->u[line + 1]) >
                   0.1 * kt_hypot(c->u[line], c->u[line + 1]);
        }
    return false;
}

/* Finds the contacts that loops may clamp: normal impulses of any size, of all these contacts at once, change no rate,
 * so that their normal rows depend on each other. Sets their least impulses to `least`. Returns the impulse that stops
 * their slip if each contact is alone; 0 without slip. */
static double clamp_contacts(const struct kt_contacts *c, kt_coulomb *p, double least) {
    double most = 0.0;
    for (int k = 0; k < p->n; k++)
        c->solution->mode[k] = KT_COULOMB_SLIP;
    for (int k = 0; k < p->n && kt_coulomb_fits(p, c->solution); k++) {
        kt_coulomb_item *item = &p->item[k];
        if (!kt_coulomb_is_held(p, c->solution, k, 1, false))
            continue;
        item->least = least;
        if (item->type == KT_COULOMB_CONE && item->friction > 0.0)
            most = fmax(most, kt_contact_slip_speed(c, c->posed[k]) / (item->friction * kt_coulomb_weight(p, k)));
    }
    return most;
}

/* Whether the contacts with least impulses neither slip nor part. */
static bool clamped_rest(const struct kt_contacts *c, const kt_coulomb *p) {
    const double strength = kt_coulomb_strength(p, c->solution->p);
    bool rest = true;
    for (int k = 0; k < p->n; k++) {
        const double *u = c->solution->u + p->item[k].across, most = 1e-9 * kt_coulomb_rate_size(p, k, strength);
        rest = rest &&
               (!(p->item[k].least > 0.0) || (fabs(c->solution->u[p->item[k].row]) <= most &&
                                              (p->item[k].type != KT_COULOMB_CONE || kt_hypot(u[0], u[1]) <= most)));
    }
    return rest;
}

/* A bar may be normal to the face on which its body slides. Slip contradicts the bar at second order, so that no forces
 * exist. But the bar may clamp the contacts of the face with any impulses, which stop the slip. Returns the problem of
 * an impact without approach in which the contacts are clamped and stop; NULL: there is none. */
static kt_coulomb *find_clamped(kt_simulation *simulation, double *energy) {
    enum { TIMES = 6 };
    static const double factor = 8.0; /* other contacts and bodies may need larger impulses */
    struct kt_contacts *c = simulation->contacts;
    double least = clamp_contacts(c, pose_jam(simulation, -1, 0.0), 0.0);
    for (int k = 0; k < TIMES && least > 0.0; k++) {
        kt_coulomb *p = pose_jam(simulation, -1, 0.0);
        (void)clamp_contacts(c, p, least);
        if (solve_jam(simulation, p, energy) && clamped_rest(c, p))
            return p;
        least *= factor;
    }
    return NULL;
}

/* The paradox leads to the problem of an impact without approach. Zero impulse is one solution; another solution stops
 * or turns slip. If the solver finds zero impulse, the function tries to wedge one contact after the other. A step that
 * leads into the paradox ends before, where this impulse still lies beyond the cone.
 *
 * Impulses under which contacts slip on change no approach rate, (1 - G) N = 0 in the final directions of slip
 * (evaluate/slip.c). In these directions, reactions have no bound. Friction that is larger by the part `excess` turns
 * slip a little farther, so that 1 - G is about `excess` times its size, and reactions are finite. */
static kt_coulomb *find_jam(kt_simulation *simulation, double *energy) {
    static const double excess[] = {1e-2, 1.0};
    struct kt_contacts *c = simulation->contacts;
    kt_coulomb *p = c->jams ? NULL : find_clamped(simulation, energy);
    if (p != NULL)
        return p;
    p = pose_jam(simulation, -1, 1e-2);
    if (!c->jams && solve_jam(simulation, p, energy))
        return p;
    for (size_t k = 0; k < sizeof excess / sizeof *excess; k++)
        for (int i = 0; i < c->meeting; i++) {
            if ((c->jams && c->list[i] != c->wedged) || !kt_contact_row_slips(c, i) ||
                c->u[i] > kt_contact_rest(simulation, i))
                continue;
            p = pose_jam(simulation, i, excess[k]);
            if (solve_jam(simulation, p, energy) && has_stopped(c, i))
                return p;
        }
    return NULL;
}

bool kt_contacts_must_jam(const struct kt_contacts *c) {
    bool slips = false;
    for (int i = 0; c->jams && i < c->meeting; i++)
        slips = slips || (c->list[i] == c->wedged && kt_contact_row_slips(c, i));
    return slips;
}

bool kt_contacts_jam(kt_simulation *simulation, double *lost) {
    struct kt_contacts *c = simulation->contacts;
    double energy = 0.0;
    const kt_coulomb *p = find_jam(simulation, &energy);
    if (p == NULL)
        return false;
    for (int j = 0; j < p->rows; j++)
        kt_contacts_add_response(c, p->line[j], c->solution->p[j], c->v);
    for (int i = 0; i < c->touching; i++)
        for (int j = 0; j < p->rows; j++)
            c->u[i] += kt_contacts_between(c, i, p->line[j]) * c->solution->p[j];
    *lost += energy;
    simulation->memory.contacts.jammed++;
    return true;
}

/* ---- reactions --------------------------------------------------------------------------------------------------- */

/* Adds a contact that does not part. The direction of fast slip is known. Slow slip has the direction of an implicit
 * step, like the forces after this instant (slip_prediction.c): the rates are (s + tau s') / tau. Sticking in the
 * solution means that slip comes to rest within tau, not at this instant. With present directions some corners of a
 * body would press that do not press after this instant. Such corners would part and close without end. leaving: as in
 * set_problem. */
static void add_coulomb_contact(kt_coulomb *p, const kt_simulation *simulation, int line, bool leaving) {
    const struct kt_contacts *c = simulation->contacts;
    kt_coulomb_item *item = add_item(p, simulation, line);
    if ((leaving && c->item[c->list[line]].leaves) || (c->releases && c->list[line] == c->wedged))
        item->rejected = ~(1U << KT_COULOMB_OPEN);
    if (item->type != KT_COULOMB_CONE)
        return;
    const double *slip = c->u + p->line[item->across], speed = kt_hypot(slip[0], slip[1]);
    const double rest = c->rest_rate[c->item[c->list[line]].of];
    const bool is_held = (c->holds || speed <= rest) && kt_integrator_time(simulation->integrator) <
                                                            simulation->contact_state[c->item[c->list[line]].of].held;
    item->friction *= is_held ? kt_contact_holding : 1.0;
    const double stops = c->stops ? kt_contact_stopping_speed(simulation, c->list[line])
                                  : kt_contact_loop(simulation, line)->rest_velocity;
    const bool ends = c->stops || c->item[c->item[c->list[line]].of].meets;
    const bool slips = !is_held && speed > (ends ? fmax(stops, rest) : rest);
    double *ahead = &c->ahead[p->n - 1];
    *ahead = slips ? *ahead : 0.0;
    if (slips && !(*ahead > 0.0)) {
        item->type = KT_COULOMB_SLIPS;
        item->e[0] = slip[0] / speed;
        item->e[1] = slip[1] / speed;
    } else if (!slips && leaving && c->item[c->item[c->list[line]].of].leaves) {
        item->rejected |= 1U << KT_COULOMB_STICK;
    }
}

/* Adds the dry friction of a joint, with its largest force. leaving: friction that leaves may not stick. */
static void add_dry(kt_coulomb *p, const kt_simulation *simulation, int line, bool leaving) {
    const kt_contact *friction = &simulation->contacts->item[simulation->contacts->list[line]];
    kt_coulomb_item *item = add_item(p, simulation, line);
    item->type = KT_COULOMB_DRY;
    item->friction = kt_contact_limit(simulation->model, friction);
    item->rejected = leaving && friction->leaves ? 1U << KT_COULOMB_STICK : 0;
}

/* Sets the rows of the present block that take part, and their accelerations without reactions. At first, contacts that
 * leave have no reaction, and friction that leaves does not stick. If this has no solution, the problem is set `again`:
 * leaving contacts may stay, since forces have been redistributed, and contacts that part more slowly than their rest
 * velocity are left out. Corners that part at different speeds cannot always rest together: their rates are not those
 * of rest. */
static kt_coulomb *set_problem(const kt_simulation *simulation, bool again) {
    struct kt_contacts *c = simulation->contacts;
    double size;
    kt_coulomb *p = begin_coulomb(c);
    for (int i = 0; i < c->resting; i++) {
        if (c->block[i] != c->present)
            continue;
        (void)kt_contact_rate(c, i, &size);
        if (i >= c->meeting && fabs(c->v[c->item[c->list[i]].v]) <= c->rest_rate[c->list[i]])
            add_dry(p, simulation, i, !again);
        else if (i < c->meeting &&
                 c->u[i] <= fmax(again ? 0.0 : kt_contact_rest(simulation, i), kt_contact_rounding * size))
            add_coulomb_contact(p, simulation, i, !again);
    }
    for (int k = 0; k < p->n; k++) {
        kt_coulomb_item *item = &p->item[k];
        for (int r = 0; r < kt_coulomb_rows(item); r++) {
            const int j = kt_coulomb_row_of(item, r);
            const double free = kt_contact_acceleration(c, p->line[j], &size);
            const double slip = r > 0 && c->ahead[k] > 0.0 ? c->u[p->line[j]] / c->ahead[k] : 0.0;
            p->b[j] = (fabs(free) <= kt_contact_rounding * size ? 0.0 : free) + slip;
            item->size = fmax(item->size, fmax(size, fabs(slip)));
        }
    }
    /* At rest, the model has friction of joints that slips forwards. */
    for (int k = 0; k < p->n; k++)
        for (int j = 0; p->item[k].type == KT_COULOMB_DRY && j < p->rows; j++)
            p->b[j] += kt_coulomb_entry(p, j, p->item[k].row) *
                       kt_contact_slip(simulation->model, &c->item[c->list[c->posed[k]]]);
    return p;
}

/* The change of slip by a unit of normal force, mu (W_11 + W_22) / 2 with the two tangential rows of item i. */
static double slip_response(const kt_simulation *simulation, int i) {
    const struct kt_contacts *c = simulation->contacts;
    const int across = c->problem->line[c->problem->item[i].across];
    return 0.5 * kt_contact_coefficient(simulation->model, &c->item[c->item[c->list[c->posed[i]]].of]) *
           (kt_contacts_own(c, across) + kt_contacts_own(c, across + 1));
}

/* Sets the direction in which the contact of item i begins to slip, and its normal force. If the solution is that of an
 * implicit step, the direction is the present one. */
static void begin_slip(kt_simulation *simulation, int i) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_coulomb_item *item = &c->problem->item[i];
    const kt_contact *contact = &c->item[c->list[c->posed[i]]];
    const int across = c->problem->line[item->across];
    kt_contact_memory *memory = &simulation->contact_state[contact->index];
    memcpy(memory->slip, c->solution->e[i], sizeof memory->slip);
    for (int k = 0; c->ahead[i] > 0.0 && k < 2; k++)
        memory->slip[k] = c->u[across + k] / kt_hypot(c->u[across], c->u[across + 1]);
    memory->load = c->solution->p[item->row];
    memory->response = slip_response(simulation, i);
    memory->block = c->list[c->posed[0]];
}

/* Sets the contacts of the set that follows, and the directions of slip. Friction may be at its limit up to rounding,
 * and wedge its contact if it slips. If friction has reached its limit LIMITS times at this instant, and sticks
 * nevertheless, friction sticks for a short time. */
static void apply(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    const kt_coulomb *p = c->problem;
    for (int i = 0; i < p->n; i++) {
        kt_contact *contact = &c->item[c->list[c->posed[i]]];
        const kt_coulomb_mode mode = c->solution->mode[i];
        const kt_coulomb_type type = p->item[i].type;
        simulation->contact_state[contact->index].shared = c->solution->shares;
        if (type == KT_COULOMB_DRY) {
            contact->next = mode == KT_COULOMB_STICK       ? KT_CONTACT_ON
                            : mode == KT_COULOMB_SLIP_BACK ? KT_CONTACT_BACK
                                                           : KT_CONTACT_OFF;
            continue;
        }
        if (mode == KT_COULOMB_OPEN)
            continue;
        contact->next = KT_CONTACT_ON;
        if (type == KT_COULOMB_CONE && mode == KT_COULOMB_STICK && !(c->ahead[i] > 0.0)) {
            c->item[contact->of].next = KT_CONTACT_ON;
            simulation->contact_state[contact->index].turns = 0;
            if (simulation->contact_state[contact->of].left >= LIMITS)
                kt_contact_hold_turning(simulation, contact->of);
        } else if (type != KT_COULOMB_FRICTIONLESS)
            begin_slip(simulation, i);
    }
}

/* Whether a contact that is released accelerates into its boundary. */
static bool closes_released(const struct kt_contacts *c) {
    const kt_coulomb *p = c->problem;
    const double strength = c->releases ? kt_coulomb_strength(p, c->solution->p) : 0.0;
    bool closes = false;
    for (int i = 0; c->releases && i < p->n; i++)
        closes =
            closes || (c->list[c->posed[i]] == c->wedged &&
                       !(c->solution->u[p->item[i].row] > -kt_contact_rounding * kt_coulomb_rate_size(p, i, strength)));
    return closes;
}

/* Solves the problem of set_problem. Returns whether there is a solution. */
static bool solve_problem(kt_simulation *simulation, bool again) {
    struct kt_contacts *c = simulation->contacts;
    return kt_coulomb_solve(set_problem(simulation, again), c->solver, true, c->solution,
                            &simulation->memory.contacts.pivots);
}

/* The rate at which friction changes slip in a solution in present directions, m/s^2. */
static double find_friction_rate(const kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_coulomb *p = c->problem;
    double rate = 0.0;
    for (int i = 0; i < p->n; i++)
        if (p->item[i].type == KT_COULOMB_SLIPS)
            rate += c->solution->p[p->item[i].row] * slip_response(simulation, i);
    return rate;
}

/* Finds the largest tau of slow slip from a solution in present directions, in which friction changes slip at the rate
 * `most`. Slow slip sticks in `held`. Returns whether some slip is predicted. */
static bool hold_slow_items(const kt_simulation *simulation, double most, kt_coulomb_solution *held) {
    struct kt_contacts *c = simulation->contacts;
    kt_coulomb *p = c->problem;
    bool any = false;
    kt_coulomb_copy(p, c->solution, held);
    for (int i = 0; i < p->n; i++) {
        kt_coulomb_item *item = &p->item[i];
        const double *slip = c->u + p->line[item->across];
        if (held->mode[i] == KT_COULOMB_SLIP && item->type == KT_COULOMB_CONE)
            held->mode[i] = KT_COULOMB_STICK;
        if (item->type != KT_COULOMB_SLIPS)
            continue;
        c->ahead[i] = kt_contacts_prediction_time(simulation, kt_hypot(slip[0], slip[1]), most);
        item->type = c->ahead[i] > 0.0 ? KT_COULOMB_CONE : KT_COULOMB_SLIPS;
        any = any || c->ahead[i] > 0.0;
    }
    return any;
}

/* Limits tau of slow slip as steps do: `ahead` if slip grows, `fading` if not. most: as in hold_slow_items. */
static void limit_prediction_times(const kt_simulation *simulation, double most, kt_coulomb_solution *held) {
    struct kt_contacts *c = simulation->contacts;
    const kt_coulomb *p = c->problem;
    const double friction = kt_contacts_is_unresolved(simulation, most) ? most : HUGE_VAL;
    bool holds = true;
    int slow = 0;
    kt_coulomb_linear(p, held);
    for (int i = 0; i < p->n; i++) {
        const bool is_held = c->ahead[i] > 0.0 && held->mode[i] == KT_COULOMB_STICK;
        slow += is_held;
        holds = holds && (!is_held || kt_slip_excess(&p->item[i], held->p) > 0.0);
    }
    for (int i = 0; i < p->n; i++) {
        const kt_coulomb_item *item = &p->item[i];
        const double *slip = c->u + p->line[item->across], *a = c->solution->u + item->across;
        const double speed = kt_hypot(slip[0], slip[1]);
        const kt_slip_fate of = {.speed = speed,
                                 .slowing = -item->e[0] * a[0] - item->e[1] * a[1],
                                 .largest = c->ahead[i],
                                 .adaptive = kt_contacts_adaptive_time(simulation, speed),
                                 .friction = friction};
        c->fading[i] = 0.0;
        if (!(c->ahead[i] > 0.0))
            continue;
        c->fading[i] = kt_slip_limited_time(p, i, held->p, slow, &of, holds, true);
        c->ahead[i] = kt_slip_limited_time(p, i, held->p, slow, &of, holds, false);
    }
}

/* Finds the slip that does not grow, although the prediction assumed growth. Returns whether there is any. */
static bool find_fading_slip(const struct kt_contacts *c) {
    const kt_coulomb *p = c->problem;
    bool any = false;
    for (int i = 0; i < p->n; i++) {
        const double *slip = c->u + p->line[p->item[i].across], *a = c->solution->u + p->item[i].across;
        if (c->ahead[i] == c->fading[i] ||
            !(c->ahead[i] * (slip[0] * a[0] + slip[1] * a[1]) < slip[0] * slip[0] + slip[1] * slip[1]))
            continue;
        c->ahead[i] = c->fading[i];
        any = true;
    }
    return any;
}

/* How many contacts at rest begin to slip in the solution. */
static int count_beginning(const struct kt_contacts *c) {
    int count = 0;
    for (int i = 0; i < c->problem->n; i++)
        count += c->problem->item[i].type == KT_COULOMB_CONE && !(c->ahead[i] > 0.0) &&
                 c->solution->mode[i] == KT_COULOMB_SLIP;
    return count;
}

/* Solves the problem with the predictions of steps, from a solution in present directions. Returns false if this has no
 * solution. A contact may stick that begins to slip in present directions. This is no solution either, because steps in
 * which the contact sticks predict less slip, and would let it slip again. */
static bool solve_predicted(kt_simulation *simulation, bool again) {
    struct kt_contacts *c = simulation->contacts;
    const int begin = count_beginning(c);
    const double most = find_friction_rate(simulation);
    if (!kt_coulomb_fits(c->problem, c->solution) || !hold_slow_items(simulation, most, c->solver->other))
        return true;
    limit_prediction_times(simulation, most, c->solver->other);
    bool found = solve_problem(simulation, again);
    for (int i = 0; found && i < PREDICTIONS && find_fading_slip(c); i++)
        found = solve_problem(simulation, again);
    return found && count_beginning(c) >= begin;
}

/* Solves the problem of one attempt. Slow slip has present directions at first, and then, with `predicts`, the
 * directions that steps predict. again: as in set_problem. */
static bool solve_attempt(kt_simulation *simulation, bool again, bool predicts) {
    struct kt_contacts *c = simulation->contacts;
    kt_clear(c->ahead, (size_t)c->resting * sizeof *c->ahead);
    return solve_problem(simulation, again) && (!predicts || solve_predicted(simulation, again)) && !closes_released(c);
}

/* Counts a solution that is one of several motions. */
static void count_undecided(kt_simulation *simulation, double t) {
    const struct kt_contacts *c = simulation->contacts;
    kt_contact_counts *counts = &simulation->memory.contacts;
    if (counts->undecided++ == 0) {
        counts->undecided_time = t;
        counts->undecided_loop = c->item[c->list[c->posed[c->solution->differs]]].loop;
    }
    counts->redundant += c->solution->redundant;
}

/* Lists the rows that may have a force by blocks of W. Contacts that leave may couple bodies, but a row without a force
 * couples nothing. Returns the number of blocks. */
static int list_blocks(const kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    c->present = 0;
    memset(c->block, 0, (size_t)c->resting * sizeof *c->block);
    kt_clear(c->ahead, (size_t)c->resting * sizeof *c->ahead);
    const kt_coulomb *p = set_problem(simulation, false);
    int *place = c->solver->place, *end = c->solver->end;
    if (p->W == NULL || p->n < 2)
        return 1;
    memset(c->block, -1, (size_t)c->resting * sizeof *c->block);
    const int blocks = kt_coulomb_list_blocks(p, place, end);
    for (int k = 0, i = 0; k < blocks; k++)
        for (; i < end[k]; i++)
            c->block[c->posed[place[i]]] = k;
    return blocks;
}

/* Finds the contacts in the block of the wedged contact that slip at most about as fast, and holds their friction
 * constant. */
static void hold_slow_slip(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    for (int w = 0; w < c->meeting; w++) {
        const double rest = kt_contact_loop(simulation, w)->rest_velocity;
        const double most = c->list[w] == c->wedged ? about * fmax(kt_contact_slip_speed(c, w), rest) : -1.0;
        for (int i = 0; i < c->meeting; i++)
            if (c->block[i] == c->block[w] && kt_contact_friction_line(c, i) >= 0 &&
                kt_contact_slip_speed(c, i) <= most)
                kt_contact_hold(simulation, c->item[c->list[i]].of);
    }
}

/* Solves the forces of the present block. Returns whether there is a solution. Steps behind this instant predict slow
 * slip. Only if predicted directions have no solution, also with contacts that leave, present directions are used. */
static bool solve_block(kt_simulation *simulation, double t) {
    struct kt_contacts *c = simulation->contacts;
    if (!solve_attempt(simulation, false, true) && !solve_attempt(simulation, true, true) &&
        !solve_attempt(simulation, false, false) && !solve_attempt(simulation, true, false))
        return false;
    if (c->solution->count > 1)
        count_undecided(simulation, t);
    simulation->memory.contacts.shared += c->solution->shares && !kt_coulomb_is_unique(c->problem, c->solution);
    apply(simulation);
    for (int i = 0; i < c->problem->n; i++)
        if (c->posed[i] < c->meeting)
            c->w[c->posed[i]] = c->solution->u[c->problem->item[i].row];
    return true;
}

kt_status kt_contacts_solve_forces(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const int blocks = list_blocks(simulation);
    for (int i = 0; i < c->meeting; i++)
        c->w[i] = HUGE_VAL;
    if (c->holds_slow)
        hold_slow_slip(simulation);
    for (c->present = 0; c->present < blocks; c->present++)
        if (!solve_block(simulation, t))
            return kt_contacts_reject(simulation, t, "reactions", error);
    kt_contacts_close_grazing(simulation);
    return KT_OK;
}
