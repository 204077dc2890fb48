"""A mechanism in absolute coordinates, from the scene contract alone: the oracle's equations of motion.

Every body i has a pose (R, r of its frame's origin), a twist (w, v) and an acceleration (alpha, a), all in world axes;
every joint has its rates u. The unknowns are x = (alpha_1, a_1, ..., u'), and everything else is a row of J x = b:
  a joint    alpha_i - alpha_p - E Sw u' = ...,   a_i - a_p - alpha_p x d - E Sv u' = ...   (6 rows, E: the joint frame's axes)
  a loop     the second time derivative of its equations
With M = diag(spatial inertias about the bodies' origins, armatures) and f = (applied less gyroscopic wrenches, joint forces),
  M x + J' lambda = f,  J x = b   (lambda here is what the constraint takes; reactions are -lambda).
One singular value decomposition of J gives its rank, x = J^+ b + N z with (N' M N) z = N' (f - M J^+ b), and lambda.
Nothing here is recursive, and nothing reads the library's sources.
"""
import math

import numpy as np

AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "-x": (-1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}
NEXT = {"z": "x", "x": "y", "y": "z", "-z": "x", "-x": "y", "-y": "z"}
RANK = 1e-9  # singular values below this share of the largest are zeros
NEAR = 1e-4  # and those between RANK and this one are too near to a singular position to be compared


# Rotations


def skew(u):
    return np.array([[0.0, -u[2], u[1]], [u[2], 0.0, -u[0]], [-u[1], u[0], 0.0]])


def cross(a, b):
    return a[..., [1, 2, 0]] * b[..., [2, 0, 1]] - a[..., [2, 0, 1]] * b[..., [1, 2, 0]]


def unit(u):
    u = np.array(u, float)
    return u / np.linalg.norm(u)


def axis_of(value, default="z"):
    value = default if value is None else value
    return np.array(AXES[value], float) if isinstance(value, str) else unit(value)


def turn(n, angle):
    """Rodrigues: R = 1 + sin [n] + (1 - cos) [n]^2."""
    k = skew(unit(n))
    return np.eye(3) + math.sin(angle) * k + (1.0 - math.cos(angle)) * (k @ k)


def from_quaternion(q):
    w, v = q[0], np.array(q[1:], float)
    return ((w * w - v @ v) * np.eye(3) + 2.0 * np.outer(v, v) + 2.0 * w * skew(v)) / (w * w + v @ v)


def angle_of(value):
    return math.radians(float(value.split()[0])) if isinstance(value, str) else value


def rotation(spec):
    """The rotation matrix of any of the forms of the contract."""
    if spec is None:
        return np.eye(3)
    if "quaternion" in spec:
        return from_quaternion(spec["quaternion"])
    if "rpy" in spec:
        a, b, c = map(angle_of, spec["rpy"])
        return turn(AXES["z"], c) @ turn(AXES["y"], b) @ turn(AXES["x"], a)
    if "euler" in spec:
        R = np.eye(3)
        for digit, angle in zip(str(spec["euler"]["sequence"]), spec["euler"]["angles"]):
            R = R @ turn(AXES["xyz"[int(digit) - 1]], angle_of(angle))
        return R
    if "vector" in spec:
        a = np.linalg.norm(spec["vector"])
        return np.eye(3) if a == 0.0 else turn(spec["vector"], a)
    if "cgr" in spec:
        return from_quaternion([1.0, *(0.5 * np.array(spec["cgr"]))])
    if "axis" in spec:
        return turn(axis_of(spec["axis"]), angle_of(spec["angle"]))
    return np.array(spec["matrix"], float)


# Functions of time: value and two derivatives


def function(spec, t):
    if not isinstance(spec, dict):
        return np.array([spec, 0.0, 0.0])
    kind, p = next(iter(spec.items()))
    if kind == "sine":
        w = 2.0 * math.pi * p["frequency"]
        s, c = math.sin(w * t + p.get("phase", 0.0)), math.cos(w * t + p.get("phase", 0.0))
        return np.array([p.get("offset", 0.0) + p["amplitude"] * s, p["amplitude"] * w * c, -p["amplitude"] * w * w * s])
    if kind == "ramp":  # 3 s^2 - 2 s^3 between start and end
        span, rise = p["end"] - p["start"], p["to"] - p["from"]
        s = min(max((t - p["start"]) / span, 0.0), 1.0)
        inside = 1.0 if 0.0 < s < 1.0 else 0.0
        return np.array([p["from"] + rise * s * s * (3.0 - 2.0 * s), rise * 6.0 * s * (1.0 - s) / span, inside * rise * (6.0 - 12.0 * s) / span**2])
    if kind == "polynomial":
        c = np.polynomial.polynomial.Polynomial(p)
        return np.array([c(t), c.deriv()(t), c.deriv(2)(t)])
    table = np.array(p, float)
    x, y = table[:, 0], table[:, 1]
    k = min(max(np.searchsorted(x, t, side="right") - 1, 0), len(x) - 2)
    h, s = x[k + 1] - x[k], t - x[k]
    slope = (y[k + 1] - y[k]) / h
    if spec.get("interpolation", "linear") == "linear":
        return np.array([y[k] + slope * s, slope, 0.0])
    # Natural cubic spline by its second derivatives m: h_(i-1) m_(i-1) + 2 (h_(i-1) + h_i) m_i + h_i m_(i+1) = 6 (slopes' step).
    n, step = len(x), np.diff(x)
    A, b = np.eye(n), np.zeros(n)
    for i in range(1, n - 1):
        A[i, i - 1 : i + 2] = step[i - 1], 2.0 * (step[i - 1] + step[i]), step[i]
        b[i] = 6.0 * ((y[i + 1] - y[i]) / step[i] - (y[i] - y[i - 1]) / step[i - 1])
    m = np.linalg.solve(A, b)
    first, third = slope - h * (2.0 * m[k] + m[k + 1]) / 6.0, (m[k + 1] - m[k]) / h
    return np.array([y[k] + s * (first + s * (m[k] / 2.0 + s * third / 6.0)), first + s * (m[k] + s * third / 2.0), m[k] + s * third])


# Joints


def triad(n):
    """The two axes in the plane normal to an axis: of z they are x and y, and so on round; then any right-handed triad."""
    for name, value in AXES.items():
        if np.array_equal(n, value) and name[0] != "-":
            x = np.array(AXES[NEXT[name]], float)
            return x, np.cross(n, x)
    raise ValueError("planar joints of the oracle have a named axis")


class Joint:
    SIZE = {"fixed": 0, "revolute": 1, "prismatic": 1, "screw": 1, "cylindrical": 2, "planar": 3, "universal": 2, "spherical": 3, "free": 6}

    def __init__(self, spec):
        spec = spec or {"type": "fixed"}
        self.type, self.size = spec["type"], self.SIZE[spec["type"]]
        self.at, self.rotation = np.array(spec.get("at", (0, 0, 0)), float), rotation(spec.get("rotation"))
        self.n = axis_of(spec.get("axis"))
        self.n2 = axis_of(spec.get("axis2"), NEXT.get(spec.get("axis", "z"), "x") if isinstance(spec.get("axis", "z"), str) else "x")
        self.pitch, self.armature = spec.get("pitch", 0.0), spec.get("armature", 0.0)
        self.scalar = self.size == 1
        self.quaternion = {"spherical": 0, "free": 3}.get(self.type)
        self.q, self.u = self.given(spec)

    def given(self, spec):
        q, u = spec.get("position"), spec.get("velocity")
        if self.type == "spherical":
            return np.array([1.0, 0, 0, 0] if q is None else q, float), np.array(np.zeros(3) if u is None else u, float)
        if self.type == "free":
            q, u = q or {}, u or {}
            orientation = q.get("orientation", {"quaternion": [1.0, 0.0, 0.0, 0.0]})["quaternion"]
            return np.array([*q.get("position", (0, 0, 0)), *orientation], float), np.array([*u.get("linear", (0, 0, 0)), *u.get("angular", (0, 0, 0))], float)
        numbers = [np.atleast_1d(np.array(np.zeros(self.size) if x is None else x, dtype=object)) for x in (q, u)]
        return tuple(np.array([angle_of(k) for k in x], float) for x in numbers)

    def motion(self, q, u):
        """In the joint frame: rotation Q, translation p, Sw and Sv with w = Sw u and p' = Sv u, and Sw' u (Sv' is 0)."""
        Q, p, n, zero = np.eye(3), np.zeros(3), self.n, np.zeros(3)
        Sw, Sv, bw = np.zeros((3, self.size)), np.zeros((3, self.size)), zero
        if self.type in ("revolute", "screw", "cylindrical"):
            Q, Sw[:, 0] = turn(n, q[0]), n
        if self.type == "prismatic":
            p, Sv[:, 0] = n * q[0], n
        elif self.type == "screw":
            p, Sv[:, 0] = n * self.pitch * q[0], n * self.pitch
        elif self.type == "cylindrical":
            p, Sv[:, 1] = n * q[1], n
        elif self.type == "planar":
            x, y = triad(n)
            Q, p, Sw[:, 2], Sv[:, 0], Sv[:, 1] = turn(n, q[2]), x * q[0] + y * q[1], n, x, y
        elif self.type == "universal":
            first = turn(n, q[0])
            second = first @ self.n2
            Q, Sw[:, 0], Sw[:, 1] = first @ turn(self.n2, q[1]), n, second
            bw = np.cross(n, second) * u[0] * u[1]
        elif self.type == "spherical":
            Q = from_quaternion(q)
            Sw = Q.copy()
        elif self.type == "free":
            Q, p = from_quaternion(q[3:]), q[:3]
            Sw[:, 3:], Sv[:, :3] = Q, np.eye(3)
        return Q, p, Sw, Sv, bw

    def rate(self, q, u):
        """The time derivative of the positions: q' = q o (0, w) / 2 for a quaternion."""
        if self.quaternion is None:
            return u
        k, w = self.quaternion, u[-3:]
        s, v = q[k], q[k + 1 : k + 4]
        return np.concatenate([u[:k], [-0.5 * v @ w], 0.5 * (s * w + np.cross(v, w))])


# Masses


def solid(shape, mass):
    """Centre and inertia (about it, body axes) of the uniform solid."""
    at, R, kind = np.array(shape.get("at", (0, 0, 0)), float), rotation(shape.get("rotation")), shape["type"]
    if kind == "point":
        return at, np.zeros((3, 3))
    if kind == "sphere":
        return at, np.eye(3) * 0.4 * mass * shape["radius"] ** 2
    if kind == "box":
        x, y, z = np.array(shape["size"]) ** 2
        return at, R @ np.diag([y + z, x + z, x + y]) @ R.T * mass / 12.0
    if kind == "rod":
        a, b = np.array(shape.get("from", (0, 0, 0)), float), np.array(shape["to"], float)
        at, n, length, R = (a + b) / 2.0, unit(b - a), np.linalg.norm(b - a), np.eye(3)
    else:
        n, length = axis_of(shape.get("axis")), shape["length"]
    r, n = shape.get("radius", 0.0), R @ n
    along, across = mass * r * r / 2.0, mass * (3.0 * r * r + length * length) / 12.0
    return at, across * np.eye(3) + (along - across) * np.outer(n, n)


class Body:
    def __init__(self, spec):
        self.name, self.parent, self.joint = spec["name"], spec.get("parent", "world"), Joint(spec.get("joint"))
        self.mass, self.markers = spec.get("mass", 0.0), spec.get("markers", {})
        com, inertia = np.zeros(3), np.zeros((3, 3))
        if "shape" in spec and self.mass > 0.0:
            com, inertia = solid(spec["shape"], self.mass)
        if "inertia" in spec:
            i = [*spec["inertia"], 0.0, 0.0, 0.0]
            inertia = np.array([[i[0], i[3], i[4]], [i[3], i[1], i[5]], [i[4], i[5], i[2]]])
        self.com, self.inertia = np.array(spec["com"], float) if "com" in spec else com, inertia


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


class Mechanism:
    """A scene, read by the oracle; states are lists of joint positions and of joint rates."""

    def __init__(self, scene):
        self.scene, self.gravity = scene, np.array(scene.get("gravity", (0, 0, 0)), float)
        self.bodies = [Body(b) for b in scene["bodies"]]
        self.index = {b.name: i for i, b in enumerate(self.bodies)}
        self.count, offset = len(self.bodies), 6 * len(self.bodies)
        for body in self.bodies:
            body.up = None if body.parent == "world" else self.index[body.parent]
            body.at_x = slice(offset, offset + body.joint.size)
            offset += body.joint.size
        self.size = offset
        self.order, left = [], list(range(self.count))
        while left:
            self.order += [i for i in left if self.bodies[i].up is None or self.bodies[i].up in self.order]
            left = [i for i in left if i not in self.order]
        self.loops = [Loop(s, self.bodies) for s in scene.get("loops", [])]
        self.q = [b.joint.q for b in self.bodies]
        self.u = [b.joint.u for b in self.bodies]
        self.start = {}
        pose = self.poses(self.q)
        for loop in self.loops:
            if loop.type in ("distance", "screw"):
                self.start[loop.name] = self.given(loop, pose)
        self.rest = {}  # lengths of springs that name none: those at the start

    def grounded(self, body):
        return body.joint.size == 0 and (body.up is None or self.grounded(self.bodies[body.up]))

    def given(self, loop, poses):
        """What a distance or a screw counts from."""
        (R1, p1), (R2, p2) = (self.end(e, poses) for e in loop.ends)
        n = loop.n
        x = unit(np.cross(n, [0.3, 0.5, 0.8] if abs(n @ [0.3, 0.5, 0.8]) < 0.9 else [1, 0, 0]))
        return {"length": np.linalg.norm(p2 - p1), "angle": math.atan2((R1 @ np.cross(n, x)) @ R2 @ x, (R1 @ x) @ R2 @ x)}

    def end(self, end, poses):
        R, r = (np.eye(3), np.zeros(3)) if end.body is None else poses[end.body]
        return R @ end.R, r + R @ end.at

    def poses(self, q):
        poses = [None] * self.count
        for i in self.order:
            body, joint = self.bodies[i], self.bodies[i].joint
            R, r = (np.eye(3), np.zeros(3)) if body.up is None else poses[body.up]
            Q, p = joint.motion(q[i], np.zeros(joint.size))[:2]
            E = R @ joint.rotation
            poses[i] = (E @ Q, r + R @ joint.at + E @ p)
        return poses

    def body_motion(self, end, state, accelerations):
        if end.body is None:
            return Motion(np.eye(3), np.zeros(3), np.zeros(6), accelerations)
        return Motion(*state.poses[end.body], state.twists[end.body], accelerations)


class State:
    """Everything at one instant: poses, twists, rows, and what follows from them."""

    def __init__(self, mechanism, q, u, t):
        self.m, self.q, self.u, self.t = mechanism, q, u, t
        self.poses = mechanism.poses(q)
        self.twists = [None] * mechanism.count
        self.constrain()

    def constrain(self):
        """J and b of all joints, and then of all loops; phi and phi' of the loops."""
        m, rows = self.m, 6 * self.m.count
        J, b = np.zeros((rows, m.size)), np.zeros(rows)
        self.arms, self.points = [None] * m.count, [None] * m.count
        for i in m.order:
            body, at = m.bodies[i], slice(6 * i, 6 * i + 6)
            Q, p, Sw, Sv, bw = body.joint.motion(self.q[i], self.u[i])
            R, r = (np.eye(3), np.zeros(3)) if body.up is None else self.poses[body.up]
            W = np.zeros(6) if body.up is None else self.twists[body.up]
            E, d = R @ body.joint.rotation, self.poses[i][1] - r
            turning, sliding = E @ Sw @ self.u[i], E @ Sv @ self.u[i]
            self.twists[i] = np.concatenate([W[:3] + turning, W[3:] + cross(W[:3], d) + sliding])
            S = np.vstack([E @ Sw, E @ Sv])
            J[at, at], J[at, body.at_x] = np.eye(6), -S
            if body.up is not None:
                up = 6 * body.up
                J[at, up : up + 6] = -np.eye(6)
                J[6 * i + 3 : 6 * i + 6, up : up + 3] = skew(d)
            b[6 * i : 6 * i + 3] = cross(W[:3], turning) + E @ bw
            b[6 * i + 3 : 6 * i + 6] = cross(W[:3], cross(W[:3], d)) + 2.0 * cross(W[:3], sliding)
            self.arms[i], self.points[i] = S, r + R @ body.joint.at
        self.joint_rows = (J, b)
        blocks, rates, self.phi, self.loop_rows = [J], [b], [], []
        self.velocity, self.speed = [], []
        for loop in m.loops:
            G, drift, phi, rate = self.relation(loop) if loop.joints else self.closure(loop)
            first = sum(len(x) for x in blocks)
            self.loop_rows.append(slice(first, first + len(G)))
            blocks.append(G)
            rates.append(-drift)
            self.phi.append(phi)
            self.velocity.append(rate)
        self.J, self.b = np.vstack(blocks), np.concatenate(rates)

    def relation(self, loop):
        """coupling: sum of c q = offset; motion: q = f(t)."""
        G, phi, rate = np.zeros((1, self.m.size)), 0.0, 0.0
        goal = function(loop.spec["position"], self.t) if loop.type == "motion" else np.array([loop.spec.get("offset", 0.0), 0.0, 0.0])
        for name, c in loop.joints.items():
            i = self.m.index[name]
            G[0, self.m.bodies[i].at_x] = c
            phi += c * self.q[i][0]
            rate += c * self.u[i][0]
        return G, np.array([-goal[2]]), np.array([phi - goal[0]]), np.array([rate - goal[1]])

    def closure(self, loop):
        """Unit accelerations of both bodies tell the rows: phi''(x) = G x + phi''(0)."""
        m, seeds = self.m, np.vstack([np.zeros(12), np.eye(12)])
        motions = [m.body_motion(e, self, seeds[:, k : k + 6]) for e, k in zip(loop.ends, (0, 6))]
        position = loop.equations(motions, self.t, m.start.get(loop.name))
        slips = loop.slips(motions)
        second = np.array([j[2] for j in position] + [j[1] for j in slips])
        G, drift = np.zeros((len(second), m.size)), second[:, 0]
        for end, k in zip(loop.ends, (1, 7)):
            if end.body is not None:
                G[:, 6 * end.body : 6 * end.body + 6] += (second - drift[:, None])[:, k : k + 6]
        loop.own = (second - drift[:, None])[:, 7:]  # on the second body, whether or not it is the world
        phi = np.array([j[0][0] for j in position])
        return G, drift, phi, np.array([j[1][0] for j in position] + [j[0][0] for j in slips])

    def rates(self):
        """The velocity of everything, as x is its acceleration."""
        return np.concatenate([*self.twists, *self.u])

    def factor(self):
        self.U, self.s, self.Vt = np.linalg.svd(self.J)
        self.rank = int((self.s > RANK * self.s[0]).sum())
        self.gap = self.s[self.rank - 1] / self.s[0]
        self.N = self.Vt[self.rank :].T

    def solve(self, b):
        """Least-norm solution of J x = b, and what is left."""
        r = self.rank
        x = self.Vt[:r].T @ ((self.U[:, :r].T @ b) / self.s[:r])
        return x, np.abs(self.J @ x - b).max()

    def dynamics(self, applied):
        """M x + J' lambda = f, J x = b; applied: [wrenches (moment about the body's origin, force)], [joint forces]."""
        m = self.m
        M, f = np.zeros((m.size, m.size)), np.zeros(m.size)
        for i, body in enumerate(m.bodies):
            R, at, w = self.poses[i][0], slice(6 * i, 6 * i + 6), self.twists[i][:3]
            c, I = R @ body.com, R @ body.inertia @ R.T
            k = skew(c)
            M[at, at] = np.block([[I - body.mass * k @ k, body.mass * k], [-body.mass * k, body.mass * np.eye(3)]])
            push = body.mass * (m.gravity - cross(w, cross(w, c)))
            f[at] = np.concatenate([cross(c, push) - cross(w, I @ w), push])
            M[body.at_x, body.at_x] = body.joint.armature * np.eye(body.joint.size)
        self.inertial = f.copy()
        for i, body in enumerate(m.bodies):
            f[6 * i : 6 * i + 6] += applied[0][i]
            f[body.at_x] += applied[1][i]
        self.M, self.f = M, f
        self.factor()
        x, self.contradiction = self.solve(self.b)
        H = self.N.T @ M @ self.N
        eigen = np.linalg.eigvalsh(H) if len(H) else np.ones(1)
        self.stiff = eigen[0] / max(eigen[-1], 1e-300)
        if len(H) and self.stiff > 1e-13:
            x = x + self.N @ np.linalg.solve(H, self.N.T @ (f - M @ x))
        r = self.rank
        self.x = x
        self.wrench = -(self.U[:, :r] @ ((self.Vt[:r] @ (f - M @ x)) / self.s[:r]))  # of constraints, on their second ends
        self.null = self.U[:, r:]

    def condition(self):
        """Why this state is too near to a singular one to be compared, or nothing."""
        if self.gap < NEAR:
            return f"singular value {self.gap:.1e}"
        if self.rank < len(self.s) and self.s[self.rank] > 1e-3 * RANK * self.s[0]:
            return f"uncertain rank {self.s[self.rank] / self.s[0]:.1e}"
        return f"inertia {self.stiff:.1e}" if self.stiff < 1e-7 else None

    def reaction(self, k):
        """Wrench (force, moment) on a joint's child at the joint frame's origin; whether it is unique."""
        rows = slice(6 * k, 6 * k + 6)
        return self.moved(self.wrench[rows], self.poses[k][1] - self.points[k]), np.abs(self.null[rows]).max(initial=0.0) < 1e-9

    def loop_reaction(self, loop, rows):
        """Wrench (force, moment) on the second end at the first end's point; whether it is unique."""
        own, first = loop.own, self.m.end(loop.ends[0], self.poses)[1]
        second = loop.ends[1].body
        origin = np.zeros(3) if second is None else self.poses[second][1]
        return self.moved(own.T @ self.wrench[rows], origin - first), np.abs(own.T @ self.null[rows]).max(initial=0.0) < 1e-9

    @staticmethod
    def moved(wrench, arm):
        return np.concatenate([wrench[3:], wrench[:3] + cross(arm, wrench[3:])])

    def tree(self):
        """T with (twists, rates)' = T u' + x0, the tree's mass matrix T' M T and its bias force h."""
        J, b, n = *self.joint_rows, 6 * self.m.count
        inverse = np.linalg.inv(J[:, :n])
        T = np.vstack([-inverse @ J[:, n:], np.eye(self.m.size - n)])
        x0 = np.concatenate([inverse @ b, np.zeros(self.m.size - n)])
        return T, T.T @ self.M @ T, T.T @ (self.M @ x0 - self.inertial)

    def energy(self):
        """Kinetic, and potential by gravity: that of bodies fixed to the world is a constant, which the command leaves out."""
        moving = [(b, *self.poses[i]) for i, b in enumerate(self.m.bodies) if not self.m.grounded(b)]
        return 0.5 * self.rates() @ self.M @ self.rates(), -sum(b.mass * self.m.gravity @ (r + R @ b.com) for b, R, r in moving)
