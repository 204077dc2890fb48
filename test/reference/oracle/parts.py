"""What a scene is made of, as its contract says: rotations, functions of time, joints, bodies with their masses."""
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np

AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1), "-x": (-1, 0, 0), "-y": (0, -1, 0), "-z": (0, 0, -1)}
NEXT = {"z": "x", "x": "y", "y": "z", "-z": "x", "-x": "y", "-y": "z"}


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


def pchip_slopes(x, y):
    """Fritsch and Butland's slopes at the rows of a monotone table."""
    h, e = np.diff(x), np.diff(y) / np.diff(x)
    if len(e) == 1:
        return np.array([e[0], e[0]])

    def end(h0, h1, e0, e1):
        p = ((2.0 * h0 + h1) * e0 - h0 * e1) / (h0 + h1)
        if np.sign(p) != np.sign(e0):
            return 0.0
        return 3.0 * e0 if np.sign(e1) != np.sign(e0) and abs(p) > 3.0 * abs(e0) else p

    w1, w2 = 2.0 * h[1:] + h[:-1], h[1:] + 2.0 * h[:-1]
    inner = [0.0 if a * b <= 0.0 else (u + v) / (u / a + v / b) for u, v, a, b in zip(w1, w2, e[:-1], e[1:])]
    return np.array([end(h[0], h[1], e[0], e[1]), *inner, end(h[-1], h[-2], e[-1], e[-2])])


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
    if spec["interpolation"] == "monotone":
        p = pchip_slopes(x, y)
        c = np.polynomial.polynomial.Polynomial([y[k], p[k], (3.0 * slope - 2.0 * p[k] - p[k + 1]) / h, (p[k] + p[k + 1] - 2.0 * slope) / h**2])
        return np.array([c(s), c.deriv()(s), c.deriv(2)(s)])
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
