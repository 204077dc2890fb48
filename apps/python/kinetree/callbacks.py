"""Functions of Python that C calls: reports of faults, records, events and effects."""
from __future__ import annotations

import ctypes
from typing import Any, Callable, List, Optional, Tuple, TypeVar, Union

from ._core import ArgumentError, ffi, lib, text

_Function = TypeVar("_Function", bound=Callable[..., Any])


def _extern(**options: int) -> Callable[[_Function], _Function]:
    """Makes a function of Python the one of its name in C."""
    made: Callable[[_Function], _Function] = ffi.def_extern(**options)
    return made


class Calls:
    """What C callbacks of one object need: the functions, and the first exception that one of them raised."""

    def __init__(self) -> None:
        self.raised: Optional[BaseException] = None

    def reraise(self) -> None:
        """Raise the exception of a callback in the call that led to it."""
        if self.raised is not None:
            raised, self.raised = self.raised, None
            raise raised


@_extern()
def kt_python_report(user: Any, fault: Any) -> None:
    faults: List[Tuple[str, str]] = ffi.from_handle(user)
    faults.append((text(fault.where), text(fault.message)))


@_extern(error=-1)
def kt_python_recorder(record: Any, user: Any) -> int:
    sink = ffi.from_handle(user)
    try:
        return 1 if sink.take(record) else 0
    except BaseException as raised:  # Python cannot unwind through C
        sink.calls.raised = raised
        return 1


@_extern(error=-1)
def kt_python_event_value(at: Any, value: Any, error: Any, user: Any) -> int:
    event = ffi.from_handle(user)
    try:
        value[0] = float(event.function(event.instant(at)))
        return 0
    except BaseException as raised:
        event.calls.raised = raised
        return -1


@_extern(error=-1)
def kt_python_event_action(simulation: Any, what: Any, error: Any, user: Any) -> int:
    event = ffi.from_handle(user)
    try:
        return 1 if event.act() else 0
    except BaseException as raised:
        event.calls.raised = raised
        return -1


@_extern(error=-1)
def kt_python_joint_force(user: Any, t: float, q: float, v: float, force: Any, balance: Any) -> int:
    effect = ffi.from_handle(user)
    try:
        force[0] = float(effect.function(t, q, v))
        return 0
    except BaseException as raised:
        effect.calls.raised = raised
        return -1


@_extern(error=-1)
def kt_python_control_law(user: Any, t: float, q: Any, v: Any, tau: Any) -> int:
    law = ffi.from_handle(user)
    try:
        return int(law.turn(t))
    except BaseException as raised:
        law.calls.raised = raised
        return -1


class Compiled:
    """The address of a compiled function, for `JointForce`, `Simulation.control` and `Simulation.on`.

    Functions of `numba.cfunc` and of ctypes need no wrapper. A plain number is rejected, since a wrong one would crash.

    Parameters
    ----------
    address : int
        The address of a function with the right signature, which nothing checks.
    owner : object, optional
        An object that must live as long as the function, such as its library.
    """

    def __init__(self, address: int, owner: Any = None) -> None:
        if isinstance(address, bool) or not isinstance(address, int) or not 0 < address < 1 << 64:
            raise ArgumentError(lib.KT_ERROR_ARGUMENT, "address", f"expected an address, got {address!r}")
        self.address, self.owner = address, owner


def address_of(function: Any, what: str) -> Optional[int]:
    """The address of a compiled function. None: it is a function of Python."""
    found = getattr(function, "address", None)
    if isinstance(found, int):
        return found
    if isinstance(function, ctypes._CFuncPtr):  # type: ignore[attr-defined]
        return ctypes.cast(function, ctypes.c_void_p).value
    if callable(function):
        return None
    remedy = "; wrap an address: kinetree.Compiled(address)" if isinstance(function, int) else ""
    raise ArgumentError(lib.KT_ERROR_ARGUMENT, what, f"expected a function, got {type(function).__name__}{remedy}")


class JointForce:
    """A force or torque in one joint coordinate by a function ``force(t, q, v)``.

    Parameters
    ----------
    joint : str
        The joint, as ``joint`` of an effect in a scene.
    function : callable
        A function of Python (slow: the engine calls it at each evaluation), or a compiled
        ``int f(void *user, double t, double q, double v, double *force, kt_effect_balance *balance)`` of ``numba.cfunc``, ctypes, or `Compiled`.
    name : str, optional
        The name of the effect in records and messages.
    """

    def __init__(self, joint: str, function: Union[Callable[[float, float, float], float], Compiled, Any], name: Optional[str] = None) -> None:
        self.joint, self.function, self.name = joint, function, name
        self.address = address_of(function, "function")
        self.calls = Calls()
        self._keep: List[Any] = []

    def fill(self, effect: Any) -> None:
        """Write this effect to a ``kt_effect``."""
        self._keep = [ffi.new_handle(self), ffi.new("char[]", self.joint.encode())]
        effect.type = lib.KT_EFFECT_CUSTOM
        effect.joint = self._keep[1]
        if self.name is not None:
            self._keep.append(ffi.new("char[]", self.name.encode()))
            effect.name = self._keep[2]
        if self.address is None:
            effect.joint_force = lib.kt_python_joint_force
            effect.user = self._keep[0]
        else:
            effect.joint_force = ffi.cast("kt_effect_joint_force_callback *", self.address)
