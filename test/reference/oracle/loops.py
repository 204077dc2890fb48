"""Loops at position level, written once each; jets give their two time derivatives, and so the rows of J and b."""
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np

from parts import axis_of, cross, function, rotation, unit


# Jets: (value, first, second derivative) in time, for a batch of accelerations at once


def product(op, x, y):
    """Leibniz' rule for a bilinear operation."""
    return np.stack([op(x[0], y[0]), op(x[0], y[1]) + op(x[1], y[0]), op(x[0], y[2]) + 2.0 * op(x[1], y[1]) + op(x[2], y[0])])


def dot(x, y):
    return product(lambda a, b: (a * b).sum(-1), x, y)


def times(s, x):
    return product(lambda a, b: a[..., None] * b, s, x)


def chain(x, f, f1, f2):
    """f(x(t)) from f, f' and f'' at the value."""
    return np.stack([f(x[0]), f1(x[0]) * x[1], f2(x[0]) * x[1] ** 2 + f1(x[0]) * x[2]])


def root(x):
    return chain(x, np.sqrt, lambda a: 0.5 / np.sqrt(a), lambda a: -0.25 * a**-1.5)


def shifted(x):
    """The jet of a derivative; its second derivative is unknown and not used."""
    return np.stack([x[1], x[2], np.zeros_like(x[0])])


class Motion:
    """Of a body, along a batch of accelerations: jets of its points and of its axes."""

    def __init__(self, R, r, twist, accelerations):
        self.R, self.r, self.w, self.v = R, r, twist[:3], twist[3:]
        self.alpha, self.a = accelerations[:, :3], accelerations[:, 3:]
        self.batch = len(accelerations)

    def axis(self, u):
        e = self.R @ u
        w = cross(self.w, e)
        return np.stack([np.tile(e, (self.batch, 1)), np.tile(w, (self.batch, 1)), cross(self.alpha, e) + cross(self.w, w)])

    def point(self, c):
        e = self.axis(c)
        e[0] += self.r
        e[1] += self.v
        e[2] += self.a
        return e

    def spin(self):
        return np.stack([np.tile(self.w, (self.batch, 1)), self.alpha, np.zeros_like(self.alpha)])


class End:
    """A frame on a body: BODY.MARKER, BODY, world, or {body, at or marker, rotation}."""

    def __init__(self, spec, bodies):
        if isinstance(spec, str):
            body, _, marker = spec.partition(".")
            spec = {"body": body, **({"marker": marker} if marker else {})}
        self.body = None if spec["body"] == "world" else next(i for i, b in enumerate(bodies) if b.name == spec["body"])
        at = bodies[self.body].markers[spec["marker"]] if "marker" in spec else spec.get("at", (0, 0, 0))
        self.at, self.R = np.array(at, float), rotation(spec.get("rotation"))


class Loop:
    """A constraint between two ends; equations() is its position level (or, for slip, its velocity level) as jets."""

    def __init__(self, spec, bodies):
        self.spec, self.name, self.type, self.slip = spec, spec["name"], spec["type"], False
        self.joints, self.ends, self.size = {}, [], 0
        if self.type == "coupling":
            self.joints = dict(spec["coefficients"])
        elif self.type == "motion":
            self.joints = {spec["joint"]: 1.0}
        elif self.type == "rolling":
            self.ends = [End(spec["wheel"], bodies), End(spec["on"], bodies)]
            self.n, self.axle = axis_of(spec.get("normal")), axis_of(spec.get("axis"))
        else:
            self.ends = [End(e, bodies) for e in spec["between"]]
            given = spec.get("axis", "z")
            self.n = axis_of(given)
            self.n2 = axis_of(spec.get("axis2"))

    def frames(self, motions):
        (one, first), (two, second) = zip(motions, self.ends)
        return one, two, first, second

    def equations(self, motions, t, start):
        """Position-level equations as jets; start: {length, angle} of the given positions."""
        if self.type == "rolling":
            return [self.contact(motions)[0]] if self.spec.get("holonomic", True) else []
        one, two, first, second = self.frames(motions)
        d = two.point(second.at) - one.point(first.at)
        n = self.n
        x = unit(np.cross(n, [0.3, 0.5, 0.8] if abs(n @ [0.3, 0.5, 0.8]) < 0.9 else [1, 0, 0]))
        y = np.cross(n, x)

        def along(u):
            return dot(one.axis(first.R @ u), d)

        def angle(u, v):
            return dot(one.axis(first.R @ u), two.axis(second.R @ v))

        in_line, same_axis = [along(x), along(y)], [angle(x, n), angle(y, n)]
        if self.type == "distance":
            length = start["length"] if self.spec.get("length") is None else self.spec["length"]
            goal = function(length, t)
            return [root(dot(d, d)) - goal[:, None]]
        if self.type == "screw":  # (angle - initial angle) pitch = advance, with tan(angle) = (y1 . x2) / (x1 . x2)
            c, s = angle(x, x), angle(y, x)
            turned = np.stack([np.arctan2(s[0], c[0]), *(product(np.multiply, c, shifted(s)) - product(np.multiply, s, shifted(c)))[:2]])
            turned[0] -= start["angle"]
            turned[0] -= 2.0 * math.pi * np.round(turned[0] / (2.0 * math.pi))
            return in_line + same_axis + [along(n) - self.spec["pitch"] * turned]
        three, parallel = in_line + [along(n)], same_axis + [angle(x, y)]
        return {
            "spherical": three, "inline": in_line, "inplane": [along(n)], "parallel": parallel, "coaxial": same_axis,
            "orthogonal": [angle(n, self.n2)], "revolute": three + same_axis, "prismatic": in_line + parallel,
            "cylindrical": in_line + same_axis, "planar": [along(n)] + same_axis, "weld": three + parallel,
            "universal": three + [angle(n, self.n2)],
        }[self.type]  # fmt: skip

    def contact(self, motions):
        """Rolling: the wheel's lowest point is its centre less r u / |u|, u = n - (n . a) a; (height, that arm)."""
        wheel, ground, centre, on = self.frames(motions)
        n, a = ground.axis(on.R @ self.n), wheel.axis(centre.R @ self.axle)
        u = n - times(dot(n, a), a)
        length = root(dot(u, u))
        arm = times(chain(length, lambda s: -self.spec["radius"] / s, lambda s: self.spec["radius"] / s**2, lambda s: -2.0 * self.spec["radius"] / s**3), u)
        return dot(n, wheel.point(centre.at) + arm - ground.point(on.at)), arm

    def slips(self, motions):
        """Velocity level of rolling: no slip of the wheel's lowest point along either tangent."""
        if self.type != "rolling":
            return []
        wheel, ground, centre, on = self.frames(motions)
        arm = self.contact(motions)[1]
        lowest = wheel.point(centre.at) + arm
        wheels = shifted(wheel.point(centre.at)) + product(cross, wheel.spin(), arm)
        lever = lowest - ground.point(np.zeros(3))
        grounds = shifted(ground.point(np.zeros(3))) + product(cross, ground.spin(), lever)
        x = unit(np.cross(self.n, [0.3, 0.5, 0.8] if abs(self.n @ [0.3, 0.5, 0.8]) < 0.9 else [1, 0, 0]))
        return [dot(ground.axis(on.R @ e), wheels - grounds) for e in (x, np.cross(self.n, x))]
