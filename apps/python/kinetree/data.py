"""Evaluations at a state: dynamics, derivatives, constraints and kinematics."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, Dict, List, Optional, Sequence, Tuple, Union

import numpy as np

from ._core import (ArgumentError, Fixed, Guard, Memory, Numbers, StepError, Vector, address, address_number, apart, busy, check, doubles, fail, ffi, finite,
                    lib, method_of, output, outputs, pointer)
from ._kinetree import Evaluator, quicken
from .constraints import Constraints
from .gradients import Gradients
from .identification import Identification
from .laws import copied
from .model import Model, Point, State, vector, vector3

_forward, _inverse = lib.kt_python_forward, lib.kt_python_inverse


class Data(Evaluator, Constraints, Gradients, Identification, Fixed):  # type: ignore[misc]
    """A workspace, and the evaluations at a state (t, q, v).

    All calls release the interpreter lock. Two threads must not share a `Data`; a second thread gets `Busy`.

    Attributes
    ----------
    q, v, tau, a : arrays of nq, nv, nv and nv
        Positions (rad, m), velocities (rad/s, m/s), joint forces (N m, N) and accelerations (rad/s^2, m/s^2). A call without arguments uses
        them in place, which is the fastest way. At first `q` and `v` are those of the scene, whose loops may be open: `assemble` closes
        them, and the evaluations do not.
    x : array of nx
        Auxiliary states, which all calls read.
    t : float
        Time, s, of calls without a time. 0 at the start.

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
        self.x = self._memory.view(lib.kt_auxiliary_states(self._m, self._data), model.nx)
        self.x.flags.writeable = True
        self._work: Dict[str, Memory] = {}
        self._held: Dict[Tuple[str, ...], Any] = {}
        self._is_placed = self._is_accelerated = False
        self._has_a = ffi.new("bool *")
        self._state = State(model.nq, model.nv)
        self.q, self.v, self.tau, self.a = self._state.arrays
        self._q, self._v, self._tau, self._a = self._state.pointers
        self.q[:], self.v[:] = model.initial
        self._nq, self._nv = (model.nq,), (model.nv,)
        self._call = ffi.new("kt_python_data *", {"guard": self._guard.pointer, "model": self._m, "data": self._data, "error": self._error,
                                                  "nq": model.nq, "nv": model.nv, "q": self._q, "v": self._v, "tau": self._tau, "a": self._a, "has_a": self._has_a})
        owners = self._call, self._m, self._memory, self._guard.pointer, self._error, self._has_a
        self._set_up(address_number(self._call), self._nv, self.a, owners)
        self._is_fixed = True

    def __reduce__(self) -> Any:
        return _data_at, (self.model, [array.copy() for array in (*self._state.arrays, self.x)], self.t)

    def __deepcopy__(self, memo: Any) -> "Data":
        return _data_at(*self.__reduce__()[1])

    @property
    def t(self) -> float:
        """Time, s, of calls without a time."""
        return float(self._call.t)

    @t.setter
    def t(self, t: float) -> None:
        self._call.t = finite(t, "t")

    def _time(self, t: Optional[float]) -> float:
        return float(self._call.t) if t is None else finite(t, "t")

    def _check(self, status: Optional[int]) -> None:
        if status:
            if status == lib.KT_PYTHON_BUSY:
                raise busy()
            for effect in self.model.effects:
                effect.calls.reraise()
            fail(self._error, status)

    # ---- dynamics ---------------------------------------------------------------------------------------------------

    def forward_dynamics(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, tau: Optional[Numbers] = None, *,
                         t: Optional[float] = None, out: Optional[Vector] = None) -> Vector:
        """Accelerations of the whole mechanism, with effects and loops.

        Parameters
        ----------
        q, v, tau : arrays of nq, nv and nv, optional
            Positions (rad, m), velocities (rad/s, m/s), joint forces (N m, N). Default: the arrays of this object.
        t : float, optional
            Time, s. Default: that of this object.
        out : array of nv, optional
            Where to write. Default: `self.a` if no state is given, else a new array.

        Returns
        -------
        numpy.ndarray
            nv accelerations, rad/s^2 or m/s^2.
        """
        if q is None and v is None and tau is None and out is None:
            out = self.a
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        tau = address(tau, self._nv, self._tau, "tau")
        out = output(out, self._nv)
        self._check(_forward(self._call, self._time(t), q, v, tau, pointer(out)))
        return out

    def inverse_dynamics(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, a: Optional[Numbers] = None, *,
                         out: Optional[Vector] = None) -> Vector:
        """Joint forces of the tree for accelerations, by the recursive Newton-Euler algorithm, without effects.

        Parameters
        ----------
        q, v, a : arrays of nq, nv and nv, optional
            Positions (rad, m), velocities (rad/s, m/s), accelerations (rad/s^2, m/s^2). Default: the arrays of this object.
        out : array of nv, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            nv joint forces, N m or N.
        """
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        a = address(a, self._nv, self._a, "a")
        out = output(out, self._nv)
        self._check(_inverse(self._call, q, v, a, pointer(out)))
        return out

    def mass_matrix(self, q: Optional[Numbers] = None, *, out: Optional[Vector] = None) -> Vector:
        """The mass matrix of the tree.

        Parameters
        ----------
        q : array of nq, optional
            Positions, rad or m. Default: the array of this object.
        out : array of nv x nv, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            nv x nv, symmetric, kg m^2 or kg.
        """
        m, given = self.model, (q,)
        q = address(q, self._nq, self._q, "q")
        out = apart(output(out, (m.nv, m.nv)), given)
        with self._guard:
            self._check(lib.kt_dynamics_mass(self._m, self._data, q, pointer(out), self._error))
        return out

    def bias(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, *, out: Optional[Vector] = None) -> Vector:
        """The bias force h of the tree: inverse dynamics for accelerations of zero.

        Parameters
        ----------
        q, v : arrays of nq and nv, optional
            Positions (rad, m) and velocities (rad/s, m/s). Default: the arrays of this object.
        out : array of nv, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            nv joint forces, N m or N: of gravity, and of Coriolis and centrifugal effects.
        """
        return self.inverse_dynamics(q, v, np.zeros(self.model.nv), out=out)

    def effect_forces(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, *, t: Optional[float] = None, out: Optional[Vector] = None) -> Vector:
        """Generalised forces of all effects: springs, dampers, motors and others.

        Parameters
        ----------
        q, v : arrays of nq and nv, optional
            Positions (rad, m) and velocities (rad/s, m/s). Default: the arrays of this object.
        t : float, optional
            Time, s. Default: that of this object.
        out : array of nv, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            nv joint forces, N m or N.
        """
        m = self.model
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        out = output(out, (m.nv,))
        with self._guard:
            self._check(lib.kt_effect_forces(self._m, self._data, self._time(t), q, v, pointer(out), self._error))
        return out

    def _workspace(self, name: str, size: int) -> Memory:
        if name not in self._work or self._work[name].array.size < size:
            self._work[name] = Memory(size)
        return self._work[name]

    def forward_derivatives(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, tau: Optional[Numbers] = None, *,
                            t: Optional[float] = None, out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Exact derivatives of `forward_dynamics` with respect to q (tangent), v and tau.

        Parameters
        ----------
        q, v, tau : arrays of nq, nv and nv, optional
            Positions (rad, m), velocities (rad/s, m/s), joint forces (N m, N). Default: the arrays of this object.
        t : float, optional
            Time, s. Default: that of this object.
        out : tuple of three arrays of nv x nv, optional
            Where to write, in column-major order (``order="F"``). Default: new arrays.

        Returns
        -------
        tuple of numpy.ndarray
            Three nv x nv matrices of column-major order. Column i is the derivative by number i.
        """
        m, given = self.model, (q, v, tau)
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        tau = address(tau, self._nv, self._tau, "tau")
        size = lib.kt_acceleration_work_size(self._m)
        work = self._workspace("acceleration", size)
        by = outputs(out, [(m.nv, m.nv)] * 3, "F", given)
        with self._guard:
            self._check(lib.kt_acceleration_derivatives(self._m, self._data, work.pointer, size, self._time(t), q, v, tau, ffi.NULL,
                                                        pointer(by[0]), pointer(by[1]), pointer(by[2]), self._error))
        return by

    def step(self, h: float, q: Optional[Numbers] = None, v: Optional[Numbers] = None, tau: Optional[Numbers] = None, *,
             x: Optional[Numbers] = None, t: Optional[float] = None, method: str = "rk4", out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """One step of a method, as a function of the state.

        Parameters
        ----------
        h : float
            Length of the step, s.
        q, v, tau, x : arrays of nq, nv, nv and nx, optional
            Positions (rad, m), velocities (rad/s, m/s), joint forces (N m, N), auxiliary states. Default: the arrays of this object, which
            stay as they are.
        t : float, optional
            Time at the start of the step, s. Default: that of this object.
        method : str
            A one-step method that ``kinetree integrators`` lists.
        out : tuple of arrays, optional
            Where to write q and v (and x).

        Returns
        -------
        tuple of numpy.ndarray
            q and v after the step; and x, if the model has auxiliary states.
        """
        taken, step, work = self._step(h, q, v, tau, x, t, method)
        m = self.model
        results = outputs(out, [(count,) for count in (m.nq, m.nv, m.nx)[:3 if m.nx else 2]], inputs=(q, v, tau, x))
        with self._guard:
            before = self.x.copy()
            self._check(lib.kt_step_evaluate(self._m, self._data, work.pointer, work.array.size, step, taken[0], taken[1], pointer(results[0]),
                                             pointer(results[1]), self._error))
            if m.nx:
                results[2][:] = self.x
            self.x[:] = before
        return results

    def step_derivatives(self, h: float, q: Optional[Numbers] = None, v: Optional[Numbers] = None, tau: Optional[Numbers] = None, *,
                         x: Optional[Numbers] = None, t: Optional[float] = None, method: str = "rk4",
                         out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Exact derivatives of a step: A by the state, B by the joint forces.

        A change of the state is (xi, dv, dx): q moves along xi (`Model.add`), and n = 2 nv + nx numbers describe it.

        Parameters
        ----------
        h : float
            Length of the step, s.
        q, v, tau, x : arrays of nq, nv, nv and nx, optional
            Positions (rad, m), velocities (rad/s, m/s), joint forces (N m, N), auxiliary states. Default: the arrays of this object, which
            stay as they are.
        t : float, optional
            Time at the start of the step, s. Default: that of this object.
        method : str
            An explicit Runge-Kutta method that ``kinetree integrators`` lists.
        out : tuple of two arrays, optional
            Where to write, in column-major order (``order="F"``). Default: new arrays.

        Returns
        -------
        tuple of numpy.ndarray
            A, n x n, and B, n x nv, of column-major order.
        """
        m = self.model
        taken, step, work = self._step(h, q, v, tau, x, t, method)
        n = 2 * m.nv + m.nx
        A, B = outputs(out, [(n, n), (n, m.nv)], "F", (q, v, tau, x))
        with self._guard:
            before = self.x.copy()
            self._check(lib.kt_step_derivatives(self._m, self._data, work.pointer, work.array.size, step, taken[0], taken[1], ffi.NULL, ffi.NULL,
                                                pointer(A), pointer(B), self._error))
            self.x[:] = before
        return A, B

    def _step(self, h: float, q: Any, v: Any, tau: Any, x: Any, t: Optional[float], method: str) -> Any:
        m = self.model
        found = method_of(method, "method")
        taken = (address(q, self._nq, self._q, "q"), address(v, self._nv, self._v, "v"), address(tau, self._nv, self._tau, "tau"),
                 address(x, (m.nx,), ffi.NULL, "x"))
        step = ffi.new("kt_step *", {"method": found, "t": self._time(t), "h": finite(h, "h"), "tau": taken[2], "x": taken[3]})
        size = lib.kt_step_work_size(self._m, found)
        if size == 0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "method", f"a step of '{method}' depends on earlier steps; use rk4 or another one-step method")
        return taken, step, self._workspace("step " + method, size)

    # ---- constraints ------------------------------------------------------------------------------------------------

    def assemble(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, *, t: Optional[float] = None, hold: Sequence[str] = (),
                 out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Close the loops of a state that may be far from closed.

        Parameters
        ----------
        q, v : arrays of nq and nv, optional
            Positions (rad, m) and velocities (rad/s, m/s). Default: the arrays of this object, which the call then changes.
        t : float, optional
            Time, s, for loops that move. Default: that of this object.
        hold : list of str
            Joints that keep their positions, as `hold` of a scene.
        out : tuple of arrays of nq and nv, optional
            Where to write. Default: new arrays for those that are given.

        Returns
        -------
        tuple of numpy.ndarray
            q and v.
        """
        if not hold:
            return self._closed(lib.kt_state_assemble, q, v, t, out)
        held: Any = self._holding(hold)
        return self._closed(lambda _, __, t, q, v, error: lib.kt_state_assemble(held._m, held._data, t, q, v, error), q, v, t, out)

    def project(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, *, t: Optional[float] = None,
                out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Move a state by the least step until all loops are closed to rounding.

        Parameters
        ----------
        q, v : arrays of nq and nv, optional
            Positions (rad, m) and velocities (rad/s, m/s). Default: the arrays of this object, which the call then changes.
        t : float, optional
            Time, s, for loops that move. Default: that of this object.
        out : tuple of arrays of nq and nv, optional
            Where to write. Default: new arrays for those that are given.

        Returns
        -------
        tuple of numpy.ndarray
            q and v.
        """
        changed = ffi.new("bool *")
        return self._closed(lambda m, d, t, q, v, e: lib.kt_state_project(m, d, t, q, v, changed, e), q, v, t, out)

    def _closed(self, call: Any, q: Any, v: Any, t: Optional[float], out: Any) -> Tuple[Vector, ...]:
        own = self.q, self.v
        given = [doubles(mine if value is None else value, mine.shape, what).copy() for value, mine, what in zip((q, v), own, "qv")]
        at = outputs(out, [self._nq, self._nv]) if out is not None else tuple(mine if value is None else new for value, mine, new in zip((q, v), own, given))
        with self._guard:
            self._check(call(self._m, self._data, self._time(t), pointer(given[0]), pointer(given[1]), self._error))
            for target, values in zip(at, given):
                target[:] = values
        return at

    # ---- kinematics -------------------------------------------------------------------------------------------------

    def kinematics(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, a: Optional[Numbers] = None) -> "Data":
        """Compute the poses, velocities and accelerations that `position`, `jacobian`, `energy` and the other queries read.

        Parameters
        ----------
        q, v, a : arrays of nq, nv and nv, optional
            Positions (rad, m), velocities (rad/s, m/s), accelerations (rad/s^2, m/s^2). Default: the arrays of this object.

        Returns
        -------
        Data
            This object.
        """
        own = q is None and v is None and (self._has_a[0] or bool(self.a.any()))
        is_accelerated = a is not None or own
        q = address(q, self._nq, self._q, "q")
        v = address(v, self._nv, self._v, "v")
        a = address(a, self._nv, self._a, "a")
        with self._guard:
            self._check(lib.kt_kinematics_update(self._m, self._data, q, v, a, self._error))
        self._is_placed, self._is_accelerated = True, is_accelerated
        if lib.kt_effect_count(self._m):
            self._placed = copied(q, self.model.nq), copied(v, self.model.nv)
        return self

    def _need_kinematics(self) -> None:
        if not self._is_placed:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "kinematics", "no state has been given; call data.kinematics(q, v) first")

    def _place(self, point: Union[str, Tuple[str, Point]]) -> Tuple[int, Any]:
        self._need_kinematics()
        if isinstance(point, str):
            body, at = self.model.point(point)
        elif isinstance(point, (tuple, list)) and len(point) == 2:
            body, at = self.model.body(point[0]), doubles(point[1], (3,), "point")
            if not np.isfinite(at).all():
                raise StepError(lib.KT_ERROR_NOT_FINITE, "point", f"expected finite numbers, got {at.tolist()}")
        else:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "point", f'expected "body", "body.marker" or (body, place in its frame), got {point!r}')
        return body, vector3(at)

    def position(self, point: Union[str, Tuple[str, Point]], out: Optional[Vector] = None) -> Vector:
        """World position of a point after `kinematics`.

        Parameters
        ----------
        point : str or tuple
            ``"body"``, ``"body.marker"``, or (body, place in the frame of the body, m).
        out : array of 3, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            Three numbers along world axes, m.
        """
        return vector(lib.kt_point_position(self._m, self._data, *self._place(point)), out)

    def velocity(self, point: Union[str, Tuple[str, Point]], out: Optional[Vector] = None) -> Vector:
        """World velocity of a point after `kinematics`.

        Parameters
        ----------
        point : str or tuple
            ``"body"``, ``"body.marker"``, or (body, place in the frame of the body, m).
        out : array of 3, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            Three numbers along world axes, m/s.
        """
        return vector(lib.kt_point_velocity(self._m, self._data, *self._place(point)), out)

    def acceleration(self, point: Union[str, Tuple[str, Point]], out: Optional[Vector] = None) -> Vector:
        """World acceleration of a point after `kinematics` with accelerations.

        These are those that `kinematics` was given, or those of this object if `forward_dynamics` or the program wrote them.

        Parameters
        ----------
        point : str or tuple
            ``"body"``, ``"body.marker"``, or (body, place in the frame of the body, m).
        out : array of 3, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            Three numbers along world axes, m/s^2.
        """
        self._need_kinematics()
        if not self._is_accelerated:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "acceleration", "nobody has computed the accelerations of this state; call "
                                "data.kinematics(q, v, data.forward_dynamics(q, v, tau)), or pass a=np.zeros(nv) for the part of velocities")
        return vector(lib.kt_point_acceleration(self._m, self._data, *self._place(point)), out)

    def pose(self, body: str, out: Optional[Sequence[Vector]] = None) -> Tuple[Vector, ...]:
        """Orientation and place of a body in the world after `kinematics`.

        Parameters
        ----------
        body : str
            The name of the body.
        out : tuple of arrays of 3 x 3 and 3, optional
            Where to write. Default: new arrays.

        Returns
        -------
        tuple of numpy.ndarray
            The rotation matrix, whose columns are the axes of the body in the world, and the origin of the body, m.
        """
        self._need_kinematics()
        found = lib.kt_body_pose(self._m, self._data, self.model.body(body))
        rotation, origin = outputs(out, [(3, 3), (3,)])
        for column, axis in enumerate((found.rotation.x, found.rotation.y, found.rotation.z)):
            rotation[:, column] = axis.x, axis.y, axis.z
        return rotation, vector(found.position, origin)

    def jacobian(self, point: Union[str, Tuple[str, Point]], out: Optional[Vector] = None) -> Vector:
        """The Jacobian of a point after `kinematics`.

        Parameters
        ----------
        point : str or tuple
            ``"body"``, ``"body.marker"``, or (body, place in the frame of the body, m).
        out : array of 6 x nv, optional
            Where to write, in column-major order (``order="F"``). Default: a new array.

        Returns
        -------
        numpy.ndarray
            6 x nv, column-major. The first three rows times v are the angular velocity of the body, the others the velocity of the point,
            along world axes.
        """
        out = output(out, (6, self.model.nv), order="F")
        lib.kt_point_jacobian(self._m, self._data, *self._place(point), pointer(out))
        return out

    def energy(self) -> Tuple[float, float]:
        """Kinetic and potential energy after `kinematics`, as `Simulation.sense` and records have them.

        Returns
        -------
        tuple of float
            Kinetic energy, and potential energy of gravity and effects, J. It is NaN with a force by a function.
        """
        self._need_kinematics()
        kinetic, potential = lib.kt_kinetic_energy(self._m, self._data), lib.kt_potential_energy(self._m, self._data)
        if lib.kt_effect_count(self._m):
            q, v = self._placed
            with self._guard:
                potential += lib.kt_effect_energy(self._m, self._data, self.t, pointer(q), pointer(v))
        return kinetic, potential

    def mass_center(self) -> Tuple[float, Vector]:
        """Mass and centre of mass of the moving bodies after `kinematics`.

        Returns
        -------
        tuple
            The mass, kg, and the centre in the world, m.
        """
        self._need_kinematics()
        center = ffi.new("kt_vec3 *")
        return lib.kt_mass_center(self._m, self._data, center), vector(center)

    def momentum(self) -> Vector:
        """Momentum of all bodies after `kinematics`.

        Returns
        -------
        numpy.ndarray
            Six numbers along world axes: the angular momentum about the origin of the world, N m s, and the linear momentum, N s.
        """
        self._need_kinematics()
        found = lib.kt_momentum(self._m, self._data)
        return np.concatenate([vector(found.moment), vector(found.force)])

    @property
    def pointer(self) -> Any:
        """The ``kt_data *`` for calls of `kinetree.lib`. It is valid as long as this object."""
        return self._data

    def __repr__(self) -> str:
        return f"<kinetree.Data of '{self.model.name}': nq {self.model.nq}, nv {self.model.nv}>"


# Methods of C take arrays of doubles, and call those of Python for all other arguments.
for _name, _parameters in (("forward_dynamics", "q=None, v=None, tau=None, *, t=None, out=None"), ("inverse_dynamics", "q=None, v=None, a=None, *, out=None")):
    _method = getattr(Data, _name)
    setattr(Data, f"_convert_{_name}", _method)
    setattr(Data, _name, quicken(Data, _name, f"{_name}($self, {_parameters})\n--\n\n{_method.__doc__ or ''}".encode()))


def _data_at(model: Model, arrays: List[Vector], t: float) -> Data:
    data = Data(model)
    data.t = t
    for own, array in zip((*data._state.arrays, data.x), arrays):
        own[:] = array
    return data
