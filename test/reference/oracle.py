#!/usr/bin/env python3
"""An outsider's oracle: random mechanisms, run by the command and held against equations in absolute coordinates that share
nothing with the library (oracle/equations.py), written from the scene contract alone.

    oracle.py [--seeds FIRST:END] [--jobs N] [--keep DIRECTORY] KINETREE

What is compared, each against a bound relative to the mechanism's own scale:
  at records   accelerations, reactions (where they are unique), the balance of wrenches of every body with the reactions as
               printed (also where they are not), energies, markers, residuals of loops
  evaluate     mass matrix, bias force, poses, rank, row space of the constraint's matrix, A v = rate, A a = drift, inverse dynamics
  the motion   v(T) - v(0) and q(T) - q(0) are the integrals of the recorded a and q'(q, v), by Newton and Cotes' rule of nine points:
               records whose accelerations are right, and whose velocities and positions are their integrals, are the motion
Mechanisms too near to a singular position are recognised by the oracle's own singular values; they are counted, and the share
that is compared must be 0.8 of all.
"""
# SPDX-License-Identifier: Apache-2.0
import argparse
import csv
import json
import os
import pathlib
import subprocess
import sys
import tempfile

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
try:
    import numpy as np
except ImportError:
    print("[  SKIPPED ] reference/oracle: numpy is not on this machine")
    sys.exit(77)

here = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(here / "oracle"), str(here.parent)]
from claims import claim, finish, note  # noqa: E402
from effects import Load  # noqa: E402
from equations import Mechanism, State  # noqa: E402
from scenes import document, random_scene  # noqa: E402

# Bounds, relative to the scale of what is compared. Rounding alone would allow some 1e-12 (condition numbers reach 1e4); velocity
# and position add the error of the run's tolerance, 1e-12, and of the rule of nine points, which is shorter where it is not sure.
# Works are integrated along with the motion, outside of the control of its steps: 5e-9 was the worst of 3,000 seeds.
BOUNDS = {
    "acceleration": 1e-9, "reaction": 1e-9, "balance of bodies": 1e-9, "kinetic energy": 1e-9, "potential energy": 1e-9, "energy balance": 1e-7,
    "marker": 1e-10, "start": 1e-9, "loops closed": 1e-9, "mass matrix": 1e-10, "bias force": 1e-9, "pose": 1e-10, "row space": 1e-9, "rate": 1e-9,
    "drift": 1e-9, "inverse dynamics": 1e-9, "applied force": 1e-9, "equations of motion": 1e-9, "velocity": 1e-8, "position": 1e-8,
}  # fmt: skip
COTES = np.array([989, 5888, -928, 10496, -4540, 10496, -928, 5888, 989]) * (4.0 / 14175.0)
BOOLE = np.array([7, 32, 12, 32, 14, 32, 12, 32, 7]) * (2.0 / 45.0)


class Rejected(Exception):
    """The command ended with an error."""

    status = None


def kinetree(program, *arguments):
    environment = {**os.environ, "OPENBLAS_NUM_THREADS": "1"}
    done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=1200, env=environment, check=False)
    if done.returncode != 0:
        rejected = Rejected(f"{arguments[0]}: exit status {done.returncode}: {done.stderr.strip()}")
        rejected.status = done.returncode
        raise rejected
    return done.stdout


class Table:
    """The records of a run, by the names of their columns."""

    def __init__(self, text):
        rows = list(csv.reader(text.splitlines()))
        self.columns = {name: k for k, name in enumerate(rows[0])}
        self.rows = np.array([[float(x) for x in row] for row in rows[1:]])

    def numbers(self, row, quantity, name, size):
        if size == 0:
            return np.zeros(0)
        whole = f"{quantity}.{name}"
        names = [whole] if whole in self.columns else [f"{whole}[{k}]" for k in range(size)]
        return self.rows[row, [self.columns[n] for n in names]]

    def parts(self, row, name, parts):
        return self.rows[row, [self.columns[f"{name}.{p}"] for p in parts]]


class Comparison:
    """One mechanism: worst ratio of observed to bound for every quantity."""

    def __init__(self, scene, program, mutate=None):
        self.scene, self.program, self.mutate = scene, program, mutate
        self.worst, self.near = {}, None

    def see(self, quantity, error, scale):
        error = float(np.max(np.abs(error), initial=0.0)) if np.all(np.isfinite(error)) else float("nan")
        error /= scale
        ratio = error / BOUNDS[quantity]
        if not ratio <= self.worst.get(quantity, (0.0, -1.0))[1]:
            self.worst[quantity] = (error, ratio)

    def run(self):
        self.mechanism = Mechanism(self.scene)
        self.rest = {}
        start = self.state_of(self.mechanism.q, self.mechanism.u, 0.0)
        self.near = start.condition()
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder) / "scene.yaml"
            file.write_text(document(self.scene))
            try:
                self.evaluate(file, self.motion(file, start))
            except Rejected as rejected:
                if self.near is None or rejected.status == 2:
                    raise

    def state_of(self, q, u, t):
        state = State(self.mechanism, q, u, t)
        state.load = Load(state, self.rest)
        state.dynamics(state.load.sums())
        if self.mutate:
            state.x, state.wrench = state.x * self.mutate, state.wrench * self.mutate
        return state

    def read_state(self, table, k):
        bodies = self.mechanism.bodies
        size = [4 if b.joint.type == "spherical" else 7 if b.joint.type == "free" else b.joint.size for b in bodies]
        q = [table.numbers(k, "position", b.name, n) for b, n in zip(bodies, size)]
        return q, [table.numbers(k, "velocity", b.name, b.joint.size) for b in bodies]

    def look_ahead(self, duration, q, u):
        """The oracle's own motion (Runge-Kutta 4, 100 steps): a rejected run may come near a singular position later than at the start."""
        bodies, h = self.mechanism.bodies, duration / 100.0

        def rates(q, u, t):
            state = self.state_of(q, u, t)
            self.near = self.near or state.condition()
            return [b.joint.rate(x, w) for b, x, w in zip(bodies, q, u)], [state.x[b.at_x] for b in bodies]

        def moved(x, dx, h):
            return [a + h * b for a, b in zip(x, dx)]

        for k in range(100):
            t = k * h
            q1, u1 = rates(q, u, t)
            q2, u2 = rates(moved(q, q1, h / 2), moved(u, u1, h / 2), t + h / 2)
            q3, u3 = rates(moved(q, q2, h / 2), moved(u, u2, h / 2), t + h / 2)
            q4, u4 = rates(moved(q, q3, h), moved(u, u3, h), t + h)
            q = [a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(q, q1, q2, q3, q4)]
            u = [a + h / 6 * (b + 2 * c + 2 * d + e) for a, b, c, d, e in zip(u, u1, u2, u3, u4)]
            state = State(self.mechanism, q, u, t + h)
            if not np.abs(np.concatenate([[0.0], *state.phi])).max() < 1e-3:
                self.near = f"from {t:.3g} s on the loops are out of reach, by the oracle's motion too"
            if self.near:
                break

    def motion(self, file, start):
        """Records at nine times; a shorter run where the rule of nine points is not sure of its own integral."""
        speed = np.abs(start.rates()).max()
        duration = float(0.4 / max(5.0, speed, np.sqrt(np.abs(start.x).max())))
        for _ in range(4):
            try:
                text = kinetree(self.program, "run", str(file), "--out", "-", "--quiet", "--duration", repr(duration), "--interval", repr(duration / 8.0))
            except Rejected:
                q, u = self.mechanism.q, self.mechanism.u
                if self.scene["disturbed"]:  # then the motion starts where the assembly has led to
                    q, u = self.read_state(Table(kinetree(self.program, "run", str(file), "--out", "-", "--quiet", "--duration", "0")), 0)
                try:
                    with np.errstate(all="ignore"):
                        self.look_ahead(duration, q, u)
                except np.linalg.LinAlgError:
                    self.near = "the motion ends, by the oracle's equations too"
                raise
            table = Table(text)
            if len(table.rows) != 9:
                raise Rejected(f"{len(table.rows)} records instead of 9")
            self.sure = self.integrals(table, duration)
            if self.sure:
                break
            duration /= 4.0
        self.rest.clear()  # lengths at the start are those after assembly
        states = [self.record(table, k) for k in (0, 4, 8)]
        self.kept()
        return states[0]

    def kept(self):
        """A start that fits its loops is not moved; of one that does not, the held joints."""
        bodies, (q, u, _) = self.mechanism.bodies, self.states[0]
        held = self.scene.get("initial", {}).get("hold", []) if self.scene["disturbed"] else [b.name for b in bodies]
        for i, body in enumerate(bodies):
            if body.name in held:
                self.see("start", np.concatenate([q[i] - self.mechanism.q[i], u[i] - self.mechanism.u[i]]), 1.0)

    def integrals(self, table, duration):
        bodies = self.mechanism.bodies
        self.states, Q, V, A, dQ = [], [], [], [], []
        for k in range(9):
            q, u = self.read_state(table, k)
            a = [table.numbers(k, "acceleration", b.name, b.joint.size) for b in bodies]
            self.states.append((q, u, np.concatenate(a)))
            Q.append(np.concatenate(q))
            V.append(np.concatenate(u))
            A.append(self.states[-1][2])
            dQ.append(np.concatenate([b.joint.rate(x, y) for b, x, y in zip(bodies, q, u)]))
        h, sure = duration / 8.0, True
        for name, values, rates in (("velocity", V, A), ("position", Q, dQ)):
            values, rates = np.array(values), np.array(rates)
            total, rough = h * COTES @ rates, h * BOOLE @ rates
            scale = max(1.0, np.abs(values).max(initial=0.0))
            sure = sure and np.abs(total - rough).max(initial=0.0) < 0.01 * BOUNDS[name] * scale
            found = (values[8] - values[0] - total, scale)
            self.integral = {**getattr(self, "integral", {}), name: found}
        if sure:
            for name, (error, scale) in self.integral.items():
                self.see(name, error, scale)
        return sure

    def record(self, table, k):
        m, (q, u, a) = self.mechanism, self.states[k]
        state = self.state_of(q, u, table.rows[k, 0])
        self.near = self.near or state.condition()
        x, n = state.x, 6 * m.count
        force = 1.0 + np.abs(state.wrench).max(initial=0.0) + np.abs(state.f).max(initial=0.0)
        if self.near:
            return state
        self.see("acceleration", a - x[n:], 1.0 + np.abs(x).max())
        kinetic, potential = state.energy()
        potential += state.load.potential
        energy = 1.0 + abs(kinetic) + abs(potential)
        self.see("kinetic energy", table.parts(k, "energy", ["kinetic"]) - kinetic, energy)
        self.see("potential energy", table.parts(k, "energy", ["potential"]) - potential, energy)
        if "energy.balance" in table.columns and state.N.shape[1] > 0:  # where nothing is free steps may be long
            balance = table.rows[:, table.columns["energy.balance"]]
            self.see("energy balance", balance[k] - balance[0], energy)
        for body, (R, r) in zip(m.bodies, state.poses):
            for name, at in body.markers.items():
                self.see("marker", table.parts(k, f"marker.{body.name}.{name}", "xyz") - (r + R @ at), 1.0 + np.abs(r).max())
        self.see("loops closed", np.concatenate([np.zeros(1), *state.phi, *state.velocity]), 1.0 + np.abs(state.rates()).max())
        self.reactions(table, k, state, force)
        return state

    def reactions(self, table, k, state, force):
        """As printed: each where it is unique; and all together must carry every body."""
        m, parts = self.mechanism, ["fx", "fy", "fz", "mx", "my", "mz"]
        left = (state.M @ state.x - state.f)[: 6 * m.count].reshape(-1, 6).copy()

        def carry(body, wrench, point):
            if body is not None:
                left[body] -= np.concatenate([wrench[3:] + np.cross(point - state.poses[body][1], wrench[:3]), wrench[:3]])

        for i, body in enumerate(m.bodies):
            printed = table.parts(k, f"reaction.{body.name}", parts)
            own, unique = state.reaction(i)
            if unique:
                self.see("reaction", printed - own, force)
            carry(i, printed, state.points[i])
            carry(body.up, -printed, state.points[i])
        for loop, rows in zip(m.loops, state.loop_rows):
            if loop.joints:  # its row is its coefficients: they share one generalised force
                column = table.columns.get(f"reaction.{loop.name}.multiplier")
                if column is not None and np.abs(state.null[rows]).max(initial=0.0) < 1e-9:
                    self.see("reaction", table.rows[k, column] - state.wrench[rows], force)
                continue
            printed = table.parts(k, f"reaction.{loop.name}", parts)
            own, unique = state.loop_reaction(loop, rows)
            if unique:
                self.see("reaction", printed - own, force)
            point = m.end(loop.ends[0], state.poses)[1]
            carry(loop.ends[1].body, printed, point)
            carry(loop.ends[0].body, -printed, point)
        self.see("balance of bodies", left, force)

    def evaluate(self, file, start):
        """What `kinetree evaluate` prints of the start, with inverse dynamics for one vector of accelerations."""
        if self.near:
            return
        m = self.mechanism
        if m.size == 6 * m.count:
            return
        wanted = np.cos(np.arange(m.size - 6 * m.count) * 1.7)
        found = json.loads(kinetree(self.program, "evaluate", str(file), "--acceleration=" + ",".join(map(repr, wanted.tolist()))))
        names = [n for b in m.bodies for n in ([b.name] if b.joint.size == 1 else [f"{b.name}[{k}]" for k in range(b.joint.size)])]
        order = [names.index(n) for n in found["coordinates"]]
        T, M, h = start.tree()
        M, h, x = M[np.ix_(order, order)], h[order], start.x[6 * m.count :][order]
        scale = 1.0 + np.abs(M).max()
        force = scale + np.abs(h).max() + np.abs(start.f).max()
        self.see("mass matrix", np.array(found["mass_matrix"]) - M, scale)
        self.see("bias force", np.array(found["bias"]) - h, force)
        self.see("inverse dynamics", np.array(found["inverse_dynamics"]) - M @ wanted - h, force)
        self.see("acceleration", np.array(found["acceleration"]) - x, 1.0 + np.abs(start.x).max())
        applied = (T.T @ (start.f - start.inertial))[order]
        if "applied_force" in found:
            self.see("applied force", np.array(found["applied_force"]) - applied, force)
        for body, (R, r) in zip(m.bodies, start.poses):
            pose = found["pose"][body.name]
            self.see("pose", np.concatenate([np.array(pose["position"]) - r, (np.array(pose["rotation"]) - R).ravel()]), 1.0 + np.abs(r).max())
        if not m.loops:
            return
        constraint, v = found["constraint"], start.rates()[6 * m.count :][order]
        A = np.array(constraint["jacobian"])
        own = (start.J[6 * m.count :] @ T)[:, order]
        self.see("row space", self.projector(A) - self.projector(own), 1.0)
        self.see("row space", [constraint["rank"] - (start.rank - 6 * m.count), constraint["equations"] - len(own)], 1.0)
        size = 1.0 + np.abs(A).max()
        self.see("rate", A @ v - np.array(constraint["rate"]), size * (1.0 + np.abs(v).max()))
        self.see("drift", A @ x - np.array(constraint["drift"]), size * (1.0 + np.abs(start.x).max()))
        if "multiplier" in constraint:
            self.see("equations of motion", M @ x + h - applied - A.T @ np.array(constraint["multiplier"]), force * (1.0 + np.abs(start.x).max()))
        if "null_space" in constraint:
            N = np.array(constraint["null_space"], float).reshape(len(order), -1)
            self.see("row space", self.projector(A) + self.projector(N.T) - np.eye(len(order)), 1.0)

    @staticmethod
    def projector(A):
        _, s, Vt = np.linalg.svd(A, full_matrices=False)
        V = Vt[s > 1e-8 * max(s.max(initial=0.0), 1.0)]
        return V.T @ V


NEWER = {
    "armature": "bodies: [{name: a, joint: {type: revolute, armature: 1}, mass: 1}]",
    "rest": "bodies: [{name: a, joint: {type: prismatic}, mass: 1}]\neffects: [{type: joint_spring, joint: a, stiffness: 1, rest: {polynomial: [0, 1]}}]",
    "servo": "bodies: [{name: a, joint: {type: prismatic}, mass: 1}]\neffects: [{type: servo, joint: a, target: 1, stiffness: 1}]",
}


def missing(program):
    """What the contract has and this command does not read yet."""
    absent = []
    for name, scene in NEWER.items():
        with tempfile.NamedTemporaryFile("w", suffix=".yaml") as file:
            file.write(f"kinetree: 1\n{scene}\n")
            file.flush()
            try:
                kinetree(program, "evaluate", file.name)
            except Rejected:
                absent.append(name)
    return absent


def compare(seed, program, without=(), keep=None, mutate=None):
    """(seed, worst by quantity, why near-singular, what went wrong)."""
    scene, comparison = None, None
    try:
        scene = random_scene(seed, without)
        comparison = Comparison(scene, program, mutate)
        comparison.run()
        fault = None
    except Rejected as rejected:
        fault = str(rejected)
    except subprocess.TimeoutExpired:
        fault = "does not end"
    worst = comparison.worst if comparison else {}
    if comparison and comparison.near and not fault:
        return seed, {}, comparison.near, None
    if fault is None and any(not ratio <= 1.0 for _, ratio in worst.values()):
        fault = ", ".join(f"{name} {error:.2e}" for name, (error, ratio) in worst.items() if not ratio <= 1.0)
    if fault and keep:
        pathlib.Path(keep).mkdir(exist_ok=True)
        (pathlib.Path(keep) / f"seed-{seed}.yaml").write_text(document(scene))
    return seed, worst, None, fault


def work(arguments):
    return compare(*arguments)


def blind(program, without, mutation):
    """Seeds whose comparison does not notice an answer of the oracle's that is multiplied so."""
    results = [compare(seed, program, without, None, mutation) for seed in range(1000, 1005)]
    return [f"seed {seed} agrees" for seed, _, why, fault in results if not fault and not why]


def main():
    parser = argparse.ArgumentParser(description="Random mechanisms against an oracle in absolute coordinates.")
    parser.add_argument("--seeds", default="0:300", help="FIRST:END (default 0:300)")
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--keep", help="a directory for the scenes that fail")
    parser.add_argument("program", metavar="KINETREE")
    options = parser.parse_args()
    first, end = map(int, options.seeds.split(":"))
    without = missing(options.program)
    if without:
        note(f"left out, as this command does not read them: {', '.join(without)}")
    tasks = [(seed, options.program, without, options.keep) for seed in range(first, end)]
    if options.jobs > 1:
        import multiprocessing

        with multiprocessing.Pool(options.jobs) as pool:
            results = pool.map(work, tasks, chunksize=4)
    else:
        results = map(work, tasks)
    worst, near, faults, count = {}, [], [], 0
    for seed, ratios, why, fault in results:
        count += 1
        near += [f"seed {seed}: {why}"] if why else []
        faults += [f"seed {seed}: {fault}"] if fault else []
        if fault:
            print(faults[-1], file=sys.stderr, flush=True)
        for name, (error, ratio) in ratios.items():
            if not ratio <= worst.get(name, (0.0, -1.0, 0))[1]:
                worst[name] = (error, ratio, seed)
    for name, bound in BOUNDS.items():
        if name in ("applied force", "equations of motion") and name not in worst:
            note(f"{name}: this command does not print it")
            continue
        error, ratio, seed = worst.get(name, (float("nan"), float("nan"), None))
        note(f"{name:18} observed {error:9.2e}, bound {bound:.0e}, ratio {ratio:.1e}, seed {seed}")
        claim(f"{name.replace(' ', '_')}_agrees_with_absolute_coordinates", [] if ratio <= 1.0 else [f"observed {error:.3e} of bound {bound:.0e}"])
    claim("no_mechanism_differs_or_is_rejected", faults)
    claim("a_flipped_sign_is_noticed", blind(options.program, without, -1.0))
    claim("an_answer_that_is_not_a_number_is_noticed", blind(options.program, without, float("nan")))
    share = 1.0 - len(near) / max(count, 1)
    claim("compared_share_is_at_least_0.8", [] if share >= 0.8 else near)
    for line in near:
        note(f"not compared: {line}")
    note(f"{count} mechanisms, {share:.3f} of them compared, the others near singular positions")
    finish()


if __name__ == "__main__":
    main()
