"""Gradients of a sum of costs over many steps."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, Callable, NamedTuple, Optional, Tuple

import numpy as np

from ._core import ArgumentError, Guard, Memory, Numbers, Vector, address, doubles, ffi, finite, lib, method_of, mistyped, number, output, pointer
from .callbacks import Calls
from .laws import copied
from .model import Model

CostFunction = Callable[[int, float, Vector, Vector, Vector], Tuple[float, Numbers, Numbers]]


class Gradient(NamedTuple):
    """The result of `Data.rollout_gradient`.

    Attributes
    ----------
    value : float
        The sum of costs.
    by_start : array of 2 nv + nx
        Its gradient by the state at the start: along q (`Model.add`), v and x.
    by_inputs : array of steps x nv
        Its gradient by the joint forces of each step.
    """

    value: float
    by_start: Vector
    by_inputs: Vector


class Cost:
    """A cost of Python that C evaluates at each point."""

    def __init__(self, model: Model, function: CostFunction) -> None:
        if not callable(function):
            raise mistyped("cost", "a function", function)
        self.model, self.function, self.calls = model, function, Calls()

    def evaluate(self, at: Any, value: Any, by_state: Any, by_tau: Any) -> None:
        m = self.model
        tau = copied(at.tau, m.nv) if at.tau != ffi.NULL else np.zeros(m.nv)
        found = self.function(at.step, at.t, copied(at.q, m.nq), copied(at.v, m.nv), tau)
        if not isinstance(found, (tuple, list)) or len(found) != 3:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "the result of the cost", f"expected the value and its gradients by the state and by tau, got {found!r}")
        value[0] = number(found[0], "the value of the cost")
        for to, given, count, what in ((by_state, found[1], 2 * m.nv + m.nx, "the gradient by the state"), (by_tau, found[2], m.nv, "the gradient by tau")):
            if to != ffi.NULL and count:
                array = doubles(given, (count,), what)
                ffi.memmove(to, array, array.nbytes)


class Gradients:
    """The part of `Data` for gradients of motions."""

    model: Model
    x: Vector
    _m: Any
    _data: Any
    _error: Any
    _guard: Guard
    _q: Any
    _v: Any

    def _check(self, status: Optional[int]) -> None:
        raise NotImplementedError

    def _time(self, t: Optional[float]) -> float:
        raise NotImplementedError

    def _workspace(self, name: str, size: int) -> Memory:
        raise NotImplementedError

    def rollout_gradient(self, h: float, inputs: Numbers, cost: CostFunction, *, q: Optional[Numbers] = None, v: Optional[Numbers] = None,
                         x: Optional[Numbers] = None, t: Optional[float] = None, method: str = "rk4", checkpoints: int = 0) -> Gradient:
        """The sum of costs over a motion of equal steps, and its exact gradients, at the cost of three to four motions.

        Parameters
        ----------
        h : float
            Length of a step, s.
        inputs : array of steps x nv
            Joint forces that are held during each step, N m or N.
        cost : callable
            A function ``cost(step, t, q, v, tau)`` of the state before each step, and after the last one with `tau` zero. It returns the
            value, its gradient by the state (2 nv + nx: along q, v and x), and its gradient by tau (nv).
        q, v, x : arrays of nq, nv and nx, optional
            The state at the start. Default: the arrays of this object, which stay as they are.
        t : float, optional
            Time at the start, s. Default: that of this object.
        method : str
            A one-step method that ``kinetree integrators`` lists.
        checkpoints : int
            States that are kept. The others are computed again. Default: all.

        Returns
        -------
        Gradient
            ``value``, ``by_start`` and ``by_inputs``.
        """
        m = self.model
        shape = np.shape(inputs)
        if len(shape) != 2 or shape[1] != m.nv:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "inputs", f"expected an array of steps x {m.nv}, got one of shape {shape}")
        rows = doubles(inputs, shape, "inputs")
        if isinstance(checkpoints, bool) or not isinstance(checkpoints, (int, np.integer)) or not 0 <= checkpoints < 1 << 31:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "checkpoints", f"expected an integer from 0, got {checkpoints!r}")
        x_ = doubles(self.x if x is None else x, (m.nx,), "x").copy()
        at = Cost(m, cost)
        handle, q, v = ffi.new_handle(at), address(q, (m.nq,), self._q, "q"), address(v, (m.nv,), self._v, "v")
        rollout = ffi.new("kt_rollout *", {"method": method_of(method, "method"), "t": self._time(t), "h": finite(h, "h"), "steps": len(rows),
                                           "inputs": pointer(rows), "checkpoints": checkpoints, "x": pointer(x_)})
        size = lib.kt_rollout_work_size(self._m, rollout)
        if size == 0:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "method", f"expected one step or more of a one-step method, got {len(rows)} of '{method}'")
        work, value = self._workspace("rollout", size), ffi.new("double *")
        by_start, by_inputs = output(None, (2 * m.nv + m.nx,)), output(None, (len(rows), m.nv))
        with self._guard:
            before = self.x.copy()
            status = lib.kt_rollout_gradient(self._m, self._data, work.pointer, work.array.size, rollout, q, v, value, pointer(by_start), pointer(by_inputs),
                                             lib.kt_python_cost, handle, self._error)
            self.x[:] = before
        at.calls.reraise()
        self._check(status)
        return Gradient(float(value[0]), by_start, by_inputs)
