/* Every hard case observed below its bounds. Runs that take long are shortened here; bench/hard has their full length.
 */
/* SPDX-License-Identifier: Apache-2.0 */
#include "hard.h"

#include "check.h"

#include <stdio.h>

static void hold(int kind) {
    int cases = 0;
    for (int i = 0; i < kt_hard_count(); i++) {
        const kt_hard_case *c = kt_hard_at(i);
        static kt_hard h;
        if (c->number != kind)
            continue;
        cases++;
        kt_hard_run(&h, c, false);
        kt_note("%s: %s", c->name, c->why);
        if (h.words[0])
            kt_note("  %s", h.words);
        for (int m = 0; m < KT_HARD_MEASURES && c->measures[m].what; m++) {
            char what[120];
            (void)snprintf(what, sizeof what, "%s: %s", c->name, c->measures[m].what);
            kt_check_below(what, h.observed[m], c->measures[m].bound);
        }
    }
    kt_check_above("cases of this kind", cases, 1.0);
}

KT_TEST(windows_pass_every_singular_position) { hold(1); }
KT_TEST(superfluous_equations_lock_nothing) { hold(2); }
KT_TEST(dead_points_and_change_points_keep_the_branch) { hold(3); }
KT_TEST(partitioning_chooses_its_coordinates_again) { hold(4); }
KT_TEST(unequal_masses_lose_no_energy_and_no_torque) { hold(5); }
KT_TEST(long_chains_and_far_mechanisms_lose_no_digits) { hold(6); }
KT_TEST(long_runs_drift_no_faster_than_the_method) { hold(7); }
KT_TEST(fast_and_awkward_rotations_keep_their_invariants) { hold(8); }
KT_TEST(stiff_mechanisms_are_announced_and_got_through) { hold(9); }
KT_TEST(fast_motions_do_not_spoil_slow_ones) { hold(10); }
KT_TEST(assembly_closes_or_tells_the_gap) { hold(11); }
KT_TEST(contradictions_name_loops_and_time_and_keep_the_records) { hold(12); }
KT_TEST(next_to_nothing_is_exact_or_rejected) { hold(13); }
KT_TEST(extreme_values_are_right_or_rejected) { hold(14); }
KT_TEST(torques_that_are_no_numbers_are_caught_at_their_step) { hold(15); }
