"""mode_shapes.py KINETREE: each printed pair of `modes --json` satisfies A x = lambda x, next to neutral modes, too.

Random structures: a free or a fixed hub, arms and chains with springs and dampers, rotors that turn without resistance, and beams. Their
rigid motions and rotors are neutral modes. The residual is computed from the printed matrix and shapes alone, relative to the terms of each
row, with a floor of 1e-12 of the largest row.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import pathlib
import random
import re
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE, = sys.argv[1:]
STRUCTURES, BOUND = 200, 1e-3


def random_structure(rng):
    """A hub with arms, of sizes and stiffnesses over several orders of magnitude, in the axes of a random frame."""
    size, mass = 10 ** rng.uniform(-2, 2), 10 ** rng.uniform(-2, 3)
    hub = {"name": "hub", "mass": mass, "shape": {"type": "box", "size": [size * rng.uniform(0.2, 1) for _ in range(3)]}}
    hub["joint"] = rng.choice([{"type": "free"}, {"type": "free"}, {"type": "fixed"}, {"type": "planar"}, {"type": "spherical"}])
    bodies, effects = [hub], []
    for arm in range(rng.randint(1, 3)):
        parent, at = "hub", [size * rng.uniform(-0.5, 0.5) for _ in range(3)]
        axis = rng.choice([[1, 0, 0], [0, 1, 0], [0, 0, 1], [rng.gauss(0, 1) for _ in range(3)]])
        stiffness = mass * size ** 2 * 10 ** rng.uniform(0, 5)
        for link in range(rng.randint(1, 4)):
            name, length = f"arm{arm}_{link}", size * rng.uniform(0.5, 2)
            bodies.append({"name": name, "parent": parent, "mass": mass * 10 ** rng.uniform(-2, 0), "shape": {"type": "rod", "to": [length, 0, 0], "radius": length / 20},
                           "joint": {"type": "revolute", "axis": axis, "at": at}})
            effects.append({"type": "joint_spring", "joint": name, "stiffness": stiffness * rng.uniform(0.2, 1), "damping": rng.choice([0, 1e-3 * stiffness])})
            parent, at = name, [length, 0, 0]
        if rng.random() < 0.5:
            bodies.append({"name": f"rotor{arm}", "parent": parent, "mass": 0.01 * mass, "inertia": [1e-4 * mass * size ** 2 * k for k in (1, 1, 1.5)],
                           "joint": {"type": "revolute", "axis": rng.choice(["x", "y", "z"]), "at": at}})
    return {"kinetree": 1, "bodies": bodies, "effects": effects}


def random_spacecraft(rng):
    """A free bus with two beams; stiffnesses in two planes decouple to rounding."""
    mass, length, number = 10 ** rng.uniform(0, 4), 10 ** rng.uniform(-1, 2), rng.randint(2, 6)
    turn = rng.choice([0, 90, rng.uniform(0, 180)])
    bus = {"name": "bus", "joint": {"type": "free"}, "mass": mass, "shape": {"type": "box", "size": [0.2 * length] * 3},
           "markers": {"r": {"at": [0, 0.1 * length, 0], "rotation": {"rpy": [0, 0, f"{90 + turn} deg"]}},
                       "l": {"at": [0, -0.1 * length, 0], "rotation": {"rpy": [0, 0, f"{turn - 90} deg"]}}}}
    bending = mass * length ** 2 * 10 ** rng.uniform(-1, 4)
    beam = {"segments": number, "length": length, "mass_per_length": 0.05 * mass / length, "EI": [bending, bending * 10 ** rng.uniform(0, 2)], "GJ": 0.7 * bending,
            "inertia_per_length": 1e-4 * mass * length}
    return {"kinetree": 1, "bodies": [bus], "beams": [{"name": "right", "from": "bus.r", **beam}, {"name": "left", "from": "bus.l", **beam}]}


def component(mode, state):
    kind, name = state.split(".", 1)
    if kind == "state":
        return complex(*mode["state"][name])
    k = 0
    if "[" in name:
        name, k = name[:-1].split("[")
    return complex(*mode[kind][name][int(k)])


def worst_residual(printed):
    """The largest residual of a row over its terms, of all modes that are not neutral."""
    matrix, worst, count = printed["state_matrix"], 0.0, 0
    for mode in printed["modes"]:
        if mode["neutral"]:
            continue
        value, x = complex(mode["real"], mode["imaginary"]), [component(mode, state) for state in printed["states"]]
        residuals, terms = [], []
        for row, own in zip(matrix, x):
            residuals.append(abs(sum(a * b for a, b in zip(row, x)) - value * own))
            terms.append(sum(abs(a) * abs(b) for a, b in zip(row, x)) + abs(value) * abs(own))
        floor = 1e-12 * max(terms)
        ratios = [r / max(t, floor) for r, t in zip(residuals, terms)] if floor > 0 else [math.inf]
        worst, count = max([worst, *ratios]) if all(r == r for r in ratios) else math.inf, count + 1
    return worst, count


def check_pairs(folder):
    rng, worst, modes, problems = random.Random(78), 0.0, 0, []
    for number in range(STRUCTURES):
        scene = random_spacecraft(rng) if number % 4 == 0 else random_structure(rng)
        path = pathlib.Path(folder) / "structure.json"
        path.write_text(json.dumps(scene))
        ran = subprocess.run([KINETREE, "modes", path, "--json", "--at", "initial"], capture_output=True, text=True)
        if ran.returncode != 0:
            problems.append(f"structure {number}: {ran.stderr.strip()}")
            continue
        residual, count = worst_residual(json.loads(ran.stdout))
        worst, modes = max(worst, residual), modes + count
        if not residual <= BOUND:
            problems.append(f"structure {number}: a pair has a residual of {residual:.1e} > {BOUND}")
    note(f"{modes} modes of {STRUCTURES} structures: worst residual {worst:.1e}, bound {BOUND}")
    claim("each_pair_is_an_eigenpair_next_to_neutral_modes", problems + ([] if modes > STRUCTURES else ["too few modes"]))


def check_count(folder):
    """A picture has as many panels as --count, and its subtitle names them."""
    folder = pathlib.Path(folder)
    scene = random_spacecraft(random.Random(5))
    (folder / "craft.json").write_text(json.dumps(scene))
    problems, spans = [], []
    for count in (1, 2):
        ran = subprocess.run([KINETREE, "modes", "craft.json", "--count", str(count), "--plot", "craft.svg"], cwd=folder, capture_output=True, text=True)
        svg = (folder / "craft.svg").read_text() if ran.returncode == 0 else ""
        panels = len(set(re.findall(r">(\d+): [0-9.]+ Hz", svg)))
        problems += [] if panels == count else [f"--count {count} draws {panels} modes: {ran.stderr}"]
        spans.append("Mode 1 of" in svg if count == 1 else "Modes 1 to 2 of" in svg)
    claim("count_chooses_the_modes_that_are_drawn", problems + ([] if all(spans) else ["the subtitle does not state the modes"]))


with tempfile.TemporaryDirectory() as folder:
    check_pairs(folder)
    check_count(folder)
finish()
