/* The rows of contacts that touch, and their response J M^-1 J' to forces in these rows. */
#include "contact/contact.h"

#include "control/mass_inverse.h"
#include "dynamics/dynamics.h"

#include <math.h>
#include <stdio.h>

/* No gap may be deeper than this part of the mechanism's length, or of 1 m or rad. */
static const double deep = 1e-6;

static void add_row(struct kt_contacts *c, int k, int component) {
    c->list[c->touching] = k;
    c->component[c->touching++] = component;
}

void kt_contacts_list_rows(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    const double most = kt_contact_touching * fmax(1.0, c->all->length);
    c->touching = 0;
    for (int k = 0; k < c->sides; k++) {
        const kt_contact *item = &c->item[k];
        const bool touches = c->gap[k] <= most || item->meets || kt_contact_is_closed(simulation->model, item);
        if (touches && !item->spared && !kt_contact_is_released(item))
            add_row(c, k, 0);
    }
    c->meeting = c->touching;
    for (int k = c->sides; k < c->n; k++)
        if (!kt_contact_rubs(c, k) && !kt_contact_is_released(&c->item[k]))
            add_row(c, k, 0);
    c->resting = c->touching;
    for (int i = 0; i < c->meeting; i++)
        for (int component = 0; component < 2 && c->item[c->list[i]].of >= 0; component++)
            add_row(c, c->item[c->list[i]].of, component);
}

/* Lists the contacts that touch, and all friction. Errors: a contact penetrates deeply. */
kt_status kt_contacts_find_touching(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double scale = fmax(1.0, c->all->length);
    char where[KT_WHERE_SIZE];
    for (int k = 0; k < c->sides; k++) {
        c->item[k].spared = false;
        if (kt_contact_is_released(&c->item[k]))
            continue;
        simulation->memory.beyond = c->gap[k] < -deep * scale;
        if (simulation->memory.beyond) {
            snprintf(where, sizeof where, "contact '%.60s' at t = %.9g s", kt_loop_name(c->all, c->item[k].loop), t);
            return kt_error_set(error, KT_ERROR_CONSTRAINT, where,
                                "'%.60s' is %.3g (m or rad) beyond its boundary; begin on its free side, or bound the "
                                "steps (max_step) if it was there at the start",
                                kt_loop_name(c->all, c->item[k].loop), -c->gap[k]);
        }
    }
    kt_contacts_list_rows(simulation);
    return KT_OK;
}

/* Computes M^-1 J' and W, or its diagonal, of the mechanism with all contacts open, from data of the simulation. */
kt_status kt_contacts_find_response(kt_simulation *simulation, const kt_model *open, double t, const double *q,
                                    double *W, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const size_t nv = open->n.v;
    const int m = c->touching;
    kt_mass_inverse *inverse = NULL;
    for (int i = 0; i < m; i++)
        for (size_t j = 0; j < nv; j++)
            c->response[(size_t)i * nv + j] = kt_contact_entry(c, i, j);
    kt_status status = kt_mass_inverse_init(open, 0, c->inverse_memory, c->inverse_size, &inverse, error);
    if (status == KT_OK)
        status = kt_mass_inverse_compute(inverse, simulation->data, t, q, error);
    if (status == KT_OK)
        status = kt_mass_inverse_apply(inverse, m, c->response, error);
    const bool is_stored = kt_contacts_are_stored(c);
    if (!is_stored)
        kt_contacts_keep_rows(c);
    for (int i = 0; status == KT_OK && i < m; i++)
        if (is_stored)
            kt_contacts_multiply(c, i, 0, W + (ptrdiff_t)i * m);
        else
            W[i] = kt_contacts_product(c, i, i);
    return status;
}

/* Computes sqrt(x'M x). Data of the simulation belong to `model`. */
kt_status kt_contacts_find_norm(kt_simulation *simulation, const kt_model *model, const double *q, const double *x,
                                double *norm, kt_error *error) {
    const kt_status status = kt_kinematics_update(model, simulation->data, q, x, NULL, error);
    if (status == KT_OK)
        *norm = sqrt(2.0 * kt_kinetic_energy(model, simulation->data));
    return status;
}
