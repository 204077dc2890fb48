"""Groups of loops cost what each of them costs: instructions, counted by callgrind, grow in proportion to their number.

cost.py VALGRIND COST-COUNT
"""
# SPDX-License-Identifier: Apache-2.0
import os
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from claims import claim, finish, note

valgrind, program = sys.argv[1:]
os.environ["OPENBLAS_NUM_THREADS"] = "1"  # valgrind counts the turns in which threads wait for each other


def count(functions, what, n, *plan):
    """Instructions in a function, or several with a comma between, and what they call."""
    function = functions.split(",")
    run = subprocess.run([valgrind, "--tool=callgrind", "--callgrind-out-file=/dev/null",
                          *(f"--toggle-collect={f}" for f in function), program, what, str(n), *plan],
                         capture_output=True, text=True, check=False)
    found = re.search(r"Collected : (\d+)", run.stderr)
    if run.returncode != 0 or not found or int(found[1]) == 0:
        sys.exit(f"{function} on {n}: nothing was counted\n{run.stderr}")
    return int(found[1])


def growth(function, most, fixed=0.1):
    """Problems with growing in proportion: the cost of the last doubling against that of the one before, and of ten
    against one. `fixed`: what a call costs besides, as a part of one four-bar."""
    few, some, many = (count(function, "four-bars", n) for n in (10, 20, 40))
    one = count(function, "four-bars", 1)
    note(f"{function}: {one} instructions for 1, {few} for 10, {some} for 20, {many} for 40")
    ratio = (many - some) / (2 * (some - few))
    problems = []
    if not 1 / most <= ratio <= most:
        problems.append(f"from 20 to 40 it grows {ratio:.3f} times as much as twice from 10 to 20")
    if not few <= 10 * (1 + fixed) * one:
        problems.append(f"ten cost {few / one:.2f} times one")
    return problems


claim("ten_four_bars_on_a_chain_cost_ten_times_one", growth("kt_acceleration_evaluate", 1.01))
claim("projection_of_ten_four_bars_costs_ten_times_one", growth("kt_state_project", 1.01))
# Searches take more or fewer steps.
claim("compilation_and_assembly_grow_with_the_number_of_loops",
      growth("kt_model_compile", 1.2, 1.0) + growth("kt_state_assemble", 1.3, 1.0))
# 8.8; 10.8 where the damping follows the trace of B'B, whatever the gap.
pair = [count("kt_assemble_levenberg_marquardt", "row", n) for n in (40, 320)]
note(f"closing a row: {pair[0]} instructions for 40 windows, {pair[1]} for 320, {pair[1] / pair[0]:.3f}")
claim("closing_a_row_takes_no_more_steps_for_more_windows", [] if pair[1] / pair[0] < 9.7 else ["more"])
# 4.2; 15 where each loop goes up to the ground by itself.
pair = [count("kt_attach_ancestor,kt_attach_join_path,kt_attach_measure_loops", "ladder", n)
        for n in (20, 80)]
note(f"ancestors, groups and lengths of a ladder's loops: {pair[0]} instructions for 20 rungs, {pair[1]} for 80, {pair[1] / pair[0]:.2f}")
claim("groups_of_a_ladder_are_found_in_proportion_to_its_length", [] if pair[1] / pair[0] < 5 else ["not"])
# Measured 3.4; 7.0 by dense factors of all equations.
pair = [count("kt_acceleration_derivatives", "derivatives", n) for n in (15, 30)]
note(f"derivatives: {pair[0]} instructions for 15, {pair[1]} for 30, {pair[1] / pair[0]:.2f} times as many")
claim("derivatives_of_four_bars_grow_with_the_square", [] if pair[1] / pair[0] < 5 else ["they grow faster"])
# Measured 3.4, 3.8 and 2.0; 6.7, 7.1 and 6.1 by dense factors of all equations.
for functions, what, claimed, most in (
        ("kt_stiffness_evaluate", "stiffness", "stiffness_matrices_of_four_bars_grow_with_the_square", 4.5),
        ("kt_projection_columns", "step", "derivatives_of_the_projection_of_four_bars_grow_with_the_square", 4.5),
        ("kt_mass_inverse_compute,kt_mass_inverse_apply", "inverse", "mass_inverse_of_four_bars_grows_in_proportion", 2.2)):
    pair = [count(functions, what, n) for n in (15, 30)]
    note(f"{functions}: {pair[0]} instructions for 15, {pair[1]} for 30, {pair[1] / pair[0]:.2f} times as many")
    claim(claimed, [] if pair[1] / pair[0] < most else ["they grow faster"])
tree = [count("kt_acceleration_evaluate", "tree", n) for n in (20, 40)]
note(f"the same tree without loops: {tree[0]} instructions for 20, {tree[1]} for 40")
claim("tree_grows_in_proportion", [] if abs(tree[1] / tree[0] / 2 - 1) < 0.02 else ["it does not"])
pair = [count("kt_acceleration_evaluate", "four-bars", 20, *plan) for plan in ([], ["spatial"])]
note(f"twenty four-bars: {pair[0]} instructions in their plane, {pair[1]} in space, {pair[0] / pair[1]:.3f}")
claim("four_bars_in_their_plane_cost_about_a_third", [] if pair[0] / pair[1] < 0.345 else ["more"])
# 2.0 and 2.0; with each end of a loop followed from the chains' common ancestor 2.8 in the wrenches of loops.
for function in ("kt_react_baseline", "kt_reaction_evaluate"):
    pair = [count(function, "ladder", n) for n in (60, 120)]
    note(f"{function} of a ladder: {pair[0]} instructions for 60 rungs, {pair[1]} for 120, {pair[1] / pair[0]:.3f}")
    claim(f"{function}_of_a_ladder_grows_in_proportion", [] if pair[1] / pair[0] < 2.1 else ["more"])
# Measured 8; 43 with derivatives of accelerations turned into those of forces (by time, 200 links: 5 and 135).
pair = [count(function, "chain", 60) for function in ("kt_linearization_evaluate", "kt_equilibrium_find")]
note(f"a chain of 60: {pair[0]} instructions to linearise it, {pair[1]} to bring it to rest, {pair[1] / pair[0]:.1f}")
claim("long_chain_comes_to_rest_within_few_linearisations", [] if pair[1] / pair[0] < 20 else ["more"])
# Measured 3.1 in a plane and 1.6 in space, driven or not. With a driven end the general elimination of links takes some 35 and 6.
for plan in ([], ["spatial"]):
    open_rope, held, driven = (count("kt_acceleration_evaluate", what, 100, *plan) for what in ("open", "held", "driven"))
    note(f"a rope of 100 {'in space' if plan else 'in a plane'}: {open_rope} instructions open, {held / open_rope:.2f} times that held at both "
         f"ends, {driven / open_rope:.2f} times driven, too")
    claim(f"rope_held_and_driven_costs_less_than_four_open_chains{'_in_space' if plan else ''}",
          [] if max(held, driven) < 4 * open_rope else ["more"])
finish()
