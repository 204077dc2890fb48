"""What is drawn at random: numbers, vectors, rotations in each of their forms, functions of time."""
# SPDX-License-Identifier: Apache-2.0
import math

import numpy as np

from parts import AXES, function, turn


class Draw:
    def __init__(self, seed):
        self.rng = np.random.RandomState(seed)  # whose streams numpy keeps for ever
        self.planar = self.chance(0.25)
        self.flat = np.array([1.0, 1.0, 0.0 if self.planar else 1.0])

    def chance(self, p):
        return self.rng.random_sample() < p

    def pick(self, values, weights=None):
        weights = None if weights is None else np.array(weights, float) / sum(weights)
        return values[self.rng.choice(len(values), p=weights)]

    def between(self, low, high):
        return float(self.rng.uniform(low, high))

    def vector(self, size):
        return self.rng.uniform(-size, size, 3)

    def place(self, size):
        return self.vector(size) * self.flat

    def axis(self):
        if self.planar:
            return "z"
        return self.pick(list(AXES)) if self.chance(0.7) else [float(x) for x in self.vector(1.0)]

    def matrix(self):
        if self.planar:
            return turn(AXES["z"], self.between(-3, 3))
        return turn(self.vector(1.0), self.between(-3, 3))

    def angle(self, a):
        return f"{float(a) * 180.0 / math.pi!r} deg" if self.chance(0.3) else float(a)

    def any_rotation(self):
        """Each form of the contract."""
        if self.planar:
            return self.pick([{"rpy": [0.0, 0.0, self.angle(self.between(-3, 3))]}, {"axis": "z", "angle": self.angle(self.between(-3, 3))}])
        a = [float(x) for x in self.vector(1.5)]
        q = self.rng.normal(size=4)
        sequence = self.pick([121, 131, 212, 232, 313, 323, 123, 132, 213, 231, 312, 321])
        return self.pick([
            {"rpy": [self.angle(x) for x in a]}, {"euler": {"sequence": sequence, "angles": [self.angle(x) for x in a]}}, {"vector": a},
            {"cgr": a}, {"axis": self.axis(), "angle": self.angle(a[0])}, {"quaternion": list(q / np.linalg.norm(q))}, {"matrix": self.matrix()},
        ])  # fmt: skip

    def form_of(self, R):
        """A form for a given rotation."""
        w = 0.5 * math.sqrt(max(1.0 + np.trace(R), 0.0))
        if w < 0.1 or self.chance(0.4):
            return {"matrix": R}
        v = np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]]) / (4.0 * w)
        n = np.linalg.norm(v)
        angle = 2.0 * math.atan2(n, w)
        forms = [{"quaternion": [w, *v]}, {"cgr": 2.0 * v / w}]
        forms += [{"vector": v * (angle / n)}, {"axis": v / n, "angle": self.angle(angle)}] if n > 1e-3 else []
        return self.pick(forms)

    def function(self, value=None, size=1.0):
        """A function of time; where a value is given, that at t = 0."""
        f = self.pick([
            {"sine": {"amplitude": self.between(0.1, 1) * size, "frequency": self.between(0.1, 1.5), "phase": self.between(-2, 2), "offset": self.between(-1, 1) * size}},
            {"ramp": {"from": self.between(-1, 1) * size, "to": self.between(-1, 1) * size, "start": self.between(-0.5, -0.2), "end": self.between(0.4, 1.0)}},
            {"polynomial": [float(x) * size for x in self.rng.uniform(-1, 1, 4)]},
            {"table": [[x, self.between(-0.5, 0.5) * size] for x in (-1.0, -0.4, 0.3, 0.8, 1.5)], "interpolation": "cubic"},
            {"table": [[x, self.between(-0.5, 0.5) * size] for x in (-1.0, 0.5, 1.5)], "interpolation": "linear"},
            {"table": [[x, self.between(-0.5, 0.5) * size] for x in (-1.0, -0.3, 0.6, 1.5)], "interpolation": "monotone"},
        ])  # fmt: skip
        if value is not None:
            shift = value - function(f, 0.0)[0]
            if "sine" in f:
                f["sine"]["offset"] += shift
            elif "ramp" in f:
                f["ramp"]["from"] += shift
                f["ramp"]["to"] += shift
            elif "polynomial" in f:
                f["polynomial"][0] += shift
            else:
                f["table"] = [[x, y + shift] for x, y in f["table"]]
        return f
