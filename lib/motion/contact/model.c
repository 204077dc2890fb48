/* The models of sets of contacts: models of the compiler, or masks (mask.h). The model that a simulation runs on is
 * never overwritten. Two of the three masks take turns; the third one serves trials. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "contact/contact.h"
#include "integrator/integrator.h"
#include "model/switching.h"

/* The compiled model of a set; NULL if there is none. The model in which masked friction slips forwards also stands for
 * friction that is released at first. Since evaluations reject such a state (open.c), the model is not used in this
 * case. */
static const kt_model *compiled(const kt_simulation *simulation, uint64_t set) {
    const kt_variants *variants = simulation->model->variants;
    const uint64_t masked = variants != NULL ? variants->switches.masked : 0;
    const uint64_t released = masked & simulation->contact_released & simulation->contact_friction;
    return released != 0 && (set & masked) == 0 ? NULL : kt_model_switched(simulation->model, set);
}

/* The model in which all contacts are closed, with the other switches of the set. NULL if the set contains a switch
 * that the model lacks, or if no contacts are masked. */
static const kt_model *all_closed(const kt_simulation *simulation, uint64_t set) {
    const kt_variants *variants = simulation->model->variants;
    return variants != NULL && variants->switches.masked != 0
               ? compiled(simulation, (set | variants->switches.masked) & ~variants->switches.back)
               : NULL;
}

static kt_mask *contact_mask_of(const kt_simulation *simulation, int k) {
    return (kt_mask *)(void *)(simulation->mask_memory + (size_t)k * simulation->size.mask);
}

static kt_mask *spare(const kt_simulation *simulation) {
    return contact_mask_of(simulation, simulation->model == &contact_mask_of(simulation, 0)->model);
}

/* Whether an item is open in a set of a checkpoint. For contacts that share bits, the checkpoint states which are
 * closed. */
static bool is_open_in(uint64_t set, const kt_contact *item, const kt_contact_memory *from) {
    return item->bit != 0 ? (set & (item->bit | item->back)) != item->bit
                          : (set & kt_switches_any) == 0 || !from->closed;
}

/* Opens the loops of a mask of a set according to the next set of contacts, or to a checkpoint. */
static void set_open(const kt_simulation *simulation, kt_mask *mask, uint64_t set, const kt_contact_memory *from) {
    const struct kt_contacts *c = simulation->contacts;
    kt_clear(mask->open, simulation->model->n.loop * sizeof *mask->open);
    for (int k = 0; k < c->n; k++)
        mask->open[c->item[k].loop] =
            from != NULL ? is_open_in(set, &c->item[k], &from[k]) : c->item[k].next != KT_CONTACT_ON;
}

/* Whether the simulation runs on the model that has the next set of contacts. */
static bool is_present(const kt_simulation *simulation, uint64_t set) {
    const struct kt_contacts *c = simulation->contacts;
    bool same = simulation->model->set == set;
    for (int k = 0; same && k < c->n; k++)
        same = kt_contact_is_closed(simulation->model, &c->item[k]) == (c->item[k].next == KT_CONTACT_ON);
    return same;
}

static bool is_masked(const kt_simulation *simulation) {
    return simulation->size.mask > 0 && (simulation->model == &contact_mask_of(simulation, 0)->model ||
                                         simulation->model == &contact_mask_of(simulation, 1)->model);
}

void kt_contacts_init_masks(kt_simulation *simulation) {
    for (int k = 0; k < KT_CONTACT_MASKS && simulation->size.mask > 0; k++)
        (void)kt_mask_init(simulation->model, contact_mask_of(simulation, k));
}

/* Makes a mask of the next set of contacts. The ranks are measured in the present state, in which the loops of the mask
 * are closed. */
static const kt_model *make_mask(kt_simulation *simulation, kt_mask *mask, const kt_model *all, uint64_t set) {
    const double t = kt_simulation_time_inside(simulation, kt_integrator_time(simulation->integrator));
    set_open(simulation, mask, set, NULL);
    kt_mask_make(mask, all, set);
    kt_data_rebind(&mask->model, simulation->data);
    kt_mask_rank(mask, simulation->data, t, kt_integrator_state(simulation->integrator));
    return &mask->model;
}

const kt_model *kt_contacts_model(kt_simulation *simulation, bool tried) {
    const uint64_t set = kt_contacts_set(simulation);
    const kt_model *model = is_present(simulation, set) ? simulation->model : compiled(simulation, set);
    if (model != NULL)
        return model;
    kt_mask *mask = tried ? contact_mask_of(simulation, KT_CONTACT_MASKS - 1) : spare(simulation);
    return make_mask(simulation, mask, all_closed(simulation, set), set);
}

const kt_model *kt_contacts_open_model(kt_simulation *simulation, uint64_t set) {
    struct kt_contacts *c = simulation->contacts;
    const kt_model *model = compiled(simulation, set), *all = model == NULL ? all_closed(simulation, set) : NULL;
    for (int k = 0; k < c->n && all != NULL; k++)
        c->item[k].next = KT_CONTACT_OFF;
    if (all == NULL)
        return model;
    model = make_mask(simulation, spare(simulation), all, set);
    kt_data_rebind(simulation->model, simulation->data);
    kt_phase_rebind(simulation);
    simulation->cached = KT_CACHED_NOTHING;
    return model;
}

/* If no model of this set has been compiled, a mask of the model with all contacts closed takes its place, as when the
 * checkpoint was written. The ranks come from the checkpoint, because they were measured in the state of that time. */
const kt_model *kt_contacts_restored_model(kt_simulation *simulation, uint64_t set, const double *ranks,
                                           const kt_contact_memory *state) {
    const kt_model *model = compiled(simulation, set), *all = all_closed(simulation, set);
    if (model != NULL || all == NULL)
        return model;
    kt_mask *mask = spare(simulation);
    set_open(simulation, mask, set, state);
    kt_mask_make(mask, all, set);
    if (!kt_mask_ranks_fit(mask, ranks))
        return NULL;
    kt_mask_put_ranks(mask, ranks);
    return &mask->model;
}

void kt_contacts_store_ranks(kt_simulation *simulation) {
    kt_clear(simulation->ranks, simulation->size.ranks);
    if (is_masked(simulation))
        kt_mask_take_ranks(contact_mask_of(simulation, simulation->model != &contact_mask_of(simulation, 0)->model),
                           simulation->ranks);
}

void kt_contacts_renew_model(const kt_simulation *simulation) {
    if (!is_masked(simulation))
        return;
    kt_mask *mask = contact_mask_of(simulation, simulation->model != &contact_mask_of(simulation, 0)->model);
    double *ranks = simulation->ranks;
    if (mask->model.revision == mask->all->revision)
        return;
    kt_mask_take_ranks(mask, ranks);
    kt_mask_make(mask, mask->all, mask->model.set);
    kt_mask_put_ranks(mask, ranks);
}

kt_status kt_contacts_start(kt_simulation *simulation, kt_error *error) {
    kt_phase_renew(simulation);
    if (!simulation->memory.beyond)
        return KT_OK;
    simulation->memory.beyond = false;
    return kt_phase_settle(simulation, error);
}
