/* Records of time stepping (moreau.c). The forces of contacts are the impulses of the last step over its length. The
 * model of the simulation has no contacts. A record therefore takes these forces as loads:
 *
 *     contacts, ropes            wrenches on bodies, from the equations of the model in which all contacts are closed
 *     stops, friction of joints  J' lambda, in joints
 *
 * Accelerations, reactions of joints and multipliers of other loops follow. The record then has the layout of that
 * model, in which each contact has its rows.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/moreau.h"

#include "base/copy.h"
#include "constraint/group.h"
#include "dynamics/dynamics.h"
#include "evaluate/evaluate.h"
#include "model/switching.h"
#include "reduction/kernel.h"

/* The multipliers of the equations of contacts, in the order of the model in which all are closed. */
static void find_contact_multipliers(const kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    double *multiplier = simulation->moreau->multiplier;
    kt_clear(multiplier, c->all->n.row * sizeof *multiplier);
    for (int k = 0; k < c->n; k++) {
        const kt_contact *item = &c->item[k];
        const kt_contact_memory *normal = &simulation->contact_state[kt_contact_rubs(c, k) ? item->of : k];
        for (int r = 0; r < c->all->loop[item->loop].row_count; r++)
            multiplier[kt_contact_row(c->all, item) + r] = kt_contact_rubs(c, k) ? normal->force[1 + r]
                                                           : k < c->sides        ? item->sign * normal->force[0]
                                                                                 : normal->force[0] + normal->force[1];
    }
}

static bool has_fronts(const kt_model *model) {
    for (size_t g = 0; g < model->n.group; g++)
        if (model->group[g].has_fronts)
            return true;
    return false;
}

/* Wrenches of contacts, added to m->external, and of their loops. Fronts keep their equations from an evaluation. */
static void add_wrenches(kt_simulation *simulation, double t, const double *q, const double *v) {
    const struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const kt_reduction_kernels *kernels = kt_reduction_kernels_in_space(c->all);
    kt_dynamic_state at = {t, q, v, c->all->zero, NULL};
    if (has_fronts(c->all))
        (void)kernels->forward(c->all, c->data, &at, false, c->data->scratch);
    else
        kernels->pose(c->all, c->data, q);
    kt_multipliers_put(c->all, c->data, m->multiplier);
    kt_clear(m->loop, c->all->n.loop * sizeof *m->loop);
    kernels->react(c->all, c->data, t, m->external, NULL, m->loop);
}

kt_status kt_moreau_begin_record(kt_simulation *simulation, double t, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    kt_moreau *m = simulation->moreau;
    const size_t nv = simulation->size.nv, body = simulation->size.body;
    const double *q = simulation->y, *v = q + simulation->size.nq;
    const kt_dynamic_state at = {.t = t, .q = q, .v = v};
    const kt_status status = kt_moreau_find_gaps(c, simulation->model, &at, error);
    if (status != KT_OK)
        return status;
    find_contact_multipliers(simulation);
    kt_copy(m->tau, simulation->tau != NULL ? simulation->tau : simulation->model->zero, nv * sizeof *m->tau);
    kt_clear(m->external, body * sizeof *m->external);
    if (simulation->external != NULL)
        kt_copy(m->external, simulation->external, body * sizeof *m->external);
    for (int k = 0; k < c->n; k++) {
        const kt_contact *item = &c->item[k];
        const kt_contact_line line = kt_contact_line_of(c, item, 0);
        const double multiplier = m->multiplier[kt_contact_row(c->all, item)];
        for (int j = 0; c->all->loop[item->loop].term_count > 0 && j < line.count; j++)
            m->tau[line.v[j]] += line.row[line.at[j]] * multiplier;
    }
    add_wrenches(simulation, t, q, v);
    simulation->tau = m->tau;
    simulation->external = m->external;
    return KT_OK;
}

/* Moves multipliers of the model's own loops to the rows of these loops in the model with all contacts. */
static void arrange_multipliers(kt_simulation *simulation) {
    const struct kt_contacts *c = simulation->contacts;
    const kt_model *model = simulation->model;
    double *to = simulation->moreau->multiplier;
    for (size_t i = 0; i < model->n.loop; i++)
        for (int r = 0; !kt_loop_is_off(&model->loop[i]) && r < model->loop[i].row_count; r++)
            to[c->all->loop[i].equation + r] = simulation->multiplier[model->loop[i].equation + r];
    kt_copy(simulation->multiplier, to, c->all->n.row * sizeof *to);
}

kt_status kt_moreau_end_record(kt_simulation *simulation, kt_record *record, kt_error *error) {
    struct kt_contacts *c = simulation->contacts;
    const double *q = simulation->y, *v = q + simulation->size.nq;
    if ((simulation->records.bits & KT_RECORD_REACTIONS) != 0) {
        arrange_multipliers(simulation);
        for (int k = 0; k < c->n; k++)
            simulation->loop_reaction[c->item[k].loop] = simulation->moreau->loop[c->item[k].loop];
    }
    record->model = c->all;
    record->data = c->data;
    kt_copy(c->data->x, v + simulation->size.nv, simulation->size.x * sizeof *v);
    if (c->all->n.varying > 0) {
        const kt_status status = kt_masses_update(c->all, c->data, record->t, error);
        if (status != KT_OK)
            return status;
    }
    return kt_kinematics_update(c->all, c->data, q, v, record->a, error);
}
