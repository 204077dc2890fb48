"""A four-bar linkage by coordinate reduction: the method of Kinetree in numpy, for one mechanism.

The crank and the coupler form a chain, the rocker hangs on the ground, and a pin closes the loop:

    phi(u) = tip of the coupler - tip of the rocker = 0,      u = (crank, coupler, rocker)

Each evaluation factors A' = Q R, with A = dphi/du, and projects Newton's equations on the columns of Q2 (Maggi-Kane).
The classical Runge-Kutta method advances u and v, and a projection returns u and v onto the loop after each step.

    python3 four_bar.py [DURATION [STEP]]      prints a line "t u1 u2 u3 v1 v2 v3" for each tenth of a second
"""
# SPDX-License-Identifier: Apache-2.0
import sys

import numpy as np

GRAVITY = np.array([0.0, -9.81])
LENGTH = np.array([0.3, 0.8, 0.6])  # crank, coupler, rocker, m
MASS = np.array([0.5, 1.5, 1.0])  # kg, with the centre in the middle of each link
INERTIA = MASS * LENGTH**2 / 12.0  # about the centre, kg m^2
PIVOT = np.array([0.9, 0.0])  # of the rocker, m


def along(angle):
    """The unit vector at an angle to the x axis, and its derivative by the angle."""
    return np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])


def points(u, v):
    """Positions, Jacobians and velocity products (J' v) of the three centres and of both tips."""
    angle, rate = np.array([u[0], u[0] + u[1], u[2]]), np.array([v[0], v[0] + v[1], v[2]])
    turns = np.array([[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 1.0]])  # d angle / du
    e = [along(a) for a in angle]

    def chain(parts, start):
        """The point at start + sum of part_k times link k, for pairs (link, length)."""
        x, jacobian, bias = start.copy(), np.zeros((2, 3)), np.zeros(2)
        for link, length in parts:
            x += length * e[link][0]
            jacobian += length * np.outer(e[link][1], turns[link])
            bias -= length * rate[link] ** 2 * e[link][0]  # the centripetal acceleration
        return x, jacobian, bias

    ground = np.zeros(2)
    centres = [chain([(0, LENGTH[0] / 2)], ground), chain([(0, LENGTH[0]), (1, LENGTH[1] / 2)], ground),
               chain([(2, LENGTH[2] / 2)], PIVOT)]
    tips = [chain([(0, LENGTH[0]), (1, LENGTH[1])], ground), chain([(2, LENGTH[2])], PIVOT)]
    return centres, turns, tips


def loop(u, v):
    """phi, its Jacobian A, and b'' of the acceleration level A a = b''."""
    _, _, (coupler, rocker) = points(u, v)
    return coupler[0] - rocker[0], coupler[1] - rocker[1], rocker[2] - coupler[2]


def tree(u, v):
    """The mass matrix M and the forces f - h of the open tree: M a = f - h without the loop."""
    centres, turns, _ = points(u, v)
    mass, force = np.zeros((3, 3)), np.zeros(3)
    for k, (_, jacobian, bias) in enumerate(centres):
        mass += MASS[k] * jacobian.T @ jacobian + INERTIA[k] * np.outer(turns[k], turns[k])
        force += MASS[k] * jacobian.T @ (GRAVITY - bias)
    return mass, force


def factor(jacobian):
    """Q1, R1 and Q2 of A' = Q1 R1: Q1 spans the normals of the loop, Q2 its tangents."""
    q, r = np.linalg.qr(jacobian.T, mode="complete")
    rank = jacobian.shape[0]
    return q[:, :rank], r[:rank, :], q[:, rank:]


def acceleration(u, v):
    """a = a0 + Q2 z, with A a0 = b'' and (Q2' M Q2) z = Q2' (f - h - M a0)."""
    mass, force = tree(u, v)
    _, jacobian, right = loop(u, v)
    q1, r1, q2 = factor(jacobian)
    particular = q1 @ np.linalg.solve(r1.T, right)
    z = np.linalg.solve(q2.T @ mass @ q2, q2.T @ (force - mass @ particular))
    return particular + q2 @ z


def project(u, v):
    """Returns the state onto the loop by least changes: of the positions in Newton's method, of the velocities in kinetic energy."""
    for _ in range(10):
        gap, jacobian, _ = loop(u, v)
        if np.abs(gap).max() < 1e-15:
            break
        q1, r1, _ = factor(jacobian)
        u = u - q1 @ np.linalg.solve(r1.T, gap)
    _, jacobian, _ = loop(u, v)
    mass, _ = tree(u, v)
    normal = np.linalg.solve(mass, jacobian.T)  # M^-1 A'
    return u, v - normal @ np.linalg.solve(jacobian @ normal, jacobian @ v)


def step(u, v, h):
    """One step of the classical Runge-Kutta method of order four, and the projection."""
    k1u, k1v = v, acceleration(u, v)
    k2u, k2v = v + h / 2 * k1v, acceleration(u + h / 2 * k1u, v + h / 2 * k1v)
    k3u, k3v = v + h / 2 * k2v, acceleration(u + h / 2 * k2u, v + h / 2 * k2v)
    k4u, k4v = v + h * k3v, acceleration(u + h * k3u, v + h * k3v)
    return project(u + h / 6 * (k1u + 2 * k2u + 2 * k3u + k4u), v + h / 6 * (k1v + 2 * k2v + 2 * k3v + k4v))


def energy(u, v):
    mass, _ = tree(u, v)
    centres, _, _ = points(u, v)
    return 0.5 * v @ mass @ v - sum(m * GRAVITY @ x for m, (x, _, _) in zip(MASS, centres))


def start():
    """The crank at 60 degrees and 4 rad/s; coupler and rocker are closed from a sketch."""
    u, crank = np.array([np.pi / 3, -0.5, 1.5]), np.pi / 3
    for _ in range(50):  # Newton's method in the two angles that follow
        gap, jacobian, _ = loop(u, np.zeros(3))
        u[1:] -= np.linalg.solve(jacobian[:, 1:], gap)
    _, jacobian, _ = loop(u, np.zeros(3))
    v = np.array([4.0, 0.0, 0.0])
    v[1:] = -np.linalg.solve(jacobian[:, 1:], jacobian[:, 0] * v[0])
    assert u[0] == crank
    return u, v


def main(duration=2.0, h=0.001):
    u, v = start()
    first, count = energy(u, v), round(duration / h)
    for k in range(count + 1):
        if k % round(0.1 / h) == 0:
            print(f"{k * h:.1f}", *(f"{x:.17g}" for x in (*u, *v)))
        if k < count:
            u, v = step(u, v, h)
    print(f"gap {np.abs(loop(u, v)[0]).max():.1e} m, energy off by {abs(energy(u, v) - first):.1e} J", file=sys.stderr)


if __name__ == "__main__":
    main(*map(float, sys.argv[1:]))
