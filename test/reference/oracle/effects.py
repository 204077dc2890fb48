"""What acts on a mechanism: wrenches on bodies, forces of joints, and the potential energy of what has one."""
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np

from loops import End
from parts import axis_of, cross, function, skew


def left_jacobian(angle):
    """1 + (1 - cos a) / a^2 [u] + (a - sin a) / a^3 [u]^2."""
    a, k = np.linalg.norm(angle), skew(angle)
    if a < 1e-4:
        return np.eye(3) + 0.5 * k + k @ k / 6.0
    return np.eye(3) + (1.0 - math.cos(a)) / a**2 * k + (a - math.sin(a)) / a**3 * (k @ k)


class Load:
    """Sums of all effects at a state."""

    def __init__(self, state, rest):
        self.state, self.rest, self.potential = state, rest, 0.0
        m = state.m
        self.wrenches = [np.zeros(6) for _ in m.bodies]
        self.forces = [np.zeros(b.joint.size) for b in m.bodies]
        for k, spec in enumerate(m.scene.get("effects", [])):
            getattr(self, spec["type"])(spec, k)

    def sums(self):
        return self.wrenches, self.forces

    def place(self, spec):
        """Axes, point and velocity of an end, and its body."""
        end = End(spec, self.state.m.bodies)
        R, p = self.state.m.end(end, self.state.poses)
        if end.body is None:
            return R, p, np.zeros(3), np.zeros(3), None
        twist = self.state.twists[end.body]
        return R, p, twist[3:] + cross(twist[:3], p - self.state.poses[end.body][1]), twist[:3], end.body

    def push(self, body, point, force, moment=0.0):
        if body is not None:
            self.wrenches[body] += np.concatenate([cross(point - self.state.poses[body][1], force) + moment, force])

    def joint(self, spec):
        i = self.state.m.index[spec["joint"]]
        return self.forces[i], self.state.q[i][0], self.state.u[i][0]

    def pair(self, spec):
        one, two = (self.place(e) for e in spec["between"])
        d = two[1] - one[1]
        length = np.linalg.norm(d)
        return one, two, d / length, length

    def spring(self, spec, k):
        """F = k (L - L0) + c L', along the line."""
        one, two, n, length = self.pair(spec)
        stretch = length - (spec["length"] if "length" in spec else self.rest.setdefault(k, length))
        pull = spec["stiffness"] * stretch + spec.get("damping", 0.0) * n @ (two[2] - one[2])
        self.push(one[4], one[1], pull * n)
        self.push(two[4], two[1], -pull * n)
        self.potential += 0.5 * spec["stiffness"] * stretch**2

    def attraction(self, spec, k):
        """F = g / L^2."""
        one, two, n, length = self.pair(spec)
        self.push(one[4], one[1], spec["strength"] / length**2 * n)
        self.push(two[4], two[1], -spec["strength"] / length**2 * n)
        self.potential -= spec["strength"] / length

    def bushing(self, spec, k):
        """In the first end's axes: forces by the displacement, moments by the rotation vector of the second against the first."""
        one, two = (self.place(e) for e in spec["between"])
        K, C = np.array(spec["stiffness"], float), np.array(spec.get("damping", [0.0] * 6), float)
        R = one[0].T @ two[0]
        axial = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
        sine, cosine = np.linalg.norm(axial), 0.5 * (np.trace(R) - 1.0)
        angle = axial * (math.atan2(sine, cosine) / sine if sine > 1e-12 else 1.0)
        d = two[1] - one[1]
        gap, rate = one[0].T @ d, one[0].T @ (two[2] - one[2] - cross(one[3], d))
        force = one[0] @ -(K[:3] * gap + C[:3] * rate)
        left = left_jacobian(angle).T  # of the exponential map: angle' = J^-1 w, so moments that do work with angle' are J^-T of them
        moment = one[0] @ -(np.linalg.solve(left, K[3:] * angle) + C[3:] * (one[0].T @ (two[3] - one[3])))
        self.push(two[4], two[1], force, moment)
        self.push(one[4], two[1], -force, -moment)
        self.potential += 0.5 * (K[:3] @ gap**2 + K[3:] @ angle**2)

    def joint_spring(self, spec, k):
        force, q, u = self.joint(spec)
        stretch = q - function(spec.get("rest", 0.0), self.state.t)[0]
        force -= spec["stiffness"] * stretch + spec.get("damping", 0.0) * u
        self.potential += 0.5 * spec["stiffness"] * stretch**2

    def joint_damper(self, spec, k):
        force, _, u = self.joint(spec)
        force -= spec["damping"] * u

    def joint_friction(self, spec, k):
        """Stribeck's curve, smooth through zero."""
        force, _, u = self.joint(spec)
        coulomb = spec["coulomb"]
        peak = (spec["static"] - coulomb) * math.exp(-((u / spec["stribeck"]) ** 2)) if "static" in spec else 0.0
        force -= (coulomb + peak) * math.tanh(u / spec["smoothing"]) + spec.get("viscous", 0.0) * u

    def joint_limit(self, spec, k):
        force, q, u = self.joint(spec)
        for over in (q - spec["upper"] if "upper" in spec else 0.0, q - spec["lower"] if "lower" in spec else 0.0):
            beyond = over > 0.0 if over == q - spec.get("upper", math.inf) else over < 0.0
            if beyond:
                stop, damping = spec["stiffness"] * over, spec.get("damping", 0.0) * u
                force -= stop + damping * abs(stop) / (abs(stop) + abs(damping))
                self.potential += 0.5 * spec["stiffness"] * over**2

    def motor(self, spec, k):
        self.joint(spec)[0][:] += function(spec.get("torque", spec.get("force")), self.state.t)[0]

    def servo(self, spec, k):
        force, q, u = self.joint(spec)
        goal = function(spec["target"], self.state.t)
        drive = spec["stiffness"] * (goal[0] - q) + spec.get("damping", 0.0) * (goal[1] - u)
        limit = spec.get("limit", math.inf)
        force += min(max(drive, -limit), limit)

    def given(self, spec, axes):
        value = np.array([function(x, self.state.t)[0] for x in spec["value"]])
        return axes @ value if spec.get("frame", "world") == "body" else value

    def force(self, spec, k):
        R, p, _, _, body = self.place(spec["at"])
        self.push(body, p, self.given(spec, self.state.poses[body][0]))

    def torque(self, spec, k):
        body = self.state.m.index[spec["on"]]
        self.wrenches[body][:3] += self.given(spec, self.state.poses[body][0])

    def drag(self, spec, k):
        where = {"body": spec["on"], "at": spec["at"]} if "at" in spec else spec["on"]
        _, p, v, _, body = self.place(where)
        self.push(body, p, -(spec.get("linear", 0.0) + spec.get("quadratic", 0.0) * np.linalg.norm(v)) * v)

    def contact(self, spec, k):
        """Hunt and Crossley: N = k depth^e (1 + 3/2 c depth'); friction mu N against the slip of the sphere's lowest point."""
        _, p, v, w, body = self.place(spec["point"])
        R, o, v0, w0, ground = self.place(spec["plane"])
        n, r = R @ axis_of(spec.get("axis")), spec.get("radius", 0.0)
        depth = r - n @ (p - o)
        if depth <= 0.0:
            return
        lowest = p - r * n
        slip = v + cross(w, lowest - p) - v0 - cross(w0, lowest - o)
        rate = -n @ slip
        exponent = spec.get("exponent", 1.5)
        normal = max(spec["stiffness"] * depth**exponent * (1.0 + 1.5 * spec.get("dissipation", 0.0) * rate), 0.0)
        slide = slip - n * (n @ slip)
        speed, slow = np.linalg.norm(slide), spec.get("slip", 1e-2)
        force = normal * n - spec.get("friction", 0.0) * normal * slide * (math.tanh(speed / slow) / speed if speed > 0 else 0.0)
        self.push(body, lowest, force)
        self.push(ground, lowest, -force)
        self.potential += spec["stiffness"] * depth ** (exponent + 1.0) / (exponent + 1.0)
