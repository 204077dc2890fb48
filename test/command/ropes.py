#!/usr/bin/env python3
"""Belts of several pulleys, elastic belts, ropes that become slack, and grips between moving bodies: closed forms.

    ropes.py KINETREE
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note  # noqa: E402

KINETREE = sys.argv[1]
FOLDER = pathlib.Path(tempfile.mkdtemp())
PROBLEMS = []


def call(*words):
    return subprocess.run([KINETREE, *map(str, words)], capture_output=True, text=True, cwd=FOLDER)


def run(text, *more):
    (FOLDER / "scene.yaml").write_text("kinetree: 1\n" + text)
    done = call("run", "scene.yaml", "--out", "out.csv", *more)
    if done.returncode != 0:
        raise SystemExit(f"{done.stderr}\n{text}")
    with (FOLDER / "out.csv").open() as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


def near(what, found, wanted, bound=1e-9):
    error = abs(found - wanted) / max(1.0, abs(wanted))
    note(f"{what}: {found:.15g} against {wanted:.15g}, error {error:.2g}, bound {bound:g}")
    if not error <= bound:
        PROBLEMS.append(f"{what}: {found!r} is not {wanted!r}")


def wheel(name, radius, mass, place="", more=""):
    return (f"  - {{name: {name}, joint: {{type: revolute, axis: z{place}}}, mass: {mass}, "
            f"shape: {{type: cylinder, radius: {radius}, length: 0.02}}{more}}}\n")


# ---- belts of several pulleys ---------------------------------------------------------------------------------------

def direction(one, two, rho):
    """The direction of a span between centres, and its points on both pulleys; rho: positive radii are on the left."""
    d = numpy.subtract(two, one)
    a, s = math.hypot(*d), rho[0] - rho[1]
    along, left = d / a, numpy.array([-d[1], d[0]]) / a
    x = math.sqrt(1 - (s / a)**2) * along - s / a * left
    normal = numpy.array([-x[1], x[0]])
    return x, one + rho[0] * normal, two + rho[1] * normal


def serpentine():
    """Crank, alternator, and an idler on the arm of a tensioner. The belt keeps its length, so that the arm rests.

    Unknown are the acceleration of the belt and three tensions; the moments about three axles and about the pivot of the arm give them."""
    centres = {"crank": (0.0, 0.0), "alternator": (0.4, 0.1), "idler": (0.2, -0.02)}
    radius, mass = {"crank": 0.1, "alternator": 0.04, "idler": 0.03}, {"crank": 3, "alternator": 1, "idler": 0.2}
    spans = {"top": ("alternator", "crank", -0.04, -0.1), "left": ("crank", "idler", -0.1, 0.03), "right": ("idler", "alternator", 0.03, -0.04)}
    text = "gravity: [0, 0, 0]\nbodies:\n" + wheel("crank", 0.1, 3) + wheel("alternator", 0.04, 1, ", at: [0.4, 0.1, 0]")
    text += "  - {name: arm, joint: {type: revolute, axis: z, at: [0.2, -0.1, 0], position: 90 deg}, mass: 0.3, inertia: [1e-3, 1e-3, 1e-3]}\n"
    text += wheel("idler", 0.03, 0.2, ", at: [0.08, 0, 0]", ", parent: arm") + "loops:\n"
    for name, (one, two, r1, r2) in spans.items():
        text += f"  - {{name: {name}, type: span, between: [{one}, {two}], radius: {r1}, radius2: {r2}}}\n"
    text += ("effects:\n  - {name: drive, type: motor, joint: crank, torque: 5}\n  - {name: load, type: joint_damper, joint: alternator, damping: 0.02}\n"
             "  - {name: tensioner, type: joint_spring, joint: arm, stiffness: 200, rest: 100 deg}\n"
             "simulate: {duration: 0.5, integrator: dop853, tolerance: 1e-12}\n"
             "output: {interval: 0.1, record: [position, velocity, acceleration, reaction]}\n")
    drawn = {name: direction(numpy.array(centres[one]), numpy.array(centres[two]), (r1, r2)) for name, (one, two, r1, r2) in spans.items()}
    sense = {"crank": 1, "alternator": 1, "idler": -1}  # of the turn that the belt gives, for one of the crank
    for row in run(text):
        a, b = numpy.zeros((4, 4)), numpy.zeros(4)
        names = list(spans)
        for i, body in enumerate(("crank", "alternator", "idler")):
            a[i, 3] = 0.5 * mass[body] * radius[body]**2 * sense[body] / radius[body]
            for k, name in enumerate(names):
                x, *points = drawn[name]
                for end, at in enumerate(points):
                    if spans[name][end] == body:
                        arm, pull = at - numpy.array(centres[body]), (x if end == 0 else -x)
                        a[i, k] -= arm[0] * pull[1] - arm[1] * pull[0]
            b[i] = {"crank": 5.0, "alternator": -0.02 * row["velocity.alternator"], "idler": 0.0}[body]
        for k, name in enumerate(names):  # the idler's axle carries its spans, and its bearing has no moment
            x, *points = drawn[name]
            for end in (0, 1):
                if spans[name][end] == "idler":
                    arm, pull = numpy.array(centres["idler"]) - (0.2, -0.1), (x if end == 0 else -x)
                    a[3, k] = arm[0] * pull[1] - arm[1] * pull[0]
        b[3] = -200 * math.radians(10)
        *tension, belt = numpy.linalg.solve(a, b)
        near("the arm rests", row["position.arm"], math.pi / 2)
        for body in sense:
            near(f"acceleration of {body}", row[f"acceleration.{body}"], sense[body] * belt / radius[body])
        for axis in (0, 1):
            for body in ("crank", "alternator"):
                load = sum(t * (drawn[n][0] if spans[n][0] == body else -drawn[n][0] if spans[n][1] == body else numpy.zeros(2))[axis]
                           for n, t in zip(names, tension))
                near(f"bearing of {body}, f{'xy'[axis]}", row[f"reaction.{body}.f{'xy'[axis]}"], -load)
    return PROBLEMS


# ---- elastic belts --------------------------------------------------------------------------------------------------

ELASTIC = """gravity: [0, 0, 0]
bodies:
%s%sloops:
  - {name: upper, type: span, between: [a, b], radius: 0.05, radius2: 0.15, switched: never}
  - {name: lower, type: span, between: [a, b], radius: -0.05, radius2: -0.15, switched: never}
effects:
  - {name: u, type: joint_spring, joint: upper, stiffness: %r, rest: %r}
  - {name: l, type: joint_spring, joint: lower, stiffness: %r, rest: %r}
simulate: {duration: 0.4, integrator: %s, tolerance: 1e-12}
output: {interval: 0.05, record: [position, velocity, reaction]}
"""


def elastic():
    """Both spans have k = E A / L and the pretension T: the slip s = r1 q1 - r2 q2 swings at w^2 = 2 k (r1^2 / I1 + r2^2 / I2)."""
    r1, r2, m1, m2, apart, pretension = 0.05, 0.15, 1.0, 4.0, 0.5, 200.0
    k = 4e4 / math.sqrt(apart**2 - (r2 - r1)**2)
    one, two = 0.5 * m1 * r1**2, 0.5 * m2 * r2**2
    w = math.sqrt(2 * k * (r1**2 / one + r2**2 / two))
    sine = (r2 - r1) / apart
    for method, bound in (("dop853", 1e-9), ("radau5", 1e-7)):
        rows = run(ELASTIC % (wheel("a", r1, m1, ", velocity: 30"), wheel("b", r2, m2, f", at: [{apart}, 0, 0]"),
                              k, -pretension / k, k, -pretension / k, method))
        for row in rows:
            s = r1 * 30 / w * math.sin(w * row["time"])
            near(f"slip, {method}, t = {row['time']}", r1 * row["position.a"] - r2 * row["position.b"], s, bound)
            near("momentum", one * row["velocity.a"] / r1 + two * row["velocity.b"] / r2, one * 30 / r1, bound)
            near("bearing along the centres", row["reaction.b.fx"], 2 * pretension * math.sqrt(1 - sine**2), bound)
            near("bearing across", abs(row["reaction.b.fy"]), abs(2 * k * s * sine), bound * 10)
    done = call("modes", "scene.yaml", "--json")
    found = max(abs(complex(*value)) if isinstance(value, list) else abs(value) for value in frequencies(json.loads(done.stdout)))
    near("frequency of the linearised equations, rad/s", found, w, 1e-9)
    return PROBLEMS


def frequencies(result):
    """All numbers under keys that name angular frequencies or frequencies, in rad/s."""
    found = []
    for mode in result["modes"]:
        found.append(2 * math.pi * mode["frequency"] if mode.get("frequency") is not None else 0.0)
    return found


# ---- ropes that become slack ----------------------------------------------------------------------------------------

def slack():
    """A load is thrown up below a drum: it flies while the rope is slack, and pulls the drum along from t = 2 v / g on."""
    m, inertia, r, v, g = 2.0, 0.5 * 4 * 0.1**2, 0.1, 1.5, 9.81
    text = ("gravity: [0, 0, -9.81]\nbodies:\n"
            "  - {name: drum, joint: {type: revolute, axis: y}, mass: 4, inertia: [0.02, 0.02, 0.02]}\n"
            f"  - {{name: load, joint: {{type: prismatic, axis: z, at: [0.1, 0, -1], velocity: {v}}}, mass: {m}}}\n"
            "loops:\n  - {name: rope, type: span, between: [drum, load], axis: y, radius: -0.1, slack: true}\n"
            "simulate: {duration: 0.6, integrator: dop853, tolerance: 1e-12}\noutput: {interval: 0.05, record: [position, velocity, acceleration, reaction]}\n")
    meets = 2 * v / g
    after, a = -m * v / (m + inertia / r**2), -m * g / (m + inertia / r**2)
    for row in run(text):
        t = row["time"]
        if t < meets - 1e-6:
            near(f"height of flight, t = {t}", row["position.load"], v * t - 0.5 * g * t * t)
            near("the drum rests", row["velocity.drum"], 0.0)
            near("the rope pulls nothing", row["reaction.drum.fz"], 4 * g)
        elif t > meets + 1e-6:
            near(f"velocity behind the jerk, t = {t}", row["velocity.load"], after + a * (t - meets))
            near("the drum turns along", abs(row["velocity.drum"]) * r, -(after + a * (t - meets)))
            near("the bearing carries the rope", row["reaction.drum.fz"], 4 * g + m * (g + a))
    return PROBLEMS


def elastic_slack():
    """An elastic rope that only pulls: a stop of its stretch. The load swings on the rope, and flies while it is slack."""
    m, v, g, k = 2.0, 1.5, 9.81, 5000.0
    text = ("gravity: [0, 0, -9.81]\nbodies:\n"
            "  - {name: drum, joint: {type: revolute, axis: y}, mass: 4, inertia: [0.02, 0.02, 0.02]}\n"
            f"  - {{name: load, joint: {{type: prismatic, axis: z, at: [0.1, 0, -1], velocity: {v}}}, mass: {m}}}\n"
            "loops:\n  - {name: rope, type: span, between: [drum, load], axis: y, radius: -0.1, switched: never}\n"
            "  - {name: brake, type: motion, joint: drum, position: 0}\n"
            f"effects:\n  - {{name: pull, type: joint_limit, joint: rope, upper: 0, stiffness: {k}}}\n"
            "simulate: {duration: 0.6, integrator: dop853, tolerance: 1e-12}\noutput: {interval: 0.02, record: [position, velocity, reaction]}\n")
    meets, w = 2 * v / g, math.sqrt(k / m)
    depth, phase = m * g / k, math.atan2(m * g / k, v / w)
    taut = (math.pi + 2 * phase) / w  # down and back to the length without force
    for row in run(text):
        t = row["time"]
        if t < meets:
            height = v * t - 0.5 * g * t * t
        elif t < meets + taut:
            height = -depth - (v / w * math.sin(w * (t - meets)) - depth * math.cos(w * (t - meets)))
        else:
            u = t - meets - taut
            height = v * u - 0.5 * g * u * u
        near(f"height, t = {t}", row["position.load"], height, 1e-9)
        near("the bearing carries the rope", row["reaction.drum.fz"], 4 * g + k * max(0.0, -height), 1e-7)
    return PROBLEMS


def never():
    body = "bodies: [{name: a, joint: {type: revolute}, mass: 1, inertia: [1, 1, 1]}, {name: b, joint: {type: free}, mass: 1, inertia: [1, 1, 1]}]\n"
    for text, wanted in ((body + "loops: [{name: w, type: weld, between: [a, b], switched: never}]\n", "only measures coordinates"),
                         (body + "effects: [{type: joint_spring, joint: a, stiffness: 1, switched: never}]\n", "has no effect"),
                         (body + "loops: [{name: s, type: span, between: [a, {body: b, at: [1, 0, 0]}], radius: 0.1, slack: true, tension: 5}]\n", "no tension at rest")):
        (FOLDER / "scene.yaml").write_text("kinetree: 1\n" + text)
        done = call("run", "scene.yaml", "--out", "out.csv")
        note(done.stderr.strip().splitlines()[0])
        if done.returncode == 0 or wanted not in done.stderr:
            PROBLEMS.append(f"{wanted!r} is not in {done.stderr!r}")
    return PROBLEMS


# ---- grips ----------------------------------------------------------------------------------------------------------

def turned(row, body):
    """The rotation matrix of a body from its quaternion."""
    w, x, y, z = (row[f"orientation.{body}.{c}"] for c in "wxyz")
    return numpy.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                        [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                        [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


GRAB = """gravity: [0, 0, %s]
bodies:
  - {name: hand, joint: %s, mass: 2, inertia: [0.02, 0.03, 0.04], markers: {palm: [0.1, 0.02, 0.05]}}
  - {name: box, joint: %s, mass: 1, inertia: [0.01, 0.012, 0.015], markers: {centre: [0, 0, 0]}}
loops:
  - {name: grip, type: weld, between: [hand.palm, box], switched: off}
events:
  - {name: grabs, when: t - 0.2, then: {engage_here: grip}}
simulate: {duration: 0.6, integrator: dop853, tolerance: 1e-11}
output: {interval: 0.05, record: [position, velocity, state, momentum, orientation], markers: [hand.palm, box.centre]}
"""


def grips():
    space = ("{type: free, position: {position: [0.3, -0.2, 0.5]}, velocity: {linear: [0.7, 0.4, 0.2], angular: [0.5, -0.3, 1.1]}}",
             "{type: free, position: {position: [0.1, 0.2, 0.4]}, velocity: {linear: [-0.3, 0.1, 0.3], angular: [-0.4, 0.8, 0.2]}}")
    plane = ("{type: planar, axis: y, position: [0.3, 0.5, 0.2], velocity: [0.7, 0.2, 1.3]}",
             "{type: planar, axis: y, position: [0.1, 0.3, 1.2], velocity: [-0.1, 0.4, -0.7]}")
    for kind, (hand, box) in (("in space", space), ("in a plane", plane)):
        rows = run(GRAB % (0, hand, box))
        names = [key for key in rows[0] if key.startswith("momentum.")]
        before, first = rows[0], None
        for row in rows:
            for key in names:
                near(f"{key}, {kind}, t = {row['time']}", row[key], before[key], 1e-10)
            if row["time"] < 0.2 + 1e-9:
                continue
            place = [row[f"state.grip_{c}"] for c in ("x", "y", "z", "rx", "ry", "rz")]
            first = place if first is None and any(place) else first
            for k, number in enumerate(first or []):
                near(f"place {k}, {kind}", place[k], number, 0.0)
            apart = numpy.array([row[f"marker.hand.palm.{c}"] - row[f"marker.box.centre.{c}"] for c in "xyz"])
            for k, number in enumerate(turned(row, "box").T @ apart if first else []):
                near(f"palm in the frame of the box, {'xyz'[k]}, {kind}", number, first[k], 1e-10)
        if first is None or math.hypot(*first[:3]) < 0.05:
            PROBLEMS.append(f"the grip did not move: {first}")
    return PROBLEMS


CLAIMS = {serpentine: "bearings_carry_the_spans_of_a_belt_of_three_pulleys", elastic: "an_elastic_belt_swings_about_its_pretension",
          slack: "a_rope_over_a_drum_becomes_slack_and_taut", elastic_slack: "an_elastic_rope_only_pulls",
          never: "wrong_spans_are_reported", grips: "a_grip_holds_where_it_was_closed"}
for test, name in CLAIMS.items():
    PROBLEMS.clear()
    claim(name, list(test()))
finish()
