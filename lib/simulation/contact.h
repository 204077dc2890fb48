/* Loops that bound one side (kt_loop.side) in a simulation: hard stops, contacts, slack ropes. */
#ifndef KT_SIMULATION_CONTACT_H
#define KT_SIMULATION_CONTACT_H

#include "simulation/simulation.h"

/* How many such loops a model has, closed and open. */
size_t kt_contacts_of(const kt_model *model);

/* Bytes of the memory for n contacts of a model, of all its sets. */
size_t kt_contacts_size(const kt_model *model, size_t n);

/* Lists the contacts and adds their events, the first of all. `simulation` has its model, data and memory. */
KT_CHECKED kt_status kt_contacts_init(kt_simulation *simulation, kt_error *error);

#endif
