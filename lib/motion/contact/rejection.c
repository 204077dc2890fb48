/* Impacts and reactions that do not exist: error messages that name the cause.
 *
 * Prescribed motions (loops that are functions of time) reduce the degrees of freedom from which W = J M^-1 J' follows.
 * If prescribed motions alone determine the rates of contacts, u = J v - b', rows of W are dependent or zero. Impulses
 * then change these rates by rounding only, and the result of the complementarity problem with such a W is no solution.
 * After the projection of velocities onto the loops, a contact still closes.
 *
 * If n contacts are compressed together, the sum of their rates is prescribed. Therefore at least one of these rates is
 * at least the n-th part of that sum. If impulses exist, only rounding remains. Half of the smallest such part
 * separates the two cases. The message names the loops whose velocities contradict each other once these contacts are
 * closed.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "assembly/open_loops.h"
#include "base/copy.h"
#include "base/where.h"
#include "contact/contact.h"
#include "dynamics/dynamics.h"
#include "integrator/integrator.h"
#include "kinetree/algebra.h"
#include "kinetree/loop.h"
#include "kinetree/mechanism.h"
#include "model/switching.h"

#include <math.h>
#include <stdio.h>

/* Suffices for at most ten contacts; with more, the largest rate may be smaller. */
static const double kept = 0.05;
/* Rates above this part of the fastest approach belong to contacts that part. */
static const double rounding = 1e-9;
/* The least lever with which an impulse moves a body, relative to the mechanism's length. */
static const double lever = 1e-9;
/* Contradicting equations leave at least this part of the speed. */
static const double left = 1e-3;

/* The rate of the gap of row i, relative to its unit, 1/s: stops in radians and contacts in metres are compared. */
static double relative_rate(const struct kt_contacts *c, int i, const double *v) {
    return kt_contacts_rate(c, c->list[i], c->component[i], v) / c->item[c->list[i]].unit;
}

/* Returns the contact that closes fastest. If a model is given, only its closed contacts with equations of group g take
 * part. *speed: the speed of this contact relative to its unit, at least 0. */
static int find_fastest(struct kt_contacts *c, const kt_model *model, size_t g, const double *v, double *speed) {
    int fastest = 0;
    *speed = 0.0;
    for (int k = 0; k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        for (int i = 0; i < c->meeting; i++) {
            const kt_loop_record *loop = model != NULL ? &model->loop[c->item[c->list[i]].loop] : NULL;
            const double rate = relative_rate(c, i, v);
            if (!(-rate > *speed) || (loop != NULL && (kt_loop_is_off(loop) || (size_t)loop->group != g)))
                continue;
            fastest = c->list[i];
            *speed = -rate;
        }
    }
    return fastest;
}

static kt_where_text name_contact(const kt_simulation *simulation, int contact, double t) {
    return kt_where_at("contact", kt_loop_name(simulation->model, simulation->contacts->item[contact].loop), t);
}

/* Returns the fastest contact of a group whose velocity equations contradict each other after a projection, with its
 * *speed; -1: there is none. Groups do not act on each other, so that fast contacts of other groups do not hide a slow
 * drive. */
static int find_prescribed(struct kt_contacts *c, const kt_model *model, const kt_data *data, const double *v,
                           double *speed) {
    for (size_t g = 0; g < model->n.group; g++) {
        const int fastest = find_fastest(c, model, g, v, speed);
        const kt_group_work w = kt_group_matrices(model, data, g, KT_ROWS_ALL);
        double most = 0.0;
        for (int r = 0; r < w.k; r++)
            most = fmax(most, fabs(w.right[r]) / w.scale[r]);
        if (*speed > 0.0 && most > left * *speed)
            return fastest;
    }
    return -1;
}

/* Returns whether loops prescribe that contacts continue to close. If so, sets an error that names these loops. If not,
 * data belong to the simulation's model again. With `all`, contacts that part count, too: a body between a wall and the
 * jaw of a vice may part from one of them, but not from both. */
static bool is_prescribed(kt_simulation *simulation, double t, bool all, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *q = kt_integrator_state(simulation->integrator), *from = q + simulation->size.nq;
    const kt_model *model = simulation->model;
    double speed;
    char what[320];
    kt_error found;
    int fastest = -1;
    (void)find_fastest(c, NULL, 0, from, &speed);
    for (int k = 0; k < c->n; k++)
        c->item[k].next = KT_CONTACT_OFF;
    for (int k = 0; k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        for (int i = 0; i < c->meeting; i++)
            if (all || relative_rate(c, i, from) <= rounding * speed)
                c->item[c->list[i]].next = KT_CONTACT_ON;
    }
    const kt_model *closed = kt_contacts_model(simulation, true);
    kt_data_rebind(closed, simulation->data);
    kt_copy(simulation->a, from, simulation->size.nv * sizeof(double));
    if (speed > 0.0 &&
        kt_velocity_impact(closed, simulation->data, t, q, simulation->a, NULL, &found) == KT_ERROR_CONSTRAINT)
        fastest = find_prescribed(c, closed, simulation->data, from, &speed);
    if (fastest < 0) {
        kt_data_rebind(model, simulation->data);
        kt_phase_rebind(simulation);
        return false;
    }
    (void)snprintf(what, sizeof what,
                   "a prescribed motion drives it through its boundary at %.3g (m/s or rad/s), and no impulse can "
                   "stop this motion; end the motion earlier, apply it through a spring (joint_spring), or use an "
                   "elastic stop or contact (stiffness). These loops contradict each other",
                   speed * c->item[fastest].unit);
    (void)kt_open_loops_error(closed, simulation->data, t, what, KT_OPEN_VELOCITIES, &found);
    (void)kt_error_set(error, KT_ERROR_CONSTRAINT, name_contact(simulation, fastest, t).text, "%s", found.message);
    return true;
}

kt_status kt_contacts_find_unit(kt_simulation *simulation, const kt_model *open, const double *q, double *norm,
                                kt_error *error) {
    const double length = simulation->contacts->all->length;
    double *x = simulation->a;
    for (size_t i = 1; i < open->n.link; i++)
        for (int k = 0; k < kt_link_dofs(&open->link[i]); k++)
            x[open->link[i].v + k] = k < kt_link_lengths(&open->link[i]) ? length : 1.0;
    return kt_contacts_find_norm(simulation, open, q, x, norm, error);
}

bool kt_contact_has_lever(const struct kt_contacts *c, int k, double own, double norm) {
    const double unit = c->item[k].unit;
    return own * norm * norm > lever * lever * unit * unit;
}

/* Spares the rows of the selected island that other loops hold: forces have no lever against them, and they are at
 * rest. A contact (i < meeting) may part, dry friction may not slip either way. Returns whether any row was spared. */
static bool spare_held_of_island(const kt_simulation *simulation, double norm) {
    struct kt_contacts *c = simulation->contacts;
    bool any = false;
    double size;
    for (int i = 0; i < c->resting; i++) {
        const double rate = kt_contact_rate(c, i, &size);
        const double rest = kt_contact_resting(simulation, c->list[i]);
        if (kt_contact_has_lever(c, c->list[i], kt_contacts_own(c, i), norm) || rate < -rest ||
            (i >= c->meeting && rate > rest))
            continue;
        c->item[c->list[i]].spared = true;
        any = true;
    }
    return any;
}

kt_status kt_contacts_spare_held(kt_simulation *simulation, const kt_model *open, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *q = kt_integrator_state(simulation->integrator);
    double norm;
    bool any = false;
    for (int k = 0; k < c->islands; k++)
        any = any || c->island[k].resting > 0;
    if (open->n.group == 0 || !any)
        return KT_OK;
    const kt_status status = kt_contacts_find_unit(simulation, open, q, &norm, error);
    if (status != KT_OK)
        return status;
    any = false;
    for (int k = 0; k < c->islands; k++)
        if (kt_contacts_select(c, k))
            any = spare_held_of_island(simulation, norm) || any;
    if (!any)
        return KT_OK;
    kt_contacts_list_rows(simulation);
    return kt_contacts_find_response(simulation, open, t, q, error);
}

/* Checks row i of the selected island, with the scale |x| of W. */
static kt_status check_lever(kt_simulation *simulation, int i, double t, double norm, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    const int contact = c->list[i];
    const double rate = c->u[i];
    if (!(rate < 0.0) || kt_contact_has_lever(c, contact, kt_contacts_own(c, i), norm))
        return KT_OK;
    if (rate >= -kt_contact_resting(simulation, contact)) { /* such as 1e-42 m/s: a mechanism at rest */
        c->u[i] = 0.0;
        return KT_OK;
    }
    if (is_prescribed(simulation, t, false, error))
        return KT_ERROR_CONSTRAINT;
    return kt_error_set(error, KT_ERROR_CONSTRAINT, name_contact(simulation, contact, t).text,
                        "it closes at %.3g (m/s or rad/s), and no joint has a lever against it, so its impulse has "
                        "no bound; avoid this position (such as a rod that stands upright on its lift), or use an "
                        "elastic stop or contact (stiffness)",
                        -rate);
}

kt_status kt_contacts_check_levers(kt_simulation *simulation, const kt_model *open, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    double norm;
    kt_status status =
        kt_contacts_find_unit(simulation, open, kt_integrator_state(simulation->integrator), &norm, error);
    for (int k = 0; status == KT_OK && k < c->islands; k++) {
        (void)kt_contacts_select(c, k);
        for (int i = 0; status == KT_OK && i < c->meeting; i++)
            status = check_lever(simulation, i, t, norm, error);
    }
    return status;
}

kt_status kt_contacts_check_rates(kt_simulation *simulation, double t, const double *v, double approach,
                                  kt_status status, kt_error *error) {
    double speed = approach;
    if (status == KT_OK)
        (void)find_fastest(simulation->contacts, NULL, 0, v, &speed);
    return approach > 0.0 && speed > kept * approach && (status == KT_OK || status == KT_ERROR_CONSTRAINT) &&
                   is_prescribed(simulation, t, false, error)
               ? KT_ERROR_CONSTRAINT
               : status;
}

kt_status kt_contacts_reject(kt_simulation *simulation, double t, const char *what, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    const int first = c->list[0], others = c->meeting - 1;
    const bool is_rough = c->touching > c->resting;
    if (is_prescribed(simulation, t, false, error) || is_prescribed(simulation, t, true, error))
        return KT_ERROR_CONSTRAINT;
    return kt_error_set(
        error, KT_ERROR_CONSTRAINT, name_contact(simulation, first, t).text,
        "no %s separate it and the %d other touching contacts: they wedge each other%s; leave a gap, or "
        "use an elastic stop or contact (stiffness)",
        what, others, is_rough ? ", or friction has no solution (Painleve's paradox)" : "");
}
