/* The items of a step (moreau.c): the contacts that take part, and their responses. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/moreau.h"

#include "algebra/finite.h"
#include "base/copy.h"
#include "control/mass_inverse.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "integrator/integrator.h"
#include "reduction/kernel.h"

#include <assert.h>
#include <limits.h>
#include <math.h>

/* Rates up to this part of their change in a step count as residuals of the cone solver: ten times the residual at
 * which it ends. The residual is relative to impulses, which may be a hundred times as large (moreau_solve.c). Bodies
 * are therefore at rest up to a larger part. */
static const double settled = 1e-6, at_rest = 1e-4;

void kt_moreau_add_response(const kt_simulation *simulation, int i, int r, double p, double *v) {
    assert(i >= 0 && i < simulation->moreau->count && r >= 0 && r < 3);
    const struct kt_contacts *c = simulation->contacts;
    if (p != 0.0)
        kt_contacts_add_response(c, simulation->moreau->first[i] + r - c->selected->row, p, v);
}

/* ---- equations --------------------------------------------------------------------------------------------------- */

/* Finds the equations of item k, from the motion of all links in c->data. Entries of the Jacobian outside of the paths
 * of the item are undefined. */
static kt_status find_item(struct kt_contacts *c, int k, const kt_dynamic_state *at, kt_error *error) {
    const kt_contact *item = &c->item[k];
    const kt_loop_record *loop = &c->all->loop[item->loop];
    bool fine = true;
    for (int r = 0; r < loop->row_count; r++) {
        double *row = c->jacobian + kt_loop_entry(&c->all->group[loop->group], loop, r);
        for (int j = 0; j < item->count; j++)
            row[c->local[item->first + j]] = 0.0;
    }
    kt_loop_entries_of(c->all, c->data, at, item->loop, c->jacobian, c->row, c->rate, c->drift);
    const double *const number[] = {c->row, c->rate, c->drift};
    for (size_t i = 0; i < sizeof number / sizeof *number; i++)
        fine = kt_all_finite(number[i] + loop->equation, (size_t)loop->row_count) && fine;
    for (int r = 0; r < loop->row_count; r++) {
        const kt_contact_line line = kt_contact_line_of(c, item, r);
        for (int j = 0; j < line.count; j++)
            fine = isfinite(line.row[line.at[j]]) && fine;
    }
    return fine ? KT_OK : kt_loop_entries(c->all, c->data, at, c->jacobian, c->row, c->rate, c->drift, error);
}

kt_status kt_moreau_find_gaps(struct kt_contacts *c, const kt_model *model, const kt_dynamic_state *at,
                              kt_error *error) {
    const kt_input input = {.q = at->q, .v = at->v};
    kt_contacts_use_closed_model(c, model);
    kt_status status = kt_input_check(c->all, &input, error);
    if (status == KT_OK)
        c->all->group_kernels->follow(c->all, c->data, at->q, at->v);
    for (int k = 0; status == KT_OK && k < c->n; k++) {
        if (kt_contact_rubs(c, k))
            continue;
        status = find_item(c, k, at, error);
        c->gap[k] = c->item[k].sign * c->row[kt_contact_row(c->all, &c->item[k])];
    }
    return status;
}

/* ---- items ------------------------------------------------------------------------------------------------------- */

/* Adds a row with its rates at the start of the step (v), and at its end without impulses (m->y). */
static int add_moreau_row(kt_simulation *simulation, int k, int component, const double *v) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const int row = kt_contacts_add_row(c, k, component);
    m->begin[row] = kt_contacts_rate(c, k, component, v);
    m->free[row] = kt_contacts_rate(c, k, component, m->y + simulation->size.nq);
    return row;
}

/* Empties the lists of items. */
static void clear_items(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    kt_contacts_clear_rows(c);
    m->count = 0;
    for (int k = 0; k < c->n; k++)
        m->item_of[k] = KT_MOREAU_NO_PART;
    for (int i = 0; i < c->islands; i++)
        c->island[i].known = 0;
}

/* Removes the items from `from` on from the lists. Items that are not held may be added again. */
static void drop_items(kt_simulation *simulation, int from) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    for (int i = m->count - 1; i >= from; i--) {
        kt_contact_island *at = &c->island[c->item[m->item[i]].island];
        at->touching = m->first[i] - at->row;
        at->known = at->touching;
        if (m->item_of[m->item[i]] == i)
            m->item_of[m->item[i]] = KT_MOREAU_NO_PART;
    }
    m->count = from;
}

/* The compiled model without contacts. The model of a simulation may be a mask, with the groups of all contacts. */
static const kt_model *open_model(const kt_simulation *simulation) {
    const kt_model *model = simulation->model;
    const bool is_compiled = kt_model_switched(model, model->set) == model;
    return is_compiled ? model : kt_model_switched(model, model->set & ~simulation->contacts->mask);
}

/* Bits of the branches, which are the children of the ground with all that they carry, on which item k depends. M^-1 of
 * a tree has a block for each branch. Loops that are not contacts may couple any. */
static uint64_t branches_of(const kt_simulation *simulation, int k) {
    const kt_model *all = simulation->contacts->all;
    const kt_loop_record *loop = &all->loop[simulation->contacts->item[k].loop];
    uint64_t branches = loop->term_count > 0 || open_model(simulation)->n.group > 0 ? UINT64_MAX : 0;
    for (int end = 0; end < 2; end++)
        for (int link = loop->link[end]; link > 0; link = all->link[link].parent)
            branches |= all->link[link].parent == 0 ? (uint64_t)1 << link % 64 : 0;
    return branches;
}

/* Adds item k with its rows: one, or three with friction. The impulses start at h times the last forces. */
static int add_moreau_item(kt_simulation *simulation, int k, const double *v) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const double *force = simulation->contact_state[k].force;
    const int i = m->count++, of = c->item[k].of;
    m->item_of[k] = i;
    m->item[i] = k;
    m->first[i] = add_moreau_row(simulation, k, 0, v);
    m->mu[i] = m->bound[i] = m->e[i] = 0.0;
    m->limit[i] = -1.0;
    m->branches[i] = branches_of(simulation, k);
    for (int r = 0; r < 3; r++)
        m->p[3 * i + r] = k < c->sides || r == 0 ? m->h * force[r] : 0.0;
    if (k < c->sides && of >= 0) {
        m->mu[i] = kt_contact_coefficient(simulation->model, &c->item[of]);
        for (int component = 0; component < 2 && m->mu[i] > 0.0; component++)
            (void)add_moreau_row(simulation, of, component, v);
    }
    return i;
}

/* The largest rate at which a contact parts behind its approach, so that its depth in the middle is removed. A closed
 * contact follows a curved gap: the direction of its normal turns, and its rate changes by h b'' in a step. */
static double following_rate_of(const kt_simulation *simulation, int k, double h, double begin) {
    const struct kt_contacts *c = simulation->contacts;
    const double turn = h * c->item[k].sign * c->drift[kt_contact_row(c->all, &c->item[k])];
    return fmax(simulation->contact_state[k].closed != 0 ? fmin(-begin, 2.0 * turn) : -begin, 0.0);
}

/* The law of a contact: whether the contact bounces, and otherwise the least rate at the end. */
static void set_law(const kt_simulation *simulation, int i, double h) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const int k = m->item[i];
    const kt_loop_record *loop = &simulation->model->loop[c->item[k].loop];
    const double begin = m->begin[m->first[i]], fall = begin - m->free[m->first[i]];
    const double rounding = fmin(kt_moreau_tolerance(c) / h, fall);
    const bool bounces = loop->restitution > 0.0 && -begin > fmax(loop->rest_velocity, fall);
    m->e[i] = bounces ? loop->restitution : 0.0;
    m->bound[i] = fmin(-c->gap[k] / h, fmax(following_rate_of(simulation, k, h, begin), rounding));
}

/* The dry force of a joint that slips at the rate v: the force of its effect, without the viscous part. A joint is at
 * rest if the cone solver's residual explains its rate: a part of the `change` of the rate without impulses. */
static double dry_force_of(const kt_simulation *simulation, const kt_contact *item, double v, double change) {
    kt_effect_record effect = *kt_effect_record_find(simulation->model, item->effect);
    effect.idle = false;
    if (fabs(v) <= settled * fabs(change))
        return kt_contact_limit(simulation->model, item);
    effect.direction = v > 0.0 ? 1.0 : -1.0;
    effect.viscous = 0.0;
    return fabs(
        kt_value(kt_effect_kind_of(effect.type)
                     ->joint_force(&effect, simulation->model->number, kt_real_of(0.0), kt_real_of(v), 0.0, NULL)));
}

/* Adds all dry friction of joints that acts. */
static void add_dry_friction(kt_simulation *simulation, const double *v) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    for (int k = c->sides; k < c->n; k++) {
        if (kt_contact_rubs(c, k) || kt_contact_is_released(&c->item[k]) || m->item_of[k] == KT_MOREAU_HELD)
            continue;
        m->limit[add_moreau_item(simulation, k, v)] = 0.0; /* kt_moreau_take_free finds it */
    }
    m->dry = m->count;
}

/* ---- responses --------------------------------------------------------------------------------------------------- */

/* Factors the mass matrix of the model without closed contacts, at the positions of the step. */
static kt_status prepare_inverse(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const kt_model *open = open_model(simulation);
    kt_mass_inverse *inverse = NULL;
    kt_status status = kt_mass_inverse_init(open, 0, c->inverse_memory, c->inverse_size, &inverse, error);
    if (open != simulation->model)
        kt_data_rebind(open, simulation->data);
    if (status == KT_OK)
        status = kt_mass_inverse_compute(inverse, simulation->data, m->t, m->y, error);
    if (open != simulation->model)
        kt_data_rebind(simulation->model, simulation->data);
    m->has_inverse = status == KT_OK;
    return status;
}

/* The item of a row of the selected island. */
static int item_of_row(const kt_simulation *simulation, int row) {
    const struct kt_contacts *c = simulation->contacts;
    const int k = c->list[row];
    return simulation->moreau->item_of[kt_contact_rubs(c, k) ? c->item[k].of : k];
}

/* Adds the new rows of the selected island to W, if it is stored. */
static void extend_W(const kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    const int stride = c->selected->stored;
    for (int s = 0; c->touching <= stride && s < c->touching; s++)
        for (int r = s > c->selected->known ? s : c->selected->known; r < c->touching; r++) {
            const bool couples =
                kt_moreau_couples(simulation->moreau, item_of_row(simulation, s), item_of_row(simulation, r));
            c->W[(ptrdiff_t)s * stride + r] = couples ? kt_contacts_product(c, s, r) : 0.0;
            c->W[(ptrdiff_t)r * stride + s] = c->W[(ptrdiff_t)s * stride + r];
        }
}

/* Responses to the rows that are new, and their entries of W. Islands share columns, so that known rows that share the
 * column of a new row respond once more. */
static kt_status respond_to_rows(kt_simulation *simulation, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    int from = INT_MAX;
    kt_status status = simulation->moreau->has_inverse ? KT_OK : prepare_inverse(simulation, error);
    for (int i = 0; i < c->islands; i++)
        if (c->island[i].known < c->island[i].touching && c->island[i].known < from)
            from = c->island[i].known;
    const int columns = kt_contacts_write_columns(c, from);
    if (status == KT_OK && columns > 0)
        status = kt_mass_inverse_apply((kt_mass_inverse *)(void *)c->inverse_memory, columns,
                                       c->response + (size_t)from * simulation->size.nv, error);
    for (int i = 0; status == KT_OK && i < c->islands; i++)
        if (kt_contacts_select(c, i) && c->selected->known < c->touching) {
            extend_W(simulation);
            c->selected->known = c->touching;
        }
    return status;
}

/* Whether a contact closes within the step at the velocities m->after. */
static bool is_closing(const kt_simulation *simulation, int k, double h) {
    const struct kt_contacts *c = simulation->contacts;
    return c->gap[k] + h * kt_contacts_rate(c, k, 0, simulation->moreau->after) < -kt_moreau_tolerance(c);
}

/* Whether a contact was closed in the last step, or touches and does not part, and does not bounce. Such a contact most
 * probably takes part, and has no influence if it opens, because its impulse is then zero. */
static bool is_closed(const kt_simulation *simulation, int k, const double *v) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_loop_record *loop = &simulation->model->loop[c->item[k].loop];
    const double rate = kt_contacts_rate(c, k, 0, v);
    const bool touches = rate <= 0.0 && fabs(c->gap[k]) <= kt_contact_touching * c->item[k].unit;
    return (simulation->contact_state[k].closed != 0 || touches) &&
           (!(loop->restitution > 0.0) || -rate <= loop->rest_velocity);
}

/* Adds contacts that take part, with the equations of their friction; begins: including those that are closed.
 * *any: whether there are some. */
static kt_status list_closing(kt_simulation *simulation, double h, const double *v, bool begins, bool *any,
                              kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    const kt_dynamic_state at = {.t = m->t, .q = m->y, .v = v};
    kt_status status = KT_OK;
    *any = false;
    for (int k = 0; status == KT_OK && k < c->sides; k++) {
        if (m->item_of[k] != KT_MOREAU_NO_PART || kt_contact_is_released(&c->item[k]) ||
            !(is_closing(simulation, k, h) || (begins && is_closed(simulation, k, v))))
            continue;
        if (c->item[k].of >= 0)
            status = find_item(c, c->item[k].of, &at, error);
        set_law(simulation, add_moreau_item(simulation, k, v), h);
        *any = true;
    }
    return status;
}

/* The largest depth of a contact in the position at which the step evaluates gaps (m or rad). */
static double depth_of(const struct kt_contacts *c) {
    double most = 0.0;
    for (int k = 0; k < c->sides; k++)
        if (!kt_contact_is_released(&c->item[k]))
            most = fmax(most, -c->gap[k]);
    return most;
}

/* The largest change of a rate of both bodies of a contact without impulses, m/s or rad/s, if they are at rest at the
 * beginning; 0 if they move. All contacts of two bodies rest, or none. */
static double change_at_rest(const kt_simulation *simulation, int k, const double *v) {
    const struct kt_contacts *c = simulation->contacts;
    const double *free = simulation->moreau->y + simulation->size.nq;
    double rate = 0.0, change = 0.0;
    for (int end = 0; end < 2; end++) {
        const kt_link *link = &c->all->link[c->all->loop[c->item[k].loop].link[end]];
        for (int j = link->v, last = j + kt_link_dofs(link); j < last; j++) {
            rate = fmax(rate, fabs(v[j]));
            change = fmax(change, fabs(free[j] - v[j]));
        }
    }
    return rate <= at_rest * change ? change : 0.0;
}

double kt_moreau_settled_gap(const kt_simulation *simulation, int k, double h) {
    const double *v = kt_integrator_state(simulation->integrator) + simulation->size.nq;
    return simulation->contact_state[k].closed != 0 ? h * settled * change_at_rest(simulation, k, v) : -1.0;
}

void kt_moreau_settle_gaps(kt_simulation *simulation, double h) {
    struct kt_contacts *c = simulation->contacts;
    for (int k = 0; k < c->sides; k++)
        if (fabs(c->gap[k]) <= kt_moreau_settled_gap(simulation, k, h))
            c->gap[k] = 0.0;
}

/* Responds to the items from `from` on. Excludes those whose gaps or joints other loops hold, so that impulses have no
 * lever (kt_contacts_spare_held). Their rates in the middle are not zero, since v belongs to the beginning. If loops
 * move, they may close a gap, or a joint slips. *again: some are excluded, and the others must be listed again. */
static kt_status respond_to_items(kt_simulation *simulation, int from, bool *again, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    double norm = 0.0;
    kt_status status = m->count > from ? respond_to_rows(simulation, error) : KT_OK;
    *again = false;
    if (status != KT_OK || m->count == from || open_model(simulation)->n.group == 0)
        return status;
    status = kt_contacts_find_unit(simulation, simulation->model, m->y, &norm, error);
    const double speed =
        fmax(kt_largest_speed(c->all, kt_integrator_state(simulation->integrator) + simulation->size.nq),
             kt_largest_speed(c->all, m->y + simulation->size.nq));
    for (int i = from; status == KT_OK && i < m->count; i++) {
        const int r = m->first[i];
        (void)kt_contacts_select(c, c->item[m->item[i]].island);
        const double own = kt_moreau_entry(c, r - c->selected->row, r - c->selected->row);
        const double rest = kt_slip_rest * speed * c->item[m->item[i]].unit / c->all->length;
        const bool closes = m->begin[r] < -rest || m->free[r] < -rest;
        const bool slips = i < m->dry && (closes || m->begin[r] > rest || m->free[r] > rest);
        if (slips || (c->all->driven && closes) || kt_contact_has_lever(c, m->item[i], own, norm))
            continue;
        m->item_of[m->item[i]] = KT_MOREAU_HELD;
        *again = true;
    }
    if (*again)
        drop_items(simulation, from);
    return status;
}

kt_status kt_moreau_begin(kt_simulation *simulation, double t, const double *v, kt_error *error) {
    assert(isfinite(t));
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    kt_status status = kt_moreau_find_gaps(c, simulation->model, &(kt_dynamic_state){t, m->y, v, NULL, NULL}, error);
    if (status != KT_OK)
        return status;
    m->counts.penetration = depth_of(c);
    m->has_inverse = false;
    m->t = t;
    clear_items(simulation);
    bool again = true;
    while (status == KT_OK && again) {
        add_dry_friction(simulation, v);
        status = respond_to_items(simulation, 0, &again, error);
    }
    return status;
}

void kt_moreau_renew_laws(kt_simulation *simulation, double h) {
    for (int i = simulation->moreau->dry; i < simulation->moreau->count; i++)
        set_law(simulation, i, h);
}

/* Velocities without contact impulses. The viscous part of dry friction acts now, at the mean velocity; the dry part is
 * an impulse up to h times its limit. No island has a solution yet, except those without items. */
void kt_moreau_take_free(kt_simulation *simulation, double h) {
    assert(h > 0.0);
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    double *free = m->y + simulation->size.nq;
    const double *begin = kt_integrator_state(simulation->integrator) + simulation->size.nq;
    for (int i = 0; i < m->dry; i++) {
        const kt_contact *item = &c->item[m->item[i]];
        m->limit[i] = h * dry_force_of(simulation, item, begin[item->v], free[item->v] - begin[item->v]);
        m->viscous[i] = kt_effect_record_find(simulation->model, item->effect)->viscous * m->middle[item->v];
        (void)kt_contacts_select(c, item->island);
        kt_moreau_add_response(simulation, i, 0, -h * m->viscous[i], free);
    }
    for (int i = 0; i < m->count; i++)
        for (int r = m->first[i], end = r + kt_moreau_rows(m, i); r < end; r++)
            m->free[r] = kt_contacts_rate(c, c->rows[r], c->components[r], free);
    kt_moreau_renew_laws(simulation, h);
    for (int i = 0; i < c->islands; i++)
        m->island[i].known = c->island[i].touching == 0 ? 0 : -1;
    kt_copy(m->after, free, simulation->size.nv * sizeof *free);
}

/* Items that remain after others are excluded are listed and excluded no more: the loop ends. */
kt_status kt_moreau_add_closing(kt_simulation *simulation, double h, const double *v, bool *any, kt_error *error) {
    assert(h > 0.0);
    const bool begins = simulation->moreau->count == simulation->moreau->dry;
    const int from = simulation->moreau->count;
    kt_status status = KT_OK;
    for (bool again = true; status == KT_OK && again;) {
        status = list_closing(simulation, h, v, begins, any, error);
        if (status == KT_OK)
            status = respond_to_items(simulation, from, &again, error);
    }
    return status;
}
