/* The law of a time step (moreau.c), checked at the end of each step:
 *
 *   signs          p_n >= 0
 *   cones          |p_t| <= mu p_n;  |p| <= h S of dry friction
 *   rates of gaps  u_n >= r, and p_n = 0 or u_n = r
 *   slip           p_t = -mu p_n u_t / |u_t|, or u_t = 0
 *   Newton's law   M (v+ - vf) = J' p,  with the velocities vf without impulses
 *
 * Rates belong to the motion of the bodies at v+, and inverse dynamics multiplies with M. So the check uses neither W
 * nor the factors of the equations, except for units: the weight s of an item is that of the cone solver, and p / s and
 * s u are compared with the largest of these numbers in the island. Impulses that the cone solver did not find are
 * counted (failures), and not checked; Newton's law holds for them, too. Other loops have impulses that a step does not
 * compute, so that Newton's law is checked only without such loops. Contacts that take no part do not close within the
 * step, because add_impulses (moreau.c) ends only then.
 *
 * Cost: O(n). */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/moreau.h"

#include "base/where.h"
#include "dynamics/dynamics.h"
#include "kinetree/algebra.h"
#include "model/switching.h"

#include <math.h>

/* A law is violated beyond this part of the largest impulse or rate: ten times the residual of the cone solver. */
static const double violated = 1e-6;

/* ---- laws of contacts -------------------------------------------------------------------------------------------- */

/* The weight s of an item: 1 / sqrt of the largest number on the diagonal of its block of W. */
static double weight_of(const kt_simulation *simulation, int i) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    double most = 0.0;
    for (int k = 0, r = m->first[i] - c->selected->row; k < kt_moreau_rows(m, i); k++, r++)
        most = fmax(most, kt_moreau_entry(c, r, r));
    return most > 0.0 ? 1.0 / sqrt(most) : 1.0;
}

/* Writes the impulses of an item and its rates at v+, in its weight s. Returns the largest of the impulses, and of its
 * rates without impulses. */
static double scale_item(const kt_simulation *simulation, int i, double s, double *p, double *u) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    double size = 0.0;
    for (int k = 0; k < kt_moreau_rows(m, i); k++) {
        const int r = m->first[i] + k;
        const double least = k == 0 && m->limit[i] < 0.0 ? kt_moreau_bound(m, i) : 0.0;
        p[k] = m->p[3 * i + k] / s;
        u[k] = (kt_contacts_rate(c, c->rows[r], c->components[r], m->after) - least) * s;
        size = fmax(size, fmax(fabs(p[k]), fabs(m->free[r] - least) * s));
    }
    return size;
}

/* The law that the impulses p of an item violate by more than `most`, at the rates u; NULL: none. S: the limit of dry
 * friction, or negative. */
static const char *find_violation(const double *p, const double *u, int rows, double mu, double S, double most) {
    if (S >= 0.0)
        return !(fabs(p[0]) <= S + most)                                ? "exceeds its friction"
               : !(fabs(p[0] - fmax(-S, fmin(S, p[0] - u[0]))) <= most) ? "does not resist slip"
                                                                        : NULL;
    if (!(p[0] >= -most))
        return "pulls";
    if (!(u[0] >= -most))
        return "does not stop its approach";
    if (!(fmin(p[0], u[0]) <= most))
        return "pushes, although it parts";
    if (rows == 1)
        return NULL;
    const double across = (1.0 + mu) * most, z[2] = {p[1] - u[1], p[2] - u[2]}, size = kt_hypot(z[0], z[1]);
    const double R = mu * fmax(p[0], 0.0), part = size > R ? R / size : 1.0;
    return !(kt_hypot(p[1], p[2]) <= R + across)                           ? "exceeds its friction"
           : !(kt_hypot(p[1] - part * z[0], p[2] - part * z[1]) <= across) ? "does not resist slip"
                                                                           : NULL;
}

static kt_status reject_item(const kt_simulation *simulation, int i, const char *law, kt_error *error) {
    const kt_moreau *m = simulation->moreau;
    const int loop = simulation->contacts->item[m->item[i]].loop;
    return kt_error_set(error, KT_ERROR_STEP, kt_where_at("contact", kt_loop_name(simulation->model, loop), m->t).text,
                        "its impulse of %.3g (N s or N m s) %s: no other impulses were found for this step; take a "
                        "shorter step, or an elastic contact (stiffness)",
                        m->p[3 * i], law);
}

/* Checks the items of the selected island. */
static kt_status check_island(const kt_simulation *simulation, int island, kt_error *error) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    double size = 0.0, p[3], u[3];
    for (int i = 0; i < m->count; i++)
        if (c->item[m->item[i]].island == island)
            size = fmax(size, scale_item(simulation, i, weight_of(simulation, i), p, u));
    for (int i = 0; i < m->count; i++) {
        if (c->item[m->item[i]].island != island)
            continue;
        const double s = weight_of(simulation, i);
        (void)scale_item(simulation, i, s, p, u);
        const double S = m->limit[i] < 0.0 ? -1.0 : m->limit[i] / s;
        const char *law = find_violation(p, u, kt_moreau_rows(m, i), m->mu[i], S, violated * size);
        if (law != NULL)
            return reject_item(simulation, i, law, error);
    }
    return KT_OK;
}

/* ---- Newton's law ------------------------------------------------------------------------------------------------ */

/* Forces are impulses over h. Inverse dynamics with the accelerations v+ / h and vf / h differ by M (v+ - vf) / h. Each
 * of both is a term of the residual, so that rounding of velocities is no violation. */
static kt_status check_momentum(kt_simulation *simulation, double h, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const kt_moreau *m = simulation->moreau;
    const size_t nq = simulation->size.nq, nv = simulation->size.nv;
    double *left = m->middle, *free = m->change, *size = c->flight;
    for (size_t j = 0; j < nv; j++) {
        left[j] = m->after[j] / h;
        free[j] = m->y[nq + j] / h;
    }
    kt_status status = kt_inverse_trusted(simulation->model, simulation->data, m->y, NULL, left, NULL, left, error);
    if (status == KT_OK)
        status = kt_inverse_trusted(simulation->model, simulation->data, m->y, NULL, free, NULL, free, error);
    for (size_t j = 0; j < nv; j++) {
        size[j] = fabs(left[j]) + fabs(free[j]);
        left[j] -= free[j];
    }
    for (int i = 0; i < m->count; i++)
        for (int k = 0; k < kt_moreau_rows(m, i); k++) {
            const int r = m->first[i] + k;
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
            status = check_island(simulation, k, error);
    return status == KT_OK && simulation->groups == 0 ? check_momentum(simulation, h, error) : status;
}
