"""SDF read once more, from its specification alone: frames as a graph of poses, links with world coordinates, joints as screws.

Shares nothing with the library: a frame's pose is found by a walk with a memory, mechanisms are computed in absolute coordinates
(six for a link), constraints are what a joint's motions leave over, eliminated by Gauss with full pivoting. Plain Python.
"""
# SPDX-License-Identifier: Apache-2.0
import math
import pathlib
import xml.etree.ElementTree as ET


# ---- vectors and matrices: lists ---------------------------------------------------------------------------------------------

def mul(a, b):
    return [[sum(x * y for x, y in zip(row, column)) for column in zip(*b)] for row in a]


def apply(a, v):
    return [sum(x * y for x, y in zip(row, v)) for row in a]


def turned(a):
    return [list(row) for row in zip(*a)]


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def cross(a, b):
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def add(a, b, factor=1.0):
    return [x + factor * y for x, y in zip(a, b)]


def unit(v):
    n = math.sqrt(dot(v, v))
    return [x / n for x in v]


EYE = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]


def about(axis, angle):
    """Rodrigues."""
    c, s, (x, y, z) = math.cos(angle), math.sin(angle), unit(axis)
    return [[c + x * x * (1 - c), x * y * (1 - c) - z * s, x * z * (1 - c) + y * s],
            [y * x * (1 - c) + z * s, c + y * y * (1 - c), y * z * (1 - c) - x * s],
            [z * x * (1 - c) - y * s, z * y * (1 - c) + x * s, c + z * z * (1 - c)]]


def compose(a, b):
    return mul(a[0], b[0]), add(a[1], apply(a[0], b[1]))


def invert(a):
    r = turned(a[0])
    return r, [-x for x in apply(r, a[1])]


def null_space(rows, n):
    """Vectors that all rows are normal to."""
    rows = [list(r) for r in rows]
    order, rank = list(range(n)), 0
    while rank < len(rows) and rank < n:
        size, i, j = max(((abs(rows[i][j]), i, j) for i in range(rank, len(rows)) for j in range(rank, n)), key=lambda t: t[0])
        if size < 1e-9:
            break
        rows[rank], rows[i] = rows[i], rows[rank]
        for row in rows:
            row[rank], row[j] = row[j], row[rank]
        order[rank], order[j] = order[j], order[rank]
        pivot = rows[rank]
        for i, row in enumerate(rows):
            if i != rank and row[rank] != 0.0:
                f = row[rank] / pivot[rank]
                rows[i] = [x - f * y for x, y in zip(row, pivot)]
        rank += 1
    basis = []
    for free in range(rank, n):
        v = [0.0] * n
        v[order[free]] = 1.0
        for i in range(rank):
            v[order[i]] = -rows[i][free] / rows[i][i]
        basis.append(v)
    return basis


def solve(a, b):
    a = [list(row) + [x] for row, x in zip(a, b)]
    for k in range(len(a)):
        p = max(range(k, len(a)), key=lambda i: abs(a[i][k]))
        a[k], a[p] = a[p], a[k]
        for i in range(len(a)):
            if i != k:
                f = a[i][k] / a[k][k]
                a[i] = [x - f * y for x, y in zip(a[i], a[k])]
    return [row[-1] / row[k] for k, row in enumerate(a)]


# ---- reading -----------------------------------------------------------------------------------------------------------------

def floats(text):
    return [float(x) for x in (text or "").split()]


def pose_of(e):
    if e is None or not (e.text or "").strip():
        return EYE, [0.0, 0.0, 0.0]
    v = floats(e.text)
    if e.get("rotation_format") == "quat_xyzw":
        x, y, z, w = (c / math.sqrt(dot(v[3:], v[3:])) for c in v[3:])
        angle = 2 * math.atan2(math.sqrt(x * x + y * y + z * z), w)
        return (about([x, y, z], angle) if angle else EYE), v[:3]
    k = math.pi / 180 if e.get("degrees") in ("true", "1") else 1.0
    r, p, y = (k * a for a in v[3:])
    return mul(about([0, 0, 1], y), mul(about([0, 1, 0], p), about([1, 0, 0], r))), v[:3]


class Frame:
    def __init__(self, kind, element, scope, home, version):
        self.kind, self.element, self.scope, self.home, self.version = kind, element, scope, home, version
        self.name = element.get("name") if element is not None else "world"
        self.inner, self.placed, self.static = {}, None, bool(home and home.static)
        self.pose_element = element.find("pose") if element is not None else None
        self.memory = None

    def path(self, root):
        parts, at = [self.name], self.scope
        while at is not None and at is not root and at.kind != "world":
            parts.insert(0, at.name)
            at = at.scope
        return "__".join(parts)


class Reading:
    """Links with mass, joints with screws, all in the world at joint positions of zero."""

    def __init__(self, file):
        self.folder = pathlib.Path(file).parent
        root = ET.parse(file).getroot()
        version = tuple(int(x) for x in root.get("version").split("."))
        self.world = Frame("world", None, None, None, version)
        self.frames = []
        world = root.find("world")
        if world is not None:
            self.children(world, self.world, self.world, version)
            self.root = self.world
        else:
            self.root = self.model(root.find("model"), self.world, self.world, version)
        gravity = [world.find("gravity"), world.find("physics/gravity")] if world is not None else []
        self.gravity = next((floats(g.text) for g in gravity if g is not None), [0.0, 0.0, -9.8])
        self.links = [f for f in self.frames if f.kind == "link"]
        for f in self.links:
            f.number = self.links.index(f)
            self.weigh(f)
        self.joints = [self.joint(f) for f in self.frames if f.kind == "joint"]

    def put(self, kind, e, scope, home, version, name=None):
        f = Frame(kind, e, scope, home, version)
        f.name = name or f.name
        scope.inner[f.name] = f
        self.frames.append(f)
        return f

    def model(self, e, scope, home, version, include=None):
        f = self.put("model", e, scope, home, version, include.findtext("name") if include is not None else None)
        f.placed = e.get("placement_frame")
        f.static = f.static or e.findtext("static") in ("true", "1")
        if include is not None:
            f.pose_element = include.find("pose") if include.find("pose") is not None else f.pose_element
            f.placed = include.findtext("placement_frame") or f.placed
        self.children(e, f, f, version)
        return f

    def children(self, e, scope, home, version):
        for child in e:
            if child.tag in ("link", "joint", "frame"):
                self.put(child.tag, child, scope, home, version)
            elif child.tag == "model":
                self.model(child, scope, home, version)
            elif child.tag == "include":
                self.include(child, scope, home)

    def include(self, e, scope, home):
        path = self.folder / e.findtext("uri").strip().removeprefix("model://")
        if path.is_dir():
            config = path / "model.config"
            names = {tuple(int(x) for x in s.get("version").split(".")): s.text
                     for s in ET.parse(config).getroot().findall("sdf")} if config.exists() else {(1, 0): "model.sdf"}
            path = path / names[max(names)]
        if not path.exists():
            return
        root = ET.parse(path).getroot()
        version, model = tuple(int(x) for x in root.get("version").split(".")), root.find("model")
        if e.get("merge") not in ("true", "1"):
            self.model(model, scope, home, version, e)
            return
        f = self.put("frame", model, scope, home, version, "_merged__%s__model__" % model.get("name"))
        f.pose_element = e.find("pose")
        self.children(model, scope, f, version)

    # ---- names and poses

    def find(self, f, name):
        if name == "__model__":
            return f.home
        at = f.scope
        if name not in at.inner and name == "world":
            return self.world
        if name in at.inner:
            return at.inner[name]
        for part in name.split("::"):
            at = at.inner[part]
        return at

    def base(self, f, pose=None):
        pose = pose if pose is not None else f.pose_element
        name = pose.get("relative_to") or (pose.get("frame") if f.version < (1, 7) else None) if pose is not None else None
        if name:
            return self.find(f, name)
        if f.kind == "joint":
            return self.find(f, f.element.findtext("child").strip())
        if f.kind == "frame" and f.element.get("attached_to"):
            return self.find(f, f.element.get("attached_to"))
        return f.home

    def at(self, f):
        """The pose in the world."""
        if f is self.world:
            return EYE, [0.0, 0.0, 0.0]
        if f.memory is None:
            pose = compose(self.at(self.base(f)), pose_of(f.pose_element))
            if f.placed:
                f.memory = EYE, [0.0, 0.0, 0.0]
                inner = f
                for part in f.placed.split("::"):
                    inner = inner.inner[part]
                pose = compose(pose, invert(self.at(inner)))
                for other in self.frames:  # what has been found while this one was at the origin
                    other.memory = None
            f.memory = pose
        return f.memory

    def link_of(self, f):
        while f.kind not in ("link", "world"):
            if f.kind == "joint":
                f = self.find(f, f.element.findtext("child").strip())
            elif f.kind == "frame":
                name = f.element.get("attached_to")
                f = self.find(f, name) if name else f.home
            else:
                name = f.element.get("canonical_link")
                links = [x for x in f.inner.values() if x.kind == "link"] + [x for x in f.inner.values() if x.kind == "model"]
                found = links[0]
                if name:
                    found = f
                    for part in name.split("::"):
                        found = found.inner[part]
                f = found
        return None if f.kind == "world" or f.static else f

    # ---- what links and joints are

    def weigh(self, f):
        """Mass, centre and inertia about it, in the link's axes."""
        e = f.element.find("inertial")
        if e is not None and e.get("auto") in ("true", "1"):
            parts = [self.collision(f, c, e) for c in f.element.findall("collision")]
        else:
            value = {k: float(e.findtext("inertia/" + k, v)) if e is not None else float(v)
                     for k, v in (("ixx", 1), ("iyy", 1), ("izz", 1), ("ixy", 0), ("ixz", 0), ("iyz", 0))}
            own = [[value["ixx"], value["ixy"], value["ixz"]], [value["ixy"], value["iyy"], value["iyz"]],
                   [value["ixz"], value["iyz"], value["izz"]]]
            r, p = pose_of(e.find("pose") if e is not None else None)
            parts = [(float(e.findtext("mass", "1")) if e is not None else 1.0, p, mul(mul(r, own), turned(r)))]
        f.mass = sum(m for m, _, _ in parts)
        f.com = [sum(m * p[k] for m, p, _ in parts) / f.mass for k in range(3)]
        f.inertia = [[0.0] * 3 for _ in range(3)]
        for m, p, own in parts:
            d = add(p, f.com, -1.0)
            for i in range(3):
                for j in range(3):
                    f.inertia[i][j] += own[i][j] + m * ((dot(d, d) if i == j else 0.0) - d[i] * d[j])

    def collision(self, f, e, inertial):
        """A solid as a heap of thin slices along z would be summed: closed forms of textbooks."""
        density = float(e.findtext("density", inertial.findtext("density", "1000")))
        r, p = pose_of(e.find("pose"))
        g = e.find("geometry")[0]
        if g.tag == "box":
            x, y, z = floats(g.findtext("size"))
            m, d, low = density * x * y * z, [(y * y + z * z) / 12, (x * x + z * z) / 12, (x * x + y * y) / 12], 0.0
        elif g.tag == "ellipsoid":
            x, y, z = floats(g.findtext("radii"))
            m, d, low = density * 4 / 3 * math.pi * x * y * z, [(y * y + z * z) / 5, (x * x + z * z) / 5, (x * x + y * y) / 5], 0.0
        elif g.tag == "sphere":
            a = float(g.findtext("radius"))
            m, d, low = density * 4 / 3 * math.pi * a ** 3, [0.4 * a * a] * 3, 0.0
        else:
            a, h = float(g.findtext("radius")), float(g.findtext("length"))
            m, d, low = self.slices(g.tag, density, a, h)
        own = [[m * d[i] if i == j else 0.0 for j in range(3)] for i in range(3)]
        return m, add(p, apply(r, [0.0, 0.0, low])), mul(mul(r, own), turned(r))

    @staticmethod
    def slices(kind, density, a, h):
        """Integrals over z of a body of revolution with radius rho(z), by Gauss-Legendre on pieces where it is a polynomial squared."""
        if kind == "cylinder":
            pieces = [(-h / 2, h / 2, lambda z: a * a)]
        elif kind == "cone":
            pieces = [(-h / 2, h / 2, lambda z: (a * (0.5 - z / h)) ** 2)]
        else:
            pieces = [(-h / 2 - a, -h / 2, lambda z: a * a - (z + h / 2) ** 2), (-h / 2, h / 2, lambda z: a * a),
                      (h / 2, h / 2 + a, lambda z: a * a - (z - h / 2) ** 2)]
        nodes = [(-math.sqrt(5 + 2 * math.sqrt(10 / 7)) / 3, (322 - 13 * math.sqrt(70)) / 900),
                 (-math.sqrt(5 - 2 * math.sqrt(10 / 7)) / 3, (322 + 13 * math.sqrt(70)) / 900), (0.0, 128 / 225),
                 (math.sqrt(5 - 2 * math.sqrt(10 / 7)) / 3, (322 + 13 * math.sqrt(70)) / 900),
                 (math.sqrt(5 + 2 * math.sqrt(10 / 7)) / 3, (322 - 13 * math.sqrt(70)) / 900)]
        m = first = second = round_ = 0.0
        for low, high, square in pieces:
            for x, w in nodes:
                z, w = (low + high) / 2 + x * (high - low) / 2, w * (high - low) / 2
                area = density * math.pi * square(z) * w
                m, first, second, round_ = m + area, first + area * z, second + area * z * z, round_ + area * square(z) / 4
        centre = first / m
        across = (round_ + second - m * centre * centre) / m
        return m, [across, across, 2 * round_ / m], centre

    def joint(self, f):
        e, kind = f.element, f.element.get("type")
        f.parent, f.child = (self.link_of(self.find(f, e.findtext(k).strip())) for k in ("parent", "child"))
        f.point = self.at(f)[1]
        axes = []
        for tag in ("axis", "axis2"):
            a = e.find(tag)
            xyz = a.find("xyz") if a is not None else None
            frame = f
            if f.version < (1, 7) and a is not None:
                if a.findtext("use_parent_model_frame", "1" if f.version < (1, 5) else "0") in ("1", "true"):
                    frame = f.home
            elif xyz is not None and xyz.get("expressed_in"):
                frame = self.find(f, xyz.get("expressed_in"))
            axes.append(unit(apply(self.at(frame)[0], floats(xyz.text) if xyz is not None else [0.0, 0.0, 1.0])))
        pitch = 0.0
        if kind == "screw":
            pitch = (-1.0 / float(e.findtext("thread_pitch")) if e.find("thread_pitch") is not None
                     else float(e.findtext("screw_thread_pitch", "1")) / (2 * math.pi))
        turn, slide = (lambda u: (u, [0.0] * 3)), (lambda u: ([0.0] * 3, u))
        f.axes = axes
        f.motions = {"fixed": [], "revolute": [turn(axes[0])], "continuous": [turn(axes[0])], "prismatic": [slide(axes[0])],
                     "screw": [(axes[0], [pitch * x for x in axes[0]])], "ball": [turn(x) for x in EYE],
                     "universal": [turn(axes[0]), turn(axes[1])], "revolute2": [turn(axes[0]), turn(axes[1])],
                     "piston": [turn(axes[0]), slide(axes[0])]}.get(kind)
        f.dynamics = [e.find("axis/dynamics"), (e.find("axis") if kind == "piston" else e.find("axis2"))]
        f.dynamics[1] = f.dynamics[1].find("dynamics") if f.dynamics[1] is not None and kind != "piston" else None
        f.mimics = [e.find("axis/mimic"), e.find("axis2/mimic")]
        return f


class Motion:
    """A reading at joint positions: links as they stand, and their accelerations from rest."""

    def __init__(self, reading, q, root):
        """q: positions by (joint, number of its motion). root: the link that is free, or None: all are reached from the world."""
        self.r = reading
        self.move = {None: (EYE, [0.0, 0.0, 0.0])}
        for f in reading.links:
            if f.static or f in root:
                self.move[f] = EYE, [0.0, 0.0, 0.0]
        todo = True
        while todo:
            todo = False
            for j in reading.joints:
                if j.motions is None or (j.parent in self.move) == (j.child in self.move):
                    continue
                t = EYE, [0.0, 0.0, 0.0]
                for k, (w, v) in enumerate(j.motions):
                    angle = q.get((j, k), 0.0)
                    r = about(w, angle) if dot(w, w) else EYE
                    shift = add([x * angle for x in v], add(j.point, apply(r, j.point), -1.0))
                    t = compose(t, (r, shift))
                if j.parent in self.move:
                    self.move[j.child] = compose(self.move[j.parent], t)
                else:
                    self.move[j.parent] = compose(self.move[j.child], invert(t))
                todo = True
        self.q = q
        self.pose = {f: compose(self.move[f], reading.at(f)) for f in reading.links}

    def screws(self, j):
        """Motions of the child as seen from the parent, each where it is now: of two axes the second is carried by the first."""
        carried = self.move[j.parent]
        found = []
        for k, (w, v) in enumerate(j.motions):
            found.append((apply(carried[0], w), apply(carried[0], v)))
            if k == 0 and len(j.motions) == 2 and dot(w, w):
                r = about(w, self.q.get((j, 0), 0.0))
                carried = compose(carried, (r, add(j.point, apply(r, j.point), -1.0)))
        return found, add(self.move[j.parent][1], apply(self.move[j.parent][0], j.point))

    def rate_row(self, j, k, n, index):
        """The row whose product with accelerations (alpha, a of the centre) is that of the joint's k-th coordinate."""
        motions, point = self.screws(j)
        w, v = motions[k]
        if dot(w, w) and len(motions) == 2 and dot(motions[1 - k][0], motions[1 - k][0]):
            other = motions[1 - k][0]
            c = dot(w, other)
            w = [x / (1 - c * c) for x in add(w, other, -c)]
        row = [0.0] * n
        for link, sign in ((j.child, 1.0), (j.parent, -1.0)):
            if link is not None:
                self.add_row(row, index[link], link, point, w if dot(w, w) else [0.0] * 3, [0.0] * 3 if dot(w, w) else v, sign)
        return row

    def add_row(self, row, at, link, point, angular, linear, sign):
        """sign (angular . alpha + linear . a(point)), a(point) = a + alpha x (point - centre)."""
        lever = add(point, self.centre(link), -1.0)
        for k in range(3):
            row[at + k] += sign * (angular[k] + cross(lever, linear)[k])
            row[at + 3 + k] += sign * linear[k]

    def centre(self, link):
        return add(self.pose[link][1], apply(self.pose[link][0], link.com))

    def accelerations(self):
        links = [f for f in self.r.links if not f.static]
        index = {f: 6 * i for i, f in enumerate(links)}
        n = 6 * len(links)
        rows, force = [], [0.0] * n
        for j in self.r.joints:
            rows += self.constraints(j, n, index)
            for k in range(len(j.motions or [])):
                d = j.dynamics[k] if k < 2 else None
                stiffness = float(d.findtext("spring_stiffness", "0")) if d is not None else 0.0
                if stiffness:
                    load = -stiffness * (self.q.get((j, k), 0.0) - float(d.findtext("spring_reference", "0")))
                    force = add(force, self.rate_row(j, k, n, index), load)
        mass = [[0.0] * n for _ in range(n)]
        for f in links:
            i, r = index[f], self.pose[f][0]
            inertia = mul(mul(r, f.inertia), turned(r))
            for a in range(3):
                mass[i + 3 + a][i + 3 + a] = f.mass
                mass[i + a][i:i + 3] = inertia[a]
                if f.element.findtext("gravity", "true") in ("true", "1"):
                    force[i + 3 + a] += f.mass * self.r.gravity[a]
        z = null_space(rows, n) if rows else [[float(i == j) for j in range(n)] for i in range(n)]
        mz = [apply(mass, v) for v in z]
        y = solve([[dot(v, w) for w in mz] for v in z], [dot(v, force) for v in z]) if z else []
        self.mobility = len(z)
        return [sum(v[i] * c for v, c in zip(z, y)) for i in range(n)], index, n

    def constraints(self, j, n, index):
        rows = []
        if j.motions is None:  # a gearbox
            reference = self.r.link_of(self.r.find(j, j.element.findtext("gearbox_reference_body")))
            ratio, row = float(j.element.findtext("gearbox_ratio", "1")), [0.0] * n
            for link, axis, sign in ((j.child, 1, 1.0), (reference, 1, -1.0), (j.parent, 0, ratio), (reference, 0, -ratio)):
                if link is not None:
                    self.add_row(row, index[link], link, j.point, j.axes[axis], [0.0] * 3, sign)
            return [row]
        if j.parent is None and j.child is None:
            return []
        motions, point = self.screws(j)
        for left in null_space([w + v for w, v in motions], 6):
            row = [0.0] * n
            for link, sign in ((j.child, 1.0), (j.parent, -1.0)):
                if link is not None:
                    self.add_row(row, index[link], link, point, left[:3], left[3:], sign)
            rows.append(row)
        for k, mimic in enumerate(j.mimics):
            if mimic is not None:
                leader = self.r.find(j, mimic.get("joint"))
                axis = 1 if mimic.get("axis") == "axis2" else 0
                rows.append(add(self.rate_row(j, k, n, index), self.rate_row(leader, axis, n, index),
                                -float(mimic.findtext("multiplier", "1"))))
        return rows
