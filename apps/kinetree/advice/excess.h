/* Values beyond all reason: an integration that has blown up may stay within the range of numbers. */
#ifndef KT_COMMAND_ADVICE_EXCESS_H
#define KT_COMMAND_ADVICE_EXCESS_H

#include "kinetree/analysis.h"
#include "kinetree/simulation.h"

#include <stdbool.h>

/* A speed of a joint above this one, m/s or rad/s (that of light), or an own state above that number, belongs to no motion of a
 * mechanism. */
#define KT_SPEED_MOST 299792458.0
#define KT_STATE_MOST 1e100

/* Sets the error, and returns true, if a record has such a value: with these, energies are finite. O(coordinates). */
bool kt_find_excess(const kt_record *record, kt_error *error);

/* Whether the records show anything of the error of the energy: not if energy is supplied and nothing accounts for it. */
bool kt_energy_is_known(const kt_energy_watch *energy);

#endif
