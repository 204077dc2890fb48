/* The watch of a motion, and its warnings at the end: in a run, in a program that drives a simulation, and in a live
 * page. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "subcommands/run.h"

void kt_watch_motion(kt_outcome *outcome, kt_mode_watch *modes, const kt_record *record) {
    kt_energy_watch_add(&outcome->so_far.energy, record);
    kt_growth_add(&outcome->so_far.growth, record, outcome->run->duration);
    kt_watch_step(modes, outcome, record);
    kt_watch_stability(outcome, record);
    kt_watch_correction(outcome);
}

void kt_warn_of_motion(kt_outcome *outcome, const kt_mode_watch *modes) {
    kt_warn_of_step(outcome, modes);
    kt_warn_of_stability(outcome);
    kt_warn_of_correction(outcome);
    kt_warn_of_drift(outcome);
    kt_warn_of_energy(outcome);
    kt_warn_of_passages(outcome);
    kt_warn_of_growth(outcome);
    kt_warn_of_counts(outcome);
    kt_warn_of_contacts(outcome);
}
