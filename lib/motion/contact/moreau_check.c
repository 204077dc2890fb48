/* The law of a time step (moreau.c), checked at the end of each step:
 *
 *   normal impulses  p_n >= 0 and u_n >= r, of which one is an equation
 *   friction         |p_t| <= mu p_n, or |p| <= h S of dry friction; against slip if there is slip
 *   Newton's law     M (v+ - vf) = J' p,  with the velocities vf without impulses
 *
 * Rates belong to the motion of the bodies at v+, and inverse dynamics multiplies with M. So the check uses neither W
 * nor the factors of the equations. Only units need W. With the weight s of an item, as in the cone solver, p / s and
 * s u have one unit. Each is compared with the largest of these numbers in the island. M and J belong to the middle
 * before its displacement (m->position). Impulses that the cone solver did not find are counted (failures), and
 * Newton's law alone is checked for them. With other loops, it is not checked, because a step does not compute their
 * impulses.
 *
 * Cost: O(n). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/moreau.h"

#include "base/where.h"
#include "dynamics/dynamics.h"
#include "kinetree/algebra.h"
#include "model/switching.h"

#include <float.h>
#include <math.h>

/* A law is violated beyond this part of the largest impulse or rate: ten times the residual of the cone solver. */
static const double violated = 1e-6;
/* This part of the terms of a rate counts as a rate: their rounding, kt_contact_rounding, is no violation. */
static const double rounding = 1e-5;

/* Writes the impulses of chosen item j, its rates at v+ and its limit in the weight s. This is 1 / sqrt of the largest
 * number on the diagonal of the item's block of W. Returns the largest of the impulses, and of the rates without
 * impulses. */
static double scale_item(const kt_simulation *simulation, int j) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    const int i = m->chosen[j], rows = kt_moreau_rows(m, i), first = m->first[i];
    double size = 0.0, most = 0.0, terms;
    for (int k = 0, r = first - c->selected->row; k < rows; k++, r++)
        most = fmax(most, kt_moreau_entry(c, r, r));
    const double s = most > 0.0 ? 1.0 / sqrt(most) : 1.0;
    m->limits[j] = m->limit[i] < 0.0 ? -1.0 : m->limit[i] / s;
    for (int k = 0, r = first; k < rows; k++, r++) {
        const double least = k == 0 && m->limit[i] < 0.0 ? kt_moreau_bound(m, i) : 0.0;
        m->impulse[3 * j + k] = m->p[3 * i + k] / s;
        const double rate = kt_contacts_residual(c, c->rows[r], c->components[r], m->after, c->rate, &terms);
        m->b[3 * j + k] = (rate - least) * s;
        size = fmax(size, fmax(fabs(m->impulse[3 * j + k]), fmax(fabs(m->free[r] - least), rounding * terms) * s));
    }
    return most > 0.0 ? size : 0.0;
}

/* The residual of an item with the impulses p and the rates u, which is zero if its laws hold: Alart and Curnier's
 * function (cone/cone.h). S: the limit of dry friction, or negative. */
static double residual_of(const double *p, const double *u, int rows, double mu, double S) {
    const double z = p[0] - u[0], normal = fabs(p[0] - (S >= 0.0 ? fmax(-S, fmin(S, z)) : fmax(z, 0.0)));
    if (rows == 1)
        return normal;
    const double z1 = p[1] - u[1], z2 = p[2] - u[2], size = kt_hypot(z1, z2), R = mu * fmax(z, 0.0);
    const double part = size > R ? R / size : 1.0;
    return normal + kt_hypot(p[1] - part * z1, p[2] - part * z2) / (1.0 + mu);
}

/* Checks the items of the selected island. */
static kt_status check_island(const kt_simulation *simulation, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    const int count = kt_moreau_choose_island(simulation);
    double size = 0.0;
    for (int j = 0; j < count; j++)
        size = fmax(size, scale_item(simulation, j));
    for (int j = 0; j < count; j++) {
        const int i = m->chosen[j], loop = c->item[m->item[i]].loop;
        const double *p = m->impulse + 3 * j, *u = m->b + 3 * j;
        const double left = residual_of(p, u, kt_moreau_rows(m, i), m->mu[i], m->limits[j]);
        if (!(left <= fmax(violated * size, DBL_MIN))) /* subnormal numbers have lost their digits */
            return kt_error_set(
                error, KT_ERROR_STEP, kt_where_at("contact", kt_loop_name(simulation->model, loop), m->t).text,
                "its impulse of %.3g (N s or N m s) disobeys the law of its contact by %.2g of the largest impulse: no "
                "other impulses were found for this step; take a shorter step, or an elastic contact (stiffness)",
                m->p[3 * i], left / size);
    }
    return KT_OK;
}

/* Newton's law. Forces are impulses over h. Inverse dynamics with the accelerations v+ / h and vf / h differ by
 * M (v+ - vf) / h. Each is a term of the residual, so that rounding of velocities is no violation. */
static kt_status check_momentum(kt_simulation *simulation, double h, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    const kt_model *model = simulation->model;
    double *left = m->middle, *free = m->change, *size = c->flight;
    for (size_t j = 0; j < model->n.v; j++) {
        left[j] = m->after[j] / h;
        free[j] = m->y[model->n.q + j] / h;
    }
    kt_status status = kt_inverse_trusted(model, simulation->data, m->position, NULL, left, NULL, left, error);
    if (status == KT_OK)
        status = kt_inverse_trusted(model, simulation->data, m->position, NULL, free, NULL, free, error);
    for (size_t j = 0; j < model->n.v; j++) {
        size[j] = fabs(left[j]) + fabs(free[j]);
        left[j] -= free[j];
    }
    for (int i = 0; i < m->count; i++)
        for (int k = 0, r = m->first[i]; k < kt_moreau_rows(m, i); k++, r++) {
            const kt_contact_line line = kt_contact_line_of(c, &c->item[c->rows[r]], c->components[r]);
            for (int j = 0; j < line.count; j++) {
                const double force = line.sign * line.row[line.at[j]] * m->p[3 * i + k] / h;
                left[line.v[j]] -= force;
                size[line.v[j]] += fabs(force);
            }
        }
    return status == KT_OK ? kt_contacts_compare_newton(simulation, m->t, left, size, error) : status;
}

kt_status kt_moreau_check(kt_simulation *simulation, double h, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_status status = KT_OK;
    for (int k = 0; status == KT_OK && k < c->islands; k++)
        if (kt_contacts_select(c, k) && !simulation->moreau->island[k].fails)
            status = check_island(simulation, error);
    return status == KT_OK && simulation->groups == 0 ? check_momentum(simulation, h, error) : status;
}
