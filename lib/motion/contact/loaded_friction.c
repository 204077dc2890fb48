/* Friction of joints that sticks, with a limit that is proportional to a reaction (evaluate/load_friction.c).
 *
 * While friction sticks, its limit C + k(L) follows from the reactions of the present model, and events watch the
 * reserve. When friction decides between stick and slip, the limits depend on the decision: a set of joints that stick
 * determines the reactions, the reactions determine the limits, and the limits determine the set. The set is the fixed
 * point of this map. The iteration begins with the set in which all joints at rest stick. Therefore a joint that may
 * stick or slip sticks: a screw at rest that locks itself stays at rest.
 *
 * If no set reproduces itself, the friction has no solution at accelerations, and the instant is rejected. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/where.h"
#include "contact/contact.h"
#include "integrator/integrator.h"

#include <math.h>

enum { SETS_MAX = 64 };

/* The largest change of a limit, relative to the limit, at a fixed point. */
static const double same_limit = 1e-9;

/* The effect of item k if it is friction of a joint that is proportional to a load; else NULL. */
static const kt_effect_record *load_of(const kt_model *model, const struct kt_contacts *c, int k) {
    const kt_effect_record *effect =
        k < c->sides || kt_contact_rubs(c, k) ? NULL : kt_effect_record_find(model, c->item[k].effect);
    return effect != NULL && effect->load_slot > 0 ? effect : NULL;
}

bool kt_contacts_have_loads(const struct kt_contacts *c) { return c->all->n.loaded > 0; }

/* Whether the joint of dry friction k is at rest. */
static bool is_at_rest(const struct kt_contacts *c, int k) { return fabs(c->v[c->item[k].v]) <= c->rest_rate[k]; }

/* rests: friction of joints at rest is left out of accelerations (load_rests); false: all of it acts. */
void kt_contacts_put_rests(kt_simulation *simulation, bool rests) {
    const struct kt_contacts *c = simulation->contacts;
    for (int k = c->sides; kt_contacts_have_loads(c) && k < c->n; k++) {
        const kt_effect_record *effect = load_of(c->all, c, k);
        if (effect != NULL)
            simulation->data->load_rests[effect->load_slot - 1] = rests && is_at_rest(c, k);
    }
}

/* Sets the load of an item from the reactions, for a force of this friction. */
static void update_load(const kt_model *model, const kt_data *data, kt_contact *item, double force) {
    const kt_effect_record *effect = kt_effect_record_find(model, item->effect);
    item->load = kt_load_friction_find(model, data, effect, force > 0.0 ? -1.0 : 1.0);
}

void kt_contacts_update_loads(struct kt_contacts *c, const kt_model *model, const kt_data *data,
                              const double *multiplier) {
    for (int k = c->sides; kt_contacts_have_loads(c) && k < c->n; k++)
        if (load_of(model, c, k) != NULL && kt_contact_is_closed(model, &c->item[k]))
            update_load(model, data, &c->item[k], multiplier[kt_contact_row(model, &c->item[k])]);
}

kt_status kt_contacts_find_loads(struct kt_contacts *c, const kt_instant *at, kt_error *error) {
    const kt_dynamic_state state = {at->t, at->q, at->v, at->tau, at->external};
    const kt_status status =
        kt_motion_evaluate(at->model, at->data, &state, kt_links_scratch(at->data), at->data->load_joint, NULL, error);
    if (status == KT_OK)
        kt_contacts_update_loads(c, at->model, at->data, c->row);
    return status;
}

/* Finds the limits of friction at rest, the multipliers and the accelerations of the set that follows. *changes:
 * whether a limit changes. */
static kt_status find_limits(kt_simulation *simulation, double t, bool *changes, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *q = kt_integrator_state(simulation->integrator);
    const kt_model *model = kt_contacts_model(simulation, true);
    kt_data *data = simulation->data;
    kt_data_rebind(model, data);
    kt_simulation_use_states(simulation, q);
    const kt_dynamic_state at = {t, q, c->v, simulation->tau, simulation->external};
    kt_status status = kt_acceleration_trusted(model, data, &at, c->flight, error);
    if (status == KT_OK)
        status = kt_motion_complete(model, data, &at, c->flight, kt_links_scratch(data), data->load_joint, NULL, error);
    if (status == KT_OK && model->n.row > 0)
        status = kt_multipliers_take(model, data, t, c->row, error);
    *changes = false;
    for (int k = c->sides; status == KT_OK && k < c->n; k++) {
        kt_contact *item = &c->item[k];
        const double before = item->load;
        if (load_of(model, c, k) == NULL || !is_at_rest(c, k))
            continue;
        const double force = item->next == KT_CONTACT_ON     ? c->row[kt_contact_row(model, item)]
                             : item->next == KT_CONTACT_BACK ? 1.0
                                                             : -1.0;
        update_load(model, data, item, force);
        *changes = *changes || !(fabs(item->load - before) <= same_limit * kt_contact_limit(model, item));
    }
    return status;
}

/* Makes all friction at rest stick, unless its stick has ended at this instant. */
static void stick_at_rest(struct kt_contacts *c) {
    for (int k = c->sides; k < c->n; k++)
        if (is_at_rest(c, k) && !c->item[k].spared && !c->item[k].leaves && c->item[k].next != KT_CONTACT_RELEASED)
            c->item[k].next = KT_CONTACT_ON;
}

/* Whether the set that follows obeys the law: friction that sticks is within its limit, and friction that begins to
 * slip, at its limit, accelerates in its direction. c->row and c->flight have the multipliers and the accelerations of
 * this set. Contacts are left to the complementarity problem. If friction holds a motion in several ways, its sets may
 * alternate, although each obeys the law. */
static bool obeys_law(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_model *model = kt_contacts_model(simulation, true);
    bool obeys = true;
    for (int i = 0; i < c->islands; i++)
        obeys = obeys && c->island[i].meeting == 0;
    for (int k = c->sides; k < c->n && obeys; k++) {
        const kt_contact *item = &c->item[k];
        const double limit = kt_contact_limit(model, item);
        if (!is_at_rest(c, k) || item->spared || item->next == KT_CONTACT_RELEASED)
            continue;
        const double along = c->flight[item->v] * (item->next == KT_CONTACT_BACK ? -1.0 : 1.0);
        obeys = item->next == KT_CONTACT_ON ? fabs(c->row[kt_contact_row(model, item)]) <= limit
                                            : along >= -same_limit * limit * simulation->contact_state[k].metric;
    }
    return obeys;
}

kt_status kt_contacts_solve_loads(kt_simulation *simulation, double t, kt_contacts_solver *solve, bool again,
                                  double *lost, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    bool changes = true;
    for (int k = 0; k < c->n; k++)
        c->item[k].began = c->item[k].next;
    for (int i = 0; i < SETS_MAX && changes; i++) {
        for (int k = 0; k < c->n; k++)
            c->item[k].next = c->item[k].began;
        kt_status status = solve(simulation, t, again, lost, error);
        if (status == KT_OK && i == 0)
            stick_at_rest(c);
        if (status == KT_OK)
            status = find_limits(simulation, t, &changes, error);
        if (status != KT_OK || obeys_law(simulation))
            return status;
        changes = changes || i == 0;
    }
    return changes ? kt_error_set(error, KT_ERROR_CONSTRAINT, kt_where_format("t = %.9g s", t).text,
                                  "friction that is proportional to reactions neither sticks nor slips: the reactions "
                                  "of each contradict it (a jam); take less friction, or more inertia")
                   : KT_OK;
}
