"""Many simulations at once, with the stages of their steps in lanes."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import contextlib
from typing import Any, Dict, List, Sequence

from ._core import address_number, check, fail, ffi, lib, mistyped
from .callbacks import Calls
from .laws import Recorder
from .simulation import Simulation


class _Together:
    """Gives the engine one simulation after the other, and takes those that have ended."""

    def __init__(self, simulations: Sequence[Simulation]) -> None:
        self.simulations, self.calls, self.begun = simulations, Calls(), 0
        self.sinks = [Recorder(each) for each in simulations]
        self.handles = [ffi.new_handle(each) for each in self.sinks]
        self.failed: Dict[int, BaseException] = {}

    def next(self, member: Any) -> bool:
        k = self.begun
        if k == len(self.simulations):
            return False
        member.simulation, member.record, member.user = self.simulations[k]._simulation, lib.kt_python_recorder, self.handles[k]
        self.begun += 1
        return True

    def done(self, member: Any, status: int, error: Any) -> None:
        if status:
            k = [address_number(each) for each in self.handles].index(address_number(member.user))
            try:
                for calls in (self.simulations[k]._calls, *(effect.calls for effect in self.simulations[k].model.effects)):
                    calls.reraise()
                fail(error, status)
            except BaseException as raised:
                self.failed[k] = raised


def ensemble(simulations: Sequence[Simulation]) -> List[Dict[str, Any]]:
    """Run simulations to their durations, with the stages of their steps in lanes. Results have the bits of `Simulation.run`.

    The models may differ in initial states, gravity, masses, centres of mass, inertias and lengths: give each simulation its own copy of
    a model (`Model.copy`). Simulations that lanes cannot compute run one after the other.

    Parameters
    ----------
    simulations : list of Simulation
        Each is at its start, or at a later time before its duration.

    Returns
    -------
    list of dict
        The records of each, as `Simulation.run` returns them. A simulation that fails has the exception as ``error``, and the records
        until then.
    """
    if not isinstance(simulations, (list, tuple)) or not all(isinstance(each, Simulation) for each in simulations):
        raise mistyped("simulations", "a list of kinetree.Simulation", simulations)
    if not simulations:
        return []
    together, error, out = _Together(simulations), ffi.new("kt_error *"), ffi.new("kt_ensemble **")
    handle = ffi.new_handle(together)
    check(lib.kt_ensemble_create(simulations[0].model._pointer, out, error), error)
    made = ffi.gc(out[0], lib.kt_ensemble_free)
    with contextlib.ExitStack() as guards:
        for each in simulations:
            guards.enter_context(each._guard)
            each._begin_run()
        status = lib.kt_ensemble_run(made, lib.kt_python_ensemble_next, lib.kt_python_ensemble_done, handle, error)
    together.calls.reraise()
    check(status, error)
    for each in simulations:
        each._warn()
    for raised in together.failed.values():
        if not isinstance(raised, Exception):  # an interrupt
            raise raised
    return [{**sink.arrays(), **({"error": together.failed[k]} if k in together.failed else {})} for k, sink in enumerate(together.sinks)]
