#!/usr/bin/env python3
"""Gears, racks, worms, belts and ropes: accelerations and the loads of bearings, against closed forms and against absolute coordinates.

    wheels.py KINETREE PAGE      PAGE: include/pages/gears-and-ropes.md, whose scenes are run, too

The random trains are computed once more here, without the library: every wheel and carrier is a free body in the plane, bearings are
pins, and each mesh or span is one force along its line of action. The unknowns are all accelerations and all forces at once,
    M a = f + sum of J_i' lambda_i,   J a = drift,
where J is written from the forces, and the drift from differences of J along the motion. A sign of the teeth's radial force is that
which drives the wheels apart.
"""
# SPDX-License-Identifier: Apache-2.0
import csv
import math
import pathlib
import re
import subprocess
import sys
import tempfile

import numpy

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note  # noqa: E402

KINETREE = sys.argv[1]
FOLDER = pathlib.Path(tempfile.mkdtemp())


def run(text, *more):
    """The records of a scene: a list of mappings of columns to numbers."""
    scene, table = FOLDER / "scene.yaml", FOLDER / "scene.csv"
    scene.write_text("kinetree: 1\n" + text + "output: {interval: 0.25, record: [position, velocity, acceleration, reaction, constraint]}\n")
    done = subprocess.run([KINETREE, "run", scene, "--out", table, *more], capture_output=True, text=True)
    if done.returncode != 0:
        raise SystemExit(f"{done.stderr}\n{text}")
    with table.open() as file:
        return [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]


PROBLEMS = []


def holds(what, error, bound):
    note(f"{what}: {error:.2g}, bound {bound:g}")
    if not error <= bound:
        PROBLEMS.append(f"{what}: {error:.3g} is beyond {bound:g}")


def near(what, found, wanted, bound=1e-9):
    holds(f"{what}, {found:.12g} against {wanted:.12g}", abs(found - wanted) / max(1.0, abs(wanted)), bound)


def wheel(name, radius, mass, place="", more="", axis="z"):
    return (f"  - {{name: {name}, joint: {{type: revolute, axis: {axis}{place}}}, mass: {mass}, "
            f"shape: {{type: cylinder, radius: {radius}, length: 0.02, axis: {axis}}}{more}}}\n")


# ---- closed forms ---------------------------------------------------------------------------------------------------

def spur():
    for torque in (2.0, -2.0):  # either flank carries
        row = run("gravity: [0, 0, 0]\nbodies:\n" + wheel("a", 0.05, 1) + wheel("b", 0.15, 9, ", at: [0.2, 0, 0]")
                  + "loops:\n  - {name: m, type: gear, between: [a, b], teeth: 20, teeth2: 60, helix_angle: 15 deg}\n"
                  + f"effects:\n  - {{name: d, type: motor, joint: a, torque: {torque}}}\nsimulate: {{duration: 0.5}}\n")[-1]
        alpha = torque / (0.5 * 1 * 0.05**2 + 0.5 * 9 * 0.15**2 / 9)
        force = 0.5 * 9 * 0.15**2 * alpha / 3 / 0.15
        near("acceleration of a pinion", row["acceleration.a"], alpha)
        near("tangential force", row["reaction.m.fy"], force)
        near("radial force", row["reaction.m.fx"], abs(force) * math.tan(math.radians(20)) / math.cos(math.radians(15)))
        near("axial force", row["reaction.m.fz"], -force * math.tan(math.radians(15)))
        for axis in "xyz":
            near(f"bearing of the pinion, f{axis}", row[f"reaction.a.f{axis}"], row[f"reaction.m.f{axis}"])
            near(f"bearing of the wheel, f{axis}", row[f"reaction.b.f{axis}"], -row[f"reaction.m.f{axis}"])
        near("tilting moment of the bearing", row["reaction.a.my"], -0.05 * row["reaction.m.fz"])


def planetary():
    """Willis: sun 30, ring 70, planets 20; three planets share the load, and the carrier carries it on its pins."""
    text = "gravity: [0, 0, 0]\nbodies:\n" + wheel("sun", 0.03, 1)
    text += "  - {name: carrier, joint: {type: revolute, axis: z}, mass: 0.5, inertia: [0.001, 0.001, 0.002]}\n"
    loops = "loops:\n"
    for k in range(3):
        x, y = 0.05 * math.cos(2 * math.pi * k / 3), 0.05 * math.sin(2 * math.pi * k / 3)
        text += wheel(f"p{k}", 0.02, 0.7, f", at: [{x!r}, {y!r}, 0]", ", parent: carrier")
        loops += f"  - {{name: s{k}, type: gear, between: [sun, p{k}], teeth: 30, teeth2: 20}}\n"
        loops += f"  - {{name: r{k}, type: gear, between: [world, p{k}], teeth: -70, teeth2: 20}}\n"
    row = run(text + loops + "effects:\n  - {name: d, type: motor, joint: sun, torque: 0.2}\nsimulate: {duration: 1.5, reduction: svd, "
              "integrator: dop853, tolerance: 1e-12}\n")[-1]
    ratio = 0.3
    planet = 0.3 - 1.5 * (1 - 0.3)  # speed of a planet for one of the sun: w_c - (z_s / z_p) (w_s - w_c)
    inertia = (0.5 * 1 * 0.03**2 + ratio**2 * (0.002 + 3 * 0.7 * 0.05**2) + 3 * planet**2 * 0.5 * 0.7 * 0.02**2)
    alpha = 0.2 / inertia
    near("speed of the carrier", row["velocity.carrier"] / row["velocity.sun"], ratio)
    near("acceleration of the sun", row["acceleration.sun"], alpha)
    force = (0.2 - 0.5 * 1 * 0.03**2 * alpha) / 0.03 / 3  # of each mesh at the sun
    for k in range(3):
        size = math.hypot(row[f"reaction.s{k}.fx"], row[f"reaction.s{k}.fy"])
        near(f"mesh at the sun {k}", size, force / math.cos(math.radians(20)))
    near("the forces at the sun are in balance", row["reaction.sun.fx"], 0.0)
    near("the forces at the sun are in balance", row["reaction.sun.fy"], 0.0)


def bevel():
    row = run("gravity: [0, 0, 0]\nbodies:\n" + wheel("a", 0.03, 1, "", ", markers: {c: [-0.02, 0, 0]}", "x")
              + wheel("b", 0.02, 0.3, "", ", markers: {c: [0, 0, 0.03]}")
              + "loops:\n  - {name: m, type: gear, between: [a.c, b.c], axis: x, axis2: z, teeth: 18, teeth2: 12}\n"
              + "effects:\n  - {name: d, type: motor, joint: a, torque: 0.6}\nsimulate: {duration: 0.5}\n")[-1]
    alpha = 0.6 / (0.5 * 1 * 0.03**2 + 2.25 * 0.5 * 0.3 * 0.02**2)
    near("acceleration", row["acceleration.a"], alpha)
    tangential = abs(1.5 * alpha * 0.5 * 0.3 * 0.02**2 / 0.02)
    cone = math.atan(0.03 / 0.02)  # pitch angle of a
    radial = tangential * math.tan(math.radians(20))
    near("tangential force", abs(row["reaction.m.fy"]), tangential)
    near("parting force on b along its own axis", row["reaction.m.fz"], radial * math.cos(cone))
    near("parting force on b along the axis of a", row["reaction.m.fx"], radial * math.sin(cone))


def rack():
    row = run("gravity: [0, 0, 0]\nbodies:\n" + wheel("a", 0.05, 1)
              + "  - {name: bar, joint: {type: prismatic, axis: x, at: [0.1, -0.05, 0]}, mass: 2, inertia: [1, 1, 1]}\n"
              + "loops:\n  - {name: m, type: rack, between: [a, bar], axis2: x, radius: 0.05}\n"
              + "effects:\n  - {name: d, type: motor, joint: a, torque: 2}\nsimulate: {duration: 3, integrator: dop853, tolerance: 1e-12}\n")[-1]
    a = 2 / 0.05 / (2 + 0.5)
    near("acceleration of the rack", row["acceleration.bar"], a)
    near("position after many turns", row["position.bar"], 0.05 * row["position.a"])
    near("force on the rack", row["reaction.m.fx"], 2 * a)
    near("force of the guide", row["reaction.bar.fy"], 2 * a * math.tan(math.radians(20)))
    near("bearing of the wheel", row["reaction.a.fx"], 2 * a)


def worm():
    for hand in (2, -2):
        row = run("gravity: [0, 0, 0]\nbodies:\n" + wheel("a", 0.02, 1, "", "", "x") + wheel("b", 0.08, 3, ", at: [0, 0, 0.1]", "", "y")
                  + f"loops:\n  - {{name: m, type: worm, between: [a, b], axis: x, axis2: y, radius: 0.02, teeth: {hand}, teeth2: 40}}\n"
                  + "effects:\n  - {name: d, type: motor, joint: a, torque: 0.5}\n  - {name: l, type: motor, joint: b, torque: 3}\n"
                  + "simulate: {duration: 3, integrator: dop853, tolerance: 1e-12}\n")[-1]
        ratio = row["velocity.b"] / row["velocity.a"]
        near("ratio", abs(ratio), 1 / 20)
        # a right-handed worm that turns about +x moves its threads along -x; the wheel above turns about +y if P goes along -x
        near("sense", math.copysign(1.0, ratio), math.copysign(1.0, hand))
        worm_inertia, wheel_inertia = 0.5 * 1 * 0.02**2, 0.5 * 3 * 0.08**2
        alpha = (0.5 + 3 * ratio) / (worm_inertia + wheel_inertia * ratio**2)
        near("acceleration", row["acceleration.a"], alpha)
        along = (wheel_inertia * ratio * alpha - 3) / 0.08  # on the wheel at P, which is below its centre: along -x for +y
        lead = 0.08 * 2 / (0.02 * 40)
        near("axial force of the worm", row["reaction.a.fx"], -along)
        near("tangential force", abs(row["reaction.a.fy"]), abs(along) * lead)
        near("parting force", row["reaction.m.fz"], abs(along) * math.tan(math.radians(20)) * math.hypot(1, lead))


def belt():
    for crossed in (False, True):
        row = run("gravity: [0, 0, 0]\nbodies:\n" + wheel("a", 0.05, 1) + wheel("b", 0.15, 4, ", at: [0.5, 0, 0]")
                  + "loops:\n  - {name: m, type: belt, between: [a, b], radius: 0.0512345678901, radius2: 0.15, tension: 200, "
                  + f"crossed: {str(crossed).lower()}}}\n"
                  + "effects:\n  - {name: d, type: motor, joint: a, torque: 2}\nsimulate: {duration: 4, integrator: dop853, tolerance: 1e-12}\n")[-1]
        r, R, sign = 0.0512345678901, 0.15, -1 if crossed else 1
        alpha = 2 / (0.5 * 1 * 0.05**2 + 0.5 * 4 * 0.15**2 * (r / R) ** 2)
        difference = 0.5 * 4 * 0.15**2 * alpha * r / R / R
        slope = math.asin((R - sign * r) / 0.5 if not crossed else (R + r) / 0.5)
        near("acceleration", row["acceleration.a"], alpha)
        near("ratio after many turns", row["position.b"] / row["position.a"], sign * r / R)
        near("bearing along the line of centres", row["reaction.b.fx"], 400 * math.cos(slope))
        near("bearing across", abs(row["reaction.b.fy"]), difference * math.sin(slope))


def hoist():
    """A load on a rope over a pulley to a drum; and a block and tackle: half of the load in either part."""
    row = run("gravity: [0, 0, -9.81]\nbodies:\n" + wheel("drum", 0.1, 4, "", "", "y") + wheel("pulley", 0.07, 1, ", at: [1.07, 0, 1]", "", "y")
              + "  - {name: load, joint: {type: prismatic, axis: z, at: [1.14, 0, -1]}, mass: 2, inertia: [1, 1, 1]}\n"
              + "loops:\n  - {name: up, type: span, between: [drum, pulley], axis: y, radius: -0.1, radius2: -0.07}\n"
              + "  - {name: down, type: span, between: [pulley, load], axis: y, radius: -0.07}\n"
              + "simulate: {duration: 2, integrator: dop853, tolerance: 1e-12}\n")[-1]
    a = 2 * 9.81 / (2 + 0.5 * 4 + 0.5)
    near("acceleration of a load", row["acceleration.load"], -a)
    near("rope at the load", row["reaction.down.fz"], 2 * (9.81 - a))
    near("rope at the drum", math.hypot(row["reaction.up.fx"], row["reaction.up.fz"]), 2 * a)
    near("bearing of the pulley, fx", row["reaction.pulley.fx"], -row["reaction.up.fx"])
    near("bearing of the pulley, fz", row["reaction.pulley.fz"], 1 * 9.81 + 2 * (9.81 - a) - row["reaction.up.fz"])
    row = run("gravity: [0, 0, -9.81]\nbodies:\n" + wheel("drum", 0.1, 4, "", "", "y")
              + "  - {name: block, joint: {type: prismatic, axis: z, at: [0.1, 0, -2]}, mass: 3, inertia: [1, 1, 1]}\n"
              + wheel("sheave", 0.1, 1e-9, ", at: [0.1, 0, 0]", ", parent: block", "y")
              + "loops:\n  - {name: a, type: span, between: [drum, sheave], axis: y, radius: 0.1, radius2: -0.1}\n"
              + "  - {name: b, type: span, between: [sheave, {body: world, at: [0.2, 0, 0]}], axis: y, radius: -0.1}\n"
              + "simulate: {duration: 1, integrator: dop853, tolerance: 1e-12}\n")[-1]
    force = lambda name: math.hypot(row[f"reaction.{name}.fx"], row[f"reaction.{name}.fz"])  # noqa: E731
    near("both parts of a rope around a sheave without mass", force("a"), force("b"), 1e-6)


def loop_bearings():
    """The wheel's bearing is a loop: its multipliers balance the parting force, too."""
    row = run("gravity: [0, 0, 0]\nbodies:\n" + wheel("a", 0.05, 1)
              + "  - {name: b, joint: {type: planar, axis: z, position: [0.2, 0, 0]}, mass: 9, shape: {type: cylinder, radius: 0.15, length: 0.02}}\n"
              + "loops:\n  - {name: pin, type: revolute, between: [{body: world, at: [0.2, 0, 0]}, b], axis: z}\n"
              + "  - {name: m, type: gear, between: [a, b], teeth: 20, teeth2: 60}\n"
              + "effects:\n  - {name: d, type: motor, joint: a, torque: 2}\nsimulate: {duration: 0.5}\n")[-1]
    near("force of the teeth", row["reaction.m.fy"], 36.0)
    near("bearing that is a loop, across", row["reaction.pin.fy"], -36.0)
    near("bearing that is a loop, along the line of centres", row["reaction.pin.fx"], -36 * math.tan(math.radians(20)))
    near("bearing that is a joint", row["reaction.a.fx"], 36 * math.tan(math.radians(20)))


# ---- random trains in absolute coordinates --------------------------------------------------------------------------

class Train:
    """Wheels on the ground or on carriers, chained by meshes and belts; state and scene."""

    def __init__(self, draw):
        self.draw, self.bodies, self.contacts, self.scene, self.loops = draw, [], [], "", ""
        self.place(None, numpy.zeros(2))

    def place(self, host, at):
        """A wheel on a body (None: the ground) at a place of it."""
        k, radius, mass = len(self.bodies), float(self.draw.uniform(0.03, 0.12)), float(self.draw.uniform(0.5, 3))
        self.bodies.append({"host": host, "at": at, "radius": radius, "mass": mass, "inertia": 0.5 * mass * radius**2, "load": 0.0})
        parent = "" if host is None else f", parent: b{host}"
        self.scene += wheel(f"b{k}", radius, repr(mass), f", at: [{at[0]!r}, {at[1]!r}, 0]".replace("np.float64(", "").replace(")", ""), parent)
        return k

    def carrier(self, coaxial):
        k, mass, inertia = len(self.bodies), float(self.draw.uniform(0.3, 1)), float(self.draw.uniform(1e-3, 5e-3))
        at = self.bodies[coaxial]["at"]
        self.bodies.append({"host": self.bodies[coaxial]["host"], "at": at, "radius": 0.0, "mass": mass, "inertia": inertia, "load": 0.0})
        parent = "" if self.bodies[coaxial]["host"] is None else f", parent: b{self.bodies[coaxial]['host']}"
        self.scene += (f"  - {{name: b{k}, joint: {{type: revolute, axis: z, at: [{float(at[0])!r}, {float(at[1])!r}, 0]}}, mass: {mass!r}, "
                       f"inertia: [{inertia!r}, {inertia!r}, {inertia!r}]{parent}}}\n")
        return k

    def grow(self):
        kind, draw = self.draw.integers(0, 5), self.draw
        first = int(draw.choice([k for k, b in enumerate(self.bodies) if b["radius"] > 0]))
        one, direction = self.bodies[first], draw.uniform(-math.pi, math.pi)
        e = numpy.array([math.cos(direction), math.sin(direction)])
        host, at = one["host"], one["at"]
        if kind == 3 and host is None:  # a planet on a carrier about the first wheel
            host, at = self.carrier(first), numpy.zeros(2)
        z = [int(draw.integers(12, 60)) for _ in range(2)]
        if kind == 4:
            return self.wrap(first, e)
        if kind == 1:  # a belt, open or crossed
            crossed, apart = bool(draw.integers(0, 2)), float(draw.uniform(0.3, 0.6))
            second = self.place(host, at + apart * e)
            r = [float(draw.uniform(0.03, 0.12)) for _ in range(2)]
            self.contacts.append(("belt", first, second, r[0], -r[1] if crossed else r[1]))
            self.loops += (f"  - {{name: c{len(self.contacts)}, type: belt, between: [b{first}, b{second}], radius: {r[0]!r}, "
                           f"radius2: {r[1]!r}, crossed: {str(crossed).lower()}, tension: 50}}\n")
            return
        apart = float(draw.uniform(0.08, 0.3))
        second = self.place(host, at + apart * e)
        if kind == 2:  # internal
            z[0] += z[1] + 10
            sizes = (apart * z[0] / (z[0] - z[1]), -apart * z[1] / (z[0] - z[1]))
            z[0] = -z[0]
        else:
            sizes = (apart * z[0] / (z[0] + z[1]), apart * z[1] / (z[0] + z[1]))
        by = draw.integers(0, 2)
        keys = f"teeth: {z[0]}, teeth2: {z[1]}"
        if by and kind != 2:  # any real ratio: joints count the turns
            part = float(draw.uniform(0.2, 0.8))
            sizes = (apart * part, apart * (1 - part))
            keys = f"radius: {sizes[0]!r}, radius2: {sizes[1]!r}"
        self.contacts.append(("gear", first, second, *sizes))
        self.loops += f"  - {{name: c{len(self.contacts)}, type: gear, between: [b{first}, b{second}], {keys}}}\n"

    def wrap(self, first, e):
        """A belt around three pulleys, one of them on an arm about the first, which the belt holds. Spans are the sides of the belt."""
        draw, one = self.draw, self.bodies[first]
        second = self.place(one["host"], one["at"] + float(draw.uniform(0.3, 0.6)) * e)
        turn = float(draw.choice((-1, 1)) * draw.uniform(math.pi / 3, 2 * math.pi / 3))
        arm = self.carrier(first)
        third = self.place(arm, float(draw.uniform(0.3, 0.5)) * numpy.array([e[0] * math.cos(turn) - e[1] * math.sin(turn),
                                                                             e[0] * math.sin(turn) + e[1] * math.cos(turn)]))
        radius = [float(draw.choice((-1, 1)) * draw.uniform(0.03, 0.1)) for _ in range(3)]
        for k, (start, end) in enumerate(((first, second), (second, third), (third, first))):
            r1, r2 = radius[k], radius[(k + 1) % 3]
            self.contacts.append(("span", start, end, r1, r2))
            self.loops += (f"  - {{name: c{len(self.contacts)}, type: span, between: [b{start}, b{end}], radius: {r1!r}, "
                           f"radius2: {r2!r}}}\n")

    def text(self):
        for k, body in enumerate(self.bodies):
            body["load"] = float(self.draw.uniform(-1, 1))
        effects = "".join(f"  - {{name: t{k}, type: motor, joint: b{k}, torque: {b['load']!r}}}\n" for k, b in enumerate(self.bodies))
        return ("gravity: [0.7, -9.81, 0]\nbodies:\n" + self.scene + "loops:\n" + self.loops + "effects:\n" + effects
                + "simulate: {duration: 0.25, integrator: dop853, tolerance: 1e-11}\n")

    # absolute coordinates: x, y, angle of each body

    def places(self, q):
        """Centres and angles of all bodies from the joint angles."""
        x = numpy.zeros((len(self.bodies), 3))
        for k, body in enumerate(self.bodies):
            up = numpy.zeros(3) if body["host"] is None else x[body["host"]]
            c, s = math.cos(up[2]), math.sin(up[2])
            x[k] = [up[0] + c * body["at"][0] - s * body["at"][1], up[1] + s * body["at"][0] + c * body["at"][1], up[2] + q[k]]
        return x

    def rows(self, x):
        """J: pins (two rows each, on the body at its centre), then a unit force on the second body of each mesh or span, and opposite
        forces of half a unit in both spans of a belt of two pulleys. Besides, the rows of a unit tension in both spans."""
        n, rows, rests = len(self.bodies), [], []
        for k, body in enumerate(self.bodies):
            for axis in range(2):
                row = numpy.zeros((n, 3))
                row[k, axis] = 1
                if body["host"] is not None:
                    h = body["host"]
                    arm = x[k, :2] - x[h, :2]
                    row[h, axis] -= 1
                    row[h, 2] -= [-arm[1], arm[0]][axis]
                rows.append(row)
        for kind, first, second, r1, r2 in self.contacts:
            d = x[second, :2] - x[first, :2]
            e = d / numpy.hypot(*d)
            left = numpy.array([-e[1], e[0]])
            if kind == "gear":
                lines = [(left, r1 * e - d)]
            else:
                lines = []
                for side in (1, -1) if kind == "belt" else (1,):  # the span leaves both circles on one side: m . d = rho_1 - rho_2
                    sine = (side * r1 - side * r2) / numpy.hypot(*d)
                    along = math.sqrt(1 - sine**2) * e - sine * left
                    m = numpy.array([-along[1], along[0]])
                    lines.append((along, side * r2 * m))
            forces = []
            for force, reach in lines:  # at the second centre + reach
                row = numpy.zeros((n, 3))
                other = d + reach
                row[second] += [*force, reach[0] * force[1] - reach[1] * force[0]]
                row[first] -= [*force, other[0] * force[1] - other[1] * force[0]]
                forces.append(row)
            # the pins keep the distance of the pulleys: the spans differ from the tension at rest by opposite forces
            rows.append(0.5 * (forces[0] - forces[1]) if kind == "belt" else forces[0])
            rests.append(forces[0] + forces[1] if kind == "belt" else numpy.zeros((n, 3)))
        return numpy.array([row.ravel() for row in rows]), rests

    def solve(self, q, v):
        """Accelerations, and the forces of all rows, with the least norm where they repeat each other."""
        h, n = 1e-4, 3 * len(self.bodies)
        twist = lambda by: self.places(q + by * v)  # noqa: E731
        speed = (8 * (twist(h) - twist(-h)) - (twist(2 * h) - twist(-2 * h))).ravel() / (12 * h)
        x = self.places(q)
        J, rests = self.rows(x)
        J_at = lambda by: self.rows(twist(by))[0]  # noqa: E731
        rate = (8 * (J_at(h) - J_at(-h)) - (J_at(2 * h) - J_at(-2 * h))) / (12 * h)
        M = numpy.diag(numpy.array([[b["mass"], b["mass"], b["inertia"]] for b in self.bodies]).ravel())
        f = numpy.array([[0.7 * b["mass"], -9.81 * b["mass"], b["load"]] for b in self.bodies])
        for b in self.bodies:
            if b["host"] is not None:
                f[b["host"], 2] -= b["load"]
        big = numpy.block([[M, -J.T], [J, numpy.zeros((len(J), len(J)))]])
        pins = 2 * len(self.bodies)
        right = numpy.concatenate([f.ravel(), -rate @ speed])
        solution = numpy.linalg.lstsq(big, right, rcond=1e-11)[0]
        force = solution[n:]
        # what parts the teeth, and belts at rest: their pins balance it, and nothing moves
        extra = numpy.zeros((len(self.bodies), 3))
        for at, (kind, first, second, r1, r2) in enumerate(self.contacts, pins):
            d = x[second, :2] - x[first, :2]
            e = d / numpy.hypot(*d)
            if kind == "gear":
                push = abs(force[at]) * math.tan(math.radians(20)) * math.copysign(1, r1 * r2) * e
                extra[second, :2] += push
                extra[first, :2] -= push
            else:
                extra -= 50 * rests[at - pins]
        force[:pins] += numpy.linalg.lstsq(J[:pins].T, -extra.ravel(), rcond=1e-11)[0]
        return solution[:n].reshape(-1, 3), force[:pins].reshape(-1, 2), speed.reshape(-1, 3)


def trains():
    draw, worst, loads, count, meshes, belts, wraps, planets = numpy.random.default_rng(82), 0.0, 0.0, 0, 0, 0, 0, 0
    while count < 200:
        train = Train(draw)
        for _ in range(int(draw.integers(1, 5))):
            train.grow()
        for row in run(train.text()):
            n = len(train.bodies)
            q = numpy.array([row[f"position.b{k}"] for k in range(n)])
            v = numpy.array([row[f"velocity.b{k}"] for k in range(n)])
            a, pins, _ = train.solve(q, v)
            scale = max(1.0, *(abs(a[:, 2])))
            size = max(1.0, numpy.abs(pins).max())
            for k, body in enumerate(train.bodies):
                own = a[k, 2] - (0 if body["host"] is None else a[body["host"], 2])
                worst = max(worst, abs(row[f"acceleration.b{k}"] - own) / scale)
                for axis in range(2):
                    loads = max(loads, abs(row[f"reaction.b{k}.f{'xy'[axis]}"] - pins[k, axis]) / size)
        count += 1
        wraps += sum(c[0] == "span" for c in train.contacts) // 3
        meshes += sum(c[0] == "gear" for c in train.contacts)
        belts += sum(c[0] == "belt" for c in train.contacts)
        planets += sum(b["host"] is not None for b in train.bodies)
    note(f"{count} trains: {meshes} meshes, {belts} belts of two pulleys and {wraps} of three, {planets} wheels on carriers")
    holds("accelerations against absolute coordinates", worst, 1e-9)
    holds("loads of bearings against absolute coordinates", loads, 1e-9)


def tutorial():
    page = pathlib.Path(sys.argv[2]).read_text()
    last, first = {}, {}
    for body in re.findall(r"^```yaml\n(.*?)^```", page, flags=re.S | re.M):
        named = re.search(r"^# (\S+)\.yaml$", body, flags=re.M)
        if named is None:  # lines for the scene above
            continue
        name = named[1]
        scene, table = FOLDER / f"{name}.yaml", FOLDER / f"{name}.csv"
        scene.write_text(body.replace("reaction]", "reaction, constraint]"))
        done = subprocess.run([KINETREE, "run", scene, "--out", table, "--quiet"], capture_output=True, text=True)
        if done.returncode or done.stderr:
            PROBLEMS.append(f"{name}: {done.stderr}")
            continue
        with table.open() as file:
            rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
        first[name], last[name] = rows[0], rows[-1]
    part, force, a = math.tan(math.radians(20)), 1 / 0.03, (1200 - 981) / 145
    train, end = first["planetary"], last["planetary"]
    near("carrier", end["velocity.carrier"], 30)
    near("sun", end["velocity.sun"], 100)
    for key, value in (("inner.fy", force), ("inner.fx", force * part), ("planet.fy", -2 * force), ("planet.fx", -0.2 * 0.05 * 900)):
        near(key, train[f"reaction.{key}"], value)
    car = last["differential"]
    for key, value in (("left", 50), ("right", 200), ("cage", 125)):
        near(key, car[f"velocity.{key}"], value, 1e-6)
    near("torque of a wheel", car["reaction.mesh-left.mx"], -50, 1e-6)
    near("axial force", car["reaction.left.fx"], 1250 * part * math.sin(math.atan(16 / 12)), 1e-6)
    hoist = last["tackle"]
    near("block", hoist["velocity.block"], a)
    near("rope at the drum", math.hypot(hoist["reaction.up.fx"], hoist["reaction.up.fz"]), 600 - 20 * a)
    near("rope behind the pulley", hoist["reaction.down.fz"], 600 - 22 * a)
    near("rope at the ceiling", hoist["reaction.end.fz"], -(600 - 23 * a))
    for number in ("30 rad/s", "3.3333 N m", "33.333 N", "12.132 N", "66.667 N", "363.97 N", "1.51034 m", "569.793 N", "566.772 N", "565.262 N"):
        if number not in page:
            PROBLEMS.append(f"the page has no {number}")


CLAIMS = {spur: "teeth_load_the_bearings_of_spur_and_helical_wheels", planetary: "a_planetary_train_needs_no_formula",
          bevel: "bevel_wheels_part_along_both_axes", rack: "a_rack_loads_its_guide", worm: "a_worm_of_either_hand_turns_its_wheel",
          belt: "bearings_carry_both_spans_of_a_belt", hoist: "ropes_over_pulleys_carry_a_load",
          loop_bearings: "bearings_that_are_loops_carry_the_parting_force",
          tutorial: "the_tutorial_has_the_numbers_of_its_calculations_by_hand", trains: "random_trains_are_those_of_absolute_coordinates"}
for test, name in CLAIMS.items():
    PROBLEMS.clear()
    test()
    claim(name, list(PROBLEMS))
finish()
