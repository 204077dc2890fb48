/* The rows of contacts that touch, and their response J M^-1 J' to forces in these rows. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"

#include "base/copy.h"
#include "base/where.h"
#include "control/mass_inverse.h"
#include "dynamics/dynamics.h"

#include <math.h>

bool kt_contact_touches(const kt_simulation *simulation, int k, double most) {
    return simulation->contacts->gap[k] <= most + fmax(simulation->contact_state[k].closes_at, 0.0);
}

void kt_contacts_list_rows(kt_simulation *simulation) {
    struct kt_contacts *c = simulation->contacts;
    kt_contacts_clear_rows(c);
    for (int k = 0; k < c->sides; k++) {
        const kt_contact *item = &c->item[k];
        const bool touches = kt_contact_touches(simulation, k, kt_contact_touching * item->unit) || item->meets ||
                             kt_contact_is_closed(simulation->model, item);
        if (touches && !item->spared && !item->flies && !kt_contact_is_released(item))
            (void)kt_contacts_add_row(c, k, 0);
    }
    for (int i = 0; i < c->islands; i++)
        c->island[i].meeting = c->island[i].touching;
    for (int k = c->sides; k < c->n; k++)
        if (!kt_contact_rubs(c, k) && !c->item[k].spared && !kt_contact_is_released(&c->item[k]))
            (void)kt_contacts_add_row(c, k, 0);
    for (int i = 0; i < c->islands; i++) {
        kt_contact_island *at = &c->island[i];
        at->resting = at->touching;
        for (int r = at->row; r < at->row + at->meeting; r++)
            for (int component = 0; component < 2 && c->item[c->rows[r]].of >= 0; component++)
                (void)kt_contacts_add_row(c, c->item[c->rows[r]].of, component);
    }
}

kt_status kt_contacts_find_touching(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    for (int k = 0; k < c->n; k++)
        c->item[k].spared = false;
    for (int k = 0; k < c->sides; k++) {
        if (kt_contact_is_released(&c->item[k]))
            continue;
        simulation->memory.beyond = c->gap[k] < -kt_contact_deep * c->item[k].unit;
        if (simulation->memory.beyond) {
            return kt_error_set(error, KT_ERROR_CONSTRAINT,
                                kt_where_at("contact", kt_loop_name(c->all, c->item[k].loop), t).text,
                                "'%.60s' is %.3g (m or rad) beyond its boundary; begin on its free side, or bound the "
                                "steps (max_step) if it was there at the start",
                                kt_loop_name(c->all, c->item[k].loop), -c->gap[k]);
        }
    }
    kt_contacts_list_rows(simulation);
    return KT_OK;
}

int kt_contacts_write_columns(struct kt_contacts *c, int from) {
    const size_t nv = c->all->n.v;
    int end = from;
    for (int i = 0; i < c->islands; i++)
        end = c->island[i].touching > end ? c->island[i].touching : end;
    if (end > from)
        kt_clear(c->response + (size_t)from * nv, (size_t)(end - from) * nv * sizeof *c->response);
    for (int i = 0; i < c->islands; i++) {
        (void)kt_contacts_select(c, i);
        for (int k = from; k < c->touching; k++)
            kt_contacts_write_row(c, k, c->response + (size_t)k * nv);
    }
    return end - from;
}

/* Computes M^-1 J' and W, or its diagonal, of the mechanism with all contacts open, from data of the simulation. */
kt_status kt_contacts_find_response(kt_simulation *simulation, const kt_model *open, double t, const double *q,
                                    kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_mass_inverse *inverse = NULL;
    const int columns = kt_contacts_write_columns(c, 0);
    kt_status status = kt_mass_inverse_init(open, 0, c->inverse_memory, c->inverse_size, &inverse, error);
    if (status == KT_OK)
        status = kt_mass_inverse_compute(inverse, simulation->data, t, q, error);
    if (status == KT_OK)
        status = kt_mass_inverse_apply(inverse, columns, c->response, error);
    for (int i = 0; status == KT_OK && i < c->islands; i++) {
        (void)kt_contacts_select(c, i);
        const bool whole = kt_contacts_are_stored(c);
        for (int k = 0; k < c->touching; k++) {
            for (int r = 0; whole && r < c->touching; r++)
                c->W[(ptrdiff_t)k * c->touching + r] = kt_contacts_product(c, k, r);
            if (!whole)
                c->W[k] = kt_contacts_product(c, k, k);
        }
    }
    return status;
}

kt_status kt_contacts_find_norm(kt_simulation *simulation, const kt_model *model, const double *q, const double *x,
                                double *norm, kt_error *error) {
    const kt_status status = kt_kinematics_update(model, simulation->data, q, x, NULL, error);
    if (status == KT_OK)
        *norm = sqrt(2.0 * kt_kinetic_energy(model, simulation->data));
    return status;
}
