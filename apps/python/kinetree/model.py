"""Models (immutable) and data (the workspace of one thread)."""
from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from . import callbacks
from ._core import (ArgumentError, Fixed, Guard, Memory, Vector, address, address_number, busy, check, doubles, fail, ffi, finite, lib, name_of,
                    output, outputs, pointer, text)
from ._kinetree import Evaluator, quicken

_forward, _inverse = lib.kt_python_forward, lib.kt_python_inverse
Point = Sequence[float]


class Model(Fixed):
    """A compiled mechanism. It is immutable, and threads may share it.

    Attributes
    ----------
    nq, nv, nx : int
        Numbers of positions, velocities and auxiliary states.
    """

    def __init__(self, scene: Any, effects: Sequence[callbacks.JointForce] = ()) -> None:
        self.scene, self.effects = scene, tuple(effects)
        record = scene._scene
        options = ffi.new("kt_model_options *", lib.kt_model_options_default())
        options.metric, options.plan = record.run.metric, record.run.plan
        options.settable = lib.kt_scene_sets(record)
        description = ffi.new("kt_description *", record.description)
        keep = self._with_effects(description)
        out, error = ffi.new("kt_model **"), ffi.new("kt_error *")
        status = lib.kt_model_compile(description, options, out, error)
        del keep
        if status:
            lib.kt_scene_locate(record, error)
            fail(error, status)
        self._set_up(ffi.gc(out[0], lib.kt_model_free, lib.kt_model_size(out[0])))

    def _set_up(self, compiled: Any) -> None:
        self._pointer = compiled
        self.nq: int = lib.kt_model_nq(compiled)
        self.nv: int = lib.kt_model_nv(compiled)
        self.nx: int = lib.kt_own_state_count(compiled)
        self.body_count: int = lib.kt_model_body_count(compiled)
        self._is_fixed = True

    def _with_effects(self, description: Any) -> Any:
        if not self.effects:
            return None
        count = description.effect_count
        array = ffi.new("kt_effect[]", count + len(self.effects))
        for i in range(count):
            array[i] = description.effects[i]
        for i, effect in enumerate(self.effects):
            array[count + i] = lib.kt_effect_default()
            effect.fill(array[count + i])
        description.effects, description.effect_count = array, count + len(self.effects)
        return array

    def __reduce__(self) -> Any:
        if self.effects:
            raise TypeError("a model with functions of Python cannot be pickled; pickle its scene")
        return _compiled, (self.scene,)

    def __deepcopy__(self, memo: Any) -> "Model":
        return self

    # ---- names ------------------------------------------------------------------------------------------------------

    @property
    def name(self) -> str:
        return text(lib.kt_model_name(self._pointer)) or self.scene.name

    @property
    def bodies(self) -> List[str]:
        """Names of the bodies; the first is the world."""
        return [text(lib.kt_body_name(self._pointer, i)) for i in range(self.body_count)]

    @property
    def joints(self) -> Dict[str, Tuple[slice, slice]]:
        """The joints, and the slices of their coordinates in q and v."""
        found = {}
        for i in range(1, self.body_count):
            at = lib.kt_body_coordinates(self._pointer, i)
            found[text(lib.kt_joint_name(self._pointer, i))] = (slice(at.q, at.q + at.nq), slice(at.v, at.v + at.nv))
        return found

    def body(self, name: str) -> int:
        """The index of a body."""
        found: int = lib.kt_body_find(self._pointer, name_of(name, "body"))
        if found < 0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "body", f"there is no body '{name}'; there are {', '.join(self.bodies[1:9])}")
        return found

    def _frame(self, name: str) -> Tuple[int, int]:
        """Body and marker of ``"body.marker"``; marker -1 of a body."""
        body, _, marker = name.rpartition(".") if isinstance(name, str) else ("", "", "")
        if not body:
            return self.body(name), -1
        at = self.body(body)
        found: int = lib.kt_marker_find(self._pointer, at, name_of(marker, "marker"))
        if found < 0:
            names = [text(lib.kt_marker_name(self._pointer, at, i)) for i in range(lib.kt_marker_count(self._pointer, at))]
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "point", f"body '{body}' has no marker '{marker}'; it has {', '.join(names) or 'none'}")
        return at, found

    def point(self, name: str) -> Tuple[int, Vector]:
        """Body and place of a marker, ``"body.marker"``, or of a body's origin."""
        body, marker = self._frame(name)
        return body, np.zeros(3) if marker < 0 else _vector(lib.kt_marker_at(self._pointer, body, marker))

    @property
    def initial(self) -> Tuple[Vector, Vector]:
        """Positions and velocities that the description gives. Loops may be open there."""
        q, v = np.zeros(self.nq), np.zeros(self.nv)
        lib.kt_model_initial(self._pointer, pointer(q), pointer(v))
        return q, v

    @property
    def initial_x(self) -> Vector:
        """Auxiliary states that the description gives, nx."""
        x = np.zeros(self.nx)
        lib.kt_own_states_initial(self._pointer, pointer(x))
        return x

    # ---- parameters -------------------------------------------------------------------------------------------------

    def copy(self) -> "ModelCopy":
        """A copy whose parameters can be set. It serves one simulation, or the data of one thread."""
        return ModelCopy(self)

    def _parameter(self, name: str) -> Any:
        found, error = ffi.new("kt_parameter *"), ffi.new("kt_error *")
        check(lib.kt_parameter_find(self._pointer, name_of(name, "parameter"), found, error), error)
        return found

    def get(self, name: str) -> Union[float, Vector]:
        """The value of a parameter, such as ``"arm.mass"``."""
        found, error = self._parameter(name), ffi.new("kt_error *")
        values = np.zeros(lib.KT_PARAMETER_MAX)
        check(lib.kt_parameter_get(self._pointer, found, pointer(values), error), error)
        return float(values[0]) if found.count == 1 else values[:found.count].copy()

    # ---- coordinates ------------------------------------------------------------------------------------------------

    def add(self, q: Vector, dv: Vector, out: Optional[Vector] = None) -> Vector:
        """q (+) dv: move along the joints' exponential maps."""
        out = output(out, (self.nq,))
        q, dv = doubles(q, (self.nq,), "q"), doubles(dv, (self.nv,), "dv")
        lib.kt_position_add(self._pointer, pointer(q), pointer(dv), pointer(out))
        return out

    def subtract(self, end: Vector, q: Vector, out: Optional[Vector] = None) -> Vector:
        """The difference of two positions, in nv numbers."""
        out = output(out, (self.nv,))
        end, q = doubles(end, (self.nq,), "end"), doubles(q, (self.nq,), "q")
        lib.kt_position_subtract(self._pointer, pointer(end), pointer(q), pointer(out))
        return out

    # ---- what computes ----------------------------------------------------------------------------------------------

    def data(self) -> "Data":
        """A workspace for evaluations. Each thread needs its own."""
        return Data(self)

    def batch(self, states: int, threads: int = 1, method: Optional[str] = None) -> Any:
        """Many states of this model at once. See `Batch`."""
        from .batch import Batch
        return Batch(self, states, threads, method)

    def __repr__(self) -> str:
        return f"<kinetree.Model '{self.name}': {self.body_count - 1} bodies, nq {self.nq}, nv {self.nv}>"


def _compiled(scene: Any) -> Model:
    model: Model = scene.model
    return model


class ModelCopy(Model):
    """A model with parameters of its own."""

    def __init__(self, model: Model) -> None:
        self.original, self.scene, self.effects = model, model.scene, model.effects
        self._memory = Memory(lib.kt_model_size(model._pointer))
        out, error = ffi.new("kt_model **"), ffi.new("kt_error *")
        check(lib.kt_model_copy(model._pointer, self._memory.pointer, self._memory.array.size, out, error), error)
        self._set_up(out[0])

    def __reduce__(self) -> Any:
        raise TypeError("a copy of a model cannot be pickled; pickle its scene and set the parameters again")

    def set(self, name: str, value: Union[float, Vector]) -> None:
        """Set a parameter, such as ``set("arm.mass", 2.0)``."""
        found, error = self._parameter(name), ffi.new("kt_error *")
        values = doubles(np.atleast_1d(np.asarray(value, np.float64)), (found.count,), f"value of '{name}'")
        check(lib.kt_parameter_set(self._pointer, found, pointer(values), error), error)


def _vector(at: Any, out: Optional[Vector] = None) -> Vector:
    out = output(out, (3,))
    out[:] = at.x, at.y, at.z
    return out


def _vec3(at: Any) -> Any:
    return ffi.new("kt_vec3 *", doubles(at, (3,), "at").tolist())[0]


class State:
    """Arrays q, v, tau and a at fixed addresses: views of one block, which cannot be resized."""

    def __init__(self, nq: int, nv: int) -> None:
        counts = (nq, nv, nv, nv)
        self.memory = Memory(8 * sum(counts))
        numbers = self.memory.array.view(np.float64)
        ends = np.cumsum(counts).tolist()
        self.arrays = [numbers[end - count:end] for count, end in zip(counts, ends)]
        self.pointers = [pointer(array) for array in self.arrays]


class Data(Evaluator, Fixed):  # type: ignore[misc]
    """A workspace, and the evaluations at a state (t, q, v).

    All calls release the interpreter lock. Two threads must not share a `Data`; a second thread gets `Busy`.

    Attributes
    ----------
    q, v, tau, a : arrays of nq, nv, nv and nv
        Positions, velocities, joint forces and accelerations. A call without arguments uses them in place, which is the fastest way.
    x : array of nx
        Auxiliary states, which all calls read.

    Notes
    -----
    The arrays are fixed. An assignment copies into them.
    """

    _assignable = ("q", "v", "tau", "a", "x")

    def __init__(self, model: Model) -> None:
        self.model = model
        self._memory = Memory(lib.kt_data_size(model._pointer))
        self._guard = Guard()
        self._error = ffi.new("kt_error *")
        out = ffi.new("kt_data **")
        check(lib.kt_data_init(model._pointer, self._memory.pointer, self._memory.array.size, out, self._error), self._error)
        self._data, self._m = out[0], model._pointer
        self.x = self._memory.view(lib.kt_own_states(self._m, self._data), model.nx)
        self.x.flags.writeable = True
        self._work: Dict[str, Memory] = {}
        self._state = State(model.nq, model.nv)
        self.q, self.v, self.tau, self.a = self._state.arrays
        self._q, self._v, self._tau, self._a = self._state.pointers
        self.q[:], self.v[:] = model.initial
        self._nq, self._nv = (model.nq,), (model.nv,)
        self._call = ffi.new("kt_python_data *", {"guard": self._guard.pointer, "model": self._m, "data": self._data, "error": self._error,
                                                  "nq": model.nq, "nv": model.nv, "q": self._q, "v": self._v, "tau": self._tau, "a": self._a})
        owners = self._call, self._m, self._memory, self._guard.pointer, self._error
        self._set_up(address_number(self._call), self._nv, self.a, owners)
        self._is_fixed = True

    def __reduce__(self) -> Any:
        return _data_at, (self.model, [array.copy() for array in (*self._state.arrays, self.x)])

    def __deepcopy__(self, memo: Any) -> "Data":
        return _data_at(*self.__reduce__()[1])

    def _check(self, status: Optional[int]) -> None:
        if status:
            if status == lib.KT_PYTHON_BUSY:
                raise busy()
            for effect in self.model.effects:
                effect.calls.reraise()
            fail(self._error, status)

    # ---- dynamics ---------------------------------------------------------------------------------------------------

    def forward_dynamics(self, q: Optional[Vector] = None, v: Optional[Vector] = None, tau: Optional[Vector] = None, *,
                         t: float = 0.0, out: Optional[Vector] = None) -> Vector:
        """Accelerations of the whole mechanism, with effects and loops.

        Parameters
        ----------
        q : array of nq, v : array of nv, tau : array of nv
            Positions, velocities, joint forces. Default: the arrays of this object.
        t : float
            Time, s.
        out : array of nv, optional
            Where to write. Default: `self.a` if no state is given, else a new array.

        Returns
        -------
        numpy.ndarray
            nv accelerations.
        """
        if q is None and v is None and tau is None and out is None:
            out = self.a
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        tau = address(tau, self._nv, self._tau, "tau")
        out = output(out, self._nv)
        self._check(_forward(self._call, t, q, v, tau, pointer(out)))
        return out

    def inverse_dynamics(self, q: Optional[Vector] = None, v: Optional[Vector] = None, a: Optional[Vector] = None, *,
                         out: Optional[Vector] = None) -> Vector:
        """Joint forces of the tree for accelerations, by the recursive Newton-Euler algorithm, without effects."""
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        a = address(a, self._nv, self._a, "a")
        out = output(out, self._nv)
        self._check(_inverse(self._call, q, v, a, pointer(out)))
        return out

    def mass_matrix(self, q: Optional[Vector] = None, *, out: Optional[Vector] = None) -> Vector:
        """The mass matrix of the tree, nv x nv."""
        m = self.model
        q = address(q, self._nq, self._q, "q")
        out = output(out, (m.nv, m.nv))
        with self._guard:
            self._check(lib.kt_dynamics_mass(self._m, self._data, q, pointer(out), self._error))
        return out

    def bias(self, q: Optional[Vector] = None, v: Optional[Vector] = None, *, out: Optional[Vector] = None) -> Vector:
        """The bias force h of the tree: inverse dynamics for accelerations of zero."""
        return self.inverse_dynamics(q, v, np.zeros(self.model.nv), out=out)

    def effect_forces(self, q: Optional[Vector] = None, v: Optional[Vector] = None, *, t: float = 0.0, out: Optional[Vector] = None) -> Vector:
        """Generalised forces of all effects, nv."""
        m = self.model
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        out = output(out, (m.nv,))
        with self._guard:
            self._check(lib.kt_effect_forces(self._m, self._data, t, q, v, pointer(out), self._error))
        return out

    def _workspace(self, name: str, size: int) -> Memory:
        if name not in self._work or self._work[name].array.size < size:
            self._work[name] = Memory(size)
        return self._work[name]

    def forward_derivatives(self, q: Optional[Vector] = None, v: Optional[Vector] = None, tau: Optional[Vector] = None, *,
                            t: float = 0.0, out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Exact derivatives of `forward_dynamics` with respect to q (tangent), v and tau.

        Returns
        -------
        tuple of numpy.ndarray
            Three nv x nv matrices of column-major order; `out`, if it is given.
        """
        m = self.model
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        tau = address(tau, self._nv, self._tau, "tau")
        size = lib.kt_acceleration_work_size(self._m)
        work = self._workspace("acceleration", size)
        by = outputs(out, [(m.nv, m.nv)] * 3, "F")
        with self._guard:
            self._check(lib.kt_acceleration_derivatives(self._m, self._data, work.pointer, size, t, q, v, tau, ffi.NULL,
                                                        pointer(by[0]), pointer(by[1]), pointer(by[2]), self._error))
        return by

    def step(self, h: float, q: Optional[Vector] = None, v: Optional[Vector] = None, tau: Optional[Vector] = None, *,
             x: Optional[Vector] = None, t: float = 0.0, method: str = "rk4", out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """One step of a method, as a function of the state.

        Parameters
        ----------
        h : float
            Length of the step, s.
        q, v, tau, x : arrays of nq, nv, nv and nx
            Positions, velocities, joint forces and auxiliary states. Default: the arrays of this object, which stay as they are.
        out : tuple of arrays, optional
            Where to write q and v (and x).

        Returns
        -------
        tuple of numpy.ndarray
            q and v after the step; and x, if the model has auxiliary states.
        """
        taken, step, work = self._step(h, q, v, tau, x, t, method)
        m = self.model
        results = outputs(out, [(count,) for count in (m.nq, m.nv, m.nx)[:3 if m.nx else 2]])
        with self._guard:
            before = self.x.copy()
            self._check(lib.kt_step_evaluate(self._m, self._data, work.pointer, work.array.size, step, taken[0], taken[1], pointer(results[0]),
                                             pointer(results[1]), self._error))
            if m.nx:
                results[2][:] = self.x
            self.x[:] = before
        return results

    def step_derivatives(self, h: float, q: Optional[Vector] = None, v: Optional[Vector] = None, tau: Optional[Vector] = None, *,
                         x: Optional[Vector] = None, t: float = 0.0, method: str = "rk4",
                         out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Exact derivatives of a step: A by the state (xi, dv, dx), B by the joint forces. Arguments are those of `step`.

        `out` takes two arrays of column-major order: n x n and n x nv with n = 2 nv + nx.
        """
        m = self.model
        taken, step, work = self._step(h, q, v, tau, x, t, method)
        n = 2 * m.nv + m.nx
        A, B = outputs(out, [(n, n), (n, m.nv)], "F")
        with self._guard:
            before = self.x.copy()
            self._check(lib.kt_step_derivatives(self._m, self._data, work.pointer, work.array.size, step, taken[0], taken[1], ffi.NULL, ffi.NULL,
                                                pointer(A), pointer(B), self._error))
            self.x[:] = before
        return A, B

    def _step(self, h: float, q: Any, v: Any, tau: Any, x: Any, t: float, method: str) -> Any:
        m = self.model
        found = lib.kt_method_find(name_of(method, "method"))
        if found == ffi.NULL:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "method", f"there is no method '{method}'; kinetree integrators lists them")
        taken = (address(q, self._nq, self._q, "q"), address(v, self._nv, self._v, "v"), address(tau, self._nv, self._tau, "tau"),
                 address(x, (m.nx,), ffi.NULL, "x"))
        step = ffi.new("kt_step *", {"method": found, "t": finite(t, "t"), "h": finite(h, "h"), "tau": taken[2], "x": taken[3]})
        size = lib.kt_step_work_size(self._m, found)
        if size == 0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "method", f"a step of '{method}' is no function of a state; take an explicit Runge-Kutta method")
        return taken, step, self._workspace("step " + method, size)

    # ---- constraints ------------------------------------------------------------------------------------------------

    def assemble(self, q: Optional[Vector] = None, v: Optional[Vector] = None, *, t: float = 0.0,
                 out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Close the loops of a state that may be far from closed. Returns q and v; the default is the state of this object, in place."""
        return self._closed(lib.kt_state_assemble, q, v, t, out)

    def project(self, q: Optional[Vector] = None, v: Optional[Vector] = None, *, t: float = 0.0,
                out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Move a state by the least step until all loops are closed to rounding."""
        changed = ffi.new("bool *")
        return self._closed(lambda m, d, t, q, v, e: lib.kt_state_project(m, d, t, q, v, changed, e), q, v, t, out)

    def _closed(self, call: Any, q: Any, v: Any, t: float, out: Any) -> Tuple[Vector, ...]:
        m, at = self.model, [self.q, self.v]
        given = [own if value is None else doubles(value, own.shape, what) for value, own, what in zip((q, v), at, "qv")]
        if out is not None:
            at = list(outputs(out, [(m.nq,), (m.nv,)]))
        else:
            at = [own if value is None else np.empty_like(own) for value, own in zip((q, v), at)]
        for target, values in zip(at, given):
            target[:] = values
        with self._guard:
            self._check(call(self._m, self._data, finite(t, "t"), pointer(at[0]), pointer(at[1]), self._error))
        return at[0], at[1]

    # ---- kinematics -------------------------------------------------------------------------------------------------

    def kinematics(self, q: Optional[Vector] = None, v: Optional[Vector] = None, a: Optional[Vector] = None) -> "Data":
        """Compute the poses, velocities and accelerations that the queries below read."""
        m = self.model
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        a = address(a, self._nv, self._a, "a")
        with self._guard:
            self._check(lib.kt_kinematics_update(self._m, self._data, q, v, a, self._error))
        return self

    def _place(self, point: Union[str, Tuple[str, Point]]) -> Tuple[int, Any]:
        if isinstance(point, str):
            body, at = self.model.point(point)
        else:
            body, at = self.model.body(point[0]), np.asarray(point[1])
        return body, _vec3(at)

    def position(self, point: Union[str, Tuple[str, Point]], out: Optional[Vector] = None) -> Vector:
        """World position of a point, m, after `kinematics`: ``"body.marker"``, or (body, place in the body frame)."""
        return _vector(lib.kt_point_position(self._m, self._data, *self._place(point)), out)

    def velocity(self, point: Union[str, Tuple[str, Point]], out: Optional[Vector] = None) -> Vector:
        """World velocity of a point, m/s, after `kinematics`."""
        return _vector(lib.kt_point_velocity(self._m, self._data, *self._place(point)), out)

    def acceleration(self, point: Union[str, Tuple[str, Point]], out: Optional[Vector] = None) -> Vector:
        """World acceleration of a point, m/s^2, after `kinematics`."""
        return _vector(lib.kt_point_acceleration(self._m, self._data, *self._place(point)), out)

    def pose(self, body: str, out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Rotation matrix (3 x 3) and origin (3) of a body in the world, after `kinematics`."""
        found = lib.kt_body_pose(self._m, self._data, self.model.body(body))
        rotation, origin = outputs(out, [(3, 3), (3,)])
        for column, axis in enumerate((found.rotation.x, found.rotation.y, found.rotation.z)):
            rotation[:, column] = axis.x, axis.y, axis.z
        return rotation, _vector(found.position, origin)

    def jacobian(self, point: Union[str, Tuple[str, Point]], out: Optional[Vector] = None) -> Vector:
        """The Jacobian of a point, 6 x nv, column-major: angular rows, then linear rows, world axes. After `kinematics`."""
        out = output(out, (6, self.model.nv), order="F")
        lib.kt_point_jacobian(self._m, self._data, *self._place(point), pointer(out))
        return out

    def energy(self) -> Tuple[float, float]:
        """Kinetic and potential energy of the bodies, J, after `kinematics`."""
        return lib.kt_kinetic_energy(self._m, self._data), lib.kt_potential_energy(self._m, self._data)


# Methods of C take arrays of doubles, and call those of Python for all other arguments.
for _name, _parameters in (("forward_dynamics", "q=None, v=None, tau=None, *, t=0.0, out=None"), ("inverse_dynamics", "q=None, v=None, a=None, *, out=None")):
    _method = getattr(Data, _name)
    setattr(Data, f"_convert_{_name}", _method)
    setattr(Data, _name, quicken(Data, _name, f"{_name}($self, {_parameters})\n--\n\n{_method.__doc__ or ''}".encode()))


def _data_at(model: Model, arrays: List[Vector]) -> Data:
    data = Data(model)
    for own, array in zip((*data._state.arrays, data.x), arrays):
        own[:] = array
    return data
