/* Values beyond all reason: an integration that has blown up may stay within the range of numbers. */
/* SPDX-License-Identifier: Apache-2.0 */
#ifndef KT_COMMAND_ADVICE_EXCESS_H
#define KT_COMMAND_ADVICE_EXCESS_H

#include "kinetree/analysis.h"
#include "kinetree/simulation.h"

#include <stdbool.h>

/* Limits for motions of mechanisms: the speed of a joint, in m/s or rad/s (the speed of light), and an auxiliary
 * state. */
#define KT_SPEED_MOST 299792458.0
#define KT_STATE_MOST 1e100

/* Sets the error, and returns true, if a record has a value above these limits. Energies are finite below them. Cost:
 * O(coordinates). */
bool kt_find_excess(const kt_record *record, kt_error *error);
/* Returns whether a time step that completed a fixed step (kt_simulation_options.stall_evaluations) has not found its
 * impulses, and describes it. Bodies may pass through boundaries then, since the step is far too long. */
bool kt_find_lost_impulses(const kt_simulation *simulation, double time, kt_error *error);

/* Returns whether the records show the error of the energy. The records do not if energy is supplied and no work
 * accounts for it. */
bool kt_energy_is_known(const kt_energy_watch *energy);

#endif
