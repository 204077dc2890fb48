"""What A and B of an implicit step, and A'y and B'y, cost in instructions: over a step of a simulation, which knows its
Jacobian from steps before, and over the step as a function of its start.

implicit.py VALGRIND IMPLICIT-COUNT SCENES
"""
# SPDX-License-Identifier: Apache-2.0
import concurrent.futures
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from counted import count

valgrind, program, scenes = sys.argv[1:]
WHATS = ("simulate", "step", "derivatives", "adjoint")
# crank-nicolson has a stage more, of which A and B are made (2.12 of its steps). Scene, method, and the most that A and B may cost over a step of a simulation, and over the step as a function.
CASES = [
    ("flyball-governor", "implicit-euler", 2.0, 2.0),
    ("flyball-governor", "crank-nicolson", 2.0, 2.4),
    ("flyball-governor", "radau5", 3.0, 3.0),
    ("cart-pole", "implicit-euler", 2.0, 2.0),
    ("arm7", "implicit-euler", 2.0, 2.1),
    # As measured: the step itself is as cheap as one of a simulation, F at its end and the projection's derivatives are not.
    ("four-bar", "implicit-euler", 3.0, 3.0),
]


def measure(case):
    scene, method, *_ = case
    path = pathlib.Path(scenes) / f"{scene}.yaml"
    return {what: count(valgrind, "call", program, what, method, path).instructions for what in WHATS}


with concurrent.futures.ThreadPoolExecutor(2) as pool:
    results = list(pool.map(measure, CASES))
dear = []
for (scene, method, over_simulated, over_step), c in zip(CASES, results):
    ratios = {what: (c[what] / c["simulate"], c[what] / c["step"]) for what in WHATS}
    said = (f"{scene}, {method}: a simulation's step {c['simulate']}, the step {c['step']}, A and B {c['derivatives']} instructions: "
            f"{ratios['derivatives'][0]:.2f} and {ratios['derivatives'][1]:.2f} steps; the adjoint {ratios['adjoint'][0]:.2f} and "
            f"{ratios['adjoint'][1]:.2f}")
    note(said)
    for what in ("derivatives", "adjoint"):
        dear += [said] if ratios[what][0] > over_simulated or ratios[what][1] > over_step else []
claim("derivatives_of_implicit_steps_cost_at_most_so_many_steps", dear)
finish()
