/* The parts of a checkpoint whose words have ranges (checkpoint_words.c). */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_SIMULATION_CHECKPOINT_H
#define KT_SIMULATION_CHECKPOINT_H

#include "base/inner.h"
#include "simulation/simulation.h"

/* Bytes of a checkpoint, or of a simulation: as many structs as the simulation has. */
typedef struct kt_checkpoint_structs {
    const void *memory, *contact_state, *event_memory, *event_root;
} kt_checkpoint_structs;

/* Checks each word that a simulation takes as an index, a count, a flag or a sign. Errors: KT_ERROR_ARGUMENT, with the
 * first word that is out of range. */
KT_CHECKED kt_status kt_checkpoint_check_words(const kt_simulation *of, const kt_checkpoint_structs *from,
                                               kt_error *error);

/* Writes the sums of all parts to the head of a block. */
void kt_checkpoint_seal(const kt_simulation *simulation, void *block);
/* Returns the offset of kt_simulation_memory in a block. */
size_t kt_checkpoint_memory_at(const kt_simulation *simulation);

#endif
