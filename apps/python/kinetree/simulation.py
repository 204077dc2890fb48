"""The clock: steps, control loops, events and checkpoints, in this process."""
from __future__ import annotations

from typing import Any, Callable, Dict, Iterator, List, Optional, Tuple, Union

import numpy as np

from . import callbacks
from ._core import ArgumentError, Fixed, Guard, Memory, busy, check, doubles, fail, ffi, finite, lib, name_of, output, pointer, text
from .model import Data, Model, ModelCopy, Vector

_ROOM = 16  # events that a program may add
_tick, _set_torque = lib.kt_simulation_tick, lib.kt_simulation_set_torque
_DIRECTIONS = {"either": lib.KT_DIRECTION_EITHER, "rising": lib.KT_DIRECTION_RISING, "falling": lib.KT_DIRECTION_FALLING}


class Instant:
    """The state at which an event's function is evaluated."""

    __slots__ = ("t", "q", "v", "x")

    def __init__(self, at: Any, model: Model) -> None:
        self.t: float = at.t
        self.q, self.v, self.x = _copied(at.q, model.nq), _copied(at.v, model.nv), _copied(at.x, model.nx)


class Event:
    """A function of the state whose change of sign is located in time."""

    def __init__(self, simulation: "Simulation", name: str, function: Any, action: Any, stop: bool) -> None:
        self.simulation, self.name, self.function, self.action, self.stop = simulation, name, function, action, stop
        self.calls = simulation._calls

    def instant(self, at: Any) -> Instant:
        return Instant(at, self.simulation.model)

    def act(self) -> bool:
        return bool(self.action(self.simulation)) if self.action is not None else False


class Recorder:
    """Collects the records of `Simulation.run`."""

    def __init__(self, simulation: "Simulation") -> None:
        self.model, self.calls = simulation.model, simulation._calls
        self.time: List[float] = []
        self.q: List[Vector] = []
        self.v: List[Vector] = []

    def take(self, record: Any) -> bool:
        self.time.append(record.time)
        self.q.append(_copied(record.q, self.model.nq))
        self.v.append(_copied(record.v, self.model.nv))
        return False


def _copied(address: Any, count: int) -> Vector:
    if count == 0 or address == ffi.NULL:
        return np.zeros(0)
    return np.frombuffer(ffi.buffer(address, 8 * count), np.float64).copy()


class Simulation(Fixed):
    """A simulation of a model from its initial state.

    Iterate over it for a control loop: each turn is one period of `step`, until `duration`.

    Parameters
    ----------
    model : Model
    step : float, optional
        Fixed step, s.
    duration, integrator, tolerance
        As `Scene.simulation`.
    """

    def __init__(self, model: Model, *, step: Optional[float] = None, duration: Optional[float] = None,
                 integrator: Optional[str] = None, tolerance: Optional[float] = None) -> None:
        self.model = model
        self._how = {"step": step, "duration": duration, "integrator": integrator, "tolerance": tolerance}
        self._calls, self._guard = callbacks.Calls(), Guard()
        self._keep: List[Any] = []
        self._error = ffi.new("kt_error *")
        run, options = self._run(), ffi.new("kt_simulation_options *", lib.kt_simulation_options_default())
        scene = model.scene._scene
        options.events = lib.kt_scene_event_room(scene) + _ROOM
        size = lib.kt_simulation_size(model._pointer, run, options)
        self._memory = Memory(max(size, 1))
        out = ffi.new("kt_simulation **")
        self._check(lib.kt_simulation_init(model._pointer, run, options, self._memory.pointer, size, out, self._error))
        self._simulation = out[0]
        self.duration, self.step_size, self.integrator = run.duration, run.step, text(run.integrator)
        self._watch_events(scene)
        self._positions = self._memory.view(lib.kt_simulation_positions(out[0]), model.nq)
        self._velocities = self._memory.view(lib.kt_simulation_velocities(out[0]), model.nv)
        states = lib.kt_simulation_own_states(out[0])
        self._states = self._memory.view(states, model.nx) if model.nx else np.zeros(0)
        self._torque_memory = Memory(8 * max(model.nv, 1))
        self._torque = self._torque_memory.array[:8 * model.nv].view(np.float64)
        self._torque_address = pointer(self._torque)
        self._data: Optional[Data] = None
        self._is_fixed = True

    def _run(self) -> Any:
        run = ffi.new("kt_run *", self.model.scene._scene.run)
        how = self._how
        if how["step"] is not None:
            run.step = finite(how["step"], "step", 0.0)
            if how["integrator"] is None:
                how["integrator"] = "rk4"
        if how["duration"] is not None:
            run.duration = finite(how["duration"], "duration", 0.0)
        if how["tolerance"] is not None:
            run.relative = run.absolute = finite(how["tolerance"], "tolerance", 0.0)
            run.step = 0.0
        if how["integrator"] is not None:
            self._keep.append(ffi.new("char[]", name_of(how["integrator"], "integrator")))
            run.integrator = self._keep[-1]
        return run

    def _watch_events(self, scene: Any) -> None:
        if lib.kt_scene_event_room(scene) == 0:
            return
        watch = ffi.new("kt_scene_watch **")
        self._check(lib.kt_scene_watch_create(scene, self.model._pointer, self._simulation, ffi.NULL, 0, watch, self._error))
        self._keep.append(ffi.gc(watch[0], lib.kt_scene_watch_free))

    def _check(self, status: int) -> None:
        if status:
            self._calls.reraise()
            for effect in self.model.effects:
                effect.calls.reraise()
            fail(self._error, status)

    # ---- the state --------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time, s."""
        return lib.kt_simulation_time(self._simulation)

    @property
    def positions(self) -> Vector:
        """Positions (nq): a read-only view of the state after the last call."""
        return self._positions

    @property
    def velocities(self) -> Vector:
        """Velocities (nv): a read-only view of the state after the last call."""
        return self._velocities

    @property
    def states(self) -> Vector:
        """Auxiliary states (nx): a read-only view."""
        return self._states

    def set_state(self, t: float, q: Vector, v: Optional[Vector] = None) -> None:
        """Set time, positions and velocities (default: at rest)."""
        q = doubles(q, (self.model.nq,), "q")
        v = np.zeros(self.model.nv) if v is None else doubles(v, (self.model.nv,), "v")
        with self._guard:
            self._check(lib.kt_simulation_set_state(self._simulation, finite(t, "t"), pointer(q), pointer(v), self._error))

    def set_torque(self, tau: Vector) -> None:
        """Set the joint forces (nv), which hold until they are set again."""
        self._torque[:] = doubles(tau, self._torque.shape, "tau")
        guard = self._guard
        if not guard.acquire(False):
            raise busy()
        try:
            status = _set_torque(self._simulation, self._torque_address, self._error)
        finally:
            guard.release()
        if status:
            self._check(status)

    def jump(self, q: Optional[Vector] = None, v: Optional[Vector] = None) -> None:
        """Change positions or velocities within a motion."""
        q = None if q is None else doubles(q, (self.model.nq,), "q")
        v = None if v is None else doubles(v, (self.model.nv,), "v")
        self._check(lib.kt_simulation_jump(self._simulation, pointer(q), pointer(v), self._error))

    def set(self, name: str, value: Union[float, Vector]) -> None:
        """Set a parameter while the simulation runs. The simulation's model must be a copy (`Model.copy`)."""
        if not isinstance(self.model, ModelCopy):
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, name, "the model is immutable; make the simulation with model=scene.model.copy()")
        found = self.model._parameter(name)
        values = doubles(np.atleast_1d(np.asarray(value, np.float64)), (found.count,), f"value of '{name}'")
        with self._guard:
            self._check(lib.kt_simulation_set_parameter(self._simulation, self.model._pointer, found, pointer(values), self._error))

    # ---- the clock --------------------------------------------------------------------------------------------------

    def tick(self, period: float) -> None:
        """Advance by exactly one period of a control loop, s."""
        guard = self._guard
        if not guard.acquire(False):
            raise busy()
        try:
            status = _tick(self._simulation, period, self._error)
        finally:
            guard.release()
        if status:
            self._check(status)

    def step(self, until: Optional[float] = None) -> None:
        """Take one step of the method, and not beyond `until` (default: the duration)."""
        limit = self.duration if until is None else finite(until, "until")
        with self._guard:
            self._check(lib.kt_simulation_step(self._simulation, limit, self._error))

    def advance(self, t: float) -> None:
        """Advance to the time t, s."""
        with self._guard:
            self._check(lib.kt_simulation_advance(self._simulation, finite(t, "t"), self._error))

    def __iter__(self) -> Iterator["Simulation"]:
        """Yield this simulation before each period: read sensors, set torques; then it advances."""
        period = self.step_size
        if not period > 0.0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "step", "a control loop has a fixed step; give simulation(step=1e-3)")
        while self.time < self.duration * (1.0 - 1e-12) and self.stopped is None:
            yield self
            self.tick(min(period, self.duration - self.time))

    def run(self) -> Dict[str, np.ndarray]:
        """Run to the duration. Returns the records as arrays ``time``, ``q`` and ``v``."""
        sink = Recorder(self)
        handle = ffi.new_handle(sink)
        with self._guard:
            self._check(lib.kt_simulation_run(self._simulation, lib.kt_python_recorder, handle, self._error))
        count = len(sink.time)
        return {"time": np.array(sink.time), "q": np.array(sink.q).reshape(count, self.model.nq),
                "v": np.array(sink.v).reshape(count, self.model.nv)}

    # ---- sensors ----------------------------------------------------------------------------------------------------

    def acceleration(self, *, out: Optional[Vector] = None) -> Vector:
        """Accelerations at this time, under the torques that are set."""
        out = output(out, (self.model.nv,))
        with self._guard:
            self._check(lib.kt_simulation_acceleration(self._simulation, pointer(out), self._error))
        return out

    def data(self) -> Data:
        """A workspace at the present state, with its kinematics: for positions and Jacobians of points."""
        if self._data is None:
            self._data = Data(self.model)
        self._data.q, self._data.v = self._positions, self._velocities
        return self._data.kinematics(a=np.zeros(self.model.nv))

    def step_derivatives(self, tau: Optional[Vector] = None, h: Optional[float] = None) -> Tuple[Vector, Vector]:
        """Exact derivatives of the next step: A by the state, B by the joint forces."""
        if self._data is None:
            self._data = Data(self.model)
        tau = self._torque if tau is None else tau
        return self._data.step_derivatives(h or self.step_size or 1e-3, self._positions, self._velocities, tau, t=self.time,
                                           method=self.integrator if self.step_size > 0.0 and self.integrator else "rk4")

    @property
    def counts(self) -> Dict[str, int]:
        """Steps, evaluations, factorisations and others since the start."""
        found = lib.kt_simulation_counts_get(self._simulation)
        return {name: int(getattr(found, name)) for name in ("steps", "rejected", "evaluations", "factorizations", "jacobians", "switches", "capped")}

    # ---- events -----------------------------------------------------------------------------------------------------

    def on(self, name: str, function: Callable[[Instant], float], action: Optional[Callable[["Simulation"], Any]] = None, *,
           direction: str = "either", stop: bool = False) -> None:
        """Add an event: steps end where ``function(instant)`` changes its sign.

        Parameters
        ----------
        function : callable
            A value of the state (`Instant`: t, q, v, x). It must depend on its argument alone.
        action : callable, optional
            Called with this simulation at the event. A true result ends the call that stepped.
        direction : {"either", "rising", "falling"}
        stop : bool
            The event ends a run.
        """
        if direction not in _DIRECTIONS:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "direction", f"expected one of {', '.join(_DIRECTIONS)}, got {direction!r}")
        event = Event(self, name, function, action, stop)
        handle, label = ffi.new_handle(event), ffi.new("char[]", name_of(name, "name"))
        record = ffi.new("kt_event *", {"name": label, "function": lib.kt_python_event_value, "user": handle, "direction": _DIRECTIONS[direction], "stop": stop})
        if action is not None:
            record.action = lib.kt_python_event_action
        self._check(lib.kt_simulation_event_add(self._simulation, record, self._error))
        self._keep += [event, handle, label]

    @property
    def stopped(self) -> Optional[str]:
        """The name of the event that ended the last call, or None."""
        found = lib.kt_simulation_stopped(self._simulation)
        return None if found == ffi.NULL else text(found.name)

    def event_count(self, name: str) -> int:
        """How often an event has happened."""
        return int(lib.kt_simulation_event_count(self._simulation, name_of(name, "name")))

    # ---- checkpoints ------------------------------------------------------------------------------------------------

    def save(self) -> bytes:
        """A checkpoint. All later results have the same bits after `restore`."""
        size = lib.kt_simulation_state_size(self._simulation)
        block = Memory(size)
        lib.kt_simulation_save(self._simulation, block.pointer)
        return block.array.tobytes()

    def restore(self, block: bytes) -> None:
        """Continue from a checkpoint of the same scene and run."""
        size = lib.kt_simulation_state_size(self._simulation)
        if len(block) != size:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "restore", f"a checkpoint of this simulation has {size} bytes, got {len(block)}")
        memory = Memory(size)
        memory.array[:] = np.frombuffer(block, np.uint8)
        self._check(lib.kt_simulation_restore(self._simulation, memory.pointer, self._error))

    def __reduce__(self) -> Any:
        if isinstance(self.model, ModelCopy) or any(isinstance(each, Event) for each in self._keep):
            raise TypeError("a simulation with events of Python or a model of its own cannot be pickled; save() keeps its state")
        return _restored, (self.model.scene, self._how, self.save())

    def __deepcopy__(self, memo: dict) -> "Simulation":
        return self.__reduce__()[0](*self.__reduce__()[1])

    def __repr__(self) -> str:
        return f"<kinetree.Simulation of '{self.model.name}' at t = {self.time:g} s>"


def _restored(scene: Any, how: dict, block: bytes) -> Simulation:
    simulation = Simulation(scene.model, **how)
    simulation.restore(block)
    return simulation
