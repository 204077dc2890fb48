/* Restores the simulation after a change of the state that fails, although hard contacts have been opened or committed.
 *
 * Before a change, the simulation and the arrays that a change writes are copied byte by byte. On failure, they are
 * copied back. This is valid because all their pointers point into the memory of the simulation, which does not move.
 * Data are scratch, and are adapted to the previous model. Counts that the data hold until the end of a step are
 * restored, too.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "base/copy.h"
#include "contact/contact.h"
#include "simulation/simulation.h"

#include <stddef.h>

/* The counts of the data since the last step. */
typedef struct kt_undo_counts {
    kt_iterations iterations;
    kt_crossings crossings;
    kt_passage passage;
    uint32_t unconverged;
} kt_undo_counts;

/* The parts: location, bytes. The simulation is the first part. Masks, one of which may be its model, are the last
 * part. One list measures, copies and copies back. */
#define KT_UNDO_PARTS(X)                                                                                               \
    X(simulation, sizeof(kt_simulation))                                                                               \
    X(&counts, sizeof(kt_undo_counts))                                                                                 \
    X(simulation->contact_memory, sizeof(struct kt_contacts))                                                          \
    X(simulation->contact_state, size->contacts * sizeof(kt_contact_memory))                                           \
    X(simulation->event_memory, size->event * sizeof(kt_event_memory))                                                 \
    X(simulation->event_root, size->event * sizeof(kt_event_root))                                                     \
    X(simulation->state, size->state * sizeof(double))                                                                 \
    X(simulation->panel, size->panel * sizeof(kt_work_panel))                                                          \
    X(simulation->integrator_memory, size->integrator)                                                                 \
    X(simulation->mask_memory, KT_CONTACT_MASKS * size->mask)

size_t kt_simulation_undo_size(const kt_simulation_sizes *size) {
    size_t total = 0;
#define KT_UNDO_MEASURE(part, bytes) total += (bytes);
    KT_UNDO_PARTS(KT_UNDO_MEASURE)
#undef KT_UNDO_MEASURE
    return total;
}

void kt_simulation_keep(kt_simulation *simulation) {
    const kt_simulation_sizes *size = &simulation->size;
    const kt_data *data = simulation->data;
    const kt_undo_counts counts = {data->iterations, data->crossings, data->passage, data->unconverged};
    char *to = simulation->undo;
#define KT_UNDO_KEEP(part, bytes)                                                                                      \
    kt_copy(to, part, bytes);                                                                                          \
    to += (bytes);
    KT_UNDO_PARTS(KT_UNDO_KEEP)
#undef KT_UNDO_KEEP
}

void kt_simulation_undo_change(kt_simulation *simulation) {
    const kt_simulation_sizes sizes = simulation->size, *size = &sizes;
    kt_data *data = simulation->data;
    const kt_model *model;
    kt_undo_counts counts;
    const char *from = simulation->undo;
    const size_t masks = KT_CONTACT_MASKS * size->mask;
    kt_copy(simulation->mask_memory, from + kt_simulation_undo_size(size) - masks, masks);
    memcpy(&model, from + offsetof(kt_simulation, model), sizeof model);
    kt_simulation_take_model(simulation, model);
#define KT_UNDO_RETURN(part, bytes)                                                                                    \
    kt_copy(part, from, bytes);                                                                                        \
    from += (bytes);
    KT_UNDO_PARTS(KT_UNDO_RETURN)
#undef KT_UNDO_RETURN
    kt_data_rebind(simulation->contacts->all, simulation->contacts->data);
    kt_contacts_place_islands(simulation->contacts);
    simulation->contact_calls->follow(simulation);
    simulation->contact_calls->renew(simulation); /* parameters have been undone before */
    simulation->gap_time = simulation->event_time = simulation->contact_time = (double)NAN;
    simulation->cached = KT_CACHED_NOTHING;
    data->iterations = counts.iterations;
    data->crossings = counts.crossings;
    data->passage = counts.passage;
    data->unconverged = counts.unconverged;
}
