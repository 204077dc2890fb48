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
 * even one contact suffices (Kane 1984). Then all e are halved until the energy does not grow, which e = 0 guarantees.
 * These impacts are counted.
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

#include <math.h>

enum { HALVINGS = 10, EXACT = 16 };

KT_ARENA_LAYOUT(lay_out_phase, kt_impact_phase, KT_IMPACT_PHASE_FIELDS, size_t n, size_t list)

size_t kt_impact_phase_size(size_t n, size_t list) { return lay_out_phase(NULL, n, list); }

kt_impact_phase *kt_impact_phase_init(size_t n, size_t list, void *memory) {
    (void)lay_out_phase(memory, n, list);
    return memory;
}

/* Begins a phase at the rates u, without impulses and bounds. */
static void clear_phase(const struct kt_contacts *c, const double *u, kt_impact_phase *phase) {
    const size_t normal = (size_t)c->meeting * sizeof(double), all = (size_t)c->touching * sizeof(double);
    phase->rows = 0;
    kt_clear(phase->bound, normal);
    kt_clear(phase->least, normal);
    kt_clear(phase->p, all);
    kt_copy(phase->u, u, all);
}

double kt_contacts_find_rates(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    double approach = 0.0, size;
    for (int k = 0; k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        c->selected->approach = 0.0;
        for (int i = 0; i < c->touching; i++) {
            c->u[i] = kt_contact_rate(c, c->W, i, &size);
            if (fabs(c->u[i]) <= kt_contact_rounding * size)
                c->u[i] = 0.0;
            if (i < c->meeting)
                c->selected->approach = fmax(c->selected->approach, -c->u[i] / c->item[c->list[i]].unit);
        }
        kt_contacts_find_grazing(simulation, c->u);
        for (int i = 0; c->selected->approach > 0.0 && i < c->meeting;
             i++) /* after impulses, all reactions are possible */
            c->item[c->list[i]].leaves = false;
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
        any = any || (loop->poisson && (p == NULL || kt_contacts_own(c, c->W, i) * p[i] > loop->rest_velocity));
    }
    return any;
}

/* Sets the restitutions. limits: steps may not resolve a bounce, and accelerations without contacts are known. The
 * first phase of Poisson's rule becomes *compression. This phase is empty unless the impact involves a contact of that
 * rule. */
static bool begin_impact(kt_simulation *simulation, const double *W, const double *u, bool limits,
                         kt_impact_phase *compression, double *e) {
    const struct kt_contacts *c = simulation->contacts;
    clear_phase(c, u, compression);
    if (any_is_poisson(simulation, NULL) && !kt_contacts_solve_phase(simulation, W, compression))
        return false;
    if (!any_is_poisson(simulation, compression->p))
        clear_phase(c, u, compression);
    for (int i = 0; i < c->meeting; i++) {
        const kt_loop_record *loop = kt_contact_loop(simulation, i);
        const double rate = loop->poisson ? kt_contacts_own(c, W, i) * compression->p[i] : -u[i];
        e[i] = rate > loop->rest_velocity && !is_struck(simulation, i) ? loop->restitution : 0.0;
        if (limits && e[i] > 0.0 && e[i] * rate <= kt_contact_unresolved(simulation, W, i))
            e[i] = 0.0;
    }
    return true;
}

/* Sets the phase in which contacts bounce, after the phase of compression. */
static void begin_expansion(const kt_simulation *simulation, const double *u, const double *e,
                            const kt_impact_phase *compression, kt_impact_phase *phase) {
    const struct kt_contacts *c = simulation->contacts;
    clear_phase(c, compression->u, phase);
    phase->rows = compression->rows;
    kt_copy(phase->line, compression->line, (size_t)compression->rows * sizeof *phase->line);
    for (int i = 0; i < c->meeting; i++) {
        const bool poisson = kt_contact_loop(simulation, i)->poisson;
        phase->bound[i] = poisson ? 0.0 : -e[i] * fmin(u[i], 0.0);
        phase->least[i] = poisson ? e[i] * compression->p[i] : 0.0;
    }
}

/* The rate of a row before the impact, or before drives struck. u: the rates between. */
static double rate_before(const kt_simulation *simulation, const double *u, int line) {
    const struct kt_contacts *c = simulation->contacts;
    const double *v = kt_integrator_state(simulation->integrator) + simulation->size.nq;
    double size;
    if (!c->strikes || is_struck(simulation, line))
        return c->strikes ? 0.0 : u[line];
    return kt_contacts_residual(c, c->list[line], c->component[line], v, c->rate, &size);
}

/* Adds the impulses of compression to p of the phase, whose rates are final. Returns the energy that both phases
 * dissipate, -sum p (u- + u+) / 2. *size: sum |p u| / 2, to which rounding of this energy is relative. u: the rates
 * before the impact; if drives struck, the rates behind the jump of drives. */
static double loss_of(const kt_simulation *simulation, const double *u, const kt_impact_phase *compression,
                      kt_impact_phase *phase, double *size) {
    double lost = 0.0;
    *size = 0.0;
    for (int j = 0; j < phase->rows; j++) {
        const int line = phase->line[j];
        phase->p[line] += compression->p[line];
        lost -= 0.5 * phase->p[line] * (rate_before(simulation, u, line) + phase->u[line]);
        *size += 0.5 * fabs(phase->p[line] * u[line]);
    }
    return lost;
}

/* Finds the impulses of the selected island, with Newton's restitutions halved until they do not raise the energy.
 * Returns whether such impulses exist. *lost: the energy that the impulses dissipate. limits: as in begin_impact. */
static bool find_impulses(kt_simulation *simulation, bool limits, double *lost) {
    struct kt_contacts *c = simulation->contacts;
    const double *W = c->W, *u = c->u;
    double *e = c->e, size;
    bool found = begin_impact(simulation, W, u, limits, c->compression, e);
    c->phase->rows = 0;
    for (int halving = 0; found; halving++) {
        begin_expansion(simulation, u, e, c->compression, c->phase);
        found = kt_contacts_solve_phase(simulation, W, c->phase);
        *lost = found ? loss_of(simulation, u, c->compression, c->phase, &size) : 0.0;
        if (!found || c->strikes || !(*lost < -1e-12 * size) || halving > HALVINGS)
            break;
        simulation->memory.contacts.reduced += halving == 0;
        for (int i = 0; i < c->meeting; i++)
            e[i] = halving < HALVINGS ? 0.5 * e[i] : 0.0;
    }
    return found;
}

/* Applies these impulses. */
static void apply_impulses(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    const kt_impact_phase *phase = c->phase;
    for (int i = 0; i < c->meeting; i++)
        simulation->memory.contacts.impacts +=
            phase->p[i] > 0.0 && c->u[i] < -kt_contact_loop(simulation, i)->rest_velocity && !is_struck(simulation, i);
    for (int j = 0; j < phase->rows; j++) {
        const int line = phase->line[j];
        c->u[line] = phase->u[line];
        kt_contacts_add_response(c, line, phase->p[line], c->v);
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
