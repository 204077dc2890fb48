#!/usr/bin/env python3
"""Where the drive of a rolling wheel must end, `kinetree run` says so and when.

    dead_point.py KINETREE

A wheel rolls on the ground at the end of a leg that hangs on a universal joint, and the ground fixes neither its height nor the
leg: with u the rates of the universal joint's two angles and w that of the driven wheel, rolling without slip is A u + B w = 0,
two equations. Where det A = 0 no rate follows the drive. Here the same is integrated by equations of its own, without the library:
over s with t' = det A, q' = -adj(A) B w, which pass the dead point evenly, as t has its largest value there.
"""
# SPDX-License-Identifier: Apache-2.0
import json
import math
import re
import subprocess
import sys
import pathlib

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note  # noqa: E402

AT, AXIS, AXIS2, START = [0.8, 0.6, -1.0], [0, 1, 0], [0.0, -0.5, -1.4], [3.25, -0.6]
WHEEL_AT, WHEEL_AXIS, WHEEL = [-1.3, 1.2, -0.8], [-0.2, 0.55, -0.9], [-0.7, 0.9, 0.5]
AXLE, RADIUS, GROUND = [-1.2, -0.8, -0.5], 0.23, [-0.1, -0.2, 0.7]
ANGLE, RATE = 2.6, 20.0  # of the drive: ANGLE + RATE t


def add(a, b):
    return [x + y for x, y in zip(a, b)]


def scale(s, a):
    return [s * x for x in a]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def unit(a):
    return scale(1 / math.sqrt(dot(a, a)), a)


def turned(axis, angle, a):
    """Rodrigues' rotation of a."""
    e, c, s = unit(axis), math.cos(angle), math.sin(angle)
    return add(add(scale(c, a), scale(s, cross(e, a))), scale((1 - c) * dot(e, a), e))


def rows(q):
    """The velocity of the wheel's lowest point in the ground's plane by a unit rate of each angle: 2 x 3."""

    def leg(a):
        return turned(AXIS, q[0], turned(AXIS2, q[1], a))

    axes = [unit(AXIS), unit(turned(AXIS, q[0], AXIS2)), unit(leg(WHEEL_AXIS))]
    hub = add(AT, leg(WHEEL_AT))
    centre = add(hub, leg(turned(WHEEL_AXIS, q[2], WHEEL)))
    axle, normal = unit(leg(turned(WHEEL_AXIS, q[2], AXLE))), [0, 0, 1]
    point = add(centre, scale(-RADIUS, unit(add(normal, scale(-dot(normal, axle), axle)))))
    velocities = [cross(axis, add(point, scale(-1, origin))) for axis, origin in zip(axes, [AT, AT, hub])]
    return [[v[k] for v in velocities] for k in range(2)]


def slope(y):
    (a, b, e), (c, d, f) = rows(y[1:])
    det = a * d - b * c
    return [det, -(d * e - b * f) * RATE, -(a * f - c * e) * RATE, det * RATE]


def step(y, h):
    k1 = slope(y)
    k2 = slope(add(y, scale(h / 2, k1)))
    k3 = slope(add(y, scale(h / 2, k2)))
    k4 = slope(add(y, scale(h, k3)))
    return add(y, scale(h / 6, add(add(k1, k4), scale(2, add(k2, k3)))))


def dead_point(h):
    """The time at which det A = 0, by steps of h."""
    y = [0.0, START[0], START[1], ANGLE]
    h = math.copysign(h, slope(y)[0])
    while slope(y)[0] * h > 0:
        before, y = y, step(y, h)
    low, high = 0.0, h
    for _ in range(60):
        middle = (low + high) / 2
        low, high = (middle, high) if slope(step(before, middle))[0] * h > 0 else (low, middle)
    return step(before, low)[0]


def scene():
    heavy = {"mass": 1, "inertia": [0.1, 0.1, 0.1]}
    leg = {"name": "leg", "joint": {"type": "universal", "at": AT, "axis": AXIS, "axis2": AXIS2, "position": START}, **heavy}
    wheel = {"name": "wheel", "parent": "leg", "markers": {"hub": WHEEL}, **heavy,
             "joint": {"type": "revolute", "at": WHEEL_AT, "axis": WHEEL_AXIS, "position": ANGLE}}  # fmt: skip
    rolling = {"name": "ground", "type": "rolling", "wheel": "wheel.hub", "axis": AXLE, "radius": RADIUS, "normal": "z",
               "on": {"body": "world", "at": GROUND}, "holonomic": False}  # fmt: skip
    drive = {"name": "drive", "type": "motion", "joint": "wheel", "position": {"polynomial": [ANGLE, RATE]}}
    return {"kinetree": 1, "bodies": [leg, wheel], "loops": [rolling, drive], "initial": {"hold": ["leg"]}}


def main():
    program = sys.argv[1]
    right, coarse = dead_point(2e-4), dead_point(4e-4)
    note(f"dead point at {right:.12g} s; twice the step: {coarse - right:.1e} s from it")
    missing, off = [], []
    for options in ([], ["--integrator", "dopri5"], ["--integrator", "radau5"], ["--tolerance", "1e-6"]):
        command = [program, "run", "-", "--quiet", "--duration", "10", "--out", "/dev/null", *options]
        done = subprocess.run(command, input=json.dumps(scene()), capture_output=True, text=True, timeout=100)
        found = re.search(r"a dead point of the driven loops is at t = (\S+) s", done.stderr)
        if done.returncode != 4 or not found or "'leg'" not in done.stderr:
            missing.append(f"{options}: exit {done.returncode}: {done.stderr}")
        else:
            error = abs(float(found[1]) - right) / right
            note(f"{options}: {error:.1e} of the time off")
            if not error < (1e-5 if "1e-6" in options else 1e-8):
                off.append(f"{options}: t = {found[1]} s, not {right:.12g} s")
    claim("a_run_that_ends_at_a_dead_point_names_it", missing)
    claim("the_time_of_the_dead_point_is_right", off + ([] if abs(coarse - right) < 1e-8 else [f"own integration: {coarse - right}"]))
    finish()


main()
