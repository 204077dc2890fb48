"""The clock: steps, control loops, events and checkpoints, in this process."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import contextlib
import threading
from typing import Any, Callable, ContextManager, Dict, Iterator, List, Optional, Sequence, Tuple, Union, cast

import numpy as np

from . import callbacks
from ._core import (ArgumentError, Error, Fixed, Guard, Json, Memory, Numbers, Vector, address_number, busy, doubles, fail, ffi, finite, lib, method_of, mistyped, name_of,
                    output, pointer, text)
from ._kinetree import Clock, quicken, turns
from .data import Data
from .events import ROOM, Events
from .laws import Event, Feedback, Law, Recorder, copied
from .model import Model, ModelCopy
from .present import Present, Stepped
from .recording import Recording, contacts_of, sensor_bits
from .watch import Watch, issue

_tick, _time = lib.kt_python_tick, lib.kt_simulation_time


class Simulation(Clock, Events, Fixed):  # type: ignore[misc]
    """A simulation of a model from its initial state.

    Iterate over it for a control loop: each turn is one period of `step`, until `duration`.

    Parameters
    ----------
    model : Model
    step : float, optional
        Fixed step, s.
    duration, integrator, tolerance, sensors
        As `Scene.simulation`.
    step_evaluations : int
        The most evaluations of a fixed step on hard contacts: a time step completes a step that would take more, or that fails, and
        `counts` has the number of such steps as ``completed``. Default: no limit. `Scene.run` completes steps that fail or stall.

    Attributes
    ----------
    positions, velocities, states : arrays of nq, nv and nx
        The state after the last call, with the auxiliary states: read-only views.
    state : array of nq + nv + nx
        Positions, velocities and auxiliary states in one array: a read-only view.
    torque : array of nv
        Joint forces, N or N m: a writable view. They act from the next step on, and hold until they change. Write into it in a control
        loop: ``simulation.torque[:] = ...``, or ``np.dot(K, state, out=simulation.torque)``.
    """

    _assignable = ("torque",)

    def __init__(self, model: Model, *, step: Optional[float] = None, duration: Optional[float] = None,
                 integrator: Optional[str] = None, tolerance: Optional[float] = None, sensors: Sequence[str] = (),
                 step_evaluations: int = 0) -> None:
        if not isinstance(model, Model):
            raise mistyped("model", "a kinetree.Model", model)
        scene = model.scene._scene
        self._given, self._sets = model, bool(lib.kt_scene_needs_settable(scene))
        if self._sets and not isinstance(model, ModelCopy):
            model = model.copy()  # events of the scene set its parameters
        self.model = model
        self._how: Json = {"step": step, "duration": duration, "integrator": integrator, "tolerance": tolerance, "sensors": sensors,
                           "step_evaluations": step_evaluations}
        self._calls, self._guard = callbacks.Calls(), Guard()
        self._keep: List[Any] = []
        self._events: List[Event] = []
        self._error = ffi.new("kt_error *")
        run, options = self._run(), ffi.new("kt_simulation_options *", lib.kt_simulation_options_default())
        options.events = lib.kt_scene_event_room(scene) + ROOM
        options.contact = scene.contact
        if isinstance(step_evaluations, bool) or not isinstance(step_evaluations, (int, np.integer)) or not 0 <= step_evaluations < 1 << 63:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "step_evaluations", f"expected an integer from 0, got {step_evaluations!r}")
        options.step_evaluations = int(step_evaluations)
        self._sensed = lib.kt_run_record(run, model._pointer) | sensor_bits(sensors)
        options.record = self._sensed | (0 if model.effects else lib.KT_RECORD_ENERGY)  # for the watch
        size = lib.kt_simulation_size(model._pointer, run, options)
        self._memory = Memory(max(size, 1))
        out = ffi.new("kt_simulation **")
        self._check(lib.kt_simulation_init(model._pointer, run, options, self._memory.pointer, size, out, self._error))
        self._simulation = out[0]
        self.duration, self.step_size, self.integrator = run.duration, run.step, "moreau-jean" if options.contact else text(run.integrator)
        self._watch_events(scene)
        self.state = self._memory.view(lib.kt_simulation_positions(out[0]), model.nq + model.nv + model.nx)
        self.positions, self.velocities, self.states = np.split(self.state, [model.nq, model.nq + model.nv])
        self._make_loop()
        self._watch: Watch = Watch(model, run, self._simulation, self._watched)
        self._loop.watch = self._watch.pointer
        self._data: Optional[Data] = None
        self._data_key: Any = None
        self._acting: Optional[int] = None
        self._recording: Optional[Recording] = None
        self._start: Optional[bytes] = self.save()
        if isinstance(model, ModelCopy):
            model._serve(self._guard)
        self._is_fixed = True

    def _make_loop(self) -> None:
        """Torques to be set before the next step, and those that the simulation has."""
        nv = self.model.nv
        self._torque_memory = Memory(16 * max(nv, 1))
        both = self._torque_memory.array.view(np.float64)
        self.torque, self._applied = both[:nv], both[nv:2 * nv]
        self._loop = ffi.new("kt_python_loop *", {"simulation": self._simulation, "torque": pointer(self.torque), "applied": pointer(self._applied), "nv": nv})
        self._flag = self._guard.pointer
        owners = self._flag, self._loop, self._error
        self._set_up(*map(address_number, owners), owners)

    def _run(self) -> Any:
        run = ffi.new("kt_run *", self.model.scene._scene.run)
        how = self._how
        for name in ("integrator", "tolerance"):
            if how[name] is not None and self.model.scene._scene.contact:
                raise ArgumentError(1, name, "the scene has 'contact: steps', a method of its own with a fixed step; leave the argument out")
        if how["step"] is not None and how["tolerance"] is not None:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "tolerance",
                                "'step' is for a fixed step and 'tolerance' for an adaptive one; leave one of them out")
        if how["step"] is not None:
            run.step = finite(how["step"], "step", 0.0)
            if how["integrator"] is None and run.integrator == ffi.NULL and not self.model.scene._scene.contact:
                how["integrator"] = "rk4"
        if how["duration"] is not None:
            run.duration = finite(how["duration"], "duration", 0.0)
        if how["tolerance"] is not None:
            run.relative = run.absolute = finite(how["tolerance"], "tolerance", 0.0)
            run.step = 0.0
        if how["integrator"] is not None:
            method_of(how["integrator"], "integrator")
            self._keep.append(ffi.new("char[]", name_of(how["integrator"], "integrator")))
            run.integrator = self._keep[-1]
        return run

    def _watch_events(self, scene: Any) -> None:
        self._watched = ffi.NULL
        if lib.kt_scene_event_room(scene) == 0:
            return
        watch = ffi.new("kt_scene_watch **")
        self._check(lib.kt_scene_watch_create(scene, self.model._pointer, self._simulation, ffi.NULL, 0, watch, self._error))
        self._watched = ffi.gc(watch[0], lib.kt_scene_watch_free)
        self._synchronise()

    def _synchronise(self) -> None:
        """Give the model the parameters that events of the scene have set at the present state."""
        if self._sets:
            self._check(lib.kt_scene_watch_sync(self._watched, self._simulation, self._error))

    def _changing(self) -> ContextManager[None]:
        """The guard of a change, which the action of an event may make, too: the call that led to the action holds the guard."""
        return cast(ContextManager[None], contextlib.nullcontext() if self._acting == threading.get_ident() else self._guard)

    def _warn(self) -> None:
        """Issue the warnings that are new."""
        with self._guard:
            new = self._watch.examine()
        issue(new)

    @property
    def warnings(self) -> List[Json]:
        """The warnings so far, as `Run.warnings`: of the start, the step, the energy and the contacts.

        Each was issued as a `KinetreeWarning`, or is found by this call. Torques of a program supply energy: from the first one on, the
        energy is not watched, and steps are.
        """
        with self._guard:
            self._watch.examine()
        return list(self._watch.warnings)

    def _check(self, status: int) -> None:
        if status == lib.KT_PYTHON_WARNED:
            self._warn()
        elif status:
            if status == lib.KT_PYTHON_BUSY:
                raise busy()
            self._calls.reraise()
            for effect in self.model.effects:
                effect.calls.reraise()
            try:
                if status in (lib.KT_ERROR_STEP, lib.KT_ERROR_NOT_FINITE) and self._is_fixed:
                    self._warn()  # a warning may explain the failure
            finally:
                fail(self._error, status)

    # ---- the state --------------------------------------------------------------------------------------------------

    @property
    def time(self) -> float:
        """Time, s."""
        return float(_time(self._simulation))

    def set_state(self, t: float, q: Numbers, v: Optional[Numbers] = None) -> None:
        """Restart from a state. Loops are closed, auxiliary states begin anew, and torques remain.

        Parameters
        ----------
        t : float
            Time, s.
        q, v : arrays of nq and nv
            Positions (rad, m) and velocities (rad/s, m/s; default: at rest).
        """
        q = doubles(q, (self.model.nq,), "q")
        v = np.zeros(self.model.nv) if v is None else doubles(v, (self.model.nv,), "v")
        with self._guard:
            self._check(lib.kt_simulation_set_state(self._simulation, finite(t, "t"), pointer(q), pointer(v), self._error))
            self._synchronise()
            self._watch.restart(bool(self.torque.any()))

    def reset(self) -> None:
        """Return to the start: the initial state at time 0, without torques. Later results have the bits of a new simulation.

        Parameters that were set remain.
        """
        if self._start is None:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "reset", "an event was added after the start; add events before the first step")
        self.restore(self._start)

    def set_torque(self, tau: Numbers) -> None:
        """Set the joint forces, which hold until they are set again. `torque` is the array itself.

        Parameters
        ----------
        tau : array of nv
            Joint forces, N m or N. If one is not finite, the previous ones remain.
        """
        self.torque[:] = doubles(tau, self.torque.shape, "tau")
        with self._changing():
            self._apply()

    def _apply(self) -> None:
        self._check(lib.kt_python_apply(self._loop, self._error))

    def jump(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None) -> None:
        """Change positions or velocities within a motion.

        Parameters
        ----------
        q, v : arrays of nq and nv, optional
            New positions (rad, m) and velocities (rad/s, m/s). Default: as they are.
        """
        q = None if q is None else doubles(q, (self.model.nq,), "q")
        v = None if v is None else doubles(v, (self.model.nv,), "v")
        with self._changing():
            self._check(lib.kt_simulation_jump(self._simulation, pointer(q), pointer(v), self._error))
            self._watch.restart(bool(self.torque.any()))

    def set(self, name: str, value: Numbers) -> None:
        """Set a parameter while the simulation runs. The simulation's model must be a copy (`Model.copy`).

        A new mass leaves ``"arm.com"`` and ``"arm.inertia"`` as they are, also if they came from a shape.

        Parameters
        ----------
        name : str
            Such as ``"arm.mass"``, as in `Model.get`.
        value : float or array
            In SI units and radians.
        """
        name_of(name, "name")
        if not isinstance(self.model, ModelCopy):
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, name, "the model is immutable; make the simulation with model=scene.model.copy()")
        found, values = self.model._given(name, value)
        with self._changing():
            self._check(lib.kt_simulation_set_parameter(self._simulation, self.model._pointer, found, pointer(values), self._error))
            self._watch.restart(bool(self.torque.any()))
        self.model._remember(name, values)

    def switch(self, name: str, on: bool = True) -> float:
        """Switch a loop or an effect on or off, which has ``switched`` in the scene.

        A loop must be closed when it is switched on. `set` moves the place of its end on the world, to `Data.place`. Velocities
        change by the loop's impulse. Hard contacts and friction that sticks switch by themselves.

        Parameters
        ----------
        name : str
            The name of the loop or the effect.
        on : bool
            Whether it acts from now on.

        Returns
        -------
        float
            The kinetic energy that is lost, J.
        """
        with self._changing():
            model, found = lib.kt_simulation_model(self._simulation), name_of(name, "name")
            loop, effect = lib.kt_loop_find(model, found), lib.kt_effect_find(model, found)
            switch = lib.kt_loop_switch(model, loop) if loop >= 0 else lib.kt_effect_switch(model, effect) if effect >= 0 else -1
            if switch < 0:
                why = "it has no `switched` in the scene" if max(loop, effect) >= 0 else "there is no loop or effect of this name"
                raise ArgumentError(lib.KT_ERROR_ARGUMENT, name, why)
            before, bits, loss = lib.kt_switch_set(model), lib.kt_switch_bits(model, switch), ffi.new("double *")
            self._check(lib.kt_simulation_set_switches(self._simulation, before | bits if on else before & ~bits, loss, self._error))
            self._watch.restart(bool(self.torque.any()))
            if bool(lib.kt_switch_set(lib.kt_simulation_model(self._simulation)) & bits) != bool(on):
                raise ArgumentError(lib.KT_ERROR_ARGUMENT, name, "hard contacts and friction that sticks switch by themselves")
        return float(loss[0])

    # ---- the clock --------------------------------------------------------------------------------------------------

    def tick(self, period: float) -> None:
        """Advance by exactly one period of a control loop.

        Parameters
        ----------
        period : float
            Length, s. It may be many steps of the method.
        """
        try:
            status = _tick(self._flag, self._loop, period, self._error)
        except TypeError:
            raise mistyped("period", "a number", period) from None
        if status:
            self._check(status)

    def step(self, until: Optional[float] = None) -> None:
        """Take one step of the method.

        Parameters
        ----------
        until : float, optional
            The step does not go beyond this time, s. Default: the duration.
        """
        limit = self.duration if until is None else finite(until, "until")
        self._check(lib.kt_python_step(self._flag, self._loop, limit, self._error))

    def advance(self, t: float) -> None:
        """Advance to a time.

        Parameters
        ----------
        t : float
            Time, s.
        """
        self._check(lib.kt_python_advance(self._flag, self._loop, finite(t, "t"), self._error))

    def _period(self, period: Optional[float]) -> float:
        if period is None and not self.step_size > 0.0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "step", "a control loop has a fixed step; give simulation(step=1e-3)")
        period = self.step_size if period is None else finite(period, "period")
        if not period > 0.0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "period", f"expected a time above zero, got {period}")
        return period

    def __iter__(self) -> Iterator["Simulation"]:
        """Yield this simulation before each period: read sensors, set torques; then it advances."""
        return turns(self, *map(address_number, (self._flag, self._loop, self._error)), self._period(None), self.duration)  # type: ignore[no-any-return]

    def feedback(self, gain: Numbers, *, q: Optional[Numbers] = None, v: Optional[Numbers] = None, torque: Optional[Numbers] = None) -> Feedback:
        """A linear law of this simulation: tau = torque + gain (reference - state). See `Feedback`.

        Parameters
        ----------
        gain : array of nv x 2 nv
            Such as the gain of a linear-quadratic regulator, or ``[kp 1, kd 1]``; N m/rad and N m s/rad.
        q, v, torque : arrays of nq, nv and nv, optional
            The reference, and the torques there. Default: the initial positions, at rest, without torques.
        """
        return Feedback(self, gain, q, v, torque)

    def control(self, law: Union[Callable[[float, Vector, Vector], Optional[Numbers]], callbacks.Compiled, Any], *, period: Optional[float] = None,
                until: Optional[float] = None) -> None:
        """Run a control loop whose law sets the joint forces before each period.

        Parameters
        ----------
        law : callable or Feedback
            A function ``law(t, q, v)`` of Python that returns nv joint forces, or None to end the loop. Or a compiled
            ``int law(void *user, double t, const double *q, const double *v, double *tau)`` of ``numba.cfunc``, ctypes, or `Compiled`:
            it writes nv joint forces to `tau`, which holds the last ones, and returns 0. Another number ends the loop.
        period : float, optional
            Period of the loop, s. Default: the fixed step.
        until : float, optional
            End of the loop, s. Default: the duration.
        """
        period, end = self._period(period), self.duration if until is None else finite(until, "until")
        if isinstance(law, Feedback):
            handle, compiled = law._pointer, ffi.addressof(lib, "kt_python_feedback_law")
            if law._simulation is not self:
                raise ArgumentError(lib.KT_ERROR_ARGUMENT, "law", "it belongs to another simulation; take simulation.feedback(...)")
        else:
            address = callbacks.address_of(law, "law", callbacks.LAW)
            handle = ffi.new_handle(Law(self, law))
            compiled = lib.kt_python_control_law if address is None else ffi.cast("kt_python_law *", address)
        with self._guard:
            status = lib.kt_python_control(self._loop, compiled, handle, period, end, self._error)
        self._calls.reraise()
        if status == lib.KT_OK or status == lib.KT_PYTHON_ENDED:
            self._warn()
        else:
            self._check(status)

    def record(self, interval: Optional[float] = None) -> Recording:
        """Record this motion from now on: the present state, and the states after later turns, ticks, steps and advances.

        Parameters
        ----------
        interval : float, optional
            Time between records, s. Default: each turn.

        Returns
        -------
        Recording
            Its `run()` has the columns. A later call of `record` begins another recording and ends this one.
        """
        self._recording = Recording(self, interval)
        with self._guard:
            self._loop.records = self._recording._records
            self._recording._records.next = self.time
            self._apply()
            lib.kt_python_take_record(self._loop)
        return self._recording

    def run(self) -> Dict[str, Vector]:
        """Run to the duration.

        A run that has reached the duration before has no records left. A simulation past its duration raises `ArgumentError`.

        Returns
        -------
        dict
            The records as arrays: ``time`` (records), s; ``q`` (records x nq), rad or m; ``v`` (records x nv), rad/s or m/s.
        """
        sink = Recorder(self)
        handle = ffi.new_handle(sink)
        with self._guard:
            self._begin_run()
            status = lib.kt_simulation_run(self._simulation, lib.kt_python_recorder, handle, self._error)
        self._check(status)
        self._warn()
        return sink.arrays()

    def _begin_run(self) -> None:
        if self.time > self.duration * (1.0 + 1e-9):  # periods that add up to the duration may round beyond it
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "duration", f"the run ends at {self.duration:g} s, and the simulation is at {self.time:g} s; make a "
                                "simulation of a longer duration, or `advance` without records")
        self._apply()
        lib.kt_driven_begin(self._watch.pointer)

    # ---- sensors ----------------------------------------------------------------------------------------------------

    def acceleration(self, *, out: Optional[Vector] = None) -> Vector:
        """Accelerations at this time, under the torques that are set.

        Parameters
        ----------
        out : array of nv, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            nv accelerations, rad/s^2 or m/s^2.
        """
        out = output(out, (self.model.nv,))
        with self._guard:
            self._apply()
            self._check(lib.kt_simulation_acceleration(self._simulation, pointer(out), self._error))
        return out

    def sense(self) -> Dict[str, Any]:
        """Values of the present state: those that `sensors` and the records of the scene request.

        Returns
        -------
        dict
            ``acceleration`` (nv); ``energy``, kinetic and potential, J; ``reaction`` (bodies x 6): the moment, N m, and the force, N, of the
            parent on each body across its joint, world axes; ``loop_reaction`` (loops x 6), likewise.
        """
        record, m = ffi.new("kt_record *"), self.model
        with self._guard:
            self._apply()
            self._check(lib.kt_simulation_sense(self._simulation, record, self._error))
            loops = lib.kt_loop_count(m._pointer)
            found = {"acceleration": (record.a, (m.nv,)), "reaction": (record.reactions, (m.body_count, 6)),
                     "loop_reaction": (record.loop_reactions, (loops, 6))}
            values: Dict[str, Any] = {name: copied(address, int(np.prod(shape))).reshape(shape)
                                      for name, (address, shape) in found.items() if address != ffi.NULL}
        if np.isfinite(record.kinetic) and self._sensed & (lib.KT_RECORD_ENERGY | lib.KT_RECORD_BALANCE):
            values["energy"] = (record.kinetic, record.potential)
        return values

    def contacts(self) -> List[Json]:
        """The contacts that touch: ``name``, ``sticks``, ``point``, ``normal``, ``force`` on the first body, ``slip``. Hard ones need the sensor reaction."""
        with self._guard:
            self._apply()
            return contacts_of(self._simulation, self.model.effect_types, self._check, self._error)

    def data(self) -> Data:
        """A workspace at the present state, with its kinematics: for positions, Jacobians and dynamics.

        It has the loops and effects that are on, the auxiliary states, `torque`, the time, and the accelerations. With ``contact: steps``,
        it rejects calls that need forces of contacts at a state.
        """
        data = self._present()
        data.q[:], data.v[:], data.x[:], data.tau[:] = self.positions, self.velocities, self.states, self.torque
        data.t = self.time
        if isinstance(data, Stepped):
            return data.kinematics(data.q)
        try:
            data.forward_dynamics()
        except Error:  # `acceleration` of a point reports that there is none
            return data.kinematics(data.q)
        return data.kinematics()

    def _present(self) -> Data:
        """A workspace of the model with the switches of this moment."""
        pointer = lib.kt_simulation_model(self._simulation)
        key = pointer, lib.kt_switch_set(pointer)
        if self._data is None or self._data_key != key:
            own = pointer == self.model._pointer
            model = self.model if own else Present(self.model, pointer, self._memory)
            self._data = (Stepped if self.model.scene._scene.contact else Data)(model)
            self._data_key = key
        return self._data

    def step_derivatives(self, tau: Optional[Numbers] = None, h: Optional[float] = None, *,
                         out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Exact derivatives of the next step: A by the state, B by the joint forces.

        Parameters
        ----------
        tau : array of nv, optional
            Joint forces, N m or N. Default: `torque`.
        h : float, optional
            Length of the step, s. Default: the fixed step, or 1 ms.
        out : tuple of two arrays, optional
            As in `Data.step_derivatives`.

        Returns
        -------
        tuple of numpy.ndarray
            A, n x n, and B, n x nv, with n = 2 nv + nx.
        """
        tau = self.torque if tau is None else tau
        return self._present().step_derivatives(h or self.step_size or 1e-3, self.positions, self.velocities, tau, x=self.states, t=self.time,
                                           method=self.integrator if self.step_size > 0.0 and self.integrator else "rk4", out=out)

    @property
    def counts(self) -> Dict[str, int]:
        """Steps, evaluations, factorisations and others since the start; ``completed``: fixed steps that a time step completed."""
        found = lib.kt_simulation_counts_of(self._simulation)
        names = "steps", "rejected", "evaluations", "factorizations", "jacobians", "switches", "capped"
        return {**{name: int(getattr(found, name)) for name in names}, "completed": int(lib.kt_simulation_contacts(self._simulation).completed)}

    @property
    def pointer(self) -> Any:
        """The ``kt_simulation *`` for calls of `kinetree.lib`. It is valid as long as this object."""
        return self._simulation

    def __repr__(self) -> str:
        return f"<kinetree.Simulation of '{self.model.name}' at t = {self.time:g} s>"


# The method of C takes a float, and calls that of Python for all other arguments.
setattr(Simulation, "_convert_tick", Simulation.tick)
setattr(Simulation, "tick", quicken(Simulation, "tick", f"tick($self, period)\n--\n\n{Simulation.tick.__doc__ or ''}".encode()))
