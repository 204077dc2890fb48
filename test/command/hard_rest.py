"""hard_rest KINETREE: `equilibrium` and `modes` of scenes with hard parts are those of the mechanism without them.

The mechanism is a rod that hangs from a joint: it rests at 0, with omega^2 = 3 g / (2 l). With viscous friction c, the
two eigenvalues have the sum -c / I.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish

KINETREE = sys.argv[1]
G, INERTIA = 9.81, 1 / 3
OMEGA = math.sqrt(1.5 * G)
FOLDER = tempfile.TemporaryDirectory()
SCENE = pathlib.Path(FOLDER.name) / "scene.yaml"


def scene(effects, degrees=60):
    SCENE.write_text(f"""kinetree: 1
gravity: [0, -{G}, 0]
bodies:
  - {{name: arm, joint: {{type: revolute, axis: z, position: {degrees} deg}}, mass: 1, shape: {{type: rod, to: [0, -1, 0]}}, markers: {{tip: [0, -1, 0]}}}}
effects:
{effects}simulate: {{duration: 1}}
""")


def ask(command, *options):
    ran = subprocess.run([KINETREE, command, str(SCENE), "--json", *options], capture_output=True, text=True)
    return (json.loads(ran.stdout) if ran.returncode == 0 else None), ran.stderr


STOP = "  - {name: stop, type: joint_limit, joint: arm, lower: LOWER deg, restitution: 0}\n"
STICK = "  - {name: fric, type: joint_friction, joint: arm, coulomb: 0.5, viscous: 0.2, stick: true}\n"
MANY = "".join(f"  - {{name: fric{k}, type: joint_friction, joint: arm, coulomb: 0.5, viscous: 0.05, stick: true}}\n" for k in range(4))
# The plane lies below the rod at rest, or at its end.
FLOOR = "  - {name: floor, type: contact, point: arm.tip, radius: 0.1, plane: {body: world, at: [0, HEIGHT, 0]}, axis: y, restitution: 0, friction: 0.5}\n"

CASES = [
    # effects, viscous friction, degrees, parts of the messages, without these
    (STOP.replace("LOWER", "30"), 0.0, 60, ["left out: 'stop'", "`run` cannot reach this state: 'stop.lower' is 0.524 (m or rad) beyond its boundary"], []),
    (STOP.replace("LOWER", "-30"), 0.0, 60, ["left out: 'stop'"], ["cannot reach", "closed"]),
    (STICK, 0.2, 60, ["left out: 'fric'"], ["cannot reach", "closed"]),
    (MANY, 0.2, 60, ["left out: 'fric0' and others"], ["cannot reach", "closed"]),
    (FLOOR.replace("HEIGHT", "-1.2"), 0.0, 60, ["left out: 'floor'"], ["cannot reach", "closed"]),
]

positions, eigenvalues, messages = [], [], []
for effects, viscous, degrees, parts, others in CASES:
    scene(effects, degrees)
    name = effects.split(",")[0].split(": ")[1]
    found, words = ask("equilibrium")
    at = found["position"]["arm"] if found else math.nan
    positions += [f"{name}: {at} {words}"] if not abs(at) <= 1e-12 else []
    messages += [f"{name}: lacks '{part}' in: {words}" for part in parts if part not in words]
    messages += [f"{name}: has '{part}' in: {words}" for part in [*others, "kt_"] if part in words]
    found, words = ask("modes")
    expected = complex(-viscous / INERTIA / 2, math.sqrt(OMEGA**2 - (viscous / INERTIA / 2) ** 2))
    values = [complex(m["real"], m["imaginary"]) for m in found["modes"]] if found else []
    good = len(values) == 1 and abs(values[0] - expected) <= 1e-9
    eigenvalues += [f"{name}: {values}, expected {expected}: {words}"] if not good else []
    messages += [f"{name}: lacks '{part}' in: {words}" for part in parts[:1] if part not in words]
SCENE.write_text(f"""kinetree: 1
gravity: [0, 0, -{G}]
bodies:
  - {{name: a, joint: {{type: prismatic, axis: z}}, mass: 2, shape: {{type: sphere, radius: 0.1}}}}
effects:
  - {{name: stop, type: joint_limit, joint: a, lower: 0, restitution: 0.5}}
simulate: {{duration: 1}}
""")
found, words = ask("modes")
messages += [words] if "'stop.lower' is closed in this state" not in words or found is None else []
claim("equilibrium_is_that_without_hard_parts", positions)
claim("modes_are_those_without_hard_parts", eigenvalues)
claim("messages_name_the_parts_and_what_they_do_in_the_state", messages)

# The scene that `equilibrium` writes has all its parts.
scene(STOP.replace("LOWER", "-30") + STICK)
ran = subprocess.run([KINETREE, "equilibrium", str(SCENE), "--scene", "-"], capture_output=True, text=True)
lacks = [word for word in ("restitution: 0", "stick: true", "coulomb: 0.5") if word not in ran.stdout]
claim("scene_of_the_equilibrium_keeps_the_hard_parts", [f"lacks {word}: {ran.stdout}{ran.stderr}" for word in lacks])
FOLDER.cleanup()
finish()
