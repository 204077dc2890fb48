"""Random scenes of fixed seeds. A mechanism is closed by construction: its configuration is chosen first, and every loop's
second end is then set where the first asks for it; velocities are projected onto what the loops allow."""
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np

from draw import Draw
from effects import Load
from equations import Mechanism, State
from parts import AXES, axis_of, turn, unit


def number(value):
    return repr(float(value)) if isinstance(value, (float, np.floating)) else str(value)


def text(value):
    """A scene in YAML's flow style."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{k}: {text(v)}" for k, v in value.items()) + "}"
    if isinstance(value, (list, tuple, np.ndarray)):
        return "[" + ", ".join(map(text, value)) + "]"
    return number(value)


def document(scene):
    lines = []
    for key, value in scene.items():
        if key == "disturbed":
            continue
        if key in ("bodies", "loops", "effects"):
            lines += [f"{key}:"] + [f"  - {text(item)}" for item in value]
        else:
            lines.append(f"{key}: {text(value)}")
    return "\n".join(lines) + "\n"


class Maker(Draw):
    """A scene as it grows."""

    def __init__(self, seed, without=()):
        self.without = without
        super().__init__(seed)
        self.seed, self.bodies, self.loops, self.effects = seed, [], [], []

    # Bodies

    def shape(self):
        at = {"at": self.place(0.3)} if self.chance(0.5) else {}
        at.update({"rotation": self.any_rotation()} if self.chance(0.4) else {})
        r, length = self.between(0.05, 0.2), self.between(0.2, 0.8)
        return self.pick([
            {"type": "rod", "to": self.place(0.6) + [0.3, 0, 0], **({"from": self.place(0.2) - [0.4, 0, 0]} if self.chance(0.5) else {}), "radius": r},
            {"type": "box", "size": self.rng.uniform(0.1, 0.6, 3), **at}, {"type": "sphere", "radius": r, **at},
            {"type": "rod", "to": self.place(0.6) + [0.3, 0, 0]}, {"type": "point", "at": self.place(0.3) + [0.3, 0, 0]},
            {"type": "cylinder", "radius": r, "length": length, **({"axis": self.axis()} if self.chance(0.5) else {}), **at},
        ])  # fmt: skip

    def mass(self, body):
        body["mass"] = self.between(0.3, 3.0)
        if self.chance(0.5):
            body["shape"] = self.shape()
            if self.chance(0.3):
                body["com"] = self.vector(0.3)
            return
        body["com"] = self.vector(0.3)
        x, y, z = self.rng.uniform(0.005, 0.1, 3)
        I = np.diag([y + z, x + z, x + y]) * body["mass"]
        if self.chance(0.5):
            R = turn(self.vector(1.0), self.between(0, 3))
            I = R @ I @ R.T
            body["inertia"] = [I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[0, 2], I[1, 2]]
        else:
            body["inertia"] = list(np.diag(I))

    def joint(self, floating):
        kinds = {"revolute": 5, "prismatic": 2, "planar": 1, "fixed": 0.4} if self.planar else {
            "revolute": 5, "prismatic": 2, "screw": 1.5, "cylindrical": 1.5, "planar": 1, "universal": 2, "spherical": 2, "free": 1, "fixed": 0.4}  # fmt: skip
        kind = floating or self.pick(list(kinds), list(kinds.values()))
        joint, q, u = {"type": kind}, self.rng.uniform(-1.2, 1.2, 3), self.rng.uniform(-1.5, 1.5, 6)
        if kind not in ("fixed", "spherical", "free", "planar"):
            joint["axis"] = self.pick(["x", "y"]) if self.planar and kind == "prismatic" else self.axis()
        if kind == "planar":
            joint["axis"] = "z" if self.planar else self.pick(["x", "y", "z"])
        if kind == "universal" and (not isinstance(joint["axis"], str) or self.chance(0.4)):
            joint["axis2"] = np.cross(axis_of(joint["axis"]), self.vector(1.0))
        if kind == "screw":
            joint["pitch"] = self.between(-0.3, 0.3)
        if self.chance(0.8):
            joint["at"] = self.place(0.6)
        if self.chance(0.4):
            joint["rotation"] = self.any_rotation()
        if kind in ("revolute", "prismatic", "screw"):
            joint.update(position=self.angle(q[0]) if kind != "prismatic" else float(q[0]), velocity=float(u[0]))
        elif kind in ("cylindrical", "universal"):
            joint.update(position=[float(x) for x in q[:2]], velocity=u[:2])
        elif kind == "planar":
            joint.update(position=[float(x) for x in q], velocity=u[:3])
        elif kind in ("spherical", "free"):
            x = self.rng.normal(size=4)
            x /= np.linalg.norm(x)
            position = x if kind == "spherical" else {"position": q, "orientation": {"quaternion": x}}
            joint.update(position=position, velocity=u[:3] if kind == "spherical" else {"linear": u[:3], "angular": u[3:]})
        geared, armature = self.chance(0.2), self.between(0.01, 0.3)
        if geared and kind != "fixed" and "armature" not in self.without:
            joint["armature"] = armature
        return joint

    def tree(self, count):
        for k in range(count):
            body = {"name": f"b{k}"}
            if k and self.chance(0.75):
                body["parent"] = f"b{self.rng.randint(max(k - 2, 0), k)}"
            body["joint"] = self.joint(None)
            self.mass(body)
            if self.chance(0.7):
                body["markers"] = {"m": self.place(0.5), "n": self.place(0.5)}
            self.bodies.append(body)

    def solidify(self):
        """Points and slender rods that leave a motion without inertia become bodies that have some."""
        solid = {"mass": 1.0, "com": [0.1, 0.2, 0.0], "inertia": [0.1, 0.12, 0.15]}
        for body in self.bodies:
            if self.inertia() < 1e-3:
                body.pop("shape", None)
                body.update(solid)

    def lighten(self):
        """Some bodies that carry others lose their mass, where what moves keeps inertia."""
        self.solidify()
        for body in self.bodies:
            if self.chance(0.1):
                kept = {k: body.pop(k) for k in ("mass", "com", "inertia", "shape") if k in body}
                if self.inertia() < 1e-3:
                    body.update(kept)

    def inertia(self):
        m = Mechanism({**self.scene(), "loops": []})
        state = State(m, m.q, m.u, 0.0)
        state.dynamics(Load(state, {}).sums())
        return state.stiff

    def disturb(self):
        """Positions and velocities that the assembly must mend, and a joint that it must keep."""
        m = Mechanism(self.scene())
        state = State(m, m.q, m.u, 0.0)
        state.factor()
        driven = {n for x in self.loops if x["type"] in ("motion", "coupling") for n in ([x["joint"]] if "joint" in x else x["coefficients"])}
        held = None
        for body in self.scalars():
            k = m.bodies[m.index[body["name"]]].at_x
            if held is None and body["name"] not in driven and np.linalg.norm(state.N[k]) > 0.1 and self.chance(0.7):
                held = body["name"]
            elif not isinstance(body["joint"]["position"], str):
                body["joint"]["position"] += self.between(-0.02, 0.02)
                body["joint"]["velocity"] += self.between(-0.2, 0.2)
        return [held] if held else []

    def scene(self):
        scene = {"kinetree": 1, "name": f"seed {self.seed}"}
        if self.chance(0.85):
            scene["gravity"] = [0.0, -9.81, 0.0] if self.planar else self.vector(9.0)
        scene["bodies"] = self.bodies
        scene.update({k: v for k, v in (("loops", self.loops), ("effects", self.effects)) if v})
        return scene

    def scalars(self):
        return [b for b in self.bodies if b["joint"]["type"] in ("revolute", "prismatic", "screw")]

    # Ends

    def end(self, name, turned=True):
        """An end on a body, in one of its forms."""
        body = next((b for b in self.bodies if b["name"] == name), {})
        if "markers" in body and self.chance(0.4):
            marker = self.pick(list(body["markers"]))
            return f"{name}.{marker}" if self.chance(0.6) or not turned else {"body": name, "marker": marker, "rotation": self.any_rotation()}
        if self.chance(0.15):
            return name
        return {"body": name, "at": self.place(0.6), **({"rotation": self.any_rotation()} if turned and self.chance(0.5) else {})}

    def facing(self, name, pose, turned):
        """The end of a body that lies at a pose of the world."""
        mechanism = Mechanism(self.scene())
        R, r = (np.eye(3), np.zeros(3)) if name == "world" else mechanism.poses(mechanism.q)[mechanism.index[name]]
        at = R.T @ (pose[1] - r)
        if not turned and name != "world" and self.chance(0.4):
            body = next(b for b in self.bodies if b["name"] == name)
            body.setdefault("markers", {})[f"e{len(self.loops)}"] = at
            return f"{name}.e{len(self.loops)}"
        return {"body": name, "at": at, **({"rotation": self.form_of(R.T @ pose[0])} if turned else {})}

    def two(self):
        """Two bodies, or one and the world, between which something moves."""
        names = [b["name"] for b in self.bodies]
        for _ in range(20):
            a, b = self.pick(names), self.pick(names + ["world", "world"])
            if a != b and self.freedom(a, b) > 0:
                return (a, b) if self.chance(0.5) else (b, a)
        return None

    def freedom(self, a, b):
        def path(name):
            names = []
            while name != "world":
                body = next(x for x in self.bodies if x["name"] == name)
                names.append(name)
                name = body.get("parent", "world")
            return set(names)

        m = Mechanism({**self.scene(), "loops": []})
        return sum(m.bodies[m.index[n]].joint.size for n in path(a) ^ path(b))

    # Loops

    def closure(self, kind):
        pair = self.two()
        if pair is None:
            return None
        a, b = pair
        axis = "z" if self.planar else (None if self.chance(0.2) else self.axis())
        axis = self.pick(["x", "y"]) if self.planar and kind in ("inplane", "inline", "prismatic") else axis
        n, D, d = axis_of(axis), np.eye(3), np.zeros(3)
        loop = {"name": f"l{len(self.loops)}", "type": kind, **({"axis": axis} if axis is not None and kind not in ("spherical", "distance", "parallel", "weld") else {})}
        if kind in ("spherical", "inline", "inplane", "distance"):
            D = self.matrix()
        if kind in ("coaxial", "revolute", "screw", "cylindrical", "planar"):
            D = turn(n, self.between(-2, 2))
        if kind in ("orthogonal", "universal"):
            loop["axis2"] = self.pick(list(AXES)) if self.chance(0.5) else self.vector(1.0)  # the contract has no default for it
            n2 = axis_of(loop["axis2"])
            D = self.turned_onto(n2, unit(np.cross(n, self.vector(1.0)))) @ turn(n2, self.between(-2, 2))
        if kind in ("inline", "prismatic", "cylindrical"):
            d = n * self.between(-0.5, 0.5)
        if kind in ("inplane", "planar"):
            d = self.place(0.5)
            d = d - n * (n @ d)
        if kind in ("distance", "parallel", "coaxial", "orthogonal"):
            d = self.place(0.6) + [0.3, 0.3, 0.0]
        if kind == "screw":
            loop["pitch"] = self.between(-0.3, 0.3)
        if kind == "distance" and self.chance(0.6):
            length = float(np.linalg.norm(d))
            loop["length"] = length if self.chance(0.3) else self.function(length, 0.2 * length)
        mechanism, first = Mechanism(self.scene()), self.end(a)
        probe = Mechanism({**self.scene(), "loops": [{"name": "probe", "type": "spherical", "between": [first, "world"]}]})
        R, p = mechanism.end(probe.loops[0].ends[0], mechanism.poses(mechanism.q))
        second = self.facing(b, (R @ D, p + R @ d), kind not in ("spherical", "inline", "inplane", "distance"))
        loop["between"] = [first, second]
        return loop

    @staticmethod
    def turned_onto(a, b):
        c = np.cross(a, b)
        return np.eye(3) if np.linalg.norm(c) < 1e-9 else turn(c, math.atan2(np.linalg.norm(c), a @ b))

    def relation(self, kind):
        names = [b["name"] for b in self.scalars()]
        if len(names) < (1 if kind == "motion" else 2):
            return None
        m = Mechanism(self.scene())
        if kind == "motion":
            joint = self.pick(names)
            return {"name": f"l{len(self.loops)}", "type": "motion", "joint": joint, "position": self.function(float(m.q[m.index[joint]][0]))}
        chosen = self.rng.choice(names, min(len(names), int(self.rng.randint(2, 4))), replace=False)
        c = {str(n): self.between(0.3, 2.0) * self.pick([1, -1]) for n in chosen}
        offset = sum(v * m.q[m.index[n]][0] for n, v in c.items())
        return {"name": f"l{len(self.loops)}", "type": "coupling", "coefficients": c, "offset": float(offset)}

    def rolling(self):
        """A wheel on a free or planar frame, or a free wheel; its ground is placed under its lowest point."""
        self.planar, self.flat = False, np.ones(3)
        k = len(self.bodies)
        wheel = {"name": f"b{k}", "joint": self.joint("free")}
        self.mass(wheel)
        self.bodies.append(wheel)
        if self.chance(0.5):
            wheel = {"name": f"b{k + 1}", "parent": f"b{k}", "joint": self.joint("revolute")}
            self.mass(wheel)
            self.bodies.append(wheel)
        wheel["markers"] = {"hub": self.vector(0.2)}
        m = Mechanism(self.scene())
        axle, normal, _ = self.axis(), self.axis(), self.matrix()
        R, r = m.poses(m.q)[m.index[wheel["name"]]]
        a, radius = R @ axis_of(axle), self.between(0.1, 0.5)
        n = unit(np.cross(a, self.vector(1.0)) + self.between(-0.6, 0.6) * a)
        u = n - (n @ a) * a
        lowest = r + R @ wheel["markers"]["hub"] - radius * u / np.linalg.norm(u)
        E = self.turned_onto(axis_of(normal), n) @ turn(axis_of(normal), self.between(-2, 2))
        ground = self.pick([b["name"] for b in self.bodies[:k]]) if k and self.chance(0.3) else "world"
        at = lowest + np.cross(n, self.vector(0.5))
        loop = {"name": f"l{len(self.loops)}", "type": "rolling", "wheel": f"{wheel['name']}.hub", "axis": axle, "radius": radius,
                "on": self.facing(ground, (E, at), True), "normal": normal}  # fmt: skip
        if self.chance(0.2):
            loop["holonomic"] = False
        return loop

    def add_loops(self, wanted):
        kinds = ["spherical", "inline", "inplane", "distance", "parallel", "coaxial", "orthogonal", "revolute", "prismatic", "screw", "cylindrical",
                 "planar", "weld", "universal", "coupling", "motion"]  # fmt: skip
        if self.planar:
            kinds = ["revolute", "revolute", "spherical", "distance", "inplane", "cylindrical", "coaxial", "coupling", "motion", "planar", "inline"]
        for _ in range(12):
            if len(self.loops) >= wanted:
                return
            kind = self.pick(kinds)
            loop = self.relation(kind) if kind in ("coupling", "motion") else self.closure(kind)
            if loop is None:
                continue
            self.loops.append(loop)
            if self.chance(0.12):  # the same once more: every equation is redundant
                self.loops.append({**loop, "name": loop["name"] + "_again"})
            if not self.mobile():
                self.loops = [x for x in self.loops if not x["name"].startswith(loop["name"])]

    def mobile(self):
        """Whether something still moves, and every part of it has inertia."""
        m = Mechanism(self.scene())
        state = State(m, m.q, m.u, 0.0)
        state.dynamics(Load(state, {}).sums())
        driven = any(x["type"] == "motion" or isinstance(x.get("length"), dict) for x in self.loops)
        if any(m.start[x.name]["length"] < 0.1 for x in m.loops if x.type == "distance"):
            return False
        agree = state.solve(state.b)[1] < 1e-8 and state.solve(self.speeds(state))[1] < 1e-8
        return agree and (state.N.shape[1] > 0 or driven and self.chance(0.3)) and state.stiff > 1e-6 and state.gap > 1e-6

    @staticmethod
    def speeds(state):
        """The right-hand side of J (twists, rates) = b': less what phi' is for a mechanism at rest."""
        J, rates = state.J, state.rates()
        b = J @ rates
        for rows, velocity in zip(state.loop_rows, state.velocity):
            b[rows] -= velocity
        return b

    def project(self):
        """Rates that all loops allow, next to those chosen."""
        m = Mechanism(self.scene())
        state = State(m, m.q, m.u, 0.0)
        state.factor()
        x = state.rates()
        x = x - state.solve(state.J @ x - self.speeds(state))[0]
        for body, part in zip(self.bodies, m.bodies):
            u, joint = x[part.at_x], body["joint"]
            if joint["type"] == "free":
                joint["velocity"] = {"linear": u[:3], "angular": u[3:]}
            elif joint["type"] != "fixed":
                joint["velocity"] = float(u[0]) if part.joint.scalar else u

    # Effects

    def pair(self, turned):
        """Two ends apart from each other, turned by no more than an angle: a bushing's moment jumps at half a turn."""
        for _ in range(20):
            names = [b["name"] for b in self.bodies]
            ends = [self.end(self.pick(names)), self.end(self.pick(names + ["world"]))]
            m = Mechanism({**self.scene(), "loops": [{"name": "probe", "type": "spherical", "between": ends}]})
            (P, p), (R, r) = (m.end(e, m.poses(m.q)) for e in m.loops[0].ends)
            if 0.5 * (np.trace(P.T @ R) - 1.0) < math.cos(turned) - 1e-9:
                continue
            if m.loops[0].ends[0].body != m.loops[0].ends[1].body and np.linalg.norm(p - r) > 0.3:
                return ends
        return None

    def rest(self):
        f, number = self.function(), self.between(-1, 1)
        return f if self.chance(0.5) and "rest" not in self.without else number

    def effect(self, kind):
        spec, name = {"type": kind}, self.pick(self.bodies)["name"]
        if kind in ("spring", "attraction", "bushing"):
            spec["between"] = self.pair(2.0 if kind == "bushing" else math.pi)
            if spec["between"] is None:
                return None
            k = self.between(5, 60)
            if kind == "attraction":
                return {**spec, "strength": self.between(0.2, 2)}
            if kind == "bushing":
                return {**spec, "stiffness": self.rng.uniform(1, 30, 6), "damping": self.rng.uniform(0, 2, 6)}
            spec["stiffness"] = k
            spec.update({"length": self.between(0, 1)} if self.chance(0.6) else {})
            spec.update({"damping": self.between(0, 2)} if self.chance(0.6) else {})
            return spec
        if kind in ("force", "torque", "drag"):
            if kind == "drag":
                on = {"on": name, "at": self.vector(0.3)} if self.chance(0.5) else {"on": name}
                body = next(b for b in self.bodies if b["name"] == name)
                on = {"on": f"{name}.{self.pick(list(body['markers']))}"} if "markers" in body and self.chance(0.5) else on
                return {**spec, **on, "linear": self.between(0, 2), "quadratic": self.between(0, 2)}
            value = [self.function(size=3.0) if self.chance(0.4) else float(x) for x in self.vector(5.0)]
            spec["at" if kind == "force" else "on"] = self.end(name, turned=False) if kind == "force" else name
            return {**spec, "value": value, **({"frame": self.pick(["body", "world"])} if self.chance(0.7) else {})}
        if kind == "contact":
            return self.contact(spec, name)
        names = self.scalars()
        if not names:
            return None
        joint = self.pick(names)["name"]
        m = Mechanism(self.scene())
        q = float(m.q[m.index[joint]][0])
        return {**spec, "joint": joint, **{
            "joint_spring": lambda: {"stiffness": self.between(1, 30), "rest": self.rest(), "damping": self.between(0, 2)},
            "joint_damper": lambda: {"damping": self.between(0, 3)},
            "joint_friction": lambda: {"coulomb": self.between(0, 2), "viscous": self.between(0, 1), "static": self.between(2, 3), "stribeck": self.between(0.5, 2), "smoothing": self.between(0.5, 1)},
            "joint_limit": lambda: self.pick([{"lower": q - 2.0, "upper": q - 0.7}, {"lower": q + 0.6, "upper": q + 2.0}, {"lower": q - 2.0, "upper": q + 2.0}]) | {"stiffness": self.between(1, 20), "damping": self.between(0, 1)},
            "motor": lambda: {"torque": self.function(size=3.0) if self.chance(0.7) else self.between(-3, 3)},
            "servo": lambda: {"target": self.function() if self.chance(0.7) else self.between(-1, 1), "stiffness": self.between(1, 20), "damping": self.between(0, 2), **({"limit": self.pick([0.01, 500.0])} if self.chance(0.4) else {})},
        }[kind]()}  # fmt: skip

    def contact(self, spec, name):
        """A sphere 0.05 deep in its plane, or clear of it."""
        body = next(b for b in self.bodies if b["name"] == name)
        body.setdefault("markers", {}).setdefault("m", self.vector(0.3))
        m = Mechanism(self.scene())
        R, r = m.poses(m.q)[m.index[name]]
        radius, n = self.between(0.1, 0.3), unit(self.vector(1.0))
        axis = "z" if self.chance(0.3) else self.axis()
        E = self.turned_onto(axis_of(axis), n)
        at = r + R @ np.array(body["markers"]["m"]) - n * (radius - (0.05 if self.chance(0.8) else -1.0)) + np.cross(n, self.vector(0.3))
        ground = self.pick([b["name"] for b in self.bodies] + ["world", "world"])
        ground = "world" if ground == name else ground
        return {**spec, "point": f"{name}.m", "radius": radius, "plane": self.facing(ground, (E, at), True), "axis": axis,
                "stiffness": self.between(200, 1000), "exponent": self.pick([1.5, 2.0]), "dissipation": self.between(0, 0.1), "friction": self.between(0, 0.6), "slip": self.between(0.3, 0.6)}  # fmt: skip


EFFECTS = ["spring", "joint_spring", "joint_damper", "joint_friction", "joint_limit", "bushing", "motor", "servo", "force", "torque", "drag", "attraction", "contact"]


def random_scene(seed, without=()):
    """The scene of a seed, always the same, less what a command does not read."""
    maker = Maker(seed, without)
    if maker.chance(0.12):
        if maker.chance(0.4):
            maker.tree(1)
        loop = maker.rolling()
        maker.loops.append(loop)
        if not maker.mobile():
            maker.loops.clear()
            maker.solidify()
    else:
        maker.tree(int(maker.rng.randint(1, 7)))
        maker.lighten()
    if maker.chance(0.75):
        maker.add_loops(int(maker.rng.randint(1, 4)))
    for _ in range(int(maker.rng.randint(0, 4))):
        effect = maker.effect(maker.pick(EFFECTS))
        if effect and effect["type"] not in without:
            maker.effects.append(effect)
    maker.project()
    held = maker.disturb() if maker.loops and all(x["type"] != "screw" for x in maker.loops) and maker.chance(0.2) else None
    scene = maker.scene()
    if held:
        scene["initial"] = {"hold": held}
    scene["disturbed"] = held is not None
    scene["simulate"] = {"duration": 0.08, "integrator": maker.pick(["dop853", "dopri5", "tsit5"], [3, 1, 1]), "tolerance": 1e-12}
    for key, values, share in (("formulation", ["absolute"], 0.1), ("reduction", ["partition", "svd"], 0.3), ("metric", ["mass"], 0.2), ("plan", ["spatial"], 0.2)):
        if maker.chance(share):
            scene["simulate"][key] = maker.pick(values)
    if any("armature" in b["joint"] for b in scene["bodies"] if "joint" in b):
        scene["simulate"].pop("formulation", None)  # bodies without joints have no rotors: it is an error
    markers = [f"{b['name']}.{k}" for b in scene["bodies"] for k in b.get("markers", {})]
    record = ["position", "velocity", "acceleration", "energy", "constraint", "reaction", "balance"]
    scene["output"] = {"interval": 0.01, "record": record, **({"markers": markers} if markers else {})}
    return scene
