"""twins.py KINETREE SCENES: random scenes move alike in other units, with other masses, turned, permuted, later, and with other records.

A scene has a chain of links, a slider on a slope and a ball over a hard floor. Joints have springs, dampers and friction that sticks. Events set
velocities and release a spring. Drives hold all joints until an instant, at which an event releases them. Each scene is one description with
parameters; a twin has other parameters, and its numbers follow from dimensions alone. The ends of the motions are compared, and how often each
event and each contact has happened.
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

KINETREE, SCENES = sys.argv[1], int(sys.argv[2])
BOUND = 1e-8  # measured: 1.7e-10, of the start at 1e4 s


def draw(rng):
    """The numbers of a scene, in metres, kilograms and seconds."""
    count = rng.randint(2, 3)
    return {"links": [{"length": rng.uniform(0.3, 0.8), "mass": rng.uniform(0.5, 3), "angle": rng.uniform(-1, 1),
                       "axis": rng.choice([[0, 1, 0], [0, 1, 0], [rng.gauss(0, 1) for _ in range(3)]]),
                       "friction": rng.choice([None, rng.uniform(0.05, 0.4)]), "stiffness": rng.uniform(0, 20), "damping": rng.uniform(0, 0.3)} for _ in range(count)],
            "slope": rng.uniform(0.2, 0.8), "rubs": rng.uniform(0.05, 0.9), "block": rng.uniform(0.5, 3), "spring": rng.uniform(5, 50),
            "ball": rng.uniform(0.1, 1), "height": rng.uniform(0.05, 0.4), "bounce": rng.uniform(0.2, 0.8), "mu": rng.choice([0, rng.uniform(0.05, 0.3)]),
            "pass": rng.uniform(-0.5, 0.5), "share": rng.uniform(-0.8, 0.8), "slides": rng.uniform(0.05, 0.3), "order": rng.random()}


def build(p, mass=1.0, length=1.0, time=1.0, turn=(0, 0, 0), shuffled=False, start=0.5, interval=1.0):
    m, l, t, g = mass, length, time, 9.81
    force, torque = m * l / t ** 2, m * l ** 2 / t ** 2
    bodies, effects, held = [], [], []
    for k, link in enumerate(p["links"]):
        name, size, own = f"link{k}", link["length"], link["mass"]
        inertia = [own * size ** 2 * part * m * l ** 2 for part in (0.09, 0.1, 0.02)]
        bodies.append({"name": name, "parent": f"link{k - 1}" if k else "base", "mass": own * m, "com": [0, 0, -size / 2 * l], "inertia": inertia,
                       "joint": {"type": "revolute", "axis": link["axis"], "at": [0, 0, -p["links"][k - 1]["length"] * l] if k else [0, 0, 3 * l], "position": link["angle"]}})
        if link["friction"]:
            effects.append({"name": f"rub{k}", "type": "joint_friction", "joint": name, "coulomb": link["friction"] * own * size * torque, "stick": True})
        effects.append({"name": f"coil{k}", "type": "joint_spring", "joint": name, "stiffness": link["stiffness"] * torque, "damping": link["damping"] * torque * t, "switched": "on"})
        held.append((name, link["angle"]))
    slope = [math.cos(p["slope"]), 0, -math.sin(p["slope"])]
    bodies.append({"name": "block", "parent": "base", "mass": p["block"] * m, "joint": {"type": "prismatic", "axis": slope, "at": [0, 2 * l, 0]}})
    effects.append({"name": "slope", "type": "joint_friction", "joint": "block", "coulomb": p["rubs"] * p["block"] * g * math.cos(p["slope"]) * force, "stick": True})
    effects.append({"name": "pull", "type": "joint_spring", "joint": "block", "stiffness": p["spring"] * m / t ** 2})
    held.append(("block", 0.0))
    bodies.append({"name": "ball", "parent": "base", "mass": p["ball"] * m, "inertia": [p["ball"] * 0.4 * 0.05 ** 2 * m * l ** 2] * 3, "markers": {"c": [0, 0, 0]},
                   "joint": {"type": "prismatic", "axis": "z", "at": [0, -2 * l, 0.05 * l], "position": p["height"] * l}})
    effects.append({"name": "floor", "type": "contact", "point": "ball.c", "radius": 0.05 * l, "plane": {"body": "base"}, "restitution": p["bounce"], "friction": p["mu"], "rest_velocity": 1e-3 * l / t})
    held.append(("ball", p["height"] * l))
    loops = [{"name": f"hold_{name}", "type": "motion", "joint": name, "position": at, "switched": "on"} for name, at in held]
    begin = start * t
    events = [{"name": "begin", "when": f"t - {begin!r}", "direction": "rising", "then": [{"release": loop["name"]} for loop in loops], "limit": 1},
              {"name": "passes", "when": f"position.link0 - {p['pass']!r}", "then": {"set": {"velocity.link1": f"{p['share']!r}*velocity.link1"}}, "limit": 3},
              {"name": "slides", "when": f"position.block > {p['slides'] * l!r}", "then": {"release": "coil0"}, "limit": 1}]
    if shuffled:
        for each in (effects, loops):
            random.Random(p["order"]).shuffle(each)
        bodies[-1], bodies[-2] = bodies[-2], bodies[-1]
        bodies.insert(0, bodies.pop())
        events.reverse()
    base = {"name": "base", "joint": {"type": "fixed", "rotation": {"rpy": list(turn)}}}
    return {"kinetree": 1, "gravity": rotated(turn, [0, 0, -g * l / t ** 2]), "bodies": [base, *bodies], "loops": loops, "effects": effects, "events": events,
            "simulate": {"duration": begin + 1.5 * t, "tolerance": {"relative": 1e-11, "absolute": 1e-14}}, "output": {"interval": interval * t}}


def rotated(rpy, v):
    """R v with R = Rz(yaw) Ry(pitch) Rx(roll)."""
    x, y, z = v
    roll, pitch, yaw = rpy
    y, z = math.cos(roll) * y - math.sin(roll) * z, math.sin(roll) * y + math.cos(roll) * z
    x, z = math.cos(pitch) * x + math.sin(pitch) * z, -math.sin(pitch) * x + math.cos(pitch) * z
    return [math.cos(yaw) * x - math.sin(yaw) * y, math.sin(yaw) * x + math.cos(yaw) * y, z]


def end_of(folder, scene, length, time):
    """Positions and velocities at the end in the units of the first scene, and the counts of events."""
    path = pathlib.Path(folder) / "scene.json"
    path.write_text(json.dumps(scene))
    ended = subprocess.run([KINETREE, "run", path, "--out", "/dev/null", "--summary", "s.json", "--quiet"], cwd=folder, capture_output=True, text=True)
    if ended.returncode != 0:
        return None, f"exit {ended.returncode}: {ended.stderr.strip()}"
    summary = json.loads((pathlib.Path(folder) / "s.json").read_text())
    state = {}
    for name in summary["position"]:
        unit = 1.0 if name.startswith("link") else length
        state[f"position.{name}"] = summary["position"][name] / unit
        state[f"velocity.{name}"] = summary["velocity"][name] / unit * time
    contacts = summary.get("contacts") or {}
    return state, {**summary["events"], "impacts": contacts.get("impacts")}


TWINS = {"masses times 1e-4": {"mass": 1e-4}, "masses times 1e4": {"mass": 1e4}, "lengths times 1e-3": {"length": 1e-3}, "lengths times 1e3": {"length": 1e3},
         "times times 1e-2": {"time": 1e-2}, "times times 30": {"time": 30.0}, "turned": {"turn": (0.3, -1.1, 2.0)}, "permuted": {"shuffled": True},
         "1e4 s later": {"start": 1e4, "interval": 1e4}, "records each 0.01 s": {"interval": 0.01}}


def compare(folder, seed, worst, problems):
    p = draw(random.Random(seed))
    first, counts = end_of(folder, build(p), 1.0, 1.0)
    if first is None:
        problems.append(f"scene {seed}: {counts}")
        return
    for name, how in TWINS.items():
        found, others = end_of(folder, build(p, **how), how.get("length", 1.0), how.get("time", 1.0))
        if found is None:
            problems.append(f"scene {seed}, {name}: {others}")
            continue
        off = max(abs(found[key] - value) / max(1.0, abs(value)) for key, value in first.items())
        worst[name] = max(worst.get(name, 0.0), off)
        if not off <= BOUND or others != counts:
            problems.append(f"scene {seed}, {name}: off by {off:.3g}; {counts}, and of the twin {others}")


def main():
    worst, problems = {}, []
    with tempfile.TemporaryDirectory() as folder:
        for seed in range(SCENES):
            compare(folder, seed, worst, problems)
    for name, off in worst.items():
        note(f"{name}: {off:.2g}")
    most = max(worst.values(), default=math.inf)
    note(f"{SCENES} scenes, {len(TWINS)} twins each: at most {most:.2g} rad, m, rad/s or m/s, bound {BOUND:g}")
    claim("random_scenes_move_as_their_twins", problems[:12] or ([] if most <= BOUND else [f"off by {most}"]))
    finish()


main()
