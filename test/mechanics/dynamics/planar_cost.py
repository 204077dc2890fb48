"""What a chain of 128 rods costs in the plane and in space: instructions, counted by callgrind.

planar_cost.py VALGRIND PLANAR-COST
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import re
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
from claims import claim, finish, note, skip

valgrind, program = sys.argv[1:]
RODS = 128
CALLS = {"forward": "kt_dynamics_forward", "inverse": "kt_dynamics_inverse", "mass": "kt_dynamics_mass",
         "kinematics": "kt_kinematics_update"}
# What of the spatial call's instructions the planar one may take, at the baseline and at v3. Of the mass matrix the columns,
# eight at a time, are most in space and in the plane alike: what is saved is the composites.
MOST = {"forward": (0.25, 0.40), "inverse": (0.40, 0.65), "mass": (0.65, 0.75), "kinematics": (1.2, 1.5)}


def count(plan, level, call):
    """Instructions of one call; None where there is no such level."""
    run = subprocess.run([valgrind, "--tool=callgrind", "--callgrind-out-file=/dev/null",
                          f"--toggle-collect={CALLS[call]}", program, plan, str(level), call],
                         capture_output=True, text=True, check=False)
    if run.returncode == 77:
        return None
    found = re.search(r"Collected : (\d+)", run.stderr)
    if run.returncode != 0 or not found or int(found[1]) == 0:
        sys.exit(f"{plan} {call}: nothing was counted\n{run.stderr}")
    return int(found[1])


for call, most in MOST.items():
    problems = []
    for level, name in ((1, "baseline"), (2, "v3")):
        planar, spatial = count("planar", level, call), count("spatial", level, call)
        if planar is None or spatial is None:
            skip(f"{call}, {name}", "this processor or build does not have this level of the instruction set")
            continue
        ratio = planar / spatial
        note(f"{call}, {name}: {planar / RODS:.0f} instructions a rod in the plane, {spatial / RODS:.0f} in space: "
             f"{ratio:.3f}")
        if not ratio <= most[level - 1]:
            problems.append(f"{ratio:.3f} at {name}, and it may be {most[level - 1]}")
    claim(f"{call}_in_the_plane_costs_a_part_of_that_in_space", problems)
finish()
