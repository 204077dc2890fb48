"""reactions KINETREE: what `reaction.JOINT` has along the axis of a joint is what effects and drives exert in it, and `bearing.JOINT` is the rest.

About its axis a revolute joint without effects transmits nothing; so the page's formula for the bearing alone is zero there. Random chains in
space are compared with the same chains in which the torques and forces of springs, dampers, motors and drives in joints act from outside, on the
body and opposite on its parent: there the reaction of a joint is what its bearing transmits.
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

KINETREE = sys.argv[1]
SCENE = """kinetree: 1
gravity: [0, -9.81, 0]
bodies:
  - {{name: arm, joint: {{type: revolute, axis: z, position: {a:.4f}}}, mass: 2, shape: {{type: rod, to: [0, -1, 0]}}}}
  - {{name: hand, parent: arm, joint: {{type: revolute, axis: z, at: [0, -1, 0], position: {b:.4f}}}, mass: 1, shape: {{type: rod, to: [0, -1, 0]}}}}
loops: [{{name: drive, type: motion, joint: arm, position: {{polynomial: [{a:.4f}, {c:.4f}]}}}}]
effects:
  - {{name: spring, type: joint_spring, joint: arm, stiffness: {k:.4f}}}
  - {{name: elbow, type: joint_spring, joint: hand, stiffness: {l:.4f}}}
simulate: {{duration: 1, tolerance: 1e-9}}
output:
  interval: 0.1
  record: [position, reaction, effect]
  columns:
    bearing: "reaction.arm.mz - reaction.drive.multiplier - effect.spring.torque"
    elbow_bearing: "reaction.hand.mz - effect.elbow.torque"
"""
BOUND = 1e-9  # of moments of some 10 N m

worst, size, problems = 0.0, 0.0, []
for seed in range(6):
    r = random.Random(seed)
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder)
        (path / "r.yaml").write_text(SCENE.format(a=r.uniform(-1, 1), b=r.uniform(-1, 1), c=r.uniform(-2, 2), k=r.uniform(1, 30), l=r.uniform(1, 30)))
        ran = subprocess.run([KINETREE, "run", "r.yaml", "--out", "r.csv", "--quiet"], cwd=path, capture_output=True, text=True)
        rows = list(csv.DictReader((path / "r.csv").open(newline=""))) if ran.returncode == 0 else []
        problems += [] if rows else [ran.stderr]
        for row in rows:
            worst = max(worst, abs(float(row["bearing"])), abs(float(row["elbow_bearing"])))
            size = max(size, abs(float(row["reaction.arm.mz"])))
note(f"moments up to {size:.3g} N m; the bearings alone: {worst:.3g} of {BOUND}")
claim("reactions_of_joints_include_effects_and_drives", problems if worst < BOUND and size > 1.0 else [*problems, f"{worst}"])


def random_chain(r):
    """The chain with effects in its joints; by joint the axis, and what these effects exert without the drive."""
    bodies, effects, loops, inside = [], [], [], {}
    for i in range(r.randint(2, 6)):
        kind = r.choice(["revolute", "revolute", "prismatic", "screw", "cylindrical", "spherical", "universal", "planar"])
        axis = [round(r.uniform(-1, 1), 3) for _ in range(3)]
        axis = [x / math.hypot(*axis) for x in axis]
        joint = {"type": kind, "at": [round(r.uniform(-0.4, 0.4), 3) for _ in range(3)]}
        if kind == "universal":
            joint.update(axis="x", axis2=[round(r.uniform(-0.5, 0.5), 3), round(r.uniform(-1, 1), 3), 0.8], position=[round(r.uniform(-1, 1), 3), round(r.uniform(-1, 1), 3)])
        elif kind != "spherical":
            joint["axis"] = axis
        if kind == "screw":
            joint["pitch"] = 0.05
        body = {"name": f"b{i}", "mass": round(r.uniform(0.5, 3), 3), "inertia": [0.02, 0.03, 0.025], "com": [round(r.uniform(-0.4, 0.4), 3) for _ in range(3)]}
        if kind in ("revolute", "prismatic", "screw"):
            q, v, k, d, m = (round(r.uniform(*x), 3) for x in ((-1, 1), (-2, 2), (1, 50), (0, 3), (-5, 5)))
            joint.update(position=q, velocity=v)
            effects.append({"type": "joint_spring", "joint": f"b{i}", "stiffness": k})
            effects.append({"type": "joint_damper", "joint": f"b{i}", "damping": d})
            effects.append({"type": "motor", "joint": f"b{i}", ("force" if kind == "prismatic" else "torque"): m})
            inside[f"b{i}"] = (kind, axis, -k * q - d * v + m)
            if r.random() < 0.3:
                loops.append({"name": f"drive{i}", "type": "motion", "joint": f"b{i}", "position": {"polynomial": [q, v, round(r.uniform(-5, 5), 3)]}})
        bodies.append({**body, "joint": joint, **({"parent": f"b{i - 1}"} if i > 0 else {})})
    return bodies, effects, loops, inside


def record(folder, name, scene):
    (pathlib.Path(folder) / f"{name}.json").write_text(json.dumps({"kinetree": 1, "gravity": [0.7, -2, -9.81], **scene,
                                                                   "simulate": {"duration": 1e-3}}))
    ran = subprocess.run([KINETREE, "run", f"{name}.json", "--out", f"{name}.csv", "--record", "reaction,bearing", "--quiet"], cwd=folder,
                         capture_output=True, text=True)
    if ran.returncode != 0:
        return None, ran.stderr
    with (pathlib.Path(folder) / f"{name}.csv").open(newline="") as file:
        return {key: float(x) for key, x in next(csv.DictReader(file)).items()}, ""


def outer(bodies, inside, row):
    """The effects that act from outside in place of those in the joints."""
    effects = []
    for k, body in enumerate(bodies):
        name = body["name"]
        if name not in inside:
            continue
        kind, axis, amount = inside[name]
        amount += row.get(f"reaction.drive{k}.multiplier", 0.0)
        pull = [amount * x for x in axis]
        for on, at, sign in ((name, [0, 0, 0], 1), (body.get("parent"), body["joint"]["at"], -1)):
            value = [sign * x for x in pull]
            if on is not None and kind == "prismatic":
                effects.append({"type": "force", "at": {"body": on, "at": at}, "value": value, "frame": "body"})
            elif on is not None:
                effects.append({"type": "torque", "on": on, "value": value, "frame": "body"})
    return effects


def check_bearings():
    worst, size, joints, faults = 0.0, 0.0, set(), []
    for seed in range(40):
        bodies, effects, loops, inside = random_chain(random.Random(seed))
        with tempfile.TemporaryDirectory() as folder:
            row, words = record(folder, "a", {"bodies": bodies, "effects": effects, "loops": loops})
            free, more = record(folder, "b", {"bodies": bodies, "effects": outer(bodies, inside, row or {})})
        if row is None or free is None:
            faults.append(f"seed {seed}: {words}{more}")
            continue
        joints |= {body["joint"]["type"] for body in bodies}
        scale = max(1.0, *(abs(x) for x in row.values()))
        size = max(size, *(abs(row[key] - row[key.replace("bearing", "reaction")]) for key in row if key.startswith("bearing.")))
        for key in row:
            if key.startswith("bearing."):
                apart = max(abs(row[key] - free[key.replace("bearing", "reaction")]), abs(free[key] - free[key.replace("bearing", "reaction")])) / scale
                worst = max(worst, apart)
                faults += [] if apart <= 1e-10 else [f"seed {seed}: {key} {row[key]}, from outside {free[key.replace('bearing', 'reaction')]}"]
    note(f"{len(joints)} types of joints, effects and drives up to {size:.3g}: bearings {worst:.1e} of 1e-10")
    claim("bearings_are_the_reactions_of_the_same_motion_with_effects_and_drives_from_outside", faults if size > 1 and len(joints) == 7 else [*faults, f"{joints}"])


check_bearings()
finish()
