"""Events of a simulation: those of a program, of the scene and of hard contacts."""
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from typing import Any, Callable, List, Optional

from . import callbacks
from ._core import ArgumentError, ffi, hint, lib, mistyped, name_of, text
from .checkpoint import Checkpoint
from .laws import Event, Instant

ROOM = 16  # events that a program may add
_DIRECTIONS = {"either": lib.KT_DIRECTION_EITHER, "rising": lib.KT_DIRECTION_RISING, "falling": lib.KT_DIRECTION_FALLING}


class Events(Checkpoint):
    """The part of a `Simulation` that adds events and lists them."""

    _keep: List[Any]
    _start: Optional[bytes]

    def on(self, name: str, function: Callable[[Instant], float], action: Optional[Callable[[Any], Any]] = None, *,
           direction: str = "either", stop: bool = False) -> None:
        """Add an event: steps end where ``function(instant)`` changes its sign. A simulation takes 16 events by functions.

        Parameters
        ----------
        name : str
            For `stopped` and `event_count`.
        function : callable
            A value of the state (`Instant`: t, q, v, x). It must depend on its argument alone. Or a compiled
            ``int f(const kt_instant *at, double *value, kt_error *error, void *user)``, as in `control`.
        action : callable, optional
            Called with this simulation at the event. It may call `jump`, `set_torque`, `set` and `switch`. A true result ends the call that stepped.
        direction : {"either", "rising", "falling"}
        stop : bool
            The event ends a run.
        """
        if action is not None and not callable(action):
            raise mistyped("action", "a function", action)
        if not isinstance(direction, str) or direction not in _DIRECTIONS:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "direction", f"expected one of {', '.join(_DIRECTIONS)}, got {direction!r}")
        if len(self._events) == ROOM:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "name", f"a simulation takes {ROOM} events by functions; write others into `events` of the scene")
        address = callbacks.address_of(function, "function", callbacks.EVENT)
        event = Event(self, name, function, action, direction, stop)
        handle, label = ffi.new_handle(event), ffi.new("char[]", name_of(name, "name"))
        record = ffi.new("kt_event *", {"name": label, "user": handle, "direction": _DIRECTIONS[direction], "stop": stop})
        record.function = lib.kt_python_event_value if address is None else ffi.cast("kt_event_function *", address)
        if action is not None:
            record.action = lib.kt_python_event_action
        with self._guard:
            self._check(lib.kt_simulation_event_add(self._simulation, record, self._error))
        self._events.append(event)
        self._keep += [handle, label]
        self._start = self.save() if self._start is not None and lib.kt_simulation_counts_of(self._simulation).evaluations == 0 else None

    @property
    def stopped(self) -> Optional[str]:
        """The name of the event that ended the last call, or None."""
        found = lib.kt_simulation_stopped(self._simulation)
        return None if found == ffi.NULL else text(found.name)

    @property
    def events(self) -> List[str]:
        """The names of all events: of hard contacts, of the scene, and of `on`."""
        names: List[str] = []
        while (found := lib.kt_simulation_event_name(self._simulation, len(names))) != ffi.NULL:
            names.append(text(found))
        return names

    def event_count(self, name: str) -> int:
        """How often an event has happened.

        Parameters
        ----------
        name : str
            The name in `on`, or in the scene.
        """
        wanted, names = name_of(name, "name"), self.events
        if name not in names:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "name", f"there is no event {name!r}{hint(name, names)}")
        return int(lib.kt_simulation_event_count(self._simulation, wanted))
