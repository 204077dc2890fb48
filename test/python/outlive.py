"""Views and parts that outlive their owners: outlive.py SCENES-FOLDER [broken]. valgrind and AddressSanitizer watch it.

With `broken` it reads memory after its owner is gone, by the C interface without checks: both must see this.
"""
# SPDX-License-Identifier: Apache-2.0
import copy
import gc
import sys

import numpy as np

import kinetree as kt

LAG = """
kinetree: 1
bodies:
  - {name: arm, joint: {type: revolute, axis: y, position: 0.4}, mass: 1, shape: {type: rod, to: [1, 0, 0]}}
states: {lag: {initial: 0.5, rate: "3*(position.arm - lag)"}}
effects: [{type: expression, joint: arm, force: "-20*lag"}]
"""


def scene(folder):
    return kt.load(f"{folder}/arm7.yaml")


def parts(folder):
    """Views and objects of which each is kept alone."""
    for name in ("q", "v", "tau", "a", "x"):
        yield getattr(scene(folder).model.data(), name)
        yield getattr(scene(folder).model.batch(70), name)
        yield getattr(kt.Scene(LAG).model.batch(70), name)
    for name in ("positions", "velocities", "states", "state", "torque"):
        yield getattr(scene(folder).simulation(step=1e-3), name)
    for name in ("gain", "q", "v", "torque"):
        yield getattr(scene(folder).simulation(step=1e-3).feedback(np.zeros((7, 14))), name)
    yield scene(folder).simulation(step=1e-3).feedback(np.ones((7, 14)))
    yield scene(folder).model
    yield scene(folder).model.copy()
    yield scene(folder).model.copy().data()
    yield copy.deepcopy(scene(folder).simulation(step=1e-3))
    yield iter(scene(folder).simulation(step=1e-3, duration=0.01))
    yield np.from_dlpack(scene(folder).model.batch(70).q)


def use(part):
    gc.collect()
    trash = [np.full(5000, np.nan) for _ in range(20)]  # takes memory that was released
    if isinstance(part, np.ndarray):
        total = float(np.sum(np.frombuffer(part.tobytes())))  # a copy of memory, which AddressSanitizer checks, too
        if part.flags.writeable:
            part[...] = 0.5
        return total
    if isinstance(part, kt.Model):
        return part.data().forward_dynamics()[0] + len(part.bodies)
    if isinstance(part, kt.Simulation):
        part.advance(0.01)
        return part.positions[0]
    if isinstance(part, kt.Data):
        return part.forward_dynamics()[0]
    if isinstance(part, kt.Feedback):
        part()
        return part.torque[0]
    return sum(float(each.positions[0]) for each in part) + len(trash)


def main():
    folder = sys.argv[1]
    if "broken" in sys.argv:
        data = scene(folder).model.data()
        address = data._memory.pointer
        del data
        gc.collect()
        print(sum(bytes(kt.ffi.buffer(address, 4000))))
        return
    count = 0
    for part in parts(folder):
        assert np.isfinite(use(part)), part
        del part
        count += 1
    spring = kt.JointForce("arm", lambda t, q, v: -q)
    simulation = kt.Simulation(kt.Model(kt.Scene(LAG), effects=[spring]), step=1e-3, duration=0.01)
    del spring
    simulation.on("zero", lambda at: at.q[0], lambda s: None)
    use(simulation)
    print(count, "parts outlive their owners")


main()
