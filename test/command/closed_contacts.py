"""closed_contacts KINETREE: warnings of fixed steps in scenes that rest on hard contacts, against the closed form of the only mode.

An arm with a spring swings slightly, with omega^2 = (k + m g l) / I. A ball rests on a stop, or the arm stands on a
block whose feet stick. The modes are those of the mechanism with these contacts closed.
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
G, MASS, LENGTH, INERTIA = 9.81, 1.0, 0.5, 0.1 + 0.25
random.seed(7)

ALONE = "", ""
STOP = """  - {name: ball, joint: {type: prismatic, axis: z}, mass: 1, shape: {type: sphere, radius: 0.1}}
""", """  - {type: joint_limit, joint: ball, lower: 0, restitution: 0.5}
"""
BLOCK = """  - name: block
    joint: {type: free, position: {position: [0, 0, 0.1]}}
    mass: 500
    shape: {type: box, size: [0.8, 0.8, 0.2]}
    markers: {a: [0.4, 0.4, -0.1], b: [-0.4, 0.4, -0.1], c: [0, -0.4, -0.1]}
""", "".join(f"  - {{type: contact, point: block.{p}, plane: world, axis: z, restitution: 0, friction: 0.8}}\n" for p in "abc")


def warnings_of(ground, stiffness, method, step):
    """{code: value} of the warnings about the step."""
    parent = "parent: block, " if ground is BLOCK else ""
    scene = f"""kinetree: 1
gravity: [0, 0, -{G}]
bodies:
{ground[0]}  - {{name: arm, {parent}joint: {{type: revolute, axis: y, position: 0.001}}, mass: {MASS}, com: [0, 0, -{LENGTH}], inertia: [0.1, 0.1, 0.01]}}
effects:
{ground[1]}  - {{type: joint_spring, joint: arm, stiffness: {stiffness}}}
simulate: {{duration: 0.3, integrator: {method}, step: {step}}}
"""
    with tempfile.TemporaryDirectory() as place:
        path = pathlib.Path(place) / "scene.yaml"
        path.write_text(scene)
        ran = subprocess.run([KINETREE, "run", str(path), "--out", "/dev/null", "--summary", "-"], capture_output=True, text=True)
    if ran.returncode != 0:
        note(f"exit status {ran.returncode}: {ran.stderr}")
        return {"failed": math.nan}
    codes = "unstable_step", "few_samples", "unknown_stability"
    return {w["code"]: w.get("value") for w in json.loads(ran.stdout).get("warnings", []) if w["code"] in codes}


unknown, others, periods, warned = [], [], [], 0
for _ in range(12):
    stiffness = round(math.exp(random.uniform(math.log(20), math.log(400))), 3)
    method, step = random.choice(["heun", "rk4"]), random.choice([0.02, 0.01, 0.002])
    samples = 2 * math.pi / step / math.sqrt((stiffness + MASS * G * LENGTH) / INERTIA)
    alone = warnings_of(ALONE, stiffness, method, step)
    warned += "few_samples" in alone
    for ground in STOP, BLOCK:
        what = f"{'block' if ground is BLOCK else 'stop'}, {method}, {step} s, {stiffness} N m/rad"
        found = warnings_of(ground, stiffness, method, step)
        unknown += [what] if "unknown_stability" in found else []
        others += [f"{what}: {found}, alone {alone}"] if set(found) != set(alone) else []
        bound = 0.01 if ground is BLOCK else 1e-3  # the block's mass is 500 times that of the arm
        value = found.get("few_samples", samples)
        periods += [f"{what}: {value}, expected {samples}"] if not abs(value / samples - 1) <= bound else []
note(f"{warned} of 12 arms have few samples")
claim("modes_with_closed_contacts_are_known", unknown)
claim("resting_contacts_change_no_warning", others)
claim("samples_of_a_period_are_those_of_the_closed_form", periods + ([] if warned >= 3 else ["too few"]))
finish()
