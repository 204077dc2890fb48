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
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np

from loops import Loop, Motion
from parts import Body, cross, function, skew, unit

RANK = 1e-9  # singular values below this share of the largest are zeros
NEAR = 1e-4  # and those between RANK and this one are too near to a singular position to be compared


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
