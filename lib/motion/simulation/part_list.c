/* The list of all parts of a simulation, in the order of their hooks in each phase (step/phases.h).
 *
 * Inputs come before breakpoints, because new inputs change the forces at a breakpoint. A try is checked for forces
 * that its stages have missed before it is checked for events, whose values depend on these forces. Slip is followed
 * before events are evaluated, and contacts come after events, because contacts use their values. Counts precede the
 * balance, since the factorizations of refined powers do not count. */
/* SPDX-License-Identifier: Apache-2.0 */
#include "contact/contact.h"
#include "simulation/simulation.h"

static const kt_part *const parts[] = {
    &kt_input_part,   &kt_jump_part,  &kt_breakpoint_part,   &kt_missed_end_part,   &kt_newton_part,
    &kt_gap_part,     &kt_leap_part,  &kt_missed_piece_part, &kt_slip_part,         &kt_event_part,
    &kt_contact_part, &kt_retry_part, &kt_moreau_part,       &kt_bounded_step_part, &kt_count_part,
    &kt_balance_part, &kt_power_part, &kt_state_part,        &kt_failure_part,
};

enum { PARTS = sizeof parts / sizeof *parts };
_Static_assert((int)PARTS <= (int)KT_PARTS_MOST, "each phase has room for all parts");

size_t kt_simulation_measure_parts(const kt_simulation_sizes *size) { return kt_parts_measure(size, parts, PARTS); }

void kt_simulation_place_parts(kt_simulation *simulation) {
    simulation->parts = parts;
    simulation->part_count = PARTS;
    kt_parts_init(simulation, simulation->part_memory);
}
