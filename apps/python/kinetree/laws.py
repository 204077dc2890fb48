"""Functions of a program in a simulation: laws, events and records."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import threading
from typing import TYPE_CHECKING, Any, Dict, List, Optional

import numpy as np

from ._core import Fixed, Memory, Numbers, Vector, doubles, ffi, lib, mistyped, pointer
from .model import Model

if TYPE_CHECKING:
    from .simulation import Simulation

_feed_back = lib.kt_python_feed_back


def copied(address: Any, count: int) -> Vector:
    if count == 0 or address == ffi.NULL:
        return np.zeros(0)
    return np.frombuffer(ffi.buffer(address, 8 * count), np.float64).copy()


class Instant:
    """The state at which an event's function is evaluated."""

    __slots__ = ("t", "q", "v", "x")

    def __init__(self, at: Any, model: Model) -> None:
        self.t: float = at.t
        self.q, self.v, self.x = copied(at.q, model.nq), copied(at.v, model.nv), copied(at.x, model.nx)


class Event:
    """A function of the state whose change of sign is located in time."""

    def __init__(self, simulation: Any, name: str, function: Any, action: Any, direction: str, stop: bool) -> None:
        self.simulation, self.function, self.action = simulation, function, action
        self.how = {"name": name, "function": function, "action": action, "direction": direction, "stop": stop}
        self.calls = simulation._calls

    def instant(self, at: Any) -> Instant:
        return Instant(at, self.simulation.model)

    def act(self) -> bool:
        simulation = self.simulation
        simulation._acting = threading.get_ident()
        try:
            return bool(self.action(simulation)) if self.action is not None else False
        finally:
            simulation._acting = None


class Law:
    """A control law of Python for `Simulation.control`."""

    def __init__(self, simulation: Simulation, function: Any) -> None:
        self.simulation, self.function, self.calls = simulation, function, simulation._calls

    def turn(self, t: float) -> int:
        simulation = self.simulation
        found = self.function(t, simulation.positions, simulation.velocities)
        if found is None:
            return 1
        simulation.torque[:] = doubles(found, simulation.torque.shape, "the result of the law")
        return 0


class Feedback(Fixed):
    """The law tau = torque + gain (reference - state), computed in C. `Simulation.feedback` makes it.

    A call computes the law at the present state and writes `Simulation.torque`. `Simulation.control` takes it as a law.

    Attributes
    ----------
    gain : array of nv x 2 nv
        Gains of the differences of positions (`Model.subtract`) and of velocities.
    q, v, torque : arrays of nq, nv and nv
        The reference, and the torques at the reference. A loop may write into them.
    """

    def __init__(self, simulation: Simulation, gain: Numbers, q: Optional[Numbers], v: Optional[Numbers], torque: Optional[Numbers]) -> None:
        if not hasattr(simulation, "_loop"):
            raise mistyped("simulation", "a kinetree.Simulation", simulation)
        model = simulation.model
        nq, nv = model.nq, model.nv
        self._memory = Memory(8 * (2 * nv * nv + nq + 4 * nv))
        parts = np.split(self._memory.array.view(np.float64), np.cumsum([2 * nv * nv, nq, nv, nv]))
        self.gain, self.q, self.v, self.torque = parts[0].reshape(nv, 2 * nv), parts[1], parts[2], parts[3]
        self.gain[:] = doubles(gain, (nv, 2 * nv), "gain")
        for own, value, default, what in ((self.q, q, model.initial[0], "q"), (self.v, v, 0.0, "v"), (self.torque, torque, 0.0, "torque")):
            own[:] = default if value is None else doubles(value, own.shape, what)
        self._pointer = ffi.new("kt_python_feedback *", {"model": model._pointer, "nv": nv, **{
            name: pointer(array) for name, array in zip(("gain", "q", "v", "torque", "error"), parts)}})
        self._simulation, self._loop = simulation, simulation._loop
        self._is_fixed = True

    def __call__(self) -> None:
        _feed_back(self._pointer, self._loop)


class Recorder:
    """Collects the records of `Simulation.run`."""

    def __init__(self, simulation: Simulation) -> None:
        self.model, self.calls, self.driven = simulation.model, simulation._calls, simulation._watch.pointer
        self.time: List[float] = []
        self.q: List[Vector] = []
        self.v: List[Vector] = []

    def take(self, record: Any) -> bool:
        lib.kt_driven_record(self.driven, record)
        self.time.append(record.t)
        self.q.append(copied(record.q, self.model.nq))
        self.v.append(copied(record.v, self.model.nv))
        return False

    def arrays(self) -> Dict[str, Vector]:
        count = len(self.time)
        return {"time": np.array(self.time), "q": np.array(self.q).reshape(count, self.model.nq), "v": np.array(self.v).reshape(count, self.model.nv)}
