"""contact_oracle KINETREE COUNT [--exact COUNT] [--seed N] [--also N...]: contact forces of random scenes against an oracle of
its own. --also: scenes of other seeds, N = 100000 seed + index, which once broke a law or ended early.

Scenes have up to five bodies and eight contacts with friction: boxes that stand on a floor and on each other, and arms that
lean on the floor or on a box, with dry friction, drives and loops. For each record, the oracle computes the motion of every
body from joint coordinates, in coordinates of the world, and tests Newton's law of each body with the recorded forces, and
Signorini's and Coulomb's laws of each contact. Each scene runs with adaptive steps, and with fixed steps of rk4.

Scenes without velocities also decide whether rest exists. The oracle searches forces in polygons inside and outside of the
friction cones with non-negative least squares. For the exact scenes, rational numbers prove each answer: forces in the cones
that balance the weight, or velocities that no such forces oppose (Farkas' lemma).
"""
# SPDX-License-Identifier: Apache-2.0
import argparse
import csv
import json
import math
import pathlib
import subprocess
import sys
import tempfile
from fractions import Fraction

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
from claims import claim, finish, note
from contact_scenes import G, Scene

STEP = 1e-3  # s, of fixed steps
EDGES = 32
# Laws of the mean forces that a time step records: gaps and rates change within it (time-stepping.md).
OF_MEANS = ("Newton's law of a body", "Euler's law of a body", "normal forces push", "friction is inside its cone")
BOUND = 1e-9  # of residuals, relative to their terms
PATIENCE = 120  # s of wall time, for 0.2 s of motion
AXES = {"x": (1, 0, 0), "y": (0, 1, 0), "z": (0, 0, 1)}


# ---- the oracle -----------------------------------------------------------------------------------------------------


def cross(a, b):
    return np.array([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def turned(axis, q):
    if q == 0:
        return np.eye(3, dtype=int) if isinstance(q, Fraction) else np.eye(3)
    k = np.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]], float)
    return np.eye(3) + math.sin(q) * k + (1 - math.cos(q)) * k @ k


def oriented(q):
    w, x, y, z = q
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                     [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                     [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])


class Frame:
    """Place, orientation, velocities and accelerations of a body in the world."""

    def __init__(self, x, R, v, w, a, al):
        self.x, self.R, self.v, self.w, self.a, self.al = x, R, v, w, a, al

    def point(self, at):
        return self.x + self.R @ at

    def velocity(self, p):
        return self.v + cross(self.w, p - self.x)

    def acceleration(self, p):
        r = p - self.x
        return self.a + cross(self.al, r) + cross(self.w, cross(self.w, r))


def frames_of(scene, q, v, a, number=float):
    """The motion of all bodies."""
    zero = np.array([number(0)] * 3)
    world = Frame(zero, turned((0, 0, 1), number(0)), zero, zero, zero, zero)
    frames = []
    for b, q, v, a in zip(scene.bodies, q, v, a):
        if b["kind"] == "free":
            R = oriented([number(x) for x in q[3:]])
            frames.append(Frame(np.array(q[:3]), R, np.array(v[:3]), R @ np.array(v[3:]), np.array(a[:3]), R @ np.array(a[3:])))
            continue
        p = frames[b["parent"]] if b["parent"] >= 0 else world
        axis = np.array([number(x) for x in AXES[b["axis"]]])
        d, at = p.R @ axis, np.array([number(x) for x in b["at"]])
        if b["kind"] == "revolute":
            x = p.point(at)
            frames.append(Frame(x, p.R @ turned(axis, q[0]), p.velocity(x), p.w + d * v[0], p.acceleration(x),
                                p.al + d * a[0] + cross(p.w, d * v[0])))
        else:
            x = p.point(at + axis * q[0])
            frames.append(Frame(x, p.R, p.velocity(x) + d * v[0], p.w,
                                p.acceleration(x) + d * a[0] + 2 * cross(p.w, d * v[0]), p.al))
    return frames, world


def size_of(x):
    return float(np.linalg.norm(np.array(x, float)))


class Record:
    """A row of the table, by joints and effects."""

    def __init__(self, scene, row):
        self.row = row
        free = [b["kind"] == "free" for b in scene.bodies]
        self.q, self.v, self.a = ([self.of(word, k, n if f else 1) for k, f in enumerate(free)]
                                  for word, n in (("position", 7), ("velocity", 6), ("acceleration", 6)))

    def of(self, word, k, n):
        return [self.row[f"{word}.b{k}"]] if n == 1 else [self.row[f"{word}.b{k}[{i}]"] for i in range(n)]

    def vector(self, start, names):
        return np.array([self.row[f"{start}.{n}"] for n in names])

    def wrench(self, name):
        return self.vector(f"reaction.{name}", ("fx", "fy", "fz")), self.vector(f"reaction.{name}", ("mx", "my", "mz"))


class Law:
    """Residuals of the laws in one record, each relative to its terms. step: the length of fixed steps, s. With it, friction
    of slip that it may turn or stop within a step has the direction of a later instant (contact-friction.md)."""

    def __init__(self, scene, record, step=0):
        self.scene, self.record, self.step, self.worst = scene, record, step, {}
        self.frames, self.world = frames_of(scene, record.q, record.v, record.a)
        self.load = [[] for _ in scene.bodies]  # force, moment about point, point
        self.weight = sum(b["mass"] for b in scene.bodies) * size_of(scene.gravity)
        self.contacts()
        self.joints()
        self.newton()

    def add(self, law, what, residual, size):
        value = abs(float(residual)) / max(float(size), 1e-300)
        value = math.inf if math.isnan(value) else value
        if value >= self.worst.get(law, (-1,))[0]:
            self.worst[law] = value, f"{what} at {self.record.row['time']:.6g} s"

    def frame(self, k):
        return self.frames[k] if k >= 0 else self.world

    def push(self, k, force, moment, point):
        if k >= 0:
            self.load[k].append((force, moment, point))

    def response(self, c):
        """A bound of the acceleration of a contact's slip under a unit of force: joints and loops only reduce it."""
        ends = [(k, self.scene.bodies[k]) for k in (c["body"], c["plane"]) if k >= 0]
        foot = self.frames[c["body"]].point(np.array(c["at"], float))
        arms = [(b, size_of(foot - self.frames[k].point(np.array(b["com"], float))) + c["radius"]) for k, b in ends]
        return sum(1 / b["mass"] + arm**2 / min(b["inertia"]) for b, arm in arms)

    def contacts(self):
        none = np.zeros(3)
        forces = [self.record.vector(f"effect.{c['name']}", ("fx [N]", "fy [N]", "fz [N]")) for c in self.scene.contacts]
        most = max([self.weight] + [size_of(f) for f in forces])
        unresolved = 2 * self.step * sum(c["mu"] * size_of(f) * self.response(c) for c, f in zip(self.scene.contacts, forces))
        for c, f in zip(self.scene.contacts, forces):
            on, plane = self.frame(c["body"]), self.frame(c["plane"])
            n = plane.R @ np.array([0, 0, 1.0])
            centre = on.point(np.array(c["at"], float))
            foot = centre - c["radius"] * n
            gap = float((foot - plane.point(np.array([0, 0, c["height"]]))) @ n)
            p = self.record.vector(f"effect.{c['name']}", ("x [m]", "y [m]", "z [m]"))
            self.push(c["body"], f, none, p)
            self.push(c["plane"], -f, none, p)
            s = on.velocity(foot) - plane.velocity(foot)
            rate, s = float(s @ n), s - (s @ n) * n
            N, T, mu, speed = float(f @ n), f - (f @ n) * n, c["mu"], size_of(s)
            what = f"contact {c['name']}"
            self.add("normal forces push", what, min(N, 0), most)
            self.add("friction is inside its cone", what, max(size_of(T) - mu * N, 0), most)
            self.add("a contact that pushes is closed", what, min(abs(gap) / 1e-3, max(N, 0) / most), 1)
            self.add("nothing penetrates", what, min(gap, 0), 1)
            if speed > 1e-3 + unresolved:
                self.add("friction opposes slip", what, size_of(T + mu * N * s / speed), most)
            elif speed > 1e-3:
                self.add("friction of slip dissipates", what, max(T @ s / speed, 0), most)
            # A contact that parts, however slowly, may fall. One that bounces may fall as long as its gap is not rounding of
            # places, which are up to 9 m: it has not struck yet.
            flies = gap > 1e-13 and rate < -1e-11
            touches = gap < 1e-9 and rate < 1e-11 and not flies
            x0 = plane.point(np.array([0, 0, c["height"]]))
            turn = cross(plane.w, n)
            a = n @ (on.acceleration(centre) - plane.acceleration(x0)) + 2 * turn @ (on.velocity(centre) - plane.velocity(x0))
            a += (cross(plane.al, n) + cross(plane.w, turn)) @ (centre - x0)
            if touches:
                self.add("touching contacts do not accelerate inwards", what, min(a, 0), G)

    def joints(self):
        for k, b in enumerate(self.scene.bodies):
            force, moment = self.record.wrench(b["name"])
            p = self.frame(b["parent"])
            point = self.frames[k].x if b["kind"] == "free" else p.point(np.array(b["at"], float))
            self.push(k, force, moment, point)
            self.push(b["parent"], -force, -moment, point)
            if b["kind"] == "free":
                self.add("free joints carry nothing", b["name"], size_of(force), self.weight)
                continue
            turns = b["kind"] == "revolute"
            along = float((moment if turns else force) @ (p.R @ np.array(AXES[b["axis"]], float)))
            carried, size = along, abs(along)
            for d in self.scene.dry:
                if d["body"] == k:
                    t = self.record.row[f"effect.{d['name']}.{'torque [N m]' if turns else 'force [N]'}"]
                    carried, size = carried - t, size + abs(t)
                    v = self.record.v[k][0]
                    self.add("dry friction is within its limit", d["name"], max(abs(t) - d["S"], 0), self.weight)
                    if abs(v) > 1e-3:
                        self.add("dry friction opposes slip", d["name"], t + math.copysign(d["S"], v), self.weight)
            for m in self.scene.drives:
                if m["body"] == k:
                    t = self.record.row[f"reaction.{m['name']}.multiplier"]
                    carried, size = carried - t, size + abs(t)
            self.add("effects and drives carry the joint", b["name"], carried, size + self.weight)
        for s in self.scene.ropes:
            force, moment = self.record.wrench(s["name"])
            a, b = s["bodies"]
            self.push(b, force, moment, self.frames[a].x)
            self.push(a, -force, -moment, self.frames[a].x)

    def newton(self):
        g = np.array(self.scene.gravity)
        for b, f, loads in zip(self.scene.bodies, self.frames, self.load):
            com = f.point(np.array(b["com"], float))
            inertia = f.R @ np.diag(b["inertia"]) @ f.R.T
            force = b["mass"] * (f.acceleration(com) - g)
            moment = inertia @ f.al + cross(f.w, inertia @ f.w)
            size = b["mass"] * (size_of(f.acceleration(com)) + size_of(g))  # terms that cancel in free flight
            turn = size_of(inertia @ f.al) + size_of(cross(f.w, inertia @ f.w)) + 0.1 * self.weight
            for push, torque, point in loads:
                arm = cross(point - com, push)
                force, moment = force - push, moment - torque - arm
                size = size + size_of(push)
                turn += size_of(torque) + (size_of(point) + size_of(com)) * size_of(push)
            self.add("Newton's law of a body", b["name"], size_of(force), size)
            self.add("Euler's law of a body", b["name"], size_of(moment), turn)


# ---- rest -----------------------------------------------------------------------------------------------------------


def least_squares(A, c, most=400):
    """min |A x - c|, x >= 0, after Lawson and Hanson. Returns x, and the columns that are not zero."""
    n = A.shape[1]
    x, active = np.zeros(n), np.zeros(n, bool)
    for _ in range(most):
        gradient = A.T @ (c - A @ x)
        gradient[active] = -1
        j = int(np.argmax(gradient))
        if gradient[j] <= 1e-13 * np.abs(A).max() * np.abs(c).max():
            break
        active[j] = True
        while True:
            y = np.zeros(n)
            y[active] = np.linalg.lstsq(A[:, active], c, rcond=None)[0]
            if (y[active] > 0).all():
                break
            low = active & (y <= 0)
            step = np.min(x[low] / np.maximum(x[low] - y[low], 1e-300))
            x = x + step * (y - x)
            active &= x > 1e-15 * max(x.max(), 1e-300)
            x[~active] = 0
        x = y
    return x, active


class Statics:
    """Weights, and generalised forces of all items, in the joint coordinates, as numbers of a type."""

    def __init__(self, scene, number):
        self.number = number
        q = [[number(x) for x in b["q"]] for b in scene.bodies]
        sizes = [6 if b["kind"] == "free" else 1 for b in scene.bodies]
        zeros = [[number(0)] * n for n in sizes]
        columns, drives = [], []
        driven = {m["body"] for m in scene.drives}
        for k, n in enumerate(sizes):
            for i in range(n):
                v = [list(z) for z in zeros]
                v[k][i] = number(1)
                (drives if k in driven else columns).append((k, frames_of(scene, q, v, zeros, number)))
        g = [number(x) for x in scene.gravity]
        still = np.array([number(0)] * 3)

        def rate(k, fw, point):
            frames, world = fw
            return frames[k].velocity(point) if k >= 0 else still

        frames = frames_of(scene, q, zeros, zeros, number)[0]
        self.weight = np.array([-sum(number(b["mass"]) * (rate(k, fw, f.point(np.array([number(x) for x in b["com"]]))) @ g)
                                     for k, (b, f) in enumerate(zip(scene.bodies, frames))) for _, fw in columns])
        self.contacts, self.pressing, self.free, self.bounded = [], [], [], []
        for c in scene.contacts:
            foot = frames[c["body"]].point(np.array([number(x) for x in c["at"]]))
            foot = foot - np.array([number(0), number(0), number(c["radius"])])
            J, by_drives = (np.array([rate(c["body"], fw, foot) - rate(c["plane"], fw, foot) for _, fw in of]).reshape(-1, 3)
                            for of in (columns, drives))
            largest, largest_by_drives = (max((abs(x) for x in rates[:, 2]), default=0) for rates in (J, by_drives))
            self.contacts.append((number(c["mu"]), J))
            if largest > 1e-12 * largest_by_drives or largest_by_drives == 0:  # else drives hold its gap: no force (hard-contacts.md)
                self.pressing.append(self.contacts[-1])
        for d in scene.dry:
            self.bounded.append((number(d["S"]), np.array([number(k == d["body"]) for k, _ in columns])))
        for s in scene.ropes:
            a, b = s["bodies"]
            line = frames[b].x - frames[a].x
            self.free.append(np.array([(rate(b, fw, frames[b].x) - rate(a, fw, frames[a].x)) @ line for _, fw in columns]))

    def system(self, outside):
        """A, c of A x = c, x >= 0, whose solutions are forces in polygons. Rows of bounds follow those of the coordinates.
        The corners (1 - s^2, 2 s) / (1 + s^2) are rational, and on the circle."""
        number, columns, names = self.number, [], []
        corners = []
        for e in range(EDGES):
            half = Fraction(round(math.tan(math.pi * (e + 0.5) / EDGES - math.pi / 2) * 2**20), 2**20)
            corners.append([number(x) for x in ((1 - half * half) / (1 + half * half), 2 * half / (1 + half * half))])
        widen = number(Fraction(1.01 / math.cos(math.pi / EDGES))) if outside else number(1)
        more = number(Fraction(1, 1024)) if outside else number(0)  # so that Farkas' velocities are strictly inside
        bounds = len(self.bounded)
        pad = [number(0)] * bounds
        for mu, J in self.pressing:
            mu = mu * widen + more
            for x, y in corners if mu else corners[:1]:
                columns.append([*(J @ np.array([mu * x, mu * y, number(1)])), *pad])
        for J in self.free:
            J = J * (max(abs(x) for x in J) > Fraction(1, 10**12)) if len(J) else J
            columns += [[*J, *pad], [*(-J), *pad]]
        for i, (S, J) in enumerate(self.bounded):  # p = x - S, x + y = 2 S
            one = [number(i == k) for k in range(bounds)]
            columns += [[*J, *one], [*([number(0)] * len(J)), *one]]
        c = [w + sum((S * J[i] for S, J in self.bounded), number(0)) for i, w in enumerate(self.weight)]
        return np.array(columns).T, np.array([*c, *(2 * S for S, _ in self.bounded)])


def float_rest(scene, outside):
    """Whether forces in polygons balance the weight: the residual is below 1e-9; and the solution."""
    A, c = Statics(scene, float).system(outside)
    if A.shape[0] == 0:
        return True, None, None
    scale = np.abs(A).max(axis=0)
    scale[scale == 0] = 1
    x, active = least_squares(A / scale, c / max(np.abs(c).max(), 1e-300))
    r = c / max(np.abs(c).max(), 1e-300) - (A / scale) @ x
    return bool(np.linalg.norm(r) < 1e-9), active, r


def solve_exactly(A, c):
    """A solution of A x = c in rational numbers; None: there is none."""
    rows = [[*row, x] for row, x in zip(A.tolist(), c.tolist())]
    n, at, pivots = A.shape[1], 0, []
    for j in range(n):
        k = next((i for i in range(at, len(rows)) if rows[i][j] != 0), None)
        if k is None:
            continue
        rows[at], rows[k] = rows[k], rows[at]
        rows[at] = [x / rows[at][j] for x in rows[at]]
        for i in range(len(rows)):
            if i != at and rows[i][j] != 0:
                f = rows[i][j]
                rows[i] = [x - f * y for x, y in zip(rows[i], rows[at])]
        pivots.append(j)
        at += 1
    if any(row[-1] != 0 for row in rows[at:]):
        return None
    x = [Fraction(0)] * n
    for i, j in enumerate(pivots):
        x[j] = rows[i][-1]
    return x


def exact_rest(scene):
    """Whether rest exists, proved in rational numbers: True, False, or None where neither polygon decides."""
    statics = Statics(scene, Fraction)
    found, active, _ = float_rest(scene, False)
    if found:
        if active is None:
            return True
        A, c = statics.system(False)
        x = solve_exactly(A[:, active], c)
        return True if x is not None and all(value >= 0 for value in x) else None
    found, active, _ = float_rest(scene, True)
    if found:
        return None
    A, c = statics.system(True)
    A = A[:, active]
    x = solve_exactly(A.T @ A, A.T @ c)
    n = len(statics.weight)
    y = (c - A @ np.array(x) if A.size else c)[:n]  # the residual of least squares: A'y = 0
    power = y @ statics.weight
    for i, (S, J) in enumerate(statics.bounded):
        power -= S * abs(y @ J)
    for mu, J in statics.pressing:  # the largest power of a force of the cone: y J_n + mu |y J_t| <= 0
        along = y @ J
        if along[2] > 0 or mu * mu * (along[0] ** 2 + along[1] ** 2) > along[2] ** 2:
            return None
    return False if power > 0 else None


def contradiction(scene):
    """Why the contacts of a scene contradict its bars or drives at the start; None: they do not. J: rates of contacts.

    A bar is a combination J' y of normals with y >= 0: it is normal to the face on which its body stands. Forces change
    y' J a by nothing. If the body slides, the bar pulls it into the face, with an acceleration of v^2 / L.
    Drives approach contacts, y' rates < 0, although no free velocity changes this, J' y = 0 with y >= 0 (Farkas)."""
    statics = Statics(scene, float)
    normals = np.array([J[:, 2] for _, J in statics.contacts]).T
    frames, world = frames_of(scene, *([np.array(b[x], float) for b in scene.bodies] for x in "qvv"))  # no accelerations

    def approach(c):
        foot = frames[c["body"]].point(np.array(c["at"], float)) - np.array([0, 0, c["radius"]])
        return (frames[c["body"]].velocity(foot) - (frames[c["plane"]] if c["plane"] >= 0 else world).velocity(foot))[2]

    def combines(A, target):
        return np.linalg.norm(A @ least_squares(A, target)[0] - target) < 1e-9 * np.linalg.norm(target)

    if normals.size and any(combines(normals, sign * J) for J in statics.free for sign in (1, -1)):
        return "a bar is normal to a face"
    rates = np.vstack([normals, [approach(c) for c in scene.contacts]])
    return "drives approach a contact" if scene.drives and combines(rates, np.eye(len(rates))[-1] * -1) else None


# ---- runs -----------------------------------------------------------------------------------------------------------


def run(kinetree, scene, duration, place, *options):
    path = pathlib.Path(place) / "scene.yaml"
    path.write_text(json.dumps(scene.document(duration)))
    command = [kinetree, "run", str(path), "--out", str(pathlib.Path(place) / "out.csv"), "--quiet", *options,
               "--summary", str(pathlib.Path(place) / "summary.json")]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE)
    except subprocess.TimeoutExpired:
        return None, f"scene {scene.seed} takes more than {PATIENCE} s"
    if ran.returncode:
        return None, f"scene {scene.seed} ends with {ran.returncode}: {ran.stderr.strip()[:400]}"
    with open(pathlib.Path(place) / "out.csv") as file:
        rows = [{name: float(x) if x else math.nan for name, x in row.items()} for row in csv.DictReader(file)]
    return [Record(scene, row) for row in rows], None


def leave_to_means(laws, place):
    """Leaves to records of completed steps the laws that means obey. The summary has their number, and the time of the first step."""
    completed = json.loads((pathlib.Path(place) / "summary.json").read_text())["contacts"].get("completed")
    means = completed["mean_records"] if completed else 0
    for law in laws:
        beyond = [name for name, (value, _) in law.worst.items() if name not in OF_MEANS and not value <= BOUND]
        if beyond and means > 0 and law.record.row["time"] > completed["time"]:
            means -= 1
            for name in beyond:
                del law.worst[name]


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("kinetree")
    parser.add_argument("scenes", type=int)
    parser.add_argument("--exact", type=int, default=0)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--also", type=int, nargs="*", default=[])
    options = parser.parse_args()
    numbers = [*range(options.scenes), *options.also]
    ended, stopped, placeless, worst, others, undecided, rests, moves, proved = [], [], [], {}, [], 0, 0, 0, 0
    with tempfile.TemporaryDirectory() as place:
        for k in numbers:
            exact = k < options.exact
            scene = Scene(k if k >= 100000 else options.seed * 100000 + k, exact or k % 2 == 0, exact)
            records, problem = run(options.kinetree, scene, 0.2, place)
            if problem:
                reason = contradiction(scene)
                note(f"scene {scene.seed} ends early: {reason or problem}")
                ended += [] if reason else [problem]
                placeless += [problem] if "at t = " not in problem else []
                continue
            laws = [Law(scene, record) for record in records]
            stepped, problem = run(options.kinetree, scene, 0.2, place, "--integrator", "rk4", "--step", str(STEP))
            if problem:
                reason = contradiction(scene)
                note(f"scene {scene.seed} ends early with fixed steps: {reason or problem}")
                stopped += [] if reason else [problem]
            placeless += [problem] if problem and "at t = " not in problem else []
            stepped = [Law(scene, record, STEP) for record in stepped or []]
            if stepped:
                leave_to_means(stepped, place)
            laws += stepped
            for law, (value, where) in (one for of in laws for one in of.worst.items()):
                if value >= worst.get(law, (-1,))[0]:
                    worst[law] = value, f"scene {scene.seed}, {where}"
            if not scene.rests:
                continue
            if exact:
                answer = exact_rest(scene)
                proved += answer is not None
            else:
                inside, outside = float_rest(scene, False)[0], float_rest(scene, True)[0]
                answer = True if inside else False if not outside else None
            undecided += answer is None
            rests, moves = rests + (answer is True), moves + (answer is False)
            if answer is not None and answer != (max(abs(x) for a in records[0].a for x in a) <= 1e-9 * G):
                others.append(f"scene {scene.seed}{' (exact)' if exact else ''}: rest {'exists' if answer else 'does not exist'}")
    note(f"{len(numbers)} scenes: {rests} with rest, {moves} without, {undecided} undecided, {proved} proved in rational numbers")
    for steps, problems in (("adaptive", ended), ("fixed", stopped)):
        note(f"{len(problems)} runs with {steps} steps end early without a contradiction (at most {options.scenes // 1000})")
    claim("runs_that_end_early_name_their_place", placeless)
    claim("runs_end_early_where_contacts_contradict_bars_or_drives", ended if len(ended) > options.scenes // 1000 else [])
    claim("fixed_steps_end_early_where_contacts_contradict_bars_or_drives", stopped if len(stopped) > options.scenes // 1000 else [])
    for law, (value, where) in sorted(worst.items()):
        note(f"{law}: {value:.3g} (bound {BOUND:g}), {where}")
        claim(law.replace(" ", "_").replace("'", ""), [] if value <= BOUND else [f"{value:.3g} > {BOUND:g}: {where}"])
    claim("rest_exists_where_the_oracle_has_it", others + ([] if undecided <= options.scenes // 50 else [f"{undecided} undecided"]))
    finish()


if __name__ == "__main__":
    main()
