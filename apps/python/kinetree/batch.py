"""Many states of one model at once, in lanes and threads."""
from __future__ import annotations

from typing import Any, Optional, Tuple

import numpy as np

from ._core import ArgumentError, Fixed, Guard, Memory, doubles, fail, ffi, finite, lib, name_of, output, pointer
from .model import Model, Vector


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
    """

    def __init__(self, model: Model, states: int, threads: int = 1, method: Optional[str] = None) -> None:
        if isinstance(states, bool) or not isinstance(states, (int, np.integer)) or not 0 < states <= 1 << 32:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "states", f"expected a positive number of states, got {states!r}")
        if isinstance(threads, bool) or not isinstance(threads, (int, np.integer)) or not 0 < threads <= 1024:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "threads", f"expected 1 to 1024 threads, got {threads!r}")
        self.model, self.states, self.threads, self.method = model, int(states), int(threads), method
        self._guard, self._error = Guard(), ffi.new("kt_error *")
        options = ffi.new("kt_batch_options *", lib.kt_batch_options_default())
        options.states, options.threads = self.states, self.threads
        if method is not None:
            options.method = lib.kt_method_find(name_of(method, "method"))
            if options.method == ffi.NULL:
                raise ArgumentError(lib.KT_ERROR_ARGUMENT, "method", f"there is no method '{method}'; kinetree integrators lists them")
        size = lib.kt_batch_size(model._pointer, options)
        self._memory = Memory(max(size, 1))
        out = ffi.new("kt_batch **")
        self._check(lib.kt_batch_init(model._pointer, options, self._memory.pointer, size, out, self._error))
        self._batch = out[0]
        self._is_fixed = True

    def _check(self, status: int) -> None:
        if status:
            fail(self._error, status)

    def _rows(self, value: Any, count: int, what: str) -> Tuple[Optional[Vector], Any]:
        if value is None:
            return None, ffi.NULL
        array = doubles(value, (self.states, count), what)
        return array, pointer(array)

    def _all(self, t: float = 0.0, **arrays: Any) -> Any:
        """Rows for all states."""
        return ffi.new("kt_python_rows *", {"states": self.states, "nq": self.model.nq, "nv": self.model.nv, "nx": self.model.nx, "t": finite(t, "t"), **arrays})

    def _run(self, task: int, h: float = 0.0, steps: int = 0) -> None:
        job = ffi.new("kt_batch_job *", {"task": task, "h": h, "steps": steps})
        self._check(lib.kt_batch_run(self._batch, job, self.threads, ffi.NULL, self._error))

    def _own_states(self, X: Optional[Vector]) -> Tuple[Optional[Vector], Any]:
        """Rows of auxiliary states; the initial ones of the model if none are given."""
        return self._rows(np.tile(self.model.initial_x, (self.states, 1)) if X is None else X, self.model.nx, "X")

    def forward_dynamics(self, Q: Vector, V: Optional[Vector] = None, TAU: Optional[Vector] = None, *, X: Optional[Vector] = None, t: float = 0.0,
                         out: Optional[Vector] = None) -> Vector:
        """Accelerations of every state: arrays of states x nq, states x nv, and X of auxiliary states (default: the initial ones)."""
        m = self.model
        Q_, q = self._rows(Q, m.nq, "Q")
        V_, v = self._rows(V, m.nv, "V")
        TAU_, tau = self._rows(TAU, m.nv, "TAU")
        X_, x = self._own_states(X)
        out = output(out, (self.states, m.nv))
        with self._guard:
            self._check(lib.kt_python_batch_set(self._batch, self._all(t, q=q, v=v, tau=tau, x=x), self._error))
            self._run(lib.KT_BATCH_FORWARD)
            self._check(lib.kt_python_batch_get(self._batch, self._all(a=pointer(out)), self._error))
        del Q_, V_, TAU_, X_  # arrays live until here
        return out

    def inverse_dynamics(self, Q: Vector, V: Optional[Vector] = None, A: Optional[Vector] = None, *, out: Optional[Vector] = None) -> Vector:
        """Joint forces of the tree for accelerations, without effects."""
        m = self.model
        Q_, q = self._rows(Q, m.nq, "Q")
        V_, v = self._rows(V, m.nv, "V")
        A_, a = self._rows(np.zeros((self.states, m.nv)) if A is None else A, m.nv, "A")
        out = output(out, (self.states, m.nv))
        with self._guard:
            self._check(lib.kt_python_batch_set(self._batch, self._all(q=q, v=v, a=a), self._error))
            self._run(lib.KT_BATCH_INVERSE)
            self._check(lib.kt_python_batch_get(self._batch, self._all(tau=pointer(out)), self._error))
        del Q_, V_, A_
        return out

    def step(self, h: float, steps: int, Q: Vector, V: Vector, TAU: Optional[Vector] = None, *, X: Optional[Vector] = None,
             t: float = 0.0) -> Tuple[Vector, ...]:
        """Take steps of the method of this batch with constant joint forces, from auxiliary states X (default: the initial ones).

        Returns Q and V after them; and X, if the model has auxiliary states.
        """
        m = self.model
        if self.method is None:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "method", "the batch has no method; make it with model.batch(states, method='rk4')")
        Q_, q = self._rows(Q, m.nq, "Q")
        V_, v = self._rows(V, m.nv, "V")
        TAU_, tau = self._rows(np.zeros((self.states, m.nv)) if TAU is None else TAU, m.nv, "TAU")
        X_, x = self._own_states(X)
        next_q, next_v, next_x = (np.empty((self.states, count)) for count in (m.nq, m.nv, m.nx))
        if isinstance(steps, bool) or not isinstance(steps, (int, np.integer)) or not 0 <= steps < 1 << 31:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "steps", f"expected a number of steps, got {steps!r}")
        with self._guard:
            self._check(lib.kt_python_batch_set(self._batch, self._all(t, q=q, v=v, tau=tau, x=x), self._error))
            self._run(lib.KT_BATCH_STEP, finite(h, "h"), int(steps))
            self._check(lib.kt_python_batch_get(self._batch, self._all(q=pointer(next_q), v=pointer(next_v), x=pointer(next_x)), self._error))
        del Q_, V_, TAU_, X_
        return (next_q, next_v, next_x) if m.nx else (next_q, next_v)
