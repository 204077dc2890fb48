"""travel.py KINETREE: coordinates of motions, screws and gears start and rest anywhere from 1 to 1e5 rad.

Positions that a motion or a coupling determines are compared with their formulas, and equilibria of a geared arm with the root of its torque,
by bisection. The equations of such coordinates are linear, so no length of a step limits them.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE, = sys.argv[1:]
BOUND = 1e-9


def kinetree(folder, scene, *words):
    path = pathlib.Path(folder) / "scene.json"
    path.write_text(json.dumps(scene))
    return subprocess.run([KINETREE, words[0], path, *words[1:]], cwd=folder, capture_output=True, text=True)


def start_of(folder, scene):
    """The first record of the positions, by column."""
    ended = kinetree(folder, {**scene, "simulate": {"duration": 0.01}, "output": {"interval": 0.01}}, "run", "--out", "out.csv", "--quiet")
    if ended.returncode != 0:
        return {}, ended.stderr
    with open(pathlib.Path(folder) / "out.csv", newline="") as file:
        return {name: float(value) for name, value in next(csv.DictReader(file)).items()}, ""


def travels(rng):
    return [10 ** rng.uniform(0, 5) * rng.choice([-1, 1]) for _ in range(12)]


def check(name, wanted, found, words, worst, problems):
    off = abs(found - wanted) / abs(wanted) if found is not None else math.inf
    if not off <= BOUND:
        problems.append(f"{name}: {found}, right {wanted}; {words.strip()}")
    return max(worst, off)


def check_starts(folder, rng):
    problems, worst = [], 0.0
    wheel = {"joint": {"type": "revolute", "axis": "x"}, "mass": 1, "inertia": [1, 1, 1]}
    for travel in travels(rng):
        scene = {"kinetree": 1, "bodies": [{"name": "a", **wheel}], "loops": [{"name": "m", "type": "motion", "joint": "a", "position": {"polynomial": [travel, 1]}}]}
        found, words = start_of(folder, scene)
        worst = check("motion", travel, found.get("position.a"), words, worst, problems)
        lead = 10 ** rng.uniform(-4, 0)
        scene = {"kinetree": 1, "bodies": [{"name": "slider", "joint": {"type": "prismatic", "axis": "x", "position": lead * travel}, "mass": 1}, {"name": "screw", **wheel}],
                 "loops": [{"name": "ls", "type": "coupling", "coefficients": {"screw": lead, "slider": -1}}]}
        found, words = start_of(folder, scene)
        worst = check("screw", travel, found.get("position.screw"), words, worst, problems)
        worst = check("slider", lead * travel, found.get("position.slider"), words, worst, problems)
    note(f"starts are off by at most {worst:.1e} of their travel, bound {BOUND}")
    claim("motions_and_screws_start_at_any_travel", problems)


def root_of_torque(ratio, stiffness):
    """The angle of a level arm with weight 1 kg 9.81 m/s^2 at 0.5 m, held by a spring at the motor."""
    low, high = -math.pi / 2, 0.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if 4.905 * math.cos(middle) + ratio ** 2 * stiffness * middle < 0 else (low, middle)
    return low


def check_equilibria(folder, rng):
    problems, worst = [], 0.0
    for start in [abs(x) for x in travels(rng)]:
        ratio, stiff = max(start, 2.0), 10 ** rng.uniform(0.7, 1.5)
        scene = {"kinetree": 1, "gravity": [0, -9.81, 0],
                 "bodies": [{"name": "motor", "joint": {"type": "revolute", "axis": "z", "position": ratio}, "mass": 1, "inertia": [1e-5, 1e-5, 1e-5]},
                            {"name": "arm", "joint": {"type": "revolute", "position": 1}, "mass": 1, "shape": {"type": "rod", "to": [1, 0, 0]}}],
                 "loops": [{"name": "gear", "type": "coupling", "coefficients": {"motor": 1, "arm": -ratio}}],
                 "effects": [{"type": "joint_spring", "joint": "motor", "stiffness": stiff / ratio ** 2, "rest": 0}]}
        ended = kinetree(folder, scene, "equilibrium", "--json")
        arm = json.loads(ended.stdout)["position"]["arm"] if ended.returncode == 0 else None
        worst = check(f"arm geared by {ratio:.4g}", root_of_torque(ratio, stiff / ratio ** 2), arm[0] if isinstance(arm, list) else arm, ended.stderr, worst, problems)
    note(f"equilibria are off by at most {worst:.1e}, bound {BOUND}")
    claim("geared_arms_rest_where_their_torque_vanishes", problems)


def check_limits(folder):
    """A torque that exceeds every weight turns the arm for ever: the message names the limit, and claims no absence."""
    scene = {"kinetree": 1, "gravity": [0, -9.81, 0], "bodies": [{"name": "arm", "joint": {"type": "revolute", "axis": "z"}, "mass": 1, "shape": {"type": "rod", "to": [1, 0, 0]}}],
             "effects": [{"type": "motor", "joint": "arm", "torque": 6}]}
    ended = kinetree(folder, scene, "equilibrium")
    claim("a_limit_is_reported_as_a_limit", [] if ended.returncode == 4 and "limit of 300 steps" in ended.stderr and "there is no" not in ended.stderr else [ended.stderr])


with tempfile.TemporaryDirectory() as folder:
    check_starts(folder, random.Random(200))
    check_equilibria(folder, random.Random(201))
    check_limits(folder)
finish()
