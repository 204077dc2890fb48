/* Rows of hard contacts: their equations, and the parameters of their effects. Used in all files of this folder. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "cone/statics.h"
#include "contact/contact.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "kinetree/algebra.h"
#include "kinetree/loop.h"
#include "linear/cholesky.h"
#include "model/switching.h"

#include <float.h>
#include <math.h>

void kt_contacts_use_closed_model(struct kt_contacts *c, const kt_model *model) {
    const kt_model *all = kt_model_switched(model, (model->set | c->mask) & ~c->back);
    if (all == c->all)
        return;
    c->all = all;
    kt_data_rebind(all, c->data);
    kt_contacts_init_islands(c);
}

bool kt_contact_is_released(const kt_contact *contact) {
    const kt_simulation *simulation = contact->simulation;
    return contact->bit != 0 ? (simulation->memory.released & contact->bit) != 0
                             : simulation->model->loop[contact->loop].released;
}

int kt_effect_stick_loop(const kt_model *model, int effect) {
    for (int loop = 0; loop < kt_loop_count(model); loop++)
        if (kt_loop_is_stick(model, loop) && model->loop[loop].friction == effect + 1)
            return loop;
    return -1;
}

double kt_contact_limit(const kt_model *model, const kt_contact *contact) {
    const kt_effect_record *effect = kt_effect_record_find(model, contact->effect);
    return fmax(effect->coulomb, effect->breakaway) + contact->load;
}

double kt_contact_slip(const kt_model *model, const kt_contact *contact) {
    const kt_effect_record *effect = kt_effect_record_find(model, contact->effect);
    return effect->stribeck > 0.0 ? fmax(effect->coulomb, effect->breakaway) : effect->coulomb;
}

/* The first friction from item k on that sticks in the joint rate v; c->n: there is none. */
static int next_sticking(const struct kt_contacts *c, const kt_model *model, int k, int v) {
    while (k < c->n && (kt_contact_rubs(c, k) || c->item[k].v != v || !kt_contact_is_closed(model, &c->item[k])))
        k++;
    return k;
}

/* lambda_i = S_i sum(lambda) / sum(S) over the friction that sticks in one joint rate */
void kt_contacts_share_load(const struct kt_contacts *c, const kt_model *model, double *multiplier) {
    for (int k = c->sides; k < c->n; k++) {
        const int v = c->item[k].v;
        if (kt_contact_rubs(c, k) || next_sticking(c, model, c->sides, v) != k ||
            next_sticking(c, model, k + 1, v) == c->n)
            continue; /* it is not the first of several */
        double load = 0.0, limit = 0.0;
        for (int i = k; i < c->n; i = next_sticking(c, model, i + 1, v)) {
            load += multiplier[kt_contact_row(model, &c->item[i])];
            limit += kt_contact_limit(model, &c->item[i]);
        }
        for (int i = k; limit > 0.0 && i < c->n; i = next_sticking(c, model, i + 1, v))
            multiplier[kt_contact_row(model, &c->item[i])] = load * kt_contact_limit(model, &c->item[i]) / limit;
    }
}

void kt_contacts_hold_together(struct kt_contacts *c) {
    for (int k = c->sides; k < c->n; k++)
        for (int i = c->sides; !kt_contact_rubs(c, k) && c->item[k].next == KT_CONTACT_ON && i < c->n; i++)
            if (kt_contacts_share_rate(c, i, k) && c->item[i].next != KT_CONTACT_RELEASED)
                c->item[i].next = KT_CONTACT_ON;
}

double kt_contact_coefficient(const kt_model *model, const kt_contact *contact) {
    return kt_effect_record_find(model, contact->effect)->friction;
}

kt_status kt_contacts_find_equations(struct kt_contacts *c, const kt_model *model, double t, const double *q,
                                     const double *v, bool all, kt_error *error) {
    kt_contacts_use_closed_model(c, model);
    const kt_dynamic_state at = {.t = t, .q = q, .v = v};
    const kt_status status = kt_loop_entries(c->all, c->data, &at, all ? c->jacobian : NULL, c->row,
                                             all ? c->rate : NULL, all ? c->drift : NULL, error);
    for (int k = 0; status == KT_OK && k < c->n; k++)
        c->gap[k] = c->item[k].sign * c->row[kt_contact_row(c->all, &c->item[k])];
    return status;
}

const kt_loop_record *kt_contact_loop(const kt_simulation *simulation, int k) {
    const struct kt_contacts *c = simulation->contacts;
    return &simulation->model->loop[c->item[c->list[k]].loop];
}

void kt_contacts_write_row(const struct kt_contacts *c, int k, double *row) {
    const kt_contact_line line = kt_contacts_line(c, k);
    for (int j = 0; j < line.count; j++)
        row[line.v[j]] = line.sign * line.row[line.at[j]];
}

double kt_contacts_along(const struct kt_contacts *c, int k, const double *x) {
    const kt_contact_line line = kt_contacts_line(c, k);
    double sum = 0.0;
    for (int j = 0; j < line.count; j++)
        sum += line.sign * line.row[line.at[j]] * x[line.v[j]];
    return sum;
}

/* W_ik = J_i (M^-1 J')_k */
double kt_contacts_product(const struct kt_contacts *c, int i, int k) {
    return kt_contacts_along(c, i, c->response + (size_t)k * c->all->n.v);
}

double kt_contacts_residual(const struct kt_contacts *c, int k, int component, const double *x, const double *right,
                            double *size) {
    const kt_contact_line line = kt_contact_line_of(c, &c->item[k], component);
    const double r = line.sign * right[kt_contact_row(c->all, &c->item[k]) + component];
    double sum = -r;
    *size = fabs(r);
    for (int j = 0; j < line.count; j++) {
        const double term = line.sign * line.row[line.at[j]] * x[line.v[j]];
        sum += term;
        *size += fabs(term);
    }
    return sum;
}

/* The residual of row k, whose size is at least that of a change of the motion of size `most`. */
static double residual_of_row(const struct kt_contacts *c, int k, const double *x, const double *right, double most,
                              double *size) {
    const double residual = kt_contacts_residual(c, c->list[k], c->component[k], x, right, size);
    *size = fmax(*size, sqrt(kt_contacts_own(c, k)) * most);
    return residual;
}

double kt_contact_rate(const struct kt_contacts *c, int k, double *size) {
    return residual_of_row(c, k, c->v, c->rate, c->speed, size);
}

double kt_contact_acceleration(const struct kt_contacts *c, int k, double *size) {
    return residual_of_row(c, k, c->a, c->drift, c->change, size);
}

/* ---- rest -------------------------------------------------------------------------------------------------------- */

/* The size that rounding of the gap of row k is relative to: the lengths and angles in the gap, weighted with its
 * Jacobian. In space, a rotation moves a point on its lever even at an angle of zero. */
static double extent_of(const struct kt_contacts *c, int k, const double *q) {
    const kt_model *all = c->all;
    const bool turns = all->loop[c->item[c->list[k]].loop].type != KT_LOOP_COUPLING;
    const kt_contact_line line = kt_contacts_line(c, k);
    double sum = 0.0;
    for (int i = 0; i < line.group->link_count; i++) {
        const kt_link *link = &all->link[all->group_link[line.group->link + i]];
        const bool has_angles = kt_motion_facts_of(link->motion).quaternions == 0;
        for (int j = 0; j < kt_link_dofs(link); j++) {
            const bool is_length = j < kt_link_lengths(link);
            const double x = is_length || has_angles ? fabs(q[link->q + j]) : 1.0;
            sum += fabs(line.row[link->local + j]) * (is_length || !turns ? x : fmax(x, 1.0));
        }
    }
    return sum;
}

static double rounding_of_gap(const kt_simulation *simulation, int k) {
    static const double roundings = 16.0;
    return roundings * DBL_EPSILON * extent_of(simulation->contacts, k, kt_integrator_state(simulation->integrator));
}

/* Whether the gap of row k changes no faster than its rest velocity. */
static bool is_slower_than_rest(const kt_simulation *simulation, int k) {
    const struct kt_contacts *c = simulation->contacts;
    return fabs(c->u[k]) <=
           fmax(kt_contact_loop(simulation, k)->rest_velocity, kt_contact_resting(simulation, c->list[k]));
}

/* The event at which a contact meets leaves a gap: the error of the event's time, multiplied by the speed. If dry
 * friction holds such a contact, nothing closes this gap. It may exceed the gaps that touch, but the contact touches
 * until it parts. Therefore a gap above half of those that touch moves the boundary with it (kt_contact_touches). Less
 * the rounding of the gap: otherwise rounding would close the contact again and again, such as the fourth corner of a
 * foot that three corners hold.
 *
 * A contact that bounces is beyond its boundary by the speed times the rounding of the time. A bounce at the speed u
 * leaves the boundary by about (u T)^2 / l, with the mechanism's own time T and the contact's unit l. If this is not
 * much more than the depth, the contact might stay beyond, and closes at its present gap. Otherwise it closes at its
 * boundary: if each bounce moved it, boundaries would recede, by 1e-11 m in 20,000 bounces at 10 m/s. */
static double closing_gap_of(const kt_simulation *simulation, int k) {
    const struct kt_contacts *c = simulation->contacts;
    static const double much = 1e-3;
    const double gap = c->gap[c->list[k]], below = 0.5 * kt_contact_touching * c->item[c->list[k]].unit;
    if (is_slower_than_rest(simulation, k))
        return fmin(fmax(gap - below, 0.0), gap) - rounding_of_gap(simulation, k);
    const double leaves = c->u[k] * simulation->memory.own_time;
    return -gap * c->item[c->list[k]].unit <= much * leaves * leaves ? 0.0 : fmin(0.0, gap);
}

void kt_contact_watch_gap(kt_simulation *simulation, int k) {
    kt_contact_memory *memory = &simulation->contact_state[simulation->contacts->list[k]];
    memory->closes_at = closing_gap_of(simulation, k);
    memory->parts_at = memory->closes_at + (is_slower_than_rest(simulation, k) ? 0.0 : rounding_of_gap(simulation, k));
}

/* The error of the gap of row k that adaptive steps may make: the largest tolerance of a position in it. */
static double tolerance_of_gap(const kt_simulation *simulation, int k) {
    const kt_integrator *integrator = simulation->integrator;
    const kt_model *all = simulation->contacts->all;
    const double *y = kt_integrator_state(integrator);
    const kt_contact_line line = kt_contacts_line(simulation->contacts, k);
    double most = 0.0;
    for (int i = 0; i < line.group->link_count; i++) {
        const kt_link *link = &all->link[all->group_link[line.group->link + i]];
        for (int j = 0; j < kt_link_dofs(link); j++) {
            const size_t q = (size_t)link->q + (size_t)j;
            const double entry = fabs(line.row[link->local + j]);
            most = entry > 0.0 ? fmax(most, entry * kt_error_scale(integrator, q, y[q], y[q])) : most;
        }
    }
    return most;
}

/* The bounces after a speed u against the acceleration w take 2 u / w (1 + e + e^2 + ...) = 2 u / (w (1 - e)). */
double kt_contact_unresolved(const kt_simulation *simulation, int k) {
    static const double tolerances = 10.0;
    const kt_loop_record *loop = kt_contact_loop(simulation, k);
    double size;
    if (!(loop->rest_velocity > 0.0))
        return 0.0;
    const double w = fmax(-kt_contact_acceleration(simulation->contacts, k, &size), 0.0);
    return simulation->step > 0.0 ? 0.5 * w * fmax(1.0 - loop->restitution, 0.0) * simulation->step
                                  : sqrt(2.0 * w * tolerances * tolerance_of_gap(simulation, k));
}

/* A bounce at the speed u against the acceleration w has the height u^2 / 2 w and the duration 2 u / w. A bounce does
 * not exist if its height is below some roundings of the gap, or its duration below some roundings of the time. */
double kt_contact_rest(const kt_simulation *simulation, int k) {
    const struct kt_contacts *c = simulation->contacts;
    const double slowest = kt_contact_loop(simulation, k)->rest_velocity;
    if (c->rests && slowest > 0.0)
        return HUGE_VAL;
    const double t = kt_integrator_time(simulation->integrator);
    double size;
    const double w = fmax(-kt_contact_acceleration(c, k, &size), 0.0);
    const double height = sqrt(2.0 * w * rounding_of_gap(simulation, k));
    const double flight = 0.5 * w * fmax(4.0 * kt_time_width(t), kt_simulation_instant(simulation));
    return fmax(slowest, fmax(height, flight));
}

void kt_contacts_let_slip(struct kt_contacts *c) {
    for (int k = 0; k < c->n; k++) {
        kt_contact *item = &c->item[k];
        item->next = KT_CONTACT_OFF;
        if (k < c->sides || kt_contact_rubs(c, k))
            continue;
        if (kt_contact_is_released(item))
            item->next = KT_CONTACT_RELEASED;
        else if (c->v[item->v] < -c->rest_rate[k])
            item->next = KT_CONTACT_BACK;
    }
}

uint64_t kt_contacts_set(const kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    uint64_t set = simulation->model->set & ~c->mask;
    bool any = false, all = true;
    for (int k = 0; k < c->n; k++) {
        const kt_contact *item = &c->item[k];
        const bool on = item->next == KT_CONTACT_ON;
        set |= on || item->next == KT_CONTACT_RELEASED ? item->bit : 0;
        set |= item->next == KT_CONTACT_BACK || item->next == KT_CONTACT_RELEASED ? item->back : 0;
        any = any || (on && item->bit == 0);
        all = all && (on || item->bit != 0);
    }
    return set | (any && all ? kt_switches_all : any ? kt_switches_any : 0);
}

/* ---- reactions that are not unique ------------------------------------------------------------------------------- */

bool kt_contact_shares_load(const kt_model *model, const kt_contact *contact) {
    return kt_contact_is_closed(model, contact) && contact->simulation->contact_state[contact->index].shared;
}

bool kt_contacts_share_any(const struct kt_contacts *c, const kt_model *model, const double *multiplier) {
    bool any = false;
    for (int k = 0; k < c->n; k++) {
        const kt_contact *item = &c->item[k];
        any = any || kt_contact_shares_load(model, item) ||
              (k >= c->sides && !kt_contact_rubs(c, k) && kt_contact_is_closed(model, item) &&
               fabs(multiplier[kt_contact_row(model, item)]) > kt_contact_limit(model, item));
    }
    return any;
}

/* Writes the next row of the problem of statics: the multiplier of a loop's equation, and its row of J. Coordinates are
 * measured in their units, because lengths and angles are compared. sign: of the force. */
static void write_statics_row(const struct kt_contacts *c, const kt_model *model, const kt_group *group,
                              const kt_loop_record *loop, int component, double sign, kt_statics *statics, int row) {
    const double *J = c->jacobian + kt_loop_entry(group, loop, component), *unit = model->unit + group->v;
    statics->equation[row] = loop->equation + component;
    statics->sign[row] = sign;
    statics->p[row] = sign * c->row[loop->equation + component];
    for (int j = 0; j < group->v_count; j++)
        statics->matrix[row * statics->columns + j] = sign * J[j] * unit[j];
}

/* Whether the contact's friction sticks. */
static bool contact_sticks(const struct kt_contacts *c, const kt_model *model, const kt_contact *contact) {
    return contact->of >= 0 && kt_contact_is_closed(model, &c->item[contact->of]);
}

/* Whether the force of item k is an unknown of its own in the problem of statics of a group. Friction of a contact
 * belongs to its contact. The normal force of a contact that slips determines its friction, and does not change. */
static bool is_unknown_at_rest(const struct kt_contacts *c, const kt_model *model, const kt_group *group, int k) {
    const kt_contact *contact = &c->item[k];
    const bool slips = k < c->sides && contact->of >= 0 && !contact_sticks(c, model, contact);
    return kt_contact_is_closed(model, contact) && !kt_contact_rubs(c, k) && !slips &&
           &model->group[model->loop[contact->loop].group] == group;
}

/* Adds contacts and dry friction of a group. */
static void add_statics_items(const struct kt_contacts *c, const kt_model *model, const kt_group *group, double t,
                              kt_statics *statics) {
    for (int k = 0; k < c->n; k++) {
        const kt_contact *contact = &c->item[k];
        if (!is_unknown_at_rest(c, model, group, k))
            continue;
        const kt_contact_memory *memory = contact->simulation->contact_state;
        const bool is_dry = k >= c->sides, sticks = !is_dry && contact_sticks(c, model, contact);
        const int of = sticks ? contact->of : k, row = statics->rows;
        const double mu =
            sticks ? kt_contact_coefficient(model, &c->item[of]) * (t < memory[of].held ? kt_contact_holding : 1.0)
                   : 0.0;
        kt_statics_add(statics,
                       sticks   ? KT_STATICS_CONE
                       : is_dry ? KT_STATICS_DRY
                                : KT_STATICS_NORMAL,
                       is_dry ? kt_contact_limit(model, contact) : mu, memory[k].opens_at, memory[k].metric)
            ->of = of;
        write_statics_row(c, model, group, &model->loop[contact->loop], 0, contact->sign, statics, row);
        for (int i = 0; sticks && i < 2; i++)
            write_statics_row(c, model, group, &model->loop[c->item[of].loop], i, 1.0, statics, row + 1 + i);
    }
}

/* Whether the loop is no contact and no dry friction. */
static bool is_loop_at_rest(const kt_loop_record *loop) {
    return !kt_loop_is_off(loop) && loop->side == KT_SIDE_NONE && loop->friction == 0;
}

/* Adds the other loops of a group, whose forces have no limit. */
static void add_statics_loops(const struct kt_contacts *c, const kt_model *model, const kt_group *group,
                              kt_statics *statics) {
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        for (int r = 0; is_loop_at_rest(loop) && r < loop->row_count; r++) {
            const int row = statics->rows;
            (void)kt_statics_add(statics, KT_STATICS_FREE, 0.0, 0.0, 0.0);
            write_statics_row(c, model, group, loop, r, 1.0, statics, row);
        }
    }
}

/* The square of the first row of an item, for coordinates in their units. */
static double square_of_item(const kt_statics *statics, const kt_statics_item *item) {
    const double *row = statics->matrix + item->row * statics->columns;
    return kt_dense_dot(row, row, statics->columns);
}

/* Gives weights to items that have none, by the least weight of a row of length 1. The weight of loops is so small that
 * it has no influence on the forces of contacts. No force moves dry friction of a joint that a drive holds. */
static void set_missing_metrics(kt_statics *statics) {
    static const double small = 1e-8;
    double least = HUGE_VAL;
    for (const kt_statics_item *item = statics->item; item < statics->item + statics->n; item++)
        if (item->metric > 0.0)
            least = fmin(least, item->metric / square_of_item(statics, item));
    least = least < HUGE_VAL ? least : 1.0;
    for (kt_statics_item *item = statics->item; item < statics->item + statics->n; item++)
        if (!(item->metric > 0.0))
            item->metric = least * square_of_item(statics, item) * (item->type == KT_STATICS_FREE ? small : 1.0);
}

/* The reserves of items that bound the margin have the margin's sign, so that all their events are due at one
 * instant. */
static void write_reserves(struct kt_contacts *c, const kt_statics *statics) {
    for (int i = 0; i < statics->n; i++) {
        const kt_statics_item *item = &statics->item[i];
        if (kt_statics_bounds_margin(statics, i))
            c->reserve[item->of] = statics->margin * statics->unit / statics->scale[item->row] *
                                   (item->type == KT_STATICS_CONE ? item->friction : 1.0);
    }
}

/* Poses the problem of statics of a group, and finds its largest margin. t: friction that is held beyond t has no
 * limit. */
static kt_statics *find_margin_of_group(const struct kt_contacts *c, const kt_model *model, const kt_group *group,
                                        int rows, double t) {
    kt_statics *statics = kt_statics_init((size_t)rows, (size_t)group->v_count, c->matrices);
    add_statics_items(c, model, group, t, statics);
    add_statics_loops(c, model, group, statics);
    set_missing_metrics(statics);
    kt_statics_begin(statics);
    kt_statics_find_margin(statics);
    return statics;
}

/* Shares the load of a group. Groups have no coordinate in common. least: by the least forces; otherwise by forces with
 * the largest margin, with the reserves of the items that bound it. Friction that is held leaves its cone only if no
 * forces in all cones exist. */
static void share_load_of_group(struct kt_contacts *c, const kt_model *model, const kt_group *group, double t,
                                bool least) {
    int items = 0, rows = 0;
    bool held = false;
    for (int k = 0; k < c->n; k++) {
        items += is_unknown_at_rest(c, model, group, k);
        held = held || t < c->item[k].simulation->contact_state[k].held;
    }
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        rows += is_loop_at_rest(loop) ? loop->row_count : 0;
    }
    rows = rows + 3 * items < group->row_count ? rows + 3 * items : group->row_count;
    if (items == 0 || items > c->most)
        return;
    kt_statics *statics = find_margin_of_group(c, model, group, rows, t);
    if (!least)
        write_reserves(c, statics);
    if (held && find_margin_of_group(c, model, group, rows, HUGE_VAL)->margin < -kt_statics_exact)
        (void)find_margin_of_group(c, model, group, rows, t);
    if (least)
        kt_statics_find_least(statics);
    for (int i = 0; i < statics->rows; i++)
        c->reaction[statics->equation[i]] = statics->sign[i] * kt_statics_force(statics, i);
}

kt_status kt_contacts_find_reactions(struct kt_contacts *c, const kt_instant *at, bool least, kt_error *error) {
    const kt_model *model = at->model;
    const kt_dynamic_state state = {.t = at->t, .q = at->q, .v = at->v};
    kt_copy(c->reaction, c->row, model->n.row * sizeof *c->row);
    for (int k = 0; k < c->n; k++)
        c->reserve[k] = (double)NAN;
    if (!kt_contacts_share_any(c, model, c->row))
        return KT_OK;
    const kt_status status = kt_loop_entries(model, at->data, &state, c->jacobian, NULL, NULL, NULL, error);
    for (size_t g = 0; status == KT_OK && g < model->n.group; g++)
        share_load_of_group(c, model, &model->group[g], at->t, least);
    if (status == KT_OK)
        kt_contacts_share_load(c, model, c->reaction);
    return status;
}

int kt_contact_friction_line(const struct kt_contacts *c, int i) {
    for (int k = c->resting; k < c->touching; k++)
        if (c->list[k] == c->item[c->list[i]].of)
            return k;
    return -1;
}

double kt_contact_slip_speed(const struct kt_contacts *c, int i) {
    const int line = kt_contact_friction_line(c, i);
    return line >= 0 ? kt_hypot(c->u[line], c->u[line + 1]) : 0.0;
}

bool kt_contact_row_slips(const struct kt_contacts *c, int i) {
    return c->item[c->list[i]].of >= 0 && kt_contact_slip_speed(c, i) > c->rest_rate[c->item[c->list[i]].of];
}
