"""time_stepping KINETREE: records, events and the summary of runs with `contact: steps`, against closed forms. They have one source of
accelerations and reactions.
"""
import csv
import io
import json
import math
import pathlib
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note

KINETREE = sys.argv[1]
G = 9.81
STEP = 1e-3


def run(scene):
    """The records of a scene as a list of {column: number}, its summary, and the messages."""
    with tempfile.TemporaryDirectory() as place:
        path = pathlib.Path(place)
        (path / "scene.yaml").write_text(scene)
        ran = subprocess.run([KINETREE, "run", "scene.yaml", "--out", "-", "--summary", "s.json", "--quiet"], cwd=path, capture_output=True, text=True)
        summary = json.loads((path / "s.json").read_text()) if ran.returncode == 0 else {"marks": []}
    if ran.returncode != 0:
        note(f"exit status {ran.returncode}: {ran.stderr}")
    rows = csv.DictReader(io.StringIO(ran.stdout))
    return [{k.split(" ")[0]: float(x) if x else math.nan for k, x in row.items()} for row in rows], summary, ran.stderr


def off(what, observed, expected, bound):
    """A list of one problem, or of none."""
    fine = abs(observed - expected) <= bound  # not of nan
    return [] if fine else [f"{what}: {observed:.17g}, expected {expected:.17g}, bound {bound:.3g}"]


def times_of(summary, name):
    return [mark["time"] for mark in summary["marks"] if mark["name"] == name]


SLIDING = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: block, joint: {type: planar, axis: y, velocity: [0, 3, 0]}, mass: 2, inertia: [0.01, 0.01, 0.01], markers: {c: [0, 0, 0]}}
effects:
  - {name: shoe, type: contact, point: block.c, plane: world, restitution: 0, friction: 0.2}
simulate: {duration: 2, contact: steps, step: 1e-3}
output: {interval: 0.25, record: [velocity, effect, balance]}
"""


def sliding():
    """Friction mu m g brakes with the power -mu m g v, and with none at rest."""
    rows, _, _ = run(SLIDING)
    yield from off("records", len(rows), 9, 0)
    for row in rows[1:]:
        v = max(3 - 0.2 * G * row["time"], 0.0)
        yield from off(f"t = {row['time']}: power", row["effect.shoe.power"], -0.2 * 2 * G * v, 1e-9)


BRAKED = """kinetree: 1
bodies:
  - {name: wheel, joint: {type: revolute, velocity: 3}, mass: 2, inertia: [1, 1, 1]}
effects:
  - {name: brake, type: joint_friction, joint: wheel, coulomb: 1, viscous: 0.5, stick: true}
simulate: {duration: 4, contact: steps, step: 1e-3}
output: {interval: 0.5, record: [position, velocity, energy, balance, effect]}
"""


def braked():
    """The torque of a brake with a viscous part, and the energy that it dissipates, of a wheel with v = 5 exp(-t/2) - 2."""
    rows, _, messages = run(BRAKED)
    yield from off("records", len(rows), 9, 0)
    for row in rows[1:]:
        v = max(5 * math.exp(-row["time"] / 2) - 2, 0.0)
        torque = -1 - 0.5 * v if v > 0 else 0.0
        yield from off(f"t = {row['time']}: torque", row["effect.brake.torque"], torque, STEP)
        yield from off(f"t = {row['time']}: dissipated", row["energy.dissipated"], 4.5 - 0.5 * v * v, 5 * STEP)
    if messages:
        yield messages


CARRIED = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: belt, joint: {type: prismatic, axis: x}, mass: 5, inertia: [1, 1, 1]}
  - {name: block, joint: {type: planar, axis: y}, mass: 2, inertia: [0.01, 0.01, 0.01], markers: {c: [0, 0, 0]}}
loops:
  - {name: drive, type: motion, joint: belt, position: "0.5*t"}
effects:
  - {name: shoe, type: contact, point: block.c, plane: belt, restitution: 0, friction: 0.4}
simulate: {duration: 1, contact: steps, step: 1e-3}
output: {interval: 0.1, record: [position, velocity, energy, balance, reaction]}
"""


def carried():
    """A belt supplies m v^2 to a block that it takes along. Nothing is reported about the step."""
    rows, _, messages = run(CARRIED)
    yield from off("supplied", rows[-1]["energy.supplied"] if rows else math.nan, 0.5, 1e-12)
    if messages:
        yield messages


claim("friction_of_contacts_has_a_power", list(sliding()))
claim("friction_of_joints_keeps_its_viscous_part", list(braked()))
claim("drives_supply_work_against_contacts", list(carried()))
finish()
