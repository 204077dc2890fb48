/* Rows of hard contacts: their equations, and the parameters of their effects. Used in all files
 * of this folder. */
#include "base/copy.h"
#include "contact/contact.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "kinetree/loop.h"
#include "linear/cholesky.h"
#include "model/switching.h"

#include <float.h>
#include <math.h>

void kt_contacts_take_all(struct kt_contacts *c, const kt_model *model) {
    const kt_model *all = kt_model_switched(model, (model->set | c->mask) & ~c->back);
    if (all == c->all)
        return;
    c->all = all;
    kt_data_rebind(all, c->data);
    kt_contacts_place_islands(c);
}

bool kt_contact_is_released(const kt_contact *contact) {
    const kt_simulation *simulation = contact->simulation;
    return contact->bit != 0 ? (simulation->memory.released & contact->bit) != 0
                             : simulation->model->loop[contact->loop].released;
}

int kt_effect_stick(const kt_model *model, int effect) {
    for (int loop = 0; loop < kt_loop_count(model); loop++)
        if (kt_loop_is_stick(model, loop) && model->loop[loop].friction == effect + 1)
            return loop;
    return -1;
}

double kt_contact_limit(const kt_model *model, const kt_contact *contact) {
    const kt_effect_record *effect = kt_effect_record_find(model, contact->effect);
    return fmax(effect->coulomb, effect->breakaway);
}

double kt_contact_slip(const kt_model *model, const kt_contact *contact) {
    const kt_effect_record *effect = kt_effect_record_find(model, contact->effect);
    return effect->stribeck > 0.0 ? kt_contact_limit(model, contact) : effect->coulomb;
}

/* The first friction from item k on that sticks in the joint rate v; c->n: there is none. */
static int next_sticking(const struct kt_contacts *c, const kt_model *model, int k, int v) {
    while (k < c->n && (kt_contact_rubs(c, k) || c->item[k].v != v || !kt_contact_is_closed(model, &c->item[k])))
        k++;
    return k;
}

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
    kt_contacts_take_all(c, model);
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
        row[line.v[j]] = line.sign * line.row[j];
}

void kt_contacts_multiply(const struct kt_contacts *c, int k, int from, double *row) {
    const kt_contact_line line = kt_contacts_line(c, k);
    const size_t nv = c->all->n.v;
    for (int i = from; i < c->touching; i++)
        row[i] = 0.0;
    for (int j = 0; j < line.count; j++) {
        const double x = line.sign * line.row[j], *response = c->response + (size_t)from * nv + (size_t)line.v[j];
        for (int i = from; x != 0.0 && i < c->touching; i++, response += nv)
            row[i] += x * *response;
    }
}

double kt_contacts_along(const struct kt_contacts *c, int k, const double *x) {
    const kt_contact_line line = kt_contacts_line(c, k);
    double sum = 0.0;
    for (int j = 0; j < line.count; j++)
        sum += line.sign * line.row[j] * x[line.v[j]];
    return sum;
}

double kt_contacts_product(const struct kt_contacts *c, int i, int k) {
    const kt_contact_line line = kt_contacts_line(c, i);
    const double *response = c->response + (size_t)k * c->all->n.v;
    double sum = 0.0;
    for (int j = 0; j < line.count; j++)
        sum += line.row[j] != 0.0 ? line.sign * line.row[j] * response[line.v[j]] : 0.0;
    return sum;
}

double kt_contacts_residual(const struct kt_contacts *c, int k, int component, const double *x, const double *right,
                            double *size) {
    const kt_contact_line line = kt_contact_line_of(c, &c->item[k], component);
    const double r = line.sign * right[kt_contact_row(c->all, &c->item[k]) + component];
    double sum = -r;
    *size = fabs(r);
    for (int j = 0; j < line.count; j++) {
        const double term = line.sign * line.row[j] * x[line.v[j]];
        sum += term;
        *size += fabs(term);
    }
    return sum;
}

/* The residual of row k, whose size is at least that of a change of the motion of size `most`. */
static double residual_of_row(const struct kt_contacts *c, const double *W, int k, const double *x, const double *right,
                              double most, double *size) {
    const double residual = kt_contacts_residual(c, c->list[k], c->component[k], x, right, size);
    *size = fmax(*size, sqrt(kt_contacts_own(c, W, k)) * most);
    return residual;
}

double kt_contact_rate(const struct kt_contacts *c, const double *W, int k, double *size) {
    return residual_of_row(c, W, k, c->v, c->rate, c->speed, size);
}

double kt_contact_acceleration(const struct kt_contacts *c, const double *W, int k, double *size) {
    return residual_of_row(c, W, k, c->a, c->drift, c->change, size);
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

double kt_contact_margin(const kt_simulation *simulation, int k) {
    static const uint64_t instants = 8; /* in a row, at once */
    const struct kt_contacts *c = simulation->contacts;
    const double slowest = fmax(kt_contact_loop(simulation, k)->rest_velocity, kt_contact_resting);
    const bool has_closed_by_rounding =
        simulation->memory.event_row >= instants && c->item[c->list[k]].meets && !(c->selected->approach > 0.0);
    return has_closed_by_rounding || fabs(c->u[k]) <= slowest ? rounding_of_gap(simulation, k) : 0.0;
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
double kt_contact_unresolved(const kt_simulation *simulation, const double *W, int k) {
    static const double tolerances = 10.0;
    const kt_loop_record *loop = kt_contact_loop(simulation, k);
    double size;
    if (!(loop->rest_velocity > 0.0))
        return 0.0;
    const double w = fmax(-kt_contact_acceleration(simulation->contacts, W, k, &size), 0.0);
    return simulation->step > 0.0 ? 0.5 * w * fmax(1.0 - loop->restitution, 0.0) * simulation->step
                                  : sqrt(2.0 * w * tolerances * tolerance_of_gap(simulation, k));
}

/* A bounce at the speed u against the acceleration w has the height u^2 / 2 w and the duration 2 u / w. A bounce does
 * not exist if its height is below some roundings of the gap, or its duration below some roundings of the time. */
double kt_contact_rest(const kt_simulation *simulation, const double *W, int k) {
    static const double instant = 16.0 * DBL_EPSILON; /* roundings of the time */
    const struct kt_contacts *c = simulation->contacts;
    const double slowest = kt_contact_loop(simulation, k)->rest_velocity;
    if (c->rests && slowest > 0.0)
        return HUGE_VAL;
    const double t = kt_integrator_time(simulation->integrator);
    double size;
    const double w = fmax(-kt_contact_acceleration(c, W, k, &size), 0.0);
    const double height = sqrt(2.0 * w * rounding_of_gap(simulation, k));
    const double flight = 0.5 * w * fmax(instant * fabs(t), 1e-12);
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
        else if (c->v[item->v] < -kt_contact_resting)
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

/* The units in which multipliers are measured, as in cone/coulomb.h. */
static void set_units(const struct kt_contacts *c, const kt_model *model, double *unit) {
    for (size_t i = 0; i < model->n.row; i++)
        unit[i] = 1.0;
    for (int k = c->sides; k < c->n; k++) {
        if (!kt_contact_rubs(c, k) || !kt_contact_is_closed(model, &c->item[k]) ||
            !kt_contact_is_closed(model, &c->item[c->item[k].of]))
            continue;
        const kt_contact *contact = &c->item[c->item[k].of];
        const double least = -contact->simulation->contact_state[contact->index].opens_at;
        const double normal = fmax(c->reaction[kt_contact_row(model, contact)], least);
        for (int component = 0; component < 2 && normal > 0.0; component++)
            unit[kt_contact_row(model, &c->item[k]) + component] = sqrt(normal);
    }
}

/* Exchanges the longest column of J (rows x columns, by rows) from column k on with column k. Scaled to length 1 it is
 * c->direction, which is removed from the columns behind it. Returns the square of its length. */
static double take_longest(struct kt_contacts *c, double *J, size_t rows, size_t columns, size_t k, double least) {
    double *u = c->direction, most = 0.0;
    size_t pivot = k;
    for (size_t j = k; j < columns; j++) {
        double square = 0.0;
        for (size_t i = 0; i < rows; i++)
            square += J[i * columns + j] * J[i * columns + j];
        pivot = square > most ? j : pivot;
        most = fmax(most, square);
    }
    for (size_t i = 0; most > least && i < rows; i++) {
        u[i] = J[i * columns + pivot] / sqrt(most);
        J[i * columns + pivot] = J[i * columns + k];
        J[i * columns + k] = u[i];
    }
    for (size_t j = k + 1; most > least && j < columns; j++) {
        double dot = 0.0;
        for (size_t i = 0; i < rows; i++)
            dot += u[i] * J[i * columns + j];
        for (size_t i = 0; i < rows; i++)
            J[i * columns + j] -= dot * u[i];
    }
    return most;
}

/* Writes the part of the multipliers c->drift of a group that is in the range of its J to c->least. The equations are
 * those from group->row on. The first columns of J become an orthonormal basis of this range. Returns their number. */
static size_t find_least_of_group(struct kt_contacts *c, const kt_group *group) {
    const size_t rows = (size_t)group->row_count, columns = (size_t)group->v_count;
    double *J = c->jacobian + group->entry, *least = c->least + group->row, longest = 0.0;
    size_t k = 0;
    kt_clear(least, rows * sizeof *least);
    for (; k < columns && k < rows; k++) {
        const double square = take_longest(c, J, rows, columns, k, 1e-18 * longest);
        longest = k == 0 ? square : longest;
        if (!(square > 1e-18 * longest))
            break;
        const double dot = kt_dense_dot(c->direction, c->drift + group->row, (int)rows);
        for (size_t i = 0; i < rows; i++)
            least[i] += dot * c->direction[i];
    }
    return k;
}

/* Measures J and multipliers of a group in `unit`: both become scaled, the latter in c->drift. */
static void scale_group(struct kt_contacts *c, const kt_model *model, const kt_group *group, const double *unit) {
    const int columns = group->v_count;
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        const double *of = unit + loop->equation, *multiplier = c->row + loop->equation;
        double *J = c->jacobian + kt_loop_entry(group, loop, 0), *scaled = c->drift + group->row + loop->row;
        for (int r = 0; r < loop->row_count; r++, J += columns) {
            scaled[r] = multiplier[r] / of[r];
            for (int j = 0; j < columns; j++)
                J[j] *= of[r];
        }
    }
}

/* Takes the least multipliers of a group, which are measured in `unit`. */
static void take_least(struct kt_contacts *c, const kt_model *model, const kt_group *group, const double *unit) {
    for (int i = 0; i < group->loop_count; i++) {
        const kt_loop_record *loop = &model->loop[model->group_loop[group->loop + i]];
        const double *least = c->least + group->row + loop->row;
        for (int r = 0; r < loop->row_count; r++)
            c->reaction[loop->equation + r] = unit[loop->equation + r] * least[r];
    }
}

bool kt_contact_shares_load(const kt_model *model, const kt_contact *contact) {
    return kt_contact_is_closed(model, contact) && contact->simulation->contact_state[contact->index].shared;
}

bool kt_contacts_share_any(const struct kt_contacts *c, const kt_model *model) {
    bool any = false;
    for (int k = 0; k < c->sides; k++)
        any = any || kt_contact_shares_load(model, &c->item[k]);
    return any;
}

bool kt_contacts_exceed_any(const struct kt_contacts *c, const kt_model *model, const double *multiplier) {
    bool any = false;
    for (int k = c->sides; k < c->n; k++)
        any = any || (!kt_contact_rubs(c, k) && kt_contact_is_closed(model, &c->item[k]) &&
                      fabs(multiplier[kt_contact_row(model, &c->item[k])]) > kt_contact_limit(model, &c->item[k]));
    return any;
}

/* The rows of contacts of a group that share their load. */
typedef struct loads {
    int n;
    const int *item; /* contacts */
} loads;

static size_t load_row(const kt_model *model, const kt_contact *contact) {
    return (size_t)model->loop[contact->loop].row;
}

/* Lists loads of a group, and by how much each exceeds its bound, as in cone/coulomb_shares.c. Returns whether one is
 * below. */
static bool list_loads_below(struct kt_contacts *c, const kt_model *model, const kt_group *group, loads *to) {
    double sum = 0.0;
    bool any = false;
    *to = (loads){.item = c->active};
    for (int i = 0; i < c->sides; i++) {
        const kt_contact *contact = &c->item[i];
        if (!kt_contact_shares_load(model, contact) || &model->group[model->loop[contact->loop].group] != group)
            continue;
        sum += contact->sign * c->reaction[kt_contact_row(model, contact)];
        c->active[to->n++] = i;
    }
    for (int i = 0; i < to->n; i++) {
        const kt_contact *contact = &c->item[c->active[i]], *friction = &c->item[contact->of];
        const bool sticks = contact->of >= 0 && kt_contact_is_closed(model, friction);
        const double *across = sticks ? c->reaction + kt_contact_row(model, friction) : NULL;
        c->q[i] = contact->sign * c->reaction[kt_contact_row(model, contact)] -
                  kt_coulomb_least_load(sticks ? kt_hypot(across[0], across[1]) : 0.0,
                                        sticks ? kt_contact_coefficient(model, friction) : 1.0, sum / to->n);
        any = any || c->q[i] < 0.0;
    }
    return any;
}

/* P = 1 - Q Q' in rows i and j of a group, of `columns`, of which the first `rank` are Q. */
static double projector_entry(const double *Q, size_t columns, size_t rank, size_t i, size_t j) {
    return (i == j ? 1.0 : 0.0) - kt_dense_dot(Q + i * columns, Q + j * columns, (int)rank);
}

/* Raises loads of a group to their bounds by the least change of c->least, as in cone/coulomb_shares.c. */
static void raise_loads_of_group(struct kt_contacts *c, const kt_model *model, const kt_group *group, size_t rank) {
    const double *Q = c->jacobian + group->entry;
    const size_t columns = (size_t)group->v_count;
    uint64_t pivots = 0;
    loads to;
    if (!list_loads_below(c, model, group, &to))
        return;
    for (int i = 0; i < to.n; i++)
        for (int j = 0; j < to.n; j++) {
            const kt_contact *one = &c->item[to.item[i]], *other = &c->item[to.item[j]];
            c->M[i * to.n + j] = one->sign * other->sign *
                                 projector_entry(Q, columns, rank, load_row(model, one), load_row(model, other));
        }
    if (!kt_lemke_solve(to.n, c->M, c->q, c->lemke, c->z, &pivots))
        return;
    for (int i = 0; i < to.n; i++) {
        const kt_contact *contact = &c->item[to.item[i]];
        for (size_t r = 0; c->z[i] > 0.0 && r < (size_t)group->row_count; r++)
            c->least[(size_t)group->row + r] +=
                contact->sign * c->z[i] * projector_entry(Q, columns, rank, r, load_row(model, contact));
    }
}

/* Writes the least multipliers, measured in `unit`, among those with equal forces. They are the part of the multipliers
 * in the range of J, whose columns become an orthonormal basis of that range. Groups have no coordinate in common.
 * raise: those of contacts that share their load are at least their bounds, if possible. */
static kt_status find_least(struct kt_contacts *c, const kt_instant *at, const double *unit, bool raise,
                            kt_error *error) {
    const kt_model *model = at->model;
    const kt_dynamic_state state = {.t = at->t, .q = at->q, .v = at->v};
    const kt_status status = kt_loop_entries(model, at->data, &state, c->jacobian, NULL, NULL, NULL, error);
    for (size_t g = 0; status == KT_OK && g < model->n.group; g++) {
        scale_group(c, model, &model->group[g], unit);
        const size_t rank = find_least_of_group(c, &model->group[g]);
        take_least(c, model, &model->group[g], unit);
        if (!raise)
            continue;
        raise_loads_of_group(c, model, &model->group[g], rank);
        take_least(c, model, &model->group[g], unit);
    }
    return status;
}

/* The part of its limit that friction k uses; -1: it does not stick, or its contact does not press. */
static double part_in_use(const struct kt_contacts *c, const kt_model *model, int k) {
    if (!kt_contact_is_closed(model, &c->item[k]))
        return -1.0;
    const bool rubs = kt_contact_rubs(c, k);
    const double *force = c->reaction + kt_contact_row(model, &c->item[k]);
    const double most =
        rubs ? kt_contact_coefficient(model, &c->item[k]) * c->reaction[kt_contact_row(model, &c->item[c->item[k].of])]
             : kt_contact_limit(model, &c->item[k]);
    return most > 0.0 ? (rubs ? kt_hypot(force[0], force[1]) : fabs(*force)) / most : -1.0;
}

/* Changes the units of friction to those of other shares, as in cone/coulomb.h. Returns the largest part of
 * friction in use. A load far beyond all friction would shrink all units together, until its directions seem
 * dependent, and vanish. Parts then count relative to the largest one. Forces may have only one share: that of a
 * driven wheel, if loads are shared, too, or that of dry friction. Their units would grow or shrink without end, and
 * stay within a range. */
static double change_units(const struct kt_contacts *c, const kt_model *model, double *unit, bool first) {
    static const double far = 1.5;
    double largest = 0.0, range = kt_contacts_share_any(c, model) ? 1e3 : HUGE_VAL;
    for (int k = c->sides; k < c->n; k++) {
        const double part = part_in_use(c, model, k);
        largest = fmax(largest, part);
        range = !kt_contact_rubs(c, k) && part >= 0.0 ? KT_COULOMB_RANGE_OF_DRY : range;
    }
    const double whole = largest > far ? largest : 1.0;
    for (int k = c->sides; k < c->n; k++) {
        const double part = part_in_use(c, model, k);
        if (part < 0.0)
            continue;
        const int row = kt_contact_row(model, &c->item[k]);
        const bool rubs = kt_contact_rubs(c, k);
        const double scale =
            rubs ? c->reaction[kt_contact_row(model, &c->item[c->item[k].of])] : kt_contact_limit(model, &c->item[k]);
        const double from = first && !rubs ? sqrt(scale) : unit[row];
        unit[row] = kt_coulomb_unit_within(from * kt_coulomb_unit_factor(part / whole), scale, range);
        if (rubs)
            unit[row + 1] = unit[row];
    }
    return largest;
}

/* The least multipliers: first in one unit, which yields normal forces, then in roots of the normal forces. If they
 * exceed friction, they are shared in other ways, unless the largest part does not change. *most: this part. */
static kt_status find_shares(struct kt_contacts *c, const kt_instant *at, bool raise, double *most, kt_error *error) {
    for (size_t i = 0; i < at->model->n.row; i++)
        c->rate[i] = 1.0;
    kt_status status = find_least(c, at, c->rate, raise, error);
    set_units(c, at->model, c->rate);
    if (status == KT_OK)
        status = find_least(c, at, c->rate, raise, error);
    double before = HUGE_VAL, part = change_units(c, at->model, c->rate, true);
    for (int i = 0; status == KT_OK && i < KT_COULOMB_SHARINGS && part > 1.0 && fabs(before - part) > 1e-14; i++) {
        before = part;
        status = find_least(c, at, c->rate, raise, error);
        part = change_units(c, at->model, c->rate, false);
    }
    *most = part;
    return status;
}

/* Whether a contact that shares its load pulls. */
static bool any_load_pulls(const struct kt_contacts *c, const kt_model *model) {
    bool pulls = false;
    for (int k = 0; k < c->sides; k++)
        pulls = pulls || (kt_contact_shares_load(model, &c->item[k]) &&
                          c->item[k].sign * c->reaction[kt_contact_row(model, &c->item[k])] < 0.0);
    return pulls;
}

kt_status kt_contacts_find_reactions(struct kt_contacts *c, const kt_instant *at, kt_error *error) {
    double most = 0.0;
    kt_status status = find_shares(c, at, false, &most, error);
    if (status == KT_OK && kt_contacts_share_any(c, at->model) && (most > 1.0 || any_load_pulls(c, at->model)))
        status = find_shares(c, at, true, &most, error);
    if (status == KT_OK)
        kt_contacts_share_load(c, at->model, c->reaction);
    return status;
}
