/* Values of the events of hard contacts: the gaps of open contacts, the reactions of closed ones, and the reserves or
 * the slip of friction. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"
#include "integrator/integrator.h"
#include "kinetree/algebra.h"

#include <math.h>

/* Slip of a contact has reversed at this part of its rate of rest against its first direction; rounding is less. */
static const double turned = 1e-3;

static double contact_direction_of(const kt_model *model, const kt_contact *contact) {
    return (model->set & contact->back) != 0 ? -1.0 : 1.0;
}

/* The slip of a joint along its direction. For a joint that is held (kt_contacts_find_held), slip counts from the rate
 * of rest. A joint without friction slips in either direction. */
static double slip_of_joint(const kt_model *model, const kt_contact *contact, const double *v) {
    const bool is_held = (contact->simulation->memory.held & contact->bit) != 0;
    const uint64_t both = contact->bit | contact->back;
    const double rest = kt_contact_resting(contact->simulation, contact->index);
    if (is_held && (model->set & both) == both)
        return 0.5 * rest - fabs(v[contact->v]);
    return contact_direction_of(model, contact) * v[contact->v] + (is_held ? rest : 0.0);
}

/* The event value of a contact: its gap, or its reaction. A contact that touches has not parted within the rounding of
 * its gap. Otherwise, in steps too short for the gap to change, rounding would open and close the contact without end.
 * The value of a contact that is held has no sign, so that the contact does not open. */
static double contact_value_of(const kt_contact *contact, double t, bool closed, double reaction) {
    const kt_contact_memory *memory = &contact->simulation->contact_state[contact->index];
    const double gap = contact->simulation->contacts->gap[contact->index];
    const bool touches = contact->simulation->event_memory[contact->index].side < 0;
    if (!closed)
        return touches && gap > memory->closes_at && gap <= memory->parts_at ? 0.0 : gap - memory->closes_at;
    return t < memory->held ? fabs(reaction - memory->opens_at) : reaction - memory->opens_at;
}

/* The event value of a contact's friction: the reserve of the cone, or the slip along its direction. */
static double friction_value_of(const struct kt_contacts *c, const kt_instant *at, int k) {
    const kt_model *model = at->model;
    const kt_contact *friction = &c->item[k], *contact = &c->item[friction->of];
    const double opens_at = friction->simulation->contact_state[friction->of].opens_at;
    if (!kt_contact_is_closed(model, contact))
        return 1.0;
    if (kt_contact_is_closed(model, friction)) {
        const double *tangent = c->reaction + kt_contact_row(model, friction);
        const double limit =
            kt_contact_coefficient(model, friction) * (c->reaction[kt_contact_row(model, contact)] - opens_at);
        const bool is_held = at->t < friction->simulation->contact_state[k].held;
        return is_held ? fabs(limit) : limit - kt_hypot(tangent[0], tangent[1]);
    }
    return kt_contact_slip_along(model, at->data, contact) - friction->simulation->contact_state[k].closes_at +
           turned * kt_contact_resting(friction->simulation, k);
}

/* The gaps of open contacts, and the reactions of closed ones. */
kt_status kt_contacts_find_values(struct kt_contacts *c, const kt_instant *at, kt_error *error) {
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
    if (status == KT_OK && presses && kt_contacts_have_loads(c))
        status = kt_contacts_find_loads(c, at, error);
    if (status == KT_OK && presses)
        kt_contacts_share_load(c, model, c->row);
    if (status == KT_OK && sticks)
        status = kt_contacts_find_reactions(c, at, false, error);
    for (int k = 0; status == KT_OK && k < c->n; k++) {
        const kt_contact *contact = &c->item[k];
        const bool closed = kt_contact_is_closed(model, contact);
        const bool shares = sticks && (k >= c->sides || kt_contact_shares_load(model, contact));
        const double *from = shares ? c->reaction : c->row;
        const double reaction = closed ? contact->sign * from[kt_contact_row(model, contact)] : 0.0;
        if (kt_contact_rubs(c, k))
            c->value[k] = friction_value_of(c, at, k);
        else if (kt_contact_is_released(contact))
            c->value[k] = 1.0;
        else if (k < c->sides)
            c->value[k] = contact_value_of(contact, at->t, closed, reaction);
        else
            c->value[k] =
                closed ? kt_contact_limit(model, contact) - fabs(reaction) : slip_of_joint(model, contact, at->v);
    }
    for (int k = 0; status == KT_OK && sticks && k < c->n; k++)
        if (!isnan(c->reserve[k]) && !(at->t < c->item[k].simulation->contact_state[k].held))
            c->value[k] = c->reserve[k];
    return status;
}

double kt_contact_value_margin(const kt_simulation *simulation, size_t k) {
    const struct kt_contacts *c = simulation->contacts;
    const double time = simulation->memory.own_time, depth = kt_contact_depth(&c->item[k]);
    if (kt_contact_is_closed(simulation->model, &c->item[k]))
        return 0.0;
    return (int)k < c->sides ? depth : time > 0.0 ? depth / time : 0.0;
}

double kt_contact_kink(const kt_simulation *simulation, size_t k) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_contact *contact = &c->item[k];
    const kt_loop_record *loop = &c->all->loop[contact->loop];
    double length[3];
    if ((int)k >= c->sides || loop->type != KT_LOOP_DISTANCE || contact->sign < 0.0 ||
        kt_contact_is_closed(simulation->model, contact))
        return 0.0;
    kt_curve_evaluate(&loop->curve, c->all->number, kt_integrator_time(simulation->integrator), length);
    return 2.0 * length[0];
}
