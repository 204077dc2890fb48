"""Many states of one model at once, in lanes and threads."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple, Union, cast

import numpy as np

from ._core import ArgumentError, Fixed, Guard, Memory, Numbers, Vector, doubles, fail, ffi, finite, lib, method_of, mistyped, output, outputs, pointer
from .model import Model, ModelCopy

_PLACES = {name: sum(ffi.offsetof(*each) for each in parts) // 8 for name, parts in {  # of parts of a motion
    "position": [("kt_frame_motion", "pose"), ("kt_pose", "position")],
    "angular_velocity": [("kt_frame_motion", "velocity"), ("kt_twist", "angular")],
    "velocity": [("kt_frame_motion", "velocity"), ("kt_twist", "linear")],
    "angular_acceleration": [("kt_frame_motion", "acceleration"), ("kt_twist", "angular")],
    "acceleration": [("kt_frame_motion", "acceleration"), ("kt_twist", "linear")]}.items()}


def _count(value: Any, least: int, most: int, what: str) -> int:
    if not isinstance(value, (int, np.integer)):
        raise mistyped(what, f"an integer from {least} to {most}", value)
    if isinstance(value, bool) or not least <= value <= most:
        raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"expected an integer from {least} to {most}, got {value!r}")
    return int(value)


class Batch(Fixed):
    """Many states of one model. Results have the bits of single calls.

    Parameters
    ----------
    states : int
        How many states.
    threads : int
        Threads that share the work.
    method : str, optional
        An explicit Runge-Kutta method for `step`.

    Attributes
    ----------
    q, v, x, tau, a : numpy.ndarray
        Positions, velocities, auxiliary states, joint forces and accelerations in the memory of C, groups x numbers x `width`.
        State s is ``batch.q[s // width, :, s % width]``. The last group may have lanes that belong to no state.
    t : numpy.ndarray
        The time of each state, s, groups x `width`. Steps in the memory advance it.
    width : int
        States in a group.

    Notes
    -----
    A call with arrays of states x numbers copies these into the memory. A call without arrays uses the memory in place, and returns
    views of it.
    """

    def __init__(self, model: Model, states: int, threads: int = 1, method: Optional[str] = None) -> None:
        self.model, self.method = model, method
        self.states, self.threads = _count(states, 1, 1 << 32, "states"), _count(threads, 1, 1024, "threads")
        self._guard, self._error = Guard(), ffi.new("kt_error *")
        options = ffi.new("kt_batch_options *", lib.kt_batch_options_default())
        options.states, options.threads = self.states, self.threads
        if method is not None:
            options.method = method_of(method, "method")
        size = lib.kt_batch_size(model._pointer, options)
        self._memory = Memory(max(size, 1))
        out = ffi.new("kt_batch **")
        self._check(lib.kt_batch_init(model._pointer, options, self._memory.pointer, size, out, self._error))
        self._batch = out[0]
        self._set_views(lib.kt_batch_lanes_of(self._batch))
        self._rows_of = ffi.new("kt_python_rows *", {"states": self.states, "nq": model.nq, "nv": model.nv, "nx": model.nx})
        self._job = ffi.new("kt_batch_job *")
        self._models: Dict[int, ModelCopy] = {}
        self._is_fixed = True

    def _set_views(self, lanes: Any) -> None:
        m, self.width = self.model, int(lanes.width)

        def view(first: Any, count: int, stride: int) -> Vector:
            return self._memory.strided(first, (int(lanes.groups), count, self.width), (8 * stride, 8 * self.width, 8))

        self.q, self.v = view(lanes.q, m.nq, lanes.state_stride), view(lanes.v, m.nv, lanes.state_stride)
        self.x = view(lanes.x, m.nx, lanes.state_stride)
        self.tau, self.a = view(lanes.tau, m.nv, lanes.force_stride), view(lanes.a, m.nv, lanes.force_stride)
        self.t = self._memory.strided(lanes.t, (int(lanes.groups), self.width), (8 * self.width, 8))

    def _arrays(self) -> Tuple[Vector, ...]:
        return self.q, self.v, self.x, self.tau, self.a, self.t[:, None]

    def __reduce__(self) -> Any:
        return _batch_at, (self.model, (self.states, self.threads, self.method), [each.copy() for each in self._arrays()], self._models)

    def __deepcopy__(self, memo: Any) -> "Batch":
        return _batch_at(*self.__reduce__()[1])

    def _check(self, status: int) -> None:
        if status:
            for effect in self.model.effects:
                effect.calls.reraise()
            fail(self._error, status)

    def _rows(self, value: Any, count: int, what: str) -> Tuple[Optional[Vector], Any]:
        if value is None:
            return None, ffi.NULL
        array = doubles(value, (self.states, count), what)
        return array, pointer(array)

    def _auxiliary_states(self, X: Optional[Numbers]) -> Tuple[Optional[Vector], Any]:
        """Rows of auxiliary states; the initial ones of the model if none are given."""
        if X is None and self.model.nx:
            X = np.tile(self.model.initial_x, (self.states, 1))
        return self._rows(X, self.model.nx, "X")

    def _all(self, t: float = 0.0, q: Any = ffi.NULL, v: Any = ffi.NULL, tau: Any = ffi.NULL, a: Any = ffi.NULL, x: Any = ffi.NULL) -> Any:
        rows = self._rows_of
        rows.t, rows.q, rows.v, rows.tau, rows.a, rows.x = t, q, v, tau, a, x
        return rows

    def _run(self, task: int, h: float = 0.0, steps: int = 0, inputs: Any = ffi.NULL) -> None:
        job = self._job
        job.task, job.h, job.steps, job.inputs = task, h, steps, inputs
        self._check(lib.kt_batch_run(self._batch, job, self.threads, ffi.NULL, self._error))

    def set_model(self, state: int, model: ModelCopy) -> None:
        """Give a state parameters of its own: masses, inertias, gravity, springs and others.

        Parameters
        ----------
        state : int
            The number of the state, from 0.
        model : ModelCopy
            A copy of the model of this batch (`Model.copy`), which the batch keeps. Later settings of the copy act, too.
        """
        at = _count(state, 0, self.states - 1, "state")
        if not isinstance(model, ModelCopy):
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "model", "expected a copy of the model: model.copy()")
        with self._guard:
            self._check(lib.kt_batch_set_model(self._batch, at, model._pointer, self._error))
        self._models[at] = model

    def rows(self, view: Vector, out: Optional[Vector] = None) -> Vector:
        """A copy of one of the arrays of this batch, with a row for each state.

        Parameters
        ----------
        view : array of groups x numbers x width
            `q`, `v`, `x`, `tau` or `a`.
        out : array of states x numbers, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            states x numbers.
        """
        if not isinstance(view, np.ndarray) or view.ndim != 3 or view.shape[0] * view.shape[2] < self.states:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "view", "expected an array of this batch: q, v, x, tau or a")
        out = output(out, (self.states, view.shape[1]))
        out[:] = view.transpose(0, 2, 1).reshape(-1, view.shape[1])[:self.states]
        return out

    def forward_dynamics(self, Q: Optional[Numbers] = None, V: Optional[Numbers] = None, TAU: Optional[Numbers] = None, *, X: Optional[Numbers] = None,
                         t: Optional[float] = None, out: Optional[Vector] = None) -> Vector:
        """Accelerations of every state, with effects and loops.

        Parameters
        ----------
        Q : array of states x nq, optional
            Positions, rad or m. Without Q the states in `q`, `v`, `x`, `tau` and `t` are computed in place.
        V, TAU : arrays of states x nv, optional
            Velocities (rad/s, m/s) and joint forces (N m, N). Default: zero.
        X : array of states x nx, optional
            Auxiliary states. Default: the initial ones.
        t : float, optional
            Time, s. Default: 0.
        out : array of states x nv, optional
            Where to write.

        Returns
        -------
        numpy.ndarray
            states x nv accelerations, rad/s^2 or m/s^2; `self.a` if neither Q nor `out` is given.
        """
        m, inputs = self.model, self._inputs(Q, V=V, TAU=TAU, X=X, t=t)
        if inputs is None:
            with self._guard:
                self._run(lib.KT_BATCH_FORWARD)
            return self.a if out is None else self.rows(self.a, out)
        V_, v = self._rows(V, m.nv, "V")
        TAU_, tau = self._rows(TAU, m.nv, "TAU")
        X_, x = self._auxiliary_states(X)
        out, t = output(out, (self.states, m.nv)), finite(0.0 if t is None else t, "t")
        with self._guard:
            lib.kt_python_batch_set(self._batch, self._all(t, q=inputs[1], v=v, tau=tau, x=x))
            self._run(lib.KT_BATCH_FORWARD)
            lib.kt_python_batch_get(self._batch, self._all(a=pointer(out)))
        del inputs, V_, TAU_, X_  # arrays live until here
        return out

    def _inputs(self, Q: Optional[Numbers], **others: Union[Numbers, float, None]) -> Optional[Tuple[Any, Any]]:
        """Positions and their address; None if the memory is used in place."""
        if Q is not None:
            return self._rows(Q, self.model.nq, "Q")
        for name, value in others.items():
            if value is not None:
                raise ArgumentError(lib.KT_ERROR_ARGUMENT, name, f"it needs Q; without Q a batch computes the states in its memory (batch.{name.lower()})")
        return None

    def inverse_dynamics(self, Q: Optional[Numbers] = None, V: Optional[Numbers] = None, A: Optional[Numbers] = None, *,
                         out: Optional[Vector] = None) -> Vector:
        """Joint forces of the tree for accelerations, without effects.

        Parameters
        ----------
        Q : array of states x nq, optional
            Positions, rad or m. Without Q the states in `q`, `v` and `a` are computed in place.
        V, A : arrays of states x nv, optional
            Velocities (rad/s, m/s) and accelerations (rad/s^2, m/s^2). Default: zero.
        out : array of states x nv, optional
            Where to write.

        Returns
        -------
        numpy.ndarray
            states x nv joint forces, N m or N; `self.tau` if neither Q nor `out` is given.
        """
        m, inputs = self.model, self._inputs(Q, V=V, A=A)
        if inputs is None:
            with self._guard:
                self._run(lib.KT_BATCH_INVERSE)
            return self.tau if out is None else self.rows(self.tau, out)
        V_, v = self._rows(V, m.nv, "V")
        A_, a = self._rows(np.zeros((self.states, m.nv)) if A is None else A, m.nv, "A")
        out = output(out, (self.states, m.nv))
        with self._guard:
            lib.kt_python_batch_set(self._batch, self._all(q=inputs[1], v=v, a=a))
            self._run(lib.KT_BATCH_INVERSE)
            lib.kt_python_batch_get(self._batch, self._all(tau=pointer(out)))
        del inputs, V_, A_
        return out

    def sense(self, points: Sequence[str], *, jacobian: bool = False) -> Dict[str, Vector]:
        """Sensors of every state in the memory: the motion of bodies and markers, in world axes.

        Accelerations are those of the last `forward_dynamics`, or those that `a` holds. An accelerometer measures them minus gravity.

        Parameters
        ----------
        points : list of str
            Bodies and markers, ``"body"`` or ``"body.marker"``.
        jacobian : bool
            Also the Jacobians, as `Data.jacobian`.

        Returns
        -------
        dict
            Each states x points x its shape: ``rotation`` (3 x 3), ``position`` (3), m; ``angular_velocity``, ``velocity``,
            ``angular_acceleration`` and ``acceleration`` (3), rad and m; ``jacobian`` (6 x nv).
        """
        if isinstance(points, str) or not isinstance(points, (list, tuple)) or not points:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "points", f"expected a list of names of bodies and markers, got {points!r}")
        count, nv = len(points), self.model.nv
        frames = ffi.new("kt_batch_frame[]", [self.model._frame(each) for each in points])
        motion = np.zeros((self.states, count, ffi.sizeof("kt_frame_motion") // 8))
        matrices = np.zeros((self.states, count, nv, 6)) if jacobian else None
        sensors = ffi.new("kt_batch_sensors *", {"frames": frames, "count": count, "jacobian": pointer(matrices),
                                                 "motion": ffi.cast("kt_frame_motion *", pointer(motion))})
        with self._guard:
            self._job.sensors = sensors
            try:
                self._run(lib.KT_BATCH_SENSE)
            finally:
                self._job.sensors = ffi.NULL
        found = {name: motion[..., at:at + 3] for name, at in _PLACES.items()}
        found["rotation"] = motion[..., :9].reshape(self.states, count, 3, 3).swapaxes(2, 3)
        if matrices is not None:
            found["jacobian"] = matrices.swapaxes(2, 3)
        return found

    def _sequence(self, TAU: Optional[Numbers], steps: int, hold: Optional[int]) -> Optional[Tuple[Any, Vector]]:
        """A sequence of joint forces and its array; None if the forces are constant."""
        if np.ndim(cast(Any, TAU)) != 3:
            if hold is not None:
                raise ArgumentError(lib.KT_ERROR_ARGUMENT, "hold", "it needs a sequence: TAU of states x samples x nv")
            return None
        samples = max(np.shape(cast(Any, TAU))[1], 1)
        array = doubles(TAU, (self.states, samples, self.model.nv), "TAU")
        if hold is None and steps % samples != 0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "hold", f"{steps} steps are no multiple of {samples} samples; give hold, the steps of a sample")
        hold = max(steps // samples, 1) if hold is None else _count(hold, 1, (1 << 31) - 1, "hold")
        return ffi.new("kt_batch_inputs *", {"samples": samples, "hold": hold, "torque": pointer(array)}), array

    def step(self, h: float, steps: int, Q: Optional[Numbers] = None, V: Optional[Numbers] = None, TAU: Optional[Numbers] = None, *,
             X: Optional[Numbers] = None, t: Optional[float] = None, hold: Optional[int] = None,
             out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Take steps of the method of this batch, with constant joint forces or a sequence of them.

        Parameters
        ----------
        h : float
            Length of a step, s.
        steps : int
            How many steps.
        Q, V, TAU, X : arrays, optional
            As in `forward_dynamics`. Without Q the states in the memory take the steps. A sequence is TAU of states x samples x nv, also
            without Q: sample k acts in the steps k hold to (k + 1) hold - 1, and the last sample in all later steps.
        t : float, optional
            Time at the start, s. Default: 0.
        hold : int, optional
            How many steps a sample of the sequence acts. Default: steps / samples.
        out : tuple of arrays, optional
            Where to write Q and V (and X).

        Returns
        -------
        tuple of numpy.ndarray
            Q and V after the steps; and X, if the model has auxiliary states. Without Q and `out` these are `q`, `v` (and `x`).
        """
        m = self.model
        if self.method is None:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "method", "the batch has no method; make it with model.batch(states, method='rk4')")
        h, steps = finite(h, "h"), _count(steps, 0, (1 << 31) - 1, "steps")
        sequence = self._sequence(TAU, steps, hold)
        TAU, forces = (TAU, ffi.NULL) if sequence is None else (None, sequence[0])
        inputs, kept = self._inputs(Q, V=V, TAU=TAU, X=X, t=t), 3 if m.nx else 2
        if inputs is None and out is None:
            with self._guard:
                self._run(lib.KT_BATCH_STEP, h, steps, forces)
            return (self.q, self.v, self.x)[:kept]
        V_, v = self._rows(V, m.nv, "V")
        TAU_, tau = self._rows(TAU, m.nv, "TAU")
        X_, x = self._auxiliary_states(X)
        results = outputs(out, [(self.states, count) for count in (m.nq, m.nv, m.nx)[:kept]])
        t = finite(0.0 if t is None else t, "t")
        with self._guard:
            if inputs is not None:
                lib.kt_python_batch_set(self._batch, self._all(t, q=inputs[1], v=v, tau=tau, x=x))
            self._run(lib.KT_BATCH_STEP, h, steps, forces)
            lib.kt_python_batch_get(self._batch, self._all(**dict(zip("qvx", map(pointer, results)))))
        del inputs, V_, TAU_, X_, sequence
        return results

    @property
    def pointer(self) -> Any:
        """The ``kt_batch *`` for calls of `kinetree.lib`. It is valid as long as this object."""
        return self._batch

    def __repr__(self) -> str:
        return f"<kinetree.Batch of '{self.model.name}': {self.states} states in groups of {self.width}, {self.threads} threads>"


def _batch_at(model: Model, how: Any, arrays: List[Vector], models: Dict[int, ModelCopy]) -> Batch:
    batch = Batch(model, *how)
    for state, changed in models.items():
        batch.set_model(state, changed)
    for own, array in zip(batch._arrays(), arrays):
        if own.shape == array.shape:
            own[:] = array
            continue
        rows = array.transpose(0, 2, 1).reshape(-1, array.shape[1])  # from a processor with lanes of another width
        for state in range(batch.states):
            own[state // batch.width, :, state % batch.width] = rows[state]
    return batch
