/* The certificate of hard contacts: each record of a run, and each decision, satisfies the law.
 *
 *   signs         a closed contact pushes, N >= 0
 *   cones         |T| <= mu N of a contact that sticks, and |tau| <= S of a dry joint that sticks
 *   open          g >= 0, and g'' >= 0 if g = 0 and g' <= 0
 *   Newton's law  M a + h = tau + J' lambda, in each coordinate of each body
 *
 * Slip has no residual of its own: its friction is computed as mu N against the slip. The force of a single foot may
 * be zero. Therefore forces are compared with the largest force of their island, in the weights of its contacts
 * (cone/statics.h). Records between two steps have the errors of the steps. Each residual of Newton's law is compared
 * with the sum of the magnitudes of its terms, so that no bound has a unit. A contact that is held (directions.c)
 * may disobey its limit. Steps that begin with such a force are counted, with the largest excess.
 *
 * Newton's law is tested with inverse dynamics, which use neither the mass matrix, nor W, nor the factors of the
 * equations. The multipliers of loops and contacts, whose signs and cones are tested, are those of the record, or of an
 * evaluation in its state if it has no reactions. Cost: O(n). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "base/where.h"
#include "cone/statics.h"
#include "contact/contact.h"
#include "dynamics/dynamics.h"
#include "evaluate/load_friction.h"
#include "integrator/integrator.h"
#include "kinetree/algebra.h"
#include "kinetree/mechanism.h"
#include "model/switching.h"
#include "reduction/kernel.h"

#include <float.h>
#include <math.h>

/* A recorded reaction is wrong beyond errors of steps if its error exceeds this part of the largest one along its
 * step. */
static const double wrong = 1e-6;
/* Newton's law is violated if its residual exceeds this part of its terms. */
static const double balanced = 1e-9;
/* Behind a force beyond its bound, a hold ends within this part of the own time. Slow slip is implicit for as long
 * (evaluate/slip_prediction.c). */
static const double lasting = 1.2e-6;
/* An open contact touches up to this part of its unit, which is rounding of its gap. */
static const double touching = 64.0 * DBL_EPSILON;

/* ---- signs and cones --------------------------------------------------------------------------------------------- */

/* The largest force of an island in the weights of its contacts (cone/statics.h). Rounding of each force is relative to
 * this load, since the force of a single foot may be zero. */
static double load_of_island(const kt_simulation *simulation, const double *multiplier, int island) {
    const struct kt_contacts *c = simulation->contacts;
    double load = 0.0;
    for (int k = 0; k < c->n; k++)
        if (c->item[k].island == island && kt_contact_is_closed(simulation->model, &c->item[k]) &&
            !kt_contact_rubs(c, k))
            load = fmax(load, fabs(multiplier[kt_contact_row(simulation->model, &c->item[k])]) *
                                  sqrt(simulation->contact_state[k].metric));
    return load;
}

/* Returns the reserve of a closed contact until it opens, or of friction that sticks until its limit. *size: the scale
 * of the reserve. */
static double reserve_of(const kt_simulation *simulation, const double *multiplier, int k, double *size) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_model *model = simulation->model;
    const kt_contact *contact = &c->item[k];
    const bool rubs = kt_contact_rubs(c, k);
    const int at = rubs ? contact->of : k;
    const double *force = multiplier + kt_contact_row(model, contact);
    const double normal = c->item[at].sign * multiplier[kt_contact_row(model, &c->item[at])];
    const double metric = simulation->contact_state[at].metric, opens_at = simulation->contact_state[at].opens_at;
    const kt_effect_record *effect = k < c->sides || rubs ? NULL : kt_effect_record_find(model, contact->effect);
    const double load =
        effect == NULL ? 0.0 : kt_load_friction_find(model, simulation->data, effect, *force > 0.0 ? -1.0 : 1.0);
    const double limit = rubs           ? kt_contact_coefficient(model, contact) * (normal - opens_at)
                         : k < c->sides ? 0.0
                                        : fmax(effect->coulomb, effect->breakaway) + load;
    *size = fmax(fmax(fabs(normal), limit), simulation->event_memory[at].size);
    *size = fmax(*size, metric > 0.0 ? load_of_island(simulation, multiplier, contact->island) / sqrt(metric) : 0.0);
    return rubs ? limit - kt_hypot(force[0], force[1]) : k < c->sides ? normal - opens_at : limit - fabs(normal);
}

/* Whether the law bounds the force of item k: it is closed, and not friction of an open contact. */
static bool has_bound(const kt_simulation *simulation, int k) {
    const struct kt_contacts *c = simulation->contacts;
    return kt_contact_is_closed(simulation->model, &c->item[k]) &&
           !(kt_contact_rubs(c, k) && !kt_contact_is_closed(simulation->model, &c->item[c->item[k].of]));
}

/* Whether the force of item k must obey its bound: the item is not held. */
static bool is_bounded(const kt_simulation *simulation, double t, int k) {
    return has_bound(simulation, k) && !(t < simulation->contact_state[k].held);
}

kt_status kt_contacts_check_reserves(const kt_simulation *simulation, double t, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    for (int k = 0; k < c->n; k++) {
        double size;
        if (!is_bounded(simulation, t, k) ||
            !(reserve_of(simulation, simulation->multiplier, k, &size) < -wrong * size))
            continue;
        return kt_error_set(
            error, KT_ERROR_STEP, kt_where_at("contact", kt_loop_name(simulation->model, c->item[k].loop), t).text,
            "its reaction of %.3g (N or N m) %s: a step missed the instants at which it %s; bound the steps (max_step)",
            simulation->multiplier[kt_contact_row(simulation->model, &c->item[k])],
            k < c->sides ? "pulls" : "exceeds its friction", k < c->sides ? "opens and closes" : "slips and sticks");
    }
    return KT_OK;
}

/* ---- open contacts ----------------------------------------------------------------------------------------------- */

/* Whether the contact touches and does not part, up to rounding. Behind a time step that has left it at a gap below
 * zero, a contact that parts touches again at that gap (contact/bounded_step.c). */
static bool is_touching(const kt_simulation *simulation, int k) {
    const struct kt_contacts *c = simulation->contacts;
    const double gap = c->gap[k] - fmin(simulation->contact_state[k].closes_at, 0.0);
    const double *v = simulation->y + simulation->size.nq, T = simulation->memory.own_time, unit = c->item[k].unit;
    return gap <= touching * unit && kt_contacts_rate(c, k, 0, v) <= (T > 0.0 ? kt_contact_rounding * unit / T : 0.0);
}

/* Signorini's law of open contacts: the gap is not negative, and if it is zero and does not grow, its acceleration is
 * not negative. */
static kt_status check_open(const kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *q = simulation->y, *v = q + simulation->size.nq, T = simulation->memory.own_time;
    kt_status status = kt_contacts_find_equations(c, simulation->model, t, q, v, true, error);
    for (int k = 0; status == KT_OK && k < c->sides; k++) {
        double size;
        if (kt_contact_is_closed(simulation->model, &c->item[k]) || kt_contact_is_released(&c->item[k]))
            continue;
        const double a = kt_contacts_residual(c, k, 0, simulation->a, c->drift, &size);
        size = fmax(size, T > 0.0 ? c->item[k].unit / (T * T) : 0.0);
        const bool penetrates = !(c->gap[k] >= -kt_contact_deep * c->item[k].unit);
        if (penetrates || (is_touching(simulation, k) && !(a >= -wrong * size)))
            status = kt_error_set(
                error, KT_ERROR_STEP, kt_where_at("contact", kt_loop_name(simulation->model, c->item[k].loop), t).text,
                penetrates
                    ? "it is open at a gap of %.3g (m or rad): a step missed the instant at which it closes; bound "
                      "the steps (max_step)"
                    : "it touches without a reaction, and accelerates by %.3g (m/s^2 or rad/s^2) into its "
                      "boundary: no reaction was found; take an elastic contact (stiffness)",
                penetrates ? c->gap[k] : a);
    }
    return status;
}

/* ---- Newton's law ------------------------------------------------------------------------------------------------ */

/* Subtracts J' lambda of all loops from the residuals, and adds its terms to the sizes. */
static void add_loops(const kt_simulation *simulation, double *left, double *size) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_model *model = simulation->model, *all = c->all;
    for (size_t i = 0; i < model->n.loop; i++) {
        const kt_loop_record *loop = &all->loop[i];
        const kt_group *group = kt_loop_is_off(&model->loop[i]) ? NULL : &all->group[loop->group];
        for (int r = 0; group != NULL && r < loop->row_count; r++) {
            const double *J = c->jacobian + kt_loop_entry(group, loop, r);
            for (int j = 0; j < group->v_count; j++) {
                const double force = J[j] * simulation->multiplier[model->loop[i].equation + r];
                left[all->group_v[group->v + j]] -= force;
                size[all->group_v[group->v + j]] += fabs(force);
            }
        }
    }
}

/* Evaluates inverse dynamics with data of c->all, so that results of the record stay. */
static kt_status invert(const kt_simulation *simulation, const kt_dynamic_state *at, const double *a,
                        const kt_wrench *external, double *tau, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    return kt_inverse_trusted(c->all, c->data, at->q, at->v, a, external, tau, error);
}

/* The size of the terms that the wrench of a joint has in the joint's coordinates. */
static double size_in_joint(const kt_simulation *simulation, int body) {
    const kt_wrench *w = &simulation->reaction[body];
    return kt_vec3_norm(w->force) * simulation->model->length + kt_vec3_norm(w->moment);
}

static kt_status reject_newton(const kt_simulation *simulation, double t, int body, double left, double size,
                               kt_error *error) {
    return kt_error_set(error, KT_ERROR_STEP, kt_where_at("body", kt_body_name(simulation->model, body), t).text,
                        "Newton's law is violated by %.3g of %.3g N m: its contacts, loops and drives have no forces "
                        "that move it as recorded, as next to a singular position; start elsewhere, or replace a "
                        "contact by an elastic one (stiffness)",
                        left, size);
}

/* Whether forces exist that this check does not add up: of masses that vary, and of teeth on their bearings. */
static bool has_other_forces(const kt_simulation *simulation) {
    const kt_model *model = simulation->model;
    return model->n.varying > 0 || model->n.load > 0 || simulation->size.balanced > 0;
}

/* The factor that makes a moment of a force in coordinate k of a link. */
static double to_moment(const kt_model *model, const kt_link *link, int k) {
    return k < kt_link_lengths(link) ? model->length : 1.0;
}

/* Links of a tree follow each other. */
kt_status kt_contacts_compare_newton(const kt_simulation *simulation, double t, const double *left, const double *size,
                                     kt_error *error) {
    const kt_model *model = simulation->model;
    const kt_link *link = model->link;
    for (size_t i = 1, end; i < model->n.link; i = end) {
        double most = 0.0;
        for (end = i; end < model->n.link && (end == i || link[end].parent > 0); end++) {
            most = fmax(most, simulation->steps_over_contacts ? 0.0 : size_in_joint(simulation, link[end].body));
            for (int k = 0; k < kt_link_dofs(&link[end]); k++)
                most = fmax(most, to_moment(model, &link[end], k) * size[link[end].v + k]);
        }
        for (size_t j = i; j < end; j++)
            for (int k = 0; k < kt_link_dofs(&link[j]); k++) {
                const double residual = to_moment(model, &link[j], k) * fabs(left[link[j].v + k]);
                if (!(residual <= fmax(balanced * most, DBL_MIN)))
                    return reject_newton(simulation, t, link[j].body, residual, most, error);
            }
    }
    return KT_OK;
}

/* Newton's law: M a + h - tau - J'lambda = 0 up to a part of the sum of the sizes of its terms. Requires the equations
 * of check_open. */
static kt_status check_newton(const kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const kt_model *model = simulation->model;
    const double *q = simulation->y, *v = q + simulation->size.nq;
    double *whole = c->a, *size = c->flight, *left = c->v;
    kt_dynamic_state at = {t, q, v, simulation->tau, simulation->external};
    kt_effects_recall(model, simulation->data, &at);
    const kt_wrench *external = model->n.slip > 0 ? kt_slip_load(model, simulation->data, at.external) : at.external;
    const double *tau = model->n.loaded > 0 ? simulation->data->load_tau : at.tau != NULL ? at.tau : model->zero;
    kt_status status = invert(simulation, &at, NULL, NULL, size, error);
    if (status == KT_OK)
        status = invert(simulation, &at, simulation->a, NULL, whole, error);
    if (status == KT_OK)
        status = invert(simulation, &at, simulation->a, external, left, error);
    if (status != KT_OK)
        return status;
    for (size_t i = 0; i < model->n.v; i++) {
        size[i] = fabs(size[i]) + fabs(whole[i] - size[i]) + fabs(whole[i] - left[i]) + fabs(tau[i]);
        left[i] -= tau[i];
    }
    add_loops(simulation, left, size);
    return kt_contacts_compare_newton(simulation, t, left, size, error);
}

/* Without closed contacts, gaps alone are computed, which takes poses. A contact that penetrates counts as acting. */
bool kt_contacts_may_act(const kt_simulation *simulation, double t) {
    struct kt_contacts *c = simulation->contacts;
    const double *q = simulation->y;
    bool acts = false;
    for (int k = 0; k < c->n && !acts; k++)
        acts = kt_contact_is_closed(simulation->model, &c->item[k]);
    if (acts || c->sides == 0)
        return acts;
    kt_contacts_use_closed_model(c, simulation->model);
    const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(c->all);
    kernels->pose(c->all, c->data, q);
    for (int k = 0; k < c->sides && !acts; k++) {
        const kt_contact *contact = &c->item[k];
        const double residual = kernels->first_row(c->all, c->data, (size_t)contact->loop, t, q, NULL).residual;
        acts = !kt_contact_is_released(contact) && !(contact->sign * residual > touching * contact->unit);
    }
    return acts;
}

kt_status kt_contacts_check_record(const kt_simulation *simulation, double t, kt_error *error) {
    kt_status status = kt_contacts_check_reserves(simulation, t, error);
    if (status == KT_OK)
        status = check_open(simulation, t, error);
    return status == KT_OK && !has_other_forces(simulation) ? check_newton(simulation, t, error) : status;
}

/* ---- contacts that are held -------------------------------------------------------------------------------------- */

static bool any_sticks(const struct kt_contacts *c, const kt_model *model) {
    bool any = false;
    for (int k = c->sides; k < c->n; k++)
        any = any || (kt_contact_rubs(c, k) && kt_contact_is_closed(model, &c->item[k]));
    return any;
}

/* Finds the largest force beyond its bound at the beginning of a step, from the values of events there. With adaptive
 * steps, the hold soon ends behind such a force: friction cannot hold the contact any more. */
void kt_contacts_find_excess(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    const double *multiplier = any_sticks(c, simulation->model) ? c->reaction : c->row;
    c->excess = (kt_contact_excess){.steps = 0};
    for (int k = 0; k < c->n; k++) {
        double size, *held = &simulation->contact_state[k].held;
        if (!kt_contact_is_held(simulation, k) || !has_bound(simulation, k))
            continue;
        const bool rubs = kt_contact_rubs(c, k);
        const double reserve = reserve_of(simulation, multiplier, k, &size);
        const double part = rubs ? fmin(kt_contact_coefficient(simulation->model, &c->item[k]), 1.0) : 1.0;
        if (reserve < -wrong * size && !(simulation->step > 0.0))
            *held = fmin(*held, kt_integrator_time(simulation->integrator) + lasting * simulation->memory.own_time);
        if (reserve < -wrong * size && -reserve > c->excess.most * part * size)
            c->excess = (kt_contact_excess){.steps = 1,
                                            .most = -reserve / (part * size),
                                            .time = kt_integrator_time(simulation->integrator),
                                            .loop = c->item[rubs ? c->item[k].of : k].loop};
    }
}

/* Counts a step that began with a force beyond its bound. */
kt_status kt_contacts_count_excess(kt_simulation *simulation, kt_error *error) {
    const kt_contact_excess *now = &simulation->contacts->excess;
    kt_contact_excess *all = &simulation->memory.excess;
    const uint64_t steps = all->steps + now->steps;
    (void)error;
    *all = now->most > all->most ? *now : *all;
    all->steps = steps;
    return KT_OK;
}

/* ---- an instant -------------------------------------------------------------------------------------------------- */

bool kt_contact_breaks_law(const kt_simulation *simulation, int k, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    const double t = kt_integrator_time(simulation->integrator);
    double size;
    if (!is_bounded(simulation, t, k))
        return false;
    (void)reserve_of(simulation, c->row, k, &size);
    return c->value[k] < -wrong * size &&
           kt_error_set(error, KT_ERROR_STEP,
                        kt_where_at("contact", kt_loop_name(simulation->model, c->item[k].loop), t).text,
                        "its reaction %s by %.3g of %.3g (N or N m), as contacts were decided: no other forces were "
                        "found; take an elastic contact (stiffness)",
                        k < c->sides ? "pulls" : "exceeds its friction", -c->value[k], size) != KT_OK;
}
