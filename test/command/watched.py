"""watched.py KINETREE [CASES]: what `run` reports about motions that its records do not show.

Random oscillators, sliding and turning, with random units and phases, have closed forms. Records of an interval that the program chooses
are compared with the period: too few of them give a warning with the right number of periods, and enough of them give none. The extremes
of the summary are the amplitude for every interval. Records at turning points give no warning of energies. Motions below the absolute
tolerance, and scenes that nothing sets in motion, give one warning. Scenes that are held at rest, and resting on purpose, give none.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
CASES = int(sys.argv[2]) if len(sys.argv) > 2 else 16


def run(folder, scene, *words):
    """The summary of a run, and its printed words."""
    path = pathlib.Path(folder) / "scene.json"
    path.write_text(json.dumps(scene))
    ended = subprocess.run([KINETREE, "run", path, "--out", "out.csv", "--summary", "-", *words], cwd=folder, capture_output=True, text=True)
    return json.loads(ended.stdout) if ended.stdout else None, ended.stderr


def codes(summary):
    return [one["code"] for one in summary["warnings"]] if summary else ["no summary"]


def oscillator(rng, rate, amplitude, phase, duration):
    """A body on a spring: its position is amplitude cos(rate t + phase), its velocity the derivative."""
    name, slides, inertia = rng.choice(["plate", "b1", "x-ray", "mass_2"]), rng.random() < 0.5, 10 ** rng.uniform(-4, 4)
    joint = {"type": "prismatic" if slides else "revolute", "axis": rng.choice("xyz"), "position": amplitude * math.cos(phase),
             "velocity": -amplitude * rate * math.sin(phase)}
    body = {"name": name, "joint": joint, "mass": inertia, "inertia": [inertia] * 3}
    return name, {"kinetree": 1, "bodies": [body], "effects": [{"type": "joint_spring", "joint": name, "stiffness": inertia * rate * rate}],
                  "simulate": {"duration": duration}}


def check_intervals(folder, rng):
    """Default records, 0.1 to 20 a period."""
    problems, far = [], 0.0
    for _ in range(CASES):
        rate, amplitude = 10 ** rng.uniform(-1, 4), 10 ** rng.uniform(-3, 0)
        per_record = rng.choice([10 ** rng.uniform(-1.3, -0.5), 10 ** rng.uniform(-0.2, 0.7)])
        duration = per_record * 1000 * 2 * math.pi / rate
        name, scene = oscillator(rng, rate, amplitude, rng.uniform(0, 2 * math.pi), duration)
        scene["output"] = {"record": ["position", "velocity"]} # energies have half the period
        summary, words = run(folder, scene)
        records = summary["time"] / (sum(1 for _ in open(pathlib.Path(folder) / "out.csv")) - 2)
        periods = records * rate / (2 * math.pi)
        found = [one for one in summary["warnings"] if one["code"] == "aliased_records"]
        column = summary["columns"][f"position.{name}"]
        far = max(far, abs(column["max"] / amplitude - 1), abs(column["min"] / amplitude + 1))
        if bool(found) != (periods > 0.5) and not 0.4 < periods < 0.6:
            problems.append(f"{periods:.3g} periods a record: {codes(summary)}")
        elif found and abs(found[0]["value"] / periods - 1) > 0.02:
            problems.append(f"{periods:.3g} periods a record, but {found[0]['value']:.3g}")
        elif found and "--interval" not in found[0]["remedy"]:
            problems.append(f"no remedy: {found[0]['remedy']}")
    claim("records_too_far_apart_and_only_these_are_reported_with_the_number_of_periods", problems[:3])
    note(f"largest error of an extreme {far:.2e}, bound 1e-2, of {CASES} cases")
    claim("extremes_of_the_summary_are_amplitudes", [] if far < 0.01 else [f"{far}"])


def check_turns(folder, rng):
    """A body that turns evenly, on a cart or not, with a marker beside its axis and one on it."""
    problems = []
    for _ in range(CASES):
        per_record, rides = rng.choice([10 ** rng.uniform(-1.3, -0.5), 10 ** rng.uniform(-0.1, 0.7)]), rng.random() < 0.5
        rate, radius, interval = 10 ** rng.uniform(-1, 4), 10 ** rng.uniform(-3, 1), None
        joint = {"type": "revolute", "axis": "z", "velocity": rate}
        bodies = [{"name": "cart", "joint": {"type": "prismatic", "axis": "x", "velocity": 0.01 * rate * radius}, "mass": 1}] if rides else []
        bodies += [{"name": "wheel", **({"parent": "cart"} if rides else {}), "joint": joint, "mass": 1, "inertia": [1, 1, 1],
                    "markers": {"rim": [0, radius, 0], "hub": [0, 0, rng.uniform(0, 1)]}}]
        scene = {"kinetree": 1, "bodies": bodies, "simulate": {"duration": per_record * 1000 * 2 * math.pi / rate},
                 "output": {"record": ["position"], "markers": ["wheel.rim", "wheel.hub"]}}
        summary, words = run(folder, scene)
        records = summary["time"] / (sum(1 for _ in open(pathlib.Path(folder) / "out.csv")) - 2)
        turns = records * rate / (2 * math.pi)
        found = [one for one in summary["warnings"] if one["code"] == "aliased_records"]
        if bool(found) != (turns > 0.5):
            problems.append(f"{turns:.3g} turns a record: {codes(summary)}")
        elif found and not ("marker.wheel.rim." in found[0]["what"] and abs(found[0]["value"] / turns - 1) < 0.05):
            problems.append(f"{turns:.3g} turns a record, but {found[0]['value']:.3g}: {found[0]['what'][:120]}")
    claim("markers_that_go_round_between_records_are_reported", problems[:3])


def check_stroboscope(folder, rng):
    """Records that the user places at turning points, or at any phase, whole periods apart."""
    problems = []
    for _ in range(CASES):
        rate, amplitude, phase = 10 ** rng.uniform(-1, 3), 10 ** rng.uniform(-3, 0), rng.choice([0, math.pi / 2, rng.uniform(0, 6)])
        period = 2 * math.pi / rate
        name, scene = oscillator(rng, rate, amplitude, phase, 100 * period)
        scene["output"] = {"interval": period * rng.choice([0.5, 1, 2, 3])}
        summary, words = run(folder, scene)
        if codes(summary):
            problems.append(f"{codes(summary)}, phase {phase:.3g}, interval {scene['output']['interval'] / period:g} periods: {words[:200]}")
        elif abs(summary["columns"][f"velocity.{name}"]["max"] / (amplitude * rate) - 1) > 0.01:
            problems.append(f"velocity {summary['columns'][f'velocity.{name}']['max']:g}, right {amplitude * rate:g}")
    claim("records_at_turning_points_give_no_warning", problems[:3])


def check_small(folder, rng):
    problems = []
    for _ in range(CASES):
        rate, tolerance, resolved = rng.uniform(0.5, 2), 10 ** rng.uniform(-11, -6), rng.random() < 0.5
        amplitude = tolerance * 10 ** (rng.uniform(3.3, 5) if resolved else rng.uniform(-2, 1.3))
        name, scene = oscillator(rng, rate, amplitude, rng.uniform(0, 2 * math.pi), 5 / rate)
        scene["simulate"]["tolerance"] = {"relative": 1e-9, "absolute": tolerance}
        summary, words = run(folder, scene)
        if ("small_motion" in codes(summary)) == resolved and "has blown up" not in words:
            problems.append(f"{amplitude:.2g} at {tolerance:.2g}: {codes(summary)}, {words[:200]}")
    claim("motions_below_the_absolute_tolerance_are_reported", problems[:3])


def still(rng, kind):
    """Scenes that nothing sets in motion, and scenes that forces hold at rest."""
    g, axis = [0, 0, -9.81], rng.choice("xy")
    body = {"name": "b", "joint": {"type": "prismatic", "axis": axis}, "mass": 1, "shape": {"type": "box", "size": [0.1, 0.1, 0.1]}}
    spring = {"type": "joint_spring", "joint": "b", "stiffness": 10 ** rng.uniform(0, 6), "damping": rng.choice([0, 1])}
    scene = {"kinetree": 1, "gravity": g, "bodies": [body], "effects": [spring], "simulate": {"duration": rng.uniform(0.1, 10)}}
    if kind == "across":
        return scene
    if kind == "forgotten":
        del scene["gravity"]
        body["joint"]["axis"] = "z"
    elif kind == "beam":
        del scene["bodies"]
        scene["beams"] = [{"name": "b", "from": "world", "segments": rng.randint(2, 9), "length": 1, "mass_per_length": 5, "EI": 5e3}]
        scene["effects"] = []
    elif kind == "hinge":
        body["joint"] = {"type": "revolute", "axis": "z"}
        body["com"] = [rng.uniform(-1, 1), 0.3, 0]
    elif kind in ("large hinge", "small hinge"):
        size = 1e6 if kind == "large hinge" else 1e-4
        angle = rng.uniform(0.1, 1.4) # gravity acts along the axis, but for rounding
        s, c, across = math.sin(angle), math.cos(angle), size * rng.uniform(-1, 1)
        body["joint"] = {"type": "revolute", "axis": [s, 0, c]}
        scene["gravity"] = [-9.81 * s, 0, -9.81 * c]
        body["com"] = [-c * across, 0.3 * size, s * across]
        body["shape"]["size"] = [0.1 * size] * 3
    elif kind == "held":
        body["joint"] = {"type": "prismatic", "axis": "z", "position": -9.81 / spring["stiffness"]}
    elif kind == "ground":
        body["joint"] = {"type": "free", "position": {"position": [0, 0, 0.05]}}
        body["markers"] = {f"c{i}": [0.05 * x, 0.05 * y, -0.05] for i, (x, y) in enumerate([(1, 1), (1, -1), (-1, 1), (-1, -1)])}
        scene["effects"] = [{"name": f"e{i}", "type": "contact", "point": f"b.c{i}", "plane": "world", "restitution": 0, "friction": 0.5} for i in range(4)]
    elif kind == "brake":
        body["joint"]["axis"] = "z"
        scene["effects"] = [{"type": "joint_friction", "joint": "b", "coulomb": 20, "stick": True}]
    return scene


DOUBTS = ("density", "gyration")  # of a body of 1 kg at all sizes


def check_still(folder, rng):
    problems, kinds = [], {"across": True, "forgotten": True, "beam": True, "hinge": True, "large hinge": True, "small hinge": True, "held": False, "ground": False, "brake": False}
    for kind, wanted in kinds.items():
        for _ in range(2):
            summary, words = run(folder, still(rng, kind))
            if [code for code in codes(summary) if code not in DOUBTS] != (["rest"] if wanted else []):
                problems.append(f"{kind}: {codes(summary)} {words[:300]}")
    claim("scenes_that_nothing_moves_are_reported_and_scenes_that_forces_hold_are_not", problems[:4])


with tempfile.TemporaryDirectory() as folder:
    for check in (check_intervals, check_turns, check_stroboscope, check_small, check_still):
        check(folder, random.Random(78))
finish()
