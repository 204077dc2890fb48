"""What closed hard contacts cost: instructions of an evaluation of accelerations, counted by callgrind.

contact_cost.py VALGRIND CONTACT-COUNT
"""
# SPDX-License-Identifier: Apache-2.0
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "plan"))
from claims import claim, finish, note
from counted import count

valgrind, program = sys.argv[1:]
# Evaluations of the tree that one with closed contacts may cost.
MOST = {"box-slips": 5.28, "quadruped-slips": 2.44, "quadruped-sticks": 3.21, "quadruped-one-sticks": 1.59, "humanoid-sticks": 2.95, "chain-stopped": 1.15,
        "four-bar-stopped": 2.22}

for name, most in MOST.items():
    tree, closed = (count(valgrind, "kt_acceleration_evaluate", program, name, way).instructions for way in ("open", "closed"))
    note(f"{name}: {tree} instructions without contacts, {closed} with them: {closed / tree:.3f}")
    claim(f"{name.replace('-', '_')}_at_the_cost_of_few_trees", [] if closed / tree <= most else [f"{closed / tree:.3f}, and it may be {most}"])
finish()
