/* Impulses of closing contacts, u < 0. Let e be the coefficients of restitution. Newton's rule has one phase
 *
 *     u+ = u + W p,     0 <= p   complementary to   u+ + e min(u, 0) >= 0
 *
 * Poisson's rule (kt_loop.poisson) has two phases. Expansion returns the part e of the impulses of compression, or more
 * if a contact would otherwise penetrate
 *
 *     uC = u + W pC,    0 <= pC          complementary to   uC >= 0
 *     u+ = uC + W pE,   0 <= pE - e pC   complementary to   u+ >= 0
 *
 * Each phase includes friction (friction.c). If contacts of both rules close, those of Newton's rule take part
 * in both phases, and 0 <= pE is complementary to u+ + e min(u, 0) >= 0 in the second one. Contacts of Poisson's rule
 * without an impact do not count, since they may only rest on the same drive. A contact that closes below its rest
 * velocity has e = 0, so that a chain of ever lower bounces comes to rest. With Poisson's rule, the compared rate is
 * W_ii pC, which the contact's own impulse removes. Adaptive steps do not resolve a bounce whose height is below ten
 * tolerances, so that e = 0 for such a bounce, too. The height follows from e |u| and from the acceleration without
 * contacts. Fixed steps resolve the first EXACT instants of events within the length of a step. Behind these, e = 0 if
 * all further bounces end within that length. So the number of impacts within a step is bounded.
 *
 * The kinetic energy changes by p . (u + u+) / 2, and by the supply of moving loops. With Poisson's rule and without
 * friction, the energy never grows, for any restitutions. Compression dissipates pC'W pC / 2. Expansion returns the
 * least y . uC + y'W y / 2 of all y >= e pC, and pC is one of these y.
 *
 * Newton's rule can increase the energy if the impulse of another contact acts on a parting contact. With friction,
 * even one contact suffices (Kane 1984). A sphere between walls within its cones of friction cannot bounce at all. Then
 * all e are halved until impulses exist and the energy does not grow. With e = 0, it never grows. The summary counts
 * these impacts.
 *
 * The speed of a drive may jump. This is the limit of a fast ramp, in which contacts that are closed stay closed while
 * their reactions press. Therefore such contacts have e = 0, and the rates of their gaps before the jump are zero. With
 * the rates before and behind the ramp, all impulses dissipate -p . (u- + u+) / 2, which is the work of friction.
 *
 * Source: C. Glocker, F. Pfeiffer, Multiple impacts with friction in rigid multibody systems, Nonlinear Dynamics 7,
 * 1995.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "contact/contact.h"
#include "integrator/integrator.h"

#include <float.h>
#include <math.h>

enum { HALVINGS = 10, EXACT = 16 };
/* Slip below this part of its terms is their rounding. In a fast frame, slower slip than that of gaps is slip. */
static const double slip_rounding = 64.0 * DBL_EPSILON;

/* Begins a phase at the rates `from`, without impulses. */
static void begin_phase(const struct kt_contacts *c, const double *from, double *u, double *p) {
    kt_clear(p, (size_t)c->touching * sizeof *p);
    kt_copy(u, from, (size_t)c->touching * sizeof *u);
}

double kt_contacts_find_rates(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    double approach = 0.0, size;
    for (int k = 0; k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        c->selected->approach = 0.0;
        for (int i = 0; i < c->touching; i++) {
            c->u[i] = kt_contact_rate(c, i, &size);
            if (fabs(c->u[i]) <= (i < c->meeting ? kt_contact_rounding : slip_rounding) * size)
                c->u[i] = 0.0;
            if (i < c->meeting)
                c->selected->approach = fmax(c->selected->approach, -c->u[i] / c->item[c->list[i]].unit);
        }
        kt_contacts_find_grazing(simulation);
        for (int i = 0; c->selected->approach > 0.0 && i < c->meeting; i++)
            c->item[c->list[i]].leaves = false; /* after impulses, all reactions are possible */
        approach = fmax(approach, c->selected->approach);
    }
    return approach;
}

/* Whether the contact of row i was closed before drives struck. */
static bool is_struck(const kt_simulation *simulation, int i) {
    const struct kt_contacts *c = simulation->contacts;
    return c->strikes && i < c->meeting && kt_contact_is_closed(simulation->model, &c->item[c->list[i]]);
}

/* Whether a contact closes that may bounce, in any island. */
static bool any_bounces(const kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    bool any = false;
    for (int k = 0; k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        for (int i = 0; i < c->meeting; i++) {
            const kt_loop_record *loop = kt_contact_loop(simulation, i);
            any = any || (loop->restitution > 0.0 && c->u[i] < -loop->rest_velocity && !is_struck(simulation, i));
        }
    }
    return any;
}

/* Whether steps may not resolve a bounce. */
static bool may_be_unresolved(const kt_simulation *simulation) {
    return !(simulation->contacts->window > 0.0) && (simulation->step == 0.0 || simulation->memory.event_many > EXACT);
}

/* Whether contacts of Poisson's rule take part, with impulses p of compression if these are known. */
static bool any_is_poisson(const kt_simulation *simulation, const double *p) {
    const struct kt_contacts *c = simulation->contacts;
    bool any = false;
    for (int i = 0; i < c->meeting; i++) {
        const kt_loop_record *loop = kt_contact_loop(simulation, i);
        any = any || (loop->poisson && (p == NULL || kt_contacts_own(c, i) * p[i] > loop->rest_velocity));
    }
    return any;
}

/* Sets the restitutions. limits: steps may not resolve a bounce, and accelerations without contacts are known. Solves
 * the first phase of Poisson's rule, which is empty unless the impact involves a contact of that rule. */
static bool begin_impact(kt_simulation *simulation, bool limits) {
    const struct kt_contacts *c = simulation->contacts;
    kt_clear(c->bound, (size_t)c->meeting * sizeof *c->bound);
    kt_clear(c->least, (size_t)c->meeting * sizeof *c->least);
    begin_phase(c, c->u, c->u_mid, c->p_mid);
    if (any_is_poisson(simulation, NULL) && !kt_contacts_solve_phase(simulation, c->u_mid, c->p_mid))
        return false;
    if (!any_is_poisson(simulation, c->p_mid))
        begin_phase(c, c->u, c->u_mid, c->p_mid);
    for (int i = 0; i < c->meeting; i++) {
        const kt_loop_record *loop = kt_contact_loop(simulation, i);
        const double rate = loop->poisson ? kt_contacts_own(c, i) * c->p_mid[i] : -c->u[i];
        c->e[i] = rate > loop->rest_velocity && !is_struck(simulation, i) ? loop->restitution : 0.0;
        if (limits && c->e[i] > 0.0 && c->e[i] * rate <= kt_contact_unresolved(simulation, i))
            c->e[i] = 0.0;
    }
    return true;
}

/* Solves the phase in which contacts bounce, after the phase of compression. */
static bool solve_expansion(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    begin_phase(c, c->u_mid, c->u_end, c->p_end);
    for (int i = 0; i < c->meeting; i++) {
        const bool poisson = kt_contact_loop(simulation, i)->poisson;
        c->bound[i] = poisson ? 0.0 : -c->e[i] * fmin(c->u[i], 0.0);
        c->least[i] = poisson ? c->e[i] * c->p_mid[i] : 0.0;
    }
    return kt_contacts_solve_phase(simulation, c->u_end, c->p_end);
}

/* The rate of a row before the impact, or before drives struck. */
static double rate_before(const kt_simulation *simulation, int line) {
    const struct kt_contacts *c = simulation->contacts;
    const double *v = kt_integrator_state(simulation->integrator) + simulation->size.nq;
    double size;
    if (!c->strikes || is_struck(simulation, line))
        return c->strikes ? 0.0 : c->u[line];
    return kt_contacts_residual(c, c->list[line], c->component[line], v, c->rate, &size);
}

/* Adds the impulses of compression to those of expansion. Returns the energy that both phases
 * dissipate, -sum p (u- + u+) / 2. The rates u- are those before the impact, or behind the jump if drives struck.
 * Rounding of this energy is relative to *size, sum |p u| / 2. */
static double loss_of(const kt_simulation *simulation, double *size) {
    const struct kt_contacts *c = simulation->contacts;
    double lost = 0.0;
    *size = 0.0;
    for (int j = 0; j < c->problem->rows; j++) {
        const int line = c->problem->line[j];
        c->p_end[line] += c->p_mid[line];
        lost -= 0.5 * c->p_end[line] * (rate_before(simulation, line) + c->u_end[line]);
        *size += 0.5 * fabs(c->p_end[line] * c->u[line]);
    }
    return lost;
}

/* Finds the impulses of the selected island, with restitutions halved until impulses exist that raise no energy.
 * Returns whether such impulses exist. *lost: the energy that the impulses dissipate. limits: as in begin_impact. */
static bool find_impulses(kt_simulation *simulation, bool limits, double *lost) {
    struct kt_contacts *c = simulation->contacts;
    double size;
    bool found = begin_impact(simulation, limits), bounces = found;
    for (int halving = 0; bounces; halving++) {
        found = solve_expansion(simulation);
        *lost = found ? loss_of(simulation, &size) : 0.0;
        if (c->strikes || (found && !(*lost < -1e-12 * size)))
            break;
        bounces = false;
        for (int i = 0; i < c->meeting; i++) {
            bounces = bounces || c->e[i] > 0.0;
            c->e[i] = halving < HALVINGS ? 0.5 * c->e[i] : 0.0;
        }
        simulation->memory.contacts.reduced += halving == 0 && bounces;
    }
    return found;
}

/* Applies these impulses. */
static void apply_impulses(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    for (int i = 0; i < c->meeting; i++)
        simulation->memory.contacts.impacts +=
            c->p_end[i] > 0.0 && c->u[i] < -kt_contact_loop(simulation, i)->rest_velocity && !is_struck(simulation, i);
    for (int j = 0; j < c->problem->rows; j++) {
        const int line = c->problem->line[j];
        c->u[line] = c->u_end[line];
        kt_contacts_add_response(c, line, c->p_end[line], c->v);
    }
}

kt_status kt_contacts_apply_impact(kt_simulation *simulation, double t, double *lost, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const bool limits = may_be_unresolved(simulation) && any_bounces(simulation);
    if (limits) {
        const kt_status status =
            kt_contacts_find_free(simulation, t, kt_integrator_state(simulation->integrator), error);
        if (status != KT_OK)
            return status;
    }
    for (int i = 0; i < c->islands; i++) {
        double one = 0.0;
        if (!kt_contacts_select(c, i) || !(c->selected->approach > 0.0))
            continue;
        if (!find_impulses(simulation, limits, &one))
            return kt_contacts_reject(simulation, t, "impulses", error);
        *lost += fmax(one, 0.0);
        apply_impulses(simulation);
    }
    return KT_OK;
}
