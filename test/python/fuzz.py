"""Calls the package with random arguments: fuzz.py SEED SECONDS SCENES-FOLDER. Prints how many calls there were, and how many raised.

An exception is right, and the end of the interpreter is a fault. Half of the arguments are wrong in type or shape. The others have the
right shape and odd numbers (not finite, huge, tiny), which reach the computations.
"""
# SPDX-License-Identifier: Apache-2.0
import copy
import pickle
import random
import sys
import threading
import time

import numpy as np

import kinetree as kt

SCENES = ["double-pendulum", "arm7", "four-bar", "cart-pole", "flyball-governor", "humanoid", "shot"]
CLOCK = {"advance", "tick", "run", "control", "set_state"}  # a far time takes a year, as asked: these have near ones
TIMES = [0.0, 1e-3, 0.02, 0.05, -0.1, np.nan, None, "x"]
NUMBERS = [0.0, -0.0, 1.0, -1.0, 0.3, 1e-3, 1e-300, 5e-324, 1e300, -1e160, np.nan, np.inf, -np.inf, 1e17]


class Fuzz:
    def __init__(self, seed, folder):
        self.draw, self.folder, self.calls, self.raised = random.Random(seed), folder, 0, 0
        self.renew()

    def renew(self):
        """Other objects, of another scene."""
        draw = self.draw
        self.scene = kt.load(f"{self.folder}/{draw.choice(SCENES)}.yaml")
        model = self.model = self.scene.model
        simulation = self.scene.simulation(step=draw.choice([1e-3, 1e-2]), integrator=draw.choice(["rk4", "heun", "ab4", "radau5"]), duration=0.05)
        self.objects = [model.data(), simulation, model.batch(draw.randrange(1, 20), threads=draw.randrange(1, 3), method="rk4"), model, model.copy()]
        self.sizes = {0, 1, model.nq, model.nv, model.nx, 2 * model.nv, model.nq + model.nv}

    def array(self):
        draw, shape = self.draw, [self.draw.choice(sorted(self.sizes))]
        if draw.random() < 0.4:
            shape.insert(0, draw.choice([self.objects[2].states, self.model.nv, 3, 6]))
        found = np.array([draw.choice(NUMBERS) if draw.random() < 0.05 else draw.uniform(-1, 1) for _ in range(int(np.prod(shape)))]).reshape(shape)
        return np.asfortranarray(found) if draw.random() < 0.3 else found

    def argument(self):
        draw = self.draw
        return draw.choice([
            lambda: draw.choice(NUMBERS), lambda: draw.choice([None, True, -1, 0, 7, 2**31, 2**63, 10**400, "", "crank", "x" * 3000, "a.b", "\0", "é", b"x"]),
            self.array, self.array, self.array, lambda: tuple(self.array() for _ in range(draw.randrange(4))),
            lambda: draw.choice([np.zeros((3, 0)), np.array("x"), np.zeros(7, object), np.zeros(7, np.float32), np.zeros(14)[::2], {"a": 1}, {}, [], object()]),
            lambda: draw.choice([lambda *_: 0.0, lambda *_: None, lambda *_: 1 / 0, lambda *_: np.zeros(self.model.nv)]),
            lambda: draw.choice(self.model.bodies), lambda: draw.choice(self.objects)])()

    def numbers(self, *shape):
        draw = self.draw
        return np.array([draw.choice(NUMBERS) if draw.random() < 0.03 else draw.uniform(-1, 1) for _ in range(int(np.prod(shape)))]).reshape(shape)

    def compute(self):
        """A call with arrays of the right shapes."""
        draw, (data, simulation, batch, *_), m = self.draw, self.objects, self.model
        q, v, tau = self.numbers(m.nq), self.numbers(m.nv), self.numbers(m.nv)
        rows = [self.numbers(batch.states, count) for count in (m.nq, m.nv, m.nv)]
        draw.choice([
            lambda: data.forward_dynamics(q, v, tau, t=draw.choice(NUMBERS)), lambda: data.inverse_dynamics(q, v, tau), lambda: data.mass_matrix(q),
            lambda: data.effect_forces(q, v), lambda: data.forward_derivatives(q, v, tau),
            lambda: data.step(draw.choice(NUMBERS), q, v, tau, method=draw.choice(["rk4", "heun", "dopri5"])),
            lambda: data.step_derivatives(1e-3, q, v, tau), lambda: data.project(q, v), lambda: data.assemble(q, v), lambda: data.kinematics(q, v, tau),
            lambda: data.jacobian(draw.choice(m.bodies)), lambda: batch.forward_dynamics(*rows), lambda: batch.inverse_dynamics(*rows),
            lambda: batch.step(draw.choice(NUMBERS), 2, *rows), lambda: simulation.set_state(0.0, q, v), lambda: simulation.jump(q, v),
            lambda: simulation.set_torque(tau), lambda: simulation.acceleration(), lambda: simulation.step_derivatives(tau),
            lambda: simulation.restore(simulation.save()), lambda: simulation.feedback(self.numbers(m.nv, 2 * m.nv), q=q, v=v, torque=tau)(),
            lambda: m.add(q, v), lambda: m.subtract(q, q), lambda: self.loop(simulation, tau)])()

    def loop(self, simulation, tau):
        """Some turns of a loop, in which the state is set or an array is replaced."""
        for _, each in zip(range(self.draw.randrange(8)), simulation):
            self.draw.choice([lambda: each.torque.__setitem__(slice(None), tau), lambda: setattr(each, "torque", self.argument()), lambda: None,
                              lambda: each.set_state(self.draw.choice([0.0, 0.04, np.nan]), each.positions), lambda: next(iter(each))])()

    def call(self):
        draw, target = self.draw, self.draw.choice(self.objects)
        names = [name for name in dir(target) if not name.startswith("_")]
        name = draw.choice(names)
        found = getattr(target, name)
        if name in CLOCK:
            first = [draw.choice(TIMES)] if name != "control" else [draw.choice([lambda *_: np.zeros(self.model.nv), lambda *_: None, lambda *_: 1 / 0, 7])]
            options = {draw.choice(["until", "period"]): draw.choice(TIMES)} if name == "control" else {}
            found(*first, *[self.array() for _ in range(draw.randrange(3))], **options)
        elif callable(found):
            options = {draw.choice(["out", "t", "x", "method", "h", "X", "q"]): self.argument()} if draw.random() < 0.3 else {}
            result = found(*[self.argument() for _ in range(draw.randrange(5))], **options)
            if name in ("feedback", "copy", "data", "batch") and draw.random() < 0.2:
                self.objects[5:] = [result]
        elif isinstance(found, np.ndarray) and draw.random() < 0.5:
            found[...] = self.argument()
        else:
            setattr(target, name, self.argument())

    def make(self):
        draw = self.draw
        maker = draw.choice([kt.Scene, kt.load, self.scene.simulation, self.model.batch, self.model.point, kt.Simulation, kt.Compiled, kt.JointForce])
        if maker is kt.Compiled:  # an address that is right in type is a promise of the caller
            kt.Compiled(draw.choice([None, "x", -1, 0, True, 2**64]))
        else:
            maker(self.argument(), **({} if draw.random() < 0.5 else {draw.choice(["step", "duration", "integrator", "set", "threads"]): self.argument()}))

    def checkpoint(self):
        """A checkpoint of which some bytes were changed."""
        draw, simulation = self.draw, self.objects[1]
        block = bytearray(simulation.save())
        for _ in range(draw.randrange(1, 6)):
            at, count = draw.randrange(len(block)), draw.choice([1, 4, 8])
            block[at:at + count] = bytes(draw.choice([0, 1, 127, 255, draw.randrange(256)]) for _ in block[at:at + count])
        simulation.restore(bytes(block))
        simulation.tick(1e-3)

    def callback(self):
        """A function that sometimes fails, returns no number, or calls the package itself."""
        def function(*_):
            kind = self.draw.random()
            if kind < 0.05:
                try:
                    self.call()
                except Exception:
                    pass
            return [0.1, 1 / 0 if kind < 0.02 else 0.2, "x", np.nan, None, [0.0, 0.0, 0.1]][self.draw.choices(range(6), [20, 2, 1, 1, 1, 2])[0]]
        return function

    def force(self):
        """Objects of a model with forces of Python."""
        draw, forces = self.draw, [kt.PointForce(draw.sample(self.model.bodies, draw.randrange(1, 3)), self.callback())]
        forces += [kt.JointForce(name, self.callback()) for name, (_, at) in self.model.joints.items() if at.stop - at.start == 1 and draw.random() < 0.5]
        model = kt.Model(self.scene, effects=forces)
        self.objects[:3] = [model.data(), kt.Simulation(model, step=1e-3, duration=0.02), model.batch(5, method="rk4")]

    def event(self):
        """An event whose action calls the simulation."""
        draw, simulation, level = self.draw, self.objects[1], self.draw.uniform(-1, 1)
        action = draw.choice([None, lambda each: self.call(), lambda each: each.jump(v=self.numbers(self.model.nv)), lambda each: each.on("z", lambda at: 1.0),
                              lambda each: each.restore(each.save()), lambda each: each.tick(1e-3)])
        simulation.on(draw.choice("ab"), lambda at: at.q[0] - level, action, stop=draw.random() < 0.2)
        simulation.tick(5e-3)

    def together(self):
        """Two threads that use the same objects."""
        def work(seed):
            other = copy.copy(self)
            other.draw = random.Random(seed)
            for i in range(20):
                try:
                    (other.call if i % 2 else other.compute)()
                except Exception:
                    pass
        threads = [threading.Thread(target=work, args=(self.draw.randrange(10**6),)) for _ in range(2)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()

    def value(self, depth=0):
        """A number, a word, a list or a mapping of them."""
        draw = self.draw
        kind = draw.randrange(4 if depth < 3 else 2)
        if kind == 2:
            return [self.value(depth + 1) for _ in range(draw.randrange(4))]
        if kind == 3:
            return {draw.choice(["type", "name", "axis", "to", "mass", "at", "points", "radius"]): self.value(depth + 1) for _ in range(3)}
        return draw.choice(NUMBERS) if kind else draw.choice(["x", "y", "rod", "free", "tip", "world", "=L", "1 deg", None, True, np.ones(3)])

    def build(self):
        """A mechanism without a file, with some wrong keys and values."""
        draw, bodies = self.draw, []
        for i in range(draw.randrange(1, 5)):
            joint = getattr(kt.joint, draw.choice(dir(kt.joint)))
            keys = {draw.choice(["axis", "position", "at", "armature", "velocity", "pitch"]): self.value()} if draw.random() < 0.4 else {}
            rest = draw.choice([{"shape": kt.rod(to=[1, 0, 0])}, {"inertia": [1, 1, 1]}, {draw.choice(["shape", "inertia", "com", "markers"]): self.value()}])
            bodies.append(kt.Body(f"b{i}", joint=joint(**keys), mass=draw.choice([1, 2, 0, -1, np.nan, self.value()]), parent=draw.choice([None, *bodies]), **rest))
        scene = kt.mechanism(bodies, gravity=[0, 0, -9.81], **({draw.choice(["simulate", "output", "states"]): self.value()} if draw.random() < 0.2 else {}))
        scene.model.data().step(1e-3)
        simulation = scene.simulation(step=1e-3, duration=0.01)
        simulation.run()
        pickle.loads(pickle.dumps(simulation)).tick(1e-3)

    def turn(self):
        rare = [self.make, self.checkpoint, self.force, self.event, self.together, self.build]
        try:
            self.draw.choices([*rare, self.compute, self.call], [2, 2, 0.5, 1, 0.5, 1, 50, 50])[0]()
        except Exception:
            self.raised += 1
        self.calls += 1
        if self.calls % 300 == 0:
            self.renew()


def main():
    seed, seconds, folder = int(sys.argv[1]), float(sys.argv[2]), sys.argv[3]
    fuzz, end = Fuzz(seed, folder), time.monotonic() + seconds
    while time.monotonic() < end:
        fuzz.turn()
    print(fuzz.calls, fuzz.raised)


np.seterr(all="ignore")
main()
