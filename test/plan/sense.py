"""Sensors after each step: what they cost is not what the step knows already.

sense.py VALGRIND SENSE-COUNT SCENES
"""
# SPDX-License-Identifier: Apache-2.0
import concurrent.futures
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from counted import count

valgrind, program, scenes = sys.argv[1:]
WHATS = ("nothing", "points", "wrenches", "anew")
# What evaluates accelerations: recursions in trees and with loops, and what they do with loops and effects.
EVALUATIONS = ("kt_forward", "kt_planar_forward", "kt_closed_forward", "kt_spatial_accelerate", "kt_group_factor",
               "kt_effects_apply", "kt_dynamics_forward")
# Scene, method, how it is computed; what sensors may take of a step: points with accelerations, and wrenches, too. A
# tenth more than the larger of what was measured of the code of gcc 12.2 and of gcc 14.2 (humanoid, rk4: 5.2 and 15.0 % by
# the first, 4.4 and 13.1 % by the second). Some 60 instructions a link of it, 0.7 % of that step, copy the links' motion to
# where later calls of dynamics leave it alone. Reactions in planar loops take an evaluation in space.
# Those of the four-bar lie in its plane, so that the self-stresses out of the plane are not computed (they took 55 %).
CASES = [
    ("arm7", "rk4", "tree in space", 0.062, 0.23),
    ("humanoid", "rk4", "tree in space", 0.057, 0.165),
    ("humanoid", "dopri5", "tree in space", 0.037, 0.108),
    ("cart-pole", "rk4", "tree in a plane", 0.164, 0.36),
    ("stewart", "rk4", "loops in space", 0.009, 0.0445),
    ("four-bar", "rk4", "loop in a plane", 0.113, 0.91),
]


def measure(case):
    scene, method, *_ = case
    path = pathlib.Path(scenes) / f"{scene}.yaml"
    return {what: count(valgrind, "take_steps", program, what, method, path) for what in WHATS}


def evaluating(counted):
    return {name: n for name, n in counted.instructions_of.items() if any(name.startswith(e) for e in EVALUATIONS)}


with concurrent.futures.ThreadPoolExecutor(2) as pool:
    results = list(pool.map(measure, CASES))

again, dear, no_cheaper = [], [], []
for (scene, method, kind, points, wrenches), c in zip(CASES, results):
    plain = c["nothing"].instructions
    more = {what: c[what].instructions / plain - 1.0 for what in WHATS}
    said = (f"{scene}, {method}, {kind}: {plain / 20:.0f} instructions a step; points {100 * more['points']:+.1f} %, with "
            f"wrenches {100 * more['wrenches']:+.1f} %, these anew {100 * more['anew']:+.1f} %")
    note(said)
    planar_loop = kind == "loop in a plane"
    for what in ("points",) if planar_loop else ("points", "wrenches"):
        again += [f"{scene}, {method}, {what}: {name}: {evaluating(c[what]).get(name)} instead of {n}"
                  for name, n in evaluating(c["nothing"]).items() if evaluating(c[what]).get(name) != n]
    dear += [said] if more["points"] > points or more["wrenches"] > wrenches else []
    no_cheaper += [said] if more["wrenches"] > (0.95 if planar_loop else 0.7) * more["anew"] else []
claim("there_are_evaluations_to_compare", [] if all(len(evaluating(c["nothing"])) > 0 for c in results) else ["none"])
claim("sensors_run_no_instruction_of_an_evaluation_more", again)
claim("sensors_cost_what_was_measured", dear)
claim("sensors_cost_less_than_evaluating_anew", no_cheaper)
finish()
