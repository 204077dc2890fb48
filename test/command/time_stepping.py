"""time_stepping KINETREE: records, events and the summary of runs with `contact: steps`, against closed forms. They have one source of
accelerations and reactions.
"""
# SPDX-License-Identifier: Apache-2.0
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


PRESSED = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: block, joint: {type: prismatic, axis: z}, mass: 2, inertia: [1, 1, 1], markers: {m: [0, 0, 0]}}
effects:
  - {name: floor, type: joint_limit, joint: block, lower: 0, restitution: 0}
  - {name: press, type: motor, joint: block, force: "-20*t"}
states:
  peak: {rate: 0}
  still: {rate: 0, initial: 7}
events:
  - {name: overload, when: reaction.floor.lower.multiplier > 30, then: record}
  - {name: sample, when: t > 1.5, then: {set: {peak: reaction.floor.lower.multiplier, still: acceleration.block + marker.block.m.az}}}
  - {name: jerk, when: acceleration.block < -20, then: record}
simulate: {duration: 2, contact: steps, step: 1e-3}
output: {interval: 0.25, record: [position, acceleration, reaction, state]}
"""


def pressed():
    """A floor bears N = m g + 20 t. Nothing moves."""
    rows, summary, _ = run(PRESSED)
    yield from off("overloads", len(times_of(summary, "overload")), 1, 0)
    for time in times_of(summary, "overload"):
        yield from off("overload, s", time, (30 - 2 * G) / 20, 1.001 * STEP)
    yield from off("jerks", len(times_of(summary, "jerk")), 0, 0)
    yield from off("records", len(rows), 9 + 1 + 2, 0)
    if "acceleration" in summary:
        yield from off("peak", rows[-1]["state.peak"], 2 * G + 20 * 1.5, 20 * STEP)
        yield from off("still", rows[-1]["state.still"], 0, 20 * STEP)
        yield from off("the acceleration of the summary", summary["acceleration"]["block"], rows[-1]["acceleration.block"], 1e-12)


def struck():
    """A force of 1000 N jumps within a step, which the floor bears."""
    for force in ("-1000*(t>1)", "-1000*(t>1.0003)", "-1000*(t>1.0008)"):
        scene = PRESSED.replace('"-20*t"', f'"{force}"').replace("  - {name: sample", "  - {name: pull, when: acceleration.block > 1, then: record}\n  - {name: sample")
        rows, summary, _ = run(scene)
        yield from off("overloads", len(times_of(summary, "overload")), 1, 0)
        for time in times_of(summary, "overload"):
            yield from off("overload, s", time, 1, 2.001 * STEP)
        yield from off("jerks", len(times_of(summary, "jerk")) + len(times_of(summary, "pull")), 0, 0)
        yield from off("peak", rows[-1]["state.peak"] if rows else math.nan, 2 * G + 1000, 1e-9)


DROPPED = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: {type: prismatic, axis: z, position: 1}, mass: 2, inertia: [1, 1, 1], markers: {m: [0, 0, 0]}}
effects:
  - {name: floor, type: contact, point: ball.m, plane: world, restitution: 0.5}
events:
  - {name: hit, when: reaction.floor.fz > 500, then: record}
  - {name: spike, when: acceleration.ball > 500, then: record}
  - {name: low, when: position.ball < 0.5, then: record}
simulate: {duration: 1.1, contact: steps, step: 1e-3}
output: {interval: 0.1, record: [position, reaction]}
"""


def dropped():
    """Impulses over steps pass any limit at once. The event is at the end of the step of the impact, and no step is taken in vain."""
    rows, summary, _ = run(DROPPED)
    first = math.sqrt(2 / G)
    for name in ("hit", "spike"):
        times = times_of(summary, name)
        yield from off(f"{name}: number", len(times), 2, 0)
        for time, expected in zip(times, (first, 2 * first)):
            yield from off(f"{name}, s", time, expected, 2 * STEP)
    for time in times_of(summary, "low")[:1]:
        yield from off("low, s", time, math.sqrt(1 / G), 1e-6)
    yield from off("steps", summary.get("cost", {}).get("steps", 0), 1100, 10)


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


claim("events_have_the_reactions_and_accelerations_of_records", list(pressed()))
claim("a_force_that_jumps_is_borne_without_an_acceleration", list(struck()))
claim("an_impact_is_one_event_at_the_end_of_its_step", list(dropped()))
claim("friction_of_contacts_has_a_power", list(sliding()))
claim("friction_of_joints_keeps_its_viscous_part", list(braked()))
claim("drives_supply_work_against_contacts", list(carried()))
finish()
