"""hard_forces KINETREE: the forces of hard contacts, hard stops and friction that sticks in records of effects, against closed forms, and
against Newton's law of random blocks that slide and stick on random slopes.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import io
import json
import math
import pathlib
import random
import subprocess
import sys
import tempfile

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from contact_scenes import Scene

KINETREE = sys.argv[1]
G = 9.81


def run(scene, *options):
    """The records of a scene as a list of {column: number}, and the messages."""
    with tempfile.TemporaryDirectory() as place:
        path = pathlib.Path(place) / "scene.yaml"
        path.write_text(scene)
        ran = subprocess.run([KINETREE, "run", str(path), "--out", "-", *options], capture_output=True, text=True)
    if ran.returncode != 0:
        note(f"exit status {ran.returncode}: {ran.stderr}")
    rows = csv.DictReader(io.StringIO(ran.stdout))
    return [{k.split(" ")[0]: float(x) if x else math.nan for k, x in row.items()} for row in rows], ran.stderr


def off(what, observed, expected, bound):
    """A list of one problem, or of none."""
    fine = abs(observed - expected) <= bound  # not of nan
    return [] if fine else [f"{what}: {observed:.17g}, expected {expected:.17g}, bound {bound:.3g}"]


REST = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: ball, joint: {type: prismatic, axis: z, position: 0.1}, mass: 10, shape: {type: sphere, radius: 0.1}}
  - {name: lift, joint: {type: prismatic, axis: z, at: [1, 0, 0], position: 0}, mass: 10, shape: {type: sphere, radius: 0.1}}
  - {name: slide, joint: {type: prismatic, axis: [1, 0, 1], at: [2, 0, 0]}, mass: 10, shape: {type: sphere, radius: 0.1}}
  - {name: arm, joint: {type: revolute, axis: z, at: [3, 0, 0], position: 0.5}, mass: 1, inertia: [1, 1, 1]}
effects:
  - {type: joint_limit, joint: arm, lower: -9, upper: 9, stiffness: 1}
  - {name: floor, type: contact, point: ball, radius: 0.1, plane: world, restitution: 0}
  - {name: stop, type: joint_limit, joint: lift, lower: 0, restitution: 0}
  - {type: joint_limit, joint: arm, lower: -1, upper: 0.5, restitution: 0}
  - {name: rub, type: joint_friction, joint: slide, coulomb: 100, stick: true}
  - {name: drive, type: motor, joint: arm, torque: 3}
simulate: {duration: 0.1}
output: {interval: 0.05, record: [effect], columns: {twice: 2*effect.floor.normal}}
"""


def at_rest():
    """A weight on a floor and on a stop, a block that sticks on a slope, a torque against an upper stop without a name."""
    wanted = {"effect.floor.normal": 10 * G, "effect.floor.fz": 10 * G, "effect.floor.fx": 0, "effect.floor.power": 0, "effect.stop.force": 10 * G,
              "effect.rub.force": 10 * G / math.sqrt(2), "effect[3].torque": -3, "effect[0].torque": 0, "twice": 20 * G}
    rows, _ = run(REST, "--quiet")
    yield from off("records", len(rows), 3, 0)
    for row in rows:
        for name, value in wanted.items():
            yield from off(name, row[name], value, 1e-11)


PUSHED = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: cart, joint: {type: prismatic, axis: x, velocity: 2}, mass: 1, inertia: [1, 1, 1]}
  - {name: ball, parent: cart, joint: {type: prismatic, axis: z, position: 0.1}, mass: 3, shape: {type: sphere, radius: 0.1}}
effects:
  - {name: floor, type: contact, point: ball, radius: 0.1, plane: world, restitution: 0, friction: 0.4}
  - {name: push, type: motor, joint: cart, torque: 5}
simulate: {duration: 2, integrator: dop853, tolerance: 1e-12}
output: {interval: 0.25, record: [velocity, effect]}
"""


def sliding():
    """Friction mu m g of a block that slides, and its power; then it sticks, and friction is the push."""
    rows, _ = run(PUSHED, "--quiet")
    deceleration = (0.4 * 3 * G - 5) / 4
    yield from off("records", len(rows), 9, 0)
    for row in rows:
        v = max(2 - deceleration * row["time"], 0.0)
        friction = 0.4 * 3 * G if v > 0 else 5.0
        wanted = {"normal": 3 * G, "friction": friction, "fx": -friction, "fy": 0, "fz": 3 * G, "power": -friction * v, "slip": v}
        for name, value in wanted.items():
            yield from off(f"t = {row['time']}: {name}", row["effect.floor." + name], value, 1e-9)


def random_block(seed):
    """A block of four feet that starts at rest on a slope; returns the scene, gravity and mass. The normal is along any axis, and not of
    length 1. The first contact is elastic and far away; two feet have no name."""
    r = random.Random(seed)
    k, sign, radius, mass, friction = r.randrange(3), r.choice([-1, 1]), r.choice([0.0, 0.02]), r.uniform(1, 5), r.uniform(0.2, 0.9)
    tilt, turn = r.uniform(0, 0.9), r.uniform(0, 6)

    def place(x, y, z):
        """Along two tangents and the normal."""
        at = [0.0, 0.0, 0.0]
        at[k], at[k - 2], at[k - 1] = sign * z, x, y
        return at

    gravity = place(G * math.sin(tilt) * math.cos(turn), G * math.sin(tilt) * math.sin(turn), -G * math.cos(tilt))
    feet = [place(x, y, radius - 0.05) for x in (-0.2, 0.2) for y in (-0.3, 0.3)]
    contact = f"type: contact, plane: world, axis: {place(0, 0, r.uniform(0.5, 2))}, radius: {radius}"
    hard = f"{contact}, restitution: 0, friction: {friction!r}"
    scene = f"""kinetree: 1
gravity: {gravity}
bodies:
  - name: block
    joint: {{type: free, at: {place(0, 0, 0.05)}}}
    mass: {mass!r}
    inertia: [0.1, 0.1, 0.1]
    markers: {{c: [0, 0, 0], high: {place(0, 0, 5)}, a: {feet[0]}, b: {feet[1]}, d: {feet[2]}, e: {feet[3]}}}
effects:
  - {{{contact}, point: block.high, stiffness: 1000}}
  - {{{hard}, point: block.a}}
  - {{{hard}, point: block.b, name: b}}
  - {{{hard}, point: block.d}}
  - {{{hard}, point: block.e, name: e}}
simulate: {{duration: 0.5, integrator: dop853, tolerance: 1e-11}}
output: {{interval: 0.05, record: [marker acceleration, energy, effect], markers: [block.c]}}
"""
    return scene, gravity, mass, math.tan(tilt) > friction


def newton(seed):
    """The forces of the feet are m (a - g), and the integral of their power, linear in time, is the change of the energy."""
    scene, gravity, mass, slides = random_block(seed)
    rows, _ = run(scene, "--quiet")
    names = ["effect[1]", "effect.b", "effect[3]", "effect.e"]
    yield from off(f"seed {seed}: records", len(rows), 11, 0)
    rows = rows[1:]  # slip begins at the first one
    energy = rows[0]["energy.total"] if rows else 0
    for before, row in zip([rows[0], *rows], rows):
        where = f"seed {seed} ({'slides' if slides else 'sticks'}), t = {row['time']}"
        for k, x in enumerate("xyz"):
            force = sum(row[f"{name}.f{x}"] for name in names)
            yield from off(f"{where}: f{x}", force, mass * (row[f"marker.block.c.a{x}"] - gravity[k]), 1e-8)
        yield from off(f"{where}: elastic", row["effect[0].normal"], 0, 0)
        energy += 0.5 * (row["time"] - before["time"]) * sum(before[name + ".power"] + row[name + ".power"] for name in names)
        yield from off(f"{where}: energy", energy, row["energy.total"], 1e-7)


def beginning():
    """Slip that has just begun has the direction of the motion that follows: forces continue, without gaps or a warning."""
    scene = next(scene for scene, _, _, slides in map(random_block, range(100)) if slides)
    rows, said = run(scene)
    yield from off("warnings", said.count("the direction of friction is unknown"), 0, 0)
    for column in ("fx", "fy", "fz", "friction"):
        yield from off(column, rows[0][f"effect[1].{column}"], rows[1][f"effect[1].{column}"], 1e-6)


FLAT = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - name: box
    mass: 2
    shape: {type: box, size: [0.4, 0.3, 0.2]}
    joint: {type: free, position: {position: [0, 0, 0.1]}, velocity: {linear: [0.5, 0, 0]}}
    markers: {a: [0.2, 0.15, -0.1], b: [-0.2, 0.15, -0.1], c: [-0.2, -0.15, -0.1], d: [0.2, -0.15, -0.1]}
effects:
  - {name: a, type: contact, point: box.a, plane: world, restitution: 0.3, friction: 0.5}
  - {name: b, type: contact, point: box.b, plane: world, restitution: 0.3, friction: 0.5}
  - {name: c, type: contact, point: box.c, plane: world, restitution: 0.3, friction: 0.5}
  - {name: d, type: contact, point: box.d, plane: world, restitution: 0.3, friction: 0.5}
simulate: {duration: 10}
"""


def marks():
    """A box slides on four corners until v/(mu g). At rest a corner that carries nothing arrives and parts within rounding, without a mark."""
    with tempfile.TemporaryDirectory() as place:
        path = pathlib.Path(place) / "flat.yaml"
        path.write_text(FLAT)
        ran = subprocess.run([KINETREE, "run", str(path), "--out", "/dev/null", "--summary", "-"], capture_output=True, text=True)
    summary = json.loads(ran.stdout)
    times = [mark["time"] for mark in summary["marks"]]
    changes = sum(summary["contacts"][name] for name in ("impacts", "closings", "openings", "sticks", "slips"))
    note(f"{len(set(times))} instants with marks, {changes} impacts and transitions")
    yield from off("the box sticks", times[0] if times else math.nan, 0.5 / (0.5 * G), 1e-9)
    if len(set(times)) > changes:
        yield "more instants with marks than impacts and transitions"


TOP = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - name: top
    joint: {type: free, position: {position: [0, 0, 0.02], orientation: {axis: [1, 0, 0], angle: 10 deg}}, velocity: {angular: [0, 0, 150]}}
    mass: 0.02
    com: [0, 0, -0.004]
    inertia: [3e-6, 3e-6, 3.2e-6]
    shape: {type: sphere, radius: 0.02}
    markers: {c: [0, 0, 0]}
effects:
  - {name: floor, type: contact, point: top.c, radius: 0.02, plane: world, restitution: 0, friction: 0.2}
simulate: {duration: 3, tolerance: 1e-9}
output: {interval: 0.01, record: [velocity, effect]}
"""


def rests():
    """A rising top comes to rest on its floor without an event. Its mark lies between the last record that slips and the first one that sticks."""
    with tempfile.TemporaryDirectory() as place:
        path = pathlib.Path(place) / "top.yaml"
        path.write_text(TOP)
        ran = subprocess.run([KINETREE, "run", str(path), "--out", str(path.with_suffix(".csv")), "--summary", "-"], capture_output=True, text=True)
        with open(path.with_suffix(".csv"), newline="") as file:
            rows = list(csv.DictReader(file))
    summary = json.loads(ran.stdout)
    counts, marks = summary["contacts"], summary["marks"]
    note(f"{counts}, {marks}")
    if counts["rested"] < 1 or counts["sticks"] + counts["slips"] != 1 or [mark["name"] for mark in marks] != ["floor.stick"]:
        yield f"{counts}, {marks}"
        return
    slip = next(name for name in rows[0] if name.startswith("effect.floor.slip"))
    sticks = next(float(row["time"]) for row in rows if float(row[slip]) < 1e-9)
    if not sticks - 0.01 <= marks[0]["time"] <= sticks:
        yield f"a mark at {marks[0]['time']} s, and the first record that sticks at {sticks} s"


ROD = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: rod, joint: {type: free, position: {position: [0, 0, 0.4917790927085965], orientation: {rpy: [0, 1.3, 0]}},
     velocity: {linear: [1, -2, 0.26749882862458735], angular: [-3, 2, 1]}}, mass: 2, inertia: [0.01, 0.17, 0.17],
     markers: {head: [0.5, 0, 0], foot: [-0.5, 0, 0]}}
effects:
  - {name: head, type: contact, point: rod.head, radius: 0.01, plane: world, restitution: 0, friction: 1.5}
  - {name: foot, type: contact, point: rod.foot, radius: 0.01, plane: world, restitution: 0, friction: 1.5}
simulate: {duration: 0.5, SIMULATE}
output: {interval: 0.005, record: [effect]}
"""


def excess():
    """Fixed steps of 1 ms do not resolve the end of slip of these bodies. Friction is held, so that three steps begin beyond a cone. The warning
    and the summary have the excess of the best share, and the next record has no less. Adaptive steps need no such force."""
    for simulate in ({"integrator": "rk4", "step": 0.001}, {"tolerance": 1e-9}):
        scene = Scene(700177, False, False).document(0.2)
        scene["simulate"] |= simulate
        scene["output"]["interval"] = 0.00025
        with tempfile.TemporaryDirectory() as place:
            path = pathlib.Path(place) / "feet.json"
            rows, stderr = run(json.dumps(scene), "--summary", str(path))
            summary = json.loads(path.read_text())
        held, warned = summary["contacts"].get("excess"), [w for w in summary["warnings"] if w["code"] == "contact_excess"]
        note(f"{simulate}: {held}")
        if "step" not in simulate:
            yield from [f"{simulate}: {stderr}"] if held or warned else []
            continue
        row = next((row for row in rows if held and held["time"] <= row["time"] <= held["time"] + 0.001), None)
        if row is None:
            yield f"no step begins beyond a cone: {held}, {stderr}"
            continue
        friction = next(effect["friction"] for effect in scene["effects"] if effect["name"] == "c4")
        recorded = row["effect.c4.friction"] / (friction * row["effect.c4.normal"]) - 1
        note(f"excess of the record {recorded}, at least {held['most']}")
        told = len(warned) == 1 and warned[0]["value"] == held["most"] > 0.1 and f"3 steps began with a force beyond it, most at 'c4' at t = {held['time']:.9g} s" in stderr
        yield from [] if told and held["contact"] == "c4" and held["steps"] == 3 and recorded >= held["most"] else [f"{held}, {stderr}"]


def jammed():
    """A rod of length 2 a at the angle b that slides on its head jams if mu a^2 sin b cos b / J > 1 / m + (a cos b)^2 / J: mu > 1.6."""
    for friction in (1.5, 2.5):
        scene = ROD.replace("linear: [1, -2, 0.26749882862458735], angular: [-3, 2, 1]", "linear: [3, 0, 0]").replace("friction: 1.5", f"friction: {friction}")
        _, stderr = run(scene.replace("SIMULATE", "tolerance: 1e-9"))
        yield from [] if ("at 1 instant no acceleration obeyed Coulomb's law" in stderr) == (friction > 1.6) else [stderr]


STACK = """kinetree: 1
gravity: [3.727050196568129, 0, -9.81]
bodies:
  - {name: low, joint: {type: planar, axis: y, position: [0.17, 0, 0]}, mass: 1.3, inertia: [0.17, 0.17, 0.17],
     markers: {a: [-0.6, 0, -0.17], b: [0.6, 0, -0.17]}}
  - {name: top, joint: {type: planar, axis: y, position: [0.51, 0, 0]}, mass: 0.33, inertia: [0.015, 0.015, 0.015],
     markers: {a: [-0.33, 0, -0.17], b: [0.33, 0, -0.17]}}
effects:
  - {name: low_a, type: contact, point: low.a, plane: world, restitution: 0, friction: MU}
  - {name: low_b, type: contact, point: low.b, plane: world, restitution: 0, friction: MU}
  - {name: top_a, type: contact, point: top.a, plane: {body: low, at: [0, 0, 0.17]}, restitution: 0, friction: MU}
  - {name: top_b, type: contact, point: top.b, plane: {body: low, at: [0, 0, 0.17]}, restitution: 0, friction: MU}
simulate: {duration: 0.3, STEPS}
output: {interval: 0.015, record: [effect, acceleration]}
"""


def at_the_limit():
    """Two blocks slide down a slope as one, with equal coefficients, so that friction between them is at its limit: mu N under each foot."""
    mu = 0.33668207613818346
    for steps in ("integrator: rk4, step: 1e-3", "integrator: heun, step: 5e-3", "integrator: dopri5, step: 1e-3", "tolerance: 1e-9"):
        rows, stderr = run(STACK.replace("MU", str(mu)).replace("STEPS", steps))
        yield from [f"{steps}: {stderr}"] if len(rows) != 21 or "no motion that obeys" in stderr else []
        beyond = max((row[f"effect.{c}.friction"] - mu * row[f"effect.{c}.normal"] for row in rows for c in ("low_a", "low_b", "top_a", "top_b")), default=math.nan)
        apart = max((abs(row["acceleration.top[1]"] - row["acceleration.low[1]"]) for row in rows), default=math.nan)
        note(f"{steps}: {beyond:.3g} N beyond a cone (bound 1e-6), accelerations {apart:.3g} m/s^2 apart (bound 1e-9)")
        yield from off(f"{steps}: friction beyond its cone", max(beyond, 0.0) if beyond == beyond else beyond, 0, 1e-6)
        yield from off(f"{steps}: accelerations of the blocks", apart, 0, 1e-9)


BOX = """kinetree: 1
gravity: [0, 0, -9.81]
bodies:
  - {name: box, joint: {type: free, position: {position: [4, 0, 0.23], orientation: {rpy: [0, 0, -1.58]}}, velocity: {angular: [0, 0, 0.48]}}, mass: 2,
     inertia: [0.1, 0.12, 0.15], markers: {a: [0.3, 0.2, -0.2], b: [0.3, -0.2, -0.2], c: [-0.3, 0.2, -0.2], d: [-0.3, -0.2, -0.2]}}
effects:
  - {name: a, type: contact, point: box.a, plane: world, restitution: 0.7, friction: 0.9, poisson: true}
  - {name: b, type: contact, point: box.b, plane: world, restitution: 0.7, friction: 0.3, poisson: true}
  - {name: c, type: contact, point: box.c, plane: world, restitution: 0.7, friction: 0.3, poisson: true}
  - {name: d, type: contact, point: box.d, plane: world, restitution: 0.7, friction: 0.6, poisson: true}
simulate: {duration: 0.1, tolerance: 1e-9}
output: {record: [velocity]}
"""


def returned():
    """A box falls flat on four corners with Poisson's rule. Compression leaves rates of rounding, and expansion returns 0.7 of its impulses."""
    rows, stderr = run(BOX)
    fall = math.sqrt(2 * 0.03 / G)
    speed = rows[-1]["velocity.box[2]"] if rows else math.nan
    yield from off(f"speed of the box {stderr}", speed, 0.7 * G * fall - G * (0.1 - fall), 1e-7)


claim("rest_is_held_by_the_weight", list(at_rest()))
claim("friction_of_a_block_that_slides_and_sticks", list(sliding()))
claim("random_blocks_obey_newton", [problem for seed in range(24) for problem in newton(seed)])
claim("slip_that_begins_has_the_direction_that_follows", list(beginning()))
claim("only_impacts_and_transitions_have_marks", list(marks()))
claim("contacts_that_come_to_rest_without_an_event_have_marks", list(rests()))
claim("friction_beyond_its_cone_is_told_with_its_number_and_place", list(excess()))
claim("impulses_without_a_collision_are_told", list(jammed()))
claim("friction_at_its_limit_obeys_its_cone_with_any_steps", list(at_the_limit()))
claim("expansion_returns_a_part_of_the_impulses_of_compression", list(returned()))
finish()
