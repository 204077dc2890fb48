/* Calls of a simulation about its hard contacts: which are released, counts, forces, and the model of small motions. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/require.h"
#include "contact/contact.h"
#include "simulation/simulation.h"

#include <math.h>

uint64_t kt_simulation_released(const kt_simulation *simulation) {
    const bool has = simulation != NULL && simulation->contacts != NULL;
    return has ? simulation->memory.released & ~simulation->contacts->back : 0;
}

kt_status kt_simulation_set_released(kt_simulation *simulation, uint64_t set, kt_error *error) {
    if (KT_IS_MISSING(error, simulation))
        return KT_ERROR_ARGUMENT;
    const uint64_t before = simulation->memory.released;
    const struct kt_contacts *c = simulation->contacts;
    uint64_t known = 0, after = set;
    for (int k = 0; c != NULL && k < c->n; k++) {
        known |= kt_contact_rubs(c, k) ? 0 : c->item[k].bit;
        after |= (set & c->item[k].bit) != 0 ? c->item[k].back : 0; /* joint friction: both switches on */
    }
    if ((set & ~known) != 0)
        return kt_error_set(
            error, KT_ERROR_ARGUMENT, "kt_simulation_set_released",
            "of the set 0x%llx only 0x%llx are hard stops, contacts, slack ropes, or joint friction that sticks",
            (unsigned long long)set, (unsigned long long)(set & known));
    if (after == before)
        return KT_OK;
    simulation->memory.released = after;
    simulation->contact_time = (double)NAN;
    const kt_status status = kt_simulation_set_switches(simulation, simulation->model->set, NULL, error);
    if (status != KT_OK)
        simulation->memory.released = before;
    return status;
}

kt_contact_excess kt_simulation_contact_excess(const kt_simulation *simulation) {
    return simulation != NULL ? simulation->memory.excess : (kt_contact_excess){.steps = 0};
}

kt_completed_steps kt_simulation_completed_steps(const kt_simulation *simulation) {
    return simulation != NULL ? simulation->memory.completed : (kt_completed_steps){.records = 0};
}

kt_contact_counts kt_simulation_contacts(const kt_simulation *simulation) {
    return simulation != NULL ? simulation->memory.contacts : (kt_contact_counts){.impacts = 0};
}

const kt_model *kt_simulation_resting_model(kt_simulation *simulation) {
    if (simulation->contacts == NULL || simulation->steps_over_contacts)
        return kt_simulation_model(simulation);
    double *a = simulation->contacts->response;
    return kt_simulation_acceleration(simulation, a, NULL) == KT_OK ? kt_contacts_resting_model(simulation, a)
                                                                    : simulation->model;
}

kt_status kt_contact_force(kt_simulation *simulation, int effect, kt_contact_load *load, kt_error *error) {
    kt_record record;
    if (KT_IS_MISSING(error, simulation, load))
        return KT_ERROR_ARGUMENT;
    const kt_status status = kt_simulation_sense(simulation, &record, error);
    return status == KT_OK ? kt_record_contact(&record, effect, load, error) : status;
}
