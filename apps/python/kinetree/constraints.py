"""Loops, reactions and contacts at a state, and positions that reach targets."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, Dict, Iterable, List, Mapping, Optional, Sequence, Tuple

import numpy as np

from ._core import (ArgumentError, ConstraintError, Guard, Json, Numbers, Vector, address, doubles, ffi, finite, hint, lib, mistyped, name_of, output, pointer,
                    text)
from .model import Model, ModelCopy

_WRENCH = 6


class Constraints:
    """The part of `Data` for loops, effects and inverse kinematics."""

    model: Model
    q: Vector
    v: Vector
    _m: Any
    _data: Any
    _error: Any
    _guard: Guard
    _q: Any
    _v: Any
    _tau: Any
    _nq: Tuple[int, ...]
    _nv: Tuple[int, ...]
    _held: Dict[Tuple[str, ...], Any]

    def _check(self, status: Optional[int]) -> None:
        raise NotImplementedError

    def _time(self, t: Optional[float]) -> float:
        raise NotImplementedError

    def _need_kinematics(self) -> None:
        raise NotImplementedError

    def loop_equations(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, *, t: Optional[float] = None) -> Dict[str, Vector]:
        """The equations of all loops at a state: ``jacobian @ v = rate`` and ``jacobian @ a = drift`` for velocities and accelerations.

        Parameters
        ----------
        q, v : arrays of nq and nv, optional
            Positions (rad, m) and velocities (rad/s, m/s). Default: the arrays of this object.
        t : float, optional
            Time, s, for loops that move. Default: that of this object.

        Returns
        -------
        dict
            ``residual`` (equations), m or rad; ``jacobian`` (equations x nv); ``rate`` and ``drift`` (equations).
            `Model.equations` lists the loop of each equation.
        """
        count, nv = len(self.model.equations), self.model.nv
        jacobian = np.zeros((count, nv), order="F")
        residual, rate, drift = np.zeros(count), np.zeros(count), np.zeros(count)
        q, v = address(q, self._nq, self._q, "q"), address(v, self._nv, self._v, "v")
        with self._guard:
            self._check(lib.kt_loop_equations(self._m, self._data, self._time(t), q, v, pointer(jacobian), pointer(residual), pointer(rate), pointer(drift),
                                              self._error))
        return {"residual": residual, "jacobian": jacobian, "rate": rate, "drift": drift}

    def multipliers(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, tau: Optional[Numbers] = None, *,
                    t: Optional[float] = None, out: Optional[Vector] = None) -> Vector:
        """The multipliers of the loops: ``M a + h = tau + effects + jacobian.T @ multipliers``.

        Parameters
        ----------
        q, v, tau : arrays of nq, nv and nv, optional
            Positions (rad, m), velocities (rad/s, m/s), joint forces (N m, N). Default: the arrays of this object.
        t : float, optional
            Time, s. Default: that of this object.
        out : array of the number of equations, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            One number for each equation: N for a residual in m, N m for one in rad.
        """
        q, v, tau = address(q, self._nq, self._q, "q"), address(v, self._nv, self._v, "v"), address(tau, self._nv, self._tau, "tau")
        out = output(out, (len(self.model.equations),))
        with self._guard:
            self._check(lib.kt_multiplier_evaluate(self._m, self._data, self._time(t), q, v, tau, ffi.NULL, pointer(out), self._error))
        return out

    def reactions(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, tau: Optional[Numbers] = None, *,
                  t: Optional[float] = None) -> Tuple[Vector, Vector]:
        """The reactions in all joints and loops, with those of closed contacts.

        Parameters
        ----------
        q, v, tau : arrays of nq, nv and nv, optional
            Positions (rad, m), velocities (rad/s, m/s), joint forces (N m, N). Default: the arrays of this object.
        t : float, optional
            Time, s. Default: that of this object.

        Returns
        -------
        tuple of numpy.ndarray
            bodies x 6: the moment, N m, and the force, N, of the parent on each body across its joint, world axes; and loops x 6, on the
            second end of each loop about the point of the first one.
        """
        q, v, tau = address(q, self._nq, self._q, "q"), address(v, self._nv, self._v, "v"), address(tau, self._nv, self._tau, "tau")
        joints, loops = np.zeros((self.model.body_count, _WRENCH)), np.zeros((len(self.model.loops), _WRENCH))
        with self._guard:
            self._check(lib.kt_reaction_evaluate(self._m, self._data, self._time(t), q, v, tau, ffi.NULL, ffi.cast("kt_wrench *", pointer(joints)),
                                                 ffi.cast("kt_wrench *", pointer(loops)), self._error))
        return joints, loops

    def effect_quantities(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, *, t: Optional[float] = None) -> List[Json]:
        """The forces and motions of all effects, in the order of the scene.

        Parameters
        ----------
        q, v : arrays of nq and nv, optional
            Positions (rad, m) and velocities (rad/s, m/s). Default: the arrays of this object.
        t : float, optional
            Time, s. Default: that of this object.

        Returns
        -------
        list of dict
            For each effect its ``name``, ``type`` and quantities, such as ``force``, ``power``, ``normal`` or ``depth``, in SI units and radians.
            A force is NaN while a closed contact carries it (`reactions`).
        """
        m = self.model
        counts = [lib.kt_effect_quantity_count(self._m, i) for i in range(lib.kt_effect_count(self._m))]
        values = np.zeros(sum(counts))
        q, v = address(q, self._nq, self._q, "q"), address(v, self._nv, self._v, "v")
        with self._guard:
            self._check(lib.kt_kinematics_update(self._m, self._data, q, v, ffi.NULL, self._error))
            self._check(lib.kt_effect_quantities_evaluate(self._m, self._data, self._time(t), q, v, pointer(values), self._error))
        found, at = [], 0
        for i, ((name, kind), count) in enumerate(zip(m.effect_types, counts)):
            sliding = lib.kt_effect_is_sliding(self._m, i)
            names = [text(lib.kt_quantity_name(lib.kt_effect_quantity_at(self._m, i, k), sliding)) for k in range(count)]
            found.append({"name": name, "type": kind, **dict(zip(names, values[at:at + count].tolist()))})
            at += count
        return found

    def contacts(self, q: Optional[Numbers] = None, v: Optional[Numbers] = None, *, t: Optional[float] = None) -> List[Json]:
        """The elastic contacts that touch at a state, with their points and forces.

        Parameters
        ----------
        q, v : arrays of nq and nv, optional
            Positions (rad, m) and velocities (rad/s, m/s). Default: the arrays of this object.
        t : float, optional
            Time, s. Default: that of this object.

        Returns
        -------
        list of dict
            ``name``; ``point`` (3) in the world, m; ``force`` (3) of the plane on the body, world axes, N; ``depth``, m; ``slip``, m/s.
        """
        found = []
        for i, each in enumerate(self.effect_quantities(q, v, t=t)):
            if each["type"] != "contact" or not each["depth"] > 0.0:
                continue
            load = ffi.new("kt_effect_load *")
            with self._guard:
                self._check(lib.kt_effect_evaluate(self._m, self._data, self._time(t), address(q, self._nq, self._q, "q"),
                                                   address(v, self._nv, self._v, "v"), i, load, self._error))
            force = load.wrench[0].force
            found.append({"name": each["name"], "point": np.array([each["x"], each["y"], each["z"]]), "force": np.array([force.x, force.y, force.z]),
                          "depth": each["depth"], "slip": each["slip"]})
        return found

    def place(self, loop: str, out: Optional[Vector] = None) -> Vector:
        """The place on the world where a loop is closed at the positions of `kinematics`: a foothold.

        Set it as ``"loop NAME.place"`` in a copy of the model (`ModelCopy.set`, `Simulation.set`).

        Parameters
        ----------
        loop : str
            The name of a weld, hinge or pin with one end on the world.
        out : array of 6, optional
            Where to write. Default: a new array.

        Returns
        -------
        numpy.ndarray
            The point, m, and the rotation vector of the end's frame, rad, in world axes.
        """
        self._need_kinematics()
        out = output(out, (6,))
        found = lib.kt_loop_find(self._m, name_of(loop, "loop"))
        if found < 0:
            loops = [text(lib.kt_loop_name(self._m, i)) for i in range(lib.kt_loop_count(self._m))]
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "loop", f"there is no loop '{loop}'{hint(loop, loops)}")
        self._check(lib.kt_loop_place_here(self._m, self._data, found, pointer(out), self._error))
        return out

    # ---- positions --------------------------------------------------------------------------------------------------

    def _holding(self, joints: Sequence[str]) -> "Constraints":
        """Data of a copy of the model whose assembly keeps these joints."""
        if isinstance(joints, str) or not isinstance(joints, Iterable) or not all(isinstance(each, str) for each in joints):
            raise mistyped("hold", "a list of names of joints", joints)
        key = tuple(joints)
        if key not in self._held:
            names = {text(lib.kt_joint_name(self._m, i)): text(lib.kt_body_name(self._m, i)) for i in range(1, self.model.body_count)}
            copy = ModelCopy(self.model)
            for each in key:
                if each not in names:
                    raise ArgumentError(lib.KT_ERROR_ARGUMENT, "hold", f"there is no joint '{each}'{hint(each, list(names))}")
                copy.set(f"{names[each]}.hold", 1.0)
            self._held[key] = copy.data()
        held: Constraints = self._held[key]
        return held

    def inverse_kinematics(self, targets: Mapping[str, Numbers], q: Optional[Numbers] = None, *, hold: Sequence[str] = (), t: Optional[float] = None,
                           tolerance: float = 1e-10, iterations: int = 200) -> Tuple[Vector, float]:
        """Positions whose points are at targets, in the sense of least squares. All loops stay closed.

        The method is that of Levenberg and Marquardt along the loops, with a projection after each step.

        Parameters
        ----------
        targets : mapping
            The place in the world, m, for each ``"body"`` or ``"body.marker"``. A NaN leaves a component free.
        q : array of nq, optional
            Positions at the start, rad or m. Default: those of this object, which stay as they are.
        hold : list of str
            Joints that do not move.
        t : float, optional
            Time, s, for loops that move. Default: that of this object.
        tolerance : float
            Distance, m, below which the targets count as reached.
        iterations : int
            The largest number of steps.

        Returns
        -------
        tuple
            q, and the distance from the targets: the root of the sum of squares, m. It is above `tolerance` if they are out of reach.
        """
        problem = _Reach(self, targets, hold, self._time(t))
        at = problem.closed(doubles(self.q if q is None else q, self._nq, "q").copy())
        if at is None:
            raise ConstraintError(lib.KT_ERROR_CONSTRAINT, "q", "the loops cannot be closed at the start; give positions nearer to a closed state")
        if isinstance(iterations, bool) or not isinstance(iterations, (int, np.integer)) or not 0 <= iterations <= 1000000:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "iterations", f"expected an integer from 0 to 1000000, got {iterations!r}")
        return problem.solve(at, finite(tolerance, "tolerance", 0.0), int(iterations))


class _Reach:
    """The least squares of `Constraints.inverse_kinematics`."""

    def __init__(self, data: Any, targets: Mapping[str, Numbers], hold: Sequence[str], t: float) -> None:
        self.data, self.model, self.t = data._holding(()), data.model, t
        if not isinstance(targets, Mapping) or not targets:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "targets", f"expected a mapping such as {{'arm.tip': [1, 0, 0]}}, got {targets!r}")
        self.points = list(targets)
        self.wanted = np.concatenate([doubles(each, (3,), f"target of '{name}'") for name, each in targets.items()])
        self.used = np.isfinite(self.wanted)
        data._holding(hold)  # rejects wrong names
        self.free = np.ones(self.model.nv, bool)
        for name in hold:
            self.free[self.model.joints[name][1]] = False

    def residual(self, q: Vector) -> Vector:
        self.data.kinematics(q)
        found = np.concatenate([self.data.position(each) for each in self.points]) - self.wanted
        return np.asarray(found[self.used])

    def closed(self, q: Vector) -> Optional[Vector]:
        """The position with closed loops next to `q`, without a change of the joints that are held. None: there is none near."""
        for _ in range(20):
            equations = self.data.loop_equations(q, np.zeros(self.model.nv), t=self.t)
            if not equations["residual"].size or np.abs(equations["residual"]).max() < 1e-13:
                return q
            step = np.zeros(self.model.nv)
            step[self.free] = -np.linalg.lstsq(equations["jacobian"][:, self.free], equations["residual"], rcond=1e-10)[0]
            q = self.model.add(q, step)
        return q if np.abs(equations["residual"]).max() < 1e-9 else None

    def directions(self, q: Vector) -> Vector:
        """An orthonormal basis of the motions that loops and held joints allow."""
        basis = np.eye(self.model.nv)[:, self.free]
        jacobian = self.data.loop_equations(q, np.zeros(self.model.nv), t=self.t)["jacobian"][:, self.free]
        if jacobian.size:
            _, sizes, rows = np.linalg.svd(jacobian)
            rank = int(np.count_nonzero(sizes > 1e-10 * max(sizes[0], 1e-300)))
            basis = basis @ rows[rank:].T
        return np.asarray(basis)

    def solve(self, q: Vector, tolerance: float, iterations: int) -> Tuple[Vector, float]:
        residual, damping = self.residual(q), 1e-6
        for _ in range(iterations):
            distance = float(np.linalg.norm(residual))
            if distance <= tolerance:
                break
            self.data.kinematics(q)
            basis = self.directions(q)
            jacobian = np.concatenate([self.data.jacobian(each)[3:] for each in self.points])[self.used] @ basis
            normal, gradient = jacobian.T @ jacobian, jacobian.T @ residual
            scale = max(float(np.trace(normal)), 1e-300)
            if not gradient.size or np.linalg.norm(gradient) <= 1e-14 * np.sqrt(scale) * distance:
                break
            while damping < 1e12:
                step = -np.linalg.solve(normal + damping * scale * np.eye(len(gradient)), gradient)
                tried = self.closed(self.model.add(q, basis @ step))
                after = None if tried is None else self.residual(tried)
                if tried is not None and after is not None and np.linalg.norm(after) < distance:
                    q, residual, damping = tried, after, max(damping / 10.0, 1e-15)
                    break
                damping *= 10.0
            else:
                break
        return q, float(np.linalg.norm(residual))
