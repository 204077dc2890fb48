"""Random scenes with up to five bodies and eight contacts with friction (contact_oracle.py)."""
# SPDX-License-Identifier: Apache-2.0
import math
import random

G = 9.81


class Scene:
    """A random scene. `rests`: without velocities; `exact`: at joint coordinates of zero, so that all numbers are rational."""

    def __init__(self, seed, rests, exact):
        self.random = random.Random(seed)
        self.rests, self.exact, self.seed = rests, exact, seed
        self.bodies, self.contacts, self.dry, self.drives, self.ropes = [], [], [], [], []
        r = self.random
        tilt = r.choice([0, 0.2, 0.5])
        self.gravity = [r.uniform(-tilt, tilt) * G, r.uniform(-tilt, tilt) * G, -G]
        self.e = 0 if rests else r.choice([0, 0, 0.4])
        while len(self.bodies) == 0 or (len(self.bodies) < 5 and len(self.contacts) < 8 and r.random() < 0.6):
            getattr(self, r.choice(["box", "box", "arm", "ball"]))(8 - len(self.contacts), 5 - len(self.bodies))
        if len(self.bodies) > 1 and r.random() < 0.4:
            self.rope()

    def body(self, parent, at, kind, axis, size):
        r = self.random
        mass = 10 ** r.uniform(-1, 1)
        self.bodies.append(dict(name=f"b{len(self.bodies)}", parent=parent, at=at, kind=kind, axis=axis, mass=mass,
                                com=[0, 0, 0], inertia=[mass * size * size * f for f in (0.1, 0.12, 0.15)], q=None, v=None))
        return self.bodies[-1]

    def contact(self, body, at, plane, height, radius=0):
        self.contacts.append(dict(name=f"c{len(self.contacts)}", body=body, at=at, plane=plane, height=height, radius=radius,
                                  mu=self.random.choice([0, self.random.uniform(0.1, 1), self.random.uniform(0.1, 1)])))

    def box(self, most, _):
        """A box on up to four feet, on the floor or on an earlier box."""
        r = self.random
        below = [k for k, b in enumerate(self.bodies) if b["kind"] == "free" and "top" in b and not b.get("loaded")]
        on = r.choice(below) if below and r.random() < 0.6 else -1
        half, size = r.uniform(0.05, 0.3), r.uniform(0.1, 0.4)
        ground = 0 if on < 0 else self.bodies[on]["q"][2] + self.bodies[on]["top"]
        b = self.body(-1, [0, 0, 0], "free", None, size)
        x = [3.0 * len(self.bodies), 0] if on < 0 else self.bodies[on]["q"][:2]
        b["top"] = half
        drop = 0 if self.rests or on >= 0 else r.choice([0, 0, 0.02])
        b["q"] = [*x, ground + half + drop, 1, 0, 0, 0]
        b["v"] = [0] * 6
        if not self.rests and on < 0:
            b["v"] = [r.uniform(-1, 1), r.uniform(-1, 1), 0, 0, 0, r.uniform(-1, 1)]
        elif not self.rests:
            b["v"] = list(self.bodies[on]["v"])
        if on >= 0:
            self.bodies[on]["loaded"] = True
        feet = r.randint(1, min(4, most))
        for k in range(feet):
            turn = 2 * math.pi * k / feet + r.uniform(0, 0.7)
            at = [round(size * math.cos(turn), 4), round(size * math.sin(turn), 4), -half]
            self.contact(len(self.bodies) - 1, at, on, 0 if on < 0 else self.bodies[on]["top"])

    def ball(self, *_):
        r = self.random
        radius = r.uniform(0.05, 0.2)
        b = self.body(-1, [0, 0, 0], "free", None, radius)
        b["inertia"] = [0.4 * b["mass"] * radius**2] * 3
        b["q"] = [3.0 * len(self.bodies), 0, radius, 1, 0, 0, 0]
        b["v"] = [0] * 6 if self.rests else [r.uniform(-1, 1), r.uniform(-1, 1), 0, *(r.uniform(-5, 5) for _ in range(3))]
        self.contact(len(self.bodies) - 1, [0, 0, 0], -1, 0, radius)

    def arm(self, _, most):
        """Links with hinges or slides, of which the last one leans on the floor with its tip, by its foot below."""
        r = self.random
        links, parent, angle, height = r.randint(1, min(3, most)), -1, 0.0, 0.0
        first = len(self.bodies)
        for k in range(links):
            kind = r.choice(["revolute", "revolute", "prismatic"])
            at = [0.4, 0, 0] if k else [3.0 * len(self.bodies), 2.0, 0]
            b = self.body(parent, at, kind, "y" if kind == "revolute" else r.choice("xz"), 0.3)
            b["com"] = [0.2, 0, 0]
            turn = 0 if self.exact or kind != "revolute" else r.uniform(-0.4, 0.4)
            driven = r.random() < 0.25  # a drive may not push the foot into the floor
            b["q"], b["v"] = [turn], [0 if self.rests or driven and b["axis"] != "x" else r.uniform(-0.3, 0.3)]
            angle += turn
            height += 0.4 * math.sin(angle)
            parent = len(self.bodies) - 1
            if r.random() < 0.5:
                self.dry.append(dict(name=f"d{len(self.dry)}", body=parent, S=r.uniform(0, 8) * b["mass"]))
            if driven:
                self.drives.append(dict(name=f"m{len(self.drives)}", body=parent, rate=b["v"][0], start=turn))
        drop = 0.1 * math.cos(angle)
        self.bodies[first]["at"][2] = height + drop
        if self.exact:
            self.bodies[first]["at"][2] = 0.1
        self.contact(parent, [0.4, 0, -0.1], -1, 0)

    def rope(self):
        """A bar between the origins of two bodies."""
        a, b = self.random.sample(range(len(self.bodies)), 2)
        free = "free" in (self.bodies[a]["kind"], self.bodies[b]["kind"])  # arms that are driven would hold the bar, too
        if free and not self.exact:  # at angles of zero, bars are singular
            self.ropes.append(dict(name="bar", bodies=(a, b)))

    def document(self, duration):
        def joint(b):
            if b["kind"] == "free":
                return {"type": "free", "position": {"position": b["q"][:3]},
                        "velocity": {"linear": b["v"][:3], "angular": b["v"][3:]}}
            return {"type": b["kind"], "axis": b["axis"], "at": b["at"], "position": b["q"][0], "velocity": b["v"][0]}
        bodies = [{"name": b["name"], **({"parent": f"b{b['parent']}"} if b["parent"] >= 0 else {}), "joint": joint(b),
                   "mass": b["mass"], "com": b["com"], "inertia": b["inertia"],
                   "markers": {c["name"]: c["at"] for c in self.contacts if self.bodies[c["body"]] is b}} for b in self.bodies]
        effects = [{"name": c["name"], "type": "contact", "point": f"b{c['body']}.{c['name']}", "radius": c["radius"],
                    "plane": {"body": f"b{c['plane']}" if c["plane"] >= 0 else "world", "at": [0, 0, c["height"]]},
                    "restitution": self.e, "friction": c["mu"]} for c in self.contacts]
        effects += [{"name": d["name"], "type": "joint_friction", "joint": f"b{d['body']}", "coulomb": d["S"], "stick": True}
                    for d in self.dry]
        loops = [{"name": m["name"], "type": "motion", "joint": f"b{m['body']}",
                  "position": {"polynomial": [m["start"], m["rate"]]}} for m in self.drives]
        loops += [{"name": s["name"], "type": "distance", "between": [f"b{k}" for k in s["bodies"]]} for s in self.ropes]
        return {"kinetree": 1, "name": f"s{self.seed}", "gravity": self.gravity, "bodies": bodies, "effects": effects,
                "loops": loops, "simulate": {"duration": duration},
                "output": {"interval": duration / 8, "record": ["position", "velocity", "acceleration", "effect", "reaction",
                                                                "multiplier"]}}
