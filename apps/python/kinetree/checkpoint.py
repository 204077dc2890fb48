"""Checkpoints and copies of a simulation."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import copy
import hashlib
from typing import Any, List, Sequence

import numpy as np

from ._core import ArgumentError, Guard, Json, Memory, Vector, ffi, lib, mistyped
from .laws import Event
from .model import Model
from .watch import Watch

_DIGEST = 16  # bytes that guard a checkpoint


class Checkpoint:
    """The part of a `Simulation` that saves, restores and copies it."""

    torque: Vector
    _applied: Vector
    _simulation: Any
    _error: Any
    _guard: Guard
    _watch: Watch
    _events: List[Event]
    _given: Model
    _how: Json

    def _check(self, status: int) -> None:
        raise NotImplementedError

    def _synchronise(self) -> None:
        raise NotImplementedError

    def save(self) -> bytes:
        """A checkpoint of the state, the torques and the memory of the method. All later results have the same bits after `restore`."""
        size = lib.kt_simulation_state_size(self._simulation)
        block = Memory(size)
        with self._guard:
            lib.kt_simulation_save(self._simulation, block.pointer)
        content = block.array.tobytes() + self.torque.tobytes()
        return _digest(content) + content

    def restore(self, block: bytes) -> None:
        """Continue from a checkpoint of the same scene and run. The duration may differ if `run` has not begun.

        Parameters
        ----------
        block : bytes
            The result of `save`, also of another process. Bytes that were changed since then are rejected.
        """
        size = lib.kt_simulation_state_size(self._simulation)
        whole = _DIGEST + size + self.torque.nbytes
        if not isinstance(block, (bytes, bytearray)):
            raise mistyped("block", "the bytes of `save`", block)
        if len(block) != whole:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "restore", f"a checkpoint of this simulation has {whole} bytes, got {len(block)} bytes")
        content = bytes(block[_DIGEST:])
        if _digest(content) != block[:_DIGEST]:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "restore", "the checkpoint is damaged: its bytes are not those that save() returned")
        memory = Memory(size)
        memory.array[:] = np.frombuffer(content, np.uint8, size)
        with self._guard:
            try:
                self._check(lib.kt_simulation_restore(self._simulation, memory.pointer, self._error))
            except ArgumentError as error:
                raise ArgumentError(error.code, "restore", error.message.replace("kt_simulation_set_state", "`set_state`")) from None
            self._synchronise()
            self.torque[:] = self._applied[:] = np.frombuffer(content, np.float64, offset=size)
            self._watch.restart(bool(self.torque.any()))

    def __reduce__(self) -> Any:
        if self._events:
            raise TypeError("a simulation with events of Python cannot be pickled; save() keeps its state")
        return _restored, (self._given, self._how, self.save())

    def __deepcopy__(self, memo: Any) -> Any:
        return _restored(copy.deepcopy(self._given), self._how, self.save(), self._events)


def _digest(content: bytes) -> bytes:
    """The first bytes of a checkpoint. C trusts the rest: indices in it are not checked one by one."""
    return hashlib.blake2b(content, digest_size=_DIGEST).digest()


def _restored(model: Model, how: Json, block: bytes, events: Sequence[Event] = ()) -> Any:
    from .simulation import Simulation
    simulation = Simulation(model, **how)
    for event in events:
        simulation.on(**event.how)
    simulation.restore(block)
    return simulation
