"""Calls the package with random arguments: fuzz.py SEED SECONDS SCENES-FOLDER. Prints how many calls there were, and how many raised.

An exception is right, and the end of the interpreter is a fault. Half of the arguments are wrong in type or shape. The others have the
right shape and odd numbers (not finite, huge, tiny), which reach the computations.
"""
import random
import sys
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

    def turn(self):
        try:
            self.draw.choices([self.make, self.compute, self.call], [1, 25, 25])[0]()
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
